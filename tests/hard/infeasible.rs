//! H50.

use super::limited;
use taut_ground::Choice;
use taut_studies::hard::numerics::infeasible::{BAR, Rigid, compliant, rigid};
use taut_studies::hard::solvers;

#[test]
fn the_checks_of_the_overstretched_cable_pass() {
    limited("H50", &[]);
}

#[test]
fn an_overstretched_cable_is_drawn_to_ea_times_strain() {
    for choice in solvers() {
        let error = compliant(&choice, None).expect("an equilibrium");
        assert!(error <= BAR, "{choice}: {error:e}");
    }
}

/// Iterations see it when what they have left to do is the same from sweep to sweep.
#[test]
fn an_overstretched_rigid_cable_is_refused_by_every_solver() {
    for choice in solvers() {
        let choice = Choice {
            backend: choice.backend.with_iterations(200),
            form: choice.form,
        };
        let found = rigid(&choice, 0.5, true).expect("a scene");
        assert!(
            matches!(found, Rigid::Refused { typed: true, .. }),
            "{choice}: {found:?}"
        );
    }
}
