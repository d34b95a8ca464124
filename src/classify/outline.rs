//! The outline of a sphere in a picture.

use std::f64::consts::TAU;

use super::picture::Picture;
use crate::illumination::Luminance;
use crate::{Error, Result};

/// A circle in a picture, in pixels from the left and the top; the first pixel's centre is at (½, ½).
///
/// ```
/// use lobes::classify::Circle;
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
            _ => Err(Error::Unanswerable(format!(
                "{text:?} is no circle: give three numbers, x,y,r in pixels, r above 0"
            ))),
        }
    }
}

impl Circle {
    /// How far a point lies outside; negative inside.
    fn outside(self, (x, y): (f64, f64)) -> f64 {
        (x - self.x).hypot(y - self.y) - self.radius
    }
}

/// The disc that a mask covers: its centroid, and the radius of its area.
///
/// # Errors
/// A mask that is empty or not round.
pub(super) fn of_mask(coverage: &[f64], width: usize) -> Result<Circle> {
    let (mut count, mut x, mut y) = (0.0f64, 0.0, 0.0);
    let (mut left, mut right, mut top, mut bottom) = (f64::MAX, 0.0f64, f64::MAX, 0.0f64);
    for (i, &part) in coverage.iter().enumerate().filter(|(_, part)| **part > 0.0) {
        let (column, row) = ((i % width) as f64, (i / width) as f64);
        count += part;
        x += part * (column + 0.5);
        y += part * (row + 0.5);
        if part >= 0.5 {
            (left, right) = (left.min(column), right.max(column + 1.0));
            (top, bottom) = (top.min(row), bottom.max(row + 1.0));
        }
    }
    if count < 1.0 {
        return Err(Error::Unanswerable(
            "the mask leaves no pixel; give the sphere with --circle".into(),
        ));
    }
    let radius = (count / std::f64::consts::PI).sqrt();
    let round = |extent: f64| (extent / (2.0 * radius) - 1.0).abs() < 0.05 + 1.0 / radius;
    if !(round(right - left) && round(bottom - top)) {
        return Err(Error::Unanswerable(
            "the mask is not round, so it is not the outline of a sphere; give the sphere with --circle".into(),
        ));
    }
    Ok(Circle {
        x: x / count,
        y: y / count,
        radius,
    })
}

/// The circle of the sphere in a picture without a mask.
///
/// Where the picture's border is of one value, as renderers leave it, what differs from that value is the sphere, and a circle
/// is fitted to its outline, of which a part may be as dark as the background. Else it is the roundest edge in the picture.
///
/// # Errors
/// A picture that is too small, or in which no circle is to be seen.
pub(super) fn find(picture: &Picture) -> Result<Circle> {
    let side = picture.width().min(picture.height());
    if side < 16 {
        return Err(Error::Unanswerable(format!(
            "a picture of {} by {} pixels is too small to find a sphere in; 16 a side are the least",
            picture.width(),
            picture.height()
        )));
    }
    match before_one_value(picture) {
        Some(circle) => Ok(circle),
        None => roundest_edge(picture),
    }
}

/// The sphere before a background of one value, where there is such a background and what stands before it is a disc or a part of one.
fn before_one_value(picture: &Picture) -> Option<Circle> {
    let (width, height) = (picture.width(), picture.height());
    let border: Vec<[f64; 3]> = (0..width)
        .flat_map(|x| [(x, 0), (x, height - 1)])
        .chain((0..height).flat_map(|y| [(0, y), (width - 1, y)]))
        .map(|(x, y)| picture.pixels()[y * width + x])
        .collect();
    // A sphere that fills the picture takes up √(1/r) of the border, an eighth at r = 64: the middle value is the background's if half of it is.
    let background: [f64; 3] = std::array::from_fn(|c| {
        let mut values: Vec<f64> = border.iter().map(|rgb| rgb[c]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    });
    let largest = picture
        .pixels()
        .iter()
        .flatten()
        .fold(0.0, |a: f64, &b| a.max(b));
    let slack = if picture.is_encoded() {
        // Two codes of 8 bits where sRGB is linear.
        2.5 / 255.0 / 12.92
    } else {
        1e-9 * largest
    };
    let differs = |rgb: &[f64; 3]| {
        (0..3).any(|c| (rgb[c] - background[c]).abs() > slack.max(1e-6 * background[c]))
    };
    let off = border.iter().filter(|rgb| differs(rgb)).count();
    if off * 2 > border.len() {
        return None;
    }
    // The first and the last pixel of every row and every column that differ: all of the outline that is seen is among them.
    let inside = |x: usize, y: usize| differs(&picture.pixels()[y * width + x]);
    let mut edge = Vec::new();
    for y in 0..height {
        if let Some(first) = (0..width).find(|&x| inside(x, y)) {
            let last = (0..width).rfind(|&x| inside(x, y)).unwrap_or(first);
            edge.push((first as f64, y as f64 + 0.5));
            edge.push((last as f64 + 1.0, y as f64 + 0.5));
        }
    }
    for x in 0..width {
        if let Some(first) = (0..height).find(|&y| inside(x, y)) {
            let last = (0..height).rfind(|&y| inside(x, y)).unwrap_or(first);
            edge.push((x as f64 + 0.5, first as f64));
            edge.push((x as f64 + 0.5, last as f64 + 1.0));
        }
    }
    // Nothing that differs may lie outside of the circle, so that an outline which is cut off by darkness does not pull it in.
    let circle = enclosing(&edge, width, height)?;
    let close = 0.75 + 0.005 * circle.radius;
    let mut seen = [false; 36];
    for point in &edge {
        if circle.outside(*point).abs() < close {
            let turn = (point.1 - circle.y).atan2(point.0 - circle.x) / TAU + 0.5;
            seen[((turn * 36.0) as usize).min(35)] = true;
        }
    }
    let arc = seen.iter().filter(|seen| **seen).count();
    (circle.radius >= 6.0 && arc >= 15).then_some(circle)
}

/// The circle of least median distance to the outermost edge points: three points at a time, then least squares over those close to it.
fn enclosing(edge: &[(f64, f64)], width: usize, height: usize) -> Option<Circle> {
    let hull = convex_hull(edge);
    if hull.len() < 8 {
        return None;
    }
    // Points of the hull lie on the outline or on a chord where darkness cuts it off; the circle that passes most of them and leaves
    // none outside is the outline.
    let most = 48.min(hull.len());
    let chosen: Vec<(f64, f64)> = (0..most).map(|i| hull[i * hull.len() / most]).collect();
    let size = width.max(height) as f64;
    let mut best: Option<(f64, Circle)> = None;
    for i in 0..chosen.len() {
        for j in i + 1..chosen.len() {
            for k in j + 1..chosen.len() {
                let Some(circle) = through(chosen[i], chosen[j], chosen[k]) else {
                    continue;
                };
                if circle.radius > size {
                    continue;
                }
                let tolerance = 0.7 + 0.003 * circle.radius;
                let mut score = 0.0;
                for point in &hull {
                    let off = circle.outside(*point);
                    score += if off.abs() < tolerance {
                        1.0 - 0.5 * (off / tolerance).powi(2)
                    } else if off > 0.0 {
                        -3.0
                    } else {
                        0.0
                    };
                }
                if best.as_ref().is_none_or(|(of, _)| score > *of) {
                    best = Some((score, circle));
                }
            }
        }
    }
    let (_, mut circle) = best?;
    for _ in 0..5 {
        let near =
            |point: &&(f64, f64)| circle.outside(**point).abs() < 1.0 + 0.003 * circle.radius;
        let points: Vec<(f64, f64)> = edge.iter().filter(near).copied().collect();
        circle = least_squares(&points, circle)?;
    }
    Some(circle)
}

/// Andrew's monotone chain.
fn convex_hull(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    let cross = |o: (f64, f64), a: (f64, f64), b: (f64, f64)| {
        (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0)
    };
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for pass in 0..2 {
        let start = hull.len();
        let mut add = |point: (f64, f64)| {
            while hull.len() >= start + 2
                && cross(hull[hull.len() - 2], hull[hull.len() - 1], point) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        };
        if pass == 0 {
            points.iter().copied().for_each(&mut add);
        } else {
            points.iter().rev().copied().for_each(&mut add);
        }
        hull.pop();
    }
    hull
}

/// The circle through three points.
fn through(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<Circle> {
    let (bx, by, cx, cy) = (b.0 - a.0, b.1 - a.1, c.0 - a.0, c.1 - a.1);
    let twice = 2.0 * (bx * cy - by * cx);
    if twice.abs() < 1e-9 {
        return None;
    }
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let (x, y) = ((cy * b2 - by * c2) / twice, (bx * c2 - cx * b2) / twice);
    Some(Circle {
        x: a.0 + x,
        y: a.1 + y,
        radius: x.hypot(y),
    })
}

/// One step of Gauss and Newton towards the least squares of distances to the circle.
fn least_squares(points: &[(f64, f64)], circle: Circle) -> Option<Circle> {
    if points.len() < 8 {
        return None;
    }
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for &(x, y) in points {
        let distance = (x - circle.x).hypot(y - circle.y).max(1e-9);
        let row = nalgebra::Vector3::new((x - circle.x) / distance, (y - circle.y) / distance, 1.0);
        normal += row * row.transpose();
        right += row * (distance - circle.radius);
    }
    let step = normal.cholesky()?.solve(&right);
    let next = Circle {
        x: circle.x + step[0],
        y: circle.y + step[1],
        radius: circle.radius + step[2],
    };
    (next.radius > 0.0 && next.radius.is_finite()).then_some(next)
}

/// The roundest edge in the picture.
///
/// A picture full of edges can hold a circle that is no sphere: the overlay is there to be looked at. A coarse search over centres and
/// radii, then a fine one, for the circle across which log luminance changes most, all along it: the score is the mean of the
/// gradient across the circle, none counted beyond the strongest tenth of the picture. Then, pixel by pixel, the steepest place
/// across the circle at each of many angles, and a circle of least squares through most of them.
fn roundest_edge(picture: &Picture) -> Result<Circle> {
    let side = picture.width().min(picture.height());
    let coarse = Gradient::new(picture, side.div_ceil(96));
    let (mut circle, mut score) = coarse.search();
    let (width, height) = (coarse.width as f64, coarse.height as f64);
    let mut step = 0.06 * circle.radius;
    while step > 0.02 {
        let mut moved = false;
        for (dx, dy, dr) in [
            (1.0, 0.0, 0.0),
            (-1.0, 0.0, 0.0),
            (0.0, 1.0, 0.0),
            (0.0, -1.0, 0.0),
            (0.0, 0.0, 1.0),
            (0.0, 0.0, -1.0),
        ] {
            let other = Circle {
                x: circle.x + step * dx,
                y: circle.y + step * dy,
                radius: circle.radius + step * dr,
            };
            let inside = other.radius > 2.0
                && other.x - other.radius >= -0.01
                && other.y - other.radius >= -0.01
                && other.x + other.radius <= width + 0.01
                && other.y + other.radius <= height + 0.01;
            let value = if inside { coarse.score(other) } else { 0.0 };
            if value > score {
                (circle, score, moved) = (other, value, true);
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    if !(score >= Gradient::LEAST_SCORE) {
        return Err(Error::Unanswerable(
            "no sphere is to be seen in the picture; give it with --circle x,y,r".into(),
        ));
    }
    let scale = coarse.scale as f64;
    let circle = Circle {
        x: circle.x * scale,
        y: circle.y * scale,
        radius: circle.radius * scale,
    };
    Ok(refine(picture, circle, scale))
}

/// The circle through the steepest places across a rough one.
fn refine(picture: &Picture, rough: Circle, scale: f64) -> Circle {
    const RAYS: usize = 240;
    let floor = 0.05 * picture.mean_luminance() + 1e-12;
    let log = |x: f64, y: f64| (Luminance::Rec709.of(picture.at(x, y)).max(0.0) + floor).ln();
    let reach = (0.05 * rough.radius).max(1.5 * scale).max(2.0);
    let mut points = Vec::new();
    for ray in 0..RAYS {
        let (sin, cos) = (TAU * ray as f64 / RAYS as f64).sin_cos();
        let steps = (2.0 * reach / 0.25).ceil() as usize;
        let mut best = (0.0, 0.0);
        for i in 0..=steps {
            let radius = rough.radius - reach + 0.25 * i as f64;
            let at = |r: f64| log(rough.x + r * cos, rough.y + r * sin);
            let steep = (at(radius + 0.75) - at(radius - 0.75)).abs();
            if steep > best.0 {
                best = (steep, radius);
            }
        }
        if best.0 > 0.05 {
            points.push((rough.x + best.1 * cos, rough.y + best.1 * sin));
        }
    }
    let mut circle = rough;
    let mut width = reach;
    for _ in 0..12 {
        let near = |point: &&(f64, f64)| circle.outside(**point).abs() < width;
        let close: Vec<(f64, f64)> = points.iter().filter(near).copied().collect();
        if close.len() < RAYS / 4 {
            return circle;
        }
        match least_squares(&close, circle) {
            Some(next) => circle = next,
            None => return circle,
        }
        width = (0.6 * width).max(0.75 + 0.004 * circle.radius);
    }
    circle
}

/// The gradient of log luminance of a picture made smaller.
struct Gradient {
    width: usize,
    height: usize,
    scale: usize,
    /// (d/dx, d/dy).
    field: Vec<(f64, f64)>,
    /// What the strongest tenth passes.
    strong: f64,
}

impl Gradient {
    /// The least score, as a share of a strong gradient all along the circle, that counts as a sphere. Chance finds circles of 0.54 in
    /// noise; balls before a wall have 0.9 and more, and a fainter one has to be pointed out.
    const LEAST_SCORE: f64 = 0.7;

    fn new(picture: &Picture, scale: usize) -> Self {
        let (width, height) = (picture.width() / scale, picture.height() / scale);
        let mut log = vec![0.0; width * height];
        let mut mean = 0.0;
        for (i, value) in log.iter_mut().enumerate() {
            let (row, column) = (i / width * scale, i % width * scale);
            for y in row..row + scale {
                for x in column..column + scale {
                    let rgb = picture.pixels()[y * picture.width() + x];
                    *value += Luminance::Rec709.of(rgb).max(0.0);
                }
            }
            mean += *value;
        }
        mean /= (width * height).max(1) as f64;
        for value in &mut log {
            *value = (*value + 0.05 * mean + 1e-12).ln();
        }
        let at = |x: isize, y: isize| {
            let x = x.clamp(0, width as isize - 1) as usize;
            let y = y.clamp(0, height as isize - 1) as usize;
            log[y * width + x]
        };
        let field: Vec<(f64, f64)> = (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as isize, (i / width) as isize);
                let dx = at(x + 1, y) - at(x - 1, y);
                let dy = at(x, y + 1) - at(x, y - 1);
                (0.5 * dx, 0.5 * dy)
            })
            .collect();
        let mut sizes: Vec<f64> = field.iter().map(|(x, y)| x.hypot(*y)).collect();
        sizes.sort_by(f64::total_cmp);
        let strong = sizes[(0.9 * (sizes.len() - 1) as f64) as usize].max(0.02);
        Self {
            width,
            height,
            scale,
            field,
            strong,
        }
    }

    /// The best of a lattice of circles, and its score.
    fn search(&self) -> (Circle, f64) {
        let none = Circle {
            x: 0.0,
            y: 0.0,
            radius: 0.0,
        };
        let mut best = (none, 0.0);
        let (width, height) = (self.width as f64, self.height as f64);
        let most = 0.5 * width.min(height);
        let mut radius = 0.12 * most * 2.0;
        while radius <= most {
            let step = (0.06 * radius).max(1.0);
            let across = |length: f64| {
                let room = length - 2.0 * radius;
                let count = (room / step).floor() as usize;
                (0..=count).map(move |i| radius + room * (i as f64 + 0.5) / (count + 1) as f64)
            };
            for y in across(height) {
                for x in across(width) {
                    let circle = Circle { x, y, radius };
                    let score = self.score(circle);
                    if score > best.1 {
                        best = (circle, score);
                    }
                }
            }
            radius *= 1.04;
        }
        best
    }

    /// The mean over the circle of the gradient across it, over what is strong.
    fn score(&self, circle: Circle) -> f64 {
        const SAMPLES: usize = 72;
        let mut sum = 0.0;
        for i in 0..SAMPLES {
            let (sin, cos) = (TAU * i as f64 / SAMPLES as f64).sin_cos();
            let (x, y) = (
                circle.x + circle.radius * cos,
                circle.y + circle.radius * sin,
            );
            let column = (x.floor().max(0.0) as usize).min(self.width - 1);
            let row = (y.floor().max(0.0) as usize).min(self.height - 1);
            let (dx, dy) = self.field[row * self.width + column];
            sum += (dx * cos + dy * sin).abs().min(self.strong);
        }
        sum / (SAMPLES as f64 * self.strong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value at a place that no one can predict, on [0, 1].
    fn hash(x: u64, y: u64) -> f64 {
        let mut h = x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        h ^= h >> 29;
        h = h.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (h >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A ball of `radiance` at (right, down) in radii, before `behind` at (column, row).
    fn ball(
        width: usize,
        height: usize,
        circle: Circle,
        radiance: impl Fn(f64, f64) -> f64,
        behind: impl Fn(f64, f64) -> f64,
    ) -> Vec<[f64; 3]> {
        (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
                let (u, v) = (
                    (x - circle.x) / circle.radius,
                    (y - circle.y) / circle.radius,
                );
                if u * u + v * v < 1.0 {
                    [radiance(u, v); 3]
                } else {
                    [behind(x, y); 3]
                }
            })
            .collect()
    }

    fn shaded(u: f64, v: f64) -> f64 {
        let z = (1.0 - u * u - v * v).sqrt();
        0.05 + 0.9 * (0.5 * z - 0.6 * v + 0.3 * u).max(0.0)
    }

    /// The last one touches three sides of the picture.
    const PLACES: [(f64, f64, f64); 4] = [
        (150.0, 120.3, 80.0),
        (230.4, 140.0, 45.0),
        (100.0, 100.0, 99.0),
        (120.0, 120.0, 120.0),
    ];

    fn error(found: Circle, truth: Circle) -> f64 {
        (found.x - truth.x)
            .hypot(found.y - truth.y)
            .max((found.radius - truth.radius).abs())
    }

    #[test]
    fn finds_a_ball_before_a_wall() {
        for (x, y, radius) in PLACES {
            let truth = Circle { x, y, radius };
            let wall = |x: f64, y: f64| 0.1 + 0.25 * hash((x / 24.0) as u64, (y / 24.0) as u64);
            let pixels = ball(320, 240, truth, shaded, wall);
            let found = find(&Picture::linear(320, 240, pixels).unwrap()).unwrap();
            let off = error(found, truth);
            assert!(off < 0.01 * radius, "{found:?} for {truth:?}");
        }
    }

    /// One side of the ball is as dark as the background, to the last code.
    #[test]
    fn finds_a_ball_whose_dark_side_is_the_background() {
        let lit = |u: f64, v: f64| {
            let z = (1.0 - u * u - v * v).sqrt();
            (0.3 * z - 0.6 * v + 0.3 * u).max(0.0)
        };
        for (x, y, radius) in PLACES {
            let truth = Circle { x, y, radius };
            for background in [0.0, 0.5] {
                let radiance = |u: f64, v: f64| background + lit(u, v);
                let pixels = ball(320, 240, truth, radiance, |_, _| background);
                let found = find(&Picture::linear(320, 240, pixels).unwrap()).unwrap();
                let off = error(found, truth);
                assert!(
                    off < 0.01 * radius,
                    "{found:?} for {truth:?} before {background}"
                );
            }
        }
    }

    #[test]
    fn finds_no_ball_where_there_is_none() {
        let noise = (0..320 * 240).map(|i| [hash(i, 7); 3]).collect();
        assert!(
            find(&Picture::linear(320, 240, noise).unwrap()).is_err(),
            "noise"
        );
        let flat = vec![[0.5; 3]; 320 * 240];
        assert!(
            find(&Picture::linear(320, 240, flat).unwrap()).is_err(),
            "flat"
        );
        let square = (0..320 * 240)
            .map(|i| {
                [f64::from(u8::from(
                    i % 320 > 100 && i % 320 < 200 && i / 320 > 60 && i / 320 < 160,
                )); 3]
            })
            .collect();
        assert!(
            find(&Picture::linear(320, 240, square).unwrap()).is_err(),
            "a square"
        );
        let small = vec![[0.5; 3]; 15 * 15];
        assert!(
            find(&Picture::linear(15, 15, small).unwrap()).is_err(),
            "small"
        );
    }

    #[test]
    fn a_mask_tells_where_the_sphere_is() {
        let truth = Circle {
            x: 60.5,
            y: 40.25,
            radius: 30.0,
        };
        let mask = ball(120, 90, truth, |_, _| 1.0, |_, _| 0.0);
        let mask: Vec<f64> = mask.iter().map(|rgb| rgb[0]).collect();
        assert!(error(of_mask(&mask, 120).unwrap(), truth) < 0.1);
        let half: Vec<f64> = (0..120 * 90)
            .map(|i| f64::from(u8::from(i % 120 < 60)))
            .collect();
        assert!(of_mask(&half, 120).is_err(), "half the picture is no disc");
        assert!(of_mask(&[0.0; 120 * 90], 120).is_err());
    }

    #[test]
    fn circles_are_read() {
        assert_eq!(
            "3, 4,5".parse(),
            Ok(Circle {
                x: 3.0,
                y: 4.0,
                radius: 5.0
            })
        );
        for text in ["", "3,4", "3,4,0", "3,4,x", "nan,4,5", "3,4,5,6"] {
            assert!(text.parse::<Circle>().is_err(), "{text}");
        }
    }
}
