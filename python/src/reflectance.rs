//! Ward's lobes, Lambert's, and materials made of them.

use lobes::glam::DVec3;
use lobes::reflectance::{self, Variant};
use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::error;
use crate::harmonics::{contiguous, directions};

/// A Ward lobe: its value times the light's cosine, at ρ_s = 1.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Lobe(reflectance::Ward);

#[pymethods]
impl Lobe {
    #[new]
    #[pyo3(signature = (variant, sigma_x, sigma_y=None))]
    fn new(variant: &str, sigma_x: f64, sigma_y: Option<f64>) -> PyResult<Self> {
        let variant: Variant = variant.parse().map_err(error)?;
        match sigma_y {
            None => reflectance::Ward::isotropic(variant, sigma_x),
            Some(sigma_y) => reflectance::Ward::anisotropic(variant, sigma_x, sigma_y),
        }
        .map(Self)
        .map_err(error)
    }

    /// f · c_i for one view and many lights, in the surface's frame.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        view: [f64; 3],
        lights: &Bound<'py, PyArrayDyn<f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let lights = directions(&contiguous(lights)?)?;
        let mut values = vec![0.0; lights.len()];
        py.detach(|| {
            self.0
                .evaluate_batch(DVec3::from_array(view), &lights, &mut values)
        })
        .map_err(error)?;
        Ok(PyArray1::from_vec(py, values))
    }

    /// The share of light that is reflected, at the cosine of a view.
    fn albedo(&self, view_cosine: f64) -> f64 {
        self.0.albedo(view_cosine)
    }

    /// The zonal coefficients b_0 … b_degree about the mirror direction.
    fn zonal<'py>(
        &self,
        py: Python<'py>,
        view_cosine: f64,
        degree: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let zonal = py
            .detach(|| self.0.zonal(view_cosine, degree))
            .map_err(error)?;
        Ok(PyArray1::from_vec(py, zonal))
    }
}

/// Lambert's transfers Λ_l ρ̂_l, l = 0 … degree.
#[pyfunction]
pub(crate) fn lambert(py: Python<'_>, degree: usize) -> Bound<'_, PyArray1<f64>> {
    PyArray1::from_vec(py, reflectance::lambert::transfers(degree))
}

/// A material: a Lambert body and a Ward lobe.
#[pyclass(frozen, module = "lobes", from_py_object)]
#[derive(Clone)]
pub(crate) struct Material(pub(crate) reflectance::Material);

#[pymethods]
impl Material {
    /// Radiance's plastic: a white highlight.
    #[staticmethod]
    fn plastic(name: &str, reflectance: [f64; 3], specularity: f64, sigma: f64) -> PyResult<Self> {
        reflectance::Material::plastic(name, reflectance, specularity, sigma)
            .map(Self)
            .map_err(error)
    }

    /// Radiance's metal: a highlight of the metal's colour.
    #[staticmethod]
    fn metal(name: &str, reflectance: [f64; 3], specularity: f64, sigma: f64) -> PyResult<Self> {
        reflectance::Material::metal(name, reflectance, specularity, sigma)
            .map(Self)
            .map_err(error)
    }

    /// Of given albedos, which may not add up to more than 1.
    #[staticmethod]
    fn from_albedos(
        name: &str,
        diffuse: [f64; 3],
        specular: [f64; 3],
        sigma: f64,
    ) -> PyResult<Self> {
        reflectance::Material::from_albedos(name, diffuse, specular, sigma)
            .map(Self)
            .map_err(error)
    }

    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    #[getter]
    fn diffuse(&self) -> [f64; 3] {
        self.0.diffuse()
    }

    #[getter]
    fn specular(&self) -> [f64; 3] {
        self.0.specular()
    }

    #[getter]
    fn sigma(&self) -> f64 {
        self.0.roughness().sigma()
    }
}

/// The eight materials of the paper's table.
#[pyfunction]
pub(crate) fn presets() -> Vec<Material> {
    reflectance::presets().into_iter().map(Material).collect()
}
