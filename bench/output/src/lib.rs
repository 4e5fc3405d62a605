//! How results are shown: numbers as people write them, rows as tables, checks with their verdicts, charts.
//! ```
//! use taut_output::check::{Check, Verdict};
//!
//! // A reference, our number, their unit and the bar of the relative error.
//! let period = Check::relative("period", [2.0, 2.001], "s", 1e-3);
//! assert_eq!((period.verdict, period.ours.as_str()), (Verdict::Pass, "2.00100 s"));
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `notation` | how numbers are written for people |
//! | `settings` | settings of a run |
//! | `row`, `sheet`, `plan` | rows of any experiment, as text, as plots |
//! | `table` | text tables |
//! | `plot` | charts as SVG |
//! | `check` | a reference beside ours, error, bar, verdict: what the paper and the hard cases end in |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

pub mod check;
pub mod notation;
pub mod plan;
pub mod plot;
pub mod row;
pub mod settings;
pub mod sheet;
pub mod table;
