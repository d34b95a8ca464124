//! Files that appear whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Files gathered in memory, written aside and renamed into a folder when all of them are there.
#[derive(Debug)]
pub(super) struct OutputFolder {
    folder: PathBuf,
    /// The first folder that had to be made, to take away again on failure.
    made: Option<PathBuf>,
    files: Vec<(String, Vec<u8>)>,
    kept: bool,
}

impl OutputFolder {
    /// Makes the folder where it is missing and makes sure that it takes files, before any work is
    /// done for it.
    pub(super) fn open(folder: &Path) -> Result<Self> {
        let made = folder
            .ancestors()
            .take_while(|ancestor| !ancestor.as_os_str().is_empty() && !ancestor.exists())
            .last()
            .map(Path::to_path_buf);
        let output = Self {
            folder: folder.to_path_buf(),
            made,
            files: Vec::new(),
            kept: false,
        };
        let unwritable = |error: std::io::Error| {
            Error::file(
                folder,
                format!("the output folder cannot be written ({error})"),
                "name another one with --out",
            )
        };
        fs::create_dir_all(folder).map_err(unwritable)?;
        let probe = folder.join(format!(".lobes-{}-probe", std::process::id()));
        fs::write(&probe, b"").map_err(unwritable)?;
        fs::remove_file(&probe).map_err(unwritable)?;
        Ok(output)
    }

    /// Adds a file by its path from the folder.
    pub(super) fn add(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.files.push((path.into(), bytes.into()));
    }

    /// Writes every file aside, and when all are written renames them into place.
    pub(super) fn commit(mut self) -> Result<()> {
        let aside = self
            .folder
            .join(format!(".lobes-{}-partial", std::process::id()));
        let result = self.write(&aside);
        let _ = fs::remove_dir_all(&aside);
        self.kept = result.is_ok();
        result
    }

    fn write(&self, aside: &Path) -> Result<()> {
        let failed = |path: &Path, error: std::io::Error| {
            Error::file(
                path,
                format!("cannot be written ({error})"),
                "make room or name another folder with --out",
            )
        };
        let parent = |path: &Path| match path.parent() {
            Some(parent) => fs::create_dir_all(parent).map_err(|error| failed(parent, error)),
            None => Ok(()),
        };
        for (name, bytes) in &self.files {
            let path = aside.join(name);
            parent(&path)?;
            fs::write(&path, bytes).map_err(|error| failed(&self.folder.join(name), error))?;
        }
        for (name, _) in &self.files {
            let path = self.folder.join(name);
            parent(&path)?;
            fs::rename(aside.join(name), &path).map_err(|error| failed(&path, error))?;
        }
        Ok(())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if let (false, Some(made)) = (self.kept, &self.made) {
            let _ = fs::remove_dir_all(made);
        }
    }
}

/// Writes one file aside and renames it into place.
pub(super) fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let failed = |error: std::io::Error| {
        Error::file(
            path,
            format!("cannot be written ({error})"),
            "name another place",
        )
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let aside = path.with_file_name(format!(".{name}-{}-partial", std::process::id()));
    let result = fs::write(&aside, bytes).and_then(|()| fs::rename(&aside, path));
    if result.is_err() {
        let _ = fs::remove_file(&aside);
    }
    result.map_err(failed)
}
