//! Synthesis, analysis and spectra against ducc0 and healpy.

use std::f64::consts::PI;

use serde::Deserialize;

use super::generator::{coefficients, degrees_and_orders, noise, uniform};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::harmonics::{Coefficients, Transform, average_power, cross_power};
use lobes::sphere::Grid;
use lobes::{Error, Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("transform");
const GRIDS: &str = "random coefficients of degree 16 … 18 on four grids: Gauss–Legendre, Clenshaw–Curtis, Fejér of an even and of an odd shape";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "transform/synthesis",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: GRIDS,
            metric: Metric::Scaled("the map's rms"),
            bound: 3e-14,
            why: "sums of some 300 terms; against 40 digits, ducc0 takes two thirds of the largest difference",
            loose: None,
            measure: synthesis,
        },
        Contract {
            id: "transform/synthesis-lat-long",
            function: "sphere::Grid::lat_long",
            oracle: ORACLE,
            domain: "the Fejér maps above with their columns read from right to left",
            metric: Metric::Scaled("the map's rms"),
            bound: 3e-14,
            why: "as above",
            loose: None,
            measure: synthesis_lat_long,
        },
        Contract {
            id: "transform/analysis",
            function: "harmonics::Transform::analyse",
            oracle: ORACLE,
            domain: "maps of white noise, which hold every degree, on the same four grids",
            metric: Metric::Scaled("the largest coefficient"),
            bound: 5e-15,
            why: "sums of some 10³ weighted samples, in ducc0 as here",
            loose: None,
            measure: analysis,
        },
        Contract {
            id: "transform/analysis-full",
            function: "harmonics::Transform::analyse",
            oracle: ORACLE,
            domain: "maps of random coefficients of the last degree that the rings carry: 19 and 20 on 20 and 21 Fejér rings, 18 and 19 on Clenshaw–Curtis rings",
            metric: Metric::Absolute,
            bound: 1e-14,
            why: "coefficients of order one; ducc0's map and its error as in transform/synthesis",
            loose: None,
            measure: analysis_full,
        },
        Contract {
            id: "transform/synthesis-high",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "degree 255: five rings of a Gauss–Legendre and a Fejér grid, those at the poles among them",
            metric: Metric::Scaled("the map's rms"),
            bound: 6e-12,
            why: "ducc0's own error on the rings at the poles, 1.5·10⁻¹² against 80-bit sums",
            loose: None,
            measure: synthesis_high,
        },
        Contract {
            id: "transform/many-synthesis",
            function: "harmonics::Transform::synthesise_into",
            oracle: ORACLE,
            domain: "the same, each as one of 35 maps made at once from as many multiples of the coefficients",
            metric: Metric::Scaled("the map's rms"),
            bound: 6e-12,
            why: "as above",
            loose: None,
            measure: many_synthesis,
        },
        Contract {
            id: "transform/many-analysis",
            function: "harmonics::Transform::analyse_into",
            oracle: Oracle::Identity(
                "the coefficients of the maps above, which Transform::synthesise made",
            ),
            domain: "35 maps at once, degree 255 on the Gauss–Legendre grid and on the Fejér grid",
            metric: Metric::Absolute,
            bound: 1e-13,
            why: "coefficients of order one; sums of 256 rings",
            loose: None,
            measure: many_analysis,
        },
        Contract {
            id: "transform/adjoint-synthesis",
            function: "harmonics::Transform::synthesise_adjoint",
            oracle: Oracle::Identity("⟨S f, y⟩ = ⟨f, S† y⟩"),
            domain: ADJOINTS,
            metric: Metric::Scaled("the product of the lengths of both sides"),
            bound: 2e-16,
            why: "sums of some 10³ products of random signs in another order",
            loose: None,
            measure: adjoint_synthesis,
        },
        Contract {
            id: "transform/adjoint-analysis",
            function: "harmonics::Transform::analyse_adjoint",
            oracle: Oracle::Identity("⟨A y, f⟩ = ⟨y, A† f⟩"),
            domain: ADJOINTS,
            metric: Metric::Scaled("the product of the lengths of both sides"),
            bound: 5e-16,
            why: "as above",
            loose: None,
            measure: adjoint_analysis,
        },
        Contract {
            id: "transform/power",
            function: "harmonics::{average_power, cross_power}",
            oracle: ORACLE,
            domain: "two sets of random coefficients of degree 48, auto and cross",
            metric: Metric::Scaled("the mean auto power"),
            bound: 4e-15,
            why: "sums of at most 97 products",
            loose: None,
            measure: power,
        },
    ]
}

const ADJOINTS: &str = "white noise on both sides, degrees 9 … 32: Gauss–Legendre, Fejér and Clenshaw–Curtis rings, in weights and along meridians, of even and odd number";

#[derive(Deserialize)]
struct Shape {
    grid: String,
    rings: usize,
    columns: usize,
    degree: usize,
    seed: u64,
}

impl Shape {
    fn transform(&self) -> Result<Transform> {
        let (rings, columns) = (self.rings, self.columns);
        let grid = match self.grid.as_str() {
            "gauss-legendre" => Grid::gauss_legendre(rings, columns),
            "clenshaw-curtis" => Grid::clenshaw_curtis(rings, columns),
            "fejer" => Grid::fejer(rings, columns),
            other => Err(Error::UnknownName {
                what: "grid",
                name: other.into(),
                names: ["gauss-legendre", "clenshaw-curtis", "fejer"]
                    .map(String::from)
                    .into(),
            }),
        }?;
        Transform::new(&grid, self.degree)
    }

    fn at(&self, ring: usize, column: usize) -> String {
        let Self {
            grid,
            rings,
            columns,
            ..
        } = self;
        format!("{grid} {rings}×{columns}, ring {ring}, column {column}")
    }
}

#[derive(Deserialize)]
struct Synthesis {
    #[serde(flatten)]
    shape: Shape,
    map: Vec<f64>,
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

fn synthesis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for Synthesis { shape, map } in snapshots.cases("transform", "synthesis")? {
        let got = shape
            .transform()?
            .synthesise(&noise(shape.degree, shape.seed))?;
        let scale = rms(&map);
        for (i, (got, want)) in got.iter().zip(&map).enumerate() {
            tally.compare_scaled(*got, *want, scale, || {
                shape.at(i / shape.columns, i % shape.columns)
            });
        }
    }
    Ok(())
}

fn synthesis_lat_long(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for Synthesis { shape, map } in snapshots.cases("transform", "synthesis")? {
        if shape.grid != "fejer" {
            continue;
        }
        let grid = Grid::lat_long(shape.rings, shape.columns)?;
        let got =
            Transform::new(&grid, shape.degree)?.synthesise(&noise(shape.degree, shape.seed))?;
        let scale = rms(&map);
        let rows = got
            .chunks_exact(shape.columns)
            .zip(map.chunks_exact(shape.columns));
        for (row, (got, want)) in rows.enumerate() {
            for (column, (got, want)) in got.iter().zip(want.iter().rev()).enumerate() {
                tally.compare_scaled(*got, *want, scale, || shape.at(row, column));
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Analysis {
    #[serde(flatten)]
    shape: Shape,
    coefficients: Vec<f64>,
}

fn analysis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Analysis>("transform", "analysis")? {
        let shape = &case.shape;
        let map = uniform(shape.seed, shape.rings * shape.columns);
        let got = shape.transform()?.analyse(&map)?;
        let want = coefficients(shape.degree, &case.coefficients);
        let scale = case
            .coefficients
            .iter()
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        for (l, m) in degrees_and_orders(shape.degree) {
            tally.compare_scaled(got.get(l, m), want.get(l, m), scale, || {
                format!("{}, l = {l}, m = {m}", shape.grid)
            });
        }
    }
    Ok(())
}

fn analysis_full(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for Synthesis { shape, map } in snapshots.cases("transform", "analysis-full")? {
        let got = shape.transform()?.analyse(&map)?;
        let want = noise(shape.degree, shape.seed);
        for (l, m) in degrees_and_orders(shape.degree) {
            tally.compare(got.get(l, m), want.get(l, m), || {
                format!("{}, l = {l}, m = {m}", shape.grid)
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct SynthesisHigh {
    #[serde(flatten)]
    shape: Shape,
    shown: Vec<usize>,
    map: Vec<Vec<f64>>,
}

fn synthesis_high(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<SynthesisHigh>("transform", "synthesis-high")? {
        let shape = &case.shape;
        let coefficients = noise(shape.degree, shape.seed);
        let map = shape.transform()?.synthesise(&coefficients)?;
        let scale = (coefficients.energy() / (4.0 * PI)).sqrt();
        for (ring, want) in case.shown.iter().zip(&case.map) {
            let step = shape.columns / want.len();
            let row = &map[ring * shape.columns..][..shape.columns];
            for (i, want) in want.iter().enumerate() {
                tally.compare_scaled(row[i * step], *want, scale, || shape.at(*ring, i * step));
            }
        }
    }
    Ok(())
}

/// So many go in eights, and three are left.
const MANY: usize = 35;

/// What each of many maps is multiplied by: powers of two, so that this rounds nothing, no two of
/// one eight alike.
fn multiple(map: usize) -> f64 {
    f64::powi(2.0, map as i32 % 11 - 5)
}

fn many_synthesis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<SynthesisHigh>("transform", "synthesis-high")? {
        let shape = &case.shape;
        let coefficients = noise(shape.degree, shape.seed);
        let transform = shape.transform()?;
        let sets: Vec<f64> = (0..MANY)
            .flat_map(|map| {
                coefficients
                    .as_slice()
                    .iter()
                    .map(move |f| multiple(map) * f)
            })
            .collect();
        let size = shape.rings * shape.columns;
        let mut maps = vec![0.0; MANY * size];
        let mut scratch = vec![0.0; transform.scratch_len(MANY)];
        transform.synthesise_into(MANY, &sets, &mut maps, &mut scratch, Parallelism::Rayon)?;
        let scale = (coefficients.energy() / (4.0 * PI)).sqrt();
        for (number, map) in maps.chunks_exact(size).enumerate() {
            for (ring, want) in case.shown.iter().zip(&case.map) {
                let step = shape.columns / want.len();
                let row = &map[ring * shape.columns..][..shape.columns];
                for (i, want) in want.iter().enumerate() {
                    let got = row[i * step] / multiple(number);
                    tally.compare_scaled(got, *want, scale, || {
                        format!("{}, map {number}", shape.at(*ring, i * step))
                    });
                }
            }
        }
    }
    Ok(())
}

fn many_analysis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<SynthesisHigh>("transform", "synthesis-high")? {
        let shape = &case.shape;
        let coefficients = noise(shape.degree, shape.seed);
        let transform = shape.transform()?;
        let one = transform.synthesise(&coefficients)?;
        let maps: Vec<f64> = (0..MANY)
            .flat_map(|map| one.iter().map(move |value| multiple(map) * value))
            .collect();
        let count = transform.coefficient_count();
        let mut sets = vec![0.0; MANY * count];
        let mut scratch = vec![0.0; transform.scratch_len(MANY)];
        transform.analyse_into(MANY, &maps, &mut sets, &mut scratch, Parallelism::Rayon)?;
        for (number, set) in sets.chunks_exact(count).enumerate() {
            for (i, (got, want)) in set.iter().zip(coefficients.as_slice()).enumerate() {
                tally.compare(*got / multiple(number), *want, || {
                    format!("{}, map {number}, coefficient {i}", shape.grid)
                });
            }
        }
    }
    Ok(())
}

/// Grids with a degree each, and white noise for both sides.
fn adjoints() -> Result<Vec<(Transform, Coefficients, Vec<f64>)>> {
    let grids = [
        (Grid::gauss_legendre(33, 70)?, 32),
        (Grid::fejer(20, 48)?, 9),
        (Grid::fejer(21, 48)?, 20),
        (Grid::clenshaw_curtis(21, 48)?, 10),
        (Grid::clenshaw_curtis(21, 48)?, 19),
        (Grid::clenshaw_curtis(22, 64)?, 20),
    ];
    let made = grids.into_iter().zip(600..).map(|((grid, degree), seed)| {
        let map = uniform(seed + 50, grid.len());
        Ok((Transform::new(&grid, degree)?, noise(degree, seed), map))
    });
    made.collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn adjoint_synthesis(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for (transform, f, y) in adjoints()? {
        let (map, set) = (transform.synthesise(&f)?, transform.synthesise_adjoint(&y)?);
        let scale = (dot(&map, &map) * dot(&y, &y)).sqrt();
        tally.compare_scaled(
            dot(f.as_slice(), set.as_slice()),
            dot(&map, &y),
            scale,
            || format!("{:?}", transform.grid().latitudes()),
        );
    }
    Ok(())
}

fn adjoint_analysis(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for (transform, f, y) in adjoints()? {
        let (map, set) = (transform.analyse_adjoint(&f)?, transform.analyse(&y)?);
        let scale = (dot(&map, &map) * dot(&y, &y)).sqrt();
        tally.compare_scaled(
            dot(f.as_slice(), set.as_slice()),
            dot(&map, &y),
            scale,
            || format!("{:?}", transform.grid().latitudes()),
        );
    }
    Ok(())
}

#[derive(Deserialize)]
struct Power {
    degree: usize,
    seeds: [u64; 2],
    auto: Vec<f64>,
    cross: Vec<f64>,
}

fn power(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Power>("transform", "spectrum")? {
        let [a, b]: [Coefficients; 2] = case.seeds.map(|seed| noise(case.degree, seed));
        let scale = case.auto.iter().sum::<f64>() / case.auto.len() as f64;
        for (l, (got, want)) in average_power(&a).iter().zip(&case.auto).enumerate() {
            tally.compare_scaled(*got, *want, scale, || format!("auto, l = {l}"));
        }
        for (l, (got, want)) in cross_power(&a, &b)?.iter().zip(&case.cross).enumerate() {
            tally.compare_scaled(*got, *want, scale, || format!("cross, l = {l}"));
        }
    }
    Ok(())
}
