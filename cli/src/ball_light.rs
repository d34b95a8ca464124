//! The light about a classified ball, as maps.

use std::path::Path;

use crate::error::Result;
use crate::output;
use lobes::Parallelism;
use lobes::files::{self, Precision, encode_exr};
use lobes::inference::{
    BallLightReader, ExpectedPicture, FinishVerdict, LightQuantity, PossibleReflectance,
};
use lobes::reflection::SphereImage;

/// Rows of the maps.
pub(super) const HEIGHT: usize = 128;

/// The light about a ball as lat-long maps in the camera's frame: it stands towards +z, +y is up,
/// and the centre column looks along −z.
pub(super) struct LightMaps {
    pub(super) mean: Vec<[f64; 3]>,
    pub(super) deviation: Vec<[f64; 3]>,
    /// The ball's picture beside what this light makes of it.
    pub(super) picture: ExpectedPicture,
}

impl LightMaps {
    /// The light that an image shows of a ball, averaged over what it may be made of.
    pub(super) fn read(image: &SphereImage, finish: &FinishVerdict) -> Result<Self> {
        let reader = BallLightReader::of_image(image, LightQuantity::Radiance)?;
        Self::by(&reader, image, &finish.possible_reflectances())
    }

    /// What an image shows of the light if the ball is made of one of these.
    pub(super) fn by(
        reader: &BallLightReader,
        image: &SphereImage,
        reflectances: &[PossibleReflectance],
    ) -> Result<Self> {
        let light = reader.read(image, reflectances, Parallelism::Rayon)?;
        let (mut mean, deviation) = light.lat_long(HEIGHT)?;
        // The mean swings below 0 about sharp lamps, and no light does.
        for value in mean.as_flattened_mut() {
            *value = value.max(0.0);
        }
        Ok(Self {
            mean,
            deviation,
            picture: light.picture,
        })
    }

    /// Writes the mean, and its standard deviation beside it.
    pub(super) fn write(&self, path: &Path) -> Result<()> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let beside = path.with_file_name(format!("{stem}-deviation.exr"));
        for (path, pixels) in [(path, &self.mean), (&beside, &self.deviation)] {
            let picture = files::Picture {
                width: 2 * HEIGHT,
                height: HEIGHT,
                pixels: pixels.clone(),
            };
            output::write_file(path, &encode_exr(&picture, Precision::Single)?)?;
            crate::console::note(format!("wrote {}", path.display()));
        }
        Ok(())
    }
}
