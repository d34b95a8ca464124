//! Circles that edges vote for.

use std::f64::consts::TAU;

use super::Circle;
use super::edges::Edges;

/// A circle may go so far beyond the border, as a share of its radius.
pub(super) const CUT: f64 = 0.15;

/// Parts of a circle of which each counts once.
const SECTORS: usize = 32;

/// The ratio of one radius to the next.
const RATIO: f64 = 1.05;

/// A cell's side over the radius; what is looked at are two by two cells.
const CELL: f64 = 0.06;

/// The circles with the most votes, best first: each edge votes for the centres that lie along its
/// normal to either side, at every radius (Kimme, Ballard and Sklansky 1975,
/// 10.1145/360666.360677), and of the votes for one centre and radius each sector of the circle
/// counts once, by its strongest edge, so that a long straight edge or a patch of texture is one
/// vote.
pub(super) fn candidates(edges: &Edges, least: f64, count: usize) -> Vec<Circle> {
    let (width, height) = (edges.width as f64, edges.height as f64);
    let most = 0.5 * width.min(height) * (1.02 + CUT);
    let mut all: Vec<(f32, Circle)> = Vec::new();
    let least_votes = 0.25 * SECTORS as f32;
    let sectors: Vec<usize> = edges
        .edges
        .iter()
        .map(|edge| {
            let turn = edge.normal.1.atan2(edge.normal.0) / TAU + 0.5;
            ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
        })
        .collect();
    let (mut votes, mut totals) = (Vec::new(), Vec::new());
    let mut radius = least;
    while radius <= most {
        let cell = (CELL * radius).max(1.5);
        let (columns, rows) = (
            (width / cell).ceil() as usize + 1,
            (height / cell).ceil() as usize + 1,
        );
        votes.clear();
        votes.resize(columns * rows, [0f32; SECTORS]);
        totals.clear();
        totals.resize(columns * rows, 0f32);
        for (edge, sector) in edges.edges.iter().zip(&sectors) {
            for (sign, turned) in [(1.0, 0), (-1.0, SECTORS / 2)] {
                let (dx, dy) = (sign * edge.normal.0, sign * edge.normal.1);
                let (x, y) = (edge.x - radius * dx, edge.y - radius * dy);
                let slack = (0.02 + CUT) * radius + 1.0;
                if x < radius - slack
                    || y < radius - slack
                    || x > width - radius + slack
                    || y > height - radius + slack
                {
                    continue;
                }
                let place = (y / cell) as usize * columns + (x / cell) as usize;
                let vote = &mut votes[place][(sector + turned) % SECTORS];
                *vote = vote.max(edge.strength as f32);
                totals[place] += edge.strength as f32;
            }
        }
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let i = row * columns + column;
                if totals[i] + totals[i + 1] + totals[i + columns] + totals[i + columns + 1]
                    < least_votes
                {
                    continue;
                }
                let four = [i, i + 1, i + columns, i + columns + 1].map(|i| &votes[i]);
                let mut sum = 0f32;
                for s in 0..SECTORS {
                    let best = four[0][s].max(four[1][s]).max(four[2][s].max(four[3][s]));
                    sum += best;
                }
                if sum > least_votes {
                    let circle = Circle {
                        x: (column + 1) as f64 * cell,
                        y: (row + 1) as f64 * cell,
                        radius,
                    };
                    all.push((sum, circle));
                }
            }
        }
        radius *= RATIO;
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<Circle> = Vec::new();
    for (_, circle) in all {
        if chosen
            .iter()
            .all(|other| circle.apart(*other) >= 0.055 * other.radius)
        {
            chosen.push(circle);
            if chosen.len() == count {
                break;
            }
        }
    }
    chosen
}
