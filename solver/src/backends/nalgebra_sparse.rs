//! nalgebra-sparse's Cholesky factorisation (Apache-2.0), for positive definite matrices.
//!
//! It eliminates in the order of the pattern, entry by entry. The fill and all memory are made in `analyze`; `factorize`
//! and `solve` allocate nothing. The analysis takes time quadratic in the rows, for nalgebra-sparse clears a mark for all
//! rows at each of them. Matrices that are singular to rounding are refused (`singularity`).

use super::csc::{Csc, Triangle, check_pivots, diagnose};
use super::direct::{Common, Direct};
use crate::block_ldlt::Pivots;
use crate::singularity::SingularityTest;
use crate::{AnalyzeReport, BlockPattern, ConvertError, FactorReport, GeneralMatrix};
use crate::{SolveError, SymBlockMatrix};
use ::nalgebra_sparse::CscMatrix;
use ::nalgebra_sparse::factorization::{CscCholesky, CscSymbolicCholesky};
use ::nalgebra_sparse::na::DMatrixViewMut;
use ::nalgebra_sparse::pattern::SparsityPattern;
use std::sync::Arc;

/// The `nalgebra-sparse` backend.
#[derive(Debug, Default)]
pub(crate) struct NalgebraSparse {
    common: Common,
    /// `None` before `analyze`.
    work: Option<Work>,
}

#[derive(Debug)]
struct Work {
    /// Both triangles; their rows and columns have moved into `factor`.
    csc: Csc<usize>,
    factor: CscCholesky<f64>,
    singularity: SingularityTest,
}

/// x ← A⁻¹ x.
fn solve(factor: &CscCholesky<f64>, x: &mut [f64]) {
    let dim = x.len();
    factor.solve_mut(DMatrixViewMut::from_slice(x, dim, 1));
}

impl Direct for NalgebraSparse {
    const NAME: &'static str = "nalgebra-sparse";

    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let work = Work::new(pattern)?;
        let factor_entries = Some(work.factor.l().nnz());
        self.work = Some(work);
        Ok(AnalyzeReport { factor_entries })
    }

    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        a.check_finite()?;
        if let Some(work) = &mut self.work {
            work.factorize(a)?;
        }
        Ok(FactorReport::default())
    }

    fn is_stable(&self) -> bool {
        true
    }

    fn is_doubtful(&self) -> bool {
        let work = self.work.as_ref();
        work.is_some_and(|work| work.singularity.is_doubtful())
    }

    fn substitute(
        &mut self,
        _: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        x.copy_from_slice(b);
        if let Some(work) = &self.work {
            solve(&work.factor, x);
        }
        Ok(())
    }
}

impl Work {
    fn new(p: &BlockPattern) -> Result<Self, SolveError> {
        let mut csc = Csc::new(p, Triangle::Full)?;
        let (start, row) = (
            std::mem::take(&mut csc.column_start),
            std::mem::take(&mut csc.row),
        );
        // The identity has a factor for sure: so all memory is made before there are values.
        for c in 0..p.dim() {
            let column = start[c]..start[c + 1];
            for (&r, value) in row[column.clone()].iter().zip(&mut csc.values[column]) {
                *value = if r == c { 1.0 } else { 0.0 };
            }
        }
        let pattern = SparsityPattern::try_from_offsets_and_indices(p.dim(), p.dim(), start, row)
            .map_err(library)?;
        let factor =
            CscCholesky::factor_numerical(CscSymbolicCholesky::factor(pattern), &csc.values);
        Ok(Self {
            factor: factor.map_err(library)?,
            csc,
            singularity: SingularityTest::new(p.dim()),
        })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        self.csc.gather(a.values());
        // The library does not tell which pivot it refuses. What it leaves half done then is overwritten the next time:
        // the first entry of each row of L is one of A.
        let refused = self.factor.refactor(&self.csc.values);
        refused.map_err(|e| diagnose(a, Pivots::Positive).unwrap_or_else(|| library(e)))?;
        // Each column of L begins with its diagonal entry, the square root of the pivot.
        let l = self.factor.l();
        let pivot = |r: usize| l.values()[l.col_offsets()[r]].powi(2);
        check_pivots(a, pivot, &mut self.singularity)?;
        let factor = &self.factor;
        self.singularity.check(a, |x| solve(factor, x))
    }
}

fn library(e: impl std::fmt::Display) -> SolveError {
    SolveError::Library {
        library: "nalgebra-sparse",
        message: e.to_string(),
    }
}

impl TryFrom<&CscMatrix<f64>> for GeneralMatrix {
    type Error = ConvertError;

    fn try_from(a: &CscMatrix<f64>) -> Result<Self, ConvertError> {
        let (start, row, values) = a.csc_data();
        Self::from_csc(
            a.nrows(),
            a.ncols(),
            start.to_vec(),
            row.to_vec(),
            values.to_vec(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;

    #[test]
    fn dependent_rows_are_refused() {
        testing::sees_dependence(&mut NalgebraSparse::default());
    }

    #[test]
    fn matrices_of_nalgebra_sparse_are_taken_over() {
        let of = |last| {
            let values = vec![4.0, 1.0, 1.0, last];
            CscMatrix::try_from_csc_data(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1], values)
                .expect("sound")
        };
        let entries = vec![(0, 0, 4.0), (1, 0, 1.0), (0, 1, 1.0), (1, 1, 5.0)];
        let own = GeneralMatrix::from_entries(2, entries).expect("sound");
        assert_eq!(GeneralMatrix::try_from(&of(5.0)), Ok(own));
        let (row, column) = (1, 1);
        let refused = GeneralMatrix::try_from(&of(f64::INFINITY));
        assert_eq!(refused, Err(ConvertError::NonFinite { row, column }));
    }
}
