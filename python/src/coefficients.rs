//! Coefficient sets: what Python's `Coefficients` and arrays of full shape are here.

use lobes::harmonics::{self, coefficient_count};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::arrays::{check_finite, doubles, leading, shape_name, zeros};
use crate::error;

/// The class `lobes.Coefficients`, which is written in Python.
fn class(py: Python<'_>) -> PyResult<&Bound<'_, PyAny>> {
    static CLASS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    CLASS
        .get_or_try_init(py, || {
            let module = py.import("lobes._coefficients")?;
            Ok(module.getattr("Coefficients")?.unbind())
        })
        .map(|class| class.bind(py))
}

/// Coefficients (…, count) of one degree and one number of orders.
pub(crate) struct Sets<'py> {
    values: PyReadonlyArrayDyn<'py, f64>,
    pub(crate) degree: usize,
    pub(crate) orders: usize,
    /// The shape before the coefficients.
    pub(crate) shape: Vec<usize>,
}

impl<'py> Sets<'py> {
    /// From `lobes.Coefficients`, or from an array of all orders, whose length tells its degree.
    pub(crate) fn of(object: &Bound<'py, PyAny>, what: &str) -> PyResult<Self> {
        Self::with_shape(object, what, None)
    }

    /// As [`of`](Self::of), where an array is taken to have this degree and these orders.
    pub(crate) fn with_shape(
        object: &Bound<'py, PyAny>,
        what: &str,
        expected: Option<(usize, usize)>,
    ) -> PyResult<Self> {
        let values = doubles(object, what)?;
        check_finite(values.as_slice()?, what)?;
        let Some(&count) = values.shape().last() else {
            return Err(PyTypeError::new_err(format!(
                "{what} is a single number where an array of coefficients is needed"
            )));
        };
        let (degree, orders) = if object.is_instance(class(object.py())?)? {
            (
                object.getattr("degree")?.extract()?,
                object.getattr("orders")?.extract()?,
            )
        } else if let Some(expected) = expected {
            expected
        } else {
            let degree = count.isqrt().saturating_sub(1);
            if count != (degree + 1) * (degree + 1) {
                return Err(PyValueError::new_err(format!(
                    "{what} has {count} values, which are not (degree + 1)² of any degree; \
                     give lobes.Coefficients where orders are left out"
                )));
            }
            (degree, degree)
        };
        if let Some((wanted, and)) = expected
            && (degree, orders) != (wanted, and)
        {
            return Err(PyValueError::new_err(format!(
                "{what} is of degree {degree} and orders {orders} where degree {wanted} and orders {and} are needed"
            )));
        }
        let expected = degree
            .checked_add(1)
            .filter(|_| degree < 1 << 30)
            .map(|_| coefficient_count(degree, orders));
        if expected != Some(count) {
            return Err(PyValueError::new_err(format!(
                "{what} has the shape {}, whose last dimension does not hold the coefficients of degree {degree} and orders {orders}",
                shape_name(values.shape())
            )));
        }
        let shape = leading(values.shape(), &[count], what)?;
        Ok(Self {
            values,
            degree,
            orders,
            shape,
        })
    }

    /// All values, one set after the other.
    pub(crate) fn values(&self) -> PyResult<&[f64]> {
        Ok(self.values.as_slice()?)
    }

    /// How many coefficients a set has.
    pub(crate) fn count(&self) -> usize {
        coefficient_count(self.degree, self.orders)
    }

    /// How many sets there are.
    pub(crate) fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Each set by itself.
    pub(crate) fn each(&self) -> PyResult<impl Iterator<Item = PyResult<harmonics::Coefficients>>> {
        let sets = self.values()?.chunks_exact(self.count());
        Ok(sets.map(|values| {
            harmonics::Coefficients::from_vec(self.degree, self.orders, values.to_vec())
                .map_err(error)
        }))
    }

    /// The one set that there is.
    pub(crate) fn one(&self, what: &str) -> PyResult<harmonics::Coefficients> {
        if !self.shape.is_empty() {
            return Err(PyValueError::new_err(format!(
                "{what} holds a batch of the shape {} where one set is needed",
                shape_name(&self.shape)
            )));
        }
        harmonics::Coefficients::from_vec(self.degree, self.orders, self.values()?.to_vec())
            .map_err(error)
    }

    /// An array of zeros: as many rows of another length as there are sets.
    pub(crate) fn rows(
        &self,
        py: Python<'py>,
        length: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let mut shape = self.shape.clone();
        shape.push(length);
        zeros(py, &shape)
    }
}

/// An array (…, count) as `lobes.Coefficients`.
pub(crate) fn wrap<'py>(
    array: Bound<'py, PyArrayDyn<f64>>,
    degree: usize,
    orders: usize,
) -> PyResult<Bound<'py, PyAny>> {
    class(array.py())?.call1((array, degree, orders))
}

/// Sets of one shape as `lobes.Coefficients` with these dimensions before them.
pub(crate) fn wrap_all<'py>(
    py: Python<'py>,
    shape: &[usize],
    sets: Vec<harmonics::Coefficients>,
    (degree, orders): (usize, usize),
) -> PyResult<Bound<'py, PyAny>> {
    let mut shape = shape.to_vec();
    shape.push(coefficient_count(degree, orders));
    let flat = sets.into_iter().flat_map(harmonics::Coefficients::into_vec);
    wrap(
        crate::arrays::shaped(py, &shape, flat.collect())?,
        degree,
        orders,
    )
}
