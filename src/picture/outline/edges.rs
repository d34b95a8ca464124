//! Edges of a picture, as points with normals.

use super::Circle;
use super::reduced::{Reduced, even};

/// A place where the colour changes fastest along the direction in which it changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) x: f64,
    pub(super) y: f64,
    /// The unit normal; which of its two ways it points is of no meaning.
    pub(super) normal: (f64, f64),
    /// The gradient, as a share of what is strong in the picture, at most 1.
    pub(super) strength: f64,
}

impl Edge {
    /// How far it lies outside of a circle, and the cosine between its normal and the circle's.
    pub(super) fn against(&self, circle: Circle) -> (f64, f64) {
        let (dx, dy) = (self.x - circle.x, self.y - circle.y);
        let distance = (dx * dx + dy * dy).sqrt();
        let cosine = (dx * self.normal.0 + dy * self.normal.1) / distance.max(1e-9);
        (distance - circle.radius, cosine.abs())
    }
}

/// The edges of a picture made smaller.
pub(super) struct Edges {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) edges: Vec<Edge>,
}

impl Edges {
    /// Those of a picture made smaller.
    pub(super) fn of(picture: &Reduced) -> Self {
        let (width, height) = (picture.width, picture.height);
        let values: Vec<[f64; 3]> = picture
            .values
            .iter()
            .map(|rgb| rgb.map(|value| even(value, picture.white)))
            .collect();
        let field = gradients(&values, width, height);
        Self {
            width,
            height,
            edges: thinned(&field, width, height),
        }
    }
}

/// The gradient of three channels as one: the direction in which they change most together (Di
/// Zenzo 1986, 10.1016/0734-189X(86)90223-9), and by how much. Scharr's differences, whose
/// directions are the best of 3 × 3.
fn gradients(values: &[[f64; 3]], width: usize, height: usize) -> Vec<(f64, f64)> {
    let mut field = vec![(0.0, 0.0); width * height];
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = |dx: usize, dy: usize| &values[(y + dy - 1) * width + x + dx - 1];
            let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
            for c in 0..3 {
                let right = 3.0 * (at(2, 0)[c] - at(0, 0)[c] + at(2, 2)[c] - at(0, 2)[c])
                    + 10.0 * (at(2, 1)[c] - at(0, 1)[c]);
                let down = 3.0 * (at(0, 2)[c] - at(0, 0)[c] + at(2, 2)[c] - at(2, 0)[c])
                    + 10.0 * (at(1, 2)[c] - at(1, 0)[c]);
                let (right, down) = (right / 32.0, down / 32.0);
                xx += right * right;
                xy += right * down;
                yy += down * down;
            }
            let spread = (0.5 * (xx - yy)).hypot(xy);
            let size = (0.5 * (xx + yy) + spread).sqrt();
            let angle = 0.5 * f64::atan2(2.0 * xy, xx - yy);
            let (sin, cos) = angle.sin_cos();
            field[y * width + x] = (size * cos, size * sin);
        }
    }
    field
}

/// The places where the gradient is largest along itself, to a part of a pixel.
fn thinned(field: &[(f64, f64)], width: usize, height: usize) -> Vec<Edge> {
    let sizes: Vec<f64> = field.iter().map(|(x, y)| x.hypot(*y)).collect();
    let mut edges = Vec::new();
    if width < 5 || height < 5 {
        return edges;
    }
    // What is fainter than this is rounding.
    const FAINTEST: f64 = 1e-3;
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let i = y * width + x;
            let size = sizes[i];
            if size < FAINTEST {
                continue;
            }
            let normal = (field[i].0 / size, field[i].1 / size);
            // Between the two neighbours that the normal passes.
            let beside = |sign: f64| {
                let (dx, dy) = (sign * normal.0, sign * normal.1);
                let (step, side, part) = if dx.abs() > dy.abs() {
                    ((dx.signum(), 0.0), (0.0, dy.signum()), (dy / dx).abs())
                } else {
                    ((0.0, dy.signum()), (dx.signum(), 0.0), (dx / dy).abs())
                };
                let value = |p: (f64, f64)| {
                    sizes[(y as f64 + p.1) as usize * width + (x as f64 + p.0) as usize]
                };
                let diagonal = (step.0 + side.0, step.1 + side.1);
                (1.0 - part) * value(step) + part * value(diagonal)
            };
            let (before, after) = (beside(-1.0), beside(1.0));
            if before > size || after >= size {
                continue;
            }
            // The neighbours lie 1/cos of the normal's smaller angle to an axis away.
            let reach = 1.0 / normal.0.abs().max(normal.1.abs());
            let bend = before + after - 2.0 * size;
            let offset = if bend < 0.0 {
                (0.5 * (before - after) / bend).clamp(-0.5, 0.5) * reach
            } else {
                0.0
            };
            edges.push(Edge {
                x: x as f64 + 0.5 + offset * normal.0,
                y: y as f64 + 0.5 + offset * normal.1,
                normal,
                strength: size,
            });
        }
    }
    let mut ordered: Vec<f64> = edges.iter().map(|edge| edge.strength).collect();
    ordered.sort_by(f64::total_cmp);
    let strong = ordered.get(ordered.len() / 2).copied().unwrap_or(1.0);
    for edge in &mut edges {
        edge.strength /= edge.strength + strong;
    }
    edges
}
