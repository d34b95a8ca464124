//! The rival's features: statistics of pixels and of wavelet bands.

use super::rings::Unwrapped;
use crate::error::check_count;
use crate::illumination::Luminance;
use crate::{Error, Result};

/// The nine-tap quadrature mirror filter of Simoncelli and Adelson (1990, *Subband transforms*, in
/// *Subband Image Coding*), which Dror's pyramid uses: the low-pass half, symmetric about its first
/// value.
const LOW: [f64; 5] = [
    0.797_393_4,
    0.414_725_45,
    -0.073_386_624,
    -0.060_944_743,
    0.028_073_82,
];

/// How many times the picture is halved.
const SCALES: usize = 4;

/// The features by which Dror, Adelson and Willsky tell materials apart.
///
/// After *Recognition of surface reflectance properties from a single image under unknown
/// real-world illumination* (MIT AI memo 2001-033): the picture, unwrapped onto rings about the
/// line of sight and divided by its mean luminance, and its bands in a separable quadrature-mirror
/// pyramid, round along the rings and mirrored across them. The features are
///
/// - of the luminance: ln of the variance, skewness, ln of the kurtosis, ln of the 10th, 50th and 90th percentile;
/// - of each of four scales and three orientations (along the rings, across them, both): ln of the variance and ln of the kurtosis;
/// - ln R/G and ln B/G of the mean, since the paper's rival features have colour too, and, where the exposure is known, ln of
///   the mean luminance.
///
/// Which percentiles, moments and bands are in the final set is not printed in one place; these are
/// all that the memo names.
///
/// ```
/// use lobes::features::{DrorFeatures, RingLayout, Unwrapped};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 32, 16)?;
/// let features = DrorFeatures::of(&Unwrapped::new(&image, &layout)?)?;
/// // Twice the exposure shows in the brightness alone.
/// let brighter = image.map(|pixel| pixel.map(|value| 2.0 * value));
/// let brighter = DrorFeatures::of(&Unwrapped::new(&brighter, &layout)?)?;
/// assert!((brighter.brightness - features.brightness - 2f64.ln()).abs() < 1e-12);
/// for (one, other) in features.statistics.iter().zip(&brighter.statistics) {
///     assert!((one - other).abs() < 1e-9);
/// }
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DrorFeatures {
    /// The statistics, free of exposure.
    pub statistics: Vec<f64>,
    /// ln of the mean luminance.
    pub brightness: f64,
}

impl DrorFeatures {
    /// The features of an unwrapped picture.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture, [`Error::TooFew`] for a picture that is black or
    /// smaller than 16 × 16 once unwrapped.
    pub fn of(picture: &Unwrapped) -> Result<Self> {
        let mean = picture.mean();
        let luminance = Luminance::Rec709.of(mean);
        if luminance.is_nan() || luminance <= 0.0 {
            return Err(Error::Black {
                what: "the picture of the sphere",
            });
        }
        let (mut rows, mut columns) = (picture.rings(), picture.columns());
        for (items, got) in [("rings", rows), ("columns", columns)] {
            check_count("a pyramid of wavelets", items, 1 << SCALES, got)?;
        }
        let mut field: Vec<f64> = picture
            .values()
            .iter()
            .map(|rgb| Luminance::Rec709.of(*rgb) / luminance)
            .collect();
        let mut statistics = moments(&field).to_vec();
        let mut sorted = field.clone();
        sorted.sort_by(f64::total_cmp);
        for level in [0.1, 0.5, 0.9] {
            let at = (level * (sorted.len() - 1) as f64).round() as usize;
            statistics.push(sorted[at].max(1e-3).ln());
        }
        for _ in 0..SCALES {
            let (low, high) = halve_along(&field, rows, columns);
            columns /= 2;
            let (both_low, across) = halve_across(&low, rows, columns);
            let (along, diagonal) = halve_across(&high, rows, columns);
            rows /= 2;
            for band in [&along, &across, &diagonal] {
                let [variance, _, kurtosis] = moments(band);
                statistics.extend([variance, kurtosis]);
            }
            // Low-pass twice has a gain of 2.
            field = both_low.into_iter().map(|value| 0.5 * value).collect();
        }
        let floor = 1e-6 * luminance;
        let [r, g, b] = mean.map(|value| value.max(floor).ln());
        statistics.extend([r - g, b - g]);
        Ok(Self {
            statistics,
            brightness: luminance.ln(),
        })
    }
}

/// ln of the variance, skewness, ln of the kurtosis.
fn moments(values: &[f64]) -> [f64; 3] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let moment = |n: i32| values.iter().map(|v| (v - mean).powi(n)).sum::<f64>() / count;
    let variance = moment(2) + 1e-8;
    [
        variance.ln(),
        moment(3) / variance.powf(1.5),
        (moment(4) / (variance * variance)).max(0.1).ln(),
    ]
}

/// Every second value of the low-pass filtered and of the high-pass filtered line; `at` gives the
/// line beyond its ends.
fn halve(length: usize, at: impl Fn(isize) -> f64) -> (Vec<f64>, Vec<f64>) {
    let filtered = |centre: isize, alternate: bool| {
        let mut sum = LOW[0] * at(centre);
        for (distance, &tap) in LOW.iter().enumerate().skip(1) {
            let sign = if alternate && distance % 2 == 1 {
                -1.0
            } else {
                1.0
            };
            let distance = distance as isize;
            sum += sign * tap * (at(centre - distance) + at(centre + distance));
        }
        sum
    };
    (0..length / 2)
        .map(|i| {
            let even = 2 * i as isize;
            (filtered(even, false), filtered(even + 1, true))
        })
        .unzip()
}

/// Along the rings, which are round.
fn halve_along(field: &[f64], rows: usize, columns: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for row in field.chunks_exact(columns).take(rows) {
        let (l, h) = halve(columns, |i| row[i.rem_euclid(columns as isize) as usize]);
        low.extend(l);
        high.extend(h);
    }
    (low, high)
}

/// Across the rings, mirrored at both ends.
fn halve_across(field: &[f64], rows: usize, columns: usize) -> (Vec<f64>, Vec<f64>) {
    let half = rows / 2;
    let (mut low, mut high) = (vec![0.0; half * columns], vec![0.0; half * columns]);
    for column in 0..columns {
        let (l, h) = halve(rows, |i| {
            let period = 2 * rows as isize - 2;
            let folded = i.rem_euclid(period);
            let row = folded.min(period - folded) as usize;
            field[row * columns + column]
        });
        for i in 0..half {
            low[i * columns + column] = l[i];
            high[i * columns + column] = h[i];
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The low band carries a constant with a gain of √2 a direction, the high band does not see
    /// it.
    #[test]
    fn filters_split_the_line() {
        let (low, high) = halve(32, |_| 1.0);
        for (l, h) in low.iter().zip(&high) {
            assert!((l - 2f64.sqrt()).abs() < 1e-3, "{l}");
            assert!(h.abs() < 1e-3, "{h}");
        }
        let (low, high) = halve(32, |i| if i % 2 == 0 { 1.0 } else { -1.0 });
        for (l, h) in low.iter().zip(&high) {
            assert!(
                l.abs() < 1e-3 && (h.abs() - 2f64.sqrt()).abs() < 1e-3,
                "{l} {h}"
            );
        }
    }

    /// Quadrature mirror filters keep the energy to the filter's 10⁻³.
    #[test]
    fn bands_keep_the_energy() {
        let line: Vec<f64> = (0..64).map(|i| f64::from(i * 29 % 37) - 18.0).collect();
        let (low, high) = halve(64, |i| line[i.rem_euclid(64) as usize]);
        let energy = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        let ratio = (energy(&low) + energy(&high)) / energy(&line);
        assert!((ratio - 1.0).abs() < 5e-3, "{ratio}");
    }
}
