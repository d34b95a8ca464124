//! Naming the material: nearest neighbour, leave-one-illumination-out, intervals.

mod evaluate;
mod interval;
mod nearest;
mod protocol;

pub use evaluate::{Classifier, Confusion, Evaluation, leave_one_illumination_out};
pub use interval::wilson;
pub use nearest::{NearestNeighbour, Scaling};
pub use protocol::{Dataset, Observation, paper_dataset};
