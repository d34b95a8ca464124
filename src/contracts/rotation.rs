//! Rotated coefficients, against `ducc0` (which `healpy` and the rotated field itself confirmed).

use glam::DQuat;
use serde::Deserialize;

use super::generator::{degrees_and_orders, noise};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use crate::harmonics::Rotation;
use crate::{Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("rotation");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "rotation/all",
            function: "harmonics::Rotation::rotate",
            oracle: ORACLE,
            domain: "degree 12, every coefficient, six rotations: general, about the pole, half a turn, 10⁻⁸",
            metric: Metric::Absolute,
            bound: 1e-14,
            why: "coefficients of order one, sums of up to 25 of them, in ducc0 as here",
            loose: None,
            measure: all,
        },
        Contract {
            id: "rotation/highest-degree",
            function: "harmonics::Rotation::rotate",
            oracle: ORACLE,
            domain: "degree 128, every order of it, the same rotations",
            metric: Metric::Absolute,
            bound: 2e-13,
            why: "ducc0 is off by 5·10⁻¹⁴ there and back, and the angles' rounding counts 128 times",
            loose: None,
            measure: highest,
        },
    ]
}

#[derive(Deserialize)]
struct Case {
    degree: usize,
    seed: u64,
    /// x, y, z, w.
    quaternion: [f64; 4],
    coefficients: Vec<f64>,
}

fn all(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    compare(snapshots.cases("rotation", "all")?, tally)
}

fn highest(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    compare(snapshots.cases("rotation", "highest-degree")?, tally)
}

/// The snapshot holds the last coefficients in the order l² + l + m.
fn compare(cases: Vec<Case>, tally: &mut Tally) -> Result<()> {
    for case in cases {
        let turn = DQuat::from_array(case.quaternion);
        let got = Rotation::new(case.degree)?.rotate(
            &noise(case.degree, case.seed),
            turn,
            Parallelism::Sequential,
        )?;
        let skipped = (case.degree + 1).pow(2) - case.coefficients.len();
        let places = degrees_and_orders(case.degree).skip(skipped);
        for ((l, m), want) in places.zip(&case.coefficients) {
            tally.compare(got.get(l, m), *want, || format!("l = {l}, m = {m}, {turn}"));
        }
    }
    Ok(())
}
