//! Fields of other libraries, from their coefficients as they store them.

use glam::DVec3;
use num_complex::Complex64;
use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use crate::harmonics::{Basis, Coefficients, Convention, Normalisation, Order, Phase};
use crate::{Error, Parallelism, Result};

const ORACLE: Oracle = Oracle::Snapshot("conventions");
const RMS: Metric = Metric::Scaled("the field's rms");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "convention/complex",
            function: "harmonics::Coefficients::from_complex",
            oracle: ORACLE,
            domain: "random coefficients of degree 7 of scipy, healpy and ducc0, at directions of all octants",
            metric: RMS,
            bound: 1e-14,
            why: "sums of 64 terms, in the libraries as here",
            loose: None,
            measure: complex,
        },
        Contract {
            id: "convention/shtools",
            function: "harmonics::Coefficients::from_real",
            oracle: ORACLE,
            domain: "the same of SHTOOLS: 4π, orthonormal and Schmidt, each with and without the Condon–Shortley phase",
            metric: RMS,
            bound: 1e-14,
            why: "as above",
            loose: None,
            measure: shtools,
        },
        Contract {
            id: "convention/drjit",
            function: "harmonics::Coefficients::from_real",
            oracle: ORACLE,
            domain: "the same of drjit: the Condon–Shortley phase, the order l² + l + m",
            metric: RMS,
            bound: 5e-15,
            why: "as above",
            loose: None,
            measure: |snapshots, tally| real(snapshots, tally, "drjit", Convention::HEALPIX),
        },
        Contract {
            id: "convention/sphericart",
            function: "harmonics::Coefficients::from_real",
            oracle: ORACLE,
            domain: "the same of sphericart: no phase, the order l² + l + m",
            metric: RMS,
            bound: 3e-14,
            why: "sphericart has 10⁻¹⁴ where drjit has 10⁻¹⁵",
            loose: None,
            measure: |snapshots, tally| real(snapshots, tally, "sphericart", Convention::default()),
        },
    ]
}

#[derive(Deserialize)]
struct Field {
    directions: Vec<[f64; 3]>,
    values: Vec<f64>,
}

impl Field {
    fn compare(&self, tally: &mut Tally, name: &str, f: &Coefficients) -> Result<()> {
        let rms = (f.energy() / (4.0 * std::f64::consts::PI)).sqrt();
        let directions: Vec<DVec3> = self.directions.iter().copied().map(DVec3::from).collect();
        let mut got = vec![0.0; directions.len()];
        Basis::new(f.degree())?.sums(f, &directions, &mut got, Parallelism::Sequential)?;
        for ((got, want), direction) in got.iter().zip(&self.values).zip(&directions) {
            tally.compare_scaled(*got, *want, rms, || format!("{name} at {direction}"));
        }
        Ok(())
    }
}

#[derive(Deserialize)]
struct Complex {
    degree: usize,
    coefficients: Vec<[f64; 2]>,
    #[serde(flatten)]
    field: Field,
}

fn complex(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for library in ["scipy", "healpy", "ducc0"] {
        for case in snapshots.cases::<Complex>("conventions", library)? {
            let values: Vec<Complex64> = case
                .coefficients
                .iter()
                .map(|&[re, im]| Complex64::new(re, im))
                .collect();
            let f = Coefficients::from_complex(case.degree, Convention::HEALPIX, &values)?;
            case.field.compare(tally, library, &f)?;
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Shtools {
    normalisation: String,
    condon_shortley: bool,
    degree: usize,
    coefficients: Vec<f64>,
    #[serde(flatten)]
    field: Field,
}

fn shtools(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Shtools>("conventions", "shtools")? {
        let convention = Convention {
            normalisation: match case.normalisation.as_str() {
                "4pi" => Normalisation::FourPi,
                "ortho" => Normalisation::Orthonormal,
                "schmidt" => Normalisation::Schmidt,
                other => {
                    return Err(Error::Unanswerable(format!(
                        "there is no normalisation {other:?}"
                    )));
                }
            },
            phase: if case.condon_shortley {
                Phase::CondonShortley
            } else {
                Phase::Plain
            },
        };
        let f =
            Coefficients::from_real(case.degree, convention, Order::ByDegree, &case.coefficients)?;
        case.field.compare(tally, &case.normalisation, &f)?;
    }
    Ok(())
}

#[derive(Deserialize)]
struct Real {
    degree: usize,
    coefficients: Vec<f64>,
    #[serde(flatten)]
    field: Field,
}

fn real(
    snapshots: &Snapshots,
    tally: &mut Tally,
    library: &str,
    convention: Convention,
) -> Result<()> {
    for case in snapshots.cases::<Real>("conventions", library)? {
        let f =
            Coefficients::from_real(case.degree, convention, Order::ByDegree, &case.coefficients)?;
        case.field.compare(tally, library, &f)?;
    }
    Ok(())
}
