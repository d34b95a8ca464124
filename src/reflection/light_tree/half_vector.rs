//! The half vector of view and light over a surface, and how far it goes where the light does.

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::lobe::dot;
use super::neighbourhood::Neighbourhood;

/// A normal and a view above its horizon, in the map's frame: what H = v + ω is measured in.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfVector {
    pub(super) normal: DVec3,
    /// The direction of the view's projection on the surface; any, if it has none. And across both.
    forward: DVec3,
    aside: DVec3,
    /// The view's cosine and sine.
    pub(super) cosine: f64,
    sine: f64,
}

/// H for one light: the light's height, 1/H_z, and the square of the slope μ = H_T/H_z.
#[derive(Clone, Copy)]
pub(super) struct Half<S: Simd> {
    pub(super) height: f64x8<S>,
    pub(super) recip: f64x8<S>,
    pub(super) square: f64x8<S>,
}

/// What bounds about one direction have in common: the height of the light, √(1 − height²), |μ|,
/// and √(1 + μ²).
#[derive(Clone, Copy)]
pub(super) struct HalfAt<S: Simd> {
    height: f64x8<S>,
    beside: f64x8<S>,
    slope: f64x8<S>,
    long: f64x8<S>,
}

/// How long a tangential part T of H counts: |A T|, by what the two parts of A T are of those of T
/// along the view's projection and across it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measure {
    pub(super) parts: [[f64; 2]; 2],
    /// |A T| is at most this times |T|.
    pub(super) most: f64,
}

impl Measure {
    /// Along a unit tangent, of these parts, a length counts by `stretch`, and across it by the
    /// inverse.
    pub(super) fn new([forward, aside]: [f64; 2], stretch: f64) -> Self {
        let shrink = stretch.recip();
        Self {
            parts: [
                [stretch * forward, stretch * aside],
                [-shrink * aside, shrink * forward],
            ],
            most: stretch.max(shrink),
        }
    }

    /// |A T|².
    #[inline(always)]
    pub(super) fn square<S: Simd>(&self, forward: f64x8<S>, aside: f64x8<S>) -> f64x8<S> {
        let [along, across] = self.parts.map(|[f, a]| forward * f + aside * a);
        along.mul_add(along, across * across)
    }
}

/// What bounds about one direction have in common that keep from the slope: the height of the
/// light, √(1 − height²), |A H_T|, |H|, and the norm of A.
#[derive(Clone, Copy)]
pub(super) struct LengthsAt<S: Simd> {
    height: f64x8<S>,
    beside: f64x8<S>,
    tangent: f64x8<S>,
    length: f64x8<S>,
    most: f64x8<S>,
}

/// Bounds of the half vector over some lights, real or complex, that keep from the slope: they hold
/// where H has no height.
#[derive(Clone, Copy)]
pub(super) struct LengthsRange<S: Simd> {
    /// Re H_z and the length of the real part of A H_T are at least this, or there is none.
    pub(super) up: f64x8<S>,
    pub(super) tangent: f64x8<S>,
    /// The length of the imaginary part of H is at most this.
    pub(super) aside: f64x8<S>,
    /// |H·H| is at most this.
    pub(super) square: f64x8<S>,
    /// The real part of the light's height is at least this, its imaginary part at most that, its
    /// size at most the last.
    pub(super) least: f64x8<S>,
    pub(super) imaginary: f64x8<S>,
    pub(super) top: f64x8<S>,
    /// |H| at the centre, and how far the light is from the centre at most.
    pub(super) length: f64x8<S>,
    pub(super) away: f64x8<S>,
}

/// Bounds over some lights, real or complex.
#[derive(Clone, Copy)]
pub(super) struct HalfRange<S: Simd> {
    /// Re t² is at least minus this, t² = μ·μ.
    pub(super) exponent: f64x8<S>,
    /// |1 + t²| is at most this.
    pub(super) stretch: f64x8<S>,
    /// Re H_z is at least this; where it is not above 0 there are no bounds.
    pub(super) up: f64x8<S>,
    /// The real part of the light's height is at least this, its size at most that.
    pub(super) least: f64x8<S>,
    pub(super) top: f64x8<S>,
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

/// Bounds of the heights of the lights of a complex neighbourhood.
struct Heights<S: Simd> {
    /// No real direction x of it is lower, and none is farther from the normal's axis.
    low: f64x8<S>,
    sideways: f64x8<S>,
    /// The real part of a height is at least this, its size at most that.
    least: f64x8<S>,
    top: f64x8<S>,
}

impl<S: Simd> Heights<S> {
    /// About a direction of this height.
    #[inline(always)]
    fn near(simd: S, height: f64x8<S>, beside: f64x8<S>, near: Neighbourhood<S>) -> Self {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let low = lowest(simd, height, beside, near.real);
        let top = (height.abs() + near.real).min(one);
        let top = near.growth.mul_add(top, top) + near.shift;
        Self {
            low,
            sideways: (beside + near.real).min(one),
            least: low + (low.min(zero) * near.growth - near.shift),
            // √(a² + b²) ≤ max + (√2 − 1) min.
            top: top.max(near.imaginary) + top.min(near.imaginary) * 0.4143,
        }
    }
}

impl HalfVector {
    pub(super) fn new(normal: DVec3, view: DVec3) -> Self {
        let cosine = normal.dot(view);
        let forward = (view - cosine * normal)
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        Self {
            normal,
            forward,
            aside: normal.cross(forward),
            cosine,
            sine: view.dot(forward),
        }
    }

    /// Normal, forward and aside, and what is added to the light's parts along them to give those
    /// of H, but for the normal.
    #[cfg(test)]
    pub(super) fn axes(&self) -> ([DVec3; 3], [f64; 3]) {
        (
            [self.normal, self.forward, self.aside],
            [0.0, self.sine, 0.0],
        )
    }

    /// The light's height, and the parts of H_T along the view's projection and across it.
    #[inline(always)]
    pub(super) fn parts<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        [
            dot(simd, self.normal, light, 0.0),
            dot(simd, self.forward, light, self.sine),
            dot(simd, self.aside, light, 0.0),
        ]
    }

    /// The parts of a direction of the surface along the view's projection and across it, and what
    /// the first has of H_T for being that of H and not of the light.
    pub(super) fn tangential(&self, direction: DVec3) -> [f64; 3] {
        let forward = direction.dot(self.forward);
        [forward, direction.dot(self.aside), forward * self.sine]
    }

    #[inline(always)]
    pub(super) fn of<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> Half<S> {
        let [height, forward, aside] = self.parts(simd, light);
        let up = height + f64x8::splat(simd, self.cosine);
        let recip = f64x8::splat(simd, 1.0) / up;
        let square = forward.mul_add(forward, aside * aside) * recip * recip;
        Half {
            height,
            recip,
            square,
        }
    }

    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3]) -> HalfAt<S> {
        let Half { height, square, .. } = self.of(simd, centre);
        HalfAt {
            height,
            beside: beside(simd, height),
            slope: square.sqrt(),
            long: (square + 1.0).sqrt(),
        }
    }

    #[inline(always)]
    pub(super) fn lengths_at<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        measure: &Measure,
    ) -> LengthsAt<S> {
        let [height, forward, aside] = self.parts(simd, centre);
        let up = height + f64x8::splat(simd, self.cosine);
        let square = forward.mul_add(forward, aside * aside);
        LengthsAt {
            height,
            beside: beside(simd, height),
            tangent: measure.square(forward, aside).sqrt(),
            length: up.mul_add(up, square).sqrt(),
            most: f64x8::splat(simd, measure.most),
        }
    }

    /// Over the real directions within a chord of `radius` whose height is from `floor` to `top`, a
    /// bound of its size.
    #[inline(always)]
    pub(super) fn lengths_over<S: Simd>(
        &self,
        simd: S,
        at: &LengthsAt<S>,
        radius: f64x8<S>,
        floor: f64x8<S>,
        top: f64x8<S>,
    ) -> LengthsRange<S> {
        let zero = f64x8::splat(simd, 0.0);
        let least = lowest(simd, at.height, at.beside, radius).max(floor);
        let longest = at.length + radius;
        LengthsRange {
            up: least + f64x8::splat(simd, self.cosine),
            tangent: (at.tangent - at.most * radius).max(zero),
            aside: zero,
            square: longest * longest,
            least,
            imaginary: zero,
            top,
            length: at.length,
            away: radius,
        }
    }

    /// Over the real directions above the horizon within a chord of `radius` of the centre.
    #[inline(always)]
    pub(super) fn lengths_above<S: Simd>(
        &self,
        simd: S,
        at: &LengthsAt<S>,
        radius: f64x8<S>,
    ) -> LengthsRange<S> {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let top = (at.height + radius).max(zero).min(one);
        self.lengths_over(simd, at, radius, zero, top)
    }

    /// Over a complex neighbourhood.
    #[inline(always)]
    pub(super) fn lengths_near<S: Simd>(
        &self,
        simd: S,
        at: &LengthsAt<S>,
        near: Neighbourhood<S>,
    ) -> LengthsRange<S> {
        let Neighbourhood {
            real,
            growth,
            shift,
            imaginary,
        } = near;
        let Heights {
            sideways,
            least,
            top,
            ..
        } = Heights::near(simd, at.height, at.beside, near);
        let zero = f64x8::splat(simd, 0.0);
        let moved = real + growth + shift;
        let longest = at.length + moved;
        LengthsRange {
            up: least + f64x8::splat(simd, self.cosine),
            tangent: (at.tangent - at.most * (real + growth * sideways + shift)).max(zero),
            aside: imaginary,
            square: longest.mul_add(longest, imaginary * imaginary),
            least,
            imaginary: imaginary * sideways,
            top,
            length: at.length,
            away: moved.mul_add(moved, imaginary * imaginary).sqrt(),
        }
    }

    /// Over the real directions within a chord of `radius` that are not lower than `floor`, which
    /// is above −c_v; a bound of their height in size is `top`.
    #[inline(always)]
    fn real<S: Simd>(
        &self,
        simd: S,
        at: &HalfAt<S>,
        radius: f64x8<S>,
        floor: f64x8<S>,
        top: f64x8<S>,
    ) -> HalfRange<S> {
        let splat = |value| f64x8::splat(simd, value);
        let zero = splat(0.0);
        let least = lowest(simd, at.height, at.beside, radius).max(floor);
        let up = least + splat(self.cosine);
        let centre = at.height + splat(self.cosine);
        // Of a centre that is lower than any light that counts the slope says nothing.
        let known = centre.simd_gt(splat(1e-6));
        let moved = known.select(at.long * radius / up, splat(1e100));
        let low = (at.slope - moved).max(zero);
        let steep = at.slope + moved;
        let recip = splat(1.0) / up;
        // 1 + t² is the square of the half vector, of at most twice its length, over H_z².
        let longest = recip * recip * 4.0;
        HalfRange {
            exponent: -(low * low),
            stretch: steep.mul_add(steep, splat(1.0)).min(longest),
            up,
            least,
            top,
        }
    }

    /// Over the real directions above the horizon within a chord of `radius` of the centre.
    #[inline(always)]
    pub(super) fn above<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        radius: f64x8<S>,
    ) -> HalfRange<S> {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let at = self.at(simd, centre);
        let top = (at.height + radius).max(zero).min(one);
        self.real(simd, &at, radius, zero, top)
    }

    /// Over the real directions within a chord of `radius` whose height is from −`depth` to
    /// `depth`.
    #[inline(always)]
    pub(super) fn at_the_horizon<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        radius: f64x8<S>,
        depth: f64x8<S>,
    ) -> HalfRange<S> {
        let at = self.at(simd, centre);
        self.real(simd, &at, radius, -depth, depth)
    }

    /// Over a complex neighbourhood, step by step as docs/reference/rendering-bound.md has it.
    #[inline(always)]
    pub(super) fn near<S: Simd>(
        &self,
        simd: S,
        at: &HalfAt<S>,
        near: Neighbourhood<S>,
    ) -> HalfRange<S> {
        let splat = |value| f64x8::splat(simd, value);
        let Neighbourhood {
            real,
            growth,
            shift,
            imaginary,
        } = near;
        let (zero, one) = (splat(0.0), splat(1.0));
        let cosine = splat(self.cosine);
        let Heights {
            low,
            sideways,
            least,
            top,
        } = Heights::near(simd, at.height, at.beside, near);
        // Of the real direction x: how far its slope is from the centre's, its slope, and
        // √(1 + slope²).
        let moved = at.long * real / (low + cosine);
        let steep = at.slope + moved;
        let long = (at.long + moved).min(steep.mul_add(steep * 0.5, one));
        // From x to the complex vector.
        let up = least + cosine;
        let recip = one / up;
        let turned = imaginary * recip;
        let away = long.mul_add(shift, growth * long.min(sideways + steep)) * recip;
        let more = long.mul_add(turned * turned * sideways, away);
        let turned = turned * away.mul_add(sideways, long);
        let rest = (at.slope - moved - more).max(zero);
        let steep = steep + more;
        let stretch = steep.mul_add(steep, turned.mul_add(turned, one));
        let longest = (growth + shift + imaginary + 2.0) * recip;
        HalfRange {
            exponent: turned.mul_add(turned, -(rest * rest)),
            stretch: stretch.min(longest * longest),
            up,
            least,
            top,
        }
    }

    /// About the imaginary part of the light's direction at which that of the slope is `slope`.
    #[inline(always)]
    pub(super) fn reach<S: Simd>(&self, simd: S, half: &Half<S>, slope: f64x8<S>) -> f64x8<S> {
        let splat = |value| f64x8::splat(simd, value);
        let up = half.height + splat(self.cosine);
        let slope = slope / (half.square + 1.0).sqrt();
        // The real part moves about half as far, which lowers the half vector.
        let lowered = (beside(simd, half.height) + 0.35) * slope * 1.3 + 1.0;
        (up * slope * 0.9 / lowered).min(up * 0.4).max(splat(1e-9))
    }
}
