//! Environment maps between their pixels, against an interpolator of `scipy`.

use std::f64::consts::PI;

use lobes::glam::DVec3;
use serde::Deserialize;

use super::generator::noisy_map;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::illumination::EnvironmentMap;

const ORACLE: Oracle = Oracle::Snapshot("map");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "map/radiance",
            function: "illumination::EnvironmentMap::radiance",
            oracle: ORACLE,
            domain: "a 12×6 map of noise at 60 random directions, both poles, across the seam and along the axes",
            metric: Metric::Relative,
            bound: 1.2e-14,
            why: "the angles round, and a map may change by twice its value from one pixel to the next",
            loose: None,
            measure: radiance,
        },
        Contract {
            id: "map/centres",
            function: "illumination::EnvironmentMap::{direction, radiance}",
            oracle: ORACLE,
            domain: "the centre of every pixel of the same map",
            metric: Metric::Absolute,
            bound: 1.2e-14,
            why: "as above",
            loose: None,
            measure: centres,
        },
        Contract {
            id: "map/mean",
            function: "illumination::EnvironmentMap::mean",
            oracle: ORACLE,
            domain: "the same map",
            metric: Metric::Relative,
            bound: 1.2e-15,
            why: "a sum of 72 positive terms",
            loose: None,
            measure: mean,
        },
        Contract {
            id: "map/solid-angle",
            function: "illumination::EnvironmentMap::solid_angle",
            oracle: Oracle::Identity("2π (1 − cos θ)"),
            domain: "the cap above each edge of rows, maps of 2, 6, 256 and 1024 rows",
            metric: Metric::Relative,
            bound: 4e-15,
            why: "a sum of up to 1024 positive terms",
            loose: None,
            measure: solid_angle,
        },
    ]
}

#[derive(Deserialize)]
struct MapShape {
    height: usize,
    width: usize,
    seed: u64,
}

impl MapShape {
    fn map(&self) -> Result<EnvironmentMap> {
        noisy_map(self.height, self.width, self.seed)
    }
}

#[derive(Deserialize)]
struct Values {
    #[serde(flatten)]
    shape: MapShape,
    directions: Vec<[f64; 3]>,
    values: Vec<[f64; 3]>,
}

fn radiance(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Values>("map", "radiance")? {
        let map = case.shape.map()?;
        for (direction, want) in case.directions.iter().zip(&case.values) {
            let got = map.radiance(DVec3::from_array(*direction));
            for (got, want) in got.iter().zip(want) {
                tally.compare(*got, *want, || format!("{direction:?}"));
            }
        }
    }
    Ok(())
}

fn centres(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Values>("map", "centres")? {
        let map = case.shape.map()?;
        for (i, (direction, want)) in case.directions.iter().zip(&case.values).enumerate() {
            let (row, column) = (i / map.width(), i % map.width());
            let got = map.direction(row, column).to_array();
            let value = map.radiance(DVec3::from_array(*direction));
            for (got, want) in got.iter().zip(direction).chain(value.iter().zip(want)) {
                tally.compare(*got, *want, || format!("row {row}, column {column}"));
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Mean {
    #[serde(flatten)]
    shape: MapShape,
    mean: [f64; 3],
}

fn mean(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Mean>("map", "mean")? {
        for (channel, (got, want)) in case.shape.map()?.mean().iter().zip(case.mean).enumerate() {
            tally.compare(*got, want, || format!("channel {channel}"));
        }
    }
    Ok(())
}

fn solid_angle(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for height in [2, 6, 256, 1024] {
        let map = EnvironmentMap::new(
            "grey",
            2 * height,
            height,
            vec![[1.0; 3]; 2 * height * height],
        )?;
        let mut cap = 0.0;
        for row in 0..height {
            cap += map.solid_angle(row) * map.width() as f64;
            // 1 − cos θ = 2 sin²(θ/2), without cancellation.
            let edge = 0.5 * PI * (row + 1) as f64 / height as f64;
            let want = 4.0 * PI * edge.sin().powi(2);
            tally.compare(cap, want, || format!("{height} rows, row {row}"));
        }
    }
    Ok(())
}
