//! Ward's reflectance, Lambert's and the GGX microfacet lobe, in space and in frequency, and the
//! materials made of them.
//!
//! Directions are in the surface's frame: the normal is +z, every direction is a unit vector that
//! points away from the surface. The reference texts are `docs/reference/ward.md` and
//! `docs/reference/ggx.md`.

pub mod approximation;
mod batch;
mod direction;
mod finish;
pub mod fit;
mod fresnel;
mod ggx;
mod ggx_integral;
mod ggx_material;
mod hemisphere;
mod horizon;
mod isotropic;
pub mod lambert;
mod material;
pub mod recover;
mod slope;
mod variant;
mod ward;
mod zonal;

pub use direction::HORIZON;
pub use finish::Finish;
pub use fresnel::{Fresnel, MAX_INDEX, MIN_INDEX};
pub use ggx::{Ggx, MIN_ALPHA};
pub use ggx_integral::Masking;
pub use ggx_material::GgxMaterial;
pub use isotropic::{IsotropicCoefficients, MAX_ISOTROPIC_DEGREE};
pub use material::{Material, Roughness, presets, presets_as_albedos};
pub use variant::Variant;
pub use ward::{MIN_SIGMA, Sample, Ward};
pub use zonal::MAX_ZONAL_DEGREE;
