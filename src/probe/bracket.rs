//! Photographs of one view at several exposures, as one picture of radiance.

use crate::numeric::bilinear;
use crate::picture::{Circle, Picture};
use crate::{Error, Result};

/// Values of the mean below this share of what saturates say little: noise, and codes of 8 bits.
const DARK: f64 = 0.002;

/// Values of the brighter picture above such a share of what saturates tell the exposures' ratio: the
/// first of them for which there are enough.
const WELL: [f64; 3] = [0.3, 0.1, 0.03];

/// Values above this share of what saturates may be bent by the camera.
const BRIGHT: f64 = 0.85;

/// A ratio is estimated from so many values at the least.
const FEWEST: usize = 100;

/// Where the exposures that a camera tells and those that the pictures tell differ by less than
/// this, as a share, the pictures are believed: 1/60 is 1/64.
const NOMINAL: f64 = 0.2;

/// What is darker than this share of what saturates, in the darker picture, tells no shift.
const PLAIN: f64 = 0.02;

/// How often a shift is bettered.
const ROUNDS: usize = 6;

/// A bracket has moved where its pictures are apart by more than this share of the ball's radius,
/// and by a pixel and a half: what is less noise can make.
const MOVED: f64 = 0.01;

/// A picture of radiance, up to one factor for all of it, and where it was too bright for every
/// exposure. [`Bracket`] has an example.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiance {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Radiance, rows from the top.
    pub pixels: Vec<[f64; 3]>,
    /// Whether every exposure is saturated there; the radiance is then a lower limit.
    pub clipped: Vec<bool>,
    /// The exposures by which the pictures were divided, in the order in which they were given, the
    /// darkest one's 1; NaN for what was not needed, being darker than one that is saturated nowhere.
    pub exposures: Vec<f64>,
}

impl Radiance {
    /// Whether it has as many pixels as its size says.
    pub(super) fn check(&self) -> Result<()> {
        let count = self.width.saturating_mul(self.height);
        crate::check_length("a picture of radiance", count, self.pixels.len())?;
        crate::check_length(
            "the clipped pixels of a picture of radiance",
            count,
            self.clipped.len(),
        )
    }
}

/// One of them.
#[derive(Debug, Clone)]
struct Shot {
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
    /// The value from which on a pixel is saturated.
    ceiling: f64,
}

/// Photographs of one view.
///
/// ```
/// use lobes::picture::Picture;
/// use lobes::probe::Bracket;
/// // A slope, and the same exposed four times as long, each saturated at 1.
/// let shot = |time: f64| {
///     let codes = (0..64 * 64).map(|i| [(255.0 * lobes::files::srgb_of_linear((time * (i % 64) as f64 / 128.0).min(1.0))).round() as u8; 3]);
///     Picture::from_srgb8(64, 64, codes.flatten().collect())
/// };
/// let names = ["dark".into(), "bright".into()].to_vec();
/// let bracket = Bracket::new(vec![shot(1.0)?, shot(4.0)?], names, vec![None, None])?;
/// let radiance = bracket.merge(None)?;
/// assert!((radiance.exposures[1] / radiance.exposures[0] - 4.0).abs() < 0.05);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Bracket {
    pictures: Vec<Picture>,
    /// Of each picture, its pixels' radiance.
    shots: Vec<Shot>,
    names: Vec<String>,
    exposures: Vec<Option<f64>>,
}

impl Bracket {
    /// Pictures of one size, their names for errors, and their exposures, in any unit, where they
    /// are known: time × sensitivity over the square of the f-number.
    ///
    /// # Errors
    /// [`Error::Empty`] for no picture, [`Error::Length`] where there are not as many names and
    /// exposures, [`Error::OtherSize`] for pictures of two sizes, [`Error::Domain`] for an exposure
    /// that is not above 0.
    pub fn new(
        pictures: Vec<Picture>,
        names: Vec<String>,
        exposures: Vec<Option<f64>>,
    ) -> Result<Self> {
        let Some(first) = pictures.first() else {
            return Err(Error::Empty {
                what: "a bracket",
                needs: "a photograph",
            });
        };
        crate::check_length("the names of a bracket", pictures.len(), names.len())?;
        crate::check_length(
            "the exposures of a bracket",
            pictures.len(),
            exposures.len(),
        )?;
        for (picture, name) in pictures.iter().zip(&names) {
            if (picture.width(), picture.height()) != (first.width(), first.height()) {
                return Err(Error::OtherSize {
                    name: name.clone(),
                    size: (picture.width(), picture.height()),
                    first: names[0].clone(),
                    first_size: (first.width(), first.height()),
                });
            }
        }
        for exposure in exposures.iter().flatten() {
            if !(*exposure > 0.0 && exposure.is_finite()) {
                return Err(Error::Domain {
                    what: "an exposure",
                    value: *exposure,
                    allowed: "finite and above 0",
                });
            }
        }
        let shots = pictures
            .iter()
            .map(|picture| Shot {
                width: picture.width(),
                height: picture.height(),
                pixels: picture.radiance().collect(),
                ceiling: picture.ceiling().unwrap_or(f64::INFINITY),
            })
            .collect();
        Ok(Self {
            pictures,
            shots,
            names,
            exposures,
        })
    }

    /// The picture of the middle exposure, in which outlines are looked for.
    pub fn middle(&self) -> &Picture {
        let order = self.by_brightness();
        &self.pictures[order[order.len() / 2]]
    }

    /// From the darkest picture to the brightest.
    fn by_brightness(&self) -> Vec<usize> {
        let brightness = |i: usize| {
            let Shot {
                pixels, ceiling, ..
            } = &self.shots[i];
            let values = pixels.as_flattened().iter();
            let sum: f64 = values.map(|value| value.min(*ceiling)).sum();
            sum / if ceiling.is_finite() { *ceiling } else { 1.0 }
        };
        let mut order: Vec<usize> = (0..self.pictures.len()).collect();
        order.sort_by(|&a, &b| brightness(a).total_cmp(&brightness(b)));
        order
    }

    /// One picture of radiance: of each pixel the sum of the values that are not saturated over the
    /// sum of their exposures, which is what photons' noise asks for.
    ///
    /// The exposures' ratios are those of the pictures where enough pixels are neither dark nor
    /// saturated in two of them, and the camera's where not. Pixels count within `circle`, where
    /// one is given.
    ///
    /// # Errors
    /// [`Error::NoRatio`] where neither tells, [`Error::Moved`] where two pictures show the same
    /// things at different places.
    pub fn merge(&self, circle: Option<Circle>) -> Result<Radiance> {
        let mut order = self.by_brightness();
        // What is darker than a picture without a bright pixel has nothing to add.
        let enough = order.iter().rposition(|&k| {
            let shot = &self.shots[k];
            let limit = BRIGHT * shot.ceiling;
            within(shot, circle).all(|i| shot.pixels[i].iter().all(|v| *v < limit))
        });
        order.drain(..enough.unwrap_or(0));
        let mut exposures = vec![f64::NAN; self.pictures.len()];
        exposures[order[0]] = 1.0;
        for pair in order.windows(2) {
            let (dark, bright) = (pair[0], pair[1]);
            let told = self.exposures[bright].zip(self.exposures[dark]);
            let told = told.map(|(bright, dark)| bright / dark);
            let seen = ratio(&self.shots[dark], &self.shots[bright], circle);
            let ratio = match (told, seen) {
                (Some(told), Some(seen)) if (seen / told - 1.0).abs() > NOMINAL => told,
                (_, Some(seen)) => seen,
                (Some(told), None) => told,
                (None, None) => {
                    return Err(Error::NoRatio {
                        first: self.names[dark].clone(),
                        second: self.names[bright].clone(),
                    });
                }
            };
            exposures[bright] = exposures[dark] * ratio;
            if let Some(pixels) = apart(&self.shots[dark], &self.shots[bright], ratio, circle) {
                return Err(Error::Moved {
                    first: self.names[dark].clone(),
                    second: self.names[bright].clone(),
                    pixels,
                });
            }
        }
        let first = &self.shots[0];
        let count = first.width * first.height;
        let mut pixels = Vec::with_capacity(count);
        let mut clipped = Vec::with_capacity(count);
        for i in 0..count {
            let (mut sum, mut time) = ([0.0; 3], 0.0);
            for &k in &order {
                let value = self.shots[k].pixels[i];
                let ceiling = self.shots[k].ceiling;
                if k == order[0] || value.iter().all(|v| *v < BRIGHT * ceiling) {
                    let saturated = value.iter().any(|v| *v >= ceiling);
                    // The darkest stands alone where all others are too bright.
                    for c in 0..3 {
                        sum[c] += value[c];
                    }
                    time += exposures[k];
                    if k == order[0] {
                        clipped.push(saturated);
                    }
                }
            }
            pixels.push(sum.map(|sum| sum.max(0.0) / time));
        }
        Ok(Radiance {
            width: first.width,
            height: first.height,
            pixels,
            clipped,
            exposures,
        })
    }
}

/// The pixels within a circle, or all of them.
fn within(picture: &Shot, circle: Option<Circle>) -> impl Iterator<Item = usize> + '_ {
    let width = picture.width;
    (0..picture.pixels.len()).filter(move |i| {
        circle.is_none_or(|Circle { x, y, radius }| {
            let (across, down) = ((i % width) as f64 + 0.5 - x, (i / width) as f64 + 0.5 - y);
            across.hypot(down) < 0.97 * radius
        })
    })
}

/// The brighter exposure over the darker, by the values that the brighter shows well; none where
/// they are too few, or next to nothing in the darker.
fn ratio(dark: &Shot, bright: &Shot, circle: Option<Circle>) -> Option<f64> {
    WELL.into_iter()
        .find_map(|well| ratio_above(dark, bright, circle, well))
}

/// The same, by values above a share of what saturates.
fn ratio_above(dark: &Shot, bright: &Shot, circle: Option<Circle>, well: f64) -> Option<f64> {
    let high = scale_of(bright);
    let floor = DARK * scale_of(dark);
    let (mut of_dark, mut of_bright, mut count) = (0.0, 0.0, 0usize);
    for i in within(dark, circle) {
        for c in 0..3 {
            // Chosen by the brighter alone: a choice by the darker would favour its noise.
            let value = bright.pixels[i][c];
            if value > well * high && value < BRIGHT * high {
                of_dark += dark.pixels[i][c];
                of_bright += value;
                count += 1;
            }
        }
    }
    let shown = count >= FEWEST && of_dark > floor * count as f64;
    shown.then(|| of_bright / of_dark)
}

/// What saturates, or the largest value where nothing does.
fn scale_of(picture: &Shot) -> f64 {
    if picture.ceiling.is_finite() {
        picture.ceiling
    } else {
        let values = picture.pixels.as_flattened().iter();
        values.copied().fold(f64::MIN_POSITIVE, f64::max)
    }
}

/// By how many pixels one picture is off the other, where that is too much: the shift that explains
/// their difference best, to first order, in pictures made so small that it is one.
fn apart(dark: &Shot, bright: &Shot, ratio: f64, circle: Option<Circle>) -> Option<f64> {
    let reach = circle.map_or(0.5 * dark.width.min(dark.height) as f64, |c| c.radius);
    let coarse = ((reach / 40.0) as usize).max(1);
    let mut worst = None;
    for factor in [coarse, 1] {
        let shift = shift(dark, bright, ratio, circle, factor);
        let Some(shift) = shift.map(|shift| shift * factor as f64) else {
            continue;
        };
        let allowed = (MOVED * reach).max(1.5);
        // A shift is known to a part of a coarse pixel.
        if shift > allowed.max(0.1 * factor as f64) && worst.is_none_or(|worst| shift > worst) {
            worst = Some(shift);
        }
    }
    worst
}

/// The shift in pixels of pictures whose pixels are `factor` × `factor` of these.
fn shift(
    dark: &Shot,
    bright: &Shot,
    ratio: f64,
    circle: Option<Circle>,
    factor: usize,
) -> Option<f64> {
    let (width, height) = (dark.width / factor, dark.height / factor);
    let high = BRIGHT * bright.ceiling;
    // Of three channels; below it noise would be taken for a shift.
    let low = 3.0 * PLAIN * scale_of(dark);
    // The mean luminance of what both show; NaN elsewhere.
    let reduced = |picture: &Shot, scale: f64| -> Vec<f64> {
        (0..width * height)
            .map(|i| {
                let (row, column) = (i / width * factor, i % width * factor);
                let mut sum = 0.0;
                for y in row..row + factor {
                    for x in column..column + factor {
                        let at = y * dark.width + x;
                        let outside = circle.is_some_and(|c| {
                            (x as f64 + 0.5 - c.x).hypot(y as f64 + 0.5 - c.y) > 1.1 * c.radius
                        });
                        let dim = dark.pixels[at].iter().sum::<f64>() < low;
                        if outside || dim || bright.pixels[at].iter().any(|v| *v >= high) {
                            return f64::NAN;
                        }
                        sum += scale * picture.pixels[at].iter().sum::<f64>();
                    }
                }
                sum / (factor * factor) as f64
            })
            .collect()
    };
    let (a, b) = (reduced(dark, ratio), reduced(bright, 1.0));
    let at = |field: &[f64], x: f64, y: f64| -> f64 {
        let corners = bilinear::corners_within(width, height, x, y);
        corners.map_or(f64::NAN, |corners| {
            corners.map(|(at, weight)| weight * field[at]).iter().sum()
        })
    };
    // b(p + s + δ) = a(p), to first order in δ: Σ (g gᵀ) δ = Σ g (a − b), and again from there.
    let (mut x, mut y) = (0.0, 0.0);
    for _ in 0..ROUNDS {
        let (mut xx, mut xy, mut yy, mut xt, mut yt, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0, 0);
        for row in 0..height {
            for column in 0..width {
                let (u, v) = (column as f64 + x, row as f64 + y);
                let own = at(&b, u, v);
                let across = 0.5 * (at(&b, u + 1.0, v) - at(&b, u - 1.0, v));
                let down = 0.5 * (at(&b, u, v + 1.0) - at(&b, u, v - 1.0));
                let apart = a[row * width + column] - own;
                let level = 0.5 * (a[row * width + column] + own);
                if !(across + down + apart).is_finite() || level <= 0.0 {
                    continue;
                }
                // Relative, so that what is bright does not decide alone.
                let weight = 1.0 / (level * level);
                xx += weight * across * across;
                xy += weight * across * down;
                yy += weight * down * down;
                xt += weight * across * apart;
                yt += weight * down * apart;
                count += 1;
            }
        }
        let determinant = xx * yy - xy * xy;
        if count < FEWEST || !(determinant > 1e-6 * xx * yy) {
            return None;
        }
        x += (yy * xt - xy * yt) / determinant;
        y += (xx * yt - xy * xt) / determinant;
    }
    let shift = f64::hypot(x, y);
    shift.is_finite().then_some(shift)
}

/// The exposure that the EXIF of a JPEG, PNG, WebP or TIFF tells, t S / N²: the time in seconds
/// times the sensitivity over the square of the f-number, each 1 where it is not told; none without
/// a time.
#[cfg(feature = "files")]
pub fn exposure_of(bytes: &[u8]) -> Option<f64> {
    let mut bytes = std::io::Cursor::new(bytes);
    let exif = exif::Reader::new().read_from_container(&mut bytes).ok()?;
    let number = |tag| -> Option<f64> {
        let field = exif.get_field(tag, exif::In::PRIMARY)?;
        match &field.value {
            exif::Value::Rational(values) => values.first().map(exif::Rational::to_f64),
            value => value.get_uint(0).map(f64::from),
        }
    };
    let positive = |value: Option<f64>| value.filter(|value| *value > 0.0 && value.is_finite());
    let time = positive(number(exif::Tag::ExposureTime))?;
    let sensitivity = positive(number(exif::Tag::PhotographicSensitivity)).unwrap_or(1.0);
    let stop = positive(number(exif::Tag::FNumber)).unwrap_or(1.0);
    Some(time * sensitivity / (stop * stop))
}
