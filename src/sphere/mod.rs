//! Directions, frames, quadrature rules, iso-latitude grids and pixel mappings.

mod frame;

pub use frame::{Frame, from_harmonic, to_harmonic};
