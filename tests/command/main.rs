//! The tests of the `lobes` command.
#![cfg(feature = "cli")]

mod faults;
mod manners;
mod training_set;
mod verbs;
