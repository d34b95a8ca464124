//! What is found when a contract is measured.

use super::metric::{Metric, ulp};
use lobes::{Error, Result};

/// What is found when a contract is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// How many points were compared.
    pub points: usize,
    /// The largest error; infinite where an answer is not a number.
    pub largest: f64,
    /// The mean error.
    pub mean: f64,
    /// Where the largest error lies, in words.
    pub at: String,
}

/// Collects the errors of one contract, counted by its metric.
#[derive(Debug)]
pub struct Tally {
    metric: Metric,
    points: usize,
    largest: f64,
    sum: f64,
    at: String,
    misuse: Option<&'static str>,
}

impl Tally {
    pub(super) fn new(metric: Metric) -> Self {
        Self {
            metric,
            points: 0,
            largest: f64::NEG_INFINITY,
            sum: 0.0,
            at: String::new(),
            misuse: None,
        }
    }

    /// Compares an answer with the truth by any metric that needs nothing else; `at` says where,
    /// and is called only when it matters.
    pub fn compare(&mut self, got: f64, want: f64, at: impl FnOnce() -> String) {
        let error = match self.metric {
            Metric::Ulp => (got - want).abs() / ulp(want),
            Metric::Relative => (got - want).abs() / want.abs(),
            Metric::Absolute => (got - want).abs(),
            Metric::Mismatch => f64::from(got != want),
            Metric::Scaled(_) | Metric::ZScore => {
                self.misuse = Some("compares without the scale that its metric needs");
                return;
            }
        };
        // Equal infinities and a relative error of 0/0 are no error.
        self.add(if got == want { 0.0 } else { error }, at);
    }

    /// Compares an answer with the truth in units of `scale`: the named scale of [`Metric::Scaled`]
    /// or the standard error of [`Metric::ZScore`].
    pub fn compare_scaled(&mut self, got: f64, want: f64, scale: f64, at: impl FnOnce() -> String) {
        match self.metric {
            Metric::Scaled(_) | Metric::ZScore => {
                let error = if got == want {
                    0.0
                } else {
                    (got - want).abs() / scale
                };
                self.add(error, at);
            }
            _ => self.misuse = Some("gives a scale to a metric that has none"),
        }
    }

    /// Counts whether two answers of any type are the very same ([`Metric::Mismatch`]).
    pub fn same<T: PartialEq>(&mut self, got: &T, want: &T, at: impl FnOnce() -> String) {
        match self.metric {
            Metric::Mismatch => self.add(f64::from(u8::from(got != want)), at),
            _ => self.misuse = Some("asks for sameness by a metric that measures distance"),
        }
    }

    fn add(&mut self, error: f64, at: impl FnOnce() -> String) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.points += 1;
        self.sum += error;
        if error > self.largest {
            self.largest = error;
            self.at = at();
        }
    }

    pub(super) fn finish(self, id: &str) -> Result<Measurement> {
        if let Some(misuse) = self.misuse {
            return Err(Error::Contents {
                problem: format!("contract {id} {misuse}"),
                remedy: "call what goes with its metric".into(),
            });
        }
        if self.points == 0 {
            return Err(Error::Contents {
                problem: format!("contract {id} compared no point"),
                remedy: "give its snapshot a case".into(),
            });
        }
        Ok(Measurement {
            points: self.points,
            largest: self.largest,
            mean: self.sum / self.points as f64,
            at: self.at,
        })
    }
}
