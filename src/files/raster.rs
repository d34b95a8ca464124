//! A picture as codes, and what they mean.

use super::linear_of_srgb;
use super::primaries::ToRec709;

/// Codes of red, green and blue, and what they mean.
///
/// A pixel takes three bytes, or six, where its radiance takes twenty-four; radiance is looked up when
/// it is asked for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    pub(super) codes: Codes,
    /// The linear values of each code of red, green and blue.
    pub(super) table: Vec<[f64; 3]>,
    /// Nothing for Rec. 709.
    pub(super) to_rec709: Option<ToRec709>,
}

/// Codes of red, green and blue, pixel by pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Codes {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

impl Codes {
    /// The largest code.
    pub(super) fn most(&self) -> u16 {
        match self {
            Self::Eight(_) => 255,
            Self::Sixteen(_) => u16::MAX,
        }
    }
}

impl Raster {
    /// Codes of 8 bits of sRGB.
    pub(crate) fn srgb(codes: Vec<u8>) -> Self {
        let table = (0..=255u8).map(|code| [linear_of_srgb(f64::from(code) / 255.0); 3]);
        Self {
            codes: Codes::Eight(codes),
            table: table.collect(),
            to_rec709: None,
        }
    }

    /// How many pixels there are.
    pub(crate) fn len(&self) -> usize {
        match &self.codes {
            Codes::Eight(codes) => codes.len() / 3,
            Codes::Sixteen(codes) => codes.len() / 3,
        }
    }

    /// The linear radiance of a pixel.
    #[inline]
    pub(crate) fn at(&self, index: usize) -> [f64; 3] {
        self.weighted_sum(std::iter::once((index, 1.0)))
    }

    /// The linear radiance of codes.
    #[inline]
    fn radiance(&self, [r, g, b]: [usize; 3]) -> [f64; 3] {
        let rgb = [self.table[r][0], self.table[g][1], self.table[b][2]];
        match &self.to_rec709 {
            Some(matrix) => matrix.apply(rgb),
            None => rgb,
        }
    }

    /// The sum of pixels' linear radiances, each by its weight: of (index, weight).
    #[inline]
    pub(crate) fn weighted_sum(&self, terms: impl Iterator<Item = (usize, f64)>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |codes: [usize; 3], weight: f64| {
            let rgb = self.radiance(codes);
            for channel in 0..3 {
                sum[channel] += weight * rgb[channel];
            }
        };
        match &self.codes {
            Codes::Eight(codes) => {
                let pixels = codes.as_chunks::<3>().0;
                terms.for_each(|(index, weight)| add(pixels[index].map(usize::from), weight));
            }
            Codes::Sixteen(codes) => {
                let pixels = codes.as_chunks::<3>().0;
                terms.for_each(|(index, weight)| add(pixels[index].map(usize::from), weight));
            }
        }
        sum
    }

    /// The codes of a pixel as they stand in the file, over the largest.
    pub(crate) fn fractions(&self, index: usize) -> [f64; 3] {
        match &self.codes {
            Codes::Eight(codes) => [0, 1, 2].map(|c| f64::from(codes[3 * index + c]) / 255.0),
            Codes::Sixteen(codes) => [0, 1, 2].map(|c| f64::from(codes[3 * index + c]) / 65_535.0),
        }
    }

    /// The same pixels in another order: `from` says which one comes to each place.
    pub(crate) fn reordered(self, from: impl Fn(usize) -> usize) -> Self {
        fn moved<T: Copy>(codes: &[T], from: impl Fn(usize) -> usize) -> Vec<T> {
            let (pixels, _) = codes.as_chunks::<3>();
            let moved = (0..pixels.len()).flat_map(|place| pixels[from(place)]);
            moved.collect()
        }
        let codes = match &self.codes {
            Codes::Eight(codes) => Codes::Eight(moved(codes, from)),
            Codes::Sixteen(codes) => Codes::Sixteen(moved(codes, from)),
        };
        Self { codes, ..self }
    }
}

/// How the samples of a picture follow each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// One channel of colour, not three.
    pub(super) grey: bool,
    pub(super) has_alpha: bool,
    /// Each channel by itself, not pixel by pixel.
    pub(super) planar: bool,
}

impl Layout {
    /// Red, green and blue, pixel by pixel, and nothing else.
    pub(super) fn is_colours(self) -> bool {
        !(self.grey || self.has_alpha || self.planar)
    }

    /// Samples of a pixel.
    pub(super) fn channels(self) -> usize {
        usize::from(self.has_alpha) + if self.grey { 1 } else { 3 }
    }

    /// Red, green and blue of each pixel.
    pub(super) fn colours<T: Copy>(self, samples: &[T]) -> Vec<T> {
        let pixels = samples.len() / self.channels();
        let channels: [usize; 3] = if self.grey { [0; 3] } else { [0, 1, 2] };
        let all =
            (0..pixels).flat_map(|pixel| channels.map(|c| samples[self.place(pixel, c, pixels)]));
        // A `flat_map` does not say how many there are.
        let mut colours = Vec::with_capacity(3 * pixels);
        colours.extend(all);
        colours
    }

    /// How much alpha leaves of each pixel, the largest sample being `most`; nothing where it leaves
    /// all of each.
    pub(super) fn mask<T: Copy + Into<f64>>(self, samples: &[T], most: T) -> Option<Vec<f32>> {
        if !self.has_alpha {
            return None;
        }
        let pixels = samples.len() / self.channels();
        let last = self.channels() - 1;
        let (alpha, most) = (
            |pixel: usize| samples[self.place(pixel, last, pixels)].into(),
            most.into(),
        );
        if (0..pixels).all(|pixel| alpha(pixel) >= most) {
            return None;
        }
        Some(
            (0..pixels)
                .map(|pixel| (alpha(pixel) / most) as f32)
                .collect(),
        )
    }

    fn place(self, pixel: usize, channel: usize, pixels: usize) -> usize {
        if self.planar {
            channel * pixels + pixel
        } else {
            pixel * self.channels() + channel
        }
    }
}
