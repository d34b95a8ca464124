//! Four straight sides about a circle that end where they meet: the frame of a picture in the picture.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use super::Circle;
use super::edges::Edges;

/// So many turns of a frame are tried in a quarter of a circle: 1.4° from one to the next, by which a
/// side that is as long as the picture is at most a pixel and a half off.
const TURNS: usize = 64;

/// A side lies so far from the circle's centre at least and at most, in radii. What is framed more
/// widely fills less than a fifth of its frame.
const NEAREST: f64 = 0.95;
const FARTHEST: f64 = 2.0;

/// The cosine between an edge's normal and the side's, at least.
const ALONG: f64 = 0.95;

/// The share of a side at which an edge lies along it, at least.
const SEEN: f64 = 0.9;

/// The same beyond the two corners of a side, at most: there a frame ends, and lines of tiles,
/// window bars and shelves go on.
const BEYOND: f64 = 0.4;

/// So far beyond a corner a side is followed, in radii.
const FOLLOWED: f64 = 0.5;

/// What is fainter than this share of a side's middle edge is none of it.
const FAINT: f32 = 1.0 / 3.0;

/// Of the eight ends of the sides so many lie within the picture at least.
const LEAST_ENDS: usize = 4;

/// So many lines are tried as one side.
const TRIED: usize = 4;

/// Pixels about a corner that belong to both sides.
const CORNER: i64 = 3;

/// Pixels to either side of a line in which it is looked for beyond its corners: a turn between two
/// that are tried takes it so far away.
const ASTRAY: i64 = 1;

/// Whether a circle lies in a frame: four straight sides about it, each seen from corner to corner
/// and not beyond.
///
/// The sides are a rectangle's, since a print that is photographed so obliquely that its corners are
/// far from right angles shows an ellipse too.
pub(super) fn is_about(edges: &Edges, circle: Circle) -> bool {
    let mut lines = Lines::about(edges, circle);
    (0..TURNS).any(|turn| {
        let angle = (turn as f64 / TURNS as f64 - 0.5) * FRAC_PI_2;
        lines.turn_to(angle);
        lines.make_a_frame()
    })
}

/// The four ways from the centre to a side: the axis across it, and the sign.
const WAYS: [(usize, i64); 4] = [(0, -1), (0, 1), (1, -1), (1, 1)];

/// A part of a line: the axis across it, where it lies on that, and from where to where it goes along
/// the other, in pixels from the circle's centre.
struct Part {
    axis: usize,
    offset: i64,
    places: Range<i64>,
}

/// The edges along two axes that are turned about a circle.
struct Lines<'a> {
    edges: &'a Edges,
    circle: Circle,
    sin: f64,
    cos: f64,
    /// Places go so far from the centre.
    reach: i64,
    /// The strongest edge across each axis, by its offset and its place along; 0 is none.
    strongest: [Vec<f32>; 2],
}

impl<'a> Lines<'a> {
    fn about(edges: &'a Edges, circle: Circle) -> Self {
        let reach = ((FARTHEST + FOLLOWED) * circle.radius) as i64 + 2 * CORNER;
        let places = (4 * reach * reach) as usize;
        Self {
            edges,
            circle,
            sin: 0.0,
            cos: 1.0,
            reach,
            strongest: [(); 2].map(|()| vec![0.0; places]),
        }
    }

    fn turn_to(&mut self, angle: f64) {
        (self.sin, self.cos) = angle.sin_cos();
        let (sin, cos, reach) = (self.sin, self.cos, self.reach);
        for strongest in &mut self.strongest {
            strongest.fill(0.0);
        }
        let turned = |x: f64, y: f64| [cos * x + sin * y, cos * y - sin * x];
        for edge in &self.edges.edges {
            let normal = turned(edge.normal.0, edge.normal.1);
            let Some(axis) = normal.iter().position(|part| part.abs() >= ALONG) else {
                continue;
            };
            let place = turned(edge.x - self.circle.x, edge.y - self.circle.y);
            let far = (reach - 1) as f64;
            if place.iter().any(|at| at.abs() >= far) {
                continue;
            }
            // The gradient over what is strong in the picture.
            let gradient = (edge.strength / (1.0 - edge.strength)) as f32;
            // A line has the edges that lie to a pixel on it.
            for offset in [place[axis], place[axis] + 1.0] {
                let at = self.index(offset.floor() as i64, place[1 - axis].floor() as i64);
                let strongest = &mut self.strongest[axis][at];
                *strongest = strongest.max(gradient);
            }
        }
    }

    fn index(&self, offset: i64, place: i64) -> usize {
        ((offset + self.reach) * 2 * self.reach + place + self.reach) as usize
    }

    /// The strongest edge at each place of a part that lies within the picture, or beside it: one
    /// place along the line, and `astray` pixels across it.
    fn along(&self, part: Part, astray: i64) -> impl Iterator<Item = f32> + '_ {
        let Part {
            axis,
            offset,
            places,
        } = part;
        let inside = move |place: &i64| {
            let mut at = [0.0; 2];
            at[axis] = offset as f64;
            at[1 - axis] = *place as f64 + 0.5;
            let x = self.circle.x + self.cos * at[0] - self.sin * at[1];
            let y = self.circle.y + self.sin * at[0] + self.cos * at[1];
            // No edge is found in the picture's last pixels.
            let within = |at: f64, length: usize| at > 2.0 && at < length as f64 - 2.0;
            within(x, self.edges.width) && within(y, self.edges.height)
        };
        places.filter(inside).map(move |place| {
            let mut strongest = 0.0f32;
            for offset in offset - astray..=offset + astray {
                for place in place - 1..=place + 1 {
                    strongest = strongest.max(self.strongest[axis][self.index(offset, place)]);
                }
            }
            strongest
        })
    }

    /// Whether any four of the lines about the circle are a frame's sides.
    fn make_a_frame(&self) -> bool {
        let mut sides: [Vec<i64>; 4] = Default::default();
        for (side, way) in sides.iter_mut().zip(WAYS) {
            *side = self.candidates(way);
            if side.is_empty() {
                return false;
            }
        }
        // Each choice of one line a side.
        let count: usize = sides.iter().map(Vec::len).product();
        (0..count).any(|choice| {
            let mut rest = choice;
            self.end_at_corners(std::array::from_fn(|side| {
                let of = &sides[side];
                let offset = of[rest % of.len()];
                rest /= of.len();
                offset
            }))
        })
    }

    /// Where lines lie that are seen all along the circle's diameter and may be its side to one way.
    fn candidates(&self, (axis, sign): (usize, i64)) -> Vec<i64> {
        let radius = self.circle.radius;
        let half = radius as i64;
        let distances = (NEAREST * radius).round() as i64..=(FARTHEST * radius) as i64;
        let mut seen: Vec<(usize, i64)> = distances
            .map(|distance| {
                let part = Part {
                    axis,
                    offset: sign * distance,
                    places: -half..half,
                };
                let hits = self.along(part, 0).filter(|edge| *edge > 0.0).count();
                (hits, distance)
            })
            .filter(|(hits, _)| *hits as f64 > SEEN * 2.0 * half as f64)
            .collect();
        seen.sort_by_key(|(hits, _)| std::cmp::Reverse(*hits));
        let mut kept: Vec<i64> = Vec::new();
        for (_, distance) in seen {
            if kept.len() < TRIED && kept.iter().all(|other| (other - distance).abs() >= CORNER) {
                kept.push(distance);
            }
        }
        kept.into_iter().map(|distance| sign * distance).collect()
    }

    /// Whether each of four lines is seen between those that it crosses, and not beyond them.
    fn end_at_corners(&self, offsets: [i64; 4]) -> bool {
        let mut ends = 0;
        let followed = (FOLLOWED * self.circle.radius) as i64;
        let all = WAYS.iter().zip(offsets).all(|((axis, _), offset)| {
            let [low, high] = [offsets[2 - 2 * axis], offsets[3 - 2 * axis]];
            let part = |places: Range<i64>| Part {
                axis: *axis,
                offset,
                places,
            };
            let between = self.along(part(low + 1..high - 1), 0);
            let mut side: Vec<f32> = between.filter(|edge| *edge > 0.0).collect();
            if side.len() as f64 <= SEEN * (high - low - 2) as f64 {
                return false;
            }
            let middle = side.len() / 2;
            let faint = FAINT * *side.select_nth_unstable_by(middle, f32::total_cmp).1;
            let (mut places, mut seen) = (0, 0);
            for end in [
                low - CORNER - followed..low - CORNER,
                high + CORNER..high + CORNER + followed,
            ] {
                let beyond: Vec<f32> = self.along(part(end), ASTRAY).collect();
                if beyond.len() as i64 >= CORNER {
                    ends += 1;
                    places += beyond.len();
                    seen += beyond.iter().filter(|edge| **edge > faint).count();
                }
            }
            seen as f64 <= BEYOND * places as f64
        });
        all && ends >= LEAST_ENDS
    }
}
