//! `lobes render`: spheres as images.

use std::path::Path;

use serde_json::json;

use crate::arguments::Render;
use crate::error::Result;
use crate::lights::no_light;
use crate::output::OutputFolder;
use crate::output::sphere_exr;
use crate::place::Place;
use crate::{console, input, materials, training_set};
use lobes::Parallelism;
use lobes::illumination::{EnvironmentMap, Luminance, builtin};
use lobes::picture::encode_png;
use lobes::reflection::{Renderer, Settings};

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
    let materials = materials::load(&options.materials)?;
    let stems = materials::stems(options.materials.materials.as_deref(), &materials)?;
    let map = light(options)?;
    let settings = Settings {
        size: options.size,
        tolerance: options.tolerance,
        ..Settings::default()
    };
    let renderer = Renderer::new(&map, Parallelism::Rayon)?;
    let mut output = OutputFolder::open(&options.out)?;
    let mut answers = Vec::new();
    for (material, stem) in materials.iter().zip(&stems) {
        let rendering = renderer.render(
            material,
            options.lobe.name,
            &camera,
            &settings,
            Parallelism::Rayon,
        )?;
        let image = rendering.image;
        // A white sphere in light of mean radiance L shows about L; half of white leaves room
        // above.
        let exposure = 0.5 / Luminance::Rec709.of(map.mean());
        let pixel = |row, column| image.get(row, column);
        output.add(
            format!("{stem}.png"),
            encode_png(options.size, options.size, exposure, pixel)?,
        )?;
        output.add(format!("{stem}.exr"), sphere_exr(&image)?)?;
        answers.push(json!({
            "light": map.name(),
            "material": material.name(),
            "png": options.out.join(format!("{stem}.png")).display().to_string(),
            "exr": options.out.join(format!("{stem}.exr")).display().to_string(),
            "error": rendering.error,
        }));
        console::answer(format!(
            "{}: relative error {:.1e} (estimated)",
            material.name(),
            rendering.error
        ));
    }
    output.commit()?;
    for answer in &answers {
        console::json(answer)?;
    }
    console::note(format!(
        "wrote {} images to {}",
        2 * materials.len(),
        options.out.display()
    ));
    Ok(())
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
