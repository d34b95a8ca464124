//! Complex fields against `SciPy`'s complex harmonics.

use serde::Deserialize;

use super::generator::uniform;
use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::glam::DQuat;
use lobes::harmonics::{ComplexCoefficients, Rotation, Transform, wigner};
use lobes::num_complex::Complex64;
use lobes::sphere::Grid;
use lobes::{Parallelism, Result};

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "complex/synthesis",
            function: "harmonics::Transform::synthesise_complex",
            oracle: Oracle::Snapshot("complex"),
            domain: "random a_lm of degree 12, m from −12 to 12, on a Gauss–Legendre grid; real and imaginary parts",
            metric: Metric::Scaled("the map's rms"),
            bound: 2e-14,
            why: "sums of 169 terms; SciPy's harmonics lose most near the poles",
            loose: None,
            measure: synthesis,
        },
        Contract {
            id: "complex/rotation",
            function: "harmonics::Rotation::rotate_complex",
            oracle: Oracle::Identity(
                "a′_l = D^l(R) a_l, Wigner's matrix, which wigner/large-d holds",
            ),
            domain: "random a_lm of degree 40, a general rotation; real and imaginary parts",
            metric: Metric::Absolute,
            bound: 1e-14,
            why: "coefficients of order one, sums of up to 81 of them",
            loose: None,
            measure: rotation,
        },
    ]
}

fn random(degree: usize, seeds: [u64; 2]) -> Result<ComplexCoefficients> {
    let [real, imaginary] = seeds.map(|seed| uniform(seed, (degree + 1) * (degree + 1)));
    let values = real.into_iter().zip(imaginary);
    let values = values.map(|(re, im)| Complex64::new(re, im));
    ComplexCoefficients::from_vec(degree, values.collect())
}

#[derive(Deserialize)]
struct ComplexMap {
    degree: usize,
    rings: usize,
    columns: usize,
    seeds: [u64; 2],
    real: Vec<f64>,
    imaginary: Vec<f64>,
}

fn synthesis(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<ComplexMap>("complex", "synthesis")? {
        let grid = Grid::gauss_legendre(case.rings, case.columns)?;
        let a = random(case.degree, case.seeds)?;
        let map =
            Transform::new(&grid, case.degree)?.synthesise_complex(&a, Parallelism::Sequential)?;
        let energy: f64 = a.as_slice().iter().map(Complex64::norm_sqr).sum();
        let scale = (energy / (4.0 * std::f64::consts::PI)).sqrt();
        let wanted = case.real.iter().zip(&case.imaginary);
        for (i, (got, (real, imaginary))) in map.iter().zip(wanted).enumerate() {
            let place = || format!("ring {}, column {}", i / case.columns, i % case.columns);
            tally.compare_scaled(got.re, *real, scale, place);
            tally.compare_scaled(got.im, *imaginary, scale, place);
        }
    }
    Ok(())
}

fn rotation(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let (degree, turn) = (40, DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8));
    let a = random(degree, [704, 705])?;
    let turned = Rotation::new(degree)?.rotate_complex(&a, turn, Parallelism::Sequential)?;
    for l in 0..=degree {
        let d = wigner::rotation_matrix(l, turn)?;
        for row in 0..=2 * l {
            let sum: Complex64 = (0..=2 * l)
                .map(|column| d[(row, column)] * a.as_slice()[l * l + column])
                .sum();
            let got = turned.as_slice()[l * l + row];
            let place = || format!("l = {l}, m = {}", row as isize - l as isize);
            tally.compare(got.re, sum.re, place);
            tally.compare(got.im, sum.im, place);
        }
    }
    Ok(())
}
