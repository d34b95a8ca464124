//! Wigner's matrices against their closed sums in many digits.

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::glam::DQuat;
use lobes::harmonics::wigner;

const ORACLE: Oracle = Oracle::Snapshot("wigner");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "wigner/small-d",
            function: "harmonics::wigner::d_matrix",
            oracle: ORACLE,
            domain: "degrees 1 … 512, eight angles from 10⁻⁹ to 12.3; of high degrees 32 elements, in the corners, near the diagonals and between",
            metric: Metric::Absolute,
            bound: 1e-15,
            why: "elements of at most 1, by double-double steps: only the last product rounds",
            loose: None,
            measure: small_d,
        },
        Contract {
            id: "wigner/large-d",
            function: "harmonics::wigner::rotation_matrix",
            oracle: ORACLE,
            domain: "degrees 2, 33 and 512, five quaternions, of any length, next to the pole and to half a turn; real and imaginary parts",
            metric: Metric::Absolute,
            bound: 1e-15,
            why: "as above, times two phases that are rounded once",
            loose: None,
            measure: large_d,
        },
    ]
}

#[derive(Deserialize)]
struct SmallD {
    degree: usize,
    beta: f64,
    /// m′ and m.
    orders: Vec<[isize; 2]>,
    values: Vec<f64>,
}

fn small_d(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<SmallD>("wigner", "small-d")? {
        let matrix = wigner::d_matrix(case.degree, case.beta)?;
        for ([row, column], want) in case.orders.into_iter().zip(&case.values) {
            let at = |m: isize| case.degree.wrapping_add_signed(m);
            tally.compare(matrix[(at(row), at(column))], *want, || {
                format!(
                    "l = {}, β = {}, m′ = {row}, m = {column}",
                    case.degree, case.beta
                )
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct LargeD {
    degree: usize,
    /// x, y, z, w.
    quaternion: [f64; 4],
    orders: Vec<[isize; 2]>,
    real: Vec<f64>,
    imaginary: Vec<f64>,
}

fn large_d(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<LargeD>("wigner", "large-d")? {
        let turn = DQuat::from_array(case.quaternion);
        let matrix = wigner::rotation_matrix(case.degree, turn)?;
        let values = case.real.iter().zip(&case.imaginary);
        for ([row, column], (real, imaginary)) in case.orders.into_iter().zip(values) {
            let at = |m: isize| case.degree.wrapping_add_signed(m);
            let got = matrix[(at(row), at(column))];
            let place = || format!("l = {}, {turn}, m′ = {row}, m = {column}", case.degree);
            tally.compare(got.re, *real, place);
            tally.compare(got.im, *imaginary, place);
        }
    }
    Ok(())
}
