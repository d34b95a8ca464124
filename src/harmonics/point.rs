//! Harmonics at directions.

use glam::DVec3;

use super::coefficients::{Coefficients, coefficient_count, column_start};
use super::legendre;
use crate::error::check_length;
use crate::{Error, Result};

/// Splits a direction into (cos θ, sin θ, cos φ, sin φ); the azimuth of a pole is 0.
fn angles(direction: DVec3) -> Result<(f64, f64, f64, f64)> {
    let length = direction.length();
    if !(length > 0.0 && length.is_finite()) {
        return Err(Error::Domain {
            what: "the length of a direction",
            value: length,
            allowed: "positive and finite",
        });
    }
    let across = direction.x.hypot(direction.y);
    let (cos_phi, sin_phi) = if across > 0.0 {
        (direction.x / across, direction.y / across)
    } else {
        (1.0, 0.0)
    };
    Ok((direction.z / length, across / length, cos_phi, sin_phi))
}

/// Every Y_l^m, l ≤ `degree`, at a direction of the harmonic frame, in the order of [`Coefficients`].
///
/// The direction need not be of unit length.
///
/// # Errors
/// [`Error::Length`] unless `out` has (degree + 1)² values; [`Error::Domain`] for a direction of no length.
pub fn evaluate_all(direction: DVec3, degree: usize, out: &mut [f64]) -> Result<()> {
    check_length(
        "the output of evaluate_all",
        coefficient_count(degree, degree),
        out.len(),
    )?;
    let (cos, sin, cos_phi, sin_phi) = angles(direction)?;
    let (mut c, mut s) = (1.0, 0.0);
    for m in 0..=degree {
        let start = column_start(degree, m);
        let count = degree + 1 - m;
        legendre::column(m, degree, cos, sin, &mut out[start..start + count])?;
        if m > 0 {
            (c, s) = (c * cos_phi - s * sin_phi, s * cos_phi + c * sin_phi);
            let (cosine, sine) = out[start..start + 2 * count].split_at_mut(count);
            for (cosine, sine) in cosine.iter_mut().zip(sine) {
                *sine = *cosine * s;
                *cosine *= c;
            }
        }
    }
    Ok(())
}

/// Σ f_lm Y_l^m at a direction of the harmonic frame.
///
/// # Errors
/// [`Error::Domain`] for a direction of no length.
pub fn evaluate(coefficients: &Coefficients, direction: DVec3) -> Result<f64> {
    let degree = coefficients.degree();
    let (cos, sin, cos_phi, sin_phi) = angles(direction)?;
    let (mut c, mut s) = (1.0, 0.0);
    let mut column = vec![0.0; degree + 1];
    let mut sum = 0.0;
    for m in 0..=coefficients.orders() {
        let p = &mut column[..degree + 1 - m];
        legendre::column(m, degree, cos, sin, p)?;
        let dot = |values: &[f64]| -> f64 { values.iter().zip(&*p).map(|(a, p)| a * p).sum() };
        if m == 0 {
            sum += dot(coefficients.cosine(0));
        } else {
            (c, s) = (c * cos_phi - s * sin_phi, s * cos_phi + c * sin_phi);
            sum += c * dot(coefficients.cosine(m)) + s * dot(coefficients.sine(m));
        }
    }
    Ok(sum)
}
