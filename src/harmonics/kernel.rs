//! The inner loops of the transform: sums over degree and sums over rings, vectors of eight rings.

#![expect(
    clippy::needless_range_loop,
    reason = "several arrays of one const length are walked together"
)]

use fearless_simd::prelude::*;
use fearless_simd::{f64x4, f64x8};

use super::recurrence::{
    EQUATORIAL, Entry, Form, LANES, Lanes, Octet, PLAIN, POLAR, Recurrence, Step,
};

/// North cosine, north sine, south cosine, south sine of eight ring pairs.
pub(crate) type Quad = [Lanes; 4];

/// The state of the recurrence on `WIDTH` octets, in one of its forms.
struct State<S: Simd, const WIDTH: usize, const FORM: usize> {
    argument: [f64x8<S>; WIDTH],
    p: [f64x8<S>; WIDTH],
    d: [f64x8<S>; WIDTH],
}

impl<S: Simd, const WIDTH: usize, const FORM: usize> State<S, WIDTH, FORM> {
    #[inline(always)]
    fn new(simd: S, octets: &[Octet; WIDTH]) -> Self {
        let zero = [f64x8::splat(simd, 0.0); WIDTH];
        let mut argument = zero;
        for v in 0..WIDTH {
            argument[v] = f64x8::load_array_ref(simd, &octets[v].argument);
        }
        Self {
            argument,
            p: zero,
            d: zero,
        }
    }

    /// Adds the entries at step k and returns the step of the next, or the last step.
    #[inline(always)]
    fn admit(&mut self, simd: S, entries: &mut [&[Entry]; WIDTH], k: usize, last: usize) -> usize {
        let mut next = last;
        for v in 0..WIDTH {
            while let Some(entry) = entries[v].first() {
                if entry.step > k {
                    next = next.min(entry.step);
                    break;
                }
                self.p[v] += f64x8::load_array_ref(simd, &entry.p);
                self.d[v] += f64x8::load_array_ref(simd, &entry.d);
                entries[v] = &entries[v][1..];
            }
        }
        next
    }

    #[inline(always)]
    fn advance(&mut self, simd: S, step: &Step) {
        let a = f64x8::splat(simd, step[0]);
        let constant = f64x8::splat(simd, step[FORM]);
        for v in 0..WIDTH {
            let t = self.argument[v].mul_add(a, constant);
            match FORM {
                POLAR => {
                    self.d[v] = t.mul_add(self.p[v], self.d[v]);
                    self.p[v] += self.d[v];
                }
                EQUATORIAL => {
                    self.d[v] = t.mul_sub(self.p[v], self.d[v]);
                    self.p[v] = self.d[v] - self.p[v];
                }
                _ => {
                    let next = t.mul_sub(self.p[v], self.d[v]);
                    self.d[v] = self.p[v];
                    self.p[v] = next;
                }
            }
        }
    }
}

/// The `WIDTH` octets of a block.
#[inline(always)]
fn block<T, const WIDTH: usize>(octets: &[T], first: usize) -> &[T; WIDTH] {
    octets[first..]
        .first_chunk()
        .expect("a block lies within the octets")
}

#[inline(always)]
fn first_step<const WIDTH: usize>(entries: &[&[Entry]; WIDTH], last: usize) -> usize {
    entries
        .iter()
        .filter_map(|e| e.first())
        .map(|e| e.step)
        .fold(last, usize::min)
}

/// Σ_k p_k · sums for `MAPS` maps on `WIDTH` octets; `sums[k]` from [`Recurrence::prepare`](super::recurrence::Recurrence::prepare),
/// `out[map][octet]`.
#[inline(always)]
fn synthesise_block<S: Simd, const WIDTH: usize, const MAPS: usize, const FORM: usize>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    first: usize,
    sums: &[[[f64; 4]; MAPS]],
    out: &mut [&mut [Quad]; MAPS],
) {
    let octets = block(&recurrence.octets, first);
    let steps = recurrence.steps(m);
    let mut entries = std::array::from_fn(|v| recurrence.entries(m, first + v));
    let last = steps.len();
    let zero = f64x8::splat(simd, 0.0);
    let mut state = State::<S, WIDTH, FORM>::new(simd, octets);
    let mut total = [[[zero; WIDTH]; 4]; MAPS];
    let mut k = first_step(&entries, last);
    while k < last {
        let next = state.admit(simd, &mut entries, k, last);
        for (step, sums) in steps[k..next].iter().zip(&sums[k..next]) {
            for map in 0..MAPS {
                for part in 0..4 {
                    let factor = f64x8::splat(simd, sums[map][part]);
                    for v in 0..WIDTH {
                        total[map][part][v] = state.p[v].mul_add(factor, total[map][part][v]);
                    }
                }
            }
            state.advance(simd, step);
        }
        k = next;
    }
    for map in 0..MAPS {
        for v in 0..WIDTH {
            let x = f64x8::load_array_ref(simd, &octets[v].x);
            let [ec, es, oc, os] = [
                total[map][0][v],
                total[map][1][v],
                total[map][2][v],
                total[map][3][v],
            ];
            x.mul_add(oc, ec).store_array(&mut out[map][first + v][0]);
            x.mul_add(os, es).store_array(&mut out[map][first + v][1]);
            (ec - x * oc).store_array(&mut out[map][first + v][2]);
            (es - x * os).store_array(&mut out[map][first + v][3]);
        }
    }
}

/// Adds Σ over rings of p_k · parts to `sums[k]`, for `MAPS` maps on `WIDTH` octets; `parts[map][octet]` are even cosine, even sine,
/// odd cosine · x, odd sine · x, weighted.
#[inline(always)]
fn analyse_block<S: Simd, const WIDTH: usize, const MAPS: usize, const FORM: usize>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    first: usize,
    parts: &[&[Quad]; MAPS],
    sums: &mut [[[f64; 4]; MAPS]],
) {
    let octets = block(&recurrence.octets, first);
    let steps = recurrence.steps(m);
    let parts = parts.map(|parts| block(parts, first));
    let mut entries = std::array::from_fn(|v| recurrence.entries(m, first + v));
    let last = steps.len();
    let mut state = State::<S, WIDTH, FORM>::new(simd, octets);
    let mut k = first_step(&entries, last);
    while k < last {
        let next = state.admit(simd, &mut entries, k, last);
        let mut pairs = steps[k..next].chunks_exact(2);
        let (even, odd) = sums[k..next].as_chunks_mut::<2>();
        for (steps, sums) in (&mut pairs).zip(even) {
            let first = weigh(simd, &state.p, &parts);
            state.advance(simd, &steps[0]);
            let second = weigh(simd, &state.p, &parts);
            state.advance(simd, &steps[1]);
            for map in 0..MAPS {
                let [a, b, c, d] = first[map];
                let [e, f, g, h] = second[map];
                // Three rounds of interleaving and adding leave the eight totals in this order.
                let total = fold(fold(fold(a, e), fold(c, g)), fold(fold(b, f), fold(d, h)));
                let (low, high) = total.split();
                accumulate(simd, &mut sums[0][map], low);
                accumulate(simd, &mut sums[1][map], high);
            }
        }
        for (step, sums) in pairs.remainder().iter().zip(odd) {
            let first = weigh(simd, &state.p, &parts);
            state.advance(simd, step);
            for map in 0..MAPS {
                let [a, b, c, d] = first[map];
                let zero = f64x8::splat(simd, 0.0);
                let total = fold(
                    fold(fold(a, zero), fold(c, zero)),
                    fold(fold(b, zero), fold(d, zero)),
                );
                accumulate(simd, &mut sums[map], total.split().0);
            }
        }
        k = next;
    }
}

/// Interleaves two vectors and adds the halves: lanes 2i and 2i + 1 are sums of a and of b.
#[inline(always)]
fn fold<S: Simd>(a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
    let (low, high) = a.interleave(b);
    low + high
}

#[inline(always)]
fn accumulate<S: Simd>(simd: S, sums: &mut [f64; 4], terms: f64x4<S>) {
    (f64x4::load_array_ref(simd, sums) + terms).store_array(sums);
}

/// p · parts summed over octets, each lane for itself.
#[inline(always)]
fn weigh<S: Simd, const WIDTH: usize, const MAPS: usize>(
    simd: S,
    p: &[f64x8<S>; WIDTH],
    parts: &[&[Quad; WIDTH]; MAPS],
) -> [[f64x8<S>; 4]; MAPS] {
    // Loops and not closures: a closure would not be compiled for the wide vectors.
    let mut totals = [[f64x8::splat(simd, 0.0); 4]; MAPS];
    for map in 0..MAPS {
        for part in 0..4 {
            let mut total = p[0] * f64x8::load_array_ref(simd, &parts[map][0][part]);
            for v in 1..WIDTH {
                let factor = f64x8::load_array_ref(simd, &parts[map][v][part]);
                total = p[v].mul_add(factor, total);
            }
            totals[map][part] = total;
        }
    }
    totals
}

/// Whether a machine with vectors of so many lanes has registers for a block: three maps leave room for two octets of AVX-512, and
/// narrower machines hold one octet.
const fn fits(lanes: usize, width: usize, maps: usize) -> bool {
    width == 1 || (lanes == LANES && width * maps <= 6)
}

/// Runs a kernel on all blocks of octets: the widest first, then what is left. Three maps fill the registers with two octets.
macro_rules! over_blocks {
    ($kernel:ident, [$($width:literal),+], $simd:ident, $recurrence:ident, $m:ident, $a:ident, $b:ident) => {
        for range in $recurrence.blocks() {
            let form = $recurrence.octets[range.start].form;
            let mut first = range.start;
            while first < range.end {
                let left = range.end - first;
                $(
                    if const { fits(S::f64s::LEN, $width, MAPS) } {
                        if left >= $width {
                            match form {
                                Form::Plain => $simd.vectorize(#[inline(always)] || $kernel::<S, $width, MAPS, PLAIN>($simd, $recurrence, $m, first, $a, $b)),
                                Form::Polar => $simd.vectorize(#[inline(always)] || $kernel::<S, $width, MAPS, POLAR>($simd, $recurrence, $m, first, $a, $b)),
                                Form::Equatorial => $simd.vectorize(#[inline(always)] || $kernel::<S, $width, MAPS, EQUATORIAL>($simd, $recurrence, $m, first, $a, $b)),
                            }
                            first += $width;
                            continue;
                        }
                    }
                )+
            }
        }
    };
}

/// Synthesis of `MAPS` maps (1 or 3) at order m: see [`synthesise_block`].
#[inline(always)]
pub(crate) fn synthesise<S: Simd, const MAPS: usize>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    sums: &[[[f64; 4]; MAPS]],
    out: &mut [&mut [Quad]; MAPS],
) {
    over_blocks!(synthesise_block, [4, 2, 1], simd, recurrence, m, sums, out);
}

/// Analysis of `MAPS` maps (1 or 3) at order m: see [`analyse_block`].
#[inline(always)]
pub(crate) fn analyse<S: Simd, const MAPS: usize>(
    simd: S,
    recurrence: &Recurrence,
    m: usize,
    parts: &[&[Quad]; MAPS],
    sums: &mut [[[f64; 4]; MAPS]],
) {
    over_blocks!(analyse_block, [4, 2, 1], simd, recurrence, m, parts, sums);
}
