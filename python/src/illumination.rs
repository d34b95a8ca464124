//! Environment maps, their files and their spectra.

use std::path::PathBuf;
use std::sync::Arc;

use lobes::files::{self, Precision};
use lobes::illumination::{self, LightSpectrum};
use lobes::sphere::Mapping;
use numpy::{PyArray1, PyArray3, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Directions, Pixels, check_finite, check_room, doubles, mask_of, shaped};
use crate::coefficients::wrap_all;
use crate::{error, interrupt, parallelism, record};

/// Light from every direction: a lat-long map of linear radiance.
///
/// Parameters
/// ----------
/// pixels : array_like, (rows, columns, 3)
///     Twice as many columns as rows: row 0 is the zenith and the centre column looks along −z.
/// name : str
/// mapping : str
///     "lat-long", or "angular-map", "mirror-ball", "vertical-cross" or "horizontal-cross", which
///     are resampled.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> lobes.EnvironmentMap(np.ones((16, 32, 3)), "grey")
/// <EnvironmentMap "grey", 16 × 32>
#[pyclass(frozen, eq, module = "lobes", from_py_object)]
#[derive(Clone)]
pub(crate) struct EnvironmentMap(pub(crate) Arc<illumination::EnvironmentMap>);

impl PartialEq for EnvironmentMap {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0 == other.0
    }
}

impl From<illumination::EnvironmentMap> for EnvironmentMap {
    fn from(map: illumination::EnvironmentMap) -> Self {
        Self(Arc::new(map))
    }
}

/// A mapping by its name; none where the shape of the picture is to tell it.
fn mapping(name: Option<&str>) -> PyResult<Option<Mapping>> {
    name.map(str::parse).transpose().map_err(error)
}

#[pymethods]
impl EnvironmentMap {
    #[new]
    #[pyo3(signature = (pixels, name="map", mapping="lat-long"))]
    fn new(py: Python<'_>, pixels: &Bound<'_, PyAny>, name: &str, mapping: &str) -> PyResult<Self> {
        let pixels = Pixels::linear(pixels, "the map")?;
        let mapping: Mapping = mapping.parse().map_err(error)?;
        let name = name.to_owned();
        interrupt::run(py, move || {
            let Pixels {
                rows,
                columns,
                values,
            } = pixels;
            illumination::EnvironmentMap::from_picture(name, mapping, columns, rows, values)
        })?
        .map(Self::from)
        .map_err(error)
    }

    /// Reads an OpenEXR, Radiance or PFM file.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    /// mapping : str, optional
    ///     As of `EnvironmentMap`; unless given the picture's shape tells it, and a square needs
    ///     one.
    ///
    /// Returns
    /// -------
    /// EnvironmentMap
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np, tempfile
    /// >>> with tempfile.TemporaryDirectory() as folder:
    /// ...     lobes.write_exr(f"{folder}/grey.exr", np.ones((16, 32, 3)))
    /// ...     lobes.EnvironmentMap.read(f"{folder}/grey.exr")
    /// <EnvironmentMap "grey", 16 × 32>
    #[staticmethod]
    #[pyo3(signature = (path, mapping=None))]
    fn read(py: Python<'_>, path: PathBuf, mapping: Option<&str>) -> PyResult<Self> {
        let mapping = self::mapping(mapping)?;
        interrupt::run(py, move || illumination::read(&path, mapping))?
            .map(Self::from)
            .map_err(error)
    }

    /// Reads every map of a folder, sorted by name.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    /// mapping : str, optional
    ///     That of the files whose shape it fits.
    ///
    /// Returns
    /// -------
    /// list of EnvironmentMap
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np, tempfile
    /// >>> with tempfile.TemporaryDirectory() as folder:
    /// ...     lobes.write_exr(f"{folder}/grey.exr", np.ones((16, 32, 3)))
    /// ...     lobes.EnvironmentMap.read_folder(folder)
    /// [<EnvironmentMap "grey", 16 × 32>]
    #[staticmethod]
    #[pyo3(signature = (path, mapping=None))]
    fn read_folder(py: Python<'_>, path: PathBuf, mapping: Option<&str>) -> PyResult<Vec<Self>> {
        let mapping = self::mapping(mapping)?;
        let maps = interrupt::run(py, move || illumination::read_folder(&path, mapping))?;
        Ok(maps.map_err(error)?.into_iter().map(Self::from).collect())
    }

    /// The name.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Rows and columns.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.0.height(), self.0.width())
    }

    /// The pixels, (rows, columns, 3).
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let flat = PyArray1::from_slice(py, self.0.pixels().as_flattened());
        flat.reshape([self.0.height(), self.0.width(), 3])
    }

    /// The largest degree that the map carries.
    #[getter]
    fn max_degree(&self) -> PyResult<usize> {
        self.0.max_degree().map_err(error)
    }

    /// The mean radiance over the sphere.
    ///
    /// Returns
    /// -------
    /// tuple of three floats
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> np.allclose(lobes.EnvironmentMap(np.full((16, 32, 3), 0.5)).mean(), 0.5)
    /// True
    fn mean(&self) -> (f64, f64, f64) {
        self.0.mean().into()
    }

    /// The radiance that comes from directions, interpolated bilinearly.
    ///
    /// Parameters
    /// ----------
    /// directions : array_like, (…, 3)
    ///     In the world frame, y up, of any length but 0.
    ///
    /// Returns
    /// -------
    /// ndarray, (…, 3)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> sky = lobes.EnvironmentMap(np.linspace(1, 0, 16)[:, None, None] * np.ones((16, 32, 3)))
    /// >>> np.allclose(sky.radiance([[0, 1, 0], [1, 0, 0]])[:, 0], [1, 0.5])
    /// True
    fn radiance<'py>(
        &self,
        py: Python<'py>,
        directions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let directions = Directions::of(directions, "the array of directions")?;
        let values = py.detach(|| {
            let directions = directions.vectors.iter();
            directions.flat_map(|&at| self.0.radiance(at)).collect()
        });
        shaped(py, &[&directions.shape[..], &[3]].concat(), values)
    }

    /// The map of so many rows and twice as many columns, each pixel the mean of what it covers.
    ///
    /// Parameters
    /// ----------
    /// rows : int
    ///     At most 8192.
    ///
    /// Returns
    /// -------
    /// EnvironmentMap
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.builtin()[0].resampled(8).shape
    /// (8, 16)
    fn resampled(&self, py: Python<'_>, rows: usize) -> PyResult<Self> {
        if rows > 1 << 13 {
            return Err(PyValueError::new_err(format!(
                "a map of {rows} rows is beyond 8192, the most that a map is resampled to"
            )));
        }
        check_room(6 * rows * rows, "the resampled map")?;
        let map = Arc::clone(&self.0);
        interrupt::run(py, move || map.resampled(2 * rows, rows))?
            .map(Self::from)
            .map_err(error)
    }

    /// The map with the brightest share of the sphere brought down to the brightest pixel that is
    /// left, as a camera of too small a range would.
    ///
    /// Parameters
    /// ----------
    /// share : float
    ///     Of the sphere's area, on [0, 1).
    ///
    /// Returns
    /// -------
    /// EnvironmentMap
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> light = lobes.builtin()[0]
    /// >>> bool(light.clipped(0.01).pixels.max() < light.pixels.max())
    /// True
    fn clipped(&self, share: f64) -> PyResult<Self> {
        self.0.clipped(share).map(Self::from).map_err(error)
    }

    /// The coefficients of red, green and blue.
    ///
    /// Parameters
    /// ----------
    /// degree : int
    ///     At most `max_degree`.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// Coefficients, (3, (degree + 1)²)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> light = lobes.builtin()[0]
    /// >>> mean = light.coefficients(4).get(0, 0) / np.sqrt(4 * np.pi)
    /// >>> np.allclose(mean, light.mean())
    /// True
    #[pyo3(signature = (degree, threads=true))]
    fn coefficients<'py>(
        &self,
        py: Python<'py>,
        degree: usize,
        threads: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let map = Arc::clone(&self.0);
        let channels = interrupt::run(py, move || map.coefficients(degree, parallelism(threads)))?
            .map_err(error)?;
        wrap_all(py, &[3], channels.into(), (degree, degree))
    }

    /// The power spectrum, the law k / l^(2+η) that it follows, and the channels' coherence.
    ///
    /// Parameters
    /// ----------
    /// degree : int
    ///     The last, or what the map carries.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// LightSpectrum
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> spectrum = lobes.builtin()[16].spectrum()
    /// >>> spectrum.channels.shape, 0 < spectrum.law.eta < 1
    /// ((3, 129), True)
    #[pyo3(signature = (degree=128, threads=true))]
    fn spectrum<'py>(
        &self,
        py: Python<'py>,
        degree: usize,
        threads: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let map = Arc::clone(&self.0);
        let made = move || LightSpectrum::of(&map, degree, parallelism(threads));
        let spectrum = interrupt::run(py, made)?.map_err(error)?;
        let channels = spectrum.channels.concat();
        record(
            py,
            "LightSpectrum",
            (
                PyArray1::from_vec(py, spectrum.luminance.clone()),
                shaped(py, &[3, spectrum.luminance.len()], channels)?,
                law(py, &spectrum.law)?,
                <(Option<f64>, Option<f64>, Option<f64>)>::from(spectrum.etas),
                spectrum.coherence,
                spectrum.clipped_eta,
            ),
        )
    }

    fn _repr_png_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let show = slf.py().import("lobes._show")?;
        show.call_method1("map_png", (slf,))
    }

    fn __repr__(&self) -> String {
        let (rows, columns) = self.shape();
        format!("<EnvironmentMap {:?}, {rows} × {columns}>", self.name())
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        (self.name(), self.shape()).hash(&mut hasher);
        hasher.finish()
    }

    #[expect(clippy::type_complexity, reason = "what pickle wants")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyArray3<f64>>, String))> {
        let this = slf.get();
        let arguments = (this.pixels(slf.py())?, this.name().to_owned());
        Ok((slf.get_type().into_any(), arguments))
    }
}

/// A power law as a record.
fn law<'py>(py: Python<'py>, law: &illumination::PowerLaw) -> PyResult<Bound<'py, PyAny>> {
    record(
        py,
        "PowerLaw",
        (law.k, law.eta, law.eta_error, law.ln_k_error),
    )
}

/// The law B_l = k / l^(2+η) that fits a power spectrum best, by least squares of logarithms.
///
/// Parameters
/// ----------
/// power : array_like, (degree + 1,)
///     B_0 first.
/// first, last : int
///     The degrees that are fitted.
///
/// Returns
/// -------
/// PowerLaw
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> law = lobes.fit_power_law(3 / np.maximum(np.arange(65), 1) ** 2.5, 2, 60)
/// >>> round(law.k, 9), round(law.eta, 9)
/// (3.0, 0.5)
#[pyfunction]
pub(crate) fn fit_power_law<'py>(
    py: Python<'py>,
    power: &Bound<'py, PyAny>,
    first: usize,
    last: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let power = doubles(power, "the power spectrum")?;
    if power.ndim() != 1 {
        return Err(PyValueError::new_err(
            "the power spectrum is not one number a degree",
        ));
    }
    let fitted = illumination::PowerLaw::fit(power.as_slice()?, first, last).map_err(error)?;
    law(py, &fitted)
}

/// The maps that come with the package: captured light, in the public domain.
///
/// Returns
/// -------
/// list of EnvironmentMap
///
/// Examples
/// --------
/// >>> import lobes
/// >>> len(lobes.builtin())
/// 17
#[pyfunction]
pub(crate) fn builtin(py: Python<'_>) -> PyResult<Vec<EnvironmentMap>> {
    let maps = interrupt::run(py, illumination::builtin)?.map_err(error)?;
    Ok(maps.into_iter().map(EnvironmentMap::from).collect())
}

/// Reads a picture of linear radiance: OpenEXR, Radiance or PFM.
///
/// Parameters
/// ----------
/// path : str or path-like
///
/// Returns
/// -------
/// ndarray, (rows, columns, 3)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np, tempfile
/// >>> with tempfile.TemporaryDirectory() as folder:
/// ...     lobes.write_exr(f"{folder}/grey.exr", np.full((2, 3, 3), 0.25))
/// ...     lobes.read_linear(f"{folder}/grey.exr").shape
/// (2, 3, 3)
#[pyfunction]
pub(crate) fn read_linear(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyArrayDyn<f64>>> {
    let picture = interrupt::run(py, move || files::read(&path))?.map_err(error)?;
    let shape = [picture.height, picture.width, 3];
    shaped(py, &shape, picture.pixels.into_flattened())
}

/// The bytes of an OpenEXR file of linear radiance.
///
/// Parameters
/// ----------
/// pixels : array_like, (rows, columns, 3)
/// precision : str
///     "single" or "half".
///
/// Returns
/// -------
/// bytes
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> lobes.encode_exr(np.ones((2, 3, 3)))[:4].hex()
/// '762f3101'
#[pyfunction]
#[pyo3(signature = (pixels, precision="single"))]
pub(crate) fn encode_exr<'py>(
    py: Python<'py>,
    pixels: &Bound<'py, PyAny>,
    precision: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let (precision, largest) = match precision {
        "single" => (Precision::Single, f64::from(f32::MAX)),
        "half" => (Precision::Half, 65_504.0),
        other => {
            return Err(PyValueError::new_err(format!(
                "there is no precision {other:?}; there are single and half"
            )));
        }
    };
    let pixels = Pixels::linear(pixels, "the picture")?;
    let flat = pixels.values.as_flattened();
    check_finite(flat, "the picture")?;
    if let Some(value) = flat.iter().find(|value| value.abs() > largest) {
        return Err(PyValueError::new_err(format!(
            "the picture holds {value}, and this precision of OpenEXR ends at {largest}"
        )));
    }
    let picture = files::Picture {
        width: pixels.columns,
        height: pixels.rows,
        pixels: pixels.values,
    };
    if picture.pixels.is_empty() {
        return Err(PyValueError::new_err("the picture has no pixel"));
    }
    let bytes = interrupt::run(py, move || files::encode_exr(&picture, precision))?;
    Ok(PyBytes::new(py, &bytes.map_err(error)?))
}

/// The bytes of a PNG of linear radiance as 8-bit sRGB.
///
/// Parameters
/// ----------
/// pixels : array_like, (rows, columns, 3)
/// mask : array_like, (rows, columns), optional
///     Booleans, uint8 or numbers on [0, 1]; the picture is transparent where it is 0.
/// exposure : float
///     What the radiance is multiplied by.
///
/// Returns
/// -------
/// bytes
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> lobes.encode_png(np.ones((2, 3, 3)))[1:4]
/// b'PNG'
#[pyfunction]
#[pyo3(signature = (pixels, mask=None, exposure=1.0))]
pub(crate) fn encode_png<'py>(
    py: Python<'py>,
    pixels: &Bound<'py, PyAny>,
    mask: Option<&Bound<'py, PyAny>>,
    exposure: f64,
) -> PyResult<Bound<'py, PyBytes>> {
    let pixels = Pixels::linear(pixels, "the picture")?;
    check_finite(pixels.values.as_flattened(), "the picture")?;
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "the exposure is {exposure}, which is not finite and above 0"
        )));
    }
    if pixels.values.is_empty() {
        return Err(PyValueError::new_err("the picture has no pixel"));
    }
    let mask = mask_of(mask, pixels.rows, pixels.columns)?;
    let bytes = interrupt::run(py, move || {
        lobes::picture::encode_png(pixels.columns, pixels.rows, exposure, |row, column| {
            let index = row * pixels.columns + column;
            let seen = mask.as_ref().is_none_or(|mask| mask[index] >= 0.5);
            seen.then(|| pixels.values[index])
        })
    })?;
    Ok(PyBytes::new(py, &bytes.map_err(error)?))
}

/// Linear values of sRGB codes (IEC 61966-2-1).
///
/// Parameters
/// ----------
/// codes : array_like, any shape
///     On [0, 1]; those of uint8 and uint16 over their largest.
///
/// Returns
/// -------
/// ndarray, of that shape
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> lobes.linear_of_srgb(np.array([0, 128, 255], "uint8")).round(4)
/// array([0.    , 0.2159, 1.    ])
#[pyfunction]
pub(crate) fn linear_of_srgb<'py>(
    py: Python<'py>,
    codes: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let scale = match crate::arrays::type_name(codes)?.as_str() {
        "uint8" => 255.0,
        "uint16" => 65_535.0,
        _ => 1.0,
    };
    let codes = doubles(codes, "the array of codes")?;
    let values = codes.as_slice()?.iter();
    let linear = values.map(|code| files::linear_of_srgb(code / scale));
    shaped(py, codes.shape(), linear.collect())
}

/// sRGB codes on [0, 1] of linear values (IEC 61966-2-1).
///
/// Parameters
/// ----------
/// linear : array_like, any shape
///
/// Returns
/// -------
/// ndarray, of that shape
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.srgb_of_linear([0.0, 0.2159, 1.0]).round(3)
/// array([0.   , 0.502, 1.   ])
#[pyfunction]
pub(crate) fn srgb_of_linear<'py>(
    py: Python<'py>,
    linear: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let linear = doubles(linear, "the array of values")?;
    let codes = linear
        .as_slice()?
        .iter()
        .copied()
        .map(files::srgb_of_linear);
    shaped(py, linear.shape(), codes.collect())
}
