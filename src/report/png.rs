//! Linear radiance as a picture to look at.

use std::io::Cursor;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use crate::files::srgb_of_linear;
use crate::{Error, Result};

/// A PNG of linear RGB: times `exposure`, clipped to [0, 1], encoded as sRGB in 8 bits
/// (IEC 61966-2-1); transparent where `pixel(row, column)` gives nothing.
///
/// # Errors
/// [`Error::Unanswerable`] for a size that PNG cannot hold.
pub fn encode_png(
    width: usize,
    height: usize,
    exposure: f64,
    pixel: impl Fn(usize, usize) -> Option<[f64; 3]>,
) -> Result<Vec<u8>> {
    let mut samples = Vec::with_capacity(4 * width * height);
    for row in 0..height {
        for column in 0..width {
            match pixel(row, column) {
                Some(rgb) => {
                    samples.extend(rgb.map(|value| code(value * exposure)));
                    samples.push(255);
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
        .map_err(|error| {
            Error::Unanswerable(format!("{width} × {height} pixels make no PNG: {error}"))
        })?;
    Ok(bytes.into_inner())
}

/// The 8-bit sRGB code next to a linear value.
fn code(linear: f64) -> u8 {
    (255.0 * srgb_of_linear(linear.clamp(0.0, 1.0))).round() as u8
}
