//! The harmonics at directions against two libraries: their conventions, and their digits.
//!
//! `legendre` holds them against a multi-precision reference; here two bodies of code that other
//! people use have to mean the same function.

use std::f64::consts::PI;

use lobes::glam::DVec3;
use serde::Deserialize;

use super::generator::{coefficients, degrees_and_orders};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::harmonics::{Coefficients, evaluate, evaluate_all};

const SCALE: Metric = Metric::Scaled("√((2l+1)/4π)");
const DIRECTIONS: &str = "18 directions: 8 random, θ = 10⁻², 10⁻⁵, 10⁻⁸ of a pole, the equator, both sides of φ = ±π, both poles";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "basis/drjit",
            function: "harmonics::evaluate_all",
            oracle: Oracle::Snapshot("basis"),
            domain: DIRECTIONS,
            metric: SCALE,
            bound: 24.0 * f64::EPSILON,
            why: "l ≤ 9, the last degree that sh_eval runs; drjit's own error is 3 ε (its Condon–Shortley phase removed)",
            loose: None,
            measure: drjit,
        },
        Contract {
            id: "basis/scipy",
            function: "harmonics::evaluate_all",
            oracle: Oracle::Snapshot("basis"),
            domain: "l ≤ 20 at the same directions",
            metric: SCALE,
            bound: 200.0 * f64::EPSILON,
            why: "SciPy's own error, which its recurrence in cos θ makes largest near the poles",
            loose: None,
            measure: scipy,
        },
        Contract {
            id: "basis/scipy-high",
            function: "harmonics::evaluate",
            oracle: Oracle::Snapshot("basis"),
            domain: "l = 45, every m, at the same directions",
            metric: SCALE,
            bound: 500.0 * f64::EPSILON,
            why: "SciPy's own error: 263 ε at θ = 10⁻⁸ against 45 digits",
            loose: None,
            measure: scipy_high,
        },
    ]
}

#[derive(Deserialize)]
struct Cartesian {
    direction: [f64; 3],
    degree: usize,
    values: Vec<f64>,
}

#[derive(Deserialize)]
struct Polar {
    theta: f64,
    phi: f64,
    degree: usize,
    values: Vec<f64>,
}

impl Polar {
    fn direction(&self) -> DVec3 {
        let (sin, cos) = self.theta.sin_cos();
        DVec3::new(sin * self.phi.cos(), sin * self.phi.sin(), cos)
    }
}

fn scale(l: usize) -> f64 {
    ((2 * l + 1) as f64 / (4.0 * PI)).sqrt()
}

fn drjit(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Cartesian>("basis", "drjit")? {
        let direction = DVec3::from_array(case.direction);
        all(direction, case.degree, &case.values, tally)?;
    }
    Ok(())
}

fn scipy(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Polar>("basis", "scipy")? {
        all(case.direction(), case.degree, &case.values, tally)?;
    }
    Ok(())
}

fn all(direction: DVec3, degree: usize, values: &[f64], tally: &mut Tally) -> Result<()> {
    let mut got = Coefficients::zeros(degree);
    evaluate_all(direction, degree, got.as_mut_slice())?;
    let want = coefficients(degree, values);
    for (l, m) in degrees_and_orders(degree) {
        tally.compare_scaled(got.get(l, m), want.get(l, m), scale(l), || {
            format!("l = {l}, m = {m}, {direction}")
        });
    }
    Ok(())
}

fn scipy_high(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Polar>("basis", "scipy-high")? {
        let (l, direction) = (case.degree, case.direction());
        for (m, want) in (-(l as isize)..).zip(&case.values) {
            let mut single = Coefficients::zeros(l);
            single.set(l, m, 1.0)?;
            tally.compare_scaled(evaluate(&single, direction)?, *want, scale(l), || {
                format!("m = {m}, {direction}")
            });
        }
    }
    Ok(())
}
