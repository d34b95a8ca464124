//! What the light that a picture would mirror makes of a matte sphere, beside the picture.

use nalgebra::DMatrix;

use super::percentiles::percentiles;
use super::rings::{Modes, RingLayout, Unwrapped, add_waves};
use crate::harmonics::legendre;
use crate::illumination::Luminance;
use crate::reflectance::lambert;
use crate::{Error, Result};

/// The degree to which irradiance is taken; what is beyond is less than 2 % of a point light's.
const DEGREE: usize = 6;

/// The percentiles of the ratios that are features.
const LEVELS: [f64; 9] = [0.002, 0.01, 0.05, 0.15, 0.3, 0.5, 0.75, 0.95, 0.99];

/// Those of a channel's ratio over the luminance's.
const COLOUR_LEVELS: [f64; 3] = [0.01, 0.05, 0.3];

/// Below this share of the irradiance a ratio is that share; below this share of its mean
/// irradiance is that share.
const FAINTEST: f64 = 1e-3;

/// The plan of the features that ask how dark a sphere is where it mirrors the dark.
///
/// Take the picture I for a mirror's: then it shows light from nearly everywhere, and a matte white
/// sphere in that light would show E(n)/π, E the irradiance from the I that each direction is
/// mirrored in. Of a sphere of albedos ρ_d and ρ_s that mirrors, I = ρ_d E_L/π + ρ_s L, the darkest
/// I/(E/π) is ρ_d/(ρ_d + ρ_s), or a little more, wherever there is a place to mirror that is dark:
/// a plastic has a floor, a mirror has none. Exposure and the strength of the light cancel. The
/// ratio is taken of luminance and, for the colour of the floor, of red and of blue.
///
/// Features: ln of nine percentiles of the luminance's ratio; the correlation of ln I with ln E
/// over the picture, and the slope of that regression; then, of red and of blue, ln of three
/// percentiles of their ratios over the luminance's.
///
/// ```
/// use lobes::features::{MirroredLight, RingLayout, Unwrapped};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// let layout = RingLayout::new(Viewpoint::Orthographic, 64, 32)?;
/// let features = MirroredLight::new(&layout)?.of(&Unwrapped::new(&image, &layout)?)?;
/// assert_eq!(features.len(), MirroredLight::FEATURES);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct MirroredLight {
    layout: RingLayout,
    /// For each order, what light on a ring of mirrored directions gives as irradiance on a ring of
    /// normals, over π.
    transfers: Vec<DMatrix<f64>>,
}

impl MirroredLight {
    /// How many features there are.
    pub const FEATURES: usize = Self::OF_LUMINANCE + 2 * COLOUR_LEVELS.len();

    /// How many of them, the first, are of luminance alone.
    pub const OF_LUMINANCE: usize = LEVELS.len() + 2;

    /// The plan for pictures that are unwrapped by a layout of the same viewpoint.
    ///
    /// # Errors
    /// [`Error::TooFew`] for a layout of fewer orders than the irradiance has.
    pub fn new(layout: &RingLayout) -> Result<Self> {
        layout.check("the light that a picture mirrors", 1, DEGREE)?;
        let angles = layout.angles();
        let rings = angles.len();
        let step = 2.0 * angles[0];
        let mirrored = |angle: f64| angle + layout.viewpoint().view_angle(angle);
        // A ring stands for the directions half-way to the next; the last for all behind the sphere
        // too.
        let edge = |ring: usize| match ring {
            0 => 1.0,
            ring if ring == rings => -1.0,
            ring => mirrored(ring as f64 * step).cos(),
        };
        let transfers = (0..=DEGREE)
            .map(|m| {
                let columns = |angle: &dyn Fn(usize) -> f64| {
                    let mut values = DMatrix::zeros(rings, DEGREE + 1 - m);
                    let mut column = vec![0.0; DEGREE + 1 - m];
                    for ring in 0..rings {
                        let (sin, cos) = angle(ring).sin_cos();
                        legendre::column(m, DEGREE, cos, sin, &mut column)?;
                        for (value, degree) in values.row_mut(ring).iter_mut().zip(&column) {
                            *value = *degree;
                        }
                    }
                    Ok::<_, Error>(values)
                };
                let mut normals = columns(&|ring| angles[ring])?;
                let mut lights = columns(&|ring| mirrored(angles[ring]))?;
                for (l, mut column) in (m..=DEGREE).zip(normals.column_iter_mut()) {
                    // ∫ cos² mφ dφ is π, for m = 0 twice that.
                    let around = if m == 0 { 2.0 } else { 1.0 };
                    column *= lambert::transfer(l) * around;
                }
                for (ring, mut row) in lights.row_iter_mut().enumerate() {
                    row *= edge(ring) - edge(ring + 1);
                }
                Ok(normals * lights.transpose())
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            layout: layout.clone(),
            transfers,
        })
    }

    /// The features.
    ///
    /// # Errors
    /// [`Error::Black`] for a black picture; [`Error::Length`] for one that was unwrapped for
    /// another layout.
    pub fn of(&self, picture: &Unwrapped) -> Result<Vec<f64>> {
        let fields = |rgb: [f64; 3]| [Luminance::Rec709.of(rgb), rgb[0], rgb[2]];
        let matte = self.matte(picture, fields)?;
        let mut ratios: [Vec<f64>; 3] = Default::default();
        for (index, rgb) in picture.values().iter().enumerate() {
            for ((ratio, value), matte) in ratios.iter_mut().zip(fields(*rgb)).zip(&matte) {
                ratio.push((value.max(0.0) / matte[index]).max(FAINTEST).ln());
            }
        }
        let line = regression(matte[0].iter().zip(&ratios[0]).map(|(matte, ratio)| {
            let matte = matte.ln();
            (matte, matte + ratio)
        }));
        let [luminance, red, blue] = &mut ratios;
        let mut features = percentiles(luminance, LEVELS).to_vec();
        features.extend(line);
        let beside = percentiles(luminance, COLOUR_LEVELS);
        for channel in [red, blue] {
            let levels = percentiles(channel, COLOUR_LEVELS);
            features.extend(levels.iter().zip(&beside).map(|(at, beside)| at - beside));
        }
        Ok(features)
    }

    /// What a matte white sphere shows of each field at each place of the picture in the light that
    /// the picture mirrors.
    ///
    /// Cut at degree six the irradiance of one lamp goes below 0 on its far side; what is less than
    /// a thousandth of the mean is that.
    fn matte(
        &self,
        picture: &Unwrapped,
        fields: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<[Vec<f64>; 3]> {
        let layout = self.layout.with_orders_up_to(DEGREE);
        let modes = Modes::of(picture, &layout, &fields)?;
        let (rings, columns) = (picture.rings(), picture.columns());
        let means = [0, 1, 2].map(|field: usize| {
            let mean: f64 = modes[field].cosine(0).iter().sum();
            mean / rings as f64
        });
        if means[0].is_nan() || means[0] <= 0.0 {
            return Err(Error::Black {
                what: "the picture of the sphere",
            });
        }
        let mut matte = [0, 1, 2].map(|_| vec![0.0; rings * columns]);
        for (m, transfer) in self.transfers.iter().enumerate() {
            // Cosine amplitudes of each field, then sine ones.
            let amplitudes = DMatrix::from_fn(rings, 6, |ring, part| {
                let modes = &modes[part % 3];
                let of = if part < 3 {
                    modes.cosine(m)
                } else {
                    modes.sine(m)
                };
                of.get(ring).copied().unwrap_or(0.0)
            });
            let irradiance = transfer * amplitudes;
            for (field, matte) in matte.iter_mut().enumerate() {
                add_waves(matte, columns, m, |ring| {
                    [irradiance[(ring, field)], irradiance[(ring, field + 3)]]
                });
            }
        }
        for (matte, mean) in matte.iter_mut().zip(means) {
            // A field without any light has an irradiance still.
            let least = FAINTEST * mean.max(FAINTEST * means[0]);
            for value in matte {
                *value = value.max(least);
            }
        }
        Ok(matte)
    }
}

/// The correlation of y with x, and the slope of y over x; each tame where nothing varies.
fn regression(points: impl Iterator<Item = (f64, f64)>) -> [f64; 2] {
    let (mut count, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (a, b) in points {
        count += 1.0;
        x += a;
        y += b;
        xx += a * a;
        xy += a * b;
        yy += b * b;
    }
    let (x, y) = (x / count, y / count);
    let (xx, xy, yy) = (xx / count - x * x, xy / count - x * y, yy / count - y * y);
    [
        xy / ((xx + 1e-4) * (yy + 1e-4)).sqrt(),
        (xy / (xx + 1e-3)).clamp(-3.0, 10.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parallelism;
    use crate::illumination::EnvironmentMap;
    use crate::reflectance::{Material, Variant};
    use crate::reflection::{Camera, Renderer, Settings, SphereImage, Viewpoint};
    use glam::DVec3;

    fn picture(material: &Material) -> SphereImage {
        // Waves, and a dark quarter.
        let map = EnvironmentMap::new(
            "waves",
            256,
            128,
            (0..256 * 128)
                .map(|i| {
                    let (row, column) = (i / 256, i % 256);
                    let value = 1.0 + 0.8 * (column as f64 / 9.0).sin() * (row as f64 / 7.0).cos();
                    if column < 64 {
                        [1e-3; 3]
                    } else {
                        [value, 1.0, 0.5 * value]
                    }
                })
                .collect(),
        )
        .expect("the map is well formed");
        let renderer = Renderer::new(&map, Parallelism::Sequential).expect("the map is small");
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).expect("the camera is well formed");
        let rendering = renderer.render(
            material,
            Variant::RadianceSampled,
            &camera,
            &Settings::default(),
            Parallelism::Sequential,
        );
        rendering.expect("the settings are allowed").image
    }

    #[test]
    fn the_light_that_a_mirror_shows_makes_the_matte_sphere() {
        let layout = RingLayout::new(Viewpoint::Orthographic, 64, 32).expect("it has rings");
        let plan = MirroredLight::new(&layout).expect("it has orders enough");
        let mirror = Material::from_albedos("mirror", [0.0; 3], [1.0; 3], 0.0)
            .expect("the albedos are allowed");
        let mirror = Unwrapped::new(&picture(&mirror), &layout).expect("it is large");
        let white = Unwrapped::new(&picture(&Material::white()), &layout).expect("it is large");
        let matte = plan.matte(&mirror, |rgb| rgb).expect("it is not black");
        let mean = white.mean()[1];
        for (index, white) in white.values().iter().enumerate() {
            for (matte, white) in matte.iter().zip(white) {
                // What is behind the sphere is not seen, and irradiance has degrees above six.
                assert!(
                    (matte[index] - white).abs() < 0.05 * mean,
                    "{} {white}",
                    matte[index]
                );
            }
        }
    }

    #[test]
    fn a_plastic_has_a_floor_and_a_mirror_has_none() {
        let layout = RingLayout::new(Viewpoint::Orthographic, 64, 32).expect("it has rings");
        let plan = MirroredLight::new(&layout).expect("it has orders enough");
        let darkest = |diffuse: f64, specular: f64| {
            let material = Material::from_albedos("sphere", [diffuse; 3], [specular; 3], 0.0)
                .expect("the albedos are allowed");
            let picture = Unwrapped::new(&picture(&material), &layout).expect("it is large");
            plan.of(&picture).expect("it is not black")[0].exp()
        };
        // ρ_d/(ρ_d + ρ_s), but for how irradiance differs from place to place.
        for (diffuse, specular) in [(0.04, 0.06), (0.2, 0.05)] {
            let floor = diffuse / (diffuse + specular);
            let found = darkest(diffuse, specular) / floor;
            assert!((0.6..1.5).contains(&found), "{found} of {floor}");
        }
        assert!(darkest(0.0, 1.0) < 0.02);
    }
}
