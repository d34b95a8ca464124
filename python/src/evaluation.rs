//! How far estimated light is from the truth.

use std::sync::Arc;

use lobes::evaluation::{Evaluator, LIGHT_MEASURES, Preset};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::illumination::EnvironmentMap;
use crate::{error, interrupt, parallelism};

/// The most pixels a side of the balls' pictures: more changes no error.
const MOST: usize = 1024;

/// The errors of estimated light, by ball and measure, and under "light" those of the maps
/// themselves.
///
/// Balls under both maps are rendered without noise. What each measure is stands in
/// docs/reference/evaluation.md.
///
/// Parameters
/// ----------
/// truth, estimate : EnvironmentMap
/// preset : str
///     "recommended" (a mirror, rough metal and a matte ball; errors relative to the truth), "grid"
///     (balls of every roughness), or one that follows a published evaluation: "stylelight",
///     "diffusionlight" or "matte-balls".
/// size : int
///     Pixels a side of the balls' pictures, at most 1024.
/// threads : bool
///     Whether all cores work; the answer is the same.
///
/// Returns
/// -------
/// dict of dict of float
///
/// Examples
/// --------
/// >>> import lobes
/// >>> light = lobes.builtin()[0].resampled(16)
/// >>> errors = lobes.evaluate(light, light, size=16)
/// >>> max(abs(value) for value in errors["light"].values()) < 1e-12
/// True
#[pyfunction]
#[pyo3(signature = (truth, estimate, preset="recommended", size=64, threads=true))]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    truth: &Bound<'py, EnvironmentMap>,
    estimate: &Bound<'py, EnvironmentMap>,
    preset: &str,
    size: usize,
    threads: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let preset: Preset = preset.parse().map_err(error)?;
    if !(1..=MOST).contains(&size) {
        return Err(PyValueError::new_err(format!(
            "the size is {size}, which is not from 1 to {MOST} pixels a side"
        )));
    }
    let (truth, estimate) = (Arc::clone(&truth.get().0), Arc::clone(&estimate.get().0));
    let (protocol, errors) = interrupt::run(py, move || {
        let all = parallelism(threads);
        let evaluator = Evaluator::new(preset.protocol()?, size, all)?;
        let errors = evaluator.evaluate(&truth, &estimate, all)?;
        lobes::Result::Ok((evaluator.protocol().clone(), errors))
    })?
    .map_err(error)?;
    let answer = PyDict::new(py);
    for (ball, values) in protocol.balls.iter().zip(&errors.balls) {
        let of_ball = PyDict::new(py);
        for (measure, value) in protocol.measures.iter().zip(values) {
            of_ball.set_item(measure.name(), value)?;
        }
        answer.set_item(ball.name, of_ball)?;
    }
    let of_light = PyDict::new(py);
    for ((name, _), value) in LIGHT_MEASURES.iter().zip(errors.light.values()) {
        of_light.set_item(name, value)?;
    }
    answer.set_item("light", of_light)?;
    Ok(answer)
}
