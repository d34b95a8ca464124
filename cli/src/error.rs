//! What can go wrong in the command: what the library says, and what only a command meets.

use std::fmt::Display;
use std::path::PathBuf;

/// The result of anything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong in the command, one sentence each.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The library refuses something.
    #[error(transparent)]
    Library(#[from] lobes::Error),
    /// Something is wrong with one of several inputs or outputs.
    #[error("{subject}: {source}")]
    Of {
        /// Which of them.
        subject: String,
        /// What is wrong with it.
        source: Box<Error>,
    },
    /// What the command line asks for, and what it names, do not go together.
    #[error("{problem}; {remedy}")]
    Request {
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// Part of the work failed; the reasons have been told one by one.
    #[error("{failed} of {total} {what}")]
    Partly {
        /// How many failed.
        failed: usize,
        /// Of how many.
        total: usize,
        /// What they are and how they failed, in words that end the sentence.
        what: String,
    },
    /// The system, or the writer of a format, refuses what the command needs of it.
    #[error("{what}: {problem}")]
    System {
        /// What cannot be done.
        what: &'static str,
        /// What the system says.
        problem: String,
    },
    /// Standard output took not all of the answer.
    #[error("standard output could not be written ({problem}); make room or send it elsewhere")]
    Output {
        /// What the system says.
        problem: String,
    },
}

impl Error {
    /// A [`lobes::Error::File`].
    pub(super) fn file(
        path: impl Into<PathBuf>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        lobes::Error::file(path, problem, remedy).into()
    }

    /// An [`Error::Of`].
    pub(super) fn of(subject: impl Into<String>, source: impl Into<Self>) -> Self {
        Self::Of {
            subject: subject.into(),
            source: Box::new(source.into()),
        }
    }

    /// An [`Error::Request`].
    pub(super) fn request(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Request {
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// An [`Error::System`], from what the system says.
    pub(super) fn system(what: &'static str, problem: impl Display) -> Self {
        Self::System {
            what,
            problem: problem.to_string(),
        }
    }
}
