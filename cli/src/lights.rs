//! The maps that a verb works on, and which of them are of one scene.

use std::path::Path;

use serde::Deserialize;

use crate::arguments::Lights;
use crate::error::{Error, Result};
use crate::{console, named};
use lobes::Parallelism;
use lobes::illumination::{EnvironmentMap, builtin, read_folder};
use lobes::inference::Scenes;

/// The maps of `--illuminations`, or the built-in ones, and the scenes that they are of.
///
/// Two that look alike are one scene, with a warning; so are those that `--groups` names.
pub(super) fn load(lights: &Lights) -> Result<(Vec<EnvironmentMap>, Scenes)> {
    let maps = match &lights.illuminations {
        Some(folder) => read_folder(folder, lights.mapping)?,
        None => builtin()?,
    };
    let (mut scenes, alike) =
        Scenes::of_maps(&maps, Parallelism::Rayon).map_err(|error| {
            match (&lights.illuminations, error) {
                (Some(folder), lobes::Error::SameLight { first, second }) => Error::file(
                    folder,
                    format!(
                        "{} and {} hold the same pixels",
                        file_of(folder, &first),
                        file_of(folder, &second)
                    ),
                    "take one of the two away",
                ),
                (_, error) => error.into(),
            }
        })?;
    if let Some(path) = &lights.groups {
        let names: Vec<&str> = maps.iter().map(EnvironmentMap::name).collect();
        scenes = scenes.and(&read_groups(path, &names)?);
    }
    for pair in alike {
        console::complain(format!(
            "lobes: the maps {:?} and {:?} look like one place (correlation {:.4}) and are left out together; take one of them \
             away if they are the same light",
            maps[pair.first].name(),
            maps[pair.second].name(),
            pair.correlation
        ));
    }
    Ok((maps, scenes))
}

/// The name of the file in a folder that a map was read from.
fn file_of(folder: &Path, map: &str) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names = entries.map(|entry| entry.file_name());
    names
        .find(|name| Path::new(name).file_stem().is_some_and(|stem| stem == map))
        .map_or_else(
            || map.to_owned(),
            |name| name.to_string_lossy().into_owned(),
        )
}

/// The file of `--groups`: docs/how-to/groups.md.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Groups {
    groups: Vec<Vec<String>>,
}

fn read_groups(path: &Path, names: &[&str]) -> Result<Scenes> {
    const FORM: &str = "write groups = [[\"one map\", \"another\"]], a list for each scene";
    let text = std::fs::read_to_string(path).map_err(|error| {
        Error::file(
            path,
            format!("cannot be read ({error})"),
            "name a TOML file of groups",
        )
    })?;
    let file: Groups = toml::from_str(&text).map_err(|error| {
        let line = error
            .span()
            .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        Error::file(path, format!("line {line}: {}", error.message()), FORM)
    })?;
    if let Some(group) = file.groups.iter().find(|group| group.len() < 2) {
        return Err(Error::file(
            path,
            format!("{group:?} is a group of fewer than two maps"),
            FORM,
        ));
    }
    Ok(Scenes::from_groups(names, &file.groups).map_err(|error| named::in_file(path, error))?)
}

/// The error of a name that is neither a file's nor a built-in map's.
pub(crate) fn no_light(path: &Path, builtin: &[EnvironmentMap]) -> Error {
    let names: Vec<&str> = builtin.iter().map(EnvironmentMap::name).collect();
    Error::file(
        path,
        "is neither a file nor a built-in map",
        format!(
            "the built-in maps are {}",
            named::nearest_first(&path.to_string_lossy(), &names).join(", ")
        ),
    )
}
