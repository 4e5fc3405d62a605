//! H57: 10⁴ systems that tempt to false claims, indefinite, graded, singular to rounding, with growth, to every backend.

use indicatif::ProgressBar;
use rayon::prelude::*;
use taut_ground::matrix::solve::backends;
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_solver::Backend;
use taut_solver::agreement::{FALSE, claims_study};

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let systems = if quick { 1_000 } else { 10_000 };
    let all: Vec<Backend> = backends()
        .into_iter()
        .filter(Backend::is_compiled)
        .collect();
    progress.inc_length(all.len() as u64);
    let check = |backend: &Backend| -> Result<Check, ExperimentError> {
        let study = backend
            .with_tolerance(FALSE)
            .create()
            .and_then(|mut s| claims_study(&mut *s, 0..systems))?;
        progress.inc(1);
        let case = format!(
            "{backend}: false claims of {} adverse systems",
            study.systems
        );
        let ours = format!(
            "{}, largest error {:.1e}",
            study.false_claims, study.backward_error
        );
        let reference = format!("none above {FALSE:.0e}");
        let note = format!("{} claims, {} refusals", study.claims, study.refused);
        Ok(Check::within(case, reference, ours, study.false_claims as f64, 0.0).noting(note))
    };
    let checks: Vec<Check> = all.par_iter().map(check).collect::<Result<_, _>>()?;
    Ok(checks.into())
}
