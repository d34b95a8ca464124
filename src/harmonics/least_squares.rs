//! Coefficients by least squares, on any grid and at any directions.

use glam::DVec3;
use nalgebra::DMatrix;

use super::coefficients::{Coefficients, coefficient_count};
use super::point::{Basis, DOUBLE_DEGREE};
use super::scattered::ScatteredTransform;
use super::transform::Transform;
use crate::error::{allocate, check_finite, check_length};
use crate::{Error, Parallelism, Result};

/// After so many steps a fit is given up.
const MAX_STEPS: usize = 2000;

/// What [`Transform::analyse_least_squares`] and [`Basis::analyse_least_squares`] found.
///
/// ```
/// use lobes::harmonics::{Transform, random_field};
/// use lobes::{Parallelism, sphere::Grid};
/// let transform = Transform::new(&Grid::healpix(4)?, 8)?;
/// let f = random_field(&[1.0; 9], 1)?;
/// let map = transform.synthesise(&f)?;
/// let fit = transform.analyse_least_squares(&map, 1e-13, Parallelism::Sequential)?;
/// assert!(fit.residual < 1e-13 && fit.steps < 20 && fit.condition < 1.2);
/// for (a, b) in fit.coefficients.as_slice().iter().zip(f.as_slice()) {
///     assert!((a - b).abs() < 1e-12);
/// }
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LeastSquares {
    /// The coefficients.
    pub coefficients: Coefficients,
    /// The rms of what they leave of the data: each value counts as its weight.
    pub residual: f64,
    /// How many steps it took.
    pub steps: usize,
    /// The condition number of the synthesis (not of the normal equations, whose is its square), as
    /// the steps show it: from below, and 1 where there were none. Relative errors of the data come
    /// out as at most so many times as large.
    pub condition: f64,
}

impl Transform {
    /// The coefficients whose map is nearest to `map`: they make Σ w (f − map)² least, w being the
    /// [weights](crate::sphere::Grid::ring_weight) of the grid.
    ///
    /// Exact for fields of the plan's degree on every grid that tells them apart, HEALPix among them,
    /// where [`analyse`](Self::analyse) is not. By conjugate gradients on the normal equations
    /// (Hestenes and Stiefel 1952, doi:10.6028/jres.049.044, in the form that keeps the residual of
    /// the map itself), until the gradient is `tolerance` of what it was; each step is a synthesis
    /// and its adjoint. On HEALPix the condition is 1.15 at degree 2 nside, which takes 12 steps to
    /// 10⁻¹³, and 2.5 at 3 nside − 1 for nside = 8.
    ///
    /// # Errors
    /// Those of [`analyse`](Self::analyse); [`Error::Domain`] for a tolerance that is not in 10⁻¹⁵ …
    /// 1, [`Error::Tolerance`] where 2000 steps do not come to it.
    pub fn analyse_least_squares(
        &self,
        map: &[f64],
        tolerance: f64,
        parallelism: Parallelism,
    ) -> Result<LeastSquares> {
        let grid = self.grid();
        check_length("the map", grid.len(), map.len())?;
        let mut weights = Vec::with_capacity(grid.len());
        for ring in 0..grid.rings() {
            weights.resize(grid.ring_points(ring).end, grid.ring_weight(ring));
        }
        let mut scratch = allocate("the scratch", self.scratch_len(1))?;
        let other = &mut allocate("the scratch", self.scratch_len(1))?;
        let values = solve(
            self.coefficient_count(),
            map,
            &weights,
            tolerance,
            |set, map| self.synthesise_into(1, set, map, &mut scratch, parallelism),
            |map, set| self.synthesise_adjoint_into(1, map, set, other, parallelism),
        )?;
        values.with_orders(self.degree(), self.orders())
    }

    /// The coefficients of a map by the grid's weights, corrected `iterations` times by those of what
    /// they leave of the map: healpy's `map2alm` with `iter`, whose 3 leave some 10⁻³ … 10⁻⁸ of the
    /// coefficients on HEALPix to degree 2 nside.
    ///
    /// ```
    /// use lobes::harmonics::{Transform, random_field};
    /// use lobes::{Parallelism, sphere::Grid};
    /// let transform = Transform::new(&Grid::healpix(8)?, 16)?;
    /// let f = random_field(&[1.0; 17], 1)?;
    /// let map = transform.synthesise(&f)?;
    /// let error = |iterations| -> lobes::Result<f64> {
    ///     let found = transform.analyse_iterated(&map, iterations, Parallelism::Sequential)?;
    ///     Ok((found.get(9, 4) - f.get(9, 4)).abs())
    /// };
    /// assert!(error(3)? < 0.01 * error(0)?);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`analyse`](Self::analyse).
    pub fn analyse_iterated(
        &self,
        map: &[f64],
        iterations: usize,
        parallelism: Parallelism,
    ) -> Result<Coefficients> {
        let mut set = allocate("the coefficients", self.coefficient_count())?;
        let mut scratch = allocate("the scratch", self.scratch_len(1))?;
        self.analyse_into(1, map, &mut set, &mut scratch, parallelism)?;
        let mut left = allocate("what is left of the map", map.len())?;
        let mut correction = set.clone();
        for _ in 0..iterations {
            self.synthesise_into(1, &set, &mut left, &mut scratch, parallelism)?;
            for (left, value) in left.iter_mut().zip(map) {
                *left = value - *left;
            }
            self.analyse_into(1, &left, &mut correction, &mut scratch, parallelism)?;
            for (value, correction) in set.iter_mut().zip(&correction) {
                *value += correction;
            }
        }
        Coefficients::from_vec(self.degree(), self.orders(), set)
    }
}

impl Basis {
    /// The coefficients whose sums at the directions are nearest to `values`, each of the same
    /// weight: for samples anywhere, and for any pixelisation.
    ///
    /// As [`Transform::analyse_least_squares`]. Where directions are few or leave a part of the
    /// sphere empty the condition is large, and the fit worth as little. Many directions go through a
    /// [`ScatteredTransform`] of the tolerance 10⁻¹³.
    ///
    /// ```
    /// use lobes::{Parallelism, glam::DVec3, harmonics::Basis};
    /// // x + 2y at five directions, of which a field of degree 1 has four unknowns.
    /// let directions = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::new(0.6, 0.0, -0.8)];
    /// let values = [1.0, 2.0, 0.0, -1.0, 0.6];
    /// let one = Parallelism::Sequential;
    /// let fit = Basis::new(1)?.analyse_least_squares(&values, &directions, 1e-12, one)?;
    /// let unit = (0.75 / std::f64::consts::PI).sqrt();
    /// assert!((fit.coefficients.get(1, -1) * unit - 2.0).abs() < 1e-12);
    /// assert!(fit.residual < 1e-12);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one value a direction; [`Error::Domain`] for a direction of
    /// no or of infinite length, and for a tolerance that is not in 10⁻¹⁵ … 1; [`Error::NotFinite`]
    /// where a value is not finite, [`Error::Overflow`] where all are and a sum is not;
    /// [`Error::Tolerance`] where 2000 steps do not come to the tolerance.
    pub fn analyse_least_squares(
        &self,
        values: &[f64],
        directions: &[DVec3],
        tolerance: f64,
        parallelism: Parallelism,
    ) -> Result<LeastSquares> {
        check_length("the values at directions", directions.len(), values.len())?;
        let degree = self.degree();
        if self.count().saturating_mul(directions.len()) > quick_from(degree) {
            return ScatteredTransform::new(degree, directions, 1e-13, parallelism)?
                .analyse_least_squares(values, tolerance, parallelism);
        }
        let mut set = Coefficients::try_zeros(degree, degree)?;
        let values = solve(
            self.count(),
            values,
            &vec![1.0; directions.len()],
            tolerance,
            |given, out| {
                set.as_mut_slice().copy_from_slice(given);
                self.sums(&set, directions, out, parallelism)
            },
            |given, out| {
                let sums = self.sums_adjoint(given, directions, parallelism)?;
                out.copy_from_slice(sums.as_slice());
                Ok(())
            },
        )?;
        values.with_orders(degree, degree)
    }
}

/// From how many harmonics at directions on a fit goes by a [`ScatteredTransform`]: its plan takes some
/// 10 ms, as long as a few steps one by one.
fn quick_from(degree: usize) -> usize {
    if degree <= DOUBLE_DEGREE {
        10_000_000
    } else {
        1_000_000
    }
}

impl ScatteredTransform {
    /// The coefficients whose values at the directions are nearest to `values`, each of the same
    /// weight, as [`Basis::analyse_least_squares`] finds them: each step of it takes two sums of this
    /// plan, whose tolerance is also the fit's.
    ///
    /// ```
    /// use lobes::{Parallelism, glam::DVec3};
    /// use lobes::harmonics::{ScatteredTransform, random_field};
    /// let directions: Vec<_> = (0..2000)
    ///     .map(f64::from)
    ///     .map(|i| DVec3::new(i.sin(), (1.3 * i).cos(), (0.7 * i).sin()))
    ///     .collect();
    /// let (f, one) = (random_field(&[1.0; 9], 1)?, Parallelism::Sequential);
    /// let plan = ScatteredTransform::new(8, &directions, 1e-12, one)?;
    /// let fit = plan.analyse_least_squares(&plan.synthesise(&f, one)?, 1e-12, one)?;
    /// assert!(fit.residual < 1e-10);
    /// assert!((fit.coefficients.get(5, -3) - f.get(5, -3)).abs() < 1e-9);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Basis::analyse_least_squares`]; [`Error::Memory`] where there is none.
    pub fn analyse_least_squares(
        &self,
        values: &[f64],
        tolerance: f64,
        parallelism: Parallelism,
    ) -> Result<LeastSquares> {
        check_length("the values at directions", self.directions(), values.len())?;
        let degree = self.degree();
        let mut scratch = allocate("the scratch", self.scratch_len())?;
        let other = &mut allocate("the scratch", self.scratch_len())?;
        let values = solve(
            coefficient_count(degree, degree),
            values,
            &vec![1.0; values.len()],
            tolerance,
            |set, out| self.synthesise_into(set, out, &mut scratch, parallelism),
            |given, out| self.synthesise_adjoint_into(given, out, other, parallelism),
        )?;
        values.with_orders(degree, degree)
    }
}

/// What [`solve`] found, its coefficients without a degree.
struct Solution {
    values: Vec<f64>,
    residual: f64,
    steps: usize,
    condition: f64,
}

impl Solution {
    fn with_orders(self, degree: usize, orders: usize) -> Result<LeastSquares> {
        Ok(LeastSquares {
            coefficients: Coefficients::from_vec(degree, orders, self.values)?,
            residual: self.residual,
            steps: self.steps,
            condition: self.condition,
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Least squares of A x = data under weights, A given by what it and its transpose do.
fn solve(
    unknowns: usize,
    data: &[f64],
    weights: &[f64],
    tolerance: f64,
    mut forward: impl FnMut(&[f64], &mut [f64]) -> Result<()>,
    mut adjoint: impl FnMut(&[f64], &mut [f64]) -> Result<()>,
) -> Result<Solution> {
    if !(1e-15..=1.0).contains(&tolerance) {
        return Err(Error::Domain {
            what: "the tolerance of a fit",
            value: tolerance,
            allowed: "in 10⁻¹⁵ … 1",
        });
    }
    check_finite("the data", data)?;
    let mut x = allocate("the coefficients", unknowns)?;
    let mut gradient = x.clone();
    let mut left = data.to_vec();
    let mut weighted = left.clone();
    let mut forth = left.clone();
    let mut descend = |left: &[f64], gradient: &mut [f64]| {
        for ((weighted, left), weight) in weighted.iter_mut().zip(left).zip(weights) {
            *weighted = weight * left;
        }
        adjoint(&weighted, gradient)
    };
    descend(&left, &mut gradient)?;
    let mut direction = gradient.clone();
    let first = dot(&gradient, &gradient);
    let mut square = first;
    // Lanczos' tridiagonal matrix, from the lengths of the steps.
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let mut carried = 0.0;
    while square > tolerance * tolerance * first {
        if diagonal.len() == MAX_STEPS {
            return Err(Error::Tolerance {
                what: "the least squares of harmonics",
                asked: tolerance,
                reached: (square / first).sqrt(),
            });
        }
        forward(&direction, &mut forth)?;
        let curvature: f64 = forth.iter().zip(weights).map(|(f, w)| w * f * f).sum();
        let length = square / curvature;
        if !(length.is_finite() && length > 0.0) {
            // What is left does not reach the data at all.
            break;
        }
        for (x, direction) in x.iter_mut().zip(&direction) {
            *x += length * direction;
        }
        for (left, forth) in left.iter_mut().zip(&forth) {
            *left -= length * forth;
        }
        descend(&left, &mut gradient)?;
        let next = dot(&gradient, &gradient);
        let ratio = next / square;
        diagonal.push(1.0 / length + carried);
        beside.push(ratio.sqrt() / length);
        carried = ratio / length;
        square = next;
        for (direction, gradient) in direction.iter_mut().zip(&gradient) {
            *direction = gradient + ratio * *direction;
        }
    }
    let total: f64 = weights.iter().sum();
    let squares: f64 = left.iter().zip(weights).map(|(l, w)| w * l * l).sum();
    Ok(Solution {
        residual: if total > 0.0 {
            (squares / total).sqrt()
        } else {
            0.0
        },
        steps: diagonal.len(),
        condition: condition(&diagonal, &beside),
        values: x,
    })
}

/// The root of the ratio of the largest to the smallest eigenvalue of a tridiagonal matrix.
fn condition(diagonal: &[f64], beside: &[f64]) -> f64 {
    let n = diagonal.len();
    if n == 0 {
        return 1.0;
    }
    let matrix = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => beside[i.min(j)],
        _ => 0.0,
    });
    let eigenvalues = matrix.symmetric_eigenvalues();
    (eigenvalues.max() / eigenvalues.min().max(f64::MIN_POSITIVE)).sqrt()
}
