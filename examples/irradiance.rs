//! What irradiance does a map give a surface that faces this way?
//!
//!     cargo run --release --example irradiance
//!
//! Nine numbers a channel answer it to a few percent (Ramamoorthi and Hanrahan 2001,
//! doi:10.1145/383259.383317), a few hundred to as many digits as the map has: `E(n) = Σ A_l L_lm
//! Y_lm(n)`, `A_l` = π, 2π/3, π/4, 0, −π/24 …

use lobes::glam::DVec3;
use lobes::harmonics::{convolve_zonal, evaluate};
use lobes::illumination::builtin;
use lobes::reflectance::{Material, Variant, lambert};
use lobes::sphere::to_harmonic;
use lobes::{Parallelism, reflection};

fn main() -> lobes::Result<()> {
    let maps = builtin()?;
    let map = &maps[0];
    let normal = DVec3::new(0.3, 0.8, 0.52).normalize();
    // The truth: the integral over the map's pixels, to eight digits. A white surface sends E/π
    // back.
    let white = Material::white();
    let truth = reflection::reference(map, &white, Variant::Ward1992, normal, normal, 1e-8)?.value;
    println!("{}: E/π = {truth:.6?} at {normal:.3}", map.name());
    for (degree, within) in [(2, 0.1), (16, 0.005), (64, 0.002)] {
        let light = map.coefficients(degree, Parallelism::Rayon)?;
        let mut seen = [0.0; 3];
        for (seen, mut channel) in seen.iter_mut().zip(light) {
            convolve_zonal(&mut channel, &lambert::transfers(degree)?)?;
            *seen = evaluate(&channel, to_harmonic(normal))? / std::f64::consts::PI;
        }
        let off = (0..3)
            .map(|c| (seen[c] / truth[c] - 1.0).abs())
            .fold(0.0, f64::max);
        println!(
            "to degree {degree:2}: {seen:.6?}, off by {:.3} %",
            100.0 * off
        );
        assert!(off < within);
    }
    Ok(())
}
