//! The tests of the `lobes` command.
mod behaviour;
mod document;
mod faults;
mod ggx_document;
mod training_set;
mod verbs;
mod ward_document;
