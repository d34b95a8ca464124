//! The accuracy table as data.

use serde::{Deserialize, Serialize};

use lobes::reflectance::Finish;
use lobes_experiments::Evaluation;

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
    /// How many were given a material of the right finish.
    pub finish: usize,
    /// Those that were named wrong.
    pub confusions: Vec<NamedConfusion>,
}

/// Two classifiers on the same pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Which pictures.
    pub protocol: String,
    /// One classifier.
    pub first: String,
    /// The other.
    pub second: String,
    /// How many were named right by the first alone.
    pub first_alone: usize,
    /// How many were named right by the second alone.
    pub second_alone: usize,
    /// McNemar's exact p.
    pub p: f64,
}

impl AccuracyRow {
    /// The row of one evaluation by a classifier that has no scaling, continuation or lobe to its
    /// name.
    pub fn new(
        protocol: &str,
        classifier: &str,
        evaluation: &Evaluation,
        finishes: &[Finish],
        confusions: Vec<NamedConfusion>,
    ) -> Self {
        let (low, high) = evaluation.interval();
        Self {
            protocol: protocol.to_owned(),
            classifier: classifier.to_owned(),
            scaling: "-".to_owned(),
            continuation: "-".to_owned(),
            lobe: "-".to_owned(),
            correct: evaluation.correct(),
            total: evaluation.total(),
            accuracy: evaluation.accuracy(),
            ci95: [low, high],
            finish: evaluation.correct_finish(finishes),
            confusions,
        }
    }
}

/// How well two materials that differ in colour alone can be told apart at the best, and how often
/// they were not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CeilingRow {
    /// Which pictures.
    pub protocol: String,
    /// The one material.
    pub first: String,
    /// The other.
    pub second: String,
    /// How many pictures of the two there are.
    pub pictures: usize,
    /// The share of them that is named right at the best, by the colour of the light alone.
    pub rate: f64,
    /// The 95 % interval of the rate.
    pub ci95: [f64; 2],
    /// How many of them the combined classifier gave the other's name.
    pub confused: usize,
}

/// How many pictures of a protocol could be named right by whoever fails at nothing but at colours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BestRow {
    /// Which pictures.
    pub protocol: String,
    /// How many.
    pub total: usize,
    /// How many of them are right, and the ends of the 95 % interval.
    pub best: [f64; 3],
}

/// How well the reflectance was read off pictures of random ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContinuousRow {
    /// Who read it: `evidence`, `learned` or `both`.
    pub reader: String,
    /// How many pictures.
    pub count: usize,
    /// The median of the relative error of σ.
    pub sigma_error: f64,
    /// The median of the absolute error of the specular share.
    pub share_error: f64,
    /// (level, coverage of σ, coverage of the share) of the central credible intervals.
    pub coverage: Vec<(f64, f64, f64)>,
}

/// How `lobes classify` read files of one kind, under light that it had not learned from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FilesRow {
    /// What the files are.
    pub kind: String,
    /// How many files there were.
    pub total: usize,
    /// How many of them it could read.
    pub read: usize,
    /// How many were named right.
    pub correct: usize,
    /// How many were given a material of the right finish.
    pub finish: usize,
    /// How many were more likely none of the materials than any one of them.
    pub strange: usize,
    /// How far each circle was off, in radii of the sphere: the centre or the radius, whichever is
    /// more. Rising.
    pub circle_errors: Vec<f64>,
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
    /// Every classifier against the combined one.
    pub comparisons: Vec<Comparison>,
    /// What the colour of the light allows, for each pair of materials that differ in colour alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ceilings: Vec<CeilingRow>,
    /// The same for all pictures of each protocol.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub best: Vec<BestRow>,
    /// The protocol `continuous`, where it was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub continuous: Vec<ContinuousRow>,
    /// The trial of `lobes classify`, where it was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<FilesRow>,
}
