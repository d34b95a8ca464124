//! The tutorial's program: light, its spectrum, spheres under it, their features, and a name.
//!
//!     cargo run --release --example tutorial -- docs/tutorial
//!
//! writes the pictures of `docs/tutorial.md` into a folder and prints the numbers that stand there.
//! Without a folder it writes none.

use std::path::Path;

use lobes::features::{Continuation, ImageSpectrum, PaperFeatures};
use lobes::harmonics::average_power;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::inference::{Plan, View, collect};
use lobes::picture::{encode_png, encode_spheres};
use lobes::reflectance::{Variant, presets};
use lobes::reflection::{Renderer, Settings, SphereImage, Viewpoint};
use lobes::{Error, Parallelism, Result};
use lobes_cli::report::{Axis, Chart, Mark, Naming, Series};

/// The degree to which spectra are taken.
const DEGREE: usize = 64;

fn main() -> Result<()> {
    let folder = std::env::args().nth(1);
    let write = |name: &str, bytes: &[u8]| match &folder {
        None => Ok(()),
        Some(folder) => {
            let path = Path::new(folder).join(name);
            std::fs::write(&path, bytes).map_err(|error| {
                Error::file(
                    &path,
                    error.to_string(),
                    "give a folder that can be written",
                )
            })
        }
    };

    // 1. Light.
    let maps = builtin()?;
    let place = maps
        .iter()
        .position(|map| map.name() == "pmndrs-venice")
        .unwrap_or(0);
    let light = &maps[place];
    write("light.png", &thumbnail(light)?)?;

    // 2. Its spectrum: the luminance's power at each degree.
    let green = &light.coefficients(DEGREE, Parallelism::Rayon)?[1];
    let of_light = average_power(green);
    let slope = (of_light[32] / of_light[4]).log2() / 3.0;
    println!("from degree 4 to 32 the power falls as l^{slope:.2}");
    assert!((-3.5..-1.5).contains(&slope));

    // 3. Spheres under it.
    let materials = presets();
    let view = View {
        elevation: 0.0,
        viewpoint: Viewpoint::Orthographic,
    };
    let camera = view.cameras(1)?[0];
    let settings = Settings {
        size: 128,
        tolerance: 1e-3,
        ..Settings::default()
    };
    let renderer = Renderer::new(light, Parallelism::Rayon)?;
    let mut spheres = Vec::new();
    for name in ["white matte", "blue plastic", "old gold"] {
        let Some(material) = materials.iter().find(|material| material.name() == name) else {
            continue;
        };
        let lobe = Variant::default();
        spheres.push(
            renderer
                .render(material, lobe, &camera, &settings, Parallelism::Rayon)?
                .image,
        );
    }
    let all: Vec<&SphereImage> = spheres.iter().collect();
    let exposure = 0.5 / spheres[0].mean()[1];
    write("spheres.png", &encode_spheres(&all, 3, 8, exposure)?)?;

    // 4. Their spectra, and the paper's features of them.
    let spectrum = ImageSpectrum::new(DEGREE, Continuation::Mirror)?;
    let mut series = vec![line("the light", "#777777", &of_light)];
    for ((image, name), colour) in spheres
        .iter()
        .zip(["white matte", "blue plastic", "old gold"])
        .zip(["#999999", "#3b6fb6", "#c98a1b"])
    {
        let power = spectrum.power(image)?;
        let features = PaperFeatures::of_image(&spectrum, image)?.to_array();
        println!("{name}: v1 = {:.4}, v7 = {}", features[0], features[6]);
        series.push(line(name, colour, &power.luminance));
    }
    let chart = Chart {
        title: "Power by degree".into(),
        x_label: "degree l".into(),
        y_label: "share of the power".into(),
        x_axis: Axis::Logarithmic,
        y_axis: Axis::Logarithmic,
        series,
    };
    write("spectra.svg", chart.svg().as_bytes())?;

    // 5. A name: the nearest neighbour among spheres under all other maps.
    let plan = Plan {
        lobe: Variant::default(),
        settings,
        turns: 1,
    };
    let read = |image: &SphereImage| PaperFeatures::of_image(&spectrum, image);
    let set = collect(
        &view.cameras(1)?,
        &maps,
        &materials,
        &plan,
        Parallelism::Rayon,
        &|| (),
        &|_, image| read(image),
    )?;
    let (own, others): (Vec<_>, Vec<_>) = set
        .observations
        .iter()
        .partition(|of| of.illumination == place);
    let mut right = 0;
    for sphere in &own {
        let distance = |of: &PaperFeatures| -> f64 {
            let pairs = of.to_array().into_iter().zip(sphere.view.to_array());
            pairs.map(|(a, b)| (a / b).ln().powi(2)).sum()
        };
        let nearest = others
            .iter()
            .min_by(|a, b| distance(&a.view).total_cmp(&distance(&b.view)));
        let said = nearest.map_or(usize::MAX, |of| of.material);
        right += usize::from(said == sphere.material);
        println!(
            "{} is taken for {}",
            set.materials[sphere.material], set.materials[said]
        );
    }
    println!("{right} of {} are named right", own.len());
    assert!(right >= 6);
    Ok(())
}

/// A map as a picture of 256 by 128 pixels.
fn thumbnail(map: &EnvironmentMap) -> Result<Vec<u8>> {
    let small = map.resampled(256, 128)?;
    let mean = small.mean()[1];
    encode_png(256, 128, 0.3 / mean, |row, column| {
        Some(small.pixels()[row * 256 + column])
    })
}

/// A spectrum as a line: each degree's share of the power from degree 1 on.
fn line(name: &str, colour: &str, power: &[f64]) -> Series {
    let total: f64 = power.iter().skip(1).sum();
    let points = power.iter().enumerate().skip(1);
    Series {
        name: name.into(),
        naming: Naming::Legend,
        colour: colour.into(),
        mark: Mark::Line(1.5),
        points: points.map(|(l, value)| (l as f64, value / total)).collect(),
    }
}
