//! The Legendre recurrence of the transform: its tables, its three forms, and where each ring
//! enters it.
//!
//! With x = cos θ, s = sin θ, ε_l = √((l²−m²)/(4l²−1)), two steps of the three-term recurrence at
//! once give, for l = m + 2k, P̄_lm = α_k p_k with p_{k+1} = t_k p_k − p_{k−1}, t_k = a_k (x² −
//! ε²_{l+1} − ε²_l), a_k = 4 α_k², where α_k α_{k−1} ε_l ε_{l−1} = ¼. The odd l − m need no
//! recurrence of their own: Σ s_k P̄_{l+1} = x Σ b_k P̄_l, with b from s by a recurrence in the
//! coefficients (Ishioka 2018, doi:10.2151/jmsj.2018-019).
//!
//! Rounding in t_k turns the phase of p_k, which goes as cos 2kθ, by ε/sin 2θ a step: on the ring
//! nearest a pole at lmax 2047 that costs five digits. So down to 45° from the pole the differences
//! D_k = p_k − p_{k−1} are carried, D_{k+1} = D_k + (t_k − 2) p_k, and nearer the equator, where p
//! alternates in sign, the sums S_k = p_k + p_{k−1}, S_{k+1} = (t_k + 2) p_k − S_k; t_k ∓ 2 come
//! without cancellation from s² and x².

use std::f64::consts::PI;

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};

use super::lane::Lane;
use super::simd::wide;
use crate::numeric::double_double::DoubleDouble;
use crate::sphere::Grid;
use crate::vectors;

/// How many rings of one hemisphere go side by side in double precision.
pub(crate) const LANES: usize = 8;

/// One value for each of eight rings.
pub(crate) type Lanes = [f64; LANES];

/// The form of the recurrence that the rings of a bundle use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// p_k and p_k − p_{k−1}, with t_k − 2.
    Polar,
    /// p_k and p_k + p_{k−1}, with t_k + 2.
    Equatorial,
}

/// Rings of the northern hemisphere that go side by side.
#[derive(Debug, Clone)]
pub(crate) struct Bundle<R: Lane = f64> {
    /// cos θ.
    pub(crate) x: R::Lanes,
    /// What multiplies a_k: x², or −s² in the polar form.
    pub(crate) argument: R::Lanes,
    /// What rounding has taken from the argument: in single precision it would turn the phase of p_k
    /// by as much in every step.
    pub(crate) rest: R::Lanes,
    form: Form,
}

impl<R: Lane> Bundle<R> {
    /// Whether the rings use the polar form.
    pub(crate) fn is_polar(&self) -> bool {
        self.form == Form::Polar
    }
}

/// Bundles that go side by side, the first `polar` of them in the polar form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) first: usize,
    pub(crate) width: usize,
    pub(crate) polar: usize,
}

/// The state of a bundle from step k on, a multiple of [`STRIDE`]: where rings enter the recurrence;
/// zero for those that enter later.
#[derive(Debug, Clone)]
pub(crate) struct Entry<R: Lane = f64> {
    pub(crate) step: usize,
    /// p_k.
    pub(crate) p: R::Lanes,
    /// The second state of the form.
    pub(crate) d: R::Lanes,
}

/// What a step needs: a_k, then the constant of each form: a(1−ε²−ε²) − 2, 2 − a(ε²+ε²).
pub(crate) type Step<R = f64> = [R; 3];

/// Where the constants are in a [`Step`].
pub(crate) const POLAR: usize = 1;
pub(crate) const EQUATORIAL: usize = 2;

/// What turns coefficients of harmonics into those of the recurrence: α_k, α_k g_k, h_k, where b_k
/// = g_k Σ_{j ≥ k} h_j s_j solves b_k = (s_k − ε_{l+2} b_{k+1})/ε_{l+1}: g_k = −g_{k+1}
/// ε_{l+2}/ε_{l+1}, h_k = 1/(ε_{l+1} g_k).
pub(crate) type Scale = [f64; 3];

/// The tables of all orders on one grid.
pub(crate) struct Recurrence<R: Lane = f64> {
    pub(crate) bundles: Vec<Bundle<R>>,
    pub(crate) blocks: Vec<Block>,
    /// By order, as many as there are pairs of degrees, and one of zeros more where that is odd.
    pub(super) steps: Vec<Step<R>>,
    pub(super) scales: Vec<Scale>,
    /// Where each order begins in `steps` and `scales`.
    pub(super) starts: Vec<usize>,
    pub(super) entries: Vec<Entry<R>>,
    /// Where each (order, bundle) begins in `entries`.
    pub(super) entry_starts: Vec<u32>,
}

impl Recurrence {
    pub(crate) fn new(grid: &Grid, degree: usize, orders: usize, level: Level) -> Self {
        let (bundles, sines, blocks) = bundles(grid, level);
        let count: usize = (0..=orders).map(|m| padded_steps(degree, m)).sum();
        let mut recurrence = Self {
            bundles,
            blocks,
            steps: Vec::with_capacity(count),
            scales: Vec::with_capacity(count),
            starts: vec![0],
            entries: Vec::new(),
            entry_starts: vec![0],
        };
        let negligible = negligible::<f64>(degree);
        // sin^m θ as mantissa · 2^(UNIT · exponent), and the square of what multiplies it in P̄_mm.
        let mut powers = vec![([DoubleDouble::ONE; LANES], [0i32; LANES]); sines.len()];
        let mut square = DoubleDouble::ONE.divide(DoubleDouble::PI.scale(4.0));
        for m in 0..=orders {
            if m > 0 {
                square = square
                    .scale((2 * m + 1) as f64)
                    .divide(DoubleDouble::from((2 * m) as f64));
                if m == 1 {
                    square = square.scale(2.0);
                }
                for ((mantissas, exponents), sines) in powers.iter_mut().zip(&sines) {
                    for lane in 0..LANES {
                        let mut power = mantissas[lane].scale(sines[lane]);
                        if power.hi != 0.0 && power.hi < 1.0 / BIG {
                            power = power.scale(BIG).scale(BIG);
                            exponents[lane] -= 1;
                        }
                        mantissas[lane] = power;
                    }
                }
            }
            let start = recurrence.steps.len();
            push_tables(m, degree, &mut recurrence.steps, &mut recurrence.scales);
            recurrence.starts.push(recurrence.steps.len());
            let factor = square.sqrt().to_f64() / recurrence.scales[start][0];
            for (bundle, (mantissas, exponents)) in recurrence.bundles.iter().zip(&powers) {
                let steps = &recurrence.steps[start..];
                let scales = &recurrence.scales[start..start + (degree - m) / 2 + 1];
                let first = mantissas.map(|p| p.to_f64() * factor);
                wide!(level, simd => enter(simd, bundle, steps, scales, (first, *exponents), negligible, &mut recurrence.entries));
                recurrence
                    .entry_starts
                    .push(recurrence.entries.len() as u32);
            }
        }
        recurrence
    }
}

impl<R: Lane> Recurrence<R> {
    /// The steps of order m.
    pub(crate) fn steps(&self, m: usize) -> &[Step<R>] {
        &self.steps[self.starts[m]..self.starts[m + 1]]
    }

    /// How many steps all orders have.
    pub(crate) fn steps_of_all(&self) -> usize {
        self.steps.len()
    }

    /// The scales of order m.
    pub(crate) fn scales(&self, m: usize) -> &[Scale] {
        &self.scales[self.starts[m]..self.starts[m + 1]]
    }

    /// Where the rings of a bundle enter order m, by ascending step; none where all of them are
    /// negligible throughout.
    pub(crate) fn entries(&self, m: usize, bundle: usize) -> &[Entry<R>] {
        let at = m * self.bundles.len() + bundle;
        &self.entries[self.entry_starts[at] as usize..self.entry_starts[at + 1] as usize]
    }

    /// The columns of order m as coefficients of x-free sums: `out[k][map] = [α c_even, α s_even, α
    /// b_cos, α b_sin]`, from `columns[map]`, the cosines and after them as many sines. The maps go
    /// side by side, since each b waits for the one before it.
    #[inline(always)]
    pub(crate) fn prepare<const MAPS: usize>(
        &self,
        m: usize,
        columns: &[&[R]; MAPS],
        out: &mut [[[R; 4]; MAPS]],
    ) {
        let count = columns[0].len() / 2;
        let pairs = count / 2;
        let (out, rest) = out.split_at_mut(pairs);
        let (scales, last_scale) = self.scales(m).split_at(pairs);
        let columns = columns.map(|column| column.split_at(count));
        let mut b = [[0.0; 2]; MAPS];
        rest.fill([[R::default(); 4]; MAPS]);
        if let (1, [out, ..], [scale, ..]) = (count % 2, rest, last_scale) {
            for ((out, b), (cosine, sine)) in out.iter_mut().zip(&mut b).zip(&columns) {
                let alone = |column: &[R]| [column[count - 1], R::default()];
                *out = prepared(scale, alone(cosine), alone(sine), b);
            }
        }
        let cosines = columns.map(|(cosine, _)| &cosine.as_chunks::<2>().0[..pairs]);
        let sines = columns.map(|(_, sine)| &sine.as_chunks::<2>().0[..pairs]);
        for (k, (out, scale)) in out.iter_mut().zip(scales).enumerate().rev() {
            for map in 0..MAPS {
                out[map] = prepared(scale, cosines[map][k], sines[map][k], &mut b[map]);
            }
        }
    }

    /// The adjoint of [`prepare`](Self::prepare): sums over rings, two steps in each of `sums`,
    /// into the columns of order m.
    #[inline(always)]
    pub(crate) fn finish<const MAPS: usize>(
        &self,
        m: usize,
        sums: &[[R::Lanes; MAPS]],
        columns: [&mut [R]; MAPS],
    ) {
        let scales = self.scales(m);
        let count = columns[0].len() / if m == 0 { 1 } else { 2 };
        let pairs = count / 2;
        let mut b = [[0.0; 2]; MAPS];
        let mut columns = columns.map(|column| column.split_at_mut(count));
        for (k, scale) in scales.iter().enumerate().take(pairs) {
            let sums = &sums[k / 2];
            for map in 0..MAPS {
                let sums = &four_of::<R>(&sums[map], k % 2);
                let (c, s) = finished(scale, sums, &mut b[map]);
                let (cosine, sine) = &mut columns[map];
                cosine[2 * k..2 * k + 2].copy_from_slice(&c.map(R::of));
                if m > 0 {
                    sine[2 * k..2 * k + 2].copy_from_slice(&s.map(R::of));
                }
            }
        }
        if count % 2 == 1 {
            for map in 0..MAPS {
                let sums = &four_of::<R>(&sums[pairs / 2][map], pairs % 2);
                let (c, s) = finished(&scales[pairs], sums, &mut b[map]);
                let (cosine, sine) = &mut columns[map];
                cosine[count - 1] = R::of(c[0]);
                if m > 0 {
                    sine[count - 1] = R::of(s[0]);
                }
            }
        }
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.steps)
            + size_of_val(&*self.scales)
            + size_of_val(&*self.entries)
            + size_of_val(&*self.bundles)
            + size_of_val(&*self.entry_starts)
    }
}

/// One row of [`Recurrence::prepare`] from two degrees of the cosine and the sine column; `b` is Σ
/// h s of the rows above it.
#[inline(always)]
fn prepared<R: Lane>(&[alpha, g, h]: &Scale, c: [R; 2], s: [R; 2], b: &mut [f64; 2]) -> [R; 4] {
    let (c, s) = (c.map(R::value), s.map(R::value));
    b[0] += h * c[1];
    b[1] += h * s[1];
    [alpha * c[0], alpha * s[0], g * b[0], g * b[1]].map(R::of)
}

/// The four sums of the first or the second of two steps: parts of each are in every eighth lane.
#[inline(always)]
fn four_of<R: Lane>(sums: &R::Lanes, second: usize) -> [f64; 4] {
    std::array::from_fn(|i| {
        let parts = sums.as_ref()[4 * second + i..].iter().step_by(8);
        parts.map(|part| part.value()).sum()
    })
}

/// Two degrees of the cosine and the sine column from one row of sums; `b` is Σ g of the rows below
/// it.
#[inline(always)]
fn finished(
    &[alpha, g, h]: &Scale,
    &[ec, es, oc, os]: &[f64; 4],
    b: &mut [f64; 2],
) -> ([f64; 2], [f64; 2]) {
    b[0] += g * oc;
    b[1] += g * os;
    ([alpha * ec, h * b[0]], [alpha * es, h * b[1]])
}

/// How many steps order m has in the tables: an even number.
fn padded_steps(degree: usize, m: usize) -> usize {
    ((degree - m) / 2 + 1).next_multiple_of(2)
}

/// Below this P̄_lm counts as 0: leaving out |P̄_lm| < τ changes no value of a map by more than
/// τ Σ |f_lm| ≤ τ √(4π) (degree + 1) rms.
pub(super) fn negligible<R: Lane>(degree: usize) -> f64 {
    R::NEGLIGIBLE / ((4.0 * PI).sqrt() * (degree + 1) as f64)
}

/// The northern rings in bundles, their sines, and blocks of them; the last bundle is filled up with
/// rings whose harmonics all vanish.
pub(super) fn bundles<R: Lane>(
    grid: &Grid,
    level: Level,
) -> (Vec<Bundle<R>>, Vec<R::Lanes>, Vec<Block>) {
    // Eight registers of sums for each bundle: AVX-512 holds four bundles, less holds one.
    let width = if vectors::hold_eight(level) { 4 } else { 1 };
    let pairs = grid.rings().div_ceil(2);
    let count = pairs.div_ceil(R::LANES);
    let is_polar = |bundle: usize| {
        let middle = (bundle * R::LANES + R::LANES / 2).min(pairs - 1);
        grid.cosines()[middle] > grid.sines()[middle]
    };
    let mut blocks = Vec::new();
    let mut first = 0;
    while first < count {
        let width = [4, 2, 1]
            .into_iter()
            .find(|&w| w <= width && first + w <= count)
            .unwrap_or(1);
        let polar = (first..first + width).filter(|&o| is_polar(o)).count();
        // Of four, none, two or all.
        let polar = if width == 4 && polar % 2 == 1 {
            2
        } else {
            polar
        };
        blocks.push(Block {
            first,
            width,
            polar,
        });
        first += width;
    }
    let forms = blocks.iter().flat_map(|block| {
        (0..block.width).map(|v| {
            if v < block.polar {
                Form::Polar
            } else {
                Form::Equatorial
            }
        })
    });
    let (bundles, sines) = forms
        .zip(grid.cosines()[..pairs].chunks(R::LANES))
        .zip(grid.sines()[..pairs].chunks(R::LANES))
        .map(|((form, cosines), sines)| {
            let lanes = |f: &dyn Fn(f64, f64) -> f64| {
                R::lanes(|i| match (cosines.get(i), sines.get(i)) {
                    (Some(&x), Some(&s)) => R::of(f(x, s)),
                    _ => R::default(),
                })
            };
            let argument = |x: f64, s: f64| match form {
                Form::Polar => -(s * s),
                Form::Equatorial => x * x,
            };
            let bundle = Bundle {
                x: lanes(&|x, _| x),
                argument: lanes(&argument),
                rest: lanes(&|x, s| argument(x, s) - R::of(argument(x, s)).value()),
                form,
            };
            (bundle, lanes(&|_, s| s))
        })
        .unzip();
    (bundles, sines, blocks)
}

/// ε_l² as its numerator and denominator, exact in doubles for l ≤ 4098.
fn epsilon_squared(l: usize, m: usize) -> (f64, f64) {
    ((l * l - m * m) as f64, (4 * l * l) as f64 - 1.0)
}

fn push_tables(m: usize, degree: usize, steps: &mut Vec<Step>, scales: &mut Vec<Scale>) {
    let count = (degree - m) / 2 + 1;
    let start = steps.len();
    steps.resize(start + padded_steps(degree, m), [0.0; 3]);
    scales.resize(start + padded_steps(degree, m), [0.0; 3]);
    let ratio = |(n, d): (f64, f64)| {
        if n == 0.0 {
            DoubleDouble::ZERO
        } else {
            DoubleDouble::from(n).divide(DoubleDouble::from(d))
        }
    };
    // ε_l² ε_{l−1}² at l = m + 2k, as numerator and denominator, exact.
    let product = |k: usize| {
        let (n1, d1) = epsilon_squared(m + 2 * k, m);
        let (n0, d0) = epsilon_squared(m + 2 * k - 1, m);
        (n1 * n0, d1 * d0)
    };
    // Any α at the top gives a valid recurrence; this one keeps α from alternating. α² ε² ε² ≈ ¼.
    let ((n0, d0), (n1, d1)) = (product(count), product(count + 1));
    let mut square = DoubleDouble::from(0.25 * (d0 / n0 * (d1 / n1)).powf(0.25));
    // g_k² and the sign of g_k, any at the top.
    let (mut g2, mut sign) = (DoubleDouble::ONE, 1.0);
    for k in (0..count).rev() {
        let l = m + 2 * k;
        let e1 = ratio(epsilon_squared(l + 1, m));
        let e = e1 + ratio(epsilon_squared(l, m));
        let a = square.scale(4.0);
        let ae = a * e;
        steps[start + k] = [
            a.to_f64(),
            (a - ae - DoubleDouble::from(2.0)).to_f64(),
            (DoubleDouble::from(2.0) - ae).to_f64(),
        ];
        let alpha = square.sqrt();
        let g = g2.sqrt();
        scales[start + k] = [
            alpha.to_f64(),
            sign * (alpha * g).to_f64(),
            sign * DoubleDouble::ONE.divide((e1 * g2).sqrt()).to_f64(),
        ];
        if k > 0 {
            let (n, d) = product(k);
            square = DoubleDouble::from(d).divide(square.scale(16.0 * n));
            // ε_l²/ε_{l−1}²
            let ((n1, d1), (n0, d0)) = (epsilon_squared(l, m), epsilon_squared(l - 1, m));
            g2 = g2.scale(n1 * d0).divide(DoubleDouble::from(d1 * n0));
            sign = -sign;
        }
    }
}

/// A lane's true value is mantissa · 2^(400 · exponent), the mantissa within 2^±200 of 1.
const BIG: f64 = (1u128 << 100) as f64 * (1u128 << 100) as f64;

/// How many steps go between two looks at the size of the values, an even number; one step
/// multiplies them by less than 2^16.
pub(super) const STRIDE: usize = 4;

/// Follows eight rings from k = 0, with exponents of their own, to where each is representable and
/// the first is not negligible.
#[inline(always)]
fn enter<S: Simd>(
    simd: S,
    bundle: &Bundle,
    steps: &[Step],
    scales: &[Scale],
    (first, mut exponents): (Lanes, [i32; LANES]),
    negligible: f64,
    entries: &mut Vec<Entry>,
) {
    let argument = f64x8::load_array_ref(simd, &bundle.argument);
    let mut p = f64x8::load_array(simd, first);
    let mut d = p;
    // Lanes that are in already, or are padding.
    let mut inside: [bool; LANES] = std::array::from_fn(|i| first[i] == 0.0);
    let mut entered = false;
    let mut before = (0, first, <[f64; LANES]>::from(d), exponents);
    let mut k = 0;
    loop {
        let (mut ps, mut ds) = (<[f64; LANES]>::from(p), <[f64; LANES]>::from(d));
        for lane in 0..LANES {
            if ps[lane].abs() > BIG {
                ps[lane] *= 1.0 / BIG / BIG;
                ds[lane] *= 1.0 / BIG / BIG;
                exponents[lane] += 1;
            }
        }
        p = f64x8::load_array(simd, ps);
        d = f64x8::load_array(simd, ds);
        if !entered {
            let alpha = scales[k.min(scales.len() - 1)][0];
            let matters = (0..LANES).any(|i| {
                exponents[i] > 0 || (exponents[i] == 0 && ps[i].abs() * alpha >= negligible)
            });
            if matters {
                entered = true;
                entries.extend(entry(&before, &mut inside));
            }
        }
        if entered {
            entries.extend(entry(&(k, ps, ds, exponents), &mut inside));
            if inside.iter().all(|&i| i) {
                return;
            }
        }
        before = (k, ps, ds, exponents);
        if k >= steps.len() {
            return;
        }
        for step in &steps[k..steps.len().min(k + STRIDE)] {
            let a = f64x8::splat(simd, step[0]);
            match bundle.form {
                Form::Polar => {
                    let u = argument.mul_add(a, f64x8::splat(simd, step[POLAR]));
                    d = u.mul_add(p, d);
                    p += d;
                }
                Form::Equatorial => {
                    let u = argument.mul_add(a, f64x8::splat(simd, step[EQUATORIAL]));
                    d = u.mul_sub(p, d);
                    p = d - p;
                }
            }
            k += 1;
        }
    }
}

/// The state of the lanes that are representable, where one of them is not yet inside.
fn entry(
    &(step, p, d, exponents): &(usize, Lanes, Lanes, [i32; LANES]),
    inside: &mut [bool; LANES],
) -> Option<Entry> {
    let mut entry = Entry::<f64> {
        step,
        p: [0.0; LANES],
        d: [0.0; LANES],
    };
    let mut any = false;
    for lane in 0..LANES {
        if exponents[lane] >= -1 {
            let unit = match exponents[lane] {
                -1 => 1.0 / BIG / BIG,
                0 => 1.0,
                _ => BIG * BIG,
            };
            any |= !inside[lane];
            inside[lane] = true;
            entry.p[lane] = p[lane] * unit;
            entry.d[lane] = d[lane] * unit;
        }
    }
    any.then_some(entry)
}
