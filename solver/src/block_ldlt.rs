//! Block LDLᵀ without pivoting, in the order of the pattern, with the fill of that order.
//!
//! A = L D Lᵀ, L unit lower triangular, D diagonal. For a chain the factor is a block band and the cost is linear in
//! the number of blocks; block rows that close loops and come last fill their own row only (a border). It exists for
//! symmetric positive definite and for quasi-definite matrices ([M Jᵀ; J −Σ] with M and Σ positive definite has it in
//! any order, Vanderbei 1995); pivots may then be negative.
//!
//! One code serves doubles and [`crate::DoubleDouble`] (the reference), and any block size.

use crate::error::expect_room;
use crate::kernels::{
    BlockWork, Bound, Scalar, Strips, by_size, by_sizes, panel_solve, subtract_product,
    subtract_transposed, unit_lower_solve, unit_upper_solve, update, update_diagonal,
};
use crate::ordering::factor_pattern;
use crate::singularity::{SingularityTest, WEAK};
use crate::{BlockPattern, SolveError, SymBlockMatrix};

/// A pivot at or below this many units of roundoff of what it was made from is noise.
pub(crate) const NOISE: f64 = 8.0;

/// Which pivots are accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pivots {
    /// Positive ones only.
    Positive,
    /// Any that is not noise.
    Nonzero,
}

/// Factor of a block-sparse symmetric matrix.
#[derive(Debug, Clone)]
pub(crate) struct BlockLdlt<T> {
    /// Pattern of L: the pattern of A and its fill.
    factor: BlockPattern,
    /// For each stored block of A the block of L that it is added into, `None` where A's block is to be ignored.
    place: Vec<Option<usize>>,
    /// Blocks of L, column-major; the diagonal blocks hold their unit lower triangle.
    values: Vec<T>,
    /// 1/D, length `dim`.
    inverse_pivots: Vec<T>,
    /// Largest magnitude that was added into or subtracted from each diagonal entry, length `dim`.
    scale: Vec<f64>,
    /// L·D of the column at work, at most the largest column.
    panel: Vec<T>,
}

impl<T: Scalar> BlockLdlt<T> {
    /// Symbolic factorisation of `wanted`, a pattern with the blocks of `of` or fewer. Allocates all that is needed.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] where the fill overflows, or memory.
    pub(crate) fn new(of: &BlockPattern, wanted: &BlockPattern) -> Result<Self, SolveError> {
        let factor = factor_pattern(wanted)?;
        let mut place = Vec::with_capacity(of.stored_blocks());
        for j in 0..of.blocks() {
            for k in of.column(j) {
                let i = of.row(k);
                place.push(wanted.find(i, j).and_then(|_| factor.find(i, j)));
            }
        }
        let panel = (0..factor.blocks())
            .map(|j| column_values(&factor, j))
            .max()
            .unwrap_or(0);
        expect_room::<T>(factor.stored_values().saturating_add(panel))?;
        Ok(Self {
            values: vec![0.0.into(); factor.stored_values()],
            inverse_pivots: vec![0.0.into(); factor.dim()],
            scale: vec![0.0; factor.dim()],
            panel: vec![0.0.into(); panel],
            place,
            factor,
        })
    }

    #[allow(dead_code)] // where no backend that uses it is compiled in
    /// Stored values of L.
    pub(crate) fn factor_values(&self) -> usize {
        self.factor.stored_values()
    }

    #[cfg(test)]
    /// Number of entries below the diagonal in each scalar column of L.
    pub(crate) fn scalar_column_lengths(&self) -> impl Iterator<Item = u64> {
        let p = &self.factor;
        (0..p.blocks()).flat_map(|j| {
            let below: usize = p.column(j).skip(1).map(|k| p.size(p.row(k))).sum();
            (0..p.size(j)).map(move |c| (below + c) as u64)
        })
    }

    /// Factorises `a`, whose pattern is the `of` of [`new`](Self::new). Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`] or [`SolveError::NotPositiveDefinite`] with the block; of positive pivots the latter, too,
    /// where one vanishes of a matrix that is certainly not semidefinite: what is factorised may be a singular part of a
    /// regular matrix.
    pub(crate) fn factorize(
        &mut self,
        a: &SymBlockMatrix,
        pivots: Pivots,
    ) -> Result<(), SolveError> {
        self.values.fill(0.0.into());
        for (k, place) in self.place.iter().enumerate() {
            if let Some(l) = *place {
                for (to, &from) in self.values[self.factor.values(l)]
                    .iter_mut()
                    .zip(a.block(k))
                {
                    *to = from.into();
                }
            }
        }
        for j in 0..self.factor.blocks() {
            let n = self.factor.size(j);
            let diagonal = &self.values[self.factor.values(self.factor.column(j).start)];
            for (r, scale) in self.scale[self.factor.rows(j)].iter_mut().enumerate() {
                *scale = diagonal[r * (n + 1)].to_f64().abs();
            }
        }
        let done = T::run(EliminateAll(self, pivots));
        match done {
            Err(SolveError::Singular { block })
                if pivots == Pivots::Positive && has_negative_minor(a) =>
            {
                Err(SolveError::NotPositiveDefinite { block })
            }
            done => done,
        }
    }

    /// Eliminates block column `k`: factor of its diagonal block, its part of L, update of the columns after it.
    #[inline(always)]
    fn eliminate<S: Strips<T>>(&mut self, k: usize, pivots: Pivots) -> Result<(), SolveError> {
        let p = &self.factor;
        let (n, rows, column) = (p.size(k), p.rows(k), p.column(k));
        let diagonal = p.values(column.start);
        let (head, later) = self.values.split_at_mut(diagonal.end);
        let (diagonal, scale) = (&mut head[diagonal], &mut self.scale[rows.clone()]);
        let inverse = &mut self.inverse_pivots[rows];
        let failed = |e: PivotError| e.at(k);
        by_size!(n, |n| factor_diagonal::<S, _, _>(
            n, diagonal, inverse, scale, pivots
        ))
        .map_err(failed)?;

        let base = p.values(column.start).end;
        for b in column.start + 1..column.end {
            let m = p.size(p.row(b));
            let range = p.values(b).start - base..p.values(b).end - base;
            let panel = &mut self.panel[range.clone()];
            let block = &mut later[range];
            by_sizes!(m, n, |m, n| panel_solve::<S, _, _, _>(
                m, n, diagonal, inverse, block, panel
            ));
        }
        // The blocks of L(:, k) end where the next column begins, so later columns can be written while they are read.
        let later_base = p.values(column.end - 1).end;
        let (column_values, later) = later.split_at_mut(later_base - base);
        for bj in column.start + 1..column.end {
            let j = p.row(bj);
            let l_j = &column_values[p.values(bj).start - base..p.values(bj).end - base];
            let nj = p.size(j);
            let mut target = p.column(j).start;
            for bi in bj..column.end {
                let i = p.row(bi);
                while p.row(target) < i {
                    target += 1;
                }
                let x_i = &self.panel[p.values(bi).start - base..p.values(bi).end - base];
                let range = p.values(target);
                let block = &mut later[range.start - later_base..range.end - later_base];
                if i == j {
                    let scale = &mut self.scale[p.rows(i)];
                    by_sizes!(nj, n, |m, k| update_diagonal::<S, _, _, _>(
                        m, k, block, x_i, l_j, scale
                    ));
                } else {
                    let mi = p.size(i);
                    if mi == nj {
                        by_sizes!(nj, n, |m, k| update::<S, _, _, _, _>(
                            m, m, k, block, x_i, l_j
                        ));
                    } else {
                        update::<S, _, _, _, _>(mi, nj, n, block, x_i, l_j);
                    }
                }
            }
        }
        Ok(())
    }

    /// Solves A x = b in place of b, of length `dim`. Allocates nothing.
    pub(crate) fn solve(&self, x: &mut [T]) {
        let blocks = self.factor.blocks();
        self.solve_blocks(0..blocks, x);
    }

    /// Solves in the block rows `blocks` (ascending) only; no stored block may couple them to
    /// others.
    pub(crate) fn solve_blocks<I>(&self, blocks: I, x: &mut [T])
    where
        I: DoubleEndedIterator<Item = usize> + Clone,
    {
        T::run(Substitute(self, blocks, x));
    }

    #[inline(always)]
    fn substitute<S: Strips<T>, I>(&self, blocks: I, x: &mut [T])
    where
        I: DoubleEndedIterator<Item = usize> + Clone,
    {
        let p = &self.factor;
        for k in blocks.clone() {
            let n = p.size(k);
            let column = p.column(k);
            let (head, tail) = x.split_at_mut(p.rows(k).end);
            let x_k = &mut head[p.rows(k)];
            by_size!(n, |n| unit_lower_solve(
                n,
                &self.values[p.values(column.start)],
                x_k
            ));
            for b in column.start + 1..column.end {
                let rows = p.rows(p.row(b));
                let x_i = &mut tail[rows.start - p.rows(k).end..rows.end - p.rows(k).end];
                by_sizes!(rows.len(), n, |m, n| subtract_product::<S, _, _, _>(
                    m,
                    n,
                    &self.values[p.values(b)],
                    x_k,
                    x_i
                ));
            }
        }
        for k in blocks.rev() {
            let n = p.size(k);
            let column = p.column(k);
            let (head, tail) = x.split_at_mut(p.rows(k).end);
            let x_k = &mut head[p.rows(k)];
            for (x, &d) in x_k.iter_mut().zip(&self.inverse_pivots[p.rows(k)]) {
                *x = *x * d;
            }
            for b in column.start + 1..column.end {
                let rows = p.rows(p.row(b));
                let x_i = &tail[rows.start - p.rows(k).end..rows.end - p.rows(k).end];
                by_sizes!(rows.len(), n, |m, n| subtract_transposed(
                    m,
                    n,
                    &self.values[p.values(b)],
                    x_i,
                    x_k
                ));
            }
            by_size!(n, |n| unit_upper_solve(
                n,
                &self.values[p.values(column.start)],
                x_k
            ));
        }
    }
}

/// The elimination of all block columns.
struct EliminateAll<'a, T>(&'a mut BlockLdlt<T>, Pivots);

impl<T: Scalar> BlockWork<T> for EliminateAll<'_, T> {
    type Output = Result<(), SolveError>;

    #[inline(always)]
    fn run<S: Strips<T>>(self) -> Result<(), SolveError> {
        let Self(factor, pivots) = self;
        for k in 0..factor.factor.blocks() {
            factor.eliminate::<S>(k, pivots)?;
        }
        Ok(())
    }
}

/// The solve for the rows of some block rows.
struct Substitute<'a, T, I>(&'a BlockLdlt<T>, I, &'a mut [T]);

impl<T: Scalar, I: DoubleEndedIterator<Item = usize> + Clone> BlockWork<T>
    for Substitute<'_, T, I>
{
    type Output = ();

    #[inline(always)]
    fn run<S: Strips<T>>(self) {
        self.0.substitute::<S, I>(self.1, self.2);
    }
}

/// Number of values of block column `j`.
fn column_values(p: &BlockPattern, j: usize) -> usize {
    let column = p.column(j);
    p.values(column.end - 1).end - p.values(column.start).start
}

/// Returns true if a_rc² > a_rr a_cc for some r ≠ c, beyond the rounding of A. No positive
/// semidefinite matrix has such a minor.
pub(crate) fn has_negative_minor(a: &SymBlockMatrix) -> bool {
    let mut found = false;
    a.for_each_lower(|r, c, coupling| {
        // Products of square roots, since squares overflow.
        let most = a.get(r, r).max(0.0).sqrt() * a.get(c, c).max(0.0).sqrt();
        found |= r != c && coupling.abs() > most * (1.0 + WEAK * f64::EPSILON);
    });
    found
}

/// A pivot that cannot be divided by.
#[derive(Debug)]
pub(crate) enum PivotError {
    Singular,
    Negative,
    NonFinite,
}

impl PivotError {
    fn at(self, block: usize) -> SolveError {
        match self {
            Self::Singular => SolveError::Singular { block },
            Self::Negative => SolveError::NotPositiveDefinite { block },
            Self::NonFinite => SolveError::NonFinite {
                what: "factor",
                block,
            },
        }
    }
}

/// In place LDLᵀ of the lower triangle of the n×n block `a`; `inverse` receives 1/D. `scale` holds the magnitude of
/// what each diagonal entry was made from, and takes what the block itself subtracts from it, so that cancellation to
/// noise is seen.
#[inline(always)]
pub(crate) fn factor_diagonal<S: Strips<T>, T: Scalar, N: Bound>(
    n: N,
    a: &mut [T],
    inverse: &mut [T],
    scale: &mut [f64],
    pivots: Pivots,
) -> Result<(), PivotError> {
    let n = n.get();
    let (a, inverse, scale) = (&mut a[..n * n], &mut inverse[..n], &mut scale[..n]);
    // True for each sign, + and −, that an earlier pivot has.
    let mut signs = [false; 2];
    for c in 0..n {
        // Left-looking: column c of L D is column c of A less what the columns before it take away. The rows above
        // the diagonal are computed along and never read.
        let (done, rest) = a.split_at_mut(n * c);
        let column = &mut rest[..n];
        S::subtract(n, c, done, |s| done[s + n * s] * done[c + n * s], column);
        let d = column[c];
        let (size, reciprocal) = (d.to_f64(), T::from(1.0) / d);
        if !size.is_finite() {
            return Err(PivotError::NonFinite);
        }
        if signs == [true; 2] {
            // With earlier pivots of both signs the terms may cancel, so the largest one counts;
            // otherwise the entry is as large.
            let part = |s: usize| (done[s + n * s] * done[c + n * s] * done[c + n * s]).to_f64();
            scale[c] = (0..c).fold(scale[c], |most, s| most.max(part(s).abs()));
        }
        signs[usize::from(size < 0.0)] = true;
        if size.abs() <= NOISE * T::ROUNDOFF * scale[c] {
            return Err(PivotError::Singular);
        }
        if size < 0.0 && pivots == Pivots::Positive {
            return Err(PivotError::Negative);
        }
        if !reciprocal.to_f64().is_finite() {
            return Err(PivotError::NonFinite);
        }
        inverse[c] = reciprocal;
        for entry in &mut column[c + 1..] {
            *entry = *entry * reciprocal;
        }
    }
    Ok(())
}

#[allow(dead_code)] // where no backend that uses it is compiled in
impl BlockLdlt<f64> {
    /// Returns true if all pivots of the last factorisation are positive.
    pub(crate) fn is_positive(&self) -> bool {
        self.inverse_pivots.iter().all(|d| *d > 0.0)
    }

    /// Tests `a`, which was factorised last, for singularity to rounding. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`] with the block.
    pub(crate) fn test(
        &self,
        a: &SymBlockMatrix,
        test: &mut SingularityTest,
    ) -> Result<(), SolveError> {
        test.begin();
        for (row, (inverse, from)) in self.inverse_pivots.iter().zip(&self.scale).enumerate() {
            test.take(row, 1.0 / inverse, *from);
        }
        test.check(a, |x| self.solve(x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backends::testing::positive_definite;
    use std::sync::Arc;

    fn random(sizes: &[usize], couplings: &[(usize, usize)]) -> SymBlockMatrix {
        let pattern = BlockPattern::new(sizes, couplings).unwrap();
        positive_definite(&Arc::new(pattern), 1)
    }

    #[test]
    fn a_chain_has_no_fill_and_a_closing_row_fills_its_own_row_only() {
        let chain: Vec<_> = (1..10).map(|i| (i - 1, i)).collect();
        let p = BlockPattern::new(&[2; 10], &chain).unwrap();
        assert_eq!(factor_pattern(&p).unwrap(), p);
        let p = BlockPattern::new(&[2; 11], &[chain, vec![(0, 10), (9, 10)]].concat()).unwrap();
        let f = factor_pattern(&p).unwrap();
        assert_eq!(f.stored_blocks(), 11 + 9 + 10);
        assert!((0..10).all(|j| f.find(10, j).is_some()));
    }

    #[test]
    fn quasi_definite_matrices_have_negative_pivots() {
        let mut a = random(&[2, 2], &[(0, 1)]);
        let diagonal = a.block_mut(2);
        for v in diagonal {
            *v = -*v;
        }
        let mut factor = BlockLdlt::<f64>::new(a.pattern(), a.pattern()).unwrap();
        let found = factor.factorize(&a, Pivots::Positive);
        assert_eq!(found, Err(SolveError::NotPositiveDefinite { block: 1 }));
        factor.factorize(&a, Pivots::Nonzero).unwrap();
        let mut x = vec![1.0, 2.0, 3.0, 4.0];
        factor.solve(&mut x);
        assert!(
            crate::backward_error(&a, &[1.0, 2.0, 3.0, 4.0], &x)
                .unwrap()
                .normwise
                < 1e-15
        );
    }

    /// [0 1; 1 0] between regular rows: the part that is factorised is singular, the matrix is not.
    #[test]
    fn a_singular_part_of_an_indefinite_matrix_is_not_called_singular() {
        let mut a = random(&[1, 1], &[(0, 1)]);
        let diagonal = a.pattern().restricted(|i, j| i == j).unwrap();
        let mut parts = BlockLdlt::<f64>::new(a.pattern(), &diagonal).unwrap();
        for (values, expected) in [
            (
                [1.0, 1.0, 0.0],
                SolveError::NotPositiveDefinite { block: 1 },
            ),
            (
                [1e200, 1e-200, 0.0],
                SolveError::NotPositiveDefinite { block: 1 },
            ),
            ([1.0, 0.0, 0.0], SolveError::Singular { block: 1 }),
        ] {
            a.values_mut().copy_from_slice(&values);
            assert_eq!(parts.factorize(&a, Pivots::Positive), Err(expected));
        }
        a.values_mut().copy_from_slice(&[1.0, 1.0, 1.0]);
        let mut whole = BlockLdlt::<f64>::new(a.pattern(), a.pattern()).unwrap();
        let singular = Err(SolveError::Singular { block: 1 });
        assert_eq!(whole.factorize(&a, Pivots::Positive), singular);
    }

    #[test]
    fn duplicated_rows_are_named() {
        // Rows 0 and 1 are equal, and so are their couplings to a third block.
        let mut a = random(&[1, 1, 1], &[(0, 1), (0, 2), (1, 2)]);
        a.values_mut()
            .copy_from_slice(&[0.3, 0.3, 0.1, 0.3, 0.1, 5.0]);
        let mut factor = BlockLdlt::<f64>::new(a.pattern(), a.pattern()).unwrap();
        let found = factor.factorize(&a, Pivots::Nonzero);
        assert_eq!(found, Err(SolveError::Singular { block: 1 }));
    }
}
