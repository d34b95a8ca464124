//! Fields of complex values and their coefficients.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use glam::DQuat;
use num_complex::Complex64;

use super::coefficients::{Coefficients, coefficient_count};
use super::rotation::Rotation;
use super::transform::Transform;
use crate::error::{allocate, check_length};
use crate::{Error, Parallelism, Result};

/// The coefficients of a complex field f = Σ a_lm Y_lm, l ≤ degree, m from −l to l.
///
/// Y_lm = (−1)^m P̄_lm e^(imφ)/√2 for m > 0, P̄_l0 for m = 0, and Y_l,−m = (−1)^m Ȳ_lm: orthonormal, with
/// the Condon–Shortley phase, as SciPy's `sph_harm_y`. Stored at l² + l + m. A real field has a_l,−m =
/// (−1)^m ā_lm, and is better kept as [`Coefficients`].
///
/// ```
/// use lobes::harmonics::{ComplexCoefficients, Transform};
/// use lobes::{Parallelism, num_complex::Complex64, sphere::Grid};
/// let mut a = ComplexCoefficients::zeros(3);
/// a.set(2, -1, Complex64::new(0.5, 1.0))?;
/// let transform = Transform::new(&Grid::gauss_legendre(4, 8)?, 3)?;
/// let map = transform.synthesise_complex(&a, Parallelism::Sequential)?;
/// let again = transform.analyse_complex(&map, Parallelism::Sequential)?;
/// assert!((again.get(2, -1) - Complex64::new(0.5, 1.0)).norm() < 1e-14);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ComplexCoefficients {
    degree: usize,
    values: Vec<Complex64>,
}

impl ComplexCoefficients {
    /// All zero.
    pub fn zeros(degree: usize) -> Self {
        Self {
            degree,
            values: vec![Complex64::ZERO; coefficient_count(degree, degree)],
        }
    }

    /// From the (degree + 1)² values at l² + l + m.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of them.
    pub fn from_vec(degree: usize, values: Vec<Complex64>) -> Result<Self> {
        check_length(
            "the complex coefficients",
            coefficient_count(degree, degree),
            values.len(),
        )?;
        Ok(Self { degree, values })
    }

    /// Of the field whose real part has the first coefficients and whose imaginary part the second.
    ///
    /// # Errors
    /// [`Error::Length`] where the two are of different degrees.
    pub fn from_parts(real: &Coefficients, imaginary: &Coefficients) -> Result<Self> {
        let degree = real.degree();
        if imaginary.degree() != degree {
            return Err(Error::Length {
                what: "the coefficients of the imaginary part",
                expected: coefficient_count(degree, degree),
                got: coefficient_count(imaginary.degree(), imaginary.degree()),
            });
        }
        let mut sum = Self::zeros(degree);
        for l in 0..=degree {
            for m in 0..=l as isize {
                let [(a, a_minus), (b, b_minus)] = [real, imaginary].map(|f| of_real(f, l, m));
                sum.values[index(l, m)] = a + Complex64::I * b;
                sum.values[index(l, -m)] = a_minus + Complex64::I * b_minus;
            }
        }
        Ok(sum)
    }

    /// The real coefficients of the field's real and of its imaginary part.
    pub fn parts(&self) -> [Coefficients; 2] {
        let mut parts = [0, 1].map(|_| Coefficients::zeros(self.degree));
        for l in 0..=self.degree {
            for m in 0..=l {
                let signed = m as isize;
                let (a, b) = (
                    self.values[index(l, signed)],
                    self.values[index(l, -signed)].conj() * sign(m),
                );
                // What is Hermitian is the real part's; the rest, over i, the imaginary part's.
                let difference = a - b;
                let halves = [a + b, Complex64::new(difference.im, -difference.re)];
                for (part, half) in parts.iter_mut().zip(halves) {
                    if m == 0 {
                        part.cosine_mut(0)[l] = 0.5 * half.re;
                    } else {
                        let half = half * (FRAC_1_SQRT_2 * sign(m));
                        part.cosine_mut(m)[l - m] = half.re;
                        part.sine_mut(m)[l - m] = -half.im;
                    }
                }
            }
        }
        parts
    }

    /// The largest degree.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// a_lm; 0 for a degree beyond the largest or an order beyond ±l.
    pub fn get(&self, l: usize, m: isize) -> Complex64 {
        if l > self.degree || m.unsigned_abs() > l {
            return Complex64::ZERO;
        }
        self.values[index(l, m)]
    }

    /// Sets a_lm.
    ///
    /// # Errors
    /// [`Error::Degree`] for a degree beyond the largest or an order beyond ±l.
    pub fn set(&mut self, l: usize, m: isize, value: Complex64) -> Result<()> {
        for (what, degree, limit) in [
            ("the set of complex coefficients", l, self.degree),
            ("the degree's orders", m.unsigned_abs(), l),
        ] {
            if degree > limit {
                return Err(Error::Degree {
                    what,
                    degree,
                    limit,
                });
            }
        }
        self.values[index(l, m)] = value;
        Ok(())
    }

    /// All of them, at l² + l + m.
    pub fn as_slice(&self) -> &[Complex64] {
        &self.values
    }

    /// The same, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [Complex64] {
        &mut self.values
    }

    /// The same, taken out.
    pub fn into_vec(self) -> Vec<Complex64> {
        self.values
    }

    /// Σ_m |a_lm|²/(2l + 1) by degree: of a real field what [`average_power`](super::average_power)
    /// gives.
    pub fn average_power(&self) -> Vec<f64> {
        let of = |l: usize| {
            let sum: f64 = self.values[l * l..(l + 1) * (l + 1)]
                .iter()
                .map(Complex64::norm_sqr)
                .sum();
            sum / (2 * l + 1) as f64
        };
        (0..=self.degree).map(of).collect()
    }
}

fn index(l: usize, m: isize) -> usize {
    (l * l + l).wrapping_add_signed(m)
}

fn sign(m: usize) -> f64 {
    if m.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// a_lm and a_l,−m of a real field, m ≥ 0.
fn of_real(f: &Coefficients, l: usize, m: isize) -> (Complex64, Complex64) {
    if m == 0 {
        let value = Complex64::from(f.get(l, 0));
        return (value, value);
    }
    let value = Complex64::new(f.get(l, m), f.get(l, -m)) / SQRT_2;
    (value.conj() * sign(m.unsigned_abs()), value)
}

impl Transform {
    /// The complex map of complex coefficients, `rings × columns`: synthesis of both parts in one
    /// call.
    ///
    /// # Errors
    /// [`Error::Length`] where the set has another degree than the plan, [`Error::Degree`] where the
    /// plan has not all orders; those of [`synthesise`](Self::synthesise).
    pub fn synthesise_complex(
        &self,
        coefficients: &ComplexCoefficients,
        parallelism: Parallelism,
    ) -> Result<Vec<Complex64>> {
        self.check_complex()?;
        let (count, size) = (self.coefficient_count(), self.grid().len());
        check_length("the coefficient set", count, coefficients.as_slice().len())?;
        let parts = coefficients.parts();
        let sets = parts.map(Coefficients::into_vec).concat();
        let mut maps = allocate("the maps", 2 * size)?;
        let mut scratch = allocate("the scratch", self.scratch_len(2))?;
        self.synthesise_into(2, &sets, &mut maps, &mut scratch, parallelism)?;
        let (real, imaginary) = maps.split_at(size);
        let both = real.iter().zip(imaginary);
        Ok(both.map(|(re, im)| Complex64::new(*re, *im)).collect())
    }

    /// The complex coefficients of a complex map, `rings × columns`: analysis of both parts in one
    /// call.
    ///
    /// # Errors
    /// [`Error::Degree`] where the plan has not all orders; those of [`analyse`](Self::analyse).
    pub fn analyse_complex(
        &self,
        map: &[Complex64],
        parallelism: Parallelism,
    ) -> Result<ComplexCoefficients> {
        self.check_complex()?;
        let (count, degree) = (self.coefficient_count(), self.degree());
        check_length("the map", self.grid().len(), map.len())?;
        let parts = map.iter().map(|value| value.re);
        let maps: Vec<f64> = parts.chain(map.iter().map(|value| value.im)).collect();
        let mut sets = allocate("the coefficients", 2 * count)?;
        let mut scratch = allocate("the scratch", self.scratch_len(2))?;
        self.analyse_into(2, &maps, &mut sets, &mut scratch, parallelism)?;
        let imaginary = Coefficients::from_vec(degree, degree, sets.split_off(count))?;
        let real = Coefficients::from_vec(degree, degree, sets)?;
        ComplexCoefficients::from_parts(&real, &imaginary)
    }

    fn check_complex(&self) -> Result<()> {
        if self.orders() < self.degree() {
            return Err(Error::Degree {
                what: "the plan's orders",
                degree: self.degree(),
                limit: self.orders(),
            });
        }
        Ok(())
    }
}

impl Rotation {
    /// The complex coefficients of f(R⁻¹ ω): what [`wigner::rotation_matrix`] of each degree makes of
    /// them, in one call and without a matrix.
    ///
    /// [`wigner::rotation_matrix`]: super::wigner::rotation_matrix
    ///
    /// # Errors
    /// Those of [`rotate`](Self::rotate).
    pub fn rotate_complex(
        &self,
        coefficients: &ComplexCoefficients,
        rotation: DQuat,
        parallelism: Parallelism,
    ) -> Result<ComplexCoefficients> {
        let [real, imaginary] = coefficients.parts();
        ComplexCoefficients::from_parts(
            &self.rotate(&real, rotation, parallelism)?,
            &self.rotate(&imaginary, rotation, parallelism)?,
        )
    }
}
