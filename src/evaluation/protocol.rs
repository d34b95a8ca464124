//! What an evaluation consists of, and those that were published.

use glam::DVec3;

use super::{Ball, Gloss, Measure};
use crate::illumination::EnvironmentMap;
use crate::named;
use crate::reflectance::{Fresnel, Ggx};
use crate::reflection::Camera;
use crate::{Error, Result};

/// What is done to each map before it lights anything: its values to the power 1/γ, then scaled so
/// that a percentile of those above 0 becomes a given value. Nothing is clipped.
///
/// ```
/// use lobes::evaluation::ToneMap;
/// use lobes::illumination::EnvironmentMap;
/// let sky = EnvironmentMap::new("sky", 8, 4, vec![[16.0; 3]; 32])?;
/// let mapped = ToneMap { gamma: 2.0, percentile: 50.0, to: 0.5 }.apply(&sky)?;
/// assert!((mapped.pixels()[0][0] - 0.5).abs() < 1e-9);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToneMap {
    /// γ.
    pub gamma: f64,
    /// The percentile, from 0 to 100.
    pub percentile: f64,
    /// What it becomes.
    pub to: f64,
}

impl ToneMap {
    /// The map with its values changed so.
    ///
    /// # Errors
    /// [`Error::Black`] for a map without light, and those of [`EnvironmentMap::new`].
    pub fn apply(&self, map: &EnvironmentMap) -> Result<EnvironmentMap> {
        let power = |value: f64| value.powf(1.0 / self.gamma);
        let mut values: Vec<f64> = map.pixels().as_flattened().to_vec();
        values.retain(|value| *value > 0.0);
        if values.is_empty() {
            return Err(Error::Black {
                what: "the map that is to be tone-mapped",
            });
        }
        values.sort_by(f64::total_cmp);
        let place = self.percentile / 100.0 * (values.len() - 1) as f64;
        let (low, high) = (place.floor() as usize, place.ceil() as usize);
        let (below, above) = (power(values[low]), power(values[high]));
        let scale = self.to / (below + (place - low as f64) * (above - below) + 1e-10);
        let pixels = map.pixels().iter();
        let pixels = pixels.map(|pixel| pixel.map(|value| scale * power(value)));
        EnvironmentMap::new(map.name(), map.width(), map.height(), pixels.collect())
    }
}

/// How errors of many scenes become one.
///
/// ```
/// use lobes::evaluation::Average;
/// assert_eq!(Average::Median.of(&[1.0, 9.0, 2.0]), Some(2.0));
/// assert_eq!(Average::Mean.of(&[]), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Average {
    /// Their mean.
    Mean,
    /// Their median.
    Median,
}

impl Average {
    /// Every average.
    pub const ALL: [Self; 2] = [Self::Mean, Self::Median];

    /// `mean` or `median`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Median => "median",
        }
    }

    /// The average of some values; none of none.
    pub fn of(self, values: &[f64]) -> Option<f64> {
        if values.is_empty() {
            return None;
        }
        let count = values.len();
        match self {
            Self::Mean => Some(values.iter().sum::<f64>() / count as f64),
            Self::Median => {
                let mut sorted = values.to_vec();
                sorted.sort_by(f64::total_cmp);
                Some(0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]))
            }
        }
    }
}

named!(Average, "average");

/// What an evaluation consists of.
///
/// ```
/// use lobes::evaluation::{Preset, Protocol};
/// // The recommended one, at maps of 64 rows.
/// let protocol = Protocol { rows: Some(64), ..Preset::Recommended.protocol()? };
/// assert_eq!(protocol.balls.len(), 3);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    /// Who looks at the balls.
    pub camera: Camera,
    /// To how many rows the maps are brought first; as they are without it.
    pub rows: Option<usize>,
    /// What is done to the maps before they light anything.
    pub tone_map: Option<ToneMap>,
    /// The balls.
    pub balls: Vec<Ball>,
    /// The errors of their pictures.
    pub measures: Vec<Measure>,
    /// How those of many scenes become one.
    pub average: Average,
}

impl Protocol {
    /// A map as it lights the balls.
    ///
    /// # Errors
    /// As [`EnvironmentMap::resampled`].
    pub fn prepare(&self, map: &EnvironmentMap) -> Result<EnvironmentMap> {
        let resampled = match self.rows {
            Some(rows) if rows != map.height() => map.resampled(2 * rows, rows)?,
            _ => map.clone(),
        };
        match &self.tone_map {
            Some(tone_map) => tone_map.apply(&resampled),
            None => Ok(resampled),
        }
    }
}

/// Evaluations with a name. docs/reference/evaluation.md says where each differs from what its
/// authors ran.
///
/// ```
/// use lobes::evaluation::Preset;
/// let preset: Preset = "stylelight".parse()?;
/// assert_eq!(preset.protocol()?.rows, Some(128));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Preset {
    /// What this crate recommends: linear light at its own resolution, a mirror, rough metal
    /// (Ward's lobe, σ = 0.1) and a matte ball, errors relative to the truth.
    Recommended,
    /// The same measures on balls of every roughness: matte, Ward's lobe and GGX.
    Grid,
    /// `StyleLight` (Wang, Yang, Loy and Liu, ECCV 2022, arXiv:2207.14811): maps of 128 rows,
    /// tone-mapped before they light, three balls of Blender's principled shader seen from 16
    /// radii, sums over channels, means over scenes.
    StyleLight,
    /// `DiffusionLight` (Phongthawee et al., CVPR 2024, arXiv:2312.09168): the same pictures with its
    /// normalised error.
    DiffusionLight,
    /// The measures with which Weber, Garon and Lalonde (ECCV 2022, arXiv:2211.03928) and `EverLight`
    /// (Dastjerdi et al., ICCV 2023, arXiv:2304.13207) judge a scene of nine matte balls, here on
    /// one such ball without the ground.
    MatteBalls,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 5] = [
        Self::Recommended,
        Self::Grid,
        Self::StyleLight,
        Self::DiffusionLight,
        Self::MatteBalls,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recommended => "recommended",
            Self::Grid => "grid",
            Self::StyleLight => "stylelight",
            Self::DiffusionLight => "diffusionlight",
            Self::MatteBalls => "matte-balls",
        }
    }

    /// What it does to the maps and where its camera stands, as a sentence.
    pub fn description(self) -> &'static str {
        match self {
            Self::Recommended | Self::Grid => {
                "linear light as the files have it; an orthographic camera looks along −z; only the ball's pixels count; medians over scenes"
            }
            Self::StyleLight | Self::DiffusionLight => {
                "maps averaged to 128 rows, then to the power 1/2.4 and scaled so that the median of their values is 0.5, before they light \
                 anything; a camera 16.1 radii away and 7° above; only the ball's pixels count; means over scenes"
            }
            Self::MatteBalls => {
                "linear light; one matte ball of albedo 0.8 before nothing, an orthographic camera; medians over scenes"
            }
        }
    }

    /// The evaluation.
    ///
    /// # Errors
    /// None but those of constructors, which hold for what stands here.
    pub fn protocol(self) -> Result<Protocol> {
        let level = Camera::orthographic(DVec3::Z, DVec3::Y)?;
        let recommended = Protocol {
            camera: level,
            rows: None,
            tone_map: None,
            balls: vec![
                mirror(Fresnel::Constant(1.0)),
                ward("rough metal", 0.1),
                matte("matte", 0.5),
            ],
            measures: vec![
                Measure::RelativeRmse,
                Measure::RelativeScaledRmse,
                Measure::Angle,
            ],
            average: Average::Median,
        };
        let metal = Fresnel::Schlick { normal: 0.8 };
        let blender = Protocol {
            // At (0, −16, 2) of a world whose z is up.
            camera: Camera::perspective(DVec3::new(0.0, 2.0, 16.0), DVec3::Y, 260f64.sqrt())?,
            rows: Some(128),
            tone_map: Some(ToneMap {
                gamma: 2.4,
                percentile: 50.0,
                to: 0.5,
            }),
            balls: vec![
                mirror(metal),
                // The principled shader's roughness is the root of GGX's α.
                ggx("matte silver", 0.0, 0.3271f64.powi(2), metal)?,
                // Its "specular" of 0.5 is a reflectance of 4 % along the normal.
                ggx(
                    "diffuse",
                    0.8,
                    0.364f64.powi(2),
                    Fresnel::Schlick { normal: 0.04 },
                )?,
            ],
            measures: vec![
                Measure::SummedRmse,
                Measure::SummedScaledRmse,
                Measure::AngleBlackIsZero,
            ],
            average: Average::Mean,
        };
        Ok(match self {
            Self::Recommended => recommended,
            Self::Grid => Protocol {
                balls: vec![
                    mirror(Fresnel::Constant(1.0)),
                    ward("Ward, σ 0.1", 0.1),
                    ward("Ward, σ 0.2", 0.2),
                    ward("Ward, σ 0.4", 0.4),
                    ggx("GGX, α 0.1", 0.0, 0.1, Fresnel::Constant(1.0))?,
                    ggx("GGX, α 0.2", 0.0, 0.2, Fresnel::Constant(1.0))?,
                    ggx("GGX, α 0.4", 0.0, 0.4, Fresnel::Constant(1.0))?,
                    ggx("GGX, α 0.8", 0.0, 0.8, Fresnel::Constant(1.0))?,
                    matte("matte", 0.5),
                ],
                ..recommended
            },
            Self::StyleLight => blender,
            Self::DiffusionLight => Protocol {
                measures: vec![
                    Measure::SummedScaledRmse,
                    Measure::AngleBlackIsZero,
                    Measure::NormalisedRmse,
                ],
                ..blender
            },
            Self::MatteBalls => Protocol {
                balls: vec![matte("matte", 0.8)],
                measures: vec![
                    Measure::MeanRmse,
                    Measure::MeanScaledRmse,
                    Measure::Angle,
                    Measure::PeakSignalToNoise,
                ],
                ..recommended
            },
        })
    }

    /// The evaluation at another resolution of the maps than its own.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `rows` is even and from 4 to 4096.
    pub fn protocol_with_rows(self, rows: Option<usize>) -> Result<Protocol> {
        let mut protocol = self.protocol()?;
        if let Some(rows) = rows {
            if !(4..=4096).contains(&rows) || rows % 2 != 0 {
                return Err(Error::Domain {
                    what: "the number of rows that maps are brought to",
                    value: rows as f64,
                    allowed: "even and from 4 to 4096",
                });
            }
            protocol.rows = Some(rows);
        }
        Ok(protocol)
    }
}

named!(Preset, "preset");

fn mirror(fresnel: Fresnel) -> Ball {
    Ball {
        name: "mirror",
        diffuse: 0.0,
        gloss: Gloss::Mirror(fresnel),
    }
}

fn matte(name: &'static str, diffuse: f64) -> Ball {
    Ball {
        name,
        diffuse,
        gloss: Gloss::None,
    }
}

fn ward(name: &'static str, sigma: f64) -> Ball {
    Ball {
        name,
        diffuse: 0.0,
        gloss: Gloss::Ward {
            specular: 1.0,
            sigma,
        },
    }
}

fn ggx(name: &'static str, diffuse: f64, alpha: f64, fresnel: Fresnel) -> Result<Ball> {
    Ok(Ball {
        name,
        diffuse,
        gloss: Gloss::Ggx(Ggx::isotropic(alpha, fresnel)?),
    })
}
