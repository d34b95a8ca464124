//! How near a map from photographs of a mirror ball comes to the light about it: one simulated
//! bracket under each of the first built-in maps, two of them unless another number is given.
//!
//! `cargo run --release --example probe_accuracy -- 17` prints what docs/how-to/probe.md says. The
//! photographs are traced rays: a ball that reflects 70 %, 5 to 50 radii from the camera, before the
//! map itself; five exposures three stops apart, noise of 10 000 electrons, 8 bits; exposures told to
//! 5 %.

use lobes::evaluation::LightErrors;
use lobes::files::srgb_of_linear;
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, Luminance, builtin};
use lobes::picture::{Circle, Picture, normal};
use lobes::probe::{Bracket, MirrorBall, refine};
use lobes::{Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const REFLECTANCE: f64 = 0.7;
const MANY: Parallelism = Parallelism::Rayon;

/// What a camera sees, by rays: 3 × 3 a pixel.
fn trace(map: &EnvironmentMap, width: usize, circle: Circle, distance: f64) -> Vec<[f64; 3]> {
    let focal = circle.radius * (distance * distance - 1.0).sqrt();
    MANY.map(width * width, |i| {
        let mut sum = [0.0; 3];
        for k in 0..9 {
            let x = (i % width) as f64 + ((k % 3) as f64 + 0.5) / 3.0;
            let y = (i / width) as f64 + ((k / 3) as f64 + 0.5) / 3.0;
            let ray = DVec3::new((x - circle.x) / focal, (circle.y - y) / focal, -1.0).normalize();
            let origin = DVec3::new(0.0, 0.0, distance);
            let half = origin.dot(ray);
            let root = half * half - (distance * distance - 1.0);
            let value = if root > 0.0 {
                let at = origin + ray * (-half - root.sqrt());
                let light = map.radiance(ray - 2.0 * ray.dot(at) * at);
                light.map(|value| REFLECTANCE * value)
            } else {
                map.radiance(ray)
            };
            sum = std::array::from_fn(|c| sum[c] + value[c] / 9.0);
        }
        sum
    })
}

fn shoot(seen: &[[f64; 3]], width: usize, exposure: f64, rng: &mut Pcg64) -> Result<Picture> {
    let codes = seen.iter().map(|pixel| {
        pixel.map(|value| {
            let light = exposure * value;
            let deviation = (light / 1e4 + 1e-6).sqrt();
            let taken = (light + deviation * normal(rng)).clamp(0.0, 1.0);
            (255.0 * srgb_of_linear(taken)).round() / 255.0
        })
    });
    Picture::encoded(width, width, codes.collect())
}

fn row(name: &str, errors: &mut [f64], bar: f64) {
    errors.sort_by(f64::total_cmp);
    let (count, within) = (errors.len(), errors.iter().filter(|e| **e <= bar).count());
    if count > 0 {
        println!(
            "| {name} | {:.4} | {:.4} | {within} of {count} within {bar} |",
            errors[count / 2],
            errors[count * 95 / 100]
        );
    }
}

fn main() -> Result<()> {
    let mut rng = Pcg64::seed_from_u64(5);
    let mut radius_errors = Vec::new();
    let mut ratios = Vec::new();
    // Of the circle that was found, and of the true one.
    let (mut irradiance, mut sun) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let mut missed = 0;
    let asked = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let maps: Vec<_> = builtin()?.into_iter().take(asked.unwrap_or(2)).collect();
    for map in &maps {
        let distance = 5.0 * 10f64.powf(rng.random::<f64>());
        let radius = 90.0 + 70.0 * rng.random::<f64>();
        let width = (2.7 * radius) as usize;
        let mut place = || 0.5 * width as f64 + 8.0 * (rng.random::<f64>() - 0.5);
        let truth = Circle {
            x: place(),
            y: place(),
            radius,
        };
        let seen = trace(map, width, truth, distance);
        let mean = REFLECTANCE * Luminance::Rec709.of(map.mean());
        let exposures = [0.4, 0.05, 0.006, 8e-4, 1e-4].map(|exposure| exposure / mean);
        let mut pictures = Vec::new();
        for exposure in exposures {
            pictures.push(shoot(&seen, width, exposure, &mut rng)?);
        }
        let told = exposures.map(|e| Some(e * (1.0 + 0.1 * (rng.random::<f64>() - 0.5))));
        let names = (0..5).map(|i| i.to_string()).collect();
        let bracket = Bracket::new(pictures, names, told.to_vec())?;
        let merged = bracket.merge(Some(truth))?;
        for i in 0..4 {
            let ratio = merged.exposures[i] / merged.exposures[i + 1];
            let error = (ratio * exposures[i + 1] / exposures[i] - 1.0).abs();
            ratios.extend(error.is_finite().then_some(error));
        }
        let found = bracket.middle().circle().ok();
        let found = found.map(|circle| refine(&merged, circle));
        missed += usize::from(found.is_none());
        radius_errors.extend(found.map(|circle| (circle.radius / radius - 1.0).abs()));
        for (i, circle) in [found, Some(truth)].into_iter().enumerate() {
            let Some(circle) = circle else { continue };
            let ball = MirrorBall {
                circle,
                distance: Some(distance),
                reflectance: [REFLECTANCE; 3],
                photographer: 0.0,
            };
            let mut probe = ball.unwrap(&merged, None, 96, MANY)?;
            let scale = merged.exposures[0] / exposures[0];
            for pixel in &mut probe.pixels {
                *pixel = pixel.map(|value| scale * value);
            }
            let errors = LightErrors::between(map, &probe.environment(map.name())?, MANY)?;
            irradiance[i].push(errors.irradiance);
            sun[i].push(errors.sun_direction);
        }
    }
    println!("| error | median | 95 % | bar |\n| --- | ---: | ---: | --- |");
    row("ratio of neighbouring exposures", &mut ratios, 0.01);
    row("radius, found", &mut radius_errors, 0.003);
    row("irradiance, circle found", &mut irradiance[0], 0.02);
    row("irradiance, circle given", &mut irradiance[1], 0.02);
    row("sun's direction in degrees, circle found", &mut sun[0], 0.5);
    row("sun's direction in degrees, circle given", &mut sun[1], 0.5);
    println!("\n{missed} of {} balls were not found.", maps.len());
    Ok(())
}
