//! Who takes part, with names for the command line.

use std::fmt;
use std::str::FromStr;
use taut_ground::choice::Choice;
use taut_ground::matrix::Triangle;
use taut_ground::matrix::solve::refining;
use taut_integrator::Form;
use taut_solver::{Backend, SolveError};

/// Right-hand sides of a solve of many.
pub(super) const MANY_SIDES: usize = 8;

/// Who takes part besides the solvers when none is named.
const OTHERS: [&str; 6] = [
    "faer:lblt",
    "faer:lblt/kkt",
    "banded+refine",
    "banded+many",
    "lapack:lower",
    "lapack:upper",
];

/// Suffix of a solver's name for a solve with refinement.
const REFINE: &str = "+refine";

/// Suffix of a solver's name for `MANY_SIDES` right-hand sides per factorisation.
const MANY: &str = "+many";

pub(super) const NO_LAPACK: SolveError = SolveError::NotCompiled {
    backend: "lapack",
    feature: "lapack",
};

/// One that solves. The text form is that of a [`Choice`], one with `+refine` or `+many` after it, `lapack:lower` or
/// `lapack:upper`.
#[derive(Debug, Clone, PartialEq)]
pub enum Rival {
    /// A solver on S or on the KKT matrix.
    Solver(Choice),
    /// A solver on S with one refinement from the pieces.
    Refined(Choice),
    /// A solver that factorises once for `MANY_SIDES` right-hand sides.
    Many(Choice),
    /// LAPACK's dpbtrf and dpbtrs on S.
    Lapack(Triangle),
}

impl Rival {
    /// All that are worth a row, whether compiled in or not: the direct solvers but for the dense one, and the others.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let solvers = Choice::all().into_iter().map(|choice| {
            Self::Solver(Choice {
                backend: refining(choice.backend),
                ..choice
            })
        });
        let direct = solvers.filter(|rival| !rival.iterates() && !rival.is_dense());
        let others = OTHERS.iter().filter_map(|name| name.parse().ok());
        direct.chain(others).collect()
    }

    /// Name without iterations and tolerance.
    #[must_use]
    pub fn family(&self) -> String {
        match self {
            Self::Solver(choice) => choice.family(),
            Self::Refined(choice) => choice.family() + REFINE,
            Self::Many(choice) => choice.family() + MANY,
            other => other.to_string(),
        }
    }

    /// Right-hand sides that it solves at a time.
    #[must_use]
    pub fn cables(&self) -> usize {
        match self {
            Self::Many(_) => MANY_SIDES,
            _ => 1,
        }
    }

    fn iterates(&self) -> bool {
        matches!(
            self,
            Self::Solver(c) | Self::Refined(c) | Self::Many(c) if c.backend.is_iterative()
        )
    }

    pub(super) fn is_dense(&self) -> bool {
        matches!(
            self,
            Self::Solver(c) | Self::Refined(c) | Self::Many(c) if matches!(c.backend, Backend::Dense(_))
        )
    }

    /// Fails where it is not compiled in or an option is out of its range.
    ///
    /// # Errors
    /// [`SolveError::NotCompiled`], [`SolveError::InvalidOption`].
    pub fn check(&self) -> Result<(), SolveError> {
        match self {
            Self::Solver(choice) | Self::Refined(choice) | Self::Many(choice) => choice.check(),
            Self::Lapack(_) if !cfg!(feature = "lapack") => Err(NO_LAPACK),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for Rival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solver(choice) => choice.fmt(f),
            Self::Refined(choice) => write!(f, "{choice}{REFINE}"),
            Self::Many(choice) => write!(f, "{choice}{MANY}"),
            Self::Lapack(Triangle::Lower) => f.write_str("lapack:lower"),
            Self::Lapack(Triangle::Upper) => f.write_str("lapack:upper"),
        }
    }
}

impl FromStr for Rival {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "lapack:lower" => return Ok(Self::Lapack(Triangle::Lower)),
            "lapack:upper" => return Ok(Self::Lapack(Triangle::Upper)),
            _ => {}
        }
        let (name, suffix) = text.split_at(text.find('+').unwrap_or(text.len()));
        let make = match suffix {
            "" => Self::Solver,
            REFINE => Self::Refined,
            MANY => Self::Many,
            _ => return Err(format!("`{text}`: after NAME may stand {REFINE} or {MANY}")),
        };
        let choice: Choice = name.parse().map_err(|e| {
            format!(
                "{e}; this sweep also knows lapack:lower, lapack:upper, NAME{REFINE} and NAME{MANY}"
            )
        })?;
        if suffix == REFINE && choice.form == Form::Kkt {
            return Err(format!(
                "`{text}`: refinement from the pieces is for S: drop `/kkt`"
            ));
        }
        Ok(make(choice))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_known_and_round_trip() {
        let names: Vec<_> = Rival::all().iter().map(Rival::family).collect();
        for name in ["banded", "faer:ldlt/kkt", "umfpack", "umfpack/kkt"] {
            assert!(names.iter().any(|n| n == name), "{name}: {names:?}");
        }
        assert!(OTHERS.iter().all(|name| names.iter().any(|n| n == name)));
        for rival in Rival::all() {
            assert_eq!(rival.to_string().parse(), Ok(rival.clone()), "{rival}");
        }
    }

    #[test]
    fn unknown_names_list_the_known_ones() {
        for name in ["superlu", "superlu+refine", "lapack", "lapack:9"] {
            let e = name.parse::<Rival>().unwrap_err();
            assert!(e.contains("banded") && e.contains("lapack:lower"), "{e}");
        }
        let e = "banded/kkt+refine".parse::<Rival>().unwrap_err();
        assert!(e.contains("/kkt"), "{e}");
    }
}
