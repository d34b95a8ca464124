//! The sphere in a picture: found, and cut out.

use glam::DVec3;

use super::circle::Circle;
use super::outline;
use super::picture::Picture;
use crate::illumination::Luminance;
use crate::numeric::bilinear;
use crate::reflection::{Camera, SphereImage};
use crate::{Error, Result};

/// The sphere of a picture, cut out.
///
/// ```
/// use lobes::picture::{Circle, Picture, Sphere};
/// // A disc that is brighter towards the upper right, as a matte ball is under one light.
/// let shade = |x: f64, y: f64| if x.hypot(y) < 60.0 { 0.2 + 0.4 * (0.5 + (x - y) / 170.0) } else { 0.0 };
/// let pixels = (0..160 * 160).map(|i| [shade((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5); 3]);
/// let picture = Picture::linear(160, 160, pixels.collect())?;
/// let circle = Circle { x: 80.0, y: 80.0, radius: 60.0 };
/// let sphere = picture.sphere(circle)?;
/// assert_eq!(sphere.image.size(), Sphere::SIZE);
/// assert!(sphere.is_grey() && sphere.seen > 0.999);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Sphere {
    /// Its picture, [`Self::SIZE`] pixels a side. The camera stands towards +z: orthographic, or as
    /// far as the focal length says.
    pub image: SphereImage,
    /// The share of its pixels that are saturated.
    pub saturated: f64,
    /// The share of its circle that lies in the picture; the rest was taken from what is nearest.
    pub seen: f64,
    /// Whether values above some limit were cut off, as a camera's and those of codes are.
    pub clipped: bool,
    /// From which value on a pixel is saturated, where there is such a value.
    pub ceiling: Option<f64>,
}

impl Sphere {
    /// Pixels a side of every sphere that is read, those to learn from and those to be judged.
    pub const SIZE: usize = 96;

    /// Whether all three channels are one.
    pub fn is_grey(&self) -> bool {
        let pixels = || self.image.iter().map(|(_, _, rgb)| rgb);
        let largest = pixels().fold(0.0, |largest, rgb| f64::max(largest, rgb[1]));
        let close = 1e-3 * largest;
        let mut all = pixels();
        all.all(|[r, g, b]| (r - g).abs() <= close && (b - g).abs() <= close)
    }
}

/// The largest share of saturated pixels of a sphere that can still be read.
const MOST_SATURATED: f64 = 0.9;

/// The least share of a circle that must lie in the picture: with a little more than a third of the
/// radius beyond one side of it.
const LEAST_SEEN: f64 = 0.85;

/// A plateau at the largest value that takes up this share of a linear picture's sphere was cut off
/// there.
const PLATEAU: f64 = 2e-3;

impl Picture {
    /// Where the sphere is: by the mask where there is one, else found in the picture.
    ///
    /// What was found should be looked at: a picture full of edges can hold a circle that is no
    /// sphere.
    ///
    /// # Errors
    /// [`Error::NoSphere`] for a mask that is not round, a picture without a sphere, and one in which
    /// the sphere lies in a frame, as on a print that is photographed again.
    pub fn circle(&self) -> Result<Circle> {
        Ok(self.circles()?.0)
    }

    /// [`circle`](Self::circle), and what else in the picture may be a sphere: round things apart
    /// from it, of a similar size and almost as well seen. A picture with a mask, or of linear
    /// radiance before a background of one value, has one.
    ///
    /// # Errors
    /// As [`circle`](Self::circle).
    pub fn circles(&self) -> Result<(Circle, Vec<Circle>)> {
        match &self.mask {
            Some(mask) => Ok((outline::of_mask(mask, self.width)?, Vec::new())),
            None => outline::find(self),
        }
    }

    /// The sphere within a circle, cut out: each pixel the mean of what it covers.
    ///
    /// Only pixels that lie in the circle as a whole are read, so that nothing of the background is
    /// mixed in; what lies farther out is taken from the nearest of them. So is what lies beyond
    /// the border of the picture, which may cut off 15 % of the sphere.
    ///
    /// # Errors
    /// [`Error::CircleOutside`] for a circle of which less than 85 % lies in the picture, [`Error::TooSmall`] for one
    /// of less than 8 pixels in radius, [`Error::Black`] and [`Error::Saturated`] for a sphere that
    /// is black or all but saturated.
    pub fn sphere(&self, circle: Circle) -> Result<Sphere> {
        let Circle { x, y, radius } = circle;
        let seen = circle.share_within(self.width, self.height);
        if !(seen >= LEAST_SEEN) {
            return Err(Error::CircleOutside {
                x,
                y,
                radius,
                width: self.width,
                height: self.height,
            });
        }
        if radius < 8.0 {
            return Err(Error::TooSmall {
                what: "the radius of the sphere",
                pixels: radius,
                least: 8.0,
                purpose: "to be read",
            });
        }
        let ceiling = self.ceiling_within(circle);
        // A mean of pixels at the ceiling may be rounded below it.
        let saturated_from = ceiling * (1.0 - 1e-12);
        let size = Sphere::SIZE;
        let pitch = 2.0 * radius / size as f64;
        let samples = (pitch.ceil() as usize).max(1);
        // A whole pixel farther in than the outline, and what bilinear interpolation reaches for
        // beyond.
        let limit = radius - 1.5;
        let deep = limit - 0.7;
        let inner = (radius - 0.7) * (radius - 0.7);
        let whole = |column: usize, row: usize| {
            let (right, down) = (column as f64 + 0.5 - x, row as f64 + 0.5 - y);
            right * right + down * down < inner
        };
        let (mut clipped, mut count) = (0.0, 0.0);
        let mut pixels = Vec::with_capacity(size * size);
        for i in 0..size * size {
            let (row, column) = ((i / size) as f64, (i % size) as f64);
            let (mut sum, mut inside) = ([0.0; 3], 0.0);
            for j in 0..samples * samples {
                let (v, u) = ((j / samples) as f64, (j % samples) as f64);
                let part = samples as f64;
                let mut right = (column + (u + 0.5) / part) * pitch - radius;
                let mut down = (row + (v + 0.5) / part) * pitch - radius;
                // So far in, every pixel beside the point counts.
                let rgb = if right * right + down * down < deep * deep {
                    let (column, row) = (x + right - 0.5, y + down - 0.5);
                    let corners = bilinear::corners(self.width, self.height, column, row);
                    self.pixels.weighted_sum(corners.into_iter())
                } else {
                    let off = right.hypot(down);
                    if off > radius {
                        continue;
                    }
                    if off > limit {
                        right *= limit / off;
                        down *= limit / off;
                    }
                    self.interpolate(x + right, y + down, whole)
                };
                for channel in 0..3 {
                    sum[channel] += rgb[channel];
                }
                inside += 1.0;
                count += 1.0;
                clipped += f64::from(u8::from(rgb.iter().any(|value| *value >= saturated_from)));
            }
            pixels.push(sum.map(|sum| sum / f64::max(inside, 1.0)));
        }
        let saturated = clipped / f64::max(count, 1.0);
        if saturated > MOST_SATURATED {
            return Err(Error::Saturated { share: saturated });
        }
        let camera = match self.focal {
            // The outline is seen under the angle whose tangent is r/f.
            Some(focal) => {
                let distance = focal.hypot(radius) / radius;
                Camera::perspective(DVec3::Z, DVec3::Y, distance)?
            }
            None => Camera::orthographic(DVec3::Z, DVec3::Y)?,
        };
        let image = SphereImage::new(camera, size, pixels)?;
        let mean = Luminance::Rec709.of(image.mean());
        if mean.is_nan() || mean <= 0.0 {
            return Err(Error::Black { what: "the sphere" });
        }
        Ok(Sphere {
            image,
            saturated,
            seen,
            clipped: ceiling.is_finite(),
            ceiling: Some(ceiling).filter(|ceiling| ceiling.is_finite()),
        })
    }

    /// The value from which on the pixels within a circle are saturated: that of codes or, in
    /// radiance, the largest one where so many pixels have it that they were cut off there.
    fn ceiling_within(&self, circle: Circle) -> f64 {
        if self.encoded {
            return self.ceiling;
        }
        let (mut largest, mut at, mut count) = (0.0f64, 0.0, 0.0);
        for (i, rgb) in self.radiance().enumerate() {
            let (x, y) = ((i % self.width) as f64 + 0.5, (i / self.width) as f64 + 0.5);
            if (x - circle.x).hypot(y - circle.y) >= circle.radius - 0.7 {
                continue;
            }
            count += 1.0;
            let brightest = rgb.iter().copied().fold(0.0, f64::max);
            if brightest > largest {
                (largest, at) = (brightest, 1.0);
            } else if brightest == largest {
                at += 1.0;
            }
        }
        // A flat picture has one value, and is not cut off.
        let share = at / f64::max(count, 1.0);
        if at >= 8.0 && share > PLATEAU && share < 0.99 {
            largest
        } else {
            f64::INFINITY
        }
    }

    /// Bilinear among the pixels that `counts` (column, row) lets count, with the picture's edge
    /// continued; the nearest where none does.
    fn interpolate(&self, x: f64, y: f64, counts: impl Fn(usize, usize) -> bool) -> [f64; 3] {
        let corners = bilinear::corners(self.width, self.height, x - 0.5, y - 0.5);
        let value = |index: usize| {
            counts(index % self.width, index / self.width).then(|| self.pixels.at(index))
        };
        bilinear::mean(corners, value).unwrap_or_else(|| {
            let nearest = corners.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            self.pixels.at(nearest.map_or(0, |(index, _)| index))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "files")]
    use crate::files::linear_of_srgb;

    fn ball() -> Picture {
        // 1 on the left, 3 on the right.
        let pixels = (0..200 * 200).map(|i| [if i % 200 < 100 { 1.0 } else { 3.0 }; 3]);
        Picture::linear(200, 200, pixels.collect()).unwrap()
    }

    const CIRCLE: Circle = Circle {
        x: 100.0,
        y: 100.0,
        radius: 64.0,
    };

    #[test]
    fn a_sphere_is_the_mean_of_what_it_covers() {
        let sphere = ball().sphere(CIRCLE).unwrap();
        assert!(
            (sphere.saturated - 0.5).abs() < 0.01,
            "half of it at the largest value: cut off there"
        );
        assert_eq!(sphere.image.get(48, 12), Some([1.0; 3]));
        assert_eq!(sphere.image.get(48, 84), Some([3.0; 3]));
        assert!(sphere.image.camera().distance().is_none());
        assert!(sphere.is_grey());
        let near = ball().with_focal_length(64.0).unwrap();
        let distance = near.sphere(CIRCLE).unwrap().image.camera().distance();
        assert!(
            (distance.unwrap() - 2f64.sqrt()).abs() < 1e-12,
            "f = r is seen under 90°"
        );
    }

    #[test]
    fn nothing_behind_the_sphere_is_mixed_in() {
        for radius in [12.3, 40.0, 150.0] {
            let side = (2.0f64 * radius).ceil() as usize + 9;
            let (x, y) = (radius + 3.2, radius + 4.9);
            let pixels = (0..side * side).map(|i| {
                let off = ((i % side) as f64 + 0.5 - x).hypot((i / side) as f64 + 0.5 - y);
                [if off < radius - 0.7 { 1.0 } else { 1e6 }; 3]
            });
            let picture = Picture::linear(side, side, pixels.collect()).unwrap();
            let sphere = picture.sphere(Circle { x, y, radius }).unwrap();
            assert!(
                sphere
                    .image
                    .iter()
                    .all(|(_, _, rgb)| (rgb[0] - 1.0).abs() < 1e-12),
                "{radius}"
            );
        }
    }

    /// A segment of height h is (acos d − d √(1 − d²))/π of the disc, d = 1 − h.
    #[test]
    fn a_sphere_that_the_border_cuts_is_read_from_what_is_seen() {
        // Columns have their number as a value, less 40, and a border that was 20 columns there.
        let pixels = (0..200 * 200).map(|i| [1.0 + (i % 200) as f64; 3]);
        let picture = Picture::linear(200, 200, pixels.collect()).unwrap();
        let at = |x: f64| {
            picture.sphere(Circle {
                x,
                y: 100.0,
                radius: 64.0,
            })
        };
        for height in [0.0, 0.1, 0.3] {
            let sphere = at(64.0 * (1.0 - height)).unwrap();
            let d: f64 = 1.0 - height;
            let cut = (d.acos() - d * (1.0 - d * d).sqrt()) / std::f64::consts::PI;
            assert!((sphere.seen - (1.0 - cut)).abs() < 2e-3, "{height}");
            // What is in the picture is as it was; what is not has the value of its border.
            for (row, column, rgb) in sphere.image.iter() {
                let off = (row as f64 - 47.5).hypot(column as f64 - 47.5);
                let place = 64.0 * (1.0 - height) + (column as f64 - 47.5) * 4.0 / 3.0;
                if off < 44.0 {
                    let expected = (place + 0.5).max(1.0);
                    assert!((rgb[0] - expected).abs() < 0.4, "{rgb:?} {expected}");
                }
            }
        }
        assert!(matches!(at(64.0 * 0.5), Err(Error::CircleOutside { .. })));
    }

    #[test]
    fn what_cannot_be_read_is_refused() {
        let picture = ball();
        // The circle may not leave the picture by much, nor be tiny.
        for (x, radius) in [(30.0, 64.0), (100.0, 130.0), (100.0, 4.0), (f64::NAN, 64.0)] {
            let circle = Circle {
                x,
                y: 100.0,
                radius,
            };
            assert!(picture.sphere(circle).is_err());
        }
        let flat = |value: f64| Picture::linear(200, 200, vec![[value; 3]; 200 * 200]).unwrap();
        let message = flat(0.0).sphere(CIRCLE).unwrap_err().to_string();
        assert!(message.contains("black"), "{message}");
        assert!(Picture::linear(2, 2, vec![[1.0; 3]; 3]).is_err());
        assert!(Picture::linear(0, 7, Vec::new()).is_err());
        assert!(Picture::linear(1, 1, vec![[1.0, f64::NAN, 1.0]]).is_err());
        assert!(ball().with_mask(vec![1.0; 3]).is_err());
        assert!(ball().with_focal_length(0.0).is_err());
        assert!(!ball().with_mask(vec![1.0; 200 * 200]).unwrap().has_mask());
    }

    #[cfg(feature = "files")]
    #[test]
    fn codes_are_decoded_and_the_last_ones_are_saturated() {
        let half = [128.0 / 255.0; 3];
        let mut codes = vec![half; 200 * 200];
        let picture = Picture::encoded(200, 200, codes.clone()).unwrap();
        assert!((picture.get(0, 0).unwrap()[1] - linear_of_srgb(128.0 / 255.0)).abs() < 1e-15);
        let sphere = picture.sphere(CIRCLE).unwrap();
        assert_eq!((sphere.saturated, sphere.clipped), (0.0, true));
        for code in codes.iter_mut().take(100 * 200) {
            *code = [0.5, 1.0, 0.5];
        }
        let sphere = Picture::encoded(200, 200, codes)
            .unwrap()
            .sphere(CIRCLE)
            .unwrap();
        assert!(
            (sphere.saturated - 0.5).abs() < 0.01,
            "{}",
            sphere.saturated
        );
        let white = Picture::encoded(200, 200, vec![[1.0; 3]; 200 * 200]).unwrap();
        let message = white.sphere(CIRCLE).unwrap_err().to_string();
        assert!(message.contains("saturated"), "{message}");
    }
}
