//! Spheres under light, and what one picture tells.

use std::sync::Arc;

use lobes::features::{Continuation, ImageSpectrum, PaperFeatures, TOP_DEGREE};
use lobes::glam::DVec3;
use lobes::reflectance::Variant;
use lobes::reflection::{self, Settings, ShadingPoint, SphereImage};
use numpy::{PyArray1, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Directions, Pixels, Two, check_room, shape_name, shaped, vector};
use crate::illumination::EnvironmentMap;
use crate::reflectance::Material;
use crate::{error, interrupt, is_record, parallelism, record};

/// A camera that looks at the centre of the sphere.
///
/// Parameters
/// ----------
/// towards : array_like, (3,), optional
///     From the sphere's centre to the camera; +z unless given.
/// up : array_like, (3,), optional
///     What is upwards in the picture; +y unless given.
/// distance : float, optional
///     In radii of the sphere; far away unless given.
/// roll : float
///     How far it is turned about its line of sight, in radians, anticlockwise as it looks through
///     it.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.Camera(towards=[1, 0, 1], distance=4.0).distance
/// 4.0
#[pyclass(frozen, eq, module = "lobes", from_py_object)]
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Camera {
    pub(crate) camera: reflection::Camera,
    /// As they were given.
    towards: [f64; 3],
    up: [f64; 3],
    distance: Option<f64>,
    roll: f64,
}

impl Camera {
    /// The camera, or that of a call without arguments.
    pub(crate) fn or_default(camera: Option<Self>) -> PyResult<Self> {
        match camera {
            Some(camera) => Ok(camera),
            None => Self::new(None, None, None, 0.0),
        }
    }

    fn made(towards: [f64; 3], up: [f64; 3], distance: Option<f64>, roll: f64) -> PyResult<Self> {
        if !roll.is_finite() {
            return Err(PyValueError::new_err(format!(
                "the camera's roll is {roll}, which is not finite"
            )));
        }
        let (to, upwards) = (DVec3::from_array(towards), DVec3::from_array(up));
        let camera = match distance {
            None => reflection::Camera::orthographic(to, upwards),
            Some(distance) => reflection::Camera::perspective(to, upwards, distance),
        }
        .map_err(error)?;
        Ok(Self {
            camera: if roll == 0.0 {
                camera
            } else {
                camera.rolled(roll)
            },
            towards,
            up,
            distance,
            roll,
        })
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (towards=None, up=None, distance=None, roll=0.0))]
    fn new(
        towards: Option<&Bound<'_, PyAny>>,
        up: Option<&Bound<'_, PyAny>>,
        distance: Option<f64>,
        roll: f64,
    ) -> PyResult<Self> {
        let of = |given: Option<&Bound<'_, PyAny>>, what, default: DVec3| {
            given.map_or(Ok(default), |given| vector(given, what))
        };
        let towards = of(towards, "the direction towards the camera", DVec3::Z)?;
        let up = of(up, "the direction up", DVec3::Y)?;
        Self::made(towards.to_array(), up.to_array(), distance, roll)
    }

    /// The unit vector from the sphere's centre towards the camera.
    #[getter]
    fn towards(&self) -> (f64, f64, f64) {
        self.camera.towards().into()
    }

    /// The unit vector that shows upwards in the picture.
    #[getter]
    fn up(&self) -> (f64, f64, f64) {
        self.camera.up().into()
    }

    /// The unit vector that shows to the right in the picture.
    #[getter]
    fn right(&self) -> (f64, f64, f64) {
        self.camera.right().into()
    }

    /// The distance in radii of the sphere; None where it is infinite.
    #[getter]
    fn distance(&self) -> Option<f64> {
        self.distance
    }

    /// Turned further about its line of sight.
    ///
    /// Parameters
    /// ----------
    /// angle : float
    ///     In radians.
    ///
    /// Returns
    /// -------
    /// Camera
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Camera().rolled(0.5) == lobes.Camera(roll=0.5)
    /// True
    fn rolled(&self, angle: f64) -> PyResult<Self> {
        Self::made(self.towards, self.up, self.distance, self.roll + angle)
    }

    /// What the pixels of a picture see.
    ///
    /// Parameters
    /// ----------
    /// size : int
    ///     Pixels a side.
    ///
    /// Returns
    /// -------
    /// normals, views : ndarray, (size, size, 3)
    ///     In the world frame; NaN where a pixel misses the sphere.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> normals, views = lobes.Camera().shading_points(3)
    /// >>> np.allclose(normals[1, 1], [0, 0, 1]) and np.allclose(views[1, 1], [0, 0, 1])
    /// True
    fn shading_points<'py>(&self, py: Python<'py>, size: usize) -> PyResult<Two<'py>> {
        check_size(size)?;
        check_room(12 * size * size, "the points of a picture")?;
        let missing = ShadingPoint {
            normal: DVec3::NAN,
            view: DVec3::NAN,
        };
        let points = (0..size * size).map(|index| {
            let point = self.camera.pixel(size, index / size, index % size);
            point.unwrap_or(missing)
        });
        let points: Vec<_> = points.collect();
        let of = |part: fn(&ShadingPoint) -> DVec3| {
            let flat = points.iter().flat_map(|point| part(point).to_array());
            shaped(py, &[size, size, 3], flat.collect())
        };
        Ok((of(|point| point.normal)?, of(|point| point.view)?))
    }

    fn __repr__(&self) -> String {
        let distance = match self.distance {
            None => "None".to_owned(),
            Some(distance) => format!("{distance:?}"),
        };
        let vector = |[x, y, z]: [f64; 3]| format!("({x:?}, {y:?}, {z:?})");
        format!(
            "Camera(towards={}, up={}, distance={distance}, roll={:?})",
            vector(self.towards),
            vector(self.up),
            self.roll
        )
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        let vectors = [self.towards, self.up];
        let distance = [self.distance.unwrap_or(f64::INFINITY), self.roll];
        for value in vectors.as_flattened().iter().chain(&distance) {
            // 0 and −0 are equal.
            (value + 0.0).to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let this = slf.get();
        let arguments = (this.towards, this.up, this.distance, this.roll);
        Ok((
            slf.get_type().into_any(),
            arguments.into_pyobject(slf.py())?,
        ))
    }
}

/// The sizes that the renderer takes.
pub(crate) fn check_size(size: usize) -> PyResult<()> {
    if (1..=1 << 14).contains(&size) {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!(
            "the size of the picture is {size}, which is not from 1 to 16384 pixels a side"
        )))
    }
}

/// A picture as Python has it: pixels, the mask of where the sphere is, the error, the camera.
pub(crate) fn picture<'py>(
    py: Python<'py>,
    image: &SphereImage,
    error: f64,
    camera: Camera,
) -> PyResult<Bound<'py, PyAny>> {
    let size = image.size();
    let at = |index: usize| image.get(index / size, index % size);
    let pixels = (0..size * size).flat_map(|index| at(index).unwrap_or([0.0; 3]));
    let pixels = shaped(py, &[size, size, 3], pixels.collect())?;
    let mask = (0..size * size).map(|index| at(index).is_some());
    let mask = shaped(py, &[size, size], mask.collect::<Vec<bool>>())?;
    record(py, "Rendering", (pixels, mask, error, camera))
}

/// What arrays of normals and of views say, and their shape without the last axis.
pub(crate) fn shading_points(
    normals: &Bound<'_, PyAny>,
    views: &Bound<'_, PyAny>,
) -> PyResult<(Vec<ShadingPoint>, Vec<usize>)> {
    let normals = Directions::unit(normals, "the array of normals")?;
    let views = Directions::unit(views, "the array of views")?;
    if normals.shape != views.shape {
        return Err(PyValueError::new_err(format!(
            "there are normals of the shape {} and views of the shape {}, and a view for each normal is needed",
            shape_name(&normals.shape),
            shape_name(&views.shape)
        )));
    }
    let points = normals
        .vectors
        .iter()
        .zip(&views.vectors)
        // Closer to unit length than doubles of single precision are.
        .map(|(normal, view)| ShadingPoint {
            normal: normal.normalize(),
            view: view.normalize(),
        })
        .collect();
    Ok((points, normals.shape))
}

/// A map prepared for rendering.
///
/// Parameters
/// ----------
/// map : EnvironmentMap
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> renderer = lobes.Renderer(lobes.EnvironmentMap(np.ones((16, 32, 3)), "white"))
/// >>> bool(abs(renderer.render(lobes.Material.white(), size=9).pixels[4, 4, 0] - 1) < 1e-3)
/// True
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Renderer {
    renderer: Arc<reflection::Renderer>,
    map: EnvironmentMap,
}

#[pymethods]
impl Renderer {
    #[new]
    #[pyo3(signature = (map, threads=true))]
    fn new(py: Python<'_>, map: EnvironmentMap, threads: bool) -> PyResult<Self> {
        let light = Arc::clone(&map.0);
        let renderer = interrupt::run(py, move || {
            reflection::Renderer::new(&light, parallelism(threads))
        })?
        .map_err(error)?;
        Ok(Self {
            renderer: Arc::new(renderer),
            map,
        })
    }

    /// The map.
    #[getter]
    fn map(&self) -> EnvironmentMap {
        self.map.clone()
    }

    /// A picture of a sphere, with the mask of where the sphere is and its estimated error.
    ///
    /// Parameters
    /// ----------
    /// material : Material
    /// variant : str
    ///     "ward1992", "duer", "gmd" or "sampled".
    /// camera : Camera, optional
    ///     Far away towards +z unless given.
    /// size : int
    ///     Pixels a side, at most 16384.
    /// tolerance : float
    ///     The relative error that is aimed at.
    /// pixel_samples : int
    ///     Points a side of each pixel, whose mean is taken.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// Rendering
    ///     Of pixels (size, size, 3).
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> renderer = lobes.Renderer(lobes.builtin()[0].resampled(32))
    /// >>> sphere = renderer.render(lobes.presets()[4], size=16)
    /// >>> sphere.pixels.shape, sphere.mask.shape
    /// ((16, 16, 3), (16, 16))
    #[pyo3(signature = (material, variant="sampled", camera=None, size=128, tolerance=1e-3, pixel_samples=1, threads=true))]
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
    ) -> PyResult<Bound<'py, PyAny>> {
        let variant: Variant = variant.parse().map_err(error)?;
        let camera = Camera::or_default(camera)?;
        check_size(size)?;
        let settings = Settings {
            size,
            tolerance,
            pixel_samples,
        };
        // A point and its estimate take 14 doubles.
        let points = (size * size).saturating_mul(pixel_samples.saturating_mul(pixel_samples));
        if (1..=64).contains(&pixel_samples) {
            check_room(points.saturating_mul(14), "a picture of that size")?;
        }
        let renderer = Arc::clone(&self.renderer);
        let rendering = interrupt::run(py, move || {
            let threads = parallelism(threads);
            renderer.render(&material.0, variant, &camera.camera, &settings, threads)
        })?
        .map_err(error)?;
        picture(py, &rendering.image, rendering.error, camera)
    }

    /// The radiance that is seen of given normals from given directions.
    ///
    /// Parameters
    /// ----------
    /// material : Material
    /// normals, views : array_like, (…, 3)
    ///     In the world frame, of unit length.
    /// variant : str
    ///     "ward1992", "duer", "gmd" or "sampled".
    /// tolerance : float
    ///     The relative error that is aimed at.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// radiance : ndarray, (…, 3)
    /// error : float
    ///     Estimated.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> renderer = lobes.Renderer(lobes.EnvironmentMap(np.ones((16, 32, 3))))
    /// >>> radiance, error = renderer.radiance(lobes.Material.white(), [0, 1, 0], [0, 1, 0])
    /// >>> np.allclose(radiance, 1, rtol=1e-3)
    /// True
    #[pyo3(signature = (material, normals, views, variant="sampled", tolerance=1e-3, threads=true))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn radiance<'py>(
        &self,
        py: Python<'py>,
        material: Material,
        normals: &Bound<'py, PyAny>,
        views: &Bound<'py, PyAny>,
        variant: &str,
        tolerance: f64,
        threads: bool,
    ) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, f64)> {
        let variant: Variant = variant.parse().map_err(error)?;
        let (points, shape) = shading_points(normals, views)?;
        let renderer = Arc::clone(&self.renderer);
        let (values, reached) = interrupt::run(py, move || {
            let threads = parallelism(threads);
            renderer.radiance(&material.0, variant, &points, tolerance, threads)
        })?
        .map_err(error)?;
        let shape = [&shape[..], &[3]].concat();
        Ok((shaped(py, &shape, values.into_flattened())?, reached))
    }

    fn __repr__(&self) -> String {
        format!("<Renderer of {:?}>", self.map.0.name())
    }
}

/// The image of a sphere that fills the array; a rendering has its camera, all else is taken to be
/// seen from far away.
fn sphere_image(object: &Bound<'_, PyAny>) -> PyResult<SphereImage> {
    let rendering = is_record(object, "Rendering")?;
    let camera = if rendering {
        object.getattr("camera")?.extract::<Camera>()?
    } else {
        Camera::new(None, None, None, 0.0)?
    };
    let Pixels {
        rows,
        columns,
        values,
    } = Pixels::linear(object, "the image")?;
    if rows != columns {
        return Err(PyValueError::new_err(format!(
            "the image has the shape ({rows}, {columns}, 3), which is not (size, size, 3)"
        )));
    }
    SphereImage::new(camera.camera, rows, values).map_err(error)
}

/// The paper's ten features of a picture of a sphere that fills it: v1 … v7, and B_0 of red, green
/// and blue.
///
/// Parameters
/// ----------
/// image : Rendering or array_like, (size, size, 3)
///     Linear radiance; what stands outside of the sphere does not matter.
/// continuation : str
///     How the half of the sphere that is not seen is filled: "mirror", "half-turn", "zero" or
///     "antipodal".
///
/// Returns
/// -------
/// ndarray, (10,)
///     Named by `FEATURE_NAMES`.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> renderer = lobes.Renderer(lobes.builtin()[0].resampled(32))
/// >>> sphere = renderer.render(lobes.presets()[4], size=32)
/// >>> lobes.features(sphere).shape
/// (10,)
#[pyfunction]
#[pyo3(signature = (image, continuation="mirror"))]
pub(crate) fn features<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    continuation: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let continuation: Continuation = continuation.parse().map_err(error)?;
    let image = sphere_image(image)?;
    let features = interrupt::run(py, move || {
        PaperFeatures::of_image(&ImageSpectrum::new(TOP_DEGREE, continuation)?, &image)
    })?
    .map_err(error)?;
    let features = features.to_array();
    crate::arrays::check_result(&features, "a feature")?;
    Ok(PyArray1::from_slice(py, &features))
}
