//! Reading σ and the specular share off pictures of random reflectances.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::evidence::log_sum_exp;
use super::posterior::Posterior;
use super::protocol::{Parts, Plan, View};
use super::scenes::Scenes;
use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflection::{Camera, Renderer, SphereImage};
use crate::{Error, Parallelism, Result};

/// A reflectance as its picture shows it without an exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflectance {
    /// ρ_s / (ρ_s + ρ_d) of the luminance.
    pub share: f64,
    /// σ.
    pub sigma: f64,
}

/// One picture of a random reflectance, or what was read off it.
#[derive(Debug, Clone)]
pub struct Sample<T> {
    /// The index of its illumination.
    pub illumination: usize,
    /// Whether it is judged; the others are there to learn from.
    pub judged: bool,
    /// What it shows.
    pub truth: Reflectance,
    /// The picture, or what was read off it.
    pub view: T,
}

/// How random reflectances are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomReflectances {
    /// ln σ is uniform between these.
    pub sigmas: (f64, f64),
    /// The share is uniform between these.
    pub shares: (f64, f64),
    /// Roughnesses for each illumination and turn, one in each of as many equal parts of the range of ln σ.
    pub roughnesses: usize,
    /// Shares and colours for each roughness.
    pub colours: usize,
    /// The generator's seed.
    pub seed: u64,
}

impl Default for RandomReflectances {
    /// σ in 0.02 … 0.3, shares in 0.02 … 1, six roughnesses with four colours each.
    fn default() -> Self {
        Self {
            sigmas: (0.02, 0.3),
            shares: (0.02, 1.0),
            roughnesses: 6,
            colours: 4,
            seed: 1,
        }
    }
}

/// Renders spheres of random reflectances under each illumination, gives each picture, whether it is judged and a random number for noise to `read`, and keeps
/// what that gives.
///
/// A body has a random colour, each channel uniform in 0.1 … 1; half of the spheres have a white highlight, as plastics do, half one of the
/// body's colour, as metals do. The samples of turn 0 are judged.
///
/// # Errors
/// What the renderer or `read` finds wrong; [`Error::Unanswerable`] where nothing is asked for.
pub fn collect_random<T: Send>(
    view: View,
    illuminations: &[EnvironmentMap],
    random: &RandomReflectances,
    plan: &Plan,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
    read: &(dyn Fn(bool, u64, &SphereImage) -> Result<T> + Sync),
) -> Result<Vec<Sample<T>>> {
    if illuminations.is_empty() || plan.turns * random.roughnesses * random.colours == 0 {
        return Err(Error::Unanswerable(
            "random reflectances need an illumination, a turn, a roughness and a colour".into(),
        ));
    }
    collect_random_from(
        &view.cameras(plan.turns)?,
        illuminations,
        random,
        plan,
        parallelism,
        done,
        read,
    )
}

/// [`collect_random`], from cameras of any kind: a turn is one of them.
pub(super) fn collect_random_from<T: Send>(
    cameras: &[Camera],
    illuminations: &[EnvironmentMap],
    random: &RandomReflectances,
    plan: &Plan,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
    read: &(dyn Fn(bool, u64, &SphereImage) -> Result<T> + Sync),
) -> Result<Vec<Sample<T>>> {
    let groups = parallelism.map(illuminations.len(), |illumination| {
        // One generator an illumination: the draws do not depend on who comes first.
        let seed = random.seed.wrapping_mul(1 << 32) + illumination as u64;
        let mut rng = Pcg64::seed_from_u64(seed);
        let renderer = Renderer::new(&illuminations[illumination], Parallelism::Sequential)?;
        let mut samples = Vec::new();
        for (turn, camera) in cameras.iter().enumerate() {
            let (low, high) = (random.sigmas.0.ln(), random.sigmas.1.ln());
            let sigmas: Vec<f64> = (0..random.roughnesses)
                .map(|i| {
                    let place = (i as f64 + rng.random::<f64>()) / random.roughnesses as f64;
                    (low + place * (high - low)).exp()
                })
                .collect();
            let all = sigmas.iter().copied();
            let parts = Parts::new(&renderer, camera, all, plan.lobe, &plan.settings)?;
            let judged = turn == 0;
            for &sigma in &sigmas {
                for _ in 0..random.colours {
                    let (low, high) = random.shares;
                    let share = low + (high - low) * rng.random::<f64>();
                    let colour: [f64; 3] = std::array::from_fn(|_| 0.1 + 0.9 * rng.random::<f64>());
                    let luminance = Luminance::Rec709.of(colour);
                    let body = colour.map(|c| c / luminance);
                    let gloss = if rng.random::<bool>() { [1.0; 3] } else { body };
                    let image = parts.sphere(
                        body.map(|c| (1.0 - share) * c),
                        gloss.map(|c| share * c),
                        sigma,
                        parts.white.recip(),
                    )?;
                    samples.push(Sample {
                        illumination,
                        judged,
                        truth: Reflectance { share, sigma },
                        view: read(judged, rng.random(), &image)?,
                    });
                }
            }
        }
        done();
        Ok(samples)
    });
    let mut samples = Vec::new();
    for group in groups {
        samples.extend(group?);
    }
    Ok(samples)
}

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
/// The features of a picture are taken as Gaussian about means that are smooth in (share, σ), with one covariance: what light
/// does to them is the noise. With prior uniform in the share and ln σ, p(share, σ | x) ∝ exp(−w/2 |L⁻¹(x − Bᵀφ(share, σ))|²), L Lᵀ the covariance. Features are many and not quite
/// Gaussian, so the likelihood has a weight w, which an inner loop over the illuminations chooses by the probability that it gives to the truth.
///
/// Only Aᵀ L⁻¹ x, A = L⁻¹ Bᵀ, depends on the picture, so that a posterior costs a solve and one small product a point.
#[derive(Debug)]
pub struct LearnedPosterior {
    features: Vec<DVector<f64>>,
    truths: Vec<Reflectance>,
    illuminations: Vec<usize>,
    judged: Vec<bool>,
    scenes: Scenes,
    centre: DVector<f64>,
    moments: Vec<Moments>,
    shares: Vec<f64>,
    sigmas: Vec<f64>,
    /// φ at every point of the grid, row by row.
    points: Vec<DVector<f64>>,
}

#[derive(Debug, Clone)]
struct Moments {
    /// Σ φ φᵀ.
    design: DMatrix<f64>,
    /// Σ φ xᵀ.
    cross: DMatrix<f64>,
    /// Σ x xᵀ.
    squares: DMatrix<f64>,
    count: f64,
}

/// A [`LearnedPosterior`] with what it has learned from some of the illuminations.
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
    /// Twenty-five specular shares from 0 to 1.
    pub fn shares() -> Vec<f64> {
        (0..25).map(|i| f64::from(i) / 24.0).collect()
    }

    /// Twenty roughnesses from 0.015 to 0.4, evenly in ln σ.
    pub fn sigmas() -> Vec<f64> {
        let ratio = (0.4f64 / 0.015).ln();
        (0..20)
            .map(|i| 0.015 * (ratio * f64::from(i) / 19.0).exp())
            .collect()
    }

    /// The moments of the features of samples, for posteriors on a grid of `shares` and `sigmas`, both rising.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a feature that is not finite, [`Error::Length`] where samples differ in how many they have,
    /// [`Error::Unanswerable`] without a sample or for an axis of fewer than two values.
    pub fn new(samples: &[Sample<Vec<f64>>], shares: &[f64], sigmas: &[f64]) -> Result<Self> {
        if samples.is_empty() || shares.len() < 2 || sigmas.len() < 2 {
            return Err(Error::Unanswerable(
                "a posterior is learned from samples, on axes of two values or more".into(),
            ));
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
                Moments {
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
    /// Unless the sample is one of those that were learned from.
    pub fn truth(&self, sample: usize) -> Reflectance {
        self.truths[sample]
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
            return Err(Error::Unanswerable(format!(
                "a posterior is learned from {} samples or more; there are {count}",
                2 * width
            )));
        }
        let refused =
            || Error::Unanswerable("the samples' reflectances are too few or too alike".into());
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

    /// ln-likelihoods of every sample of the illuminations that are seen, by what was learned from those of other scenes.
    fn inner_loop(&self, seen: &[bool]) -> Result<Vec<(usize, Vec<f64>)>> {
        let folds = self.scenes.among(seen);
        if folds.len() < 2 {
            return Err(Error::Unanswerable(
                "weighing a likelihood needs two scenes to learn from, or more".into(),
            ));
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

    /// How much probability posteriors give to the truth: Σ ln p, of samples and the ln-likelihoods of the grid's points.
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

    /// Learns from the illuminations that are seen; the weight is chosen among them, leaving one scene out at a time.
    ///
    /// # Errors
    /// [`Error::Unanswerable`] for fewer than two scenes or too few samples.
    pub fn learn(&self, seen: &[bool]) -> Result<PosteriorModel> {
        let logs = self.inner_loop(seen)?;
        self.fit(seen, self.weight(&logs))
    }

    /// The weight at which the truths of an inner loop are likeliest.
    fn weight(&self, logs: &[(usize, Vec<f64>)]) -> f64 {
        let weights = (0..=16).map(|i| 10f64.powf(-2.0 + 0.125 * f64::from(i)));
        likeliest(weights, |weight| self.score(logs.iter().cloned(), weight))
    }

    /// The posteriors of every judged sample, by what has seen nothing of its illumination's scene: by what is learned, by evidence, and by both.
    ///
    /// `evidence[i]` are the ln-likelihoods that [`ReflectanceGrid`](super::ReflectanceGrid) gives sample i on the same shares and roughnesses; those of samples that are not judged
    /// are not used. The weights are chosen by the inner loop: that of evidence, which learns nothing else, and, beside the learned posterior at its own weight, that of what evidence says of σ.
    ///
    /// # Errors
    /// Those of [`Self::learn`]; [`Error::Length`] for evidence of other samples or of another grid.
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
#[derive(Debug, Clone)]
pub struct JudgedPosteriors {
    /// What it shows.
    pub truth: Reflectance,
    /// By what was learned from pictures under other illuminations.
    pub learned: Posterior,
    /// By [`GaussianEvidence`](super::GaussianEvidence), of which one weight is learned and nothing else.
    pub evidence: Posterior,
    /// By both.
    pub both: Posterior,
}

/// How well posteriors know the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// How many pictures.
    pub count: usize,
    /// The median of |σ̂ − σ| / σ, σ̂ the posterior's median.
    pub sigma_error: f64,
    /// The median of the absolute error of the share's median.
    pub share_error: f64,
    /// (level, coverage of σ, coverage of the share) of the central credible intervals.
    pub coverage: Vec<(f64, f64, f64)>,
}

impl Calibration {
    /// From truths and posteriors.
    pub fn of(results: &[(Reflectance, &Posterior)]) -> Self {
        let median = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let mut sigma: Vec<f64> = results
            .iter()
            .map(|(t, p)| (p.sigma_quantile(0.5) - t.sigma).abs() / t.sigma)
            .collect();
        let mut share: Vec<f64> = results
            .iter()
            .map(|(t, p)| (p.share_quantile(0.5) - t.share).abs())
            .collect();
        let levels = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];
        let coverage = levels.map(|level| {
            let (low, high) = (0.5 - 0.5 * level, 0.5 + 0.5 * level);
            let part = |inside: &dyn Fn(&(Reflectance, &Posterior)) -> bool| {
                results.iter().filter(|r| inside(r)).count() as f64 / results.len().max(1) as f64
            };
            (
                level,
                part(&|(t, p)| (p.sigma_quantile(low)..=p.sigma_quantile(high)).contains(&t.sigma)),
                part(&|(t, p)| (p.share_quantile(low)..=p.share_quantile(high)).contains(&t.share)),
            )
        });
        Self {
            count: results.len(),
            sigma_error: median(&mut sigma),
            share_error: median(&mut share),
            coverage: coverage.to_vec(),
        }
    }
}
