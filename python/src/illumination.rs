//! Environment maps.

use std::path::PathBuf;

use lobes::Parallelism;
use lobes::illumination;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error;
use crate::harmonics::contiguous;

/// Light from every direction: a lat-long map of linear radiance.
#[pyclass(frozen, module = "lobes", from_py_object)]
#[derive(Clone)]
pub(crate) struct EnvironmentMap(pub(crate) illumination::EnvironmentMap);

#[pymethods]
impl EnvironmentMap {
    #[new]
    #[pyo3(signature = (pixels, name="map"))]
    fn new(pixels: &Bound<'_, PyArrayDyn<f64>>, name: &str) -> PyResult<Self> {
        let pixels = contiguous(pixels)?;
        let &[height, width, 3] = pixels.shape() else {
            return Err(PyValueError::new_err(format!(
                "the map has the shape {:?}, which is not (rows, columns, 3)",
                pixels.shape()
            )));
        };
        let pixels = pixels.as_slice()?.as_chunks().0.to_vec();
        illumination::EnvironmentMap::new(name, width, height, pixels)
            .map(Self)
            .map_err(error)
    }

    /// Reads an OpenEXR, Radiance or PFM file.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| illumination::read(&path, None))
            .map(Self)
            .map_err(error)
    }

    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// The pixels, (rows, columns, 3).
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let flat = PyArray1::from_slice(py, self.0.pixels().as_flattened());
        flat.reshape([self.0.height(), self.0.width(), 3])
    }

    /// The coefficients of each channel, (3, (degree + 1)²).
    fn coefficients<'py>(
        &self,
        py: Python<'py>,
        degree: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let channels = py
            .detach(|| self.0.coefficients(degree, Parallelism::Rayon))
            .map_err(error)?;
        let flat = channels.into_iter().flat_map(|set| set.into_vec());
        let flat = PyArray1::from_vec(py, flat.collect());
        flat.reshape([3, (degree + 1) * (degree + 1)])
    }
}

/// The maps that come with the crate: captured light, in the public domain.
#[pyfunction]
pub(crate) fn builtin(py: Python<'_>) -> PyResult<Vec<EnvironmentMap>> {
    let maps = py.detach(illumination::builtin).map_err(error)?;
    Ok(maps.into_iter().map(EnvironmentMap).collect())
}
