//! Sums at many directions by Fourier transforms: closed forms, one by one, fits, and what a caller
//! may give.

use lobes::glam::DVec3;
use lobes::harmonics::{Basis, Coefficients, MAX_DEGREE, ScatteredTransform};
use lobes::{Error, Parallelism};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::PI;

const ONE: Parallelism = Parallelism::Sequential;

fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|_| generator.random_range(-1.0..1.0))
        .collect()
}

fn directions(count: usize, seed: u64) -> Vec<DVec3> {
    let numbers = noise(3 * count, seed);
    numbers.chunks(3).map(DVec3::from_slice).collect()
}

#[test]
fn low_degrees_are_their_closed_forms() {
    let mut f = Coefficients::zeros(2);
    f.set(0, 0, 2.0 * PI.sqrt()).unwrap();
    f.set(1, -1, (4.0 * PI / 3.0).sqrt()).unwrap();
    f.set(2, 1, (4.0 * PI / 15.0).sqrt()).unwrap();
    let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let directions: Vec<_> = axes.chain(directions(3000, 1)).collect();
    let plan = ScatteredTransform::new(2, &directions, 1e-12, ONE).unwrap();
    assert_eq!((plan.degree(), plan.directions()), (2, 3006));
    for (value, direction) in plan.synthesise(&f, ONE).unwrap().iter().zip(directions) {
        let DVec3 { x, y, z } = direction.normalize();
        assert!((value - (1.0 + y + x * z)).abs() < 4e-12, "{direction}");
    }
}

#[test]
fn every_count_of_directions_and_every_clump_of_them() {
    let f = Coefficients::from_vec(30, 30, noise(961, 2)).unwrap();
    let basis = Basis::new(30).unwrap();
    // All in one tile, on one circle, on one ring, and anywhere.
    let clumps: [fn(f64, f64) -> DVec3; 4] = [
        |a, b| DVec3::new(1.0, 1e-3 * a, 1e-3 * b),
        |a, b| DVec3::new(a, 0.0, b),
        |a, b| DVec3::new(a, b, 0.0),
        |a, b| DVec3::new(a, b, a * b),
    ];
    for count in [0, 1, 7, 4096, 4097] {
        for clump in clumps {
            let numbers = noise(2 * count, 3);
            let directions: Vec<_> = numbers.chunks(2).map(|p| clump(p[0], p[1])).collect();
            let plan = ScatteredTransform::new(30, &directions, 1e-10, ONE).unwrap();
            let found = plan.synthesise(&f, Parallelism::Rayon).unwrap();
            let mut exact = vec![0.0; count];
            basis.sums(&f, &directions, &mut exact, ONE).unwrap();
            for (a, b) in found.iter().zip(exact) {
                assert!((a - b).abs() < 1e-9);
            }
            let y = noise(count, 4);
            let found = plan.synthesise_adjoint(&y, Parallelism::Rayon).unwrap();
            let exact = basis.sums_adjoint(&y, &directions, ONE).unwrap();
            for (a, b) in found.as_slice().iter().zip(exact.as_slice()) {
                assert!((a - b).abs() <= 1e-9 * (count as f64).sqrt());
            }
        }
    }
}

#[test]
fn orders_left_out_are_zero() {
    let f = Coefficients::from_vec(9, 3, noise(58, 5)).unwrap();
    let directions = directions(40, 6);
    let plan = ScatteredTransform::new(9, &directions, 1e-11, ONE).unwrap();
    let mut whole = Coefficients::zeros(9);
    for m in 0..=3 {
        whole.cosine_mut(m).copy_from_slice(f.cosine(m));
        whole.sine_mut(m).copy_from_slice(f.sine(m));
    }
    let values = plan.synthesise(&f, ONE).unwrap();
    assert_eq!(values, plan.synthesise(&whole, ONE).unwrap());
}

#[test]
fn a_fit_is_that_of_the_sums_one_by_one() {
    // Enough directions for the quick way, and noise that no field of the degree has.
    let (degree, count) = (20, 25_000);
    let directions = directions(count, 7);
    let basis = Basis::new(degree).unwrap();
    let values = noise(count, 8);
    let quick = basis
        .analyse_least_squares(&values, &directions, 1e-12, Parallelism::Rayon)
        .unwrap();
    // The normal equations say that what is left has no component along any harmonic.
    let mut left = vec![0.0; count];
    basis
        .sums(&quick.coefficients, &directions, &mut left, ONE)
        .unwrap();
    for (left, value) in left.iter_mut().zip(&values) {
        *left -= value;
    }
    let gradient = basis.sums_adjoint(&left, &directions, ONE).unwrap();
    let first = basis.sums_adjoint(&values, &directions, ONE).unwrap();
    let length = |f: &Coefficients| f.as_slice().iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!(length(&gradient) < 1e-11 * length(&first));
    let rms = (left.iter().map(|x| x * x).sum::<f64>() / count as f64).sqrt();
    assert!((quick.residual - rms).abs() < 1e-12);
    assert!(
        quick.condition > 1.0 && quick.condition < 3.0,
        "{}",
        quick.condition
    );
}

#[test]
fn what_cannot_be_summed_is_refused() {
    let new = |degree, directions: &[DVec3], tolerance| {
        ScatteredTransform::new(degree, directions, tolerance, ONE).map(|_| ())
    };
    for tolerance in [0.0, 9e-14, 0.2, -1.0, f64::NAN] {
        assert!(matches!(
            new(1, &[DVec3::X], tolerance),
            Err(Error::Domain { .. })
        ));
    }
    for wrong in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        assert!(matches!(
            new(1, &[DVec3::X, wrong], 0.1),
            Err(Error::Domain { .. })
        ));
    }
    assert!(matches!(
        new(MAX_DEGREE + 1, &[], 0.1),
        Err(Error::Degree { .. })
    ));
    let plan = ScatteredTransform::new(1, &[DVec3::X, DVec3::Y], 1e-6, ONE).unwrap();
    let f = |degree| Coefficients::zeros(degree);
    assert!(matches!(
        plan.synthesise(&f(2), ONE),
        Err(Error::Degree { .. })
    ));
    assert!(matches!(
        plan.synthesise_adjoint(&[1.0], ONE),
        Err(Error::Length { .. })
    ));
    let given = |value| {
        let mut f = f(1);
        f.as_mut_slice()[2] = value;
        f
    };
    let nan = plan.synthesise(&given(f64::NAN), ONE);
    assert!(
        matches!(nan, Err(Error::NotFinite { index: 2, .. })),
        "{nan:?}"
    );
    let large = plan.synthesise(&given(f64::MAX), ONE);
    assert!(matches!(large, Err(Error::Overflow { .. })), "{large:?}");
    let nan = plan.synthesise_adjoint(&[1.0, f64::NAN], ONE);
    assert!(matches!(nan, Err(Error::NotFinite { index: 1, .. })));
    let large = plan.synthesise_adjoint(&[f64::MAX, f64::MAX], ONE);
    assert!(matches!(large, Err(Error::Overflow { .. })), "{large:?}");
    let short = plan.synthesise_into(&[0.0; 4], &mut [0.0; 2], &mut [0.0; 9], ONE);
    assert!(matches!(short, Err(Error::Length { got: 9, .. })));
}
