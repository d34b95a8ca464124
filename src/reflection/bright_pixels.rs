//! The brightest pixels, each integrated by itself as the bilinear hat that it stands for.
//!
//! A sun makes a lobe's integral jump where it sets behind the surface's horizon, and no grid is
//! fine enough for that. Taken out of the map and summed here, with the horizon cut through its
//! hat, it leaves a map that grids do resolve.

use std::f64::consts::PI;

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::hat::{Hat, halves};
use super::kernel::{LobeAt, PointLobe};
use crate::illumination::EnvironmentMap;
use crate::sphere::{Rule, to_map};

/// A pixel is bright if it holds more than this share of all light.
const SHARE: f64 = 5e-4;

/// At most so many bright pixels.
const MOST: usize = 64;

/// Points each way of the rules on a hat, and the largest size of a pixel, over the width of a
/// lobe, that they do for.
const RULES: [(usize, f64); 4] = [(2, 0.2), (4, 0.5), (8, 1.5), (16, f64::INFINITY)];

/// A bright pixel.
#[derive(Debug)]
struct BrightPixel {
    axis: DVec3,
    /// The angles of its middle.
    theta: f64,
    psi: f64,
    light: [f64; 3],
}

/// The points of all bright pixels, one pixel after the other.
#[derive(Debug)]
struct Points {
    /// Points each way.
    side: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    /// The solid angles times the light of each channel.
    light: [Vec<f64>; 3],
}

/// Which part of the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Light {
    All,
    WithoutBrightPixels,
}

/// The bright pixels of a map.
#[derive(Debug)]
pub(super) struct BrightPixels {
    /// The angle between the map's rows.
    step: f64,
    pixels: Vec<BrightPixel>,
    points: Vec<Points>,
    /// Gauss's rules for a part of a hat: for wide lobes and for narrow ones.
    gauss: [Rule; 2],
}

impl BrightPixels {
    /// The bright pixels of a map, and the map's pixels without them.
    pub(super) fn take(map: &EnvironmentMap) -> (Self, Vec<[f64; 3]>) {
        let (width, height) = (map.width(), map.height());
        let step = PI / height as f64;
        let mut pixels = map.pixels().to_vec();
        let mass =
            |index: usize| map.pixels()[index].iter().sum::<f64>() * map.solid_angle(index / width);
        let total: f64 = (0..width * height).map(mass).sum();
        let mut bright: Vec<usize> = (0..width * height)
            .filter(|&index| mass(index) > SHARE * total)
            // The hats of the first and the last row go round the poles.
            .filter(|&index| (1..height - 1).contains(&(index / width)))
            .collect();
        bright.sort_by(|&a, &b| mass(b).total_cmp(&mass(a)).then(a.cmp(&b)));
        bright.truncate(MOST);
        let taken: Vec<BrightPixel> = bright
            .iter()
            .map(|&index| BrightPixel {
                axis: to_map(map.direction(index / width, index % width)),
                theta: step * ((index / width) as f64 + 0.5),
                psi: step * ((index % width) as f64 + 0.5),
                light: std::mem::take(&mut pixels[index]),
            })
            .collect();
        let points = RULES
            .iter()
            .map(|&(side, _)| {
                let rule = hat_rule(side);
                let mut points = Points {
                    side,
                    x: Vec::new(),
                    y: Vec::new(),
                    z: Vec::new(),
                    light: Default::default(),
                };
                for pixel in &taken {
                    for &(down, down_weight) in &rule {
                        for &(along, along_weight) in &rule {
                            let theta = pixel.theta + down * step;
                            let at = direction(theta, pixel.psi + along * step);
                            points.x.push(at.x);
                            points.y.push(at.y);
                            points.z.push(at.z);
                            let weight = step * step * down_weight * along_weight * theta.sin();
                            for channel in 0..3 {
                                points.light[channel].push(weight * pixel.light[channel]);
                            }
                        }
                    }
                }
                // Whole blocks of eight.
                while !points.x.len().is_multiple_of(8) {
                    for values in [&mut points.x, &mut points.y] {
                        values.push(0.0);
                    }
                    points.z.push(1.0);
                    for values in &mut points.light {
                        values.push(0.0);
                    }
                }
                points
            })
            .collect();
        let taken = Self {
            step,
            pixels: taken,
            points,
            gauss: [3, 8].map(|nodes| Rule::gauss_legendre(nodes).expect("few nodes are allowed")),
        };
        (taken, pixels)
    }

    /// Whether the hat of any bright pixel is nearer than `reach` to `centre`.
    pub(super) fn any(&self, centre: DVec3, reach: f64) -> bool {
        let far = (reach + 1.5 * self.step).min(PI).cos();
        self.pixels
            .iter()
            .any(|pixel| pixel.axis.dot(centre) >= far)
    }

    /// ∫ K L dω over the bright pixels for a lobe K that is `narrow` wide and nothing farther than
    /// `reach` from `centre`, to about 10⁻³, or with a finer rule by `more`.
    #[inline(always)]
    pub(super) fn integrate<S: Simd>(
        &self,
        simd: S,
        lobe: &LobeAt,
        centre: DVec3,
        reach: f64,
        narrow: f64,
        more: usize,
    ) -> [f64; 3] {
        if self.pixels.is_empty() {
            return [0.0; 3];
        }
        let size = self.step / narrow;
        let rule = RULES
            .iter()
            .position(|&(_, limit)| size <= limit)
            .map_or(RULES.len() - 1, |rule| (rule + more).min(RULES.len() - 1));
        let points = &self.points[rule];
        let gauss = &self.gauss[usize::from(size > 0.3)];
        let each = points.side * points.side;
        let far = (reach + 1.5 * self.step).min(PI).cos();
        let near = 1.5 * self.step;
        let point_lobe = PointLobe::new(simd, lobe);
        let mut sums = [f64x8::splat(simd, 0.0); 3];
        let mut total = [0.0; 3];
        // As many pixels as make a whole block, or the blocks of one pixel.
        let group = (8 / each).max(1);
        let blocks = (group * each) / 8;
        for (index, taken) in self.pixels.chunks(group).enumerate() {
            let mut seen = false;
            let mut cut = false;
            for pixel in taken {
                let height = lobe.normal.dot(pixel.axis);
                if height > -near && pixel.axis.dot(centre) >= far {
                    seen = true;
                    cut |= height < near;
                }
            }
            if !seen {
                continue;
            }
            if cut {
                for pixel in taken {
                    let hat = Hat::new(self.step, pixel.theta, pixel.psi);
                    let value =
                        hat.above_the_horizon(lobe.normal, gauss, |light| lobe.value(light));
                    for channel in 0..3 {
                        total[channel] += value * pixel.light[channel];
                    }
                }
                continue;
            }
            for block in 0..blocks {
                let at = 8 * (index * blocks + block);
                let load = |values: &[f64]| f64x8::from_slice(simd, &values[at..at + 8]);
                let value =
                    point_lobe.evaluate(simd, load(&points.x), load(&points.y), load(&points.z));
                for channel in 0..3 {
                    sums[channel] = value.mul_add(load(&points.light[channel]), sums[channel]);
                }
            }
        }
        std::array::from_fn(|channel| total[channel] + sums[channel].reduce_sum())
    }
}

/// A rule for ∫ (1 − |t|) f(t) dt over [−1, 1].
fn hat_rule(points: usize) -> Vec<(f64, f64)> {
    if points == 2 {
        // Gauss's: the hat's second moment is 1/6.
        let node = (1.0f64 / 6.0).sqrt();
        return vec![(-node, 0.5), (node, 0.5)];
    }
    let rule = Rule::gauss_legendre(points / 2).expect("a few nodes are allowed");
    halves(&rule, -1.0, 1.0)
        .map(|(node, weight)| (node, weight * (1.0 - node.abs())))
        .collect()
}

/// A direction of the map's frame.
fn direction(theta: f64, psi: f64) -> DVec3 {
    let (sin, cos) = theta.sin_cos();
    DVec3::new(sin * psi.cos(), sin * psi.sin(), cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_of_a_hat_are_exact_for_cubes() {
        for (points, _) in RULES {
            let rule = hat_rule(points);
            let moment = |power: i32| -> f64 { rule.iter().map(|(t, w)| w * t.powi(power)).sum() };
            assert!((moment(0) - 1.0).abs() < 1e-14, "{points}");
            assert!((moment(2) - 1.0 / 6.0).abs() < 1e-14, "{points}");
            assert!(moment(3).abs() < 1e-14, "{points}");
        }
    }
}
