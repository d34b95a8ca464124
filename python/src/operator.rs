//! How a sphere under far light looks from one camera, as a linear map of the light's harmonics.

use lobes::harmonics;
use lobes::reflectance::Variant;
use lobes::reflection::{self, Viewpoint};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{check_finite, check_result, doubles, shape_name, shaped};
use crate::coefficients::{Sets, wrap_all};
use crate::{error, interrupt, parallelism};

/// How a sphere under far light looks from one camera: a linear map of the light's harmonics.
///
/// The light is in the frame of the view, whose pole points at the camera. With θ the angle of a
/// normal from the line of sight and φ its azimuth about it,
///
/// B(θ, φ) = Σ_lm (ρ_d T^d_lm(θ) + ρ_s T^s_lm(θ)) (L_lm cos mφ + L_l,−m sin mφ).
///
/// Parameters
/// ----------
/// sigma : float
///     The roughness σ of Ward's lobe; 0 is a mirror.
/// rings : int or array_like of shape (rings,)
///     The angles θ in radians, or how many: then their cosines are Gauss–Legendre nodes over what
///     the camera sees.
/// degree : int
///     The largest degree of the light, at most 256.
/// variant : str
///     Which of Ward's lobes.
/// distance : float, optional
///     The camera's distance in radii of the sphere; far away unless said.
/// threads : bool
///     Whether all threads are used.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> operator = lobes.Operator(0.1, 8, 16, variant="gmd")
/// >>> light = lobes.Coefficients.zeros(16)
/// >>> light.array[0] = np.sqrt(4 * np.pi)  # radiance 1 from everywhere
/// >>> np.allclose(operator.forward(light, rho_d=1.0, rho_s=0.0, columns=40), 1)
/// True
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Operator {
    operator: reflection::Operator,
    sigma: f64,
    variant: Variant,
    distance: Option<f64>,
}

#[pymethods]
impl Operator {
    #[new]
    #[pyo3(signature = (sigma, rings, degree, variant="sampled", distance=None, threads=true))]
    fn new(
        py: Python<'_>,
        sigma: f64,
        rings: &Bound<'_, PyAny>,
        degree: usize,
        variant: &str,
        distance: Option<f64>,
        threads: bool,
    ) -> PyResult<Self> {
        let variant: Variant = variant.parse().map_err(error)?;
        let viewpoint = match distance {
            None => Viewpoint::Orthographic,
            Some(distance) => Viewpoint::Perspective { distance },
        };
        let rings = match rings.extract::<usize>() {
            Ok(count) => reflection::Operator::gauss_rings(viewpoint, count).map_err(error)?,
            Err(_) => {
                let given = doubles(rings, "the rings' angles")?;
                if given.ndim() != 1 {
                    return Err(PyValueError::new_err(format!(
                        "the rings' angles have the shape {}, which is not (rings,)",
                        shape_name(given.shape())
                    )));
                }
                given.as_slice()?.to_vec()
            }
        };
        let operator = interrupt::run(py, move || {
            let threads = parallelism(threads);
            reflection::Operator::new(variant, sigma, viewpoint, &rings, degree, threads)
        })?
        .map_err(error)?;
        Ok(Self {
            operator,
            sigma,
            variant,
            distance,
        })
    }

    /// The largest degree of the light.
    #[getter]
    fn degree(&self) -> usize {
        self.operator.degree()
    }

    /// The angles of the rings from the line of sight in radians, (rings,).
    #[getter]
    fn rings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let rings = self.operator.rings();
        shaped(py, &[rings.len()], rings.to_vec())
    }

    /// ρ_d T^d_lm + ρ_s T^s_lm of one order.
    ///
    /// Parameters
    /// ----------
    /// m : int
    ///     From 0 to the degree.
    /// rho_d, rho_s : float
    ///
    /// Returns
    /// -------
    /// ndarray, (rings, degree + 1 − m)
    ///     The degrees from m on.
    ///
    /// Examples
    /// --------
    /// >>> import lobes
    /// >>> lobes.Operator(0.1, 4, 8).block(2, 0.5, 0.1).shape
    /// (4, 7)
    fn block<'py>(
        &self,
        py: Python<'py>,
        m: usize,
        rho_d: f64,
        rho_s: f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let block = self.operator.block(m, rho_d, rho_s).map_err(error)?;
        let shape = [block.nrows(), block.ncols()];
        // A matrix is stored column by column.
        shaped(py, &shape, block.transpose().as_slice().to_vec())
    }

    /// The picture of a material under light.
    ///
    /// Parameters
    /// ----------
    /// light : Coefficients or array_like, (count,)
    ///     Of any degree.
    /// rho_d, rho_s : float
    /// columns : int
    ///     Column j is at φ = 2πj/columns.
    ///
    /// Returns
    /// -------
    /// ndarray, (rings, columns)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> operator = lobes.Operator(0.1, 4, 8)
    /// >>> operator.forward(lobes.random_field(np.ones(9), 1), 0.5, 0.1, columns=24).shape
    /// (4, 24)
    fn forward<'py>(
        &self,
        py: Python<'py>,
        light: &Bound<'py, PyAny>,
        rho_d: f64,
        rho_s: f64,
        columns: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let light = Sets::of(light, "the light")?.one("the light")?;
        let rings = self.operator.rings().len();
        crate::arrays::check_room(
            rings.saturating_mul(columns).saturating_mul(3),
            "the picture",
        )?;
        let picture = py
            .detach(|| self.operator.forward(&light, rho_d, rho_s, columns))
            .map_err(error)?;
        check_result(&picture, "a value of the picture")?;
        shaped(py, &[rings, columns], picture)
    }

    /// The transpose of `forward`: for every light L and picture y, Σ forward(L) y = Σ L
    /// adjoint(y).
    ///
    /// Parameters
    /// ----------
    /// picture : array_like, (rings, columns)
    /// rho_d, rho_s : float
    ///
    /// Returns
    /// -------
    /// Coefficients, ((degree + 1)²,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> operator, light = lobes.Operator(0.1, 4, 8), lobes.random_field(np.ones(9), 1)
    /// >>> y = np.arange(96.0).reshape(4, 24)
    /// >>> there = np.vdot(operator.forward(light, 0.5, 0.1, 24), y)
    /// >>> bool(np.isclose(there, np.vdot(light, operator.adjoint(y, 0.5, 0.1)), rtol=1e-12))
    /// True
    fn adjoint<'py>(
        &self,
        py: Python<'py>,
        picture: &Bound<'py, PyAny>,
        rho_d: f64,
        rho_s: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let picture = doubles(picture, "the picture")?;
        let rings = self.operator.rings().len();
        let &[rows, columns] = picture.shape() else {
            return Err(PyValueError::new_err(format!(
                "the picture has the shape {}, which is not ({rings}, columns)",
                shape_name(picture.shape())
            )));
        };
        if rows != rings {
            return Err(PyValueError::new_err(format!(
                "the picture has {rows} rows and the operator {rings} rings"
            )));
        }
        let values = picture.as_slice()?;
        check_finite(values, "the picture")?;
        let light = py
            .detach(|| self.operator.adjoint(values, rho_d, rho_s, columns))
            .map_err(error)?;
        check_result(light.as_slice(), "a coefficient")?;
        let degree = light.degree();
        let sets: Vec<harmonics::Coefficients> = vec![light];
        wrap_all(py, &[], sets, (degree, degree))
    }

    fn __repr__(&self) -> String {
        let distance = match self.distance {
            None => String::new(),
            Some(distance) => format!(", distance={distance:?}"),
        };
        format!(
            "<Operator of σ {:?}, {} rings, degree {}, {:?}{distance}>",
            self.sigma,
            self.operator.rings().len(),
            self.operator.degree(),
            self.variant.name()
        )
    }
}
