//! Pictures in files: reading and writing linear radiance.
//!
//! Nothing here knows of directions: [`illumination`](crate::illumination) makes light of a
//! picture, [`picture`](crate::picture) finds a sphere in one.

mod codes;
mod exr;
mod hdr;
mod jpeg;
mod pfm;
mod png;
mod primaries;
mod raster;
mod srgb;
mod tiff;
mod webp;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

pub(crate) use self::codes::{Coded, Pixels};
pub use self::exr::is_guarded;
pub use self::exr::{Precision, encode_exr, encode_exr_with_alpha, write_exr};
pub(crate) use self::raster::Raster;
pub use self::srgb::{linear_of_srgb, srgb_of_linear, srgb8_of_linear};

use crate::{Error, Result};

/// The most pixels that a reader accepts: 2²⁶, a panorama of 11 585×5 792.
///
/// A header that claims more is refused before anything is allocated for it.
pub const MOST_PIXELS: usize = 1 << 26;

/// The most bytes that are read of a file: 2³¹. What never ends, such as a device, ends there.
const MOST_BYTES: u64 = 1 << 31;

/// The most pixels that a reader accepts for a byte of file: 1024.
///
/// Deflate, under OpenEXR's usual compressions and under PNG, makes at most 1032 bytes of one; only
/// a picture of a single colour comes near. What claims more is refused before anything is
/// allocated for it, so a short file cannot ask for memory: see [`decode`].
pub const MOST_PIXELS_PER_BYTE: usize = 1024;

/// A picture of linear radiance, three channels a pixel, as a file holds it.
///
/// ```
/// use lobes::files::Picture;
/// let picture = Picture { width: 2, height: 1, pixels: vec![[0.5; 3], [1.0; 3]] };
/// assert_eq!(picture.pixels.len(), picture.width * picture.height);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each pixel, rows from the top, each from the left: `width · height`
    /// of them.
    pub pixels: Vec<[f64; 3]>,
}

/// What is wrong with a file, before it is known which file it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Problem {
    pub(crate) what: String,
    pub(crate) remedy: String,
}

impl Problem {
    pub(crate) fn new(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    pub(crate) fn truncated() -> Self {
        Self::new("the file ends before its last pixel", "fetch it again")
    }

    pub(crate) fn corrupt(what: impl std::fmt::Display) -> Self {
        Self::new(format!("the file is corrupt: {what}"), "fetch it again")
    }

    pub(crate) fn in_file(self, path: &Path) -> Error {
        Error::file(path, self.what, self.remedy)
    }

    pub(crate) fn in_bytes(self) -> Error {
        Error::Contents {
            problem: self.what,
            remedy: self.remedy,
        }
    }
}

/// Checks what the header of a file of `length` bytes claims, before anything is allocated for it.
pub(crate) fn check_size(
    width: usize,
    height: usize,
    length: usize,
) -> std::result::Result<(), Problem> {
    match width.checked_mul(height) {
        Some(0) => Err(Problem::new(
            format!("the header claims a picture of {width} by {height} pixels"),
            "give a picture that is not empty",
        )),
        Some(pixels) if pixels > MOST_PIXELS => Err(too_many(width, height)),
        Some(pixels) if pixels / MOST_PIXELS_PER_BYTE > length => Err(Problem::corrupt(format!(
            "it claims {width} by {height} pixels, more than a file of its length can hold"
        ))),
        Some(_) => Ok(()),
        None => Err(too_many(width, height)),
    }
}

fn too_many(width: usize, height: usize) -> Problem {
    Problem::new(
        format!(
            "the header claims {width} by {height} pixels, more than the {MOST_PIXELS} that are read"
        ),
        "give a smaller picture, or fetch the file again if it is not that large",
    )
}

/// The picture of linear radiance in a file.
///
/// The format is told by the first bytes, not by the name: OpenEXR, Radiance's RGBE and XYZE, and
/// PFM.
///
/// **Colour.** Pixels are linear red, green and blue of Rec. 709. What says that it has other primaries (OpenEXR's `chromaticities`, Radiance's
/// `PRIMARIES`) is converted, its white adapted to D65 by Bradford's transform; colours that Rec.
/// 709 cannot show lose their parts below zero. Luminance and chroma (Y, RY, BY) become colour;
/// luminance alone is grey.
///
/// **Size.** That of OpenEXR's display window: pixels outside of it are left out, and a file that lacks pixels in it is refused.
///
/// # Errors
///
/// [`Error::File`] when the file cannot be opened, is truncated or corrupt, claims more than
/// [`MOST_PIXELS`], or is of another format.
pub fn read(path: &Path) -> Result<Picture> {
    let decoded = decode_file(path)?.whole();
    Ok(decoded.map_err(|problem| problem.in_file(path))?.picture)
}

/// [`read`], with all that the file says. A portable float map, whose pixels are not packed, is
/// read a row at a time; other files are in memory while they are decoded.
pub(crate) fn decode_file(path: &Path) -> Result<Decoded> {
    let mut file = BufReader::new(open(path)?);
    // A device or a pipe does not say how long it is.
    let length = file.get_ref().metadata().ok().filter(|data| data.is_file());
    if let Some(length) = &length
        && length.len() <= MOST_BYTES
        && file.fill_buf().is_ok_and(pfm::recognises)
    {
        return pfm::decode(&mut file, length.len() as usize)
            .map_err(|problem| problem.in_file(path));
    }
    // Not opened again: a pipe whose writer is done would never open.
    let expected = length.map_or(0, |length| length.len());
    decode_all(&read_opened(file, expected, path)?).map_err(|problem| problem.in_file(path))
}

fn open(path: &Path) -> Result<File> {
    File::open(path).map_err(|error| unread(path, &error))
}

fn unread(path: &Path, error: &std::io::Error) -> Error {
    Error::file(
        path,
        format!("the file cannot be read: {error}"),
        "give the path of a file that can be opened",
    )
}

/// What a file holds.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let file = open(path)?;
    let expected = file.metadata().map_or(0, |data| data.len());
    read_opened(file, expected, path)
}

/// The bytes of a file that is open, of which so many are expected.
fn read_opened(file: impl Read, expected: u64, path: &Path) -> Result<Vec<u8>> {
    let expected = expected.min(MOST_BYTES) as usize;
    let mut bytes = room(expected).map_err(|problem| problem.in_file(path))?;
    file.take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| unread(path, &error))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Error::file(
            path,
            format!("the file has more than {MOST_BYTES} bytes"),
            "give a smaller picture",
        ));
    }
    Ok(bytes)
}

/// The picture of linear radiance in the bytes of a file: [`read`] without the file.
///
/// **Memory.** N bytes take at most 2¹⁵ N bytes and 1 MiB more, whatever they hold. A file that is not packed to the limit of its compression
/// takes 24 bytes for each pixel, 8 more for alpha, and while OpenEXR is unpacked one block of its
/// own pixels.
///
/// **Panics.** None. Where the crate `exr` panics, on some damaged files, that ends here; its message goes to the panic hook first.
///
/// # Errors
///
/// [`Error::Contents`] when the bytes are truncated or corrupt, claim more than [`MOST_PIXELS`] or
/// more than [`MOST_PIXELS_PER_BYTE`], or are of another format.
///
/// ```
/// // One grey pixel: a portable float map.
/// let mut bytes = b"Pf\n1 1\n-1.0\n".to_vec();
/// bytes.extend(0.18f32.to_le_bytes());
/// let picture = lobes::files::decode(&bytes)?;
/// assert_eq!(picture.pixels, [[f64::from(0.18f32); 3]]);
/// assert!(lobes::files::decode(&bytes[..15]).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn decode(bytes: &[u8]) -> Result<Picture> {
    decode_problem(bytes).map_err(Problem::in_bytes)
}

/// What a file of linear radiance holds: its colour, and what it says besides.
pub(crate) struct Decoded {
    pub(crate) picture: Picture,
    /// The alpha channel.
    pub(crate) alpha: Option<Vec<f64>>,
    /// How the file says that it shows all directions.
    pub(crate) environment: Option<Environment>,
    /// What is wrong for who needs all pixels, where the file holds a part of its picture only. The
    /// others are black, and transparent.
    pub(crate) incomplete: Option<Problem>,
}

/// OpenEXR's attribute `envmap`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Environment {
    /// A latitude-longitude map.
    LatLong,
    /// The six faces of a cube, one above the other.
    Cube,
}

impl Decoded {
    /// Colour alone.
    fn of(picture: Picture) -> Self {
        Self {
            picture,
            alpha: None,
            environment: None,
            incomplete: None,
        }
    }

    /// The same, where every pixel is needed.
    pub(crate) fn whole(self) -> std::result::Result<Self, Problem> {
        match self.incomplete {
            Some(problem) => Err(problem),
            None => Ok(self),
        }
    }
}

/// Room for so many values of a picture: how many is for the file to say, so a lack of memory is an
/// error.
pub(crate) fn room<T>(count: usize) -> std::result::Result<Vec<T>, Problem> {
    let mut values = Vec::new();
    match values.try_reserve_exact(count) {
        Ok(()) => Ok(values),
        Err(_) => Err(Problem::new(
            format!(
                "there is no memory for the {} MB of its pixels",
                (count * size_of::<T>()) >> 20
            ),
            "make memory free, or store the picture smaller",
        )),
    }
}

/// Whether the first bytes are those of a format that [`decode`] reads; an empty file is left to
/// it, too.
pub(crate) fn is_linear(bytes: &[u8]) -> bool {
    bytes.is_empty()
        || bytes.starts_with(&exr::MAGIC)
        || pfm::recognises(bytes)
        || hdr::recognises(bytes)
}

/// [`decode`], with all that the file says, and with what is wrong still to be put into an error.
pub(crate) fn decode_all(bytes: &[u8]) -> std::result::Result<Decoded, Problem> {
    if bytes.starts_with(&exr::MAGIC) {
        exr::decode(bytes)
    } else if pfm::recognises(bytes) {
        pfm::decode(&mut &*bytes, bytes.len())
    } else if bytes.is_empty() {
        Err(Problem::new("the file is empty", "fetch it again"))
    } else if hdr::recognises(bytes) {
        hdr::decode(bytes).map(Decoded::of)
    } else {
        Err(Problem::new(
            "the file is none of OpenEXR, Radiance and PFM",
            "convert it to one of these",
        ))
    }
}

/// [`decode`], with what is wrong still to be put into an error.
pub(crate) fn decode_problem(bytes: &[u8]) -> std::result::Result<Picture, Problem> {
    Ok(decode_all(bytes)?.whole()?.picture)
}

/// What a PNG, JPEG, WebP or TIFF holds; nothing if the bytes are none of these.
///
/// HEIC and AVIF, for which there is no maintained decoder in Rust alone, are told apart to say so.
pub(crate) fn decode_codes(bytes: &[u8]) -> Option<std::result::Result<Coded, Problem>> {
    if bytes.starts_with(&[0x89, b'P', b'N', b'G']) {
        Some(png::decode(bytes))
    } else if bytes.starts_with(&[0xff, 0xd8]) {
        Some(jpeg::decode(bytes))
    } else if webp::recognises(bytes) {
        Some(webp::decode(bytes))
    } else if tiff::recognises(bytes) {
        Some(tiff::decode(bytes))
    } else {
        let brand = bytes.get(4..12)?.strip_prefix(b"ftyp")?;
        let name = match brand {
            b"avif" | b"avis" => "AVIF",
            b"heic" | b"heix" | b"heim" | b"heis" | b"hevc" | b"hevx" | b"mif1" | b"msf1" => "HEIC",
            _ => return None,
        };
        Some(Err(Problem::new(
            format!("the file is {name}, which is not read here"),
            format!(
                "convert it to JPEG or PNG, for example by ImageMagick (magick picture.{} picture.png)",
                name.to_lowercase()
            ),
        )))
    }
}

/// Writes a file whole or not at all: beside its place first, under a name of this process and
/// call, then moved into it.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    static CALLS: AtomicUsize = AtomicUsize::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!(".{name}-{}-{call}-partial", std::process::id()));
    std::fs::write(&beside, bytes)
        .and_then(|()| std::fs::rename(&beside, path))
        .map_err(|error| {
            // What was written of it is of no use; that it cannot be removed either changes
            // nothing.
            let _ = std::fs::remove_file(&beside);
            Error::file(
                path,
                format!("the file cannot be written: {error}"),
                "give a place that can be written",
            )
        })
}
