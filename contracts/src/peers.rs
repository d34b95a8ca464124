//! What users of other libraries compute with them, by the libraries' own numbers.

use std::f64::consts::{PI, SQRT_2};

use serde::Deserialize;

use super::convention::Named;
use super::generator::uniform;
use super::metric::ulp;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{
    Basis, Coefficients, ComplexCoefficients, Convention, Coupling, Order, Rotation, Transform,
    average_power, coefficient_count, convolve_zonal, cross_power, gaussian_beam, legendre, wigner,
};
use lobes::num_complex::Complex64;
use lobes::sphere::Grid;
use lobes::{Error, Parallelism, Result};

const PEERS: &str = "peers";
const ROTATIONS: &str = "peers_rotations";
const ORACLE: Oracle = Oracle::Snapshot(PEERS);
const RMS: Metric = Metric::Scaled("the rms of their answer");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "peers/harmonics",
            function: "harmonics::Basis::sums",
            oracle: ORACLE,
            domain: "single harmonics of degrees 0 … 100 at five or six directions: complex of SciPy, real of SHTOOLS in six conventions, of sphericart and of e3nn in three normalisations",
            metric: Metric::Scaled("the harmonic's rms"),
            bound: 6e-14,
            why: "SciPy's at degree 100; the largest value is 2.7 times the rms there",
            loose: None,
            measure: harmonics,
        },
        Contract {
            id: "peers/rules",
            function: "sphere::Grid::ring_weight",
            oracle: ORACLE,
            domain: "nodes and weights of 1 … 65 rings: Gauss and Legendre's by SciPy, SHTOOLS and ducc0, Clenshaw and Curtis's and Fejér's by ducc0",
            metric: Metric::Absolute,
            bound: 5e-15,
            why: "the last digits of SciPy's nodes",
            loose: None,
            measure: rules,
        },
        Contract {
            id: "peers/legendre",
            function: "harmonics::legendre::column",
            oracle: ORACLE,
            domain: "P_l of degrees to 200 by SciPy and SHTOOLS, orthonormal P_lm of degrees to 30 by SHTOOLS",
            metric: Metric::Absolute,
            bound: 1e-14,
            why: "their recurrences; values of order one",
            loose: None,
            measure: legendre_functions,
        },
        Contract {
            id: "peers/synthesis",
            function: "harmonics::Transform::synthesise",
            oracle: ORACLE,
            domain: "ducc0 on Gauss–Legendre, Clenshaw–Curtis and Fejér grids and healpy on HEALPix, degrees 1 … 32, all orders and some; SHTOOLS in six conventions",
            metric: RMS,
            bound: 5e-14,
            why: "sums of up to 10³ terms, in the libraries as here",
            loose: None,
            measure: synthesis,
        },
        Contract {
            id: "peers/analysis",
            function: "harmonics::Transform::analyse",
            oracle: ORACLE,
            domain: "maps of white noise: ducc0 on Gauss–Legendre and Clenshaw–Curtis grids; healpy with no, one and three iterations",
            metric: RMS,
            bound: 2e-14,
            why: "as above",
            loose: None,
            measure: analysis,
        },
        Contract {
            id: "peers/adjoints",
            function: "harmonics::Transform::synthesise_adjoint",
            oracle: ORACLE,
            domain: "ducc0's adjoints of synthesis, of analysis and of synthesis at points, on the grids of peers/synthesis",
            metric: RMS,
            bound: 1e-13,
            why: "as above; at points ducc0 is asked for 10⁻¹⁴",
            loose: None,
            measure: adjoints,
        },
        Contract {
            id: "peers/points",
            function: "harmonics::Basis::sums",
            oracle: ORACLE,
            domain: "ducc0's synthesis at twelve directions, degrees 3 … 40",
            metric: RMS,
            bound: 1e-13,
            why: "ducc0 is asked for 10⁻¹⁴",
            loose: None,
            measure: points,
        },
        Contract {
            id: "peers/gradients",
            function: "harmonics::Transform::gradient",
            oracle: ORACLE,
            domain: "healpy's derivatives south and east on HEALPix, degrees 1 … 9; sphericart's gradients at directions, degrees 1 … 8",
            metric: RMS,
            bound: 3e-14,
            why: "as peers/synthesis, times the degree",
            loose: None,
            measure: gradients,
        },
        Contract {
            id: "peers/power",
            function: "harmonics::cross_power",
            oracle: ORACLE,
            domain: "power of SHTOOLS in six conventions, power and cross power of healpy, degrees 0 … 24",
            metric: RMS,
            bound: 5e-15,
            why: "sums of up to 49 squares",
            loose: None,
            measure: power,
        },
        Contract {
            id: "peers/filters",
            function: "harmonics::convolve_zonal",
            oracle: ORACLE,
            domain: "healpy's beams of 0.1° … 30°, smoothing and products by degree",
            metric: RMS,
            bound: 5e-15,
            why: "a product; the exponential of a beam",
            loose: None,
            measure: filters,
        },
        Contract {
            id: "peers/rotation",
            function: "harmonics::Rotation::rotate",
            oracle: ORACLE,
            domain: "random rotations of degrees 0 … 48 by the Euler angles of ducc0, healpy and SHTOOLS, both of its conventions",
            metric: RMS,
            bound: 2e-13,
            why: "their recurrences",
            loose: None,
            measure: rotation,
        },
        Contract {
            id: "peers/wigner",
            function: "harmonics::wigner::rotation_matrix",
            oracle: Oracle::Snapshot(ROTATIONS),
            domain: "e3nn's real matrices of degrees 1 … 8; d and D of spherical, degrees 1 … 16",
            metric: RMS,
            bound: 1e-13,
            why: "e3nn's, by the exponentials of generators",
            loose: None,
            measure: wigner_matrices,
        },
        Contract {
            id: "peers/coupling",
            function: "harmonics::Coupling::from_power",
            oracle: ORACLE,
            domain: "SHTOOLS' coupling matrices of windows of degrees 2, 5 and 12",
            metric: RMS,
            bound: 1e-14,
            why: "sums of 3j symbols",
            loose: None,
            measure: coupling,
        },
        Contract {
            id: "peers/conversion",
            function: "harmonics::Coefficients::from_complex",
            oracle: Oracle::Identity(
                "there and back are the same bits, where rounding lost none on the way",
            ),
            domain: "real and complex coefficients of degree 24, orthonormal, 4π and Schmidt, with and without the phase: all that are not scaled, and of the others those that are scaled onto a finer grid of doubles",
            metric: Metric::Mismatch,
            bound: 0.0,
            why: "there is one factor, and the way back divides by it",
            loose: None,
            measure: conversion,
        },
    ]
}

fn unknown(what: &'static str, name: &str, names: &[&str]) -> Error {
    Error::UnknownName {
        what,
        name: name.into(),
        names: names.iter().map(ToString::to_string).collect(),
    }
}

/// Real numbers, or real and imaginary parts.
#[derive(Deserialize)]
#[serde(untagged)]
enum PeerValues {
    Real(Vec<f64>),
    Complex(Vec<[f64; 2]>),
}

impl PeerValues {
    /// One after the other, and how many each value has.
    fn parts(&self) -> (&[f64], usize) {
        match self {
            Self::Real(values) => (values, 1),
            Self::Complex(values) => (values.as_flattened(), 2),
        }
    }
}

/// Some of a library's answers.
#[derive(Deserialize)]
struct Answer {
    source: String,
    /// Which, of all; each unless said.
    shown: Option<Vec<usize>>,
    values: PeerValues,
}

impl Answer {
    /// Compares with all of ours, in units of the rms.
    fn compare(&self, tally: &mut Tally, ours: &[f64]) {
        let (wanted, width) = self.values.parts();
        let energy: f64 = wanted.iter().map(|value| value * value).sum();
        let scale = (energy / wanted.len() as f64).sqrt();
        for (at, want) in wanted.iter().enumerate() {
            let value = match &self.shown {
                Some(shown) => shown[at / width],
                None => at / width,
            };
            let got = ours.get(width * value + at % width);
            let got = got.copied().unwrap_or(f64::NAN);
            tally.compare_scaled(got, *want, scale, || {
                format!("{}, value {value}", self.source)
            });
        }
    }
}

fn flat(values: &[Complex64]) -> Vec<f64> {
    values
        .iter()
        .flat_map(|value| [value.re, value.im])
        .collect()
}

/// In the order in which healpy and ducc0 store them.
fn as_theirs(set: &Coefficients) -> Vec<f64> {
    flat(&set.to_complex(Convention::HEALPIX))
}

/// `complex_set` of `oracles/peers.py`, as ours.
fn complex_set(seed: u64, degree: usize, orders: usize) -> Result<Coefficients> {
    let count = (0..=orders).map(|m| degree + 1 - m).sum();
    let numbers = uniform(seed, 2 * count);
    let mut values: Vec<Complex64> = (0..count)
        .map(|at| {
            let imaginary = if at <= degree {
                0.0
            } else {
                numbers[count + at]
            };
            Complex64::new(numbers[at], imaginary)
        })
        .collect();
    values.resize((degree + 1) * (degree + 2) / 2, Complex64::ZERO);
    let all = Coefficients::from_complex(degree, Convention::HEALPIX, &values)?;
    // Sets are stored by order: those of the first orders come first.
    let kept = all.as_slice()[..coefficient_count(degree, orders)].to_vec();
    Coefficients::from_vec(degree, orders, kept)
}

fn real_set(seed: u64, degree: usize, convention: Convention) -> Result<Coefficients> {
    let values = uniform(seed, (degree + 1) * (degree + 1));
    Coefficients::from_real(degree, convention, Order::ByDegree, &values)
}

#[derive(Deserialize)]
struct Harmonic {
    source: String,
    kind: String,
    #[serde(flatten)]
    named: Named,
    degree: usize,
    order: isize,
    directions: Vec<[f64; 3]>,
    values: Vec<[f64; 2]>,
}

fn harmonics(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    let mut cases = snapshots.cases::<Harmonic>(PEERS, "harmonic")?;
    cases.extend(snapshots.cases::<Harmonic>(ROTATIONS, "harmonic")?);
    for case in cases {
        let (degree, convention) = (case.degree, case.named.convention()?);
        let sets = if case.kind == "complex" {
            let mut unit = ComplexCoefficients::zeros(degree);
            unit.set(degree, case.order, Complex64::ONE)?;
            unit.parts()
        } else {
            let mut unit = vec![0.0; (degree + 1) * (degree + 1)];
            unit[(degree * degree + degree).wrapping_add_signed(case.order)] = 1.0;
            let real = Coefficients::from_real(degree, convention, Order::ByDegree, &unit)?;
            [real, Coefficients::zeros(degree)]
        };
        let energy: f64 = sets.iter().map(Coefficients::energy).sum();
        let scale = (energy / (4.0 * PI)).sqrt();
        let directions: Vec<DVec3> = case.directions.iter().copied().map(DVec3::from).collect();
        let basis = Basis::new(degree)?;
        for (part, set) in sets.iter().enumerate() {
            let mut got = vec![0.0; directions.len()];
            basis.sums(set, &directions, &mut got, Parallelism::Sequential)?;
            for ((got, want), at) in got.iter().zip(&case.values).zip(&directions) {
                tally.compare_scaled(*got, want[part], scale, || {
                    format!("{}, l = {degree}, m = {} at {at}", case.source, case.order)
                });
            }
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Rule {
    source: String,
    grid: String,
    rings: usize,
    cosines: Vec<f64>,
    weights: Vec<f64>,
}

fn grid(name: &str, rings: usize, columns: usize) -> Result<Grid> {
    Ok(match name {
        "gauss-legendre" => Grid::gauss_legendre(rings, columns)?,
        "clenshaw-curtis" => Grid::clenshaw_curtis(rings, columns)?,
        // Their columns begin at 0.
        "fejer" => Grid::fejer(rings, columns)?.with_first_azimuth(0.0),
        "healpix" => Grid::healpix(columns / 4)?,
        other => return Err(unknown("grid", other, &["gauss-legendre", "healpix"])),
    })
}

fn rules(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Rule>(PEERS, "rule")? {
        let grid = grid(&case.grid, case.rings, 1)?;
        for ring in 0..case.rings {
            let place = || format!("{}, ring {ring} of {}", case.source, case.rings);
            tally.compare(grid.cosines()[ring], case.cosines[ring], place);
            let weight = grid.ring_weight(ring) / (2.0 * PI);
            tally.compare(weight, case.weights[ring], place);
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Polynomials {
    source: String,
    x: f64,
    values: Vec<f64>,
}

#[derive(Deserialize)]
struct Column {
    degree: usize,
    order: usize,
    #[serde(flatten)]
    column: Polynomials,
}

fn legendre_functions(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    let mut compare = |case: &Polynomials, got: &[f64], first: usize| {
        for (step, (got, want)) in got.iter().zip(&case.values).enumerate() {
            tally.compare(*got, *want, || {
                format!("{}, l = {}, x = {}", case.source, first + step, case.x)
            });
        }
    };
    for case in snapshots.cases::<Polynomials>(PEERS, "polynomials")? {
        let mut got = vec![0.0; case.values.len()];
        legendre::polynomials(case.x, &mut got);
        compare(&case, &got, 0);
    }
    for case in snapshots.cases::<Column>(PEERS, "legendre")? {
        let mut got = vec![0.0; case.column.values.len()];
        let (m, x) = (case.order, case.column.x);
        let sine = ((1.0 - x) * (1.0 + x)).sqrt();
        legendre::column(m, case.degree, x, sine, &mut got)?;
        // Real harmonics: √2 times the complex ones' but for order 0.
        compare(&case.column, &got, m);
    }
    Ok(())
}

#[derive(Deserialize)]
struct OnGrid {
    grid: String,
    rings: usize,
    columns: usize,
    degree: usize,
    orders: usize,
    seed: u64,
    #[serde(default)]
    iterations: usize,
    #[serde(flatten)]
    answer: Answer,
}

impl OnGrid {
    fn transform(&self) -> Result<Transform> {
        let grid = grid(&self.grid, self.rings, self.columns)?;
        Transform::with_orders(&grid, self.degree, self.orders)
    }

    fn set(&self) -> Result<Coefficients> {
        complex_set(self.seed, self.degree, self.orders)
    }

    fn noise(&self, transform: &Transform) -> Vec<f64> {
        uniform(self.seed, transform.grid().len())
    }
}

#[derive(Deserialize)]
struct PeerTransform {
    #[serde(flatten)]
    named: Named,
    rings: usize,
    columns: usize,
    degree: usize,
    seed: u64,
    #[serde(flatten)]
    answer: Answer,
}

fn synthesis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<OnGrid>(PEERS, "synthesis")? {
        let map = case.transform()?.synthesise(&case.set()?)?;
        case.answer.compare(tally, &map);
    }
    for case in snapshots.cases::<PeerTransform>(PEERS, "shtools")? {
        let set = real_set(case.seed, case.degree, case.named.convention()?)?;
        let grid = Grid::gauss_legendre(case.rings, case.columns)?;
        let map = Transform::new(&grid, case.degree)?.synthesise(&set)?;
        case.answer.compare(tally, &map);
    }
    Ok(())
}

fn analysis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<OnGrid>(PEERS, "analysis")? {
        let transform = case.transform()?;
        let set = transform.analyse(&case.noise(&transform))?;
        case.answer.compare(tally, &as_theirs(&set));
    }
    for case in snapshots.cases::<OnGrid>(PEERS, "iterated")? {
        let transform = case.transform()?;
        let (map, threads) = (case.noise(&transform), Parallelism::Sequential);
        let set = transform.analyse_iterated(&map, case.iterations, threads)?;
        case.answer.compare(tally, &as_theirs(&set));
    }
    Ok(())
}

#[derive(Deserialize)]
struct AtPoints {
    degree: usize,
    seed: u64,
    directions: Vec<[f64; 3]>,
    #[serde(flatten)]
    answer: Answer,
}

impl AtPoints {
    fn directions(&self) -> Vec<DVec3> {
        self.directions.iter().copied().map(DVec3::from).collect()
    }
}

fn adjoints(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<OnGrid>(PEERS, "adjoint-synthesis")? {
        let transform = case.transform()?;
        let set = transform.synthesise_adjoint(&case.noise(&transform))?;
        case.answer.compare(tally, &as_theirs(&set));
    }
    for case in snapshots.cases::<OnGrid>(PEERS, "adjoint-analysis")? {
        let map = case.transform()?.analyse_adjoint(&case.set()?)?;
        case.answer.compare(tally, &map);
    }
    for case in snapshots.cases::<AtPoints>(PEERS, "adjoint-points")? {
        let directions = case.directions();
        let values = uniform(case.seed, directions.len());
        let basis = Basis::new(case.degree)?;
        let set = basis.sums_adjoint(&values, &directions, Parallelism::Sequential)?;
        case.answer.compare(tally, &as_theirs(&set));
    }
    Ok(())
}

fn points(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<AtPoints>(PEERS, "points")? {
        let directions = case.directions();
        let set = complex_set(case.seed, case.degree, case.degree)?;
        let mut got = vec![0.0; directions.len()];
        Basis::new(case.degree)?.sums(&set, &directions, &mut got, Parallelism::Sequential)?;
        case.answer.compare(tally, &got);
    }
    Ok(())
}

#[derive(Deserialize)]
struct Slopes {
    degree: usize,
    seed: u64,
    directions: Vec<[f64; 3]>,
    source: String,
    values: Vec<[f64; 3]>,
}

fn gradients(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<OnGrid>(PEERS, "gradient")? {
        let [south, east] = case
            .transform()?
            .gradient(&case.set()?, Parallelism::Sequential)?;
        let both = south.iter().zip(&east);
        let both: Vec<f64> = both.flat_map(|(south, east)| [*south, *east]).collect();
        case.answer.compare(tally, &both);
    }
    for case in snapshots.cases::<Slopes>(PEERS, "slopes")? {
        let directions: Vec<DVec3> = case.directions.iter().copied().map(DVec3::from).collect();
        let set = real_set(case.seed, case.degree, Convention::default())?;
        let mut got = vec![(0.0, DVec3::ZERO); directions.len()];
        let basis = Basis::new(case.degree)?;
        basis.gradients(&set, &directions, &mut got, Parallelism::Sequential)?;
        // Theirs are of r^0 Y and may keep rounding along the direction, which is no slope.
        let wanted = directions.iter().zip(&case.values).flat_map(|(at, slope)| {
            let slope = DVec3::from(*slope);
            (slope - *at * slope.dot(*at)).to_array()
        });
        let answer = Answer {
            source: case.source,
            shown: None,
            values: PeerValues::Real(wanted.collect()),
        };
        let got: Vec<f64> = got.iter().flat_map(|(_, slope)| slope.to_array()).collect();
        answer.compare(tally, &got);
    }
    Ok(())
}

#[derive(Deserialize)]
struct PeerPower {
    #[serde(flatten)]
    named: Named,
    degree: usize,
    seed: u64,
    #[serde(flatten)]
    answer: Answer,
}

#[derive(Deserialize)]
struct CrossPower {
    degree: usize,
    seeds: [u64; 2],
    #[serde(flatten)]
    answer: Answer,
}

fn power(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<PeerPower>(PEERS, "power")? {
        let set = real_set(case.seed, case.degree, case.named.convention()?)?;
        // Theirs is of coefficients of 4π.
        let power = average_power(&set).into_iter();
        let power: Vec<f64> = power.map(|power| power / (4.0 * PI)).collect();
        case.answer.compare(tally, &power);
    }
    for case in snapshots.cases::<CrossPower>(PEERS, "cross-power")? {
        let [a, b] = case
            .seeds
            .map(|seed| complex_set(seed, case.degree, case.degree));
        case.answer.compare(tally, &cross_power(&a?, &b?)?);
    }
    Ok(())
}

#[derive(Deserialize)]
struct PeerBeam {
    degree: usize,
    fwhm: f64,
    #[serde(flatten)]
    answer: Answer,
}

#[derive(Deserialize)]
struct Filter {
    degree: usize,
    seed: u64,
    factors: Vec<f64>,
    #[serde(flatten)]
    answer: Answer,
}

fn filters(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<PeerBeam>(PEERS, "beam")? {
        case.answer
            .compare(tally, &gaussian_beam(case.degree, case.fwhm)?);
    }
    for case in snapshots.cases::<Filter>(PEERS, "filter")? {
        let mut set = complex_set(case.seed, case.degree, case.degree)?;
        convolve_zonal(&mut set, &case.factors)?;
        case.answer.compare(tally, &as_theirs(&set));
    }
    Ok(())
}

#[derive(Deserialize)]
struct Turned {
    degree: usize,
    seed: u64,
    quaternion: [f64; 4],
    #[serde(flatten)]
    answer: Answer,
}

fn rotation(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    let turned = |case: &Turned, set: &Coefficients| {
        let turn = DQuat::from_array(case.quaternion);
        Rotation::new(case.degree)?.rotate(set, turn, Parallelism::Sequential)
    };
    for case in snapshots.cases::<Turned>(PEERS, "rotation")? {
        let set = turned(&case, &complex_set(case.seed, case.degree, case.degree)?)?;
        case.answer.compare(tally, &as_theirs(&set));
    }
    for case in snapshots.cases::<Turned>(PEERS, "real-rotation")? {
        let plain = Convention::default();
        let set = turned(&case, &real_set(case.seed, case.degree, plain)?)?;
        case.answer
            .compare(tally, &set.to_real(plain, Order::ByDegree));
    }
    Ok(())
}

#[derive(Deserialize)]
struct PeerSmallD {
    degree: usize,
    beta: f64,
    #[serde(flatten)]
    answer: Answer,
}

#[derive(Deserialize)]
struct PeerLargeD {
    degree: usize,
    quaternion: [f64; 4],
    #[serde(flatten)]
    answer: Answer,
}

fn wigner_matrices(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    // A matrix is stored column by column.
    for case in snapshots.cases::<PeerSmallD>(ROTATIONS, "small-d")? {
        let matrix = wigner::d_matrix(case.degree, case.beta)?.transpose();
        case.answer.compare(tally, matrix.as_slice());
    }
    for case in snapshots.cases::<PeerLargeD>(ROTATIONS, "real-d")? {
        let turn = DQuat::from_array(case.quaternion);
        let matrix = wigner::real_rotation_matrix(case.degree, turn)?.transpose();
        case.answer.compare(tally, matrix.as_slice());
    }
    for case in snapshots.cases::<PeerLargeD>(ROTATIONS, "large-d")? {
        let turn = DQuat::from_array(case.quaternion);
        // Theirs is the conjugate.
        let matrix = wigner::rotation_matrix(case.degree, turn)?
            .transpose()
            .conjugate();
        case.answer.compare(tally, &flat(matrix.as_slice()));
    }
    Ok(())
}

#[derive(Deserialize)]
struct Windows {
    degree: usize,
    window: Vec<f64>,
    source: String,
    values: Vec<Vec<f64>>,
}

fn coupling(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Windows>(PEERS, "coupling")? {
        let window = case.window.iter().enumerate();
        let window: Vec<f64> = window.map(|(l, sum)| sum / (2 * l + 1) as f64).collect();
        let matrix = Coupling::from_power(&window, case.degree)?.matrix().clone();
        // Theirs takes sums over a degree's orders to such sums, ours means to means.
        let degree = case.degree;
        let values = (0..=degree).flat_map(|row| (0..=degree).map(move |column| (row, column)));
        let got: Vec<f64> = values
            .map(|(row, column)| {
                let means = (2 * row + 1) as f64 / (2 * column + 1) as f64;
                4.0 * PI * matrix[(row, column)] * means
            })
            .collect();
        let answer = Answer {
            source: case.source,
            shown: None,
            values: PeerValues::Real(case.values.concat()),
        };
        answer.compare(tally, &got);
    }
    Ok(())
}

/// Whether a number comes back from a product by a factor: where the product is rounded less than
/// half of what the number's own neighbours are apart.
fn comes_back(value: f64, factor: f64) -> bool {
    ulp(value * factor) < factor.abs() * ulp(value)
}

fn conversion(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    const DEGREE: usize = 24;
    let set = complex_set(7000, DEGREE, DEGREE)?;
    let theirs = uniform(7001, 2 * (DEGREE + 1) * (DEGREE + 2) / 2);
    for name in ["ortho", "4pi", "schmidt"] {
        for condon_shortley in [false, true] {
            let named = Named {
                normalisation: name.into(),
                condon_shortley,
            };
            let convention = named.convention()?;
            let exact = name == "ortho";
            for order in [Order::ByOrder, Order::ByDegree] {
                let real = set.to_real(convention, order);
                let back = Coefficients::from_real(DEGREE, convention, order, &real)?;
                for (at, (got, want)) in back.as_slice().iter().zip(set.as_slice()).enumerate() {
                    let degree = degree_of(DEGREE, at);
                    if exact || comes_back(*want, factor(name, degree)) {
                        tally.same(got, want, || format!("{name}, {order:?}, value {at}"));
                    }
                }
            }
            let mut values: Vec<Complex64> = theirs
                .as_chunks::<2>()
                .0
                .iter()
                .map(|&[re, im]| Complex64::new(re, im))
                .collect();
            for value in &mut values[..=DEGREE] {
                value.im = 0.0;
            }
            let there = Coefficients::from_complex(DEGREE, convention, &values)?;
            let back = there.to_complex(convention);
            let mut at = 0;
            for m in 0..=DEGREE {
                for l in m..=DEGREE {
                    let one = factor(name, l) / if m == 0 { 1.0 } else { SQRT_2 };
                    for (got, want) in [(back[at].re, values[at].re), (back[at].im, values[at].im)]
                    {
                        // Here the way there divides.
                        if (exact && m == 0) || comes_back(want, 1.0 / one) {
                            tally.same(&got, &want, || format!("{name}, l = {l}, m = {m}"));
                        }
                    }
                    at += 1;
                }
            }
        }
    }
    Ok(())
}

/// What an orthonormal coefficient is multiplied by.
fn factor(normalisation: &str, l: usize) -> f64 {
    match normalisation {
        "4pi" => 1.0 / (4.0 * PI).sqrt(),
        "schmidt" => ((2 * l + 1) as f64 / (4.0 * PI)).sqrt(),
        _ => 1.0,
    }
}

/// The degree of a place in our order of storage.
fn degree_of(degree: usize, at: usize) -> usize {
    let mut start = 0;
    for m in 0..=degree {
        for _ in 0..if m == 0 { 1 } else { 2 } {
            if at < start + degree + 1 - m {
                return m + at - start;
            }
            start += degree + 1 - m;
        }
    }
    degree
}
