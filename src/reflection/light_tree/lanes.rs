//! Eight numbers at a time: what bounds and sums share.

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

/// eˣ for x ≤ 700, to 3·10⁻¹³ of its value; about 10⁻³⁰⁸ below −708.
#[inline(always)]
pub(super) fn exponential<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    // Adding it rounds to an integer and leaves that integer, biased as an exponent, in the low
    // bits.
    const SHIFT: f64 = 6_755_399_441_055_744.0 + 1023.0;
    let scaled = x.max(splat(-708.0)) * splat(std::f64::consts::LOG2_E);
    let shifted = scaled + splat(SHIFT);
    let fraction = (scaled - (shifted - splat(SHIFT))) * splat(std::f64::consts::LN_2);
    let power: f64x8<S> = (shifted.bitcast::<fearless_simd::u64x8<S>>() << 52).bitcast();
    let mut sum = splat(1.0 / 3_628_800.0);
    for coefficient in [
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ] {
        sum = sum.mul_add(fraction, splat(coefficient));
    }
    sum * power
}
