//! Transforms, rotation and values at directions: `cargo bench --bench harmonics`.
//!
//! With `peers` as its only argument it answers `scripts/bench-peers` instead: one line asks for
//! `operation degree batch threads seconds`, one line answers with the shortest time of those that
//! fit into so many seconds, and with four values of the result.

use std::hint::black_box;
use std::io::{BufRead, Write};
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion};
use lobes::Parallelism;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{
    Basis, Coefficients, Rotation, ScatteredTransform, SingleTransform, SplatBasis, SplatRotation,
    Transform,
};
use lobes::sphere::Grid;

/// Numbers in [−1, 1) that `scripts/bench-peers` makes too.
fn numbers(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 * f64::EPSILON - 1.0
        })
        .collect()
}

fn directions(count: usize) -> Vec<DVec3> {
    numbers(7, 3 * count)
        .as_chunks()
        .0
        .iter()
        .map(|d| DVec3::from_array(*d).normalize())
        .collect()
}

fn turn() -> DQuat {
    DQuat::from_rotation_z(0.3) * DQuat::from_rotation_y(0.7) * DQuat::from_rotation_z(1.1)
}

/// Four values of a result, a fifth of it apart.
fn samples(values: &[f64]) -> [f64; 4] {
    std::array::from_fn(|i| values[(i + 1) * values.len() / 5])
}

const OPERATIONS: [&str; 15] = [
    "synthesis",
    "analysis",
    "single-synthesis",
    "single-analysis",
    "rotation",
    "values",
    "gradients",
    "splats",
    "splats-each",
    "plan-1e-6",
    "plan-1e-12",
    "sums-1e-6",
    "sums-1e-12",
    "adjoint-1e-6",
    "adjoint-1e-12",
];

/// The tolerance at the end of an operation's name.
fn tolerance_of(name: &str) -> f64 {
    if name.ends_with("-12") { 1e-12 } else { 1e-6 }
}

/// One operation, ready to run.
fn operation(
    name: &str,
    degree: usize,
    batch: usize,
    parallelism: Parallelism,
) -> lobes::Result<Box<dyn FnMut() -> lobes::Result<[f64; 4]>>> {
    let count = (degree + 1).pow(2);
    Ok(match name {
        "synthesis" | "analysis" => {
            let transform =
                Transform::new(&Grid::gauss_legendre(degree + 1, 2 * degree + 2)?, degree)?;
            let mut sets = numbers(1, batch * count);
            let mut maps = vec![0.0; batch * transform.grid().len()];
            let mut scratch = vec![0.0; transform.scratch_len(batch)];
            transform.synthesise_into(batch, &sets, &mut maps, &mut scratch, parallelism)?;
            if name == "synthesis" {
                Box::new(move || {
                    transform
                        .synthesise_into(batch, &sets, &mut maps, &mut scratch, parallelism)
                        .map(|()| samples(&maps))
                })
            } else {
                Box::new(move || {
                    transform
                        .analyse_into(batch, &maps, &mut sets, &mut scratch, parallelism)
                        .map(|()| samples(&sets))
                })
            }
        }
        "single-synthesis" | "single-analysis" => {
            let grid = Grid::gauss_legendre(degree + 1, 2 * degree + 2)?;
            let transform = SingleTransform::new(&grid, degree)?;
            let mut set: Vec<f32> = numbers(1, count)
                .iter()
                .map(|&value| value as f32)
                .collect();
            let mut map = vec![0.0; grid.len()];
            let mut scratch = vec![0.0; transform.scratch_len()];
            transform.synthesise_into(&set, &mut map, &mut scratch, parallelism)?;
            let shown = |values: &[f32]| {
                std::array::from_fn(|i| f64::from(values[(i + 1) * values.len() / 5]))
            };
            if name == "single-synthesis" {
                Box::new(move || {
                    transform
                        .synthesise_into(&set, &mut map, &mut scratch, parallelism)
                        .map(|()| shown(&map))
                })
            } else {
                Box::new(move || {
                    transform
                        .analyse_into(&map, &mut set, &mut scratch, parallelism)
                        .map(|()| shown(&set))
                })
            }
        }
        "rotation" => {
            let plan = Rotation::new(degree)?;
            let f = Coefficients::from_vec(degree, degree, numbers(1, count))?;
            let mut g = Coefficients::zeros(degree);
            let mut scratch = vec![0.0; plan.scratch_len()];
            Box::new(move || {
                plan.rotate_into(&f, turn(), &mut g, &mut scratch, parallelism)
                    .map(|()| samples(g.as_slice()))
            })
        }
        "values" => {
            let basis = Basis::new(degree)?;
            let directions = directions(batch);
            let mut out = vec![0.0; batch * count];
            Box::new(move || {
                basis
                    .values(&directions, &mut out, parallelism)
                    .map(|()| samples(&out))
            })
        }
        "gradients" => {
            let basis = Basis::new(degree)?;
            let directions = directions(batch);
            let mut values = vec![0.0; batch * count];
            let mut gradients = vec![0.0; 3 * batch * count];
            Box::new(move || {
                basis
                    .values_and_gradients(&directions, &mut values, &mut gradients, parallelism)
                    .map(|()| samples(&gradients))
            })
        }
        "splats" | "splats-each" => {
            let plan = SplatRotation::new(degree, SplatBasis::Inria)?;
            let mut sets: Vec<f32> = numbers(1, batch * count)
                .iter()
                .map(|x| *x as f32)
                .collect();
            let turns: Vec<DQuat> = directions(if name == "splats" { 1 } else { batch })
                .into_iter()
                .map(|axis| DQuat::from_axis_angle(axis, 0.7))
                .collect();
            Box::new(move || {
                plan.rotate(&mut sets, &turns, parallelism)?;
                Ok(std::array::from_fn(|i| f64::from(sets[i])))
            })
        }
        // Of so many directions to a tolerance: their plan, sums, and the adjoint.
        "plan-1e-6" | "plan-1e-12" => {
            let (directions, tolerance) = (directions(batch), tolerance_of(name));
            Box::new(move || {
                ScatteredTransform::new(degree, &directions, tolerance, parallelism)
                    .map(|plan| [plan.scratch_len() as f64; 4])
            })
        }
        "sums-1e-6" | "sums-1e-12" | "adjoint-1e-6" | "adjoint-1e-12" => {
            let (directions, tolerance) = (directions(batch), tolerance_of(name));
            let plan = ScatteredTransform::new(degree, &directions, tolerance, parallelism)?;
            let mut set = numbers(1, count);
            let mut values = numbers(2, batch);
            let mut scratch = vec![0.0; plan.scratch_len()];
            if name.starts_with("sums") {
                Box::new(move || {
                    plan.synthesise_into(&set, &mut values, &mut scratch, parallelism)
                        .map(|()| samples(&values))
                })
            } else {
                Box::new(move || {
                    plan.synthesise_adjoint_into(&values, &mut set, &mut scratch, parallelism)
                        .map(|()| samples(&set))
                })
            }
        }
        other => {
            return Err(lobes::Error::UnknownName {
                what: "operation",
                name: other.into(),
                names: OPERATIONS.map(String::from).into(),
            });
        }
    })
}

/// Answers `scripts/bench-peers` until its input ends.
fn serve() -> Result<(), Box<dyn std::error::Error>> {
    let mut cache = None;
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let [name, degree, batch, threads, budget] = words[..] else {
            return Err(format!("{line:?} is not a question").into());
        };
        let key = format!("{name} {degree} {batch} {threads}");
        if cache.as_ref().is_none_or(|(k, _)| *k != key) {
            drop(cache.take());
            let parallelism = if threads == "1" {
                Parallelism::Sequential
            } else {
                Parallelism::Rayon
            };
            let run = operation(name, degree.parse()?, batch.parse()?, parallelism)?;
            cache = Some((key, run));
        }
        let Some((_, run)) = &mut cache else { continue };
        let budget = Duration::from_secs_f64(budget.parse()?);
        let (mut best, begin) = (Duration::MAX, Instant::now());
        let values = loop {
            let start = Instant::now();
            let values = black_box(run()?);
            best = best.min(start.elapsed());
            if begin.elapsed() > budget {
                break values;
            }
        };
        let [a, b, c, d] = values;
        println!("{:e} {a:?} {b:?} {c:?} {d:?}", best.as_secs_f64());
        std::io::stdout().flush()?;
    }
    Ok(())
}

fn benchmark(criterion: &mut Criterion) {
    for (name, degrees) in [
        ("synthesis", &[63, 255, 1023][..]),
        ("analysis", &[63, 255, 1023]),
        ("single-synthesis", &[63, 255, 1023]),
        ("single-analysis", &[63, 255, 1023]),
        ("rotation", &[64, 256]),
    ] {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        for &degree in degrees {
            let Ok(mut run) = operation(name, degree, 1, Parallelism::Sequential) else {
                continue;
            };
            group.bench_function(BenchmarkId::from_parameter(degree), |b| b.iter(&mut run));
        }
    }
    let mut group = criterion.benchmark_group("ten million sets in f32");
    group.sample_size(10);
    for name in ["splats", "splats-each"] {
        if let Ok(mut run) = operation(name, 3, 10_000_000, Parallelism::Sequential) {
            group.bench_function(BenchmarkId::new(name, 3), |b| b.iter(&mut run));
        }
    }
    group.finish();
    let mut group = criterion.benchmark_group("a million directions, degree 255");
    group.sample_size(10);
    for name in &OPERATIONS[9..] {
        if let Ok(mut run) = operation(name, 255, 1_000_000, Parallelism::Sequential) {
            group.bench_function(*name, |b| b.iter(&mut run));
        }
    }
    group.finish();
    for name in ["values", "gradients"] {
        let mut group = criterion.benchmark_group(format!("{name} at 1000 directions"));
        for degree in [8, 16, 45] {
            let Ok(mut run) = operation(name, degree, 1000, Parallelism::Sequential) else {
                continue;
            };
            group.bench_function(BenchmarkId::from_parameter(degree), |b| b.iter(&mut run));
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    if std::env::args().nth(1).as_deref() == Some("peers") {
        return serve();
    }
    let mut criterion = Criterion::default().configure_from_args();
    benchmark(&mut criterion);
    criterion.final_summary();
    Ok(())
}
