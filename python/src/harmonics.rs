//! Transforms, values, rotation and spectra.

use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{self, Basis, Coefficients, Convention, coefficient_count};
use lobes::sphere::Grid;
use numpy::{
    Complex64, Ix1, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::{error, parallelism};

/// The values of an array in the order of C, as they lie or copied.
pub(crate) fn contiguous<'py>(
    array: &Bound<'py, PyArrayDyn<f64>>,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if array.is_c_contiguous() {
        return Ok(array.readonly());
    }
    let copy = array.call_method1("copy", ("C",))?;
    Ok(copy.cast_into::<PyArrayDyn<f64>>()?.readonly())
}

/// The shape before the last `trailing` dimensions, which must be `expected`, and how many maps that is.
fn leading(shape: &[usize], expected: &[usize], what: &str) -> PyResult<(Vec<usize>, usize)> {
    match shape.split_at_checked(shape.len().wrapping_sub(expected.len())) {
        Some((before, last)) if last == expected => Ok((before.to_vec(), before.iter().product())),
        _ => Err(PyValueError::new_err(format!(
            "{what} has the shape {shape:?}, whose last dimensions are not {expected:?}"
        ))),
    }
}

/// The degree of so many coefficients of all orders.
fn degree_of(count: usize) -> PyResult<usize> {
    let side = count.isqrt();
    if side * side == count && side > 0 {
        Ok(side - 1)
    } else {
        Err(PyValueError::new_err(format!(
            "{count} coefficients are not (degree + 1)² of any degree"
        )))
    }
}

pub(crate) fn directions(array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<DVec3>> {
    leading(array.shape(), &[3], "the array of directions")?;
    Ok(array
        .as_slice()?
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&[x, y, z]| DVec3::new(x, y, z))
        .collect())
}

/// A plan for analysis and synthesis on one grid, to one degree.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Transform(harmonics::Transform);

#[pymethods]
impl Transform {
    #[new]
    #[pyo3(signature = (grid, rings, columns, degree, orders=None))]
    fn new(
        py: Python<'_>,
        grid: &str,
        rings: usize,
        columns: usize,
        degree: usize,
        orders: Option<usize>,
    ) -> PyResult<Self> {
        py.detach(|| {
            let grid = match grid {
                "gauss-legendre" => Grid::gauss_legendre(rings, columns),
                "clenshaw-curtis" => Grid::clenshaw_curtis(rings, columns),
                "fejer" => Grid::fejer(rings, columns),
                "lat-long" => Grid::lat_long(rings, columns),
                other => {
                    return Err(PyValueError::new_err(format!(
                        "there is no grid {other:?}; there are gauss-legendre, clenshaw-curtis, fejer and lat-long"
                    )));
                }
            }
            .map_err(error)?;
            harmonics::Transform::with_orders(&grid, degree, orders.unwrap_or(degree))
                .map(Self)
                .map_err(error)
        })
    }

    /// The largest degree l.
    #[getter]
    fn degree(&self) -> usize {
        self.0.degree()
    }

    /// The largest order |m|.
    #[getter]
    fn orders(&self) -> usize {
        self.0.orders()
    }

    /// Rings and columns of a map.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.0.grid().rings(), self.0.grid().columns())
    }

    /// How many coefficients a map has.
    #[getter]
    fn coefficient_count(&self) -> usize {
        self.0.coefficient_count()
    }

    /// The coefficients (…, count) of maps (…, rings, columns); those of one call share the recurrence.
    #[pyo3(signature = (maps, threads=false))]
    fn analyse<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyArrayDyn<f64>>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let maps = contiguous(maps)?;
        let (rings, columns) = self.shape();
        let (mut shape, batch) = leading(maps.shape(), &[rings, columns], "the array of maps")?;
        shape.push(self.0.coefficient_count());
        let out = PyArrayDyn::zeros(py, shape, false);
        let mut guard = out.readwrite();
        let (input, output) = (maps.as_slice()?, guard.as_slice_mut()?);
        py.detach(|| {
            let mut scratch = vec![0.0; self.0.scratch_len(batch)];
            self.0
                .analyse_into(batch, input, output, &mut scratch, parallelism(threads))
        })
        .map_err(error)?;
        drop(guard);
        Ok(out)
    }

    /// The maps (…, rings, columns) of coefficients (…, count).
    #[pyo3(signature = (coefficients, threads=false))]
    fn synthesise<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyArrayDyn<f64>>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let coefficients = contiguous(coefficients)?;
        let count = self.0.coefficient_count();
        let (mut shape, batch) =
            leading(coefficients.shape(), &[count], "the array of coefficients")?;
        let (rings, columns) = self.shape();
        shape.extend([rings, columns]);
        let out = PyArrayDyn::zeros(py, shape, false);
        let mut guard = out.readwrite();
        let (input, output) = (coefficients.as_slice()?, guard.as_slice_mut()?);
        py.detach(|| {
            let mut scratch = vec![0.0; self.0.scratch_len(batch)];
            self.0
                .synthesise_into(batch, input, output, &mut scratch, parallelism(threads))
        })
        .map_err(error)?;
        drop(guard);
        Ok(out)
    }
}

/// A plan for rotating coefficients of one degree.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Rotation(harmonics::Rotation);

#[pymethods]
impl Rotation {
    #[new]
    fn new(py: Python<'_>, degree: usize) -> PyResult<Self> {
        py.detach(|| harmonics::Rotation::new(degree))
            .map(Self)
            .map_err(error)
    }

    #[getter]
    fn degree(&self) -> usize {
        self.0.degree()
    }

    /// The coefficients of f(R⁻¹ ω) for the rotation of a quaternion (x, y, z, w).
    #[pyo3(signature = (coefficients, quaternion, threads=false))]
    fn rotate<'py>(
        &self,
        py: Python<'py>,
        coefficients: PyReadonlyArray1<'py, f64>,
        quaternion: [f64; 4],
        threads: bool,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let values = coefficients.to_vec()?;
        let rotated = py
            .detach(|| {
                let degree = self.0.degree();
                let coefficients = Coefficients::from_vec(degree, degree, values)?;
                let quaternion = DQuat::from_array(quaternion);
                self.0
                    .rotate(&coefficients, quaternion, parallelism(threads))
            })
            .map_err(error)?;
        Ok(PyArray1::from_vec(py, rotated.into_vec()))
    }
}

/// B_l = Σ_m f_lm² / (2l + 1).
#[pyfunction]
pub(crate) fn average_power<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyArrayDyn<f64>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let coefficients = contiguous(coefficients)?;
    let Some((&count, before)) = coefficients.shape().split_last() else {
        return Err(PyValueError::new_err("coefficients are at least an array"));
    };
    let degree = degree_of(count)?;
    let mut shape = before.to_vec();
    shape.push(degree + 1);
    let mut powers = Vec::with_capacity(shape.iter().product());
    for set in coefficients.as_slice()?.chunks_exact(count) {
        let set = Coefficients::from_vec(degree, degree, set.to_vec()).map_err(error)?;
        powers.extend(harmonics::average_power(&set));
    }
    PyArray1::from_vec(py, powers).reshape(shape)
}

/// The coefficients as healpy and ducc0 have them.
#[pyfunction]
pub(crate) fn to_complex<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
    let values = coefficients.to_vec()?;
    let degree = degree_of(values.len())?;
    let set = Coefficients::from_vec(degree, degree, values).map_err(error)?;
    Ok(PyArray1::from_vec(py, set.to_complex(Convention::HEALPIX)))
}

/// From the coefficients as healpy and ducc0 have them.
#[pyfunction]
pub(crate) fn from_complex<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray1<'py, Complex64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let values = coefficients.to_vec()?;
    // (degree + 1)(degree + 2)/2 of them; a wrong count is refused below.
    let degree = ((8 * values.len() + 1).isqrt() - 1) / 2;
    let set = Coefficients::from_complex(degree.saturating_sub(1), Convention::HEALPIX, &values)
        .map_err(error)?;
    Ok(PyArray1::from_vec(py, set.into_vec()))
}

/// All Y_lm at directions.
#[pyfunction]
#[pyo3(signature = (directions, degree, threads=false))]
pub(crate) fn basis<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyArrayDyn<f64>>,
    degree: usize,
    threads: bool,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let directions = self::directions(&contiguous(directions)?)?;
    let out = PyArray2::zeros(
        py,
        [directions.len(), coefficient_count(degree, degree)],
        false,
    );
    let mut guard = out.readwrite();
    let output = guard.as_slice_mut()?;
    py.detach(|| Basis::new(degree)?.values(&directions, output, parallelism(threads)))
        .map_err(error)?;
    drop(guard);
    Ok(out)
}

/// A coefficient set summed at scattered directions.
#[pyfunction]
#[pyo3(signature = (coefficients, directions, threads=false))]
pub(crate) fn synthesise_at<'py>(
    py: Python<'py>,
    coefficients: PyReadonlyArray1<'py, f64>,
    directions: &Bound<'py, PyArrayDyn<f64>>,
    threads: bool,
) -> PyResult<Bound<'py, numpy::PyArray<f64, Ix1>>> {
    let values = coefficients.to_vec()?;
    let degree = degree_of(values.len())?;
    let directions = self::directions(&contiguous(directions)?)?;
    let mut sums = vec![0.0; directions.len()];
    py.detach(|| {
        let set = Coefficients::from_vec(degree, degree, values)?;
        Basis::new(degree)?.sums(&set, &directions, &mut sums, parallelism(threads))
    })
    .map_err(error)?;
    Ok(PyArray1::from_vec(py, sums))
}
