//! How well two materials that differ in colour alone can be told apart: the ceiling of every
//! classifier.

use lobes::nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::protocol::Protocol;
use lobes::inference::Dataset;
use lobes::inference::{Reading, chromaticity};
use lobes::reflectance::Material;
use lobes::{Error, Result};

/// How often two materials can be told apart by the colour of their pictures, at the best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourCeiling {
    /// The index of the one material.
    pub first: usize,
    /// The index of the other.
    pub second: usize,
    /// The share of pictures of the two that the best rule names right.
    pub rate: f64,
    /// The 95 % interval of the rate, from the number of illuminations.
    pub interval: (f64, f64),
}

/// The rate at which the best rule tells apart two equally likely colours x = c + y and x = c′ + y,
/// where y is a Gaussian of which samples are given, and its 95 % interval.
///
/// With d = c′ − c and Σ the covariance of y the rate is Φ(δ/2), δ² = dᵀ Σ⁻¹ d: that of Fisher's
/// linear rule when all is known. Of n samples in p dimensions with the sample covariance S on m =
/// n − 1 degrees of freedom, δ² m / (dᵀ S⁻¹ d) follows χ² on m − p + 1 degrees of freedom (Muirhead
/// 1982, Theorem 3.2.12, doi:10.1002/9780470316559), which gives the interval; (m − p − 1)/m · dᵀ
/// S⁻¹ d is an unbiased estimate of δ².
///
/// # Errors
/// [`Error::Length`] for samples that are not of d's length; [`Error::TooFew`] for fewer than p + 3
/// samples.
fn separation(difference: &DVector<f64>, samples: &[DVector<f64>]) -> Result<(f64, (f64, f64))> {
    let dimensions = difference.len();
    for sample in samples {
        lobes::check_length("a sample of the light's colour", dimensions, sample.len())?;
    }
    if samples.len() < dimensions + 3 {
        return Err(Error::TooFew {
            what: "the spread of the light's colour",
            items: "illuminations",
            needed: dimensions + 3,
            got: samples.len(),
        });
    }
    let freedom = (samples.len() - 1) as f64;
    let mean = samples.iter().sum::<DVector<f64>>() / samples.len() as f64;
    let mut covariance = DMatrix::zeros(dimensions, dimensions);
    for sample in samples {
        let off = sample - &mean;
        covariance.ger(1.0 / freedom, &off, &off, 1.0);
    }
    // What never varies, such as the brightness of a matte sphere beside a white one, tells for
    // certain.
    let floor = 1e-12 * covariance.trace().max(1e-12);
    for i in 0..dimensions {
        covariance[(i, i)] += floor;
    }
    let solved = Cholesky::new(covariance)
        .ok_or_else(|| Error::NotPositiveDefinite {
            what: "the covariance of the light's colours".into(),
        })?
        .solve(difference);
    let squared = difference.dot(&solved);
    let rate = |squared: f64| Normal::standard().cdf(0.5 * squared.max(0.0).sqrt());
    let of = freedom - dimensions as f64;
    let chi = ChiSquared::new(of + 1.0).map_err(|_| Error::Domain {
        what: "the number of degrees of freedom of χ²",
        value: of + 1.0,
        allowed: "above 0",
    })?;
    let quantile = |level: f64| rate(squared * chi.inverse_cdf(level) / freedom);
    Ok((
        rate(squared * (of - 1.0) / freedom),
        (quantile(0.025), quantile(0.975)),
    ))
}

/// The ceilings of all pairs of materials that [differ in colour
/// alone](Material::differs_in_colour_alone), under one protocol.
///
/// The colour of a picture is that of the light, as the finish shows it, times that of the
/// material; where no highlight shows the light, only what is known of other light tells them
/// apart. The light's colour is taken for a Gaussian of ln R/G and ln B/G of the mean of the
/// picture and, where the protocol knows the exposure, of ln G beside a white sphere. Its spread is
/// that over the illuminations of the data set, each seen once; see [`ColourCeiling`].
///
/// It is a ceiling for whoever knows the mean colour alone: a classifier that sees more of the
/// light, such as a lamp whose colour gives it away, may pass it.
///
/// # Errors
/// [`Error::TooFew`] for fewer illuminations than the covariance needs, five or six.
pub fn colour_ceilings(
    protocol: Protocol,
    data: &Dataset<Reading>,
    materials: &[Material],
) -> Result<Vec<ColourCeiling>> {
    let colour = |reading: &Reading| {
        let mut colour = chromaticity(reading.mean).to_vec();
        if protocol.knows_exposure() {
            colour.push(reading.mean[1].max(1e-12).ln());
        }
        DVector::from_vec(colour)
    };
    let colours = |material: usize| -> Vec<DVector<f64>> {
        let judged = data.judged().into_iter().map(|i| &data.observations[i]);
        judged
            .filter(|observation| observation.material == material)
            .map(|observation| colour(&observation.view))
            .collect()
    };
    let mut ceilings = Vec::new();
    for second in 0..materials.len() {
        for first in 0..second {
            if !materials[first].differs_in_colour_alone(&materials[second]) {
                continue;
            }
            let (one, other) = (colours(first), colours(second));
            let pairs = || one.iter().zip(&other);
            let count = one.len().max(1) as f64;
            let difference = pairs().map(|(a, b)| b - a).sum::<DVector<f64>>() / count;
            let light: Vec<_> = pairs().map(|(a, b)| (a + b) * 0.5).collect();
            let (rate, interval) = separation(&difference, &light)?;
            ceilings.push(ColourCeiling {
                first,
                second,
                rate,
                interval,
            });
        }
    }
    Ok(ceilings)
}

/// The share of pictures that a classifier could name right which fails at nothing but at colours:
/// estimate, and the ends of its interval.
///
/// Of k materials that differ in colour alone, with r_ij the rate for two of them, the shares named
/// right cannot sum to more than 2 Σ_{i<j} r_ij / (k − 1), since of each two no more than 2 r_ij
/// can be right. All other materials count as told for certain.
pub fn best_share(ceilings: &[ColourCeiling], materials: usize) -> [f64; 3] {
    let rivals = |material: usize| {
        let of = |c: &&ColourCeiling| c.first == material || c.second == material;
        ceilings.iter().filter(of).count()
    };
    let sum = |of: fn(&ColourCeiling) -> f64| {
        let alone = (0..materials).filter(|&m| rivals(m) == 0).count() as f64;
        let pairs = ceilings.iter();
        let shared: f64 = pairs.map(|c| 2.0 * of(c) / rivals(c.first) as f64).sum();
        (alone + shared) / materials.max(1) as f64
    };
    [
        sum(|c| c.rate),
        sum(|c| c.interval.0),
        sum(|c| c.interval.1),
    ]
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Normal deviates by Box and Muller's transform.
    fn normal(rng: &mut Pcg64) -> f64 {
        let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
    }

    /// Two samples a fixed distance apart: one dimension, of standard deviation s, has the rate
    /// Φ(d/2s) up to the estimate's factor.
    #[test]
    fn one_dimension_has_a_closed_form() {
        let samples: Vec<_> = [-1.5, -0.5, 0.5, 1.5, 0.0]
            .map(|x| DVector::from_element(1, x))
            .to_vec();
        // The variance is 5/4, on four degrees of freedom, and of δ² half is left.
        let (rate, (low, high)) = separation(&DVector::from_element(1, 2.0), &samples).unwrap();
        let expected = Normal::standard().cdf(0.5 * (4.0 / 1.25 * 0.5_f64).sqrt());
        assert!((rate - expected).abs() < 1e-9, "{rate} for {expected}");
        // Φ(√(3.2 q/4)/2), q where 1 − e^(−q/2)(1 + q/2), the distribution of χ² on four degrees,
        // is 0.025 and 0.975; by bisection in Python.
        assert!((low - 0.622_199_077).abs() < 1e-8, "{low}");
        assert!((high - 0.932_264_238).abs() < 1e-8, "{high}");
    }

    /// The intervals hold the true rate as often as they say, and the estimate of δ² has no bias:
    /// samples of a known covariance.
    #[test]
    fn intervals_hold_the_truth() {
        let mut rng = Pcg64::seed_from_u64(3);
        let difference = DVector::from_vec(vec![0.5, -0.8]);
        // y = (a, a + 2b): Σ = [[1, 1], [1, 5]], Σ⁻¹ = [[5, −1], [−1, 1]]/4.
        let squared = (5.0 * 0.25 + 2.0 * 0.4 + 0.64) / 4.0;
        let truth = Normal::standard().cdf(0.5 * f64::sqrt(squared));
        let trials = 2000;
        let mut held = 0;
        for _ in 0..trials {
            let samples: Vec<_> = (0..17)
                .map(|_| {
                    let (a, b) = (normal(&mut rng), normal(&mut rng));
                    DVector::from_vec(vec![a, a + 2.0 * b])
                })
                .collect();
            let (_, (low, high)) = separation(&difference, &samples).unwrap();
            held += usize::from(low <= truth && truth <= high);
        }
        // Binomial: 1900 ± 9.7; four standard deviations are passed once in 16 000 seeds.
        assert!((1861..=1939).contains(&held), "{held} of {trials}");
    }

    #[test]
    fn few_lights_are_refused() {
        let samples = vec![DVector::from_element(2, 0.0); 4];
        assert!(separation(&DVector::from_element(2, 1.0), &samples).is_err());
    }

    #[test]
    fn the_best_share_counts_pairs_and_the_rest() {
        let pair = |first, second, rate| ColourCeiling {
            first,
            second,
            rate,
            interval: (0.5, 1.0),
        };
        // Two of four materials are confused half the time: three quarters are right.
        let share = best_share(&[pair(0, 1, 0.5)], 4);
        assert!((share[0] - 0.75).abs() < 1e-15 && share[2] == 1.0);
        // Three that nobody can tell apart are right one and a half times at most: the bound is not
        // sharp, and it is one.
        let share = best_share(&[pair(0, 1, 0.5), pair(0, 2, 0.5), pair(1, 2, 0.5)], 3);
        assert!((share[0] - 0.5).abs() < 1e-15);
    }
}
