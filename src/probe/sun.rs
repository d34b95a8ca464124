//! A sun that every exposure clipped, from what it does to a grey ball.

use std::f64::consts::PI;

use glam::DVec3;

use super::{ProbeMap, Radiance};
use crate::illumination::EnvironmentMap;
use crate::picture::Circle;
use crate::reflection::{Camera, RingLight, RingRenderer};
use crate::{Error, Parallelism, Result};

/// The grey ball is rendered with so many pixels a side.
const SIZE: usize = 64;

/// The farthest from the outline's centre that the grey ball is read, in radii.
const RIM: f64 = 0.93;

/// The map with the radiance of what was clipped raised until a matte ball looks as it does in its
/// own photograph, and by how much it was raised, by channel.
///
/// The picture of a matte ball is linear in the light: `ρ (E_rest + a E_sun)/π`, with `E_sun` the
/// irradiance of the clipped pixels as they stand. a is by channel the least squares over the
/// ball's pixels, at least 1. Without an albedo the ball's own ρ is another unknown, the same for
/// all channels.
///
/// # Errors
/// [`Error::Undetermined`] where nothing was clipped, or the grey ball does not see it;
/// [`Error::CircleOutside`] for a circle that leaves the picture; [`Error::Length`] for a picture of
/// another number of pixels than its size says.
pub fn restore_sun(
    map: &ProbeMap,
    picture: &Radiance,
    circle: Circle,
    distance: Option<f64>,
    albedo: Option<f64>,
    parallelism: Parallelism,
) -> Result<(ProbeMap, [f64; 3])> {
    picture.check()?;
    let undetermined = |reason| Error::Undetermined {
        parameter: "the radiance of the sun",
        reason,
    };
    let sun: Vec<[f64; 3]> = map
        .pixels
        .iter()
        .zip(&map.clipped)
        .map(|(pixel, clipped)| pixel.map(|value| value * clipped))
        .collect();
    if sun.iter().all(|pixel| *pixel == [0.0; 3]) {
        return Err(undetermined(
            "no pixel of the mirror ball is saturated in every exposure, so that nothing is missing; leave the grey ball out",
        ));
    }
    let rest: Vec<[f64; 3]> = map
        .pixels
        .iter()
        .zip(&sun)
        .map(|(pixel, sun)| std::array::from_fn(|c| pixel[c] - sun[c]))
        .collect();
    let camera = match distance {
        Some(distance) => Camera::perspective(DVec3::Z, DVec3::Y, distance)?,
        None => Camera::orthographic(DVec3::Z, DVec3::Y)?,
    };
    let matte = |_, lights: &[DVec3], out: &mut [f64]| -> Result<()> {
        for (out, light) in out.iter_mut().zip(lights) {
            *out = light.z.max(0.0) / PI;
        }
        Ok(())
    };
    let renderer = RingRenderer::new(&camera, matte, parallelism)?;
    let render = |name, pixels| -> Result<_> {
        let light = EnvironmentMap::new(name, 2 * map.rows, map.rows, pixels)?;
        renderer.render(&RingLight::of(&light, &camera)?, SIZE)
    };
    let (of_rest, of_sun) = (render("rest", rest)?, render("sun", sun)?);
    let Circle { x, y, radius } = circle;
    let (width, height) = (picture.width as f64, picture.height as f64);
    let leaves = radius - x.min(y).min(width - x).min(height - y);
    if !(leaves <= 0.0 && x.is_finite() && y.is_finite()) {
        return Err(Error::CircleOutside {
            x,
            y,
            radius,
            width: picture.width,
            height: picture.height,
        });
    }
    // Sums of products of (rest, sun, seen) by channel.
    let mut sums = [[[0.0; 3]; 3]; 3];
    for (row, column, rest) in of_rest.iter() {
        let place = |at: usize| (at as f64 + 0.5) * 2.0 / SIZE as f64 - 1.0;
        let (right, down) = (place(column), place(row));
        if right.hypot(down) > RIM {
            continue;
        }
        let Some(sun) = of_sun.get(row, column) else {
            continue;
        };
        let Some(seen) = mean_about(
            picture,
            x + radius * right,
            y + radius * down,
            radius / SIZE as f64,
        ) else {
            continue;
        };
        for c in 0..3 {
            let values = [rest[c], sun[c], seen[c]];
            for i in 0..3 {
                for j in 0..3 {
                    sums[c][i][j] += values[i] * values[j];
                }
            }
        }
    }
    // seen = p rest + q sun; a = q / p, p the albedo.
    let mut solved = [[0.0; 2]; 3];
    for (c, sums) in sums.iter().enumerate() {
        let determinant = sums[0][0] * sums[1][1] - sums[0][1] * sums[1][0];
        if !(determinant > 1e-9 * sums[0][0] * sums[1][1]) {
            return Err(undetermined(
                "the grey ball does not see it, or sees nothing else; turn the balls towards it",
            ));
        }
        solved[c] = [
            (sums[1][1] * sums[0][2] - sums[0][1] * sums[1][2]) / determinant,
            (sums[0][0] * sums[1][2] - sums[0][1] * sums[0][2]) / determinant,
        ];
    }
    let albedo = albedo.unwrap_or_else(|| solved.iter().map(|s| s[0]).sum::<f64>() / 3.0);
    let mut raised = [1.0; 3];
    for c in 0..3 {
        // With the albedo known, the sun alone is fitted.
        let fitted = (sums[c][1][2] - albedo * sums[c][0][1]) / sums[c][1][1];
        raised[c] = (fitted / albedo).max(1.0);
    }
    if !raised.iter().all(|value| value.is_finite()) {
        return Err(undetermined("the grey ball is black; expose it more"));
    }
    let mut restored = map.clone();
    for (pixel, clipped) in restored.pixels.iter_mut().zip(&map.clipped) {
        for c in 0..3 {
            pixel[c] *= 1.0 + clipped * (raised[c] - 1.0);
        }
    }
    Ok((restored, raised))
}

/// The mean of the pixels within a square; none where one is clipped.
fn mean_about(picture: &Radiance, x: f64, y: f64, half: f64) -> Option<[f64; 3]> {
    let range = |middle: f64, length: usize| {
        let low = (middle - half).max(0.0) as usize;
        low..((middle + half).ceil() as usize).clamp(low + 1, length.max(low + 1))
    };
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for row in range(y, picture.height) {
        for column in range(x, picture.width) {
            let at = row * picture.width + column;
            if *picture.clipped.get(at)? {
                return None;
            }
            for c in 0..3 {
                sum[c] += picture.pixels[at][c];
            }
            count += 1.0;
        }
    }
    Some(sum.map(|sum| sum / count))
}
