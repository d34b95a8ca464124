//! What the tree has to know of a lobe.

use std::f64::consts::PI;

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::neighbourhood::Neighbourhood;
use crate::sphere::{from_map, to_map};

/// A lobe times the light's cosine, at one normal and one view, as a function of the light.
///
/// Above the horizon it is the lobe; the function that [`value`](Self::value) gives may go on below
/// it. Directions are unit vectors of the map's frame.
pub(crate) trait Lobe: Sync {
    /// Whether its values have to be looked at: they come from a caller.
    const UNTRUSTED: bool = false;

    /// The normal.
    fn normal(&self) -> DVec3;

    /// The function in eight directions, for each channel.
    fn value<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> [f64x8<S>; 3];

    /// At least the size of the lobe, of its largest channel, in the directions above the horizon
    /// within a chord of `radius` of the centre; finite.
    fn size<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], radius: f64x8<S>) -> f64x8<S>;

    /// What bounds about one direction have in common.
    type At<S: Simd>: Copy;

    /// That of a direction.
    fn at<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3]) -> Self::At<S>;

    /// At least the size of the function, continued analytically, in a complex neighbourhood of the
    /// direction; infinite where it is not analytic there.
    fn bound<S: Simd>(&self, simd: S, at: &Self::At<S>, near: Neighbourhood<S>) -> f64x8<S>;

    /// At least the size of the continued function at the directions within `real` of the centre
    /// whose height over the horizon is between −`depth` and `depth`; infinite if it is not
    /// analytic there.
    fn at_the_horizon<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        real: f64x8<S>,
        depth: f64x8<S>,
    ) -> f64x8<S>;

    /// At least the size of the function over the light's height, continued analytically, in a complex
    /// neighbourhood of the direction; infinite where it is not analytic there, as that of a lobe that
    /// does not vanish at the horizon is not.
    #[inline(always)]
    fn over_height<S: Simd>(&self, simd: S, _: &Self::At<S>, _: Neighbourhood<S>) -> f64x8<S> {
        f64x8::splat(simd, f64::INFINITY)
    }

    /// About the imaginary reach at which the bound over its power `order` is least: changes how
    /// often boxes are opened only.
    fn reach<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], order: f64) -> f64x8<S>;

    /// How wrong a value may be by rounding, relative.
    fn rounding(&self) -> f64;
}

#[inline(always)]
pub(super) fn dot<S: Simd>(simd: S, axis: DVec3, light: [f64x8<S>; 3], offset: f64) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    splat(axis.x).mul_add(
        light[0],
        splat(axis.y).mul_add(light[1], splat(axis.z).mul_add(light[2], splat(offset))),
    )
}

/// Lambert's lobe, the cosine over π.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LambertLobe {
    pub(crate) normal: DVec3,
}

impl Lobe for LambertLobe {
    type At<S: Simd> = f64x8<S>;

    fn normal(&self) -> DVec3 {
        self.normal
    }

    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        [dot(simd, self.normal / PI, light, 0.0); 3]
    }

    #[inline(always)]
    fn size<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], radius: f64x8<S>) -> f64x8<S> {
        let top = dot(simd, self.normal, centre, 0.0) + radius;
        top.max(f64x8::splat(simd, 0.0)) * f64x8::splat(simd, 1.0 / PI)
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3]) -> f64x8<S> {
        dot(simd, self.normal, centre, 0.0).abs()
    }

    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, height: &f64x8<S>, near: Neighbourhood<S>) -> f64x8<S> {
        let top = *height + near.real + near.growth + near.shift;
        top.mul_add(top, near.imaginary * near.imaginary).sqrt() * f64x8::splat(simd, 1.0 / PI)
    }

    #[inline(always)]
    fn at_the_horizon<S: Simd>(
        &self,
        simd: S,
        _: [f64x8<S>; 3],
        _: f64x8<S>,
        depth: f64x8<S>,
    ) -> f64x8<S> {
        depth * f64x8::splat(simd, 1.0 / PI)
    }

    #[inline(always)]
    fn over_height<S: Simd>(&self, simd: S, _: &f64x8<S>, _: Neighbourhood<S>) -> f64x8<S> {
        f64x8::splat(simd, 1.0 / PI)
    }

    #[inline(always)]
    fn reach<S: Simd>(&self, simd: S, _: [f64x8<S>; 3], _: f64) -> f64x8<S> {
        f64x8::splat(simd, 2.0)
    }

    fn rounding(&self) -> f64 {
        1e-14
    }
}

/// A lobe that a caller gives, as functions of directions of the world.
///
/// `value` is the lobe times the light's cosine. It is asked in directions above the horizon of
/// `normal` and a little below it, where it may go on in any way; what it gives there does not
/// count.
///
/// `bound` says how large the function gets: for a centre c and two numbers r and s, at least |f(x + iy)| for all x and y with |x − c| ≤ r and |y| ≤ s, where f is
/// the function continued analytically to complex vectors, and infinity where it is not analytic. With s = 0 it is finite, and bounds f in the directions x above the
/// horizon alone. The answer is as true as this bound is.
///
/// `width` is about the angle over which the lobe changes. It decides how long an answer takes
/// only.
///
/// ```
/// use lobes::illumination::EnvironmentMap;
/// use lobes::reflection::{FunctionLobe, LightTree};
/// use lobes::{Parallelism, glam::DVec3};
/// // Phong's lobe of exponent 8 about the normal, ∫ = 2π/9. For z = x + iy in complex space
/// // |n·z|² ≤ (|n·c| + r)² + s².
/// let lobe = FunctionLobe {
///     name: "Phong's lobe",
///     normal: DVec3::Y,
///     value: |light: DVec3| light.y.powi(8),
///     bound: |centre: DVec3, real: f64, imaginary: f64| {
///         ((centre.y.abs() + real).powi(2) + imaginary * imaginary).powi(4)
///     },
///     width: 0.5,
/// };
/// let map = EnvironmentMap::new("grey", 32, 16, vec![[1.0; 3]; 512])?;
/// let sum = LightTree::new(&map, Parallelism::Sequential)?.integral(&lobe, 1e-4)?;
/// assert!((sum.value[0] - 2.0 * std::f64::consts::PI / 9.0).abs() <= sum.bound);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct FunctionLobe<V, B> {
    /// What it is called in an error.
    pub name: &'static str,
    /// The surface's normal.
    pub normal: DVec3,
    /// f.
    pub value: V,
    /// Its bound.
    pub bound: B,
    /// About the angle over which it changes, in radians.
    pub width: f64,
}

impl<V, B> FunctionLobe<V, B>
where
    V: Fn(DVec3) -> f64 + Sync,
    B: Fn(DVec3, f64, f64) -> f64 + Sync,
{
    /// `f` of eight directions of the map's frame.
    #[inline(always)]
    fn each<S: Simd>(simd: S, light: [f64x8<S>; 3], f: impl Fn(usize, DVec3) -> f64) -> f64x8<S> {
        let mut parts = [[0.0; 8]; 3];
        for (part, light) in parts.iter_mut().zip(light) {
            light.store_slice(part);
        }
        let values: [f64; 8] = std::array::from_fn(|lane| {
            f(
                lane,
                from_map(DVec3::new(parts[0][lane], parts[1][lane], parts[2][lane])),
            )
        });
        f64x8::from_slice(simd, &values)
    }

    #[inline(always)]
    fn bounded<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        real: f64x8<S>,
        imaginary: f64x8<S>,
    ) -> f64x8<S> {
        let (mut reals, mut imaginaries) = ([0.0; 8], [0.0; 8]);
        real.store_slice(&mut reals);
        imaginary.store_slice(&mut imaginaries);
        Self::each(simd, centre, |lane, centre| {
            let bound = (self.bound)(centre, reals[lane], imaginaries[lane]);
            if bound >= 0.0 { bound } else { f64::INFINITY }
        })
    }
}

impl<V, B> Lobe for FunctionLobe<V, B>
where
    V: Fn(DVec3) -> f64 + Sync,
    B: Fn(DVec3, f64, f64) -> f64 + Sync,
{
    const UNTRUSTED: bool = true;

    type At<S: Simd> = [f64x8<S>; 3];

    fn normal(&self) -> DVec3 {
        to_map(self.normal)
    }

    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, light: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        [Self::each(simd, light, |_, light| (self.value)(light)); 3]
    }

    #[inline(always)]
    fn size<S: Simd>(&self, simd: S, centre: [f64x8<S>; 3], radius: f64x8<S>) -> f64x8<S> {
        self.bounded(simd, centre, radius, f64x8::splat(simd, 0.0))
    }

    #[inline(always)]
    fn at<S: Simd>(&self, _: S, centre: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
        centre
    }

    #[inline(always)]
    fn bound<S: Simd>(&self, simd: S, at: &[f64x8<S>; 3], near: Neighbourhood<S>) -> f64x8<S> {
        let real = near.real + near.growth + near.shift;
        self.bounded(simd, *at, real, near.imaginary)
    }

    #[inline(always)]
    fn at_the_horizon<S: Simd>(
        &self,
        simd: S,
        centre: [f64x8<S>; 3],
        real: f64x8<S>,
        _: f64x8<S>,
    ) -> f64x8<S> {
        // A little of the complex, so that it is the continued function's bound.
        self.bounded(simd, centre, real, real * 1e-9)
    }

    #[inline(always)]
    fn reach<S: Simd>(&self, simd: S, _: [f64x8<S>; 3], order: f64) -> f64x8<S> {
        f64x8::splat(simd, self.width * order.sqrt())
    }

    fn rounding(&self) -> f64 {
        1e-13
    }
}
