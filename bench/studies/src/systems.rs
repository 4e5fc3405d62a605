//! Solvers on systems: the engine of the studies that compare solvers. Each is a question to it: which systems, which
//! solvers with which limits, which columns, tables and plots.
//!
//! | part | holds |
//! |---|---|
//! | [`State`] | a scene at a moment, whose system all solvers solve, with its multipliers in 32 digits; one solve there |
//! | [`Asking`], [`SolveRow`] | what is asked of a system: solvers, limits, refinements; one solve |
//! | [`grid`] | the hoists of a sweep |
//! | [`entrants`], [`rungs`] | who takes part, with which limits of iterations, and why the others do not |
//! | [`turns`] | times of entrants that take turns |
//! | [`Fewest`] | the fewest iterations that reach an error |
//! | `StudyResult` | what a study comes to: settings, text, rows |

mod asked;
mod fewest;
mod rows;
mod state;
pub mod turns;

pub(crate) use asked::{ITERATIVE, STUDY};
pub use fewest::Fewest;
pub use rows::{Asking, SolveRow};
pub use state::{Solved, Start, State};

use crate::cases::Records;
use crate::study::{Found, Study};
use serde_json::Value;
use taut_integrator::StepError;
use taut_measure::choice::{Choice, Omission};
use taut_output::check::ExperimentError;
use taut_output::settings::Setting;
use taut_output::table::{self, MARK};
use taut_solver::SolveError;

/// The solver with that limit of iterations, where it iterates.
pub fn at_rung(choice: &Choice, rung: usize) -> Choice {
    Choice {
        backend: match rung {
            0 => choice.backend.clone(),
            _ => choice.backend.with_iterations(rung),
        },
        form: choice.form,
    }
}

/// All pairs of a number of segments and a mass ratio.
pub fn grid(segments: &[usize], ratios: &[f64]) -> Vec<(usize, f64)> {
    let over_ratios = |&n: &usize| ratios.iter().map(move |&ratio| (n, ratio));
    segments.iter().flat_map(over_ratios).collect()
}

/// The limits of iterations that a solver has a row for; 0 alone where it is direct.
pub fn rungs(choice: &Choice, limits: &[usize]) -> Vec<usize> {
    if choice.backend.is_iterative() {
        limits.to_vec()
    } else {
        vec![0]
    }
}

/// Those that take part, and the others with the reason against them.
pub(crate) fn taking_part<T: Clone>(
    all: &[T],
    family: impl Fn(&T) -> String,
    reason: impl Fn(&T) -> Option<String>,
) -> (Vec<T>, Vec<Omission>) {
    let (mut present, mut omissions) = (Vec::new(), Vec::new());
    for one in all {
        match reason(one) {
            None => present.push(one.clone()),
            Some(reason) => omissions.push(Omission {
                backend: family(one),
                reason,
            }),
        }
    }
    (present, omissions)
}

/// The solvers that take part on systems of so many rows, and why the others do not: the dense one, whose cost is cubic,
/// has no place beyond `most_dense` rows unless it stands alone.
pub fn entrants(
    choices: &[Choice],
    most_dense: usize,
    rows: impl Fn(&Choice) -> usize,
) -> (Vec<Choice>, Vec<Omission>) {
    let is_dense = |choice: &Choice| choice.backend.name() == "dense";
    let alone = choices.iter().all(is_dense);
    taking_part(choices, Choice::family, |choice| match choice.check() {
        Err(e) => Some(e.to_string()),
        Ok(()) if is_dense(choice) && rows(choice) > most_dense && !alone => Some(format!(
            "cubic cost at {} rows; ask for it alone with --backends",
            rows(choice)
        )),
        Ok(()) => None,
    })
}

/// Adds those that are not there yet.
pub(crate) fn add_omissions(all: &mut Vec<Omission>, new: Vec<Omission>) {
    for omission in new {
        if !all.contains(&omission) {
            all.push(omission);
        }
    }
}

/// The rows of all systems, and which solvers have none.
pub(crate) fn collected<T>(
    records: Records<(Vec<T>, Vec<Omission>)>,
) -> Result<(Vec<T>, Vec<Omission>), ExperimentError> {
    let (mut rows, mut omissions) = (Vec::new(), Vec::new());
    for (own, omitted) in records.all()? {
        rows.extend(own);
        add_omissions(&mut omissions, omitted);
    }
    Ok((rows, omissions))
}

/// A solver's error as that of a step at time 0.
pub(crate) fn failed(source: SolveError) -> StepError {
    StepError::Solve {
        source,
        culprit: None,
        time: 0.0,
    }
}

/// What a study comes to, before it is put into words.
pub(crate) struct StudyResult<'a> {
    pub(crate) settings: Vec<Setting>,
    /// What was run, in a line or two.
    pub(crate) heading: String,
    pub(crate) study: &'a Study,
    pub(crate) rows: Value,
    pub(crate) conclusion: String,
    pub(crate) omissions: Vec<Omission>,
}

impl From<StudyResult<'_>> for Found {
    fn from(result: StudyResult<'_>) -> Self {
        let text = format!(
            "{}\n{}\n{MARK}\n{}{}{}",
            result.heading,
            result.study.question().legend,
            result.study.tables(&result.rows),
            result.conclusion,
            table::omissions(&result.omissions)
        );
        Self {
            settings: result.settings,
            text,
            rows: result.rows,
            omissions: result.omissions,
            ..Self::default()
        }
    }
}
