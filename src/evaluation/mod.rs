//! How far an estimate of light is from the truth: balls under both, and the lights themselves.
//!
//! Whoever estimates light from pictures judges the estimate by what it lights: three balls, a
//! mirror, matte silver and a grey one, are rendered under the true map and under the estimated
//! one, and the pictures are compared. Papers do that with other balls, other masks, other
//! averages and other errors under the same names; a [`Protocol`] says all of it, [`Preset`] names
//! those whose evaluation is public beside the one that this crate recommends, and each
//! [`Measure`] has its definition as a sentence.

mod ball;
mod evaluator;
mod lights;
mod measure;
mod protocol;

pub use ball::{Ball, BallRenderer, Gloss};
pub use evaluator::{Evaluation, Evaluator};
pub use lights::{LIGHT_MEASURES, LightErrors};
pub use measure::Measure;
pub use protocol::{Average, Preset, Protocol, ToneMap};
