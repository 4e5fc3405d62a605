//! Dense LU with partial pivoting, in doubles or in extended precision: the oracle for small systems.
//!
//! It knows nothing of blocks or symmetry, so that it shares no mistake with the others. Cubic cost.

use super::direct::{Common, Direct};
use crate::block_ldlt::NOISE;
use crate::condition::Scales;
use crate::kernels::Scalar;
use crate::options::{DenseOptions, Precision};
use crate::{AnalyzeReport, BlockPattern, DoubleDouble, FactorReport, GeneralMatrix, LinearSolver};
use crate::{SolveError, SymBlockMatrix, norm_inf};
use std::sync::Arc;

/// Most rows: beyond this the matrix alone takes half a gigabyte.
const LIMIT: usize = 8192;

/// A dense solver in the wanted arithmetic.
pub(crate) fn create(options: DenseOptions) -> Box<dyn LinearSolver> {
    match options.precision {
        Precision::Double => Box::new(Dense::<f64>::default()),
        Precision::Extended => Box::new(Dense::<DoubleDouble>::default()),
    }
}

/// The `dense` backend.
#[derive(Debug, Default)]
pub(crate) struct Dense<T> {
    common: Common,
    /// L (unit, below the diagonal) and U, row-major, rows in pivot order.
    lu: Vec<T>,
    /// Row of A that each row of `lu` came from.
    pivot: Vec<usize>,
    work: Vec<T>,
    /// Largest number that each column ever held.
    scale: Vec<f64>,
    /// Largest number before the elimination.
    largest: f64,
    /// Scales R and C of the factorised matrix R A C.
    scales: Scales,
}

impl<T: Scalar + Default> Dense<T> {
    /// Makes room for `n` rows.
    fn allocate(&mut self, n: usize) -> Result<(), SolveError> {
        if n > LIMIT {
            return Err(SolveError::TooLarge {
                size: n,
                limit: LIMIT,
                what: "rows",
            });
        }
        self.lu = vec![T::default(); n * n];
        self.pivot = (0..n).collect();
        self.work = vec![T::default(); n];
        self.scale = vec![0.0; n];
        self.scales = Scales::new(n);
        Ok(())
    }

    /// Room for a matrix that need not be symmetric.
    pub(crate) fn general(a: &GeneralMatrix) -> Result<Self, SolveError> {
        let mut dense = Self::default();
        dense.allocate(a.dim())?;
        Ok(dense)
    }

    /// LU of a matrix that need not be symmetric; the column whose pivot is noise, if any.
    pub(crate) fn factorize_general(
        &mut self,
        a: &GeneralMatrix,
    ) -> Result<Option<usize>, SolveError> {
        let n = a.dim();
        self.lu.fill(T::default());
        a.for_each(|r, c, value| self.lu[r * n + c] = value.into());
        let singular = |column| SolveError::Singular { block: column };
        self.factorize_rows(n).map_err(singular)
    }

    /// LU of the matrix in `lu`, which it scales; the first column that depends on those before it, to rounding: where the
    /// matrix holds something by numbers at roundoff of others, that is right as it is. A column of zeros is an error.
    fn factorize_rows(&mut self, n: usize) -> Result<Option<usize>, usize> {
        for (i, p) in self.pivot.iter_mut().enumerate() {
            *p = i;
        }
        let lu = &self.lu;
        let entries = (0..n * n).map(|at| (at / n, at % n, lu[at].to_f64()));
        if self.scales.of_uneven(entries) {
            for (row, r) in self.lu.chunks_exact_mut(n.max(1)).zip(&self.scales.rows) {
                for (a, c) in row.iter_mut().zip(&self.scales.columns) {
                    *a = *a * (*r).into() * (*c).into();
                }
            }
        }
        // A pivot is noise if it is at roundoff of the largest number that its column ever held.
        for c in 0..n {
            self.scale[c] = column_max(&self.lu, n, 0, c);
        }
        self.largest = norm_inf(&self.scale);
        let (scale, mut doubt) = (&mut self.scale, None);
        for k in 0..n {
            let best = (k..n).max_by(|&p, &q| {
                let size = |r: usize| self.lu[r * n + k].to_f64().abs();
                size(p).total_cmp(&size(q))
            });
            let best = best.unwrap_or(k);
            let pivot = self.lu[best * n + k].to_f64().abs();
            if pivot.is_nan() || pivot == 0.0 {
                return Err(doubt.unwrap_or(k));
            }
            if pivot <= NOISE * T::ROUNDOFF * scale[k] {
                doubt = doubt.or(Some(k));
            }
            if best != k {
                self.pivot.swap(k, best);
                let (upper, lower) = self.lu.split_at_mut(best * n);
                upper[k * n..(k + 1) * n].swap_with_slice(&mut lower[..n]);
            }
            let (done, rest) = self.lu.split_at_mut((k + 1) * n);
            let pivot_row = &done[k * n..];
            for row in rest.chunks_exact_mut(n) {
                if row[k].to_f64() == 0.0 {
                    continue;
                }
                let factor = row[k] / pivot_row[k];
                row[k] = factor;
                for ((a, &u), scale) in row[k + 1..]
                    .iter_mut()
                    .zip(&pivot_row[k + 1..])
                    .zip(&mut scale[k + 1..])
                {
                    *a = *a - factor * u;
                    *scale = scale.max(a.to_f64().abs());
                }
            }
        }
        Ok(doubt)
    }

    /// Largest number that elimination made over the largest that it began with.
    pub(crate) fn growth(&self) -> f64 {
        norm_inf(&self.scale) / self.largest
    }

    /// Unit roundoff of the factors: growth of the entries takes digits away, down to those of a double, whose solutions are
    /// tested for it.
    pub(crate) fn roundoff_left(&self) -> f64 {
        let grown = T::ROUNDOFF * self.growth().max(1.0);
        grown.min(f64::ROUNDOFF)
    }

    /// x = C U⁻¹ L⁻¹ P R b, or R Pᵀ L⁻ᵀ U⁻ᵀ C b.
    pub(crate) fn solve_rows(&mut self, b: &[f64], x: &mut [f64], transposed: bool) {
        let n = b.len();
        let (y, Scales { rows, columns }) = (&mut self.work, &self.scales);
        if transposed {
            for k in 0..n {
                y[k] = (b[k] * columns[k]).into();
            }
            for k in 0..n {
                let row = &self.lu[k * n..(k + 1) * n];
                let u = y[k] / row[k];
                y[k] = u;
                let later = y[k + 1..].iter_mut().zip(&row[k + 1..]);
                later.for_each(|(y, &a)| *y = *y - a * u);
            }
            for k in (0..n).rev() {
                let l = y[k];
                let earlier = y[..k].iter_mut().zip(&self.lu[k * n..]);
                earlier.for_each(|(y, &a)| *y = *y - a * l);
            }
            for (&row, y) in self.pivot.iter().zip(&*y) {
                x[row] = y.to_f64() * rows[row];
            }
            return;
        }
        for k in 0..n {
            let row = &self.lu[k * n..k * n + k];
            let from = self.pivot[k];
            y[k] = row
                .iter()
                .zip(&*y)
                .fold((b[from] * rows[from]).into(), |sum, (&l, &y)| sum - l * y);
        }
        for k in (0..n).rev() {
            let row = &self.lu[k * n..(k + 1) * n];
            let sum = row[k + 1..]
                .iter()
                .zip(&y[k + 1..])
                .fold(y[k], |sum, (&u, &y)| sum - u * y);
            y[k] = sum / row[k];
        }
        for ((x, y), c) in x.iter_mut().zip(y).zip(columns) {
            *x = y.to_f64() * c;
        }
    }
}

fn column_max<T: Scalar>(a: &[T], n: usize, from: usize, c: usize) -> f64 {
    (from..n)
        .map(|r| a[r * n + c].to_f64().abs())
        .fold(0.0, f64::max)
}

impl<T: Scalar + Default + Send> Direct for Dense<T> {
    const NAME: &'static str = "dense";

    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let n = pattern.dim();
        self.allocate(n)?;
        Ok(AnalyzeReport {
            factor_entries: Some(n * n),
        })
    }

    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        a.check_finite()?;
        let n = a.dim();
        self.lu.fill(T::default());
        a.for_each_lower(|r, c, value| {
            self.lu[r * n + c] = value.into();
            self.lu[c * n + r] = value.into();
        });
        let singular = |column| SolveError::Singular {
            block: a.pattern().block_of_row(column),
        };
        if let Some(column) = self.factorize_rows(n).map_err(singular)? {
            self.check_doubt(a, |_| singular(column))?;
        }
        Ok(FactorReport::default())
    }

    /// Entries may grow by 2ⁿ⁻¹.
    fn is_stable(&self) -> bool {
        false
    }

    fn roundoff(&self) -> f64 {
        self.roundoff_left()
    }

    fn substitute(
        &mut self,
        _: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        self.solve_rows(b, x, false);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that depend on each other to rounding in doubles are regular in 32 digits.
    #[test]
    fn a_pivot_at_roundoff_is_told_with_its_column_and_no_other() {
        fn doubt<T: Scalar + Default>(entries: [f64; 9]) -> Option<usize> {
            let entry = |(at, a): (usize, f64)| (at / 3, at % 3, a);
            let entries = entries.into_iter().enumerate().map(entry).collect();
            let a = GeneralMatrix::from_entries(3, entries).expect("sound");
            let mut lu = Dense::<T>::general(&a).expect("small");
            lu.factorize_general(&a).expect("no pivot of zero")
        }
        let regular = [4.0, 1.0, 0.5, 1.0, 3.0, 1.0, 0.5, 1.0, 2.0];
        assert_eq!(doubt::<f64>(regular), None);
        assert_eq!(doubt::<DoubleDouble>(regular), None);
        // The last row is the sum of the others, but for its rounding in doubles.
        let dependent = [
            0.1,
            0.7,
            0.3,
            0.2,
            0.4,
            0.9,
            0.1 + 0.2,
            0.7 + 0.4,
            0.3 + 0.9,
        ];
        assert_eq!(doubt::<f64>(dependent), Some(2));
        assert_eq!(doubt::<DoubleDouble>(dependent), None);
    }
}
