//! The tests of the experiments, a module a subject.

mod experts;
mod protocols;
mod scenes;
mod threads;
