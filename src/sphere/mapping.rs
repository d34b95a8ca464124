//! Pictures of the whole sphere: which point of the picture shows which direction.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::named;
use crate::serialisation::by_name;
use crate::{Error, Result};

/// How a picture shows the whole sphere of directions.
///
/// A point of the picture is (u, v) in \[0, 1\]²: u from the left, v from the top. The centre of
/// pixel (row, column) is ((column + ½)/width, (row + ½)/height). Directions are in the world
/// frame, y up; "ahead" is −z, and then +x is to the right.
///
/// ```
/// use lobes::{glam::DVec3, sphere::Mapping};
/// let ahead = Mapping::LatLong.direction(0.5, 0.5).unwrap();
/// assert!((ahead - DVec3::NEG_Z).length() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mapping {
    /// Latitude and longitude, 2:1. θ = πv from +y, azimuth 2π(u − ½) from −z towards +x. Ahead is
    /// in the centre.
    LatLong,
    /// Debevec's angular map ("light probe"), 1:1: in the disc, the distance from the centre is the
    /// angle from −z over π, and the direction on the picture is the direction round −z, up being
    /// +y. Its rim is +z all round.
    AngularMap,
    /// The photograph of a mirrored ball, 1:1, by a far camera that looks along −z, up being +y.
    /// The centre shows the camera (+z), the rim what is behind the ball (−z), all round.
    MirrorBall,
    /// A cube unfolded into a cross, 3:4. From the top: +y; −x, −z, +x side by side; −y; and +z
    /// upside down.
    VerticalCross,
    /// A cube unfolded into a cross, 4:3. Above: +y over −z; then −x, −z, +x, +z side by side;
    /// below: −y under −z.
    HorizontalCross,
}

/// A face of the cube: where it looks, what is to its right, and what is up.
struct Face {
    column: usize,
    row: usize,
    ahead: DVec3,
    right: DVec3,
    up: DVec3,
}

const fn face(column: usize, row: usize, ahead: DVec3, right: DVec3, up: DVec3) -> Face {
    Face {
        column,
        row,
        ahead,
        right,
        up,
    }
}

/// The five faces that both crosses share.
const FACES: [Face; 5] = [
    face(1, 0, DVec3::Y, DVec3::X, DVec3::Z),
    face(0, 1, DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y),
    face(1, 1, DVec3::NEG_Z, DVec3::X, DVec3::Y),
    face(2, 1, DVec3::X, DVec3::Z, DVec3::Y),
    face(1, 2, DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z),
];

const BACK_OF_VERTICAL: Face = face(1, 3, DVec3::Z, DVec3::X, DVec3::NEG_Y);
const BACK_OF_HORIZONTAL: Face = face(3, 1, DVec3::Z, DVec3::NEG_X, DVec3::Y);

impl Mapping {
    /// Every mapping.
    pub const ALL: [Self; 5] = [
        Self::LatLong,
        Self::AngularMap,
        Self::MirrorBall,
        Self::VerticalCross,
        Self::HorizontalCross,
    ];

    /// The name by which it is asked for: `lat-long`, `angular-map`, `mirror-ball`,
    /// `vertical-cross`, `horizontal-cross`.
    pub fn name(self) -> &'static str {
        match self {
            Self::LatLong => "lat-long",
            Self::AngularMap => "angular-map",
            Self::MirrorBall => "mirror-ball",
            Self::VerticalCross => "vertical-cross",
            Self::HorizontalCross => "horizontal-cross",
        }
    }

    /// Width to height, in lowest terms.
    pub fn aspect(self) -> (usize, usize) {
        match self {
            Self::LatLong => (2, 1),
            Self::AngularMap | Self::MirrorBall => (1, 1),
            Self::VerticalCross => (3, 4),
            Self::HorizontalCross => (4, 3),
        }
    }

    /// Whether a picture of this size has the mapping's shape.
    pub fn fits(self, width: usize, height: usize) -> bool {
        let (across, down) = self.aspect();
        width > 0 && width as u128 * down as u128 == height as u128 * across as u128
    }

    /// The mapping of a picture of this size, where the size leaves no doubt.
    ///
    /// # Errors
    ///
    /// [`Error::AmbiguousMapping`] for a square, which can be an angular map or a mirror ball, and
    /// for a shape that fits none.
    ///
    /// ```
    /// use lobes::sphere::Mapping;
    /// assert_eq!(Mapping::guess(1024, 512)?, Mapping::LatLong);
    /// assert!(Mapping::guess(900, 900).unwrap_err().to_string().contains("--mapping"));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    pub fn guess(width: usize, height: usize) -> Result<Self> {
        let mut fitting = Self::ALL
            .into_iter()
            .filter(|mapping| mapping.fits(width, height));
        match (fitting.next(), fitting.next()) {
            (Some(mapping), None) => Ok(mapping),
            (Some(_), Some(_)) => Err(Error::AmbiguousMapping { width, height }),
            _ => Err(Error::NoMapping { width, height }),
        }
    }

    /// The direction that a point of the picture shows, of unit length; `None` outside the disc or
    /// the cross.
    ///
    /// ```
    /// use lobes::{glam::DVec3, sphere::Mapping};
    /// let ahead = Mapping::LatLong.direction(0.5, 0.5).unwrap();
    /// assert!((ahead - DVec3::NEG_Z).length() < 1e-15);
    /// assert_eq!(Mapping::AngularMap.direction(0.0, 0.0), None);
    /// ```
    pub fn direction(self, u: f64, v: f64) -> Option<DVec3> {
        if !((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)) {
            return None;
        }
        let (x, y) = (2.0 * u - 1.0, 1.0 - 2.0 * v);
        match self {
            Self::LatLong => {
                let (sin_theta, cos_theta) = (PI * v).sin_cos();
                let (sin, cos) = (PI * x).sin_cos();
                Some(DVec3::new(sin_theta * sin, cos_theta, -sin_theta * cos))
            }
            Self::AngularMap => {
                let r = x.hypot(y);
                if r > 1.0 {
                    return None;
                }
                let (sin, cos) = (PI * r).sin_cos();
                let scale = if r > 0.0 { sin / r } else { PI };
                Some(DVec3::new(scale * x, scale * y, -cos))
            }
            Self::MirrorBall => {
                // The ball's normal is (x, y, n), and the camera's direction (0, 0, 1) is mirrored
                // in it.
                let n2 = 1.0 - x * x - y * y;
                if n2 < 0.0 {
                    return None;
                }
                let n = n2.sqrt();
                Some(DVec3::new(2.0 * n * x, 2.0 * n * y, 2.0 * n2 - 1.0))
            }
            Self::VerticalCross | Self::HorizontalCross => {
                let (columns, rows) = self.aspect();
                let (along, down) = (u * columns as f64, v * rows as f64);
                let column = (along as usize).min(columns - 1);
                let row = (down as usize).min(rows - 1);
                let face = self
                    .faces()
                    .find(|face| (face.column, face.row) == (column, row))?;
                let a = 2.0 * (along - column as f64) - 1.0;
                let b = 1.0 - 2.0 * (down - row as f64);
                Some((face.ahead + a * face.right + b * face.up).normalize())
            }
        }
    }

    /// The point (u, v) of the picture that shows a direction. The direction need not be of unit
    /// length.
    ///
    /// Where one direction is a whole line of the picture (the poles of a lat-long map, the rim of
    /// a disc), one point of it.
    pub fn position(self, direction: DVec3) -> (f64, f64) {
        let d = direction;
        let on_disc = |r: f64| {
            let across = d.x.hypot(d.y);
            let (x, y) = if across > 0.0 {
                (r * d.x / across, r * d.y / across)
            } else {
                (r, 0.0)
            };
            (0.5 + 0.5 * x, 0.5 - 0.5 * y)
        };
        match self {
            Self::LatLong => {
                let theta = d.x.hypot(d.z).atan2(d.y);
                (d.x.atan2(-d.z) / TAU + 0.5, theta / PI)
            }
            Self::AngularMap => on_disc(d.x.hypot(d.y).atan2(-d.z) / PI),
            Self::MirrorBall => on_disc((0.5 * d.x.hypot(d.y).atan2(d.z)).sin()),
            Self::VerticalCross | Self::HorizontalCross => {
                let mut best = &FACES[0];
                let back = self.back();
                for face in FACES.iter().chain([back]) {
                    if d.dot(face.ahead) > d.dot(best.ahead) {
                        best = face;
                    }
                }
                let depth = d.dot(best.ahead);
                let a = d.dot(best.right) / depth;
                let b = d.dot(best.up) / depth;
                let (columns, rows) = self.aspect();
                (
                    (best.column as f64 + 0.5 + 0.5 * a) / columns as f64,
                    (best.row as f64 + 0.5 - 0.5 * b) / rows as f64,
                )
            }
        }
    }

    /// The solid angle that the picture shows per area of the unit square of (u, v), at a point: 0
    /// outside the disc or the cross. Over the square it integrates to 4π.
    ///
    /// With r the distance from the centre of a disc of radius 1, and (a, b) in \[−1, 1\]² on a
    /// face:
    ///
    /// | mapping | dω / du dv |
    /// | --- | --- |
    /// | lat-long | 2π² sin πv |
    /// | angular map | 4π sin(πr)/r |
    /// | mirror ball | 16 |
    /// | crosses | 48 (1 + a² + b²)^(−3/2) |
    pub fn solid_angle_density(self, u: f64, v: f64) -> f64 {
        if self.direction(u, v).is_none() {
            return 0.0;
        }
        match self {
            Self::LatLong => 2.0 * PI * PI * (PI * v).sin(),
            Self::AngularMap => {
                let r = (2.0 * u - 1.0).hypot(1.0 - 2.0 * v);
                if r > 0.0 {
                    4.0 * PI * (PI * r).sin() / r
                } else {
                    4.0 * PI * PI
                }
            }
            Self::MirrorBall => 16.0,
            Self::VerticalCross | Self::HorizontalCross => {
                let (columns, rows) = self.aspect();
                let a = 2.0 * (u * columns as f64).fract() - 1.0;
                let b = 1.0 - 2.0 * (v * rows as f64).fract();
                48.0 * (1.0 + a * a + b * b).powf(-1.5)
            }
        }
    }

    fn back(self) -> &'static Face {
        match self {
            Self::HorizontalCross => &BACK_OF_HORIZONTAL,
            _ => &BACK_OF_VERTICAL,
        }
    }

    fn faces(self) -> impl Iterator<Item = &'static Face> {
        FACES.iter().chain([self.back()])
    }
}

named!(Mapping, "mapping");
by_name!(Mapping);
