//! Pictures with a sphere, from files.

use std::path::Path;

use super::picture::Picture;
use crate::files::{self, Coded, Pixels, Problem};
use crate::{Error, Result};

impl Picture {
    /// Reads a picture: linear OpenEXR, Radiance or PFM, PNG, JPEG, WebP, or TIFF of 8 bits, 16 bits
    /// or floats.
    ///
    /// Codes are sRGB's unless the file says otherwise: cICP, iCCP and gAMA with cHRM of a PNG, an
    /// ICC profile of a JPEG, WebP or TIFF, a JPEG's EXIF with Adobe RGB. What is said by curves and a matrix is
    /// converted to Rec. 709 ([`files::read`](crate::files::read) has how); profiles of tables, PQ
    /// and HLG, and CMYK are refused. gAMA 0.45455 with sRGB's primaries is sRGB, since that is
    /// what the standard has sRGB's writers say besides. What an OpenEXR file lacks of its display
    /// window is black, and transparent where there is an alpha channel.
    ///
    /// Floats of a TIFF are linear radiance. Of several pictures in a WebP or TIFF the first is read.
    /// The gain map of an Ultra HDR JPEG is left aside: its picture is read as it is without.
    /// HEIC and AVIF are refused with a sentence that says how to convert them.
    ///
    /// An alpha channel is the mask; EXIF's orientation is undone, and its focal length on film of
    /// 36 × 24 mm is used where present.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read, is damaged, too large or holds a value that
    /// is not finite.
    pub fn read(path: &Path) -> Result<Self> {
        Self::decode(&files::read_bytes(path)?).map_err(|problem| problem.in_file(path))
    }

    /// [`read`](Self::read), of the file's bytes.
    ///
    /// # Errors
    /// [`Error::Contents`] for bytes that are damaged, claim too many pixels or hold a value that
    /// is not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Self::decode(bytes).map_err(Problem::in_bytes)
    }

    fn decode(bytes: &[u8]) -> std::result::Result<Self, Problem> {
        let refused = |error: Error| damaged(&error);
        if let Some(coded) = files::decode_codes(bytes) {
            return Self::of_codes(coded?).map_err(refused);
        }
        if !files::is_linear(bytes) {
            return Err(Problem::new(
                "the file is none of PNG, JPEG, WebP, TIFF, OpenEXR, Radiance and PFM",
                "convert it to one of these",
            ));
        }
        let files::Decoded { picture, alpha, .. } = files::decode_all(bytes)?;
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
            other => refused(other),
        })?;
        match alpha {
            Some(mask) => {
                let mask = mask.into_iter().map(|part| part as f32).collect();
                picture.with_mask(mask).map_err(refused)
            }
            None => Ok(picture),
        }
    }
}

impl Picture {
    /// As a PNG, JPEG, WebP or TIFF holds it, with what its EXIF says.
    fn of_codes(coded: Coded) -> Result<Self> {
        let orientation = coded.said.orientation;
        let stored = [coded.width, coded.height];
        let [width, height] = size_turned(orientation, stored);
        let from = |place: usize| stored_at(orientation, stored, place);
        let upright = !(2..=8).contains(&orientation);
        let mut picture = match coded.pixels {
            Pixels::Codes { raster, ceiling } => {
                let raster = if upright {
                    raster
                } else {
                    raster.reordered(from)
                };
                Self::decoded(width, height, raster, ceiling)?
            }
            Pixels::Radiance(pixels) => {
                let pixels = (0..pixels.len()).map(|place| pixels[from(place)]).collect();
                Self::linear(width, height, pixels)?
            }
        };
        if let Some(mask) = coded.mask {
            let mask = (0..mask.len()).map(|place| mask[from(place)]).collect();
            picture = picture.with_mask(mask)?;
        }
        picture.gain_map = coded.said.has_gain_map;
        // Film of 36 × 24 mm has a diagonal of 43.27 mm.
        let millimetres = coded.said.focal_length_on_film;
        if millimetres > 0 {
            let diagonal = (width as f64).hypot(height as f64);
            let focal = f64::from(millimetres) / 36f64.hypot(24.0) * diagonal;
            picture = picture.with_focal_length(focal)?;
        }
        Ok(picture)
    }
}

fn damaged(problem: &dyn std::fmt::Display) -> Problem {
    Problem::new(
        format!("the picture is damaged: {problem}"),
        "fetch it again",
    )
}

/// The width and the height that a picture has when it is looked at as EXIF's orientation, a number
/// from 1 to 8, says.
fn size_turned(orientation: u32, [width, height]: [usize; 2]) -> [usize; 2] {
    if (5..=8).contains(&orientation) {
        [height, width]
    } else {
        [width, height]
    }
}

/// Where the pixel is stored that is looked at in a place, both row by row.
fn stored_at(orientation: u32, stored: [usize; 2], place: usize) -> usize {
    let [width, height] = stored;
    let across = size_turned(orientation, stored)[0];
    let (row, column) = (place / across, place % across);
    let (right, bottom) = (width - 1, height - 1);
    let (row, column) = match orientation {
        2 => (row, right - column),
        3 => (bottom - row, right - column),
        4 => (bottom - row, column),
        5 => (column, row),
        6 => (bottom - column, row),
        7 => (bottom - column, right - row),
        8 => (column, right - row),
        _ => (row, column),
    };
    row * width + column
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Circle;
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
        assert!((picture.get(0, 0).unwrap()[1] - half).abs() < 1e-12);
        assert!(picture.is_encoded() && !picture.has_mask());
    }

    /// A little TIFF of one entry: `FocalLengthIn35mmFilm` (0xa405), a short, in the EXIF
    /// directory.
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
