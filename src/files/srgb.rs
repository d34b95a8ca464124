//! The transfer function of sRGB.

use std::sync::LazyLock;

/// The linear value of an sRGB code on [0, 1] (IEC 61966-2-1:1999): E/12.92 up to E = 0.04045,
/// above it ((E + 0.055) / 1.055)^2.4.
///
/// An 8-bit code is divided by 255 first, a 16-bit one by 65 535. Outside of [0, 1] the function
/// goes on as an odd one, as scRGB has it. Contract: `colorimetry/srgb-decode`.
///
/// ```
/// let middle = lobes::files::linear_of_srgb(118.0 / 255.0);
/// assert!((middle - 0.18).abs() < 2e-3); // a grey card
/// ```
pub fn linear_of_srgb(encoded: f64) -> f64 {
    let magnitude = encoded.abs();
    let linear = if magnitude <= 0.040_45 {
        magnitude / 12.92
    } else {
        ((magnitude + 0.055) / 1.055).powf(2.4)
    };
    linear.copysign(encoded)
}

/// The sRGB code on [0, 1] of a linear value (IEC 61966-2-1:1999): 12.92 E up to E = 0.0031308,
/// above it
/// 1.055 E^(1/2.4) − 0.055.
///
/// Outside of [0, 1] the function goes on as an odd one; who makes a code of 8 bits clips it. The
/// standard's two pieces meet with a step of 8·10⁻⁹, so this is the inverse of [`linear_of_srgb`]
/// only to that at the knee. Contract: `colorimetry/srgb-encode`.
///
/// ```
/// assert_eq!((255.0 * lobes::files::srgb_of_linear(0.18)).round(), 118.0);
/// ```
pub fn srgb_of_linear(linear: f64) -> f64 {
    let magnitude = linear.abs();
    let encoded = if magnitude <= 0.003_130_8 {
        12.92 * magnitude
    } else {
        1.055 * magnitude.powf(1.0 / 2.4) - 0.055
    };
    encoded.copysign(linear)
}

/// The sRGB code of 8 bits of a linear value: 255 times [`srgb_of_linear`] of what is left of it
/// when it is clipped to [0, 1], rounded.
///
/// It is looked up among the values at which the code changes, which costs a tenth of the power. A
/// value that is not a number has the code 0.
///
/// ```
/// use lobes::files::{srgb_of_linear, srgb8_of_linear};
/// assert_eq!(srgb8_of_linear(0.18), (255.0 * srgb_of_linear(0.18)).round() as u8);
/// assert_eq!((srgb8_of_linear(-1.0), srgb8_of_linear(2.0)), (0, 255));
/// ```
pub fn srgb8_of_linear(linear: f64) -> u8 {
    static STEPS: LazyLock<Steps> = LazyLock::new(Steps::new);
    STEPS.code(linear)
}

/// Where the codes of 8 bits begin.
struct Steps {
    /// The code at the lower end of each of so many parts of [0, 1].
    first: [u8; Self::PARTS + 1],
    /// The least value of each code.
    least: [f64; 256],
}

impl Steps {
    const PARTS: usize = 1024;

    fn new() -> Self {
        let mut least = [0.0; 256];
        for code in 1..=255u8 {
            // The inverse is good to rounding; the rest of the way is stepped.
            let mut value = linear_of_srgb((f64::from(code) - 0.5) / 255.0);
            while rounded(value) < code {
                value = value.next_up();
            }
            while rounded(value.next_down()) >= code {
                value = value.next_down();
            }
            least[usize::from(code)] = value;
        }
        let first = std::array::from_fn(|part| rounded(part as f64 / Self::PARTS as f64));
        Self { first, least }
    }

    fn code(&self, linear: f64) -> u8 {
        let value = linear.clamp(0.0, 1.0);
        let mut code = self.first[(value * Self::PARTS as f64) as usize];
        while code < 255 && value >= self.least[usize::from(code) + 1] {
            code += 1;
        }
        code
    }
}

fn rounded(linear: f64) -> u8 {
    (255.0 * srgb_of_linear(linear.clamp(0.0, 1.0))).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_change_where_the_rounded_curve_does() {
        for i in 0..=200_000 {
            let value = f64::from(i) / 199_999.0;
            assert_eq!(srgb8_of_linear(value), rounded(value), "{value}");
        }
        let steps = Steps::new();
        for least in steps.least {
            for value in [least.next_down(), least, least.next_up()] {
                assert_eq!(srgb8_of_linear(value), rounded(value), "{value}");
            }
        }
        for value in [f64::NAN, -0.0, f64::NEG_INFINITY] {
            assert_eq!(srgb8_of_linear(value), 0);
        }
        assert_eq!(srgb8_of_linear(f64::INFINITY), 255);
    }
}
