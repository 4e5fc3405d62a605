//! Direct solver: block LDLᵀ without pivoting. Positive definite and quasi-definite matrices.
//!
//! A cable, or several, is a chain, eliminated from both ends (the mathematics is in `chain`); a few blocks that close
//! loops or join branches become its border rows (`chain/bordered`); all other patterns, and blocks of more than six
//! rows, go the general way in the order of the pattern (`block_ldlt`).

use super::{Phases, check_solution};
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::chain::Chain;
use crate::chain::bordered::Bordered;
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, LinearSolver, SolveError, SolveReport,
    SymBlockMatrix,
};
use std::sync::Arc;
use taut_lanes::Level;

/// The `banded` backend.
#[derive(Debug, Default)]
pub(crate) struct Banded {
    phases: Phases,
    factor: Option<Factor>,
}

#[derive(Debug)]
enum Factor {
    /// Of a chain of small blocks.
    Chain(Chain),
    /// Of one with a few rows besides.
    Bordered(Bordered),
    General(BlockLdlt<f64>),
}

impl LinearSolver for Banded {
    fn name(&self) -> &'static str {
        "banded"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let general = BlockLdlt::new(pattern, pattern)?;
        let factor_entries = general.factor_values();
        let level = Level::best();
        let chain = Chain::new(pattern, level).map(Factor::Chain);
        let small = chain.or_else(|| Bordered::new(pattern, level).map(Factor::Bordered));
        let factor = small.unwrap_or(Factor::General(general));
        self.factor = Some(factor);
        self.phases.analyzed(pattern);
        let factor_entries = Some(factor_entries);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        match &mut self.factor {
            Some(Factor::Chain(chain)) => chain.factorize(a)?,
            Some(Factor::Bordered(factor)) => factor.factorize(a)?,
            Some(Factor::General(factor)) => factor.factorize(a, Pivots::Nonzero)?,
            None => {}
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
        match &mut self.factor {
            Some(Factor::Chain(chain)) => chain.solve(b, x),
            Some(Factor::Bordered(factor)) => factor.solve(a, b, x),
            Some(Factor::General(factor)) => {
                x.copy_from_slice(b);
                factor.solve(x);
            }
            None => {}
        }
        check_solution(a, x)?;
        Ok(SolveReport::DIRECT)
    }
}
