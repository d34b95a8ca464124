//! Which directions a lobe is evaluated for.

use glam::DVec3;

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
pub(super) fn unit(direction: DVec3) -> bool {
    (direction.length_squared() - 1.0).abs() <= UNIT_TOLERANCE
}
