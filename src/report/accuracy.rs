//! The accuracy table as data.

use serde::{Deserialize, Serialize};

use crate::classify::Evaluation;

/// One observation that was named wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedConfusion {
    /// The illumination's name.
    pub illumination: String,
    /// The material's name.
    pub truth: String,
    /// The name that was given.
    pub said: String,
}

/// One row of the accuracy table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyRow {
    /// Which images, scaled how: `paper`, `blind`, ….
    pub protocol: String,
    /// Which classifier.
    pub classifier: String,
    /// How features were scaled, or `-` for a classifier without any.
    pub scaling: String,
    /// How the unseen half of the sphere was filled, or `-`.
    pub continuation: String,
    /// Which lobe the spheres were rendered with.
    pub lobe: String,
    /// How many were named right.
    pub correct: usize,
    /// How many there were.
    pub total: usize,
    /// correct / total.
    pub accuracy: f64,
    /// Wilson's 95 % interval.
    pub ci95: [f64; 2],
    /// Those that were named wrong.
    pub confusions: Vec<NamedConfusion>,
}

impl AccuracyRow {
    /// The row of one evaluation.
    pub fn new(
        protocol: &str,
        classifier: &str,
        scaling: &str,
        continuation: &str,
        lobe: &str,
        evaluation: &Evaluation,
        confusions: Vec<NamedConfusion>,
    ) -> Self {
        let (low, high) = evaluation.interval();
        Self {
            protocol: protocol.to_owned(),
            classifier: classifier.to_owned(),
            scaling: scaling.to_owned(),
            continuation: continuation.to_owned(),
            lobe: lobe.to_owned(),
            correct: evaluation.correct(),
            total: evaluation.total(),
            accuracy: evaluation.accuracy(),
            ci95: [low, high],
            confusions,
        }
    }
}

/// `accuracy.json`: the rows, and what made them. It holds no time and no path, so the same command
/// writes the same bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyFile {
    /// The crate's version.
    pub lobes: String,
    /// What was set, by name.
    pub settings: serde_json::Value,
    /// The rows.
    pub rows: Vec<AccuracyRow>,
}
