//! Factorials as far as they go.

use super::double_double::DoubleDouble;

/// √(k!) for k = 0 … `last`, as mantissa and exponent of 2.
pub(crate) fn roots_of_factorials(last: usize) -> Vec<(DoubleDouble, i32)> {
    let mut product = DoubleDouble::ONE;
    let mut exponent = 0;
    (0..=last)
        .map(|k| {
            product = product.scale(k.max(1) as f64);
            while product.hi >= 4.0 {
                product = product.scale(0.25);
                exponent += 2;
            }
            (product.sqrt(), exponent / 2)
        })
        .collect()
}
