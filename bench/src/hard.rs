//! Hard cases: scenes with known answers, or with a known absence of one, that solvers and steps are known to fail on.
//!
//! A case is a row of [`CASES`]: its name, what it is, and the function that measures it, in a module of its own. It ends
//! in an [`Outcome`] as the paper's experiments do: rows of checks with reference, ours, error, bar and verdict.

pub mod agreement;
pub mod infeasible;
pub mod mechanisms;
pub mod redundant;

use crate::check::{ExperimentError, Outcome};
use crate::choice::Choice;
use indicatif::ProgressBar;
use std::fmt;

/// A hard case.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Measures it, whole or quick.
    pub run: fn(bool, &ProgressBar) -> Result<Outcome, ExperimentError>,
}

/// All cases, in the order of their names.
pub const CASES: [Case; 3] = [
    Case {
        name: "H42",
        title: "dependent constraints: doubled joints, Bricard's six-bar, rows of four-bars",
        run: redundant_constraints,
    },
    Case {
        name: "H47",
        title: "branches and loops: the same answer from every solver",
        run: agreement::outcome,
    },
    Case {
        name: "H50",
        title: "a cable held at ends farther apart than it is long",
        run: infeasible::outcome,
    },
];

/// A name that no case has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownCase {
    /// The name.
    pub name: String,
}

impl fmt::Display for UnknownCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = CASES.map(|c| c.name).join(", ");
        write!(
            f,
            "no case is called `{}`: choose one of {names}",
            self.name
        )
    }
}

impl std::error::Error for UnknownCase {}

/// The case with that name, in upper or lower case.
///
/// # Errors
/// [`UnknownCase`], which lists the names that there are.
pub fn named(name: &str) -> Result<Case, UnknownCase> {
    let found = CASES
        .into_iter()
        .find(|c| c.name.eq_ignore_ascii_case(name));
    found.ok_or_else(|| UnknownCase {
        name: name.to_owned(),
    })
}

fn redundant_constraints(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = redundant::checks()?;
    checks.extend(mechanisms::checks(quick, progress)?);
    Ok(Outcome {
        checks,
        ..Outcome::default()
    })
}

/// Every solver compiled in, the iterative ones with iterations enough to converge to rounding on small scenes.
#[must_use]
pub fn solvers() -> Vec<Choice> {
    let compiled = Choice::all().into_iter().filter(|c| c.check().is_ok());
    let patient = compiled.map(|choice| Choice {
        backend: choice.backend.with_iterations(20_000).with_tolerance(1e-13),
        form: choice.form,
    });
    patient.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_case_lists_the_known() {
        let e = named("H99").unwrap_err().to_string();
        assert_eq!(e, "no case is called `H99`: choose one of H42, H47, H50");
        assert_eq!(named("h42").unwrap().name, "H42");
    }
}
