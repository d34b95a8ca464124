//! Pictures of random reflectances, to learn and to judge posteriors from.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::dataset::{Parts, Plan};
use super::posterior::Reflectance;
use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflection::{Camera, Renderer, SphereImage};
use crate::{Error, Parallelism, Result};

/// One picture of a random reflectance, or what was read off it.
///
/// ```
/// use lobes::inference::{Reflectance, Sample};
/// let truth = Reflectance { share: 0.3, sigma: 0.1 };
/// // Two features that were read off a picture under the first light.
/// let sample = Sample { illumination: 0, judged: true, truth, view: vec![0.2, -1.5] };
/// assert_eq!(sample.view.len(), 2);
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
///
/// ```
/// use lobes::inference::RandomReflectances;
/// let narrow = RandomReflectances { sigmas: (0.05, 0.1), ..RandomReflectances::default() };
/// assert_eq!(narrow.shares, RandomReflectances::default().shares);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomReflectances {
    /// ln σ is uniform between these.
    pub sigmas: (f64, f64),
    /// The share is uniform between these.
    pub shares: (f64, f64),
    /// Roughnesses for each illumination and turn, one in each of as many equal parts of the range
    /// of ln σ.
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

/// Renders spheres of random reflectances under each illumination, gives each picture, whether it
/// is judged and a random number for noise to `read`, and keeps what that gives.
///
/// A body has a random colour, each channel uniform in 0.1 … 1; half of the spheres have a white
/// highlight, as plastics do, half one of the body's colour, as metals do. The samples that the
/// first of `cameras` sees are judged.
///
/// # Errors
/// What the renderer or `read` finds wrong; [`Error::Empty`] where nothing is asked for.
pub fn collect_random<T: Send>(
    cameras: &[Camera],
    illuminations: &[EnvironmentMap],
    random: &RandomReflectances,
    plan: &Plan,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
    read: &(dyn Fn(bool, u64, &SphereImage) -> Result<T> + Sync),
) -> Result<Vec<Sample<T>>> {
    if illuminations.is_empty() || cameras.len() * random.roughnesses * random.colours == 0 {
        return Err(Error::Empty {
            what: "a set of random reflectances",
            needs: "an illumination, a camera, a roughness and a colour",
        });
    }
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
