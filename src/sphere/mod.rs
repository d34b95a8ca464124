//! Directions, frames, quadrature rules, iso-latitude grids and pixel mappings.

pub(crate) mod double_double;
mod frame;
mod grid;
mod mapping;
mod rule;

pub use frame::{Frame, from_harmonic, to_harmonic};
pub use grid::{Grid, Latitudes, MAX_COLUMNS};
pub use mapping::Mapping;
pub(crate) use rule::cos_turn;
pub use rule::{MAX_NODES, Rule};
