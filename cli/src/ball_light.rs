//! The light about a classified ball, as maps.

use std::path::Path;

use crate::error::Result;
use crate::output;
use lobes::Parallelism;
use lobes::features::{Modes, Unwrapped};
use lobes::files::{self, Precision, encode_exr};
use lobes::inference::{BrightLights, ChannelReflectance, LightReader, natural_spectrum};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{SphereImage, Viewpoint};

/// Rows of the maps.
const HEIGHT: usize = 128;

/// The degree to which light is read: what pictures of 96 pixels show.
const DEGREE: usize = 96;

/// η of the field, in the middle of 0.2 … 0.8, which is what the built-in maps without a sun in them
/// have (`lobes spectrum`): a sun is a light of its own.
const ETA: f64 = 0.5;

/// The noise of a photograph of 8 bits, as a share of the amplitudes.
const NOISE: f64 = 3e-3;

/// Writes the light that an image shows of a ball of a known material, and its standard deviation
/// beside it, as lat-long maps in the camera's frame: it stands towards +z, +y is up, and the
/// centre column looks along −z.
pub(super) fn write(path: &Path, image: &SphereImage, material: &Material) -> Result<()> {
    let viewpoint = match image.camera().distance() {
        Some(distance) => Viewpoint::Perspective { distance },
        None => Viewpoint::Orthographic,
    };
    let layout = LightReader::default_layout(viewpoint)?;
    let unwrapped = Unwrapped::new(image, &layout)?;
    let lights = BrightLights::of(&unwrapped, &layout);
    let modes = Modes::of(&unwrapped, &layout, |rgb| rgb)?;
    let spectrum = natural_spectrum(ETA, DEGREE);
    let sigma = material.roughness().sigma();
    // About the line of sight first, where a row is one polar angle.
    let (rows, columns) = (2 * HEIGHT, 4 * HEIGHT);
    let turn = std::f64::consts::TAU / columns as f64;
    let azimuths: Vec<f64> = (0..columns).map(|column| turn * column as f64).collect();
    let mut of_view = vec![([0.0; 3], [0.0; 3]); rows * columns];
    for (channel, modes) in modes.iter().enumerate() {
        let reflectance = ChannelReflectance {
            diffuse: material.diffuse()[channel],
            specular: material.specular()[channel],
            sigma,
        };
        let variant = Variant::default();
        let rayon = Parallelism::Rayon;
        let reader = LightReader::new(variant, reflectance, &layout, &spectrum, NOISE, rayon)?;
        let estimate = reader.read(modes, &lights)?;
        let of_rows = rayon.map(rows, |row| {
            let polar = std::f64::consts::PI * (row as f64 + 0.5) / rows as f64;
            reader.radiance(&estimate, polar, &azimuths)
        });
        for (row, of_row) in of_rows.into_iter().enumerate() {
            for (column, (mean, deviation)) in of_row?.into_iter().enumerate() {
                let value = &mut of_view[row * columns + column];
                value.0[channel] = mean.max(0.0);
                value.1[channel] = deviation;
            }
        }
    }
    let (mut mean, mut deviation) = (Vec::new(), Vec::new());
    for place in 0..2 * HEIGHT * HEIGHT {
        let (row, column) = (place / (2 * HEIGHT), place % (2 * HEIGHT));
        let theta = std::f64::consts::PI * (row as f64 + 0.5) / HEIGHT as f64;
        let phi = std::f64::consts::PI * ((column as f64 + 0.5) / HEIGHT as f64 - 1.0);
        let (x, y, z) = (
            theta.sin() * phi.sin(),
            theta.cos(),
            -theta.sin() * phi.cos(),
        );
        let (polar, azimuth) = (z.clamp(-1.0, 1.0).acos(), y.atan2(x));
        let at = rows as f64 * polar / std::f64::consts::PI - 0.5;
        let along = (azimuth / turn).rem_euclid(columns as f64);
        let (above, left) = (at.max(0.0) as usize, along as usize);
        let (below, right) = ((above + 1).min(rows - 1), (left + 1) % columns);
        let (v, u) = ((at - above as f64).clamp(0.0, 1.0), along - left as f64);
        let left = left % columns;
        let corners = [
            (above, left, (1.0 - v) * (1.0 - u)),
            (above, right, (1.0 - v) * u),
            (below, left, v * (1.0 - u)),
            (below, right, v * u),
        ];
        let mut sums = [[0.0; 3]; 2];
        for (row, column, weight) in corners {
            let (mean, deviation) = of_view[row * columns + column];
            for channel in 0..3 {
                sums[0][channel] += weight * mean[channel];
                sums[1][channel] += weight * deviation[channel];
            }
        }
        mean.push(sums[0]);
        deviation.push(sums[1]);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!("{stem}-deviation.exr"));
    for (path, pixels) in [(path, mean), (&beside, deviation)] {
        let picture = files::Picture {
            width: 2 * HEIGHT,
            height: HEIGHT,
            pixels,
        };
        output::write_file(path, &encode_exr(&picture, Precision::Single)?)?;
        crate::console::note(format!("wrote {}", path.display()));
    }
    Ok(())
}
