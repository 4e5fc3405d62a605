//! faer's sparse factorisations (MIT): Cholesky, LDLᵀ, L B Lᵀ and LU, on one core.
//!
//! All but LU eliminate in the order of the pattern: for a chain it has no fill, and faer's reordering would only
//! cost. The fill, the index maps and all memory are made in `analyze`; `factorize` and `solve` allocate nothing, except
//! that faer's dense product, used where there is much fill, makes its work space at its first use in a thread. LDLᵀ does
//! not pivot, so that it is for positive definite and quasi-definite matrices; L B Lᵀ pivots within panels (`lblt`). Nothing
//! is regularised. All three refuse matrices that are singular to rounding, of which faer itself would take most
//! (`singularity`); what an LDLᵀ with pivots of both signs loses shows in its residual alone.
//!
//! LU exchanges rows. From `analyze` it has the column order (COLAMD) and the work space; it fills in as the pivots fall,
//! so that the first `factorize` allocates the factors, and later ones only where the pivots fall otherwise and the
//! factors outgrow their memory. `solve` allocates nothing.

mod convert;
mod lblt;

use super::csc::{Csc, Triangle, check_pivots, diagnose};
use super::direct::{Common, Direct};
use crate::block_ldlt::{NOISE, Pivots};
use crate::condition::Scales;
use crate::kernels::Scalar;
use crate::singularity::SingularityTest;
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, FaerFactorization, FaerOptions, GeneralMatrix,
};
use crate::{SolveError, SymBlockMatrix, norm_inf};
use ::faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use ::faer::linalg::cholesky::ldlt::factor::LdltError;
use ::faer::linalg::cholesky::llt::factor::LltError;
use ::faer::perm::{Perm, PermRef};
use ::faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky,
};
use ::faer::sparse::linalg::lu::simplicial::{self, SimplicialLu};
use ::faer::sparse::linalg::{LuError, SupernodalThreshold, colamd};
use ::faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use ::faer::{Conj, MatMut, Par, Side};
use lblt::Lblt;
use std::sync::Arc;

/// Where faer's Cholesky goes over from single entries to dense panels, in units of 40 operations per entry of the
/// factor. Blocks make panels out of everything: they win from about 9 operations on (a chain of 6-row blocks has 6, with
/// one border row 9), threefold at 25. faer's own setting of 1 waits until 40.
const PANELS: SupernodalThreshold = SupernodalThreshold(9.0 / 40.0);

/// The `faer` backend.
#[derive(Default)]
pub(crate) struct Faer {
    options: FaerOptions,
    common: Common,
    /// `None` before `analyze`, and for a system without rows, which faer is not to be asked about.
    work: Option<Work>,
}

enum Work {
    Cholesky(Cholesky),
    Lblt(Lblt),
    Lu(Lu),
}

impl Faer {
    pub(crate) fn new(options: FaerOptions) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }
}

impl Direct for Faer {
    const NAME: &'static str = "faer";

    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.work = match self.options.factorization {
            _ if pattern.dim() == 0 => None,
            FaerFactorization::Llt => Some(Work::Cholesky(Cholesky::new(pattern, true)?)),
            FaerFactorization::Ldlt => Some(Work::Cholesky(Cholesky::new(pattern, false)?)),
            FaerFactorization::Lblt => Some(Work::Lblt(Lblt::new(pattern)?)),
            FaerFactorization::Lu => {
                Some(Work::Lu(Lu::new(Matrix::new(pattern, Triangle::Full)?)?))
            }
        };
        let factor_entries = match &self.work {
            None => Some(0),
            Some(Work::Cholesky(work)) => Some(work.factor.len()),
            Some(Work::Lblt(work)) => Some(work.entries()),
            Some(Work::Lu(_)) => None,
        };
        Ok(AnalyzeReport { factor_entries })
    }

    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        a.check_finite()?;
        match &mut self.work {
            None => {}
            Some(Work::Cholesky(work)) => work.factorize(a)?,
            Some(Work::Lblt(work)) => work.factorize(a)?,
            Some(Work::Lu(work)) => {
                let block = |row: usize| a.pattern().block_of_row(row);
                if let Some(block) = work.factorize(a.values(), block)? {
                    self.check_doubt(a, |_| SolveError::Singular { block })?;
                }
            }
        }
        Ok(FactorReport::default())
    }

    fn is_stable(&self) -> bool {
        match &self.work {
            None => true,
            Some(Work::Cholesky(work)) => work.positive,
            Some(Work::Lblt(work)) => work.is_positive(),
            Some(Work::Lu(_)) => false,
        }
    }

    fn is_doubtful(&self) -> bool {
        match &self.work {
            None | Some(Work::Lu(_)) => false,
            Some(Work::Cholesky(work)) => work.singularity.is_doubtful(),
            Some(Work::Lblt(work)) => work.is_doubtful(),
        }
    }

    fn substitute(
        &mut self,
        _: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        x.copy_from_slice(b);
        match &mut self.work {
            None => {}
            Some(Work::Cholesky(work)) => work.solve(x),
            Some(Work::Lblt(work)) => work.solve(x),
            Some(Work::Lu(work)) => work.solve(x, false),
        }
        Ok(())
    }
}

/// The matrix as faer reads it.
struct Matrix {
    /// Rows and columns, taken out of `csc`: faer checks them once here instead of at every use.
    pattern: SymbolicSparseColMat<usize>,
    csc: Csc<usize>,
}

impl Matrix {
    fn new(p: &BlockPattern, triangle: Triangle) -> Result<Self, SolveError> {
        Self::of(Csc::new(p, triangle)?)
    }

    fn of(mut csc: Csc<usize>) -> Result<Self, SolveError> {
        let n = csc.column_start.len() - 1;
        let (start, row) = (
            std::mem::take(&mut csc.column_start),
            std::mem::take(&mut csc.row),
        );
        Ok(Self {
            pattern: SymbolicSparseColMat::new_checked(n, n, start, None, row),
            csc,
        })
    }

    fn view(&self) -> SparseColMatRef<'_, usize, f64> {
        SparseColMatRef::new(self.pattern.as_ref(), &self.csc.values)
    }
}

/// L Lᵀ or L D Lᵀ in the order of the pattern.
struct Cholesky {
    llt: bool,
    matrix: Matrix,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    /// Where each row's diagonal entry stands in `factor`.
    diagonal: Vec<usize>,
    memory: MemBuffer,
    singularity: SingularityTest,
    /// True if all pivots of the last factor are positive.
    positive: bool,
}

impl Cholesky {
    fn new(p: &BlockPattern, llt: bool) -> Result<Self, SolveError> {
        // With the natural order faer wants the upper triangle: its panel code fails on the lower one.
        let matrix = Matrix::new(p, Triangle::Upper)?;
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: PANELS,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(
            matrix.pattern.as_ref(),
            Side::Upper,
            SymmetricOrdering::Identity,
            params,
        )
        .map_err(library)?;
        let factorize = if llt {
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
        } else {
            symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
        };
        let memory = memory(factorize.or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq)))?;
        let factor = vec![0.0; symbolic.len_val()];
        let diagonal = diagonal(&symbolic);
        Ok(Self {
            llt,
            matrix,
            symbolic,
            factor,
            diagonal,
            memory,
            singularity: SingularityTest::new(p.dim()),
            positive: llt,
        })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        self.matrix.csc.gather(a.values());
        if let Err(row) = self.eliminate() {
            let block = a.pattern().block_of_row(row);
            return Err(if self.llt {
                // Roundoff may have made a vanishing pivot negative, which is another mistake of the caller.
                diagnose(a, Pivots::Positive).unwrap_or(SolveError::NotPositiveDefinite { block })
            } else {
                SolveError::Singular { block }
            });
        }
        // L of L Lᵀ holds the square roots of the pivots.
        let power = if self.llt { 2 } else { 1 };
        let Self {
            llt,
            symbolic,
            factor,
            diagonal,
            memory,
            singularity,
            positive,
            ..
        } = self;
        *positive = diagonal.iter().all(|&d| factor[d] > 0.0);
        check_pivots(a, |r| factor[diagonal[r]].powi(power), singularity)?;
        singularity.check(a, |x| substitute(*llt, symbolic, factor, memory, x))
    }

    /// Factorises the values gathered; the row of a pivot that faer refuses as an error.
    fn eliminate(&mut self) -> Result<(), usize> {
        let (values, l, stack) = (
            self.matrix.view(),
            &mut self.factor[..],
            MemStack::new(&mut self.memory),
        );
        let failed = if self.llt {
            let (regularization, params) = (Default::default(), Default::default());
            self.symbolic
                .factorize_numeric_llt(
                    l,
                    values,
                    Side::Upper,
                    regularization,
                    Par::Seq,
                    stack,
                    params,
                )
                .map_err(|LltError::NonPositivePivot { index }| index)
                .err()
        } else {
            let (regularization, params) = (Default::default(), Default::default());
            self.symbolic
                .factorize_numeric_ldlt(
                    l,
                    values,
                    Side::Upper,
                    regularization,
                    Par::Seq,
                    stack,
                    params,
                )
                .map_err(|LdltError::ZeroPivot { index }| index)
                .err()
        };
        match (failed, self.symbolic.raw()) {
            (None, _) => Ok(()),
            // faer counts rows from 1 in its code for single entries, from 0 in that for panels.
            (Some(index), SymbolicCholeskyRaw::Simplicial(_)) => Err(index.saturating_sub(1)),
            (Some(index), SymbolicCholeskyRaw::Supernodal(_)) => Err(index),
        }
    }

    fn solve(&mut self, x: &mut [f64]) {
        let Self {
            llt,
            symbolic,
            factor,
            memory,
            ..
        } = self;
        substitute(*llt, symbolic, factor, memory, x);
    }
}

/// x ← A⁻¹ x by the factor of L Lᵀ or of L D Lᵀ.
fn substitute(
    llt: bool,
    symbolic: &SymbolicCholesky<usize>,
    factor: &[f64],
    memory: &mut MemBuffer,
    x: &mut [f64],
) {
    let n = x.len();
    let (x, stack) = (
        MatMut::from_column_major_slice_mut(x, n, 1),
        MemStack::new(memory),
    );
    if llt {
        let factor = LltRef::new(symbolic, factor);
        factor.solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
    } else {
        let factor = LdltRef::new(symbolic, factor);
        factor.solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
    }
}

/// Where the diagonal stands in the factor's values.
fn diagonal(symbolic: &SymbolicCholesky<usize>) -> Vec<usize> {
    match symbolic.raw() {
        // Columns, each from its diagonal entry on.
        SymbolicCholeskyRaw::Simplicial(l) => l.col_ptr()[..l.ncols()].to_vec(),
        // Panels of columns: a square on top of the rows below it.
        SymbolicCholeskyRaw::Supernodal(l) => (0..l.n_supernodes())
            .flat_map(|s| {
                let columns = l.supernode_end()[s] - l.supernode_begin()[s];
                let rows = columns + l.supernode(s).pattern().len();
                (0..columns).map(move |c| l.col_ptr_for_val()[s] + c * (rows + 1))
            })
            .collect(),
    }
}

/// P A Q = L U, entry by entry: what faer itself chooses for all patterns but nearly full ones. Its panel code hides the
/// pivots, and could not tell a singular matrix.
pub(crate) struct Lu {
    matrix: Matrix,
    /// Order of the columns.
    columns: Perm<usize>,
    /// Order of the rows, and its inverse, as of the last factorisation.
    rows: [Vec<usize>; 2],
    factors: SimplicialLu<usize, f64>,
    memory: MemBuffer,
    /// Scales R and C of the factorised matrix R A C.
    scales: Scales,
}

impl Lu {
    fn new(matrix: Matrix) -> Result<Self, SolveError> {
        let (n, entries) = (matrix.pattern.ncols(), matrix.csc.values.len());
        let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
        let mut work = memory(colamd::order_scratch::<usize>(n, n, entries))?;
        let stack = MemStack::new(&mut work);
        colamd::order(
            &mut order,
            &mut inverse,
            matrix.pattern.as_ref(),
            colamd::Control::default(),
            stack,
        )
        .map_err(library)?;
        let factorize = simplicial::factorize_simplicial_numeric_lu_scratch::<usize, f64>(n, n);
        let solve = simplicial::solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq);
        let transposed = simplicial::solve_transpose_in_place_scratch::<usize, f64>(n, 1, Par::Seq);
        let memory = memory(factorize.or(solve).or(transposed))?;
        let columns = Perm::new_checked(order.into(), inverse.into(), n);
        Ok(Self {
            matrix,
            columns,
            rows: [vec![0; n], vec![0; n]],
            factors: SimplicialLu::new(),
            memory,
            scales: Scales::new(n),
        })
    }

    /// For a matrix that need not be symmetric, with at least one row.
    pub(crate) fn general(a: &GeneralMatrix) -> Result<Self, SolveError> {
        Self::new(Matrix::of(Csc::of_general(a)?)?)
    }

    /// Factorises the values; errors name the block of a scalar column. The block of the first pivot that is noise, if any.
    pub(crate) fn factorize(
        &mut self,
        values: &[f64],
        block_of: impl Fn(usize) -> usize,
    ) -> Result<Option<usize>, SolveError> {
        self.matrix.csc.gather(values);
        let Matrix { pattern, csc } = &mut self.matrix;
        let columns = pattern.col_ptr().windows(2).enumerate();
        let at = columns.flat_map(|(c, range)| (range[0]..range[1]).map(move |e| (e, c)));
        let rows = pattern.row_idx();
        let entries = at.clone().map(|(e, c)| (rows[e], c, csc.values[e]));
        if self.scales.of_uneven(entries) {
            for (e, c) in at {
                csc.values[e] = self.scales.at(rows[e], c, csc.values[e]);
            }
        }
        let [order, inverse] = &mut self.rows;
        let (matrix, columns, stack) = (
            self.matrix.view(),
            self.columns.as_ref(),
            MemStack::new(&mut self.memory),
        );
        let block = |column: usize| block_of(columns.arrays().0[column]);
        simplicial::factorize_simplicial_numeric_lu(
            order,
            inverse,
            &mut self.factors,
            matrix,
            columns,
            stack,
        )
        .map_err(|e| match e {
            LuError::SymbolicSingular { index } => SolveError::Singular {
                block: block(index),
            },
            e @ LuError::Generic(_) => library(e),
        })?;

        // faer divides by any pivot. It is noise at roundoff of the largest number in its column, as in `dense`.
        let mut doubt = None;
        let u = self.factors.u_factor_unsorted();
        for (column, &from) in columns.arrays().0.iter().enumerate() {
            let above = u.val_of_col(column);
            let pivot = above.last().copied().unwrap_or_default();
            let scale = above
                .iter()
                .chain(matrix.val_of_col(from))
                .fold(0.0, |s: f64, v| s.max(v.abs()));
            if !pivot.is_finite() {
                return Err(SolveError::NonFinite {
                    what: "factor",
                    block: block(column),
                });
            }
            if pivot == 0.0 {
                return Err(SolveError::Singular {
                    block: block(column),
                });
            }
            if pivot.abs() <= NOISE * f64::ROUNDOFF * scale {
                doubt = doubt.or(Some(block(column)));
            }
        }
        Ok(doubt)
    }

    /// Largest number that elimination made over the largest that it began with.
    pub(crate) fn growth(&self) -> f64 {
        let u = self.factors.u_factor_unsorted();
        let columns = 0..self.columns.len();
        let largest = columns.fold(0.0, |most, c| norm_inf(u.val_of_col(c)).max(most));
        largest / norm_inf(&self.matrix.csc.values)
    }

    /// x ← A⁻¹ x, or A⁻ᵀ x.
    pub(crate) fn solve(&mut self, x: &mut [f64], transposed: bool) {
        let n = x.len();
        let rows = PermRef::new_checked(&self.rows[0], &self.rows[1], n);
        let Scales {
            rows: of_rows,
            columns: of_columns,
        } = &self.scales;
        let [before, after] = if transposed {
            [of_columns, of_rows]
        } else {
            [of_rows, of_columns]
        };
        let times = |x: &mut [f64], by: &[f64]| x.iter_mut().zip(by).for_each(|(x, s)| *x *= s);
        times(x, before);
        let (v, stack) = (
            MatMut::from_column_major_slice_mut(&mut *x, n, 1),
            MemStack::new(&mut self.memory),
        );
        let (columns, conjugate, one) = (self.columns.as_ref(), Conj::No, Par::Seq);
        if transposed {
            let factors = &self.factors;
            factors.solve_transpose_in_place_with_conj(rows, columns, conjugate, v, one, stack);
        } else {
            let factors = &self.factors;
            factors.solve_in_place_with_conj(rows, columns, conjugate, v, one, stack);
        }
        times(x, after);
    }
}

fn memory(needed: StackReq) -> Result<MemBuffer, SolveError> {
    MemBuffer::try_new(needed).map_err(|_| SolveError::Library {
        library: "faer",
        message: "out of memory".into(),
    })
}

fn library(e: impl std::fmt::Display) -> SolveError {
    SolveError::Library {
        library: "faer",
        message: e.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::FaerFactorization::{Lblt, Ldlt, Llt};
    use super::*;

    fn faer(factorization: FaerFactorization) -> Faer {
        Faer::new(FaerOptions { factorization })
    }

    #[test]
    fn dependent_rows_are_refused() {
        for kind in [Llt, Ldlt, Lblt] {
            testing::sees_dependence(&mut faer(kind));
        }
    }

    #[test]
    fn both_ways_of_the_cholesky_code_are_tested() {
        let panels = |p: &Arc<BlockPattern>| {
            let symbolic = Cholesky::new(p, true).unwrap().symbolic;
            matches!(symbolic.raw(), SymbolicCholeskyRaw::Supernodal(_))
        };
        let with_panels = testing::patterns().iter().filter(|p| panels(p)).count();
        assert!(!panels(&testing::patterns()[0]) && with_panels > 0);
    }

    #[test]
    fn faer_tells_the_row_of_the_pivot_that_it_refuses() {
        for pattern in testing::patterns() {
            for row in 0..pattern.dim() {
                let block = pattern.block_of_row(row);
                let entry = (row - pattern.rows(block).start) * (pattern.size(block) + 1);
                for llt in [true, false] {
                    let mut a = testing::positive_definite(&pattern, 1);
                    if !llt {
                        // Without couplings the pivots are the diagonal entries.
                        a = SymBlockMatrix::zeros(pattern.clone());
                        for r in 0..pattern.blocks() {
                            let n = pattern.size(r);
                            a.block_mut(pattern.column(r).start)
                                .iter_mut()
                                .step_by(n + 1)
                                .for_each(|v| *v = 1.0);
                        }
                    }
                    a.block_mut(pattern.column(block).start)[entry] *= if llt { -1.0 } else { 0.0 };
                    let mut cholesky = Cholesky::new(&pattern, llt).unwrap();
                    cholesky.matrix.csc.gather(a.values());
                    assert_eq!(cholesky.eliminate(), Err(row), "{llt} {pattern:?}");
                }
            }
        }
    }
}
