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

/// How much a picture changes at a place, and the direction in which it does so most.
#[derive(Debug, Clone, Copy, Default)]
struct Gradient {
    size: f64,
    cos: f64,
    sin: f64,
}

/// The gradient of three channels as one: the direction in which they change most together (Di
/// Zenzo 1986, 10.1016/0734-189X(86)90223-9), and by how much. Scharr's differences, whose
/// directions are the best of 3 × 3.
fn gradients(values: &[[f64; 3]], width: usize, height: usize) -> Vec<Gradient> {
    let mut field = vec![Gradient::default(); width * height];
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
            let apart = 0.5 * (xx - yy);
            let spread = (apart * apart + xy * xy).sqrt();
            let size = (0.5 * (xx + yy) + spread).sqrt();
            // Half the angle whose cosine is apart/spread and whose sine is xy/spread; of its cosine and
            // its sine that is taken first which is not small.
            let larger = (0.5 + 0.5 * apart.abs() / spread).sqrt();
            let smaller = 0.5 * xy / (spread * larger);
            let (cos, sin) = if spread == 0.0 {
                (1.0, 0.0)
            } else if apart >= 0.0 {
                (larger, smaller)
            } else {
                (smaller.abs(), larger.copysign(xy))
            };
            field[y * width + x] = Gradient { size, cos, sin };
        }
    }
    field
}

/// The places where the gradient is largest along itself, to a part of a pixel.
fn thinned(field: &[Gradient], width: usize, height: usize) -> Vec<Edge> {
    let mut edges = Vec::new();
    if width < 5 || height < 5 {
        return edges;
    }
    // What is fainter than this is rounding.
    const FAINTEST: f64 = 1e-3;
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let Gradient { size, cos, sin } = field[y * width + x];
            if size < FAINTEST {
                continue;
            }
            let normal = (cos, sin);
            // Between the two neighbours that the normal passes.
            let beside = |sign: f64| {
                let (dx, dy) = (sign * normal.0, sign * normal.1);
                let (step, side, part) = if dx.abs() > dy.abs() {
                    ((dx.signum(), 0.0), (0.0, dy.signum()), (dy / dx).abs())
                } else {
                    ((0.0, dy.signum()), (dx.signum(), 0.0), (dx / dy).abs())
                };
                let value = |p: (f64, f64)| {
                    field[(y as f64 + p.1) as usize * width + (x as f64 + p.0) as usize].size
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane changes towards where it rises, and by its slope; of the two directions along that
    /// line the one to the right is given, and a line from top to bottom may have either.
    #[test]
    fn the_gradient_of_a_plane_is_its_slope() {
        for step in 0..360 {
            let (sin, cos) = f64::from(step).to_radians().sin_cos();
            let plane = |i: usize| 0.01 * (cos * (i % 5) as f64 + sin * (i / 5) as f64);
            let values: Vec<[f64; 3]> = (0..25).map(|i| [plane(i); 3]).collect();
            let Gradient {
                size,
                cos: x,
                sin: y,
            } = gradients(&values, 5, 5)[12];
            assert!((size - 0.01 * 3f64.sqrt()).abs() < 1e-12);
            assert!((x * cos + y * sin).abs() > 1.0 - 1e-12, "{step}: {x}, {y}");
            assert!(x >= 0.0 && (x * x + y * y - 1.0).abs() < 1e-12);
        }
        // What does not change has none.
        assert_eq!(gradients(&[[0.5; 3]; 25], 5, 5)[12].size, 0.0);
    }
}
