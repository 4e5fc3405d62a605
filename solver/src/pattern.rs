//! Block patterns: which blocks of a symmetric matrix are stored, and where.
//!
//! A pattern is made once for a topology and shared (`Arc`) by the matrix and the backends. Only the lower
//! triangle is stored, by block columns; the diagonal block of each column is always there and comes first.
//! The order of the blocks *is* the elimination order of the direct backends that do not reorder.

use crate::SolveError;
use std::ops::Range;

/// Where the blocks of a symmetric block-sparse matrix lie (lower triangle, by block columns).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockPattern {
    /// First scalar row of each block row, and the dimension at the end; length `blocks + 1`.
    start: Vec<usize>,
    /// First stored block of each block column, and their number at the end; length `blocks + 1`.
    column_start: Vec<usize>,
    /// Block row of each stored block, ascending within a column.
    row: Vec<usize>,
    /// First value of each stored block, and the number of values at the end.
    offset: Vec<usize>,
    /// Group of each block row.
    groups: Vec<u32>,
}

impl BlockPattern {
    /// A pattern with block rows of the given `sizes` and, besides the diagonal, the blocks `couplings` (in either
    /// order, repeats allowed). All blocks are in group 0 until [`with_groups`](Self::with_groups). Allocates.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] where a coupling names a block that is not there,
    /// [`SolveError::TooLarge`] where the number of values overflows.
    pub fn new(sizes: &[usize], couplings: &[(usize, usize)]) -> Result<Self, SolveError> {
        let blocks = sizes.len();
        let overflow = || SolveError::TooLarge {
            size: usize::MAX,
            limit: isize::MAX as usize,
            what: "entries",
        };
        let mut start = Vec::with_capacity(blocks + 1);
        start.push(0);
        for &size in sizes {
            let next = start[start.len() - 1];
            start.push(usize::checked_add(next, size).ok_or_else(overflow)?);
        }
        let mut entries: Vec<(usize, usize)> = Vec::with_capacity(blocks + couplings.len());
        entries.extend((0..blocks).map(|i| (i, i)));
        for &(i, j) in couplings {
            let largest = i.max(j);
            if largest >= blocks {
                return Err(SolveError::Dimension {
                    what: "block index",
                    expected: blocks,
                    found: largest,
                });
            }
            entries.push((i.min(j), largest));
        }
        // Stable, for it merges couplings that come in order.
        entries.sort();
        entries.dedup();

        let mut column_start = vec![0; blocks + 1];
        let mut offset = Vec::with_capacity(entries.len() + 1);
        offset.push(0);
        let mut values = 0_usize;
        for &(column, row) in &entries {
            column_start[column + 1] += 1;
            let len = sizes[column].checked_mul(sizes[row]).ok_or_else(overflow)?;
            values = values
                .checked_add(len)
                .filter(|&v| v <= isize::MAX as usize / 8)
                .ok_or_else(overflow)?;
            offset.push(values);
        }
        for j in 0..blocks {
            column_start[j + 1] += column_start[j];
        }
        let row = entries.into_iter().map(|(_, row)| row).collect();
        Ok(Self {
            start,
            column_start,
            row,
            offset,
            groups: vec![0; blocks],
        })
    }

    /// Sets the group of each block row. Block Gauss–Seidel and the group preconditioner solve
    /// exactly inside each group, [SL §VI].
    ///
    /// # Errors
    /// [`SolveError::Dimension`] unless there is one group for each block.
    pub fn with_groups(mut self, groups: Vec<u32>) -> Result<Self, SolveError> {
        crate::error::expect_len("groups", self.blocks(), groups.len())?;
        self.groups = groups;
        Ok(self)
    }

    #[allow(dead_code)] // where no backend that uses it is compiled in
    /// The pattern with only those blocks that `keep(row, column)` accepts; the diagonal always stays.
    pub(crate) fn restricted(
        &self,
        keep: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, SolveError> {
        let sizes: Vec<usize> = (0..self.blocks()).map(|i| self.size(i)).collect();
        let mut couplings = Vec::new();
        for j in 0..self.blocks() {
            couplings.extend(
                self.column(j)
                    .map(|k| (self.row(k), j))
                    .filter(|&(i, j)| keep(i, j)),
            );
        }
        Self::new(&sizes, &couplings)?.with_groups(self.groups.clone())
    }

    #[allow(dead_code)] // where the backend that asks is not compiled in
    /// The pattern with its block rows in `order` (position → block), every one once.
    pub(crate) fn permuted(&self, order: &[usize]) -> Result<Self, SolveError> {
        let position = crate::ordering::positions(order, self.blocks())?;
        let sizes: Vec<usize> = order.iter().map(|&j| self.size(j)).collect();
        let couplings: Vec<_> = (0..self.blocks())
            .flat_map(|j| self.column(j).skip(1).map(move |k| (self.row(k), j)))
            .map(|(i, j)| (position[i], position[j]))
            .collect();
        let groups = order.iter().map(|&j| self.groups[j]).collect();
        Self::new(&sizes, &couplings)?.with_groups(groups)
    }

    /// Number of block rows.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.groups.len()
    }

    /// Number of scalar rows: the dimension of the matrix.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.start[self.blocks()]
    }

    /// Number of stored blocks (lower triangle with diagonal).
    #[must_use]
    pub fn stored_blocks(&self) -> usize {
        self.row.len()
    }

    /// Number of stored values.
    #[must_use]
    pub fn stored_values(&self) -> usize {
        self.offset[self.row.len()]
    }

    /// Scalar rows of block row `i`.
    #[must_use]
    pub fn size(&self, i: usize) -> usize {
        self.start[i + 1] - self.start[i]
    }

    /// Range of the scalar rows of block row `i`.
    #[must_use]
    pub fn rows(&self, i: usize) -> Range<usize> {
        self.start[i]..self.start[i + 1]
    }

    /// Block row that holds scalar row `r`.
    #[must_use]
    pub fn block_of_row(&self, r: usize) -> usize {
        self.start.partition_point(|&s| s <= r).saturating_sub(1)
    }

    /// Stored blocks of block column `j`, the diagonal first.
    #[must_use]
    pub fn column(&self, j: usize) -> Range<usize> {
        self.column_start[j]..self.column_start[j + 1]
    }

    /// Block row of stored block `k`.
    #[must_use]
    pub fn row(&self, k: usize) -> usize {
        self.row[k]
    }

    /// Values of stored block `k`: a column-major matrix of `size(row) × size(column)`.
    #[must_use]
    pub fn values(&self, k: usize) -> Range<usize> {
        self.offset[k]..self.offset[k + 1]
    }

    /// Stored block at block row `i` and block column `j` (`i ≥ j`), if there is one.
    #[must_use]
    pub fn find(&self, i: usize, j: usize) -> Option<usize> {
        let column = self.column(j);
        self.row[column.clone()]
            .binary_search(&i)
            .ok()
            .map(|p| column.start + p)
    }

    /// Group of each block row.
    #[must_use]
    pub fn groups(&self) -> &[u32] {
        &self.groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stores_the_lower_triangle_once() {
        let p = BlockPattern::new(&[2, 3, 1], &[(0, 1), (1, 0), (2, 1)]).unwrap();
        assert_eq!((p.blocks(), p.dim(), p.stored_blocks()), (3, 6, 5));
        assert_eq!(p.find(1, 0).map(|k| p.values(k).len()), Some(6));
        assert_eq!(p.find(2, 0), None);
        assert_eq!(p.row(p.column(1).start), 1);
        let found = (p.block_of_row(0), p.block_of_row(4), p.block_of_row(5));
        assert_eq!(found, (0, 1, 2));
    }

    #[test]
    fn refuses_what_is_not_there() {
        let e = BlockPattern::new(&[2], &[(0, 1)]).unwrap_err();
        let right = SolveError::Dimension {
            what: "block index",
            expected: 1,
            found: 1,
        };
        assert_eq!(e, right);
        assert!(BlockPattern::new(&[usize::MAX, 2], &[]).is_err());
        assert!(BlockPattern::new(&[usize::MAX / 2], &[]).is_err());
        assert!(
            BlockPattern::new(&[1, 1], &[])
                .unwrap()
                .with_groups(vec![0])
                .is_err()
        );
    }

    #[test]
    fn empty_pattern_has_no_rows() {
        let p = BlockPattern::new(&[], &[]).unwrap();
        assert_eq!((p.blocks(), p.dim(), p.stored_values()), (0, 0, 0));
    }
}
