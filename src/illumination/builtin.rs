//! The illuminations of `data/illuminations`, inside the library.

use super::EnvironmentMap;
use crate::{Result, files};

/// The name of each map and its file, sorted by name.
macro_rules! maps {
    ($($name:literal),+ $(,)?) => {
        &[$(($name, include_bytes!(concat!("../../data/illuminations/", $name, ".exr")))),+]
    };
}

const MAPS: &[(&str, &[u8])] = maps![
    "blender-city",
    "blender-courtyard",
    "blender-forest",
    "blender-interior",
    "blender-night",
    "blender-studio",
    "blender-sunrise",
    "blender-sunset",
    "pmndrs-apartment",
    "pmndrs-bridge",
    "pmndrs-city",
    "pmndrs-dawn",
    "pmndrs-forest",
    "pmndrs-night",
    "pmndrs-studio",
    "pmndrs-sunset",
    "pmndrs-venice",
];

/// The names of the [`builtin()`] maps, sorted, without reading any.
///
/// ```
/// assert!(lobes::illumination::builtin_names().eq(lobes::illumination::builtin()?.iter().map(|map| map.name())));
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    MAPS.iter().map(|&(name, _)| name)
}

/// The illuminations that come with the library, sorted by name: seventeen captured places, indoors
/// and out, as 512×256 maps in the public domain (CC0).
///
/// Where each comes from, and what was done to it, is in `data/illuminations/PROVENANCE.json`.
///
/// # Errors
///
/// None that a caller can cause: the files are part of the library. The result is there because
/// they go through the same reader as any other file.
///
/// ```
/// let maps = lobes::illumination::builtin()?;
/// assert_eq!(maps.len(), 17);
/// assert_eq!((maps[0].name(), maps[0].width(), maps[0].height()), ("blender-city", 512, 256));
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn builtin() -> Result<Vec<EnvironmentMap>> {
    MAPS.iter()
        .map(|&(name, bytes)| {
            let picture =
                files::decode_problem(bytes).map_err(|problem| problem.in_file(name.as_ref()))?;
            EnvironmentMap::new(name, picture.width, picture.height, picture.pixels)
        })
        .collect()
}
