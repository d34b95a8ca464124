//! The power spectrum of light, and the law that it follows.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

use super::{EnvironmentMap, Luminance};
use crate::harmonics::{Coefficients, Transform, average_power, cross_power};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result};

/// A power law B_l = k / l^(2+η).
///
/// Fitted by ordinary least squares of ln B_l against ln l: η = −slope − 2, ln k = intercept. The
/// standard errors are the regression's, which take the scatter about the line as independent from
/// degree to degree.
///
/// ```
/// use lobes::illumination::PowerLaw;
/// let power: Vec<f64> = (0..=64).map(|l| 3.0 / f64::from(l.max(1)).powf(2.4)).collect();
/// let law = PowerLaw::fit(&power, 1, 64)?;
/// assert!((law.eta - 0.4).abs() < 1e-12 && (law.k - 3.0).abs() < 1e-11);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredLaw")
)]
pub struct PowerLaw {
    /// The factor k, in the unit of the power.
    pub k: f64,
    /// The exponent past 2. The paper's two examples have 0.3 and 0.65.
    pub eta: f64,
    /// The standard error of η.
    pub eta_error: f64,
    /// The standard error of ln k.
    pub ln_k_error: f64,
}

/// A law as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct StoredLaw {
    k: f64,
    eta: f64,
    eta_error: f64,
    ln_k_error: f64,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredLaw> for PowerLaw {
    type Error = Error;

    fn try_from(stored: StoredLaw) -> Result<Self> {
        let StoredLaw {
            k,
            eta,
            eta_error,
            ln_k_error,
        } = stored;
        let domain = |what, value, allowed| Error::Domain {
            what,
            value,
            allowed,
        };
        if !(k > 0.0) {
            return Err(domain("the factor k of a power law", k, "above 0"));
        }
        if eta.is_nan() {
            return Err(domain("the exponent η of a power law", eta, "a number"));
        }
        for error in [eta_error, ln_k_error] {
            if !(error >= 0.0) {
                return Err(domain(
                    "a standard error of a power law",
                    error,
                    "at least 0",
                ));
            }
        }
        Ok(Self {
            k,
            eta,
            eta_error,
            ln_k_error,
        })
    }
}

impl PowerLaw {
    /// The law that fits `power` (B_l, from l = 0) best for `first` ≤ l ≤ `last`.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 1 ≤ first and there are at least three degrees; [`Error::Length`]
    /// where the spectrum ends before `last`; [`Error::NoPower`] where a power is not positive and
    /// has no logarithm.
    pub fn fit(power: &[f64], first: usize, last: usize) -> Result<Self> {
        if first < 1 || last < first.saturating_add(2) {
            return Err(Error::Domain {
                what: "the last degree of a power-law fit",
                value: last as f64,
                allowed: "at least two past the first, which is at least 1",
            });
        }
        if power.len() <= last {
            return Err(Error::Length {
                what: "the power spectrum",
                expected: last.saturating_add(1),
                got: power.len(),
            });
        }
        let points: Vec<(f64, f64)> = (first..=last)
            .map(|l| ((l as f64).ln(), power[l].ln()))
            .collect();
        if let Some(index) = points.iter().position(|point| !point.1.is_finite()) {
            return Err(Error::NoPower {
                what: "the spectrum",
                degree: first + index,
                value: power[first + index],
                consequence: "which has no logarithm to fit a power law to",
            });
        }
        let n = points.len() as f64;
        let mean_x = points.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = points.iter().map(|p| p.1).sum::<f64>() / n;
        let sxx: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        let sxy: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
        let slope = sxy / sxx;
        let intercept = mean_y - slope * mean_x;
        let residual: f64 = points
            .iter()
            .map(|p| (p.1 - intercept - slope * p.0).powi(2))
            .sum();
        let slope_error = (residual / (n - 2.0) / sxx).sqrt();
        Ok(Self {
            k: intercept.exp(),
            eta: -slope - 2.0,
            eta_error: slope_error,
            ln_k_error: slope_error * (sxx / n + mean_x * mean_x).sqrt(),
        })
    }
}

/// The spectrum of one illumination.
///
/// "White" light in the sense of the paper has the same spectrum in every channel:
/// [`etas`](Self::etas) says whether it falls alike, [`coherence`](Self::coherence) whether it is
/// the same pattern.
///
/// ```
/// use lobes::{Parallelism, illumination::{EnvironmentMap, LightSpectrum}};
/// let pixels = (0..64 * 32).map(|i| [1.0 + f64::from(i * 37 % 101), f64::from(i % 7), 0.0]);
/// let map = EnvironmentMap::new("patches", 64, 32, pixels.collect())?;
/// let spectrum = LightSpectrum::of(&map, 15, Parallelism::Sequential)?;
/// assert_eq!(spectrum.luminance.len(), 16);
/// // There is no blue, which has no law then.
/// assert!(spectrum.etas[0].is_some() && spectrum.etas[2].is_none());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredSpectrum")
)]
pub struct LightSpectrum {
    /// B_l of the luminance (Rec. 709), l = 0 … degree.
    pub luminance: Vec<f64>,
    /// B_l of red, green and blue.
    pub channels: [Vec<f64>; 3],
    /// The law of the luminance over [`FIT_RANGE`](Self::FIT_RANGE).
    pub law: PowerLaw,
    /// η of red, green and blue over the same range; nothing for a channel that does not vary.
    pub etas: [Option<f64>; 3],
    /// The mean over the range of the correlation of red and blue, Σ_m R_lm B_lm / √(Σ_m R_lm² Σ_m
    /// B_lm²): 1 where the light changes in brightness only, less where it changes in colour;
    /// nothing where red or blue does not vary.
    pub coherence: Option<f64>,
    /// η of the luminance with the brightest [`CLIPPED_SHARE`](Self::CLIPPED_SHARE) of the sphere
    /// clipped, as a camera with too small a range would; nothing where what is left is uniform or
    /// black.
    pub clipped_eta: Option<f64>,
}

/// A spectrum as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct StoredSpectrum {
    luminance: Vec<f64>,
    channels: [Vec<f64>; 3],
    law: PowerLaw,
    etas: [Option<f64>; 3],
    coherence: Option<f64>,
    clipped_eta: Option<f64>,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredSpectrum> for LightSpectrum {
    type Error = Error;

    fn try_from(stored: StoredSpectrum) -> Result<Self> {
        let count = stored.luminance.len();
        for power in stored.channels.iter().chain([&stored.luminance]) {
            crate::error::check_length("a channel's power spectrum", count, power.len())?;
            crate::error::check_finite("a power spectrum", power)?;
            if let Some(&value) = power.iter().find(|value| **value < 0.0) {
                return Err(Error::Domain {
                    what: "a power of a spectrum",
                    value,
                    allowed: "at least 0",
                });
            }
        }
        // What rounds to a correlation of 1 may pass it.
        if let Some(value) = stored.coherence
            && !(value.abs() <= 1.0 + 1e-9)
        {
            return Err(Error::Domain {
                what: "the coherence of a spectrum",
                value,
                allowed: "between −1 and 1",
            });
        }
        Ok(Self {
            luminance: stored.luminance,
            channels: stored.channels,
            law: stored.law,
            etas: stored.etas,
            coherence: stored.coherence,
            clipped_eta: stored.clipped_eta,
        })
    }
}

/// The power, as a share of that of degree 0, below which it is rounding: amplitudes of 10⁻¹³.
const ROUNDING: f64 = 1e-26;

impl LightSpectrum {
    /// The degrees of the fit, both included; the last is less where the spectrum ends before it.
    pub const FIT_RANGE: (usize, usize) = (2, 64);
    /// The share of the sphere that is clipped for [`Self::clipped_eta`].
    pub const CLIPPED_SHARE: f64 = 0.002;

    /// The spectrum of a map up to `degree`, or up to what the map carries where that is less.
    ///
    /// # Errors
    /// [`Error::Domain`] for a degree, or a map, too small to fit a law to; [`Error::Undetermined`]
    /// for a uniform map, which has no law.
    pub fn of(map: &EnvironmentMap, degree: usize, parallelism: Parallelism) -> Result<Self> {
        let degree = degree.min(map.max_degree()?);
        if degree < Self::FIT_RANGE.0 + 2 {
            return Err(Error::Domain {
                what: "the degree of a spectrum of light",
                value: degree as f64,
                allowed: "at least 4, for a law to be fitted; a map of n rows carries (n − 1)/2",
            });
        }
        let coefficients = map.coefficients(degree, parallelism)?;
        let luminance = average_power(&luminance(&coefficients)?);
        // The clipped luminance is that of the clipped map, and a third of it.
        let ceiling = map.ceiling(Self::CLIPPED_SHARE);
        let clipped = |pixel| [Luminance::Rec709.of(pixel).min(ceiling)];
        let parts = parts(map.width(), map.height(), degree);
        let [clipped] = analyse(map, degree, parts, clipped, parallelism)?;
        // A map that is black but for what is clipped is none any more.
        let clipped = (ceiling > 0.0).then(|| average_power(&clipped));
        let channels = [0, 1, 2].map(|c| average_power(&coefficients[c]));

        let (first, last) = (Self::FIT_RANGE.0, Self::FIT_RANGE.1.min(degree));
        let fit = |power: &[f64]| {
            // What is left of a constant is rounding.
            if power[first..=last]
                .iter()
                .all(|b| *b <= ROUNDING * power[0])
            {
                return Err(Error::Undetermined {
                    parameter: "the power law of the light",
                    reason: "the map is uniform, which leaves nothing to fit; give one with something in it",
                });
            }
            PowerLaw::fit(power, first, last)
        };
        let eta = |power: &[f64]| fit(power).map(|law| law.eta);
        let etas = [0, 1, 2].map(|channel| eta(&channels[channel]).ok());
        let cross = cross_power(&coefficients[0], &coefficients[2])?;
        let coherence = (first..=last)
            .map(|l| cross[l] / (channels[0][l] * channels[2][l]).sqrt())
            .sum::<f64>()
            / (last - first + 1) as f64;
        Ok(Self {
            law: fit(&luminance)?,
            luminance,
            channels,
            etas,
            coherence: coherence.is_finite().then_some(coherence),
            clipped_eta: clipped.and_then(|power| eta(&power).ok()),
        })
    }
}

/// So many pixels of a map, or fewer, are analysed at a time: 2048×1024.
const MOST_PIXELS_TOGETHER: usize = 1 << 21;

/// In how many parts the columns of a map are analysed: as many as leave each no more than
/// [`MOST_PIXELS_TOGETHER`] pixels, and columns enough for the degree.
fn parts(width: usize, height: usize, degree: usize) -> usize {
    let mut parts = 1;
    while width * height / parts > MOST_PIXELS_TOGETHER
        && width.is_multiple_of(2 * parts)
        && degree <= (width / (2 * parts) - 1) / 2
    {
        parts *= 2;
    }
    parts
}

/// The coefficients of N functions of a map's pixels.
///
/// Every `parts`-th column is analysed at a time, so that no copy of a large map is as large as it
/// is: the sum over all columns is the mean of the parts' sums.
fn analyse<const N: usize>(
    map: &EnvironmentMap,
    degree: usize,
    parts: usize,
    of: impl Fn([f64; 3]) -> [f64; N],
    parallelism: Parallelism,
) -> Result<[Coefficients; N]> {
    let all = Grid::lat_long(map.height(), map.width())?;
    let some = Grid::lat_long(map.height(), map.width() / parts)?;
    let mut sums = None;
    for part in 0..parts {
        let grid = some.clone().with_first_azimuth(all.azimuth(part));
        let transform = Transform::new(&grid, degree)?;
        let mut planes = Vec::with_capacity(N * grid.len());
        for plane in 0..N {
            let pixels = map.pixels().iter().skip(part).step_by(parts);
            planes.extend(pixels.map(|pixel| of(*pixel)[plane]));
        }
        let size = transform.coefficient_count();
        let mut values = vec![0.0; N * size];
        let mut scratch = vec![0.0; transform.scratch_len(N)];
        transform.analyse_into(N, &planes, &mut values, &mut scratch, parallelism)?;
        // Not before the transform has taken the degree.
        let sums: &mut [Coefficients; N] =
            sums.get_or_insert_with(|| [(); N].map(|()| Coefficients::zeros(degree)));
        for (sum, set) in sums.iter_mut().zip(values.chunks(size)) {
            for (sum, value) in sum.as_mut_slice().iter_mut().zip(set) {
                *sum += value / parts as f64;
            }
        }
    }
    Ok(sums.unwrap_or_else(|| [(); N].map(|()| Coefficients::zeros(0))))
}

/// The coefficients of the luminance, which are linear in the channels'.
fn luminance(channels: &[Coefficients; 3]) -> Result<Coefficients> {
    let mut sum = Coefficients::zeros(channels[0].degree());
    for (channel, weight) in channels.iter().zip(Luminance::Rec709.weights()) {
        for (sum, value) in sum.as_mut_slice().iter_mut().zip(channel.as_slice()) {
            *sum += weight * value;
        }
    }
    Ok(sum)
}

impl EnvironmentMap {
    /// The largest degree that the map carries exactly.
    ///
    /// # Errors
    /// None for a map that exists.
    pub fn max_degree(&self) -> Result<usize> {
        Ok(Grid::lat_long(self.height(), self.width())?.max_degree())
    }

    /// The real orthonormal coefficients of red, green and blue, in the harmonic frame.
    ///
    /// The pixels are taken as samples of a band-limited field, and the analysis is exact for one
    /// (Fejér's rule in latitude).
    ///
    /// # Errors
    /// [`Error::Degree`] past [`max_degree`](Self::max_degree).
    pub fn coefficients(
        &self,
        degree: usize,
        parallelism: Parallelism,
    ) -> Result<[Coefficients; 3]> {
        let parts = parts(self.width(), self.height(), degree);
        analyse(self, degree, parts, |pixel| pixel, parallelism)
    }

    /// The map with the brightest `share` of the sphere (by solid angle, by luminance) brought down
    /// to the luminance of the brightest pixel that is left, its hue kept.
    ///
    /// # Errors
    /// [`Error::Domain`] unless 0 ≤ share < 1.
    pub fn clipped(&self, share: f64) -> Result<Self> {
        if !(0.0..1.0).contains(&share) {
            return Err(Error::Domain {
                what: "the share of the sphere to clip",
                value: share,
                allowed: "at least 0 and below 1",
            });
        }
        let ceiling = self.ceiling(share);
        let pixels = self.pixels().iter();
        Self::new(
            self.name(),
            self.width(),
            self.height(),
            pixels
                .map(|pixel| {
                    let y = Luminance::Rec709.of(*pixel);
                    if y > ceiling {
                        pixel.map(|value| value * ceiling / y)
                    } else {
                        *pixel
                    }
                })
                .collect(),
        )
    }

    /// The largest luminance of which so much of the sphere shows that or more, that it is above
    /// `share`: the luminance of the brightest pixel that is left when the share is taken away.
    ///
    /// Found by the bits of the luminances, sixteen at a time from the highest, so that nothing is
    /// sorted and nothing as large as the map is held.
    fn ceiling(&self, share: f64) -> f64 {
        const DIGIT: u32 = 16;
        let mut left = share * 4.0 * std::f64::consts::PI;
        let mut known = 0u64;
        for place in (0..64 / DIGIT).rev() {
            let shift = DIGIT * place;
            let mut areas = vec![0.0; 1 << DIGIT];
            for (row, pixels) in self.pixels().chunks(self.width()).enumerate() {
                let area = self.solid_angle(row);
                for pixel in pixels {
                    // Zero has one form.
                    let bits = (Luminance::Rec709.of(*pixel) + 0.0).to_bits();
                    // Above the digit the bits are those that are known.
                    let same = place == 64 / DIGIT - 1 || bits >> (shift + DIGIT) == known;
                    if same {
                        areas[(bits >> shift) as usize & ((1 << DIGIT) - 1)] += area;
                    }
                }
            }
            let mut digit = None;
            for (at, area) in areas.iter().enumerate().rev() {
                if *area > 0.0 && left - area < 0.0 {
                    digit = Some(at as u64);
                    break;
                }
                left -= area;
            }
            match digit {
                Some(digit) => known = known << DIGIT | digit,
                // Less than a pixel is left of the sphere.
                None => return f64::INFINITY,
            }
        }
        f64::from_bits(known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against SciPy 1.17.1, `linregress(log(l), log(B))`, for B_l = (2 + sin l) / l^2.5, l = 2 … 40.
    #[test]
    fn the_law_is_the_regression_of_scipy() {
        let power: Vec<f64> = (0..=40)
            .map(|l| (2.0 + f64::from(l).sin()) / f64::from(l.max(1)).powf(2.5))
            .collect();
        let law = PowerLaw::fit(&power, 2, 40).unwrap();
        assert!((law.eta - SCIPY[0]).abs() < 1e-12, "{law:?}");
        assert!((law.k.ln() - SCIPY[1]).abs() < 1e-12, "{law:?}");
        assert!((law.eta_error - SCIPY[2]).abs() < 1e-12, "{law:?}");
        assert!((law.ln_k_error - SCIPY[3]).abs() < 1e-12, "{law:?}");
    }

    const SCIPY: [f64; 4] = [
        0.494_267_339_295_562_55,
        0.621_232_700_026_213_9,
        0.083_987_656_724_939_34,
        0.245_791_404_518_933_55,
    ];

    #[test]
    fn clipping_takes_the_sun_and_leaves_the_sky() {
        let mut pixels = vec![[1.0, 2.0, 3.0]; 64 * 32];
        pixels[16 * 64 + 5] = [1e5, 1e5, 2e5];
        let map = EnvironmentMap::new("sun", 64, 32, pixels).unwrap();
        let clipped = map.clipped(0.002).unwrap();
        let sun = clipped.pixel(16, 5);
        assert!((Luminance::Rec709.of(sun) - Luminance::Rec709.of([1.0, 2.0, 3.0])).abs() < 1e-12);
        assert!((sun[2] / sun[0] - 2.0).abs() < 1e-12, "the hue is kept");
        assert_eq!(clipped.pixel(3, 3), [1.0, 2.0, 3.0]);
        assert_eq!(map.clipped(0.0).unwrap().pixels(), map.pixels());
        assert!(map.clipped(1.0).is_err());
    }

    #[test]
    fn a_channel_that_does_not_vary_has_no_exponent() {
        let pixels = (0..64 * 32).map(|i| [1.0 + f64::from(i * 37 % 101), f64::from(i % 7), 0.0]);
        let map = EnvironmentMap::new("no blue", 64, 32, pixels.collect()).unwrap();
        let spectrum = LightSpectrum::of(&map, 15, Parallelism::Sequential).unwrap();
        assert!(spectrum.etas[0].is_some() && spectrum.etas[2].is_none());
        assert_eq!(spectrum.coherence, None);
    }

    /// The parts' sums are those of the whole, whatever the parts; and many parts have columns
    /// enough.
    #[test]
    fn columns_are_analysed_in_parts() {
        let pixels = (0..64 * 32).map(|i| {
            let v = f64::from(i * 7919 % 1013);
            [v, v.sqrt(), f64::from(i % 13)]
        });
        let map = EnvironmentMap::new("parts", 64, 32, pixels.collect()).unwrap();
        let of = |parts| analyse(&map, 7, parts, |pixel| pixel, Parallelism::Sequential).unwrap();
        let whole = of(1);
        let scale = whole[0].energy().sqrt();
        for parts in [2, 4] {
            for (set, part) in whole.iter().zip(&of(parts)) {
                for (a, b) in set.as_slice().iter().zip(part.as_slice()) {
                    assert!((a - b).abs() < 1e-14 * scale, "{parts}: {a} {b}");
                }
            }
        }
        assert_eq!(parts(64, 32, 7), 1);
        let of_large = [128, 511, 512, 1023, 1024, 2047].map(|degree| parts(4096, 2048, degree));
        assert_eq!(of_large, [4, 4, 2, 2, 1, 1]);
    }

    #[test]
    fn a_map_in_one_colour_is_coherent() {
        let pixels = (0..64 * 32).map(|i| {
            let v = 1.0 + f64::from(i * 37 % 101);
            [v, 2.0 * v, 3.0 * v]
        });
        let map = EnvironmentMap::new("one colour", 64, 32, pixels.collect()).unwrap();
        let spectrum = LightSpectrum::of(&map, 128, Parallelism::Sequential).unwrap();
        assert_eq!(spectrum.luminance.len(), map.max_degree().unwrap() + 1);
        assert!((spectrum.coherence.unwrap() - 1.0).abs() < 1e-12);
        let ratio = spectrum.channels[2][5] / spectrum.channels[0][5];
        assert!((ratio - 9.0).abs() < 1e-11);
    }

    /// Against sorting all pixels, for shares from none to nearly all, with pixels that are alike
    /// and black ones.
    #[test]
    fn the_ceiling_is_that_of_sorted_pixels() {
        let (width, height) = (32, 16);
        let level = |i: usize| ((i * 7919) % 13) as f64 * [0.0, 1.0, 300.0, 1e-9][i % 4];
        let pixels: Vec<[f64; 3]> = (0..width * height)
            .map(|i| [level(i), 2.0 * level(i + 1), 0.5 * level(i + 2)])
            .collect();
        let map = EnvironmentMap::new("levels", width, height, pixels).unwrap();
        let luminance = map.luminance(Luminance::Rec709);
        let mut order: Vec<usize> = (0..luminance.len()).collect();
        order.sort_by(|&a, &b| luminance[b].total_cmp(&luminance[a]));
        for share in [0.0, 0.002, 0.05, 0.3, 0.9, 0.999] {
            let mut left = share * 4.0 * std::f64::consts::PI;
            let first = order.iter().find(|&&pixel| {
                left -= map.solid_angle(pixel / width);
                left < 0.0
            });
            assert_eq!(map.ceiling(share), luminance[*first.unwrap()], "{share}");
        }
    }
}
