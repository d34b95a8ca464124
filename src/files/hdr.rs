//! Radiance pictures: RGBE and XYZE, flat or run-length encoded.
//!
//! The format is that of Ward, *Real Pixels*, Graphics Gems II (1991), and of the *Radiance file
//! formats* manual. A pixel is three mantissas and a common exponent e: the value is (m + ½) 2^(e −
//! 136), and 0 where e is 0. The half belongs to it: the encoder cuts, so the middle of the step is
//! the unbiased value. Readers that leave it out are 0.2 % to 0.4 % too dark.
//!
//! A line of the header counts where it begins with its key, as in Radiance: programs keep the
//! headers of the pictures that theirs was made of, indented, and what those were multiplied by has
//! been undone. Colours are those of Rec. 709 unless PRIMARIES says others, which are converted.
//! Radiance's own primaries, which its programs suppose where the line is missing, are the same as
//! a missing line.

use super::primaries::{Primaries, ToRec709};
use super::{Picture, Problem, check_size, room};

type Parsed<T> = Result<T, Problem>;

/// CIE XYZ to linear RGB of Radiance's primaries (0.640, 0.330), (0.290, 0.600), (0.150, 0.060) and
/// its white (0.3333, 0.3333).
const RGB_OF_XYZ: [[f64; 3]; 3] = [
    [
        2.565_619_565_217_391,
        -1.166_989_130_434_783,
        -0.398_510_869_565_217,
    ],
    [
        -1.022_094_733_849_762,
        1.978_260_606_922_038,
        0.043_820_979_319_167,
    ],
    [
        0.074_697_993_974_576,
        -0.251_850_613_564_553,
        1.176_799_544_419_134,
    ],
];

/// Radiance's own primaries and white.
const STANDARD: Primaries = Primaries {
    red: [0.640, 0.330],
    green: [0.290, 0.600],
    blue: [0.150, 0.060],
    white: [0.3333, 0.3333],
};

/// Lumens a watt of white light: what an XYZE picture's Y was multiplied by.
const EFFICACY: f64 = 179.0;

/// What the header says of the pixels.
struct Header {
    xyz: bool,
    /// What the pixels were multiplied by, a channel each: all EXPOSUREs times all COLORCORRs.
    scale: [f64; 3],
    /// What PRIMARIES asks for.
    primaries: Option<ToRec709>,
    /// Where the pixels begin.
    end: usize,
}

/// The size and the order in which pixels are stored.
struct Order {
    /// Whether a scan line is a row of the picture; else it is a column.
    rows: bool,
    /// Scan lines run from the bottom up, or from the right.
    reversed_lines: bool,
    /// Pixels of a scan line run from the right, or from the bottom.
    reversed_pixels: bool,
    lines: usize,
    pixels: usize,
}

pub(super) fn decode(bytes: &[u8]) -> Parsed<Picture> {
    let header = header(bytes)?;
    let (order, start) = order(bytes, header.end)?;
    let (width, height) = if order.rows {
        (order.pixels, order.lines)
    } else {
        (order.lines, order.pixels)
    };
    check_size(width, height, bytes.len())?;
    let value = |pixel: [u8; 4]| {
        let [x, y, z] = radiance(pixel);
        let seen = if header.xyz {
            RGB_OF_XYZ.map(|[a, b, c]| ((a * x + b * y + c * z) / EFFICACY).max(0.0))
        } else {
            [x, y, z]
        };
        let seen = std::array::from_fn(|channel| seen[channel] / header.scale[channel]);
        match &header.primaries {
            // XYZ are what they are, whatever the primaries of the picture that they were made of.
            Some(to_rec709) if !header.xyz => to_rec709.apply(seen),
            _ => seen,
        }
    };
    let mut pixels = room(width * height)?;
    pixels.resize(width * height, [0.0; 3]);
    let mut rest = &bytes[start..];
    let mut stored: Vec<[u8; 4]> = room(order.pixels)?;
    for mut line in 0..order.lines {
        if order.reversed_lines {
            line = order.lines - 1 - line;
        }
        stored.clear();
        scan_line(&mut rest, order.pixels, &mut stored)?;
        for (mut pixel, &stored) in stored.iter().enumerate() {
            if order.reversed_pixels {
                pixel = order.pixels - 1 - pixel;
            }
            let place = if order.rows {
                line * width + pixel
            } else {
                pixel * width + line
            };
            pixels[place] = value(stored);
        }
    }
    Ok(Picture {
        width,
        height,
        pixels,
    })
}

/// The three values of a stored pixel.
fn radiance([a, b, c, exponent]: [u8; 4]) -> [f64; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let unit = 2f64.powi(i32::from(exponent) - 136);
    [a, b, c].map(|mantissa| (f64::from(mantissa) + 0.5) * unit)
}

/// One line of text, without its end, and what follows.
fn line(bytes: &[u8], start: usize) -> Parsed<(&str, usize)> {
    let rest = bytes.get(start..).unwrap_or_default();
    let length = rest
        .iter()
        .position(|byte| *byte == b'\n')
        .ok_or_else(|| Problem::new("the header does not end", "fetch it again"))?;
    // Comments may be in any encoding, and lines may end as Windows ends them.
    let text = std::str::from_utf8(&rest[..length]).unwrap_or_default();
    Ok((text.trim_end_matches('\r'), start + length + 1))
}

/// Whether these bytes are a picture of the format: they begin with `#?`, or, as in old files, a
/// header without it ends in a resolution string.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    if bytes.starts_with(b"#?") {
        return true;
    }
    // Headers are text, and short.
    let mut at = 0;
    while at < bytes.len().min(1 << 14) {
        let Ok((_, next)) = line(bytes, at) else {
            return false;
        };
        if ends_header(bytes, at) {
            return order(bytes, next).is_ok();
        }
        if bytes[at..next - 1]
            .iter()
            .any(|byte| byte.is_ascii_control() && !b"\t\r".contains(byte))
        {
            return false;
        }
        at = next;
    }
    false
}

/// Whether the line that starts here is empty.
fn ends_header(bytes: &[u8], start: usize) -> bool {
    let rest = &bytes[start..];
    rest.starts_with(b"\n") || rest.starts_with(b"\r\n")
}

fn header(bytes: &[u8]) -> Parsed<Header> {
    let mut header = Header {
        xyz: false,
        scale: [1.0; 3],
        primaries: None,
        end: 0,
    };
    loop {
        let (text, next) = line(bytes, header.end)?;
        let last = ends_header(bytes, header.end);
        header.end = next;
        if last {
            return Ok(header);
        }
        let Some((key, value)) = text.split_once('=') else {
            continue;
        };
        match key {
            "FORMAT" => match value.trim() {
                "32-bit_rle_rgbe" => header.xyz = false,
                "32-bit_rle_xyze" => header.xyz = true,
                other => {
                    return Err(Problem::new(
                        format!("the pixels are in the format {other:?}, which is not read here"),
                        "store it again as 32-bit_rle_rgbe or 32-bit_rle_xyze",
                    ));
                }
            },
            "EXPOSURE" => {
                let [factor] = factors(key, value)?;
                header.scale = header.scale.map(|scale| scale * factor);
            }
            "COLORCORR" => {
                let correction: [f64; 3] = factors(key, value)?;
                for (scale, factor) in header.scale.iter_mut().zip(correction) {
                    *scale *= factor;
                }
            }
            "PRIMARIES" => {
                let primaries = Primaries::new(numbers(value).ok_or_else(|| {
                    Problem::new(
                        format!(
                            "the header says PRIMARIES={value:?}, where the chromaticities of red, green, blue and white are needed"
                        ),
                        "give eight numbers there, or take the line out for Rec. 709",
                    )
                })?);
                header.primaries = if primaries.is(&STANDARD) {
                    None
                } else {
                    primaries.to_rec709()?
                };
            }
            "GAMMA" if numbers(value) != Some([1.0]) => {
                return Err(Problem::new(
                    format!(
                        "the header says GAMMA={}: its pixels are encoded for a display, and are no radiance",
                        value.trim()
                    ),
                    "store it again as linear radiance",
                ));
            }
            _ => {}
        }
        if !header.scale.iter().all(|scale| scale.is_normal()) {
            return Err(Problem::new(
                "the EXPOSURE and COLORCORR lines of its header multiply to nothing or without bound",
                "mend these lines, or store it again",
            ));
        }
    }
}

/// The numbers of a header's line, when there are so many.
fn numbers<const N: usize>(value: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = value
        .split_whitespace()
        .map_while(|word| word.parse().ok())
        .collect();
    <[f64; N]>::try_from(numbers).ok()
}

/// The positive numbers of an EXPOSURE or COLORCORR line.
fn factors<const N: usize>(key: &str, value: &str) -> Parsed<[f64; N]> {
    numbers(value)
        .filter(|numbers: &[f64; N]| numbers.iter().all(|n| n.is_finite() && *n > 0.0))
        .ok_or_else(|| {
            let positive = if N == 1 {
                "a positive number is"
            } else {
                "three positive numbers are"
            };
            Problem::new(
                format!(
                    "the header says {key}={}, where {positive} needed: what the pixels were multiplied by",
                    value.trim()
                ),
                "mend that line, or take it out if the pixels are as they were (FreeImage writes EXPOSURE=0 of those)",
            )
        })
}

/// The resolution string: `-Y height +X width` and its seven other orders.
fn order(bytes: &[u8], start: usize) -> Parsed<(Order, usize)> {
    let (text, next) = line(bytes, start)?;
    let wrong = || Problem::corrupt(format!("its size reads {text:?}"));
    let words: Vec<&str> = text.split_whitespace().collect();
    let [first, lines, second, pixels] = words[..] else {
        return Err(wrong());
    };
    let (rows, reversed_lines, reversed_pixels) = match (first, second) {
        ("-Y", "+X") => (true, false, false),
        ("-Y", "-X") => (true, false, true),
        ("+Y", "+X") => (true, true, false),
        ("+Y", "-X") => (true, true, true),
        ("+X", "-Y") => (false, false, false),
        ("+X", "+Y") => (false, false, true),
        ("-X", "-Y") => (false, true, false),
        ("-X", "+Y") => (false, true, true),
        _ => return Err(wrong()),
    };
    let order = Order {
        rows,
        reversed_lines,
        reversed_pixels,
        lines: lines.parse().map_err(|_| wrong())?,
        pixels: pixels.parse().map_err(|_| wrong())?,
    };
    Ok((order, next))
}

fn take<'a>(rest: &mut &'a [u8], count: usize) -> Parsed<&'a [u8]> {
    let (taken, left) = rest
        .split_at_checked(count)
        .ok_or_else(Problem::truncated)?;
    *rest = left;
    Ok(taken)
}

/// Appends the pixels of one scan line.
fn scan_line(rest: &mut &[u8], count: usize, out: &mut Vec<[u8; 4]>) -> Parsed<()> {
    // The present run-length encoding marks each line with 2, 2 and its length, which no valid
    // pixel is.
    if let [2, 2, high, low, left @ ..] = *rest
        && (8..=0x7fff).contains(&count)
        && *high < 128
    {
        if usize::from(*high) << 8 | usize::from(*low) != count {
            return Err(Problem::corrupt(
                "a scan line has another length than the header says",
            ));
        }
        *rest = left;
        return components(rest, count, out);
    }
    flat_or_old(rest, count, out)
}

/// The four components of a line one after the other, each in runs (a count above 128) and
/// literals.
fn components(rest: &mut &[u8], count: usize, out: &mut Vec<[u8; 4]>) -> Parsed<()> {
    // A file can hold a line in no fewer bytes than this, so a short file cannot ask for memory.
    if rest.len() < 8 * count.div_ceil(127) {
        return Err(Problem::truncated());
    }
    let start = out.len();
    out.resize(start + count, [0; 4]);
    let line = &mut out[start..];
    for component in 0..4 {
        let mut done = 0;
        while done < count {
            let code = usize::from(take(rest, 1)?[0]);
            let run = if code > 128 { code & 127 } else { code };
            if run == 0 || done + run > count {
                return Err(Problem::corrupt(
                    "a run of pixels does not fit its scan line",
                ));
            }
            let values = take(rest, if code > 128 { 1 } else { run })?;
            for (index, pixel) in line[done..done + run].iter_mut().enumerate() {
                pixel[component] = values[if code > 128 { 0 } else { index }];
            }
            done += run;
        }
    }
    Ok(())
}

/// Pixels of four bytes; 1, 1, 1, n repeats the last pixel n times, times 256 for each such pixel
/// before it.
fn flat_or_old(rest: &mut &[u8], count: usize, out: &mut Vec<[u8; 4]>) -> Parsed<()> {
    let end = out.len() + count;
    let first = out.len();
    let mut shift = 0;
    while out.len() < end {
        let bytes = take(rest, 4)?;
        let pixel = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if let [1, 1, 1, repeats] = pixel {
            let repeats = usize::from(repeats)
                .checked_shl(shift)
                .filter(|repeats| shift < 32 && *repeats <= end - out.len());
            match repeats {
                Some(repeats) if out.len() > first => {
                    let last = out[out.len() - 1];
                    out.resize(out.len() + repeats, last);
                }
                _ => {
                    return Err(Problem::corrupt(
                        "a run of pixels does not fit its scan line",
                    ));
                }
            }
            shift += 8;
        } else {
            out.push(pixel);
            shift = 0;
        }
    }
    Ok(())
}
