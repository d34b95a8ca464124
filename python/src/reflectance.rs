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
    Directions, Two, TwoColumns, check_finite, check_room, doubles, leading, numbers, shape_name,
    shaped,
};
use crate::coefficients::Sets;
use crate::{error, interrupt, record};

/// A Ward lobe: its value times the light's cosine, at ρ_s = 1, in the surface's frame, whose
/// normal is +z.
///
/// Parameters
/// ----------
/// variant : str
///     "ward1992", "duer", "gmd" or "sampled".
/// sigma_x : float
///     The width along the tangent +x.
/// sigma_y : float, optional
///     The width along +y, that of +x unless given.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.Lobe("gmd", 0.1, 0.3)
/// Lobe("gmd", 0.1, 0.3)
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

    /// The lobe times the cosine of the light, f · c_i.
    ///
    /// Parameters
    /// ----------
    /// view : array_like, (3,)
    ///     Of unit length.
    /// lights : array_like, (…, 3)
    ///     Of unit length.
    ///
    /// Returns
    /// -------
    /// ndarray, (…)
    ///     Per steradian; 0 below the horizon.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> peak = lobes.Lobe("sampled", 0.2).evaluate([0, 0, 1], [[0, 0, 1], [0, 0, -1]])
    /// >>> np.allclose(peak, [1 / (4 * np.pi * 0.2**2), 0])
    /// True
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

    /// The density with which `sample` draws lights.
    ///
    /// Parameters
    /// ----------
    /// view : array_like, (3,)
    ///     Of unit length.
    /// lights : array_like, (…, 3)
    ///     Of unit length.
    ///
    /// Returns
    /// -------
    /// ndarray, (…)
    ///     Per steradian.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> lobe = lobes.Lobe("sampled", 0.2)
    /// >>> lights, weights = lobe.sample([0, 0, 1], [[0.2, 0.5], [0.7, 0.1]])
    /// >>> f = lobe.evaluate([0, 0, 1], lights)
    /// >>> np.allclose(f, weights * lobe.pdf([0, 0, 1], lights))
    /// True
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

    /// Lights drawn for one view by Ward's half-vector sampler.
    ///
    /// The mean of weight times the light's radiance is what is reflected. A weight of 0 is a light
    /// below the horizon.
    ///
    /// Parameters
    /// ----------
    /// view : array_like, (3,)
    ///     Of unit length.
    /// u : array_like, (…, 2)
    ///     Random numbers on [0, 1).
    ///
    /// Returns
    /// -------
    /// lights : ndarray, (…, 3)
    /// weights : ndarray, (…)
    ///     f · c_i / pdf.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> lobe, view = lobes.Lobe("sampled", 0.2), [0.6, 0.0, 0.8]
    /// >>> lights, weights = lobe.sample(view, np.random.default_rng(1).random((10000, 2)))
    /// >>> bool(abs(weights.mean() - lobe.albedo(0.8)) < 0.01)
    /// True
    fn sample<'py>(
        &self,
        py: Python<'py>,
        view: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Two<'py>> {
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

    /// The share of light that is reflected towards a view in the plane of the normal and the
    /// tangent +x.
    ///
    /// Parameters
    /// ----------
    /// view_cosine : float
    ///     Of the angle from the normal, in (0, 1].
    ///
    /// Returns
    /// -------
    /// float
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> 0.9 < lobes.Lobe("sampled", 0.1).albedo(1.0) <= 1
    /// True
    fn albedo(&self, view_cosine: f64) -> PyResult<f64> {
        check_cosine(view_cosine)?;
        Ok(self.0.albedo(view_cosine))
    }

    /// The share of light that is reflected towards any view, which matters to a lobe of two
    /// widths.
    ///
    /// Parameters
    /// ----------
    /// view : array_like, (3,)
    ///     Of unit length.
    ///
    /// Returns
    /// -------
    /// float
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobe = lobes.Lobe("gmd", 0.1, 0.4)
    /// >>> lobe.albedo_from([0.6, 0.0, 0.8]) != lobe.albedo_from([0.0, 0.6, 0.8])
    /// True
    fn albedo_from(&self, view: &Bound<'_, PyAny>) -> PyResult<f64> {
        Ok(self.0.albedo_from(Directions::one(view, "the view")?))
    }

    /// The share of `sample`'s draws, before any is drawn again, whose light is above the horizon.
    ///
    /// Parameters
    /// ----------
    /// view_cosine : float
    ///     Of the angle from the normal, in (0, 1].
    ///
    /// Returns
    /// -------
    /// float
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> 0.99 < lobes.Lobe("sampled", 0.1).share_above_horizon(0.8) <= 1
    /// True
    fn share_above_horizon(&self, view_cosine: f64) -> PyResult<f64> {
        check_cosine(view_cosine)?;
        Ok(self.0.share_above_horizon(view_cosine))
    }

    /// The zonal coefficients b_0 … b_degree about the mirror direction.
    ///
    /// Parameters
    /// ----------
    /// view_cosine : float
    ///     Of the angle from the normal, in (0, 1].
    /// degree : int
    ///
    /// Returns
    /// -------
    /// ndarray, (degree + 1,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> lobe = lobes.Lobe("sampled", 0.1)
    /// >>> b = lobe.zonal(1.0, 8)
    /// >>> bool(np.isclose(b[0], lobe.albedo(1.0)) and (np.diff(b) < 0).all())
    /// True
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

    /// b_0 … b_degree of normal incidence by a closed form, and bounds on their errors.
    ///
    /// Parameters
    /// ----------
    /// degree : int
    /// form : str
    ///     "series", to σ⁴, or "gaussian", the paper's e^(−(σl)²).
    ///
    /// Returns
    /// -------
    /// values, bounds : ndarray, (degree + 1,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> lobe = lobes.Lobe("sampled", 0.05)
    /// >>> values, bounds = lobe.approximate(16)
    /// >>> bool((np.abs(values - lobe.zonal(1.0, 16)) <= bounds).all())
    /// True
    #[pyo3(signature = (degree, form="series"))]
    fn approximate<'py>(
        &self,
        py: Python<'py>,
        degree: usize,
        form: &str,
    ) -> PyResult<TwoColumns<'py>> {
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

    /// b_0 … b_degree of any view by the form of two axes, and a bound on all their errors.
    ///
    /// Parameters
    /// ----------
    /// view_cosine : float
    ///     Of the angle from the normal, in (0, 1].
    /// degree : int
    ///     At most 4096.
    ///
    /// Returns
    /// -------
    /// values : ndarray, (degree + 1,)
    /// bound : float
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> lobe = lobes.Lobe("sampled", 0.05)
    /// >>> values, bound = lobe.approximate_oblique(0.8, 16)
    /// >>> bool(np.abs(values - lobe.zonal(0.8, 16)).max() <= bound)
    /// True
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

    /// The coefficients ρ̂_lpq over light and view.
    ///
    /// Parameters
    /// ----------
    /// light_degree : int
    /// view_degree : int
    ///
    /// Returns
    /// -------
    /// ndarray, (light_degree + 1, view_degree + 1, orders)
    ///     At [l, p, q], q = 0 … the smaller degree.
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Lobe("gmd", 0.3).isotropic_coefficients(2, 3).shape
    /// (3, 4, 3)
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

/// Lambert's transfers Λ_l ρ̂_l: π, 2π/3, π/4, 0, …
///
/// Parameters
/// ----------
/// degree : int
///     The last.
///
/// Returns
/// -------
/// ndarray, (degree + 1,)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> np.allclose(lobes.lambert(3), [np.pi, 2 * np.pi / 3, np.pi / 4, 0])
/// True
#[pyfunction]
pub(crate) fn lambert(py: Python<'_>, degree: usize) -> PyResult<Bound<'_, PyArray1<f64>>> {
    check_degree(degree, LARGEST)?;
    let transfers = reflectance::lambert::transfers(degree).map_err(error)?;
    Ok(PyArray1::from_vec(py, transfers))
}

/// A material: a Lambert body and a Ward lobe.
///
/// It is made by `plastic`, `metal`, `from_albedos`, `from_albedos_gaining_energy` and `white`.
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.Material.from_albedos("satin", [0.5, 0.4, 0.3], [0.04] * 3, 0.1)
/// Material("satin", diffuse=(0.5, 0.4, 0.3), specular=(0.04, 0.04, 0.04), sigma=0.1)
#[pyclass(frozen, eq, module = "lobes", from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Material(pub(crate) reflectance::Material);

#[pymethods]
impl Material {
    /// Radiance's plastic: a white highlight.
    ///
    /// Parameters
    /// ----------
    /// name : str
    /// reflectance : array_like, (3,)
    ///     Red, green and blue of the body, before what the highlight takes.
    /// specularity : float
    /// sigma : float
    ///     The width of the lobe.
    ///
    /// Returns
    /// -------
    /// Material
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Material.plastic("ball", [0.5, 0.25, 0.0], 0.5, 0.1)
    /// Material("ball", diffuse=(0.25, 0.125, 0.0), specular=(0.5, 0.5, 0.5), sigma=0.1)
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
    ///
    /// Parameters
    /// ----------
    /// name : str
    /// reflectance : array_like, (3,)
    ///     Red, green and blue of body and highlight together.
    /// specularity : float
    /// sigma : float
    ///     The width of the lobe.
    ///
    /// Returns
    /// -------
    /// Material
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Material.metal("ball", [0.5, 0.25, 0.0], 0.5, 0.1)
    /// Material("ball", diffuse=(0.25, 0.125, 0.0), specular=(0.25, 0.125, 0.0), sigma=0.1)
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
    ///
    /// Parameters
    /// ----------
    /// name : str
    /// diffuse : array_like, (3,)
    /// specular : array_like, (3,)
    /// sigma : float
    ///     The width of the lobe.
    ///
    /// Returns
    /// -------
    /// Material
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Material.from_albedos("clay", [0.5, 0.4, 0.3], [0.0] * 3, 0.1).diffuse
    /// (0.5, 0.4, 0.3)
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
    ///
    /// Parameters
    /// ----------
    /// name : str
    /// diffuse : array_like, (3,)
    /// specular : array_like, (3,)
    /// sigma : float
    ///     The width of the lobe.
    ///
    /// Returns
    /// -------
    /// Material
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Material.from_albedos_gaining_energy("bright", [0.9] * 3, [0.9] * 3, 0.1).specular
    /// (0.9, 0.9, 0.9)
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
    ///
    /// Returns
    /// -------
    /// Material
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Material.white().diffuse
    /// (1.0, 1.0, 1.0)
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

    /// Its lobe; None of a matte material and of a mirror.
    ///
    /// Parameters
    /// ----------
    /// variant : str
    ///     "ward1992", "duer", "gmd" or "sampled".
    ///
    /// Returns
    /// -------
    /// Lobe or None
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.presets()[5].lobe("gmd"), lobes.Material.white().lobe()
    /// (Lobe("gmd", 0.1), None)
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

/// The eight materials that come with the package.
///
/// Returns
/// -------
/// list of Material
///
/// Examples
/// --------
/// >>> import lobes
/// >>> [material.name for material in lobes.presets()][:2]
/// ['brown matte', 'white matte']
#[pyfunction]
pub(crate) fn presets() -> Vec<Material> {
    reflectance::presets().into_iter().map(Material).collect()
}

/// Fits a lobe and a Lambert body to measured values of a BRDF by least squares.
///
/// Parameters
/// ----------
/// lights, views : array_like, (n, 3)
///     Of unit length, in the surface's frame.
/// values : array_like, (n,)
///     The BRDF, per steradian.
/// weights : array_like, (n,), optional
///     1 unless given.
/// variant : str
///     "ward1992", "duer", "gmd" or "sampled".
/// widths : int
///     1, or 2 for an anisotropic lobe.
///
/// Returns
/// -------
/// Fit
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> view, angles = [0.6, 0.0, 0.8], np.linspace(-1.4, 0.5, 40)
/// >>> lights = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=-1)
/// >>> values = 0.1 + 0.5 * lobes.Lobe("gmd", 0.15).evaluate(view, lights) / lights[:, 2]
/// >>> fit = lobes.fit_lobe(lights, np.tile(view, (40, 1)), values, variant="gmd")
/// >>> round(fit.sigma[0].value, 6)
/// 0.15
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

/// Reads a table of measurements: theta_i, phi_i, theta_o, phi_o, value, with angles in degrees.
///
/// Parameters
/// ----------
/// path : str or path-like
///
/// Returns
/// -------
/// Measurements
///
/// Examples
/// --------
/// >>> import lobes, pathlib, tempfile
/// >>> with tempfile.TemporaryDirectory() as folder:
/// ...     path = pathlib.Path(folder, "table.csv")
/// ...     _ = path.write_text("theta_i,phi_i,theta_o,phi_o,value\n30,0,45,180,0.2\n")
/// ...     len(lobes.read_csv(path))
/// 1
#[pyfunction]
pub(crate) fn read_csv(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let all = interrupt::run(py, move || fit::read_csv(&path))?.map_err(error)?;
    measurements(py, &all)
}

/// Reads one channel of a file of the MERL database.
///
/// Parameters
/// ----------
/// path : str or path-like
/// channel : int
///     0 red, 1 green, 2 blue.
///
/// Returns
/// -------
/// Measurements
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.read_merl("no-such-file.binary", 0)
/// Traceback (most recent call last):
/// FileNotFoundError: ...
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

/// The kernel that takes the coefficients of light to those of what it is reflected as.
///
/// Parameters
/// ----------
/// light, reflected : Coefficients or array_like, (count,)
///
/// Returns
/// -------
/// kernel, standard_errors : ndarray, (degree + 1,)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> light = lobes.random_field(np.ones(9), 1)
/// >>> kernel, errors = lobes.recover_kernel(light, lobes.convolve_zonal(light, lobes.lambert(8)))
/// >>> np.allclose(kernel, lobes.lambert(8), atol=1e-12)
/// True
#[pyfunction]
pub(crate) fn recover_kernel<'py>(
    py: Python<'py>,
    light: &Bound<'py, PyAny>,
    reflected: &Bound<'py, PyAny>,
) -> PyResult<TwoColumns<'py>> {
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
///
/// Parameters
/// ----------
/// kernel, standard_errors : array_like, (degree + 1,)
///     As `recover_kernel` gives them.
/// variant : str
///     "ward1992", "duer", "gmd" or "sampled".
///
/// Returns
/// -------
/// Recovered
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> kernel = 0.3 * lobes.lambert(24) / np.pi + 0.2 * lobes.Lobe("gmd", 0.1).zonal(1.0, 24)
/// >>> round(lobes.recover_lobe(kernel, np.full(25, 1e-6), "gmd").sigma.value, 3)
/// 0.1
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
    if let Some(&value) = errors
        .as_slice()?
        .iter()
        .find(|value| value.is_nan() || **value < 0.0)
    {
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
