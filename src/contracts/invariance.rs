//! What a rotation must not change.

use glam::{DQuat, EulerRot};

use super::generator::uniform;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use crate::harmonics::{Rotation, average_power};
use crate::illumination::{EnvironmentMap, builtin};
use crate::{Parallelism, Result};

/// Green, so that a map's channels need not be weighed.
const CHANNEL: usize = 1;

pub(super) fn contracts() -> Vec<Contract> {
    let pixels = Contract {
        id: "invariance/pixels-512",
        function: "illumination::EnvironmentMap::{radiance, coefficients}",
        oracle: Oracle::Identity("a rotation keeps B_l; the truth is the map itself at 1024 rows"),
        domain: "B_0 … B_32 of each fourth built-in map, sampled anew at 512 rows through a rotation",
        metric: Metric::Relative,
        bound: 6e-2,
        why: "point samples of a bilinear map, whose kinks and suns alias",
        loose: None,
        measure: |_, tally| rotated_pixels(512, tally),
    };
    vec![
        Contract {
            id: "invariance/coefficients",
            function: "harmonics::Rotation::rotate",
            oracle: Oracle::Identity("a rotation keeps B_l"),
            domain: "B_0 … B_64 of every built-in map under 100 random rotations",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "a sum of up to 129 squares, each off by some ε",
            loose: None,
            measure: rotated_coefficients,
        },
        pixels,
        Contract {
            id: "invariance/pixels-1024",
            domain: "the same at 1024 rows: the error falls with the resolution",
            bound: 3e-3,
            measure: |_, tally| rotated_pixels(1024, tally),
            ..pixels
        },
    ]
}

/// The map's own function sampled at other directions: those of a grid of so many rows, turned.
fn sampled(map: &EnvironmentMap, turn: DQuat, rows: usize) -> Result<EnvironmentMap> {
    let columns = 2 * rows;
    let grid = EnvironmentMap::new("grid", columns, rows, vec![[1.0; 3]; rows * columns])?;
    let pixels = Parallelism::Rayon.map(rows * columns, |i| {
        map.radiance(turn * grid.direction(i / columns, i % columns))
    });
    EnvironmentMap::new(map.name(), columns, rows, pixels)
}

fn power(map: &EnvironmentMap) -> Result<Vec<f64>> {
    Ok(average_power(
        &map.coefficients(32, Parallelism::Rayon)?[CHANNEL],
    ))
}

fn rotated_pixels(rows: usize, tally: &mut Tally) -> Result<()> {
    for map in builtin()?.iter().step_by(4) {
        let want = power(&sampled(map, DQuat::IDENTITY, 1024)?)?;
        let turn = DQuat::from_euler(EulerRot::YXZ, 0.4, 1.1, -0.7);
        let got = power(&sampled(map, turn, rows)?)?;
        for (l, (got, want)) in got.iter().zip(want).enumerate() {
            tally.compare(*got, want, || format!("{}, l = {l}", map.name()));
        }
    }
    Ok(())
}

fn rotated_coefficients(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let rotation = Rotation::new(64)?;
    for (index, map) in builtin()?.iter().enumerate() {
        let [_, green, _] = map.coefficients(64, Parallelism::Rayon)?;
        let want = average_power(&green);
        let turns: Vec<DQuat> = uniform(900 + index as u64, 400)
            .chunks_exact(4)
            .map(|q| DQuat::from_xyzw(q[0], q[1], q[2], q[3]).normalize())
            .collect();
        let turned = Parallelism::Rayon.map(turns.len(), |i| {
            rotation.rotate(&green, turns[i], Parallelism::Sequential)
        });
        for (turned, turn) in turned.into_iter().zip(&turns) {
            for (l, (got, want)) in average_power(&turned?).iter().zip(&want).enumerate() {
                tally.compare(*got, *want, || format!("{}, l = {l}, {turn}", map.name()));
            }
        }
    }
    Ok(())
}
