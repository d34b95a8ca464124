//! Between Python's numbers and the crate's: every array comes in and goes out through here.

use lobes::glam::DVec3;
use numpy::{
    Complex64, Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// Two arrays of any dimensions.
pub(crate) type Two<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

/// Two arrays of one dimension.
pub(crate) type TwoColumns<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// NumPy itself.
fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    NUMPY
        .get_or_try_init(py, || Ok(py.import("numpy")?.unbind()))
        .map(|module| module.bind(py))
}

/// Anything that NumPy makes an array of numbers of, as a contiguous array of doubles or of complex
/// doubles: as it lies, or copied.
///
/// `kinds` are the kinds of NumPy's types that become one without loss of meaning.
fn array<'py, T: Element>(
    object: &Bound<'py, PyAny>,
    what: &str,
    kinds: &str,
    wanted: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let py = object.py();
    let numpy = numpy(py)?;
    let masked = numpy
        .getattr("ma")?
        .call_method1("is_masked", (object,))?
        .is_truthy()?;
    if masked {
        return Err(PyTypeError::new_err(format!(
            "{what} has masked values; fill them, or leave them out"
        )));
    }
    let array = numpy.call_method1("asarray", (object,))?;
    let dtype = array.getattr("dtype")?;
    let kind: char = dtype.getattr("kind")?.extract()?;
    if !kinds.contains(kind) {
        return Err(PyTypeError::new_err(format!(
            "{what} holds values of the type {dtype}, which are not {wanted}"
        )));
    }
    let array = numpy.call_method1("require", (array, T::get_dtype(py), ["C", "A"]))?;
    Ok(array.cast_into::<PyArrayDyn<T>>()?.try_readonly()?)
}

/// Real numbers of any type, in any order, of either byte order, or nested lists of them.
pub(crate) fn doubles<'py>(
    object: &Bound<'py, PyAny>,
    what: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    array(object, what, "fiub", "real numbers")
}

/// As [`doubles`], of single precision.
pub(crate) fn singles<'py>(
    object: &Bound<'py, PyAny>,
    what: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f32>> {
    array(object, what, "fiub", "real numbers")
}

/// As [`doubles`], of complex numbers.
pub(crate) fn complexes<'py>(
    object: &Bound<'py, PyAny>,
    what: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, Complex64>> {
    array(object, what, "fiubc", "numbers")
}

/// NumPy's name of the type of an array, before it becomes doubles.
pub(crate) fn type_name(object: &Bound<'_, PyAny>) -> PyResult<String> {
    let array = numpy(object.py())?.call_method1("asarray", (object,))?;
    array.getattr("dtype")?.getattr("name")?.extract()
}

/// Checks that every value is finite.
pub(crate) fn check_finite(values: &[f64], what: &str) -> PyResult<()> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(PyValueError::new_err(format!(
            "{what} holds {} at index {index} of its values; every one must be finite",
            values[index]
        ))),
    }
}

/// Checks that what came of finite values is finite.
pub(crate) fn check_result(values: &[f64], what: &str) -> PyResult<()> {
    if values.iter().all(|value| value.is_finite()) {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!(
            "{what} is beyond the largest double; scale what you give"
        )))
    }
}

/// N real numbers, as an array or any sequence.
pub(crate) fn numbers<const N: usize>(object: &Bound<'_, PyAny>, what: &str) -> PyResult<[f64; N]> {
    let array = doubles(object, what)?;
    let values = array.as_slice()?;
    match (array.ndim(), <[f64; N]>::try_from(values)) {
        (1, Ok(values)) => Ok(values),
        _ => Err(PyValueError::new_err(format!(
            "{what} has the shape {}, which is not ({N},)",
            shape_name(array.shape())
        ))),
    }
}

/// A direction that an operation takes at its length.
pub(crate) fn vector(object: &Bound<'_, PyAny>, what: &str) -> PyResult<DVec3> {
    Ok(DVec3::from_array(numbers(object, what)?))
}

/// A shape as Python writes it.
pub(crate) fn shape_name(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        shape => {
            let lengths: Vec<_> = shape.iter().map(usize::to_string).collect();
            format!("({})", lengths.join(", "))
        }
    }
}

/// The shape before the last dimensions, which must be `expected`.
pub(crate) fn leading(shape: &[usize], expected: &[usize], what: &str) -> PyResult<Vec<usize>> {
    match shape.split_at_checked(shape.len().wrapping_sub(expected.len())) {
        Some((before, last)) if last == expected => Ok(before.to_vec()),
        _ => Err(PyValueError::new_err(format!(
            "{what} has the shape {}, whose last dimensions are not {}",
            shape_name(shape),
            shape_name(expected)
        ))),
    }
}

/// Directions (…, 3), and the shape before the 3.
pub(crate) struct Directions {
    pub(crate) vectors: Vec<DVec3>,
    pub(crate) shape: Vec<usize>,
}

impl Directions {
    /// Of any length but none and an infinite one.
    pub(crate) fn of(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        let array = doubles(object, what)?;
        let shape = leading(array.shape(), &[3], what)?;
        let (vectors, _) = array.as_slice()?.as_chunks::<3>();
        let vectors: Vec<_> = vectors.iter().copied().map(DVec3::from_array).collect();
        let wrong = |vector: &DVec3| {
            let length = vector.length();
            !(length > 0.0 && length.is_finite())
        };
        match vectors.iter().position(wrong) {
            None => Ok(Self { vectors, shape }),
            Some(index) => Err(PyValueError::new_err(format!(
                "{what} holds {} at index {index}, which is no direction: its length must be finite and above 0",
                vectors[index]
            ))),
        }
    }

    /// Of unit length: the square within 10⁻⁶ of 1.
    pub(crate) fn unit(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        let directions = Self::of(object, what)?;
        let wrong = |vector: &DVec3| (vector.length_squared() - 1.0).abs() > 1e-6;
        match directions.vectors.iter().position(wrong) {
            None => Ok(directions),
            Some(index) => Err(PyValueError::new_err(format!(
                "{what} holds a vector of length {} at index {index}; divide directions by their lengths",
                directions.vectors[index].length()
            ))),
        }
    }

    /// One direction of unit length.
    pub(crate) fn one(object: &Bound<'_, PyAny>, what: &str) -> PyResult<DVec3> {
        let directions = Self::unit(object, what)?;
        match (directions.shape.len(), directions.vectors.as_slice()) {
            (0, &[vector]) => Ok(vector),
            _ => Err(PyValueError::new_err(format!(
                "{what} is {} directions where one, of shape (3,), is needed",
                directions.vectors.len()
            ))),
        }
    }
}

/// Pixels (rows, columns, 3) of any numbers.
pub(crate) struct Pixels {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) values: Vec<[f64; 3]>,
}

impl Pixels {
    pub(crate) fn of(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        let array = doubles(object, what)?;
        let &[rows, columns, 3] = array.shape() else {
            return Err(PyValueError::new_err(format!(
                "{what} has the shape {}, which is not (rows, columns, 3)",
                shape_name(array.shape())
            )));
        };
        Ok(Self {
            rows,
            columns,
            values: array.as_slice()?.as_chunks().0.to_vec(),
        })
    }

    /// Of linear radiance: codes of 8 or 16 bits are refused, which are not.
    pub(crate) fn linear(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        let name = type_name(object)?;
        if name == "uint8" || name == "uint16" {
            return Err(PyTypeError::new_err(format!(
                "{what} holds {name}, which are codes and not linear radiance; decode them first (lobes.linear_of_srgb)"
            )));
        }
        Self::of(object, what)
    }
}

/// The number of values of a shape, or a `MemoryError`.
fn count(shape: &[usize]) -> PyResult<usize> {
    shape
        .iter()
        .try_fold(1usize, |count, &length| count.checked_mul(length))
        .filter(|count| {
            count
                .checked_mul(16)
                .is_some_and(|bytes| bytes < isize::MAX as usize)
        })
        .ok_or_else(|| {
            PyMemoryError::new_err(format!(
                "an array of the shape {} is larger than any memory",
                shape_name(shape)
            ))
        })
}

/// Refuses what there is no memory for, before the crate asks for it.
pub(crate) fn check_room(values: usize, what: &str) -> PyResult<()> {
    Vec::<f64>::new()
        .try_reserve_exact(values)
        .map_err(|_| PyMemoryError::new_err(format!("there is no memory for {what}")))
}

/// A fresh array of zeros; `MemoryError` where there is no room for it.
pub(crate) fn zeros<'py, T: Element>(
    py: Python<'py>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    count(shape)?;
    let shape = pyo3::types::PyTuple::new(py, shape)?;
    let array = numpy(py)?.call_method1("zeros", (shape, T::get_dtype(py)))?;
    Ok(array.cast_into::<PyArrayDyn<T>>()?)
}

/// The values as an array of this shape, which they fill.
pub(crate) fn shaped<'py, T: Element>(
    py: Python<'py>,
    shape: &[usize],
    values: Vec<T>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// The values of a mask (rows, columns) on [0, 1].
pub(crate) fn mask_of(
    mask: Option<&Bound<'_, PyAny>>,
    rows: usize,
    columns: usize,
) -> PyResult<Option<Vec<f32>>> {
    let Some(mask) = mask else {
        return Ok(None);
    };
    let scale = if type_name(mask)? == "uint8" {
        255.0
    } else {
        1.0
    };
    let mask = doubles(mask, "the mask")?;
    if mask.shape() != [rows, columns] {
        return Err(PyValueError::new_err(format!(
            "the mask has the shape {}, which is not that of the picture, ({rows}, {columns})",
            shape_name(mask.shape())
        )));
    }
    let values: Vec<f32> = mask
        .as_slice()?
        .iter()
        .map(|value| (value / scale) as f32)
        .collect();
    match values.iter().find(|value| !(0.0..=1.0).contains(*value)) {
        None => Ok(Some(values)),
        Some(value) => Err(PyValueError::new_err(format!(
            "the mask holds {value}, which is not in [0, 1]"
        ))),
    }
}
