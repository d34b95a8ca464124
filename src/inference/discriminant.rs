//! A linear discriminant: one Gaussian a material, one covariance for all.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::dataset::Dataset;
use super::evidence::log_sum_exp;
use super::expert::Expert;
use crate::{Error, Result};

/// Linear discriminant analysis (Fisher 1936, doi:10.1111/j.1469-1809.1936.tb02137.x) with a
/// covariance shrunk to its diagonal (Friedman 1989, doi:10.1080/01621459.1989.10478752).
///
/// The moments of each illumination are kept apart and added, so that leaving one out costs one
/// Cholesky factor; that, its probabilities and its lack of any iteration are why it stands here
/// and not a crate's logistic regression or support vectors.
///
/// ```
/// use lobes::inference::{Dataset, Discriminant, Observation, Scenes};
/// use lobes::nalgebra::DVector;
/// // Two materials that differ in one number.
/// let observations = (0..20).map(|i| Observation {
///     material: i % 2,
///     illumination: 0,
///     turn: 0,
///     view: (i % 2) as f64 + 0.01 * i as f64,
/// });
/// let data = Dataset {
///     materials: vec!["dark".into(), "bright".into()],
///     illuminations: vec!["sky".into()],
///     scenes: Scenes::default(),
///     observations: observations.collect(),
///     render_error: 0.0,
/// };
/// let plan = Discriminant::new("level", &data, Discriminant::SHRINKAGE, |view| vec![*view])?;
/// // Features are taken less their mean.
/// let scores = plan.learn(&[true])?.of(&DVector::from_vec(vec![0.4]));
/// assert!(scores[1] > scores[0]);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug)]
pub struct Discriminant {
    name: String,
    shrinkage: f64,
    labels: usize,
    centre: DVector<f64>,
    /// The features less their centre.
    features: Vec<DVector<f64>>,
    /// By illumination.
    moments: Vec<Moments>,
}

#[derive(Debug, Clone)]
struct Moments {
    /// Σ x of each label.
    sums: Vec<DVector<f64>>,
    counts: Vec<f64>,
    /// Σ x xᵀ over all labels.
    squares: DMatrix<f64>,
}

/// What was learned: scores are ln-probabilities but for a constant.
///
/// ```
/// use lobes::inference::{Dataset, Discriminant, Observation, Scenes};
/// use lobes::nalgebra::DVector;
/// # let observations = (0..20).map(|i| Observation {
/// #     material: i % 2,
/// #     illumination: 0,
/// #     turn: 0,
/// #     view: (i % 2) as f64 + 0.01 * i as f64,
/// # });
/// # let data = Dataset {
/// #     materials: vec!["dark".into(), "bright".into()],
/// #     illuminations: vec!["sky".into()],
/// #     scenes: Scenes::default(),
/// #     observations: observations.collect(),
/// #     render_error: 0.0,
/// # };
/// // Learned from two materials, at levels of about −0.5 and 0.5 once the mean is taken off.
/// let plan = Discriminant::new("level", &data, Discriminant::SHRINKAGE, |view| vec![*view])?;
/// let scores = plan.learn(&[true])?;
/// let far = scores.distances(&DVector::from_vec(vec![20.0]));
/// assert!(far.iter().all(|distance| *distance > 100.0), "it is like neither");
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LinearScores {
    weights: DMatrix<f64>,
    offsets: DVector<f64>,
    means: Vec<DVector<f64>>,
    factor: Cholesky<f64, Dyn>,
}

impl LinearScores {
    /// The same for features that have not been centred.
    pub(super) fn uncentred(mut self, centre: &DVector<f64>) -> Self {
        for mean in &mut self.means {
            *mean += centre;
        }
        self.offsets -= self.weights.tr_mul(centre);
        self
    }

    /// The score of each label.
    pub fn of(&self, features: &DVector<f64>) -> DVector<f64> {
        self.weights.tr_mul(features) + &self.offsets
    }

    /// The squared Mahalanobis distance to each label's mean.
    pub fn distances(&self, features: &DVector<f64>) -> Vec<f64> {
        self.means
            .iter()
            .map(|mean| {
                let mut off = features - mean;
                self.factor.l_dirty().solve_lower_triangular_mut(&mut off);
                off.norm_squared()
            })
            .collect()
    }
}

impl Discriminant {
    /// How far the covariance is drawn to its diagonal, unless said.
    ///
    /// Chosen on eight other materials (`docs/explanation/inference.md`), where 0.1 … 0.5 differ by
    /// one picture in a hundred.
    pub const SHRINKAGE: f64 = 0.2;

    /// The moments of `features` of every observation of a data set.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a feature that is not finite; [`Error::Length`] where pictures
    /// differ in how many they have.
    pub fn new<T>(
        name: &str,
        dataset: &Dataset<T>,
        shrinkage: f64,
        features: impl Fn(&T) -> Vec<f64>,
    ) -> Result<Self> {
        let labels = dataset.materials.len();
        let mut rows = Vec::with_capacity(dataset.observations.len());
        for observation in &dataset.observations {
            let row = features(&observation.view);
            crate::error::check_finite("the features of a picture", &row)?;
            rows.push(DVector::from_vec(row));
        }
        let size = rows.first().map_or(0, DVector::len);
        if let Some(other) = rows.iter().find(|row| row.len() != size) {
            return Err(Error::Length {
                what: "the features of a picture",
                expected: size,
                got: other.len(),
            });
        }
        // Moments about the mean of all keep their digits.
        let mut centre = DVector::zeros(size);
        for row in &rows {
            centre += row;
        }
        centre /= rows.len().max(1) as f64;
        for row in &mut rows {
            *row -= &centre;
        }
        let empty = Moments {
            sums: vec![DVector::zeros(size); labels],
            counts: vec![0.0; labels],
            squares: DMatrix::zeros(size, size),
        };
        let mut moments = vec![empty; dataset.illuminations.len()];
        for (illumination, moments) in moments.iter_mut().enumerate() {
            let of: Vec<usize> = (0..rows.len())
                .filter(|&i| dataset.observations[i].illumination == illumination)
                .collect();
            for &i in &of {
                let label = dataset.observations[i].material;
                moments.sums[label] += &rows[i];
                moments.counts[label] += 1.0;
            }
            let matrix = DMatrix::from_fn(size, of.len(), |row, column| rows[of[column]][row]);
            moments.squares = &matrix * matrix.transpose();
        }
        Ok(Self {
            name: name.to_owned(),
            shrinkage,
            labels,
            centre,
            features: rows,
            moments,
        })
    }

    /// The mean of the features of all observations, which is taken off them before anything else.
    pub(super) fn centre(&self) -> &DVector<f64> {
        &self.centre
    }

    /// Features less [`Self::centre`].
    pub(super) fn centred(&self, features: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(features) - &self.centre
    }

    /// Learns from the illuminations that were seen.
    ///
    /// # Errors
    /// [`Error::TooFew`] for a label without an observation.
    pub fn learn(&self, seen: &[bool]) -> Result<LinearScores> {
        let size = self.features.first().map_or(0, DVector::len);
        let mut sums = vec![DVector::zeros(size); self.labels];
        let mut counts = vec![0.0; self.labels];
        let mut scatter = DMatrix::zeros(size, size);
        for (moments, _) in self.moments.iter().zip(seen).filter(|(_, seen)| **seen) {
            scatter += &moments.squares;
            for label in 0..self.labels {
                sums[label] += &moments.sums[label];
                counts[label] += moments.counts[label];
            }
        }
        if counts.contains(&0.0) {
            return Err(Error::TooFew {
                what: "learning the features of a material",
                items: "pictures",
                needed: 1,
                got: 0,
            });
        }
        let total: f64 = counts.iter().sum();
        let means: Vec<DVector<f64>> = sums
            .into_iter()
            .zip(&counts)
            .map(|(sum, count)| sum / *count)
            .collect();
        // Fewer pictures than features leave no variance in some direction: a trace of the variance
        // of all is added.
        let trace = 1e-9 * (scatter.diagonal().max() / total).max(1e-12);
        for (mean, count) in means.iter().zip(&counts) {
            scatter.ger(-*count, mean, mean, 1.0);
        }
        scatter /= total;
        let diagonal = scatter.diagonal();
        scatter *= 1.0 - self.shrinkage;
        for i in 0..size {
            // Rounding can leave a variance below 0.
            scatter[(i, i)] += self.shrinkage * diagonal[i].max(0.0) + trace;
        }
        let factor = Cholesky::new(scatter).ok_or_else(|| Error::NotPositiveDefinite {
            what: "the covariance of the pictures' features".into(),
        })?;
        let stacked = DMatrix::from_columns(&means);
        let weights = factor.solve(&stacked);
        let offsets = DVector::from_fn(self.labels, |label, _| {
            -0.5 * weights.column(label).dot(&means[label])
        });
        Ok(LinearScores {
            weights,
            offsets,
            means,
            factor,
        })
    }
}

impl Expert for Discriminant {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn judge(&self, seen: &[bool], observations: &[usize]) -> Result<Vec<Vec<f64>>> {
        let scores = self.learn(seen)?;
        Ok(observations
            .iter()
            .map(|&i| {
                let mut scores: Vec<f64> = scores.of(&self.features[i]).data.into();
                let total = log_sum_exp(scores.iter().copied());
                for score in &mut scores {
                    *score -= total;
                }
                scores
            })
            .collect())
    }
}
