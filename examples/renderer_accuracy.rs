//! The renderer against the reference: every lobe, roughness, built-in map and tolerance, pixels chosen at random.
//!
//! ```text
//! cargo run --release --example renderer_accuracy -- --whole --pixels 8 --seed 1 --tolerances 1e-2,1e-3
//! ```
//!
//! Without `--whole` it takes one map, one lobe, one σ and one tolerance; `--maps`, `--lobes`, `--sigmas` and `--tolerances` choose others.
//!
//! Each line is a cell: a map, a lobe, a σ and a tolerance; what the 128² picture said its error was, and what it is in the pixels
//! that the reference did too. The pixels of one cell are few; the summary pools those of all maps. It ends with an error if the pooled
//! error at the 99.9th percentile passes a tolerance, or if an estimate is less than half the error of its cell.

use std::process::ExitCode;
use std::time::Instant;

use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Renderer, Settings, reference};
use lobes::{Error, Parallelism, Result};
use rand::{RngExt, SeedableRng};

const SIZE: usize = 128;

const SIGMAS: [f64; 8] = [0.0, 0.005, 0.01, 0.03, 0.05, 0.1, 0.2, 0.4];

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

/// What follows `--name`, split at commas.
fn list<T: std::str::FromStr + Clone>(name: &str, default: &[T]) -> Result<Vec<T>> {
    let arguments: Vec<String> = std::env::args().collect();
    let Some(at) = arguments.iter().position(|argument| argument == name) else {
        return Ok(default.to_vec());
    };
    let bad = || Error::Unanswerable(format!("{name} wants values with commas between them"));
    let values = arguments.get(at + 1).ok_or_else(bad)?;
    values
        .split(',')
        .map(|value| value.parse().map_err(|_| bad()))
        .collect()
}

fn run() -> Result<bool> {
    let whole = std::env::args().any(|argument| argument == "--whole");
    let default = |all: &[f64], one: f64| if whole { all.to_vec() } else { vec![one] };
    let pixels = list("--pixels", &[if whole { 8usize } else { 4 }])?[0];
    let seed = list("--seed", &[1u64])?[0];
    let tolerances = list("--tolerances", &default(&[1e-2, 1e-3, 1e-4], 1e-3))?;
    let sigmas = list("--sigmas", &default(&SIGMAS, 0.05))?;
    let all = &Variant::ALL[..];
    let lobes = list("--lobes", if whole { all } else { &all[..1] })?;
    let names: Vec<String> = list("--maps", &[])?;
    let mut maps = builtin()?;
    maps.push(sunny()?);
    maps.retain(|map| names.is_empty() || names.iter().any(|name| name == map.name()));
    if !whole && names.is_empty() {
        maps.truncate(1);
    }
    let camera = Camera::orthographic(DVec3::new(0.3, 0.2, 1.0), DVec3::Y)?;
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    println!("map, lobe, sigma, tolerance, estimate, error, worst cosine, seconds");
    let mut pool: Vec<Vec<f64>> = vec![Vec::new(); tolerances.len()];
    let mut failures = Vec::new();
    for map in &maps {
        let renderer = Renderer::new(map, Parallelism::Rayon)?;
        for &sigma in &sigmas {
            let material = Material::from_albedos("m", [0.05, 0.1, 0.15], [0.85, 0.8, 0.7], sigma)?;
            for (index, &lobe) in lobes.iter().enumerate() {
                if sigma == 0.0 && index > 0 {
                    continue;
                }
                // Half of the pixels anywhere, half of them where the view is grazing.
                let mut chosen = Vec::new();
                while chosen.len() < pixels {
                    let (row, column) =
                        (random.random_range(0..SIZE), random.random_range(0..SIZE));
                    if let Some(sight) = camera.pixel(SIZE, row, column)
                        && (chosen.len() % 2 == 0 || sight.normal.dot(sight.view) < 0.35)
                    {
                        chosen.push((row, column, sight));
                    }
                }
                let truth = Parallelism::Rayon.map(chosen.len(), |index| {
                    let sight = chosen[index].2;
                    reference(map, &material, lobe, sight.normal, sight.view, 2e-6)
                });
                let truth = truth.into_iter().collect::<Result<Vec<_>>>()?;
                for (pool, &tolerance) in pool.iter_mut().zip(&tolerances) {
                    let settings = Settings {
                        size: SIZE,
                        tolerance,
                        ..Settings::default()
                    };
                    let cell = format!("{}, {lobe}, {sigma}, {tolerance:e}", map.name());
                    let start = Instant::now();
                    let rendering = match renderer.render(
                        &material,
                        lobe,
                        &camera,
                        &settings,
                        Parallelism::Sequential,
                    ) {
                        Ok(rendering) => rendering,
                        Err(error) => {
                            println!("{cell}: {error}");
                            failures.push(format!("{cell}: {error}"));
                            continue;
                        }
                    };
                    let seconds = start.elapsed().as_secs_f64();
                    let mean = |value: [f64; 3]| value.iter().sum::<f64>() / 3.0;
                    let picture = mean(rendering.image.mean());
                    let mut worst = (0.0, 0.0);
                    for ((row, column, sight), truth) in chosen.iter().zip(&truth) {
                        let Some(got) = rendering.image.get(*row, *column) else {
                            continue;
                        };
                        let difference = (0..3)
                            .map(|channel| (got[channel] - truth.value[channel]).abs())
                            .fold(0.0, f64::max);
                        let error = difference / mean(truth.value).max(0.01 * picture);
                        pool.push(error / tolerance);
                        if error > worst.0 {
                            worst = (error, sight.normal.dot(sight.view));
                        }
                    }
                    println!(
                        "{cell}, {:.1e}, {:.1e}, {:.2}, {seconds:.3}",
                        rendering.error, worst.0, worst.1
                    );
                    if rendering.error < 0.5 * worst.0 {
                        failures.push(format!(
                            "{cell}: the estimate {:.1e} is less than half the error {:.1e} (cosine {:.2})",
                            rendering.error, worst.0, worst.1
                        ));
                    }
                }
            }
        }
    }
    let mut passed = failures.is_empty();
    for (pool, tolerance) in pool.iter_mut().zip(&tolerances) {
        pool.sort_by(f64::total_cmp);
        let Some(last) = pool.last() else { continue };
        let at = ((pool.len() as f64 * 0.999).ceil() as usize).clamp(1, pool.len()) - 1;
        println!(
            "tolerance {tolerance:e}: {} pixels, error over tolerance {:.3} at the 99.9th percentile, {:.3} at the median, {last:.3} at most",
            pool.len(),
            pool[at],
            pool[pool.len() / 2]
        );
        passed &= pool[at] <= 1.0;
    }
    for failure in &failures {
        println!("FAILED {failure}");
    }
    Ok(passed)
}
