//! The `lobes` command: verbs, arguments, exit codes.

#![forbid(unsafe_code)]
#![expect(
    clippy::doc_markdown,
    reason = "the help's formulas are plain text, with subscripts"
)]

mod accuracy;
mod arguments;
mod ball_light;
mod classify;
mod console;
mod error;
mod evaluate;
mod finishes;
mod fit;
mod input;
mod lights;
mod list;
mod marks;
mod materials;
mod named;
mod output;
mod place;
mod probe;
mod progress;
mod render;
pub mod report;
mod reproduce;
mod spectrum;
mod training;
mod training_set;
mod trial;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use arguments::{Arguments, Verb};
pub use error::{Error, Result};

/// Runs the command with the process's arguments and gives its exit code: 0 for success, 1 for an
/// error in what it was given or met, 2 for a command line that it cannot read, 130 when it is
/// stopped.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    console::set(arguments.quiet, arguments.json);
    // A decompressor's panic that the reader of the file catches is an error, and is told as one.
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !lobes::files::is_guarded() {
            tell(panic);
        }
    }));
    let done = output::tidy_when_stopped().and_then(|()| run(&arguments));
    match done.and_then(|()| console::check()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::complain(format!("lobes: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.jobs.map_or(0, usize::from))
        .build()
        .map_err(|error| Error::system("no threads to work with", error))?;
    pool.install(|| match &arguments.verb {
        Verb::Reproduce(options) => reproduce::run(options),
        Verb::Classify(options) => classify::run(options),
        Verb::Spectrum(options) => spectrum::run(options),
        Verb::Render(options) => render::run(options),
        Verb::Evaluate(options) => evaluate::run(options),
        Verb::Probe(options) => probe::run(options),
        Verb::Fit(options) => fit::run(options),
        Verb::List(options) => list::run(options),
        Verb::Accuracy(options) => accuracy::run(options),
        Verb::Finishes(options) => finishes::run(options),
        Verb::Completions(options) => {
            let mut bytes = Vec::new();
            clap_complete::generate(
                options.shell,
                &mut Arguments::command(),
                "lobes",
                &mut bytes,
            );
            console::bytes(&bytes);
            Ok(())
        }
        Verb::Man(options) => man(options.verb.as_deref()),
    })
}

/// Prints the manual page of the command or of one of its verbs.
fn man(verb: Option<&str>) -> Result<()> {
    let mut command = Arguments::command();
    // Names the verbs' pages `lobes-render`, and gives them the options that all have.
    command.build();
    let page = match verb {
        None => command,
        Some(verb) => match command.find_subcommand(verb) {
            Some(page) => page.clone(),
            None => {
                let verbs: Vec<&str> = command.get_subcommands().map(|v| v.get_name()).collect();
                return Err(Error::request(
                    format!("there is no verb {verb:?}"),
                    format!("the verbs are {}", verbs.join(", ")),
                ));
            }
        },
    };
    let mut bytes = Vec::new();
    clap_mangen::Man::new(page)
        .render(&mut bytes)
        .map_err(|error| Error::system("the page cannot be made", error))?;
    console::bytes(&bytes);
    Ok(())
}

/// A name as part of a file's.
fn slug(name: &str) -> String {
    let keep = |c: char| if c.is_alphanumeric() { c } else { '-' };
    name.to_lowercase().chars().map(keep).collect()
}

/// What the command reads besides light, from bytes: for the fuzzers and their corpora, and no part
/// of the interface.
#[doc(hidden)]
pub mod readers {
    use std::path::Path;

    use crate::error::Result;
    use lobes::picture::Picture;

    /// The materials of a TOML file: how many.
    pub fn materials(text: &str) -> Result<usize> {
        super::materials::parse(Path::new("bytes"), text).map(|materials| materials.len())
    }

    /// The description of a training set.
    pub fn set(text: &str) -> Result<()> {
        super::training_set::parse(Path::new("bytes"), text).map(drop)
    }

    /// The sphere in a picture: how much of it is saturated.
    pub fn photograph(bytes: &[u8]) -> Result<f64> {
        let picture = Picture::from_bytes(bytes)?;
        Ok(picture.sphere(picture.circle()?)?.saturated)
    }
}
