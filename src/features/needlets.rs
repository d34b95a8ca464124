//! Spherical wavelets on the part of the sphere that one image shows.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::features::{Continuation, ImageSpectrum};
use crate::harmonics::Transform;
use crate::illumination::Luminance;
use crate::reflection::SphereImage;
use crate::sphere::Grid;
use crate::{Error, Result};

/// The largest degree.
const DEGREE: usize = 64;

/// The scales j: degrees about 2^j.
const SCALES: std::ops::RangeInclusive<i32> = 2..=5;

/// The logarithm of radiance is taken of no less than this share of the picture's mean.
const FLOOR: f64 = 1e-3;

/// The plan of needlet statistics of log luminance.
///
/// A needlet coefficient is β_j(ξ) = Σ_l b(l / 2^j) Σ_m a_lm Y_lm(ξ), local in degree and in place;
/// here b(t) = cos(π/2 · log₂ t) for ½ < t < 2, whose squares sum to 1 over the scales (after
/// Narcowich, Petrushev and Ward 2006, doi:10.1137/040614359). The a_lm are those of the log
/// luminance over the sphere of normals, the unseen half mirrored. What the mirror does wrong it
/// does at the rim: a coefficient of scale j counts only where it is farther than π/2^j from there.
/// By scale: ln of the variance, the skewness and ln of the kurtosis, over the solid angle that
/// counts.
///
/// ```
/// use lobes::features::Needlets;
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let plan = Needlets::new()?;
/// let features = plan.of(&image)?;
/// let brighter = plan.of(&image.map(|pixel| pixel.map(|value| 2.0 * value)))?;
/// assert!(features.iter().zip(&brighter).all(|(one, other)| (one - other).abs() < 1e-6));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Needlets {
    spectrum: ImageSpectrum,
    places: Transform,
}

impl Needlets {
    /// The plan.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn new() -> Result<Self> {
        let rings = DEGREE + 2;
        let grid = Grid::gauss_legendre(rings, 2 * rings)?;
        Ok(Self {
            spectrum: ImageSpectrum::new(DEGREE, Continuation::Mirror)?,
            places: Transform::new(&grid, DEGREE)?,
        })
    }

    /// Three numbers a scale, from the coarsest.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture, or one without a pixel at the centre of its sphere.
    pub fn of(&self, image: &SphereImage) -> Result<Vec<f64>> {
        let floor = FLOOR * Luminance::Rec709.of(image.mean());
        if floor.is_nan() || floor <= 0.0 {
            return Err(Error::Black {
                what: "the picture of the sphere",
            });
        }
        let (mut field, _) = self.spectrum.field(image)?;
        for value in &mut field {
            *value = value.max(floor).ln();
        }
        let coefficients = self.spectrum.transform().analyse(&field)?;
        let grid = self.places.grid();
        let columns = grid.columns();
        let mut features = Vec::new();
        for scale in SCALES {
            let mut band = coefficients.clone();
            for m in 0..=DEGREE {
                let (cosine, sine) = band.pair_mut(m);
                for (i, value) in cosine.iter_mut().enumerate() {
                    *value *= window((m + i) as f64, scale);
                }
                for (i, value) in sine.iter_mut().enumerate() {
                    *value *= window((m + i) as f64, scale);
                }
            }
            let map = self.places.synthesise(&band)?;
            let reach = FRAC_PI_2 - PI / f64::from(1 << scale);
            let counted = || {
                (0..grid.rings())
                    .filter(|&ring| grid.colatitude(ring) <= reach)
                    .flat_map(|ring| {
                        let weight = grid.ring_weight(ring);
                        let row = &map[ring * columns..][..columns];
                        row.iter().map(move |value| (weight, *value))
                    })
            };
            let total: f64 = counted().map(|(weight, _)| weight).sum();
            let mean = counted().map(|(w, v)| w * v).sum::<f64>() / total;
            let moment = |n: i32| {
                counted()
                    .map(|(weight, value)| weight * (value - mean).powi(n))
                    .sum::<f64>()
                    / total
            };
            let variance = moment(2) + 1e-9;
            features.extend([
                variance.ln(),
                moment(3) / variance.powf(1.5),
                (moment(4) / (variance * variance)).max(0.1).ln(),
            ]);
        }
        Ok(features)
    }
}

/// b(l / 2^scale).
fn window(degree: f64, scale: i32) -> f64 {
    if degree < 1.0 {
        return 0.0;
    }
    let octaves = degree.log2() - f64::from(scale);
    if octaves.abs() < 1.0 {
        (FRAC_PI_2 * octaves).cos()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    use crate::reflection::Camera;

    #[test]
    fn windows_are_a_partition() {
        for l in 4..=32 {
            let sum: f64 = (0..=6).map(|j| window(f64::from(l), j).powi(2)).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{l}: {sum}");
        }
    }

    /// ln B = a P_8(cos θ) is one degree at the centre of scale 3: its needlet coefficients of that
    /// scale are itself.
    #[test]
    fn one_degree_is_seen_at_its_scale() {
        let legendre8 = |x: f64| {
            let y = x * x;
            ((((6435.0 * y - 12012.0) * y + 6930.0) * y - 1260.0) * y + 35.0) / 128.0
        };
        let size = 256;
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
        let pixels = (0..size * size)
            .map(|i| {
                camera
                    .pixel(size, i / size, i % size)
                    .map_or([0.0; 3], |point| {
                        [(0.5 * legendre8(point.normal.z)).exp(); 3]
                    })
            })
            .collect();
        let image = SphereImage::new(camera, size, pixels).unwrap();
        let features = Needlets::new().unwrap().of(&image).unwrap();
        // The variance of a P_8 over cos θ in [cos reach, 1], reach = π/2 − π/8, by the midpoint
        // rule.
        let low = (FRAC_PI_2 - PI / 8.0).cos();
        let count = 100_000;
        let values: Vec<f64> = (0..count)
            .map(|i| 0.5 * legendre8(low + (1.0 - low) * (f64::from(i) + 0.5) / f64::from(count)))
            .collect();
        let mean = values.iter().sum::<f64>() / f64::from(count);
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(count);
        // The last ring that counts lies up to a ring inside the reach.
        assert!(
            (features[3] - variance.ln()).abs() < 0.1,
            "{} {}",
            features[3],
            variance.ln()
        );
        // The scales two octaves away see next to nothing.
        assert!(features[9] < features[3] - 6.0, "{}", features[9]);
    }
}
