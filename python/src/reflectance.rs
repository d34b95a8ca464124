//! Ward's lobes, Lambert's, materials made of them, and fits.

use std::path::PathBuf;

use lobes::glam::DVec3;
use lobes::reflectance::fit::{self, Measurement, Widths};
use lobes::reflectance::recover::{self, KernelEstimate};
use lobes::reflectance::{self, IsotropicCoefficients, Variant, approximation};
use numpy::{PyArray1, PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{
    Directions, check_finite, check_room, doubles, leading, numbers, shape_name, shaped,
};
use crate::coefficients::Sets;
use crate::{error, interrupt, record};

/// A Ward lobe: its value times the light's cosine, at ρ_s = 1.
#[pyclass(frozen, eq, module = "lobes")]
#[derive(PartialEq)]
pub(crate) struct Lobe(reflectance::Ward);

/// The cosine of a view that a lobe is asked about.
fn check_cosine(cosine: f64) -> PyResult<()> {
    if cosine > reflectance::HORIZON && cosine <= 1.0 {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!(
            "the cosine of the view is {cosine}, which is not in (0, 1]"
        )))
    }
}

#[pymethods]
impl Lobe {
    /// One of the variants "ward1992", "duer", "gmd" and "sampled", with one width or with two,
    /// along the tangents +x and +y.
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

    /// Which of the four.
    #[getter]
    fn variant(&self) -> &'static str {
        self.0.variant().name()
    }

    /// The widths along the tangents +x and +y.
    #[getter]
    fn sigma(&self) -> (f64, f64) {
        self.0.sigma().into()
    }

    /// f · c_i for one view and many lights (…, 3), in the surface's frame; 0 below the horizon.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        view: &Bound<'py, PyAny>,
        lights: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let view = Directions::one(view, "the view")?;
        let lights = Directions::unit(lights, "the array of lights")?;
        let mut values = vec![0.0; lights.vectors.len()];
        py.detach(|| self.0.evaluate_batch(view, &lights.vectors, &mut values))
            .map_err(error)?;
        shaped(py, &lights.shape, values)
    }

    /// The density, per steradian, with which `sample` draws lights (…, 3) for one view.
    fn pdf<'py>(
        &self,
        py: Python<'py>,
        view: &Bound<'py, PyAny>,
        lights: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let view = Directions::one(view, "the view")?;
        let lights = Directions::unit(lights, "the array of lights")?;
        let densities = py.detach(|| {
            let lights = lights.vectors.iter();
            lights.map(|&light| self.0.pdf(view, light)).collect()
        });
        shaped(py, &lights.shape, densities)
    }

    /// Lights (…, 3) drawn for one view by Ward's half-vector sampler from numbers (…, 2) on [0,
    /// 1), and their weights f · c_i / pdf.
    ///
    /// The mean of weight times the light's radiance is what is reflected. A weight of 0 is a light
    /// below the horizon.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        view: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>)> {
        const WHAT: &str = "the array of random numbers";
        let view = Directions::one(view, "the view")?;
        let u = doubles(u, WHAT)?;
        let mut shape = leading(u.shape(), &[2], WHAT)?;
        let flat = u.as_slice()?;
        if let Some(index) = flat.iter().position(|value| !(0.0..1.0).contains(value)) {
            return Err(PyValueError::new_err(format!(
                "{WHAT} holds {}, which is not in [0, 1)",
                flat[index]
            )));
        }
        let (pairs, _) = flat.as_chunks::<2>();
        let samples: Vec<_> = py.detach(|| {
            pairs
                .iter()
                .map(|&pair| self.0.sample(view, pair))
                .collect()
        });
        let weights = samples.iter().map(|sample| sample.weight).collect();
        let weights = shaped(py, &shape, weights)?;
        shape.push(3);
        let lights = samples.iter().flat_map(|sample| sample.light.to_array());
        Ok((shaped(py, &shape, lights.collect())?, weights))
    }

    /// The share of light that is reflected, at the cosine of a view in the plane of the normal and
    /// the tangent +x.
    fn albedo(&self, view_cosine: f64) -> PyResult<f64> {
        check_cosine(view_cosine)?;
        Ok(self.0.albedo(view_cosine))
    }

    /// The share of light that is reflected towards any view, which matters to a lobe of two
    /// widths.
    fn albedo_from(&self, view: &Bound<'_, PyAny>) -> PyResult<f64> {
        Ok(self.0.albedo_from(Directions::one(view, "the view")?))
    }

    /// The share of `sample`'s draws, before any is drawn again, whose light is above the horizon.
    fn share_above_horizon(&self, view_cosine: f64) -> PyResult<f64> {
        check_cosine(view_cosine)?;
        Ok(self.0.share_above_horizon(view_cosine))
    }

    /// The zonal coefficients b_0 … b_degree about the mirror direction.
    fn zonal<'py>(
        &self,
        py: Python<'py>,
        view_cosine: f64,
        degree: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let lobe = self.0.clone();
        let zonal = interrupt::run(py, move || lobe.zonal(view_cosine, degree))?.map_err(error)?;
        Ok(PyArray1::from_vec(py, zonal))
    }

    /// b_0 … b_degree of normal incidence by a closed form, and bounds on their errors: "series",
    /// to σ⁴, or "gaussian", the paper's e^(−(σl)²).
    #[pyo3(signature = (degree, form="series"))]
    fn approximate<'py>(
        &self,
        py: Python<'py>,
        degree: usize,
        form: &str,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
        let at = match form {
            "series" => approximation::series,
            "gaussian" => approximation::gaussian,
            other => {
                return Err(PyValueError::new_err(format!(
                    "there is no closed form {other:?}; there are series and gaussian"
                )));
            }
        };
        let sigma = self.one_width()?;
        check_degree(degree, LARGEST)?;
        let all = (0..=degree)
            .map(|l| at(self.0.variant(), sigma, l))
            .collect::<lobes::Result<Vec<_>>>()
            .map_err(error)?;
        Ok((
            PyArray1::from_iter(py, all.iter().map(|one| one.value)),
            PyArray1::from_iter(py, all.iter().map(|one| one.bound)),
        ))
    }

    /// b_0 … b_degree at the cosine of a view by the form of two axes, and a bound on all their
    /// errors.
    fn approximate_oblique<'py>(
        &self,
        py: Python<'py>,
        view_cosine: f64,
        degree: usize,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, f64)> {
        let sigma = self.one_width()?;
        check_degree(degree, LARGEST_OBLIQUE)?;
        let oblique =
            approximation::oblique(self.0.variant(), sigma, view_cosine, degree).map_err(error)?;
        Ok((PyArray1::from_vec(py, oblique.values), oblique.bound))
    }

    /// The coefficients ρ̂_lpq over light and view, (light_degree + 1, view_degree + 1, orders), q
    /// = 0 … the smaller degree.
    fn isotropic_coefficients<'py>(
        &self,
        py: Python<'py>,
        light_degree: usize,
        view_degree: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let lobe = self.0.clone();
        let made = move || IsotropicCoefficients::new(&lobe, light_degree, view_degree);
        let coefficients = interrupt::run(py, made)?.map_err(error)?;
        let (lights, views) = (light_degree + 1, view_degree + 1);
        let orders = lights.min(views);
        let all = (0..lights * views * orders).map(|index| {
            let (l, p, q) = (
                index / orders / views,
                index / orders % views,
                index % orders,
            );
            coefficients.get(l, p, q as isize)
        });
        shaped(py, &[lights, views, orders], all.collect())
    }

    fn __repr__(&self) -> String {
        let [x, y] = self.0.sigma();
        if x == y {
            format!("Lobe({:?}, {x:?})", self.variant())
        } else {
            format!("Lobe({:?}, {x:?}, {y:?})", self.variant())
        }
    }

    fn __hash__(&self) -> u64 {
        let [x, y] = self.0.sigma();
        x.to_bits() ^ y.to_bits().rotate_left(17) ^ self.0.variant() as u64
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (&'static str, f64, f64)) {
        let [x, y] = slf.get().0.sigma();
        (slf.get_type().into_any(), (slf.get().variant(), x, y))
    }
}

impl Lobe {
    fn one_width(&self) -> PyResult<f64> {
        let [x, y] = self.0.sigma();
        if x == y {
            Ok(x)
        } else {
            Err(PyValueError::new_err(
                "a lobe of two widths has no closed form in frequency",
            ))
        }
    }
}

/// Degrees of closed forms, which have no largest one of their own.
fn check_degree(degree: usize, largest: usize) -> PyResult<()> {
    if degree <= largest {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!(
            "degree {degree} is beyond {largest}, the largest of this closed form"
        )))
    }
}

/// The largest degree of a closed form whose terms cost the same.
const LARGEST: usize = 1 << 20;

/// That of the form for a view at any angle, whose terms cost more as the degree grows.
const LARGEST_OBLIQUE: usize = 1 << 12;

/// Lambert's transfers Λ_l ρ̂_l, l = 0 … degree: π, 2π/3, π/4, 0, …
#[pyfunction]
pub(crate) fn lambert(py: Python<'_>, degree: usize) -> PyResult<Bound<'_, PyArray1<f64>>> {
    check_degree(degree, LARGEST)?;
    let transfers = reflectance::lambert::transfers(degree).map_err(error)?;
    Ok(PyArray1::from_vec(py, transfers))
}

/// A material: a Lambert body and a Ward lobe.
#[pyclass(frozen, eq, module = "lobes", from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Material(pub(crate) reflectance::Material);

#[pymethods]
impl Material {
    /// Radiance's plastic: a white highlight.
    #[staticmethod]
    fn plastic(
        name: &str,
        reflectance: &Bound<'_, PyAny>,
        specularity: f64,
        sigma: f64,
    ) -> PyResult<Self> {
        let reflectance = numbers(reflectance, "the reflectance")?;
        reflectance::Material::plastic(name, reflectance, specularity, sigma)
            .map(Self)
            .map_err(error)
    }

    /// Radiance's metal: a highlight of the metal's colour.
    #[staticmethod]
    fn metal(
        name: &str,
        reflectance: &Bound<'_, PyAny>,
        specularity: f64,
        sigma: f64,
    ) -> PyResult<Self> {
        let reflectance = numbers(reflectance, "the reflectance")?;
        reflectance::Material::metal(name, reflectance, specularity, sigma)
            .map(Self)
            .map_err(error)
    }

    /// Of given albedos, which may not add up to more than 1.
    #[staticmethod]
    fn from_albedos(
        name: &str,
        diffuse: &Bound<'_, PyAny>,
        specular: &Bound<'_, PyAny>,
        sigma: f64,
    ) -> PyResult<Self> {
        let (diffuse, specular) = (
            numbers(diffuse, "the diffuse albedo")?,
            numbers(specular, "the specular albedo")?,
        );
        reflectance::Material::from_albedos(name, diffuse, specular, sigma)
            .map(Self)
            .map_err(error)
    }

    /// Of given albedos, each of at most 1, whatever they add up to.
    #[staticmethod]
    fn from_albedos_gaining_energy(
        name: &str,
        diffuse: &Bound<'_, PyAny>,
        specular: &Bound<'_, PyAny>,
        sigma: f64,
    ) -> PyResult<Self> {
        let (diffuse, specular) = (
            numbers(diffuse, "the diffuse albedo")?,
            numbers(specular, "the specular albedo")?,
        );
        reflectance::Material::from_albedos_gaining_energy(name, diffuse, specular, sigma)
            .map(Self)
            .map_err(error)
    }

    /// Lambert's white sphere, of albedo 1.
    #[staticmethod]
    fn white() -> Self {
        Self(reflectance::Material::white())
    }

    /// The name.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// ρ_d of red, green and blue.
    #[getter]
    fn diffuse(&self) -> (f64, f64, f64) {
        self.0.diffuse().into()
    }

    /// ρ_s of red, green and blue.
    #[getter]
    fn specular(&self) -> (f64, f64, f64) {
        self.0.specular().into()
    }

    /// The roughness σ; 0 for a mirror.
    #[getter]
    fn sigma(&self) -> f64 {
        self.0.roughness().sigma()
    }

    /// The lobe at ρ_s = 1; None for a matte material or a mirror.
    #[pyo3(signature = (variant="sampled"))]
    fn lobe(&self, variant: &str) -> PyResult<Option<Lobe>> {
        let variant: Variant = variant.parse().map_err(error)?;
        Ok(self.0.lobe(variant).map(Lobe))
    }

    fn __repr__(&self) -> String {
        format!(
            "Material({:?}, diffuse={:?}, specular={:?}, sigma={:?})",
            self.name(),
            self.diffuse(),
            self.specular(),
            self.sigma()
        )
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        self.name().hash(&mut hasher);
        let numbers = [self.0.diffuse(), self.0.specular()];
        for value in numbers.as_flattened().iter().chain([&self.sigma()]) {
            // 0 and −0 are equal.
            (value + 0.0).to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let this = slf.get();
        let arguments = (this.name(), this.diffuse(), this.specular(), this.sigma());
        Ok((
            slf.get_type().getattr("from_albedos_gaining_energy")?,
            arguments.into_pyobject(slf.py())?,
        ))
    }
}

/// The eight materials that come with the crate.
#[pyfunction]
pub(crate) fn presets() -> Vec<Material> {
    reflectance::presets().into_iter().map(Material).collect()
}

/// Fits a lobe and a Lambert body to measured values of a BRDF by least squares.
#[pyfunction]
#[pyo3(signature = (lights, views, values, weights=None, variant="sampled", widths=1))]
pub(crate) fn fit_lobe<'py>(
    py: Python<'py>,
    lights: &Bound<'py, PyAny>,
    views: &Bound<'py, PyAny>,
    values: &Bound<'py, PyAny>,
    weights: Option<&Bound<'py, PyAny>>,
    variant: &str,
    widths: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let variant: Variant = variant.parse().map_err(error)?;
    let widths = match widths {
        1 => Widths::One,
        2 => Widths::Two,
        other => {
            return Err(PyValueError::new_err(format!(
                "widths is {other}, which is neither 1 nor 2"
            )));
        }
    };
    let lights = Directions::unit(lights, "the array of lights")?;
    let views = Directions::unit(views, "the array of views")?;
    let values = doubles(values, "the array of values")?;
    let weights = weights
        .map(|weights| doubles(weights, "the array of weights"))
        .transpose()?;
    let count = lights.vectors.len();
    for (what, length) in [
        ("the array of views", views.vectors.len()),
        ("the array of values", values.len()),
        (
            "the array of weights",
            weights.as_ref().map_or(count, |all| all.len()),
        ),
    ] {
        if length != count {
            return Err(PyValueError::new_err(format!(
                "{what} has {length} entries, and there are {count} lights"
            )));
        }
    }
    let weights = weights.as_ref().map(|all| all.as_slice()).transpose()?;
    let measurements: Vec<_> = lights
        .vectors
        .iter()
        .zip(&views.vectors)
        .zip(values.as_slice()?)
        .enumerate()
        .map(|(index, ((&light, &view), &value))| Measurement {
            light,
            view,
            value,
            weight: weights.map_or(1.0, |all| all[index]),
        })
        .collect();
    let found =
        interrupt::run(py, move || fit::fit(&measurements, variant, widths))?.map_err(error)?;
    let estimate = |of: fit::Estimate| record(py, "Estimate", (of.value, of.standard_error));
    let [x, y] = found.sigma;
    record(
        py,
        "Fit",
        (
            found.variant.name(),
            estimate(found.diffuse)?,
            estimate(found.specular)?,
            (estimate(x)?, estimate(y)?),
            found.residual,
            found.measurements,
            found.steps,
        ),
    )
}

/// Measurements as arrays.
fn measurements<'py>(py: Python<'py>, all: &[Measurement]) -> PyResult<Bound<'py, PyAny>> {
    let vectors = |of: fn(&Measurement) -> DVec3| {
        let flat = all.iter().flat_map(|one| of(one).to_array());
        shaped(py, &[all.len(), 3], flat.collect())
    };
    record(
        py,
        "Measurements",
        (
            vectors(|one| one.light)?,
            vectors(|one| one.view)?,
            PyArray1::from_iter(py, all.iter().map(|one| one.value)),
            PyArray1::from_iter(py, all.iter().map(|one| one.weight)),
        ),
    )
}

/// Reads a table of comma-separated theta_i, phi_i, theta_o, phi_o, value, with angles in degrees.
#[pyfunction]
pub(crate) fn read_csv(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let all = interrupt::run(py, move || fit::read_csv(&path))?.map_err(error)?;
    measurements(py, &all)
}

/// Reads one channel (0 red, 1 green, 2 blue) of a file of the MERL database.
#[pyfunction]
#[pyo3(signature = (path, channel))]
pub(crate) fn read_merl(
    py: Python<'_>,
    path: PathBuf,
    channel: usize,
) -> PyResult<Bound<'_, PyAny>> {
    let all = interrupt::run(py, move || fit::read_merl(&path, channel))?.map_err(error)?;
    measurements(py, &all)
}

/// The kernel k_l, l = 0 … degree, that takes the coefficients of light to those of what it is
/// reflected as, and its standard errors.
#[pyfunction]
pub(crate) fn recover_kernel<'py>(
    py: Python<'py>,
    light: &Bound<'py, PyAny>,
    reflected: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let light = Sets::of(light, "the light")?;
    let shape = (light.degree, light.orders);
    let reflected = Sets::with_shape(reflected, "what is reflected", Some(shape))?;
    let (light, reflected) = (light.one("the light")?, reflected.one("what is reflected")?);
    let kernel = recover::recover_kernel(&light, &reflected).map_err(error)?;
    let values: Vec<_> = kernel.iter().map(|one| one.value).collect();
    crate::arrays::check_result(&values, "the kernel at a degree")?;
    Ok((
        PyArray1::from_vec(py, values),
        PyArray1::from_iter(py, kernel.iter().map(|one| one.standard_error)),
    ))
}

/// Fits k_l = ρ_d A_l/π + ρ_s b_l(σ) to a kernel and its standard errors.
#[pyfunction]
#[pyo3(signature = (kernel, standard_errors, variant="sampled"))]
pub(crate) fn recover_lobe<'py>(
    py: Python<'py>,
    kernel: &Bound<'py, PyAny>,
    standard_errors: &Bound<'py, PyAny>,
    variant: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let variant: Variant = variant.parse().map_err(error)?;
    let values = doubles(kernel, "the kernel")?;
    let errors = doubles(standard_errors, "the array of standard errors")?;
    if values.ndim() != 1 || values.shape() != errors.shape() {
        return Err(PyValueError::new_err(format!(
            "the kernel has the shape {} and its standard errors {}; one number a degree is needed in each",
            shape_name(values.shape()),
            shape_name(errors.shape())
        )));
    }
    check_finite(values.as_slice()?, "the kernel")?;
    if let Some(&value) = errors.as_slice()?.iter().find(|value| !(**value >= 0.0)) {
        return Err(PyValueError::new_err(format!(
            "a standard error is {value}, which is not 0 or above"
        )));
    }
    let kernel: Vec<_> = values
        .as_slice()?
        .iter()
        .zip(errors.as_slice()?)
        .map(|(&value, &standard_error)| KernelEstimate {
            value,
            standard_error,
        })
        .collect();
    check_room(kernel.len(), "the kernel")?;
    let found =
        interrupt::run(py, move || recover::recover_lobe(&kernel, variant))?.map_err(error)?;
    let estimate = |[value, error]: [f64; 2]| record(py, "Estimate", (value, error));
    record(
        py,
        "Recovered",
        (
            estimate(found.diffuse)?,
            estimate(found.specular)?,
            estimate(found.sigma)?,
        ),
    )
}
