//! Adjoints of synthesis and analysis: ⟨A x, y⟩ = ⟨x, A† y⟩, and matrices column by column.

use lobes::glam::DVec3;
use lobes::harmonics::{Basis, Coefficients, Transform, evaluate_all};
use lobes::sphere::Grid;
use lobes::{Error, Parallelism};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|_| generator.random_range(-1.0..1.0))
        .collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Grids whose quadrature is by weights and along meridians, with an equator and without, with
/// poles and without, each with a degree and orders.
fn grids() -> Vec<(Grid, usize, usize)> {
    let turned = |grid: Grid| grid.with_first_azimuth(0.7).descending();
    vec![
        (Grid::gauss_legendre(24, 50).unwrap(), 23, 23),
        (turned(Grid::gauss_legendre(33, 40).unwrap()), 32, 15),
        (Grid::fejer(20, 41).unwrap(), 9, 9),
        (Grid::fejer(20, 48).unwrap(), 19, 19),
        (turned(Grid::fejer(21, 48).unwrap()), 20, 17),
        (Grid::clenshaw_curtis(21, 48).unwrap(), 10, 10),
        (Grid::clenshaw_curtis(21, 48).unwrap(), 19, 19),
        (Grid::clenshaw_curtis(22, 64).unwrap(), 20, 20),
        (Grid::lat_long(64, 128).unwrap(), 63, 63),
        (Grid::gauss_legendre(1, 1).unwrap(), 0, 0),
    ]
}

#[test]
fn products_on_both_sides_are_the_same() {
    for (grid, degree, orders) in grids() {
        let transform = Transform::with_orders(&grid, degree, orders).unwrap();
        let (count, size) = (transform.coefficient_count(), grid.len());
        // Alone, in threes and what is left, in eights and what is left.
        for batch in [1, 2, 7, 35] {
            let sets = random(batch * count, 3);
            let maps = random(batch * size, 4);
            let mut scratch = vec![0.0; transform.scratch_len(batch)];
            let (mut other_maps, mut other_sets) = (vec![0.0; maps.len()], vec![0.0; sets.len()]);
            let rayon = Parallelism::Rayon;
            for adjoint_of_analysis in [false, true] {
                let (to_maps, to_sets) = if adjoint_of_analysis {
                    let to_maps = transform.analyse_adjoint_into(
                        batch,
                        &sets,
                        &mut other_maps,
                        &mut scratch,
                        rayon,
                    );
                    let to_sets =
                        transform.analyse_into(batch, &maps, &mut other_sets, &mut scratch, rayon);
                    (to_maps, to_sets)
                } else {
                    let to_maps = transform.synthesise_into(
                        batch,
                        &sets,
                        &mut other_maps,
                        &mut scratch,
                        rayon,
                    );
                    let to_sets = transform.synthesise_adjoint_into(
                        batch,
                        &maps,
                        &mut other_sets,
                        &mut scratch,
                        rayon,
                    );
                    (to_maps, to_sets)
                };
                to_maps.unwrap();
                to_sets.unwrap();
                for one in 0..batch {
                    let (set, other_set) =
                        (&sets[one * count..][..count], &other_sets[one * count..]);
                    let (map, other_map) = (&maps[one * size..][..size], &other_maps[one * size..]);
                    let at_maps = dot(&other_map[..size], map);
                    let at_sets = dot(set, &other_set[..count]);
                    let scale = length(&other_map[..size]) * length(map);
                    assert!(
                        (at_maps - at_sets).abs() <= 1e-13 * scale,
                        "{:?} {degree} {orders}, batch {batch}, {adjoint_of_analysis}: {at_maps} {at_sets}",
                        grid.latitudes()
                    );
                }
            }
        }
    }
}

/// Every column: the adjoint of synthesis of a single pixel is the basis there.
#[test]
fn a_single_pixel_gives_the_basis_there() {
    let grid = Grid::fejer(6, 13).unwrap().with_first_azimuth(0.3);
    let transform = Transform::new(&grid, 5).unwrap();
    let mut basis = vec![0.0; 36];
    for (ring, column) in [(0, 0), (2, 7), (5, 12)] {
        let mut map = vec![0.0; grid.len()];
        map[ring * 13 + column] = 1.0;
        evaluate_all(grid.direction(ring, column), 5, &mut basis).unwrap();
        let found = transform.synthesise_adjoint(&map).unwrap();
        for (found, expected) in found.as_slice().iter().zip(&basis) {
            assert!((found - expected).abs() < 1e-14);
        }
    }
}

#[test]
fn at_points_too_whatever_the_threads() {
    for (degree, count) in [(0, 1), (5, 100), (48, 333), (60, 77), (200, 40)] {
        let basis = Basis::new(degree).unwrap();
        let numbers = random(4 * count, 5);
        let directions: Vec<DVec3> = (0..count)
            .map(|i| DVec3::new(numbers[4 * i], numbers[4 * i + 1], numbers[4 * i + 2]))
            .chain([DVec3::Z, DVec3::NEG_Z, DVec3::new(1e-9, 0.0, 1.0)])
            .collect();
        let values = random(directions.len(), 6);
        let set = random((degree + 1) * (degree + 1), 7);
        let mut sums = vec![0.0; directions.len()];
        let coefficients = Coefficients::from_vec(degree, degree, set).unwrap();
        basis
            .sums(&coefficients, &directions, &mut sums, Parallelism::Rayon)
            .unwrap();
        let adjoint = basis
            .sums_adjoint(&values, &directions, Parallelism::Rayon)
            .unwrap();
        let (here, there) = (
            dot(&sums, &values),
            dot(coefficients.as_slice(), adjoint.as_slice()),
        );
        assert!(
            (here - there).abs() <= 1e-13 * length(&sums) * length(&values),
            "{degree}: {here} {there}"
        );
        let alone = basis
            .sums_adjoint(&values, &directions, Parallelism::Sequential)
            .unwrap();
        assert_eq!(alone.as_slice(), adjoint.as_slice());
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let transform = Transform::new(&Grid::lat_long(8, 16).unwrap(), 3).unwrap();
    assert!(matches!(
        transform.synthesise_adjoint(&[0.0; 7]),
        Err(Error::Length {
            expected: 128,
            got: 7,
            ..
        })
    ));
    assert!(matches!(
        transform.analyse_adjoint(&Coefficients::zeros(2)),
        Err(Error::Length { .. })
    ));
    let mut map = vec![0.0; 128];
    map[5] = f64::NAN;
    assert!(matches!(
        transform.synthesise_adjoint(&map),
        Err(Error::NotFinite { index: 5, .. })
    ));
    let basis = Basis::new(2).unwrap();
    let one = Parallelism::Sequential;
    assert!(matches!(
        basis.sums_adjoint(&[1.0], &[], one),
        Err(Error::Length { .. })
    ));
    assert!(matches!(
        basis.sums_adjoint(&[1.0], &[DVec3::ZERO], one),
        Err(Error::Domain { .. })
    ));
    assert!(matches!(
        basis.sums_adjoint(&[f64::INFINITY], &[DVec3::X], one),
        Err(Error::NotFinite { .. })
    ));
    let nothing = basis.sums_adjoint(&[], &[], one).unwrap();
    assert_eq!(nothing.as_slice(), [0.0; 9]);
}
