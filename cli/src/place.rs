//! Where a camera stands.

use lobes::glam::DVec3;
use lobes::reflection::Camera;
use lobes::{Error, Result};
use serde::{Deserialize, Serialize};

/// Where a camera stands: angles in degrees, and the distance in radii of the sphere.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Place {
    pub(crate) elevation: f64,
    /// 0 looks along −z, and it grows to the left.
    pub(crate) azimuth: f64,
    /// Anticlockwise, as seen by whoever looks through the camera.
    pub(crate) roll: f64,
    /// Orthographic without it.
    pub(crate) distance: Option<f64>,
}

impl Place {
    pub(crate) fn camera(&self) -> Result<Camera> {
        for (what, value) in [
            ("the camera's elevation", self.elevation),
            ("the camera's azimuth", self.azimuth),
            ("the camera's roll", self.roll),
        ] {
            if !value.is_finite() {
                return Err(Error::Domain {
                    what,
                    value,
                    allowed: "a finite angle",
                });
            }
        }
        let (sin_elevation, cos_elevation) = self.elevation.to_radians().sin_cos();
        let (sin_azimuth, cos_azimuth) = self.azimuth.to_radians().sin_cos();
        let towards = DVec3::new(
            cos_elevation * sin_azimuth,
            sin_elevation,
            cos_elevation * cos_azimuth,
        );
        let camera = match self.distance {
            None => Camera::orthographic(towards, DVec3::Y),
            Some(distance) => Camera::perspective(towards, DVec3::Y, distance),
        }?;
        Ok(camera.rolled(self.roll.to_radians()))
    }
}
