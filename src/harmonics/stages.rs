//! The two stages of a transform on rings that are all alike: sums over degree, order by order, and
//! Fourier transforms along rings, bundle by bundle.

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::coefficients::column_start;
use super::kernel::{self, Quad};
use super::lane::Lane;
use super::legendre_table::LegendreTable;
use super::recurrence::Recurrence;
use super::ring_fft::{Element, RingFft};
use super::work::Rows;
use crate::Parallelism;
use crate::sphere::Grid;

/// What goes between the sums over azimuth and those over rings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weighing {
    /// Nothing: synthesis and its adjoint.
    None,
    /// The weights of the quadrature: analysis and its adjoint.
    Quadrature,
}

/// Below so many steps of bundles waking another thread costs more than it saves.
const SMALL_WORK: usize = 8000;

/// How many parts a thread's share of the work has, so that threads of unequal luck end together.
pub(super) const PARTS: usize = 4;

/// The tables of both stages for one grid, to one degree.
pub(super) struct Stages<R: Lane = f64> {
    pub(super) grid: Grid,
    pub(super) degree: usize,
    pub(super) orders: usize,
    pub(super) level: Level,
    pub(super) recurrence: Recurrence<R>,
    /// What the recurrence gives, where that is little enough to be kept.
    table: Option<LegendreTable<R>>,
    /// Where each ring of a map begins, and where the last one ends.
    pub(super) starts: Vec<usize>,
    fft: RingFft<R>,
    /// e^(i m φ₀) for each order, halved for m > 0.
    phases: Vec<[f64; 2]>,
    /// The quadrature weights of each bundle's rings, in steradians a point.
    pub(super) weights: Vec<R::Lanes>,
    /// How many threads the scratch serves.
    pub(super) workers: usize,
}

impl<R: Lane> Stages<R> {
    /// The tables, from a recurrence and its table of values; `weight(ring)` is in steradians a point.
    pub(super) fn new(
        grid: &Grid,
        (degree, orders): (usize, usize),
        level: Level,
        (recurrence, table): (Recurrence<R>, Option<LegendreTable<R>>),
        weight: impl Fn(usize) -> f64,
    ) -> Self {
        let pairs = grid.rings().div_ceil(2);
        let weights = (0..recurrence.bundles.len())
            .map(|bundle| {
                R::lanes(|lane| match bundle * R::LANES + lane {
                    ring if ring < pairs => R::of(weight(ring)),
                    _ => R::default(),
                })
            })
            .collect();
        Self {
            degree,
            orders,
            level,
            recurrence,
            table,
            starts: (0..grid.rings())
                .map(|ring| grid.ring_points(ring).start)
                .chain([grid.len()])
                .collect(),
            fft: RingFft::new(grid.columns()),
            phases: (0..=orders)
                .map(|m| {
                    let (s, c) = (m as f64 * grid.first_azimuth()).sin_cos();
                    let half = if m == 0 { 1.0 } else { 0.5 };
                    [half * c, half * s]
                })
                .collect(),
            weights,
            workers: Parallelism::Rayon.threads(),
            grid: grid.clone(),
        }
    }

    /// Bytes of the tables.
    pub(super) fn table_bytes(&self) -> usize {
        let table = self.table.as_ref().map_or(0, LegendreTable::bytes);
        self.recurrence.bytes() + table
    }

    /// Lines that the work on the rows of a bundle needs.
    pub(super) fn rows_len(&self) -> usize {
        2 * self.fft.work_len()
    }

    /// −1 where azimuths fall as the column grows, otherwise 1.
    fn direction(&self) -> R {
        let direction = if self.grid.is_descending() { -1.0 } else { 1.0 };
        R::of(direction)
    }

    /// Whether so much work is worth other threads.
    pub(super) fn worthwhile(&self, batch: usize, parallelism: Parallelism) -> Parallelism {
        let work = self.recurrence.steps_of_all() * self.recurrence.bundles.len();
        if batch.saturating_mul(work) < SMALL_WORK {
            Parallelism::Sequential
        } else {
            parallelism
        }
    }

    /// Lines of the sums of one map between the two stages.
    pub(super) fn spectrum_len(&self) -> usize {
        (self.orders + 1) * self.recurrence.bundles.len() * 4
    }

    /// Lines that the work on one order needs.
    pub(super) fn order_len(&self, group: usize) -> usize {
        let sums = (self.degree / 2 + 1).next_multiple_of(2).div_ceil(2) * group;
        let columns = (2 * group * (self.degree + 1)).div_ceil(R::LANES);
        let parts = self.recurrence.bundles.len() * 4 * group;
        sums + columns.max(parts)
    }

    /// Order m of the sums of every ring from the coefficients, `out[map · bundles + bundle]`.
    #[inline(always)]
    pub(super) fn synthesise_order<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        m: usize,
        sets: &[R],
        out: &mut [Quad<R>],
        slot: &mut [R::Lanes],
    ) {
        let steps = self.recurrence.steps(m).len();
        let set_len = sets.len() / MAPS;
        let start = column_start(self.degree, m);
        let count = self.degree + 1 - m;
        let used = if m == 0 { count } else { 2 * count };
        let (sums, columns) = slot.split_at_mut((4 * MAPS * steps).div_ceil(R::LANES));
        let mut columns = R::values(columns);
        let columns = std::array::from_fn(|map| {
            let column = &sets[map * set_len + start..][..used];
            // Columns are read backwards. Several sets lie beyond the nearest cache, from where a
            // copy forwards, which processors foresee, brings them faster; order 0 gets the sines
            // that it lacks.
            if MAPS == 1 && m > 0 {
                return column;
            }
            let copy = columns.split_off_mut(..2 * count).unwrap_or_default();
            copy[..used].copy_from_slice(column);
            copy[used..].fill(R::default());
            copy
        });
        let sums = &mut R::values(sums).as_chunks_mut().0.as_chunks_mut().0[..steps];
        self.recurrence.prepare::<MAPS>(m, &columns, sums);
        let bundles = out.len() / MAPS;
        let mut rest = out;
        let mut out: [&mut [Quad<R>]; MAPS] =
            std::array::from_fn(|_| rest.split_off_mut(..bundles).unwrap_or_default());
        match &self.table {
            Some(table) => table.synthesise(simd, &self.recurrence, m, sums, &mut out),
            None => kernel::synthesise(simd, &self.recurrence, m, sums, &mut out),
        }
    }

    /// The northern rows of a bundle and their mirror images from their sums; `sums[m · stride]` is order
    /// m's.
    #[inline(always)]
    pub(super) fn synthesise_rows<S: Simd>(
        &self,
        simd: S,
        sums: &[Quad<R>],
        stride: usize,
        rows: Rows<R, &mut [R]>,
        slot: &mut [R::Lanes],
    ) {
        let columns = self.grid.columns();
        let buffer: &mut [Element<R>] = slot.as_chunks_mut().0;
        let zero = [R::ZEROS; 2];
        for k in self.orders + 1..columns - self.orders {
            buffer[self.fft.position(k)] = zero;
        }
        let sign = R::splat(simd, self.direction());
        for (m, (sums, phase)) in sums.iter().step_by(stride).zip(&self.phases).enumerate() {
            let [nc, ns, sc, ss] = load_quad::<S, R>(simd, sums);
            let [c, s] = phase.map(|part| R::splat(simd, R::of(part)));
            // (cosine − i sine) e^(i m φ₀)/2
            let (nr, ni) = (nc.mul_add(c, ns * s), sign * nc.mul_sub(s, ns * c));
            let (sr, si) = (sc.mul_add(c, ss * s), sign * sc.mul_sub(s, ss * c));
            let element = &mut buffer[self.fft.position(m)];
            (nr - si).store_array(&mut element[0]);
            (ni + sr).store_array(&mut element[1]);
            if m > 0 {
                let element = &mut buffer[self.fft.position(columns - m)];
                (nr + si).store_array(&mut element[0]);
                (sr - ni).store_array(&mut element[1]);
            }
        }
        self.fft.inverse(simd, buffer);
        for (part, mut rows) in rows.into_iter().enumerate() {
            let mut chunks = buffer[..columns].chunks_exact(R::LANES);
            let mut column = 0;
            for chunk in &mut chunks {
                let mut lanes = R::each(|_| sign);
                for (lane, element) in lanes.as_mut().iter_mut().zip(chunk) {
                    *lane = R::load(simd, &element[part]);
                }
                let lanes = R::transpose(lanes);
                // By number: an iterator by value would copy the vectors.
                for lane in 0..R::LANES {
                    let row = rows.as_mut()[lane].get_mut(column..);
                    if let Some(out) = row.and_then(R::first_line_mut) {
                        lanes.as_ref()[lane].store_array(out);
                    }
                }
                column += R::LANES;
            }
            for element in chunks.remainder() {
                for (row, value) in rows.as_mut().iter_mut().zip(element[part].as_ref()) {
                    if let Some(out) = row.get_mut(column) {
                        *out = *value;
                    }
                }
                column += 1;
            }
        }
    }

    /// The rows of a bundle.
    pub(super) fn rows_of<'a>(&self, bundle: usize, map: &'a [R]) -> Rows<R, &'a [R]> {
        let rings = self.grid.rings();
        let row = |row: usize| &map[self.starts[row]..self.starts[row + 1]];
        let ring = |lane: usize| bundle * R::LANES + lane;
        [
            R::each(|lane| match ring(lane) {
                ring if ring < rings.div_ceil(2) => row(ring),
                _ => &[][..],
            }),
            R::each(|lane| match ring(lane) {
                ring if ring < rings / 2 => row(rings - 1 - ring),
                _ => &[][..],
            }),
        ]
    }

    /// The northern rows of a bundle and their mirror images to their sums over azimuth, `out[m]`.
    #[inline(always)]
    pub(super) fn analyse_rows<S: Simd>(
        &self,
        simd: S,
        rows: Rows<R, &[R]>,
        out: &mut [Quad<R>],
        slot: &mut [R::Lanes],
    ) {
        let columns = self.grid.columns();
        let buffer: &mut [Element<R>] = slot.as_chunks_mut().0;
        for (part, rows) in rows.iter().enumerate() {
            let mut chunks = buffer[..columns].chunks_exact_mut(R::LANES);
            let mut column = 0;
            for chunk in &mut chunks {
                let mut lanes = R::each(|_| R::splat(simd, R::default()));
                for (lane, row) in lanes.as_mut().iter_mut().zip(rows.as_ref()) {
                    if let Some(values) = row.get(column..).and_then(R::first_line) {
                        *lane = R::load(simd, values);
                    }
                }
                let lanes = R::transpose(lanes);
                for (lane, element) in chunk.iter_mut().enumerate() {
                    lanes.as_ref()[lane].store_array(&mut element[part]);
                }
                column += R::LANES;
            }
            for element in chunks.into_remainder() {
                let at = |lane: usize| rows.as_ref()[lane].get(column).copied();
                element[part] = R::lanes(|lane| at(lane).unwrap_or_default());
                column += 1;
            }
        }
        self.fft.forward(simd, buffer);
        let sign = R::splat(simd, self.direction());
        for (m, (out, phase)) in out.iter_mut().zip(&self.phases).enumerate() {
            let load = |k: usize| buffer[self.fft.position(k)].map(|part| R::load(simd, &part));
            let [ar, ai] = load(m);
            let [br, bi] = load((columns - m) % columns);
            // The two rings' spectra, doubled; for m > 0 the phase holds the half.
            let (nr, ni) = (ar + br, sign * (ai - bi));
            let (sr, si) = (ai + bi, sign * (br - ar));
            let half = if m == 0 { 0.5 } else { 1.0 };
            let [c, s] = phase.map(|part| R::splat(simd, R::of(half * part)));
            // times e^(−i m φ₀): cosine − i sine
            nr.mul_add(c, ni * s).store_array(&mut out[0]);
            nr.mul_sub(s, ni * c).store_array(&mut out[1]);
            sr.mul_add(c, si * s).store_array(&mut out[2]);
            sr.mul_sub(s, si * c).store_array(&mut out[3]);
        }
    }

    /// Order m of the coefficients from its sums, `spectra[(map · bundles + bundle) · stride]`.
    #[inline(always)]
    pub(super) fn analyse_order<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        m: usize,
        (spectra, stride): (&[Quad<R>], usize),
        columns: [&mut [R]; MAPS],
        slot: &mut [R::Lanes],
        weighing: Weighing,
    ) {
        let bundles = self.recurrence.bundles.len();
        let steps = self.recurrence.steps(m).len();
        let (parts, sums) = slot.split_at_mut(MAPS * bundles * 4);
        let parts: &mut [Quad<R>] = parts.as_chunks_mut().0;
        let sums = &mut sums[..MAPS * steps / 2];
        sums.fill(R::ZEROS);
        for (index, (parts, sums)) in parts
            .iter_mut()
            .zip(spectra.iter().step_by(stride))
            .enumerate()
        {
            let bundle = index % bundles;
            let w = match weighing {
                Weighing::Quadrature => R::load(simd, &self.weights[bundle]),
                Weighing::None => R::splat(simd, R::of(1.0)),
            };
            let wx = w * R::load(simd, &self.recurrence.bundles[bundle].x);
            let [nc, ns, sc, ss] = load_quad::<S, R>(simd, sums);
            ((nc + sc) * w).store_array(&mut parts[0]);
            ((ns + ss) * w).store_array(&mut parts[1]);
            ((nc - sc) * wx).store_array(&mut parts[2]);
            ((ns - ss) * wx).store_array(&mut parts[3]);
        }
        let parts: [&[Quad<R>]; MAPS] =
            std::array::from_fn(|map| &parts[map * bundles..(map + 1) * bundles]);
        let sums: &mut [[R::Lanes; MAPS]] = sums.as_chunks_mut().0;
        match &self.table {
            Some(table) => table.analyse(simd, &self.recurrence, m, &parts, sums),
            None => kernel::analyse(simd, &self.recurrence, m, &parts, sums),
        }
        self.recurrence.finish::<MAPS>(m, sums, columns);
    }
}

#[inline(always)]
pub(super) fn load_quad<S: Simd, R: Lane>(simd: S, quad: &Quad<R>) -> [R::Vector<S>; 4] {
    [
        R::load(simd, &quad[0]),
        R::load(simd, &quad[1]),
        R::load(simd, &quad[2]),
        R::load(simd, &quad[3]),
    ]
}
