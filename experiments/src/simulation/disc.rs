//! Round things that are no balls: plates, clocks, the ends of cylinders, the moon, drawings.

use lobes::glam::{DVec2, DVec3};

use super::draw::{Draw, mix, smoothstep};
use super::noise::Noise;
use super::surface::{body, ink};

/// A round thing that is no ball, seen from the front.
#[derive(Debug, Clone)]
pub(super) enum Disc {
    /// A plate: its middle and its rim are level, and what is between them slopes inwards.
    Plate {
        glaze: [f64; 3],
        middle: f64,
        slope: f64,
        band: Option<(f64, f64, [f64; 3])>,
        gloss: f64,
    },
    /// A clock: a rim, twelve marks and two or three hands.
    Clock {
        face: [f64; 3],
        rim: [f64; 3],
        ink: [f64; 3],
        /// Angle, length and half the width of each.
        hands: Vec<(f64, f64, f64)>,
        numerals: bool,
    },
    /// The end of a cylinder, a coin, a log: rings, and lines that are cut into it.
    End {
        colour: [f64; 3],
        rings: Noise,
        /// Rings in a radius.
        count: f64,
        contrast: f64,
        lines: Vec<[DVec2; 2]>,
        metal: bool,
    },
    /// The moon: as bright at its edge as in its middle, and lit from one side.
    Moon { seas: Noise, sun: DVec3 },
    /// A drawing of a ball: an outline about a colour that grows darker in steps.
    Drawing {
        paint: [f64; 3],
        ink: [f64; 3],
        outline: f64,
        light: DVec2,
        /// Steps of shading; 0 is none.
        steps: usize,
        hatched: bool,
    },
}

/// Which of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Plate,
    Clock,
    End,
    Moon,
    Drawing,
}

impl Shape {
    pub(super) const ALL: [Self; 5] = [
        Self::Plate,
        Self::Clock,
        Self::End,
        Self::Moon,
        Self::Drawing,
    ];
}

/// A round thing at one place.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiscAt {
    pub(super) albedo: [f64; 3],
    /// What it mirrors straight on.
    pub(super) mirrored: [f64; 3],
    /// Nothing for what looks the same however it is lit.
    pub(super) normal: Option<DVec3>,
}

impl Disc {
    pub(super) fn draw(shape: Shape, draw: &mut Draw) -> Self {
        match shape {
            Shape::Plate => {
                let middle = draw.between(0.45, 0.75);
                Self::Plate {
                    glaze: if draw.chance(0.6) {
                        [draw.between(0.6, 0.9); 3]
                    } else {
                        body(draw)
                    },
                    middle,
                    slope: draw.between(0.15, 0.8),
                    band: draw.chance(0.5).then(|| {
                        let from = draw.between(0.5, 0.95);
                        (from, from + draw.log_between(0.01, 0.2), body(draw))
                    }),
                    gloss: draw.log_between(0.02, 0.06),
                }
            }
            Shape::Clock => {
                let light = draw.chance(0.7);
                Self::Clock {
                    face: if light {
                        [draw.between(0.6, 0.9); 3]
                    } else {
                        body(draw)
                    },
                    rim: body(draw),
                    ink: if light { [0.03; 3] } else { ink(draw) },
                    hands: (0..2 + draw.index(2))
                        .map(|_| {
                            let angle = draw.between(0.0, std::f64::consts::TAU);
                            (angle, draw.between(0.4, 0.8), draw.log_between(0.01, 0.04))
                        })
                        .collect(),
                    numerals: draw.chance(0.6),
                }
            }
            Shape::End => {
                let metal = draw.chance(0.5);
                let line = |draw: &mut Draw| {
                    [(); 2].map(|()| DVec2::new(draw.between(-0.6, 0.6), draw.between(-0.6, 0.6)))
                };
                let lines = if draw.chance(0.5) {
                    3 + draw.index(12)
                } else {
                    0
                };
                Self::End {
                    colour: if metal {
                        [0.9, 0.75, 0.6].map(|v| draw.between(0.5, 1.0) * v)
                    } else {
                        body(draw)
                    },
                    rings: Noise { seed: draw.seed() },
                    count: draw.log_between(3.0, 60.0),
                    contrast: draw.between(0.0, 0.5),
                    lines: (0..lines).map(|_| line(draw)).collect(),
                    metal,
                }
            }
            Shape::Moon => Self::Moon {
                seas: Noise { seed: draw.seed() },
                sun: {
                    let side = draw.direction();
                    DVec3::new(side.x, side.y, draw.between(0.1, 1.0)).normalize()
                },
            },
            Shape::Drawing => Self::Drawing {
                paint: body(draw),
                ink: ink(draw),
                outline: draw.log_between(0.015, 0.08),
                light: DVec2::new(draw.between(-0.5, 0.5), draw.between(-0.5, 0.5)),
                steps: draw.index(5),
                hatched: draw.chance(0.3),
            },
        }
    }

    /// What is behind it whatever the scene: the night about the moon, the paper about a drawing.
    pub(super) fn ground(&self, draw: &mut Draw) -> Option<[f64; 3]> {
        match self {
            Self::Moon { .. } => Some([0.0; 3]),
            Self::Drawing { .. } => Some([draw.between(0.7, 0.95); 3]),
            _ => None,
        }
    }

    /// What it is like at a place of the unit disc, y up.
    pub(super) fn at(&self, x: f64, y: f64) -> DiscAt {
        let p = DVec2::new(x, y);
        let r = p.length();
        let level = |albedo: [f64; 3], mirrored: [f64; 3], inwards: f64| DiscAt {
            albedo,
            mirrored,
            normal: Some((DVec3::Z - (p * (inwards / r.max(1e-6))).extend(0.0)).normalize()),
        };
        let painted = |albedo: [f64; 3]| DiscAt {
            albedo,
            mirrored: [0.0; 3],
            normal: None,
        };
        match self {
            Self::Plate {
                glaze,
                middle,
                slope,
                band,
                gloss,
            } => {
                let rise = smoothstep(*middle - 0.08, *middle, r)
                    * (1.0 - smoothstep(*middle + 0.1, *middle + 0.2, r));
                let lip = -2.0 * smoothstep(0.96, 1.0, r);
                let colour = match band {
                    Some((from, to, colour)) if (*from..*to).contains(&r) => *colour,
                    _ => *glaze,
                };
                level(colour, [*gloss; 3], slope * rise + 0.08 + lip)
            }
            Self::Clock {
                face,
                rim,
                ink,
                hands,
                numerals,
            } => {
                if r > 0.9 {
                    let bevel = 4.0 * (r - 0.95);
                    return level(*rim, [0.05; 3], -bevel);
                }
                let turn = 12.0 * x.atan2(y) / std::f64::consts::TAU;
                let beside = (turn - turn.round()).abs() * r;
                let marks = (0.8..0.87).contains(&r) && beside < 0.05;
                // A numeral is a stroke or two that lean by the hour.
                let numeral = *numerals
                    && (0.6..0.74).contains(&r)
                    && beside < 0.16
                    && (beside * 37.0 + turn.round() + 9.0 * r).sin() > 0.55;
                let hand = hands.iter().any(|(angle, length, width)| {
                    let along = DVec2::new(angle.sin(), angle.cos());
                    let at = p.dot(along);
                    (-0.12..*length).contains(&at) && p.perp_dot(along).abs() < *width
                });
                let dark = marks || numeral || hand || r < 0.03;
                level(if dark { *ink } else { *face }, [0.0; 3], 0.0)
            }
            Self::End {
                colour,
                rings,
                count,
                contrast,
                lines,
                metal,
            } => {
                let wobble = 0.05 * rings.octaves(p.extend(0.0), 2.0, 3, 0.6);
                let ring = rings.at(DVec3::new((r + wobble) * count, 0.5, 0.5));
                let cut = lines.iter().any(|[from, to]| {
                    let along = *to - *from;
                    let t =
                        ((p - *from).dot(along) / along.length_squared().max(1e-9)).clamp(0.0, 1.0);
                    (p - *from - along * t).length() < 0.02
                });
                let bevel = -3.0 * smoothstep(0.95, 1.0, r);
                if *metal {
                    let tilt = 0.1 * contrast * ring + if cut { 0.3 } else { 0.0 } + bevel;
                    return level([0.0; 3], *colour, tilt);
                }
                let dark = (1.0 + contrast * ring) * if cut { 0.5 } else { 1.0 };
                level(colour.map(|v| (v * dark).min(1.0)), [0.0; 3], bevel)
            }
            Self::Moon { seas, sun } => {
                let z = (1.0 - r * r).max(0.0).sqrt();
                let normal = p.extend(z);
                let dark = smoothstep(0.0, 0.5, seas.octaves(normal, 1.5, 5, 0.6));
                // Lommel and Seeliger's law: as bright at the edge as in the middle, where it is lit
                // from behind the camera.
                let lit = normal.dot(*sun).max(0.0);
                let shade = 2.0 * lit / (lit + z).max(1e-6);
                painted([0.12 * (1.0 - 0.5 * dark) * shade; 3])
            }
            Self::Drawing {
                paint,
                ink,
                outline,
                light,
                steps,
                hatched,
            } => {
                if r > 1.0 - outline {
                    return painted(*ink);
                }
                let off = (p - *light).length();
                let shade = if *steps == 0 {
                    1.0
                } else {
                    let n = *steps as f64;
                    1.0 - 0.7 * ((off * n).floor() / (1.5 * n)).min(1.0)
                };
                let line = *hatched && off > 0.7 && (40.0 * (x + y)).sin() > 0.6;
                let highlight = *steps > 2 && off < 0.15;
                let colour = paint.map(|v| v * shade);
                painted(if line {
                    *ink
                } else if highlight {
                    mix(colour, [0.95; 3], 0.8)
                } else {
                    colour
                })
            }
        }
    }
}
