//! Irradiance to convergence: a tree of the map's pixels, each node with the vector ∫ ω L dω of its light.
//!
//! A node wholly above a surface's horizon gives n · ∫ ω L dω, exactly; one wholly below gives nothing; one that straddles
//! the horizon is opened until what could go wrong with it no longer matters. So a sun costs a few nodes more, on the few
//! normals whose horizon it touches, and no harmonic degree has to be large enough for it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::kernel::to_map;
use crate::illumination::EnvironmentMap;
use crate::sphere::Rule;

/// The light of a block of pixels.
#[derive(Debug, Clone)]
struct Node {
    /// The direction of its middle, and the sine of the angle from there that holds all of it.
    axis: DVec3,
    sin: f64,
    /// ∫ L ω dω of each channel.
    vectors: [DVec3; 3],
    /// ∫ L dω, summed over the channels.
    mass: f64,
}

/// The tree, level by level from single pixels to one node.
#[derive(Debug)]
pub(super) struct IrradianceTree {
    levels: Vec<Vec<Node>>,
    /// Nodes a row at each level.
    widths: Vec<usize>,
    /// Irradiances, summed over the channels, on a coarse grid of normals.
    rough: Vec<f64>,
}

/// Rows of the table of rough irradiances that scales the tolerance.
const TABLE: usize = 12;

/// How much of its light times its size a straddling node can be wrong by, once its spread is modelled.
const MODEL_ERROR: f64 = 0.1;

impl IrradianceTree {
    pub(super) fn new(map: &EnvironmentMap) -> Self {
        let (width, height) = (map.width(), map.height());
        let step = PI / height as f64;
        // ∫ Λ cos δ dδ over a hat of the width of a column.
        let along = step * (0.5 * step).sin().powi(2) / (0.5 * step).powi(2);
        let mut pixels = Vec::with_capacity(width * height);
        for row in 0..height {
            let (across, polar, plain) = hat_moments(row, height);
            for column in 0..width {
                let (sin, cos) = (step * (column as f64 + 0.5)).sin_cos();
                let pixel = map.pixel(row, column);
                let unit = DVec3::new(across * along * cos, across * along * sin, polar * step);
                pixels.push((
                    pixel.map(|value| unit * value),
                    pixel.iter().sum::<f64>() * plain * step,
                ));
            }
        }
        let mut levels = Vec::new();
        let mut widths = Vec::new();
        let (mut columns, mut rows, mut block) = (width, height, 1usize);
        let mut light = pixels;
        loop {
            let mut nodes = Vec::with_capacity(columns * rows);
            for row in 0..rows {
                // The hats reach one pixel beyond the block.
                let top = ((block * row) as f64 - 0.5) * step;
                let bottom = ((block * (row + 1)).min(height) as f64 + 0.5) * step;
                let middle = 0.5 * (top + bottom);
                let widest = if top < 0.5 * PI && bottom > 0.5 * PI {
                    1.0
                } else {
                    top.sin().abs().max(bottom.sin().abs())
                };
                for column in 0..columns {
                    let left = ((block * column) as f64 - 0.5) * step;
                    let right = ((block * (column + 1)).min(width) as f64 + 0.5) * step;
                    let (sin, cos) = (0.5 * (left + right)).sin_cos();
                    let radius = (0.5 * (bottom - top))
                        .hypot(0.5 * (right - left) * widest)
                        .min(PI);
                    let (vectors, mass) = light[row * columns + column];
                    nodes.push(Node {
                        axis: DVec3::new(middle.sin() * cos, middle.sin() * sin, middle.cos()),
                        // A node of half a sphere or more straddles every horizon.
                        sin: if radius < 0.5 * PI { radius.sin() } else { 2.0 },
                        vectors,
                        mass,
                    });
                }
            }
            levels.push(nodes);
            widths.push(columns);
            if columns == 1 && rows == 1 {
                break;
            }
            let (wide, high) = (columns, rows);
            (columns, rows, block) = (columns.div_ceil(2), rows.div_ceil(2), 2 * block);
            let mut merged = vec![([DVec3::ZERO; 3], 0.0); columns * rows];
            for row in 0..high {
                for column in 0..wide {
                    let (vectors, mass) = light[row * wide + column];
                    let target = &mut merged[row / 2 * columns + column / 2];
                    for (sum, vector) in target.0.iter_mut().zip(vectors) {
                        *sum += vector;
                    }
                    target.1 += mass;
                }
            }
            light = merged;
        }
        let mut tree = Self {
            levels,
            widths,
            rough: Vec::new(),
        };
        let mass = tree.levels[tree.levels.len() - 1][0].mass;
        tree.rough = (0..2 * TABLE * TABLE)
            .map(|index| {
                let theta = PI * (index / (2 * TABLE)) as f64 / (TABLE - 1) as f64;
                let psi = PI * (index % (2 * TABLE)) as f64 / TABLE as f64;
                let normal = DVec3::new(
                    theta.sin() * psi.cos(),
                    theta.sin() * psi.sin(),
                    theta.cos(),
                );
                tree.walk(normal, 1e-3 * mass).0.iter().sum()
            })
            .collect();
        tree
    }

    /// The irradiance ∫ max(n·ω, 0) L dω of each channel at a normal of the world, and the error to expect, relative to
    /// the mean of the channels.
    pub(super) fn irradiance(&self, normal: DVec3, tolerance: f64) -> ([f64; 3], f64) {
        let normal = to_map(normal);
        let rough = self.rough(normal);
        let (mut value, mut error) = self.walk(normal, 0.1 * tolerance * rough);
        let mut sum: f64 = value.iter().sum();
        if sum < 0.5 * rough {
            // Darker than the table knows.
            (value, error) = self.walk(normal, 0.05 * tolerance * sum.max(1e-3 * rough));
            sum = value.iter().sum();
        }
        (value, if sum > 0.0 { error / sum } else { 0.0 })
    }

    /// The smallest irradiance of the table about a normal, summed over the channels.
    fn rough(&self, normal: DVec3) -> f64 {
        let theta = normal.z.clamp(-1.0, 1.0).acos() / PI * (TABLE - 1) as f64;
        let psi = normal.y.atan2(normal.x).rem_euclid(TAU) / PI * TABLE as f64;
        let (row, column) = ((theta as usize).min(TABLE - 2), psi as usize);
        let at = |row: usize, column: usize| self.rough[row * 2 * TABLE + column % (2 * TABLE)];
        at(row, column)
            .min(at(row, column + 1))
            .min(at(row + 1, column))
            .min(at(row + 1, column + 1))
    }

    /// The irradiance with every straddling node opened whose error could pass `allowed`, and the error that is left.
    fn walk(&self, normal: DVec3, allowed: f64) -> ([f64; 3], f64) {
        let mut sums = [0.0; 3];
        let mut squares = 0.0;
        let mut stack = [(0u8, 0u32); 64];
        stack[0] = ((self.levels.len() - 1) as u8, 0);
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (level, index) = stack[waiting];
            let (level, index) = (usize::from(level), index as usize);
            let node = &self.levels[level][index];
            let height = normal.dot(node.axis);
            if height <= -node.sin {
                continue;
            }
            if height >= node.sin {
                for (sum, vector) in sums.iter_mut().zip(&node.vectors) {
                    *sum += normal.dot(*vector);
                }
                continue;
            }
            let error = MODEL_ERROR * node.mass * node.sin;
            if level == 0 && error > allowed {
                // A bright pixel on the horizon: its hat point by point.
                let parts = (2.0 * (error / allowed).sqrt()).clamp(2.0, 256.0) as usize;
                let share = self.hat_above(normal, index, parts);
                for (sum, vector) in sums.iter_mut().zip(&node.vectors) {
                    *sum += share * vector.length();
                }
                squares += (error / (parts * parts) as f64).powi(2);
                continue;
            }
            if error <= allowed {
                for (sum, vector) in sums.iter_mut().zip(&node.vectors) {
                    *sum += straddling(normal.dot(*vector), vector.length(), node.sin.min(1.0));
                }
                squares += error * error;
                continue;
            }
            let (columns, wide) = (self.widths[level], self.widths[level - 1]);
            let high = self.levels[level - 1].len() / wide;
            let (row, column) = (2 * (index / columns), 2 * (index % columns));
            for row in row..(row + 2).min(high) {
                for column in column..(column + 2).min(wide) {
                    stack[waiting] = ((level - 1) as u8, (row * wide + column) as u32);
                    waiting += 1;
                }
            }
        }
        (sums, squares.sqrt())
    }
}

impl IrradianceTree {
    /// ∫ max(n·ω, 0) over a pixel's hat, relative to the length of ∫ ω: a midpoint rule of `parts` points a quarter, each way.
    fn hat_above(&self, normal: DVec3, index: usize, parts: usize) -> f64 {
        let width = self.widths[0];
        let step = TAU / width as f64;
        let offset = |point: usize| (point as f64 + 0.5) / parts as f64 - 1.0;
        let (mut above, mut all) = (0.0, DVec3::ZERO);
        for down in 0..2 * parts {
            let theta = ((index / width) as f64 + 0.5 + offset(down)) * step;
            let (sin, cos) = theta.sin_cos();
            let row = (1.0 - offset(down).abs()) * sin.abs();
            for right in 0..2 * parts {
                let psi = ((index % width) as f64 + 0.5 + offset(right)) * step;
                let light = DVec3::new(sin * psi.cos(), sin * psi.sin(), cos);
                let weight = row * (1.0 - offset(right).abs());
                above += weight * normal.dot(light).max(0.0);
                all += weight * light;
            }
        }
        above / all.length()
    }
}

/// ∫ max(h, 0) for light of strength `mass` whose heights are spread evenly about their mean, within 0.6 of the size of the node.
fn straddling(moment: f64, mass: f64, size: f64) -> f64 {
    let spread = 0.6 * size * mass;
    if moment >= spread {
        moment
    } else if moment <= -spread {
        0.0
    } else {
        (moment + spread) * (moment + spread) / (4.0 * spread)
    }
}

/// ∫ Λ_r sin²θ, ∫ Λ_r sin θ cos θ and ∫ Λ_r sin θ over θ for the hat of a row of the map.
///
/// Beyond a pole the hat goes on half a turn round, where the horizontal part counts against it.
fn hat_moments(row: usize, height: usize) -> (f64, f64, f64) {
    let step = PI / height as f64;
    let rule = Rule::gauss_legendre(8).expect("eight nodes are allowed");
    let mut sums = (0.0, 0.0, 0.0);
    for side in [-1.0, 1.0] {
        for half in 0..2 {
            for (&node, &weight) in rule.nodes.iter().zip(&rule.weights) {
                let offset = side * (0.5 * f64::from(half) + 0.25 + 0.25 * node);
                let theta = (row as f64 + 0.5 + offset) * step;
                let weight = 0.25 * step * weight * (1.0 - offset.abs());
                let (sin, cos) = theta.sin_cos();
                // Beyond a pole sin θ is negative: the ring is there all the same, at ψ + π.
                sums.0 += weight * sin * sin.abs();
                sums.1 += weight * sin.abs() * cos;
                sums.2 += weight * sin.abs();
            }
        }
    }
    sums
}
