//! Transforms in single precision against those in double, which are held against other libraries.

use super::generator::{noise, uniform};
use super::{Contract, Metric, Oracle, Tally};
use lobes::Result;
use lobes::harmonics::{SingleTransform, Transform};
use lobes::sphere::Grid;

const ORACLE: Oracle = Oracle::Identity("Transform, of the same coefficients or maps");

const METRIC: Metric = Metric::Scaled("the root mean square of the result");

const SMALL: &str = "random coefficients and maps of degree 0 … 64 on nine grids, of which no two have rings or columns alike: a lane left over, one ring, orders cut off, azimuths that fall";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "single/synthesis",
            function: "harmonics::SingleTransform::synthesise",
            oracle: ORACLE,
            domain: SMALL,
            metric: METRIC,
            bound: 1.5e-6,
            why: "the largest of some 10⁴ errors, whose root mean square is 2·10⁻⁷: roundings of the sums over degree and along rings",
            loose: None,
            measure: |_, tally| small(tally, synthesis),
        },
        Contract {
            id: "single/analysis",
            function: "harmonics::SingleTransform::analyse",
            oracle: ORACLE,
            domain: SMALL,
            metric: METRIC,
            bound: 1.5e-6,
            why: "as above",
            loose: None,
            measure: |_, tally| small(tally, analysis),
        },
        Contract {
            id: "single/root-mean-square-511",
            function: "harmonics::SingleTransform::{synthesise, analyse}",
            oracle: ORACLE,
            domain: "degrees 255, 287 and 511 on Gauss–Legendre grids, at 287 a bundle of whose halves one is in the other form; the root mean square of the error",
            metric: METRIC,
            bound: 1.3e-6,
            why: "rounding turns the phase of Legendre functions by up to 128 steps' worth; sums of rings one bundle after another, as AVX2 has them, take 1.1·10⁻⁶",
            loose: None,
            measure: |_, tally| large(&[255, 287, 511], &["synthesis", "analysis"], tally),
        },
        Contract {
            id: "single/synthesis-2047",
            function: "harmonics::SingleTransform::synthesise",
            oracle: ORACLE,
            domain: "degrees 1023 and 2047; the root mean square of the error",
            metric: METRIC,
            bound: 2.4e-6,
            why: "as above; without fused multiplication and addition 2.0·10⁻⁶, and 2.7·10⁻⁶ if the recurrence were never renewed",
            loose: None,
            measure: |_, tally| large(&[1023, 2047], &["synthesis"], tally),
        },
        Contract {
            id: "single/analysis-2047",
            function: "harmonics::SingleTransform::analyse",
            oracle: ORACLE,
            domain: "the same",
            metric: METRIC,
            bound: 3.5e-6,
            why: "as above, and the sums of rings: with AVX2 3.0·10⁻⁶",
            loose: None,
            measure: |_, tally| large(&[1023, 2047], &["analysis"], tally),
        },
    ]
}

/// The plans of both precisions.
struct Pair {
    double: Transform,
    single: SingleTransform,
    name: String,
}

impl Pair {
    fn new(grid: &Grid, degree: usize, orders: usize) -> Result<Self> {
        Ok(Self {
            double: Transform::with_orders(grid, degree, orders)?,
            single: SingleTransform::with_orders(grid, degree, orders)?,
            name: format!(
                "{:?} {}×{}, degree {degree}, orders {orders}",
                grid.latitudes(),
                grid.rings(),
                grid.columns()
            ),
        })
    }
}

/// Values that single precision holds, in both.
fn both(values: &[f64]) -> (Vec<f64>, Vec<f32>) {
    let single: Vec<f32> = values.iter().map(|&value| value as f32).collect();
    (
        single.iter().map(|&value| f64::from(value)).collect(),
        single,
    )
}

fn small(tally: &mut Tally, measure: fn(&Pair, &mut Tally) -> Result<()>) -> Result<()> {
    for (grid, degree, orders) in [
        (Grid::gauss_legendre(1, 1)?, 0, 0),
        (Grid::gauss_legendre(2, 4)?, 1, 1),
        (Grid::gauss_legendre(16, 31)?, 15, 15),
        (Grid::gauss_legendre(33, 66)?, 32, 32),
        (Grid::gauss_legendre(65, 130)?, 64, 64),
        (Grid::gauss_legendre(64, 20)?, 63, 9),
        (Grid::fejer(71, 77)?, 35, 35),
        (
            Grid::clenshaw_curtis(34, 40)?.with_first_azimuth(0.3),
            16,
            16,
        ),
        (Grid::lat_long(64, 128)?, 31, 31),
    ] {
        measure(&Pair::new(&grid, degree, orders)?, tally)?;
    }
    Ok(())
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

fn synthesis(pair: &Pair, tally: &mut Tally) -> Result<()> {
    let (double, single) = both(&uniform(7, pair.double.coefficient_count()));
    let mut map = vec![0.0; pair.double.grid().len()];
    let mut scratch = vec![0.0; pair.double.scratch_len(1)];
    let one = lobes::Parallelism::Sequential;
    pair.double
        .synthesise_into(1, &double, &mut map, &mut scratch, one)?;
    let scale = rms(&map);
    let got = pair.single.synthesise(&single)?;
    for (i, (got, want)) in got.iter().zip(&map).enumerate() {
        tally.compare_scaled(f64::from(*got), *want, scale, || {
            format!("{}, value {i}", pair.name)
        });
    }
    Ok(())
}

fn analysis(pair: &Pair, tally: &mut Tally) -> Result<()> {
    let (double, single) = both(&uniform(8, pair.double.grid().len()));
    let want = pair.double.analyse(&double)?;
    let scale = rms(want.as_slice());
    let got = pair.single.analyse(&single)?;
    for (i, (got, want)) in got.iter().zip(want.as_slice()).enumerate() {
        tally.compare_scaled(f64::from(*got), *want, scale, || {
            format!("{}, coefficient {i}", pair.name)
        });
    }
    Ok(())
}

fn large(degrees: &[usize], directions: &[&str], tally: &mut Tally) -> Result<()> {
    for &degree in degrees {
        let grid = Grid::gauss_legendre(degree + 1, 2 * degree + 2)?;
        let pair = Pair::new(&grid, degree, degree)?;
        let coefficients = noise(degree, 9);
        let (double, single) = both(coefficients.as_slice());
        let exact = lobes::harmonics::Coefficients::from_vec(degree, degree, double)?;
        let map = pair.double.synthesise(&exact)?;
        let mut compare = |what: &str, got: &[f32], want: &[f64]| {
            let differences: Vec<f64> = got
                .iter()
                .zip(want)
                .map(|(got, want)| f64::from(*got) - want)
                .collect();
            tally.compare_scaled(rms(&differences), 0.0, rms(want), || {
                format!("{what} at degree {degree}")
            });
        };
        if directions.contains(&"synthesis") {
            compare("synthesis", &pair.single.synthesise(&single)?, &map);
        }
        if directions.contains(&"analysis") {
            let (double, single) = both(&map);
            let want = pair.double.analyse(&double)?;
            compare("analysis", &pair.single.analyse(&single)?, want.as_slice());
        }
    }
    Ok(())
}
