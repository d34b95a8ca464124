//! The outline of a sphere in a picture.

mod edges;
mod ellipse;
mod fit;
mod frame;
mod mask;
mod plain;
mod rays;
mod reduced;
mod round;
mod vote;

use super::circle::Circle;
use super::picture::Picture;
use crate::{Error, Result};
use edges::Edges;
use reduced::Reduced;

pub use ellipse::Elongation;
pub(super) use mask::of_mask;

/// Silhouettes before a plain background are looked for in a picture made smaller until its
/// shorter side is at most so many pixels.
const FINE: usize = 512;

/// Round edges in one made smaller still.
const SMALL: usize = 160;

/// The roundest edge is followed in one of twice that, by at most three times two of its pixels: 4 %
/// of the radius of a sphere that fills the picture.
const MIDDLE: usize = 320;

/// The circle of the sphere in a picture without a mask.
///
/// In linear radiance, where the picture's border is of one value, as renderers leave it, what
/// differs from that value is the sphere, and a circle is fitted to its outline, of which a part
/// may be as dark as the background. Else it is the roundest edge in the picture; with it come the
/// other round things that may be spheres too. In codes the roundest edge comes before silhouettes
/// that are not whole discs: JPEG rings about what stands before a white wall, and shadows fall on
/// it, which differ from it too.
///
/// The roundest edge in a frame whose sides end at its corners is taken for a part of a picture in
/// the picture.
///
/// # Errors
/// A picture that is too small, one in which no circle is to be seen, and one in which the roundest
/// edge lies in a frame.
pub(super) fn find(picture: &Picture) -> Result<(Circle, Vec<Circle>)> {
    let side = picture.width().min(picture.height());
    if side < 16 {
        return Err(Error::TooSmall {
            what: "the shorter side of the picture",
            pixels: side as f64,
            least: 16.0,
            purpose: "to find a sphere in",
        });
    }
    let fine = || Reduced::of(picture, side.div_ceil(FINE));
    if plain::has_a_border_of_one_value(picture) {
        let fine = fine();
        if let Some(circle) = plain::before_one_value(&fine, !picture.is_encoded()) {
            return Ok((circle.times(fine.scale as f64), Vec::new()));
        }
    }
    let small = Reduced::of(picture, side.div_ceil(SMALL));
    let scale = small.scale as f64;
    let edges = Edges::of(&small);
    let middle = Reduced::of(picture, side.div_ceil(MIDDLE));
    match round::find(&small, &middle, &edges) {
        Ok((circle, _)) if frame::is_about(&edges, circle) => Err(Error::NoSphere {
            reason: "what is round lies in a frame, so that this seems to be a photograph of a printed picture",
        }),
        Ok((circle, others)) => Ok((
            circle.times(scale),
            others.into_iter().map(|other| other.times(scale)).collect(),
        )),
        Err(problem) if picture.is_encoded() => plain::before_codes(&fine(), &small)
            .map(|circle| (circle, Vec::new()))
            .ok_or(problem),
        Err(problem) => Err(problem),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value at a place that no one can predict, on [0, 1].
    fn hash(x: u64, y: u64) -> f64 {
        let mut h = x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        h ^= h >> 29;
        h = h.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (h >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A ball of `radiance` at (right, down) in radii, before `behind` at (column, row).
    fn ball(
        width: usize,
        height: usize,
        circle: Circle,
        radiance: impl Fn(f64, f64) -> f64,
        behind: impl Fn(f64, f64) -> f64,
    ) -> Vec<[f64; 3]> {
        (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
                let (u, v) = (
                    (x - circle.x) / circle.radius,
                    (y - circle.y) / circle.radius,
                );
                if u * u + v * v < 1.0 {
                    [radiance(u, v); 3]
                } else {
                    [behind(x, y); 3]
                }
            })
            .collect()
    }

    fn shaded(u: f64, v: f64) -> f64 {
        let z = (1.0 - u * u - v * v).sqrt();
        0.05 + 0.9 * (0.5 * z - 0.6 * v + 0.3 * u).max(0.0)
    }

    /// The last one touches three sides of the picture.
    const PLACES: [(f64, f64, f64); 4] = [
        (150.0, 120.3, 80.0),
        (230.4, 140.0, 45.0),
        (100.0, 100.0, 99.0),
        (120.0, 120.0, 120.0),
    ];

    fn error(found: Circle, truth: Circle) -> f64 {
        (found.x - truth.x)
            .hypot(found.y - truth.y)
            .max((found.radius - truth.radius).abs())
    }

    #[test]
    fn finds_a_ball_before_a_wall() {
        for (x, y, radius) in PLACES {
            let truth = Circle { x, y, radius };
            let wall = |x: f64, y: f64| 0.1 + 0.25 * hash((x / 24.0) as u64, (y / 24.0) as u64);
            let pixels = ball(320, 240, truth, shaded, wall);
            let (found, others) = find(&Picture::linear(320, 240, pixels).unwrap()).unwrap();
            assert_eq!(others, [], "there is one");
            let off = error(found, truth);
            assert!(off < 0.01 * radius, "{found:?} for {truth:?}");
        }
    }

    #[test]
    fn says_that_there_are_several() {
        let wall = |x: f64, y: f64| 0.1 + 0.25 * hash((x / 24.0) as u64, (y / 24.0) as u64);
        let first = Circle {
            x: 80.0,
            y: 120.3,
            radius: 60.0,
        };
        let second = Circle {
            x: 230.0,
            y: 130.0,
            radius: 70.0,
        };
        let behind = |x: f64, y: f64| {
            let (u, v) = (
                (x - second.x) / second.radius,
                (y - second.y) / second.radius,
            );
            if u * u + v * v < 1.0 {
                shaded(u, v)
            } else {
                wall(x, y)
            }
        };
        let pixels = ball(320, 240, first, shaded, behind);
        let (found, others) = find(&Picture::linear(320, 240, pixels).unwrap()).unwrap();
        assert_eq!(others.len(), 1, "{found:?} {others:?}");
        for truth in [first, second] {
            let off = error(found, truth).min(error(others[0], truth));
            assert!(off < 0.02 * truth.radius, "{found:?} {others:?}");
        }
    }

    /// One side of the ball is as dark as the background, to the last code.
    #[test]
    fn finds_a_ball_whose_dark_side_is_the_background() {
        let lit = |u: f64, v: f64| {
            let z = (1.0 - u * u - v * v).sqrt();
            (0.3 * z - 0.6 * v + 0.3 * u).max(0.0)
        };
        for (x, y, radius) in PLACES {
            let truth = Circle { x, y, radius };
            for background in [0.0, 0.5] {
                let radiance = |u: f64, v: f64| background + lit(u, v);
                let pixels = ball(320, 240, truth, radiance, |_, _| background);
                let (found, _) = find(&Picture::linear(320, 240, pixels).unwrap()).unwrap();
                let off = error(found, truth);
                assert!(
                    off < 0.01 * radius,
                    "{found:?} for {truth:?} before {background}"
                );
            }
        }
    }

    /// What it mirrors at its rim is what is behind it, and what it mirrors farther in is dark: there
    /// is no step at the outline, and the steepest place lies within.
    #[test]
    fn finds_a_ball_that_mirrors_at_its_rim_what_is_behind_it() {
        let mirrored = |u: f64, v: f64| 0.6 - 0.5 * ((1.0 - u * u - v * v).sqrt() / 0.35).min(1.0);
        for radius in [24.0, 31.0, 45.0, 70.0] {
            let truth = Circle {
                x: 101.0,
                y: 80.3,
                radius,
            };
            let pixels = ball(200, 160, truth, mirrored, |x, _| 0.6 + 1e-4 * x);
            let (found, _) = find(&Picture::linear(200, 160, pixels).unwrap()).unwrap();
            let off = error(found, truth);
            assert!(off < 0.45, "{found:?} for {truth:?}");
        }
    }

    /// A mirror that fills the picture, in codes, before black: what it mirrors is rounder than its
    /// outline, of which the border hides most.
    #[test]
    fn finds_a_mirror_that_fills_a_rendered_picture() {
        let truth = Circle {
            x: 64.0,
            y: 64.0,
            radius: 64.0,
        };
        let mirrored = |u: f64, v: f64| {
            let ring = (u - 0.02).hypot(v - 0.03);
            if ring < 0.94 { 0.6 - 0.3 * v } else { 0.05 }
        };
        let pixels = ball(128, 128, truth, mirrored, |_, _| 0.0);
        let codes = pixels
            .iter()
            .map(|rgb| rgb.map(crate::files::srgb8_of_linear));
        let bytes: Vec<u8> = codes.flatten().collect();
        let picture = Picture::from_srgb8(128, 128, bytes).unwrap();
        let (found, _) = find(&picture).unwrap();
        assert!(error(found, truth) < 0.01 * 64.0, "{found:?}");
    }

    const IN_A_ROOM: Circle = Circle {
        x: 150.0,
        y: 120.3,
        radius: 52.0,
    };

    /// Whether a ball before this is found, and where it is.
    fn is_found_before(behind: impl Fn(f64, f64) -> f64) -> bool {
        let pixels = ball(320, 240, IN_A_ROOM, shaded, behind);
        let found = find(&Picture::linear(320, 240, pixels).unwrap());
        found.is_ok_and(|(found, _)| error(found, IN_A_ROOM) < 0.01 * IN_A_ROOM.radius)
    }

    /// x and y from a place, turned.
    fn turned(angle: f64, (x, y): (f64, f64)) -> (f64, f64) {
        let (sin, cos) = angle.sin_cos();
        let (x, y) = (x - IN_A_ROOM.x, y - IN_A_ROOM.y);
        (cos * x + sin * y, cos * y - sin * x)
    }

    /// The lines of tiles stand on four sides about a ball too, but go on beyond their corners.
    #[test]
    fn finds_a_ball_before_tiles() {
        for angle in [0.0, 0.11, 0.4] {
            for pitch in [37.0, 61.0, 130.0, 170.0] {
                for bond in [0.0, 0.5] {
                    let wall = |x: f64, y: f64| {
                        let (u, v) = turned(angle, (x, y));
                        let row = (v / pitch + 0.5).floor();
                        let column = u / pitch + 0.5 + bond * row;
                        let off = |place: f64| (place - place.round()).abs() * pitch;
                        let grout = off(column) < 2.0 || off(v / pitch + 0.5) < 2.0;
                        let tile = hash(column.floor().to_bits(), row.to_bits());
                        if grout { 0.08 } else { 0.4 + 0.1 * tile }
                    };
                    assert!(is_found_before(wall), "{angle} {pitch} {bond}");
                }
            }
        }
    }

    #[test]
    fn finds_a_ball_before_a_window_with_bars() {
        for angle in [0.0, 0.07] {
            for (pane, bar) in [((75.0, 60.0), 3.0), ((140.0, 140.0), 5.0)] {
                let window = |x: f64, y: f64| {
                    let (u, v) = turned(angle, (x, y));
                    let off = |place: f64, pitch: f64| {
                        let place = place / pitch + 0.5;
                        (place - place.round()).abs() * pitch
                    };
                    let bars = off(u, pane.0) < bar || off(v, pane.1) < bar;
                    if bars { 0.1 } else { 0.9 - 0.001 * v }
                };
                assert!(is_found_before(window), "{angle} {pane:?}");
            }
        }
    }

    /// The border of a picture is no frame.
    #[test]
    fn finds_a_ball_in_a_picture_that_is_cropped_tightly() {
        for margin in [0.0, 2.0, 6.0, 20.0] {
            let truth = Circle {
                x: 80.0 + margin,
                y: 80.0 + margin,
                radius: 80.0,
            };
            let side = (160.0 + 2.0 * margin) as usize;
            let wall = |x: f64, y: f64| 0.3 + 0.001 * x + 0.05 * hash(x as u64, y as u64);
            let pixels = ball(side, side, truth, shaded, wall);
            let (found, _) = find(&Picture::linear(side, side, pixels).unwrap()).unwrap();
            assert!(error(found, truth) < 0.01 * 80.0, "{found:?} {margin}");
        }
    }

    /// A frame's sides end at its corners; what it holds may be given by hand.
    #[test]
    fn refuses_a_ball_on_a_print() {
        for angle in [-0.3, 0.0, 0.12] {
            for (half, border) in [(60.0, 5.0), (60.0, 14.0), (85.0, 10.0)] {
                let print = |x: f64, y: f64| {
                    let (u, v) = turned(angle, (x, y));
                    let off = u.abs().max(v.abs());
                    if off < half {
                        0.2 + 0.001 * u
                    } else if off < half + border {
                        0.8
                    } else {
                        0.35
                    }
                };
                let pixels = ball(320, 240, IN_A_ROOM, shaded, print);
                let picture = Picture::linear(320, 240, pixels).unwrap();
                let problem = find(&picture).unwrap_err().to_string();
                let said = problem.contains("frame") && problem.contains("--circle");
                assert!(said, "{problem} {angle} {half}");
                assert!(picture.sphere(IN_A_ROOM).is_ok());
            }
        }
    }

    #[test]
    fn finds_no_ball_where_there_is_none() {
        let noise = (0..320 * 240).map(|i| [hash(i, 7); 3]).collect();
        assert!(
            find(&Picture::linear(320, 240, noise).unwrap()).is_err(),
            "noise"
        );
        let flat = vec![[0.5; 3]; 320 * 240];
        assert!(
            find(&Picture::linear(320, 240, flat).unwrap()).is_err(),
            "flat"
        );
        let square = (0..320 * 240)
            .map(|i| {
                [f64::from(u8::from(
                    i % 320 > 100 && i % 320 < 200 && i / 320 > 60 && i / 320 < 160,
                )); 3]
            })
            .collect();
        assert!(
            find(&Picture::linear(320, 240, square).unwrap()).is_err(),
            "a square"
        );
        let small = vec![[0.5; 3]; 15 * 15];
        assert!(
            find(&Picture::linear(15, 15, small).unwrap()).is_err(),
            "small"
        );
    }

    #[test]
    fn a_mask_tells_where_the_sphere_is() {
        let truth = Circle {
            x: 60.5,
            y: 40.25,
            radius: 30.0,
        };
        let mask = ball(120, 90, truth, |_, _| 1.0, |_, _| 0.0);
        let mask: Vec<f32> = mask.iter().map(|rgb| rgb[0] as f32).collect();
        assert!(error(of_mask(&mask, 120).unwrap(), truth) < 0.1);
        let half: Vec<f32> = (0..120 * 90)
            .map(|i| f32::from(u8::from(i % 120 < 60)))
            .collect();
        assert!(of_mask(&half, 120).is_err(), "half the picture is no disc");
        assert!(of_mask(&[0.0; 120 * 90], 120).is_err());
    }

    #[test]
    fn circles_are_read() {
        assert_eq!(
            "3, 4,5".parse(),
            Ok(Circle {
                x: 3.0,
                y: 4.0,
                radius: 5.0
            })
        );
        for text in ["", "3,4", "3,4,0", "3,4,x", "nan,4,5", "3,4,5,6"] {
            assert!(text.parse::<Circle>().is_err(), "{text}");
        }
    }
}
