//! Other people's conventions for coefficients, by name.

use std::f64::consts::{PI, SQRT_2};

use num_complex::Complex64;

use super::coefficients::{Coefficients, coefficient_count, saturated};
use crate::error::check_length;
use crate::{Error, Result};

/// What ∫ |Y_lm|² dω is.
///
/// ```
/// use lobes::harmonics::{Coefficients, Convention, Normalisation, Order, Phase};
/// let mut f = Coefficients::zeros(1);
/// f.set(1, 0, 1.0)?;
/// let schmidt = Convention { normalisation: Normalisation::Schmidt, phase: Phase::Plain };
/// let value = f.to_real(schmidt, Order::ByDegree)[2];
/// assert!((value - (3.0 / (4.0 * std::f64::consts::PI)).sqrt()).abs() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Normalisation {
    /// 1: this crate, ducc0, healpy, SciPy, SHTns' default, sphericart.
    #[default]
    Orthonormal,
    /// 4π: geodesy, pyshtools' default.
    FourPi,
    /// 4π/(2l+1): Schmidt's semi-normalisation, geomagnetism.
    Schmidt,
}

impl Normalisation {
    /// What an orthonormal coefficient of degree l is multiplied by: the inverse of the factor of
    /// the basis function.
    fn factor(self, l: usize) -> f64 {
        match self {
            Self::Orthonormal => 1.0,
            Self::FourPi => 1.0 / (4.0 * PI).sqrt(),
            Self::Schmidt => ((2 * l + 1) as f64 / (4.0 * PI)).sqrt(),
        }
    }
}

/// Whether the basis has the factor (−1)^m of Condon and Shortley.
///
/// ```
/// use lobes::harmonics::{Coefficients, Convention, Order};
/// let mut f = Coefficients::zeros(1);
/// f.set(1, 1, 1.0)?;
/// // Orthonormal as this crate's, with the phase of Condon and Shortley.
/// assert_eq!(f.to_real(Convention::HEALPIX, Order::ByDegree)[3], -1.0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Phase {
    /// No: this crate, sphericart, pyshtools' default.
    #[default]
    Plain,
    /// Yes: ducc0, healpy, SciPy, SHTns, drjit.
    CondonShortley,
}

impl Phase {
    fn sign(self, m: usize) -> f64 {
        if self == Self::CondonShortley && m % 2 == 1 {
            -1.0
        } else {
            1.0
        }
    }
}

/// A convention of basis functions: a normalisation and a phase.
///
/// [`Convention::default`] is this crate's own.
///
/// ```
/// use lobes::harmonics::{Coefficients, Convention, Order};
/// let mut f = Coefficients::zeros(2);
/// f.set(2, -1, 3.0)?;
/// let theirs = f.to_real(Convention::HEALPIX, Order::ByDegree);
/// assert_eq!(Coefficients::from_real(2, Convention::HEALPIX, Order::ByDegree, &theirs)?, f);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Convention {
    /// The normalisation.
    pub normalisation: Normalisation,
    /// The phase.
    pub phase: Phase,
}

impl Convention {
    /// ducc0, healpy, SciPy, SHTns: orthonormal, with the Condon–Shortley phase.
    pub const HEALPIX: Self = Self {
        normalisation: Normalisation::Orthonormal,
        phase: Phase::CondonShortley,
    };

    fn factor(self, l: usize, m: usize) -> f64 {
        self.normalisation.factor(l) * self.phase.sign(m)
    }
}

/// An order of storage of real coefficients.
///
/// ```
/// use lobes::harmonics::{Coefficients, Convention, Order};
/// let mut f = Coefficients::zeros(1);
/// f.set(1, -1, 2.0)?;
/// assert_eq!(f.to_real(Convention::default(), Order::ByDegree), [0.0, 2.0, 0.0, 0.0]);
/// assert_eq!(f.to_real(Convention::default(), Order::ByOrder), [0.0, 0.0, 0.0, 2.0]);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Order {
    /// This crate's: by order, l contiguous, the cosine column before the sine column.
    #[default]
    ByOrder,
    /// l² + l + m: by degree, m from −l to l. sphericart, drjit, e3nn, ambisonics' ACN.
    ByDegree,
}

impl Coefficients {
    /// The real coefficients in another convention and order of storage, all (degree + 1)² of them.
    ///
    /// ```
    /// use lobes::harmonics::{Coefficients, Convention, Order};
    /// let mut f = Coefficients::zeros(1);
    /// f.set(1, -1, 2.0)?;
    /// let flat = f.to_real(Convention::HEALPIX, Order::ByDegree);
    /// assert_eq!(flat, [0.0, -2.0, 0.0, 0.0]);
    /// assert_eq!(Coefficients::from_real(1, Convention::HEALPIX, Order::ByDegree, &flat)?, f);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn to_real(&self, convention: Convention, order: Order) -> Vec<f64> {
        let mut out = vec![0.0; coefficient_count(self.degree(), self.degree())];
        for_each(self.degree(), order, |at, l, m| {
            out[at] = self.get(l, m) * convention.factor(l, m.unsigned_abs());
        });
        out
    }

    /// From real coefficients in another convention and order of storage.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are (degree + 1)² of them.
    pub fn from_real(
        degree: usize,
        convention: Convention,
        order: Order,
        values: &[f64],
    ) -> Result<Self> {
        check_length(
            "the real coefficients",
            coefficient_count(degree, degree),
            values.len(),
        )?;
        let mut f = Self::zeros(degree);
        for_each(degree, order, |at, l, m| {
            if let Some(index) = f.index(l, m) {
                f.as_mut_slice()[index] = values[at] / convention.factor(l, m.unsigned_abs());
            }
        });
        Ok(f)
    }

    /// The complex coefficients a_lm, m ≥ 0, of f = Σ a_lm Y_lm over all m, where a_l,−m is ā_lm,
    /// times (−1)^m with the Condon–Shortley phase. By order, l = m … degree contiguous, as ducc0
    /// and healpy store them.
    ///
    /// ```
    /// use lobes::harmonics::{Coefficients, Convention};
    /// let mut f = Coefficients::zeros(1);
    /// f.set(1, 1, 2f64.sqrt())?;
    /// let a = f.to_complex(Convention::HEALPIX);
    /// assert!((a[2].re + 1.0).abs() < 1e-15 && a[2].im == 0.0); // a_11
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn to_complex(&self, convention: Convention) -> Vec<Complex64> {
        let degree = self.degree();
        let mut out = Vec::with_capacity(complex_count(degree));
        for m in 0..=degree {
            for l in m..=degree {
                let factor = convention.factor(l, m);
                out.push(if m == 0 {
                    Complex64::from(self.get(l, 0) * factor)
                } else {
                    let m = m as isize;
                    Complex64::new(self.get(l, m), -self.get(l, -m)) * (factor / SQRT_2)
                });
            }
        }
        out
    }

    /// From complex coefficients as [`to_complex`](Self::to_complex) gives them. The imaginary
    /// parts of a_l0 must be 0: a real function has none.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are (degree + 1)(degree + 2)/2 of them; [`Error::Domain`]
    /// where an a_l0 is not real.
    pub fn from_complex(
        degree: usize,
        convention: Convention,
        values: &[Complex64],
    ) -> Result<Self> {
        check_length(
            "the complex coefficients",
            complex_count(degree),
            values.len(),
        )?;
        let mut f = Self::zeros(degree);
        let mut values = values.iter();
        for m in 0..=degree {
            for (l, a) in (m..=degree).zip(&mut values) {
                let factor = convention.factor(l, m);
                if m == 0 {
                    if a.im != 0.0 {
                        return Err(Error::Domain {
                            what: "the imaginary part of a coefficient of order 0",
                            value: a.im,
                            allowed: "0, as a real function needs",
                        });
                    }
                    f.set(l, 0, a.re / factor)?;
                } else {
                    // By the very factor that `to_complex` multiplies by, so that as much as can
                    // comes back to the bit.
                    let a = a / (factor / SQRT_2);
                    f.set(l, m as isize, a.re)?;
                    f.set(l, -(m as isize), -a.im)?;
                }
            }
        }
        Ok(f)
    }
}

/// How many coefficients of orders m ≥ 0 there are: (degree + 1)(degree + 2)/2, or the largest
/// `usize` where that is beyond it.
fn complex_count(degree: usize) -> usize {
    let l = degree as u128;
    saturated((l + 1).saturating_mul(l + 2) / 2)
}

/// Calls `f(index, l, m)` for each coefficient.
fn for_each(degree: usize, order: Order, mut f: impl FnMut(usize, usize, isize)) {
    match order {
        Order::ByDegree => {
            for l in 0..=degree {
                for m in -(l as isize)..=l as isize {
                    f((l * l + l).wrapping_add_signed(m), l, m);
                }
            }
        }
        Order::ByOrder => {
            let mut at = 0;
            for m in 0..=degree as isize {
                for sign in if m == 0 { &[1][..] } else { &[1, -1] } {
                    for l in m.unsigned_abs()..=degree {
                        f(at, l, sign * m);
                        at += 1;
                    }
                }
            }
        }
    }
}
