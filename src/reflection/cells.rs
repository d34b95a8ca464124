//! The map cell by cell: Gauss's rule on the pieces between four pixel centres, where the map is
//! bilinear.
//!
//! For lobes so narrow that the finest grid of the [pyramid](super::pyramid) does not resolve them:
//! the cells are divided until they are as small as the lobe.

use std::f64::consts::{PI, TAU};

use fearless_simd::{f64x8, prelude::*};

use super::bright_pixels::Light;
use super::kernel::{EightRows, LobeAt, Part, RowLobe, Shape};
use super::region::Region;
use crate::illumination::EnvironmentMap;
use crate::sphere::Rule;

/// Nodes each way of a part of a cell.
const NODES: usize = 4;

/// A cell is divided into at most 2^`MAX_DOUBLINGS` parts each way.
pub(super) const MAX_DOUBLINGS: u32 = 12;

/// Eight nodes, those of two neighbouring parts of a cell, seen from the pixel centre on the cell's
/// left.
#[derive(Debug)]
struct Pattern {
    cos: [f64; 8],
    sin: [f64; 8],
    /// The weights of the pixels on the left and on the right, times Gauss's.
    left: [f64; 8],
    right: [f64; 8],
}

/// A map ready for quadrature on its cells.
#[derive(Debug)]
pub(super) struct Cells {
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
    /// The pixels without the bright pixels.
    rest: Vec<[f64; 3]>,
    /// (cos ψ, sin ψ) of the columns' centres.
    centres: Vec<(f64, f64)>,
    /// For 2, 4, 8, … parts: a pattern for every two of them.
    patterns: Vec<Vec<Pattern>>,
    nodes: [f64; NODES],
    weights: [f64; NODES],
}

impl Cells {
    /// A map, and its pixels without the bright pixels.
    pub(super) fn new(map: &EnvironmentMap, rest: Vec<[f64; 3]>) -> Self {
        let rule = Rule::gauss_legendre(NODES).expect("four nodes are allowed");
        // From −1 up to 1.
        let nodes: [f64; NODES] = std::array::from_fn(|index| -rule.nodes[index]);
        let weights: [f64; NODES] = std::array::from_fn(|index| rule.weights[index]);
        let step = TAU / map.width() as f64;
        let patterns = (1..=MAX_DOUBLINGS)
            .map(|doublings| {
                let parts = 1usize << doublings;
                (0..parts / 2)
                    .map(|pair| {
                        let at = |lane: usize| {
                            let part = 2 * pair + lane / NODES;
                            (part as f64 + 0.5 + 0.5 * nodes[lane % NODES]) / parts as f64
                        };
                        let weight =
                            |lane: usize| 0.5 * step / parts as f64 * weights[lane % NODES];
                        Pattern {
                            cos: std::array::from_fn(|lane| (step * at(lane)).cos()),
                            sin: std::array::from_fn(|lane| (step * at(lane)).sin()),
                            left: std::array::from_fn(|lane| weight(lane) * (1.0 - at(lane))),
                            right: std::array::from_fn(|lane| weight(lane) * at(lane)),
                        }
                    })
                    .collect()
            })
            .collect();
        Self {
            width: map.width(),
            height: map.height(),
            pixels: map.pixels().to_vec(),
            rest,
            centres: (0..map.width())
                .map(|column| {
                    let (sin, cos) = (step * (column as f64 + 0.5)).sin_cos();
                    (cos, sin)
                })
                .collect(),
            patterns,
            nodes,
            weights,
        }
    }

    /// How often a cell must be halved so that its parts are no larger than `size`; none if that is
    /// too often.
    pub(super) fn doublings(&self, size: f64) -> Option<u32> {
        let parts = (PI / self.height as f64 / size).max(2.0);
        let doublings = parts.log2().ceil() as u32;
        (doublings <= MAX_DOUBLINGS).then_some(doublings)
    }

    /// The size of the parts of a cell that is halved so often.
    pub(super) fn part(&self, doublings: usize) -> f64 {
        PI / self.height as f64 / (1usize << doublings) as f64
    }

    /// ∫ K L dω over a region for a part K of a lobe, with the cells halved `doublings` times.
    #[inline(always)]
    pub(super) fn integrate<S: Simd>(
        &self,
        simd: S,
        doublings: u32,
        light: Light,
        lobe: &LobeAt,
        region: &Region,
        part: Part,
    ) -> [f64; 3] {
        let pixels = match light {
            Light::All => &self.pixels,
            Light::WithoutBrightPixels => &self.rest,
        };
        let parts = 1usize << doublings;
        let strips = self.height * parts;
        let strip = PI / strips as f64;
        let mut sums = [f64x8::splat(simd, 0.0); 3];
        let rows = region.rows(strips);
        // The nodes of two strips are eight rows.
        let turn = |sin: f64, cos: f64, (more_sin, more_cos): (f64, f64)| {
            (
                sin * more_cos + cos * more_sin,
                cos * more_cos - sin * more_sin,
            )
        };
        let offsets = self.nodes.map(|node| (0.5 * node * strip).sin_cos());
        let next = strip.sin_cos();
        let (mut sin, mut cos) = ((rows.start as f64 + 0.5) * strip).sin_cos();
        let (mut sines, mut cosines) = ([0.0; 8], [0.0; 8]);
        let shape = Shape::<f64x8<S>>::new(simd, lobe);
        let mut arcs = region.arcs(simd, &sines, &cosines);
        let mut eight = EightRows::new::<S, f64x8<S>>(lobe, &sines, &cosines);
        for (count, index) in rows.enumerate() {
            if count % 2 == 0 {
                for half in [0, NODES] {
                    for (node, &offset) in offsets.iter().enumerate() {
                        (sines[half + node], cosines[half + node]) = turn(sin, cos, offset);
                    }
                    (sin, cos) = turn(sin, cos, next);
                }
                arcs = region.arcs(simd, &sines, &cosines);
                eight = EightRows::new::<S, f64x8<S>>(lobe, &sines, &cosines);
            }
            // Where the strip lies between the rows of pixel centres.
            let place = (index as f64 + 0.5) / parts as f64 - 0.5;
            let above = self.row(place.floor() as isize);
            let below = self.row(place.floor() as isize + 1);
            for (node, weight) in self.weights.into_iter().enumerate() {
                let lane = node + NODES * (count % 2);
                let sin = sines[lane];
                let fraction = (index as f64 + 0.5 + 0.5 * self.nodes[node]) / parts as f64
                    - 0.5
                    - place.floor();
                let weight = 0.5 * strip * weight * sin;
                let (upper, lower) = (weight * (1.0 - fraction), weight * fraction);
                // Near the poles the cells are slim.
                let slim = ((parts as f64 * sin).log2().ceil().max(1.0) as u32).min(doublings);
                let patterns = &self.patterns[slim as usize - 1];
                let blocks = self.width * patterns.len();
                let runs = region.runs(&arcs, lane, blocks, 0.5 * TAU / self.width as f64);
                if runs[0].1 == 0 {
                    continue;
                }
                let lobe = RowLobe::new(simd, shape, &eight, lane);
                let value_at = |column: usize| {
                    let a = pixels[above.0 + (column + above.1) % self.width];
                    let b = pixels[below.0 + (column + below.1) % self.width];
                    std::array::from_fn::<f64, 3, _>(|channel| {
                        upper * a[channel] + lower * b[channel]
                    })
                };
                let mut column = usize::MAX;
                let (mut left, mut right) = ([0.0; 3], [0.0; 3]);
                let (mut centre_cos, mut centre_sin) = (0.0, 0.0);
                for block in runs
                    .into_iter()
                    .flat_map(|(first, count)| first..first + count)
                {
                    let block = if block < blocks {
                        block
                    } else {
                        block - blocks
                    };
                    if block / patterns.len() != column {
                        column = block / patterns.len();
                        left = value_at(column);
                        right = value_at(column + 1);
                        (centre_cos, centre_sin) = self.centres[column];
                    }
                    let pattern = &patterns[block % patterns.len()];
                    let load = |values: &[f64; 8]| f64x8::from_slice(simd, values);
                    let splat = |value| f64x8::splat(simd, value);
                    let (c, s) = (load(&pattern.cos), load(&pattern.sin));
                    let [value, _] = lobe.evaluate(
                        simd,
                        c * splat(centre_cos) - s * splat(centre_sin),
                        s * splat(centre_cos) + c * splat(centre_sin),
                        part,
                    );
                    let (a, b) = (value * load(&pattern.left), value * load(&pattern.right));
                    for channel in 0..3 {
                        sums[channel] = a.mul_add(
                            splat(left[channel]),
                            b.mul_add(splat(right[channel]), sums[channel]),
                        );
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

    /// Where a row's pixels start and by how many columns it is turned: beyond a pole, half a turn.
    fn row(&self, row: isize) -> (usize, usize) {
        if row < 0 {
            (0, self.width / 2)
        } else if row as usize >= self.height {
            ((self.height - 1) * self.width, self.width / 2)
        } else {
            (row as usize * self.width, 0)
        }
    }
}
