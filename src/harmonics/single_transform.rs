//! The transform in single precision.

use std::sync::Arc;

use super::coefficients::coefficient_count;
use super::kernel::Quad;
use super::lane::Lane;
use super::legendre_table::LegendreTable;
use super::recurrence::Recurrence;
use super::simd::wide;
use super::stages::{PARTS, Stages, Weighing};
use super::transform::check_degree;
use super::work::{Bundles, Chunks, Orders, divided, inside_pool};
use crate::error::{allocate, check_length};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result, vectors};

/// A plan for analysis and synthesis of f32 maps with f32 coefficients: [`Transform`](super::Transform)
/// with half the memory a value and sixteen rings in a vector instead of eight.
///
/// Coefficients are in the order of [`Coefficients::as_slice`](super::Coefficients::as_slice), maps
/// row by row. Grids whose rings have lengths of their own, as HEALPix has, and analysis beyond
/// [`Grid::max_degree_of_weights`] are for [`Transform`](super::Transform).
///
/// **Accuracy.** The root mean square of the error is below 1.3·10⁻⁶ of that of the result to degree
/// 511, 3.5·10⁻⁶ to 2047 and 6·10⁻⁶ to 4095, for coefficients and maps of one size throughout; single
/// values of a result may be wrong by twelve times that. What is worked out beforehand is in f64, and
/// every 128 steps the recurrence of the Legendre functions takes its state from there.
///
/// ```
/// use lobes::Parallelism;
/// use lobes::harmonics::{Coefficients, SingleTransform};
/// use lobes::sphere::Grid;
/// let transform = SingleTransform::new(&Grid::gauss_legendre(8, 16)?, 7)?;
/// let mut f = Coefficients::zeros(7);
/// f.set(3, -2, 1.0)?;
/// let f: Vec<f32> = f.as_slice().iter().map(|&value| value as f32).collect();
/// let map = transform.synthesise(&f)?;
/// let again = transform.analyse(&map)?;
/// assert!(f.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-6));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Clone)]
pub struct SingleTransform(Arc<Stages<f32>>);

impl SingleTransform {
    /// A plan for all orders up to `degree`.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`Grid::max_degree_of_rings`], [`Grid::max_order`] or
    /// [`MAX_DEGREE`](super::MAX_DEGREE); [`Error::Undefined`] for a grid whose rings are not alike.
    pub fn new(grid: &Grid, degree: usize) -> Result<Self> {
        Self::with_orders(grid, degree, degree)
    }

    /// A plan for the orders |m| ≤ `orders` only.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_orders(grid: &Grid, degree: usize, orders: usize) -> Result<Self> {
        let orders = orders.min(degree);
        check_degree(grid, degree, orders)?;
        if !grid.has_rings_alike() {
            return Err(Error::Undefined {
                of: "a grid whose rings have lengths of their own",
                what: "transform in single precision",
                reason: "take `Transform`",
            });
        }
        let level = vectors::level();
        let exact = Recurrence::new(grid, degree, orders, level);
        let recurrence = Recurrence::rounded(&exact, grid, degree, level);
        let table = LegendreTable::new(&recurrence, &exact, orders, level);
        let weight = |ring| grid.ring_weight(ring);
        let size = (degree, orders);
        let stages = Stages::new(grid, size, level, (recurrence, table), weight);
        Ok(Self(Arc::new(stages)))
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.0.grid
    }

    /// The largest degree l.
    pub fn degree(&self) -> usize {
        self.0.degree
    }

    /// The largest order |m|.
    pub fn orders(&self) -> usize {
        self.0.orders
    }

    /// How many coefficients a map has.
    pub fn coefficient_count(&self) -> usize {
        coefficient_count(self.0.degree, self.0.orders)
    }

    /// How many values of scratch the `_into` functions need.
    pub fn scratch_len(&self) -> usize {
        f32::LANES * self.0.scratch_lines() + f32::LANES - 1
    }

    /// How much memory the plan's tables take, in bytes.
    pub fn table_bytes(&self) -> usize {
        self.0.table_bytes()
    }

    /// The map of some coefficients.
    ///
    /// # Errors
    /// [`Error::Length`] where there are not [`coefficient_count`](Self::coefficient_count) of them;
    /// [`Error::NotFinite`] where one is not finite, [`Error::Overflow`] where all are and the map
    /// is not; [`Error::Memory`] where there is none.
    pub fn synthesise(&self, coefficients: &[f32]) -> Result<Vec<f32>> {
        let mut map = allocate("the map", self.0.grid.len())?;
        let mut scratch = allocate("the scratch", self.scratch_len())?;
        let one = Parallelism::Sequential;
        self.synthesise_into(coefficients, &mut map, &mut scratch, one)?;
        Ok(map)
    }

    /// The coefficients of a map, by the grid's quadrature.
    ///
    /// # Errors
    /// [`Error::Length`] where the map has not as many values as the grid; [`Error::NotFinite`]
    /// where one is not finite, [`Error::Overflow`] where all are and a coefficient is not;
    /// [`Error::Degree`] beyond [`Grid::max_degree_of_weights`]; [`Error::Memory`] where there is
    /// none.
    pub fn analyse(&self, map: &[f32]) -> Result<Vec<f32>> {
        let mut coefficients = allocate("the coefficients", self.coefficient_count())?;
        let mut scratch = allocate("the scratch", self.scratch_len())?;
        let one = Parallelism::Sequential;
        self.analyse_into(map, &mut coefficients, &mut scratch, one)?;
        Ok(coefficients)
    }

    /// [`synthesise`](Self::synthesise) into a map of the caller's. Allocates nothing; `scratch` has
    /// at least [`scratch_len`](Self::scratch_len) values.
    ///
    /// # Errors
    /// Those of [`synthesise`](Self::synthesise), for `scratch` too.
    pub fn synthesise_into(
        &self,
        coefficients: &[f32],
        map: &mut [f32],
        scratch: &mut [f32],
        parallelism: Parallelism,
    ) -> Result<()> {
        let weighing = Weighing::None;
        self.to_map(coefficients, map, scratch, weighing, parallelism)
    }

    /// [`analyse`](Self::analyse) into coefficients of the caller's. Allocates nothing; `scratch`
    /// has at least [`scratch_len`](Self::scratch_len) values.
    ///
    /// # Errors
    /// Those of [`analyse`](Self::analyse), for `scratch` too.
    pub fn analyse_into(
        &self,
        map: &[f32],
        coefficients: &mut [f32],
        scratch: &mut [f32],
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_weights()?;
        let weighing = Weighing::Quadrature;
        self.to_coefficients(map, coefficients, scratch, weighing, parallelism)
    }

    /// The adjoint of [`synthesise_into`](Self::synthesise_into), the sums Σ y Y_l^m over the grid's
    /// points: see [`Transform::synthesise_adjoint`](super::Transform::synthesise_adjoint).
    ///
    /// # Errors
    /// Those of [`analyse_into`](Self::analyse_into), but for the degree.
    pub fn synthesise_adjoint_into(
        &self,
        map: &[f32],
        coefficients: &mut [f32],
        scratch: &mut [f32],
        parallelism: Parallelism,
    ) -> Result<()> {
        let weighing = Weighing::None;
        self.to_coefficients(map, coefficients, scratch, weighing, parallelism)
    }

    /// The adjoint of [`analyse_into`](Self::analyse_into): see
    /// [`Transform::analyse_adjoint`](super::Transform::analyse_adjoint).
    ///
    /// # Errors
    /// Those of [`synthesise_into`](Self::synthesise_into), and [`Error::Degree`] beyond
    /// [`Grid::max_degree_of_weights`].
    pub fn analyse_adjoint_into(
        &self,
        coefficients: &[f32],
        map: &mut [f32],
        scratch: &mut [f32],
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_weights()?;
        let weighing = Weighing::Quadrature;
        self.to_map(coefficients, map, scratch, weighing, parallelism)
    }

    fn to_map(
        &self,
        coefficients: &[f32],
        map: &mut [f32],
        scratch: &mut [f32],
        weighing: Weighing,
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_lengths(coefficients, map, scratch)?;
        let parallelism = self.0.worthwhile(1, parallelism);
        inside_pool(parallelism, || {
            let scratch = f32::aligned(scratch);
            self.0
                .to_map(coefficients, map, scratch, weighing, parallelism);
        });
        let moderate = coefficients
            .iter()
            .fold(true, |all, c| all & (c.abs() < f32::MODERATE));
        if moderate || all_finite(map) {
            Ok(())
        } else {
            Err(not_finite(
                "the values of the map",
                "the coefficients",
                coefficients,
            ))
        }
    }

    fn to_coefficients(
        &self,
        map: &[f32],
        coefficients: &mut [f32],
        scratch: &mut [f32],
        weighing: Weighing,
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_lengths(coefficients, map, scratch)?;
        let parallelism = self.0.worthwhile(1, parallelism);
        inside_pool(parallelism, || {
            let scratch = f32::aligned(scratch);
            self.0
                .to_coefficients(map, coefficients, scratch, weighing, parallelism);
        });
        // A sample that is not finite reaches the mean of the map.
        if all_finite(coefficients) {
            Ok(())
        } else {
            Err(not_finite("the coefficients", "the map", map))
        }
    }

    fn check_weights(&self) -> Result<()> {
        let limit = self.0.grid.max_degree_of_weights();
        if self.0.degree > limit {
            return Err(Error::Degree {
                what: "the quadrature of the grid in single precision",
                degree: self.0.degree,
                limit,
            });
        }
        Ok(())
    }

    fn check_lengths(&self, coefficients: &[f32], map: &[f32], scratch: &[f32]) -> Result<()> {
        check_length(
            "the coefficients",
            self.coefficient_count(),
            coefficients.len(),
        )?;
        check_length("the map", self.0.grid.len(), map.len())?;
        if scratch.len() < self.scratch_len() {
            return Err(Error::Length {
                what: "the scratch",
                expected: self.scratch_len(),
                got: scratch.len(),
            });
        }
        Ok(())
    }
}

impl Stages<f32> {
    /// Lines of scratch: the sums of all orders and rings, and what each part of the work needs.
    fn scratch_lines(&self) -> usize {
        self.spectrum_len() + PARTS * self.workers * self.order_len(1).max(self.rows_len())
    }

    /// Coefficients to the sums of every ring, `[m][bundle]`, and those to samples.
    fn to_map(
        &self,
        coefficients: &[f32],
        map: &mut [f32],
        scratch: &mut [[f32; f32::LANES]],
        weighing: Weighing,
        parallelism: Parallelism,
    ) {
        let bundles = self.recurrence.bundles.len();
        let (sums, scratch) = scratch.split_at_mut(self.spectrum_len());
        let sums: &mut [Quad<f32>] = sums.as_chunks_mut().0;
        let orders = Chunks {
            values: &mut *sums,
            length: bundles,
        };
        divided(
            parallelism,
            0..self.orders + 1,
            orders,
            scratch,
            self.order_len(1),
            &|range, sums, scratch| {
                wide!(self.level, simd => {
                    for (m, out) in range.zip(sums.values.chunks_exact_mut(bundles)) {
                        self.synthesise_order::<_, 1>(simd, m, coefficients, out, scratch);
                        if weighing == Weighing::Quadrature {
                            for (quad, weights) in out.iter_mut().zip(&self.weights) {
                                for (value, weight) in
                                    quad.iter_mut().flat_map(|part| part.iter_mut().zip(weights))
                                {
                                    *value *= weight;
                                }
                            }
                        }
                    }
                });
            },
        );
        let sums = &*sums;
        divided(
            parallelism,
            0..bundles,
            Bundles::new(map, &self.starts),
            scratch,
            self.rows_len(),
            &|range, rows, scratch| {
                wide!(self.level, simd => {
                    for (bundle, rows) in range.zip(rows) {
                        self.synthesise_rows(simd, &sums[bundle..], bundles, rows, scratch);
                    }
                });
            },
        );
    }

    /// Samples to the sums of every ring, `[bundle][m]`, and those to coefficients.
    fn to_coefficients(
        &self,
        map: &[f32],
        coefficients: &mut [f32],
        scratch: &mut [[f32; f32::LANES]],
        weighing: Weighing,
        parallelism: Parallelism,
    ) {
        let (bundles, orders) = (self.recurrence.bundles.len(), self.orders + 1);
        let (sums, scratch) = scratch.split_at_mut(self.spectrum_len());
        let sums: &mut [Quad<f32>] = sums.as_chunks_mut().0;
        let rows = Chunks {
            values: &mut *sums,
            length: orders,
        };
        divided(
            parallelism,
            0..bundles,
            rows,
            scratch,
            self.rows_len(),
            &|range, sums, scratch| {
                wide!(self.level, simd => {
                    for (bundle, out) in range.zip(sums.values.chunks_exact_mut(orders)) {
                        self.analyse_rows(simd, self.rows_of(bundle, map), out, scratch);
                    }
                });
            },
        );
        let sums = &*sums;
        let columns = Orders {
            sets: [coefficients],
            first: 0,
            degree: self.degree,
        };
        divided(
            parallelism,
            0..orders,
            columns,
            scratch,
            self.order_len(1),
            &|range, columns, scratch| {
                wide!(self.level, simd => {
                    for (m, columns) in range.zip(columns) {
                        let sums = (&sums[m..], orders);
                        self.analyse_order::<_, 1>(simd, m, sums, columns, scratch, weighing);
                    }
                });
            },
        );
    }
}

/// Whether all values are finite.
fn all_finite(values: &[f32]) -> bool {
    values
        .iter()
        .fold(true, |all, value| all & value.is_finite())
}

/// What is wrong with an output that is not finite: its input, or that finite input overflows.
fn not_finite(output: &'static str, what: &'static str, input: &[f32]) -> Error {
    match input.iter().position(|value| !value.is_finite()) {
        Some(index) => Error::NotFinite {
            what,
            index,
            value: f64::from(input[index]),
        },
        None => Error::Overflow { what: output },
    }
}

impl std::fmt::Debug for SingleTransform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SingleTransform")
            .field("latitudes", &self.0.grid.latitudes())
            .field("rings", &self.0.grid.rings())
            .field("columns", &self.0.grid.columns())
            .field("degree", &self.0.degree)
            .field("orders", &self.0.orders)
            .finish()
    }
}
