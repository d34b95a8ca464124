//! PNG, through the crate `png`.

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Info, Limits, Transformations};

use super::codes::{Coded, Curve, Said, Space};
use super::primaries::Primaries;
use super::raster::Layout;
use super::{MOST_PIXELS, Problem, check_size};

/// Deflate makes at most 1032 bytes of one; a little more than that counts for what stands around
/// it.
const MOST_EXPANSION: usize = 1040;

fn problem(error: DecodingError) -> Problem {
    match error {
        DecodingError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            Problem::truncated()
        }
        other => Problem::corrupt(other),
    }
}

/// The matrix coefficients that a cICP before the pixels says, by which colour is luma and chroma.
fn matrix_coefficients(bytes: &[u8]) -> Option<u8> {
    // The signature, then chunks: length, name, data and a checksum.
    let mut rest = bytes.get(8..)?;
    loop {
        let length: [u8; 4] = rest.get(..4)?.try_into().ok()?;
        match rest.get(4..8)? {
            b"cICP" => return rest.get(10).copied(),
            b"IDAT" => return None,
            _ => rest = rest.get((u32::from_be_bytes(length) as usize).checked_add(12)?..)?,
        }
    }
}

pub(super) fn decode(bytes: &[u8]) -> Result<Coded, Problem> {
    // The decoder would call it invalid data.
    if let Some(code @ 1..) = matrix_coefficients(bytes) {
        return Err(Problem::new(
            format!(
                "the picture's cICP says the matrix coefficients number {code}, of luma and chroma, where a PNG has RGB, number 0"
            ),
            "convert it to sRGB",
        ));
    }
    let limits = Limits {
        bytes: 16 * MOST_PIXELS,
    };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    // Palettes become colours, codes of 1, 2 and 4 bits such of 8, and a colour that stands for
    // nothing becomes alpha.
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(problem)?;
    let info = reader.info();
    let (width, height) = (info.width as usize, info.height as usize);
    // A pixel may be a single bit, so what a byte of file can hold is told by the bytes of a row.
    let unpacked = info.raw_row_length().saturating_mul(height);
    let most = bytes.len().saturating_mul(MOST_EXPANSION);
    check_size(width, height, if unpacked > most { 0 } else { usize::MAX })?;
    let size = reader
        .output_buffer_size()
        .ok_or_else(|| Problem::corrupt("its size has no end"))?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(problem)?;
    // What a file says of itself may follow its pixels.
    reader.finish().map_err(problem)?;
    let info = reader.info();
    let (grey, has_alpha) = match frame.color_type {
        ColorType::Grayscale => (true, false),
        ColorType::GrayscaleAlpha => (true, true),
        ColorType::Rgb => (false, false),
        ColorType::Rgba => (false, true),
        ColorType::Indexed => return Err(Problem::corrupt("its palette is missing")),
    };
    let space = space(info, grey)?;
    let exif = info.exif_metadata.as_deref();
    let said = exif.map(Said::of_exif).unwrap_or_default();
    let wide = frame.bit_depth == BitDepth::Sixteen;
    let (size, layout) = (
        [width, height],
        Layout {
            grey,
            has_alpha,
            planar: false,
        },
    );
    let picture = if wide {
        let (pairs, _) = data.as_chunks::<2>();
        let words: Vec<u16> = pairs.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
        space.of_words(size, layout, &words)
    } else {
        space.of_bytes(size, layout, data)
    };
    Ok(Coded { said, ..picture })
}

/// What the codes mean, by the first of cICP, iCCP, sRGB, and gAMA with cHRM that the file has
/// (PNG, third edition, 4.3); sRGB without any.
fn space(info: &Info<'_>, grey: bool) -> Result<Space, Problem> {
    if let Some(points) = info.coding_independent_code_points {
        let code = points.transfer_function;
        let curve = match code {
            1 | 6 | 14 | 15 => Curve::Camera709,
            4 => Curve::Power(2.2),
            5 => Curve::Power(2.8),
            8 => Curve::Linear,
            13 => Curve::Srgb,
            _ => {
                let name = match code {
                    16 => "PQ",
                    18 => "HLG",
                    _ => "ITU-T H.273's",
                };
                return Err(Problem::new(
                    format!(
                        "the picture's cICP says the transfer {name} (number {code}), which is not read here"
                    ),
                    "convert it to sRGB, or to linear OpenEXR",
                ));
            }
        };
        let primaries = Primaries::numbered(points.color_primaries);
        return match primaries {
            Some(primaries) if points.is_video_full_range_image => Space::of(curve, primaries),
            Some(_) => Err(Problem::new(
                "the picture's cICP says that its codes are no RGB of full range",
                "convert it to sRGB",
            )),
            None => Err(Problem::new(
                format!(
                    "the picture's cICP says the primaries number {}, which are not read here",
                    points.color_primaries
                ),
                "convert it to sRGB",
            )),
        };
    }
    if let Some(profile) = &info.icc_profile {
        return Space::of_profile(profile, grey);
    }
    if info.srgb.is_some() {
        return Ok(Space::SRGB);
    }
    let primaries = info.chrm_chunk.map_or(Primaries::REC709, |said| {
        let pairs = [said.red, said.green, said.blue, said.white];
        let mut values = [0.0; 8];
        for (index, value) in pairs.iter().flat_map(|(x, y)| [*x, *y]).enumerate() {
            values[index] = f64::from(value.into_scaled()) / 1e5;
        }
        Primaries::new(values)
    });
    let gamma = info.gama_chunk.map(::png::ScaledFloat::into_scaled);
    let curve = match gamma {
        None => Curve::Srgb,
        // What the standard has sRGB's writers say for readers that do not know sRGB.
        Some(45_455) if primaries.is(&Primaries::REC709) => Curve::Srgb,
        Some(0) => {
            return Err(Problem::new(
                "the picture's gAMA is 0, which no code can have been made by",
                "take that chunk out of the file",
            ));
        }
        Some(gamma) => Curve::Power(1e5 / f64::from(gamma)),
    };
    Space::of(curve, primaries)
}
