//! The posterior over reflectances: how specular, how rough.

use super::evidence::log_sum_exp;
#[cfg(feature = "serde")]
use crate::{Error, Result, check_finite, check_length};

/// A reflectance as its picture shows it without an exposure.
///
/// ```
/// use lobes::inference::Reflectance;
/// // ρ_d = 0.13 and ρ_s = 0.05 in luminance, as one picture shows them without an exposure.
/// let plastic = Reflectance { share: 0.05 / (0.05 + 0.13), sigma: 0.03 };
/// assert!((plastic.share - 0.2778).abs() < 1e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reflectance {
    /// ρ_s / (ρ_s + ρ_d) of the luminance.
    pub share: f64,
    /// σ.
    pub sigma: f64,
}

/// The width of the cell of point i: half the distance between its neighbours.
fn cell(axis: &[f64], i: usize, scale: impl Fn(f64) -> f64) -> f64 {
    let (low, high) = (i.saturating_sub(1), (i + 1).min(axis.len() - 1));
    0.5 * (scale(axis[high]) - scale(axis[low]))
}

/// A probability over a grid of specular shares and roughnesses.
///
/// ```
/// use lobes::inference::Posterior;
/// fn say(posterior: &Posterior) -> String {
///     let [low, middle, high] = [0.05, 0.5, 0.95].map(|level| posterior.sigma_quantile(level));
///     format!("σ = {middle:.3}, and between {low:.3} and {high:.3} with a probability of 90 %")
/// }
/// assert_eq!(Posterior::default_shares().len(), 25);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Stored")
)]
pub struct Posterior {
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    probabilities: Vec<f64>,
}

/// A posterior as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Stored {
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    probabilities: Vec<f64>,
}

#[cfg(feature = "serde")]
impl TryFrom<Stored> for Posterior {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self> {
        let Stored {
            shares,
            sigmas,
            probabilities,
        } = stored;
        for (what, axis) in [
            ("the axis of specular shares", &shares),
            ("the axis of roughnesses", &sigmas),
        ] {
            check_finite(what, axis)?;
            if axis.len() < 2 || axis.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(Error::NotRising { what });
            }
        }
        let points = shares.len() * sigmas.len();
        check_length("the posterior", points, probabilities.len())?;
        check_probabilities("the probabilities of a posterior", &probabilities)?;
        Ok(Self {
            shares,
            sigmas,
            probabilities,
        })
    }
}

/// Checks that numbers are probabilities that sum to 1.
#[cfg(feature = "serde")]
pub(super) fn check_probabilities(what: &'static str, probabilities: &[f64]) -> Result<()> {
    check_finite(what, probabilities)?;
    let domain = |value, allowed| Error::Domain {
        what,
        value,
        allowed,
    };
    if let Some(&value) = probabilities.iter().find(|p| **p < 0.0) {
        return Err(domain(value, "at least 0 each"));
    }
    let sum: f64 = probabilities.iter().sum();
    if (sum - 1.0).abs() > 1e-6 {
        return Err(domain(sum, "1 in sum"));
    }
    Ok(())
}

impl Posterior {
    /// The shares at which a posterior is taken unless others are asked for: twenty-five from 0 to 1.
    pub fn default_shares() -> Vec<f64> {
        (0..25).map(|i| f64::from(i) / 24.0).collect()
    }

    /// The roughnesses at which it is taken: twenty from 0.015 to 0.4, evenly in ln σ.
    pub fn default_sigmas() -> Vec<f64> {
        let ratio = (0.4f64 / 0.015).ln();
        (0..20)
            .map(|i| 0.015 * (ratio * f64::from(i) / 19.0).exp())
            .collect()
    }

    /// From the ln-likelihood of each point, row by row, one row a roughness, under a prior that is
    /// uniform in the share and in ln σ.
    ///
    /// Each point stands for its cell: the grid need not be even.
    pub(super) fn of_likelihoods(shares: &[f64], sigmas: &[f64], mut log: Vec<f64>) -> Self {
        let cells = |axis: &[f64], scale: fn(f64) -> f64| -> Vec<f64> {
            (0..axis.len()).map(|i| cell(axis, i, scale).ln()).collect()
        };
        let (wide, high) = (cells(shares, |x| x), cells(sigmas, |x| (x + 1e-3).ln()));
        for (row, high) in log.chunks_exact_mut(shares.len().max(1)).zip(high) {
            for (value, wide) in row.iter_mut().zip(&wide) {
                *value += wide;
                *value += high;
            }
        }
        let total = log_sum_exp(log.iter().copied());
        Self {
            shares: shares.to_vec(),
            sigmas: sigmas.to_vec(),
            probabilities: log.into_iter().map(|value| (value - total).exp()).collect(),
        }
    }

    /// The specular shares of the grid, rising.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// The roughnesses of the grid, rising.
    pub fn sigmas(&self) -> &[f64] {
        &self.sigmas
    }

    /// The probability of each cell, row by row: one row a roughness, one column a share. They sum
    /// to 1.
    pub fn probabilities(&self) -> &[f64] {
        &self.probabilities
    }

    /// ln of the probability of the cell that (share, σ) lies in, over the cell's size in the share
    /// and ln σ.
    pub(super) fn log_density(&self, share: f64, sigma: f64) -> f64 {
        let nearest = |axis: &[f64], scale: &dyn Fn(f64) -> f64, value: f64| {
            let distance = |i: &usize| (scale(axis[*i]) - scale(value)).abs();
            let places = 0..axis.len();
            places
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .unwrap_or(0)
        };
        let log = |x: f64| (x + 1e-3).ln();
        let (i, j) = (
            nearest(&self.shares, &|x| x, share),
            nearest(&self.sigmas, &log, sigma),
        );
        let size = cell(&self.shares, i, |x| x) * cell(&self.sigmas, j, log);
        (self.probabilities[j * self.shares.len() + i].max(1e-300) / size).ln()
    }

    /// The cell with the largest probability, as (share, σ).
    pub fn mode(&self) -> (f64, f64) {
        let mut best = 0;
        for (i, &p) in self.probabilities.iter().enumerate() {
            if p > self.probabilities[best] {
                best = i;
            }
        }
        (
            self.shares[best % self.shares.len()],
            self.sigmas[best / self.shares.len()],
        )
    }

    /// The probability of each share.
    pub fn share_marginal(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.shares.len()];
        for (i, p) in self.probabilities.iter().enumerate() {
            sums[i % self.shares.len()] += p;
        }
        sums
    }

    /// The probability of each roughness.
    pub fn sigma_marginal(&self) -> Vec<f64> {
        self.probabilities
            .chunks(self.shares.len())
            .map(|row| row.iter().sum())
            .collect()
    }

    /// The value of the share below which the probability is `level`, interpolated.
    pub fn share_quantile(&self, level: f64) -> f64 {
        quantile(&self.shares, &self.share_marginal(), level, |x| x, |x| x)
    }

    /// The value of σ below which the probability is `level`, interpolated in its logarithm.
    pub fn sigma_quantile(&self, level: f64) -> f64 {
        let offset = 1e-3;
        quantile(
            &self.sigmas,
            &self.sigma_marginal(),
            level,
            |x| (x + offset).ln(),
            |x| (x.exp() - offset).max(0.0),
        )
    }
}

/// Each probability is spread evenly over its point's cell.
fn quantile(
    axis: &[f64],
    probabilities: &[f64],
    level: f64,
    scale: impl Fn(f64) -> f64,
    unscale: impl Fn(f64) -> f64,
) -> f64 {
    let last = axis.len() - 1;
    let edge = |i: usize| {
        if i == 0 || i > last {
            scale(axis[i.min(last)])
        } else {
            0.5 * (scale(axis[i - 1]) + scale(axis[i]))
        }
    };
    let mut below = 0.0;
    for (i, &p) in probabilities.iter().enumerate() {
        if below + p >= level || i == last {
            let part = if p > 0.0 {
                ((level - below) / p).clamp(0.0, 1.0)
            } else {
                0.0
            };
            return unscale(edge(i) + part * (edge(i + 1) - edge(i)));
        }
        below += p;
    }
    axis[last]
}
