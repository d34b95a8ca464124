//! Pictures without a ball, which a reader of balls should not take for one.

use lobes::Result;
use lobes::glam::DVec3;
use lobes::illumination::EnvironmentMap;
use lobes::picture::Picture;
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::camera::Camera;
use super::disc::Shape;
use super::draw::{Draw, mix};
use super::noise::Noise;
use super::nuisances::Nuisances;
use super::photograph::{Frame, Scene};
use super::surface::{body, ink};

/// What a picture without a ball shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thing {
    /// A wall.
    Wall,
    /// The surroundings, sharp.
    Room,
    /// Boxes, lines of text and round buttons.
    Screen,
    /// Nothing: a black frame with some noise.
    Black,
    /// A plate.
    Plate,
    /// A clock.
    Clock,
    /// The end of a cylinder, a coin, a log.
    End,
    /// The moon.
    Moon,
    /// A drawing of a ball.
    Drawing,
    /// A photograph of a ball, printed with a white border, and photographed again.
    Print,
}

impl Thing {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Wall,
        Self::Room,
        Self::Screen,
        Self::Black,
        Self::Plate,
        Self::Clock,
        Self::End,
        Self::Moon,
        Self::Drawing,
        Self::Print,
    ];

    /// What it is called in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wall => "a wall",
            Self::Room => "a room or a landscape",
            Self::Screen => "a screen with text and buttons",
            Self::Black => "a black frame",
            Self::Plate => "a plate",
            Self::Clock => "a clock",
            Self::End => "a coin, a log, the end of a cylinder",
            Self::Moon => "the moon",
            Self::Drawing => "a drawing of a ball",
            Self::Print => "a printed photograph of a ball",
        }
    }

    fn shape(self) -> Option<Shape> {
        match self {
            Self::Plate => Some(Shape::Plate),
            Self::Clock => Some(Shape::Clock),
            Self::End => Some(Shape::End),
            Self::Moon => Some(Shape::Moon),
            Self::Drawing => Some(Shape::Drawing),
            _ => None,
        }
    }
}

/// Pixels a side of the pictures that have no round thing in them.
const SIDE: usize = 240;

/// A photograph of `thing`, about one of `environments` where there is light in it.
///
/// # Errors
/// What the renderer finds wrong.
pub fn simulate_thing(environments: &[EnvironmentMap], thing: Thing, seed: u64) -> Result<Picture> {
    let nuisances = Nuisances::ALL;
    let mut draw = Draw(Pcg64::seed_from_u64(seed));
    let draw = &mut draw;
    if let Some(shape) = thing.shape() {
        let scene = Scene::draw(environments, nuisances, draw)?;
        let camera = Camera::draw(nuisances, draw);
        let frame = Frame {
            radius: draw.log_between(30.0, 90.0),
            margin: draw.between(1.05, 1.8),
        };
        return scene.disc(shape, draw).take(&camera, frame, draw).picture();
    }
    let camera = Camera::draw(nuisances, draw);
    let mut light = match thing {
        Thing::Room => room(environments, draw),
        Thing::Screen => screen(draw),
        Thing::Print => {
            let scene = Scene::draw(environments, nuisances, draw)?;
            print(&scene.photograph(nuisances, draw).picture()?, draw)
        }
        Thing::Black => vec![[1e-4; 3]; SIDE * SIDE],
        _ => wall(draw),
    };
    let mean = if thing == Thing::Black {
        1.0
    } else {
        light.iter().map(|rgb| rgb[1]).sum::<f64>() / light.len() as f64
    };
    let codes = camera.take(SIDE, &mut light, mean.max(1e-9), draw);
    Picture::from_srgb8(SIDE, SIDE, codes)
}

/// Each pixel by its place, x to the right and y up, each in −1 … 1.
fn drawn(mut at: impl FnMut(f64, f64) -> [f64; 3]) -> Vec<[f64; 3]> {
    let place = |i: usize| (2 * i + 1) as f64 / SIDE as f64 - 1.0;
    let pixels = (0..SIDE * SIDE).map(|i| at(place(i % SIDE), -place(i / SIDE)));
    pixels.collect()
}

fn wall(draw: &mut Draw) -> Vec<[f64; 3]> {
    let (top, bottom) = (body(draw), body(draw));
    let gradient = if draw.chance(0.5) { draw.unit() } else { 0.0 };
    let (noise, grain) = (Noise { seed: draw.seed() }, draw.between(0.0, 0.6));
    let frequency = draw.log_between(1.0, 20.0);
    drawn(|x, y| {
        let colour = mix(top, bottom, gradient * 0.5 * (1.0 - y));
        let value = noise.octaves(DVec3::new(x, y, 0.0), frequency, 4, 0.7);
        colour.map(|v| v * (grain * value).exp())
    })
}

fn room(environments: &[EnvironmentMap], draw: &mut Draw) -> Vec<[f64; 3]> {
    let map = &environments[draw.index(environments.len())];
    let (azimuth, elevation) = (
        draw.between(0.0, std::f64::consts::TAU),
        draw.between(-0.4, 0.5),
    );
    let forward = DVec3::new(
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
        elevation.cos() * azimuth.cos(),
    );
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let wide = draw.between(0.3, 0.9);
    drawn(|x, y| map.radiance(forward + (right * x + up * y) * wide))
}

fn screen(draw: &mut Draw) -> Vec<[f64; 3]> {
    let ground = body(draw);
    let boxes: Vec<_> = (0..2 + draw.index(5))
        .map(|_| {
            let centre = [draw.between(-1.0, 1.0), draw.between(-1.0, 1.0)];
            let half = [draw.log_between(0.1, 0.9), draw.log_between(0.05, 0.6)];
            (centre, half, body(draw))
        })
        .collect();
    let buttons: Vec<_> = (0..draw.index(4))
        .map(|_| {
            let centre = [draw.between(-0.8, 0.8), draw.between(-0.8, 0.8)];
            (centre, draw.log_between(0.05, 0.3), body(draw), ink(draw))
        })
        .collect();
    let (text, lines) = (ink(draw), draw.between(8.0, 30.0));
    let words = Noise { seed: draw.seed() };
    drawn(|x, y| {
        let mut colour = ground;
        for ([u, v], [half_width, half_height], of) in &boxes {
            if (x - u).abs() < *half_width && (y - v).abs() < *half_height {
                colour = *of;
            }
        }
        let line = (y * lines).floor();
        let within = y * lines - line;
        if (0.25..0.75).contains(&within)
            && words.at(DVec3::new(x * lines * 1.5, line * 7.3, 0.0)) > 0.2
        {
            colour = text;
        }
        for ([u, v], radius, of, sign) in &buttons {
            let off = (x - u).hypot(y - v);
            if off < *radius {
                let cross = (x - u).abs().min((y - v).abs()) < 0.12 * radius && off < 0.6 * radius;
                colour = if cross { *sign } else { *of };
            }
        }
        colour
    })
}

/// The photograph takes up most of the picture, a white border and a table the rest.
fn print(photograph: &Picture, draw: &mut Draw) -> Vec<[f64; 3]> {
    let (table, paper) = (body(draw), draw.between(0.7, 0.9));
    let (share, border) = (draw.between(0.55, 0.85), draw.between(0.03, 0.1));
    // Inks are paler than light.
    let black = draw.between(0.02, 0.1);
    let turn = 0.1 * draw.normal();
    let (sin, cos) = turn.sin_cos();
    let side = photograph.width() as f64;
    drawn(|x, y| {
        let (u, v) = ((cos * x + sin * y) / share, (cos * y - sin * x) / share);
        let off = u.abs().max(v.abs());
        if off < 1.0 {
            let at = |t: f64| (0.5 * (t + 1.0) * side) as usize;
            let rgb = photograph.get(at(-v), at(u)).unwrap_or_default();
            rgb.map(|value| black + (paper - black) * value)
        } else if off < 1.0 + border / share {
            [paper; 3]
        } else {
            table
        }
    })
}
