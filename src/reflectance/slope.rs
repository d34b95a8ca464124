//! Integrals over a lobe, in the plane of the half vector's slopes.
//!
//! With the view v = (s, 0, c) and the half vector h ∝ (x, y, 1), the light leaves the surface when
//! c(1 − x² − y²) + 2sx > 0: the slopes fill a disk of radius 1/c about (s/c, 0). Every lobe is a
//! Gaussian in (x, y) times a smooth weight, so its integrals are those of a Gaussian over a disk.
//! The disk is cut into rows `y = sin ψ / c`, which end at `x = (s ± cos ψ)/c`: in (ψ, x)
//! everything is analytic.

use std::f64::consts::PI;

use crate::numeric::sixteen_points::RULE;

/// Where the Gaussian is cut, in σ: e^(−6.3²) is 6·10⁻¹⁸.
pub(super) const REACH: f64 = 6.3;

/// −ln of the error of the trapezoidal rule: e^(−36) is 2·10⁻¹⁶.
const DIGITS: f64 = 36.0;

/// The largest step of the trapezoidal rule for an integrand that is analytic in a strip of this
/// half width.
///
/// The rule's error is e^(−2π a/h) times the growth of the integrand at a distance a from the real
/// axis: e^(a²/σ²) of the Gaussian, and e^(2l atanh a) of a Legendre polynomial of twice the half
/// vector's angle.
fn step_of_strip(a: f64, sigma: f64, degree: f64) -> f64 {
    2.0 * PI * a / (DIGITS + (a / sigma) * (a / sigma) + 2.0 * degree * a.atanh())
}

/// The half widths of strips to choose from: up to 0.8, short of the poles at ±i.
fn strips(sigma: f64) -> impl Iterator<Item = f64> {
    (1..=24).map(move |k| (0.25 * f64::from(k) * sigma).min(0.8))
}

/// The step of the trapezoidal rule for a Gaussian of width σ and polynomials of this degree.
pub(super) fn trapezoid_step(sigma: f64, degree: f64) -> f64 {
    strips(sigma)
        .map(|a| step_of_strip(a, sigma, degree))
        .fold(0.0, f64::max)
}

/// The longest panel of sixteen nodes, in σ, for the Gaussian, …
pub(super) const PANEL_IN_SIGMA: f64 = 2.0;
/// … and in slope, for the powers of 1 + x² + y², which has zeros at ±i.
const PANEL: f64 = 1.0;

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

impl Node {
    /// 1 − i·r for the mirror direction r, as half the squared distance between the two.
    pub(super) fn versine_from_mirror(&self, sine: f64, cosine: f64) -> f64 {
        // i − r = 2 ((h·v) h − (n·v) n).
        let tan2 = self.x * self.x + self.y * self.y;
        let middle = (sine * self.x + cosine) / (1.0 + tan2);
        let rise = (sine * self.x - cosine * tan2) / (1.0 + tan2);
        2.0 * (middle * middle * tan2 + rise * rise)
    }
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

    fn exponent(&self, x: f64, y: f64) -> f64 {
        self.xx * x * x + 2.0 * self.xy * x * y + self.yy * y * y
    }

    fn peak(&self) -> f64 {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        determinant.max(0.0).sqrt() / PI
    }

    fn density(&self, x: f64, y: f64) -> f64 {
        self.peak() * (-self.exponent(x, y)).exp()
    }
}

/// Visits the nodes of a quadrature over the half vectors whose light is above the horizon.
///
/// `sine` and `cosine` are of the view's angle from the normal, `cosine` > 0. `degree` is that of
/// the polynomials of the light that are integrated, which swing at twice their degree in the half
/// vector's angle.
pub(super) fn visit(
    (sine, cosine): (f64, f64),
    gaussian: &Gaussian,
    degree: f64,
    mut at: impl FnMut(Node),
) {
    let reach = REACH * gaussian.sigma_x.max(gaussian.sigma_y);
    // No row ends above, and no row is cut on its far side, where the Gaussian is.
    let row = reach * cosine;
    if row < 1.0 && row < sine + ((1.0 - row) * (1.0 + row)).sqrt() {
        trapezoid((sine, cosine), gaussian, degree, at);
        return;
    }
    // Sixteen nodes carry twelve radians of phase beside the Gaussian.
    let longest = (PANEL_IN_SIGMA * gaussian.sigma_min)
        .min(PANEL)
        .min(6.0 / degree);
    let psi_max = (REACH * gaussian.sigma_y * cosine).min(1.0).asin();
    let rows = (psi_max / (longest * cosine)).ceil().max(1.0);
    let symmetric = gaussian.xy == 0.0;
    let row_height = psi_max / rows;
    for row in 0..rows as usize {
        for &(node, weight) in RULE.iter() {
            let psi = row_height * (row as f64 + node);
            let row = SlopeRow::new(sine, cosine, psi);
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

/// The trapezoidal rule, which converges faster than any power of its step where the integrand
/// fades out on both sides.
///
/// Rows end at the left edge of the disk alone. There x = left + w with w = ℓ ln(1 + e^(u/ℓ)) in
/// place of u: w fades out exponentially to the left, and a branch or a pole at or beyond the edge
/// stays πℓ off the real axis of u.
fn trapezoid(
    (sine, cosine): (f64, f64),
    gaussian: &Gaussian,
    degree: f64,
    mut at: impl FnMut(Node),
) {
    let sigma = gaussian.sigma_min;
    let step = trapezoid_step(sigma, degree);
    // With ℓ = a/π the branches of the map stay outside a strip of half width a.
    let cost = |a: f64| (37.0 * a / PI + 2.0 * REACH * sigma) / step_of_strip(a, sigma, degree);
    let strip = strips(sigma)
        .min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
        .unwrap_or(sigma);
    let (cut_step, bend) = (step_of_strip(strip, sigma, degree), strip / PI);
    let reach_x = REACH * gaussian.sigma_x;
    let rows = (REACH * gaussian.sigma_y / step).ceil() as i64;
    // The ends of the row at y.
    let ends = |y: f64| {
        let sin_psi = y * cosine;
        let right = (sine + ((1.0 - sin_psi) * (1.0 + sin_psi)).max(0.0).sqrt()) / cosine;
        ((y * y - 1.0) / right, right)
    };
    // The edge of the disk is farthest from the peak at y = 0 and nearest in the last row.
    let (farthest, nearest) = (-ends(0.0).0, -ends(step * rows as f64).0);
    let columns: Vec<(f64, f64)> = if reach_x < nearest {
        Vec::new()
    } else {
        let last = ((reach_x + farthest) / cut_step).ceil() as i64;
        // e^(−37) of the bend is left out.
        (-(37.0 * bend / cut_step) as i64..=last)
            .map(|column| {
                let u = (cut_step * column as f64 / bend).exp();
                (bend * u.ln_1p(), cut_step * u / (1.0 + u))
            })
            .collect()
    };
    let symmetric = gaussian.xy == 0.0;
    for row in if symmetric { 0 } else { -rows }..=rows {
        let y = step * row as f64;
        let row_weight = step * if symmetric && row > 0 { 2.0 } else { 1.0 };
        let (left, right) = ends(y);
        let mut visit = |x: f64, dx: f64, from_left: f64| {
            let exponent = gaussian.exponent(x, y);
            if exponent < REACH * REACH {
                at(Node {
                    x,
                    y,
                    weight: row_weight * dx * gaussian.peak() * (-exponent).exp(),
                    cosine_ratio: from_left * (right - x) / (1.0 + x * x + y * y),
                });
            }
        };
        if left < -reach_x {
            let columns = (reach_x / step).ceil() as i64;
            for column in -columns..=columns {
                let x = step * column as f64;
                visit(x, step, x - left);
            }
        } else {
            for &(from_left, dx) in &columns {
                visit(left + from_left, dx, from_left);
            }
        }
    }
}

/// One row of the disk.
struct SlopeRow {
    y: f64,
    /// The ends of the row.
    left: f64,
    right: f64,
    /// How far beyond the left end the light becomes opposite to the view (h·v = 0).
    pole: f64,
}

impl SlopeRow {
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
            if at_left || from + 1.25 * length >= self.right {
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
