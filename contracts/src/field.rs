//! Beams, gradients on grids, and random fields.

use serde::Deserialize;

use super::generator::{coefficients, degrees_and_orders, noise};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::glam::DVec3;
use lobes::harmonics::{Basis, Transform, gaussian_beam, random_field};
use lobes::sphere::Grid;
use lobes::{Error, Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("field");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "field/beam",
            function: "harmonics::gaussian_beam",
            oracle: ORACLE,
            domain: "degrees 0 … 64, full widths 0, 10⁻³, 1°, 0.2 and 1.5 radians",
            metric: Metric::Absolute,
            bound: 1e-15,
            why: "an exponential of a product of three numbers, in healpy as here",
            loose: None,
            measure: beam,
        },
        Contract {
            id: "field/gradient",
            function: "harmonics::Transform::gradient",
            oracle: ORACLE,
            domain: "random coefficients of degree 8 on Clenshaw–Curtis rings, both poles among them, and of degree 12 and 24 on Gauss–Legendre rings",
            metric: Metric::Scaled("the gradient's rms"),
            bound: 1e-14,
            why: "sums of some 10³ terms, as transform/synthesis",
            loose: None,
            measure: gradient,
        },
        Contract {
            id: "field/gradient-high",
            function: "harmonics::Transform::gradient",
            oracle: Oracle::Identity("harmonics::Basis::gradients at the grid's points"),
            domain: "degree 1023 on 1025 Clenshaw–Curtis rings: both poles, the rings beside them, three others; every 64th column",
            metric: Metric::Scaled("the gradient's rms"),
            bound: 1e-12,
            why: "the rounding of 10⁶ terms, as legendre/synthesis-2047",
            loose: None,
            measure: gradient_high,
        },
        Contract {
            id: "field/random",
            function: "harmonics::random_field",
            oracle: ORACLE,
            domain: "degree 11, four seeds: numpy's PCG64 in the same state, and its deviates in 50 digits",
            metric: Metric::Absolute,
            bound: 1e-15,
            why: "deviates below 9, from a logarithm, a root and a sine",
            loose: None,
            measure: random,
        },
    ]
}

#[derive(Deserialize)]
struct Beam {
    degree: usize,
    fwhm: f64,
    values: Vec<f64>,
}

fn beam(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Beam>("field", "beam")? {
        let beam = gaussian_beam(case.degree, case.fwhm)?;
        for (l, (got, want)) in beam.iter().zip(&case.values).enumerate() {
            tally.compare(*got, *want, || format!("width {}, l = {l}", case.fwhm));
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Gradient {
    grid: String,
    rings: usize,
    columns: usize,
    degree: usize,
    seed: u64,
    south: Vec<f64>,
    east: Vec<f64>,
}

fn rms(south: &[f64], east: &[f64]) -> f64 {
    let squares = south.iter().chain(east).map(|x| x * x).sum::<f64>();
    (squares / south.len() as f64).sqrt()
}

fn gradient(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Gradient>("field", "gradient")? {
        let (rings, columns) = (case.rings, case.columns);
        let grid = match case.grid.as_str() {
            "gauss-legendre" => Grid::gauss_legendre(rings, columns),
            "clenshaw-curtis" => Grid::clenshaw_curtis(rings, columns),
            other => Err(Error::UnknownName {
                what: "grid",
                name: other.into(),
                names: ["gauss-legendre", "clenshaw-curtis"]
                    .map(String::from)
                    .into(),
            }),
        }?;
        let f = noise(case.degree, case.seed);
        let transform = Transform::new(&grid, case.degree)?;
        let got = transform.gradient(&f, Parallelism::Sequential)?;
        let scale = rms(&case.south, &case.east);
        for (part, (got, want)) in got.iter().zip([&case.south, &case.east]).enumerate() {
            for (i, (got, want)) in got.iter().zip(want).enumerate() {
                tally.compare_scaled(*got, *want, scale, || {
                    format!(
                        "{} {rings}×{columns}, ring {}, column {}, part {part}",
                        case.grid,
                        i / columns,
                        i % columns
                    )
                });
            }
        }
    }
    Ok(())
}

fn gradient_high(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (degree, grid) = (1023, Grid::clenshaw_curtis(1025, 2048)?);
    let f = noise(degree, 710);
    let transform = Transform::new(&grid, degree)?;
    let [south, east] = transform.gradient(&f, Parallelism::Rayon)?;
    let scale = rms(&south, &east);
    let points: Vec<(usize, usize)> = [0, 1, 2, 200, 512, 800, 1023, 1024]
        .into_iter()
        .flat_map(|ring| (0..2048).step_by(64).map(move |column| (ring, column)))
        .collect();
    let directions: Vec<DVec3> = points
        .iter()
        .map(|&(ring, column)| grid.direction(ring, column))
        .collect();
    let mut want = vec![(0.0, DVec3::ZERO); points.len()];
    Basis::new(degree)?.gradients(&f, &directions, &mut want, Parallelism::Rayon)?;
    for (&(ring, column), (_, want)) in points.iter().zip(&want) {
        let (theta, phi) = (grid.colatitude(ring), grid.azimuth(column));
        let to_south = DVec3::new(
            theta.cos() * phi.cos(),
            theta.cos() * phi.sin(),
            -theta.sin(),
        );
        let to_east = DVec3::new(-phi.sin(), phi.cos(), 0.0);
        let index = ring * grid.columns() + column;
        let at = || format!("ring {ring}, column {column}");
        tally.compare_scaled(south[index], to_south.dot(*want), scale, at);
        tally.compare_scaled(east[index], to_east.dot(*want), scale, at);
    }
    Ok(())
}

#[derive(Deserialize)]
struct Random {
    seed: u64,
    power: Vec<f64>,
    coefficients: Vec<f64>,
}

fn random(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Random>("field", "random")? {
        let got = random_field(&case.power, case.seed)?;
        let want = coefficients(got.degree(), &case.coefficients);
        for (l, m) in degrees_and_orders(got.degree()) {
            tally.compare(got.get(l, m), want.get(l, m), || {
                format!("seed {}, l = {l}, m = {m}", case.seed)
            });
        }
    }
    Ok(())
}
