//! Power, zonal convolution, other conventions, and spectra of part of a sphere.

use lobes::harmonics::{
    self, Apodisation, Convention, Coupling as Couplings, Normalisation, Order, Phase,
};
use lobes::sphere::Grid;
use numpy::{Complex64, PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{
    check_finite, check_result, complexes, doubles, leading, shape_name, shaped, zeros,
};
use crate::coefficients::{Sets, wrap_all};
use crate::error;
use crate::harmonics::Transform;

/// What an operation makes of each set: rows of one length.
fn each<'py>(
    py: Python<'py>,
    sets: &Sets<'py>,
    length: usize,
    what: &str,
    of: impl Fn(harmonics::Coefficients) -> PyResult<Vec<f64>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let out = sets.rows(py, length)?;
    let mut guard = out.readwrite();
    for (set, row) in sets.each()?.zip(guard.as_slice_mut()?.chunks_mut(length)) {
        let values = of(set?)?;
        check_result(&values, what)?;
        row.copy_from_slice(&values);
    }
    drop(guard);
    Ok(out)
}

/// The average power of each degree, Σ_m f_lm² / (2l + 1).
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
///
/// Returns
/// -------
/// ndarray, (…, degree + 1)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> lobes.average_power([2.0, 3.0, 0.0, 0.0])
/// array([4., 3.])
#[pyfunction]
pub(crate) fn average_power<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let sets = Sets::of(coefficients, "the array of coefficients")?;
    each(py, &sets, sets.degree + 1, "the power of a degree", |set| {
        Ok(harmonics::average_power(&set))
    })
}

/// The average cross power of each degree, Σ_m a_lm b_lm / (2l + 1).
///
/// Parameters
/// ----------
/// a, b : Coefficients or array_like, (…, count)
///     Of one degree, number of orders and shape.
///
/// Returns
/// -------
/// ndarray, (…, degree + 1)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.cross_power([2.0, 3.0, 0.0, 0.0], [1.0, -1.0, 5.0, 0.0])
/// array([ 2., -1.])
#[pyfunction]
pub(crate) fn cross_power<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let (a, b) = (Sets::of(a, "a")?, Sets::of(b, "b")?);
    if (a.degree, a.orders, &a.shape) != (b.degree, b.orders, &b.shape) {
        return Err(PyValueError::new_err(format!(
            "a, of degree {} and orders {}, and b, of degree {} and orders {}, in batches of {} and {}, are not alike",
            a.degree,
            a.orders,
            b.degree,
            b.orders,
            shape_name(&a.shape),
            shape_name(&b.shape)
        )));
    }
    let others = b.each()?.collect::<PyResult<Vec<_>>>()?;
    let out = a.rows(py, a.degree + 1)?;
    let mut guard = out.readwrite();
    let rows = guard.as_slice_mut()?.chunks_mut(a.degree + 1);
    for ((one, other), row) in a.each()?.zip(&others).zip(rows) {
        let power = harmonics::cross_power(&one?, other).map_err(error)?;
        check_result(&power, "the cross power of a degree")?;
        row.copy_from_slice(&power);
    }
    drop(guard);
    Ok(out)
}

/// One number for each degree.
fn by_degree(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<f64>> {
    let array = doubles(object, what)?;
    if array.ndim() != 1 {
        return Err(PyValueError::new_err(format!(
            "{what} has the shape {}, and one number a degree is needed",
            shape_name(array.shape())
        )));
    }
    let values = array.as_slice()?.to_vec();
    check_finite(&values, what)?;
    Ok(values)
}

fn filtered<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    filter: impl Fn(&mut harmonics::Coefficients) -> lobes::Result<()>,
) -> PyResult<Bound<'py, PyAny>> {
    let sets = Sets::of(coefficients, "the array of coefficients")?;
    let mut out = Vec::with_capacity(sets.len());
    for set in sets.each()? {
        let mut set = set?;
        filter(&mut set).map_err(error)?;
        check_result(set.as_slice(), "a coefficient")?;
        out.push(set);
    }
    wrap_all(py, &sets.shape, out, (sets.degree, sets.orders))
}

/// Each degree times its factor: what a surface whose lobe has these transfers makes of light.
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
/// factors : array_like, (degree + 1,)
///     One or more for each degree.
///
/// Returns
/// -------
/// Coefficients, (…, count)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.convolve_zonal([2.0, 3.0, 4.0, 5.0], [1.0, 0.5]).array
/// array([2. , 1.5, 2. , 2.5])
#[pyfunction]
pub(crate) fn convolve_zonal<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    factors: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let factors = by_degree(factors, "the array of factors")?;
    filtered(py, coefficients, |set| {
        harmonics::convolve_zonal(set, &factors)
    })
}

/// The inverse of `convolve_zonal`: each degree times factor / (factor² + floor²).
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
/// factors : array_like, (degree + 1,)
/// floor : float
///     The ratio of noise to signal; 0 divides by the factor.
///
/// Returns
/// -------
/// Coefficients, (…, count)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.deconvolve_zonal([2.0, 1.5, 2.0, 2.5], [1.0, 0.5]).array
/// array([2., 3., 4., 5.])
#[pyfunction]
#[pyo3(signature = (coefficients, factors, floor=0.0))]
pub(crate) fn deconvolve_zonal<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    factors: &Bound<'py, PyAny>,
    floor: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let factors = by_degree(factors, "the array of factors")?;
    filtered(py, coefficients, |set| {
        harmonics::deconvolve_zonal(set, &factors, floor)
    })
}

/// The factors exp(−l(l + 1) σ²/2) of smoothing by a Gaussian, for `convolve_zonal`: healpy's
/// `gauss_beam`.
///
/// Parameters
/// ----------
/// degree : int
///     The last degree.
/// fwhm : float
///     The full width at half maximum in radians, σ √(8 ln 2).
///
/// Returns
/// -------
/// ndarray, (degree + 1,)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> beam = lobes.gaussian_beam(100, np.radians(1))
/// >>> smooth = lobes.convolve_zonal(np.ones(101**2), beam)
/// >>> bool(smooth.get(100, 3) == beam[100])
/// True
#[pyfunction]
pub(crate) fn gaussian_beam<'py>(
    py: Python<'py>,
    degree: usize,
    fwhm: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let beam = py
        .detach(|| harmonics::gaussian_beam(degree, fwhm))
        .map_err(error)?;
    Ok(PyArray1::from_vec(py, beam))
}

/// The coefficients of the Laplacian on the unit sphere: each times −l(l + 1).
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
///
/// Returns
/// -------
/// Coefficients, (…, count)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> float(lobes.laplacian([0, 0, 0, 0, 0, 0, 0, 0, 0.5]).get(2, -2))
/// -3.0
#[pyfunction]
pub(crate) fn laplacian<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    filtered(py, coefficients, |set| {
        *set = harmonics::laplacian(set);
        Ok(())
    })
}

/// The coefficients of an isotropic Gaussian field of a given power spectrum: the mean of
/// `average_power` over fields is `power`.
///
/// Parameters
/// ----------
/// power : array_like, (degree + 1,)
///     C_l, none of them negative: the mean square of each real orthonormal coefficient, and of the
///     complex a_lm of healpy's `synalm`.
/// seed : int
///     Of a PCG64, from 0 to 2⁶⁴ − 1. One seed is one field on every machine, and a field of a
///     higher degree begins with that of a lower one.
///
/// Returns
/// -------
/// Coefficients, ((degree + 1)²,)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> power = 1 / np.arange(1, 65.0)
/// >>> f = lobes.random_field(power, 1)
/// >>> bool(abs((lobes.average_power(f) / power).mean() - 1) < 0.2)
/// True
#[pyfunction]
pub(crate) fn random_field<'py>(
    py: Python<'py>,
    power: &Bound<'py, PyAny>,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let power = by_degree(power, "the array of powers")?;
    let field = py
        .detach(|| harmonics::random_field(&power, seed))
        .map_err(error)?;
    let shape = (field.degree(), field.orders());
    wrap_all(py, &[], vec![field], shape)
}

/// One of some names, or a `ValueError` that lists them.
fn one_of<T: Copy>(name: &str, what: &str, all: &[(&str, T)]) -> PyResult<T> {
    all.iter()
        .find(|(one, _)| *one == name)
        .map(|(_, value)| *value)
        .ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|(name, _)| *name).collect();
            PyValueError::new_err(format!(
                "there is no {what} {name:?}; the names are {}",
                names.join(", ")
            ))
        })
}

fn convention(normalisation: &str, phase: &str) -> PyResult<Convention> {
    Ok(Convention {
        normalisation: one_of(
            normalisation,
            "normalisation",
            &[
                ("orthonormal", Normalisation::Orthonormal),
                ("four-pi", Normalisation::FourPi),
                ("schmidt", Normalisation::Schmidt),
            ],
        )?,
        phase: one_of(
            phase,
            "phase",
            &[
                ("plain", Phase::Plain),
                ("condon-shortley", Phase::CondonShortley),
            ],
        )?,
    })
}

fn storage(order: &str) -> PyResult<Order> {
    one_of(
        order,
        "order of storage",
        &[("by-order", Order::ByOrder), ("by-degree", Order::ByDegree)],
    )
}

/// The complex coefficients a_lm, m ≥ 0: those of healpy and ducc0 unless another convention is
/// named.
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
/// normalisation : str
///     "orthonormal", "four-pi" or "schmidt".
/// phase : str
///     "plain" or "condon-shortley".
///
/// Returns
/// -------
/// ndarray of complex, (…, (degree + 1)(degree + 2)/2)
///     By order m; for each m the degrees l from m on.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> np.allclose(lobes.to_complex([1, 2, -1, 1]), [1, 2, (1 + 1j) / np.sqrt(2)])
/// True
#[pyfunction]
#[pyo3(signature = (coefficients, normalisation="orthonormal", phase="condon-shortley"))]
pub(crate) fn to_complex<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    normalisation: &str,
    phase: &str,
) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
    let convention = convention(normalisation, phase)?;
    let sets = Sets::of(coefficients, "the array of coefficients")?;
    let mut shape = sets.shape.clone();
    shape.push((sets.degree + 1) * (sets.degree + 2) / 2);
    let mut values = Vec::new();
    for set in sets.each()? {
        values.extend(set?.to_complex(convention));
    }
    shaped(py, &shape, values)
}

/// From complex coefficients as `to_complex` gives them.
///
/// Parameters
/// ----------
/// coefficients : array_like of complex, (…, (degree + 1)(degree + 2)/2)
///     a_lm for m ≥ 0, of a real function: those of m = 0 are real.
/// normalisation : str
///     "orthonormal", "four-pi" or "schmidt".
/// phase : str
///     "plain" or "condon-shortley".
///
/// Returns
/// -------
/// Coefficients, (…, (degree + 1)²)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> np.allclose(lobes.from_complex([1, 2, (1 + 1j) / np.sqrt(2)]), [1, 2, -1, 1])
/// True
#[pyfunction]
#[pyo3(signature = (coefficients, normalisation="orthonormal", phase="condon-shortley"))]
pub(crate) fn from_complex<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    normalisation: &str,
    phase: &str,
) -> PyResult<Bound<'py, PyAny>> {
    const WHAT: &str = "the array of complex coefficients";
    let convention = convention(normalisation, phase)?;
    let values = complexes(coefficients, WHAT)?;
    let count = values.shape().last().copied().unwrap_or(0);
    // (degree + 1)(degree + 2)/2 of them.
    let degree = (((8 * count + 1).isqrt() - 1) / 2).saturating_sub(1);
    if count != (degree + 1) * (degree + 2) / 2 {
        return Err(PyValueError::new_err(format!(
            "{WHAT} has {count} values, which are not (degree + 1)(degree + 2)/2 of any degree"
        )));
    }
    let shape = leading(values.shape(), &[count], WHAT)?;
    let flat = values.as_slice()?;
    if let Some(index) = flat.iter().position(|value| !value.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "{WHAT} holds {} at index {index} of its values; every one must be finite",
            flat[index]
        )));
    }
    let sets = flat
        .chunks_exact(count)
        .map(|one| harmonics::Coefficients::from_complex(degree, convention, one).map_err(error))
        .collect::<PyResult<Vec<_>>>()?;
    wrap_all(py, &shape, sets, (degree, degree))
}

/// Real coefficients of all orders in another convention.
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
/// normalisation : str
///     "orthonormal", "four-pi" or "schmidt".
/// phase : str
///     "plain" or "condon-shortley".
/// order : str
///     "by-order", or "by-degree": l² + l + m.
///
/// Returns
/// -------
/// ndarray, (…, (degree + 1)²)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.to_real([1.0, 2.0, 3.0, 4.0])  # 1, z, x, y
/// array([1., 4., 2., 3.])
#[pyfunction]
#[pyo3(signature = (coefficients, normalisation="orthonormal", phase="plain", order="by-degree"))]
pub(crate) fn to_real<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    normalisation: &str,
    phase: &str,
    order: &str,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let (convention, order) = (convention(normalisation, phase)?, storage(order)?);
    let sets = Sets::of(coefficients, "the array of coefficients")?;
    let count = (sets.degree + 1) * (sets.degree + 1);
    each(py, &sets, count, "a coefficient", |set| {
        Ok(set.to_real(convention, order))
    })
}

/// From real coefficients as `to_real` gives them.
///
/// Parameters
/// ----------
/// coefficients : array_like, (…, (degree + 1)²)
/// normalisation : str
///     "orthonormal", "four-pi" or "schmidt".
/// phase : str
///     "plain" or "condon-shortley".
/// order : str
///     "by-order", or "by-degree": l² + l + m.
///
/// Returns
/// -------
/// Coefficients, (…, (degree + 1)²)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.from_real([1.0, 4.0, 2.0, 3.0]).array
/// array([1., 2., 3., 4.])
#[pyfunction]
#[pyo3(signature = (coefficients, normalisation="orthonormal", phase="plain", order="by-degree"))]
pub(crate) fn from_real<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    normalisation: &str,
    phase: &str,
    order: &str,
) -> PyResult<Bound<'py, PyAny>> {
    const WHAT: &str = "the array of real coefficients";
    let (convention, order) = (convention(normalisation, phase)?, storage(order)?);
    let values = doubles(coefficients, WHAT)?;
    check_finite(values.as_slice()?, WHAT)?;
    let count = values.shape().last().copied().unwrap_or(0);
    let degree = count.isqrt().saturating_sub(1);
    if count != (degree + 1) * (degree + 1) {
        return Err(PyValueError::new_err(format!(
            "{WHAT} has {count} values, which are not (degree + 1)² of any degree"
        )));
    }
    let shape = leading(values.shape(), &[count], WHAT)?;
    let sets = values
        .as_slice()?
        .chunks_exact(count)
        .map(|one| {
            harmonics::Coefficients::from_real(degree, convention, order, one).map_err(error)
        })
        .collect::<PyResult<Vec<_>>>()?;
    wrap_all(py, &shape, sets, (degree, degree))
}

/// A mask that depends on the angle from the pole only.
///
/// Parameters
/// ----------
/// inner : float
///     It is 1 for angles below, in radians.
/// outer : float, optional
///     Where it has fallen to 0, as cos²; without it a cap ends at `inner`.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> np.round(lobes.Mask(1.0, 2.0).value([0.5, 1.5, 2.5]), 12)
/// array([1. , 0.5, 0. ])
#[pyclass(frozen, eq, from_py_object, module = "lobes")]
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Mask {
    inner: f64,
    outer: f64,
}

impl Mask {
    fn mask(self) -> harmonics::Mask {
        let Self { inner, outer } = self;
        if inner == outer {
            harmonics::Mask::Cap { radius: outer }
        } else {
            harmonics::Mask::Apodised { inner, outer }
        }
    }
}

#[pymethods]
impl Mask {
    #[new]
    #[pyo3(signature = (inner, outer=None))]
    fn new(inner: f64, outer: Option<f64>) -> PyResult<Self> {
        let outer = outer.unwrap_or(inner);
        if 0.0 < outer && 0.0 <= inner && inner <= outer && outer <= std::f64::consts::PI {
            Ok(Self { inner, outer })
        } else {
            Err(PyValueError::new_err(format!(
                "a mask from {inner} to {outer} is not between 0 and π with the inner edge within the outer"
            )))
        }
    }

    /// Where it begins to fall.
    #[getter]
    fn inner(&self) -> f64 {
        self.inner
    }

    /// Where it is 0.
    #[getter]
    fn outer(&self) -> f64 {
        self.outer
    }

    /// Its value at angles from the pole.
    ///
    /// Parameters
    /// ----------
    /// theta : array_like, any shape
    ///     In radians.
    ///
    /// Returns
    /// -------
    /// ndarray, of that shape
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Mask(1.0).value([0.5, 1.5])
    /// array([1., 0.])
    fn value<'py>(
        &self,
        py: Python<'py>,
        theta: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let theta = doubles(theta, "the array of angles")?;
        check_finite(theta.as_slice()?, "the array of angles")?;
        let values = theta
            .as_slice()?
            .iter()
            .map(|&theta| self.mask().value(theta));
        shaped(py, theta.shape(), values.collect())
    }

    /// Maps times the mask.
    ///
    /// Parameters
    /// ----------
    /// transform : Transform
    ///     Whose grid the maps are of.
    /// maps : array_like, (…, rings, columns), or (…, pixels) on HEALPix
    ///
    /// Returns
    /// -------
    /// ndarray, of that shape
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("clenshaw-curtis", 3, 4, 1)
    /// >>> lobes.Mask(1.0).apply(transform, np.ones((3, 4)))[:, 0]
    /// array([1., 0., 0.])
    fn apply<'py>(
        &self,
        py: Python<'py>,
        transform: &Transform,
        maps: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let grid: &Grid = transform.grid_itself();
        let maps = doubles(maps, "the array of maps")?;
        leading(maps.shape(), &transform.map_shape(), "the array of maps")?;
        let mut values = maps.as_slice()?.to_vec();
        for map in values.chunks_exact_mut(grid.len()) {
            self.mask().apply(grid, map).map_err(error)?;
        }
        shaped(py, maps.shape(), values)
    }

    fn __repr__(&self) -> String {
        if self.inner == self.outer {
            format!("Mask({:?})", self.inner)
        } else {
            format!("Mask({:?}, {:?})", self.inner, self.outer)
        }
    }

    fn __hash__(&self) -> u64 {
        self.inner.to_bits() ^ self.outer.to_bits().rotate_left(17)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (f64, f64)) {
        let Self { inner, outer } = *slf.get();
        (slf.get_type().into_any(), (inner, outer))
    }
}

/// How a mask couples the degrees of what it leaves.
///
/// Parameters
/// ----------
/// mask : Mask
///     Of one that depends on the angle from the pole; `Coupling.from_power` is for any other.
/// degree : int
///     At most 1024.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> coupling = lobes.Coupling(lobes.Mask(np.pi), 4)  # the whole sphere
/// >>> np.allclose(coupling.matrix, np.eye(5))
/// True
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Coupling {
    coupling: Couplings,
    mask: Option<Mask>,
    /// What a mask of any shape is given by.
    power: Vec<f64>,
}

#[pymethods]
impl Coupling {
    #[new]
    fn new(py: Python<'_>, mask: Mask, degree: usize) -> PyResult<Self> {
        let coupling = crate::interrupt::run(py, move || Couplings::new(mask.mask(), degree))?
            .map_err(error)?;
        Ok(Self {
            coupling,
            mask: Some(mask),
            power: Vec::new(),
        })
    }

    /// The coupling by a mask of any shape, from its own power.
    ///
    /// Parameters
    /// ----------
    /// power : array_like, (any,)
    ///     `average_power` of the mask, to twice the degree; what is missing counts as 0.
    /// degree : int
    ///     At most 1024.
    ///
    /// Returns
    /// -------
    /// Coupling
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("gauss-legendre", 48, 96, 40)
    /// >>> mask = (np.abs(transform.directions[..., 2]) > 0.2).astype(float)
    /// >>> mask = lobes.apodise(transform, mask, 0.4)
    /// >>> coupling = lobes.Coupling.from_power(lobes.average_power(transform.analyse(mask)), 20)
    /// >>> masked = coupling.couple(np.ones(21))
    /// >>> np.allclose(coupling.decouple(masked, [0, 7, 14, 21]), 1)
    /// True
    #[staticmethod]
    fn from_power(py: Python<'_>, power: &Bound<'_, PyAny>, degree: usize) -> PyResult<Self> {
        let power = by_degree(power, "the array of powers")?;
        let given = power.clone();
        let coupling = crate::interrupt::run(py, move || Couplings::from_power(&given, degree))?
            .map_err(error)?;
        Ok(Self {
            coupling,
            mask: None,
            power,
        })
    }

    /// The largest degree.
    #[getter]
    fn degree(&self) -> usize {
        self.coupling.degree()
    }

    /// The mask, or None of one of any shape.
    #[getter]
    fn mask(&self) -> Option<Mask> {
        self.mask
    }

    /// What degree l of the masked field, a row, has of degree l′ of the whole, a column.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let matrix = self.coupling.matrix();
        let size = self.degree() + 1;
        let out = zeros::<f64>(py, &[size, size])?;
        let mut guard = out.readwrite();
        for (index, value) in guard.as_slice_mut()?.iter_mut().enumerate() {
            *value = matrix[(index / size, index % size)];
        }
        drop(guard);
        Ok(out)
    }

    /// The mean power of the masked field, of a field of this power over the whole sphere.
    ///
    /// Parameters
    /// ----------
    /// power : array_like, (degree + 1,)
    ///
    /// Returns
    /// -------
    /// ndarray, (degree + 1,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> coupling = lobes.Coupling(lobes.Mask(1.5), 4)
    /// >>> power = np.ones(5)
    /// >>> np.allclose(coupling.couple(power), coupling.matrix @ power)
    /// True
    fn couple<'py>(
        &self,
        py: Python<'py>,
        power: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let power = by_degree(power, "the array of powers")?;
        let coupled = self.coupling.couple(&power).map_err(error)?;
        check_result(&coupled, "the power of a degree")?;
        Ok(PyArray1::from_vec(py, coupled))
    }

    /// The power of the whole sphere in bands, from that of the masked field.
    ///
    /// Parameters
    /// ----------
    /// masked : array_like, (degree + 1,)
    ///     The average power of the masked field.
    /// edges : sequence of int
    ///     Band b holds the degrees edges[b] … edges[b + 1] − 1.
    /// shape : array_like, (degree + 1,), optional
    ///     Within a band the power is taken as this times the one unknown that comes back; constant
    ///     unless given.
    /// weights : array_like, (degree + 1,), optional
    ///     The masked power of a band is the mean under these; 2l + 1 unless given.
    ///
    /// Returns
    /// -------
    /// ndarray, (bands,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> coupling = lobes.Coupling(lobes.Mask(2.0), 11)
    /// >>> np.allclose(coupling.decouple(coupling.couple(np.ones(12)), [0, 4, 8, 12]), 1)
    /// True
    #[pyo3(signature = (masked, edges, shape=None, weights=None))]
    fn decouple<'py>(
        &self,
        py: Python<'py>,
        masked: &Bound<'py, PyAny>,
        edges: Vec<usize>,
        shape: Option<&Bound<'py, PyAny>>,
        weights: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let masked = by_degree(masked, "the array of powers")?;
        let (shape, weights) = (self.shape(shape)?, self.weights(weights)?);
        let power = self
            .coupling
            .decouple_weighted(&masked, &edges, |l| weights[l], |l| shape[l])
            .map_err(error)?;
        check_result(&power, "the power of a band")?;
        Ok(PyArray1::from_vec(py, power))
    }

    /// What `decouple` gives in the mean of a field with the power 1 at one degree: (bands, degree +
    /// 1), whose product with any power is what the bands are to be compared with.
    ///
    /// Parameters
    /// ----------
    /// edges : sequence of int
    /// shape, weights : array_like, (degree + 1,), optional
    ///     As of `decouple`.
    ///
    /// Returns
    /// -------
    /// ndarray, (bands, degree + 1)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> windows = lobes.Coupling(lobes.Mask(1.5), 11).windows([0, 4, 8, 12])
    /// >>> np.allclose(windows.sum(axis=1), 1)
    /// True
    #[pyo3(signature = (edges, shape=None, weights=None))]
    fn windows<'py>(
        &self,
        py: Python<'py>,
        edges: Vec<usize>,
        shape: Option<&Bound<'py, PyAny>>,
        weights: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (shape, weights) = (self.shape(shape)?, self.weights(weights)?);
        let windows = self
            .coupling
            .windows(&edges, |l| weights[l], |l| shape[l])
            .map_err(error)?;
        // A matrix is stored column by column.
        let values = windows.transpose().as_slice().to_vec();
        check_result(&values, "a window")?;
        shaped(py, &[windows.nrows(), windows.ncols()], values)
    }

    fn __repr__(&self) -> String {
        match self.mask {
            Some(mask) => format!("Coupling({}, {})", mask.__repr__(), self.degree()),
            None => format!("Coupling.from_power(..., {})", self.degree()),
        }
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (this, py) = (slf.get(), slf.py());
        let class = slf.get_type().into_any();
        match this.mask {
            Some(mask) => Ok((class, (mask, this.degree()).into_pyobject(py)?)),
            None => {
                let power = PyArray1::from_slice(py, &this.power);
                let arguments = (power, this.degree()).into_pyobject(py)?;
                Ok((class.getattr("from_power")?, arguments))
            }
        }
    }
}

impl Coupling {
    /// The shape within bands, constant unless given.
    fn shape(&self, shape: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
        self.each_degree(shape, "the shape within bands", |_| 1.0)
    }

    /// The weights within bands, 2l + 1 unless given.
    fn weights(&self, weights: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
        self.each_degree(weights, "the weights within bands", |l| (2 * l + 1) as f64)
    }

    fn each_degree(
        &self,
        given: Option<&Bound<'_, PyAny>>,
        what: &str,
        otherwise: fn(usize) -> f64,
    ) -> PyResult<Vec<f64>> {
        let count = self.degree() + 1;
        let values = match given {
            Some(given) => by_degree(given, what)?,
            None => (0..count).map(otherwise).collect(),
        };
        if values.len() != count {
            return Err(PyValueError::new_err(format!(
                "{what} has {} values where {count}, one a degree, are needed",
                values.len()
            )));
        }
        Ok(values)
    }
}

/// Masks (…, *shape) of a transform's grid with soft edges: each point times a factor for its
/// distance to the nearest point where the mask is 0.
///
/// Parameters
/// ----------
/// transform : Transform
/// masks : array_like, (…, *shape)
/// width : float
///     The angle in radians at which the factor comes to 1.
/// kind : "c1" or "c2"
///     NaMaster's: x − sin(2πx)/2π, or (1 − cos πx)/2, x² = (1 − cos θ)/(1 − cos width).
/// threads : bool
///     Whether all cores work.
///
/// Returns
/// -------
/// ndarray, (…, *shape)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> transform = lobes.Transform.healpix(8, 8)
/// >>> mask = (transform.directions[:, 2] > 0).astype(float)
/// >>> soft = lobes.apodise(transform, mask, 0.3)
/// >>> bool(((soft > 0.1) & (soft < 0.9)).any()), bool((soft <= mask).all())
/// (True, True)
#[pyfunction]
#[pyo3(signature = (transform, masks, width, kind="c1", threads=true))]
pub(crate) fn apodise<'py>(
    py: Python<'py>,
    transform: &Transform,
    masks: &Bound<'py, PyAny>,
    width: f64,
    kind: &str,
    threads: bool,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let kinds = [("c1", Apodisation::C1), ("c2", Apodisation::C2)];
    let kind = one_of(kind, "kind of edge", &kinds)?;
    let grid: &Grid = transform.grid_itself();
    let masks = doubles(masks, "the array of masks")?;
    leading(masks.shape(), &transform.map_shape(), "the array of masks")?;
    let mut values = Vec::new();
    for mask in masks.as_slice()?.chunks_exact(grid.len()) {
        let soft = py
            .detach(|| harmonics::apodise(grid, mask, width, kind, crate::parallelism(threads)))
            .map_err(error)?;
        values.extend(soft);
        py.check_signals()?;
    }
    shaped(py, masks.shape(), values)
}
