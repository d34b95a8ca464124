//! Pictures of codes, PNG, JPEG, WebP and TIFF: what their codes mean.

use moxcms::{ColorProfile, DataColorSpace, ToneCurveEvaluator, ToneReprCurve};
use nalgebra::Matrix3;

use super::primaries::{Primaries, ToRec709};
use super::raster::{Codes, Layout, Raster};
use super::{Problem, linear_of_srgb};

/// What a PNG, JPEG, WebP or TIFF holds.
pub(crate) struct Coded {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Pixels,
    /// How much alpha leaves of each pixel.
    pub(crate) mask: Option<Vec<f32>>,
    pub(crate) said: Said,
}

/// Pixels as they are stored; their radiance is that of Rec. 709.
pub(crate) enum Pixels {
    /// The largest code of a channel is 1, before other primaries are converted.
    Codes {
        raster: Raster,
        /// The linear value of a code of 252/255.
        ceiling: f64,
    },
    /// Floats.
    Radiance(Vec<[f64; 3]>),
}

/// What EXIF says of a picture; 0 is nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Said {
    /// How it is to be turned, 1 … 8.
    pub(crate) orientation: u32,
    /// The focal length in millimetres, on film of 36 × 24 mm.
    pub(crate) focal_length_on_film: u32,
    /// Whether a gain map comes with it, by which bright places are brighter than it shows.
    pub(crate) has_gain_map: bool,
}

impl Said {
    /// By EXIF as it stands in a file: a TIFF, in some files after its name.
    pub(super) fn of_exif(raw: &[u8]) -> Self {
        let raw = raw.strip_prefix(b"Exif\0\0").unwrap_or(raw);
        let Ok(exif) = exif::Reader::new().read_raw(raw.to_vec()) else {
            return Self::default();
        };
        let number = |tag| {
            let field = exif.get_field(tag, exif::In::PRIMARY);
            field.and_then(|field| field.value.get_uint(0)).unwrap_or(0)
        };
        Self {
            orientation: number(exif::Tag::Orientation),
            focal_length_on_film: number(exif::Tag::FocalLengthIn35mmFilm),
            has_gain_map: false,
        }
    }
}

/// JPEG smears the last few codes: from this one on a pixel counts as saturated.
const SATURATED: f64 = 252.0 / 255.0;

/// How a code on [0, 1] becomes a linear value.
pub(super) enum Curve {
    Srgb,
    Linear,
    /// The code to this power.
    Power(f64),
    /// ITU-R BT.709's camera, inverted.
    Camera709,
    /// An ICC profile's, of red, green and blue.
    Profile(Box<[Evaluator; 3]>),
}

type Evaluator = Box<dyn ToneCurveEvaluator + Send + Sync>;

/// What the codes of a file mean.
pub(super) struct Space {
    pub(super) curve: Curve,
    /// Nothing for Rec. 709.
    pub(super) to_rec709: Option<ToRec709>,
}

impl Space {
    pub(super) const SRGB: Self = Self {
        curve: Curve::Srgb,
        to_rec709: None,
    };

    /// Linear Rec. 709.
    pub(super) const LINEAR: Self = Self {
        curve: Curve::Linear,
        to_rec709: None,
    };

    /// A curve and primaries.
    pub(super) fn of(curve: Curve, primaries: Primaries) -> Result<Self, Problem> {
        Ok(Self {
            curve,
            to_rec709: primaries.to_rec709()?,
        })
    }

    /// Those of an ICC profile that says red, green and blue by three curves and a matrix, or grey
    /// by one.
    pub(super) fn of_profile(bytes: &[u8], grey: bool) -> Result<Self, Problem> {
        let refused = |what: &str| {
            Problem::new(
                format!("the picture's ICC profile {what}"),
                "convert the picture to sRGB, for example in an image editor or with ImageMagick's -profile sRGB.icc",
            )
        };
        let profile = ColorProfile::new_from_slice(bytes)
            .map_err(|error| refused(&format!("cannot be read ({error})")))?;
        let evaluator = |curve: &Option<ToneReprCurve>| {
            curve
                .as_ref()
                .and_then(|curve| curve.make_linear_evaluator().ok())
                .ok_or_else(|| refused("has no curve of each channel"))
        };
        let (curve, to_rec709) = match profile.color_space {
            DataColorSpace::Gray if grey => {
                let curve = || evaluator(&profile.gray_trc);
                ([curve()?, curve()?, curve()?], None)
            }
            DataColorSpace::Rgb if profile.is_matrix_shaper() => {
                let rows = profile.colorant_matrix().v;
                let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
                if matrix.try_inverse().is_none() {
                    return Err(refused("has a matrix without an inverse"));
                }
                let curves = [
                    evaluator(&profile.red_trc)?,
                    evaluator(&profile.green_trc)?,
                    evaluator(&profile.blue_trc)?,
                ];
                (curves, Some(ToRec709::of_xyz(matrix)))
            }
            other => {
                return Err(refused(&format!(
                    "is of {other:?} colours by tables, where curves and a matrix of red, green and blue are read"
                )));
            }
        };
        // sRGB's own profiles round its curve and its matrix.
        let close = |a: f64, b: f64| (a - b).abs() <= 2e-3;
        let is_srgb = to_rec709.is_none_or(|matrix| matrix.is_none_within(2e-3))
            && (0..=16).map(|i| f64::from(i) / 16.0).all(|code| {
                curve.iter().all(|c| {
                    close(
                        f64::from(c.evaluate_value(code as f32)),
                        linear_of_srgb(code),
                    )
                })
            });
        if is_srgb {
            return Ok(Self::SRGB);
        }
        Ok(Self {
            curve: Curve::Profile(Box::new(curve)),
            to_rec709,
        })
    }

    /// The linear values of a code of red, green and blue.
    fn linear(&self, code: f64) -> [f64; 3] {
        match &self.curve {
            Curve::Srgb => [linear_of_srgb(code); 3],
            Curve::Linear => [code; 3],
            Curve::Power(exponent) => [code.powf(*exponent); 3],
            Curve::Camera709 if code < 0.081 => [code / 4.5; 3],
            Curve::Camera709 => [((code + 0.099) / 1.099).powf(1.0 / 0.45); 3],
            Curve::Profile(curves) => {
                std::array::from_fn(|c| f64::from(curves[c].evaluate_value(code as f32)))
            }
        }
    }

    /// A picture of floats, which are linear: only a profile whose curve is none is heeded.
    pub(super) fn radiance(
        &self,
        [width, height]: [usize; 2],
        mut pixels: Vec<[f64; 3]>,
        mask: Option<Vec<f32>>,
    ) -> Result<Coded, Problem> {
        let bent = |code: f64| self.linear(code).iter().any(|v| (v - code).abs() > 2e-3);
        if (0..=16).any(|i| bent(f64::from(i) / 16.0)) {
            return Err(Problem::new(
                "the picture is of floats, and its ICC profile says that they are not linear",
                "store it with a linear profile, or as 16 bits",
            ));
        }
        if let Some(matrix) = &self.to_rec709 {
            for rgb in &mut pixels {
                *rgb = matrix.apply(*rgb);
            }
        }
        Ok(Coded {
            width,
            height,
            pixels: Pixels::Radiance(pixels),
            mask,
            said: Said::default(),
        })
    }

    /// A picture of the size, of codes.
    pub(super) fn picture(
        &self,
        [width, height]: [usize; 2],
        codes: Codes,
        mask: Option<Vec<f32>>,
    ) -> Coded {
        let most = codes.most();
        let table = (0..=most).map(|code| self.linear(f64::from(code) / f64::from(most)));
        Coded {
            width,
            height,
            pixels: Pixels::Codes {
                raster: Raster {
                    codes,
                    table: table.collect(),
                    to_rec709: self.to_rec709,
                },
                ceiling: self.linear(SATURATED).into_iter().fold(1.0, f64::min),
            },
            mask,
            said: Said::default(),
        }
    }

    /// [`picture`](Self::picture), of bytes that follow each other as they like.
    pub(super) fn of_bytes(&self, size: [usize; 2], layout: Layout, samples: Vec<u8>) -> Coded {
        let mask = layout.mask(&samples, u8::MAX);
        let codes = if layout.is_colours() {
            samples
        } else {
            layout.colours(&samples)
        };
        self.picture(size, Codes::Eight(codes), mask)
    }

    /// [`of_bytes`](Self::of_bytes), of sixteen bits.
    pub(super) fn of_words(&self, size: [usize; 2], layout: Layout, samples: &[u16]) -> Coded {
        let mask = layout.mask(samples, u16::MAX);
        self.picture(size, Codes::Sixteen(layout.colours(samples)), mask)
    }
}
