//! Illumination: environment maps, their files and their spectra.

mod adaptation;
#[cfg(feature = "builtin")]
mod builtin;
mod convert;
mod map;
#[cfg(feature = "files")]
mod read;
mod spectrum;

pub use adaptation::ChromaticAdaptation;
#[cfg(feature = "builtin")]
pub use builtin::{builtin, builtin_names};
pub use map::{EnvironmentMap, Luminance};
#[cfg(feature = "files")]
pub use read::{read, read_bytes, read_folder};
pub use spectrum::{LightSpectrum, PowerLaw};
