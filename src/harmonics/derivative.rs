//! Gradients on grids and the Laplacian.

use super::coefficients::Coefficients;
use super::spectrum::multiply_degrees;
use super::transform::Transform;
use crate::error::{all_finite, allocate, check_finite};
use crate::{Error, Parallelism, Result};

/// The coefficients of the Laplacian on the unit sphere: each f_lm times −l(l + 1).
///
/// Its field on a grid is [`Transform::synthesise`] of them, at directions
/// [`Basis::sums`](super::Basis::sums). Infinite where a product passes the largest number.
///
/// ```
/// use lobes::harmonics::{Coefficients, laplacian};
/// let mut f = Coefficients::zeros(2);
/// f.set(2, -1, 0.5)?;
/// assert_eq!(laplacian(&f).get(2, -1), -3.0);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn laplacian(coefficients: &Coefficients) -> Coefficients {
    let mut out = coefficients.clone();
    multiply_degrees(&mut out, |l| -(l as f64 * (l as f64 + 1.0)));
    out
}

impl Transform {
    /// The gradient of Σ f_lm Y_l^m at every point of the grid, as two maps: ∂f/∂θ, towards the
    /// south, and (1/sin θ) ∂f/∂φ, towards the east.
    ///
    /// From the field r × ∇f, whose three Cartesian parts have the degree of f: their coefficients
    /// come from f's by the ladder of orders (Varshalovich, Moskalev and Khersonskii 1988,
    /// doi:10.1142/0270, section 5.8), so that nothing is divided by sin θ. Its error is that of
    /// [`synthesise`](Self::synthesise), as a part of the gradient's rms. On a ring at a pole each
    /// column has the south and the east of its own azimuth, and the limits along its meridian.
    ///
    /// The gradient at any direction is [`Basis::gradients`](super::Basis::gradients).
    ///
    /// ```
    /// use lobes::{Parallelism, harmonics::{Coefficients, Transform}, sphere::Grid};
    /// let grid = Grid::clenshaw_curtis(5, 8)?;
    /// let transform = Transform::new(&grid, 1)?;
    /// let mut f = Coefficients::zeros(1);
    /// f.set(1, 0, (4.0 * std::f64::consts::PI / 3.0).sqrt())?; // cos θ
    /// let [south, east] = transform.gradient(&f, Parallelism::Sequential)?;
    /// assert!((south[2 * 8] + 1.0).abs() < 1e-15 && south[0].abs() < 1e-15);
    /// assert!(east.iter().all(|value| value.abs() < 1e-15));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`synthesise`](Self::synthesise); [`Error::Degree`] of a plan whose orders end
    /// before its degree.
    pub fn gradient(
        &self,
        coefficients: &Coefficients,
        parallelism: Parallelism,
    ) -> Result<[Vec<f64>; 2]> {
        if self.orders() < self.degree() {
            return Err(Error::Degree {
                what: "the plan's orders",
                degree: self.degree(),
                limit: self.orders(),
            });
        }
        self.check_shape(coefficients)?;
        check_finite("the coefficients", coefficients.as_slice())?;
        let overflow = Error::Overflow {
            what: "the gradient",
        };
        let grid = self.grid();
        let size = grid.len();
        let sets = turned(coefficients)?;
        let mut maps = allocate("the parts of the gradient", size.saturating_mul(3))?;
        let mut scratch = allocate("the scratch", self.scratch_len(3))?;
        self.synthesise_into(3, &sets, &mut maps, &mut scratch, parallelism)
            .map_err(|error| match error {
                Error::NotFinite { .. } => overflow.clone(),
                error => error,
            })?;
        let mut east = maps.split_off(2 * size);
        let mut south = maps;
        let y = south.split_off(size);
        let mut azimuths: Vec<[f64; 2]> = Vec::new();
        for ring in 0..grid.rings() {
            let (cos_theta, sin_theta) = (grid.cosines()[ring], grid.sines()[ring]);
            if ring == 0 || !grid.has_rings_alike() {
                let columns = 0..grid.ring_columns(ring);
                azimuths.clear();
                azimuths.extend(columns.map(|column| grid.cos_sin_azimuth(ring, column)));
            }
            for (point, [c, s]) in grid.ring_points(ring).zip(&azimuths) {
                // r × ∇f = (∂f/∂θ) e_φ − (1/sin θ)(∂f/∂φ) e_θ
                let (x, y, z) = (south[point], y[point], east[point]);
                south[point] = c * y - s * x;
                east[point] = sin_theta * z - cos_theta * (c * x + s * y);
            }
        }
        if all_finite(&south) && all_finite(&east) {
            Ok([south, east])
        } else {
            Err(overflow)
        }
    }
}

/// The coefficients of the x, y and z part of r × ∇f, one set after the other.
///
/// The z part is ∂f/∂φ. (r × ∇)_y ∓ i (r × ∇)_x = e^(±iφ) (∂_θ ± i cot θ ∂_φ) takes P_lm e^(imφ) to
/// ∓√((l ∓ m)(l ± m + 1)) P_l,m±1 e^(i(m±1)φ), for P without the √2 that real harmonics have from m =
/// 1 on.
fn turned(f: &Coefficients) -> Result<Vec<f64>> {
    let degree = f.degree();
    let count = f.as_slice().len();
    let zeros = || Coefficients::try_zeros(degree, degree);
    let [mut x, mut y, mut z] = [zeros()?, zeros()?, zeros()?];
    for m in 0..=degree {
        let (cosines, sines) = (f.cosine(m), f.sine(m));
        for (i, c) in cosines.iter().copied().enumerate() {
            let s = sines.get(i).copied().unwrap_or(0.0);
            let (l, order) = ((m + i) as f64, m as f64);
            if i > 0 {
                let half = if m == 0 { 0.5f64.sqrt() } else { 0.5 };
                let up = half * ((l - order) * (l + order + 1.0)).sqrt();
                let (to_cosine, to_sine) = x.pair_mut(m + 1);
                to_cosine[i - 1] -= up * s;
                to_sine[i - 1] += up * c;
                let (to_cosine, to_sine) = y.pair_mut(m + 1);
                to_cosine[i - 1] -= up * c;
                to_sine[i - 1] -= up * s;
            }
            if m > 0 {
                let half = if m == 1 { 0.5f64.sqrt() } else { 0.5 };
                let down = half * ((l + order) * (l - order + 1.0)).sqrt();
                x.cosine_mut(m - 1)[i + 1] -= down * s;
                y.cosine_mut(m - 1)[i + 1] += down * c;
                if m > 1 {
                    x.sine_mut(m - 1)[i + 1] += down * c;
                    y.sine_mut(m - 1)[i + 1] += down * s;
                }
                z.cosine_mut(m)[i] = order * s;
                z.sine_mut(m)[i] = -order * c;
            }
        }
    }
    let mut sets = allocate("the coefficients of the gradient", 3 * count)?;
    for (set, values) in sets.chunks_exact_mut(count).zip([x, y, z]) {
        set.copy_from_slice(values.as_slice());
    }
    Ok(sets)
}
