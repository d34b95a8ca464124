//! How much a smooth boundary reflects.

use fearless_simd::{Select, f64x8, prelude::*};
use num_complex::Complex64;

use crate::{Error, Result};

/// The smallest index of refraction of a conductor.
pub const MIN_INDEX: f64 = 0.001;

/// The largest index of refraction and the largest extinction of a [`Fresnel`].
pub const MAX_INDEX: f64 = 100.0;

/// What share of unpolarised light a smooth boundary reflects, as a function of the angle of
/// incidence.
///
/// The parameters are those of one channel: a coloured metal is one `Fresnel` a channel. Light
/// comes from the outside, so indices are relative to what is outside, which is air as a rule. With
/// c the cosine of the angle between the light and the boundary's normal, which is the half vector
/// in a microfacet lobe, the reflectance is as said at each variant.
///
/// ```
/// use lobes::reflectance::Fresnel;
/// let glass = Fresnel::Dielectric { index: 1.5 };
/// assert!((glass.reflectance(1.0) - 0.04).abs() < 1e-15);
/// assert!((glass.reflectance(0.0) - 1.0).abs() < 1e-15);
/// // A conductor that absorbs nothing is a dielectric.
/// let same = Fresnel::Conductor { index: 1.5, extinction: 0.0 };
/// assert!((glass.reflectance(0.3) - same.reflectance(0.3)).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredFresnel", rename_all = "snake_case")
)]
pub enum Fresnel {
    /// The same at every angle, in [0, 1]. Of 1 it is the white furnace of a lobe.
    Constant(f64),
    /// `F₀ + (1 − F₀)(1 − c)⁵`: Schlick 1994, *An Inexpensive BRDF Model for Physically-based
    /// Rendering*, [doi:10.1111/1467-8659.1330233](https://doi.org/10.1111/1467-8659.1330233).
    Schlick {
        /// `F₀`, the reflectance along the normal, in [0, 1].
        normal: f64,
    },
    /// Fresnel's equations for a transparent body of index n: with `g = √(n² − 1 + c²)`,
    /// `½ ((c − g)/(c + g))² + ½ ((n²c − g)/(n²c + g))²`.
    Dielectric {
        /// n, in [1, [`MAX_INDEX`]].
        index: f64,
    },
    /// Fresnel's equations for an absorbing body: as for the dielectric, with the complex index n +
    /// ik in place of n and the moduli of the two fractions.
    Conductor {
        /// n, in [[`MIN_INDEX`], [`MAX_INDEX`]].
        index: f64,
        /// k, in [0, [`MAX_INDEX`]].
        extinction: f64,
    },
}

/// A boundary as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredFresnel {
    Constant(f64),
    Schlick { normal: f64 },
    Dielectric { index: f64 },
    Conductor { index: f64, extinction: f64 },
}

#[cfg(feature = "serde")]
impl TryFrom<StoredFresnel> for Fresnel {
    type Error = Error;

    fn try_from(stored: StoredFresnel) -> Result<Self> {
        let fresnel = match stored {
            StoredFresnel::Constant(value) => Self::Constant(value),
            StoredFresnel::Schlick { normal } => Self::Schlick { normal },
            StoredFresnel::Dielectric { index } => Self::Dielectric { index },
            StoredFresnel::Conductor { index, extinction } => Self::Conductor { index, extinction },
        };
        fresnel.check()?;
        Ok(fresnel)
    }
}

impl Fresnel {
    /// Three channels from what files and calls say of them: F₀ along the normal alone (Schlick), an
    /// index alone (a dielectric), or an index and an extinction (a conductor); none where too little
    /// or too much is said. Values are not looked at: [`check`](Self::check).
    ///
    /// ```
    /// use lobes::reflectance::Fresnel;
    /// let glass = Fresnel::of_channels(None, Some([1.5; 3]), None);
    /// assert_eq!(glass, Some([Fresnel::Dielectric { index: 1.5 }; 3]));
    /// assert_eq!(Fresnel::of_channels(Some([0.04; 3]), Some([1.5; 3]), None), None);
    /// ```
    pub fn of_channels(
        f0: Option<[f64; 3]>,
        index: Option<[f64; 3]>,
        extinction: Option<[f64; 3]>,
    ) -> Option<[Self; 3]> {
        match (f0, index, extinction) {
            (Some(f0), None, None) => Some(f0.map(|normal| Self::Schlick { normal })),
            (None, Some(index), None) => Some(index.map(|index| Self::Dielectric { index })),
            (None, Some(index), Some(extinction)) => {
                Some([0, 1, 2].map(|channel| Self::Conductor {
                    index: index[channel],
                    extinction: extinction[channel],
                }))
            }
            _ => None,
        }
    }

    /// What [`of_channels`](Self::of_channels) makes three channels of: F₀, index and extinction,
    /// each where all channels have it.
    ///
    /// ```
    /// use lobes::reflectance::Fresnel;
    /// let glass = [Fresnel::Dielectric { index: 1.5 }; 3];
    /// let [f0, index, extinction] = Fresnel::channels(glass);
    /// assert_eq!((f0, index, extinction), (None, Some([1.5; 3]), None));
    /// assert_eq!(Fresnel::of_channels(f0, index, extinction), Some(glass));
    /// ```
    pub fn channels(fresnel: [Self; 3]) -> [Option<[f64; 3]>; 3] {
        let each = |of: fn(Self) -> Option<f64>| {
            let [red, green, blue] = fresnel.map(of);
            Some([red?, green?, blue?])
        };
        [
            each(|fresnel| match fresnel {
                Self::Schlick { normal } => Some(normal),
                _ => None,
            }),
            each(|fresnel| match fresnel {
                Self::Dielectric { index } | Self::Conductor { index, .. } => Some(index),
                _ => None,
            }),
            each(|fresnel| match fresnel {
                Self::Conductor { extinction, .. } => Some(extinction),
                _ => None,
            }),
        ]
    }

    /// Whether every parameter is allowed.
    ///
    /// # Errors
    /// [`Error::Domain`] names the first that is not.
    pub fn check(self) -> Result<()> {
        let within = |what, value: f64, holds: bool, allowed| {
            if holds {
                Ok(())
            } else {
                Err(Error::Domain {
                    what,
                    value,
                    allowed,
                })
            }
        };
        let reflectance =
            |what, value: f64| within(what, value, (0.0..=1.0).contains(&value), "in [0, 1]");
        match self {
            Self::Constant(value) => reflectance("the reflectance of a boundary", value),
            Self::Schlick { normal } => reflectance("the reflectance F₀ along the normal", normal),
            Self::Dielectric { index } => within(
                "the index of refraction of a dielectric",
                index,
                (1.0..=MAX_INDEX).contains(&index),
                "in [1, 100]; it is that of the body over that of what is outside",
            ),
            Self::Conductor { index, extinction } => {
                within(
                    "the index of refraction of a conductor",
                    index,
                    (MIN_INDEX..=MAX_INDEX).contains(&index),
                    "in [0.001, 100]",
                )?;
                within(
                    "the extinction of a conductor",
                    extinction,
                    (0.0..=MAX_INDEX).contains(&extinction),
                    "in [0, 100]",
                )
            }
        }
    }

    /// The share that is reflected at this cosine of the angle of incidence, which is taken to the
    /// nearest of [0, 1].
    ///
    /// To 10⁻¹⁴ of the value, but for an index within a thousandth of 1, of which next to nothing
    /// is reflected. A NaN where the cosine is one or where a parameter is not allowed
    /// ([`check`](Self::check)).
    pub fn reflectance(self, cosine: f64) -> f64 {
        let c = cosine.clamp(0.0, 1.0);
        match self {
            // So that a NaN stays one.
            Self::Constant(value) => value + 0.0 * c,
            Self::Schlick { normal } => normal + (1.0 - normal) * (1.0 - c).powi(5),
            Self::Dielectric { index } => {
                let square = index * index;
                let excess = (index - 1.0) * (index + 1.0);
                let g = (excess + c * c).sqrt();
                // The differences c² − g² and n⁴c² − g² without their cancellation. Nothing over
                // nothing is what an index of 1 has at grazing.
                let over = |part: f64, sum: f64| part / (sum * sum).max(f64::MIN_POSITIVE);
                let across = over(excess, c + g);
                let along = over(excess * ((square + 1.0) * c * c - 1.0), square * c + g);
                0.5 * (across * across + along * along)
            }
            Self::Conductor { index, extinction } => {
                let (p, q) = square_of_index(index, extinction);
                // g = √((n + ik)² − 1 + c²) = a + ib.
                let d = excess_of_index(index, extinction) + c * c;
                let larger = (0.5 * (d.hypot(q) + d.abs())).sqrt();
                let smaller = 0.5 * q / larger.max(f64::MIN_POSITIVE);
                let (a, b) = if d >= 0.0 {
                    (larger, smaller)
                } else {
                    (smaller, larger)
                };
                let square = |x: f64| x * x;
                // Nothing over nothing is what an index of 1 has at grazing.
                let over = |part: f64, whole: f64| part / whole.max(f64::MIN_POSITIVE);
                let across = over(square(c - a) + b * b, square(c + a) + b * b);
                let along = over(
                    square(p * c - a) + square(q * c - b),
                    square(p * c + a) + square(q * c + b),
                );
                0.5 * (across + along)
            }
        }
    }

    /// The same for cosines in [0, 1], of parameters that are allowed.
    #[inline(always)]
    pub(crate) fn reflectances<S: Simd>(self, simd: S, c: f64x8<S>) -> f64x8<S> {
        let splat = |value: f64| f64x8::splat(simd, value);
        match self {
            Self::Constant(value) => splat(value),
            Self::Schlick { normal } => {
                let rest = splat(1.0) - c;
                let square = rest * rest;
                square * square * rest * (1.0 - normal) + normal
            }
            Self::Dielectric { index } => {
                let square = index * index;
                let excess = (index - 1.0) * (index + 1.0);
                let g = (c * c + excess).sqrt();
                let tiny = splat(f64::MIN_POSITIVE);
                let sum = c + g;
                let across = splat(excess) / (sum * sum).max(tiny);
                let sum = c * square + g;
                let along = (c * c * (square + 1.0) - 1.0) * excess / (sum * sum).max(tiny);
                (across * across + along * along) * 0.5
            }
            Self::Conductor { index, extinction } => {
                let (p, q) = square_of_index(index, extinction);
                let d = c * c + excess_of_index(index, extinction);
                // The squares of what is tiny are 0.
                let modulus = (d * d + q * q).sqrt().max(d.abs());
                let larger = ((modulus + d.abs()) * 0.5).sqrt();
                let smaller = splat(0.5 * q) / larger.max(splat(f64::MIN_POSITIVE));
                let positive = d.simd_ge(splat(0.0));
                let a = positive.select(larger, smaller);
                let b = positive.select(smaller, larger);
                let b2 = b * b;
                let (minus, plus) = (c - a, c + a);
                let tiny = splat(f64::MIN_POSITIVE);
                let across = (minus * minus + b2) / (plus * plus + b2).max(tiny);
                let (real, imaginary) = (c * p, c * q);
                let (minus, plus) = (real - a, real + a);
                let (minus_i, plus_i) = (imaginary - b, imaginary + b);
                let along = (minus * minus + minus_i * minus_i) / (plus * plus + plus_i * plus_i);
                (across + along) * 0.5
            }
        }
    }

    /// At least |F| where the square of the cosine is complex and within `off` of `square`, F
    /// continued analytically from [0, 1]; infinite where it is not known to be analytic there.
    ///
    /// For |z| < 1 is |√(1 + z) − 1| ≤ 1 − √(1 − |z|), so that c = √s is within
    /// |c₀| (1 − √(1 − d/|s₀|)) of c₀ where s is within d of s₀, and likewise
    /// g = √((n + ik)² − 1 + s). The continued reflectance of a conductor is half the sum of
    /// (c − g)(c − g')/((c + g)(c + g')), where g' is as g with n − ik, and of the same with
    /// (n ± ik)² c in place of c.
    pub(crate) fn bound(self, square: Complex64, off: f64) -> f64 {
        // The root and how far it may be off.
        let root = |square: Complex64| {
            let share = off / square.norm();
            let root = square.sqrt();
            (share < 1.0).then(|| (root, root.norm() * (1.0 - (1.0 - share).sqrt())))
        };
        let cosine = root(square);
        let (index, (c, c_off)) = match (self, cosine) {
            (Self::Constant(value), _) => return value,
            (_, None) => return f64::INFINITY,
            (Self::Schlick { normal }, Some((c, c_off))) => {
                let rest = (1.0 - c).norm() + c_off;
                return rest.powi(5).mul_add(1.0 - normal, normal);
            }
            (Self::Dielectric { index }, Some(cosine)) => (Complex64::from(index), cosine),
            (Self::Conductor { index, extinction }, Some(cosine)) => {
                (Complex64::new(index, extinction), cosine)
            }
        };
        // The sizes of both amplitudes for n + ik and for n − ik.
        let amplitudes = [index, index.conj()].map(|index| {
            let index = index * index;
            let (g, g_off) = root(index - 1.0 + square)?;
            let quotient = |other: Complex64, off: f64| {
                let (above, below) = ((other - g).norm() + off, (other + g).norm() - off);
                (below > 0.0).then(|| above / below)
            };
            let across = quotient(c, c_off + g_off)?;
            let along = quotient(index * c, index.norm() * c_off + g_off)?;
            Some([across, along])
        });
        match amplitudes {
            [Some([across, along]), Some([other_across, other_along])] => {
                0.5 * (across * other_across + along * other_along)
            }
            _ => f64::INFINITY,
        }
    }
}

/// (n + ik)², its real and its imaginary part.
fn square_of_index(index: f64, extinction: f64) -> (f64, f64) {
    (
        (index - extinction) * (index + extinction),
        2.0 * index * extinction,
    )
}

/// The real part of (n + ik)² − 1.
fn excess_of_index(index: f64, extinction: f64) -> f64 {
    (index - 1.0) * (index + 1.0) - extinction * extinction
}
