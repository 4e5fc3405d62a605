//! H01 to H16, in their short form.

use super::checks;
use taut_output::check::{Check, Verdict};

/// The checks of a case, of which at least `passed` pass.
fn passing(name: &str, passed: usize) -> Vec<Check> {
    let checks = checks(name);
    let found = checks.iter().filter(|c| c.verdict == Verdict::Pass).count();
    assert!(found >= passed, "{name}: {found} of {passed}: {checks:#?}");
    checks
}

#[test]
fn loads_at_the_end_open_and_turn_every_joint_alike() {
    passing("H01", 4);
    passing("H02", 6);
    passing("H03", 3);
}

#[test]
fn cables_lie_along_their_routes() {
    passing("H60", 5);
}

#[test]
fn a_cantilever_bends_as_its_levers_say() {
    passing("H04", 9);
    passing("H14", 5);
}

#[test]
fn cables_bent_far_near_the_elastica_and_the_bow() {
    passing("H05", 6);
    passing("H06", 3);
}

#[test]
fn hanging_cables_are_their_catenaries() {
    passing("H07", 9);
    passing("H07d", 9);
    let checks = passing("H08", 12);
    // Only the error of 64 straight rods, which is one of space, counts as a limit.
    let limits = checks.iter().filter(|c| c.verdict == Verdict::Limit);
    for check in limits {
        let parts = check.parts;
        assert!(
            parts.algebraic < Some(1e-8) && parts.space > Some(1e-5),
            "{check:?}"
        );
    }
}

#[test]
fn columns_shafts_and_rings_buckle_where_they_must() {
    passing("H09", 2);
    passing("H10", 2);
    passing("H11", 1);
}

#[test]
fn the_shape_at_rest_is_one() {
    passing("H13", 5);
}

#[test]
fn what_starts_in_equilibrium_is_at_rest() {
    passing("H15", 15);
    assert!(checks("H16").iter().all(|c| c.verdict == Verdict::Pass));
    passing("H16", 2);
}
