//! Fields of other libraries, from their coefficients as they store them.

use lobes::glam::DVec3;
use lobes::num_complex::Complex64;
use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::harmonics::{Basis, Coefficients, Convention, Normalisation, Order, Phase};
use lobes::{Error, Parallelism, Result};

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
            id: "convention/shtns",
            function: "harmonics::Coefficients::from_complex",
            oracle: Oracle::Snapshot("conventions_shtns"),
            domain: "the same of SHTns, synthesised on a Gauss–Legendre grid: orthonormal, 4π and Schmidt, each with and without the Condon–Shortley phase",
            metric: RMS,
            bound: 1e-14,
            why: "as above",
            loose: None,
            measure: shtns,
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

impl Complex {
    fn coefficients(&self, convention: Convention) -> Result<Coefficients> {
        let values: Vec<Complex64> = self
            .coefficients
            .iter()
            .map(|&[re, im]| Complex64::new(re, im))
            .collect();
        Coefficients::from_complex(self.degree, convention, &values)
    }
}

fn complex(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for library in ["scipy", "healpy", "ducc0"] {
        for case in snapshots.cases::<Complex>("conventions", library)? {
            let f = case.coefficients(Convention::HEALPIX)?;
            case.field.compare(tally, library, &f)?;
        }
    }
    Ok(())
}

/// Which of its conventions a library was asked for.
#[derive(Deserialize)]
pub(super) struct Named {
    pub(super) normalisation: String,
    pub(super) condon_shortley: bool,
}

impl Named {
    pub(super) fn convention(&self) -> Result<Convention> {
        Ok(Convention {
            normalisation: match self.normalisation.as_str() {
                "4pi" => Normalisation::FourPi,
                "ortho" => Normalisation::Orthonormal,
                "schmidt" => Normalisation::Schmidt,
                other => {
                    return Err(Error::UnknownName {
                        what: "normalisation",
                        name: other.into(),
                        names: ["4pi", "ortho", "schmidt"].map(String::from).into(),
                    });
                }
            },
            phase: if self.condon_shortley {
                Phase::CondonShortley
            } else {
                Phase::Plain
            },
        })
    }
}

#[derive(Deserialize)]
struct Shtns {
    #[serde(flatten)]
    named: Named,
    #[serde(flatten)]
    complex: Complex,
}

fn shtns(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Shtns>("conventions_shtns", "shtns")? {
        let f = case.complex.coefficients(case.named.convention()?)?;
        let name = &case.named.normalisation;
        case.complex.field.compare(tally, name, &f)?;
    }
    Ok(())
}

#[derive(Deserialize)]
struct Shtools {
    #[serde(flatten)]
    named: Named,
    #[serde(flatten)]
    real: Real,
}

fn shtools(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for Shtools { named, real } in snapshots.cases::<Shtools>("conventions", "shtools")? {
        let convention = named.convention()?;
        let f =
            Coefficients::from_real(real.degree, convention, Order::ByDegree, &real.coefficients)?;
        real.field.compare(tally, &named.normalisation, &f)?;
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
