//! `lobes reproduce`: the paper's figures and table, from maps of real light.

use comfy_table::{CellAlignment, Table, presets};
use serde_json::json;

use crate::arguments::{Protocols, Reproduce};
use crate::error::{Error, Result};
use crate::marks::write_between_marks;
use crate::output::{OutputFolder, write_file};
use crate::report::{
    AccuracyFile, AccuracyRow, BestRow, CeilingRow, Comparison, ContinuousRow, FilesRow,
    NamedConfusion, calibration,
};
use crate::{console, lights, materials, progress, spectrum, training, trial};
use lobes::Parallelism;
use lobes::features::TOP_DEGREE;
use lobes::illumination::EnvironmentMap;
use lobes::inference::{
    Dataset, JudgedReading, Observation, Plan, Reader, Reading, Scenes, TrainingPlan,
};
use lobes::reflectance::{Finish, Material, Variant};
use lobes::reflection::Settings;
use lobes_experiments::{
    ContinuousReadings, Evaluation, Harness, Method, NearestNeighbour, Protocol, Scaling,
    best_share, leave_one_illumination_out, mcnemar,
};

mod page;
mod statements;

/// The degree to which the page shows the spectra of the light.
const LIGHT_DEGREE: usize = 128;

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
            Error::request(
                format!(
                    "the features need odd degrees, which the {} continuation does not have",
                    options.continuation
                ),
                "use mirror, half-turn or zero",
            )
        })?;
    let mut output = OutputFolder::open(&options.out)?;
    let materials = materials::load(&options.materials)?;
    let (maps, scenes) = lights::load(&options.lights)?;
    let scene_count = scenes.among(&vec![true; maps.len()]).len();
    if scene_count < 2 {
        return Err(Error::request(
            format!(
                "leaving one illumination out needs at least two maps of different places and there is only {:?}",
                maps[0].name()
            ),
            "add maps to the folder",
        ));
    }
    let (protocols, methods) = choices(options, scene_count);
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
        let harness =
            render(Protocol::Paper, &maps, &materials, &plan, options.seed)?.with_scenes(&scenes);
        for place in 0..Reader::CONTINUATIONS.len() {
            let chosen = place == continuation && first.is_none();
            rows.extend(nearest_neighbour(
                harness.dataset(),
                &materials,
                place,
                lobe,
                chosen,
            )?);
        }
        first.get_or_insert(harness);
    }
    let Some(mut paper) = first else {
        return Err(Error::request("no lobe is named", "name one with --lobe"));
    };
    console::answer(table(&rows).to_string());

    // Every classifier under every protocol.
    let mut beyond = Beyond::default();
    for &protocol in &protocols {
        match protocol {
            Protocol::Continuous => beyond.add_continuous(&maps, &scenes, &plan, options.seed)?,
            Protocol::Paper => {
                paper.prepare(&methods, &maps, &plan, Parallelism::Rayon)?;
                beyond.add(&paper, &methods)?;
            }
            Protocol::Blind => {
                paper.prepare(&methods, &maps, &plan, Parallelism::Rayon)?;
                beyond.add(&paper.blind(), &methods)?;
            }
            _ => {
                let mut harness =
                    render(protocol, &maps, &materials, &plan, options.seed)?.with_scenes(&scenes);
                harness.prepare(&methods, &maps, &plan, Parallelism::Rayon)?;
                beyond.add(&harness, &methods)?;
            }
        }
    }
    let asked = |p: &Protocols| matches!(p, Protocols::All | Protocols::Files);
    if scene_count > 2 && options.protocols.iter().any(asked) {
        let cameras = TrainingPlan::default().plan.turns;
        let mut training = training::load(&maps, &materials, plan.lobe, cameras, false)?;
        training.named.scenes = scenes;
        beyond.files = trial::run(&maps, &materials, &training, &plan, options.seed)?;
    }
    if !beyond.rows.is_empty() {
        console::answer(format!("\n{}", beyond.table()));
    }
    if !beyond.ceilings.is_empty() {
        let rows = beyond.ceiling_rows().into_iter();
        let table = plain_table(&Beyond::CEILING_HEADINGS, rows);
        console::answer(format!("\n{table}"));
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
        ceilings: beyond.ceilings.clone(),
        best: beyond.best.clone(),
        continuous: beyond.continuous.clone(),
        files: beyond.files.clone(),
    };
    let mut json = serde_json::to_string_pretty(&accuracy)
        .map_err(|error| Error::system("the table has no JSON form", error))?;
    json.push('\n');
    output.add("accuracy.json", json)?;
    let page = page::write_page(
        &mut output,
        options,
        continuation,
        &rows,
        &beyond,
        &maps,
        &spectra,
        &materials,
        &paper,
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
fn choices(options: &Reproduce, scenes: usize) -> (Vec<Protocol>, Vec<Method>) {
    let asked = |protocol: Protocol| {
        (options.protocols.iter()).any(|p| *p == Protocols::All || *p == Protocols::One(protocol))
    };
    let protocols = Protocol::ALL.into_iter().filter(|p| asked(*p)).collect();
    let methods = Method::ALL.into_iter().filter(|method| {
        let named = options.classifiers.is_empty() || options.classifiers.contains(method);
        named && (scenes > 2 || !method.has_inner_loop())
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
    Ok(harness?)
}

/// Every classifier under every protocol.
#[derive(Default)]
struct Beyond {
    rows: Vec<Row>,
    comparisons: Vec<Comparison>,
    ceilings: Vec<CeilingRow>,
    best: Vec<BestRow>,
    continuous: Vec<ContinuousRow>,
    files: Vec<FilesRow>,
}

impl Beyond {
    const FILES_HEADINGS: [&'static str; 6] = [
        "files",
        "read#",
        "circle off by, of the radius#",
        "correct#",
        "finish right#",
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
                row.finish,
                100.0 * row.finish as f64 / row.total.max(1) as f64
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
    fn add_continuous(
        &mut self,
        maps: &[EnvironmentMap],
        scenes: &Scenes,
        plan: &Plan,
        seed: u64,
    ) -> Result<()> {
        let bar = progress::bar(maps.len(), "random");
        let readings =
            ContinuousReadings::new(maps, plan, seed, Parallelism::Rayon, &|| bar.inc(1));
        bar.finish_and_clear();
        let readings = readings?;
        let bar = progress::bar(readings.count(), "evidence");
        let judged = readings.judge(plan, scenes, Parallelism::Rayon, &|| bar.inc(1));
        bar.finish_and_clear();
        let rows = judged?.map(|(reader, calibration)| ContinuousRow {
            reader: reader.into(),
            count: calibration.count,
            sigma_error: calibration.sigma_error,
            share_error: calibration.share_error,
            coverage: calibration.coverage,
        });
        self.continuous = rows.to_vec();
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
        let finishes = harness.finishes();
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
        if let Some((_, best)) = best {
            self.add_ceilings(harness, best)?;
        }
        for (method, evaluation) in evaluations {
            self.rows.push(Row {
                row: AccuracyRow::new(
                    harness.protocol().name(),
                    method.name(),
                    &evaluation,
                    &finishes,
                    named_confusions(data, &evaluation),
                ),
                evaluation,
                chosen: method == Method::Combined,
            });
        }
        Ok(())
    }

    /// What colour allows, beside how often the combined classifier mixed up two materials that
    /// differ in colour alone.
    fn add_ceilings(&mut self, harness: &Harness, combined: &Evaluation) -> Result<()> {
        let data = harness.dataset();
        let ceilings = match harness.colour_ceilings() {
            Ok(ceilings) => ceilings,
            // So few maps that their spread is unknown.
            Err(
                error @ (lobes::Error::TooFew { .. } | lobes::Error::NotPositiveDefinite { .. }),
            ) => {
                console::note(error.to_string());
                return Ok(());
            }
            Err(error) => return Err(error.into()),
        };
        let protocol = harness.protocol().name();
        let matrix = combined.confusion_matrix();
        for ceiling in &ceilings {
            let (first, second) = (ceiling.first, ceiling.second);
            self.ceilings.push(CeilingRow {
                protocol: protocol.into(),
                first: data.materials[first].clone(),
                second: data.materials[second].clone(),
                pictures: matrix[first].iter().chain(&matrix[second]).sum(),
                rate: ceiling.rate,
                ci95: [ceiling.interval.0, ceiling.interval.1],
                confused: matrix[first][second] + matrix[second][first],
            });
        }
        let total = combined.total();
        self.best.push(BestRow {
            protocol: protocol.into(),
            total,
            best: best_share(&ceilings, data.materials.len()).map(|share| share * total as f64),
        });
        Ok(())
    }

    const CEILING_HEADINGS: [&'static str; 5] = [
        "protocol",
        "differ in colour alone",
        "told apart by colour, at the best#",
        "95 % interval#",
        "mixed up by the combined classifier#",
    ];

    fn ceiling_rows(&self) -> Vec<Vec<String>> {
        let pairs = self.ceilings.iter().map(|row| {
            vec![
                row.protocol.clone(),
                format!("{} and {}", row.first, row.second),
                format!("{:.1} %", 100.0 * row.rate),
                format!("{:.1} – {:.1}", 100.0 * row.ci95[0], 100.0 * row.ci95[1]),
                format!("{}/{}", row.confused, row.pictures),
            ]
        });
        let best = self.best.iter().map(|row| {
            let [best, low, high] = row.best;
            vec![
                row.protocol.clone(),
                "all pictures, if nothing else is mixed up".into(),
                format!("{best:.1} of {}", row.total),
                format!("{low:.1} – {high:.1}"),
                "–".into(),
            ]
        });
        let mut rows: Vec<Vec<String>> = pairs.chain(best).collect();
        let order = |name: &str| Protocol::ALL.iter().position(|p| p.name() == name);
        rows.sort_by_key(|row| order(&row[0]));
        rows
    }

    const HEADINGS: [&'static str; 7] = [
        "protocol",
        "classifier",
        "correct#",
        "accuracy#",
        "95 % interval#",
        "finish right#",
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
            format!(
                "{} ({:.1} %)",
                row.finish,
                100.0 * row.finish as f64 / row.total.max(1) as f64
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
        if !self.ceilings.is_empty() {
            let rows = self.ceiling_rows().into_iter();
            text.push_str(&markdown_table(&Self::CEILING_HEADINGS, rows));
        }
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
    materials: &[Material],
    continuation: usize,
    lobe: Variant,
    chosen: bool,
) -> Result<Vec<Row>> {
    let shown = shown(data);
    let arrays: Vec<[f64; 10]> = shown
        .iter()
        .map(|s| s.judged.paper[continuation].to_array())
        .collect();
    let labels: Vec<usize> = shown.iter().map(|s| s.observation.material).collect();
    let illuminations = shown.iter().map(|s| s.observation.illumination);
    let groups: Vec<usize> = illuminations.map(|i| data.scenes.of(i)).collect();
    let judged = data.judged();
    let count = data.materials.len();
    let finishes: Vec<Finish> = materials.iter().map(Material::finish).collect();
    let row = |scaling: Scaling| {
        let classifier = NearestNeighbour::new(scaling, &arrays, &labels, count)?;
        let mut evaluation =
            leave_one_illumination_out(&classifier, &labels, &groups, count, Parallelism::Rayon)?;
        evaluation.observations.clone_from(&judged);
        let row = AccuracyRow {
            scaling: scaling.name().into(),
            continuation: Reader::CONTINUATIONS[continuation].name().into(),
            lobe: lobe.name().into(),
            ..AccuracyRow::new(
                "paper",
                "nearest-neighbour",
                &evaluation,
                &finishes,
                named_confusions(data, &evaluation),
            )
        };
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
        "left_out_together": data.scenes.groups(maps.len()).iter()
            .map(|group| group.iter().map(|&i| maps[i].name()).collect::<Vec<_>>())
            .collect::<Vec<_>>(),
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
        row.finish.to_string(),
    ]
}

const HEADINGS: [&str; 9] = [
    "protocol",
    "classifier",
    "scaling",
    "behind",
    "lobe",
    "correct#",
    "accuracy#",
    "95 % interval#",
    "finish right#",
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
