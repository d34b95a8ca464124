//! What a picture would look like under light of another colour.

use glam::{DMat3, DVec3};

use crate::{Error, Result};

/// The chromaticities (x, y) of BT.709's red, green and blue, and of its white, D65.
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
const WHITE: [f64; 2] = [0.3127, 0.3290];

/// The cone responses of Lam's thesis (Bradford, 1985) as CIECAM97s prints them; rows from X, Y, Z.
const BRADFORD: [[f64; 3]; 3] = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

/// Adaptation of linear BT.709 radiance from one white to another: von Kries' scaling in Bradford's
/// cone responses.
///
/// With M the matrix from RGB to X, Y, Z, B the one from there to the cones and w, w′ the two
/// whites, the matrix is (B M)⁻¹ diag(B M w′ / B M w) B M. The luminance of a white is not part of
/// its colour: each is divided by its own luminance first, so that adapting changes chromaticity
/// and leaves the brightness of a grey.
///
/// The white of a picture is as a rule the mean of its light:
/// [`EnvironmentMap::mean`](super::EnvironmentMap::mean). Contract: `colorimetry/adaptation`.
///
/// ```
/// use lobes::illumination::ChromaticAdaptation;
/// let sunset = [1.0, 0.6, 0.3];
/// let adaptation = ChromaticAdaptation::new(sunset, [1.0; 3])?;
/// let [r, g, b] = adaptation.apply(sunset);
/// assert!((r - g).abs() < 1e-12 && (g - b).abs() < 1e-12);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChromaticAdaptation {
    matrix: DMat3,
}

impl ChromaticAdaptation {
    /// From the white `from` to the white `to`, both linear BT.709 of any brightness.
    ///
    /// # Errors
    /// [`Error::NoWhite`] for a white that is not finite, or so saturated that a cone does not see
    /// it.
    pub fn new(from: [f64; 3], to: [f64; 3]) -> Result<Self> {
        let to_cones = rows(BRADFORD) * xyz_of_rgb();
        let [from, to] = [
            (from, "the white of the light"),
            (to, "the white adapted to"),
        ]
        .map(|(white, name)| cones_of_white(&to_cones, white, name));
        let scaling = to? / from?;
        Ok(Self {
            matrix: to_cones.inverse() * DMat3::from_diagonal(scaling) * to_cones,
        })
    }

    /// Adapts one linear colour.
    pub fn apply(&self, rgb: [f64; 3]) -> [f64; 3] {
        (self.matrix * DVec3::from_array(rgb)).to_array()
    }
}

fn rows(rows: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&rows).transpose()
}

/// The matrix whose columns are the primaries, scaled so that they add up to the white of luminance 1.
fn xyz_of_rgb() -> DMat3 {
    let xyz = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y) / y;
    let [red, green, blue] = PRIMARIES.map(xyz);
    let primaries = DMat3::from_cols(red, green, blue);
    primaries * DMat3::from_diagonal(primaries.inverse() * xyz(WHITE))
}

fn cones_of_white(to_cones: &DMat3, white: [f64; 3], name: &'static str) -> Result<DVec3> {
    let luminance = (xyz_of_rgb() * DVec3::from_array(white)).y;
    let cones = *to_cones * DVec3::from_array(white) / luminance;
    if white.iter().all(|value| value.is_finite()) && luminance > 0.0 && cones.min_element() > 0.0 {
        Ok(cones)
    } else {
        Err(Error::NoWhite { what: name, white })
    }
}
