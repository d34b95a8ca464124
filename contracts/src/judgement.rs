//! Errors of estimated light: of the pictures of balls, and of its irradiance.

use serde::Deserialize;

use super::generator::uniform;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::evaluation::{LightErrors, Measure};
use lobes::glam::DVec3;
use lobes::illumination::EnvironmentMap;
use lobes::reflection::{Camera, SphereImage};
use lobes::sphere::Grid;
use lobes::{Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("judgement");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "judgement/error",
            function: "evaluation::Measure::of",
            oracle: ORACLE,
            domain: "every measure but normalised-rmse; pictures of 8, 16 and 33 pixels a side, values over decades, black pixels in either",
            metric: Metric::Relative,
            bound: 5e-15,
            why: "sums of some 10³ terms, none of them negative",
            loose: None,
            measure: error,
        },
        Contract {
            id: "judgement/normalised",
            function: "evaluation::Measure::NormalisedRmse",
            oracle: ORACLE,
            domain: "pictures of 128 and 200 pixels a side, against numpy.percentile on the whole frame",
            metric: Metric::Relative,
            bound: 5e-6,
            why: "the percentile's place among the ball's own values, instead of the frame's",
            loose: None,
            measure: normalised,
        },
        Contract {
            id: "judgement/irradiance",
            function: "evaluation::LightErrors::between",
            oracle: Oracle::Identity(
                "light of degree 2, whose irradiance is π a + 2π/3 b·n + π/4 c P₂(u·n)",
            ),
            domain: "three pairs of maps, of 64, 128 and 192 rows, an estimate of another size among them",
            metric: Metric::Relative,
            bound: 1e-14,
            why: "the analysis of a map is exact to the degree that its rows carry",
            loose: None,
            measure: irradiance,
        },
    ]
}

/// Truth and estimate of a ball from a seed, as `oracles/judgement.py` makes them.
fn pictures(seed: u64, size: usize) -> Result<[SphereImage; 2]> {
    let numbers = uniform(seed, 6 * size * size);
    let (mut truth, mut estimate) = (Vec::new(), Vec::new());
    for of in numbers.chunks_exact(6) {
        let t = [0, 1, 2].map(|i| (1.0 + of[i]) * (1.0 + of[i]) * (1.0 + of[i]));
        let e = [0, 1, 2].map(|i| t[i] * (1.5 + of[3 + i]));
        truth.push(if of[0] < -0.8 { [0.0; 3] } else { t });
        estimate.push(if of[3] < -0.9 { [0.0; 3] } else { e });
    }
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    Ok([
        SphereImage::new(camera, size, truth)?,
        SphereImage::new(camera, size, estimate)?,
    ])
}

#[derive(Deserialize)]
struct ErrorCase {
    seed: u64,
    size: usize,
    measure: String,
    value: f64,
}

fn error(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<ErrorCase>("judgement", "error")? {
        let measure: Measure = case.measure.parse()?;
        let [truth, estimate] = pictures(case.seed, case.size)?;
        tally.compare(measure.of(&truth, &estimate)?, case.value, || {
            format!("{}, {} pixels a side", case.measure, case.size)
        });
    }
    Ok(())
}

#[derive(Deserialize)]
struct NormalisedCase {
    seed: u64,
    size: usize,
    value: f64,
}

fn normalised(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<NormalisedCase>("judgement", "normalised")? {
        let [truth, estimate] = pictures(case.seed, case.size)?;
        let found = Measure::NormalisedRmse.of(&truth, &estimate)?;
        tally.compare(found, case.value, || format!("{} pixels a side", case.size));
    }
    Ok(())
}

/// Light a + b·ω + c P₂(u·ω).
#[derive(Clone, Copy)]
struct Smooth {
    a: f64,
    b: DVec3,
    c: f64,
    u: DVec3,
}

impl Smooth {
    fn map(&self, height: usize) -> Result<EnvironmentMap> {
        let grid = Grid::lat_long(height, 2 * height)?;
        let pixels = (0..grid.len()).map(|place| {
            let (row, column) = (place / grid.columns(), place % grid.columns());
            let direction = lobes::sphere::from_harmonic(grid.direction(row, column));
            let along = self.u.dot(direction);
            let value = self.a + self.b.dot(direction) + self.c * (1.5 * along * along - 0.5);
            [value, 0.5 * value, 2.0 * value]
        });
        EnvironmentMap::new("smooth", 2 * height, height, pixels.collect())
    }

    /// The mean square over all normals of the irradiance of this less that of another.
    fn square_apart(&self, other: &Self) -> f64 {
        let pi = std::f64::consts::PI;
        // ∫ P₂(u·n) P₂(w·n) dn/4π = P₂(u·w)/5.
        let across = self.u.dot(other.u);
        let (first, second) = (pi * (self.a - other.a), 2.0 * pi / 3.0);
        let of_two = self.c * self.c + other.c * other.c
            - 2.0 * self.c * other.c * (1.5 * across * across - 0.5);
        first * first
            + second * second * (self.b - other.b).length_squared() / 3.0
            + (pi / 4.0) * (pi / 4.0) * of_two / 5.0
    }
}

fn irradiance(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let black = Smooth {
        a: 0.0,
        b: DVec3::ZERO,
        c: 0.0,
        u: DVec3::Y,
    };
    let truth = Smooth {
        a: 2.0,
        b: DVec3::new(0.3, 0.9, -0.4),
        c: 0.5,
        u: DVec3::new(1.0, 2.0, 2.0) / 3.0,
    };
    let others = [
        (64, 64, Smooth { a: 2.2, ..truth }),
        (
            128,
            96,
            Smooth {
                b: DVec3::new(-0.5, 0.4, 0.2),
                ..truth
            },
        ),
        (
            192,
            192,
            Smooth {
                c: 0.7,
                u: DVec3::new(2.0, -1.0, 2.0) / 3.0,
                ..truth
            },
        ),
    ];
    for (height, other_height, other) in others {
        let errors = LightErrors::between(
            &truth.map(height)?,
            &other.map(other_height)?,
            Parallelism::Sequential,
        )?;
        let want = (truth.square_apart(&other) / truth.square_apart(&black)).sqrt();
        tally.compare(errors.irradiance, want, || format!("{height} rows"));
    }
    Ok(())
}
