//! Simulation-based calibration of the evidence: ranks of what draws of the model's own prior are
//! made of among their posteriors.
//!
//! ```text
//! cargo run --release -p lobes-experiments --example simulated_ranks -- --draws 1000
//! ```
//!
//! Twenty bins, χ² of 19 degrees of freedom: each of the three is above 36.19 in one of a hundred
//! runs of code that is right.

use lobes::{Parallelism, Result};
use lobes_experiments::{SimulatedRanks, simulated_ranks};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let draws: usize = arguments
        .iter()
        .position(|argument| argument == "--draws")
        .and_then(|at| arguments.get(at + 1)?.parse().ok())
        .unwrap_or(100);
    let bins = SimulatedRanks::BINS;
    println!("| of | χ² of {bins} bins, {draws} draws | probability of more |");
    println!("| --- | ---: | ---: |");
    for of in simulated_ranks(draws, Parallelism::Rayon)? {
        let (square, more) = of.uniformity();
        println!("| {} | {square:.1} | {more:.3} |", of.parameter);
        assert!(more > 1e-4, "{}: χ² {square}", of.parameter);
    }
    Ok(())
}
