//! The sampler: χ² against its density, the furnace, and that each rejects a seeded fault.

use std::f64::consts::{PI, TAU};

use lobes::glam::DVec3;
use lobes::reflectance::{Variant, Ward};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const SAMPLES: usize = 1_000_000;
const RINGS: usize = 24;
const SECTORS: usize = 16;

/// Which cell of half-vector slopes a light falls in: rings of equal probability, for a sampler without a horizon.
fn cell(sigma: [f64; 2], view: DVec3, light: DVec3) -> usize {
    let half = view + light;
    let (x, y) = (half.x / half.z / sigma[0], half.y / half.z / sigma[1]);
    let ring = -(-(x * x + y * y)).exp_m1() * RINGS as f64;
    let sector = (y.atan2(x) / TAU + 0.5) * SECTORS as f64;
    (ring as usize).min(RINGS - 1) * SECTORS + (sector as usize).min(SECTORS - 1)
}

/// The expected share of each cell: the density over directions, integrated with the cell's own fine grid. Directions from slopes
/// by reflection, and the Jacobian `dω_i` = 4 (h·v) cos³δ dx dy by finite differences of those, not from a formula.
fn expected(lobe: &Ward, density: &dyn Fn(&Ward, DVec3, DVec3) -> f64, view: DVec3) -> Vec<f64> {
    let sigma = lobe.sigma();
    let fine = 16;
    let mut shares = vec![0.0; RINGS * SECTORS];
    let reflect = |x: f64, y: f64| {
        let half = DVec3::new(x, y, 1.0).normalize();
        2.0 * half.dot(view) * half - view
    };
    for ring in 0..RINGS * fine {
        for sector in 0..SECTORS * fine {
            let u = (ring as f64 + 0.5) / (RINGS * fine) as f64;
            let phi = TAU * ((sector as f64 + 0.5) / (SECTORS * fine) as f64 - 0.5);
            let radius = (-(-u).ln_1p()).sqrt();
            let (x, y) = (sigma[0] * radius * phi.cos(), sigma[1] * radius * phi.sin());
            let light = reflect(x, y);
            if light.z <= 0.0 {
                continue;
            }
            let step = 1e-6;
            let dx = (reflect(x + step, y) - reflect(x - step, y)) / (2.0 * step);
            let dy = (reflect(x, y + step) - reflect(x, y - step)) / (2.0 * step);
            let solid_angle = dx.cross(dy).length();
            // The cell's area of slopes: du = 2r e^(−r²) dr.
            let area = sigma[0] * sigma[1] / (2.0 * (1.0 - u)) * TAU
                / ((RINGS * fine) * (SECTORS * fine)) as f64;
            shares[cell(sigma, view, light)] += density(lobe, view, light) * solid_angle * area;
        }
    }
    shares
}

/// The p value of the counts; cells with fewer than five expected are pooled.
fn p_value(counts: &[f64], shares: &[f64], drawn: f64) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0usize);
    let (mut pooled_count, mut pooled_share) = (0.0, 0.0);
    for (&count, &share) in counts.iter().zip(shares) {
        if share * drawn < 5.0 {
            pooled_count += count;
            pooled_share += share;
        } else {
            statistic += (count - share * drawn).powi(2) / (share * drawn);
            cells += 1;
        }
    }
    if pooled_share * drawn >= 5.0 {
        statistic += (pooled_count - pooled_share * drawn).powi(2) / (pooled_share * drawn);
        cells += 1;
    } else if pooled_count > 30.0 {
        return 0.0;
    }
    let total: f64 = shares.iter().sum();
    // Where draws may fall below the horizon the total is free: no degree of freedom is lost.
    let freedom = if total < 0.999 { cells } else { cells - 1 };
    1.0 - ChiSquared::new(freedom as f64).unwrap().cdf(statistic)
}

fn draw(lobe: &Ward, view: DVec3, seed: u64) -> (Vec<f64>, f64) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut counts = vec![0.0; RINGS * SECTORS];
    let mut weight = 0.0;
    for _ in 0..SAMPLES {
        let sample = lobe.sample(view, [rng.random(), rng.random()]);
        if sample.weight > 0.0 {
            counts[cell(lobe.sigma(), view, sample.light)] += 1.0;
            weight += sample.weight;
        }
    }
    (counts, weight / SAMPLES as f64)
}

fn views() -> [DVec3; 3] {
    [0.2f64, 1.0, 1.45].map(|theta| {
        DVec3::new(
            theta.sin() * 0.8f64.cos(),
            theta.sin() * 0.8f64.sin(),
            theta.cos(),
        )
    })
}

fn lobes() -> Vec<Ward> {
    let mut lobes = Vec::new();
    for variant in Variant::ALL {
        for sigma in [0.01, 0.1, 0.5] {
            lobes.push(Ward::isotropic(variant, sigma).unwrap());
        }
    }
    lobes.push(Ward::anisotropic(Variant::Duer, 0.05, 0.3).unwrap());
    lobes
}

/// 39 tests in all at a false alarm of 1 % together (Šidák).
const LEAST_P: f64 = 2.6e-4;

#[test]
fn draws_by_its_density_and_conserves_the_albedo() {
    for lobe in lobes() {
        for (index, view) in views().into_iter().enumerate() {
            let (counts, weight) = draw(&lobe, view, 1000 + index as u64);
            let shares = expected(&lobe, &|lobe, v, l| lobe.pdf(v, l), view);
            let p = p_value(&counts, &shares, SAMPLES as f64);
            assert!(
                p > LEAST_P,
                "{} {:?} view {index}: p = {p}",
                lobe.variant(),
                lobe.sigma()
            );
            // The furnace: the mean weight is the albedo. Weights lie in [0, w]; 5 standard errors with w² for the variance.
            let albedo = lobe.albedo_from(view);
            let largest = 2.0f64.max(albedo * 3.0);
            assert!(
                (weight - albedo).abs() < 5.0 * largest / (SAMPLES as f64).sqrt(),
                "{} {:?} view {index}: furnace {weight} for {albedo}",
                lobe.variant(),
                lobe.sigma()
            );
        }
    }
}

#[test]
fn chi_square_rejects_seeded_faults() {
    let view = views()[1];
    let lobe = Ward::isotropic(Variant::Duer, 0.1).unwrap();
    let (counts, _) = draw(&lobe, view, 7);
    let wide = Ward::isotropic(Variant::Duer, 0.101).unwrap();
    type Fault<'a> = (&'a str, Box<dyn Fn(&Ward, DVec3, DVec3) -> f64>);
    let half_dot = |v: DVec3, l: DVec3| 0.5 * (v + l).length();
    let faults: [Fault; 2] = [
        ("σ by 1 %", Box::new(move |_, v, l| wide.pdf(v, l))),
        (
            "a missing 1/(h·v), normalised again",
            Box::new(move |lobe, v, l| lobe.pdf(v, l) * half_dot(v, l) / 0.54),
        ),
    ];
    for (name, fault) in faults {
        let shares = expected(&lobe, &*fault, view);
        let p = p_value(&counts, &shares, SAMPLES as f64);
        assert!(p < 1e-12, "{name} passes with p = {p}");
    }
}

#[test]
fn the_furnace_rejects_what_chi_square_misses() {
    // cos²δ for cos³δ in the weight, at the σ where χ² alone is blind.
    let view = views()[1];
    for sigma in [0.05, 0.1] {
        let lobe = Ward::isotropic(Variant::Duer, sigma).unwrap();
        let mut rng = Pcg64::seed_from_u64(8);
        let (mut right, mut wrong, mut square) = (0.0, 0.0, 0.0);
        let samples = SAMPLES;
        for _ in 0..samples {
            let sample = lobe.sample(view, [rng.random(), rng.random()]);
            let half = (view + sample.light).normalize();
            right += sample.weight;
            wrong += sample.weight / half.z;
            square += sample.weight * sample.weight;
        }
        let count = samples as f64;
        let (right, wrong) = (right / count, wrong / count);
        let error = ((square / count - right * right) / count).sqrt();
        let albedo = lobe.albedo_from(view);
        assert!(
            (right - albedo).abs() < 4.0 * error,
            "{right} {albedo} {error}"
        );
        assert!(
            (wrong - albedo).abs() > 6.0 * error,
            "{wrong} {albedo} {error}"
        );
    }
}

#[test]
fn is_reciprocal_where_it_says_so() {
    let mut rng = Pcg64::seed_from_u64(9);
    let mut direction = || {
        let z: f64 = rng.random_range(0.05..1.0);
        let phi = 2.0 * PI * rng.random::<f64>();
        let sine = (1.0 - z * z).sqrt();
        DVec3::new(sine * phi.cos(), sine * phi.sin(), z)
    };
    let mut largest = 0f64;
    for _ in 0..200 {
        let (a, b) = (direction(), direction());
        for variant in Variant::ALL {
            let lobe = Ward::isotropic(variant, 0.6).unwrap();
            let (ab, ba) = (lobe.evaluate(a, b) / b.z, lobe.evaluate(b, a) / a.z);
            let off = (ab - ba).abs() / ab.max(ba);
            if variant == Variant::RadianceSampled {
                largest = largest.max(off);
            } else {
                assert!(off < 1e-14, "{variant}: {ab} {ba}");
            }
        }
    }
    assert!(largest > 0.1, "RadianceSampled is not reciprocal");
}

#[test]
fn never_gives_a_nan() {
    let numbers = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.6,
        0.8,
        1e-8,
        5e-324,
        1e-99,
        1e-101,
        1e300,
        -1e300,
        f64::MAX,
    ];
    let mut lights = Vec::new();
    for x in numbers {
        for y in [0.0, 0.6, 1e300] {
            for z in numbers {
                lights.push(DVec3::new(x, y, z));
            }
        }
    }
    for variant in Variant::ALL {
        for sigma in [1e-6, 0.1, 1.0] {
            let lobe = Ward::isotropic(variant, sigma).unwrap();
            let mut out = vec![0.0; lights.len()];
            for &view in &lights {
                lobe.evaluate_batch(view, &lights, &mut out).unwrap();
                for (&light, &batch) in lights.iter().zip(&out) {
                    let value = lobe.evaluate(view, light);
                    assert!(value.is_finite() && value >= 0.0, "{view} {light}: {value}");
                    assert!(
                        (value - batch).abs() <= 1e-12 * value + 1e-200,
                        "{variant} {sigma} {view} {light}: {value} {batch}"
                    );
                    assert!(lobe.pdf(view, light).is_finite());
                }
                let sample = lobe.sample(view, [0.999, 0.3]);
                assert!(!sample.weight.is_nan());
            }
        }
    }
    for sigma in [0.0, -0.1, f64::NAN, 1.0 + 1e-15, 9e-7, f64::INFINITY] {
        assert!(Ward::isotropic(Variant::Duer, sigma).is_err(), "{sigma}");
    }
    assert!(Ward::anisotropic(Variant::RadianceSampled, 0.1, 0.2).is_err());
}
