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
    /// at most `away` from a unit vector.
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
        // 1 + t² is 2 (1 + v·i) over the square of the height.
        let stretch = stretch.min((away + splat(2.0)) * splat(2.0) * recip * recip);
        let value = self.factors(gaussian, height, stretch, recip);
        let finite = splat(0.0).simd_lt(up) & exponent.simd_lt(splat(700.0));
        finite.select(value, splat(f64::INFINITY))
    }
}

impl Lobe for WardLobe {
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
    fn bound<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], near: Neighbourhood<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let (height, _, square) = self.half(simd, centre);
        let Neighbourhood {
            still,
            moving,
            imaginary,
        } = near;
        let real = still + moving;
        let centre_up = height + splat(self.cosine);
        let (zero, one) = (splat(0.0), splat(1.0));
        let plain = imaginary.simd_eq(zero);
        // Above the horizon the half vector is no lower than the view.
        let lowest = centre_up - real;
        let up = plain.select(lowest.max(splat(self.cosine)), lowest);
        let long = (square + one).sqrt() / up;
        // Of D/(h + δ): docs/reference/rendering-bound.md. Of a centre that is lower than any light
        // above the horizon the slope says nothing.
        let known = centre_up.simd_gt(splat(1e-6));
        let still_slope = known.select(
            long * imaginary.mul_add(imaginary / up, still),
            splat(1e100),
        );
        let moving_slope = long * moving;
        let turned = long * imaginary * (real / up + one);
        let slope = square.sqrt();
        // The largest of P² (1 − c²) − (u − Q c)₊² over c from 0 to 1.
        let rest = slope - still_slope;
        let squares = turned.mul_add(turned, moving_slope * moving_slope);
        let inside = turned * turned * (one - rest * rest / squares.max(splat(1e-300)));
        let end = rest - moving_slope;
        let at_end = (moving_slope * rest).simd_ge(squares);
        let most = rest
            .simd_gt(zero)
            .select(at_end.select(-(end * end), inside), turned * turned);
        let top = height + real;
        let size = top.mul_add(top, imaginary * imaginary).sqrt();
        let highest = plain.select(top.max(zero), size);
        let farthest = still_slope + moving_slope;
        let stretch = (slope + farthest).mul_add(slope + farthest, turned.mul_add(turned, one));
        let value = self.bounded(simd, most, stretch, up, highest, real + imaginary);
        if self.has_a_root() {
            // The root is analytic where the height's real part is positive.
            let smooth = plain | (height - real).simd_gt(zero);
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
        let lowest = height + splat(self.cosine) - real;
        let long = (square + splat(1.0)).sqrt();
        let moved = long * real / lowest;
        let up = lowest.max(splat(self.cosine) - depth);
        let slope = square.sqrt();
        let least = (slope - moved).max(splat(0.0));
        let most = slope + moved;
        let stretch = most.mul_add(most, splat(1.0));
        let value = self.bounded(simd, -(least * least), stretch, up, depth, real);
        splat(0.0)
            .simd_lt(lowest)
            .select(value, splat(f64::INFINITY))
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
        // A reach of x moves the slope by x/(1 − x)², over the height of the half vector.
        let four = slope.mul_add(splat(4.0), splat(1.0)).sqrt();
        let reach = up * (slope * 2.0 + 1.0 - four) / (slope * 2.0);
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
    fn no_complex_direction_passes_the_bound() {
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
            let (still, moving, imaginary) = (size * unit(), size * unit(), size * unit() + 1e-9);
            let bound = dispatch!(vectors::level(), simd => {
                let splat = |value| f64x8::splat(simd, value);
                let near = Neighbourhood {
                    still: splat(still),
                    moving: splat(moving),
                    imaginary: splat(imaginary),
                };
                let centre = [splat(centre.x), splat(centre.y), splat(centre.z)];
                lobe.bound(simd, centre, near).reduce_max()
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
                let (away, sideways) = (direction(), direction());
                let (sin, cos) = (1.6 * unit()).min(std::f64::consts::FRAC_PI_2).sin_cos();
                let x = centre + away * (still + moving * cos);
                let value = complex(&lobe, x, sideways * (imaginary * sin));
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
