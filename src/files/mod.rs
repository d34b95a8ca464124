//! Pictures in files: reading and writing linear radiance.
//!
//! Nothing here knows of directions: [`illumination`](crate::illumination) makes light of a picture,
//! [`report`](crate::report) makes pictures of numbers.

mod exr;
mod hdr;
mod pfm;
mod srgb;

use std::path::Path;

pub use self::exr::{Precision, encode_exr, write_exr};
pub use self::srgb::{linear_of_srgb, srgb_of_linear};

use crate::{Error, Result};

/// The most pixels that a reader accepts: 2²⁶, a panorama of 11 585×5 792.
///
/// A header that claims more is refused before anything is allocated for it.
pub const MOST_PIXELS: usize = 1 << 26;

/// A picture of linear radiance, three channels a pixel, as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each pixel, rows from the top, each from the left: `width · height` of them.
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
}

/// Checks what a header claims before anything is allocated for it.
fn check_size(width: usize, height: usize) -> std::result::Result<(), Problem> {
    match width.checked_mul(height) {
        Some(0) => Err(Problem::new(
            format!("the header claims a picture of {width} by {height} pixels"),
            "give a picture that is not empty",
        )),
        Some(pixels) if pixels <= MOST_PIXELS => Ok(()),
        _ => Err(Problem::new(
            format!(
                "the header claims {width} by {height} pixels, more than the {MOST_PIXELS} that are read"
            ),
            "give a smaller picture, or fetch the file again if it is not that large",
        )),
    }
}

/// The picture of linear radiance in a file.
///
/// The format is told by the first bytes, not by the name: OpenEXR, Radiance's RGBE and XYZE, and PFM.
///
/// # Errors
///
/// [`Error::File`] when the file cannot be opened, is truncated or corrupt, claims more than
/// [`MOST_PIXELS`], or is of another format.
pub fn read(path: &Path) -> Result<Picture> {
    let bytes = std::fs::read(path).map_err(|error| {
        Error::file(
            path,
            format!("the file cannot be read: {error}"),
            "give the path of a file that can be opened",
        )
    })?;
    decode(&bytes).map_err(|problem| problem.in_file(path))
}

/// [`read`], of bytes in memory.
pub(crate) fn decode(bytes: &[u8]) -> std::result::Result<Picture, Problem> {
    if bytes.starts_with(&exr::MAGIC) {
        exr::decode(bytes)
    } else if bytes.starts_with(b"#?") {
        hdr::decode(bytes)
    } else if bytes.starts_with(b"PF") || bytes.starts_with(b"Pf") {
        pfm::decode(bytes)
    } else {
        Err(Problem::new(
            "the file is none of OpenEXR, Radiance and PFM",
            "convert it to one of these",
        ))
    }
}

/// Writes a file whole or not at all: beside its place first, then moved into it.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    std::fs::write(&beside, bytes)
        .and_then(|()| std::fs::rename(&beside, path))
        .map_err(|error| {
            // What was written of it is of no use; that it cannot be removed either changes nothing.
            let _ = std::fs::remove_file(&beside);
            Error::file(
                path,
                format!("the file cannot be written: {error}"),
                "give a place that can be written",
            )
        })
}
