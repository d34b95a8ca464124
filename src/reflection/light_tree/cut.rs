//! Parts of cells that the horizon crosses, cut along a straight line of (θ, ψ).

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::lobe::Lobe;
use super::parts::PartLight;

/// The height over the horizon about the middle of eight patches: its value, its change over half a
/// side down and along, and how far a patch's heights may be from that plane.
struct Plane<S: Simd> {
    height: f64x8<S>,
    down: f64x8<S>,
    along: f64x8<S>,
    bent: f64x8<S>,
}

impl<S: Simd> Plane<S> {
    #[inline(always)]
    fn new(simd: S, normal: DVec3, light: &PartLight<S>) -> Self {
        let splat = |value| f64x8::splat(simd, value);
        let [x, y, z] = light.patches.centre;
        let [down, along] = light.patches.half;
        let sine = (x * x + y * y).sqrt();
        let recip = splat(1.0) / sine.max(splat(1e-300));
        let (cos_turn, sin_turn) = (x * recip, y * recip);
        let out = cos_turn * normal.x + sin_turn * normal.y;
        let round = cos_turn * normal.y - sin_turn * normal.x;
        let height = sine * out + z * normal.z;
        let slope_down = z * out - sine * normal.z;
        // Second derivatives anywhere in the patch: −a, cos θ (n·e_ψ) and −sin θ (n·out).
        let steep = (slope_down.abs() * down + (sine * round).abs() * along) + height.abs();
        let wander = down + along;
        let twist = (z.abs() + down) * (round.abs() + along);
        let turn = (sine + down) * (out.abs() + along);
        let bent = down * down * (steep + wander * wander)
            + down * along * twist * 2.0
            + along * along * turn;
        Self {
            height,
            down: slope_down * down,
            along: sine * round * along,
            bent: bent * 0.5,
        }
    }
}

/// A bound of the error of [`CutCells::sum`]; `bend` is that of the bilinear interpolant of f sin
/// θ.
#[inline(always)]
pub(super) fn error<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    light: &PartLight<S>,
    radius: f64x8<S>,
    bend: f64x8<S>,
    flat: f64x8<S>,
) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    let plane = Plane::new(simd, lobe.normal(), light);
    let steepest = plane.down.abs().max(plane.along.abs());
    // Between the true horizon and the line the lobe is at most this, and the area of (θ, ψ) at
    // most that.
    let at = lobe.at_the_horizon(simd, light.patches.centre, radius, plane.bent * 2.0);
    let [down, along] = light.patches.half;
    let area = (plane.bent * 4.0 / steepest).min(splat(4.0)) * down * along;
    let mut most = splat(0.0);
    let lines = [light.y - light.height, light.y + light.height];
    let columns = [light.x - light.width, light.x + light.width];
    for corners in &light.corners {
        for y in lines {
            let y = y.mul_add(splat(0.5), splat(0.5));
            let before = (corners[2] - corners[0]).mul_add(y, corners[0]);
            let after = (corners[3] - corners[1]).mul_add(y, corners[1]);
            for x in columns {
                let x = x.mul_add(splat(0.5), splat(0.5));
                most = most.max((after - before).mul_add(x, before));
            }
        }
    }
    bend * flat + at * area * most * light.patches.top_sine(simd)
}

/// Eight parts in axes along which the height grows: s and t from −1 to 1, more along t.
pub(super) struct CutCells<S: Simd> {
    /// The plane's value at the middle and its growth along s and t.
    height: f64x8<S>,
    growth: [f64x8<S>; 2],
    /// Of each channel the light, and the lobe times sin θ, at (s, t) = (−, −), (−, +), (+, −), (+, +).
    light: [[f64x8<S>; 4]; 3],
    lobe: [[f64x8<S>; 4]; 3],
    area: f64x8<S>,
}

impl<S: Simd> CutCells<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, lobe: &impl Lobe, light: &PartLight<S>) -> Self {
        let splat = |value| f64x8::splat(simd, value);
        let plane = Plane::new(simd, lobe.normal(), light);
        let [down, along] = light.patches.half;
        let [x, y, cos] = light.patches.centre;
        let sin = (x * x + y * y).sqrt();
        let recip = splat(1.0) / sin.max(splat(1e-300));
        let (cos_turn, sin_turn) = (x * recip, y * recip);
        let (sin_down, cos_down) = super::small_angles::small_sin_cos(simd, down);
        let (sin_along, cos_along) = super::small_angles::small_sin_cos(simd, along);
        // (up, before), (up, after), (down, before), (down, after).
        let mut values = [[splat(0.0); 4]; 3];
        for index in 0..4 {
            let sin_down = if index < 2 { -sin_down } else { sin_down };
            let sin_along = if index % 2 == 0 {
                -sin_along
            } else {
                sin_along
            };
            let sine = sin.mul_add(cos_down, cos * sin_down);
            let cosine = cos.mul_add(cos_down, -(sin * sin_down));
            let direction = [
                sine * cos_turn.mul_add(cos_along, -(sin_turn * sin_along)),
                sine * sin_turn.mul_add(cos_along, cos_turn * sin_along),
                cosine,
            ];
            for (values, value) in values.iter_mut().zip(lobe.value(simd, direction)) {
                values[index] = value * sine;
            }
        }
        let (top, bottom) = (light.y - light.height, light.y + light.height);
        let (left, right) = (light.x - light.width, light.x + light.width);
        let part = |value: f64x8<S>| value.mul_add(splat(0.5), splat(0.5));
        let (top, bottom, left, right) = (part(top), part(bottom), part(left), part(right));
        let corners = light.corners.map(|corners| {
            let line = |y: f64x8<S>| {
                let before = (corners[2] - corners[0]).mul_add(y, corners[0]);
                let after = (corners[3] - corners[1]).mul_add(y, corners[1]);
                [
                    (after - before).mul_add(left, before),
                    (after - before).mul_add(right, before),
                ]
            };
            let ([a, b], [c, d]) = (line(top), line(bottom));
            [a, b, c, d]
        });
        // Both axes turned so that the height grows, and changed about so that it grows more along
        // the second.
        let flip_down = plane.down.simd_lt(splat(0.0));
        let flip_along = plane.along.simd_lt(splat(0.0));
        let (grow_down, grow_along) = (plane.down.abs(), plane.along.abs());
        let swap = grow_along.simd_lt(grow_down);
        let arrange = |[a, b, c, d]: [f64x8<S>; 4]| {
            let (a, c) = (flip_down.select(c, a), flip_down.select(a, c));
            let (b, d) = (flip_down.select(d, b), flip_down.select(b, d));
            let (a, b) = (flip_along.select(b, a), flip_along.select(a, b));
            let (c, d) = (flip_along.select(d, c), flip_along.select(c, d));
            // As it stands s goes down and t along.
            [a, swap.select(c, b), swap.select(b, c), d]
        };
        Self {
            height: plane.height,
            growth: [
                swap.select(grow_along, grow_down),
                swap.select(grow_down, grow_along),
            ],
            light: corners.map(arrange),
            lobe: values.map(arrange),
            area: down * along,
        }
    }

    /// ∫ of light and lobe, both bilinear, over what of the parts is above the line: exact.
    #[inline(always)]
    pub(super) fn sum(&self, simd: S, sums: &mut [f64x8<S>; 3]) {
        let splat = |value| f64x8::splat(simd, value);
        let (one, low) = (splat(1.0), splat(-1.0));
        let [slow, fast] = self.growth;
        let per_slow = one / slow.max(splat(1e-300));
        // The line enters at t = 1 and leaves at t = −1.
        let enter = (-(self.height + fast) * per_slow).max(low).min(one);
        let leave = ((fast - self.height) * per_slow).max(low).min(one);
        let per_fast = one / fast;
        let mut strip = |s: f64x8<S>, weight: f64x8<S>, from: f64x8<S>| {
            let middle = (from + one) * 0.5;
            let half = (one - from) * 0.5;
            let part = s.mul_add(splat(0.5), splat(0.5));
            let along = |values: &[f64x8<S>; 4]| {
                let first = (values[2] - values[0]).mul_add(part, values[0]);
                let last = (values[3] - values[1]).mul_add(part, values[1]);
                [first, last - first]
            };
            let lobes = self.lobe.each_ref().map(along);
            let lights = self.light.each_ref().map(along);
            let weight = weight * half * self.area;
            for node in [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8] {
                let t = half.mul_add(splat(node), middle);
                let place = t.mul_add(splat(0.5), splat(0.5));
                for ((sum, light), lobe) in sums.iter_mut().zip(&lights).zip(&lobes) {
                    let value = lobe[1].mul_add(place, lobe[0]) * weight;
                    *sum = light[1].mul_add(place, light[0]).mul_add(value, *sum);
                }
            }
        };
        let (middle, half) = ((enter + leave) * 0.5, (leave - enter) * 0.5);
        for (node, weight) in [
            (-0.774_596_669_241_483_4, 5.0 / 9.0),
            (0.0, 8.0 / 9.0),
            (0.774_596_669_241_483_4, 5.0 / 9.0),
        ] {
            let s = half.mul_add(splat(node), middle);
            let from = (-slow.mul_add(s, self.height) * per_fast).max(low).min(one);
            strip(s, half * weight, from);
        }
        let (middle, half) = ((leave + one) * 0.5, (one - leave) * 0.5);
        for node in [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8] {
            strip(half.mul_add(splat(node), middle), half, low);
        }
    }
}
