//! Golden files: outputs of the program, frozen in this folder.
//!
//! | files | of |
//! |---|---|
//! | `bench.rows`, `hard.rows`, `paper.rows`, `static.rows` | the study, `--quick` |
//! | `runs.rows` | the state of each named scene after 20 steps |
//! | `scenes/NAME.toml` | `taut scene NAME`, to the byte |
//! | `saved/NAME.json`, `saved/NAME.tape` | saved runs and recordings, which later versions read or refuse by name |
//!
//! A `.rows` file has the names of its columns in the first line and one row in each other. Rows are the same where
//! their texts are; numbers, alone or within a text, agree to [`prints::RELATIVE`] of the larger one or to
//! [`prints::ABSOLUTE`]. Times and what follows from them are left out. The files are written anew with
//!
//! ```text
//! TAUT_GOLDEN=write cargo test -p taut-bench --features umfpack --test golden -- --include-ignored
//! ```
//!
//! and the difference is what a reviewer reads. `hard`, `paper` and `static` take minutes: `--ignored` compares them, as
//! `.ci/weekly` does. Files of `saved` are written where there are none and stay as they are.

mod prints;
mod reads_old_files;
mod rows;
