//! The map of a place, and places whose light nobody measured.

use std::f64::consts::{PI, TAU};

use lobes::Result;
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, Luminance};

use super::draw::{Draw, mix, smoothstep};
use super::noise::Noise;

/// Pixels of the map: finer than what a mirror of 160 pixels shows in its middle.
pub(super) const WIDTH: usize = 512;
pub(super) const HEIGHT: usize = 256;

/// The direction in which a pixel of such a map lies: the centre column looks along −z, with +x to
/// its right.
pub(super) fn direction(row: usize, column: usize) -> DVec3 {
    let theta = PI * (row as f64 + 0.5) / HEIGHT as f64;
    let phi = TAU * ((column as f64 + 0.5) / WIDTH as f64 - 0.5);
    let (st, ct) = theta.sin_cos();
    DVec3::new(st * phi.sin(), ct, -st * phi.cos())
}

/// The light of a place that is not there: one of `environments`, altered, or dead leaves.
pub(super) fn invented(environments: &[EnvironmentMap], draw: &mut Draw) -> Result<EnvironmentMap> {
    if environments.is_empty() || draw.chance(0.45) {
        dead_leaves(draw)
    } else {
        altered(&environments[draw.index(environments.len())], draw)
    }
}

/// A map with its horizon, its shapes, its contrast and its colours changed.
///
/// Directions are stretched along the vertical by a factor of 0.6 … 1.7 and moved by a smooth random
/// field; radiance is raised to a power of 0.7 … 1.4, and its colour taken between grey and somewhat
/// more of itself. One map in eight hangs upside down.
fn altered(map: &EnvironmentMap, draw: &mut Draw) -> Result<EnvironmentMap> {
    let stretch = draw.log_between(0.6, 1.7) * if draw.chance(0.12) { -1.0 } else { 1.0 };
    let (bend, frequency) = (draw.between(0.0, 0.35), draw.log_between(0.8, 2.5));
    let power = draw.log_between(0.7, 1.4);
    let saturation = draw.between(0.0, 1.4);
    let field = Noise { seed: draw.seed() };
    let pixels = directions().map(|d| {
        let moved = |shift: f64| field.octaves(d + DVec3::splat(shift), frequency, 2, 0.5);
        let from = DVec3::new(d.x, stretch * d.y, d.z)
            + bend * DVec3::new(moved(0.0), moved(40.0), moved(80.0));
        let rgb = map.radiance(from.normalize_or(d));
        let luminance = Luminance::Rec709.of(rgb).max(1e-9);
        let coloured = mix([luminance; 3], rgb, saturation);
        coloured.map(|v| v.max(0.0) * luminance.powf(power - 1.0))
    });
    EnvironmentMap::new("altered", WIDTH, HEIGHT, pixels.collect())
}

fn directions() -> impl Iterator<Item = DVec3> {
    (0..WIDTH * HEIGHT).map(|i| direction(i / WIDTH, i % WIDTH))
}

/// A disc or a rectangle of directions.
struct Leaf {
    centre: DVec3,
    across: DVec3,
    up: DVec3,
    /// Halves of its extent, as tangents.
    half: [f64; 2],
    round: bool,
    radiance: [f64; 3],
}

impl Leaf {
    fn draw(size: f64, centre: DVec3, draw: &mut Draw) -> Self {
        let up = (DVec3::Y - centre * centre.y).normalize_or(DVec3::X);
        let tilt = if draw.chance(0.4) {
            draw.between(-PI, PI)
        } else {
            0.0
        };
        let (sin, cos) = tilt.sin_cos();
        let side = centre.cross(up);
        let aspect = draw.log_between(0.4, 2.5).sqrt();
        Self {
            centre,
            across: side * cos + up * sin,
            up: up * cos - side * sin,
            half: [size * aspect, size / aspect],
            round: draw.chance(0.4),
            radiance: [0.0; 3],
        }
    }

    fn covers(&self, d: DVec3) -> bool {
        let depth = d.dot(self.centre);
        let x = d.dot(self.across) / (depth * self.half[0]);
        let y = d.dot(self.up) / (depth * self.half[1]);
        depth > 0.05
            && if self.round {
                x * x + y * y < 1.0
            } else {
                x.abs().max(y.abs()) < 1.0
            }
    }

    /// Lies down on what is there already.
    fn cover(&self, pixels: &mut [[f64; 3]]) {
        let reach = self.half[0].hypot(self.half[1]).atan();
        let angle = self.centre.y.clamp(-1.0, 1.0).acos();
        let (sin, cos) = angle.sin_cos();
        let row = |theta: f64| (theta / PI * HEIGHT as f64).clamp(0.0, HEIGHT as f64) as usize;
        for row in row(angle - reach)..(row(angle + reach) + 1).min(HEIGHT) {
            let theta = PI * (row as f64 + 0.5) / HEIGHT as f64;
            // How far a circle of that radius reaches along the row.
            let cosine = (reach.cos() - theta.cos() * cos) / (theta.sin() * sin).max(1e-9);
            if cosine >= 1.0 {
                continue;
            }
            let wide = cosine.max(-1.0).acos() / TAU * WIDTH as f64;
            let middle = (self.centre.x.atan2(-self.centre.z) / TAU + 0.5) * WIDTH as f64;
            let columns = (middle - wide).floor() as i64..=(middle + wide).ceil() as i64;
            for column in columns.take(WIDTH) {
                let column = column.rem_euclid(WIDTH as i64) as usize;
                if self.covers(direction(row, column)) {
                    pixels[row * WIDTH + column] = self.radiance;
                }
            }
        }
    }
}

/// Of sizes between two that are distributed as 1/r³, the one below which a share of them lies.
fn size([smallest, largest]: [f64; 2], share: f64) -> f64 {
    let (near, far) = (smallest.powi(-2), largest.powi(-2));
    (near + (far - near) * share).powf(-0.5)
}

/// Leaves that have fallen on each other: discs and rectangles whose sizes are distributed as
/// 1/r³, each of a random radiance.
///
/// Such a picture looks alike at any scale, and its power falls as 1/l², as that of natural light
/// does (Lee, Mumford and Huang 2001, doi:10.1023/A:1011109015675). Half of such places have a sky,
/// which holds few leaves and large ones; small bright ones, which lie on top, are lamps.
fn dead_leaves(draw: &mut Draw) -> Result<EnvironmentMap> {
    let spread = draw.between(0.3, 1.5);
    let rise = draw.between(-0.3, 1.2);
    let saturation = draw.unit().powi(2);
    let sky = draw.chance(0.5).then(|| draw.between(-0.2, 0.5));
    let brighter = draw.log_between(1.0, 12.0);
    let (smallest, largest) = (draw.log_between(0.012, 0.08), draw.between(0.3, 1.0));
    let count = (draw.log_between(0.15, 1.5) / (smallest * smallest)) as usize;
    let colour = |centre: DVec3, draw: &mut Draw| {
        let value = (spread * draw.normal() + rise * centre.y).exp();
        let saturation = saturation * draw.unit();
        draw.colour(saturation, value)
    };
    let zenith = colour(DVec3::Y, draw);
    let nadir = colour(DVec3::NEG_Y, draw);
    let mut pixels: Vec<[f64; 3]> = directions()
        .map(|d| {
            let above = sky.is_some_and(|horizon| d.y > horizon);
            let base = mix(nadir, zenith, smoothstep(-0.3, 0.9, d.y));
            base.map(|v| if above { v * brighter } else { v })
        })
        .collect();
    let mut sizes: Vec<f64> = (0..count)
        .map(|_| size([smallest, largest], draw.unit()))
        .collect();
    // Without order every scale hides every other; in half of the places small things lie on top.
    if draw.chance(0.5) {
        sizes.sort_by(|a, b| b.total_cmp(a));
    }
    for size in sizes {
        let centre = draw.direction();
        let in_sky = sky.is_some_and(|horizon| centre.y > horizon);
        if in_sky && (size < 0.12 || draw.chance(0.6)) {
            continue;
        }
        let mut leaf = Leaf::draw(size, centre, draw);
        leaf.radiance = colour(centre, draw).map(|v| if in_sky { v * brighter } else { v });
        leaf.cover(&mut pixels);
    }
    let lamps = if draw.chance(0.6) {
        1 + draw.index(6)
    } else {
        0
    };
    for _ in 0..lamps {
        let centre = draw.direction();
        let centre = if centre.y < 0.0 && draw.chance(0.7) {
            -centre
        } else {
            centre
        };
        let size = draw.log_between(0.015, 0.25);
        let mut leaf = Leaf::draw(size, centre, draw);
        let power = (draw.log_between(0.1, 1.5) / (size * size)).clamp(1.5, 600.0);
        let saturation = 0.3 * draw.unit();
        leaf.radiance = draw.colour(saturation, power);
        leaf.cover(&mut pixels);
    }
    // What leaves show is not even.
    let (uneven, frequency) = (draw.between(0.0, 0.5), draw.log_between(1.0, 8.0));
    let noise = Noise { seed: draw.seed() };
    for (rgb, d) in pixels.iter_mut().zip(directions()) {
        let factor = (uneven * noise.octaves(d, frequency, 4, 0.7)).exp();
        *rgb = rgb.map(|v| v * factor);
    }
    EnvironmentMap::new("dead leaves", WIDTH, HEIGHT, pixels)
}

#[cfg(test)]
mod tests {
    use lobes::Parallelism;
    use lobes::illumination::{LightSpectrum, builtin};
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::*;

    /// What is painted is what is covered, at the poles and across the seam too.
    #[test]
    fn a_leaf_covers_what_it_covers() {
        let mut draw = Draw(Pcg64::seed_from_u64(4));
        let poles = [
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::new(0.01, 0.9999, 0.0),
        ];
        for i in 0..60 {
            let centre = poles
                .get(i)
                .map_or_else(|| draw.direction(), |d| d.normalize());
            let size = draw.log_between(0.01, 1.2);
            let mut leaf = Leaf::draw(size, centre, &mut draw);
            leaf.radiance = [1.0; 3];
            let mut pixels = vec![[0.0; 3]; WIDTH * HEIGHT];
            leaf.cover(&mut pixels);
            for (pixel, d) in pixels.iter().zip(directions()) {
                assert_eq!(pixel[0] == 1.0, leaf.covers(d), "{centre}, {size}, {d}");
            }
        }
    }

    /// The power of natural light falls as 1/l^(2 + η), η about 0; that of leaves does too.
    #[test]
    fn the_power_of_dead_leaves_falls_as_that_of_natural_light() {
        let mut draw = Draw(Pcg64::seed_from_u64(5));
        let eta = |map: &EnvironmentMap| {
            let spectrum = LightSpectrum::of(map, 64, Parallelism::Rayon).unwrap();
            spectrum.law.eta
        };
        let leaves: Vec<f64> = (0..16)
            .map(|_| eta(&dead_leaves(&mut draw).unwrap()))
            .collect();
        let measured: Vec<f64> = builtin().unwrap().iter().map(eta).collect();
        let ends = |etas: &[f64]| {
            let mut sorted = etas.to_vec();
            sorted.sort_by(f64::total_cmp);
            (
                sorted[0],
                sorted[sorted.len() / 2],
                sorted[sorted.len() - 1],
            )
        };
        let (least, middle, most) = ends(&leaves);
        let (low, centre, high) = ends(&measured);
        assert!((middle - centre).abs() < 0.4, "{middle}, {centre}");
        assert!(least > low - 0.4 && most < high + 0.4, "{least} … {most}");
    }

    /// ∫ r⁻³ dr from the smallest size to what is given for a share is that share of the whole, by
    /// midpoints.
    #[test]
    fn sizes_are_distributed_as_their_inverse_cubes() {
        let (low, high) = (0.02, 0.7);
        let integral = |to: f64| {
            let step = (to - low) / 1e5;
            let middles = (0..100_000).map(|i| low + step * (f64::from(i) + 0.5));
            middles.map(|r| step * r.powi(-3)).sum::<f64>()
        };
        for share in [0.1, 0.5, 0.9, 0.999, 1.0] {
            let part = integral(size([low, high], share)) / integral(high);
            assert!((part - share).abs() < 1e-5, "{share}: {part}");
        }
    }

    /// A pixel lies where a map of that size has it.
    #[test]
    fn directions_are_those_of_a_map() {
        let pixels = vec![[1.0; 3]; WIDTH * HEIGHT];
        let map = EnvironmentMap::new("even", WIDTH, HEIGHT, pixels).unwrap();
        for (row, column) in [(0, 0), (3, 500), (128, 256), (200, 77), (255, 511)] {
            let off = direction(row, column) - map.direction(row, column);
            assert!(off.length() < 1e-14, "{row}, {column}: {off}");
        }
    }

    /// An altered map is nowhere negative and not black.
    #[test]
    fn an_altered_map_is_light() {
        let maps = builtin().unwrap();
        let mut draw = Draw(Pcg64::seed_from_u64(6));
        for map in &maps[..6] {
            let other = altered(map, &mut draw).unwrap();
            assert!(
                other
                    .pixels()
                    .iter()
                    .flatten()
                    .all(|v| *v >= 0.0 && v.is_finite())
            );
            assert!(Luminance::Rec709.of(other.mean()) > 0.0);
        }
    }
}
