//! H50.

use crate::checks;
use taut_bench::check::Verdict;
use taut_bench::hard::numerics::infeasible::{BAR, Rigid, compliant, rigid};
use taut_bench::hard::solvers;

#[test]
fn the_checks_of_the_overstretched_cable_pass() {
    let checks = checks("H50");
    let passed = checks.iter().filter(|c| c.verdict == Verdict::Pass).count();
    assert!(passed >= 4, "{checks:#?}");
}

#[test]
fn an_overstretched_cable_is_drawn_to_ea_times_strain() {
    for choice in solvers() {
        let error = compliant(&choice, None).expect("an equilibrium");
        assert!(error <= BAR, "{choice}: {error:e}");
    }
}

#[test]
fn an_overstretched_rigid_cable_is_refused_by_the_direct_solvers() {
    for choice in solvers().iter().filter(|c| !c.backend.is_iterative()) {
        let found = rigid(choice, 0.5, true).expect("a scene");
        assert!(
            matches!(found, Rigid::Refused { .. }),
            "{choice}: {found:?}"
        );
    }
}
