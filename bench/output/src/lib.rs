//! How results are shown: numbers as people write them, rows as tables, checks with their verdicts, charts.
//! ```
//! use taut_output::check::{Check, Verdict};
//!
//! // A reference, what comes out here, the error between them and its bar.
//! let period = Check::within("period", "2 s".to_owned(), "2.001 s".to_owned(), 5e-4, 1e-3);
//! assert_eq!(period.verdict, Verdict::Pass);
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `notation` | how numbers are written for people |
//! | `settings`, `sheet`, `plan` | what a run was set to, its rows as text, its rows as plots |
//! | `table` | text tables |
//! | `plot` | charts as SVG |
//! | `check` | a reference beside ours, error, bar, verdict: what the paper and the hard cases end in |

pub mod check;
pub mod notation;
pub mod plan;
pub mod plot;
pub mod settings;
pub mod sheet;
pub mod table;
