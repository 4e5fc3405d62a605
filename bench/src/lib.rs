//! Parts of the command line `taut` besides the experiments: runs of a scene, the report, per-step figures for CI. The
//! commands are in `main.rs` and `cli/`.
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
//! | `run`, `columns`, `run_file` | one scene, as `taut run` runs it; what its tables hold; runs saved to files and resumed |
//! | `report` | the report as one HTML file |
//! | `track` | per-step figures that CI can trust: against a baseline, in turns with another program, run by run |
//! | `machine` | what machine this is, and the command line that makes this build |

pub mod columns;
pub mod machine;
pub mod report;
pub mod run;
pub mod run_file;
pub mod track;
