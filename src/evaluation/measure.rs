//! Errors of a picture of a ball, each with its definition.

use crate::error::check_length;
use crate::named;
use crate::reflection::SphereImage;
use crate::{Error, Result};

/// An error of a picture of a ball under estimated light, against the one under true light.
///
/// With t and e the pixels of the truth and the estimate, N how many pixels show the ball, and sums
/// over those pixels and, where it is said, over the three channels.
///
/// ```
/// use lobes::evaluation::Measure;
/// use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let truth = SphereImage::new(camera, 8, vec![[1.0; 3]; 64])?;
/// let estimate = truth.map(|pixel| pixel.map(|value| 1.5 * value));
/// assert!((Measure::RelativeRmse.of(&truth, &estimate)? - 0.5).abs() < 1e-14);
/// assert!(Measure::RelativeScaledRmse.of(&truth, &estimate)? < 1e-7);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Measure {
    /// √(Σ (e − t)² / Σ t²), over pixels and channels.
    RelativeRmse,
    /// The same of s e, with the one s for all channels that makes it least.
    RelativeScaledRmse,
    /// The mean angle between t and e as colours, in degrees; pixels where either is black are left
    /// out.
    Angle,
    /// √(Σ (e − t)² / N): channels are summed, not averaged.
    SummedRmse,
    /// The same of s e, with the s that makes it least.
    SummedScaledRmse,
    /// The mean over all N pixels of the angle between t and e, in degrees, where a pixel that is
    /// black in either counts as 0.
    AngleBlackIsZero,
    /// √(Σ (e' − t')² / N), channels summed, where t' and e' are each brought to [0, 1] by their
    /// own percentiles 0.01 and 99.9 over a frame of which the ball fills 12 %, the rest black.
    NormalisedRmse,
    /// √(Σ (e − t)² / 3N), over pixels and channels.
    MeanRmse,
    /// The same of s e, with the s that makes it least.
    MeanScaledRmse,
    /// 20 log₁₀(the largest value of either picture / [`MeanRmse`](Self::MeanRmse)), in decibels;
    /// 100 where the pictures are the same. More is better.
    PeakSignalToNoise,
}

/// What share of `DiffusionLight`'s and `StyleLight`'s frames of 960 × 540 pixels the ball fills: its
/// outline seen from √260 radii through a lens of 85 mm on 36 mm.
const FRAME_SHARE: f64 = 0.1214;

impl Measure {
    /// Every measure.
    pub const ALL: [Self; 10] = [
        Self::RelativeRmse,
        Self::RelativeScaledRmse,
        Self::Angle,
        Self::SummedRmse,
        Self::SummedScaledRmse,
        Self::AngleBlackIsZero,
        Self::NormalisedRmse,
        Self::MeanRmse,
        Self::MeanScaledRmse,
        Self::PeakSignalToNoise,
    ];

    /// Its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::RelativeRmse => "relative-rmse",
            Self::RelativeScaledRmse => "relative-si-rmse",
            Self::Angle => "angle",
            Self::SummedRmse => "summed-rmse",
            Self::SummedScaledRmse => "summed-si-rmse",
            Self::AngleBlackIsZero => "angle-black-is-0",
            Self::NormalisedRmse => "normalised-rmse",
            Self::MeanRmse => "mean-rmse",
            Self::MeanScaledRmse => "mean-si-rmse",
            Self::PeakSignalToNoise => "psnr",
        }
    }

    /// What it is, as a sentence.
    pub fn definition(self) -> &'static str {
        match self {
            Self::RelativeRmse => {
                "root mean square of estimate − truth over the ball's pixels and the three channels, over the root mean square of the \
                 truth there"
            }
            Self::RelativeScaledRmse => {
                "the same after the estimate's picture is scaled by one number, for all channels, that makes it least"
            }
            Self::Angle => {
                "mean over the ball's pixels of the angle between the two colours as vectors (R, G, B), in degrees; pixels black in \
                 either picture are left out"
            }
            Self::SummedRmse => {
                "root of the mean over the ball's pixels of the sum over channels of (estimate − truth)², of tone-mapped light"
            }
            Self::SummedScaledRmse => {
                "the same after the estimate's picture is scaled by one number that makes it least"
            }
            Self::AngleBlackIsZero => {
                "mean over the ball's pixels of the angle between the two colours, in degrees; pixels black in either picture count as 0°"
            }
            Self::NormalisedRmse => {
                "like summed-rmse after each picture is brought to [0, 1] by its own percentiles 0.01 and 99.9 over the whole frame, of \
                 which the ball fills 12 % and black the rest"
            }
            Self::MeanRmse => {
                "root of the mean over the picture's pixels and channels of (estimate − truth)²"
            }
            Self::MeanScaledRmse => {
                "the same after the estimate's picture is scaled by one number that makes it least"
            }
            Self::PeakSignalToNoise => {
                "20 log10 of the largest value of either picture over mean-rmse, in dB, and 100 where that is 0; more is better"
            }
        }
    }

    /// The error of `estimate` against `truth`, pictures of one size by one camera.
    ///
    /// # Errors
    /// [`Error::Length`] if one shows more of the ball than the other; [`Error::Black`] where the
    /// measure has no value because a picture is black.
    pub fn of(self, truth: &SphereImage, estimate: &SphereImage) -> Result<f64> {
        let t: Vec<[f64; 3]> = truth.iter().map(|(_, _, pixel)| pixel).collect();
        let e: Vec<[f64; 3]> = estimate.iter().map(|(_, _, pixel)| pixel).collect();
        check_length("the picture of the estimate", t.len(), e.len())?;
        let count = t.len() as f64;
        let energy = product(&t, &t);
        match self {
            Self::RelativeRmse => Ok((of_difference(&t, &e) / lit(energy, TRUTH)?).sqrt()),
            Self::RelativeScaledRmse => Ok((of_scaled(&t, &e)? / lit(energy, TRUTH)?).sqrt()),
            Self::SummedRmse => Ok((of_difference(&t, &e) / count).sqrt()),
            Self::SummedScaledRmse => Ok((of_scaled(&t, &e)? / count).sqrt()),
            Self::MeanRmse => Ok((of_difference(&t, &e) / (3.0 * count)).sqrt()),
            Self::MeanScaledRmse => Ok((of_scaled(&t, &e)? / (3.0 * count)).sqrt()),
            Self::Angle => {
                let angles: Vec<f64> = t.iter().zip(&e).filter_map(|(t, e)| angle(t, e)).collect();
                if angles.is_empty() {
                    return Err(Error::Black { what: ESTIMATE });
                }
                Ok(angles.iter().sum::<f64>() / angles.len() as f64)
            }
            Self::AngleBlackIsZero => {
                let angles = t.iter().zip(&e).filter_map(|(t, e)| angle(t, e));
                Ok(angles.sum::<f64>() / count)
            }
            Self::NormalisedRmse => {
                let (t, e) = (normalised(&t, TRUTH)?, normalised(&e, ESTIMATE)?);
                Ok((of_difference(&t, &e) / count).sqrt())
            }
            Self::PeakSignalToNoise => {
                let error = (of_difference(&t, &e) / (3.0 * count)).sqrt();
                let both = t.iter().chain(&e).flatten();
                let largest = both.copied().fold(0.0, f64::max);
                Ok(if error == 0.0 {
                    100.0
                } else {
                    20.0 * (largest / error).log10()
                })
            }
        }
    }
}

named!(Measure, "measure");

const TRUTH: &str = "the ball's picture under the true light";
const ESTIMATE: &str = "the ball's picture under the estimated light";

fn product(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| a * b).sum()
}

fn of_difference(t: &[[f64; 3]], e: &[[f64; 3]]) -> f64 {
    let pairs = t.as_flattened().iter().zip(e.as_flattened());
    pairs.map(|(t, e)| (e - t) * (e - t)).sum()
}

/// Σ (s e − t)² with the s that makes it least.
fn of_scaled(t: &[[f64; 3]], e: &[[f64; 3]]) -> Result<f64> {
    let scale = product(t, e) / lit(product(e, e), ESTIMATE)?;
    let pairs = t.as_flattened().iter().zip(e.as_flattened());
    Ok(pairs.map(|(t, e)| (scale * e - t).powi(2)).sum())
}

fn lit(energy: f64, what: &'static str) -> Result<f64> {
    if energy > 0.0 {
        Ok(energy)
    } else {
        Err(Error::Black { what })
    }
}

/// The angle between two colours in degrees; none where one is black.
fn angle(t: &[f64; 3], e: &[f64; 3]) -> Option<f64> {
    let (t, e) = (glam::DVec3::from(*t), glam::DVec3::from(*e));
    let (sine, cosine) = (t.cross(e).length(), t.dot(e));
    (t.length() > 0.0 && e.length() > 0.0).then(|| sine.atan2(cosine).to_degrees())
}

/// All values brought to [0, 1] by the percentiles 0.01 and 99.9 of a frame that is black about the
/// ball.
fn normalised(pixels: &[[f64; 3]], what: &'static str) -> Result<Vec<[f64; 3]>> {
    let mut values = pixels.as_flattened().to_vec();
    values.sort_by(f64::total_cmp);
    let quantile = |share: f64| {
        // Black comes first: the ball's values are the last of the frame's.
        let within = (1.0 - (1.0 - share) / FRAME_SHARE).max(0.0);
        let place = within * (values.len() - 1) as f64;
        let (low, high) = (place.floor() as usize, place.ceil() as usize);
        values[low] + (place - low as f64) * (values[high] - values[low])
    };
    let high = lit(quantile(0.999), what)?;
    Ok(pixels.iter().map(|pixel| pixel.map(|v| v / high)).collect())
}
