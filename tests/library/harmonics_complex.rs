//! Complex fields against sums of complex harmonics, and their rotation against Wigner's matrices.

use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{
    Coefficients, ComplexCoefficients, Rotation, Transform, average_power, evaluate_all, wigner,
};
use lobes::nalgebra::DVector;
use lobes::num_complex::Complex64;
use lobes::sphere::Grid;
use lobes::{Error, Parallelism};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn random(degree: usize) -> ComplexCoefficients {
    let mut generator = Pcg64::seed_from_u64(8);
    let mut draw = || generator.random_range(-1.0..1.0);
    let count = (degree + 1) * (degree + 1);
    let values = (0..count).map(|_| Complex64::new(draw(), draw()));
    ComplexCoefficients::from_vec(degree, values.collect()).unwrap()
}

/// `Σ a_lm Y_lm` from the real harmonics, `Y_lm = (−1)^m (Y^m + i Y^−m)/√2` and `Y_l,−m = (−1)^m Ȳ_lm`.
fn field(a: &ComplexCoefficients, direction: DVec3) -> Complex64 {
    let degree = a.degree();
    let mut y = vec![0.0; (degree + 1) * (degree + 1)];
    evaluate_all(direction, degree, &mut y).unwrap();
    let real = Coefficients::from_vec(degree, degree, y).unwrap();
    let mut sum = Complex64::ZERO;
    for l in 0..=degree {
        sum += a.get(l, 0) * real.get(l, 0);
        for m in 1..=l as isize {
            let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
            let y = Complex64::new(real.get(l, m), real.get(l, -m)) * (sign / 2f64.sqrt());
            sum += a.get(l, m) * y + a.get(l, -m) * y.conj() * sign;
        }
    }
    sum
}

#[test]
fn maps_are_sums_of_complex_harmonics() {
    let one = Parallelism::Sequential;
    for grid in [
        Grid::gauss_legendre(10, 21).unwrap(),
        Grid::lat_long(10, 20).unwrap(),
    ] {
        let (a, transform) = (random(9), Transform::new(&grid, 9).unwrap());
        let map = transform.synthesise_complex(&a, one).unwrap();
        for (ring, column) in [(0, 0), (3, 7), (9, 19)] {
            let expected = field(&a, grid.direction(ring, column));
            let found = map[ring * grid.columns() + column];
            assert!((found - expected).norm() < 1e-13);
        }
        let again = transform.analyse_complex(&map, Parallelism::Rayon).unwrap();
        for (found, expected) in again.as_slice().iter().zip(a.as_slice()) {
            assert!((found - expected).norm() < 1e-14);
        }
    }
}

#[test]
fn rotation_is_wigners_matrix() {
    let (a, turn) = (random(6), DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8));
    let turned = Rotation::new(6).unwrap();
    let turned = turned
        .rotate_complex(&a, turn, Parallelism::Sequential)
        .unwrap();
    for l in 0..=6 {
        let range = l * l..(l + 1) * (l + 1);
        let before = DVector::from_column_slice(&a.as_slice()[range.clone()]);
        let expected = wigner::rotation_matrix(l, turn).unwrap() * before;
        for (found, expected) in turned.as_slice()[range].iter().zip(expected.iter()) {
            assert!((found - expected).norm() < 1e-14, "l = {l}");
        }
    }
    let direction = DVec3::new(0.48, 0.64, 0.6);
    let there = field(&turned, turn.normalize() * direction);
    assert!((there - field(&a, direction)).norm() < 1e-13);
    for (one, other) in a.average_power().iter().zip(turned.average_power()) {
        assert!((one - other).abs() < 1e-14);
    }
}

#[test]
fn a_real_field_has_no_imaginary_part() {
    let mut real = Coefficients::zeros(4);
    for (i, value) in real.as_mut_slice().iter_mut().enumerate() {
        *value = (i as f64).sin();
    }
    let a = ComplexCoefficients::from_parts(&real, &Coefficients::zeros(4)).unwrap();
    let [re, im] = a.parts();
    assert!(im.as_slice().iter().all(|value| *value == 0.0));
    for (l, (one, other)) in average_power(&real)
        .iter()
        .zip(a.average_power())
        .enumerate()
    {
        assert!((one - other).abs() < 1e-15);
        assert!((re.get(l, 0) - real.get(l, 0)).abs() < 1e-16);
        assert!((re.get(l, -(l as isize)) - real.get(l, -(l as isize))).abs() < 1e-15);
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut a = ComplexCoefficients::zeros(2);
    assert!(matches!(
        a.set(3, 0, Complex64::ONE),
        Err(Error::Degree { .. })
    ));
    assert!(matches!(
        a.set(1, -2, Complex64::ONE),
        Err(Error::Degree { .. })
    ));
    assert_eq!(
        (a.get(3, 0), a.get(1, 2)),
        (Complex64::ZERO, Complex64::ZERO)
    );
    assert!(ComplexCoefficients::from_vec(2, vec![Complex64::ONE; 8]).is_err());
    let one = Parallelism::Sequential;
    let grid = Grid::gauss_legendre(4, 8).unwrap();
    let transform = Transform::new(&grid, 3).unwrap();
    assert!(matches!(
        transform.synthesise_complex(&a, one),
        Err(Error::Length { .. })
    ));
    assert!(
        transform
            .analyse_complex(&[Complex64::ONE; 31], one)
            .is_err()
    );
    let few = Transform::with_orders(&grid, 3, 1).unwrap();
    assert!(matches!(
        few.analyse_complex(&[Complex64::ONE; 32], one),
        Err(Error::Degree { .. })
    ));
    assert!(
        ComplexCoefficients::from_parts(&Coefficients::zeros(2), &Coefficients::zeros(3)).is_err()
    );
}
