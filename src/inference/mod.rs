//! From features to names and posteriors: evidence, what is learned, and a model of both.

#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod ball_light;
mod binned;
mod bright_lights;
mod dataset;
mod discriminant;
mod evidence;
mod expected_picture;
mod expert;
mod finish;
mod finish_learning;
mod learned_posterior;
mod light_grid;
mod light_posterior;
mod model;
mod network;
mod portrait;
mod possible_reflectances;
mod posterior;
mod random_reflectances;
mod reading;
mod reflectance_grid;
mod scenes;
mod smooth_operator;
#[cfg(feature = "files")]
mod training;

pub use ball_light::{BallLight, BallLightReader, LightQuantity};
pub use binned::Binned;
pub use bright_lights::BrightLights;
pub use dataset::{Dataset, MIRROR_PIXEL_SAMPLES, Observation, Plan, View, collect};
pub use discriminant::{Discriminant, LinearScores};
pub use evidence::{EVIDENCE_DEGREE, Evidence, GaussianEvidence, log_sum_exp, natural_spectrum};
pub use expected_picture::ExpectedPicture;
pub use expert::{Expert, Stack};
pub use finish::{FinishModel, FinishVerdict};
pub use finish_learning::{FinishLearning, FinishSample, FinishTruth};
pub use learned_posterior::{JudgedPosteriors, LearnedPosterior, PosteriorModel};
pub use light_grid::{LightField, LightGrid};
pub use light_posterior::{ChannelReflectance, LightEstimate, LightReader};
pub use model::{Model, SphereFeatures, Training, Verdict};
pub use network::{Adam, Network};
pub use portrait::{Portrait, PortraitReader};
pub use possible_reflectances::PossibleReflectance;
pub use posterior::{Posterior, Reflectance};
pub use random_reflectances::{RandomReflectances, Sample, collect_random};
pub use reading::{
    EvidenceReader, EvidenceReading, JudgedReading, LogReader, Reader, Reading, chromaticity,
};
pub use reflectance_grid::ReflectanceGrid;
pub use scenes::{Alike, Scenes};
pub use smooth_operator::{LightResponses, SmoothModes, SmoothOperator};
#[cfg(feature = "files")]
pub use training::TrainingPlan;
