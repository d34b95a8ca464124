//! Transforms, values and rotations in single precision.

use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{
    Basis, Coefficients, MAX_DEGREE, Rotation, SingleTransform, Transform, coefficient_count,
};
use lobes::sphere::Grid;
use lobes::{Error, Parallelism};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const ONE: Parallelism = Parallelism::Sequential;

fn noise(count: usize, seed: u64) -> Vec<f32> {
    let mut generator = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|_| generator.random::<f32>() - 0.5)
        .collect()
}

fn product(a: &[f32], b: &[f32]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(&a, &b)| f64::from(a) * f64::from(b))
        .sum()
}

/// ⟨A x, y⟩ = ⟨x, A† y⟩ to the rounding of single precision, on grids of even and odd numbers of rings.
#[test]
fn adjoints() {
    for (grid, degree) in [
        (Grid::gauss_legendre(40, 81).unwrap(), 39),
        (Grid::fejer(51, 55).unwrap(), 25),
        (Grid::gauss_legendre(301, 602).unwrap(), 300),
    ] {
        let transform = SingleTransform::new(&grid, degree).unwrap();
        let count = transform.coefficient_count();
        let (set, map) = (noise(count, 1), noise(grid.len(), 2));
        let mut scratch = vec![0.0; transform.scratch_len()];
        let (mut to_map, mut to_set) = (vec![0.0; grid.len()], vec![0.0; count]);
        type Into =
            fn(&SingleTransform, &[f32], &mut [f32], &mut [f32], Parallelism) -> lobes::Result<()>;
        let pairs: [(Into, Into); 2] = [
            (
                SingleTransform::synthesise_into,
                SingleTransform::synthesise_adjoint_into,
            ),
            (
                SingleTransform::analyse_adjoint_into,
                SingleTransform::analyse_into,
            ),
        ];
        for (up, down) in pairs {
            up(&transform, &set, &mut to_map, &mut scratch, ONE).unwrap();
            down(&transform, &map, &mut to_set, &mut scratch, ONE).unwrap();
            let lengths = product(&to_map, &to_map).sqrt() * product(&map, &map).sqrt();
            let difference = product(&to_map, &map) - product(&set, &to_set);
            assert!(
                difference.abs() < 3e-8 * lengths,
                "{difference:e} of {lengths:e}"
            );
        }
    }
}

/// Coefficients of any size that single precision holds without overflow give the same map but for
/// that size; where the map overflows that is said.
#[test]
fn sizes() {
    let transform = SingleTransform::new(&Grid::gauss_legendre(16, 32).unwrap(), 15).unwrap();
    let set = noise(256, 3);
    let map = transform.synthesise(&set).unwrap();
    // Powers of two round nothing.
    for power in [2f32.powi(-60), 2f32.powi(90)] {
        let scaled: Vec<f32> = set.iter().map(|value| power * value).collect();
        let times: Vec<f32> = map.iter().map(|value| power * value).collect();
        assert_eq!(transform.synthesise(&scaled).unwrap(), times);
    }
    let large: Vec<f32> = set.iter().map(|value| 1e38 * value.signum()).collect();
    assert!(matches!(
        transform.synthesise(&large),
        Err(Error::Overflow { .. })
    ));
}

#[test]
fn what_does_not_fit_is_refused() {
    let grid = Grid::gauss_legendre(8, 16).unwrap();
    let transform = SingleTransform::new(&grid, 7).unwrap();
    assert!(matches!(
        SingleTransform::new(&grid, 8),
        Err(Error::Degree { .. })
    ));
    assert!(matches!(
        SingleTransform::new(
            &Grid::gauss_legendre(MAX_DEGREE + 2, 1).unwrap(),
            MAX_DEGREE + 1
        ),
        Err(Error::Degree { .. })
    ));
    let healpix = SingleTransform::new(&Grid::healpix(4).unwrap(), 8).unwrap_err();
    assert_eq!(
        healpix.to_string(),
        "a grid whose rings have lengths of their own has no transform in single precision: take `Transform`"
    );
    assert!(matches!(
        transform.synthesise(&[0.0; 63]),
        Err(Error::Length { expected: 64, .. })
    ));
    assert!(matches!(
        transform.analyse(&[0.0; 127]),
        Err(Error::Length { expected: 128, .. })
    ));
    let mut short = vec![0.0; transform.scratch_len() - 1];
    let into = transform.synthesise_into(&[0.0; 64], &mut [0.0; 128], &mut short, ONE);
    assert!(matches!(into, Err(Error::Length { .. })));
    let mut set = vec![0.0; 64];
    set[5] = f32::NAN;
    assert!(matches!(
        transform.synthesise(&set),
        Err(Error::NotFinite { index: 5, .. })
    ));
    let mut map = vec![0.0; 128];
    map[77] = f32::INFINITY;
    assert!(matches!(
        transform.analyse(&map),
        Err(Error::NotFinite { index: 77, .. })
    ));
    // Seven Fejér rings carry degree 6, and their weights integrate products of degree 3.
    let beyond = SingleTransform::new(&Grid::fejer(7, 16).unwrap(), 4).unwrap();
    assert!(beyond.synthesise(&[1.0; 25]).is_ok());
    assert!(matches!(
        beyond.analyse(&[1.0; 112]),
        Err(Error::Degree { limit: 3, .. })
    ));
}

/// Rounded once, from what double precision gives.
#[test]
fn values_and_rotations() {
    let directions: Vec<DVec3> = (0..300)
        .map(|i| {
            DVec3::new(
                f64::from(i % 17) - 8.0,
                f64::from(i % 11) - 5.3,
                f64::from(i % 7) - 3.1,
            )
        })
        .collect();
    for degree in [0, 8, 60] {
        let basis = Basis::new(degree).unwrap();
        let mut double = vec![0.0; directions.len() * basis.count()];
        let mut single = vec![0.0; double.len()];
        basis.values(&directions, &mut double, ONE).unwrap();
        basis
            .values_single(&directions, &mut single, Parallelism::Rayon)
            .unwrap();
        assert!(double.iter().zip(&single).all(|(&a, &b)| a as f32 == b));
        assert!(
            basis
                .values_single(&directions[1..], &mut single, ONE)
                .is_err()
        );
    }
    let (degree, turn) = (
        20,
        DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(2.0),
    );
    let set = noise(coefficient_count(degree, degree), 4);
    let doubled = set.iter().map(|&value| f64::from(value)).collect();
    let doubled = Coefficients::from_vec(degree, degree, doubled).unwrap();
    let plan = Rotation::new(degree).unwrap();
    let want = plan.rotate(&doubled, turn, ONE).unwrap();
    let got = plan.rotate_single(&set, turn, ONE).unwrap();
    assert!(
        want.as_slice()
            .iter()
            .zip(&got)
            .all(|(&a, &b)| a as f32 == b)
    );
    assert!(plan.rotate_single(&set[1..], turn, ONE).is_err());
}

/// A plan keeps less than one in double precision, and the same rings, columns and orders.
#[test]
fn plans() {
    let grid = Grid::gauss_legendre(128, 256).unwrap();
    let single = SingleTransform::with_orders(&grid, 127, 40).unwrap();
    let double = Transform::with_orders(&grid, 127, 40).unwrap();
    assert_eq!(single.coefficient_count(), double.coefficient_count());
    assert_eq!((single.degree(), single.orders()), (127, 40));
    assert_eq!(single.grid(), double.grid());
    assert!(single.table_bytes() < double.table_bytes());
    assert!(format!("{single:?}").starts_with("SingleTransform {"));
}
