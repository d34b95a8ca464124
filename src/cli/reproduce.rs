//! `lobes reproduce`: the paper's figures and table, from maps of real light.

use std::path::Path;

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::classify::{
    Calibration, Dataset, Evaluation, EvidenceReader, EvidenceReading, Harness, JudgedPosteriors,
    JudgedReading, LearnedPosterior, LogReader, Method, NearestNeighbour, Observation, Plan,
    Posterior, Protocol, RandomReflectances, Reader, Reading, ReflectanceGrid, Sample, Scaling,
    TrainingPlan, collect_random, leave_one_illumination_out, mcnemar,
};
use crate::cli::arguments::{Protocols, Reproduce};
use crate::cli::output::{OutputFolder, write_file};
use crate::cli::{console, lights, materials, progress, slug, spectrum, training, trial};
use crate::features::{Continuation, PaperFeatures, TOP_DEGREE};
use crate::files::{self, Precision, encode_exr};
use crate::illumination::{EnvironmentMap, LightSpectrum, Luminance};
use crate::reflectance::{Material, Variant};
use crate::reflection::{Settings, SphereImage};
use crate::report::{
    AccuracyFile, AccuracyRow, Comparison, ContinuousRow, Figure, FilesRow, NamedConfusion, Page,
    calibration, confusion_matrix, encode_png, feature_plane, light_spectra,
};
use crate::{Error, Parallelism, Result};

/// The degree to which the page shows the spectra of the light.
const LIGHT_DEGREE: usize = 128;

/// The exposure of the pictures of spheres; 1 is the mean of the white sphere, which leaves its bright side room.
const PICTURE_EXPOSURE: f64 = 0.5;

/// What the paper prints: (what, accuracy in per cent, of how many).
const PAPER: [(&str, f64, &str); 2] = [
    ("as the paper reports", 94.4, "68/72"),
    ("Dror et al., as the paper reports", 78.8, "–"),
];

/// One row with all that made it.
struct Row {
    row: AccuracyRow,
    evaluation: Evaluation,
    /// Whether it is what the options name: the continuation, the default scaling, the first lobe.
    chosen: bool,
}

/// A picture that is judged, with what was read off it.
struct Shown<'a> {
    observation: &'a Observation<Reading>,
    judged: &'a JudgedReading,
}

fn shown(data: &Dataset<Reading>) -> Vec<Shown<'_>> {
    let observations = data.observations.iter();
    observations
        .filter_map(|observation| {
            let judged = observation.view.judged.as_ref()?;
            Some(Shown {
                observation,
                judged,
            })
        })
        .collect()
}

pub(super) fn run(options: &Reproduce) -> Result<()> {
    let continuation = Reader::CONTINUATIONS
        .iter()
        .position(|c| *c == options.continuation)
        .ok_or_else(|| {
            Error::Unanswerable(format!(
                "the features need odd degrees, which the {} continuation does not have; use mirror, half-turn or zero",
                options.continuation
            ))
        })?;
    let mut output = OutputFolder::open(&options.out)?;
    let materials = materials::load(&options.materials)?;
    let maps = lights::load(&options.lights)?;
    if maps.len() < 2 {
        return Err(Error::Unanswerable(format!(
            "leaving one illumination out needs at least two maps and there is only {:?}; add maps to the folder",
            maps[0].name()
        )));
    }
    let (protocols, methods) = choices(options, &maps);
    let spectra = spectrum::analyse(&maps, LIGHT_DEGREE)?;
    let plan = Plan {
        lobe: options.lobes[0],
        settings: Settings {
            size: options.size,
            ..Settings::default()
        },
        turns: if protocols.is_empty() {
            1
        } else {
            options.turns.get()
        },
    };

    // The paper's own table.
    let mut rows = Vec::new();
    let mut first: Option<Harness> = None;
    for &lobe in &options.lobes {
        let wide = first.is_none()
            && protocols
                .iter()
                .any(|p| matches!(p, Protocol::Paper | Protocol::Blind));
        let plan = Plan {
            lobe,
            turns: if wide { plan.turns } else { 1 },
            ..plan
        };
        let harness = render(Protocol::Paper, &maps, &materials, &plan, options.seed)?;
        for (place, &behind) in Reader::CONTINUATIONS.iter().enumerate() {
            let chosen = place == continuation && first.is_none();
            rows.extend(nearest_neighbour(
                harness.dataset(),
                place,
                lobe,
                behind,
                chosen,
            )?);
        }
        first.get_or_insert(harness);
    }
    let Some(mut paper) = first else {
        return Err(Error::Unanswerable("name a lobe with --lobe".into()));
    };
    console::answer(table(&rows).to_string());

    // Every classifier under every protocol.
    let mut beyond = Beyond::default();
    for &protocol in &protocols {
        match protocol {
            Protocol::Continuous => beyond.add_continuous(&maps, &plan, options.seed)?,
            Protocol::Paper => {
                paper.prepare(&methods, &maps, &plan, Parallelism::Rayon)?;
                beyond.add(&paper, &methods)?;
            }
            Protocol::Blind => {
                paper.prepare(&methods, &maps, &plan, Parallelism::Rayon)?;
                beyond.add(&paper.blind(), &methods)?;
            }
            _ => {
                let mut harness = render(protocol, &maps, &materials, &plan, options.seed)?;
                harness.prepare(&methods, &maps, &plan, Parallelism::Rayon)?;
                beyond.add(&harness, &methods)?;
            }
        }
    }
    let asked = |p: &Protocols| matches!(p, Protocols::All | Protocols::Files);
    if maps.len() > 2 && options.protocols.iter().any(asked) {
        let cameras = TrainingPlan::default().plan.turns;
        let training = training::load(&maps, &materials, plan.lobe, cameras, false)?;
        beyond.files = trial::run(&maps, &materials, &training, &plan, options.seed)?;
    }
    if !beyond.rows.is_empty() {
        console::answer(format!("\n{}", beyond.table()));
    }
    if !beyond.continuous.is_empty() {
        console::answer(format!("\n{}", beyond.continuous_table()));
    }
    if !beyond.files.is_empty() {
        console::answer(format!("\n{}", beyond.files_table()));
    }

    let data = paper.dataset();
    let accuracy = AccuracyFile {
        lobes: env!("CARGO_PKG_VERSION").to_owned(),
        settings: describe(options, &plan, &materials, &maps, data),
        rows: rows
            .iter()
            .chain(&beyond.rows)
            .map(|row| row.row.clone())
            .collect(),
        comparisons: beyond.comparisons.clone(),
        continuous: beyond.continuous.clone(),
        files: beyond.files.clone(),
    };
    let mut json = serde_json::to_string_pretty(&accuracy)
        .map_err(|error| Error::Unanswerable(format!("the table has no JSON form: {error}")))?;
    json.push('\n');
    output.add("accuracy.json", json)?;
    let page = write_page(
        &mut output,
        options,
        continuation,
        &rows,
        &beyond,
        &maps,
        &spectra,
        &materials,
        data,
    )?;
    output.add("index.html", page)?;
    output.commit()?;
    if let Some(path) = &options.write {
        write_between_marks(path, &beyond.markdown())?;
        if let Some(row) = beyond.continuous.last() {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let plot = path.with_file_name(format!("{stem}-calibration.svg"));
            write_file(&plot, calibration(&row.coverage).as_bytes())?;
        }
        console::note(format!("wrote the table into {}", path.display()));
    }
    console::json(&accuracy)?;
    console::note(format!(
        "wrote {}",
        options.out.join("index.html").display()
    ));
    Ok(())
}

/// The protocols and classifiers that the options name.
fn choices(options: &Reproduce, maps: &[EnvironmentMap]) -> (Vec<Protocol>, Vec<Method>) {
    let asked = |protocol: Protocol| {
        (options.protocols.iter()).any(|p| *p == Protocols::All || *p == Protocols::One(protocol))
    };
    let protocols = Protocol::ALL.into_iter().filter(|p| asked(*p)).collect();
    let methods = Method::ALL.into_iter().filter(|method| {
        let named = options.classifiers.is_empty() || options.classifiers.contains(method);
        named && (maps.len() > 2 || !method.has_inner_loop())
    });
    (protocols, methods.collect())
}

fn render(
    protocol: Protocol,
    maps: &[EnvironmentMap],
    materials: &[Material],
    plan: &Plan,
    seed: u64,
) -> Result<Harness> {
    let bar = progress::bar(maps.len(), "spheres");
    let harness = Harness::new(
        protocol,
        maps,
        materials,
        plan,
        seed,
        Parallelism::Rayon,
        &|| bar.inc(1),
    );
    bar.finish_and_clear();
    harness
}

/// Every classifier under every protocol.
#[derive(Default)]
struct Beyond {
    rows: Vec<Row>,
    comparisons: Vec<Comparison>,
    continuous: Vec<ContinuousRow>,
    files: Vec<FilesRow>,
}

impl Beyond {
    const FILES_HEADINGS: [&'static str; 6] = [
        "files",
        "read#",
        "circle off by, of the radius#",
        "correct#",
        "told apart#",
        "\"none of these\" likeliest#",
    ];

    fn files_columns(row: &FilesRow) -> Vec<String> {
        let errors = &row.circle_errors;
        let at = |level: f64| {
            let place = (level * errors.len().saturating_sub(1) as f64).round() as usize;
            errors.get(place).map_or(0.0, |error| 100.0 * error)
        };
        vec![
            row.kind.clone(),
            format!("{}/{}", row.read, row.total),
            format!("{:.2} % (nineteen of twenty: {:.2} %)", at(0.5), at(0.95)),
            format!("{}/{}", row.correct, row.total),
            format!(
                "{} ({:.1} %)",
                row.told_apart,
                100.0 * row.told_apart as f64 / row.total.max(1) as f64
            ),
            row.strange.to_string(),
        ]
    }

    fn files_table(&self) -> Table {
        plain_table(
            &Self::FILES_HEADINGS,
            self.files.iter().map(Self::files_columns),
        )
    }

    /// σ and the specular share of random reflectances.
    fn add_continuous(&mut self, maps: &[EnvironmentMap], plan: &Plan, seed: u64) -> Result<()> {
        let viewpoint = Protocol::Continuous.view().viewpoint;
        let reader = LogReader::new(viewpoint)?;
        let evidence_reader = EvidenceReader::new(viewpoint)?;
        let bar = progress::bar(maps.len(), "random");
        let random = RandomReflectances {
            seed,
            ..RandomReflectances::default()
        };
        let samples = collect_random(
            Protocol::Continuous.view(),
            maps,
            &random,
            plan,
            Parallelism::Rayon,
            &|| bar.inc(1),
            &|judged, _, image| {
                let reading = judged.then(|| evidence_reader.read(image));
                Ok((reader.features(image)?, reading.transpose()?))
            },
        );
        bar.finish_and_clear();
        let layout = evidence_reader.layout();
        let grid = ReflectanceGrid::of_view(plan.lobe, layout, Parallelism::Rayon)?;
        let (mut features, mut readings) = (Vec::new(), Vec::new());
        for sample in samples? {
            let (view, reading) = sample.view;
            features.push(Sample {
                illumination: sample.illumination,
                judged: sample.judged,
                truth: sample.truth,
                view,
            });
            readings.push(reading);
        }
        let bar = progress::bar(readings.len(), "evidence");
        let evidence = Parallelism::Rayon.map(readings.len(), |i| {
            bar.inc(1);
            let of = |reading: &EvidenceReading| {
                grid.log_likelihoods(&reading.luminance, &reading.lights)
            };
            readings[i].as_ref().map(of).transpose()
        });
        bar.finish_and_clear();
        let evidence = evidence.into_iter().collect::<Result<Vec<_>>>()?;
        let learned = LearnedPosterior::new(
            &features,
            &LearnedPosterior::shares(),
            &LearnedPosterior::sigmas(),
        )?;
        let results = learned.leave_one_illumination_out(&evidence, Parallelism::Rayon)?;
        let row = |reader: &str, of: fn(&JudgedPosteriors) -> &Posterior| {
            let posteriors: Vec<_> = results.iter().map(|r| (r.truth, of(r))).collect();
            let calibration = Calibration::of(&posteriors);
            ContinuousRow {
                reader: reader.into(),
                count: calibration.count,
                sigma_error: calibration.sigma_error,
                share_error: calibration.share_error,
                coverage: calibration.coverage,
            }
        };
        self.continuous = vec![
            row("evidence", |r| &r.evidence),
            row("learned", |r| &r.learned),
            row("both", |r| &r.both),
        ];
        Ok(())
    }

    const CONTINUOUS_HEADINGS: [&'static str; 8] = [
        "continuous, read by",
        "pictures#",
        "median error of σ#",
        "of the share#",
        "50 % intervals hold, of σ#",
        "of shares#",
        "90 % intervals hold, of σ#",
        "of shares#",
    ];

    fn continuous_columns(row: &ContinuousRow) -> Vec<String> {
        let at = |level: f64| row.coverage.iter().find(|c| c.0 == level);
        let percent = |part: f64| format!("{:.1} %", 100.0 * part);
        let held = |level: f64| at(level).map_or([f64::NAN; 2], |c| [c.1, c.2]).map(percent);
        let mut columns = vec![
            row.reader.clone(),
            row.count.to_string(),
            percent(row.sigma_error),
            format!("{:.3}", row.share_error),
        ];
        columns.extend(held(0.5));
        columns.extend(held(0.9));
        columns
    }

    fn continuous_table(&self) -> Table {
        plain_table(
            &Self::CONTINUOUS_HEADINGS,
            self.continuous.iter().map(Self::continuous_columns),
        )
    }

    fn add(&mut self, harness: &Harness, methods: &[Method]) -> Result<()> {
        let data = harness.dataset();
        let classes = harness.classes();
        let bar = progress::bar(methods.len(), harness.protocol().name());
        let mut evaluations: Vec<(Method, Evaluation)> = Vec::new();
        for &method in methods {
            evaluations.push((method, harness.evaluate(method, Parallelism::Rayon)?));
            bar.inc(1);
        }
        bar.finish_and_clear();
        let best = evaluations
            .iter()
            .find(|(method, _)| *method == Method::Combined);
        for (method, evaluation) in &evaluations {
            if let (Some((_, best)), true) = (best, *method != Method::Combined) {
                let right = |e: &Evaluation, i: usize| e.said[i] == e.truth[i];
                let count = |a: &Evaluation, b: &Evaluation| {
                    (0..a.total())
                        .filter(|&i| right(a, i) && !right(b, i))
                        .count()
                };
                let (first, second) = (count(evaluation, best), count(best, evaluation));
                self.comparisons.push(Comparison {
                    protocol: harness.protocol().name().into(),
                    first: method.name().into(),
                    second: Method::Combined.name().into(),
                    first_alone: first,
                    second_alone: second,
                    p: mcnemar(first, second),
                });
            }
        }
        for (method, evaluation) in evaluations {
            let mut row = AccuracyRow::new(
                harness.protocol().name(),
                method.name(),
                "-",
                "-",
                "-",
                &evaluation,
                named_confusions(data, &evaluation),
            );
            row.told_apart = evaluation.correct_up_to(&classes);
            row.ceiling = harness.ceiling();
            self.rows.push(Row {
                row,
                evaluation,
                chosen: method == Method::Combined,
            });
        }
        Ok(())
    }

    const HEADINGS: [&'static str; 8] = [
        "protocol",
        "classifier",
        "correct#",
        "accuracy#",
        "95 % interval#",
        "of at most#",
        "told apart#",
        "p against combined#",
    ];

    fn columns(&self, row: &AccuracyRow) -> Vec<String> {
        let comparison = self
            .comparisons
            .iter()
            .find(|c| c.protocol == row.protocol && c.first == row.classifier);
        vec![
            row.protocol.clone(),
            row.classifier.clone(),
            format!("{}/{}", row.correct, row.total),
            format!("{:.1} %", 100.0 * row.accuracy),
            format!("{:.1} – {:.1}", 100.0 * row.ci95[0], 100.0 * row.ci95[1]),
            row.ceiling.to_string(),
            format!(
                "{} ({:.1} %)",
                row.told_apart,
                100.0 * row.told_apart as f64 / row.total.max(1) as f64
            ),
            comparison.map_or_else(|| "–".into(), |c| format!("{:.2}", c.p)),
        ]
    }

    fn table(&self) -> Table {
        plain_table(
            &Self::HEADINGS,
            self.rows.iter().map(|row| self.columns(&row.row)),
        )
    }

    fn markdown(&self) -> String {
        let rows = self.rows.iter().map(|row| self.columns(&row.row));
        let mut text = markdown_table(&Self::HEADINGS, rows)
            .trim_start()
            .to_owned();
        if !self.files.is_empty() {
            let rows = self.files.iter().map(Self::files_columns);
            text.push_str(&markdown_table(&Self::FILES_HEADINGS, rows));
        }
        if !self.continuous.is_empty() {
            let rows = self.continuous.iter().map(Self::continuous_columns);
            text.push_str(&markdown_table(&Self::CONTINUOUS_HEADINGS, rows));
        }
        text
    }
}

/// A table after an empty line.
fn markdown_table(headings: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let names = headings.iter().map(|h| h.trim_end_matches('#').to_owned());
    let rules = headings
        .iter()
        .map(|h| if h.ends_with('#') { "---:" } else { "---" }.to_owned());
    let mut text = format!("\n{}{}", line(names.collect()), line(rules.collect()));
    text.extend(rows.map(line));
    text
}

/// The marks between which `--write` puts its table.
const MARKS: [&str; 2] = ["<!-- table -->", "<!-- end of table -->"];

fn write_between_marks(path: &Path, text: &str) -> Result<()> {
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

fn named_confusions<T>(data: &Dataset<T>, evaluation: &Evaluation) -> Vec<NamedConfusion> {
    let confusions = evaluation.confusions().into_iter().map(|c| NamedConfusion {
        illumination: data.illuminations[data.observations[c.observation].illumination].clone(),
        truth: data.materials[c.truth].clone(),
        said: data.materials[c.said].clone(),
    });
    confusions.collect()
}

/// The rows of every scaling.
fn nearest_neighbour(
    data: &Dataset<Reading>,
    continuation: usize,
    lobe: Variant,
    behind: Continuation,
    chosen: bool,
) -> Result<Vec<Row>> {
    let shown = shown(data);
    let arrays: Vec<[f64; 10]> = shown
        .iter()
        .map(|s| s.judged.paper[continuation].to_array())
        .collect();
    let labels: Vec<usize> = shown.iter().map(|s| s.observation.material).collect();
    let groups: Vec<usize> = shown.iter().map(|s| s.observation.illumination).collect();
    let judged = data.judged();
    let count = data.materials.len();
    let row = |scaling| {
        let classifier = NearestNeighbour::new(scaling, &arrays, &labels, count)?;
        let mut evaluation =
            leave_one_illumination_out(&classifier, &labels, &groups, count, Parallelism::Rayon)?;
        evaluation.observations.clone_from(&judged);
        let row = AccuracyRow::new(
            "paper",
            "nearest-neighbour",
            scaling.name(),
            behind.name(),
            lobe.name(),
            &evaluation,
            named_confusions(data, &evaluation),
        );
        Ok(Row {
            row,
            evaluation,
            chosen: chosen && scaling == Scaling::default(),
        })
    };
    Scaling::ALL.into_iter().map(row).collect()
}

/// What was set, for `accuracy.json`.
fn describe(
    options: &Reproduce,
    plan: &Plan,
    materials: &[Material],
    maps: &[EnvironmentMap],
    data: &Dataset<Reading>,
) -> serde_json::Value {
    json!({
        "camera": "level, orthographic",
        "size": plan.settings.size,
        "tolerance": plan.settings.tolerance,
        "turns": plan.turns,
        "seed": options.seed,
        "render_error": data.render_error,
        "top_degree": TOP_DEGREE,
        "scaling_by": "mean luminance of a white sphere in the same light",
        "reading": if options.materials.as_albedos { "albedos" } else { "as given" },
        "materials": materials.iter().map(|m| json!({
            "name": m.name(), "diffuse": m.diffuse(), "specular": m.specular(),
            "sigma": m.roughness().sigma(),
        })).collect::<Vec<_>>(),
        "illuminations": maps.iter().map(EnvironmentMap::name).collect::<Vec<_>>(),
    })
}

/// The columns of one row, as people read them.
fn columns(row: &AccuracyRow) -> Vec<String> {
    vec![
        row.protocol.clone(),
        row.classifier.clone(),
        row.scaling.clone(),
        row.continuation.clone(),
        row.lobe.clone(),
        format!("{}/{}", row.correct, row.total),
        format!("{:.1} %", 100.0 * row.accuracy),
        format!("{:.1} – {:.1}", 100.0 * row.ci95[0], 100.0 * row.ci95[1]),
    ]
}

const HEADINGS: [&str; 8] = [
    "protocol",
    "classifier",
    "scaling",
    "behind",
    "lobe",
    "correct#",
    "accuracy#",
    "95 % interval#",
];

/// The rows of the paper itself, in the same columns.
fn paper_rows() -> Vec<Vec<String>> {
    let rows = PAPER.iter().map(|(what, accuracy, count)| {
        let mut row = vec!["–".to_owned(); HEADINGS.len()];
        row[0] = "paper".into();
        row[1] = (*what).into();
        row[5] = (*count).into();
        row[6] = format!("{accuracy:.1} %");
        row
    });
    rows.collect()
}

fn table(rows: &[Row]) -> Table {
    let own = rows.iter().map(|row| columns(&row.row));
    plain_table(&HEADINGS, own.chain(paper_rows()))
}

/// A table for the terminal; headings that end in `#` are over numbers.
fn plain_table(headings: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(headings.iter().map(|h| h.trim_end_matches('#')));
    for row in rows {
        table.add_row(row);
    }
    for (i, heading) in headings.iter().enumerate() {
        if let (true, Some(column)) = (heading.ends_with('#'), table.column_mut(i)) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// Adds the page's pictures to the output and gives the page.
#[expect(
    clippy::too_many_arguments,
    reason = "the page shows all that the verb has made"
)]
fn write_page(
    output: &mut OutputFolder,
    options: &Reproduce,
    continuation: usize,
    rows: &[Row],
    beyond: &Beyond,
    maps: &[EnvironmentMap],
    spectra: &[LightSpectrum],
    materials: &[Material],
    data: &Dataset<Reading>,
) -> Result<String> {
    let pictures_of = shown(data);
    let lobe = options.lobes[0];
    let chosen = rows.iter().find(|row| row.chosen).unwrap_or(&rows[0]);
    let mut page = Page::new(
        "Reading materials off spheres under natural light",
        &format!(
            "Natural light has regular statistics and a surface filters them. From the power spectrum of one \
             image of a sphere, and with no picture under the same light to learn from, the paper's features \
             name {} of {} spheres right ({:.1} %, 95 % interval {:.1} – {:.1}); the paper reports 94.4 % on its own nine maps.",
            chosen.row.correct,
            chosen.row.total,
            100.0 * chosen.row.accuracy,
            100.0 * chosen.row.ci95[0],
            100.0 * chosen.row.ci95[1],
        ),
    );

    page.heading("Accuracy (the paper's Table 1)");
    page.paragraph(
        "Nearest neighbour, leaving all images of one illumination out at a time. The paper does not say how features \
         are scaled before distances are taken, so every scaling is here; the marked row is the default, chosen \
         because powers and radiances are compared by their ratios.",
    );
    let mut table: Vec<(&str, Vec<String>)> = rows
        .iter()
        .map(|row| (if row.chosen { "strong" } else { "" }, columns(&row.row)))
        .collect();
    table.extend(paper_rows().into_iter().map(|row| ("quoted", row)));
    page.table(&HEADINGS, &table);
    output.add(
        "figures/confusion.svg",
        confusion_matrix(&data.materials, &chosen.evaluation.confusion_matrix()),
    )?;
    page.figure(&Figure {
        path: "figures/confusion.svg".into(),
        caption: vec!["Confusion matrix of the marked row".into()],
    });
    if !chosen.row.confusions.is_empty() {
        let wrong: Vec<(&str, Vec<String>)> = chosen
            .row
            .confusions
            .iter()
            .map(|c| {
                (
                    "",
                    vec![c.illumination.clone(), c.truth.clone(), c.said.clone()],
                )
            })
            .collect();
        page.table(&["illumination", "truth", "said"], &wrong);
    }

    if !beyond.rows.is_empty() {
        page.heading("Beyond the paper: every classifier under every protocol");
        page.paragraph(
            "Without a white sphere the exposure is unknown, and materials whose pictures differ by it alone cannot be told \
             apart: “of at most” is what anyone could name right, “told apart” counts a picture as right when its material or \
             one with the same picture was named. p is McNemar's exact test against the combined classifier. docs/inference.md \
             explains the classifiers.",
        );
        let table: Vec<(&str, Vec<String>)> = beyond
            .rows
            .iter()
            .map(|row| {
                let class = if row.chosen { "strong" } else { "" };
                (class, beyond.columns(&row.row))
            })
            .collect();
        page.table(&Beyond::HEADINGS, &table);
        let mut pictures = Vec::new();
        for row in beyond.rows.iter().filter(|row| row.chosen) {
            let path = format!("figures/confusion-{}.svg", row.row.protocol);
            output.add(
                path.clone(),
                confusion_matrix(&data.materials, &row.evaluation.confusion_matrix()),
            )?;
            pictures.push(Figure {
                path,
                caption: vec![format!("{}: the combined classifier", row.row.protocol)],
            });
        }
        page.grid(2, &pictures);
    }

    if let Some(row) = beyond.continuous.last() {
        page.heading("Reading σ and the specular share off a picture");
        let rows = beyond.continuous.iter();
        let table: Vec<(&str, Vec<String>)> = rows
            .map(|row| ("", Beyond::continuous_columns(row)))
            .collect();
        page.table(&Beyond::CONTINUOUS_HEADINGS, &table);
        output.add("figures/calibration.svg", calibration(&row.coverage))?;
        page.figure(&Figure {
            path: "figures/calibration.svg".into(),
            caption: vec!["How often credible intervals hold the truth".into()],
        });
    }

    page.heading("The light in frequency (Figure 1)");
    let named: Vec<(String, Vec<f64>)> = maps
        .iter()
        .zip(spectra)
        .map(|(map, spectrum)| (map.name().to_owned(), spectrum.luminance.clone()))
        .collect();
    let eta = spectrum::median_eta(spectra);
    output.add("figures/light.svg", light_spectra(&named, eta))?;
    let mut clipped: Vec<f64> = spectra.iter().map(|s| s.clipped_eta).collect();
    clipped.sort_by(f64::total_cmp);
    page.paragraph(&format!(
        "The average power of each degree falls as k / l^(2+η). A small bright sun or lamp has as much power at every \
         degree (η = −2) and hides the rest: the median η over these maps is {eta:.2}, and {:.2} once the brightest {} % \
         of the sphere are clipped. Hover over a line for its name.",
        clipped[clipped.len() / 2],
        100.0 * LightSpectrum::CLIPPED_SHARE,
    ));
    page.figure(&Figure {
        path: "figures/light.svg".into(),
        caption: vec!["Power spectra of the luminance of every illumination".into()],
    });

    page.heading("Materials in the plane of v1 and v2 (Figure 2)");
    let plane: Vec<(usize, f64, f64)> = pictures_of
        .iter()
        .map(|s| {
            let features: &PaperFeatures = &s.judged.paper[continuation];
            (s.observation.material, features.power[0], features.power[1])
        })
        .collect();
    output.add("figures/plane.svg", feature_plane(&data.materials, &plane))?;
    page.paragraph(
        "The paper predicts v2 near 0 for matte spheres, which reflect no odd degree past 1. With the unseen \
         half filled by the mirrored front it is not: the mirrored field has a crease along the rim, and a crease has \
         power at every degree.",
    );
    page.figure(&Figure {
        path: "figures/plane.svg".into(),
        caption: vec![format!(
            "One symbol an image; unseen half: {}",
            options.continuation
        )],
    });

    page.heading("The spheres (Figure 3)");
    let shown = 0;
    page.paragraph(&format!(
        "The {} materials under “{}”, scaled by its white sphere; lobe {lobe}. The PNGs are clipped at 1 and \
         encoded as sRGB; spheres/ also has each as linear EXR.",
        materials.len(),
        data.illuminations[shown],
    ));
    let mut pictures = Vec::new();
    let of_first: Vec<&Shown> = pictures_of
        .iter()
        .filter(|s| s.observation.illumination == shown)
        .collect();
    for Shown {
        observation,
        judged,
    } in &of_first
    {
        let material = &materials[observation.material];
        let image = &judged.image;
        let stem = format!(
            "spheres/{:02}-{}",
            observation.material + 1,
            slug(material.name())
        );
        let size = image.size();
        output.add(
            format!("{stem}.png"),
            encode_png(size, size, PICTURE_EXPOSURE, |row, column| {
                image.get(row, column)
            })?,
        )?;
        output.add(format!("{stem}.exr"), sphere_exr(image)?)?;
        pictures.push(Figure {
            path: format!("{stem}.png"),
            caption: vec![
                material.name().to_owned(),
                format!(
                    "ρd {}, ρs {}, σ {}",
                    rgb(material.diffuse()),
                    rgb(material.specular()),
                    material.roughness().sigma()
                ),
            ],
        });
    }
    page.grid(4, &pictures);
    let shown: Vec<&SphereImage> = of_first.iter().map(|s| &s.judged.image).collect();
    output.add("figures/spheres.png", contact_sheet(&shown, 4)?)?;

    page.heading("The illuminations");
    let mut pictures = Vec::new();
    for (i, (map, spectrum)) in maps.iter().zip(spectra).enumerate() {
        let path = format!("illuminations/{:02}-{}.png", i + 1, slug(map.name()));
        output.add(path.clone(), thumbnail(map)?)?;
        pictures.push(Figure {
            path,
            caption: vec![
                map.name().to_owned(),
                format!(
                    "η = {:.2} ± {:.2}; clipped {:.2}",
                    spectrum.law.eta, spectrum.law.eta_error, spectrum.clipped_eta
                ),
            ],
        });
    }
    page.grid(4, &pictures);
    Ok(page.html(&format!(
        "lobes {}: {} maps, {} materials, {}² pixels, tolerance {:e}. The numbers are in accuracy.json.",
        env!("CARGO_PKG_VERSION"),
        maps.len(),
        materials.len(),
        options.size,
        Settings::default().tolerance,
    )))
}

/// Images of one size side by side, `columns` in a row.
fn contact_sheet(images: &[&SphereImage], columns: usize) -> Result<Vec<u8>> {
    let margin = 8;
    let cell = images[0].size() + margin;
    let rows = images.len().div_ceil(columns);
    encode_png(
        columns * cell + margin,
        rows * cell + margin,
        PICTURE_EXPOSURE,
        |row, column| {
            let (row, column) = (row.checked_sub(margin)?, column.checked_sub(margin)?);
            let image = images.get(row / cell * columns + column / cell)?;
            image.get(row % cell, column % cell)
        },
    )
}

/// A map as a small picture, its mean at a middle grey.
fn thumbnail(map: &EnvironmentMap) -> Result<Vec<u8>> {
    let (width, height) = (256, 128);
    let exposure = 0.25 / Luminance::Rec709.of(map.mean());
    let (rows, columns) = (map.height(), map.width());
    encode_png(width, height, exposure, |row, column| {
        // The mean of the pixels under this one, of at least one.
        let (row0, row1) = (row * rows / height, ((row + 1) * rows).div_ceil(height));
        let (column0, column1) = (
            column * columns / width,
            ((column + 1) * columns).div_ceil(width),
        );
        let mut sum = [0.0; 3];
        for row in row0..row1 {
            for column in column0..column1 {
                for (sum, value) in sum.iter_mut().zip(map.pixel(row, column)) {
                    *sum += value;
                }
            }
        }
        let count = ((row1 - row0) * (column1 - column0)) as f64;
        Some(sum.map(|value| value / count))
    })
}

/// A sphere as linear EXR, black where there is none.
pub(super) fn sphere_exr(image: &SphereImage) -> Result<Vec<u8>> {
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

/// A colour in a caption: one number where it is grey.
fn rgb(colour: [f64; 3]) -> String {
    if colour[0] == colour[1] && colour[1] == colour[2] {
        format!("{:.3}", colour[0])
    } else {
        let parts = colour.map(|c| format!("{c:.2}"));
        format!("({})", parts.join(", "))
    }
}
