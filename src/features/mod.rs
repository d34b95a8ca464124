//! What is computed from one image of a sphere: the paper's features and its rivals'.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod continuation;
mod image_spectrum;
mod paper;

pub use continuation::Continuation;
pub use image_spectrum::{ImagePower, ImageSpectrum};
pub use paper::{PaperFeatures, TOP_DEGREE};
