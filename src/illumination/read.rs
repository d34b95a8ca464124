//! Environment maps from files.

use std::path::{Path, PathBuf};

use super::EnvironmentMap;
use crate::sphere::Mapping;
use crate::{Error, Result, files};

/// The endings of the files that [`read_folder`] takes.
const ENDINGS: [&str; 4] = ["exr", "hdr", "pic", "pfm"];

/// Reads an environment map: OpenEXR, Radiance or PFM, under any [`Mapping`], as
/// [`EnvironmentMap::from_picture`] makes it.
///
/// OpenEXR's attribute `envmap` is heeded: a cube is refused by name, and a lat-long map is one
/// whatever was asked for. OpenEXR looks from inside as this crate does, with +z of its own world
/// in the centre column where this crate's −z is, half a turn about the vertical; the picture is
/// taken as it stands. (It also has the outermost pixels on the poles and on the seam, which are
/// taken as half a pixel from them, as all others are.)
///
/// Without a mapping, the shape of the picture tells it: 2:1, 3:4 or 4:3. A square asks which. The
/// name is that of the file without its ending.
///
/// # Errors
///
/// [`Error::File`], which names the file, for whatever is wrong with it: it cannot be read, has no
/// mapping's shape, holds a radiance that is not finite or is negative, or is all black.
///
/// ```no_run
/// use lobes::{illumination, sphere::Mapping};
/// let map = illumination::read("grace_probe.hdr".as_ref(), Some(Mapping::AngularMap))?;
/// println!("{} {:?}", map.name(), map.mean());
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn read(path: &Path, mapping: Option<Mapping>) -> Result<EnvironmentMap> {
    map_of(path, files::decode_file(path)?, asked(path, mapping))
}

/// [`read()`], of bytes that are already in memory: `path` names the map, and the file in errors.
///
/// # Errors
///
/// As [`read()`], but for what cannot be opened.
pub fn read_bytes(path: &Path, bytes: &[u8], mapping: Option<Mapping>) -> Result<EnvironmentMap> {
    let decoded = files::decode_all(bytes).map_err(|problem| problem.in_file(path))?;
    map_of(path, decoded, asked(path, mapping))
}

/// The mapping that was asked for, of a picture of so many pixels; that of its shape without one.
fn asked(path: &Path, mapping: Option<Mapping>) -> impl Fn(usize, usize) -> Result<Mapping> {
    move |width, height| match mapping {
        Some(mapping) if !mapping.fits(width, height) => {
            let (across, down) = mapping.aspect();
            Err(Error::file(
                path,
                format!("{width} by {height} pixels are no {mapping}, which is {across}:{down}"),
                "give another --mapping",
            ))
        }
        Some(mapping) => Ok(mapping),
        None => guess(path, width, height),
    }
}

/// The mapping that a shape tells.
fn guess(path: &Path, width: usize, height: usize) -> Result<Mapping> {
    Mapping::guess(width, height).map_err(|error| {
        let message = error.to_string();
        let (problem, remedy) = message.split_once("; ").unwrap_or((&message, "convert it"));
        Error::file(path, problem, remedy)
    })
}

/// The map that a file holds, under the mapping that is chosen for its size.
fn map_of(
    path: &Path,
    decoded: files::Decoded,
    choose: impl Fn(usize, usize) -> Result<Mapping>,
) -> Result<EnvironmentMap> {
    let decoded = decoded.whole().map_err(|problem| problem.in_file(path))?;
    if decoded.environment == Some(files::Environment::Cube) {
        return Err(Error::file(
            path,
            "the file says that it holds the six faces of a cube, one above the other, which is no mapping that is read here",
            "convert it to a lat-long map",
        ));
    }
    let picture = decoded.picture;
    let mapping = choose(picture.width, picture.height)?;
    if decoded.environment == Some(files::Environment::LatLong) && mapping != Mapping::LatLong {
        return Err(Error::file(
            path,
            format!("the file says that it is a lat-long map, and {mapping} was asked for"),
            "leave --mapping out, or the attribute envmap out of the file",
        ));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    EnvironmentMap::from_picture(name, mapping, picture.width, picture.height, picture.pixels)
        .map_err(|error| Error::file(path, error.to_string(), "mend the file or leave it out"))
}

/// Reads every environment map of a folder (`.exr`, `.hdr`, `.pic`, `.pfm`; not of the folders in
/// it), sorted by name.
///
/// A mapping, where one is given, is that of the files whose shape it fits; the others' shapes tell
/// theirs.
///
/// # Errors
///
/// [`Error::File`] when the folder cannot be listed or holds no map, when two of its files have one
/// name but for the ending, and whatever [`read()`] says of any of its files.
pub fn read_folder(path: &Path, mapping: Option<Mapping>) -> Result<Vec<EnvironmentMap>> {
    let unlisted = |error: std::io::Error| {
        Error::file(
            path,
            format!("the folder cannot be listed: {error}"),
            "give a folder of environment maps",
        )
    };
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unlisted)? {
        let file = entry.map_err(unlisted)?.path();
        let ending = file.extension().unwrap_or_default().to_string_lossy();
        // What a system leaves beside a file, "._sky.hdr", is not a map.
        let hidden = file
            .file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if file.is_file() && !hidden && ENDINGS.contains(&ending.to_lowercase().as_str()) {
            paths.push(file);
        }
    }
    if paths.is_empty() {
        return Err(Error::file(
            path,
            "the folder holds no environment map",
            "put .exr, .hdr, .pic or .pfm files into it",
        ));
    }
    paths.sort_by(|a, b| (a.file_stem(), a).cmp(&(b.file_stem(), b)));
    if let Some(pair) = paths
        .windows(2)
        .find(|pair| pair[0].file_stem() == pair[1].file_stem())
    {
        let other = pair[0].file_name().unwrap_or_default().to_string_lossy();
        return Err(Error::file(
            &pair[1],
            format!("the map has the name of {other} beside it"),
            "rename one of the two",
        ));
    }
    paths
        .iter()
        .map(|path| {
            let decoded = files::decode_file(path)?;
            map_of(path, decoded, |width, height| match mapping {
                Some(mapping) if mapping.fits(width, height) => Ok(mapping),
                _ => guess(path, width, height),
            })
        })
        .collect()
}
