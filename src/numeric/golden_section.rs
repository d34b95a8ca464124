//! The minimum of a function of one variable (Kiefer 1953, doi:10.1090/S0002-9939-1953-0055639-3).

/// Where in [`low`, `high`] a function with one minimum there is least, to `width`.
///
/// Each step asks for one value and narrows the bracket by 0.618. Near a minimum values differ by
/// the square of the distance, so a `width` below the root of their rounding gains nothing.
///
/// # Errors
/// The first error of `of`.
pub(crate) fn minimise<E>(
    (mut low, mut high): (f64, f64),
    width: f64,
    mut of: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_a, mut at_b) = (of(a)?, of(b)?);
    while high - low > width {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - ratio * (high - low);
            at_a = of(a)?;
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + ratio * (high - low);
            at_b = of(b)?;
        }
    }
    Ok(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_minimum() {
        for centre in [-0.9, 0.0, 0.3] {
            let of = |x: f64| Ok::<f64, ()>((x - centre).cosh());
            let found = minimise((-1.0, 1.0), 1e-7, of).unwrap();
            assert!((found - centre).abs() < 1e-7, "{found} for {centre}");
        }
        // At an end, and the error of the function.
        let rising = minimise((0.0, 1.0), 1e-9, Ok::<f64, ()>).unwrap();
        assert!(rising < 1e-9);
        assert_eq!(minimise((0.0, 1.0), 1e-9, |_| Err("no")), Err("no"));
    }
}
