//! Each kind of vector instructions that the machine has keeps the contracts: `LOBES_VECTORS` forces one, in a process of its own.
#![cfg(feature = "contracts")]

use std::path::Path;
use std::process::Command;

use lobes::contracts::{Snapshots, contracts};

/// From the widest.
const PATHS: [&str; 3] = ["avx512", "avx2", "baseline"];

/// What vectors compute.
const SUBJECTS: [&str; 6] = [
    "basis",
    "transform",
    "convolution",
    "rotation",
    "convention",
    "reflectance",
];

/// Exact properties of hundreds of rotations, which `rotation/highest-degree` and its like need no seconds for.
const LONG: [&str; 3] = [
    "rotation/there-and-back",
    "rotation/composition",
    "rotation/power",
];

/// The contracts hold with the vectors of this process.
#[test]
fn contracts_hold() {
    println!("computed with {}", lobes::vectors());
    let snapshots = Snapshots::find(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
    let mut count = 0;
    for contract in contracts() {
        if SUBJECTS.contains(&contract.subject()) && !LONG.contains(&contract.id) {
            let largest = contract.measure(&snapshots).unwrap().largest;
            // How tight a bound is, is judged with the widest.
            assert!(
                largest <= contract.bound,
                "{} with {}: {largest:e} of {:e}",
                contract.id,
                lobes::vectors(),
                contract.bound
            );
            count += 1;
        }
    }
    assert!(count >= 30, "{count} contracts");
}

#[test]
fn each_path_holds() {
    let own = PATHS.iter().position(|path| *path == lobes::vectors());
    let own = own.expect("one of the names");
    for path in &PATHS[own + 1..] {
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "contracts_hold", "--nocapture"])
            .env("LOBES_VECTORS", path)
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
