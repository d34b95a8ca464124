//! The sine and the cosine of small angles, eight at a time.

use fearless_simd::{f64x8, prelude::*};

/// The sine and the cosine of an angle of at most 0.2, to the last digit.
#[inline(always)]
pub(super) fn small_sin_cos<S: Simd>(simd: S, angle: f64x8<S>) -> (f64x8<S>, f64x8<S>) {
    let splat = |value| f64x8::splat(simd, value);
    let square = angle * angle;
    let mut sin = splat(-1.0 / 39_916_800.0);
    for coefficient in [
        1.0 / 362_880.0,
        -1.0 / 5_040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
        1.0,
    ] {
        sin = sin.mul_add(square, splat(coefficient));
    }
    let mut cos = splat(1.0 / 479_001_600.0);
    for coefficient in [
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
        1.0,
    ] {
        cos = cos.mul_add(square, splat(coefficient));
    }
    (sin * angle, cos)
}
