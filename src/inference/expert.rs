//! Experts, each of which says how likely every material is for a picture, and a stack that weighs
//! them.

use std::convert::Infallible;

use super::dataset::Dataset;
use super::evidence::log_sum_exp;
use super::scenes::Scenes;
use crate::numeric::golden_section;
use crate::{Error, Result};

/// How likely each material is for one picture of a data set, to whoever has seen some of the
/// illuminations.
///
/// ```
/// use lobes::Result;
/// use lobes::inference::Expert;
/// /// Says of every picture that its material is the first, with some certainty.
/// struct Stubborn;
/// impl Expert for Stubborn {
///     fn name(&self) -> String {
///         "stubborn".into()
///     }
///     fn judge(&self, _: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
///         Ok(vec![vec![0.0, -2.0]; observations.len()])
///     }
/// }
/// assert_eq!(Stubborn.judge(&[true; 3], &[4, 7])?.len(), 2);
/// # Ok::<(), lobes::Error>(())
/// ```
pub trait Expert: Sync {
    /// What tables call it.
    fn name(&self) -> String;

    /// ln-likelihoods, up to one constant a picture, of each material for each observation in
    /// `observations`. `seen[i]` says whether anything may have been learned from illumination i.
    ///
    /// # Errors
    /// What makes learning impossible.
    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>>;
}

/// Experts weighed: ln p(material) = Σ_e w_e ln p_e(material) + constant, with the weights (inverse
/// temperatures, for each expert is too sure of itself) chosen inside the training fold.
///
/// For each scene of the training fold the experts judge its pictures of turn 0 from the others,
/// and the weights w ≥ 0 make those labels likeliest, under an exponential prior that keeps them
/// finite when all are named right.
///
/// ```
/// use lobes::inference::{Dataset, Expert, Observation, Scenes, Stack};
/// # use lobes::Result;
/// # /// Says of every picture that its material is the first, with some certainty.
/// # struct Stubborn;
/// # impl Expert for Stubborn {
/// #     fn name(&self) -> String {
/// #         "stubborn".into()
/// #     }
/// #     fn judge(&self, _: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
/// #         Ok(vec![vec![0.0, -2.0]; observations.len()])
/// #     }
/// # }
/// // Two lights, under each of which every one of two materials is seen once. The expert always says
/// // the first.
/// let observation = |i: usize| Observation { material: i % 2, illumination: i / 2, turn: 0, view: () };
/// let data = Dataset {
///     materials: vec!["matte".into(), "gold".into()],
///     illuminations: vec!["hall".into(), "street".into()],
///     scenes: Scenes::default(),
///     observations: (0..4).map(observation).collect(),
///     render_error: 0.0,
/// };
/// let stack = Stack::new(&data, vec![&Stubborn as &dyn Expert]);
/// // It is wrong as often as right, and so counts for nothing.
/// assert!(stack.weights(&[0, 1, 2, 3])?[0] < 1e-3);
/// # Ok::<(), lobes::Error>(())
/// ```
pub struct Stack<'a> {
    experts: Vec<&'a dyn Expert>,
    labels: Vec<usize>,
    illuminations: Vec<usize>,
    judged: Vec<bool>,
    scenes: Scenes,
    count: usize,
}

/// The prior's rate: what one unit of a weight costs in nats.
const WEIGHT_COST: f64 = 1.0;

impl<'a> Stack<'a> {
    /// A stack over the observations of `dataset`, for which the experts were made.
    pub fn new<T>(dataset: &Dataset<T>, experts: Vec<&'a dyn Expert>) -> Self {
        Self {
            experts,
            judged: dataset.observations.iter().map(|o| o.turn == 0).collect(),
            labels: dataset.labels(),
            illuminations: dataset
                .observations
                .iter()
                .map(|o| o.illumination)
                .collect(),
            scenes: dataset.scenes.clone(),
            count: dataset.illuminations.len(),
        }
    }

    /// judged[e][i][label] of each expert, centred so that each picture's best is 0.
    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<Vec<f64>>>> {
        self.experts
            .iter()
            .map(|expert| {
                let mut scores = expert.judge(seen, observations)?;
                for scores in &mut scores {
                    let best = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    for score in scores {
                        *score -= best;
                    }
                }
                Ok(scores)
            })
            .collect()
    }

    /// The illuminations of a training fold.
    fn seen(&self, training: &[usize]) -> Vec<bool> {
        let mut seen = vec![false; self.count];
        for &i in training {
            seen[self.illuminations[i]] = true;
        }
        seen
    }

    /// The weights that the inner loop chooses for a training fold.
    ///
    /// # Errors
    /// Fewer than two scenes in the fold, and what the experts find wrong.
    pub fn weights(&self, training: &[usize]) -> Result<Vec<f64>> {
        let seen = self.seen(training);
        let scenes = self.scenes.among(&seen);
        if scenes.len() < 2 {
            return Err(Error::TooFew {
                what: "weighing experts",
                items: "scenes",
                needed: 2,
                got: scenes.len(),
            });
        }
        let mut judged = vec![Vec::new(); self.experts.len()];
        let mut truth = Vec::new();
        for left_out in scenes {
            let inner = self.scenes.others(&seen, left_out);
            let held: Vec<usize> = training
                .iter()
                .copied()
                .filter(|&i| !inner[self.illuminations[i]] && self.judged[i])
                .collect();
            for (all, these) in judged.iter_mut().zip(self.judge(&inner, &held)?) {
                all.extend(these);
            }
            truth.extend(held.iter().map(|&i| self.labels[i]));
        }
        Ok(fit_weights(&judged, &truth))
    }

    /// The ln-probabilities of every label for each observation of `test`, by what was learned from
    /// `training` alone.
    ///
    /// # Errors
    /// Those of [`weights`](Self::weights) and of the experts.
    pub fn score(&self, training: &[usize], test: &[usize]) -> Result<Vec<Vec<f64>>> {
        let weights = self.weights(training)?;
        let seen = self.seen(training);
        let judged = self.judge(&seen, test)?;
        Ok((0..test.len())
            .map(|i| weigh(&judged, &weights, i))
            .collect())
    }

    /// The names of the experts, joined: what tables call the stack.
    pub fn name(&self) -> String {
        let names: Vec<String> = self.experts.iter().map(|expert| expert.name()).collect();
        names.join(" + ")
    }
}

/// ln-probabilities of picture i.
fn weigh(judged: &[Vec<Vec<f64>>], weights: &[f64], i: usize) -> Vec<f64> {
    let mut scores = vec![0.0; judged[0][i].len()];
    for (expert, weight) in judged.iter().zip(weights) {
        for (score, value) in scores.iter_mut().zip(&expert[i]) {
            *score += weight * value;
        }
    }
    let total = log_sum_exp(scores.iter().copied());
    for score in &mut scores {
        *score -= total;
    }
    scores
}

/// Minimises Σ −ln p(truth) + cost·Σ w over ln w, one weight after another by golden section, until
/// none moves. The problem is convex in w.
fn fit_weights(judged: &[Vec<Vec<f64>>], truth: &[usize]) -> Vec<f64> {
    let mut logs = vec![(0.01f64).ln(); judged.len()];
    let loss = |logs: &[f64]| -> f64 {
        let weights: Vec<f64> = logs.iter().map(|x| x.exp()).collect();
        let misses: f64 = truth
            .iter()
            .enumerate()
            .map(|(i, &label)| -weigh(judged, &weights, i)[label])
            .sum();
        misses + WEIGHT_COST * weights.iter().sum::<f64>()
    };
    for _ in 0..12 {
        let before = logs.clone();
        for expert in 0..logs.len() {
            let range = ((1e-6f64).ln(), 10f64.ln());
            let Ok(log) = golden_section::minimise(range, 1.6e-4, |x| {
                logs[expert] = x;
                Ok::<f64, Infallible>(loss(&logs))
            });
            logs[expert] = log;
        }
        if logs.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-3) {
            break;
        }
    }
    logs.into_iter().map(f64::exp).collect()
}
