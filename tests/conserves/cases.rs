//! Runs in the form of hard cases: each file says its scenes and what holds of them.

use indicatif::ProgressBar;
use taut_output::check::Verdict;
use taut_studies::hard::{Case, CaseFile, Measured};

fn holds(text: &str) {
    let file = CaseFile::parse(text).unwrap_or_else(|e| panic!("{e}"));
    let case = Case::File(Box::leak(Box::new(file)));
    let outcome = case.outcome(false, &ProgressBar::hidden()).expect("runs");
    let mut missed = outcome.checks;
    missed.retain(|check| check.verdict != Verdict::Pass);
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn ropes_catch_and_motors_press() {
    holds(include_str!("cases/caught.toml"));
}

#[test]
fn dampers_and_drums_gain_nothing() {
    holds(include_str!("cases/damped.toml"));
}

#[test]
fn contacts_beside_motors_and_ropes_undo_nothing() {
    holds(include_str!("cases/meeting.toml"));
}

#[test]
fn ropes_and_their_winches_throw_no_higher() {
    holds(include_str!("cases/ropes.toml"));
}
