//! Linear radiance as a picture to look at.

use std::io::Cursor;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use crate::files::srgb8_of_linear;
use crate::reflection::SphereImage;
use crate::{Error, Result};

/// A PNG of linear RGB: times `exposure`, clipped to [0, 1], encoded as sRGB in 8 bits
/// (IEC 61966-2-1); transparent where `pixel(row, column)` gives nothing.
///
/// # Errors
/// [`Error::Encoding`] for a size that PNG cannot hold.
pub fn encode_png(
    width: usize,
    height: usize,
    exposure: f64,
    pixel: impl Fn(usize, usize) -> Option<[f64; 3]>,
) -> Result<Vec<u8>> {
    encode(width, height, exposure, |row, column| {
        Some((pixel(row, column)?, 1.0))
    })
}

/// Spheres of one size side by side, `columns` in a row and `margin` pixels about each, as a PNG
/// like that of [`encode_png`]. The pixels on their outlines are as opaque as the share of them
/// that the sphere covers, so that outlines have no stairs on any ground.
///
/// # Errors
/// [`Error::Empty`]  without a sphere or a column, or for a size that PNG cannot hold.
pub fn encode_spheres(
    spheres: &[&SphereImage],
    columns: usize,
    margin: usize,
    exposure: f64,
) -> Result<Vec<u8>> {
    let Some(first) = spheres.first().filter(|_| columns > 0) else {
        return Err(Error::Empty {
            what: "a picture of spheres",
            needs: "a sphere and a column",
        });
    };
    let cell = first.size() + margin;
    let rows = spheres.len().div_ceil(columns);
    let (width, height) = (columns * cell + margin, rows * cell + margin);
    encode(width, height, exposure, |row, column| {
        let (row, column) = (row.checked_sub(margin)?, column.checked_sub(margin)?);
        let sphere = spheres.get(row / cell * columns + column / cell)?;
        covered(sphere, row % cell, column % cell)
    })
}

/// What a pixel shows of a sphere, and the share of it that the sphere covers.
fn covered(sphere: &SphereImage, row: usize, column: usize) -> Option<([f64; 3], f64)> {
    /// An outline is sampled at so many points a side of a pixel.
    const SAMPLES: usize = 8;
    let size = sphere.size();
    if row >= size || column >= size {
        return None;
    }
    let around = |place: usize| place.saturating_sub(1)..(place + 2).min(size);
    let mut neighbours = around(row).flat_map(|y| around(column).map(move |x| (y, x)));
    let own = sphere.get(row, column);
    // A pixel at the picture's edge has no neighbour there, and the outline may run through it.
    let within_frame = |place: usize| 0 < place && place + 1 < size;
    let inside = within_frame(row) && within_frame(column);
    if inside && own.is_some() && neighbours.all(|(y, x)| sphere.get(y, x).is_some()) {
        return own.map(|colour| (colour, 1.0));
    }
    let within = |i: usize| {
        let (y, x) = (row * SAMPLES + i / SAMPLES, column * SAMPLES + i % SAMPLES);
        sphere.camera().pixel(SAMPLES * size, y, x).is_some()
    };
    let count = (0..SAMPLES * SAMPLES).filter(|&i| within(i)).count();
    let share = count as f64 / (SAMPLES * SAMPLES) as f64;
    if let Some(colour) = own {
        return Some((colour, share));
    }
    // Its centre misses the sphere: the mean of those beside it whose centres do not.
    let mut sum = [0.0; 3];
    let mut found = 0.0;
    for (y, x) in around(row).flat_map(|y| around(column).map(move |x| (y, x))) {
        if let Some(colour) = sphere.get(y, x) {
            sum = std::array::from_fn(|c| sum[c] + colour[c]);
            found += 1.0;
        }
    }
    (found > 0.0 && share > 0.0).then(|| (sum.map(|value| value / found), share))
}

/// A PNG of linear RGB and opacity.
fn encode(
    width: usize,
    height: usize,
    exposure: f64,
    pixel: impl Fn(usize, usize) -> Option<([f64; 3], f64)>,
) -> Result<Vec<u8>> {
    let mut samples = Vec::with_capacity(4 * width * height);
    for row in 0..height {
        for column in 0..width {
            match pixel(row, column) {
                Some((rgb, opacity)) => {
                    samples.extend(rgb.map(|value| srgb8_of_linear(value * exposure)));
                    samples.push((255.0 * opacity).round() as u8);
                }
                None => samples.extend([0; 4]),
            }
        }
    }
    let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let mut bytes = Cursor::new(Vec::new());
    PngEncoder::new(&mut bytes)
        .write_image(
            &samples,
            size(width),
            size(height),
            ExtendedColorType::Rgba8,
        )
        .map_err(|error| Error::Encoding {
            format: "PNG",
            width,
            height,
            problem: error.to_string(),
        })?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflection::Camera;

    /// The opacities sum to the disc's area, π/4 of the square, far closer than the pixels whose
    /// centres it covers do.
    #[test]
    fn an_outline_is_as_opaque_as_the_sphere_covers_it() {
        let camera = Camera::orthographic(glam::DVec3::Z, glam::DVec3::Y).unwrap();
        for size in [7, 32, 33] {
            let sphere = SphereImage::new(camera, size, vec![[0.5; 3]; size * size]).unwrap();
            let opacity: f64 = (0..size * size)
                .filter_map(|i| covered(&sphere, i / size, i % size))
                .map(|(colour, opacity)| {
                    assert!(colour.iter().all(|value| (value - 0.5).abs() < 1e-12));
                    opacity
                })
                .sum();
            let area = std::f64::consts::FRAC_PI_4 * (size * size) as f64;
            assert!(
                (opacity - area).abs() < 0.004 * area,
                "{size}: {opacity} {area}"
            );
        }
    }

    #[test]
    fn no_sphere_makes_no_picture() {
        assert!(encode_spheres(&[], 4, 8, 1.0).is_err());
    }
}
