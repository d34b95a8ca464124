//! The Fourier transforms along rings: as many pairs of rings at a time as there are lanes, one
//! complex transform for each pair.
//!
//! A lane holds one northern ring as the real part and its southern mirror as the imaginary part,
//! so that one complex transform serves two real rings and no shuffling is needed inside it. In
//! place, mixed radix, depth first: decimation in frequency forwards leaves the spectrum permuted,
//! and decimation in time takes it so.

use std::f64::consts::PI;

use fearless_simd::prelude::*;

use super::lane::Lane;

/// A complex number for each lane: the real parts, then the imaginary.
pub(crate) type Element<R = f64> = [<R as Lane>::Lanes; 2];

/// The plan for rings of one length.
pub(crate) struct RingFft<R: Lane = f64> {
    stages: Vec<Stage<R>>,
    /// Where frequency k is in the permuted spectrum.
    positions: Vec<u32>,
}

struct Stage<R> {
    radix: usize,
    /// How many elements each of the `radix` parts has.
    part: usize,
    /// e^(−2πi q t/(radix · part)) for q < part, 1 ≤ t < radix; `[q (radix − 1) + t − 1]`.
    twiddles: Vec<[R; 2]>,
    /// e^(−2πi t/radix), for a radix without a butterfly of its own.
    roots: Vec<[R; 2]>,
}

/// e^(−2πi k/n), from an angle of at most an eighth of a turn.
fn root(k: usize, n: usize) -> [f64; 2] {
    let k = k % n;
    let quarter = (4 * k + n / 2) / n;
    let rest = (4 * k) as f64 - (quarter * n) as f64;
    let (s, c) = (PI / 2.0 * (rest / n as f64)).sin_cos();
    match quarter % 4 {
        0 => [c, -s],
        1 => [-s, -c],
        2 => [-c, s],
        _ => [s, c],
    }
}

impl<R: Lane> RingFft<R> {
    pub(crate) fn new(length: usize) -> Self {
        let mut radices = Vec::new();
        let mut rest = length;
        while rest.is_multiple_of(4) && rest != 8 {
            radices.push(4);
            rest /= 4;
        }
        let mut radix = 2;
        while rest > 1 {
            if radix == 2 && rest == 8 {
                radices.push(8);
                rest = 1;
            } else if rest.is_multiple_of(radix) {
                radices.push(radix);
                rest /= radix;
            } else if radix * radix > rest {
                radix = rest;
            } else {
                radix += 1;
            }
        }
        let mut positions = vec![0u32];
        for &radix in radices.iter().rev() {
            // k = t + radix · s lies at t · part + position(s)
            let part = positions.len();
            positions = (0..part * radix)
                .map(|k| (k % radix * part) as u32 + positions[k / radix])
                .collect();
        }
        let mut size = length;
        let stages = radices
            .iter()
            .map(|&radix| {
                let part = size / radix;
                let twiddles = (0..part)
                    .flat_map(|q| (1..radix).map(move |t| (q * t, size)))
                    .map(|(k, n)| root(k, n).map(R::of))
                    .collect();
                size = part;
                Stage {
                    radix,
                    part,
                    twiddles,
                    roots: (0..radix).map(|t| root(t, radix).map(R::of)).collect(),
                }
            })
            .collect();
        Self { stages, positions }
    }

    /// Where frequency k is in the permuted spectrum.
    #[inline(always)]
    pub(crate) fn position(&self, k: usize) -> usize {
        self.positions[k] as usize
    }

    /// How many elements there are.
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    /// How many elements there are, and how many more the transform needs to work in.
    pub(crate) fn work_len(&self) -> usize {
        self.positions.len() + self.stages.iter().map(|s| s.radix).max().unwrap_or(0)
    }

    /// Σ_j z_j e^(−2πi jk/n), in place, the result permuted. `buffer` has
    /// [`work_len`](Self::work_len) elements.
    #[inline(always)]
    pub(crate) fn forward<S: Simd>(&self, simd: S, buffer: &mut [Element<R>]) {
        let (data, work) = buffer.split_at_mut(self.positions.len());
        self.descend::<S, false>(simd, 0, data, work);
    }

    /// Σ_k z_k e^(+2πi jk/n), in place, from a permuted spectrum. `buffer` has
    /// [`work_len`](Self::work_len) elements.
    #[inline(always)]
    pub(crate) fn inverse<S: Simd>(&self, simd: S, buffer: &mut [Element<R>]) {
        let (data, work) = buffer.split_at_mut(self.positions.len());
        self.descend::<S, true>(simd, 0, data, work);
    }

    fn descend<S: Simd, const INVERSE: bool>(
        &self,
        simd: S,
        level: usize,
        data: &mut [Element<R>],
        work: &mut [Element<R>],
    ) {
        let Some(stage) = self.stages.get(level) else {
            return;
        };
        if data.len() <= IN_CACHE {
            let stages = &self.stages[level..];
            if INVERSE {
                for stage in stages.iter().rev() {
                    run::<S, R, INVERSE>(simd, stage, data, work);
                }
            } else {
                for stage in stages {
                    run::<S, R, INVERSE>(simd, stage, data, work);
                }
            }
            return;
        }
        if !INVERSE {
            run::<S, R, INVERSE>(simd, stage, data, work);
        }
        for part in data.chunks_exact_mut(stage.part) {
            self.descend::<S, INVERSE>(simd, level + 1, part, work);
        }
        if INVERSE {
            run::<S, R, INVERSE>(simd, stage, data, work);
        }
    }
}

/// How many elements fit the nearest cache: these go stage by stage, more of them part by part.
const IN_CACHE: usize = 256;

fn run<S: Simd, R: Lane, const INVERSE: bool>(
    simd: S,
    stage: &Stage<R>,
    data: &mut [Element<R>],
    work: &mut [Element<R>],
) {
    simd.vectorize(
        #[inline(always)]
        || match stage.radix {
            2 => butterflies::<S, R, 2, INVERSE>(simd, stage, data, butterfly2),
            4 => butterflies::<S, R, 4, INVERSE>(simd, stage, data, butterfly4::<S, R, INVERSE>),
            8 => butterflies::<S, R, 8, INVERSE>(simd, stage, data, butterfly8::<S, R, INVERSE>),
            _ => general_butterflies::<S, R, INVERSE>(simd, stage, data, work),
        },
    );
}

/// A complex vector.
#[derive(Clone, Copy)]
struct Complex<S: Simd, R: Lane> {
    re: R::Vector<S>,
    im: R::Vector<S>,
}

impl<S: Simd, R: Lane> Complex<S, R> {
    #[inline(always)]
    fn load(simd: S, element: &Element<R>) -> Self {
        Self {
            re: R::load(simd, &element[0]),
            im: R::load(simd, &element[1]),
        }
    }

    #[inline(always)]
    fn store(self, element: &mut Element<R>) {
        self.re.store_array(&mut element[0]);
        self.im.store_array(&mut element[1]);
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            re: self.re + other.re,
            im: self.im + other.im,
        }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self {
            re: self.re - other.re,
            im: self.im - other.im,
        }
    }

    /// Times −i forwards, +i in the inverse.
    #[inline(always)]
    fn turn<const INVERSE: bool>(self) -> Self {
        if INVERSE {
            Self {
                re: -self.im,
                im: self.re,
            }
        } else {
            Self {
                re: self.im,
                im: -self.re,
            }
        }
    }

    /// Times a root, conjugated in the inverse.
    #[inline(always)]
    fn times<const INVERSE: bool>(self, simd: S, [c, s]: [R; 2]) -> Self {
        let c = R::splat(simd, c);
        let s = R::splat(simd, s);
        let s = if INVERSE { -s } else { s };
        Self {
            re: self.re.mul_sub(c, self.im * s),
            im: self.re.mul_add(s, self.im * c),
        }
    }
}

#[inline(always)]
fn butterfly2<S: Simd, R: Lane>(_: S, [a, b]: [Complex<S, R>; 2]) -> [Complex<S, R>; 2] {
    [a.plus(b), a.minus(b)]
}

#[inline(always)]
fn butterfly4<S: Simd, R: Lane, const INVERSE: bool>(
    _: S,
    [a, b, c, d]: [Complex<S, R>; 4],
) -> [Complex<S, R>; 4] {
    let (ac, a_c) = (a.plus(c), a.minus(c));
    let (bd, b_d) = (b.plus(d), b.minus(d).turn::<INVERSE>());
    [ac.plus(bd), a_c.plus(b_d), ac.minus(bd), a_c.minus(b_d)]
}

#[inline(always)]
fn butterfly8<S: Simd, R: Lane, const INVERSE: bool>(
    simd: S,
    x: [Complex<S, R>; 8],
) -> [Complex<S, R>; 8] {
    let even = butterfly4::<S, R, INVERSE>(simd, [x[0], x[2], x[4], x[6]]);
    let odd = butterfly4::<S, R, INVERSE>(simd, [x[1], x[3], x[5], x[7]]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (up, down) = ([half, -half].map(R::of), [-half, -half].map(R::of));
    let odd = [
        odd[0],
        odd[1].times::<INVERSE>(simd, up),
        odd[2].turn::<INVERSE>(),
        odd[3].times::<INVERSE>(simd, down),
    ];
    let mut out = x;
    for i in 0..4 {
        out[i] = even[i].plus(odd[i]);
        out[i + 4] = even[i].minus(odd[i]);
    }
    out
}

#[inline(always)]
fn butterflies<S: Simd, R: Lane, const RADIX: usize, const INVERSE: bool>(
    simd: S,
    stage: &Stage<R>,
    data: &mut [Element<R>],
    butterfly: impl Fn(S, [Complex<S, R>; RADIX]) -> [Complex<S, R>; RADIX],
) {
    let part = stage.part;
    let whole = RADIX * part;
    for block in data.chunks_exact_mut(whole) {
        for q in 0..part {
            let mut x = [Complex::<S, R>::load(simd, &block[q]); RADIX];
            for j in 1..RADIX {
                x[j] = Complex::load(simd, &block[q + j * part]);
            }
            let twiddles = &stage.twiddles[q * (RADIX - 1)..(q + 1) * (RADIX - 1)];
            if INVERSE && q > 0 {
                for t in 1..RADIX {
                    x[t] = x[t].times::<true>(simd, twiddles[t - 1]);
                }
            }
            let mut y = butterfly(simd, x);
            if !INVERSE && q > 0 {
                for t in 1..RADIX {
                    y[t] = y[t].times::<false>(simd, twiddles[t - 1]);
                }
            }
            for j in 0..RADIX {
                y[j].store(&mut block[q + j * part]);
            }
        }
    }
}

/// Any radix, by its definition.
#[inline(always)]
fn general_butterflies<S: Simd, R: Lane, const INVERSE: bool>(
    simd: S,
    stage: &Stage<R>,
    data: &mut [Element<R>],
    work: &mut [Element<R>],
) {
    let (radix, part) = (stage.radix, stage.part);
    for block in data.chunks_exact_mut(radix * part) {
        for q in 0..part {
            for (j, work) in work[..radix].iter_mut().enumerate() {
                let mut x = Complex::<S, R>::load(simd, &block[q + j * part]);
                if INVERSE && j > 0 {
                    x = x.times::<true>(simd, stage.twiddles[q * (radix - 1) + j - 1]);
                }
                x.store(work);
            }
            for t in 0..radix {
                let mut sum = Complex::<S, R>::load(simd, &work[0]);
                let mut index = 0;
                for x in &work[1..radix] {
                    index = (index + t) % radix;
                    let term = Complex::<S, R>::load(simd, x);
                    sum = sum.plus(term.times::<INVERSE>(simd, stage.roots[index]));
                }
                if !INVERSE && t > 0 {
                    sum = sum.times::<false>(simd, stage.twiddles[q * (radix - 1) + t - 1]);
                }
                sum.store(&mut block[q + t * part]);
            }
        }
    }
}
