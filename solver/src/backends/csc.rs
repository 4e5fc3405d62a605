//! Scalar compressed-column copies of a matrix, for the libraries that want them, and what those libraries leave
//! open: whether a pivot is noise, and which block is to blame.

use crate::block_ldlt::{BlockLdlt, NOISE, Pivots, has_negative_minor};
use crate::error::expect_room;
use crate::kernels::Scalar;
use crate::singularity::SingularityTest;
use crate::{BlockPattern, GeneralMatrix, SolveError, SymBlockMatrix};

/// Which entries of the symmetric matrix are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Triangle {
    /// Row ≤ column.
    #[allow(dead_code)] // where no backend that uses it is compiled in
    Upper,
    /// All of them.
    Full,
}

/// A compressed-column pattern, rows ascending in each column, with the place where each value comes from.
#[derive(Debug, Clone)]
pub(crate) struct Csc<I> {
    /// First entry of each column, and the number of entries at the end; length `dim + 1`.
    pub(crate) column_start: Vec<I>,
    /// Row of each entry.
    pub(crate) row: Vec<I>,
    /// Value of each entry, as of the last [`gather`](Self::gather).
    pub(crate) values: Vec<f64>,
    /// Index of each entry's value in the values that [`gather`](Self::gather) is given.
    source: Vec<usize>,
}

impl<I: TryFrom<usize> + Copy> Csc<I> {
    /// Lists the entries of a pattern, counted before there is room for them. Allocates.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] where the index type is too small, or memory.
    pub(crate) fn new(p: &BlockPattern, triangle: Triangle) -> Result<Self, SolveError> {
        let n = p.dim();
        let mut start = vec![0; n + 1];
        for_each_entry(p, triangle, |column, _, _| start[column + 1] += 1);
        for c in 0..n {
            start[c + 1] += start[c];
        }
        let entries = start[n];
        let index = |i: usize| index::<I>(i, entries.max(n));
        index(entries.max(n))?;
        expect_room::<[usize; 3]>(entries)?;
        let mut csc = Self {
            column_start: start.iter().map(|&i| index(i)).collect::<Result<_, _>>()?,
            row: vec![index(0)?; entries],
            values: vec![0.0; entries],
            source: vec![0; entries],
        };
        let rows: Vec<I> = (0..n).map(index).collect::<Result<_, _>>()?;
        for_each_entry(p, triangle, |column, row, source| {
            let at = start[column];
            start[column] += 1;
            (csc.row[at], csc.source[at]) = (rows[row], source);
        });
        Ok(csc)
    }

    /// Lists the entries of a general matrix. Allocates.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] where the index type is too small.
    #[allow(dead_code)] // where no backend that uses it is compiled in
    pub(crate) fn of_general(a: &GeneralMatrix) -> Result<Self, SolveError> {
        let entries = a.values().len();
        let index = |i: &usize| index(*i, entries.max(a.dim()));
        Ok(Self {
            column_start: a
                .column_start()
                .iter()
                .map(index)
                .collect::<Result<_, _>>()?,
            row: a.rows().iter().map(index).collect::<Result<_, _>>()?,
            values: vec![0.0; entries],
            source: (0..entries).collect(),
        })
    }

    /// Copies the matrix's values in, all that it stores. Allocates nothing.
    pub(crate) fn gather(&mut self, from: &[f64]) {
        for (value, &source) in self.values.iter_mut().zip(&self.source) {
            *value = from[source];
        }
    }
}

/// Calls `f(column, row, source)` for each entry, those of a column by ascending rows, with the place of its value.
fn for_each_entry(p: &BlockPattern, triangle: Triangle, mut f: impl FnMut(usize, usize, usize)) {
    for j in 0..p.blocks() {
        for k in p.column(j) {
            let (rows, columns, at) = (p.rows(p.row(k)), p.rows(j), p.values(k).start);
            for c in columns.clone() {
                for r in rows.clone().filter(|&r| r >= c) {
                    let source = at + (r - rows.start) + (c - columns.start) * rows.len();
                    f(r, c, source);
                    if r != c && triangle == Triangle::Full {
                        f(c, r, source);
                    }
                }
            }
        }
    }
}

/// A number as an index, `largest` of which is in use.
fn index<I: TryFrom<usize>>(i: usize, largest: usize) -> Result<I, SolveError> {
    I::try_from(i).map_err(|_| SolveError::TooLarge {
        size: largest,
        limit: i32::MAX as usize,
        what: "entries",
    })
}

/// Judges the pivots of a symmetric factorisation in the order of the pattern: `pivot(r)` for each scalar row, which
/// `test` takes. The libraries themselves refuse exact zeros only, and a row that depends on others seldom leaves one.
/// Allocates nothing.
///
/// # Errors
/// [`SolveError::Singular`] and [`SolveError::NonFinite`] with the block.
#[allow(dead_code)] // where no backend that uses it is compiled in
pub(crate) fn check_pivots(
    a: &SymBlockMatrix,
    pivot: impl Fn(usize) -> f64,
    test: &mut SingularityTest,
) -> Result<(), SolveError> {
    let p = a.pattern();
    test.begin();
    for block in 0..p.blocks() {
        let n = p.size(block);
        let diagonal = a.block(p.column(block).start).iter().step_by(n + 1);
        for (r, &entry) in p.rows(block).zip(diagonal) {
            let pivot = pivot(r);
            if !pivot.is_finite() {
                return Err(SolveError::NonFinite {
                    what: "factor",
                    block,
                });
            }
            // The sum of what was subtracted from the entry counts as well: it is what cancels.
            let from = entry.abs().max((entry - pivot).abs());
            if pivot.abs() <= NOISE * f64::ROUNDOFF * from {
                return Err(SolveError::Singular { block });
            }
            test.take(r, pivot, from);
        }
    }
    Ok(())
}

/// Why a library may have refused `a`, where it does not say or not in terms of blocks: what the project's own
/// factorisation says of it, `None` where that one accepts it. Rounding makes the vanishing pivot of a dependent row
/// negative as often as not, so that a matrix that is not positive definite is tested for being singular. Allocates; for
/// the way out only.
pub(crate) fn diagnose(a: &SymBlockMatrix, pivots: Pivots) -> Option<SolveError> {
    let mut own = BlockLdlt::<f64>::new(a.pattern(), a.pattern()).ok()?;
    let refused = own.factorize(a, pivots).err();
    let in_doubt = matches!(refused, None | Some(SolveError::NotPositiveDefinite { .. }));
    if in_doubt && !has_negative_minor(a) {
        let mut test = SingularityTest::new(a.dim());
        let found = own.factorize(a, Pivots::Nonzero);
        let found = found.and_then(|()| own.test(a, &mut test));
        if let Err(singular @ SolveError::Singular { .. }) = found {
            return Some(singular);
        }
    }
    refused
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn both_triangles_hold_the_matrix() {
        let p = Arc::new(BlockPattern::new(&[2, 1, 3], &[(0, 1), (0, 2)]).unwrap());
        let mut a = SymBlockMatrix::zeros(p.clone());
        for (i, v) in a.values_mut().iter_mut().enumerate() {
            *v = i as f64 + 1.0;
        }
        for (triangle, entries) in [(Triangle::Upper, 18), (Triangle::Full, 30)] {
            let mut csc = Csc::<u32>::new(&p, triangle).unwrap();
            csc.gather(a.values());
            assert_eq!(csc.row.len(), entries);
            for c in 0..6 {
                let range = csc.column_start[c] as usize..csc.column_start[c + 1] as usize;
                assert!(csc.row[range.clone()].is_sorted());
                for e in range {
                    assert_eq!(csc.values[e], a.get(csc.row[e] as usize, c));
                }
            }
        }
    }

    #[test]
    fn small_index_types_overflow_to_an_error() {
        let p = BlockPattern::new(&[20], &[]).unwrap();
        assert!(matches!(
            Csc::<u8>::new(&p, Triangle::Full),
            Err(SolveError::TooLarge { size: 400, .. })
        ));
    }
}
