//! How well posteriors know the truth.

use lobes::inference::{Posterior, Reflectance};

/// How well posteriors know the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// How many pictures.
    pub count: usize,
    /// The median of |σ̂ − σ| / σ, σ̂ the posterior's median.
    pub sigma_error: f64,
    /// The median of the absolute error of the share's median.
    pub share_error: f64,
    /// (level, coverage of σ, coverage of the share) of the central credible intervals.
    pub coverage: Vec<(f64, f64, f64)>,
}

impl Calibration {
    /// From truths and posteriors.
    pub fn of(results: &[(Reflectance, &Posterior)]) -> Self {
        let median = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let mut sigma: Vec<f64> = results
            .iter()
            .map(|(t, p)| (p.sigma_quantile(0.5) - t.sigma).abs() / t.sigma)
            .collect();
        let mut share: Vec<f64> = results
            .iter()
            .map(|(t, p)| (p.share_quantile(0.5) - t.share).abs())
            .collect();
        let levels = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];
        let coverage = levels.map(|level| {
            let (low, high) = (0.5 - 0.5 * level, 0.5 + 0.5 * level);
            let part = |inside: &dyn Fn(&(Reflectance, &Posterior)) -> bool| {
                results.iter().filter(|r| inside(r)).count() as f64 / results.len().max(1) as f64
            };
            (
                level,
                part(&|(t, p)| (p.sigma_quantile(low)..=p.sigma_quantile(high)).contains(&t.sigma)),
                part(&|(t, p)| (p.share_quantile(low)..=p.share_quantile(high)).contains(&t.share)),
            )
        });
        Self {
            count: results.len(),
            sigma_error: median(&mut sigma),
            share_error: median(&mut share),
            coverage: coverage.to_vec(),
        }
    }
}
