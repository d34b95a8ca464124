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
    /// A coefficient is not among those that are stored.
    #[error(
        "the coefficient of degree {degree} and order {order} is not stored; there are degrees up to {degrees} and orders up to {orders}, none beyond the degree"
    )]
    NotStored {
        /// The degree l.
        degree: usize,
        /// The order m.
        order: isize,
        /// The largest degree that is stored.
        degrees: usize,
        /// The largest order |m| that is stored.
        orders: usize,
    },
    /// Finite input led to numbers that a double does not hold.
    #[error(
        "{what} would pass the largest number, 1.8·10³⁰⁸, though what they come from is finite; scale that down first"
    )]
    Overflow {
        /// The output.
        what: &'static str,
    },
    /// What was asked for takes more memory than there is.
    #[error("{what} would have {values} values, for which there is no memory; ask for less")]
    Memory {
        /// The array.
        what: &'static str,
        /// How many values it would have; the largest `usize` stands for any number beyond.
        values: usize,
    },
    /// A linear problem would multiply the errors of its data by more than its answer bears.
    #[error(
        "{what} multiplies relative errors by {condition:.3e}, and only up to {limit} is answered; {remedy}"
    )]
    IllConditioned {
        /// The problem.
        what: &'static str,
        /// Its condition number in the maximum norm; infinite where it is singular.
        condition: f64,
        /// The largest that is answered.
        limit: f64,
        /// What bears it, in words.
        remedy: String,
    },
    /// Data do not determine a parameter of the model that is fitted to them.
    #[error("{parameter} is not determined by the measurements: {reason}")]
    Undetermined {
        /// The parameter.
        parameter: &'static str,
        /// What the data lack, in words that complete the sentence, and what to do.
        reason: &'static str,
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
pub fn check_length(what: &'static str, expected: usize, got: usize) -> Result<()> {
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

/// So many values, all the default, or an error where there is no memory for them: for arrays whose length a caller chooses.
pub(crate) fn allocate<T: Clone + Default>(what: &'static str, values: usize) -> Result<Vec<T>> {
    // Asked for first, because `vec!`, which is quick for zeros, ends the process where it is refused.
    Vec::<T>::new()
        .try_reserve_exact(values)
        .map_err(|_| Error::Memory { what, values })?;
    Ok(vec![T::default(); values])
}

/// Whether all values are finite, at the speed of vectors.
pub(crate) fn all_finite(values: &[f64]) -> bool {
    values
        .iter()
        .fold(true, |all, value| all & value.is_finite())
}

/// What is wrong with an output that is not finite: its input, or that finite input overflows.
pub(crate) fn not_finite(output: &'static str, what: &'static str, input: &[f64]) -> Error {
    check_finite(what, input)
        .err()
        .unwrap_or(Error::Overflow { what: output })
}

/// Checks that every value is finite.
pub fn check_finite(what: &'static str, values: &[f64]) -> Result<()> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(Error::NotFinite {
            what,
            index,
            value: values[index],
        }),
    }
}
