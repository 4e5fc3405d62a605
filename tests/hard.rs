//! The hard cases in their short form, and the scenes with branches and loops.

mod contacts;
mod dynamics;
mod infeasible;
mod networks;
mod numerics;
mod redundant;
mod statics;

use indicatif::ProgressBar;
use taut_ground::Choice;
use taut_output::check::{Check, Verdict};

/// The checks of a case, none of which fails.
fn checks(name: &str) -> Vec<Check> {
    let case = taut_studies::hard::named(name).expect("a case");
    let outcome = case.outcome(true, &ProgressBar::hidden()).expect("runs");
    let failed = |c: &&Check| matches!(c.verdict, Verdict::Fail | Verdict::NotYet);
    let failed: Vec<_> = outcome.checks.iter().filter(failed).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    outcome.checks
}

/// The checks of a case, of which those rows are at their limit and no others. A row that ends in the name of a solver is
/// there where this is compiled in.
fn limited(name: &str, rows: &[&str]) -> Vec<Check> {
    limited_but(name, rows, "")
}

/// The same, but for the rows that begin with `rounding` (no row where that is empty), which are at their limit or pass as
/// rounding will have it.
fn limited_but(name: &str, rows: &[&str], rounding: &str) -> Vec<Check> {
    let checks = checks(name);
    let decided = |c: &&Check| rounding.is_empty() || !c.case.starts_with(rounding);
    let compiled = |row: &&str| {
        let solver = row
            .rsplit(": ")
            .next()
            .and_then(|s| s.parse::<Choice>().ok());
        solver.is_none_or(|choice| choice.check().is_ok())
    };
    let mut expected: Vec<&str> = rows.iter().copied().filter(compiled).collect();
    let limits = checks.iter().filter(|c| c.verdict == Verdict::Limit);
    let mut found: Vec<&str> = limits.filter(decided).map(|c| c.case.as_str()).collect();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected, "{name}: {checks:#?}");
    assert!(checks.iter().any(|c| c.verdict == Verdict::Pass), "{name}");
    checks
}
