//! Each kind of vector instructions that the machine has keeps every contract: `LOBES_VECTORS`
//! forces one, in a process of its own.
use std::path::Path;
use std::process::Command;

use lobes::Parallelism;
use lobes_contracts::{Snapshots, measure_all};

const FORCED: &str = "LOBES_VECTORS";

/// From the widest.
const PATHS: [&str; 3] = ["avx512", "avx2", "baseline"];

/// The contracts hold with the vectors that were forced; with those that the machine would choose,
/// `tests/contracts.rs` says so.
#[test]
fn contracts_hold() {
    if std::env::var_os(FORCED).is_none() {
        return;
    }
    println!("computed with {}", lobes::vectors());
    let snapshots = Snapshots::find(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
    let measured = measure_all(&snapshots, Parallelism::Rayon);
    assert!(measured.len() >= 80, "{} contracts", measured.len());
    for (contract, measurement) in measured {
        let largest = measurement.unwrap().largest;
        // How tight a bound is, is judged with the widest.
        assert!(
            largest <= contract.bound,
            "{} with {}: {largest:e} of {:e}",
            contract.id,
            lobes::vectors(),
            contract.bound
        );
    }
}

#[test]
fn each_path_holds() {
    let own = PATHS.iter().position(|path| *path == lobes::vectors());
    let own = own.expect("one of the names");
    for path in &PATHS[own + 1..] {
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "contracts_hold", "--nocapture"])
            .env(FORCED, path)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        // Machines of another kind have the baseline only.
        if cfg!(target_arch = "x86_64") {
            assert!(said.contains(&format!("computed with {path}\n")), "{said}");
        }
        assert!(
            output.status.success(),
            "{said}{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
