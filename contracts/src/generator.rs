//! The inputs that a snapshot names by a seed: the same numbers as `uniform` of
//! `oracles/snapshot.py`.

use lobes::glam::DVec3;

use lobes::Result;
use lobes::harmonics::Coefficients;
use lobes::illumination::EnvironmentMap;

/// Numbers in [−1, 1): `SplitMix64` (Steele, Lea and Flood 2014,
/// <https://doi.org/10.1145/2660193.2660195>), the top 53 bits of each output.
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

/// `σ_x`, `σ_y`, view and light of a lobe's geometries, as `reflections` of `oracles/snapshot.py`
/// makes them: by +, −, ×, / and √ only, in the same order, so that they are the same doubles.
pub(super) fn reflections(
    seed: u64,
    count: usize,
    anisotropic: bool,
) -> Vec<([f64; 2], DVec3, DVec3)> {
    let width = |u: f64| 0.005 + 0.995 * (u * u * u);
    from_numbers(seed, count, |a, b| {
        let x = width(a);
        [x, if anisotropic { width(b) } else { x }]
    })
}

/// View and light of one lobe's geometries, as `reflections` of `oracles/snapshot.py` makes them
/// for a given σ.
pub(super) fn reflections_of(sigma: f64, seed: u64, count: usize) -> Vec<(DVec3, DVec3)> {
    from_numbers(seed, count, |_, _| [sigma, sigma])
        .into_iter()
        .map(|(_, view, light)| (view, light))
        .collect()
}

fn from_numbers(
    seed: u64,
    count: usize,
    widths: impl Fn(f64, f64) -> [f64; 2],
) -> Vec<([f64; 2], DVec3, DVec3)> {
    let numbers = uniform(seed, 32 * count);
    let (draws, _) = numbers.as_chunks::<8>();
    draws
        .iter()
        .filter_map(|&[a, b, c, graze, x, y, p, q]| {
            let [a, b, c] = [a, b, c].map(|u| 0.5 * (u + 1.0));
            let [sigma_x, sigma_y] = widths(a, b);
            let cosine = if graze < -1.0 / 3.0 {
                1e-6 + 0.1 * (c * c * c * c)
            } else {
                0.1 + 0.9 * c
            };
            let radius = ((1.0 - cosine) * (1.0 + cosine)).sqrt() / (x * x + y * y).sqrt();
            let view = DVec3::new(x * radius, y * radius, cosine);
            let (half_x, half_y) = (2.8 * sigma_x * p, 2.8 * sigma_y * q);
            let twice = 2.0 * (half_x * view.x + half_y * view.y + cosine)
                / (half_x * half_x + half_y * half_y + 1.0);
            let light = DVec3::new(
                twice * half_x - view.x,
                twice * half_y - view.y,
                twice - cosine,
            );
            let length = (light.x * light.x + light.y * light.y + light.z * light.z).sqrt();
            let light = DVec3::new(light.x / length, light.y / length, light.z / length);
            (light.z > 0.0).then_some(([sigma_x, sigma_y], view, light))
        })
        .take(count)
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
        if let Some(index) = coefficients.index(l, m) {
            coefficients.as_mut_slice()[index] = *value;
        }
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
