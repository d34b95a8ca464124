//! Where the camera stands, and what each pixel of its picture of the sphere sees.

use glam::DVec3;

use crate::{Error, Result};

/// A point of the sphere as the camera sees it: unit vectors in the world frame.
///
/// ```
/// use lobes::{glam::DVec3, reflection::Camera};
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let middle = camera.pixel(3, 1, 1).unwrap();
/// assert_eq!((middle.normal, middle.view), (DVec3::Z, DVec3::Z));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadingPoint {
    /// The sphere's normal there.
    pub normal: DVec3,
    /// The direction from that point towards the camera.
    pub view: DVec3,
}

/// A camera that looks at the centre of the unit sphere.
///
/// The picture is square and the sphere just touches its four sides. Row 0 is the top. With the
/// camera towards +z and
/// +y up, +x is to the right.
///
/// ```
/// use lobes::{glam::DVec3, reflection::Camera};
/// let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// let right = camera.point(0.6, 0.0).unwrap();
/// assert!((right.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15);
/// assert_eq!(camera.pixel(128, 0, 0), None); // a corner misses the sphere
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    right: DVec3,
    up: DVec3,
    towards: DVec3,
    /// Radii from the centre to the camera; infinite for an orthographic camera.
    distance: f64,
}

impl Camera {
    /// A camera infinitely far away in the direction `towards_camera`; `up` (any vector not along
    /// it) shows upwards.
    ///
    /// # Errors
    /// [`Error::Domain`] if a vector is not finite or zero, or `up` is along the line of sight.
    pub fn orthographic(towards_camera: DVec3, up: DVec3) -> Result<Self> {
        Self::new(towards_camera, up, f64::INFINITY)
    }

    /// A camera `distance_in_radii` from the sphere's centre.
    ///
    /// # Errors
    /// As [`orthographic`](Self::orthographic), and [`Error::Domain`] if the camera is not outside
    /// the sphere.
    pub fn perspective(towards_camera: DVec3, up: DVec3, distance_in_radii: f64) -> Result<Self> {
        if !(distance_in_radii > 1.0 && distance_in_radii.is_finite()) {
            return Err(Error::Domain {
                what: "the camera's distance in radii of the sphere",
                value: distance_in_radii,
                allowed: "finite and above 1, outside the sphere",
            });
        }
        Self::new(towards_camera, up, distance_in_radii)
    }

    /// A camera that sees the sphere under the full angle `field_of_view` (radians), so that it
    /// fills the picture.
    ///
    /// # Errors
    /// As [`orthographic`](Self::orthographic), and [`Error::Domain`] if the angle is not inside
    /// (0, π).
    pub fn filling(towards_camera: DVec3, up: DVec3, field_of_view: f64) -> Result<Self> {
        if !(field_of_view > 0.0 && field_of_view < std::f64::consts::PI) {
            return Err(Error::Domain {
                what: "the camera's field of view in radians",
                value: field_of_view,
                allowed: "between 0 and π, both excluded",
            });
        }
        Self::perspective(towards_camera, up, 1.0 / (0.5 * field_of_view).sin())
    }

    fn new(towards_camera: DVec3, up: DVec3, distance: f64) -> Result<Self> {
        let degenerate = |what, value| Error::Domain {
            what,
            value,
            allowed: "a finite length above 0",
        };
        let towards = towards_camera.try_normalize().ok_or_else(|| {
            degenerate(
                "the vector towards the camera, of length",
                towards_camera.length(),
            )
        })?;
        let up = up
            .try_normalize()
            .ok_or_else(|| degenerate("the camera's up vector, of length", up.length()))?;
        let across = up.cross(towards);
        if across.length() < 1e-9 {
            return Err(Error::Domain {
                what: "the sine of the angle between the camera's up vector and its line of sight",
                value: across.length(),
                allowed: "above 1e-9",
            });
        }
        let right = across.normalize();
        Ok(Self {
            right,
            up: towards.cross(right),
            towards,
            distance,
        })
    }

    /// The camera turned about its line of sight by `angle` (radians), anticlockwise as seen by
    /// whoever looks through it.
    #[must_use]
    pub fn rolled(self, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self {
            right: self.right * cos + self.up * sin,
            up: self.up * cos - self.right * sin,
            ..self
        }
    }

    /// The unit vector from the sphere's centre towards the camera.
    pub fn towards(&self) -> DVec3 {
        self.towards
    }

    /// The unit vector that shows upwards in the picture.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// The unit vector that shows to the right in the picture.
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// The distance from the sphere's centre in radii; none for an orthographic camera.
    pub fn distance(&self) -> Option<f64> {
        self.distance.is_finite().then_some(self.distance)
    }

    /// The largest angle between the line of sight and a visible normal: π/2, or less for a camera
    /// that is near.
    pub fn rim(&self) -> f64 {
        (1.0 / self.distance).acos()
    }

    /// What the picture shows at (x, y), each in [−1, 1], x to the right and y upwards; none
    /// outside the sphere.
    pub fn point(&self, x: f64, y: f64) -> Option<ShadingPoint> {
        let square = x * x + y * y;
        if square.is_nan() || square >= 1.0 {
            return None;
        }
        let local = |v: DVec3| self.right * v.x + self.up * v.y + self.towards * v.z;
        if self.distance.is_infinite() {
            return Some(ShadingPoint {
                normal: local(DVec3::new(x, y, (1.0 - square).sqrt())),
                view: self.towards,
            });
        }
        // The ray meets the sphere where |D ẑ − s r| = 1, with r the unit vector from the pixel to
        // the camera's back.
        let edge = 1.0 / (self.distance * self.distance - 1.0).sqrt();
        let ray = DVec3::new(-x * edge, -y * edge, 1.0).normalize();
        // (D r_z)² − D² + 1 without its cancellation; zero at the rim.
        let root = ((1.0 - square) / (1.0 + edge * edge * square)).sqrt();
        let along = self.distance * ray.z - root;
        let normal = (DVec3::new(0.0, 0.0, self.distance) - ray * along).normalize();
        Some(ShadingPoint {
            normal: local(normal),
            view: local(ray),
        })
    }

    /// What the centre of a pixel of a picture of `size` × `size` shows; none where it misses the
    /// sphere or where there is no such pixel.
    pub fn pixel(&self, size: usize, row: usize, column: usize) -> Option<ShadingPoint> {
        if row >= size || column >= size {
            return None;
        }
        let scale = 2.0 / size as f64;
        self.point(
            (column as f64 + 0.5) * scale - 1.0,
            1.0 - (row as f64 + 0.5) * scale,
        )
    }

    /// The point whose normal makes the angle `polar` with the line of sight, at `azimuth` from the
    /// picture's right towards its top; `polar` in [0, [`rim`](Self::rim)].
    pub fn shading_point(&self, polar: f64, azimuth: f64) -> ShadingPoint {
        let (sin_polar, cos_polar) = polar.sin_cos();
        let (sin, cos) = azimuth.sin_cos();
        let normal = (self.right * cos + self.up * sin) * sin_polar + self.towards * cos_polar;
        let view = if self.distance.is_infinite() {
            self.towards
        } else {
            (self.towards * self.distance - normal).normalize()
        };
        ShadingPoint { normal, view }
    }
}
