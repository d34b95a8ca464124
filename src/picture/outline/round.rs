//! The sphere before anything: the roundest edge in the picture.

use std::f64::consts::{LN_10, TAU};

use super::Circle;
use super::edges::{Edge, Edges};
use super::fit::weighted_least_squares;
use super::rays::Rays;
use super::reduced::Reduced;
use super::vote;
use crate::{Error, Result};

/// So many of the circles that were voted for are looked at.
const CANDIDATES: usize = 40;

/// So many of those that edges support are chosen from.
const CHOSEN_FROM: usize = 12;

/// What a circle has to have: how unlikely it is at least (one like it, or one with more edges along
/// it, is expected in one of 10^score places where edges lie by chance), the share of the outline
/// that has an edge along it, and that at which the light breaks nowhere but there.
#[derive(Debug, Clone, Copy)]
struct Least {
    score: f64,
    seen: f64,
    sharp: f64,
}

/// Of the roundest thing in the picture. What is no ball is for those to say who look at what is
/// inside.
const OF_THE_BEST: Least = Least {
    score: 8.0,
    seen: 0.4,
    sharp: 0.2,
};

/// Of others beside it.
const OF_OTHERS: Least = Least {
    score: 8.0,
    seen: 0.5,
    sharp: 0.35,
};

/// What speaks for a circle.
#[derive(Debug, Clone, Copy)]
struct Support {
    circle: Circle,
    /// The share of the outline at which there is an edge along it.
    seen: f64,
    /// How unlikely that is by chance: the negative logarithm, to base 10.
    score: f64,
    /// The share of the outline at which the light breaks there rather than beside it.
    sharp: f64,
}

impl Support {
    fn passes(&self, least: Least) -> bool {
        self.score > least.score && self.seen > least.seen && self.sharp > least.sharp
    }
}

/// The least score of another sphere, over that of the one that is chosen.
const ANOTHER: f64 = 0.4;

/// The least score of another circle about the same thing, over the best.
const RIVAL: f64 = 0.3;

/// The roundest edge, and what else in the picture is round, apart from it, of at least half and at
/// most twice its size, and almost as well seen.
///
/// The roundest edge: circles that edges vote for, each moved to where most edges are, and judged by
/// how much of them is seen, against what the edges around would make of a circle by chance. The one
/// that is chosen is moved to where the light breaks in the `fine` picture, in which what stands close
/// behind the outline lies more pixels away from it.
///
/// # Errors
/// A picture in which no circle passes the least of that, and one in which all that does is
/// saturated.
pub(super) fn find(
    picture: &Reduced,
    fine: &Reduced,
    edges: &Edges,
) -> Result<(Circle, Vec<Circle>)> {
    let side = picture.width.min(picture.height);
    let least = (0.05 * side as f64).max(5.0);
    let mut supports: Vec<Support> = vote::candidates(edges, least, CANDIDATES)
        .into_iter()
        .filter_map(|candidate| settle(edges, candidate))
        .map(|circle| support(edges, circle))
        .collect();
    supports.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut apart: Vec<Support> = Vec::new();
    for support in supports {
        let other = |of: &Support| of.circle.apart(support.circle) >= 1.0;
        if apart.len() < CHOSEN_FROM && apart.iter().all(other) {
            apart.push(support);
        }
    }
    let (saturated, supports): (Vec<Support>, Vec<Support>) = apart
        .into_iter()
        .partition(|support| picture.is_saturated(support.circle));
    let best = choose(&supports).map(|best| follow(picture, fine, best));
    if let Some(best) = best.filter(|best| best.passes(OF_THE_BEST)) {
        let mut spheres = vec![best.circle];
        for support in supports.iter().chain(&saturated) {
            let beside = |support: &Support| {
                let circle = support.circle;
                let ratio = circle.radius / best.circle.radius;
                let apart = |other: &Circle| {
                    let centres = (circle.x - other.x).hypot(circle.y - other.y);
                    centres > 0.9 * (circle.radius + other.radius)
                };
                support.score > ANOTHER * best.score
                    && (0.5..2.0).contains(&ratio)
                    && spheres.iter().all(apart)
            };
            if beside(support) {
                let moved = follow(picture, fine, *support);
                if beside(&moved) && moved.passes(OF_OTHERS) {
                    spheres.push(moved.circle);
                }
            }
        }
        return Ok((best.circle, spheres.into_iter().skip(1).collect()));
    }
    let lamp = |support: &Support| follow(picture, fine, *support).passes(OF_THE_BEST);
    Err(Error::NoSphere {
        reason: if saturated.iter().any(lamp) {
            "all that is round in the picture is saturated, a lamp or a sphere exposed too much"
        } else {
            "no sphere is to be seen in the picture"
        },
    })
}

/// Of the circles about the thing with the best score the one whose score times the root of its
/// radius is largest: what lies within a sphere is a highlight on it, a print, or the image in it of
/// what is around, and is often seen better than the outline is.
///
/// What a reader of finishes says of what is inside chooses no better (docs/explanation/photographs.md).
fn choose(supports: &[Support]) -> Option<Support> {
    let largest_of = |supports: &mut dyn Iterator<Item = &Support>, of: fn(&Support) -> f64| {
        supports.max_by(|a, b| of(a).total_cmp(&of(b))).copied()
    };
    let best = largest_of(&mut supports.iter(), |support| support.score)?;
    let about_the_same = |other: &&Support| {
        let (one, other_one) = (best.circle, other.circle);
        let centres = (one.x - other_one.x).hypot(one.y - other_one.y);
        centres < one.radius.max(other_one.radius) && other.score >= RIVAL * best.score
    };
    largest_of(&mut supports.iter().filter(about_the_same), |support| {
        (support.score + 1.0) * support.circle.radius.sqrt()
    })
}

/// The circle that most edges near a rough one lie on: least squares with weights that fall off
/// with the distance, ever faster (Tukey's biweight, of a width that shrinks).
fn settle(edges: &Edges, rough: Circle) -> Option<Circle> {
    let reach = 0.12 * rough.radius + 1.0;
    let near: Vec<Edge> = edges
        .edges
        .iter()
        .filter(|edge| {
            let (off, cosine) = edge.against(rough);
            off.abs() < reach && cosine > 0.93
        })
        .copied()
        .collect();
    let mut circle = rough;
    let mut width = 0.05 * rough.radius + 0.5;
    for _ in 0..14 {
        let weigh = |edge: &Edge| {
            let (off, cosine) = edge.against(circle);
            let part = 1.0 - (off / (2.0 * width)).powi(2);
            let weight = if part > 0.0 && cosine > 0.9 {
                edge.strength * part * part
            } else {
                0.0
            };
            ((edge.x, edge.y), weight)
        };
        circle = weighted_least_squares(near.iter().map(weigh), circle)?;
        width = (0.75 * width).max(0.5);
    }
    let inside = circle.leaves(edges.width, edges.height) < 1.5 + vote::CUT * circle.radius;
    (inside && circle.radius > 4.0 && circle.radius < 2.0 * rough.radius).then_some(circle)
}

/// How many edges lie along a circle, and how many would by chance: as many as along circles about
/// the same centre that are smaller or larger.
///
/// The score is the tail of the binomial distribution by Chernoff's bound, n·KL(seen ‖ chance),
/// with an independent place every four pixels: what is called meaningful a contrario (Desolneux,
/// Moisan and Morel 2000, doi:10.1023/A:1026593302236).
fn support(edges: &Edges, circle: Circle) -> Support {
    const TOLERANCE: f64 = 0.75;
    let bins = (TAU * circle.radius / 2.0).ceil() as usize;
    // Rings 2·TOLERANCE wide; the middle one is the circle itself.
    let middle = ((0.3 * circle.radius / (2.0 * TOLERANCE)).ceil() as usize).clamp(3, 20);
    let rings = 2 * middle + 1;
    let mut hit = vec![false; bins * rings];
    for edge in &edges.edges {
        let (off, cosine) = edge.against(circle);
        let ring = (off / (2.0 * TOLERANCE)).round() + middle as f64;
        if cosine < 0.94 || ring < 0.0 || ring >= rings as f64 {
            continue;
        }
        let turn = (edge.y - circle.y).atan2(edge.x - circle.x) / TAU + 0.5;
        let bin = ((turn * bins as f64) as usize).min(bins - 1);
        hit[ring as usize * bins + bin] = true;
    }
    // What of the outline lies within the picture.
    let within: Vec<bool> = (0..bins)
        .map(|bin| {
            let (sin, cos) = (TAU * ((bin as f64 + 0.5) / bins as f64 - 0.5)).sin_cos();
            let (x, y) = (
                circle.x + circle.radius * cos,
                circle.y + circle.radius * sin,
            );
            x > 0.0 && y > 0.0 && x < edges.width as f64 && y < edges.height as f64
        })
        .collect();
    let count = within.iter().filter(|within| **within).count().max(1) as f64;
    let share = |ring: usize| {
        let hits = hit[ring * bins..][..bins].iter().zip(&within);
        hits.filter(|(hit, within)| **hit && **within).count() as f64 / count
    };
    let seen = share(middle);
    let others: Vec<f64> = (0..rings)
        .filter(|ring| ring.abs_diff(middle) > 1)
        .map(share)
        .collect();
    let chance = (others.iter().sum::<f64>() / others.len() as f64).clamp(0.02, 0.98);
    let score = if seen > chance {
        let missed = 1.0 - seen;
        let divergence = seen * (seen / chance).ln()
            + missed * (missed.max(f64::MIN_POSITIVE) / (1.0 - chance)).ln();
        0.5 * count * divergence / LN_10
    } else {
        0.0
    };
    Support {
        circle,
        seen,
        score,
        sharp: 0.0,
    }
}

/// A circle moved to where the light breaks in the fine picture, with how much of it that is in the
/// other.
fn follow(picture: &Reduced, fine: &Reduced, support: Support) -> Support {
    let times = picture.scale as f64 / fine.scale as f64;
    let mut circle = support.circle.times(times);
    for _ in 0..3 {
        let next = Rays::across(fine, circle).best();
        let moved = next.apart(circle);
        circle = next;
        if moved < 0.2 {
            break;
        }
    }
    let circle = circle.times(times.recip());
    Support {
        circle,
        sharp: Rays::across(picture, circle).sharp(),
        ..support
    }
}
