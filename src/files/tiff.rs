//! TIFF, through the crate `tiff`: grey and RGB of 8 and 16 bits, and of floats.

use std::io::{Cursor, ErrorKind};

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};

use super::codes::{Coded, Said, Space};
use super::raster::Layout;
use super::{MOST_PIXELS, Problem, check_size};

pub(super) fn recognises(bytes: &[u8]) -> bool {
    let starts: [&[u8]; 4] = [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"];
    starts.iter().any(|start| bytes.starts_with(start))
}

fn problem(error: TiffError) -> Problem {
    match error {
        TiffError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            Problem::truncated()
        }
        TiffError::UnsupportedError(what) => unread(&format!("is of a kind ({what})")),
        other => Problem::corrupt(other),
    }
}

/// A part of TIFF that is not read here.
fn unread(what: &str) -> Problem {
    Problem::new(
        format!("the TIFF {what} that is not read here"),
        "store it again as grey or RGB of 8 bits, 16 bits or floats, uncompressed or by LZW or Deflate",
    )
}

/// The first picture of the file.
pub(super) fn decode(bytes: &[u8]) -> Result<Coded, Problem> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 32 * MOST_PIXELS;
    limits.intermediate_buffer_size = 32 * MOST_PIXELS;
    let mut decoder = Decoder::new(Cursor::new(bytes))
        .map_err(problem)?
        .with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(problem)?;
    let (width, height) = (width as usize, height as usize);
    check_size(width, height, bytes.len())?;
    let kind = decoder.colortype().map_err(problem)?;
    let (grey, has_alpha, bits) = match kind {
        ColorType::Gray(bits) => (true, false, bits),
        ColorType::GrayA(bits) => (true, true, bits),
        ColorType::RGB(bits) => (false, false, bits),
        ColorType::RGBA(bits) => (false, true, bits),
        other => return Err(unread(&format!("is of {other:?}, a kind of colour"))),
    };
    if ![8, 16, 32, 64].contains(&bits) {
        return Err(unread(&format!("has {bits} bits a sample, a depth")));
    }
    let profile = match decoder.find_tag(Tag::IccProfile).map_err(problem)? {
        Some(value) => Some(value.into_u8_vec().map_err(problem)?),
        None => None,
    };
    let orientation = decoder.find_tag_unsigned(Tag::Orientation);
    let mut samples = DecodingResult::U8(Vec::new());
    let layout = decoder
        .read_image_to_buffer(&mut samples)
        .map_err(problem)?;
    let size = [width, height];
    let layout = Layout {
        grey,
        has_alpha,
        planar: layout.planes > 1,
    };
    let fits = |count: usize| -> Result<(), Problem> {
        if count == width * height * layout.channels() {
            Ok(())
        } else {
            Err(Problem::corrupt("its pixels do not fit its size"))
        }
    };
    let space = |without: Space| -> Result<Space, Problem> {
        match &profile {
            Some(profile) => Space::of_profile(profile, grey),
            None => Ok(without),
        }
    };
    let radiance = |values: Vec<f64>| -> Result<Coded, Problem> {
        fits(values.len())?;
        let (colours, mask) = (layout.colours(&values), layout.mask(&values, 1.0));
        let (pixels, _) = colours.as_chunks::<3>();
        space(Space::LINEAR)?.radiance(size, pixels.to_vec(), mask)
    };
    let picture = match samples {
        DecodingResult::U8(data) => {
            fits(data.len())?;
            Ok(space(Space::SRGB)?.of_bytes(size, layout, data))
        }
        DecodingResult::U16(data) => {
            fits(data.len())?;
            Ok(space(Space::SRGB)?.of_words(size, layout, &data))
        }
        DecodingResult::F16(data) => radiance(data.into_iter().map(f64::from).collect()),
        DecodingResult::F32(data) => radiance(data.into_iter().map(f64::from).collect()),
        DecodingResult::F64(data) => radiance(data),
        _ => Err(unread(&format!(
            "has whole numbers of {bits} bits, a depth"
        ))),
    }?;
    let said = Said {
        orientation: orientation.ok().flatten().unwrap_or(0),
        ..Said::default()
    };
    Ok(Coded { said, ..picture })
}
