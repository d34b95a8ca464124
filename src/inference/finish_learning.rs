//! How a model of finishes learns.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::convert::Infallible;
use std::f64::consts::PI;

use super::finish::{FinishModel, Outputs, softmax};
use super::network::{Adam, Network};
use super::portrait::Portrait;
use crate::error::check_count;
use crate::numeric::golden_section;
use crate::reflectance::Finish;
use crate::{Parallelism, Result};

/// A portrait and what it shows.
///
/// ```
/// use lobes::inference::{FinishSample, FinishTruth, PortraitReader};
/// use lobes::reflectance::Finish;
/// # use lobes::picture::{Circle, Picture};
/// # // A disc that is brighter towards the upper right, as a matte ball is under one light.
/// # let shade = |x: f64, y: f64| if x.hypot(y) < 60.0 { 0.2 + 0.4 * (0.5 + (x - y) / 170.0) } else { 0.0 };
/// # let pixels = (0..160 * 160).map(|i| [shade((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5); 3]);
/// # let picture = Picture::linear(160, 160, pixels.collect())?;
/// # let circle = Circle { x: 80.0, y: 80.0, radius: 60.0 };
/// let portrait = PortraitReader::new()?.read(&picture, circle)?;
/// let truth = FinishTruth { finish: Some(Finish::Matte), sigma: None, share: Some(0.0), base_colour: None };
/// let sample = FinishSample { portrait, truth };
/// assert_eq!(sample.truth.sigma, None);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct FinishSample {
    /// The portrait.
    pub portrait: Portrait,
    /// What it shows.
    pub truth: FinishTruth,
}

/// What a portrait to learn from shows; what is not known, or is not there, is not learned.
///
/// ```
/// use lobes::inference::FinishTruth;
/// use lobes::reflectance::Finish;
/// // A black glossy ball: its base colour says nothing that could be learned.
/// let billiard = FinishTruth {
///     finish: Some(Finish::GlossyPlastic),
///     sigma: Some(0.02),
///     share: Some(0.6),
///     base_colour: None,
/// };
/// // A glass marble has no single finish, and none of the parameters.
/// let marble = FinishTruth { finish: None, sigma: None, share: None, ..billiard };
/// assert_eq!(marble.base_colour, None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinishTruth {
    /// The finish, or nothing where no single one explains the ball.
    pub finish: Option<Finish>,
    /// σ of the lobe.
    pub sigma: Option<f64>,
    /// The specular share.
    pub share: Option<f64>,
    /// The base colour.
    pub base_colour: Option<[f64; 3]>,
}

/// How a [`FinishModel`] learns from samples.
///
/// The loss of a sample is the cross entropy of its finish, a quarter of that of its bins of σ and
/// of the share, and a quarter of −ln of the normal densities of ln of its base colour. Batches are
/// drawn anew each time round; the rate rises over the first tenth of the steps and falls as a
/// cosine. Generator: Pcg64.
///
/// ```
/// use lobes::inference::{FinishLearning, FinishModel};
/// use lobes::{Error, Parallelism};
/// let plan = FinishLearning { epochs: 3, ..FinishLearning::default() };
/// // Fewer samples than fill a batch teach nothing.
/// let refused = FinishModel::learn(&[], &plan, Parallelism::Sequential, &|_| ());
/// assert!(matches!(refused, Err(Error::TooFew { needed: 64, .. })));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinishLearning {
    /// How often each sample is seen.
    pub epochs: usize,
    /// Samples whose gradients are averaged for one step.
    pub batch: usize,
    /// The largest rate.
    pub rate: f64,
    /// How fast weights decay.
    pub decay: f64,
    /// The generator's seed.
    pub seed: u64,
}

impl Default for FinishLearning {
    /// Twelve epochs of batches of 64, a rate of 0.003, a decay of 0.01, seed 1.
    fn default() -> Self {
        Self {
            epochs: 12,
            batch: 64,
            rate: 3e-3,
            decay: 1e-2,
            seed: 1,
        }
    }
}

/// A batch is divided into so many parts, whatever the number of threads, so that sums do not
/// depend on it.
const PARTS: usize = 8;

/// This share of the samples, the last ones, chooses the temperature and nothing else.
const FOR_TEMPERATURE: f64 = 0.05;

/// What the true finish is taken to be with certainty: no answer is pushed to 1.
const CERTAINTY: f32 = 0.97;

/// What the parameters' losses weigh beside that of the finish.
const PARAMETERS: f32 = 0.25;

/// Darker base colours than this are as good as black.
const BLACK: f64 = 0.01;

impl FinishModel {
    /// Learns from samples; `done` is told the mean loss after each time round.
    ///
    /// The last twentieth of the samples chooses the temperature: they should show other light than
    /// the rest.
    ///
    /// # Errors
    /// [`Error::TooFew`](crate::Error::TooFew) for fewer samples than fill a batch.
    pub fn learn(
        samples: &[FinishSample],
        plan: &FinishLearning,
        parallelism: Parallelism,
        done: &dyn Fn(f64),
    ) -> Result<Self> {
        let held = (FOR_TEMPERATURE * samples.len() as f64).ceil() as usize;
        let (samples, held) = samples.split_at(samples.len() - held);
        let batch = plan.batch.max(1);
        check_count("learning finishes", "samples", batch, samples.len())?;
        let (centre, scale) = moments(samples);
        let mut model = Self {
            network: Network::random(Portrait::STATISTICS, Outputs::COUNT, plan.seed),
            centre,
            scale,
            temperature: 1.0,
        };
        let mut adam = Adam::new(&model.network);
        let mut rng = Pcg64::seed_from_u64(plan.seed);
        let mut order: Vec<usize> = (0..samples.len()).collect();
        let (each, mut step) = (samples.len() / batch, 0);
        let steps = (plan.epochs * each).max(1) as f64;
        for _ in 0..plan.epochs {
            for i in (1..order.len()).rev() {
                order.swap(i, rng.random_range(0..=i));
            }
            let mut total = 0.0;
            for members in order.chunks_exact(batch) {
                let seed: u64 = rng.random();
                let part = batch.div_ceil(PARTS);
                let sums = parallelism.map(batch.div_ceil(part), |p| {
                    let mut rng = Pcg64::seed_from_u64(seed.wrapping_add(p as u64));
                    let mut gradient = model.network.zeros();
                    let mut loss = 0.0;
                    let last = ((p + 1) * part).min(batch);
                    for &member in &members[p * part..last] {
                        let sample = &samples[member];
                        let inputs = sample.portrait.inputs(rng.random());
                        let statistics = model.standardised(&sample.portrait)?;
                        loss += model.network.learn(
                            &inputs,
                            &statistics,
                            &mut gradient,
                            &mut rng,
                            |outputs| Ok(loss_of(outputs, &sample.truth, batch as f32)),
                        )?;
                    }
                    Ok((gradient, loss))
                });
                let mut gradient = model.network.zeros();
                for sum in sums {
                    let (part, loss) = sum?;
                    total += f64::from(loss);
                    let numbers = gradient.parameters_mut().flatten();
                    for (number, value) in numbers.zip(part.parameters().flatten()) {
                        *number += value;
                    }
                }
                let done = step as f64 / steps;
                let rate = if done < 0.1 {
                    10.0 * done + 1e-3
                } else {
                    0.5 * (1.0 + (PI * (done - 0.1) / 0.9).cos())
                };
                let rate = (plan.rate * rate) as f32;
                adam.step(&mut model.network, &gradient, rate, plan.decay as f32);
                step += 1;
            }
            done(total / (each * batch).max(1) as f64);
        }
        model.temperature = model.best_temperature(held, parallelism)?;
        Ok(model)
    }

    /// The temperature that makes the finishes of `held` likeliest.
    fn best_temperature(&self, held: &[FinishSample], parallelism: Parallelism) -> Result<f64> {
        let outputs = parallelism.map(held.len(), |i| self.outputs(&held[i].portrait));
        let outputs = outputs.into_iter().collect::<Result<Vec<_>>>()?;
        let miss = |ln_temperature: f64| -> f64 {
            let of = outputs.iter().zip(held).map(|(outputs, sample)| {
                let scores = &outputs[..Outputs::FINISHES];
                let p = softmax(scores, ln_temperature.exp())[class(sample.truth.finish)];
                -p.max(f64::MIN_POSITIVE).ln()
            });
            of.sum()
        };
        let range = ((0.3f64).ln(), (4.0f64).ln());
        let Ok(best) = golden_section::minimise(range, 1e-3, |x| Ok::<f64, Infallible>(miss(x)));
        Ok(best.exp())
    }
}

/// The place of a finish among the outputs.
pub(super) fn class(finish: Option<Finish>) -> usize {
    finish.map_or(Outputs::FINISHES - 1, Finish::index)
}

/// The mean and the standard deviation of each statistic.
fn moments(samples: &[FinishSample]) -> (Vec<f32>, Vec<f32>) {
    let count = samples.len() as f64;
    let mut sums = vec![(0.0, 0.0); Portrait::STATISTICS];
    for sample in samples {
        for (sum, value) in sums.iter_mut().zip(sample.portrait.statistics()) {
            sum.0 += f64::from(*value);
        }
    }
    for sample in samples {
        for (sum, value) in sums.iter_mut().zip(sample.portrait.statistics()) {
            sum.1 += (f64::from(*value) - sum.0 / count).powi(2);
        }
    }
    let of = sums.into_iter();
    of.map(|(sum, square)| {
        (
            (sum / count) as f32,
            ((square / count).sqrt() + 1e-6) as f32,
        )
    })
    .unzip()
}

/// The loss of a sample, and its derivatives over the size of a batch.
fn loss_of(outputs: &[f32], truth: &FinishTruth, batch: f32) -> (f32, Vec<f32>) {
    let mut slopes = vec![0.0; outputs.len()];
    let mut loss = 0.0;
    let mut entropy = |first: usize, count: usize, place: usize, certainty: f32, weight: f32| {
        let p = softmax(&outputs[first..first + count], 1.0);
        loss -= weight * (p[place].max(1e-9).ln() as f32);
        for (other, p) in p.iter().enumerate() {
            let wanted = if other == place {
                certainty
            } else {
                (1.0 - certainty) / (count - 1) as f32
            };
            slopes[first + other] += weight * (*p as f32 - wanted) / batch;
        }
    };
    let finish = class(truth.finish);
    entropy(0, Outputs::FINISHES, finish, CERTAINTY, 1.0);
    for (value, first, ends) in [
        (truth.sigma, Outputs::SIGMA, &Outputs::SIGMAS),
        (truth.share, Outputs::SHARE, &Outputs::SHARES),
    ] {
        if let Some(value) = value {
            let bins = ends.len() - 1;
            let place = ends[1..bins].partition_point(|end| *end <= value);
            entropy(first, bins, place, 1.0, PARAMETERS);
        }
    }
    if let Some(colour) = truth.base_colour {
        let (low, high) = Outputs::LN_DEVIATION;
        for c in 0..3 {
            let (mean, ln_deviation) = (Outputs::COLOUR + c, Outputs::COLOUR + 3 + c);
            let t = outputs[ln_deviation].clamp(low as f32, high as f32);
            let precision = (-2.0 * t).exp();
            let off = outputs[mean] - colour[c].max(BLACK).ln() as f32;
            loss += PARAMETERS * (0.5 * off * off * precision + t);
            // Far off at first: a bounded slope.
            let slope = (off * precision).clamp(-4.0, 4.0);
            slopes[mean] += PARAMETERS * slope / batch;
            let by_t = (1.0 - off * off * precision).clamp(-4.0, 4.0);
            // Beyond its range it is led back, never farther out.
            let outward = (outputs[ln_deviation] - t) * by_t < 0.0;
            if !outward {
                slopes[ln_deviation] += PARAMETERS * by_t / batch;
            }
        }
    }
    (loss, slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slopes_of_the_loss_are_its_differences() {
        let truth = FinishTruth {
            finish: Some(Finish::RoughMetal),
            sigma: Some(0.1),
            share: Some(0.97),
            base_colour: Some([0.5, 0.2, 0.001]),
        };
        let outputs: Vec<f32> = (0..Outputs::COUNT)
            .map(|i| 0.3 * (i as f32).sin() - 0.2)
            .collect();
        let (_, slopes) = loss_of(&outputs, &truth, 1.0);
        for i in Outputs::FINISHES..Outputs::COUNT {
            let at = |step: f32| {
                let mut moved = outputs.clone();
                moved[i] += step;
                f64::from(loss_of(&moved, &truth, 1.0).0)
            };
            let found = (at(1e-2) - at(-1e-2)) / 2e-2;
            let expected = f64::from(slopes[i]);
            // A slope of a colour is cut off at a quarter of four.
            if expected.abs() < 0.99 {
                assert!((found - expected).abs() < 3e-3, "{i}: {found} {expected}");
            }
        }
        // What is not known is not learned.
        let nothing = FinishTruth {
            finish: None,
            sigma: None,
            share: None,
            base_colour: None,
        };
        let (_, slopes) = loss_of(&outputs, &nothing, 1.0);
        assert!(
            slopes[Outputs::FINISHES..]
                .iter()
                .all(|slope| *slope == 0.0)
        );
        assert!(slopes[4] < 0.0);
    }
}
