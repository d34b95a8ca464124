//! Spheres under light, and what one picture tells.

use lobes::features::{Continuation, ImageSpectrum, PaperFeatures, TOP_DEGREE};
use lobes::glam::DVec3;
use lobes::reflectance::Variant;
use lobes::reflection::{self, Settings, SphereImage};
use numpy::{PyArray1, PyArray3, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::harmonics::contiguous;
use crate::illumination::EnvironmentMap;
use crate::reflectance::Material;
use crate::{error, parallelism};

/// A camera that looks at the centre of the sphere.
#[pyclass(frozen, module = "lobes", from_py_object)]
#[derive(Clone, Copy)]
pub(crate) struct Camera(reflection::Camera);

#[pymethods]
impl Camera {
    /// From far away, or from `distance` radii of the sphere.
    #[new]
    #[pyo3(signature = (towards=[0.0, 0.0, 1.0], up=[0.0, 1.0, 0.0], distance=None))]
    fn new(towards: [f64; 3], up: [f64; 3], distance: Option<f64>) -> PyResult<Self> {
        let (towards, up) = (DVec3::from_array(towards), DVec3::from_array(up));
        match distance {
            None => reflection::Camera::orthographic(towards, up),
            Some(distance) => reflection::Camera::perspective(towards, up, distance),
        }
        .map(Self)
        .map_err(error)
    }

    /// Turned about its line of sight, in radians.
    fn rolled(&self, angle: f64) -> Self {
        Self(self.0.rolled(angle))
    }
}

/// A map prepared for rendering.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Renderer(reflection::Renderer);

#[pymethods]
impl Renderer {
    #[new]
    #[pyo3(signature = (map, threads=true))]
    fn new(py: Python<'_>, map: EnvironmentMap, threads: bool) -> PyResult<Self> {
        py.detach(|| reflection::Renderer::new(&map.0, parallelism(threads)))
            .map(Self)
            .map_err(error)
    }

    /// The image, (size, size, 3), NaN outside of the sphere, and its estimated error.
    #[pyo3(signature = (material, variant="ward1992", camera=None, size=128, tolerance=1e-3, pixel_samples=1, threads=true))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        material: Material,
        variant: &str,
        camera: Option<Camera>,
        size: usize,
        tolerance: f64,
        pixel_samples: usize,
        threads: bool,
    ) -> PyResult<(Bound<'py, PyArray3<f64>>, f64)> {
        let variant: Variant = variant.parse().map_err(error)?;
        let camera = match camera {
            Some(camera) => camera.0,
            None => front()?,
        };
        let settings = Settings {
            size,
            tolerance,
            pixel_samples,
        };
        let rendering = py
            .detach(|| {
                let threads = parallelism(threads);
                self.0
                    .render(&material.0, variant, &camera, &settings, threads)
            })
            .map_err(error)?;
        let pixels = (0..size * size).flat_map(|i| {
            rendering
                .image
                .get(i / size, i % size)
                .unwrap_or([f64::NAN; 3])
        });
        let image = PyArray1::from_vec(py, pixels.collect()).reshape([size, size, 3])?;
        Ok((image, rendering.error))
    }
}

fn front() -> PyResult<reflection::Camera> {
    reflection::Camera::orthographic(DVec3::Z, DVec3::Y).map_err(error)
}

/// The image of a sphere that fills the array, seen from far away.
pub(crate) fn sphere_image(pixels: &Bound<'_, PyArrayDyn<f64>>) -> PyResult<SphereImage> {
    let pixels = contiguous(pixels)?;
    match *pixels.shape() {
        [rows, columns, 3] if rows == columns => {
            let pixels = pixels.as_slice()?.as_chunks().0.to_vec();
            SphereImage::new(front()?, rows, pixels).map_err(error)
        }
        ref other => Err(PyValueError::new_err(format!(
            "the image has the shape {other:?}, which is not (size, size, 3)"
        ))),
    }
}

/// The paper's ten features of an image: v1 … v7 and B_0 of red, green and blue.
#[pyfunction]
#[pyo3(signature = (image, continuation="mirror"))]
pub(crate) fn features<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyArrayDyn<f64>>,
    continuation: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let continuation: Continuation = continuation.parse().map_err(error)?;
    let image = sphere_image(image)?;
    let features = py
        .detach(|| PaperFeatures::of_image(&ImageSpectrum::new(TOP_DEGREE, continuation)?, &image))
        .map_err(error)?;
    Ok(PyArray1::from_slice(py, &features.to_array()))
}
