//! Rotation of coefficients.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x2, f64x8};
use glam::DQuat;

use super::coefficients::Coefficients;
use super::euler::{Euler, times};
use super::lane::Lane;
use super::recurrence::{LANES, Lanes};
use super::simd::wide;
use super::work::join;
use crate::error::{all_finite, allocate, not_finite};
use crate::numeric::double_double::DoubleDouble;
use crate::numeric::factorial::roots_of_factorials;
use crate::{Error, Parallelism, Result, vectors};

/// The largest degree of a [`Rotation`].
pub const MAX_ROTATION_DEGREE: usize = 2048;

/// A plan for rotating coefficients of one degree by any rotation. Immutable; share it by
/// reference.
///
/// The rotated function is g(ω) = f(R⁻¹ ω). R = Z(α) Y(β) Z(γ) is taken as Z(α + π/2) Q Z(β + π) Q
/// Z(γ + π/2), where Q turns by π/2 about y, so that the only Wigner matrices are d^l(π/2),
/// whatever the angle, however small. Of those, with l growing and the orders fixed, p_{l+1} = t_l
/// p_l − p_{l−1}, d^l_mm′ = α_l p_l/√(2l+1), t_l = −2 α_l² m m′/(l(l+1)), with α a product of a
/// factor for m, one for m′ and one for l; nothing is stored that grows as l³. The orders m′ of
/// either parity meet the cosines of one parity of l and the sines of the other, so one real
/// product does for both signs of m′.
///
/// There and back at degree 1024 is within 10⁻¹³ of coefficients of size 1. Costs O(degree³).
///
/// ```
/// use lobes::glam::{DQuat, DVec3};
/// use lobes::harmonics::{Coefficients, Rotation, evaluate};
/// let mut f = Coefficients::zeros(4);
/// f.set(4, 3, 1.0)?;
/// f.set(2, -1, 0.5)?;
/// let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.2);
/// let g = Rotation::new(4)?.rotate(&f, turn, lobes::Parallelism::Sequential)?;
/// let direction = DVec3::new(0.48, 0.64, 0.6);
/// let difference = evaluate(&g, turn * direction)? - evaluate(&f, direction)?;
/// assert!(difference.abs() < 1e-14);
/// # Ok::<(), lobes::Error>(())
/// ```
pub struct Rotation {
    degree: usize,
    level: Level,
    /// m′ A²(m′, l) for eight m′ from 8 · octet and l = 8 · octet … degree.
    steps: Vec<Lanes>,
    /// −2 A²(m, l) B²(l) m/(l(l+1)) for the four m of a group, l = 8 · (group / 2) … degree.
    factors: Vec<[f64; ROWS]>,
    /// p_m for m = 0 … degree and m′ = 0 … m, the rest of its octet zero.
    starts: Vec<Lanes>,
    /// A(m, l), and what the sums are multiplied by, l = m … degree, by m.
    scales: Vec<[f64; 2]>,
}

/// How many orders of one parity go together: m = 8k + parity + 0, 2, 4, 6.
const ROWS: usize = 4;

/// How many octets of m′ stay in the second-level cache.
const BLOCK: usize = 3;

/// The p are carried multiplied by this: the smallest that matter are 2^(−degree/√2).
const SCALE: f64 = (1u128 << 100) as f64
    * (1u128 << 100) as f64
    * (1u128 << 100) as f64
    * (1u128 << 100) as f64
    * (1u128 << 100) as f64
    * (1u128 << 100) as f64;

impl Coefficients {
    /// The coefficients of f(R⁻¹ ω): [`Rotation`] without a plan kept.
    ///
    /// # Errors
    /// As [`Rotation::new`] and [`Rotation::rotate`].
    pub fn rotated(&self, rotation: DQuat) -> Result<Self> {
        Rotation::new(self.degree())?.rotate(self, rotation, Parallelism::Sequential)
    }
}

/// Where octet o begins in an array of [octet][l = 8 o … degree].
fn octet_start(degree: usize, octet: usize) -> usize {
    octet * (degree + 1) - 4 * octet * octet.saturating_sub(1)
}

impl Rotation {
    /// The tables of one degree: about 5 degree² numbers.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_ROTATION_DEGREE`].
    pub fn new(degree: usize) -> Result<Self> {
        if degree > MAX_ROTATION_DEGREE {
            return Err(Error::Degree {
                what: "the rotation",
                degree,
                limit: MAX_ROTATION_DEGREE,
            });
        }
        let octets = degree / LANES + 1;
        let total = octet_start(degree, octets - 1) + degree + 1 - LANES * (octets - 1);
        // A(m, l)² A(m, l+1)² (1 − m²/(l+1)²) = 1, downwards from where it hardly alternates; B
        // likewise with l²/(4l²−1) and ¼.
        let squares = |m: usize| -> Vec<DoubleDouble> {
            let f = |l: usize| ((l * l) as f64, (l * l - m * m) as f64);
            let ((n1, d1), (n2, d2)) = (f(degree + 1), f(degree + 2));
            let mut square = DoubleDouble::from((n1 / d1 * (n2 / d2)).powf(0.25));
            let mut squares = vec![square; degree + 1 - m];
            for l in (m..degree).rev() {
                let (n, d) = f(l + 1);
                square = DoubleDouble::from(n).divide(square.scale(d));
                squares[l - m] = square;
            }
            squares
        };
        let mut b = DoubleDouble::from(1.0);
        let mut bs = vec![b; degree + 1];
        for l in (0..degree).rev() {
            let (n, d) = (
                (4 * (l + 1) * (l + 1)) as f64 - 1.0,
                (4 * (l + 1) * (l + 1)) as f64,
            );
            b = DoubleDouble::from(n).divide(b.scale(d));
            bs[l] = b;
        }
        let mut plan = Self {
            degree,
            level: vectors::level(),
            steps: vec![[0.0; LANES]; total],
            factors: vec![[0.0; ROWS]; 2 * total],
            starts: Vec::new(),
            scales: Vec::new(),
        };
        let roots = roots_of_factorials(2 * degree);
        for m in 0..=degree {
            let squares = squares(m);
            let (octet, lane) = (m / LANES, m % LANES);
            let start = octet_start(degree, octet);
            let half = if m == 0 { 0.5f64.sqrt() } else { 1.0 };
            for (i, square) in squares.iter().enumerate() {
                let l = m + i;
                let at = start + l - LANES * octet;
                plan.steps[at][lane] = square.scale(m as f64).to_f64();
                let factor = if m == 0 {
                    0.0
                } else {
                    let (n, d) = (-2.0 * m as f64, (l * (l + 1)) as f64);
                    (*square * bs[l].scale(n))
                        .divide(DoubleDouble::from(d))
                        .to_f64()
                };
                plan.factors
                    [2 * start + (m % 2) * (degree + 1 - LANES * octet) + l - LANES * octet]
                    [lane / 2] = factor;
                let a = square.hi.sqrt() * half;
                let total = 2.0 * a * (bs[l].hi / (2 * l + 1) as f64).sqrt() / SCALE;
                plan.scales.push([a, total]);
            }
            for first in (0..=m).step_by(LANES) {
                let mut lanes = [0.0; LANES];
                for (i, value) in lanes.iter_mut().enumerate().take(m + 1 - first) {
                    let other = first + i;
                    let (n, d1, d2) = (roots[2 * m], roots[m + other], roots[m - other]);
                    let exponent = n.1 - d1.1 - d2.1 - m as i32;
                    // A(m′, m), found when m′ was at hand.
                    let a = plan.scales[scale_start(degree, other) + m - other][0]
                        * if other == 0 { 2f64.sqrt() } else { 1.0 };
                    let alpha = squares[0].hi.sqrt() * a * bs[m].hi.sqrt();
                    let binomial = n.0.to_f64() / (d1.0.to_f64() * d2.0.to_f64());
                    let value_at = binomial * ((2 * m + 1) as f64).sqrt() / alpha;
                    *value = if exponent < -1400 {
                        0.0
                    } else {
                        value_at
                            * 2f64.powi(exponent / 2 + 300)
                            * 2f64.powi(exponent - exponent / 2 + 300)
                    };
                }
                plan.starts.push(lanes);
            }
        }
        Ok(plan)
    }

    /// The degree.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// How many values of scratch [`rotate_into`](Self::rotate_into) needs.
    pub fn scratch_len(&self) -> usize {
        LANES * 2 * HALF_ARRAYS * self.steps.len() + LANES - 1
    }

    /// The coefficients of f(R⁻¹ ω), for a rotation R of the harmonic frame. The quaternion need
    /// not be of unit length.
    ///
    /// # Errors
    /// [`Error::Degree`] where the coefficients have another degree than the plan;
    /// [`Error::Domain`] for a quaternion of no or of infinite length; [`Error::NotFinite`] where a
    /// coefficient is not finite, [`Error::Overflow`] where they are and the rotated ones are not,
    /// which begins at some 10¹¹⁰; [`Error::Memory`] where there is none. Orders cut off by the
    /// input come out, as rotation makes them.
    pub fn rotate(
        &self,
        coefficients: &Coefficients,
        rotation: DQuat,
        parallelism: Parallelism,
    ) -> Result<Coefficients> {
        let mut out = Coefficients::try_zeros(self.degree, self.degree)?;
        let mut scratch = allocate("the scratch", self.scratch_len())?;
        self.rotate_into(coefficients, rotation, &mut out, &mut scratch, parallelism)?;
        Ok(out)
    }

    /// [`rotate`](Self::rotate) of all (degree + 1)² coefficients in single precision, in the order of
    /// [`Coefficients::as_slice`]: worked out in double, and rounded.
    ///
    /// # Errors
    /// Those of [`rotate`](Self::rotate), and [`Error::Length`] for another number of coefficients.
    pub fn rotate_single(
        &self,
        coefficients: &[f32],
        rotation: DQuat,
        parallelism: Parallelism,
    ) -> Result<Vec<f32>> {
        let values = coefficients.iter().map(|&value| f64::from(value)).collect();
        let coefficients = Coefficients::from_vec(self.degree, self.degree, values)?;
        let rotated = self.rotate(&coefficients, rotation, parallelism)?;
        Ok(rotated
            .as_slice()
            .iter()
            .map(|&value| value as f32)
            .collect())
    }

    /// [`rotate`](Self::rotate) into coefficients of all orders, with at least
    /// [`scratch_len`](Self::scratch_len) values of scratch. Allocates nothing.
    ///
    /// # Errors
    /// As [`rotate`](Self::rotate); [`Error::Degree`] and [`Error::Length`] where `out` or the
    /// scratch do not fit.
    pub fn rotate_into(
        &self,
        coefficients: &Coefficients,
        rotation: DQuat,
        out: &mut Coefficients,
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        for degree in [coefficients.degree(), out.degree(), out.orders()] {
            if degree != self.degree {
                return Err(Error::Degree {
                    what: "the rotation",
                    degree,
                    limit: self.degree,
                });
            }
        }
        if scratch.len() < self.scratch_len() {
            return Err(Error::Length {
                what: "the scratch",
                expected: self.scratch_len(),
                got: scratch.len(),
            });
        }
        let length = rotation.length();
        if !(length > 0.0 && length.is_finite()) {
            return Err(Error::Domain {
                what: "the length of a quaternion",
                value: length,
                allowed: "positive and finite",
            });
        }
        let scratch = f64::aligned(scratch);
        let Euler {
            alpha, beta, gamma, ..
        } = Euler::of(rotation);
        // e^(iπ/2) e^(iα) and so on: quarter turns are exact.
        out.as_mut_slice().fill(0.0);
        for m in 0..=coefficients.orders() {
            out.cosine_mut(m).copy_from_slice(coefficients.cosine(m));
            out.sine_mut(m).copy_from_slice(coefficients.sine(m));
        }
        turn(out, [-gamma[1], gamma[0]]);
        self.quarter(out, scratch, parallelism);
        turn(out, [-beta[0], -beta[1]]);
        self.quarter(out, scratch, parallelism);
        turn(out, [-alpha[1], alpha[0]]);
        if all_finite(out.as_slice()) {
            Ok(())
        } else {
            Err(not_finite(
                "the rotated coefficients",
                "the coefficients",
                coefficients.as_slice(),
            ))
        }
    }

    /// Rotation by π/2 about y, in place.
    fn quarter(&self, f: &mut Coefficients, scratch: &mut [Lanes], parallelism: Parallelism) {
        let (even, odd) = scratch.split_at_mut(HALF_ARRAYS * self.steps.len());
        let mut halves = [Half::new(self, 0, even), Half::new(self, 1, odd)];
        self.scatter(f, &mut halves);
        let [even, odd] = &mut halves;
        if parallelism.threads() > 1 {
            join(|| self.half(even), || self.half(odd));
        } else {
            self.half(even);
            self.half(odd);
        }
        self.gather(&halves, f);
    }

    fn half(&self, half: &mut Half) {
        wide!(self.level, simd => self.sweep(simd, half));
    }

    /// All pairs m ≥ m′ with m of one parity.
    #[inline(always)]
    fn sweep<S: Simd>(&self, simd: S, half: &mut Half) {
        let octets = self.degree / LANES + 1;
        for first in (0..octets).step_by(BLOCK) {
            for group in first..octets {
                for octet in first..octets.min(first + BLOCK).min(group + 1) {
                    simd.vectorize(
                        #[inline(always)]
                        || {
                            if group == octet {
                                self.pairs::<S, true>(simd, half, group, octet);
                            } else {
                                self.pairs::<S, false>(simd, half, group, octet);
                            }
                        },
                    );
                }
            }
        }
    }

    /// Four orders m of a group with eight orders m′: each takes from the other.
    #[inline(always)]
    fn pairs<S: Simd, const DIAGONAL: bool>(
        &self,
        simd: S,
        half: &mut Half,
        group: usize,
        octet: usize,
    ) {
        let low = LANES * group;
        let count = self.degree + 1 - low;
        let at_octet = octet_start(self.degree, octet) + low - LANES * octet;
        let at_group = octet_start(self.degree, group);
        let steps = &self.steps[at_octet..at_octet + count];
        let factors = &self.factors[2 * at_group + half.parity * count..][..count];
        let input = &half.input[at_octet..at_octet + count];
        let output = &mut half.output[at_octet..at_octet + count];
        let rows = &half.rows[at_group..at_group + count];
        let sums = &mut half.sums[at_group..at_group + count];
        let zero = f64x8::splat(simd, 0.0);
        let (mut p, mut before, mut masks) = ([zero; ROWS], [zero; ROWS], [zero; ROWS]);
        let mut idle = true;
        for row in 0..ROWS {
            let lane = 2 * row + half.parity;
            let mut mask = [1.0; LANES];
            mask[lane] = 0.0;
            masks[row] = f64x8::load_array(simd, mask);
            if let Some(start) = self.start(low + lane, octet) {
                idle &= start.iter().all(|&v| v == 0.0);
            }
        }
        if idle {
            return;
        }
        for (i, ((((step, factor), (input, output)), row_values), sums)) in steps
            .iter()
            .zip(factors)
            .zip(input.iter().zip(output))
            .zip(rows)
            .zip(sums)
            .enumerate()
        {
            if i < LANES
                && i % 2 == half.parity
                && let Some(start) = self.start(low + i, octet)
            {
                p[i / 2] = f64x8::load_array_ref(simd, start);
            }
            let step = f64x8::load_array_ref(simd, step);
            let input = f64x8::load_array_ref(simd, input);
            let mut out = f64x8::load_array_ref(simd, output);
            let mut terms = [zero; ROWS];
            for row in 0..ROWS {
                let pair = f64x2::load_array_ref(simd, &row_values[row]);
                let mut value = f64x8::block_splat(pair);
                if DIAGONAL {
                    value *= masks[row];
                }
                out = p[row].mul_add(value, out);
                terms[row] = p[row] * input;
                let t = step * f64x8::splat(simd, factor[row]);
                let next = t.mul_sub(p[row], before[row]);
                before[row] = p[row];
                p[row] = next;
            }
            out.store_array(output);
            let total = fold(fold(terms[0], terms[2]), fold(terms[1], terms[3]));
            (f64x8::load_array_ref(simd, sums) + total).store_array(sums);
        }
    }

    /// p_m of order m and the m′ of an octet, l = m; none beyond the degree.
    #[inline(always)]
    fn start(&self, m: usize, octet: usize) -> Option<&Lanes> {
        if m > self.degree {
            return None;
        }
        // Orders before m have m′/8 + 1 octets each.
        let (k, rest) = (m / LANES, m % LANES);
        self.starts
            .get(LANES * k * (k + 1) / 2 + rest * (k + 1) + octet)
    }

    /// The scaled coefficients to both halves.
    fn scatter(&self, f: &Coefficients, halves: &mut [Half<'_>; 2]) {
        for m in 0..=self.degree {
            let (at, lane) = self.place(m);
            let (cosine, sine) = (f.cosine(m), f.sine(m));
            let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
            for (i, (&[scale, _], at)) in self.scales_of(m).iter().zip(at).enumerate() {
                let sine = sine.get(i).unwrap_or(&0.0);
                let [x, y] = ordered(i, [scale * cosine[i], scale * sine]);
                halves[0].input[at][lane] = x;
                halves[1].input[at][lane] = y;
                halves[m % 2].rows[at][lane / 2] = [sign * x, sign * y];
            }
        }
    }

    /// The rotated coefficients from the sums of both halves.
    fn gather(&self, halves: &[Half<'_>; 2], f: &mut Coefficients) {
        for m in 0..=self.degree {
            let (at, lane) = self.place(m);
            let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
            let sums = halves[m % 2].sums[at.clone()].iter();
            // What this order got as m′, from even and from odd m.
            let outputs = halves[0].output[at.clone()]
                .iter()
                .zip(&halves[1].output[at]);
            let (cosine, sine) = f.pair_mut(m);
            for (i, ((&[_, scale], sums), (from_even, from_odd))) in
                self.scales_of(m).iter().zip(sums).zip(outputs).enumerate()
            {
                let x = sums[lane / 2] + sign * from_even[lane];
                let y = sums[ROWS + lane / 2] + sign * from_odd[lane];
                let [c, s] = ordered(i, [scale * x, scale * y]);
                cosine[i] = c;
                if m > 0 {
                    sine[i] = s;
                }
            }
        }
    }

    /// Where the degrees of order m are in the arrays of a [`Half`], and in which lane.
    fn place(&self, m: usize) -> (Range<usize>, usize) {
        let (octet, lane) = (m / LANES, m % LANES);
        let start = octet_start(self.degree, octet) + lane;
        (start..start + self.degree + 1 - m, lane)
    }

    /// The scales of order m, by degree.
    fn scales_of(&self, m: usize) -> &[[f64; 2]] {
        &self.scales[scale_start(self.degree, m)..][..self.degree + 1 - m]
    }
}

/// Cosine and sine at degree m + i as what meets even m′ and what meets odd, or the other way
/// round: even m′ go with the cosines where i is even.
#[inline(always)]
fn ordered(i: usize, [a, b]: [f64; 2]) -> [f64; 2] {
    if i.is_multiple_of(2) { [a, b] } else { [b, a] }
}

/// The lanes of two vectors interleaved, and the halves added; lanes keep the parity of what they
/// sum.
#[inline(always)]
fn fold<S: Simd>(a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
    let (low, high) = a.interleave(b);
    low + high
}

fn scale_start(degree: usize, m: usize) -> usize {
    m * (degree + 1) - m * m.saturating_sub(1) / 2
}

/// How many arrays of the length of the tables a [`Half`] has.
const HALF_ARRAYS: usize = 4;

/// What goes with the orders m of one parity.
struct Half<'a> {
    parity: usize,
    /// By octet of m′ and l: the cosine where l + m′ + parity is even, else the sine, scaled.
    input: &'a mut [Lanes],
    /// The same, got from the orders m.
    output: &'a mut [Lanes],
    /// By group and l: for each of four m what meets m′ even and odd, scaled and signed.
    rows: &'a mut [[[f64; 2]; ROWS]],
    /// By group and l: for each of four m the sum over even m′, then over odd.
    sums: &'a mut [Lanes],
}

impl<'a> Half<'a> {
    fn new(plan: &Rotation, parity: usize, scratch: &'a mut [Lanes]) -> Self {
        let total = plan.steps.len();
        scratch.fill([0.0; LANES]);
        let (input, rest) = scratch.split_at_mut(total);
        let (output, rest) = rest.split_at_mut(total);
        let (rows, rest) = rest.split_at_mut(total);
        Self {
            parity,
            input,
            output,
            rows: rows.as_flattened_mut().as_chunks_mut().0.as_chunks_mut().0,
            sums: &mut rest[..total],
        }
    }
}

/// Rotation about the pole by the angle of (cos, sin), in place.
fn turn(f: &mut Coefficients, angle: [DoubleDouble; 2]) {
    let mut power = angle;
    for m in 1..=f.orders() {
        let (c, s) = (power[0].to_f64(), power[1].to_f64());
        let (cosine, sine) = f.pair_mut(m);
        for (x, y) in cosine.iter_mut().zip(sine) {
            (*x, *y) = (*x * c - *y * s, *x * s + *y * c);
        }
        power = times(power, angle);
    }
}
