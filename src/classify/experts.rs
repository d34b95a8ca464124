//! Experts: each says how likely every material is for a picture, and a stack weighs them.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::evaluate::Classifier;
use super::evidence::{GaussianEvidence, log_sum_exp};
use super::protocol::Dataset;
use super::reading::{Reader, Reading};
use super::scenes::Scenes;
use super::smooth_operator::{SmoothModes, SmoothOperator};
use crate::features::RingLayout;
use crate::harmonics::average_power;
use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflectance::{Material, Variant};
use crate::reflection::OperatorSet;
use crate::{Error, Parallelism, Result};

/// How likely each material is for one picture of a data set, to whoever has seen some of the illuminations.
pub trait Expert: Sync {
    /// What tables call it.
    fn name(&self) -> String;

    /// ln-likelihoods, up to one constant a picture, of each material for each observation in `observations`.
    /// `seen[i]` says whether anything may have been learned from illumination i.
    ///
    /// # Errors
    /// What makes learning impossible.
    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>>;
}

/// [`GaussianEvidence`] of named materials, the light's spectrum being that of one of the illuminations that were seen.
///
/// Natural spectra differ, above all in how much power bright small lights put at high degrees, where no power law is
/// right. So the prior of the spectrum is the set of measured ones, each as likely as the others: ln p(picture) is the
/// logarithm of the mean likelihood over them. Channels have one reflectance, one roughness and one spectrum, and a
/// strength of light each, which is integrated out: the colour of the light is unknown.
///
/// Suns and lamps, which are no draw from a Gaussian field, are lights of their own. Two limits. Materials whose pictures differ by exposure only, such as a grey
/// and a white matte one, have the same evidence, and no method tells them apart without the exposure. And a Gaussian field knows no light that is
/// negative: roughness is read well, how much a body adds to the gloss is not.
#[derive(Debug, Clone)]
pub struct EvidenceExpert {
    /// evidence[observation][material][illumination whose spectrum it is], channels added; empty where the picture was not
    /// read for it.
    evidence: Vec<Vec<Vec<f64>>>,
}

impl EvidenceExpert {
    /// The evidence of every picture of `dataset` that has a [`Reading::judged`] for every one of `materials` under every
    /// spectrum of `spectra`. `layout` is that of the modes.
    ///
    /// `spectra[i]` is the average power B_l of the light of illumination i, to the degree of the operator or beyond.
    ///
    /// # Errors
    /// Pictures too small, a spectrum too short, and what the operator refuses.
    #[expect(
        clippy::too_many_arguments,
        reason = "each is one thing that the evidence depends on"
    )]
    pub fn new(
        dataset: &Dataset<Reading>,
        materials: &[Material],
        variant: Variant,
        layout: &RingLayout,
        degree: usize,
        spectra: &[Vec<f64>],
        noise: f64,
        parallelism: Parallelism,
    ) -> Result<Self> {
        // Light of a low degree has no higher orders.
        let layout = &layout.with_orders_up_to(degree);
        let set = OperatorSet::new(variant, layout.viewpoint(), layout.angles(), degree)?;
        let mut pictures = Vec::new();
        for (i, observation) in dataset.observations.iter().enumerate() {
            if let Some(judged) = &observation.view.judged {
                let channel = |c: usize| SmoothModes::new(&judged.evidence.channels[c], layout);
                pictures.push((
                    i,
                    [channel(0)?, channel(1)?, channel(2)?],
                    &judged.evidence.lights,
                ));
            }
        }
        let mut evidence = vec![Vec::new(); dataset.observations.len()];
        for (i, _, _) in &pictures {
            evidence[*i] = vec![vec![0.0; spectra.len()]; materials.len()];
        }
        for (label, material) in materials.iter().enumerate() {
            let operator = set.at(material.roughness().sigma(), parallelism)?;
            let operator = SmoothOperator::new(&operator, layout)?;
            let responses = parallelism
                .map(pictures.len(), |picture| {
                    operator.responses(pictures[picture].2)
                })
                .into_iter()
                .collect::<Result<Vec<_>>>()?;
            let columns = parallelism.map(spectra.len(), |light| {
                let spectrum = spectra[light].get(..=degree).ok_or(Error::Length {
                    what: "a spectrum of light",
                    expected: degree + 1,
                    got: spectra[light].len(),
                })?;
                let mut sums = vec![0.0; pictures.len()];
                let mut made: Option<(f64, GaussianEvidence)> = None;
                for channel in 0..3 {
                    // Strength is integrated out, so only the share of the specular part counts.
                    let (d, s) = (material.diffuse()[channel], material.specular()[channel]);
                    let share = s / (d + s);
                    if made
                        .as_ref()
                        .is_none_or(|(of, _)| (of - share).abs() > 1e-12)
                    {
                        let factors =
                            GaussianEvidence::new(&operator, spectrum, 1.0 - share, share, noise)?;
                        made = Some((share, factors));
                    }
                    if let Some((_, factors)) = &made {
                        for (sum, ((_, picture, _), responses)) in
                            sums.iter_mut().zip(pictures.iter().zip(&responses))
                        {
                            *sum += factors.of(&picture[channel], responses)?.log;
                        }
                    }
                }
                Ok(sums)
            });
            for (light, column) in columns.into_iter().enumerate() {
                for ((picture, _, _), value) in pictures.iter().zip(column?) {
                    evidence[*picture][label][light] = value;
                }
            }
        }
        Ok(Self { evidence })
    }
}

impl Expert for EvidenceExpert {
    fn name(&self) -> String {
        "evidence".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        if !seen.contains(&true) {
            return Err(Error::Unanswerable(
                "evidence needs the spectrum of one illumination or more".into(),
            ));
        }
        Ok(observations
            .iter()
            .map(|&i| {
                self.evidence[i]
                    .iter()
                    .map(|lights| {
                        let terms = lights.iter().zip(seen).filter(|(_, seen)| **seen);
                        log_sum_exp(terms.map(|(&value, _)| value))
                    })
                    .collect()
            })
            .collect())
    }
}

/// B_l of a map's luminance to `degree`.
///
/// # Errors
/// A degree that the map does not carry.
pub fn light_spectrum(
    map: &EnvironmentMap,
    degree: usize,
    parallelism: Parallelism,
) -> Result<Vec<f64>> {
    let channels = map.coefficients(degree, parallelism)?;
    let mut luminance = channels[0].clone();
    for (i, value) in luminance.as_mut_slice().iter_mut().enumerate() {
        *value = Luminance::Rec709.of([0, 1, 2].map(|c: usize| channels[c].as_slice()[i]));
    }
    Ok(average_power(&luminance))
}

/// A Student t of the rings' amplitudes of log radiance about zero, one per material, learned from spheres that
/// were rendered under the illuminations seen.
///
/// Radiance is far from Gaussian, its logarithm is near (Dror, Willsky and Adelson 2004, doi:10.1167/4.9.11). Per order the amplitudes
/// over the first cosines across the rings are Gaussian with a covariance that is learned and shrunk to its diagonal, and light
/// differs in contrast: one unknown factor on all variances of a picture, with a scaled inverse χ² prior of 50 degrees of freedom,
/// integrates out to a Student t. The mean over the picture is left out, and with it the exposure.
#[derive(Debug)]
pub struct LogRadianceExpert {
    labels: usize,
    noise: f64,
    /// moments[illumination][material][order]: the sum of y yᵀ.
    moments: Vec<Vec<Vec<DMatrix<f64>>>>,
    /// How many terms each sum of order 1 has; order 0 has half.
    counts: Vec<f64>,
    /// pictures[observation][order]: cosine and sine amplitudes.
    pictures: Vec<Vec<DMatrix<f64>>>,
}

/// How far covariances are drawn to their diagonal.
const SHRINKAGE: f64 = 0.1;

/// The degrees of freedom of the unknown contrast: a factor of 1.15 either way.
const DEGREES_OF_FREEDOM: f64 = 50.0;

impl LogRadianceExpert {
    /// Reads the pictures of a data set; all of those seen are learned from. `noise` is what pixels and interpolation add to each
    /// amplitude of log radiance; it keeps matte spheres, whose high orders are nothing else, from deciding by it.
    pub fn new(dataset: &Dataset<Reading>, noise: f64) -> Self {
        let labels = dataset.materials.len();
        let size = Reader::FUNCTIONS;
        let empty = vec![vec![DMatrix::zeros(size, size); Reader::LOG_ORDERS + 1]; labels];
        let mut moments = vec![empty; dataset.illuminations.len()];
        let mut counts = vec![0.0; dataset.illuminations.len()];
        for observation in &dataset.observations {
            let sums = &mut moments[observation.illumination][observation.material];
            for (sum, y) in sums.iter_mut().zip(&observation.view.log_amplitudes) {
                *sum += y * y.transpose();
            }
            counts[observation.illumination] += 2.0 / labels as f64;
        }
        let views = dataset.observations.iter();
        Self {
            labels,
            noise,
            moments,
            counts,
            pictures: views.map(|o| o.view.log_amplitudes.clone()).collect(),
        }
    }
}

impl Expert for LogRadianceExpert {
    fn name(&self) -> String {
        "log radiance".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        let counts = self.counts.iter().zip(seen);
        let count: f64 = counts.filter(|(_, s)| **s).map(|(c, _)| c).sum();
        if count == 0.0 {
            return Err(Error::Unanswerable(
                "the log-radiance likelihood needs pictures to learn from".into(),
            ));
        }
        let size = Reader::FUNCTIONS;
        let mut scores = vec![vec![0.0; self.labels]; observations.len()];
        for label in 0..self.labels {
            let mut squares = vec![0.0; observations.len()];
            let (mut log_determinant, mut amplitudes) = (0.0, 0.0);
            for order in 0..=Reader::LOG_ORDERS {
                let mut covariance = DMatrix::zeros(size, size);
                for (moments, seen) in self.moments.iter().zip(seen) {
                    if *seen {
                        covariance += &moments[label][order];
                    }
                }
                // Order 0 has no sine, and lost its mean: the first function is the constant.
                let (copies, first) = if order == 0 { (1.0, 1) } else { (2.0, 0) };
                covariance /= 0.5 * copies * count;
                let size = size - first;
                let mut covariance = covariance.view((first, first), (size, size)).into_owned();
                let diagonal = covariance.diagonal();
                covariance *= 1.0 - SHRINKAGE;
                for i in 0..size {
                    covariance[(i, i)] += SHRINKAGE * diagonal[i] + self.noise * self.noise;
                }
                let factor = cholesky(covariance)?;
                let half_log: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
                log_determinant += copies * half_log;
                amplitudes += copies * size as f64;
                for (square, &i) in squares.iter_mut().zip(observations) {
                    let y = &self.pictures[i][order];
                    let mut y = y.view((first, 0), (size, y.ncols())).into_owned();
                    factor.l_dirty().solve_lower_triangular_mut(&mut y);
                    *square += y.norm_squared();
                }
            }
            for (score, square) in scores.iter_mut().zip(squares) {
                let weight = 0.5 * (amplitudes + DEGREES_OF_FREEDOM);
                score[label] = -weight * (square / DEGREES_OF_FREEDOM).ln_1p() - log_determinant;
            }
        }
        Ok(scores)
    }
}

fn cholesky(matrix: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix).ok_or_else(|| {
        Error::Unanswerable("a covariance that was learned is not positive definite".into())
    })
}

/// A Gaussian of the logarithms of a picture's mean colour, one mean per material and one covariance.
#[derive(Debug)]
pub struct ColourExpert {
    labels: Vec<usize>,
    illuminations: Vec<usize>,
    materials: usize,
    colours: Vec<DVector<f64>>,
}

impl ColourExpert {
    /// With the brightness, which needs a known exposure, or with the colour alone.
    pub fn new(dataset: &Dataset<Reading>, with_brightness: bool) -> Self {
        let colours = dataset.observations.iter().map(|observation| {
            let [r, g, b] = observation.view.mean.map(|value| value.max(1e-12).ln());
            if with_brightness {
                DVector::from_vec(vec![r - g, b - g, g])
            } else {
                DVector::from_vec(vec![r - g, b - g])
            }
        });
        Self {
            labels: dataset.labels(),
            illuminations: dataset
                .observations
                .iter()
                .map(|o| o.illumination)
                .collect(),
            materials: dataset.materials.len(),
            colours: colours.collect(),
        }
    }
}

impl Expert for ColourExpert {
    fn name(&self) -> String {
        "colour".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        let size = self.colours.first().map_or(0, DVector::len);
        let mut means = vec![DVector::zeros(size); self.materials];
        let mut counts = vec![0.0; self.materials];
        let training: Vec<usize> = (0..self.labels.len())
            .filter(|&i| seen[self.illuminations[i]])
            .collect();
        for &i in &training {
            means[self.labels[i]] += &self.colours[i];
            counts[self.labels[i]] += 1.0;
        }
        for (mean, count) in means.iter_mut().zip(&counts) {
            if *count == 0.0 {
                return Err(Error::Unanswerable(
                    "a material has no picture to learn its colour from".into(),
                ));
            }
            *mean /= *count;
        }
        let mut covariance = DMatrix::zeros(size, size);
        for &i in &training {
            let off = &self.colours[i] - &means[self.labels[i]];
            covariance += &off * off.transpose();
        }
        covariance /= (training.len().saturating_sub(self.materials)).max(1) as f64;
        for i in 0..size {
            covariance[(i, i)] += 1e-4;
        }
        let factor = cholesky(covariance)?;
        Ok(observations
            .iter()
            .map(|&i| {
                means
                    .iter()
                    .map(|mean| {
                        let mut off = &self.colours[i] - mean;
                        factor.l_dirty().solve_lower_triangular_mut(&mut off);
                        -0.5 * off.norm_squared()
                    })
                    .collect()
            })
            .collect())
    }
}

/// Experts weighed: ln p(material) = Σ_e w_e ln p_e(material) + constant, with the weights (inverse temperatures, for each
/// expert is too sure of itself) chosen inside the training fold.
///
/// For each scene of the training fold the experts judge its pictures of turn 0 from the others, and the weights w ≥ 0
/// make those labels likeliest, under an exponential prior that keeps them finite when all are named right.
pub struct Stack<'a> {
    experts: Vec<&'a dyn Expert>,
    labels: Vec<usize>,
    illuminations: Vec<usize>,
    judged: Vec<bool>,
    scenes: Scenes,
    count: usize,
}

/// The prior's rate: what one unit of a weight costs in nats.
const WEIGHT_COST: f64 = 1.0;

impl<'a> Stack<'a> {
    /// A stack over the observations of `dataset`, for which the experts were made.
    pub fn new<T>(dataset: &Dataset<T>, experts: Vec<&'a dyn Expert>) -> Self {
        Self {
            experts,
            judged: dataset.observations.iter().map(|o| o.turn == 0).collect(),
            labels: dataset.labels(),
            illuminations: dataset
                .observations
                .iter()
                .map(|o| o.illumination)
                .collect(),
            scenes: dataset.scenes.clone(),
            count: dataset.illuminations.len(),
        }
    }

    /// judged[e][i][label] of each expert, centred so that each picture's best is 0.
    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<Vec<f64>>>> {
        self.experts
            .iter()
            .map(|expert| {
                let mut scores = expert.judge(seen, observations)?;
                for scores in &mut scores {
                    let best = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    for score in scores {
                        *score -= best;
                    }
                }
                Ok(scores)
            })
            .collect()
    }

    /// The illuminations of a training fold.
    fn seen(&self, training: &[usize]) -> Vec<bool> {
        let mut seen = vec![false; self.count];
        for &i in training {
            seen[self.illuminations[i]] = true;
        }
        seen
    }

    /// The weights that the inner loop chooses for a training fold.
    ///
    /// # Errors
    /// Fewer than two scenes in the fold, and what the experts find wrong.
    pub fn weights(&self, training: &[usize]) -> Result<Vec<f64>> {
        let seen = self.seen(training);
        let scenes = self.scenes.among(&seen);
        if scenes.len() < 2 {
            return Err(Error::Unanswerable(
                "weighing experts needs two scenes to learn from, or more".into(),
            ));
        }
        let mut judged = vec![Vec::new(); self.experts.len()];
        let mut truth = Vec::new();
        for left_out in scenes {
            let inner = self.scenes.others(&seen, left_out);
            let held: Vec<usize> = training
                .iter()
                .copied()
                .filter(|&i| !inner[self.illuminations[i]] && self.judged[i])
                .collect();
            for (all, these) in judged.iter_mut().zip(self.judge(&inner, &held)?) {
                all.extend(these);
            }
            truth.extend(held.iter().map(|&i| self.labels[i]));
        }
        Ok(fit_weights(&judged, &truth))
    }
}

impl Classifier for Stack<'_> {
    fn name(&self) -> String {
        let names: Vec<String> = self.experts.iter().map(|expert| expert.name()).collect();
        names.join(" + ")
    }

    fn score(&self, training: &[usize], test: &[usize]) -> Result<Vec<Vec<f64>>> {
        let weights = self.weights(training)?;
        let seen = self.seen(training);
        let judged = self.judge(&seen, test)?;
        Ok((0..test.len())
            .map(|i| weigh(&judged, &weights, i))
            .collect())
    }
}

/// ln-probabilities of picture i.
fn weigh(judged: &[Vec<Vec<f64>>], weights: &[f64], i: usize) -> Vec<f64> {
    let mut scores = vec![0.0; judged[0][i].len()];
    for (expert, weight) in judged.iter().zip(weights) {
        for (score, value) in scores.iter_mut().zip(&expert[i]) {
            *score += weight * value;
        }
    }
    let total = log_sum_exp(scores.iter().copied());
    for score in &mut scores {
        *score -= total;
    }
    scores
}

/// Minimises Σ −ln p(truth) + cost·Σ w over ln w, one weight after another by golden section, until none moves. The
/// problem is convex in w.
fn fit_weights(judged: &[Vec<Vec<f64>>], truth: &[usize]) -> Vec<f64> {
    let mut logs = vec![(0.01f64).ln(); judged.len()];
    let loss = |logs: &[f64]| -> f64 {
        let weights: Vec<f64> = logs.iter().map(|x| x.exp()).collect();
        let misses: f64 = truth
            .iter()
            .enumerate()
            .map(|(i, &label)| -weigh(judged, &weights, i)[label])
            .sum();
        misses + WEIGHT_COST * weights.iter().sum::<f64>()
    };
    for _ in 0..12 {
        let before = logs.clone();
        for expert in 0..logs.len() {
            let (mut low, mut high) = ((1e-6f64).ln(), (10f64).ln());
            let ratio = 0.5 * (5f64.sqrt() - 1.0);
            let mut at = |x: f64| {
                logs[expert] = x;
                loss(&logs)
            };
            let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
            let (mut at_a, mut at_b) = (at(a), at(b));
            for _ in 0..24 {
                if at_a < at_b {
                    high = b;
                    (b, at_b) = (a, at_a);
                    a = high - ratio * (high - low);
                    at_a = at(a);
                } else {
                    low = a;
                    (a, at_a) = (b, at_b);
                    b = low + ratio * (high - low);
                    at_b = at(b);
                }
            }
            logs[expert] = 0.5 * (low + high);
        }
        if logs.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-3) {
            break;
        }
    }
    logs.into_iter().map(f64::exp).collect()
}
