//! What can go wrong with a caller's data, in one type.

use std::path::PathBuf;

/// The result of anything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong with a caller's data.
///
/// Each message is one sentence: what is wrong, where, and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An array is not as long as the operation needs.
    #[error("{what} has {got} values where {expected} are needed")]
    Length {
        /// The array.
        what: &'static str,
        /// How many values it must have.
        expected: usize,
        /// How many it has.
        got: usize,
    },
    /// A harmonic degree is beyond what the grid, the table or the algorithm carries.
    #[error("degree {degree} is beyond {limit}, the largest that {what} carries")]
    Degree {
        /// Whose limit it is.
        what: &'static str,
        /// The degree that was asked for.
        degree: usize,
        /// The largest allowed.
        limit: usize,
    },
    /// A parameter lies outside its domain.
    #[error("{what} is {value}, which is not {allowed}")]
    Domain {
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The domain, in words that complete "which is not …".
        allowed: &'static str,
    },
    /// A value that must be finite is not.
    #[error("{what} holds {value} at index {index}; every value must be finite")]
    NotFinite {
        /// The array.
        what: &'static str,
        /// The index of the first such value.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A tolerance was asked for that could not be met.
    #[error("{what} reached an error of {reached:e} where {asked:e} was asked for")]
    Tolerance {
        /// The computation.
        what: &'static str,
        /// The tolerance asked for.
        asked: f64,
        /// The error reached, as estimated.
        reached: f64,
    },
    /// Nothing has the name that was given.
    #[error("there is no {what} {name:?}; the names are {}", names.join(", "))]
    UnknownName {
        /// What was named.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that there are.
        names: Vec<String>,
    },
    /// Two maps of one set hold the same pixels, so that leaving one out leaves its light in.
    #[error("the maps {first:?} and {second:?} hold the same pixels; take one of them away")]
    SameLight {
        /// The name of the first map.
        first: String,
        /// The name of the second.
        second: String,
    },
    /// The input is well formed but the operation has no answer for it.
    #[error("{0}")]
    Unanswerable(String),
    /// Bytes in memory that should be what a file holds are not: see [`File`](Self::File) for those that are in one.
    #[error("{problem}; {remedy}")]
    Contents {
        /// What is wrong with them.
        problem: String,
        /// What the reader of the message can do.
        remedy: String,
    },
    /// A file cannot be read, understood or written.
    #[error("{}: {problem}; {remedy}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
        /// What the reader of the message can do.
        remedy: String,
    },
}

impl Error {
    /// An [`Error::File`].
    pub fn file(
        path: impl Into<PathBuf>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::File {
            path: path.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }
}

/// Checks that an array has the length that the operation needs.
pub(crate) fn check_length(what: &'static str, expected: usize, got: usize) -> Result<()> {
    if got == expected {
        Ok(())
    } else {
        Err(Error::Length {
            what,
            expected,
            got,
        })
    }
}

/// Checks that every value is finite.
pub(crate) fn check_finite(what: &'static str, values: &[f64]) -> Result<()> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(Error::NotFinite {
            what,
            index,
            value: values[index],
        }),
    }
}
