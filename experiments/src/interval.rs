//! Intervals for proportions, and whether two classifiers differ.

use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, Normal};

/// Wilson's interval for a proportion: `successes` of `trials` at the two-sided `level`.
///
/// With p = successes / n and z the normal quantile of (1 + level) / 2, the ends are
/// (p + z²/2n ± z √(p(1−p)/n + z²/4n²)) / (1 + z²/n) (Wilson 1927,
/// <https://doi.org/10.1080/01621459.1927.10502953>). Without a trial nothing is known: (0, 1).
/// `level` is taken into (0, 1).
///
/// ```
/// // 68 of 72, the paper's synthetic accuracy.
/// let (low, high) = lobes_experiments::wilson(68, 72, 0.95);
/// assert!((low - 0.8657).abs() < 1e-4 && (high - 0.9782).abs() < 1e-4);
/// ```
pub fn wilson(successes: usize, trials: usize, level: f64) -> (f64, f64) {
    if trials == 0 {
        return (0.0, 1.0);
    }
    let level = level.clamp(f64::EPSILON, 1.0 - f64::EPSILON);
    let z = Normal::standard().inverse_cdf(0.5 * (1.0 + level));
    let n = trials as f64;
    let p = successes.min(trials) as f64 / n;
    let centre = p + z * z / (2.0 * n);
    let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z * z / n;
    (
        ((centre - half) / scale).max(0.0),
        ((centre + half) / scale).min(1.0),
    )
}

/// McNemar's exact test: the probability, were two classifiers equally good, that their
/// disagreement is at least as lopsided.
///
/// `first` pictures were named right by the first alone and `second` by the second alone; those on
/// which they agree say nothing. Two-sided: twice the tail of a binomial of ½, no more than 1
/// (McNemar 1947, doi:10.1007/BF02295996).
///
/// ```
/// use lobes_experiments::mcnemar;
/// assert_eq!(mcnemar(0, 0), 1.0);
/// assert!((mcnemar(0, 6) - 2.0 / 64.0).abs() < 1e-14);
/// ```
pub fn mcnemar(first: usize, second: usize) -> f64 {
    let fewer = first.min(second) as u64;
    match Binomial::new(0.5, (first + second) as u64) {
        Ok(binomial) if first + second > 0 => (2.0 * binomial.cdf(fewer)).min(1.0),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::{mcnemar, wilson};

    /// Against SciPy 1.17.1, `binomtest(min(b, c), b + c).pvalue`.
    #[test]
    fn mcnemar_agrees_with_scipy() {
        for (first, second, p) in [
            (1, 9, 0.021_484_375),
            (3, 14, 0.012_725_830_078_125),
            (8, 8, 1.0),
            (20, 41, 0.009_853_448_195_259_268),
        ] {
            assert!(
                (mcnemar(first, second) - p).abs() < 1e-12,
                "{first} {second}"
            );
            assert_eq!(mcnemar(first, second), mcnemar(second, first));
        }
    }

    /// Against statsmodels 0.14.4, `proportion_confint(k, n, 0.05, method="wilson")`.
    #[test]
    fn agrees_with_statsmodels() {
        for (successes, trials, low, high) in [
            (68, 72, 0.865_679_840_340_020_8, 0.978_185_784_018_683_4),
            (1, 3, 0.061_491_944_720_396_26, 0.792_340_399_197_952_3),
            (0, 10, 0.0, 0.277_532_799_862_889_26),
            (10, 10, 0.722_467_200_137_110_7, 1.0),
        ] {
            let interval = wilson(successes, trials, 0.95);
            assert!(
                (interval.0 - low).abs() < 1e-12 && (interval.1 - high).abs() < 1e-12,
                "{successes}/{trials}: {interval:?} where ({low}, {high}) is right"
            );
        }
    }

    #[test]
    fn knows_nothing_without_trials() {
        assert_eq!(wilson(0, 0, 0.95), (0.0, 1.0));
    }
}
