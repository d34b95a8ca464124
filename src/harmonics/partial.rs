//! Spectra from part of a sphere.
//!
//! The harmonics of a masked field w f are not those of f: the mask couples degrees. In the mean
//! over fields of one spectrum the coupling is linear: ⟨B̃_l⟩ = Σ_l′ M_ll′ B_l′, M_ll′ = (2l′+1)/4π
//! Σ_L (2L+1) W_L (l l′ L; 0 0 0)², where B is the average power and W that of the mask (Hivon et
//! al. 2002, *MASTER of the CMB anisotropy power spectrum*, doi:10.1086/338126). Inverting M over
//! bands of degrees gives the spectrum of the whole sphere without bias, which no continuation
//! behind the mask does. The mean of estimated over true power for 600 Gaussian fields of B_l =
//! (l+1)^−2.3 seen on a hemisphere (`cargo test --test library harmonics_partial -- --nocapture`):
//!
//! | degrees | 0 … 1 | 2 … 3 | 4 … 7 | 8 … 15 | 16 … 31 | 32 … 40 |
//! | --- | --- | --- | --- | --- | --- | --- |
//! | mirrored | 0.91 ± 0.03 | 0.94 ± 0.02 | 0.970 ± 0.011 | 0.981 ± 0.006 | 0.990 ± 0.003 | 0.943 ± 0.003 |
//! | half-turn | 0.57 ± 0.02 | 1.03 ± 0.03 | 1.043 ± 0.012 | 1.045 ± 0.006 | 1.043 ± 0.003 | 0.998 ± 0.003 |
//! | zero, doubled | 1.02 ± 0.05 | 1.14 ± 0.02 | 1.103 ± 0.012 | 1.081 ± 0.006 | 1.064 ± 0.003 | 1.012 ± 0.003 |
//! | decoupled | 0.95 ± 0.05 | 1.04 ± 0.04 | 0.982 ± 0.015 | 0.996 ± 0.007 | 1.002 ± 0.004 | 1.005 ± 0.004 |
//! | decoupled, soft edge | 0.95 ± 0.06 | 1.04 ± 0.04 | 0.989 ± 0.019 | 0.996 ± 0.008 | 0.996 ± 0.004 | 1.000 ± 0.004 |

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::legendre;
use crate::error::{check_finite, check_length};
use crate::sphere::{Grid, Rule};
use crate::{Error, Result};

/// The largest degree of a [`Coupling`].
pub const MAX_COUPLING_DEGREE: usize = 1024;

/// The largest [`Coupling::condition`] that [`Coupling::decouple`] answers: a relative error of 1 %
/// becomes one of up to 10 %.
pub const MAX_CONDITION: f64 = 10.0;

/// A mask that depends on the angle θ from the pole only.
///
/// ```
/// use lobes::{harmonics::Mask, sphere::Grid};
/// let grid = Grid::gauss_legendre(8, 16)?;
/// let mut map = vec![1.0; grid.len()];
/// Mask::Cap { radius: std::f64::consts::FRAC_PI_2 }.apply(&grid, &mut map)?;
/// assert_eq!((map[0], map[grid.len() - 1]), (1.0, 0.0));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Mask {
    /// 1 for θ < `radius`, 0 beyond; radius π/2 is the hemisphere. In radians.
    Cap {
        /// Where it ends.
        radius: f64,
    },
    /// 1 for θ < `inner`, falling as cos² to 0 at `outer`. In radians. The soft edge couples
    /// distant degrees far less.
    Apodised {
        /// Where it begins to fall.
        inner: f64,
        /// Where it ends.
        outer: f64,
    },
}

impl Mask {
    /// Its value at θ.
    pub fn value(self, theta: f64) -> f64 {
        match self {
            Self::Cap { radius } => f64::from(theta < radius),
            Self::Apodised { inner, outer } => {
                if theta <= inner {
                    1.0
                } else if theta >= outer {
                    0.0
                } else {
                    (PI / 2.0 * (theta - inner) / (outer - inner)).cos().powi(2)
                }
            }
        }
    }

    /// Multiplies a map on a grid by it.
    ///
    /// # Errors
    /// [`Error::Length`] where the map is not the grid's.
    pub fn apply(self, grid: &Grid, map: &mut [f64]) -> Result<()> {
        check_length("the map", grid.len(), map.len())?;
        for ring in 0..grid.rings() {
            let value = self.value(grid.colatitude(ring));
            let row = &mut map[grid.ring_points(ring)];
            row.iter_mut().for_each(|v| *v *= value);
        }
        Ok(())
    }

    /// Its zonal coefficients w_l0 = 2π ∫ w P̄_l0 sin θ dθ, l = 0 … degree, by quadrature on each
    /// piece: exact to rounding.
    fn zonal(self, degree: usize) -> Result<Vec<f64>> {
        let (inner, outer) = match self {
            Self::Cap { radius } => (radius, radius),
            Self::Apodised { inner, outer } => (inner, outer),
        };
        if !(0.0 < outer && 0.0 <= inner && inner <= outer && outer <= PI) {
            return Err(Error::Domain {
                what: "the edge of a mask",
                value: if (0.0..=PI).contains(&inner) {
                    outer
                } else {
                    inner
                },
                allowed: "between 0 and π, the inner edge within the outer",
            });
        }
        // The integrand oscillates as cos lθ: degree + 20 nodes a piece resolve it with digits to
        // spare.
        let rule = Rule::gauss_legendre(degree + 20)?;
        let mut zonal = vec![0.0; degree + 1];
        let mut p = vec![0.0; degree + 1];
        for (from, to) in [(0.0, inner), (inner, outer)] {
            for (x, weight) in rule.nodes.iter().zip(&rule.weights) {
                let theta = 0.5 * ((from + to) + (to - from) * x);
                let inside = if to == inner { 1.0 } else { self.value(theta) };
                legendre::polynomials(theta.cos(), &mut p);
                let factor = PI * (to - from) * weight * inside * theta.sin();
                for (l, (zonal, p)) in zonal.iter_mut().zip(&p).enumerate() {
                    *zonal += factor * p * ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
                }
            }
        }
        Ok(zonal)
    }
}

/// The coupling of degrees by a mask: one that depends on the angle from the pole only
/// ([`new`](Self::new)), or one of any shape ([`from_power`](Self::from_power)).
///
/// ```
/// use lobes::harmonics::{Coupling, Mask};
/// let whole = Coupling::new(Mask::Cap { radius: std::f64::consts::PI }, 8)?;
/// assert!((whole.matrix()[(3, 3)] - 1.0).abs() < 1e-13); // no mask, no coupling
/// assert!(whole.matrix()[(3, 4)].abs() < 1e-13);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Coupling {
    matrix: DMatrix<f64>,
}

impl Coupling {
    /// The matrix M_ll′ for l, l′ = 0 … degree.
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_COUPLING_DEGREE`]; [`Error::Domain`] for edges that are not
    /// in order or not in 0 … π.
    pub fn new(mask: Mask, degree: usize) -> Result<Self> {
        check_degree(degree)?;
        // (2L+1) W_L = w_L0²
        let power: Vec<f64> = mask.zonal(2 * degree)?.iter().map(|w| w * w).collect();
        Ok(Self::of_powers(&power, degree))
    }

    /// The matrix M_ll′ of a mask of any shape, from its own average power W_L, L = 0, 1 …: what is
    /// beyond L = 2 `degree` does not count, what is missing below it counts as 0.
    ///
    /// The cross power of two masks gives the coupling of the cross power of two masked fields.
    ///
    /// ```
    /// use lobes::harmonics::{Coupling, Mask, Transform, average_power};
    /// use lobes::sphere::Grid;
    /// let grid = Grid::gauss_legendre(256, 512)?;
    /// let mut mask = vec![1.0; grid.len()];
    /// let soft = Mask::Apodised { inner: 0.8, outer: 1.6 };
    /// soft.apply(&grid, &mut mask)?;
    /// let power = average_power(&Transform::new(&grid, 40)?.analyse(&mask)?);
    /// let (any, of_angle) = (Coupling::from_power(&power, 20)?, Coupling::new(soft, 20)?);
    /// assert!((any.matrix() - of_angle.matrix()).amax() < 1e-6);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Degree`] beyond [`MAX_COUPLING_DEGREE`]; [`Error::Empty`] for no power at all,
    /// [`Error::NotFinite`] where one is not finite.
    pub fn from_power(mask: &[f64], degree: usize) -> Result<Self> {
        check_degree(degree)?;
        check_finite("the power of the mask", mask)?;
        if mask.is_empty() {
            return Err(Error::Empty {
                what: "the coupling of a mask",
                needs: "the mask's power",
            });
        }
        let mut power = vec![0.0; 2 * degree + 1];
        for (l, (power, w)) in power.iter_mut().zip(mask).enumerate() {
            *power = (2 * l + 1) as f64 * w;
        }
        Ok(Self::of_powers(&power, degree))
    }

    /// From (2L+1) W_L, L = 0 … 2 degree.
    fn of_powers(power: &[f64], degree: usize) -> Self {
        let mut matrix = DMatrix::zeros(degree + 1, degree + 1);
        for l in 0..=degree {
            for other in 0..=l {
                let sum: f64 = squares_of_three_j(l, other)
                    .zip(power[l - other..].iter().step_by(2))
                    .map(|(square, power)| square * power)
                    .sum();
                matrix[(l, other)] = sum * (2 * other + 1) as f64 / (4.0 * PI);
                matrix[(other, l)] = sum * (2 * l + 1) as f64 / (4.0 * PI);
            }
        }
        Self { matrix }
    }

    /// M_ll′: row l of the masked field, column l′ of the whole.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// The largest degree.
    pub fn degree(&self) -> usize {
        self.matrix.nrows() - 1
    }

    /// The mean power of the masked field, of a field of this power over the whole sphere.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a value for each degree.
    pub fn couple(&self, power: &[f64]) -> Result<Vec<f64>> {
        check_length("the power", self.degree() + 1, power.len())?;
        let power = DVector::from_column_slice(power);
        Ok((&self.matrix * power).data.into())
    }

    /// The power of the whole sphere in bands of degrees, from the power of the masked field.
    ///
    /// Band b holds the degrees `edges[b] .. edges[b + 1]`; within it the power is taken as
    /// `shape(l)` times one unknown, which is what comes back. Power beyond the last edge is taken
    /// as none. The smaller the mask, the less it tells neighbouring degrees apart, and the wider
    /// the bands have to be: see [`narrowest_bands`](Self::narrowest_bands).
    ///
    /// ```
    /// use lobes::{Error, harmonics::{Coupling, Mask}};
    /// let cap = Coupling::new(Mask::Cap { radius: 30f64.to_radians() }, 11)?;
    /// let masked = cap.couple(&[1.0; 12])?;
    /// for power in cap.decouple(&masked, &[0, 4, 8, 12], |_| 1.0)? {
    ///     assert!((power - 1.0).abs() < 1e-13);
    /// }
    /// // Single degrees are beyond what a twelfth of the sphere tells apart.
    /// let edges: Vec<usize> = (0..=12).collect();
    /// assert!(matches!(cap.decouple(&masked, &edges, |_| 1.0), Err(Error::IllConditioned { .. })));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a value for each degree; [`Error::NotFinite`] where one is
    /// not finite; [`Error::Domain`] for edges that do not ascend or pass the degree, and for a
    /// shape that is negative, not finite or zero throughout a band; [`Error::IllConditioned`]
    /// where the [`condition`](Self::condition) is above [`MAX_CONDITION`].
    pub fn decouple(
        &self,
        masked: &[f64],
        edges: &[usize],
        shape: impl Fn(usize) -> f64,
    ) -> Result<Vec<f64>> {
        self.decouple_weighted(masked, edges, orders, shape)
    }

    /// As [`decouple`](Self::decouple), the masked power of a band being the mean under `weights(l)`
    /// of that of its degrees: NaMaster's bandpowers. Those of `decouple` are 2l + 1.
    ///
    /// ```
    /// use lobes::harmonics::{Coupling, Mask};
    /// let cap = Coupling::new(Mask::Cap { radius: 1.5 }, 11)?;
    /// let masked = cap.couple(&[2.0; 12])?;
    /// for power in cap.decouple_weighted(&masked, &[0, 4, 8, 12], |_| 1.0, |_| 1.0)? {
    ///     assert!((power - 2.0).abs() < 1e-13);
    /// }
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`decouple`](Self::decouple); [`Error::Domain`] for weights that are negative, not
    /// finite or zero throughout a band.
    pub fn decouple_weighted(
        &self,
        masked: &[f64],
        edges: &[usize],
        weights: impl Fn(usize) -> f64,
        shape: impl Fn(usize) -> f64,
    ) -> Result<Vec<f64>> {
        check_length("the power", self.degree() + 1, masked.len())?;
        check_finite("the power", masked)?;
        let matrix = self.of_bands(edges, &weights, &shape)?;
        let condition = condition(&matrix);
        let right = DVector::from_fn(matrix.nrows(), |row, _| {
            mean(edges, row, &weights, |l| masked[l])
        });
        let solution = (condition <= MAX_CONDITION).then(|| matrix.lu().solve(&right));
        match solution.flatten() {
            Some(power) => Ok(power.data.into()),
            None => Err(self.too_narrow(condition, shape)),
        }
    }

    /// By how much [`decouple`](Self::decouple) multiplies errors: where the power follows the
    /// shape, a relative error ε of each band of the masked power becomes one of up to this times
    /// ε. It is the condition number, in the maximum norm, of the matrix of the bands, its rows
    /// scaled to a sum of 1; infinite where they cannot be told apart at all. 1 without a mask.
    ///
    /// # Errors
    /// [`Error::Domain`], as for [`decouple`](Self::decouple).
    pub fn condition(&self, edges: &[usize], shape: impl Fn(usize) -> f64) -> Result<f64> {
        Ok(condition(&self.of_bands(edges, &orders, &shape)?))
    }

    /// What [`decouple_weighted`](Self::decouple_weighted) gives in the mean of a field whose power
    /// is 1 at one degree and 0 at the others: a row for each band, a column for each degree. With a
    /// power of any other form within bands, the product with it is what the bands are to be
    /// compared with.
    ///
    /// ```
    /// use lobes::harmonics::{Coupling, Mask};
    /// let cap = Coupling::new(Mask::Cap { radius: 1.5 }, 11)?;
    /// let windows = cap.windows(&[0, 4, 8, 12], |_| 1.0, |_| 1.0)?;
    /// assert!((windows.row(1).sum() - 1.0).abs() < 1e-13);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`decouple_weighted`](Self::decouple_weighted).
    pub fn windows(
        &self,
        edges: &[usize],
        weights: impl Fn(usize) -> f64,
        shape: impl Fn(usize) -> f64,
    ) -> Result<DMatrix<f64>> {
        let matrix = self.of_bands(edges, &weights, &shape)?;
        let condition = condition(&matrix);
        let right = DMatrix::from_fn(matrix.nrows(), self.degree() + 1, |row, column| {
            mean(edges, row, &weights, |l| self.matrix[(l, column)])
        });
        let solution = (condition <= MAX_CONDITION).then(|| matrix.lu().solve(&right));
        solution
            .flatten()
            .map_or_else(|| Err(self.too_narrow(condition, shape)), Ok)
    }

    /// The error that says which bands a mask bears.
    fn too_narrow(&self, condition: f64, shape: impl Fn(usize) -> f64) -> Error {
        let width = self.narrowest_bands(shape).unwrap_or(self.degree() + 1);
        Error::IllConditioned {
            what: "undoing the coupling of these bands of degrees by the mask",
            condition,
            limit: MAX_CONDITION,
            remedy: format!("take bands of {width} degrees, or wider, or a larger mask"),
        }
    }

    /// The width of the narrowest bands, equally wide and from degree 0 on, whose
    /// [`condition`](Self::condition) is at most [`MAX_CONDITION`]; the last one takes what is left
    /// over. About 180° over the radius of a cap.
    ///
    /// ```
    /// use lobes::harmonics::{Coupling, Mask};
    /// let cap = |degrees: f64| Coupling::new(Mask::Cap { radius: degrees.to_radians() }, 48);
    /// assert_eq!(cap(90.0)?.narrowest_bands(|_| 1.0)?, 2);
    /// assert_eq!(cap(20.0)?.narrowest_bands(|_| 1.0)?, 6);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Domain`] for a shape that is negative, not finite or zero throughout a band.
    pub fn narrowest_bands(&self, shape: impl Fn(usize) -> f64) -> Result<usize> {
        let count = self.degree() + 1;
        for width in 1..count {
            let mut edges: Vec<usize> = (0..count / width).map(|band| band * width).collect();
            edges.push(count);
            if self.condition(&edges, &shape)? <= MAX_CONDITION {
                return Ok(width);
            }
        }
        Ok(count)
    }

    /// The coupling of the bands' unknowns with the means over the bands of the masked power.
    fn of_bands(
        &self,
        edges: &[usize],
        weights: &dyn Fn(usize) -> f64,
        shape: &dyn Fn(usize) -> f64,
    ) -> Result<DMatrix<f64>> {
        let ascending = edges.windows(2).all(|pair| pair[0] < pair[1]);
        let last = edges.last().copied().unwrap_or(0);
        if !ascending || edges.len() < 2 || last > self.degree() + 1 {
            return Err(Error::Domain {
                what: "the last edge of the bands",
                value: last as f64,
                allowed: "at the end of two or more ascending edges, at most the degree + 1",
            });
        }
        for pair in edges.windows(2) {
            for (what, of) in [
                ("the shape of the power within a band", shape),
                ("the weight of a degree within a band", weights),
            ] {
                let values = || (pair[0]..pair[1]).map(of);
                let wrong = values().find(|value| !(*value >= 0.0 && value.is_finite()));
                if let Some(value) = wrong.or((values().sum::<f64>() == 0.0).then_some(0.0)) {
                    return Err(Error::Domain {
                        what,
                        value,
                        allowed: "finite, at least 0, and above 0 at some degree of each band",
                    });
                }
            }
        }
        let bands = edges.len() - 1;
        Ok(DMatrix::from_fn(bands, bands, |row, column| {
            mean(edges, row, weights, |l| {
                (edges[column]..edges[column + 1])
                    .map(|other| self.matrix[(l, other)] * shape(other))
                    .sum()
            })
        }))
    }
}

fn check_degree(degree: usize) -> Result<()> {
    if degree > MAX_COUPLING_DEGREE {
        return Err(Error::Degree {
            what: "the coupling of a mask",
            degree,
            limit: MAX_COUPLING_DEGREE,
        });
    }
    Ok(())
}

/// How many orders a degree has.
fn orders(l: usize) -> f64 {
    (2 * l + 1) as f64
}

/// The weighted mean over a band.
fn mean(
    edges: &[usize],
    band: usize,
    weights: impl Fn(usize) -> f64,
    of: impl Fn(usize) -> f64,
) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for l in edges[band]..edges[band + 1] {
        let weight = weights(l);
        sum += weight * of(l);
        total += weight;
    }
    sum / total
}

/// ‖R⁻¹‖ in the maximum norm, R the matrix with rows scaled to a sum of 1. Its elements are not
/// negative, so that ‖R‖ is 1.
fn condition(matrix: &DMatrix<f64>) -> f64 {
    let mut scaled = matrix.clone();
    for mut row in scaled.row_iter_mut() {
        let sum = row.sum();
        row /= sum;
    }
    let norm = scaled.try_inverse().map_or(f64::INFINITY, |inverse| {
        inverse
            .row_iter()
            .map(|row| row.iter().map(|value| value.abs()).sum())
            .fold(
                0.0,
                |most: f64, sum: f64| if sum <= most { most } else { sum },
            )
    });
    if norm.is_finite() {
        norm
    } else {
        f64::INFINITY
    }
}

/// (l l′ L; 0 0 0)² for L = |l − l′|, |l − l′| + 2, … l + l′; l ≥ l′.
///
/// With n = l + l′ + L = 2g the square is (2g−2l)!(2g−2l′)!(2g−2L)!/(2g+1)!
/// [g!/((g−l)!(g−l′)!(g−L)!)]²: from L to L + 2 the ratio is rational.
fn squares_of_three_j(l: usize, other: usize) -> impl Iterator<Item = f64> {
    // L = l − l′: (l l′ L)² = C(2l′, l′) [l!…]: by the ratio from l′ = 0, where it is 1/(2l+1).
    let mut first = 1.0 / (2 * l + 1) as f64;
    for k in 1..=other {
        // l fixed, l′ = k, L = l − k; g = l throughout
        let (k, big) = (k as f64, (l - k) as f64);
        first *= (2.0 * k - 1.0) * (big + 1.0) / (k * (2.0 * big + 1.0));
    }
    (0..=other).scan(first, move |square, i| {
        let value = *square;
        // from g to g + 1
        let (a, b, c) = (i as f64, (l - other + i) as f64, (other - i) as f64);
        let g = (l + i) as f64;
        // a = g − l, b = g − l′, c = g − L
        *square *= (2.0 * a + 1.0) / (a + 1.0)
            * ((2.0 * b + 1.0) / (b + 1.0))
            * (c / (2.0 * c - 1.0)).max(0.0)
            * ((g + 1.0) / (2.0 * g + 3.0));
        Some(value)
    })
}
