//! Materials from a TOML file, from a file of another program, or the presets.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::arguments::Materials;
use crate::error::{Error, Result};
use crate::{console, named, slug};
use lobes::exchange::{self, Format};
use lobes::glam::DVec3;
use lobes::reflectance::{Fresnel, GgxMaterial, Material, Variant, presets, presets_as_albedos};
use lobes::reflection::Surface;

/// A material as the file has it.
#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum Entry {
    /// Radiance's plastic: ρ_d = R (1 − S), ρ_s = S, white.
    Plastic {
        name: String,
        reflectance: [f64; 3],
        #[serde(default)]
        specularity: f64,
        #[serde(default)]
        sigma: f64,
    },
    /// Radiance's metal: ρ_d = R (1 − S), ρ_s = R S.
    Metal {
        name: String,
        reflectance: [f64; 3],
        specularity: f64,
        #[serde(default)]
        sigma: f64,
    },
    /// ρ_d and ρ_s themselves.
    Albedos {
        name: String,
        diffuse: [f64; 3],
        specular: [f64; 3],
        #[serde(default)]
        sigma: f64,
    },
    /// GGX's facets over a body: of a reflectance F₀ (Schlick), an index (Fresnel), or an index and
    /// an extinction.
    Ggx {
        name: String,
        #[serde(default)]
        diffuse: [f64; 3],
        alpha: Option<Widths>,
        axis: Option<[f64; 3]>,
        f0: Option<[f64; 3]>,
        index: Option<[f64; 3]>,
        extinction: Option<[f64; 3]>,
    },
}

/// α of a GGX lobe, or its two along the circles about an axis and across them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Widths {
    One(f64),
    Two([f64; 2]),
}

impl Widths {
    /// Those of a material, with its axis where there are two.
    pub(super) fn of(material: &GgxMaterial) -> (Self, Option<[f64; 3]>) {
        let [along, across] = material.alpha();
        if along == across {
            (Self::One(along), None)
        } else {
            (Self::Two([along, across]), Some(material.axis().to_array()))
        }
    }
}

/// A material of either lobe.
#[derive(Debug, Clone)]
pub(super) enum AnyMaterial {
    /// Of Ward's.
    Ward(Material),
    /// Of GGX.
    Ggx(GgxMaterial),
}

impl AnyMaterial {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Ward(material) => material.name(),
            Self::Ggx(material) => material.name(),
        }
    }

    /// The surface, one of Ward's with `variant` for its lobe.
    pub(super) fn surface(&self, variant: Variant) -> Surface<'_> {
        match self {
            Self::Ward(material) => Surface::Ward(material, variant),
            Self::Ggx(material) => Surface::Ggx(material),
        }
    }

    /// The material with GGX's facets: its own, those that are given, which over a metal hide the
    /// body, or those of Schlick's reflectance with its specular albedo for F₀.
    pub(super) fn with_facets(self, facets: Option<[Fresnel; 3]>) -> Result<Self> {
        let material = match self {
            Self::Ggx(material) => return Ok(Self::Ggx(material)),
            Self::Ward(material) => material,
        };
        let metal = |fresnel: &[Fresnel; 3]| matches!(fresnel[0], Fresnel::Conductor { .. });
        let faceted = match facets {
            Some(fresnel) => {
                // A metal has no body under its surface.
                let body = if metal(&fresnel) {
                    [0.0; 3]
                } else {
                    material.diffuse()
                };
                let alpha = material.roughness().sigma();
                GgxMaterial::new(material.name(), body, alpha, fresnel)
            }
            None => GgxMaterial::from_ward(&material),
        };
        faceted
            .map(Self::Ggx)
            .map_err(|error| Error::of(format!("material {}", material.name()), error))
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    material: Vec<Entry>,
}

/// The materials of `--materials`, or the presets; of those the ones that `--material` names, in
/// its order.
///
/// # Errors
/// Those of reading them, and [`Error::Request`] for one of GGX.
pub(super) fn load(options: &Materials) -> Result<Vec<Material>> {
    let ward = |material| match material {
        AnyMaterial::Ward(material) => Ok(material),
        AnyMaterial::Ggx(material) => Err(Error::request(
            format!("the material {:?} is of GGX", material.name()),
            "only lobes render knows those; give it as plastic, metal or albedos",
        )),
    };
    load_any(options)?.into_iter().map(ward).collect()
}

/// The same, of either lobe.
pub(super) fn load_any(options: &Materials) -> Result<Vec<AnyMaterial>> {
    let ward = |materials: Vec<Material>| materials.into_iter().map(AnyMaterial::Ward).collect();
    let all: Vec<AnyMaterial> = match &options.materials {
        Some(path) => read(path)?,
        None if options.as_albedos => ward(presets_as_albedos()),
        None => ward(presets()),
    };
    if options.only.is_empty() {
        return Ok(all);
    }
    let names: Vec<&str> = all.iter().map(AnyMaterial::name).collect();
    let mut places: Vec<usize> = Vec::new();
    for name in &options.only {
        let place = named::find("material", name, &names)?;
        if !places.contains(&place) {
            places.push(place);
        }
    }
    Ok(places.into_iter().map(|place| all[place].clone()).collect())
}

/// What each material's files are called.
///
/// # Errors
/// [`Error::File`], or [`Error::Request`] for the presets, for two that would be called the
/// same.
pub(super) fn stems(file: Option<&Path>, names: &[&str]) -> Result<Vec<String>> {
    let stems: Vec<String> = names.iter().map(|name| slug(name)).collect();
    for (second, stem) in stems.iter().enumerate() {
        if let Some(first) = stems[..second].iter().position(|other| other == stem) {
            let problem = format!(
                "the materials {:?} and {:?} would both be written as {stem:?}",
                names[first], names[second]
            );
            let remedy = "give one of them another name";
            return Err(match file {
                Some(path) => Error::file(path, problem, remedy),
                None => Error::request(problem, remedy),
            });
        }
    }
    Ok(stems)
}

fn read(path: &Path) -> Result<Vec<AnyMaterial>> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        Error::file(
            path,
            format!("cannot be read ({error})"),
            "name a file of materials, TOML, glTF, Mitsuba's or Radiance's",
        )
    })?;
    match Format::of_path(path) {
        Some(format) => {
            let found = foreign(path, format, &text)?;
            Ok(found.into_iter().map(AnyMaterial::Ward).collect())
        }
        None => parse(path, &text),
    }
}

/// The materials of another program's file; what they lose is said.
fn foreign(path: &Path, format: Format, text: &str) -> Result<Vec<Material>> {
    let found = exchange::read(format, text).map_err(|error| match error {
        lobes::Error::Contents { problem, remedy } => Error::file(path, problem, remedy),
        other => other.into(),
    })?;
    for note in &found.notes {
        console::complain(format!("{}: {note}", path.display()));
    }
    if found.materials.is_empty() {
        return Err(Error::file(
            path,
            "holds no material that can be read",
            "docs/how-to/materials.md says what is read of other programs",
        ));
    }
    Ok(found.materials)
}

/// The materials of a file's text.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<AnyMaterial>> {
    let file: File = toml::from_str(text).map_err(|error| {
        let line = error
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        Error::file(
            path,
            format!("line {line}: {}", error.message()),
            "docs/how-to/materials.md shows the form",
        )
    })?;
    let mut materials: Vec<AnyMaterial> = Vec::new();
    for entry in file.material {
        let material = match entry {
            Entry::Plastic {
                name,
                reflectance,
                specularity,
                sigma,
            } => Material::plastic(name, reflectance, specularity, sigma).map(AnyMaterial::Ward),
            Entry::Metal {
                name,
                reflectance,
                specularity,
                sigma,
            } => Material::metal(name, reflectance, specularity, sigma).map(AnyMaterial::Ward),
            Entry::Albedos {
                name,
                diffuse,
                specular,
                sigma,
            } => Material::from_albedos(name, diffuse, specular, sigma).map(AnyMaterial::Ward),
            Entry::Ggx {
                name,
                diffuse,
                alpha,
                axis,
                f0,
                index,
                extinction,
            } => {
                let Some(fresnel) = Fresnel::of_channels(f0, index, extinction) else {
                    return Err(Error::file(
                        path,
                        format!("material {name:?} does not say what its facets reflect"),
                        "give f0, or index, or index and extinction",
                    ));
                };
                match (alpha.unwrap_or(Widths::One(0.0)), axis) {
                    (Widths::One(alpha), None) => GgxMaterial::new(name, diffuse, alpha, fresnel),
                    (Widths::Two(alpha), axis) => {
                        let axis = DVec3::from(axis.unwrap_or([0.0, 1.0, 0.0]));
                        GgxMaterial::anisotropic(name, diffuse, alpha, axis, fresnel)
                    }
                    (Widths::One(_), Some(_)) => {
                        return Err(Error::file(
                            path,
                            format!("material {name:?} has an axis and one width"),
                            "give alpha as [along, across], or leave the axis out",
                        ));
                    }
                }
                .map(AnyMaterial::Ggx)
            }
        }
        .map_err(|error| {
            Error::file(
                path,
                format!("material {}: {error}", materials.len() + 1),
                "mend the number",
            )
        })?;
        if materials.iter().any(|m| m.name() == material.name()) {
            return Err(Error::file(
                path,
                format!("two materials are named {:?}", material.name()),
                "give each its own name",
            ));
        }
        materials.push(material);
    }
    if materials.is_empty() {
        return Err(Error::file(
            path,
            "holds no material",
            "docs/how-to/materials.md shows the form",
        ));
    }
    Ok(materials)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<AnyMaterial>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read(file.path())
    }

    #[test]
    fn reads_every_kind() {
        let materials = read_text(
            "[[material]]\nname = 'a'\nkind = 'plastic'\nreflectance = [0.5, 0.5, 0.5]\nspecularity = 0.1\nsigma = 0.05\n\
             [[material]]\nname = 'b'\nkind = 'metal'\nreflectance = [0.8, 0.6, 0.4]\nspecularity = 0.5\n\
             [[material]]\nname = 'c'\nkind = 'albedos'\ndiffuse = [0.2, 0.2, 0.2]\nspecular = [0.1, 0.1, 0.1]\nsigma = 0.2\n\
             [[material]]\nname = 'd'\nkind = 'ggx'\ndiffuse = [0.3, 0.3, 0.3]\nalpha = 0.2\nindex = [1.5, 1.5, 1.5]\n\
             [[material]]\nname = 'e'\nkind = 'ggx'\nindex = [0.2, 0.4, 1.5]\nextinction = [3.1, 2.7, 1.9]\n\
             [[material]]\nname = 'f'\nkind = 'ggx'\nalpha = [0.05, 0.3]\naxis = [0.0, 0.0, 1.0]\nf0 = [0.9, 0.9, 0.9]\n",
        )
        .unwrap();
        let [
            AnyMaterial::Ward(a),
            AnyMaterial::Ward(b),
            AnyMaterial::Ward(c),
            AnyMaterial::Ggx(d),
            AnyMaterial::Ggx(e),
            AnyMaterial::Ggx(f),
        ] = &materials[..]
        else {
            panic!("{materials:?}");
        };
        assert!((a.diffuse()[0] - 0.45).abs() < 1e-15);
        assert!((b.specular()[2] - 0.2).abs() < 1e-15);
        assert!((c.diffuse()[1] - 0.2).abs() < 1e-15);
        assert_eq!(
            (d.alpha(), d.fresnel()[0]),
            ([0.2; 2], Fresnel::Dielectric { index: 1.5 })
        );
        let gold = Fresnel::Conductor {
            index: 0.4,
            extinction: 2.7,
        };
        assert_eq!((e.alpha(), e.fresnel()[1]), ([0.0; 2], gold));
        assert_eq!((f.alpha(), f.axis()), ([0.05, 0.3], DVec3::Z));
        assert_eq!(
            Widths::of(f),
            (Widths::Two([0.05, 0.3]), Some([0.0, 0.0, 1.0]))
        );
        assert_eq!(Widths::of(d), (Widths::One(0.2), None));
    }

    #[test]
    fn says_what_is_wrong_and_where() {
        for (text, expected) in [
            ("", "material"),
            ("material = []", "no material"),
            ("[[material]]\nname = 'a'\nkind = 'wood'\n", "line"),
            (
                "[[material]]\nname = 'a'\nkind = 'ggx'\nalpha = 0.1\n",
                "facets",
            ),
            (
                "[[material]]\nname = 'a'\nkind = 'ggx'\nalpha = 0.1\naxis = [0.0, 1.0, 0.0]\nf0 = [0.1, 0.1, 0.1]\n",
                "one width",
            ),
            (
                "[[material]]\nname = 'a'\nkind = 'ggx'\nalpha = [0.1, 0.2]\naxis = [0.0, 2.0, 0.0]\nf0 = [0.1, 0.1, 0.1]\n",
                "axis",
            ),
            (
                "[[material]]\nname = 'a'\nkind = 'ggx'\nalpha = 2.0\nf0 = [0.1, 0.1, 0.1]\n",
                "α",
            ),
            (
                "[[material]]\nname = 'a'\nkind = 'plastic'\nreflectance = [0.5, 0.5, 1.5]\n",
                "material 1",
            ),
            (
                "[[material]]\nname = 'a'\nkind = 'plastic'\nreflectance = [0.5, 0.5, 0.5]\n\
                 [[material]]\nname = 'a'\nkind = 'plastic'\nreflectance = [0.5, 0.5, 0.4]\n",
                "two materials",
            ),
        ] {
            let message = read_text(text).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
