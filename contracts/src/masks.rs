//! The coupling of degrees by masks of any shape.

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::harmonics::Coupling;

const ORACLE: Oracle = Oracle::Snapshot("masks");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "masks/coupling",
            function: "harmonics::Coupling::from_power",
            oracle: ORACLE,
            domain: "every element to degree 0, 3 and 9, of powers that fall as those of masks do",
            metric: Metric::Scaled("the largest element"),
            bound: 2e-15,
            why: "sums of at most 19 products, of squares of 3j symbols by rational ratios",
            loose: None,
            measure: exact,
        },
        Contract {
            id: "masks/coupling-high",
            function: "harmonics::Coupling::from_power",
            oracle: ORACLE,
            domain: "degree 300: 72 elements, on the diagonal, beside it and in the corners",
            metric: Metric::Scaled("the largest element"),
            bound: 5e-15,
            why: "the rounding of up to 300 ratios",
            loose: None,
            measure: high,
        },
    ]
}

#[derive(Deserialize)]
struct Exact {
    degree: usize,
    power: Vec<f64>,
    matrix: Vec<f64>,
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}

fn exact(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Exact>("masks", "exact")? {
        let coupling = Coupling::from_power(&case.power, case.degree)?;
        let scale = largest(&case.matrix);
        for (i, want) in case.matrix.iter().enumerate() {
            let (l, other) = (i / (case.degree + 1), i % (case.degree + 1));
            tally.compare_scaled(coupling.matrix()[(l, other)], *want, scale, || {
                format!("degree {}, l = {l}, l′ = {other}", case.degree)
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Closed {
    degree: usize,
    power: Vec<f64>,
    shown: Vec<[usize; 2]>,
    values: Vec<f64>,
}

fn high(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Closed>("masks", "closed")? {
        let coupling = Coupling::from_power(&case.power, case.degree)?;
        let scale = largest(&case.values);
        for ([l, other], want) in case.shown.into_iter().zip(&case.values) {
            tally.compare_scaled(coupling.matrix()[(l, other)], *want, scale, || {
                format!("l = {l}, l′ = {other}")
            });
        }
    }
    Ok(())
}
