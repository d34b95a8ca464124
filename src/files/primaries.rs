//! What a file's red, green and blue are, and the way from there to those of Rec. 709.

use nalgebra::{Matrix3, Vector3};

use super::Problem;

/// Three primaries and a white, as CIE 1931 chromaticities (x, y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Primaries {
    pub(crate) red: [f64; 2],
    pub(crate) green: [f64; 2],
    pub(crate) blue: [f64; 2],
    pub(crate) white: [f64; 2],
}

/// D65, as ITU-R BT.709 rounds it.
const D65: [f64; 2] = [0.3127, 0.3290];

/// Chromaticities closer than this are the same: what files round to, and far less than any two
/// colour spaces differ by.
const SAME: f64 = 1e-3;

/// Cone responses of Bradford's transform (Lam 1985), in rows.
fn bradford() -> Matrix3<f64> {
    Matrix3::new(
        0.8951, 0.2664, -0.1614, //
        -0.7502, 1.7135, 0.0367, //
        0.0389, -0.0685, 1.0296,
    )
}

impl Primaries {
    /// ITU-R BT.709, which sRGB shares: what every picture of this crate is in.
    pub(crate) const REC709: Self = Self {
        red: [0.640, 0.330],
        green: [0.300, 0.600],
        blue: [0.150, 0.060],
        white: D65,
    };

    /// CIE XYZ, whose numbers are colours by themselves: its white of equal parts is no white that
    /// anybody saw.
    const XYZ: Self = Self {
        red: [1.0, 0.0],
        green: [0.0, 1.0],
        blue: [0.0, 0.0],
        white: [1.0 / 3.0, 1.0 / 3.0],
    };

    /// Of x and y of red, green, blue and white, in this order.
    pub(crate) fn new([rx, ry, gx, gy, bx, by, wx, wy]: [f64; 8]) -> Self {
        Self {
            red: [rx, ry],
            green: [gx, gy],
            blue: [bx, by],
            white: [wx, wy],
        }
    }

    /// Those that ITU-T H.273 numbers: cICP's first byte.
    pub(super) fn numbered(code: u8) -> Option<Self> {
        const C: [f64; 2] = [0.310, 0.316];
        let of = |red, green, blue, white| {
            Some(Self {
                red,
                green,
                blue,
                white,
            })
        };
        match code {
            1 => Some(Self::REC709),
            4 => of([0.67, 0.33], [0.21, 0.71], [0.14, 0.08], C),
            5 => of([0.64, 0.33], [0.29, 0.60], [0.15, 0.06], D65),
            6 | 7 => of([0.630, 0.340], [0.310, 0.595], [0.155, 0.070], D65),
            8 => of([0.681, 0.319], [0.243, 0.692], [0.145, 0.049], C),
            9 => of([0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65),
            10 => of([1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]),
            11 => of(
                [0.680, 0.320],
                [0.265, 0.690],
                [0.150, 0.060],
                [0.314, 0.351],
            ),
            12 => of([0.680, 0.320], [0.265, 0.690], [0.150, 0.060], D65),
            22 => of([0.630, 0.340], [0.295, 0.605], [0.155, 0.077], D65),
            _ => None,
        }
    }

    /// Whether two are the same but for rounding.
    pub(super) fn is(&self, other: &Self) -> bool {
        let close =
            |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() <= SAME && (a[1] - b[1]).abs() <= SAME;
        close(self.red, other.red)
            && close(self.green, other.green)
            && close(self.blue, other.blue)
            && close(self.white, other.white)
    }

    /// Linear RGB to CIE XYZ, white having Y = 1; nothing for chromaticities that make no colour
    /// space.
    fn to_xyz(self) -> Option<Matrix3<f64>> {
        let column = |[x, y]: [f64; 2]| Vector3::new(x, y, 1.0 - x - y);
        let directions =
            Matrix3::from_columns(&[column(self.red), column(self.green), column(self.blue)]);
        let white = column(self.white) / self.white[1];
        let scale = directions.try_inverse()? * white;
        // Three primaries around their white, each of which adds light.
        let sound = directions.determinant().abs() > 1e-6
            && scale.iter().all(|part| part.is_finite() && *part > 0.0);
        sound.then(|| directions * Matrix3::from_diagonal(&scale))
    }

    /// What red, green and blue weigh in luminance.
    pub(super) fn luminance(self) -> Result<[f64; 3], Problem> {
        let matrix = self.to_xyz().ok_or_else(|| self.unsound())?;
        Ok([matrix[(1, 0)], matrix[(1, 1)], matrix[(1, 2)]])
    }

    /// The way to Rec. 709 with its white, D65, to which other whites are adapted by Bradford's
    /// transform, but for CIE XYZ, which has none; nothing where the two are the same.
    pub(crate) fn to_rec709(self) -> Result<Option<ToRec709>, Problem> {
        if self.is(&Self::REC709) {
            return Ok(None);
        }
        let to_xyz = self.to_xyz().ok_or_else(|| self.unsound())?;
        Ok(Some(if self.is(&Self::XYZ) {
            ToRec709::of_colours(to_xyz)
        } else {
            ToRec709::of_xyz(to_xyz)
        }))
    }

    fn unsound(&self) -> Problem {
        let Self {
            red,
            green,
            blue,
            white,
        } = self;
        Problem::new(
            format!(
                "the file's chromaticities, red {red:?}, green {green:?}, blue {blue:?} and white {white:?}, make no colour space"
            ),
            "store it again in linear Rec. 709, or with the right chromaticities",
        )
    }
}

/// A matrix from some linear RGB to that of Rec. 709.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToRec709([[f64; 3]; 3]);

impl ToRec709 {
    /// From the matrix to CIE XYZ; what it makes of equal parts is the white.
    pub(super) fn of_xyz(to_xyz: Matrix3<f64>) -> Self {
        let of_cones = bradford().try_inverse().unwrap_or_default();
        let rec709 = Primaries::REC709.to_xyz().unwrap_or_default();
        let ones = Vector3::repeat(1.0);
        let (from, to) = (bradford() * to_xyz * ones, bradford() * rec709 * ones);
        let adapted = of_cones * Matrix3::from_diagonal(&to.component_div(&from)) * bradford();
        Self::of_colours(adapted * to_xyz)
    }

    /// From the matrix to the CIE XYZ of the colours as they are seen beside D65.
    fn of_colours(to_xyz: Matrix3<f64>) -> Self {
        let rec709 = Primaries::REC709.to_xyz().unwrap_or_default();
        let matrix = rec709.try_inverse().unwrap_or_default() * to_xyz;
        Self(std::array::from_fn(|row| {
            std::array::from_fn(|column| matrix[(row, column)])
        }))
    }

    /// Whether it changes nothing beyond this.
    pub(super) fn is_none_within(&self, tolerance: f64) -> bool {
        (0..9).all(|i| {
            let same = f64::from(u8::from(i / 3 == i % 3));
            (self.0[i / 3][i % 3] - same).abs() <= tolerance
        })
    }

    /// The pixel in Rec. 709. What it cannot show has parts below zero, which are set to zero where
    /// the pixel had none.
    pub(crate) fn apply(&self, pixel: [f64; 3]) -> [f64; 3] {
        let [red, green, blue] = pixel;
        let seen = self.0.map(|[r, g, b]| r * red + g * green + b * blue);
        if pixel.iter().all(|value| *value >= 0.0) {
            seen.map(|value| if value < 0.0 { 0.0 } else { value })
        } else {
            seen
        }
    }
}
