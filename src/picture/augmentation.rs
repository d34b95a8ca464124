//! What renderers and cameras may make of a sphere, and how it may be read.

use std::f64::consts::FRAC_PI_2;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::circle::Circle;
use super::photograph::{Photograph, normal};
use super::picture::Picture;
use super::sphere::Sphere;
use crate::illumination::Luminance;
use crate::reflection::SphereImage;
use crate::{Error, Result};

/// The background around the sphere, as a share of its radius.
const MARGIN: f64 = 0.15;

/// A circle's centre and its radius are known to this share of the radius.
const JITTER: f64 = 0.01;

/// The sphere of a rendered picture after it has been through any renderer's or camera's hands and
/// back: drawn by `seed`.
///
/// One picture in three stays linear, with noise of a share of 10⁻⁴ … 10^−1.7 in half of them, as
/// paths traced leave it. The others are photographs: mean luminance 0.2 · 2^(±1.5) of what
/// saturates, 2000 … 100 000 electrons and noise of 10^−3.3 … 10⁻² of saturation in seven of ten,
/// JPEG of quality 80 … 98 in six of ten, else 8 bits as they are. The background is black or of
/// the sphere's colour times 0.2 … 2. The circle is off by about 1 % of the radius. A focal length
/// is known in half of the pictures.
///
/// # Errors
/// A black sphere, and one that cannot be read however often it is exposed anew.
pub fn augment(image: &SphereImage, seed: u64) -> Result<Sphere> {
    // What is all but saturated, as few are, cannot be read, and teaches nothing.
    let mut refused = None;
    for attempt in 0..8u64 {
        match one(image, seed ^ (attempt << 56)) {
            Err(
                error @ (Error::Saturated { .. }
                | Error::Black { .. }
                | Error::TooSmall { .. }
                | Error::CircleOutside { .. }),
            ) => refused = Some(error),
            other => return other,
        }
    }
    Err(refused.unwrap_or(Error::Black { what: "the sphere" }))
}

/// One attempt.
fn one(image: &SphereImage, seed: u64) -> Result<Sphere> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mean = image.mean();
    let level = Luminance::Rec709.of(mean);
    if level.is_nan() || level <= 0.0 {
        return Err(Error::Black { what: "the sphere" });
    }
    let size = image.size();
    let radius = 0.5 * size as f64;
    let margin = (MARGIN * radius).ceil() as usize;
    let side = size + 2 * margin;
    let wall = if rng.random::<bool>() {
        let share = 0.2 + 1.8 * rng.random::<f64>();
        mean.map(|value| share * value)
    } else {
        [0.0; 3]
    };
    let mut pixels: Vec<[f64; 3]> = (0..side * side)
        .map(|i| {
            let inside = |at: usize| at.checked_sub(margin);
            let (row, column) = (inside(i / side), inside(i % side));
            let seen = row
                .zip(column)
                .and_then(|(row, column)| image.get(row, column));
            seen.unwrap_or(wall)
        })
        .collect();
    let between = |rng: &mut Pcg64, low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let mut picture = if rng.random::<f64>() < 1.0 / 3.0 {
        if rng.random::<bool>() {
            let noise = 10f64.powf(between(&mut rng, -4.0, -1.7));
            for value in pixels.iter_mut().flatten() {
                *value += noise * normal(&mut rng) * (value.max(0.0) * level).sqrt();
            }
        }
        Picture::linear(side, side, pixels)?
    } else {
        let noisy = rng.random::<f64>() < 0.7;
        let camera = Photograph {
            middle: 0.2,
            spread: 1.5,
            full_well: if noisy {
                10f64.powf(between(&mut rng, 3.3, 5.0))
            } else {
                f64::INFINITY
            },
            read_noise: if noisy {
                10f64.powf(between(&mut rng, -3.3, -2.0))
            } else {
                0.0
            },
            quality: (rng.random::<f64>() < 0.6).then(|| between(&mut rng, 80.0, 99.0) as u8),
        };
        Picture::encoded(side, side, camera.codes(side, &pixels, level, &mut rng)?)?
    };
    if let Some(distance) = image.camera().distance()
        && rng.random::<bool>()
    {
        let half_angle = (1.0 / distance).asin();
        picture = picture.with_focal_length(radius / half_angle.min(FRAC_PI_2).tan())?;
    }
    let middle = 0.5 * side as f64;
    let mut off = || JITTER * radius * normal(&mut rng).clamp(-3.0, 3.0);
    picture.sphere(Circle {
        x: middle + off(),
        y: middle + off(),
        radius: radius + off(),
    })
}
