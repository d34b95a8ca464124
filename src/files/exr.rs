//! OpenEXR, through the crate `exr`.

use std::cell::Cell;
use std::io::Cursor;
use std::path::Path;

use ::exr::prelude::*;

use super::{Picture, Problem, check_size, write_whole};
use crate::{Error, Result};

/// The first bytes of every file of the format.
pub(super) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

fn problem(error: ::exr::error::Error) -> Problem {
    match error {
        ::exr::error::Error::NotSupported(what) => Problem::new(
            format!("the file uses a part of OpenEXR that is not read here ({what})"),
            "store it again with ZIP or PIZ compression",
        ),
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

/// No compression of the format holds more bytes of pixels than this in a byte of file: deflate's limit is 1032, the others' less.
const MOST_EXPANSION: usize = 2048;

/// The colour of the first layer that has red, green and blue, or luminance alone.
pub(super) fn decode(bytes: &[u8]) -> std::result::Result<Picture, Problem> {
    Ok(decode_with_alpha(bytes)?.0)
}

/// The colour, and the channel A of the same layer if it has one.
pub(super) fn decode_with_alpha(
    bytes: &[u8],
) -> std::result::Result<(Picture, Option<Vec<f64>>), Problem> {
    // The crate's decompressors panic on some damaged files (an overflow in B44, for one). They share no state with
    // anything, so a panic ends here.
    GUARDED.set(true);
    let decoded = std::panic::catch_unwind(|| decode_unguarded(bytes))
        .unwrap_or_else(|_| Err(Problem::corrupt("its compressed pixels make no sense")));
    GUARDED.set(false);
    decoded
}

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread ends in [`decode`], so that nobody need hear of it.
#[cfg(feature = "cli")]
pub(crate) fn is_guarded() -> bool {
    GUARDED.get()
}

fn decode_unguarded(bytes: &[u8]) -> std::result::Result<(Picture, Option<Vec<f64>>), Problem> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(problem)?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        check_size(width, height, bytes.len())?;
        // The crate allocates the whole picture before it reads a pixel.
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
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(problem)?;
    let layer = &image.layer_data;
    let find = |name: &str| {
        layer
            .channel_data
            .list
            .iter()
            .find(|channel| channel.name.eq(name))
    };
    let channels = match (find("R"), find("G"), find("B"), find("Y")) {
        (Some(red), Some(green), Some(blue), _) => [red, green, blue],
        (None, None, None, Some(luminance)) => [luminance; 3],
        _ => {
            return Err(Problem::new(
                "the first layer has neither the channels R, G and B nor Y alone",
                "store it again as RGB",
            ));
        }
    };
    let count = layer.size.width() * layer.size.height();
    if channels
        .iter()
        .any(|channel| channel.sample_data.len() != count)
    {
        return Err(Problem::new(
            "the file subsamples its channels, which is not read here",
            "store it again as RGB",
        ));
    }
    let at = |channel: &AnyChannel<FlatSamples>, index: usize| {
        f64::from(channel.sample_data.value_by_flat_index(index).to_f32())
    };
    let alpha = find("A")
        .filter(|channel| channel.sample_data.len() == count)
        .map(|channel| (0..count).map(|index| at(channel, index)).collect());
    let picture = Picture {
        width: layer.size.width(),
        height: layer.size.height(),
        pixels: (0..count)
            .map(|index| channels.map(|channel| at(channel, index)))
            .collect(),
    };
    Ok((picture, alpha))
}

/// How a value is stored in an OpenEXR file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: 11 significant bits, up to 65 504.
    Half,
    /// 32 bits.
    Single,
}

/// A picture as the bytes of an OpenEXR file: RGB in scan lines, losslessly compressed (ZIP) at the given
/// precision.
///
/// # Errors
///
/// [`Error::Length`] when there are not `width · height` pixels; [`Error::Unanswerable`] for a size that the format
/// cannot hold.
pub fn encode_exr(picture: &Picture, precision: Precision) -> Result<Vec<u8>> {
    crate::error::check_length(
        "the picture",
        picture.width * picture.height,
        picture.pixels.len(),
    )?;
    let samples = |channel: usize| {
        let values = picture.pixels.iter().map(|pixel| pixel[channel]);
        match precision {
            Precision::Half => FlatSamples::F16(values.map(f16::from_f64).collect()),
            Precision::Single => FlatSamples::F32(values.map(|value| value as f32).collect()),
        }
    };
    let channels = AnyChannels::sort(
        [("R", 0), ("G", 1), ("B", 2)]
            .into_iter()
            .map(|(name, channel)| AnyChannel::new(name, samples(channel)))
            .collect(),
    );
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
        .map_err(|error| {
            Error::Unanswerable(format!("the picture makes no OpenEXR file: {error}"))
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
