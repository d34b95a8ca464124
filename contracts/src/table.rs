//! The table of what was promised and what was measured, in Markdown.

use std::fmt::Write;

use super::{Contract, Measurement, Oracle, Snapshots, contracts};
use lobes::{Parallelism, Result};

/// A contract and what was found when it was measured.
pub type Measured = (Contract, Result<Measurement>);

/// Measures every contract, in order.
pub fn measure_all(snapshots: &Snapshots, parallelism: Parallelism) -> Vec<Measured> {
    let contracts = contracts();
    parallelism.map(contracts.len(), |i| {
        (contracts[i], contracts[i].measure(snapshots))
    })
}

/// Measures every contract and prints the whole table: the contents of `ACCURACY.md`.
pub fn table(snapshots: &Snapshots) -> String {
    print(snapshots, &measure_all(snapshots, Parallelism::Rayon))
}

/// Prints the table of these measurements.
pub fn print(snapshots: &Snapshots, measured: &[Measured]) -> String {
    let mut page = String::from(HEAD);
    let mut metrics: Vec<_> = measured
        .iter()
        .map(|(contract, _)| contract.metric)
        .collect();
    metrics.sort_unstable_by_key(|metric| metric.name());
    metrics.dedup_by_key(|metric| metric.name());
    for metric in metrics {
        line(
            &mut page,
            format_args!("- *{}*: {}.", metric.name(), metric.definition()),
        );
    }
    for group in measured.chunk_by(|a, b| a.0.subject() == b.0.subject()) {
        subject(&mut page, snapshots, group);
    }
    page
}

const HEAD: &str = "\
# Accuracy

Printed by `lobes accuracy`; `cargo test --test contracts` measures it again and fails past any bound.
It also fails where a bound is more than ten times what is measured, unless the contract says why it has to be.
Rounding differs between processors, so the last digit of a measured value may too.

Errors are counted as

";

fn subject(page: &mut String, snapshots: &Snapshots, group: &[Measured]) {
    line(page, format_args!("\n## {}\n", group[0].0.subject()));
    let mut oracles: Vec<_> = group
        .iter()
        .filter_map(|(contract, _)| match contract.oracle {
            Oracle::Snapshot(subject) => Some(subject),
            Oracle::Identity(_) => None,
        })
        .collect();
    oracles.sort_unstable();
    oracles.dedup();
    for subject in oracles {
        match snapshots.subject(subject) {
            Ok(snapshot) => {
                let from = &snapshot.provenance;
                let versions: Vec<_> = from
                    .oracle
                    .iter()
                    .map(|(name, version)| format!("{name} {version}"))
                    .collect();
                line(
                    page,
                    format_args!(
                        "Oracle *{subject}*: {}; {}; `{}`, {}.\n",
                        versions.join(", "),
                        from.precision,
                        from.script,
                        from.date
                    ),
                );
            }
            Err(error) => line(page, format_args!("Oracle *{subject}*: {error}.\n")),
        }
    }
    line(
        page,
        format_args!(
            "| contract | function | domain | oracle | points | largest error | mean error | where | bound | metric |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
        ),
    );
    for (contract, measured) in group {
        row(page, contract, measured);
    }
    page.push('\n');
    for (contract, _) in group {
        let loose = match contract.loose {
            Some(why) => format!(" Not within ten times of what is measured: {why}."),
            None => String::new(),
        };
        line(
            page,
            format_args!("- `{}`: {}.{loose}", contract.id, contract.why),
        );
    }
}

fn row(page: &mut String, contract: &Contract, measured: &Result<Measurement>) {
    let [points, largest, mean, at] = match measured {
        Ok(measured) => [
            measured.points.to_string(),
            number(measured.largest),
            number(measured.mean),
            measured.at.replace('|', "\\|"),
        ],
        Err(error) => ["–".into(), "–".into(), "–".into(), error.to_string()],
    };
    let oracle = match contract.oracle {
        Oracle::Snapshot(subject) => subject,
        Oracle::Identity(identity) => identity,
    };
    let metric = match contract.metric {
        super::Metric::Scaled(scale) => format!("scaled by {scale}"),
        metric => metric.name().into(),
    };
    line(
        page,
        format_args!(
            "| `{}` | `{}` | {} | {oracle} | {points} | {largest} | {mean} | {at} | {} | {metric} |",
            contract.id,
            contract.function,
            contract.domain,
            number(contract.bound)
        ),
    );
}

fn number(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else {
        format!("{value:.1e}")
    }
}

fn line(page: &mut String, text: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = writeln!(page, "{text}");
}
