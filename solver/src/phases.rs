//! The order of a backend's phases, and the checks that every backend makes of its input.

use crate::error::expect_len;
use crate::matrix::check_finite;
use crate::{BlockPattern, SolveError, SymBlockMatrix};
use std::sync::Arc;

/// Which phases are behind a backend, and for which pattern: what checks a backend's input, whatever it does with it.
///
/// A backend calls [`analyzed`](Self::analyzed) at the end of its analysis, [`begin_factorize`](Self::begin_factorize)
/// and [`factorized`](Self::factorized) around its factorisation, [`begin_solve`](Self::begin_solve) before each solve.
#[derive(Debug, Clone, Default)]
pub struct Phases {
    pattern: Option<Arc<BlockPattern>>,
    factorized: bool,
}

impl Phases {
    /// `analyze` succeeded, for this pattern.
    pub fn analyzed(&mut self, pattern: &Arc<BlockPattern>) {
        *self = Self {
            pattern: Some(pattern.clone()),
            factorized: false,
        };
    }

    /// Checks what `factorize` is given; until [`factorized`](Self::factorized) no solve is allowed.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`], [`SolveError::PatternChanged`], [`SolveError::NonFinite`].
    pub fn begin_factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        self.begin_unchecked(a)?;
        a.check_finite()
    }

    /// Begins a factorisation that itself detects numbers that are not finite.
    pub(crate) fn begin_unchecked(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        self.factorized = false;
        self.check_pattern(a, "factorize")
    }

    /// `factorize` succeeded.
    pub fn factorized(&mut self) {
        self.factorized = true;
    }

    /// Checks what `solve` is given: `b` and `x` of length `a.dim()`, `b` finite.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`], [`SolveError::PatternChanged`], [`SolveError::Dimension`],
    /// [`SolveError::NonFinite`].
    pub fn begin_solve(&self, a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> Result<(), SolveError> {
        self.check_pattern(a, "solve")?;
        if !self.factorized {
            return Err(SolveError::OutOfOrder {
                called: "solve",
                needs: "factorize",
            });
        }
        expect_len("right-hand side", a.dim(), b.len())?;
        expect_len("solution", a.dim(), x.len())?;
        check_finite(a.pattern(), "right-hand side", b)
    }

    fn check_pattern(&self, a: &SymBlockMatrix, called: &'static str) -> Result<(), SolveError> {
        let needs = "analyze";
        let pattern = self
            .pattern
            .as_ref()
            .ok_or(SolveError::OutOfOrder { called, needs })?;
        if Arc::ptr_eq(pattern, a.pattern()) || **pattern == **a.pattern() {
            Ok(())
        } else {
            Err(SolveError::PatternChanged)
        }
    }
}
