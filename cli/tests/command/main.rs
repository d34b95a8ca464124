//! The tests of the `lobes` command.
mod faults;
mod manners;
mod training_set;
mod verbs;
mod ward_document;
