//! The reflection integral by adaptive quadrature: slow, and independent of the renderer.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::illumination::EnvironmentMap;
use crate::reflectance::{Material, Variant, Ward};
use crate::sphere::Frame;
use crate::{Error, Result};

/// A radiance and how wrong it may be.
///
/// ```
/// use lobes::{glam::DVec3, illumination::EnvironmentMap, reflectance::{Material, Variant}, reflection};
/// let map = EnvironmentMap::new("grey", 8, 4, vec![[2.0; 3]; 32])?;
/// let brown = Material::plastic("brown", [0.2, 0.1, 0.1], 0.0, 0.0)?;
/// let seen = reflection::reference(&map, &brown, Variant::Duer, DVec3::Y, DVec3::Y, 1e-8)?;
/// assert!((seen.value[0] - 0.4).abs() < 1e-8 && seen.error < 1e-8);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// The radiance of each channel.
    pub value: [f64; 3],
    /// The estimated error of the worst channel, absolute.
    pub error: f64,
}

/// The radiance that a surface of a material sends towards `view`, to a `tolerance` relative to the
/// mean of the channels.
///
/// The integral of [`EnvironmentMap::radiance`] against the lobe, one angle inside the other. Each
/// is cut at the centres of the map's pixels, where that function has its kinks, at the surface's
/// horizon, where the lobe ends, and at the plane of incidence, along which a narrow lobe lies; the
/// pieces are halved until Kronrod's seven points agree with Gauss's three. What is cut off of the
/// lobe is below 10⁻¹⁷ of its peak.
///
/// It takes from milliseconds (narrow lobes) to seconds (wide ones): it is there to test what is
/// fast.
///
/// # Errors
/// [`Error::Domain`] if the tolerance is not in [10⁻¹², 0.1], or a direction is not of unit length;
/// [`Error::Tolerance`] if the halving comes to its end first.
///
/// ```
/// use lobes::{glam::DVec3, illumination::EnvironmentMap, reflectance::{Material, Variant}, reflection};
/// let map = EnvironmentMap::new("grey", 8, 4, vec![[2.0; 3]; 32])?;
/// let seen = reflection::reference(&map, &Material::white(), Variant::Duer, DVec3::X, DVec3::X, 1e-8)?;
/// assert!((seen.value[0] - 2.0).abs() < 1e-7);
/// # Ok::<(), lobes::Error>(())
/// ```
pub fn reference(
    map: &EnvironmentMap,
    material: &Material,
    variant: Variant,
    normal: DVec3,
    view: DVec3,
    tolerance: f64,
) -> Result<Reference> {
    if !(1e-12..=0.1).contains(&tolerance) {
        return Err(Error::Domain {
            what: "the tolerance of a reference",
            value: tolerance,
            allowed: "from 1e-12 to 0.1",
        });
    }
    for direction in [normal, view] {
        super::renderer::check_unit(direction)?;
    }
    let cosine = normal.dot(view);
    let mut total = Reference {
        value: [0.0; 3],
        error: 0.0,
    };
    if cosine <= 0.0 {
        return Ok(total);
    }
    let mut add = |albedo: [f64; 3], part: Reference| {
        for ((sum, albedo), value) in total.value.iter_mut().zip(albedo).zip(part.value) {
            *sum += albedo * value;
        }
        total.error += part.error * albedo.into_iter().fold(0.0, f64::max);
    };
    if material.diffuse() != [0.0; 3] {
        let kernel = |light: DVec3| normal.dot(light).max(0.0) / PI;
        let part = Integral::new(map, normal, normal, PI, normal, &kernel).solve(tolerance)?;
        add(material.diffuse(), part);
    }
    if !material.is_matte() {
        let mirror = 2.0 * cosine * normal - view;
        let part = match material.lobe(variant) {
            None => Reference {
                value: map.radiance(mirror),
                error: 0.0,
            },
            Some(lobe) => {
                let kernel = kernel(&lobe, normal, view)?;
                // exp(−40) is below 10⁻¹⁷; a half vector at δ turns the light by at most 2δ.
                let reach = 2.0 * (lobe.sigma()[0] * 40f64.sqrt()).atan();
                Integral::new(map, normal, mirror, reach, normal.cross(view), &kernel)
                    .solve(tolerance)?
            }
        };
        add(material.specular(), part);
    }
    Ok(total)
}

/// f·c_i as a function of the light in the world.
fn kernel(lobe: &Ward, normal: DVec3, view: DVec3) -> Result<Box<dyn Fn(DVec3) -> f64>> {
    let frame = Frame::about(normal);
    let local = frame.to_local(view);
    if lobe.variant() != Variant::RadianceSampled {
        let lobe = lobe.clone();
        return Ok(Box::new(move |light| {
            lobe.evaluate(local, frame.to_local(light))
        }));
    }
    // E/((h·v) cos³δ) over the share above the horizon, which `evaluate` would work out for every
    // light: E is what the lobe E/c_v leaves when multiplied by c_v.
    let gaussian = Ward::isotropic(Variant::Duer, lobe.sigma()[0])?;
    let share = lobe.share_above_horizon(local.z);
    Ok(Box::new(move |light| {
        let light = frame.to_local(light);
        let half = local + light;
        let length = half.length();
        let cos = half.z / length;
        gaussian.evaluate(local, light) * local.z / (0.5 * length * cos.powi(3)) / share
    }))
}

/// An iterated integral over θ (outside) and the azimuth ψ (inside), in the map's angles.
struct Integral<'a> {
    map: &'a EnvironmentMap,
    kernel: &'a dyn Fn(DVec3) -> f64,
    /// The pole of the cap outside of which the kernel counts as 0, and its radius.
    cap: Angles,
    radius: f64,
    horizon: Angles,
    /// The pole of a great circle along which the kernel lies.
    ridge: Angles,
}

/// A direction as the cosine and the sine of its angle from the zenith, and its azimuth from −z
/// towards +x.
struct Angles {
    cos: f64,
    sin: f64,
    azimuth: f64,
}

impl Angles {
    fn of(direction: DVec3) -> Self {
        Self {
            cos: direction.y,
            sin: direction.x.hypot(direction.z),
            azimuth: direction.x.atan2(-direction.z),
        }
    }

    /// The half-width in azimuth of the directions at θ whose scalar product with this one is above
    /// `height`: none if no direction is.
    fn half_width(&self, sin: f64, cos: f64, height: f64) -> Option<f64> {
        let (room, rest) = (sin * self.sin, height - cos * self.cos);
        if rest >= room {
            None
        } else if rest <= -room {
            Some(PI)
        } else {
            Some((rest / room).acos())
        }
    }
}

impl<'a> Integral<'a> {
    fn new(
        map: &'a EnvironmentMap,
        normal: DVec3,
        centre: DVec3,
        radius: f64,
        ridge: DVec3,
        kernel: &'a dyn Fn(DVec3) -> f64,
    ) -> Self {
        Self {
            map,
            kernel,
            cap: Angles::of(centre),
            radius: radius.min(PI),
            horizon: Angles::of(normal),
            ridge: Angles::of(ridge),
        }
    }

    fn solve(&self, tolerance: f64) -> Result<Reference> {
        let height = self.map.height();
        let theta = self.cap.sin.atan2(self.cap.cos);
        let (start, end) = (
            (theta - self.radius).max(0.0),
            (theta + self.radius).min(PI),
        );
        // The rows of pixels; the middle of the lobe; where the horizon only touches a circle of
        // latitude.
        let touch = self.horizon.cos.abs().atan2(self.horizon.sin);
        let mut edges: Vec<f64> = (0..height)
            .map(|row| PI * (row as f64 + 0.5) / height as f64)
            .chain([theta, touch, PI - touch])
            .filter(|&edge| edge > start && edge < end)
            .collect();
        edges.extend([start, end]);
        edges.sort_by(f64::total_cmp);
        let pieces = |allowed: f64| {
            // Half of the error for each of the two angles, in proportion to the length.
            let density = 0.5 * allowed / (end - start);
            let mut sum = Sum::default();
            for pair in edges.windows(2) {
                if pair[1] > pair[0] {
                    sum.add(&adaptive(pair[0], pair[1], density, &|theta| {
                        self.inside(theta, density)
                    }));
                }
            }
            sum
        };
        let mean = |sum: &Sum| sum.value.iter().sum::<f64>() / 3.0;
        // Without halving first, to know what the tolerance is relative to; most often that is all.
        let mut sum = pieces(f64::INFINITY);
        let rough = mean(&sum);
        if sum.error > tolerance * rough {
            sum = pieces(tolerance * rough);
        }
        let error = sum.error;
        if error > tolerance * mean(&sum) * 1.5 {
            return Err(Error::Tolerance {
                what: "the reference of a reflected radiance",
                asked: tolerance,
                reached: error / mean(&sum),
            });
        }
        Ok(Reference {
            value: sum.value,
            error,
        })
    }

    /// The integral round the circle at θ, times sin θ.
    fn inside(&self, theta: f64, allowed: f64) -> Sum {
        let (sin, cos) = theta.sin_cos();
        let mut total = Sum::default();
        let Some(cap) = self.cap.half_width(sin, cos, self.radius.cos()) else {
            return total;
        };
        let Some(above) = self.horizon.half_width(sin, cos, 0.0) else {
            return total;
        };
        let (start, end) = (self.cap.azimuth - cap, self.cap.azimuth + cap);
        let step = TAU / self.map.width() as f64;
        let first = (start / step - 0.5).ceil() as i64;
        let mut edges: Vec<f64> = (first..)
            .map(|column| (column as f64 + 0.5) * step)
            .take_while(|&edge| edge < end)
            .collect();
        edges.extend([start, end]);
        let mut cut = |azimuth: f64| {
            let azimuth = start + (azimuth - start).rem_euclid(TAU);
            if azimuth < end {
                edges.push(azimuth);
            }
        };
        if above < PI {
            cut(self.horizon.azimuth - above);
            cut(self.horizon.azimuth + above);
        }
        cut(self.cap.azimuth);
        if let Some(ridge) = self.ridge.half_width(sin, cos, 0.0) {
            cut(self.ridge.azimuth - ridge);
            cut(self.ridge.azimuth + ridge);
        }
        edges.sort_by(f64::total_cmp);
        let density = allowed / (end - start);
        let row = MapRow::at(self.map, theta);
        for pair in edges.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let (origin, left, right) = row.between(middle);
            let apart = (middle - self.horizon.azimuth + PI).rem_euclid(TAU) - PI;
            if pair[1] > pair[0] && apart.abs() < above {
                total.add(&adaptive(pair[0], pair[1], density, &|azimuth| {
                    let light = DVec3::new(sin * azimuth.sin(), cos, -sin * azimuth.cos());
                    let weight = sin * (self.kernel)(light);
                    let value = if weight == 0.0 {
                        [0.0; 3]
                    } else {
                        let fraction = (azimuth - origin) / step;
                        std::array::from_fn(|channel| {
                            weight * (left[channel] + fraction * (right[channel] - left[channel]))
                        })
                    };
                    Sum { value, error: 0.0 }
                }));
            }
        }
        total
    }
}

/// A map along a circle of latitude: [`EnvironmentMap::radiance`] without its search for the pixels
/// about a direction, which would be most of the time.
struct MapRow<'a> {
    map: &'a EnvironmentMap,
    /// The rows on either side, and by how many columns they are turned.
    above: (usize, usize),
    below: (usize, usize),
    fraction: f64,
}

impl<'a> MapRow<'a> {
    fn at(map: &'a EnvironmentMap, theta: f64) -> Self {
        let (height, half_turn) = (map.height(), map.width() / 2);
        let place = theta * height as f64 / PI - 0.5;
        // Beyond a pole, the same row half a turn round.
        let fold = |row: f64| {
            if row < 0.0 {
                (0, half_turn)
            } else if row >= height as f64 {
                (height - 1, half_turn)
            } else {
                (row as usize, 0)
            }
        };
        Self {
            map,
            above: fold(place.floor()),
            below: fold(place.floor() + 1.0),
            fraction: place - place.floor(),
        }
    }

    /// The centre of the pixel to the left of an azimuth, and what the circle sees there and one
    /// pixel on.
    fn between(&self, azimuth: f64) -> (f64, [f64; 3], [f64; 3]) {
        let width = self.map.width();
        let step = TAU / width as f64;
        let left = (azimuth / step - 0.5).floor();
        // Azimuth 0 is the centre column.
        let column = (left + (width / 2) as f64).rem_euclid(width as f64) as usize % width;
        let value = |column: usize| {
            let above = self
                .map
                .pixel(self.above.0, (column + self.above.1) % width);
            let below = self
                .map
                .pixel(self.below.0, (column + self.below.1) % width);
            std::array::from_fn(|channel| {
                above[channel] + self.fraction * (below[channel] - above[channel])
            })
        };
        ((left + 0.5) * step, value(column), value(column + 1))
    }
}

/// An integral, or a value, of each channel and the error of the worst.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    value: [f64; 3],
    error: f64,
}

impl Sum {
    fn add(&mut self, other: &Self) {
        for (sum, value) in self.value.iter_mut().zip(other.value) {
            *sum += value;
        }
        self.error += other.error;
    }
}

/// Kronrod's seven points on [0, 1] of [−1, 1], their weights, and Gauss's on every second one.
const POINTS: [(f64, f64, f64); 4] = [
    (0.0, 0.450_916_538_658_474_15, 8.0 / 9.0),
    (0.434_243_749_346_802_6, 0.401_397_414_775_962_2, 0.0),
    (0.774_596_669_241_483_4, 0.268_488_089_868_333_43, 5.0 / 9.0),
    (0.960_491_268_708_020_3, 0.104_656_226_026_467_27, 0.0),
];

/// The integral of `f` with an error of at most `density` × length, by halving (at most 40 times);
/// and the error left, with that of `f` itself.
fn adaptive(start: f64, end: f64, density: f64, f: &dyn Fn(f64) -> Sum) -> Sum {
    let mut total = Sum::default();
    let mut waiting = vec![(start, end, 0)];
    while let Some((start, end, depth)) = waiting.pop() {
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        let mut fine = Sum::default();
        let mut coarse = [0.0; 3];
        let mut spread = [0.0; 3];
        let mut values = [Sum::default(); 7];
        let mut found = 0;
        for (x, weight, gauss) in POINTS {
            for &x in &[-x, x][..if x == 0.0 { 1 } else { 2 }] {
                let sum = f(middle + half * x);
                for (channel, value) in sum.value.into_iter().enumerate() {
                    fine.value[channel] += half * weight * value;
                    coarse[channel] += half * gauss * value;
                }
                fine.error += half * weight * sum.error;
                values[found] = sum;
                found += 1;
            }
        }
        let mut at = 0;
        for (x, weight, _) in POINTS {
            for _ in 0..if x == 0.0 { 1 } else { 2 } {
                for (channel, spread) in spread.iter_mut().enumerate() {
                    let mean = fine.value[channel] / (2.0 * half);
                    *spread += half * weight * (values[at].value[channel] - mean).abs();
                }
                at += 1;
            }
        }
        // QUADPACK's estimate: the difference says how wrong Gauss is, and Kronrod is far better.
        let error = (0..3)
            .map(|channel| {
                let difference = (fine.value[channel] - coarse[channel]).abs();
                if spread[channel] == 0.0 {
                    difference
                } else {
                    spread[channel] * (200.0 * difference / spread[channel]).powf(1.5).min(1.0)
                }
            })
            .fold(0.0, f64::max);
        if error <= 2.0 * half * density || depth == 40 {
            fine.error += error;
            total.add(&fine);
        } else {
            waiting.push((middle, end, depth + 1));
            waiting.push((start, middle, depth + 1));
        }
    }
    total
}
