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

#[test]
fn what_rests_throws_back_as_the_ground_does() {
    holds(include_str!("cases/supports.toml"));
}

#[test]
fn what_arrives_in_one_step_gains_nothing() {
    holds(include_str!("cases/arrivals.toml"));
}

#[test]
fn forces_of_an_instant_have_their_impulse() {
    holds(include_str!("cases/instants.toml"));
}

#[test]
fn blows_follow_their_law_beside_what_holds_or_slips() {
    holds(include_str!("cases/blows.toml"));
}

#[test]
fn contacts_carry_and_decide_what_formulas_say() {
    holds(include_str!("cases/contacts.toml"));
}

#[test]
fn what_lies_or_rides_stays_in_its_place() {
    holds(include_str!("cases/riding.toml"));
}

#[test]
fn drives_at_their_limits_pay_for_what_they_move() {
    holds(include_str!("cases/limits.toml"));
}
