//! A classifier that has learned: from one picture to a name, an error bar, or "none of these".

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::continuous::{
    LearnedPosterior, PosteriorModel, RandomReflectances, Sample, collect_random_from,
};
#[cfg(feature = "files")]
use super::development;
use super::discriminant::{Discriminant, LinearScores};
use super::evidence::log_sum_exp;
use super::experts::{Expert, Stack};
use super::picture::Sphere;
use super::posterior::Posterior;
use super::protocol::{Dataset, Observation, Plan, View, collect_from};
use super::reading::LogReader;
use crate::illumination::EnvironmentMap;
use crate::reflectance::{Material, Variant};
use crate::reflection::{Camera, Settings, SphereImage, Viewpoint};
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
    /// The lobe, the size and the tolerance of the pictures; its turns are the cameras for each illumination.
    pub plan: Plan,
    /// Into how many pictures each rendered sphere is developed.
    pub developments: usize,
    /// Which random reflectances.
    pub random: RandomReflectances,
}

impl Default for TrainingPlan {
    /// Eight cameras, two pictures of each sphere, twelve random reflectances a camera, rendered to a hundredth.
    fn default() -> Self {
        Self {
            plan: Plan {
                lobe: Variant::RadianceSampled,
                settings: Settings {
                    size: Sphere::SIZE,
                    tolerance: 1e-2,
                    ..Settings::default()
                },
                turns: 8,
            },
            developments: 2,
            random: RandomReflectances {
                roughnesses: 3,
                colours: 4,
                ..RandomReflectances::default()
            },
        }
    }
}

impl TrainingPlan {
    /// Cameras all round: two of four level, the others −10° … 65° above the horizon; one of two far away, the others at 3.5 … 28 radii.
    fn cameras(&self) -> Result<Vec<Camera>> {
        let turns = self.plan.turns;
        (0..turns)
            .map(|i| {
                // Halves, quarters, … of the range, in an order in which few are spread as evenly as many.
                let spread = (0.5 + 0.618_033_988_749_895 * i as f64).fract();
                let elevation = if i % 4 < 2 {
                    0.0
                } else {
                    (-10.0 + 75.0 * spread).to_radians()
                };
                let viewpoint = if i % 2 == 0 {
                    Viewpoint::Orthographic
                } else {
                    Viewpoint::Perspective {
                        distance: 3.5 * 8f64.powf(spread),
                    }
                };
                let view = View {
                    elevation,
                    viewpoint,
                };
                view.camera(TAU * i as f64 / turns as f64)
            })
            .collect()
    }
}

#[cfg(feature = "files")]
impl Training {
    /// Renders the spheres to learn from and reads them as any renderer or camera may leave them.
    ///
    /// Cameras are level or tilted, far or near; pictures are linear or photographs, well or badly exposed, with and without noise, and the sphere's
    /// circle is known to about 1 %: what has learned from all of that is at home with each. `done` is called twice for each illumination.
    ///
    /// # Errors
    /// What the renderer or the reader finds wrong; [`Error::Unanswerable`] where nothing is asked for.
    pub fn new(
        illuminations: &[EnvironmentMap],
        materials: &[Material],
        plan: &TrainingPlan,
        parallelism: Parallelism,
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        let count = plan.developments;
        if illuminations.is_empty() || materials.is_empty() || plan.plan.turns * count == 0 {
            return Err(Error::Unanswerable(
                "a model learns from an illumination, a material, a camera and a development, or more of each".into(),
            ));
        }
        let cameras = plan.cameras()?;
        let develop = |seed: u64, image: &SphereImage| {
            (0..count)
                .map(|i| {
                    let seed = seed.wrapping_mul(count as u64).wrapping_add(i as u64);
                    Ok(SphereFeatures::of(&development::any(image, seed)?)?.values)
                })
                .collect::<Result<Vec<_>>>()
        };
        let set = collect_from(
            &cameras,
            illuminations,
            materials,
            &plan.plan,
            parallelism,
            done,
            &|of, image| {
                let place = of.illumination * cameras.len() + of.turn;
                let place = (place * materials.len() + of.material) as u64;
                develop(
                    plan.random.seed.wrapping_mul(1 << 32).wrapping_add(place),
                    image,
                )
            },
        )?;
        let named = Dataset {
            materials: set.materials,
            illuminations: set.illuminations,
            observations: set
                .observations
                .into_iter()
                .flat_map(|of| {
                    of.view.into_iter().map(move |view| Observation {
                        material: of.material,
                        illumination: of.illumination,
                        // Every one is judged in the inner loop.
                        turn: 0,
                        view,
                    })
                })
                .collect(),
            render_error: set.render_error,
        };
        let samples = collect_random_from(
            &cameras,
            illuminations,
            &plan.random,
            &plan.plan,
            parallelism,
            done,
            &develop,
        )?;
        let random = samples.into_iter().flat_map(|of| {
            of.view.into_iter().map(move |view| Sample {
                illumination: of.illumination,
                judged: of.judged,
                truth: of.truth,
                view,
            })
        });
        Ok(Self {
            named,
            random: random.collect(),
        })
    }
}

/// What a [`Model`] reads off a sphere: a few numbers, so that many pictures can be read before any is judged.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereFeatures {
    values: Vec<f64>,
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

/// A classifier that has learned from a [`Training`] set and is ready for pictures under light that it has not seen.
///
/// Immutable; share it between threads.
///
/// ```no_run
/// use std::path::Path;
/// use lobes::classify::{Model, Picture, Training, TrainingPlan};
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
        let folds = parallelism.map(seen.len(), |left_out| {
            if !seen[left_out] {
                return Ok(Vec::new());
            }
            let mut inner = seen.to_vec();
            inner[left_out] = false;
            let scores = discriminant.learn(&inner)?;
            Ok(data
                .observations
                .iter()
                .filter(|o| o.illumination == left_out)
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
            &LearnedPosterior::shares(),
            &LearnedPosterior::sigmas(),
        )?;
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

impl Model {
    /// Learns.
    ///
    /// # Errors
    /// Fewer than two illuminations, a material without a picture, and what the parts refuse.
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
    /// As [`learn`](Self::learn), and [`Error::Length`] unless `seen` has one value for each illumination.
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

    /// What the model says of a sphere; one [without colour](Sphere::is_grey) is judged by its luminance alone.
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
