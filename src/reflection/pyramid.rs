//! A map as moments on coarser and coarser grids, so that any smooth kernel is integrated against
//! it with few nodes.
//!
//! A kernel K that is smooth at the scale of a grid is its own interpolant there: K(ω) = Σ_j K(ω_j)
//! φ_j(ω). So ∫ K L dω = Σ_j K(ω_j) M_j with the moments M_j = ∫ φ_j L dω, whatever L is: a sun of
//! one pixel costs no accuracy, because it is K that is interpolated, not L. The φ_j are Lagrange's
//! polynomials over ten nodes each way, and the moments are integrated exactly, piece by piece
//! between nodes and pixel centres. Moments of the channels' mean with polynomials over eight nodes
//! tell, at the same values of K, how well K is interpolated.

use std::f64::consts::{PI, TAU};

use fearless_simd::{Level as SimdLevel, dispatch, prelude::*};

use super::kernel::{EightRows, Lanes, LobeAt, Part, RowLobe, Shape};
use super::region::Region;
use crate::Parallelism;
use crate::sphere::Rule;

/// Nodes of the interpolation, each way; and of the one that it is checked against.
const TAPS: usize = 10;
const FEWER_TAPS: usize = 8;

/// The rows of the levels: steps of 4/3 or 3/2. The finest resolves a third of a pixel.
const ROWS: [usize; 13] = [16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024];

/// Rows have a multiple of so many nodes, and as many more round the circle, so that blocks of them
/// begin anywhere.
const BLOCK: usize = 16;

/// A circle of equally spaced columns.
#[derive(Debug)]
struct Columns {
    count: usize,
    /// After so many columns the weights repeat, `shift` pixels on.
    period: usize,
    shift: usize,
    /// For each column of a period, the first pixel that it draws from (it may be negative).
    first: Vec<isize>,
    /// How many pixels each draws from, and their weights.
    taps: usize,
    weights: Vec<[f64; 4]>,
}

/// (cos ψ, sin ψ) of the columns of all circles, and of [`BLOCK`] more of each.
#[derive(Debug, Default)]
struct Circles {
    cos: Vec<f64>,
    sin: Vec<f64>,
    cos_single: Vec<f32>,
    sin_single: Vec<f32>,
}

/// A row of nodes.
#[derive(Debug)]
struct Row {
    /// How many.
    count: usize,
    /// Where its columns start in [`Circles`].
    circle: usize,
    /// Where its moments start: those of the three channels, and of their mean with fewer nodes,
    /// each with [`BLOCK`] more.
    start: usize,
}

/// The moments of the map on one grid: rows at θ = π(i + ½)/n, fewer columns towards the poles.
#[derive(Debug)]
struct Level {
    rows: Vec<Row>,
    /// (sin θ, cos θ) of the rows, and of as many more as make eights.
    sin: Vec<f64>,
    cos: Vec<f64>,
    /// How many columns they have.
    counts: Vec<f64>,
    moments: Vec<f32>,
}

/// A sum over a grid, and how far off the channels' mean is with fewer nodes and a softer horizon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Checked {
    pub(super) value: [f64; 3],
    pub(super) embedded: f64,
}

/// The moments of a map on grids from coarse to fine.
#[derive(Debug)]
pub(super) struct Pyramid {
    circles: Circles,
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
        let circles = Circles::new(&counts);
        let pixels: Vec<[f64; 4]> = pixels
            .iter()
            .map(|&[r, g, b]| [r, g, b, (r + g + b) / 3.0])
            .collect();
        // The finest takes longest: first.
        let mut levels = parallelism.map(rows.len(), |index| {
            let rows = rows[rows.len() - 1 - index];
            dispatch!(simd, simd => {
                let _ = simd;
                Level::new(rows, &pixels, width, height, &columns)
            })
        });
        levels.reverse();
        Self { circles, levels }
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
            .position(|level| PI <= level.rows.len() as f64 * step)
    }

    /// ∫ K L dω over a region for a part K of a lobe, which must be smooth at the scale of the
    /// level. `V` is the precision.
    #[inline(always)]
    pub(super) fn integrate<S: Simd, V: Lanes<S>>(
        &self,
        simd: S,
        level: usize,
        lobe: &LobeAt,
        region: &Region,
        part: Part,
    ) -> Checked {
        let level = &self.levels[level];
        let shape = Shape::<V>::new(simd, lobe);
        let mut sums = [V::all(simd, 0.0); 4];
        let rows = region.rows(level.rows.len());
        // Where to evaluate is found apart from evaluating, which then goes on without a branch
        // that depends on it.
        let mut blocks = [Block::default(); BLOCKS];
        let mut found = 0;
        for eight in rows.start / 8..rows.end.div_ceil(8) {
            let sin = &level.sin.as_chunks().0[eight];
            let cos = &level.cos.as_chunks().0[eight];
            let nodes = region.nodes(simd, sin, cos, &level.counts.as_chunks().0[eight]);
            let waves = EightRows::new::<S, V>(lobe, sin, cos);
            for index in rows.start.max(8 * eight)..rows.end.min(8 * eight + 8) {
                let (row, lane) = (&level.rows[index], index % 8);
                for (first, many) in region.row(&nodes, lane, row.count, V::COUNT) {
                    let mut at = first;
                    for _ in 0..many / V::COUNT {
                        blocks[found] = Block {
                            lane,
                            circle: row.circle + at,
                            moments: row.start + at,
                            stride: row.count + BLOCK,
                        };
                        found += 1;
                        if found == BLOCKS {
                            self.add(simd, level, shape, &waves, &blocks, part, &mut sums);
                            found = 0;
                        }
                        at += V::COUNT;
                        at -= if at < row.count { 0 } else { row.count };
                    }
                }
            }
            self.add(
                simd,
                level,
                shape,
                &waves,
                &blocks[..found],
                part,
                &mut sums,
            );
            found = 0;
        }
        let (r, g, b) = (sums[0].total(), sums[1].total(), sums[2].total());
        let mean = sums[3].total();
        Checked {
            value: [r, g, b],
            embedded: ((r + g + b) / 3.0 - mean).abs(),
        }
    }

    /// Adds what some blocks hold.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "one loop of `integrate`, in two places"
    )]
    fn add<S: Simd, V: Lanes<S>>(
        &self,
        simd: S,
        level: &Level,
        shape: Shape<V>,
        waves: &EightRows<V::Element>,
        blocks: &[Block],
        part: Part,
        sums: &mut [V; 4],
    ) {
        let circles = &self.circles;
        let mut all = *sums;
        for block in blocks {
            let lobe = RowLobe::<V>::new(simd, shape, waves, block.lane);
            let some = block.circle..block.circle + V::COUNT;
            let cos = V::load(
                simd,
                &circles.cos[some.clone()],
                &circles.cos_single[some.clone()],
            );
            let sin = V::load(simd, &circles.sin[some.clone()], &circles.sin_single[some]);
            let [value, softer] = lobe.evaluate(simd, cos, sin, part);
            let values = [value, value, value, softer];
            for channel in 0..4 {
                let at = block.moments + channel * block.stride;
                let moments = V::load_single(simd, &level.moments[at..at + V::COUNT]);
                all[channel] = values[channel].mul_add(moments, all[channel]);
            }
        }
        *sums = all;
    }
}

/// Nodes beside each other on one of eight rows: where they are in [`Circles`], where their moments
/// are and how far those of the next channel.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    lane: usize,
    circle: usize,
    moments: usize,
    stride: usize,
}

/// So many blocks are found before they are evaluated.
const BLOCKS: usize = 64;

impl Circles {
    fn new(counts: &[usize]) -> Self {
        let mut circles = Self::default();
        for &count in counts {
            for index in 0..count + BLOCK {
                let (sin, cos) = (TAU * (index as f64 + 0.5) / count as f64).sin_cos();
                circles.cos.push(cos);
                circles.sin.push(sin);
                circles.cos_single.push(cos as f32);
                circles.sin_single.push(sin as f32);
            }
        }
        circles
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
        // Where each circle starts.
        let starts: Vec<usize> = columns
            .iter()
            .scan(0, |next, columns| {
                let start = *next;
                *next += columns.count + BLOCK;
                Some(start)
            })
            .collect();
        let padding = columns
            .iter()
            .map(|columns| columns.taps)
            .max()
            .unwrap_or(0)
            + 1;
        let mut line = vec![[0.0; 4]; width + 2 * padding];
        let (sin, cos): (Vec<f64>, Vec<f64>) = (0..count.next_multiple_of(8))
            .map(|index| (PI * (index as f64 + 0.5) / count as f64).sin_cos())
            .unzip();
        let mut end = 0;
        let rows: Vec<(usize, Row)> = sin[..count]
            .iter()
            .map(|sin| {
                // As dense along the row as across, and a few more, for the interpolation round the
                // poles.
                let wanted = 2.0 * count as f64 * sin + 12.0;
                let chosen = columns
                    .iter()
                    .position(|columns| columns.count as f64 >= wanted)
                    .unwrap_or(columns.len() - 1);
                let start = end;
                end += 4 * (columns[chosen].count + BLOCK);
                let row = Row {
                    count: columns[chosen].count,
                    circle: starts[chosen],
                    start,
                };
                (chosen, row)
            })
            .collect();
        let mut moments = vec![0.0; end];
        for (weights, (chosen, row)) in weights.iter().zip(&rows) {
            let columns = &columns[*chosen];
            let (before, rest) = line.split_at_mut(padding);
            let (middle, after) = rest.split_at_mut(width);
            middle.fill([0.0; 4]);
            for entry in weights {
                let row = &pixels[entry.pixel * width..(entry.pixel + 1) * width];
                let turn = if entry.turned { width / 2 } else { 0 };
                for (sum, value) in middle
                    .iter_mut()
                    .zip(row[turn..].iter().chain(&row[..turn]))
                {
                    for channel in 0..4 {
                        sum[channel] += entry.weights[channel] * value[channel];
                    }
                }
            }
            // No column draws from farther beyond an end.
            let beyond = columns.taps + 1;
            for (index, value) in before.iter_mut().rev().take(beyond).enumerate() {
                *value = middle[width - 1 - index % width];
            }
            for (index, value) in after.iter_mut().take(beyond).enumerate() {
                *value = middle[index % width];
            }
            let end = row.start + 4 * (columns.count + BLOCK);
            columns.gather(&line, padding, &mut moments[row.start..end]);
        }
        let rows: Vec<Row> = rows.into_iter().map(|(_, row)| row).collect();
        let mut counts: Vec<f64> = rows.iter().map(|row| row.count as f64).collect();
        counts.resize(sin.len(), BLOCK as f64);
        Self {
            rows,
            sin,
            cos,
            counts,
            moments,
        }
    }
}

/// How many columns a row may have: multiples of [`BLOCK`] in steps of at most a half.
fn column_counts(at_least: usize) -> Vec<usize> {
    let mut counts: Vec<usize> = Vec::new();
    let mut unit = 8;
    loop {
        for count in [3 * unit, 7 * unit / 2, 4 * unit, 5 * unit] {
            if count % BLOCK == 0 {
                counts.push(count);
            }
            if count >= at_least && count % BLOCK == 0 {
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
        let mut entries: Vec<Vec<(isize, [f64; 4])>> = vec![Vec::new(); period];
        overlaps(
            TAU / count as f64,
            TAU / width as f64,
            TAU / repeats as f64,
            |_| 1.0,
            |node, pixel, weights| {
                let turns = node.div_euclid(period as isize);
                let node = node.rem_euclid(period as isize) as usize;
                let pixel = pixel - turns * shift as isize;
                first[node] = first[node].min(pixel);
                entries[node].push((pixel, weights));
            },
        );
        // So a row that is continued by its taps on both sides is enough.
        debug_assert!(
            first
                .iter()
                .all(|&first| (-(taps as isize)..=shift as isize).contains(&first))
        );
        let mut weights = vec![[0.0; 4]; period * taps];
        for (node, entries) in entries.iter().enumerate() {
            for (pixel, more) in entries {
                add(
                    &mut weights[node * taps + (pixel - first[node]) as usize],
                    more,
                );
            }
        }
        Self {
            count,
            period,
            shift,
            first,
            taps,
            weights,
        }
    }

    /// The moments along a row of the map that is continued by `padding` pixels on both sides.
    #[inline(always)]
    fn gather(&self, line: &[[f64; 4]], padding: usize, moments: &mut [f32]) {
        let stride = self.count + BLOCK;
        for repeat in 0..self.count / self.period {
            let origin = padding + repeat * self.shift;
            let taps = self.weights.chunks_exact(self.taps);
            for (index, (&first, weights)) in self.first.iter().zip(taps).enumerate() {
                let start = origin.wrapping_add_signed(first);
                let mut sum = [0.0; 4];
                for (weight, value) in weights.iter().zip(&line[start..start + self.taps]) {
                    for channel in 0..4 {
                        sum[channel] += weight[channel] * value[channel];
                    }
                }
                for channel in 0..4 {
                    moments[channel * stride + repeat * self.period + index] = sum[channel] as f32;
                }
            }
        }
        for channel in moments.chunks_exact_mut(stride) {
            channel.copy_within(..BLOCK, self.count);
        }
    }
}

/// A row of the map that a row of nodes draws from.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    pixel: usize,
    /// Half a turn round.
    turned: bool,
    /// For the channels, and for their mean with fewer nodes.
    weights: [f64; 4],
}

/// For each of `count` rows of nodes: the map's rows that it draws from.
///
/// The weight is ∫ φ_i(θ) Λ_r(θ) sin θ dθ with Lagrange's φ_i and the map's hat Λ_r; what lies
/// beyond a pole, of nodes or of pixels, is the same row half a turn round.
fn row_weights(count: usize, height: usize) -> Vec<Vec<Drawn>> {
    let fold = |index: isize, count: usize| {
        if index < 0 {
            ((-1 - index) as usize, true)
        } else if index as usize >= count {
            (2 * count - 1 - index as usize, true)
        } else {
            (index as usize, false)
        }
    };
    let mut rows: Vec<Vec<Drawn>> = vec![Vec::new(); count];
    overlaps(
        PI / count as f64,
        PI / height as f64,
        PI,
        f64::sin,
        |node, pixel, weights| {
            let (node, node_turned) = fold(node, count);
            let (pixel, pixel_turned) = fold(pixel, height);
            let turned = node_turned != pixel_turned;
            let row = &mut rows[node];
            match row
                .iter_mut()
                .rev()
                .find(|drawn| drawn.pixel == pixel && drawn.turned == turned)
            {
                Some(drawn) => add(&mut drawn.weights, &weights),
                None => row.push(Drawn {
                    pixel,
                    turned,
                    weights,
                }),
            }
        },
    );
    rows
}

fn add(sum: &mut [f64; 4], more: &[f64; 4]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}

/// Calls `add(node, pixel, ∫ φ_node Λ_pixel w)`, with three times φ and once the φ of fewer nodes,
/// for pieces of [0, length], with nodes at (k + ½)·`node_step` and the centres of pixels at (k +
/// ½)·`pixel_step`; indices go beyond the ends.
fn overlaps(
    node_step: f64,
    pixel_step: f64,
    length: f64,
    weight: impl Fn(f64) -> f64,
    mut add: impl FnMut(isize, isize, [f64; 4]),
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
        // For each node, with all taps and with fewer, what falls to the pixel and what to the
        // next.
        let mut sums = [[[0.0; 2]; 2]; TAPS];
        for (&x, &w) in rule.nodes.iter().zip(&rule.weights) {
            let x = middle + half * x;
            let w = w * half * weight(x);
            let fraction = x / pixel_step - 0.5 - pixel;
            let at = x / node_step - 0.5 - node;
            let fewer = lagrange::<FEWER_TAPS>(at);
            for (tap, (sum, value)) in sums.iter_mut().zip(lagrange::<TAPS>(at)).enumerate() {
                let beside = tap.wrapping_sub((TAPS - FEWER_TAPS) / 2);
                let fewer = fewer.get(beside).copied().unwrap_or(0.0);
                for (sum, value) in sum.iter_mut().zip([value, fewer]) {
                    sum[0] += w * value * (1.0 - fraction);
                    sum[1] += w * value * fraction;
                }
            }
        }
        for (tap, [all, fewer]) in sums.iter().enumerate() {
            let node = node as isize + tap as isize - (TAPS as isize / 2 - 1);
            for next in 0..2 {
                let weights = [all[next], all[next], all[next], fewer[next]];
                add(node, pixel as isize + next as isize, weights);
            }
        }
    }
}

/// Lagrange's polynomials over the integers 1 − n/2 … n/2 at x.
fn lagrange<const NODES: usize>(x: f64) -> [f64; NODES] {
    let node = |index: usize| index as f64 - (NODES as f64 / 2.0 - 1.0);
    std::array::from_fn(|i| {
        (0..NODES)
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
