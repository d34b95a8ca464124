//! Names that nothing has.

use std::path::Path;

use lobes::{Error, Result};

/// The index of what has a name.
///
/// # Errors
/// [`Error::UnknownName`], with the names that there are, the most alike first.
pub(super) fn find(what: &'static str, name: &str, names: &[&str]) -> Result<usize> {
    let place = names.iter().position(|other| *other == name);
    place.ok_or_else(|| Error::UnknownName {
        what,
        name: name.to_owned(),
        names: nearest_first(name, names),
    })
}

/// The names, those that are spelled most like `name` first.
pub(super) fn nearest_first(name: &str, names: &[impl AsRef<str>]) -> Vec<String> {
    let name = name.to_lowercase();
    let mut sorted: Vec<String> = names.iter().map(|n| n.as_ref().to_owned()).collect();
    // A part of a name is nearer than a word with as many other letters.
    sorted.sort_by_cached_key(|other| {
        let other = other.to_lowercase();
        (!other.contains(&name), strsim::levenshtein(&name, &other))
    });
    sorted
}

/// The error of a name that a file gives.
pub(super) fn in_file(path: &Path, error: Error) -> Error {
    match error {
        Error::UnknownName { what, name, names } => Error::file(
            path,
            format!("there is no {what} {name:?}"),
            format!("the names are {}", nearest_first(&name, &names).join(", ")),
        ),
        error => error,
    }
}
