//! How well materials are named: protocols, classifiers, leaving one illumination out, and the
//! tables of `lobes reproduce`.
//!
//! The library holds what reads one picture ([`lobes::inference`]); this crate holds what is tried
//! and judged on many of them.

#![forbid(unsafe_code)]
#![expect(
    clippy::doc_markdown,
    reason = "the formulas are plain text, with subscripts"
)]

mod calibration;
mod colour_ceiling;
mod continuous;
mod evaluate;
mod experts;
mod finishes;
mod harness;
mod interval;
mod known_light;
mod known_shapes;
mod light_coverage;
mod nearest;
mod prior_light;
mod probe_accuracy;
mod protocol;
mod shape_roughness;
mod simulated_ranks;
mod simulation;

pub use calibration::Calibration;
pub use colour_ceiling::{ColourCeiling, best_share, colour_ceilings};
pub use continuous::ContinuousReadings;
pub use evaluate::{
    Classifier, Confusion, Evaluation, judge_leaving_one_out, leave_one_illumination_out,
};
pub use experts::{ColourExpert, EvidenceExpert, LogRadianceExpert, light_spectrum};
pub use finishes::{
    FinishShots, FinishTable, Outline, PrintTally, ThingTally, finish_cross_entropy,
    finish_samples, judge_finishes, judge_things, learned_and_judged,
};
pub use harness::{Harness, Method};
pub use interval::{mcnemar, wilson};
pub use known_light::{KNOWN_BALLS, KnownBall, KnownLight, light_of_known_balls};
pub use light_coverage::{
    Held, LightCoverage, LightLikeness, LightShots, ReflectanceKnowledge, light_coverage,
};
pub use nearest::{NearestNeighbour, Scaling};
pub use prior_light::prior_chi_square;
pub use probe_accuracy::{ProbeAccuracy, probe_accuracy};
pub use protocol::Protocol;
pub use shape_roughness::{ShapeRoughness, shape_roughness};
pub use simulated_ranks::{SimulatedRanks, simulated_ranks};
pub use simulation::{Nuisances, SimulatedPhotograph, Thing, simulate, simulate_thing};
