//! How wrong a patch of light may be when it is taken whole: the bounds of
//! docs/reference/rendering-bound.md.

use fearless_simd::{f64x8, prelude::*};

use super::lobe::Lobe;
use super::neighbourhood::Neighbourhood;
use super::tree::POINTS;

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

/// The largest sum of Lagrange's polynomials in size on 8 Chebyshev points: 2.2871.
pub(super) const LEBESGUE: f64 = 2.288;

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

/// That of patches, and what it is in Bernstein's ellipses.
#[derive(Clone, Copy)]
struct Ellipses<S: Simd> {
    near: Neighbourhood<S>,
    /// ρ of the ellipses of θ and of ψ, and half the sum and half the difference of ρ and 1/ρ.
    rho: [f64x8<S>; 2],
    semi: [[f64x8<S>; 2]; 2],
    /// The largest |sin θ| of the complex θ.
    sine: f64x8<S>,
}

/// A lower bound of arsinh.
#[inline(always)]
fn low_arsinh<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let root = x.mul_add(x, f64x8::splat(simd, 1.0)).sqrt();
    x * 3.0 / (root + 2.0)
}

#[inline(always)]
fn ellipses<S: Simd>(simd: S, patches: &Patches<S>, reach: f64x8<S>) -> Ellipses<S> {
    let splat = |value| f64x8::splat(simd, value);
    let one = splat(1.0);
    let [down, along] = patches.half;
    let squared = reach * reach;
    let ellipse = |half: f64x8<S>, angle: f64x8<S>| {
        let minor = angle / half;
        let major = minor.mul_add(minor, one).sqrt();
        (minor + major, [major, minor])
    };
    let sine = patches.top_sine(simd);
    let (rho_down, semi_down) = ellipse(down, low_arsinh(simd, reach));
    let (rho_along, semi_along) = ellipse(along, low_arsinh(simd, reach / sine));
    // θ complex: the middle of what is real moves by the major semi-axis.
    let far = down * semi_down[0];
    let far_sine = (patches.sin + far).min(one);
    let still_down = along * (far_sine * patches.sin).sqrt() + ((squared + one).sqrt() - one);
    // ψ complex.
    let turn = along * semi_along[0] * (sine * patches.sin).sqrt();
    let still_along = down + ((squared + sine * sine).sqrt() - sine);
    Ellipses {
        near: Neighbourhood {
            still: still_down.max(still_along),
            moving: far.max(turn),
            imaginary: reach,
        },
        rho: [rho_down, rho_along],
        semi: [semi_down, semi_along],
        sine: far_sine.mul_add(far_sine, squared).sqrt(),
    }
}

#[inline(always)]
fn power<S: Simd>(x: f64x8<S>, order: usize) -> f64x8<S> {
    let mut product = x;
    for _ in 1..order {
        product *= x;
    }
    product
}

/// |f − interpolant| over |f| on the ellipse, of interpolation at `POINTS` Chebyshev points.
#[inline(always)]
fn hermite<S: Simd>(simd: S, rho: f64x8<S>, [major, minor]: [f64x8<S>; 2]) -> f64x8<S> {
    let (power, one) = (power(rho, POINTS), f64x8::splat(simd, 1.0));
    let length = (minor * minor + 0.5).sqrt() * 2.0;
    length / ((major - 1.0) * (power - one / power))
}

/// A bound of |f − its interpolant| on patches whose weights are kept, with an ellipse of about
/// `reach`.
#[inline(always)]
pub(super) fn interpolation<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    patches: &Patches<S>,
    reach: f64x8<S>,
) -> f64x8<S> {
    let near = ellipses(simd, patches, reach);
    let size = lobe.bound(simd, patches.centre, near.near);
    let [down, along] = near.rho;
    (hermite(simd, down, near.semi[0]) + hermite(simd, along, near.semi[1]) * LEBESGUE) * size
}

/// A bound of the error of Gauss's rule with 1 … 4 nodes a side, over the light of the patch in θ
/// and ψ.
#[inline(always)]
pub(super) fn gauss<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    patches: &Patches<S>,
    reach: f64x8<S>,
) -> [f64x8<S>; 4] {
    let near = ellipses(simd, patches, reach);
    let size = lobe.bound(simd, patches.centre, near.near);
    let part = |rho: f64x8<S>, sine: f64x8<S>| size * sine * 4.0 / (rho - 1.0);
    let mut parts = [
        part(near.rho[0], near.sine),
        part(near.rho[1], patches.top_sine(simd)),
    ];
    let shrink = near.rho.map(|rho| f64x8::splat(simd, 1.0) / (rho * rho));
    let mut bounds = [size; 4];
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
    let near = ellipses(simd, patches, reach);
    let size = lobe.bound(simd, patches.centre, near.near);
    let part = |[major, minor]: [f64x8<S>; 2]| {
        (minor * minor + 0.5).sqrt() / ((major - 1.0) * minor * minor)
    };
    (part(near.semi[0]) * near.sine + part(near.semi[1]) * patches.top_sine(simd)) * size
}
