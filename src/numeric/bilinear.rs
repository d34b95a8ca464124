//! Bilinear interpolation among values that stand row by row.

/// The indices of the four values about a place, and what each weighs; the weights sum to 1.
///
/// `x` counts columns and `y` rows, 0 at the first; a place beyond an edge is taken at the edge.
#[inline]
pub(crate) fn corners(columns: usize, rows: usize, x: f64, y: f64) -> [(usize, f64); 4] {
    let along = |place: f64, count: usize| {
        let place = place.clamp(0.0, (count - 1) as f64);
        let low = place as usize;
        (low, (low + 1).min(count - 1), place - low as f64)
    };
    let ((left, right, u), (top, below, v)) = (along(x, columns), along(y, rows));
    [
        (top * columns + left, (1.0 - u) * (1.0 - v)),
        (top * columns + right, u * (1.0 - v)),
        (below * columns + left, (1.0 - u) * v),
        (below * columns + right, u * v),
    ]
}

/// [`corners`] of a place that lies among the values; `None` beyond an edge.
#[inline]
pub(crate) fn corners_within(
    columns: usize,
    rows: usize,
    x: f64,
    y: f64,
) -> Option<[(usize, f64); 4]> {
    let within = |place: f64, count: usize| place >= 0.0 && place + 1.0 <= count as f64;
    (within(x, columns) && within(y, rows)).then(|| corners(columns, rows, x, y))
}

/// The mean, by their weights, of those corners whose value counts; `None` where none does.
#[inline]
pub(crate) fn mean(
    corners: [(usize, f64); 4],
    value: impl Fn(usize) -> Option<[f64; 3]>,
) -> Option<[f64; 3]> {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (index, weight) in corners {
        if weight > 0.0
            && let Some(value) = value(index)
        {
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum += weight * value;
            }
            total += weight;
        }
    }
    // Less than this is the rounding of a place that lies on a pixel that does not count.
    (total > 1e-9).then(|| sum.map(|sum| sum / total))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bilinear_function_is_met_and_edges_go_on() {
        // 1 + 2x − 3y + xy on 4 columns and 3 rows.
        let f = |x: f64, y: f64| 1.0 + 2.0 * x - 3.0 * y + x * y;
        let at = |x: f64, y: f64| -> f64 {
            let terms = corners(4, 3, x, y).map(|(i, w)| w * f((i % 4) as f64, (i / 4) as f64));
            terms.iter().sum()
        };
        for (x, y) in [(0.3, 1.7), (2.9, 0.1), (3.0, 2.0), (0.0, 0.0)] {
            assert!((at(x, y) - f(x, y)).abs() < 1e-14, "{x} {y}");
        }
        assert_eq!(at(-7.0, 1.0), f(0.0, 1.0));
        assert_eq!(at(9.0, 9.0), f(3.0, 2.0));
        assert_eq!(
            corners_within(4, 3, 3.0, 2.0),
            Some(corners(4, 3, 3.0, 2.0))
        );
        for (x, y) in [(-1e-9, 1.0), (3.0 + 1e-9, 1.0), (1.0, 2.1), (f64::NAN, 0.0)] {
            assert_eq!(corners_within(4, 3, x, y), None, "{x} {y}");
        }
        assert_eq!(corners_within(0, 3, 0.0, 0.0), None);
        // A single value is everywhere.
        assert_eq!(corners(1, 1, 0.4, -3.0)[0], (0, 1.0));
    }

    #[test]
    fn what_does_not_count_is_left_out_of_the_mean() {
        let value = |i: usize| (i != 3).then_some([i as f64; 3]);
        // Weights ¼ each: (0 + 1 + 2)/3.
        assert_eq!(mean(corners(2, 2, 0.5, 0.5), value), Some([1.0; 3]));
        assert_eq!(mean(corners(2, 2, 1.0, 1.0), value), None);
    }
}
