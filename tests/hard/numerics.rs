//! H40 to H54 but for those with modules of their own, and what the solvers claim.

use super::{limited, limited_but};
use taut_studies::hard::numerics::angles::joints::{Kind, Pose, jacobian_error};
use taut_studies::hard::numerics::claims::{Finding, audit};
use taut_studies::hard::numerics::ill_conditioned::{self, matrices};
use taut_studies::hard::numerics::{long_run, rigid_limit};
use taut_studies::hard::solvers;

use indicatif::ProgressBar;
use std::f64::consts::PI;

#[test]
fn mass_ratios_are_climbed_as_predicted() {
    let rounding_of_s = [
        "S, unrefined: banded",
        "S, unrefined: faer:llt",
        "S, unrefined: faer:ldlt",
        "S, unrefined: faer:lu",
        "S, unrefined: nalgebra-sparse",
        "S, unrefined: umfpack:refinement=0",
        "S, unrefined: dense:double",
        "KKT, 1 refinement: faer:ldlt/kkt",
        "KKT in single precision, 1 refinement, straight",
        "swing for 60 s, R = 1e0",
    ];
    limited("H40", &rounding_of_s);
}

#[test]
fn angles_are_measured_up_to_their_singularities() {
    let scalar_angles_and_a_fold = [
        "Jacobian, paper: bend",
        "Jacobian, paper: twist",
        "Jacobian, paper: twist, alternative",
        "Jacobian, links: angle",
        "Jacobian, links: vector",
        "whirled through the fold for 4 s, 1/60 s",
    ];
    limited("H43", &scalar_angles_and_a_fold);
}

#[test]
fn direct_solvers_are_backward_stable_or_refuse_or_say_that_they_are_not() {
    limited("H46", &[]);
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
    limited("H49", &[]);
    let first = long_run::WINDOW;
    let windows = long_run::run(12 * first, &ProgressBar::hidden()).expect("steps");
    let steps: Vec<usize> = windows.iter().map(|w| w.steps).collect();
    assert_eq!(steps, [first, 10 * first, 12 * first]);
}

#[test]
fn stiff_joints_come_to_rigid_ones() {
    limited("H51", &[]);
    let direct = solvers().into_iter().find(|c| !c.backend.is_iterative());
    let limit = rigid_limit::limit(&direct.expect("a direct solver")).expect("solves");
    // Ten times the compliance, ten times the difference.
    let [a, b] = [limit.differences[3], limit.differences[4]];
    assert!((a / b - 10.0).abs() < 0.1, "{a:e} {b:e}");
}

#[test]
fn lost_runs_are_called_so() {
    limited("H58", &[]);
}

#[test]
fn ladders_go_up() {
    let unfinished = [
        "time step: gauss-seidel:groups",
        "iterations: load in 1 s: gauss-seidel:joints",
        "iterations: load in 1 s: gauss-seidel:groups",
        "iterations: load in 1 s: cg:none",
        "iterations: load in 1 s: cg:jacobi",
        "iterations: load in 1 s: cg:group",
        "iterations: load in 1 s: minres/kkt",
    ];
    limited("H54", &unfinished);
}

#[test]
fn no_solver_claims_adverse_systems() {
    limited("H57", &[]);
}

#[test]
fn no_solver_claims_what_is_not_so() {
    // By the letter the rounding of a residual may be more than an iteration's tolerance.
    limited_but("claims", &[], "claims, by the letter");
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
