//! Files that appear whole or not at all, whether the command ends, fails or is stopped, and
//! folders that two runs do not mix in.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};
use lobes::files::{self, Precision, encode_exr};
use lobes::reflection::SphereImage;

/// What is taken away when the command is stopped, oldest first.
///
/// Whoever writes holds the lock while it does, a file at a time, and so does whoever renames, all
/// files at a time: when the command is stopped it finds everything written aside, or everything in
/// its place.
static UNFINISHED: Mutex<Vec<Unfinished>> = Mutex::new(Vec::new());

#[derive(Debug, Clone, PartialEq)]
enum Unfinished {
    /// A folder that is written aside.
    Aside(PathBuf),
    /// A folder that had to be made, and the first of those that it is in that had to be made too.
    Made { folder: PathBuf, first: PathBuf },
}

impl Unfinished {
    fn remove(&self) {
        // What is not there any more need not be removed, and what cannot be is left: there is
        // nobody left to tell.
        match self {
            Self::Aside(path) => {
                let _ = fs::remove_dir_all(path);
            }
            Self::Made { folder, first } => {
                for ancestor in folder.ancestors() {
                    // Not empty: somebody else has put something there. What could not be made is
                    // not there.
                    if (ancestor.exists() && fs::remove_dir(ancestor).is_err()) || ancestor == first
                    {
                        break;
                    }
                }
            }
        }
    }
}

fn unfinished() -> MutexGuard<'static, Vec<Unfinished>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

fn begin(what: Unfinished) {
    unfinished().push(what);
}

fn end(list: &mut Vec<Unfinished>, what: &Unfinished) {
    list.retain(|other| other != what);
}

/// The exit code of a command that was stopped.
pub(super) const STOPPED: i32 = 130;

/// From here on Ctrl-C, and what else asks the command to end, first takes away what is unfinished.
///
/// # Errors
/// [`Error::System`] where the system does not say when somebody wants it.
pub(super) fn tidy_when_stopped() -> Result<()> {
    ctrlc::set_handler(|| {
        // Never given back: nothing is written any more.
        let list = unfinished();
        for what in list.iter().rev() {
            what.remove();
        }
        std::process::exit(STOPPED);
    })
    .map_err(|error| Error::system("Ctrl-C cannot be waited for", error))
}

/// A name beside a file or in a folder that no other call, and no other process, uses.
fn aside(folder: &Path, name: &str) -> PathBuf {
    static CALLS: AtomicUsize = AtomicUsize::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    folder.join(format!(".{name}-{}-{call}-partial", std::process::id()))
}

/// A folder that one run has for itself until this is dropped, where the system can lock folders
/// (Unix can).
#[derive(Debug)]
pub(super) struct FolderLock {
    _folder: Option<File>,
}

impl FolderLock {
    /// Waits until no other run has the folder.
    fn wait(folder: &Path) -> Self {
        let file = File::open(folder).ok();
        Self {
            _folder: file.filter(|file| file.lock().is_ok()),
        }
    }

    /// The folder, unless another run has it.
    ///
    /// # Errors
    /// [`Error::File`] if another run has it.
    pub(super) fn take(folder: &Path) -> Result<Self> {
        let Ok(file) = File::open(folder) else {
            return Ok(Self { _folder: None });
        };
        match file.try_lock() {
            Ok(()) => Ok(Self {
                _folder: Some(file),
            }),
            Err(fs::TryLockError::WouldBlock) => Err(Error::file(
                folder,
                "another run is writing there",
                "wait for it, or name another folder with --out",
            )),
            // No such locks here, on some networks' file systems.
            Err(fs::TryLockError::Error(_)) => Ok(Self { _folder: None }),
        }
    }
}

/// Files written aside as they come, and renamed into a folder when all of them are there.
#[derive(Debug)]
pub(super) struct OutputFolder {
    folder: PathBuf,
    /// To take away again on failure.
    made: Option<Unfinished>,
    /// Where the files lie until then: a folder that the first of them makes.
    aside: PathBuf,
    names: Vec<String>,
}

impl OutputFolder {
    /// Makes the folder where it is missing and makes sure that it takes files, before any work is
    /// done for it.
    pub(super) fn open(folder: &Path) -> Result<Self> {
        let first = folder
            .ancestors()
            .take_while(|ancestor| !ancestor.as_os_str().is_empty() && !ancestor.exists())
            .last();
        let made = first.map(|first| Unfinished::Made {
            folder: folder.to_path_buf(),
            first: first.to_path_buf(),
        });
        if let Some(made) = &made {
            begin(made.clone());
        }
        let output = Self {
            folder: folder.to_path_buf(),
            made,
            aside: aside(folder, "lobes"),
            names: Vec::new(),
        };
        begin(Unfinished::Aside(output.aside.clone()));
        let unwritable = |error: std::io::Error| {
            Error::file(
                folder,
                format!("the output folder cannot be written ({error})"),
                "name another one with --out",
            )
        };
        let list = unfinished();
        fs::create_dir_all(folder).map_err(unwritable)?;
        let probe = aside(folder, "lobes");
        fs::write(&probe, b"").map_err(unwritable)?;
        fs::remove_file(&probe).map_err(unwritable)?;
        drop(list);
        Ok(output)
    }

    /// Writes a file aside, by its path from the folder.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub(super) fn add(&mut self, name: impl Into<String>, bytes: impl AsRef<[u8]>) -> Result<()> {
        let name = name.into();
        let path = self.aside.join(&name);
        let _list = unfinished();
        make_parent(&path)
            .and_then(|()| fs::write(&path, bytes))
            .map_err(|error| self.unwritten(&name, &error))?;
        self.names.push(name);
        Ok(())
    }

    /// Renames what was written into place, one run at a time.
    ///
    /// # Errors
    /// [`Error::File`] where a file cannot be put there.
    pub(super) fn commit(mut self) -> Result<()> {
        let _lock = FolderLock::wait(&self.folder);
        let mut list = unfinished();
        for name in &self.names {
            let path = self.folder.join(name);
            make_parent(&path)
                .and_then(|()| fs::rename(self.aside.join(name), &path))
                .map_err(|error| self.unwritten(name, &error))?;
        }
        if let Some(made) = self.made.take() {
            end(&mut list, &made);
        }
        Ok(())
    }

    fn unwritten(&self, name: &str, error: &std::io::Error) -> Error {
        Error::file(
            self.folder.join(name),
            format!("cannot be written ({error})"),
            "make room or name another folder with --out",
        )
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        let aside = Unfinished::Aside(self.aside.clone());
        aside.remove();
        let mut list = unfinished();
        end(&mut list, &aside);
        if let Some(made) = self.made.take() {
            made.remove();
            end(&mut list, &made);
        }
    }
}

fn make_parent(path: &Path) -> std::io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)
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
    let aside = aside(path.parent().unwrap_or(Path::new("")), &name);
    // A device or a pipe is written to as it is; a rename would put a file in its place.
    if fs::metadata(path).is_ok_and(|data| !data.is_file()) {
        return fs::write(path, bytes).map_err(failed);
    }
    // Written and renamed, or not begun, when the command is stopped.
    let _list = unfinished();
    let result = fs::write(&aside, bytes).and_then(|()| fs::rename(&aside, path));
    if result.is_err() {
        let _ = fs::remove_file(&aside);
    }
    result.map_err(failed)
}

/// A sphere as linear EXR, black where there is none.
pub(crate) fn sphere_exr(image: &SphereImage) -> lobes::Result<Vec<u8>> {
    let size = image.size();
    let pixels = (0..size * size)
        .map(|i| image.get(i / size, i % size).unwrap_or_default())
        .collect();
    encode_exr(
        &files::Picture {
            width: size,
            height: size,
            pixels,
        },
        Precision::Single,
    )
}
