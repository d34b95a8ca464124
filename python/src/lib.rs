//! `lobes` for Python: NumPy arrays in and out, the interpreter let go while it works.
//!
//! An array that is C-contiguous and of doubles is read where it lies; any other is copied first, as NumPy does it.

mod classify;
mod harmonics;
mod illumination;
mod reflectance;
mod reflection;

use lobes::Parallelism;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

/// A [`lobes::Error`] as Python's own: what a file did is an `OSError`, all else a `ValueError`.
fn error(error: lobes::Error) -> PyErr {
    match error {
        lobes::Error::File { .. } => PyOSError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// All threads or one, as `threads=` says.
fn parallelism(all: bool) -> Parallelism {
    if all {
        Parallelism::Rayon
    } else {
        Parallelism::Sequential
    }
}

/// The vector instructions that are used: "avx512", "avx2" or "baseline"; the environment variable `LOBES_VECTORS` chooses.
#[pyfunction]
fn vectors() -> &'static str {
    lobes::vectors()
}

#[pymodule]
mod _lobes {
    #[pymodule_export]
    use super::vectors;

    #[pymodule_export]
    use super::classify::{Model, Picture, Training, Verdict};
    #[pymodule_export]
    use super::harmonics::{
        Rotation, Transform, average_power, basis, from_complex, synthesise_at, to_complex,
    };
    #[pymodule_export]
    use super::illumination::{EnvironmentMap, builtin};
    #[pymodule_export]
    use super::reflectance::{Lobe, Material, lambert, presets};
    #[pymodule_export]
    use super::reflection::{Camera, Renderer, features};
}
