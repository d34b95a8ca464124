//! The spectrum of the whole sphere from the half that is seen, without a continuation.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::features::{Continuation, ImageSpectrum};
use crate::harmonics::{Coupling, Mask, average_power};
use crate::reflection::SphereImage;
use crate::{Error, Result};

/// The largest degree.
const DEGREE: usize = 64;

/// Bands of degrees: those of v1 (0 … 2) and of the windows of v3 … v6, and what lies between and
/// beyond.
const EDGES: [usize; 9] = [0, 3, 5, 9, 15, 25, 35, 45, 65];

/// The plan of the paper's features from an unbiased spectrum.
///
/// The image is masked with a soft edge instead of continued, and the coupling of degrees by the
/// mask is undone over bands ([`Coupling::decouple`]). A hemisphere cannot tell neighbouring
/// degrees apart, so v2, the ratio of neighbours, has no unbiased counterpart. The features are ln
/// of the power of each band over the total, no less than 10⁻⁹, and ln of B_0 of each channel.
///
/// ```
/// use lobes::features::UnbiasedBands;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let plan = UnbiasedBands::new()?;
/// let features = plan.of(&image)?;
/// assert!(features.iter().all(|feature| feature.is_finite()));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct UnbiasedBands {
    spectrum: ImageSpectrum,
    mask: Mask,
    coupling: Coupling,
}

impl UnbiasedBands {
    /// The plan.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn new() -> Result<Self> {
        let mask = Mask::Apodised {
            inner: FRAC_PI_2 - 0.3,
            outer: FRAC_PI_2,
        };
        Ok(Self {
            spectrum: ImageSpectrum::new(DEGREE, Continuation::Zero)?,
            mask,
            coupling: Coupling::new(mask, DEGREE)?,
        })
    }

    /// The features: eight bands and three channels.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture, or one without a pixel at the centre of its sphere.
    pub fn of(&self, image: &SphereImage) -> Result<Vec<f64>> {
        let (mut field, mean) = self.spectrum.field(image)?;
        self.mask
            .apply(self.spectrum.transform().grid(), &mut field)?;
        let masked = average_power(&self.spectrum.transform().analyse(&field)?);
        // Light falls as l^−2 or so: within a band that shape.
        let bands = self
            .coupling
            .decouple(&masked, &EDGES, |l| (l.max(1) as f64).powi(-2))?;
        let power: Vec<f64> = bands
            .iter()
            .zip(EDGES.windows(2))
            .map(|(band, edge)| {
                let shape: f64 = (edge[0]..edge[1]).map(|l| (l.max(1) as f64).powi(-2)).sum();
                band * shape
            })
            .collect();
        let total: f64 = power.iter().map(|p| p.max(0.0)).sum();
        if total.is_nan() || total <= 0.0 {
            return Err(Error::Black {
                what: "the picture of the sphere",
            });
        }
        // A band without power comes back as rounding of either sign.
        let mut features: Vec<f64> = power.iter().map(|p| (p / total).max(1e-9).ln()).collect();
        // The mean over the sphere is half of that over the seen half.
        features.extend(mean.map(|mean| {
            let mean = 2.0 * mean;
            (4.0 * PI * mean * mean).max(1e-18).ln()
        }));
        Ok(features)
    }
}
