//! The light about a mirror ball.

use std::sync::Arc;

use lobes::picture::Circle;
use lobes::probe::{Bracket, MirrorBall, refine};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Two, numbers, shaped};
use crate::classify::Picture;
use crate::{error, interrupt, parallelism};

/// The most rows of a map.
const MOST: usize = 2048;

/// The light about a mirror ball as a lat-long map, and how much of each pixel was seen.
///
/// The camera stands towards +z, +y is up, and the centre column looks along −z.
///
/// Parameters
/// ----------
/// pictures : sequence of Picture
///     One photograph, or a bracket.
/// exposures : sequence of float, optional
///     Their ratios are estimated unless given.
/// circle : array_like, (3,), optional
///     x, y and radius of the ball in pixels; found unless given.
/// distance : float, optional
///     The camera's, in radii of the ball; without it the focal length of the picture tells, or the
///     camera is taken to be far away.
/// reflectance : array_like, (3,), optional
///     The ball's; 1 unless given.
/// photographer : float
///     The half angle about the camera that is left out, in degrees.
/// rows : int
///     From 2 to 2048.
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Returns
/// -------
/// map : ndarray, (rows, 2 rows, 3)
/// seen : ndarray, (rows, 2 rows)
///
/// Examples
/// --------
/// >>> import lobes, numpy as np
/// >>> ball = lobes.Picture(np.ones((40, 40, 3)))
/// >>> light, seen = lobes.probe([ball], exposures=[1.0], circle=(20, 20, 18), distance=12, rows=8)
/// >>> np.allclose(light[seen > 0.5], 1)
/// True
#[pyfunction]
#[pyo3(signature = (pictures, exposures=None, circle=None, distance=None, reflectance=None, photographer=0.0, rows=128, threads=true))]
#[expect(clippy::too_many_arguments, reason = "as Python gives them")]
pub(crate) fn probe<'py>(
    py: Python<'py>,
    pictures: Vec<Bound<'py, Picture>>,
    exposures: Option<Vec<f64>>,
    circle: Option<&Bound<'py, PyAny>>,
    distance: Option<f64>,
    reflectance: Option<&Bound<'py, PyAny>>,
    photographer: f64,
    rows: usize,
    threads: bool,
) -> PyResult<Two<'py>> {
    if !(2..=MOST).contains(&rows) {
        return Err(PyValueError::new_err(format!(
            "the number of rows is {rows}, which is not from 2 to {MOST}"
        )));
    }
    let circle = circle
        .map(|circle| numbers(circle, "the circle"))
        .transpose()?
        .map(|[x, y, radius]| Circle { x, y, radius });
    let reflectance = reflectance
        .map(|reflectance| numbers(reflectance, "the reflectance"))
        .transpose()?
        .unwrap_or([1.0; 3]);
    let pictures: Vec<_> = pictures.iter().map(|of| Arc::clone(&of.get().0)).collect();
    let told = match exposures {
        Some(exposures) => exposures.into_iter().map(Some).collect(),
        None => vec![None; pictures.len()],
    };
    let map = interrupt::run(py, move || {
        let names = (1..=pictures.len()).map(|number| format!("picture {number}"));
        let pictures = pictures.iter().map(|of| (**of).clone()).collect();
        let bracket = Bracket::new(pictures, names.collect(), told)?;
        let rough = match circle {
            Some(circle) => circle,
            None => bracket.middle().circle()?,
        };
        let radiance = bracket.merge(Some(rough))?;
        let circle = circle.unwrap_or_else(|| refine(&radiance, rough));
        // The outline is seen under the angle whose tangent is r/f.
        let focal = bracket.middle().focal_length();
        let ball = MirrorBall {
            circle,
            distance: distance
                .or_else(|| focal.map(|focal| focal.hypot(circle.radius) / circle.radius)),
            reflectance,
            photographer: photographer.to_radians(),
        };
        ball.unwrap(&radiance, None, rows, parallelism(threads))
    })?
    .map_err(error)?;
    let pixels = map.pixels.into_flattened();
    Ok((
        shaped(py, &[map.rows, 2 * map.rows, 3], pixels)?,
        shaped(py, &[map.rows, 2 * map.rows], map.alpha)?,
    ))
}
