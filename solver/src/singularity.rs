//! Singularity test of a factor with weak pivots: inverse iteration on the scaled matrix (Higham,
//! *Accuracy and Stability of Numerical Algorithms*, chapter 15).
//!
//! Where rows depend on others, rounding leaves a pivot that may be far above the noise of its own row: it is that of all
//! rows of the null vector. With sᵢ what the diagonal entries were made from and Ã = S^(−1/2) A S^(−1/2), ỹ = Ã⁻¹ x̃ shows an
//! eigenvalue of at most ‖x̃‖/‖ỹ‖, whatever the signs of the others. The first of two such ỹ starts at the rows of weak
//! pivots, which a null vector takes part in; the matrix is singular to rounding where the second is
//! 1/(4 u) = 2·10¹⁵ long. Springs that nothing holds, in 20,000 random nets of 3 … 30 nodes, leave 5·10¹⁵ at least: what
//! rounding makes of a singular matrix is no better than that, and what is better has a solution.

use crate::kernels::Scalar;
use crate::{SolveError, SymBlockMatrix};

/// Smallest sound pivot, in units of roundoff of its summands; smaller ones are tested. Rounding leaves xᵀ A x of a null vector x with
/// the pivot's own number 1, and A is known to u √(aᵢᵢ aⱼⱼ): more than this only where other numbers of x, scaled, are ten
/// thousand times that one.
pub(crate) const WEAK: f64 = 1e8;

/// Length of the second ỹ above which a matrix is not claimed by this test alone, which knows no other start than the weak
/// rows.
const DOUBTFUL: f64 = 1e12;

/// The pivots of a factor that stand in doubt, and the work space of their test.
#[derive(Debug, Clone, Default)]
pub(crate) struct SingularityTest {
    /// Largest magnitude that each diagonal entry was computed from, of the dimension of the
    /// matrix.
    scale: Vec<f64>,
    /// A vector as long.
    vector: Vec<f64>,
    /// Rows of weak pivots, ascending.
    weak: Vec<usize>,
    /// The second length of the last test.
    growth: f64,
}

impl SingularityTest {
    /// For matrices of a dimension. Allocates all that is needed.
    pub(crate) fn new(dim: usize) -> Self {
        Self {
            scale: vec![0.0; dim],
            vector: vec![0.0; dim],
            weak: Vec::with_capacity(dim),
            growth: 0.0,
        }
    }

    /// Before the pivots of a factor: forgets those of the last one.
    pub(crate) fn begin(&mut self) {
        self.weak.clear();
        self.growth = 0.0;
    }

    /// Returns true if the last factor is so near to that of a singular matrix that another test is
    /// needed.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.growth > DOUBTFUL
    }

    /// Takes the next row's pivot, with the largest magnitude that it was made from.
    #[inline]
    pub(crate) fn take(&mut self, row: usize, pivot: f64, from: f64) {
        self.scale[row] = from;
        if pivot.abs() < WEAK * f64::ROUNDOFF * from {
            self.weak.push(row);
        }
    }

    /// Tests the matrix `a` whose pivots were taken, if any of them is weak; `solve` is x ← A⁻¹ x. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`] with the block of the weak row that has the largest part in the null vector.
    pub(crate) fn check(
        &mut self,
        a: &SymBlockMatrix,
        mut solve: impl FnMut(&mut [f64]),
    ) -> Result<(), SolveError> {
        if self.weak.is_empty() {
            return Ok(());
        }
        self.vector.fill(0.0);
        for &row in &self.weak {
            self.vector[row] = 1.0;
        }
        self.iterate(&mut solve);
        let growth = self.iterate(&mut solve);
        self.growth = growth;
        // Where numbers overflow there is no inverse to speak of.
        if 4.0 * f64::ROUNDOFF * growth < 1.0 {
            return Ok(());
        }
        let part = |row: &usize| self.vector[*row].abs();
        let weak = self.weak.iter().copied();
        let row = weak.reduce(|a, b| if part(&b) > part(&a) { b } else { a });
        let block = a.pattern().block_of_row(row.unwrap_or(0));
        Err(SolveError::Singular { block })
    }

    /// x̃ ← Ã⁻¹ x̃/‖x̃‖; its length.
    fn iterate(&mut self, solve: &mut impl FnMut(&mut [f64])) -> f64 {
        let size = length(&self.vector);
        for (x, from) in self.vector.iter_mut().zip(&self.scale) {
            *x = *x / size * from.sqrt();
        }
        solve(&mut self.vector);
        for (x, from) in self.vector.iter_mut().zip(&self.scale) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BlockPattern;
    use std::sync::Arc;

    /// The verdict on a diagonal matrix, scaled by `from`, whose pivots are `pivots` of that.
    fn verdict(pivots: &[f64], from: &[f64]) -> Result<(), SolveError> {
        let pattern = BlockPattern::new(&vec![1; pivots.len()], &[]).expect("a pattern");
        let a = SymBlockMatrix::zeros(Arc::new(pattern));
        let mut test = SingularityTest::new(pivots.len());
        // Twice: nothing is left of the first.
        for _ in 0..2 {
            test.begin();
            for (row, (pivot, from)) in pivots.iter().zip(from).enumerate() {
                test.take(row, pivot * from, *from);
            }
            let invert = |x: &mut [f64]| {
                for (x, (pivot, from)) in x.iter_mut().zip(pivots.iter().zip(from)) {
                    *x /= pivot * from;
                }
            };
            test.check(&a, invert)?;
        }
        Ok(())
    }

    #[test]
    fn doubtful_matrices_are_singular_from_their_condition_on() {
        for scale in [1e-290, 1.0, 1e290] {
            let from = [scale; 3];
            assert_eq!(verdict(&[1.0, 1.0, 1.0], &from), Ok(()));
            assert_eq!(verdict(&[1.0, 1.0 / 2e15, -0.5], &from), Ok(()));
            let singular = |block| Err(SolveError::Singular { block });
            assert_eq!(verdict(&[1.0, 1.0 / 3e15, -0.5], &from), singular(1));
            // The singular row is reported, not the other weak one.
            assert_eq!(verdict(&[1e-9, 1.0, 3e-16], &from), singular(2));
        }
        let found = verdict(&[1e-9, 3e-16], &[1e200, 1e-90]);
        assert_eq!(found, Err(SolveError::Singular { block: 1 }));
    }

    #[test]
    fn what_has_no_inverse_is_singular() {
        let pattern = BlockPattern::new(&[2], &[]).expect("a pattern");
        let a = SymBlockMatrix::zeros(Arc::new(pattern));
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            let mut test = SingularityTest::new(2);
            test.begin();
            test.take(0, 1.0, 1.0);
            test.take(1, 1e-9, 1.0);
            let found = test.check(&a, |x| x.iter_mut().for_each(|x| *x *= bad));
            assert_eq!(found, Err(SolveError::Singular { block: 0 }), "{bad}");
        }
    }
}
