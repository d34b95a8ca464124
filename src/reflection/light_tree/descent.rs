//! The walk down the tree for one lobe, and the sum over what it accepts.

use fearless_simd::{f64x8, prelude::*};

use super::cut::{self, CutCells};
use super::lobe::{Lobe, dot};
use super::neighbourhood::Neighbourhood;
use super::opening::{Patches, bilinear, gauss, interpolation};
use super::parts::Part;
use super::small_angles::small_sin_cos;
use super::tree::{LightTree, NODES, POINTS};

/// So many parts of cells are not divided further: a descent that comes to them has failed.
const MOST_PARTS: usize = 1 << 22;

/// What a descent ends with.
#[derive(Debug, Clone, Default)]
pub(super) struct Workspace {
    frontier: Vec<u32>,
    next: Vec<u32>,
    parts: Vec<Part>,
    next_parts: Vec<Part>,
    boxes: Vec<(u32, u32)>,
    /// By the nodes a side of the rule.
    cells: [Vec<Part>; 4],
    cut: Vec<Part>,
    /// The bound of what was dropped and of what was accepted.
    pub(super) bound: f64,
    /// ∫ |L| times the lobe's bound over what was accepted: what rounding is relative to.
    pub(super) size: f64,
}

impl LightTree {
    /// Walks down until each patch is accepted at a bound of at most `share`, or dropped.
    #[inline(always)]
    pub(super) fn descend<S: Simd>(
        &self,
        simd: S,
        lobe: &impl Lobe,
        share: f64,
        work: &mut Workspace,
    ) {
        work.bound = 0.0;
        work.size = 0.0;
        work.boxes.clear();
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
                self.boxes(simd, lobe, index, eight, share, work, &mut next);
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
                self.parts(simd, lobe, eight, share, work, &mut next);
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
        share: f64,
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
        let [sin, cos, sin_turn, cos_turn, mass] =
            trig.map(|values| f64x8::from_slice(simd, &values));
        let patches = Patches {
            centre: [sin * cos_turn, sin * sin_turn, cos],
            sin: sin.abs(),
            half: [splat(level.half); 2],
        };
        let radius = patches.radius(simd);
        let normal = lobe.normal();
        let height = dot(simd, normal, patches.centre, 0.0);
        let above = (-radius).simd_lt(height);
        let size = above.select(
            lobe.bound(simd, patches.centre, Neighbourhood::real(simd, radius)) * mass,
            splat(0.0),
        );
        let open = splat(share).simd_lt(size);
        if !open.any_true() {
            work.bound += size.reduce_sum();
            return;
        }
        let reach = lobe.reach(simd, patches.centre, POINTS as f64);
        let first = interpolation(simd, lobe, &patches, reach);
        let second = interpolation(simd, lobe, &patches, reach * 0.6);
        let mut error = first.min(second);
        let astride = height.simd_lt(radius);
        if astride.any_true() {
            let below = lobe.at_the_horizon(simd, patches.centre, radius, radius - height);
            error += astride.select(below, splat(0.0));
        }
        let error = error * mass;
        let (mut sizes, mut errors) = ([0.0; 8], [0.0; 8]);
        size.store_slice(&mut sizes);
        error.store_slice(&mut errors);
        for (lane, &at) in eight.iter().enumerate() {
            if sizes[lane] <= share {
                work.bound += sizes[lane];
            } else if errors[lane] <= share {
                work.bound += errors[lane];
                work.size += sizes[lane];
                work.boxes.push((index as u32, at));
            } else {
                let (row, column) = (at as usize / level.columns, at as usize % level.columns);
                if index == 0 {
                    self.cells_of(row, column, &mut work.parts);
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

    fn cells_of(&self, row: usize, column: usize, parts: &mut Vec<Part>) {
        let side = self.side;
        for row in row * side..((row + 1) * side).min(self.rows) {
            // Cells at the poles are halves.
            let (y, height) = match row {
                0 => (0.5, 0.5),
                row if row + 1 == self.rows => (-0.5, 0.5),
                _ => (0.0, 1.0),
            };
            for column in column * side..((column + 1) * side).min(self.columns) {
                parts.push(Part {
                    row: row as u32,
                    column: column as u32,
                    y,
                    x: 0.0,
                    height,
                    width: 1.0,
                });
            }
        }
    }

    #[inline(always)]
    fn parts<S: Simd>(
        &self,
        simd: S,
        lobe: &impl Lobe,
        eight: &[Part],
        share: f64,
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
        let sup = lobe.bound(simd, patches.centre, Neighbourhood::real(simd, radius));
        let size = above.select(sup * flat * patches.top_sine(simd), splat(0.0));
        if !splat(share).simd_lt(size).any_true() {
            let mut sizes = [0.0; 8];
            size.store_slice(&mut sizes);
            work.bound += sizes[..eight.len()].iter().sum::<f64>();
            return;
        }
        let errors_of = |reach| gauss(simd, lobe, patches, reach);
        let reach = lobe.reach(simd, patches.centre, 4.0);
        let first = errors_of(reach);
        let second = errors_of(reach * 0.6);
        let astride = height.simd_lt(radius);
        let mut beyond = splat(0.0);
        let mut cut_errors = [f64::INFINITY; 8];
        if astride.any_true() {
            let below = lobe.at_the_horizon(simd, patches.centre, radius, radius - height);
            beyond = astride.select(below * patches.top_sine(simd), splat(0.0));
            let bend = bilinear(simd, lobe, patches, reach).min(bilinear(
                simd,
                lobe,
                patches,
                reach * 0.6,
            ));
            let error = cut::error(simd, lobe, &light, radius, height, bend, flat);
            astride
                .select(error, splat(f64::INFINITY))
                .store_slice(&mut cut_errors);
        }
        let mut errors = [[0.0; 8]; 4];
        for ((errors, first), second) in errors.iter_mut().zip(first).zip(second) {
            ((first.min(second) + beyond) * flat).store_slice(errors);
        }
        let mut sizes = [0.0; 8];
        size.store_slice(&mut sizes);
        let (mut sines, mut aside) = ([0.0; 8], [0.0; 8]);
        patches.sin.store_slice(&mut sines);
        astride
            .select(splat(1.0), splat(0.0))
            .store_slice(&mut aside);
        for (lane, &part) in eight.iter().enumerate() {
            let size = sizes[lane];
            if size <= share {
                work.bound += size;
                continue;
            }
            let nodes = (0..4).find(|&nodes| errors[nodes][lane] <= share);
            if let Some(nodes) = nodes {
                work.bound += errors[nodes][lane];
                work.size += size;
                work.cells[nodes].push(part);
            } else if cut_errors[lane] <= share {
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
        for &(index, at) in &work.boxes {
            let level = &self.levels[index as usize];
            let at = at as usize;
            let (sin, cos) = &level.row_points[at / level.columns];
            let (sin_turn, cos_turn) = &level.column_points[at % level.columns];
            let weights = &level.weights[at];
            let (sin_turn, cos_turn) = (load(sin_turn), load(cos_turn));
            for half in 0..NODES / 8 {
                let range = 8 * half..8 * half + 8;
                let sin = load(&sin[range.clone()]);
                let light = [sin * cos_turn, sin * sin_turn, load(&cos[range.clone()])];
                let value = lobe.value(simd, light);
                if L::UNTRUSTED {
                    least = least.min(above_the_horizon(simd, lobe, light, value));
                }
                for (sum, weights) in sums.iter_mut().zip(weights) {
                    *sum = value.mul_add(load(&weights[range.clone()]), *sum);
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
        let rule = RULES[nodes - 1];
        let half = 0.5 * self.step;
        let [sin, cos, sin_turn, cos_turn] = self.middles(simd, eight);
        let mut turns = [[splat(0.0); 3]; 4];
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
            let lines = light.corners.each_ref().map(|corners| {
                let before = (corners[2] - corners[0]).mul_add(y, corners[0]);
                let after = (corners[3] - corners[1]).mul_add(y, corners[1]);
                [before, after - before]
            });
            for (&[sin_turn, cos_turn, x], &(_, weight)) in turns.iter().zip(rule) {
                let direction = [sine * cos_turn, sine * sin_turn, cosine];
                let value = lobe.value(simd, direction);
                if L::UNTRUSTED {
                    *least = least.min(above_the_horizon(simd, lobe, direction, value));
                }
                let value = value * area * weight;
                for (sum, line) in sums.iter_mut().zip(lines) {
                    *sum = line[1].mul_add(x, line[0]).mul_add(value, *sum);
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

/// Gauss's rules on [−1, 1].
const RULES: [&[(f64, f64)]; 4] = [
    &[(0.0, 2.0)],
    &[
        (-0.577_350_269_189_625_8, 1.0),
        (0.577_350_269_189_625_8, 1.0),
    ],
    &[
        (-0.774_596_669_241_483_4, 5.0 / 9.0),
        (0.0, 8.0 / 9.0),
        (0.774_596_669_241_483_4, 5.0 / 9.0),
    ],
    &[
        (-0.861_136_311_594_052_6, 0.347_854_845_137_453_86),
        (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
        (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_86),
    ],
];
