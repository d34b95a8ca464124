//! Naming the material and reading the reflectance off one picture: nearest neighbour, evidence,
//! leave-one-illumination-out, intervals.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod bright_lights;
mod colour_ceiling;
mod continuous;
#[cfg(feature = "files")]
mod development;
mod discriminant;
mod evaluate;
mod evidence;
mod experts;
mod harness;
mod interval;
mod model;
mod nearest;
mod outline;
#[cfg(feature = "files")]
mod photograph;
mod picture;
#[cfg(feature = "files")]
mod picture_file;
mod posterior;
mod protocol;
mod reading;
mod scenes;
mod smooth_operator;
#[cfg(feature = "files")]
mod training;

pub use bright_lights::BrightLights;
pub use colour_ceiling::{ColourCeiling, best_share, colour_ceilings};
pub use continuous::{
    Calibration, JudgedPosteriors, LearnedPosterior, PosteriorModel, RandomReflectances,
    Reflectance, Sample, collect_random,
};
pub use discriminant::{Discriminant, LinearScores};
pub use evaluate::{
    Classifier, Confusion, Evaluation, judge_leaving_one_out, leave_one_illumination_out,
};
pub use evidence::{Evidence, GaussianEvidence, natural_spectrum};
pub use experts::{ColourExpert, EvidenceExpert, Expert, LogRadianceExpert, Stack, light_spectrum};
pub use harness::{Harness, Method};
pub use interval::{mcnemar, wilson};
pub use model::{Model, SphereFeatures, Training, Verdict};
pub use nearest::{NearestNeighbour, Scaling};
pub use outline::Circle;
#[cfg(feature = "files")]
pub use photograph::Photograph;
pub use picture::{Picture, Sphere};
pub use posterior::{Posterior, ReflectanceGrid};
#[cfg(feature = "contracts")]
pub(crate) use protocol::collect_from;
pub use protocol::{Dataset, MIRROR_PIXEL_SAMPLES, Observation, Plan, Protocol, View, collect};
pub use reading::{EvidenceReader, EvidenceReading, JudgedReading, LogReader, Reader, Reading};
pub use scenes::{Alike, Scenes};
pub use smooth_operator::{LightResponses, SmoothModes, SmoothOperator};
#[cfg(feature = "files")]
pub use training::TrainingPlan;
