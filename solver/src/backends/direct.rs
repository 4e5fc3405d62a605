//! What all direct backends share: the phases, and the judge of what their factor makes.

use super::check_solution;
use crate::claim::Judge;
use crate::error::{columns, expect_columns};
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, LinearSolver, Phases, SolveError, SolveReport,
    Status, SymBlockMatrix,
};
use std::sync::Arc;

/// A factorisation: the phases of a [`LinearSolver`] without the checks of their input.
pub(crate) trait Direct: Send {
    /// The backend's name.
    const NAME: &'static str;

    /// What is kept besides the factor.
    fn common(&mut self) -> &mut Common;

    /// Prepares for a pattern.
    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError>;

    /// Makes the factor of `a`, whose values may not be finite.
    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError>;

    /// Whether all pivots of the last factor are positive, so that what it makes is a solution by theory (`claim`).
    fn is_stable(&self) -> bool;

    /// x from b by the factor.
    fn substitute(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError>;

    /// The same for columns of `a.dim()` numbers.
    fn substitute_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        let mut columns = columns(a.dim(), b, x);
        columns.try_for_each(|(b, x)| self.substitute(a, b, x))
    }

    /// What [`substitute`](Self::substitute) made of `b`, checked, and corrected where the elimination guarantees nothing.
    fn accept(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        check_solution(a, x)?;
        if self.is_stable() {
            return Ok(SolveReport::DIRECT);
        }
        let mut common = std::mem::take(self.common());
        let [r, d] = &mut common.buffers;
        let judge = *common.judge.get_or_insert_with(|| Judge::of(a, r));
        let residual = |x: &[f64], r: &mut [f64]| a.subtract_product(b, x, r);
        let correct = |r: &[f64], d: &mut [f64]| self.substitute(a, r, d);
        let settled = judge.settle(x, [r, d], f64::INFINITY, residual, correct);
        *self.common() = common;
        let status = settled?;
        check_solution(a, x)?;
        Ok(SolveReport {
            status,
            ..SolveReport::DIRECT
        })
    }
}

/// What a direct backend keeps besides its factor.
#[derive(Debug, Default)]
pub(crate) struct Common {
    phases: Phases,
    /// Of the matrix factorised last, once it is needed.
    judge: Option<Judge>,
    /// A residual and its correction.
    buffers: [Vec<f64>; 2],
}

impl<D: Direct> LinearSolver for D {
    fn name(&self) -> &'static str {
        D::NAME
    }

    fn takes_guess(&self) -> bool {
        false
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let report = self.prepare(pattern)?;
        let common = self.common();
        common.buffers = [(); 2].map(|()| vec![0.0; pattern.dim()]);
        common.phases.analyzed(pattern);
        Ok(report)
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        let common = self.common();
        common.phases.begin_unchecked(a)?;
        common.judge = None;
        let report = self.eliminate(a)?;
        self.common().phases.factorized();
        Ok(report)
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.common().phases.begin_solve(a, b, x)?;
        self.substitute(a, b, x)?;
        self.accept(a, b, x)
    }

    fn solve_unjudged(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.common().phases.begin_solve(a, b, x)?;
        self.substitute(a, b, x)?;
        check_solution(a, x)?;
        let status = if self.is_stable() {
            Status::Direct
        } else {
            Status::Unjudged
        };
        Ok(SolveReport {
            status,
            ..SolveReport::DIRECT
        })
    }

    fn solve_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        expect_columns(a.dim(), b, x)?;
        for (b, x) in columns(a.dim(), b, x) {
            self.common().phases.begin_solve(a, b, x)?;
        }
        self.substitute_many(a, b, x)?;
        let mut report = SolveReport::DIRECT;
        for (b, x) in columns(a.dim(), b, x) {
            report = report.and(self.accept(a, b, x)?);
        }
        Ok(report)
    }
}
