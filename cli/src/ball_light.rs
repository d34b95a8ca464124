//! The light about a classified ball, as maps.

use std::path::Path;

use crate::error::Result;
use crate::output;
use lobes::Parallelism;
use lobes::files::{self, Precision, encode_exr};
use lobes::inference::{BallLightReader, FinishVerdict, LightQuantity};
use lobes::reflection::SphereImage;

/// Rows of the maps.
const HEIGHT: usize = 128;

/// Writes the light that an image shows of a ball, averaged over what it may be made of, and its
/// standard deviation beside it, as lat-long maps in the camera's frame: it stands towards +z, +y
/// is up, and the centre column looks along −z.
pub(super) fn write(path: &Path, image: &SphereImage, finish: &FinishVerdict) -> Result<()> {
    let reader = BallLightReader::of_image(image, LightQuantity::Radiance)?;
    let light = reader.read(image, &finish.possible_reflectances(), Parallelism::Rayon)?;
    let (mut mean, deviation) = light.lat_long(HEIGHT)?;
    // The mean swings below 0 about sharp lamps, and no light does.
    for value in mean.as_flattened_mut() {
        *value = value.max(0.0);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!("{stem}-deviation.exr"));
    for (path, pixels) in [(path, mean), (&beside, deviation)] {
        let picture = files::Picture {
            width: 2 * HEIGHT,
            height: HEIGHT,
            pixels,
        };
        output::write_file(path, &encode_exr(&picture, Precision::Single)?)?;
        crate::console::note(format!("wrote {}", path.display()));
    }
    Ok(())
}
