//! OpenEXR, through the crate `exr`.

use std::cell::Cell;
use std::io::Cursor;
use std::path::Path;

use ::exr::block::chunk::TileCoordinates;
use ::exr::block::lines::LineRef;
use ::exr::block::reader::ChunksReader;
use ::exr::meta::attribute::EnvironmentMap;
use ::exr::meta::header::Header;
use ::exr::prelude::*;

use super::primaries::Primaries;
use super::{Decoded, Environment, Picture, Problem, check_size, room, write_whole};
use crate::{Error, Result};

/// The first bytes of every file of the format.
pub(super) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

fn problem(error: ::exr::error::Error) -> Problem {
    match error {
        ::exr::error::Error::NotSupported(what) => {
            let (what, remedy): (String, &str) = if what.contains("deep data") {
                (
                    "the file holds deep data, several samples a pixel, which are not read here"
                        .into(),
                    "flatten it to one sample a pixel",
                )
            } else if what.contains("subsampling") {
                (
                    "the file subsamples its channels, as luminance and chroma often are, which is not read here".into(),
                    "store it again as RGB, every channel at every pixel",
                )
            } else {
                (
                    format!("the file uses a part of OpenEXR that is not read here ({what})"),
                    "store it again as RGB in scan lines with ZIP compression",
                )
            };
            Problem::new(what, remedy)
        }
        ::exr::error::Error::Io(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            Problem::truncated()
        }
        other => Problem::corrupt(other),
    }
}

/// The name of a compression that the crate cannot read, by the byte that stands for it.
fn unread(compression: Compression) -> Option<&'static str> {
    match compression {
        Compression::HTJ2K256 => Some("HTJ2K256"),
        Compression::HTJ2K32 => Some("HTJ2K32"),
        _ => None,
    }
}

/// No compression of the format holds more bytes of pixels than this in a byte of file: deflate's
/// limit is 1032, the others' less.
const MOST_EXPANSION: usize = 2048;

/// The first layer that has red, green and blue, luminance and chroma, or luminance alone, in its
/// display window.
pub(super) fn decode(bytes: &[u8]) -> std::result::Result<Decoded, Problem> {
    // The crate's decompressors panic on some damaged files (an overflow in B44, for one). They
    // share no state with anything, so a panic ends here.
    GUARDED.set(true);
    let decoded = std::panic::catch_unwind(|| decode_unguarded(bytes))
        .unwrap_or_else(|_| Err(Problem::corrupt("its compressed pixels make no sense")));
    GUARDED.set(false);
    decoded
}

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread is caught by the reader of OpenEXR, which makes an error of it.
///
/// A decompressor's panic on damaged data is told as [`Error::File`] or [`Error::Contents`]. The
/// standard panic hook prints it all the same; a program's own hook asks here and keeps quiet.
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// What the three channels that are read stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Colour {
    Rgb,
    /// Luminance Y, (R − Y)/Y and (B − Y)/Y.
    LuminanceChroma,
    Luminance,
}

/// Which channels of a layer are red, green and blue or stand for them, and which is alpha.
struct Channels {
    colour: Colour,
    /// For each channel of the layer, the part of a pixel that it is; the fourth is alpha.
    part: Vec<Option<usize>>,
}

impl Channels {
    fn of(header: &Header) -> Option<Self> {
        let has = |name: &str| header.channels.list.iter().any(|c| c.name.eq(name));
        let all = |names: [&str; 3]| names.iter().all(|name| has(name));
        let (colour, names) = if all(["R", "G", "B"]) {
            (Colour::Rgb, ["R", "G", "B", "A"])
        } else if all(["RY", "Y", "BY"]) {
            (Colour::LuminanceChroma, ["RY", "Y", "BY", "A"])
        } else if has("Y") && !["R", "G", "B", "RY", "BY"].iter().any(|name| has(name)) {
            (Colour::Luminance, ["", "Y", "", "A"])
        } else {
            return None;
        };
        let part =
            |channel: &ChannelDescription| names.iter().position(|name| channel.name.eq(name));
        Some(Self {
            colour,
            part: header.channels.list.iter().map(part).collect(),
        })
    }
}

fn decode_unguarded(bytes: &[u8]) -> std::result::Result<Decoded, Problem> {
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(problem)?;
    for header in reader.headers() {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        check_size(width, height, bytes.len())?;
        if width * height / MOST_EXPANSION * header.channels.bytes_per_pixel > bytes.len() {
            return Err(Problem::corrupt(format!(
                "it claims {width} by {height} pixels, more than a file of its length can hold"
            )));
        }
        if let Some(name) = unread(header.compression) {
            return Err(Problem::new(
                format!("the file uses {name} compression, which is not read here"),
                "store it again with ZIP or PIZ compression",
            ));
        }
    }
    let found = reader
        .headers()
        .iter()
        .enumerate()
        .find_map(|(index, header)| Some((index, header.clone(), Channels::of(header)?)));
    let Some((layer, header, channels)) = found else {
        return Err(Problem::new(
            "no layer of the file has the channels R, G and B, or Y, RY and BY, or Y alone",
            "store it again as RGB",
        ));
    };
    let chromaticities = header.shared_attributes.chromaticities.map(|said| {
        let pairs = [said.red, said.green, said.blue, said.white];
        let mut values = [0.0; 8];
        for (index, value) in pairs.iter().flat_map(|Vec2(x, y)| [*x, *y]).enumerate() {
            values[index] = f64::from(value);
        }
        Primaries::new(values)
    });
    let primaries = chromaticities.unwrap_or(Primaries::REC709);
    let mut canvas = Canvas::new(&header, bytes.len())?;

    let largest = |_: &MetaData, tile: TileCoordinates, block: ::exr::block::BlockIndex| {
        block.layer == layer && tile.level_index == Vec2(0, 0)
    };
    let mut blocks = reader
        .filter_chunks(false, largest)
        .map_err(problem)?
        .sequential_decompressor(false);
    while let Some(block) = blocks.decompress_next_block() {
        let block = block.map_err(problem)?;
        for line in block.lines(&header.channels) {
            let channel = line.location.channel;
            if let Some(part) = channels.part[channel] {
                canvas.draw(&line, header.channels.list[channel].sample_type, part);
            }
        }
    }

    let weights = primaries.luminance()?;
    let to_rec709 = match channels.colour {
        Colour::Luminance => None,
        _ => primaries.to_rec709()?,
    };
    for pixel in &mut canvas.pixels {
        let rgb = match channels.colour {
            Colour::Rgb => *pixel,
            Colour::Luminance => [pixel[1]; 3],
            Colour::LuminanceChroma => {
                let [red_chroma, y, blue_chroma] = *pixel;
                let (red, blue) = ((red_chroma + 1.0) * y, (blue_chroma + 1.0) * y);
                let green = (y - weights[0] * red - weights[2] * blue) / weights[1];
                [red, green, blue]
            }
        };
        *pixel = to_rec709.map_or(rgb, |matrix| matrix.apply(rgb));
    }
    Ok(Decoded {
        alpha: channels.part.contains(&Some(3)).then_some(canvas.alpha),
        environment: header
            .own_attributes
            .environment_map
            .map(|said| match said {
                EnvironmentMap::LatitudeLongitude => Environment::LatLong,
                EnvironmentMap::Cube => Environment::Cube,
            }),
        incomplete: canvas.missing,
        picture: Picture {
            width: canvas.width,
            height: canvas.height,
            pixels: canvas.pixels,
        },
    })
}

/// The display window, and the pixels that lie in it.
struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
    alpha: Vec<f64>,
    /// Where the data window begins within the display window.
    left: i64,
    top: i64,
    /// What is wrong if all pixels are needed.
    missing: Option<Problem>,
}

impl Canvas {
    /// Black and transparent outside of the data window, and inside of it not a number, until it is
    /// drawn.
    fn new(header: &Header, length: usize) -> std::result::Result<Self, Problem> {
        let display = header.shared_attributes.display_window;
        let (width, height) = (display.size.width(), display.size.height());
        check_size(width, height, length)?;
        let Vec2(x, y) = header.own_attributes.layer_position;
        let left = i64::from(x) - i64::from(display.position.x());
        let top = i64::from(y) - i64::from(display.position.y());
        let (data_width, data_height) = (header.layer_size.width(), header.layer_size.height());
        let within = |start: i64, length: usize, limit: usize| {
            start.clamp(0, limit as i64) as usize
                ..(start + length as i64).clamp(0, limit as i64) as usize
        };
        let (columns, rows) = (
            within(left, data_width, width),
            within(top, data_height, height),
        );
        let size = format!(
            "the file holds {data_width} by {data_height} pixels from column {left}, row {top} of a picture of {width} by {height}"
        );
        if columns.is_empty() || rows.is_empty() {
            return Err(Problem::new(
                format!("{size}, so nothing of it"),
                "store it again with a data window that meets its display window",
            ));
        }
        let missing = (columns.len() < width || rows.len() < height).then(|| {
            Problem::new(
                format!("{size}, and the rest is missing"),
                "store the whole picture: a data window that covers the display window",
            )
        });
        let mut pixels: Vec<[f64; 3]> = room(width * height)?;
        pixels.resize(width * height, [0.0; 3]);
        let has_alpha = header.channels.list.iter().any(|c| c.name.eq("A"));
        let alphas = if has_alpha { width * height } else { 0 };
        let mut alpha = room(alphas)?;
        alpha.resize(alphas, 0.0);
        for row in rows {
            pixels[row * width..][columns.clone()].fill([f64::NAN; 3]);
        }
        Ok(Self {
            width,
            height,
            pixels,
            alpha,
            left,
            top,
            missing,
        })
    }

    /// Draws a line of one channel: the red, green or blue part, or the fourth, alpha.
    fn draw(&mut self, line: &LineRef<'_>, kind: SampleType, part: usize) {
        let row = line.location.position.y() as i64 + self.top;
        if !(0..self.height as i64).contains(&row) {
            return;
        }
        let start = row as usize * self.width;
        let value = |index: usize| -> f64 {
            let bytes = line.value;
            match kind {
                SampleType::F16 => {
                    f16::from_ne_bytes([bytes[2 * index], bytes[2 * index + 1]]).to_f64()
                }
                SampleType::F32 => f64::from(f32::from_ne_bytes(
                    [0, 1, 2, 3].map(|k| bytes[4 * index + k]),
                )),
                SampleType::U32 => f64::from(u32::from_ne_bytes(
                    [0, 1, 2, 3].map(|k| bytes[4 * index + k]),
                )),
            }
        };
        for index in 0..line.location.sample_count {
            let column = (line.location.position.x() + index) as i64 + self.left;
            if !(0..self.width as i64).contains(&column) {
                continue;
            }
            let at = start + column as usize;
            if part == 3 {
                self.alpha[at] = value(index);
            } else {
                self.pixels[at][part] = value(index);
            }
        }
    }
}

/// How a value is stored in an OpenEXR file.
///
/// ```
/// use lobes::files::{Picture, Precision, decode, encode_exr};
/// let picture = Picture { width: 1, height: 1, pixels: vec![[0.5, 0.25, 2.0]] };
/// let bytes = encode_exr(&picture, Precision::Half)?;
/// assert_eq!(decode(&bytes)?, picture);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: 11 significant bits, up to 65 504.
    Half,
    /// 32 bits.
    Single,
}

/// A picture as the bytes of an OpenEXR file: RGB in scan lines, losslessly compressed (ZIP) at the
/// given precision.
///
/// # Errors
///
/// [`Error::Length`] when there are not `width · height` pixels; [`Error::Encoding`] for a size
/// that the format cannot hold.
pub fn encode_exr(picture: &Picture, precision: Precision) -> Result<Vec<u8>> {
    encode(picture, None, precision)
}

/// [`encode_exr`] with an alpha channel, a value for each pixel from 0 to 1. Colours are written as
/// they are, not multiplied by it, so that who ignores it reads them.
///
/// # Errors
///
/// Those of [`encode_exr`], and [`Error::Length`] when there are not as many values.
pub fn encode_exr_with_alpha(
    picture: &Picture,
    alpha: &[f64],
    precision: Precision,
) -> Result<Vec<u8>> {
    crate::error::check_length("the alpha channel", picture.pixels.len(), alpha.len())?;
    encode(picture, Some(alpha), precision)
}

fn encode(picture: &Picture, alpha: Option<&[f64]>, precision: Precision) -> Result<Vec<u8>> {
    crate::error::check_length(
        "the picture",
        picture.width * picture.height,
        picture.pixels.len(),
    )?;
    let stored = |values: &mut dyn Iterator<Item = f64>| match precision {
        Precision::Half => FlatSamples::F16(values.map(f16::from_f64).collect()),
        Precision::Single => FlatSamples::F32(values.map(|value| value as f32).collect()),
    };
    let samples = |channel: usize| stored(&mut picture.pixels.iter().map(|pixel| pixel[channel]));
    let colours = [("R", 0), ("G", 1), ("B", 2)].into_iter();
    let colours = colours.map(|(name, channel)| AnyChannel::new(name, samples(channel)));
    let alpha = alpha.map(|alpha| AnyChannel::new("A", stored(&mut alpha.iter().copied())));
    let channels = AnyChannels::sort(colours.chain(alpha).collect());
    let layer = Layer::new(
        Vec2(picture.width, picture.height),
        LayerAttributes::default(),
        Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        },
        channels,
    );
    let mut bytes = Vec::new();
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| Error::Encoding {
            format: "OpenEXR",
            width: picture.width,
            height: picture.height,
            problem: error.to_string(),
        })?;
    Ok(bytes)
}

/// Writes a picture as OpenEXR: see [`encode_exr`].
///
/// # Errors
///
/// Those of [`encode_exr`]; [`Error::File`] when the file cannot be written.
pub fn write_exr(path: &Path, picture: &Picture, precision: Precision) -> Result<()> {
    write_whole(path, &encode_exr(picture, precision)?)
}
