//! Beams, gradients, the Laplacian and random fields.

use std::f64::consts::PI;

use lobes::glam::DVec3;
use lobes::harmonics::{
    Basis, Coefficients, Transform, average_power, convolve_zonal, deconvolve_zonal, evaluate,
    gaussian_beam, laplacian, random_field,
};
use lobes::sphere::Grid;
use lobes::{Error, Parallelism};
use statrs::distribution::{ChiSquared, ContinuousCDF};

const ONE: Parallelism = Parallelism::Sequential;

/// A Gaussian of σ on the sphere spreads a point to e^(−l(l+1)σ²/2), whose value at an angle is
/// that of the flat Gaussian up to O(σ²).
#[test]
fn a_beam_is_as_wide_as_it_says() {
    let fwhm = 0.05;
    let beam = gaussian_beam(400, fwhm).unwrap();
    let at = |angle: f64| -> f64 {
        let mut p = vec![0.0; 401];
        lobes::harmonics::legendre::polynomials(angle.cos(), &mut p);
        let terms = beam.iter().zip(&p).enumerate();
        terms
            .map(|(l, (b, p))| b * p * (2 * l + 1) as f64 / (4.0 * PI))
            .sum()
    };
    assert!((at(0.5 * fwhm) / at(0.0) - 0.5).abs() < 1e-3);
    let sigma = fwhm / (8.0 * 2f64.ln()).sqrt();
    assert!((at(0.0) * 2.0 * PI * sigma * sigma - 1.0).abs() < 1e-3);
    let f = random_field(&[1.0; 401], 3).unwrap();
    let mut smooth = f.clone();
    convolve_zonal(&mut smooth, &beam).unwrap();
    deconvolve_zonal(&mut smooth, &beam, 0.0).unwrap();
    for (a, b) in smooth.as_slice().iter().zip(f.as_slice()) {
        assert!((a - b).abs() < 1e-14 * (1.0 + b.abs()));
    }
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(gaussian_beam(4, wrong), Err(Error::Domain { .. })));
    }
    assert!(matches!(
        gaussian_beam(usize::MAX, 0.1),
        Err(Error::Degree { .. })
    ));
    assert_eq!(gaussian_beam(3, 0.0).unwrap(), [1.0; 4]);
    // As wide as no sphere: what is left is the mean.
    assert_eq!(gaussian_beam(1, 1e200).unwrap(), [1.0, 0.0]);
}

/// The sum of 2l + 1 times found over given power, over 300 fields, is χ² of 300 (2l + 1) degrees of
/// freedom. Each of 21 degrees is rejected at 10⁻⁷ on either side, so that a right generator fails
/// in 4·10⁻⁶ of all seeds.
#[test]
fn the_mean_power_is_that_which_was_asked_for() {
    let power: Vec<f64> = (0..=20).map(|l| f64::from(l + 1).powf(-2.3)).collect();
    let fields = 300;
    let mut sums = vec![0.0; power.len()];
    for seed in 0..fields {
        let field = random_field(&power, seed).unwrap();
        for (l, (sum, b)) in sums.iter_mut().zip(average_power(&field)).enumerate() {
            *sum += (2 * l + 1) as f64 * b / power[l];
        }
    }
    for (l, sum) in sums.iter().enumerate() {
        let law = ChiSquared::new((fields * (2 * l as u64 + 1)) as f64).unwrap();
        let below = law.cdf(*sum);
        assert!(
            (1e-7..1.0 - 1e-7).contains(&below),
            "l = {l}: {below}, mean {}",
            sum / (fields as f64 * (2 * l + 1) as f64)
        );
    }
}

/// Of 10⁵ deviates the fourth moment is 3 ± 0.031 (one standard error), and neighbours in the order
/// of drawing do not go together: 0 ± 0.0032. Both within five errors: a right generator fails in
/// 10⁻⁶ of seeds.
#[test]
fn deviates_are_normal_and_independent() {
    let field = random_field(&[1.0; 316], 5).unwrap();
    let drawn: Vec<f64> = (0..316usize)
        .flat_map(|l| (-(l as isize)..=l as isize).map(move |m| (l, m)))
        .map(|(l, m)| field.get(l, m))
        .collect();
    let count = drawn.len() as f64;
    let fourth = drawn.iter().map(|x| x.powi(4)).sum::<f64>() / count;
    assert!((fourth - 3.0).abs() < 5.0 * (96.0 / count).sqrt());
    for lag in 1..4 {
        let together: f64 = drawn.iter().zip(&drawn[lag..]).map(|(a, b)| a * b).sum();
        assert!((together / count).abs() < 5.0 / count.sqrt(), "lag {lag}");
    }
}

#[test]
fn a_seed_is_the_same_field_at_every_degree() {
    let power: Vec<f64> = (0..40).map(|l| 1.0 / f64::from(l + 1)).collect();
    let high = random_field(&power, 9).unwrap();
    for degree in [0, 1, 7, 38] {
        let low = random_field(&power[..=degree], 9).unwrap();
        assert_eq!(high.with_degree(degree), low);
    }
    assert_ne!(high, random_field(&power, 10).unwrap());
    // These bits are no machine's own.
    let first = random_field(&[1.0, 1.0], 0).unwrap();
    let bits: Vec<u64> = first.as_slice().iter().map(|x| x.to_bits()).collect();
    let expected = [
        0xbfd3_3dff_080b_0752,
        0x3ff8_6ade_d9c3_c767,
        0x3fd8_606e_1b57_e1a3,
        0x3fdb_5c0a_647e_bf28,
    ];
    assert_eq!(bits, expected, "{bits:#x?}");
    assert!(matches!(random_field(&[], 0), Err(Error::Empty { .. })));
    for wrong in [-1e-300, f64::NAN, f64::INFINITY] {
        let given = random_field(&[1.0, wrong], 0);
        assert!(matches!(given, Err(Error::Domain { .. })));
    }
    assert_eq!(random_field(&[0.0; 3], 0).unwrap().energy(), 0.0);
}

/// In closed form: of degree 2 as sin²θ cos 2φ, of degree 1 as sin θ sin φ, at poles and between.
#[test]
fn gradients_in_closed_form() {
    for grid in [
        Grid::clenshaw_curtis(9, 12)
            .unwrap()
            .with_first_azimuth(0.4),
        Grid::lat_long(8, 16).unwrap(),
        Grid::gauss_legendre(5, 9).unwrap().descending(),
    ] {
        let transform = Transform::new(&grid, 4).unwrap();
        let mut f = Coefficients::zeros(4);
        f.set(2, 2, 1.0).unwrap();
        f.set(1, -1, -2.0).unwrap();
        f.set(1, 1, 0.5).unwrap();
        f.set(0, 0, 7.0).unwrap();
        let [south, east] = transform.gradient(&f, ONE).unwrap();
        let (a, b) = ((15.0 / (16.0 * PI)).sqrt(), (0.75 / PI).sqrt());
        for ring in 0..grid.rings() {
            for column in 0..grid.columns() {
                let (theta, phi) = (grid.colatitude(ring), grid.azimuth(column));
                let (s, c) = theta.sin_cos();
                let by_theta = a * 2.0 * s * c * (2.0 * phi).cos()
                    + b * c * (0.5 * phi.cos() - 2.0 * phi.sin());
                let by_phi =
                    -2.0 * a * s * (2.0 * phi).sin() + b * (-0.5 * phi.sin() - 2.0 * phi.cos());
                let at = ring * grid.columns() + column;
                assert!((south[at] - by_theta).abs() < 1e-14);
                assert!((east[at] - by_phi).abs() < 1e-14);
            }
        }
    }
}

/// Differences of the fourth order in θ and φ, at every l and m to the grid's degree, far from what
/// gives the gradient: h⁴ l⁵/30 and ε l/h are both below 10⁻⁹ of l.
#[test]
fn gradients_are_differences() {
    let grid = Grid::gauss_legendre(21, 42).unwrap();
    let transform = Transform::new(&grid, 20).unwrap();
    let direction = |theta: f64, phi: f64| {
        DVec3::new(
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            theta.cos(),
        )
    };
    let h = 1e-3;
    let difference =
        |f: &dyn Fn(f64) -> f64| (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
    for (l, m) in [
        (1, 0),
        (2, -1),
        (7, 7),
        (12, 5),
        (20, 0),
        (20, -1),
        (20, 20),
    ] {
        let mut f = Coefficients::zeros(20);
        f.set(l, m, 1.0).unwrap();
        let [south, east] = transform.gradient(&f, ONE).unwrap();
        for (ring, column) in [(0, 0), (3, 17), (10, 5), (20, 41)] {
            let (theta, phi) = (grid.colatitude(ring), grid.azimuth(column));
            let value = |theta, phi| evaluate(&f, direction(theta, phi)).unwrap();
            let at = ring * 42 + column;
            let by_theta = difference(&|h| value(theta + h, phi));
            let by_phi = difference(&|h| value(theta, phi + h)) / theta.sin();
            assert!((south[at] - by_theta).abs() < 1e-7, "{l} {m}");
            assert!((east[at] - by_phi).abs() < 1e-7, "{l} {m}");
        }
    }
}

/// ∫ |∇f|² = −∫ f Δf, on a grid that integrates products exactly, whatever the threads.
#[test]
fn gradient_and_laplacian_belong_together() {
    let grid = Grid::gauss_legendre(66, 131).unwrap();
    let transform = Transform::new(&grid, 64).unwrap();
    let f = random_field(&[1.0; 65], 2).unwrap();
    let parts = transform.gradient(&f, ONE).unwrap();
    assert_eq!(transform.gradient(&f, Parallelism::Rayon).unwrap(), parts);
    let energy: f64 = (0..grid.rings())
        .flat_map(|ring| (0..131).map(move |column| (ring, ring * 131 + column)))
        .map(|(ring, at)| grid.ring_weight(ring) * (parts[0][at].powi(2) + parts[1][at].powi(2)))
        .sum();
    let product: f64 = laplacian(&f)
        .as_slice()
        .iter()
        .zip(f.as_slice())
        .map(|(a, b)| -a * b)
        .sum();
    assert!((energy / product - 1.0).abs() < 1e-13);
    // At a point: the trace of the second derivatives along two great circles.
    let basis = Basis::new(64).unwrap();
    let (n, u, v) = (
        DVec3::new(0.48, 0.64, 0.6),
        DVec3::new(0.8, -0.6, 0.0),
        DVec3::new(0.36, 0.48, -0.8),
    );
    let h = 2e-3;
    let directions: Vec<DVec3> = [(0.0, 0.0), (h, 0.0), (-h, 0.0), (0.0, h), (0.0, -h)]
        .iter()
        .map(|&(a, b): &(f64, f64)| n * (a + b).cos() + u * a.sin() + v * b.sin())
        .collect();
    let (mut values, mut found) = (vec![0.0; 5], [0.0]);
    basis.sums(&f, &directions, &mut values, ONE).unwrap();
    basis
        .sums(&laplacian(&f), &directions[..1], &mut found, ONE)
        .unwrap();
    let sum = (values[1..].iter().sum::<f64>() - 4.0 * values[0]) / (h * h);
    // h² l⁴/12 of l².
    assert!((found[0] - sum).abs() < 2e-3 * 64.0 * 65.0 * 65.0 / (4.0 * PI).sqrt());
}

#[test]
fn what_does_not_fit_is_refused() {
    let grid = Grid::gauss_legendre(4, 8).unwrap();
    let few = Transform::with_orders(&grid, 3, 1).unwrap();
    let given = few.gradient(&Coefficients::zeros_with_orders(3, 1), ONE);
    assert!(matches!(given, Err(Error::Degree { .. })));
    let transform = Transform::new(&grid, 3).unwrap();
    let given = transform.gradient(&Coefficients::zeros(2), ONE);
    assert!(matches!(given, Err(Error::Length { .. })));
    let mut f = Coefficients::zeros(3);
    f.set(3, 1, f64::NAN).unwrap();
    let given = transform.gradient(&f, ONE);
    assert!(matches!(given, Err(Error::NotFinite { .. })));
    f.set(3, 1, 1e308).unwrap();
    let given = transform.gradient(&f, ONE);
    assert!(matches!(given, Err(Error::Overflow { .. })));
    let nothing = Transform::new(&Grid::gauss_legendre(1, 1).unwrap(), 0).unwrap();
    let given = nothing.gradient(&Coefficients::zeros(0), ONE).unwrap();
    assert_eq!(given, [vec![0.0], vec![0.0]]);
}
