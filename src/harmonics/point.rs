//! Harmonics at directions: all of them, or their sum and its gradient.

use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};
use glam::DVec3;

use super::coefficients::{Coefficients, coefficient_count, column_start};
use super::recurrence::{LANES, Lanes};
use super::ring_fft::transpose;
use super::simd::wide;
use super::wide_double::WideDouble;
use super::work::over_chunks;
use crate::error::check_length;
use crate::sphere::double_double::DoubleDouble;
use crate::{Error, Parallelism, Result};

/// The largest degree of a [`Basis`].
pub const MAX_BASIS_DEGREE: usize = 2048;

/// Beyond this degree the recurrence runs in double-double arithmetic.
const DOUBLE_DEGREE: usize = 48;

/// The values are carried multiplied by this, so that no P̄_mm that matters later underflows: the smallest, at m = 2048/e, is 10⁻³²⁷.
const SCALE: f64 = (1u128 << 127) as f64 * (1u128 << 127) as f64 * (1u128 << 127) as f64;

/// How many directions one thread takes at a time.
const CHUNK: usize = 8 * LANES;

/// All harmonics up to a degree at any directions: a plan, immutable and shared by cloning.
///
/// P̄_lm = α_l p_l with p_{l+1} = a_l cos θ p_l − p_{l−1}, carried as differences: D_{l+1} = D_l + (a_l − 2 − a_l (1 − cos θ)) p_l,
/// p_{l+1} = p_l + D_{l+1}, from the pole of the direction's own hemisphere. 1 − cos θ, sin θ and the azimuth's sine and
/// cosine come from the Cartesian direction in double-double, so that no pole loses digits; beyond degree 48 the recurrence is in
/// double-double too. Each value is within 16 ε √((2l+1)/4π) for l ≤ 45 and 64 ε √((2l+1)/4π) for l ≤ 2047.
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
    steps: Vec<Step>,
    starts: Vec<usize>,
    /// P̄_mm / (α_m sin^m θ).
    firsts: Vec<DoubleDouble>,
}

#[derive(Clone, Copy)]
struct Step {
    a: DoubleDouble,
    /// a − 2.
    excess: DoubleDouble,
    alpha: f64,
    /// √((l² − m²)(2l+1)/(2l−1)), of the derivative.
    slope: f64,
}

/// Eight directions.
struct Octet {
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
            level: Level::new(),
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

    /// Every Y_l^m at each direction of the harmonic frame: `out[direction · count + index]`, the index that of [`Coefficients`].
    ///
    /// Directions need not be of unit length. At a pole the azimuth is 0.
    ///
    /// # Errors
    /// [`Error::Length`] unless `out` has directions × [`count`](Self::count) values; [`Error::Domain`] for a direction of no or of
    /// infinite length.
    pub fn values(
        &self,
        directions: &[DVec3],
        out: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        let count = self.count();
        check_length(
            "the output of the basis",
            directions.len() * count,
            out.len(),
        )?;
        check_directions(directions)?;
        let tables = &*self.0;
        over_chunks(parallelism, out, CHUNK * count, |chunk, out| {
            let directions = &directions[chunk * CHUNK..];
            let mut column = vec![[0.0; LANES]; tables.degree + 1];
            let mut stage = vec![[0.0; LANES]; count.next_multiple_of(LANES)];
            for (out, directions) in out.chunks_mut(LANES * count).zip(directions.chunks(LANES)) {
                let octet = Octet::new(directions);
                wide!(tables.level, simd => {
                    if tables.degree <= DOUBLE_DEGREE {
                        tables.stage_values::<_, false>(simd, &octet, &mut column, &mut stage);
                    } else {
                        tables.stage_values::<_, true>(simd, &octet, &mut column, &mut stage);
                    }
                    spread(simd, &stage, out, count);
                });
            }
        });
        Ok(())
    }

    /// Σ f_lm Y_l^m at each direction.
    ///
    /// # Errors
    /// [`Error::Length`] where the set has another degree than the basis, or `out` not one value a direction; [`Error::Domain`] for a
    /// direction of no or of infinite length.
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
            let mut column = vec![[0.0; LANES]; tables.degree + 1];
            for (out, directions) in out.chunks_mut(LANES).zip(directions.chunks(LANES)) {
                let octet = Octet::new(directions);
                let sums = wide!(tables.level, simd => {
                    if tables.degree <= DOUBLE_DEGREE {
                        tables.sum::<_, false>(simd, coefficients, &octet, &mut column)
                    } else {
                        tables.sum::<_, true>(simd, coefficients, &octet, &mut column)
                    }
                });
                out.copy_from_slice(&sums[..out.len()]);
            }
        });
        Ok(())
    }

    /// Σ f_lm Y_l^m and its gradient on the unit sphere at each direction: the value, and the tangent vector whose product with a small
    /// step is the change of the value.
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
            let mut column = vec![[0.0; LANES]; tables.degree + 1];
            for (out, directions) in out.chunks_mut(LANES).zip(directions.chunks(LANES)) {
                let octet = Octet::new(directions);
                let [value, theta, phi] = wide!(tables.level, simd => {
                    if tables.degree <= DOUBLE_DEGREE {
                        tables.slope::<_, false>(simd, coefficients, &octet, &mut column)
                    } else {
                        tables.slope::<_, true>(simd, coefficients, &octet, &mut column)
                    }
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
        Ok(())
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

/// Every Y_l^m, l ≤ `degree`, at one direction of the harmonic frame, in the order of [`Coefficients`]: [`Basis::values`] without a
/// plan kept.
///
/// # Errors
/// [`Error::Length`] unless `out` has (degree + 1)² values; [`Error::Domain`] for a direction of no length; [`Error::Degree`] beyond
/// [`MAX_BASIS_DEGREE`].
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

fn check_directions(directions: &[DVec3]) -> Result<()> {
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

/// α_l α_{l+1} ε_{l+1} = ½, so α² = ¼/(ε² α²) downwards from a value at the top that keeps α from alternating.
fn push_steps(m: usize, degree: usize, steps: &mut Vec<Step>) {
    let start = steps.len();
    let zero = Step {
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
        steps[start + l - m] = Step {
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

impl Octet {
    /// Up to eight directions; the missing ones are +z.
    fn new(directions: &[DVec3]) -> Self {
        let mut octet = Self {
            y: [[0.0; LANES]; 2],
            sin: [[0.0; LANES]; 2],
            cos_phi: [[1.0; LANES], [0.0; LANES]],
            sin_phi: [[0.0; LANES]; 2],
            side: [1.0; LANES],
        };
        for (lane, direction) in directions.iter().enumerate() {
            // A power of two, so that no square overflows or underflows.
            let size = direction.abs().max_element();
            let scale = f64::from_bits(
                (size.to_bits() & 0x7FF0_0000_0000_0000).clamp(1 << 52, 0x7FD << 52),
            );
            let d = *direction / scale;
            let square = |v: f64| DoubleDouble::product(v, v);
            let across2 = square(d.x) + square(d.y);
            let across = across2.sqrt();
            let length = (across2 + square(d.z)).sqrt();
            let rest = length * (length + DoubleDouble::from(d.z.abs()));
            let mut set = |field: fn(&mut Self) -> &mut [Lanes; 2], value: DoubleDouble| {
                let [hi, lo] = field(&mut octet);
                (hi[lane], lo[lane]) = (value.hi, value.lo);
            };
            set(|o| &mut o.y, across2.divide(rest));
            set(|o| &mut o.sin, across.divide(length));
            if across.hi > 0.0 {
                set(|o| &mut o.cos_phi, DoubleDouble::from(d.x).divide(across));
                set(|o| &mut o.sin_phi, DoubleDouble::from(d.y).divide(across));
            }
            octet.side[lane] = if d.z < 0.0 { -1.0 } else { 1.0 };
        }
        octet
    }

    fn cos(&self, lane: usize) -> f64 {
        self.side[lane] * (1.0 - self.y[0][lane])
    }
}

/// What goes with the order: sin^m θ, cos mφ and sin mφ.
struct Orders<S: Simd> {
    y: WideDouble<S>,
    side: f64x8<S>,
    sin: WideDouble<S>,
    cos_phi: WideDouble<S>,
    sin_phi: WideDouble<S>,
    power: WideDouble<S>,
    c: WideDouble<S>,
    s: WideDouble<S>,
}

impl<S: Simd> Orders<S> {
    #[inline(always)]
    fn new(simd: S, octet: &Octet) -> Self {
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

impl Tables {
    fn column_steps(&self, m: usize) -> &[Step] {
        &self.steps[self.starts[m]..self.starts[m + 1]]
    }

    /// P̄_lm (or P̄_lm/sin θ, where the power is one less) for l = m … degree into `out`.
    #[inline(always)]
    fn column<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        m: usize,
        orders: &Orders<S>,
        out: &mut [Lanes],
    ) {
        let first = WideDouble::splat(simd, self.firsts[m]).times(orders.power);
        let one = f64x8::splat(simd, 1.0 / SCALE);
        let flipped = one * orders.side;
        let steps = self.column_steps(m);
        if EXACT {
            let (mut p, mut d) = (first, first);
            let (mut sign, mut other) = (one, flipped);
            for (step, out) in steps.iter().zip(out) {
                (p.rounded() * sign * step.alpha).store_array(out);
                (sign, other) = (other, sign);
                let u = WideDouble::splat(simd, step.excess)
                    .minus(WideDouble::splat(simd, step.a).times(orders.y));
                d = d.plus(u.times(p));
                p = p.plus(d);
            }
        } else {
            let (mut p, mut d) = (first.rounded(), first.rounded());
            let (mut sign, mut other) = (one, flipped);
            for (step, out) in steps.iter().zip(out) {
                (p * sign * step.alpha).store_array(out);
                (sign, other) = (other, sign);
                let a = f64x8::splat(simd, -step.a.hi);
                let u = orders.y.hi.mul_add(a, f64x8::splat(simd, step.excess.hi));
                let u = orders.y.lo.mul_add(a, u);
                d = u.mul_add(p, d);
                p += d;
            }
        }
    }

    /// Every harmonic of eight directions, lane by lane.
    #[inline(always)]
    fn stage_values<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        octet: &Octet,
        column: &mut [Lanes],
        stage: &mut [Lanes],
    ) {
        let mut orders = Orders::new(simd, octet);
        self.column::<S, EXACT>(simd, 0, &orders, stage);
        for m in 1..=self.degree {
            orders.turn();
            orders.raise();
            let count = self.degree + 1 - m;
            let column = &mut column[..count];
            self.column::<S, EXACT>(simd, m, &orders, column);
            let (c, s) = (orders.c.rounded(), orders.s.rounded());
            let start = column_start(self.degree, m);
            let (cosine, sine) = stage[start..start + 2 * count].split_at_mut(count);
            for ((value, cosine), sine) in column.iter().zip(cosine).zip(sine) {
                let value = f64x8::load_array_ref(simd, value);
                (value * c).store_array(cosine);
                (value * s).store_array(sine);
            }
        }
    }

    #[inline(always)]
    fn sum<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        coefficients: &Coefficients,
        octet: &Octet,
        column: &mut [Lanes],
    ) -> Lanes {
        let mut orders = Orders::new(simd, octet);
        let mut total = f64x8::splat(simd, 0.0);
        for m in 0..=coefficients.orders() {
            if m > 0 {
                orders.turn();
                orders.raise();
            }
            let column = &mut column[..self.degree + 1 - m];
            self.column::<S, EXACT>(simd, m, &orders, column);
            let a = dot(simd, column, coefficients.cosine(m));
            total = a.mul_add(orders.c.rounded(), total);
            if m > 0 {
                let b = dot(simd, column, coefficients.sine(m));
                total = b.mul_add(orders.s.rounded(), total);
            }
        }
        total.into()
    }

    /// The sum, its derivative by θ, and its derivative by φ over sin θ. Columns of P̄/sin θ keep the poles finite.
    #[inline(always)]
    fn slope<S: Simd, const EXACT: bool>(
        &self,
        simd: S,
        coefficients: &Coefficients,
        octet: &Octet,
        column: &mut [Lanes],
    ) -> [Lanes; 3] {
        let mut orders = Orders::new(simd, octet);
        let zero = f64x8::splat(simd, 0.0);
        let sin = orders.sin.rounded();
        let cos = (1.0 - orders.y.rounded()) * orders.side;
        self.column::<S, EXACT>(simd, 0, &orders, column);
        let mut value = dot(simd, column, coefficients.cosine(0));
        let (mut theta, mut phi) = (zero, zero);
        for m in 1..=self.degree {
            orders.turn();
            if m > 1 {
                orders.raise();
            }
            let column = &mut column[..self.degree + 1 - m];
            self.column::<S, EXACT>(simd, m, &orders, column);
            if m == 1 {
                // dP̄_l0/dθ = −√(l(l+1)/2) P̄_l1
                let mut sum = zero;
                for ((i, q), a) in column.iter().enumerate().zip(&coefficients.cosine(0)[1..]) {
                    let l = (i + 1) as f64;
                    let factor = f64x8::splat(simd, a * (0.5 * l * (l + 1.0)).sqrt());
                    sum = f64x8::load_array_ref(simd, q).mul_add(factor, sum);
                }
                theta -= sin * sum;
            }
            let (cosine, sine) = (coefficients.cosine(m), coefficients.sine(m));
            if cosine.is_empty() {
                continue;
            }
            let [mut a, mut b, mut da, mut db] = [zero; 4];
            let mut before = zero;
            for (i, ((q, step), (x, y))) in column
                .iter()
                .zip(self.column_steps(m))
                .zip(cosine.iter().zip(sine))
                .enumerate()
            {
                let q = f64x8::load_array_ref(simd, q);
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

/// Σ column · coefficients, in two sums that do not wait for each other.
#[inline(always)]
fn dot<S: Simd>(simd: S, column: &[Lanes], coefficients: &[f64]) -> f64x8<S> {
    let mut sums = [f64x8::splat(simd, 0.0); 2];
    for (i, (value, coefficient)) in column.iter().zip(coefficients).enumerate() {
        let value = f64x8::load_array_ref(simd, value);
        sums[i % 2] = value.mul_add(f64x8::splat(simd, *coefficient), sums[i % 2]);
    }
    sums[0] + sums[1]
}

/// From lane by lane to direction by direction.
#[inline(always)]
fn spread<S: Simd>(simd: S, stage: &[Lanes], out: &mut [f64], count: usize) {
    for (block, stage) in stage.chunks_exact(LANES).enumerate() {
        let mut lanes = [f64x8::splat(simd, 0.0); LANES];
        for (lane, values) in lanes.iter_mut().zip(stage) {
            *lane = f64x8::load_array_ref(simd, values);
        }
        let first = block * LANES;
        let width = LANES.min(count - first);
        for (values, out) in transpose(lanes)
            .into_iter()
            .zip(out.chunks_exact_mut(count))
        {
            let out = &mut out[first..first + width];
            if let Some(out) = out.first_chunk_mut() {
                values.store_array(out);
            } else {
                let values = <[f64; LANES]>::from(values);
                out.copy_from_slice(&values[..width]);
            }
        }
    }
}
