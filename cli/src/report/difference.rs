//! Differences as colours.

/// Red above 0 and blue below, white at 0, full at ±1 and beyond.
pub fn difference(value: f64) -> [f64; 3] {
    let value = value.clamp(-1.0, 1.0);
    let faded = 1.0 - value.abs();
    if value > 0.0 {
        [0.9, 0.9 * faded, 0.9 * faded]
    } else {
        [0.9 * faded, 0.9 * faded, 0.9]
    }
}
