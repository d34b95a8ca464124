//! A posterior of one number, as probabilities of bins.

use crate::error::{check_count, check_length};
use crate::{Error, Result};

/// A posterior of one number: the probabilities of bins that follow each other, uniform within
/// each.
///
/// ```
/// use lobes::inference::Binned;
/// let posterior = Binned::new(&[0.0, 1.0, 3.0], vec![0.5, 0.5])?;
/// assert_eq!(posterior.quantile(0.25), 0.5);
/// assert_eq!(posterior.quantile(0.75), 2.0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Binned {
    ends: Vec<f64>,
    masses: Vec<f64>,
}

impl Binned {
    /// The posterior of so much in each bin; bin i reaches from `ends[i]` to `ends[i + 1]`. Masses
    /// are divided by their sum.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one end more than masses, [`Error::TooFew`] for no bin,
    /// [`Error::Domain`] for ends that do not rise, a mass that is negative or not finite, and masses
    /// that are all 0.
    pub fn new(ends: &[f64], masses: Vec<f64>) -> Result<Self> {
        check_count("a posterior of bins", "bins", 1, masses.len())?;
        check_length("the ends of bins", masses.len() + 1, ends.len())?;
        for pair in ends.windows(2) {
            if !(pair[0] < pair[1] && pair[1].is_finite() && pair[0].is_finite()) {
                return Err(Error::Domain {
                    what: "the end of a bin",
                    value: pair[1],
                    allowed: "finite and above the end before",
                });
            }
        }
        for &value in &masses {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::Domain {
                    what: "the mass of a bin",
                    value,
                    allowed: "finite and at least 0",
                });
            }
        }
        let sum: f64 = masses.iter().sum();
        if sum <= 0.0 {
            return Err(Error::Domain {
                what: "the mass of all bins",
                value: sum,
                allowed: "above 0",
            });
        }
        Ok(Self {
            ends: ends.to_vec(),
            masses: masses.iter().map(|mass| mass / sum).collect(),
        })
    }

    /// The ends of the bins, one more than there are bins.
    pub fn ends(&self) -> &[f64] {
        &self.ends
    }

    /// The probability of each bin.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// The value below which it is with probability `level`, clamped to 0 … 1.
    pub fn quantile(&self, level: f64) -> f64 {
        let mut left = level.clamp(0.0, 1.0);
        for (ends, &mass) in self.ends.windows(2).zip(&self.masses) {
            if left <= mass && mass > 0.0 {
                return ends[0] + (ends[1] - ends[0]) * left / mass;
            }
            left -= mass;
        }
        self.ends[self.ends.len() - 1]
    }

    /// The low end, the median and the high end of the central interval that holds the value with
    /// probability `level`.
    ///
    /// Within a bin nothing is told apart: a low end in the first bin is that bin's lower end, and a
    /// high end in the last one its upper end.
    ///
    /// ```
    /// use lobes::inference::Binned;
    /// let posterior = Binned::new(&[0.0, 1.0, 2.0, 3.0], vec![0.5, 0.4, 0.1])?;
    /// assert_eq!(posterior.interval(0.9), [0.0, 1.0, 3.0]);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn interval(&self, level: f64) -> [f64; 3] {
        let tail = 0.5 - 0.5 * level.clamp(0.0, 1.0);
        let [low, median, high] = [tail, 0.5, 1.0 - tail].map(|level| self.quantile(level));
        let last = self.ends.len() - 1;
        [
            if low < self.ends[1] {
                self.ends[0]
            } else {
                low
            },
            median,
            if high > self.ends[last - 1] {
                self.ends[last]
            } else {
                high
            },
        ]
    }

    /// The upper end of the first bin, where at least 19 of 20 of the probability lie in that bin:
    /// then all that can be said is that the value is below it.
    pub fn below(&self) -> Option<f64> {
        (self.masses[0] >= 0.95).then(|| self.ends[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_uniform_pieces() {
        let p = Binned::new(&[0.0, 0.5, 1.0, 4.0], vec![1.0, 0.0, 3.0]).unwrap();
        assert_eq!(p.masses(), [0.25, 0.0, 0.75]);
        for (level, expected) in [
            (0.0, 0.0),
            (0.125, 0.25),
            (0.25, 0.5),
            (0.625, 2.5),
            (1.0, 4.0),
        ] {
            assert!((p.quantile(level) - expected).abs() < 1e-12, "{level}");
        }
        // The low end lies in the first bin, the high one in the last.
        assert_eq!(p.interval(0.9), [0.0, p.quantile(0.5), 4.0]);
        let middle = Binned::new(&[0.0, 1.0, 2.0, 3.0], vec![0.01, 0.98, 0.01]).unwrap();
        let [low, _, high] = middle.interval(0.9);
        assert!(low > 1.0 && high < 2.0);
        assert_eq!(p.quantile(7.0), 4.0);
        assert_eq!(p.below(), None);
        let p = Binned::new(&[0.0, 0.02, 1.0], vec![0.96, 0.04]).unwrap();
        assert_eq!(p.below(), Some(0.02));
    }

    #[test]
    fn what_is_no_posterior_is_refused() {
        assert!(Binned::new(&[0.0], Vec::new()).is_err());
        assert!(Binned::new(&[0.0, 1.0], vec![1.0, 1.0]).is_err());
        assert!(Binned::new(&[0.0, 0.0], vec![1.0]).is_err());
        assert!(Binned::new(&[0.0, 1.0], vec![0.0]).is_err());
        assert!(Binned::new(&[0.0, 1.0], vec![-1.0]).is_err());
        assert!(Binned::new(&[0.0, 1.0], vec![f64::NAN]).is_err());
        assert!(Binned::new(&[f64::NAN, 1.0], vec![1.0]).is_err());
    }
}
