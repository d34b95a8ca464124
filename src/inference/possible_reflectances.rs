//! The posterior of a reflectance as a few of them, each with its weight.

use super::finish::FinishVerdict;
use super::light_posterior::ChannelReflectance;
use super::posterior::Posterior;
use crate::illumination::Luminance;
use crate::reflectance::{Finish, Material};

/// One of the reflectances that a ball may have: a point of a quadrature over their posterior.
///
/// How bright the ball is as a whole is left apart from what it is: of light L and a reflectance ρ
/// the picture shows what L/s and sρ do. `inverse_scale` holds the means of 1/s and of 1/s² of each
/// channel, s the ratio of its base colour to the one taken here.
///
/// ```
/// use lobes::inference::{ChannelReflectance, PossibleReflectance};
/// // A mirror of silver, which is known.
/// let silver = ChannelReflectance { diffuse: 0.0, specular: 0.95, sigma: 0.0 };
/// let known = PossibleReflectance::known([silver; 3]);
/// assert_eq!((known.weight, known.inverse_scale[0]), (1.0, [1.0, 1.0]));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PossibleReflectance {
    /// How likely it is before the light is looked at; all of a posterior sum to 1.
    pub weight: f64,
    /// What red, green and blue see; σ is one.
    pub channels: [ChannelReflectance; 3],
    /// The means of 1/s and 1/s², by channel.
    pub inverse_scale: [[f64; 2]; 3],
}

impl PossibleReflectance {
    /// The only one there is, that of a material.
    ///
    /// ```
    /// use lobes::inference::PossibleReflectance;
    /// use lobes::reflectance::presets;
    /// let gold = PossibleReflectance::of_material(&presets()[6]);
    /// assert_eq!(gold.channels[2].specular, presets()[6].specular()[2]);
    /// ```
    pub fn of_material(material: &Material) -> Self {
        Self::known([0, 1, 2].map(|channel| ChannelReflectance {
            diffuse: material.diffuse()[channel],
            specular: material.specular()[channel],
            sigma: material.roughness().sigma(),
        }))
    }

    /// The only one there is.
    pub fn known(channels: [ChannelReflectance; 3]) -> Self {
        Self {
            weight: 1.0,
            channels,
            inverse_scale: [[1.0; 2]; 3],
        }
    }
}

/// Points of the quadrature.
const POINTS: usize = 6;

/// σ is taken from the series `SMOOTHEST` · `RATIO`^i, so that pictures share their operators, and
/// as 0 below `SMOOTHEST`, where nothing is told apart.
const SMOOTHEST: f64 = 0.02;
const RATIO: f64 = 1.15;

/// The shares that a dielectric can have.
const PLASTIC: (f64, f64) = (0.02, 0.75);

/// A dielectric's specular reflectance: an index of 1.33 … 1.9.
const SPECULAR: (f64, f64) = (0.02, 0.1);

/// As dark as this is as good as black.
const DARKEST: f64 = 0.01;

impl FinishVerdict {
    /// The posterior of the reflectance, given that the finish is the likeliest of the four, as a few
    /// points with weights: at quantiles of σ and of the specular share that lie as a lattice in
    /// their square, those of the share among 0.02 … 0.75 for a dielectric and those of σ below
    /// [`Finish::ROUGH`] or above for a smooth and a rough metal. The base colour is that of
    /// [`Self::base_colour`], and its deviation makes the scale's.
    pub fn possible_reflectances(&self) -> Vec<PossibleReflectance> {
        let base = self.base_colour().map(|value| value.max(DARKEST));
        let body = Luminance::Rec709.of(base);
        let inverse_scale = self.ln_base_colour.map(|(mean, deviation)| {
            let reference = mean.min(0.0).max(DARKEST.ln());
            let ends = [DARKEST.ln() - reference, -reference];
            [1.0, 2.0].map(|power| inverse_moment(mean - reference, deviation, ends, power))
        });
        let finish = self.likeliest_finish();
        let count = match finish {
            Finish::Matte => 1,
            _ => POINTS,
        };
        let smooth = level(&self.sigma, Finish::ROUGH);
        let mut points: Vec<PossibleReflectance> = Vec::new();
        for i in 0..count {
            let along = (i as f64 + 0.5) / count as f64;
            // The golden section's lattice in the square of the two.
            let across = (0.5 + i as f64 * 0.618_033_988_749_895).fract();
            let sigma = |(low, high): (f64, f64)| {
                of_series(self.sigma.quantile(low + (high - low) * along))
            };
            let (diffuse, specular, sigma) = match finish {
                Finish::Matte => (base, [0.0; 3], 0.0),
                Finish::SmoothMetal => ([0.0; 3], base, sigma((0.0, smooth))),
                Finish::RoughMetal => ([0.0; 3], base, sigma((smooth, 1.0)).max(Finish::ROUGH)),
                _ => {
                    let share = self.share_within(PLASTIC, across);
                    let specular = body * share / (1.0 - share);
                    let specular = specular.clamp(SPECULAR.0, SPECULAR.1);
                    (base, [specular; 3], sigma((0.0, 1.0)))
                }
            };
            let channels = [0, 1, 2].map(|c| ChannelReflectance {
                diffuse: diffuse[c],
                specular: specular[c],
                sigma,
            });
            let weight = 1.0 / count as f64;
            // σ comes from a series, so that points may fall together.
            let same = |point: &&mut PossibleReflectance| point.channels == channels;
            match points.iter_mut().find(same) {
                Some(point) => point.weight += weight,
                None => points.push(PossibleReflectance {
                    weight,
                    channels,
                    inverse_scale,
                }),
            }
        }
        points
    }

    /// A quantile of the share, given that it lies between two; evenly in its logarithm where it can
    /// hardly be.
    fn share_within(&self, (low, high): (f64, f64), at: f64) -> f64 {
        let [from, to] = [low, high].map(|value| level(&self.share, value));
        if to - from < 1e-6 {
            return low * (high / low).powf(at);
        }
        let share = self.share.quantile(from + (to - from) * at);
        share.clamp(low, high)
    }
}

impl Posterior {
    /// The posterior as a few points of one weight each, at equal steps of its probability along the
    /// cells by rising σ and share: a grey ball whose albedos sum to 1, since evidence knows no
    /// brightness and no colour. The light is then that of such a ball.
    ///
    /// ```
    /// use lobes::inference::{Posterior, PossibleReflectance};
    /// fn roughest(posterior: &Posterior) -> f64 {
    ///     let points = posterior.possible_reflectances();
    ///     points.iter().map(|point| point.channels[0].sigma).fold(0.0, f64::max)
    /// }
    /// ```
    pub fn possible_reflectances(&self) -> Vec<PossibleReflectance> {
        let weight = 1.0 / POINTS as f64;
        let mut points: Vec<PossibleReflectance> = Vec::new();
        let (mut below, mut taken) = (0.0, 0);
        for (cell, probability) in self.probabilities().iter().enumerate() {
            below += probability;
            let reached = (0..POINTS)
                .filter(|i| weight * (*i as f64 + 0.5) < below)
                .count();
            if reached > taken {
                let share = self.shares()[cell % self.shares().len()];
                let channel = ChannelReflectance {
                    diffuse: 1.0 - share,
                    specular: share,
                    sigma: self.sigmas()[cell / self.shares().len()],
                };
                let mut point = PossibleReflectance::known([channel; 3]);
                point.weight = weight * (reached - taken) as f64;
                points.push(point);
                taken = reached;
            }
        }
        points
    }
}

/// The probability of a posterior below a value.
fn level(posterior: &super::Binned, value: f64) -> f64 {
    let ends = posterior.ends().windows(2);
    let below = ends
        .zip(posterior.masses())
        .map(|(ends, mass)| mass * ((value - ends[0]) / (ends[1] - ends[0])).clamp(0.0, 1.0));
    below.sum()
}

/// The nearest of the series of σ.
fn of_series(sigma: f64) -> f64 {
    if sigma < SMOOTHEST {
        return 0.0;
    }
    SMOOTHEST * RATIO.powf(((sigma / SMOOTHEST).ln() / RATIO.ln()).round())
}

/// The mean of exp(−kX) of X ~ N(m, d²) between two ends:
/// exp(−km + k²d²/2) (Φ(β + kd) − Φ(α + kd))/(Φ(β) − Φ(α)), α and β the ends less m over d.
fn inverse_moment(mean: f64, deviation: f64, ends: [f64; 2], power: f64) -> f64 {
    let [low, high] = ends.map(|end| (end - mean) / deviation);
    // What lies this far beyond an end is as good as at it.
    if high < -5.0 {
        return (-power * ends[1]).exp();
    }
    if low > 5.0 {
        return (-power * ends[0]).exp();
    }
    let between = |shift: f64| {
        let upper = |x: f64| 0.5 * libm::erfc(x / std::f64::consts::SQRT_2);
        // From the side on which both are small.
        if low + shift > 0.0 {
            upper(low + shift) - upper(high + shift)
        } else {
            upper(-high - shift) - upper(-low - shift)
        }
    };
    let shift = power * deviation;
    (-power * mean + 0.5 * shift * shift).exp() * between(shift) / between(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By mpmath's quadrature of exp(−kx) times the normal density and of the density, 30 digits.
    #[test]
    fn moments_are_those_of_quadrature() {
        for (mean, deviation, ends, expected) in MOMENTS {
            for (power, expected) in [1.0, 2.0].into_iter().zip(expected) {
                let found = inverse_moment(mean, deviation, ends, power);
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
            }
        }
        // Far beyond the end.
        assert_eq!(inverse_moment(4.0, 0.1, [-3.0, 0.0], 2.0), 1.0);
        assert_eq!(inverse_moment(-9.0, 0.1, [-3.0, 0.0], 1.0), 3f64.exp());
    }

    const MOMENTS: [(f64, f64, [f64; 2], [f64; 2]); 3] = [
        (0.0, 0.3, [-2.5, 0.4], [1.09208192838154, 1.28233788860752]),
        (0.2, 0.5, [-4.0, 0.0], [1.453434009775, 2.32769865369616]),
        (-0.1, 1.5, [-1.0, 3.0], [0.886166002119394, 1.2759335398349]),
    ];
}
