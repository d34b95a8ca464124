//! The reading of one picture.

use std::path::PathBuf;

use lobes::classify::{self, Circle, Dataset, Observation, Reflectance, Sample, TrainingPlan};
use lobes::reflectance::Variant;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::harmonics::contiguous;
use crate::illumination::EnvironmentMap;
use crate::reflectance::Material;
use crate::{error, parallelism};

/// A picture that a sphere is in.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Picture(classify::Picture);

/// The pixels of an array (rows, columns, 3), with its rows and columns.
fn pixels_of(array: &Bound<'_, PyArrayDyn<f64>>) -> PyResult<(usize, usize, Vec<[f64; 3]>)> {
    let array = contiguous(array)?;
    match *array.shape() {
        [rows, columns, 3] => Ok((rows, columns, array.as_slice()?.as_chunks().0.to_vec())),
        ref other => Err(PyValueError::new_err(format!(
            "the picture has the shape {other:?}, which is not (rows, columns, 3)"
        ))),
    }
}

#[pymethods]
impl Picture {
    /// Of linear radiance, (rows, columns, 3), or of sRGB codes on [0, 1] where `encoded` says so.
    ///
    /// A mask, (rows, columns) on [0, 1], tells which pixels are of the sphere; a focal length in pixels, how far the camera is.
    #[new]
    #[pyo3(signature = (pixels, encoded=false, mask=None, focal_length=None))]
    fn new(
        pixels: &Bound<'_, PyArrayDyn<f64>>,
        encoded: bool,
        mask: Option<&Bound<'_, PyArrayDyn<f64>>>,
        focal_length: Option<f64>,
    ) -> PyResult<Self> {
        let (rows, columns, pixels) = pixels_of(pixels)?;
        let mut picture = if encoded {
            classify::Picture::encoded(columns, rows, pixels)
        } else {
            classify::Picture::linear(columns, rows, pixels)
        }
        .map_err(error)?;
        if let Some(mask) = mask {
            let mask = contiguous(mask)?.as_slice()?.to_vec();
            picture = picture.with_mask(mask).map_err(error)?;
        }
        if let Some(pixels) = focal_length {
            picture = picture.with_focal_length(pixels).map_err(error)?;
        }
        Ok(Self(picture))
    }

    /// Reads a PNG or JPEG, as sRGB, or a linear OpenEXR, Radiance or PFM file; an alpha channel is the mask.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| classify::Picture::read(&path))
            .map(Self)
            .map_err(error)
    }

    /// Linear radiance, (rows, columns, 3).
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let flat = PyArray1::from_slice(py, self.0.pixels().as_flattened());
        flat.reshape([self.0.height(), self.0.width(), 3])
    }

    /// Where the sphere is, (x, y, radius) in pixels from the left and the top: by the mask, else found.
    fn circle(&self, py: Python<'_>) -> PyResult<(f64, f64, f64)> {
        let Circle { x, y, radius } = py.detach(|| self.0.circle()).map_err(error)?;
        Ok((x, y, radius))
    }
}

/// The plain parts of a training set, as it is pickled.
type Parts<'py> = (
    Vec<String>,
    Vec<String>,
    Bound<'py, PyArray2<usize>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    f64,
);

/// What a model learns from: spheres of the materials and of random reflectances, rendered under the lights and read as a camera may
/// leave them.
///
/// It takes about a minute to make and can be pickled.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Training(classify::Training);

#[pymethods]
impl Training {
    /// Under these lights, of these materials (the eight presets unless said), from `cameras` cameras.
    #[new]
    #[pyo3(signature = (lights, materials=None, variant="sampled", cameras=None, threads=true))]
    fn new(
        py: Python<'_>,
        lights: Vec<EnvironmentMap>,
        materials: Option<Vec<Material>>,
        variant: &str,
        cameras: Option<usize>,
        threads: bool,
    ) -> PyResult<Self> {
        let variant: Variant = variant.parse().map_err(error)?;
        py.detach(|| {
            let lights: Vec<_> = lights.into_iter().map(|light| light.0).collect();
            let materials = match materials {
                Some(materials) => materials.into_iter().map(|material| material.0).collect(),
                None => lobes::reflectance::presets(),
            };
            let mut plan = TrainingPlan::default();
            plan.plan.lobe = variant;
            if let Some(cameras) = cameras {
                plan.plan.turns = cameras;
            }
            classify::Training::new(&lights, &materials, &plan, parallelism(threads), &|| ())
        })
        .map(Self)
        .map_err(error)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Parts<'py>)> {
        let py = slf.py();
        let training = &slf.get().0;
        let observations = &training.named.observations;
        let random = &training.random;
        let rows = |count: usize, values: Vec<f64>| {
            let columns = values.len() / count.max(1);
            PyArray1::from_vec(py, values).reshape([count, columns])
        };
        let labels: Vec<usize> = observations
            .iter()
            .flat_map(|of| [of.material, of.illumination, of.turn])
            .collect();
        let truths: Vec<f64> = random
            .iter()
            .flat_map(|of| {
                let judged = f64::from(u8::from(of.judged));
                [
                    of.illumination as f64,
                    judged,
                    of.truth.share,
                    of.truth.sigma,
                ]
            })
            .collect();
        let named = observations.iter().flat_map(|of| of.view.clone()).collect();
        let views = random.iter().flat_map(|of| of.view.clone()).collect();
        Ok((
            slf.get_type().getattr("_from_parts")?,
            (
                training.named.materials.clone(),
                training.named.illuminations.clone(),
                PyArray1::from_vec(py, labels).reshape([observations.len(), 3])?,
                rows(observations.len(), named)?,
                rows(random.len(), truths)?,
                rows(random.len(), views)?,
                training.named.render_error,
            ),
        ))
    }

    /// What `pickle` puts together again.
    #[staticmethod]
    #[expect(clippy::needless_pass_by_value, reason = "as Python gives them")]
    fn _from_parts(
        materials: Vec<String>,
        illuminations: Vec<String>,
        labels: Bound<'_, PyArray2<usize>>,
        named: Bound<'_, PyArray2<f64>>,
        truths: Bound<'_, PyArray2<f64>>,
        views: Bound<'_, PyArray2<f64>>,
        render_error: f64,
    ) -> PyResult<Self> {
        let (named, views) = (named.readonly(), views.readonly());
        let (labels, truths) = (labels.readonly(), truths.readonly());
        let rows = |array: &numpy::PyReadonlyArray2<'_, f64>| -> PyResult<Vec<Vec<f64>>> {
            let columns = array.shape()[1].max(1);
            Ok(array
                .as_slice()?
                .chunks(columns)
                .map(<[f64]>::to_vec)
                .collect())
        };
        let observations: Vec<_> = labels
            .as_slice()?
            .as_chunks::<3>()
            .0
            .iter()
            .zip(rows(&named)?)
            .map(|(&[material, illumination, turn], view)| Observation {
                material,
                illumination,
                turn,
                view,
            })
            .collect();
        let random: Vec<_> = truths
            .as_slice()?
            .as_chunks::<4>()
            .0
            .iter()
            .zip(rows(&views)?)
            .map(|(&[illumination, judged, share, sigma], view)| Sample {
                illumination: illumination as usize,
                judged: judged != 0.0,
                truth: Reflectance { share, sigma },
                view,
            })
            .collect();
        let known = |of: &Observation<Vec<f64>>| {
            of.material < materials.len() && of.illumination < illuminations.len()
        };
        if !observations.iter().all(known)
            || random
                .iter()
                .any(|of| of.illumination >= illuminations.len())
        {
            return Err(PyValueError::new_err(
                "the training set names a material or a light that it does not have",
            ));
        }
        Ok(Self(classify::Training {
            named: Dataset {
                materials,
                illuminations,
                observations,
                render_error,
            },
            random,
        }))
    }
}

/// A classifier that has learned.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Model(classify::Model);

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (training, threads=true))]
    fn new(py: Python<'_>, training: &Bound<'_, Training>, threads: bool) -> PyResult<Self> {
        let training = training.get();
        py.detach(|| classify::Model::learn(&training.0, parallelism(threads)))
            .map(Self)
            .map_err(error)
    }

    /// The materials' names.
    #[getter]
    fn materials(&self) -> Vec<String> {
        self.0.materials().to_vec()
    }

    /// What the model says of the sphere in a picture, within `circle` (x, y, radius in pixels) or where `Picture.circle` finds it.
    #[pyo3(signature = (picture, circle=None))]
    fn read(
        &self,
        py: Python<'_>,
        picture: &Bound<'_, Picture>,
        circle: Option<(f64, f64, f64)>,
    ) -> PyResult<Verdict> {
        let picture = &picture.get().0;
        py.detach(|| {
            let circle = match circle {
                Some((x, y, radius)) => Circle { x, y, radius },
                None => picture.circle()?,
            };
            let sphere = picture.sphere(circle)?;
            Ok(Verdict {
                names: self.0.materials().to_vec(),
                saturated: sphere.saturated,
                grey: sphere.is_grey(),
                circle: (circle.x, circle.y, circle.radius),
                verdict: self.0.read(&sphere)?,
            })
        })
        .map_err(error)
    }
}

/// What a model says of one picture.
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Verdict {
    verdict: classify::Verdict,
    names: Vec<String>,
    circle: (f64, f64, f64),
    saturated: f64,
    grey: bool,
}

impl Verdict {
    /// The ends and the middle of a 90 % interval.
    fn interval(quantile: impl Fn(f64) -> f64) -> (f64, f64, f64) {
        (quantile(0.05), quantile(0.5), quantile(0.95))
    }
}

#[pymethods]
impl Verdict {
    /// The likeliest material, or None where it is likelier none of these.
    #[getter]
    fn material(&self) -> Option<&str> {
        self.verdict.material().map(|i| self.names[i].as_str())
    }

    /// The probability of each material by name.
    #[getter]
    fn probabilities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dictionary = PyDict::new(py);
        for (name, probability) in self.names.iter().zip(&self.verdict.probabilities) {
            dictionary.set_item(name, probability)?;
        }
        Ok(dictionary)
    }

    /// The probability that it is none of these.
    #[getter]
    fn none(&self) -> f64 {
        self.verdict.none
    }

    /// The roughness: 5 %, 50 % and 95 % quantiles.
    #[getter]
    fn sigma(&self) -> (f64, f64, f64) {
        Self::interval(|level| self.verdict.posterior.sigma_quantile(level))
    }

    /// The specular share, rho_s / (rho_s + rho_d): 5 %, 50 % and 95 % quantiles.
    #[getter]
    fn share(&self) -> (f64, f64, f64) {
        Self::interval(|level| self.verdict.posterior.share_quantile(level))
    }

    /// The posterior, (sigmas, shares): it sums to 1.
    #[getter]
    fn posterior<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let posterior = &self.verdict.posterior;
        let flat = PyArray1::from_slice(py, posterior.probabilities());
        flat.reshape([posterior.sigmas().len(), posterior.shares().len()])
    }

    /// The roughnesses of the posterior's rows.
    #[getter]
    fn sigmas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.verdict.posterior.sigmas())
    }

    /// The specular shares of the posterior's columns.
    #[getter]
    fn shares<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.verdict.posterior.shares())
    }

    /// Where the sphere was taken to be: x, y, radius.
    #[getter]
    fn circle(&self) -> (f64, f64, f64) {
        self.circle
    }

    /// The share of the sphere that is saturated.
    #[getter]
    fn saturated(&self) -> f64 {
        self.saturated
    }

    /// Whether it was judged without colour.
    #[getter]
    fn grey(&self) -> bool {
        self.grey
    }
}
