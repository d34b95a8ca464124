//! The renderer where the answer is known exactly, or from the reference: band-limited light,
//! averaged pixels, bad input.

use lobes::glam::DVec3;
use lobes::harmonics::{Coefficients, evaluate};
use lobes::illumination::EnvironmentMap;
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Operator, Renderer, Settings, ShadingPoint, Viewpoint, reference};
use lobes::sphere::{from_harmonic, to_harmonic};
use lobes::{Error, Parallelism};
use rand::{RngExt, SeedableRng};

const ONE: Parallelism = Parallelism::Sequential;

/// Light of degree 5 about a mean, in the harmonic frame.
fn smooth_light(seed: u64) -> Coefficients {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut light = Coefficients::zeros(5);
    for value in light.as_mut_slice() {
        *value = 0.15 * (random.random::<f64>() - 0.5);
    }
    light.set(0, 0, 3.0).unwrap();
    light
}

/// Light as a map of 256 rows.
fn map_of(light: &Coefficients) -> EnvironmentMap {
    let blank = EnvironmentMap::new("blank", 512, 256, vec![[1.0; 3]; 512 * 256]).unwrap();
    let basis = lobes::harmonics::Basis::new(light.degree()).unwrap();
    let directions: Vec<DVec3> = (0..512 * 256)
        .map(|index| to_harmonic(blank.direction(index / 512, index % 512)))
        .collect();
    let mut values = vec![0.0; directions.len()];
    basis.sums(light, &directions, &mut values, ONE).unwrap();
    let pixels = values
        .iter()
        .map(|&value| [value, 0.5 * value, 2.0 * value]);
    EnvironmentMap::new("smooth", 512, 256, pixels.collect()).unwrap()
}

#[test]
fn band_limited_light_gives_what_the_operator_says() {
    let light = smooth_light(3);
    let map = map_of(&light);
    let renderer = Renderer::new(&map, ONE).unwrap();
    let (rings, columns) = ([0.05, 0.4, 0.8, 1.2, 1.45], 12);
    // The camera is over the zenith, the harmonic frame's pole.
    let points: Vec<ShadingPoint> = rings
        .iter()
        .flat_map(|ring: &f64| {
            (0..columns).map(move |column| {
                let (sin, cos) = (std::f64::consts::TAU * column as f64 / columns as f64).sin_cos();
                let normal = DVec3::new(ring.sin() * cos, ring.sin() * sin, ring.cos());
                ShadingPoint {
                    normal: from_harmonic(normal),
                    view: DVec3::Y,
                }
            })
        })
        .collect();
    for variant in Variant::ALL {
        for sigma in [0.02, 0.1, 0.3] {
            let operator =
                Operator::new(variant, sigma, Viewpoint::Orthographic, &rings, 5, ONE).unwrap();
            let want = operator.forward(&light, 0.3, 0.6, columns).unwrap();
            let material = Material::from_albedos("m", [0.3; 3], [0.6; 3], sigma).unwrap();
            let (got, error) = renderer
                .radiance(&material, variant, &points, 1e-3, ONE)
                .unwrap();
            assert!(error <= 1e-3);
            for ((got, want), point) in got.iter().zip(&want).zip(&points) {
                for (channel, share) in [1.0, 0.5, 2.0].into_iter().enumerate() {
                    // The map is bilinear between its pixels: up to (lh)²/12 = 3·10⁻⁴ of what is
                    // not constant.
                    let off = (got[channel] / (share * want) - 1.0).abs();
                    assert!(
                        off < 1.05e-3,
                        "{variant} σ {sigma} {point:?}: off by {off:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_map_of_the_test_is_the_light() {
    let light = smooth_light(3);
    let map = map_of(&light);
    let at = map.direction(40, 77);
    let want = evaluate(&light, to_harmonic(at)).unwrap();
    assert!((map.radiance(at)[0] - want).abs() < 1e-12);
}

#[test]
fn an_averaged_pixel_is_the_mean_of_the_reference_over_its_points() {
    let pixels = (0..32 * 16)
        .map(|index| [1.0 + (index % 7) as f64, 2.0, 0.5 + (index % 3) as f64])
        .collect();
    let map = EnvironmentMap::new("small", 32, 16, pixels).unwrap();
    let renderer = Renderer::new(&map, ONE).unwrap();
    let camera = Camera::perspective(DVec3::new(0.4, 0.7, 0.5), DVec3::Y, 2.5).unwrap();
    let material = Material::from_albedos("m", [0.2; 3], [0.7; 3], 0.05).unwrap();
    let (size, samples) = (5, 3);
    let settings = Settings {
        size,
        pixel_samples: samples,
        tolerance: 1e-3,
    };
    let lobe = Variant::RadianceSampled;
    let rendering = renderer
        .render(&material, lobe, &camera, &settings, ONE)
        .unwrap();
    for (row, column) in [(2, 2), (0, 2), (3, 4), (1, 1)] {
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for index in 0..samples * samples {
            let (row, column) = (
                row * samples + index / samples,
                column * samples + index % samples,
            );
            if let Some(ShadingPoint { normal, view }) = camera.pixel(size * samples, row, column) {
                let seen = reference(&map, &material, lobe, normal, view, 1e-5).unwrap();
                for channel in 0..3 {
                    sum[channel] += seen.value[channel];
                }
                count += 1.0;
            }
        }
        let got = rendering.image.get(row, column).unwrap();
        for channel in 0..3 {
            let want = sum[channel] / count;
            assert!(
                (got[channel] - want).abs() < 1e-3 * want,
                "({row}, {column}): {} for {want}",
                got[channel]
            );
        }
    }
}

#[test]
fn maps_that_hold_no_light_are_refused() {
    let with = |value: f64| {
        let mut pixels = vec![[1.0; 3]; 8 * 4];
        pixels[5][1] = value;
        EnvironmentMap::new("bad", 8, 4, pixels)
    };
    assert!(matches!(with(f64::NAN), Err(Error::NotFinite { .. })));
    assert!(matches!(with(f64::INFINITY), Err(Error::NotFinite { .. })));
    assert!(matches!(with(-1.0), Err(Error::Domain { .. })));
}

#[test]
fn cameras_inside_the_sphere_or_without_a_field_of_view_are_refused_in_a_sentence() {
    for (camera, word) in [
        (
            Camera::perspective(DVec3::Z, DVec3::Y, 0.5),
            "outside the sphere",
        ),
        (
            Camera::perspective(DVec3::Z, DVec3::Y, 1.0),
            "outside the sphere",
        ),
        (Camera::filling(DVec3::Z, DVec3::Y, 0.0), "field of view"),
        (
            Camera::filling(DVec3::Z, DVec3::Y, f64::NAN),
            "field of view",
        ),
        (Camera::orthographic(DVec3::Y, 2.0 * DVec3::Y), "up vector"),
        (Camera::orthographic(DVec3::Z, DVec3::ZERO), "up vector"),
    ] {
        let message = camera.unwrap_err().to_string();
        assert!(message.contains(word), "no {word:?} in {message:?}");
    }
}

#[test]
fn a_tolerance_that_is_not_met_says_how_close_it_came() {
    // A view 0.01° from grazing, of pixels that have nothing to do with their neighbours: a lobe as
    // slim as that no grid resolves.
    let mut random = rand_pcg::Pcg64::seed_from_u64(11);
    let pixels = (0..512 * 256)
        .map(|_| [(7.0 * random.random::<f64>().powi(4)).exp(); 3])
        .collect();
    let map = EnvironmentMap::new("rough", 512, 256, pixels).unwrap();
    let renderer = Renderer::new(&map, ONE).unwrap();
    let material = Material::from_albedos("m", [0.0; 3], [1.0; 3], 0.1).unwrap();
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let points: Vec<ShadingPoint> = (0..3)
        .map(|index| camera.shading_point(1.5706, f64::from(index)))
        .collect();
    let render =
        |tolerance: f64| renderer.radiance(&material, Variant::Ward1992, &points, tolerance, ONE);
    let Err(Error::Tolerance { asked, reached, .. }) = render(1e-5) else {
        panic!("it was met");
    };
    assert_eq!(asked, 1e-5);
    assert!(reached > asked && reached <= 1.0, "{reached:e}");
}
