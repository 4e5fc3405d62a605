//! Parts of H42, H46, H49, H50, H51 and of the audit of claims that no row shows.

use taut_ground::Choice;
use taut_studies::hard::numerics::angles::joints::{Kind, Pose, jacobian_error};
use taut_studies::hard::numerics::claims::{Finding, audit};
use taut_studies::hard::numerics::ill_conditioned::{self, matrices};
use taut_studies::hard::numerics::infeasible::{self, Rigid, compliant, rigid};
use taut_studies::hard::numerics::redundant::{self, Found, solve};
use taut_studies::hard::numerics::{long_run, rigid_limit};
use taut_studies::hard::solvers;

use indicatif::ProgressBar;
use std::f64::consts::PI;

#[test]
fn a_growth_beyond_rounding_is_not_claimed() {
    let specimens = matrices::specimens(true);
    let wilkinson = specimens.iter().filter(|s| s.growth > 1e16);
    let lost: Vec<_> = wilkinson
        .flat_map(ill_conditioned::rows)
        .filter(|r| r.backward_error > Some(ill_conditioned::BAR))
        .collect();
    assert!(lost.iter().all(|r| !r.claimed), "{lost:#?}");
}

#[test]
fn a_swing_goes_on_and_on() {
    let first = long_run::WINDOW;
    let windows = long_run::run(12 * first, &ProgressBar::hidden()).expect("steps");
    let steps: Vec<usize> = windows.iter().map(|w| w.steps).collect();
    assert_eq!(steps, [first, 10 * first, 12 * first]);
}

#[test]
fn stiff_joints_come_to_rigid_ones() {
    let direct = solvers().into_iter().find(|c| !c.backend.is_iterative());
    let limit = rigid_limit::limit(&direct.expect("a direct solver")).expect("solves");
    // Ten times the compliance, ten times the difference.
    let [a, b] = [limit.differences[3], limit.differences[4]];
    assert!((a / b - 10.0).abs() < 0.1, "{a:e} {b:e}");
}

/// The audit tells claims from mere answers: a solver with one iteration claims nothing, and is not good.
#[test]
fn an_unfinished_solve_is_an_honest_failure() {
    let scene = rigid_limit::scene(1e-9).expect("a scene");
    let found = audit("stiff", &scene, &[2]);
    assert!(found.ended.is_empty(), "{:?}", found.ended);
    let short = found.solves.iter().filter(|s| s.variant == "1 iterations");
    let mut counted = 0;
    for s in short.filter(|s| s.backend.starts_with("cg:none")) {
        assert_eq!(s.finding, Finding::Honest, "{s:?}");
        counted += 1;
    }
    let compiled = solvers().iter().any(|c| c.family() == "cg:none");
    assert_eq!(counted > 0, compiled);
}

/// A wrong Jacobian would be seen: the paper's bend row has one where its safeguard is not small against the angle.
#[test]
fn jacobians_that_are_off_are_seen() {
    let pose = Pose {
        turn: nalgebra::UnitQuaternion::identity(),
        across: 0.3,
        twist: 0.2,
    };
    let error = |kind, theta| jacobian_error(kind, theta, &pose);
    let safeguard = error(Kind::PaperBend, 1e-10);
    assert!(safeguard > 5e-5, "{safeguard:e}");
    assert!(error(Kind::Cosserat, 1e-10) < 1e-9);
    assert!(error(Kind::Cosserat, PI - 1e-9) < 1e-6);
}

#[test]
fn an_overstretched_cable_is_drawn_to_ea_times_strain() {
    for choice in solvers() {
        let error = compliant(&choice, None).expect("an equilibrium");
        assert!(error <= infeasible::BAR, "{choice}: {error:e}");
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

/// Exact factorisations of S or of its groups refuse the joint; iterations without them find
/// multipliers of the right sum.
#[test]
fn a_doubled_rigid_joint_is_refused_by_name_or_solved_with_the_right_sum() {
    let iterates = |c: &Choice| {
        ["gauss-seidel:joints", "cg:none", "cg:jacobi", "minres/kkt"].contains(&&*c.family())
    };
    for copies in [2, 3] {
        for choice in solvers() {
            let found = solve(copies, 0.0, &choice).expect("a result");
            let place = format!("{copies} × {choice}: {found:?}");
            match &found {
                Found::Refused { culprit, message } => {
                    assert!(!iterates(&choice), "{place}");
                    // UMFPACK says that the matrix is singular, not where.
                    let named = culprit.as_deref() == Some("copy-2");
                    assert!(named || choice.backend.name() == "umfpack", "{place}");
                    assert!(message.contains("singular"), "{place}");
                }
                Found::Shares { .. } => {
                    assert!(iterates(&choice), "{place}");
                    assert!(found.unbalanced() <= redundant::BAR, "{place}");
                    let least_norm = ["cg", "minres"].contains(&choice.backend.name());
                    assert_eq!(found.uneven() <= redundant::BAR, least_norm, "{place}");
                }
            }
        }
    }
}

#[test]
fn a_doubled_compliant_joint_shares_the_weight() {
    for copies in [2, 3] {
        for choice in solvers() {
            let found = solve(copies, 1e-6, &choice).expect("a result");
            assert!(
                found.uneven() <= redundant::BAR,
                "{copies} × {choice}: {found:?}"
            );
        }
    }
}
