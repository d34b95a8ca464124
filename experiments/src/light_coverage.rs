//! How often the deviation of light that was read off a ball holds, where nobody told what the ball
//! is made of.

use lobes::glam::DVec3;
use lobes::harmonics::{Coefficients, Transform, evaluate};
use lobes::illumination::EnvironmentMap;
use lobes::inference::{
    BallLightReader, ChannelReflectance, FinishModel, LightQuantity, PortraitReader,
    PossibleReflectance,
};
use lobes::picture::{Circle, Picture};
use lobes::reflectance::{Finish, Material, Variant, lambert};
use lobes::reflection::{Camera, Renderer, Settings, Viewpoint};
use lobes::sphere::{self, Grid};
use lobes::{Error, Parallelism, Result};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Which pictures the light is read off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightShots {
    /// How many balls of each finish under each map.
    pub balls: usize,
    /// The generator's seed.
    pub seed: u64,
    /// Whether the exposure keeps the brightest pixel below saturation; else it is a camera's, with
    /// the ball's mean at 0.1 … 0.3 of saturation.
    pub unclipped: bool,
}

/// Of places and channels, how many there are and how many of the truths lie within the 90 %
/// interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// Those that the interval holds.
    pub held: usize,
    /// All.
    pub count: usize,
}

impl Held {
    /// The share that is held.
    pub fn share(self) -> f64 {
        self.held as f64 / self.count.max(1) as f64
    }

    fn add(&mut self, held: bool) {
        self.held += usize::from(held);
        self.count += 1;
    }
}

/// What was counted of balls of one finish.
#[derive(Debug, Clone, PartialEq)]
pub struct LightCoverage {
    /// The finish.
    pub finish: Finish,
    /// By map: the radiance from where the ball mirrors, to the reader's degree, and the irradiance at
    /// the normals that the camera sees; for each of [`ReflectanceKnowledge`].
    pub by_map: Vec<[[Held; KNOWLEDGES]; 2]>,
    /// Of each ball, for each of [`ReflectanceKnowledge`].
    pub balls: Vec<[LightLikeness; KNOWLEDGES]>,
}

/// What is known of the reflectance of a ball that light is read off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReflectanceKnowledge {
    /// What was read off the picture: the light is averaged over that.
    Averaged,
    /// The likeliest of what was read.
    Likeliest,
    /// All.
    Told,
}

const KNOWLEDGES: usize = 3;

/// How much light that was read off one ball is like the truth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LightLikeness {
    /// The correlation of the cube roots of mean and truth of the radiance, over directions and
    /// channels: 1 for the truth at any exposure.
    pub correlation: f64,
    /// The median over normals and channels of |mean − truth|/truth of the irradiance.
    pub irradiance_error: f64,
    /// The median of 1.645 deviations over the truth.
    pub irradiance_width: f64,
}

impl LightCoverage {
    /// What is held of all maps: radiance or irradiance.
    pub fn held(&self, quantity: usize, known: ReflectanceKnowledge) -> Held {
        let mut sum = Held::default();
        for map in &self.by_map {
            let part = map[quantity][known as usize];
            sum.held += part.held;
            sum.count += part.count;
        }
        sum
    }
}

/// Φ⁻¹(0.95).
const NINE_TENTHS: f64 = 1.644_853_626_951_472_7;

/// Pixels a side of a picture, and the radius of the ball in its middle.
const SIDE: usize = 160;
const RADIUS: f64 = 64.0;

/// Rows of the maps on which truth and estimate are compared: no fewer than the degree asks for.
const ROWS: usize = 98;

/// Every so many of their pixels counts.
const STRIDE: usize = 37;

/// Reads the light off simulated pictures of 8 bits of balls of random reflectances, and counts; `done`
/// is called after each map.
///
/// Maps are those that `model` has not learned from. Of a dielectric ρ_d is 0.03 … 0.8 by channel
/// and ρ_s 0.03 … 0.07, of a metal ρ_s is 0.5 … 0.98 by channel, σ of a rough metal and of a
/// dielectric 0.02 … 0.3, evenly in its logarithm.
///
/// # Errors
/// What the renderer and the readers find wrong.
pub fn light_coverage(
    model: &FinishModel,
    maps: &[EnvironmentMap],
    shots: LightShots,
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<LightCoverage>> {
    let readers = [LightQuantity::Radiance, LightQuantity::Irradiance]
        .map(|quantity| BallLightReader::new(Viewpoint::Orthographic, quantity));
    let [radiance, irradiance] = readers;
    let readers = [radiance?, irradiance?];
    let portraits = PortraitReader::new()?;
    let of_maps = parallelism.map(maps.len(), |index| {
        let truth = Truth::new(&maps[index])?;
        let renderer = Renderer::new(&maps[index], Parallelism::Sequential)?;
        let seed = shots
            .seed
            .wrapping_mul(1_000_003)
            .wrapping_add(index as u64);
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut counts = Vec::new();
        for finish in Finish::ALL {
            let mut held = [[Held::default(); KNOWLEDGES]; 2];
            let mut balls = Vec::new();
            for _ in 0..shots.balls {
                let shot = Shot::draw(&renderer, finish, shots.unclipped, &mut rng)?;
                let picture = shot.picture()?;
                let portrait = match portraits.read(&picture, shot.circle()) {
                    Ok(portrait) => portrait,
                    Err(Error::Black { .. } | Error::Saturated { .. }) => continue,
                    Err(error) => return Err(error),
                };
                let image = picture.sphere(shot.circle())?.image;
                let verdict = model.verdict(&portrait)?;
                let read = verdict.possible_reflectances();
                let likeliest = verdict.likeliest_material("ball")?;
                let likeliest = [PossibleReflectance::of_material(&likeliest)];
                let told = [PossibleReflectance::known(shot.channels)];
                let mut of_ball = [LightLikeness::default(); KNOWLEDGES];
                for (quantity, reader) in readers.iter().enumerate() {
                    let known = [&read[..], &likeliest, &told].into_iter().zip(&mut of_ball);
                    for (which, (points, like)) in known.enumerate() {
                        let light = reader.read(&image, points, Parallelism::Sequential)?;
                        let maps = light.lat_long(ROWS)?;
                        truth.judge(&maps, quantity, &shot, &mut held[quantity][which], like)?;
                    }
                }
                balls.push(of_ball);
            }
            counts.push((finish, held, balls));
        }
        done();
        Ok(counts)
    });
    let mut all: Vec<LightCoverage> = Vec::new();
    for of_map in of_maps {
        for (finish, held, balls) in of_map? {
            match all.iter_mut().find(|of| of.finish == finish) {
                Some(of) => {
                    of.by_map.push(held);
                    of.balls.extend(balls);
                }
                None => all.push(LightCoverage {
                    finish,
                    by_map: vec![held],
                    balls,
                }),
            }
        }
    }
    Ok(all)
}

/// A ball, photographed.
struct Shot {
    channels: [ChannelReflectance; 3],
    camera: Camera,
    exposure: f64,
    codes: Vec<u8>,
}

impl Shot {
    fn draw(renderer: &Renderer, finish: Finish, unclipped: bool, rng: &mut Pcg64) -> Result<Self> {
        let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let rough = (between(0.02f64.ln(), 0.3f64.ln())).exp();
        let grey = between(0.03, 0.8);
        let colour = [(); 3].map(|()| (grey * between(0.5, 1.2)).min(0.9));
        let metal = [(); 3].map(|()| between(0.5, 0.98));
        let gloss = between(0.03, 0.07);
        let (diffuse, specular, sigma) = match finish {
            Finish::Matte => (colour, [0.0; 3], 0.0),
            Finish::RoughMetal => ([0.0; 3], metal, rough),
            Finish::SmoothMetal => ([0.0; 3], metal, 0.0),
            _ => (colour, [gloss; 3], rough),
        };
        let turn = between(0.0, std::f64::consts::TAU);
        let rise = between(0.0, 0.5);
        let level = between(0.1, 0.3);
        let towards = DVec3::new(turn.sin() * rise.cos(), rise.sin(), turn.cos() * rise.cos());
        let camera = Camera::orthographic(towards, DVec3::Y)?;
        let material = Material::from_albedos("ball", diffuse, specular, sigma)?;
        let settings = Settings {
            size: 2 * RADIUS as usize,
            pixel_samples: if sigma == 0.0 { 4 } else { 1 },
            ..Settings::default()
        };
        let one = Parallelism::Sequential;
        let image = renderer
            .render(&material, Variant::default(), &camera, &settings, one)?
            .image;
        let brightest = image.iter().flat_map(|(_, _, rgb)| rgb).fold(0.0, f64::max);
        let mean = image.mean().iter().sum::<f64>() / 3.0;
        let exposure = if unclipped {
            0.95 / brightest
        } else {
            level / mean
        };
        let mut codes = vec![0; 3 * SIDE * SIDE];
        let border = (SIDE - image.size()) / 2;
        for (row, column, rgb) in image.iter() {
            let at = 3 * ((row + border) * SIDE + column + border);
            for (code, value) in codes[at..at + 3].iter_mut().zip(rgb) {
                *code = (255.0 * encoded(exposure * value)).round() as u8;
            }
        }
        Ok(Self {
            channels: [0, 1, 2].map(|c| ChannelReflectance {
                diffuse: diffuse[c],
                specular: specular[c],
                sigma,
            }),
            camera,
            exposure,
            codes,
        })
    }

    fn picture(&self) -> Result<Picture> {
        Picture::from_srgb8(SIDE, SIDE, self.codes.clone())
    }

    fn circle(&self) -> Circle {
        let middle = 0.5 * SIDE as f64;
        Circle {
            x: middle,
            y: middle,
            radius: RADIUS,
        }
    }
}

/// sRGB's curve (IEC 61966-2-1) of a value, which is cut off at 1.
fn encoded(value: f64) -> f64 {
    let value = value.clamp(0.0, 1.0);
    if value <= 0.003_130_8 {
        12.92 * value
    } else {
        1.055 * value.powf(1.0 / 2.4) - 0.055
    }
}

/// A map's light, to the reader's degree, and its irradiance.
struct Truth([[Coefficients; 3]; 2]);

impl Truth {
    fn new(map: &EnvironmentMap) -> Result<Self> {
        let grid = Grid::lat_long(map.height(), map.width())?;
        let transform = Transform::new(&grid, BallLightReader::DEGREE)?;
        let channel = |c: usize| {
            let values: Vec<f64> = map.pixels().iter().map(|rgb| rgb[c]).collect();
            transform.analyse(&values)
        };
        let radiance = [channel(0)?, channel(1)?, channel(2)?];
        let mut irradiance = radiance.clone();
        for of in &mut irradiance {
            let transfers = lambert::transfers(BallLightReader::DEGREE)?;
            lobes::harmonics::convolve_zonal(of, &transfers)?;
        }
        Ok(Self([radiance, irradiance]))
    }

    /// Counts what intervals hold, and says how much the light is like the truth.
    fn judge(
        &self,
        (mean, deviation): &(Vec<[f64; 3]>, Vec<[f64; 3]>),
        quantity: usize,
        shot: &Shot,
        held: &mut Held,
        like: &mut LightLikeness,
    ) -> Result<()> {
        let grid = Grid::lat_long(ROWS, 2 * ROWS)?;
        // Where the ball mirrors, short of its rim; and the normals that are seen.
        let behind: f64 = if quantity == 0 { -0.8 } else { 0.2 };
        let towards = shot.camera.towards();
        let (right, up) = (shot.camera.right(), shot.camera.up());
        let (mut errors, mut widths) = (Vec::new(), Vec::new());
        let mut roots = Vec::new();
        for place in (0..grid.len()).step_by(STRIDE) {
            let (row, column) = (place / grid.columns(), place % grid.columns());
            let of_view = sphere::from_harmonic(grid.direction(row, column));
            // Evenly over the sphere: of a row by the circle's length.
            let sine = grid.colatitude(row).sin();
            let keep = ((place / STRIDE) as f64 * 0.618_033_988_749_895).fract() < sine;
            if of_view.z < behind || !keep {
                continue;
            }
            let world = right * of_view.x + up * of_view.y + towards * of_view.z;
            for channel in 0..3 {
                let coefficients = &self.0[quantity][channel];
                let truth = shot.exposure * evaluate(coefficients, sphere::to_harmonic(world))?;
                let off = (mean[place][channel] - truth).abs();
                let width = NINE_TENTHS * deviation[place][channel];
                held.add(off <= width);
                roots.push([mean[place][channel], truth].map(|value| value.max(0.0).cbrt()));
                errors.push(off / truth.abs());
                widths.push(width / truth.abs());
            }
        }
        let median = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        if quantity == 0 {
            like.correlation = correlation(&roots);
        } else {
            like.irradiance_error = median(&mut errors);
            like.irradiance_width = median(&mut widths);
        }
        Ok(())
    }
}

/// Pearson's correlation of pairs.
fn correlation(pairs: &[[f64; 2]]) -> f64 {
    let n = pairs.len() as f64;
    let mean = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).sum::<f64>() / n);
    let moment = |i: usize, j: usize| -> f64 {
        let products = pairs
            .iter()
            .map(|pair| (pair[i] - mean[i]) * (pair[j] - mean[j]));
        products.sum()
    };
    moment(0, 1) / (moment(0, 0) * moment(1, 1)).sqrt()
}
