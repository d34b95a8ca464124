//! The part of the sphere on which a lobe is summed: a cap, and within it a band between two
//! planes.
//!
//! Everything is in the map's frame, and rather too large than too small.

use std::f64::consts::{PI, TAU};

use fearless_simd::{f64x8, prelude::*};
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
    /// The length of the axis across the pole, its angle ψ from the centre's, its part along the
    /// pole.
    across: f64,
    offset: f64,
    along: f64,
    low: f64,
    high: f64,
    /// Whether all of the cap is in the band.
    cap_only: bool,
}

/// Up to two runs of blocks of a circle, or of nodes: the first, and how many from there on, round
/// the circle.
pub(super) type Runs = [(usize, usize); 2];

impl Region {
    /// All directions within an angle of `centre`, the tangent of half of which is given, whose
    /// scalar product with `axis` is in the band.
    pub(super) fn new(centre: DVec3, tangent: f64, axis: DVec3, low: f64, high: f64) -> Self {
        let sin = (centre.x * centre.x + centre.y * centre.y).sqrt();
        let psi = centre.y.atan2(centre.x);
        let square = tangent * tangent / (1.0 + tangent * tangent);
        let (radius_sin, radius_cos) = (2.0 * square / tangent, 1.0 - 2.0 * square);
        // The heights between which the cap lies: cos(angle ± radius), or a pole of the axis.
        let height = centre.dot(axis);
        let slant = (1.0 - height * height).max(0.0).sqrt();
        let (middle, swing) = (height * radius_cos, slant * radius_sin);
        let least = if height > -radius_cos {
            middle - swing
        } else {
            -1.0
        };
        let most = if height < radius_cos {
            middle + swing
        } else {
            1.0
        };
        let cap_only = low < least && most < high;
        let mut offset = 0.0;
        if !cap_only {
            offset = axis.y.atan2(axis.x) - psi;
            if offset > PI {
                offset -= TAU;
            } else if offset < -PI {
                offset += TAU;
            }
        }
        Self {
            cos: centre.z,
            sin,
            theta: sin.atan2(centre.z),
            psi,
            radius: 2.0 * tangent.atan(),
            square,
            across: (axis.x * axis.x + axis.y * axis.y).sqrt(),
            offset,
            along: axis.z,
            low,
            high,
            cap_only,
        }
    }

    /// The rows that it can touch of `count` rows, or strips, between the poles.
    pub(super) fn rows(&self, count: usize) -> std::ops::Range<usize> {
        let scale = count as f64 / PI;
        let first = ((self.theta - self.radius) * scale - 1.0).max(0.0);
        let last = ((self.theta + self.radius) * scale + 1.0).max(0.0);
        first as usize..(last.ceil() as usize).min(count)
    }

    /// What it touches of the eight rows at (sin θ, cos θ).
    #[inline(always)]
    pub(super) fn arcs<S: Simd>(&self, simd: S, sin: &[f64; 8], cos: &[f64; 8]) -> Arcs {
        let splat = |value| f64x8::splat(simd, value);
        let (zero, one, pi) = (splat(0.0), splat(1.0), splat(PI));
        let sin = f64x8::from_slice(simd, sin);
        let cos = f64x8::from_slice(simd, cos);
        let dot = cos * splat(self.cos) + sin * splat(self.sin);
        let height = splat(self.square) - splat(0.5) * (one - dot);
        let room = sin * splat(self.sin);
        // asin y ≤ y + y³/6 + (π/2 − 7/6) y⁵ on [0, 1].
        let square = height / room;
        let y = square.sqrt();
        let series = square.mul_add(splat(0.5 * PI - 7.0 / 6.0), splat(1.0 / 6.0));
        let cap = (y + y) * square.mul_add(series, one);
        let cap = height.simd_lt(room).select(cap.min(pi), pi);
        let store = |lanes: f64x8<S>| {
            let mut values = [0.0; 8];
            lanes.store_slice(&mut values);
            values
        };
        if self.cap_only {
            let none = splat(-1.0);
            return Arcs {
                cap: store(zero.simd_lt(height).select(cap, none)),
                inner: [0.0; 8],
                outer: [PI; 8],
            };
        }
        // Along the row ω·axis = a cos(ψ − turn) + b: the band is one arc about `turn`, or two
        // beside it.
        let (a, b) = (sin * splat(self.across), cos * splat(self.along));
        let (low, high) = (splat(self.low), splat(self.high));
        let (least, most) = (b - a, b + a);
        let error = splat(ARC_COSINE_ERROR);
        let inner = (arc_cosine(simd, (high - b) / a) - error).max(zero);
        let inner = high.simd_lt(most).select(inner, zero);
        let outer = (arc_cosine(simd, (low - b) / a) + error).min(pi);
        let outer = least.simd_lt(low).select(outer, pi);
        let none = splat(-1.0);
        let cap = zero.simd_lt(height).select(cap, none);
        let cap = high.simd_lt(least).select(none, cap);
        let cap = most.simd_lt(low).select(none, cap);
        Arcs {
            cap: store(cap),
            inner: store(inner),
            outer: store(outer),
        }
    }

    /// The runs of blocks that it touches on a row, which has `blocks` of them, the first of which
    /// starts at ψ = `origin`.
    #[inline(always)]
    pub(super) fn runs(&self, arcs: &Arcs, lane: usize, blocks: usize, origin: f64) -> Runs {
        self.spans(arcs, lane, blocks, origin, 0.0)
    }

    /// The runs of nodes in it on each of eight rows of `counts` nodes, the first of which is half
    /// a step from ψ = 0.
    #[inline(always)]
    pub(super) fn nodes<S: Simd>(
        &self,
        simd: S,
        sin: &[f64; 8],
        cos: &[f64; 8],
        counts: &[f64; 8],
    ) -> Nodes {
        let arcs = self.arcs(simd, sin, cos);
        let (mut first, mut many) = ([0.0; 8], [0.0; 8]);
        if self.cap_only {
            let splat = |value| f64x8::splat(simd, value);
            let (cap, count) = (
                f64x8::from_slice(simd, &arcs.cap),
                f64x8::from_slice(simd, counts),
            );
            let scale = count * splat(1.0 / TAU);
            let (half, psi) = (splat(0.5), splat(self.psi));
            let from = (psi - cap).mul_add(scale, half).floor();
            let to = (psi + cap).mul_add(scale, half).floor();
            // From −n … 2n to 0 … n.
            let round = splat(0.0);
            let start = from.simd_lt(round).select(from + count, from);
            let start = count.simd_le(start).select(start - count, start);
            let none = cap.simd_lt(splat(0.0));
            start.store_slice(&mut first);
            none.select(splat(0.0), (to - from).min(count))
                .store_slice(&mut many);
        }
        Nodes { arcs, first, many }
    }

    /// The runs of nodes on one of eight rows, which has `count` of them, each run made longer by
    /// less than `lanes` so that it is a multiple of that, as `count` is. No node is in both.
    #[inline(always)]
    pub(super) fn row(&self, nodes: &Nodes, lane: usize, count: usize, lanes: usize) -> Runs {
        let up = |many: usize| many.next_multiple_of(lanes);
        let whole = [(0, count), (0, 0)];
        if self.cap_only {
            let (first, many) = (nodes.first[lane] as usize, up(nodes.many[lane] as usize));
            return if many > count {
                whole
            } else {
                [(first, many), (0, 0)]
            };
        }
        let [(first, many), (again, more)] = self.spans(&nodes.arcs, lane, count, 0.0, 0.5);
        let apart = if again < first { again + count } else { again } - first;
        if up(many) <= apart && up(more) <= count - apart {
            return [(first, up(many)), (again, up(more))];
        }
        // Over the narrower gap; an empty run is not there.
        let (first, many) = if more == 0 {
            (first, many)
        } else if apart - many <= count - apart - more {
            (first, apart + more)
        } else {
            (again, count - apart + many)
        };
        if up(many) > count {
            whole
        } else {
            [(first, up(many)), (0, 0)]
        }
    }

    /// The runs of the units that it touches with more than `inset` of their length on either side.
    #[inline(always)]
    fn spans(&self, arcs: &Arcs, lane: usize, blocks: usize, origin: f64, inset: f64) -> Runs {
        let (cap, inner, outer) = (arcs.cap[lane], arcs.inner[lane], arcs.outer[lane]);
        if cap < 0.0 {
            return [(0, 0); 2];
        }
        let scale = blocks as f64 / TAU;
        let start = self.psi - origin;
        // Runs of whole blocks, as they follow each other from ψ = start − π on.
        let mut runs = [(0i64, -1i64); 3];
        let mut found = 0;
        let mut cut = |from: f64, to: f64| {
            let (from, to) = (from.max(-cap), to.min(cap));
            if from <= to && found < 3 {
                let run = (
                    floor((start + from) * scale + inset),
                    floor((start + to) * scale - inset),
                );
                if run.0 <= run.1 {
                    runs[found] = run;
                    found += 1;
                }
            }
        };
        let mut around = |from: f64, to: f64| {
            if to - TAU >= -cap {
                cut(from - TAU, to - TAU);
            }
            cut(from, to);
            if from + TAU <= cap {
                cut(from + TAU, to + TAU);
            }
        };
        if inner == 0.0 && outer >= PI {
            cut(-cap, cap);
        } else if inner == 0.0 {
            around(self.offset - outer, self.offset + outer);
        } else {
            around(self.offset - outer, self.offset - inner);
            around(self.offset + inner, self.offset + outer);
        }
        merge(&mut runs[..found], blocks as i64)
    }
}

/// The largest integer that is not above x, without a call where the machine's baseline has no
/// instruction for it.
#[inline(always)]
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from(x < whole as f64)
}

/// The nodes of a region on eight rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nodes {
    arcs: Arcs,
    /// For a cap: the first, and how many.
    first: [f64; 8],
    many: [f64; 8],
}

/// What a region touches of eight rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arcs {
    /// The half width of the cap in ψ; below 0 if the row is outside the region.
    cap: [f64; 8],
    /// Where the band begins and ends, on both sides of its axis.
    inner: [f64; 8],
    outer: [f64; 8],
}

/// At most two disjoint runs that cover the given ones, none of which is longer than the circle.
#[inline(always)]
fn merge(runs: &mut [(i64, i64)], blocks: i64) -> Runs {
    let whole = [(0, blocks as usize), (0, 0)];
    let at = |mut block: i64| {
        while block < 0 {
            block += blocks;
        }
        while block >= blocks {
            block -= blocks;
        }
        block as usize
    };
    match runs {
        [] => return [(0, 0); 2],
        [(first, end)] => {
            return if *end - *first + 1 >= blocks {
                whole
            } else {
                [(at(*first), (*end - *first + 1) as usize), (0, 0)]
            };
        }
        _ => runs.sort_unstable(),
    }
    let (first, end) = (runs[0].0, runs[runs.len() - 1].1.max(runs[0].1));
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
fn arc_cosine<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    let y = x.abs();
    let mut sum = splat(-0.018_729_3);
    for coefficient in [0.074_261, -0.212_114_4, 1.570_728_8] {
        sum = sum.mul_add(y, splat(coefficient));
    }
    let value = (splat(1.0) - y).max(splat(0.0)).sqrt() * sum;
    x.simd_lt(splat(0.0)).select(splat(PI) - value, value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors;
    use fearless_simd::dispatch;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn every_node_of_the_region_is_in_one_run() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(8);
        for index in 0..4000 {
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
            // One in three is a cap and no band.
            let low = if index % 3 == 0 {
                -1.1
            } else {
                2.0 * random.random::<f64>() - 1.0
            };
            let high = if index % 3 == 0 {
                1.1
            } else {
                low + random.random::<f64>()
            };
            let region = Region::new(centre, (0.5 * radius.min(PI)).tan(), axis, low, high);
            let theta = PI * random.random::<f64>();
            let (sin, cos) = theta.sin_cos();
            let lanes = 8 << (index % 2);
            let count = 16 * (1 + (random.random::<f64>() * 20.0) as usize);
            let runs = dispatch!(vectors::level(), simd => {
                let nodes = region.nodes(simd, &[sin; 8], &[cos; 8], &[count as f64; 8]);
                region.row(&nodes, 3, count, lanes)
            });
            let mut hits = vec![0; count];
            for (first, many) in runs {
                assert!(first < count && many % lanes == 0);
                for node in first..first + many {
                    hits[node % count] += 1;
                }
            }
            for (node, &hits) in hits.iter().enumerate() {
                let psi = TAU * (node as f64 + 0.5) / count as f64;
                let light = DVec3::new(sin * psi.cos(), sin * psi.sin(), cos);
                let inside = light.dot(centre) > radius.min(PI).cos() + 1e-9
                    && (low..high).contains(&light.dot(axis));
                assert!(hits <= 1 && (hits == 1 || !inside), "{runs:?} of {count}");
            }
        }
    }

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
            let region = Region::new(centre, (0.5 * radius.min(PI)).tan(), axis, low, high);
            let theta = PI * random.random::<f64>();
            let blocks = 3 + (random.random::<f64>() * 40.0) as usize;
            let origin = 0.1;
            let arcs = dispatch!(vectors::level(), simd => {
                region.arcs(simd, &[theta.sin(); 8], &[theta.cos(); 8])
            });
            let runs = region.runs(&arcs, 5, blocks, origin);
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
