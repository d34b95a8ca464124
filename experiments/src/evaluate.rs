//! Leaving one illumination out at a time.

use crate::interval::wilson;
use lobes::reflectance::Finish;
use lobes::{Parallelism, Result};

/// Something that learns from labelled observations and scores the labels of others.
///
/// Observations are known by their index in the data set that the classifier was made for.
pub trait Classifier: Sync {
    /// What tables call it.
    fn name(&self) -> String;

    /// Learns from the observations `training` and gives, for each of `test`, one score a label:
    /// the highest names the material. Scores are log-probabilities up to a constant where the
    /// classifier has any.
    ///
    /// # Errors
    /// What makes learning impossible, such as a label without an observation.
    fn score(&self, training: &[usize], test: &[usize]) -> Result<Vec<Vec<f64>>>;
}

/// One observation that was given the wrong label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Confusion {
    /// The observation's index.
    pub observation: usize,
    /// Its label.
    pub truth: usize,
    /// The label that it was given.
    pub said: usize,
}

/// What came of naming every observation once.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// The observations that were named, in order.
    pub observations: Vec<usize>,
    /// The label given to each.
    pub said: Vec<usize>,
    /// The true labels.
    pub truth: Vec<usize>,
    /// The classifier's scores of every label.
    pub scores: Vec<Vec<f64>>,
    /// The number of labels.
    pub labels: usize,
}

impl Evaluation {
    /// How many observations were named right.
    pub fn correct(&self) -> usize {
        self.total() - self.confusions().len()
    }

    /// How many observations there are.
    pub fn total(&self) -> usize {
        self.said.len()
    }

    /// The share named right.
    pub fn accuracy(&self) -> f64 {
        self.correct() as f64 / self.total().max(1) as f64
    }

    /// How many were given a label of the right finish, `finishes[label]`: their own, or another of
    /// the same finish.
    ///
    /// A label beyond `finishes` has none, and only itself is right.
    pub fn correct_finish(&self, finishes: &[Finish]) -> usize {
        let pairs = self.truth.iter().zip(&self.said);
        pairs
            .filter(|&(&truth, &said)| {
                let shared = finishes.get(truth).zip(finishes.get(said));
                truth == said || shared.is_some_and(|(truth, said)| truth == said)
            })
            .count()
    }

    /// Wilson's 95 % interval of [`Self::accuracy`].
    pub fn interval(&self) -> (f64, f64) {
        wilson(self.correct(), self.total(), 0.95)
    }

    /// The observations named wrong, in order.
    pub fn confusions(&self) -> Vec<Confusion> {
        self.truth
            .iter()
            .zip(&self.said)
            .enumerate()
            .filter(|(_, (truth, said))| truth != said)
            .map(|(i, (&truth, &said))| Confusion {
                observation: self.observations[i],
                truth,
                said,
            })
            .collect()
    }

    /// `matrix[truth][said]`: how often each label was given to each.
    pub fn confusion_matrix(&self) -> Vec<Vec<usize>> {
        let mut matrix = vec![vec![0; self.labels]; self.labels];
        for (&truth, &said) in self.truth.iter().zip(&self.said) {
            matrix[truth][said] += 1;
        }
        matrix
    }
}

/// Names every observation with a classifier that has seen nothing of the same group: of the same
/// illumination or, where several illuminations are of one place, of the same
/// [scene](lobes::inference::Scenes).
///
/// All observations of one group are left out together, and with them everything that is learned
/// from them. Equal scores go to the label that comes first.
///
/// - `labels[i]`, `groups[i]`: the label and the group of observation i.
/// - `label_count`: how many labels there are.
///
/// # Errors
/// [`lobes::Error::Length`] when the two arrays differ; [`lobes::Error::TooFew`] with fewer
/// than two groups, when there is nothing to learn from; what the classifier finds wrong.
pub fn leave_one_illumination_out(
    classifier: &dyn Classifier,
    labels: &[usize],
    groups: &[usize],
    label_count: usize,
    parallelism: Parallelism,
) -> Result<Evaluation> {
    let all: Vec<usize> = (0..labels.len()).collect();
    judge_leaving_one_out(classifier, labels, groups, &all, label_count, parallelism)
}

/// [`leave_one_illumination_out`] that names the observations `judged` only; the others are there
/// to learn from.
///
/// # Errors
/// As there, and [`lobes::Error::Domain`] for an observation to judge that there is not.
pub fn judge_leaving_one_out(
    classifier: &dyn Classifier,
    labels: &[usize],
    groups: &[usize],
    judged: &[usize],
    label_count: usize,
    parallelism: Parallelism,
) -> Result<Evaluation> {
    lobes::check_length("the list of groups", labels.len(), groups.len())?;
    if let Some(&beyond) = judged.iter().find(|&&i| i >= labels.len()) {
        return Err(lobes::Error::Domain {
            what: "an observation to judge",
            value: beyond as f64,
            allowed: "below the number of observations",
        });
    }
    let mut distinct = groups.to_vec();
    distinct.sort_unstable();
    distinct.dedup();
    if distinct.len() < 2 {
        return Err(lobes::Error::TooFew {
            what: "leaving one illumination out",
            items: "illuminations",
            needed: 2,
            got: distinct.len(),
        });
    }
    let folds = parallelism.map(distinct.len(), |fold| {
        let test: Vec<usize> = (judged.iter().copied())
            .filter(|&i| groups[i] == distinct[fold])
            .collect();
        let training: Vec<usize> = (0..labels.len())
            .filter(|&i| groups[i] != distinct[fold])
            .collect();
        let scores = classifier.score(&training, &test)?;
        Ok(test.into_iter().zip(scores).collect::<Vec<_>>())
    });
    let mut of = vec![Vec::new(); labels.len()];
    for fold in folds {
        for (i, scores) in fold? {
            of[i] = scores;
        }
    }
    let scores: Vec<Vec<f64>> = judged.iter().map(|&i| std::mem::take(&mut of[i])).collect();
    Ok(Evaluation {
        observations: judged.to_vec(),
        said: scores.iter().map(|scores| best(scores)).collect(),
        truth: judged.iter().map(|&i| labels[i]).collect(),
        scores,
        labels: label_count,
    })
}

/// The index of the highest score, the first of equals.
fn best(scores: &[f64]) -> usize {
    let mut best = 0;
    for (label, &score) in scores.iter().enumerate() {
        if score > scores[best] || scores[best].is_nan() {
            best = label;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Says of each observation the label of the training observation with the nearest index, and
    /// fails if it is ever shown the group that it is tested on.
    struct Neighbour<'a> {
        labels: &'a [usize],
        groups: &'a [usize],
    }

    impl Classifier for Neighbour<'_> {
        fn name(&self) -> String {
            "neighbour".into()
        }

        fn score(&self, training: &[usize], test: &[usize]) -> Result<Vec<Vec<f64>>> {
            for &i in test {
                assert!(
                    training.iter().all(|&j| self.groups[j] != self.groups[i]),
                    "observation {i} is tested on its own group"
                );
            }
            Ok(test
                .iter()
                .map(|&i| {
                    let nearest = training.iter().min_by_key(|&&j| i.abs_diff(j)).unwrap();
                    let mut scores = vec![0.0; 2];
                    scores[self.labels[*nearest]] = 1.0;
                    scores
                })
                .collect())
        }
    }

    #[test]
    fn leaves_whole_groups_out() {
        let labels = [0, 1, 0, 1];
        let groups = [0, 0, 1, 1];
        let classifier = Neighbour {
            labels: &labels,
            groups: &groups,
        };
        let evaluation =
            leave_one_illumination_out(&classifier, &labels, &groups, 2, Parallelism::Sequential)
                .unwrap();
        // 0 and 1 both see 2 nearest (label 0), 2 and 3 both see 1 (label 1).
        assert_eq!(evaluation.said, [0, 0, 1, 1]);
        assert_eq!(evaluation.correct(), 2);
        assert_eq!(evaluation.confusion_matrix(), [[1, 1], [1, 1]]);
    }

    #[test]
    fn refuses_a_single_group() {
        let classifier = Neighbour {
            labels: &[0, 1],
            groups: &[3, 3],
        };
        let error =
            leave_one_illumination_out(&classifier, &[0, 1], &[3, 3], 2, Parallelism::Sequential);
        assert!(matches!(error, Err(lobes::Error::TooFew { .. })));
    }
}
