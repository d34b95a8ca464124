//! `lobes probe`: the light about a mirror ball, from photographs of it.

use std::path::{Path, PathBuf};

use serde_json::json;

use crate::arguments::Probe;
use crate::error::{Error, Result};
use crate::{console, input, output};
use lobes::Parallelism;
use lobes::files::{self, Precision, encode_exr_with_alpha};
use lobes::picture::{Circle, Picture};
use lobes::probe::{
    Bracket, MirrorBall, ProbeMap, Radiance, exposure_of, merge, refine, restore_sun,
};

/// One side of a ball: its photographs as one picture, and what the map was made from.
struct Side {
    radiance: Radiance,
    ball: MirrorBall,
    map: ProbeMap,
    /// Whether every exposure was told, so that two sides are in one unit.
    told: bool,
}

/// Photographs read, with the exposures that their EXIF or the command line tells.
fn bracket(paths: &[PathBuf], exposures: &[f64]) -> Result<(Bracket, bool)> {
    if !exposures.is_empty() && exposures.len() != paths.len() {
        return Err(Error::request(
            format!(
                "{} exposures are given for {} photographs",
                exposures.len(),
                paths.len()
            ),
            "give --exposures one for each",
        ));
    }
    let (mut pictures, mut names, mut told) = (Vec::new(), Vec::new(), Vec::new());
    for (i, path) in paths.iter().enumerate() {
        let bytes = std::fs::read(path).map_err(|error| {
            Error::file(
                path,
                format!("cannot be read ({error})"),
                "name a photograph",
            )
        })?;
        let picture = Picture::from_bytes(&bytes);
        pictures.push(picture.map_err(|error| input::error_of(path, error.into()))?);
        names.push(input::name(path));
        told.push(exposures.get(i).copied().or_else(|| exposure_of(&bytes)));
    }
    let all = told.iter().all(Option::is_some);
    Ok((Bracket::new(pictures, names, told)?, all))
}

fn side(
    options: &Probe,
    paths: &[PathBuf],
    circle: Option<Circle>,
    exposures: &[f64],
    hidden: Option<&[bool]>,
) -> Result<Side> {
    let (bracket, told) = bracket(paths, exposures)?;
    let of_first = |error: lobes::Error| input::error_of(&paths[0], error.into());
    let rough = match circle {
        Some(circle) => circle,
        None => bracket.middle().circle().map_err(of_first)?,
    };
    let radiance = bracket.merge(Some(rough))?;
    let circle = match circle {
        Some(circle) => circle,
        None => refine(&radiance, rough),
    };
    let focal = bracket.middle().focal_length();
    // The outline is seen under the angle whose tangent is r/f.
    let distance = options
        .distance
        .or_else(|| focal.map(|focal| focal.hypot(circle.radius) / circle.radius));
    let ball = MirrorBall {
        circle,
        distance,
        reflectance: options.reflectance.0,
        photographer: options.photographer.to_radians(),
    };
    let rows = options
        .rows
        .unwrap_or_else(|| 2 * (circle.radius / 2.0).round().clamp(8.0, 1024.0) as usize);
    let map = ball
        .unwrap(&radiance, hidden, rows, Parallelism::Rayon)
        .map_err(of_first)?;
    Ok(Side {
        radiance,
        ball,
        map,
        told,
    })
}

/// The pixels that a mask leaves out: those brighter than half.
fn mask(path: &Path) -> Result<Vec<bool>> {
    let picture = Picture::read(path)?;
    Ok(picture.radiance().map(|rgb| rgb[1] > 0.5 * 0.214).collect())
}

pub(super) fn run(options: &Probe) -> Result<()> {
    let hidden = options.mask.as_deref().map(mask).transpose()?;
    let first = side(
        options,
        &options.photos,
        options.circle,
        &options.exposures.0,
        hidden.as_deref(),
    )?;
    let mut map = first.map.clone();
    if !options.other.is_empty() {
        let mut at_same_rows = options.clone();
        at_same_rows.rows = Some(map.rows);
        let second = side(
            &at_same_rows,
            &options.other,
            options.other_circle,
            &[],
            None,
        )?;
        let turn = options.turn.unwrap_or_default().to_radians();
        // Where the cameras tell, both are in one unit but for the factor that each bracket is up
        // to; what both sides show tells it as well.
        map = merge(&map, &second.map, turn, false)?;
    }
    let mut raised = None;
    if options.grey.is_some() || !options.grey_photo.is_empty() {
        let (picture, circle, albedo) = if options.grey_photo.is_empty() {
            let circle = options.grey.ok_or_else(|| {
                Error::request("no grey ball is given", "say where it is with --grey x,y,r")
            })?;
            (first.radiance.clone(), circle, options.albedo)
        } else {
            let (bracket, _) = bracket(&options.grey_photo, &[])?;
            let circle = match options.grey {
                Some(circle) => circle,
                None => bracket
                    .middle()
                    .circle()
                    .map_err(|error| input::error_of(&options.grey_photo[0], error.into()))?,
            };
            // Of another bracket, whose unit is another.
            (bracket.merge(Some(circle))?, circle, None)
        };
        let distance = first
            .ball
            .distance
            .map(|d| d * first.ball.circle.radius / circle.radius);
        let (restored, factors) =
            restore_sun(&map, &picture, circle, distance, albedo, Parallelism::Rayon)?;
        map = restored;
        raised = Some(factors);
    }
    let picture = files::Picture {
        width: 2 * map.rows,
        height: map.rows,
        pixels: map.pixels.clone(),
    };
    let bytes = encode_exr_with_alpha(&picture, &map.alpha, Precision::Single)?;
    output::write_file(&options.out, &bytes)?;
    // By solid angle.
    let share = |values: &[f64]| {
        let (mut sum, mut all) = (0.0, 0.0);
        for (row, values) in values.chunks(2 * map.rows).enumerate() {
            let area = (std::f64::consts::PI * (row as f64 + 0.5) / map.rows as f64).sin();
            sum += area * values.iter().sum::<f64>();
            all += area * values.len() as f64;
        }
        sum / all
    };
    let (seen, clipped) = (share(&map.alpha), share(&map.clipped));
    let Circle { x, y, radius } = first.ball.circle;
    console::json(&json!({
        "file": options.out.display().to_string(),
        "rows": map.rows,
        "circle": [x, y, radius],
        "distance": first.ball.distance,
        "exposures": first.radiance.exposures,
        "exposures_told": first.told,
        "seen": seen,
        "clipped": clipped,
        "sun_raised": raised,
    }))?;
    let mut text = format!(
        "{}: {} by {} pixels; ball at {x:.1},{y:.1},{radius:.1}, {}; {:.1} % of the sphere seen",
        options.out.display(),
        2 * map.rows,
        map.rows,
        match first.ball.distance {
            Some(distance) => format!("{distance:.1} radii away"),
            None => "as from far away (give --distance)".into(),
        },
        100.0 * seen
    );
    if clipped > 0.0 && raised.is_none() {
        text.push_str(&format!(
            "; {:.3} % of it was saturated in every photograph and is darker here than it was",
            100.0 * clipped
        ));
    }
    if let Some([r, g, b]) = raised {
        text.push_str(&format!(
            "; what was saturated raised {r:.1}, {g:.1} and {b:.1} times"
        ));
    }
    console::answer(text);
    Ok(())
}
