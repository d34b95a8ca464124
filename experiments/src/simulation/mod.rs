//! Simulated photographs of balls: what a model of finishes learns from and is judged on.
//!
//! A ball under one light shows I(x) = ρ_d(x) D(x) + ρ_s(x) S_σ(x), D what a white Lambertian ball
//! shows and S_σ what Ward's lobe alone does, both rendered once. So any albedo that varies costs a
//! product a pixel, and a normal that is tilted shows D and S where a plain ball has that normal.
//! Everything is drawn by `Pcg64` from a seed.

mod camera;
mod disc;
mod draw;
mod light;
mod noise;
mod nuisances;
mod photograph;
mod place;
mod surface;
mod things;

pub use nuisances::Nuisances;
pub use photograph::{SimulatedPhotograph, simulate};
pub use things::{Thing, simulate_thing};
