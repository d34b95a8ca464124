//! Environment maps made of other pictures: other mappings, other sizes.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::EnvironmentMap;
use crate::error::check_length;
use crate::numeric::bilinear;
use crate::sphere::Mapping;
use crate::{Error, Result};

/// Samples along a side of a pixel, at least and at most.
const SAMPLES: (usize, usize) = (4, 64);

impl EnvironmentMap {
    /// The environment map of a picture under any mapping, rows from the top, each from the left.
    ///
    /// A lat-long picture is taken as it is. Any other is resampled to a lat-long map of about its
    /// own resolution: n columns for a disc of n pixels across, four times a face's columns for a
    /// cross. Each pixel of the map is the mean over its solid angle: of n × n points that divide
    /// it into equal solid angles, n from 4 to 64 as the picture is denser there, and each
    /// interpolated bilinearly between the centres of the picture's pixels. Pixels whose centres
    /// lie outside the disc or the cross are ignored, whatever they hold.
    ///
    /// Accuracy, measured on fields of range 2 with lobes 30° wide, 192 pixels across: 4e-3 at most
    /// and 4e-5 in the mean over the sphere, falling with the square of the resolution; but for
    /// what is straight behind a mirror ball, where the rim's last half pixel holds 2√(2/n)
    /// radians. What is smaller than a pixel, such as a lamp, keeps its light to 2 %; in a mirror
    /// ball to 5 %.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] when `pixels` does not fit the size; [`Error::Domain`] when the picture
    /// has not the mapping's shape, is smaller than 4 pixels across or larger than 2²⁶ pixels, and
    /// for all that [`new`](Self::new) refuses.
    ///
    /// ```
    /// use lobes::{glam::DVec3, illumination::EnvironmentMap, sphere::Mapping};
    /// // An angular map with a white upper half, and rubbish outside its disc.
    /// let pixels = (0..64 * 64).map(|i| match Mapping::AngularMap.direction(
    ///     (f64::from(i % 64) + 0.5) / 64.0,
    ///     (f64::from(i / 64) + 0.5) / 64.0,
    /// ) {
    ///     Some(direction) => [f64::from(u8::from(direction.y > 0.0)); 3],
    ///     None => [f64::NAN; 3],
    /// });
    /// let map = EnvironmentMap::from_picture("half", Mapping::AngularMap, 64, 64, pixels.collect())?;
    /// assert_eq!((map.width(), map.height()), (64, 32));
    /// assert_eq!(map.radiance(DVec3::Y), [1.0; 3]);
    /// assert!((map.mean()[0] - 0.5).abs() < 1e-3);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn from_picture(
        name: impl Into<String>,
        mapping: Mapping,
        width: usize,
        height: usize,
        mut pixels: Vec<[f64; 3]>,
    ) -> Result<Self> {
        if mapping == Mapping::LatLong {
            return Self::new(name, width, height, pixels);
        }
        if !mapping.fits(width, height) {
            return Err(Error::Domain {
                what: "the width over the height of the picture",
                value: width as f64 / height as f64,
                allowed: "that of its mapping",
            });
        }
        if width < 4 || width.saturating_mul(height) > 1 << 26 {
            return Err(Error::Domain {
                what: "the width of the picture",
                value: width as f64,
                allowed: "at least 4, with at most 2^26 pixels in all",
            });
        }
        check_length("the picture", width * height, pixels.len())?;
        // A pixel outside is marked by NaN, once all others are known to be finite.
        for (index, pixel) in pixels.iter_mut().enumerate() {
            let u = ((index % width) as f64 + 0.5) / width as f64;
            let v = ((index / width) as f64 + 0.5) / height as f64;
            if mapping.direction(u, v).is_none() {
                *pixel = [f64::NAN; 3];
            } else if let Some(&value) = pixel.iter().find(|value| !value.is_finite()) {
                return Err(Error::NotFinite {
                    what: "the picture",
                    index: 3 * index,
                    value,
                });
            } else if let Some(&value) = pixel.iter().find(|value| **value < 0.0) {
                return Err(Error::Domain {
                    what: "a radiance of the picture",
                    value,
                    allowed: "zero or above; negative light comes from resampling filters and must be set to zero",
                });
            }
        }
        let picture = Projected {
            mapping,
            width,
            height,
            pixels,
        };
        let rows = match mapping {
            Mapping::VerticalCross => 2 * (width / 3),
            Mapping::HorizontalCross => 2 * (width / 4),
            _ => width / 2,
        };
        Self::new(name, 2 * rows, rows, picture.lat_long(rows))
    }

    /// The map at another size, each pixel the mean of the pixels that it covers, weighed by the
    /// solid angle that it covers of them.
    ///
    /// The sum of pixels times [`solid_angle`](Self::solid_angle) stays the same but for rounding.
    /// To a larger size the pixels are repeated, not interpolated.
    ///
    /// # Errors
    ///
    /// [`Error::Domain`] unless the width is twice the height, as [`new`](Self::new) has it.
    ///
    /// ```
    /// # use lobes::illumination::EnvironmentMap;
    /// let map = EnvironmentMap::new("m", 8, 4, (0..32).map(|i| [f64::from(i), 1.0, 2.0]).collect())?;
    /// let half = map.resampled(4, 2)?;
    /// assert!((half.pixel(0, 0)[1] - 1.0).abs() < 1e-15);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn resampled(&self, width: usize, height: usize) -> Result<Self> {
        // Refuses a wrong size before any work is done for it.
        if !(2..=1 << 13).contains(&height) || width != 2 * height {
            return Err(Error::Domain {
                what: "the height of the resampled map",
                value: height as f64,
                allowed: "half its width and from 2 to 8192",
            });
        }
        let columns = shares(self.width(), width, |edge| edge);
        let rows = shares(self.height(), height, |edge| -(PI * edge).cos());
        let mut pixels = Vec::with_capacity(width * height);
        for row in &rows {
            for column in &columns {
                let mut sum = [0.0; 3];
                for &(r, weight_r) in row {
                    for &(c, weight_c) in column {
                        for (total, value) in sum.iter_mut().zip(self.pixel(r, c)) {
                            *total += weight_r * weight_c * value;
                        }
                    }
                }
                pixels.push(sum);
            }
        }
        Self::new(self.name(), width, height, pixels)
    }
}

/// For each of `to` intervals of \[0, 1\], which of `from` intervals it overlaps, and with which
/// share of its own measure, where `measure` grows from one end to the other.
fn shares(from: usize, to: usize, measure: impl Fn(f64) -> f64) -> Vec<Vec<(usize, f64)>> {
    (0..to)
        .map(|target| {
            // Edges are fractions target/to and source/from: compared as integers, measured as
            // floats.
            let (start, end) = (target * from, (target + 1) * from);
            let at = |edge: usize| measure(edge as f64 / (from * to) as f64);
            let whole = at(end) - at(start);
            (start / to..end.div_ceil(to))
                .map(|source| {
                    let low = start.max(source * to);
                    let high = end.min((source + 1) * to);
                    (source, (at(high) - at(low)) / whole)
                })
                .collect()
        })
        .collect()
}

/// A picture under a mapping; NaN where it shows nothing.
struct Projected {
    mapping: Mapping,
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
}

impl Projected {
    /// The pixels of a lat-long map of so many rows.
    fn lat_long(&self, rows: usize) -> Vec<[f64; 3]> {
        let mut pixels = Vec::with_capacity(2 * rows * rows);
        for row in 0..rows {
            let edge = |row: usize| (PI * row as f64 / rows as f64).cos();
            let (top, bottom) = (edge(row), edge(row + 1));
            for column in 0..2 * rows {
                let left = PI * (column as f64 / rows as f64 - 1.0);
                let step = PI / rows as f64;
                let centre = direction(0.5 * (top + bottom), left + 0.5 * step);
                let n = self.samples(centre, step);
                let mut sum = [0.0; 3];
                let mut weight = 0.0;
                for i in 0..n {
                    let fraction = |i: usize| (i as f64 + 0.5) / n as f64;
                    let cos = top + (bottom - top) * fraction(i);
                    for j in 0..n {
                        let sample = self.at(direction(cos, left + step * fraction(j)));
                        if let Some(pixel) = sample {
                            weight += 1.0;
                            for (total, value) in sum.iter_mut().zip(pixel) {
                                *total += value;
                            }
                        }
                    }
                }
                pixels.push(sum.map(|total| if weight > 0.0 { total / weight } else { 0.0 }));
            }
        }
        pixels
    }

    /// How many samples a side a pixel of angular size `step` needs: two for each pixel of the
    /// picture that it spans.
    fn samples(&self, centre: DVec3, step: f64) -> usize {
        const SMALL: f64 = 1e-4;
        let (u, v) = self.mapping.position(centre);
        let (across, other) = centre.any_orthonormal_pair();
        let span = [
            across,
            other,
            (across + other) * 0.5f64.sqrt(),
            (across - other) * 0.5f64.sqrt(),
        ]
        .map(|aside| {
            let (u2, v2) = self.mapping.position((centre + SMALL * aside).normalize());
            let pixels = ((u2 - u) * self.width as f64).hypot((v2 - v) * self.height as f64);
            pixels / SMALL * step
        })
        .into_iter()
        .fold(0.0, f64::max);
        ((2.0 * span).ceil() as usize).clamp(SAMPLES.0, SAMPLES.1)
    }

    /// The picture at a direction: bilinear between the pixels that show something; `None` where
    /// all four neighbours show nothing.
    fn at(&self, direction: DVec3) -> Option<[f64; 3]> {
        let (u, v) = self.mapping.position(direction);
        let (x, y) = (u * self.width as f64 - 0.5, v * self.height as f64 - 0.5);
        bilinear::mean(bilinear::corners(self.width, self.height, x, y), |index| {
            let pixel = self.pixels[index];
            (!pixel[0].is_nan()).then_some(pixel)
        })
    }
}

/// The direction at a cosine from the zenith and an azimuth from −z towards +x.
fn direction(cos: f64, azimuth: f64) -> DVec3 {
    let sin_theta = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
    let (sin, cos_azimuth) = azimuth.rem_euclid(TAU).sin_cos();
    DVec3::new(sin_theta * sin, cos, -sin_theta * cos_azimuth)
}
