//! Power spectra and zonal convolution.

use std::f64::consts::PI;

use super::coefficients::{Coefficients, check_same_shape};
use crate::error::check_length;
use crate::{Error, Result};

/// The average power of each degree, B_l = Σ_m B_lm² / (2l + 1), l = 0 … degree.
///
/// The mean is over all 2l + 1 orders, whether they are stored or not. It is infinite where the sum
/// passes the largest number, as from coefficients beyond 10¹⁵⁴.
///
/// ```
/// use lobes::harmonics::{Coefficients, average_power};
/// let mut f = Coefficients::zeros(1);
/// f.set(1, 0, 3.0)?;
/// assert_eq!(average_power(&f), [0.0, 3.0]);
/// let zonal = Coefficients::from_vec(3, 0, vec![0.0, 0.0, 0.0, 1.0])?; // Y_3^0, order 0 alone
/// assert_eq!(average_power(&zonal), [0.0, 0.0, 0.0, 1.0 / 7.0]);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn average_power(coefficients: &Coefficients) -> Vec<f64> {
    products(coefficients, coefficients)
}

/// The average cross power of each degree, Σ_m A_lm B_lm / (2l + 1).
///
/// # Errors
/// [`Error::Length`] where the two differ in degree or orders.
pub fn cross_power(a: &Coefficients, b: &Coefficients) -> Result<Vec<f64>> {
    check_same_shape(a, b)?;
    Ok(products(a, b))
}

fn products(a: &Coefficients, b: &Coefficients) -> Vec<f64> {
    let mut power = vec![0.0; a.degree() + 1];
    for m in 0..=a.orders() {
        for (x, y) in [(a.cosine(m), b.cosine(m)), (a.sine(m), b.sine(m))] {
            for ((p, x), y) in power[m..].iter_mut().zip(x).zip(y) {
                *p += x * y;
            }
        }
    }
    for (l, p) in power.iter_mut().enumerate() {
        *p /= (2 * l + 1) as f64;
    }
    power
}

/// Multiplies each degree by its factor: B_lm = factors\[l\] · L_lm.
///
/// For a zonal kernel with coefficients ρ̂_l the factor is Λ_l ρ̂_l, Λ_l = √(4π/(2l+1)): see
/// [`zonal_factor`].
///
/// # Errors
/// [`Error::Length`] unless there is a factor for each degree.
pub fn convolve_zonal(coefficients: &mut Coefficients, factors: &[f64]) -> Result<()> {
    check_length(
        "the zonal factors",
        coefficients.degree() + 1,
        factors.len(),
    )?;
    for m in 0..=coefficients.orders() {
        for (value, factor) in coefficients.cosine_mut(m).iter_mut().zip(&factors[m..]) {
            *value *= factor;
        }
        for (value, factor) in coefficients.sine_mut(m).iter_mut().zip(&factors[m..]) {
            *value *= factor;
        }
    }
    Ok(())
}

/// The inverse of [`convolve_zonal`], each degree damped where the factor drowns in noise (Wiener):
/// L_lm = factor / (factor² + floor²) · B_lm.
///
/// `floor` is the ratio of the noise's to the signal's standard deviation of a coefficient; 0 is
/// the plain inverse, and then no factor may be 0.
///
/// # Errors
/// [`Error::Length`] unless there is a factor for each degree; [`Error::Domain`] for a floor that
/// is negative or not finite; [`Error::NotInvertible`] where a factor and the floor are both 0.
pub fn deconvolve_zonal(
    coefficients: &mut Coefficients,
    factors: &[f64],
    floor: f64,
) -> Result<()> {
    check_length(
        "the zonal factors",
        coefficients.degree() + 1,
        factors.len(),
    )?;
    if !(floor >= 0.0 && floor.is_finite()) {
        return Err(Error::Domain {
            what: "the noise floor",
            value: floor,
            allowed: "finite and at least 0",
        });
    }
    if floor == 0.0
        && let Some(l) = factors.iter().position(|&f| f == 0.0)
    {
        return Err(Error::NotInvertible { degree: l });
    }
    let inverse: Vec<f64> = factors
        .iter()
        .map(|f| f / (f * f + floor * floor))
        .collect();
    convolve_zonal(coefficients, &inverse)
}

/// Λ_l = √(4π/(2l+1)), so that a kernel's coefficient ρ̂_l acts as the factor Λ_l ρ̂_l.
pub fn zonal_factor(l: usize) -> f64 {
    (4.0 * PI / (2.0 * l as f64 + 1.0)).sqrt()
}
