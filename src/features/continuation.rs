//! What stands on the half of the sphere of normals that one image does not show.

use crate::named;
use crate::serialisation::by_name;

/// What stands on the half of the sphere of normals that one image does not show.
///
/// The normals that an orthographic camera sees are the hemisphere n·z ≥ 0, with z towards the
/// camera, x to the image's right and y up. A harmonic analysis wants the other half as well. The
/// paper mirrors the front to the back. The mirrored field has a crease along the rim and is not
/// band-limited even where the true field is; [`HalfTurn`](Self::HalfTurn) creases less where the
/// field is symmetric, [`Zero`](Self::Zero) jumps.
///
/// ```
/// use lobes::features::{Continuation, ImageSpectrum, PaperFeatures, TOP_DEGREE};
/// # use lobes::{glam::DVec3, reflection::{Camera, SphereImage, Viewpoint}};
/// # // A ball that is brighter on the upper right.
/// # let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
/// # let pixels = (0..64 * 64).map(|i| match camera.pixel(64, i / 64, i % 64) {
/// #     Some(at) => [1.0 + 0.5 * at.normal.y, 1.0, 1.0 + 0.5 * at.normal.x],
/// #     None => [0.0; 3],
/// # });
/// # let image = SphereImage::new(camera, 64, pixels.collect())?;
/// // The paper's features are of odd degrees, which an antipodal field lacks.
/// let antipodal = ImageSpectrum::new(TOP_DEGREE, Continuation::Antipodal)?;
/// assert!(PaperFeatures::of_image(&antipodal, &image).is_err());
/// let mirrored = ImageSpectrum::new(TOP_DEGREE, "mirror".parse()?)?;
/// assert!(PaperFeatures::of_image(&mirrored, &image).is_ok());
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Continuation {
    /// B(x, y, −z) = B(x, y, z): the paper's.
    #[default]
    Mirror,
    /// B(−x, y, −z) = B(x, y, z): half a turn about the image's vertical.
    HalfTurn,
    /// B = 0 behind.
    Zero,
    /// B(−n) = B(n). Every odd degree of such a field is zero, so features of odd degrees refuse
    /// it.
    Antipodal,
}

impl Continuation {
    /// Every continuation, in the order in which tables list them.
    pub const ALL: [Self; 4] = [Self::Mirror, Self::HalfTurn, Self::Zero, Self::Antipodal];

    /// The name that `FromStr` reads.
    ///
    /// ```
    /// use lobes::features::Continuation;
    /// for c in Continuation::ALL {
    ///     assert_eq!(c.name().parse::<Continuation>().unwrap(), c);
    /// }
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Mirror => "mirror",
            Self::HalfTurn => "half-turn",
            Self::Zero => "zero",
            Self::Antipodal => "antipodal",
        }
    }

    /// The column of the front from which column `column` of `columns` is filled behind, where
    /// column j stands at the azimuth 2πj/`columns` from the image's right towards its top.
    /// `None` where nothing is.
    pub(crate) fn source_column(self, column: usize, columns: usize) -> Option<usize> {
        let half = columns / 2;
        match self {
            Self::Mirror => Some(column),
            Self::HalfTurn => Some((columns + half - column) % columns),
            Self::Zero => None,
            Self::Antipodal => Some((column + half) % columns),
        }
    }
}

named!(Continuation, "continuation");
by_name!(Continuation);
