//! What the light that a picture would mirror makes of a matte sphere, beside the picture.

use nalgebra::DMatrix;

use super::rings::{Modes, RingLayout, Unwrapped};
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

/// Below this share of the irradiance a ratio is that share.
const FAINTEST: f64 = 1e-3;

/// The plan of the features that ask how dark a sphere is where it mirrors the dark.
///
/// Take the picture I for a mirror's: then it shows light from nearly everywhere, and a matte white sphere in that light would show E(n)/π, E the
/// irradiance from the I that each direction is mirrored in. Of a sphere of albedos ρ_d and ρ_s that mirrors, I = ρ_d E_L/π + ρ_s L, the darkest
/// I/(E/π) is ρ_d/(ρ_d + ρ_s), or a little more, wherever there is a place to mirror that is dark: a plastic has a floor, chrome has none. Exposure
/// and the strength of the light cancel. The ratio is taken of luminance and, for the colour of the floor, of red and of blue.
///
/// Features: ln of nine percentiles of the luminance's ratio; the correlation of ln I with ln E over the picture, and the slope of that regression;
/// then, of red and of blue, ln of three percentiles of their ratios over the luminance's.
#[derive(Debug, Clone)]
pub struct MirroredLight {
    layout: RingLayout,
    /// For each order, what light on a ring of mirrored directions gives as irradiance on a ring of normals, over π.
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
    /// [`Error::Unanswerable`] for a layout of fewer orders than the irradiance has.
    pub fn new(layout: &RingLayout) -> Result<Self> {
        if layout.orders() < DEGREE {
            return Err(Error::Unanswerable(format!(
                "the light that a picture mirrors needs {DEGREE} orders; the layout has {}",
                layout.orders()
            )));
        }
        let angles = layout.angles();
        let rings = angles.len();
        let step = 2.0 * angles[0];
        let mirrored = |angle: f64| angle + layout.viewpoint().view_angle(angle);
        // A ring stands for the directions half-way to the next; the last for all behind the sphere too.
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
    /// [`Error::Unanswerable`] for a black picture; [`Error::Length`] for one that was unwrapped for another layout.
    pub fn of(&self, picture: &Unwrapped) -> Result<Vec<f64>> {
        let fields = |rgb: [f64; 3]| [Luminance::Rec709.of(rgb), rgb[0], rgb[2]];
        let matte = self.matte(picture, fields)?;
        let mut ratios: [Vec<f64>; 3] = Default::default();
        for (rgb, matte) in picture.values().iter().zip(&matte) {
            for ((ratio, value), matte) in ratios.iter_mut().zip(fields(*rgb)).zip(matte) {
                ratio.push((value.max(0.0) / matte.max(1e-300)).max(FAINTEST).ln());
            }
        }
        let line = regression(picture.values().iter().zip(&ratios[0]).zip(&matte).map(
            |((_, ratio), matte)| {
                let matte = matte[0].max(1e-300).ln();
                (matte, matte + ratio)
            },
        ));
        for ratios in &mut ratios {
            ratios.sort_unstable_by(f64::total_cmp);
        }
        let at = |ratios: &[f64], level: f64| ratios[(level * (ratios.len() - 1) as f64) as usize];
        let mut features: Vec<f64> = LEVELS.iter().map(|&level| at(&ratios[0], level)).collect();
        features.extend(line);
        for channel in &ratios[1..] {
            features.extend(COLOUR_LEVELS.map(|level| at(channel, level) - at(&ratios[0], level)));
        }
        Ok(features)
    }

    /// What a matte white sphere shows at each place of the picture in the light that the picture mirrors.
    fn matte(
        &self,
        picture: &Unwrapped,
        fields: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<Vec<[f64; 3]>> {
        let layout = self.layout.with_orders_up_to(DEGREE);
        let modes = Modes::of(picture, &layout, &fields)?;
        let mean = modes[0].cosine(0).iter().sum::<f64>();
        if mean.is_nan() || mean <= 0.0 {
            return Err(Error::Unanswerable(
                "the picture of the sphere is black".into(),
            ));
        }
        let (rings, columns) = (picture.rings(), picture.columns());
        let mut matte = vec![[0.0; 3]; rings * columns];
        let turn = std::f64::consts::TAU / columns as f64;
        for (m, transfer) in self.transfers.iter().enumerate() {
            let waves: Vec<(f64, f64)> = (0..columns)
                .map(|column| (turn * ((m * column) % columns) as f64).sin_cos())
                .collect();
            // Cosine and sine amplitudes of each channel.
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
            for (row, values) in irradiance.row_iter().zip(matte.chunks_exact_mut(columns)) {
                let parts: [f64; 6] = std::array::from_fn(|part| row[part]);
                for (value, (sin, cos)) in values.iter_mut().zip(&waves) {
                    for channel in 0..3 {
                        value[channel] += cos * parts[channel] + sin * parts[channel + 3];
                    }
                }
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
        let chrome = Material::from_albedos("chrome", [0.0; 3], [1.0; 3], 0.0)
            .expect("the albedos are allowed");
        let chrome = Unwrapped::new(&picture(&chrome), &layout).expect("it is large");
        let white = Unwrapped::new(&picture(&Material::white()), &layout).expect("it is large");
        let matte = plan.matte(&chrome, |rgb| rgb).expect("it is not black");
        let mean = white.mean()[1];
        for (matte, white) in matte.iter().zip(white.values()) {
            for channel in 0..3 {
                // What is behind the sphere is not seen, and irradiance has degrees above six.
                assert!(
                    (matte[channel] - white[channel]).abs() < 0.05 * mean,
                    "{matte:?} {white:?}"
                );
            }
        }
    }

    #[test]
    fn a_plastic_has_a_floor_and_chrome_has_none() {
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
