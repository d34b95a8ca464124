//! How near a map from photographs of a mirror ball comes to the light about it: one simulated
//! bracket under each of the first built-in maps, two of them unless another number is given.
//!
//! `cargo run --release --example probe_accuracy -- 17` prints what docs/how-to/probe.md says.

use lobes::illumination::builtin;
use lobes::{Parallelism, Result};
use lobes_experiments::probe_accuracy;

fn row(name: &str, errors: &[f64], bar: f64) {
    let mut errors = errors.to_vec();
    errors.sort_by(f64::total_cmp);
    let (count, within) = (errors.len(), errors.iter().filter(|e| **e <= bar).count());
    if count > 0 {
        println!(
            "| {name} | {:.4} | {:.4} | {within} of {count} within {bar} |",
            errors[count / 2],
            errors[count * 95 / 100]
        );
    }
}

fn main() -> Result<()> {
    let asked = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let maps: Vec<_> = builtin()?.into_iter().take(asked.unwrap_or(2)).collect();
    let all = probe_accuracy(&maps, Parallelism::Rayon, &|| ())?;
    println!("| error | median | 95 % | bar |\n| --- | ---: | ---: | --- |");
    row("ratio of neighbouring exposures", &all.ratios, 0.01);
    row("radius, found", &all.radius, 0.003);
    for (which, circle) in ["found", "given"].into_iter().enumerate() {
        let name = format!("irradiance, circle {circle}");
        row(&name, &all.irradiance[which], 0.02);
    }
    for (which, circle) in ["found", "given"].into_iter().enumerate() {
        let name = format!("sun's direction in degrees, circle {circle}");
        row(&name, &all.sun[which], 0.5);
    }
    println!("\n{} of {} balls were not found.", all.missed, maps.len());
    Ok(())
}
