//! Where the light breaks along rays across a circle.
//!
//! What a sphere shows, shading or reflection, is a smooth function of its normal. At the depth d
//! within its outline, in radii, the normal's part along the view is √(2d − d²): the brightness goes
//! as the root of the depth, and at grazing a ball mirrors what stands right behind it, so that there
//! need be no step at the outline at all. A ray is therefore held against a line that at the outline
//! jumps, bends, and has inside a part that goes as the root of the depth. Without that part the
//! circle is taken for where a reflection begins, within the outline (docs/notes/choosing-the-circle.md).

use std::f64::consts::TAU;
use std::sync::LazyLock;

use super::Circle;
use super::reduced::Reduced;

/// Pixels between two samples of a ray, and between two offsets of a break.
const STEP: f64 = 0.5;

/// A break is looked for so many pixels to either side of the circle.
const REACH: f64 = 2.0;

/// A ray goes so many pixels to either side of the circle.
const HALF: f64 = 5.0;

/// Samples count by a Gaussian of this standard deviation about the circle, in pixels.
const WEIGHT: f64 = 2.0;

/// The standard deviation of the blur of a break, in pixels.
const BLUR: f64 = 0.6;

/// How much what a jump, a bend and the root of the depth explain counts. A jump with a root looks
/// much like a jump farther in, so that outlines with a sharp jump come out too large where the root
/// counts fully; with less than half they come out too small where there is no jump
/// (docs/notes/choosing-the-circle.md has the trial).
const COUNTS: [f64; 3] = [1.0, 1.0, 0.7];

const OFFSETS: usize = (2.0 * REACH / STEP) as usize + 1;
const SAMPLES: usize = (2.0 * HALF / STEP) as usize + 1;

/// The variance of noise, over radiance times what is white.
const NOISE: f64 = 1e-4;

/// What a break leaves unexplained at best.
const LEFT: f64 = 0.03;

type Samples = [f64; SAMPLES];

/// What a line can be, and for each offset what a line that breaks there can be beyond that: all
/// orthonormal, weighted.
struct Basis {
    weights: Samples,
    line: [Samples; 2],
    /// A jump, a bend, and the root of the depth inside.
    breaks: [[Samples; COUNTS.len()]; OFFSETS],
}

fn dot(a: &Samples, b: &Samples) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A vector less what it has of others that are orthonormal, of unit norm.
fn beyond(mut vector: Samples, others: &[Samples]) -> Samples {
    for other in others {
        let along = dot(&vector, other);
        for (a, b) in vector.iter_mut().zip(other) {
            *a -= along * b;
        }
    }
    let norm = dot(&vector, &vector).sqrt();
    vector.map(|a| a / norm)
}

/// The root of a depth that is 0 outside, blurred: its mean over a Gaussian.
fn root_of_depth(depth: f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for step in -20..=20 {
        let place = 0.15 * f64::from(step);
        let weight = (-0.5 * place * place).exp();
        sum += weight * (depth + BLUR * place).max(0.0).sqrt();
        total += weight;
    }
    sum / total
}

impl Basis {
    fn new() -> Self {
        let place = |i: usize| i as f64 * STEP - HALF;
        let weights: Samples = std::array::from_fn(|i| (-0.25 * (place(i) / WEIGHT).powi(2)).exp());
        let level = beyond(weights, &[]);
        let slope = beyond(std::array::from_fn(|i| weights[i] * place(i)), &[level]);
        let breaks = std::array::from_fn(|offset| {
            let past = |i: usize| place(i) - (offset as f64 * STEP - REACH);
            // The logistic curve that is close to the normal distribution.
            let step = |i: usize| 1.0 / (1.0 + (-1.702 * past(i) / BLUR).exp());
            let jump = beyond(
                std::array::from_fn(|i| weights[i] * step(i)),
                &[level, slope],
            );
            let bend = beyond(
                std::array::from_fn(|i| weights[i] * step(i) * past(i)),
                &[level, slope, jump],
            );
            let root = beyond(
                std::array::from_fn(|i| weights[i] * root_of_depth(-past(i))),
                &[level, slope, jump, bend],
            );
            [jump, bend, root]
        });
        Self {
            weights,
            line: [level, slope],
            breaks,
        }
    }
}

/// It is the same for every circle.
static BASIS: LazyLock<Basis> = LazyLock::new(Basis::new);

/// How much better a line that breaks explains what each ray across a circle sees than one that
/// does not, by the break's offset from the circle.
pub(super) struct Rays {
    circle: Circle,
    /// (cos, sin) of each ray.
    directions: Vec<(f64, f64)>,
    /// The log of the ratio of the squares that are left.
    gain: Vec<[f64; OFFSETS]>,
}

impl Rays {
    /// The rays across a circle: `WEIGHT` and `HALF` keep what lies farther in or out from
    /// counting.
    pub(super) fn across(picture: &Reduced, circle: Circle) -> Self {
        let count = ((TAU * circle.radius / 1.5) as usize).clamp(48, 240);
        let basis = &*BASIS;
        let mut directions = Vec::with_capacity(count);
        let mut gain = Vec::with_capacity(count);
        for ray in 0..count {
            let (sin, cos) = (TAU * ray as f64 / count as f64).sin_cos();
            // Beyond the border there is nothing to see.
            let (x, y) = (
                circle.x + circle.radius * cos,
                circle.y + circle.radius * sin,
            );
            if x < -1.0
                || y < -1.0
                || x > picture.width as f64 + 1.0
                || y > picture.height as f64 + 1.0
            {
                continue;
            }
            let mut channels = [[0.0; SAMPLES]; 3];
            for i in 0..SAMPLES {
                let radius = circle.radius - HALF + STEP * i as f64;
                let rgb = picture.at(circle.x + radius * cos, circle.y + radius * sin);
                for c in 0..3 {
                    channels[c][i] = basis.weights[i] * rgb[c];
                }
            }
            let mut line = 0.0;
            for values in &channels {
                let [level, slope] = [0, 1].map(|k| dot(values, &basis.line[k]));
                let total: f64 = basis.weights.iter().map(|w| w * w).sum();
                let mean = level.abs() / total.sqrt();
                let noise = total * picture.white * (NOISE * mean + 1e-6 * picture.white);
                line += dot(values, values) - level * level - slope * slope + noise;
            }
            gain.push(std::array::from_fn(|offset| {
                let explained: f64 = channels
                    .iter()
                    .flat_map(|values| {
                        basis.breaks[offset]
                            .iter()
                            .zip(COUNTS)
                            .map(move |(vector, count)| count * dot(values, vector).powi(2))
                    })
                    .sum();
                let left = 1.0 - (explained / line.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                -((1.0 - LEFT) * left + LEFT).ln()
            }));
            directions.push((cos, sin));
        }
        Self {
            circle,
            directions,
            gain,
        }
    }

    /// The circle that they go across.
    pub(super) fn circle(&self) -> Circle {
        self.circle
    }

    /// The gain of a ray, `off` pixels outside the circle: a quadratic spline, which has no corners
    /// for a search to stop at.
    fn at(gain: &[f64; OFFSETS], off: f64) -> f64 {
        let place = (off + REACH) / STEP + 0.5;
        if !(place >= 1.0 && place < (OFFSETS - 1) as f64) {
            return 0.0;
        }
        let i = place as usize;
        let part = place - i as f64 - 0.5;
        0.5 * (0.5 - part).powi(2) * gain[i - 1]
            + (0.75 - part * part) * gain[i]
            + 0.5 * (0.5 + part).powi(2) * gain[i + 1]
    }

    /// The mean over the rays of the gain of a circle moved by (right, down, radius).
    pub(super) fn gain(&self, [x, y, radius]: [f64; 3]) -> f64 {
        let sum: f64 = self
            .directions
            .iter()
            .zip(&self.gain)
            .map(|((cos, sin), gain)| Self::at(gain, x * cos + y * sin + radius))
            .sum();
        sum / self.directions.len().max(1) as f64
    }

    /// The circle that breaks fit best.
    pub(super) fn best(&self) -> Circle {
        let mut best = ([0.0; 3], self.gain([0.0; 3]));
        let mut step = 1.0;
        // What has been tried with this step: the neighbours of this place, or it alone.
        let mut tried = (best.0, 0.0);
        while step > 0.02 {
            let (from, before) = best;
            for i in 0..27 {
                let way = [i % 3, i / 3 % 3, i / 9].map(|k| f64::from(k - 1));
                let moved: [f64; 3] = std::array::from_fn(|axis| from[axis] + step * way[axis]);
                if (0..3).all(|axis| (moved[axis] - tried.0[axis]).abs() <= tried.1) {
                    continue;
                }
                let gain = self.gain(moved);
                if gain > best.1 {
                    best = (moved, gain);
                }
            }
            tried = (from, 1.5 * step);
            if best.1 <= before {
                step *= 0.5;
                tried = (from, 0.0);
            }
        }
        let [x, y, radius] = best.0;
        Circle {
            x: self.circle.x + x,
            y: self.circle.y + y,
            radius: self.circle.radius + radius,
        }
    }

    /// The share of rays whose best break lies on the circle.
    pub(super) fn sharp(&self) -> f64 {
        let on = |gain: &&[f64; OFFSETS]| {
            let middle = OFFSETS / 2;
            let highest = |gain: &[f64]| gain.iter().copied().fold(0.0, f64::max);
            let here = highest(&gain[middle - 1..=middle + 1]);
            here >= highest(&gain[..]) && here > 1.0
        };
        self.gain.iter().filter(on).count() as f64 / self.gain.len().max(1) as f64
    }
}
