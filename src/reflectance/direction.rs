//! Which directions a lobe is evaluated for.

use glam::DVec3;

use crate::{Error, Result};

/// A direction whose cosine with the normal is not larger than this counts as below the horizon,
/// where every lobe is 0.
///
/// Above it no lobe overflows, so no finite input gives a NaN or an infinity.
pub const HORIZON: f64 = 1e-100;

/// How far from 1 the squared length of a direction may be.
pub(super) const UNIT_TOLERANCE: f64 = 1e-6;

/// Whether a direction is of unit length and above the horizon; false for anything that is not
/// finite.
pub(super) fn visible(direction: DVec3) -> bool {
    direction.z > HORIZON && unit(direction)
}

/// Whether a direction is of unit length; false for anything that is not finite.
fn unit(direction: DVec3) -> bool {
    (direction.length_squared() - 1.0).abs() <= UNIT_TOLERANCE
}

/// Checks that a view and its lights are of unit length.
pub(super) fn check_unit(view: DVec3, lights: &[DVec3]) -> Result<()> {
    match std::iter::once(&view).chain(lights).find(|d| !unit(**d)) {
        None => Ok(()),
        Some(direction) => Err(Error::Domain {
            what: "the length of a direction",
            value: direction.length(),
            allowed: "1 to within 5e-7; divide the direction by its length",
        }),
    }
}
