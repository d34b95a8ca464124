//! A photograph of a picture: exposure, noise, clipping, 8 bits of sRGB, JPEG.

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageFormat};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::files::{linear_of_srgb, srgb8_of_linear};
use crate::illumination::Luminance;
use crate::reflection::SphereImage;
use crate::{Error, Result};

/// A camera that sets its exposure by each picture and writes JPEG.
///
/// The exposure puts the mean luminance of the sphere at `middle` times 2^u of what saturates, u
/// uniform in ± `spread`. Light v (1 saturates) has noise of variance v / `full_well` +
/// `read_noise`²: shot noise and the sensor's own. Then values are clipped to [0, 1], encoded as
/// sRGB in 8 bits and compressed. What is behind the sphere is a wall of its mean colour.
/// Vignetting, a lens's flare, the colour filter's mosaic and a maker's tone curve are left out.
///
/// ```
/// use lobes::picture::Photograph;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let photograph = Photograph::default().take(&image, 1)?;
/// assert_eq!(photograph.size(), image.size());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Photograph {
    /// Where the mean luminance comes to lie.
    pub middle: f64,
    /// The range of the exposure, in stops to either side.
    pub spread: f64,
    /// Electrons at saturation.
    pub full_well: f64,
    /// The sensor's own noise as a share of saturation.
    pub read_noise: f64,
    /// JPEG's quality, 1 … 100; without it the codes stay as they are.
    pub quality: Option<u8>,
}

impl Default for Photograph {
    /// A middle grey of 0.2 ± half a stop, 10 000 electrons, noise of 0.001, quality 90.
    fn default() -> Self {
        Self {
            middle: 0.2,
            spread: 0.5,
            full_well: 1e4,
            read_noise: 1e-3,
            quality: Some(90),
        }
    }
}

impl Photograph {
    /// What a reader of the photograph gets: linear values on [0, 1], the saturated ones at 1.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture.
    pub fn take(&self, image: &SphereImage, seed: u64) -> Result<SphereImage> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let wall = image.mean();
        let size = image.size();
        let pixels: Vec<[f64; 3]> = (0..size * size)
            .map(|i| image.get(i / size, i % size).unwrap_or(wall))
            .collect();
        let codes = self.codes(size, &pixels, Luminance::Rec709.of(wall), &mut rng)?;
        let pixels = codes.iter().map(|rgb| rgb.map(linear_of_srgb)).collect();
        SphereImage::new(*image.camera(), size, pixels)
    }

    /// The sRGB codes, on [0, 1], of a square picture of `size`² pixels whose sphere has the mean
    /// luminance `mean`.
    pub(super) fn codes(
        &self,
        size: usize,
        pixels: &[[f64; 3]],
        mean: f64,
        rng: &mut Pcg64,
    ) -> Result<Vec<[f64; 3]>> {
        if mean.is_nan() || mean <= 0.0 {
            return Err(Error::Black { what: "the sphere" });
        }
        let stops = self.spread * (2.0 * rng.random::<f64>() - 1.0);
        let exposure = self.middle * stops.exp2() / mean;
        let mut codes = Vec::with_capacity(3 * size * size);
        for value in pixels.iter().flatten() {
            let light = (value * exposure).max(0.0);
            let deviation = (light / self.full_well + self.read_noise.powi(2)).sqrt();
            let seen = (light + deviation * normal(rng)).clamp(0.0, 1.0);
            codes.push(srgb8_of_linear(seen));
        }
        let Some(quality) = self.quality else {
            let (pixels, _) = codes.as_chunks::<3>();
            return Ok(pixels.iter().map(|rgb| rgb.map(on_unit)).collect());
        };
        let failed = |error: image::ImageError| Error::Encoding {
            format: "JPEG",
            width: size,
            height: size,
            problem: error.to_string(),
        };
        let side = u32::try_from(size).unwrap_or(u32::MAX);
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, quality)
            .encode(&codes, side, side, ExtendedColorType::Rgb8)
            .map_err(failed)?;
        let decoded = image::load_from_memory_with_format(&jpeg, ImageFormat::Jpeg)
            .map_err(failed)?
            .into_rgb8();
        Ok(decoded.pixels().map(|pixel| pixel.0.map(on_unit)).collect())
    }
}

fn on_unit(code: u8) -> f64 {
    f64::from(code) / 255.0
}

/// A standard normal deviate (Box and Muller 1958).
pub fn normal(rng: &mut Pcg64) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
