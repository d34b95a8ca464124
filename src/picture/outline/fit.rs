//! Circles through points.

use super::Circle;

/// The circle through three points.
pub(super) fn through(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<Circle> {
    let (bx, by, cx, cy) = (b.0 - a.0, b.1 - a.1, c.0 - a.0, c.1 - a.1);
    let twice = 2.0 * (bx * cy - by * cx);
    if twice.abs() < 1e-9 {
        return None;
    }
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let (x, y) = ((cy * b2 - by * c2) / twice, (bx * c2 - cx * b2) / twice);
    Some(Circle {
        x: a.0 + x,
        y: a.1 + y,
        radius: x.hypot(y),
    })
}

/// One step of Gauss and Newton towards the least squares of distances to the circle.
pub(super) fn least_squares(points: &[(f64, f64)], circle: Circle) -> Option<Circle> {
    weighted_least_squares(points.iter().map(|point| (*point, 1.0)), circle)
}

/// [`least_squares`] of points that count by their weights.
pub(super) fn weighted_least_squares(
    points: impl Iterator<Item = ((f64, f64), f64)>,
    circle: Circle,
) -> Option<Circle> {
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    let mut count = 0;
    for ((x, y), weight) in points.filter(|(_, weight)| *weight > 0.0) {
        let distance = (x - circle.x).hypot(y - circle.y).max(1e-9);
        let row = nalgebra::Vector3::new((x - circle.x) / distance, (y - circle.y) / distance, 1.0);
        normal += weight * row * row.transpose();
        right += weight * row * (distance - circle.radius);
        count += 1;
    }
    if count < 8 {
        return None;
    }
    let step = normal.cholesky()?.solve(&right);
    let next = Circle {
        x: circle.x + step[0],
        y: circle.y + step[1],
        radius: circle.radius + step[2],
    };
    (next.radius > 0.0 && next.radius.is_finite()).then_some(next)
}
