//! What classifiers read off one picture.

use nalgebra::DMatrix;

use super::bright_lights::BrightLights;
use crate::Result;
use crate::features::{
    Continuation, DrorFeatures, ImageSpectrum, LogBands, MirroredLight, Modes, Needlets,
    PaperFeatures, RingLayout, ShadingResidual, TOP_DEGREE, UnbiasedBands, Unwrapped, cosine_basis,
    log_fields,
};
use crate::illumination::Luminance;
use crate::reflection::{SphereImage, Viewpoint};

/// What classifiers read off one picture.
///
/// ```
/// use lobes::inference::Reader;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # // A ball that is brighter on the upper right.
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let reading = Reader::new(Viewpoint::Orthographic)?.read(&image, false)?;
/// assert!(reading.judged.is_none(), "it was not asked for");
/// // Over its own mean luminance, a picture is as bright as any other.
/// let [r, g, b] = reading.without_exposure().mean;
/// assert!((0.2126 * r + 0.7152 * g + 0.0722 * b - 1.0).abs() < 1e-3);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Reading {
    /// [`DrorFeatures`].
    pub dror: DrorFeatures,
    /// [`Needlets`].
    pub needlets: Vec<f64>,
    /// [`LogBands`], [`MirroredLight`] and [`ShadingResidual`].
    pub bands: Vec<f64>,
    /// The mean of each channel over the picture.
    pub mean: [f64; 3],
    /// By order m: the amplitudes of ln luminance, cosine and sine columns over
    /// [`Reader::FUNCTIONS`] radial functions.
    pub log_amplitudes: Vec<DMatrix<f64>>,
    /// What only pictures that are judged are asked for.
    pub judged: Option<JudgedReading>,
}

/// What only pictures that are judged, and those that the paper's features learn from, are asked
/// for.
///
/// ```
/// use lobes::inference::Reader;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # // A ball that is brighter on the upper right.
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let reading = Reader::new(Viewpoint::Orthographic)?.read(&image, true)?;
/// let judged = reading.judged.unwrap();
/// // The paper's features under each continuation of the half of the ball that is not seen.
/// assert_eq!(judged.paper.len(), Reader::CONTINUATIONS.len());
/// assert_eq!(judged.image.size(), 64);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct JudgedReading {
    /// The paper's features under each of [`Reader::CONTINUATIONS`].
    pub paper: [PaperFeatures; 3],
    /// [`UnbiasedBands`].
    pub unbiased: Vec<f64>,
    /// What evidence is taken of.
    pub evidence: EvidenceReading,
    /// The picture itself.
    pub image: SphereImage,
}

impl Reading {
    /// What would have been read off the picture over its own mean luminance: all that an unknown
    /// exposure leaves.
    ///
    /// [`JudgedReading::evidence`] and the picture keep their scale, which
    /// [`GaussianEvidence`](super::GaussianEvidence) does not notice.
    #[must_use]
    pub fn without_exposure(mut self) -> Self {
        let mean = Luminance::Rec709.of(self.mean);
        self.mean = self.mean.map(|value| value / mean);
        self.dror.brightness = 0.0;
        if let Some(judged) = &mut self.judged {
            for features in &mut judged.paper {
                features.colour = features.colour.map(|power| power / (mean * mean));
            }
            // The last three are ln B_0 of the channels.
            for feature in judged.unbiased.iter_mut().rev().take(3) {
                *feature -= 2.0 * mean.ln();
            }
        }
        self
    }
}

/// The plan of what a [`Model`](super::Model) reads off pictures of one viewpoint; cheap to make.
///
/// ```
/// use lobes::inference::LogReader;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let features = LogReader::new(Viewpoint::Orthographic)?.features(&image)?;
/// assert_eq!(features.len(), LogReader::FEATURES);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LogReader {
    layout: RingLayout,
    bands: LogBands,
    mirrored: MirroredLight,
    residual: ShadingResidual,
}

impl LogReader {
    /// How many features there are.
    pub const FEATURES: usize = Self::OF_COLOUR + 2;

    /// Where those of the mean colour start.
    const OF_COLOUR: usize =
        LogBands::FEATURES + MirroredLight::FEATURES + ShadingResidual::FEATURES;

    /// Whether a feature is of no use in a picture without colour.
    pub(super) fn needs_colour(feature: usize) -> bool {
        match feature.checked_sub(LogBands::FEATURES) {
            None => LogBands::needs_colour(feature),
            Some(beyond) => {
                (MirroredLight::OF_LUMINANCE..MirroredLight::FEATURES).contains(&beyond)
                    || feature >= Self::OF_COLOUR
            }
        }
    }

    /// The plan.
    ///
    /// # Errors
    /// A camera inside the sphere.
    pub fn new(viewpoint: Viewpoint) -> Result<Self> {
        let layout = RingLayout::new(viewpoint, Reader::RINGS, Reader::ORDERS)?;
        Ok(Self {
            bands: LogBands::new(&layout)?,
            mirrored: MirroredLight::new(&layout)?,
            residual: ShadingResidual::new(&layout)?,
            layout,
        })
    }

    /// [`LogBands`], [`MirroredLight`] and [`ShadingResidual`] of a picture and ln R/G and ln B/G
    /// of its mean: all that the classifier `log-bands` uses where the exposure is unknown.
    ///
    /// # Errors
    /// Pictures that are black or too small.
    pub fn features(&self, image: &SphereImage) -> Result<Vec<f64>> {
        let mut features = self.of(&Unwrapped::new(image, &self.layout)?)?;
        features.extend(chromaticity(image.mean()));
        Ok(features)
    }

    /// [`LogBands`], [`MirroredLight`] and [`ShadingResidual`].
    fn of(&self, picture: &Unwrapped) -> Result<Vec<f64>> {
        let mut features = self.bands.of(picture)?;
        features.extend(self.mirrored.of(picture)?);
        features.extend(self.residual.of(picture)?);
        Ok(features)
    }
}

/// What [`GaussianEvidence`](super::GaussianEvidence) is taken of.
///
/// ```
/// use lobes::inference::EvidenceReader;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # // A ball that is brighter on the upper right.
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let reader = EvidenceReader::new(Viewpoint::Orthographic)?;
/// let reading = reader.read(&image)?;
/// // The mean of green is 1 on every ring.
/// assert!(reading.channels[1].cosine(0).iter().all(|mean| (mean - 1.0).abs() < 1e-6));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct EvidenceReading {
    /// The rings' amplitudes of each channel.
    pub channels: [Modes; 3],
    /// Those of the luminance.
    pub luminance: Modes,
    /// Where small bright lights may be.
    pub lights: BrightLights,
}

/// The plan of an [`EvidenceReading`] of pictures of one viewpoint.
///
/// ```
/// use lobes::{inference::EvidenceReader, reflection::Viewpoint};
/// let reader = EvidenceReader::new(Viewpoint::Orthographic)?;
/// assert_eq!(reader.layout().orders(), EvidenceReader::ORDERS);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct EvidenceReader {
    layout: RingLayout,
}

impl EvidenceReader {
    /// The largest order of the amplitudes.
    pub const ORDERS: usize = 24;

    /// The plan.
    ///
    /// # Errors
    /// A camera inside the sphere.
    pub fn new(viewpoint: Viewpoint) -> Result<Self> {
        Self::within(viewpoint, RingLayout::LARGEST_RADIUS)
    }

    /// The plan for pictures of which what lies within `radius` counts: [`RingLayout::within`].
    ///
    /// # Errors
    /// A camera inside the sphere; a radius that is not above 0.
    pub fn within(viewpoint: Viewpoint, radius: f64) -> Result<Self> {
        let layout = RingLayout::within(viewpoint, Reader::RINGS, Self::ORDERS, radius)?;
        Ok(Self { layout })
    }

    /// The rings.
    pub fn layout(&self) -> &RingLayout {
        &self.layout
    }

    /// Reads a picture.
    ///
    /// # Errors
    /// Pictures that are too small.
    pub fn read(&self, image: &SphereImage) -> Result<EvidenceReading> {
        self.of(&Unwrapped::new(image, &self.layout)?)
    }

    fn of(&self, picture: &Unwrapped) -> Result<EvidenceReading> {
        let all = |[r, g, b]: [f64; 3]| [r, g, b, Luminance::Rec709.of([r, g, b])];
        let [r, g, b, luminance] = Modes::of(picture, &self.layout, all)?;
        Ok(EvidenceReading {
            channels: [r, g, b],
            luminance,
            lights: BrightLights::of(picture, &self.layout),
        })
    }
}

/// The plans of everything that is read off pictures of one viewpoint.
///
/// ```
/// use lobes::inference::Reader;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # // A ball that is brighter on the upper right.
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let reading = Reader::new(Viewpoint::Orthographic)?.read(&image, false)?;
/// assert_eq!(reading.log_amplitudes.len(), Reader::LOG_ORDERS + 1);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Reader {
    log: LogReader,
    evidence: EvidenceReader,
    paper: [ImageSpectrum; 3],
    unbiased: UnbiasedBands,
    needlets: Needlets,
    basis: DMatrix<f64>,
}

impl Reader {
    /// The continuations under which the paper's features have odd degrees.
    pub const CONTINUATIONS: [Continuation; 3] = [
        Continuation::Mirror,
        Continuation::HalfTurn,
        Continuation::Zero,
    ];

    /// Rings of the unwrapped picture.
    pub const RINGS: usize = 64;

    /// The largest order about the line of sight.
    pub const ORDERS: usize = 32;

    /// Radial functions of the log-radiance amplitudes.
    pub const FUNCTIONS: usize = 24;

    /// The largest order of the log-radiance amplitudes.
    pub const LOG_ORDERS: usize = 24;

    /// The plans.
    ///
    /// # Errors
    /// A camera inside the sphere.
    pub fn new(viewpoint: Viewpoint) -> Result<Self> {
        let plan = |continuation| ImageSpectrum::new(TOP_DEGREE, continuation);
        let [a, b, c] = Self::CONTINUATIONS;
        Ok(Self {
            evidence: EvidenceReader::new(viewpoint)?,
            paper: [plan(a)?, plan(b)?, plan(c)?],
            unbiased: UnbiasedBands::new()?,
            needlets: Needlets::new()?,
            basis: cosine_basis(Self::RINGS, Self::FUNCTIONS),
            log: LogReader::new(viewpoint)?,
        })
    }

    /// The rings of [`JudgedReading::evidence`].
    pub fn evidence_layout(&self) -> &RingLayout {
        self.evidence.layout()
    }

    /// Reads a picture; `judged` asks for [`Reading::judged`] too.
    ///
    /// # Errors
    /// Pictures that are black, flat or too small.
    pub fn read(&self, image: &SphereImage, judged: bool) -> Result<Reading> {
        let unwrapped = Unwrapped::new(image, &self.log.layout)?;
        let fields = log_fields(&unwrapped)?;
        let [log] = Modes::of(&unwrapped, &self.log.layout, |rgb| [fields.at(rgb)[0]])?;
        let log_amplitudes = (0..=Self::LOG_ORDERS)
            .map(|m| {
                let columns = if m == 0 { 1 } else { 2 };
                let both = log.cosine(m).iter().chain(log.sine(m)).copied();
                let rings = DMatrix::from_iterator(Self::RINGS, columns, both);
                self.basis.tr_mul(&rings)
            })
            .collect();
        let judged = if judged {
            let [a, b, c] = &self.paper;
            Some(JudgedReading {
                paper: [
                    PaperFeatures::of_image(a, image)?,
                    PaperFeatures::of_image(b, image)?,
                    PaperFeatures::of_image(c, image)?,
                ],
                unbiased: self.unbiased.of(image)?,
                evidence: self.evidence.of(&unwrapped)?,
                image: image.clone(),
            })
        } else {
            None
        };
        Ok(Reading {
            dror: DrorFeatures::of(&unwrapped)?,
            needlets: self.needlets.of(image)?,
            bands: self.log.of(&unwrapped)?,
            mean: image.mean(),
            log_amplitudes,
            judged,
        })
    }
}

/// The colour of a picture apart from its brightness: ln R/G and ln B/G of its mean.
///
/// Each channel is taken as 10⁻¹² at least, so that a black one gives a finite number.
pub fn chromaticity(mean: [f64; 3]) -> [f64; 2] {
    let [r, g, b] = mean.map(|value| value.max(1e-12).ln());
    [r - g, b - g]
}
