//! The outline of a mirror ball to a part of a pixel.

use crate::numeric::bilinear;
use crate::picture::Circle;

use super::Radiance;

/// Rays on which the outline is looked for.
const RAYS: usize = 720;

/// How far from the first guess, as a share of the radius.
const REACH: f64 = 0.06;

/// Steps along a ray for a pixel.
const PER_PIXEL: f64 = 4.0;

/// What counts as an edge: a step of the logarithm within a pixel.
const EDGE: f64 = 0.05;

/// A better circle for a mirror ball of which one is known to a few per cent.
///
/// Along rays from its centre every edge of the logarithm of the luminance is taken, not the
/// strongest alone: a mirror is full of edges. The circle on which most of them lie is climbed to,
/// at first among all that are within 3 % of the radius of it, at last among those within half a
/// pixel.
///
/// At its rim a ball mirrors what is straight behind it, so that only its reflectance tells it from
/// what is there. Of simulated balls before the map itself the radius is off by 1.3 % in the median:
/// docs/how-to/probe.md has the table. Give the circle where it matters.
///
/// A circle is given back as it is where no edges tell a better one, where it is larger than the
/// picture, and where the picture has not as many pixels as its size says.
pub fn refine(picture: &Radiance, circle: Circle) -> Circle {
    let longest = (picture.width + picture.height) as f64;
    if !(picture.check().is_ok() && circle.radius > 0.0 && circle.radius <= longest) {
        return circle;
    }
    let sums = picture.pixels.iter().map(|p| p.iter().sum::<f64>());
    let floor = 1e-3 * sums.clone().sum::<f64>() / picture.pixels.len().max(1) as f64;
    let logarithms: Vec<f64> = sums
        .map(|sum| (sum + floor + f64::MIN_POSITIVE).ln())
        .collect();
    let at = |x: f64, y: f64| -> Option<f64> {
        let corners = bilinear::corners_within(picture.width, picture.height, x - 0.5, y - 0.5)?;
        Some(
            corners
                .map(|(at, weight)| weight * logarithms[at])
                .iter()
                .sum(),
        )
    };
    let reach = (REACH * circle.radius).max(4.0);
    let steps = (2.0 * reach * PER_PIXEL) as usize;
    // (x, y, strength) of edges.
    let mut edges: Vec<(f64, f64, f64)> = Vec::new();
    for ray in 0..RAYS {
        let (sin, cos) = (std::f64::consts::TAU * ray as f64 / RAYS as f64).sin_cos();
        let place = |step: usize| circle.radius - reach + step as f64 / PER_PIXEL;
        let values: Vec<Option<f64>> = (0..=steps)
            .map(|step| at(circle.x + cos * place(step), circle.y + sin * place(step)))
            .collect();
        // The slope over a pixel.
        let half = PER_PIXEL as usize / 2;
        let slopes: Vec<f64> = (0..=steps)
            .map(|step| {
                let before = step.checked_sub(half).and_then(|before| values[before]);
                let after = values.get(step + half).copied().flatten();
                before.zip(after).map_or(0.0, |(a, b)| (b - a).abs())
            })
            .collect();
        for step in 1..steps {
            let (before, own, after) = (slopes[step - 1], slopes[step], slopes[step + 1]);
            if own > EDGE && own >= before && own > after {
                let bend = before - 2.0 * own + after;
                let part = if bend < 0.0 {
                    0.5 * (before - after) / bend
                } else {
                    0.0
                };
                let off = place(step) + part / PER_PIXEL;
                edges.push((circle.x + cos * off, circle.y + sin * off, own.min(1.0)));
            }
        }
    }
    let mut best = circle;
    let mut width = 0.5 * reach;
    while width > 0.4 {
        for _ in 0..8 {
            match climbed(&edges, best, width) {
                Some(next) => best = next,
                None => return circle,
            }
        }
        width *= 0.7;
    }
    best
}

/// One step of least squares, each edge weighed by how near it is to the circle.
fn climbed(edges: &[(f64, f64, f64)], circle: Circle, width: f64) -> Option<Circle> {
    // d ≈ r_i − r − dx cos − dy sin.
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for &(x, y, strength) in edges {
        let (across, down) = (x - circle.x, y - circle.y);
        let off = across.hypot(down);
        let apart = off - circle.radius;
        let weight = strength * (-0.5 * (apart / width).powi(2)).exp();
        let row = nalgebra::Vector3::new(across / off, down / off, 1.0);
        normal += weight * row * row.transpose();
        right += weight * apart * row;
    }
    let step = normal.cholesky()?.solve(&right);
    let next = Circle {
        x: circle.x + step.x,
        y: circle.y + step.y,
        radius: circle.radius + step.z,
    };
    (next.radius > 1.0 && next.x.is_finite() && next.y.is_finite()).then_some(next)
}
