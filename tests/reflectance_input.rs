//! What the lobes and materials say to bad input: at the edge of each domain, one step past it, and at random.

use lobes::glam::DVec3;
use lobes::reflectance::{HORIZON, MIN_SIGMA, Material, Roughness, Variant, Ward};
use lobes::{Error, Result};
use proptest::prelude::*;

fn is_domain<T>(result: Result<T>) -> bool {
    matches!(result, Err(Error::Domain { .. }))
}

#[test]
fn sigma_at_its_ends_and_one_step_past_them() {
    for variant in Variant::ALL {
        for sigma in [MIN_SIGMA, MIN_SIGMA.next_up(), 1.0f64.next_down(), 1.0] {
            assert!(Ward::isotropic(variant, sigma).is_ok(), "{sigma}");
            assert!(Ward::anisotropic(variant, sigma, sigma).is_ok(), "{sigma}");
            assert_eq!(Roughness::from_sigma(sigma), Ok(Roughness::Rough(sigma)));
        }
        for sigma in [
            MIN_SIGMA.next_down(),
            1.0f64.next_up(),
            0.0,
            5e-324,
            -0.1,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            assert!(is_domain(Ward::isotropic(variant, sigma)), "{sigma}");
            assert!(is_domain(Ward::anisotropic(variant, sigma, 0.1)), "{sigma}");
            assert!(is_domain(Ward::anisotropic(variant, 0.1, sigma)), "{sigma}");
            if sigma != 0.0 {
                assert!(is_domain(Roughness::from_sigma(sigma)), "{sigma}");
            }
        }
    }
    assert_eq!(Roughness::from_sigma(-0.0), Ok(Roughness::Mirror));
    assert!(matches!(
        Ward::anisotropic(Variant::RadianceSampled, 0.1, 0.2),
        Err(Error::Unanswerable(_))
    ));
}

#[test]
fn albedos_at_their_ends_and_one_step_past_them() {
    for value in [0.0, -0.0, 1.0] {
        assert!(Material::from_albedos("a", [value; 3], [0.0; 3], 0.1).is_ok());
        assert!(Material::from_albedos("a", [0.0; 3], [value; 3], 0.1).is_ok());
        assert!(Material::plastic("a", [value; 3], value, 0.1).is_ok());
        assert!(Material::metal("a", [value; 3], value, 0.1).is_ok());
    }
    for value in [-5e-324, 1.0f64.next_up(), f64::NAN, f64::INFINITY] {
        for channel in 0..3 {
            let mut triple = [0.2; 3];
            triple[channel] = value;
            assert!(is_domain(Material::from_albedos(
                "a", triple, [0.0; 3], 0.1
            )));
            assert!(is_domain(Material::from_albedos(
                "a", [0.0; 3], triple, 0.1
            )));
            assert!(is_domain(Material::from_albedos_gaining_energy(
                "a", triple, [0.0; 3], 0.1
            )));
            assert!(is_domain(Material::from_albedos_gaining_energy(
                "a", [0.0; 3], triple, 0.1
            )));
            assert!(is_domain(Material::plastic("a", triple, 0.1, 0.1)));
            assert!(is_domain(Material::metal("a", triple, 0.1, 0.1)));
        }
        assert!(is_domain(Material::plastic("a", [0.2; 3], value, 0.1)));
        assert!(is_domain(Material::metal("a", [0.2; 3], value, 0.1)));
    }
    // The sum may pass 1 by a rounding, and no further.
    assert!(Material::from_albedos("a", [0.7; 3], [0.3; 3], 0.1).is_ok());
    assert!(is_domain(Material::from_albedos(
        "a",
        [0.7; 3],
        [0.3 + 1e-14; 3],
        0.1
    )));
}

#[test]
fn directions_at_the_edges_of_what_is_seen() {
    for variant in Variant::ALL {
        let lobe = Ward::isotropic(variant, 0.5).unwrap();
        // The horizon belongs to what is below it.
        for (z, seen) in [
            (HORIZON, false),
            (HORIZON.next_up(), true),
            (0.0, false),
            (-0.0, false),
        ] {
            let grazing = DVec3::new(1.0, 0.0, z);
            let other = DVec3::new(-0.6, 0.0, 0.8);
            assert_eq!(
                lobe.pdf(other, grazing) > 0.0,
                seen,
                "{variant} light {z:e}"
            );
            assert_eq!(lobe.pdf(grazing, other) > 0.0, seen, "{variant} view {z:e}");
            assert_eq!(lobe.albedo(z) > 0.0, seen, "{variant} {z:e}");
            assert_eq!(lobe.share_above_horizon(z) > 0.0, seen, "{variant} {z:e}");
            assert_eq!(lobe.zonal(z, 2).is_ok(), seen, "{variant} {z:e}");
        }
        // The square of the length within 10⁻⁶ of 1.
        for (length, seen) in [
            (1.0 + 4.9e-7, true),
            (1.0 + 5.1e-7, false),
            (1.0 - 4.9e-7, true),
            (1.0 - 5.1e-7, false),
        ] {
            let long = length * DVec3::new(0.6, 0.0, 0.8);
            assert_eq!(
                lobe.evaluate(long, DVec3::Z) > 0.0,
                seen,
                "{variant} {length}"
            );
            assert_eq!(
                lobe.evaluate(DVec3::Z, long) > 0.0,
                seen,
                "{variant} {length}"
            );
            assert_eq!(
                lobe.sample(long, [0.1, 0.2]).weight > 0.0,
                seen,
                "{variant} {length}"
            );
            assert_eq!(lobe.albedo_from(long) > 0.0, seen, "{variant} {length}");
        }
        for cosine in [1.0f64.next_up(), -0.1, f64::NAN, f64::INFINITY] {
            assert_eq!(lobe.albedo(cosine), 0.0);
            assert_eq!(lobe.share_above_horizon(cosine), 0.0);
            assert!(is_domain(lobe.zonal(cosine, 2)));
        }
        assert!(matches!(lobe.zonal(1.0, 1025), Err(Error::Degree { .. })));
        assert!(matches!(
            lobe.evaluate_batch(DVec3::Z, &[DVec3::Z; 3], &mut [0.0; 2]),
            Err(Error::Length { .. })
        ));
    }
}

/// Numbers of every size, and those at which something happens.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.5..1.5f64,
        2 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, HORIZON, 5e-324, f64::MAX, f64::MIN]),
    ]
}

/// Directions that are unit vectors, grazing ones among them, and things that are not.
fn direction() -> impl Strategy<Value = DVec3> {
    prop_oneof![
        3 => (0.0..1.0f64, 0.0..7.0f64, 0..3u8).prop_map(|(z, phi, power)| {
            let z = z.powi([1, 8, 200][usize::from(power)]);
            let radius = ((1.0 - z) * (1.0 + z)).sqrt();
            DVec3::new(radius * phi.cos(), radius * phi.sin(), z)
        }),
        1 => (number(), number(), number()).prop_map(|(x, y, z)| DVec3::new(x, y, z)),
    ]
}

fn lobe() -> impl Strategy<Value = Ward> {
    (0..4usize, 0.0..1.0f64, 0.0..1.0f64, any::<bool>()).prop_map(|(variant, a, b, round)| {
        let [x, y] = [a, b].map(|u| MIN_SIGMA.powf(u).clamp(MIN_SIGMA, 1.0));
        let variant = Variant::ALL[variant];
        if round || variant == Variant::RadianceSampled {
            Ward::isotropic(variant, x).unwrap()
        } else {
            Ward::anisotropic(variant, x, y).unwrap()
        }
    })
}

proptest! {
    #[test]
    fn no_finite_input_gives_a_nan(lobe in lobe(), view in direction(), light in direction(), u in number(), v in number()) {
        let value = lobe.evaluate(view, light);
        prop_assert!(value.is_finite() && value >= 0.0, "lobe {value}");
        let pdf = lobe.pdf(view, light);
        prop_assert!(pdf.is_finite() && pdf >= 0.0, "pdf {pdf}");
        let mut batch = [0.0; 3];
        lobe.evaluate_batch(view, &[light, DVec3::Z, light], &mut batch).unwrap();
        prop_assert!(batch.iter().all(|value| value.is_finite() && *value >= 0.0), "batch {batch:?}");
        prop_assert!((batch[0] - value).abs() <= 1e-12 * value + 1e-200, "{value} {batch:?}");
        let sample = lobe.sample(view, [u, v]);
        prop_assert!(sample.weight.is_finite() && sample.weight >= 0.0, "weight {}", sample.weight);
        if sample.weight > 0.0 {
            prop_assert!(sample.light.z > 0.0 && (sample.light.length() - 1.0).abs() < 1e-6, "{}", sample.light);
        }
    }

    #[test]
    fn any_sigma_is_a_lobe_or_an_error(sigma in number(), other in number()) {
        let fits = |sigma: f64| (MIN_SIGMA..=1.0).contains(&sigma);
        for variant in Variant::ALL {
            prop_assert_eq!(Ward::isotropic(variant, sigma).is_ok(), fits(sigma));
            let two = Ward::anisotropic(variant, sigma, other).is_ok();
            prop_assert_eq!(two, fits(sigma) && fits(other) && (variant != Variant::RadianceSampled || sigma == other));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn integrals_are_finite_for_any_view(variant in 0..4usize, sigma in 0.02..1.0f64, power in 0..3u8, z in 0.0..1.0f64) {
        let cosine = z.powi([1, 8, 200][usize::from(power)]);
        let lobe = Ward::isotropic(Variant::ALL[variant], sigma).unwrap();
        let (albedo, share) = (lobe.albedo(cosine), lobe.share_above_horizon(cosine));
        prop_assert!(albedo.is_finite() && albedo >= 0.0, "{albedo}");
        prop_assert!((0.0..=1.0 + 1e-14).contains(&share), "{share}");
        if let Ok(zonal) = lobe.zonal(cosine, 8) {
            prop_assert!(zonal.iter().all(|b| b.is_finite() && b.abs() <= zonal[0] * (1.0 + 1e-12)), "{zonal:?}");
            prop_assert!((zonal[0] - albedo).abs() < 1e-11 * albedo, "{} {albedo}", zonal[0]);
        }
    }
}
