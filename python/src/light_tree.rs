//! Radiances with a proven bound.

use std::sync::Arc;

use lobes::glam::DVec3;
use lobes::reflectance::{self, Fresnel, Variant};
use lobes::reflection::{self, Settings, Surface};
use numpy::PyArrayDyn;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Two, check_room, shaped};
use crate::illumination::EnvironmentMap;
use crate::reflectance::Material;
use crate::reflection::{Camera, check_size, picture, shading_points};
use crate::{error, interrupt, parallelism};

/// A surface of GGX facets over a matte body: an albedo and a reflectance for each channel, and a
/// width, or two along the circles about an axis and across them, as on what was turned on a lathe.
///
/// Its facets reflect `f0` along the normal (Schlick), or are of an `index` of refraction, or of an
/// `index` and an `extinction`; each is three numbers, of red, green and blue.
///
/// Parameters
/// ----------
/// name : str
/// alpha : float or two floats
///     The width of the lobe, 0 for a mirror; or the width along the circles and that across them.
/// diffuse : array_like, (3,)
///     The albedo of the body.
/// f0 : array_like, (3,), optional
/// index : array_like, (3,), optional
/// extinction : array_like, (3,), optional
/// axis : array_like, (3,), optional
///     Of two widths: a direction of the world of unit length, (0, 1, 0) if none is given.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.GgxMaterial("gold", 0.2, f0=[1.0, 0.78, 0.34])
/// <GgxMaterial "gold", alpha 0.2>
/// >>> lobes.GgxMaterial("turned", (0.05, 0.3), f0=[0.9] * 3).axis
/// (0.0, 1.0, 0.0)
#[pyclass(frozen, eq, module = "lobes", from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct GgxMaterial(reflectance::GgxMaterial);

#[pymethods]
impl GgxMaterial {
    #[new]
    #[pyo3(signature = (name, alpha, diffuse=[0.0; 3], f0=None, index=None, extinction=None, axis=None))]
    fn new(
        name: String,
        alpha: &Bound<'_, PyAny>,
        diffuse: [f64; 3],
        f0: Option<[f64; 3]>,
        index: Option<[f64; 3]>,
        extinction: Option<[f64; 3]>,
        axis: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        let fresnel = Fresnel::of_channels(f0, index, extinction).ok_or_else(|| {
            PyValueError::new_err(
                "what the facets reflect is given by f0, by index, or by index and extinction",
            )
        })?;
        let alpha = alpha.extract::<Widths>().map_err(|_| {
            PyTypeError::new_err("alpha is a number, or two numbers: (along, across)")
        })?;
        let material = match (alpha, axis) {
            (Widths::One(alpha), None) => {
                reflectance::GgxMaterial::new(name, diffuse, alpha, fresnel)
            }
            (Widths::Two(alpha), axis) => {
                let axis = axis.map_or(DVec3::Y, DVec3::from);
                reflectance::GgxMaterial::anisotropic(name, diffuse, alpha, axis, fresnel)
            }
            (Widths::One(_), Some(_)) => {
                return Err(PyValueError::new_err(
                    "an axis says something of two widths: give alpha as (along, across), or no axis",
                ));
            }
        };
        material.map(Self).map_err(error)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// The widths of the lobe along the circles about the axis and across them: equal where one was
    /// given, 0 for a mirror.
    #[getter]
    fn alpha(&self) -> (f64, f64) {
        self.0.alpha().into()
    }

    /// The axis about whose circles the two widths lie.
    #[getter]
    fn axis(&self) -> (f64, f64, f64) {
        self.0.axis().into()
    }

    /// The albedo of the body.
    #[getter]
    fn diffuse(&self) -> (f64, f64, f64) {
        self.0.diffuse().into()
    }

    /// How much the facets reflect of light that meets them at an angle.
    ///
    /// Parameters
    /// ----------
    /// cosine : float
    ///     Of the angle, on [0, 1].
    ///
    /// Returns
    /// -------
    /// tuple of three floats
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> np.allclose(lobes.GgxMaterial("glass", 0.1, index=[1.5] * 3).reflectance(1.0), 0.04)
    /// True
    fn reflectance(&self, cosine: f64) -> PyResult<(f64, f64, f64)> {
        if !(0.0..=1.0).contains(&cosine) {
            return Err(PyValueError::new_err(format!(
                "the cosine of the angle of incidence is {cosine}, which is not in [0, 1]"
            )));
        }
        let reflectance = |fresnel: Fresnel| fresnel.reflectance(cosine);
        Ok(self.0.fresnel().map(reflectance).into())
    }

    fn __repr__(&self) -> String {
        let [along, across] = self.0.alpha();
        if along == across {
            format!("<GgxMaterial {:?}, alpha {along}>", self.0.name())
        } else {
            format!(
                "<GgxMaterial {:?}, alpha ({along}, {across})>",
                self.0.name()
            )
        }
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        self.0.name().hash(&mut hasher);
        let facets = self.facets().map(Option::unwrap_or_default);
        let rest = [self.0.alpha().as_slice(), self.0.axis().as_ref()].concat();
        let numbers = facets.as_flattened().iter().chain(&rest);
        for value in numbers.chain(&self.0.diffuse()) {
            // 0 and −0 are equal.
            (value + 0.0).to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let this = slf.get();
        let [f0, index, extinction] = this.facets();
        let diffuse = this.0.diffuse();
        let alpha = this.0.alpha();
        let name = this.name();
        // Of one width as `new` has it, which knows mirrors.
        let arguments = if alpha[0] == alpha[1] && this.0.axis() == DVec3::Y {
            (name, alpha[0], diffuse, f0, index, extinction).into_pyobject(slf.py())?
        } else {
            let axis = this.axis();
            (name, alpha, diffuse, f0, index, extinction, axis).into_pyobject(slf.py())?
        };
        Ok((slf.get_type().into_any(), arguments))
    }
}

impl GgxMaterial {
    /// The reflectance along the normal, the index and the extinction, each where it was given.
    fn facets(&self) -> [Option<[f64; 3]>; 3] {
        Fresnel::channels(self.0.fresnel())
    }
}

/// One width, or two.
#[derive(FromPyObject)]
enum Widths {
    One(f64),
    Two([f64; 2]),
}

/// A material of either lobe.
enum AnyMaterial {
    Ward(Material),
    Ggx(GgxMaterial),
}

impl AnyMaterial {
    fn of(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(material) = object.extract::<Material>() {
            return Ok(Self::Ward(material));
        }
        let material = object.extract::<GgxMaterial>();
        material.map(Self::Ggx).map_err(|_| {
            PyTypeError::new_err("the material is neither a Material nor a GgxMaterial")
        })
    }

    fn surface(&self, variant: Variant) -> Surface<'_> {
        match self {
            Self::Ward(material) => Surface::Ward(&material.0, variant),
            Self::Ggx(material) => Surface::Ggx(&material.0),
        }
    }
}

/// A map made ready for radiances with a proven bound.
///
/// Parameters
/// ----------
/// map : EnvironmentMap
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.LightTree(lobes.builtin()[0].resampled(16))
/// <LightTree of "blender-city">
#[pyclass(frozen, module = "lobes")]
pub(crate) struct LightTree {
    tree: Arc<reflection::LightTree>,
    map: EnvironmentMap,
}

#[pymethods]
impl LightTree {
    #[new]
    #[pyo3(signature = (map, threads=true))]
    fn new(py: Python<'_>, map: EnvironmentMap, threads: bool) -> PyResult<Self> {
        let light = Arc::clone(&map.0);
        let tree = interrupt::run(py, move || {
            reflection::LightTree::new(&light, parallelism(threads))
        })?
        .map_err(error)?;
        Ok(Self {
            tree: Arc::new(tree),
            map,
        })
    }

    /// The map.
    #[getter]
    fn map(&self) -> EnvironmentMap {
        self.map.clone()
    }

    /// A picture of a sphere and how far each pixel can be off.
    ///
    /// Parameters
    /// ----------
    /// material : Material or GgxMaterial
    /// variant : str
    ///     Of a Ward lobe: "ward1992", "duer", "gmd" or "sampled".
    /// camera : Camera, optional
    ///     Far away towards +z unless given.
    /// size : int
    ///     Pixels a side, at most 16384.
    /// tolerance : float
    ///     The relative bound that is aimed at.
    /// pixel_samples : int
    ///     A pixel is the mean of so many points each way, at most 64.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// rendering : Rendering
    ///     Whose error is the largest bound, relative.
    /// bounds : ndarray, (size, size)
    ///     What no channel of a pixel is off by more than; 0 outside of the sphere.
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> tree = lobes.LightTree(lobes.builtin()[0].resampled(16))
    /// >>> material = lobes.GgxMaterial("rough", 0.3, f0=[0.9] * 3)
    /// >>> rendering, bounds = tree.render(material, size=8, tolerance=0.1)
    /// >>> rendering.pixels.shape, bounds.shape
    /// ((8, 8, 3), (8, 8))
    #[pyo3(signature = (material, variant="sampled", camera=None, size=128, tolerance=1e-3, pixel_samples=1, threads=true))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        material: &Bound<'py, PyAny>,
        variant: &str,
        camera: Option<Camera>,
        size: usize,
        tolerance: f64,
        pixel_samples: usize,
        threads: bool,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArrayDyn<f64>>)> {
        let variant: Variant = variant.parse().map_err(error)?;
        let material = AnyMaterial::of(material)?;
        let camera = Camera::or_default(camera)?;
        check_size(size)?;
        let settings = Settings {
            size,
            tolerance,
            pixel_samples,
        };
        if (1..=64).contains(&pixel_samples) {
            let points = (size * size).saturating_mul(pixel_samples * pixel_samples);
            check_room(points.saturating_mul(14), "a picture of that size")?;
        }
        let (tree, at) = (Arc::clone(&self.tree), camera.camera);
        let rendered = interrupt::run(py, move || {
            let surface = material.surface(variant);
            tree.render(surface, &at, &settings, parallelism(threads))
        })?
        .map_err(error)?;
        let bounds = (0..size * size).map(|index| {
            let bound = rendered.bounds.get(index / size, index % size);
            bound.map_or(0.0, |[bound, ..]| bound)
        });
        let bounds = shaped(py, &[size, size], bounds.collect())?;
        let error = rendered.relative_bound();
        Ok((picture(py, &rendered.image, error, camera)?, bounds))
    }

    /// The radiance that is seen of given normals from given directions, and a proven bound of its
    /// error.
    ///
    /// Parameters
    /// ----------
    /// material : Material or GgxMaterial
    /// normals, views : array_like, (…, 3)
    ///     In the world frame, of unit length.
    /// variant : str
    ///     Of a Ward lobe: "ward1992", "duer", "gmd" or "sampled".
    /// tolerance : float
    ///     The relative bound that is aimed at.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// radiance : ndarray, (…, 3)
    /// bounds : ndarray, (…)
    ///     What no channel is off by more than.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> tree = lobes.LightTree(lobes.EnvironmentMap(np.ones((16, 32, 3))))
    /// >>> radiance, bounds = tree.radiance(lobes.Material.white(), [0, 1, 0], [0, 1, 0])
    /// >>> bool((np.abs(radiance - 1) <= bounds[..., None]).all())
    /// True
    #[pyo3(signature = (material, normals, views, variant="sampled", tolerance=1e-3, threads=true))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn radiance<'py>(
        &self,
        py: Python<'py>,
        material: &Bound<'py, PyAny>,
        normals: &Bound<'py, PyAny>,
        views: &Bound<'py, PyAny>,
        variant: &str,
        tolerance: f64,
        threads: bool,
    ) -> PyResult<Two<'py>> {
        let variant: Variant = variant.parse().map_err(error)?;
        let material = AnyMaterial::of(material)?;
        let (points, shape) = shading_points(normals, views)?;
        let tree = Arc::clone(&self.tree);
        let answers = interrupt::run(py, move || {
            let surface = material.surface(variant);
            tree.radiance(surface, &points, tolerance, parallelism(threads))
        })?
        .map_err(error)?;
        let values = answers.iter().flat_map(|answer| answer.value).collect();
        let bounds = answers.iter().map(|answer| answer.bound).collect();
        Ok((
            shaped(py, &[&shape[..], &[3]].concat(), values)?,
            shaped(py, &shape, bounds)?,
        ))
    }

    fn __repr__(&self) -> String {
        format!("<LightTree of {:?}>", self.map.0.name())
    }
}
