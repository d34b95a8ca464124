//! Irradiance by harmonics: a table, looked up.
//!
//! E_lm = A_l L_lm (Ramamoorthi and Hanrahan 2001, doi:10.1364/JOSAA.18.002448; Basri and Jacobs
//! 2003, doi:10.1109/TPAMI.2003.1177153) falls as l^(−5/2) times what the light itself falls by, so
//! degree [`DEGREE`] is plenty for most light. It is not for a lamp of a few pixels at a surface's
//! horizon: the clamped cosine has a kink there, which a sum up to degree l misses by 1/(πl) of the
//! lamp. So the brightest pixels are taken out of the map and summed one by one, each as the
//! bilinear hat that it stands for; groups of them that are all above the horizon, or all below,
//! count as one. What the table still gets wrong is measured when it is made: at some normals every
//! pixel is summed like that.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::hat::Hat;
use crate::harmonics::{Coefficients, Transform};
use crate::illumination::EnvironmentMap;
use crate::reflectance::lambert;
use crate::sphere::{Grid, Rule, to_map};
use crate::{Parallelism, Result};

/// The largest degree.
const DEGREE: usize = 127;

/// A map of more rows is analysed on its own pixels.
const FINE: usize = 512;

/// Rows of the table.
const ROWS: usize = 256;

/// Nodes of the interpolation in the table, each way.
const TAPS: usize = 6;

/// Rows and columns that the table goes beyond its ends.
const PAD: usize = TAPS / 2;

/// A pixel is summed by itself if it holds more than this share of all light.
const SHARE: f64 = 1.5e-4;

/// At most so many pixels are summed by themselves.
const BRIGHTEST: usize = 1024;

/// Hats that are summed together.
const LANES: usize = 8;

/// What cutting a hat as if it were flat costs at the most, relative to what it holds, times sin θ
/// over the square of the map's step: the largest of many hats and horizons is 0.0114.
const FLAT_ERROR: f64 = 0.0125;

/// A hat is cut exactly where cutting it as if it were flat might cost more than this share of what
/// is allowed.
const FLAT_SHARE: f64 = 0.01;

/// What cutting all hats as if they were flat costs, relative: the kinks of many go both ways.
const SUM_ERROR: f64 = 1e-6;

/// Normals at which the table is compared with the sum over all pixels.
const CHECKED: usize = 16;

/// Some neighbouring bright pixels as one.
#[derive(Debug)]
struct Group {
    /// The direction of their middle, and the sine of the angle from there that holds all of them;
    /// above 1 if that is too large.
    axis: DVec3,
    sin: f64,
    /// ∫ L ω dω of each channel.
    vectors: [DVec3; 3],
}

/// The bright pixels of a group.
#[derive(Debug)]
struct Hats {
    /// ∫ ω dω over each hat.
    x: [f64; LANES],
    y: [f64; LANES],
    z: [f64; LANES],
    /// Nearer to the horizon than this, n · ∫ ω dω is not the whole truth.
    near: [f64; LANES],
    light: [[f64; LANES]; 3],
    /// θ and ψ.
    place: [[f64; 2]; LANES],
    axes: [Axes; LANES],
    /// What it may cost to cut it as if it were flat.
    flat: [f64; LANES],
}

/// How the direction changes from one pixel to the next: down a column of the map, and along a row.
#[derive(Debug, Clone, Copy, Default)]
struct Axes {
    down: DVec3,
    along: DVec3,
}

/// The table of a map, and its brightest pixels.
#[derive(Debug)]
pub(super) struct IrradianceTable {
    /// The angle between the map's rows.
    step: f64,
    /// Gauss's rule for a part of a hat.
    rule: Rule,
    groups: Vec<Group>,
    hats: Vec<Hats>,
    /// Nodes, the pads included.
    columns: usize,
    nodes: Vec<[f32; 3]>,
    /// The largest error that the comparison found, of any channel, doubled.
    error: f64,
    /// The map without its bright pixels.
    rest: Vec<[f64; 3]>,
    /// (sin ψ, cos ψ) of its columns.
    circle: Vec<(f64, f64)>,
    /// The moments of the hats of its rows.
    moments: Vec<(f64, f64, f64)>,
}

impl IrradianceTable {
    /// The table of a map of at least 256 rows: coarser ones are to be refined first.
    pub(super) fn new(map: &EnvironmentMap, parallelism: Parallelism) -> Result<Self> {
        let (width, height) = (map.width(), map.height());
        let step = PI / height as f64;
        let moments: Vec<(f64, f64, f64)> =
            (0..height).map(|row| hat_moments(row, height)).collect();
        let mass =
            |index: usize| map.pixels()[index].iter().sum::<f64>() * moments[index / width].2;
        let total: f64 = (0..width * height).map(mass).sum();
        let mut bright: Vec<usize> = (0..width * height)
            // The hats of the first and the last row go round the poles; few lamps are there.
            .filter(|&index| (1..height - 1).contains(&(index / width)))
            .filter(|&index| mass(index) > SHARE * total)
            .collect();
        bright.sort_by(|&a, &b| mass(b).total_cmp(&mass(a)).then(a.cmp(&b)));
        bright.truncate(BRIGHTEST);
        // Neighbours on the map to neighbours in the list.
        bright.sort_by_key(|&index| interleave(index / width, index % width));
        let mut pixels = map.pixels().to_vec();
        for &index in &bright {
            pixels[index] = [0.0; 3];
        }
        let (groups, hats) = bright
            .chunks(LANES)
            .map(|indices| group(map, &moments, indices))
            .unzip();
        let rows = if height > FINE { height } else { 2 * height };
        let grid = Grid::fejer(rows, 2 * rows)?;
        let maps = resample(&pixels, width, &grid, &moments);
        let analysis = Transform::new(&grid, DEGREE)?;
        let synthesis = Transform::new(&Grid::fejer(ROWS, 2 * ROWS)?, DEGREE)?;
        let count = analysis.coefficient_count();
        let mut coefficients = vec![0.0; 3 * count];
        let mut scratch = vec![0.0; analysis.scratch_len(3).max(synthesis.scratch_len(3))];
        analysis.analyse_into(3, &maps, &mut coefficients, &mut scratch, parallelism)?;
        let transfers = lambert::transfers(DEGREE)?;
        for set in coefficients.chunks_exact_mut(count) {
            let mut sorted = Coefficients::from_vec(DEGREE, DEGREE, set.to_vec())?;
            for order in 0..=DEGREE {
                let (cosine, sine) = sorted.pair_mut(order);
                for column in [cosine, sine] {
                    for (value, transfer) in column.iter_mut().zip(&transfers[order..]) {
                        *value *= transfer;
                    }
                }
            }
            set.copy_from_slice(sorted.as_slice());
        }
        let mut table = vec![0.0; 3 * 2 * ROWS * ROWS];
        synthesis.synthesise_into(3, &coefficients, &mut table, &mut scratch, parallelism)?;
        let (columns, count) = (2 * ROWS, 2 * ROWS * ROWS);
        let mut nodes = Vec::with_capacity((ROWS + 2 * PAD) * (columns + 2 * PAD));
        for row in 0..ROWS + 2 * PAD {
            // Beyond a pole: the same row half a turn round.
            let (row, turn) = if row < PAD {
                (PAD - 1 - row, columns / 2)
            } else if row >= ROWS + PAD {
                (2 * ROWS + PAD - 1 - row, columns / 2)
            } else {
                (row - PAD, 0)
            };
            for column in 0..columns + 2 * PAD {
                let at = row * columns + (column + columns - PAD + turn) % columns;
                nodes.push(std::array::from_fn(|channel| {
                    table[channel * count + at] as f32
                }));
            }
        }
        let mut made = Self {
            step,
            rule: Rule::gauss_legendre(6)?,
            groups,
            hats,
            columns: columns + 2 * PAD,
            nodes,
            error: 0.0,
            rest: pixels,
            circle: (0..width)
                .map(|column| (step * (column as f64 + 0.5)).sin_cos())
                .collect(),
            moments,
        };
        let errors = parallelism.map(CHECKED, |index| {
            // Even in height, turned by the golden angle.
            let height = 1.0 - 2.0 * (index as f64 + 0.5) / CHECKED as f64;
            let (sin, cos) = (2.399_963 * index as f64).sin_cos();
            let across = (1.0 - height * height).sqrt();
            let normal = DVec3::new(across * cos, across * sin, height);
            let want = made.sum_of_rest(normal);
            let got = made.look_up(normal);
            (0..3)
                .map(|channel| (got[channel] - want[channel]).abs())
                .fold(0.0, f64::max)
        });
        made.error = 2.0 * errors.into_iter().fold(0.0, f64::max);
        Ok(made)
    }

    /// The irradiance ∫ max(n·ω, 0) L dω of each channel at a normal of the world, and the
    /// estimated error of any channel.
    ///
    /// Where the table is not good for `tolerance`, relative to the mean of the channels and no
    /// less than `floor`, every pixel is summed: a thousand times slower, for normals that see next
    /// to nothing of light that others see.
    pub(super) fn irradiance(&self, normal: DVec3, tolerance: f64, floor: f64) -> ([f64; 3], f64) {
        let normal = to_map(normal);
        let rest = self.look_up(normal);
        let least = tolerance * floor.max(rest.iter().sum::<f64>() / 3.0);
        let bright = self.sum_of_bright(normal, FLAT_SHARE * least);
        let add = |rest: [f64; 3]| std::array::from_fn(|channel| bright[channel] + rest[channel]);
        let value: [f64; 3] = add(rest);
        if self.error <= tolerance * floor.max(value.iter().sum::<f64>() / 3.0) {
            return (value, self.error);
        }
        let value = add(self.sum_of_rest(normal));
        (value, SUM_ERROR * value.iter().sum::<f64>() / 3.0)
    }

    /// About the irradiance at a direction of the map's frame, without what the bright pixels give:
    /// that of a node beside it.
    pub(super) fn of_the_rest(&self, normal: DVec3) -> [f64; 3] {
        let scale = ROWS as f64 / PI;
        let row = arc_cosine(normal.z) * scale;
        let across = (normal.x * normal.x + normal.y * normal.y).sqrt();
        let turn = arc_cosine(normal.x / across.max(f64::MIN_POSITIVE)) * scale;
        let column = if normal.y < 0.0 {
            (2 * ROWS) as f64 - turn
        } else {
            turn
        };
        let row = (row.max(0.0) as usize).min(ROWS - 1) + PAD;
        let column = (column.max(0.0) as usize).min(2 * ROWS - 1) + PAD;
        self.nodes[row * self.columns + column].map(f64::from)
    }

    /// What the bright pixels give, each to about `allowed`.
    fn sum_of_bright(&self, normal: DVec3, allowed: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (group, hats) in self.groups.iter().zip(&self.hats) {
            let height = normal.dot(group.axis);
            if height >= group.sin {
                for channel in 0..3 {
                    sum[channel] += normal.dot(group.vectors[channel]);
                }
            } else if height > -group.sin {
                for lane in 0..LANES {
                    let vector = DVec3::new(hats.x[lane], hats.y[lane], hats.z[lane]);
                    let height = normal.dot(vector);
                    let height = if height.abs() >= hats.near[lane] {
                        height.max(0.0)
                    } else if hats.flat[lane] > allowed {
                        let [theta, psi] = hats.place[lane];
                        Hat::new(self.step, theta, psi).above_the_horizon(
                            normal,
                            &self.rule,
                            |direction| normal.dot(direction),
                        )
                    } else {
                        straddling(normal, vector, &hats.axes[lane])
                    };
                    for channel in 0..3 {
                        sum[channel] += height * hats.light[channel][lane];
                    }
                }
            }
        }
        sum
    }

    /// What the other pixels give, one by one.
    fn sum_of_rest(&self, normal: DVec3) -> [f64; 3] {
        let along = along(self.step);
        let mut sum = [0.0; 3];
        for (row, &(across, polar, _)) in self.moments.iter().enumerate() {
            let pixels = &self.rest[row * self.circle.len()..];
            let near = 2.1 * self.step * (across * along).hypot(polar * self.step);
            let ring = (self.step * (row as f64 + 0.5)).sin_cos();
            for (&circle, pixel) in self.circle.iter().zip(pixels) {
                let (sin, cos) = circle;
                let vector = DVec3::new(
                    across * along * cos,
                    across * along * sin,
                    polar * self.step,
                );
                let mut height = normal.dot(vector);
                if height > -near {
                    if height < near {
                        height = straddling(normal, vector, &Axes::new(self.step, ring, circle));
                    }
                    for channel in 0..3 {
                        sum[channel] += height * pixel[channel];
                    }
                }
            }
        }
        sum
    }

    /// The table's value, interpolated.
    fn look_up(&self, normal: DVec3) -> [f64; 3] {
        let scale = ROWS as f64 / PI;
        let row = normal.x.hypot(normal.y).atan2(normal.z) * scale - 0.5;
        let column = normal.y.atan2(normal.x).rem_euclid(TAU) * scale - 0.5;
        let (top, left) = (row.floor(), column.floor());
        let (down, across) = (lagrange(row - top), lagrange(column - left));
        // The first tap is two before the floor; the pads begin three before the first node.
        let first_row = (top as isize + 1).clamp(0, ROWS as isize) as usize;
        let first_column = (left as isize + 1).clamp(0, (2 * ROWS) as isize) as usize;
        let mut sum = [0.0; 3];
        for (tap, weight) in down.into_iter().enumerate() {
            let start = (first_row + tap) * self.columns + first_column;
            let mut line = [0.0; 3];
            for (node, weight) in self.nodes[start..start + TAPS].iter().zip(across) {
                for channel in 0..3 {
                    line[channel] += weight * f64::from(node[channel]);
                }
            }
            for channel in 0..3 {
                sum[channel] += weight * line[channel];
            }
        }
        sum
    }
}

impl Axes {
    /// Those of a pixel at (sin θ, cos θ) and (sin ψ, cos ψ).
    fn new(step: f64, (sin, cos): (f64, f64), (sin_psi, cos_psi): (f64, f64)) -> Self {
        Self {
            down: step * DVec3::new(cos * cos_psi, cos * sin_psi, -sin),
            along: step * sin * DVec3::new(-sin_psi, cos_psi, 0.0),
        }
    }
}

/// ∫ max(n·ω, 0) over a hat at the horizon: its heights are those of a sum of two triangular
/// distributions.
fn straddling(normal: DVec3, vector: DVec3, axes: &Axes) -> f64 {
    let mass = vector.length();
    let height = normal.dot(vector) / mass;
    let a = normal.dot(axes.down).abs();
    let b = normal.dot(axes.along).abs();
    let (wide, slim) = (a.max(b), a.min(b));
    if height.abs() >= wide + slim {
        return mass * height.max(0.0);
    }
    // E max(y + T, 0) for T triangular on [−1, 1].
    let mean = |y: f64| y.max(0.0) + (1.0 - y.abs()).max(0.0).powi(3) / 6.0;
    // Gauss's rule with four nodes on [0, 1].
    let nodes = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
        (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
    ];
    let sum: f64 = nodes
        .iter()
        .map(|&(t, weight)| {
            weight
                * (1.0 - t)
                * (mean((height + slim * t) / wide) + mean((height - slim * t) / wide))
        })
        .sum();
    mass * wide * sum
}

/// Up to [`LANES`] pixels as a group.
fn group(map: &EnvironmentMap, moments: &[(f64, f64, f64)], indices: &[usize]) -> (Group, Hats) {
    let (width, step) = (map.width(), PI / map.height() as f64);
    let along = along(step);
    let mut hats = Hats {
        x: [0.0; LANES],
        y: [0.0; LANES],
        z: [0.0; LANES],
        near: [0.0; LANES],
        light: [[0.0; LANES]; 3],
        place: [[0.0; 2]; LANES],
        axes: [Axes::default(); LANES],
        flat: [0.0; LANES],
    };
    let mut vectors = [DVec3::ZERO; 3];
    let mut directions = [DVec3::ZERO; LANES];
    for (lane, &index) in indices.iter().enumerate() {
        let (row, column) = (index / width, index % width);
        let (sin, cos) = (step * (column as f64 + 0.5)).sin_cos();
        let (across, polar, _) = moments[row];
        let vector = DVec3::new(across * along * cos, across * along * sin, polar * step);
        directions[lane] = vector.normalize();
        (hats.x[lane], hats.y[lane], hats.z[lane]) = vector.into();
        hats.near[lane] = 2.1 * step * vector.length();
        let pixel = map.pixels()[index];
        for channel in 0..3 {
            hats.light[channel][lane] = pixel[channel];
            vectors[channel] += pixel[channel] * vector;
        }
        hats.place[lane] = [row, column].map(|index| step * (index as f64 + 0.5));
        let ring = (step * (row as f64 + 0.5)).sin_cos();
        hats.axes[lane] = Axes::new(step, ring, (sin, cos));
        let held = pixel.iter().copied().fold(0.0, f64::max) * vector.length();
        hats.flat[lane] = held * FLAT_ERROR * step * step / ring.0;
    }
    let directions = &directions[..indices.len()];
    let axis = directions.iter().sum::<DVec3>().normalize_or(DVec3::Z);
    let radius = directions
        .iter()
        .map(|direction| direction.angle_between(axis))
        .fold(0.0, f64::max)
        + 2.1 * step;
    let sin = if radius < 1.5 { radius.sin() } else { 2.0 };
    (Group { axis, sin, vectors }, hats)
}

/// ∫ Λ cos δ dδ over a hat of the width of a column.
fn along(step: f64) -> f64 {
    step * (0.5 * step).sin().powi(2) / (0.5 * step).powi(2)
}

/// The bits of both numbers by turns, which is about the same for neighbours.
fn interleave(row: usize, column: usize) -> usize {
    (0..16)
        .map(|bit| ((row >> bit & 1) << (2 * bit + 1)) | ((column >> bit & 1) << (2 * bit)))
        .sum()
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

/// Lagrange's polynomials over −2 … 3 at x.
#[inline(always)]
fn lagrange(x: f64) -> [f64; TAPS] {
    let d: [f64; TAPS] = std::array::from_fn(|index| x - (index as f64 - 2.0));
    const OVER: [f64; 3] = [1.0 / 120.0, 1.0 / 24.0, 1.0 / 12.0];
    let (low, high) = (d[0] * d[1], d[4] * d[5]);
    let middle = d[2] * d[3];
    [
        d[1] * middle * high * -OVER[0],
        d[0] * middle * high * OVER[1],
        low * d[3] * high * -OVER[2],
        low * d[2] * high * OVER[2],
        low * middle * d[5] * -OVER[1],
        low * middle * d[4] * OVER[0],
    ]
}

/// acos to 7·10⁻⁵: Abramowitz and Stegun 4.4.45.
fn arc_cosine(x: f64) -> f64 {
    let y = x.abs().min(1.0);
    let series = 1.570_728_8 + y * (-0.212_114_4 + y * (0.074_261 - 0.018_729_3 * y));
    let angle = (1.0 - y).sqrt() * series;
    if x < 0.0 { PI - angle } else { angle }
}

/// The function of a map on the nodes of a grid: channel after channel.
///
/// The grid's weights give the hats of a row of the map not quite what they hold (3.8 % too much in
/// the rows at the poles, where sin θ has its kink), so each row is scaled to hold it.
fn resample(
    pixels: &[[f64; 3]],
    width: usize,
    grid: &Grid,
    moments: &[(f64, f64, f64)],
) -> Vec<f64> {
    let (height, rows, columns) = (moments.len(), grid.rings(), grid.columns());
    let scale = height as f64 / rows as f64;
    let place = |index: usize| {
        let at = (index as f64 + 0.5) * scale - 0.5;
        (at.floor(), at - at.floor())
    };
    let fold = |index: f64| {
        if index < 0.0 {
            (0, width / 2)
        } else if index >= height as f64 {
            (height - 1, width / 2)
        } else {
            (index as usize, 0)
        }
    };
    let mut held = vec![0.0; height];
    for row in 0..rows {
        let (top, fraction) = place(row);
        held[fold(top).0] += (1.0 - fraction) * grid.ring_weight(row);
        held[fold(top + 1.0).0] += fraction * grid.ring_weight(row);
    }
    // The weights of a ring are for all its columns.
    let gains: Vec<f64> = held
        .iter()
        .zip(moments)
        .map(|(held, moments)| TAU * moments.2 / (columns as f64 * held))
        .collect();
    let across: Vec<(usize, usize, f64)> = (0..columns)
        .map(|column| {
            let (left, fraction) = place(column);
            let left = left.rem_euclid(width as f64) as usize % width;
            (left, (left + 1) % width, fraction)
        })
        .collect();
    let mut maps = vec![0.0; 3 * rows * columns];
    let (red, rest) = maps.split_at_mut(rows * columns);
    let (green, blue) = rest.split_at_mut(rows * columns);
    let mut line = vec![[0.0; 3]; width];
    for row in 0..rows {
        let (top, fraction) = place(row);
        let ((above, above_turn), (below, below_turn)) = (fold(top), fold(top + 1.0));
        let (from_above, from_below) = (gains[above] * (1.0 - fraction), gains[below] * fraction);
        for (column, value) in line.iter_mut().enumerate() {
            let a = pixels[above * width + (column + above_turn) % width];
            let b = pixels[below * width + (column + below_turn) % width];
            *value =
                std::array::from_fn(|channel| a[channel] * from_above + b[channel] * from_below);
        }
        for (column, &(left, right, fraction)) in across.iter().enumerate() {
            let (a, b) = (line[left], line[right]);
            let at = row * columns + column;
            red[at] = a[0] + fraction * (b[0] - a[0]);
            green[at] = a[1] + fraction * (b[1] - a[1]);
            blue[at] = a[2] + fraction * (b[2] - a[2]);
        }
    }
    maps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_at_the_poles_hold_what_they_hold() {
        // The rows at the poles are not among the pixels that are summed one by one: the table has
        // to get them right.
        let mut pixels = vec![[1.0; 3]; 512 * 256];
        pixels[..512].fill([3e3; 3]);
        pixels[255 * 512..].fill([1e3; 3]);
        let map = EnvironmentMap::new("poles", 512, 256, pixels).expect("the map is well formed");
        let table = IrradianceTable::new(&map, Parallelism::Sequential).expect("256 rows do");
        let mean = map.mean()[0] * PI;
        assert!(table.error < 3e-4 * mean, "{} of {mean}", table.error);
    }

    #[test]
    fn lagrange_reproduces_a_polynomial() {
        let weights = lagrange(0.3);
        let sum: f64 = weights
            .iter()
            .enumerate()
            .map(|(index, weight)| weight * (index as f64 - 2.0).powi(5))
            .sum();
        assert!((sum - 0.3f64.powi(5)).abs() < 1e-13);
    }
}
