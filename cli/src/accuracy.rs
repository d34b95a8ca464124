//! `lobes accuracy`: what was promised and what is measured.

use std::path::Path;

use serde_json::json;

use crate::arguments::Accuracy;
use crate::console;
use crate::error::{Error, Result};
use lobes::Parallelism;
use lobes_contracts::{Snapshots, measure_all, print};

pub(super) fn run(options: &Accuracy) -> Result<()> {
    let snapshots = match &options.snapshots {
        Some(folder) if folder.is_dir() => Snapshots::new(folder),
        Some(folder) => {
            return Err(Error::file(
                folder,
                "there is no such folder",
                "name the folder of the oracles' snapshots",
            ));
        }
        None => Snapshots::find(Path::new("."))?,
    };
    let measured = measure_all(&snapshots, Parallelism::Rayon);
    console::answer(print(&snapshots, &measured).trim_end());
    for (contract, result) in &measured {
        console::json(&match result {
            Ok(measurement) => json!({
                "id": contract.id,
                "function": contract.function,
                "bound": contract.bound,
                "largest": measurement.largest,
                "mean": measurement.mean,
                "points": measurement.points,
                "at": measurement.at,
                "broken": contract.verdict(measurement),
            }),
            Err(error) => json!({ "id": contract.id, "error": error.to_string() }),
        })?;
    }
    let broken = measured
        .iter()
        .filter(|(contract, result)| match result {
            Ok(measurement) => contract.verdict(measurement).is_some(),
            Err(_) => true,
        })
        .count();
    if broken == 0 {
        Ok(())
    } else {
        Err(Error::Partly {
            failed: broken,
            total: measured.len(),
            what: "contracts do not hold here; `cargo test --test contracts` says how".into(),
        })
    }
}
