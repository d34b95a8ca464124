//! The finish of a ball off one photograph, whatever its colour.

use super::binned::Binned;
use super::network::Network;
use super::portrait::Portrait;
use crate::error::check_length;
use crate::illumination::Luminance;
use crate::reflectance::{Finish, Material};
use crate::{Error, Result};

/// A model that tells the finish of a real ball: it has learned from simulated photographs.
///
/// Names of materials carry colours; a finish does not. The model is a [`Network`] over a
/// [`Portrait`]: its statistics, less their mean over their standard deviation, and its picture.
/// The outputs are scores of the four finishes and of "no single finish", of bins of σ and of the
/// specular share, and the mean and the logarithm of the deviation of ln of the base colour. Scores
/// become probabilities by exp(s/T)/Σ exp(s/T), with a temperature T that makes the finishes of
/// photographs likeliest that were not learned from (Guo et al. 2017, arXiv:1706.04599). A portrait
/// and its mirror image are both judged, and their outputs averaged.
///
/// How often it is right: `docs/explanation/photographs.md`.
///
/// ```
/// # #[cfg(feature = "builtin")] {
/// use lobes::inference::FinishModel;
/// // What a program keeps of a model is its bytes.
/// let model = FinishModel::builtin()?;
/// assert_eq!(FinishModel::from_bytes(&model.to_bytes())?, model);
/// # }
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FinishModel {
    pub(super) network: Network,
    /// What is taken off the statistics, and what they are divided by.
    pub(super) centre: Vec<f32>,
    pub(super) scale: Vec<f32>,
    pub(super) temperature: f64,
}

/// What a [`FinishModel`] says of one photograph.
///
/// The parameters' posteriors are those under the condition that the surface has the parameter: σ
/// that it is not matte, the others that it has a single finish.
///
/// ```
/// use lobes::inference::{Binned, FinishVerdict};
/// use lobes::reflectance::Finish;
/// let verdict = FinishVerdict {
///     finishes: [0.1, 0.6, 0.15, 0.05],
///     none: 0.1,
///     sigma: Binned::new(&[0.0, 0.05, 0.1], vec![0.75, 0.25])?,
///     share: Binned::new(&[0.0, 0.2, 1.0], vec![0.9, 0.1])?,
///     ln_base_colour: [(-1.0, 0.2); 3],
/// };
/// assert_eq!(verdict.finish(), Some(Finish::GlossyPlastic));
/// assert!((verdict.metallic() - 0.2 / 0.9).abs() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FinishVerdict {
    /// The probability of each of [`Finish::ALL`].
    pub finishes: [f64; 4],
    /// The probability that no single finish explains the ball: glass, or a picture of a ball.
    pub none: f64,
    /// σ, Ward's roughness, the standard deviation of the slopes over √2.
    pub sigma: Binned,
    /// The specular share `ρ_s / (ρ_s + ρ_d)`, luminances, straight on.
    pub share: Binned,
    /// Mean and standard deviation of the natural logarithm of the base colour's red, green and
    /// blue: the body's albedo, or a metal's reflectance straight on.
    pub ln_base_colour: [(f64, f64); 3],
}

impl FinishVerdict {
    /// The likeliest finish, or nothing where "no single finish" is likelier than each.
    pub fn finish(&self) -> Option<Finish> {
        let likeliest = self.likeliest_finish();
        (self.finishes[likeliest.index()] >= self.none).then_some(likeliest)
    }

    /// The likeliest of the four finishes, "no single finish" left aside.
    pub fn likeliest_finish(&self) -> Finish {
        let likeliest = (0..4).max_by(|&a, &b| self.finishes[a].total_cmp(&self.finishes[b]));
        Finish::ALL[likeliest.unwrap_or(0)]
    }

    /// The probability of the likeliest answer.
    pub fn probability(&self) -> f64 {
        self.finishes.iter().copied().fold(self.none, f64::max)
    }

    /// The probability of a metal among the four finishes: `metallic` of glTF.
    pub fn metallic(&self) -> f64 {
        let all: f64 = self.finishes.iter().sum();
        let metal: f64 = Finish::ALL
            .iter()
            .zip(self.finishes)
            .filter(|(finish, _)| matches!(finish, Finish::RoughMetal | Finish::SmoothMetal))
            .map(|(_, p)| p)
            .sum();
        if all > 0.0 { metal / all } else { 0.5 }
    }

    /// The base colour where a channel is as likely lower as higher, each at most 1.
    pub fn base_colour(&self) -> [f64; 3] {
        self.ln_base_colour.map(|(mean, _)| mean.exp().min(1.0))
    }

    /// The base colour's low and high ends of the interval that holds nine of ten values of a
    /// channel, each at most 1.
    pub fn base_colour_interval(&self) -> [[f64; 2]; 3] {
        // Φ⁻¹(0.95).
        const NINE_TENTHS: f64 = 1.644_853_626_951_472_7;
        self.ln_base_colour.map(|(mean, deviation)| {
            let at = |sign: f64| (mean + sign * NINE_TENTHS * deviation).exp().min(1.0);
            [at(-1.0), at(1.0)]
        })
    }
}

impl FinishVerdict {
    /// The likeliest material, for programs that render: its finish the likeliest of the four, its
    /// other numbers medians, a σ below 0.02 taken as a mirror's.
    ///
    /// A metal's reflectance is the base colour. A dielectric's specular reflectance is what the
    /// share makes of it, but no less than 0.02 and no more than 0.1: an index of 1.33 … 1.9.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn likeliest_material(&self, name: &str) -> Result<Material> {
        let base = self.base_colour();
        let median = self.sigma.quantile(0.5);
        let sigma = if median < Outputs::SIGMAS[1] {
            0.0
        } else {
            median
        };
        match self.likeliest_finish() {
            Finish::Matte => Material::plastic(name, base, 0.0, 0.0),
            Finish::RoughMetal | Finish::SmoothMetal => Material::metal(name, base, 1.0, sigma),
            _ => {
                let share = self.share.quantile(0.5).min(0.99);
                let body = Luminance::Rec709.of(base);
                let specular = (body * share / (1.0 - share)).clamp(0.02, 0.1);
                Material::plastic(name, base, specular, sigma)
            }
        }
    }
}

/// How the outputs of the network are laid out.
pub(super) struct Outputs;

impl Outputs {
    /// The finishes, and "no single finish".
    pub(super) const FINISHES: usize = 5;

    /// The ends of the bins of σ; below the second nothing is told apart in a portrait.
    pub(super) const SIGMAS: [f64; 10] =
        [0.0, 0.02, 0.03, 0.045, 0.065, 0.095, 0.14, 0.2, 0.3, 0.45];

    /// The ends of the bins of the share.
    pub(super) const SHARES: [f64; 10] = [0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.55, 0.75, 0.95, 1.0];

    pub(super) const SIGMA: usize = Self::FINISHES;
    pub(super) const SHARE: usize = Self::SIGMA + Self::SIGMAS.len() - 1;
    pub(super) const COLOUR: usize = Self::SHARE + Self::SHARES.len() - 1;
    pub(super) const COUNT: usize = Self::COLOUR + 6;

    /// The range of ln of a deviation of ln of a colour.
    pub(super) const LN_DEVIATION: (f64, f64) = (-3.0, 1.0);
}

/// exp(s/T) of scores over their sum.
pub(super) fn softmax(scores: &[f32], temperature: f64) -> Vec<f64> {
    let scaled = scores.iter().map(|score| f64::from(*score) / temperature);
    let largest = scaled.clone().fold(f64::NEG_INFINITY, f64::max);
    let exponentials: Vec<f64> = scaled.map(|score| (score - largest).exp()).collect();
    let sum: f64 = exponentials.iter().sum();
    exponentials.iter().map(|value| value / sum).collect()
}

/// Statistics farther from their mean than this many standard deviations count as that far.
const FARTHEST: f32 = 6.0;

impl FinishModel {
    /// The outputs of the network, a portrait and its mirror image averaged.
    pub(super) fn outputs(&self, portrait: &Portrait) -> Result<Vec<f32>> {
        let statistics = self.standardised(portrait)?;
        let [once, mirrored] = [false, true].map(|mirrored| {
            self.network
                .outputs(&portrait.inputs(mirrored), &statistics)
        });
        let (once, mirrored) = (once?, mirrored?);
        Ok(once
            .iter()
            .zip(&mirrored)
            .map(|(a, b)| 0.5 * (a + b))
            .collect())
    }

    pub(super) fn standardised(&self, portrait: &Portrait) -> Result<Vec<f32>> {
        let statistics = portrait.statistics();
        check_length(
            "the statistics of a portrait",
            self.centre.len(),
            statistics.len(),
        )?;
        let of = statistics.iter().zip(&self.centre).zip(&self.scale);
        Ok(of
            .map(|((value, centre), scale)| ((value - centre) / scale).clamp(-FARTHEST, FARTHEST))
            .collect())
    }

    /// The model of the repository, `data/models/finish.bin`: how it was made stands beside it.
    ///
    /// ```
    /// use lobes::inference::{FinishModel, PortraitReader};
    /// use lobes::picture::{Circle, Picture};
    ///
    /// // A disc that is brighter towards one side, as a matte ball is under one light.
    /// let shade = |x: f64, y: f64| if x.hypot(y) < 60.0 { 0.02 + 0.4 * (0.5 + (x - y) / 170.0) } else { 0.0 };
    /// let pixels = (0..160 * 160).map(|i| [shade((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5); 3]);
    /// let picture = Picture::linear(160, 160, pixels.collect())?;
    /// let portrait = PortraitReader::new()?.read(&picture, Circle { x: 80.0, y: 80.0, radius: 60.0 })?;
    /// let verdict = FinishModel::builtin()?.verdict(&portrait)?;
    /// assert!((verdict.finishes.iter().sum::<f64>() + verdict.none - 1.0).abs() < 1e-9);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// None that a caller can cause.
    #[cfg(feature = "builtin")]
    pub fn builtin() -> Result<Self> {
        Self::from_bytes(include_bytes!("../../data/models/finish.bin"))
    }

    /// What the model says of a portrait.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn verdict(&self, portrait: &Portrait) -> Result<FinishVerdict> {
        let outputs = self.outputs(portrait)?;
        let finishes = softmax(&outputs[..Outputs::FINISHES], self.temperature);
        let bins = |first: usize, ends: &'static [f64]| {
            Binned::new(ends, softmax(&outputs[first..first + ends.len() - 1], 1.0))
        };
        let colour = |c: usize| {
            let (low, high) = Outputs::LN_DEVIATION;
            let mean = f64::from(outputs[Outputs::COLOUR + c]);
            let ln_deviation = f64::from(outputs[Outputs::COLOUR + 3 + c]).clamp(low, high);
            (mean, ln_deviation.exp())
        };
        Ok(FinishVerdict {
            finishes: [0, 1, 2, 3].map(|i| finishes[i]),
            none: finishes[4],
            sigma: bins(Outputs::SIGMA, &Outputs::SIGMAS)?,
            share: bins(Outputs::SHARE, &Outputs::SHARES)?,
            ln_base_colour: [0, 1, 2].map(colour),
        })
    }

    /// The model's numbers: temperature, centres and scales of the statistics, and the network, as
    /// little-endian `f32`.
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = [self.temperature as f32];
        let numbers = head.iter().chain(&self.centre).chain(&self.scale);
        let mut bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        bytes.extend(self.network.to_bytes());
        bytes
    }

    /// The model that [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of bytes; [`Error::NotFinite`] and [`Error::Domain`] for
    /// numbers that are no model's.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let head = 4 * (1 + 2 * Portrait::STATISTICS);
        let Some((head_bytes, rest)) = bytes.split_at_checked(head) else {
            return Err(Error::Length {
                what: "the bytes of a model of finishes",
                expected: head,
                got: bytes.len(),
            });
        };
        let (fours, _) = head_bytes.as_chunks::<4>();
        let numbers: Vec<f32> = fours.iter().map(|four| f32::from_le_bytes(*four)).collect();
        let as_f64: Vec<f64> = numbers.iter().map(|number| f64::from(*number)).collect();
        crate::error::check_finite("a model of finishes", &as_f64)?;
        let (centre, scale) = numbers[1..].split_at(Portrait::STATISTICS);
        for value in scale.iter().chain(&numbers[..1]) {
            if *value <= 0.0 {
                return Err(Error::Domain {
                    what: "a scale of a model of finishes",
                    value: f64::from(*value),
                    allowed: "above 0",
                });
            }
        }
        Ok(Self {
            network: Network::from_bytes(Portrait::STATISTICS, Outputs::COUNT, rest)?,
            centre: centre.to_vec(),
            scale: scale.to_vec(),
            temperature: f64::from(numbers[0]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> FinishModel {
        FinishModel {
            network: Network::random(Portrait::STATISTICS, Outputs::COUNT, 4),
            centre: vec![0.5; Portrait::STATISTICS],
            scale: vec![2.0; Portrait::STATISTICS],
            temperature: 1.25,
        }
    }

    #[test]
    fn what_was_written_is_read_and_what_is_no_model_is_refused() {
        let bytes = model().to_bytes();
        assert_eq!(FinishModel::from_bytes(&bytes).unwrap(), model());
        assert!(FinishModel::from_bytes(&bytes[..100]).is_err());
        assert!(FinishModel::from_bytes(&bytes[..bytes.len() - 4]).is_err());
        let with = |place: usize, value: f32| {
            let mut bytes = bytes.clone();
            bytes[4 * place..4 * place + 4].copy_from_slice(&value.to_le_bytes());
            FinishModel::from_bytes(&bytes)
        };
        // The temperature, a centre, a scale.
        assert!(with(0, 0.0).is_err());
        assert!(with(7, f32::NAN).is_err());
        assert!(with(1 + Portrait::STATISTICS, -1.0).is_err());
    }

    fn verdict(finishes: [f64; 4], sigma: usize, share: usize, ln: f64) -> FinishVerdict {
        let bin = |ends: &[f64], place: usize| {
            let mut masses = vec![0.0; ends.len() - 1];
            masses[place] = 1.0;
            Binned::new(ends, masses).unwrap()
        };
        FinishVerdict {
            finishes,
            none: 0.1,
            sigma: bin(&Outputs::SIGMAS, sigma),
            share: bin(&Outputs::SHARES, share),
            ln_base_colour: [(ln, 0.1), (ln, 0.2), (ln, 0.3)],
        }
    }

    #[test]
    fn the_likeliest_material_is_what_was_said() {
        let matte = verdict([0.8, 0.1, 0.0, 0.0], 5, 1, -1.0);
        let material = matte.likeliest_material("a").unwrap();
        assert_eq!((material.finish(), material.name()), (Finish::Matte, "a"));
        assert!((material.diffuse()[0] - (-1.0f64).exp()).abs() < 1e-12);
        assert_eq!(matte.metallic(), 0.0);
        // Below 0.02 it is a mirror; above, the median.
        let metal = verdict([0.0, 0.0, 0.3, 0.6], 0, 8, -0.2);
        let material = metal.likeliest_material("b").unwrap();
        assert_eq!(material.finish(), Finish::SmoothMetal);
        assert_eq!(material.roughness().sigma(), 0.0);
        assert_eq!((metal.sigma.below(), metal.metallic()), (Some(0.02), 1.0));
        let rough = verdict([0.0, 0.0, 0.9, 0.0], 5, 8, 3.0);
        let material = rough.likeliest_material("c").unwrap();
        assert_eq!(material.finish(), Finish::RoughMetal);
        assert!((0.095..0.14).contains(&material.roughness().sigma()));
        // A reflectance above 1 is taken for 1.
        assert_eq!(material.specular(), [1.0; 3]);
        // A dielectric keeps within indices of 1.33 … 1.9 whatever the share.
        for share in 0..9 {
            let plastic = verdict([0.0, 0.9, 0.0, 0.0], 1, share, -2.0);
            let material = plastic.likeliest_material("d").unwrap();
            assert!((0.02..=0.1).contains(&material.specular()[0]), "{share}");
            assert_eq!(material.finish(), Finish::GlossyPlastic);
        }
    }

    #[test]
    fn none_is_said_where_it_is_likelier_than_each() {
        let mut open = verdict([0.3, 0.3, 0.2, 0.1], 1, 1, 0.0);
        assert_eq!(open.finish(), Some(Finish::GlossyPlastic));
        open.none = 0.4;
        assert_eq!((open.finish(), open.probability()), (None, 0.4));
        let [low, high] = open.base_colour_interval()[0];
        assert!(low < 1.0 && high == 1.0);
    }

    #[test]
    fn a_temperature_keeps_the_order() {
        let cold = softmax(&[1.0, 2.0, 0.0], 0.5);
        let warm = softmax(&[1.0, 2.0, 0.0], 3.0);
        assert!((cold.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(cold[1] > warm[1] && warm[1] > warm[0] && warm[0] > warm[2]);
        // Scores of any size.
        assert_eq!(softmax(&[1e4, -1e4], 1.0), [1.0, 0.0]);
    }
}
