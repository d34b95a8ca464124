//! TIFF, through the crate `tiff`: grey and RGB of 8 and 16 bits, and of floats.

use std::io::{Cursor, ErrorKind};

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};

use super::codes::{Coded, Said, Space};
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
    let channels = if grey { 1 } else { 3 } + usize::from(has_alpha);
    let pixels = width * height;
    // Interleaved, or each channel by itself.
    let (step, plane) = if layout.planes > 1 {
        (1, pixels)
    } else {
        (channels, 1)
    };
    let place = |pixel: usize, channel: usize| pixel * step + channel * plane;
    let colours: [usize; 3] = if grey { [0; 3] } else { [0, 1, 2] };
    let fits = |count: usize| -> Result<(), Problem> {
        if count == pixels * channels {
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
    let coded = |count: usize, most: u16, at: &dyn Fn(usize) -> u16| -> Result<Coded, Problem> {
        fits(count)?;
        let codes = (0..pixels).map(|pixel| {
            let [r, g, b] = colours.map(|channel| at(place(pixel, channel)));
            let alpha = if has_alpha {
                at(place(pixel, channels - 1))
            } else {
                most
            };
            [r, g, b, alpha]
        });
        Ok(space(Space::SRGB)?.picture([width, height], most, has_alpha, codes))
    };
    let radiance = |count: usize, at: &dyn Fn(usize) -> f64| -> Result<Coded, Problem> {
        fits(count)?;
        let values = (0..pixels).map(|pixel| colours.map(|channel| at(place(pixel, channel))));
        let alpha = || {
            (0..pixels)
                .map(|pixel| at(place(pixel, channels - 1)))
                .collect()
        };
        space(Space::LINEAR)?.radiance([width, height], values.collect(), has_alpha.then(alpha))
    };
    let picture = match &samples {
        DecodingResult::U8(data) => coded(data.len(), 255, &|i| u16::from(data[i])),
        DecodingResult::U16(data) => coded(data.len(), u16::MAX, &|i| data[i]),
        DecodingResult::F16(data) => radiance(data.len(), &|i| f64::from(data[i])),
        DecodingResult::F32(data) => radiance(data.len(), &|i| f64::from(data[i])),
        DecodingResult::F64(data) => radiance(data.len(), &|i| data[i]),
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
