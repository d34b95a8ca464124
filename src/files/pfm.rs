//! Portable float maps: `PF` (colour), `Pf` (grey) or `PF4` (colour and alpha), single precision of
//! either endianness, rows from the bottom.
//!
//! The sign of the scale in the header tells the endianness (negative is little-endian); its
//! absolute value multiplies the values.

use super::{Decoded, Picture, Problem, check_size, room};

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

pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, Problem> {
    let mut at = 0;
    let channels = match word(bytes, &mut at)? {
        "PF" => 3,
        "Pf" => 1,
        "PF4" => 4,
        other => {
            return Err(Problem::new(
                format!(
                    "the file begins with {other:?}, a variant of portable float maps that is not read here"
                ),
                "store it again as PF, Pf or PF4",
            ));
        }
    };
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
    let needed = width * height * channels * 4;
    let mut data = bytes.get(at..).unwrap_or_default();
    // Where the first line ends as Windows ends lines, the last one does.
    let windows = bytes[..at]
        .windows(2)
        .find(|pair| pair.contains(&b'\n'))
        .is_some_and(|pair| pair == b"\r\n");
    if windows && bytes[at - 1] == b'\r' {
        data = data.strip_prefix(b"\n").unwrap_or(data);
    }
    if data.len() < needed {
        return Err(Problem::truncated());
    }
    if data.len() > needed {
        return Err(Problem::corrupt(format!(
            "{} bytes follow its last pixel",
            data.len() - needed
        )));
    }
    let value = |index: usize| {
        let word = [0, 1, 2, 3].map(|byte| data[4 * index + byte]);
        let value = if scale < 0.0 {
            f32::from_le_bytes(word)
        } else {
            f32::from_be_bytes(word)
        };
        f64::from(value) * scale.abs()
    };
    let order = || {
        (0..height)
            .rev()
            .flat_map(|row| (0..width).map(move |column| channels * (row * width + column)))
    };
    let mut pixels = room(width * height)?;
    pixels.extend(order().map(|first| match channels {
        1 => [value(first); 3],
        _ => [value(first), value(first + 1), value(first + 2)],
    }));
    let mut alpha = None;
    if channels == 4 {
        let mut values = room(width * height)?;
        values.extend(order().map(|first| value(first + 3)));
        alpha = Some(values);
    }
    Ok(Decoded {
        alpha,
        ..Decoded::of(Picture {
            width,
            height,
            pixels,
        })
    })
}
