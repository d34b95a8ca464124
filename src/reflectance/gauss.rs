//! The sixteen-point Gauss–Legendre rule that every integral over a lobe is made of.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// How many nodes the rule has.
pub(super) const POINTS: usize = 16;

/// Nodes in (0, 1) and weights that sum to 1.
pub(super) static RULE: LazyLock<[(f64, f64); POINTS]> = LazyLock::new(|| {
    let mut rule = [(0.0, 0.0); POINTS];
    for (index, entry) in rule.iter_mut().enumerate() {
        let mut z = (PI * (index as f64 + 0.75) / (POINTS as f64 + 0.5)).cos();
        let mut slope = 0.0;
        // Newton doubles the digits: the start has three, so five steps are two to spare.
        for _ in 0..5 {
            let (mut before, mut value) = (1.0, z);
            for l in 1..POINTS {
                let l = l as f64;
                (before, value) = (
                    value,
                    ((2.0 * l + 1.0) * z * value - l * before) / (l + 1.0),
                );
            }
            slope = POINTS as f64 * (before - z * value) / ((1.0 - z) * (1.0 + z));
            z -= value / slope;
        }
        *entry = (
            0.5 * (1.0 - z),
            1.0 / ((1.0 - z) * (1.0 + z) * slope * slope),
        );
    }
    rule
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_every_power_that_it_should() {
        for power in 0..2 * POINTS as i32 {
            let integral: f64 = RULE.iter().map(|&(x, w)| w * x.powi(power)).sum();
            let exact = 1.0 / (f64::from(power) + 1.0);
            assert!(
                (integral - exact).abs() < 4.0 * f64::EPSILON * exact.max(0.25),
                "power {power}: {integral} against {exact}"
            );
        }
    }
}
