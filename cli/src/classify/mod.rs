//! `lobes classify`: the finish and the reflectance of the ball in a picture, and its name.

mod ball;
mod light_page;
mod pages;
mod shape;
mod words;

use std::path::{Path, PathBuf};

use serde_json::json;

use self::ball::{Ball, Readers};
use self::pages::Pages;
use self::words::{NO_SINGLE_FINISH, NONE_OF_THESE, line_of_json, sentence};
use crate::arguments::Classify;
use crate::ball_light::LightMaps;
use crate::error::{Error, Result};
use crate::{console, input, lights, materials, progress, training};
use lobes::Parallelism;
use lobes::exchange::{self, Format};
use lobes::inference::{FinishModel, FinishVerdict, Model, Verdict};
use lobes::picture::ShapeBall;
use lobes::reflectance::{Finish, Material};

/// A ball to tell of, or why nothing is told: the `which`th of `of` in a file.
struct Entry<'a> {
    /// Of the file, from 1 on.
    number: usize,
    path: &'a Path,
    which: usize,
    of: usize,
    ball: Result<Ball>,
}

impl Entry<'_> {
    /// The name of its file, and which ball of several it is.
    fn named(&self, file: &str) -> String {
        if self.of > 1 {
            format!("{file}, ball {} of {}", self.which, self.of)
        } else {
            file.to_owned()
        }
    }
}

/// What is said of a ball.
struct Answer {
    finish: FinishVerdict,
    name: Option<Verdict>,
}

/// What balls are judged by.
struct Judge {
    readers: Readers,
    finishes: FinishModel,
    /// Learned where names are asked for, once there is something to name.
    names: Option<Model>,
}

impl Judge {
    fn answer(&self, ball: &Ball) -> Result<Answer> {
        let name = self.names.as_ref().zip(ball.features.as_ref());
        Ok(Answer {
            finish: self.finishes.verdict(&ball.portrait)?,
            name: name
                .map(|(model, features)| model.verdict(features))
                .transpose()?,
        })
    }
}

/// So many pictures are read, judged and told at a time: what is kept of them does not grow with
/// how many there are.
const AT_A_TIME: usize = 128;

pub(super) fn run(options: &Classify) -> Result<()> {
    let paths = expand(&options.images)?;
    let materials = if options.wants_names() {
        materials::load(&options.materials)?
    } else {
        Vec::new()
    };
    let mut pages = Pages::new(options)?;
    let mut judge = Judge {
        readers: Readers::new()?,
        finishes: FinishModel::builtin()?,
        names: None,
    };
    let alone = paths.len() == 1;
    if options.light.is_some() && !alone {
        return Err(Error::request(
            format!(
                "--light writes the light about one ball, and {} pictures are given",
                paths.len()
            ),
            "give one",
        ));
    }
    if options.shape.normals.is_some() && !alone {
        return Err(Error::request(
            format!(
                "--normals gives the shape in one picture, and {} are given",
                paths.len()
            ),
            "give one",
        ));
    }
    let shape = shape::read(options, &paths[0])?;
    if let Some(part) = shape.as_ref().filter(|ball| ball.reach < ShapeBall::WHOLE) {
        return shape::tell_part(part, &paths[0], options);
    }
    let (mut failed, mut total, mut problem) = (0, 0, None);
    let mut counts = Counts::new(&materials);
    let mut exported = Vec::new();
    let bar = progress::bar(paths.len(), "pictures");
    for (turn, paths) in paths.chunks(AT_A_TIME).enumerate() {
        let balls = Parallelism::Rayon.map(paths.len(), |i| {
            let balls = ball::read(&paths[i], options, &judge.readers, shape.as_ref());
            bar.inc(1);
            balls.unwrap_or_else(|error| vec![Err(error)])
        });
        let mut entries = Vec::new();
        for (i, (path, balls)) in paths.iter().zip(balls).enumerate() {
            let of = balls.len();
            for (ball, which) in balls.into_iter().zip(1..) {
                let number = AT_A_TIME * turn + i + 1;
                entries.push(Entry {
                    number,
                    path,
                    which,
                    of,
                    ball,
                });
            }
        }
        total += entries.len();
        // Learning takes a while: not where there is nothing to name.
        let nameable = options.wants_names() && entries.iter().any(|entry| entry.ball.is_ok());
        if nameable && judge.names.is_none() {
            judge.names = Some(bar.suspend(|| learn(options, &materials))?);
        }
        let answers = Parallelism::Rayon.map(entries.len(), |i| match &entries[i].ball {
            Ok(ball) => judge.answer(ball),
            Err(error) => Err(error.clone()),
        });
        for (entry, answer) in entries.iter().zip(&answers) {
            let read = match (&entry.ball, answer) {
                (Ok(ball), Ok(answer)) => Ok((ball, answer)),
                (Err(error), _) | (_, Err(error)) => Err(error),
            };
            let mut light = None;
            match read {
                Err(error) => {
                    failed += 1;
                    problem = Some(of_file(entry.path, error));
                }
                Ok((ball, answer)) => {
                    counts.add(answer);
                    if let (Some(path), Some(image)) = (&options.light, &ball.image) {
                        let read = LightMaps::read(image, &answer.finish)?;
                        read.write(path)?;
                        light = Some(read);
                    }
                    if options.pbr.is_some() {
                        let name = entry.named(&input::name(entry.path));
                        exported.push(answer.finish.likeliest_material(&name)?);
                    }
                }
            }
            bar.suspend(|| tell(entry, &read, &materials, alone))?;
            pages.add(entry, &read, &materials, light.as_ref())?;
        }
    }
    bar.finish_and_clear();
    let summary = counts.summary(failed, if options.all { "balls" } else { "pictures" });
    if !alone || total > 1 {
        console::answer(&summary);
    }
    if let Some(path) = options.pbr.as_deref().filter(|_| !exported.is_empty()) {
        export(path, &exported)?;
    }
    pages.finish(&summary)?;
    match problem {
        None => Ok(()),
        Some(problem) if alone && total == 1 => Err(problem),
        Some(_) => Err(Error::Partly {
            failed,
            total,
            what: if options.all {
                "balls and pictures were not classified"
            } else {
                "pictures were not classified"
            }
            .into(),
        }),
    }
}

/// Writes materials for the program that the file's ending names, and says what it cannot express.
fn export(path: &Path, materials: &[Material]) -> Result<()> {
    // The ending was looked at when the command line was read.
    let format = Format::of_path(path).unwrap_or(Format::Gltf);
    let written = exchange::write(format, materials)?;
    crate::output::write_file(path, written.text.as_bytes())?;
    for note in &written.notes {
        console::note(note.to_string());
    }
    console::note(format!("wrote {}", path.display()));
    Ok(())
}

fn learn(options: &Classify, materials: &[Material]) -> Result<Model> {
    let (maps, scenes) = lights::load(&options.lights)?;
    let (lobe, turns) = (options.lobe.name, options.turns.get());
    let mut training = training::load(&maps, materials, lobe, turns, options.fresh)?;
    training.named.scenes = scenes;
    Ok(Model::learn(&training, Parallelism::Rayon)?)
}

/// What was read of a picture, or why nothing was.
type Read<'a> = std::result::Result<(&'a Ball, &'a Answer), &'a Error>;

/// Says what a picture shows, or what is wrong with it: of one that is alone the command itself
/// says that.
fn tell(entry: &Entry, read: &Read, learned: &[Material], alone: bool) -> Result<()> {
    let name = input::name(entry.path);
    match read {
        Ok((ball, answer)) => {
            console::json(&line_of_json(entry, ball, answer, learned))?;
            let sentence = sentence(ball, answer, learned, entry.of > 1);
            console::answer(format!("{}: {sentence}", entry.named(&name)));
        }
        Err(error) => {
            let error = of_file(entry.path, error).to_string();
            console::json(&json!({ "file": name, "error": error }))?;
            let by_the_end = alone && entry.of == 1;
            if !console::is_json() && !by_the_end {
                console::complain(format!("lobes: {error}"));
            }
        }
    }
    Ok(())
}

/// The error with the file that it is about.
fn of_file(path: &Path, error: &Error) -> Error {
    input::error_of(path, error.clone())
}

/// The files, folders replaced by the pictures in them.
fn expand(images: &[PathBuf]) -> Result<Vec<PathBuf>> {
    const ENDINGS: [&str; 10] = [
        "png", "jpg", "jpeg", "webp", "tif", "tiff", "exr", "hdr", "pic", "pfm",
    ];
    let mut paths = Vec::new();
    for image in images {
        if !image.is_dir() {
            paths.push(image.clone());
            continue;
        }
        let unreadable = |error: std::io::Error| {
            Error::file(
                image,
                format!("the folder cannot be read ({error})"),
                "name another",
            )
        };
        let mut of_folder = Vec::new();
        for entry in std::fs::read_dir(image).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
            if ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) {
                of_folder.push(path);
            }
        }
        if of_folder.is_empty() {
            return Err(Error::file(
                image,
                "the folder holds no picture",
                format!(
                    "put some there, {}",
                    ENDINGS.map(|e| format!(".{e}")).join(" ")
                ),
            ));
        }
        of_folder.sort();
        paths.extend(of_folder);
    }
    Ok(paths)
}

/// How many pictures show what: by name where names are asked for, else by finish.
struct Counts {
    names: Vec<String>,
    of_names: bool,
    /// Of each of the names, and of none.
    counts: Vec<usize>,
}

impl Counts {
    fn new(materials: &[Material]) -> Self {
        let of_names = !materials.is_empty();
        let mut names: Vec<String> = if of_names {
            materials.iter().map(|m| m.name().to_owned()).collect()
        } else {
            Finish::ALL
                .iter()
                .map(|finish| finish.name().to_owned())
                .collect()
        };
        names.push(
            if of_names {
                NONE_OF_THESE
            } else {
                NO_SINGLE_FINISH
            }
            .to_owned(),
        );
        Self {
            counts: vec![0; names.len()],
            names,
            of_names,
        }
    }

    fn add(&mut self, answer: &Answer) {
        let place = if self.of_names {
            answer.name.as_ref().and_then(Verdict::material)
        } else {
            answer.finish.finish().map(Finish::index)
        };
        self.counts[place.unwrap_or(self.names.len() - 1)] += 1;
    }

    fn summary(&self, failed: usize, what: &str) -> String {
        let mut most: Vec<(usize, &String)> =
            self.counts.iter().copied().zip(&self.names).collect();
        most.retain(|(count, _)| *count > 0);
        most.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let mut parts: Vec<String> = most.iter().map(|(n, name)| format!("{n} {name}")).collect();
        if failed > 0 {
            parts.push(format!("{failed} not read"));
        }
        let total = self.counts.iter().sum::<usize>() + failed;
        format!("{total} {what}: {}", parts.join(", "))
    }
}
