//! H57: 10⁴ systems that tempt to false claims, indefinite, graded, singular to rounding, with growth, to every backend.

use crate::check::{Check, ExperimentError, Outcome, csv};
use crate::matrix::solve::backends;
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use taut_integrator::StepError;
use taut_solver::Backend;
use taut_solver::agreement::{FALSE, claims_study};

/// What came of the systems with a backend.
#[derive(Debug, Serialize)]
struct Row {
    backend: String,
    systems: usize,
    claims: usize,
    refused: usize,
    false_claims: usize,
    /// Largest normwise backward error of a claim.
    backward_error: f64,
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let systems = if quick { 1_000 } else { 10_000 };
    let all: Vec<Backend> = backends()
        .into_iter()
        .filter(Backend::is_compiled)
        .collect();
    progress.inc_length(all.len() as u64);
    let row = |backend: &Backend| {
        let study = backend
            .create()
            .and_then(|mut s| claims_study(&mut *s, 0..systems));
        let study = study.map_err(|source| StepError::Solve {
            source,
            culprit: None,
            time: 0.0,
        })?;
        progress.inc(1);
        Ok(Row {
            backend: backend.to_string(),
            systems: study.systems,
            claims: study.claims,
            refused: study.refused,
            false_claims: study.false_claims,
            backward_error: study.backward_error,
        })
    };
    let rows: Vec<Row> = all
        .par_iter()
        .map(row)
        .collect::<Result<_, ExperimentError>>()?;
    let check = |r: &Row| {
        let case = format!(
            "{}: false claims of {} adverse systems",
            r.backend, r.systems
        );
        let ours = format!("{}, largest error {:.1e}", r.false_claims, r.backward_error);
        let reference = format!("none above {FALSE:.0e}");
        let note = format!("{} claims, {} refusals", r.claims, r.refused);
        Check::within(case, reference, ours, r.false_claims as f64, 0.0).noting(note)
    };
    Ok(Outcome {
        checks: rows.iter().map(check).collect(),
        csv: csv(&rows)?,
        ..Outcome::default()
    })
}
