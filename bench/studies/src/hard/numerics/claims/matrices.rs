//! Claims of solves of a matrix by itself: those of H46, by the backends and iterations that steps are audited with.

use super::verify::alone;
use super::{Done, Place, Seen, Solve, variants};
use crate::hard::numerics::ill_conditioned::{matrices::Specimen, solve};
use taut_ground::choice::Choice;
use taut_ground::matrix::prepared::Problem;
use taut_ground::matrix::solve::backends;
use taut_solver::forward_error;

/// Name of a matrix in the audit.
pub(super) fn name(specimen: &Specimen) -> String {
    format!("H46 {}", specimen.name)
}

/// Audits a matrix.
pub(super) fn audit(specimen: &Specimen) -> Vec<Solve> {
    let problem = Problem::new(&specimen.matrix);
    let name = name(specimen);
    let place = Place {
        name: &name,
        step: 0,
        rows: specimen.b.len(),
    };
    let all = variants(backends().into_iter().map(Choice::schur)).into_iter();
    let audited = all.map(|(choice, variant)| {
        let solved = solve(&problem, &choice.backend, &specimen.b);
        let done = solved.map(|(x, report)| {
            let verified = alone(&specimen.matrix, &specimen.b, &x);
            Done {
                status: format!("{:?}", report.status),
                claimed: report.is_claim(),
                told: Some(report.residual).filter(|r| r.is_finite()),
                seen: Seen {
                    residual: verified.residual,
                    backward_error: verified.backward_error,
                    forward_error: Some(forward_error(&x, &specimen.x)),
                },
            }
        });
        Solve::of(&place, &choice, variant, &done.map_err(|e| e.to_string()))
    });
    audited.collect()
}
