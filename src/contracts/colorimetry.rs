//! Luminance against colour-science.

use serde::Deserialize;

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use crate::illumination::Luminance;
use crate::{Error, Result};

const ORACLE: Oracle = Oracle::Snapshot("colorimetry");

pub(super) fn contracts() -> Vec<Contract> {
    vec![
        Contract {
            id: "colorimetry/luminance",
            function: "illumination::Luminance::weights",
            oracle: ORACLE,
            domain: "BT.709's own row, and the row of Radiance's primaries and white",
            metric: Metric::Absolute,
            bound: 3e-9,
            why: "Radiance's row is written with nine digits; BT.709's four are the standard's own, and exact",
            loose: None,
            measure: luminance,
        },
        Contract {
            id: "colorimetry/luminance-of-primaries",
            function: "illumination::Luminance::weights",
            oracle: ORACLE,
            domain: "BT.709's row against the one that its primaries and D65 give",
            metric: Metric::Absolute,
            bound: 5e-5,
            why: "the standard rounds its row to four digits",
            loose: None,
            measure: luminance_of_primaries,
        },
    ]
}

#[derive(Deserialize)]
struct Row {
    weights: String,
    row: [f64; 3],
}

fn luminance(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    rows(snapshots, "luminance", tally)
}

fn luminance_of_primaries(snapshots: &Snapshots, tally: &mut Tally) -> Result<()> {
    rows(snapshots, "luminance-of-primaries", tally)
}

fn rows(snapshots: &Snapshots, name: &str, tally: &mut Tally) -> Result<()> {
    for case in snapshots.cases::<Row>("colorimetry", name)? {
        let weights = match case.weights.as_str() {
            "rec709" => Luminance::Rec709,
            "radiance" => Luminance::Radiance,
            other => {
                return Err(Error::Unanswerable(format!(
                    "there are no weights {other:?}"
                )));
            }
        };
        for (channel, (got, want)) in weights.weights().iter().zip(case.row).enumerate() {
            tally.compare(*got, want, || {
                format!("{}, {}", case.weights, ["red", "green", "blue"][channel])
            });
        }
    }
    Ok(())
}
