//! What the oracles answered, as they left it in `oracles/snapshots`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use lobes::{Error, Result};

/// A folder of snapshots; each file is read once, when first asked for.
#[derive(Debug)]
pub struct Snapshots {
    folder: PathBuf,
    read: Mutex<BTreeMap<String, Arc<Snapshot>>>,
}

impl Snapshots {
    /// The snapshots in a folder.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            read: Mutex::default(),
        }
    }

    /// The snapshots of the checkout that `start` lies in: `oracles/snapshots` in it or in the
    /// nearest folder above it.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where there is none.
    pub fn find(start: &Path) -> Result<Self> {
        start
            .ancestors()
            .map(|folder| folder.join("oracles/snapshots"))
            .find(|folder| folder.is_dir())
            .map(Self::new)
            .ok_or_else(|| {
                Error::file(
                    start,
                    "no folder oracles/snapshots here or above",
                    "run this in a checkout of lobes",
                )
            })
    }

    /// The snapshot of one subject.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where it cannot be read or is not a snapshot.
    pub fn subject(&self, subject: &str) -> Result<Arc<Snapshot>> {
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(snapshot) = read.get(subject) {
            return Ok(Arc::clone(snapshot));
        }
        let path = self.folder.join(format!("{subject}.json"));
        let fail = |problem: String| {
            let remedy = format!("make it anew with scripts/regenerate-oracles {subject}");
            Error::file(&path, problem, remedy)
        };
        let text = std::fs::read_to_string(&path).map_err(|error| fail(error.to_string()))?;
        let raw: Raw = serde_json::from_str(&text).map_err(|error| fail(error.to_string()))?;
        let snapshot = Arc::new(Snapshot {
            path,
            provenance: raw.provenance,
            cases: raw.cases,
        });
        read.insert(subject.to_owned(), Arc::clone(&snapshot));
        Ok(snapshot)
    }

    /// All cases of one name in one subject.
    ///
    /// # Errors
    ///
    /// As [`subject`](Self::subject) and [`Snapshot::cases`].
    pub fn cases<T: DeserializeOwned>(&self, subject: &str, name: &str) -> Result<Vec<T>> {
        self.subject(subject)?.cases(name)
    }
}

#[derive(Deserialize)]
struct Raw {
    provenance: Provenance,
    cases: Vec<serde_json::Value>,
}

/// What one oracle answered.
#[derive(Debug, Clone)]
pub struct Snapshot {
    path: PathBuf,
    /// Where the answers come from.
    pub provenance: Provenance,
    cases: Vec<serde_json::Value>,
}

impl Snapshot {
    /// All cases of one name; there is at least one. `T` has the case's fields and may leave out
    /// `name` and `tolerance`.
    ///
    /// # Errors
    ///
    /// [`Error::File`] where there is no such case or one does not have the fields of `T`.
    pub fn cases<T: DeserializeOwned>(&self, name: &str) -> Result<Vec<T>> {
        let fail = |problem: String| {
            Error::file(
                &self.path,
                problem,
                "make the snapshot and the contract agree",
            )
        };
        let cases = self
            .cases
            .iter()
            .filter(|case| case["name"] == name)
            .map(|case| {
                T::deserialize(case).map_err(|error| fail(format!("case {name:?}: {error}")))
            })
            .collect::<Result<Vec<T>>>()?;
        if cases.is_empty() {
            return Err(fail(format!("has no case named {name:?}")));
        }
        Ok(cases)
    }
}

/// Where a snapshot comes from.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Provenance {
    /// The subject; the stem of the file's name.
    pub subject: String,
    /// The programs that gave the answers, and their versions.
    pub oracle: BTreeMap<String, String>,
    /// The script, from the root of the repository.
    pub script: String,
    /// The SHA-256 of the script that made this snapshot.
    pub script_sha256: String,
    /// The command that makes it again.
    pub command: String,
    /// The day on which it was made.
    pub date: String,
    /// The precision in which the answers were computed.
    pub precision: String,
}
