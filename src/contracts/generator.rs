//! The inputs that a snapshot names by a seed: the same numbers as `uniform` of `oracles/snapshot.py`.

use crate::Result;
use crate::harmonics::Coefficients;
use crate::illumination::EnvironmentMap;

/// Numbers in [−1, 1): `SplitMix64` (Steele, Lea and Flood 2014, <https://doi.org/10.1145/2660193.2660195>),
/// the top 53 bits of each output.
pub(super) fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^= z >> 31;
            (z >> 11) as f64 * f64::EPSILON - 1.0
        })
        .collect()
}

/// The l and m of each coefficient in the order l² + l + m, in which the snapshots write them.
pub(super) fn degrees_and_orders(degree: usize) -> impl Iterator<Item = (usize, isize)> {
    (0..=degree).flat_map(|l| {
        let l_signed = l as isize;
        (-l_signed..=l_signed).map(move |m| (l, m))
    })
}

/// Coefficients from values in the order l² + l + m.
pub(super) fn coefficients(degree: usize, values: &[f64]) -> Coefficients {
    let mut coefficients = Coefficients::zeros(degree);
    for ((l, m), value) in degrees_and_orders(degree).zip(values) {
        coefficients.set(l, m, *value);
    }
    coefficients
}

/// Coefficients from a seed.
pub(super) fn noise(degree: usize, seed: u64) -> Coefficients {
    coefficients(degree, &uniform(seed, (degree + 1).pow(2)))
}

/// A map from a seed: one more than each number, red, green and blue in turn.
pub(super) fn noisy_map(height: usize, width: usize, seed: u64) -> Result<EnvironmentMap> {
    let pixels = uniform(seed, 3 * height * width)
        .chunks_exact(3)
        .map(|rgb| [rgb[0] + 1.0, rgb[1] + 1.0, rgb[2] + 1.0])
        .collect();
    EnvironmentMap::new("noise", width, height, pixels)
}
