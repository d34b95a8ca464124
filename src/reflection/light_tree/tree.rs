//! The light as a tree of boxes of the map.

use std::f64::consts::PI;

use fearless_simd::Level as SimdLevel;

use crate::illumination::EnvironmentMap;
use crate::sphere::Rule;
use crate::{Parallelism, Result, vectors};

/// Chebyshev points of a box in each direction.
pub(super) const POINTS: usize = 8;
pub(super) const NODES: usize = POINTS * POINTS;

/// The smallest boxes have 2² cells a side, and 2³ where the map has more rows than this: a matter
/// of memory.
const MANY_ROWS: usize = 1024;

/// Maps of fewer rows are refined, so that a cell is small.
const FEWEST_ROWS: usize = 16;

/// The boxes of one size.
#[derive(Debug)]
pub(super) struct Level {
    /// Half the side of a box in θ and in ψ.
    pub(super) half: f64,
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// For each box and channel the weights of its points, θ outside.
    pub(super) weights: Vec<[[f64; NODES]; 3]>,
    /// For each box ∫ L dω of the brightest channel.
    pub(super) mass: Vec<f64>,
    /// For each row the sine and the cosine of its middle.
    pub(super) row_middle: Vec<(f64, f64)>,
    /// For each column the sine and the cosine of its middle.
    pub(super) column_middle: Vec<(f64, f64)>,
    /// For each row the sines and the cosines of the points' θ, in the order of the weights.
    pub(super) row_points: Vec<([f64; NODES], [f64; NODES])>,
    /// For each column those of ψ of the first eight.
    pub(super) column_points: Vec<([f64; 8], [f64; 8])>,
}

/// A map made ready for integrals against any lobe, with a bound of their errors.
///
/// The light is kept as a tree of boxes of the map, 4, 8, 16 … cells a side, a cell being what lies
/// between the centres of four pixels. Each box holds the integrals of the light against Lagrange's
/// polynomials on 8 × 8 Chebyshev points, exact for the function that [`EnvironmentMap::radiance`]
/// is, so that a lobe that is smooth on the box is integrated by 64 of its values. Boxes on which
/// it is not smooth enough are opened, down to cells and parts of cells. What that costs in
/// accuracy is bounded, and the boxes are opened until the bound fits:
/// docs/reference/rendering-bound.md.
///
/// It serves all lobes and takes 128 bytes a pixel beside the map's own 24 (32 for maps of more
/// than 1024 rows): 20 MB for 512 × 256 pixels.
///
/// ```
/// use lobes::illumination::EnvironmentMap;
/// use lobes::reflectance::{Material, Variant};
/// use lobes::reflection::{LightTree, ShadingPoint};
/// use lobes::{Parallelism, glam::DVec3};
/// let map = EnvironmentMap::new("grey", 32, 16, vec![[2.0; 3]; 512])?;
/// let tree = LightTree::new(&map, Parallelism::Sequential)?;
/// let point = ShadingPoint { normal: DVec3::X, view: DVec3::X };
/// let seen = tree.radiance(&Material::white(), Variant::Duer, &[point], 1e-6, Parallelism::Sequential)?;
/// assert!((seen[0].value[0] - 2.0).abs() <= seen[0].bound && seen[0].bound <= 2e-6);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug)]
pub struct LightTree {
    /// The angle between pixels.
    pub(super) step: f64,
    /// Rows and columns of cells: the first row and the last are cut in half by the poles.
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// The pixels with a row beyond each pole and a column more.
    pub(super) pixels: Vec<[f64; 3]>,
    /// For each row of cells the sine and the cosine of its middle; for each column.
    pub(super) row_middle: Vec<(f64, f64)>,
    pub(super) column_middle: Vec<(f64, f64)>,
    /// From the smallest boxes upwards, and the cells a side of those.
    pub(super) levels: Vec<Level>,
    pub(super) side: usize,
    /// ∫ L dω of each channel.
    pub(super) total: [f64; 3],
    pub(super) simd: SimdLevel,
}

/// The Chebyshev points, falling.
fn points() -> [f64; POINTS] {
    std::array::from_fn(|index| (PI * (index as f64 + 0.5) / POINTS as f64).cos())
}

/// Lagrange's polynomials on the points.
fn lagrange(x: f64) -> [f64; POINTS] {
    let nodes = points();
    std::array::from_fn(|index| {
        (0..POINTS)
            .filter(|&other| other != index)
            .map(|other| (x - nodes[other]) / (nodes[index] - nodes[other]))
            .product()
    })
}

impl LightTree {
    /// Prepares a map.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) where there is none.
    pub fn new(map: &EnvironmentMap, parallelism: Parallelism) -> Result<Self> {
        let times = (1..)
            .step_by(2)
            .find(|times| times * map.height() >= FEWEST_ROWS)
            .unwrap_or(1);
        let (width, height) = (times * map.width(), times * map.height());
        let pixels = padded(map, times)?;
        let step = PI / height as f64;
        let (rows, columns) = (height + 1, width);
        let middle = |angle: f64| angle.sin_cos();
        let mut tree = Self {
            step,
            rows,
            columns,
            pixels,
            row_middle: (0..rows).map(|row| middle(step * row as f64)).collect(),
            column_middle: (0..columns)
                .map(|column| middle(step * (column as f64 + 1.0)))
                .collect(),
            levels: Vec::new(),
            side: if height > MANY_ROWS { 8 } else { 4 },
            total: [0.0; 3],
            simd: vectors::level(),
        };
        tree.levels.push(tree.leaves(parallelism)?);
        while tree
            .levels
            .last()
            .is_some_and(|level| level.half < PI / 8.0)
        {
            let above = tree.above(&tree.levels[tree.levels.len() - 1], parallelism);
            tree.levels.push(above);
        }
        if let Some(top) = tree.levels.last() {
            for weights in &top.weights {
                for (total, weights) in tree.total.iter_mut().zip(weights) {
                    *total += weights.iter().sum::<f64>();
                }
            }
        }
        Ok(tree)
    }

    /// The boxes of the lowest level.
    fn leaves(&self, parallelism: Parallelism) -> Result<Level> {
        let side = self.side;
        let rows = self.rows.div_ceil(side);
        let columns = self.columns.div_ceil(side);
        let rule = Rule::gauss_legendre(12)?;
        // ∫ of a pixel's half hats times Lagrange's polynomials over a cell: (pixel before, pixel
        // after).
        let moments = |middle: f64, box_middle: f64, limits: [f64; 2], sine: bool| {
            let mut sums = [[0.0; POINTS]; 2];
            let (centre, half) = (0.5 * (limits[0] + limits[1]), 0.5 * (limits[1] - limits[0]));
            for (node, weight) in rule.nodes.iter().zip(&rule.weights) {
                let angle = centre + half * node;
                let weight = half * weight * if sine { angle.sin() } else { 1.0 };
                let along = (angle - middle) / self.step + 0.5;
                let values = lagrange((angle - box_middle) / (0.5 * self.step * side as f64));
                for (index, value) in values.into_iter().enumerate() {
                    sums[0][index] += weight * (1.0 - along) * value;
                    sums[1][index] += weight * along * value;
                }
            }
            sums
        };
        let half = 0.5 * self.step * side as f64;
        let across: Vec<[[f64; POINTS]; 2]> = (0..side)
            .map(|cell| {
                let middle = self.step * (cell as f64 + 0.5);
                let limits = [self.step * cell as f64, self.step * (cell + 1) as f64];
                moments(middle, half, limits, false)
            })
            .collect();
        let stride = self.columns + 1;
        let boxes = parallelism.map(rows, |row| {
            let box_middle = self.step * ((row * side) as f64 - 0.5) + half;
            let cells = side.min(self.rows - row * side);
            let down: Vec<[[f64; POINTS]; 2]> = (0..cells)
                .map(|cell| {
                    let middle = self.step * (row * side + cell) as f64;
                    let limits = [middle - 0.5 * self.step, middle + 0.5 * self.step];
                    moments(
                        middle,
                        box_middle,
                        limits.map(|limit| limit.clamp(0.0, PI)),
                        true,
                    )
                })
                .collect();
            (0..columns)
                .map(|column| {
                    let width = side.min(self.columns - column * side);
                    let mut weights = [[0.0; NODES]; 3];
                    for line in 0..=cells {
                        let start = (row * side + line) * stride + column * side;
                        let mut sums = [[0.0; POINTS]; 3];
                        for place in 0..=width {
                            let pixel = self.pixels[start + place];
                            for k in 0..POINTS {
                                let before = if place < width {
                                    across[place][0][k]
                                } else {
                                    0.0
                                };
                                let after = if place > 0 {
                                    across[place - 1][1][k]
                                } else {
                                    0.0
                                };
                                for channel in 0..3 {
                                    sums[channel][k] += pixel[channel] * (before + after);
                                }
                            }
                        }
                        for j in 0..POINTS {
                            let before = if line < cells { down[line][0][j] } else { 0.0 };
                            let after = if line > 0 { down[line - 1][1][j] } else { 0.0 };
                            for channel in 0..3 {
                                for k in 0..POINTS {
                                    weights[channel][POINTS * j + k] +=
                                        (before + after) * sums[channel][k];
                                }
                            }
                        }
                    }
                    weights
                })
                .collect::<Vec<_>>()
        });
        Ok(self.level(half, rows, columns, boxes.concat()))
    }

    /// The boxes of twice the side.
    fn above(&self, below: &Level, parallelism: Parallelism) -> Level {
        let (rows, columns) = (below.rows.div_ceil(2), below.columns.div_ceil(2));
        // Each polynomial of the large box at the points of its first and its second half.
        let transfer: [[[f64; POINTS]; POINTS]; 2] =
            [-0.5, 0.5].map(|middle| points().map(|point| lagrange(middle + 0.5 * point)));
        let boxes = parallelism.map(rows, |row| {
            (0..columns)
                .map(|column| {
                    let mut weights = [[0.0; NODES]; 3];
                    for (side, down) in transfer.iter().enumerate() {
                        for (turn, across) in transfer.iter().enumerate() {
                            let (child_row, child_column) = (2 * row + side, 2 * column + turn);
                            if child_row >= below.rows || child_column >= below.columns {
                                continue;
                            }
                            let child = &below.weights[child_row * below.columns + child_column];
                            for (sum, child) in weights.iter_mut().zip(child) {
                                for (from, down) in child.chunks_exact(POINTS).zip(down) {
                                    let mut line = [0.0; POINTS];
                                    for (value, across) in from.iter().zip(across) {
                                        for (line, across) in line.iter_mut().zip(across) {
                                            *line += value * across;
                                        }
                                    }
                                    for (to, down) in sum.chunks_exact_mut(POINTS).zip(down) {
                                        for (to, line) in to.iter_mut().zip(line) {
                                            *to += down * line;
                                        }
                                    }
                                }
                            }
                        }
                    }
                    weights
                })
                .collect::<Vec<_>>()
        });
        self.level(2.0 * below.half, rows, columns, boxes.concat())
    }

    fn level(
        &self,
        half: f64,
        rows: usize,
        columns: usize,
        weights: Vec<[[f64; NODES]; 3]>,
    ) -> Level {
        let mass = weights
            .iter()
            .map(|weights| {
                weights
                    .iter()
                    .map(|weights| weights.iter().sum::<f64>())
                    .fold(0.0, f64::max)
            })
            .collect();
        let row_at = |row: usize| half * (2 * row + 1) as f64 - 0.5 * self.step;
        let column_at = |column: usize| half * (2 * column + 1) as f64 + 0.5 * self.step;
        let points = points();
        Level {
            half,
            rows,
            columns,
            weights,
            mass,
            row_middle: (0..rows).map(|row| row_at(row).sin_cos()).collect(),
            column_middle: (0..columns)
                .map(|column| column_at(column).sin_cos())
                .collect(),
            row_points: (0..rows)
                .map(|row| {
                    let at: [(f64, f64); NODES] = std::array::from_fn(|index| {
                        (row_at(row) + half * points[index / POINTS]).sin_cos()
                    });
                    (at.map(|(sin, _)| sin), at.map(|(_, cos)| cos))
                })
                .collect(),
            column_points: (0..columns)
                .map(|column| {
                    let at: [(f64, f64); 8] = std::array::from_fn(|index| {
                        (column_at(column) + half * points[index % POINTS]).sin_cos()
                    });
                    (at.map(|(sin, _)| sin), at.map(|(_, cos)| cos))
                })
                .collect(),
        }
    }
}

/// The pixels of a map refined by an odd factor, which leaves its function, with the rows beyond
/// the poles and the first column after the last.
fn padded(map: &EnvironmentMap, times: usize) -> Result<Vec<[f64; 3]>> {
    let (width, height) = (times * map.width(), times * map.height());
    let refined = if times == 1 {
        map.clone()
    } else {
        let blank = EnvironmentMap::new("", width, height, vec![[1.0; 3]; width * height])?;
        let pixels = (0..width * height)
            .map(|index| map.radiance(blank.direction(index / width, index % width)))
            .collect();
        EnvironmentMap::new(map.name(), width, height, pixels)?
    };
    let mut pixels = crate::error::allocate("the tree of light", (width + 1) * (height + 2))?;
    pixels.clear();
    for line in 0..height + 2 {
        let (row, turn) = match line {
            0 => (0, width / 2),
            line if line == height + 1 => (height - 1, width / 2),
            line => (line - 1, 0),
        };
        pixels.extend((0..=width).map(|column| refined.pixel(row, (column + turn) % width)));
    }
    Ok(pixels)
}
