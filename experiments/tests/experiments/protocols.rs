//! What classifiers read and learn, where the answer is known: invariances, closed forms, and
//! models that are true.

use lobes::features::{DrorFeatures, Needlets, RingLayout, UnbiasedBands, Unwrapped};
use lobes::glam::DVec3;
use lobes::illumination::EnvironmentMap;
use lobes::inference::{
    Dataset, Discriminant, Expert, JudgedPosteriors, LearnedPosterior, LogReader, Observation,
    Plan, Posterior, Reader, Reflectance, Sample,
};
use lobes::reflectance::{Finish, Variant, presets};
use lobes::reflection::{Camera, Settings, SphereImage, Viewpoint};
use lobes::{Error, Parallelism};
use lobes_experiments::{Calibration, Harness, Method, Protocol};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn normal(rng: &mut Pcg64) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Blobs of colour on a sphere, and the same picture a quarter of a turn on.
fn pictures(size: usize) -> [SphereImage; 2] {
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let radiance = |n: DVec3| {
        let blob = |x: f64, y: f64, z: f64, k: f64| (k * (n.dot(DVec3::new(x, y, z)) - 1.0)).exp();
        [
            0.2 + blob(0.6, 0.0, 0.8, 40.0),
            0.3 + 2.0 * blob(-0.48, 0.64, 0.6, 200.0),
            0.25 + 0.5 * blob(0.0, -0.8, 0.6, 10.0),
        ]
    };
    let image = |turn: &dyn Fn(DVec3) -> DVec3| {
        let pixels = (0..size * size)
            .map(|i| {
                let point = camera.pixel(size, i / size, i % size);
                point.map_or([0.0; 3], |point| radiance(turn(point.normal)))
            })
            .collect();
        SphereImage::new(camera, size, pixels).unwrap()
    };
    [image(&|n| n), image(&|n| DVec3::new(-n.y, n.x, n.z))]
}

fn close(a: &[f64], b: &[f64], bound: f64) {
    assert_eq!(a.len(), b.len());
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < bound, "{i}: {a} and {b}");
    }
}

/// An exposure changes no feature that must not use it; a quarter turn, for which pixels are
/// square, changes none but Dror's, whose wavelets are not blind to a shift along the ring.
#[test]
fn features_do_not_notice_exposure_or_a_quarter_turn() {
    let [image, turned] = pictures(64);
    let brighter = image.map(|rgb| rgb.map(|value| 8.0 * value));
    let layout = RingLayout::new(Viewpoint::Orthographic, 64, 32).unwrap();
    let unwrapped = |image: &SphereImage| Unwrapped::new(image, &layout).unwrap();

    let reader = LogReader::new(Viewpoint::Orthographic).unwrap();
    let bands = reader.features(&image).unwrap();
    close(&bands, &reader.features(&brighter).unwrap(), 1e-9);
    close(&bands, &reader.features(&turned).unwrap(), 1e-9);

    let needlets = Needlets::new().unwrap();
    let of = needlets.of(&image).unwrap();
    close(&of, &needlets.of(&brighter).unwrap(), 1e-8);
    close(&of, &needlets.of(&turned).unwrap(), 1e-8);

    let unbiased = UnbiasedBands::new().unwrap();
    let of = unbiased.of(&image).unwrap();
    close(&of[..8], &unbiased.of(&brighter).unwrap()[..8], 1e-9);
    close(&of, &unbiased.of(&turned).unwrap(), 1e-8);

    let dror = DrorFeatures::of(&unwrapped(&image)).unwrap();
    let other = DrorFeatures::of(&unwrapped(&brighter)).unwrap();
    close(&dror.statistics, &other.statistics, 1e-9);
    assert!((other.brightness - dror.brightness - 8f64.ln()).abs() < 1e-12);
    let other = DrorFeatures::of(&unwrapped(&turned)).unwrap();
    close(&dror.statistics[..6], &other.statistics[..6], 1e-9);
}

/// What is read without an exposure is what is read off the picture over its mean.
#[test]
fn a_reading_without_exposure_is_that_of_the_scaled_picture() {
    let [image, _] = pictures(48);
    let reader = Reader::new(Viewpoint::Orthographic).unwrap();
    let brighter = image.map(|rgb| rgb.map(|value| 8.0 * value));
    let a = reader.read(&image, true).unwrap().without_exposure();
    let b = reader.read(&brighter, true).unwrap().without_exposure();
    close(&a.mean, &b.mean, 1e-12);
    let (a, b) = (a.judged.unwrap(), b.judged.unwrap());
    close(&a.unbiased, &b.unbiased, 1e-9);
    for (a, b) in a.paper.iter().zip(&b.paper) {
        for (a, b) in a.to_array().iter().zip(b.to_array()) {
            // v7 is a degree and may be 0.
            assert!((a - b).abs() <= 1e-9 * b.abs(), "{a} and {b}");
        }
    }
}

#[test]
fn black_pictures_are_refused() {
    let [image, _] = pictures(48);
    let black = image.map(|_| [0.0; 3]);
    let message = LogReader::new(Viewpoint::Orthographic)
        .unwrap()
        .features(&black)
        .unwrap_err();
    assert!(message.to_string().contains("black"), "{message}");
    assert!(Needlets::new().unwrap().of(&black).is_err());
    assert!(UnbiasedBands::new().unwrap().of(&black).is_err());
    let reader = Reader::new(Viewpoint::Orthographic).unwrap();
    assert!(reader.read(&black, true).is_err());
}

/// Observations (illumination, label, features).
fn dataset(rows: &[(usize, usize, Vec<f64>)], labels: usize) -> Dataset<Vec<f64>> {
    let illuminations = 1 + rows.iter().map(|row| row.0).max().unwrap();
    Dataset {
        materials: (0..labels).map(|i| format!("material {i}")).collect(),
        illuminations: (0..illuminations).map(|i| format!("light {i}")).collect(),
        scenes: Default::default(),
        observations: rows
            .iter()
            .map(|(illumination, material, features)| Observation {
                material: *material,
                illumination: *illumination,
                turn: 0,
                view: features.clone(),
            })
            .collect(),
        render_error: 0.0,
    }
}

/// Shrunk to the diagonal the discriminant is a sum over features: ln p ∝ −½ Σ (x − μ)²/s², with s²
/// the pooled variance.
#[test]
fn a_discriminant_in_closed_form() {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut rows = Vec::new();
    for i in 0..60 {
        let label = i % 3;
        let means = [[0.0, 5.0], [1.0, 4.0], [-1.0, 7.0]];
        let noise = [normal(&mut rng), 2.0 * normal(&mut rng)];
        rows.push((
            i / 15,
            label,
            vec![means[label][0] + noise[0], means[label][1] + noise[1]],
        ));
    }
    let data = dataset(&rows, 3);
    let discriminant = Discriminant::new("two", &data, 1.0, Vec::clone).unwrap();
    let seen = [true, true, true, false];
    let test: Vec<usize> = (45..60).collect();
    let judged = discriminant.judge(&seen, &test).unwrap();
    let training = &rows[..45];
    let mut means = [[0.0; 2]; 3];
    for (_, label, x) in training {
        for k in 0..2 {
            means[*label][k] += x[k] / 15.0;
        }
    }
    let mut variance = [0.0; 2];
    for (_, label, x) in training {
        for k in 0..2 {
            variance[k] += (x[k] - means[*label][k]).powi(2) / 45.0;
        }
    }
    for (scores, &i) in judged.iter().zip(&test) {
        let square = |label: usize| -> f64 {
            (0..2)
                .map(|k| (rows[i].2[k] - means[label][k]).powi(2) / variance[k])
                .sum()
        };
        let logs: Vec<f64> = (0..3).map(|label| -0.5 * square(label)).collect();
        let total = logs.iter().map(|x| x.exp()).sum::<f64>().ln();
        for (score, log) in scores.iter().zip(logs) {
            assert!(
                (score - (log - total)).abs() < 1e-6,
                "{score} {}",
                log - total
            );
        }
    }
    // A material that was never seen.
    let error = discriminant.judge(&[false; 4], &test).unwrap_err();
    let none = matches!(
        error,
        Error::TooFew {
            got: 0,
            needed: 1,
            ..
        }
    );
    assert!(none, "{error}");
}

/// Samples whose features are the model's own functions and Gaussian noise: posteriors are honest
/// and find the truth.
#[test]
fn a_posterior_is_honest_where_its_model_is_true() {
    let mut rng = Pcg64::seed_from_u64(5);
    let mut samples = Vec::new();
    for i in 0..600 {
        let share = rng.random::<f64>();
        // As the prior has it: the coverage is that of the intervals only if truths are drawn from
        // it.
        let sigma = 0.015 * (0.4f64 / 0.015).powf(rng.random());
        let noise = 0.3;
        let features = vec![
            (share + 0.03).ln() + noise * normal(&mut rng),
            sigma.ln() + noise * normal(&mut rng),
            share - 0.5 * sigma.ln() + noise * normal(&mut rng),
            noise * normal(&mut rng),
        ];
        samples.push(Sample {
            illumination: i / 100,
            judged: true,
            truth: Reflectance { share, sigma },
            view: features,
        });
    }
    let learned = LearnedPosterior::new(
        &samples,
        &Posterior::default_shares(),
        &Posterior::default_sigmas(),
    )
    .unwrap();
    // Evidence that knows ln σ to 0.2, and nothing of the share.
    let evidence: Vec<Option<Vec<f64>>> = samples
        .iter()
        .map(|sample| {
            let seen = sample.truth.sigma.ln() + 0.2 * normal(&mut rng);
            let of = |sigma: f64| -0.5 * ((sigma.ln() - seen) / 0.2).powi(2);
            let row = |sigma: f64| vec![of(sigma); Posterior::default_shares().len()];
            Some(
                Posterior::default_sigmas()
                    .into_iter()
                    .flat_map(row)
                    .collect(),
            )
        })
        .collect();
    let results = learned
        .leave_one_illumination_out(&evidence, Parallelism::Sequential)
        .unwrap();
    let of = |posterior: fn(&JudgedPosteriors) -> &Posterior| {
        let posteriors: Vec<_> = results.iter().map(|r| (r.truth, posterior(r))).collect();
        Calibration::of(&posteriors)
    };
    let (calibration, both) = (of(|r| &r.learned), of(|r| &r.both));
    // Noise of 0.2 has a median error of 0.135; together with what was learned it is less, and the
    // share is as it was.
    assert!(
        both.sigma_error < of(|r| &r.evidence).sigma_error,
        "{both:?}"
    );
    assert!(of(|r| &r.evidence).sigma_error < 0.15);
    assert!((both.share_error / calibration.share_error - 1.0).abs() < 0.05);
    assert!(
        learned
            .leave_one_illumination_out(&evidence[1..], Parallelism::Sequential)
            .is_err()
    );
    let none = vec![None; 600];
    assert!(
        learned
            .leave_one_illumination_out(&none, Parallelism::Sequential)
            .is_err()
    );
    assert_eq!(calibration.count, 600);
    // A noise of 0.3 in ln σ has a median error of 0.2; the third feature helps.
    assert!(calibration.sigma_error < 0.22, "{calibration:?}");
    // A coverage of 0.5 over 600 has a standard deviation of 0.02. The grid's cells, 0.17 wide in
    // ln σ where a posterior is 0.2, widen the outer intervals by 0.035: on a grid four times finer
    // coverages are off by − 0.055 … + 0.01.
    for &(level, sigma, share) in &calibration.coverage {
        assert!(
            (sigma - level).abs() < 0.065 && (share - level).abs() < 0.065,
            "{calibration:?}"
        );
    }
    assert!(
        learned
            .learn(&[true, false, false, false, false, false])
            .is_err()
    );
}

/// Three small lights of noise.
fn lights() -> Vec<EnvironmentMap> {
    let mut rng = Pcg64::seed_from_u64(9);
    (0..3)
        .map(|i| {
            let pixels = (0..64 * 32)
                .map(|_| std::array::from_fn(|_| 0.2 + 3.0 * rng.random::<f64>().powi(4)))
                .collect();
            EnvironmentMap::new(format!("noise {i}"), 64, 32, pixels).unwrap()
        })
        .collect()
}

/// Every method under a protocol names every picture of turn 0 once, and by finish no fewer than by
/// name.
#[test]
fn every_method_runs_and_counts_by_finish() {
    let maps = lights();
    let materials = presets();
    let plan = Plan {
        lobe: Variant::RadianceSampled,
        settings: Settings {
            size: 32,
            tolerance: 1e-2,
            ..Settings::default()
        },
        turns: 2,
    };
    let two = Parallelism::Rayon;
    let mut paper =
        Harness::new(Protocol::Paper, &maps, &materials, &plan, 1, two, &|| ()).unwrap();
    let [matte, plastic] = [Finish::Matte, Finish::GlossyPlastic];
    let [rough, smooth] = [Finish::RoughMetal, Finish::SmoothMetal];
    let finishes = [
        matte, matte, plastic, plastic, plastic, rough, smooth, smooth,
    ];
    assert_eq!(paper.finishes(), finishes);
    let unprepared = paper.evaluate(Method::Combined, two);
    assert!(unprepared.is_err());
    paper.prepare(&Method::ALL, &maps, &plan, two).unwrap();
    let blind = paper.blind();
    // Three maps say nothing of how much the colour of light varies.
    assert!(matches!(
        blind.colour_ceilings(),
        Err(lobes::Error::TooFew { .. })
    ));
    for method in Method::ALL {
        let evaluation = blind.evaluate(method, two).unwrap();
        assert_eq!(evaluation.total(), 24, "{method}");
        assert_eq!(evaluation.observations, blind.dataset().judged());
        let counted = evaluation.truth.iter().zip(&evaluation.said);
        let right = counted.filter(|(truth, said)| finishes[**truth] == finishes[**said]);
        assert_eq!(evaluation.correct_finish(&finishes), right.count());
        assert_eq!(evaluation.correct_finish(&[]), evaluation.correct());
        // The same again, on one thread.
        let again = blind.evaluate(method, Parallelism::Sequential).unwrap();
        assert_eq!(evaluation, again, "{method}");
    }
}

/// The README repeats a few numbers of the table in docs/explanation/inference.md, which `lobes
/// reproduce --write` makes.
#[test]
fn the_readme_has_the_numbers_of_the_table() {
    let root = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let read = |name: &str| std::fs::read_to_string(root.join(name)).unwrap();
    let (readme, docs) = (read("README.md"), read("docs/explanation/inference.md"));
    let cells = |line: &str| -> Vec<String> {
        line.trim_matches('|')
            .split('|')
            .map(|cell| cell.trim().to_owned())
            .collect()
    };
    let row = |protocol: &str, classifier: &str| {
        let start = format!("| {protocol} | {classifier} |");
        let line = docs.lines().find(|line| line.starts_with(&start));
        cells(line.unwrap_or_else(|| panic!("no row {start}")))
    };
    for protocol in ["paper", "blind", "tilted", "photograph"] {
        let (paper, ours) = (row(protocol, "paper"), row(protocol, "combined"));
        let line = readme
            .lines()
            .find(|line| line.starts_with(&format!("| `{protocol}`:")));
        let said = cells(line.unwrap_or_else(|| panic!("no row of {protocol} in the README")));
        let count = |row: &[String]| format!("{} = {} ({})", row[2], row[3], row[4]);
        let expected = [count(&paper), count(&ours), ours[5].clone()];
        assert_eq!(said[2..], expected, "{protocol}");
    }
}
