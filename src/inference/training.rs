//! Making what a model learns from.

use std::f64::consts::TAU;

use super::dataset::{Dataset, Observation, Plan, View, collect};
use super::model::{SphereFeatures, Training};
use super::random_reflectances::{RandomReflectances, Sample, collect_random};
use crate::illumination::EnvironmentMap;
use crate::picture::{Sphere, augment};
use crate::reflectance::{Material, Variant};
use crate::reflection::{Camera, Settings, SphereImage, Viewpoint};
use crate::{Error, Parallelism, Result};

/// How a [`Training`] set is made.
///
/// ```
/// use lobes::inference::{RandomReflectances, TrainingPlan};
/// // Half as many cameras, and reflectances of another seed.
/// let mut plan = TrainingPlan::default();
/// plan.plan.turns = 8;
/// plan.random = RandomReflectances { seed: 2, ..plan.random };
/// assert_eq!(plan.plan.turns * plan.developments, 16, "pictures of each material in each light");
/// ```
#[derive(Debug, Clone)]
pub struct TrainingPlan {
    /// The lobe, the size and the tolerance of the pictures; its turns are the cameras for each
    /// illumination.
    pub plan: Plan,
    /// Into how many pictures each rendered sphere is developed.
    pub developments: usize,
    /// Which random reflectances.
    pub random: RandomReflectances,
}

impl Default for TrainingPlan {
    /// Sixteen cameras, two pictures of each sphere, twelve random reflectances a camera, rendered
    /// to a hundredth.
    fn default() -> Self {
        Self {
            plan: Plan {
                lobe: Variant::default(),
                settings: Settings {
                    size: Sphere::SIZE,
                    tolerance: 1e-2,
                    ..Settings::default()
                },
                turns: 16,
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
    /// Cameras all round: two of four level, the others −10° … 65° above the horizon; one of two
    /// far away, the others at 3.5 … 28 radii.
    fn cameras(&self) -> Result<Vec<Camera>> {
        let turns = self.plan.turns;
        (0..turns)
            .map(|i| {
                // Halves, quarters, … of the range, in an order in which few are spread as evenly
                // as many.
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

impl Training {
    /// Renders the spheres to learn from and reads them as any renderer or camera may leave them.
    ///
    /// Cameras are level or tilted, far or near; pictures are linear or photographs, well or badly
    /// exposed, with and without noise, and the sphere's circle is known to about 1 %: what has
    /// learned from all of that is at home with each. `done` is called twice for each illumination.
    /// Each illumination is taken for a scene of its own; set the [`scenes`](Dataset::scenes) of
    /// [`named`](Self::named) where that is not so.
    ///
    /// # Errors
    /// What the renderer or the reader finds wrong; [`Error::Empty`] where nothing is asked for.
    pub fn new(
        illuminations: &[EnvironmentMap],
        materials: &[Material],
        plan: &TrainingPlan,
        parallelism: Parallelism,
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        let count = plan.developments;
        if illuminations.is_empty() || materials.is_empty() || plan.plan.turns * count == 0 {
            return Err(Error::Empty {
                what: "a model",
                needs: "an illumination, a material, a camera and a development to learn from",
            });
        }
        let cameras = plan.cameras()?;
        let develop = |seed: u64, image: &SphereImage| {
            (0..count)
                .map(|i| {
                    let seed = seed.wrapping_mul(count as u64).wrapping_add(i as u64);
                    Ok(SphereFeatures::of(&augment(image, seed)?)?.values)
                })
                .collect::<Result<Vec<_>>>()
        };
        let set = collect(
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
            scenes: set.scenes,
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
        let samples = collect_random(
            &cameras,
            illuminations,
            &plan.random,
            &plan.plan,
            parallelism,
            done,
            &|_, seed, image| develop(seed, image),
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
