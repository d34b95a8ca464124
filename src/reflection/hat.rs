//! A pixel's bilinear hat, cut by a surface's horizon.

use glam::DVec3;

use crate::sphere::Rule;

/// A hat: 1 at a pixel's centre, 0 at its neighbours', bilinear between.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hat {
    /// The angle between pixels.
    step: f64,
    /// Of θ.
    sin: f64,
    cos: f64,
    /// Away from the pole, and round it.
    outward: DVec3,
    round: DVec3,
}

impl Hat {
    /// That of a pixel at (θ, ψ).
    pub(super) fn new(step: f64, theta: f64, psi: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();
        Self {
            step,
            sin,
            cos,
            outward: DVec3::new(cos_psi, sin_psi, 0.0),
            round: DVec3::new(-sin_psi, cos_psi, 0.0),
        }
    }

    /// The direction of a place of the hat, in steps down and along, and its sin θ: to 10⁻¹¹, as
    /// the step is small.
    fn at(&self, down: f64, along: f64) -> (DVec3, f64) {
        let small = |angle: f64| {
            let square = angle * angle;
            let cos = 1.0 - square * (0.5 - square / 24.0);
            (angle * (1.0 - square / 6.0), cos)
        };
        let (sin_down, cos_down) = small(down * self.step);
        let (sin_along, cos_along) = small(along * self.step);
        let sin = self.sin * cos_down + self.cos * sin_down;
        let cos = self.cos * cos_down - self.sin * sin_down;
        let across = cos_along * self.outward + sin_along * self.round;
        (sin * across + cos * DVec3::Z, sin)
    }

    /// ∫ Λ f dω over what of the hat Λ is above the horizon of a normal, f being smooth there: on
    /// lines along which the height changes most, with Gauss's rule on both sides of the kinks.
    pub(super) fn above_the_horizon(
        &self,
        normal: DVec3,
        rule: &Rule,
        f: impl Fn(DVec3) -> f64,
    ) -> f64 {
        let down = normal.dot(self.cos * self.outward - self.sin * DVec3::Z);
        let along = self.sin * normal.dot(self.round);
        let swap = along.abs() > down.abs();
        let mut sum = 0.0;
        for (offset, weight) in halves(rule, -1.0, 1.0) {
            let at = |t: f64| {
                let (down, along) = if swap { (offset, t) } else { (t, offset) };
                self.at(down, along)
            };
            let height = |t: f64| normal.dot(at(t).0);
            let (mut low, mut high) = (-1.0, 1.0);
            let (start, end) = (height(low), height(high));
            if start <= 0.0 && end <= 0.0 {
                continue;
            }
            if start < 0.0 || end < 0.0 {
                // The height is all but linear: a few steps of regula falsi.
                let (mut a, mut b, mut ya, mut yb) = (low, high, start, end);
                let mut root = 0.0;
                for _ in 0..4 {
                    root = a - ya * (b - a) / (yb - ya);
                    let y = height(root);
                    if (y < 0.0) == (ya < 0.0) {
                        (a, ya) = (root, y);
                    } else {
                        (b, yb) = (root, y);
                    }
                }
                if start < 0.0 {
                    low = root;
                } else {
                    high = root;
                }
            }
            for (t, inner) in halves(rule, low, high) {
                let (direction, sin) = at(t);
                sum += weight * (1.0 - offset.abs()) * inner * (1.0 - t.abs()) * sin * f(direction);
            }
        }
        sum * self.step * self.step
    }
}

/// Gauss's nodes on [low, high], cut at 0, where a hat has its kink.
pub(super) fn halves(rule: &Rule, low: f64, high: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
    let pieces = [(low.min(0.0), high.min(0.0)), (low.max(0.0), high.max(0.0))];
    pieces.into_iter().flat_map(move |(from, to)| {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        rule.nodes
            .iter()
            .zip(&rule.weights)
            .filter(move |_| half > 0.0)
            .map(move |(node, weight)| (middle + half * node, half * weight))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_of_a_hat_is_where_its_angles_say() {
        let (step, theta, psi) = (0.0123, 0.7, -2.0);
        let hat = Hat::new(step, theta, psi);
        for (down, along) in [(0.0, 0.0), (1.0, -1.0), (-0.3, 0.8)] {
            let (theta, psi): (f64, f64) = (theta + down * step, psi + along * step);
            let want = DVec3::new(
                theta.sin() * psi.cos(),
                theta.sin() * psi.sin(),
                theta.cos(),
            );
            let (got, sin) = hat.at(down, along);
            assert!((got - want).length() < 1e-11, "{got} for {want}");
            assert!((sin - theta.sin()).abs() < 1e-11);
        }
    }
}
