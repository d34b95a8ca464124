//! Materials of other programs: glTF 2.0, Mitsuba 3 and Radiance.
//!
//! A [`Material`] is a Lambert part, a specular part of one colour and one width, and no more.
//! Other programs say more or say it otherwise, so that each reading and each writing may lose
//! something. What is lost is never dropped in silence: it comes back as [`Note`]s, a sentence
//! each, beside the materials or the text. What each format cannot express is said at its variant
//! of [`Format`].

mod gltf;
mod mitsuba;
mod note;
mod radiance;

use std::path::Path;

pub use note::{Loss, Note};

use crate::named;
use crate::reflectance::Material;
use crate::serialisation::by_name;
use crate::{Error, Result};

/// A way in which other programs write materials.
///
/// ```
/// use lobes::exchange::Format;
/// assert_eq!("gltf".parse(), Ok(Format::Gltf));
/// assert_eq!(Format::of_path("scenes/room.rad".as_ref()), Some(Format::Radiance));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Format {
    /// The `materials` of a glTF 2.0 file (`.gltf`, JSON): base colour, metallic and roughness,
    /// with α = roughness², and the extensions `KHR_materials_specular` and `KHR_materials_ior`.
    ///
    /// It cannot express a lobe other than GGX, nor a highlight that keeps its strength towards
    /// grazing.
    Gltf,
    /// The BSDFs of a Mitsuba 3 scene (`.xml`): `diffuse`, `conductor`, `roughconductor`,
    /// `plastic`, `roughplastic`, `principled`, `twosided` and the `blendbsdf` that is written
    /// here.
    ///
    /// It cannot express reflectances above 1, so that a material whose largest `ρ_d` and largest
    /// `ρ_s` are together above 1 has no form in it; its Beckmann lobe is Ward's Gaussian but for
    /// the masking.
    Mitsuba,
    /// Radiance's primitives `plastic` and `metal` (`.rad`, `.mat`), whose roughness is Ward's σ.
    ///
    /// It cannot express a coloured highlight of another colour than the body: `plastic` has a
    /// white one, `metal` one of the body's colour.
    Radiance,
}

impl Format {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Gltf, Self::Mitsuba, Self::Radiance];

    /// The name that `FromStr` reads: `gltf`, `mitsuba` or `radiance`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "gltf",
            Self::Mitsuba => "mitsuba",
            Self::Radiance => "radiance",
        }
    }

    /// The format of a file by the ending of its name: `.gltf`, `.xml`, `.rad` or `.mat`.
    pub fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "gltf" => Some(Self::Gltf),
            "xml" => Some(Self::Mitsuba),
            "rad" | "mat" => Some(Self::Radiance),
            _ => None,
        }
    }
}

named!(Format, "format of materials");
by_name!(Format);

/// What a text held.
///
/// ```
/// use lobes::exchange::{Format, read};
/// let text = "void plastic red\n0\n0\n5 0.5 0 0 0 0\n";
/// let imported = read(Format::Radiance, text)?;
/// assert_eq!(imported.materials[0].name(), "red");
/// assert!(imported.notes.is_empty());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The materials, in the order of the text; each has a name of its own.
    pub materials: Vec<Material>,
    /// What of them is not in the materials, in the order of the text.
    pub notes: Vec<Note>,
}

/// What was written.
///
/// ```
/// use lobes::{exchange::{Format, write}, reflectance::Material};
/// let exported = write(Format::Radiance, &[Material::white()])?;
/// assert!(exported.text.contains("void plastic white"));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file's text.
    pub text: String,
    /// What of the materials is not in it.
    pub notes: Vec<Note>,
}

/// Reads the materials of a text.
///
/// Reflectances are linear and of Rec. 709's primaries, as all three formats have them. The width
/// of a lobe of any distribution is taken as Ward's σ: Beckmann's α is the same number, and of
/// GGX's a [`Note`] says so. A reflectance that rises towards grazing is taken along the normal.
///
/// # Errors
/// [`Error::Contents`] where the text is not of the format or a number in it is outside its domain.
///
/// ```
/// use lobes::exchange::{Format, read};
/// let text = r#"{"asset": {"version": "2.0"}, "materials": [{"name": "brass", "pbrMetallicRoughness":
///     {"baseColorFactor": [0.9, 0.6, 0.2, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.5}}]}"#;
/// let brass = &read(Format::Gltf, text)?.materials[0];
/// assert_eq!(brass.specular(), [0.9, 0.6, 0.2]);
/// assert_eq!(brass.roughness().sigma(), 0.25);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn read(format: Format, text: &str) -> Result<Imported> {
    let mut found = Found::default();
    match format {
        Format::Gltf => gltf::read(text, &mut found)?,
        Format::Mitsuba => mitsuba::read(text, &mut found)?,
        Format::Radiance => radiance::read(text, &mut found)?,
    }
    Ok(Imported {
        materials: found.materials,
        notes: found.notes,
    })
}

/// Writes materials as another program reads them.
///
/// # Errors
/// [`Error::SameName`] for two materials of one name, where a name is what tells them apart.
///
/// ```
/// use lobes::exchange::{Format, read, write};
/// use lobes::reflectance::presets;
/// let written = write(Format::Radiance, &presets())?;
/// // A name in Radiance is one word.
/// assert_eq!(
///     written.notes[0].to_string(),
///     "\"brown matte\" is written under the name \"brown_matte\""
/// );
/// assert_eq!(read(Format::Radiance, &written.text)?.materials.len(), 8);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn write(format: Format, materials: &[Material]) -> Result<Exported> {
    let mut notes = Vec::new();
    let text = match format {
        Format::Gltf => gltf::write(materials, &mut notes),
        Format::Mitsuba => mitsuba::write(materials, &mut notes),
        Format::Radiance => radiance::write(materials, &mut notes)?,
    };
    Ok(Exported { text, notes })
}

/// What a reader has found so far.
#[derive(Default)]
struct Found {
    materials: Vec<Material>,
    notes: Vec<Note>,
}

impl Found {
    /// A name that no material has yet: the one given, or one by its place.
    fn name(&self, given: Option<&str>) -> String {
        let stem = match given.map(str::trim) {
            Some(name) if !name.is_empty() => name.to_owned(),
            _ => format!("material {}", self.materials.len() + 1),
        };
        let taken = |name: &str| {
            self.materials
                .iter()
                .any(|material| material.name() == name)
        };
        let mut name = stem.clone();
        let mut count = 1;
        while taken(&name) {
            count += 1;
            name = format!("{stem} {count}");
        }
        name
    }

    fn note(&mut self, material: &str, loss: Loss) {
        self.notes.push(Note {
            material: material.to_owned(),
            loss,
        });
    }

    /// Adds a material by its albedos along the normal and its width; `gains` of a material above 1
    /// is noted and it is scaled to 1.
    fn add(
        &mut self,
        name: String,
        diffuse: [f64; 3],
        specular: [f64; 3],
        sigma: f64,
    ) -> Result<()> {
        let largest = (0..3)
            .map(|channel| diffuse[channel] + specular[channel])
            .fold(0.0, f64::max);
        let scale = if largest > 1.0 { largest.recip() } else { 1.0 };
        // What passes 1 by a rounding is not worth a note.
        if largest > 1.0 + 1e-9 {
            self.note(&name, Loss::GainsEnergy { albedo: largest });
        }
        let scaled = |albedo: [f64; 3]| albedo.map(|value| value * scale);
        let material =
            Material::from_albedos(name.clone(), scaled(diffuse), scaled(specular), sigma)
                .map_err(|error| contents(format!("material {name:?}: {error}")))?;
        self.materials.push(material);
        Ok(())
    }
}

fn contents(problem: String) -> Error {
    Error::Contents {
        problem,
        remedy: "mend the file".to_owned(),
    }
}

/// The largest of three channels.
fn largest(channels: [f64; 3]) -> f64 {
    channels.into_iter().fold(0.0, f64::max)
}

/// The reflectance along the normal of a boundary of relative index n and extinction k.
fn along_normal(index: f64, extinction: f64) -> f64 {
    let square = |x: f64| x * x;
    (square(index - 1.0) + square(extinction)) / (square(index + 1.0) + square(extinction))
}
