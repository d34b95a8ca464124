//! Turning an environment in coefficient space, without touching a pixel.
//!
//!     cargo run --release --example rotate_environment

use std::f64::consts::FRAC_PI_3;

use lobes::Parallelism;
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{Rotation, average_power, evaluate};
use lobes::illumination::builtin;
use lobes::sphere::to_harmonic;

fn main() -> lobes::Result<()> {
    let maps = builtin()?;
    let [_, light, _] = maps[0].coefficients(64, Parallelism::Rayon)?;

    // 60° about the world's vertical, which in the harmonic frame is another axis: turn the axis,
    // keep the angle.
    let turn = DQuat::from_axis_angle(to_harmonic(DVec3::Y), FRAC_PI_3);
    let turned = Rotation::new(64)?.rotate(&light, turn, Parallelism::Sequential)?;

    // What stood at d now stands at R d …
    let direction = DVec3::new(0.2, 0.5, -0.84).normalize();
    let before = evaluate(&light, to_harmonic(direction))?;
    let after = evaluate(&turned, turn * to_harmonic(direction))?;
    println!("{before:.12} before, {after:.12} after");
    assert!((before - after).abs() < 1e-11 * before.abs());

    // … and the power of each degree is what it was.
    let [before, after] = [&light, &turned].map(average_power);
    let off = before
        .iter()
        .zip(&after)
        .map(|(b, a)| (a / b - 1.0).abs())
        .fold(0.0, f64::max);
    println!("the power of each degree is kept to {off:.1e}");
    assert!(off < 1e-12);
    Ok(())
}
