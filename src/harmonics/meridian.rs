//! Quadrature along meridians for equiangular rings, exact to as many degrees as there are rings.
//!
//! Weights on n equiangular rings integrate polynomials of degree n − 1, so the products of two
//! harmonics of degree (n − 1)/2 only. But along a meridian and its continuation over the poles, a
//! circle of N points, a function of order m and P̄_lm are trigonometric polynomials of degrees up
//! to K = N/2 − 1, both even or both odd, and ∫₀^π f P̄ sin θ dθ is half of ∮ f P̄ |sin θ| dθ. What
//! P̄ sees of f |sin θ| is its projection G to degrees up to K, and ∮ G P̄ dθ is a sum over the N
//! points, exactly. G comes by Fourier transforms: f on 2N points, times |sin θ| cut off at degree
//! 2K, and back.

use std::f64::consts::PI;

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use super::kernel::Quad;
use super::lane::Lane;
use super::recurrence::{LANES, Lanes};
use super::ring_fft::{Element, RingFft};
use crate::numeric::quadrature::cos_turn;
use crate::sphere::{Grid, Latitudes};

/// The plan for the rings of one grid.
pub(crate) struct Meridian {
    rings: usize,
    /// How many points there are on the circle: N.
    points: usize,
    coarse: RingFft,
    fine: RingFft,
    /// |sin θ| up to degree 2K on the 2N points, with the factors that the Fourier transforms leave; it repeats after N.
    sines: Vec<f64>,
}

impl Meridian {
    pub(crate) fn new(grid: &Grid) -> Self {
        let rings = grid.rings();
        let poles = grid.latitudes() == Latitudes::ClenshawCurtis;
        let points = if poles { 2 * rings - 2 } else { 2 * rings };
        let limit = points / 2 - 1;
        let cosines: Vec<f64> = (0..points).map(|t| cos_turn(t, points)).collect();
        // |sin θ| = 2/π − 4/π Σ cos 2kθ/(4k² − 1), small terms first. Point j lies at θ = π j/N, or π (j + 1)/N without poles.
        let sine = |j: usize| {
            let turn = if poles { j } else { j + 1 };
            let sum: f64 = (1..=limit)
                .rev()
                .map(|k| cosines[k * turn % points] / (4.0 * (k * k) as f64 - 1.0))
                .sum();
            (2.0 - 4.0 * sum) / PI / (2 * points * points) as f64
        };
        Self {
            rings,
            points,
            coarse: RingFft::new(points),
            fine: RingFft::new(2 * points),
            sines: (0..points).map(sine).collect(),
        }
    }

    /// The weight of ring i after [`project`](Self::project): 2π/N, half of it at a pole.
    pub(crate) fn weight(&self, ring: usize) -> f64 {
        let pole = self.points < 2 * self.rings && (ring == 0 || ring == self.rings - 1);
        2.0 * PI / self.points as f64 * if pole { 0.5 } else { 1.0 }
    }

    /// How many elements [`project`](Self::project) works in.
    pub(crate) fn work_len(&self) -> usize {
        self.coarse.work_len() + self.fine.work_len()
    }

    /// Where ring i is once more on the circle; a pole is there once.
    fn mirror(&self, ring: usize) -> usize {
        let last = if self.points < 2 * self.rings {
            self.points
        } else {
            self.points - 1
        };
        (last - ring) % self.points
    }

    /// The values of G on the rings, for the eight orders from `first` or as many as `sums` has:
    /// `sums[bundle · stride + i]` and `out[bundle · 8 + i]` belong to order `first + i`.
    #[inline(always)]
    pub(crate) fn project<S: Simd>(
        &self,
        simd: S,
        first: usize,
        orders: usize,
        (sums, stride): (&[Quad], usize),
        out: &mut [Quad],
        buffer: &mut [Element],
    ) {
        let (coarse, fine) = buffer.split_at_mut(self.coarse.work_len());
        let zero = f64x8::splat(simd, 0.0);
        let signs: Lanes = std::array::from_fn(|i| {
            if (first + i).is_multiple_of(2) {
                1.0
            } else {
                -1.0
            }
        });
        let signs = f64x8::load_array(simd, signs);
        let bundles = out.len() / LANES;
        for bundle in 0..bundles {
            let sums = &sums[bundle * stride..][..orders];
            for half in 0..2 {
                let mut parts = [[zero; LANES]; 2];
                for part in 0..2 {
                    for (lane, quad) in parts[part].iter_mut().zip(sums) {
                        *lane = f64x8::load_array_ref(simd, &quad[2 * half + part]);
                    }
                    parts[part] = f64::transpose(parts[part]);
                }
                for lane in 0..LANES {
                    let Some(ring) = self.ring(bundle * LANES + lane, half) else {
                        continue;
                    };
                    let (re, im) = (parts[0][lane], parts[1][lane]);
                    let mirror = self.mirror(ring);
                    let (mirrored_re, mirrored_im) = (re * signs, im * signs);
                    if mirror == ring {
                        // A pole is its own mirror image: odd orders vanish there.
                        ((re + mirrored_re) * 0.5).store_array(&mut coarse[ring][0]);
                        ((im + mirrored_im) * 0.5).store_array(&mut coarse[ring][1]);
                        continue;
                    }
                    mirrored_re.store_array(&mut coarse[mirror][0]);
                    mirrored_im.store_array(&mut coarse[mirror][1]);
                    re.store_array(&mut coarse[ring][0]);
                    im.store_array(&mut coarse[ring][1]);
                }
            }
        }
        self.coarse.forward(simd, coarse);
        let (points, twice) = (self.points, 2 * self.points);
        let limit = points / 2 - 1;
        for k in limit + 1..twice - limit {
            fine[self.fine.position(k)] = [[0.0; LANES]; 2];
        }
        for k in 0..=limit {
            fine[self.fine.position(k)] = coarse[self.coarse.position(k)];
            if k > 0 {
                fine[self.fine.position(twice - k)] = coarse[self.coarse.position(points - k)];
            }
        }
        self.fine.inverse(simd, fine);
        for turn in fine[..twice].chunks_exact_mut(points) {
            for (element, sine) in turn.iter_mut().zip(&self.sines) {
                for part in element {
                    (f64x8::load_array_ref(simd, part) * *sine).store_array(part);
                }
            }
        }
        self.fine.forward(simd, fine);
        coarse[self.coarse.position(points / 2)] = [[0.0; LANES]; 2];
        for k in 0..=limit {
            coarse[self.coarse.position(k)] = fine[self.fine.position(k)];
            if k > 0 {
                coarse[self.coarse.position(points - k)] = fine[self.fine.position(twice - k)];
            }
        }
        self.coarse.inverse(simd, coarse);
        for bundle in 0..bundles {
            let out = &mut out[bundle * LANES..][..LANES];
            for half in 0..2 {
                for part in 0..2 {
                    let mut lanes = [zero; LANES];
                    for lane in 0..LANES {
                        if let Some(ring) = self.ring(bundle * LANES + lane, half) {
                            lanes[lane] = f64x8::load_array_ref(simd, &coarse[ring][part]);
                        }
                    }
                    for (quad, values) in out.iter_mut().zip(f64::transpose(lanes)) {
                        values.store_array(&mut quad[2 * half + part]);
                    }
                }
            }
        }
    }

    /// The ring of a northern row or of its mirror image; none beyond the equator.
    #[inline(always)]
    fn ring(&self, row: usize, half: usize) -> Option<usize> {
        if half == 0 {
            (row < self.rings.div_ceil(2)).then_some(row)
        } else {
            (row < self.rings / 2).then(|| self.rings - 1 - row)
        }
    }
}
