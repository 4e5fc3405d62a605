//! The command line `taut`, for solvers of other crates too ([`command_line`]), and its parts besides the experiments:
//! runs of a scene, the report, per-step figures for CI.
//! ```
//! use taut_bench::machine::Machine;
//!
//! // What stands beside every figure.
//! assert!(Machine::current().threads > 0);
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `run`, `run_file` | one scene, as `taut run` runs it; runs saved to files and resumed |
//! | `report` | the report as one HTML file |
//! | `track` | per-step figures that CI can trust: against a baseline, in turns with another program, run by run |
//! | `cli` | the commands |
//! | `machine` | what machine this is, and the command line that makes this build |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

mod cli;
pub mod machine;
pub mod report;
pub mod run;
pub mod run_file;
pub mod track;

pub use cli::command_line;
pub use taut_measure::allocations::Counting;
