//! A lobe along the horizon, on lines of equal height over it.
//!
//! Grids of the map know nothing of a surface's horizon, nor of a grazing lobe's shape, which is
//! longer than it is wide by 1/cos θ_o. In the light's height c = n·ω and its azimuth a about the
//! normal both are simple: the horizon is c = 0, dω = dc da, and on a line of equal c the lobe is
//! about a Gaussian in a. So: Gauss's rule in c on parts that grow with c + cos θ_o, which is what
//! the lobe varies over; on each line equal steps in tan(a/4), which need no trigonometry; and at
//! each point the map itself. What is left is the kinks of the map between its pixels, whose errors
//! fall as the square of the spacing.

use std::f64::consts::PI;

use fearless_simd::{f32x4, f32x8, f32x16, prelude::*, u32x16};
use glam::DVec3;

use super::kernel::{LineLobe, LobeAt, Shape, smooth_step};
use crate::sphere::Rule;

/// Nodes of a part in height.
const NODES: usize = 8;

/// Points that are evaluated together, in single precision: directions are then good to 2·10⁻⁵ of a
/// pixel of 512 × 256.
const LANES: usize = 16;

/// The longest part, over σ: the lobe's standard deviation in the light's angle is √2 σ.
const LONGEST: f64 = 2.8;

/// The longest part, in rows of the map, so that a node in its middle is 0.7 rows from the next:
/// with 8 rows one point in a thousand of those within 24° of grazing passed a tolerance of 10⁻³ at
/// σ = 0.03, by up to 5 times, and no time was saved.
const PIXELS: f64 = 4.0;

/// How many times as far from −cos θ_o parts end as they begin.
const GROWTH: f64 = 3.0;

/// How many times as many lines and points finer sums have.
pub(super) const FINER: f64 = 1.0 / 0.7;

/// The longest step in azimuth, over the lobe's standard deviation there: Poisson's sum says
/// 2·10⁻⁶.
const STEP: f64 = 1.2;

/// The map, ready for being looked up: with a row beyond each pole and a column beyond each end.
#[derive(Debug)]
pub(super) struct HorizonQuadrature {
    /// The angle between rows.
    step: f64,
    /// Pixels of a row, the two beyond its ends included; the first is that at ψ = −π − ½ step.
    columns: usize,
    /// Three channels and a zero of each pixel.
    pixels: Vec<f32>,
    rule: Rule,
}

impl HorizonQuadrature {
    /// A map of `width` columns.
    pub(super) fn new(map: &[[f64; 3]], width: usize) -> Self {
        let height = map.len() / width;
        let columns = width + 2;
        let mut pixels = Vec::with_capacity(4 * (height + 2) * columns);
        for row in 0..height + 2 {
            let (row, turn) = match row {
                0 => (0, width / 2),
                row if row > height => (height - 1, width / 2),
                row => (row - 1, 0),
            };
            for column in 0..columns {
                let column = (column + width / 2 + width - 1 + turn) % width;
                let [r, g, b] = map[row * width + column];
                pixels.extend([r as f32, g as f32, b as f32, 0.0]);
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

    /// ∫ K (1 − s(c · `recip`)) L dω over the light above the horizon with t²/σ² ≤ `exponent`, s
    /// being the step of [`Part`](super::kernel::Part). Lines and points are as dense as the lobe
    /// itself asks for, and the map's pixels by `spacing`; [`FINER`] times as many for each of
    /// `finer`, and no two sums have the same: those would agree whatever their error.
    #[inline(always)]
    pub(super) fn integrate<S: Simd>(
        &self,
        simd: S,
        lobe: &LobeAt,
        exponent: f64,
        recip: f64,
        spacing: f64,
        finer: u32,
    ) -> [f64; 3] {
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
        let shape = Shape::new(simd, lobe);
        let mut sum = [0.0; 4];
        if lowest >= highest {
            return [0.0; 3];
        }
        let pixel = spacing * self.step;
        // Parts three times as far from −cos θ_o where they end as where they begin, as long as
        // they are not too long.
        let longest = (LONGEST * sigma).min(PIXELS * pixel);
        let bend = (longest / GROWTH.ln() - lobe.cosine).clamp(lowest, highest);
        let first = lowest + lobe.cosine;
        let growing = ((bend + lobe.cosine) / first).log(GROWTH);
        let all = growing + (highest - bend) / longest;
        let parts = more(all.ceil(), finer);
        let end_of = |part: usize| {
            let at = all * part as f64 / parts as f64;
            if at < growing {
                first * GROWTH.powf(at) - lobe.cosine
            } else {
                bend + longest * (at - growing)
            }
        };
        // As many blocks as on coarser lines may do, but not with the same points.
        let phase = [0.5, 0.0, 0.25, 0.75][finer as usize % 4];
        let mut low = lowest;
        for part in 1..=parts {
            let high = end_of(part);
            let length = high - low;
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
                // Round the normal, if need be; the step leaves a kink at its back, which costs a
                // sixth of the step's square.
                let end = if end > -swing { end / swing } else { -1.0 };
                let end = (0.5 * (1.0 - end)).sqrt() / (1.0 + (0.5 * (1.0 + end)).sqrt());
                let deviation = sum_of_heights * sigma / (2.0 * swing).sqrt();
                let step = 0.25 * (STEP * deviation).min(pixel / across);
                let points = 2.0 * end / step * FINER.powi(finer as i32);
                let line = Line {
                    up: height * lobe.normal,
                    forward: across * forward,
                    aside: across * aside,
                    end,
                    blocks: (points / LANES as f64).ceil() as usize,
                    phase,
                };
                let lobe = LineLobe::new(simd, shape, lobe, height, swing);
                self.line(simd, &line, &lobe, weight, &mut sum);
            }
            low = high;
        }
        [sum[0], sum[1], sum[2]]
    }

    /// Adds `weight` times ∫ K L da along a line.
    #[inline(always)]
    fn line<S: Simd>(
        &self,
        simd: S,
        line: &Line,
        lobe: &LineLobe<f32x16<S>>,
        weight: f64,
        sum: &mut [f64; 4],
    ) {
        let splat = |value: f64| f32x16::splat(simd, value as f32);
        let one = splat(1.0);
        let step = 2.0 * line.end / (LANES * line.blocks) as f64;
        let mut lanes = [0.0; LANES];
        for (lane, value) in lanes.iter_mut().enumerate() {
            *value = ((lane as f64 + line.phase) * step) as f32;
        }
        let lanes = f32x16::from_slice(simd, &lanes);
        let scale = splat(1.0 / self.step);
        // The first pixel of a row is one before ψ = −π.
        let across = splat(0.5 * self.columns as f64 - 0.5);
        let weight = splat(4.0 * step * weight);
        // Of the pixels on the left and of those on the right; four, so that none waits for
        // another.
        let mut pixels = [f32x8::splat(simd, 0.0); 4];
        for block in 0..line.blocks {
            let tangent = lanes + splat((LANES * block) as f64 * step - line.end);
            let square = tangent * tangent;
            let recip = one / (one + square);
            // Of half the azimuth, and of all of it.
            let (cos, sin) = ((one - square) * recip, (tangent + tangent) * recip);
            let square = sin * sin;
            let value = lobe.evaluate(simd, square) * recip * weight;
            let (cos, sin) = (one - (square + square), (sin + sin) * cos);
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
            self.look_up(simd, row, column, value, &mut pixels);
        }
        let pixels = (pixels[0] + pixels[1]) + (pixels[2] + pixels[3]);
        let mut both = [0.0; 8];
        pixels.store_slice(&mut both);
        for channel in 0..4 {
            sum[channel] += f64::from(both[channel]) + f64::from(both[channel + 4]);
        }
    }

    /// Adds `value` times the map at some places, counted from the first pixel: between four of
    /// them, those on the left in the first half of `pixels`, those on the right in the second.
    #[inline(always)]
    fn look_up<S: Simd>(
        &self,
        simd: S,
        row: f32x16<S>,
        column: f32x16<S>,
        value: f32x16<S>,
        pixels: &mut [f32x8<S>; 4],
    ) {
        let splat = |value: usize| f32x16::splat(simd, value as f32);
        let zero = splat(0);
        let last_row = splat(self.pixels.len() / (4 * self.columns) - 2);
        let last_column = splat(self.columns - 2);
        let columns = u32x16::splat(simd, self.columns as u32);
        let store = |lanes: f32x16<S>| {
            let mut values = [0.0; LANES];
            lanes.store_slice(&mut values);
            values
        };
        // Which pixels, and where between them.
        let top = row.max(zero).min(last_row).floor();
        let left = column.max(zero).min(last_column).floor();
        let (down, along) = (store(row - top), column - left);
        let right = value * along;
        let (left_weights, right_weights) = (store(value - right), store(right));
        let mut places = [0; LANES];
        let place = top.to_int::<u32x16<S>>() * columns + left.to_int::<u32x16<S>>();
        (place << 2).store_slice(&mut places);
        let next = 4 * self.columns;
        for lanes in 0..LANES / 4 {
            for (lane, pixels) in pixels.iter_mut().enumerate() {
                let lane = 4 * lanes + lane;
                let at = places[lane] as usize;
                let above = f32x8::from_slice(simd, &self.pixels[at..at + 8]);
                let below = f32x8::from_slice(simd, &self.pixels[at + next..at + next + 8]);
                let weight = f32x4::splat(simd, left_weights[lane])
                    .combine(f32x4::splat(simd, right_weights[lane]));
                let between = (below - above).mul_add(f32x8::splat(simd, down[lane]), above);
                *pixels = between.mul_add(weight, *pixels);
            }
        }
    }
}

/// How many of a whole number `count` of parts there are for finer lines: each time at least one
/// more.
#[inline(always)]
fn more(count: f64, finer: u32) -> usize {
    let wanted = (count * FINER.powi(finer as i32)).max(count + f64::from(finer));
    wanted.ceil() as usize
}

/// Directions of equal height, as they follow from the azimuth: `up` + cos a `forward` + sin a
/// `aside`.
struct Line {
    up: DVec3,
    forward: DVec3,
    aside: DVec3,
    /// tan(a/4) where it ends, on both sides.
    end: f64,
    /// Blocks of [`LANES`] points, and how far the first point is from the end, over the step.
    blocks: usize,
    phase: f64,
}

/// atan2 to 3·10⁻⁷: Abramowitz and Stegun 4.4.49 on the smaller over the larger.
#[inline(always)]
fn arc_tangent<S: Simd>(simd: S, y: f32x16<S>, x: f32x16<S>) -> f32x16<S> {
    let splat = |value: f64| f32x16::splat(simd, value as f32);
    let zero = splat(0.0);
    let (far, wide) = (x.abs(), y.abs());
    let large = far.max(wide).max(splat(f64::from(f32::MIN_POSITIVE)));
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
                let lanes = |value: f64| f32x16::splat(simd, 3.0 * value as f32);
                let value = arc_tangent(simd, lanes(y), lanes(x));
                let mut lanes = [0.0; LANES];
                value.store_slice(&mut lanes);
                f64::from(lanes[3])
            });
            assert!((got - angle).abs() < 5e-7, "{angle}: {got}");
        }
    }

    #[test]
    fn counts_grow_each_time() {
        for count in 1..200 {
            for finer in 0..10 {
                let count = f64::from(count);
                assert!(
                    more(count, finer) < more(count, finer + 1),
                    "{count}, {finer}"
                );
            }
        }
    }

    #[test]
    fn looked_up_is_the_map() {
        use crate::illumination::EnvironmentMap;
        use crate::sphere::to_map;
        use rand::{RngExt, SeedableRng};
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let pixels: Vec<[f64; 3]> = (0..32 * 16)
            .map(|_| std::array::from_fn(|_| random.random()))
            .collect();
        let strip = HorizonQuadrature::new(&pixels, 32);
        let map = EnvironmentMap::new("noise", 32, 16, pixels).expect("the map is well formed");
        for index in 0..2000 {
            let mut unit = || random.random::<f64>() - 0.5;
            let world = DVec3::new(unit(), unit(), unit()).normalize();
            let at = to_map(world);
            let row = at.x.hypot(at.y).atan2(at.z) / strip.step + 0.5;
            let column = at.y.atan2(at.x) / strip.step + 0.5 * strip.columns as f64 - 0.5;
            let got = dispatch!(vectors::level(), simd => {
                let splat = |value: f64| f32x16::splat(simd, value as f32);
                let mut one = [0.0; LANES];
                one[index % LANES] = 2.0;
                let one = f32x16::from_slice(simd, &one);
                let mut pixels = [f32x8::splat(simd, 0.0); 4];
                strip.look_up(simd, splat(row), splat(column), one, &mut pixels);
                let mut sum = [0.0; 8];
                let all = (pixels[0] + pixels[1]) + (pixels[2] + pixels[3]);
                all.store_slice(&mut sum);
                sum
            });
            let want = map.radiance(world);
            for channel in 0..3 {
                let got = f64::from(got[channel]) + f64::from(got[channel + 4]);
                assert!((got - 2.0 * want[channel]).abs() < 2e-5);
            }
        }
    }
}
