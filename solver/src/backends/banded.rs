//! Direct solver: block LDLᵀ in the order of the pattern (the mathematics is in `block_ldlt`).
//!
//! A cable gives a block-tridiagonal factor and linear cost; block rows that close loops, put last, become border rows
//! of the factor. Positive definite and quasi-definite matrices.

use super::{Phases, check_solution};
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, LinearSolver, SolveError, SolveReport,
    SymBlockMatrix,
};
use std::sync::Arc;

/// The `banded` backend.
#[derive(Debug, Default)]
pub(crate) struct Banded {
    phases: Phases,
    factor: Option<BlockLdlt<f64>>,
}

impl LinearSolver for Banded {
    fn name(&self) -> &'static str {
        "banded"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let factor = BlockLdlt::new(pattern, pattern)?;
        let factor_entries = Some(factor.factor_values());
        self.factor = Some(factor);
        self.phases.analyzed(pattern);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        if let Some(factor) = &mut self.factor {
            factor.factorize(a, Pivots::Nonzero)?;
        }
        self.phases.factorized();
        Ok(FactorReport::default())
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.phases.begin_solve(a, b, x)?;
        x.copy_from_slice(b);
        if let Some(factor) = &self.factor {
            factor.solve(x);
        }
        check_solution(a, x)?;
        Ok(SolveReport::DIRECT)
    }
}
