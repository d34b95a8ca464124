//! `lobes` for Python: NumPy arrays in and out, the interpreter let go while it works.
//!
//! What is plain data in Python (`Coefficients`, and the records that functions give) is written in
//! Python, in `package/lobes`.

mod arrays;
mod classify;
mod coefficients;
mod evaluation;
mod harmonics;
mod illumination;
mod interrupt;
mod light_tree;
mod operator;
mod probe;
mod reflectance;
mod reflection;
mod spectrum;

use lobes::Parallelism;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// A [`lobes::Error`] as Python's own: what a file did is an `OSError`, all else a `ValueError`.
fn error(error: lobes::Error) -> PyErr {
    let sentence = pythonic(&error.to_string());
    match error {
        lobes::Error::File { path, .. } => {
            let kind = std::fs::metadata(&path).err().map(|error| error.kind());
            match kind {
                // As `open` would, so that it can be caught as such.
                Some(
                    kind @ (std::io::ErrorKind::NotFound | std::io::ErrorKind::PermissionDenied),
                ) => std::io::Error::new(kind, sentence).into(),
                _ => PyOSError::new_err(sentence),
            }
        }
        _ => PyValueError::new_err(sentence),
    }
}

/// A sentence of the crate, which speaks of the command's options and of Rust's paths, in terms of
/// Python.
fn pythonic(sentence: &str) -> String {
    sentence
        .replace("--mapping angular-map", "mapping=\"angular-map\"")
        .replace("--mapping mirror-ball", "mapping=\"mirror-ball\"")
        .replace("--mapping", "mapping")
        .replace("--circle x,y,r", "circle=(x, y, radius)")
        .replace("--circle", "circle=(x, y, radius)")
        .replace("--exposures", "exposures")
        .replace(", with --rows", "")
        .replace("--rows", "rows")
        .replace("Material::", "Material.")
}

/// All threads or one, as `threads=` says.
fn parallelism(all: bool) -> Parallelism {
    if all {
        Parallelism::Rayon
    } else {
        Parallelism::Sequential
    }
}

/// One of the records of `lobes._records`.
fn record<'py>(
    py: Python<'py>,
    name: &str,
    fields: impl IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>,
) -> PyResult<Bound<'py, PyAny>> {
    let class = py.import("lobes._records")?.getattr(name)?;
    class.call1(fields.into_pyobject(py)?)
}

/// Whether an object is one of the records of that name.
fn is_record(object: &Bound<'_, PyAny>, name: &str) -> PyResult<bool> {
    let class = object.py().import("lobes._records")?.getattr(name)?;
    object.is_instance(&class)
}

/// The vector instructions that are used; the environment variable `LOBES_VECTORS` chooses.
///
/// Returns
/// -------
/// str
///     "avx512", "avx2" or "baseline".
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.vectors() in ("avx512", "avx2", "baseline")
/// True
#[pyfunction]
fn vectors() -> &'static str {
    lobes::vectors()
}

#[pymodule]
mod _lobes {
    use super::{Bound, PyModule, PyResult};
    use pyo3::prelude::PyModuleMethods;

    #[pymodule_export]
    use super::vectors;

    #[pymodule_export]
    use super::classify::{FinishReader, Model, Picture, Training};
    #[pymodule_export]
    use super::evaluation::evaluate;
    #[pymodule_export]
    use super::harmonics::{
        Rotation, SingleTransform, Transform, analyse_at, basis, basis_gradients, from_harmonic,
        gradients_at, rotate_splats, synthesise_at, synthesise_at_adjoint, to_harmonic, wigner_d,
        wigner_rotation, wigner_rotation_real,
    };
    #[pymodule_export]
    use super::illumination::{
        EnvironmentMap, builtin, encode_exr, encode_png, fit_power_law, linear_of_srgb,
        read_linear, srgb_of_linear,
    };
    #[pymodule_export]
    use super::light_tree::{GgxMaterial, LightTree};
    #[pymodule_export]
    use super::operator::Operator;
    #[pymodule_export]
    use super::probe::probe;
    #[pymodule_export]
    use super::reflectance::{
        Lobe, Material, fit_lobe, lambert, presets, read_csv, read_merl, recover_kernel,
        recover_lobe,
    };
    #[pymodule_export]
    use super::reflection::{Camera, Renderer, features};
    #[pymodule_export]
    use super::spectrum::{
        Coupling, Mask, apodise, average_power, convolve_zonal, cross_power, deconvolve_zonal,
        from_complex, from_real, gaussian_beam, laplacian, random_field, to_complex, to_real,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
