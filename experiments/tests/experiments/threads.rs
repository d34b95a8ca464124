//! One, two and eight threads give the same bytes.

use lobes::Parallelism;
use lobes::illumination::EnvironmentMap;
use lobes::inference::Plan;
use lobes::reflectance::{Variant, presets};
use lobes::reflection::Settings;
use lobes_experiments::{Harness, Method, Protocol};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn light(height: usize, seed: u64) -> EnvironmentMap {
    let mut generator = Pcg64::seed_from_u64(seed);
    let noise: Vec<f64> = (0..6 * height * height)
        .map(|_| generator.random())
        .collect();
    let pixels = noise.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
    EnvironmentMap::new(format!("noise {seed}"), 2 * height, height, pixels).unwrap()
}

fn bits(values: Vec<f64>) -> Vec<u64> {
    values.into_iter().map(f64::to_bits).collect()
}

#[test]
fn classifiers() {
    let lights = [light(16, 11), light(16, 12), light(16, 13)];
    let materials: Vec<_> = presets().into_iter().step_by(2).collect();
    let plan = Plan {
        lobe: Variant::RadianceSampled,
        settings: Settings {
            size: 24,
            tolerance: 0.1,
            ..Settings::default()
        },
        turns: 2,
    };
    let compute = |threads| {
        let done = || ();
        let mut harness = Harness::new(
            Protocol::Paper,
            &lights,
            &materials,
            &plan,
            1,
            threads,
            &done,
        )
        .unwrap();
        harness
            .prepare(&Method::ALL, &lights, &plan, threads)
            .unwrap();
        let of = |method| harness.evaluate(method, threads).unwrap().scores.concat();
        Method::ALL.into_iter().flat_map(of).collect()
    };
    let alone = bits(compute(Parallelism::Sequential));
    assert!(!alone.is_empty());
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let together = bits(pool.install(|| compute(Parallelism::Rayon)));
        assert!(alone == together, "{threads} threads");
    }
}
