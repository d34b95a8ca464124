//! What is lost between two ways of writing a material.

use std::fmt;

use super::Format;

/// What of one material is not in what was read or written; its display is a sentence.
///
/// ```
/// use lobes::exchange::{Loss, Note};
/// let loss = Loss::Renamed { name: "brown_matte".into() };
/// let note = Note { material: "brown matte".into(), loss };
/// assert_eq!(note.to_string(), "\"brown matte\" is written under the name \"brown_matte\"");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// The material's name.
    pub material: String,
    /// What is lost.
    pub loss: Loss,
}

/// What a material loses.
///
/// ```
/// use lobes::exchange::{Loss, Note};
/// let loss = Loss::GainsEnergy { albedo: 1.7 };
/// let note = Note { material: "silver".into(), loss };
/// assert!(note.to_string().contains("1.7000 of the light"));
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Loss {
    /// A GGX lobe is read as Ward's lobe of σ = α, which has no tail.
    Tail {
        /// α.
        alpha: f64,
    },
    /// Ward's Gaussian lobe is written as a GGX lobe of α = σ, which has a tail.
    NoTail {
        /// σ.
        sigma: f64,
    },
    /// A reflectance that rises towards grazing is read as what it is along the normal.
    Fresnel,
    /// A reflectance that does not change with angle is written as one that rises to 1 at grazing.
    FresnelAdded,
    /// A property of the surface is left out.
    LeftOut {
        /// The property, as the file has it.
        what: String,
    },
    /// Two widths are read as their geometric mean.
    TwoWidths {
        /// The widths.
        alpha: [f64; 2],
    },
    /// A surface that reflects more than it receives is scaled so that it does not.
    GainsEnergy {
        /// The largest albedo of a channel as the file has it.
        albedo: f64,
    },
    /// A surface is not read at all.
    NotRead {
        /// Why, in words that complete "is not read: it is …".
        why: String,
    },
    /// A material is not written at all.
    NotWritten {
        /// To what.
        format: Format,
        /// Why, in words that complete "is not written: it …".
        why: &'static str,
    },
    /// A material is written under another name.
    Renamed {
        /// The name that it has in the file.
        name: String,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = &self.material;
        match &self.loss {
            Loss::Tail { alpha } => write!(
                f,
                "{name:?} has a GGX lobe of α {alpha}, which is read as Ward's lobe of that σ and loses its tail"
            ),
            Loss::NoTail { sigma } => write!(
                f,
                "{name:?} has Ward's lobe of σ {sigma}, which is written as a GGX lobe of that α and gains a tail"
            ),
            Loss::Fresnel => write!(
                f,
                "{name:?} reflects more towards grazing, which is read as the reflectance along the normal at every angle"
            ),
            Loss::FresnelAdded => write!(
                f,
                "{name:?} reflects alike at every angle, and as written it reflects more towards grazing"
            ),
            Loss::LeftOut { what } => write!(f, "{name:?} is read without its {what}"),
            Loss::TwoWidths { alpha: [x, y] } => write!(
                f,
                "{name:?} has the widths {x} and {y}, which are read as one, their geometric mean"
            ),
            Loss::GainsEnergy { albedo } => write!(
                f,
                "{name:?} would reflect {albedo:.4} of the light along the normal, and is read scaled to 1"
            ),
            Loss::NotRead { why } => write!(f, "{name:?} is not read: it is {why}"),
            Loss::NotWritten { format, why } => {
                write!(f, "{name:?} is not written to {format}: it {why}")
            }
            Loss::Renamed { name: other } => {
                write!(f, "{name:?} is written under the name {other:?}")
            }
        }
    }
}
