//! An evaluation, prepared once and run on any number of pairs.

use super::{BallRenderer, LightErrors, Protocol};
use crate::illumination::EnvironmentMap;
use crate::reflection::{RingLight, SphereImage, check_size};
use crate::{Error, Parallelism, Result};

/// The errors of one estimate. [`Evaluator`] has an example.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Of each ball's picture, each of the protocol's measures in turn.
    pub balls: Vec<Vec<f64>>,
    /// Of the maps themselves, as the files have them.
    pub light: LightErrors,
}

/// A [`Protocol`] with its balls prepared.
///
/// ```
/// use lobes::evaluation::{Evaluator, Preset};
/// use lobes::{Parallelism, illumination::EnvironmentMap};
/// let evaluator = Evaluator::new(Preset::Recommended.protocol()?, 32, Parallelism::Sequential)?;
/// let sky = |top: f64| {
///     let pixels = (0..128 * 64).map(|i| [if i < 64 * 64 { top } else { 1.0 }; 3]);
///     EnvironmentMap::new("sky", 128, 64, pixels.collect())
/// };
/// let (truth, estimate) = (sky(3.0)?, sky(2.0)?);
/// let errors = evaluator.evaluate(&truth, &estimate, Parallelism::Sequential)?;
/// // Every ball that mirrors the sky tells it too dark; nothing has a wrong colour.
/// assert!(errors.balls.iter().all(|ball| ball[0] > 0.2 && ball[2] < 1e-5));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Evaluator {
    protocol: Protocol,
    size: usize,
    renderers: Vec<BallRenderer>,
}

impl Evaluator {
    /// Prepares a protocol for pictures of `size` × `size` pixels.
    ///
    /// # Errors
    /// [`Error::Domain`] for a size that no picture has, or a ball that cannot be rendered.
    pub fn new(protocol: Protocol, size: usize, parallelism: Parallelism) -> Result<Self> {
        check_size(size)?;
        let renderers = protocol
            .balls
            .iter()
            .map(|ball| ball.renderer(&protocol.camera, parallelism))
            .collect::<Result<_>>()?;
        Ok(Self {
            protocol,
            size,
            renderers,
        })
    }

    /// What is evaluated.
    pub fn protocol(&self) -> &Protocol {
        &self.protocol
    }

    /// The balls' pictures under a map, after the protocol has prepared it.
    ///
    /// # Errors
    /// As [`BallRenderer::render`].
    pub fn pictures(
        &self,
        map: &EnvironmentMap,
        parallelism: Parallelism,
    ) -> Result<Vec<SphereImage>> {
        let map = self.protocol.prepare(map)?;
        let light = RingLight::of(&map, &self.protocol.camera)?;
        parallelism
            .map(self.renderers.len(), |ball| {
                self.renderers[ball].render(&map, &light, self.size)
            })
            .into_iter()
            .collect()
    }

    /// The errors of an estimate.
    ///
    /// # Errors
    /// [`Error::DifferentSizes`] for maps of two sizes that the protocol does not bring to one;
    /// [`Error::Black`] where a ball shows nothing and a measure has no value for that.
    pub fn evaluate(
        &self,
        truth: &EnvironmentMap,
        estimate: &EnvironmentMap,
        parallelism: Parallelism,
    ) -> Result<Evaluation> {
        if self.protocol.rows.is_none() && truth.height() != estimate.height() {
            return Err(Error::DifferentSizes {
                truth: truth.name().to_owned(),
                truth_size: (truth.width(), truth.height()),
                estimate: estimate.name().to_owned(),
                estimate_size: (estimate.width(), estimate.height()),
            });
        }
        let of_truth = self.pictures(truth, parallelism)?;
        let of_estimate = self.pictures(estimate, parallelism)?;
        let balls = of_truth
            .iter()
            .zip(&of_estimate)
            .map(|(truth, estimate)| {
                let measures = self.protocol.measures.iter();
                measures
                    .map(|measure| measure.of(truth, estimate))
                    .collect::<Result<Vec<f64>>>()
            })
            .collect::<Result<_>>()?;
        Ok(Evaluation {
            balls,
            light: LightErrors::between(truth, estimate, parallelism)?,
        })
    }
}
