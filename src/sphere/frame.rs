//! Frames: the world's, the harmonics', and a surface's own.

use glam::DVec3;

/// The world direction (y up) in the harmonic frame (pole on +z): `(x, y, z) → (z, x, y)`.
///
/// A cyclic permutation, so a rotation and exact.
///
/// ```
/// use lobes::{glam::DVec3, sphere};
/// assert_eq!(sphere::to_harmonic(DVec3::Y), DVec3::Z);
/// ```
pub fn to_harmonic(world: DVec3) -> DVec3 {
    DVec3::new(world.z, world.x, world.y)
}

/// The inverse of [`to_harmonic`].
///
/// ```
/// use lobes::{glam::DVec3, sphere};
/// assert_eq!(sphere::from_harmonic(DVec3::Z), DVec3::Y);
/// ```
pub fn from_harmonic(harmonic: DVec3) -> DVec3 {
    DVec3::new(harmonic.y, harmonic.z, harmonic.x)
}

/// A world vector in the map's frame: (sin θ cos ψ, sin θ sin ψ, cos θ), with ψ growing with the
/// map's columns. It is the harmonic frame mirrored in y, which no scalar product sees.
pub(crate) fn to_map(world: DVec3) -> DVec3 {
    DVec3::new(world.z, -world.x, world.y)
}

/// The inverse of [`to_map`].
pub(crate) fn from_map(map: DVec3) -> DVec3 {
    DVec3::new(-map.y, map.z, map.x)
}

/// A right-handed orthonormal frame, as its three axes in the world.
///
/// ```
/// use lobes::{glam::DVec3, sphere::Frame};
/// let frame = Frame::about(DVec3::Y);
/// assert_eq!(frame.to_local(DVec3::Y), DVec3::Z);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The world direction of the local +x.
    pub x: DVec3,
    /// The world direction of the local +y.
    pub y: DVec3,
    /// The world direction of the local +z: for a surface, its normal.
    pub z: DVec3,
}

impl Frame {
    /// A frame about the unit vector `z`; the other two axes turn continuously with it but for one
    /// cut at −z (Duff et al. 2017, *Building an Orthonormal Basis, Revisited*, JCGT 6(1)).
    ///
    /// ```
    /// use lobes::{glam::DVec3, sphere::Frame};
    /// let frame = Frame::about(DVec3::new(0.6, 0.0, -0.8));
    /// assert!((frame.x.cross(frame.y) - frame.z).length() < 1e-15);
    /// ```
    pub fn about(z: DVec3) -> Self {
        let sign = 1f64.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: DVec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: DVec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// The local coordinates of a world vector.
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        DVec3::new(world.dot(self.x), world.dot(self.y), world.dot(self.z))
    }

    /// The world vector of local coordinates.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.x * local.x + self.y * local.y + self.z * local.z
    }
}
