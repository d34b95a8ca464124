//! The `lobes` command: verbs, arguments, exit codes.

#![expect(
    clippy::doc_markdown,
    reason = "the help's formulas are plain text, with subscripts"
)]

mod accuracy;
mod arguments;
mod classify;
mod fit;
mod lights;
mod materials;
mod output;
mod photo;
mod progress;
mod render;
mod reproduce;
mod spectrum;
mod training;
mod training_set;

use std::process::ExitCode;

use clap::Parser;

use crate::Result;
use arguments::{Arguments, Verb};

/// Runs the command with the process's arguments and gives its exit code: 0 for success, 1 for an
/// error in what it was given or met, 2 for a command line that it cannot read.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lobes: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.jobs.map_or(0, usize::from))
        .build()
        .map_err(|error| crate::Error::Unanswerable(format!("no threads to work with: {error}")))?;
    pool.install(|| match &arguments.verb {
        Verb::Reproduce(options) => reproduce::run(options),
        Verb::Classify(options) => classify::run(options),
        Verb::Spectrum(options) => spectrum::run(options),
        Verb::Render(options) => render::run(options),
        Verb::Fit(options) => fit::run(options),
        Verb::Accuracy(options) => accuracy::run(options),
    })
}

/// A name as part of a file's.
fn slug(name: &str) -> String {
    let keep = |c: char| if c.is_alphanumeric() { c } else { '-' };
    name.to_lowercase().chars().map(keep).collect()
}
