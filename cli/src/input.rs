//! Standard input in the place of a file: what it holds is told by its first bytes, as that of
//! files is.

use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};
use lobes::illumination::{self, EnvironmentMap};
use lobes::sphere::Mapping;

/// What errors call it.
pub(super) const NAME: &str = "standard input";

/// The most bytes that are read: 2³¹, as of a file.
const MOST_BYTES: u64 = 1 << 31;

/// Whether a path stands for standard input.
pub(super) fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// What a path is called in answers.
pub(super) fn name(path: &Path) -> String {
    if is_standard(path) {
        NAME.to_owned()
    } else {
        path.display().to_string()
    }
}

/// All of standard input.
pub(super) fn bytes() -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::io::stdin()
        .lock()
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Error::file(NAME, format!("cannot be read ({error})"), "send a file"))?;
    if bytes.is_empty() {
        return Err(Error::file(NAME, "holds nothing", "send a file"));
    }
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Error::file(
            NAME,
            format!("has more than {MOST_BYTES} bytes"),
            "send a smaller file",
        ));
    }
    Ok(bytes)
}

/// The error with the file that it is about.
pub(super) fn error_of(path: &Path, error: Error) -> Error {
    match error {
        Error::Library(lobes::Error::File { .. }) => error,
        Error::Library(lobes::Error::Contents { problem, remedy }) => {
            Error::file(name(path), problem, remedy)
        }
        error => Error::of(name(path), error),
    }
}

/// The map in a file, or in standard input.
pub(super) fn map(path: &Path, mapping: Option<Mapping>) -> Result<EnvironmentMap> {
    if is_standard(path) {
        Ok(illumination::read_bytes(
            Path::new(NAME),
            &bytes()?,
            mapping,
        )?)
    } else {
        Ok(illumination::read(path, mapping)?)
    }
}
