//! Light that was read off balls of known reflectance, and known shapes.

use lobes::Parallelism;
use lobes::illumination::builtin;
use lobes_experiments::{KNOWN_BALLS, light_of_known_balls, prior_chi_square, shape_roughness};

/// The irradiance at the normals that the camera sees is that of the map.
#[test]
fn the_irradiance_of_captured_light_is_read() {
    let maps = builtin().unwrap();
    let maps = [maps[1].clone(), maps[9].clone()];
    let all = light_of_known_balls(&maps, &KNOWN_BALLS, Parallelism::Rayon, &|| ()).unwrap();
    for ((ball, of_maps), allowed) in KNOWN_BALLS.iter().zip(&all).zip([0.005, 0.01, 0.01, 0.01]) {
        for (map, of) in maps.iter().zip(of_maps) {
            let off = of.irradiance;
            assert!(off < allowed, "{} under {}: {off}", ball.name, map.name());
        }
    }
}

/// Draws of the model's own prior lie within their deviations, by the bar of
/// `docs/reference/light-table.md`. The coefficients of one draw hang together by their lamps; were
/// they one number, the mean of 1000 squares would have a deviation of √(2/1000) = 0.045, and right
/// code would miss the bar with one ball in forty seeds at most.
#[test]
fn the_light_of_the_prior_is_held() {
    for ball in &KNOWN_BALLS {
        let square = prior_chi_square(ball, 1000, Parallelism::Rayon).unwrap();
        assert!((square - 1.0).abs() < 0.1, "{}: {square}", ball.name);
    }
}

/// σ of shapes beside σ of a ball under the same light.
#[test]
fn the_roughness_of_shapes_is_read() {
    let maps = builtin().unwrap();
    let maps = [&maps[1], &maps[7], &maps[13]].map(Clone::clone);
    let found = shape_roughness(&maps, Parallelism::Rayon, &|| ()).unwrap();
    let median = |errors: &[f64]| {
        let mut errors = errors.to_vec();
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    let [balls, shapes, parts] = [&found.balls, &found.shapes, &found.parts].map(|of| median(of));
    println!("σ off by {shapes:.3} of shapes, {balls:.3} of balls, {parts:.3} of hills (medians)");
    assert!(shapes < 0.12 && balls < 0.12 && parts < 0.4);
}
