//! Who takes part, with names for the command line; a pass of each, and how wrong its solution is.

use super::case::{Case, multipliers};
use crate::systems::turns::{self, Work};
use crate::systems::{Start, failed};
use std::fmt;
use std::str::FromStr;
use std::time::Instant;
#[cfg(feature = "lapack")]
use taut_baselines::lapack::Band;
use taut_integrator::{Form, StepError};
use taut_measure::choice::Choice;
use taut_measure::errors::worse;
use taut_measure::matrix::Triangle;
use taut_measure::matrix::solve::refining;
use taut_solver::{BackwardError, SolveError, SymBlockMatrix, backward_error, forward_error};

/// Right-hand sides of a solve of many.
const MANY_SIDES: usize = 8;

/// Who takes part besides the solvers when none is named.
const OTHERS: [&str; 6] = [
    "faer:lblt",
    "faer:lblt/kkt",
    "banded+refine",
    "banded+many",
    "lapack:lower",
    "lapack:upper",
];

const NO_LAPACK: SolveError = SolveError::NotCompiled {
    backend: "lapack",
    feature: "lapack",
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// On S or on the KKT matrix.
    Plain,
    /// On S with one refinement from the pieces.
    Refined,
    /// Once factorised for `MANY_SIDES` right-hand sides.
    Many,
}

impl Use {
    const ALL: [Self; 3] = [Self::Plain, Self::Refined, Self::Many];

    /// What stands after the solver's name.
    fn suffix(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Refined => "+refine",
            Self::Many => "+many",
        }
    }
}

/// One that solves. The text form is that of a [`Choice`], one with `+refine` or `+many` after it, `lapack:lower` or
/// `lapack:upper`.
#[derive(Debug, Clone, PartialEq)]
pub enum Entrant {
    Solver(Choice, Use),
    /// LAPACK's dpbtrf and dpbtrs on S.
    Lapack(Triangle),
}

impl Entrant {
    /// All that are worth a row, whether compiled in or not: the direct solvers but for the dense one, and the others.
    pub fn all() -> Vec<Self> {
        let direct = Choice::all()
            .into_iter()
            .filter(|c| !c.backend.is_iterative());
        let solvers = direct.map(|choice| {
            let backend = refining(choice.backend);
            Self::Solver(Choice { backend, ..choice }, Use::Plain)
        });
        let others = OTHERS.iter().filter_map(|name| name.parse().ok());
        solvers
            .filter(|entrant| !entrant.is_dense())
            .chain(others)
            .collect()
    }

    pub fn family(&self) -> String {
        match self {
            Self::Solver(choice, of) => choice.family() + of.suffix(),
            Self::Lapack(_) => self.to_string(),
        }
    }

    /// Right-hand sides that it solves at a time.
    pub fn cables(&self) -> usize {
        match self {
            Self::Solver(_, Use::Many) => MANY_SIDES,
            _ => 1,
        }
    }

    pub(super) fn is_dense(&self) -> bool {
        matches!(self, Self::Solver(choice, _) if choice.backend.name() == "dense")
    }

    /// Fails where it is not compiled in or an option is out of its range.
    pub fn check(&self) -> Result<(), SolveError> {
        match self {
            Self::Solver(choice, _) => choice.check(),
            Self::Lapack(_) if !cfg!(feature = "lapack") => Err(NO_LAPACK),
            Self::Lapack(_) => Ok(()),
        }
    }
}

impl fmt::Display for Entrant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solver(choice, of) => write!(f, "{choice}{}", of.suffix()),
            Self::Lapack(Triangle::Lower) => f.write_str("lapack:lower"),
            Self::Lapack(Triangle::Upper) => f.write_str("lapack:upper"),
        }
    }
}

impl FromStr for Entrant {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "lapack:lower" => return Ok(Self::Lapack(Triangle::Lower)),
            "lapack:upper" => return Ok(Self::Lapack(Triangle::Upper)),
            _ => {}
        }
        let (name, suffix) = text.split_at(text.find('+').unwrap_or(text.len()));
        let [_, refine, many] = Use::ALL.map(Use::suffix);
        let of = Use::ALL.into_iter().find(|of| of.suffix() == suffix);
        let of = of.ok_or_else(|| format!("`{text}`: after NAME may stand {refine} or {many}"))?;
        let choice: Choice = name.parse().map_err(|e| {
            format!(
                "{e}; this sweep also knows lapack:lower, lapack:upper, NAME{refine} and NAME{many}"
            )
        })?;
        if of == Use::Refined && choice.form == Form::Kkt {
            return Err(format!(
                "`{text}`: refinement from the pieces is for S: drop `/kkt`"
            ));
        }
        Ok(Self::Solver(choice, of))
    }
}

/// How wrong the solution of a pass is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Errors {
    pub(super) backward: BackwardError,
    pub(super) forward: f64,
}

/// The errors of solutions x, one after the other, for right-hand sides b: the forward error of the first.
fn errors(case: &Case, a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> Result<Errors, StepError> {
    let dim = a.dim();
    let exact = case.state().exact();
    let forward = if dim == exact.len() {
        forward_error(&x[..dim], exact)
    } else {
        forward_error(&multipliers(a, &x[..dim]), exact)
    };
    let mut backward = backward_error(a, &b[..dim], &x[..dim]).map_err(failed)?;
    for (b, x) in b.chunks(dim).zip(x.chunks(dim)).skip(1) {
        let other = backward_error(a, b, x).map_err(failed)?;
        backward.normwise = worse(backward.normwise, other.normwise);
        backward.componentwise = worse(backward.componentwise, other.componentwise);
    }
    Ok(Errors { backward, forward })
}

/// The errors of a entrant's first pass, and its further passes.
pub(super) fn work<'a>(case: &'a Case, entrant: &Entrant) -> Result<(Errors, Work<'a>), StepError> {
    match entrant {
        Entrant::Solver(choice, Use::Refined) => stepping(case, choice),
        Entrant::Solver(choice, _) => solving(case, choice, entrant.cables()),
        #[cfg(feature = "lapack")]
        Entrant::Lapack(triangle) => banding(case, *triangle),
        #[cfg(not(feature = "lapack"))]
        Entrant::Lapack(_) => Err(failed(NO_LAPACK)),
    }
}

/// A solver that has analysed its system, with so many right-hand sides: the first and its multiples.
fn solving<'a>(
    case: &'a Case,
    choice: &Choice,
    sides: usize,
) -> Result<(Errors, Work<'a>), StepError> {
    let (a, first) = match choice.form {
        Form::Kkt => case.kkt(),
        _ => case.schur(),
    };
    let multiples = (1..=sides).map(|k| k as f64);
    let b: Vec<f64> = multiples
        .flat_map(|k| first.iter().map(move |b| k * b))
        .collect();
    let mut solver = choice.backend.create().map_err(failed)?;
    solver.analyze(a.pattern()).map_err(failed)?;
    // A solver that iterates starts from x.
    let is_fresh = sides > 1 || choice.backend.is_iterative();
    let mut pass = move |b: &[f64], x: &mut [f64]| {
        solver.factorize(a).map_err(failed)?;
        if is_fresh {
            x.fill(0.0);
        }
        match sides {
            1 => solver.solve(a, b, x).map(|_| ()),
            _ => solver.solve_many(a, b, x).map(|_| ()),
        }
        .map_err(failed)
    };
    let mut x = vec![0.0; b.len()];
    pass(&b, &mut x)?;
    let errors = errors(case, a, &b, &x)?;
    let work = move |passes| {
        let clock = Instant::now();
        for _ in 0..passes {
            pass(&b, &mut x)?;
        }
        Ok([clock.elapsed(); 3])
    };
    Ok((errors, Box::new(work)))
}

/// A step's solve with a refinement.
fn stepping<'a>(case: &'a Case, choice: &Choice) -> Result<(Errors, Work<'a>), StepError> {
    let mut stepper = case.refining(choice)?;
    stepper.solve()?;
    let (a, b, x) = stepper.system();
    let errors = errors(case, a, b, x)?;
    let work = move |passes| {
        turns::sum(passes, || {
            // Each solve leaves another tension, and with it another matrix for the next.
            case.state().put(&mut stepper, Start::Cold)?;
            Ok([stepper.solve()?.phases.linear(); 3])
        })
    };
    Ok((errors, Box::new(work)))
}

#[cfg(feature = "lapack")]
fn banding(case: &Case, triangle: Triangle) -> Result<(Errors, Work<'_>), StepError> {
    let (a, b) = case.schur();
    let mut band = Band::new(a, triangle).map_err(failed)?;
    let mut pass = move |x: &mut [f64]| {
        // The factor takes the place of the matrix.
        band.refill();
        let clock = Instant::now();
        band.factorize().map_err(failed)?;
        band.solve(b, x).map_err(failed)?;
        Ok([clock.elapsed(); 3])
    };
    let mut x = vec![0.0; b.len()];
    pass(&mut x)?;
    let errors = errors(case, a, b, &x)?;
    let work = move |passes| turns::sum(passes, || pass(&mut x));
    Ok((errors, Box::new(work)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_known_and_round_trip() {
        let names: Vec<_> = Entrant::all().iter().map(Entrant::family).collect();
        for name in ["banded", "faer:ldlt/kkt", "umfpack", "umfpack/kkt"] {
            assert!(names.iter().any(|n| n == name), "{name}: {names:?}");
        }
        assert!(OTHERS.iter().all(|name| names.iter().any(|n| n == name)));
        for entrant in Entrant::all() {
            assert_eq!(
                entrant.to_string().parse(),
                Ok(entrant.clone()),
                "{entrant}"
            );
        }
    }

    #[test]
    fn unknown_names_list_the_known_ones() {
        for name in ["superlu", "superlu+refine", "lapack", "lapack:9"] {
            let e = name.parse::<Entrant>().unwrap_err();
            assert!(e.contains("banded") && e.contains("lapack:lower"), "{e}");
        }
        let e = "banded/kkt+refine".parse::<Entrant>().unwrap_err();
        assert!(e.contains("/kkt"), "{e}");
    }
}
