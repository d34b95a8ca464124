//! Ward's lobes for the tree.

use std::f64::consts::PI;

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::lobe::{Lobe, dot};
use super::neighbourhood::Neighbourhood;
use crate::numeric::exponential::exponential;
use crate::reflectance::Ward;

/// One of Ward's lobes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WardLobe {
    normal: DVec3,
    /// The direction of the view's projection on the surface; any, if it has none. And across both.
    forward: DVec3,
    aside: DVec3,
    /// The view's cosine and sine.
    cosine: f64,
    sine: f64,
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
    pub(crate) fn new(ward: &Ward, normal: DVec3, view: DVec3) -> Self {
        let cosine = normal.dot(view);
        let sigma = ward.sigma()[0];
        let forward = (view - cosine * normal)
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        let share = if ward.variant().is_renormalised() {
            ward.share_above_horizon(cosine.min(1.0))
        } else {
            1.0
        };
        let powers = ward.variant().powers();
        Self {
            normal,
            forward,
            aside: normal.cross(forward),
            cosine,
            sine: view.dot(forward),
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

    /// The height of the half vector v + i over the surface, and the square of its slope.
    #[inline(always)]
    fn half<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> (f64x8<S>, f64x8<S>, f64x8<S>) {
        let height = dot(simd, self.normal, light, 0.0);
        let forward = dot(simd, self.forward, light, self.sine);
        let aside = dot(simd, self.aside, light, 0.0);
        let up = height + f64x8::splat(simd, self.cosine);
        let recip = f64x8::splat(simd, 1.0) / up;
        let square = forward.mul_add(forward, aside * aside) * recip * recip;
        (height, recip, square)
    }

    /// A bound of the lobe where −Re t² is at most `exponent` and |1 + t²| at most `stretch`, the
    /// half vector's height is at least `up`, the light's at most `height` in size, and the light
    /// at most `away` from a direction.
    #[inline(always)]
    fn bounded<S: Simd>(
        &self,
        simd: S,
        exponent: f64x8<S>,
        stretch: f64x8<S>,
        up: f64x8<S>,
        height: f64x8<S>,
        away: f64x8<S>,
    ) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let exponent = exponent * splat(1.0 / (self.sigma * self.sigma));
        let gaussian = exponential::<S, 10>(simd, exponent.min(splat(700.0))) * splat(self.scale);
        let recip = splat(1.0) / up;
        // 1 + t² is the square of the half vector over that of its height.
        let longest = (away + splat(2.0)) * recip;
        let stretch = stretch.min(longest * longest);
        let value = self.factors(gaussian, height, stretch, recip);
        let finite = splat(0.0).simd_lt(up) & exponent.simd_lt(splat(700.0));
        finite.select(value, splat(f64::INFINITY))
    }
}

/// √(1 − h²): how far a direction of height h is from the normal's axis.
#[inline(always)]
fn beside<S: Simd>(simd: S, height: f64x8<S>) -> f64x8<S> {
    let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
    (one - height * height).max(zero).sqrt()
}

/// No direction within a chord of `radius` of one of this height is lower.
#[inline(always)]
fn lowest<S: Simd>(simd: S, height: f64x8<S>, beside: f64x8<S>, radius: f64x8<S>) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    // The cosine of the sum of two angles that do not come to π; else the chord itself.
    let turned = height * (radius * radius).mul_add(splat(-0.5), splat(1.0)) - beside * radius;
    let plain = height - radius;
    (splat(-0.5).simd_lt(height) & radius.simd_lt(splat(1.0))).select(turned.max(plain), plain)
}

/// A Ward lobe about a direction.
#[derive(Clone, Copy)]
pub(crate) struct WardAt<S: Simd> {
    /// The height of the light, √(1 − height²), the half vector's slope μ in size, and √(1 + μ²).
    height: f64x8<S>,
    beside: f64x8<S>,
    slope: f64x8<S>,
    long: f64x8<S>,
}

impl Lobe for WardLobe {
    type At<S: Simd> = WardAt<S>;

    fn normal(&self) -> DVec3 {
        self.normal
    }

    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let (height, recip, square) = self.half(simd, light);
        let sharpness = -1.0 / (self.sigma * self.sigma);
        let gaussian = exponential::<S, 10>(simd, square * splat(sharpness)) * splat(self.scale);
        let cosine = if self.has_a_root() {
            height.max(splat(0.0))
        } else {
            height
        };
        self.factors(gaussian, cosine, square + 1.0, recip)
    }

    #[inline(always)]
    fn size<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], radius: f64x8<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let (height, _, square) = self.half(simd, centre);
        let centre_up = height + splat(self.cosine);
        // Above the horizon the half vector is no lower than the view.
        let lowest = lowest(simd, height, beside(simd, height), radius);
        let up = lowest.max(splat(0.0)) + splat(self.cosine);
        let moved = (square + splat(1.0)).sqrt() * radius / up;
        // Of a centre that is lower than any light above the horizon the slope says nothing.
        let known = centre_up.simd_gt(splat(1e-6));
        let moved = known.select(moved, splat(1e100));
        let slope = square.sqrt();
        let least = (slope - moved).max(splat(0.0));
        let stretch = (slope + moved).mul_add(slope + moved, splat(1.0));
        let top = (height + radius).max(splat(0.0)).min(splat(1.0));
        self.bounded(simd, -(least * least), stretch, up, top, splat(0.0))
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3]) -> WardAt<S> {
        let (height, _, square) = self.half(simd, centre);
        WardAt {
            height,
            beside: beside(simd, height),
            slope: square.sqrt(),
            long: (square + 1.0).sqrt(),
        }
    }

    /// Step by step as docs/reference/rendering-bound.md has it.
    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, at: &WardAt<S>, near: Neighbourhood<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let Neighbourhood {
            real,
            growth,
            shift,
            imaginary,
        } = near;
        let (zero, one) = (splat(0.0), splat(1.0));
        // Of the real direction x: its height, how far its slope is from the centre's, its slope,
        // √(1 + slope²) and its distance from the normal's axis.
        let low = lowest(simd, at.height, at.beside, real);
        let moved = at.long * real / (low + splat(self.cosine));
        let steep = at.slope + moved;
        let long = (at.long + moved).min(steep.mul_add(steep * 0.5, one));
        let sideways = (at.beside + real).min(one);
        // From x to the complex vector.
        let up = low + splat(self.cosine) + (low.min(zero) * growth - shift);
        let recip = one / up;
        let turned = imaginary * recip;
        let away = long.mul_add(shift, growth * long.min(sideways + steep)) * recip;
        let more = long.mul_add(turned * turned * sideways, away);
        let turned = turned * away.mul_add(sideways, long);
        let rest = (at.slope - moved - more).max(zero);
        let exponent = turned.mul_add(turned, -(rest * rest));
        let steep = steep + more;
        let stretch = steep.mul_add(steep, turned.mul_add(turned, one));
        let top = (at.height.abs() + real).min(one);
        let top = growth.mul_add(top, top) + shift;
        // √(a² + b²) ≤ max + (√2 − 1) min.
        let top = top.max(imaginary) + top.min(imaginary) * 0.4143;
        let value = self.bounded(simd, exponent, stretch, up, top, growth + shift + imaginary);
        if self.has_a_root() {
            // The root is analytic where the height's real part is positive.
            let smooth = zero.simd_lt(low - shift);
            return smooth.select(value, splat(f64::INFINITY));
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
        let splat = |value| f64x8::splat(simd, value);
        if self.has_a_root() {
            return splat(f64::INFINITY);
        }
        let (height, _, square) = self.half(simd, centre);
        let low = lowest(simd, height, beside(simd, height), real).max(-depth);
        let up = low + splat(self.cosine);
        let moved = (square + splat(1.0)).sqrt() * real / up;
        let slope = square.sqrt();
        let least = (slope - moved).max(splat(0.0));
        let most = slope + moved;
        let stretch = most.mul_add(most, splat(1.0));
        let value = self.bounded(simd, -(least * least), stretch, up, depth, splat(0.0));
        let known = (height + splat(self.cosine)).simd_gt(splat(1e-6));
        known.select(value, splat(f64::INFINITY))
    }

    #[inline(always)]
    fn reach<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], order: f64) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let (height, _, square) = self.half(simd, centre);
        let up = height + splat(self.cosine);
        // The imaginary part of the slope at which the Gaussian has grown as much as the power has;
        // in the tail, the whole move.
        let near = splat(self.sigma * (0.5 * order).sqrt());
        let far = splat(0.5 * order * self.sigma * self.sigma) / square.sqrt();
        let slope = near.min(far) / (square + splat(1.0)).sqrt();
        // The real part moves about half as far, which lowers the half vector.
        let lowered = (beside(simd, height) + 0.35) * slope * 1.3 + 1.0;
        let reach = (up * slope * 0.9 / lowered).min(up * 0.4).max(splat(1e-9));
        if self.has_a_root() {
            return reach.min(height * splat(0.6));
        }
        reach
    }

    fn rounding(&self) -> f64 {
        1e-12 + 4e-15 / (self.sigma * self.cosine)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use num_complex::Complex64;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::reflectance::Variant;
    use crate::vectors;

    /// The lobe's formula at a complex vector.
    fn complex(lobe: &WardLobe, x: DVec3, y: DVec3) -> f64 {
        let part = |axis: DVec3, offset: f64| Complex64::new(axis.dot(x) + offset, axis.dot(y));
        let cosine = part(lobe.normal, 0.0);
        let up = cosine + lobe.cosine;
        let (forward, aside) = (part(lobe.forward, lobe.sine), part(lobe.aside, 0.0));
        let square = (forward * forward + aside * aside) / (up * up);
        let gaussian = (-square / (lobe.sigma * lobe.sigma)).exp() * lobe.scale;
        let value = gaussian
            * cosine.powf(0.5 * f64::from(lobe.light))
            * (square + 1.0).powi(i32::from(lobe.secant))
            / up.powi(i32::from(lobe.height));
        value.norm()
    }

    #[test]
    fn no_complex_vector_passes_the_bound() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut unit = || random.random::<f64>();
        let (mut finite, mut closest) = (0, 0.0f64);
        for index in 0..4000 {
            let mut direction = || {
                let (z, turn) = (2.0 * unit() - 1.0, 6.3 * unit());
                let across = (1.0 - z * z).sqrt();
                DVec3::new(across * turn.cos(), across * turn.sin(), z)
            };
            let (normal, mut view) = (direction(), direction());
            if normal.dot(view) < 0.0 {
                view = -view;
            }
            let mirror = 2.0 * normal.dot(view) * normal - view;
            let sigma = [0.01, 0.05, 0.3, 1.0][index % 4];
            let centre = (mirror + 2.0 * sigma * direction()).normalize();
            let ward = Ward::isotropic(Variant::ALL[index / 4 % 4], sigma).unwrap();
            let lobe = WardLobe::new(&ward, normal, view);
            let size = sigma * (2.0 * unit());
            let [real, growth, shift] = [1.0, 0.2, 0.2].map(|part| part * size * unit());
            let imaginary = size * unit() + 1e-9;
            let bound = dispatch!(vectors::level(), simd => {
                let splat = |value| f64x8::splat(simd, value);
                let near = Neighbourhood {
                    real: splat(real),
                    growth: splat(growth),
                    shift: splat(shift),
                    imaginary: splat(imaginary),
                };
                let centre = [splat(centre.x), splat(centre.y), splat(centre.z)];
                lobe.bound(simd, &lobe.at(simd, centre), near).reduce_max()
            });
            if bound.is_infinite() {
                continue;
            }
            finite += 1;
            for _ in 0..50 {
                let mut direction = || {
                    let (z, turn) = (2.0 * unit() - 1.0, 6.3 * unit());
                    let across = (1.0 - z * z).sqrt();
                    DVec3::new(across * turn.cos(), across * turn.sin(), z)
                };
                let (tangent, aside, pushed) = (direction(), direction(), direction());
                // A direction at a chord of at most `real`, and one across it.
                let chord = (real * unit()).min(2.0);
                let along = tangent.reject_from(centre).normalize();
                let square = 0.5 * chord * chord;
                let light =
                    centre * (1.0 - square) + along * (square * (2.0 - square)).max(0.0).sqrt();
                let across = aside.reject_from(light).normalize();
                let x = light * (1.0 + growth * unit()) + pushed * (shift * unit());
                let value = complex(&lobe, x, across * (imaginary * unit().sqrt()));
                closest = closest.max(value / bound);
                assert!(
                    value <= bound * (1.0 + 1e-11),
                    "{lobe:?}: {value:e}, {bound:e}"
                );
            }
        }
        assert!(finite > 1000 && closest > 0.3, "{finite}, {closest}");
    }
}
