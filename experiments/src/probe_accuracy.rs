//! How near a map from photographs of a mirror ball comes to the light about it.

use lobes::evaluation::LightErrors;
use lobes::files::srgb_of_linear;
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, Luminance};
use lobes::picture::{Circle, Picture, normal};
use lobes::probe::{Bracket, MirrorBall, refine};
use lobes::{Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const REFLECTANCE: f64 = 0.7;

/// The errors of simulated brackets, one of each map.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProbeAccuracy {
    /// The relative error of ratios of neighbouring exposures.
    pub ratios: Vec<f64>,
    /// That of the radius of the circle that is found.
    pub radius: Vec<f64>,
    /// That of the irradiance, of the circle that is found and of the true one.
    pub irradiance: [Vec<f64>; 2],
    /// The sun's direction in degrees, of the same.
    pub sun: [Vec<f64>; 2],
    /// How many balls were not found.
    pub missed: usize,
}

/// What a camera sees, by rays: 3 × 3 a pixel.
fn trace(
    map: &EnvironmentMap,
    width: usize,
    circle: Circle,
    distance: f64,
    parallelism: Parallelism,
) -> Vec<[f64; 3]> {
    let focal = circle.radius * (distance * distance - 1.0).sqrt();
    parallelism.map(width * width, |i| {
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

/// Photographs a mirror ball under each map, and makes a map of the photographs.
///
/// The photographs are traced rays: a ball that reflects 70 %, 5 to 50 radii from the camera, before
/// the map itself; five exposures three stops apart, noise of 10 000 electrons, 8 bits; exposures told
/// to 5 %.
///
/// # Errors
/// What the readers refuse.
pub fn probe_accuracy(
    maps: &[EnvironmentMap],
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<ProbeAccuracy> {
    let mut rng = Pcg64::seed_from_u64(5);
    let mut all = ProbeAccuracy::default();
    for map in maps {
        let distance = 5.0 * 10f64.powf(rng.random::<f64>());
        let radius = 90.0 + 70.0 * rng.random::<f64>();
        let width = (2.7 * radius) as usize;
        let mut place = || 0.5 * width as f64 + 8.0 * (rng.random::<f64>() - 0.5);
        let truth = Circle {
            x: place(),
            y: place(),
            radius,
        };
        let seen = trace(map, width, truth, distance, parallelism);
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
            all.ratios.extend(error.is_finite().then_some(error));
        }
        let found = bracket.middle().circle().ok();
        let found = found.map(|circle| refine(&merged, circle));
        all.missed += usize::from(found.is_none());
        all.radius
            .extend(found.map(|circle| (circle.radius / radius - 1.0).abs()));
        for (i, circle) in [found, Some(truth)].into_iter().enumerate() {
            let Some(circle) = circle else { continue };
            let ball = MirrorBall {
                circle,
                distance: Some(distance),
                reflectance: [REFLECTANCE; 3],
                photographer: 0.0,
            };
            let mut probe = ball.unwrap(&merged, None, 96, parallelism)?;
            let scale = merged.exposures[0] / exposures[0];
            for pixel in &mut probe.pixels {
                *pixel = pixel.map(|value| scale * value);
            }
            let errors = LightErrors::between(map, &probe.environment(map.name())?, parallelism)?;
            all.irradiance[i].push(errors.irradiance);
            all.sun[i].push(errors.sun_direction);
        }
        done();
    }
    Ok(all)
}
