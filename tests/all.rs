//! Tests across crates, a module for each theme: one binary, which links once.

mod agreement;
mod bad_input;
mod dynamics;
mod hard;
mod paper;
mod properties;
mod statics;
