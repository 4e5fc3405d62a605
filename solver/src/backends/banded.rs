//! Direct solver: block LDLᵀ in the order of the pattern (the mathematics is in `block_ldlt`).
//!
//! A cable gives a block-tridiagonal factor and linear cost; block rows that close loops, put last, become border rows
//! of the factor. Positive definite and quasi-definite matrices.

use super::{Phases, check_solution};
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::chain::Chain;
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
    General(BlockLdlt<f64>),
}

impl LinearSolver for Banded {
    fn name(&self) -> &'static str {
        "banded"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let (factor, factor_entries) = match Chain::new(pattern, Level::best()) {
            Some(chain) => (Factor::Chain(chain), pattern.stored_values()),
            None => {
                let general = BlockLdlt::new(pattern, pattern)?;
                let entries = general.factor_values();
                (Factor::General(general), entries)
            }
        };
        self.factor = Some(factor);
        self.phases.analyzed(pattern);
        let factor_entries = Some(factor_entries);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        match &mut self.factor {
            Some(Factor::Chain(chain)) => chain.factorize(a)?,
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
