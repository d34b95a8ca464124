//! Grids on which light that was read off a ball is laid out.

use std::sync::Arc;

use nalgebra::DMatrix;
use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner};

use crate::harmonics::{Coefficients, legendre};
use crate::reflectance::lambert;
use crate::{Error, Result};

/// The plan of what is laid out of light, in the frame of a view, and on which directions.
///
/// Row i of n is the polar angle π (i + ½)/n from the line of sight and column j the azimuth 2π
/// j/2n, from the picture's right towards its top. What is laid out is Σ F_l L_lm Y_lm: radiance, F
/// = 1, or the irradiance at a normal, F the clamped cosine's.
///
/// ```
/// use lobes::inference::LightGrid;
/// let grid = LightGrid::radiance(64, 48)?;
/// assert_eq!((grid.rows(), grid.columns(), grid.degree()), (64, 128, 48));
/// assert!(LightGrid::radiance(32, 48).is_err(), "64 columns carry 31 orders");
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Clone)]
pub struct LightGrid {
    rows: usize,
    degree: usize,
    /// By order, a row a polar angle, a column a degree: F_l P̄_lm.
    fine: Vec<DMatrix<f64>>,
    /// The same at fewer polar angles, for what varies slowly with them.
    coarse: Vec<DMatrix<f64>>,
    fourier: Arc<dyn ComplexToReal<f64>>,
}

impl std::fmt::Debug for LightGrid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LightGrid")
            .field("rows", &self.rows)
            .field("degree", &self.degree)
            .finish_non_exhaustive()
    }
}

/// What a [`LightGrid`] laid out: mean and variance of each point, row by row.
///
/// ```
/// use lobes::inference::LightField;
/// /// The share of the points at which a light is within so many deviations of the mean.
/// fn within(field: &LightField, light: &[f64], deviations: f64) -> f64 {
///     let all = field.mean.iter().zip(&field.variance).zip(light);
///     let held = all.filter(|((mean, variance), l)| (*l - *mean).abs() <= deviations * variance.sqrt());
///     held.count() as f64 / light.len() as f64
/// }
/// let field = LightField { rows: 1, columns: 2, mean: vec![1.0, 2.0], variance: vec![0.04, 0.0] };
/// assert_eq!(within(&field, &[1.3, 2.0], 1.645), 1.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LightField {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// The mean.
    pub mean: Vec<f64>,
    /// The variance.
    pub variance: Vec<f64>,
}

/// Polar angles at which the variance of the field is taken.
const COARSE: usize = 64;

/// The most rows.
const MOST_ROWS: usize = 4096;

impl LightGrid {
    /// Of radiance, on `rows` × 2 `rows` directions, of light to `degree`.
    ///
    /// # Errors
    /// [`Error::Domain`] for no row or more than 4096; [`Error::Degree`] unless the degree is below
    /// the number of rows.
    pub fn radiance(rows: usize, degree: usize) -> Result<Self> {
        Self::new(
            rows,
            &vec![1.0; degree.saturating_add(1).min(MOST_ROWS + 1)],
        )
    }

    /// Of irradiance, at `rows` × 2 `rows` normals, of light to `degree`.
    ///
    /// # Errors
    /// As [`Self::radiance`].
    pub fn irradiance(rows: usize, degree: usize) -> Result<Self> {
        Self::new(rows, &lambert::transfers(degree.min(MOST_ROWS))?)
    }

    /// F = `factors`, from degree 0 on.
    fn new(rows: usize, factors: &[f64]) -> Result<Self> {
        if !(1..=MOST_ROWS).contains(&rows) {
            return Err(Error::Domain {
                what: "the rows of a grid of light",
                value: rows as f64,
                allowed: "from 1 to 4096",
            });
        }
        let degree = factors.len() - 1;
        if degree >= rows {
            return Err(Error::Degree {
                what: "the rows of a grid of light",
                degree,
                limit: rows - 1,
            });
        }
        Ok(Self {
            rows,
            degree,
            fine: harmonics(rows, factors)?,
            coarse: harmonics(COARSE.min(rows), factors)?,
            fourier: RealFftPlanner::new().plan_fft_inverse(2 * rows),
        })
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns: twice as many.
    pub fn columns(&self) -> usize {
        2 * self.rows
    }

    /// The largest degree of the light.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The polar angle and the azimuth of a point.
    pub fn direction(&self, row: usize, column: usize) -> (f64, f64) {
        let step = std::f64::consts::PI / self.rows as f64;
        (step * (row as f64 + 0.5), step * column as f64)
    }

    pub(super) fn coarse_rows(&self) -> usize {
        COARSE.min(self.rows)
    }

    /// F_l P̄_lm, a row a coarse polar angle, a column a degree.
    pub(super) fn coarse(&self, m: usize) -> &DMatrix<f64> {
        &self.coarse[m]
    }

    /// What values at the coarse polar angles are at a row.
    pub(super) fn between_coarse(&self, values: &[f64], row: usize) -> f64 {
        let last = values.len() - 1;
        let at = (row as f64 + 0.5) * values.len() as f64 / self.rows as f64 - 0.5;
        let below = at.max(0.0) as usize;
        let part = (at - below as f64).clamp(0.0, 1.0);
        let (low, high) = (values[below.min(last)], values[(below + 1).min(last)]);
        low + part * (high - low)
    }

    /// Σ F_l L_lm Y_lm of coefficients to the grid's degree.
    pub(super) fn synthesise(&self, light: &Coefficients) -> Vec<f64> {
        let waves: Vec<DMatrix<f64>> = (0..=self.degree)
            .map(|m| {
                let parts = if m == 0 { 1 } else { 2 };
                let both = light.cosine(m).iter().chain(light.sine(m)).copied();
                &self.fine[m] * DMatrix::from_iterator(self.degree + 1 - m, parts, both)
            })
            .collect();
        let mut map = vec![0.0; self.rows * self.columns()];
        for (row, values) in map.chunks_exact_mut(2 * self.rows).enumerate() {
            self.turn(values, |m| {
                let of_order = &waves[m];
                let sine = if m == 0 { 0.0 } else { of_order[(row, 1)] };
                Complex64::new(of_order[(row, 0)], -sine)
            });
        }
        map
    }

    /// Σ_k (Σ_j f_jk B_j)² at every point, B_j the field whose amplitudes at its own azimuth φ_j are
    /// the columns of `amplitudes`, by order.
    pub(super) fn sum_of_squares(
        &self,
        amplitudes: &[DMatrix<f64>],
        azimuths: &[f64],
        factor: &DMatrix<f64>,
    ) -> Vec<f64> {
        let count = azimuths.len();
        let mut sums = vec![0.0; self.rows * self.columns()];
        if count == 0 {
            return sums;
        }
        // By order and light: what it is at the rows, and f_jk turned by its azimuth.
        let waves: Vec<DMatrix<f64>> = amplitudes
            .iter()
            .zip(&self.fine)
            .map(|(of_order, harmonics)| harmonics * of_order)
            .collect();
        let turned: Vec<Vec<Complex64>> = (0..=self.degree)
            .map(|m| {
                let places = (0..count * count).map(|i| (i / count, i % count));
                places
                    .map(|(k, j)| {
                        let below = if j >= k { factor[(j, k)] } else { 0.0 };
                        below * Complex64::from_polar(1.0, -(m as f64) * azimuths[j])
                    })
                    .collect()
            })
            .collect();
        let mut values = vec![0.0; self.columns()];
        for (row, sums) in sums.chunks_exact_mut(2 * self.rows).enumerate() {
            for k in 0..count {
                self.turn(&mut values, |m| {
                    let of_order = &waves[m];
                    let weights = &turned[m][k * count..(k + 1) * count];
                    (k..count).map(|j| weights[j] * of_order[(row, j)]).sum()
                });
                for (sum, value) in sums.iter_mut().zip(&values) {
                    *sum += value * value;
                }
            }
        }
        sums
    }

    /// Σ_m Re(a_m e^(imφ)) along a row.
    fn turn(&self, values: &mut [f64], amplitude: impl Fn(usize) -> Complex64) {
        let mut spectrum = vec![Complex64::ZERO; self.rows + 1];
        spectrum[0].re = amplitude(0).re;
        for (m, value) in spectrum
            .iter_mut()
            .enumerate()
            .take(self.degree + 1)
            .skip(1)
        {
            *value = 0.5 * amplitude(m);
        }
        // The lengths are the plan's own and the first value is real, so it cannot refuse.
        if self.fourier.process(&mut spectrum, values).is_err() {
            values.fill(f64::NAN);
        }
    }
}

/// F_l P̄_lm at so many polar angles, by order.
fn harmonics(rows: usize, factors: &[f64]) -> Result<Vec<DMatrix<f64>>> {
    let degree = factors.len() - 1;
    let mut all: Vec<DMatrix<f64>> = (0..=degree)
        .map(|m| DMatrix::zeros(rows, degree + 1 - m))
        .collect();
    let mut column = vec![0.0; degree + 1];
    for row in 0..rows {
        let polar = std::f64::consts::PI * (row as f64 + 0.5) / rows as f64;
        let (sin, cos) = polar.sin_cos();
        for (m, of_order) in all.iter_mut().enumerate() {
            let column = &mut column[m..];
            legendre::column(m, degree, cos, sin, column)?;
            for (i, value) in column.iter().enumerate() {
                of_order[(row, i)] = value * factors[m + i];
            }
        }
    }
    Ok(all)
}
