//! Illumination: environment maps, their files and their spectra.

#[cfg(feature = "builtin")]
mod builtin;
mod map;
mod spectrum;

#[cfg(feature = "builtin")]
pub use builtin::builtin;
pub use map::{EnvironmentMap, Luminance};
pub use spectrum::{LightSpectrum, PowerLaw};
