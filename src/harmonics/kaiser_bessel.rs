//! The kernel by which values between the points of a grid come from those at the points.

use std::f64::consts::PI;

use super::recurrence::{LANES, Lanes};

/// The most points of a grid that one value takes of each axis.
pub(super) const MAX_WIDTH: usize = 2 * LANES;

/// The highest degree of a polynomial that stands for a piece of the kernel.
const MAX_POWER: usize = 24;

/// ψ(u) = I₀(β √(1 − (2u/w)²))/I₀(β) for |u| ≤ w/2, u in steps of the grid (Kaiser and Bessel), and
/// its pieces of one step each as polynomials.
pub(super) struct Kernel {
    pub(super) width: usize,
    beta: f64,
    /// I₀(β).
    top: f64,
    /// Coefficients from the highest power down, of the pieces from the left, in v = 2u − 1 of the
    /// place u within a piece; pieces beyond the width are 0.
    pub(super) pieces: Vec<[Lanes; 2]>,
}

/// I₀, the modified Bessel function of order 0, by its series of positive terms.
fn bessel(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-18 * sum {
        term *= quarter / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

impl Kernel {
    /// The narrowest kernel that gives each wave e^(ikx), |k| ≤ `degree`, on a grid of `points` to half
    /// of `tolerance`, so that two axes come to it; the widest where none does.
    pub(super) fn new(points: usize, degree: usize, tolerance: f64) -> Self {
        let ratio = points as f64 / (2 * degree + 1) as f64;
        let mut kernel = Self::of_width(2, ratio);
        while kernel.width < MAX_WIDTH && kernel.error(points, degree) > 0.5 * tolerance {
            kernel = Self::of_width(kernel.width + 1, ratio);
        }
        kernel.pieces = kernel.polynomials(tolerance);
        kernel
    }

    /// β as Beatty, Nishimura and Pauly (2005, doi:10.1109/TMI.2005.848376) choose it for a grid
    /// that is `ratio` times as fine as need be.
    fn of_width(width: usize, ratio: f64) -> Self {
        let reach = width as f64 * (1.0 - 0.5 / ratio);
        let beta = PI * (reach * reach - 0.8).sqrt();
        Self {
            width,
            beta,
            top: bessel(beta),
            pieces: Vec::new(),
        }
    }

    fn value(&self, u: f64) -> f64 {
        let z = 2.0 * u / self.width as f64;
        bessel(self.beta * (1.0 - z * z).max(0.0).sqrt()) / self.top
    }

    /// ∫ ψ(u) e^(2πi ν u) du, for frequencies at which it has not begun to oscillate.
    pub(super) fn spectrum(&self, frequency: f64) -> f64 {
        let width = self.width as f64;
        let root = (self.beta * self.beta - (PI * width * frequency).powi(2)).sqrt();
        width * root.sinh() / (root * self.top)
    }

    /// The largest error of a wave of size 1 between the points.
    fn error(&self, points: usize, degree: usize) -> f64 {
        let mut largest = 0.0f64;
        for place in 0..16 {
            let first = f64::from(place) / 16.0 - 0.5 * self.width as f64;
            let steps: Vec<f64> = (0..self.width).map(|piece| first + piece as f64).collect();
            let values: Vec<f64> = steps.iter().map(|u| self.value(*u)).collect();
            for eighth in 0..=8 {
                let frequency = (degree * eighth) as f64 / (8 * points) as f64;
                let scale = 1.0 / self.spectrum(frequency);
                let (mut real, mut imaginary) = (-1.0, 0.0);
                for (u, value) in steps.iter().zip(&values) {
                    let (sin, cos) = (2.0 * PI * frequency * u).sin_cos();
                    real += scale * value * cos;
                    imaginary += scale * value * sin;
                }
                largest = largest.max(real.hypot(imaginary));
            }
        }
        largest
    }

    /// The value of piece `piece` at v.
    fn at(&self, piece: usize, v: f64) -> f64 {
        self.value(piece as f64 + 0.5 * (v + 1.0) - 0.5 * self.width as f64)
    }

    /// Interpolation at Chebyshev's points, of the lowest degree that keeps well within the
    /// tolerance.
    fn polynomials(&self, tolerance: f64) -> Vec<[Lanes; 2]> {
        let mut degree = 3;
        loop {
            degree += 1;
            let mut pieces = vec![[[0.0; LANES]; 2]; degree + 1];
            let mut off = 0.0f64;
            for piece in 0..self.width {
                let powers = interpolate(degree, |v| self.at(piece, v));
                for between in 0..=degree {
                    let v = (PI * between as f64 / degree as f64).cos();
                    let found = powers.iter().fold(0.0, |sum, power| sum * v + power);
                    off = off.max((found - self.at(piece, v)).abs());
                }
                for (pieces, power) in pieces.iter_mut().zip(powers) {
                    pieces[piece / LANES][piece % LANES] = power;
                }
            }
            if off < 0.02 * tolerance || degree == MAX_POWER {
                return pieces;
            }
        }
    }
}

/// The polynomial of a degree through a function's values at Chebyshev's points, from its highest
/// power down.
fn interpolate(degree: usize, function: impl Fn(f64) -> f64) -> Vec<f64> {
    let count = degree + 1;
    let angle = |i: usize| PI * (i as f64 + 0.5) / count as f64;
    let values: Vec<f64> = (0..count).map(|i| function(angle(i).cos())).collect();
    let mut powers = vec![0.0; count];
    // Chebyshev's polynomials by powers, from the lowest: T_k and T_{k−1}.
    let (mut this, mut before) = (vec![0.0; count + 1], vec![0.0; count + 1]);
    this[0] = 1.0;
    for k in 0..count {
        let sum: f64 = (0..count)
            .map(|i| values[i] * (k as f64 * angle(i)).cos())
            .sum();
        let coefficient = sum * if k == 0 { 1.0 } else { 2.0 } / count as f64;
        for (power, t) in powers.iter_mut().zip(&this) {
            *power += coefficient * t;
        }
        let factor = if k == 0 { 1.0 } else { 2.0 };
        let mut next = vec![0.0; count + 1];
        for (i, next) in next.iter_mut().enumerate() {
            *next = factor * if i > 0 { this[i - 1] } else { 0.0 } - before[i];
        }
        (before, this) = (this, next);
    }
    powers.reverse();
    powers
}
