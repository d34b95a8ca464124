//! The light in which simulated photographs are taken.

use std::borrow::Cow;

use lobes::glam::{DMat3, DVec3};

use super::draw::{Draw, mix, smoothstep, times};
use super::noise::Noise;
use super::nuisances::Nuisances;
use super::place::{HEIGHT, WIDTH, direction, invented};
use lobes::Result;
use lobes::illumination::{EnvironmentMap, Luminance};

/// A light source that is a rectangle of directions.
#[derive(Debug, Clone)]
struct Panel {
    centre: DVec3,
    across: DVec3,
    up: DVec3,
    half_width: f64,
    half_height: f64,
    soft: f64,
    /// Bars of a window, in each direction.
    bars: usize,
    round: bool,
    radiance: [f64; 3],
}

impl Panel {
    /// How much of the panel is seen in a direction.
    fn covers(&self, d: DVec3) -> f64 {
        let depth = d.dot(self.centre);
        if depth < 0.05 {
            return 0.0;
        }
        let x = d.dot(self.across) / depth / self.half_width;
        let y = d.dot(self.up) / depth / self.half_height;
        let inside = if self.round {
            let r = x.hypot(y);
            1.0 - smoothstep(1.0 - self.soft, 1.0 + self.soft, r)
        } else {
            let edge = |v: f64| 1.0 - smoothstep(1.0 - self.soft, 1.0 + self.soft, v.abs());
            edge(x) * edge(y)
        };
        if self.bars == 0 || inside == 0.0 {
            return inside;
        }
        let bar = |v: f64| {
            let at = (0.5 * (v + 1.0) * (self.bars + 1) as f64).fract();
            if (0.08..=0.92).contains(&at) {
                1.0
            } else {
                0.0
            }
        };
        inside * bar(x) * bar(y)
    }
}

/// What the ball stands on.
#[derive(Debug, Clone)]
struct Ground {
    /// The height of its horizon, as the sine of an angle below the level.
    horizon: f64,
    albedo: [f64; 3],
    second: [f64; 3],
    pattern: usize,
    scale: f64,
    contrast: f64,
    noise: Noise,
    /// The angle about straight down within which the ball's own shadow lies.
    shadow: f64,
    frame: [DVec3; 3],
}

impl Ground {
    fn colour(&self, d: DVec3) -> [f64; 3] {
        let down = (-d.y).max(1e-3);
        let (x, z) = (d.x / down, d.z / down);
        let p = (self.frame[0] * x + self.frame[1] * z) * self.scale;
        let far = 1.0 / (1.0 + 0.05 * (x * x + z * z));
        let t = match self.pattern {
            0 => 0.0,
            1 => 0.5 + 0.5 * self.noise.octaves(p * 0.7, 1.0, 4, 0.7) * far,
            2 => f64::from(u8::from((p.x.floor() + p.y.floor()).rem_euclid(2.0) < 1.0)),
            _ => {
                let plank = p.x.floor();
                let line = if (p.x - plank) < 0.06 { 0.6 } else { 0.0 };
                0.5 + 0.4 * self.noise.at(DVec3::new(plank * 7.1, 0.3 * p.y, 0.0))
                    + 0.2 * self.noise.at(DVec3::new(8.0 * p.x, p.y, 3.0)) * far
                    - line
            }
        };
        let colour = mix(
            self.albedo,
            self.second,
            (self.contrast * t).clamp(0.0, 1.0),
        );
        let angle = down.clamp(0.0, 1.0).acos();
        let shadow = 1.0 - 0.85 * (1.0 - smoothstep(0.2 * self.shadow, self.shadow, angle));
        colour.map(|c| c * shadow)
    }
}

/// What is seen behind the ball.
#[derive(Debug, Clone)]
pub(super) enum Backdrop {
    /// The light itself, in the directions in which the camera sees past the ball.
    Surroundings { depth: f64, blur: f64 },
    /// A wall, from the top to the bottom of the picture, and a shadow below the ball.
    Wall {
        top: [f64; 3],
        bottom: [f64; 3],
        grain: f64,
        shadow: f64,
    },
}

/// The light of one photograph in the camera's frame: it stands towards +z, and up is +y but for a
/// tilt.
#[derive(Debug, Clone)]
pub(super) struct Light {
    pub(super) map: EnvironmentMap,
    pub(super) backdrop: Backdrop,
}

impl Light {
    /// Light about one of `environments`, or of a studio.
    pub(super) fn draw(
        environments: &[EnvironmentMap],
        nuisances: Nuisances,
        draw: &mut Draw,
    ) -> Result<Self> {
        let staged = nuisances.staging;
        let studio = staged && (environments.is_empty() || draw.chance(0.4));
        let elevation = draw.between(-0.2, 1.2) * f64::from(u8::from(draw.chance(0.65)));
        let azimuth = draw.between(0.0, std::f64::consts::TAU);
        let roll = 0.1 * draw.normal();
        let mirror = if draw.chance(0.5) { -1.0 } else { 1.0 };
        let (se, ce) = elevation.sin_cos();
        let (sa, ca) = azimuth.sin_cos();
        let (sr, cr) = roll.sin_cos();
        // From the camera's frame to that in which up is +y.
        let level = |d: DVec3| {
            let d = DVec3::new(cr * d.x - sr * d.y, sr * d.x + cr * d.y, d.z);
            DVec3::new(d.x, ce * d.y + se * d.z, -se * d.y + ce * d.z)
        };
        let world = |d: DVec3| DVec3::new(mirror * (ca * d.x + sa * d.z), d.y, ca * d.z - sa * d.x);
        let place = |draw: &mut Draw| -> Result<Cow<EnvironmentMap>> {
            // Two in five are as they were measured.
            Ok(if nuisances.invented && draw.chance(0.6) {
                Cow::Owned(invented(environments, draw)?)
            } else {
                Cow::Borrowed(&environments[draw.index(environments.len())])
            })
        };
        let environment = if studio || environments.is_empty() {
            None
        } else {
            Some(place(draw)?)
        };
        // Of mean luminance one.
        let even = |map: &EnvironmentMap| 1.0 / Luminance::Rec709.of(map.mean()).max(1e-9);
        let scale = environment.as_deref().map_or(1.0, even);
        // Two places, joined: light that nobody measured, of which every part was.
        let joined = if staged && environment.is_some() && draw.chance(0.4) {
            let other = place(draw)?;
            let strength = even(&other) * draw.log_between(0.3, 3.0);
            let (axis, turn) = (draw.direction(), draw.between(0.0, std::f64::consts::TAU));
            Some((
                other,
                strength,
                axis,
                DMat3::from_rotation_y(turn),
                draw.between(0.05, 0.8),
            ))
        } else {
            None
        };
        let tint = {
            let warm = 0.12 * draw.normal();
            let green = 0.04 * draw.normal();
            [(warm).exp(), green.exp(), (-warm).exp()]
        };
        // A studio's walls.
        let dark = draw.chance(0.4);
        let wall_value = if dark {
            draw.log_between(0.005, 0.15)
        } else {
            draw.log_between(0.3, 1.2)
        };
        let saturation = if draw.chance(0.7) {
            0.05 * draw.unit()
        } else {
            draw.between(0.0, 0.6)
        };
        let walls = draw.colour(saturation, wall_value);
        let ceiling = walls.map(|v| v * draw.log_between(0.6, 1.8));
        let room = Noise { seed: draw.seed() };
        let clutter = if draw.chance(0.5) {
            draw.between(0.0, 0.8)
        } else {
            0.0
        };
        let clutter_scale = draw.log_between(1.0, 5.0);
        let count = if studio {
            1 + draw.index(4)
        } else {
            usize::from(staged && draw.chance(0.25))
        };
        let mut panels: Vec<Panel> = (0..count).map(|_| panel(draw, studio)).collect();
        // A flash beside the lens.
        let flash = staged && draw.chance(0.12);
        if flash {
            let centre = (DVec3::Z + 0.25 * draw.direction()).normalize();
            let across = centre.any_orthonormal_vector();
            let size = draw.log_between(0.02, 0.08);
            let power = draw.log_between(0.3, 6.0) / (size * size);
            panels.push(Panel {
                centre,
                across,
                up: centre.cross(across),
                half_width: size,
                half_height: size,
                soft: 0.3,
                bars: 0,
                round: true,
                radiance: [power; 3],
            });
        }
        let ground = if studio || (staged && draw.chance(0.55)) {
            let value = draw.log_between(0.03, 1.0);
            let saturation = if draw.chance(0.5) {
                0.1 * draw.unit()
            } else {
                draw.between(0.0, 0.9)
            };
            let albedo = draw.colour(saturation, value);
            let second = albedo.map(|v| (v * draw.log_between(0.3, 2.5)).min(1.0));
            Some(Ground {
                horizon: draw.between(0.0, 0.35),
                albedo,
                second,
                pattern: draw.index(4),
                scale: draw.log_between(0.5, 6.0),
                contrast: draw.unit(),
                noise: Noise { seed: draw.seed() },
                shadow: draw.between(0.15, 0.9),
                frame: [draw.direction(), draw.direction(), DVec3::Y],
            })
        } else {
            None
        };
        // Somebody behind the camera.
        let person = staged && draw.chance(0.45);
        let person_width = draw.between(0.08, 0.35);
        let person_height = draw.between(-0.2, 0.3);
        let person_value = draw.log_between(0.02, 0.5);
        let person_saturation = draw.unit() * 0.6;
        let person_colour = draw.colour(person_saturation, person_value);
        let radiance = |d: DVec3| -> [f64; 3] {
            let up = level(d);
            let mut light = match &environment {
                Some(map) => {
                    let first = map.radiance(world(up)).map(|v| v * scale);
                    match &joined {
                        None => first,
                        Some((other, strength, axis, turn, soft)) => {
                            let second = other.radiance(*turn * up).map(|v| v * strength);
                            mix(first, second, smoothstep(-soft, *soft, up.dot(*axis)))
                        }
                    }
                }
                None => {
                    let t = smoothstep(-0.4, 0.8, up.y);
                    let base = mix(walls, ceiling, t);
                    let bumps = if clutter > 0.0 {
                        (clutter * 1.5 * room.octaves(world(up), clutter_scale, 4, 0.6)).exp()
                    } else {
                        1.0
                    };
                    base.map(|v| v * bumps)
                }
            };
            if let Some(ground) = &ground {
                let below = smoothstep(-ground.horizon - 0.01, -ground.horizon + 0.01, up.y);
                if below < 1.0 {
                    light = mix(ground.colour(up), light, below);
                }
            }
            for panel in &panels {
                let part = panel.covers(if flash { d } else { up });
                if part > 0.0 {
                    light = mix(light, panel.radiance, part);
                }
            }
            if person && d.z > 0.0 {
                let (x, y) = (d.x / d.z, d.y / d.z);
                let torso = 1.0 - smoothstep(0.9, 1.1, (x / person_width).abs());
                let under = 1.0 - smoothstep(-0.05, 0.05, y - person_height);
                let head = 1.0
                    - smoothstep(
                        0.9,
                        1.1,
                        (x / (0.5 * person_width))
                            .hypot((y - person_height) / (0.6 * person_width)),
                    );
                let part = (torso * under).max(head);
                light = mix(light, times(person_colour, [0.7; 3]), 0.95 * part);
            }
            times(light, tint)
        };
        let pixels = (0..WIDTH * HEIGHT)
            .map(|i| radiance(direction(i / WIDTH, i % WIDTH)))
            .collect();
        let map = EnvironmentMap::new("simulated", WIDTH, HEIGHT, pixels)?;
        if !nuisances.backdrop {
            let black = [0.0; 3];
            let backdrop = Backdrop::Wall {
                top: black,
                bottom: black,
                grain: 0.0,
                shadow: 0.0,
            };
            return Ok(Self { map, backdrop });
        }
        let plain = if studio {
            draw.chance(0.75)
        } else {
            draw.chance(0.25)
        };
        let backdrop = if plain {
            let kind = draw.unit();
            let (saturation, value) = if kind < 0.45 {
                (0.02 * draw.unit(), f64::INFINITY)
            } else if kind < 0.65 {
                (0.1 * draw.unit(), 0.0)
            } else {
                (draw.unit().powi(2), draw.log_between(0.05, 1.5))
            };
            // White is as bright as the camera can show; the camera puts it there.
            let wall = if value.is_infinite() {
                [1e9; 3]
            } else {
                draw.colour(saturation, value)
            };
            let gradient = if value.is_infinite() {
                1.0
            } else {
                draw.log_between(0.5, 1.2)
            };
            Backdrop::Wall {
                top: wall,
                bottom: wall.map(|v| v * gradient),
                grain: if draw.chance(0.3) {
                    draw.between(0.0, 0.3)
                } else {
                    0.0
                },
                shadow: if draw.chance(0.6) { draw.unit() } else { 0.0 },
            }
        } else {
            Backdrop::Surroundings {
                depth: draw.log_between(2.0, 12.0),
                blur: draw.log_between(0.01, 0.4),
            }
        };
        Ok(Self { map, backdrop })
    }
}

fn panel(draw: &mut Draw, studio: bool) -> Panel {
    let mut centre = draw.direction();
    // Lights are above, seldom below.
    if centre.y < 0.0 && draw.chance(0.85) {
        centre.y = -centre.y;
    }
    // And those that a ball shows best are before it.
    if centre.z < 0.0 && draw.chance(0.6) {
        centre.z = -centre.z;
    }
    let up = (DVec3::Y - centre * centre.y).normalize_or(DVec3::X);
    let roll = if draw.chance(0.3) {
        0.5 * draw.normal()
    } else {
        0.0
    };
    let side = centre.cross(up);
    let (sin, cos) = roll.sin_cos();
    let (across, up) = (side * cos + up * sin, up * cos - side * sin);
    let size = if draw.chance(0.3) {
        draw.log_between(0.03, 0.12)
    } else {
        draw.log_between(0.12, 0.8)
    };
    let aspect = draw.log_between(0.35, 2.5);
    let power = draw.log_between(0.15, 2.0) * if studio { 1.0 } else { 0.6 };
    let warm = 0.1 * draw.normal();
    // The flux is about the same whatever the size.
    let radiance = (power / (size * size)).clamp(1.0, 400.0);
    Panel {
        centre,
        across,
        up,
        half_width: size * aspect.sqrt(),
        half_height: size / aspect.sqrt(),
        soft: draw.log_between(0.02, 0.5),
        bars: if draw.chance(0.2) {
            1 + draw.index(3)
        } else {
            0
        },
        round: draw.chance(0.35),
        radiance: [radiance * warm.exp(), radiance, radiance * (-warm).exp()],
    }
}
