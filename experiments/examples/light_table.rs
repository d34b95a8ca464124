//! How good the reading of light and reflectance is, beside what is asked of it: the table of
//! `docs/reference/light-table.md`.
//!
//! ```text
//! cargo run --release -p lobes-experiments --example light_table -- --whole
//! ```
//!
//! Without `--whole` the quick rows, on few maps and draws.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use lobes::evaluation::{Evaluator, Preset};
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::inference::{FinishModel, Plan, Scenes};
use lobes::reflectance::Variant;
use lobes::reflection::Settings;
use lobes::{Parallelism, Result};
use lobes_experiments::{
    Calibration, ContinuousReadings, FinishShots, KNOWN_BALLS, Outline, judge_finishes,
    learned_and_judged, light_of_known_balls, prior_chi_square, probe_accuracy, shape_roughness,
    simulated_ranks,
};

const MANY: Parallelism = Parallelism::Rayon;

/// What is asked of a number.
#[derive(Clone, Copy)]
enum Asked {
    AtMost(f64),
    AtLeast(f64),
    Within(f64, f64),
}

impl Asked {
    fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(most) => value <= most,
            Self::AtLeast(least) => value >= least,
            Self::Within(low, high) => (low..=high).contains(&value),
        }
    }

    fn text(self, decimals: usize, unit: &str) -> String {
        match self {
            Self::AtMost(most) => format!("≤ {most:.decimals$}{unit}"),
            Self::AtLeast(least) => format!("≥ {least:.decimals$}{unit}"),
            Self::Within(low, high) => format!("{low:.decimals$} – {high:.decimals$}{unit}"),
        }
    }
}

/// Prints a row: what, the number and what else is said of it, bar and goal, and which is met.
fn row(what: &str, value: f64, beside: &str, [bar, goal]: [Asked; 2], decimals: usize, unit: &str) {
    let verdict = match (bar.holds(value), goal.holds(value)) {
        (true, true) => "goal met",
        (true, false) => "bar met",
        (false, _) => "**missed**",
    };
    println!(
        "| {what} | {value:.decimals$}{unit}{beside} | {} | {} | {verdict} |",
        bar.text(decimals, unit),
        goal.text(decimals, unit)
    );
}

/// How far a part has come, on a terminal.
struct Progress {
    name: &'static str,
    of: usize,
    done: AtomicUsize,
    start: Instant,
}

impl Progress {
    fn new(name: &'static str, of: usize) -> Self {
        Self {
            name,
            of,
            done: AtomicUsize::new(0),
            start: Instant::now(),
        }
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let mut error = std::io::stderr();
        if error.is_terminal() {
            let seconds = self.start.elapsed().as_secs();
            // What cannot be shown is not missed.
            let _ = write!(
                error,
                "\r\x1b[K{} {done} of {}, {seconds} s",
                self.name, self.of
            );
            if done == self.of {
                let _ = write!(error, "\r\x1b[K");
            }
        }
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// The value below which a share of them lies; not a number of none.
fn quantile(values: &[f64], level: f64) -> f64 {
    let values = sorted(values);
    let place = (level * values.len() as f64) as usize;
    let place = place.min(values.len().saturating_sub(1));
    values.get(place).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<()> {
    let whole = std::env::args().any(|argument| argument == "--whole");
    let maps = builtin()?;
    let few = &maps[..if whole { maps.len() } else { 1 }];
    println!("| what | measured | bar | goal | |\n| --- | ---: | ---: | ---: | --- |");
    if whole {
        continuous(&maps)?;
        photographs(maps.clone())?;
    }
    known_light(few)?;
    prior(if whole { 1000 } else { 20 })?;
    shapes(&maps, whole)?;
    probes(few)?;
    evaluation(&maps, if whole { 100 } else { 1 })
}

fn continuous(maps: &[EnvironmentMap]) -> Result<()> {
    // As `lobes reproduce --protocol continuous` has it.
    let plan = Plan {
        lobe: Variant::default(),
        settings: Settings::default(),
        turns: 8,
    };
    let (scenes, _) = Scenes::of_maps(maps, MANY)?;
    let progress = Progress::new("random reflectances, maps", maps.len());
    let readings = ContinuousReadings::new(maps, &plan, 1, MANY, &|| progress.step())?;
    let progress = Progress::new("evidence, pictures", readings.count());
    let [_, _, (_, both)] = readings.judge(&plan, &scenes, MANY, &|| progress.step())?;
    let Calibration {
        count,
        sigma_error,
        share_error,
        coverage,
    } = both;
    let asked = [Asked::AtMost(5.0), Asked::AtMost(3.0)];
    let beside = format!(" of {count} pictures");
    row(
        "σ, both readers, median error",
        100.0 * sigma_error,
        &beside,
        asked,
        1,
        " %",
    );
    let asked = [Asked::AtMost(0.05), Asked::AtMost(0.03)];
    row(
        "share, both readers, median error",
        share_error,
        "",
        asked,
        3,
        "",
    );
    for (level, low, high) in [(0.5, 48.0, 52.0), (0.9, 88.0, 92.0)] {
        if let Some((_, sigma, share)) = coverage.iter().find(|of| of.0 == level) {
            for (name, held) in [("σ", sigma), ("share", share)] {
                let what = format!("{:.0} % intervals of {name} hold", 100.0 * level);
                row(
                    &what,
                    100.0 * held,
                    "",
                    [Asked::Within(low, high); 2],
                    1,
                    " %",
                );
            }
        }
    }
    Ok(())
}

/// Every fourth map, of which the model of finishes has not learned.
fn photographs(maps: Vec<EnvironmentMap>) -> Result<()> {
    let (_, judged) = learned_and_judged(maps);
    let progress = Progress::new("photographs, lights", FinishShots::JUDGED.lights);
    let model = FinishModel::builtin()?;
    let (shots, done) = (FinishShots::JUDGED, || progress.step());
    let table = judge_finishes(&model, &judged, &shots, Outline::Told, MANY, &done)?;
    for (name, (all, held)) in ["σ", "share", "base colour"].iter().zip(table.intervals) {
        let what = format!("90 % intervals of {name} hold, simulated photographs");
        let (held, beside) = (100.0 * held as f64 / all as f64, format!(" of {all}"));
        row(
            &what,
            held,
            &beside,
            [Asked::Within(88.0, 92.0); 2],
            1,
            " %",
        );
    }
    Ok(())
}

fn known_light(maps: &[EnvironmentMap]) -> Result<()> {
    let progress = Progress::new("light of known balls", maps.len() * KNOWN_BALLS.len());
    let all = light_of_known_balls(maps, &KNOWN_BALLS, MANY, &|| progress.step())?;
    for ((ball, of_maps), bar) in KNOWN_BALLS.iter().zip(&all).zip([0.5, 2.0, 3.0, 5.0]) {
        let irradiance: Vec<f64> = of_maps.iter().map(|of| 100.0 * of.irradiance).collect();
        let worst = quantile(&irradiance, 1.0);
        let beside = format!(" at the most, {:.2} % median", quantile(&irradiance, 0.5));
        let what = format!("irradiance, reflectance known: {}", ball.name);
        row(
            &what,
            worst,
            &beside,
            [Asked::AtMost(bar), Asked::AtMost(0.5 * bar)],
            2,
            " %",
        );
        assert!(worst < 10.0, "{}: {worst}", ball.name);
    }
    for (ball, of_maps) in KNOWN_BALLS.iter().zip(&all) {
        let squares: Vec<f64> = of_maps.iter().map(|of| of.chi_square).collect();
        let beside = format!(" median, {:.2} at the most", quantile(&squares, 1.0));
        let what = format!("χ² per degree of freedom, captured light: {}", ball.name);
        let asked = [Asked::Within(0.9, 1.1), Asked::Within(0.97, 1.03)];
        row(&what, quantile(&squares, 0.5), &beside, asked, 2, "");
    }
    Ok(())
}

fn prior(draws: usize) -> Result<()> {
    let progress = Progress::new("draws of the prior", KNOWN_BALLS.len() + 1);
    for ball in &KNOWN_BALLS {
        let square = prior_chi_square(ball, draws, MANY)?;
        progress.step();
        let what = format!(
            "χ² per degree of freedom, light of the prior: {}",
            ball.name
        );
        let asked = [Asked::Within(0.9, 1.1), Asked::Within(0.97, 1.03)];
        row(&what, square, &format!(", {draws} draws"), asked, 3, "");
    }
    for of in simulated_ranks(draws, MANY)? {
        let (square, more) = of.uniformity();
        let beside = format!(", χ² {square:.1}, {draws} draws");
        let what = format!("ranks of {} uniform, probability of more", of.parameter);
        row(&what, more, &beside, [Asked::AtLeast(0.01); 2], 3, "");
        assert!(more > 1e-4, "{}: χ² {square}", of.parameter);
    }
    progress.step();
    Ok(())
}

/// Maps 1, 7 and 13 are those under which the noise that is taken for a shape was chosen.
fn shapes(maps: &[EnvironmentMap], whole: bool) -> Result<()> {
    let others = maps
        .iter()
        .enumerate()
        .filter(|(i, _)| ![1, 7, 13].contains(i));
    let others = others.map(|(_, map)| map.clone());
    let others: Vec<_> = others.take(if whole { maps.len() } else { 1 }).collect();
    let progress = Progress::new("shapes, maps", others.len());
    let found = shape_roughness(&others, MANY, &|| progress.step())?;
    for (name, errors) in [
        ("of balls", &found.balls),
        ("of shapes with known normals", &found.shapes),
        ("of hills, by normals to 37°", &found.parts),
    ] {
        let what = format!("σ {name}, by evidence, median error");
        let beside = format!(" of {}", errors.len());
        let asked = [Asked::AtMost(8.0), Asked::AtMost(5.0)];
        row(
            &what,
            100.0 * quantile(errors, 0.5),
            &beside,
            asked,
            1,
            " %",
        );
    }
    Ok(())
}

fn probes(maps: &[EnvironmentMap]) -> Result<()> {
    let progress = Progress::new("mirror balls", maps.len());
    let found = probe_accuracy(maps, MANY, &|| progress.step())?;
    let within = |what: &str, errors: &[f64], bar: f64, scale: f64, unit: &str| {
        let all = errors.len();
        let held = errors.iter().filter(|error| **error <= bar / scale).count();
        let beside = format!(" in 95 %; {held} of {all} within the bar");
        let value = scale * quantile(errors, 0.95);
        let asked = [Asked::AtMost(bar), Asked::AtMost(0.5 * bar)];
        row(&format!("probe: {what}"), value, &beside, asked, 2, unit);
    };
    let circles = ["found", "given"].into_iter().enumerate();
    for (which, circle) in circles {
        within(
            &format!("sun, circle {circle}"),
            &found.sun[which],
            0.5,
            1.0,
            "°",
        );
        let what = format!("irradiance, circle {circle}");
        within(&what, &found.irradiance[which], 2.0, 100.0, " %");
    }
    let what = format!("radius, {} of {} not found", found.missed, maps.len());
    within(&what, &found.radius, 0.3, 100.0, " %");
    Ok(())
}

/// Maps are in memory already.
fn evaluation(maps: &[EnvironmentMap], pairs: usize) -> Result<()> {
    let progress = Progress::new("pairs", pairs);
    let start = Instant::now();
    let evaluator = Evaluator::new(Preset::Recommended.protocol()?, 128, MANY)?;
    let done = MANY.map(pairs, |pair| {
        // Another map each time.
        let truth = pair % maps.len();
        let estimate = (truth + 1 + pair / maps.len()) % maps.len();
        let errors = evaluator.evaluate(&maps[truth], &maps[estimate], Parallelism::Sequential);
        progress.step();
        errors
    });
    done.into_iter().collect::<Result<Vec<_>>>()?;
    let what = format!("evaluate: {pairs} pairs of three balls, 128 × 128, on this machine");
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let beside = format!(" on {threads} threads");
    let asked = [Asked::AtMost(20.0), Asked::AtMost(10.0)];
    row(
        &what,
        start.elapsed().as_secs_f64(),
        &beside,
        asked,
        1,
        " s",
    );
    Ok(())
}
