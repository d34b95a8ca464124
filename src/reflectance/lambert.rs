//! Lambert's reflectance in frequency.
//!
//! The kernel is the clamped cosine, so that `B_lm = A_l L_lm` is the irradiance of the light
//! `L_lm`, and the radiance of a surface of albedo `ρ_d` is that times `ρ_d` / π.

use std::f64::consts::PI;

use crate::error::allocate;
use crate::{Error, Result};

/// The largest degree of [`transfers`].
pub const MAX_TRANSFER_DEGREE: usize = 1 << 20;

/// `A_l = Λ_l ρ̂_l`, the factor by which the degree l of the light appears in the irradiance:
/// `∫ max(cos θ, 0) P_l(cos θ) dω`.
///
/// `A_0 = π`, `A_1 = 2π/3`, `A_2 = π/4`, `A_{l+2} = −A_l (l − 1)/(l + 4)`, and 0 for every odd l >
/// 1 (Basri and Jacobs 2003,
/// [doi:10.1109/TPAMI.2003.1177153](https://doi.org/10.1109/TPAMI.2003.1177153); Ramamoorthi and
/// Hanrahan 2001, [doi:10.1364/JOSAA.18.002448](https://doi.org/10.1364/JOSAA.18.002448)). Each
/// step of the recurrence is a product, so nothing cancels, whatever the degree.
///
/// ```
/// use lobes::reflectance::lambert;
/// assert_eq!(lambert::transfer(2), std::f64::consts::FRAC_PI_4);
/// ```
pub fn transfer(degree: usize) -> f64 {
    match degree {
        0 => PI,
        1 => 2.0 * PI / 3.0,
        degree if degree % 2 == 1 => 0.0,
        degree if degree > MAX_TRANSFER_DEGREE => {
            // (−1)^(n−1) 2π C(2n, n)/4ⁿ/((l + 2)(l − 1)), n = l/2, with Stirling's series of C(2n,
            // n)/4ⁿ, whose next term, 5/(1024 n³), is below 10⁻¹⁹.
            let (l, n) = (degree as f64, (degree / 2) as f64);
            let sign = if degree % 4 == 0 { -1.0 } else { 1.0 };
            let series = 1.0 - (1.0 - 1.0 / (16.0 * n)) / (8.0 * n);
            let binomial = series / (PI * n).sqrt();
            sign * 2.0 * PI * binomial / (l + 2.0) / (l - 1.0)
        }
        degree => {
            let mut value = 0.25 * PI;
            for l in (2..degree).step_by(2) {
                let l = l as f64;
                value *= -(l - 1.0) / (l + 4.0);
            }
            value
        }
    }
}

/// `A_0 … A_lmax`, as [`transfer`] gives them.
///
/// ```
/// use lobes::reflectance::lambert;
/// assert_eq!(lambert::transfers(2)?.len(), 3);
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// [`Error::Degree`] beyond [`MAX_TRANSFER_DEGREE`]; [`Error::Memory`] where there is none.
pub fn transfers(max_degree: usize) -> Result<Vec<f64>> {
    if max_degree > MAX_TRANSFER_DEGREE {
        return Err(Error::Degree {
            what: "the table of Lambert's transfer",
            degree: max_degree,
            limit: MAX_TRANSFER_DEGREE,
        });
    }
    let mut values: Vec<f64> = allocate("Lambert's transfer", max_degree + 1)?;
    for (degree, value) in [(0, PI), (1, 2.0 * PI / 3.0), (2, 0.25 * PI)] {
        if degree <= max_degree {
            values[degree] = value;
        }
    }
    for degree in (4..=max_degree).step_by(2) {
        let l = (degree - 2) as f64;
        values[degree] = -values[degree - 2] * (l - 1.0) / (l + 4.0);
    }
    Ok(values)
}

/// `ρ̂_l = A_l / Λ_l`, the zonal harmonic coefficient of the clamped cosine, `Λ_l` = √(4π/(2l+1)).
///
/// `ρ̂_0 = √π/2`, `ρ̂_1 = √(π/3)`.
///
/// ```
/// use lobes::reflectance::lambert;
/// assert!((lambert::coefficient(0) - std::f64::consts::PI.sqrt() / 2.0).abs() < 1e-15);
/// ```
pub fn coefficient(degree: usize) -> f64 {
    transfer(degree) / normalisation(degree)
}

/// `Λ_l = √(4π/(2l+1))`.
///
/// ```
/// use lobes::reflectance::lambert;
/// assert_eq!(lambert::normalisation(0), (4.0 * std::f64::consts::PI).sqrt());
/// ```
pub fn normalisation(degree: usize) -> f64 {
    (4.0 * PI / (2.0 * degree as f64 + 1.0)).sqrt()
}
