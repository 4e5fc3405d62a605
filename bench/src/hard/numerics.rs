//! Hard cases for the algebra and for the program: H40 to H54.

pub mod agreement;
pub mod infeasible;
pub mod mechanisms;
pub mod redundant;

use super::{Case, no_scenes};
use crate::check::{ExperimentError, Outcome};
use indicatif::ProgressBar;

/// The cases.
pub const CASES: &[Case] = &[
    Case {
        name: "H42",
        title: "dependent constraints: doubled joints, Bricard's six-bar, rows of four-bars",
        run: redundant_constraints,
        scenes: no_scenes,
    },
    Case {
        name: "H47",
        title: "branches and loops: the same answer from every solver",
        run: agreement::outcome,
        scenes: no_scenes,
    },
    Case {
        name: "H50",
        title: "a cable held at ends farther apart than it is long",
        run: infeasible::outcome,
        scenes: no_scenes,
    },
];

fn redundant_constraints(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = redundant::checks()?;
    checks.extend(mechanisms::checks(quick, progress)?);
    Ok(Outcome {
        checks,
        ..Outcome::default()
    })
}
