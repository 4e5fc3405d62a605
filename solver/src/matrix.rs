//! Symmetric block-sparse matrices: a shared pattern and its values.

use crate::error::expect_room;
use crate::kernels::{
    OneByOne, by_size, by_sizes, subtract_product, subtract_symmetric, subtract_transposed,
};
use crate::{BlockPattern, SolveError};
use std::sync::Arc;
use taut_lanes::Aligned;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// A symmetric matrix whose lower triangle is stored by blocks (see [`BlockPattern`]).
///
/// Diagonal blocks are stored in full; backends read their lower triangle only.
#[derive(Debug, Clone, PartialEq)]
pub struct SymBlockMatrix {
    pattern: Arc<BlockPattern>,
    /// The middle block column begins with a cache line, and with it all others of its size: a cable's ends are smaller.
    values: Aligned,
}

impl SymBlockMatrix {
    /// The zero matrix of a pattern. Allocates, and aborts where memory runs out: of patterns from elsewhere take
    /// [`try_zeros`](Self::try_zeros).
    #[must_use]
    pub fn zeros(pattern: Arc<BlockPattern>) -> Self {
        let middle = pattern.blocks() / 2;
        let stored = (middle < pattern.blocks()).then(|| pattern.column(middle).start);
        let first = stored.map_or(0, |k| pattern.values(k).start);
        let values = Aligned::aligned_at(pattern.stored_values(), first);
        Self { pattern, values }
    }

    /// The zero matrix of a pattern. Allocates.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] where there is no memory for its values.
    pub fn try_zeros(pattern: Arc<BlockPattern>) -> Result<Self, SolveError> {
        expect_room::<f64>(pattern.stored_values())?;
        Ok(Self::zeros(pattern))
    }

    /// The pattern.
    #[must_use]
    pub fn pattern(&self) -> &Arc<BlockPattern> {
        &self.pattern
    }

    /// Dimension of the matrix.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.pattern.dim()
    }

    /// All stored values, `pattern.stored_values()` of them, in the order of the pattern's stored blocks.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// All stored values, to be written.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Stored block `k`, `size(row) × size(column)` numbers, column-major.
    #[must_use]
    pub fn block(&self, k: usize) -> &[f64] {
        &self.values[self.pattern.values(k)]
    }

    /// Stored block `k`, column-major, to be written.
    pub fn block_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.values[self.pattern.values(k)]
    }

    /// Entry at scalar row `r` and column `c`; zero where nothing is stored. For tests and dumps: O(log n).
    #[must_use]
    pub fn get(&self, r: usize, c: usize) -> f64 {
        let (r, c) = (r.max(c), r.min(c));
        let (i, j) = (self.pattern.block_of_row(r), self.pattern.block_of_row(c));
        self.pattern.find(i, j).map_or(0.0, |k| {
            let (rows, columns) = (self.pattern.rows(i), self.pattern.rows(j));
            self.block(k)[(r - rows.start) + (c - columns.start) * rows.len()]
        })
    }

    /// Calls `f(r, c, a_rc)` for each stored entry of the lower triangle (`r ≥ c`), column blocks in order.
    pub fn for_each_lower(&self, mut f: impl FnMut(usize, usize, f64)) {
        let p = &self.pattern;
        for j in 0..p.blocks() {
            let columns = p.rows(j);
            for k in p.column(j) {
                let rows = p.rows(p.row(k));
                let block = self.block(k);
                for c in columns.clone() {
                    for r in rows.clone().filter(|&r| r >= c) {
                        f(
                            r,
                            c,
                            block[(r - rows.start) + (c - columns.start) * rows.len()],
                        );
                    }
                }
            }
        }
    }

    /// Entries (row, column, value) of both triangles.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + Clone + '_ {
        let p = &*self.pattern;
        let blocks = (0..p.blocks()).flat_map(move |j| p.column(j).map(move |k| (k, j)));
        let lower = blocks.flat_map(move |(k, j)| {
            let (rows, first, is_diagonal) = (p.rows(p.row(k)), p.rows(j).start, p.row(k) == j);
            // A block without rows has no entries, whatever the size of its chunks.
            let columns = self.block(k).chunks_exact(rows.len().max(1)).enumerate();
            columns.flat_map(move |(column, entries)| {
                let above = if is_diagonal { column } else { 0 };
                let below = entries.iter().enumerate().skip(above);
                below.map(move |(row, &a)| (rows.start + row, first + column, a))
            })
        });
        lower.flat_map(|(r, c, a)| std::iter::once((r, c, a)).chain((r != c).then_some((c, r, a))))
    }

    /// `r = b − A x`, all of length `dim`. Allocates nothing.
    ///
    /// # Panics
    /// Where a length differs.
    pub fn subtract_product(&self, b: &[f64], x: &[f64], r: &mut [f64]) {
        assert_eq!(
            (b.len(), x.len(), r.len()),
            (self.dim(), self.dim(), self.dim())
        );
        r.copy_from_slice(b);
        let p = &self.pattern;
        for j in 0..p.blocks() {
            let (column, columns) = (p.column(j), p.rows(j));
            let n = columns.len();
            let x_j = &x[columns.clone()];
            by_size!(n, |n| subtract_symmetric(
                n,
                self.block(column.start),
                x_j,
                &mut r[columns.clone()]
            ));
            for k in column.skip(1) {
                let (block, rows) = (self.block(k), p.rows(p.row(k)));
                let x_i = &x[rows.clone()];
                by_sizes!(rows.len(), n, |m, n| {
                    subtract_product::<OneByOne, _, _, _>(m, n, block, x_j, &mut r[rows.clone()]);
                    subtract_transposed(m, n, block, x_i, &mut r[columns.clone()]);
                });
            }
        }
    }

    /// Infinity norm ‖A‖∞ = maxᵢ Σⱼ |aᵢⱼ|. Allocates.
    #[must_use]
    pub fn norm_inf(&self) -> f64 {
        self.norm_inf_in(&mut vec![0.0; self.dim()])
    }

    /// ‖A‖∞, with `sums` as room for one number a row.
    pub(crate) fn norm_inf_in(&self, sums: &mut [f64]) -> f64 {
        sums.fill(0.0);
        self.for_each_lower(|r, c, a| {
            sums[r] += a.abs();
            if r != c {
                sums[c] += a.abs();
            }
        });
        sums.iter().copied().fold(0.0, f64::max)
    }

    /// Fails where a stored value is not finite, with its block row. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::NonFinite`].
    pub fn check_finite(&self) -> Result<(), SolveError> {
        if all_finite(&self.values) {
            return Ok(());
        }
        let p = &self.pattern;
        let bad = (0..p.stored_blocks()).find(|&k| self.block(k).iter().any(|v| !v.is_finite()));
        bad.map_or(Ok(()), |k| {
            Err(SolveError::NonFinite {
                what: "matrix",
                block: p.row(k),
            })
        })
    }
}

/// Returns true if all numbers are finite.
fn all_finite(v: &[f64]) -> bool {
    dispatch(Level::best(), AllFinite(v))
}

/// x·0 is NaN exactly where x is not finite. Sums run side by side, so that the pass is not a chain of dependent
/// additions.
struct AllFinite<'a>(&'a [f64]);

impl Kernel for AllFinite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let zero = I::X8::splat(0.0);
        let mut sums = [zero; 2];
        let (chunks, rest) = self.0.as_chunks::<16>();
        for chunk in chunks {
            sums[0] = I::X8::load(&chunk[..8]).mul_add(zero, sums[0]);
            sums[1] = I::X8::load(&chunk[8..]).mul_add(zero, sums[1]);
        }
        let sum = sums[0] + sums[1];
        sum.all_below(I::X8::splat(1.0)) && rest.iter().all(|x| x.is_finite())
    }
}

/// Returns true if all absolute values are below `bound`; looks no further than the first that is not.
pub(crate) fn all_below(v: &[f64], bound: f64) -> bool {
    dispatch(Level::best(), AllBelow(v, bound))
}

struct AllBelow<'a>(&'a [f64], f64);

impl Kernel for AllBelow<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let bound = I::X8::splat(self.1);
        let (chunks, rest) = self.0.as_chunks::<16>();
        let largest = |chunk: &[f64; 16]| {
            let (a, b) = (I::X8::load(&chunk[..8]), I::X8::load(&chunk[8..]));
            a.abs().max(b.abs())
        };
        chunks.iter().all(|chunk| largest(chunk).all_below(bound))
            && rest.iter().all(|x| x.abs() < self.1)
    }
}

/// Fails where `v` (length `dim`) is not finite, with the block row.
pub(crate) fn check_finite(
    pattern: &BlockPattern,
    what: &'static str,
    v: &[f64],
) -> Result<(), SolveError> {
    if all_finite(v) {
        return Ok(());
    }
    let bad = v.iter().position(|x| !x.is_finite());
    bad.map_or(Ok(()), |r| {
        Err(SolveError::NonFinite {
            what,
            block: pattern.block_of_row(r),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> SymBlockMatrix {
        let pattern = BlockPattern::new(&[2, 1], &[(0, 1)]).unwrap();
        let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
        a.block_mut(0).copy_from_slice(&[4.0, 1.0, 1.0, 3.0]);
        a.block_mut(1).copy_from_slice(&[-1.0, 2.0]);
        a.block_mut(2).copy_from_slice(&[5.0]);
        a
    }

    #[test]
    fn product_is_symmetric() {
        let a = small();
        let mut r = [0.0; 3];
        a.subtract_product(&[3.0, 13.0, 19.0], &[1.0, 2.0, 3.0], &mut r);
        assert_eq!(r, [0.0, 0.0, 1.0]);
        assert_eq!((a.get(0, 2), a.get(2, 1), a.get(1, 1)), (-1.0, 2.0, 3.0));
        assert_eq!(a.norm_inf(), 8.0);
    }

    #[test]
    fn a_block_larger_than_memory_is_an_error() {
        let pattern = Arc::new(BlockPattern::new(&[1 << 29], &[]).unwrap());
        let refused = SymBlockMatrix::try_zeros(pattern).unwrap_err();
        assert!(matches!(refused, SolveError::TooLarge { .. }), "{refused}");
        assert!(refused.to_string().contains("memory"), "{refused}");
        let small = SymBlockMatrix::try_zeros(small().pattern().clone()).unwrap();
        assert_eq!(small.values(), [0.0; 7]);
    }

    #[test]
    fn names_the_block_of_a_nan() {
        let mut a = small();
        assert!(a.check_finite().is_ok());
        a.block_mut(2)[0] = f64::NAN;
        let expected = Err(SolveError::NonFinite {
            what: "matrix",
            block: 1,
        });
        assert_eq!(a.check_finite(), expected);
        let e = check_finite(a.pattern(), "guess", &[0.0, f64::INFINITY, 0.0]);
        let expected = Err(SolveError::NonFinite {
            what: "guess",
            block: 0,
        });
        assert_eq!(e, expected);
    }
}
