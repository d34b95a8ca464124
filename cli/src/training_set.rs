//! `lobes render --set`: every material under every light from every camera, as images to learn
//! from.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::arguments::{Materials, RenderLobe};
use crate::error::{Error, Result};
use crate::lights::no_light;
use crate::materials::{AnyMaterial, Widths};
use crate::output::{FolderLock, write_file};
use crate::place::Place;
use crate::{console, materials, named, progress, slug};
use lobes::Parallelism;
use lobes::files::{Picture, Precision, encode_exr};
use lobes::illumination::{self, EnvironmentMap, builtin};
use lobes::reflectance::{Fresnel, GgxMaterial, Material, Variant};
use lobes::reflection::{Camera, LightTree, Renderer, Settings, SphereImage, Surface, check_size};

/// The file that describes a set: docs/how-to/training-sets.md.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Description {
    #[serde(default = "default_size")]
    size: usize,
    #[serde(default = "default_tolerance")]
    tolerance: f64,
    #[serde(default = "one")]
    pixel_samples: usize,
    #[serde(default)]
    precision: Stored,
    #[serde(default = "default_lobe")]
    lobe: String,
    /// A file of materials, from the folder of this file; the presets without it.
    materials: Option<PathBuf>,
    /// Names of built-in maps, or files from the folder of this file; all built-in maps without it.
    lights: Option<Vec<String>>,
    #[serde(default)]
    camera: Vec<Place>,
}

fn default_size() -> usize {
    Settings::default().size
}

fn default_tolerance() -> f64 {
    Settings::default().tolerance
}

fn one() -> usize {
    1
}

fn default_lobe() -> String {
    Variant::default().name().into()
}

/// How the images are stored.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Stored {
    #[default]
    Half,
    Single,
}

/// A line of the index.
#[derive(Debug, Serialize)]
struct IndexLine<'a> {
    file: String,
    light: &'a str,
    material: &'a str,
    #[serde(flatten)]
    parameters: Parameters,
    lobe: &'a str,
    camera: Place,
    size: usize,
    pixel_samples: usize,
    tolerance: f64,
    precision: Stored,
    /// Of this program: another one may make other images.
    version: &'a str,
}

/// A material in the index.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Parameters {
    Ward {
        diffuse: [f64; 3],
        specular: [f64; 3],
        sigma: f64,
    },
    Ggx {
        diffuse: [f64; 3],
        alpha: Widths,
        #[serde(skip_serializing_if = "Option::is_none")]
        axis: Option<[f64; 3]>,
        #[serde(skip_serializing_if = "Option::is_none")]
        f0: Option<[f64; 3]>,
        #[serde(skip_serializing_if = "Option::is_none")]
        index: Option<[f64; 3]>,
        #[serde(skip_serializing_if = "Option::is_none")]
        extinction: Option<[f64; 3]>,
    },
}

impl From<&AnyMaterial> for Parameters {
    fn from(material: &AnyMaterial) -> Self {
        match material {
            AnyMaterial::Ward(material) => Self::Ward {
                diffuse: material.diffuse(),
                specular: material.specular(),
                sigma: material.roughness().sigma(),
            },
            AnyMaterial::Ggx(material) => {
                let [f0, index, extinction] = Fresnel::channels(material.fresnel());
                let (alpha, axis) = Widths::of(material);
                Self::Ggx {
                    diffuse: material.diffuse(),
                    alpha,
                    axis,
                    f0,
                    index,
                    extinction,
                }
            }
        }
    }
}

/// A line of the list of errors.
#[derive(Debug, Serialize, Deserialize)]
struct Reached {
    file: String,
    /// As [`Rendering::error`](lobes::reflection::Rendering::error); of GGX the proven
    /// [`BoundedImage::relative_bound`](lobes::reflection::BoundedImage::relative_bound).
    error: f64,
}

/// The index of a set.
const INDEX: &str = "index.jsonl";

/// The errors of a set's images, estimated or bounded.
const ERRORS: &str = "errors.jsonl";

/// Renders what of the set is not there yet.
///
/// The folder holds the index from the start: it says what the images will be, and another set is
/// not mixed into it. Each image is written aside and renamed, so that a file with its name is
/// whole, whenever the command is stopped; its error is in the list of errors before that.
pub(super) fn run(path: &Path, out: &Path) -> Result<()> {
    let set = read(path)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let lobe: RenderLobe = set
        .lobe
        .parse()
        .map_err(|error| named::in_file(path, error))?;
    let materials = materials::load_any(&Materials {
        materials: set.materials.as_ref().map(|file| folder.join(file)),
        as_albedos: false,
        only: Vec::new(),
    })?;
    let materials = match lobe {
        RenderLobe::Ward(_) => materials,
        RenderLobe::Ggx => materials
            .into_iter()
            .map(|material| material.with_facets(None))
            .collect::<Result<_>>()?,
    };
    let variant = lobe.ward().unwrap_or_default();
    let (lights, sources) = sources(&set, &folder)?;
    let places = if set.camera.is_empty() {
        vec![Place::default()]
    } else {
        set.camera.clone()
    };
    let cameras = places
        .iter()
        .map(Place::camera)
        .collect::<lobes::Result<Vec<_>>>()?;
    let settings = Settings {
        size: set.size,
        tolerance: set.tolerance,
        pixel_samples: set.pixel_samples,
    };
    check(&settings, &cameras[0])?;
    let names = distinct(
        path,
        "lights",
        lights.iter().map(|light| stem(light)).collect(),
    )?;
    let called: Vec<&str> = materials.iter().map(AnyMaterial::name).collect();
    let stems = materials::stems(Some(path), &called)?;
    let file = |light: usize, material: usize, camera: usize| {
        format!("{}/{}-{:03}.exr", names[light], stems[material], camera)
    };
    let mut index = String::new();
    for (l, light) in lights.iter().enumerate() {
        for (m, material) in materials.iter().enumerate() {
            for (c, &camera) in places.iter().enumerate() {
                let entry = IndexLine {
                    file: file(l, m, c),
                    light,
                    material: material.name(),
                    parameters: material.into(),
                    lobe: match material {
                        AnyMaterial::Ward(_) => &set.lobe,
                        AnyMaterial::Ggx(_) => RenderLobe::Ggx.name(),
                    },
                    camera,
                    size: set.size,
                    pixel_samples: set.pixel_samples,
                    tolerance: set.tolerance,
                    precision: set.precision,
                    version: env!("CARGO_PKG_VERSION"),
                };
                index.push_str(&line(&entry)?);
            }
        }
    }
    // A light that cannot be read is found before hours of work, and leaves no folder.
    if !out.join(INDEX).exists() {
        for source in &sources {
            if let Source::File(path) = source {
                illumination::read(path, None)?;
            }
        }
    }
    let _lock = begin(out, &names, &index)?;
    let reached = read_errors(&out.join(ERRORS))?;
    let errors = Mutex::new(open_errors(&out.join(ERRORS))?);
    let missing: Vec<Vec<(usize, usize)>> = (0..lights.len())
        .map(|l| {
            (0..materials.len())
                .flat_map(|m| (0..places.len()).map(move |c| (m, c)))
                .filter(|&(m, c)| {
                    let file = file(l, m, c);
                    !reached.contains_key(&file) || !out.join(file).exists()
                })
                .collect()
        })
        .collect();
    let total = lights.len() * materials.len() * places.len();
    let wanted: usize = missing.iter().map(Vec::len).sum();
    let bar = progress::bar(wanted, "spheres");
    let refused = Mutex::new(Vec::new());
    // One file's map at a time is in memory, and as many images as there are threads.
    for (l, missing) in missing.iter().enumerate() {
        if missing.is_empty() {
            continue;
        }
        let map = match &sources[l] {
            Source::Builtin(map) => map,
            Source::File(path) => &illumination::read(path, None)?,
        };
        let any =
            |kind: fn(&AnyMaterial) -> bool| missing.iter().any(|&(m, _)| kind(&materials[m]));
        let (ward, ggx) = (
            any(|material| matches!(material, AnyMaterial::Ward(_))),
            any(|material| matches!(material, AnyMaterial::Ggx(_))),
        );
        let all = Parallelism::Rayon;
        let renderer = ward.then(|| Renderer::new(map, all)).transpose()?;
        let tree = ggx.then(|| LightTree::new(map, all)).transpose()?;
        let ready: Vec<(usize, usize, Ready)> = missing
            .iter()
            .filter_map(|&(m, c)| {
                let ready = match &materials[m] {
                    AnyMaterial::Ward(material) => {
                        Ready::Estimated(renderer.as_ref()?, material, variant)
                    }
                    AnyMaterial::Ggx(material) => Ready::Bounded(tree.as_ref()?, material),
                };
                Some((m, c, ready))
            })
            .collect();
        ready
            .par_iter()
            .try_for_each(|&(m, c, ready)| -> Result<()> {
                match ready.render(&cameras[c], &settings) {
                    Ok((image, error)) => {
                        let bytes = encode(&image, set.precision)
                            .map_err(|error| Error::of(file(l, m, c), error))?;
                        let reached = line(&Reached {
                            file: file(l, m, c),
                            error,
                        })?;
                        errors
                            .lock()
                            .unwrap_or_else(PoisonError::into_inner)
                            .write_all(reached.as_bytes())
                            .map_err(|error| not_writable(out, &error))?;
                        write_file(&out.join(file(l, m, c)), &bytes)?;
                    }
                    Err(lobes::Error::Tolerance { reached, .. }) => {
                        let mut refused = refused.lock().unwrap_or_else(PoisonError::into_inner);
                        refused.push((file(l, m, c), reached));
                    }
                    Err(error) => return Err(error.into()),
                }
                bar.inc(1);
                Ok(())
            })?;
    }
    bar.finish_and_clear();
    let mut refused = refused.into_inner().unwrap_or_else(PoisonError::into_inner);
    refused.sort_by(|a, b| a.0.cmp(&b.0));
    if let Some((worst, reached)) = refused.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        for (file, reached) in &refused {
            console::complain(format!("{file}: reached {reached:.1e}"));
        }
        return Err(Error::Partly {
            failed: refused.len(),
            total,
            what: format!(
                "images were not written, since they did not reach the tolerance of {:e} (the worst, {worst}, reached {reached:.1e}); the others are whole: ask for less in another folder",
                set.tolerance
            ),
        });
    }
    drop(errors);
    sort_errors(&out.join(ERRORS))?;
    console::json(&json!({
        "folder": out.display().to_string(),
        "index": out.join(INDEX).display().to_string(),
        "images": total,
        "new": wanted,
    }))?;
    console::answer(format!(
        "{total} images in {}, {wanted} of them new; {INDEX} says what each is",
        out.display()
    ));
    Ok(())
}

/// What renders a material under one light.
#[derive(Clone, Copy)]
enum Ready<'a> {
    Estimated(&'a Renderer, &'a Material, Variant),
    Bounded(&'a LightTree, &'a GgxMaterial),
}

impl Ready<'_> {
    /// A picture and its error, by one thread.
    fn render(self, camera: &Camera, settings: &Settings) -> lobes::Result<(SphereImage, f64)> {
        let one = Parallelism::Sequential;
        match self {
            Self::Estimated(renderer, material, variant) => {
                let rendering = renderer.render(material, variant, camera, settings, one)?;
                Ok((rendering.image, rendering.error))
            }
            Self::Bounded(tree, material) => {
                let picture = tree.render(Surface::Ggx(material), camera, settings, one)?;
                let bound = picture.relative_bound();
                Ok((picture.image, bound))
            }
        }
    }
}

/// Where a light comes from.
enum Source {
    Builtin(EnvironmentMap),
    File(PathBuf),
}

/// The lights' names and where they come from.
fn sources(set: &Description, folder: &Path) -> Result<(Vec<String>, Vec<Source>)> {
    let maps = builtin()?;
    let names = match &set.lights {
        Some(lights) => lights.clone(),
        None => maps.iter().map(|map| map.name().to_owned()).collect(),
    };
    let sources = names
        .iter()
        .map(|name| {
            let path = folder.join(name);
            if path.is_file() {
                return Ok(Source::File(path));
            }
            match maps.iter().find(|map| map.name() == name) {
                Some(map) => Ok(Source::Builtin(map.clone())),
                None => Err(no_light(&path, &maps)),
            }
        })
        .collect::<Result<_>>()?;
    Ok((names, sources))
}

/// Says what is wrong with the settings before anything is written: renders a mirror under a grey
/// map.
fn check(settings: &Settings, camera: &Camera) -> Result<()> {
    let map = EnvironmentMap::new("grey", 8, 4, vec![[1.0; 3]; 32])?;
    let mirror = Material::from_albedos("mirror", [0.0; 3], [1.0; 3], 0.0)?;
    check_size(settings.size)?;
    let small = Settings {
        size: settings.size.min(8),
        ..*settings
    };
    Renderer::new(&map, Parallelism::Sequential)?.render(
        &mirror,
        Variant::default(),
        camera,
        &small,
        Parallelism::Sequential,
    )?;
    Ok(())
}

/// An image as the bytes of a file.
fn encode(image: &SphereImage, stored: Stored) -> Result<Vec<u8>> {
    let size = image.size();
    let pixels: Vec<[f64; 3]> = (0..size * size)
        .map(|i| image.get(i / size, i % size).unwrap_or_default())
        .collect();
    let precision = match stored {
        Stored::Half => Precision::Half,
        Stored::Single => Precision::Single,
    };
    let brightest = pixels.iter().flatten().copied().fold(0.0, f64::max);
    if precision == Precision::Half && brightest > LARGEST_HALF {
        return Err(Error::request(
            format!("the radiance {brightest:.3e} is more than half precision holds"),
            "say precision = \"single\"",
        ));
    }
    let picture = Picture {
        width: size,
        height: size,
        pixels,
    };
    Ok(encode_exr(&picture, precision)?)
}

/// The largest finite value of half precision.
const LARGEST_HALF: f64 = 65_504.0;

fn read(path: &Path) -> Result<Description> {
    let text = fs::read_to_string(path).map_err(|error| {
        Error::file(
            path,
            format!("cannot be read ({error})"),
            "name a TOML file that describes a set",
        )
    })?;
    parse(path, &text)
}

/// The set that a file's text describes.
pub(super) fn parse(path: &Path, text: &str) -> Result<Description> {
    let set: Description = toml::from_str(text).map_err(|error| {
        let line = error
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        Error::file(
            path,
            format!("line {line}: {}", error.message()),
            "docs/how-to/training-sets.md shows the form",
        )
    })?;
    if set.lights.as_ref().is_some_and(Vec::is_empty) {
        return Err(Error::file(
            path,
            "names no light",
            "leave `lights` out for all built-in maps",
        ));
    }
    Ok(set)
}

/// What a light is called in file names.
fn stem(light: &str) -> String {
    slug(
        &Path::new(light)
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy(),
    )
}

/// The names, if no two are the same.
fn distinct(path: &Path, what: &str, names: Vec<String>) -> Result<Vec<String>> {
    let twice = names
        .iter()
        .enumerate()
        .find(|(index, name)| names[..*index].contains(name));
    match twice {
        None => Ok(names),
        Some((_, name)) => Err(Error::file(
            path,
            format!("two {what} would both be written as {name:?}"),
            "give each a name of its own",
        )),
    }
}

/// Makes the folders and the index, and takes away what an interrupted run was writing; no other
/// run writes there until the lock goes.
fn begin(out: &Path, lights: &[String], index: &str) -> Result<FolderLock> {
    let failed = |error: std::io::Error| not_writable(out, &error);
    let path = out.join(INDEX);
    if path.exists() {
        if fs::read_to_string(&path).map_err(failed)? != index {
            return Err(Error::file(
                &path,
                "describes another set",
                "name another folder with --out",
            ));
        }
    } else if out.exists() && fs::read_dir(out).map_err(failed)?.next().is_some() {
        return Err(Error::file(
            out,
            "holds something else than a set",
            "name another folder with --out",
        ));
    }
    fs::create_dir_all(out).map_err(failed)?;
    let lock = FolderLock::take(out)?;
    let folders = lights.iter().map(|light| out.join(light));
    for folder in folders.chain([out.to_path_buf()]) {
        fs::create_dir_all(&folder).map_err(failed)?;
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with('.') && name.ends_with("-partial") {
                fs::remove_file(&path).map_err(failed)?;
            }
        }
    }
    if !path.exists() {
        write_file(&path, index.as_bytes())?;
    }
    Ok(lock)
}

/// A value as a line of JSON.
fn line(value: &impl Serialize) -> Result<String> {
    let line = serde_json::to_string(value)
        .map_err(|error| Error::system("the index makes no JSON", error))?;
    Ok(line + "\n")
}

fn not_writable(out: &Path, error: &std::io::Error) -> Error {
    Error::file(
        out,
        format!("the output folder cannot be written ({error})"),
        "name another one with --out",
    )
}

/// The list of errors by file, as far as its lines are whole: a command that is stopped may leave
/// half of one.
fn read_errors(path: &Path) -> Result<BTreeMap<String, f64>> {
    if !path.exists() {
        return Ok(BTreeMap::new());
    }
    let text = fs::read_to_string(path).map_err(|error| not_writable(path, &error))?;
    let lines = text
        .lines()
        .filter_map(|line| serde_json::from_str::<Reached>(line).ok());
    Ok(lines.map(|line| (line.file, line.error)).collect())
}

/// The list of errors, to go on with.
fn open_errors(path: &Path) -> Result<fs::File> {
    // Without the half line.
    sort_errors(path)?;
    fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(path)
        .map_err(|error| not_writable(path, &error))
}

/// Writes the list of errors in the order of the files' names.
fn sort_errors(path: &Path) -> Result<()> {
    let mut text = String::new();
    for (file, error) in read_errors(path)? {
        text.push_str(&line(&Reached { file, error })?);
    }
    write_file(path, text.as_bytes())
}
