//! Gaussian random fields of a given spectrum.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::coefficients::Coefficients;
use crate::numeric::sincospi::sin_cos;
use crate::{Error, Result};

/// The coefficients of an isotropic Gaussian field whose power spectrum is `power`, C_l for l = 0 …
/// degree: each f_lm is √C_l times a standard normal deviate of its own, so that the mean of
/// [`average_power`](super::average_power) over fields is `power` exactly.
///
/// It is the power of real orthonormal coefficients, and that of the complex a_lm of healpy's
/// `synalm`: ⟨|a_lm|²⟩ = C_l. That of another normalisation is converted first.
///
/// The deviates come from PCG64 (PCG XSL RR 128/64, O'Neill 2014, HMC-CS-2014-0905), seeded as
/// `Pcg64::seed_from_u64`, in pairs √(−2 ln(1 − u)) (cos 2πv, sin 2πv) of numbers u, v of 53 bits
/// (Box and Muller 1958, doi:10.1214/aoms/1177706645). They go by degree, l² + l + m, so that a
/// field of a higher degree begins with those of a lower one; no machine and no number of threads
/// changes a bit of them.
///
/// ```
/// use lobes::harmonics::{average_power, random_field};
/// let power: Vec<f64> = (0..64).map(|l| 1.0 / f64::from(l + 1)).collect();
/// let f = random_field(&power, 1)?;
/// assert_eq!(f, random_field(&power, 1)?);
/// assert_eq!(f.with_degree(7), random_field(&power[..8], 1)?);
/// let sum: f64 = average_power(&f).iter().zip(&power).map(|(b, c)| b / c).sum();
/// assert!((sum / 64.0 - 1.0).abs() < 0.2);
/// # Ok::<(), lobes::Error>(())
/// ```
///
/// # Errors
/// [`Error::Empty`] for no power at all; [`Error::Domain`] for one that is negative or not finite;
/// [`Error::Memory`] where there is none for so many coefficients.
pub fn random_field(power: &[f64], seed: u64) -> Result<Coefficients> {
    let Some(degree) = power.len().checked_sub(1) else {
        return Err(Error::Empty {
            what: "a random field",
            needs: "the power of degree 0 at least",
        });
    };
    if let Some(value) = power.iter().find(|c| !(**c >= 0.0 && c.is_finite())) {
        return Err(Error::Domain {
            what: "the power of a degree",
            value: *value,
            allowed: "finite and at least 0",
        });
    }
    let mut field = Coefficients::try_zeros(degree, degree)?;
    let mut normal = Normal {
        generator: Pcg64::seed_from_u64(seed),
        other: None,
    };
    for (l, c) in power.iter().enumerate() {
        let deviation = c.sqrt();
        for m in -(l as isize)..=l as isize {
            let value = deviation * normal.next();
            field.set(l, m, value)?;
        }
    }
    Ok(field)
}

/// Standard normal deviates, two at a time. libm's logarithm and the crate's sine are the same on
/// every machine, which those of the platform are not.
struct Normal {
    generator: Pcg64,
    other: Option<f64>,
}

impl Normal {
    fn next(&mut self) -> f64 {
        if let Some(value) = self.other.take() {
            return value;
        }
        let mut uniform = || (self.generator.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON);
        let (u, v) = (uniform(), uniform());
        let radius = (-2.0 * libm::log(1.0 - u)).sqrt();
        let (sin, cos) = sin_cos(v);
        self.other = Some(radius * sin);
        radius * cos
    }
}
