//! The light about balls of known reflectance under captured maps, beside the maps.

use lobes::features::{Modes, Unwrapped};
use lobes::glam::{DMat3, DQuat, DVec3};
use lobes::harmonics::{Coefficients, Rotation, Transform, convolve_zonal, evaluate};
use lobes::illumination::EnvironmentMap;
use lobes::inference::{BrightLights, ChannelReflectance, LightReader, natural_spectrum};
use lobes::reflectance::{Material, Variant, lambert};
use lobes::reflection::{Camera, Renderer, Settings, Viewpoint};
use lobes::sphere::Grid;
use lobes::{Parallelism, Result};

/// A ball whose reflectance is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownBall {
    /// What it is called.
    pub name: &'static str,
    /// The same for every channel.
    pub reflectance: ChannelReflectance,
}

const fn ball(name: &'static str, diffuse: f64, specular: f64, sigma: f64) -> KnownBall {
    KnownBall {
        name,
        reflectance: ChannelReflectance {
            diffuse,
            specular,
            sigma,
        },
    }
}

/// A mirror, a gloss, a rough metal and a matte ball.
pub const KNOWN_BALLS: [KnownBall; 4] = [
    ball("mirror", 0.0, 0.9, 0.0),
    ball("plastic, σ = 0.05", 0.3, 0.05, 0.05),
    ball("rough metal, σ = 0.1", 0.0, 0.9, 0.1),
    ball("matte", 0.7, 0.0, 0.0),
];

/// How near the light that was read off a ball is to the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownLight {
    /// The relative root mean square of the irradiance's error at normals that the camera sees,
    /// evenly over the picture to 0.96 of the radius.
    pub irradiance: f64,
    /// The mean of ((L_lm − L̂_lm)/deviation)² to the degree that the ball shows.
    pub chi_square: f64,
}

/// The degree of light that a ball shows: 1/σ, of a mirror all to `most`, and of a matte ball, which
/// has no lobe, 2.
pub(crate) fn degree_shown(ball: &KnownBall, most: usize) -> usize {
    let ChannelReflectance {
        specular, sigma, ..
    } = ball.reflectance;
    if specular == 0.0 {
        return 2;
    }
    ((1.0 / sigma) as usize).min(most)
}

/// The degree to which light is read.
const DEGREE: usize = 127;

/// Reads the light off the green channel of rendered pictures of 128 pixels a side, whose exposure is
/// known: of each ball, of each map.
///
/// # Errors
/// What the renderer and the reader refuse.
pub fn light_of_known_balls(
    maps: &[EnvironmentMap],
    balls: &[KnownBall],
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Vec<KnownLight>>> {
    let layout = LightReader::default_layout(Viewpoint::Orthographic)?;
    let spectrum = natural_spectrum(0.5, DEGREE);
    let readers = balls
        .iter()
        .map(|ball| {
            let (lobe, noise) = (Variant::default(), LightReader::NOISE);
            LightReader::new(
                lobe,
                ball.reflectance,
                &layout,
                &spectrum,
                noise,
                parallelism,
            )
        })
        .collect::<Result<Vec<_>>>()?;
    let of_maps = parallelism.map(maps.len(), |index| {
        let truth = MapLight::new(&maps[index])?;
        let renderer = Renderer::new(&maps[index], Parallelism::Sequential)?;
        let all = balls.iter().zip(&readers).map(|(ball, reader)| {
            let found = of_ball(&renderer, &truth, ball, reader);
            done();
            found
        });
        all.collect::<Result<Vec<_>>>()
    });
    let of_maps = of_maps.into_iter().collect::<Result<Vec<_>>>()?;
    let by_ball = |ball| of_maps.iter().map(|of_map| of_map[ball]).collect();
    Ok((0..balls.len()).map(by_ball).collect())
}

fn of_ball(
    renderer: &Renderer,
    truth: &MapLight,
    ball: &KnownBall,
    reader: &LightReader,
) -> Result<KnownLight> {
    let ChannelReflectance {
        diffuse,
        specular,
        sigma,
    } = ball.reflectance;
    let material = Material::from_albedos("ball", [diffuse; 3], [specular; 3], sigma)?;
    let settings = Settings {
        pixel_samples: if specular > 0.0 && sigma == 0.0 { 4 } else { 1 },
        ..Settings::default()
    };
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let one = Parallelism::Sequential;
    let image = renderer
        .render(&material, Variant::default(), &camera, &settings, one)?
        .image;
    let unwrapped = Unwrapped::new(&image, reader.layout())?;
    let [modes] = Modes::of(&unwrapped, reader.layout(), |rgb| [rgb[1]])?;
    let lights = BrightLights::of(&unwrapped, reader.layout());
    let estimate = reader.read(&modes, &lights)?;
    // Irradiance hardly has a degree past 12.
    let mut found = estimate.mean.with_degree(IRRADIANCE_DEGREE);
    convolve_zonal(&mut found, &lambert::transfers(IRRADIANCE_DEGREE)?)?;
    let (mut off, mut all) = (0.0, 0.0);
    let at = |index: usize| (2 * index + 1) as f64 / NORMALS as f64 - 1.0;
    for place in 0..NORMALS * NORMALS {
        let (x, y) = (at(place % NORMALS), at(place / NORMALS));
        if x.hypot(y) < 0.96 {
            let normal = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
            // The harmonics' frame is the view's: the pole towards the camera.
            let [found, true_one] = [&found, &truth.irradiance].map(|of| evaluate(of, normal));
            let (found, true_one) = (found?, true_one?);
            off += (found - true_one).powi(2);
            all += true_one * true_one;
        }
    }
    let (mut squares, mut count) = (0.0, 0.0);
    for l in 0..=degree_shown(ball, MIRROR_DEGREE) as isize {
        for m in -l..=l {
            let l = l as usize;
            let off = estimate.mean.get(l, m) - truth.radiance.get(l, m);
            squares += (off / reader.deviation(&estimate, l, m)?).powi(2);
            count += 1.0;
        }
    }
    Ok(KnownLight {
        irradiance: f64::sqrt(off / all),
        chi_square: squares / count,
    })
}

/// Normals along a side of the picture at which irradiance is compared.
const NORMALS: usize = 48;

/// To here irradiance is taken.
const IRRADIANCE_DEGREE: usize = 16;

/// The degree to which a mirror's light is judged: what its rings carry.
const MIRROR_DEGREE: usize = 60;

/// A map's green light in the view's frame, the pole towards +z.
struct MapLight {
    radiance: Coefficients,
    irradiance: Coefficients,
}

impl MapLight {
    fn new(map: &EnvironmentMap) -> Result<Self> {
        let grid = Grid::lat_long(map.height(), map.width())?;
        let values: Vec<f64> = map.pixels().iter().map(|rgb| rgb[1]).collect();
        let upright = Transform::new(&grid, DEGREE)?.analyse(&values)?;
        // The harmonic frame's (x, y, z) are the world's (z, x, y), and the view's are its own.
        let axes = DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y);
        let turn = DQuat::from_mat3(&axes);
        let radiance = Rotation::new(DEGREE)?.rotate(&upright, turn, Parallelism::Sequential)?;
        let mut irradiance = radiance.with_degree(IRRADIANCE_DEGREE);
        convolve_zonal(&mut irradiance, &lambert::transfers(IRRADIANCE_DEGREE)?)?;
        Ok(Self {
            radiance,
            irradiance,
        })
    }
}
