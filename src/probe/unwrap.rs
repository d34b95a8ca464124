//! A mirror ball unwrapped for a camera at a finite distance.

use std::f64::consts::PI;

use glam::DVec3;

use super::Radiance;
use crate::illumination::EnvironmentMap;
use crate::numeric::bilinear;
use crate::picture::Circle;
use crate::{Error, Parallelism, Result};

/// Samples along a side of a map's pixel, at least and at most.
const SAMPLES: (usize, usize) = (3, 16);

/// The last part of the outline is not read: pixels there are half background.
const RIM: f64 = 1.2;

/// What is hidden is filled from a map of so many rows.
const FILL_ROWS: usize = 24;

/// A mirror ball in a picture.
///
/// ```
/// use lobes::glam::DVec3;
/// use lobes::picture::Circle;
/// use lobes::probe::MirrorBall;
/// let circle = Circle { x: 50.0, y: 50.0, radius: 40.0 };
/// let ball = MirrorBall { circle, distance: None, reflectance: [0.7; 3], photographer: 0.0 };
/// // From far away, light from the right is mirrored where the normal is at 45°.
/// let (x, y) = ball.place(DVec3::X).unwrap();
/// assert!((x - (50.0 + 40.0 * 0.5f64.sqrt())).abs() < 1e-9 && (y - 50.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorBall {
    /// Its outline.
    pub circle: Circle,
    /// How far the camera is from its centre, in radii; none for a camera that is far away.
    pub distance: Option<f64>,
    /// What it reflects of each channel.
    pub reflectance: [f64; 3],
    /// The half angle about the camera, in radians, in which the photographer stands; 0 for nobody.
    pub photographer: f64,
}

/// A lat-long map with what of each pixel was seen.
///
/// ```
/// use lobes::Parallelism;
/// use lobes::picture::Circle;
/// use lobes::probe::{MirrorBall, Radiance};
/// // A ball that reflects half of light of radiance 2 everywhere.
/// let picture = Radiance {
///     width: 64,
///     height: 64,
///     pixels: vec![[1.0; 3]; 64 * 64],
///     clipped: vec![false; 64 * 64],
///     exposures: vec![1.0],
/// };
/// let circle = Circle { x: 32.0, y: 32.0, radius: 30.0 };
/// let ball = MirrorBall { circle, distance: Some(10.0), reflectance: [0.5; 3], photographer: 0.0 };
/// let map = ball.unwrap(&picture, None, 16, Parallelism::Sequential)?;
/// assert!(map.pixels.iter().all(|rgb| (rgb[1] - 2.0).abs() < 1e-9));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeMap {
    /// Rows; there are twice as many columns.
    pub rows: usize,
    /// Radiance, row 0 the zenith; what was not seen is filled smoothly from about it.
    pub pixels: Vec<[f64; 3]>,
    /// The share of each pixel that was seen, from 0 to 1.
    pub alpha: Vec<f64>,
    /// The share of each pixel that every exposure clipped.
    pub clipped: Vec<f64>,
    /// How finely it was seen: pixels of the picture for a steradian.
    density: Vec<f64>,
}

impl MirrorBall {
    /// The angle of the ball's normal from the line of sight, for light from `polar` away from it.
    ///
    /// With D the distance in radii, a normal at θ mirrors what is at 2θ + atan2(sin θ, D − cos θ),
    /// which grows with θ; none in the blind cone of half angle asin(1/D) behind the ball.
    pub fn normal_angle(&self, polar: f64) -> Option<f64> {
        let Some(distance) = self.distance else {
            return (polar < PI).then_some(0.5 * polar);
        };
        let rim = (1.0 / distance).acos();
        let seen = |theta: f64| 2.0 * theta + theta.sin().atan2(distance - theta.cos());
        if polar > seen(rim) {
            return None;
        }
        let (mut low, mut high) = (0.0, rim);
        let mut theta = 0.5 * polar * distance / (distance + 0.5);
        for _ in 0..60 {
            let value = seen(theta) - polar;
            if value > 0.0 {
                high = theta;
            } else {
                low = theta;
            }
            // d/dθ of the second term is (D cos θ − 1)/(1 + D² − 2 D cos θ).
            let cosine = theta.cos();
            let slope = 2.0
                + (distance * cosine - 1.0) / (1.0 + distance * distance - 2.0 * distance * cosine);
            let next = theta - value / slope;
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - theta).abs() < 1e-14 {
                return Some(next);
            }
            theta = next;
        }
        Some(theta)
    }

    /// Where in the picture the light of a unit direction is mirrored; none in the blind cone.
    pub fn place(&self, direction: DVec3) -> Option<(f64, f64)> {
        let across = direction.x.hypot(direction.y);
        let theta = self.normal_angle(across.atan2(direction.z))?;
        // In radii of the outline.
        let off = match self.distance {
            None => theta.sin(),
            Some(distance) => {
                theta.sin() * (distance * distance - 1.0).sqrt() / (distance - theta.cos())
            }
        };
        let (u, v) = if across > 0.0 {
            (direction.x / across, direction.y / across)
        } else {
            (0.0, 0.0)
        };
        let reach = off * self.circle.radius;
        Some((self.circle.x + reach * u, self.circle.y - reach * v))
    }

    /// The map of the light about the ball, of `rows` rows.
    ///
    /// Each pixel is the mean over its solid angle, of points as dense as the picture's pixels. The
    /// blind cone and the photographer are left out.
    ///
    /// # Errors
    /// [`Error::Domain`] for a distance that is not above 1, a reflectance that is not in (0, 1],
    /// a photographer of more than π/2, or rows that are not even and from 8 to 4096;
    /// [`Error::Length`] for a picture or a mask of another number of pixels than its size says;
    /// [`Error::CircleOutside`] where less than 85 % of the ball lies in the picture.
    pub fn unwrap(
        &self,
        picture: &Radiance,
        hidden: Option<&[bool]>,
        rows: usize,
        parallelism: Parallelism,
    ) -> Result<ProbeMap> {
        self.check(picture, rows)?;
        if let Some(hidden) = hidden {
            crate::check_length("the mask", picture.pixels.len(), hidden.len())?;
        }
        let Circle { x, y, radius } = self.circle;
        let columns = 2 * rows;
        let step = PI / rows as f64;
        let whole = radius - RIM;
        let lines = parallelism.map(rows, |row| {
            let mut line = Vec::with_capacity(columns);
            for column in 0..columns {
                let middle = direction(rows, row as f64 + 0.5, column as f64 + 0.5);
                let density = self.density(middle);
                let samples = (2.0 * step * density.sqrt()).ceil() as usize;
                let samples = samples.clamp(SAMPLES.0, SAMPLES.1);
                let (mut sum, mut seen, mut clipped, mut all) = ([0.0; 3], 0.0, 0.0, 0.0);
                for sample in 0..samples * samples {
                    let part = |i: usize| (i as f64 + 0.5) / samples as f64;
                    let down = row as f64 + part(sample / samples);
                    let along = column as f64 + part(sample % samples);
                    let weight = (step * down).sin();
                    all += weight;
                    let towards = direction(rows, down, along);
                    if towards.z > self.photographer.cos() && self.photographer > 0.0 {
                        continue;
                    }
                    let Some((across, down)) = self.place(towards) else {
                        continue;
                    };
                    if (across - x).hypot(down - y) > whole {
                        continue;
                    }
                    let Some((value, cut)) = interpolated(picture, hidden, across, down) else {
                        continue;
                    };
                    for c in 0..3 {
                        sum[c] += weight * value[c] / self.reflectance[c];
                    }
                    clipped += weight * cut;
                    seen += weight;
                }
                let share = f64::max(seen, f64::MIN_POSITIVE);
                line.push((sum.map(|s| s / share), seen / all, clipped / share, density));
            }
            line
        });
        let all: Vec<_> = lines.into_iter().flatten().collect();
        let mut map = ProbeMap {
            rows,
            pixels: all.iter().map(|pixel| pixel.0).collect(),
            alpha: all.iter().map(|pixel| pixel.1).collect(),
            clipped: all.iter().map(|pixel| pixel.2).collect(),
            density: all.iter().map(|pixel| pixel.3).collect(),
        };
        map.fill()?;
        Ok(map)
    }

    fn check(&self, picture: &Radiance, rows: usize) -> Result<()> {
        picture.check()?;
        let outside = |what, value, allowed| {
            Err(Error::Domain {
                what,
                value,
                allowed,
            })
        };
        if let Some(distance) = self.distance
            && !(distance > 1.0 && distance.is_finite())
        {
            return outside(
                "the camera's distance in radii",
                distance,
                "finite and above 1",
            );
        }
        for value in self.reflectance {
            if !(value > 0.0 && value <= 1.0) {
                return outside("the ball's reflectance", value, "above 0 and at most 1");
            }
        }
        if !(0.0..=0.5 * PI).contains(&self.photographer) {
            let what = "the photographer's half angle in radians";
            return outside(what, self.photographer, "from 0 to π/2");
        }
        if !(8..=4096).contains(&rows) || !rows.is_multiple_of(2) {
            let what = "the number of rows of the map";
            return outside(what, rows as f64, "even and from 8 to 4096");
        }
        let Circle { x, y, radius } = self.circle;
        if !(radius >= 16.0 && radius.is_finite()) {
            return Err(Error::TooSmall {
                what: "the radius of the mirror ball",
                pixels: radius,
                least: 16.0,
                purpose: "to be unwrapped",
            });
        }
        let (width, height) = (picture.width as f64, picture.height as f64);
        let leaves = radius - x.min(y).min(width - x).min(height - y);
        if !(leaves <= 0.3 * radius && x.is_finite() && y.is_finite()) {
            return Err(Error::CircleOutside {
                x,
                y,
                radius,
                width: picture.width,
                height: picture.height,
            });
        }
        Ok(())
    }

    /// How many pixels of the picture show a steradian there.
    fn density(&self, direction: DVec3) -> f64 {
        const SMALL: f64 = 1e-4;
        let (a, b) = direction.any_orthonormal_pair();
        let place = |aside: DVec3| self.place((direction + SMALL * aside).normalize());
        match (self.place(direction), place(a), place(b)) {
            (Some(middle), Some(a), Some(b)) => {
                let (ax, ay) = (a.0 - middle.0, a.1 - middle.1);
                let (bx, by) = (b.0 - middle.0, b.1 - middle.1);
                (ax * by - ay * bx).abs() / (SMALL * SMALL)
            }
            _ => 0.0,
        }
    }
}

/// The direction of a point of a lat-long map, in pixels from its top and its left.
fn direction(rows: usize, down: f64, along: f64) -> DVec3 {
    let step = PI / rows as f64;
    let (sin_theta, cos_theta) = (step * down).sin_cos();
    let (sin, cos) = (step * along - PI).sin_cos();
    DVec3::new(sin_theta * sin, cos_theta, -sin_theta * cos)
}

/// A picture between its pixels' centres, and the share of clipped ones; none where one of them is
/// hidden or beyond the border.
fn interpolated(
    picture: &Radiance,
    hidden: Option<&[bool]>,
    x: f64,
    y: f64,
) -> Option<([f64; 3], f64)> {
    let corners = bilinear::corners_within(picture.width, picture.height, x - 0.5, y - 0.5)?;
    let (mut sum, mut clipped) = ([0.0; 3], 0.0);
    for (at, weight) in corners {
        if hidden.is_some_and(|hidden| hidden[at]) {
            return None;
        }
        for c in 0..3 {
            sum[c] += weight * picture.pixels[at][c];
        }
        clipped += weight * f64::from(u8::from(picture.clipped[at]));
    }
    Some((sum, clipped))
}

impl ProbeMap {
    /// The map as light, named so.
    ///
    /// # Errors
    /// As [`EnvironmentMap::new`].
    pub fn environment(&self, name: impl Into<String>) -> Result<EnvironmentMap> {
        EnvironmentMap::new(name, 2 * self.rows, self.rows, self.pixels.clone())
    }

    /// The direction of the centre of a pixel.
    pub fn direction(&self, index: usize) -> DVec3 {
        let columns = 2 * self.rows;
        let (row, column) = (index / columns, index % columns);
        direction(self.rows, row as f64 + 0.5, column as f64 + 0.5)
    }

    /// What was not seen, from what was seen about it: the mean of a coarse map, each pixel weighed
    /// by the inverse fourth power of its angle.
    fn fill(&mut self) -> Result<()> {
        let factor = self.rows.div_ceil(FILL_ROWS);
        let rows = self.rows.div_ceil(factor);
        let columns = 2 * rows;
        let mut coarse = vec![([0.0; 3], 0.0, DVec3::ZERO); rows * columns];
        for index in 0..self.pixels.len() {
            let (row, column) = (index / (2 * self.rows), index % (2 * self.rows));
            let cell = &mut coarse[row / factor * columns + (column / factor).min(columns - 1)];
            let area = (PI * (row as f64 + 0.5) / self.rows as f64).sin();
            let weight = self.alpha[index] * area;
            for c in 0..3 {
                cell.0[c] += weight * self.pixels[index][c];
            }
            cell.1 += weight;
            cell.2 += weight * self.direction(index);
        }
        coarse.retain(|cell| cell.1 > 0.0);
        if coarse.is_empty() {
            return Err(Error::Unseen {
                what: "any direction that the mask leaves",
            });
        }
        for cell in &mut coarse {
            cell.2 = cell.2.normalize_or(DVec3::Y);
        }
        for index in 0..self.pixels.len() {
            let alpha = self.alpha[index];
            if alpha >= 0.999 {
                continue;
            }
            let own = self.direction(index);
            let (mut sum, mut total) = ([0.0; 3], 0.0);
            for (light, weight, towards) in &coarse {
                let near = 1.0 / ((own - *towards).length_squared() + 1e-4).powi(2);
                for c in 0..3 {
                    sum[c] += near * light[c];
                }
                total += near * weight;
            }
            for c in 0..3 {
                self.pixels[index][c] =
                    alpha * self.pixels[index][c] + (1.0 - alpha) * sum[c] / total;
            }
        }
        Ok(())
    }

    /// Value, alpha, clipped share and density of a direction.
    fn at(&self, towards: DVec3) -> ([f64; 3], f64, f64, f64) {
        let columns = 2 * self.rows;
        let step = PI / self.rows as f64;
        let theta = towards.x.hypot(towards.z).atan2(towards.y);
        let azimuth = towards.x.atan2(-towards.z) + PI;
        let row = theta / step - 0.5;
        let column = (azimuth / step - 0.5).rem_euclid(columns as f64);
        let (above, left) = (row.floor(), column.floor());
        let (v, u) = (row - above, column - left);
        let mut sum = ([0.0; 3], 0.0, 0.0, 0.0);
        for (down, wy) in [(0, 1.0 - v), (1, v)] {
            for (along, wx) in [(0, 1.0 - u), (1, u)] {
                let row = above as isize + down;
                let (row, turn) = if row < 0 {
                    (0, self.rows)
                } else if row as usize >= self.rows {
                    (self.rows - 1, self.rows)
                } else {
                    (row as usize, 0)
                };
                let at = row * columns + (left as usize + along + turn) % columns;
                let weight = wx * wy;
                for c in 0..3 {
                    sum.0[c] += weight * self.pixels[at][c];
                }
                sum.1 += weight * self.alpha[at];
                sum.2 += weight * self.clipped[at];
                sum.3 += weight * self.density[at];
            }
        }
        sum
    }
}

/// Two maps of one place, the second by a camera that stands `turn` radians farther round the ball,
/// anticlockwise as seen from above: in the frame of the first.
///
/// Where both saw, each is weighed by the square of how finely it saw. The second is scaled so that
/// what both saw well is as bright in both, unless `same_exposure` says that it is already.
///
/// # Errors
/// [`Error::OtherSize`] for maps of two sizes; [`Error::Unseen`] where the exposures are not the
/// same and the two saw nothing in common.
pub fn merge(
    first: &ProbeMap,
    second: &ProbeMap,
    turn: f64,
    same_exposure: bool,
) -> Result<ProbeMap> {
    if first.rows != second.rows {
        return Err(Error::OtherSize {
            name: "the second map".into(),
            size: (2 * second.rows, second.rows),
            first: "the first".into(),
            first_size: (2 * first.rows, first.rows),
        });
    }
    let (sin, cos) = turn.sin_cos();
    // The second's frame is the first's turned about +y by `turn`.
    let turned: Vec<_> = (0..first.pixels.len())
        .map(|index| {
            let d = first.direction(index);
            second.at(DVec3::new(
                cos * d.x - sin * d.z,
                d.y,
                sin * d.x + cos * d.z,
            ))
        })
        .collect();
    let mut scale = 1.0;
    if !same_exposure {
        let (mut both, mut own) = (0.0, 0.0);
        for (index, (value, alpha, clipped, density)) in turned.iter().enumerate() {
            let seen = first.alpha[index].min(*alpha) > 0.99;
            if seen && first.clipped[index] + clipped == 0.0 {
                let fine = first.density[index].min(*density);
                for c in 0..3 {
                    both += fine * first.pixels[index][c] * value[c];
                    own += fine * value[c] * value[c];
                }
            }
        }
        if !(own > 0.0 && both > 0.0) {
            return Err(Error::Unseen {
                what: "directions that both sides of the ball show",
            });
        }
        scale = both / own;
    }
    let mut merged = first.clone();
    for (index, (value, alpha, clipped, density)) in turned.into_iter().enumerate() {
        let a = first.alpha[index] * first.density[index].powi(2);
        let b = alpha * density.powi(2);
        if a + b <= 0.0 {
            continue;
        }
        let share = b / (a + b);
        for c in 0..3 {
            merged.pixels[index][c] =
                (1.0 - share) * first.pixels[index][c] + share * scale * value[c];
        }
        merged.alpha[index] = first.alpha[index].max(alpha);
        merged.clipped[index] = (1.0 - share) * first.clipped[index] + share * clipped;
        merged.density[index] = first.density[index].max(density);
    }
    merged.fill()?;
    Ok(merged)
}
