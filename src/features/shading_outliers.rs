//! What in a picture of a sphere is not its body's shading: prints, reflections, and what is burnt out.

use glam::DVec3;
use nalgebra::{Cholesky, DMatrix};

use crate::error::check_length;
use crate::harmonics::Basis;
use crate::illumination::Luminance;
use crate::reflectance::lambert;
use crate::reflection::{SphereImage, check_size};
use crate::sphere::to_harmonic;
use crate::{Error, Parallelism, Result};

/// The largest degree of the shading that is fitted: of degree 8 a matte surface keeps a hundredth of
/// what it keeps of degree 0.
const LAST: usize = 6;

/// The deviation of light's amplitudes over that of what is left, for the least squares' prior.
const PRIOR: f64 = 0.02;

/// Steps of the fit; in the first ones Huber's weights, from which Tukey's start.
const STEPS: usize = 8;
const STEPS_OF_HUBER: usize = 2;

/// Tukey's weights vanish at so many deviations.
const TUKEY: f64 = 4.0;

/// A place that is off by so many deviations is an outlier.
const OFF: f64 = 3.5;

/// No deviation is taken to be less than this share of the shading.
const LEAST_SCALE: f64 = 0.03;

/// What is added to the shading that a difference is taken over, as a share of the mean.
const FLOOR: f64 = 0.3;

/// Of a reflection the sine of the angle to the colours between the body's and the light's.
const CONE: f64 = 0.3;

/// So many of nine places, itself among them, must be outliers of one kind.
const TOGETHER: usize = 4;

/// What is farther out than this share of the radius is not looked at: there shading is steepest.
const REACH: f64 = 0.93;

/// What is seen at a place of a sphere.
///
/// ```
/// use lobes::features::Seen;
/// assert!(Seen::Reflection.is_usable() && !Seen::Print.is_usable());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// The body's shading.
    Body,
    /// More than that, of a colour between the body's and the light's: what it mirrors.
    Reflection,
    /// Less than that, or more of another colour: a print, a label, a seam, a hole, a shadow, what
    /// stands before the sphere.
    Print,
    /// What the camera cut off.
    Clipped,
}

impl Seen {
    /// Whether it says something of the surface: all but prints and what is clipped.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Body | Self::Reflection)
    }
}

/// What is seen at each place of a picture of a sphere.
///
/// ```
/// # use lobes::features::{Seen, ShadingOutliers};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| camera.pixel(64, i / 64, i % 64).map_or([0.0; 3], |_| [1.0; 3]));
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let mask = ShadingOutliers::new(64)?.of(&image, None)?;
/// assert_eq!(mask.get(32, 32), Some(Seen::Body));
/// assert_eq!(mask.get(0, 0), None); // beside the sphere
/// assert_eq!(mask.usable(), 1.0);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SeenMask {
    size: usize,
    seen: Vec<Option<Seen>>,
}

impl SeenMask {
    /// What is seen at a pixel; nothing near the rim, beside the sphere and past the last pixel.
    pub fn get(&self, row: usize, column: usize) -> Option<Seen> {
        let inside = row < self.size && column < self.size;
        inside
            .then(|| self.seen[row * self.size + column])
            .flatten()
    }

    /// The share of the places looked at where this is seen.
    pub fn share(&self, what: Seen) -> f64 {
        self.share_where(|seen| seen == what)
    }

    /// The share that is usable: [`Seen::is_usable`].
    pub fn usable(&self) -> f64 {
        self.share_where(Seen::is_usable)
    }

    fn share_where(&self, counts: impl Fn(Seen) -> bool) -> f64 {
        let all = self.seen.iter().flatten().count();
        let such = self.seen.iter().flatten().filter(|seen| counts(**seen));
        such.count() as f64 / all.max(1) as f64
    }
}

/// The plan of what in pictures of a sphere is not its body's shading.
///
/// Under any light a matte sphere shows Σ A_l L_lm Y_lm(n) in each channel
/// ([`ShadingResidual`](super::ShadingResidual)), here of degrees 0, 1, 2, 4 and 6. It is fitted by least
/// squares with weights, one for all channels of a place, that are found again at each step: Huber's at
/// first, then Tukey's, 1 − (e/4s)² squared, with s = 1.4826 times the median of e, 0.03 at least. e is
/// the root mean square over the channels of (v − shading)/(shading + 0.3 mean). What is off by more than
/// 3.5 s is an outlier, if three of the eight places about it are off the same way.
///
/// Of a dielectric body lit by one light the colours are the body's and the light's mixed (Shafer 1985,
/// doi:10.1002/col.5080100409). So an outlier that is brighter, by a colour between the shading's and
/// that of the light, is a reflection, and every other one a print. The light is taken to be white, as
/// cameras make it, to sin 0.3 in direction of colour.
///
/// Limits: a print of more than half of the sphere is taken for the body, and the body for a print; a
/// white print on a black or grey body for a reflection; where a hard lamp sets, degrees to 6 are not all
/// of its shading, and a twentieth of the sphere may be taken for outliers; of a mirror no body is seen and hardly anything
/// is an outlier. How well prints are found: `docs/explanation/photographs.md`.
///
/// ```
/// use lobes::features::{Seen, ShadingOutliers};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage}};
/// // A red ball in light from above, with a black band across it.
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let pixels = (0..96 * 96).map(|i| match camera.pixel(96, i / 96, i % 96) {
///     Some(at) if at.normal.y.abs() < 0.1 => [0.02; 3],
///     Some(at) => [0.6, 0.1, 0.05].map(|albedo| albedo * (1.0 + 0.5 * at.normal.y)),
///     None => [0.0; 3],
/// });
/// let image = SphereImage::new(camera, 96, pixels.collect())?;
/// let mask = ShadingOutliers::new(96)?.of(&image, None)?;
/// assert_eq!(mask.get(48, 40), Some(Seen::Print));
/// assert_eq!(mask.get(20, 48), Some(Seen::Body));
/// assert!((mask.usable() - 0.87).abs() < 0.03, "{}", mask.usable());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ShadingOutliers {
    size: usize,
    /// Pixels that are looked at.
    places: Vec<usize>,
    /// Those of them that are fitted: one in four.
    fitted: Vec<usize>,
    /// A_l/max(l, 1) Y_lm at each place, a column each.
    shadings: DMatrix<f64>,
}

impl ShadingOutliers {
    /// The plan for pictures of `size` pixels a side, taken from far away.
    ///
    /// # Errors
    /// [`Error::Domain`] for a size that no picture of a sphere has.
    pub fn new(size: usize) -> Result<Self> {
        check_size(size)?;
        let basis = Basis::new(LAST)?;
        let place = |index: usize| (2 * index + 1) as f64 / size as f64 - 1.0;
        let (mut places, mut fitted, mut normals) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..size * size {
            let (row, column) = (i / size, i % size);
            let (x, y) = (place(column), -place(row));
            let square = x * x + y * y;
            if square < REACH * REACH {
                if row % 2 == 0 && column % 2 == 0 {
                    fitted.push(places.len());
                }
                places.push(i);
                normals.push(to_harmonic(DVec3::new(x, y, (1.0 - square).sqrt())));
            }
        }
        let mut values = vec![0.0; normals.len() * basis.count()];
        basis.values(&normals, &mut values, Parallelism::Sequential)?;
        // By order, cosines before sines, degrees from the order on.
        let degrees = (0..=LAST).flat_map(|m| {
            let columns = if m == 0 { 1 } else { 2 };
            (0..columns).flat_map(move |_| m..=LAST)
        });
        let kept: Vec<(usize, f64)> = degrees
            .enumerate()
            .map(|(index, l)| (index, lambert::transfer(l) / l.max(1) as f64))
            .filter(|(_, transfer)| *transfer != 0.0)
            .collect();
        let shadings = DMatrix::from_fn(kept.len(), normals.len(), |row, column| {
            let (index, transfer) = kept[row];
            values[column * basis.count() + index] * transfer
        });
        Ok(Self {
            size,
            places,
            fitted,
            shadings,
        })
    }

    /// What is seen where; a channel at `ceiling` or above is clipped.
    ///
    /// # Errors
    /// [`Error::Length`] for a picture of another size; [`Error::Black`] for a black one.
    pub fn of(&self, image: &SphereImage, ceiling: Option<f64>) -> Result<SeenMask> {
        check_length("a side of the picture", self.size, image.size())?;
        let mean = Luminance::Rec709.of(image.mean());
        if mean.is_nan() || mean <= 0.0 {
            return Err(Error::Black {
                what: "the picture of the sphere",
            });
        }
        let places = self.places.iter();
        let values: Vec<[f64; 3]> = places
            .map(|&i| image.get(i / self.size, i % self.size).unwrap_or_default())
            .collect();
        // A mean over a pixel that is partly clipped counts as clipped too.
        let ceiling = ceiling.map_or(f64::INFINITY, |ceiling| 0.98 * ceiling);
        let clipped = |value: &[f64; 3]| value.iter().any(|channel| *channel >= ceiling);
        let relative: Vec<[f64; 3]> = values.iter().map(|v| v.map(|v| v / mean)).collect();
        // What is clipped takes part: it is body at least as bright as that, or an outlier.
        let fit = self.fit(&relative);
        let mut seen = vec![None; self.size * self.size];
        for (place, &i) in self.places.iter().enumerate() {
            seen[i] = Some(if clipped(&values[place]) {
                Seen::Clipped
            } else {
                let shading = fit.at(self, place);
                kind(relative[place], shading, OFF * fit.scale)
            });
        }
        Ok(SeenMask {
            size: self.size,
            seen: self.without_specks(&seen),
        })
    }

    fn fit(&self, values: &[[f64; 3]]) -> Fit {
        let count = self.shadings.nrows();
        let mut fit = Fit {
            amplitudes: DMatrix::zeros(count, 3),
            scale: LEAST_SCALE,
        };
        let mut weights = vec![1.0; self.fitted.len()];
        for step in 0..STEPS {
            let mut gram = DMatrix::<f64>::zeros(count, count);
            let mut right = DMatrix::<f64>::zeros(count, 3);
            for (&place, &weight) in self.fitted.iter().zip(&weights) {
                if weight > 0.0 {
                    let column = self.shadings.column(place);
                    gram.syger(weight, &column, &column, 1.0);
                    for (c, value) in values[place].into_iter().enumerate() {
                        right.column_mut(c).axpy(weight * value, &column, 1.0);
                    }
                }
            }
            let prior = PRIOR * PRIOR * weights.iter().sum::<f64>();
            for i in 0..count {
                gram[(i, i)] += prior;
            }
            // The prior makes it positive definite, unless everything is an outlier.
            let Some(gram) = Cholesky::new(gram) else {
                return fit;
            };
            fit.amplitudes = gram.solve(&right);
            let off: Vec<f64> = self
                .fitted
                .iter()
                .map(|&place| difference(values[place], fit.at(self, place)))
                .collect();
            let mut ordered = off.clone();
            let middle = ordered.len() / 2;
            let (_, median, _) = ordered.select_nth_unstable_by(middle, f64::total_cmp);
            fit.scale = (1.4826 * *median).max(LEAST_SCALE);
            for (weight, off) in weights.iter_mut().zip(off) {
                let part = off / fit.scale;
                *weight = if step < STEPS_OF_HUBER {
                    part.recip().min(1.0)
                } else {
                    (1.0 - (part / TUKEY).powi(2)).max(0.0).powi(2)
                };
            }
        }
        fit
    }

    /// Outliers of which hardly another of their kind is near are the body's own grain.
    fn without_specks(&self, seen: &[Option<Seen>]) -> Vec<Option<Seen>> {
        let mut cleaned = seen.to_vec();
        for &i in &self.places {
            let kind = seen[i];
            if !matches!(kind, Some(Seen::Reflection | Seen::Print)) {
                continue;
            }
            let (row, column) = (i / self.size, i % self.size);
            let near = |at: usize| at.saturating_sub(1)..(at + 2).min(self.size);
            let about = near(row).flat_map(|row| near(column).map(move |column| (row, column)));
            let alike = about.filter(|(row, column)| seen[row * self.size + column] == kind);
            if alike.count() < TOGETHER {
                cleaned[i] = Some(Seen::Body);
            }
        }
        cleaned
    }
}

/// The shading of a body.
struct Fit {
    amplitudes: DMatrix<f64>,
    /// The deviation of what is left, as [`difference`] has it.
    scale: f64,
}

impl Fit {
    fn at(&self, plan: &ShadingOutliers, place: usize) -> [f64; 3] {
        let column = plan.shadings.column(place);
        [0, 1, 2].map(|c| column.dot(&self.amplitudes.column(c)))
    }
}

/// The root mean square over the channels of what a value is off its shading, over that.
fn difference(value: [f64; 3], shading: [f64; 3]) -> f64 {
    let squares = value.into_iter().zip(shading);
    let squares = squares.map(|(value, shading)| {
        let part = (value - shading) / (shading.max(0.0) + FLOOR);
        part * part
    });
    (squares.sum::<f64>() / 3.0).sqrt()
}

/// What is seen where a value is off its shading by so much at most.
fn kind(value: [f64; 3], shading: [f64; 3], most: f64) -> Seen {
    if difference(value, shading) < most {
        return Seen::Body;
    }
    let left = DVec3::from_array(value) - DVec3::from_array(shading);
    let body = DVec3::from_array(shading).max(DVec3::ZERO);
    let (body, light) = (
        body.normalize_or(DVec3::ONE.normalize()),
        DVec3::ONE.normalize(),
    );
    if left.element_sum() <= 0.0 {
        return Seen::Print;
    }
    // The nearest of the colours between the two.
    let way = light - body;
    let part = {
        // Of left, stretched to meet the line from one to the other in the plane of both.
        let (a, b) = (left.dot(body), left.dot(light));
        let cos = body.dot(light);
        let (of_body, of_light) = (a - cos * b, b - cos * a);
        let both = of_body.max(0.0) + of_light.max(0.0);
        if both > 0.0 {
            of_light.max(0.0) / both
        } else {
            0.5
        }
    };
    let nearest = (body + way * part).normalize();
    let cos = left.dot(nearest) / left.length();
    if cos > 0.0 && (1.0 - cos * cos).max(0.0).sqrt() < CONE {
        Seen::Reflection
    } else {
        Seen::Print
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflection::Camera;

    /// A picture of what each normal shows.
    fn image(of: impl Fn(DVec3) -> [f64; 3]) -> SphereImage {
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
        let pixel = |i: usize| camera.pixel(96, i / 96, i % 96);
        let pixels = (0..96 * 96).map(|i| pixel(i).map_or([0.0; 3], |at| of(at.normal)));
        SphereImage::new(camera, 96, pixels.collect()).unwrap()
    }

    /// A blue ball below one lamp.
    fn body(normal: DVec3) -> [f64; 3] {
        let light = 0.1 + normal.dot(DVec3::new(0.3, 0.6, 0.74)).max(0.0);
        [0.1 * light, 0.15 * light, 0.7 * light]
    }

    fn mask(of: impl Fn(DVec3) -> [f64; 3], ceiling: Option<f64>) -> SeenMask {
        let plan = ShadingOutliers::new(96).unwrap();
        plan.of(&image(of), ceiling).unwrap()
    }

    #[test]
    fn a_matte_ball_is_all_body() {
        let mask = mask(body, None);
        // Where the lamp sets, degrees to 6 are not all of its shading.
        assert!(mask.share(Seen::Body) > 0.9, "{}", mask.share(Seen::Body));
    }

    /// A black disc, an orange one and a white highlight, of known places.
    #[test]
    fn prints_and_highlights_are_told_apart() {
        let [black, orange, lamp] = [
            DVec3::new(-0.5, 0.2, 0.84),
            DVec3::new(0.4, -0.4, 0.82),
            DVec3::new(0.2, 0.5, 0.84),
        ]
        .map(DVec3::normalize);
        let within = |normal: DVec3, centre: DVec3| normal.dot(centre) > 0.97;
        let mask = mask(
            |normal| {
                let [r, g, b] = body(normal);
                if within(normal, black) {
                    [0.1 * b, 0.1 * b, 0.1 * b]
                } else if within(normal, orange) {
                    [b, 0.5 * b, 0.05 * b]
                } else if within(normal, lamp) {
                    [r + 0.8, g + 0.8, b + 0.8]
                } else {
                    [r, g, b]
                }
            },
            None,
        );
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
        let (mut right, mut all, mut found, mut painted) = (0, 0, 0, 0);
        for i in 0..96 * 96 {
            let (row, column) = (i / 96, i % 96);
            let Some(said) = mask.get(row, column) else {
                continue;
            };
            let normal = camera.pixel(96, row, column).unwrap().normal;
            let truth = if within(normal, black) || within(normal, orange) {
                Seen::Print
            } else if within(normal, lamp) {
                Seen::Reflection
            } else {
                Seen::Body
            };
            all += 1;
            right += usize::from(said == truth);
            painted += usize::from(truth == Seen::Print);
            found += usize::from(truth == Seen::Print && said == truth);
        }
        assert!(right * 100 > all * 90, "{right} of {all}");
        assert!(found * 100 > painted * 85, "{found} of {painted}");
    }

    #[test]
    fn what_is_clipped_is_not_usable() {
        let mask = mask(
            |normal| body(normal).map(|value| value.min(0.72)),
            Some(0.72),
        );
        let (clipped, usable) = (mask.share(Seen::Clipped), mask.usable());
        assert!(
            clipped > 0.08 && usable + clipped > 0.95,
            "{clipped} {usable}"
        );
        // All of it: nothing is left.
        let plan = ShadingOutliers::new(96).unwrap();
        let white = image(|_| [1.0; 3]);
        assert_eq!(plan.of(&white, Some(1.0)).unwrap().usable(), 0.0);
    }

    #[test]
    fn other_pictures_are_refused() {
        let plan = ShadingOutliers::new(64).unwrap();
        assert!(plan.of(&image(body), None).is_err(), "another size");
        let plan = ShadingOutliers::new(96).unwrap();
        assert!(plan.of(&image(|_| [0.0; 3]), None).is_err(), "black");
        assert!(ShadingOutliers::new(0).is_err());
    }
}
