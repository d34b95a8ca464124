//! Portable float maps: `PF` (colour) or `Pf` (grey), single precision of either endianness, rows from the bottom.
//!
//! The sign of the scale in the header tells the endianness (negative is little-endian); its absolute value multiplies the values.

use super::{Picture, Problem, check_size};

/// One word of the header, which ends with one white space.
fn word<'a>(bytes: &'a [u8], at: &mut usize) -> Result<&'a str, Problem> {
    let rest = bytes.get(*at..).unwrap_or_default();
    let blank = rest
        .iter()
        .take_while(|byte| byte.is_ascii_whitespace())
        .count();
    let length = rest[blank..]
        .iter()
        .take(64)
        .position(u8::is_ascii_whitespace)
        .ok_or_else(|| Problem::new("the header does not end", "fetch it again"))?;
    *at += blank + length + 1;
    Ok(std::str::from_utf8(&rest[blank..blank + length]).unwrap_or_default())
}

pub(super) fn decode(bytes: &[u8]) -> Result<Picture, Problem> {
    let mut at = 0;
    let channels = if word(bytes, &mut at)? == "PF" { 3 } else { 1 };
    let mut size = || {
        let text = word(bytes, &mut at)?;
        text.parse::<usize>()
            .map_err(|_| Problem::corrupt(format!("its size reads {text:?}")))
    };
    let (width, height) = (size()?, size()?);
    check_size(width, height, bytes.len())?;
    let text = word(bytes, &mut at)?;
    let scale: f64 = text
        .parse()
        .ok()
        .filter(|scale: &f64| scale.is_normal())
        .ok_or_else(|| Problem::corrupt(format!("its scale reads {text:?}")))?;
    let (data, _) = bytes
        .get(at..)
        .unwrap_or_default()
        .split_at_checked(width * height * channels * 4)
        .ok_or_else(Problem::truncated)?;
    let value = |index: usize| {
        let word = [0, 1, 2, 3].map(|byte| data[4 * index + byte]);
        let value = if scale < 0.0 {
            f32::from_le_bytes(word)
        } else {
            f32::from_be_bytes(word)
        };
        f64::from(value) * scale.abs()
    };
    let pixels = (0..height)
        .rev()
        .flat_map(|row| (0..width).map(move |column| row * width + column))
        .map(|pixel| match channels {
            3 => [value(3 * pixel), value(3 * pixel + 1), value(3 * pixel + 2)],
            _ => [value(pixel); 3],
        })
        .collect();
    Ok(Picture {
        width,
        height,
        pixels,
    })
}
