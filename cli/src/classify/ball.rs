//! The balls of a picture, as they are read.

use std::path::Path;

use crate::arguments::Classify;
use crate::error::Result;
use crate::input;
use lobes::features::{Seen, SeenMask, ShadingOutliers};
use lobes::illumination::Luminance;
use lobes::inference::{Portrait, PortraitReader, SphereFeatures};
use lobes::picture::{Circle, Elongation, Picture, ShapeBall, Sphere, encode_png, encode_spheres};
use lobes::reflection::SphereImage;

/// What reads balls.
pub(super) struct Readers {
    pub(super) portraits: PortraitReader,
    pub(super) outliers: ShadingOutliers,
}

impl Readers {
    pub(super) fn new() -> Result<Self> {
        Ok(Self {
            portraits: PortraitReader::new()?,
            outliers: ShadingOutliers::new(Sphere::SIZE)?,
        })
    }
}

/// A ball as it was read.
pub(super) struct Ball {
    pub(super) circle: Circle,
    pub(super) found: bool,
    /// What else in the picture may be a ball.
    pub(super) others: Vec<Circle>,
    /// Of an outline that is no circle, seen through any lens.
    pub(super) elongation: Option<Elongation>,
    pub(super) saturated: f64,
    /// What of it is body, reflection, print and clipped.
    pub(super) seen_where: SeenMask,
    /// The share of the circle that lies in the picture.
    pub(super) seen: f64,
    pub(super) distance: Option<f64>,
    /// Of a shape that is no ball: the share of a ball's normals that it shows, and that of its pixels
    /// that are left out as shadow.
    pub(super) shape: Option<(f64, f64)>,
    /// Whether the file has a gain map, which is left aside.
    pub(super) gain_map: bool,
    pub(super) portrait: Portrait,
    /// What names are told by, where they are asked for.
    pub(super) features: Option<SphereFeatures>,
    pub(super) grey: bool,
    /// The ball itself, where its light is asked for.
    pub(super) image: Option<SphereImage>,
    /// What brings its mean luminance to a quarter, at which it is shown.
    pub(super) exposure: f64,
    /// A PNG of it, for the page.
    pub(super) picture: Option<Vec<u8>>,
    /// The same with what is not its body's shading in colours.
    pub(super) mask: Option<Vec<u8>>,
    /// A PNG that shows where it was found, and its width and height.
    pub(super) overlay: Option<(Vec<u8>, (usize, usize))>,
}

/// The ball of a picture, or with `--all` every one, or why one is not read; that of `shape` where the
/// picture shows another shape.
///
/// # Errors
/// A file that is not read, and a picture in which no ball is found.
pub(super) fn read(
    path: &Path,
    options: &Classify,
    readers: &Readers,
    shape: Option<&ShapeBall>,
) -> Result<Vec<Result<Ball>>> {
    if let Some(shape) = shape {
        let of = ball(&shape.picture, shape.circle, Vec::new(), options, readers)?;
        // Where it is was put, not found.
        return Ok(vec![Ok(Ball {
            found: false,
            elongation: None,
            overlay: None,
            shape: Some((shape.coverage, shape.left_out)),
            ..of
        })]);
    }
    let photo = if input::is_standard(path) {
        Picture::from_bytes(&input::bytes()?)?
    } else {
        Picture::read(path)?
    };
    let (circle, others) = match options.circle {
        Some(circle) => (circle, Vec::new()),
        None => photo.circles()?,
    };
    if !options.all {
        return Ok(vec![ball(&photo, circle, others, options, readers)]);
    }
    let circles = [vec![circle], others].concat();
    let balls = (0..circles.len()).map(|i| {
        let mut others = circles.clone();
        let circle = others.remove(i);
        ball(&photo, circle, others, options, readers)
    });
    Ok(balls.collect())
}

/// An outline that is longer by less than this, beyond what a lens does, is a circle: edges of highlights
/// and shadows make some round balls look longer (`experiments/tests/outlines.rs` counts how many).
const ROUND: f64 = 1.08;

fn ball(
    photo: &Picture,
    circle: Circle,
    others: Vec<Circle>,
    options: &Classify,
    readers: &Readers,
) -> Result<Ball> {
    let found = options.circle.is_none() && !photo.has_mask();
    let sphere = photo.sphere(circle)?;
    let image = &sphere.image;
    let exposure = 0.25 / Luminance::Rec709.of(image.mean());
    let elongation = photo.elongation(circle);
    let seen_where = readers.outliers.of(image, sphere.ceiling)?;
    Ok(Ball {
        circle,
        found,
        elongation: elongation.filter(|found| photo.unexplained(circle, *found) > ROUND),
        saturated: sphere.saturated,
        seen: sphere.seen,
        distance: image.camera().distance(),
        shape: None,
        gain_map: photo.has_gain_map(),
        portrait: readers.portraits.of_sphere(photo, circle, &sphere)?,
        features: if options.wants_names() {
            Some(SphereFeatures::of(&sphere)?)
        } else {
            None
        },
        grey: sphere.is_grey(),
        image: options.light.is_some().then(|| image.clone()),
        exposure,
        picture: if options.report {
            Some(encode_spheres(&[image], 1, 0, exposure)?)
        } else {
            None
        },
        mask: if options.report {
            Some(mask(image, &seen_where, exposure)?)
        } else {
            None
        },
        seen_where,
        overlay: if found {
            Some(overlay(photo, circle, &others, exposure)?)
        } else {
            None
        },
        others,
    })
}

/// The ball in grey, prints on it in red, reflections in blue, and what is burnt out in yellow.
fn mask(image: &SphereImage, seen: &SeenMask, exposure: f64) -> Result<Vec<u8>> {
    let size = image.size();
    let png = encode_png(size, size, exposure, |row, column| {
        let grey = Luminance::Rec709.of(image.get(row, column)?);
        let tint = match seen.get(row, column) {
            Some(Seen::Print) => [1.0, 0.0, 0.0],
            Some(Seen::Reflection) => [0.1, 0.3, 1.0],
            Some(Seen::Clipped) => [1.0, 0.8, 0.0],
            Some(Seen::Body) | None => return Some([grey; 3]),
        };
        // At two thirds of full strength whatever the exposure, and a little of the ball.
        Some(tint.map(|tint| 0.2 * grey + 0.65 * tint / exposure))
    })?;
    Ok(png)
}

/// The picture, no larger than 640 pixels, with the circle on it, and others thinner.
fn overlay(
    photo: &Picture,
    circle: Circle,
    others: &[Circle],
    exposure: f64,
) -> Result<(Vec<u8>, (usize, usize))> {
    let scale = photo.width().max(photo.height()).div_ceil(640);
    let step = scale as f64;
    let line = 1.5f64.max(0.01 * circle.radius / step) * step;
    let (width, height) = (photo.width() / scale, photo.height() / scale);
    // At full strength whatever the exposure.
    let strong = |rgb: [f64; 3]| Some(rgb.map(|value| value / exposure));
    let png = encode_png(width, height, exposure, |row, column| {
        let (y, x) = (row * scale, column * scale);
        let off = |circle: &Circle| {
            ((x as f64 + 0.5 - circle.x).hypot(y as f64 + 0.5 - circle.y) - circle.radius).abs()
        };
        if off(&circle) < line {
            // Magenta.
            return strong([1.0, 0.0, 1.0]);
        }
        if others.iter().any(|other| off(other) < 0.75 * step) {
            // Cyan.
            return strong([0.0, 1.0, 1.0]);
        }
        photo.get(y, x)
    })?;
    Ok((png, (width, height)))
}
