//! The part of the sphere on which a lobe is summed: a cap, and within it a band between two planes.
//!
//! Everything is in the map's frame, and rather too large than too small.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// A cap of directions and the band `low` ≤ ω·`axis` ≤ `high`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region {
    cos: f64,
    sin: f64,
    theta: f64,
    psi: f64,
    radius: f64,
    /// sin²(radius/2).
    square: f64,
    /// The length of the axis across the pole, its angle ψ, its part along the pole.
    across: f64,
    turn: f64,
    along: f64,
    low: f64,
    high: f64,
}

/// Up to two runs of blocks of a circle: the first block, and how many from there on, round the circle.
pub(super) type Runs = [(usize, usize); 2];

impl Region {
    /// All directions within `radius` of `centre` whose scalar product with `axis` is in the band.
    pub(super) fn new(centre: DVec3, radius: f64, axis: DVec3, low: f64, high: f64) -> Self {
        let sin = centre.x.hypot(centre.y);
        let radius = radius.min(PI);
        Self {
            cos: centre.z,
            sin,
            theta: sin.atan2(centre.z),
            psi: centre.y.atan2(centre.x),
            radius,
            square: (0.5 * radius).sin().powi(2),
            across: axis.x.hypot(axis.y),
            turn: axis.y.atan2(axis.x),
            along: axis.z,
            low,
            high,
        }
    }

    /// The rows that it can touch of `count` rows, or strips, between the poles.
    pub(super) fn rows(&self, count: usize) -> std::ops::Range<usize> {
        let scale = count as f64 / PI;
        let first = ((self.theta - self.radius) * scale - 1.0).max(0.0);
        let last = ((self.theta + self.radius) * scale + 1.0).max(0.0);
        first as usize..(last.ceil() as usize).min(count)
    }

    /// The runs of blocks that it touches on the row at (sin θ, cos θ), which has `blocks` of them, the first of which starts
    /// at ψ = `origin`.
    #[inline(always)]
    pub(super) fn runs(&self, sin: f64, cos: f64, blocks: usize, origin: f64) -> Runs {
        const NONE: Runs = [(0, 0); 2];
        let height = self.square - 0.5 * (1.0 - cos * self.cos - sin * self.sin);
        if height <= 0.0 {
            return NONE;
        }
        let room = sin * self.sin;
        let half_width = if height >= room {
            PI
        } else {
            // asin y ≤ y + (π/2 − 1) y³ on [0, 1].
            let y = (height / room).sqrt();
            (2.0 * y * (1.0 + (0.5 * PI - 1.0) * y * y)).min(PI)
        };
        // Along the row ω·axis = a cos(ψ − turn) + b: the band is one arc about `turn`, or two beside it.
        let (a, b) = (sin * self.across, cos * self.along);
        if b - a > self.high || b + a < self.low {
            return NONE;
        }
        let inner = if b + a > self.high {
            (arc_cosine((self.high - b) / a) - ARC_COSINE_ERROR).max(0.0)
        } else {
            0.0
        };
        let outer = if b - a < self.low {
            (arc_cosine((self.low - b) / a) + ARC_COSINE_ERROR).min(PI)
        } else {
            PI
        };
        let mut offset = self.turn - self.psi;
        if offset > PI {
            offset -= TAU;
        } else if offset < -PI {
            offset += TAU;
        }
        let arcs = if inner == 0.0 {
            [(offset - outer, offset + outer), (1.0, -1.0)]
        } else {
            [
                (offset - outer, offset - inner),
                (offset + inner, offset + outer),
            ]
        };
        let scale = blocks as f64 / TAU;
        let start = self.psi - origin;
        // Runs of whole blocks, as they follow each other from ψ = start − π on.
        let mut runs = [(0i64, -1i64); 3];
        let mut found = 0;
        for (from, to) in arcs {
            for turn in [-TAU, 0.0, TAU] {
                let from = (from + turn).max(-half_width);
                let to = (to + turn).min(half_width);
                if from <= to && found < 3 {
                    runs[found] = (
                        ((start + from) * scale).floor() as i64,
                        ((start + to) * scale).floor() as i64,
                    );
                    found += 1;
                }
            }
        }
        merge(&mut runs[..found], blocks as i64)
    }
}

/// At most two disjoint runs that cover the given ones, none of which is longer than the circle.
#[inline(always)]
fn merge(runs: &mut [(i64, i64)], blocks: i64) -> Runs {
    if runs.is_empty() {
        return [(0, 0); 2];
    }
    let whole = [(0, blocks as usize), (0, 0)];
    runs.sort_unstable();
    let (first, end) = (runs[0].0, runs[runs.len() - 1].1.max(runs[0].1));
    let at = |block: i64| block.rem_euclid(blocks) as usize;
    // The widest gap between two runs that is not the one round the back.
    let mut split = None;
    let mut covered = runs[0].1;
    let mut widest = 1;
    for run in &runs[1..] {
        if run.0 - covered > widest {
            widest = run.0 - covered;
            split = Some((covered, run.0));
        }
        covered = covered.max(run.1);
    }
    let end = end.max(covered);
    match split {
        None if end - first + 1 >= blocks => whole,
        None => [(at(first), (end - first + 1) as usize), (0, 0)],
        Some((stop, again)) => {
            let (one, two) = (stop - first + 1, end - again + 1);
            if end - first + 1 > blocks {
                // They meet round the back: one run from the second's start to the first's end.
                let length = one + blocks - (again - first);
                [(at(again), length.min(blocks) as usize), (0, 0)]
            } else {
                [(at(first), one as usize), (at(again), two as usize)]
            }
        }
    }
}

const ARC_COSINE_ERROR: f64 = 1e-4;

/// acos to 7·10⁻⁵, for an argument in [−1, 1]: Abramowitz and Stegun 4.4.45.
#[inline(always)]
fn arc_cosine(x: f64) -> f64 {
    let y = x.abs();
    let value = (1.0 - y).max(0.0).sqrt()
        * (1.570_728_8 + y * (-0.212_114_4 + y * (0.074_261 - 0.018_729_3 * y)));
    if x < 0.0 { PI - value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn every_direction_of_the_region_is_in_one_block() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        for _ in 0..2000 {
            let mut unit = || {
                let v = DVec3::new(
                    random.random::<f64>() - 0.5,
                    random.random::<f64>() - 0.5,
                    random.random::<f64>() - 0.5,
                );
                v.normalize()
            };
            let (centre, axis) = (unit(), unit());
            let radius = 3.2 * random.random::<f64>().powi(2);
            let low = 2.0 * random.random::<f64>() - 1.0;
            let high = low + random.random::<f64>();
            let region = Region::new(centre, radius, axis, low, high);
            let theta = PI * random.random::<f64>();
            let blocks = 3 + (random.random::<f64>() * 40.0) as usize;
            let origin = 0.1;
            let runs = region.runs(theta.sin(), theta.cos(), blocks, origin);
            let mut hits = vec![0; blocks];
            for (first, count) in runs {
                for block in first..first + count {
                    hits[block % blocks] += 1;
                }
            }
            assert!(
                hits.iter().all(|&hits| hits <= 1),
                "a block twice: {runs:?}"
            );
            for step in 0..500 {
                let psi = TAU * f64::from(step) / 500.0;
                let light = DVec3::new(
                    theta.sin() * psi.cos(),
                    theta.sin() * psi.sin(),
                    theta.cos(),
                );
                let inside = light.dot(centre) > radius.min(PI).cos() + 1e-9
                    && (low..high).contains(&light.dot(axis));
                let block = ((psi - origin) / TAU * blocks as f64).floor() as isize;
                if inside {
                    assert_eq!(hits[block.rem_euclid(blocks as isize) as usize], 1);
                }
            }
        }
    }
}
