//! Ward's reflectance and Lambert's, in space and in frequency, and the materials made of them.
//!
//! Directions are in the surface's frame: the normal is +z, every direction is a unit vector that points
//! away from the surface. The reference text is `docs/ward.md`.

pub mod approximation;
mod batch;
mod finish;
pub mod fit;
mod gauss;
mod hemisphere;
mod horizon;
mod isotropic;
pub mod lambert;
mod material;
pub mod recover;
mod slope;
mod turn;
mod ward;
mod zonal;

pub use finish::Finish;
pub use isotropic::{IsotropicCoefficients, MAX_ISOTROPIC_DEGREE};
pub use material::{Material, Roughness, presets, presets_as_albedos};
pub use ward::{HORIZON, MIN_SIGMA, Sample, Variant, Ward};
pub use zonal::MAX_ZONAL_DEGREE;
