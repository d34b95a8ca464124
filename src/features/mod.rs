//! What is computed from one image of a sphere: the paper's features and its rivals'.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod continuation;
mod dror;
mod image_spectrum;
mod log_bands;
mod mirrored_light;
mod needlets;
mod paper;
mod percentiles;
mod rings;
mod shading_outliers;
mod shading_residual;
mod unbiased;

pub use continuation::Continuation;
pub use dror::DrorFeatures;
pub use image_spectrum::{ImagePower, ImageSpectrum};
pub use log_bands::{LogBands, LogFields, log_fields};
pub use mirrored_light::MirroredLight;
pub use needlets::Needlets;
pub use paper::{PaperFeatures, TOP_DEGREE};
pub use rings::{Modes, RingLayout, Unwrapped};
pub use shading_outliers::{Seen, SeenMask, ShadingOutliers};
pub use shading_residual::ShadingResidual;
pub use unbiased::UnbiasedBands;

pub(crate) use log_bands::cosine_basis;
