//! The transfer function of sRGB.

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
