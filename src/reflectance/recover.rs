//! The inverse with known light: the kernel from what a surface reflects, and the lobe from the
//! kernel.

use super::lambert;
use super::variant::Variant;
use super::ward::{MIN_SIGMA, Ward};
use crate::harmonics::Coefficients;
use crate::numeric::golden_section;
use crate::{Error, Result};

/// The kernel at one degree.
///
/// ```
/// use lobes::harmonics::{Coefficients, convolve_zonal};
/// use lobes::reflectance::recover::recover_kernel;
/// let mut light = Coefficients::zeros(2);
/// light.set(2, 0, 1.0)?;
/// light.set(2, 1, 2.0)?;
/// let mut reflected = light.clone();
/// convolve_zonal(&mut reflected, &[1.0, 0.75, 0.5])?;
/// let kernel = recover_kernel(&light, &reflected)?;
/// assert!((kernel[2].value - 0.5).abs() < 1e-15);
/// // The light has no power at degree 1.
/// assert!(kernel[1].standard_error.is_infinite());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KernelEstimate {
    /// `k_l = Λ_l ρ̂_l`, by which `B_lm = k_l L_lm`.
    pub value: f64,
    /// Its standard error, from the scatter of the 2l + 1 orders; infinite where there is one order
    /// or the light has no power.
    pub standard_error: f64,
}

/// The kernel `k_l`, l = 0 … degree, that takes the light to the reflected field: least squares
/// over the orders, `k_l = Σ_m B_lm L_lm / Σ_m L_lm²`.
///
/// This is Ramamoorthi and Hanrahan's deconvolution (2001,
/// [doi:10.1145/383259.383271](https://doi.org/10.1145/383259.383271)) for a kernel that is round
/// about the direction by which B is indexed. Where the light has no power the value is 0 and its
/// error infinite.
///
/// # Errors
/// [`Error::Length`] if the two differ in degree or orders.
pub fn recover_kernel(
    light: &Coefficients,
    reflected: &Coefficients,
) -> Result<Vec<KernelEstimate>> {
    let cross = crate::harmonics::cross_power(light, reflected)?;
    let power = crate::harmonics::average_power(light);
    let reflected_power = crate::harmonics::average_power(reflected);
    Ok((0..power.len())
        .map(|l| {
            if power[l] <= 0.0 {
                return KernelEstimate {
                    value: 0.0,
                    standard_error: f64::INFINITY,
                };
            }
            let value = cross[l] / power[l];
            // Σ (B − kL)² / Σ L², over the 2l degrees of freedom that are left.
            let scatter = (reflected_power[l] / power[l] - value * value).max(0.0);
            let standard_error = if l == 0 {
                f64::INFINITY
            } else {
                (scatter / (2 * l) as f64).sqrt()
            };
            KernelEstimate {
                value,
                standard_error,
            }
        })
        .collect())
}

/// A surface recovered from its kernel: values and standard errors.
///
/// ```
/// use lobes::reflectance::recover::Recovered;
/// /// Whether the highlight is there: ρ_s beyond three of its standard errors.
/// fn glossy(found: &Recovered) -> bool {
///     let [specular, error] = found.specular;
///     specular > 3.0 * error
/// }
/// let found = Recovered { diffuse: [0.2, 0.01], specular: [0.05, 0.01], sigma: [0.1, 0.02] };
/// assert!(glossy(&found));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recovered {
    /// `ρ_d` and its standard error.
    pub diffuse: [f64; 2],
    /// `ρ_s` and its standard error.
    pub specular: [f64; 2],
    /// σ and its standard error.
    pub sigma: [f64; 2],
}

/// Fits `k_l = ρ_d A_l/π + ρ_s b_l(σ)` to an estimated kernel, each degree by its standard error, σ
/// in [0.005, 0.5].
///
/// A scatter of 2l degrees of freedom makes Student's t of the error, of variance l/(l − 1) in its
/// unit: by that the squared errors are widened, and degrees 0 and 1, which have no variance, are
/// left out. So are degrees with an infinite error; an error of 0 counts as 10⁻¹² of the largest
/// value. `b_l` is that of normal incidence.
///
/// # Errors
/// [`Error::Undetermined`] if fewer than four degrees from 2 on are known or they do not determine
/// the three parameters.
///
/// ```
/// use lobes::harmonics::{Coefficients, convolve_zonal};
/// use lobes::reflectance::{Variant, Ward, recover::{recover_kernel, recover_lobe}};
/// let mut light = Coefficients::zeros(20);
/// for (index, value) in light.as_mut_slice().iter_mut().enumerate() {
///     *value = (1.0 + index as f64).sin();
/// }
/// let mirror_like = Ward::isotropic(Variant::Duer, 0.1)?.zonal(1.0, 20)?;
/// let mut reflected = light.clone();
/// convolve_zonal(&mut reflected, &mirror_like)?;
/// let found = recover_lobe(&recover_kernel(&light, &reflected)?, Variant::Duer)?;
/// assert!((found.specular[0] - 1.0).abs() < 1e-6 && (found.sigma[0] - 0.1).abs() < 1e-6);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn recover_lobe(kernel: &[KernelEstimate], variant: Variant) -> Result<Recovered> {
    let scale = kernel.iter().map(|k| k.value.abs()).fold(0.0, f64::max);
    let known: Vec<(usize, f64, f64)> = kernel
        .iter()
        .enumerate()
        .filter(|&(l, k)| l > 1 && k.standard_error.is_finite() && k.value.is_finite())
        .map(|(l, k)| {
            let widening = (l as f64 / (l as f64 - 1.0)).sqrt();
            (
                l,
                k.value,
                1.0 / (widening * k.standard_error).max(1e-12 * scale),
            )
        })
        .collect();
    let undetermined = || Error::Undetermined {
        parameter: "the lobe of the kernel",
        reason: "four degrees from 2 on, at least, must be known well enough to tell ρ_d, ρ_s and σ apart",
    };
    if known.len() < 4 || scale == 0.0 {
        return Err(undetermined());
    }
    let top = known.last().map_or(0, |&(l, _, _)| l);
    let lambertian: Vec<f64> = lambert::transfers(top)?
        .iter()
        .map(|a| a / std::f64::consts::PI)
        .collect();
    let lobe = |log_sigma: f64| -> Result<Vec<f64>> {
        Ward::isotropic(variant, log_sigma.exp().clamp(MIN_SIGMA, 1.0))?.zonal(1.0, top)
    };
    // For a given σ the albedos are linear: (ρ_d, ρ_s, the sum of squares).
    let albedos = |b: &[f64]| {
        let (mut dd, mut ds, mut ss, mut dv, mut sv) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for &(l, value, weight) in &known {
            let (d, s, v) = (weight * lambertian[l], weight * b[l], weight * value);
            dd += d * d;
            ds += d * s;
            ss += s * s;
            dv += d * v;
            sv += s * v;
        }
        let determinant = dd * ss - ds * ds;
        let (diffuse, specular) = (
            (ss * dv - ds * sv) / determinant,
            (dd * sv - ds * dv) / determinant,
        );
        let sum: f64 = known
            .iter()
            .map(|&(l, value, weight)| {
                (weight * (value - diffuse * lambertian[l] - specular * b[l])).powi(2)
            })
            .sum();
        (diffuse, specular, sum)
    };
    let objective = |log_sigma: f64| -> Result<f64> {
        let (_, _, sum) = albedos(&lobe(log_sigma)?);
        Ok(if sum.is_nan() { f64::INFINITY } else { sum })
    };
    // A scan, then the golden section about the best.
    let (low, high) = (0.005f64.ln(), 0.5f64.ln());
    let step = (high - low) / 40.0;
    let mut best = (f64::INFINITY, low);
    for index in 0..=40 {
        let at = low + step * f64::from(index);
        let sum = objective(at)?;
        if sum < best.0 {
            best = (sum, at);
        }
    }
    let bracket = ((best.1 - step).max(low), (best.1 + step).min(high));
    let log_sigma = golden_section::minimise(bracket, 1e-9, objective)?;
    let b = lobe(log_sigma)?;
    let (diffuse, specular, _) = albedos(&b);
    let (above, below) = (lobe(log_sigma + 1e-4)?, lobe(log_sigma - 1e-4)?);
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    for &(l, _, weight) in &known {
        let slope = specular * (above[l] - below[l]) / 2e-4;
        let row = nalgebra::Vector3::new(lambertian[l], b[l], slope) * weight;
        normal += row * row.transpose();
    }
    let Some(covariance) = normal.try_inverse() else {
        return Err(undetermined());
    };
    let error = |k: usize| covariance[(k, k)].sqrt();
    let sigma = log_sigma.exp();
    if !(error(0) + error(1) + error(2)).is_finite() {
        return Err(undetermined());
    }
    Ok(Recovered {
        diffuse: [diffuse, error(0)],
        specular: [specular, error(1)],
        sigma: [sigma, sigma * error(2)],
    })
}
