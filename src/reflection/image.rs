//! A picture of a sphere.

use super::Camera;
use crate::error::check_length;
use crate::numeric::bilinear;
use crate::{Error, Result};

/// A square picture of a sphere in linear RGB; pixels whose centre misses the sphere hold nothing.
///
/// ```
/// use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let image = SphereImage::new(camera, 8, vec![[0.5; 3]; 64])?;
/// assert_eq!(image.get(4, 4), Some([0.5; 3]));
/// assert_eq!(image.get(0, 0), None); // a corner misses the sphere
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SphereImage {
    camera: Camera,
    size: usize,
    /// Row by row; NaN where the sphere is not.
    pixels: Vec<[f64; 3]>,
}

impl SphereImage {
    /// A picture from its pixels, row by row from the top. What the pixels outside the sphere hold
    /// does not matter.
    ///
    /// # Errors
    /// [`Error::Domain`] if `size` is 0; [`Error::Length`] if there are not `size`² pixels;
    /// [`Error::NotFinite`] if a pixel of the sphere is not finite (its index counts single
    /// values).
    pub fn new(camera: Camera, size: usize, mut pixels: Vec<[f64; 3]>) -> Result<Self> {
        check_size(size)?;
        check_length("a picture of a sphere", size * size, pixels.len())?;
        for (index, pixel) in pixels.iter_mut().enumerate() {
            if camera.pixel(size, index / size, index % size).is_none() {
                *pixel = [f64::NAN; 3];
            } else if let Some(channel) = pixel.iter().position(|value| !value.is_finite()) {
                return Err(Error::NotFinite {
                    what: "a picture of a sphere",
                    index: 3 * index + channel,
                    value: pixel[channel],
                });
            }
        }
        Ok(Self {
            camera,
            size,
            pixels,
        })
    }

    /// Pixels a side.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The camera that took it.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// A pixel; none where its centre misses the sphere or where there is no such pixel.
    pub fn get(&self, row: usize, column: usize) -> Option<[f64; 3]> {
        if row >= self.size || column >= self.size {
            return None;
        }
        let pixel = self.pixels[row * self.size + column];
        (!pixel[0].is_nan()).then_some(pixel)
    }

    /// Between pixels, bilinear among those of the four neighbours that show the sphere; none where
    /// none does. `x` counts columns and `y` rows from the centre of the first pixel.
    pub(crate) fn interpolate(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        bilinear::mean(bilinear::corners(self.size, self.size, x, y), |index| {
            let pixel = self.pixels[index];
            (!pixel[0].is_nan()).then_some(pixel)
        })
    }

    /// The pixels of the sphere as (row, column, value), row by row.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize, [f64; 3])> + '_ {
        self.pixels
            .iter()
            .enumerate()
            .filter(|(_, pixel)| !pixel[0].is_nan())
            .map(|(index, &pixel)| (index / self.size, index % self.size, pixel))
    }

    /// How many pixels show the sphere.
    pub fn count(&self) -> usize {
        self.iter().count()
    }

    /// The mean of each channel over the pixels of the sphere.
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for (_, _, pixel) in self.iter() {
            for channel in 0..3 {
                sum[channel] += pixel[channel];
            }
            count += 1.0;
        }
        sum.map(|value| value / count)
    }

    /// The picture with `f` applied to each pixel of the sphere.
    #[must_use]
    pub fn map(&self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let mut image = self.clone();
        for pixel in image.pixels.iter_mut().filter(|pixel| !pixel[0].is_nan()) {
            *pixel = f(*pixel);
        }
        image
    }
}

/// Checks the pixels a side of a picture of a sphere.
///
/// # Errors
/// [`Error::Domain`] unless it is from 1 to 16 384.
pub fn check_size(size: usize) -> Result<()> {
    if (1..=1 << 14).contains(&size) {
        Ok(())
    } else {
        Err(Error::Domain {
            what: "the size of a picture of a sphere",
            value: size as f64,
            allowed: "from 1 to 16384 pixels a side",
        })
    }
}
