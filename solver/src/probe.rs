//! Whether a factor with weak pivots is that of a singular matrix.
//!
//! Where rows depend on others, rounding leaves a pivot that may be far above the noise of its own row: it is that of all
//! rows of the null vector. With sᵢ what the diagonal entries were made from and Ã = S^(−1/2) A S^(−1/2), ỹ = Ã⁻¹ x̃ shows an
//! eigenvalue of at most ‖x̃‖/‖ỹ‖, whatever the signs of the others. The first of two such ỹ starts at the rows of weak
//! pivots, which a null vector takes part in; the matrix is singular to rounding where the second is 1/([`NOISE`] u) long.

use crate::block_ldlt::{NOISE, WEAK};
use crate::kernels::Scalar;

/// Pivots that stand in doubt.
#[derive(Debug, Clone, Default)]
pub(crate) struct Probe {
    /// What each diagonal entry was made from, of the dimension of the matrix.
    made_from: Vec<f64>,
    /// A vector as long.
    vector: Vec<f64>,
    /// The row of the weakest pivot, if that is weak.
    weakest: Option<usize>,
}

impl Probe {
    /// For matrices of a dimension. Allocates all that is needed.
    pub(crate) fn new(dim: usize) -> Self {
        Self {
            made_from: vec![0.0; dim],
            vector: vec![0.0; dim],
            weakest: None,
        }
    }

    /// Looks at the pivots of all rows, each with what it was made from.
    pub(crate) fn look(&mut self, pivots: impl Iterator<Item = (f64, f64)>) {
        let mut least = 1.0;
        self.weakest = None;
        let rows = self.made_from.iter_mut().zip(&mut self.vector);
        for (row, ((pivot, from), (made_from, x))) in pivots.zip(rows).enumerate() {
            let beyond = pivot.abs() / (WEAK * f64::ROUNDOFF * from);
            (*made_from, *x) = (from, if beyond < 1.0 { 1.0 } else { 0.0 });
            if beyond < least {
                (least, self.weakest) = (beyond, Some(row));
            }
        }
    }

    /// The row of the weakest of the pivots looked at, where the matrix is singular; `solve` is x ← A⁻¹ x.
    pub(crate) fn dependent_row(&mut self, mut solve: impl FnMut(&mut [f64])) -> Option<usize> {
        let weakest = self.weakest?;
        self.iterate(&mut solve);
        let growth = self.iterate(&mut solve);
        // Where numbers overflow there is no inverse to speak of.
        let regular = NOISE * f64::ROUNDOFF * growth < 1.0;
        (!regular).then_some(weakest)
    }

    /// x̃ ← Ã⁻¹ x̃/‖x̃‖; its length.
    fn iterate(&mut self, solve: &mut impl FnMut(&mut [f64])) -> f64 {
        let size = length(&self.vector);
        for (x, from) in self.vector.iter_mut().zip(&self.made_from) {
            *x = *x / size * from.sqrt();
        }
        solve(&mut self.vector);
        for (x, from) in self.vector.iter_mut().zip(&self.made_from) {
            *x *= from.sqrt();
        }
        length(&self.vector)
    }
}

/// ‖x‖, of numbers that may be too large to be squared; NaN where one is.
fn length(x: &[f64]) -> f64 {
    let largest = x.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let squares = x.iter().map(|x| (x / largest) * (x / largest));
    largest * squares.sum::<f64>().sqrt()
}
