//! Transforms, rotation, and harmonics at directions.

use lobes::Parallelism;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics;
use lobes::sphere::{self, Grid};
use numpy::{
    Complex64, Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{
    Directions, Two, check_result, check_room, complexes, doubles, leading, numbers, shape_name,
    shaped, singles, type_name, zeros,
};
use crate::coefficients::{Sets, wrap, wrap_all};
use crate::{error, interrupt, parallelism};

/// What fits between two looks for Ctrl-C: multiplications of about a fifth of a second on one
/// core.
const BETWEEN_LOOKS: usize = 200_000_000;

/// How many pieces of work of so many multiplications are done between two looks for Ctrl-C.
fn at_a_time(cost: usize, threads: Parallelism) -> usize {
    (BETWEEN_LOOKS * threads.threads() / cost.max(1)).max(1)
}

/// A grid by its name.
fn named_grid(
    grid: &str,
    rings: usize,
    columns: usize,
    first_azimuth: Option<f64>,
    descending: bool,
) -> PyResult<Grid> {
    if first_azimuth.is_some_and(|azimuth| !azimuth.is_finite()) {
        return Err(PyValueError::new_err("first_azimuth is not finite"));
    }
    let mut grid = match grid {
        "gauss-legendre" => Grid::gauss_legendre(rings, columns),
        "clenshaw-curtis" => Grid::clenshaw_curtis(rings, columns),
        "fejer" => Grid::fejer(rings, columns),
        "lat-long" => Grid::lat_long(rings, columns),
        "healpix" if columns.is_multiple_of(4) && rings.checked_add(1) == Some(columns) => {
            Grid::healpix(columns / 4)
        }
        "healpix" => {
            return Err(PyValueError::new_err(format!(
                "HEALPix has 4 nside - 1 rings and at most 4 nside columns, not {rings} and {columns}; use Transform.healpix"
            )));
        }
        other => {
            return Err(PyValueError::new_err(format!(
                "there is no grid {other:?}; there are gauss-legendre, clenshaw-curtis, fejer, lat-long and healpix"
            )));
        }
    }
    .map_err(error)?;
    if let Some(azimuth) = first_azimuth {
        grid = grid.with_first_azimuth(azimuth);
    }
    if descending {
        grid = grid.descending();
    }
    Ok(grid)
}

/// A plan for analysis and synthesis on one grid, to one degree.
///
/// Parameters
/// ----------
/// grid : str
///     "gauss-legendre", "clenshaw-curtis" and "fejer" are exact rules whose azimuths grow with the
///     column; "lat-long" is that of environment maps; "healpix" is made by `Transform.healpix`.
/// rings : int
/// columns : int
/// degree : int
///     The largest l.
/// orders : int, optional
///     The largest m, the degree unless given.
/// first_azimuth : float, optional
///     That of column 0, in radians; 0 unless given, and half a column for "fejer".
/// descending : bool
///     Whether azimuths fall as the column grows.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> transform = lobes.Transform("gauss-legendre", rings=8, columns=16, degree=7)
/// >>> coefficients = transform.analyse(np.cos(transform.colatitudes)[:, None] * np.ones(16))
/// >>> bool(np.isclose(coefficients.get(1, 0), np.sqrt(4 * np.pi / 3)))
/// True
#[pyclass(frozen, eq, module = "lobes")]
pub(crate) struct Transform {
    transform: harmonics::Transform,
    grid: String,
    first_azimuth: Option<f64>,
}

impl PartialEq for Transform {
    fn eq(&self, other: &Self) -> bool {
        let key = |one: &Self| (one.transform.degree(), one.transform.orders());
        key(self) == key(other) && self.transform.grid() == other.transform.grid()
    }
}

impl Transform {
    /// The grid.
    pub(crate) fn grid_itself(&self) -> &Grid {
        self.transform.grid()
    }

    fn rings_and_columns(&self) -> (usize, usize) {
        let grid = self.transform.grid();
        (grid.rings(), grid.columns())
    }

    /// The shape of a map.
    pub(crate) fn map_shape(&self) -> Vec<usize> {
        let grid = self.transform.grid();
        if grid.has_rings_alike() {
            vec![grid.rings(), grid.columns()]
        } else {
            vec![grid.len()]
        }
    }

    /// Multiplications of one map, about.
    fn cost(&self) -> usize {
        let grid = self.transform.grid();
        self.transform.coefficient_count() * grid.rings() + 16 * grid.len()
    }
}

/// One of the transform's `_into` functions: a batch from here to there.
type Into = fn(
    &harmonics::Transform,
    usize,
    &[f64],
    &mut [f64],
    &mut [f64],
    Parallelism,
) -> lobes::Result<()>;

impl Transform {
    fn to_sets<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyAny>,
        threads: bool,
        into: Into,
    ) -> PyResult<Bound<'py, PyAny>> {
        let maps = doubles(maps, "the array of maps")?;
        let mut shape = leading(maps.shape(), &self.map_shape(), "the array of maps")?;
        let size = self.transform.grid().len();
        let count = self.transform.coefficient_count();
        shape.push(count);
        let out = zeros::<f64>(py, &shape)?;
        let mut guard = out.readwrite();
        let (input, output) = (maps.as_slice()?, guard.as_slice_mut()?);
        self.in_batches(py, (input, size), (output, count), threads, into)?;
        check_result(output, "a coefficient of the maps")?;
        drop(guard);
        wrap(out, self.degree(), self.orders())
    }

    fn to_maps<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
        into: Into,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let shape = (self.degree(), self.orders());
        let sets = Sets::with_shape(coefficients, "the array of coefficients", Some(shape))?;
        let mut shape = sets.shape.clone();
        shape.extend(self.map_shape());
        let size = self.transform.grid().len();
        let out = zeros::<f64>(py, &shape)?;
        let mut guard = out.readwrite();
        let (input, output) = (sets.values()?, guard.as_slice_mut()?);
        let count = self.transform.coefficient_count();
        self.in_batches(py, (input, count), (output, size), threads, into)?;
        check_result(output, "a value of a map")?;
        drop(guard);
        Ok(out)
    }

    /// So many at a time that Ctrl-C is looked for; each with the length of one.
    fn in_batches(
        &self,
        py: Python<'_>,
        (input, input_len): (&[f64], usize),
        (output, output_len): (&mut [f64], usize),
        threads: bool,
        into: Into,
    ) -> PyResult<()> {
        let threads = parallelism(threads);
        let batch = at_a_time(self.cost(), threads);
        let mut scratch = Vec::new();
        for (input, output) in input
            .chunks(batch * input_len)
            .zip(output.chunks_mut(batch * output_len))
        {
            let batch = input.len() / input_len;
            py.detach(|| {
                scratch.resize(self.transform.scratch_len(batch), 0.0);
                into(&self.transform, batch, input, output, &mut scratch, threads)
            })
            .map_err(error)?;
            py.check_signals()?;
        }
        Ok(())
    }
}

#[pymethods]
impl Transform {
    #[new]
    #[pyo3(signature = (grid, rings, columns, degree, orders=None, first_azimuth=None, descending=false))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn new(
        py: Python<'_>,
        grid: &str,
        rings: usize,
        columns: usize,
        degree: usize,
        orders: Option<usize>,
        first_azimuth: Option<f64>,
        descending: bool,
    ) -> PyResult<Self> {
        let name = grid.to_owned();
        let transform = py.detach(|| {
            let grid = named_grid(grid, rings, columns, first_azimuth, descending)?;
            harmonics::Transform::with_orders(&grid, degree, orders.unwrap_or(degree))
                .map_err(error)
        })?;
        Ok(Self {
            transform,
            grid: name,
            first_azimuth,
        })
    }

    /// A plan for the pixels of HEALPix in the order of rings, healpy's with ``nest=False``.
    ///
    /// `analyse` is by the area of pixels alone there; `analyse_iterated` is healpy's `map2alm`, and
    /// `analyse_least_squares` exact.
    ///
    /// Parameters
    /// ----------
    /// nside : int
    ///     From 1 to 4096, a power of 2 or not.
    /// degree : int
    ///     At most 4 nside − 2; to 2 nside coefficients are well determined by maps.
    /// orders : int, optional
    ///     The largest order, the degree unless given.
    ///
    /// Returns
    /// -------
    /// Transform
    ///     Of maps (12 nside²,).
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform.healpix(4, 8)
    /// >>> f = lobes.random_field(np.ones(9), 1)
    /// >>> found, residual, steps, condition = transform.analyse_least_squares(transform.synthesise(f))
    /// >>> np.allclose(found, f, atol=1e-10) and condition < 1.2
    /// True
    #[staticmethod]
    #[pyo3(signature = (nside, degree, orders=None))]
    fn healpix(
        py: Python<'_>,
        nside: usize,
        degree: usize,
        orders: Option<usize>,
    ) -> PyResult<Self> {
        let transform = py
            .detach(|| {
                let grid = Grid::healpix(nside)?;
                harmonics::Transform::with_orders(&grid, degree, orders.unwrap_or(degree))
            })
            .map_err(error)?;
        Ok(Self {
            transform,
            grid: "healpix".into(),
            first_azimuth: None,
        })
    }

    /// The name of the grid.
    #[getter]
    fn grid(&self) -> &str {
        &self.grid
    }

    /// The largest degree l.
    #[getter]
    fn degree(&self) -> usize {
        self.transform.degree()
    }

    /// The largest order |m|.
    #[getter]
    fn orders(&self) -> usize {
        self.transform.orders()
    }

    /// The shape of a map: (rings, columns), or (pixels,) on HEALPix.
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.map_shape())
    }

    /// How many coefficients a map has.
    #[getter]
    fn coefficient_count(&self) -> usize {
        self.transform.coefficient_count()
    }

    /// The angle of each ring from the north pole, in radians.
    #[getter]
    fn colatitudes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let grid = self.transform.grid();
        let angles = (0..grid.rings()).map(|ring| grid.colatitude(ring));
        PyArray1::from_vec(py, angles.collect())
    }

    /// The azimuth of each column, or of each pixel on HEALPix, in radians, not reduced to one turn.
    #[getter]
    fn azimuths<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let grid = self.transform.grid();
        let rings = if grid.has_rings_alike() {
            1
        } else {
            grid.rings()
        };
        let angles = (0..rings).flat_map(|ring| {
            (0..grid.ring_columns(ring)).map(move |column| grid.azimuth_at(ring, column))
        });
        PyArray1::from_vec(py, angles.collect())
    }

    /// The solid angle that a point of each ring stands for: over the grid they sum to 4π.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let grid = self.transform.grid();
        let weights = (0..grid.rings()).map(|ring| grid.ring_weight(ring));
        PyArray1::from_vec(py, weights.collect())
    }

    /// The direction of each point in the harmonic frame, (rings, columns, 3), or (pixels, 3).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let grid = self.transform.grid();
        check_room(3 * grid.len(), "the directions of the grid")?;
        let mut values = Vec::with_capacity(3 * grid.len());
        for ring in 0..grid.rings() {
            for column in 0..grid.ring_columns(ring) {
                values.extend(grid.direction(ring, column).to_array());
            }
        }
        let mut shape = self.map_shape();
        shape.push(3);
        shaped(py, &shape, values)
    }

    /// The coefficients of maps; those of one call share the recurrence.
    ///
    /// Parameters
    /// ----------
    /// maps : array_like, (…, rings, columns), or (…, pixels) on HEALPix
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// Coefficients, (…, count)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("fejer", 8, 16, 3)
    /// >>> coefficients = transform.analyse(np.ones((2, 8, 16), "float32"))
    /// >>> coefficients
    /// <Coefficients of degree 3, orders 3, batch of (2,)>
    /// >>> np.allclose(coefficients.get(0, 0), np.sqrt(4 * np.pi))
    /// True
    #[pyo3(signature = (maps, threads=true))]
    fn analyse<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.to_sets(py, maps, threads, harmonics::Transform::analyse_into)
    }

    /// The maps of coefficients.
    ///
    /// Parameters
    /// ----------
    /// coefficients : Coefficients or array_like, (…, count)
    ///     Of the transform's degree and orders.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray, (…, rings, columns), or (…, pixels) on HEALPix
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("gauss-legendre", 4, 8, 3)
    /// >>> f = np.arange(16.0)
    /// >>> np.allclose(transform.analyse(transform.synthesise(f)), f)
    /// True
    #[pyo3(signature = (coefficients, threads=true))]
    fn synthesise<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.to_maps(
            py,
            coefficients,
            threads,
            harmonics::Transform::synthesise_into,
        )
    }

    /// The adjoint of `synthesise`: sums of maps times each harmonic, without weights.
    ///
    /// For all coefficients c and maps y the sum of synthesise(c) · y is the sum of c ·
    /// synthesise_adjoint(y), so that it is the gradient of ½ Σ (synthesise(c) − d)² at y =
    /// synthesise(c) − d.
    ///
    /// Parameters
    /// ----------
    /// maps : array_like, (…, rings, columns), or (…, pixels) on HEALPix
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// Coefficients, (…, count)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("fejer", 8, 16, 3)
    /// >>> c, y = np.arange(16.0), np.arange(128.0).reshape(8, 16)
    /// >>> there = np.vdot(transform.synthesise(c), y)
    /// >>> bool(np.isclose(there, np.vdot(c, transform.synthesise_adjoint(y)), rtol=1e-12))
    /// True
    #[pyo3(signature = (maps, threads=true))]
    fn synthesise_adjoint<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let into = harmonics::Transform::synthesise_adjoint_into;
        self.to_sets(py, maps, threads, into)
    }

    /// The adjoint of `analyse`: the maps whose sums with maps are those of the coefficients with
    /// the maps' coefficients.
    ///
    /// Parameters
    /// ----------
    /// coefficients : Coefficients or array_like, (…, count)
    ///     Of the transform's degree and orders.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray, (…, rings, columns), or (…, pixels) on HEALPix
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("fejer", 8, 16, 3)
    /// >>> c, y = np.arange(16.0), np.arange(128.0).reshape(8, 16)
    /// >>> there = np.vdot(transform.analyse_adjoint(c), y)
    /// >>> bool(np.isclose(there, np.vdot(c, transform.analyse(y)), rtol=1e-12))
    /// True
    #[pyo3(signature = (coefficients, threads=true))]
    fn analyse_adjoint<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let into = harmonics::Transform::analyse_adjoint_into;
        self.to_maps(py, coefficients, threads, into)
    }

    /// The coefficients whose map is nearest to a map, by least squares under the grid's weights.
    ///
    /// Parameters
    /// ----------
    /// map : array_like, of the transform's shape
    /// tolerance : float
    ///     What the gradient of the squares falls to, of what it was.
    /// threads : bool
    ///     Whether all cores work.
    ///
    /// Returns
    /// -------
    /// coefficients : Coefficients, (count,)
    /// residual : float
    ///     The rms of what they leave of the map.
    /// steps : int
    ///     Of conjugate gradients.
    /// condition : float
    ///     By how much relative errors of the map can be multiplied, estimated from below.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform.healpix(4, 8)
    /// >>> coefficients, residual, *_ = transform.analyse_least_squares(np.ones(192))
    /// >>> bool(np.isclose(coefficients.get(0, 0), np.sqrt(4 * np.pi))), residual < 1e-12
    /// (True, True)
    #[pyo3(signature = (map, tolerance=1e-12, threads=true))]
    fn analyse_least_squares<'py>(
        &self,
        py: Python<'py>,
        map: &Bound<'py, PyAny>,
        tolerance: f64,
        threads: bool,
    ) -> PyResult<Fitted<'py>> {
        let map = doubles(map, "the map")?;
        one_map(&leading(map.shape(), &self.map_shape(), "the map")?)?;
        let values = map.as_slice()?;
        let fit = py
            .detach(|| {
                self.transform
                    .analyse_least_squares(values, tolerance, parallelism(threads))
            })
            .map_err(error)?;
        fitted(py, fit)
    }

    /// The coefficients of maps by the grid's weights, corrected some times by those of what they
    /// leave of the maps: healpy's `map2alm` with `iter`.
    ///
    /// Parameters
    /// ----------
    /// maps : array_like, (…, *shape)
    /// iterations : int
    /// threads : bool
    ///     Whether all cores work.
    ///
    /// Returns
    /// -------
    /// Coefficients, (…, count)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform.healpix(8, 16)
    /// >>> f = lobes.random_field(np.ones(17), 1)
    /// >>> error = np.abs(transform.analyse_iterated(transform.synthesise(f), 3).array - f.array).max()
    /// >>> bool(error < 1e-3)
    /// True
    #[pyo3(signature = (maps, iterations=3, threads=true))]
    fn analyse_iterated<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyAny>,
        iterations: usize,
        threads: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        const MOST: usize = 1000;
        if iterations > MOST {
            return Err(PyValueError::new_err(format!(
                "{iterations} iterations are more than {MOST}; analyse_least_squares needs fewer"
            )));
        }
        let maps = doubles(maps, "the array of maps")?;
        let shape = leading(maps.shape(), &self.map_shape(), "the array of maps")?;
        let mut sets = Vec::new();
        for map in maps.as_slice()?.chunks_exact(self.transform.grid().len()) {
            let set = py
                .detach(|| {
                    self.transform
                        .analyse_iterated(map, iterations, parallelism(threads))
                })
                .map_err(error)?;
            check_result(set.as_slice(), "a coefficient of the maps")?;
            sets.push(set);
            py.check_signals()?;
        }
        wrap_all(py, &shape, sets, (self.degree(), self.orders()))
    }

    /// The gradients of the fields of coefficients at every point of the grid.
    ///
    /// Parameters
    /// ----------
    /// coefficients : Coefficients or array_like, (…, count)
    ///     Of the transform's degree, all orders.
    /// threads : bool
    ///     Whether all cores work.
    ///
    /// Returns
    /// -------
    /// south, east : ndarray, (…, rings, columns)
    ///     ∂f/∂θ and (1/sin θ) ∂f/∂φ, finite at the poles too.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("clenshaw-curtis", 5, 8, 1)
    /// >>> south, east = transform.gradient([0, np.sqrt(4 * np.pi / 3), 0, 0])  # of cos θ
    /// >>> np.allclose(south[:, 0], -np.sin(transform.colatitudes)) and np.allclose(east, 0)
    /// True
    #[pyo3(signature = (coefficients, threads=true))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Two<'py>> {
        let plan = (self.degree(), self.orders());
        let sets = Sets::with_shape(coefficients, "the array of coefficients", Some(plan))?;
        let mut shape = sets.shape.clone();
        shape.extend(self.map_shape());
        let size = self.transform.grid().len();
        check_room(sets.len().saturating_mul(2 * size), "the gradients")?;
        let (mut south, mut east) = (Vec::new(), Vec::new());
        for set in sets.each()? {
            let set = set?;
            let [one, other] = py
                .detach(|| self.transform.gradient(&set, parallelism(threads)))
                .map_err(error)?;
            south.extend(one);
            east.extend(other);
            py.check_signals()?;
        }
        Ok((shaped(py, &shape, south)?, shaped(py, &shape, east)?))
    }

    /// The complex map of the coefficients a_lm of a complex field: orthonormal, with the
    /// Condon–Shortley phase, as SciPy's `sph_harm_y`.
    ///
    /// Parameters
    /// ----------
    /// coefficients : array_like of complex, ((degree + 1)²,)
    ///     At l² + l + m, m from −l to l.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of complex, (rings, columns), or (pixels,) on HEALPix
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("gauss-legendre", 4, 8, 3)
    /// >>> a = np.arange(16) * (1 + 2j)
    /// >>> np.allclose(transform.analyse_complex(transform.synthesise_complex(a)), a)
    /// True
    #[pyo3(signature = (coefficients, threads=true))]
    fn synthesise_complex<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
        let set = complex_set(coefficients, self.degree())?;
        let map = py
            .detach(|| {
                self.transform
                    .synthesise_complex(&set, parallelism(threads))
            })
            .map_err(error)?;
        shaped(py, &self.map_shape(), map)
    }

    /// The coefficients a_lm of a complex map, as `synthesise_complex` takes them.
    ///
    /// Parameters
    /// ----------
    /// map : array_like of complex, (rings, columns), or (pixels,) on HEALPix
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of complex, ((degree + 1)²,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.Transform("gauss-legendre", 4, 8, 3)
    /// >>> a = transform.analyse_complex(np.full((4, 8), 1 - 1j))
    /// >>> np.isclose(a[0], (1 - 1j) * np.sqrt(4 * np.pi)) and np.allclose(a[1:], 0)
    /// True
    #[pyo3(signature = (map, threads=true))]
    fn analyse_complex<'py>(
        &self,
        py: Python<'py>,
        map: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
        let map = complexes(map, "the map")?;
        one_map(&leading(map.shape(), &self.map_shape(), "the map")?)?;
        let values = map.as_slice()?;
        let set = py
            .detach(|| self.transform.analyse_complex(values, parallelism(threads)))
            .map_err(error)?;
        let values = set.into_vec();
        shaped(py, &[values.len()], values)
    }

    fn __repr__(&self) -> String {
        let (rings, columns) = self.rings_and_columns();
        let (degree, orders) = (self.degree(), self.orders());
        format!(
            "Transform({:?}, rings={rings}, columns={columns}, degree={degree}, orders={orders})",
            self.grid
        )
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let this = slf.get();
        let (rings, columns) = this.rings_and_columns();
        let descending = this.transform.grid().is_descending() && this.grid != "lat-long";
        let arguments = (
            &this.grid,
            rings,
            columns,
            this.degree(),
            this.orders(),
            this.first_azimuth,
            descending,
        );
        Ok((
            slf.get_type().into_any(),
            arguments.into_pyobject(slf.py())?,
        ))
    }
}

/// Coefficients, residual, steps and condition.
type Fitted<'py> = (Bound<'py, PyAny>, f64, usize, f64);

fn fitted(py: Python<'_>, fit: harmonics::LeastSquares) -> PyResult<Fitted<'_>> {
    let set = fit.coefficients;
    check_result(set.as_slice(), "a coefficient")?;
    let shape = (set.degree(), set.orders());
    let set = wrap_all(py, &[], vec![set], shape)?;
    Ok((set, fit.residual, fit.steps, fit.condition))
}

/// Refuses several maps.
fn one_map(before: &[usize]) -> PyResult<()> {
    if before.is_empty() {
        Ok(())
    } else {
        Err(PyValueError::new_err(
            "there are several maps where one is needed",
        ))
    }
}

/// `Transform` in single precision: half the memory a value, and faster, with an error below
/// 1.3e-6 of the root mean square to degree 511 and below 6e-6 at 4095.
///
/// Parameters
/// ----------
/// grid : str
///     As of `Transform`, but HEALPix.
/// rings : int
/// columns : int
/// degree : int
///     The largest l.
/// orders : int, optional
///     The largest m, the degree unless given.
/// first_azimuth : float, optional
///     As of `Transform`.
/// descending : bool
///     Whether azimuths fall as the column grows.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> transform = lobes.SingleTransform("gauss-legendre", rings=8, columns=16, degree=7)
/// >>> map = transform.synthesise(np.eye(64, dtype="float32")[0])
/// >>> map.dtype, bool(np.allclose(map, 1 / np.sqrt(4 * np.pi)))
/// (dtype('float32'), True)
#[pyclass(frozen, module = "lobes")]
pub(crate) struct SingleTransform(harmonics::SingleTransform);

/// One of the transform's `_into` functions.
type SingleInto = fn(
    &harmonics::SingleTransform,
    &[f32],
    &mut [f32],
    &mut [f32],
    Parallelism,
) -> lobes::Result<()>;

impl SingleTransform {
    fn map_shape(&self) -> [usize; 2] {
        [self.0.grid().rings(), self.0.grid().columns()]
    }

    /// Each array of the shape `from` to one of the shape `to`.
    fn each<'py>(
        &self,
        py: Python<'py>,
        (values, what): (&Bound<'py, PyAny>, &'static str),
        (from, to): (&[usize], &[usize]),
        threads: bool,
        into: SingleInto,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let values = singles(values, what)?;
        let mut shape = leading(values.shape(), from, what)?;
        shape.extend(to);
        let out = zeros::<f32>(py, &shape)?;
        let mut guard = out.readwrite();
        let (input, output) = (values.as_slice()?, guard.as_slice_mut()?);
        let (from, to) = (from.iter().product(), to.iter().product());
        let mut scratch = vec![0.0; self.0.scratch_len()];
        for (input, output) in input.chunks_exact(from).zip(output.chunks_exact_mut(to)) {
            py.detach(|| into(&self.0, input, output, &mut scratch, parallelism(threads)))
                .map_err(error)?;
            py.check_signals()?;
        }
        drop(guard);
        Ok(out)
    }
}

#[pymethods]
impl SingleTransform {
    #[new]
    #[pyo3(signature = (grid, rings, columns, degree, orders=None, first_azimuth=None, descending=false))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn new(
        py: Python<'_>,
        grid: &str,
        rings: usize,
        columns: usize,
        degree: usize,
        orders: Option<usize>,
        first_azimuth: Option<f64>,
        descending: bool,
    ) -> PyResult<Self> {
        py.detach(|| {
            let grid = named_grid(grid, rings, columns, first_azimuth, descending)?;
            harmonics::SingleTransform::with_orders(&grid, degree, orders.unwrap_or(degree))
                .map(Self)
                .map_err(error)
        })
    }

    /// The largest degree l.
    #[getter]
    fn degree(&self) -> usize {
        self.0.degree()
    }

    /// The largest order |m|.
    #[getter]
    fn orders(&self) -> usize {
        self.0.orders()
    }

    /// The shape of a map: (rings, columns).
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.map_shape())
    }

    /// How many coefficients a map has.
    #[getter]
    fn coefficient_count(&self) -> usize {
        self.0.coefficient_count()
    }

    /// The maps of coefficients.
    ///
    /// Parameters
    /// ----------
    /// coefficients : array_like of float32, (…, count)
    ///     In the order of `Coefficients`; numbers of another type are rounded.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, (…, rings, columns)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> single, double = (kind("fejer", 8, 16, 3) for kind in (lobes.SingleTransform, lobes.Transform))
    /// >>> f = np.arange(16.0)
    /// >>> np.allclose(single.synthesise(f), double.synthesise(f), atol=1e-5)
    /// True
    #[pyo3(signature = (coefficients, threads=true))]
    fn synthesise<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let values = (coefficients, "the array of coefficients");
        let shapes = (&[self.0.coefficient_count()][..], &self.map_shape()[..]);
        let into = harmonics::SingleTransform::synthesise_into;
        self.each(py, values, shapes, threads, into)
    }

    /// The coefficients of maps.
    ///
    /// Parameters
    /// ----------
    /// maps : array_like of float32, (…, rings, columns)
    ///     Numbers of another type are rounded.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, (…, count)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.SingleTransform("fejer", 8, 16, 3)
    /// >>> np.allclose(transform.analyse(np.ones((8, 16)))[0], np.sqrt(4 * np.pi))
    /// True
    #[pyo3(signature = (maps, threads=true))]
    fn analyse<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let shapes = (&self.map_shape()[..], &[self.0.coefficient_count()][..]);
        let into = harmonics::SingleTransform::analyse_into;
        self.each(py, (maps, "the array of maps"), shapes, threads, into)
    }

    /// The adjoint of `synthesise`: sums of maps times harmonics over the grid's points.
    ///
    /// Parameters
    /// ----------
    /// maps : array_like of float32, (…, rings, columns)
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, (…, count)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.SingleTransform("fejer", 8, 16, 3)
    /// >>> np.allclose(transform.synthesise_adjoint(np.ones((8, 16)))[0], 128 / np.sqrt(4 * np.pi))
    /// True
    #[pyo3(signature = (maps, threads=true))]
    fn synthesise_adjoint<'py>(
        &self,
        py: Python<'py>,
        maps: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let shapes = (&self.map_shape()[..], &[self.0.coefficient_count()][..]);
        let into = harmonics::SingleTransform::synthesise_adjoint_into;
        self.each(py, (maps, "the array of maps"), shapes, threads, into)
    }

    /// The adjoint of `analyse`.
    ///
    /// Parameters
    /// ----------
    /// coefficients : array_like of float32, (…, count)
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of float32, (…, rings, columns)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> transform = lobes.SingleTransform("gauss-legendre", 4, 8, 3)
    /// >>> weights = transform.analyse_adjoint(np.sqrt(4 * np.pi) * np.eye(16)[0])
    /// >>> bool(np.isclose(weights.sum(), 4 * np.pi))
    /// True
    #[pyo3(signature = (coefficients, threads=true))]
    fn analyse_adjoint<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let values = (coefficients, "the array of coefficients");
        let shapes = (&[self.0.coefficient_count()][..], &self.map_shape()[..]);
        let into = harmonics::SingleTransform::analyse_adjoint_into;
        self.each(py, values, shapes, threads, into)
    }

    fn __repr__(&self) -> String {
        let [rings, columns] = self.map_shape();
        format!(
            "<SingleTransform {rings}×{columns}, degree {}, orders {}>",
            self.0.degree(),
            self.0.orders()
        )
    }
}

/// A plan for rotating coefficients of one degree.
///
/// Parameters
/// ----------
/// degree : int
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.Rotation(31)
/// Rotation(31)
#[pyclass(frozen, module = "lobes")]
pub(crate) struct Rotation(harmonics::Rotation);

#[pymethods]
impl Rotation {
    #[new]
    fn new(py: Python<'_>, degree: usize) -> PyResult<Self> {
        crate::interrupt::run(py, move || harmonics::Rotation::new(degree))?
            .map(Self)
            .map_err(error)
    }

    /// The degree.
    #[getter]
    fn degree(&self) -> usize {
        self.0.degree()
    }

    /// The coefficients of f(R⁻¹ ω).
    ///
    /// Parameters
    /// ----------
    /// coefficients : Coefficients or array_like, (…, count)
    ///     Of the plan's degree.
    /// quaternion : array_like, (4,)
    ///     (x, y, z, w) of the rotation R in the harmonic frame, of any length but 0.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// Coefficients, (…, (degree + 1)²)
    ///     Of all orders.
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> x = lobes.Coefficients([0.0, 0.0, 1.0, 0.0])  # as x; by order, which is (1, z, x, y)
    /// >>> turn = [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]  # a quarter about z, from x to y
    /// >>> np.allclose(lobes.Rotation(1).rotate(x, turn), [0, 0, 0, 1])
    /// True
    #[pyo3(signature = (coefficients, quaternion, threads=true))]
    fn rotate<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        quaternion: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let sets = Sets::of(coefficients, "the array of coefficients")?;
        let quaternion = DQuat::from_array(numbers(quaternion, "the quaternion")?);
        let degree = self.0.degree();
        if sets.degree != degree {
            return Err(PyValueError::new_err(format!(
                "the array of coefficients is of degree {} and the rotation of degree {degree}",
                sets.degree
            )));
        }
        let mut scratch = vec![0.0; self.0.scratch_len()];
        let mut rotated = Vec::with_capacity(sets.len());
        for set in sets.each()? {
            let set = set?;
            let scratch = &mut scratch;
            let one = py.detach(|| {
                let mut out = harmonics::Coefficients::zeros(degree);
                self.0
                    .rotate_into(&set, quaternion, &mut out, scratch, parallelism(threads))
                    .map(|()| out)
            });
            let one = one.map_err(error)?;
            check_result(one.as_slice(), "a coefficient of the rotated function")?;
            rotated.push(one);
            py.check_signals()?;
        }
        wrap_all(py, &sets.shape, rotated, (degree, degree))
    }

    /// The coefficients a_lm of a complex field, turned as by `rotate`: what `wigner_rotation` of
    /// each degree makes of them.
    ///
    /// Parameters
    /// ----------
    /// coefficients : array_like of complex, ((degree + 1)²,)
    ///     At l² + l + m, m from −l to l.
    /// quaternion : array_like, (4,)
    ///     As of `rotate`.
    /// threads : bool
    ///     Whether all cores work; the answer is the same.
    ///
    /// Returns
    /// -------
    /// ndarray of complex, ((degree + 1)²,)
    ///
    /// Examples
    /// --------
    /// >>> import lobes, numpy as np
    /// >>> a, turn = np.arange(9) * (1 + 2j), [0.1, 0.2, 0.3, 0.4]
    /// >>> turned = lobes.Rotation(2).rotate_complex(a, turn)
    /// >>> np.allclose(turned[4:], lobes.wigner_rotation(2, turn) @ a[4:])
    /// True
    #[pyo3(signature = (coefficients, quaternion, threads=true))]
    fn rotate_complex<'py>(
        &self,
        py: Python<'py>,
        coefficients: &Bound<'py, PyAny>,
        quaternion: &Bound<'py, PyAny>,
        threads: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
        let set = complex_set(coefficients, self.0.degree())?;
        let quaternion = DQuat::from_array(numbers(quaternion, "the quaternion")?);
        let turned = py
            .detach(|| {
                self.0
                    .rotate_complex(&set, quaternion, parallelism(threads))
            })
            .map_err(error)?;
        let values = turned.into_vec();
        shaped(py, &[values.len()], values)
    }

    fn __repr__(&self) -> String {
        format!("Rotation({})", self.0.degree())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (usize,)) {
        (slf.get_type().into_any(), (slf.get().degree(),))
    }
}

/// The coefficients of one complex field.
fn complex_set(
    object: &Bound<'_, PyAny>,
    degree: usize,
) -> PyResult<harmonics::ComplexCoefficients> {
    let values = complexes(object, "the array of complex coefficients")?;
    if values.ndim() != 1 {
        return Err(PyValueError::new_err(format!(
            "the array of complex coefficients has {} dimensions where one is needed",
            values.ndim()
        )));
    }
    harmonics::ComplexCoefficients::from_vec(degree, values.as_slice()?.to_vec()).map_err(error)
}

/// A basis, and the room that its values at directions take.
fn basis_of(
    py: Python<'_>,
    directions: &Directions,
    degree: usize,
) -> PyResult<(harmonics::Basis, Vec<usize>)> {
    let basis = py.detach(|| harmonics::Basis::new(degree)).map_err(error)?;
    let mut shape = directions.shape.clone();
    shape.push(basis.count());
    Ok((basis, shape))
}

/// All Y_lm at directions.
///
/// Parameters
/// ----------
/// directions : array_like, (…, 3)
///     In the harmonic frame, of any length but 0.
/// degree : int
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Returns
/// -------
/// ndarray, (…, (degree + 1)²)
///     Stored by order.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> y = lobes.basis([0.0, 0.6, 0.8], 1) / np.sqrt(3 / (4 * np.pi))
/// >>> np.allclose(y, [np.sqrt(1 / 3), 0.8, 0, 0.6])  # 1, z, x, y
/// True
#[pyfunction]
#[pyo3(signature = (directions, degree, threads=true))]
pub(crate) fn basis<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyAny>,
    degree: usize,
    threads: bool,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let directions = Directions::of(directions, "the array of directions")?;
    let (basis, shape) = basis_of(py, &directions, degree)?;
    let out = zeros::<f64>(py, &shape)?;
    let mut guard = out.readwrite();
    let output = guard.as_slice_mut()?;
    let threads = parallelism(threads);
    let count = basis.count();
    let batch = at_a_time(2 * count, threads);
    for (directions, output) in directions
        .vectors
        .chunks(batch)
        .zip(output.chunks_mut(batch * count))
    {
        py.detach(|| basis.values(directions, output, threads))
            .map_err(error)?;
        py.check_signals()?;
    }
    drop(guard);
    Ok(out)
}

/// All Y_lm at directions, and their gradients on the unit sphere: tangent vectors.
///
/// Parameters
/// ----------
/// directions : array_like, (…, 3)
///     In the harmonic frame, of any length but 0.
/// degree : int
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Returns
/// -------
/// values : ndarray, (…, (degree + 1)²)
/// gradients : ndarray, (…, 3, (degree + 1)²)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> values, gradients = lobes.basis_gradients([1.0, 0.0, 0.0], 1)
/// >>> np.allclose(gradients[:, 1], [0, 0, np.sqrt(3 / (4 * np.pi))])  # of z
/// True
#[pyfunction]
#[pyo3(signature = (directions, degree, threads=true))]
pub(crate) fn basis_gradients<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyAny>,
    degree: usize,
    threads: bool,
) -> PyResult<Two<'py>> {
    let directions = Directions::of(directions, "the array of directions")?;
    let (basis, shape) = basis_of(py, &directions, degree)?;
    let mut slopes = directions.shape.clone();
    slopes.extend([3, basis.count()]);
    let (values, gradients) = (zeros::<f64>(py, &shape)?, zeros::<f64>(py, &slopes)?);
    let (mut value_guard, mut gradient_guard) = (values.readwrite(), gradients.readwrite());
    let threads = parallelism(threads);
    let count = basis.count();
    let batch = at_a_time(8 * count, threads);
    let outputs = value_guard
        .as_slice_mut()?
        .chunks_mut(batch * count)
        .zip(gradient_guard.as_slice_mut()?.chunks_mut(3 * batch * count));
    for (directions, (values, gradients)) in directions.vectors.chunks(batch).zip(outputs) {
        py.detach(|| basis.values_and_gradients(directions, values, gradients, threads))
            .map_err(error)?;
        py.check_signals()?;
    }
    drop((value_guard, gradient_guard));
    Ok((values, gradients))
}

/// The shape of values of each set at each direction.
fn at_shape(sets: &Sets<'_>, directions: &Directions) -> Vec<usize> {
    [&sets.shape[..], &directions.shape[..]].concat()
}

/// Coefficients summed at scattered directions: a value for each set and each direction.
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
/// directions : array_like, (*points, 3)
///     In the harmonic frame, of any length but 0.
/// threads : bool
///     Whether all cores work; the answer is the same.
/// tolerance : float, optional
///     Where it is given, 1e-13 to 0.1, the sums are made by a Fourier transform that need not be on a grid:
///     the rms of their error is within it, in units of the field's rms, and 10⁵ … 10⁷ directions take
///     little longer than as many points of a grid. Without it each sum is made by itself, to rounding.
///
/// Returns
/// -------
/// ndarray, (…, *points)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> f = np.arange(18.0).reshape(2, 9)
/// >>> directions = [[0, 0, 1], [1, 0, 0], [0.6, 0, -0.8]]
/// >>> np.allclose(lobes.synthesise_at(f, directions), f @ lobes.basis(directions, 2).T)
/// True
/// >>> f = lobes.random_field(np.ones(64), 1)
/// >>> directions = np.random.default_rng(1).standard_normal((1000, 3))
/// >>> exact, quick = lobes.synthesise_at(f, directions), lobes.synthesise_at(f, directions, tolerance=1e-9)
/// >>> bool(np.std(quick - exact) < 1e-9 * np.std(exact))
/// True
#[pyfunction]
#[pyo3(signature = (coefficients, directions, threads=true, tolerance=None))]
pub(crate) fn synthesise_at<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    threads: bool,
    tolerance: Option<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let sets = Sets::of(coefficients, "the array of coefficients")?;
    let directions = Directions::of(directions, "the array of directions")?;
    let threads = parallelism(threads);
    if let Some(tolerance) = tolerance {
        let plan = scattered(py, &directions, sets.degree, tolerance, threads)?;
        let shape = at_shape(&sets, &directions);
        check_room(
            sets.len().saturating_mul(plan.directions()),
            "the values at directions",
        )?;
        let mut values = Vec::with_capacity(sets.len() * plan.directions());
        for set in sets.each()? {
            let (set, plan) = (set?, plan.clone());
            let one = interrupt::run(py, move || plan.synthesise(&set, threads))?;
            values.extend(one.map_err(error)?);
        }
        return shaped(py, &shape, values);
    }
    let (basis, _) = basis_of(py, &directions, sets.degree)?;
    let batch = at_a_time(4 * basis.count(), threads);
    let length = directions.vectors.len();
    let mut sums = zeroed(sets.len(), length)?;
    for (set, sums) in sets.each()?.zip(sums.chunks_mut(length.max(1))) {
        let set = set?;
        for (directions, sums) in directions.vectors.chunks(batch).zip(sums.chunks_mut(batch)) {
            py.detach(|| basis.sums(&set, directions, sums, threads))
                .map_err(error)?;
            py.check_signals()?;
        }
    }
    check_result(&sums, "a value")?;
    shaped(py, &at_shape(&sets, &directions), sums)
}

/// A plan for sums at many directions.
fn scattered(
    py: Python<'_>,
    directions: &Directions,
    degree: usize,
    tolerance: f64,
    threads: Parallelism,
) -> PyResult<harmonics::ScatteredTransform> {
    let vectors = directions.vectors.clone();
    interrupt::run(py, move || {
        harmonics::ScatteredTransform::new(degree, &vectors, tolerance, threads)
    })?
    .map_err(error)
}

/// The adjoint of `synthesise_at`: sums of values times each harmonic.
///
/// Parameters
/// ----------
/// values : array_like, (…, n)
/// directions : array_like, (n, 3)
///     In the harmonic frame, of any length but 0.
/// degree : int
/// threads : bool
///     Whether all cores work; the answer is the same.
/// tolerance : float, optional
///     Where it is given, the sums are the exact adjoint of what `synthesise_at` gives with the same one.
///
/// Returns
/// -------
/// Coefficients, (…, (degree + 1)²)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> directions = [[0, 0, 1], [1, 0, 0], [0.6, 0, -0.8]]
/// >>> c, y = np.arange(9.0), np.array([1.0, -2.0, 0.5])
/// >>> there = lobes.synthesise_at(c, directions) @ y
/// >>> bool(np.isclose(there, np.vdot(c, lobes.synthesise_at_adjoint(y, directions, 2)), rtol=1e-13))
/// True
#[pyfunction]
#[pyo3(signature = (values, directions, degree, threads=true, tolerance=None))]
pub(crate) fn synthesise_at_adjoint<'py>(
    py: Python<'py>,
    values: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    degree: usize,
    threads: bool,
    tolerance: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let directions = Directions::of(directions, "the array of directions")?;
    let &[count] = &directions.shape[..] else {
        return Err(PyValueError::new_err(format!(
            "the array of directions has {} dimensions before the 3, where one is needed",
            directions.shape.len()
        )));
    };
    let values = doubles(values, "the array of values")?;
    let shape = leading(values.shape(), &[count], "the array of values")?;
    let threads = parallelism(threads);
    let values = values.as_slice()?;
    let mut sets = Vec::new();
    if let Some(tolerance) = tolerance {
        let plan = scattered(py, &directions, degree, tolerance, threads)?;
        for index in 0..shape.iter().product() {
            let (values, plan) = (
                values[index * count..(index + 1) * count].to_vec(),
                plan.clone(),
            );
            let set = interrupt::run(py, move || plan.synthesise_adjoint(&values, threads))?;
            sets.push(set.map_err(error)?);
        }
        return wrap_all(py, &shape, sets, (degree, degree));
    }
    let (basis, _) = basis_of(py, &directions, degree)?;
    for index in 0..shape.iter().product() {
        let values = &values[index * count..(index + 1) * count];
        let set = py
            .detach(|| basis.sums_adjoint(values, &directions.vectors, threads))
            .map_err(error)?;
        check_result(set.as_slice(), "a coefficient")?;
        sets.push(set);
        py.check_signals()?;
    }
    wrap_all(py, &shape, sets, (degree, degree))
}

/// The coefficients whose values at directions (n, 3) of the harmonic frame are nearest to `values`,
/// by least squares: for samples anywhere.
///
/// Parameters
/// ----------
/// values : array_like, (n,)
/// directions : array_like, (n, 3)
/// degree : int
/// tolerance : float
///     What the gradient of the squares falls to, of what it was.
/// threads : bool
///     Whether all cores work.
///
/// Returns
/// -------
/// coefficients, residual, steps, condition
///     As of `Transform.analyse_least_squares`.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> directions = np.random.default_rng(1).standard_normal((200, 3))
/// >>> f = lobes.random_field(np.ones(4), 1)
/// >>> found, *_ = lobes.analyse_at(lobes.synthesise_at(f, directions), directions, 3)
/// >>> np.allclose(found, f, atol=1e-9)
/// True
#[pyfunction]
#[pyo3(signature = (values, directions, degree, tolerance=1e-12, threads=true))]
pub(crate) fn analyse_at<'py>(
    py: Python<'py>,
    values: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    degree: usize,
    tolerance: f64,
    threads: bool,
) -> PyResult<Fitted<'py>> {
    let directions = Directions::of(directions, "the array of directions")?;
    let values = doubles(values, "the array of values")?;
    if values.shape() != &directions.shape[..] || directions.shape.len() != 1 {
        return Err(PyValueError::new_err(
            "there is not one value for each of (n, 3) directions",
        ));
    }
    let (basis, _) = basis_of(py, &directions, degree)?;
    let values = values.as_slice()?;
    let fit = py
        .detach(|| {
            let threads = parallelism(threads);
            basis.analyse_least_squares(values, &directions.vectors, tolerance, threads)
        })
        .map_err(error)?;
    fitted(py, fit)
}

/// Wigner's d^l(β): ⟨l m'| exp(−iβ J_y) |l m⟩.
///
/// Parameters
/// ----------
/// degree : int
///     l, at most 512.
/// beta : float
///     In radians.
///
/// Returns
/// -------
/// ndarray, (2 degree + 1, 2 degree + 1)
///     Rows m' and columns m, each from −l to l.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> float(lobes.wigner_d(1, np.pi / 2)[2, 0].round(15))  # (1 − cos β)/2
/// 0.5
#[pyfunction]
pub(crate) fn wigner_d<'py>(
    py: Python<'py>,
    degree: usize,
    beta: f64,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let d = py
        .detach(|| harmonics::wigner::d_matrix(degree, beta))
        .map_err(error)?;
    // A matrix is stored column by column.
    shaped(
        py,
        &[d.nrows(), d.ncols()],
        d.transpose().as_slice().to_vec(),
    )
}

/// Wigner's D^l of a rotation: what takes the complex coefficients a_lm of f, of harmonics with the
/// Condon–Shortley phase, to those of f(R⁻¹ ω).
///
/// Parameters
/// ----------
/// degree : int
///     l, at most 512.
/// quaternion : array_like, (4,)
///     (x, y, z, w), of any length but 0.
///
/// Returns
/// -------
/// ndarray of complex, (2 degree + 1, 2 degree + 1)
///     Rows and columns m from −l to l.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> d = lobes.wigner_rotation(2, [0, 0, np.sin(0.2), np.cos(0.2)])  # about the pole by 0.4
/// >>> np.allclose(np.diag(d), np.exp(-0.4j * np.arange(-2, 3)))
/// True
#[pyfunction]
pub(crate) fn wigner_rotation<'py>(
    py: Python<'py>,
    degree: usize,
    quaternion: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
    let quaternion = DQuat::from_array(numbers(quaternion, "the quaternion")?);
    let d = py
        .detach(|| harmonics::wigner::rotation_matrix(degree, quaternion))
        .map_err(error)?;
    shaped(
        py,
        &[d.nrows(), d.ncols()],
        d.transpose().as_slice().to_vec(),
    )
}

/// As `wigner_rotation`, for the real coefficients of this package in the order l² + l + m: an
/// orthogonal matrix.
///
/// Parameters
/// ----------
/// degree : int
///     l, at most 512.
/// quaternion : array_like, (4,)
///     (x, y, z, w), of any length but 0.
///
/// Returns
/// -------
/// ndarray, (2 degree + 1, 2 degree + 1)
///     Rows and columns m from −l to l.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> turn = lobes.wigner_rotation_real(1, [0, 0, np.sin(0.2), np.cos(0.2)])
/// >>> np.allclose(turn @ [0, 0, 1], [np.sin(0.4), 0, np.cos(0.4)])  # (y, z, x) of x
/// True
#[pyfunction]
pub(crate) fn wigner_rotation_real<'py>(
    py: Python<'py>,
    degree: usize,
    quaternion: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let quaternion = DQuat::from_array(numbers(quaternion, "the quaternion")?);
    let d = py
        .detach(|| harmonics::wigner::real_rotation_matrix(degree, quaternion))
        .map_err(error)?;
    shaped(
        py,
        &[d.nrows(), d.ncols()],
        d.transpose().as_slice().to_vec(),
    )
}

/// A rotation of many small sets of coefficients, all alike or each by its own, such as Gaussian splats
/// carry.
///
/// Parameters
/// ----------
/// coefficients : array_like
///     Along `axis` the coefficients of degree 0 to 1, 2, 3 or 4, or without that of degree 0: 4, 9, 16, 25,
///     or one fewer. The axes before it are those of the sets, those after it channels: (n, 16, 3) with
///     `axis=-2` are 3DGS's tensors, (n, 15, 3) its `features_rest`, (n, 3, 15) with `axis=-1` its files.
/// quaternions : array_like, (..., 4)
///     (x, y, z, w) of unit length, in the frame of the basis: one, or as many as the first axes of the
///     sets have, whose shape comes before the 4. (3DGS and e3nn write w first.)
/// basis : str
///     "3dgs", "gltf", "e3nn" or "lobes": whose harmonics, in which order.
/// axis : int
///     The axis of the coefficients.
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Returns
/// -------
/// ndarray
///     Of the same shape, the coefficients of f(R⁻¹ ω); of float32 where float32 was given, else of float64.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> splats = np.zeros((1000, 4, 3), np.float32)
/// >>> splats[:, 1] = -1  # y, in 3DGS's basis
/// >>> quarter = [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]
/// >>> turned = lobes.rotate_splats(splats, quarter, axis=-2)
/// >>> turned.dtype, np.allclose(turned[:, :, 0], [0, 0, 0, 1], atol=1e-7)  # -x
/// (dtype('float32'), True)
#[pyfunction]
#[pyo3(signature = (coefficients, quaternions, basis="3dgs", axis=-1, threads=true))]
pub(crate) fn rotate_splats<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    quaternions: &Bound<'py, PyAny>,
    basis: &str,
    axis: isize,
    threads: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let what = "the array of coefficients";
    if type_name(coefficients)? == "float32" {
        let sets = singles(coefficients, what)?;
        Ok(rotated_splats(py, &sets, quaternions, basis, axis, threads)?.into_any())
    } else {
        let sets = doubles(coefficients, what)?;
        Ok(rotated_splats(py, &sets, quaternions, basis, axis, threads)?.into_any())
    }
}

fn rotated_splats<'py, T: harmonics::SplatNumber + Element>(
    py: Python<'py>,
    sets: &PyReadonlyArrayDyn<'py, T>,
    quaternions: &Bound<'py, PyAny>,
    basis: &str,
    axis: isize,
    threads: bool,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let shape = sets.shape();
    let at = if axis < 0 {
        shape.len().checked_add_signed(axis)
    } else {
        Some(axis.unsigned_abs())
    };
    let Some((before, [count, channels @ ..])) = at.and_then(|at| shape.split_at_checked(at))
    else {
        return Err(PyValueError::new_err(format!(
            "the array of coefficients has the shape {}, which has no axis {axis}",
            shape_name(shape)
        )));
    };
    let degree = count.isqrt().max((count + 1).isqrt()).saturating_sub(1);
    let all = (degree + 1) * (degree + 1);
    if degree == 0 || degree > harmonics::MAX_SPLAT_DEGREE || (*count != all && count + 1 != all) {
        return Err(PyValueError::new_err(format!(
            "the array of coefficients has {count} of them along axis {axis}; there must be 4, 9, 16 or 25, or one fewer without that of degree 0"
        )));
    }
    let turns = doubles(quaternions, "the array of quaternions")?;
    let own = leading(turns.shape(), &[4], "the array of quaternions")?;
    if !before.starts_with(&own) {
        return Err(PyValueError::new_err(format!(
            "the array of quaternions has the shape {}, whose axes before the 4 are not the first axes of the sets, {}",
            shape_name(turns.shape()),
            shape_name(before)
        )));
    }
    let (turns, _) = turns.as_slice()?.as_chunks::<4>();
    let turns: Vec<_> = turns.iter().copied().map(DQuat::from_array).collect();
    let out = zeros::<T>(py, shape)?;
    let mut guard = out.readwrite();
    let values = guard.as_slice_mut()?;
    values.copy_from_slice(sets.as_slice()?);
    if !values.is_empty() {
        let plan = harmonics::SplatRotation::new(degree, basis.parse().map_err(error)?)
            .and_then(|plan| plan.with_channels(channels.iter().product()))
            .map_err(error)?;
        let plan = if *count == all {
            plan
        } else {
            plan.without_degree_0()
        };
        // So many rotations, and the sets of each, that Ctrl-C is looked for.
        let share = values.len() / turns.len();
        let batch = at_a_time(8 * share, parallelism(threads));
        let pieces = values.chunks_mut(batch * share).zip(turns.chunks(batch));
        for (piece, (values, turns)) in pieces.enumerate() {
            let first = piece * batch;
            py.detach(|| plan.rotate(values, turns, parallelism(threads)))
                .map_err(|wrong| error(counted_from(wrong, first, first * share)))?;
            py.check_signals()?;
        }
    }
    drop(guard);
    Ok(out)
}

/// What is wrong with a piece of arrays, by the indices of the whole.
fn counted_from(wrong: lobes::Error, quaternions: usize, values: usize) -> lobes::Error {
    use lobes::Error::{NotFinite, NotUnit};
    match wrong {
        NotUnit {
            what,
            index,
            length,
        } => NotUnit {
            what,
            index: index + quaternions,
            length,
        },
        NotFinite { what, index, value } => NotFinite {
            what,
            index: index + values,
            value,
        },
        other => other,
    }
}

/// Values as of `synthesise_at`, and their gradients on the unit sphere.
///
/// Parameters
/// ----------
/// coefficients : Coefficients or array_like, (…, count)
/// directions : array_like, (*points, 3)
///     In the harmonic frame, of any length but 0.
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Returns
/// -------
/// values : ndarray, (…, *points)
/// gradients : ndarray, (…, *points, 3)
///     Tangent vectors whose product with a small step is the change of the value.
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> z = [0, np.sqrt(4 * np.pi / 3), 0, 0]
/// >>> value, gradient = lobes.gradients_at(z, [0.6, 0, 0.8])
/// >>> np.allclose(value, 0.8) and np.allclose(gradient, [-0.48, 0, 0.36])
/// True
#[pyfunction]
#[pyo3(signature = (coefficients, directions, threads=true))]
pub(crate) fn gradients_at<'py>(
    py: Python<'py>,
    coefficients: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    threads: bool,
) -> PyResult<Two<'py>> {
    let sets = Sets::of(coefficients, "the array of coefficients")?;
    let directions = Directions::of(directions, "the array of directions")?;
    let (basis, _) = basis_of(py, &directions, sets.degree)?;
    let threads = parallelism(threads);
    let batch = at_a_time(8 * basis.count(), threads);
    let length = directions.vectors.len();
    let mut values = zeroed(sets.len(), length)?;
    let mut gradients = zeroed(3 * sets.len(), length)?;
    let mut at = 0;
    for set in sets.each()? {
        let set = set?;
        for directions in directions.vectors.chunks(batch) {
            let mut both = vec![(0.0, DVec3::ZERO); directions.len()];
            py.detach(|| basis.gradients(&set, directions, &mut both, threads))
                .map_err(error)?;
            for (value, gradient) in both {
                values[at] = value;
                gradients[3 * at..3 * at + 3].copy_from_slice(&gradient.to_array());
                at += 1;
            }
            py.check_signals()?;
        }
    }
    check_result(&values, "a value")?;
    check_result(&gradients, "a gradient")?;
    let mut shape = at_shape(&sets, &directions);
    let values = shaped(py, &shape, values)?;
    shape.push(3);
    Ok((values, shaped(py, &shape, gradients)?))
}

/// `rows` · `columns` zeros, where there is room for them.
fn zeroed(rows: usize, columns: usize) -> PyResult<Vec<f64>> {
    let count = rows.saturating_mul(columns);
    check_room(count, "the values at all directions")?;
    Ok(vec![0.0; count])
}

/// Directions of the world frame, y up, in the harmonic frame, whose pole is +z.
///
/// Parameters
/// ----------
/// directions : array_like, (…, 3)
///
/// Returns
/// -------
/// ndarray, (…, 3)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.to_harmonic([1.0, 2.0, 3.0])
/// array([3., 1., 2.])
#[pyfunction]
pub(crate) fn to_harmonic<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    framed(py, directions, sphere::to_harmonic)
}

/// The inverse of `to_harmonic`.
///
/// Parameters
/// ----------
/// directions : array_like, (…, 3)
///
/// Returns
/// -------
/// ndarray, (…, 3)
///
/// Examples
/// --------
/// >>> import lobes
/// >>> lobes.from_harmonic([3.0, 1.0, 2.0])
/// array([1., 2., 3.])
#[pyfunction]
pub(crate) fn from_harmonic<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    framed(py, directions, sphere::from_harmonic)
}

fn framed<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyAny>,
    frame: fn(DVec3) -> DVec3,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = doubles(directions, "the array of directions")?;
    let mut shape = leading(array.shape(), &[3], "the array of directions")?;
    let (vectors, _) = array.as_slice()?.as_chunks::<3>();
    let turned = vectors
        .iter()
        .flat_map(|&vector| frame(DVec3::from_array(vector)).to_array());
    let turned = turned.collect();
    shape.push(3);
    shaped(py, &shape, turned)
}
