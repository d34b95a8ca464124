//! `lobes render`: spheres as images.

use std::path::Path;

use glam::DVec3;

use crate::cli::arguments::Render;
use crate::cli::output::OutputFolder;
use crate::cli::reproduce::sphere_exr;
use crate::cli::{materials, slug};
use crate::illumination::{EnvironmentMap, Luminance, builtin, read};
use crate::reflection::{Camera, Renderer, Settings};
use crate::report::encode_png;
use crate::{Error, Parallelism, Result};

pub(super) fn run(options: &Render) -> Result<()> {
    let camera = camera(options)?;
    let mut output = OutputFolder::open(&options.out)?;
    let mut materials = materials::load(&options.materials)?;
    if let Some(name) = &options.material {
        let names: Vec<String> = materials.iter().map(|m| m.name().to_owned()).collect();
        materials.retain(|m| m.name() == name);
        if materials.is_empty() {
            return Err(Error::Unanswerable(format!(
                "there is no material {name:?}; the names are {}",
                names.join(", ")
            )));
        }
    }
    let map = light(options)?;
    let settings = Settings {
        size: options.size,
        tolerance: options.tolerance,
        ..Settings::default()
    };
    let renderer = Renderer::new(&map, Parallelism::Rayon)?;
    for material in &materials {
        let rendering = renderer.render(
            material,
            options.lobe,
            &camera,
            &settings,
            Parallelism::Rayon,
        )?;
        let image = rendering.image;
        let stem = slug(material.name());
        // A white sphere in light of mean radiance L shows about L; half of white leaves room above.
        let exposure = 0.5 / Luminance::Rec709.of(map.mean());
        let pixel = |row, column| image.get(row, column);
        output.add(
            format!("{stem}.png"),
            encode_png(options.size, options.size, exposure, pixel)?,
        );
        output.add(format!("{stem}.exr"), sphere_exr(&image)?);
        println!(
            "{}: relative error {:.1e} (estimated)",
            material.name(),
            rendering.error
        );
    }
    output.commit()?;
    println!(
        "wrote {} images to {}",
        2 * materials.len(),
        options.out.display()
    );
    Ok(())
}

/// The camera that the options describe.
fn camera(options: &Render) -> Result<Camera> {
    for (what, value) in [
        ("the elevation", options.elevation),
        ("the azimuth", options.azimuth),
    ] {
        if !value.is_finite() {
            return Err(Error::Domain {
                what,
                value,
                allowed: "a finite angle",
            });
        }
    }
    let (sin_elevation, cos_elevation) = options.elevation.to_radians().sin_cos();
    let (sin_azimuth, cos_azimuth) = options.azimuth.to_radians().sin_cos();
    let towards = DVec3::new(
        cos_elevation * sin_azimuth,
        sin_elevation,
        cos_elevation * cos_azimuth,
    );
    match options.distance {
        None => Camera::orthographic(towards, DVec3::Y),
        Some(distance) => Camera::perspective(towards, DVec3::Y, distance),
    }
}

/// The map that `--light` names: a built-in one, or a file.
fn light(options: &Render) -> Result<EnvironmentMap> {
    let path = Path::new(&options.light);
    if path.exists() {
        return read(path, options.mapping);
    }
    let maps = builtin()?;
    let names: Vec<String> = maps.iter().map(|m| m.name().to_owned()).collect();
    maps.into_iter()
        .find(|map| map.name() == options.light)
        .ok_or_else(|| {
            Error::file(
                path,
                "is neither a file nor a built-in map",
                format!("the built-in maps are {}", names.join(", ")),
            )
        })
}
