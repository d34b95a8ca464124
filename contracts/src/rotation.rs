//! Rotated coefficients, against `ducc0` (which `healpy` and the rotated field itself confirmed).

use lobes::glam::DQuat;
use serde::Deserialize;

use super::generator::{degrees_and_orders, noise};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::harmonics::{Rotation, average_power};
use lobes::{Parallelism, Result};

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
        Contract {
            id: "rotation/there-and-back",
            function: "harmonics::Rotation::rotate",
            oracle: Oracle::Identity("R⁻¹ R f = f"),
            domain: "degree 1024, every coefficient, three rotations: general, 10⁻⁸, nearly half a turn",
            metric: Metric::Absolute,
            bound: 1e-13,
            why: "coefficients of order one, sums of up to 2049 of them in random signs, four times",
            loose: None,
            measure: there_and_back,
        },
        Contract {
            id: "rotation/power",
            function: "harmonics::Rotation::rotate",
            oracle: Oracle::Identity("rotation keeps the power of each degree"),
            domain: "degree 1024, the power of each degree, the same rotations",
            metric: Metric::Relative,
            bound: 3e-14,
            why: "as above, averaged over the orders",
            loose: None,
            measure: power,
        },
        Contract {
            id: "rotation/composition",
            function: "harmonics::Rotation::rotate",
            oracle: Oracle::Identity("R₁ R₂ f = (R₁ R₂) f"),
            domain: "degree 1024, every coefficient: one rotation after another and their product",
            metric: Metric::Absolute,
            bound: 1e-12,
            why: "the product of two quaternions is rounded, and degree 1024 turns 1024 times as far",
            loose: None,
            measure: composition,
        },
    ]
}

#[derive(Deserialize)]
struct RotationCase {
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
fn compare(cases: Vec<RotationCase>, tally: &mut Tally) -> Result<()> {
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

const HIGH: usize = 1024;

fn turns() -> [DQuat; 3] {
    [
        DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8).normalize(),
        DQuat::from_rotation_y(1e-8),
        DQuat::from_rotation_x(3.0),
    ]
}

fn there_and_back(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (plan, f) = (Rotation::new(HIGH)?, noise(HIGH, 500));
    for turn in turns() {
        let there = plan.rotate(&f, turn, Parallelism::Rayon)?;
        let back = plan.rotate(&there, turn.conjugate(), Parallelism::Rayon)?;
        for (i, (got, want)) in back.as_slice().iter().zip(f.as_slice()).enumerate() {
            tally.compare(*got, *want, || format!("coefficient {i}, {turn}"));
        }
    }
    Ok(())
}

fn power(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (plan, f) = (Rotation::new(HIGH)?, noise(HIGH, 500));
    let wanted = average_power(&f);
    for turn in turns() {
        let rotated = plan.rotate(&f, turn, Parallelism::Rayon)?;
        for (l, (got, want)) in average_power(&rotated).iter().zip(&wanted).enumerate() {
            tally.compare(*got, *want, || format!("l = {l}, {turn}"));
        }
    }
    Ok(())
}

fn composition(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (plan, f) = (Rotation::new(HIGH)?, noise(HIGH, 500));
    let first = DQuat::from_xyzw(0.1, -0.5, 0.3, 0.6).normalize();
    let second = turns()[0];
    let once = plan.rotate(&f, first, Parallelism::Rayon)?;
    let twice = plan.rotate(&once, second, Parallelism::Rayon)?;
    let together = plan.rotate(&f, second * first, Parallelism::Rayon)?;
    for (i, (got, want)) in twice.as_slice().iter().zip(together.as_slice()).enumerate() {
        tally.compare(*got, *want, || format!("coefficient {i}"));
    }
    Ok(())
}
