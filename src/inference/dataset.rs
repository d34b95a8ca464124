//! Sets of pictures of spheres: cameras, materials and illuminations, rendered and read.

use std::f64::consts::TAU;

use glam::DVec3;

use super::scenes::Scenes;
use crate::illumination::{EnvironmentMap, Luminance};
use crate::reflectance::{Material, Roughness, Variant};
use crate::reflection::{Camera, Renderer, Rendering, Settings, SphereImage, Viewpoint};
use crate::{Error, Parallelism, Result};

/// From where spheres are seen.
///
/// ```
/// use lobes::{glam::DVec3, inference::View, reflection::Viewpoint};
/// let view = View { elevation: 0.0, viewpoint: Viewpoint::Orthographic };
/// let cameras = view.cameras(4)?;
/// assert!((cameras[1].towards() - DVec3::X).length() < 1e-15);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredView")
)]
pub struct View {
    /// The camera's height above the horizon, radians.
    pub elevation: f64,
    /// How far it is.
    pub viewpoint: Viewpoint,
}

/// A view as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct StoredView {
    elevation: f64,
    viewpoint: Viewpoint,
}

#[cfg(feature = "serde")]
impl TryFrom<StoredView> for View {
    type Error = Error;

    fn try_from(stored: StoredView) -> Result<Self> {
        let view = Self {
            elevation: stored.elevation,
            viewpoint: stored.viewpoint,
        };
        view.camera(0.0)?;
        Ok(view)
    }
}

impl View {
    /// So many cameras evenly about the vertical, the first towards +z.
    ///
    /// # Errors
    /// Those of [`camera`](Self::camera).
    pub fn cameras(self, turns: usize) -> Result<Vec<Camera>> {
        let turn = |i: usize| TAU * i as f64 / turns as f64;
        (0..turns).map(|i| self.camera(turn(i))).collect()
    }

    /// The camera at an azimuth about the vertical: 0 stands towards +z.
    ///
    /// # Errors
    /// [`Error::Domain`] for an elevation that is not between −π/2 and π/2, and a camera inside the
    /// sphere.
    pub fn camera(self, azimuth: f64) -> Result<Camera> {
        if self.elevation.is_nan() || self.elevation.abs() >= TAU / 4.0 {
            return Err(Error::Domain {
                what: "the camera's elevation in radians",
                value: self.elevation,
                allowed: "between −π/2 and π/2, both excluded",
            });
        }
        let (sin, cos) = self.elevation.sin_cos();
        let towards = DVec3::new(azimuth.sin() * cos, sin, azimuth.cos() * cos);
        match self.viewpoint {
            Viewpoint::Orthographic => Camera::orthographic(towards, DVec3::Y),
            Viewpoint::Perspective { distance } => Camera::perspective(towards, DVec3::Y, distance),
        }
    }
}

/// One image, or what was read off it, with what is known of it.
///
/// ```
/// use lobes::inference::Observation;
/// // The third material under the first light, and the mean radiance that was read off its picture.
/// let seen = Observation { material: 2, illumination: 0, turn: 0, view: [0.5, 0.4, 0.1] };
/// assert_eq!((seen.material, seen.view[1]), (2, 0.4));
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Observation<T = SphereImage> {
    /// The index of its material.
    pub material: usize,
    /// The index of its illumination.
    pub illumination: usize,
    /// From which of the directions about the vertical it is seen; 0 is the one that is judged.
    pub turn: usize,
    /// The image, or what was read off it.
    pub view: T,
}

/// Images of spheres, or what was read off them, with their materials and illuminations.
///
/// ```
/// use lobes::inference::{Dataset, Observation, Scenes};
/// // What was read off the pictures: a number here.
/// let seen = |turn, view| Observation { material: 0, illumination: 0, turn, view };
/// let data = Dataset {
///     materials: vec!["white".into()],
///     illuminations: vec!["sky".into()],
///     scenes: Scenes::default(),
///     observations: vec![seen(0, 1.5), seen(1, 1.25)],
///     render_error: 0.0,
/// };
/// assert_eq!(data.labels(), [0, 0]);
/// assert_eq!(data.judged(), [0]);
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "StoredDataset<T>")
)]
pub struct Dataset<T = SphereImage> {
    /// The materials' names.
    pub materials: Vec<String>,
    /// The illuminations' names.
    pub illuminations: Vec<String>,
    /// Which illuminations are of one scene, and are left out together.
    pub scenes: Scenes,
    /// The images: by illumination, then by turn, then by material.
    pub observations: Vec<Observation<T>>,
    /// The largest error that the renderer reported, relative.
    pub render_error: f64,
}

/// A data set as files have it, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct StoredDataset<T> {
    materials: Vec<String>,
    illuminations: Vec<String>,
    scenes: Scenes,
    observations: Vec<Observation<T>>,
    render_error: f64,
}

#[cfg(feature = "serde")]
impl<T> TryFrom<StoredDataset<T>> for Dataset<T> {
    type Error = Error;

    fn try_from(stored: StoredDataset<T>) -> Result<Self> {
        let StoredDataset {
            materials,
            illuminations,
            scenes,
            observations,
            render_error,
        } = stored;
        for of in &observations {
            check_index(
                "the material of an observation",
                of.material,
                materials.len(),
            )?;
            let illumination = "the illumination of an observation";
            check_index(illumination, of.illumination, illuminations.len())?;
        }
        Ok(Self {
            materials,
            illuminations,
            scenes,
            observations,
            render_error,
        })
    }
}

/// Checks that an index is one of a list's.
#[cfg(feature = "serde")]
pub(super) fn check_index(what: &'static str, index: usize, count: usize) -> Result<()> {
    if index < count {
        Ok(())
    } else {
        Err(Error::Domain {
            what,
            value: index as f64,
            allowed: "the index of one that the set names, from 0",
        })
    }
}

impl<T> Dataset<T> {
    /// The material of each observation.
    pub fn labels(&self) -> Vec<usize> {
        self.observations.iter().map(|o| o.material).collect()
    }

    /// The scene of each observation, by [`Scenes::of`]: the groups that are left out together.
    pub fn groups(&self) -> Vec<usize> {
        let illuminations = self.observations.iter().map(|o| o.illumination);
        illuminations.map(|i| self.scenes.of(i)).collect()
    }

    /// The observations of turn 0, which are judged. The others are there to learn from.
    pub fn judged(&self) -> Vec<usize> {
        (0..self.observations.len())
            .filter(|&i| self.observations[i].turn == 0)
            .collect()
    }
}

/// A mirror is averaged over so many points a side of each pixel.
///
/// It shows the light as sharp as it is, and one point a pixel would hit a lamp or miss it: between
/// two rolls of the camera v1 of a mirror under a small sun changed by half. What rough lobes and
/// diffuse bodies show is as wide as a pixel and is taken at its centre.
pub const MIRROR_PIXEL_SAMPLES: usize = 6;

/// How a data set is rendered.
///
/// ```
/// use lobes::{inference::Plan, reflectance::Variant, reflection::Settings};
/// let plan = Plan { lobe: Variant::default(), settings: Settings::default(), turns: 4 };
/// assert_eq!(plan.settings.size, 128);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plan {
    /// The specular lobe.
    pub lobe: Variant,
    /// The size and the tolerance of the pictures.
    pub settings: Settings,
    /// From how many directions about the vertical each sphere is seen, evenly spaced, the first
    /// towards +z.
    pub turns: usize,
}

/// A picture to the tolerance of the settings or, where the renderer cannot meet that, to three
/// times it: [`Dataset::render_error`] tells.
fn render(
    renderer: &Renderer,
    material: &Material,
    lobe: Variant,
    camera: &Camera,
    settings: &Settings,
) -> Result<Rendering> {
    let one = Parallelism::Sequential;
    match renderer.render(material, lobe, camera, settings, one) {
        Err(Error::Tolerance { .. }) => {
            let wider = Settings {
                tolerance: (3.0 * settings.tolerance).min(0.1),
                ..*settings
            };
            renderer.render(material, lobe, camera, &wider, one)
        }
        rendering => rendering,
    }
}

/// Pictures of the same sphere that add up: a white diffuse one and a white specular one of each
/// roughness.
pub(super) struct Parts {
    diffuse: SphereImage,
    specular: Vec<(f64, SphereImage)>,
    /// The mean luminance of the white sphere.
    pub(super) white: f64,
    pub(super) error: f64,
}

impl Parts {
    /// The parts that spheres of roughnesses `sigmas` need.
    pub(super) fn new(
        renderer: &Renderer,
        camera: &Camera,
        sigmas: impl IntoIterator<Item = f64>,
        lobe: Variant,
        settings: &Settings,
    ) -> Result<Self> {
        let white = render(renderer, &Material::white(), lobe, camera, settings)?;
        let mut error = white.error;
        let mut specular: Vec<(f64, SphereImage)> = Vec::new();
        for sigma in sigmas {
            if specular.iter().any(|(of, _)| *of == sigma) {
                continue;
            }
            let mirror = sigma == 0.0;
            // A lobe alone leaves parts of a picture so dark that a relative error cannot be met
            // there; beside as much of a body it can.
            let body = if mirror { 0.0 } else { 0.5 };
            let material = Material::from_albedos("part", [body; 3], [1.0 - body; 3], sigma)?;
            let settings = Settings {
                pixel_samples: if mirror {
                    settings.pixel_samples.max(MIRROR_PIXEL_SAMPLES)
                } else {
                    settings.pixel_samples
                },
                ..*settings
            };
            let part = render(renderer, &material, lobe, camera, &settings)?;
            error = error.max(part.error);
            let size = part.image.size();
            let pixels = (0..size * size).map(|i| {
                let at = |image: &SphereImage| image.get(i / size, i % size).unwrap_or_default();
                let (both, white) = (at(&part.image), at(&white.image));
                std::array::from_fn(|c| ((both[c] - body * white[c]) / (1.0 - body)).max(0.0))
            });
            let pixels = pixels.collect();
            specular.push((sigma, SphereImage::new(*camera, size, pixels)?));
        }
        Ok(Self {
            white: Luminance::Rec709.of(white.image.mean()),
            diffuse: white.image,
            specular,
            error,
        })
    }

    /// A sphere of albedos ρ_d and ρ_s whose roughness is one of the parts', its radiance times
    /// `scale`.
    pub(super) fn sphere(
        &self,
        diffuse: [f64; 3],
        specular: [f64; 3],
        sigma: f64,
        scale: f64,
    ) -> Result<SphereImage> {
        let gloss = self.specular.iter().find(|(of, _)| *of == sigma);
        let size = self.diffuse.size();
        let pixels = (0..size * size).map(|i| {
            let at = |image: &SphereImage| image.get(i / size, i % size).unwrap_or_default();
            let body = at(&self.diffuse);
            let gloss = gloss.map_or([0.0; 3], |(_, image)| at(image));
            std::array::from_fn(|c| scale * (diffuse[c] * body[c] + specular[c] * gloss[c]))
        });
        SphereImage::new(*self.diffuse.camera(), size, pixels.collect())
    }
}

/// Renders each material under each illumination, gives each picture to `read`, and keeps what that
/// gives.
///
/// Each sphere is seen by every one of `cameras`; a picture's turn is the index of its camera.
///
/// Only the pictures that are being worked on are in memory. Radiance is linear and over the mean
/// luminance of a white sphere in the same light. `read` gets the picture and what is known of it,
/// and is called from any thread; `done` is called after each illumination. Each illumination is
/// taken for a scene of its own; set [`Dataset::scenes`] where that is not so.
///
/// # Errors
/// [`Error::Empty`] without a material, an illumination or a camera; what the renderer or `read`
/// finds wrong.
pub fn collect<T: Send>(
    cameras: &[Camera],
    illuminations: &[EnvironmentMap],
    materials: &[Material],
    plan: &Plan,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
    read: &(dyn Fn(&Observation<()>, &SphereImage) -> Result<T> + Sync),
) -> Result<Dataset<T>> {
    if illuminations.is_empty() || materials.is_empty() || cameras.is_empty() {
        return Err(Error::Empty {
            what: "a data set",
            needs: "an illumination, a material and a camera",
        });
    }
    let groups = parallelism.map(illuminations.len(), |illumination| {
        let renderer = Renderer::new(&illuminations[illumination], Parallelism::Sequential)?;
        let mut observations = Vec::with_capacity(cameras.len() * materials.len());
        let mut error = 0.0f64;
        for (turn, camera) in cameras.iter().enumerate() {
            let shiny = materials.iter().filter(|material| !material.is_matte());
            let sigmas = shiny.map(|material| material.roughness().sigma());
            let parts = Parts::new(&renderer, camera, sigmas, plan.lobe, &plan.settings)?;
            error = error.max(parts.error);
            for (material, parameters) in materials.iter().enumerate() {
                let image = parts.sphere(
                    parameters.diffuse(),
                    parameters.specular(),
                    match parameters.roughness() {
                        Roughness::Mirror => 0.0,
                        Roughness::Rough(sigma) => sigma,
                    },
                    parts.white.recip(),
                )?;
                let observation = Observation {
                    material,
                    illumination,
                    turn,
                    view: (),
                };
                observations.push(Observation {
                    view: read(&observation, &image)?,
                    material,
                    illumination,
                    turn,
                });
            }
        }
        done();
        Ok((observations, error))
    });
    let mut dataset = Dataset {
        materials: materials.iter().map(|m| m.name().to_owned()).collect(),
        illuminations: illuminations.iter().map(|i| i.name().to_owned()).collect(),
        scenes: Scenes::default(),
        observations: Vec::new(),
        render_error: 0.0,
    };
    for group in groups {
        let (observations, error): (Vec<Observation<T>>, f64) = group?;
        dataset.observations.extend(observations);
        dataset.render_error = dataset.render_error.max(error);
    }
    Ok(dataset)
}
