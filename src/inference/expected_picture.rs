//! The picture that light which was read off a ball makes of the ball again.

use crate::features::{RingLayout, Unwrapped};
use crate::numeric::bilinear;

/// A picture of a ball beside the one that is expected of it, on the rings on which it was read.
///
/// What is expected is the mean, over what is known of the light and of the reflectance, of the
/// picture without noise: Σ_i p_i T_i M_i with the light M_i and the operator T_i of each of the
/// reflectances, p_i their probabilities. How bright the ball is drops out, since a ball that is s
/// times brighter is in a light of M_i/s.
///
/// What is left over says whether some light explains the picture, and not whether it is the right
/// one: light has as many degrees of freedom as the picture. Large it is where a picture has what no
/// light makes of such a ball: a shadow of its own, a texture, a pixel that is cut off.
///
/// ```
/// use lobes::Parallelism;
/// use lobes::inference::{BallLightReader, ChannelReflectance, LightQuantity, PossibleReflectance};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..96 * 96).map(|i| match camera.pixel(96, i / 96, i % 96) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 96, pixels.collect())?;
/// let reader = BallLightReader::new(Viewpoint::Orthographic, LightQuantity::Radiance)?;
/// let satin = ChannelReflectance { diffuse: 0.0, specular: 0.8, sigma: 0.1 };
/// let known = [PossibleReflectance::known([satin; 3])];
/// let light = reader.read(&image, &known, Parallelism::Sequential)?;
/// // Half way to the top of the picture.
/// let (seen, expected) = light.picture.at(0.0, 0.5).unwrap();
/// assert!((seen[0] - expected[0]).abs() < 0.01);
/// assert!(light.picture.residual() < 0.01);
/// // Nothing is read of the rim.
/// assert!(light.picture.at(0.0, 0.99).is_none());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ExpectedPicture {
    /// Of the rings, in radii of the outline.
    radii: Vec<f64>,
    columns: usize,
    /// Ring by ring, as [`Unwrapped`] has them.
    seen: Vec<[f64; 3]>,
    expected: Vec<[f64; 3]>,
}

impl ExpectedPicture {
    /// Of a picture, of which nothing is expected yet.
    pub(super) fn new(seen: &Unwrapped, layout: &RingLayout) -> Self {
        let angles = layout.angles().iter();
        Self {
            radii: angles
                .map(|angle| layout.viewpoint().radius(*angle))
                .collect(),
            columns: seen.columns(),
            seen: seen.values().to_vec(),
            expected: vec![[0.0; 3]; seen.values().len()],
        }
    }

    /// Adds what a channel shows with some probability.
    pub(super) fn add(&mut self, channel: usize, probability: f64, shown: &[f64]) {
        for (sum, value) in self.expected.iter_mut().zip(shown) {
            sum[channel] += probability * value;
        }
    }

    /// What is seen and what is expected at a place of the picture, x to its right and y to its top,
    /// in radii of the ball's outline from its centre; none outside of the rings, which end at
    /// [`RingLayout::LARGEST_RADIUS`].
    ///
    /// Bilinear between the rings and along them.
    pub fn at(&self, x: f64, y: f64) -> Option<([f64; 3], [f64; 3])> {
        let radius = x.hypot(y);
        let outer = self.radii.partition_point(|of_ring| *of_ring < radius);
        if outer == self.radii.len() || radius.is_nan() {
            return None;
        }
        // Row 0 is the first ring across the centre, and row i + 1 the i-th ring.
        let inner = match outer.checked_sub(1) {
            Some(inner) => self.radii[inner],
            None => -self.radii[0],
        };
        let row = outer as f64 + (radius - inner) / (self.radii[outer] - inner);
        let along = self.columns as f64 * (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0);
        let corners = bilinear::corners(self.columns + 1, self.radii.len() + 1, along, row);
        let between = |values: &[[f64; 3]]| {
            bilinear::mean(corners, |index| {
                let (row, column) = (index / (self.columns + 1), index % (self.columns + 1));
                let across = if row == 0 { self.columns / 2 } else { 0 };
                let place = row.saturating_sub(1) * self.columns;
                Some(values[place + (column + across) % self.columns])
            })
        };
        between(&self.seen).zip(between(&self.expected))
    }

    /// The root mean square of what is left over, as a share of that of the picture, over the rings
    /// by their area in the picture and over the channels; 0 of a picture that is black.
    pub fn residual(&self) -> f64 {
        let (mut off, mut all) = (0.0, 0.0);
        let rings = self
            .seen
            .chunks(self.columns)
            .zip(self.expected.chunks(self.columns));
        let mut inner = 0.0;
        for (ring, (seen, expected)) in rings.enumerate() {
            // To half way to the next ring.
            let next = self.radii.get(ring + 1).unwrap_or(&self.radii[ring]);
            let outer = 0.5 * (self.radii[ring] + next);
            let area = outer * outer - inner * inner;
            inner = outer;
            let pairs = seen.as_flattened().iter().zip(expected.as_flattened());
            for (seen, expected) in pairs {
                off += area * (seen - expected).powi(2);
                all += area * seen * seen;
            }
        }
        if all > 0.0 { (off / all).sqrt() } else { 0.0 }
    }
}
