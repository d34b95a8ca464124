//! A picture from a camera or a renderer, and the sphere in it.

use std::io::Cursor;
use std::path::Path;

use glam::DVec3;
use image::{DynamicImage, ImageDecoder, ImageReader};

use crate::files::{self, Problem, linear_of_srgb};
use crate::illumination::Luminance;
use crate::reflection::{Camera, SphereImage};
use crate::{Error, Result};

/// A picture as linear radiance.
pub(super) struct Photo {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<[f64; 3]>,
    /// Which pixels a mask leaves; all where there is none.
    mask: Option<Vec<bool>>,
    /// Which pixels are at the end of their range.
    saturated: Vec<bool>,
    /// Whether it came as codes of 8 or 16 bits, not as radiance.
    pub(super) encoded: bool,
    /// The focal length in pixels, where the file tells it.
    pub(super) focal: Option<f64>,
}

/// A circle in a picture, in pixels; the first pixel's centre is at (½, ½).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Circle {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) radius: f64,
}

impl std::str::FromStr for Circle {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let numbers: Vec<f64> = text
            .split(',')
            .map(|part| part.trim().parse::<f64>())
            .collect::<std::result::Result<_, _>>()
            .map_err(|_| "a circle is three numbers, x,y,r in pixels".to_owned())?;
        match numbers[..] {
            [x, y, radius]
                if x.is_finite() && y.is_finite() && radius > 0.0 && radius.is_finite() =>
            {
                Ok(Self { x, y, radius })
            }
            _ => Err("a circle is three numbers, x,y,r in pixels, r above 0".into()),
        }
    }
}

/// An 8-bit code from which on a pixel counts as saturated: JPEG smears the last few.
const SATURATED: f64 = 252.0 / 255.0;

/// The largest share of saturated pixels of a sphere that can still be read.
const MOST_SATURATED: f64 = 0.9;

impl Photo {
    /// Reads a picture: linear OpenEXR, Radiance or PFM, or PNG or JPEG as sRGB.
    pub(super) fn read(path: &Path) -> Result<Self> {
        Self::of_bytes(path, &files::read_bytes(path)?)
    }

    /// [`read`](Self::read), of the file's bytes.
    pub(super) fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
        let png = bytes.starts_with(&[0x89, b'P', b'N', b'G']);
        let jpeg = bytes.starts_with(&[0xff, 0xd8]);
        if png || jpeg {
            Self::decode(bytes).map_err(|problem| problem.in_file(path))
        } else {
            let picture = files::decode_problem(bytes).map_err(|problem| problem.in_file(path))?;
            if let Some(index) = picture
                .pixels
                .iter()
                .position(|rgb| rgb.iter().any(|value| !value.is_finite()))
            {
                return Err(Error::file(
                    path,
                    format!(
                        "holds a value that is not finite in row {}, column {}",
                        index / picture.width,
                        index % picture.width
                    ),
                    "mend the picture",
                ));
            }
            Ok(Self {
                saturated: vec![false; picture.pixels.len()],
                width: picture.width,
                height: picture.height,
                pixels: picture.pixels,
                mask: None,
                encoded: false,
                focal: None,
            })
        }
    }

    fn decode(bytes: &[u8]) -> std::result::Result<Self, Problem> {
        let damaged = |problem: &dyn std::fmt::Display| {
            Problem::new(
                format!("the picture is damaged: {problem}"),
                "fetch it again",
            )
        };
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| damaged(&error))?;
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(16 * files::MOST_PIXELS as u64);
        reader.limits(limits);
        let mut decoder = reader.into_decoder().map_err(|error| damaged(&error))?;
        let (width, height) = decoder.dimensions();
        files::check_size(width as usize, height as usize, bytes.len())?;
        let exif = decoder.exif_metadata().map_err(|error| damaged(&error))?;
        let orientation = decoder.orientation().map_err(|error| damaged(&error))?;
        let mut picture = DynamicImage::from_decoder(decoder).map_err(|error| damaged(&error))?;
        picture.apply_orientation(orientation);
        let has_alpha = picture.color().has_alpha();
        let wide = picture.color().bytes_per_pixel() / picture.color().channel_count() > 1;
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let count = width * height;
        let (mut pixels, mut saturated, mut mask) = (
            Vec::with_capacity(count),
            Vec::with_capacity(count),
            Vec::with_capacity(if has_alpha { count } else { 0 }),
        );
        // A pixel's codes and alpha on [0, 1].
        let mut push = |[r, g, b, alpha]: [f64; 4]| {
            pixels.push([r, g, b].map(linear_of_srgb));
            saturated.push([r, g, b].iter().any(|v| *v >= SATURATED));
            if has_alpha {
                mask.push(alpha >= 0.5);
            }
        };
        if wide {
            let picture = picture.into_rgba16();
            for pixel in picture.pixels() {
                push(pixel.0.map(|v| f64::from(v) / 65535.0));
            }
        } else {
            let picture = picture.into_rgba8();
            for pixel in picture.pixels() {
                push(pixel.0.map(|v| f64::from(v) / 255.0));
            }
        }
        let diagonal = (width as f64).hypot(height as f64);
        Ok(Self {
            width,
            height,
            pixels,
            saturated,
            mask: mask.contains(&false).then_some(mask),
            encoded: true,
            // The diagonal of a film of 36 × 24 mm is 43.27 mm.
            focal: exif
                .and_then(focal_length_on_film)
                .map(|millimetres| millimetres / 36f64.hypot(24.0) * diagonal),
        })
    }

    /// The circle of the mask, where there is one.
    pub(super) fn masked_circle(&self) -> Result<Option<Circle>> {
        let Some(mask) = &self.mask else {
            return Ok(None);
        };
        let (mut count, mut x, mut y) = (0.0f64, 0.0, 0.0);
        let (mut left, mut right, mut top, mut bottom) = (f64::MAX, 0.0f64, f64::MAX, 0.0f64);
        for (i, _) in mask.iter().enumerate().filter(|(_, inside)| **inside) {
            let (column, row) = ((i % self.width) as f64, (i / self.width) as f64);
            count += 1.0;
            x += column + 0.5;
            y += row + 0.5;
            (left, right) = (left.min(column), right.max(column + 1.0));
            (top, bottom) = (top.min(row), bottom.max(row + 1.0));
        }
        if count == 0.0 {
            return Err(Error::Unanswerable(
                "the mask leaves no pixel; give the sphere with --circle".into(),
            ));
        }
        let radius = (count / std::f64::consts::PI).sqrt();
        let round = |extent: f64| (extent / (2.0 * radius) - 1.0).abs() < 0.05 + 1.0 / radius;
        if !(round(right - left) && round(bottom - top)) {
            return Err(Error::Unanswerable(
                "the mask is not round, so it is not the outline of a sphere; give the sphere with --circle"
                    .into(),
            ));
        }
        Ok(Some(Circle {
            x: x / count,
            y: y / count,
            radius,
        }))
    }

    /// The roundest outline in the picture.
    ///
    /// A picture full of edges can hold a circle that is no sphere: the overlay is there to be looked at. A coarse search over centres and radii, then a fine one, for the circle across which log luminance changes most, all
    /// along it: the score is the mean of the gradient across the circle, none counted beyond the strongest tenth of the picture.
    pub(super) fn find_circle(&self) -> Result<Circle> {
        let side = self.width.min(self.height);
        if side < 16 {
            return Err(Error::Unanswerable(format!(
                "a picture of {} by {} pixels is too small to find a sphere in",
                self.width, self.height
            )));
        }
        let coarse = Gradient::new(self, side.div_ceil(96));
        let mut best = (
            0.0,
            Circle {
                x: 0.0,
                y: 0.0,
                radius: 0.0,
            },
        );
        let (width, height) = (coarse.width as f64, coarse.height as f64);
        let most = 0.5 * width.min(height);
        let mut radius = 0.12 * most * 2.0;
        while radius <= most {
            let step = (0.06 * radius).max(1.0);
            let across = |length: f64| {
                let room = length - 2.0 * radius;
                let count = (room / step).floor() as usize;
                (0..=count).map(move |i| radius + room * (i as f64 + 0.5) / (count + 1) as f64)
            };
            for y in across(height) {
                for x in across(width) {
                    let circle = Circle { x, y, radius };
                    let score = coarse.score(circle);
                    if score > best.0 {
                        best = (score, circle);
                    }
                }
            }
            radius *= 1.04;
        }
        let mut circle = best.1;
        let mut score = best.0;
        let mut step = 0.06 * circle.radius;
        while step > 0.02 {
            let mut moved = false;
            for (dx, dy, dr) in [
                (1.0, 0.0, 0.0),
                (-1.0, 0.0, 0.0),
                (0.0, 1.0, 0.0),
                (0.0, -1.0, 0.0),
                (0.0, 0.0, 1.0),
                (0.0, 0.0, -1.0),
            ] {
                let other = Circle {
                    x: circle.x + step * dx,
                    y: circle.y + step * dy,
                    radius: circle.radius + step * dr,
                };
                let inside = other.radius > 2.0
                    && other.x - other.radius >= -0.01
                    && other.y - other.radius >= -0.01
                    && other.x + other.radius <= width + 0.01
                    && other.y + other.radius <= height + 0.01;
                let value = if inside { coarse.score(other) } else { 0.0 };
                if value > score {
                    (circle, score, moved) = (other, value, true);
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        if !(score >= Gradient::LEAST_SCORE) {
            return Err(Error::Unanswerable(
                "no sphere is to be seen in the picture; give it with --circle x,y,r".into(),
            ));
        }
        let scale = coarse.scale as f64;
        Ok(Circle {
            x: circle.x * scale,
            y: circle.y * scale,
            radius: circle.radius * scale,
        })
    }

    /// The picture of the sphere within a circle, `size` pixels a side, each the mean of what it covers, and its share of saturated
    /// pixels.
    pub(super) fn sphere(&self, circle: Circle, size: usize) -> Result<(SphereImage, f64)> {
        let slack = 1.0;
        if circle.x - circle.radius < -slack
            || circle.y - circle.radius < -slack
            || circle.x + circle.radius > self.width as f64 + slack
            || circle.y + circle.radius > self.height as f64 + slack
        {
            return Err(Error::Unanswerable(format!(
                "the circle {:.1},{:.1},{:.1} leaves the picture of {} by {} pixels; give one inside it",
                circle.x, circle.y, circle.radius, self.width, self.height
            )));
        }
        if circle.radius < 8.0 {
            return Err(Error::Unanswerable(format!(
                "a sphere of {:.1} pixels radius is too small to be read; 8 are needed",
                circle.radius
            )));
        }
        let pitch = 2.0 * circle.radius / size as f64;
        let samples = (pitch.ceil() as usize).max(1);
        let (mut clipped, mut count) = (0.0, 0.0);
        let mut pixels = Vec::with_capacity(size * size);
        for i in 0..size * size {
            let (row, column) = ((i / size) as f64, (i % size) as f64);
            let (mut sum, mut inside) = ([0.0; 3], 0.0);
            for j in 0..samples * samples {
                let (v, u) = ((j / samples) as f64, (j % samples) as f64);
                let part = samples as f64;
                let x = (column + (u + 0.5) / part) * pitch - circle.radius;
                let y = (row + (v + 0.5) / part) * pitch - circle.radius;
                // What lies behind the sphere is not mixed in.
                if x * x + y * y > circle.radius * circle.radius {
                    continue;
                }
                let (rgb, saturated) = self.at(circle.x + x, circle.y + y);
                for channel in 0..3 {
                    sum[channel] += rgb[channel];
                }
                inside += 1.0;
                count += 1.0;
                clipped += f64::from(u8::from(saturated));
            }
            pixels.push(sum.map(|sum| sum / f64::max(inside, 1.0)));
        }
        let saturated = clipped / f64::max(count, 1.0);
        if saturated > MOST_SATURATED {
            return Err(Error::Unanswerable(format!(
                "{:.0} % of the sphere is saturated; expose it less",
                100.0 * saturated
            )));
        }
        let camera = match self.focal {
            // The outline is seen under the angle whose tangent is r/f.
            Some(focal) => {
                let distance = focal.hypot(circle.radius) / circle.radius;
                Camera::perspective(DVec3::Z, DVec3::Y, distance)?
            }
            None => Camera::orthographic(DVec3::Z, DVec3::Y)?,
        };
        let image = SphereImage::new(camera, size, pixels)?;
        let mean = Luminance::Rec709.of(image.mean());
        if mean.is_nan() || mean <= 0.0 {
            return Err(Error::Unanswerable(
                "the sphere is black; expose it more".into(),
            ));
        }
        Ok((image, saturated))
    }

    /// Bilinear, with the picture's edge continued, and whether the nearest pixel is saturated.
    fn at(&self, x: f64, y: f64) -> ([f64; 3], bool) {
        let clamp = |v: f64, length: usize| v.clamp(0.0, (length - 1) as f64);
        let (x, y) = (clamp(x - 0.5, self.width), clamp(y - 0.5, self.height));
        let (column, row) = (x.floor() as usize, y.floor() as usize);
        let (fx, fy) = (x - column as f64, y - row as f64);
        let mut sum = [0.0; 3];
        for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
            for (dx, wx) in [(0, 1.0 - fx), (1, fx)] {
                let i = (row + dy).min(self.height - 1) * self.width
                    + (column + dx).min(self.width - 1);
                for channel in 0..3 {
                    sum[channel] += wx * wy * self.pixels[i][channel];
                }
            }
        }
        let nearest = (y + 0.5).floor() as usize * self.width + (x + 0.5).floor() as usize;
        (sum, self.saturated.get(nearest).copied().unwrap_or(false))
    }
}

/// The focal length on film of 36 × 24 mm that EXIF gives, in millimetres.
fn focal_length_on_film(raw: Vec<u8>) -> Option<f64> {
    let exif = exif::Reader::new().read_raw(raw).ok()?;
    let field = exif.get_field(exif::Tag::FocalLengthIn35mmFilm, exif::In::PRIMARY)?;
    let value = f64::from(field.value.get_uint(0)?);
    (value > 0.0).then_some(value)
}

/// The gradient of log luminance of a picture made smaller.
struct Gradient {
    width: usize,
    height: usize,
    scale: usize,
    /// (d/dx, d/dy).
    field: Vec<(f64, f64)>,
    /// What the strongest tenth passes.
    strong: f64,
}

impl Gradient {
    /// The least score, as a share of a strong gradient all along the circle, that counts as a sphere. Chance finds circles of 0.54 in
    /// noise; balls before a wall have 0.9 and more, and a fainter one has to be pointed out.
    const LEAST_SCORE: f64 = 0.7;

    fn new(photo: &Photo, scale: usize) -> Self {
        let (width, height) = (photo.width / scale, photo.height / scale);
        let mut log = vec![0.0; width * height];
        let mut mean = 0.0;
        for (i, value) in log.iter_mut().enumerate() {
            let (row, column) = (i / width * scale, i % width * scale);
            for y in row..row + scale {
                for x in column..column + scale {
                    let at = y * photo.width + x;
                    let inside = photo.mask.as_ref().is_none_or(|mask| mask[at]);
                    if inside {
                        *value += Luminance::Rec709.of(photo.pixels[at]).max(0.0);
                    }
                }
            }
            mean += *value;
        }
        mean /= (width * height).max(1) as f64;
        for value in &mut log {
            *value = (*value + 0.05 * mean + 1e-12).ln();
        }
        let at = |x: isize, y: isize| {
            let x = x.clamp(0, width as isize - 1) as usize;
            let y = y.clamp(0, height as isize - 1) as usize;
            log[y * width + x]
        };
        let field: Vec<(f64, f64)> = (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as isize, (i / width) as isize);
                let dx = at(x + 1, y) - at(x - 1, y);
                let dy = at(x, y + 1) - at(x, y - 1);
                (0.5 * dx, 0.5 * dy)
            })
            .collect();
        let mut sizes: Vec<f64> = field.iter().map(|(x, y)| x.hypot(*y)).collect();
        sizes.sort_by(f64::total_cmp);
        let strong = sizes[(0.9 * (sizes.len() - 1) as f64) as usize].max(0.02);
        Self {
            width,
            height,
            scale,
            field,
            strong,
        }
    }

    /// The mean over the circle of the gradient across it, over what is strong.
    fn score(&self, circle: Circle) -> f64 {
        const SAMPLES: usize = 72;
        let mut sum = 0.0;
        for i in 0..SAMPLES {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / SAMPLES as f64).sin_cos();
            let (x, y) = (
                circle.x + circle.radius * cos,
                circle.y + circle.radius * sin,
            );
            let column = (x.floor().max(0.0) as usize).min(self.width - 1);
            let row = (y.floor().max(0.0) as usize).min(self.height - 1);
            let (dx, dy) = self.field[row * self.width + column];
            sum += (dx * cos + dy * sin).abs().min(self.strong);
        }
        sum / (SAMPLES as f64 * self.strong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};

    /// A value at a place that no one can predict, on [0, 1].
    fn hash(x: u64, y: u64) -> f64 {
        let mut h = x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        h ^= h >> 29;
        h = h.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (h >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A shaded ball before a wall with blocks of random brightness.
    fn ball(width: usize, height: usize, circle: Circle) -> Photo {
        let pixels: Vec<[f64; 3]> = (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
                let (u, v) = (
                    (x - circle.x) / circle.radius,
                    (y - circle.y) / circle.radius,
                );
                if u * u + v * v < 1.0 {
                    let z = (1.0 - u * u - v * v).sqrt();
                    [0.05 + 0.9 * (0.5 * z - 0.6 * v + 0.3 * u).max(0.0); 3]
                } else {
                    [0.1 + 0.25 * hash((x / 24.0) as u64, (y / 24.0) as u64); 3]
                }
            })
            .collect();
        Photo {
            width,
            height,
            saturated: vec![false; pixels.len()],
            pixels,
            mask: None,
            encoded: false,
            focal: None,
        }
    }

    #[test]
    fn finds_a_ball() {
        for (x, y, radius) in [
            (150.0, 120.0, 80.0),
            (230.0, 140.0, 45.0),
            (100.0, 100.0, 99.0),
        ] {
            let truth = Circle { x, y, radius };
            let found = ball(320, 240, truth).find_circle().unwrap();
            let off = (found.x - x)
                .hypot(found.y - y)
                .max((found.radius - radius).abs());
            assert!(off < 0.03 * radius + 1.0, "{found:?} for {truth:?}");
        }
    }

    #[test]
    fn finds_no_ball_where_there_is_none() {
        let truth = Circle {
            x: 160.0,
            y: 120.0,
            radius: 60.0,
        };
        let mut photo = ball(320, 240, truth);
        for (i, pixel) in photo.pixels.iter_mut().enumerate() {
            *pixel = [hash(i as u64, 7); 3];
        }
        assert!(photo.find_circle().is_err(), "noise");
        photo.pixels.fill([0.5; 3]);
        assert!(photo.find_circle().is_err(), "flat");
    }

    #[test]
    fn a_sphere_is_the_mean_of_what_it_covers() {
        let circle = Circle {
            x: 100.0,
            y: 100.0,
            radius: 64.0,
        };
        let mut photo = ball(200, 200, circle);
        // 1 on the left, 3 on the right.
        for (i, pixel) in photo.pixels.iter_mut().enumerate() {
            *pixel = [if i % 200 < 100 { 1.0 } else { 3.0 }; 3];
        }
        let (image, saturated) = photo.sphere(circle, 32).unwrap();
        assert_eq!(saturated, 0.0);
        assert_eq!(image.get(16, 4), Some([1.0; 3]));
        assert_eq!(image.get(16, 28), Some([3.0; 3]));
        assert!(image.camera().distance().is_none());
        // The circle may not leave the picture, nor be tiny.
        for (x, radius) in [(60.0, 64.0), (100.0, 120.0), (100.0, 4.0)] {
            let circle = Circle {
                x,
                y: 100.0,
                radius,
            };
            assert!(photo.sphere(circle, 32).is_err());
        }
        photo.saturated.fill(true);
        let message = photo.sphere(circle, 32).unwrap_err().to_string();
        assert!(message.contains("saturated"), "{message}");
        photo.saturated.fill(false);
        photo.pixels.fill([0.0; 3]);
        let message = photo.sphere(circle, 32).unwrap_err().to_string();
        assert!(message.contains("black"), "{message}");
    }

    #[test]
    fn a_mask_tells_where_the_sphere_is() {
        let truth = Circle {
            x: 60.5,
            y: 40.25,
            radius: 30.0,
        };
        let mut photo = ball(120, 90, truth);
        let inside = |i: usize| {
            let (x, y) = ((i % 120) as f64 + 0.5, (i / 120) as f64 + 0.5);
            (x - truth.x).hypot(y - truth.y) < truth.radius
        };
        photo.mask = Some((0..120 * 90).map(inside).collect());
        let circle = photo.masked_circle().unwrap().unwrap();
        assert!((circle.x - truth.x).abs() < 0.1 && (circle.y - truth.y).abs() < 0.1);
        assert!((circle.radius - truth.radius).abs() < 0.1);
        photo.mask = Some((0..120 * 90).map(|i| i % 120 < 60).collect());
        assert!(
            photo.masked_circle().is_err(),
            "half the picture is no disc"
        );
        photo.mask = Some(vec![false; 120 * 90]);
        assert!(photo.masked_circle().is_err());
    }

    fn on_disk(bytes: &[u8]) -> Photo {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        Photo::read(file.path()).unwrap()
    }

    #[test]
    fn codes_are_decoded_and_the_last_ones_are_saturated() {
        let mut bytes = Vec::new();
        let codes: [u16; 6] = [0, 0x8000, 0x4000, 0xffff, 1000, 2000];
        let raw: Vec<u8> = codes.iter().flat_map(|c| c.to_ne_bytes()).collect();
        PngEncoder::new(&mut bytes)
            .write_image(&raw, 2, 1, ExtendedColorType::Rgb16)
            .unwrap();
        let photo = on_disk(&bytes);
        let half = linear_of_srgb(f64::from(0x8000u16) / 65535.0);
        assert!((photo.pixels[0][1] - half).abs() < 1e-12);
        assert_eq!(photo.saturated, [false, true]);
        assert!(photo.encoded && photo.mask.is_none());
    }

    /// A little TIFF of one entry: FocalLengthIn35mmFilm (0xa405), a short, in the EXIF directory.
    #[test]
    fn exif_tells_the_focal_length() {
        let mut exif = b"II*\0\x08\0\0\0".to_vec();
        exif.extend([1, 0, 0x69, 0x87, 4, 0, 1, 0, 0, 0, 26, 0, 0, 0, 0, 0, 0, 0]);
        exif.extend([1, 0, 0x05, 0xa4, 3, 0, 1, 0, 0, 0, 50, 0, 0, 0, 0, 0, 0, 0]);
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif).unwrap();
        encoder
            .write_image(&[100; 3 * 60 * 40], 60, 40, ExtendedColorType::Rgb8)
            .unwrap();
        let photo = on_disk(&bytes);
        // 36 mm of film are 60 pixels.
        assert!((photo.focal.unwrap() - 50.0 / 36.0 * 60.0).abs() < 1e-9);
        let circle = Circle {
            x: 30.0,
            y: 20.0,
            radius: 15.0,
        };
        let (image, _) = photo.sphere(circle, 16).unwrap();
        let distance = image.camera().distance().unwrap();
        // sin of half the angle is 1/distance, tan is r/f.
        assert!(((1.0 / distance).asin().tan() - 15.0 / (50.0 / 36.0 * 60.0)).abs() < 1e-12);
    }
}
