//! The exponentials of a vector.
//!
//! Both write x = k ln 2 + r with |r| ≤ ln 2/2, sum e^r by its series, and make 2^k by the bits of the
//! exponent.
//!
//! [`exp_of_negative`] is right to 2 ulp: it holds ln 2 in two parts, so that k ln 2 is exact, and
//! goes to r¹³/13!, whose rest is below 2⁻⁵⁷. Past 708, where e^(−x) comes near the smallest normal
//! number, it is 0.
//!
//! [`exponential`] is quicker: r is rounded where x log₂ e is, so that it is good to 10⁻¹⁶ |x| and to
//! what its series leaves out.

use fearless_simd::{Select, f64x8, prelude::*, u64x8};

/// The lanes of a vector.
const LANES: usize = 8;

/// e^(−x) for x ≥ 0: 0 past 708, and to 2 ulp before it. Lanes that are not numbers give anything.
#[inline(always)]
pub(crate) fn exp_of_negative<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    /// ln 2 in two parts, of which the first has 20 trailing zero bits: its product with an
    /// exponent is exact.
    const LN2_HIGH: f64 = f64::from_bits(std::f64::consts::LN_2.to_bits() & !0xf_ffff);
    /// ln 2 − `LN2_HIGH`, from the digits of ln 2 beyond the double.
    const LN2_LOW: f64 = (std::f64::consts::LN_2 - LN2_HIGH) + 2.319_046_813_846_299_6e-17;
    /// 1/n! for n = 2 … 13.
    const INVERSE_FACTORIAL: [f64; 12] = {
        let mut table = [0.5; 12];
        let mut index = 1;
        let mut factorial = 2.0;
        while index < 12 {
            factorial *= (index + 2) as f64;
            table[index] = 1.0 / factorial;
            index += 1;
        }
        table
    };
    let splat = |value: f64| f64x8::splat(simd, value);
    let tiny = x.simd_gt(splat(708.0));
    let x = x.min(splat(708.0));
    let exponent = (x * std::f64::consts::LOG2_E).round_ties_even();
    // e^(−x) = 2^(−exponent) e^r, |r| ≤ ln 2 / 2.
    let r = exponent * LN2_HIGH - x + exponent * LN2_LOW;
    let mut series = splat(INVERSE_FACTORIAL[11]);
    let mut index = 11;
    while index > 0 {
        index -= 1;
        series = series.mul_add(r, splat(INVERSE_FACTORIAL[index]));
    }
    let exp = (series * r).mul_add(r, r) + 1.0;
    let mut powers = [0.0; LANES];
    exponent.store_slice(&mut powers);
    for power in &mut powers {
        // The integer lies in the low bits of 1.5·2⁵² + integer.
        let bits = (6_755_399_441_055_744.0 + (1023.0 - *power)).to_bits();
        *power = f64::from_bits(bits << 52);
    }
    tiny.select(splat(0.0), exp * f64x8::from_slice(simd, &powers))
}

/// eˣ for x ≤ 700 by the series to r^N/N!; about 10⁻³⁰⁸ below −708. To 10⁻¹¹ of its value for N = 9
/// and to 3·10⁻¹³ for N = 10.
#[inline(always)]
pub(crate) fn exponential<S: Simd, const N: usize>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let splat = |value| f64x8::splat(simd, value);
    // A large number whose last bit is 1: adding it rounds to an integer and leaves that integer,
    // biased as an exponent, in the low bits.
    const SHIFT: f64 = 6_755_399_441_055_744.0 + 1023.0;
    let scaled = x.max(splat(-708.0)) * splat(std::f64::consts::LOG2_E);
    let shifted = scaled + splat(SHIFT);
    let fraction = (scaled - (shifted - splat(SHIFT))) * splat(std::f64::consts::LN_2);
    let power: f64x8<S> = (shifted.bitcast::<u64x8<S>>() << 52).bitcast();
    let inverse_factorials = const { inverse_factorials::<N>() };
    let mut sum = splat(inverse_factorials[N - 1]);
    for n in (0..N - 1).rev() {
        sum = sum.mul_add(fraction, splat(inverse_factorials[n]));
    }
    sum.mul_add(fraction, splat(1.0)) * power
}

/// 1/n! for n = 1 … N.
const fn inverse_factorials<const N: usize>() -> [f64; N] {
    let mut table = [1.0; N];
    let mut factorial = 1.0;
    let mut index = 1;
    while index < N {
        factorial *= (index + 1) as f64;
        table[index] = 1.0 / factorial;
        index += 1;
    }
    table
}
