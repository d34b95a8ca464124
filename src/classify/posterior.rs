//! The posterior over reflectances: how specular, how rough.

use super::bright_lights::BrightLights;
use super::continuous::LearnedPosterior;
use super::evidence::{GaussianEvidence, log_sum_exp, natural_spectrum};
use super::harness::EVIDENCE_DEGREE;
use super::smooth_operator::{SmoothModes, SmoothOperator};
use crate::features::{Modes, RingLayout};
use crate::reflectance::Variant;
use crate::reflection::OperatorSet;
use crate::{Error, Parallelism, Result};

/// A grid of reflectances with the factors of their evidence, made once and used for any number of pictures of one view.
///
/// The axes are the specular share ρ_s/(ρ_s + ρ_d) and the roughness σ; the prior is uniform over the grid, and over
/// the spectra of light.
#[derive(Debug)]
pub struct ReflectanceGrid {
    layout: RingLayout,
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    /// One a roughness.
    operators: Vec<SmoothOperator>,
    /// factors[(sigma · shares + share) · spectra + spectrum].
    factors: Vec<GaussianEvidence>,
    spectra: usize,
}

impl ReflectanceGrid {
    /// The grid of [`LearnedPosterior`], under light of η = 0 or 0.75, to degree 127, as pictures of 128 pixels a side ask for it.
    ///
    /// # Errors
    /// What the operator refuses.
    pub fn of_view(
        variant: Variant,
        layout: &RingLayout,
        parallelism: Parallelism,
    ) -> Result<Self> {
        Self::new(
            variant,
            layout,
            &LearnedPosterior::shares(),
            &LearnedPosterior::sigmas(),
            &[0.0, 0.75].map(|eta| natural_spectrum(eta, EVIDENCE_DEGREE)),
            GaussianEvidence::NOISE,
            parallelism,
        )
    }

    /// Factors for every share, every σ (0 is a mirror) and every spectrum of light, through the operator of `variant` to
    /// the degree of the shortest spectrum.
    ///
    /// # Errors
    /// An empty or unsorted axis, a share outside [0, 1], no spectrum, and what the operator refuses.
    pub fn new(
        variant: Variant,
        layout: &RingLayout,
        shares: &[f64],
        sigmas: &[f64],
        spectra: &[Vec<f64>],
        noise: f64,
        parallelism: Parallelism,
    ) -> Result<Self> {
        for (axis, what) in [
            (shares, "the axis of specular shares"),
            (sigmas, "the axis of roughnesses"),
        ] {
            if axis.len() < 2 || axis.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(Error::Unanswerable(format!(
                    "{what} needs two values or more, each above the one before"
                )));
            }
        }
        if let Some(&value) = shares.iter().find(|share| !(0.0..=1.0).contains(*share)) {
            return Err(Error::Domain {
                what: "a specular share",
                value,
                allowed: "between 0 and 1",
            });
        }
        let degree = spectra.iter().map(Vec::len).min().unwrap_or(0);
        if degree == 0 {
            return Err(Error::Unanswerable(
                "a posterior needs the spectrum of light, one or more".into(),
            ));
        }
        let degree = degree - 1;
        let set = OperatorSet::new(variant, layout.viewpoint(), layout.angles(), degree)?;
        let mut factors = Vec::with_capacity(sigmas.len() * shares.len() * spectra.len());
        let mut operators = Vec::with_capacity(sigmas.len());
        for &sigma in sigmas {
            let operator = SmoothOperator::new(&*set.at(sigma, parallelism)?, layout)?;
            let made = parallelism.map(shares.len() * spectra.len(), |i| {
                let (share, spectrum) = (shares[i / spectra.len()], &spectra[i % spectra.len()]);
                GaussianEvidence::new(&operator, &spectrum[..=degree], 1.0 - share, share, noise)
            });
            for factor in made {
                factors.push(factor?);
            }
            operators.push(operator);
        }
        Ok(Self {
            layout: layout.clone(),
            shares: shares.to_vec(),
            sigmas: sigmas.to_vec(),
            operators,
            factors,
            spectra: spectra.len(),
        })
    }

    /// The rings that pictures are read on.
    pub fn layout(&self) -> &RingLayout {
        &self.layout
    }

    /// ln of the likelihood of each point, row by row, one row a roughness, of one channel of a picture with these bright lights: the mean over the spectra.
    ///
    /// # Errors
    /// [`Error::Length`] for modes of another layout.
    pub fn log_likelihoods(&self, modes: &Modes, lights: &BrightLights) -> Result<Vec<f64>> {
        let modes = SmoothModes::new(modes, &self.layout)?;
        let mut logs = Vec::with_capacity(self.sigmas.len() * self.shares.len());
        let row = self.shares.len() * self.spectra;
        for (operator, factors) in self.operators.iter().zip(self.factors.chunks(row)) {
            let responses = operator.responses(lights)?;
            for factors in factors.chunks(self.spectra) {
                let values = factors
                    .iter()
                    .map(|factor| Ok(factor.of(&modes, &responses)?.log))
                    .collect::<Result<Vec<f64>>>()?;
                logs.push(log_sum_exp(values.into_iter()) - (self.spectra as f64).ln());
            }
        }
        Ok(logs)
    }

    /// The posterior of one channel.
    ///
    /// `weight` is the power to which the likelihood is raised, at most 1: amplitudes of real light are not independent
    /// as the field's are, and counting each in full makes the posterior far too sure.
    ///
    /// # Errors
    /// A weight that is not in (0, 1], and those of [`Self::log_likelihoods`].
    pub fn posterior(
        &self,
        modes: &Modes,
        lights: &BrightLights,
        weight: f64,
    ) -> Result<Posterior> {
        if !(weight > 0.0 && weight <= 1.0) {
            return Err(Error::Domain {
                what: "the weight of the likelihood",
                value: weight,
                allowed: "above 0 and at most 1",
            });
        }
        let mut logs = self.log_likelihoods(modes, lights)?;
        for log in &mut logs {
            *log *= weight;
        }
        Ok(Posterior::of_likelihoods(&self.shares, &self.sigmas, logs))
    }
}

/// The width of the cell of point i: half the distance between its neighbours.
fn cell(axis: &[f64], i: usize, scale: impl Fn(f64) -> f64) -> f64 {
    let (low, high) = (i.saturating_sub(1), (i + 1).min(axis.len() - 1));
    0.5 * (scale(axis[high]) - scale(axis[low]))
}

/// A probability over a grid of specular shares and roughnesses.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    probabilities: Vec<f64>,
}

impl Posterior {
    /// From the ln-likelihood of each point, row by row, one row a roughness, under a prior that is uniform in the share and in ln σ.
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

    /// The probability of each cell, row by row: one row a roughness, one column a share. They sum to 1.
    pub fn probabilities(&self) -> &[f64] {
        &self.probabilities
    }

    /// ln of the probability of the cell that (share, σ) lies in, over the cell's size in the share and ln σ.
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
