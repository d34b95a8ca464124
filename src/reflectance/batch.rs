//! One view, many lights, eight at a time.

use fearless_simd::{Select, dispatch, f64x8, prelude::*};
use glam::DVec3;

use crate::vectors;

use super::direction::{HORIZON, UNIT_TOLERANCE};
use super::variant::{HalfPower, Powers};

/// How many lights are evaluated at once.
const LANES: usize = 8;

/// What a block of lights needs to know of the lobe and the view.
pub(super) struct Block {
    pub powers: Powers,
    pub inverse_sigma: [f64; 2],
    /// 1/(4π `σ_x` `σ_y`), and what else does not depend on the light.
    pub scale: f64,
    pub view: DVec3,
}

impl Block {
    /// Evaluates the lobe for every light; `out` is as long as `lights`.
    pub(super) fn evaluate(&self, lights: &[DVec3], out: &mut [f64]) {
        let level = vectors::level();
        dispatch!(level, simd => self.evaluate_with(simd, lights, out));
    }

    #[inline(always)]
    fn evaluate_with<S: Simd>(&self, simd: S, lights: &[DVec3], out: &mut [f64]) {
        let (blocks, rest) = lights.as_chunks::<LANES>();
        let (out_blocks, out_rest) = out.as_chunks_mut::<LANES>();
        for (lights, out) in blocks.iter().zip(out_blocks) {
            self.block(simd, lights, out);
        }
        if !rest.is_empty() {
            let mut lights = [DVec3::NEG_Z; LANES];
            lights[..rest.len()].copy_from_slice(rest);
            let mut values = [0.0; LANES];
            self.block(simd, &lights, &mut values);
            out_rest.copy_from_slice(&values[..rest.len()]);
        }
    }

    #[inline(always)]
    fn block<S: Simd>(&self, simd: S, lights: &[DVec3; LANES], out: &mut [f64; LANES]) {
        let splat = |value: f64| f64x8::splat(simd, value);
        let component = |get: fn(&DVec3) -> f64| {
            let mut values = [0.0; LANES];
            for (value, light) in values.iter_mut().zip(lights) {
                *value = get(light);
            }
            f64x8::from_slice(simd, &values)
        };
        let (x, y, z) = (
            component(|light| light.x),
            component(|light| light.y),
            component(|light| light.z),
        );
        let off_unit = (x * x + y * y + z * z - 1.0).abs();
        let inverse = splat(1.0) / (z + self.view.z);
        let x = (x + self.view.x) * inverse;
        let y = (y + self.view.y) * inverse;
        let (p, q) = (x * self.inverse_sigma[0], y * self.inverse_sigma[1]);
        let gaussian = exp_of_negative(simd, p * p + q * q);
        let secant2 = x * x + y * y + 1.0;
        let mut value = gaussian * power(simd, z, self.powers.light);
        for _ in 0..self.powers.secant {
            value = value * secant2;
        }
        for _ in 0..self.powers.height {
            value = value * inverse;
        }
        let visible = z.simd_gt(splat(HORIZON)) & off_unit.simd_le(splat(UNIT_TOLERANCE));
        visible
            .select(value * self.scale, splat(0.0))
            .store_slice(out);
    }
}

/// x^(n/2) for n ≥ 0: no form divides by the light's cosine.
#[inline(always)]
fn power<S: Simd>(simd: S, x: f64x8<S>, power: HalfPower) -> f64x8<S> {
    let mut value = if power.0 % 2 == 0 {
        f64x8::splat(simd, 1.0)
    } else {
        x.sqrt()
    };
    for _ in 0..power.0 / 2 {
        value = value * x;
    }
    value
}

/// e^(−x) for x ≥ 0: 0 past 708, and to 2 ulp before it. Lanes that are not numbers give anything.
#[inline(always)]
pub(super) fn exp_of_negative<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    /// ln 2 in two parts, of which the first has 20 trailing zero bits: its product with an exponent is exact.
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
