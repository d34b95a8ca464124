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

    /// How far another lies off, by its centre or its radius.
    pub(super) fn apart(self, other: Self) -> f64 {
        let centres = (other.x - self.x).hypot(other.y - self.y);
        centres.max((other.radius - self.radius).abs())
    }
}
