//! How wrong a patch of light may be when it is taken whole: the bounds of
//! docs/reference/rendering-bound.md.

use fearless_simd::{f64x8, prelude::*};

use super::lobe::Lobe;
use super::neighbourhood::Neighbourhood;
use super::rules::RULES;
use super::tree::DEGREES;

/// Eight patches of the map, rectangles in (θ, ψ).
#[derive(Clone, Copy)]
pub(crate) struct Patches<S: Simd> {
    /// The directions of their middles.
    pub(crate) centre: [f64x8<S>; 3],
    /// |sin θ| there.
    pub(crate) sin: f64x8<S>,
    /// Half their sides in θ and in ψ.
    pub(crate) half: [f64x8<S>; 2],
}

/// The largest sums of Lagrange's polynomials in size on 4, 6, 8 Chebyshev points: 1.8478, 2.1044
/// and 2.2871.
const LEBESGUES: [f64; DEGREES.len()] = [1.848, 2.105, LEBESGUE];
pub(super) const LEBESGUE: f64 = 2.288;

/// A part of a quarter of an ellipse, places (cos φ, sin φ): the largest cosine, the least and the
/// largest sine, and its share of the quarter, all rounded to the safe side.
struct Arc {
    cosine: f64,
    low_sine: f64,
    sine: f64,
    share: f64,
}

/// π/2 − φ from 0 to 0.5, 0.9, 1.2 and π/2.
const ARCS: [Arc; 4] = [
    Arc {
        cosine: 0.479_427,
        low_sine: 0.877_582,
        sine: 1.0,
        share: 0.318_311,
    },
    Arc {
        cosine: 0.783_328,
        low_sine: 0.621_609,
        sine: 0.877_584,
        share: 0.254_649,
    },
    Arc {
        cosine: 0.932_040,
        low_sine: 0.362_357,
        sine: 0.621_611,
        share: 0.190_987,
    },
    Arc {
        cosine: 1.0,
        low_sine: 0.0,
        sine: 0.362_359,
        share: 0.236_057,
    },
];

impl<S: Simd> Patches<S> {
    /// No direction of a patch is farther from its middle, as a chord.
    #[inline(always)]
    pub(super) fn radius(&self, simd: S) -> f64x8<S> {
        let [down, along] = self.half;
        let sine = (self.sin + down).min(f64x8::splat(simd, 1.0));
        down.mul_add(down, along * along * sine * self.sin).sqrt()
    }

    /// The largest sin θ of a patch.
    #[inline(always)]
    pub(super) fn top_sine(&self, simd: S) -> f64x8<S> {
        (self.sin + self.half[0]).min(f64x8::splat(simd, 1.0))
    }
}

/// Bernstein's ellipses of patches, in θ and in ψ.
#[derive(Clone, Copy)]
struct Ellipses<S: Simd> {
    /// ρ, and half the sum and half the difference of ρ and 1/ρ.
    rho: [f64x8<S>; 2],
    semi: [[f64x8<S>; 2]; 2],
    /// The largest |sin θ| of the complex θ.
    sine: f64x8<S>,
    /// The bound of the lobe on each arc of both.
    sizes: [f64x8<S>; ARCS.len()],
}

impl<S: Simd> Ellipses<S> {
    /// The bound of the lobe on all of them.
    #[inline(always)]
    fn size(&self) -> f64x8<S> {
        let [first, second, third, fourth] = self.sizes;
        first.max(second).max(third.max(fourth))
    }
}

/// A lower bound of arsinh.
#[inline(always)]
fn low_arsinh<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let root = x.mul_add(x, f64x8::splat(simd, 1.0)).sqrt();
    x * 3.0 / (root + 2.0)
}

#[inline(always)]
fn ellipses<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    patches: &Patches<S>,
    reach: f64x8<S>,
) -> Ellipses<S> {
    let splat = |value| f64x8::splat(simd, value);
    let one = splat(1.0);
    let [down, along] = patches.half;
    let ellipse = |half: f64x8<S>, angle: f64x8<S>| {
        let minor = angle / half;
        let major = minor.mul_add(minor, one).sqrt();
        (minor + major, [major, minor])
    };
    let sine = patches.top_sine(simd);
    let per_sine = one / sine;
    let (rho_down, semi_down) = ellipse(down, low_arsinh(simd, reach));
    let (rho_along, semi_along) = ellipse(along, low_arsinh(simd, reach * per_sine));
    // The squares of how far the real part is from the middle: at rest, and times the square of the
    // cosine. θ complex, then ψ.
    let far = down * semi_down[0];
    let far_sine = (patches.sin + far).min(one);
    let turn = along * semi_along[0];
    let still = (along * along * far_sine * patches.sin).max(down * down);
    let moving = (far * far).max(turn * turn * sine * patches.sin);
    let upright = (patches.centre[2].abs() + down).min(one);
    let at = lobe.at(simd, patches.centre);
    let mut sizes = [one; ARCS.len()];
    for (index, arc) in ARCS.iter().enumerate() {
        let imaginary = reach * arc.sine;
        // Bounds of cosh − 1 on the meridian and on the parallel. A parallel grows as a whole but
        // for its height, or its horizontal part moves.
        let meridian = imaginary * imaginary * 0.5;
        let ratio = imaginary * per_sine;
        let parallel = ratio.mul_add(ratio, one).sqrt() - one;
        let (whole, horizontal) = (parallel * upright, parallel * sine);
        let near = Neighbourhood {
            real: moving.mul_add(splat(arc.cosine * arc.cosine), still).sqrt(),
            growth: whole.simd_lt(horizontal).select(parallel, meridian),
            shift: whole.min(horizontal),
            imaginary,
        };
        sizes[index] = lobe.bound(simd, &at, near);
    }
    Ellipses {
        rho: [rho_down, rho_along],
        semi: [semi_down, semi_along],
        sine: far_sine.mul_add(far_sine, reach * reach).sqrt(),
        sizes,
    }
}

/// Bounds of |f − its interpolant| on patches, on each of `DEGREES` points a side, with an ellipse of
/// about `reach`.
#[inline(always)]
pub(super) fn interpolation<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    patches: &Patches<S>,
    reach: f64x8<S>,
) -> [f64x8<S>; DEGREES.len()] {
    let near = ellipses(simd, lobe, patches, reach);
    let one = f64x8::splat(simd, 1.0);
    let mut sides = [[one; DEGREES.len()]; 2];
    for side in 0..2 {
        let [major, minor] = near.semi[side];
        let nearest = major - 1.0;
        let mut sum = f64x8::splat(simd, 0.0);
        for (index, arc) in ARCS.iter().enumerate() {
            sum += near.sizes[index] * arc.share / nearest.max(minor * arc.low_sine);
        }
        let integral = sum * major * 2.0;
        let two = near.rho[side] * near.rho[side];
        let mut power = two * two;
        for bound in &mut sides[side] {
            *bound = integral * power / (power * power - one);
            power *= two;
        }
    }
    let mut bounds = [one; DEGREES.len()];
    for (index, bound) in bounds.iter_mut().enumerate() {
        let (down, along) = (sides[0][index], sides[1][index]);
        // That in either variable may be the first.
        *bound = down.max(along) + down.min(along) * LEBESGUES[index];
    }
    bounds
}

/// A bound of the error of Gauss's rule with 1 … 6 nodes a side, over the light of the patch in θ
/// and ψ.
#[inline(always)]
pub(super) fn gauss<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    patches: &Patches<S>,
    reach: f64x8<S>,
) -> [f64x8<S>; RULES.len()] {
    let near = ellipses(simd, lobe, patches, reach);
    let size = near.size();
    let part = |rho: f64x8<S>, sine: f64x8<S>| size * sine * 4.0 / (rho - 1.0);
    let mut parts = [
        part(near.rho[0], near.sine),
        part(near.rho[1], patches.top_sine(simd)),
    ];
    let one = f64x8::splat(simd, 1.0);
    let [down, along] = near.rho;
    let shrink = [one / (down * down), one / (along * along)];
    let mut bounds = [size; RULES.len()];
    for bound in &mut bounds {
        *bound = parts[0] + parts[1];
        parts = [parts[0] * shrink[0], parts[1] * shrink[1]];
    }
    bounds
}

/// A bound of |f sin θ − the bilinear interpolant of the corners|.
#[inline(always)]
pub(super) fn bilinear<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    patches: &Patches<S>,
    reach: f64x8<S>,
) -> f64x8<S> {
    let near = ellipses(simd, lobe, patches, reach);
    let size = near.size();
    let part = |[major, minor]: [f64x8<S>; 2]| {
        (minor * minor + 0.5).sqrt() / ((major - 1.0) * minor * minor)
    };
    (part(near.semi[0]) * near.sine + part(near.semi[1]) * patches.top_sine(simd)) * size
}
