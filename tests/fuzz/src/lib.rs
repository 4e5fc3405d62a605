//! Fuzz targets: arbitrary bytes as scene files, as scenes, as systems, as Matrix Market files, as saved runs, as products
//! of features.
//!
//! The targets stand in `taut_tests::fuzzing`, so that the workspace's own tests call the same
//! functions on a stable toolchain, with mutated inputs and with the seeds. With a nightly
//! toolchain and `cargo install cargo-fuzz`, from the folder `tests`:
//!
//! ```text
//! cargo +nightly fuzz run scene_file fuzz/corpus/scene_file fuzz/seeds/scene_file -- -max_total_time=300
//! ```
//!
//! and so for `scene_builder`, `matrix_and_rhs`, `matrix_market`, `saved_run`, `recording`,
//! `products`; with `--features umfpack` UMFPACK is among the backends. New inputs go to
//! `fuzz/corpus`, which is not kept. An input that panics or takes too long is written to
//! `fuzz/artifacts`. Once it is mended it goes to `fuzz/seeds` under the name of its symptom, where
//! `cargo test -p taut-tests --test all refuses` keeps it mended (`products` for that target).
