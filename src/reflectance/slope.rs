//! Integrals over a lobe, in the plane of the half vector's slopes.
//!
//! With the view v = (s, 0, c) and the half vector h ∝ (x, y, 1), the light leaves the surface when
//! c(1 − x² − y²) + 2sx > 0: the slopes fill a disk of radius 1/c about (s/c, 0). Every lobe is a Gaussian in (x, y)
//! times a smooth weight, so its integrals are those of a Gaussian over a disk. The disk is cut into rows
//! `y = sin ψ / c`, which end at `x = (s ± cos ψ)/c`: in (ψ, x) everything is analytic.

use super::gauss::RULE;

/// Where the Gaussian is cut, in σ: e^(−6.3²) is 6·10⁻¹⁸.
const REACH: f64 = 6.3;

/// The longest panel of sixteen nodes, in σ, for the Gaussian, …
const PANEL_IN_SIGMA: f64 = 2.0;
/// … and in slope, for the powers of 1 + x² + y², which has zeros at ±i.
const PANEL: f64 = 1.2;

/// A node of the quadrature.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// Slopes of the half vector.
    pub x: f64,
    pub y: f64,
    /// Quadrature weight, with the Gaussian in it: over the whole plane the weights sum to 1.
    pub weight: f64,
    /// `c_i` / `c_v`.
    pub cosine_ratio: f64,
}

/// A Gaussian density in the plane of slopes: `√det/π · exp(−(xx x² + 2 xy xy + yy y²))`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gaussian {
    xx: f64,
    xy: f64,
    yy: f64,
    /// Standard widths √2·deviation along x and y.
    sigma_x: f64,
    sigma_y: f64,
    /// The smallest width in any direction.
    sigma_min: f64,
}

impl Gaussian {
    /// Widths along the surface's tangents, seen in a frame whose x axis is turned by the angle of
    /// (cosine, sine) from the first tangent.
    pub(super) fn new(sigma: [f64; 2], cosine: f64, sine: f64) -> Self {
        let [p, q] = sigma.map(|s| 1.0 / (s * s));
        let [pp, qq] = sigma.map(|s| s * s);
        Self {
            xx: p * cosine * cosine + q * sine * sine,
            xy: (q - p) * sine * cosine,
            yy: p * sine * sine + q * cosine * cosine,
            sigma_x: (pp * cosine * cosine + qq * sine * sine).sqrt(),
            sigma_y: (pp * sine * sine + qq * cosine * cosine).sqrt(),
            sigma_min: sigma[0].min(sigma[1]),
        }
    }

    fn density(&self, x: f64, y: f64) -> f64 {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        determinant.max(0.0).sqrt() / std::f64::consts::PI
            * (-(self.xx * x * x + 2.0 * self.xy * x * y + self.yy * y * y)).exp()
    }
}

/// Visits the nodes of a quadrature over the half vectors whose light is above the horizon.
///
/// `sine` and `cosine` are of the view's angle from the normal, `cosine` > 0. `oscillation` is the largest angular
/// frequency of what is integrated, in radians per unit of slope.
pub(super) fn visit(
    (sine, cosine): (f64, f64),
    gaussian: &Gaussian,
    oscillation: f64,
    mut at: impl FnMut(Node),
) {
    // Sixteen nodes carry twelve radians of phase beside the Gaussian.
    let longest = (PANEL_IN_SIGMA * gaussian.sigma_min)
        .min(PANEL)
        .min(12.0 / oscillation);
    let psi_max = (REACH * gaussian.sigma_y * cosine).min(1.0).asin();
    let rows = (psi_max / (longest * cosine)).ceil().max(1.0);
    let symmetric = gaussian.xy == 0.0;
    let row_height = psi_max / rows;
    for row in 0..rows as usize {
        for &(node, weight) in RULE.iter() {
            let psi = row_height * (row as f64 + node);
            let row = Row::new(sine, cosine, psi);
            let weight = weight * row_height * psi.cos() / cosine;
            for (y, weight) in [
                (row.y, if symmetric { 2.0 * weight } else { weight }),
                (-row.y, weight),
            ]
            .into_iter()
            .take(if symmetric { 1 } else { 2 })
            {
                row.visit(gaussian, longest, |x, dx, cosine_ratio| {
                    at(Node {
                        x,
                        y,
                        weight: weight * dx * gaussian.density(x, y),
                        cosine_ratio,
                    });
                });
            }
        }
    }
}

/// One row of the disk.
struct Row {
    y: f64,
    /// The ends of the row.
    left: f64,
    right: f64,
    /// How far beyond the left end the light becomes opposite to the view (h·v = 0).
    pole: f64,
}

impl Row {
    fn new(sine: f64, cosine: f64, psi: f64) -> Self {
        let (sin_psi, cos_psi) = psi.sin_cos();
        let y = sin_psi / cosine;
        let right = (sine + cos_psi) / cosine;
        // The product of the ends is y² − 1: no difference of nearly equal numbers.
        let left = (y * y - 1.0) / right;
        let pole = cosine * (1.0 + left * left + y * y) / (2.0 * sine);
        Self {
            y,
            left,
            right,
            pole,
        }
    }

    /// Calls `at(x, dx, c_i/c_v)` over the row.
    fn visit(&self, gaussian: &Gaussian, longest: f64, mut at: impl FnMut(f64, f64, f64)) {
        let reach = REACH * gaussian.sigma_x;
        let start = self.left.max(-reach);
        let end = self.right.min(reach);
        if start >= end {
            return;
        }
        let mut from = start;
        while from < end {
            // Toward the left end panels shrink with the distance from the pole of 1/(h·v).
            let at_left = from == self.left;
            let mut length = longest.min(from - self.left + self.pole);
            if at_left || from + length >= self.right {
                // The maps below double the degree of what they map.
                length *= 0.5;
            }
            let mut to = from + length;
            // No sliver at the end.
            if to + 0.25 * length > end {
                to = end;
            }
            let at_right = to == self.right;
            for &(node, weight) in RULE.iter() {
                // √c_i has a branch at each end of the row; these maps undo it.
                let (from_left, dx) = match (at_left, at_right) {
                    (false, false) => (node, 1.0),
                    (true, false) => (node * node, 2.0 * node),
                    (false, true) => (node * (2.0 - node), 2.0 * (1.0 - node)),
                    (true, true) => (node * node * (3.0 - 2.0 * node), 6.0 * node * (1.0 - node)),
                };
                let length = to - from;
                let x = from + length * from_left;
                let left_distance = (from - self.left) + length * from_left;
                let right_distance = if at_right {
                    let from_right = match at_left {
                        false => (1.0 - node) * (1.0 - node),
                        true => (1.0 - node) * (1.0 - node) * (1.0 + 2.0 * node),
                    };
                    length * from_right
                } else {
                    self.right - x
                };
                let ratio = left_distance * right_distance / (1.0 + x * x + self.y * self.y);
                at(x, weight * dx * length, ratio);
            }
            from = to;
        }
    }
}
