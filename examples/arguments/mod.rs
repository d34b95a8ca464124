//! The arguments of the examples that print tables.

use lobes::{Error, Result};

/// What follows `--name`, split at commas.
pub(crate) fn list<T: std::str::FromStr + Clone>(name: &str, default: &[T]) -> Result<Vec<T>> {
    let arguments: Vec<String> = std::env::args().collect();
    let Some(at) = arguments.iter().position(|argument| argument == name) else {
        return Ok(default.to_vec());
    };
    let bad = || Error::Syntax {
        what: "list of values",
        text: name.into(),
        needs: "values with commas between them",
    };
    let values = arguments.get(at + 1).ok_or_else(bad)?;
    values
        .split(',')
        .map(|value| value.parse().map_err(|_| bad()))
        .collect()
}
