//! A posterior of σ and the specular share that is learned from pictures of known reflectances.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::evidence::log_sum_exp;
use super::posterior::{Posterior, Reflectance};
use super::random_reflectances::Sample;
use super::scenes::Scenes;
use crate::error::check_count;
use crate::{Error, Parallelism, Result};

/// The functions of (share, σ) by whose sums the mean of every feature is modelled.
fn functions(at: Reflectance) -> DVector<f64> {
    let (s, t) = (at.share, (at.share + 0.03).ln());
    // Centred on the middle of the range.
    let v = (at.sigma.max(1e-3) / 0.08).ln();
    DVector::from_vec(vec![
        1.0,
        s,
        t,
        s * s,
        t * t,
        v,
        v * v,
        v * v * v,
        s * v,
        t * v,
        s * s * v,
        t * t * v,
        s * v * v,
        t * v * v,
        s * s * s,
        t * t * t,
        v * v * v * v,
        s * s * v * v,
        t * t * v * v,
        s * v * v * v,
        t * v * v * v,
    ])
}

/// How far the covariance is drawn to its diagonal.
const SHRINKAGE: f64 = 0.2;

/// A posterior over (share, σ) that is learned from pictures of known reflectances.
///
/// The features of a picture are taken as Gaussian about means that are smooth in (share, σ), with
/// one covariance: what light does to them is the noise. With prior uniform in the share and ln σ,
/// p(share, σ | x) ∝ exp(−w/2 |L⁻¹(x − Bᵀφ(share, σ))|²), L Lᵀ the covariance. Features are many
/// and not quite Gaussian, so the likelihood has a weight w, which an inner loop over the
/// illuminations chooses by the probability that it gives to the truth.
///
/// Only Aᵀ L⁻¹ x, A = L⁻¹ Bᵀ, depends on the picture, so that a posterior costs a solve and one
/// small product a point.
///
/// ```
/// use lobes::inference::{LearnedPosterior, Reflectance, Sample};
/// // Under each of three lights 64 spheres, off which the share and ln σ can be read, but for what the
/// // light adds.
/// let samples: Vec<_> = (0..3 * 64).map(|i| {
///     let (light, place) = (i / 64, i % 64);
///     let truth = Reflectance {
///         share: (place % 8) as f64 / 7.0,
///         sigma: 0.02 * 10f64.powf((place / 8) as f64 / 7.0),
///     };
///     let noise = |k: usize| 0.02 * (1.7 * (i * (k + 1)) as f64).sin();
///     let view = vec![truth.share + noise(1), truth.sigma.ln() + noise(2)];
///     Sample { illumination: light, judged: true, truth, view }
/// }).collect();
/// let shares: Vec<f64> = (0..21).map(|i| i as f64 / 20.0).collect();
/// let sigmas: Vec<f64> = (0..21).map(|i| 0.02 * 10f64.powf(i as f64 / 20.0)).collect();
/// let model = LearnedPosterior::new(&samples, &shares, &sigmas)?.learn(&[true; 3])?;
/// let posterior = model.posterior(&[0.5, 0.06f64.ln()])?;
/// assert!((posterior.share_quantile(0.5) - 0.5).abs() < 0.05);
/// assert!((posterior.sigma_quantile(0.5) / 0.06 - 1.0).abs() < 0.1);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug)]
pub struct LearnedPosterior {
    features: Vec<DVector<f64>>,
    truths: Vec<Reflectance>,
    illuminations: Vec<usize>,
    judged: Vec<bool>,
    scenes: Scenes,
    centre: DVector<f64>,
    moments: Vec<DesignMoments>,
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    /// φ at every point of the grid, row by row.
    points: Vec<DVector<f64>>,
}

#[derive(Debug, Clone)]
struct DesignMoments {
    /// Σ φ φᵀ.
    design: DMatrix<f64>,
    /// Σ φ xᵀ.
    cross: DMatrix<f64>,
    /// Σ x xᵀ.
    squares: DMatrix<f64>,
    count: f64,
}

/// A [`LearnedPosterior`] with what it has learned from some of the illuminations.
///
/// ```
/// use lobes::inference::PosteriorModel;
/// /// σ, and the ends of the interval that holds it with a probability of 90 %.
/// fn sigma(model: &PosteriorModel, features: &[f64]) -> lobes::Result<[f64; 3]> {
///     let posterior = model.posterior(features)?;
///     Ok([0.5, 0.05, 0.95].map(|level| posterior.sigma_quantile(level)))
/// }
/// ```
#[derive(Debug, Clone)]
pub struct PosteriorModel {
    centre: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    /// A = L⁻¹ Bᵀ.
    whitened: DMatrix<f64>,
    /// ½ |A φ|² of every point of the grid.
    half_squares: Vec<f64>,
    points: Vec<DVector<f64>>,
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    weight: f64,
}

impl PosteriorModel {
    /// The posterior of a picture with these features.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of features than were learned.
    pub fn posterior(&self, features: &[f64]) -> Result<Posterior> {
        crate::error::check_length(
            "the features of a picture",
            self.centre.len(),
            features.len(),
        )?;
        let centred = DVector::from_column_slice(features) - &self.centre;
        Ok(self.of_centred(&centred, self.weight))
    }

    fn of_centred(&self, features: &DVector<f64>, weight: f64) -> Posterior {
        self.weighed(&self.log_likelihoods(features), weight)
    }

    /// ln of the likelihood of each point but for what all share.
    fn log_likelihoods(&self, features: &DVector<f64>) -> Vec<f64> {
        let mut white = features.clone();
        self.factor.l_dirty().solve_lower_triangular_mut(&mut white);
        let projection = self.whitened.tr_mul(&white);
        self.points
            .iter()
            .zip(&self.half_squares)
            .map(|(point, half)| projection.dot(point) - half)
            .collect()
    }

    fn weighed(&self, logs: &[f64], weight: f64) -> Posterior {
        let logs = logs.iter().map(|log| weight * log).collect();
        Posterior::of_likelihoods(&self.shares, &self.sigmas, logs)
    }

    /// The weight of the likelihood.
    pub fn weight(&self) -> f64 {
        self.weight
    }
}

impl LearnedPosterior {
    /// The moments of the features of samples, for posteriors on a grid of `shares` and `sigmas`,
    /// both rising.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a feature that is not finite, [`Error::Length`] where samples
    /// differ in how many they have, [`Error::TooFew`] without a sample or for an axis of fewer
    /// than two values.
    pub fn new(samples: &[Sample<Vec<f64>>], shares: &[f64], sigmas: &[f64]) -> Result<Self> {
        for (items, needed, got) in [
            ("samples", 1, samples.len()),
            ("specular shares", 2, shares.len()),
            ("roughnesses", 2, sigmas.len()),
        ] {
            check_count("a learned posterior", items, needed, got)?;
        }
        let size = samples[0].view.len();
        let mut features = Vec::with_capacity(samples.len());
        let mut centre = DVector::zeros(size);
        for sample in samples {
            crate::error::check_length("the features of a picture", size, sample.view.len())?;
            crate::error::check_finite("the features of a picture", &sample.view)?;
            let row = DVector::from_column_slice(&sample.view);
            centre += &row;
            features.push(row);
        }
        centre /= samples.len() as f64;
        for row in &mut features {
            *row -= &centre;
        }
        let count = 1 + samples.iter().map(|s| s.illumination).max().unwrap_or(0);
        let moments = (0..count)
            .map(|illumination| {
                let of: Vec<usize> = (0..samples.len())
                    .filter(|&i| samples[i].illumination == illumination)
                    .collect();
                let designs: Vec<DVector<f64>> =
                    of.iter().map(|&i| functions(samples[i].truth)).collect();
                let width = functions(samples[0].truth).len();
                let design = DMatrix::from_fn(width, of.len(), |row, i| designs[i][row]);
                let rows = DMatrix::from_fn(size, of.len(), |row, i| features[of[i]][row]);
                DesignMoments {
                    cross: &design * rows.transpose(),
                    squares: &rows * rows.transpose(),
                    count: of.len() as f64,
                    design: &design * design.transpose(),
                }
            })
            .collect();
        let points = sigmas
            .iter()
            .flat_map(|&sigma| {
                shares
                    .iter()
                    .map(move |&share| functions(Reflectance { share, sigma }))
            })
            .collect();
        Ok(Self {
            features,
            truths: samples.iter().map(|s| s.truth).collect(),
            illuminations: samples.iter().map(|s| s.illumination).collect(),
            judged: samples.iter().map(|s| s.judged).collect(),
            scenes: Scenes::default(),
            centre,
            moments,
            shares: shares.to_vec(),
            sigmas: sigmas.to_vec(),
            points,
        })
    }

    /// With the scenes that the illuminations belong to: those of one are left out together.
    #[must_use]
    pub fn with_scenes(mut self, scenes: &Scenes) -> Self {
        self.scenes = scenes.clone();
        self
    }

    /// The samples that are judged.
    pub fn judged(&self) -> Vec<usize> {
        (0..self.judged.len()).filter(|&i| self.judged[i]).collect()
    }

    /// What a sample shows.
    ///
    /// # Panics
    /// Unless the sample is one of those that were learned from: [`get_truth`](Self::get_truth) says
    /// so.
    pub fn truth(&self, sample: usize) -> Reflectance {
        self.truths[sample]
    }

    /// [`truth`](Self::truth), or nothing for a sample that was not learned from.
    pub fn get_truth(&self, sample: usize) -> Option<Reflectance> {
        self.truths.get(sample).copied()
    }

    /// Learns from the illuminations that are seen, with a weight of the likelihood.
    fn fit(&self, seen: &[bool], weight: f64) -> Result<PosteriorModel> {
        let (width, size) = self.moments[0].cross.shape();
        let mut design = DMatrix::zeros(width, width);
        let mut cross = DMatrix::zeros(width, size);
        let mut scatter = DMatrix::zeros(size, size);
        let mut count = 0.0;
        for (moments, _) in self.moments.iter().zip(seen).filter(|(_, seen)| **seen) {
            design += &moments.design;
            cross += &moments.cross;
            scatter += &moments.squares;
            count += moments.count;
        }
        if count < 2.0 * width as f64 {
            return Err(Error::TooFew {
                what: "a learned posterior",
                items: "samples",
                needed: 2 * width,
                got: count as usize,
            });
        }
        let refused = || Error::NotPositiveDefinite {
            what: "what the samples say of their reflectances".into(),
        };
        for i in 0..width {
            design[(i, i)] += 1e-9 * count;
        }
        // B minimises Σ |x − Bᵀφ|²; what is left is the covariance.
        let means = Cholesky::new(design).ok_or_else(refused)?.solve(&cross);
        scatter -= cross.tr_mul(&means);
        scatter /= count;
        let diagonal = scatter.diagonal();
        let largest = diagonal.max();
        scatter *= 1.0 - SHRINKAGE;
        for i in 0..size {
            scatter[(i, i)] += SHRINKAGE * diagonal[i] + 1e-9 * largest.max(1e-12);
        }
        let factor = Cholesky::new(scatter).ok_or_else(refused)?;
        let mut whitened = means.transpose();
        factor.l_dirty().solve_lower_triangular_mut(&mut whitened);
        let gram = whitened.tr_mul(&whitened);
        let half_squares = self
            .points
            .iter()
            .map(|point| 0.5 * point.dot(&(&gram * point)))
            .collect();
        Ok(PosteriorModel {
            centre: self.centre.clone(),
            factor,
            whitened,
            half_squares,
            points: self.points.clone(),
            shares: self.shares.clone(),
            sigmas: self.sigmas.clone(),
            weight,
        })
    }

    /// ln-likelihoods of every sample of the illuminations that are seen, by what was learned from
    /// those of other scenes.
    fn inner_loop(&self, seen: &[bool]) -> Result<Vec<(usize, Vec<f64>)>> {
        let folds = self.scenes.among(seen);
        if folds.len() < 2 {
            return Err(Error::TooFew {
                what: "weighing a likelihood",
                items: "scenes",
                needed: 2,
                got: folds.len(),
            });
        }
        let mut logs = Vec::new();
        for left_out in folds {
            let inner = self.scenes.others(seen, left_out);
            let model = self.fit(&inner, 1.0)?;
            let of = (0..self.features.len())
                .filter(|&i| seen[self.illuminations[i]] && !inner[self.illuminations[i]]);
            logs.extend(of.map(|i| (i, model.log_likelihoods(&self.features[i]))));
        }
        Ok(logs)
    }

    /// How much probability posteriors give to the truth: Σ ln p, of samples and the ln-likelihoods
    /// of the grid's points.
    fn score(&self, judged: impl Iterator<Item = (usize, Vec<f64>)>, weight: f64) -> f64 {
        judged
            .map(|(i, mut logs)| {
                for log in &mut logs {
                    *log *= weight;
                }
                let posterior = Posterior::of_likelihoods(&self.shares, &self.sigmas, logs);
                posterior.log_density(self.truths[i].share, self.truths[i].sigma)
            })
            .sum()
    }

    /// Learns from the illuminations that are seen; the weight is chosen among them, leaving one
    /// scene out at a time.
    ///
    /// # Errors
    /// [`Error::TooFew`] for fewer than two scenes or too few samples.
    pub fn learn(&self, seen: &[bool]) -> Result<PosteriorModel> {
        let logs = self.inner_loop(seen)?;
        self.fit(seen, self.weight(&logs))
    }

    /// The weight at which the truths of an inner loop are likeliest.
    fn weight(&self, logs: &[(usize, Vec<f64>)]) -> f64 {
        let weights = (0..=16).map(|i| 10f64.powf(-2.0 + 0.125 * f64::from(i)));
        likeliest(weights, |weight| self.score(logs.iter().cloned(), weight))
    }

    /// The posteriors of every judged sample, by what has seen nothing of its illumination's scene:
    /// by what is learned, by evidence, and by both.
    ///
    /// `evidence[i]` are the ln-likelihoods that [`ReflectanceGrid`](super::ReflectanceGrid) gives
    /// sample i on the same shares and roughnesses; those of samples that are not judged are not
    /// used. The weights are chosen by the inner loop: that of evidence, which learns nothing else,
    /// and, beside the learned posterior at its own weight, that of what evidence says of σ.
    ///
    /// # Errors
    /// Those of [`Self::learn`]; [`Error::Length`] for evidence of other samples or of another
    /// grid.
    pub fn leave_one_illumination_out(
        &self,
        evidence: &[Option<Vec<f64>>],
        parallelism: Parallelism,
    ) -> Result<Vec<JudgedPosteriors>> {
        crate::error::check_length(
            "the evidence of samples",
            self.features.len(),
            evidence.len(),
        )?;
        let judged = self.judged();
        for &i in &judged {
            let given = evidence[i].as_ref().map_or(0, Vec::len);
            crate::error::check_length("the evidence of a sample", self.points.len(), given)?;
        }
        let all = vec![true; self.moments.len()];
        let scenes = self.scenes.among(&all);
        let folds = parallelism.map(scenes.len(), |fold| {
            let seen = self.scenes.others(&all, scenes[fold]);
            let logs = self.inner_loop(&seen)?;
            let own = self.weight(&logs);
            let model = self.fit(&seen, own)?;
            let of_evidence = |i: usize| evidence[i].as_deref().unwrap_or_default();
            // Of evidence the roughness alone: how much a body adds to the gloss it does not know.
            let both = |learned: &[f64], i: usize, weight: f64| -> Vec<f64> {
                let rows = learned.chunks(self.shares.len());
                rows.zip(of_evidence(i).chunks(self.shares.len()))
                    .flat_map(|(learned, evidence)| {
                        let roughness = weight * log_sum_exp(evidence.iter().copied());
                        learned.iter().map(move |log| own * log + roughness)
                    })
                    .collect()
            };
            let known: Vec<&(usize, Vec<f64>)> =
                logs.iter().filter(|(i, _)| self.judged[*i]).collect();
            let weights = || (0..=28).map(|i| 10f64.powf(-3.5 + 0.125 * f64::from(i)));
            let alone = likeliest(weights(), |weight| {
                self.score(
                    known.iter().map(|(i, _)| (*i, of_evidence(*i).to_vec())),
                    weight,
                )
            });
            let beside = likeliest(weights(), |weight| {
                let sums = known.iter().map(|(i, logs)| (*i, both(logs, *i, weight)));
                self.score(sums, 1.0)
            });
            let posteriors = judged
                .iter()
                .copied()
                .filter(|&i| !seen[self.illuminations[i]])
                .map(|i| {
                    let learned = model.log_likelihoods(&self.features[i]);
                    JudgedPosteriors {
                        truth: self.truths[i],
                        evidence: model.weighed(of_evidence(i), alone),
                        both: model.weighed(&both(&learned, i, beside), 1.0),
                        learned: model.weighed(&learned, model.weight),
                    }
                })
                .collect::<Vec<_>>();
            Ok(posteriors)
        });
        let mut all = Vec::new();
        for fold in folds {
            all.extend(fold?);
        }
        Ok(all)
    }
}

/// The value with the largest score.
fn likeliest(values: impl Iterator<Item = f64>, score: impl Fn(f64) -> f64) -> f64 {
    let scored = values.map(|value| (score(value), value));
    scored
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(1.0, |best| best.1)
}

/// What three readers say of one picture.
///
/// ```
/// use lobes::inference::JudgedPosteriors;
/// /// How often the interval that should hold σ in nine cases of ten does.
/// fn coverage(judged: &[JudgedPosteriors]) -> f64 {
///     let holds = |of: &&JudgedPosteriors| {
///         let [low, high] = [0.05, 0.95].map(|level| of.both.sigma_quantile(level));
///         (low..=high).contains(&of.truth.sigma)
///     };
///     judged.iter().filter(holds).count() as f64 / judged.len() as f64
/// }
/// ```
#[derive(Debug, Clone)]
pub struct JudgedPosteriors {
    /// What it shows.
    pub truth: Reflectance,
    /// By what was learned from pictures under other illuminations.
    pub learned: Posterior,
    /// By [`GaussianEvidence`](super::GaussianEvidence), of which one weight is learned and nothing
    /// else.
    pub evidence: Posterior,
    /// By both.
    pub both: Posterior,
}
