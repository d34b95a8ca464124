//! `lobes render`: spheres as images.

use std::path::Path;

use serde_json::{Value, json};

use crate::arguments::{Render, RenderLobe};
use crate::error::{Error, Result};
use crate::lights::no_light;
use crate::materials::AnyMaterial;
use crate::output::OutputFolder;
use crate::output::sphere_exr;
use crate::place::Place;
use crate::{console, input, materials, progress, training_set};
use lobes::Parallelism;
use lobes::illumination::{EnvironmentMap, Luminance, builtin};
use lobes::picture::encode_png;
use lobes::reflectance::Fresnel;
use lobes::reflection::{Camera, LightTree, Renderer, Settings, SphereImage, Surface};

pub(super) fn run(options: &Render) -> Result<()> {
    if let Some(set) = &options.set {
        return training_set::run(set, &options.out);
    }
    let camera = Place {
        elevation: options.elevation,
        azimuth: options.azimuth,
        roll: 0.0,
        distance: options.distance,
    }
    .camera()?;
    let materials = materials::load_any(&options.materials)?;
    let names: Vec<&str> = materials.iter().map(AnyMaterial::name).collect();
    let stems = materials::stems(options.materials.materials.as_deref(), &names)?;
    let materials = with_facets(options, materials)?;
    let map = light(options)?;
    let mut scene = Scene::new(&map, camera, options);
    let mut output = OutputFolder::open(&options.out)?;
    let mut answers = Vec::new();
    let mut pictures = 0;
    let pixels = options.size.saturating_mul(options.size);
    let bar = progress::bar(materials.len().saturating_mul(pixels), "pixels");
    for (done, (material, stem)) in materials.iter().zip(&stems).enumerate() {
        let surface = material.surface(options.lobe.ward().unwrap_or_default());
        let rendered = scene.render(surface, &|points| bar.inc(points as u64))?;
        bar.set_position((done as u64 + 1).saturating_mul(pixels as u64));
        let image = &rendered.image;
        // A white sphere in light of mean radiance L shows about L; half of white leaves room
        // above.
        let exposure = 0.5 / Luminance::Rec709.of(map.mean());
        let pixel = |row, column| image.get(row, column);
        output.add(
            format!("{stem}.png"),
            encode_png(options.size, options.size, exposure, pixel)?,
        )?;
        output.add(format!("{stem}.exr"), sphere_exr(image)?)?;
        pictures += 2;
        let mut answer = json!({
            "light": map.name(),
            "material": surface.name(),
            "png": options.out.join(format!("{stem}.png")).display().to_string(),
            "exr": options.out.join(format!("{stem}.exr")).display().to_string(),
        });
        let said = match &rendered.error {
            Known::Estimate(error) => {
                answer["error"] = Value::from(*error);
                format!("relative error {error:.1e} (estimated)")
            }
            Known::Bound(bound, bounds) => {
                let name = format!("{stem}-bound.exr");
                output.add(&name, sphere_exr(bounds)?)?;
                pictures += 1;
                answer["bound"] = Value::from(*bound);
                answer["bounds"] = options.out.join(&name).display().to_string().into();
                format!("every pixel within {bound:.1e} (proven)")
            }
        };
        answers.push(answer);
        console::answer(format!("{}: {said}", surface.name()));
    }
    bar.finish_and_clear();
    output.commit()?;
    for answer in &answers {
        console::json(answer)?;
    }
    console::note(format!(
        "wrote {pictures} images to {}",
        options.out.display()
    ));
    Ok(())
}

/// The materials with the lobe and the facets that were asked for.
fn with_facets(options: &Render, materials: Vec<AnyMaterial>) -> Result<Vec<AnyMaterial>> {
    let facets = facets(options)?;
    if options.lobe != RenderLobe::Ggx {
        return match facets {
            None => Ok(materials),
            Some(_) => Err(Error::request(
                "--ior and --metal are of GGX's facets, and the lobe is one of Ward's",
                "add --lobe ggx",
            )),
        };
    }
    materials
        .into_iter()
        .map(|material| material.with_facets(facets))
        .collect()
}

/// What `--ior` or `--metal` says of the facets.
fn facets(options: &Render) -> Result<Option<[Fresnel; 3]>> {
    let each = |what, values: &[Fresnel]| match *values {
        [] => Ok(None),
        [all] => Ok(Some([all; 3])),
        [red, green, blue] => Ok(Some([red, green, blue])),
        _ => Err(Error::request(
            format!("{what} has {} values", values.len()),
            "give one, or one each for red, green and blue",
        )),
    };
    let glass: Vec<Fresnel> = options
        .ior
        .iter()
        .map(|&index| Fresnel::Dielectric { index })
        .collect();
    let facets = each("--ior", &glass)?;
    Ok(facets.or(each("--metal", &options.metal)?))
}

/// How far a picture is off at most.
enum Known {
    /// As the renderer estimates.
    Estimate(f64),
    /// Proven: the largest relative one, and those of the pixels.
    Bound(f64, SphereImage),
}

struct Rendered {
    image: SphereImage,
    error: Known,
}

/// A light and a camera, and what was made ready of the light so far.
struct Scene<'a> {
    map: &'a EnvironmentMap,
    camera: Camera,
    options: &'a Render,
    renderer: Option<Renderer>,
    tree: Option<LightTree>,
}

impl<'a> Scene<'a> {
    fn new(map: &'a EnvironmentMap, camera: Camera, options: &'a Render) -> Self {
        Self {
            map,
            camera,
            options,
            renderer: None,
            tree: None,
        }
    }

    fn render(&mut self, surface: Surface<'_>, tell: &(dyn Fn(usize) + Sync)) -> Result<Rendered> {
        let (all, camera) = (Parallelism::Rayon, self.camera);
        let settings = Settings {
            size: self.options.size,
            tolerance: self.options.tolerance,
            ..Settings::default()
        };
        match surface {
            Surface::Ward(material, variant) if !self.options.bound => {
                let renderer = match &mut self.renderer {
                    Some(renderer) => renderer,
                    none => none.insert(Renderer::new(self.map, all)?),
                };
                let rendering = renderer.render(material, variant, &camera, &settings, all)?;
                Ok(Rendered {
                    image: rendering.image,
                    error: Known::Estimate(rendering.error),
                })
            }
            surface => {
                let tree = match &mut self.tree {
                    Some(tree) => tree,
                    none => none.insert(LightTree::new(self.map, all)?),
                };
                let picture = tree.render_telling(surface, &camera, &settings, all, tell)?;
                let largest = picture.relative_bound();
                Ok(Rendered {
                    image: picture.image,
                    error: Known::Bound(largest, picture.bounds),
                })
            }
        }
    }
}

/// The map that `--light` names: a built-in one, or a file.
fn light(options: &Render) -> Result<EnvironmentMap> {
    let name = options.light.as_deref().unwrap_or_default();
    let path = Path::new(name);
    if input::is_standard(path) || path.exists() {
        return input::map(path, options.mapping);
    }
    let maps = builtin()?;
    match maps.iter().find(|map| map.name() == name) {
        Some(map) => Ok(map.clone()),
        None => Err(no_light(path, &maps)),
    }
}
