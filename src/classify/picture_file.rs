//! Pictures with a sphere, from files.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageReader};

use super::picture::Picture;
use crate::files::{self, Problem};
use crate::{Error, Result};

impl Picture {
    /// Reads a picture: linear OpenEXR, Radiance or PFM, or PNG or JPEG of 8 or 16 bits as sRGB.
    ///
    /// An alpha channel is the mask; EXIF's orientation is undone, and its focal length on film of 36 × 24 mm is used where present.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read, is damaged, too large or holds a value that is not finite.
    pub fn read(path: &Path) -> Result<Self> {
        Self::decode(&files::read_bytes(path)?).map_err(|problem| problem.in_file(path))
    }

    /// [`read`](Self::read), of the file's bytes.
    ///
    /// # Errors
    /// [`Error::Contents`] for bytes that are damaged, claim too many pixels or hold a value that is not finite.
    pub fn of_bytes(bytes: &[u8]) -> Result<Self> {
        Self::decode(bytes).map_err(Problem::in_bytes)
    }

    fn decode(bytes: &[u8]) -> std::result::Result<Self, Problem> {
        let png = bytes.starts_with(&[0x89, b'P', b'N', b'G']);
        let jpeg = bytes.starts_with(&[0xff, 0xd8]);
        let refused = |error: &Error| damaged(error);
        if png || jpeg {
            let decoded = decode_codes(bytes)?;
            let mut picture = Self::encoded(decoded.width, decoded.height, decoded.codes)
                .map_err(|error| refused(&error))?;
            if let Some(mask) = decoded.mask {
                picture = picture.with_mask(mask).map_err(|error| refused(&error))?;
            }
            return match decoded.focal {
                Some(focal) => picture
                    .with_focal_length(focal)
                    .map_err(|error| refused(&error)),
                None => Ok(picture),
            };
        }
        if !files::is_linear(bytes) {
            return Err(Problem::new(
                "the file is none of PNG, JPEG, OpenEXR, Radiance and PFM",
                "convert it to one of these",
            ));
        }
        let (picture, alpha) = files::decode_with_alpha(bytes)?;
        let (width, height) = (picture.width, picture.height);
        let picture = Self::linear(width, height, picture.pixels).map_err(|error| match error {
            Error::NotFinite { index, .. } => Problem::new(
                format!(
                    "holds a value that is not finite in row {}, column {}",
                    index / width,
                    index % width
                ),
                "mend the picture",
            ),
            other => refused(&other),
        })?;
        match alpha {
            Some(mask) => picture.with_mask(mask).map_err(|error| refused(&error)),
            None => Ok(picture),
        }
    }
}

fn damaged(problem: &dyn std::fmt::Display) -> Problem {
    Problem::new(
        format!("the picture is damaged: {problem}"),
        "fetch it again",
    )
}

/// What a PNG or JPEG holds.
struct Decoded {
    width: usize,
    height: usize,
    /// On [0, 1].
    codes: Vec<[f64; 3]>,
    mask: Option<Vec<f64>>,
    /// The focal length in pixels.
    focal: Option<f64>,
}

fn decode_codes(bytes: &[u8]) -> std::result::Result<Decoded, Problem> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| damaged(&error))?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(16 * files::MOST_PIXELS as u64);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(|error| damaged(&error))?;
    let (width, height) = decoder.dimensions();
    files::check_size(width as usize, height as usize, bytes.len())?;
    let exif = decoder.exif_metadata().map_err(|error| damaged(&error))?;
    let orientation = decoder.orientation().map_err(|error| damaged(&error))?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(|error| damaged(&error))?;
    picture.apply_orientation(orientation);
    let has_alpha = picture.color().has_alpha();
    let wide = picture.color().bytes_per_pixel() / picture.color().channel_count() > 1;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let count = width * height;
    let mut codes = Vec::with_capacity(count);
    let mut mask = Vec::with_capacity(if has_alpha { count } else { 0 });
    let mut push = |[r, g, b, alpha]: [f64; 4]| {
        codes.push([r, g, b]);
        if has_alpha {
            mask.push(alpha);
        }
    };
    if wide {
        for pixel in picture.into_rgba16().pixels() {
            push(pixel.0.map(|v| f64::from(v) / 65535.0));
        }
    } else {
        for pixel in picture.into_rgba8().pixels() {
            push(pixel.0.map(|v| f64::from(v) / 255.0));
        }
    }
    // The diagonal of a film of 36 × 24 mm is 43.27 mm.
    let diagonal = (width as f64).hypot(height as f64);
    Ok(Decoded {
        width,
        height,
        codes,
        mask: has_alpha.then_some(mask),
        focal: exif
            .and_then(focal_length_on_film)
            .map(|millimetres| millimetres / 36f64.hypot(24.0) * diagonal),
    })
}

/// The focal length on film of 36 × 24 mm that EXIF gives, in millimetres.
fn focal_length_on_film(raw: Vec<u8>) -> Option<f64> {
    let exif = exif::Reader::new().read_raw(raw).ok()?;
    let field = exif.get_field(exif::Tag::FocalLengthIn35mmFilm, exif::In::PRIMARY)?;
    let value = f64::from(field.value.get_uint(0)?);
    (value > 0.0).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classify::Circle;
    use image::codecs::jpeg::JpegEncoder;
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};

    fn on_disk(bytes: &[u8]) -> Picture {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        Picture::read(file.path()).unwrap()
    }

    #[test]
    fn codes_of_16_bits_are_decoded() {
        let mut bytes = Vec::new();
        let codes: [u16; 6] = [0, 0x8000, 0x4000, 0xffff, 1000, 2000];
        let raw: Vec<u8> = codes.iter().flat_map(|c| c.to_ne_bytes()).collect();
        PngEncoder::new(&mut bytes)
            .write_image(&raw, 2, 1, ExtendedColorType::Rgb16)
            .unwrap();
        let picture = on_disk(&bytes);
        let half = files::linear_of_srgb(f64::from(0x8000u16) / 65535.0);
        assert!((picture.pixels()[0][1] - half).abs() < 1e-12);
        assert!(picture.is_encoded() && !picture.has_mask());
    }

    /// A little TIFF of one entry: FocalLengthIn35mmFilm (0xa405), a short, in the EXIF directory.
    #[test]
    fn exif_tells_the_focal_length() {
        let mut exif = b"II*\0\x08\0\0\0".to_vec();
        exif.extend([1, 0, 0x69, 0x87, 4, 0, 1, 0, 0, 0, 26, 0, 0, 0, 0, 0, 0, 0]);
        exif.extend([1, 0, 0x05, 0xa4, 3, 0, 1, 0, 0, 0, 50, 0, 0, 0, 0, 0, 0, 0]);
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif).unwrap();
        encoder
            .write_image(&[100; 3 * 60 * 40], 60, 40, ExtendedColorType::Rgb8)
            .unwrap();
        let picture = on_disk(&bytes);
        // 36 mm of film are 60 pixels.
        assert!((picture.focal_length().unwrap() - 50.0 / 36.0 * 60.0).abs() < 1e-9);
        let circle = Circle {
            x: 30.0,
            y: 20.0,
            radius: 15.0,
        };
        let sphere = picture.sphere(circle).unwrap();
        let distance = sphere.image.camera().distance().unwrap();
        // sin of half the angle is 1/distance, tan is r/f.
        assert!(((1.0 / distance).asin().tan() - 15.0 / (50.0 / 36.0 * 60.0)).abs() < 1e-12);
    }
}
