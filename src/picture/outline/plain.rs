//! The sphere before a background of one value.

use std::f64::consts::TAU;

use super::Circle;
use super::fit::{least_squares, through};
use super::rays::Rays;
use super::reduced::{Reduced, even};
use crate::picture::Picture;

/// The least differences from the background that are looked for in codes of 8 bits, as steps of
/// one: noise, JPEG's ringing and shadows hide what differs by less.
const LEVELS: [f64; 5] = [2.5, 5.0, 10.0, 20.0, 40.0];

/// About one code of 8 bits of sRGB on the scale of [`even`].
const CODE: f64 = 0.004;

/// The border of a picture, pixel by pixel; those in its corners come twice.
fn border(width: usize, height: usize) -> impl Iterator<Item = usize> {
    (0..width)
        .flat_map(move |x| [x, (height - 1) * width + x])
        .chain((0..height).flat_map(move |y| [y * width, y * width + width - 1]))
}

/// The middle value of the border: a background's, if half of the border is of it. A sphere that
/// fills the picture takes up √(1/r) of the border, an eighth at r = 64.
fn background(picture: &Reduced) -> [f64; 3] {
    let border = border(picture.width, picture.height);
    middle(&border.map(|i| picture.values[i]).collect::<Vec<_>>())
}

fn middle(values: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| {
        let mut values: Vec<f64> = values.iter().map(|rgb| rgb[c]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    })
}

/// Whether half of a picture's border is of one value.
pub(super) fn has_a_border_of_one_value(picture: &Picture) -> bool {
    let border = border(picture.width(), picture.height());
    let values: Vec<[f64; 3]> = border.map(|i| picture.pixels.at(i)).collect();
    let middle = middle(&values);
    let same = |rgb: &&[f64; 3]| (0..3).all(|c| (rgb[c] - middle[c]).abs() <= 1e-6 * middle[c]);
    2 * values.iter().filter(same).count() >= values.len()
}

/// Whether at most one in `most` pixels of the border differs from the background.
fn is_plain(picture: &Reduced, differs: &[bool], most: usize) -> bool {
    let border = border(picture.width, picture.height);
    let off = border.filter(|i| differs[*i]).count();
    most * off <= 2 * (picture.width + picture.height)
}

/// The sphere before a background of one value, where there is such a background and what stands
/// before it is a disc; or, `in_part`, a part of one.
///
/// Light that was rendered is darker than any background in part only, but in codes what JPEG adds
/// about a ball, and its shadow, look like a part of a disc too.
pub(super) fn before_one_value(picture: &Reduced, in_part: bool) -> Option<Circle> {
    let background = background(picture);
    let values = picture.values.iter().flatten();
    let slack = 1e-9 * values.fold(0.0, |a: f64, &b| a.max(b));
    let off = |rgb: &[f64; 3], c: usize| (rgb[c] - background[c]).abs();
    let differs: Vec<bool> = picture
        .values
        .iter()
        .map(|rgb| (0..3).any(|c| off(rgb, c) > slack.max(1e-6 * background[c])))
        .collect();
    if !is_plain(picture, &differs, 2) {
        return None;
    }
    disc(&differs, picture.width)
        .filter(|circle| in_part || is_whole(&differs, picture.width, *circle))
}

/// Whether nineteen of twenty pixels next to a circle differ within it, and one in fifty outside.
fn is_whole(differs: &[bool], width: usize, circle: Circle) -> bool {
    let reach = 1.0 + 0.04 * circle.radius;
    let (mut inside, mut outside) = ([0usize; 2], [0usize; 2]);
    for (i, differs) in differs.iter().enumerate() {
        let off = circle.outside(((i % width) as f64 + 0.5, (i / width) as f64 + 0.5));
        let count = if off < -1.0 {
            &mut inside
        } else {
            &mut outside
        };
        if off.abs() > 1.0 && off.abs() < reach {
            count[usize::from(*differs)] += 1;
        }
    }
    inside[1] >= 19 * inside[0] && 49 * outside[1] <= outside[0]
}

/// The sphere before a background of one value in codes: of the discs of what differs by more and
/// by less, the one on whose outline the light breaks best, as `small` shows it.
pub(super) fn before_codes(picture: &Reduced, small: &Reduced) -> Option<Circle> {
    let background = background(picture).map(|value| even(value, picture.white));
    let difference: Vec<f64> = picture
        .values
        .iter()
        .map(|rgb| {
            let off = |c: usize| (even(rgb[c], picture.white) - background[c]).abs();
            off(0).max(off(1)).max(off(2)) / CODE
        })
        .collect();
    let scale = small.scale as f64;
    let discs = LEVELS.iter().filter_map(|level| {
        let differs: Vec<bool> = difference.iter().map(|d| d > level).collect();
        if !is_plain(picture, &differs, 4) {
            return None;
        }
        let circle = disc(&without_specks(&differs, picture.width), picture.width)?;
        let mut rays = Rays::across(small, circle.times(picture.scale as f64 / scale));
        let next = rays.best();
        if next.apart(rays.circle()) < 1.5 {
            rays = Rays::across(small, next);
        }
        Some((rays.gain([0.0; 3]), rays.circle().times(scale)))
    });
    let best = discs.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(best.1)
}

/// What most of the nine pixels around each say, so that noise adds nothing to a silhouette and
/// its outline stays where it is.
fn without_specks(differs: &[bool], width: usize) -> Vec<bool> {
    let height = differs.len() / width;
    (0..differs.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let (mut count, mut all) = (0, 0);
            for row in y.saturating_sub(1)..(y + 2).min(height) {
                for column in x.saturating_sub(1)..(x + 2).min(width) {
                    all += 1;
                    count += usize::from(differs[row * width + column]);
                }
            }
            2 * count > all
        })
        .collect()
}

/// The circle whose arc is the outline of a silhouette.
fn disc(differs: &[bool], width: usize) -> Option<Circle> {
    let height = differs.len() / width;
    // The first and the last pixel of every row and every column that differ: all of the outline
    // that is seen is among them.
    let inside = |x: usize, y: usize| differs[y * width + x];
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
    // Nothing that differs may lie outside of the circle, so that an outline which is cut off by
    // darkness does not pull it in.
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

/// The circle of least median distance to the outermost edge points: three points at a time, then
/// least squares over those close to it.
fn enclosing(edge: &[(f64, f64)], width: usize, height: usize) -> Option<Circle> {
    let hull = convex_hull(edge);
    if hull.len() < 8 {
        return None;
    }
    // Points of the hull lie on the outline or on a chord where darkness cuts it off; the circle
    // that passes most of them and leaves none outside is the outline.
    let most = 32.min(hull.len());
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
