//! Analysis and synthesis on iso-latitude grids.

use std::sync::Arc;

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::coefficients::{Coefficients, coefficient_count, column_start};
use super::legendre;
use crate::error::{check_finite, check_length};
use crate::sphere::Grid;
use crate::{Error, Parallelism, Result};

/// The largest degree of a [`Transform`].
pub const MAX_DEGREE: usize = 4096;

/// A plan for analysis and synthesis on one grid, to one degree. Immutable, shared by cloning, used by any number of threads.
///
/// Synthesis is f(θ, φ) = Σ f_lm Y_l^m at every point; analysis is f_lm = ∫ f Y_l^m dω by the grid's quadrature, exact
/// for fields of at most this degree.
///
/// ```
/// use lobes::harmonics::{Coefficients, Transform};
/// use lobes::sphere::Grid;
/// let transform = Transform::new(&Grid::gauss_legendre(8, 16)?, 7)?;
/// let mut f = Coefficients::zeros(7);
/// f.set(3, -2, 1.0);
/// let map = transform.synthesise(&f)?;
/// assert!((transform.analyse(&map)?.get(3, -2) - 1.0).abs() < 1e-14);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Clone)]
pub struct Transform(Arc<Plan>);

struct Plan {
    grid: Grid,
    degree: usize,
    orders: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    /// e^(i m φ₀) for each order.
    phases: Vec<Complex64>,
}

impl Transform {
    /// A plan for all orders up to `degree`.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`Grid::max_degree`] or [`MAX_DEGREE`].
    pub fn new(grid: &Grid, degree: usize) -> Result<Self> {
        Self::with_orders(grid, degree, degree)
    }

    /// A plan for the orders |m| ≤ `orders` only.
    ///
    /// # Errors
    /// [`Error::Degree`] for a degree beyond [`Grid::max_degree_of_rings`] or [`MAX_DEGREE`], or orders beyond
    /// [`Grid::max_order`].
    pub fn with_orders(grid: &Grid, degree: usize, orders: usize) -> Result<Self> {
        let orders = orders.min(degree);
        for (what, value, limit) in [
            ("the transform", degree, MAX_DEGREE),
            ("the grid's rings", degree, grid.max_degree_of_rings()),
            ("the grid's columns", orders, grid.max_order()),
        ] {
            if value > limit {
                return Err(Error::Degree {
                    what,
                    degree: value,
                    limit,
                });
            }
        }
        let mut planner = RealFftPlanner::<f64>::new();
        Ok(Self(Arc::new(Plan {
            degree,
            orders,
            forward: planner.plan_fft_forward(grid.columns()),
            inverse: planner.plan_fft_inverse(grid.columns()),
            phases: (0..=orders)
                .map(|m| Complex64::cis(m as f64 * grid.first_azimuth()))
                .collect(),
            grid: grid.clone(),
        })))
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

    /// How many coefficients one map has.
    pub fn coefficient_count(&self) -> usize {
        coefficient_count(self.0.degree, self.0.orders)
    }

    /// How many values of scratch the `_into` functions need for a batch of so many maps.
    pub fn scratch_len(&self, batch: usize) -> usize {
        let plan = &*self.0;
        batch * plan.grid.rings() * 2 * (plan.grid.columns() / 2 + 1)
    }

    /// The map of a coefficient set, `rings × columns`.
    ///
    /// # Errors
    /// [`Error::Length`] where the set has another degree or other orders than the plan.
    pub fn synthesise(&self, coefficients: &Coefficients) -> Result<Vec<f64>> {
        self.check_shape(coefficients)?;
        let mut map = vec![0.0; self.0.grid.len()];
        let mut scratch = vec![0.0; self.scratch_len(1)];
        self.synthesise_into(
            1,
            coefficients.as_slice(),
            &mut map,
            &mut scratch,
            Parallelism::Sequential,
        )?;
        Ok(map)
    }

    /// The coefficients of a map, `rings × columns`.
    ///
    /// # Errors
    /// [`Error::Length`] where the map has not as many values as the grid, [`Error::NotFinite`] where one is not finite.
    pub fn analyse(&self, map: &[f64]) -> Result<Coefficients> {
        let mut values = vec![0.0; self.coefficient_count()];
        let mut scratch = vec![0.0; self.scratch_len(1)];
        self.analyse_into(1, map, &mut values, &mut scratch, Parallelism::Sequential)?;
        Coefficients::from_vec(self.0.degree, self.0.orders, values)
    }

    fn check_shape(&self, coefficients: &Coefficients) -> Result<()> {
        if coefficients.degree() != self.0.degree || coefficients.orders() != self.0.orders {
            return Err(Error::Length {
                what: "the coefficient set",
                expected: self.coefficient_count(),
                got: coefficients.as_slice().len(),
            });
        }
        Ok(())
    }

    /// Synthesis of `batch` coefficient sets, one after the other in `coefficients`, into as many maps, one after the other
    /// in `maps`. Allocates nothing that grows with the data; `scratch` has at least [`scratch_len`](Self::scratch_len) values.
    ///
    /// # Errors
    /// [`Error::Length`] for any slice of the wrong length.
    pub fn synthesise_into(
        &self,
        batch: usize,
        coefficients: &[f64],
        maps: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_lengths(batch, coefficients.len(), maps.len(), scratch.len())?;
        let _ = parallelism;
        let plan = &*self.0;
        let (rings, columns) = (plan.grid.rings(), plan.grid.columns());
        let mut column = vec![0.0; plan.degree + 1];
        let mut row = vec![Complex64::ZERO; columns / 2 + 1];
        let mut work = plan.inverse.make_scratch_vec();
        for (set, map) in coefficients
            .chunks_exact(self.coefficient_count())
            .zip(maps.chunks_exact_mut(plan.grid.len()))
        {
            for ring in 0..rings {
                row.fill(Complex64::ZERO);
                for (m, row) in row[..=plan.orders].iter_mut().enumerate() {
                    let count = plan.degree + 1 - m;
                    let p = &mut column[..count];
                    let (cos, sin) = (plan.grid.cosines()[ring], plan.grid.sines()[ring]);
                    legendre::column(m, plan.degree, cos, sin, p)?;
                    let start = column_start(plan.degree, m);
                    let dot = |a: &[f64]| -> f64 { a.iter().zip(&*p).map(|(a, p)| a * p).sum() };
                    let value = if m == 0 {
                        Complex64::from(dot(&set[..count]))
                    } else {
                        0.5 * Complex64::new(
                            dot(&set[start..start + count]),
                            -dot(&set[start + count..start + 2 * count]),
                        )
                    };
                    let value = value * plan.phases[m];
                    *row = if plan.grid.is_descending() {
                        value.conj()
                    } else {
                        value
                    };
                }
                row[0].im = 0.0;
                let out = &mut map[ring * columns..(ring + 1) * columns];
                plan.inverse
                    .process_with_scratch(&mut row, out, &mut work)
                    .map_err(|e| Error::Unanswerable(e.to_string()))?;
            }
        }
        Ok(())
    }

    /// Analysis of `batch` maps, one after the other in `maps`, into as many coefficient sets, one after the other in
    /// `coefficients`. Allocates nothing that grows with the data; `scratch` has at least [`scratch_len`](Self::scratch_len) values.
    ///
    /// # Errors
    /// [`Error::Length`] for any slice of the wrong length, [`Error::NotFinite`] where a value of a map is not finite.
    pub fn analyse_into(
        &self,
        batch: usize,
        maps: &[f64],
        coefficients: &mut [f64],
        scratch: &mut [f64],
        parallelism: Parallelism,
    ) -> Result<()> {
        self.check_lengths(batch, coefficients.len(), maps.len(), scratch.len())?;
        check_finite("the map", maps)?;
        let _ = parallelism;
        let plan = &*self.0;
        let (rings, columns) = (plan.grid.rings(), plan.grid.columns());
        let mut column = vec![0.0; plan.degree + 1];
        let mut row = vec![Complex64::ZERO; columns / 2 + 1];
        let mut samples = vec![0.0; columns];
        let mut work = plan.forward.make_scratch_vec();
        coefficients.fill(0.0);
        for (set, map) in coefficients
            .chunks_exact_mut(self.coefficient_count())
            .zip(maps.chunks_exact(plan.grid.len()))
        {
            for ring in 0..rings {
                samples.copy_from_slice(&map[ring * columns..(ring + 1) * columns]);
                plan.forward
                    .process_with_scratch(&mut samples, &mut row, &mut work)
                    .map_err(|e| Error::Unanswerable(e.to_string()))?;
                let weight = plan.grid.ring_weight(ring);
                for (m, row) in row[..=plan.orders].iter().enumerate() {
                    let count = plan.degree + 1 - m;
                    let p = &mut column[..count];
                    let (cos, sin) = (plan.grid.cosines()[ring], plan.grid.sines()[ring]);
                    legendre::column(m, plan.degree, cos, sin, p)?;
                    let value = if plan.grid.is_descending() {
                        row.conj()
                    } else {
                        *row
                    };
                    let value = value * plan.phases[m].conj() * weight;
                    let start = column_start(plan.degree, m);
                    for (out, p) in set[start..start + count].iter_mut().zip(&*p) {
                        *out += value.re * p;
                    }
                    if m > 0 {
                        for (out, p) in set[start + count..start + 2 * count].iter_mut().zip(&*p) {
                            *out -= value.im * p;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn check_lengths(
        &self,
        batch: usize,
        coefficients: usize,
        maps: usize,
        scratch: usize,
    ) -> Result<()> {
        check_length(
            "the coefficients of the batch",
            batch * self.coefficient_count(),
            coefficients,
        )?;
        check_length("the maps of the batch", batch * self.0.grid.len(), maps)?;
        let needed = self.scratch_len(batch);
        if scratch < needed {
            return Err(Error::Length {
                what: "the scratch",
                expected: needed,
                got: scratch,
            });
        }
        Ok(())
    }
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Transform")
            .field("latitudes", &self.0.grid.latitudes())
            .field("rings", &self.0.grid.rings())
            .field("columns", &self.0.grid.columns())
            .field("degree", &self.0.degree)
            .field("orders", &self.0.orders)
            .finish()
    }
}
