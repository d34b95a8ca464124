//! The Legendre recurrence of the transform: its tables, its three forms, and where each ring enters it.
//!
//! With x = cos θ, s = sin θ, ε_l = √((l²−m²)/(4l²−1)), two steps of the three-term recurrence at once give, for l = m + 2k,
//! P̄_lm = α_k p_k with p_{k+1} = t_k p_k − p_{k−1}, t_k = a_k (x² − ε²_{l+1} − ε²_l), a_k = 4 α_k²,
//! where α_k α_{k−1} ε_l ε_{l−1} = ¼. The odd l − m need no recurrence of their own: Σ s_k P̄_{l+1} = x Σ b_k P̄_l, with b from s by a
//! recurrence in the coefficients (Ishioka 2018, doi:10.2151/jmsj.2018-019).
//!
//! Rounding in t_k turns the phase of p_k, which goes as cos 2kθ, by ε/sin 2θ a step: on the ring nearest a pole at lmax 2047
//! that costs five digits. So near the poles the differences D_k = p_k − p_{k−1} are carried, D_{k+1} = D_k + (t_k − 2) p_k,
//! and near the equator, where p alternates in sign, the sums S_k = p_k + p_{k−1}, S_{k+1} = (t_k + 2) p_k − S_k; t_k ∓ 2 come
//! without cancellation from s² and x².

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};

use super::simd::wide;
use crate::sphere::Grid;
use crate::sphere::double_double::DoubleDouble;

/// How many rings of one hemisphere go side by side.
pub(crate) const LANES: usize = 8;

/// One value for each of eight rings.
pub(crate) type Lanes = [f64; LANES];

/// |P̄_lm| below this is not summed: a term of a sum that it belongs to is then below the rounding of any other.
const NEGLIGIBLE: f64 = 1.0 / (1u128 << 64) as f64;

/// The form of the recurrence that eight rings use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// p_k and p_{k−1}.
    Plain,
    /// p_k and p_k − p_{k−1}, with t_k − 2.
    Polar,
    /// p_k and p_k + p_{k−1}, with t_k + 2.
    Equatorial,
}

/// Forms as const parameters.
pub(crate) const PLAIN: usize = 1;
pub(crate) const POLAR: usize = 2;
pub(crate) const EQUATORIAL: usize = 3;

/// sin 2θ below which a ring takes a difference or sum form.
const STEEP: f64 = 0.25;

/// Eight rings of the northern hemisphere.
#[derive(Debug, Clone)]
pub(crate) struct Octet {
    pub(crate) form: Form,
    /// cos θ.
    pub(crate) x: Lanes,
    /// What multiplies a_k: x², or −s² in the polar form.
    pub(crate) argument: Lanes,
}

/// Values with which rings enter the recurrence at step k; zero for the rings that enter elsewhere.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) step: usize,
    /// p_k.
    pub(crate) p: Lanes,
    /// The second state of the form.
    pub(crate) d: Lanes,
}

/// What a step needs: a_k, then the constant of each form: −a(ε²+ε²), a(1−ε²−ε²) − 2, 2 − a(ε²+ε²).
pub(crate) type Step = [f64; 4];

/// What turns coefficients of harmonics into those of the recurrence: α_k, 1/ε_{l+1}, ε_{l+2}.
pub(crate) type Scale = [f64; 3];

/// The tables of all orders on one grid.
pub(crate) struct Recurrence {
    degree: usize,
    /// How many octets a block has, the last but perhaps fewer.
    width: usize,
    pub(crate) octets: Vec<Octet>,
    steps: Vec<Step>,
    scales: Vec<Scale>,
    /// Where each order begins in `steps` and `scales`.
    starts: Vec<usize>,
    entries: Vec<Entry>,
    /// Where each (order, octet) begins in `entries`.
    entry_starts: Vec<u32>,
}

impl Recurrence {
    pub(crate) fn new(grid: &Grid, degree: usize, orders: usize, level: Level) -> Self {
        // Eight registers of sums for each octet: AVX-512 holds four octets, less holds one. Short columns prefer more blocks, because
        // each starts where its own rings begin to matter.
        let width = match level.as_avx512() {
            Some(_) if grid.rings() > 256 => 4,
            Some(_) => 2,
            None => 1,
        };
        let (octets, sines) = octets(grid, width);
        let count: usize = (0..=orders).map(|m| (degree - m) / 2 + 1).sum();
        let mut recurrence = Self {
            degree,
            width,
            steps: Vec::with_capacity(count),
            scales: Vec::with_capacity(count),
            starts: vec![0],
            entries: Vec::new(),
            entry_starts: vec![0],
            octets,
        };
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
            for (octet, (mantissas, exponents)) in recurrence.octets.iter().zip(&powers) {
                let steps = &recurrence.steps[start..];
                let scales = &recurrence.scales[start..];
                let first = mantissas.map(|p| p.to_f64() * factor);
                wide!(level, simd => enter(simd, octet, steps, scales, first, *exponents, &mut recurrence.entries));
                recurrence
                    .entry_starts
                    .push(recurrence.entries.len() as u32);
            }
        }
        recurrence
    }

    /// The steps of order m.
    pub(crate) fn steps(&self, m: usize) -> &[Step] {
        &self.steps[self.starts[m]..self.starts[m + 1]]
    }

    /// The scales of order m.
    pub(crate) fn scales(&self, m: usize) -> &[Scale] {
        &self.scales[self.starts[m]..self.starts[m + 1]]
    }

    /// The octets in blocks, each of one form.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        let count = self.octets.len();
        (0..count)
            .step_by(self.width)
            .map(move |first| first..count.min(first + self.width))
    }

    /// Where the rings of an octet enter order m, by ascending step; none where all of them are negligible throughout.
    pub(crate) fn entries(&self, m: usize, octet: usize) -> &[Entry] {
        let at = m * self.octets.len() + octet;
        &self.entries[self.entry_starts[at] as usize..self.entry_starts[at + 1] as usize]
    }

    /// The columns of order m as coefficients of x-free sums: `out[stride · k] = [α c_even, α s_even, α b_cos, α b_sin]`.
    pub(crate) fn prepare(
        &self,
        m: usize,
        cosine: &[f64],
        sine: &[f64],
        out: &mut [[f64; 4]],
        stride: usize,
    ) {
        let top = self.degree - m;
        let at = |column: &[f64], i: usize| {
            if i <= top {
                column.get(i).copied().unwrap_or(0.0)
            } else {
                0.0
            }
        };
        let (mut bc, mut bs) = (0.0, 0.0);
        for (k, &[alpha, r, e]) in self.scales(m).iter().enumerate().rev() {
            let back = r * e;
            bc = r * at(cosine, 2 * k + 1) - back * bc;
            bs = r * at(sine, 2 * k + 1) - back * bs;
            out[k * stride] = [
                alpha * at(cosine, 2 * k),
                alpha * at(sine, 2 * k),
                alpha * bc,
                alpha * bs,
            ];
        }
    }

    /// The adjoint of [`prepare`](Self::prepare): sums over rings into the columns of order m.
    pub(crate) fn finish(
        &self,
        m: usize,
        sums: &[[f64; 4]],
        stride: usize,
        cosine: &mut [f64],
        sine: &mut [f64],
    ) {
        let (mut c, mut s, mut before) = (0.0, 0.0, 0.0);
        for (k, &[alpha, r, e]) in self.scales(m).iter().enumerate() {
            let [ec, es, oc, os] = sums[k * stride];
            let back = r * before;
            c = r * alpha * oc - back * c;
            s = r * alpha * os - back * s;
            before = e;
            cosine[2 * k] = alpha * ec;
            if let Some(value) = cosine.get_mut(2 * k + 1) {
                *value = c;
            }
            if let Some(value) = sine.get_mut(2 * k) {
                *value = alpha * es;
            }
            if let Some(value) = sine.get_mut(2 * k + 1) {
                *value = s;
            }
        }
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.steps)
            + size_of_val(&*self.scales)
            + size_of_val(&*self.entries)
            + size_of_val(&*self.entry_starts)
    }
}

/// The northern rings in eights, and their sines; the last octet is filled up with rings whose harmonics all vanish. Each `width`
/// octets share a form.
fn octets(grid: &Grid, width: usize) -> (Vec<Octet>, Vec<Lanes>) {
    let pairs = grid.rings().div_ceil(2);
    let mut octets = Vec::with_capacity(pairs.div_ceil(LANES));
    let mut all_sines = Vec::with_capacity(pairs.div_ceil(LANES));
    for start in (0..pairs).step_by(LANES * width) {
        let end = pairs.min(start + LANES * width);
        let (cosines, sines) = (&grid.cosines()[start..end], &grid.sines()[start..end]);
        let steep = cosines.iter().zip(sines).any(|(x, s)| 2.0 * x * s < STEEP);
        let middle = (end - start) / 2;
        let form = match (steep, cosines[middle] > sines[middle]) {
            (false, _) => Form::Plain,
            (true, true) => Form::Polar,
            (true, false) => Form::Equatorial,
        };
        for (cosines, sines) in cosines.chunks(LANES).zip(sines.chunks(LANES)) {
            let (mut x, mut s) = ([0.0; LANES], [0.0; LANES]);
            x[..cosines.len()].copy_from_slice(cosines);
            s[..sines.len()].copy_from_slice(sines);
            let argument = if form == Form::Polar {
                s.map(|s| -(s * s))
            } else {
                x.map(|x| x * x)
            };
            octets.push(Octet { form, x, argument });
            all_sines.push(s);
        }
    }
    (octets, all_sines)
}

/// ε_l² as its numerator and denominator, exact in doubles for l ≤ 4098.
fn epsilon_squared(l: usize, m: usize) -> (f64, f64) {
    ((l * l - m * m) as f64, (4 * l * l) as f64 - 1.0)
}

fn push_tables(m: usize, degree: usize, steps: &mut Vec<Step>, scales: &mut Vec<Scale>) {
    let count = (degree - m) / 2 + 1;
    let start = steps.len();
    steps.resize(start + count, [0.0; 4]);
    scales.resize(start + count, [0.0; 3]);
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
    for k in (0..count).rev() {
        let l = m + 2 * k;
        let e = ratio(epsilon_squared(l + 1, m)) + ratio(epsilon_squared(l, m));
        let a = square.scale(4.0);
        let ae = a * e;
        steps[start + k] = [
            a.to_f64(),
            -ae.to_f64(),
            (a - ae - DoubleDouble::from(2.0)).to_f64(),
            (DoubleDouble::from(2.0) - ae).to_f64(),
        ];
        let (n, d) = epsilon_squared(l + 1, m);
        let (n2, d2) = epsilon_squared(l + 2, m);
        scales[start + k] = [square.hi.sqrt(), (d / n).sqrt(), (n2 / d2).sqrt()];
        if k > 0 {
            let (n, d) = product(k);
            square = DoubleDouble::from(d).divide(square.scale(16.0 * n));
        }
    }
}

/// A lane's true value is mantissa · 2^(400 · exponent), the mantissa within 2^±200 of 1.
const BIG: f64 = (1u128 << 100) as f64 * (1u128 << 100) as f64;

/// How many steps go between two looks at the size of the values; one step multiplies them by less than 2^16.
const STRIDE: usize = 4;

/// Follows eight rings from k = 0, with exponents of their own, to where each is representable and the first is not negligible.
#[inline(always)]
fn enter<S: Simd>(
    simd: S,
    octet: &Octet,
    steps: &[Step],
    scales: &[Scale],
    first: Lanes,
    mut exponents: [i32; LANES],
    entries: &mut Vec<Entry>,
) {
    let argument = f64x8::load_array_ref(simd, &octet.argument);
    let mut p = f64x8::load_array(simd, first);
    let mut d = match octet.form {
        Form::Plain => f64x8::splat(simd, 0.0),
        Form::Polar | Form::Equatorial => p,
    };
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
                exponents[i] > 0 || (exponents[i] == 0 && ps[i].abs() * alpha >= NEGLIGIBLE)
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
            match octet.form {
                Form::Plain => {
                    let t = argument.mul_add(a, f64x8::splat(simd, step[PLAIN]));
                    (p, d) = (t.mul_sub(p, d), p);
                }
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

/// The entry of the lanes that are representable and not yet inside.
fn entry(
    &(step, p, d, exponents): &(usize, Lanes, Lanes, [i32; LANES]),
    inside: &mut [bool; LANES],
) -> Option<Entry> {
    let mut entry = Entry {
        step,
        p: [0.0; LANES],
        d: [0.0; LANES],
    };
    let mut any = false;
    for lane in 0..LANES {
        if !inside[lane] && exponents[lane] >= -1 {
            let unit = match exponents[lane] {
                -1 => 1.0 / BIG / BIG,
                0 => 1.0,
                _ => BIG * BIG,
            };
            inside[lane] = true;
            any = true;
            entry.p[lane] = p[lane] * unit;
            entry.d[lane] = d[lane] * unit;
        }
    }
    any.then_some(entry)
}
