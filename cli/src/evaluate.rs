//! `lobes evaluate`: how far estimated light is from the truth.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use comfy_table::{CellAlignment, Table, presets};
use serde::{Deserialize, Serialize};
use serde_json::json;
use sha2::{Digest, Sha256};

use crate::arguments::Evaluate;
use crate::error::{Error, Result};
use crate::output::{FolderLock, OutputFolder, write_file};
use crate::report::{Figure, Image, Inline, Page, difference};
use crate::{console, progress};
use lobes::Parallelism;
use lobes::evaluation::{Evaluator, LIGHT_MEASURES, Protocol};
use lobes::illumination::{self, EnvironmentMap, Luminance};
use lobes::picture::encode_png;
use lobes::reflection::SphereImage;

/// The endings of maps in a folder.
const ENDINGS: [&str; 4] = ["exr", "hdr", "pic", "pfm"];

/// The most bytes of a map's file.
const MOST_BYTES: u64 = 1 << 31;

/// One truth and one estimate of it.
struct Pair {
    scene: String,
    /// Whose estimate it is: the place among the estimates that were given.
    estimate: usize,
    truth: PathBuf,
    path: PathBuf,
}

/// The errors of one pair, as they are kept.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Errors {
    /// By ball and by measure, in the protocol's order.
    balls: Vec<Vec<f64>>,
    /// In the order of `LIGHT_MEASURES`.
    light: Vec<f64>,
}

pub(super) fn run(options: &Evaluate) -> Result<()> {
    let protocol = options.preset.protocol_with_rows(options.rows)?;
    let names = names(&options.estimates);
    let (pairs, mut problems) = pairs(options, &names)?;
    let output = OutputFolder::open(&options.out)?;
    let done = options.out.join("done");
    let lock = FolderLock::take(&options.out)?;
    let evaluator = Evaluator::new(protocol, options.size, Parallelism::Rayon)?;
    let bar = progress::bar(pairs.len(), "pairs");
    let results = Parallelism::Rayon.map(pairs.len(), |i| {
        let result = compare(options, &pairs[i], &evaluator, &done);
        bar.inc(1);
        result
    });
    bar.finish_and_clear();
    drop(lock);
    let mut errors: Vec<(&Pair, Errors)> = Vec::new();
    let total = pairs.len() + problems.len();
    for (pair, result) in pairs.iter().zip(results) {
        match result {
            Ok(of_pair) => errors.push((pair, of_pair)),
            Err(error) => problems.push((pair.scene.clone(), names[pair.estimate].clone(), error)),
        }
    }
    if total == 1
        && let Some((_, _, error)) = problems.pop()
    {
        return Err(error);
    }
    for (scene, estimate, error) in &problems {
        console::json(
            &json!({ "scene": scene, "estimate": estimate, "error": error.to_string() }),
        )?;
        console::complain(format!("lobes: {error}"));
    }
    if !errors.is_empty() {
        answer(options, &evaluator, &names, &errors, output)?;
    }
    if problems.is_empty() {
        Ok(())
    } else {
        Err(Error::Partly {
            failed: problems.len(),
            total,
            what: "pairs were not compared, for the reasons above".into(),
        })
    }
}

/// What the estimates are called: their files' names, or their paths where two have one name.
fn names(estimates: &[PathBuf]) -> Vec<String> {
    let short: Vec<String> = estimates
        .iter()
        .map(|path| {
            let stem = if path.is_dir() {
                path.file_name()
            } else {
                path.file_stem()
            };
            stem.unwrap_or(path.as_os_str())
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    let twice = |name: &String| short.iter().filter(|other| *other == name).count() > 1;
    if short.iter().any(twice) {
        estimates
            .iter()
            .map(|path| path.display().to_string())
            .collect()
    } else {
        short
    }
}

/// The maps of a folder by their names.
fn maps_of(folder: &Path) -> Result<BTreeMap<String, PathBuf>> {
    let unlisted = |error: std::io::Error| {
        Error::file(
            folder,
            format!("the folder cannot be listed ({error})"),
            "give a folder of environment maps",
        )
    };
    let mut maps = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(unlisted)? {
        let path = entry.map_err(unlisted)?.path();
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        if !ENDINGS.contains(&ending.to_lowercase().as_str()) || name.starts_with('.') {
            continue;
        }
        let name = name.into_owned();
        if let Some(other) = maps.insert(name, path.clone()) {
            return Err(Error::file(
                &path,
                format!("has the name of {}", other.display()),
                "rename one of the two",
            ));
        }
    }
    if maps.is_empty() {
        return Err(Error::file(
            folder,
            "the folder holds no environment map",
            "put .exr, .hdr, .pic or .pfm files into it",
        ));
    }
    Ok(maps)
}

/// What could not be compared: the scene, whose estimate, and why.
type Problem = (String, String, Error);

/// The pairs by name, and what has no partner.
fn pairs(options: &Evaluate, names: &[String]) -> Result<(Vec<Pair>, Vec<Problem>)> {
    let (mut pairs, mut problems) = (Vec::new(), Vec::new());
    if !options.truth.is_dir() {
        for (estimate, path) in options.estimates.iter().enumerate() {
            if path.is_dir() {
                return Err(Error::request(
                    format!(
                        "the truth {} is a file and the estimate {} a folder",
                        options.truth.display(),
                        path.display()
                    ),
                    "give two maps or two folders",
                ));
            }
            pairs.push(Pair {
                scene: options
                    .truth
                    .file_stem()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned(),
                estimate,
                truth: options.truth.clone(),
                path: path.clone(),
            });
        }
        return Ok((pairs, problems));
    }
    let truths = maps_of(&options.truth)?;
    for (estimate, folder) in options.estimates.iter().enumerate() {
        if !folder.is_dir() {
            return Err(Error::request(
                format!(
                    "the truth {} is a folder and the estimate {} is none",
                    options.truth.display(),
                    folder.display()
                ),
                "give two maps or two folders",
            ));
        }
        let estimates = maps_of(folder)?;
        for (scene, truth) in &truths {
            match estimates.get(scene) {
                Some(path) => pairs.push(Pair {
                    scene: scene.clone(),
                    estimate,
                    truth: truth.clone(),
                    path: path.clone(),
                }),
                None => problems.push((
                    scene.clone(),
                    names[estimate].clone(),
                    Error::file(
                        truth,
                        format!("has no estimate of its name in {}", folder.display()),
                        "add it, or take the truth away",
                    ),
                )),
            }
        }
        for (scene, path) in &estimates {
            if !truths.contains_key(scene) {
                problems.push((
                    scene.clone(),
                    names[estimate].clone(),
                    Error::file(
                        path,
                        format!("has no truth of its name in {}", options.truth.display()),
                        "add it, or take the estimate away",
                    ),
                ));
            }
        }
    }
    Ok((pairs, problems))
}

fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    let unread = |problem: String| Error::file(path, problem, "name a map that can be read");
    let length = std::fs::metadata(path)
        .map_err(|error| unread(format!("cannot be read ({error})")))?
        .len();
    if length > MOST_BYTES {
        return Err(unread(format!("has more than {MOST_BYTES} bytes")));
    }
    std::fs::read(path).map_err(|error| unread(format!("cannot be read ({error})")))
}

/// The two maps of a pair.
fn maps(options: &Evaluate, pair: &Pair) -> Result<[EnvironmentMap; 2]> {
    let read = |path: &Path| -> Result<EnvironmentMap> {
        Ok(illumination::read_bytes(
            path,
            &bytes_of(path)?,
            options.mapping,
        )?)
    };
    Ok([read(&pair.truth)?, read(&pair.path)?])
}

/// The errors of a pair: those of an earlier run, where nothing has changed since.
fn compare(options: &Evaluate, pair: &Pair, evaluator: &Evaluator, done: &Path) -> Result<Errors> {
    let mut hash = Sha256::new();
    for path in [&pair.truth, &pair.path] {
        let bytes = bytes_of(path)?;
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    hash.update(format!(
        "{} {} {:?} {:?} {}",
        options.preset,
        options.size,
        options.rows,
        options.mapping,
        env!("CARGO_PKG_VERSION")
    ));
    let key: String = hash.finalize()[..16]
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let kept = done.join(format!("{key}.json"));
    if !options.fresh
        && let Ok(text) = std::fs::read_to_string(&kept)
        && let Ok(errors) = serde_json::from_str::<Errors>(&text)
        && errors.balls.len() == evaluator.protocol().balls.len()
        && errors.light.len() == LIGHT_MEASURES.len()
    {
        return Ok(errors);
    }
    let [truth, estimate] = maps(options, pair)?;
    let evaluation = evaluator
        .evaluate(&truth, &estimate, Parallelism::Sequential)
        .map_err(|error| match error {
            lobes::Error::DifferentSizes { .. } => error.into(),
            error => Error::of(
                format!("{} and {}", pair.truth.display(), pair.path.display()),
                error,
            ),
        })?;
    let errors = Errors {
        balls: evaluation.balls,
        light: evaluation.light.values().to_vec(),
    };
    let text = serde_json::to_string(&errors)
        .map_err(|error| Error::system("the errors have no JSON form", error))?;
    // With the first of them: where nothing can be compared nothing is left behind.
    std::fs::create_dir_all(done).map_err(|error| {
        Error::file(
            done,
            format!("the folder cannot be made ({error})"),
            "name another one with --out",
        )
    })?;
    write_file(&kept, text.as_bytes())?;
    Ok(errors)
}

/// The averages of one estimate over its scenes.
struct Summary {
    scenes: usize,
    balls: Vec<Vec<f64>>,
    light: Vec<f64>,
}

fn summary(protocol: &Protocol, errors: &[&Errors]) -> Summary {
    let average = |get: &dyn Fn(&Errors) -> f64| {
        let values: Vec<f64> = errors.iter().map(|errors| get(errors)).collect();
        protocol.average.of(&values).unwrap_or(f64::NAN)
    };
    let balls = (0..protocol.balls.len()).map(|ball| {
        let measures = 0..protocol.measures.len();
        measures
            .map(|i| average(&|errors| errors.balls[ball][i]))
            .collect()
    });
    Summary {
        scenes: errors.len(),
        balls: balls.collect(),
        light: (0..LIGHT_MEASURES.len())
            .map(|i| average(&|errors| errors.light[i]))
            .collect(),
    }
}

fn by_ball(protocol: &Protocol, balls: &[Vec<f64>]) -> serde_json::Value {
    let of_ball = |values: &[f64]| {
        let measures = protocol.measures.iter().zip(values);
        let fields = measures.map(|(measure, value)| (measure.name().to_owned(), json!(value)));
        serde_json::Value::Object(fields.collect())
    };
    let balls = protocol.balls.iter().zip(balls);
    let fields = balls.map(|(ball, values)| (ball.name.to_owned(), of_ball(values)));
    serde_json::Value::Object(fields.collect())
}

fn by_light(values: &[f64]) -> serde_json::Value {
    let fields = LIGHT_MEASURES.iter().zip(values);
    let fields = fields.map(|((name, _), value)| ((*name).to_owned(), json!(value)));
    serde_json::Value::Object(fields.collect())
}

fn number(value: f64) -> String {
    if value.abs() < 0.001 && value != 0.0 {
        format!("{value:.1e}")
    } else if value.abs() < 10.0 {
        format!("{value:.4}")
    } else {
        format!("{value:.2}")
    }
}

/// A word as a cell of CSV.
fn cell(word: &str) -> String {
    if word.contains([',', '"', '\n']) {
        format!("\"{}\"", word.replace('"', "\"\""))
    } else {
        word.to_owned()
    }
}

/// What is printed, what is written, and the page.
fn answer(
    options: &Evaluate,
    evaluator: &Evaluator,
    names: &[String],
    errors: &[(&Pair, Errors)],
    mut output: OutputFolder,
) -> Result<()> {
    let protocol = evaluator.protocol();
    let mut csv = String::from("scene,estimate,ball,measure,value\n");
    for (pair, of_pair) in errors {
        let mut line = |ball: &str, measure: &str, value: f64| {
            let words = [&pair.scene, &names[pair.estimate], ball, measure].map(cell);
            csv.push_str(&format!("{},{value}\n", words.join(",")));
        };
        for (ball, values) in protocol.balls.iter().zip(&of_pair.balls) {
            for (measure, value) in protocol.measures.iter().zip(values) {
                line(ball.name, measure.name(), *value);
            }
        }
        for ((measure, _), value) in LIGHT_MEASURES.iter().zip(&of_pair.light) {
            line("", measure, *value);
        }
        console::json(&json!({
            "scene": pair.scene,
            "estimate": names[pair.estimate],
            "balls": by_ball(protocol, &of_pair.balls),
            "light": by_light(&of_pair.light),
        }))?;
    }
    let all_definitions: Vec<(&str, &str)> = protocol
        .measures
        .iter()
        .map(|measure| (measure.name(), measure.definition()))
        .chain(LIGHT_MEASURES)
        .collect();
    let definitions: serde_json::Map<String, serde_json::Value> = all_definitions
        .iter()
        .map(|(name, what)| ((*name).to_owned(), json!(what)))
        .collect();
    let mut summaries = Vec::new();
    let mut objects = Vec::new();
    for (estimate, name) in names.iter().enumerate() {
        let own = errors.iter().filter(|(pair, _)| pair.estimate == estimate);
        let own: Vec<&Errors> = own.map(|(_, errors)| errors).collect();
        if own.is_empty() {
            continue;
        }
        let summary = summary(protocol, &own);
        objects.push(json!({
            "estimate": name,
            "preset": options.preset.name(),
            "scenes": summary.scenes,
            "average": protocol.average.name(),
            "balls": by_ball(protocol, &summary.balls),
            "light": by_light(&summary.light),
            "definitions": definitions,
        }));
        summaries.push((name, summary));
    }
    for object in &objects {
        console::json(object)?;
    }
    let measures = protocol.measures.iter().map(|measure| measure.name());
    let measures: Vec<&str> = measures.collect();
    let (mut of_balls, mut of_light) = (Vec::new(), Vec::new());
    for (name, summary) in &summaries {
        for (ball, values) in protocol.balls.iter().zip(&summary.balls) {
            let mut row = vec![(*name).clone(), ball.name.to_owned()];
            row.extend(values.iter().map(|value| number(*value)));
            of_balls.push(row);
        }
        let mut row = vec![(*name).clone(), summary.scenes.to_string()];
        row.extend(summary.light.iter().map(|value| number(*value)));
        of_light.push(row);
    }
    let ball_headings = [&["estimate", "ball"], &measures[..]].concat();
    let light_names: Vec<&str> = LIGHT_MEASURES.iter().map(|(name, _)| *name).collect();
    let light_headings = [&["estimate", "scenes"], &light_names[..]].concat();
    console::answer(table(&ball_headings, &of_balls).to_string());
    console::answer(table(&light_headings, &of_light).to_string());
    let about = format!(
        "{}: {}; scenes: {}.",
        options.preset,
        options.preset.description(),
        summaries.iter().map(|(_, s)| s.scenes).max().unwrap_or(0)
    );
    console::answer(&about);
    for (name, what) in &all_definitions {
        console::answer(format!("{name}: {what}."));
    }
    output.add("errors.csv", csv)?;
    let text = serde_json::to_string_pretty(&objects)
        .map_err(|error| Error::system("the summary has no JSON form", error))?;
    output.add("summary.json", text + "\n")?;
    let mut page = Page::new("Estimated light against the truth", &[Inline::Text(&about)]);
    let numbers = |headings: &[&str]| -> Vec<String> {
        let mark = |(i, name): (usize, &&str)| format!("{name}{}", if i < 1 { "" } else { "#" });
        headings.iter().enumerate().map(mark).collect()
    };
    let strong = |rows: &[Vec<String>]| -> Vec<(&'static str, Vec<String>)> {
        rows.iter().map(|row| ("", row.clone())).collect()
    };
    let headings = numbers(&ball_headings);
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    page.table(
        "Errors of the balls' pictures",
        &headings,
        &strong(&of_balls),
    );
    let headings = numbers(&light_headings);
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    page.table("Errors of the maps", &headings, &strong(&of_light));
    page.heading("What the errors are");
    page.meanings(&all_definitions);
    figures(options, evaluator, names, errors, &mut page)?;
    let version = format!("lobes {}", env!("CARGO_PKG_VERSION"));
    output.add("index.html", page.html(&[Inline::Text(&version)]))?;
    output.commit()?;
    console::note(format!(
        "wrote {}",
        options.out.join("index.html").display()
    ));
    Ok(())
}

fn table(headings: &[&str], rows: &[Vec<String>]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(headings);
    for row in rows {
        table.add_row(row);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// The balls of some scenes side by side, worst first.
fn figures(
    options: &Evaluate,
    evaluator: &Evaluator,
    names: &[String],
    errors: &[(&Pair, Errors)],
    page: &mut Page,
) -> Result<()> {
    let protocol = evaluator.protocol();
    for (estimate, name) in names.iter().enumerate() {
        // The mean over the balls of the first measure.
        let mut own: Vec<(f64, &Pair)> = errors
            .iter()
            .filter(|(pair, _)| pair.estimate == estimate)
            .map(|(pair, of_pair)| {
                let sum: f64 = of_pair.balls.iter().map(|values| values[0]).sum();
                (sum / of_pair.balls.len() as f64, *pair)
            })
            .collect();
        if own.is_empty() || options.shown == 0 {
            continue;
        }
        own.sort_by(|a, b| b.0.total_cmp(&a.0));
        let count = own.len();
        own.truncate(options.shown);
        page.heading(name);
        let balls = protocol.balls.iter().map(|ball| ball.name);
        page.paragraph(&format!(
            "Scenes by their errors, the worst first ({} of {count}; {}, mean of the balls). Balls from the left: {}. Rows: \
             the truth; the estimate; their difference in luminance, red where the estimate is too bright and blue where it is too dark, \
             full colour at the brightness of white in the picture.",
            own.len(),
            protocol.measures[0].name(),
            balls.collect::<Vec<_>>().join(", ")
        ));
        let strips = Parallelism::Rayon.map(own.len(), |i| strip(options, evaluator, own[i].1));
        let mut shown = Vec::new();
        for ((error, pair), strip) in own.iter().zip(strips) {
            let (png, size) = strip?;
            shown.push(Figure {
                images: vec![Image::inside(
                    &png,
                    format!("The balls of {} under the true light, under that of {name}, and the difference", pair.scene),
                    size,
                )],
                caption: vec![
                    pair.scene.clone(),
                    format!("{} {}", protocol.measures[0].name(), number(*error)),
                ],
            });
        }
        page.grid(280, &shown);
    }
    Ok(())
}

/// Truth, estimate and difference under one another, ball by ball, and the picture's size.
fn strip(
    options: &Evaluate,
    evaluator: &Evaluator,
    pair: &Pair,
) -> Result<(Vec<u8>, (usize, usize))> {
    let [truth, estimate] = maps(options, pair)?;
    let one = Parallelism::Sequential;
    let (of_truth, of_estimate) = (
        evaluator.pictures(&truth, one)?,
        evaluator.pictures(&estimate, one)?,
    );
    let light = evaluator.protocol().prepare(&truth)?;
    let exposure = 0.5 / Luminance::Rec709.of(light.mean());
    let (cell, margin) = (options.size, options.size / 16);
    let step = cell + margin;
    let size = (of_truth.len() * step + margin, 3 * step + margin);
    let seen = |images: &[SphereImage], ball: usize, row: usize, column: usize| {
        let pixel = images[ball].get(row, column)?;
        Some(pixel.map(|value| exposure * value))
    };
    let png = encode_png(size.0, size.1, 1.0, |row, column| {
        let (row, column) = (row.checked_sub(margin)?, column.checked_sub(margin)?);
        let (line, ball) = (row / step, column / step);
        let (row, column) = (row % step, column % step);
        if row >= cell || column >= cell || line > 2 || ball >= of_truth.len() {
            return None;
        }
        match line {
            0 => seen(&of_truth, ball, row, column),
            1 => seen(&of_estimate, ball, row, column),
            _ => {
                let t = Luminance::Rec709.of(seen(&of_truth, ball, row, column)?);
                let e = Luminance::Rec709.of(seen(&of_estimate, ball, row, column)?);
                Some(difference(e - t))
            }
        }
    })?;
    Ok((png, size))
}
