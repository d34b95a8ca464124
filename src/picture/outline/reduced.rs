//! A picture made smaller.

use super::Circle;
use crate::illumination::Luminance;
use crate::numeric::bilinear;
use crate::picture::Picture;

/// The means of squares of pixels.
pub(super) struct Reduced {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Pixels of the picture to one of these.
    pub(super) scale: usize,
    /// Linear radiance.
    pub(super) values: Vec<[f64; 3]>,
    /// What is about white.
    pub(super) white: f64,
    /// From which on a value is saturated.
    ceiling: f64,
}

impl Reduced {
    /// A picture of which `scale` × `scale` pixels are made one.
    pub(super) fn of(picture: &Picture, scale: usize) -> Self {
        let (width, height) = (picture.width() / scale, picture.height() / scale);
        let share = 1.0 / (scale * scale) as f64;
        let values = (0..width * height)
            .map(|i| {
                let (row, column) = (i / width * scale, i % width * scale);
                let square = (row..row + scale).flat_map(|y| {
                    let first = y * picture.width() + column;
                    (first..first + scale).map(|index| (index, share))
                });
                picture.pixels.weighted_sum(square)
            })
            .collect::<Vec<_>>();
        let white = if picture.is_encoded() {
            // Of a picture that is exposed so little that all but its brightest hundredth is darker
            // than a sixteenth of white, what is white is taken to be darker too.
            (16.0 * nearly_largest(&values)).clamp(f64::MIN_POSITIVE, 1.0)
        } else {
            5.0 * picture.mean_luminance() + f64::MIN_POSITIVE
        };
        Self {
            width,
            height,
            scale,
            values,
            white,
            ceiling: if picture.is_encoded() {
                0.97
            } else {
                f64::INFINITY
            },
        }
    }

    /// Whether a circle holds little but what is saturated: it is a lamp.
    pub(super) fn is_saturated(&self, circle: Circle) -> bool {
        let (mut count, mut saturated) = (0, 0);
        for (i, rgb) in self.values.iter().enumerate() {
            let (x, y) = ((i % self.width) as f64 + 0.5, (i / self.width) as f64 + 0.5);
            if (x - circle.x).powi(2) + (y - circle.y).powi(2) < (0.9 * circle.radius).powi(2) {
                count += 1;
                saturated += usize::from(rgb.iter().all(|value| *value >= self.ceiling));
            }
        }
        saturated * 10 > count * 9
    }

    /// Bilinear, with the border continued.
    pub(super) fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let corners = bilinear::corners(self.width, self.height, x - 0.5, y - 0.5);
        let [a, b, c, d] = corners.map(|(index, weight)| (self.values[index], weight));
        std::array::from_fn(|i| a.1 * a.0[i] + b.1 * b.0[i] + c.1 * c.0[i] + d.1 * d.0[i])
    }
}

/// What one value in a hundred exceeds.
fn nearly_largest(values: &[[f64; 3]]) -> f64 {
    let mut luminances: Vec<f64> = values.iter().map(|v| Luminance::Rec709.of(*v)).collect();
    let Some(last) = luminances.len().checked_sub(1) else {
        return 0.0;
    };
    let place = last - last / 100;
    *luminances.select_nth_unstable_by(place, f64::total_cmp).1
}

/// The root of radiance, on which the noise of light is the same everywhere, with dark noise held
/// down.
pub(super) fn even(value: f64, white: f64) -> f64 {
    (value.max(0.0) / white + 0.004).sqrt()
}
