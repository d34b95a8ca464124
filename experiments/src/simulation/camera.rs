//! What a camera makes of light: exposure, a tone curve, sharpening, noise, JPEG.

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageFormat};

use super::draw::Draw;
use super::nuisances::Nuisances;
use lobes::files::srgb_of_linear;
use lobes::illumination::Luminance;

/// A camera.
#[derive(Debug, Clone)]
pub(super) struct Camera {
    white_balance: [f64; 3],
    saturation: f64,
    /// What the mean of the ball is exposed to.
    exposure: f64,
    contrast: f64,
    toe: f64,
    shoulder: f64,
    vignetting: f64,
    blur: f64,
    local: f64,
    sharpening: f64,
    chroma_blur: f64,
    noise: f64,
    shot: f64,
    quality: Option<u8>,
    grey: bool,
}

impl Camera {
    pub(super) fn draw(nuisances: Nuisances, draw: &mut Draw) -> Self {
        let any = Self::any(draw);
        if nuisances.camera {
            any
        } else {
            Self {
                exposure: any.exposure,
                ..Self::PLAIN
            }
        }
    }

    /// sRGB as the standard has it.
    const PLAIN: Self = Self {
        white_balance: [1.0; 3],
        saturation: 1.0,
        exposure: 0.22,
        contrast: 1.0,
        toe: 0.0,
        shoulder: 0.0,
        vignetting: 0.0,
        blur: 0.0,
        local: 0.0,
        sharpening: 0.0,
        chroma_blur: 0.0,
        noise: 0.0,
        shot: 0.0,
        quality: None,
        grey: false,
    };

    fn any(draw: &mut Draw) -> Self {
        let warm = 0.08 * draw.normal();
        let green = 0.03 * draw.normal();
        let noisy = draw.chance(0.5);
        Self {
            white_balance: [warm.exp(), green.exp(), (-warm).exp()],
            saturation: if draw.chance(0.5) {
                draw.log_between(0.7, 1.6)
            } else {
                1.0
            },
            exposure: 0.22 * (0.8 * draw.normal()).clamp(-2.0, 2.0).exp2(),
            contrast: if draw.chance(0.6) {
                draw.between(0.8, 1.8)
            } else {
                1.0
            },
            toe: if draw.chance(0.3) {
                draw.between(0.0, 0.03)
            } else {
                0.0
            },
            shoulder: if draw.chance(0.5) {
                draw.between(0.0, 1.0)
            } else {
                0.0
            },
            vignetting: if draw.chance(0.3) {
                draw.between(0.0, 0.4)
            } else {
                0.0
            },
            blur: if draw.chance(0.6) {
                draw.log_between(0.3, 1.6)
            } else {
                0.0
            },
            local: if draw.chance(0.3) {
                draw.between(0.0, 0.5)
            } else {
                0.0
            },
            sharpening: if draw.chance(0.5) {
                draw.between(0.0, 1.2)
            } else {
                0.0
            },
            chroma_blur: if draw.chance(0.6) { 1.0 } else { 0.0 },
            noise: if noisy {
                draw.log_between(5e-4, 0.02)
            } else {
                0.0
            },
            shot: if noisy {
                draw.log_between(1e-5, 1e-3)
            } else {
                0.0
            },
            quality: draw.chance(0.8).then(|| draw.between(55.0, 98.0) as u8),
            grey: draw.chance(0.04),
        }
    }

    /// The light that is just past white, over the mean of the ball.
    pub(super) fn white(&self) -> f64 {
        1.3 / self.exposure
    }

    /// 8-bit codes of a square picture of light whose ball has the mean luminance `mean`.
    pub(super) fn take(
        &self,
        side: usize,
        light: &mut [[f64; 3]],
        mean: f64,
        draw: &mut Draw,
    ) -> Vec<u8> {
        let exposure = self.exposure / mean;
        let half = 0.5 * side as f64;
        for (i, rgb) in light.iter_mut().enumerate() {
            let (x, y) = (
                (i % side) as f64 + 0.5 - half,
                (i / side) as f64 + 0.5 - half,
            );
            let shade = exposure * (1.0 - self.vignetting * (x * x + y * y) / (2.0 * half * half));
            for c in 0..3 {
                rgb[c] = (rgb[c] * shade * self.white_balance[c]).min(8.0);
            }
        }
        if self.blur > 0.0 {
            blur(light, side, self.blur);
        }
        let curve = Curve::of(self);
        let noisy = self.noise > 0.0 || self.shot > 0.0;
        for rgb in light.iter_mut() {
            for value in rgb.iter_mut().filter(|_| noisy) {
                let v = value.max(0.0);
                *value = v + draw.normal() * (self.noise * self.noise + self.shot * v).sqrt();
            }
            let y = Luminance::Rec709.of(*rgb);
            for c in 0..3 {
                let v = y + self.saturation * (rgb[c] - y);
                let v = if self.grey { y } else { v };
                rgb[c] = curve.at(v);
            }
        }
        if self.local > 0.0 || self.sharpening > 0.0 {
            let luminance: Vec<[f64; 3]> = light
                .iter()
                .map(|v| [Luminance::Rec709.of(*v); 3])
                .collect();
            if self.local > 0.0 {
                let mut wide = luminance.clone();
                blur(&mut wide, side, 0.12 * side as f64);
                for (rgb, wide) in light.iter_mut().zip(&wide) {
                    let gain = (0.45 / wide[0].max(0.05)).powf(0.6 * self.local);
                    *rgb = rgb.map(|v| v * gain);
                }
            }
            if self.sharpening > 0.0 {
                let mut soft = luminance.clone();
                blur(&mut soft, side, 1.0);
                for (i, rgb) in light.iter_mut().enumerate() {
                    let more = self.sharpening * (luminance[i][0] - soft[i][0]);
                    *rgb = rgb.map(|v| v + more);
                }
            }
        }
        if self.chroma_blur > 0.0 {
            let luma = |rgb: &[f64; 3]| 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
            let mut soft: Vec<[f64; 3]> = light
                .iter()
                .map(|rgb| {
                    let y = luma(rgb);
                    rgb.map(|v| v - y)
                })
                .collect();
            blur(&mut soft, side, 0.8 * self.chroma_blur);
            for (rgb, soft) in light.iter_mut().zip(&soft) {
                let y = luma(rgb);
                *rgb = soft.map(|v| v + y);
            }
        }
        let codes: Vec<u8> = light
            .iter()
            .flatten()
            .map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8)
            .collect();
        let Some(quality) = self.quality else {
            return codes;
        };
        let mut jpeg = Vec::new();
        let n = side as u32;
        if JpegEncoder::new_with_quality(&mut jpeg, quality)
            .encode(&codes, n, n, ExtendedColorType::Rgb8)
            .is_err()
        {
            return codes;
        }
        match image::load_from_memory_with_format(&jpeg, ImageFormat::Jpeg) {
            Ok(decoded) => decoded.into_rgb8().into_raw(),
            Err(_) => codes,
        }
    }

    /// A code on 0 … 1 of light.
    fn curve(&self, v: f64) -> f64 {
        let v = v.max(0.0);
        // A shoulder: highlights are drawn together.
        let v = v / (1.0 + self.shoulder * 0.5 * v) * (1.0 + self.shoulder * 0.5);
        let v = (v - self.toe).max(0.0) / (1.0 - self.toe);
        let code = srgb_of_linear(v.min(1.0));
        // An S about the middle.
        if self.contrast == 1.0 {
            return code;
        }
        let s = |t: f64| {
            t.powf(self.contrast)
                / (t.powf(self.contrast) + (1.0 - t).powf(self.contrast)).max(1e-9)
        };
        s(code)
    }
}

/// A camera's curve, looked up: linear between so many roots of light, to a few 10⁻⁵.
struct Curve([f64; Self::STEPS + 2]);

impl Curve {
    const STEPS: usize = 1024;

    fn of(camera: &Camera) -> Self {
        Self(std::array::from_fn(|i| {
            let root = i as f64 / Self::STEPS as f64;
            camera.curve(root * root)
        }))
    }

    /// The code of light; all of 1 and more is white.
    fn at(&self, light: f64) -> f64 {
        let place = light.clamp(0.0, 1.0).sqrt() * Self::STEPS as f64;
        let i = place as usize;
        self.0[i] + (self.0[i + 1] - self.0[i]) * (place - i as f64)
    }
}

/// Gaussian blur, three boxes in each direction.
pub(super) fn blur(pixels: &mut [[f64; 3]], side: usize, sigma: f64) {
    let radius = if sigma < 2.0 {
        (3.0 * sigma).ceil() as usize
    } else {
        (2.5 * sigma).ceil() as usize
    };
    let step = (radius / 12).max(1);
    let taps: Vec<(isize, f64)> = (-(radius as isize)..=radius as isize)
        .step_by(step)
        .map(|k| (k, (-0.5 * (k as f64 / sigma).powi(2)).exp()))
        .collect();
    let total: f64 = taps.iter().map(|(_, w)| w).sum();
    let mut other = vec![[0.0; 3]; pixels.len()];
    for across in [true, false] {
        for (i, out) in other.iter_mut().enumerate() {
            let (row, column) = (i / side, i % side);
            let mut sum = [0.0; 3];
            for (k, w) in &taps {
                let clamp = |v: usize| (v as isize + k).clamp(0, side as isize - 1) as usize;
                let at = if across {
                    row * side + clamp(column)
                } else {
                    clamp(row) * side + column
                };
                for c in 0..3 {
                    sum[c] += w * pixels[at][c];
                }
            }
            *out = sum.map(|v| v / total);
        }
        pixels.copy_from_slice(&other);
    }
}
