//! Where a picture mirrors small bright lights.

use glam::DVec3;

use crate::features::{RingLayout, Unwrapped};
use crate::illumination::Luminance;

/// The directions in which a picture would see small bright lights if its sphere were a mirror.
///
/// The brightest place of the picture, then the brightest that is not within 0.1 radians of light
/// of one that was taken, and so on. Whether there is a light is not decided here:
/// [`GaussianEvidence`](super::GaussianEvidence) leaves the strength of each open, 0 among them.
///
/// Directions are polar angles from the line of sight and azimuths from the picture's right towards
/// its top, as rings are read.
///
/// ```
/// use lobes::inference::BrightLights;
/// let lights = BrightLights::from_directions(vec![(0.5, 0.1)]);
/// assert_eq!(lights.directions().len(), 1);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BrightLights {
    directions: Vec<(f64, f64)>,
}

impl BrightLights {
    /// So many are looked for.
    pub const COUNT: usize = 10;

    /// Two of them are at least so far apart, in radians.
    const APART: f64 = 0.1;

    /// Those of a picture that was unwrapped by `layout`.
    pub fn of(picture: &Unwrapped, layout: &RingLayout) -> Self {
        let columns = picture.columns();
        let turn = std::f64::consts::TAU / columns as f64;
        let around: Vec<(f64, f64)> = (0..columns)
            .map(|column| (turn * column as f64).sin_cos())
            .collect();
        let polar: Vec<f64> = layout
            .angles()
            .iter()
            .map(|&angle| angle + layout.viewpoint().view_angle(angle))
            .collect();
        let places: Vec<DVec3> = polar
            .iter()
            .map(|polar| polar.sin_cos())
            .flat_map(|(sin, cos)| {
                let around = around.iter();
                around.map(move |(y, x)| DVec3::new(sin * x, sin * y, cos))
            })
            .collect();
        let mut left: Vec<f64> = picture
            .values()
            .iter()
            .map(|rgb| Luminance::Rec709.of(*rgb))
            .collect();
        let mut directions = Vec::new();
        while directions.len() < Self::COUNT {
            let brightest = (0..left.len().min(places.len()))
                .max_by(|&a, &b| left[a].total_cmp(&left[b]))
                .filter(|&place| left[place] > 0.0);
            let Some(place) = brightest else { break };
            directions.push((polar[place / columns], turn * (place % columns) as f64));
            for (value, other) in left.iter_mut().zip(&places) {
                if places[place].dot(*other) > Self::APART.cos() {
                    *value = 0.0;
                }
            }
        }
        Self { directions }
    }

    /// Lights in known directions.
    pub fn from_directions(directions: Vec<(f64, f64)>) -> Self {
        Self { directions }
    }

    /// Polar angle and azimuth of each, radians.
    pub fn directions(&self) -> &[(f64, f64)] {
        &self.directions
    }
}
