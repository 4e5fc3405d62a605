//! The fewest iterations that reach an error: up a ladder of limits, then by bisection.

use super::case::Case;
use super::{Config, Record, Start};
use taut_ground::choice::Choice;
use taut_integrator::{StepError, Stepper};
use taut_solver::forward_error;

/// Errors of a solver over its iterations.
pub(super) struct Search<'a> {
    pub(super) case: &'a Case,
    pub(super) config: &'a Config,
    pub(super) choice: &'a Choice,
    pub(super) start: Start,
    /// Limits of iterations and errors, ascending.
    pub(super) known: Vec<(usize, f64)>,
}

impl Search<'_> {
    fn stepper(&self, iterations: usize) -> Result<Stepper, StepError> {
        let backend = self.choice.backend.with_iterations(iterations);
        let choice = Choice {
            backend: backend.with_tolerance(0.0),
            form: self.choice.form,
        };
        self.case.stepper(choice.plain_options(self.config.dt))
    }

    pub(super) fn error(&mut self, iterations: usize) -> Result<f64, StepError> {
        let place = self.known.partition_point(|(k, _)| *k < iterations);
        match self.known.get(place) {
            Some((k, error)) if *k == iterations => Ok(*error),
            _ => {
                let error = self
                    .case
                    .error(&mut self.stepper(iterations)?, self.start)?;
                self.known.insert(place, (iterations, error));
                Ok(error)
            }
        }
    }

    /// Error of what it starts from.
    fn guessed(&self) -> f64 {
        match self.start {
            Start::Cold => 1.0,
            Start::Warm => forward_error(&self.case.guess, &self.case.exact),
        }
    }

    /// Fewest iterations for an error, as far as it falls with them.
    pub(super) fn fewest(&mut self, target: f64) -> Result<Option<usize>, StepError> {
        if self.guessed() <= target {
            return Ok(Some(0));
        }
        let limit = self.config.limit;
        let (mut short, mut k) = (0, 1);
        while self.error(k)? > target {
            if k == limit {
                return Ok(None);
            }
            short = k;
            k = (k + k.div_ceil(3)).min(limit);
        }
        while k - short > 1 {
            let middle = short.midpoint(k);
            if self.error(middle)? <= target {
                k = middle;
            } else {
                short = middle;
            }
        }
        Ok(Some(k))
    }

    pub(super) fn fill(&mut self, row: &mut Record) -> Result<(), StepError> {
        row.iterations = self.fewest(row.target)?;
        if row.iterations == Some(0) {
            row.error = self.guessed();
            return Ok(());
        }
        row.error = self.error(row.iterations.unwrap_or(self.config.limit))?;
        if let Some(k) = row.iterations {
            let mut stepper = self.stepper(k)?;
            row.ns = Some(self.case.time(self.config, &mut stepper, self.start)?);
        }
        Ok(())
    }
}
