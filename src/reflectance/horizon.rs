//! The share of the half-vector sampler's draws that stay above the horizon.

use std::f64::consts::PI;
use std::sync::Arc;

use libm::erfc;

use super::slope;
use crate::numeric::sixteen_points::RULE;

/// The share for a view of (sine, cosine), cosine > 0: the mass of a Gaussian of slopes in the disk
/// of [`slope`](super::slope), the inner integral in closed form.
pub(super) fn share((sine, cosine): (f64, f64), sigma: f64) -> f64 {
    let reach = slope::REACH * sigma * cosine;
    if reach < 1.0 {
        // The rows fade out before they end: the trapezoidal rule.
        let step = slope::trapezoid_step(sigma, 0.0);
        let rows = (slope::REACH * sigma / step).ceil() as usize;
        let sum: f64 = (0..=rows)
            .map(|row| {
                let y = step * row as f64;
                let sin_psi = (y * cosine).min(1.0);
                let right = (sine + ((1.0 - sin_psi) * (1.0 + sin_psi)).sqrt()) / cosine;
                let left = (y * y - 1.0) / right;
                let inside = 0.5 * (erfc(left / sigma) - erfc(right / sigma));
                inside * (-(y / sigma) * (y / sigma)).exp() * if row == 0 { 0.5 } else { 1.0 }
            })
            .sum();
        return 2.0 * sum * step / (sigma * PI.sqrt());
    }
    // y = sin ψ / c; the Gaussian asks for panels of two σ.
    let psi_max = (slope::REACH * sigma * cosine).min(1.0).asin();
    let panels = (psi_max / (slope::PANEL_IN_SIGMA * sigma * cosine).min(0.6))
        .ceil()
        .max(1.0);
    let length = psi_max / panels;
    let mut sum = 0.0;
    for panel in 0..panels as usize {
        for &(node, weight) in RULE.iter() {
            let (sin_psi, cos_psi) = (length * (panel as f64 + node)).sin_cos();
            let y = sin_psi / cosine;
            let right = (sine + cos_psi) / cosine;
            let left = (y * y - 1.0) / right;
            let row = 0.5 * (erfc(left / sigma) - erfc(right / sigma));
            sum += weight * row * cos_psi * (-(y / sigma) * (y / sigma)).exp();
        }
    }
    2.0 * sum * length / (cosine * sigma * PI.sqrt())
}

/// Powers of a piece.
const TERMS: usize = 16;
/// Pieces of the table.
const PIECES: usize = 8;

/// 1 over [`share`] for one σ, tabled over the tangent of half the elevation: what an evaluation
/// can afford.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Horizon {
    /// The share is 1 from here on, but for e^(−1/σ²) where the table ends at 1.
    end: f64,
    /// Pieces to the unit.
    density: f64,
    /// Coefficients of u⁰ … u¹⁵ over each piece, −1 ≤ u ≤ 1, of 1 over the share.
    pieces: Arc<[[f64; TERMS]; PIECES]>,
}

impl Horizon {
    pub(super) fn new(sigma: f64) -> Self {
        let end = (slope::REACH * sigma).min(1.0);
        let mut pieces = [[0.0; TERMS]; PIECES];
        for (index, piece) in pieces.iter_mut().enumerate() {
            // Chebyshev's interpolation …
            let values: [f64; TERMS] = std::array::from_fn(|k| {
                let u = (PI * (k as f64 + 0.5) / TERMS as f64).cos();
                let tan_half = end * (index as f64 + 0.5 * (1.0 + u)) / PIECES as f64;
                let norm = 1.0 + tan_half * tan_half;
                let view = (
                    (1.0 - tan_half) * (1.0 + tan_half) / norm,
                    2.0 * tan_half / norm,
                );
                1.0 / share(view, sigma)
            });
            // … in powers of u, T₀ = 1, T₁ = u, T_{j+1} = 2u T_j − T_{j−1}. Its coefficients fall
            // by 10 and more from each to the next, so the powers' do not cancel.
            let (mut before, mut polynomial) = ([0.0; TERMS], [0.0; TERMS]);
            polynomial[0] = 1.0;
            for j in 0..TERMS {
                let sum: f64 = values
                    .iter()
                    .enumerate()
                    .map(|(k, value)| {
                        value * (PI * j as f64 * (k as f64 + 0.5) / TERMS as f64).cos()
                    })
                    .sum();
                let factor = sum * if j == 0 { 1.0 } else { 2.0 } / TERMS as f64;
                for (coefficient, power) in piece.iter_mut().zip(polynomial) {
                    *coefficient += factor * power;
                }
                let twice = if j == 0 { 1.0 } else { 2.0 };
                let mut next = before.map(|power| -power);
                for (power, &old) in next[1..].iter_mut().zip(&polynomial) {
                    *power += twice * old;
                }
                (before, polynomial) = (polynomial, next);
            }
        }
        Self {
            end,
            density: PIECES as f64 / end,
            pieces: Arc::new(pieces),
        }
    }

    /// 1 over the share. Not inlined: in the evaluation of the lobes that do not need it, it
    /// doubles their time.
    #[inline(never)]
    pub(super) fn renormalisation(&self, cosine: f64) -> f64 {
        let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
        let tan_half = cosine / (1.0 + sine);
        if tan_half >= self.end && self.end < 1.0 {
            return 1.0;
        }
        let place = (tan_half * self.density).min(PIECES as f64);
        let index = (place as usize).min(PIECES - 1);
        let u = 2.0 * (place - index as f64) - 1.0;
        // Estrin's scheme, whose products do not wait for one another.
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = self.pieces[index];
        let u2 = u * u;
        let u4 = u2 * u2;
        let low = ((a + b * u) + (c + d * u) * u2) + ((e + f * u) + (g + h * u) * u2) * u4;
        let high = ((i + j * u) + (k + l * u) * u2) + ((m + n * u) + (o + p * u) * u2) * u4;
        low + high * (u4 * u4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_integral() {
        for sigma in [1e-6, 0.001, 0.005, 0.03, 0.1, 0.15, 0.16, 0.3, 0.5, 1.0f64] {
            let horizon = Horizon::new(sigma);
            for step in 0..=400 {
                // Evenly over the table and one step past it, then to the normal.
                let tan_half = (horizon.end * f64::from(step) / 399.0).clamp(1e-12, 1.0);
                let norm = 1.0 + tan_half * tan_half;
                let (sine, cosine) = (
                    (1.0 - tan_half) * (1.0 + tan_half) / norm,
                    2.0 * tan_half / norm,
                );
                let (got, want) = (
                    1.0 / horizon.renormalisation(cosine),
                    share((sine, cosine), sigma),
                );
                assert!(
                    (got - want).abs() < 5e-15,
                    "σ {sigma}, cosine {cosine}: {got} against {want}"
                );
            }
        }
    }
}
