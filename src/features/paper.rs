//! The paper's features: seven numbers of the power spectrum, and colour.

use crate::features::{Continuation, ImagePower, ImageSpectrum};
use crate::reflection::SphereImage;
use crate::{Error, Result};

/// The top degree of the sums. The paper does not give one.
pub const TOP_DEGREE: usize = 64;

/// The windows of v3 … v6, `[from, to)`; each holds five odd degrees.
const WINDOWS: [(usize, usize); 4] = [(5, 15), (15, 25), (25, 35), (35, 45)];

/// The share of the total power that v7's degree must reach.
const ROLL_OFF: f64 = 0.98;

/// The paper's features of one image.
///
/// With B_l the average power of degree l of the luminance of the sphere of normals
/// (see [`ImageSpectrum`]), up to [`TOP_DEGREE`]:
///
/// - v1 = Σ_{l ≤ 2} B_l / Σ_l B_l: near 1 for a matte sphere, which keeps no more (Lambert).
/// - v2 = mean of B_l / B_{l+1} over odd l ≥ 3. A matte sphere reflects no odd l ≥ 3, so the paper
///   expects v2 near 0 there; with the mirrored back, whose crease has power at every degree, it
///   is not (`lobes reproduce` plots it).
/// - v3 … v6 = (1/5) Σ B_l / B_3 over the odd l in [5, 15), [15, 25), [25, 35), [35, 45).
///   **Erratum**: the paper's example of v3 prints [15, 25), which its own list makes v4.
/// - v7 = the least degree up to which 98 % of the total power lies.
/// - colour = B_0 of each channel.
///
/// Scaling the image by c multiplies colour by c² and leaves v1 … v7.
///
/// ```
/// use lobes::features::{ImagePower, PaperFeatures};
/// // A spectrum that falls as 1/l² has v2 = mean of ((l+1)/l)².
/// let luminance: Vec<f64> = (0..=64).map(|l| 1.0 / f64::from(l.max(1)).powi(2)).collect();
/// let features = PaperFeatures::of_power(&ImagePower { luminance, colour: [1.0; 3] })?;
/// assert!(features.power[1] > 1.0 && features.power[1] < 16.0 / 9.0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperFeatures {
    /// v1 … v7.
    pub power: [f64; 7],
    /// B_0 of red, green and blue.
    pub colour: [f64; 3],
}

impl PaperFeatures {
    /// The names of the ten numbers, in the order of [`Self::to_array`].
    pub const NAMES: [&'static str; 10] = [
        "v1", "v2", "v3", "v4", "v5", "v6", "v7", "red", "green", "blue",
    ];

    /// The features of one image.
    ///
    /// # Errors
    /// Those of [`ImageSpectrum::power`] and of [`Self::of_power`], and [`Error::Undefined`] for
    /// [`Continuation::Antipodal`], under which every odd degree is zero.
    pub fn of_image(spectrum: &ImageSpectrum, image: &SphereImage) -> Result<Self> {
        if spectrum.continuation() == Continuation::Antipodal {
            return Err(Error::Undefined {
                what: "power at odd degrees",
                of: "the antipodal continuation",
                reason: "the features v2 … v6 are made of it; use another continuation",
            });
        }
        Self::of_power(&spectrum.power(image)?)
    }

    /// The features of a spectrum.
    ///
    /// # Errors
    /// [`Error::Length`] when the spectrum ends before degree 44 (v6 needs it);
    /// [`Error::NoPower`] when degree 3 or an even degree ≥ 4 has no power, so that a ratio has
    /// no value.
    pub fn of_power(power: &ImagePower) -> Result<Self> {
        let b = &power.luminance;
        let last_window_end = WINDOWS[WINDOWS.len() - 1].1;
        if b.len() < last_window_end {
            return Err(Error::Length {
                what: "the power spectrum",
                expected: last_window_end,
                got: b.len(),
            });
        }
        let total: f64 = b.iter().sum();
        if let Some(l) = (3..b.len()).find(|&l| (l == 3 || l % 2 == 0) && !(b[l] > 0.0)) {
            return Err(Error::NoPower {
                what: "the image",
                degree: l,
                value: b[l],
                consequence: "so that the paper's ratios have no value; is it a flat or an empty picture?",
            });
        }
        let mut features = [0.0; 7];
        features[0] = b[..3].iter().sum::<f64>() / total;
        let ratios: Vec<f64> = (3..b.len() - 1)
            .step_by(2)
            .map(|l| b[l] / b[l + 1])
            .collect();
        features[1] = ratios.iter().sum::<f64>() / ratios.len() as f64;
        for (feature, (from, to)) in features[2..6].iter_mut().zip(WINDOWS) {
            *feature = (from..to).step_by(2).map(|l| b[l] / b[3]).sum::<f64>() / 5.0;
        }
        let mut running = 0.0;
        let roll_off = b.iter().position(|&power| {
            running += power;
            running >= ROLL_OFF * total
        });
        features[6] = roll_off.unwrap_or(b.len() - 1) as f64;
        Ok(Self {
            power: features,
            colour: power.colour,
        })
    }

    /// The ten numbers, v1 … v7 and then colour.
    pub fn to_array(&self) -> [f64; 10] {
        let mut array = [0.0; 10];
        array[..7].copy_from_slice(&self.power);
        array[7..].copy_from_slice(&self.colour);
        array
    }
}
