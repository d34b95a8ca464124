//! Eight maps side by side, one in each lane.
//!
//! With rings in the lanes, as the transform of one map has them, every analysis ends in sums
//! across lanes, and every map waits for the coefficients of the recurrence. Many maps do better
//! with a map in each lane: the recurrence is worked out once for eight maps, into a table that the
//! nearest cache holds, and what remains is the product of that table with eight maps' sums.

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use super::coefficients::column_start;
use super::kernel::{self, Quad};
use super::lane::Lane;
use super::recurrence::{LANES, Lanes};
use super::simd::wide;
use super::stages::{Weighing, load_quad};
use super::transform::Plan;
use super::work::Rows;

impl Plan {
    /// Lines of the sums of eight maps between the two stages: a quad for each order and pair of
    /// rings.
    fn sums_of_eight(&self) -> usize {
        4 * (self.stages.orders + 1) * self.stages.recurrence.bundles.len() * LANES
    }

    /// Lines of scratch for eight maps.
    pub(super) fn eight_lines(&self) -> usize {
        let steps = self.stages.recurrence.steps(0).len();
        let parts = 4 * self.stages.recurrence.bundles.len() * LANES;
        // The sums by step, the columns of cosines and sines, the table of the recurrence for four
        // bundles; the weighted sums of rings.
        let order = 4 * steps + 4 * steps + 4 * steps + parts;
        self.sums_of_eight() + order.max(self.rows_len())
    }

    /// Synthesis of eight sets, one after the other, into eight maps.
    pub(super) fn synthesise_eight(
        &self,
        sets: &[f64],
        maps: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
    ) {
        let (columns, rings) = (self.stages.grid.columns(), self.stages.grid.rings());
        let pairs = self.stages.recurrence.bundles.len() * LANES;
        let (sums, scratch) = scratch.split_at_mut(self.sums_of_eight());
        let sums: &mut [Quad] = sums.as_chunks_mut().0;
        wide!(self.stages.level, simd => {
            for (m, out) in sums.chunks_exact_mut(pairs).enumerate() {
                self.synthesise_order_of_eight(simd, m, sets, out, scratch);
                if weighing == Weighing::Quadrature {
                    let weights = self.stages.weights.as_flattened();
                    for (quad, weight) in out.iter_mut().zip(weights) {
                        for value in quad.as_flattened_mut() {
                            *value *= weight;
                        }
                    }
                }
            }
            for ring in 0..rings.div_ceil(2) {
                let mut rows: Rows<f64, &mut [f64]> = Default::default();
                for (lane, map) in maps.chunks_exact_mut(rings * columns).enumerate() {
                    let (north, south) = map.split_at_mut(rings.div_ceil(2) * columns);
                    rows[0][lane] = &mut north[ring * columns..(ring + 1) * columns];
                    if ring < rings / 2 {
                        rows[1][lane] = &mut south[(rings / 2 - 1 - ring) * columns..][..columns];
                    }
                }
                self.stages.synthesise_rows(simd, &sums[ring..], pairs, rows, scratch);
            }
        });
    }

    /// Order m of eight sets to the sums of each pair of rings.
    #[inline(always)]
    fn synthesise_order_of_eight<S: Simd>(
        &self,
        simd: S,
        m: usize,
        sets: &[f64],
        out: &mut [Quad],
        scratch: &mut [Lanes],
    ) {
        let steps = self.stages.recurrence.steps(m).len();
        let (start, count) = (
            column_start(self.stages.degree, m),
            self.stages.degree + 1 - m,
        );
        let (sums, rest) = scratch.split_at_mut(4 * steps);
        let (columns, table) = rest.split_at_mut(4 * steps);
        let (cosine, sine) = columns.split_at_mut(2 * steps);
        gather(simd, sets, start, count, cosine);
        gather(
            simd,
            sets,
            start + count,
            if m == 0 { 0 } else { count },
            sine,
        );
        let sums: &mut [Quad] = sums.as_chunks_mut().0;
        let mut above = [f64x8::splat(simd, 0.0); 2];
        for (k, (sums, scale)) in sums
            .iter_mut()
            .zip(self.stages.recurrence.scales(m))
            .enumerate()
            .rev()
        {
            let [alpha, g, h] = scale.map(|s| f64x8::splat(simd, s));
            for (part, column) in [&*cosine, &*sine].into_iter().enumerate() {
                let even = f64x8::load_array_ref(simd, &column[2 * k]);
                let odd = f64x8::load_array_ref(simd, &column[2 * k + 1]);
                above[part] = h.mul_add(odd, above[part]);
                (alpha * even).store_array(&mut sums[part]);
                (g * above[part]).store_array(&mut sums[part + 2]);
            }
        }
        kernel::synthesise_eight(simd, &self.stages.recurrence, m, sums, (out, table));
    }

    /// Analysis of eight maps, one after the other, into eight sets.
    pub(super) fn analyse_eight(
        &self,
        maps: &[f64],
        sets: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
    ) {
        let (columns, rings) = (self.stages.grid.columns(), self.stages.grid.rings());
        let orders = self.stages.orders + 1;
        let (spectra, scratch) = scratch.split_at_mut(self.sums_of_eight());
        let spectra: &mut [Quad] = spectra.as_chunks_mut().0;
        wide!(self.stages.level, simd => {
            for (ring, out) in spectra.chunks_exact_mut(orders).enumerate() {
                if ring >= rings.div_ceil(2) {
                    out.fill([[0.0; LANES]; 4]);
                    continue;
                }
                let mut rows: Rows<f64, &[f64]> = Default::default();
                for (lane, map) in maps.chunks_exact(rings * columns).enumerate() {
                    rows[0][lane] = &map[ring * columns..(ring + 1) * columns];
                    if ring < rings / 2 {
                        rows[1][lane] = &map[(rings - 1 - ring) * columns..][..columns];
                    }
                }
                self.stages.analyse_rows(simd, rows, out, scratch);
            }
            for m in 0..orders {
                self.analyse_order_of_eight(simd, m, spectra, sets, scratch, weighing);
            }
        });
    }

    /// Order m of eight sets from the sums of each pair of rings, `spectra[pair · orders + m]`.
    #[inline(always)]
    fn analyse_order_of_eight<S: Simd>(
        &self,
        simd: S,
        m: usize,
        spectra: &[Quad],
        sets: &mut [f64],
        scratch: &mut [Lanes],
        weighing: Weighing,
    ) {
        let orders = self.stages.orders + 1;
        let steps = self.stages.recurrence.steps(m).len();
        let (start, count) = (
            column_start(self.stages.degree, m),
            self.stages.degree + 1 - m,
        );
        let (sums, rest) = scratch.split_at_mut(4 * steps);
        let (columns, rest) = rest.split_at_mut(4 * steps);
        let (parts, table) = rest.split_at_mut(4 * self.stages.recurrence.bundles.len() * LANES);
        let sums: &mut [Quad] = sums.as_chunks_mut().0;
        let parts: &mut [Quad] = parts.as_chunks_mut().0;
        for (pair, parts) in parts.iter_mut().enumerate() {
            let (bundle, lane) = (pair / LANES, pair % LANES);
            let w = match weighing {
                Weighing::Quadrature => self.stages.weights[bundle][lane],
                Weighing::None => 1.0,
            };
            let wx = f64x8::splat(simd, w * self.stages.recurrence.bundles[bundle].x[lane]);
            let w = f64x8::splat(simd, w);
            let [nc, ns, sc, ss] = load_quad::<S, f64>(simd, &spectra[pair * orders + m]);
            ((nc + sc) * w).store_array(&mut parts[0]);
            ((ns + ss) * w).store_array(&mut parts[1]);
            ((nc - sc) * wx).store_array(&mut parts[2]);
            ((ns - ss) * wx).store_array(&mut parts[3]);
        }
        sums.fill([[0.0; LANES]; 4]);
        kernel::analyse_eight(simd, &self.stages.recurrence, m, parts, (sums, table));
        let (cosine, sine) = columns.split_at_mut(2 * steps);
        let mut below = [f64x8::splat(simd, 0.0); 2];
        for (k, (sums, scale)) in sums
            .iter()
            .zip(self.stages.recurrence.scales(m))
            .enumerate()
        {
            let [alpha, g, h] = scale.map(|s| f64x8::splat(simd, s));
            let sums = load_quad::<S, f64>(simd, sums);
            for (part, column) in [&mut *cosine, &mut *sine].into_iter().enumerate() {
                below[part] = g.mul_add(sums[part + 2], below[part]);
                (alpha * sums[part]).store_array(&mut column[2 * k]);
                (h * below[part]).store_array(&mut column[2 * k + 1]);
            }
        }
        scatter(simd, &cosine[..count], sets, start);
        if m > 0 {
            scatter(simd, &sine[..count], sets, start + count);
        }
    }
}

/// The `count` values from `start` of each of eight sets, a lane a set; zeros after them.
#[inline(always)]
fn gather<S: Simd>(simd: S, sets: &[f64], start: usize, count: usize, out: &mut [Lanes]) {
    let length = sets.len() / LANES;
    let set = |lane: usize| &sets[lane * length + start..][..count];
    let sets: [&[f64]; LANES] = std::array::from_fn(set);
    let (out, rest) = out.split_at_mut(count);
    rest.fill([0.0; LANES]);
    let (whole, remainder) = out.as_chunks_mut::<LANES>();
    let done = whole.len() * LANES;
    for (i, out) in whole.iter_mut().enumerate() {
        let mut rows = [f64x8::splat(simd, 0.0); LANES];
        for (row, set) in rows.iter_mut().zip(&sets) {
            *row = f64x8::from_slice(simd, &set[i * LANES..(i + 1) * LANES]);
        }
        for (out, row) in out.iter_mut().zip(f64::transpose(rows)) {
            row.store_array(out);
        }
    }
    for (i, out) in remainder.iter_mut().enumerate() {
        *out = sets.map(|set| set[done + i]);
    }
}

/// The inverse of [`gather`].
#[inline(always)]
fn scatter<S: Simd>(simd: S, values: &[Lanes], sets: &mut [f64], start: usize) {
    let length = sets.len() / LANES;
    let (whole, remainder) = values.as_chunks::<LANES>();
    for (i, values) in whole.iter().enumerate() {
        let mut rows = [f64x8::splat(simd, 0.0); LANES];
        for (row, values) in rows.iter_mut().zip(values) {
            *row = f64x8::load_array_ref(simd, values);
        }
        for (lane, row) in f64::transpose(rows).into_iter().enumerate() {
            row.store_slice(&mut sets[lane * length + start + i * LANES..][..LANES]);
        }
    }
    let done = whole.len() * LANES;
    for (i, values) in remainder.iter().enumerate() {
        for (lane, value) in values.iter().enumerate() {
            sets[lane * length + start + done + i] = *value;
        }
    }
}
