//! The light about a ball, averaged over what the ball may be made of.

use glam::{DMat3, DQuat, DVec3};

use super::bright_lights::BrightLights;
use super::evidence::{log_sum_exp, natural_spectrum};
use super::expected_picture::ExpectedPicture;
use super::light_grid::{LightField, LightGrid};
use super::light_posterior::{ChannelReflectance, LightReader, SeenLobe, check_noise};
use super::possible_reflectances::PossibleReflectance;
use crate::error::check_count;
use crate::features::{Modes, RingLayout, Unwrapped};
use crate::harmonics::{Coefficients, Rotation, Transform, convolve_zonal};
use crate::reflectance::{Variant, lambert};
use crate::reflection::{OperatorSet, SphereImage, Viewpoint};
use crate::sphere::{self, Grid};
use crate::{Error, Parallelism, Result};

/// Reads the light about a ball of which not even the reflectance is known for sure.
///
/// Of each of the reflectances that the ball may have ([`PossibleReflectance`]) a [`LightReader`]
/// says what the light is then, M_i with the variance V_i at a place, and how likely the picture
/// is, p_i, the light integrated out. With w_i ∝ p_i times what was thought of the reflectance
/// before, and s_i how much brighter the ball is than that reflectance, the mean and the variance
/// are those of the mixture (the law of total variance),
///
/// E L = Σ w_i E(1/s_i) M_i,    Var L = Σ w_i E(1/s_i²) (V_i + M_i²) − (E L)².
///
/// So the deviation holds what is not known of σ, of the specular share and of the base colour
/// too. Red, green and blue show much the same light, so that ln p_i is the mean of theirs, not the
/// sum. The light is a natural one, C_l = l^(−2.5), to degree [`Self::DEGREE`], and ν is that of
/// photographs of 8 bits.
///
/// Operators are kept by σ from picture to picture. One reflectance takes some 60 ms of one core, of
/// which a coloured dielectric has three, one a channel; how often the deviations hold stands in
/// `docs/explanation/light.md`.
///
/// ```
/// use lobes::Parallelism;
/// use lobes::inference::{BallLightReader, ChannelReflectance, LightQuantity, PossibleReflectance};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// // A mirror in light of radiance 2 from all sides.
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let image = SphereImage::new(camera, 96, vec![[2.0; 3]; 96 * 96])?;
/// let mirror = ChannelReflectance { diffuse: 0.0, specular: 1.0, sigma: 0.0 };
/// let reader = BallLightReader::new(Viewpoint::Orthographic, LightQuantity::Radiance)?;
/// let known = [PossibleReflectance::known([mirror; 3])];
/// let light = reader.read(&image, &known, Parallelism::Sequential)?;
/// let (mean, deviation) = light.lat_long(32)?;
/// // Straight up, at half a row from the zenith.
/// assert!((mean[0][1] - 2.0).abs() < 0.02 && deviation[0][1] < 0.1);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug)]
pub struct BallLightReader {
    layout: RingLayout,
    quantity: LightQuantity,
    /// ν.
    noise: f64,
    spectrum: Vec<f64>,
    operators: OperatorSet,
    grid: LightGrid,
}

/// What is asked of the light.
///
/// ```
/// use lobes::inference::LightQuantity;
/// assert_ne!(LightQuantity::Radiance, LightQuantity::Irradiance);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightQuantity {
    /// The radiance from a direction.
    Radiance,
    /// The irradiance at a normal.
    Irradiance,
}

/// The light about a ball, or its irradiance, with its deviation.
///
/// ```
/// use lobes::inference::BallLight;
/// use lobes::Result;
/// /// The relative deviation of green straight up.
/// fn above(light: &BallLight) -> Result<f64> {
///     let (mean, deviation) = light.lat_long(64)?;
///     Ok(deviation[0][1] / mean[0][1])
/// }
/// ```
#[derive(Debug, Clone)]
pub struct BallLight {
    /// The mean of each channel in the view's frame: the radiance's coefficients, or those of the
    /// irradiance. The pole is towards the camera, azimuth 0 to the right of the picture.
    pub mean: [Coefficients; 3],
    /// The posterior probability of each of the reflectances.
    pub probabilities: Vec<f64>,
    /// The picture beside the one that is expected of it.
    pub picture: ExpectedPicture,
    /// The variance on the grid of the view's frame.
    variance: Vec<[f64; 3]>,
    rows: usize,
}

/// η of the field, in the middle of 0.2 … 0.8, which is what the built-in maps without a sun in
/// them have (`lobes spectrum`): a sun is a light of its own.
const ETA: f64 = 0.5;

impl BallLightReader {
    /// The degree to which light is read: what pictures of 96 pixels show.
    pub const DEGREE: usize = 96;

    /// ν of a photograph of 8 bits, as a share of the amplitudes.
    pub const NOISE: f64 = 3e-3;

    /// Rows of the grid of the view's frame on which the variance is taken.
    const ROWS: usize = 128;

    /// The plan for pictures of one viewpoint.
    ///
    /// # Errors
    /// A camera inside the sphere.
    pub fn new(viewpoint: Viewpoint, quantity: LightQuantity) -> Result<Self> {
        Self::within(viewpoint, quantity, RingLayout::LARGEST_RADIUS, Self::NOISE)
    }

    /// The plan for pictures of which only what lies within `radius` of the centre is to be read, in
    /// radii of the ball's outline, with a noise of ν: of [`ShapeBall`](crate::picture::ShapeBall)
    /// its reach.
    ///
    /// ```
    /// use lobes::inference::{BallLightReader, LightQuantity};
    /// use lobes::reflection::Viewpoint;
    /// // The normals to 37° from the line of sight, which mirror the light to 74°.
    /// let (view, what) = (Viewpoint::Orthographic, LightQuantity::Radiance);
    /// let reader = BallLightReader::within(view, what, 0.6, 3e-3)?;
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// A camera inside the sphere; [`Error::Domain`] for a radius or a noise that is not above 0.
    pub fn within(
        viewpoint: Viewpoint,
        quantity: LightQuantity,
        radius: f64,
        noise: f64,
    ) -> Result<Self> {
        check_noise(noise)?;
        let layout = LightReader::layout_within(viewpoint, radius)?;
        let lobe = Variant::default();
        Ok(Self {
            operators: OperatorSet::new(lobe, viewpoint, layout.angles(), Self::DEGREE)?,
            spectrum: natural_spectrum(ETA, Self::DEGREE),
            grid: match quantity {
                LightQuantity::Radiance => LightGrid::radiance(Self::ROWS, Self::DEGREE)?,
                LightQuantity::Irradiance => LightGrid::irradiance(Self::ROWS, Self::DEGREE)?,
            },
            layout,
            quantity,
            noise,
        })
    }

    /// The plan for pictures such as this one.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn of_image(image: &SphereImage, quantity: LightQuantity) -> Result<Self> {
        let viewpoint = match image.camera().distance() {
            Some(distance) => Viewpoint::Perspective { distance },
            None => Viewpoint::Orthographic,
        };
        Self::new(viewpoint, quantity)
    }

    /// The light about the ball of a picture that has one of these reflectances.
    ///
    /// # Errors
    /// [`Error::TooFew`] for no reflectance; [`Error::Domain`] for a weight that is negative, or for
    /// weights that are all 0 or not finite, and what [`LightReader::new`] refuses; a picture that
    /// is too small.
    pub fn read(
        &self,
        image: &SphereImage,
        reflectances: &[PossibleReflectance],
        parallelism: Parallelism,
    ) -> Result<BallLight> {
        check_count(
            "the light about a ball",
            "reflectances",
            1,
            reflectances.len(),
        )?;
        let total: f64 = reflectances.iter().map(|of| of.weight).sum();
        let wrong = |of: &&PossibleReflectance| !(of.weight >= 0.0);
        if let Some(of) = reflectances.iter().find(wrong) {
            return Err(Error::Domain {
                what: "the weight of a reflectance",
                value: of.weight,
                allowed: "at least 0",
            });
        }
        if !(total > 0.0 && total.is_finite()) {
            return Err(Error::Domain {
                what: "the weights of the reflectances in sum",
                value: total,
                allowed: "finite and above 0",
            });
        }
        let unwrapped = Unwrapped::new(image, &self.layout)?;
        let lights = BrightLights::of(&unwrapped, &self.layout);
        let modes = Modes::of(&unwrapped, &self.layout, |rgb| rgb)?;
        // The operators first, each by all threads: no two make the same one.
        let lobes = reflectances
            .iter()
            .map(|of| {
                let sigma = of.channels[0].sigma;
                let operator = self.operators.at(sigma, parallelism)?;
                SeenLobe::new(sigma, operator, &self.layout, &self.spectrum)
            })
            .collect::<Result<Vec<_>>>()?;
        let parts = parallelism.map(reflectances.len(), |i| {
            let channels = &reflectances[i].channels;
            self.of_reflectance(&modes, &lights, &lobes[i], channels, unwrapped.columns())
        });
        let parts = parts.into_iter().collect::<Result<Vec<_>>>()?;
        let logs = parts.iter().zip(reflectances);
        let logs: Vec<f64> = logs
            .map(|(part, of)| part.log_evidence + of.weight.ln())
            .collect();
        let whole = log_sum_exp(logs.iter().copied());
        let probabilities: Vec<f64> = logs.iter().map(|log| (log - whole).exp()).collect();
        let mut mean = [(); 3].map(|()| Coefficients::zeros(Self::DEGREE));
        let mut picture = ExpectedPicture::new(&unwrapped, &self.layout);
        let mut squares = vec![[0.0; 3]; self.grid.rows() * self.grid.columns()];
        for ((part, reflectance), probability) in
            parts.into_iter().zip(reflectances).zip(&probabilities)
        {
            for (channel, of) in part.channels.into_iter().enumerate() {
                let (coefficients, field) = (of.mean, of.field);
                picture.add(channel, *probability, &of.shown);
                let [first, second] = reflectance.inverse_scale[channel].map(|m| probability * m);
                let sums = mean[channel].as_mut_slice().iter_mut();
                for (sum, value) in sums.zip(coefficients.as_slice()) {
                    *sum += first * value;
                }
                let places = field.mean.iter().zip(&field.variance);
                for (sum, (mean, variance)) in squares.iter_mut().zip(places) {
                    sum[channel] += second * (variance + mean * mean);
                }
            }
        }
        for (channel, coefficients) in mean.iter_mut().enumerate() {
            for (square, mean) in squares.iter_mut().zip(self.grid.synthesise(coefficients)) {
                square[channel] = (square[channel] - mean * mean).max(0.0);
            }
            if self.quantity == LightQuantity::Irradiance {
                convolve_zonal(coefficients, &lambert::transfers(Self::DEGREE)?)?;
            }
        }
        Ok(BallLight {
            mean,
            probabilities,
            picture,
            variance: squares,
            rows: self.grid.rows(),
        })
    }

    /// What each channel shows if the ball is made of this, rings of the picture having so many
    /// columns.
    fn of_reflectance(
        &self,
        modes: &[Modes; 3],
        lights: &BrightLights,
        lobe: &SeenLobe,
        channels: &[ChannelReflectance; 3],
        columns: usize,
    ) -> Result<SeenLight> {
        // Channels whose body and lobe are in one proportion share a reader.
        let mut readers: Vec<(ChannelReflectance, LightReader)> = Vec::with_capacity(3);
        let mut all = Vec::with_capacity(3);
        let mut log_evidence = 0.0;
        for (own, modes) in channels.iter().zip(modes) {
            if own.sigma.to_bits() != channels[0].sigma.to_bits() {
                return Err(Error::Domain {
                    what: "σ of a channel",
                    value: own.sigma,
                    allowed: "that of the others",
                });
            }
            let known = readers.iter().find(|(other, _)| proportional(own, other));
            let (made_for, reader) = match known {
                Some((made_for, reader)) => (made_for, reader),
                None => {
                    let (layout, spectrum) = (&self.layout, &self.spectrum);
                    let (diffuse, specular) = (own.diffuse, own.specular);
                    let (noise, one) = (self.noise, Parallelism::Sequential);
                    let reader = LightReader::of_lobe(
                        lobe, diffuse, specular, layout, spectrum, noise, one,
                    )?;
                    readers.push((*own, reader));
                    let (made_for, reader) = &readers[readers.len() - 1];
                    (made_for, reader)
                }
            };
            let ratio = size(made_for) / size(own);
            let estimate = reader.read(modes, lights)?;
            log_evidence += estimate.log_evidence / 3.0;
            let mut field = reader.field(&estimate, &self.grid)?;
            let mut coefficients = estimate.mean;
            let means = coefficients
                .as_mut_slice()
                .iter_mut()
                .chain(&mut field.mean);
            means.for_each(|value| *value *= ratio);
            field
                .variance
                .iter_mut()
                .for_each(|value| *value *= ratio * ratio);
            all.push(SeenChannel {
                shown: lobe.shown(&coefficients, own.diffuse, own.specular, columns)?,
                mean: coefficients,
                field,
            });
        }
        Ok(SeenLight {
            channels: all,
            log_evidence,
        })
    }
}

/// What is seen of the light if the ball is made of one reflectance.
struct SeenLight {
    channels: Vec<SeenChannel>,
    /// The mean over the channels.
    log_evidence: f64,
}

struct SeenChannel {
    mean: Coefficients,
    field: LightField,
    /// The rings of the picture that the mean makes.
    shown: Vec<f64>,
}

/// The larger of body and lobe.
fn size(of: &ChannelReflectance) -> f64 {
    of.diffuse.max(of.specular)
}

/// Whether one is a multiple of the other, which is as long to read.
fn proportional(a: &ChannelReflectance, b: &ChannelReflectance) -> bool {
    let across = a.diffuse * b.specular - a.specular * b.diffuse;
    size(a) > 0.0 && size(b) > 0.0 && across.abs() <= 1e-12 * size(a) * size(b)
}

impl BallLight {
    /// Mean and standard deviation as lat-long maps of `height` rows and twice as many columns, in
    /// the camera's frame: it stands towards +z, +y is up, and the centre column looks along −z.
    ///
    /// The mean swings below 0 about sharp bright lights. Of fewer rows than 97 it is cut off at the
    /// degree that they carry.
    ///
    /// # Errors
    /// [`Error::Domain`] for no row or more than 16384.
    #[expect(clippy::type_complexity, reason = "two maps, no type of their own")]
    pub fn lat_long(&self, height: usize) -> Result<(Vec<[f64; 3]>, Vec<[f64; 3]>)> {
        let grid = Grid::lat_long(height, 2 * height)?;
        let degree = BallLightReader::DEGREE.min(height - 1);
        let transform = Transform::new(&grid, degree)?;
        let rotation = Rotation::new(BallLightReader::DEGREE)?;
        // The view's (x, y, z) are the camera's own; the harmonic frame's are (z, x, y).
        let axes = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        let turn = DQuat::from_mat3(&axes);
        let mut mean = vec![[0.0; 3]; grid.len()];
        for (channel, of_view) in self.mean.iter().enumerate() {
            let turned = rotation.rotate(of_view, turn, Parallelism::Sequential)?;
            let values = transform.synthesise(&turned.with_degree(degree))?;
            for (pixel, value) in mean.iter_mut().zip(values) {
                pixel[channel] = value;
            }
        }
        let (rows, columns) = (self.rows, 2 * self.rows);
        let steps = rows as f64 / std::f64::consts::PI;
        let deviation = (0..grid.len()).map(|place| {
            let direction = sphere::from_harmonic(
                grid.direction(place / grid.columns(), place % grid.columns()),
            );
            let (polar, azimuth) = (
                direction.z.clamp(-1.0, 1.0).acos(),
                direction.y.atan2(direction.x),
            );
            let at = (steps * polar - 0.5).clamp(0.0, (rows - 1) as f64);
            let along = (steps * azimuth).rem_euclid(columns as f64);
            let (above, left) = (at as usize, along as usize % columns);
            let (below, right) = ((above + 1).min(rows - 1), (left + 1) % columns);
            let (v, u) = (at - above as f64, along.fract());
            let value = |row: usize, column: usize| self.variance[row * columns + column];
            let corners = [
                (value(above, left), (1.0 - v) * (1.0 - u)),
                (value(above, right), (1.0 - v) * u),
                (value(below, left), v * (1.0 - u)),
                (value(below, right), v * u),
            ];
            [0, 1, 2].map(|c| {
                let variance: f64 = corners
                    .iter()
                    .map(|(value, weight)| value[c] * weight)
                    .sum();
                variance.sqrt()
            })
        });
        Ok((mean, deviation.collect()))
    }
}
