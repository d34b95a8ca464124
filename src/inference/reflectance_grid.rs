//! The evidence of a grid of reflectances.

use super::bright_lights::BrightLights;
use super::evidence::{EVIDENCE_DEGREE, GaussianEvidence, log_sum_exp, natural_spectrum};
use super::posterior::Posterior;
use super::smooth_operator::{SmoothModes, SmoothOperator};
use crate::features::{Modes, RingLayout};
use crate::reflectance::Variant;
use crate::reflection::OperatorSet;
use crate::{Error, Parallelism, Result};

/// A grid of reflectances with the factors of their evidence, made once and used for any number of
/// pictures of one view.
///
/// The axes are the specular share ρ_s/(ρ_s + ρ_d) and the roughness σ; the prior is uniform over
/// the grid, and over the spectra of light.
///
/// ```
/// use lobes::inference::{BrightLights, ReflectanceGrid, natural_spectrum};
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
/// let (shares, sigmas) = ([0.0, 0.5, 1.0], [0.05, 0.1, 0.2]);
/// let spectra = [natural_spectrum(0.5, 16)];
/// let grid = ReflectanceGrid::new(Variant::Duer, &layout, &shares, &sigmas, &spectra, 1e-3, one)?;
/// let posterior = grid.posterior(&modes, &BrightLights::default(), 0.1)?;
/// assert!(posterior.share_marginal()[0] > 0.5, "the ball has no highlight");
/// # Ok::<(), lobes::Error>(())
/// ```
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
    /// A grid of [`Posterior::default_shares`] and [`Posterior::default_sigmas`], under light of η
    /// = 0 or 0.75, to degree 127, as pictures of 128 pixels a side ask for it.
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
            &Posterior::default_shares(),
            &Posterior::default_sigmas(),
            &[0.0, 0.75].map(|eta| natural_spectrum(eta, EVIDENCE_DEGREE)),
            GaussianEvidence::NOISE,
            parallelism,
        )
    }

    /// Factors for every share, every σ (0 is a mirror) and every spectrum of light, through the
    /// operator of `variant` to the degree of the shortest spectrum.
    ///
    /// # Errors
    /// An empty or unsorted axis, a share outside [0, 1], no spectrum, and what the operator
    /// refuses.
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
                return Err(Error::NotRising { what });
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
            return Err(Error::TooFew {
                what: "a posterior",
                items: "spectra of light",
                needed: 1,
                got: 0,
            });
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

    /// ln of the likelihood of each point, row by row, one row a roughness, of one channel of a
    /// picture with these bright lights: the mean over the spectra.
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
    /// `weight` is the power to which the likelihood is raised, at most 1: amplitudes of real light
    /// are not independent as the field's are, and counting each in full makes the posterior far
    /// too sure.
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
