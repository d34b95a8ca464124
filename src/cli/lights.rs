//! The maps that a verb works on.

use crate::Result;
use crate::cli::arguments::Lights;
use crate::illumination::{EnvironmentMap, builtin, read_folder};

/// The maps of `--illuminations`, or the built-in ones.
pub(super) fn load(lights: &Lights) -> Result<Vec<EnvironmentMap>> {
    match &lights.illuminations {
        Some(folder) => read_folder(folder, lights.mapping),
        None => builtin(),
    }
}
