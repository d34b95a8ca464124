//! Reading a picture, learning, and the posterior of one picture.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use lobes::Parallelism;
use lobes::features::{Continuation, ImageSpectrum, PaperFeatures, TOP_DEGREE};
use lobes::glam::DVec3;
use lobes::inference::{
    EvidenceReader, LearnedPosterior, LogReader, Posterior, Reader, Reflectance, ReflectanceGrid,
    Sample,
};
use lobes::reflectance::Variant;
use lobes::reflection::{Camera, SphereImage, Viewpoint};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A sphere of 128² pixels with structure of every size.
fn picture() -> SphereImage {
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let mut rng = Pcg64::seed_from_u64(1);
    let pixels = (0..128 * 128).map(|_| std::array::from_fn(|_| 0.1 + rng.random::<f64>()));
    SphereImage::new(camera, 128, pixels.collect()).unwrap()
}

fn features(criterion: &mut Criterion) {
    let image = picture();
    let mut group = criterion.benchmark_group("features of 128²");
    let spectrum = ImageSpectrum::new(TOP_DEGREE, Continuation::Mirror).unwrap();
    group.bench_function("the paper's", |bencher| {
        bencher.iter(|| black_box(PaperFeatures::of_image(&spectrum, &image).unwrap()));
    });
    let reader = LogReader::new(Viewpoint::Orthographic).unwrap();
    group.bench_function("log bands", |bencher| {
        bencher.iter(|| black_box(reader.features(&image).unwrap()));
    });
    let reader = Reader::new(Viewpoint::Orthographic).unwrap();
    group.bench_function("all", |bencher| {
        bencher.iter(|| black_box(reader.read(&image, true).unwrap()));
    });
    group.finish();
}

fn posterior(criterion: &mut Criterion) {
    let mut rng = Pcg64::seed_from_u64(2);
    let samples: Vec<Sample<Vec<f64>>> = (0..1600)
        .map(|i| {
            let truth = Reflectance {
                share: rng.random(),
                sigma: 0.02 * 15f64.powf(rng.random()),
            };
            let at = [truth.share, truth.sigma.ln()];
            let view = (0..LogReader::FEATURES)
                .map(|k| at[k % 2] * (k as f64).sin() + rng.random::<f64>());
            Sample {
                illumination: i % 16,
                judged: true,
                truth,
                view: view.collect(),
            }
        })
        .collect();
    let (shares, sigmas) = (Posterior::default_shares(), Posterior::default_sigmas());
    let mut group = criterion.benchmark_group("posterior");
    group.sample_size(10);
    group.bench_function("moments and the inner loop", |bencher| {
        bencher.iter(|| {
            let learned = LearnedPosterior::new(&samples, &shares, &sigmas).unwrap();
            black_box(learned.learn(&[true; 16]).unwrap())
        });
    });
    let learned = LearnedPosterior::new(&samples, &shares, &sigmas).unwrap();
    let model = learned.learn(&[true; 16]).unwrap();
    group.bench_function("500 points", |bencher| {
        bencher.iter(|| black_box(model.posterior(&samples[0].view).unwrap()));
    });
    group.finish();
}

fn evidence(criterion: &mut Criterion) {
    let image = picture();
    let reader = EvidenceReader::new(Viewpoint::Orthographic).unwrap();
    let make = || {
        let variant = Variant::RadianceSampled;
        ReflectanceGrid::of_view(variant, reader.layout(), Parallelism::Sequential).unwrap()
    };
    let mut group = criterion.benchmark_group("evidence");
    group.sample_size(10);
    group.bench_function("factors of 500 points, two spectra", |bencher| {
        bencher.iter(|| black_box(make()));
    });
    group.bench_function("reading a picture", |bencher| {
        bencher.iter(|| black_box(reader.read(&image).unwrap()));
    });
    let (grid, reading) = (make(), reader.read(&image).unwrap());
    group.bench_function("500 points, two spectra, ten lights", |bencher| {
        bencher.iter(|| {
            let logs = grid.log_likelihoods(&reading.luminance, &reading.lights);
            black_box(logs.unwrap())
        });
    });
    group.finish();
}

criterion_group!(benches, features, posterior, evidence);
criterion_main!(benches);
