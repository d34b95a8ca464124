//! Environment maps: the interpolant, its integral, and the maps that come with the library.

use approx::assert_abs_diff_eq;
use std::f64::consts::PI;

use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, LightSpectrum, Luminance};
use lobes::{Error, Parallelism};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn random_map(height: usize, seed: u64) -> EnvironmentMap {
    let mut random = Pcg64::seed_from_u64(seed);
    let pixels = (0..2 * height * height)
        .map(|_| std::array::from_fn(|_| random.random::<f64>()))
        .collect();
    EnvironmentMap::new("random", 2 * height, height, pixels).unwrap()
}

fn polar(theta: f64, azimuth: f64) -> DVec3 {
    DVec3::new(
        theta.sin() * azimuth.sin(),
        theta.cos(),
        -theta.sin() * azimuth.cos(),
    )
}

#[test]
fn the_function_passes_through_the_pixels() {
    let map = random_map(16, 1);
    for row in 0..16 {
        for column in 0..32 {
            let (seen, stored) = (
                map.radiance(map.direction(row, column)),
                map.pixel(row, column),
            );
            for channel in 0..3 {
                assert_abs_diff_eq!(seen[channel], stored[channel], epsilon = 1e-13);
            }
        }
    }
}

#[test]
fn directions_are_where_the_conventions_put_them() {
    let map = random_map(64, 2);
    // The four pixels round the middle of the picture surround −z.
    let ahead = map.direction(31, 63)
        + map.direction(31, 64)
        + map.direction(32, 63)
        + map.direction(32, 64);
    assert!((ahead.normalize() - DVec3::NEG_Z).length() < 1e-15);
    assert!(map.direction(31, 70).x > 0.0, "+x is to the right of −z");
    assert!(map.direction(0, 0).y > 0.99, "row 0 is the zenith");
    // In the harmonic frame, φ = 2π(1 − (j + ½)/n).
    for column in [0, 1, 40, 64, 100, 127] {
        let harmonic = lobes::sphere::to_harmonic(map.direction(20, column));
        let phi = harmonic.y.atan2(harmonic.x).rem_euclid(2.0 * PI);
        assert_abs_diff_eq!(
            phi,
            2.0 * PI * (1.0 - (column as f64 + 0.5) / 128.0),
            epsilon = 1e-14
        );
    }
}

#[test]
fn the_function_is_continuous_across_the_seam_and_the_poles() {
    let map = random_map(16, 3);
    let near = |a: DVec3, b: DVec3| {
        let (a, b) = (map.radiance(a), map.radiance(b));
        (0..3).all(|c| (a[c] - b[c]).abs() < 1e-8)
    };
    for step in 0..50 {
        let theta = PI * (step as f64 + 0.5) / 50.0;
        assert!(near(polar(theta, PI - 1e-10), polar(theta, -PI + 1e-10)));
        let azimuth = 2.0 * PI * step as f64 / 50.0;
        for pole in [0.0, PI] {
            let (here, there) = (polar(pole + 1e-10, azimuth), polar(pole - 1e-10, azimuth));
            assert!(near(here, there), "along a great circle over the pole");
        }
    }
}

/// The interpolant again, by its definition and nothing else: hat functions over a grid that is
/// laid out beyond the poles and round the seam.
fn defined(map: &EnvironmentMap, theta: f64, azimuth: f64) -> [f64; 3] {
    let (w, h) = (map.width() as i64, map.height() as i64);
    let mut sum = [0.0; 3];
    for row in -1..=h {
        let fy = 1.0 - (theta / PI * h as f64 - (row as f64 + 0.5)).abs();
        for column in -w..2 * w {
            let fx = 1.0 - ((azimuth / (2.0 * PI) + 0.5) * w as f64 - (column as f64 + 0.5)).abs();
            if fx > 0.0 && fy > 0.0 {
                let turn = if row < 0 || row == h { w / 2 } else { 0 };
                let pixel = map.pixel(
                    row.clamp(0, h - 1) as usize,
                    (column + turn).rem_euclid(w) as usize,
                );
                for channel in 0..3 {
                    sum[channel] += fx * fy * pixel[channel];
                }
            }
        }
    }
    sum
}

proptest! {
    #[test]
    fn the_function_is_bilinear(theta in 0.0..PI, azimuth in -PI..PI) {
        let map = random_map(8, 4);
        let (got, expected) = (map.radiance(polar(theta, azimuth)), defined(&map, theta, azimuth));
        for channel in 0..3 {
            prop_assert!((got[channel] - expected[channel]).abs() < 1e-13);
        }
    }
}

#[test]
fn the_mean_is_that_of_the_function() {
    // Gauss–Legendre over each piece of the function; between the kinks it is smooth.
    let map = random_map(8, 5);
    let nodes = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.538_469_310_105_683, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let step = PI / 16.0;
    let mut sum = [0.0; 3];
    for half_row in 0..16 {
        for half_column in 0..32 {
            for (y, wy) in nodes {
                let theta = step * (half_row as f64 + 0.5 + 0.5 * y);
                for (x, wx) in nodes {
                    let azimuth = step * (half_column as f64 + 0.5 + 0.5 * x) - PI;
                    let seen = map.radiance(polar(theta, azimuth));
                    for channel in 0..3 {
                        sum[channel] += 0.25 * step * step * wx * wy * theta.sin() * seen[channel];
                    }
                }
            }
        }
    }
    for (channel, total) in sum.into_iter().enumerate() {
        assert_abs_diff_eq!(map.mean()[channel], total / (4.0 * PI), epsilon = 1e-12);
    }
}

#[test]
fn bad_maps_are_refused_in_one_sentence() {
    let grey = |count: usize| vec![[0.5; 3]; count];
    let refused =
        |width, height, pixels| EnvironmentMap::new("m", width, height, pixels).unwrap_err();
    assert_eq!(
        refused(6, 4, grey(24)).to_string(),
        "the width over the height of an environment map is 1.5, which is not 2, as a latitude-longitude map has it"
    );
    assert!(matches!(refused(2, 1, grey(2)), Error::Domain { .. }));
    assert!(matches!(refused(0, 0, grey(0)), Error::Domain { .. }));
    assert!(matches!(refused(8, 4, grey(31)), Error::Length { .. }));
    for (value, expected) in [
        (
            f64::NAN,
            "the environment map holds NaN at index 16; every value must be finite",
        ),
        (
            f64::INFINITY,
            "the environment map holds inf at index 16; every value must be finite",
        ),
    ] {
        let mut pixels = grey(32);
        pixels[5][1] = value;
        assert_eq!(refused(8, 4, pixels).to_string(), expected);
    }
    let mut pixels = grey(32);
    pixels[5][1] = -1e-3;
    let negative = refused(8, 4, pixels).to_string();
    assert!(
        negative.contains("is -0.001, which is not zero or above"),
        "{negative}"
    );
    let black = refused(8, 4, vec![[0.0; 3]; 32]).to_string();
    assert!(black.contains("must hold some light"), "{black}");
}

#[test]
fn weights_of_luminance_sum_to_one() {
    for weights in [Luminance::Rec709, Luminance::Radiance] {
        assert_abs_diff_eq!(weights.weights().iter().sum::<f64>(), 1.0, epsilon = 1e-9);
    }
}

/// What the library holds is what the script wrote: the sums in the provenance were taken by it, in
/// Python, from the same pixels.
#[cfg(feature = "builtin")]
#[test]
fn the_builtin_maps_are_those_of_the_provenance() {
    let provenance: serde_json::Value =
        serde_json::from_str(include_str!("../../data/illuminations/PROVENANCE.json")).unwrap();
    let records = provenance["maps"].as_array().unwrap();
    let maps = lobes::illumination::builtin().unwrap();
    assert!(maps.is_sorted_by(|a, b| a.name() < b.name()));
    assert_eq!(maps.len(), records.len());
    for map in &maps {
        let file = format!("{}.exr", map.name());
        let record = records
            .iter()
            .find(|record| record["file"] == file.as_str())
            .unwrap();
        assert_eq!((map.width(), map.height()), (512, 256));
        let values = map.pixels().as_flattened().iter().copied();
        assert_eq!(record["maximum"], values.fold(0.0, f64::max));
        let sum: f64 = (0..256)
            .map(|row| {
                let pixels = (0..512).flat_map(|column| map.pixel(row, column));
                map.solid_angle(row) * pixels.sum::<f64>()
            })
            .sum();
        let mean = sum / (12.0 * PI);
        assert!(
            (mean / record["mean"].as_f64().unwrap() - 1.0).abs() < 1e-5,
            "{file}"
        );
        // The function gives the first row 13/12 of its pixels' solid angle, and the rows between a
        // little less: a map that is bright at the zenith differs most, by 4e-4.
        let smooth = map.mean().iter().sum::<f64>() / 3.0;
        assert!(
            (smooth / mean - 1.0).abs() < 1e-3,
            "{file}: {smooth} {mean}"
        );
    }
}

/// A lamp in the dark, of less than what is clipped: all of its light is, and nothing is left to
/// fit a law to.
#[test]
fn a_lamp_alone_has_no_clipped_law() {
    for around in [0.0, 1.0] {
        let mut pixels = vec![[around; 3]; 64 * 32];
        pixels[10 * 64 + 20] = [1e4; 3];
        let map = EnvironmentMap::new("lamp", 64, 32, pixels).unwrap();
        let spectrum = LightSpectrum::of(&map, 16, Parallelism::Sequential).unwrap();
        assert_eq!(spectrum.clipped_eta, None);
        // A point has as much average power at every degree: η = −2.
        assert!((spectrum.law.eta + 2.0).abs() < 0.1, "{}", spectrum.law.eta);
    }
}
