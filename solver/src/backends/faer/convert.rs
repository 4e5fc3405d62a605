//! faer's sparse matrices into ours.

use crate::{ConvertError, GeneralMatrix};
use ::faer::sparse::SparseColMatRef;

impl TryFrom<SparseColMatRef<'_, usize, f64>> for GeneralMatrix {
    type Error = ConvertError;

    fn try_from(a: SparseColMatRef<'_, usize, f64>) -> Result<Self, ConvertError> {
        let (mut start, mut row, mut values) = (vec![0], Vec::new(), Vec::new());
        for c in 0..a.ncols() {
            row.extend_from_slice(a.symbolic().row_idx_of_col_raw(c));
            values.extend_from_slice(a.val_of_col(c));
            start.push(row.len());
        }
        Self::from_csc(a.nrows(), a.ncols(), start, row, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::faer::sparse::{SparseColMat, Triplet};

    #[test]
    fn matrices_of_faer_are_taken_over() {
        let entries = [(0, 0, 4.0), (1, 0, 1.0), (0, 1, 1.0), (1, 1, 5.0)];
        let triplets = entries.map(|(r, c, v)| Triplet::new(r, c, v));
        let a = SparseColMat::try_new_from_triplets(2, 2, &triplets).expect("sound");
        let own = GeneralMatrix::from_entries(2, entries.to_vec()).expect("sound");
        assert_eq!(GeneralMatrix::try_from(a.as_ref()), Ok(own));
        let (rows, columns) = (3, 2);
        let tall = SparseColMat::try_new_from_triplets(rows, columns, &triplets).expect("sound");
        let refused = GeneralMatrix::try_from(tall.as_ref());
        assert_eq!(refused, Err(ConvertError::NotSquare { rows, columns }));
    }
}
