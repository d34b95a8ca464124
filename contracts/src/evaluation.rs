//! Intervals and nearest neighbours, against SciPy and scikit-learn.

#![expect(clippy::doc_markdown, reason = "names of other people's programs")]

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::{Parallelism, Result};
use lobes_experiments::{
    Classifier, NearestNeighbour, Scaling, leave_one_illumination_out, wilson,
};

const ORACLE: Oracle = Oracle::Snapshot("evaluation");
const NOISE: &str =
    "48 observations of 6 labels in 8 groups, features over decades, under each scaling";

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "evaluation/wilson",
            function: "experiments::wilson",
            oracle: ORACLE,
            domain: "0 of 1 to 50 000 of 100 001, levels 0.5, 0.9, 0.95 and 0.999",
            metric: Metric::Absolute,
            bound: 1e-15,
            why: "the normal quantile is good to an ε or two",
            loose: None,
            measure: interval,
        },
        Contract {
            id: "evaluation/nearest-neighbour",
            function: "experiments::{NearestNeighbour, leave_one_illumination_out}",
            oracle: ORACLE,
            domain: NOISE,
            metric: Metric::Mismatch,
            bound: 0.0,
            why: "a label is right or wrong",
            loose: None,
            measure: labels,
        },
        Contract {
            id: "evaluation/nearest-distance",
            function: "experiments::NearestNeighbour::score",
            oracle: ORACLE,
            domain: NOISE,
            metric: Metric::Relative,
            bound: 4e-14,
            why: "a root of a sum of ten squares of differences, scaled by a standard deviation",
            loose: None,
            measure: distances,
        },
    ]
}

#[derive(Deserialize)]
struct Interval {
    successes: usize,
    trials: usize,
    level: f64,
    low: f64,
    high: f64,
}

fn interval(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Interval>("evaluation", "wilson")? {
        let (low, high) = wilson(case.successes, case.trials, case.level);
        for (got, want) in [(low, case.low), (high, case.high)] {
            tally.compare(got, want, || {
                format!("{} of {} at {}", case.successes, case.trials, case.level)
            });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Neighbours {
    scaling: String,
    features: Vec<[f64; 10]>,
    labels: Vec<usize>,
    groups: Vec<usize>,
    label_count: usize,
    said: Vec<usize>,
    nearest: Vec<f64>,
}

impl Neighbours {
    fn classifier(&self) -> Result<NearestNeighbour> {
        let scaling: Scaling = self.scaling.parse()?;
        NearestNeighbour::new(scaling, &self.features, &self.labels, self.label_count)
    }
}

fn labels(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Neighbours>("evaluation", "nearest-neighbour")? {
        let evaluation = leave_one_illumination_out(
            &case.classifier()?,
            &case.labels,
            &case.groups,
            case.label_count,
            Parallelism::Sequential,
        )?;
        for (i, (got, want)) in evaluation.said.iter().zip(&case.said).enumerate() {
            tally.same(got, want, || format!("{}, observation {i}", case.scaling));
        }
    }
    Ok(())
}

fn distances(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Neighbours>("evaluation", "nearest-neighbour")? {
        let classifier = case.classifier()?;
        for (i, want) in case.nearest.iter().enumerate() {
            let training: Vec<usize> = (0..case.labels.len())
                .filter(|&j| case.groups[j] != case.groups[i])
                .collect();
            let scores = classifier.score(&training, &[i])?;
            let best = scores[0].iter().copied().fold(f64::NEG_INFINITY, f64::max);
            tally.compare((-best).sqrt(), *want, || {
                format!("{}, observation {i}", case.scaling)
            });
        }
    }
    Ok(())
}
