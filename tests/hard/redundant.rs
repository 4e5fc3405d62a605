//! H42.

use super::limited;
use taut_ground::Choice;
use taut_output::check::Verdict;
use taut_studies::hard::numerics::redundant::{BAR, Found, solve};
use taut_studies::hard::solvers;

#[test]
fn the_checks_of_dependent_constraints_pass() {
    let limits = [
        "joint × 2, ε = 1e-10 m/N: gauss-seidel:joints",
        "joint × 2, ε = 0: gauss-seidel:joints",
        "joint × 3, ε = 1e-10 m/N: gauss-seidel:joints",
        "joint × 3, ε = 0: gauss-seidel:joints",
        "Bricard, ε > 0: default",
        "1 four-bars, ε > 0: default",
        "3 four-bars, ε > 0: default",
        "Bricard, ε > 0: paper",
        "1 four-bars, ε > 0: paper",
        "3 four-bars, ε > 0: paper",
        "Bricard, ε > 0: spook",
        "1 four-bars, ε > 0: spook",
        "3 four-bars, ε > 0: spook",
    ];
    let checks = limited("H42", &limits);
    let rigid = |c: &&taut_output::check::Check| c.reference.contains("singular by name");
    let rigid: Vec<_> = checks.iter().filter(rigid).collect();
    assert_eq!(rigid.len(), 12, "{rigid:#?}");
    // No step is taken with a matrix that is singular, not a sub-step of 1/480 s.
    for check in rigid {
        assert_eq!(check.ours, "ends at 0.0000 s", "{check:#?}");
    }
    let finished = |c: &&taut_output::check::Check| {
        c.case.contains("ε > 0: default") && c.verdict == Verdict::Pass
    };
    assert!(checks.iter().filter(finished).count() >= 3, "{checks:#?}");
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
                    assert!(found.unbalanced() <= BAR, "{place}");
                    let least_norm = ["cg", "minres"].contains(&choice.backend.name());
                    assert_eq!(found.uneven() <= BAR, least_norm, "{place}");
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
            assert!(found.uneven() <= BAR, "{copies} × {choice}: {found:?}");
        }
    }
}
