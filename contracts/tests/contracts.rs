//! Every contract, one test each, and that `ACCURACY.md` tells what they measure.

use std::path::Path;
use std::process::ExitCode;
use std::sync::{LazyLock, OnceLock};

use libtest_mimic::{Arguments, Failed, Trial};
use lobes::Result;
use lobes_contracts::{Contract, Measured, Measurement, Oracle, Snapshots, contracts, print};
use sha2::{Digest, Sha256};

type Outcome = std::result::Result<(), Failed>;

const REMEDY: &str = "run cargo run -- accuracy > ACCURACY.md";

static ROOT: LazyLock<&Path> =
    LazyLock::new(|| Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")));
static SNAPSHOTS: LazyLock<Snapshots> =
    LazyLock::new(|| Snapshots::new(ROOT.join("oracles/snapshots")));
static CONTRACTS: LazyLock<Vec<Contract>> = LazyLock::new(contracts);
// Each contract is measured once, by whichever test asks first.
static MEASURED: LazyLock<Vec<OnceLock<Result<Measurement>>>> =
    LazyLock::new(|| CONTRACTS.iter().map(|_| OnceLock::new()).collect());

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials: Vec<Trial> = (0..CONTRACTS.len())
        .map(|i| Trial::test(CONTRACTS[i].id, move || holds(i)))
        .collect();
    trials.push(Trial::test("ids-are-unique-and-well-formed", ids));
    trials.push(Trial::test("every-snapshot-is-used-and-fresh", snapshots));
    trials.push(Trial::test("accuracy-md-is-current", accuracy));
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn measured(i: usize) -> &'static Result<Measurement> {
    MEASURED[i].get_or_init(|| CONTRACTS[i].measure(&SNAPSHOTS))
}

fn holds(i: usize) -> Outcome {
    match CONTRACTS[i].verdict(measured(i).as_ref()?) {
        None => Ok(()),
        Some(problem) => Err(problem.into()),
    }
}

fn ids() -> Outcome {
    let mut seen = std::collections::BTreeSet::new();
    for contract in CONTRACTS.iter() {
        let id = contract.id;
        let well_formed = id.split('/').count() == 2
            && id
                .chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-/".contains(c));
        if !well_formed {
            return Err(format!("{id:?} is not of the form subject/what-is-promised").into());
        }
        if !seen.insert(id) {
            return Err(format!("{id:?} stands twice").into());
        }
        let cells = [contract.function, contract.domain, contract.why];
        if cells
            .iter()
            .any(|cell| cell.is_empty() || cell.contains(" | "))
        {
            return Err(format!("{id:?} leaves a cell empty or puts a | in one").into());
        }
    }
    Ok(())
}

fn snapshots() -> Outcome {
    for entry in std::fs::read_dir(ROOT.join("oracles/snapshots"))? {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let snapshot = SNAPSHOTS.subject(&stem)?;
        let from = &snapshot.provenance;
        if from.subject != stem {
            return Err(format!("{stem}.json says that its subject is {}", from.subject).into());
        }
        let script = std::fs::read(ROOT.join(&from.script))?;
        let digest: String = Sha256::digest(&script)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        if from.script_sha256 != digest {
            return Err(format!(
                "{} has changed since it made {stem}.json; run {}",
                from.script, from.command
            )
            .into());
        }
        let used = |contract: &Contract| match contract.oracle {
            Oracle::Snapshot(subject) => subject == stem,
            Oracle::Identity(_) => false,
        };
        if !CONTRACTS.iter().any(used) {
            return Err(format!("no contract reads {stem}.json").into());
        }
    }
    Ok(())
}

fn accuracy() -> Outcome {
    let all: Vec<Measured> = (0..CONTRACTS.len())
        .map(|i| (CONTRACTS[i], measured(i).clone()))
        .collect();
    let fresh = print(&SNAPSHOTS, &all);
    let committed = std::fs::read_to_string(ROOT.join("ACCURACY.md"))?;
    for (fresh, committed) in fresh.lines().zip(committed.lines()) {
        if !agree(fresh, committed) {
            return Err(
                format!("it says\n{committed}\nwhere this is true:\n{fresh}\n{REMEDY}").into(),
            );
        }
    }
    let [now, then] = [&fresh, &committed].map(|page| page.lines().count());
    if now != then {
        return Err(format!("it has {then} lines where {now} are printed now; {REMEDY}").into());
    }
    Ok(())
}

/// Whether two lines agree but for what rounding may change: where the largest error lies, and the
/// errors themselves by a factor of four, or by any factor where both are tiny beside the bound.
fn agree(fresh: &str, committed: &str) -> bool {
    const COLUMNS: usize = 10;
    const LARGEST: usize = 5;
    const MEAN: usize = 6;
    const WHERE: usize = 7;
    const BOUND: usize = 8;
    if fresh == committed {
        return true;
    }
    let fresh: Vec<&str> = fresh.split(" | ").collect();
    let committed: Vec<&str> = committed.split(" | ").collect();
    if fresh.len() != COLUMNS || committed.len() != COLUMNS {
        return false;
    }
    let number = |cells: &[&str], column: usize| cells[column].parse::<f64>().ok();
    (0..COLUMNS).all(|column| {
        if fresh[column] == committed[column] || column == WHERE {
            return true;
        }
        let numbers = (
            number(&fresh, column),
            number(&committed, column),
            number(&fresh, BOUND),
        );
        match numbers {
            (Some(a), Some(b), Some(bound)) if [LARGEST, MEAN].contains(&column) => {
                (a <= 4.0 * b && b <= 4.0 * a) || a.max(b) <= bound / 100.0
            }
            _ => false,
        }
    })
}
