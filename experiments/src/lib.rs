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
mod evaluate;
mod experts;
mod finishes;
mod harness;
mod interval;
mod light_coverage;
mod nearest;
mod protocol;
mod simulation;

pub use calibration::Calibration;
pub use colour_ceiling::{ColourCeiling, best_share, colour_ceilings};
pub use evaluate::{
    Classifier, Confusion, Evaluation, judge_leaving_one_out, leave_one_illumination_out,
};
pub use experts::{ColourExpert, EvidenceExpert, LogRadianceExpert, light_spectrum};
pub use finishes::{
    FinishShots, FinishTable, Outline, ThingTally, finish_cross_entropy, finish_samples,
    judge_finishes, judge_things, learned_and_judged,
};
pub use harness::{Harness, Method};
pub use interval::{mcnemar, wilson};
pub use light_coverage::{
    Held, LightCoverage, LightLikeness, LightShots, ReflectanceKnowledge, light_coverage,
};
pub use nearest::{NearestNeighbour, Scaling};
pub use protocol::Protocol;
pub use simulation::{Nuisances, SimulatedPhotograph, Thing, simulate, simulate_thing};
