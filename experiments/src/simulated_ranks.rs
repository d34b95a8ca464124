//! Simulation-based calibration of the evidence.

use lobes::features::RingLayout;
use lobes::inference::{
    BrightLights, GaussianEvidence, SmoothModes, SmoothOperator, log_sum_exp, natural_spectrum,
};
use lobes::reflectance::Variant;
use lobes::reflection::{Operator, Viewpoint};
use lobes::{Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::prior_light::{DEGREE, DIRECTIONS, NOISE, ORDERS, PriorDraw, RINGS};

/// Ranks of one parameter among its posteriors: uniform in 0 … 1 if the code is right.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRanks {
    /// Of what.
    pub parameter: &'static str,
    /// One of each draw.
    pub ranks: Vec<f64>,
}

impl SimulatedRanks {
    /// Into so many bins the ranks are sorted.
    pub const BINS: usize = 20;

    /// χ² of the bins beside equal counts, and the probability of more of code that is right.
    pub fn uniformity(&self) -> (f64, f64) {
        let mut counts = [0.0; Self::BINS];
        for rank in &self.ranks {
            counts[((rank * Self::BINS as f64) as usize).min(Self::BINS - 1)] += 1.0;
        }
        let expected = self.ranks.len() as f64 / Self::BINS as f64;
        let squares = counts.iter().map(|count| (count - expected).powi(2));
        let square = squares.sum::<f64>() / expected;
        let law = ChiSquared::new((Self::BINS - 1) as f64);
        (square, law.map_or(f64::NAN, |law| law.sf(square)))
    }
}

/// Ranks of σ, of the specular share and of the strength among their posteriors, over draws of the
/// model's own prior.
///
/// σ, the specular share and the spectrum of the light are drawn evenly from a grid, the light from
/// its Gaussian field with two lamps, the strength k from any law (here 10^(−1 … 1)), and the
/// noise; the posterior is taken on the same grid with [`GaussianEvidence`]. If the code is right,
/// P(parameter below the true one) + U P(that one), U uniform, is uniform (Talts et al. 2018,
/// arXiv:1804.06788; Cook, Gelman and Rubin 2006, doi:10.1198/106186006X136976). Of the strength,
/// which is all that the model knows of base colour and exposure, it is P(k below the true one),
/// whatever the law, since 1/k is the scale's own prior.
///
/// # Errors
/// What the operator and the evidence refuse.
pub fn simulated_ranks(draws: usize, parallelism: Parallelism) -> Result<[SimulatedRanks; 3]> {
    let one = Parallelism::Sequential;
    let layout = RingLayout::new(Viewpoint::Orthographic, RINGS, ORDERS)?;
    let sigmas: Vec<f64> = (0..6).map(|i| 0.04 * 1.5f64.powi(i)).collect();
    let shares: Vec<f64> = (0..6).map(|i| 0.1 + 0.16 * f64::from(i)).collect();
    let spectra = [0.2, 0.8].map(|eta| natural_spectrum(eta, DEGREE));
    let operators = sigmas
        .iter()
        .map(|sigma| {
            let (lobe, view) = (Variant::default(), Viewpoint::Orthographic);
            let operator = Operator::new(lobe, *sigma, view, layout.angles(), DEGREE, one)?;
            let smooth = SmoothOperator::new(&operator, &layout)?;
            Ok((operator, smooth))
        })
        .collect::<Result<Vec<_>>>()?;
    // σ, share, spectrum.
    let mut points = Vec::new();
    for sigma in 0..sigmas.len() {
        for share in 0..shares.len() {
            for spectrum in 0..spectra.len() {
                points.push((sigma, share, spectrum));
            }
        }
    }
    let factors = parallelism.map(points.len(), |i| {
        let (sigma, share, spectrum) = points[i];
        let share = shares[share];
        let smooth = &operators[sigma].1;
        GaussianEvidence::new(smooth, &spectra[spectrum], 1.0 - share, share, NOISE)
    });
    let factors = factors.into_iter().collect::<Result<Vec<_>>>()?;
    let lamps = BrightLights::from_directions(DIRECTIONS.to_vec());
    let responses = operators
        .iter()
        .map(|(_, smooth)| smooth.responses(&lamps))
        .collect::<Result<Vec<_>>>()?;
    let count = layout.len() as f64;
    let amplitudes = ChiSquared::new(count).ok();
    let ranks = parallelism.map(draws, |draw| -> Result<[f64; 3]> {
        let mut rng = Pcg64::seed_from_u64(1_000_003 + draw as u64);
        let (sigma, share, spectrum) = points[rng.random_range(0..points.len())];
        let strength = 10f64.powf(2.0 * rng.random::<f64>() - 1.0);
        let (operator, power) = (&operators[sigma].0, &spectra[spectrum]);
        let of = [1.0 - shares[share], shares[share]];
        let drawn = PriorDraw::new(operator, &layout, power, of, strength, &mut rng)?;
        let modes = SmoothModes::new(&drawn.modes, &layout)?;
        let evidence = points
            .iter()
            .zip(&factors)
            .map(|((sigma, _, _), factor)| factor.of(&modes, &responses[*sigma]))
            .collect::<Result<Vec<_>>>()?;
        let all = log_sum_exp(evidence.iter().map(|of| of.log));
        let weights: Vec<f64> = evidence.iter().map(|of| (of.log - all).exp()).collect();
        let mut rank = |index: &dyn Fn(&(usize, usize, usize)) -> usize, truth: usize| {
            let mass = |which: std::cmp::Ordering| -> f64 {
                let of = points.iter().zip(&weights);
                of.filter(|(point, _)| index(point).cmp(&truth) == which)
                    .map(|(_, weight)| weight)
                    .sum()
            };
            mass(std::cmp::Ordering::Less) + rng.random::<f64>() * mass(std::cmp::Ordering::Equal)
        };
        let of_sigma = rank(&|point| point.0, sigma);
        let of_share = rank(&|point| point.1, share);
        let below = |log_strength: f64| {
            let ratio = count * log_strength.exp() / strength;
            amplitudes.as_ref().map_or(f64::NAN, |chi| chi.sf(ratio))
        };
        let of_strength = evidence
            .iter()
            .zip(&weights)
            .map(|(of, weight)| weight * below(of.log_strength))
            .sum();
        Ok([of_sigma, of_share, of_strength])
    });
    let ranks = ranks.into_iter().collect::<Result<Vec<_>>>()?;
    let of = |which: usize, parameter| SimulatedRanks {
        parameter,
        ranks: ranks.iter().map(|of| of[which]).collect(),
    };
    Ok([
        of(0, "σ"),
        of(1, "the specular share"),
        of(2, "the strength"),
    ])
}
