//! The spectrum of light, against `ducc0` and `scipy`.

use serde::Deserialize;

use super::generator::{coefficients, degrees_and_orders, noisy_map};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::illumination::PowerLaw;
use lobes::{Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("spectrum");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "spectrum/coefficients",
            function: "illumination::EnvironmentMap::coefficients",
            oracle: ORACLE,
            domain: "a 40×20 map of noise, degree 9, three channels",
            metric: Metric::Scaled("the largest coefficient"),
            bound: 2e-15,
            why: "a sum of 800 weighted pixels",
            loose: None,
            measure: map_coefficients,
        },
        Contract {
            id: "spectrum/power-law",
            function: "illumination::PowerLaw::fit",
            oracle: ORACLE,
            domain: "k, η and both standard errors of four noisy laws, 3 to 123 degrees",
            metric: Metric::Absolute,
            bound: 6e-14,
            why: "a regression of logarithms; scipy's own sums round as much",
            loose: None,
            measure: power_law,
        },
    ]
}

#[derive(Deserialize)]
struct Map {
    height: usize,
    width: usize,
    seed: u64,
    degree: usize,
    coefficients: [Vec<f64>; 3],
}

fn map_coefficients(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Map>("spectrum", "coefficients")? {
        let map = noisy_map(case.height, case.width, case.seed)?;
        let got = map.coefficients(case.degree, Parallelism::Sequential)?;
        for (channel, (got, want)) in got.iter().zip(&case.coefficients).enumerate() {
            let scale = want.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let want = coefficients(case.degree, want);
            for (l, m) in degrees_and_orders(case.degree) {
                tally.compare_scaled(got.get(l, m), want.get(l, m), scale, || {
                    format!("channel {channel}, l = {l}, m = {m}")
                });
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Law {
    power: Vec<f64>,
    first: usize,
    last: usize,
    k: f64,
    eta: f64,
    eta_error: f64,
    ln_k_error: f64,
}

fn power_law(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Law>("spectrum", "power-law")? {
        let law = PowerLaw::fit(&case.power, case.first, case.last)?;
        for (name, got, want) in [
            ("k", law.k, case.k),
            ("η", law.eta, case.eta),
            ("the error of η", law.eta_error, case.eta_error),
            ("the error of ln k", law.ln_k_error, case.ln_k_error),
        ] {
            tally.compare(got, want, || {
                format!("{name}, degrees {} to {}", case.first, case.last)
            });
        }
    }
    Ok(())
}
