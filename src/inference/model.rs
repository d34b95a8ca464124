//! A classifier that has learned: from one picture to a name, an error bar, or "none of these".

use nalgebra::DVector;

use super::dataset::Dataset;
use super::discriminant::{Discriminant, LinearScores};
use super::evidence::log_sum_exp;
use super::expert::{Expert, Stack};
use super::learned_posterior::{LearnedPosterior, PosteriorModel};
use super::posterior::Posterior;
use super::random_reflectances::Sample;
use super::reading::LogReader;
use crate::picture::Sphere;
use crate::reflection::Viewpoint;
use crate::{Error, Parallelism, Result};

/// What a model learns from: features of named materials and of random reflectances under known
/// lights.
///
/// It is what takes time to make, and it is plain numbers, so that a program can keep it.
///
/// ```
/// use lobes::inference::{Dataset, Model, Scenes, Training};
/// use lobes::{Error, Parallelism};
/// let nothing = Dataset {
///     materials: vec!["gold".into()],
///     illuminations: vec!["hall".into()],
///     scenes: Scenes::default(),
///     observations: Vec::new(),
///     render_error: 0.0,
/// };
/// // A model learns from two scenes at the least.
/// let training = Training { named: nothing, random: Vec::new() };
/// let refused = Model::learn(&training, Parallelism::Sequential);
/// assert!(matches!(refused, Err(Error::TooFew { .. })));
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredTraining")
)]
pub struct Training {
    /// Features of the named materials; turn 0 of every view is judged in the inner loop.
    pub named: Dataset<Vec<f64>>,
    /// Features of random reflectances.
    pub random: Vec<Sample<Vec<f64>>>,
}

/// A training set as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct StoredTraining {
    named: Dataset<Vec<f64>>,
    random: Vec<Sample<Vec<f64>>>,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredTraining> for Training {
    type Error = Error;

    fn try_from(stored: StoredTraining) -> Result<Self> {
        let count = stored.named.illuminations.len();
        for sample in &stored.random {
            super::dataset::check_index(
                "the illumination of a sample",
                sample.illumination,
                count,
            )?;
        }
        Ok(Self {
            named: stored.named,
            random: stored.random,
        })
    }
}

/// What a [`Model`] reads off a sphere: a few numbers, so that many pictures can be read before any
/// is judged.
///
/// ```
/// use lobes::inference::SphereFeatures;
/// use lobes::picture::{Circle, Picture};
/// // A disc that is brighter towards the upper right, as a matte ball is under one light.
/// let shade = |x: f64, y: f64| if x.hypot(y) < 60.0 { 0.2 + 0.4 * (0.5 + (x - y) / 170.0) } else { 0.0 };
/// let pixels = (0..160 * 160).map(|i| [shade((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5); 3]);
/// let picture = Picture::linear(160, 160, pixels.collect())?;
/// let circle = Circle { x: 80.0, y: 80.0, radius: 60.0 };
/// let features = SphereFeatures::of(&picture.sphere(circle)?)?;
/// assert!(features.is_grey(), "it is judged by its luminance");
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SphereFeatures {
    pub(super) values: Vec<f64>,
    grey: bool,
}

impl SphereFeatures {
    /// Reads a sphere.
    ///
    /// # Errors
    /// A sphere that is black.
    pub fn of(sphere: &Sphere) -> Result<Self> {
        let viewpoint = match sphere.image.camera().distance() {
            Some(distance) => Viewpoint::Perspective { distance },
            None => Viewpoint::Orthographic,
        };
        Ok(Self {
            values: LogReader::new(viewpoint)?.features(&sphere.image)?,
            grey: sphere.is_grey(),
        })
    }

    /// Whether the sphere has no colour, so that it is judged by its luminance alone.
    pub fn is_grey(&self) -> bool {
        self.grey
    }
}

/// A classifier that has learned from a [`Training`] set and is ready for pictures under light that
/// it has not seen.
///
/// Immutable; share it between threads.
///
/// ```no_run
/// use std::path::Path;
/// use lobes::inference::{Model, Training, TrainingPlan};
/// use lobes::picture::Picture;
/// use lobes::{Parallelism, illumination::builtin, reflectance::presets};
///
/// let lights = builtin()?;
/// let training = Training::new(&lights, &presets(), &TrainingPlan::default(), Parallelism::Rayon, &|| ())?;
/// let model = Model::learn(&training, Parallelism::Rayon)?;
/// let picture = Picture::read(Path::new("ball.jpg"))?;
/// let verdict = model.read(&picture.sphere(picture.circle()?)?)?;
/// println!("{:?}, σ = {:.3}", verdict.material().map(|i| &model.materials()[i]), verdict.posterior.sigma_quantile(0.5));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Model {
    materials: Vec<String>,
    /// From all features, and from those that a picture without colour has.
    colour: Learned,
    grey: Learned,
}

/// What was learned from some of the features.
#[derive(Debug, Clone)]
struct Learned {
    /// The features.
    columns: Vec<usize>,
    scores: LinearScores,
    /// The temperature's inverse, chosen by leaving one scene out.
    weight: f64,
    /// The squared distance to a material's mean that one in a hundred pictures of it passes under
    /// light of a scene that was left out.
    limit: f64,
    posterior: PosteriorModel,
}

/// What a model says of one picture.
///
/// ```
/// use lobes::inference::Verdict;
/// fn name<'a>(verdict: &Verdict, materials: &'a [String]) -> &'a str {
///     verdict.material().map_or("none of these", |material| &materials[material])
/// }
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredVerdict")
)]
pub struct Verdict {
    /// The probability of each material, in the model's order.
    pub probabilities: Vec<f64>,
    /// The probability that it is none of them.
    pub none: f64,
    /// What it says of the reflectance, whatever the name.
    pub posterior: Posterior,
}

/// A verdict as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct StoredVerdict {
    probabilities: Vec<f64>,
    none: f64,
    posterior: Posterior,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredVerdict> for Verdict {
    type Error = Error;

    fn try_from(stored: StoredVerdict) -> Result<Self> {
        let all = [&stored.probabilities[..], &[stored.none]].concat();
        super::posterior::check_probabilities("the probabilities of a verdict", &all)?;
        Ok(Self {
            probabilities: stored.probabilities,
            none: stored.none,
            posterior: stored.posterior,
        })
    }
}

impl Verdict {
    /// The index of the likeliest material, or nothing where "none of these" is likelier than any.
    pub fn material(&self) -> Option<usize> {
        let best = (0..self.probabilities.len())
            .max_by(|&a, &b| self.probabilities[a].total_cmp(&self.probabilities[b]))?;
        (self.probabilities[best] >= self.none).then_some(best)
    }
}

/// The share of pictures of its own materials that a model takes for none of them, at even odds.
const STRANGE: f64 = 0.01;

impl Learned {
    fn new(
        training: &Training,
        seen: &[bool],
        columns: Vec<usize>,
        parallelism: Parallelism,
    ) -> Result<Self> {
        let pick = |view: &Vec<f64>| columns.iter().map(|&i| view[i]).collect::<Vec<f64>>();
        let data = &training.named;
        let discriminant = Discriminant::new("log bands", data, Discriminant::SHRINKAGE, pick)?;
        let learned_from: Vec<usize> = (0..data.observations.len())
            .filter(|&i| seen[data.observations[i].illumination])
            .collect();
        let weight =
            Stack::new(data, vec![&discriminant as &dyn Expert]).weights(&learned_from)?[0];
        let scenes = data.scenes.among(seen);
        let folds = parallelism.map(scenes.len(), |fold| {
            let inner = data.scenes.others(seen, scenes[fold]);
            let scores = discriminant.learn(&inner)?;
            Ok(data
                .observations
                .iter()
                .filter(|o| seen[o.illumination] && !inner[o.illumination])
                .map(|o| scores.distances(&discriminant.centred(&pick(&o.view)))[o.material])
                .collect::<Vec<f64>>())
        });
        let mut distances = Vec::new();
        for fold in folds {
            distances.extend(fold?);
        }
        distances.sort_by(f64::total_cmp);
        let place = ((1.0 - STRANGE) * distances.len() as f64) as usize;
        let limit = distances[place.min(distances.len() - 1)];
        let samples: Vec<Sample<Vec<f64>>> = training
            .random
            .iter()
            .map(|sample| Sample {
                view: pick(&sample.view),
                ..*sample
            })
            .collect();
        let learned = LearnedPosterior::new(
            &samples,
            &Posterior::default_shares(),
            &Posterior::default_sigmas(),
        )?
        .with_scenes(&data.scenes);
        Ok(Self {
            scores: discriminant.learn(seen)?.uncentred(discriminant.centre()),
            weight,
            limit,
            posterior: learned.learn(seen)?,
            columns,
        })
    }

    fn verdict(&self, features: &[f64]) -> Result<Verdict> {
        let features: Vec<f64> = self.columns.iter().map(|&i| features[i]).collect();
        let posterior = self.posterior.posterior(&features)?;
        let distances = self.scores.distances(&DVector::from_vec(features));
        // Half a squared distance is −ln of a likelihood but for what all materials share; "none of
        // these" lies at the limit.
        let none = -0.5 * self.weight * self.limit;
        let logs: Vec<f64> = distances.iter().map(|d| -0.5 * self.weight * d).collect();
        let total = log_sum_exp(logs.iter().copied().chain([none]));
        Ok(Verdict {
            probabilities: logs.iter().map(|log| (log - total).exp()).collect(),
            none: (none - total).exp(),
            posterior,
        })
    }
}

impl Model {
    /// Learns.
    ///
    /// # Errors
    /// Fewer than two scenes, a material without a picture, and what the parts refuse.
    pub fn learn(training: &Training, parallelism: Parallelism) -> Result<Self> {
        Self::learn_from(
            training,
            &vec![true; training.named.illuminations.len()],
            parallelism,
        )
    }

    /// Learns from the illuminations that are `seen`, so that the others can judge it.
    ///
    /// # Errors
    /// As [`learn`](Self::learn), and [`Error::Length`] unless `seen` has one value for each
    /// illumination.
    pub fn learn_from(
        training: &Training,
        seen: &[bool],
        parallelism: Parallelism,
    ) -> Result<Self> {
        crate::error::check_length(
            "the list of illuminations that are seen",
            training.named.illuminations.len(),
            seen.len(),
        )?;
        let views = training.named.observations.iter().map(|o| &o.view);
        let mut views = views.chain(training.random.iter().map(|sample| &sample.view));
        if let Some(view) = views.find(|view| view.len() != LogReader::FEATURES) {
            return Err(Error::Length {
                what: "the features of a picture to learn from",
                expected: LogReader::FEATURES,
                got: view.len(),
            });
        }
        let all = 0..LogReader::FEATURES;
        let grey = all
            .clone()
            .filter(|&i| !LogReader::needs_colour(i))
            .collect();
        Ok(Self {
            materials: training.named.materials.clone(),
            colour: Learned::new(training, seen, all.collect(), parallelism)?,
            grey: Learned::new(training, seen, grey, parallelism)?,
        })
    }

    /// The materials' names.
    pub fn materials(&self) -> &[String] {
        &self.materials
    }

    /// What the model says of a sphere; one [without colour](Sphere::is_grey) is judged by its
    /// luminance alone.
    ///
    /// # Errors
    /// A sphere that is black.
    pub fn read(&self, sphere: &Sphere) -> Result<Verdict> {
        self.verdict(&SphereFeatures::of(sphere)?)
    }

    /// What the model says of a sphere with these features.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn verdict(&self, features: &SphereFeatures) -> Result<Verdict> {
        let learned = if features.grey {
            &self.grey
        } else {
            &self.colour
        };
        learned.verdict(&features.values)
    }
}
