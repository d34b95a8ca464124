//! The nearest neighbour in feature space.

use crate::evaluate::Classifier;
use lobes::named;
use lobes::{Error, Result};

/// How features are scaled before distances are taken. The paper does not say.
///
/// The power features are ratios of powers and span decades, and so does the square of a mean
/// radiance: the difference that means something is a ratio. Unscaled, the feature with the largest
/// unit (v7, in degrees) decides alone; standardised, its outliers do. Hence the default,
/// [`Logarithmic`](Self::Logarithmic): it is chosen for that reason and before any result, and
/// every scaling stands in the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Scaling {
    /// x, as it is.
    None,
    /// (x − mean) / standard deviation, both over the training observations.
    Standardised,
    /// ln x, and ln(1 + x) for v7, which is a degree and may be 0.
    #[default]
    Logarithmic,
    /// Logarithmic and then standardised.
    LogarithmicStandardised,
}

impl Scaling {
    /// Every scaling, in the order in which tables list them.
    pub const ALL: [Self; 4] = [
        Self::None,
        Self::Standardised,
        Self::Logarithmic,
        Self::LogarithmicStandardised,
    ];

    /// The name that `FromStr` reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Standardised => "standardised",
            Self::Logarithmic => "logarithmic",
            Self::LogarithmicStandardised => "logarithmic-standardised",
        }
    }

    fn logarithmic(self) -> bool {
        matches!(self, Self::Logarithmic | Self::LogarithmicStandardised)
    }

    fn standardised(self) -> bool {
        matches!(self, Self::Standardised | Self::LogarithmicStandardised)
    }
}

named!(Scaling, "scaling");

/// The index of v7 among the paper's features, the one that may be zero.
const DEGREE_FEATURE: usize = 6;

/// The nearest neighbour by Euclidean distance.
///
/// The score of a label is minus the squared distance to its nearest training observation.
#[derive(Debug, Clone)]
pub struct NearestNeighbour {
    scaling: Scaling,
    features: Vec<Vec<f64>>,
    labels: Vec<usize>,
    label_count: usize,
}

impl NearestNeighbour {
    /// Over the observations with these features ([`lobes::features::PaperFeatures::to_array`]) and
    /// labels in 0 … `label_count` − 1.
    ///
    /// # Errors
    /// [`Error::Length`] when the two differ, [`Error::Domain`] for a label past the count,
    /// [`Error::NotFinite`] for a feature that is not finite, and [`Error::Domain`] for one that is
    /// not positive where a logarithm is asked for.
    pub fn new(
        scaling: Scaling,
        features: &[[f64; 10]],
        labels: &[usize],
        label_count: usize,
    ) -> Result<Self> {
        lobes::check_length("the list of labels", features.len(), labels.len())?;
        if let Some(&label) = labels.iter().find(|&&label| label >= label_count) {
            return Err(Error::Domain {
                what: "a label",
                value: label as f64,
                allowed: "below the number of labels",
            });
        }
        lobes::check_finite("the list of features", features.as_flattened())?;
        let mut features: Vec<Vec<f64>> = features.iter().map(|f| f.to_vec()).collect();
        if scaling.logarithmic() {
            for features in &mut features {
                for (i, x) in features.iter_mut().enumerate() {
                    let argument = if i == DEGREE_FEATURE { 1.0 + *x } else { *x };
                    if argument <= 0.0 {
                        return Err(Error::Domain {
                            what: "a feature to take the logarithm of",
                            value: argument,
                            allowed: "positive",
                        });
                    }
                    *x = argument.ln();
                }
            }
        }
        Ok(Self {
            scaling,
            features,
            labels: labels.to_vec(),
            label_count,
        })
    }

    /// Over the observations with these vectors of features, any number of them, each divided by
    /// its standard deviation over the training observations.
    ///
    /// # Errors
    /// As [`Self::new`], and [`Error::Length`] where the vectors differ in length.
    pub fn standardised(
        features: Vec<Vec<f64>>,
        labels: &[usize],
        label_count: usize,
    ) -> Result<Self> {
        Ok(Self {
            scaling: Scaling::Standardised,
            ..Self::plain(features, labels, label_count)?
        })
    }

    /// Over the observations with these vectors of features, any number of them, taken as they are.
    ///
    /// # Errors
    /// As [`Self::standardised`].
    pub fn plain(features: Vec<Vec<f64>>, labels: &[usize], label_count: usize) -> Result<Self> {
        lobes::check_length("the list of labels", features.len(), labels.len())?;
        let size = features.first().map_or(0, Vec::len);
        for features in &features {
            lobes::check_length("the features of an observation", size, features.len())?;
            lobes::check_finite("the list of features", features)?;
        }
        if let Some(&label) = labels.iter().find(|&&label| label >= label_count) {
            return Err(Error::Domain {
                what: "a label",
                value: label as f64,
                allowed: "below the number of labels",
            });
        }
        Ok(Self {
            scaling: Scaling::None,
            features,
            labels: labels.to_vec(),
            label_count,
        })
    }

    /// One over the standard deviation of each feature over the training observations; 0 for a
    /// feature that does not vary.
    fn scales(&self, training: &[usize]) -> Vec<f64> {
        let size = self.features.first().map_or(0, Vec::len);
        if !self.scaling.standardised() {
            return vec![1.0; size];
        }
        let n = training.len() as f64;
        let scale = |i: usize| {
            let mean = training.iter().map(|&j| self.features[j][i]).sum::<f64>() / n;
            let variance = training
                .iter()
                .map(|&j| (self.features[j][i] - mean).powi(2))
                .sum::<f64>()
                / n;
            // What remains of a constant after rounding is no variation.
            if variance.sqrt() <= 1e-12 * mean.abs() {
                0.0
            } else {
                variance.sqrt().recip()
            }
        };
        (0..size).map(scale).collect()
    }
}

impl Classifier for NearestNeighbour {
    fn name(&self) -> String {
        "nearest-neighbour".into()
    }

    fn score(&self, training: &[usize], test: &[usize]) -> Result<Vec<Vec<f64>>> {
        let scales = self.scales(training);
        let scores = test.iter().map(|&i| {
            let mut scores = vec![f64::NEG_INFINITY; self.label_count];
            for &j in training {
                let squared: f64 = (0..scales.len())
                    .map(|k| ((self.features[i][k] - self.features[j][k]) * scales[k]).powi(2))
                    .sum();
                let score = &mut scores[self.labels[j]];
                *score = score.max(-squared);
            }
            scores
        });
        Ok(scores.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn features(v1: f64, v7: f64) -> [f64; 10] {
        let mut features = [1.0; 10];
        features[0] = v1;
        features[6] = v7;
        features
    }

    #[test]
    fn the_scaling_decides_who_is_near() {
        // Observation 2 is 1.1 from observation 0 in v1 and 3 from observation 1 in v7.
        let data = [
            features(0.9, 50.0),
            features(0.1, 53.0),
            features(0.1, 50.0),
        ];
        let labels = [0, 1, 0];
        let name = |scaling| {
            let classifier = NearestNeighbour::new(scaling, &data, &labels, 2).unwrap();
            let scores = classifier.score(&[0, 1], &[2]).unwrap();
            usize::from(scores[0][1] > scores[0][0])
        };
        assert_eq!(name(Scaling::None), 0, "0.8 is less than 3");
        assert_eq!(name(Scaling::Logarithmic), 1, "ln 9 is more than ln(54/51)");
    }

    #[test]
    fn a_logarithm_of_zero_is_refused() {
        let error = NearestNeighbour::new(Scaling::Logarithmic, &[features(0.0, 1.0)], &[0], 1);
        assert!(matches!(error, Err(Error::Domain { .. })));
        assert!(
            NearestNeighbour::new(Scaling::Logarithmic, &[features(1.0, 0.0)], &[0], 1).is_ok()
        );
    }
}
