//! The data sets that classifiers are tried on.

use glam::DVec3;

use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflectance::{Material, Roughness, Variant};
use crate::reflection::{Camera, Renderer, Rendering, Settings, SphereImage};
use crate::{Error, Parallelism, Result};

/// One image with what is known of it.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The index of its material.
    pub material: usize,
    /// The index of its illumination.
    pub illumination: usize,
    /// The image.
    pub image: SphereImage,
}

/// Images of spheres with their materials and illuminations.
#[derive(Debug, Clone)]
pub struct Dataset {
    /// The materials' names.
    pub materials: Vec<String>,
    /// The illuminations' names.
    pub illuminations: Vec<String>,
    /// The images: by illumination, then by material.
    pub observations: Vec<Observation>,
    /// The largest error that the renderer reported, relative.
    pub render_error: f64,
}

impl Dataset {
    /// The material of each observation.
    pub fn labels(&self) -> Vec<usize> {
        self.observations.iter().map(|o| o.material).collect()
    }

    /// The illumination of each observation.
    pub fn groups(&self) -> Vec<usize> {
        self.observations.iter().map(|o| o.illumination).collect()
    }

    /// The data set of what was rendered under each illumination: its observations and their largest error.
    pub(super) fn gather(
        materials: &[Material],
        illuminations: &[EnvironmentMap],
        groups: Vec<Result<(Vec<Observation>, f64)>>,
    ) -> Result<Self> {
        let mut dataset = Self {
            materials: materials.iter().map(|m| m.name().to_owned()).collect(),
            illuminations: illuminations.iter().map(|i| i.name().to_owned()).collect(),
            observations: Vec::new(),
            render_error: 0.0,
        };
        for group in groups {
            let (observations, error) = group?;
            dataset.observations.extend(observations);
            dataset.render_error = dataset.render_error.max(error);
        }
        Ok(dataset)
    }
}

/// A mirror is averaged over so many points a side of each pixel.
///
/// It shows the light as sharp as it is, and one point a pixel would hit a lamp or miss it: between two rolls of the
/// camera v1 of a mirror under a small sun changed by half. What rough lobes and diffuse bodies show is as wide as a pixel
/// and is taken at its centre.
pub const MIRROR_PIXEL_SAMPLES: usize = 6;

/// The paper's data: each material under each illumination, seen level, linear, and divided by the
/// mean luminance of a white sphere in the same light.
///
/// `done` is called after each illumination, from any thread.
///
/// # Errors
/// [`Error::Unanswerable`] without a material or an illumination, and what the renderer finds wrong.
pub fn paper_dataset(
    illuminations: &[EnvironmentMap],
    materials: &[Material],
    variant: Variant,
    settings: &Settings,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<Dataset> {
    if illuminations.is_empty() || materials.is_empty() {
        return Err(Error::Unanswerable(
            "a data set needs at least one illumination and one material".into(),
        ));
    }
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let groups = parallelism.map(illuminations.len(), |illumination| {
        let renderer = Renderer::new(&illuminations[illumination], Parallelism::Sequential)?;
        let render = |material: &Material, settings: &Settings| {
            renderer.render(
                material,
                variant,
                &camera,
                settings,
                Parallelism::Sequential,
            )
        };
        let render = |material: &Material| match material.roughness() {
            Roughness::Mirror if !material.is_matte() => {
                let mirror = Settings {
                    pixel_samples: settings.pixel_samples.max(MIRROR_PIXEL_SAMPLES),
                    ..*settings
                };
                let part = |diffuse, specular| {
                    Material::from_albedos(material.name(), diffuse, specular, 0.0)
                };
                let body = render(&part(material.diffuse(), [0.0; 3])?, settings)?;
                let gloss = render(&part([0.0; 3], material.specular())?, &mirror)?;
                Ok(Rendering {
                    image: sum(&body.image, &gloss.image)?,
                    error: body.error.max(gloss.error),
                })
            }
            _ => render(material, settings),
        };
        let white = render(&Material::white())?;
        let scale = 1.0 / Luminance::Rec709.of(white.image.mean());
        let mut error = white.error;
        let observations = materials
            .iter()
            .enumerate()
            .map(|(material, parameters)| {
                let rendering = render(parameters)?;
                error = error.max(rendering.error);
                Ok(Observation {
                    material,
                    illumination,
                    image: rendering.image.map(|rgb| rgb.map(|value| value * scale)),
                })
            })
            .collect::<Result<Vec<_>>>()?;
        done();
        Ok((observations, error))
    });
    Dataset::gather(materials, illuminations, groups)
}

/// The sum of two images from one camera.
fn sum(a: &SphereImage, b: &SphereImage) -> Result<SphereImage> {
    let size = a.size();
    let pixels = (0..size * size).map(|i| {
        let at = |image: &SphereImage| image.get(i / size, i % size).unwrap_or_default();
        let (a, b) = (at(a), at(b));
        std::array::from_fn(|channel| a[channel] + b[channel])
    });
    SphereImage::new(*a.camera(), size, pixels.collect())
}
