//! Transforms, values and spectra against closed forms and against one another.

use approx::assert_abs_diff_eq;
use lobes::Parallelism;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{
    Basis, Coefficients, Convention, MAX_BASIS_DEGREE, Normalisation, Order, Phase, Rotation,
    Transform, average_power, evaluate, evaluate_all, legendre,
};
use lobes::sphere::{Grid, Rule};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn random(degree: usize, orders: usize, seed: u64) -> Coefficients {
    let mut generator = Pcg64::seed_from_u64(seed);
    let mut f = Coefficients::zeros_with_orders(degree, orders);
    for value in f.as_mut_slice() {
        *value = generator.random_range(-1.0..1.0);
    }
    f
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn rules_integrate_polynomials() {
    for n in [1usize, 2, 3, 4, 7, 16, 33, 64] {
        for (rule, exact) in [
            (Rule::gauss_legendre(n), 2 * n - 1),
            (Rule::fejer(n), n - 1),
            (Rule::clenshaw_curtis(n.max(2)), n.max(2) - 1),
        ] {
            let rule = rule.unwrap();
            for k in 0..=exact {
                let sum: f64 = rule
                    .nodes
                    .iter()
                    .zip(&rule.weights)
                    .map(|(x, w)| w * x.powi(k as i32))
                    .sum();
                let truth = if k % 2 == 0 {
                    2.0 / (k + 1) as f64
                } else {
                    0.0
                };
                assert!(
                    (sum - truth).abs() < 4e-15,
                    "n {n} degree {k}: {sum} for {truth}"
                );
            }
            for (x, s) in rule.nodes.iter().zip(&rule.sines) {
                assert_abs_diff_eq!(x * x + s * s, 1.0, epsilon = 4e-16);
            }
        }
    }
}

#[test]
fn round_trip_on_every_grid() {
    for (grid, name) in [
        (Grid::gauss_legendre(32, 64), "Gauss"),
        (Grid::gauss_legendre(33, 67), "Gauss, odd"),
        (Grid::clenshaw_curtis(65, 64), "Clenshaw–Curtis"),
        (Grid::fejer(64, 65), "Fejér"),
        (Grid::lat_long(64, 128), "lat-long"),
        // Past what weights serve, to the last degree that the rings carry.
        (Grid::fejer(33, 66), "Fejér, odd"),
        (Grid::clenshaw_curtis(34, 65), "Clenshaw–Curtis, even"),
        (Grid::clenshaw_curtis(41, 81), "Clenshaw–Curtis, odd"),
    ] {
        let grid = grid.unwrap();
        for orders in [grid.max_degree(), 5] {
            let transform = Transform::with_orders(&grid, grid.max_degree(), orders).unwrap();
            let f = random(transform.degree(), orders, 1);
            let map = transform.synthesise(&f).unwrap();
            let back = transform.analyse(&map).unwrap();
            let error = largest_difference(f.as_slice(), back.as_slice());
            assert!(error < 4e-14, "{name}: {error:e}");
            // A scattered sum agrees with the map, so φ runs as the grid says.
            for (ring, column) in [(0, 0), (3, 7), (grid.rings() - 2, grid.columns() - 1)] {
                let value = evaluate(&f, grid.direction(ring, column)).unwrap();
                let at = map[ring * grid.columns() + column];
                assert!((value - at).abs() < 1e-12, "{name}: {value} for {at}");
                let phi = grid.azimuth(column);
                let d = grid.direction(ring, column);
                assert_abs_diff_eq!(phi.cos() * d.y, phi.sin() * d.x, epsilon = 1e-14);
            }
        }
        assert!(Transform::new(&grid, grid.max_degree() + 1).is_err());
    }
}

/// ∫ `Y_d0²` dω = 1 by the rings' weights up to the degree that they are said to serve, and not one
/// further.
#[test]
fn weights_serve_the_degree_that_they_say() {
    for grid in [
        Grid::gauss_legendre(8, 17),
        Grid::gauss_legendre(9, 19),
        Grid::clenshaw_curtis(8, 17),
        Grid::clenshaw_curtis(9, 19),
        Grid::fejer(8, 17),
        Grid::fejer(9, 19),
    ] {
        let grid = grid.unwrap();
        let integral = |degree: usize| -> f64 {
            let mut column = vec![0.0; degree + 1];
            let rings = 0..grid.rings();
            let ring = |ring: usize| {
                let (cos, sin) = (grid.cosines()[ring], grid.sines()[ring]);
                legendre::column(0, degree, cos, sin, &mut column).unwrap();
                grid.ring_weight(ring) * grid.columns() as f64 * column[degree].powi(2)
            };
            rings.map(ring).sum()
        };
        let degree = grid.max_degree_of_weights();
        assert_abs_diff_eq!(integral(degree), 1.0, epsilon = 1e-14);
        assert!((integral(degree + 1) - 1.0).abs() > 1e-3, "{grid:?}");
    }
}

#[test]
fn values_are_the_closed_forms() {
    let d = DVec3::new(0.48, 0.64, 0.6);
    let mut y = [0.0; 9];
    evaluate_all(d, 2, &mut y).unwrap();
    let pi = std::f64::consts::PI;
    let c1 = (0.75 / pi).sqrt();
    let c2 = (15.0 / pi).sqrt() / 2.0;
    let truth = [
        (0.25 / pi).sqrt(),
        c1 * d.z,
        (5.0 / pi).sqrt() / 4.0 * (3.0 * d.z * d.z - 1.0),
        c1 * d.x,
        c2 * d.x * d.z,
        c1 * d.y,
        c2 * d.y * d.z,
        c2 / 2.0 * (d.x * d.x - d.y * d.y),
        c2 * d.x * d.y,
    ];
    assert!(largest_difference(&y, &truth) < 2e-16);
}

#[test]
fn parseval_and_power() {
    let grid = Grid::gauss_legendre(40, 80).unwrap();
    let transform = Transform::new(&grid, 39).unwrap();
    let f = random(39, 39, 2);
    let map = transform.synthesise(&f).unwrap();
    let integral: f64 = map
        .chunks(80)
        .enumerate()
        .map(|(ring, row)| grid.ring_weight(ring) * row.iter().map(|v| v * v).sum::<f64>())
        .sum();
    let power: f64 = average_power(&f)
        .iter()
        .enumerate()
        .map(|(l, p)| p * (2 * l + 1) as f64)
        .sum();
    assert_abs_diff_eq!(integral / f.energy(), 1.0, epsilon = 1e-13);
    assert_abs_diff_eq!(power / f.energy(), 1.0, epsilon = 1e-14);
}

#[test]
fn rotation_moves_the_function() {
    for (degree, turn) in [
        (0, DQuat::IDENTITY),
        (1, DQuat::from_rotation_y(0.3)),
        (7, DQuat::from_rotation_z(1.0)),
        (8, DQuat::from_rotation_x(std::f64::consts::PI)),
        (9, DQuat::from_xyzw(0.1, -2.0, 0.4, 0.7)),
        (16, DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1e-3)),
        (33, DQuat::from_axis_angle(DVec3::new(0.48, 0.64, 0.6), 2.5)),
    ] {
        let f = random(degree, degree, 3);
        let g = f.rotated(turn).unwrap();
        let unit = turn.normalize();
        let mut generator = Pcg64::seed_from_u64(4);
        for _ in 0..10 {
            let d = DVec3::from_array(std::array::from_fn(|_| generator.random_range(-1.0..1.0)));
            let difference = evaluate(&g, unit * d).unwrap() - evaluate(&f, d).unwrap();
            assert!(
                difference.abs() < 2e-14 * (degree + 1) as f64,
                "degree {degree}: {difference:e}"
            );
        }
    }
}

#[test]
fn rotation_there_and_back() {
    for (degree, bound) in [(64, 1e-14), (255, 5e-14), (300, 5e-14)] {
        let f = random(degree, degree, 5);
        let plan = Rotation::new(degree).unwrap();
        for turn in [
            DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8),
            DQuat::from_xyzw(1e-4, 1e-7, 0.2, 0.8),
            DQuat::from_xyzw(0.9, 1e-9, 0.1, 0.0),
        ] {
            let g = plan.rotate(&f, turn, Parallelism::Rayon).unwrap();
            assert_eq!(g, plan.rotate(&f, turn, Parallelism::Sequential).unwrap());
            for (a, b) in average_power(&f).iter().zip(average_power(&g)) {
                assert!((b / a - 1.0).abs() < bound);
            }
            let back = plan
                .rotate(&g, turn.conjugate(), Parallelism::Sequential)
                .unwrap();
            let error = largest_difference(f.as_slice(), back.as_slice());
            assert!(error < 4.0 * bound, "degree {degree}: {error:e}");
        }
        let (a, b) = (
            DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8),
            DQuat::from_xyzw(0.1, -0.5, 0.3, 0.6),
        );
        let one = plan
            .rotate(&f, (a * b).normalize(), Parallelism::Sequential)
            .unwrap();
        let two = plan.rotate(&f, b, Parallelism::Sequential).unwrap();
        let two = plan.rotate(&two, a, Parallelism::Sequential).unwrap();
        let error = largest_difference(one.as_slice(), two.as_slice());
        assert!(error < 20.0 * bound, "degree {degree}: {error:e}");
    }
}

/// The promise of `Rotation`'s documentation, at the degree that it names.
#[test]
fn rotation_there_and_back_at_degree_1024() {
    let f = random(1024, 1024, 5);
    let plan = Rotation::new(1024).unwrap();
    let turn = DQuat::from_xyzw(0.3, 0.5, -0.2, 0.8).normalize();
    let g = plan.rotate(&f, turn, Parallelism::Rayon).unwrap();
    for (a, b) in average_power(&f).iter().zip(average_power(&g)) {
        assert!((b / a - 1.0).abs() < 1e-13, "{a} and {b}");
    }
    let back = plan
        .rotate(&g, turn.conjugate(), Parallelism::Rayon)
        .unwrap();
    let error = largest_difference(f.as_slice(), back.as_slice());
    println!("there and back at degree 1024: {error:e}");
    assert!(error < 1e-13, "{error:e}");
}

#[test]
fn batches_and_threads_change_nothing() {
    for (grid, degree, orders) in [
        (Grid::gauss_legendre(40, 81), 39, 39),
        (Grid::gauss_legendre(43, 66), 40, 31),
        (Grid::lat_long(65, 63), 31, 31),
        (Grid::lat_long(33, 64), 32, 31),
        (Grid::clenshaw_curtis(17, 18), 8, 8),
        (Grid::gauss_legendre(1, 1), 0, 0),
        (Grid::gauss_legendre(300, 602), 299, 299),
    ] {
        let grid = grid.unwrap();
        let transform = Transform::with_orders(&grid, degree, orders).unwrap();
        // One map, threes and what is left of them, eights and what is left of them.
        for batch in [1, 2, 3, 4, 7, 37] {
            let count = transform.coefficient_count();
            let sets: Vec<f64> = (0..batch)
                .flat_map(|i| random(degree, orders, 20 + i as u64).into_vec())
                .collect();
            let mut maps = vec![0.0; batch * grid.len()];
            let mut back = vec![0.0; batch * count];
            let mut again = maps.clone();
            let mut scratch = vec![f64::NAN; transform.scratch_len(batch)];
            for (parallelism, maps) in [
                (Parallelism::Sequential, &mut maps),
                (Parallelism::Rayon, &mut again),
            ] {
                transform
                    .synthesise_into(batch, &sets, maps, &mut scratch, parallelism)
                    .unwrap();
                transform
                    .analyse_into(batch, maps, &mut back, &mut scratch, parallelism)
                    .unwrap();
                assert!(largest_difference(&sets, &back) < 1e-13);
            }
            assert_eq!(maps, again);
            // No field of the degree, so that it matters which degrees the analysis keeps.
            let mut generator = Pcg64::seed_from_u64(batch as u64);
            maps.fill_with(|| generator.random_range(-1.0..1.0));
            transform
                .analyse_into(batch, &maps, &mut back, &mut scratch, Parallelism::Rayon)
                .unwrap();
            for i in 0..batch {
                let f = sets[i * count..(i + 1) * count].to_vec();
                let f = Coefficients::from_vec(degree, orders, f).unwrap();
                let of_batch = i * grid.len()..(i + 1) * grid.len();
                let one = transform.synthesise(&f).unwrap();
                assert!(largest_difference(&one, &again[of_batch.clone()]) < 1e-12);
                let one = transform.analyse(&maps[of_batch]).unwrap();
                assert!(
                    largest_difference(one.as_slice(), &back[i * count..(i + 1) * count]) < 1e-14
                );
            }
        }
    }
}

#[test]
fn synthesis_is_the_adjoint_of_analysis() {
    let grid = Grid::gauss_legendre(70, 139).unwrap();
    let transform = Transform::with_orders(&grid, 60, 50).unwrap();
    let f = random(60, 50, 8);
    let mut generator = Pcg64::seed_from_u64(9);
    let noise: Vec<f64> = (0..grid.len())
        .map(|_| generator.random_range(-1.0..1.0))
        .collect();
    let map = transform.synthesise(&f).unwrap();
    let g = transform.analyse(&noise).unwrap();
    let left: f64 = map
        .chunks(139)
        .zip(noise.chunks(139))
        .enumerate()
        .map(|(ring, (a, b))| {
            grid.ring_weight(ring) * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
        })
        .sum();
    let right: f64 = f
        .as_slice()
        .iter()
        .zip(g.as_slice())
        .map(|(a, b)| a * b)
        .sum();
    assert!(
        (left - right).abs() < 1e-13 * f.energy().sqrt() * g.energy().sqrt(),
        "{left} {right}"
    );
}

#[test]
fn gradient_is_the_slope() {
    for degree in [5, 60] {
        let basis = Basis::new(degree).unwrap();
        let f = random(degree, degree, 12);
        let directions = [
            DVec3::new(0.48, 0.64, 0.6),
            DVec3::new(-0.48, 0.6, -0.64),
            DVec3::Z,
            DVec3::NEG_Z,
            DVec3::X,
            DVec3::new(1e-9, 2e-9, 1.0),
        ];
        let mut out = vec![(0.0, DVec3::ZERO); directions.len()];
        basis
            .gradients(&f, &directions, &mut out, Parallelism::Sequential)
            .unwrap();
        for (d, (value, gradient)) in directions.iter().zip(out) {
            assert_abs_diff_eq!(value, evaluate(&f, *d).unwrap(), epsilon = 1e-12);
            assert!(gradient.dot(*d).abs() < 1e-10);
            let a = d.any_orthonormal_vector();
            for tangent in [a, d.cross(a)] {
                // Along the great circle, fourth order.
                let h = 1e-3;
                let at =
                    |k: f64| evaluate(&f, *d * (k * h).cos() + tangent * (k * h).sin()).unwrap();
                let slope = (8.0 * (at(1.0) - at(-1.0)) - at(2.0) + at(-2.0)) / (12.0 * h);
                let difference = (slope - gradient.dot(tangent)).abs();
                assert!(
                    difference < 1e-11 * (degree as f64).powi(6),
                    "{d}: {difference:e}"
                );
            }
        }
    }
}

#[test]
fn gradients_of_each_harmonic_make_up_that_of_the_sum() {
    for degree in [0, 1, 7, 8, 20, 60] {
        let basis = Basis::new(degree).unwrap();
        let count = basis.count();
        let f = random(degree, degree, 13);
        let mut generator = Pcg64::seed_from_u64(14);
        let mut directions: Vec<DVec3> = (0..69)
            .map(|_| DVec3::from_array(std::array::from_fn(|_| generator.random_range(-1.0..1.0))))
            .collect();
        directions.extend([
            DVec3::Z,
            DVec3::NEG_Z,
            DVec3::Y,
            DVec3::new(1e-9, -2e-9, -1.0),
        ]);
        let n = directions.len();
        let (mut values, mut gradients) =
            (vec![f64::NAN; n * count], vec![f64::NAN; 3 * n * count]);
        let (mut plain, mut sums) = (vec![f64::NAN; n * count], vec![(0.0, DVec3::ZERO); n]);
        basis
            .values_and_gradients(&directions, &mut values, &mut gradients, Parallelism::Rayon)
            .unwrap();
        basis
            .values(&directions, &mut plain, Parallelism::Rayon)
            .unwrap();
        basis
            .gradients(&f, &directions, &mut sums, Parallelism::Sequential)
            .unwrap();
        assert!(largest_difference(&values, &plain) < 4e-15);
        let dot = |row: &[f64]| -> f64 { row.iter().zip(f.as_slice()).map(|(a, b)| a * b).sum() };
        for (i, (value, gradient)) in sums.iter().enumerate() {
            assert!(
                (dot(&plain[i * count..(i + 1) * count]) - value).abs()
                    < 1e-13 * (degree + 1) as f64
            );
            let made = DVec3::from_array(std::array::from_fn(|axis| {
                dot(&gradients[(3 * i + axis) * count..(3 * i + axis + 1) * count])
            }));
            let error = (made - *gradient).length();
            assert!(
                error < 1e-13 * ((degree + 1) as f64).powi(2),
                "degree {degree}, direction {i}: {error:e}"
            );
        }
    }
}

#[test]
fn past_the_end_is_an_error() {
    assert!(Basis::new(MAX_BASIS_DEGREE + 1).is_err());
    assert!(Rotation::new(2049).is_err());
    assert!(Rule::gauss_legendre(0).is_err());
    assert!(Rule::gauss_legendre(16385).is_err());
    assert!(Rule::clenshaw_curtis(1).is_err());
    assert!(Grid::gauss_legendre(4, 0).is_err());
    let grid = Grid::gauss_legendre(4098, 3).unwrap();
    assert!(Transform::with_orders(&grid, 4097, 1).is_err());
    // The largest degree of all, of order 1: exact there.
    let transform = Transform::with_orders(&grid, 4096, 1).unwrap();
    let mut f = Coefficients::zeros_with_orders(4096, 1);
    f.set(4096, 1, 1.0).unwrap();
    f.set(4095, 0, 2.0).unwrap();
    let back = transform
        .analyse(&transform.synthesise(&f).unwrap())
        .unwrap();
    assert!(largest_difference(f.as_slice(), back.as_slice()) < 1e-12);
    assert!(Transform::with_orders(&grid, 8, 2).is_err());
    let small = Transform::new(&Grid::gauss_legendre(4, 8).unwrap(), 3).unwrap();
    assert!(small.synthesise(&Coefficients::zeros(2)).is_err());
    assert!(small.analyse(&[0.0; 31]).is_err());
    assert!(small.analyse(&[f64::NAN; 32]).is_err());
    assert!(
        Basis::new(3)
            .unwrap()
            .values(&[DVec3::ZERO], &mut [0.0; 16], Parallelism::Sequential)
            .is_err()
    );
    assert!(
        Coefficients::zeros(3)
            .rotated(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0))
            .is_err()
    );
}

#[test]
fn conventions_there_and_back() {
    let f = random(9, 9, 30);
    for normalisation in [
        Normalisation::Orthonormal,
        Normalisation::FourPi,
        Normalisation::Schmidt,
    ] {
        for phase in [Phase::Plain, Phase::CondonShortley] {
            let convention = Convention {
                normalisation,
                phase,
            };
            let complex = f.to_complex(convention);
            let back = Coefficients::from_complex(9, convention, &complex).unwrap();
            assert!(largest_difference(f.as_slice(), back.as_slice()) < 1e-15);
            for order in [Order::ByOrder, Order::ByDegree] {
                let real = f.to_real(convention, order);
                let back = Coefficients::from_real(9, convention, order, &real).unwrap();
                assert!(largest_difference(f.as_slice(), back.as_slice()) < 1e-15);
            }
        }
    }
    assert_eq!(
        f.to_real(Convention::default(), Order::ByOrder),
        f.as_slice()
    );
    // Schmidt's P_1^1 = sin θ and 4π's Y_00 = 1: the function is the sum of coefficient times basis
    // function.
    let mut g = Coefficients::zeros(1);
    g.set(1, 1, 1.0).unwrap();
    g.set(0, 0, 1.0).unwrap();
    let d = DVec3::new(0.6, 0.0, 0.8);
    let value = evaluate(&g, d).unwrap();
    let schmidt = g.to_real(
        Convention {
            normalisation: Normalisation::Schmidt,
            phase: Phase::Plain,
        },
        Order::ByDegree,
    );
    assert_abs_diff_eq!(schmidt[0] + schmidt[3] * 0.6, value, epsilon = 1e-15);
}

/// The polynomials as two much copied papers print them, to their six digits:
/// `docs/reference/conventions.md`.
#[test]
fn printed_polynomials() {
    let d = DVec3::new(0.48, 0.64, 0.6);
    let (x, y, z) = (d.x, d.y, d.z);
    // Ramamoorthi and Hanrahan 2001 (doi:10.1145/383259.383317), equation 3, by l² + l + m.
    let ramamoorthi = [
        0.282095,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3.0 * z * z - 1.0),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    ];
    // Sloan 2008, "Stupid Spherical Harmonics (SH) Tricks", appendix A2: the odd orders are
    // negative.
    let mut sloan = ramamoorthi;
    for i in [1, 3, 5, 7] {
        sloan[i] = -sloan[i];
    }
    for (printed, convention) in [
        (ramamoorthi, Convention::default()),
        (sloan, Convention::HEALPIX),
    ] {
        for (i, value) in printed.iter().enumerate() {
            let mut one = [0.0; 9];
            one[i] = 1.0;
            let f = Coefficients::from_real(2, convention, Order::ByDegree, &one).unwrap();
            assert!((evaluate(&f, d).unwrap() - value).abs() < 1e-6, "{i}");
        }
    }
}
