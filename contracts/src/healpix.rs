//! HEALPix: pixel centres, synthesis and analysis against healpy's.

use serde::Deserialize;

use super::generator::{coefficients, degrees_and_orders, noise, uniform};
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::harmonics::{LeastSquares, Transform};
use lobes::sphere::Grid;
use lobes::{Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("healpix");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "healpix/pixels",
            function: "sphere::Grid::healpix",
            oracle: ORACLE,
            domain: "every pixel of nside 1, 2, 3 and 8, its three coordinates",
            metric: Metric::Absolute,
            bound: 4e-15,
            why: "healpy's own: the sine of an azimuth that is rounded at 5.5",
            loose: None,
            measure: pixels,
        },
        Contract {
            id: "healpix/synthesis",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "random coefficients: nside 1 … 8, degrees from 2 nside to the last, 4 nside − 2",
            metric: Metric::Scaled("the map's rms"),
            bound: 4e-14,
            why: "as transform/synthesis; chirps on the rings of the caps",
            loose: None,
            measure: synthesis,
        },
        Contract {
            id: "healpix/synthesis-high",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "nside 64, degree 160: 90 pixels from the north pole to the south",
            metric: Metric::Scaled("the map's rms"),
            bound: 1e-12,
            why: "as transform/synthesis-high",
            loose: None,
            measure: synthesis_high,
        },
        Contract {
            id: "healpix/iterated",
            function: "harmonics::Transform::analyse_iterated",
            oracle: ORACLE,
            domain: "maps of white noise: nside 4 and 5, degrees 2 nside and 3 nside − 1, no and three iterations",
            metric: Metric::Scaled("the largest coefficient"),
            bound: 1e-14,
            why: "sums of some 10² samples, in healpy as here",
            loose: None,
            measure: iterated,
        },
        Contract {
            id: "healpix/least-squares",
            function: "harmonics::Transform::analyse_least_squares",
            oracle: Oracle::Identity(
                "the coefficients of the map, which Transform::synthesise made",
            ),
            domain: "random coefficients of degree 2 nside and 3 nside − 1, nside 1, 5, 8 and 16, to 10⁻¹⁴",
            metric: Metric::Absolute,
            bound: 2e-13,
            why: "coefficients of order one; the tolerance times the square of the condition, which is up to 4",
            loose: None,
            measure: least_squares,
        },
        Contract {
            id: "healpix/adjoint",
            function: "harmonics::Transform::synthesise_adjoint",
            oracle: Oracle::Identity("⟨S f, y⟩ = ⟨f, S† y⟩"),
            domain: "white noise on both sides, nside 1, 5 and 16, and a Fejér grid whose rings have azimuths of their own",
            metric: Metric::Scaled("the product of the lengths of both sides"),
            bound: 2e-16,
            why: "sums of some 10³ products of random signs in another order",
            loose: None,
            measure: adjoint,
        },
    ]
}

#[derive(Deserialize)]
struct Pixels {
    nside: usize,
    vectors: Vec<f64>,
}

fn pixels(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Pixels>("healpix", "pixels")? {
        let grid = Grid::healpix(case.nside)?;
        let mut wanted = case.vectors.chunks_exact(3);
        for ring in 0..grid.rings() {
            for (column, want) in (0..grid.ring_columns(ring)).zip(&mut wanted) {
                let got = grid.direction(ring, column).to_array();
                for (got, want) in got.into_iter().zip(want) {
                    tally.compare(got, *want, || {
                        format!("nside {}, ring {ring}, column {column}", case.nside)
                    });
                }
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct HealpixMap {
    nside: usize,
    degree: usize,
    seed: u64,
    map: Vec<f64>,
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

fn synthesis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<HealpixMap>("healpix", "synthesis")? {
        let transform = Transform::new(&Grid::healpix(case.nside)?, case.degree)?;
        let got = transform.synthesise(&noise(case.degree, case.seed))?;
        let scale = rms(&case.map);
        for (i, (got, want)) in got.iter().zip(&case.map).enumerate() {
            tally.compare_scaled(*got, *want, scale, || {
                format!("nside {}, degree {}, pixel {i}", case.nside, case.degree)
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct HealpixPixels {
    nside: usize,
    degree: usize,
    seed: u64,
    shown: Vec<usize>,
    values: Vec<f64>,
}

fn synthesis_high(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<HealpixPixels>("healpix", "synthesis-high")? {
        let transform = Transform::new(&Grid::healpix(case.nside)?, case.degree)?;
        let map = transform.synthesise(&noise(case.degree, case.seed))?;
        let scale = rms(&map);
        for (pixel, want) in case.shown.iter().zip(&case.values) {
            tally.compare_scaled(map[*pixel], *want, scale, || format!("pixel {pixel}"));
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct HealpixAnalysis {
    nside: usize,
    degree: usize,
    seed: u64,
    iterations: usize,
    coefficients: Vec<f64>,
}

fn iterated(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<HealpixAnalysis>("healpix", "analysis")? {
        let grid = Grid::healpix(case.nside)?;
        let map = uniform(case.seed, grid.len());
        let transform = Transform::new(&grid, case.degree)?;
        let got = transform.analyse_iterated(&map, case.iterations, Parallelism::Sequential)?;
        let want = coefficients(case.degree, &case.coefficients);
        let scale = case
            .coefficients
            .iter()
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        for (l, m) in degrees_and_orders(case.degree) {
            tally.compare_scaled(got.get(l, m), want.get(l, m), scale, || {
                format!("nside {}, l = {l}, m = {m}", case.nside)
            });
        }
    }
    Ok(())
}

fn least_squares(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    for nside in [1, 5, 8, 16] {
        for degree in [2 * nside, 3 * nside - 1] {
            let transform = Transform::new(&Grid::healpix(nside)?, degree)?;
            let want = noise(degree, 830);
            let map = transform.synthesise(&want)?;
            let LeastSquares { coefficients, .. } =
                transform.analyse_least_squares(&map, 1e-14, Parallelism::Rayon)?;
            for (l, m) in degrees_and_orders(degree) {
                tally.compare(coefficients.get(l, m), want.get(l, m), || {
                    format!("nside {nside}, degree {degree}, l = {l}, m = {m}")
                });
            }
        }
    }
    Ok(())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn adjoint(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let fejer = Grid::fejer(21, 48)?.with_ring_azimuths(&uniform(840, 21))?;
    let grids = [
        (Grid::healpix(1)?, 2),
        (Grid::healpix(5)?, 14),
        (Grid::healpix(16)?, 40),
        (fejer, 20),
    ];
    for (grid, degree) in grids {
        let transform = Transform::new(&grid, degree)?;
        let (f, y) = (noise(degree, 841), uniform(842, grid.len()));
        let (map, set) = (transform.synthesise(&f)?, transform.synthesise_adjoint(&y)?);
        let scale = (dot(&map, &map) * dot(&y, &y)).sqrt();
        let here = dot(f.as_slice(), set.as_slice());
        tally.compare_scaled(here, dot(&map, &y), scale, || {
            format!("{:?} {}", grid.latitudes(), grid.rings())
        });
    }
    Ok(())
}
