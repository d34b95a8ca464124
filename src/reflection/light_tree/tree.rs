//! The light as a tree of boxes of the map.

use std::f64::consts::PI;

use fearless_simd::Level as SimdLevel;

use crate::illumination::EnvironmentMap;
use crate::sphere::Rule;
use crate::{Parallelism, Result, vectors};

/// Chebyshev points of a box in each direction.
pub(super) const POINTS: usize = 8;
const NODES: usize = POINTS * POINTS;

/// On so many points a side a box may be summed.
pub(super) const DEGREES: [usize; 3] = [4, 6, POINTS];

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
    /// Its light on each of `DEGREES` points a side.
    pub(super) degrees: [Degree; DEGREES.len()],
    /// For each box ∫ L dω of the brightest channel.
    pub(super) mass: Vec<f64>,
    /// For each row the sine and the cosine of its middle.
    pub(super) row_middle: Vec<(f64, f64)>,
    /// For each column the sine and the cosine of its middle.
    pub(super) column_middle: Vec<(f64, f64)>,
}

/// The boxes of one size on so many points a side. Lists of points are filled up to whole vectors
/// with the last, which has no weight.
#[derive(Debug)]
pub(super) struct Degree {
    /// The length of such a list.
    pub(super) stride: usize,
    /// For each box and channel the weights of its points, θ outside.
    pub(super) weights: Vec<f64>,
    /// For each row the sines, then the cosines of the points' θ, for each column those of ψ.
    pub(super) rows: Vec<f64>,
    pub(super) columns: Vec<f64>,
}

/// A map made ready for integrals against any lobe, with a bound of their errors.
///
/// The light is kept as a tree of boxes of the map, 4, 8, 16 … cells a side, a cell being what lies
/// between the centres of four pixels. Each box holds the integrals of the light against Lagrange's
/// polynomials on 8 × 8 Chebyshev points, exact for the function that [`EnvironmentMap::radiance`]
/// is, and those on 4 × 4 and 6 × 6, so that a lobe that is smooth on the box is integrated by 16 to
/// 64 of its values. Boxes on which it is not smooth enough are opened, down to cells and parts of
/// cells. What that costs in
/// accuracy is bounded, and the boxes are opened until the bound fits:
/// docs/reference/rendering-bound.md.
///
/// It serves all lobes and takes 240 bytes a pixel beside the map's own 24 (60 for maps of more
/// than 1024 rows): 35 MB for 512 × 256 pixels.
///
/// ```
/// use lobes::illumination::EnvironmentMap;
/// use lobes::reflectance::{Material, Variant};
/// use lobes::reflection::{LightTree, ShadingPoint, Surface};
/// use lobes::{Parallelism, glam::DVec3};
/// let map = EnvironmentMap::new("grey", 32, 16, vec![[2.0; 3]; 512])?;
/// let tree = LightTree::new(&map, Parallelism::Sequential)?;
/// let point = ShadingPoint { normal: DVec3::X, view: DVec3::X };
/// let white = Material::white();
/// let surface = Surface::Ward(&white, Variant::Duer);
/// let seen = tree.radiance(surface, &[point], 1e-6, Parallelism::Sequential)?;
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
fn points<const N: usize>() -> [f64; N] {
    std::array::from_fn(|index| (PI * (index as f64 + 0.5) / N as f64).cos())
}

/// Lagrange's polynomials on the points.
fn lagrange<const N: usize>(x: f64) -> [f64; N] {
    let nodes = points::<N>();
    std::array::from_fn(|index| {
        (0..N)
            .filter(|&other| other != index)
            .map(|other| (x - nodes[other]) / (nodes[index] - nodes[other]))
            .product()
    })
}

impl Degree {
    /// Of boxes of a size, with these middles down and along, given their weights on `POINTS`.
    fn new<const N: usize>(
        half: f64,
        [down, along]: [&[f64]; 2],
        weights: &[[[f64; NODES]; 3]],
    ) -> Self {
        let stride = (N * N).next_multiple_of(8);
        // Polynomials of fewer points are polynomials of more: at those, exactly.
        let across = points::<POINTS>().map(lagrange::<N>);
        let mut lower = Vec::with_capacity(3 * stride * weights.len());
        for channel in weights.iter().flatten() {
            let start = lower.len();
            lower.resize(start + stride, 0.0);
            for (line, down) in channel.chunks_exact(POINTS).zip(&across) {
                let mut sums = [0.0; N];
                for (weight, across) in line.iter().zip(&across) {
                    for (sum, across) in sums.iter_mut().zip(across) {
                        *sum += weight * across;
                    }
                }
                for (line, down) in lower[start..].chunks_exact_mut(N).zip(down) {
                    for (to, sum) in line.iter_mut().zip(sums) {
                        *to += down * sum;
                    }
                }
            }
        }
        let nodes = points::<N>();
        let places = |middles: &[f64], index: fn(usize) -> usize| {
            let mut places = Vec::with_capacity(2 * stride * middles.len());
            for middle in middles {
                let angle = |place: usize| middle + half * nodes[index(place.min(N * N - 1))];
                places.extend((0..stride).map(|place| angle(place).sin()));
                places.extend((0..stride).map(|place| angle(place).cos()));
            }
            places
        };
        Self {
            stride,
            weights: lower,
            rows: places(down, |place| place / N),
            columns: places(along, |place| place % N),
        }
    }
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
        let mut boxes = tree.leaves(parallelism)?;
        loop {
            let level = tree.level(&boxes);
            let done = level.half >= PI / 8.0;
            tree.levels.push(level);
            if done {
                break;
            }
            boxes = boxes.above(parallelism);
        }
        for weights in &boxes.weights {
            for (total, weights) in tree.total.iter_mut().zip(weights) {
                *total += weights.iter().sum::<f64>();
            }
        }
        Ok(tree)
    }

    /// The boxes of the lowest level.
    fn leaves(&self, parallelism: Parallelism) -> Result<Boxes> {
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
                let values =
                    lagrange::<POINTS>((angle - box_middle) / (0.5 * self.step * side as f64));
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
        Ok(Boxes {
            half,
            rows,
            columns,
            weights: boxes.concat(),
        })
    }

    fn level(&self, boxes: &Boxes) -> Level {
        let Boxes {
            half,
            rows,
            columns,
            ref weights,
        } = *boxes;
        let mass = weights
            .iter()
            .map(|weights| {
                weights
                    .iter()
                    .map(|weights| weights.iter().sum::<f64>())
                    .fold(0.0, f64::max)
            })
            .collect();
        let middles = |count: usize, first: f64| -> Vec<f64> {
            (0..count)
                .map(|index| half * (2 * index + 1) as f64 + first)
                .collect()
        };
        let down = middles(rows, -0.5 * self.step);
        let along = middles(columns, 0.5 * self.step);
        let sides = [down.as_slice(), along.as_slice()];
        Level {
            half,
            rows,
            columns,
            degrees: [
                Degree::new::<{ DEGREES[0] }>(half, sides, weights),
                Degree::new::<{ DEGREES[1] }>(half, sides, weights),
                Degree::new::<{ DEGREES[2] }>(half, sides, weights),
            ],
            mass,
            row_middle: down.iter().map(|middle| middle.sin_cos()).collect(),
            column_middle: along.iter().map(|middle| middle.sin_cos()).collect(),
        }
    }
}

/// The weights of boxes on `POINTS`, while the tree is made.
struct Boxes {
    half: f64,
    rows: usize,
    columns: usize,
    /// For each box and channel, θ outside.
    weights: Vec<[[f64; NODES]; 3]>,
}

impl Boxes {
    /// The boxes of twice the side.
    fn above(&self, parallelism: Parallelism) -> Self {
        let (rows, columns) = (self.rows.div_ceil(2), self.columns.div_ceil(2));
        // Each polynomial of the large box at the points of its first and its second half.
        let transfer: [[[f64; POINTS]; POINTS]; 2] =
            [-0.5, 0.5].map(|middle| points().map(|point: f64| lagrange(middle + 0.5 * point)));
        let boxes = parallelism.map(rows, |row| {
            (0..columns)
                .map(|column| {
                    let mut weights = [[0.0; NODES]; 3];
                    for (side, down) in transfer.iter().enumerate() {
                        for (turn, across) in transfer.iter().enumerate() {
                            let (child_row, child_column) = (2 * row + side, 2 * column + turn);
                            if child_row >= self.rows || child_column >= self.columns {
                                continue;
                            }
                            let child = &self.weights[child_row * self.columns + child_column];
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
        Self {
            half: 2.0 * self.half,
            rows,
            columns,
            weights: boxes.concat(),
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
