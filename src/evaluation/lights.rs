//! Errors of the light itself.

use std::f64::consts::PI;

use glam::DVec3;

use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflectance::lambert;
use crate::{Parallelism, Result};

/// The largest degree of the irradiance that is compared: what is beyond holds less than 10⁻³ of a
/// lamp's.
const DEGREE: usize = 48;

/// The sun is what is within a cap of this angle, and its direction is gathered within twice that.
const SUN: f64 = 5.0;

/// Rows of the map on which the sun is looked for.
const ROWS: usize = 64;

/// What each error of the light is called, and what it is.
pub const LIGHT_MEASURES: [(&str, &str); 4] = [
    (
        "peak-direction",
        "angle in degrees between the brightest directions of the two maps: the mean direction of the pixels within 1 % of the largest \
         luminance",
    ),
    (
        "sun-direction",
        "angle in degrees between the mean directions of the light within 10° of the cap of 5° that holds most light",
    ),
    (
        "irradiance",
        "root mean square of the difference of the irradiances at all normals of the sphere and the three channels, over that of the \
         truth's",
    ),
    (
        "exposure",
        "mean luminance of the estimate over that of the truth, in stops (log2)",
    ),
];

/// How far an estimated map is from the true one, whatever stands in it.
///
/// ```
/// use lobes::evaluation::LightErrors;
/// use lobes::{Parallelism, illumination::EnvironmentMap};
/// let lamp = |column: usize| {
///     let mut pixels = vec![[0.1; 3]; 128 * 64];
///     pixels[32 * 128 + column] = [500.0; 3];
///     EnvironmentMap::new("lamp", 128, 64, pixels)
/// };
/// // Four columns of 128 are 11.25° at the horizon.
/// let errors = LightErrors::between(&lamp(60)?, &lamp(64)?, Parallelism::Sequential)?;
/// assert!((errors.peak_direction - 11.25).abs() < 0.01 && errors.exposure.abs() < 1e-12);
/// assert!((errors.sun_direction - 11.25).abs() < 0.6);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightErrors {
    /// Between the brightest directions, in degrees.
    pub peak_direction: f64,
    /// Between the suns' directions, in degrees.
    pub sun_direction: f64,
    /// Of the irradiance at all normals, relative.
    pub irradiance: f64,
    /// log₂ of the ratio of the mean luminances.
    pub exposure: f64,
}

impl LightErrors {
    /// The errors of an estimate, which may be of another size than the truth.
    ///
    /// # Errors
    /// What [`EnvironmentMap::coefficients`] and [`EnvironmentMap::resampled`] say.
    pub fn between(
        truth: &EnvironmentMap,
        estimate: &EnvironmentMap,
        parallelism: Parallelism,
    ) -> Result<Self> {
        let degree = DEGREE.min(truth.max_degree()?).min(estimate.max_degree()?);
        let transfers = lambert::transfers(degree)?;
        let (of_truth, of_estimate) = (
            truth.coefficients(degree, parallelism)?,
            estimate.coefficients(degree, parallelism)?,
        );
        let (mut apart, mut whole) = (0.0, 0.0);
        for (truth, estimate) in of_truth.iter().zip(&of_estimate) {
            for m in 0..=degree {
                let columns = [
                    (truth.cosine(m), estimate.cosine(m)),
                    (truth.sine(m), estimate.sine(m)),
                ];
                for (truth, estimate) in columns {
                    for ((t, e), a) in truth.iter().zip(estimate).zip(&transfers[m..]) {
                        apart += (a * (e - t)).powi(2);
                        whole += (a * t).powi(2);
                    }
                }
            }
        }
        let between = |a: DVec3, b: DVec3| a.cross(b).length().atan2(a.dot(b)).to_degrees();
        let luminance = |map: &EnvironmentMap| Luminance::Rec709.of(map.mean());
        Ok(Self {
            peak_direction: between(peak(truth), peak(estimate)),
            sun_direction: between(sun(truth)?, sun(estimate)?),
            irradiance: (apart / whole).sqrt(),
            exposure: (luminance(estimate) / luminance(truth)).log2(),
        })
    }

    /// The errors in the order of [`LIGHT_MEASURES`].
    pub fn values(&self) -> [f64; 4] {
        [
            self.peak_direction,
            self.sun_direction,
            self.irradiance,
            self.exposure,
        ]
    }
}

/// The mean direction of the pixels within a hundredth of the brightest luminance.
fn peak(map: &EnvironmentMap) -> DVec3 {
    let luminance = map.luminance(Luminance::Rec709);
    let largest = luminance.iter().copied().fold(0.0, f64::max);
    let mut sum = DVec3::ZERO;
    for (index, value) in luminance.iter().enumerate() {
        if *value >= 0.99 * largest {
            let (row, column) = (index / map.width(), index % map.width());
            sum += map.solid_angle(row) * map.direction(row, column);
        }
    }
    sum.normalize_or(DVec3::Y)
}

/// The mean direction of the light about the cap that holds most of it.
fn sun(map: &EnvironmentMap) -> Result<DVec3> {
    let small;
    let coarse = if map.height() > ROWS {
        small = map.resampled(2 * ROWS, ROWS)?;
        &small
    } else {
        map
    };
    let luminance = coarse.luminance(Luminance::Rec709);
    let (rows, columns) = (coarse.height(), coarse.width());
    let step = PI / rows as f64;
    let reach = (SUN.to_radians() / step).ceil() as usize;
    let flux =
        |row: usize, column: usize| coarse.solid_angle(row) * luminance[row * columns + column];
    let mut best = (0.0, DVec3::Y);
    for row in 0..rows {
        let near = row.saturating_sub(reach)..(row + reach + 1).min(rows);
        // How far along its row a pixel of the cap can be: all round near a pole.
        let narrowest = near.clone().map(|row| (step * (row as f64 + 0.5)).sin());
        let narrowest = narrowest.fold(f64::INFINITY, f64::min);
        let along = ((reach as f64 / narrowest).ceil() as usize + 1).min(columns / 2);
        for column in 0..columns {
            let middle = coarse.direction(row, column);
            let mut sum = 0.0;
            for row in near.clone() {
                for offset in 0..(2 * along + 1).min(columns) {
                    let column = (column + columns + offset - along) % columns;
                    if coarse.direction(row, column).dot(middle) >= SUN.to_radians().cos() {
                        sum += flux(row, column);
                    }
                }
            }
            if sum > best.0 {
                best = (sum, middle);
            }
        }
    }
    let luminance = map.luminance(Luminance::Rec709);
    let mut sum = DVec3::ZERO;
    for (index, value) in luminance.iter().enumerate() {
        let (row, column) = (index / map.width(), index % map.width());
        let direction = map.direction(row, column);
        if direction.dot(best.1) >= (2.0 * SUN).to_radians().cos() {
            sum += value * map.solid_angle(row) * direction;
        }
    }
    Ok(sum.normalize_or(best.1))
}
