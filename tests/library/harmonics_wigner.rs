//! Wigner's d and D against closed forms, the group that they represent, and the rotation of
//! coefficients.

use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{Coefficients, wigner};
use lobes::nalgebra::DMatrix;
use lobes::{Error, harmonics::wigner::MAX_WIGNER_DEGREE};
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

fn close(a: &DMatrix<f64>, b: &DMatrix<f64>, bound: f64, what: &str) {
    let off = (a - b).amax();
    assert!(off <= bound, "{what}: {off:e}");
}

#[test]
fn the_first_degrees_are_their_closed_forms() {
    for beta in [
        0.0, 1e-9, 0.3, FRAC_PI_2, 2.5, PI, 3.5, -1.2, 5.0, 100.0, 1e6,
    ] {
        let (s, c) = f64::sin_cos(beta);
        let one = DMatrix::from_row_slice(
            3,
            3,
            &[
                0.5 * (1.0 + c),
                s / SQRT_2,
                0.5 * (1.0 - c),
                -s / SQRT_2,
                c,
                s / SQRT_2,
                0.5 * (1.0 - c),
                -s / SQRT_2,
                0.5 * (1.0 + c),
            ],
        );
        let found = wigner::d_matrix(1, beta).unwrap();
        close(&found, &one, 4e-16, &format!("β = {beta}"));
        let two = wigner::d_matrix(2, beta).unwrap();
        // d²_00 = P_2, d²_2,−2 = sin⁴ β/2, d²_20 = √6/4 sin² β.
        assert!((two[(2, 2)] - (1.5 * c * c - 0.5)).abs() < 5e-16, "{beta}");
        assert!(
            (two[(4, 0)] - (0.5 * beta).sin().powi(4)).abs() < 5e-16,
            "{beta}"
        );
        assert!(
            (two[(4, 2)] - 6f64.sqrt() / 4.0 * s * s).abs() < 5e-16,
            "{beta}"
        );
        assert_eq!(wigner::d_matrix(0, beta).unwrap()[(0, 0)], 1.0);
    }
}

#[test]
fn no_turn_and_half_a_turn_are_permutations() {
    // β = π as a quaternion: d_m′m = (−1)^(l−m) where m′ = −m.
    let half = wigner::rotation_matrix(40, DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0)).unwrap();
    for i in 0..81 {
        for j in 0..81 {
            let expected = if i + j != 80 {
                0.0
            } else if j % 2 == 0 {
                1.0
            } else {
                -1.0
            };
            assert!((half[(i, j)].re - expected).abs() < 1e-15 && half[(i, j)].im.abs() < 1e-15);
        }
    }
    close(
        &wigner::d_matrix(300, 0.0).unwrap(),
        &DMatrix::identity(601, 601),
        1e-15,
        "no turn",
    );
}

#[test]
fn they_are_orthogonal_and_a_group() {
    for (degree, bound) in [(1, 1e-15), (8, 2e-15), (65, 5e-15), (200, 2e-14)] {
        let (a, b) = (0.7, 1.9);
        let (da, db) = (
            wigner::d_matrix(degree, a).unwrap(),
            wigner::d_matrix(degree, b).unwrap(),
        );
        let side = 2 * degree + 1;
        close(
            &(&da * da.transpose()),
            &DMatrix::identity(side, side),
            bound,
            "orthogonal",
        );
        // 0.7 + 1.9 rounds: the quaternion's composition is held below.
        let sum = wigner::d_matrix(degree, a + b).unwrap();
        close(
            &(&da * &db),
            &sum,
            bound + 4e-16 * degree as f64,
            "one angle after another",
        );
        let back = wigner::d_matrix(degree, -a).unwrap();
        close(&back, &da.transpose(), 1e-15, "back");
        // A full turn more, as far as 2π is a double.
        let again = wigner::d_matrix(degree, a + TAU).unwrap();
        close(
            &again,
            &da,
            1e-15 + 1e-15 * degree as f64,
            "a full turn more",
        );
    }
    let (one, two) = (
        DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8).normalize(),
        DQuat::from_xyzw(-0.1, 0.2, 0.9, 0.1).normalize(),
    );
    for degree in [1, 2, 3, 17] {
        let product = wigner::rotation_matrix(degree, one).unwrap()
            * wigner::rotation_matrix(degree, two).unwrap();
        let both = wigner::rotation_matrix(degree, one * two).unwrap();
        let off = (product - both).map(|z| z.norm()).amax();
        assert!(off < 1e-15 * (degree + 2) as f64, "{degree}: {off:e}");
    }
}

#[test]
fn the_real_matrix_rotates_coefficients() {
    for turn in [
        DQuat::IDENTITY,
        DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8),
        DQuat::from_rotation_z(1.0),
        DQuat::from_rotation_x(FRAC_PI_2),
        DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0),
        DQuat::from_xyzw(1e-9, -3e-9, 0.0, 1.0) * 7.0,
    ] {
        for degree in [0, 1, 2, 3, 9] {
            let matrix = wigner::real_rotation_matrix(degree, turn).unwrap();
            for column in 0..=2 * degree {
                let mut f = Coefficients::zeros(degree);
                f.set(degree, column as isize - degree as isize, 1.0)
                    .unwrap();
                let g = f.rotated(turn).unwrap();
                for row in 0..=2 * degree {
                    let expected = g.get(degree, row as isize - degree as isize);
                    assert!(
                        (matrix[(row, column)] - expected).abs() < 3e-15,
                        "{turn} l = {degree}, {row}, {column}"
                    );
                }
            }
        }
    }
}

/// e3nn's harmonics of degree 2, whose polar axis is y, are ours in the frame (z, x, y), and so are
/// its matrices: Y(R v) = D(R) Y(v).
#[test]
fn matrices_of_e3nn_are_those_of_the_harmonic_frame() {
    let harmonics = |v: DVec3| {
        let root = 3f64.sqrt();
        [
            root * v.x * v.z,
            root * v.x * v.y,
            v.y * v.y - 0.5 * (v.x * v.x + v.z * v.z),
            root * v.y * v.z,
            0.5 * root * (v.z * v.z - v.x * v.x),
        ]
    };
    let turn = DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8).normalize();
    let in_our_frame = DQuat::from_xyzw(turn.z, turn.x, turn.y, turn.w);
    let d = wigner::real_rotation_matrix(2, in_our_frame).unwrap();
    let v = DVec3::new(0.48, -0.64, 0.6);
    let (before, after) = (harmonics(v), harmonics(turn * v));
    for row in 0..5 {
        let found: f64 = (0..5).map(|column| d[(row, column)] * before[column]).sum();
        assert!((found - after[row]).abs() < 1e-15);
    }
}

#[test]
fn all_degrees_at_once_are_each() {
    let all = wigner::d_matrices(19, 1.1).unwrap();
    assert_eq!(all.len(), 20);
    for (degree, d) in all.iter().enumerate() {
        let alone = wigner::d_matrix(degree, 1.1).unwrap();
        close(d, &alone, 1e-15, &format!("l = {degree}"));
    }
}

#[test]
fn what_has_no_matrix_is_refused() {
    let most = MAX_WIGNER_DEGREE;
    assert!(matches!(
        wigner::d_matrix(most + 1, 0.3),
        Err(Error::Degree { limit, .. }) if limit == most
    ));
    assert!(matches!(
        wigner::d_matrices(usize::MAX, 0.3),
        Err(Error::Degree { .. })
    ));
    for beta in [f64::NAN, f64::INFINITY, -2e6] {
        assert!(matches!(
            wigner::d_matrix(2, beta),
            Err(Error::Domain { .. })
        ));
    }
    for turn in [
        DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0),
    ] {
        assert!(matches!(
            wigner::rotation_matrix(2, turn),
            Err(Error::Domain { .. })
        ));
        assert!(wigner::real_rotation_matrix(2, turn).is_err());
    }
}
