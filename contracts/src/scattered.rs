//! Sums at many directions by Fourier transforms, against the definition and against sums one by
//! one.

use serde::Deserialize;

use super::generator::{noise, uniform};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::glam::DVec3;
use lobes::harmonics::{Basis, Coefficients, ScatteredTransform};
use lobes::{Parallelism, Result};

const ONE: Parallelism = Parallelism::Sequential;

const TOLERANCES: [f64; 6] = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12];

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "scattered/sums",
            function: "harmonics::ScatteredTransform::synthesise",
            oracle: Oracle::Snapshot("scattered"),
            domain: "degrees 0, 1, 6, 33 and 64, 21 directions, both poles, their surroundings and the seams of the azimuth among them; tolerances 10⁻² … 10⁻¹²",
            metric: Metric::Scaled(
                "the tolerance times the coefficients' length over √4π, the field's rms",
            ),
            bound: 1.0,
            why: "the tolerance is the promise; kernels come in whole widths, each an eighth of the error of the one before",
            loose: None,
            measure: sums,
        },
        Contract {
            id: "scattered/high-degree",
            function: "harmonics::ScatteredTransform::synthesise",
            oracle: Oracle::Identity("harmonics::Basis::sums"),
            domain: "degree 511, 100 random directions; tolerances 10⁻² … 10⁻¹²",
            metric: Metric::Scaled("the tolerance times the field's rms"),
            bound: 1.0,
            why: "as above",
            loose: None,
            measure: high_degree,
        },
        Contract {
            id: "scattered/finest",
            function: "harmonics::ScatteredTransform::synthesise",
            oracle: Oracle::Identity("harmonics::Basis::sums"),
            domain: "degree 511, 100 random directions, tolerance 10⁻¹³",
            metric: Metric::Scaled("the field's rms"),
            bound: 1e-12,
            why: "angles are rounded to 2·10⁻¹⁶, over which a field of degree 511 changes by 10⁻¹³, in both",
            loose: None,
            measure: finest,
        },
        Contract {
            id: "scattered/adjoint",
            function: "harmonics::ScatteredTransform::synthesise_adjoint",
            oracle: Oracle::Identity("⟨A x, y⟩ = ⟨x, A† y⟩"),
            domain: "degrees 0, 6, 64 and 300, 1 to 3000 directions; tolerances 10⁻² … 10⁻¹²",
            metric: Metric::Scaled("the product of the lengths of A x and y"),
            bound: 2e-15,
            why: "the adjoint is the transpose step by step: only the order of sums differs",
            loose: None,
            measure: adjoint,
        },
        Contract {
            id: "scattered/adjoint-sums",
            function: "harmonics::ScatteredTransform::synthesise_adjoint",
            oracle: Oracle::Identity("harmonics::Basis::sums_adjoint"),
            domain: "degree 120, 300 random directions; tolerances 10⁻² … 10⁻¹²",
            metric: Metric::Scaled("the tolerance times the rms of the sums"),
            bound: 1.0,
            why: "as scattered/sums",
            loose: None,
            measure: adjoint_sums,
        },
    ]
}

fn directions(seed: u64, count: usize) -> Vec<DVec3> {
    let numbers = uniform(seed, 3 * count);
    let (directions, _) = numbers.as_chunks();
    directions.iter().copied().map(DVec3::from_array).collect()
}

fn length(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The rms of a field over the sphere, from its coefficients.
fn rms(f: &Coefficients) -> f64 {
    length(f.as_slice()) / (4.0 * std::f64::consts::PI).sqrt()
}

#[derive(Deserialize)]
struct Sums {
    degree: usize,
    seed: u64,
    directions: Vec<[f64; 3]>,
    values: Vec<f64>,
}

fn sums(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Sums>("scattered", "sums")? {
        let f = noise(case.degree, case.seed);
        let directions = case.directions.iter().copied().map(DVec3::from_array);
        let directions: Vec<_> = directions.collect();
        compare(&f, &directions, &case.values, tally)?;
    }
    Ok(())
}

/// Holds sums of every tolerance to what they should be.
fn compare(
    f: &Coefficients,
    directions: &[DVec3],
    values: &[f64],
    tally: &mut Tally,
) -> Result<()> {
    for tolerance in TOLERANCES {
        let plan = ScatteredTransform::new(f.degree(), directions, tolerance, ONE)?;
        let found = plan.synthesise(f, ONE)?;
        for ((got, want), direction) in found.iter().zip(values).zip(directions) {
            tally.compare_scaled(*got, *want, tolerance * rms(f), || {
                format!("degree {}, {direction}, tolerance {tolerance}", f.degree())
            });
        }
    }
    Ok(())
}

fn one_by_one(f: &Coefficients, directions: &[DVec3]) -> Result<Vec<f64>> {
    let mut values = vec![0.0; directions.len()];
    Basis::new(f.degree())?.sums(f, directions, &mut values, Parallelism::Rayon)?;
    Ok(values)
}

fn high_degree(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (f, directions) = (noise(511, 1400), directions(1401, 100));
    compare(&f, &directions, &one_by_one(&f, &directions)?, tally)
}

fn finest(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (f, directions) = (noise(511, 1400), directions(1401, 100));
    let found = ScatteredTransform::new(511, &directions, 1e-13, ONE)?.synthesise(&f, ONE)?;
    for (i, (got, want)) in found.iter().zip(one_by_one(&f, &directions)?).enumerate() {
        tally.compare_scaled(*got, want, rms(&f), || format!("{}", directions[i]));
    }
    Ok(())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn adjoint(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for (degree, count) in [(0, 1), (6, 17), (64, 3000), (300, 500)] {
        let (f, y) = (noise(degree, 1410), uniform(1411, count));
        for tolerance in TOLERANCES {
            let plan = ScatteredTransform::new(degree, &directions(1412, count), tolerance, ONE)?;
            let forth = plan.synthesise(&f, ONE)?;
            let back = plan.synthesise_adjoint(&y, ONE)?;
            let (got, want) = (dot(back.as_slice(), f.as_slice()), dot(&forth, &y));
            tally.compare_scaled(got, want, length(&forth) * length(&y), || {
                format!("degree {degree}, {count} directions, tolerance {tolerance}")
            });
        }
    }
    Ok(())
}

fn adjoint_sums(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (directions, values) = (directions(1420, 300), uniform(1421, 300));
    let want = Basis::new(120)?.sums_adjoint(&values, &directions, ONE)?;
    let scale = length(want.as_slice()) / (want.as_slice().len() as f64).sqrt();
    for tolerance in TOLERANCES {
        let plan = ScatteredTransform::new(120, &directions, tolerance, ONE)?;
        let got = plan.synthesise_adjoint(&values, ONE)?;
        for (i, (got, want)) in got.as_slice().iter().zip(want.as_slice()).enumerate() {
            tally.compare_scaled(*got, *want, tolerance * scale, || {
                format!("coefficient {i}, tolerance {tolerance}")
            });
        }
    }
    Ok(())
}
