//! Tests across crates, a module for each guarantee: one binary, which links once.
//!
//! Elsewhere stand `allocates_nothing.rs`, alone for its allocator, and `golden`, where a test of the program says what it
//! prints (`golden/prints.rs`) and that it reads old files (`golden/reads_old_files.rs`).

mod agrees;
mod conserves;
mod converges;
mod deterministic;
mod exact;
mod refuses;
mod structure;
mod survives;
