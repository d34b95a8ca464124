//! Materials: a Lambert part and a specular part, for three channels.

use super::variant::Variant;
use super::ward::{MIN_SIGMA, Ward};
use crate::{Error, Result};

/// How rough the specular part is.
///
/// ```
/// use lobes::reflectance::Roughness;
/// assert_eq!(Roughness::from_sigma(0.0)?, Roughness::Mirror);
/// assert_eq!(Roughness::from_sigma(0.1)?.sigma(), 0.1);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "f64", into = "f64")
)]
pub enum Roughness {
    /// The limit σ = 0: all of `ρ_s` goes to the mirror direction. It has no lobe that could be
    /// evaluated.
    Mirror,
    /// Ward's σ, in [[`MIN_SIGMA`], 1].
    Rough(f64),
}

impl Roughness {
    /// Reads σ; 0 is the mirror.
    ///
    /// # Errors
    /// [`Error::Domain`] if σ is neither 0 nor in [[`MIN_SIGMA`], 1].
    pub fn from_sigma(sigma: f64) -> Result<Self> {
        if sigma == 0.0 {
            Ok(Self::Mirror)
        } else if (MIN_SIGMA..=1.0).contains(&sigma) {
            Ok(Self::Rough(sigma))
        } else {
            Err(Error::Domain {
                what: "the roughness σ of a material",
                value: sigma,
                allowed: "0 (a mirror) or in [0.000001, 1]",
            })
        }
    }

    /// σ; 0 for the mirror.
    pub fn sigma(self) -> f64 {
        match self {
            Self::Mirror => 0.0,
            Self::Rough(sigma) => sigma,
        }
    }
}

#[cfg(feature = "serde")]
impl TryFrom<f64> for Roughness {
    type Error = Error;

    fn try_from(sigma: f64) -> Result<Self> {
        Self::from_sigma(sigma)
    }
}

#[cfg(feature = "serde")]
impl From<Roughness> for f64 {
    fn from(roughness: Roughness) -> Self {
        roughness.sigma()
    }
}

/// A surface: albedos `ρ_d` and `ρ_s` for three linear channels, and a roughness.
///
/// A matte material has `ρ_s` = 0 in every channel; its roughness then has no meaning.
///
/// ```
/// use lobes::reflectance::{Material, Roughness};
/// let bronze = Material::metal("bronze", [0.8, 0.5, 0.3], 0.9, 0.08)?;
/// assert_eq!(bronze.specular()[1], 0.5 * 0.9);
/// assert_eq!(bronze.roughness(), Roughness::Rough(0.08));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredMaterial", into = "StoredMaterial")
)]
pub struct Material {
    name: String,
    diffuse: [f64; 3],
    specular: [f64; 3],
    roughness: Roughness,
}

/// A material as files have it.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct StoredMaterial {
    name: String,
    diffuse: [f64; 3],
    specular: [f64; 3],
    sigma: f64,
    /// Who means `ρ_d` + `ρ_s` to pass 1 says so.
    #[serde(default)]
    gains_energy: bool,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredMaterial> for Material {
    type Error = Error;

    fn try_from(stored: StoredMaterial) -> Result<Self> {
        let make = if stored.gains_energy {
            Self::from_albedos_gaining_energy
        } else {
            Self::from_albedos
        };
        make(stored.name, stored.diffuse, stored.specular, stored.sigma)
    }
}

#[cfg(feature = "serde")]
impl From<Material> for StoredMaterial {
    fn from(material: Material) -> Self {
        Self {
            gains_energy: material.gains_energy().is_some(),
            sigma: material.roughness.sigma(),
            name: material.name,
            diffuse: material.diffuse,
            specular: material.specular,
        }
    }
}

impl Material {
    /// Radiance's `plastic`: `ρ_d` = R(1 − S), `ρ_s` = S in every channel.
    ///
    /// # Errors
    /// [`Error::Domain`] if a reflectance R or the specularity S is not in [0, 1], or σ is neither
    /// 0 nor in [[`MIN_SIGMA`], 1].
    pub fn plastic(
        name: impl Into<String>,
        reflectance: [f64; 3],
        specularity: f64,
        sigma: f64,
    ) -> Result<Self> {
        check_arguments(reflectance, specularity)?;
        Ok(Self {
            name: name.into(),
            diffuse: reflectance.map(|r| r * (1.0 - specularity)),
            specular: [specularity; 3],
            roughness: Roughness::from_sigma(sigma)?,
        })
    }

    /// Radiance's `metal`: `ρ_d` = R(1 − S), `ρ_s` = R·S: the highlight takes the metal's colour.
    ///
    /// # Errors
    /// As [`plastic`](Self::plastic).
    pub fn metal(
        name: impl Into<String>,
        reflectance: [f64; 3],
        specularity: f64,
        sigma: f64,
    ) -> Result<Self> {
        check_arguments(reflectance, specularity)?;
        Ok(Self {
            name: name.into(),
            diffuse: reflectance.map(|r| r * (1.0 - specularity)),
            specular: reflectance.map(|r| r * specularity),
            roughness: Roughness::from_sigma(sigma)?,
        })
    }

    /// A material of given albedos that does not gain energy: `ρ_d` + `ρ_s` ≤ 1 in every channel.
    ///
    /// # Errors
    /// [`Error::Domain`] if an albedo is not in [0, 1] or a channel's sum exceeds 1, or σ is
    /// neither 0 nor in [[`MIN_SIGMA`], 1].
    pub fn from_albedos(
        name: impl Into<String>,
        diffuse: [f64; 3],
        specular: [f64; 3],
        sigma: f64,
    ) -> Result<Self> {
        let material = Self::from_albedos_gaining_energy(name, diffuse, specular, sigma)?;
        match material.gains_energy() {
            None => Ok(material),
            Some(sum) => Err(Error::Domain {
                what: "the sum ρ_d + ρ_s of a material",
                value: sum,
                allowed: "at most 1 (Material::from_albedos_gaining_energy takes it all the same)",
            }),
        }
    }

    /// A material of given albedos, each in [0, 1], whatever their sum.
    ///
    /// # Errors
    /// [`Error::Domain`] if an albedo is not in [0, 1], or σ is neither 0 nor in [[`MIN_SIGMA`],
    /// 1].
    pub fn from_albedos_gaining_energy(
        name: impl Into<String>,
        diffuse: [f64; 3],
        specular: [f64; 3],
        sigma: f64,
    ) -> Result<Self> {
        for &value in &diffuse {
            check_unit("a diffuse albedo ρ_d", value)?;
        }
        for &value in &specular {
            check_unit("a specular albedo ρ_s", value)?;
        }
        Ok(Self {
            name: name.into(),
            diffuse,
            specular,
            roughness: Roughness::from_sigma(sigma)?,
        })
    }

    /// The white sphere: Lambert of albedo 1.
    ///
    /// ```
    /// use lobes::reflectance::Material;
    /// assert_eq!(Material::white().diffuse(), [1.0; 3]);
    /// ```
    pub fn white() -> Self {
        Self {
            name: "white".to_owned(),
            diffuse: [1.0; 3],
            specular: [0.0; 3],
            roughness: Roughness::Mirror,
        }
    }

    /// The name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// `ρ_d` of each channel.
    pub fn diffuse(&self) -> [f64; 3] {
        self.diffuse
    }

    /// `ρ_s` of each channel.
    pub fn specular(&self) -> [f64; 3] {
        self.specular
    }

    /// How rough the specular part is.
    pub fn roughness(&self) -> Roughness {
        self.roughness
    }

    /// `ρ_d` + `ρ_s` of each channel: above 1 the material gains energy (the lobe's own albedo
    /// apart).
    pub fn gain(&self) -> [f64; 3] {
        std::array::from_fn(|channel| self.diffuse[channel] + self.specular[channel])
    }

    /// A channel's `ρ_d` + `ρ_s` above 1. The sum of two rounded albedos may pass 1 by a rounding.
    fn gains_energy(&self) -> Option<f64> {
        self.gain().into_iter().find(|&sum| sum > 1.0 + 1e-15)
    }

    /// Whether nothing is specular.
    pub fn is_matte(&self) -> bool {
        self.specular == [0.0; 3]
    }

    /// The specular lobe at `ρ_s` = 1; none for a matte material or a mirror.
    pub fn lobe(&self, variant: Variant) -> Option<Ward> {
        match self.roughness {
            Roughness::Rough(sigma) if !self.is_matte() => Ward::isotropic(variant, sigma).ok(),
            _ => None,
        }
    }
}

/// Name, Radiance's type, R, S, σ of the eight presets.
const PRESETS: [(&str, Kind, [f64; 3], f64, f64); 8] = [
    ("brown matte", Kind::Plastic, [0.2, 0.1, 0.1], 0.0, 0.0),
    ("white matte", Kind::Plastic, [0.7; 3], 0.0, 0.0),
    ("black plastic", Kind::Plastic, [0.02; 3], 0.025, 0.05),
    ("blue plastic", Kind::Plastic, [0.13, 0.1, 0.3], 0.05, 0.03),
    ("sky plastic", Kind::Plastic, [0.42, 0.42, 0.56], 0.025, 0.0),
    ("old gold", Kind::Metal, [1.0, 0.7, 0.3], 1.0, 0.1),
    ("gold", Kind::Metal, [0.8, 0.6, 0.3], 0.9, 0.0),
    ("silver", Kind::Metal, [0.7; 3], 1.0, 0.0),
];

#[derive(Clone, Copy)]
enum Kind {
    Plastic,
    Metal,
}

/// The paper's eight materials, from brown matte to silver, as Radiance reads (R, S, σ).
///
/// The numbers stand in the caption of the paper's Figure 3. They are read as arguments of
/// Radiance's `plastic` (the first five: `ρ_d` = R(1 − S), `ρ_s` = S) and `metal` (the last three:
/// `ρ_d` = R(1 − S), `ρ_s` = R·S), because silver's R + S is 1.7 and would gain energy if they were
/// albedos; [`presets_as_albedos`] is the other reading. They are what the classifiers are judged
/// on: no feature, constant or weight of this crate was chosen with them.
///
/// ```
/// use lobes::reflectance::presets;
/// assert_eq!(presets().len(), 8);
/// assert_eq!(presets()[5].name(), "old gold");
/// assert_eq!(presets()[5].specular(), [1.0, 0.7, 0.3]);
/// ```
pub fn presets() -> Vec<Material> {
    PRESETS
        .iter()
        .map(|&(name, kind, reflectance, specularity, sigma)| Material {
            name: name.to_owned(),
            diffuse: reflectance.map(|r| r * (1.0 - specularity)),
            specular: match kind {
                Kind::Plastic => [specularity; 3],
                Kind::Metal => reflectance.map(|r| r * specularity),
            },
            roughness: preset_roughness(sigma),
        })
        .collect()
}

/// The eight materials with R and S taken as `ρ_d` and `ρ_s`, the other reading of the paper's
/// table.
///
/// The three metals then gain energy: old gold has an albedo of 2 in red, gold and silver have 1.7.
///
/// ```
/// use lobes::reflectance::presets_as_albedos;
/// let silver = &presets_as_albedos()[7];
/// assert!(silver.gain()[0] > 1.69);
/// ```
pub fn presets_as_albedos() -> Vec<Material> {
    PRESETS
        .iter()
        .map(|&(name, _, reflectance, specularity, sigma)| Material {
            name: name.to_owned(),
            diffuse: reflectance,
            specular: [specularity; 3],
            roughness: preset_roughness(sigma),
        })
        .collect()
}

fn preset_roughness(sigma: f64) -> Roughness {
    if sigma == 0.0 {
        Roughness::Mirror
    } else {
        Roughness::Rough(sigma)
    }
}

fn check_arguments(reflectance: [f64; 3], specularity: f64) -> Result<()> {
    for value in reflectance {
        check_unit("a reflectance R", value)?;
    }
    check_unit("the specularity S", specularity)
}

fn check_unit(what: &'static str, value: f64) -> Result<()> {
    if (0.0..=1.0).contains(&value) {
        Ok(())
    } else {
        Err(Error::Domain {
            what,
            value,
            allowed: "in [0, 1]",
        })
    }
}
