//! Reflectance in the frequency domain.
//!
//! A surface filters the light that falls on it. On the sphere of directions that filter acts on
//! spherical harmonics, so the power spectrum of what a surface reflects tells what the surface is.
//! This crate holds the pieces, each checked against an oracle that shares no code with it, and the
//! classifier that they drive.
//!
//! The modules follow the data; each may use those above it, never those below.
//!
//! # Features
//!
//! | feature | what it adds |
//! | --- | --- |
//! | `parallel` (default) | threads for the plans that take a [`Parallelism`]; without it every plan runs on the caller's |
//! | `files` | readers and writers of images, light, measurements and materials: `files`, `exchange`, [`picture`] and [`illumination`] from paths and bytes |
//! | `builtin` | `illumination::builtin`, the seventeen maps, and the model of finishes; brings `files` |
//! | `serde` | what users keep, checked when it is read: materials, lobes, coefficients, spectra, settings, training sets, verdicts |

#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod sphere;

pub mod harmonics;

pub mod reflectance;

#[cfg(feature = "files")]
pub mod exchange;

#[cfg(feature = "files")]
pub mod files;

pub mod illumination;

pub mod reflection;

pub mod evaluation;

pub mod features;

pub mod picture;

pub mod probe;

pub mod inference;

mod cancellation;
mod error;

mod named;
mod numeric;
mod parallelism;
mod serialisation;
mod vectors;

pub use cancellation::Cancellation;
pub use error::{Error, Result, check_finite, check_length};
pub use glam;
pub use nalgebra;
pub use num_complex;
pub use parallelism::Parallelism;
pub use vectors::vectors;

/// The README's examples run with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// The tutorial's examples too.
#[cfg(doctest)]
#[doc = include_str!("../docs/tutorial.md")]
pub struct Tutorial;

/// And the gallery's.
#[cfg(doctest)]
#[doc = include_str!("../docs/gallery.md")]
pub struct Gallery;
