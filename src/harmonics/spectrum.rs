//! Power spectra and zonal convolution.

use std::f64::consts::PI;

use super::coefficients::{Coefficients, check_same_shape};
use crate::error::check_length;
use crate::{Error, Result};

/// The largest degree of [`gaussian_beam`], far past that of any transform.
const MAX_BEAM_DEGREE: usize = 1_000_000;

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
/// [`zonal_factor`]. A beam's b_l are such factors: see [`gaussian_beam`].
///
/// # Errors
/// [`Error::Length`] unless there is a factor for each degree.
pub fn convolve_zonal(coefficients: &mut Coefficients, factors: &[f64]) -> Result<()> {
    check_length(
        "the zonal factors",
        coefficients.degree() + 1,
        factors.len(),
    )?;
    multiply_degrees(coefficients, |l| factors[l]);
    Ok(())
}

/// Multiplies each degree by a factor.
pub(super) fn multiply_degrees(coefficients: &mut Coefficients, factor: impl Fn(usize) -> f64) {
    for m in 0..=coefficients.orders() {
        for (l, value) in (m..).zip(coefficients.cosine_mut(m)) {
            *value *= factor(l);
        }
        for (l, value) in (m..).zip(coefficients.sine_mut(m)) {
            *value *= factor(l);
        }
    }
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

/// The factors b_l = exp(−l(l + 1) σ²/2), l = 0 … degree, of smoothing by a Gaussian of full width
/// at half maximum `fwhm` in radians, σ = fwhm/√(8 ln 2): healpy's `gauss_beam`.
///
/// They are the exact transfer of the heat that has spread for σ²/2, and that of the flat Gaussian
/// up to O(σ²). [`convolve_zonal`] smooths with them, or with those of any beam, and
/// [`deconvolve_zonal`] takes a beam away.
///
/// ```
/// use lobes::harmonics::{Coefficients, convolve_zonal, gaussian_beam};
/// let beam = gaussian_beam(2, 1f64.to_radians())?;
/// // σ is 0.42466 of the full width at half maximum.
/// let sigma = 0.424_66 * 1f64.to_radians();
/// assert!((beam[2] - (-3.0 * sigma * sigma).exp()).abs() < 1e-8);
/// let mut f = Coefficients::zeros(2);
/// f.set(2, 1, 1.0)?;
/// convolve_zonal(&mut f, &beam)?;
/// assert_eq!(f.get(2, 1), beam[2]);
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// [`Error::Domain`] for a width that is negative or not finite; [`Error::Degree`] beyond 10⁶.
pub fn gaussian_beam(degree: usize, fwhm: f64) -> Result<Vec<f64>> {
    if !(fwhm >= 0.0 && fwhm.is_finite()) {
        return Err(Error::Domain {
            what: "the width of a beam in radians",
            value: fwhm,
            allowed: "finite and at least 0",
        });
    }
    if degree > MAX_BEAM_DEGREE {
        return Err(Error::Degree {
            what: "a beam",
            degree,
            limit: MAX_BEAM_DEGREE,
        });
    }
    let mut beam = vec![0.0; degree + 1];
    let root = fwhm / (16.0 * std::f64::consts::LN_2).sqrt();
    for (l, value) in beam.iter_mut().enumerate() {
        *value = (-(l as f64 * root) * ((l as f64 + 1.0) * root)).exp();
    }
    Ok(beam)
}
