//! Spheres to learn from, each seen from all round.

use std::f64::consts::TAU;

use glam::DVec3;

use super::protocol::{Dataset, MIRROR_PIXEL_SAMPLES, Observation};
use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflectance::{Material, Roughness, Variant};
use crate::reflection::{Camera, Renderer, Settings};
use crate::{Error, Parallelism, Result};

/// Each material under each illumination, seen orthographically from `turns` directions evenly spaced about the vertical,
/// the first towards +z, all `elevation` radians above the horizon.
///
/// Every picture is divided by the mean luminance of a white sphere in the same light from the same side. An elevation of
/// 0 is the view of the paper's protocol, whose averaging of mirrors over [`MIRROR_PIXEL_SAMPLES`] is kept, π/4 that of the tilted one. Observations come by illumination, then by turn,
/// then by material; those of the first turn alone are a data set to judge.
///
/// # Errors
/// [`Error::Unanswerable`] without an illumination, a material or a turn; [`Error::Domain`] for an elevation that is not
/// inside (−π/2, π/2); and what the renderer finds wrong.
pub fn turned_dataset(
    illuminations: &[EnvironmentMap],
    materials: &[Material],
    variant: Variant,
    elevation: f64,
    turns: usize,
    settings: &Settings,
    parallelism: Parallelism,
) -> Result<Dataset> {
    if illuminations.is_empty() || materials.is_empty() || turns == 0 {
        return Err(Error::Unanswerable(
            "a data set needs an illumination, a material and a turn, or more of each".into(),
        ));
    }
    if elevation.is_nan() || elevation.abs() >= TAU / 4.0 {
        return Err(Error::Domain {
            what: "the camera's elevation in radians",
            value: elevation,
            allowed: "between −π/2 and π/2, both excluded",
        });
    }
    let (sin, cos) = elevation.sin_cos();
    let cameras = (0..turns)
        .map(|turn| {
            let azimuth = TAU * turn as f64 / turns as f64;
            let towards = DVec3::new(azimuth.sin() * cos, sin, azimuth.cos() * cos);
            Camera::orthographic(towards, DVec3::Y)
        })
        .collect::<Result<Vec<_>>>()?;
    let groups = parallelism.map(illuminations.len(), |illumination| {
        let one = Parallelism::Sequential;
        let renderer = Renderer::new(&illuminations[illumination], one)?;
        let mut observations = Vec::with_capacity(turns * materials.len());
        let mut error = 0.0f64;
        for camera in &cameras {
            let white = renderer.render(&Material::white(), variant, camera, settings, one)?;
            let scale = 1.0 / Luminance::Rec709.of(white.image.mean());
            error = error.max(white.error);
            for (material, parameters) in materials.iter().enumerate() {
                let settings = Settings {
                    pixel_samples: match parameters.roughness() {
                        Roughness::Mirror if !parameters.is_matte() => {
                            settings.pixel_samples.max(MIRROR_PIXEL_SAMPLES)
                        }
                        _ => settings.pixel_samples,
                    },
                    ..*settings
                };
                let rendering = renderer.render(parameters, variant, camera, &settings, one)?;
                error = error.max(rendering.error);
                observations.push(Observation {
                    material,
                    illumination,
                    image: rendering.image.map(|rgb| rgb.map(|value| value * scale)),
                });
            }
        }
        Ok((observations, error))
    });
    Dataset::gather(materials, illuminations, groups)
}
