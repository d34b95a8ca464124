//! The renderer against the reference: every lobe, roughness, built-in map and tolerance, pixels
//! chosen at random.
//!
//! ```text
//! cargo run --release --example renderer_accuracy -- --whole > docs/reference/rendering.md
//! ```
//!
//! Without `--whole` it takes one map, one lobe, one σ and one tolerance, and four pixels of each;
//! `--maps`, `--lobes`, `--sigmas`, `--tolerances`, `--pixels` and `--seed` choose others.
//! `--itself` takes the renderer at a tenth of the tolerance for the truth, which is a thousand
//! times faster: many points show what few do not, as long as the two are not wrong together.
//!
//! A cell is a map, a lobe, a σ and a tolerance; its pixels are few, and the table pools those of
//! all maps and lobes. It ends with an error if of a row the 99.9th percentile passes the
//! tolerance, or if an estimate is less than half the error of its cell (but not of many pixels,
//! with `--itself`). Cells that are done are told on standard error.

mod arguments;

use std::process::ExitCode;
use std::time::Instant;

use arguments::list;
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Renderer, ShadingPoint, reference};
use lobes::{Error, Parallelism, Result};
use rand::RngExt;

const SIZE: usize = 128;

const SIGMAS: [f64; 8] = [0.0, 0.005, 0.01, 0.03, 0.05, 0.1, 0.2, 0.4];

/// Half of the pixels have a cosine below this.
const SLANTED: f64 = 0.35;

struct Options {
    pixels: usize,
    seed: u64,
    tolerances: Vec<f64>,
    sigmas: Vec<f64>,
    lobes: Vec<Variant>,
    /// Each with its place among all.
    maps: Vec<(u128, EnvironmentMap)>,
    itself: bool,
}

/// What came of a cell.
struct Cell {
    map: String,
    lobe: Variant,
    sigma: f64,
    tolerance: f64,
    /// What the rendering said of itself, and how long it took.
    estimate: f64,
    seconds: f64,
    /// The error and the cosine of each pixel.
    pixels: Vec<(f64, f64)>,
    failure: Option<Error>,
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Waves, a checkerboard, and a sun of one pixel at 10⁵ times the mean.
fn sunny() -> Result<EnvironmentMap> {
    let mut pixels: Vec<[f64; 3]> = (0..512 * 256)
        .map(|index| {
            let (row, column) = (index / 512, index % 512);
            let board = ((row / 16 + column / 16) % 2) as f64;
            let wave = 1.0 + 0.9 * (row as f64 / 40.0).sin();
            [wave + board, wave, 0.3 + board]
        })
        .collect();
    pixels[70 * 512 + 200] = [1.5e5; 3];
    EnvironmentMap::new("one-pixel-sun", 512, 256, pixels)
}

impl Options {
    fn read() -> Result<Self> {
        let flag = |name: &str| std::env::args().any(|argument| argument == name);
        let whole = flag("--whole");
        let default = |all: &[f64], one: f64| if whole { all.to_vec() } else { vec![one] };
        let all = &Variant::ALL[..];
        let names: Vec<String> = list("--maps", &[])?;
        let mut maps = builtin()?;
        maps.push(sunny()?);
        let mut maps: Vec<_> = (0..).zip(maps).collect();
        maps.retain(|(_, map)| names.is_empty() || names.iter().any(|name| name == map.name()));
        if !whole && names.is_empty() {
            maps.truncate(1);
        }
        Ok(Self {
            pixels: list("--pixels", &[if whole { 8usize } else { 4 }])?[0],
            seed: list("--seed", &[1u64])?[0],
            tolerances: list("--tolerances", &default(&[1e-2, 1e-3, 1e-4], 1e-3))?,
            sigmas: list("--sigmas", &default(&SIGMAS, 0.05))?,
            lobes: list("--lobes", if whole { all } else { &all[..1] })?,
            maps,
            itself: flag("--itself"),
        })
    }

    /// All cells of a map.
    fn cells(&self, stream: u128, map: &EnvironmentMap) -> Result<Vec<Cell>> {
        let renderer = Renderer::new(map, Parallelism::Sequential)?;
        let camera = Camera::orthographic(DVec3::new(0.3, 0.2, 1.0), DVec3::Y)?;
        let places = (0..SIZE * SIZE)
            .filter_map(|index| camera.pixel(SIZE, index / SIZE, index % SIZE))
            .collect::<Vec<_>>();
        // A stream of its own, so that each map's pixels are the same whatever the others are.
        let mut random = rand_pcg::Pcg64::new(u128::from(self.seed), stream);
        let mut cells = Vec::new();
        for &sigma in &self.sigmas {
            let material = Material::from_albedos("m", [0.05, 0.1, 0.15], [0.85, 0.8, 0.7], sigma)?;
            // A mirror is one whatever the lobe.
            let lobes = if sigma == 0.0 {
                &self.lobes[..1]
            } else {
                &self.lobes
            };
            for &lobe in lobes {
                let mut chosen = Vec::new();
                while chosen.len() < self.pixels {
                    let place = random.random_range(0..places.len());
                    if chosen.len() % 2 == 0 || cosine(&places[place]) < SLANTED {
                        chosen.push(place);
                    }
                }
                let few: Vec<ShadingPoint> = chosen.iter().map(|&place| places[place]).collect();
                let least = self.tolerances.iter().copied().fold(0.1, f64::min);
                let exact = |point: &ShadingPoint| {
                    let seen =
                        reference(map, &material, lobe, point.normal, point.view, 0.02 * least)?;
                    Ok(seen.value)
                };
                let truth = match self.itself {
                    true => None,
                    false => Some(few.iter().map(exact).collect::<Result<Vec<_>>>()?),
                };
                for &tolerance in &self.tolerances {
                    let start = Instant::now();
                    let list = |points, tolerance| {
                        renderer.radiance(
                            &material,
                            lobe,
                            points,
                            tolerance,
                            Parallelism::Sequential,
                        )
                    };
                    let rendering = list(if self.itself { &few } else { &places }, tolerance);
                    let mut cell = Cell {
                        map: map.name().to_owned(),
                        lobe,
                        sigma,
                        tolerance,
                        estimate: 0.0,
                        seconds: start.elapsed().as_secs_f64(),
                        pixels: Vec::new(),
                        failure: None,
                    };
                    match (rendering, &truth) {
                        (Err(error), _) => cell.failure = Some(error),
                        (Ok((values, estimate)), Some(truth)) => {
                            cell.estimate = estimate;
                            let got: Vec<_> = chosen.iter().map(|&place| values[place]).collect();
                            cell.compare(&few, &got, truth, picture_mean(&values));
                        }
                        (Ok((values, estimate)), None) => {
                            cell.estimate = estimate;
                            let truth = list(&few, 0.1 * tolerance)?.0;
                            cell.compare(&few, &values, &truth, picture_mean(&values));
                        }
                    }
                    eprintln!("{}", cell.line());
                    cells.push(cell);
                }
            }
        }
        Ok(cells)
    }
}

impl Cell {
    fn compare(
        &mut self,
        points: &[ShadingPoint],
        got: &[[f64; 3]],
        truth: &[[f64; 3]],
        picture: f64,
    ) {
        for ((point, got), truth) in points.iter().zip(got).zip(truth) {
            let difference = (0..3)
                .map(|channel| (got[channel] - truth[channel]).abs())
                .fold(0.0, f64::max);
            let error = difference / mean(truth).max(0.01 * picture);
            self.pixels.push((error, cosine(point)));
        }
    }

    /// The error and the cosine of the worst pixel.
    fn worst(&self) -> (f64, f64) {
        self.pixels.iter().fold(
            (0.0, 0.0),
            |worst, &pixel| if pixel.0 > worst.0 { pixel } else { worst },
        )
    }

    fn line(&self) -> String {
        let Self {
            map,
            lobe,
            sigma,
            tolerance,
            estimate,
            seconds,
            ..
        } = self;
        let (error, cosine) = self.worst();
        let failure = self
            .failure
            .as_ref()
            .map(|error| format!("; {error}"))
            .unwrap_or_default();
        format!(
            "{map}, {lobe}, σ {sigma}, to {tolerance:e}: estimate {estimate:.1e}, error {error:.1e} at cosine {cosine:.2}, {seconds:.3} s{failure}"
        )
    }
}

fn mean(value: &[f64; 3]) -> f64 {
    value.iter().sum::<f64>() / 3.0
}

fn picture_mean(values: &[[f64; 3]]) -> f64 {
    values.iter().map(mean).sum::<f64>() / values.len() as f64
}

fn cosine(point: &ShadingPoint) -> f64 {
    point.normal.dot(point.view)
}

fn run() -> Result<bool> {
    let options = Options::read()?;
    let cells = Parallelism::Rayon.map(options.maps.len(), |index| {
        let (stream, map) = &options.maps[index];
        options.cells(*stream, map)
    });
    let cells: Vec<Cell> = cells
        .into_iter()
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let truth = if options.itself {
        "the renderer at a tenth of the tolerance"
    } else {
        "the reference"
    };
    println!("# The renderer against {truth}\n");
    println!(
        "What `cargo run --release --example renderer_accuracy -- {}` prints: {} maps, {} lobes, 128² pixels, of which {} a cell are compared, every second one of them where the \
         view's cosine is below {SLANTED}. Errors are over the tolerance, in the sense of `reflection::Settings`; the estimate is the picture's own, and the ratio the least of any cell \
         whose error is above a hundredth of the tolerance. Seconds are of one core for {}, every core being busy: the middle one and the largest.\n",
        std::env::args().skip(1).collect::<Vec<_>>().join(" "),
        options.maps.len(),
        options.lobes.len(),
        options.pixels,
        if options.itself { "those" } else { "a picture" },
    );
    println!(
        "| σ | tolerance | pixels | median | 99.9 % | largest | where | estimate over error | seconds |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut passed = true;
    for &sigma in &options.sigmas {
        for &tolerance in &options.tolerances {
            let row: Vec<&Cell> = cells
                .iter()
                .filter(|cell| cell.sigma == sigma && cell.tolerance == tolerance)
                .collect();
            passed &= print_row(&row, sigma, tolerance);
        }
    }
    let failed: Vec<&Cell> = cells
        .iter()
        .filter(|cell| cell.failure.is_some() || cell.estimate < 0.5 * cell.worst().0)
        .collect();
    let (many, all) = (failed.len(), cells.len());
    if options.itself {
        println!(
            "\nThe worst of {} pixels was off by more than twice the estimate, which speaks of one pixel in a thousand, in {many} cells of {all}.\n",
            options.pixels
        );
    } else {
        println!(
            "\nThe estimate was less than half the error, or above the tolerance, in {many} cells of {all}."
        );
    }
    for cell in &failed {
        println!("- {}", cell.line());
    }
    let answered = cells.iter().all(|cell| cell.failure.is_none());
    Ok(passed && answered && (options.itself || failed.is_empty()))
}

/// Whether its 99.9th percentile keeps the tolerance.
fn print_row(row: &[&Cell], sigma: f64, tolerance: f64) -> bool {
    let mut errors: Vec<f64> = row
        .iter()
        .flat_map(|cell| cell.pixels.iter().map(|pixel| pixel.0 / tolerance))
        .collect();
    errors.sort_by(f64::total_cmp);
    let Some(worst) = row
        .iter()
        .max_by(|a, b| a.worst().0.total_cmp(&b.worst().0))
    else {
        return true;
    };
    if errors.is_empty() {
        return false;
    }
    let quantile = |share: f64| {
        errors[((errors.len() as f64 * share).ceil() as usize).clamp(1, errors.len()) - 1]
    };
    let ratio = row
        .iter()
        .filter(|cell| cell.worst().0 > 0.01 * tolerance)
        .map(|cell| cell.estimate / cell.worst().0)
        .fold(f64::INFINITY, f64::min);
    let ratio = if ratio.is_finite() {
        format!("{ratio:.2}")
    } else {
        "–".to_owned()
    };
    let mut seconds: Vec<f64> = row.iter().map(|cell| cell.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    println!(
        "| {sigma} | {tolerance:e} | {} | {:.4} | {:.3} | {:.3} | {}, {}, cosine {:.2} | {ratio} | {:.3}, {:.2} |",
        errors.len(),
        quantile(0.5),
        quantile(0.999),
        quantile(1.0),
        worst.map,
        worst.lobe,
        worst.worst().1,
        seconds[seconds.len() / 2],
        seconds[seconds.len() - 1],
    );
    quantile(0.999) <= 1.0
}
