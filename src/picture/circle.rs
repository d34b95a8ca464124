//! A circle in a picture.

use crate::{Error, Result};

/// A circle in a picture, in pixels from the left and the top; the first pixel's centre is at (½,
/// ½).
///
/// ```
/// use lobes::picture::Circle;
/// let circle: Circle = "64,64,60.5".parse().unwrap();
/// assert_eq!(circle.radius, 60.5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// The centre's column.
    pub x: f64,
    /// The centre's row.
    pub y: f64,
    /// The radius.
    pub radius: f64,
}

impl std::str::FromStr for Circle {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let numbers: Option<Vec<f64>> = text
            .split(',')
            .map(|part| part.trim().parse::<f64>().ok())
            .collect();
        match numbers.as_deref() {
            Some(&[x, y, radius])
                if x.is_finite() && y.is_finite() && radius > 0.0 && radius.is_finite() =>
            {
                Ok(Self { x, y, radius })
            }
            _ => Err(Error::Syntax {
                what: "circle",
                text: text.into(),
                needs: "three numbers, x,y,r in pixels, r above 0",
            }),
        }
    }
}

impl Circle {
    /// How far a point lies outside; negative inside.
    pub(super) fn outside(self, (x, y): (f64, f64)) -> f64 {
        (x - self.x).hypot(y - self.y) - self.radius
    }

    /// The same circle in a picture that has so many times the pixels across.
    pub(super) fn times(self, scale: f64) -> Self {
        Self {
            x: scale * self.x,
            y: scale * self.y,
            radius: scale * self.radius,
        }
    }

    /// The share of its area that lies in a picture, to about 10⁻³; 0 for what is no circle.
    pub(super) fn share_within(self, width: usize, height: usize) -> f64 {
        let Self { x, y, radius } = self;
        if ![x, y, radius].iter().all(|value| value.is_finite()) {
            return 0.0;
        }
        const STRIPS: usize = 512;
        // Each strip is as long as its chord, of which the picture shows a part.
        let (mut all, mut within) = (0.0, 0.0);
        for strip in 0..STRIPS {
            let down = (2.0 * (strip as f64 + 0.5) / STRIPS as f64 - 1.0) * radius;
            let half = (radius * radius - down * down).max(0.0).sqrt();
            all += 2.0 * half;
            if (0.0..=height as f64).contains(&(y + down)) {
                within += ((x + half).min(width as f64) - (x - half).max(0.0)).max(0.0);
            }
        }
        within / f64::max(all, f64::MIN_POSITIVE)
    }

    /// How far it goes beyond the border of a picture.
    pub(super) fn leaves(self, width: usize, height: usize) -> f64 {
        let Self { x, y, radius } = self;
        let nearest = x.min(y).min(width as f64 - x).min(height as f64 - y);
        radius - nearest
    }

    /// How far another lies off, by its centre or its radius.
    pub(super) fn apart(self, other: Self) -> f64 {
        let centres = (other.x - self.x).hypot(other.y - self.y);
        centres.max((other.radius - self.radius).abs())
    }
}
