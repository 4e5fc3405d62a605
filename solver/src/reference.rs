//! Reference solutions in extended precision, for sizes where a dense oracle is out of reach.

use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::error::expect_len;
use crate::matrix::check_finite;
use crate::{DoubleDouble, SolveError, SymBlockMatrix};

/// The solution of A x = b to the last digit of a double: block LDLᵀ in double-double arithmetic (A symmetric, with
/// an LDLᵀ in its own order, such as positive definite or quasi-definite matrices), refined in double-double until
/// the correction is below 10⁻²⁴ relative, or gets no smaller: the rounding of the residual leaves corrections of 10⁻³²
/// times the condition number, and below 10⁻¹⁸ these do not reach the last digit of a double. Linear cost for a chain, 50
/// to 100 times a double solve. Allocates.
///
/// # Errors
/// Bad dimensions, values that are not finite, singular pivots, and [`SolveError::Library`] where the refinement does
/// not contract to 10⁻¹⁸, so that the result would not be a reference.
pub fn reference_solution(a: &SymBlockMatrix, b: &[f64]) -> Result<Vec<f64>, SolveError> {
    const TARGET: f64 = 1e-24;
    const ENOUGH: f64 = 1e-18;
    expect_len("right-hand side", a.dim(), b.len())?;
    a.check_finite()?;
    check_finite(a.pattern(), "right-hand side", b)?;
    let mut factor = BlockLdlt::<DoubleDouble>::new(a.pattern(), a.pattern())?;
    factor.factorize(a, Pivots::Nonzero)?;
    let mut x = vec![DoubleDouble::default(); a.dim()];
    let (mut change, mut before) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..12 {
        let mut r: Vec<DoubleDouble> = b.iter().map(|&b| b.into()).collect();
        a.for_each_lower(|i, j, a_ij| {
            r[i] = r[i] - x[j] * a_ij.into();
            if i != j {
                r[j] = r[j] - x[i] * a_ij.into();
            }
        });
        factor.solve(&mut r);
        let largest = |v: &[DoubleDouble]| v.iter().fold(0.0_f64, |m, x| m.max(x.to_f64().abs()));
        for (x, d) in x.iter_mut().zip(&r) {
            *x = *x + *d;
        }
        let scale = largest(&x);
        change = if scale == 0.0 {
            0.0
        } else {
            largest(&r) / scale
        };
        let settled = change <= ENOUGH && change > 0.5 * before;
        before = change;
        if change <= TARGET || settled {
            return Ok(x.into_iter().map(DoubleDouble::to_f64).collect());
        }
    }
    Err(SolveError::Library {
        library: "reference",
        message: format!(
            "refinement in extended precision stalled at a relative correction of {change:.1e}"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BlockPattern;
    use std::sync::Arc;

    /// Hilbert's matrices, times the common multiple of their denominators and so of integers: the solution of A·1 is 1,
    /// exactly, up to a condition of 10¹³, which no correction of 10⁻²⁴ is left at.
    #[test]
    fn the_last_digit_is_right_or_there_is_none() {
        for n in 2..=12 {
            let divides = |m: u64| (1..2 * n as u64).all(|d| m.is_multiple_of(d));
            let common = (1..).map(|k| k * 2520).find(|&m| divides(m)).unwrap();
            let mut a = SymBlockMatrix::zeros(Arc::new(BlockPattern::new(&[n], &[]).unwrap()));
            let entry = |i: usize, j: usize| (common / (i + j + 1) as u64) as f64;
            let mut b = vec![0.0; n];
            for (k, v) in a.values_mut().iter_mut().enumerate() {
                *v = entry(k / n, k % n);
                b[k % n] += *v;
            }
            match reference_solution(&a, &b) {
                Ok(x) => assert_eq!(x, vec![1.0; n]),
                Err(e) => assert!(n > 10, "{n}: {e}"),
            }
        }
    }

    #[test]
    fn dependent_rows_are_an_error() {
        let p = Arc::new(BlockPattern::new(&[2], &[]).unwrap());
        let mut a = SymBlockMatrix::zeros(p);
        a.values_mut().copy_from_slice(&[1.0, 2.0, 2.0, 4.0]);
        let found = reference_solution(&a, &[1.0, 1.0]);
        assert_eq!(found, Err(SolveError::Singular { block: 0 }));
    }
}
