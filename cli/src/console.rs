//! What the command says: answers on standard output, everything else on standard error.

use std::io::{ErrorKind, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use crate::error::{Error, Result};

static QUIET: AtomicBool = AtomicBool::new(false);
static JSON: AtomicBool = AtomicBool::new(false);
/// The first failure of standard output.
static FAILURE: OnceLock<String> = OnceLock::new();

/// What the command line asks of everything that is said.
pub(super) fn set(quiet: bool, json: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
    JSON.store(json, Ordering::Relaxed);
}

/// Whether answers are JSON.
pub(super) fn is_json() -> bool {
    JSON.load(Ordering::Relaxed)
}

/// Whether only answers and errors are wanted.
pub(super) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// An answer for people; nothing under `--json`.
pub(super) fn answer(text: impl AsRef<str>) {
    if !is_json() {
        line(text.as_ref());
    }
}

/// An answer for programs: a line of JSON; nothing without `--json`.
///
/// # Errors
/// [`Error::System`] for what has no JSON form.
pub(super) fn json(value: &impl Serialize) -> Result<()> {
    if is_json() {
        line(
            &serde_json::to_string(value)
                .map_err(|error| Error::system("the answer has no JSON form", error))?,
        );
    }
    Ok(())
}

/// Something that a person may want to know: what was written, and where.
pub(super) fn note(text: impl AsRef<str>) {
    if !is_json() && !is_quiet() {
        complain(text);
    }
}

/// Bytes as they are: a man page, completions.
pub(super) fn bytes(bytes: &[u8]) {
    write(bytes);
}

/// Something that is wrong, but does not end the command.
pub(super) fn complain(text: impl AsRef<str>) {
    // Where there is no standard error there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "{}", text.as_ref());
}

fn line(text: &str) {
    let mut text = text.to_owned();
    text.push('\n');
    write(text.as_bytes());
}

fn write(bytes: &[u8]) {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(bytes).and_then(|()| out.flush());
    match written {
        // Whoever reads it has read enough (`lobes spectrum | head`); the files are still written.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {}
        Err(error) => {
            FAILURE.get_or_init(|| error.to_string());
        }
        Ok(()) => {}
    }
}

/// Whether everything was said.
///
/// # Errors
/// [`Error::Output`] where standard output took not all of it.
pub(super) fn check() -> Result<()> {
    match FAILURE.get() {
        None => Ok(()),
        Some(problem) => Err(Error::Output {
            problem: problem.clone(),
        }),
    }
}
