//! A classifier that has learned: from one picture to a name, an error bar, or "none of these".

use nalgebra::DVector;

use super::continuous::{
    LearnedPosterior, PosteriorModel, RandomReflectances, Sample, collect_random,
};
use super::discriminant::{Discriminant, LinearScores};
use super::evidence::log_sum_exp;
use super::experts::{Expert, Stack};
use super::posterior::Posterior;
use super::protocol::{Dataset, Plan, View, collect};
use super::reading::LogReader;
use crate::illumination::EnvironmentMap;
use crate::reflectance::Material;
use crate::reflection::SphereImage;
use crate::{Error, Parallelism, Result};

/// What a model learns from: features of named materials and of random reflectances under known lights.
///
/// It is what takes time to make, and it is plain numbers, so that a program can keep it.
#[derive(Debug, Clone)]
pub struct Training {
    /// Features of the named materials; turn 0 of every view is judged in the inner loop.
    pub named: Dataset<Vec<f64>>,
    /// Features of random reflectances.
    pub random: Vec<Sample<Vec<f64>>>,
}

/// How a [`Training`] set is made.
#[derive(Debug, Clone)]
pub struct TrainingPlan {
    /// From where spheres are seen, each from as many turns as `plan` says.
    pub views: Vec<View>,
    /// The lobe, the size and the tolerance of the pictures, and the turns.
    pub plan: Plan,
    /// Which random reflectances.
    pub random: RandomReflectances,
}

/// What becomes of a rendered picture before it is read: nothing, or a photograph with this seed.
pub type Development<'a> = dyn Fn(u64, &SphereImage) -> Result<SphereImage> + Sync + 'a;

impl Training {
    /// Renders and reads the pictures to learn from.
    ///
    /// `develop` makes of each linear picture what the pictures to be judged are like; it gets a seed of its own for each. All
    /// views have the viewpoint of the first. `done` is called twice for each view and illumination.
    ///
    /// # Errors
    /// No view, and what the renderer, `develop` or the reader finds wrong.
    pub fn new(
        illuminations: &[EnvironmentMap],
        materials: &[Material],
        plan: &TrainingPlan,
        develop: &Development<'_>,
        parallelism: Parallelism,
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        let Some(first) = plan.views.first() else {
            return Err(Error::Unanswerable(
                "a model learns from one view or more".into(),
            ));
        };
        let reader = LogReader::new(first.viewpoint)?;
        let mut named: Option<Dataset<Vec<f64>>> = None;
        let mut random = Vec::new();
        for (place, &view) in plan.views.iter().enumerate() {
            let seed = plan.random.seed.wrapping_add(place as u64);
            let set = collect(
                view,
                illuminations,
                materials,
                &plan.plan,
                parallelism,
                done,
                &|of, image| {
                    let place = (of.illumination * plan.plan.turns + of.turn) * materials.len();
                    let seed = seed.wrapping_mul(1 << 32) + (place + of.material) as u64;
                    reader.features(&develop(seed, image)?)
                },
            )?;
            match &mut named {
                None => named = Some(set),
                Some(named) => {
                    named.observations.extend(set.observations);
                    named.render_error = named.render_error.max(set.render_error);
                }
            }
            random.extend(collect_random(
                view,
                illuminations,
                &RandomReflectances {
                    seed,
                    ..plan.random
                },
                &plan.plan,
                parallelism,
                done,
                &|seed, image| reader.features(&develop(seed, image)?),
            )?);
        }
        match named {
            Some(named) => Ok(Self { named, random }),
            None => Err(Error::Unanswerable(
                "a model learns from one view or more".into(),
            )),
        }
    }
}

/// A classifier that has learned from a [`Training`] set and is ready for pictures under light that it has not seen.
///
/// Immutable; share it between threads.
#[derive(Debug, Clone)]
pub struct Model {
    materials: Vec<String>,
    scores: LinearScores,
    /// The temperature's inverse, chosen by leaving one illumination out.
    weight: f64,
    /// The squared distance to a material's mean that one in a hundred pictures of it passes under light that was left out.
    limit: f64,
    posterior: PosteriorModel,
}

/// What a model says of one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The probability of each material, in the model's order.
    pub probabilities: Vec<f64>,
    /// The probability that it is none of them.
    pub none: f64,
    /// What it says of the reflectance, whatever the name.
    pub posterior: Posterior,
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

impl Model {
    /// Learns.
    ///
    /// # Errors
    /// Fewer than three illuminations, a material without a picture, and what the parts refuse.
    pub fn learn(training: &Training, parallelism: Parallelism) -> Result<Self> {
        let data = &training.named;
        let discriminant =
            Discriminant::new("log bands", data, Discriminant::SHRINKAGE, Vec::clone)?;
        let all: Vec<usize> = (0..data.observations.len()).collect();
        let weight = Stack::new(data, vec![&discriminant as &dyn Expert]).weights(&all)?[0];
        let count = data.illuminations.len();
        let folds = parallelism.map(count, |left_out| {
            let mut seen = vec![true; count];
            seen[left_out] = false;
            let scores = discriminant.learn(&seen)?;
            Ok(data
                .observations
                .iter()
                .filter(|o| o.illumination == left_out)
                .map(|o| scores.distances(&discriminant.centred(&o.view))[o.material])
                .collect::<Vec<f64>>())
        });
        let mut distances = Vec::new();
        for fold in folds {
            distances.extend(fold?);
        }
        distances.sort_by(f64::total_cmp);
        let place = ((1.0 - STRANGE) * distances.len() as f64) as usize;
        let limit = distances[place.min(distances.len() - 1)];
        let learned = LearnedPosterior::new(
            &training.random,
            &LearnedPosterior::shares(),
            &LearnedPosterior::sigmas(),
        )?;
        Ok(Self {
            materials: data.materials.clone(),
            scores: discriminant
                .learn(&vec![true; count])?
                .uncentred(discriminant.centre()),
            weight,
            limit,
            posterior: learned.learn(&vec![true; count])?,
        })
    }

    /// The materials' names.
    pub fn materials(&self) -> &[String] {
        &self.materials
    }

    /// What the model says of a picture with these features ([`LogReader::features`]).
    ///
    /// # Errors
    /// [`Error::Length`] for another number of features than were learned.
    pub fn verdict(&self, features: &[f64]) -> Result<Verdict> {
        let posterior = self.posterior.posterior(features)?;
        let row = DVector::from_column_slice(features);
        let distances = self.scores.distances(&row);
        // Half a squared distance is −ln of a likelihood but for what all materials share; "none of these" lies at the limit.
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
