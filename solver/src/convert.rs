//! Matrices of other libraries: compressed columns, faer's and nalgebra-sparse's, into [`GeneralMatrix`], and a general
//! matrix into blocks.
//!
//! ```
//! use taut_solver::{GeneralMatrix, SymBlockMatrix};
//!
//! // [2 −1; −1 2], a block row for each row.
//! let a = GeneralMatrix::from_csc(2, 2, vec![0, 2, 4], vec![0, 1, 0, 1], vec![2.0, -1.0, -1.0, 2.0])?;
//! let a = SymBlockMatrix::from_symmetric(&a, &[1, 1])?;
//! assert_eq!(a.get(0, 1), -1.0);
//! # Ok::<(), taut_solver::ConvertError>(())
//! ```
//!
//! Entries are copied as they are: no number is rounded. Explicit zeros are dropped, since places that couple nothing cost
//! fill. With the features `faer` and
//! `nalgebra-sparse` their matrices convert by `TryFrom`.

use crate::{BlockPattern, GeneralMatrix, SolveError, SymBlockMatrix};
use std::fmt;
use std::sync::Arc;

/// Why a matrix is not taken over. Rows and columns count from 0.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ConvertError {
    /// It is not square.
    NotSquare {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
    },
    /// The column starts are not 0, …, number of entries, ascending, one more than there are columns.
    ColumnStarts,
    /// The row indices are not as many as the values.
    Lengths {
        /// Number of row indices.
        rows: usize,
        /// Number of values.
        values: usize,
    },
    /// A row index is not below the dimension.
    RowOutOfRange {
        /// The index.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// The rows of a column do not ascend.
    Unsorted {
        /// The column.
        column: usize,
    },
    /// Two entries stand at one place.
    Duplicate {
        /// Their row.
        row: usize,
        /// Their column.
        column: usize,
    },
    /// A NaN or an infinity.
    NonFinite {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// An entry differs from the one across the diagonal.
    NotSymmetric {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// The sizes of the blocks do not add up to the dimension.
    Sizes {
        /// The dimension.
        dim: usize,
    },
    /// An entry lies in a block that the pattern does not store.
    OutsidePattern {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// The blocks are too large for memory.
    Solve(SolveError),
}

impl fmt::Display for ConvertError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSquare { rows, columns } => write!(
                f,
                "{rows} × {columns} is not square: only square systems are solved"
            ),
            Self::ColumnStarts => f.write_str(
                "the column starts have to ascend from 0 to the number of entries, one more than there are columns",
            ),
            Self::Lengths { rows, values } => {
                write!(
                    f,
                    "{rows} row indices for {values} values: give one for each"
                )
            }
            Self::RowOutOfRange { row, column } => {
                write!(
                    f,
                    "row index {row} in column {column} is not below the dimension"
                )
            }
            Self::Unsorted { column } => {
                write!(f, "the rows of column {column} do not ascend: sort them")
            }
            Self::Duplicate { row, column } => write!(
                f,
                "two entries at row {row}, column {column}: add them up, as `from_entries` does"
            ),
            Self::NonFinite { row, column } => {
                write!(f, "a NaN or an infinity at row {row}, column {column}")
            }
            Self::NotSymmetric { row, column } => write!(
                f,
                "the entry at row {row}, column {column} differs from the one across the diagonal: give both triangles of \
                 a symmetric matrix, or use `GeneralSolver`"
            ),
            Self::Sizes { dim } => {
                write!(f, "the sizes of the blocks do not add up to {dim} rows")
            }
            Self::OutsidePattern { row, column } => write!(
                f,
                "the entry at row {row}, column {column} lies in no block of the pattern: make a pattern of this matrix"
            ),
            Self::Solve(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for ConvertError {}

impl From<SolveError> for ConvertError {
    fn from(e: SolveError) -> Self {
        Self::Solve(e)
    }
}

impl GeneralMatrix {
    /// The `rows` × `columns` matrix of compressed columns: `column_start` holds the first entry of each column and the
    /// number of entries, `row` and `values` the entries, rows ascending in each column. Entries that are zero are dropped.
    ///
    /// # Errors
    /// [`ConvertError`] where it is not square, the indices are not as said, or a value is not finite.
    pub fn from_csc(
        rows: usize,
        columns: usize,
        column_start: Vec<usize>,
        row: Vec<usize>,
        values: Vec<f64>,
    ) -> Result<Self, ConvertError> {
        if rows != columns {
            return Err(ConvertError::NotSquare { rows, columns });
        }
        if row.len() != values.len() {
            let (rows, values) = (row.len(), values.len());
            return Err(ConvertError::Lengths { rows, values });
        }
        let whole = column_start.first() == Some(&0) && column_start.last() == Some(&row.len());
        let fits = Some(column_start.len()) == columns.checked_add(1);
        if !(whole && fits && column_start.is_sorted()) {
            return Err(ConvertError::ColumnStarts);
        }
        for (column, range) in column_start.windows(2).enumerate() {
            let mut before = None;
            for e in range[0]..range[1] {
                let row = row[e];
                if row >= rows {
                    return Err(ConvertError::RowOutOfRange { row, column });
                }
                if before == Some(row) {
                    return Err(ConvertError::Duplicate { row, column });
                }
                if before > Some(row) {
                    return Err(ConvertError::Unsorted { column });
                }
                if !values[e].is_finite() {
                    return Err(ConvertError::NonFinite { row, column });
                }
                before = Some(row);
            }
        }
        let mut a = Self::of_columns(column_start, row, values);
        a.drop_zeros();
        Ok(a)
    }

    /// Fails where an entry differs from the one across the diagonal, what is not stored being zero.
    fn expect_symmetric(&self) -> Result<(), ConvertError> {
        let mut wrong = None;
        self.for_each(|row, column, value| {
            if wrong.is_none() && value != self.get(column, row) {
                wrong = Some(ConvertError::NotSymmetric { row, column });
            }
        });
        wrong.map_or(Ok(()), Err)
    }
}

impl BlockPattern {
    /// The pattern with block rows of the given `sizes` that stores the entries of `a` in and below the diagonal. Allocates.
    ///
    /// # Errors
    /// [`ConvertError::Sizes`], and [`ConvertError::Solve`] where the number of values overflows.
    pub fn of_lower(a: &GeneralMatrix, sizes: &[usize]) -> Result<Self, ConvertError> {
        let dim = a.dim();
        let sum = sizes.iter().try_fold(0_usize, |sum, &n| sum.checked_add(n));
        if sum != Some(dim) {
            return Err(ConvertError::Sizes { dim });
        }
        let block_of: Vec<usize> = (sizes.iter().enumerate())
            .flat_map(|(block, &size)| std::iter::repeat_n(block, size))
            .collect();
        let mut couplings = Vec::new();
        a.for_each(|r, c, _| {
            let pair = (block_of[r], block_of[c]);
            if r > c && pair.0 != pair.1 && couplings.last() != Some(&pair) {
                couplings.push(pair);
            }
        });
        Ok(Self::new(sizes, &couplings)?)
    }
}

impl SymBlockMatrix {
    /// A symmetric matrix in block rows of the given `sizes`, which stores the blocks with an entry. For new values of the
    /// same pattern: [`set_lower`](Self::set_lower). Allocates.
    ///
    /// # Errors
    /// [`ConvertError::NotSymmetric`], to the last bit; [`ConvertError::Sizes`]; [`ConvertError::Solve`] where there is no
    /// memory for the blocks.
    pub fn from_symmetric(a: &GeneralMatrix, sizes: &[usize]) -> Result<Self, ConvertError> {
        a.expect_symmetric()?;
        let mut blocks = Self::try_zeros(Arc::new(BlockPattern::of_lower(a, sizes)?))?;
        blocks.set_lower(a)?;
        Ok(blocks)
    }

    /// Takes the values of the entries of `a` in and below the diagonal, and zero everywhere else. Allocates nothing.
    ///
    /// # Errors
    /// [`ConvertError::Sizes`] where `a` has another dimension, [`ConvertError::OutsidePattern`].
    pub fn set_lower(&mut self, a: &GeneralMatrix) -> Result<(), ConvertError> {
        if a.dim() != self.dim() {
            return Err(ConvertError::Sizes { dim: a.dim() });
        }
        self.values_mut().fill(0.0);
        let pattern = self.pattern().clone();
        let p = &pattern;
        let mut outside = None;
        a.for_each(|row, column, value| {
            if row < column {
                return;
            }
            let (i, j) = (p.block_of_row(row), p.block_of_row(column));
            let Some(k) = p.find(i, j) else {
                outside = outside.or(Some((row, column)));
                return;
            };
            let (r, c, n) = (row - p.rows(i).start, column - p.rows(j).start, p.size(i));
            let block = self.block_mut(k);
            block[r + c * n] = value;
            if i == j {
                block[c + r * n] = value;
            }
        });
        let error = |(row, column)| ConvertError::OutsidePattern { row, column };
        outside.map_or(Ok(()), |at| Err(error(at)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// [4 1 0; 1 5 2; 0 2 6] by columns.
    fn plain() -> (Vec<usize>, Vec<usize>, Vec<f64>) {
        let values = vec![4.0, 1.0, 1.0, 5.0, 2.0, 2.0, 6.0];
        (vec![0, 2, 5, 7], vec![0, 1, 0, 1, 2, 1, 2], values)
    }

    fn general() -> GeneralMatrix {
        let (start, row, values) = plain();
        GeneralMatrix::from_csc(3, 3, start, row, values).expect("sound")
    }

    #[test]
    fn a_symmetric_matrix_is_taken_over_in_any_blocks() {
        let a = general();
        for sizes in [&[1, 1, 1][..], &[2, 1], &[1, 2], &[3], &[0, 3, 0]] {
            let blocks = SymBlockMatrix::from_symmetric(&a, sizes).expect("symmetric");
            for (r, c) in (0..3).flat_map(|r| (0..3).map(move |c| (r, c))) {
                assert_eq!(blocks.get(r, c), a.get(r, c), "{sizes:?} {r} {c}");
            }
            // The upper triangle of a diagonal block is there as well.
            let full = blocks.block(blocks.pattern().column(0).start);
            assert!(sizes[0] != 2 || full == [4.0, 1.0, 1.0, 5.0]);
        }
        let scalar = SymBlockMatrix::from_symmetric(&a, &[1, 1, 1]).expect("symmetric");
        assert_eq!(scalar.pattern().stored_blocks(), 5);
        for sizes in [&[1, 1][..], &[2, 2], &[usize::MAX, 4]] {
            let refused = SymBlockMatrix::from_symmetric(&a, sizes);
            assert_eq!(refused, Err(ConvertError::Sizes { dim: 3 }));
        }
    }

    #[test]
    fn zeros_make_no_pattern() {
        let (start, row, mut values) = plain();
        (values[1], values[2], values[6]) = (0.0, -0.0, 0.0);
        let mut a = GeneralMatrix::from_csc(3, 3, start, row, values).expect("sound");
        let found = (a.rows(), a.column_start());
        assert_eq!(found, (&[0, 1, 2, 1][..], &[0, 1, 3, 4][..]));
        assert_eq!((a.drop_zeros(), a.get(1, 2), a.get(2, 2)), (0, 2.0, 0.0));
        let blocks = SymBlockMatrix::from_symmetric(&a, &[1, 1, 1]).expect("symmetric");
        assert_eq!(blocks.pattern().stored_blocks(), 4);
    }

    #[test]
    fn other_values_of_the_same_pattern_replace_the_first() {
        let mut blocks = SymBlockMatrix::from_symmetric(&general(), &[1, 1, 1]).expect("symmetric");
        let entries = vec![(0, 0, 1.0), (1, 1, 2.0), (2, 1, 3.0)];
        let other = GeneralMatrix::from_entries(3, entries).expect("sound");
        blocks.set_lower(&other).expect("in the pattern");
        assert_eq!(blocks.values(), [1.0, 0.0, 2.0, 3.0, 0.0]);
        let beyond = GeneralMatrix::from_entries(3, vec![(2, 0, 1.0)]).expect("sound");
        let (row, column) = (2, 0);
        let refused = blocks.set_lower(&beyond);
        assert_eq!(refused, Err(ConvertError::OutsidePattern { row, column }));
        let larger = GeneralMatrix::from_entries(4, vec![]).expect("sound");
        let found = blocks.set_lower(&larger);
        assert_eq!(found, Err(ConvertError::Sizes { dim: 4 }));
    }

    #[test]
    fn what_is_no_square_symmetric_matrix_is_refused_with_its_place() {
        use ConvertError as E;
        type Change = fn(&mut Vec<usize>, &mut Vec<usize>, &mut Vec<f64>);
        let rows: [(Change, ConvertError); 11] = [
            (|_, rows, _| rows[3] = 0, E::Duplicate { row: 0, column: 1 }),
            (|_, rows, _| rows.swap(2, 3), E::Unsorted { column: 1 }),
            (
                |_, rows, _| rows[6] = 3,
                E::RowOutOfRange { row: 3, column: 2 },
            ),
            (
                |_, _, v| v[1] = f64::NAN,
                E::NonFinite { row: 1, column: 0 },
            ),
            (
                |_, _, v| v[1] = 1.0_f64.next_up(),
                E::NotSymmetric { row: 1, column: 0 },
            ),
            (|_, _, v| v.truncate(6), E::Lengths { rows: 7, values: 6 }),
            (|start, _, _| start[3] = 6, E::ColumnStarts),
            (|start, _, _| start[0] = 1, E::ColumnStarts),
            (|start, _, _| start.swap(1, 2), E::ColumnStarts),
            (|start, _, _| start.truncate(3), E::ColumnStarts),
            (|start, _, _| start.clear(), E::ColumnStarts),
        ];
        for (change, expected) in rows {
            let (mut start, mut row, mut values) = plain();
            change(&mut start, &mut row, &mut values);
            let a = GeneralMatrix::from_csc(3, 3, start, row, values);
            let a = a.and_then(|a| SymBlockMatrix::from_symmetric(&a, &[1, 1, 1]));
            assert_eq!(a, Err(expected));
        }
        let (start, row, values) = plain();
        let (rows, columns) = (4, 3);
        let a = GeneralMatrix::from_csc(rows, columns, start, row, values);
        assert_eq!(a, Err(ConvertError::NotSquare { rows, columns }));
    }
}
