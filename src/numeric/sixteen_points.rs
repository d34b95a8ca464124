//! The sixteen-point Gauss–Legendre rule that every integral over a lobe is made of.

use std::sync::LazyLock;

use super::quadrature::Rule;

/// How many nodes the rule has.
pub(crate) const POINTS: usize = 16;

/// Nodes in (0, 1) and weights that sum to 1.
pub(crate) static RULE: LazyLock<[(f64, f64); POINTS]> = LazyLock::new(|| {
    let mut points = [(0.0, 0.0); POINTS];
    // Sixteen nodes are within what a rule may have.
    if let Ok(rule) = Rule::gauss_legendre(POINTS) {
        for (point, (node, weight)) in points.iter_mut().zip(rule.nodes.iter().zip(&rule.weights)) {
            *point = (0.5 * (1.0 - node), 0.5 * weight);
        }
    }
    points
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
