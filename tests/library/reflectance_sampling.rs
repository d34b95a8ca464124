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

/// Which cell of half-vector slopes a light falls in: rings of equal probability, for a sampler
/// without a horizon.
fn cell(sigma: [f64; 2], view: DVec3, light: DVec3) -> usize {
    let half = view + light;
    let (x, y) = (half.x / half.z / sigma[0], half.y / half.z / sigma[1]);
    let ring = -(-(x * x + y * y)).exp_m1() * RINGS as f64;
    let sector = (y.atan2(x) / TAU + 0.5) * SECTORS as f64;
    (ring as usize).min(RINGS - 1) * SECTORS + (sector as usize).min(SECTORS - 1)
}

/// The expected share of each cell: the density over directions, integrated with the cell's own
/// fine grid. Directions from slopes by reflection, and the Jacobian `dω_i` = 4 (h·v) cos³δ dx dy
/// by finite differences of those, not from a formula.
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
    ChiSquared::new(freedom as f64).unwrap().sf(statistic)
}

/// The p values of all cells, of the rings alone and of the sectors alone: a fault that is spread
/// over many cells hides in the first and not in the others.
fn p_values(counts: &[f64], shares: &[f64]) -> [f64; 3] {
    let rings = |cells: &[f64]| -> Vec<f64> {
        cells
            .chunks(SECTORS)
            .map(|ring| ring.iter().sum())
            .collect()
    };
    let sectors = |cells: &[f64]| -> Vec<f64> {
        (0..SECTORS)
            .map(|sector| cells.iter().skip(sector).step_by(SECTORS).sum())
            .collect()
    };
    let drawn = SAMPLES as f64;
    [
        p_value(counts, shares, drawn),
        p_value(&rings(counts), &rings(shares), drawn),
        p_value(&sectors(counts), &sectors(shares), drawn),
    ]
}

/// A million draws.
struct Drawn {
    counts: Vec<f64>,
    /// The mean weight and its standard error.
    mean: f64,
    error: f64,
}

fn draw(lobe: &Ward, view: DVec3, seed: u64) -> Drawn {
    draw_weighted(lobe, view, seed, |_, _| 1.0)
}

/// Draws whose weights are multiplied by a fault.
fn draw_weighted(
    lobe: &Ward,
    view: DVec3,
    seed: u64,
    fault: impl Fn(DVec3, DVec3) -> f64,
) -> Drawn {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut counts = vec![0.0; RINGS * SECTORS];
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..SAMPLES {
        let sample = lobe.sample(view, [rng.random(), rng.random()]);
        if sample.weight > 0.0 {
            counts[cell(lobe.sigma(), view, sample.light)] += 1.0;
            let weight = sample.weight * fault(view, sample.light);
            sum += weight;
            squares += weight * weight;
        }
    }
    let count = SAMPLES as f64;
    let mean = sum / count;
    Drawn {
        counts,
        mean,
        error: ((squares / count - mean * mean).max(0.0) / count).sqrt(),
    }
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

/// The χ² of 13 lobes, 3 views and 3 partitions together raise a false alarm in 1 % of all seeds
/// (Šidák): 1 − 0.99^(1/117).
const LEAST_P: f64 = 8.6e-5;

/// Standard errors that the furnace may be off by: in 39 tests a false alarm in 2·10⁻⁵ of all
/// seeds.
const FURNACE: f64 = 5.0;

#[test]
fn draws_by_its_density_and_conserves_the_albedo() {
    for lobe in lobes() {
        for (index, view) in views().into_iter().enumerate() {
            let name = format!("{} {:?} view {index}", lobe.variant(), lobe.sigma());
            let drawn = draw(&lobe, view, 1000 + index as u64);
            let shares = expected(&lobe, &|lobe, v, l| lobe.pdf(v, l), view);
            let p = p_values(&drawn.counts, &shares);
            assert!(p.iter().all(|&p| p > LEAST_P), "{name}: p = {p:?}");
            let albedo = lobe.albedo_from(view);
            assert!(
                (drawn.mean - albedo).abs() <= FURNACE * drawn.error + 1e-12,
                "{name}: furnace {} ± {} for {albedo}",
                drawn.mean,
                drawn.error
            );
        }
    }
}

/// What a seeded fault has to fall below: a sampler without it does so in one of 3·10⁸ seeds.
const REJECTED: f64 = 1e-9;

#[test]
fn chi_square_rejects_sigma_by_one_percent() {
    for sigma in [0.01, 0.1, 0.5] {
        let lobe = Ward::isotropic(Variant::Duer, sigma).unwrap();
        let wide = Ward::isotropic(Variant::Duer, 1.01 * sigma).unwrap();
        for (index, view) in views().into_iter().enumerate() {
            let drawn = draw(&lobe, view, 1000 + index as u64);
            let shares = expected(&lobe, &|_, v, l| wide.pdf(v, l), view);
            let p = p_values(&drawn.counts, &shares);
            assert!(
                p.iter().any(|&p| p < REJECTED),
                "σ {sigma} view {index}: a fault passes with p = {p:?}"
            );
        }
    }
}

#[test]
fn chi_square_rejects_a_missing_half_vector_cosine() {
    // The fault has its integral made right, or it would show in that alone. h·v varies by tan θ_v
    // times the slope: at 83° every lobe shows it, and along the normal no lobe of σ 0.01 could,
    // h·v being 1 to 10⁻⁴ there.
    let view = views()[2];
    for sigma in [0.01, 0.1, 0.5] {
        let lobe = Ward::isotropic(Variant::Duer, sigma).unwrap();
        let drawn = draw(&lobe, view, 1002);
        let right = expected(&lobe, &|lobe, v, l| lobe.pdf(v, l), view);
        let mut wrong = expected(
            &lobe,
            &|lobe, v, l| lobe.pdf(v, l) * 0.5 * (v + l).length(),
            view,
        );
        let scale = right.iter().sum::<f64>() / wrong.iter().sum::<f64>();
        for share in &mut wrong {
            *share *= scale;
        }
        let p = p_values(&drawn.counts, &wrong);
        assert!(
            p.iter().any(|&p| p < REJECTED),
            "σ {sigma}: a fault passes with p = {p:?}"
        );
        let p = p_values(&drawn.counts, &right);
        assert!(p.iter().all(|&p| p > LEAST_P), "σ {sigma}: p = {p:?}");
    }
}

#[test]
fn the_furnace_rejects_a_wrong_power_of_cos_delta() {
    // cos²δ for cos³δ in the weight: a change by σ²/2, which χ² does not see. Along the normal the
    // weights are nearly equal and the furnace is sharpest.
    for sigma in [0.01, 0.1, 0.5] {
        let lobe = Ward::isotropic(Variant::Duer, sigma).unwrap();
        let albedo = lobe.albedo(1.0);
        let right = draw(&lobe, DVec3::Z, 8);
        let wrong = draw_weighted(&lobe, DVec3::Z, 8, |v, l| 1.0 / (v + l).normalize().z);
        let off = |drawn: &Drawn| (drawn.mean - albedo).abs() / drawn.error;
        assert!(off(&right) < FURNACE, "σ {sigma}: {}", off(&right));
        assert!(off(&wrong) > 30.0, "σ {sigma}: {}", off(&wrong));
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
    // A batch refuses a direction that is not of unit length; one by one they have the value 0.
    let units: Vec<DVec3> = lights
        .iter()
        .copied()
        .filter(|light| (light.length() - 1.0).abs() < 1e-9)
        .collect();
    assert!(units.len() >= 4);
    for variant in Variant::ALL {
        for sigma in [1e-6, 0.1, 1.0] {
            let lobe = Ward::isotropic(variant, sigma).unwrap();
            let mut out = vec![0.0; lights.len()];
            for &view in &lights {
                assert!(lobe.evaluate_batch(view, &lights, &mut out).is_err());
                let batch = lobe.evaluate_batch(view, &units, &mut out[..units.len()]);
                assert_eq!(batch.is_ok(), units.contains(&view), "{view}");
                for &light in &lights {
                    let value = lobe.evaluate(view, light);
                    assert!(value.is_finite() && value >= 0.0, "{view} {light}: {value}");
                    assert!(lobe.pdf(view, light).is_finite());
                }
                for (&light, &batch) in units.iter().zip(&out).filter(|_| batch.is_ok()) {
                    let value = lobe.evaluate(view, light);
                    assert!(
                        (value - batch).abs() <= 1e-12 * value + 1e-200,
                        "{variant} {sigma} {view} {light}: {value} {batch}"
                    );
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
