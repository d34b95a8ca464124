//! A shape with known normals, read as the ball that shows the same.

use std::path::Path;

use serde_json::json;

use crate::arguments::{Classify, Frame};
use crate::ball_light::LightMaps;
use crate::error::{Error, Result};
use crate::{console, input};
use lobes::Parallelism;
use lobes::glam::DVec3;
use lobes::illumination::Luminance;
use lobes::inference::{
    BallLightReader, EVIDENCE_DEGREE, EvidenceReader, LightQuantity, Posterior, ReflectanceGrid,
    natural_spectrum,
};
use lobes::picture::{NormalFrame, Normals, Picture, ShapeBall};
use lobes::reflectance::Variant;
use lobes::reflection::Viewpoint;

/// A ball whose normals end nearer to the centre than this, in radii, says nothing.
const LEAST: f64 = 0.3;

/// The power to which the evidence is raised, as in `examples/evidence.rs`.
const WEIGHT: f64 = 0.01;

/// The ball of the shape in the picture, where `--normals` gives one.
///
/// # Errors
/// Files that are not read, and what [`Normals`] refuses.
pub(super) fn read(options: &Classify, path: &Path) -> Result<Option<ShapeBall>> {
    let shape = &options.shape;
    let Some(normals) = &shape.normals else {
        return Ok(None);
    };
    let mut picture = if input::is_standard(path) {
        Picture::from_bytes(&input::bytes()?)?
    } else {
        Picture::read(path)?
    };
    if let Some(pixels) = shape.focal {
        picture = picture.with_focal_length(pixels)?;
    }
    let frame = match shape.frame {
        Frame::Camera => NormalFrame::Camera,
        Frame::Opencv => NormalFrame::OpenCv,
        Frame::World => NormalFrame::world(DVec3::from(shape.towards), DVec3::from(shape.up))?,
    };
    let size = |of: &Picture| (of.width(), of.height());
    let same = |of: &Picture, path: &Path| {
        if size(of) == size(&picture) {
            return Ok(());
        }
        Err(lobes::Error::OtherSize {
            name: path.display().to_string(),
            size: size(of),
            first: "the picture".into(),
            first_size: size(&picture),
        })
    };
    let mask = shape
        .mask
        .as_ref()
        .map(|path| {
            let mask = Picture::read(path)?;
            same(&mask, path)?;
            Ok::<_, Error>(white_or_opaque(&mask))
        })
        .transpose()?;
    let of = |error: lobes::Error| Error::of(normals.display().to_string(), error);
    let map = Picture::read(normals)?;
    same(&map, normals)?;
    let map = Normals::of_picture(&map, frame, mask.as_deref()).map_err(of)?;
    let ball = map.ball(&picture).map_err(of)?;
    Ok(Some(ball))
}

/// What a mask leaves: by its alpha where it has one, else by how white it is.
fn white_or_opaque(mask: &Picture) -> Vec<f32> {
    match mask.mask() {
        Some(alpha) => alpha.to_vec(),
        None => {
            // sRGB's code of one half.
            let white = |rgb| f32::from(u8::from(Luminance::Rec709.of(rgb) > 0.214));
            mask.radiance().map(white).collect()
        }
    }
}

/// Tells of a shape that shows too little of a ball what its evidence says of σ, with nothing
/// learned, and of the light where that is asked for.
///
/// # Errors
/// A shape of which hardly anything is seen; after the telling, what was asked for of which evidence
/// knows nothing.
pub(super) fn tell_part(ball: &ShapeBall, path: &Path, options: &Classify) -> Result<()> {
    if ball.reach < LEAST {
        return Err(Error::request(
            format!(
                "the shape shows {:.0} % of the normals that a ball does, and none of the rings about the line of sight as a whole beyond {:.0}°",
                100.0 * ball.coverage,
                ball.reach.asin().to_degrees()
            ),
            "photograph it from where more of it is seen that faces the camera",
        ));
    }
    let reader = EvidenceReader::within(Viewpoint::Orthographic, ball.reach)?;
    let sphere = ball.picture.sphere(ball.circle)?;
    let reading = reader.read(&sphere.image)?;
    let variant = Variant::default();
    let spectra = [0.0, 0.75].map(|eta| natural_spectrum(eta, EVIDENCE_DEGREE));
    let grid = ReflectanceGrid::new(
        variant,
        reader.layout(),
        &Posterior::default_shares(),
        &Posterior::default_sigmas(),
        &spectra,
        ShapeBall::NOISE_OF_PART,
        Parallelism::Rayon,
    )?;
    let posterior = grid.posterior(&reading.luminance, &reading.lights, WEIGHT)?;
    let [low, median, high] = [0.05, 0.5, 0.95].map(|level| posterior.sigma_quantile(level));
    let (name, degrees) = (input::name(path), ball.reach.asin().to_degrees());
    console::json(&json!({
        "file": name,
        "finish": null,
        "sigma": { "low": low, "median": median, "high": high },
        "reach_degrees": degrees,
        "coverage": ball.coverage,
        "left_out": ball.left_out,
    }))?;
    console::answer(format!(
        "{name}: σ {median:.3} (90 %: {low:.3} – {high:.3}), by evidence alone: the shape has all normals to {degrees:.0}° from the line of sight only, and what was learned from whole balls does not hold of it"
    ));
    if let Some(path) = &options.light {
        let (radius, noise) = (ball.reach, ShapeBall::NOISE_OF_PART);
        let (view, what) = (Viewpoint::Orthographic, LightQuantity::Radiance);
        let reader = BallLightReader::within(view, what, radius, noise)?;
        let points = posterior.possible_reflectances();
        LightMaps::by(&reader, &sphere.image, &points)?.write(path)?;
    }
    let asked = [
        (options.pbr.is_some(), "--pbr"),
        (options.report, "--report"),
        (options.wants_names(), "--names"),
    ];
    let asked: Vec<&str> = asked.into_iter().filter(|of| of.0).map(|of| of.1).collect();
    if asked.is_empty() {
        return Ok(());
    }
    let whole = ShapeBall::WHOLE.asin().to_degrees();
    Err(Error::request(
        format!(
            "{} needs all normals of a ball to {whole:.0}°, and the shape has them to {degrees:.0}°: σ and the light are all that is read of it",
            asked.join(" or ")
        ),
        "leave that out, or photograph the shape from where more of it faces the camera",
    ))
}
