//! Materials of Lambert's lobe and the GGX lobe.

use glam::DVec3;

use super::direction::UNIT_TOLERANCE;
use super::fresnel::Fresnel;
use super::ggx::{Ggx, MIN_ALPHA};
use super::material::Material;
use crate::{Error, Result};

/// A surface of facets distributed as GGX has it over a matte body: an albedo `ρ_d` and a
/// [`Fresnel`] reflectance for each of three linear channels, and one width α, or two.
///
/// Two widths need tangents. They lie as on what was turned on a lathe: at a normal n the tangent +x
/// is the direction of axis × n, along the circles about the [`axis`](Self::axis), and +y = n × x,
/// towards the axis' upper end. Grooves along the circles make the slopes across them the wider
/// ones: `α_y` > `α_x`. Where n is the axis itself any tangent is taken for +x.
///
/// The radiance towards a view is that of Lambert's lobe times `ρ_d` plus that of a [`Ggx`] lobe
/// whose facets reflect as said. What the facets let through is not followed into the body and out
/// again, so that `ρ_d` does not fall towards grazing as some programs' does.
///
/// ```
/// use lobes::reflectance::{Fresnel, GgxMaterial};
/// // Gold at 650, 550 and 450 nm.
/// let index = [(0.168, 3.138), (0.350, 2.714), (1.508, 1.879)];
/// let fresnel = index.map(|(index, extinction)| Fresnel::Conductor { index, extinction });
/// let gold = GgxMaterial::new("gold", [0.0; 3], 0.2, fresnel)?;
/// assert!(gold.fresnel()[0].reflectance(1.0) > 0.9);
/// // A mirror of it.
/// assert!(GgxMaterial::new("gold", [0.0; 3], 0.0, fresnel)?.lobes().is_none());
/// // Turned on a lathe.
/// let axis = lobes::glam::DVec3::Y;
/// let turned = GgxMaterial::anisotropic("gold", [0.0; 3], [0.05, 0.2], axis, fresnel)?;
/// assert_eq!(turned.alpha(), [0.05, 0.2]);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct GgxMaterial {
    name: String,
    diffuse: [f64; 3],
    alpha: [f64; 2],
    axis: DVec3,
    fresnel: [Fresnel; 3],
}

impl GgxMaterial {
    /// A material; α = 0 is a mirror.
    ///
    /// # Errors
    /// [`Error::Domain`] if α is neither 0 nor in [[`MIN_ALPHA`], 1], a parameter of a reflectance
    /// is not allowed, an albedo is not in [0, 1], or the albedo and the reflectance along the
    /// normal of a channel are together above 1.
    pub fn new(
        name: impl Into<String>,
        diffuse: [f64; 3],
        alpha: f64,
        fresnel: [Fresnel; 3],
    ) -> Result<Self> {
        if alpha != 0.0 {
            check_width(alpha, "0 (a mirror) or in [0.001, 1]")?;
        }
        Self::checked(name.into(), diffuse, [alpha; 2], DVec3::Y, fresnel)
    }

    /// A material of two widths, `α_x` along the circles about an axis of the world and `α_y` across
    /// them; the axis is of unit length.
    ///
    /// # Errors
    /// [`Error::Domain`] if a width is not in [[`MIN_ALPHA`], 1], the axis is not of unit length (its
    /// square within 10⁻⁶ of 1), and as [`new`](Self::new).
    pub fn anisotropic(
        name: impl Into<String>,
        diffuse: [f64; 3],
        alpha: [f64; 2],
        axis: DVec3,
        fresnel: [Fresnel; 3],
    ) -> Result<Self> {
        for width in alpha {
            check_width(width, "in [0.001, 1] (a mirror has one width, 0)")?;
        }
        let square = axis.length_squared();
        if !((square - 1.0).abs() <= UNIT_TOLERANCE) {
            return Err(Error::Domain {
                what: "the square of the length of a material's axis",
                value: square,
                allowed: "1 to within 10⁻⁶",
            });
        }
        Self::checked(name.into(), diffuse, alpha, axis, fresnel)
    }

    fn checked(
        name: String,
        diffuse: [f64; 3],
        alpha: [f64; 2],
        axis: DVec3,
        fresnel: [Fresnel; 3],
    ) -> Result<Self> {
        for (diffuse, fresnel) in diffuse.into_iter().zip(fresnel) {
            fresnel.check()?;
            if !(0.0..=1.0).contains(&diffuse) {
                return Err(Error::Domain {
                    what: "the albedo ρ_d of a GGX material",
                    value: diffuse,
                    allowed: "in [0, 1]",
                });
            }
            let sum = diffuse + fresnel.reflectance(1.0);
            if sum > 1.0 + 1e-12 {
                return Err(Error::Domain {
                    what: "the sum of a GGX material's albedo ρ_d and its reflectance along the normal",
                    value: sum,
                    allowed: "at most 1",
                });
            }
        }
        Ok(Self {
            name,
            diffuse,
            alpha,
            axis,
            fresnel,
        })
    }

    /// A material of Ward's parameters in GGX's terms: the same `ρ_d`, α = σ, and Schlick's
    /// reflectance with F₀ = `ρ_s`.
    ///
    /// Both lobes have about the same peak and width at normal exitance; GGX's has the longer tail.
    ///
    /// ```
    /// use lobes::reflectance::{Fresnel, GgxMaterial, Material};
    /// let plastic = Material::plastic("p", [0.5; 3], 0.04, 0.1)?;
    /// let same = GgxMaterial::from_ward(&plastic)?;
    /// assert_eq!((same.alpha(), same.fresnel()[0]), ([0.1; 2], Fresnel::Schlick { normal: 0.04 }));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new): a σ between 0 and [`MIN_ALPHA`] has no lobe.
    pub fn from_ward(material: &Material) -> Result<Self> {
        Self::new(
            material.name(),
            material.diffuse(),
            material.roughness().sigma(),
            material
                .specular()
                .map(|normal| Fresnel::Schlick { normal }),
        )
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// `ρ_d` of red, green and blue.
    pub fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    /// The widths (`α_x`, `α_y`); equal for an isotropic lobe, 0 for a mirror.
    pub fn alpha(&self) -> [f64; 2] {
        self.alpha
    }

    /// The axis about whose circles the tangents lie, a unit vector of the world: +y where none was
    /// given. It says something where the two widths differ only.
    pub fn axis(&self) -> DVec3 {
        self.axis
    }

    /// The tangent +x at a normal: of unit length, and perpendicular to the normal.
    pub fn tangent(&self, normal: DVec3) -> DVec3 {
        let across = self.axis.cross(normal);
        // Where they are parallel but for rounding there is no direction.
        if across.length_squared() > 1e-24 {
            across.reject_from_normalized(normal).normalize()
        } else {
            normal.any_orthonormal_vector()
        }
    }

    /// The reflectances of the facets for red, green and blue.
    pub fn fresnel(&self) -> [Fresnel; 3] {
        self.fresnel
    }

    /// The lobes of red, green and blue in the frame of [`tangent`](Self::tangent); none of a mirror.
    pub fn lobes(&self) -> Option<[Ggx; 3]> {
        let [red, green, blue] = self
            .fresnel
            .map(|fresnel| Ggx::anisotropic(self.alpha[0], self.alpha[1], fresnel).ok());
        Some([red?, green?, blue?])
    }
}

fn check_width(alpha: f64, allowed: &'static str) -> Result<()> {
    if (MIN_ALPHA..=1.0).contains(&alpha) {
        return Ok(());
    }
    Err(Error::Domain {
        what: "the width α of a GGX material",
        value: alpha,
        allowed,
    })
}
