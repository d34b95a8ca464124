//! One view, many lights, eight at a time.

use fearless_simd::{Select, dispatch, f64x8, prelude::*};
use glam::DVec3;

use crate::numeric::exponential::exp_of_negative;
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
            value *= secant2;
        }
        for _ in 0..self.powers.height {
            value *= inverse;
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
        value *= x;
    }
    value
}
