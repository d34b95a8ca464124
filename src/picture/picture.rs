//! A picture from a camera or a renderer, as linear radiance.

use crate::error::check_length;
#[cfg(feature = "files")]
use crate::files::{Raster, linear_of_srgb};
use crate::illumination::Luminance;
use crate::{Error, Result};

/// A picture as linear radiance, with a sphere somewhere in it.
///
/// Rows from the top, each from the left; the first pixel's centre is at (½, ½).
///
/// ```
/// use lobes::picture::{Circle, Picture};
///
/// // A grey ball before a black background, as a renderer might leave it.
/// let ball = |x: f64, y: f64| if (x - 50.0).hypot(y - 40.0) < 30.0 { [0.3 + 0.004 * y + 0.001 * x; 3] } else { [0.0; 3] };
/// let pixels = (0..100 * 80).map(|i| ball((i % 100) as f64 + 0.5, (i / 100) as f64 + 0.5));
/// let picture = Picture::linear(100, 80, pixels.collect())?;
/// let circle = picture.circle()?;
/// assert!((circle.radius - 30.0).abs() < 0.3);
/// assert_eq!(picture.sphere(circle)?.saturated, 0.0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Pixels,
    /// How much of each pixel a mask leaves; everything where there is none.
    pub(super) mask: Option<Vec<f32>>,
    /// The value from which on a pixel is saturated.
    pub(super) ceiling: f64,
    /// Whether it came as codes, not as radiance.
    pub(super) encoded: bool,
    /// The focal length in pixels, where it is known.
    pub(super) focal: Option<f64>,
    /// Whether its file has a gain map, which is left aside.
    pub(super) gain_map: bool,
}

/// Pixels as they came; two are equal where their radiance is.
#[derive(Debug, Clone)]
pub(super) enum Pixels {
    Radiance(Vec<[f64; 3]>),
    /// A quarter or an eighth of the memory, and what cameras write.
    #[cfg(feature = "files")]
    Codes(Raster),
}

impl Pixels {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Radiance(pixels) => pixels.len(),
            #[cfg(feature = "files")]
            Self::Codes(raster) => raster.len(),
        }
    }

    /// The radiance of a pixel.
    #[inline]
    pub(super) fn at(&self, index: usize) -> [f64; 3] {
        match self {
            Self::Radiance(pixels) => pixels[index],
            #[cfg(feature = "files")]
            Self::Codes(raster) => raster.at(index),
        }
    }

    /// The sum of pixels' radiances, each by its weight: of (index, weight).
    #[inline]
    pub(super) fn weighted_sum(&self, terms: impl Iterator<Item = (usize, f64)>) -> [f64; 3] {
        match self {
            Self::Radiance(pixels) => {
                let mut sum = [0.0; 3];
                for (index, weight) in terms {
                    for (sum, value) in sum.iter_mut().zip(pixels[index]) {
                        *sum += weight * value;
                    }
                }
                sum
            }
            #[cfg(feature = "files")]
            Self::Codes(raster) => raster.weighted_sum(terms),
        }
    }
}

impl PartialEq for Pixels {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && (0..self.len()).all(|i| self.at(i) == other.at(i))
    }
}

/// An 8-bit code from which on a pixel counts as saturated: JPEG smears the last few.
#[cfg(feature = "files")]
const SATURATED: f64 = 252.0 / 255.0;

impl Picture {
    /// A picture of linear radiance.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are `width` · `height` pixels and one at least;
    /// [`Error::NotFinite`].
    pub fn linear(width: usize, height: usize, pixels: Vec<[f64; 3]>) -> Result<Self> {
        check_length("the picture", width.saturating_mul(height), pixels.len())?;
        if pixels.is_empty() {
            return Err(Error::Empty {
                what: "a picture",
                needs: "a pixel",
            });
        }
        for (index, rgb) in pixels.iter().enumerate() {
            if let Some(value) = rgb.iter().find(|value| !value.is_finite()) {
                return Err(Error::NotFinite {
                    what: "the picture",
                    index,
                    value: *value,
                });
            }
        }
        Ok(Self {
            width,
            height,
            pixels: Pixels::Radiance(pixels),
            mask: None,
            ceiling: f64::INFINITY,
            encoded: false,
            focal: None,
            gain_map: false,
        })
    }

    /// A picture of sRGB codes, each on [0, 1]: those of 8 bits over 255, of 16 bits over 65 535.
    /// Codes from 252/255 on are saturated.
    ///
    /// # Errors
    /// As [`linear`](Self::linear).
    #[cfg(feature = "files")]
    pub fn encoded(width: usize, height: usize, mut codes: Vec<[f64; 3]>) -> Result<Self> {
        for rgb in &mut codes {
            *rgb = rgb.map(linear_of_srgb);
        }
        Ok(Self::linear(width, height, codes)?.as_encoded())
    }

    /// The same radiance, taken as having come as sRGB codes: from that of the code 252/255 on it
    /// is saturated.
    #[cfg(feature = "files")]
    #[must_use]
    pub fn as_encoded(self) -> Self {
        Self {
            ceiling: linear_of_srgb(SATURATED),
            encoded: true,
            ..self
        }
    }

    /// A picture of sRGB codes of 8 bits, red, green and blue of each pixel: [`encoded`](Self::encoded)
    /// in an eighth of the memory.
    ///
    /// # Errors
    /// As [`linear`](Self::linear).
    #[cfg(feature = "files")]
    pub fn from_srgb8(width: usize, height: usize, codes: Vec<u8>) -> Result<Self> {
        let raster = Raster::srgb(codes);
        Self::decoded(width, height, raster, linear_of_srgb(SATURATED))
    }

    /// A picture of codes, saturated from the linear value `ceiling` on.
    #[cfg(feature = "files")]
    pub(super) fn decoded(
        width: usize,
        height: usize,
        raster: Raster,
        ceiling: f64,
    ) -> Result<Self> {
        check_length("the picture", width.saturating_mul(height), raster.len())?;
        if raster.len() == 0 {
            return Err(Error::Empty {
                what: "a picture",
                needs: "a pixel",
            });
        }
        Ok(Self {
            width,
            height,
            pixels: Pixels::Codes(raster),
            mask: None,
            ceiling,
            encoded: true,
            focal: None,
            gain_map: false,
        })
    }

    /// With how much of each pixel a mask (an alpha channel) leaves, on [0, 1]. A mask that leaves
    /// everything is none.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one value a pixel.
    pub fn with_mask(mut self, mask: Vec<f32>) -> Result<Self> {
        check_length("the mask", self.pixels.len(), mask.len())?;
        self.mask = mask.iter().any(|part| *part < 0.5).then_some(mask);
        Ok(self)
    }

    /// With the focal length in pixels, by which the camera's distance in radii of the sphere is
    /// known.
    ///
    /// # Errors
    /// [`Error::Domain`] for one that is not positive and finite.
    pub fn with_focal_length(mut self, pixels: f64) -> Result<Self> {
        if !(pixels > 0.0 && pixels.is_finite()) {
            return Err(Error::Domain {
                what: "the focal length in pixels",
                value: pixels,
                allowed: "finite and above 0",
            });
        }
        self.focal = Some(pixels);
        Ok(self)
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The linear radiance of a pixel by its row and column; nothing past the last.
    #[inline]
    pub fn get(&self, row: usize, column: usize) -> Option<[f64; 3]> {
        (row < self.height && column < self.width)
            .then(|| self.pixels.at(row * self.width + column))
    }

    /// The linear radiance of every pixel, row by row.
    pub fn radiance(&self) -> impl ExactSizeIterator<Item = [f64; 3]> {
        (0..self.pixels.len()).map(|index| self.pixels.at(index))
    }

    /// The value from which on a pixel is saturated; none for radiance, which no code limits.
    pub fn ceiling(&self) -> Option<f64> {
        self.ceiling.is_finite().then_some(self.ceiling)
    }

    /// Whether it came as sRGB codes.
    pub fn is_encoded(&self) -> bool {
        self.encoded
    }

    /// How much of each pixel the mask leaves, row by row; nothing where there is no mask.
    pub fn mask(&self) -> Option<&[f32]> {
        self.mask.as_deref()
    }

    /// Whether a mask tells where the sphere is.
    pub fn has_mask(&self) -> bool {
        self.mask.is_some()
    }

    /// The focal length in pixels, where it is known.
    pub fn focal_length(&self) -> Option<f64> {
        self.focal
    }

    /// Whether its file has a gain map (an Ultra HDR JPEG), which is left aside: it is read as it
    /// is without.
    pub fn has_gain_map(&self) -> bool {
        self.gain_map
    }

    /// The mean luminance.
    pub(super) fn mean_luminance(&self) -> f64 {
        let sum: f64 = self.radiance().map(|rgb| Luminance::Rec709.of(rgb)).sum();
        sum / self.pixels.len() as f64
    }
}
