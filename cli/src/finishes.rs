//! `lobes finishes`: how often the finish of a photographed ball is told right, and the model that
//! tells it.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use serde_json::json;
use sha2::{Digest, Sha256};

use crate::arguments::Finishes;
use crate::error::{Error, Result};
use crate::marks::write_between_marks;
use crate::report::answers_calibration;
use crate::{console, output, progress};
use lobes::Parallelism;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::inference::{FinishLearning, FinishModel};
use lobes::picture::encode_png;
use lobes_experiments::{
    FinishShots, FinishTable, Nuisances, Outline, Thing, ThingTally, finish_cross_entropy,
    finish_samples, judge_finishes, judge_things, learned_and_judged, simulate, simulate_thing,
    wilson,
};

pub(super) fn run(options: &Finishes) -> Result<()> {
    let (learned, judged) = learned_and_judged(builtin()?);
    let model = match &options.learn {
        Some(folder) => learn(folder, options, &learned)?,
        None => FinishModel::builtin()?,
    };
    if let Some(path) = &options.picture {
        return output::write_file(path, &sheet(&judged)?);
    }
    let shots = FinishShots {
        lights: options.judge.get(),
        seed: options.seed.unwrap_or(FinishShots::JUDGED.seed),
        ..FinishShots::JUDGED
    };
    let mut rows = Vec::new();
    let mut tables: Vec<(&str, Nuisances, Outline)> = Nuisances::listed()
        .into_iter()
        .map(|(name, nuisances)| (name, nuisances, Outline::Told))
        .collect();
    tables.push(("all, and the ball is found", Nuisances::ALL, Outline::Found));
    let bar = progress::bar(tables.len() * shots.lights + Thing::ALL.len(), "judging");
    for (name, nuisances, outline) in tables {
        let shots = FinishShots { nuisances, ..shots };
        let table = judge_finishes(
            &model,
            &judged,
            &shots,
            outline,
            Parallelism::Rayon,
            &|| {
                bar.inc(1);
            },
        )?;
        console::json(&json!({
            "nuisances": name,
            "photographs": table.count(),
            "right": table.right(),
            "unread": table.unread,
            "outlined": table.outlined,
            "prints": {
                "balls": table.prints.balls,
                "painted": table.prints.painted,
                "found": table.prints.found,
                "noticed": table.prints.noticed,
                "said": table.prints.said,
                "plain": table.prints.plain,
                "false_share": table.prints.false_share,
            },
            "usable": table.usable,
            "confusion": table.confusion,
            "sure": table.sure().0,
            "sure_and_right": table.sure().1,
            "intervals": table.intervals,
            "calibration": table.calibration,
        }))?;
        rows.push((name, table));
    }
    // Forty of each kind beside 150 lights.
    let each = (4 * shots.lights).div_ceil(15);
    let all = Parallelism::Rayon;
    let things = judge_things(&model, &judged, each, shots.seed, all, &|| bar.inc(1))?;
    for tally in &things {
        console::json(&json!({
            "thing": tally.thing.name(),
            "pictures": tally.pictures,
            "found": tally.found,
            "told": tally.told,
        }))?;
    }
    bar.finish_and_clear();
    let text = markdown(&rows, &things);
    console::answer(text.trim_end());
    let Some(path) = &options.write else {
        return Ok(());
    };
    if let Some((_, table)) = rows.last() {
        let plot = path.with_file_name("photographs-calibration.svg");
        output::write_file(&plot, calibration(table).as_bytes())?;
    }
    write_between_marks(path, &text)
}

/// Makes the model anew and writes it beside what it was made from.
fn learn(folder: &Path, options: &Finishes, maps: &[EnvironmentMap]) -> Result<FinishModel> {
    let begin = Instant::now();
    let shots = FinishShots {
        lights: options.lights.get(),
        balls: options.balls.get(),
        ..FinishShots::LEARNED
    };
    let bar = progress::bar(shots.lights, "taking photographs");
    let samples = finish_samples(maps, &shots, Parallelism::Rayon, &|| bar.inc(1))?;
    bar.finish_and_clear();
    console::note(format!(
        "{} photographs in {:.0} s",
        samples.len(),
        begin.elapsed().as_secs_f64()
    ));
    let plan = FinishLearning {
        epochs: options.epochs.get(),
        ..FinishLearning::default()
    };
    let bar = progress::bar(plan.epochs, "learning");
    let model = FinishModel::learn(&samples, &plan, Parallelism::Rayon, &|loss| {
        bar.inc(1);
        bar.suspend(|| console::note(format!("mean loss {loss:.4}")));
    })?;
    bar.finish_and_clear();
    let bytes = model.to_bytes();
    // What a test asks for again, on the processor that it runs on.
    let few = FinishShots {
        lights: FIRST_LIGHTS.min(shots.lights),
        ..shots
    };
    let first = finish_samples(maps, &few, Parallelism::Rayon, &|| ())?;
    let first = finish_cross_entropy(&model, &first, Parallelism::Rayon)?;
    let hash: String = Sha256::digest(&bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let provenance = json!({
        "what": "the model of finishes: temperature, centres and scales of the statistics, and the network, as little-endian f32",
        "licence": "CC0-1.0",
        "command": format!(
            "lobes finishes --learn data/models --lights {} --balls {} --epochs {}",
            shots.lights, shots.balls, plan.epochs
        ),
        "version": env!("CARGO_PKG_VERSION"),
        "lights": maps.iter().map(EnvironmentMap::name).collect::<Vec<_>>(),
        "seed": shots.seed,
        "photographs": samples.len(),
        "balls": shots.balls,
        "first_lights": few.lights,
        "cross_entropy_under_the_first_lights": first,
        "sha256": hash,
    });
    std::fs::create_dir_all(folder).map_err(|error| {
        Error::file(
            folder,
            format!("the folder cannot be made ({error})"),
            "name another",
        )
    })?;
    output::write_file(&folder.join("finish.bin"), &bytes)?;
    let text = format!("{provenance:#}\n");
    output::write_file(&folder.join("finish.json"), text.as_bytes())?;
    console::note(format!("made in {:.0} s", begin.elapsed().as_secs_f64()));
    Ok(model)
}

/// A sheet of photographs as they are judged, two of each light, in rows of twelve; in the last row
/// pictures without a ball.
fn sheet(maps: &[EnvironmentMap]) -> Result<Vec<u8>> {
    const COLUMNS: usize = 12;
    const ROWS: usize = 5;
    const CELL: usize = 96;
    let of_lights = Parallelism::Rayon.map(COLUMNS * (ROWS - 1) / 2, |light| {
        let seed = FinishShots::JUDGED.seed * 1_000_000 + light as u64;
        simulate(maps, Nuisances::ALL, seed, 2)
    });
    let mut photographs = Vec::new();
    for of_light in of_lights {
        for photograph in of_light? {
            photographs.push(photograph.picture()?);
        }
    }
    let things = Thing::ALL.iter().cycle().take(COLUMNS).zip(0u64..);
    for (thing, i) in things {
        photographs.push(simulate_thing(
            maps,
            *thing,
            FinishShots::JUDGED.seed * 1_000_000 + i,
        )?);
    }
    Ok(encode_png(
        COLUMNS * CELL,
        ROWS * CELL,
        1.0,
        |row, column| {
            let photograph = &photographs[row / CELL * COLUMNS + column / CELL];
            let side = photograph.width();
            // The mean of the photograph's pixels that the sheet's pixel covers; a margin of two.
            let range = |at: usize| {
                let place = |at: usize| at * side / (CELL - 2);
                place(at)..(place(at + 1)).max(place(at) + 1).min(side)
            };
            let (v, u) = (row % CELL, column % CELL);
            if v >= CELL - 2 || u >= CELL - 2 {
                return Some([1.0; 3]);
            }
            let mut sum = [0.0; 4];
            for y in range(v) {
                for x in range(u) {
                    let [r, g, b] = photograph.get(y, x).unwrap_or_default();
                    sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + 1.0];
                }
            }
            Some([sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]])
        },
    )?)
}

/// Tenths of fewer photographs than this are left out of the plot: they say little.
const FEW: usize = 10;

fn calibration(table: &FinishTable) -> String {
    let of = ANSWERS.iter().zip(&table.calibration_by_answer);
    let answers: Vec<(&str, Vec<(f64, f64)>)> = of
        .map(|(name, tenths)| {
            let enough = tenths.iter().filter(|(all, ..)| *all >= FEW);
            let points =
                enough.map(|(all, right, sum)| (sum / *all as f64, *right as f64 / *all as f64));
            (*name, points.collect())
        })
        .collect();
    answers_calibration(&answers)
}

/// The photographs of so many lights are looked at again by a test.
const FIRST_LIGHTS: usize = 4;

const ANSWERS: [&str; 5] = [
    "matte",
    "glossy plastic",
    "rough metal",
    "smooth metal",
    "no single finish",
];

fn percent(part: usize, whole: usize) -> String {
    if whole == 0 {
        "–".into()
    } else {
        format!("{:.1} %", 100.0 * part as f64 / whole as f64)
    }
}

fn markdown(rows: &[(&str, FinishTable)], things: &[ThingTally]) -> String {
    let mut text = String::new();
    let mut line = |line: String| {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{line}");
    };
    line("| nuisance | photographs | right | 95 % interval | at p ≥ 0.9 | of these right | 90 % intervals hold: σ | share | base colour |".into());
    line("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |".into());
    for (name, table) in rows {
        let (low, high) = wilson(table.right(), table.count(), 0.95);
        let (sure, right) = table.sure();
        let held = table.intervals.map(|(all, held)| percent(held, all));
        line(format!(
            "| {name} | {} | {} | {:.1} – {:.1} | {sure} | {} | {} |",
            table.count(),
            percent(table.right(), table.count()),
            100.0 * low,
            100.0 * high,
            percent(right, sure),
            held.join(" | "),
        ));
    }
    for (name, table) in rows.iter().rev().take(2).rev() {
        line(String::new());
        line(format!("Truth and answer, {name}:"));
        line(String::new());
        line(format!("| | {} | right |", ANSWERS.join(" | ")));
        line("| --- | ---: | ---: | ---: | ---: | ---: | ---: |".into());
        for (truth, (of, counts)) in ANSWERS.iter().zip(table.confusion).enumerate() {
            let all: usize = counts.iter().sum();
            let counts: Vec<String> = counts.iter().map(usize::to_string).collect();
            line(format!(
                "| {of} | {} | {} |",
                counts.join(" | "),
                percent(table.confusion[truth][truth], all)
            ));
        }
        line(String::new());
        line(format!(
            "In {} of {} the circle is right to {:.1} % of the radius; in {} the ball was not found or could not be read, and they count as wrong.",
            table.outlined,
            table.count(),
            100.0 * FinishTable::NEAR,
            table.unread
        ));
    }
    if let Some((name, table)) = rows.last() {
        line(String::new());
        line(format!(
            "How sure it was, and how often it was right, {name}:"
        ));
        line(String::new());
        line("| probability of the answer | answers | mean probability | right |".into());
        line("| --- | ---: | ---: | ---: |".into());
        for (tenth, (all, right, sum)) in table.calibration.iter().enumerate() {
            if *all > 0 {
                line(format!(
                    "| {:.1} – {:.1} | {all} | {:.2} | {} |",
                    tenth as f64 / 10.0,
                    (tenth + 1) as f64 / 10.0,
                    sum / *all as f64,
                    percent(*right, *all)
                ));
            }
        }
    }
    for (name, table) in rows.iter().rev().take(2).rev() {
        line(String::new());
        let prints = table.prints;
        line(format!(
            "Prints, {name}: on {} matte and glossy balls of which they cover 1 to 40 %, of the places that are said to be one {} are, and of the painted places {} are \
             said to be one and {} to be a print, a reflection or burnt out. Of {} such balls without a print {:.1} % of the places are said to be one.",
            prints.balls,
            percent(prints.found, prints.said),
            percent(prints.found, prints.painted),
            percent(prints.noticed, prints.painted),
            prints.plain,
            100.0 * prints.false_share / prints.plain.max(1) as f64
        ));
    }
    if let Some((name, table)) = rows.last() {
        line(String::new());
        line(format!(
            "How much of the ball is usable, and how often it was right, {name}:"
        ));
        line(String::new());
        line("| usable share of the ball | answers | right | 95 % interval |".into());
        line("| --- | ---: | ---: | ---: |".into());
        let [a, b, c] = FinishTable::USABLE.map(|least| format!("{:.0}", 100.0 * least));
        let classes = [
            format!("below {a} %"),
            format!("{a} – {b} %"),
            format!("{b} – {c} %"),
            format!("{c} – 100 %"),
        ];
        for (class, (all, right)) in classes.iter().zip(table.usable) {
            let (low, high) = wilson(right, all, 0.95);
            line(format!(
                "| {class} | {all} | {} | {:.1} – {:.1} |",
                percent(right, all),
                100.0 * low,
                100.0 * high
            ));
        }
    }
    line(String::new());
    line("Pictures without a ball, in which a finish that is told is a false alarm:".into());
    line(String::new());
    line("| what they show | pictures | something round found | a finish told |".into());
    line("| --- | ---: | ---: | ---: |".into());
    for tally in things {
        line(format!(
            "| {} | {} | {} | {} |",
            tally.thing.name(),
            tally.pictures,
            tally.found,
            tally.told
        ));
    }
    let sum = |of: fn(&ThingTally) -> usize| things.iter().map(of).sum::<usize>();
    let (pictures, told) = (sum(|t| t.pictures), sum(|t| t.told));
    let (low, high) = wilson(told, pictures, 0.95);
    line(format!(
        "| all | {pictures} | {} | {told}: {} ({:.1} – {:.1}) |",
        sum(|t| t.found),
        percent(told, pictures),
        100.0 * low,
        100.0 * high
    ));
    text
}
