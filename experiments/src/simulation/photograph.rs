//! One ball under one light, photographed.

use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, Luminance};
use lobes::inference::FinishTruth;
use lobes::picture::{Circle, Picture};
use lobes::reflectance::{Finish, Material, Variant};
use lobes::reflection::{Camera as View, Renderer, Settings, SphereImage};
use lobes::{Parallelism, Result};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::camera::Camera;
use super::disc::{Disc, DiscAt, Shape};
use super::draw::{Draw, mix, times};
use super::light::{Backdrop, Light};
use super::noise::Noise;
use super::nuisances::Nuisances;
use super::surface::{Kind, Surface, body};

/// A photograph of a ball that is not there.
#[derive(Debug, Clone)]
pub struct SimulatedPhotograph {
    /// What it shows.
    pub truth: FinishTruth,
    /// Pixels a side.
    pub side: usize,
    /// Red, green and blue of each pixel as sRGB codes.
    pub codes: Vec<u8>,
    /// Where the ball is, as far as the reader is told.
    pub circle: Circle,
    /// Where it is.
    pub outline: Circle,
    /// Of each pixel, whether it shows something painted on the ball or cut into it (a print, a band,
    /// a seam, writing, a hole) whose albedo differs from the body's by more than a fifth in some
    /// channel.
    pub painted: Vec<bool>,
    /// Whether the body's own albedo varies in clouds: marble, rust, dirt.
    pub cloudy: bool,
}

impl SimulatedPhotograph {
    /// The photograph as a picture.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn picture(&self) -> Result<Picture> {
        Picture::from_srgb8(self.side, self.side, self.codes.clone())
    }
}

/// A picture of a ball that is looked up at any place of the unit disc.
struct Layer {
    size: usize,
    values: Vec<[f64; 3]>,
}

/// Pixels beyond this share of the radius are taken from within it: they mix the ball with nothing.
const RIM: f64 = 0.985;

impl Layer {
    fn new(image: &SphereImage) -> Self {
        let size = image.size();
        let half = 0.5 * size as f64;
        let values = (0..size * size).map(|i| {
            let (row, column) = (i / size, i % size);
            image.get(row, column).unwrap_or_else(|| {
                let (x, y) = (column as f64 + 0.5 - half, row as f64 + 0.5 - half);
                let scale = RIM * half / x.hypot(y);
                let (row, column) = ((y * scale + half) as usize, (x * scale + half) as usize);
                image.get(row, column).unwrap_or_default()
            })
        });
        Self {
            size,
            values: values.collect(),
        }
    }

    /// The value at a place, x to the right and y up, each in −1 … 1: bilinear.
    fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let n = self.size as f64;
        let place = |v: f64| (0.5 * (v + 1.0) * n - 0.5).clamp(0.0, n - 1.001);
        let (u, v) = (place(x), place(-y));
        let (column, row) = (u as usize, v as usize);
        let (fu, fv) = (u - column as f64, v - row as f64);
        let above = &self.values[row * self.size + column..];
        let below = &self.values[(row + 1) * self.size + column..];
        mix(mix(above[0], above[1], fu), mix(below[0], below[1], fu), fv)
    }

    fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for rgb in &self.values {
            for (sum, value) in sum.iter_mut().zip(rgb) {
                *sum += value;
            }
        }
        sum.map(|sum| sum / self.values.len() as f64)
    }
}

/// A light, and what white balls show in it.
pub(super) struct Scene {
    light: Light,
    /// What is seen behind the ball, out of focus.
    behind: Option<EnvironmentMap>,
    diffuse: Layer,
    mean_diffuse: [f64; 3],
    /// Rising σ.
    specular: Vec<(f64, Layer)>,
}

/// Photographs of `count` balls in one light, which is drawn about one of `environments` or of a
/// studio.
///
/// σ of smooth metals is 0 … 0.02, of glossy bodies 0 … 0.2, of rough metals 0.05 … 0.5, and of the
/// faint sheen of half of the matte bodies 0.22 … 0.5.
///
/// # Errors
/// What the renderer finds wrong.
pub fn simulate(
    environments: &[EnvironmentMap],
    nuisances: Nuisances,
    seed: u64,
    count: usize,
) -> Result<Vec<SimulatedPhotograph>> {
    let mut draw = Draw(Pcg64::seed_from_u64(seed));
    let scene = Scene::draw(environments, nuisances, &mut draw)?;
    let photographs = (0..count).map(|_| scene.photograph(nuisances, &mut draw));
    Ok(photographs.collect())
}

/// A metal's reflectance straight on: steel, chrome, gold, brass, copper, or any colour.
fn metal(draw: &mut Draw) -> [f64; 3] {
    let base = match draw.index(8) {
        0..=2 => [0.9; 3],
        3 => [0.55, 0.55, 0.56],
        4 => [1.0, 0.78, 0.34],
        5 => [0.91, 0.78, 0.42],
        6 => [0.95, 0.64, 0.54],
        _ => {
            let (saturation, value) = (draw.unit(), draw.between(0.4, 1.0));
            draw.colour(saturation, value)
        }
    };
    let dull = draw.between(0.6, 1.0);
    base.map(|v: f64| (v * dull * (0.05 * draw.normal()).exp()).clamp(0.02, 1.0))
}

/// What a ball is made of.
struct Ball {
    finish: Option<Finish>,
    kind: Kind,
    /// Which of the scene's lobes.
    lobe: usize,
    /// The specular reflectance straight on.
    facing: [f64; 3],
    body: [f64; 3],
}

impl Ball {
    fn draw(draw: &mut Draw) -> Self {
        let finish = match draw.index(13) {
            0..=2 => Some(Finish::Matte),
            3..=5 => Some(Finish::GlossyPlastic),
            6..=8 => Some(Finish::RoughMetal),
            9..=10 => Some(Finish::SmoothMetal),
            _ => None,
        };
        let metallic = |draw: &mut Draw, lobe: usize| {
            let facing = metal(draw);
            let patina = if draw.chance(0.5) {
                0.0
            } else {
                draw.between(0.0, 0.12)
            };
            Self {
                finish,
                kind: Kind::Metal,
                lobe,
                facing,
                body: facing.map(|v| v * patina),
            }
        };
        match finish {
            Some(Finish::RoughMetal) => {
                let lobe = if draw.chance(0.65) { 3 } else { 4 };
                metallic(draw, lobe)
            }
            Some(Finish::SmoothMetal) => {
                let lobe = draw.index(2);
                metallic(draw, lobe)
            }
            Some(Finish::Matte) => {
                // Half of what people call matte has a faint, very wide sheen.
                let sheen = if draw.chance(0.55) {
                    0.0
                } else {
                    draw.between(0.0, 0.06)
                };
                Self {
                    finish,
                    kind: Kind::Matte,
                    lobe: 4,
                    facing: [sheen; 3],
                    body: body(draw),
                }
            }
            _ => {
                let (lobe, facing) = (draw.index(4), draw.log_between(0.025, 0.09));
                Self {
                    finish,
                    kind: Kind::Glossy,
                    lobe,
                    facing: [facing; 3],
                    body: body(draw),
                }
            }
        }
    }

    fn truth(&self, sigma: f64) -> FinishTruth {
        let luminance = |rgb| Luminance::Rec709.of(rgb);
        let (specular, diffuse) = (luminance(self.facing), luminance(self.body));
        let metal = self.kind == Kind::Metal;
        FinishTruth {
            finish: self.finish,
            sigma: (metal || self.finish == Some(Finish::GlossyPlastic)).then_some(sigma),
            share: self
                .finish
                .map(|_| specular / (specular + diffuse).max(1e-9)),
            base_colour: self
                .finish
                .map(|_| if metal { self.facing } else { self.body }),
        }
    }
}

impl Scene {
    /// Something round that is no ball, in it.
    pub(super) fn disc(&self, shape: Shape, draw: &mut Draw) -> Look<'_> {
        let disc = Disc::draw(shape, draw);
        Look {
            scene: self,
            ball: Ball {
                finish: None,
                kind: Kind::Glossy,
                lobe: draw.index(5),
                facing: [0.0; 3],
                body: [0.0; 3],
            },
            surface: Surface::plain([0.0; 3]),
            ground: disc.ground(draw),
            appearance: Appearance::Disc(disc),
            flatter: 0.0,
            flakes: 0.0,
        }
    }

    pub(super) fn draw(
        environments: &[EnvironmentMap],
        nuisances: Nuisances,
        draw: &mut Draw,
    ) -> Result<Self> {
        let light = Light::draw(environments, nuisances, draw)?;
        let one = Parallelism::Sequential;
        let renderer = Renderer::new(&light.map, one)?;
        let view = if draw.chance(0.5) {
            View::orthographic(DVec3::Z, DVec3::Y)?
        } else {
            View::perspective(DVec3::Z, DVec3::Y, draw.log_between(3.5, 28.0))?
        };
        let render = |material: &Material, size: usize, pixel_samples: usize| -> Result<Layer> {
            let mut settings = Settings {
                size,
                tolerance: 3e-2,
                pixel_samples,
            };
            let lobe = Variant::default();
            let rendering = renderer.render(material, lobe, &view, &settings, one);
            let rendering = rendering.or_else(|_| {
                settings.tolerance = 0.1;
                renderer.render(material, lobe, &view, &settings, one)
            })?;
            Ok(Layer::new(&rendering.image))
        };
        let diffuse = render(&Material::white(), 48, 1)?;
        let sigmas = [
            0.0,
            draw.log_between(0.003, 0.02),
            draw.log_between(0.02, 0.06),
            draw.log_between(0.05, 0.2),
            draw.log_between(0.22, 0.5),
        ];
        let mut specular = Vec::with_capacity(sigmas.len());
        for sigma in sigmas {
            let mirror = sigma == 0.0;
            // A lobe alone leaves places so dark that a relative error cannot be kept there.
            let body = if mirror { 0.0 } else { 0.5 };
            let part = Material::from_albedos("part", [body; 3], [1.0 - body; 3], sigma)?;
            // A wide lobe shows no more than so many pixels can.
            let size = if mirror {
                160
            } else if sigma < 0.02 {
                128
            } else if sigma < 0.05 {
                96
            } else if sigma < 0.12 {
                64
            } else {
                48
            };
            let mut layer = render(&part, size, if mirror { 3 } else { 1 })?;
            let place = |index: usize| (2 * index + 1) as f64 / size as f64 - 1.0;
            for (i, value) in layer.values.iter_mut().enumerate() {
                let white = diffuse.at(place(i % size), -place(i / size));
                for (value, white) in value.iter_mut().zip(white) {
                    *value = ((*value - body * white) / (1.0 - body)).max(0.0);
                }
            }
            specular.push((sigma, layer));
        }
        let behind = match light.backdrop {
            Backdrop::Surroundings { blur, .. } => {
                let height = ((3.0 / blur) as usize).clamp(8, 128);
                Some(light.map.resampled(2 * height, height)?)
            }
            Backdrop::Wall { .. } => None,
        };
        Ok(Self {
            behind,
            mean_diffuse: diffuse.mean(),
            diffuse,
            specular,
            light,
        })
    }

    pub(super) fn photograph(&self, nuisances: Nuisances, draw: &mut Draw) -> SimulatedPhotograph {
        let mut ball = Ball::draw(draw);
        if !nuisances.colour {
            ball.body = [Luminance::Rec709.of(ball.body); 3];
            ball.facing = [Luminance::Rec709.of(ball.facing); 3];
        }
        let look = Look::draw(self, ball, nuisances, draw);
        let camera = Camera::draw(nuisances, draw);
        let radius = draw.log_between(24.0, 90.0);
        // Half of the frames are tight about the ball.
        let margin = if draw.chance(0.5) {
            draw.between(1.0, 1.15)
        } else {
            draw.between(1.15, 1.6)
        };
        let frame = Frame { radius, margin };
        let mut photograph = look.take(&camera, frame, draw);
        if nuisances.outline {
            let mut off = |share: f64| share * radius * draw.normal().clamp(-3.0, 3.0);
            let Circle { x, y, radius } = photograph.circle;
            photograph.circle = Circle {
                x: x + off(0.01),
                y: y + off(0.01),
                radius: radius + off(0.015),
            };
        }
        photograph
    }

    /// What is seen past the ball, x and y in radii.
    fn behind(&self, x: f64, y: f64, margin: f64, white: f64, noise: Noise) -> [f64; 3] {
        match &self.light.backdrop {
            Backdrop::Surroundings { depth, .. } => {
                let direction = DVec3::new(x, y, -depth);
                self.behind
                    .as_ref()
                    .map_or([0.0; 3], |map| map.radiance(direction))
            }
            Backdrop::Wall {
                top,
                bottom,
                grain,
                shadow,
            } => {
                let down = (0.5 * (1.0 - y / margin)).clamp(0.0, 1.0);
                let wall = mix(
                    top.map(|v| v.min(white)),
                    bottom.map(|v| v.min(white)),
                    down,
                );
                let grain = if *grain > 0.0 {
                    (grain * noise.octaves(DVec3::new(x, y, 0.0), 6.0, 3, 0.6)).exp()
                } else {
                    1.0
                };
                let below = (x / 0.8).powi(2) + ((y + 1.02) / 0.22).powi(2);
                let dark = 1.0 - shadow * (-below).exp();
                wall.map(|v| v * grain * dark)
            }
        }
    }
}

/// How large a ball is in a square picture, in pixels, and half the picture's side in radii.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) radius: f64,
    pub(super) margin: f64,
}

/// How a ball looks in a scene.
pub(super) struct Look<'a> {
    scene: &'a Scene,
    ball: Ball,
    surface: Surface,
    appearance: Appearance,
    /// How far the shading of felt and of stone is flatter than Lambert's.
    flatter: f64,
    /// How much of the body is metal flakes below a clear coat.
    flakes: f64,
    /// What is behind it, as a share of what a white wall shows, where that is not what the scene
    /// says.
    ground: Option<[f64; 3]>,
}

/// By what a ball's look is computed.
enum Appearance {
    /// By its surface.
    Surface,
    /// As glass of this index.
    Glass(f64),
    /// As a flat picture, a little brighter towards one side.
    Flat { shade: f64, towards: DVec3 },
    /// As something round that is no ball.
    Disc(Disc),
}

impl<'a> Look<'a> {
    fn draw(scene: &'a Scene, ball: Ball, nuisances: Nuisances, draw: &mut Draw) -> Self {
        let surface = Surface::draw(ball.kind, ball.body, nuisances, draw);
        let appearance = if ball.finish.is_some() {
            Appearance::Surface
        } else {
            match draw.index(3) {
                0 => Appearance::Flat {
                    shade: draw.between(0.0, 0.6),
                    towards: draw.direction(),
                },
                1 => Appearance::Glass([1.0, 1.33, 1.5, 1.5][draw.index(4)]),
                _ => {
                    let shape = Shape::ALL[draw.index(Shape::ALL.len())];
                    Appearance::Disc(Disc::draw(shape, draw))
                }
            }
        };
        let ground = match &appearance {
            Appearance::Disc(disc) => disc.ground(draw),
            _ => None,
        };
        let flatter = if ball.finish == Some(Finish::Matte) && draw.chance(0.5) {
            draw.between(0.0, 0.5)
        } else {
            0.0
        };
        let flakes = if ball.finish == Some(Finish::GlossyPlastic) && draw.chance(0.15) {
            draw.between(0.0, 0.7)
        } else {
            0.0
        };
        Self {
            scene,
            ball,
            surface,
            appearance,
            flatter,
            flakes,
            ground,
        }
    }

    /// A photograph of it, its centre about half a pixel off the middle.
    pub(super) fn take(
        &self,
        camera: &Camera,
        Frame { radius, margin }: Frame,
        draw: &mut Draw,
    ) -> SimulatedPhotograph {
        let side = (2.0 * margin * radius).ceil() as usize;
        let centre = [0, 1].map(|_| 0.5 * side as f64 + draw.between(-0.5, 0.5));
        let mut pixels = vec![[0.0; 3]; side * side];
        let mut painted = vec![false; side * side];
        let (mut sum, mut count) = (0.0, 0.0);
        let place = |i: usize| {
            let x = (i % side) as f64 + 0.5 - centre[0];
            let y = centre[1] - (i / side) as f64 - 0.5;
            (x, y, (x * x + y * y).sqrt())
        };
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let (x, y, off) = place(i);
            if off < radius + 0.5 {
                let scale = 1.0 / off.max(radius);
                *pixel = self.at(x * scale, y * scale);
                if off < radius - 0.5 {
                    sum += Luminance::Rec709.of(*pixel);
                    count += 1.0;
                    painted[i] = self.is_painted(x * scale, y * scale);
                }
            }
        }
        let mean = f64::max(sum / f64::max(count, 1.0), 1e-9);
        let white = camera.white() * mean;
        let grain = Noise { seed: draw.seed() };
        let ground = self
            .ground
            .map(|albedo| times(albedo, self.scene.mean_diffuse));
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let (x, y, off) = place(i);
            let inside = (radius - off + 0.5).clamp(0.0, 1.0);
            if inside < 1.0 {
                let behind = ground.unwrap_or_else(|| {
                    let (x, y) = (x / radius, y / radius);
                    self.scene.behind(x, y, margin, white, grain)
                });
                *pixel = mix(behind, *pixel, inside);
            }
        }
        let codes = camera.take(side, &mut pixels, mean, draw);
        let circle = Circle {
            x: centre[0],
            y: centre[1],
            radius,
        };
        SimulatedPhotograph {
            truth: self.ball.truth(self.scene.specular[self.ball.lobe].0),
            side,
            codes,
            circle,
            outline: circle,
            painted,
            cloudy: self.surface.is_cloudy(),
        }
    }

    /// Whether a place of the unit disc shows something painted on a ball.
    fn is_painted(&self, x: f64, y: f64) -> bool {
        let square = (x * x + y * y).min(0.9999);
        matches!(self.appearance, Appearance::Surface)
            && self
                .surface
                .is_painted(DVec3::new(x, y, (1.0 - square).sqrt()))
    }

    /// The radiance of a place of something round that is no ball.
    fn disc(&self, at: DiscAt) -> [f64; 3] {
        let Some(normal) = at.normal else {
            return times(at.albedo, self.scene.mean_diffuse);
        };
        let (u, v) = on_disc(normal);
        let diffuse = times(at.albedo, self.scene.diffuse.at(u, v));
        let mirrored = times(at.mirrored, self.scene.specular[self.ball.lobe].1.at(u, v));
        std::array::from_fn(|c| diffuse[c] + mirrored[c])
    }

    /// The radiance at a place of the unit disc.
    fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let square = (x * x + y * y).min(0.9999);
        let normal = DVec3::new(x, y, (1.0 - square).sqrt());
        if let Appearance::Glass(index) = self.appearance {
            return glass(&self.scene.light.map, normal, index);
        }
        if let Appearance::Disc(disc) = &self.appearance {
            return self.disc(disc.at(x, y));
        }
        let at = self.surface.at(normal);
        if let Appearance::Flat { shade, towards } = self.appearance {
            let dark = 1.0 - shade * (0.5 - 0.5 * normal.dot(towards));
            return times(at.body, self.scene.mean_diffuse).map(|v| v * dark);
        }
        let tilted = (normal + at.tilt - normal * at.tilt.dot(normal)).normalize();
        let (u, v) = on_disc(tilted);
        let diffuse = mix(
            self.scene.diffuse.at(u, v),
            self.scene.mean_diffuse,
            self.flatter,
        );
        let (_, widest) = &self.scene.specular[4];
        let diffuse = mix(diffuse, widest.at(u, v), self.flakes);
        let (sigma, specular) = &self.scene.specular[self.ball.lobe];
        let specular = specular.at(u, v);
        // Schlick 1994 (doi:10.1111/1467-8659.1330233), less of it the rougher the surface is.
        let grazing = (1.0 - normal.z).powi(5) / (1.0 + 4.0 * sigma);
        std::array::from_fn(|c| {
            let facing = self.ball.facing[c];
            let mirrored = if facing > 0.0 {
                facing + (1.0 - facing) * grazing
            } else {
                0.0
            };
            let below = if self.ball.kind == Kind::Metal {
                1.0
            } else {
                1.0 - mirrored
            };
            at.body[c] * below * diffuse[c] + mirrored * at.gloss * specular[c]
        })
    }
}

/// Where a ball has a normal: within its rim, since nothing else is seen of it.
fn on_disc(normal: DVec3) -> (f64, f64) {
    let (u, v) = (normal.x, normal.y);
    let off = (u * u + v * v).sqrt();
    if normal.z < 0.0 || off > RIM {
        let scale = RIM / off.max(RIM);
        return (u * scale, v * scale);
    }
    (u, v)
}

/// A ball of glass: what is refracted twice and what is reflected once.
fn glass(map: &EnvironmentMap, normal: DVec3, index: f64) -> [f64; 3] {
    let ray = DVec3::NEG_Z;
    let refract = |ray: DVec3, normal: DVec3, ratio: f64| -> Option<DVec3> {
        let cos = -ray.dot(normal);
        let square = 1.0 - ratio * ratio * (1.0 - cos * cos);
        (square >= 0.0).then(|| (ray * ratio + normal * (ratio * cos - square.sqrt())).normalize())
    };
    let through = refract(ray, normal, index.recip()).and_then(|inside| {
        let exit = normal - inside * 2.0 * inside.dot(normal);
        refract(inside, -exit, index)
    });
    let through = through.map_or([0.0; 3], |direction| map.radiance(direction));
    let mirrored = map.radiance(ray - 2.0 * ray.dot(normal) * normal);
    let reflected = 0.04 + 0.96 * (1.0 - normal.z).powi(5);
    mix(through, mirrored, reflected)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lobes::illumination::builtin;

    /// A plain matte ball shows its albedo times what the renderer gives for a white one.
    #[test]
    fn a_plain_ball_is_what_the_renderer_shows() {
        let maps = builtin().unwrap();
        let mut draw = Draw(Pcg64::seed_from_u64(3));
        let scene = Scene::draw(&maps, Nuisances::NONE, &mut draw).unwrap();
        let plain = |kind, lobe, facing: f64, body: f64| Look {
            scene: &scene,
            ball: Ball {
                finish: Some(Finish::Matte),
                kind,
                lobe,
                facing: [facing; 3],
                body: [body; 3],
            },
            surface: Surface::plain([body; 3]),
            appearance: Appearance::Surface,
            flatter: 0.0,
            flakes: 0.0,
            ground: None,
        };
        let matte = plain(Kind::Matte, 4, 0.0, 0.3);
        let metal = plain(Kind::Metal, 1, 0.8, 0.0);
        for place in [(0.0, 0.0), (0.3, -0.4), (-0.7, 0.2)] {
            let (x, y): (f64, f64) = place;
            let (white, mirrored) = (scene.diffuse.at(x, y), scene.specular[1].1.at(x, y));
            let grazing = (1.0 - (1.0 - x * x - y * y).sqrt()).powi(5);
            let sigma = scene.specular[1].0;
            let facing = 0.8 + 0.2 * grazing / (1.0 + 4.0 * sigma);
            for c in 0..3 {
                assert!((matte.at(x, y)[c] - 0.3 * white[c]).abs() < 1e-12);
                assert!((metal.at(x, y)[c] - facing * mirrored[c]).abs() < 1e-9);
            }
        }
    }

    /// A ball of glass of index 1 is not there but for its reflection; one of index 1.5 turns what
    /// is behind it upside down.
    #[test]
    fn glass_refracts() {
        let pixels = (0..64 * 32).map(|i| [if i / 64 < 16 { 1.0 } else { 0.0 }; 3]);
        let map = EnvironmentMap::new("sky", 64, 32, pixels.collect()).unwrap();
        let normal = DVec3::new(0.0, 0.4, (1.0f64 - 0.16).sqrt());
        // A ray that enters above the middle of a lens leaves it downwards.
        let through = glass(&map, normal, 1.5);
        assert!(through[0] < 0.1, "{through:?}");
        let below = glass(&map, DVec3::new(0.0, -0.4, normal.z), 1.5);
        assert!(below[0] > 0.9, "{below:?}");
    }
}
