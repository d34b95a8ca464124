//! Ward's lobes for the tree.

use std::f64::consts::PI;

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::half_vector::{Half, HalfAt, HalfRange, HalfVector};
use super::lobe::Lobe;
use super::neighbourhood::Neighbourhood;
use crate::numeric::exponential::exponential;
use crate::reflectance::Ward;

/// One of Ward's lobes.
#[derive(Debug, Clone, Copy)]
pub(super) struct WardLobe {
    half: HalfVector,
    sigma: f64,
    /// All factors that do not depend on the light.
    scale: f64,
    /// The powers of [`Variant::powers`](crate::reflectance::Variant): halves of the light's
    /// cosine; of 1 + t²; and by which H_z divides.
    light: i8,
    secant: i8,
    height: i8,
}

impl WardLobe {
    /// An isotropic lobe at a normal and a view above its horizon, in the map's frame.
    pub(super) fn new(ward: &Ward, normal: DVec3, view: DVec3) -> Self {
        let half = HalfVector::new(normal, view);
        let cosine = half.cosine;
        let sigma = ward.sigma()[0];
        let share = if ward.variant().is_renormalised() {
            ward.share_above_horizon(cosine.min(1.0))
        } else {
            1.0
        };
        let powers = ward.variant().powers();
        Self {
            half,
            sigma,
            scale: powers.constant * powers.view.of(cosine) / (4.0 * PI * sigma * sigma * share),
            light: powers.light.0,
            secant: powers.secant,
            height: powers.height,
        }
    }

    /// Whether the lobe ends at the horizon in a root.
    fn has_a_root(&self) -> bool {
        self.light % 2 != 0
    }

    /// The factors beside the Gaussian, of the light's cosine, 1 + t² and 1/H_z.
    #[inline(always)]
    fn factors<S: Simd>(
        &self,
        gaussian: f64x8<S>,
        cosine: f64x8<S>,
        stretch: f64x8<S>,
        recip: f64x8<S>,
    ) -> f64x8<S> {
        let mut value = gaussian;
        for _ in 0..self.light / 2 {
            value *= cosine;
        }
        if self.has_a_root() {
            value *= cosine.sqrt();
        }
        for _ in 0..self.secant {
            value *= stretch;
        }
        for _ in 0..self.height {
            value *= recip;
        }
        value
    }

    /// A bound of the lobe over a range.
    #[inline(always)]
    fn bounded<S: Simd>(&self, simd: S, range: &HalfRange<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let exponent = range.exponent * splat(1.0 / (self.sigma * self.sigma));
        let gaussian = exponential::<S, 10>(simd, exponent.min(splat(700.0))) * splat(self.scale);
        let recip = splat(1.0) / range.up;
        let value = self.factors(gaussian, range.top, range.stretch, recip);
        let finite = splat(0.0).simd_lt(range.up) & exponent.simd_lt(splat(700.0));
        finite.select(value, splat(f64::INFINITY))
    }
}

impl Lobe for WardLobe {
    type At<S: Simd> = HalfAt<S>;

    fn normal(&self) -> DVec3 {
        self.half.normal
    }

    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        let splat = |value| f64x8::splat(simd, value);
        let Half {
            height,
            recip,
            square,
        } = self.half.of(simd, light);
        let sharpness = -1.0 / (self.sigma * self.sigma);
        let gaussian = exponential::<S, 10>(simd, square * splat(sharpness)) * splat(self.scale);
        let cosine = if self.has_a_root() {
            height.max(splat(0.0))
        } else {
            height
        };
        [self.factors(gaussian, cosine, square + 1.0, recip); 3]
    }

    #[inline(always)]
    fn size<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], radius: f64x8<S>) -> f64x8<S> {
        self.bounded(simd, &self.half.above(simd, centre, radius))
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3]) -> HalfAt<S> {
        self.half.at(simd, centre)
    }

    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, at: &HalfAt<S>, near: Neighbourhood<S>) -> f64x8<S> {
        let range = self.half.near(simd, at, near);
        let value = self.bounded(simd, &range);
        if self.has_a_root() {
            // The root is analytic where the height's real part is positive.
            let smooth = f64x8::splat(simd, 0.0).simd_lt(range.least);
            return smooth.select(value, f64x8::splat(simd, f64::INFINITY));
        }
        value
    }

    #[inline(always)]
    fn at_the_horizon<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        real: f64x8<S>,
        depth: f64x8<S>,
    ) -> f64x8<S> {
        if self.has_a_root() {
            return f64x8::splat(simd, f64::INFINITY);
        }
        self.bounded(simd, &self.half.at_the_horizon(simd, centre, real, depth))
    }

    #[inline(always)]
    fn over_height<S: Simd>(&self, simd: S, at: &HalfAt<S>, near: Neighbourhood<S>) -> f64x8<S> {
        if self.light != 2 {
            return f64x8::splat(simd, f64::INFINITY);
        }
        let range = self.half.near(simd, at, near);
        let top = f64x8::splat(simd, 1.0);
        self.bounded(simd, &HalfRange { top, ..range })
    }

    #[inline(always)]
    fn reach<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], order: f64) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let half = self.half.of(simd, centre);
        // The imaginary part of the slope at which the Gaussian has grown as much as the power has;
        // in the tail, the whole move.
        let near = splat(self.sigma * (0.5 * order).sqrt());
        let far = splat(0.5 * order * self.sigma * self.sigma) / half.square.sqrt();
        let reach = self.half.reach(simd, &half, near.min(far));
        if self.has_a_root() {
            return reach.min(half.height * splat(0.6));
        }
        reach
    }

    fn rounding(&self) -> f64 {
        1e-12 + 4e-15 / (self.sigma * self.half.cosine)
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::super::sampled_bound;
    use super::*;
    use crate::reflectance::Variant;

    /// The lobe's formula at a complex vector.
    fn complex(lobe: &WardLobe, light: [Complex64; 3]) -> f64 {
        let [cosine, up, square] = lobe.half.complex(light);
        let gaussian = (-square / (lobe.sigma * lobe.sigma)).exp() * lobe.scale;
        let value = gaussian
            * cosine.powf(0.5 * f64::from(lobe.light))
            * (square + 1.0).powi(i32::from(lobe.secant))
            / up.powi(i32::from(lobe.height));
        value.norm()
    }

    #[test]
    fn no_complex_vector_passes_the_bound() {
        let lobe = |index: usize, normal, view| {
            let sigma = [0.01, 0.05, 0.3, 1.0][index % 4];
            let ward = Ward::isotropic(Variant::ALL[index / 4 % 4], sigma).unwrap();
            (WardLobe::new(&ward, normal, view), sigma)
        };
        let (finite, closest) = sampled_bound::check(lobe, complex);
        assert!(finite > 1000 && closest > 0.3, "{finite}, {closest}");
    }
}
