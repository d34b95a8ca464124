//! The Legendre functions of a small transform, worked out once and read from a table.

use std::ops::Range;

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::kernel::{Quad, Totals, add_step, add_two_steps, block, store_totals, tabulate};
use super::lane::Lane;
use super::recurrence::{Block, LANES, Recurrence};
use super::simd::wide;

/// The most lines that a table is made of, 4 MiB of them: on Gauss–Legendre rings to degree 150 or
/// so, to 190 in single precision. From the second cache or in part from the third they come sooner than the recurrence's steps
/// are made; at degree 255 no more, where synthesis took a quarter longer with a table (AMD family 25,
/// which halves its vectors of eight).
const MOST_LINES: usize = 1 << 16;

/// p_k of every order and bundle of a [`Recurrence`].
pub(crate) struct LegendreTable<R: Lane = f64> {
    lines: Vec<R::Lanes>,
    /// Where each (order, bundle) begins in `lines`.
    starts: Vec<u32>,
    bundles: usize,
}

/// Runs a kernel on every block of bundles. Where `$halved`, four bundles go as twice two; vectors of
/// fewer lanes than a bundle have room for one bundle only.
macro_rules! over_blocks {
    ($kernel:ident, $halved:expr, $simd:ident, $recurrence:ident, $arguments:expr, $out:expr) => {
        for block in &$recurrence.blocks {
            macro_rules! run {
                ($first:expr, $width:literal, $half:literal) => {
                    $simd.vectorize(
                        #[inline(always)]
                        || $kernel::<S, R, MAPS, $width, $half>($simd, $first, $arguments, $out),
                    )
                };
            }
            let first = block.first;
            if const { S::f64s::LEN == LANES } {
                match block.width {
                    4 if $halved => {
                        run!(first, 2, 1);
                        run!(first + 2, 2, 1)
                    }
                    4 => run!(first, 4, 2),
                    2 => run!(first, 2, 1),
                    _ => run!(first, 1, 0),
                }
            } else {
                run!(first, 1, 0)
            }
        }
    };
}

impl<R: Lane> LegendreTable<R> {
    /// The table, where it is small enough to be of use: the values of `exact`, where those of
    /// `recurrence` are not negligible.
    pub(crate) fn new(
        recurrence: &Recurrence<R>,
        exact: &Recurrence,
        orders: usize,
        level: Level,
    ) -> Option<Self> {
        let bundles = recurrence.bundles.len();
        if recurrence.steps_of_all() * bundles > MOST_LINES {
            return None;
        }
        let mut table = Self {
            lines: Vec::new(),
            starts: vec![0],
            bundles,
        };
        let parts = R::LANES / LANES;
        let mut all = vec![vec![[[0.0; LANES]]; recurrence.steps(0).len()]; parts];
        for m in 0..=orders {
            let count = recurrence.steps(m).len();
            for block in &recurrence.blocks {
                for v in 0..block.width {
                    let (bundle, begin) = (block.first + v, begin_of(recurrence, m, block, v));
                    for (part, all) in all.iter_mut().enumerate() {
                        let at = bundle * parts + part;
                        all.fill([[0.0; LANES]]);
                        if at < exact.bundles.len() {
                            wide!(level, simd => if exact.bundles[at].is_polar() {
                                tabulate::<_, f64, 1, 1>(simd, exact, m, at, &mut all[..count])
                            } else {
                                tabulate::<_, f64, 1, 0>(simd, exact, m, at, &mut all[..count])
                            });
                        }
                    }
                    let value = |k: usize, lane: usize| all[lane / LANES][k][0][lane % LANES];
                    let line = |k| R::lanes(|lane| R::of(value(k, lane)));
                    table.lines.extend((begin..count).map(line));
                    table.starts.push(table.lines.len() as u32);
                }
            }
        }
        table.lines.shrink_to_fit();
        Some(table)
    }

    /// Bytes of the table.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.lines) + size_of_val(&*self.starts)
    }

    /// As [`kernel::synthesise`](super::kernel::synthesise).
    #[inline(always)]
    pub(crate) fn synthesise<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        recurrence: &Recurrence<R>,
        m: usize,
        sums: &[[[R; 4]; MAPS]],
        out: &mut [&mut [Quad<R>]; MAPS],
    ) {
        // The sums of three maps fill the registers with two bundles.
        over_blocks!(
            synthesise_block,
            MAPS > 1,
            simd,
            recurrence,
            (self, recurrence, m, sums),
            out
        );
    }

    /// As [`kernel::analyse`](super::kernel::analyse).
    #[inline(always)]
    pub(crate) fn analyse<S: Simd, const MAPS: usize>(
        &self,
        simd: S,
        recurrence: &Recurrence<R>,
        m: usize,
        parts: &[&[Quad<R>]; MAPS],
        sums: &mut [[R::Lanes; MAPS]],
    ) {
        over_blocks!(
            analyse_block,
            false,
            simd,
            recurrence,
            (self, recurrence, m, parts),
            sums
        );
    }

    /// p_k of some bundles at order m, up to the last step: from where one of those that begin
    /// together is not negligible.
    #[inline(always)]
    fn rows<const WIDTH: usize>(&self, m: usize, first: usize) -> [&[R::Lanes]; WIDTH] {
        let at = m * self.bundles + first;
        std::array::from_fn(|v| {
            &self.lines[self.starts[at + v] as usize..self.starts[at + v + 1] as usize]
        })
    }
}

/// The step at which the row of a block's bundle v begins. The bundles nearer the pole begin later;
/// each half of a block begins together, and no half after the one before it.
fn begin_of<R: Lane>(recurrence: &Recurrence<R>, m: usize, block: &Block, v: usize) -> usize {
    let half = block.width.div_ceil(2);
    (0..(v / half + 1) * half)
        .filter_map(|v| recurrence.entries(m, block.first + v).first())
        .map(|entry| entry.step)
        .fold(recurrence.steps(m).len(), usize::min)
}

/// The lines of some steps, of the rows from `FROM`; `last` is the step at which all rows end.
#[inline(always)]
fn lines<'a, R: Lane, const FROM: usize, const WIDTH: usize>(
    rows: &[&'a [R::Lanes]; WIDTH],
    steps: Range<usize>,
    last: usize,
) -> [&'a [R::Lanes]; WIDTH] {
    std::array::from_fn(|v| {
        if v < FROM {
            return &[][..];
        }
        let begin = last - rows[v].len();
        &rows[v][steps.start - begin..steps.end - begin]
    })
}

/// Line k of each row from `FROM`.
#[inline(always)]
fn load<S: Simd, R: Lane, const FROM: usize, const WIDTH: usize>(
    simd: S,
    rows: &[&[R::Lanes]; WIDTH],
    k: usize,
) -> [R::Vector<S>; WIDTH] {
    let mut p = [R::splat(simd, R::default()); WIDTH];
    for v in FROM..WIDTH {
        p[v] = R::load(simd, &rows[v][k]);
    }
    p
}

/// What the kernels of one order work from: the table, its recurrence, the order, and the sums by
/// step or the parts of the rings.
type OrderInput<'a, R, T> = (&'a LegendreTable<R>, &'a Recurrence<R>, usize, &'a [T]);

/// Σ_k p_k · sums on the bundles of a block. Until the first half enters, the other goes alone.
#[inline(always)]
fn synthesise_block<S: Simd, R: Lane, const MAPS: usize, const WIDTH: usize, const HALF: usize>(
    simd: S,
    first: usize,
    (table, recurrence, m, sums): OrderInput<'_, R, [[R; 4]; MAPS]>,
    out: &mut [&mut [Quad<R>]; MAPS],
) {
    let last = recurrence.steps(m).len();
    let rows = table.rows::<WIDTH>(m, first);
    let mut totals = [[[R::splat(simd, R::default()); WIDTH]; 4]; MAPS];
    let (begin, whole) = (last - rows[WIDTH - 1].len(), last - rows[0].len());
    if HALF > 0 {
        let rows = lines::<R, HALF, WIDTH>(&rows, begin..whole, last);
        synthesise_lines::<S, R, HALF, WIDTH, MAPS>(simd, &rows, &sums[begin..whole], &mut totals);
    }
    let rows = lines::<R, 0, WIDTH>(&rows, whole..last, last);
    synthesise_lines::<S, R, 0, WIDTH, MAPS>(simd, &rows, &sums[whole..last], &mut totals);
    store_totals(simd, block(&recurrence.bundles, first), first, &totals, out);
}

/// Some steps of the rows from `FROM`.
#[inline(always)]
fn synthesise_lines<S: Simd, R: Lane, const FROM: usize, const WIDTH: usize, const MAPS: usize>(
    simd: S,
    rows: &[&[R::Lanes]; WIDTH],
    sums: &[[[R; 4]; MAPS]],
    totals: &mut Totals<S, R, WIDTH, MAPS>,
) {
    for (k, sums) in sums.iter().enumerate() {
        let p = load::<S, R, FROM, WIDTH>(simd, rows, k);
        add_step::<S, R, FROM, WIDTH, MAPS>(simd, &p, totals, sums);
    }
}

/// Adds Σ over the rings of a block of p_k · parts to `sums[k / 2]`, four for each of two steps.
#[inline(always)]
fn analyse_block<S: Simd, R: Lane, const MAPS: usize, const WIDTH: usize, const HALF: usize>(
    simd: S,
    first: usize,
    (table, recurrence, m, parts): OrderInput<'_, R, &[Quad<R>]>,
    sums: &mut [[R::Lanes; MAPS]],
) {
    let last = recurrence.steps(m).len();
    let rows = table.rows::<WIDTH>(m, first);
    let parts = std::array::from_fn(|map| block(parts[map], first));
    let (begin, whole) = (last - rows[WIDTH - 1].len(), last - rows[0].len());
    if HALF > 0 {
        let rows = lines::<R, HALF, WIDTH>(&rows, begin..whole, last);
        let sums = &mut sums[begin / 2..whole / 2];
        analyse_lines::<S, R, HALF, WIDTH, MAPS>(simd, &rows, &parts, sums);
    }
    let rows = lines::<R, 0, WIDTH>(&rows, whole..last, last);
    analyse_lines::<S, R, 0, WIDTH, MAPS>(simd, &rows, &parts, &mut sums[whole / 2..last / 2]);
}

/// Two steps at a time of the rows from `FROM`; where they begin and end is even.
#[inline(always)]
fn analyse_lines<S: Simd, R: Lane, const FROM: usize, const WIDTH: usize, const MAPS: usize>(
    simd: S,
    rows: &[&[R::Lanes]; WIDTH],
    parts: &[&[Quad<R>; WIDTH]; MAPS],
    sums: &mut [[R::Lanes; MAPS]],
) {
    for (k, sums) in sums.iter_mut().enumerate() {
        let p = load::<S, R, FROM, WIDTH>(simd, rows, 2 * k);
        let q = load::<S, R, FROM, WIDTH>(simd, rows, 2 * k + 1);
        add_two_steps::<S, R, FROM, WIDTH, MAPS>(simd, [&p, &q], parts, sums);
    }
}
