//! The GGX microfacet lobe with Smith's masking.

use std::f64::consts::PI;

use fearless_simd::{Select, dispatch, f64x8, prelude::*};
use glam::DVec3;

use super::direction::{HORIZON, UNIT_TOLERANCE, check_unit, visible};
use super::fresnel::Fresnel;
use super::ward::Sample;
use crate::numeric::sincospi;
use crate::{Error, Result, vectors};

/// The smallest α of a [`Ggx`] lobe.
pub const MIN_ALPHA: f64 = 0.001;

/// A lobe of microfacets whose normals are distributed as *GGX* has it: Trowbridge and Reitz 1975,
/// [doi:10.1364/JOSA.65.000531](https://doi.org/10.1364/JOSA.65.000531); Walter, Marschner, Li and
/// Torrance 2007, *Microfacet Models for Refraction through Rough Surfaces*,
/// [doi:10.2312/EGWR/EGSR07/195-206](https://doi.org/10.2312/EGWR/EGSR07/195-206).
///
/// With the half vector h = (x, y, 1)/√(1 + x² + y²), whose slopes are x and y, and `c_v`, `c_i`
/// the cosines of view and light:
///
/// ```text
/// f = F(h·v) D G₂ / (4 c_v c_i)
/// D = (1 + x² + y²)² / (π α_x α_y (1 + x²/α_x² + y²/α_y²)²)
/// G₂ = 1 / (1 + Λ(v) + Λ(i)),   Λ(v) = (√(1 + (α_x² v_x² + α_y² v_y²)/v_z²) − 1)/2
/// ```
///
/// G₂ is Smith's factor for masking and shadowing that are correlated by height: Heitz 2014,
/// *Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs*, [JCGT
/// 3(2)](https://jcgt.org/published/0003/02/03/). F is a [`Fresnel`] reflectance. Light that is
/// reflected twice between facets is not there, so that the white furnace of a rough lobe is below
/// 1: its [`albedo`](Self::albedo) says by how much.
///
/// α runs from [`MIN_ALPHA`] to 1. Programs that speak of a *roughness* mostly mean its square
/// root.
///
/// ```
/// use lobes::{glam::DVec3, reflectance::{Fresnel, Ggx}};
/// let lobe = Ggx::isotropic(0.1, Fresnel::Dielectric { index: 1.5 })?;
/// // Along the normal c_v = c_i = G₂ = 1 and D = 1/(π α²).
/// let peak = lobe.evaluate(DVec3::Z, DVec3::Z);
/// assert!((peak - 0.04 / (4.0 * std::f64::consts::PI * 0.01)).abs() < 1e-14);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredGgx", into = "StoredGgx")
)]
pub struct Ggx {
    alpha: [f64; 2],
    inverse_alpha: [f64; 2],
    /// `1/(π α_x α_y)`.
    peak: f64,
    fresnel: Fresnel,
}

/// A lobe as files have it.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct StoredGgx {
    alpha: [f64; 2],
    fresnel: Fresnel,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredGgx> for Ggx {
    type Error = Error;

    fn try_from(stored: StoredGgx) -> Result<Self> {
        Self::anisotropic(stored.alpha[0], stored.alpha[1], stored.fresnel)
    }
}

#[cfg(feature = "serde")]
impl From<Ggx> for StoredGgx {
    fn from(ggx: Ggx) -> Self {
        Self {
            alpha: ggx.alpha,
            fresnel: ggx.fresnel,
        }
    }
}

impl Ggx {
    /// A lobe whose slopes have the same width α in every direction.
    ///
    /// # Errors
    /// [`Error::Domain`] if α is not in [[`MIN_ALPHA`], 1] or a parameter of the reflectance is not
    /// allowed.
    pub fn isotropic(alpha: f64, fresnel: Fresnel) -> Result<Self> {
        Self::anisotropic(alpha, alpha, fresnel)
    }

    /// A lobe of widths `α_x` and `α_y` along the surface's tangents +x and +y.
    ///
    /// # Errors
    /// As [`isotropic`](Self::isotropic).
    pub fn anisotropic(alpha_x: f64, alpha_y: f64, fresnel: Fresnel) -> Result<Self> {
        for value in [alpha_x, alpha_y] {
            if !(MIN_ALPHA..=1.0).contains(&value) {
                return Err(Error::Domain {
                    what: "the width α of a GGX lobe",
                    value,
                    allowed: "in [0.001, 1] (narrower ones are mirrors to most purposes)",
                });
            }
        }
        fresnel.check()?;
        let alpha = [alpha_x, alpha_y];
        Ok(Self {
            alpha,
            inverse_alpha: alpha.map(f64::recip),
            peak: 1.0 / (PI * alpha_x * alpha_y),
            fresnel,
        })
    }

    /// The widths (`α_x`, `α_y`); equal for an isotropic lobe.
    pub fn alpha(&self) -> [f64; 2] {
        self.alpha
    }

    /// The reflectance of the facets.
    pub fn fresnel(&self) -> Fresnel {
        self.fresnel
    }

    /// Whether the two widths are equal.
    pub fn is_isotropic(&self) -> bool {
        self.alpha[0] == self.alpha[1]
    }

    /// D, the density of the facets' normals over solid angle, in sr⁻¹, at a half vector, which
    /// need not be of unit length.
    ///
    /// ∫ D cos δ dω = 1. 0 where the half vector does not point above the [`HORIZON`], and for
    /// anything that is not finite.
    pub fn distribution(&self, half: DVec3) -> f64 {
        if !(half.z > HORIZON && half.is_finite()) {
            return 0.0;
        }
        self.density(half / half.length())
    }

    /// D; the length of `half` cancels.
    fn density(&self, half: DVec3) -> f64 {
        let x = half.x * self.inverse_alpha[0];
        let y = half.y * self.inverse_alpha[1];
        let ratio = half.length_squared() / (half.z * half.z + x * x + y * y);
        self.peak * (ratio * ratio)
    }

    /// `√(z² + α_x² x² + α_y² y²)`: Λ = (that over z − 1)/2.
    fn stretched(&self, direction: DVec3) -> f64 {
        let x = self.alpha[0] * direction.x;
        let y = self.alpha[1] * direction.y;
        (direction.z * direction.z + x * x + y * y).sqrt()
    }

    /// G₂, the share of facets that both view and light see, correlated by height. 0 as
    /// [`evaluate`](Self::evaluate) is.
    pub fn masking(&self, view: DVec3, light: DVec3) -> f64 {
        if !(visible(view) && visible(light)) {
            return 0.0;
        }
        let (v, i) = (self.stretched(view), self.stretched(light));
        2.0 * light.z * (view.z / (light.z * v + view.z * i))
    }

    /// `f·c_i`, the lobe times the light's cosine, in sr⁻¹.
    ///
    /// 0 where either direction is below the [`HORIZON`] or not of unit length (its square within
    /// 10⁻⁶ of 1), which [`evaluate_batch`](Self::evaluate_batch) refuses. Never a NaN. To 10⁻¹⁴ of
    /// the value.
    pub fn evaluate(&self, view: DVec3, light: DVec3) -> f64 {
        light.z * self.brdf(view, light)
    }

    /// f, the lobe without the light's cosine, in sr⁻¹: symmetric in view and light. 0 as
    /// [`evaluate`](Self::evaluate) is.
    pub fn brdf(&self, view: DVec3, light: DVec3) -> f64 {
        if !(visible(view) && visible(light)) {
            return 0.0;
        }
        let half = view + light;
        // G₂/(4 c_v c_i) = 1/(2 (c_i r_v + c_v r_i)), with r = (2Λ + 1) c.
        let scale = light.z * self.stretched(view) + view.z * self.stretched(light);
        self.fresnel.reflectance(0.5 * half.length()) * self.density(half) * (0.5 / scale)
    }

    /// [`evaluate`](Self::evaluate) for many lights; 0 where one is below the [`HORIZON`], and
    /// everywhere if the view is.
    ///
    /// # Errors
    /// [`Error::Length`] if `out` is not as long as `lights`; [`Error::Domain`] for a direction
    /// that is not of unit length (its square within 10⁻⁶ of 1).
    pub fn evaluate_batch(&self, view: DVec3, lights: &[DVec3], out: &mut [f64]) -> Result<()> {
        crate::error::check_length("the output of a batch", lights.len(), out.len())?;
        check_unit(view, lights)?;
        if !visible(view) {
            out.fill(0.0);
            return Ok(());
        }
        let level = vectors::level();
        dispatch!(level, simd => self.batch(simd, view, lights, out));
        Ok(())
    }

    #[inline(always)]
    fn batch<S: Simd>(&self, simd: S, view: DVec3, lights: &[DVec3], out: &mut [f64]) {
        let stretched = self.stretched(view);
        let (blocks, rest) = lights.as_chunks::<LANES>();
        let (out_blocks, out_rest) = out.as_chunks_mut::<LANES>();
        for (lights, out) in blocks.iter().zip(out_blocks) {
            self.block(simd, view, stretched, lights, out);
        }
        if !rest.is_empty() {
            let mut lights = [DVec3::NEG_Z; LANES];
            lights[..rest.len()].copy_from_slice(rest);
            let mut values = [0.0; LANES];
            self.block(simd, view, stretched, &lights, &mut values);
            out_rest.copy_from_slice(&values[..rest.len()]);
        }
    }

    #[inline(always)]
    fn block<S: Simd>(
        &self,
        simd: S,
        view: DVec3,
        stretched: f64,
        lights: &[DVec3; LANES],
        out: &mut [f64; LANES],
    ) {
        let splat = |value: f64| f64x8::splat(simd, value);
        let component = |get: fn(&DVec3) -> f64| {
            let mut values = [0.0; LANES];
            for (value, light) in values.iter_mut().zip(lights) {
                *value = get(light);
            }
            f64x8::from_slice(simd, &values)
        };
        let (x, y, z) = (
            component(|light| light.x),
            component(|light| light.y),
            component(|light| light.z),
        );
        let visible = z.simd_gt(splat(HORIZON))
            & (x * x + y * y + z * z - 1.0)
                .abs()
                .simd_le(splat(UNIT_TOLERANCE));
        let (a, b) = (x * self.alpha[0], y * self.alpha[1]);
        let light_stretched = (z * z + a * a + b * b).sqrt();
        let (x, y, half_z) = (x + view.x, y + view.y, z + view.z);
        let (p, q) = (x * self.inverse_alpha[0], y * self.inverse_alpha[1]);
        let square = half_z * half_z;
        let length2 = x * x + y * y + square;
        let ratio = length2 / (p * p + q * q + square);
        let cosine = (length2.sqrt() * 0.5).min(splat(1.0));
        let scale = z * stretched + light_stretched * view.z;
        let value = self.fresnel.reflectances(simd, cosine) * (ratio * ratio) * (z / scale);
        visible
            .select(value * (0.5 * self.peak), splat(0.0))
            .store_slice(out);
    }

    /// Draws a light by the visible normals from two numbers of [0, 1).
    ///
    /// The half vector is drawn as often as the view sees it, `max(0, h·v) D G₁(v)/c_v`, on a
    /// spherical cap: Dupuy and Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*,
    /// [doi:10.1111/cgf.14867](https://doi.org/10.1111/cgf.14867), which draws the density of Heitz
    /// 2018, [JCGT 7(4)](https://jcgt.org/published/0007/04/01/). The weight is F G₂/G₁(v), at most
    /// 1; a light below the horizon has weight 0, and so has every light of a view that is.
    pub fn sample(&self, view: DVec3, u: [f64; 2]) -> Sample {
        let none = |light| Sample { light, weight: 0.0 };
        if !visible(view) {
            return none(DVec3::new(-view.x, -view.y, view.z));
        }
        let stretched = self.stretched(view);
        let (x, y) = (self.alpha[0] * view.x, self.alpha[1] * view.y);
        let (x, y, z) = (x / stretched, y / stretched, view.z / stretched);
        // A point of the cap above −z, uniformly: 1 − cos θ = u₁ (1 + z).
        let versine = u[1] * (1.0 + z);
        let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
        let (turn_sine, turn_cosine) = sincospi::sin_cos(u[0]);
        let half = DVec3::new(
            self.alpha[0] * (sine * turn_cosine + x),
            self.alpha[1] * (sine * turn_sine + y),
            (1.0 - u[1]) * (1.0 + z),
        );
        let light = half * (2.0 * half.dot(view) / half.length_squared()) - view;
        if !(light.z > HORIZON) {
            return none(light);
        }
        let weight =
            light.z * (stretched + view.z) / (light.z * stretched + view.z * self.stretched(light));
        let cosine = half.dot(view) / half.length();
        Sample {
            light,
            weight: weight * self.fresnel.reflectance(cosine),
        }
    }

    /// The density, in sr⁻¹, with which [`sample`](Self::sample) draws a light above the horizon:
    /// `G₁(v) D/(4 c_v)`.
    ///
    /// Its integral is the share of the draws that are above the horizon. 0 where
    /// [`evaluate`](Self::evaluate) is 0 by definition.
    pub fn pdf(&self, view: DVec3, light: DVec3) -> f64 {
        if !(visible(view) && visible(light)) {
            return 0.0;
        }
        // G₁ = 2 c_v/(c_v + r_v).
        self.density(view + light) * (0.5 / (view.z + self.stretched(view)))
    }
}

/// How many lights are evaluated at once.
const LANES: usize = 8;
