//! The tests of the `lobes` command.
mod behaviour;
mod faults;

mod training_set;
mod verbs;
mod ward_document;
