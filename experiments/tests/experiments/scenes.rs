//! What is of one scene is left out together, everywhere.

use lobes::inference::{
    Dataset, Expert, LearnedPosterior, Observation, Posterior, Reflectance, Sample, Scenes, Stack,
};
use lobes::{Error, Parallelism, Result};
use lobes_experiments::{NearestNeighbour, leave_one_illumination_out};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Pictures whose light decides almost everything: of each illumination of `places` (equal numbers
/// are one map twice), one of each of two materials.
fn pictures(places: &[u64], scenes: Scenes) -> Dataset<Vec<f64>> {
    let mut observations = Vec::new();
    for (illumination, &place) in places.iter().enumerate() {
        let mut rng = Pcg64::seed_from_u64(place);
        let light: Vec<f64> = (0..3).map(|_| 10.0 * rng.random::<f64>()).collect();
        for material in 0..2 {
            let mut view = light.clone();
            view[0] += 0.2 * material as f64;
            view[1] += 0.1 * rng.random::<f64>();
            observations.push(Observation {
                material,
                illumination,
                turn: 0,
                view,
            });
        }
    }
    Dataset {
        materials: vec!["a".into(), "b".into()],
        illuminations: places.iter().map(u64::to_string).collect(),
        scenes,
        observations,
        render_error: 0.0,
    }
}

/// Every map twice: a nearest neighbour is always right, and no better than without the copies once
/// they are left out too.
#[test]
fn maps_that_stand_twice_leak_and_scenes_do_not() {
    let once: Vec<u64> = (0..12).collect();
    let twice: Vec<u64> = once.iter().flat_map(|&place| [place, place]).collect();
    let groups: Vec<[String; 2]> = (0..12)
        .map(|i| [format!("{}", 2 * i), format!("{}", 2 * i + 1)])
        .collect();
    let names: Vec<String> = (0..24).map(|i| i.to_string()).collect();
    let pairs = Scenes::from_groups(&names, &groups).unwrap();
    let accuracy = |data: &Dataset<Vec<f64>>| {
        let features = data.observations.iter().map(|o| o.view.clone()).collect();
        let nearest = NearestNeighbour::plain(features, &data.labels(), 2).unwrap();
        let one = Parallelism::Sequential;
        leave_one_illumination_out(&nearest, &data.labels(), &data.groups(), 2, one)
            .unwrap()
            .accuracy()
    };
    let honest = accuracy(&pictures(&once, Scenes::default()));
    assert!(honest < 0.8, "the light decides: {honest}");
    assert_eq!(accuracy(&pictures(&twice, Scenes::default())), 1.0);
    assert_eq!(accuracy(&pictures(&twice, pairs)), honest);
}

/// Refuses to judge a picture of a place that it has seen.
struct Honest<'a> {
    places: &'a [u64],
    data: &'a Dataset<Vec<f64>>,
}

impl Expert for Honest<'_> {
    fn name(&self) -> String {
        "honest".into()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        for &i in observations {
            let place = self.places[self.data.observations[i].illumination];
            let known = |(j, other): (usize, &u64)| seen[j] && *other == place;
            if self.places.iter().enumerate().any(known) {
                return Err(Error::Undefined {
                    of: "a scene that was seen",
                    what: "place here",
                    reason: "the fold must leave it out",
                });
            }
        }
        Ok(vec![vec![0.0; 2]; observations.len()])
    }
}

#[test]
fn inner_loops_leave_scenes_out() {
    let places = [1, 2, 3, 1, 2, 3];
    let names: Vec<String> = (0..6).map(|i| i.to_string()).collect();
    let groups = [["0", "3"], ["1", "4"], ["2", "5"]];
    let pairs = Scenes::from_groups(&names, &groups).unwrap();
    let run = |scenes: &Scenes| {
        let data = pictures(&places, scenes.clone());
        let honest = Honest {
            places: &places,
            data: &data,
        };
        let stack = Stack::new(&data, vec![&honest as &dyn Expert]);
        let one = Parallelism::Sequential;
        leave_one_illumination_out(&stack, &data.labels(), &data.groups(), 2, one)
    };
    assert!(run(&pairs).is_ok());
    assert!(run(&Scenes::default()).is_err());
    // Of two scenes a fold has one, and the inner loop needs two.
    let few = Scenes::from_groups(&names, &[vec!["0", "3", "1", "4"], vec!["2", "5"]]).unwrap();
    assert!(run(&few).is_err());
}

/// A posterior learned from samples that stand twice, their copies left out with them, is the
/// posterior learned from them once.
#[test]
fn posteriors_leave_scenes_out() {
    let samples = |copies: usize| -> Vec<Sample<Vec<f64>>> {
        let mut samples = Vec::new();
        for copy in 0..copies {
            for place in 0..4 {
                let mut rng = Pcg64::seed_from_u64(place as u64);
                let light: f64 = rng.random();
                for i in 0..60 {
                    let truth = Reflectance {
                        share: rng.random(),
                        sigma: 0.02 + 0.28 * rng.random::<f64>(),
                    };
                    let noise = |rng: &mut Pcg64| 0.1 * rng.random::<f64>();
                    let view = vec![
                        truth.sigma.ln() + light + noise(&mut rng),
                        truth.share + light + noise(&mut rng),
                    ];
                    samples.push(Sample {
                        illumination: place + 4 * copy,
                        judged: i % 10 == 0 && copy == 0,
                        truth,
                        view,
                    });
                }
            }
        }
        samples
    };
    let groups: Vec<[String; 2]> = (0..4)
        .map(|i| [i.to_string(), (i + 4).to_string()])
        .collect();
    let names: Vec<String> = (0..8).map(|i| i.to_string()).collect();
    let pairs = Scenes::from_groups(&names, &groups).unwrap();
    let medians = |copies: usize, scenes: &Scenes| -> Vec<f64> {
        let samples = samples(copies);
        let learned = LearnedPosterior::new(
            &samples,
            &Posterior::default_shares(),
            &Posterior::default_sigmas(),
        )
        .unwrap()
        .with_scenes(scenes);
        let grid = Posterior::default_shares().len() * Posterior::default_sigmas().len();
        let evidence: Vec<Option<Vec<f64>>> = samples
            .iter()
            .map(|sample| sample.judged.then(|| vec![0.0; grid]))
            .collect();
        let results = learned
            .leave_one_illumination_out(&evidence, Parallelism::Sequential)
            .unwrap();
        results
            .iter()
            .map(|r| r.learned.sigma_quantile(0.5))
            .collect()
    };
    let once = medians(1, &Scenes::default());
    let off = |other: &[f64]| {
        let pairs = once.iter().zip(other);
        pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
    };
    assert_eq!(once.len(), 24);
    assert!(off(&medians(2, &pairs)) < 1e-6);
    assert!(off(&medians(2, &Scenes::default())) > 1e-3);
}
