//! One, two and eight threads give the same bytes.

use lobes::Parallelism;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{Basis, Coefficients, Rotation, Transform};
use lobes::illumination::EnvironmentMap;
use lobes::reflectance::{Variant, presets};
use lobes::reflection::{Camera, Renderer, Settings};
use lobes::sphere::Grid;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| generator.random::<f64>()).collect()
}

/// The bytes of a computation on one thread, and on pools of two and of eight.
fn check(name: &str, compute: impl Fn(Parallelism) -> Vec<f64> + Sync) {
    let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<_>>();
    let alone = bits(compute(Parallelism::Sequential));
    assert!(!alone.is_empty());
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let together = bits(pool.install(|| compute(Parallelism::Rayon)));
        assert!(alone == together, "{name} on {threads} threads");
    }
}

#[test]
fn transforms() {
    // A single large map divides by order and ring, a batch of small ones by map or by eight maps.
    for (degree, batch) in [(700, 1), (63, 1), (63, 7), (255, 4), (63, 70)] {
        let grid = Grid::gauss_legendre(degree + 1, 2 * degree + 2).unwrap();
        let transform = Transform::new(&grid, degree).unwrap();
        let count = transform.coefficient_count();
        let coefficients = noise(batch * count, 1);
        let maps = noise(batch * grid.len(), 2);
        check(&format!("synthesis of {batch} to {degree}"), |threads| {
            let mut out = vec![0.0; maps.len()];
            // A pool may be larger than the one that the plan was made on.
            let mut scratch = vec![0.0; transform.scratch_len(batch)];
            transform
                .synthesise_into(batch, &coefficients, &mut out, &mut scratch, threads)
                .unwrap();
            out
        });
        check(&format!("analysis of {batch} to {degree}"), |threads| {
            let mut out = vec![0.0; coefficients.len()];
            let mut scratch = vec![0.0; transform.scratch_len(batch)];
            transform
                .analyse_into(batch, &maps, &mut out, &mut scratch, threads)
                .unwrap();
            out
        });
    }
}

#[test]
fn values_and_rotation() {
    let degree = 40;
    let values = noise((degree + 1) * (degree + 1), 3);
    let coefficients = Coefficients::from_vec(degree, degree, values).unwrap();
    let basis = Basis::new(degree).unwrap();
    let directions: Vec<DVec3> = noise(3 * 5000, 4)
        .chunks(3)
        .map(|v| DVec3::new(v[0] - 0.5, v[1] - 0.5, v[2] - 0.5))
        .collect();
    check("sums", |threads| {
        let mut out = vec![0.0; directions.len()];
        basis
            .sums(&coefficients, &directions, &mut out, threads)
            .unwrap();
        out
    });
    let rotation = Rotation::new(degree).unwrap();
    check("rotation", |threads| {
        let turn = DQuat::from_xyzw(0.1, 0.5, -0.3, 0.8);
        rotation
            .rotate(&coefficients, turn, threads)
            .unwrap()
            .into_vec()
    });
}

#[test]
fn rendering() {
    let pixels = noise(3 * 64 * 32, 5)
        .chunks(3)
        .map(|p| [p[0], p[1], p[2]])
        .collect();
    let map = EnvironmentMap::new("noise", 64, 32, pixels).unwrap();
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let settings = Settings {
        size: 16,
        tolerance: 1e-2,
        ..Settings::default()
    };
    for material in presets().into_iter().step_by(3) {
        check(material.name(), |threads| {
            let renderer = Renderer::new(&map, threads).unwrap();
            let rendering = renderer
                .render(&material, Variant::Duer, &camera, &settings, threads)
                .unwrap();
            let mut values: Vec<f64> = rendering.image.iter().flat_map(|(_, _, p)| p).collect();
            values.push(rendering.error);
            values
        });
    }
}
