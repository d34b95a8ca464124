//! The closed forms against the exact coefficients: each bound holds, and is not ten times too
//! wide.

use lobes::reflectance::{Variant, Ward, approximation};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// σ from 0.02 to 0.5, finely.
fn sigmas() -> impl Iterator<Item = f64> {
    (0..41).map(|k| 0.02 * 25f64.powf(f64::from(k) / 40.0))
}

#[test]
fn bounds_at_normal_incidence() {
    for variant in Variant::ALL {
        for sigma in sigmas() {
            let top = 256;
            let exact = Ward::isotropic(variant, sigma)
                .unwrap()
                .zonal(1.0, top)
                .unwrap();
            type Form = fn(Variant, f64, usize) -> lobes::Result<approximation::Approximation>;
            let forms: [(&str, Form); 2] = [
                ("gaussian", approximation::gaussian),
                ("series", approximation::series),
            ];
            for (name, form) in forms {
                let (mut error, mut bound) = (0f64, 0f64);
                for (degree, &truth) in exact.iter().enumerate() {
                    let near = form(variant, sigma, degree).unwrap();
                    let off = (near.value - truth).abs();
                    assert!(
                        off <= near.bound,
                        "{name} {variant} σ {sigma:.4} l {degree}: {off:.3e} > {:.3e}",
                        near.bound
                    );
                    error = error.max(off);
                    bound = bound.max(near.bound);
                }
                assert!(
                    bound < 10.0 * error,
                    "{name} {variant} σ {sigma:.4}: {bound:.3e} for {error:.3e}"
                );
            }
        }
    }
}

#[test]
fn bounds_at_oblique_views() {
    for variant in Variant::ALL {
        for sigma in sigmas().step_by(4) {
            for cosine in [1.0, 0.9, 0.7, 0.5, 0.35, 0.25, 0.17, 0.1] {
                if cosine < sigma {
                    assert!(approximation::oblique(variant, sigma, cosine, 3).is_err());
                    continue;
                }
                let lobe = Ward::isotropic(variant, sigma).unwrap();
                let top = (6.0 / (sigma * cosine)).min(200.0) as usize;
                let exact = lobe.zonal(cosine, top).unwrap();
                let near = approximation::oblique(variant, sigma, cosine, top).unwrap();
                let error = exact
                    .iter()
                    .zip(&near.values)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                let bound = near.bound;
                let place =
                    format!("{variant} σ {sigma:.3} c {cosine}: {error:.2e} of {bound:.2e}");
                assert!(error <= bound, "{place}");
                assert!(bound < 10.0 * error, "{place}");
            }
        }
    }
}

/// Places that no bound was fitted at.
#[test]
fn bounds_between_the_places_they_were_read_off() {
    let mut rng = Pcg64::seed_from_u64(31);
    for variant in Variant::ALL {
        for _ in 0..150 {
            let sigma = 0.005 * 100f64.powf(rng.random());
            let lobe = Ward::isotropic(variant, sigma).unwrap();
            let exact = lobe.zonal(1.0, 256).unwrap();
            for (degree, &truth) in exact.iter().enumerate() {
                for near in [
                    approximation::gaussian(variant, sigma, degree).unwrap(),
                    approximation::series(variant, sigma, degree).unwrap(),
                ] {
                    let off = (near.value - truth).abs();
                    assert!(
                        off <= near.bound,
                        "{variant} σ {sigma} l {degree}: {off:e} > {:e}",
                        near.bound
                    );
                }
            }
            let least = approximation::MIN_OBLIQUE_COSINE.max(sigma);
            let cosine = least + (1.0 - least) * rng.random::<f64>().powi(2);
            let top = (6.0 / (sigma * cosine)).min(200.0) as usize;
            let exact = lobe.zonal(cosine, top).unwrap();
            let near = approximation::oblique(variant, sigma, cosine, top).unwrap();
            let error = exact
                .iter()
                .zip(&near.values)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            let bound = near.bound;
            assert!(
                error <= bound && bound < 10.0 * error,
                "{variant} σ {sigma} c {cosine}: {error:e} of {bound:e}"
            );
        }
    }
}

#[test]
fn refuses_what_has_no_bound() {
    assert!(approximation::series(Variant::Duer, 0.51, 3).is_err());
    assert!(approximation::gaussian(Variant::Duer, f64::NAN, 3).is_err());
    assert!(approximation::oblique(Variant::Duer, 0.1, 0.09, 3).is_err());
}
