//! The Fourier transforms along rings that have lengths or azimuths of their own.
//!
//! Eight northern rings and their mirror images go together as in `ring_fft`. Where the eight are of
//! one length, so is the transform. Where they are not, as about the poles of HEALPix, each lane has
//! a chirp of its own, jk = (j² + k² − (j − k)²)/2, which makes a transform of any length a
//! convolution, and all eight convolutions are of one length, a power of two (Bluestein 1970,
//! doi:10.1109/TAU.1970.1162132). Orders past the half of a ring are folded into it.

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use super::kernel::Quad;
use super::recurrence::{LANES, Lanes};
use super::ring_fft::{Element, RingFft};
use super::work::Rows;
use crate::numeric::sincospi::sin_cos;
use crate::sphere::Grid;

/// A length with a larger prime factor than this goes by chirps too.
const LARGEST_RADIX: usize = 50;

/// The plan for the rings of one grid.
pub(crate) struct OwnRings {
    bundles: Vec<RingBundle>,
    transforms: Vec<RingFft>,
    sign: f64,
}

/// Eight northern rings and their mirror images.
struct RingBundle {
    /// How many points each has; 0 where there is no ring.
    lengths: [usize; LANES],
    /// The azimuths of the first points, northern and southern.
    azimuths: [Lanes; 2],
    /// Which transform, and whether by chirps.
    transform: usize,
    chirps: bool,
}

impl RingBundle {
    fn longest(&self) -> usize {
        self.lengths.into_iter().fold(0, usize::max)
    }
}

impl OwnRings {
    pub(crate) fn new(grid: &Grid) -> Self {
        let (rings, pairs) = (grid.rings(), grid.rings().div_ceil(2));
        let mut sizes: Vec<usize> = Vec::new();
        let mut transforms: Vec<RingFft> = Vec::new();
        let bundles = (0..pairs.div_ceil(LANES)).map(|bundle| {
            let mut one = RingBundle {
                lengths: [0; LANES],
                azimuths: [[0.0; LANES]; 2],
                transform: 0,
                chirps: false,
            };
            for lane in 0..LANES.min(pairs - bundle * LANES) {
                let ring = bundle * LANES + lane;
                one.lengths[lane] = grid.ring_columns(ring);
                one.azimuths[0][lane] = grid.ring_azimuth(ring);
                one.azimuths[1][lane] = grid.ring_azimuth(rings - 1 - ring);
            }
            let longest = one.longest();
            let alike = |length: usize| length == 0 || length == longest;
            one.chirps =
                !one.lengths.into_iter().all(alike) || largest_factor(longest) > LARGEST_RADIX;
            let size = if one.chirps {
                (2 * longest).next_power_of_two()
            } else {
                longest
            };
            let known = sizes.iter().position(|known| *known == size);
            one.transform = known.unwrap_or_else(|| {
                sizes.push(size);
                transforms.push(RingFft::new(size));
                sizes.len() - 1
            });
            one
        });
        Self {
            bundles: bundles.collect(),
            transforms,
            sign: if grid.is_descending() { -1.0 } else { 1.0 },
        }
    }

    /// How many elements the work on sixteen rings needs.
    pub(crate) fn work_len(&self) -> usize {
        let of_bundle = |bundle: &RingBundle| {
            let work = self.transforms[bundle.transform].work_len();
            if bundle.chirps {
                2 * work + bundle.longest()
            } else {
                work
            }
        };
        self.bundles.iter().map(of_bundle).max().unwrap_or(0)
    }

    /// Eight northern rows and their mirror images from their sums; `sums[m · stride]` is order
    /// m's, for `orders` of them.
    #[inline(always)]
    pub(crate) fn synthesise<S: Simd>(
        &self,
        simd: S,
        bundle: usize,
        (sums, stride, orders): (&[Quad], usize, usize),
        rows: Rows<f64, &mut [f64]>,
        slot: &mut [Lanes],
    ) {
        let bundle = &self.bundles[bundle];
        let fft = &self.transforms[bundle.transform];
        let buffer: &mut [Element] = slot.as_chunks_mut().0;
        let n = bundle.longest();
        buffer[..if bundle.chirps { fft.len() } else { n }].fill([[0.0; LANES]; 2]);
        let mut turns = bundle.azimuths.map(Turns::new);
        for (m, sums) in sums.iter().step_by(stride).take(orders).enumerate() {
            let half = if m == 0 { 1.0 } else { 0.5 };
            let [north, south] = turns.each_mut().map(|turns| turns.at(m));
            let (mut up, mut down) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
            for lane in 0..LANES {
                // (cosine − i sine) e^(i m φ₀)/2
                let part = |cosine: f64, sine: f64, turn: &Element| {
                    let (c, s) = (half * turn[0][lane], half * turn[1][lane]);
                    (cosine * c + sine * s, self.sign * (cosine * s - sine * c))
                };
                let (nr, ni) = part(sums[0][lane], sums[1][lane], &north);
                let (sr, si) = part(sums[2][lane], sums[3][lane], &south);
                (up[0][lane], up[1][lane]) = (nr - si, ni + sr);
                (down[0][lane], down[1][lane]) = (nr + si, sr - ni);
            }
            if bundle.chirps {
                for (lane, &length) in bundle.lengths.iter().enumerate().filter(|(_, n)| **n > 0) {
                    let k = m % length;
                    add_lane(&mut buffer[k], &up, lane);
                    if m > 0 {
                        add_lane(&mut buffer[(length - k) % length], &down, lane);
                    }
                }
            } else {
                let k = m % n;
                add(&mut buffer[fft.position(k)], &up);
                if m > 0 {
                    add(&mut buffer[fft.position((n - k) % n)], &down);
                }
            }
        }
        if bundle.chirps {
            bundle.convolve(simd, fft, 1.0, buffer);
        } else {
            fft.inverse(simd, buffer);
        }
        for (part, rows) in rows.into_iter().enumerate() {
            for (lane, row) in rows.into_iter().enumerate() {
                for (value, element) in row.iter_mut().zip(&*buffer) {
                    *value = element[part][lane];
                }
            }
        }
    }

    /// Eight northern rows and their mirror images to their sums over azimuth, `out[m]`.
    #[inline(always)]
    pub(crate) fn analyse<S: Simd>(
        &self,
        simd: S,
        bundle: usize,
        rows: Rows<f64, &[f64]>,
        out: &mut [Quad],
        slot: &mut [Lanes],
    ) {
        let bundle = &self.bundles[bundle];
        let fft = &self.transforms[bundle.transform];
        let buffer: &mut [Element] = slot.as_chunks_mut().0;
        let n = bundle.longest();
        buffer[..if bundle.chirps { fft.len() } else { n }].fill([[0.0; LANES]; 2]);
        for (part, rows) in rows.iter().enumerate() {
            for (lane, row) in rows.iter().enumerate() {
                for (value, element) in row.iter().zip(&mut *buffer) {
                    element[part][lane] = *value;
                }
            }
        }
        if bundle.chirps {
            bundle.convolve(simd, fft, -1.0, buffer);
        } else {
            fft.forward(simd, buffer);
        }
        let mut turns = bundle.azimuths.map(Turns::new);
        for (m, out) in out.iter_mut().enumerate() {
            let [north, south] = turns.each_mut().map(|turns| turns.at(m));
            for (lane, &length) in bundle.lengths.iter().enumerate() {
                if length == 0 {
                    out.iter_mut().for_each(|part| part[lane] = 0.0);
                    continue;
                }
                let k = m % length;
                let other = (length - k) % length;
                let (a, b) = if bundle.chirps {
                    (&buffer[k], &buffer[other])
                } else {
                    (&buffer[fft.position(k)], &buffer[fft.position(other)])
                };
                // Half of the two rings' spectra, times e^(−i m φ₀): cosine − i sine.
                let part = |re: f64, im: f64, turn: &Element| {
                    let (c, s) = (0.5 * turn[0][lane], 0.5 * turn[1][lane]);
                    let im = self.sign * im;
                    (re * c + im * s, re * s - im * c)
                };
                let (c, s) = part(a[0][lane] + b[0][lane], a[1][lane] - b[1][lane], &north);
                (out[0][lane], out[1][lane]) = (c, s);
                let (c, s) = part(a[1][lane] + b[1][lane], b[0][lane] - a[0][lane], &south);
                (out[2][lane], out[3][lane]) = (c, s);
            }
        }
    }
}

#[inline(always)]
fn add(to: &mut Element, other: &Element) {
    for (to, other) in to.as_flattened_mut().iter_mut().zip(other.as_flattened()) {
        *to += other;
    }
}

#[inline(always)]
fn add_lane(to: &mut Element, other: &Element, lane: usize) {
    to[0][lane] += other[0][lane];
    to[1][lane] += other[1][lane];
}

impl RingBundle {
    /// Σ_j x_j e^(±2πi jk/n) for each lane's n, in place, in order; `sign` is that of the exponent.
    #[inline(always)]
    fn convolve<S: Simd>(&self, simd: S, fft: &RingFft, sign: f64, buffer: &mut [Element]) {
        let (data, rest) = buffer.split_at_mut(fft.work_len());
        let (kernel, rest) = rest.split_at_mut(fft.work_len());
        let (size, chirp) = (fft.len(), &mut rest[..self.longest()]);
        // w_j = e^(±πi j²/n), and 0 past the end of a ring.
        for (j, w) in chirp.iter_mut().enumerate() {
            for lane in 0..LANES {
                let n = self.lengths[lane];
                (w[0][lane], w[1][lane]) = if j < n {
                    let (s, c) = sin_cos((j * j % (2 * n)) as f64 / (2 * n) as f64);
                    (c, sign * s)
                } else {
                    (0.0, 0.0)
                };
            }
        }
        kernel[..size].fill([[0.0; LANES]; 2]);
        for (j, w) in chirp.iter().enumerate() {
            data[j] = product(simd, &data[j], w);
            let conjugate = [w[0], w[1].map(|s| -s)];
            kernel[j] = conjugate;
            if j > 0 {
                kernel[size - j] = conjugate;
            }
        }
        fft.forward(simd, data);
        fft.forward(simd, kernel);
        for (value, factor) in data[..size].iter_mut().zip(&*kernel) {
            *value = product(simd, value, factor);
        }
        fft.inverse(simd, data);
        let scale = 1.0 / size as f64;
        for (value, w) in data.iter_mut().zip(&*chirp) {
            let scaled = w.map(|part| part.map(|part| scale * part));
            *value = product(simd, value, &scaled);
        }
    }
}

#[inline(always)]
fn product<S: Simd>(simd: S, a: &Element, b: &Element) -> Element {
    let [ar, ai] = [0, 1].map(|part| f64x8::load_array_ref(simd, &a[part]));
    let [br, bi] = [0, 1].map(|part| f64x8::load_array_ref(simd, &b[part]));
    let mut out = [[0.0; LANES]; 2];
    ar.mul_sub(br, ai * bi).store_array(&mut out[0]);
    ar.mul_add(bi, ai * br).store_array(&mut out[1]);
    out
}

fn largest_factor(n: usize) -> usize {
    let (mut rest, mut factor, mut largest) = (n, 2, 1);
    while factor * factor <= rest {
        if rest.is_multiple_of(factor) {
            rest /= factor;
            largest = factor;
        } else {
            factor += 1;
        }
    }
    largest.max(rest)
}

/// How many orders one multiplication of an angle serves.
const NEAR: usize = 16;

/// e^(imφ) of eight rings, order after order: of every sixteenth from the angle, of those between by
/// one product each.
struct Turns {
    azimuths: Lanes,
    near: [Element; NEAR],
    far: Element,
}

impl Turns {
    #[inline(always)]
    fn new(azimuths: Lanes) -> Self {
        let turn = |m: usize| turned(&azimuths, m);
        Self {
            azimuths,
            near: std::array::from_fn(turn),
            far: turn(0),
        }
    }

    /// That of order m, which must be one more than the last, or 0.
    #[inline(always)]
    fn at(&mut self, m: usize) -> Element {
        if m.is_multiple_of(NEAR) {
            self.far = turned(&self.azimuths, m);
            return self.far;
        }
        let (a, b) = (&self.far, &self.near[m % NEAR]);
        [
            std::array::from_fn(|lane| a[0][lane] * b[0][lane] - a[1][lane] * b[1][lane]),
            std::array::from_fn(|lane| a[0][lane] * b[1][lane] + a[1][lane] * b[0][lane]),
        ]
    }
}

fn turned(azimuths: &Lanes, m: usize) -> Element {
    let mut out = [[0.0; LANES]; 2];
    for lane in 0..LANES {
        (out[1][lane], out[0][lane]) = (m as f64 * azimuths[lane]).sin_cos();
    }
    out
}
