//! Where a lobe has to bound itself.

use fearless_simd::{f64x8, prelude::*};

/// A complex neighbourhood of a direction: every (1 + k) x + κ w + i r e, where x is a real direction
/// no farther from the centre than `real`, as a chord; 0 ≤ k ≤ `growth`, 0 ≤ κ ≤ `shift`, 0 ≤ r ≤
/// `imaginary`; w and e are real and no longer than 1, and e is perpendicular to x.
#[derive(Clone, Copy)]
pub(crate) struct Neighbourhood<S: Simd> {
    pub(crate) real: f64x8<S>,
    pub(crate) growth: f64x8<S>,
    pub(crate) shift: f64x8<S>,
    pub(crate) imaginary: f64x8<S>,
}
