//! The protocols: which pictures a classifier is tried on, and what it is told of them.

use std::f64::consts::TAU;

use lobes::inference::View;
use lobes::reflection::Viewpoint;

use lobes::named;

/// Which pictures a classifier is tried on, and what it is told of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Protocol {
    /// Seen level by an orthographic camera, linear, and divided by the mean luminance of a white
    /// sphere in the same light.
    Paper,
    /// The pictures of [`Paper`](Self::Paper) without the white sphere: the exposure is unknown.
    Blind,
    /// Seen from 45° above the horizon, the exposure unknown.
    Tilted,
    /// Seen from 45° above by a camera at [`Self::PHOTOGRAPH_DISTANCE`] radii that sets its
    /// exposure, clips, has noise, and writes a JPEG of 8 bits.
    Photograph,
    /// Random reflectances instead of named materials, seen as in [`Blind`](Self::Blind): σ and the
    /// specular share are read off.
    Continuous,
}

impl Protocol {
    /// Every protocol, in the order in which tables list them.
    pub const ALL: [Self; 5] = [
        Self::Paper,
        Self::Blind,
        Self::Tilted,
        Self::Photograph,
        Self::Continuous,
    ];

    /// How far the camera of [`Self::Photograph`] stands from the sphere's centre, in radii.
    pub const PHOTOGRAPH_DISTANCE: f64 = 8.0;

    /// The name that `FromStr` reads.
    ///
    /// ```
    /// use lobes_experiments::Protocol;
    /// for protocol in Protocol::ALL {
    ///     assert_eq!(protocol.name().parse::<Protocol>().unwrap(), protocol);
    /// }
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Blind => "blind",
            Self::Tilted => "tilted",
            Self::Photograph => "photograph",
            Self::Continuous => "continuous",
        }
    }

    /// Whether the exposure is known.
    pub fn knows_exposure(self) -> bool {
        self == Self::Paper
    }

    /// From where the spheres are seen.
    pub fn view(self) -> View {
        View {
            elevation: match self {
                Self::Paper | Self::Blind | Self::Continuous => 0.0,
                Self::Tilted | Self::Photograph => TAU / 8.0,
            },
            viewpoint: match self {
                Self::Photograph => Viewpoint::Perspective {
                    distance: Self::PHOTOGRAPH_DISTANCE,
                },
                _ => Viewpoint::Orthographic,
            },
        }
    }
}

named!(Protocol, "protocol");
