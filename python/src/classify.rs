//! The reading of one picture.

use std::path::PathBuf;
use std::sync::Arc;

use lobes::features::{Seen, ShadingOutliers};
use lobes::inference::{self, Dataset, Observation, Reflectance, Sample, TrainingPlan};
use lobes::picture::{self, Circle, Sphere};
use lobes::reflectance::{Finish, Variant};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{Pixels, Two, check_finite, mask_of, numbers, shaped, type_name};
use crate::illumination::EnvironmentMap;
use crate::reflectance::Material;
use crate::{error, interrupt, is_record, parallelism, record};

/// The most cameras for each light: more are not told apart.
const MOST_CAMERAS: usize = 4096;

/// The most rows of a map of light.
const MOST_ROWS: usize = 1024;

/// A picture that a sphere is in.
///
/// Parameters
/// ----------
/// pixels : Rendering or array_like, (rows, columns, 3)
///     Linear radiance, or sRGB codes: uint8, uint16, or numbers on [0, 1] where `encoded` says so.
///     A `Rendering` brings its mask with it.
/// encoded : bool, optional
///     Whether these are codes; the type of the array tells unless it is given.
/// mask : array_like, (rows, columns), optional
///     Booleans, uint8 or numbers on [0, 1]: which pixels are of the sphere. What the others hold
///     does not matter.
/// focal_length : float, optional
///     In pixels: it tells how far the camera is.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> lobes.Picture(np.zeros((40, 60, 3), "uint8"))
/// <Picture of 40 × 60 pixels, sRGB codes>
#[pyclass(frozen, eq, module = "lobes")]
#[derive(PartialEq)]
pub(crate) struct Picture(pub(crate) Arc<picture::Picture>);

#[pymethods]
impl Picture {
    #[new]
    #[pyo3(signature = (pixels, encoded=None, mask=None, focal_length=None))]
    fn new(
        pixels: &Bound<'_, PyAny>,
        encoded: Option<bool>,
        mask: Option<&Bound<'_, PyAny>>,
        focal_length: Option<f64>,
    ) -> PyResult<Self> {
        let own = if is_record(pixels, "Rendering")? {
            Some(pixels.getattr("mask")?)
        } else {
            None
        };
        let name = type_name(pixels)?;
        let scale = match name.as_str() {
            "uint8" => Some(255.0),
            "uint16" => Some(65_535.0),
            _ => None,
        };
        let encoded = encoded.unwrap_or(scale.is_some());
        let Pixels {
            rows,
            columns,
            mut values,
        } = Pixels::of(pixels, "the picture")?;
        let mask = mask_of(mask.or(own.as_ref()), rows, columns)?;
        if let Some(mask) = &mask {
            for (pixel, part) in values.iter_mut().zip(mask) {
                if *part == 0.0 {
                    *pixel = [0.0; 3];
                }
            }
        }
        check_finite(values.as_flattened(), "the picture")?;
        let mut picture = if encoded {
            let scale = scale.unwrap_or(1.0);
            let codes: Vec<_> = values.iter().map(|rgb| rgb.map(|code| code / scale)).collect();
            let wrong = |value: &&f64| !(0.0..=1.0).contains(*value);
            if let Some(value) = codes.as_flattened().iter().find(wrong) {
                return Err(PyValueError::new_err(format!(
                    "the picture holds the code {value}, and codes of the type {name} are on [0, 1]; give uint8, uint16 or fractions"
                )));
            }
            picture::Picture::encoded(columns, rows, codes)
        } else {
            picture::Picture::linear(columns, rows, values)
        }
        .map_err(error)?;
        if let Some(mask) = mask {
            picture = picture.with_mask(mask).map_err(error)?;
        }
        if let Some(pixels) = focal_length {
            picture = picture.with_focal_length(pixels).map_err(error)?;
        }
        Ok(Self(Arc::new(picture)))
    }

    /// Reads a PNG, JPEG, WebP or TIFF, as sRGB unless it says otherwise, or a linear OpenEXR,
    /// Radiance or PFM file; an alpha channel is the mask.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    ///
    /// Returns
    /// -------
    /// Picture
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np, tempfile
    /// >>> with tempfile.TemporaryDirectory() as folder:
    /// ...     lobes.write_png(f"{folder}/grey.png", np.full((40, 60, 3), 0.25))
    /// ...     lobes.Picture.read(f"{folder}/grey.png")
    /// <Picture of 40 × 60 pixels, sRGB codes>
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        interrupt::run(py, move || picture::Picture::read(&path))?
            .map(|picture| Self(Arc::new(picture)))
            .map_err(error)
    }

    /// Linear radiance, (rows, columns, 3).
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let flat = self.0.radiance().flatten().collect();
        shaped(py, &[self.0.height(), self.0.width(), 3], flat)
    }

    /// How much of each pixel the mask leaves, (rows, columns); None where it leaves everything.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let shape = [self.0.height(), self.0.width()];
        self.0
            .mask()
            .map(|mask| {
                let mask = mask.iter().map(|part| f64::from(*part)).collect();
                shaped(py, &shape, mask)
            })
            .transpose()
    }

    /// Whether it came as sRGB codes, which saturate.
    #[getter]
    fn encoded(&self) -> bool {
        self.0.is_encoded()
    }

    /// The focal length in pixels, where it is known.
    #[getter]
    fn focal_length(&self) -> Option<f64> {
        self.0.focal_length()
    }

    /// Where the sphere is: by the mask, else found.
    ///
    /// Returns
    /// -------
    /// x, y, radius : float
    ///     In pixels from the left and the top.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> white = lobes.EnvironmentMap(np.ones((16, 32, 3)))
    /// >>> sphere = lobes.Renderer(white).render(lobes.Material.white(), size=40)
    /// >>> np.allclose(lobes.Picture(sphere).circle(), 20, atol=0.1)
    /// True
    fn circle(&self, py: Python<'_>) -> PyResult<(f64, f64, f64)> {
        let picture = Arc::clone(&self.0);
        let Circle { x, y, radius } =
            interrupt::run(py, move || picture.circle())?.map_err(error)?;
        Ok((x, y, radius))
    }

    fn _repr_png_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let show = py.import("lobes._show")?;
        show.call_method1("png", (this.pixels(py)?, this.mask(py)?))
    }

    fn __repr__(&self) -> String {
        let (rows, columns) = (self.0.height(), self.0.width());
        let kind = if self.0.is_encoded() {
            "sRGB codes"
        } else {
            "linear radiance"
        };
        let mask = if self.0.has_mask() {
            " with a mask"
        } else {
            ""
        };
        format!("<Picture of {rows} × {columns} pixels, {kind}{mask}>")
    }

    fn __hash__(&self) -> u64 {
        ((self.0.height() as u64) << 32) ^ self.0.width() as u64
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let arguments = (
            this.pixels(py)?,
            this.encoded(),
            this.mask(py)?,
            this.focal_length(),
        );
        Ok((
            slf.get_type().getattr("_from_radiance")?,
            arguments.into_pyobject(py)?,
        ))
    }

    /// What `pickle` puts together again: radiance, whether it came as codes or not.
    #[staticmethod]
    fn _from_radiance(
        pixels: &Bound<'_, PyAny>,
        encoded: bool,
        mask: Option<&Bound<'_, PyAny>>,
        focal_length: Option<f64>,
    ) -> PyResult<Self> {
        let Pixels {
            rows,
            columns,
            values,
        } = Pixels::of(pixels, "the picture")?;
        let mut picture = picture::Picture::linear(columns, rows, values).map_err(error)?;
        if encoded {
            picture = picture.as_encoded();
        }
        if let Some(mask) = mask_of(mask, rows, columns)? {
            picture = picture.with_mask(mask).map_err(error)?;
        }
        if let Some(pixels) = focal_length {
            picture = picture.with_focal_length(pixels).map_err(error)?;
        }
        Ok(Self(Arc::new(picture)))
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

/// What a model learns from: spheres of the materials and of random reflectances, rendered under
/// the lights and read as a camera may leave them.
///
/// With all lights it takes about a minute to make; it can be pickled.
///
/// Parameters
/// ----------
/// lights : sequence of EnvironmentMap
/// materials : sequence of Material, optional
///     The eight presets unless given.
/// variant : str
///     "ward1992", "duer", "gmd" or "sampled".
/// cameras : int, optional
///     About each light.
/// threads : bool
///     Whether all cores work; the answer is the same.
/// progress : callable, optional
///     Called as progress(done, total) while the work goes on.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.Training(lobes.builtin()[:2], lobes.presets()[:2], cameras=1)
/// <Training of 2 materials under 2 lights: 8 pictures and 48 of random reflectances>
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Training(Arc<inference::Training>);

#[pymethods]
impl Training {
    #[new]
    #[pyo3(signature = (lights, materials=None, variant="sampled", cameras=None, threads=true, progress=None))]
    fn new(
        py: Python<'_>,
        lights: Vec<EnvironmentMap>,
        materials: Option<Vec<Material>>,
        variant: &str,
        cameras: Option<usize>,
        threads: bool,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let variant: Variant = variant.parse().map_err(error)?;
        let mut plan = TrainingPlan::default();
        plan.plan.lobe = variant;
        if let Some(cameras) = cameras {
            if !(1..=MOST_CAMERAS).contains(&cameras) {
                return Err(PyValueError::new_err(format!(
                    "the number of cameras is {cameras}, which is not from 1 to {MOST_CAMERAS}"
                )));
            }
            plan.plan.turns = cameras;
        }
        // Each light is done twice: with the materials, and with random reflectances.
        let callback = progress.map(|progress| (progress, 2 * lights.len()));
        let training = interrupt::run_with_progress(py, callback, move |progress| {
            let lights: Vec<_> = lights.iter().map(|light| (*light.0).clone()).collect();
            let materials = match materials {
                Some(materials) => materials.into_iter().map(|material| material.0).collect(),
                None => lobes::reflectance::presets(),
            };
            let done = || progress.step();
            inference::Training::new(&lights, &materials, &plan, parallelism(threads), &done)
        })?
        .map_err(error)?;
        Ok(Self(Arc::new(training)))
    }

    /// The materials' names.
    #[getter]
    fn materials(&self) -> Vec<String> {
        self.0.named.materials.clone()
    }

    /// The lights' names.
    #[getter]
    fn lights(&self) -> Vec<String> {
        self.0.named.illuminations.clone()
    }

    fn __repr__(&self) -> String {
        format!(
            "<Training of {} materials under {} lights: {} pictures and {} of random reflectances>",
            self.0.named.materials.len(),
            self.0.named.illuminations.len(),
            self.0.named.observations.len(),
            self.0.random.len()
        )
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
        Ok(Self(Arc::new(inference::Training {
            named: Dataset {
                materials,
                illuminations,
                scenes: Default::default(),
                observations,
                render_error,
            },
            random,
        })))
    }
}

/// A classifier that has learned.
///
/// Parameters
/// ----------
/// training : Training
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> training = lobes.Training(lobes.builtin()[:2], lobes.presets()[:2], cameras=2)
/// >>> lobes.Model(training).materials
/// ['brown matte', 'white matte']
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Model(Arc<inference::Model>);

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (training, threads=true))]
    fn new(py: Python<'_>, training: &Bound<'_, Training>, threads: bool) -> PyResult<Self> {
        let training = Arc::clone(&training.get().0);
        interrupt::run(py, move || {
            inference::Model::learn(&training, parallelism(threads))
        })?
        .map(|model| Self(Arc::new(model)))
        .map_err(error)
    }

    /// The materials' names.
    #[getter]
    fn materials(&self) -> Vec<String> {
        self.0.materials().to_vec()
    }

    /// What the model says of the sphere in a picture.
    ///
    /// Parameters
    /// ----------
    /// picture : Picture
    /// circle : array_like, (3,), optional
    ///     x, y and radius of the sphere in pixels; where `Picture.circle` finds it unless given.
    ///
    /// Returns
    /// -------
    /// Verdict
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lights, materials = lobes.builtin(), lobes.presets()
    /// >>> model = lobes.Model(lobes.Training(lights[:2], [materials[0], materials[7]], cameras=2))
    /// >>> picture = lobes.Picture(lobes.Renderer(lights[3]).render(materials[7]))
    /// >>> sorted(model.read(picture).probabilities)
    /// ['brown matte', 'silver']
    #[pyo3(signature = (picture, circle=None))]
    fn read<'py>(
        &self,
        py: Python<'py>,
        picture: &Bound<'py, Picture>,
        circle: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (model, picture) = (Arc::clone(&self.0), Arc::clone(&picture.get().0));
        let circle = circle
            .map(|circle| numbers(circle, "the circle"))
            .transpose()?;
        let (circle, saturated, grey, verdict) = interrupt::run(py, move || {
            let circle = match circle {
                Some([x, y, radius]) => Circle { x, y, radius },
                None => picture.circle()?,
            };
            let sphere = picture.sphere(circle)?;
            let verdict = model.read(&sphere)?;
            lobes::Result::Ok((circle, sphere.saturated, sphere.is_grey(), verdict))
        })?
        .map_err(error)?;
        let probabilities = PyDict::new(py);
        for (name, probability) in self.0.materials().iter().zip(&verdict.probabilities) {
            probabilities.set_item(name, probability)?;
        }
        let posterior = &verdict.posterior;
        let (sigmas, shares) = (posterior.sigmas(), posterior.shares());
        // The ends and the middle of a 90 % interval.
        let interval =
            |quantile: &dyn Fn(f64) -> f64| (quantile(0.05), quantile(0.5), quantile(0.95));
        record(
            py,
            "Verdict",
            (
                verdict.material().map(|i| &self.0.materials()[i]),
                probabilities,
                verdict.none,
                interval(&|level| posterior.sigma_quantile(level)),
                interval(&|level| posterior.share_quantile(level)),
                shaped(
                    py,
                    &[sigmas.len(), shares.len()],
                    posterior.probabilities().to_vec(),
                )?,
                PyArray1::from_slice(py, sigmas),
                PyArray1::from_slice(py, shares),
                (circle.x, circle.y, circle.radius),
                saturated,
                grey,
            ),
        )
    }

    fn __repr__(&self) -> String {
        format!("<Model of {} materials>", self.0.materials().len())
    }
}

/// What tells the finish of a ball off a photograph, whatever its colour; nothing has to be
/// learned.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> reader = lobes.FinishReader()
/// >>> picture = lobes.Picture(lobes.Renderer(lobes.builtin()[5]).render(lobes.presets()[7]))
/// >>> reader.read(picture).finish
/// 'smooth metal'
#[pyclass(frozen, module = "lobes")]
pub(crate) struct FinishReader(
    Arc<(
        inference::PortraitReader,
        inference::FinishModel,
        ShadingOutliers,
    )>,
);

#[pymethods]
impl FinishReader {
    #[new]
    fn new() -> PyResult<Self> {
        let reader = inference::PortraitReader::new().map_err(error)?;
        let model = inference::FinishModel::builtin().map_err(error)?;
        let outliers = ShadingOutliers::new(Sphere::SIZE).map_err(error)?;
        Ok(Self(Arc::new((reader, model, outliers))))
    }

    /// What is said of the ball in a picture.
    ///
    /// Parameters
    /// ----------
    /// picture : Picture
    /// circle : array_like, (3,), optional
    ///     x, y and radius of the ball in pixels; where `Picture.circle` finds it unless given.
    ///
    /// Returns
    /// -------
    /// FinishVerdict
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> picture = lobes.Picture(lobes.Renderer(lobes.builtin()[5]).render(lobes.presets()[7]))
    /// >>> verdict = lobes.FinishReader().read(picture)
    /// >>> round(sum(verdict.finishes.values()) + verdict.no_single_finish, 9)
    /// 1.0
    #[pyo3(signature = (picture, circle=None))]
    fn read<'py>(
        &self,
        py: Python<'py>,
        picture: &Bound<'py, Picture>,
        circle: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (both, picture) = (Arc::clone(&self.0), Arc::clone(&picture.get().0));
        let circle = circle
            .map(|circle| numbers(circle, "the circle"))
            .transpose()?;
        let (circle, saturated, seen, verdict) = interrupt::run(py, move || {
            let (reader, model, outliers) = &*both;
            let circle = match circle {
                Some([x, y, radius]) => Circle { x, y, radius },
                None => picture.circle()?,
            };
            let sphere = picture.sphere(circle)?;
            let portrait = reader.of_sphere(&picture, circle, &sphere)?;
            let seen = outliers.of(&sphere.image, sphere.ceiling)?;
            let verdict = model.verdict(&portrait)?;
            lobes::Result::Ok((circle, portrait.saturated(), seen, verdict))
        })?
        .map_err(error)?;
        let finishes = PyDict::new(py);
        for (finish, probability) in Finish::ALL.iter().zip(verdict.finishes) {
            finishes.set_item(finish.name(), probability)?;
        }
        let interval = |posterior: &inference::Binned| {
            let [low, middle, high] = posterior.interval(0.9);
            (low, middle, high)
        };
        let base = verdict.base_colour();
        let colour: Vec<(f64, f64, f64)> = verdict
            .base_colour_interval()
            .iter()
            .zip(base)
            .map(|([low, high], middle)| (*low, middle, *high))
            .collect();
        record(
            py,
            "FinishVerdict",
            (
                verdict.finish().map(Finish::name),
                finishes,
                verdict.none,
                interval(&verdict.sigma),
                interval(&verdict.share),
                (colour[0], colour[1], colour[2]),
                verdict.metallic(),
                (circle.x, circle.y, circle.radius),
                saturated,
                seen.usable(),
                seen.share(Seen::Print),
            ),
        )
    }

    /// The light about the ball and its standard deviation, in the camera's frame: it stands
    /// towards +z, +y is up, and the centre column looks along −z.
    ///
    /// It is averaged over what the ball may be made of, given the likeliest finish that `read` says
    /// of it, and its deviation holds what is not known of that; up to the exposure. The mean swings
    /// below 0 about lamps.
    ///
    /// Parameters
    /// ----------
    /// picture : Picture
    /// circle : array_like, (3,), optional
    ///     x, y and radius of the ball in pixels; where `Picture.circle` finds it unless given.
    /// rows : int
    ///     From 2 to 1024.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// mean, deviation : ndarray, (rows, 2 rows, 3)
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> light = lobes.builtin()[5].resampled(32)
    /// >>> picture = lobes.Picture(lobes.Renderer(light).render(lobes.presets()[7], size=64))
    /// >>> mean, deviation = lobes.FinishReader().light(picture, rows=16)
    /// >>> mean.shape, deviation.shape
    /// ((16, 32, 3), (16, 32, 3))
    #[pyo3(signature = (picture, circle=None, rows=128, threads=true))]
    fn light<'py>(
        &self,
        py: Python<'py>,
        picture: &Bound<'py, Picture>,
        circle: Option<&Bound<'py, PyAny>>,
        rows: usize,
        threads: bool,
    ) -> PyResult<Two<'py>> {
        if !(2..=MOST_ROWS).contains(&rows) {
            return Err(PyValueError::new_err(format!(
                "the number of rows is {rows}, which is not from 2 to {MOST_ROWS}"
            )));
        }
        let (both, picture) = (Arc::clone(&self.0), Arc::clone(&picture.get().0));
        let circle = circle
            .map(|circle| numbers(circle, "the circle"))
            .transpose()?;
        let (mean, deviation) = interrupt::run(py, move || {
            let (reader, model, _) = &*both;
            let circle = match circle {
                Some([x, y, radius]) => Circle { x, y, radius },
                None => picture.circle()?,
            };
            let sphere = picture.sphere(circle)?;
            let verdict = model.verdict(&reader.of_sphere(&picture, circle, &sphere)?)?;
            let quantity = inference::LightQuantity::Radiance;
            let light = inference::BallLightReader::of_image(&sphere.image, quantity)?;
            let possible = verdict.possible_reflectances();
            let light = light.read(&sphere.image, &possible, parallelism(threads))?;
            light.lat_long(rows)
        })?
        .map_err(error)?;
        let shape = [rows, 2 * rows, 3];
        Ok((
            shaped(py, &shape, mean.into_flattened())?,
            shaped(py, &shape, deviation.into_flattened())?,
        ))
    }

    fn __repr__(&self) -> String {
        "<FinishReader>".into()
    }
}
