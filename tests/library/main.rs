//! The tests of the library, a module a subject: one program, so that the library is linked once.

mod adaptation;
mod architecture;
mod documents;
mod evidence;
mod exchange;
mod features;
mod harmonics;
mod harmonics_partial;
mod illumination;
mod illumination_files;
mod light_tree;
mod mapping;
mod outline;
mod pictures;
mod reflectance_approximation;
mod reflectance_closed_forms;
mod reflectance_fit;
mod reflectance_frequency;
mod reflectance_ggx;
mod reflectance_input;
mod reflectance_sampling;
mod reflection;
mod reflection_exact;
mod reflection_reference;
mod scenes;
mod threads;
