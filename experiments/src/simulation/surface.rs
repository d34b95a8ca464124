//! The surface of a simulated ball: albedos that vary from place to place, and bumps.

use lobes::glam::DVec3;

use super::draw::{Draw, mix, smoothstep};
use super::noise::Noise;
use super::nuisances::Nuisances;

/// What is painted or cut on a body.
#[derive(Debug, Clone)]
enum Mark {
    /// A disc with strokes on it.
    Disc {
        centre: DVec3,
        angle: f64,
        colour: [f64; 3],
        strokes: Vec<Stroke>,
        ink: [f64; 3],
    },
    /// A band between two parallel planes.
    Band {
        axis: DVec3,
        low: f64,
        high: f64,
        colour: [f64; 3],
    },
    /// The seam of a tennis ball.
    Seam {
        frame: [DVec3; 3],
        swing: f64,
        width: f64,
        colour: [f64; 3],
        groove: f64,
    },
    /// Dark patches about the corners of an icosahedron.
    Patches {
        frame: [DVec3; 3],
        angle: f64,
        colour: [f64; 3],
    },
    /// Where noise passes a level: marble, rust, dirt.
    Cloud {
        noise: Noise,
        frequency: f64,
        octaves: u32,
        gain: f64,
        warp: f64,
        level: f64,
        soft: f64,
        colour: [f64; 3],
    },
    /// Writing: strokes about a place.
    Writing { strokes: Vec<Stroke>, ink: [f64; 3] },
    /// A hole.
    Hole {
        centre: DVec3,
        angle: f64,
        inside: [f64; 3],
    },
}

/// A line between two places, of some width, all on the unit sphere.
#[derive(Debug, Clone, Copy)]
struct Stroke {
    from: DVec3,
    to: DVec3,
    width: f64,
}

impl Stroke {
    fn distance(&self, p: DVec3) -> f64 {
        let along = self.to - self.from;
        let t = ((p - self.from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        (p - self.from - along * t).length()
    }
}

/// How the normal varies.
#[derive(Debug, Clone)]
struct Bumps {
    noise: Noise,
    frequency: f64,
    octaves: u32,
    gain: f64,
    /// The root mean square slope.
    slope: f64,
    /// Lines along this axis, so many times finer across it.
    brushed: Option<(DVec3, f64)>,
    /// Dimples of this share of their distance.
    dimples: Option<f64>,
}

/// A surface.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    pub(super) body: [f64; 3],
    marks: Vec<Mark>,
    grain: Option<(Noise, f64, u32, f64, f64)>,
    bumps: Vec<Bumps>,
    /// How much of the marks the gloss shows too, as dirt on a metal does.
    gloss_follows: f64,
}

/// A surface at one place.
#[derive(Debug, Clone, Copy)]
pub(super) struct At {
    pub(super) body: [f64; 3],
    /// What the gloss is multiplied by.
    pub(super) gloss: f64,
    /// What is added to the unit normal.
    pub(super) tilt: DVec3,
}

impl Surface {
    pub(super) fn plain(body: [f64; 3]) -> Self {
        Self {
            body,
            marks: Vec::new(),
            grain: None,
            bumps: Vec::new(),
            gloss_follows: 0.0,
        }
    }

    /// The surface at a place of the unit sphere.
    pub(super) fn at(&self, p: DVec3) -> At {
        let mut at = At {
            body: self.body,
            gloss: 1.0,
            tilt: DVec3::ZERO,
        };
        for mark in &self.marks {
            let (part, colour, tilt) = mark.at(p);
            if part > 0.0 {
                at.body = mix(at.body, colour, part);
                at.gloss *= 1.0
                    - part
                        * if matches!(mark, Mark::Hole { .. }) {
                            1.0
                        } else {
                            self.gloss_follows
                        };
            }
            at.tilt += tilt;
        }
        if let Some((noise, frequency, octaves, gain, amplitude)) = self.grain {
            let factor = (amplitude * 1.7 * noise.octaves(p, frequency, octaves, gain)).exp();
            at.body = at.body.map(|v| (v * factor).min(1.0));
            at.gloss *= 1.0 + self.gloss_follows * (factor - 1.0);
        }
        for bumps in &self.bumps {
            at.tilt += bumps.at(p);
        }
        at
    }
}

impl Surface {
    /// Whether what is seen of a place is something painted on the body or cut into it that differs
    /// from it by more than a fifth in some channel: a print, a band, a seam, writing, a hole, but
    /// no cloud, which is the body's own.
    pub(super) fn is_painted(&self, p: DVec3) -> bool {
        let mut body = self.body;
        let mut prints = self.marks.iter();
        while let Some(mark) = prints.find(|mark| !matches!(mark, Mark::Cloud { .. })) {
            let (part, colour, _) = mark.at(p);
            body = mix(body, colour, part);
        }
        let mut channels = body.into_iter().zip(self.body);
        channels.any(|(here, body)| (here - body).abs() > 0.2 * here.max(body))
    }

    /// Whether there are clouds on it: marble, rust, dirt.
    pub(super) fn is_cloudy(&self) -> bool {
        self.marks
            .iter()
            .any(|mark| matches!(mark, Mark::Cloud { .. }))
    }
}

impl Bumps {
    fn at(&self, p: DVec3) -> DVec3 {
        if let Some(depth) = self.dimples {
            let to = self.noise.nearest(p * self.frequency);
            let r = to.length();
            // The slope of a bowl, none between bowls.
            let slope = if r < 0.55 {
                (std::f64::consts::PI * r / 0.55).sin()
            } else {
                0.0
            };
            return to.normalize_or_zero() * slope * depth * -1.0;
        }
        let q = match self.brushed {
            Some((axis, finer)) => {
                let along = axis * axis.dot(p);
                (p - along) * self.frequency * 0.3 + along * self.frequency * finer
            }
            None => p * self.frequency,
        };
        let field = |shift: f64| {
            self.noise
                .octaves(q + DVec3::splat(shift), 1.0, self.octaves, self.gain)
        };
        if let Some((axis, _)) = self.brushed {
            return axis * (1.9 * self.slope * field(0.0));
        }
        DVec3::new(field(0.0), field(101.0), field(202.0)) * (1.4 * self.slope)
    }
}

impl Mark {
    /// How much of a place it covers, its colour there, and a tilt of the normal.
    fn at(&self, p: DVec3) -> (f64, [f64; 3], DVec3) {
        let none = DVec3::ZERO;
        match self {
            Self::Disc {
                centre,
                angle,
                colour,
                strokes,
                ink,
            } => {
                let off = p.dot(*centre).clamp(-1.0, 1.0).acos();
                let part = 1.0 - smoothstep(angle - 0.008, angle + 0.008, off);
                if part == 0.0 {
                    return (0.0, *colour, none);
                }
                let inked = strokes
                    .iter()
                    .map(|s| 1.0 - smoothstep(s.width - 0.008, s.width + 0.008, s.distance(p)))
                    .fold(0.0, f64::max);
                (part, mix(*colour, *ink, inked), none)
            }
            Self::Band {
                axis,
                low,
                high,
                colour,
            } => {
                let z = p.dot(*axis);
                let part = smoothstep(low - 0.008, low + 0.008, z)
                    * (1.0 - smoothstep(high - 0.008, high + 0.008, z));
                (part, *colour, none)
            }
            Self::Seam {
                frame,
                swing,
                width,
                colour,
                groove,
            } => {
                let (x, y, z) = (p.dot(frame[0]), p.dot(frame[1]), p.dot(frame[2]));
                // z = swing sin 2φ, written so that it has no trouble at the poles.
                let rho2 = (x * x + y * y).max(1e-9);
                let off = z - swing * 2.0 * x * y / rho2;
                let steep = (1.0 + 4.0 * swing * swing).sqrt();
                let d = (off / steep).abs();
                let part = 1.0 - smoothstep(0.7 * width, 1.3 * width, d);
                let slope = if d < 3.0 * width {
                    groove * (off / steep / width).clamp(-3.0, 3.0) * (-d / width).exp()
                } else {
                    0.0
                };
                (part, *colour, frame[2] * slope)
            }
            Self::Patches {
                frame,
                angle,
                colour,
            } => {
                const G: f64 = 1.618_033_988_749_895;
                let norm = (1.0 + G * G).sqrt();
                let (x, y, z) = (
                    p.dot(frame[0]).abs(),
                    p.dot(frame[1]).abs(),
                    p.dot(frame[2]).abs(),
                );
                let cos = ((y + G * z).max(x + G * y).max(z + G * x)) / norm;
                let part =
                    1.0 - smoothstep(angle - 0.01, angle + 0.01, cos.clamp(-1.0, 1.0).acos());
                (part, *colour, none)
            }
            Self::Cloud {
                noise,
                frequency,
                octaves,
                gain,
                warp,
                level,
                soft,
                colour,
            } => {
                let q = if *warp > 0.0 {
                    let shift =
                        |s: f64| noise.octaves(p + DVec3::splat(s), 0.5 * frequency, 2, 0.5);
                    p + DVec3::new(shift(31.0), shift(53.0), shift(71.0)) * *warp
                } else {
                    p
                };
                let value = noise.octaves(q, *frequency, *octaves, *gain);
                (smoothstep(level - soft, level + soft, value), *colour, none)
            }
            Self::Writing { strokes, ink } => {
                let inked = strokes
                    .iter()
                    .map(|s| 1.0 - smoothstep(s.width - 0.008, s.width + 0.008, s.distance(p)))
                    .fold(0.0, f64::max);
                (inked, *ink, none)
            }
            Self::Hole {
                centre,
                angle,
                inside,
            } => {
                let off = p.dot(*centre).clamp(-1.0, 1.0).acos();
                let part = 1.0 - smoothstep(angle - 0.012, angle + 0.012, off);
                let bevel = (-((off - angle) / (0.2 * angle)).powi(2)).exp();
                let inwards = (*centre - p * p.dot(*centre)).normalize_or_zero();
                // The far wall of the hole is lit a little.
                (part, *inside, inwards * 0.5 * bevel)
            }
        }
    }
}

/// Strokes about a centre, within an angle of it: a numeral or a letter or two.
fn strokes(draw: &mut Draw, centre: DVec3, size: f64, count: usize, width: f64) -> Vec<Stroke> {
    let x = (draw.direction())
        .cross(centre)
        .normalize_or(centre.any_orthonormal_vector());
    let y = centre.cross(x);
    let place = |draw: &mut Draw| {
        let (u, v) = (draw.between(-size, size), draw.between(-size, size));
        (centre + x * u + y * v).normalize()
    };
    let mut from = place(draw);
    (0..count)
        .map(|_| {
            if draw.chance(0.3) {
                from = place(draw);
            }
            let to = place(draw);
            let stroke = Stroke { from, to, width };
            from = to;
            stroke
        })
        .collect()
}

pub(super) fn ink(draw: &mut Draw) -> [f64; 3] {
    match draw.index(4) {
        0 | 1 => [draw.between(0.01, 0.05); 3],
        2 => [draw.between(0.7, 0.95); 3],
        _ => {
            let (s, v) = (draw.unit(), draw.unit());
            draw.colour(s, v)
        }
    }
}

/// Any colour of a body: whites, greys, blacks, and colours of any saturation.
pub(super) fn body(draw: &mut Draw) -> [f64; 3] {
    match draw.index(10) {
        0 => [draw.between(0.6, 0.95); 3],
        1 => [draw.log_between(0.01, 0.06); 3],
        2 => [draw.log_between(0.05, 0.6); 3],
        3 => {
            let v = draw.log_between(0.03, 0.5);
            let s = draw.between(0.1, 0.6);
            // Brown: what rust, leather and wood are.
            let hue = draw.between(0.3, 0.7);
            [v, v * (1.0 - s * (1.0 - hue)), v * (1.0 - s)]
        }
        _ => {
            let (s, v) = (draw.unit().sqrt(), draw.log_between(0.03, 0.95));
            draw.colour(s, v)
        }
    }
}

/// What varies on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Matte,
    Glossy,
    Metal,
}

impl Surface {
    /// A surface whose albedo and normals vary as those of things do.
    pub(super) fn draw(
        kind: Kind,
        colour: [f64; 3],
        nuisances: Nuisances,
        draw: &mut Draw,
    ) -> Self {
        let mut surface = Self::varied(kind, colour, draw);
        if !nuisances.texture {
            surface.marks.clear();
            surface.grain = None;
        }
        if !nuisances.relief {
            surface.bumps.clear();
        }
        surface
    }

    fn varied(kind: Kind, colour: [f64; 3], draw: &mut Draw) -> Self {
        let mut surface = Self::plain(colour);
        let towards = |draw: &mut Draw| {
            // Mostly before the camera, where it is seen.
            let d = draw.direction();
            if d.z < 0.0 && draw.chance(0.7) { -d } else { d }
        };
        let plain = draw.chance(0.3);
        if plain {
            return surface;
        }
        // Metals are painted and stained too, but seldom.
        if kind != Kind::Metal || draw.chance(0.3) {
            // Clouds: marble and rust.
            let clouds = if draw.chance(0.35) {
                1 + draw.index(3)
            } else {
                0
            };
            for _ in 0..clouds {
                let soft = draw.log_between(0.02, 1.0);
                let near = draw.chance(0.5);
                let colour = if near {
                    let f = draw.log_between(0.3, 2.0);
                    surface.body.map(|v| (v * f).min(1.0))
                } else {
                    body(draw)
                };
                let warp = if draw.chance(0.5) {
                    draw.between(0.0, 1.5)
                } else {
                    0.0
                };
                surface.marks.push(Mark::Cloud {
                    noise: Noise { seed: draw.seed() },
                    frequency: draw.log_between(0.7, 12.0),
                    octaves: 1 + draw.index(5) as u32,
                    gain: draw.between(0.3, 0.9),
                    warp,
                    level: draw.between(-0.3, 0.6),
                    soft,
                    colour,
                });
            }
            if draw.chance(0.12) {
                let centre = towards(draw);
                let angle = draw.between(0.25, 0.75);
                let width = draw.between(0.03, 0.06);
                let count = 2 + draw.index(4);
                let colour = if draw.chance(0.8) {
                    [draw.between(0.7, 0.95); 3]
                } else {
                    ink(draw)
                };
                surface.marks.push(Mark::Disc {
                    centre,
                    angle,
                    colour,
                    strokes: strokes(draw, centre, 0.6 * angle, count, width),
                    ink: ink(draw),
                });
            }
            if draw.chance(0.1) {
                let axis = draw.direction();
                let low = draw.between(-0.9, 0.7);
                let high = low + draw.log_between(0.03, 1.2);
                let colour = if draw.chance(0.5) {
                    [draw.between(0.6, 0.95); 3]
                } else {
                    body(draw)
                };
                surface.marks.push(Mark::Band {
                    axis,
                    low,
                    high,
                    colour,
                });
                if draw.chance(0.3) {
                    let colour = body(draw);
                    surface.marks.push(Mark::Band {
                        axis,
                        low: -high,
                        high: -low,
                        colour,
                    });
                }
            }
            if kind == Kind::Matte && draw.chance(0.15) || draw.chance(0.03) {
                let colour = ink(draw);
                surface.marks.push(Mark::Seam {
                    frame: draw.frame(),
                    swing: draw.between(0.2, 0.6),
                    width: draw.log_between(0.01, 0.05),
                    colour,
                    groove: draw.between(0.0, 0.3),
                });
            }
            if draw.chance(0.04) {
                let colour = ink(draw);
                surface.marks.push(Mark::Patches {
                    frame: draw.frame(),
                    angle: draw.between(0.2, 0.4),
                    colour,
                });
            }
        }
        if draw.chance(0.15) {
            let centre = towards(draw);
            let size = draw.between(0.15, 0.45);
            let count = 3 + draw.index(14);
            let width = draw.log_between(0.008, 0.03);
            surface.marks.push(Mark::Writing {
                strokes: strokes(draw, centre, size, count, width),
                ink: ink(draw),
            });
        }
        let holes = if kind == Kind::Glossy { 0.25 } else { 0.05 };
        if draw.chance(holes) {
            let centre = towards(draw);
            let angle = draw.between(0.08, 0.16);
            let count = 1 + draw.index(3);
            for _ in 0..count {
                let apart = draw.between(0.25, 0.6);
                let at = (centre + apart * draw.direction()).normalize();
                surface.marks.push(Mark::Hole {
                    centre: at,
                    angle,
                    inside: [draw.log_between(0.005, 0.08); 3],
                });
            }
        }
        if draw.chance(if kind == Kind::Matte { 0.7 } else { 0.35 }) {
            let high = match kind {
                Kind::Matte => 0.4,
                Kind::Glossy => 0.15,
                Kind::Metal => 0.25,
            };
            surface.grain = Some((
                Noise { seed: draw.seed() },
                draw.log_between(1.0, 40.0),
                1 + draw.index(6) as u32,
                draw.between(0.4, 1.0),
                draw.log_between(0.01, high),
            ));
        }
        surface.gloss_follows = match kind {
            Kind::Metal => draw.between(0.5, 1.0),
            Kind::Glossy if draw.chance(0.15) => draw.unit(),
            Kind::Glossy => 0.0,
            Kind::Matte => draw.unit(),
        };
        let bumpy = match kind {
            Kind::Matte => 0.6,
            Kind::Glossy => 0.2,
            Kind::Metal => 0.4,
        };
        if draw.chance(bumpy) {
            let most = match kind {
                Kind::Matte => 0.35,
                Kind::Glossy => 0.02,
                Kind::Metal => 0.04,
            };
            surface.bumps.push(Bumps {
                noise: Noise { seed: draw.seed() },
                frequency: draw.log_between(2.0, 60.0),
                octaves: 1 + draw.index(4) as u32,
                gain: draw.between(0.5, 1.0),
                slope: draw.log_between(0.003, most),
                brushed: None,
                dimples: None,
            });
        }
        if kind == Kind::Metal && draw.chance(0.3) {
            surface.bumps.push(Bumps {
                noise: Noise { seed: draw.seed() },
                frequency: draw.log_between(2.0, 8.0),
                octaves: 3,
                gain: 0.9,
                slope: draw.log_between(0.01, 0.15),
                brushed: Some((draw.direction(), draw.log_between(4.0, 20.0))),
                dimples: None,
            });
        }
        if kind != Kind::Metal && draw.chance(0.06) {
            surface.bumps.push(Bumps {
                noise: Noise { seed: draw.seed() },
                frequency: draw.log_between(3.0, 9.0),
                octaves: 1,
                gain: 1.0,
                slope: 0.0,
                brushed: None,
                dimples: Some(draw.between(0.05, 0.35)),
            });
        }
        surface
    }
}
