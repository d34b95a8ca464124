//! Shapes with known normals, made by formulas and shaded by their normals alone.

use lobes::Result;
use lobes::glam::{DQuat, DVec3};
use lobes::picture::{NormalFrame, Normals, Picture};

/// Pixels a side.
pub(crate) const SIDE: usize = 240;

/// The normal in the camera's frame at a place of −1.2 … 1.2, y up.
pub(crate) type Shape = fn(f64, f64) -> Option<DVec3>;

/// Half axes of 1.1, 0.75 and 0.9.
pub(crate) fn ellipsoid(x: f64, y: f64) -> Option<DVec3> {
    let (a, b, c) = (1.1, 0.75, 0.9);
    let square = 1.0 - (x / a).powi(2) - (y / b).powi(2);
    let z = c * square.max(0.0).sqrt();
    (square > 0.0).then(|| DVec3::new(x / (a * a), y / (b * b), z / (c * c)).normalize())
}

/// |x|^p + |y|^p + |z|^p = 1.
pub(crate) fn superquadric(x: f64, y: f64) -> Option<DVec3> {
    let p = 2.6;
    let rest = 1.0 - x.abs().powf(p) - y.abs().powf(p);
    let slope = |v: f64| v.abs().powf(p - 1.0) * v.signum();
    (rest > 0.0).then(|| DVec3::new(slope(x), slope(y), slope(rest.powf(1.0 / p))).normalize())
}

/// A torus that is seen from 40° above its plane, by steps of its distance along the ray.
pub(crate) fn torus(x: f64, y: f64) -> Option<DVec3> {
    let tilt = DQuat::from_rotation_x(40f64.to_radians());
    let (large, small) = (0.75, 0.32);
    let towards = tilt.inverse() * DVec3::Z;
    let mut place = tilt.inverse() * DVec3::new(x, y, 2.0);
    for _ in 0..400 {
        let around = place.x.hypot(place.z);
        let distance = (around - large).hypot(place.y) - small;
        if distance < 1e-6 {
            let ring = DVec3::new(place.x, 0.0, place.z) * (large / around);
            return Some(tilt * (place - ring).normalize());
        }
        place -= towards * distance;
        if place.length() > 4.0 {
            return None;
        }
    }
    None
}

/// Hills on a plane that faces the camera.
pub(crate) fn hills(x: f64, y: f64) -> Option<DVec3> {
    let slope = |at: f64| 0.9 * (4.0 * at).cos();
    Some(DVec3::new(-slope(x), -slope(y), 1.0).normalize())
}

/// The places of the pixels.
pub(crate) fn places() -> impl Iterator<Item = (f64, f64)> {
    let at = |i: usize| 2.4 * (i as f64 + 0.5) / SIDE as f64 - 1.2;
    (0..SIDE * SIDE).map(move |i| (at(i % SIDE), -at(i / SIDE)))
}

/// The normals of the pixels, 0 where the shape is not.
pub(crate) fn components(shape: Shape) -> Vec<[f64; 3]> {
    let all = places().map(|(x, y)| shape(x, y).map_or([0.0; 3], |n| n.to_array()));
    all.collect()
}

/// The map of normals; the formulas give what it accepts.
pub(crate) fn normals(shape: Shape) -> Result<Normals> {
    Normals::new(SIDE, SIDE, &components(shape), NormalFrame::Camera, None)
}

/// The shape's picture, each pixel shaded by its normal.
pub(crate) fn shaded(shape: Shape, of: impl Fn(DVec3) -> [f64; 3]) -> Result<Picture> {
    let pixels = places().map(|(x, y)| shape(x, y).map_or([0.0; 3], &of));
    Picture::linear(SIDE, SIDE, pixels.collect())
}
