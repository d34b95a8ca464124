//! Real spherical harmonics: Legendre functions, coefficients, transforms, rotation and spectra.
//!
//! Everything here lives in the harmonic frame: the pole on +z, θ from the pole, φ = atan2(y, x).
//! The harmonics are real, orthonormal over the sphere (∫ Y² dω = 1), without the Condon–Shortley
//! phase:
//!
//! Y_l^m = P̄_lm(cos θ) cos mφ for m ≥ 0 and P̄_l|m|(cos θ) sin |m|φ for m < 0, with
//! P̄_lm = √(2 − δ_m0) √((2l+1)/4π · (l−m)!/(l+m)!) P_l^m, P_l^m ≥ 0 near the north pole.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod apodise;
mod batch_lanes;
mod coefficients;
mod complex;
mod convention;
mod derivative;
mod euler;
mod kaiser_bessel;
mod kernel;
mod lane;
mod least_squares;
pub mod legendre;
mod legendre_table;
mod meridian;
mod own_rings;
mod partial;
mod point;
mod random;
mod recurrence;
mod ring_fft;
mod rotation;
mod scattered;
mod simd;
mod single_recurrence;
mod single_transform;
mod spectrum;
mod splat;
mod stages;
mod transform;
pub mod wigner;
mod work;

pub use apodise::{Apodisation, apodise};
pub use coefficients::{Coefficients, coefficient_count};
pub use complex::ComplexCoefficients;
pub use convention::{Convention, Normalisation, Order, Phase};
pub use derivative::laplacian;
pub use least_squares::LeastSquares;
pub use partial::{Coupling, MAX_CONDITION, MAX_COUPLING_DEGREE, Mask};
pub use point::{Basis, MAX_BASIS_DEGREE, evaluate, evaluate_all};
pub use random::random_field;
pub use rotation::{MAX_ROTATION_DEGREE, Rotation};
pub use scattered::ScatteredTransform;
pub use single_transform::SingleTransform;
pub use spectrum::{
    average_power, convolve_zonal, cross_power, deconvolve_zonal, gaussian_beam, zonal_factor,
};
pub use splat::{MAX_SPLAT_DEGREE, SplatBasis, SplatNumber, SplatRotation};
pub use transform::{MAX_DEGREE, Transform};
