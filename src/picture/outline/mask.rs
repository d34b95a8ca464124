//! The disc of a mask.

use super::Circle;
use crate::{Error, Result};

/// The disc that a mask covers: its centroid, and the radius of its area.
///
/// # Errors
/// A mask that is empty or not round.
pub(in crate::picture) fn of_mask(coverage: &[f32], width: usize) -> Result<Circle> {
    let (mut count, mut x, mut y) = (0.0f64, 0.0, 0.0);
    let (mut left, mut right, mut top, mut bottom) = (f64::MAX, 0.0f64, f64::MAX, 0.0f64);
    for (i, part) in coverage.iter().map(|part| f64::from(*part)).enumerate() {
        if part <= 0.0 {
            continue;
        }
        let (column, row) = ((i % width) as f64, (i / width) as f64);
        count += part;
        x += part * (column + 0.5);
        y += part * (row + 0.5);
        if part >= 0.5 {
            (left, right) = (left.min(column), right.max(column + 1.0));
            (top, bottom) = (top.min(row), bottom.max(row + 1.0));
        }
    }
    if count < 1.0 {
        return Err(Error::NoSphere {
            reason: "the mask leaves no pixel",
        });
    }
    let radius = (count / std::f64::consts::PI).sqrt();
    let round = |extent: f64| (extent / (2.0 * radius) - 1.0).abs() < 0.05 + 1.0 / radius;
    if !(round(right - left) && round(bottom - top)) {
        return Err(Error::NoSphere {
            reason: "the mask is not round, so it is not the outline of a sphere",
        });
    }
    Ok(Circle {
        x: x / count,
        y: y / count,
        radius,
    })
}
