//! The power spectrum of one image of a sphere, over the sphere of normals.

use crate::features::Continuation;
use crate::harmonics::{Transform, average_power};
use crate::illumination::Luminance;
use crate::reflection::SphereImage;
use crate::sphere::Grid;
use crate::{Error, Result};

/// Rings (and columns) of the grid of normals for each degree of the spectrum.
///
/// A 128² image of a sphere resolves degrees to about 200 at its centre. Gauss–Legendre analysis
/// with n rings keeps degree l free of the field's degrees below 2n − l, so with four rings a
/// degree what is analysed up to 64 is free of everything that such an image resolves.
const OVERSAMPLING: usize = 4;

/// The power of an image's degrees, and of its colour.
///
/// ```
/// use lobes::features::{Continuation, ImageSpectrum};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// // A ball that shows 2 in red, 1 in green and nothing in blue.
/// let image = SphereImage::new(camera, 64, vec![[2.0, 1.0, 0.0]; 64 * 64])?;
/// let power = ImageSpectrum::new(8, Continuation::Mirror)?.power(&image)?;
/// let four_pi = 4.0 * std::f64::consts::PI;
/// assert!((power.colour[0] / four_pi - 4.0).abs() < 1e-12);
/// assert!((power.colour[1] / four_pi - 1.0).abs() < 1e-12);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ImagePower {
    /// Average power B_l = Σ_m B_lm² / (2l + 1) of the luminance, l = 0 … degree.
    pub luminance: Vec<f64>,
    /// B_0 of red, green and blue.
    pub colour: [f64; 3],
}

/// The plan for power spectra of images of spheres.
///
/// The image is read as a field over the sphere of normals: a pixel shows the radiance that leaves
/// the point with normal n. Its visible half is sampled bilinearly on a Gauss–Legendre grid whose
/// pole looks into the camera (normals past the last pixel of the rim take the rim's), the other
/// half is filled by the [`Continuation`], and the field is analysed into real orthonormal
/// harmonics. A power spectrum does not depend on how the grid is turned.
///
/// Immutable; share it between threads.
///
/// ```
/// use lobes::features::{Continuation, ImageSpectrum};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let even = SphereImage::new(camera, 64, vec![[1.0; 3]; 64 * 64])?;
/// let power = ImageSpectrum::new(8, Continuation::Mirror)?.power(&even)?;
/// // What is the same everywhere has no degree but 0.
/// assert!(power.luminance[1..].iter().all(|power_l| *power_l < 1e-20 * power.luminance[0]));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ImageSpectrum {
    continuation: Continuation,
    grid: Grid,
    transform: Transform,
    /// (cos, sin) of the columns' azimuths.
    azimuths: Vec<(f64, f64)>,
}

impl ImageSpectrum {
    /// A plan for spectra up to `degree`.
    ///
    /// # Errors
    /// [`Error::Degree`] past 1024, where no image of a sphere has content.
    pub fn new(degree: usize, continuation: Continuation) -> Result<Self> {
        const LIMIT: usize = 1024;
        if degree > LIMIT {
            return Err(Error::Degree {
                what: "the spectrum of an image",
                degree,
                limit: LIMIT,
            });
        }
        let rings = OVERSAMPLING * degree.max(16);
        let grid = Grid::gauss_legendre(rings, rings)?;
        let transform = Transform::new(&grid, degree)?;
        let azimuths = (0..rings)
            .map(|column| {
                let (sin, cos) = (std::f64::consts::TAU * column as f64 / rings as f64).sin_cos();
                (cos, sin)
            })
            .collect();
        Ok(Self {
            continuation,
            grid,
            transform,
            azimuths,
        })
    }

    /// How the unseen half is filled.
    pub fn continuation(&self) -> Continuation {
        self.continuation
    }

    /// The power of an image.
    ///
    /// # Errors
    /// [`Error::Unseen`] when the image has no pixel at the centre of its sphere.
    pub fn power(&self, image: &SphereImage) -> Result<ImagePower> {
        let (luminance, mean) = self.field(image)?;
        let coefficients = self.transform.analyse(&luminance)?;
        // B_00 = √(4π) times the mean.
        let colour = mean.map(|mean| 4.0 * std::f64::consts::PI * mean * mean);
        Ok(ImagePower {
            luminance: average_power(&coefficients),
            colour,
        })
    }

    /// The power of the field over all normals, the front from one image and the back from another,
    /// whose camera stands opposite and as upright: what one image and a continuation stand for.
    ///
    /// # Errors
    /// Those of [`power`](Self::power), and [`Error::NotOpposite`] when the cameras are not
    /// opposite or not equally upright.
    pub fn whole_power(&self, front: &SphereImage, back: &SphereImage) -> Result<ImagePower> {
        let (one, other) = (front.camera(), back.camera());
        let apart = (one.towards() + other.towards())
            .length()
            .max((one.up() - other.up()).length());
        if apart > 1e-9 {
            return Err(Error::NotOpposite { apart });
        }
        let (mut luminance, front) = self.seen(front)?;
        let (behind, back) = self.seen(back)?;
        let (rings, columns) = (self.grid.rings(), self.grid.columns());
        for ring in 0..rings / 2 {
            for column in 0..columns {
                // (x, y, −z) of the one is (−x, y, z) of the other.
                let mirrored = (columns + columns / 2 - column) % columns;
                luminance[(rings - 1 - ring) * columns + column] =
                    behind[ring * columns + mirrored];
            }
        }
        let coefficients = self.transform.analyse(&luminance)?;
        let colour = std::array::from_fn(|channel| {
            let mean = (front[channel] + back[channel]) / (4.0 * std::f64::consts::PI);
            4.0 * std::f64::consts::PI * mean * mean
        });
        Ok(ImagePower {
            luminance: average_power(&coefficients),
            colour,
        })
    }

    /// The transform over the grid of normals.
    pub(super) fn transform(&self) -> &Transform {
        &self.transform
    }

    /// The luminance on the whole grid of normals, and the mean of each channel over the sphere.
    pub(super) fn field(&self, image: &SphereImage) -> Result<(Vec<f64>, [f64; 3])> {
        let (rings, columns) = (self.grid.rings(), self.grid.columns());
        let (mut luminance, sum) = self.seen(image)?;
        let (front, back) = luminance.split_at_mut(rings / 2 * columns);
        for (ring, back) in back.chunks_exact_mut(columns).enumerate() {
            let mirrored = rings / 2 - 1 - ring;
            let front = &front[mirrored * columns..][..columns];
            for (column, value) in back.iter_mut().enumerate() {
                *value = self
                    .continuation
                    .source_column(column, columns)
                    .map_or(0.0, |source| front[source]);
            }
        }
        let halves = if self.continuation == Continuation::Zero {
            1.0
        } else {
            2.0
        };
        let mean = sum.map(|sum| halves * sum / (4.0 * std::f64::consts::PI));
        Ok((luminance, mean))
    }

    /// The luminance on the grid of normals, 0 on the half that is not seen, and the integral of
    /// each channel over the other.
    fn seen(&self, image: &SphereImage) -> Result<(Vec<f64>, [f64; 3])> {
        let (rings, columns) = (self.grid.rings(), self.grid.columns());
        let sampler = Sampler::new(image)?;
        let mut luminance = vec![0.0; rings * columns];
        let mut sum = [0.0; 3];
        for ring in 0..rings / 2 {
            let (sin, cos) = self.grid.colatitude(ring).sin_cos();
            let weight = self.grid.ring_weight(ring);
            let mut ring_sum = [0.0; 3];
            for (column, (cos_azimuth, sin_azimuth)) in self.azimuths.iter().enumerate() {
                let rgb = sampler.at(sin * cos_azimuth, sin * sin_azimuth, cos);
                luminance[ring * columns + column] = Luminance::Rec709.of(rgb);
                for (sum, value) in ring_sum.iter_mut().zip(rgb) {
                    *sum += value;
                }
            }
            for (sum, ring_sum) in sum.iter_mut().zip(ring_sum) {
                *sum += weight * ring_sum;
            }
        }
        Ok((luminance, sum))
    }
}

/// Bilinear samples of an image of a sphere, the rim continued outwards.
struct Sampler<'a> {
    image: &'a SphereImage,
    /// One step inwards along a radius: a pixel, as a share of the disc's radius.
    rim: f64,
}

impl<'a> Sampler<'a> {
    fn new(image: &'a SphereImage) -> Result<Self> {
        let sampler = Self {
            image,
            rim: 1.0 - 2.0 / image.size() as f64,
        };
        // `at` walks towards the centre until it meets a pixel.
        if sampler.bilinear(0.0, 0.0).is_none() {
            return Err(Error::Unseen {
                what: "the centre of its sphere",
            });
        }
        Ok(sampler)
    }

    /// The radiance at the normal (x, y, z) of the camera's frame, z ≥ 0; past what the camera
    /// sees, the rim's.
    fn at(&self, x: f64, y: f64, z: f64) -> [f64; 3] {
        let magnification = match self.image.camera().distance() {
            None => 1.0,
            Some(distance) if z * distance > 1.0 => {
                (distance * distance - 1.0).sqrt() / (distance - z)
            }
            Some(_) => 1.0 / x.hypot(y),
        };
        let (x, y) = (x * magnification, y * magnification);
        let mut shrink = 1.0;
        loop {
            if let Some(rgb) = self.bilinear(x * shrink, y * shrink) {
                return rgb;
            }
            shrink *= self.rim;
        }
    }

    /// The value at a position of the disc (x right, y up, radius 1), from the neighbours that show
    /// the sphere; `None` where none does.
    fn bilinear(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        let half = self.image.size() as f64 / 2.0;
        self.image
            .interpolate(half + x * half - 0.5, half - y * half - 0.5)
    }
}
