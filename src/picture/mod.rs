//! Pictures with a sphere in them: reading them, finding the sphere, taking them as a camera does,
//! writing them.

#[cfg(feature = "files")]
mod augmentation;
mod circle;
#[cfg(feature = "files")]
mod file;
mod normals;
mod outline;
#[cfg(feature = "files")]
mod photograph;
#[expect(
    clippy::module_inception,
    reason = "the picture is what the room is named for"
)]
mod picture;
#[cfg(feature = "files")]
mod png;
mod sphere;

#[cfg(feature = "files")]
pub use augmentation::augment;
pub use circle::Circle;
pub use normals::{NormalFrame, Normals, ShapeBall};
pub use outline::Elongation;
#[cfg(feature = "files")]
pub use photograph::{Photograph, normal};
pub use picture::Picture;
#[cfg(feature = "files")]
pub use png::{encode_png, encode_spheres};
pub use sphere::Sphere;
