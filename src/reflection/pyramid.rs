//! A map as moments on coarser and coarser grids, so that any smooth kernel is integrated against it with few nodes.
//!
//! A kernel K that is smooth at the scale of a grid is its own interpolant there: K(ω) = Σ_j K(ω_j) φ_j(ω). So
//! ∫ K L dω = Σ_j K(ω_j) M_j with the moments M_j = ∫ φ_j L dω, whatever L is: a sun of one pixel costs no
//! accuracy, because it is K that is interpolated, not L. The φ_j are Lagrange's polynomials over ten nodes each way,
//! and the moments are integrated exactly, piece by piece between nodes and pixel centres.

use std::f64::consts::{PI, TAU};

use fearless_simd::{Level as SimdLevel, dispatch, f32x8, f64x8, prelude::*};

use super::kernel::{LobeAt, Part, RowLobe};
use super::region::Region;
use crate::Parallelism;
use crate::sphere::Rule;

/// Nodes of the interpolation, each way.
const TAPS: usize = 10;

/// The rows of the levels: steps of 4/3 or 3/2. The finest resolves a third of a pixel.
const ROWS: [usize; 13] = [16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024];

/// A circle of equally spaced columns.
#[derive(Debug)]
struct Columns {
    cos: Vec<f64>,
    sin: Vec<f64>,
    /// After so many columns the weights repeat, `shift` pixels on.
    period: usize,
    shift: usize,
    /// For each column of a period, the first pixel that it draws from (it may be negative).
    first: Vec<isize>,
    /// How many pixels each draws from, and their weights.
    taps: usize,
    weights: Vec<f64>,
}

/// A row of nodes.
#[derive(Debug)]
struct Row {
    sin: f64,
    cos: f64,
    /// Which [`Columns`].
    columns: usize,
    /// Where its moments start.
    start: usize,
}

/// The moments of the map on one grid: rows at θ = π(i + ½)/n, fewer columns towards the poles.
#[derive(Debug)]
struct Level {
    rows: Vec<Row>,
    moments: [Vec<f32>; 3],
}

/// The moments of a map on grids from coarse to fine.
#[derive(Debug)]
pub(super) struct Pyramid {
    columns: Vec<Columns>,
    /// From the coarsest to the finest.
    levels: Vec<Level>,
}

impl Pyramid {
    pub(super) fn new(
        pixels: &[[f64; 3]],
        width: usize,
        height: usize,
        simd: SimdLevel,
        parallelism: Parallelism,
    ) -> Self {
        let rows: Vec<usize> = ROWS
            .into_iter()
            .filter(|&rows| rows <= (3 * height).max(512))
            .collect();
        let finest = rows[rows.len() - 1];
        let counts = column_counts(2 * finest + 2 * TAPS);
        let columns = parallelism.map(counts.len(), |index| Columns::new(counts[index], width));
        // A fourth channel of nothing, so that a pixel fills a register.
        let pixels: Vec<[f64; 4]> = pixels.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
        // The finest takes longest: first.
        let mut levels = parallelism.map(rows.len(), |index| {
            let rows = rows[rows.len() - 1 - index];
            dispatch!(simd, simd => {
                let _ = simd;
                Level::new(rows, &pixels, width, height, &columns)
            })
        });
        levels.reverse();
        Self { columns, levels }
    }

    /// The angle between the rows of a level.
    pub(super) fn step(&self, level: usize) -> f64 {
        PI / self.levels[level].rows.len() as f64
    }

    /// The finest level.
    pub(super) fn finest(&self) -> usize {
        self.levels.len() - 1
    }

    /// The coarsest level whose rows are no further apart than `step`.
    pub(super) fn level(&self, step: f64) -> Option<usize> {
        self.levels
            .iter()
            .position(|level| PI / level.rows.len() as f64 <= step)
    }

    /// ∫ K L dω over a region for a part K of a lobe, which must be smooth at the scale of the level.
    #[inline(always)]
    pub(super) fn integrate<S: Simd>(
        &self,
        simd: S,
        level: usize,
        lobe: &LobeAt,
        region: &Region,
        part: Part,
    ) -> [f64; 3] {
        let level = &self.levels[level];
        let mut sums = [f64x8::splat(simd, 0.0); 3];
        for row in &level.rows[region.rows(level.rows.len())] {
            let columns = &self.columns[row.columns];
            let blocks = columns.cos.len() / 8;
            let lobe = RowLobe::new(simd, lobe, row.sin, row.cos);
            for (first, count) in region.runs(row.sin, row.cos, blocks, 0.0) {
                for block in first..first + count {
                    let at = 8 * if block < blocks {
                        block
                    } else {
                        block - blocks
                    };
                    let value = lobe.evaluate(
                        simd,
                        f64x8::from_slice(simd, &columns.cos[at..at + 8]),
                        f64x8::from_slice(simd, &columns.sin[at..at + 8]),
                        part,
                    );
                    let at = row.start + at;
                    for (sum, moments) in sums.iter_mut().zip(&level.moments) {
                        let (low, high) = f32x8::from_slice(simd, &moments[at..at + 8]).widen();
                        *sum = value.mul_add(low.combine(high), *sum);
                    }
                }
            }
        }
        [
            sums[0].reduce_sum(),
            sums[1].reduce_sum(),
            sums[2].reduce_sum(),
        ]
    }
}

impl Level {
    #[inline(always)]
    fn new(
        count: usize,
        pixels: &[[f64; 4]],
        width: usize,
        height: usize,
        columns: &[Columns],
    ) -> Self {
        let weights = row_weights(count, height);
        let mut rows = Vec::with_capacity(count);
        let mut moments: [Vec<f32>; 3] = Default::default();
        let mut start = 0;
        let padding = columns
            .iter()
            .map(|columns| columns.taps)
            .max()
            .unwrap_or(0)
            + width;
        let mut line = vec![[0.0; 4]; width + 2 * padding];
        for (index, weights) in weights.iter().enumerate() {
            let (sin, cos) = (PI * (index as f64 + 0.5) / count as f64).sin_cos();
            // As dense along the row as across, and a few more, for the interpolation round the poles.
            let wanted = 2.0 * count as f64 * sin + 12.0;
            let chosen = columns
                .iter()
                .position(|columns| columns.cos.len() as f64 >= wanted)
                .unwrap_or(columns.len() - 1);
            let columns = &columns[chosen];
            let (before, rest) = line.split_at_mut(padding);
            let (middle, after) = rest.split_at_mut(width);
            middle.fill([0.0; 4]);
            for &(row, turned, weight) in weights {
                let row = &pixels[row * width..(row + 1) * width];
                let turn = if turned { width / 2 } else { 0 };
                for (sum, value) in middle
                    .iter_mut()
                    .zip(row[turn..].iter().chain(&row[..turn]))
                {
                    for channel in 0..4 {
                        sum[channel] += weight * value[channel];
                    }
                }
            }
            for (index, value) in before.iter_mut().rev().enumerate() {
                *value = middle[width - 1 - index % width];
            }
            for (index, value) in after.iter_mut().enumerate() {
                *value = middle[index % width];
            }
            columns.gather(&line, padding, &mut moments);
            rows.push(Row {
                sin,
                cos,
                columns: chosen,
                start,
            });
            start += columns.cos.len();
        }
        Self { rows, moments }
    }
}

/// How many columns a row may have: multiples of eight (a block of lanes) in steps of at most a third.
fn column_counts(at_least: usize) -> Vec<usize> {
    let mut counts: Vec<usize> = Vec::new();
    let mut unit = 8;
    loop {
        for count in [3 * unit, 7 * unit / 2, 4 * unit, 5 * unit] {
            if count % 8 == 0 {
                counts.push(count);
            }
            if count >= at_least && count % 8 == 0 {
                return counts;
            }
        }
        unit *= 2;
    }
}

impl Columns {
    fn new(count: usize, width: usize) -> Self {
        let repeats = greatest_common_divisor(count, width);
        let (period, shift) = (count / repeats, width / repeats);
        let taps = TAPS * width / count + 4;
        let mut first = vec![isize::MAX; period];
        let mut entries: Vec<Vec<(isize, f64)>> = vec![Vec::new(); period];
        overlaps(
            TAU / count as f64,
            TAU / width as f64,
            TAU / repeats as f64,
            |_| 1.0,
            |node, pixel, weight| {
                let turns = node.div_euclid(period as isize);
                let node = node.rem_euclid(period as isize) as usize;
                let pixel = pixel - turns * shift as isize;
                first[node] = first[node].min(pixel);
                entries[node].push((pixel, weight));
            },
        );
        let mut weights = vec![0.0; period * taps];
        for (node, entries) in entries.iter().enumerate() {
            for &(pixel, weight) in entries {
                weights[node * taps + (pixel - first[node]) as usize] += weight;
            }
        }
        let angle = |index: usize| TAU * (index as f64 + 0.5) / count as f64;
        Self {
            cos: (0..count).map(|index| angle(index).cos()).collect(),
            sin: (0..count).map(|index| angle(index).sin()).collect(),
            period,
            shift,
            first,
            taps,
            weights,
        }
    }

    /// The moments along a row of the map that is continued by `padding` pixels on both sides.
    #[inline(always)]
    fn gather(&self, line: &[[f64; 4]], padding: usize, moments: &mut [Vec<f32>; 3]) {
        for repeat in 0..self.cos.len() / self.period {
            let origin = padding + repeat * self.shift;
            for (&first, weights) in self.first.iter().zip(self.weights.chunks_exact(self.taps)) {
                let start = origin.wrapping_add_signed(first);
                let mut sum = [0.0; 4];
                for (weight, value) in weights.iter().zip(&line[start..start + self.taps]) {
                    for channel in 0..4 {
                        sum[channel] += weight * value[channel];
                    }
                }
                for channel in 0..3 {
                    moments[channel].push(sum[channel] as f32);
                }
            }
        }
    }
}

/// For each of `count` rows of nodes: the map's rows that it draws from, whether half a turn round, and the weight.
///
/// The weight is ∫ φ_i(θ) Λ_r(θ) sin θ dθ with Lagrange's φ_i and the map's hat Λ_r; what lies beyond a pole, of nodes or of
/// pixels, is the same row half a turn round.
fn row_weights(count: usize, height: usize) -> Vec<Vec<(usize, bool, f64)>> {
    let fold = |index: isize, count: usize| {
        if index < 0 {
            ((-1 - index) as usize, true)
        } else if index as usize >= count {
            (2 * count - 1 - index as usize, true)
        } else {
            (index as usize, false)
        }
    };
    let mut rows: Vec<Vec<(usize, bool, f64)>> = vec![Vec::new(); count];
    overlaps(
        PI / count as f64,
        PI / height as f64,
        PI,
        f64::sin,
        |node, pixel, weight| {
            let (node, node_turned) = fold(node, count);
            let (pixel, pixel_turned) = fold(pixel, height);
            let turned = node_turned != pixel_turned;
            let row = &mut rows[node];
            match row
                .iter_mut()
                .rev()
                .find(|entry| entry.0 == pixel && entry.1 == turned)
            {
                Some(entry) => entry.2 += weight,
                None => row.push((pixel, turned, weight)),
            }
        },
    );
    rows
}

/// Calls `add(node, pixel, ∫ φ_node Λ_pixel w)` for pieces of [0, length], with nodes at (k + ½)·`node_step` and the centres of
/// pixels at (k + ½)·`pixel_step`; indices go beyond the ends.
fn overlaps(
    node_step: f64,
    pixel_step: f64,
    length: f64,
    weight: impl Fn(f64) -> f64,
    mut add: impl FnMut(isize, isize, f64),
) {
    // Degree 9 of φ, 1 of Λ; sin θ over a piece is all but a low polynomial.
    let rule = Rule::gauss_legendre(8).expect("eight nodes are allowed");
    let breaks = |step: f64| {
        (0..)
            .map(move |k| (k as f64 + 0.5) * step)
            .take_while(move |&x| x < length)
    };
    let mut edges: Vec<f64> = breaks(node_step).chain(breaks(pixel_step)).collect();
    edges.extend([0.0, length]);
    edges.sort_by(f64::total_cmp);
    for pair in edges.windows(2) {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        if half < 1e-12 * node_step {
            continue;
        }
        let node = (middle / node_step - 0.5).floor();
        let pixel = (middle / pixel_step - 0.5).floor();
        let mut sums = [[0.0; 2]; TAPS];
        for (&x, &w) in rule.nodes.iter().zip(&rule.weights) {
            let x = middle + half * x;
            let w = w * half * weight(x);
            let fraction = x / pixel_step - 0.5 - pixel;
            for (sum, value) in sums.iter_mut().zip(lagrange(x / node_step - 0.5 - node)) {
                sum[0] += w * value * (1.0 - fraction);
                sum[1] += w * value * fraction;
            }
        }
        for (tap, sum) in sums.iter().enumerate() {
            let node = node as isize + tap as isize - (TAPS as isize / 2 - 1);
            add(node, pixel as isize, sum[0]);
            add(node, pixel as isize + 1, sum[1]);
        }
    }
}

/// Lagrange's polynomials over the integers −4 … 5 at x.
fn lagrange(x: f64) -> [f64; TAPS] {
    let node = |index: usize| index as f64 - (TAPS as f64 / 2.0 - 1.0);
    std::array::from_fn(|i| {
        (0..TAPS)
            .filter(|&j| j != i)
            .map(|j| (x - node(j)) / (node(i) - node(j)))
            .product()
    })
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}
