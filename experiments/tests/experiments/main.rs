//! The tests of the experiments, a module a subject.

mod experts;
mod finishes;
mod known_light;
mod protocols;
mod scenes;
mod threads;
