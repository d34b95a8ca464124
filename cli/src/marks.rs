//! Tables in Markdown files, between two marks.

use std::path::Path;

use crate::error::{Error, Result};
use crate::output::write_file;

/// The marks between which `--write` puts its table.
const MARKS: [&str; 2] = ["<!-- table -->", "<!-- end of table -->"];

/// Replaces what stands between the marks of a Markdown file.
pub(super) fn write_between_marks(path: &Path, text: &str) -> Result<()> {
    let failed = |problem: String| {
        Error::file(
            path,
            problem,
            format!(
                "name a Markdown file that has {:?} and {:?}",
                MARKS[0], MARKS[1]
            ),
        )
    };
    let old = std::fs::read_to_string(path)
        .map_err(|error| failed(format!("cannot be read ({error})")))?;
    let (before, rest) = old
        .split_once(MARKS[0])
        .ok_or_else(|| failed("has no place for the table".into()))?;
    let (_, after) = rest
        .split_once(MARKS[1])
        .ok_or_else(|| failed("has no end of its table".into()))?;
    let new = format!("{before}{}\n{text}{}{after}", MARKS[0], MARKS[1]);
    write_file(path, new.as_bytes())
}
