//! The environment map: light from every direction, as pixels and as a function.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::{Error, Result};

/// Light that comes from infinitely far away, as a function of the direction that it comes from.
///
/// The pixels are a latitude-longitude panorama in the world frame (y up): row 0 is the zenith, the
/// centre column looks along −z, and +x is to its right, as it looks from inside. Each pixel is
/// linear red, green and blue radiance, in arbitrary units.
///
/// **The function.** What a direction sees is interpolated bilinearly between the centres of pixels, in angle:
/// with θ the angle from the zenith and α the azimuth from −z towards +x, the centre of pixel (r,
/// c) of an h × w map is at θ = π(r + ½)/h, α = 2π((c + ½)/w − ½). Columns are periodic. Beyond a
/// pole, between the first row's centres and the zenith, the neighbour is the same row half a turn
/// round, which is where the great circle goes. Every integral of an environment map in this crate
/// is of this function, [`EnvironmentMap::radiance`], but for [`EnvironmentMap::coefficients`],
/// which takes the pixels as samples of a band-limited field: interpolation lowers the amplitudes
/// of degree l by up to 1 − sinc²(l/2h), 5 % at l = h/4.
///
/// ```
/// use lobes::{glam::DVec3, illumination::EnvironmentMap};
/// // A lamp straight ahead, and darkness.
/// let mut pixels = vec![[0.0; 3]; 8 * 4];
/// pixels[8 + 3] = [1.0, 0.5, 0.25];
/// let map = EnvironmentMap::new("lamp", 8, 4, pixels)?;
/// let towards = map.direction(1, 3);
/// assert!(towards.z < 0.0 && towards.y > 0.0);
/// assert!((map.radiance(towards)[0] - 1.0).abs() < 1e-14);
/// assert_eq!(map.radiance(DVec3::Z), [0.0; 3]);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentMap {
    name: String,
    width: usize,
    height: usize,
    pixels: Vec<[f64; 3]>,
}

impl EnvironmentMap {
    /// A map of `width` by `height` pixels, row 0 first, each row from the left.
    ///
    /// # Errors
    ///
    /// [`Error::Domain`] unless the width is twice the height and the height even and at least 2;
    /// [`Error::Length`] when `pixels` does not fit it; [`Error::NotFinite`] and [`Error::Domain`]
    /// when a value is not finite, is negative, or all are zero.
    pub fn new(
        name: impl Into<String>,
        width: usize,
        height: usize,
        pixels: Vec<[f64; 3]>,
    ) -> Result<Self> {
        if !(2..=1 << 20).contains(&height) {
            return Err(Error::Domain {
                what: "the height of an environment map",
                value: height as f64,
                allowed: "from 2 to 2^20 pixels",
            });
        }
        if width != 2 * height {
            return Err(Error::Domain {
                what: "the width over the height of an environment map",
                value: width as f64 / height as f64,
                allowed: "2, as a latitude-longitude map has it",
            });
        }
        crate::error::check_length("the environment map", width * height, pixels.len())?;
        let values = pixels.as_flattened();
        crate::error::check_finite("the environment map", values)?;
        if let Some(&value) = values.iter().find(|value| **value < 0.0) {
            return Err(Error::Domain {
                what: "a radiance of the environment map",
                value,
                allowed: "zero or above; negative light comes from resampling filters and must be set to zero",
            });
        }
        if values.iter().all(|value| *value == 0.0) {
            return Err(Error::Domain {
                what: "every radiance of the environment map",
                value: 0.0,
                allowed: "above zero anywhere; a map must hold some light",
            });
        }
        Ok(Self {
            name: name.into(),
            width,
            height,
            pixels,
        })
    }

    /// What the map is called: for one read from a file, the file's name without its extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Columns: the pixels round the horizon.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows: the pixels from the zenith to the nadir.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row 0 first, each row from the left.
    pub fn pixels(&self) -> &[[f64; 3]] {
        &self.pixels
    }

    /// One pixel.
    ///
    /// # Panics
    ///
    /// When the row or the column is outside the map: [`get`](Self::get) says so.
    pub fn pixel(&self, row: usize, column: usize) -> [f64; 3] {
        assert!(column < self.width, "column {column} of {}", self.width);
        self.pixels[row * self.width + column]
    }

    /// [`pixel`](Self::pixel), or nothing where the row or the column is outside the map.
    ///
    /// ```
    /// # let map = lobes::illumination::EnvironmentMap::new("grey", 8, 4, vec![[1.0; 3]; 32])?;
    /// assert_eq!(map.get(3, 7), Some([1.0; 3]));
    /// assert_eq!((map.get(3, 8), map.get(4, 0)), (None, None));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn get(&self, row: usize, column: usize) -> Option<[f64; 3]> {
        (row < self.height && column < self.width).then(|| self.pixel(row, column))
    }

    /// The world direction of the centre of a pixel.
    pub fn direction(&self, row: usize, column: usize) -> DVec3 {
        let (sin_theta, cos_theta) = (PI * (row as f64 + 0.5) / self.height as f64).sin_cos();
        let (sin, cos) = (TAU * ((column as f64 + 0.5) / self.width as f64 - 0.5)).sin_cos();
        DVec3::new(sin_theta * sin, cos_theta, -sin_theta * cos)
    }

    /// The solid angle of a pixel of a row, in steradians: (2π/w) (cos(πr/h) − cos(π(r+1)/h)).
    ///
    /// ```
    /// # let map = lobes::illumination::EnvironmentMap::new("grey", 64, 32, vec![[1.0; 3]; 64 * 32])?;
    /// let sum: f64 = (0..map.height()).map(|row| map.solid_angle(row) * map.width() as f64).sum();
    /// assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-13);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn solid_angle(&self, row: usize) -> f64 {
        // The difference of the cosines as a product, which does not cancel at the poles.
        let step = PI / self.height as f64;
        TAU / self.width as f64 * 2.0 * (step * (row as f64 + 0.5)).sin() * (0.5 * step).sin()
    }

    /// The radiance that comes from a unit direction: the function that the type stands for.
    ///
    /// The direction need not be of length one; a zero vector gives the zenith.
    pub fn radiance(&self, direction: DVec3) -> [f64; 3] {
        let (w, h) = (self.width, self.height);
        let theta = direction.x.hypot(direction.z).atan2(direction.y);
        let azimuth = direction.x.atan2(-direction.z);
        let row = theta * (h as f64 / PI) - 0.5;
        let column = (azimuth * (w as f64 / TAU) + (w as f64 / 2.0 - 0.5)).rem_euclid(w as f64);
        let (row_floor, column_floor) = (row.floor(), column.floor());
        let (fy, fx) = (row - row_floor, column - column_floor);
        // Rounding can put a column at w itself.
        let left = column_floor as usize % w;
        let right = (left + 1) % w;
        let above = self.row(row_floor as isize);
        let below = self.row(row_floor as isize + 1);
        let at =
            |(start, turn): (usize, usize), column: usize| self.pixels[start + (column + turn) % w];
        let corners = [
            (at(above, left), (1.0 - fy) * (1.0 - fx)),
            (at(above, right), (1.0 - fy) * fx),
            (at(below, left), fy * (1.0 - fx)),
            (at(below, right), fy * fx),
        ];
        let mut sum = [0.0; 3];
        for (pixel, weight) in corners {
            for (total, value) in sum.iter_mut().zip(pixel) {
                *total += weight * value;
            }
        }
        sum
    }

    /// Where a row starts among the pixels, and by how many columns to turn it: beyond a pole, the
    /// same row half a turn round.
    fn row(&self, row: isize) -> (usize, usize) {
        if row < 0 {
            (0, self.width / 2)
        } else if row as usize >= self.height {
            ((self.height - 1) * self.width, self.width / 2)
        } else {
            (row as usize * self.width, 0)
        }
    }

    /// The mean radiance over the sphere, of the function [`radiance`](Self::radiance): exact but
    /// for rounding.
    ///
    /// ```
    /// # use lobes::illumination::EnvironmentMap;
    /// let map = EnvironmentMap::new("grey", 64, 32, vec![[0.5, 1.0, 2.0]; 64 * 32])?;
    /// assert!((map.mean()[2] - 2.0).abs() < 1e-14);
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn mean(&self) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for (row, pixels) in self.pixels.chunks_exact(self.width).enumerate() {
            let weight = 0.5 * self.row_weight(row) / self.width as f64;
            let mut sum = [0.0; 3];
            for pixel in pixels {
                for (total, value) in sum.iter_mut().zip(pixel) {
                    *total += value;
                }
            }
            for (total, value) in mean.iter_mut().zip(sum) {
                *total += weight * value;
            }
        }
        mean
    }

    /// The integral over θ of what a row contributes to the azimuthal mean, weighed by sin θ: the
    /// rows' sum to 2.
    fn row_weight(&self, row: usize) -> f64 {
        let step = PI / self.height as f64;
        if row == 0 || row + 1 == self.height {
            // The mean round the axis does not see the half turn: the row alone from the pole to
            // its centre, then its falling half hat. ∫₀^(s/2) sin θ dθ + ∫_(s/2)^(3s/2) (3/2 − θ/s)
            // sin θ dθ.
            1.0 - ((1.5 * step).sin() - (0.5 * step).sin()) / step
        } else {
            // ∫ (1 − |θ − θ_r|/s) sin θ dθ.
            let sine = (0.5 * step).sin();
            4.0 * (step * (row as f64 + 0.5)).sin() * sine * sine / step
        }
    }

    /// The luminance of each pixel, in the order of [`pixels`](Self::pixels).
    pub fn luminance(&self, weights: Luminance) -> Vec<f64> {
        self.pixels.iter().map(|pixel| weights.of(*pixel)).collect()
    }
}

/// What red, green and blue weigh in luminance.
///
/// ```
/// use lobes::illumination::Luminance;
/// assert_eq!(Luminance::Rec709.of([1.0, 0.0, 0.0]), 0.2126);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Luminance {
    /// ITU-R BT.709: 0.2126, 0.7152, 0.0722.
    #[default]
    Rec709,
    /// Radiance's own primaries and its equal-energy white (`CIE_rf` … in its `color.h`): 0.2651,
    /// 0.6701, 0.0648.
    Radiance,
}

impl Luminance {
    /// The three weights, which sum to one.
    pub fn weights(self) -> [f64; 3] {
        match self {
            Self::Rec709 => [0.2126, 0.7152, 0.0722],
            Self::Radiance => [0.265_074_126, 0.670_114_631, 0.064_811_243],
        }
    }

    /// The luminance of a pixel.
    pub fn of(self, [red, green, blue]: [f64; 3]) -> f64 {
        let [r, g, b] = self.weights();
        r * red + g * green + b * blue
    }
}
