//! How strong log radiance is in bands of azimuthal order and radial frequency.

use nalgebra::DMatrix;

use super::percentiles::percentiles;
use super::rings::{Modes, RingLayout, Unwrapped};
use crate::illumination::Luminance;
use crate::{Error, Result};

/// The logarithm of radiance is taken of no less than this share of the picture's mean.
const FLOOR: f64 = 1e-3;

/// What is added to a band's mean square before its logarithm is taken: an amplitude of 10⁻³, which
/// is what interpolation between the pixels of a 128² picture leaves in the highest bands.
const FAINTEST: f64 = 1e-6;

/// The first order or radial frequency of each band, and the end of the last.
pub(super) const EDGES: [usize; 11] = [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 33];

/// The largest order, and the number of radial functions.
pub(super) const ORDERS: usize = 32;

/// The percentiles of log radiance, over its standard deviation, that are features.
const PERCENTILES: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

/// The plan of the features of log radiance of one view.
///
/// Light is far nearer to Gaussian in its logarithm (Dror, Willsky and Adelson 2004,
/// doi:10.1167/4.9.11), and the exposure is a constant there. The sphere is unwrapped onto rings;
/// along a ring log radiance splits into orders m, across rings into cosines k. A surface damps
/// high m and k, a plastic's white highlight over a coloured body leaves a trace in the
/// chromaticity where a metal's does not. The features are
///
/// - ln (E + 10⁻⁶), E the mean square per value in each band of (m, k), of three fields: ln luminance, ln R/G, ln B/G;
/// - of ln luminance: ln of its variance, its skewness, ln of its kurtosis, and seven percentiles over its standard deviation;
/// - the mean of ln R/G and of ln B/G;
/// - how their mean over the brightest 1, 5 and 20 % and the darkest 5 and 20 % differs from that over all, and ln of their variance, where
///   nothing is saturated: a plastic's highlight is white, its body is not; and the share that is saturated, as it is and as a logarithm;
/// - of the steps of ln luminance over 1, 2, 4, 8 and 16 rings and as many columns: ln of the kurtosis and of ⟨|d|⟩²/⟨d²⟩, and the correlations
///   with the steps of ln R/G and ln B/G;
/// - eight percentiles of ln luminance over the mean luminance.
///
/// Saturated is what comes within 2.6 % of the picture's largest value, which is where codes of 8
/// bits end.
///
/// Exposure changes none of them; a turn of the camera about its axis only as far as pixels are
/// square.
///
/// ```
/// use lobes::features::{LogBands, RingLayout, Unwrapped};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 64, 32)?;
/// let features = LogBands::new(&layout)?.of(&Unwrapped::new(&image, &layout)?)?;
/// assert_eq!(features.len(), LogBands::FEATURES);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LogBands {
    layout: RingLayout,
    basis: DMatrix<f64>,
}

/// Bands of one field.
const BANDS: usize = (EDGES.len() - 1) * (EDGES.len() - 1) - 1;

/// The steps over which differences are taken.
const LAGS: [usize; 5] = [1, 2, 4, 8, 16];

/// The shares of the brightest and of the darkest values whose colour is taken.
const BRIGHTEST: [f64; 3] = [0.01, 0.05, 0.2];
const DARKEST: [f64; 2] = [0.05, 0.2];

/// What is taken of the colours of the bright and the dark.
const TINTS: usize = 2 * (BRIGHTEST.len() + DARKEST.len() + 1);

/// The percentiles of log luminance over the mean luminance that are features.
const LEVELS: [f64; 8] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.998];

/// What comes so near to the largest value is saturated: 252/255 in sRGB.
const SATURATED: f64 = 0.974;

/// How many features there are before those of colours and steps.
const FIRST: usize = 3 * BANDS + 3 + PERCENTILES.len() + 2;

impl LogBands {
    /// How many features there are.
    pub const FEATURES: usize = FIRST + TINTS + 2 + 8 * LAGS.len() + LEVELS.len();

    /// Whether a feature is of the chromaticity: no use in a picture without colour.
    pub(crate) fn needs_colour(feature: usize) -> bool {
        let steps = FIRST + TINTS + 2 + 4 * LAGS.len();
        (BANDS..3 * BANDS).contains(&feature)
            || (FIRST - 2..FIRST + TINTS).contains(&feature)
            || (steps..steps + 4 * LAGS.len()).contains(&feature)
    }

    /// The plan for pictures that are unwrapped by a layout of the same viewpoint.
    ///
    /// # Errors
    /// [`Error::TooFew`] for a layout of fewer rings or orders than the radial functions need.
    pub fn new(layout: &RingLayout) -> Result<Self> {
        layout.check("the bands of log radiance", ORDERS + 1, ORDERS)?;
        let rings = layout.angles().len();
        Ok(Self {
            layout: layout.clone(),
            basis: cosine_basis(rings, ORDERS + 1),
        })
    }

    /// The features.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture; [`Error::Length`] for one that was unwrapped for
    /// another layout.
    pub fn of(&self, picture: &Unwrapped) -> Result<Vec<f64>> {
        let fields = log_fields(picture)?;
        let amplitudes = Modes::of(picture, &self.layout, fields.of())?;
        let mut features = Vec::new();
        for modes in &amplitudes {
            let energy: Vec<Vec<f64>> = (0..=ORDERS)
                .map(|m| {
                    let both: Vec<f64> = [modes.cosine(m), modes.sine(m)].concat();
                    energies_of_order(&self.basis, m, &both)
                })
                .collect();
            for orders in EDGES.windows(2) {
                for radial in EDGES.windows(2) {
                    if orders[0] == 0 && radial[0] == 0 {
                        continue; // the mean
                    }
                    let sum: f64 = energy[orders[0]..orders[1]]
                        .iter()
                        .flat_map(|row| &row[radial[0]..radial[1]])
                        .sum();
                    features.push((sum + FAINTEST).ln());
                }
            }
        }
        let mut logs: Vec<f64> = picture.values().iter().map(|v| fields.at(*v)[0]).collect();
        features.extend(moments(&logs));
        let count = logs.len() as f64;
        let mean = logs.iter().sum::<f64>() / count;
        let variance = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
        let deviation = (variance + 1e-4).sqrt();
        features.extend(percentiles(&mut logs, PERCENTILES).map(|at| (at - mean) / deviation));
        for modes in &amplitudes[1..] {
            features.push(modes.cosine(0).iter().sum::<f64>() / picture.rings() as f64);
        }
        let values: Vec<[f64; 3]> = picture.values().iter().map(|v| fields.at(*v)).collect();
        features.extend(tints(picture, &values));
        features.extend(steps(&values, picture.columns()));
        let mean = Luminance::Rec709.of(picture.mean()).ln();
        features.extend(percentiles(&mut logs, LEVELS).map(|at| at - mean));
        Ok(features)
    }
}

/// The mean squares over a picture of the cosines k of an order: its `amplitudes` over the rings
/// are the cosine ones and, past order 0, the sine ones.
pub(super) fn energies_of_order(basis: &DMatrix<f64>, m: usize, amplitudes: &[f64]) -> Vec<f64> {
    let rings = basis.nrows();
    let share = if m == 0 { 1.0 } else { 0.5 } / rings as f64;
    let mut energies = vec![0.0; basis.ncols()];
    for amplitudes in amplitudes.chunks_exact(rings) {
        for (k, energy) in energies.iter_mut().enumerate() {
            let column = basis.column(k);
            let dot: f64 = column.iter().zip(amplitudes).map(|(b, a)| b * a).sum();
            *energy += share * dot * dot;
        }
    }
    energies
}

/// The colours of the bright and of the dark beside that of all, and how much is saturated.
fn tints(picture: &Unwrapped, fields: &[[f64; 3]]) -> Vec<f64> {
    let brightest = |rgb: &[f64; 3]| rgb.iter().copied().fold(0.0, f64::max);
    let largest = picture.values().iter().map(brightest).fold(0.0, f64::max);
    let mut order: Vec<[f64; 3]> = picture
        .values()
        .iter()
        .zip(fields)
        .filter(|(rgb, _)| brightest(rgb) < SATURATED * largest)
        .map(|(_, at)| *at)
        .collect();
    let saturated = 1.0 - order.len() as f64 / fields.len() as f64;
    if order.len() < 50 {
        order = fields.to_vec();
    }
    let count = order.len();
    let part = |share: f64| ((share * count as f64) as usize).max(1);
    // What is darkest, then brighter and brighter parts: sorted no further than that.
    let darkest = DARKEST.into_iter().map(part);
    let brightest = BRIGHTEST.into_iter().rev().map(|share| count - part(share));
    let mut done = 0;
    for cut in darkest.chain(brightest) {
        let cut = cut.clamp(done, count - 1);
        order[done..].select_nth_unstable_by(cut - done, |a, b| a[0].total_cmp(&b[0]));
        done = cut;
    }
    let mut features = Vec::with_capacity(TINTS + 2);
    for field in [1, 2] {
        let mean = |of: &[[f64; 3]]| of.iter().map(|at| at[field]).sum::<f64>() / of.len() as f64;
        let all = mean(&order);
        for share in BRIGHTEST {
            features.push(mean(&order[count - part(share)..]) - all);
        }
        for share in DARKEST {
            features.push(mean(&order[..part(share)]) - all);
        }
        let variance = order
            .iter()
            .map(|at| (at[field] - all).powi(2))
            .sum::<f64>()
            / count as f64;
        features.push((variance + 1e-5).ln());
    }
    features.extend([saturated, (saturated + 1e-3).ln()]);
    features
}

/// The shape of the distribution of steps of log luminance, and how they go with those of the
/// chromaticities.
fn steps(fields: &[[f64; 3]], columns: usize) -> Vec<f64> {
    let rings = fields.len() / columns;
    let (mut shapes, mut correlations) = (Vec::new(), Vec::new());
    for across in [true, false] {
        for lag in LAGS {
            // ⟨d²⟩, ⟨d⁴⟩, ⟨|d|⟩ of luminance; ⟨d e⟩ and ⟨e²⟩ with each chromaticity.
            let (mut second, mut fourth, mut first) = (0.0, 0.0, 0.0);
            let (mut cross, mut squares) = ([0.0; 2], [0.0; 2]);
            let last = if across { rings - lag } else { rings };
            for ring in 0..last {
                let row = &fields[ring * columns..][..columns];
                let other = if across { ring + lag } else { ring };
                let other = &fields[other * columns..][..columns];
                let turn = if across { 0 } else { lag };
                for (column, from) in row.iter().enumerate() {
                    let to = &other[(column + turn) % columns];
                    let step = to[0] - from[0];
                    let square = step * step;
                    second += square;
                    fourth += square * square;
                    first += step.abs();
                    for c in 0..2 {
                        let chroma = to[c + 1] - from[c + 1];
                        cross[c] += step * chroma;
                        squares[c] += chroma * chroma;
                    }
                }
            }
            let count = (last * columns) as f64;
            let variance = second / count + FAINTEST;
            shapes.push((fourth / count / (variance * variance) + 1e-2).ln());
            shapes.push(((first / count).powi(2) / variance + 1e-3).ln());
            for c in 0..2 {
                let scale = (variance * (squares[c] / count + 1e-5)).sqrt();
                correlations.push(cross[c] / count / scale);
            }
        }
    }
    shapes.extend(correlations);
    shapes
}

/// ln of the variance, the skewness, ln of the kurtosis, each tame where nothing varies.
pub(super) fn moments(values: &[f64]) -> [f64; 3] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let (mut second, mut third, mut fourth) = (0.0, 0.0, 0.0);
    for value in values {
        let square = (value - mean).powi(2);
        second += square;
        third += square * (value - mean);
        fourth += square * square;
    }
    let (second, third, fourth) = (second / count, third / count, fourth / count);
    let tame = second + 1e-4;
    [
        (second + FAINTEST).ln(),
        third / tame.powf(1.5),
        (fourth / (tame * tame) + 0.1).ln(),
    ]
}

/// How log radiance is taken of one picture.
///
/// ```
/// use lobes::features::{RingLayout, Unwrapped, log_fields};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 32, 16)?;
/// let fields = log_fields(&Unwrapped::new(&image, &layout)?)?;
/// let [luminance, red, blue] = fields.at([1.0; 3]);
/// assert!(luminance.abs() < 1e-15 && red == 0.0 && blue == 0.0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct LogFields {
    luminance: f64,
    channels: [f64; 3],
}

impl LogFields {
    /// ln luminance, ln R/G and ln B/G, none taken of less than a thousandth of the picture's mean.
    pub fn at(&self, rgb: [f64; 3]) -> [f64; 3] {
        let [r, g, b]: [f64; 3] = std::array::from_fn(|c| rgb[c].max(self.channels[c]).ln());
        let luminance = Luminance::Rec709.of(rgb).max(self.luminance).ln();
        [luminance, r - g, b - g]
    }

    /// [`Self::at`] as a function.
    pub fn of(self) -> impl Fn([f64; 3]) -> [f64; 3] {
        move |rgb| self.at(rgb)
    }
}

/// How log radiance is taken of a picture.
///
/// # Errors
/// [`Error::Black`] for a picture that is black.
pub fn log_fields(picture: &Unwrapped) -> Result<LogFields> {
    let mean = picture.mean();
    let luminance = FLOOR * Luminance::Rec709.of(mean);
    if luminance.is_nan() || luminance <= 0.0 {
        return Err(Error::Black {
            what: "the picture of the sphere",
        });
    }
    Ok(LogFields {
        luminance,
        // A channel without any light still has a logarithm.
        channels: mean.map(|mean| FLOOR * mean.max(luminance)),
    })
}

/// The first cosines over the rings, orthonormal; column 0 is the constant.
pub(crate) fn cosine_basis(rings: usize, functions: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rings, functions, |r, k| {
        let norm = if k == 0 { 1.0 } else { 2.0 } / rings as f64;
        let angle = std::f64::consts::PI * k as f64 * (r as f64 + 0.5) / rings as f64;
        norm.sqrt() * angle.cos()
    })
}
