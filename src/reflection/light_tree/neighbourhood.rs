//! Where a lobe has to bound itself.

use fearless_simd::{f64x8, prelude::*};

/// A complex neighbourhood of a direction: every x + iy with |x − centre| ≤ `still` + `moving` cos
/// φ and |y| ≤ `imaginary` sin φ for some φ from 0 to π/2.
#[derive(Clone, Copy)]
pub(crate) struct Neighbourhood<S: Simd> {
    pub(crate) still: f64x8<S>,
    pub(crate) moving: f64x8<S>,
    pub(crate) imaginary: f64x8<S>,
}

impl<S: Simd> Neighbourhood<S> {
    /// Directions alone, no farther from the centre than `radius`.
    #[inline(always)]
    pub(super) fn real(simd: S, radius: f64x8<S>) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        Self {
            still: radius,
            moving: zero,
            imaginary: zero,
        }
    }
}
