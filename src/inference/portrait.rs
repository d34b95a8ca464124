//! A ball with what is around it, as the reading of its finish takes it.

use super::network::Network;
use super::reading::LogReader;
use crate::illumination::Luminance;
use crate::numeric::bilinear;
use crate::picture::{Circle, Picture, Sphere};
use crate::reflection::Viewpoint;
use crate::{Error, Result};

/// A ball and what is around it, in a few kilobytes: what a [`FinishModel`](super::FinishModel)
/// judges.
///
/// Its picture is [`Network::SIDE`] pixels a side, the ball's radius is 1/[`Self::REACH`] of half
/// of that, and each value is (v/m)^(1/2.2), v linear radiance and m the ball's mean luminance, so
/// that the exposure is divided out and dark places keep their steps. A value of 3 or more is stored
/// as 3. Beside it stand the statistics of the ball that [`LogReader`] reads.
///
/// ```
/// use lobes::inference::{Network, Portrait, PortraitReader};
/// # use lobes::picture::{Circle, Picture};
/// # // A disc that is brighter towards the upper right, as a matte ball is under one light.
/// # let shade = |x: f64, y: f64| if x.hypot(y) < 60.0 { 0.2 + 0.4 * (0.5 + (x - y) / 170.0) } else { 0.0 };
/// # let pixels = (0..160 * 160).map(|i| [shade((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5); 3]);
/// # let picture = Picture::linear(160, 160, pixels.collect())?;
/// # let circle = Circle { x: 80.0, y: 80.0, radius: 60.0 };
/// let portrait = PortraitReader::new()?.read(&picture, circle)?;
/// assert_eq!(portrait.inputs(false).len(), Network::INPUTS);
/// assert_eq!(portrait.statistics().len(), Portrait::STATISTICS);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Portrait {
    /// Red, green and blue of each pixel, 85 a unit.
    codes: Vec<u8>,
    statistics: Vec<f32>,
    saturated: f64,
}

/// The plan of what is read for a [`Portrait`]; make one and share it.
///
/// ```
/// use lobes::inference::PortraitReader;
/// use lobes::picture::{Circle, Picture};
/// // A disc that is brighter towards the upper right, as a matte ball is under one light.
/// let shade = |x: f64, y: f64| if x.hypot(y) < 60.0 { 0.2 + 0.4 * (0.5 + (x - y) / 170.0) } else { 0.0 };
/// let pixels = (0..160 * 160).map(|i| [shade((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5); 3]);
/// let picture = Picture::linear(160, 160, pixels.collect())?;
/// let circle = Circle { x: 80.0, y: 80.0, radius: 60.0 };
/// let reader = PortraitReader::new()?;
/// let portrait = reader.read(&picture, circle)?;
/// assert_eq!(portrait.saturated(), 0.0);
/// // A circle that leaves the picture is refused.
/// assert!(reader.read(&picture, Circle { x: 150.0, ..circle }).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct PortraitReader {
    log: LogReader,
}

/// The value that the largest code stands for.
const LARGEST: f64 = 3.0;

/// Radiance has no upper end, codes have: what a camera that exposes the ball's mean at 0.22 of
/// saturation would cut off is cut off.
const SATURATED: f64 = 1.0 / 0.22;

/// What is farther out than this share of the radius does not count for the mean: it may be
/// background.
const INSIDE: f64 = 0.96;

impl PortraitReader {
    /// The plan.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn new() -> Result<Self> {
        Ok(Self {
            // How far the camera stood is seldom known, and changes little: it is left out of
            // account in learning too.
            log: LogReader::new(Viewpoint::Orthographic)?,
        })
    }

    /// Reads the ball within a circle.
    ///
    /// # Errors
    /// Those of [`Picture::sphere`]: a circle that leaves the picture, one that is too small, and a
    /// ball that is black or saturated.
    pub fn read(&self, picture: &Picture, circle: Circle) -> Result<Portrait> {
        let sphere = picture.sphere(circle)?;
        self.of_sphere(picture, circle, &sphere)
    }

    /// [`read`](Self::read), where the sphere has been cut out already.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub fn of_sphere(
        &self,
        picture: &Picture,
        circle: Circle,
        sphere: &Sphere,
    ) -> Result<Portrait> {
        let statistics = self.log.features(&sphere.image)?;
        Ok(Portrait {
            codes: codes(picture, circle)?,
            statistics: statistics.iter().map(|value| *value as f32).collect(),
            saturated: sphere.saturated,
        })
    }
}

impl Portrait {
    /// How far the picture goes out from the ball's centre, in radii.
    pub const REACH: f64 = 1.25;

    /// How many statistics there are.
    pub const STATISTICS: usize = LogReader::FEATURES;

    /// The statistics.
    pub fn statistics(&self) -> &[f32] {
        &self.statistics
    }

    /// The share of the ball that is saturated.
    pub fn saturated(&self) -> f64 {
        self.saturated
    }

    /// What a [`Network`] takes: luminance less one, red and blue less luminance, and how far out a
    /// pixel lies; `mirrored` exchanges left and right.
    pub fn inputs(&self, mirrored: bool) -> Vec<f32> {
        const SIDE: usize = Network::SIDE;
        let mut inputs = vec![0.0; Network::INPUTS];
        let weights = Luminance::Rec709.weights().map(|weight| weight as f32);
        for place in 0..SIDE * SIDE {
            let (row, column) = (place / SIDE, place % SIDE);
            let from = if mirrored { SIDE - 1 - column } else { column };
            let rgb: [f32; 3] = std::array::from_fn(|c| {
                let code = self.codes[3 * (row * SIDE + from) + c];
                f32::from(code) * (LARGEST as f32 / 255.0)
            });
            let luminance: f32 = rgb.iter().zip(weights).map(|(v, w)| v * w).sum();
            let radius = Self::REACH as f32 * radius(row, column) as f32;
            // 0 in the middle of what the ball shows at an angle, −1 towards its centre, 1 behind.
            let place_on_ball = ((radius - 0.6) / 0.65).clamp(-1.0, 1.0);
            let values = [
                luminance - 1.0,
                rgb[0] - luminance,
                rgb[2] - luminance,
                place_on_ball,
            ];
            for (channel, value) in values.into_iter().enumerate() {
                inputs[channel * SIDE * SIDE + place] = value;
            }
        }
        inputs
    }
}

/// How far a pixel lies from the centre, in halves of the picture's side.
fn radius(row: usize, column: usize) -> f64 {
    let at = |index: usize| (2 * index + 1) as f64 / Network::SIDE as f64 - 1.0;
    at(row).hypot(at(column))
}

fn codes(picture: &Picture, circle: Circle) -> Result<Vec<u8>> {
    const SIDE: usize = Network::SIDE;
    let Circle { x, y, radius: r } = circle;
    let (width, height) = (picture.width(), picture.height());
    let pitch = 2.0 * Portrait::REACH * r / SIDE as f64;
    // So many points of a picture's pixel each way as it has pixels of the photograph, but no more
    // than eight: sixty-four of them, each between four pixels, have little noise.
    let points = (pitch.ceil() as usize + 1).clamp(2, 8);
    // What is at the edge of the photograph is continued beyond it.
    let sample = |x: f64, y: f64| -> [f64; 3] {
        let corners = bilinear::corners(width, height, x - 0.5, y - 0.5).map(|(index, weight)| {
            let rgb = picture.get(index / width, index % width);
            (rgb.unwrap_or_default(), weight)
        });
        std::array::from_fn(|c| corners.iter().map(|(rgb, w)| rgb[c] * w).sum())
    };
    let mut pixels: Vec<[f64; 3]> = (0..SIDE * SIDE)
        .map(|place| {
            let (row, column) = ((place / SIDE) as f64, (place % SIDE) as f64);
            let mut sum = [0.0; 3];
            for point in 0..points * points {
                let part = |index: usize| (index as f64 + 0.5) / points as f64;
                let (v, u) = (part(point / points), part(point % points));
                let rgb = sample(
                    x - Portrait::REACH * r + (column + u) * pitch,
                    y - Portrait::REACH * r + (row + v) * pitch,
                );
                for (sum, value) in sum.iter_mut().zip(rgb) {
                    *sum += value;
                }
            }
            sum.map(|sum| sum / (points * points) as f64)
        })
        .collect();
    let mut mean = mean_of_ball(&pixels)?;
    if !picture.is_encoded() {
        for value in pixels.iter_mut().flatten() {
            *value = value.min(SATURATED * mean);
        }
        mean = mean_of_ball(&pixels)?;
    }
    let code = |value: &f64| {
        let value = (value / mean).max(0.0).powf(1.0 / 2.2);
        (255.0 / LARGEST * value).round().min(255.0) as u8
    };
    Ok(pixels.iter().flatten().map(code).collect())
}

fn mean_of_ball(pixels: &[[f64; 3]]) -> Result<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (place, rgb) in pixels.iter().enumerate() {
        let (row, column) = (place / Network::SIDE, place % Network::SIDE);
        if Portrait::REACH * radius(row, column) < INSIDE {
            sum += Luminance::Rec709.of(*rgb);
            count += 1.0;
        }
    }
    let mean = sum / count;
    if mean.is_nan() || mean <= 0.0 {
        return Err(Error::Black { what: "the sphere" });
    }
    Ok(mean)
}
