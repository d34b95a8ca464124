//! Directions, frames, quadrature rules, iso-latitude grids and pixel mappings.

mod frame;
mod grid;
mod mapping;

pub use crate::numeric::quadrature::{MAX_NODES, Rule};
pub use frame::{Frame, from_harmonic, to_harmonic};
pub(crate) use frame::{from_map, to_map};
pub use grid::{Grid, Latitudes, MAX_COLUMNS};
pub use mapping::Mapping;
