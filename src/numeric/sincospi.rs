//! The sine and cosine of a part of a turn.

use std::f64::consts::FRAC_PI_2;

/// ±1/n! for n = 1, 3, … 17, of the sine's series, …
const SINE: [f64; 9] = series(1);
/// … and for n = 0, 2, … 16, of the cosine's.
const COSINE: [f64; 9] = series(0);

const fn series(first: usize) -> [f64; 9] {
    let mut terms = [1.0; 9];
    let mut k = 1;
    while k < 9 {
        let n = (first + 2 * k) as f64;
        terms[k] = -terms[k - 1] / (n * (n - 1.0));
        k += 1;
    }
    terms
}

/// sin 2πu and cos 2πu for u in [0, 1], to which u is clamped: in turns the quadrant is split off
/// exactly, and the rest is a short series.
#[inline]
pub(crate) fn sin_cos(u: f64) -> (f64, f64) {
    let u = u.clamp(0.0, 1.0);
    // Truncation is a rounding here, u being positive.
    let quadrant = (4.0 * u + 0.5) as i32;
    let angle = (4.0 * u - f64::from(quadrant)) * FRAC_PI_2;
    let square = angle * angle;
    let sine = angle * sum(&SINE, square);
    let cosine = sum(&COSINE, square);
    let (sine, cosine) = if quadrant & 1 == 0 {
        (sine, cosine)
    } else {
        (cosine, -sine)
    };
    if quadrant & 2 == 0 {
        (sine, cosine)
    } else {
        (-sine, -cosine)
    }
}

/// Σ `terms[k] x^k`, its products side by side (Estrin).
#[inline]
fn sum(terms: &[f64; 9], x: f64) -> f64 {
    let [a, b, c, d, e, f, g, h, i] = *terms;
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = (a + b * x) + (c + d * x) * x2;
    let high = (e + f * x) + (g + h * x) * x2;
    low + (high + i * x4) * x4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_the_sine_and_cosine_of_a_turn() {
        for k in 0..=10_000 {
            let u = f64::from(k) / 10_000.0;
            let (sine, cosine) = sin_cos(u);
            // The reference rounds 2πu, so it is asked for an eighth of a turn at most.
            let eighths = (8.0 * u).floor().min(7.0);
            let rest = (u - eighths / 8.0) * std::f64::consts::TAU;
            let (s, c) = rest.sin_cos();
            let (p, q) = (std::f64::consts::FRAC_PI_4 * eighths).sin_cos();
            assert!((sine - (s * q + c * p)).abs() < 6e-16, "sin of {u} turns");
            assert!((cosine - (c * q - s * p)).abs() < 6e-16, "cos of {u} turns");
            assert!((sine.hypot(cosine) - 1.0).abs() < 5e-16, "{u}");
        }
        assert_eq!(sin_cos(0.25), (1.0, -0.0));
        assert_eq!(sin_cos(0.5).1, -1.0);
        assert!(sin_cos(f64::NAN).0.is_nan());
    }
}
