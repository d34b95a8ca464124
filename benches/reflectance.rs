//! What Ward's lobes cost: one evaluation, one sample, a batch, an albedo, 65 zonal coefficients.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lobes::glam::DVec3;
use lobes::reflectance::{Variant, Ward};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const COUNT: usize = 1024;

fn lobe_benches(criterion: &mut Criterion) {
    let view = DVec3::new(0.6, 0.0, 0.8);
    for variant in Variant::ALL {
        let lobe = Ward::isotropic(variant, 0.1).expect("σ is in the domain");
        let mut rng = Pcg64::seed_from_u64(20_261_122);
        let numbers: Vec<[f64; 2]> = (0..COUNT).map(|_| [rng.random(), rng.random()]).collect();
        let lights: Vec<DVec3> = numbers
            .iter()
            .map(|&u| lobe.sample(view, u).light)
            .collect();
        let mut out = vec![0.0; COUNT];

        let mut group = criterion.benchmark_group(format!("ward/{variant}"));
        group.throughput(Throughput::Elements(COUNT as u64));
        group.bench_function("evaluate", |bencher| {
            bencher.iter(|| {
                for (value, &light) in out.iter_mut().zip(&lights) {
                    *value = lobe.evaluate(black_box(view), light);
                }
                black_box(out[0])
            });
        });
        group.bench_function("evaluate_batch", |bencher| {
            bencher.iter(|| {
                lobe.evaluate_batch(black_box(view), &lights, &mut out)
                    .expect("the lengths agree");
                black_box(out[0])
            });
        });
        group.bench_function("sample", |bencher| {
            bencher.iter(|| {
                numbers
                    .iter()
                    .map(|&u| lobe.sample(black_box(view), u).weight)
                    .sum::<f64>()
            });
        });
        group.finish();

        criterion.bench_function(&format!("ward/{variant}/albedo"), |bencher| {
            bencher.iter(|| lobe.albedo(black_box(0.5)));
        });
    }
    // What the coefficients cost depends on the width and the view, and on the variant by a
    // hundredth.
    let mut group = criterion.benchmark_group("ward/zonal 65");
    for sigma in [0.005, 0.03, 0.1, 0.3, 0.5] {
        let lobe = Ward::isotropic(Variant::Duer, sigma).expect("σ is in the domain");
        for angle in [0.0f64, 30.0, 60.0, 75.0, 85.0, 89.0] {
            group.bench_function(format!("σ {sigma} at {angle}°"), |bencher| {
                bencher.iter(|| lobe.zonal(black_box(angle.to_radians().cos()), 64));
            });
        }
    }
    group.finish();
    criterion.bench_function("ward/new sampled", |bencher| {
        bencher.iter(|| Ward::isotropic(Variant::RadianceSampled, black_box(0.1)));
    });
}

criterion_group!(benches, lobe_benches);
criterion_main!(benches);
