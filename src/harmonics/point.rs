//! Harmonics at directions: all of them, or their sum and its gradient.

use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};
use glam::DVec3;

use super::coefficients::{Coefficients, coefficient_count, column_start};
use super::lane::Lane;
use super::recurrence::{LANES, Lanes};
use super::simd::wide;
use super::work::{over_chunk_pairs, over_chunks};
use crate::error::{all_finite, check_length, not_finite};
use crate::numeric::double_double::DoubleDouble;
use crate::numeric::wide_double::WideDouble;
use crate::{Error, Parallelism, Result, vectors};

/// The largest degree of a [`Basis`].
pub const MAX_BASIS_DEGREE: usize = 2048;

/// Beyond this degree the recurrence runs in double-double arithmetic.
pub(super) const DOUBLE_DEGREE: usize = 48;

/// The values are carried multiplied by this, so that no P̄_mm that matters later underflows: the
/// smallest, at m = 2048/e, is 10⁻³²⁷.
const SCALE: f64 = (1u128 << 127) as f64 * (1u128 << 127) as f64 * (1u128 << 127) as f64;

/// As near the pole as this a direction is the pole: no value changes by more.
const POLE: f64 = 1e-140;

/// How many directions one thread takes at a time.
const CHUNK: usize = 8 * LANES;

/// How many eights of directions share the sums across lanes in [`Basis::sums_adjoint`].
const TOGETHER: usize = 4;

/// The parts of [`Basis::sums_adjoint`]: at most so many, and so many values in all of them.
const MOST_PARTS: usize = 16;
const PART_VALUES: usize = 1 << 24;

/// All harmonics up to a degree at any directions: a plan, immutable and shared by cloning.
///
/// P̄_lm = α_l p_l with p_{l+1} = a_l cos θ p_l − p_{l−1}, carried as differences: D_{l+1} = D_l +
/// (a_l − 2 − a_l (1 − cos θ)) p_l, p_{l+1} = p_l + D_{l+1}, from the pole of the direction's own
/// hemisphere. 1 − cos θ, sin θ and the azimuth's sine and cosine come from the Cartesian direction
/// in double-double, so that no pole loses digits; beyond degree 48 the recurrence is in
/// double-double too. Each value is within 16 ε √((2l+1)/4π) for l ≤ 45 and 64 ε √((2l+1)/4π) for l
/// ≤ 2047.
///
/// ```
/// use lobes::{Parallelism, glam::DVec3, harmonics::Basis};
/// let basis = Basis::new(1)?;
/// let mut y = [0.0; 4];
/// basis.values(&[DVec3::Z], &mut y, Parallelism::Sequential)?;
/// assert!((y[1] - (0.75 / std::f64::consts::PI).sqrt()).abs() < 1e-16); // Y_1^0
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Clone)]
pub struct Basis(Arc<Tables>);

struct Tables {
    degree: usize,
    level: Level,
    /// By order, l = m … degree.
    steps: Vec<DegreeStep>,
    starts: Vec<usize>,
    /// P̄_mm / (α_m sin^m θ).
    firsts: Vec<DoubleDouble>,
}

#[derive(Clone, Copy)]
struct DegreeStep {
    a: DoubleDouble,
    /// a − 2.
    excess: DoubleDouble,
    alpha: f64,
    /// √((l² − m²)(2l+1)/(2l−1)), of the derivative.
    slope: f64,
}

/// Eight directions.
struct EightDirections {
    /// 1 − |cos θ|, high and low.
    y: [Lanes; 2],
    sin: [Lanes; 2],
    cos_phi: [Lanes; 2],
    sin_phi: [Lanes; 2],
    /// −1 in the southern hemisphere.
    side: Lanes,
}

impl Basis {
    /// Tables for all l ≤ `degree`.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_BASIS_DEGREE`].
    pub fn new(degree: usize) -> Result<Self> {
        if degree > MAX_BASIS_DEGREE {
            return Err(Error::Degree {
                what: "the basis at directions",
                degree,
                limit: MAX_BASIS_DEGREE,
            });
        }
        let mut tables = Tables {
            degree,
            level: vectors::level(),
            steps: Vec::with_capacity((degree + 1) * (degree + 2) / 2),
            starts: vec![0],
            firsts: Vec::with_capacity(degree + 1),
        };
        let mut square = DoubleDouble::ONE.divide(DoubleDouble::PI.scale(4.0));
        for m in 0..=degree {
            if m > 0 {
                let twice = if m == 1 { 2.0 } else { 1.0 };
                square = square
                    .scale(twice * (2 * m + 1) as f64)
                    .divide(DoubleDouble::from((2 * m) as f64));
            }
            let start = tables.steps.len();
            push_steps(m, degree, &mut tables.steps);
            tables.starts.push(tables.steps.len());
            let alpha_square = tables.steps[start].a.scale(0.5);
            tables.firsts.push(square.divide(alpha_square).sqrt());
        }
        Ok(Self(Arc::new(tables)))
    }

    /// The largest degree.
    pub fn degree(&self) -> usize {
        self.0.degree
    }

    /// How many harmonics there are: (degree + 1)².
    pub fn count(&self) -> usize {
        coefficient_count(self.0.degree, self.0.degree)
    }

    /// Every Y_l^m at each direction of the harmonic frame: `out[direction · count + index]`, the
    /// index that of [`Coefficients`].
    ///
    /// Directions need not be of unit length. At a pole the azimuth is 0.
    ///
    /// # Errors
    /// [`Error::Length`] unless `out` has directions × [`count`](Self::count) values;
    /// [`Error::Domain`] for a direction of no or of infinite length.
    pub fn values(
        &self,
        directions: &[DVec3],
        out: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let count = self.check_values(directions, out.len())?;
        over_chunks(parallelism, out, CHUNK * count, |chunk, out| {
            let directions = &directions[chunk * CHUNK..];
            for (out, directions) in out.chunks_mut(LANES * count).zip(directions.chunks(LANES)) {
                self.0.values_at_eight(directions, out);
            }
        });
        Ok(())
    }

    /// Checks what goes into [`values`](Self::values), and says how many a direction has.
    fn check_values(&self, directions: &[DVec3], out: usize) -> Result<usize> {
        let count = self.count();
        let needed = directions.len().saturating_mul(count);
        check_length("the output of the basis", needed, out)?;
        check_directions(directions)?;
        Ok(count)
    }

    /// [`values`](Self::values) in single precision: worked out in double, and rounded.
    ///
    /// ```
    /// use lobes::{Parallelism, glam::DVec3, harmonics::Basis};
    /// let mut values = [0f32; 4];
    /// Basis::new(1)?.values_single(&[DVec3::Z], &mut values, Parallelism::Sequential)?;
    /// assert_eq!(values[1], (3.0 / (4.0 * std::f64::consts::PI)).sqrt() as f32);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`values`](Self::values).
    pub fn values_single(
        &self,
        directions: &[DVec3],
        out: &mut [f32],
        parallelism: Parallelism,
    ) -> Result<()> {
        let count = self.check_values(directions, out.len())?;
        over_chunks(parallelism, out, CHUNK * count, |chunk, out| {
            let directions = &directions[chunk * CHUNK..];
            let mut values = vec![0.0; LANES * count];
            for (out, directions) in out.chunks_mut(LANES * count).zip(directions.chunks(LANES)) {
                let values = &mut values[..out.len()];
                self.0.values_at_eight(directions, values);
                for (out, value) in out.iter_mut().zip(values) {
                    *out = *value as f32;
                }
            }
        });
        Ok(())
    }

    /// Every Y_l^m at each direction and its gradient on the unit sphere: `values` as of
    /// [`values`](Self::values), and `gradients[(3 direction + axis) · count + index]` the
    /// components of the tangent vector whose product with a small step is the change of the value.
    /// (sphericart's layout, but for the index.)
    ///
    /// # Errors
    /// As [`values`](Self::values); `gradients` has three times as many numbers as `values`.
    pub fn values_and_gradients(
        &self,
        directions: &[DVec3],
        values: &mut [f64],
        gradients: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let count = self.count();
        check_length(
            "the values of the basis",
            directions.len().saturating_mul(count),
            values.len(),
        )?;
        check_length(
            "the gradients of the basis",
            directions.len().saturating_mul(3 * count),
            gradients.len(),
        )?;
        check_directions(directions)?;
        let tables = &*self.0;
        let length = CHUNK * count;
        over_chunk_pairs(
            parallelism,
            (values, length),
            (gradients, 3 * length),
            |chunk, values, gradients| {
                let directions = &directions[chunk * CHUNK..];
                for ((values, gradients), directions) in values
                    .chunks_mut(LANES * count)
                    .zip(gradients.chunks_mut(3 * LANES * count))
                    .zip(directions.chunks(LANES))
                {
                    values.fill(0.0);
                    gradients.fill(0.0);
                    wide!(tables.level, simd => {
                        let octet = EightDirections::new(simd, directions);
                        if tables.degree <= DOUBLE_DEGREE {
                            tables.write_gradients::<_, false>(simd, &octet, values, gradients);
                        } else {
                            tables.write_gradients::<_, true>(simd, &octet, values, gradients);
                        }
                    });
                }
            },
        );
        Ok(())
    }

    /// Σ f_lm Y_l^m at each direction.
    ///
    /// # Errors
    /// [`Error::Length`] where the set has another degree than the basis, or `out` not one value a
    /// direction; [`Error::Domain`] for a direction of no or of infinite length;
    /// [`Error::NotFinite`] where a coefficient is not finite, [`Error::Overflow`] where they are
    /// and a sum is not.
    pub fn sums(
        &self,
        coefficients: &Coefficients,
        directions: &[DVec3],
        out: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        check_length("the output of the sums", directions.len(), out.len())?;
        self.check(coefficients, directions)?;
        let tables = &*self.0;
        over_chunks(parallelism, out, CHUNK, |chunk, out| {
            let directions = &directions[chunk * CHUNK..];
            for (out, directions) in out.chunks_mut(LANES).zip(directions.chunks(LANES)) {
                let sums = wide!(tables.level, simd => {
                    let octet = EightDirections::new(simd, directions);
                    if tables.degree <= DOUBLE_DEGREE {
                        tables.sum::<_, false>(simd, coefficients, &octet)
                    } else {
                        tables.sum::<_, true>(simd, coefficients, &octet)
                    }
                });
                out.copy_from_slice(&sums[..out.len()]);
            }
        });
        if all_finite(out) {
            Ok(())
        } else {
            Err(not_finite(
                "the sums",
                "the coefficients",
                coefficients.as_slice(),
            ))
        }
    }

    /// Σ f_lm Y_l^m and its gradient on the unit sphere at each direction: the value, and the
    /// tangent vector whose product with a small step is the change of the value.
    ///
    /// # Errors
    /// As [`sums`](Self::sums).
    pub fn gradients(
        &self,
        coefficients: &Coefficients,
        directions: &[DVec3],
        out: &mut [(f64, DVec3)],
        parallelism: Parallelism,
    ) -> Result<()> {
        check_length("the output of the gradients", directions.len(), out.len())?;
        self.check(coefficients, directions)?;
        let tables = &*self.0;
        over_chunks(parallelism, out, CHUNK, |chunk, out| {
            let directions = &directions[chunk * CHUNK..];
            for (out, directions) in out.chunks_mut(LANES).zip(directions.chunks(LANES)) {
                let (octet, [value, theta, phi]) = wide!(tables.level, simd => {
                    let octet = EightDirections::new(simd, directions);
                    let slope = if tables.degree <= DOUBLE_DEGREE {
                        tables.slope::<_, false>(simd, coefficients, &octet)
                    } else {
                        tables.slope::<_, true>(simd, coefficients, &octet)
                    };
                    (octet, slope)
                });
                for (i, out) in out.iter_mut().enumerate() {
                    let (c, s) = (octet.cos_phi[0][i], octet.sin_phi[0][i]);
                    let cos = octet.cos(i);
                    let south = DVec3::new(cos * c, cos * s, -octet.sin[0][i]);
                    let east = DVec3::new(-s, c, 0.0);
                    *out = (value[i], theta[i] * south + phi[i] * east);
                }
            }
        });
        if out
            .iter()
            .all(|(value, slope)| value.is_finite() && slope.is_finite())
        {
            Ok(())
        } else {
            Err(not_finite(
                "the gradients",
                "the coefficients",
                coefficients.as_slice(),
            ))
        }
    }

    /// The adjoint of [`sums`](Self::sums): Σ_i y_i Y_l^m(ω_i), all orders.
    ///
    /// For every coefficient set c the sum over directions of sums(c) times y is the sum over
    /// coefficients of c times sums_adjoint(y), to 10⁻¹³ of the product of the two lengths.
    ///
    /// ```
    /// use lobes::{Parallelism, glam::DVec3, harmonics::Basis};
    /// // Weights on the six directions of the axes, under which degree 1 sums to nothing.
    /// let axes = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    /// let sums = Basis::new(1)?.sums_adjoint(&[1.0; 6], &axes, Parallelism::Sequential)?;
    /// assert!((sums.get(0, 0) - 6.0 / (4.0 * std::f64::consts::PI).sqrt()).abs() < 1e-14);
    /// assert!(sums.as_slice()[1..].iter().all(|value| value.abs() < 1e-15));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one value a direction; [`Error::Domain`] for a direction
    /// of no or of infinite length; [`Error::NotFinite`] where a value is not finite,
    /// [`Error::Overflow`] where all are and a sum is not.
    pub fn sums_adjoint(
        &self,
        values: &[f64],
        directions: &[DVec3],
        parallelism: Parallelism,
    ) -> Result<Coefficients> {
        check_length("the values at directions", directions.len(), values.len())?;
        check_directions(directions)?;
        let tables = &*self.0;
        // As many parts whatever the number of threads, so that sums do not depend on it, and of
        // large sets few, for each part has a set of its own.
        let parts = (PART_VALUES / self.count()).clamp(1, MOST_PARTS);
        let length = directions
            .len()
            .div_ceil(parts)
            .next_multiple_of(TOGETHER * LANES);
        let sums = parallelism.map(directions.len().div_ceil(length.max(1)), |part| {
            let mut sums = vec![0.0; self.count()];
            let range = part * length..((part + 1) * length).min(directions.len());
            let (directions, values) = (&directions[range.clone()], &values[range]);
            let groups = directions.chunks(TOGETHER * LANES);
            for (directions, values) in groups.zip(values.chunks(TOGETHER * LANES)) {
                wide!(tables.level, simd => {
                    if tables.degree <= DOUBLE_DEGREE {
                        tables.gather::<_, false>(simd, directions, values, &mut sums);
                    } else {
                        tables.gather::<_, true>(simd, directions, values, &mut sums);
                    }
                });
            }
            sums
        });
        let mut total = Coefficients::try_zeros(tables.degree, tables.degree)?;
        for sums in sums {
            for (total, value) in total.as_mut_slice().iter_mut().zip(sums) {
                *total += value;
            }
        }
        if all_finite(total.as_slice()) {
            Ok(total)
        } else {
            Err(not_finite("the sums", "the values", values))
        }
    }

    fn check(&self, coefficients: &Coefficients, directions: &[DVec3]) -> Result<()> {
        if coefficients.degree() != self.0.degree {
            return Err(Error::Degree {
                what: "the basis",
                degree: coefficients.degree(),
                limit: self.0.degree,
            });
        }
        check_directions(directions)
    }
}

impl std::fmt::Debug for Basis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Basis")
            .field("degree", &self.0.degree)
            .finish()
    }
}

/// Every Y_l^m, l ≤ `degree`, at one direction of the harmonic frame, in the order of
/// [`Coefficients`]: [`Basis::values`] without a plan kept.
///
/// # Errors
/// [`Error::Length`] unless `out` has (degree + 1)² values; [`Error::Domain`] for a direction of no
/// length; [`Error::Degree`] beyond [`MAX_BASIS_DEGREE`].
pub fn evaluate_all(direction: DVec3, degree: usize, out: &mut [f64]) -> Result<()> {
    Basis::new(degree)?.values(&[direction], out, Parallelism::Sequential)
}

/// Σ f_lm Y_l^m at one direction of the harmonic frame: [`Basis::sums`] without a plan kept.
///
/// # Errors
/// [`Error::Domain`] for a direction of no length; [`Error::Degree`] beyond [`MAX_BASIS_DEGREE`].
pub fn evaluate(coefficients: &Coefficients, direction: DVec3) -> Result<f64> {
    let mut value = [0.0];
    Basis::new(coefficients.degree())?.sums(
        coefficients,
        &[direction],
        &mut value,
        Parallelism::Sequential,
    )?;
    Ok(value[0])
}

pub(super) fn check_directions(directions: &[DVec3]) -> Result<()> {
    for direction in directions {
        let length = direction.length();
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::Domain {
                what: "the length of a direction",
                value: length,
                allowed: "positive and finite",
            });
        }
    }
    Ok(())
}

/// α_l α_{l+1} ε_{l+1} = ½, so α² = ¼/(ε² α²) downwards from a value at the top that keeps α from
/// alternating.
fn push_steps(m: usize, degree: usize, steps: &mut Vec<DegreeStep>) {
    let start = steps.len();
    let zero = DegreeStep {
        a: DoubleDouble::ZERO,
        excess: DoubleDouble::ZERO,
        alpha: 0.0,
        slope: 0.0,
    };
    steps.resize(start + degree + 1 - m, zero);
    let epsilon = |l: usize| ((l * l - m * m) as f64, (4 * l * l) as f64 - 1.0);
    let ((n1, d1), (n2, d2)) = (epsilon(degree + 1), epsilon(degree + 2));
    let mut square = DoubleDouble::from(0.5 * (d1 / n1 * (d2 / n2)).powf(0.25));
    for l in (m..=degree).rev() {
        let a = square.scale(2.0);
        let ratio = if l == 0 {
            0.0
        } else {
            (2 * l + 1) as f64 / (2 * l - 1) as f64
        };
        steps[start + l - m] = DegreeStep {
            a,
            excess: a - DoubleDouble::from(2.0),
            alpha: square.hi.sqrt(),
            slope: (epsilon(l).0 * ratio).sqrt(),
        };
        if l > m {
            let (n, d) = epsilon(l);
            square = DoubleDouble::from(d).divide(square.scale(4.0 * n));
        }
    }
}

impl EightDirections {
    /// Up to eight directions; the missing ones are +z.
    #[inline(always)]
    fn new<S: Simd>(simd: S, directions: &[DVec3]) -> Self {
        let mut octet = Self {
            y: [[0.0; LANES]; 2],
            sin: [[0.0; LANES]; 2],
            cos_phi: [[0.0; LANES]; 2],
            sin_phi: [[0.0; LANES]; 2],
            side: [1.0; LANES],
        };
        let mut coordinates = [[0.0; LANES], [0.0; LANES], [1.0; LANES]];
        for (lane, d) in directions.iter().take(LANES).enumerate() {
            // A power of two, so that no square overflows or underflows.
            let size = d.x.abs().max(d.y.abs()).max(d.z.abs());
            let exponent = (size.to_bits() & 0x7FF0_0000_0000_0000).clamp(1 << 52, 0x7FD << 52);
            let scale = f64::from_bits((0x7FE << 52) - exponent);
            coordinates[0][lane] = d.x * scale;
            coordinates[1][lane] = d.y * scale;
            coordinates[2][lane] = d.z.abs() * scale;
            octet.side[lane] = if d.z < 0.0 { -1.0 } else { 1.0 };
        }
        let zero = f64x8::splat(simd, 0.0);
        let [x, y, z] = coordinates;
        let x = f64x8::load_array(simd, x);
        let y = f64x8::load_array(simd, y);
        let z = f64x8::load_array(simd, z);
        let across2 = WideDouble::product(x, x).plus(WideDouble::product(y, y));
        let across = across2.sqrt();
        let length = across2.plus(WideDouble::product(z, z)).sqrt();
        let z = WideDouble { hi: z, lo: zero };
        let rest = length.times(length.plus(z));
        across2.divide(rest).store(&mut octet.y);
        across.divide(length).store(&mut octet.sin);
        let x = WideDouble { hi: x, lo: zero };
        let y = WideDouble { hi: y, lo: zero };
        x.divide(across).store(&mut octet.cos_phi);
        y.divide(across).store(&mut octet.sin_phi);
        // At a pole the divisions were by zero, and closer to it than this the squares lose their
        // digits.
        for lane in 0..LANES {
            if coordinates[0][lane].abs().max(coordinates[1][lane].abs()) < POLE {
                for (field, value) in [
                    (&mut octet.y, 0.0),
                    (&mut octet.sin, 0.0),
                    (&mut octet.cos_phi, 1.0),
                    (&mut octet.sin_phi, 0.0),
                ] {
                    field[0][lane] = value;
                    field[1][lane] = 0.0;
                }
            }
        }
        octet
    }

    fn cos(&self, lane: usize) -> f64 {
        self.side[lane] * (1.0 - self.y[0][lane])
    }
}

/// What goes with the order: sin^m θ, cos mφ and sin mφ.
#[derive(Clone, Copy)]
struct OrderFactors<S: Simd> {
    y: WideDouble<S>,
    side: f64x8<S>,
    sin: WideDouble<S>,
    cos_phi: WideDouble<S>,
    sin_phi: WideDouble<S>,
    power: WideDouble<S>,
    c: WideDouble<S>,
    s: WideDouble<S>,
}

impl<S: Simd> OrderFactors<S> {
    #[inline(always)]
    fn new(simd: S, octet: &EightDirections) -> Self {
        let load = |[hi, lo]: &[Lanes; 2]| WideDouble::load(simd, hi, lo);
        Self {
            y: load(&octet.y),
            side: f64x8::load_array_ref(simd, &octet.side),
            sin: load(&octet.sin),
            cos_phi: load(&octet.cos_phi),
            sin_phi: load(&octet.sin_phi),
            power: WideDouble::splat(simd, DoubleDouble::from(SCALE)),
            c: WideDouble::splat(simd, DoubleDouble::ONE),
            s: WideDouble::splat(simd, DoubleDouble::ZERO),
        }
    }

    #[inline(always)]
    fn turn(&mut self) {
        let c = self.c.times(self.cos_phi).minus(self.s.times(self.sin_phi));
        self.s = self.s.times(self.cos_phi).plus(self.c.times(self.sin_phi));
        self.c = c;
    }

    #[inline(always)]
    fn raise(&mut self) {
        self.power = self.power.times(self.sin);
    }
}

/// The recurrence of one order, degree by degree.
#[derive(Clone, Copy)]
struct Column<S: Simd, const EXACT: bool> {
    p: WideDouble<S>,
    d: WideDouble<S>,
    y: WideDouble<S>,
    sign: f64x8<S>,
    other: f64x8<S>,
}

impl<S: Simd, const EXACT: bool> Column<S, EXACT> {
    #[inline(always)]
    fn new(simd: S, first: DoubleDouble, orders: &OrderFactors<S>) -> Self {
        let mut p = WideDouble::splat(simd, first).times(orders.power);
        if !EXACT {
            p.hi = p.rounded();
        }
        let one = f64x8::splat(simd, 1.0 / SCALE);
        Self {
            p,
            d: p,
            y: orders.y,
            sign: one,
            other: one * orders.side,
        }
    }

    /// The next P̄_lm, or P̄_lm/sin θ where the power is one less.
    #[inline(always)]
    fn next(&mut self, simd: S, step: &DegreeStep) -> f64x8<S> {
        let sign = self.sign;
        (self.sign, self.other) = (self.other, self.sign);
        if EXACT {
            let value = self.p.rounded() * sign * step.alpha;
            let u = WideDouble::splat(simd, step.excess)
                .minus(WideDouble::splat(simd, step.a).times(self.y));
            self.d = self.d.plus(u.times(self.p));
            self.p = self.p.plus(self.d);
            value
        } else {
            let value = self.p.hi * sign * step.alpha;
            let a = f64x8::splat(simd, -step.a.hi);
            let u = self.y.hi.mul_add(a, f64x8::splat(simd, step.excess.hi));
            let u = self.y.lo.mul_add(a, u);
            self.d.hi = u.mul_add(self.p.hi, self.d.hi);
            self.p.hi += self.d.hi;
            value
        }
    }
}

/// Eight consecutive values of eight directions.
type Tile<S> = [f64x8<S>; LANES];

/// Rows of `count` values, the first at `offset` and the others `stride` apart, one for each
/// direction.
struct ValueRows<S: Simd> {
    offset: usize,
    stride: usize,
    count: usize,
    /// The last eight values of each row, which are written last.
    tail: Tile<S>,
}

impl<S: Simd> ValueRows<S> {
    #[inline(always)]
    fn new(simd: S, offset: usize, stride: usize, count: usize) -> Self {
        Self {
            offset,
            stride,
            count,
            tail: [f64x8::splat(simd, 0.0); LANES],
        }
    }

    /// Writes the first `used` of eight values of each direction from `at` on. Where the row has
    /// room all eight are written: what follows them is written later.
    #[inline(always)]
    fn put(&mut self, out: &mut [f64], at: usize, tile: &Tile<S>, used: usize) {
        if at + 2 * LANES > self.count {
            for (i, value) in tile[..used].iter().enumerate() {
                if let Some(place) = (at + i + LANES).checked_sub(self.count) {
                    self.tail[place] = *value;
                }
            }
        }
        if at + LANES <= self.count {
            let tile = f64::transpose(*tile);
            for (values, row) in tile
                .into_iter()
                .zip(out[self.offset..].chunks_mut(self.stride))
            {
                if let Some(row) = row[at..].first_chunk_mut() {
                    values.store_array(row);
                }
            }
        }
    }

    /// Writes what is left.
    #[inline(always)]
    fn finish(self, out: &mut [f64]) {
        let tile = f64::transpose(self.tail);
        let used = LANES.min(self.count);
        for (values, row) in tile
            .into_iter()
            .zip(out[self.offset..].chunks_mut(self.stride))
        {
            let row = &mut row[self.count - used..self.count];
            if let Some(row) = row.first_chunk_mut() {
                values.store_array(row);
            } else {
                row.copy_from_slice(&<Lanes>::from(values)[LANES - used..]);
            }
        }
    }
}

#[inline(always)]
fn scaled<S: Simd>(tile: &Tile<S>, factor: f64x8<S>) -> Tile<S> {
    let mut scaled = *tile;
    for value in &mut scaled {
        *value *= factor;
    }
    scaled
}

/// A tile of values and one of each component of the gradient.
#[inline(always)]
fn put_all<S: Simd>(
    rows: &mut [ValueRows<S>; 4],
    out: &mut [&mut [f64]; 2],
    at: usize,
    tiles: &[Tile<S>; 4],
    used: usize,
) {
    let [values, gradients] = out;
    rows[0].put(values, at, &tiles[0], used);
    for part in 1..4 {
        rows[part].put(gradients, at, &tiles[part], used);
    }
}

/// The tangent plane at eight directions.
struct Frame<S: Simd> {
    sin: f64x8<S>,
    /// The unit vector of growing θ is (south_x, south_y, −sin), that of growing φ (−sin_phi,
    /// cos_phi, 0).
    south_x: f64x8<S>,
    south_y: f64x8<S>,
    cos_phi: f64x8<S>,
    sin_phi: f64x8<S>,
}

impl<S: Simd> Frame<S> {
    /// Values and gradients from q = P̄/sin θ and dP̄/dθ: `along` is the cosine or sine of mφ and
    /// `across` its derivative by φ.
    #[inline(always)]
    fn tiles(
        &self,
        q: &Tile<S>,
        slope: &Tile<S>,
        along: f64x8<S>,
        across: f64x8<S>,
    ) -> [Tile<S>; 4] {
        let mut tiles = [*q; 4];
        for i in 0..LANES {
            let (theta, east) = (slope[i] * along, q[i] * across);
            tiles[0][i] = q[i] * self.sin * along;
            tiles[1][i] = theta.mul_sub(self.south_x, east * self.sin_phi);
            tiles[2][i] = theta.mul_add(self.south_y, east * self.cos_phi);
            tiles[3][i] = -(theta * self.sin);
        }
        tiles
    }
}

impl Tables {
    /// The values at up to eight directions.
    fn values_at_eight(&self, directions: &[DVec3], out: &mut [f64]) {
        // One pass in order brings the rows into the cache: they are written eight at a time, which
        // memory takes badly.
        out.fill(0.0);
        wide!(self.level, simd => {
            let octet = EightDirections::new(simd, directions);
            if self.degree <= DOUBLE_DEGREE {
                self.write_values::<_, false>(simd, &octet, out);
            } else {
                self.write_values::<_, true>(simd, &octet, out);
            }
        });
    }

    fn column_steps(&self, m: usize) -> &[DegreeStep] {
        &self.steps[self.starts[m]..self.starts[m + 1]]
    }

    fn count(&self) -> usize {
        coefficient_count(self.degree, self.degree)
    }

    /// Every harmonic of eight directions, or of as many as `out` has rows for.
    #[inline(always)]
    fn write_values<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        octet: &EightDirections,
        out: &mut [f64],
    ) {
        let count = self.count();
        let mut rows = ValueRows::new(simd, 0, count, count);
        let zero = [f64x8::splat(simd, 0.0); LANES];
        let mut orders = OrderFactors::new(simd, octet);
        for m in 0..=self.degree {
            if m > 0 {
                orders.turn();
                orders.raise();
            }
            let (c, s) = (orders.c.rounded(), orders.s.rounded());
            let start = column_start(self.degree, m);
            let sine_start = start + self.degree + 1 - m;
            let mut column = Column::<S, EXACT>::new(simd, self.firsts[m], &orders);
            // The end of the cosines may be written over the first sines, so those come last.
            let mut first = (zero, 0);
            for (i, steps) in self.column_steps(m).chunks(LANES).enumerate() {
                let mut tile = zero;
                for (value, step) in tile.iter_mut().zip(steps) {
                    *value = column.next(simd, step);
                }
                let at = i * LANES;
                if m == 0 {
                    rows.put(out, at, &tile, steps.len());
                    continue;
                }
                rows.put(out, start + at, &scaled(&tile, c), steps.len());
                if i == 0 {
                    first = (scaled(&tile, s), steps.len());
                } else {
                    rows.put(out, sine_start + at, &scaled(&tile, s), steps.len());
                }
            }
            if m > 0 {
                rows.put(out, sine_start, &first.0, first.1);
            }
        }
        rows.finish(out);
    }

    /// Every harmonic of eight directions and its gradient. Columns of P̄/sin θ keep the poles
    /// finite.
    #[inline(always)]
    fn write_gradients<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        octet: &EightDirections,
        values: &mut [f64],
        gradients: &mut [f64],
    ) {
        let count = self.count();
        let zero = [f64x8::splat(simd, 0.0); LANES];
        let mut orders = OrderFactors::new(simd, octet);
        let sin = orders.sin.rounded();
        let mut out = [values, gradients];
        let mut rows = [
            ValueRows::new(simd, 0, count, count),
            ValueRows::new(simd, 0, 3 * count, count),
            ValueRows::new(simd, count, 3 * count, count),
            ValueRows::new(simd, 2 * count, 3 * count, count),
        ];
        let cos = (1.0 - orders.y.rounded()) * orders.side;
        let (cos_phi, sin_phi) = (orders.cos_phi.rounded(), orders.sin_phi.rounded());
        let frame = Frame {
            sin,
            south_x: cos * cos_phi,
            south_y: cos * sin_phi,
            cos_phi,
            sin_phi,
        };
        let mut column = Column::<S, EXACT>::new(simd, self.firsts[0], &orders);
        let mut zonal = Column::<S, EXACT>::new(simd, self.firsts[self.degree.min(1)], &orders);
        for (i, steps) in self.column_steps(0).chunks(LANES).enumerate() {
            // dP̄_l0/dθ = −√(l(l+1)/2) P̄_l1
            let mut all = [zero; 4];
            for (k, step) in steps.iter().enumerate() {
                let l = i * LANES + k;
                all[0][k] = column.next(simd, step);
                if l > 0 {
                    let lf = l as f64;
                    let next = zonal.next(simd, &self.column_steps(1)[l - 1]);
                    let theta = next * sin * -(0.5 * lf * (lf + 1.0)).sqrt();
                    all[1][k] = theta * frame.south_x;
                    all[2][k] = theta * frame.south_y;
                    all[3][k] = -(theta * sin);
                }
            }
            put_all(&mut rows, &mut out, i * LANES, &all, steps.len());
        }
        for m in 1..=self.degree {
            orders.turn();
            if m > 1 {
                orders.raise();
            }
            let (c, s) = (orders.c.rounded(), orders.s.rounded());
            let order = f64x8::splat(simd, m as f64);
            let start = column_start(self.degree, m);
            let sine_start = start + self.degree + 1 - m;
            let mut column = Column::<S, EXACT>::new(simd, self.firsts[m], &orders);
            let mut before = f64x8::splat(simd, 0.0);
            let mut first = ([zero; 4], 0);
            for (i, steps) in self.column_steps(m).chunks(LANES).enumerate() {
                let (mut q, mut slope) = (zero, zero);
                for (k, step) in steps.iter().enumerate() {
                    q[k] = column.next(simd, step);
                    slope[k] = q[k] * cos * ((m + i * LANES + k) as f64) - before * step.slope;
                    before = q[k];
                }
                let at = i * LANES;
                let cosines = frame.tiles(&q, &slope, c, -(order * s));
                put_all(&mut rows, &mut out, start + at, &cosines, steps.len());
                let sines = frame.tiles(&q, &slope, s, order * c);
                if i == 0 {
                    first = (sines, steps.len());
                } else {
                    put_all(&mut rows, &mut out, sine_start + at, &sines, steps.len());
                }
            }
            put_all(&mut rows, &mut out, sine_start, &first.0, first.1);
        }
        let [values, gradients] = out;
        let [first, x, y, z] = rows;
        first.finish(values);
        for part in [x, y, z] {
            part.finish(gradients);
        }
    }

    #[inline(always)]
    fn sum<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        coefficients: &Coefficients,
        octet: &EightDirections,
    ) -> Lanes {
        let mut orders = OrderFactors::new(simd, octet);
        let zero = f64x8::splat(simd, 0.0);
        let mut total = zero;
        for m in 0..=coefficients.orders() {
            if m > 0 {
                orders.turn();
                orders.raise();
            }
            let mut column = Column::<S, EXACT>::new(simd, self.firsts[m], &orders);
            let (cosine, sine) = (coefficients.cosine(m), coefficients.sine(m));
            let (mut a, mut b) = (zero, zero);
            if m == 0 {
                for (step, x) in self.column_steps(m).iter().zip(cosine) {
                    a = column.next(simd, step).mul_add(f64x8::splat(simd, *x), a);
                }
            } else {
                for (step, (x, y)) in self.column_steps(m).iter().zip(cosine.iter().zip(sine)) {
                    let value = column.next(simd, step);
                    a = value.mul_add(f64x8::splat(simd, *x), a);
                    b = value.mul_add(f64x8::splat(simd, *y), b);
                }
            }
            total = a.mul_add(orders.c.rounded(), total);
            total = b.mul_add(orders.s.rounded(), total);
        }
        total.into()
    }

    /// Adds Σ y Y_l^m over up to [`TOGETHER`] eights of directions to all sums.
    #[inline(always)]
    fn gather<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        directions: &[DVec3],
        values: &[f64],
        sums: &mut [f64],
    ) {
        let zero = f64x8::splat(simd, 0.0);
        let first = EightDirections::new(simd, &directions[..LANES.min(directions.len())]);
        let mut orders = [OrderFactors::new(simd, &first); TOGETHER];
        // What is missing counts nothing.
        let mut weights = [zero; TOGETHER];
        let eights = directions.chunks(LANES).zip(values.chunks(LANES));
        for (v, (directions, values)) in eights.enumerate() {
            orders[v] = OrderFactors::new(simd, &EightDirections::new(simd, directions));
            let mut lanes = [0.0; LANES];
            lanes[..values.len()].copy_from_slice(values);
            weights[v] = f64x8::load_array(simd, lanes);
        }
        let mut rest = sums;
        for m in 0..=self.degree {
            let (mut cosines, mut sines) = ([zero; TOGETHER], [zero; TOGETHER]);
            let mut columns = [Column::<S, EXACT>::new(simd, self.firsts[m], &orders[0]); TOGETHER];
            for v in 0..TOGETHER {
                if m > 0 {
                    orders[v].turn();
                    orders[v].raise();
                }
                cosines[v] = weights[v] * orders[v].c.rounded();
                sines[v] = weights[v] * orders[v].s.rounded();
                columns[v] = Column::new(simd, self.firsts[m], &orders[v]);
            }
            let steps = self.column_steps(m);
            let cosine = rest.split_off_mut(..steps.len()).unwrap_or_default();
            if m == 0 {
                for (sum, step) in cosine.iter_mut().zip(steps) {
                    let mut total = zero;
                    for v in 0..TOGETHER {
                        total = columns[v].next(simd, step).mul_add(cosines[v], total);
                    }
                    *sum += total.reduce_sum();
                }
                continue;
            }
            let sine = rest.split_off_mut(..steps.len()).unwrap_or_default();
            for ((c, s), step) in cosine.iter_mut().zip(sine).zip(steps) {
                let (mut a, mut b) = (zero, zero);
                for v in 0..TOGETHER {
                    let value = columns[v].next(simd, step);
                    a = value.mul_add(cosines[v], a);
                    b = value.mul_add(sines[v], b);
                }
                *c += a.reduce_sum();
                *s += b.reduce_sum();
            }
        }
    }

    /// The sum, its derivative by θ, and its derivative by φ over sin θ. Columns of P̄/sin θ keep
    /// the poles finite.
    #[inline(always)]
    fn slope<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        coefficients: &Coefficients,
        octet: &EightDirections,
    ) -> [Lanes; 3] {
        let mut orders = OrderFactors::new(simd, octet);
        let zero = f64x8::splat(simd, 0.0);
        let sin = orders.sin.rounded();
        let cos = (1.0 - orders.y.rounded()) * orders.side;
        let mut column = Column::<S, EXACT>::new(simd, self.firsts[0], &orders);
        let (mut value, mut theta, mut phi) = (zero, zero, zero);
        for (step, x) in self.column_steps(0).iter().zip(coefficients.cosine(0)) {
            value = column
                .next(simd, step)
                .mul_add(f64x8::splat(simd, *x), value);
        }
        for m in 1..=self.degree {
            orders.turn();
            if m > 1 {
                orders.raise();
            }
            let steps = self.column_steps(m);
            if m == 1 {
                // dP̄_l0/dθ = −√(l(l+1)/2) P̄_l1
                let mut column = Column::<S, EXACT>::new(simd, self.firsts[m], &orders);
                let mut sum = zero;
                for ((i, step), a) in steps.iter().enumerate().zip(&coefficients.cosine(0)[1..]) {
                    let l = (i + 1) as f64;
                    let factor = f64x8::splat(simd, a * (0.5 * l * (l + 1.0)).sqrt());
                    sum = column.next(simd, step).mul_add(factor, sum);
                }
                theta -= sin * sum;
            }
            let (cosine, sine) = (coefficients.cosine(m), coefficients.sine(m));
            if cosine.is_empty() {
                break;
            }
            let mut column = Column::<S, EXACT>::new(simd, self.firsts[m], &orders);
            let [mut a, mut b, mut da, mut db] = [zero; 4];
            let mut before = zero;
            for (i, (step, (x, y))) in steps.iter().zip(cosine.iter().zip(sine)).enumerate() {
                let q = column.next(simd, step);
                let slope = q * cos * ((m + i) as f64) - before * step.slope;
                before = q;
                let (x, y) = (f64x8::splat(simd, *x), f64x8::splat(simd, *y));
                a = q.mul_add(x, a);
                b = q.mul_add(y, b);
                da = slope.mul_add(x, da);
                db = slope.mul_add(y, db);
            }
            let (c, s) = (orders.c.rounded(), orders.s.rounded());
            value += sin * (a * c + b * s);
            theta += da * c + db * s;
            phi += (b * c - a * s) * (m as f64);
        }
        [value.into(), theta.into(), phi.into()]
    }
}
