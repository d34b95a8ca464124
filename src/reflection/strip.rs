//! A lobe along the horizon, on lines of equal height over it.
//!
//! Grids of the map know nothing of a surface's horizon, nor of a grazing lobe's shape, which is longer than it is wide by
//! 1/cos θ_o. In the light's height c = n·ω and its azimuth a about the normal both are simple: the horizon is c = 0, dω = dc da, and
//! on a line of equal c the lobe is about a Gaussian in a. So: Gauss's rule in c on parts that grow with c + cos θ_o, which is what
//! the lobe varies over; on each line equal steps in tan(a/2), which need no trigonometry; and at each point the map itself. What is
//! left is the kinks of the map between its pixels, whose errors fall as the square of the spacing.

use std::f64::consts::PI;

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::kernel::{LineLobe, LobeAt, smooth_step};
use crate::sphere::Rule;

/// Nodes of a part in height.
const NODES: usize = 8;

/// The longest part, over σ: the lobe's standard deviation in the light's angle is √2 σ.
const LONGEST: f64 = 2.8;

/// The longest step in azimuth, over the lobe's standard deviation there: Poisson's sum says 2·10⁻⁶.
const STEP: f64 = 1.2;

/// A lobe is given up if a line goes round the normal farther than to this cosine.
const ROUND: f64 = -0.5;

/// The map, ready for being looked up: with a row beyond each pole and a column beyond each end.
#[derive(Debug)]
pub(super) struct Strip {
    /// The angle between rows.
    step: f64,
    /// Pixels of a row, the two beyond its ends included; the first is that at ψ = −π − ½ step.
    columns: usize,
    pixels: Vec<[f32; 4]>,
    rule: Rule,
}

impl Strip {
    /// A map of `width` columns.
    pub(super) fn new(map: &[[f64; 3]], width: usize) -> Self {
        let height = map.len() / width;
        let columns = width + 2;
        let mut pixels = Vec::with_capacity((height + 2) * columns);
        for row in 0..height + 2 {
            let (row, turn) = match row {
                0 => (0, width / 2),
                row if row > height => (height - 1, width / 2),
                row => (row - 1, 0),
            };
            for column in 0..columns {
                let column = (column + width / 2 + width - 1 + turn) % width;
                let [r, g, b] = map[row * width + column];
                pixels.push([r as f32, g as f32, b as f32, 0.0]);
            }
        }
        Self {
            step: PI / height as f64,
            columns,
            pixels,
            rule: Rule::gauss_legendre(NODES).expect("eight nodes are allowed"),
        }
    }

    /// The angle between the map's rows.
    pub(super) fn pixel(&self) -> f64 {
        self.step
    }

    /// ∫ K (1 − s(c · `recip`)) L dω over the light above the horizon with t²/σ² ≤ `exponent`, s being the step of
    /// [`Part`](super::kernel::Part), on 1/`fineness` times as many lines and points as the lobe itself and the map's pixels ask for; none if the lobe
    /// goes round its normal.
    #[inline(always)]
    pub(super) fn integrate<S: Simd>(
        &self,
        simd: S,
        lobe: &LobeAt,
        exponent: f64,
        recip: f64,
        fineness: f64,
    ) -> Option<[f64; 3]> {
        let sigma = lobe.sharpness.recip().sqrt();
        let tilt_sine = (1.0 - lobe.cosine * lobe.cosine).max(0.0).sqrt();
        // Away from the viewer, and across.
        let forward = -lobe.forward;
        let aside = -lobe.aside;
        // Twice the angle between half vector and normal, at the most.
        let reach = 2.0 * (sigma * exponent.sqrt()).atan();
        let elevation = lobe.cosine.min(1.0).asin();
        let lowest = (elevation - reach).max(0.0).sin();
        let mut highest = (elevation + reach).min(0.5 * PI).sin();
        if recip > 0.0 {
            highest = highest.min(1.0 / recip);
        }
        let mut sum = [0.0; 4];
        let mut low = lowest;
        while low < highest {
            let length = (2.0 * (low + lobe.cosine))
                .min(LONGEST * sigma)
                .min(NODES as f64 * self.step)
                * fineness;
            // No crumbs at the end.
            let left = highest - low;
            let length = if length > 0.75 * left { left } else { length };
            for (node, weight) in self.rule.nodes.iter().zip(&self.rule.weights) {
                let part = 0.5 + 0.5 * node;
                let (height, weight) = if low == 0.0 {
                    // The root in Ward's lobe of 1992 is smooth in the root of the height.
                    (length * part * part, length * part * weight)
                } else {
                    (low + length * part, 0.5 * length * weight)
                };
                let weight = weight * (1.0 - smooth_step(height * recip));
                let across = (1.0 - height * height).max(0.0).sqrt();
                let sum_of_heights = height + lobe.cosine;
                let farthest =
                    0.5 * (1.0 + sigma * sigma * exponent) * sum_of_heights * sum_of_heights;
                let swing = across * tilt_sine;
                let end = 1.0 + height * lobe.cosine - farthest;
                if end >= swing {
                    continue;
                }
                if end < ROUND * swing {
                    return None;
                }
                let end = end / swing;
                let end = ((1.0 - end) / (1.0 + end)).sqrt();
                let deviation = sum_of_heights * sigma / (2.0 * swing).sqrt();
                let step = 0.5 * (STEP * deviation).min(self.step / across) * fineness;
                let blocks = (2.0 * end / (8.0 * step)).ceil();
                let line = Line {
                    up: height * lobe.normal,
                    forward: across * forward,
                    aside: across * aside,
                    end,
                    blocks: blocks as usize,
                };
                let lobe = LineLobe::new(simd, lobe, height, swing);
                self.line(simd, &line, &lobe, weight, &mut sum);
            }
            low += length;
        }
        Some([sum[0], sum[1], sum[2]])
    }

    /// Adds `weight` times ∫ K L da along a line.
    #[inline(always)]
    fn line<S: Simd>(
        &self,
        simd: S,
        line: &Line,
        lobe: &LineLobe<S>,
        weight: f64,
        sum: &mut [f64; 4],
    ) {
        let splat = |value| f64x8::splat(simd, value);
        let one = splat(1.0);
        let step = 2.0 * line.end / (8 * line.blocks) as f64;
        let lanes: [f64; 8] = std::array::from_fn(|lane| (lane as f64 + 0.5) * step - line.end);
        let mut tangent = f64x8::from_slice(simd, &lanes);
        let scale = splat(1.0 / self.step);
        // The first pixel of a row is one before ψ = −π.
        let across = splat(0.5 * self.columns as f64 - 0.5);
        let weight = splat(2.0 * step * weight);
        for _ in 0..line.blocks {
            let square = tangent * tangent;
            let recip = one / (one + square);
            let (cos, sin) = ((one - square) * recip, (tangent + tangent) * recip);
            let value = lobe.evaluate(simd, cos) * recip * weight;
            let along = |up: f64, forward: f64, aside: f64| {
                cos.mul_add(splat(forward), sin.mul_add(splat(aside), splat(up)))
            };
            let x = along(line.up.x, line.forward.x, line.aside.x);
            let y = along(line.up.y, line.forward.y, line.aside.y);
            let z = along(line.up.z, line.forward.z, line.aside.z);
            let ring = x.mul_add(x, y * y).sqrt();
            // One row is beyond the pole.
            let row = arc_tangent(simd, ring, z).mul_add(scale, splat(0.5));
            let column = arc_tangent(simd, y, x).mul_add(scale, across);
            let (mut rows, mut columns, mut values) = ([0.0; 8], [0.0; 8], [0.0; 8]);
            row.store_slice(&mut rows);
            column.store_slice(&mut columns);
            value.store_slice(&mut values);
            for lane in 0..8 {
                let pixel = self.look_up(rows[lane], columns[lane]);
                for channel in 0..4 {
                    sum[channel] += values[lane] * f64::from(pixel[channel]);
                }
            }
            tangent += splat(8.0 * step);
        }
    }

    /// Between four pixels, at a place counted from the first.
    #[inline(always)]
    fn look_up(&self, row: f64, column: f64) -> [f32; 4] {
        let rows = self.pixels.len() / self.columns;
        let top = (row.max(0.0) as usize).min(rows - 2);
        let left = (column.max(0.0) as usize).min(self.columns - 2);
        let (down, along) = ((row - top as f64) as f32, (column - left as f64) as f32);
        let at = top * self.columns + left;
        let (above, below) = (
            &self.pixels[at..at + 2],
            &self.pixels[at + self.columns..at + self.columns + 2],
        );
        std::array::from_fn(|channel| {
            let upper = above[0][channel] + along * (above[1][channel] - above[0][channel]);
            let lower = below[0][channel] + along * (below[1][channel] - below[0][channel]);
            upper + down * (lower - upper)
        })
    }
}

/// Directions of equal height, as they follow from the azimuth: `up` + cos a `forward` + sin a `aside`.
struct Line {
    up: DVec3,
    forward: DVec3,
    aside: DVec3,
    /// tan(a/2) where it ends, on both sides.
    end: f64,
    /// Blocks of eight points.
    blocks: usize,
}

/// atan2 to 2·10⁻⁸: Abramowitz and Stegun 4.4.49 on the smaller over the larger.
#[inline(always)]
fn arc_tangent<S: Simd>(simd: S, y: f64x8<S>, x: f64x8<S>) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    let zero = splat(0.0);
    let (far, wide) = (x.abs(), y.abs());
    let large = far.max(wide).max(splat(f64::MIN_POSITIVE));
    let ratio = far.min(wide) / large;
    let square = ratio * ratio;
    let mut sum = splat(0.002_866_225_7);
    for coefficient in [
        -0.016_165_736_7,
        0.042_909_613_8,
        -0.075_289_640_0,
        0.106_562_639_3,
        -0.142_088_994_4,
        0.199_935_508_5,
        -0.333_331_452_8,
        1.0,
    ] {
        sum = sum.mul_add(square, splat(coefficient));
    }
    let angle = sum * ratio;
    let angle = far.simd_lt(wide).select(splat(0.5 * PI) - angle, angle);
    let angle = x.simd_lt(zero).select(splat(PI) - angle, angle);
    y.simd_lt(zero).select(zero - angle, angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors;
    use fearless_simd::dispatch;

    #[test]
    fn the_arc_tangent_is_that_of_the_standard_library() {
        for index in 0..1000 {
            let angle = PI * (f64::from(index) + 0.5) / 500.0 - PI;
            let (y, x) = angle.sin_cos();
            let got = dispatch!(vectors::level(), simd => {
                let value = arc_tangent(simd, f64x8::splat(simd, 3.0 * y), f64x8::splat(simd, 3.0 * x));
                let mut lanes = [0.0; 8];
                value.store_slice(&mut lanes);
                lanes[3]
            });
            assert!((got - angle).abs() < 2.5e-8, "{angle}: {got}");
        }
    }

    #[test]
    fn looked_up_is_the_map() {
        use crate::illumination::EnvironmentMap;
        use crate::reflection::kernel::to_map;
        use rand::{RngExt, SeedableRng};
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let pixels: Vec<[f64; 3]> = (0..32 * 16)
            .map(|_| std::array::from_fn(|_| random.random()))
            .collect();
        let strip = Strip::new(&pixels, 32);
        let map = EnvironmentMap::new("noise", 32, 16, pixels).expect("the map is well formed");
        for _ in 0..2000 {
            let mut unit = || random.random::<f64>() - 0.5;
            let world = DVec3::new(unit(), unit(), unit()).normalize();
            let at = to_map(world);
            let row = at.x.hypot(at.y).atan2(at.z) / strip.step + 0.5;
            let column = at.y.atan2(at.x) / strip.step + 0.5 * strip.columns as f64 - 0.5;
            let (got, want) = (strip.look_up(row, column), map.radiance(world));
            for channel in 0..3 {
                assert!((f64::from(got[channel]) - want[channel]).abs() < 1e-5);
            }
        }
    }
}
