//! WebP, through the crate `image-webp`.

use std::io::Cursor;

use image_webp::{DecodingError, WebPDecoder};

use super::codes::{Coded, Said, Space};
use super::raster::Layout;
use super::{MOST_PIXELS, Problem, check_size};

pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP")
}

fn problem(error: DecodingError) -> Problem {
    match error {
        DecodingError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            Problem::truncated()
        }
        other => Problem::corrupt(other),
    }
}

/// The picture, of an animation the first.
pub(super) fn decode(bytes: &[u8]) -> Result<Coded, Problem> {
    // RIFF says how long the file is; the lossy decoder takes what is missing for zeros.
    let length = bytes
        .get(4..8)
        .and_then(|said| <[u8; 4]>::try_from(said).ok());
    let said = length.map_or(usize::MAX, |said| u32::from_le_bytes(said) as usize);
    if bytes.len() < said.saturating_add(8) {
        return Err(Problem::truncated());
    }
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(problem)?;
    decoder.set_memory_limit(4 * MOST_PIXELS);
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height, bytes.len())?;
    let size = decoder
        .output_buffer_size()
        .ok_or_else(|| Problem::corrupt("its size has no end"))?;
    let mut data = vec![0; size];
    decoder.read_image(&mut data).map_err(problem)?;
    let space = match decoder.icc_profile().map_err(problem)? {
        Some(profile) => Space::of_profile(&profile, false)?,
        None => Space::SRGB,
    };
    let exif = decoder.exif_metadata().map_err(problem)?;
    let said = exif.as_deref().map(Said::of_exif).unwrap_or_default();
    let has_alpha = decoder.has_alpha();
    let layout = Layout {
        grey: false,
        has_alpha,
        planar: false,
    };
    Ok(Coded {
        said,
        ..space.of_bytes([width, height], layout, data)
    })
}
