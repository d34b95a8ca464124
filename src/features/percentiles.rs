//! Percentiles without sorting everything.

/// The values at `levels`, which rise: of n values in order that at ⌊level (n − 1)⌋. The values are
/// left in another order.
pub(super) fn percentiles<const N: usize>(values: &mut [f64], levels: [f64; N]) -> [f64; N] {
    let last = values.len().saturating_sub(1);
    let mut done = 0;
    levels.map(|level| {
        let at = ((level * last as f64) as usize).clamp(done, last);
        let (_, value, _) = values[done..].select_nth_unstable_by(at - done, f64::total_cmp);
        done = at;
        *value
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn they_are_those_of_the_sorted_values() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(11);
        for count in [1, 2, 7, 100, 1001] {
            let mut values: Vec<f64> = (0..count).map(|_| random.random::<f64>() - 0.5).collect();
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let levels = [0.0, 0.002, 0.3, 0.3, 0.5, 0.99, 1.0];
            let want = levels.map(|level| sorted[(level * (count - 1) as f64) as usize]);
            assert_eq!(percentiles(&mut values, levels), want);
        }
    }
}
