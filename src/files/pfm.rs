//! Portable float maps: `PF` (colour), `Pf` (grey) or `PF4` (colour and alpha), single precision of
//! either endianness, rows from the bottom.
//!
//! The sign of the scale in the header tells the endianness (negative is little-endian); its
//! absolute value multiplies the values.

use std::io::{BufRead, ErrorKind};

use super::{Decoded, Picture, Problem, check_size, room};

/// Whether these bytes begin a picture of the format.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PF") || bytes.starts_with(b"Pf")
}

/// The most bytes of a header: four words.
const LONGEST_HEADER: usize = 320;

/// The header's bytes: four words, the last of which ends with one white space.
fn header(reader: &mut impl BufRead) -> Result<Vec<u8>, Problem> {
    let mut bytes = Vec::new();
    let mut words = 0;
    while words < 4 {
        let mut byte = [0];
        let inside = bytes.last().is_some_and(|b: &u8| !b.is_ascii_whitespace());
        if bytes.len() == LONGEST_HEADER || reader.read(&mut byte).map_err(unread)? == 0 {
            return Err(Problem::new("the header does not end", "fetch it again"));
        }
        words += usize::from(inside && byte[0].is_ascii_whitespace());
        bytes.push(byte[0]);
    }
    Ok(bytes)
}

fn unread(error: std::io::Error) -> Problem {
    if error.kind() == ErrorKind::UnexpectedEof {
        return Problem::truncated();
    }
    Problem::new(
        format!("the file cannot be read: {error}"),
        "fetch it again",
    )
}

/// The picture of a file of `length` bytes. A row at a time is read, so that the file is never in
/// memory beside its picture.
pub(super) fn decode(reader: &mut impl BufRead, length: usize) -> Result<Decoded, Problem> {
    let header = header(reader)?;
    let text = String::from_utf8_lossy(&header);
    let mut words = text.split_ascii_whitespace();
    let mut word = || words.next().unwrap_or_default();
    let channels = match word() {
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
        let text = word();
        text.parse::<usize>()
            .map_err(|_| Problem::corrupt(format!("its size reads {text:?}")))
    };
    let (width, height) = (size()?, size()?);
    check_size(width, height, length)?;
    let text = word();
    let scale: f64 = text
        .parse()
        .ok()
        .filter(|scale: &f64| scale.is_normal())
        .ok_or_else(|| Problem::corrupt(format!("its scale reads {text:?}")))?;
    let needed = width * height * channels * 4;
    let mut left = length.saturating_sub(header.len());
    // Where the first line ends as Windows ends lines, the last one does.
    let windows = header
        .windows(2)
        .find(|pair| pair.contains(&b'\n'))
        .is_some_and(|pair| pair == b"\r\n");
    let next = reader.fill_buf().map_err(unread)?.first();
    if windows && header.ends_with(b"\r") && next == Some(&b'\n') {
        reader.consume(1);
        left = left.saturating_sub(1);
    }
    if left < needed {
        return Err(Problem::truncated());
    }
    if left > needed {
        return Err(Problem::corrupt(format!(
            "{} bytes follow its last pixel",
            left - needed
        )));
    }
    let value = |word: &[u8]| {
        let word = [word[0], word[1], word[2], word[3]];
        let value = if scale < 0.0 {
            f32::from_le_bytes(word)
        } else {
            f32::from_be_bytes(word)
        };
        f64::from(value) * scale.abs()
    };
    let mut pixels = room(width * height)?;
    pixels.resize(width * height, [0.0; 3]);
    let mut alpha = None;
    if channels == 4 {
        let mut values = room(width * height)?;
        values.resize(width * height, 0.0);
        alpha = Some(values);
    }
    let mut row = room(4 * channels * width)?;
    row.resize(4 * channels * width, 0);
    // From the bottom.
    for line in (0..height).rev() {
        reader.read_exact(&mut row).map_err(unread)?;
        let line = line * width..(line + 1) * width;
        let stored = row.chunks_exact(4 * channels);
        for (pixel, stored) in pixels[line.clone()].iter_mut().zip(stored.clone()) {
            *pixel = match channels {
                1 => [value(stored); 3],
                _ => [value(stored), value(&stored[4..]), value(&stored[8..])],
            };
        }
        if let Some(alpha) = &mut alpha {
            for (alpha, stored) in alpha[line].iter_mut().zip(stored) {
                *alpha = value(&stored[12..]);
            }
        }
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
