//! The tests of the library, a module a subject: one program, so that the library is linked once.

mod adaptation;
mod classify_evidence;
mod classify_experts;
mod classify_protocols;
mod features;
mod harmonics;
mod harmonics_partial;
mod illumination;
mod illumination_files;
mod mapping;
#[cfg(feature = "contracts")]
mod operator;
mod outline;
mod pictures;
mod reflectance_approximation;
mod reflectance_closed_forms;
mod reflectance_document;
mod reflectance_fit;
mod reflectance_frequency;
mod reflectance_input;
mod reflectance_sampling;
mod reflection;
mod reflection_exact;
mod reflection_reference;
#[cfg(feature = "builtin")]
mod scenes;
#[cfg(all(feature = "parallel", feature = "builtin"))]
mod threads;
