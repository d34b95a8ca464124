//! HEALPix and other grids whose rings are not alike, and least squares.

use std::f64::consts::PI;

use lobes::glam::DVec3;
use lobes::harmonics::{Basis, Coefficients, Mask, Transform, evaluate, random_field};
use lobes::nalgebra::{DMatrix, DVector};
use lobes::sphere::{Grid, Latitudes};
use lobes::{Error, Parallelism};

const ONE: Parallelism = Parallelism::Sequential;

/// The formulas as Górski et al. 2005 print them (equations 4 to 9, i and j from 1), but for the
/// columns of rings that are not shifted, which begin at 0 and not after a step.
#[test]
fn pixels_are_where_the_paper_has_them() {
    for nside in [1, 2, 5, 16] {
        let (grid, n) = (Grid::healpix(nside).unwrap(), nside as f64);
        assert_eq!(grid.latitudes(), Latitudes::Healpix);
        assert_eq!(
            (grid.len(), grid.rings()),
            (12 * nside * nside, 4 * nside - 1)
        );
        let mut pixels = 0;
        for ring in 0..grid.rings() {
            let i = ring + 1;
            let (z, columns, shift) = if i < nside {
                (1.0 - (i * i) as f64 / (3.0 * n * n), 4 * i, 0.5)
            } else if i <= 3 * nside {
                let s = ((i + nside + 1) % 2) as f64;
                (4.0 / 3.0 - 2.0 * i as f64 / (3.0 * n), 4 * nside, 0.5 * s)
            } else {
                let i = 4 * nside - i;
                ((i * i) as f64 / (3.0 * n * n) - 1.0, 4 * i, 0.5)
            };
            assert_eq!(grid.ring_points(ring), pixels..pixels + columns);
            pixels += columns;
            assert!((grid.cosines()[ring] - z).abs() < 1e-15);
            assert!((grid.cosines()[ring].hypot(grid.sines()[ring]) - 1.0).abs() < 1e-15);
            assert!((grid.ring_weight(ring) - PI / (3.0 * n * n)).abs() < 1e-15);
            for j in [0, 1, columns - 1] {
                let phi = 2.0 * PI * (j as f64 + shift) / columns as f64;
                assert!((grid.azimuth_at(ring, j) - phi).abs() < 1e-14);
                let sine = (1.0 - z * z).sqrt();
                let expected = DVec3::new(sine * phi.cos(), sine * phi.sin(), z);
                assert!((grid.direction(ring, j) - expected).length() < 1e-14);
            }
        }
        assert_eq!(pixels, grid.len());
    }
    for wrong in [0, 4097, usize::MAX] {
        assert!(matches!(Grid::healpix(wrong), Err(Error::Domain { .. })));
    }
}

/// Rings with lengths and azimuths of their own, a length with a large factor, both senses.
fn grids() -> Vec<(Grid, usize, usize)> {
    let azimuths: Vec<f64> = (0..21).map(|i| f64::from(i * i) * 0.37 - 3.0).collect();
    let own = |grid: Grid| grid.with_ring_azimuths(&azimuths).unwrap();
    vec![
        (Grid::healpix(1).unwrap(), 2, 2),
        (Grid::healpix(9).unwrap(), 34, 34),
        (
            Grid::healpix(9)
                .unwrap()
                .with_first_azimuth(1.1)
                .descending(),
            26,
            11,
        ),
        (Grid::healpix(53).unwrap(), 60, 60),
        (own(Grid::fejer(21, 48).unwrap()), 20, 20),
        (
            own(Grid::gauss_legendre(21, 53).unwrap()).descending(),
            20,
            20,
        ),
        (own(Grid::clenshaw_curtis(21, 24).unwrap()), 19, 9),
    ]
}

#[test]
fn synthesis_is_the_sum_at_each_point() {
    for (grid, degree, orders) in grids() {
        let transform = Transform::with_orders(&grid, degree, orders).unwrap();
        let mut f = Coefficients::zeros_with_orders(degree, orders);
        let whole = random_field(&vec![1.0; degree + 1], 4).unwrap();
        for l in 0..=degree {
            for m in -(l.min(orders) as isize)..=l.min(orders) as isize {
                f.set(l, m, whole.get(l, m)).unwrap();
            }
        }
        let map = transform.synthesise(&f).unwrap();
        for ring in (0..grid.rings())
            .step_by(1 + grid.rings() / 12)
            .chain([grid.rings() - 1])
        {
            for column in [0, 1, grid.ring_columns(ring) - 1] {
                let expected = evaluate(&f, grid.direction(ring, column)).unwrap();
                let found = map[grid.ring_points(ring).start + column];
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{:?} {} {degree}: {ring} {column}",
                    grid.latitudes(),
                    grid.rings()
                );
            }
        }
        // What equal rings find exactly, rings with azimuths of their own do too.
        if grid.latitudes() != Latitudes::Healpix {
            let found = transform.analyse(&map).unwrap();
            for (a, b) in found.as_slice().iter().zip(f.as_slice()) {
                assert!((a - b).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn batches_and_threads_change_nothing() {
    for (grid, degree, orders) in grids() {
        let transform = Transform::with_orders(&grid, degree, orders).unwrap();
        let (count, size) = (transform.coefficient_count(), grid.len());
        let field = |seed| random_field(&vec![1.0; degree + 1], seed).unwrap();
        for batch in [1, 2, 7, 35] {
            let sets: Vec<f64> = (0..batch)
                .flat_map(|i| field(i as u64).into_vec().into_iter().take(count))
                .collect();
            let mut maps = vec![0.0; batch * size];
            let mut again = vec![0.0; batch * count];
            let mut scratch = vec![0.0; transform.scratch_len(batch)];
            let rayon = Parallelism::Rayon;
            transform
                .synthesise_into(batch, &sets, &mut maps, &mut scratch, rayon)
                .unwrap();
            transform
                .synthesise_adjoint_into(batch, &maps, &mut again, &mut scratch, rayon)
                .unwrap();
            for i in [0, batch - 1] {
                let set = sets[i * count..][..count].to_vec();
                let set = Coefficients::from_vec(degree, orders, set).unwrap();
                let map = transform.synthesise(&set).unwrap();
                assert_eq!(map, maps[i * size..][..size]);
                let adjoint = transform.synthesise_adjoint(&map).unwrap();
                assert_eq!(adjoint.as_slice(), &again[i * count..][..count]);
                // Both sides of the adjoint.
                let at_map: f64 = map.iter().map(|x| x * x).sum();
                let products = set.as_slice().iter().zip(adjoint.as_slice());
                let at_set: f64 = products.map(|(a, b)| a * b).sum();
                assert!((at_map - at_set).abs() < 1e-13 * at_map);
            }
        }
    }
}

/// The condition numbers are those of the singular values, and what is found leaves a residual that
/// no harmonic sees.
#[test]
fn least_squares_is_that_of_the_matrix() {
    for (nside, degree, tolerance) in [(1, 2, 1e-13), (4, 8, 1e-13), (4, 11, 1e-13)] {
        let grid = Grid::healpix(nside).unwrap();
        let transform = Transform::new(&grid, degree).unwrap();
        let directions: Vec<DVec3> = (0..grid.rings())
            .flat_map(|ring| (0..grid.ring_columns(ring)).map(move |column| (ring, column)))
            .map(|(ring, column)| grid.direction(ring, column))
            .collect();
        let count = (degree + 1) * (degree + 1);
        let mut basis = vec![0.0; directions.len() * count];
        let plan = Basis::new(degree).unwrap();
        plan.values(&directions, &mut basis, ONE).unwrap();
        let matrix = DMatrix::from_row_slice(directions.len(), count, &basis);
        let data: Vec<f64> = (0..grid.len()).map(|i| (i as f64 * 1.7).sin()).collect();
        let svd = matrix.clone().svd(true, true);
        let expected = svd
            .solve(&DVector::from_column_slice(&data), 1e-12)
            .unwrap();
        let condition = svd.singular_values.max() / svd.singular_values.min();
        let left = &matrix * &expected - DVector::from_column_slice(&data);
        let residual = (left.norm_squared() / grid.len() as f64).sqrt();
        let fits = [
            transform
                .analyse_least_squares(&data, tolerance, ONE)
                .unwrap(),
            plan.analyse_least_squares(&data, &directions, tolerance, Parallelism::Rayon)
                .unwrap(),
        ];
        for fit in fits {
            for (a, b) in fit.coefficients.as_slice().iter().zip(expected.iter()) {
                assert!((a - b).abs() < 1e-11, "{nside} {degree}");
            }
            assert!((fit.residual - residual).abs() < 1e-12);
            let ratio = fit.condition / condition;
            assert!(
                ratio > 0.98 && ratio < 1.0 + 1e-10,
                "{nside} {degree}: {ratio}"
            );
            assert!(fit.steps < 60);
        }
    }
}

/// Iterations come nearer by the same factor each time.
#[test]
fn iterations_come_nearer() {
    let transform = Transform::new(&Grid::healpix(8).unwrap(), 16).unwrap();
    let f = random_field(&[1.0; 17], 6).unwrap();
    let map = transform.synthesise(&f).unwrap();
    let error = |iterations| -> f64 {
        let found = transform.analyse_iterated(&map, iterations, ONE).unwrap();
        let pairs = found.as_slice().iter().zip(f.as_slice());
        pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let errors = [0, 1, 2, 3].map(error);
    for pair in errors.windows(2) {
        assert!(pair[1] < 0.15 * pair[0], "{errors:?}");
    }
    assert_eq!(
        transform.analyse_iterated(&map, 0, ONE).unwrap(),
        transform.analyse(&map).unwrap()
    );
}

#[test]
fn gradients_and_masks_know_the_rings() {
    let grid = Grid::healpix(6).unwrap();
    let transform = Transform::new(&grid, 12).unwrap();
    let f = random_field(&[1.0; 13], 7).unwrap();
    let [south, east] = transform.gradient(&f, ONE).unwrap();
    let mut map = vec![1.0; grid.len()];
    let mask = Mask::Cap { radius: 1.0 };
    mask.apply(&grid, &mut map).unwrap();
    let basis = Basis::new(12).unwrap();
    for ring in 0..grid.rings() {
        for column in 0..grid.ring_columns(ring) {
            let at = grid.ring_points(ring).start + column;
            let (theta, phi) = (grid.colatitude(ring), grid.azimuth_at(ring, column));
            let mut expected = [(0.0, DVec3::ZERO)];
            let direction = grid.direction(ring, column);
            basis
                .gradients(&f, &[direction], &mut expected, ONE)
                .unwrap();
            let (s, c) = theta.sin_cos();
            let to_south = DVec3::new(c * phi.cos(), c * phi.sin(), -s);
            let to_east = DVec3::new(-phi.sin(), phi.cos(), 0.0);
            assert!((south[at] - to_south.dot(expected[0].1)).abs() < 1e-12);
            assert!((east[at] - to_east.dot(expected[0].1)).abs() < 1e-12);
            assert_eq!(map[at], f64::from(theta < 1.0));
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let grid = Grid::healpix(2).unwrap();
    assert_eq!((grid.max_degree(), grid.max_degree_of_rings()), (4, 6));
    assert!(matches!(
        Transform::new(&grid, 7),
        Err(Error::Degree { .. })
    ));
    let transform = Transform::new(&grid, 4).unwrap();
    let short = transform.analyse_least_squares(&[0.0; 47], 0.1, ONE);
    assert!(matches!(short, Err(Error::Length { expected: 48, .. })));
    for tolerance in [0.0, 2.0, f64::NAN] {
        let given = transform.analyse_least_squares(&[0.0; 48], tolerance, ONE);
        assert!(matches!(given, Err(Error::Domain { .. })));
    }
    let nan = transform.analyse_least_squares(&[f64::NAN; 48], 0.1, ONE);
    assert!(matches!(nan, Err(Error::NotFinite { .. })));
    let nothing = transform
        .analyse_least_squares(&[0.0; 48], 0.1, ONE)
        .unwrap();
    assert_eq!(
        (nothing.steps, nothing.condition, nothing.residual),
        (0, 1.0, 0.0)
    );
    assert!(transform.analyse_iterated(&[0.0; 47], 3, ONE).is_err());
    let grid = Grid::gauss_legendre(3, 8).unwrap();
    let short = grid.clone().with_ring_azimuths(&[0.0; 2]);
    assert!(matches!(short, Err(Error::Length { .. })));
    let wrong = grid.with_ring_azimuths(&[0.0, f64::NAN, 0.0]);
    assert!(matches!(wrong, Err(Error::NotFinite { .. })));
    let basis = Basis::new(1).unwrap();
    // Two directions for four unknowns: the nearest that is shortest, without a residual.
    let fit = basis
        .analyse_least_squares(&[1.0, -1.0], &[DVec3::Z, DVec3::NEG_Z], 1e-10, ONE)
        .unwrap();
    assert!(fit.residual < 1e-14 && fit.coefficients.get(1, 1).abs() < 1e-14);
    let none = basis.analyse_least_squares(&[], &[], 1e-10, ONE).unwrap();
    assert_eq!(none.coefficients, Coefficients::zeros(1));
}
