//! Which solver an experiment runs: a backend with its options and the form of the system that it solves.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use taut_integrator::{Form, StepOptions};
use taut_solver::{Backend, SolveError};

/// A backend and a form. The text form is the backend's, with `/kkt` after it for the KKT form.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The backend with its options.
    pub backend: Backend,
    /// The form of the system.
    pub form: Form,
}

impl Choice {
    /// `backend` on the Schur complement.
    pub fn schur(backend: Backend) -> Self {
        Self {
            backend,
            form: Form::Schur,
        }
    }

    /// The solver of these options.
    pub fn of(options: &StepOptions) -> Self {
        Self {
            backend: options.backend.clone(),
            form: options.form,
        }
    }

    /// `backend` on the KKT matrix.
    pub fn kkt(backend: Backend) -> Self {
        Self {
            backend,
            form: Form::Kkt,
        }
    }

    /// Every solver that is worth a row of its own, whether compiled in or not, direct ones first: the rows of all entries.
    pub fn all() -> Vec<Self> {
        let mut all: Vec<Self> = Backend::all().into_iter().flat_map(Self::rows).collect();
        all.sort_by_key(|choice| choice.backend.is_iterative());
        all
    }

    /// The rows of a backend's entry.
    fn rows(backend: Backend) -> Vec<Self> {
        match backend.entry().rows {
            [] if backend.accepts_indefinite() => {
                vec![Self::schur(backend.clone()), Self::kkt(backend)]
            }
            [] => vec![Self::schur(backend)],
            // Registration has checked that every row parses.
            rows => rows.iter().filter_map(|row| row.parse().ok()).collect(),
        }
    }

    /// Name without iterations and tolerance: one family of rows of a table.
    pub fn family(&self) -> String {
        let backend = self.backend.to_string();
        let kept: Vec<&str> = backend
            .split(':')
            .filter(|o| !o.starts_with("iterations=") && !o.starts_with("tolerance="))
            .collect();
        let name = kept.join(":").replace(":refinement=2", "");
        match self.form {
            Form::Kkt => format!("{name}/kkt"),
            _ => name,
        }
    }

    /// Step options with this solver, and one refinement where it is direct, but for UMFPACK on the KKT matrix, which
    /// refines by itself against all that the pieces hold.
    pub fn options(&self, dt: f64) -> StepOptions {
        let refines_itself = matches!(self.backend, Backend::Umfpack(o) if o.refinement_steps > 0);
        let enough = self.backend.is_iterative() || (refines_itself && self.form == Form::Kkt);
        StepOptions {
            dt,
            form: self.form,
            refinements: usize::from(!enough),
            backend: self.backend.clone(),
            ..StepOptions::default()
        }
    }

    /// [`Choice::options`] without the guard: each step is one solve, whatever its error. For comparing solvers, since a
    /// solve that falls short would set the guard off and be paid for many times.
    pub fn plain_options(&self, dt: f64) -> StepOptions {
        StepOptions {
            guard: None,
            ..self.options(dt)
        }
    }

    /// Fails where the backend is not compiled in or an option is out of its range.
    pub fn check(&self) -> Result<(), SolveError> {
        self.backend.create().map(|_| ())
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.backend.fmt(f)?;
        match self.form {
            Form::Kkt => f.write_str("/kkt"),
            _ => Ok(()),
        }
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (backend, form) = text.split_once('/').unwrap_or((text, "schur"));
        let backend: Backend = backend
            .parse()
            .map_err(|e: taut_solver::ParseBackendError| e.to_string())?;
        let form: Form = form
            .parse()
            .map_err(|e: taut_integrator::UnknownName| e.to_string())?;
        if form == Form::Kkt && !backend.accepts_indefinite() {
            return Err(format!(
                "backend `{}` needs a positive definite matrix: drop `/kkt`",
                backend.name()
            ));
        }
        Ok(Self { backend, form })
    }
}

/// A solver that has no rows, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Omission {
    /// Backend and form.
    pub backend: String,
    /// Why.
    pub reason: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_an_entry_is_a_choice() {
        for backend in Backend::all() {
            let rows = backend.entry().rows.len();
            let all = Choice::all().into_iter();
            let own = all.filter(|c| c.backend.name() == backend.name()).count();
            assert!(own > 0 && (rows == 0 || own == rows), "{backend}");
        }
    }

    #[test]
    fn text_form_round_trips() {
        for choice in Choice::all() {
            assert_eq!(choice.to_string().parse(), Ok(choice.clone()));
        }
        let found = "umfpack/kkt".parse::<Choice>().unwrap().family();
        assert_eq!(found, "umfpack/kkt");
        let found = "cg:jacobi:iterations=3".parse::<Choice>().unwrap().family();
        assert_eq!(found, "cg:jacobi");
    }

    #[test]
    fn definite_backends_refuse_the_kkt_form() {
        let e = "cg/kkt".parse::<Choice>().unwrap_err();
        assert!(e.contains("positive definite"), "{e}");
        assert!(
            "banded/lu"
                .parse::<Choice>()
                .unwrap_err()
                .contains("schur, kkt")
        );
    }
}
