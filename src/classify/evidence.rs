//! The evidence for a reflectance in one picture, under light that is a random field.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::error::check_length;
use crate::features::{Modes, RingLayout};
use crate::reflection::Operator;
use crate::{Error, Result};

/// The likelihood of one channel of a picture for one reflectance and one spectrum of light.
///
/// Light is a Gaussian field of unknown strength k, L_lm ~ N(0, k C_l). Through the operator of the view the amplitudes y_m
/// of the picture's rings are Gaussian too, independent from order to order and between cosine and sine, with
/// covariance k (K_m + N), K_m = Σ_l C_l T_lm T_lmᵀ. N is white: what interpolation, pixels and the degrees past the
/// operator's add, as a share ν² of the variance that the amplitudes past order 0 have on average.
///
/// With Jeffreys' prior 1/k the strength integrates out in closed form: with Q = Σ yᵀ(K+N)⁻¹y over n amplitudes,
///
/// ln p(y) = ln Γ(n/2) − (n/2) ln(πQ) − ½ Σ ln det(K + N).
///
/// So neither exposure nor a white sphere is needed. The factors do not depend on the picture.
#[derive(Debug, Clone)]
pub struct GaussianEvidence {
    factors: Vec<Cholesky<f64, Dyn>>,
    half_log_determinant: f64,
    count: usize,
}

/// What a picture says of one hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// ln p(y), k integrated out.
    pub log: f64,
    /// ln of the strength k at which the picture is likeliest.
    pub log_strength: f64,
}

impl GaussianEvidence {
    /// The factors for a material ρ_d, ρ_s seen through `operator` under light of power `spectrum[l]` per order.
    ///
    /// `noise` is ν, the noise's standard deviation as a share of the amplitudes'.
    ///
    /// # Errors
    /// What [`Operator::covariance`] refuses; a noise that is not positive; a covariance that is not positive definite (both
    /// reflectances 0).
    pub fn new(
        operator: &Operator,
        layout: &RingLayout,
        spectrum: &[f64],
        rho_d: f64,
        rho_s: f64,
        noise: f64,
    ) -> Result<Self> {
        if !(noise > 0.0 && noise.is_finite()) {
            return Err(Error::Domain {
                what: "the noise",
                value: noise,
                allowed: "a finite number above 0",
            });
        }
        check_length(
            "the rings of the operator",
            layout.angles().len(),
            operator.rings().len(),
        )?;
        let rings = layout.angles().len();
        let mut blocks = (0..=layout.orders())
            .map(|m| operator.covariance(m, spectrum, rho_d, rho_s))
            .collect::<Result<Vec<_>>>()?;
        // The variance of an amplitude, averaged over the rings and the orders past 0 (order 0 holds the mean).
        let past = &blocks[1.min(layout.orders())..];
        let variance = past.iter().map(|block| block.trace()).sum::<f64>()
            / (past.len() * rings) as f64
            * noise
            * noise;
        let mut factors = Vec::with_capacity(blocks.len());
        let mut half_log_determinant = 0.0;
        for (m, block) in blocks.iter_mut().enumerate() {
            for r in 0..rings {
                block[(r, r)] += variance;
            }
            let factor = Cholesky::new(std::mem::replace(block, DMatrix::zeros(0, 0)))
                .ok_or_else(|| {
                    Error::Unanswerable(format!(
                        "the covariance of order {m} is not positive definite at ρ_d = {rho_d}, ρ_s = {rho_s}"
                    ))
                })?;
            let copies = if m == 0 { 1.0 } else { 2.0 };
            half_log_determinant += copies
                * factor
                    .l_dirty()
                    .diagonal()
                    .iter()
                    .map(|d| d.ln())
                    .sum::<f64>();
            factors.push(factor);
        }
        Ok(Self {
            factors,
            half_log_determinant,
            count: layout.len(),
        })
    }

    /// The evidence of a channel.
    pub fn of(&self, modes: &Modes) -> Evidence {
        let square: f64 = self
            .factors
            .iter()
            .enumerate()
            .map(|(m, factor)| {
                squared_norm(factor, modes.cosine(m)) + squared_norm(factor, modes.sine(m))
            })
            .sum();
        let n = self.count as f64;
        Evidence {
            log: statrs::function::gamma::ln_gamma(0.5 * n)
                - 0.5 * n * (std::f64::consts::PI * square).ln()
                - self.half_log_determinant,
            log_strength: (square / n).ln(),
        }
    }
}

/// yᵀ (L Lᵀ)⁻¹ y, 0 for no amplitudes.
fn squared_norm(factor: &Cholesky<f64, Dyn>, amplitudes: &[f64]) -> f64 {
    if amplitudes.is_empty() {
        return 0.0;
    }
    let mut y = DVector::from_column_slice(amplitudes);
    if factor.l_dirty().solve_lower_triangular_mut(&mut y) {
        y.norm_squared()
    } else {
        f64::INFINITY
    }
}

/// C_l = (l + 1)^(−2−η), the scale-free spectrum of natural light, for l = 0 … degree; l = 0, which holds the mean,
/// 100 times stronger, for light is positive.
pub fn natural_spectrum(eta: f64, degree: usize) -> Vec<f64> {
    (0..=degree)
        .map(|l| {
            if l == 0 {
                100.0
            } else {
                (l as f64).powf(-2.0 - eta)
            }
        })
        .collect()
}

/// ln Σ exp(values), without overflow.
pub(super) fn log_sum_exp(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return largest;
    }
    largest
        + values
            .map(|value| (value - largest).exp())
            .sum::<f64>()
            .ln()
}
