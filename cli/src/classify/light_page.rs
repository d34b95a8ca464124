//! The part of a page that shows the light about a ball, and the ball in it again.

use super::words::LEVEL;
use crate::ball_light::{HEIGHT, LightMaps};
use crate::error::Result;
use crate::report::{Figure, Image, Page, difference};
use lobes::illumination::Luminance;
use lobes::inference::FinishVerdict;
use lobes::picture::{Sphere, encode_png};
use lobes::reflectance::Finish;

/// What is left over is in full colour at this share of the ball's mean luminance.
const FULL: f64 = 0.1;

/// The ball as this light makes it, and what is left over; the ball itself is shown at `exposure`.
pub(super) fn ball_again(light: &LightMaps, exposure: f64) -> Result<[Figure; 2]> {
    let size = Sphere::SIZE;
    let at = |row: usize, column: usize| {
        let place = |index: usize| (2 * index + 1) as f64 / size as f64 - 1.0;
        light.picture.at(place(column), -place(row))
    };
    let again = encode_png(size, size, exposure, |row, column| Some(at(row, column)?.1))?;
    // The exposure puts the mean luminance at a quarter.
    let full = FULL * 0.25 / exposure;
    let left = encode_png(size, size, 1.0, |row, column| {
        let (seen, expected) = at(row, column)?;
        let off = Luminance::Rec709.of(seen) - Luminance::Rec709.of(expected);
        Some(difference(off / full))
    })?;
    let figure = |png: &[u8], seen: &str, caption: &[String]| Figure {
        images: vec![Image::inside(png, seen.into(), (size, size))],
        caption: caption.to_vec(),
    };
    Ok([
        figure(
            &again,
            "The ball again, rendered from the light that was read",
            &[
                "The ball again".into(),
                "from the light and the reflectances that were read".into(),
            ],
        ),
        figure(
            &left,
            "What the ball shows beyond that, in red, and what it lacks, in blue",
            &[
                format!("Left over: {:.2} % rms", 100.0 * light.picture.residual()),
                format!(
                    "the ball less the ball again; red where the ball is brighter, blue where it is darker, full colour at {:.0} % of its mean luminance",
                    100.0 * FULL
                ),
            ],
        ),
    ])
}

/// The light, its deviation, and what was read of the ball.
pub(super) fn show(page: &mut Page, light: &LightMaps, finish: &FinishVerdict) -> Result<()> {
    page.subheading("The light about it");
    page.paragraph(
        "The light as a map of all directions: up is up, and the middle is where the camera looks. It is averaged over what the ball may be made of, which is in the deviation \
         too; behind the ball, in the middle, nothing is seen and the mean returns to 0. A ball again that is like the ball says that some light explains the picture, and \
         not that the light is right: for nearly every reflectance there is one that does.",
    );
    let of_sphere = |row: usize| (std::f64::consts::PI * (row as f64 + 0.5) / HEIGHT as f64).sin();
    let (mut sum, mut area) = (0.0, 0.0);
    for (place, rgb) in light.mean.iter().enumerate() {
        let weight = of_sphere(place / (2 * HEIGHT));
        sum += weight * Luminance::Rec709.of(*rgb);
        area += weight;
    }
    // The mean at a middle grey; of light that is black nothing is to be seen.
    let exposure = 0.25 * area / sum.max(f64::MIN_POSITIVE);
    let map = |values: &[[f64; 3]], seen: &str, caption: &str| -> Result<Figure> {
        let (width, height) = (2 * HEIGHT, HEIGHT);
        let png = encode_png(width, height, exposure, |row, column| {
            Some(values[row * width + column])
        })?;
        Ok(Figure {
            images: vec![Image::inside(&png, seen.into(), (width, height))],
            caption: vec![caption.into()],
        })
    };
    let maps = [
        map(
            &light.mean,
            "The light that was read, as a map",
            "The light",
        )?,
        map(
            &light.deviation,
            "The standard deviation of the light, as a map",
            "Its standard deviation, at the same exposure",
        )?,
    ];
    page.grid(380, &maps);
    let row = |what: &str, [low, middle, high]: [f64; 3], decimals: usize| {
        let cells = [middle, low, high].map(|value| format!("{value:.decimals$}"));
        ("", [&[what.to_owned()], &cells[..]].concat())
    };
    let mut rows = Vec::new();
    if finish.likeliest_finish() != Finish::Matte {
        rows.push(match finish.sigma.below() {
            Some(end) => (
                "",
                ["σ", &format!("below {end}"), "", ""]
                    .map(str::to_owned)
                    .to_vec(),
            ),
            None => row("σ", finish.sigma.interval(LEVEL), 3),
        });
        rows.push(row("specular share", finish.share.interval(LEVEL), 2));
    }
    let (middle, ends) = (finish.base_colour(), finish.base_colour_interval());
    for (channel, name) in ["red", "green", "blue"].into_iter().enumerate() {
        let [low, high] = ends[channel];
        let name = format!("base colour, {name}");
        rows.push(row(&name, [low, middle[channel], high], 2));
    }
    let headings = ["of the ball", "median#", "90 % from#", "to#"];
    page.table("What the light is averaged over", &headings, &rows);
    Ok(())
}
