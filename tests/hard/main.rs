//! The hard cases in their short form, and the scenes with branches and loops.

mod dynamics;
mod infeasible;
mod networks;
mod numerics;
mod redundant;
mod statics;

use indicatif::ProgressBar;
use taut_bench::check::{Check, Verdict};

/// The checks of a case, none of which fails.
fn checks(name: &str) -> Vec<Check> {
    let case = taut_bench::hard::named(name).expect("a case");
    let outcome = (case.run)(true, &ProgressBar::hidden()).expect("runs");
    let failed = |c: &&Check| matches!(c.verdict, Verdict::Fail | Verdict::NotYet);
    let failed: Vec<_> = outcome.checks.iter().filter(failed).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    outcome.checks
}
