//! Naming the material and reading the reflectance off one picture: nearest neighbour, evidence,
//! leave-one-illumination-out, intervals.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod evaluate;
mod evidence;
mod experts;
mod interval;
mod modes;
mod nearest;
mod posterior;
mod protocol;
mod turned;

pub use evaluate::{Classifier, Confusion, Evaluation, leave_one_illumination_out};
pub use evidence::{Evidence, GaussianEvidence, natural_spectrum};
pub use experts::{ColourExpert, EvidenceExpert, Expert, LogRadianceExpert, Stack, light_spectrum};
pub use interval::wilson;
pub use modes::{Modes, RingLayout};
pub use nearest::{NearestNeighbour, Scaling};
pub use posterior::{Posterior, ReflectanceGrid};
pub use protocol::{Dataset, MIRROR_PIXEL_SAMPLES, Observation, paper_dataset};
pub use turned::turned_dataset;
