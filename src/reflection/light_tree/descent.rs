//! The walk down the tree for one lobe, and the sum over what it accepts.

use fearless_simd::{f64x8, prelude::*};
use glam::DVec3;

use super::cut::{self, CutCells};
use super::lobe::{Lobe, dot};
use super::opening::{Patches, Rules, bilinear, gauss, interpolation};
use super::parts::Part;
use super::rules::{MOST_NODES, RULES};
use super::small_angles::small_sin_cos;
use super::tree::{DEGREES, LightTree, POINTS};

/// So many parts of cells are not divided further: a descent that comes to them has failed.
const MOST_PARTS: usize = 1 << 22;

/// What a box costs on each of `DEGREES`, in values of the lobe; what boxes and parts that are opened
/// cost at the least; and what a rule costs beside its nodes. These decide how long an answer takes,
/// never whether its bound holds.
const COSTS: [f64; DEGREES.len()] = [20.0, 44.0, 68.0];
const OPENED_BOX: f64 = 110.0;
const OPENED_PART: f64 = 70.0;
const RULE: usize = 2;

/// What it costs to ask a cell, in values of the lobe.
const ASKED_CELL: f64 = 20.0;

/// A box of more than so many times the reach of its lobe is opened without being asked.
const LARGE: f64 = 2.0;

/// What a descent ends with.
#[derive(Debug, Clone, Default)]
pub(super) struct Workspace {
    frontier: Vec<u32>,
    next: Vec<u32>,
    parts: Vec<Part>,
    next_parts: Vec<Part>,
    /// By the points a side: level and place.
    boxes: [Vec<(u32, u32)>; DEGREES.len()],
    /// By the nodes a side of the rule.
    cells: [Vec<Part>; MOST_NODES],
    cut: Vec<Part>,
    /// The bound of what was dropped and of what was accepted.
    pub(super) bound: f64,
    /// ∫ |L| times the lobe's bound over what was accepted: what rounding is relative to.
    pub(super) size: f64,
}

impl LightTree {
    /// Walks down until each patch is accepted or dropped. `price` is the bound that a value of the
    /// lobe is worth: of what may be done with a patch the least sum of bound and price is taken.
    #[inline(always)]
    pub(super) fn descend<S: Simd>(
        &self,
        simd: S,
        lobe: &impl Lobe,
        price: f64,
        work: &mut Workspace,
    ) {
        work.bound = 0.0;
        work.size = 0.0;
        for boxes in &mut work.boxes {
            boxes.clear();
        }
        work.cut.clear();
        work.parts.clear();
        for cells in &mut work.cells {
            cells.clear();
        }
        let top = self.levels.len() - 1;
        let mut frontier = std::mem::take(&mut work.frontier);
        let mut next = std::mem::take(&mut work.next);
        frontier.clear();
        frontier.extend(0..(self.levels[top].rows * self.levels[top].columns) as u32);
        for index in (0..=top).rev() {
            next.clear();
            for eight in frontier.chunks(8) {
                self.boxes(simd, lobe, index, eight, price, work, &mut next);
            }
            std::mem::swap(&mut frontier, &mut next);
        }
        work.frontier = frontier;
        work.next = next;
        let mut parts = std::mem::take(&mut work.parts);
        let mut next = std::mem::take(&mut work.next_parts);
        while !parts.is_empty() {
            if parts.len() > MOST_PARTS {
                work.bound = f64::INFINITY;
                break;
            }
            next.clear();
            for eight in parts.chunks(8) {
                self.parts(simd, lobe, eight, price, work, &mut next);
            }
            std::mem::swap(&mut parts, &mut next);
        }
        work.parts = parts;
        work.next_parts = next;
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "each is one thing that a pass over boxes needs"
    )]
    #[inline(always)]
    fn boxes<S: Simd>(
        &self,
        simd: S,
        lobe: &impl Lobe,
        index: usize,
        eight: &[u32],
        price: f64,
        work: &mut Workspace,
        next: &mut Vec<u32>,
    ) {
        let splat = |value| f64x8::splat(simd, value);
        let level = &self.levels[index];
        let mut trig = [[0.0; 8]; 5];
        for lane in 0..8 {
            let at = eight[lane.min(eight.len() - 1)] as usize;
            (trig[0][lane], trig[1][lane]) = level.row_middle[at / level.columns];
            (trig[2][lane], trig[3][lane]) = level.column_middle[at % level.columns];
            trig[4][lane] = level.mass[at];
        }
        let load = |values: &[f64; 8]| f64x8::from_slice(simd, values);
        let [sin, cos, sin_turn, cos_turn] = [
            load(&trig[0]),
            load(&trig[1]),
            load(&trig[2]),
            load(&trig[3]),
        ];
        let mass = load(&trig[4]);
        let patches = Patches {
            centre: [sin * cos_turn, sin * sin_turn, cos],
            sin: sin.abs(),
            half: [splat(level.half); 2],
        };
        let radius = patches.radius(simd);
        let normal = lobe.normal();
        let height = dot(simd, normal, patches.centre, 0.0);
        let above = (-radius).simd_lt(height);
        let size = above.select(lobe.size(simd, patches.centre, radius) * mass, splat(0.0));
        let open = splat(price).simd_lt(size);
        if !open.any_true() {
            work.bound += size.reduce_sum();
            return;
        }
        let mut errors = [[f64::INFINITY; 8]; DEGREES.len()];
        let reach = lobe.reach(simd, patches.centre, POINTS as f64);
        if (open & splat(level.half / LARGE).simd_lt(reach)).any_true() {
            let at = lobe.at(simd, patches.centre);
            let bounds = interpolation(simd, lobe, &at, &patches, reach);
            let astride = height.simd_lt(radius);
            let mut below = splat(0.0);
            if astride.any_true() {
                let at = lobe.at_the_horizon(simd, patches.centre, radius, radius - height);
                below = astride.select(at, splat(0.0));
            }
            for (errors, bound) in errors.iter_mut().zip(bounds) {
                ((bound + below) * mass).store_slice(errors);
            }
        }
        let mut sizes = [0.0; 8];
        size.store_slice(&mut sizes);
        let choose = |lane: usize| {
            let (mut bound, mut total, mut choice) = (sizes[lane], sizes[lane], None);
            for (index, cost) in COSTS.into_iter().enumerate() {
                let with = errors[index][lane] + price * cost;
                if with < total {
                    (bound, total, choice) = (errors[index][lane], with, Some(index));
                }
            }
            (bound, total, choice)
        };
        let opened = |total: f64| total > price * OPENED_BOX;
        // Of the smallest boxes that are opened, what Gauss's rules in their cells are good for.
        let mut rules = [[[f64::INFINITY; 8]; MOST_NODES]; 2];
        if index == 0 && (0..eight.len()).any(|lane| opened(choose(lane).1)) {
            let at = lobe.at(simd, patches.centre);
            let half = splat(0.5 * self.step);
            let within = [radius, half, reach * 0.4];
            let found = Rules::new(simd, lobe, &at, &patches, within);
            // A box's light is over sin θ.
            let lowest = patches.sin - level.half;
            let flat = splat(0.0)
                .simd_lt(lowest)
                .select(mass / lowest, splat(f64::INFINITY));
            for (rules, found) in rules.iter_mut().zip([found.above, found.crossed]) {
                for (rule, found) in rules.iter_mut().zip(found) {
                    (found * flat).store_slice(rule);
                }
            }
        }
        for (lane, &at) in eight.iter().enumerate() {
            let (bound, total, choice) = choose(lane);
            if !opened(total) {
                work.bound += bound;
                if let Some(choice) = choice {
                    work.size += sizes[lane];
                    work.boxes[choice].push((index as u32, at));
                }
            } else {
                let (row, column) = (at as usize / level.columns, at as usize % level.columns);
                if index == 0 {
                    let rules = rules
                        .each_ref()
                        .map(|rules| rules.each_ref().map(|rule| rule[lane]));
                    self.cells_of(normal, row, column, (&rules, sizes[lane], price), work);
                } else {
                    let below = &self.levels[index - 1];
                    for row in 2 * row..(2 * row + 2).min(below.rows) {
                        for column in 2 * column..(2 * column + 2).min(below.columns) {
                            next.push((row * below.columns + column) as u32);
                        }
                    }
                }
            }
        }
    }

    /// Divides a box of the smallest into its cells. Those that a rule is good enough for are
    /// accepted with it, the others are asked one by one.
    #[inline(always)]
    fn cells_of(
        &self,
        normal: DVec3,
        row: usize,
        column: usize,
        (rules, size, price): (&[[f64; MOST_NODES]; 2], f64, f64),
        work: &mut Workspace,
    ) {
        let side = self.side;
        let count = (side * side) as f64;
        // The rule whose bound and price are the least, if they are less than it costs to ask.
        let mut chosen = [None; 2];
        for (chosen, rules) in chosen.iter_mut().zip(rules) {
            let mut least = price * count * ASKED_CELL;
            for (index, bound) in rules.iter().enumerate() {
                let nodes = index + 1;
                let with = bound + price * count * (nodes * nodes + RULE) as f64;
                if with < least {
                    (least, *chosen) = (with, Some((index, *bound)));
                }
            }
        }
        // A cell's middle is no farther than that from the rest of it.
        let radius = 0.7072 * self.step;
        let mut used = [false; 2];
        for row in row * side..((row + 1) * side).min(self.rows) {
            // Cells at the poles are halves.
            let (y, height) = match row {
                0 => (0.5, 0.5),
                row if row + 1 == self.rows => (-0.5, 0.5),
                _ => (0.0, 1.0),
            };
            let (sin, cos) = self.row_middle[row];
            for column in column * side..((column + 1) * side).min(self.columns) {
                let part = Part {
                    row: row as u32,
                    column: column as u32,
                    y,
                    x: 0.0,
                    height,
                    width: 1.0,
                };
                let (sin_turn, cos_turn) = self.column_middle[column];
                let above = sin * (cos_turn * normal.x + sin_turn * normal.y) + cos * normal.z;
                let crossed = usize::from(above < radius);
                match chosen[crossed] {
                    _ if above < -radius && height == 1.0 => {}
                    Some((index, _)) => {
                        used[crossed] = true;
                        work.cells[index].push(part);
                    }
                    None => work.parts.push(part),
                }
            }
        }
        let bounds = [0, 1].map(|kind: usize| {
            chosen[kind]
                .filter(|_| used[kind])
                .map_or(0.0, |(_, bound)| bound)
        });
        work.bound += bounds[0].max(bounds[1]);
        if used != [false; 2] {
            work.size += size;
        }
    }

    #[inline(always)]
    fn parts<S: Simd>(
        &self,
        simd: S,
        lobe: &impl Lobe,
        eight: &[Part],
        price: f64,
        work: &mut Workspace,
        next: &mut Vec<Part>,
    ) {
        let splat = |value| f64x8::splat(simd, value);
        let light = self.gather(simd, eight);
        let patches = &light.patches;
        let radius = patches.radius(simd);
        let normal = lobe.normal();
        let height = dot(simd, normal, patches.centre, 0.0);
        // ∫ L dθ dψ of the brightest channel.
        let [down, along] = patches.half;
        let area = down * along * 4.0;
        let (before, after) = ((light.x * -0.5) + 0.5, (light.x * 0.5) + 0.5);
        let (over, under) = ((light.y * -0.5) + 0.5, (light.y * 0.5) + 0.5);
        let mut flat = splat(0.0);
        for corners in &light.corners {
            let top = corners[0] * before + corners[1] * after;
            let bottom = corners[2] * before + corners[3] * after;
            flat = flat.max(top * over + bottom * under);
        }
        let flat = flat * area;
        let above = (-radius).simd_lt(height);
        let sup = lobe.size(simd, patches.centre, radius);
        let size = above.select(sup * flat * patches.top_sine(simd), splat(0.0));
        if !splat(price).simd_lt(size).any_true() {
            let mut sizes = [0.0; 8];
            size.store_slice(&mut sizes);
            work.bound += sizes[..eight.len()].iter().sum::<f64>();
            return;
        }
        let reach = lobe.reach(simd, patches.centre, 5.0);
        let at = lobe.at(simd, patches.centre);
        let mut bounds = gauss(simd, lobe, &at, patches, reach);
        let astride = height.simd_lt(radius);
        if astride.any_true() {
            // The lobe that goes on below the horizon is integrated, and is 0 there in the sum; or
            // the kink is.
            let below = lobe.at_the_horizon(simd, patches.centre, radius, radius - height);
            let below = below * patches.top_sine(simd) * 2.0;
            let half = down.max(along);
            let rules = Rules::new(simd, lobe, &at, patches, [radius, half, reach * 0.4]);
            for (bound, crossed) in bounds.iter_mut().zip(rules.crossed) {
                *bound = astride.select((*bound + below).min(crossed), *bound);
            }
        }
        let mut errors = [[0.0; 8]; MOST_NODES];
        for (errors, bound) in errors.iter_mut().zip(bounds) {
            (bound * flat).store_slice(errors);
        }
        let mut sizes = [0.0; 8];
        size.store_slice(&mut sizes);
        let mut least = sizes;
        let mut nodes = [0; 8];
        let mut refused = [0.0; 8];
        for lane in 0..eight.len() {
            for index in 0..MOST_NODES {
                let cost = (index + 1) * (index + 1) + RULE;
                let with = errors[index][lane] + price * cost as f64;
                if with < least[lane] {
                    (least[lane], nodes[lane]) = (with, index + 1);
                }
            }
            refused[lane] = f64::from(u8::from(least[lane] > price * OPENED_PART));
        }
        // What no rule is good enough for may be cut.
        let mut cut_errors = [f64::INFINITY; 8];
        let cut = astride & f64x8::from_slice(simd, &refused).simd_gt(splat(0.0));
        if cut.any_true() {
            let bend = bilinear(simd, lobe, &at, patches, reach * 0.8);
            let error = cut::error(simd, lobe, &light, radius, bend, flat);
            cut.select(error, splat(f64::INFINITY))
                .store_slice(&mut cut_errors);
        }
        let mut sines = [0.0; 8];
        patches.sin.store_slice(&mut sines);
        for (lane, &part) in eight.iter().enumerate() {
            let size = sizes[lane];
            if refused[lane] == 0.0 {
                if let Some(index) = nodes[lane].checked_sub(1) {
                    work.bound += errors[index][lane];
                    work.size += size;
                    work.cells[index].push(part);
                } else {
                    work.bound += size;
                }
            } else if cut_errors[lane] <= price * OPENED_PART {
                work.bound += cut_errors[lane];
                work.size += size;
                work.cut.push(part);
            } else {
                // Both sides are halved, or the longer alone.
                let (tall, wide) = (part.height, part.width * sines[lane] as f32);
                let (down, across) = if tall > 1.7 * wide {
                    (true, false)
                } else if wide > 1.7 * tall {
                    (false, true)
                } else {
                    (true, true)
                };
                let rows: &[f32] = if down { &[-0.5, 0.5] } else { &[0.0] };
                let columns: &[f32] = if across { &[-0.5, 0.5] } else { &[0.0] };
                for row in rows {
                    for column in columns {
                        next.push(Part {
                            y: part.y + part.height * row,
                            x: part.x + part.width * column,
                            height: if down { 0.5 * part.height } else { part.height },
                            width: if across { 0.5 * part.width } else { part.width },
                            ..part
                        });
                    }
                }
            }
        }
    }

    /// The sum over what was accepted; and of an untrusted lobe the least value above the horizon, or
    /// 0.
    #[inline(always)]
    pub(super) fn sum<S: Simd, L: Lobe>(
        &self,
        simd: S,
        lobe: &L,
        work: &Workspace,
    ) -> ([f64; 3], f64) {
        let splat = |value| f64x8::splat(simd, value);
        let load = |values: &[f64]| f64x8::from_slice(simd, values);
        let mut sums = [splat(0.0); 3];
        let mut least = splat(0.0);
        for (choice, boxes) in work.boxes.iter().enumerate() {
            for &(index, at) in boxes {
                let level = &self.levels[index as usize];
                let degree = &level.degrees[choice];
                let (at, stride) = (at as usize, degree.stride);
                let rows = &degree.rows[2 * stride * (at / level.columns)..][..2 * stride];
                let columns = &degree.columns[2 * stride * (at % level.columns)..][..2 * stride];
                let weights = &degree.weights[3 * stride * at..][..3 * stride];
                let place = |list: &[f64], part: usize, start: usize| {
                    load(&list[part * stride + start..][..8])
                };
                for start in (0..stride).step_by(8) {
                    let sin = place(rows, 0, start);
                    let light = [
                        sin * place(columns, 1, start),
                        sin * place(columns, 0, start),
                        place(rows, 1, start),
                    ];
                    let values = lobe.value(simd, light);
                    if L::UNTRUSTED {
                        least = least.min(above_the_horizon(simd, lobe, light, values[0]));
                    }
                    for (channel, (sum, value)) in sums.iter_mut().zip(values).enumerate() {
                        *sum = value.mul_add(place(weights, channel, start), *sum);
                    }
                }
            }
        }
        for (index, cells) in work.cells.iter().enumerate() {
            for eight in cells.chunks(8) {
                self.gauss(simd, lobe, eight, index + 1, &mut sums, &mut least);
            }
        }
        for eight in work.cut.chunks(8) {
            let light = self.gather(simd, eight);
            CutCells::new(simd, lobe, &light).sum(simd, &mut sums);
        }
        (sums.map(|sum| sum.reduce_sum()), least.reduce_min())
    }

    /// Gauss's rule over eight parts.
    #[inline(always)]
    fn gauss<S: Simd, L: Lobe>(
        &self,
        simd: S,
        lobe: &L,
        eight: &[Part],
        nodes: usize,
        sums: &mut [f64x8<S>; 3],
        least: &mut f64x8<S>,
    ) {
        let splat = |value| f64x8::splat(simd, value);
        let light = self.gather(simd, eight);
        let normal = lobe.normal();
        let rule = RULES[nodes - 1];
        let half = 0.5 * self.step;
        let [sin, cos, sin_turn, cos_turn] = self.middles(simd, eight);
        let mut turns = [[splat(0.0); 3]; MOST_NODES];
        for (turn, &(node, _)) in turns.iter_mut().zip(rule) {
            let x = light.width.mul_add(splat(node), light.x);
            let (s, c) = small_sin_cos(simd, x * half);
            *turn = [
                sin_turn.mul_add(c, cos_turn * s),
                cos_turn.mul_add(c, -(sin_turn * s)),
                x.mul_add(splat(0.5), splat(0.5)),
            ];
        }
        let area = light.patches.half[0] * light.patches.half[1];
        for &(node, weight) in rule {
            let y = light.height.mul_add(splat(node), light.y);
            let (s, c) = small_sin_cos(simd, y * half);
            let sine = sin.mul_add(c, cos * s);
            let cosine = cos.mul_add(c, -(sin * s));
            let y = y.mul_add(splat(0.5), splat(0.5));
            let area = area * sine * weight;
            let mut lines = [[y; 2]; 3];
            for (line, corners) in lines.iter_mut().zip(&light.corners) {
                let before = (corners[2] - corners[0]).mul_add(y, corners[0]);
                let after = (corners[3] - corners[1]).mul_add(y, corners[1]);
                *line = [before, after - before];
            }
            for (&[sin_turn, cos_turn, x], &(_, weight)) in turns.iter().zip(rule) {
                let direction = [sine * cos_turn, sine * sin_turn, cosine];
                let values = lobe.value(simd, direction);
                if L::UNTRUSTED {
                    *least = least.min(above_the_horizon(simd, lobe, direction, values[0]));
                }
                let height = dot(simd, normal, direction, 0.0);
                let area = height.simd_gt(splat(0.0)).select(area * weight, splat(0.0));
                for ((sum, line), value) in sums.iter_mut().zip(lines).zip(values) {
                    *sum = line[1].mul_add(x, line[0]).mul_add(value * area, *sum);
                }
            }
        }
    }
}

/// A value where the light is above the horizon, and 0 elsewhere.
#[inline(always)]
fn above_the_horizon<S: Simd>(
    simd: S,
    lobe: &impl Lobe,
    light: [f64x8<S>; 3],
    value: f64x8<S>,
) -> f64x8<S> {
    let zero = f64x8::splat(simd, 0.0);
    let above = dot(simd, lobe.normal(), light, 0.0).simd_gt(zero);
    above.select(value, zero)
}
