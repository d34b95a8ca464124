//! The evidence for a reflectance in one picture, under light that is a random field.

use nalgebra::{Cholesky, DMatrix};

use super::smooth_operator::{LightResponses, SmoothModes, SmoothOperator};
use crate::error::check_length;
use crate::reflection::check_spectrum;
use crate::{Error, Result};

/// The likelihood of one channel of a picture for one reflectance and one spectrum of light.
///
/// Light is a Gaussian field of unknown strength k, L_lm ~ N(0, k C_l), and, since a sun is no draw
/// from such a field, a few small bright lights in directions ω_j that the picture shows
/// ([`BrightLights`](super::BrightLights)), a_j ~ N(0, k τ²) each, τ² = 100. Through the operator
/// of the view the amplitudes y_m of the picture over smooth functions across its rings are
/// Gaussian too, with covariance k (K + N + τ² U Uᵀ): K_m = Σ_l C_l T_lm T_lmᵀ is independent from
/// order to order and between cosine and sine, and U, what the lights give, has few columns,
///
/// (U_m)_j = Σ_l T_lm P̄_lm(cos θ_j) (cos mφ_j, sin mφ_j).
///
/// N is white: what interpolation, pixels and the degrees past the operator's add, as a share ν² of
/// the variance that the amplitudes past order 0 have on average.
///
/// With Jeffreys' prior 1/k the strength integrates out in closed form, and Woodbury's identity
/// takes the lights in: with whitened w = (K + N)^(−½) y and W = (K + N)^(−½) U, A = τ⁻² 1 + Wᵀ W
/// and Q = |w|² − (Wᵀw)ᵀ A⁻¹ (Wᵀw) over n amplitudes,
///
/// ln p(y) = ln Γ(n/2) − (n/2) ln(πQ) − ½ Σ ln det(K + N) − ½ ln det(τ² A).
///
/// So neither exposure nor a white sphere is needed, nor anything learned. The factors do not
/// depend on the picture.
///
/// ```
/// use lobes::inference::{BrightLights, GaussianEvidence, SmoothModes, SmoothOperator, natural_spectrum};
/// # use lobes::{Parallelism, reflectance::Variant, reflection::{Operator, Viewpoint}};
/// # use lobes::features::{Modes, RingLayout};
/// # let layout = RingLayout::new(Viewpoint::Orthographic, 12, 4)?;
/// # let one = Parallelism::Sequential;
/// # let operator = Operator::new(Variant::Duer, 0.1, Viewpoint::Orthographic, layout.angles(), 16, one)?;
/// # // What a matte ball shows of light from above, without any noise.
/// # let angles = layout.angles().to_vec();
/// # let mut amplitudes = vec![0.0; layout.len()];
/// # for (r, angle) in angles.iter().enumerate() {
/// #     amplitudes[r] = 1.0 + 0.3 * angle.cos();
/// # }
/// # let modes = Modes::from_values(&layout, amplitudes)?;
/// // `modes` vary across the rings as the cosine of the angle does, as a matte ball's may.
/// let operator = SmoothOperator::new(&operator, &layout)?;
/// let modes = SmoothModes::new(&modes, &layout)?;
/// let no_lights = operator.responses(&BrightLights::default())?;
/// let spectrum = natural_spectrum(0.5, 16);
/// let log = |rho_d: f64, rho_s: f64| {
///     GaussianEvidence::new(&operator, &spectrum, rho_d, rho_s, 1e-3)?.of(&modes, &no_lights)
/// };
/// assert!(log(0.99, 0.01)?.log > log(0.2, 0.8)?.log, "it is likelier matte than shiny");
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct GaussianEvidence {
    rho_d: f64,
    rho_s: f64,
    /// L⁻¹ of each order, L Lᵀ = K_m + N.
    whitenings: Vec<DMatrix<f64>>,
    half_log_determinant: f64,
    count: usize,
}

/// What a picture says of one hypothesis.
///
/// ```
/// use lobes::inference::Evidence;
/// /// The probability of the first of two hypotheses that are as likely beforehand.
/// fn of_the_first(first: Evidence, second: Evidence) -> f64 {
///     1.0 / (1.0 + (second.log - first.log).exp())
/// }
/// let [better, worse] = [-10.0, -13.0].map(|log| Evidence { log, log_strength: 0.0 });
/// assert!((of_the_first(better, worse) - 0.9526).abs() < 1e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// ln p(y), k integrated out.
    pub log: f64,
    /// ln of the strength k at which the picture is likeliest.
    pub log_strength: f64,
}

/// τ²: lights that may be far brighter than the field.
const LIGHT_VARIANCE: f64 = 100.0;

impl GaussianEvidence {
    /// ν of pictures of 128 pixels a side without noise. Chosen on random reflectances that are not
    /// those reported: `docs/explanation/inference.md`.
    pub const NOISE: f64 = 3e-4;

    /// The factors for a material ρ_d, ρ_s seen through `operator` under light of power
    /// `spectrum[l]` per order.
    ///
    /// `noise` is ν, the noise's standard deviation as a share of the amplitudes'.
    ///
    /// # Errors
    /// A spectrum shorter than the operator's degree + 1, or with a value that is negative or not
    /// finite; a noise that is not positive; a covariance that is not positive definite (both
    /// reflectances 0).
    pub fn new(
        operator: &SmoothOperator,
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
        check_spectrum(spectrum, operator.degree())?;
        let blocks: Vec<DMatrix<f64>> = operator
            .blocks(rho_d, rho_s)
            .enumerate()
            .map(|(m, mut block)| {
                for (mut column, power) in block.column_iter_mut().zip(&spectrum[m..]) {
                    column *= power.sqrt();
                }
                &block * block.transpose()
            })
            .collect();
        let functions = blocks.first().map_or(0, DMatrix::nrows);
        // The variance of an amplitude, averaged over the functions and the orders past 0 (order 0
        // holds the mean).
        let past = &blocks[1.min(blocks.len() - 1)..];
        let variance = past.iter().map(|block| block.trace()).sum::<f64>()
            / (past.len() * functions) as f64
            * noise
            * noise;
        let mut whitenings = Vec::with_capacity(blocks.len());
        let (mut half_log_determinant, mut count) = (0.0, 0);
        for (m, mut block) in blocks.into_iter().enumerate() {
            for r in 0..functions {
                block[(r, r)] += variance;
            }
            let refused = || Error::NotPositiveDefinite {
                what: format!("the covariance of order {m} at ρ_d = {rho_d}, ρ_s = {rho_s}"),
            };
            let factor = Cholesky::new(block).ok_or_else(refused)?;
            let copies = if m == 0 { 1 } else { 2 };
            count += copies * functions;
            let logs = factor.l_dirty().diagonal().map(f64::ln).sum();
            half_log_determinant += copies as f64 * logs;
            let mut whitening = DMatrix::identity(functions, functions);
            if !factor.l_dirty().solve_lower_triangular_mut(&mut whitening) {
                return Err(refused());
            }
            whitenings.push(whitening);
        }
        Ok(Self {
            rho_d,
            rho_s,
            whitenings,
            half_log_determinant,
            count,
        })
    }

    /// The evidence of a channel, `lights` being what lights in its bright directions give through
    /// the operator.
    ///
    /// # Errors
    /// [`Error::Length`] for amplitudes or responses of another operator.
    pub fn of(&self, modes: &SmoothModes, lights: &LightResponses) -> Result<Evidence> {
        check_length(
            "the orders of a picture",
            self.whitenings.len(),
            modes.orders.len(),
        )?;
        let functions = self.whitenings.first().map_or(0, DMatrix::nrows);
        lights.check(self.whitenings.len(), functions)?;
        let count = lights.count();
        let mut square = 0.0;
        let mut gram = DMatrix::identity(count, count) / LIGHT_VARIANCE;
        let mut projection = DMatrix::zeros(count, 1);
        let mut both = DMatrix::zeros(functions, 2 + count);
        let mut white = both.clone();
        let mut across = both.transpose();
        let mut products = DMatrix::zeros(2 + count, 2 + count);
        for (m, (whitening, amplitudes)) in self.whitenings.iter().zip(&modes.orders).enumerate() {
            check_length("an order's amplitudes", functions, amplitudes.nrows())?;
            // Amplitudes and lights side by side, whitened.
            let parts = amplitudes.ncols();
            both.columns_mut(0, parts).copy_from(amplitudes);
            let mut responses = both.columns_mut(parts, count);
            responses.copy_from(&lights.diffuse[m]);
            responses *= self.rho_d;
            for (response, specular) in responses.iter_mut().zip(&lights.specular[m]) {
                *response += self.rho_s * specular;
            }
            let side_by_side = both.columns(0, parts + count);
            let mut white = white.columns_mut(0, parts + count);
            white.gemm(1.0, whitening, &side_by_side, 0.0);
            white.transpose_to(&mut across.rows_mut(0, parts + count));
            let mut products = products.view_mut((0, 0), (parts + count, parts + count));
            products.gemm(1.0, &across.rows(0, parts + count), &white, 0.0);
            let waves = &lights.waves[m];
            for part in 0..parts {
                square += products[(part, part)];
                for (light, (sin, cos)) in waves.iter().enumerate() {
                    let wave = if part == 0 { cos } else { sin };
                    projection[light] += wave * products[(part, parts + light)];
                }
            }
            for (i, a) in waves.iter().enumerate() {
                // Its lower half is all that is read.
                for (j, b) in waves.iter().enumerate().take(i + 1) {
                    gram[(i, j)] += (a.0 * b.0 + a.1 * b.1) * products[(parts + i, parts + j)];
                }
            }
        }
        let factor = Cholesky::new(gram).ok_or_else(|| Error::NotPositiveDefinite {
            what: "the Gram matrix of the responses to the lights".into(),
        })?;
        let mut weights = projection;
        factor.l_dirty().solve_lower_triangular_mut(&mut weights);
        let square = square - weights.norm_squared();
        let lights_log: f64 = factor.l_dirty().diagonal().map(f64::ln).sum()
            + 0.5 * count as f64 * LIGHT_VARIANCE.ln();
        let n = self.count as f64;
        Ok(Evidence {
            log: statrs::function::gamma::ln_gamma(0.5 * n)
                - 0.5 * n * (std::f64::consts::PI * square).ln()
                - self.half_log_determinant
                - lights_log,
            log_strength: (square / n).ln(),
        })
    }
}

/// C_l = l^(−2−η), the scale-free spectrum of natural light, for l = 1 … degree, and C_0 = 100: the
/// mean, which is 100 times stronger than degree 1, for light is positive.
///
/// ```
/// assert_eq!(lobes::inference::natural_spectrum(1.0, 2), [100.0, 1.0, 0.125]);
/// ```
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

/// The degree to which light is taken in evidence, which is all that spheres of 128 pixels show.
pub const EVIDENCE_DEGREE: usize = 127;

/// ln Σ exp(values), without overflow: −∞ for no value.
pub fn log_sum_exp(values: impl Iterator<Item = f64> + Clone) -> f64 {
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
