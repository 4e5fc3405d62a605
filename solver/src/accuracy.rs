//! How wrong a solution is: backward errors with a residual in extended precision, and forward errors.
//!
//! A small residual alone says little; these are scaled. η is the smallest relative change of A and b (in norm) for
//! which x is exact (Rigal and Gaches 1967), ω the same entry by entry (Oettli and Prager 1964; LAPACK's `berr`). The
//! forward error is bounded by about condition number × backward error: at large mass ratios a perfect backward error
//! goes with a poor x, so report both.

use crate::error::expect_len;
use crate::{DoubleDouble, GeneralMatrix, SolveError, SymBlockMatrix};

/// Backward errors of an approximate solution, without unit.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BackwardError {
    /// η = ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞).
    pub normwise: f64,
    /// ω = maxᵢ |b − A x|ᵢ / (|A| |x| + |b|)ᵢ with 0/0 = 0.
    pub componentwise: f64,
}

/// Largest magnitude; NaN where an entry is NaN.
#[must_use]
pub fn norm_inf(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, x| {
        if x.abs() > m || x.is_nan() {
            x.abs()
        } else {
            m
        }
    })
}

/// b − A x with the sums in extended precision, rounded at the end; `b`, `x` and it of length `a.dim()`. Allocates.
///
/// # Errors
/// [`SolveError::Dimension`].
pub fn residual(a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> Result<Vec<f64>, SolveError> {
    residual_of(a.dim(), |f| both_triangles(a, f), b, x)
}

/// Backward errors of `x` as a solution of A x = b, both of length `a.dim()`. Allocates.
///
/// # Errors
/// [`SolveError::Dimension`].
pub fn backward_error(
    a: &SymBlockMatrix,
    b: &[f64],
    x: &[f64],
) -> Result<BackwardError, SolveError> {
    let entries = |f: &mut Entry<'_>| both_triangles(a, f);
    errors_of(a.norm_inf(), a.dim(), entries, b, x)
}

/// Backward errors where A need not be symmetric. Allocates.
///
/// # Errors
/// [`SolveError::Dimension`].
pub fn backward_error_general(
    a: &GeneralMatrix,
    b: &[f64],
    x: &[f64],
) -> Result<BackwardError, SolveError> {
    let entries = |f: &mut Entry<'_>| a.for_each(f);
    errors_of(a.norm_inf(), a.dim(), entries, b, x)
}

/// Visits a row, a column and their entry.
type Entry<'f> = dyn FnMut(usize, usize, f64) + 'f;

fn both_triangles(a: &SymBlockMatrix, f: &mut Entry<'_>) {
    a.for_each_lower(|r, c, value| {
        f(r, c, value);
        if r != c {
            f(c, r, value);
        }
    });
}

fn residual_of(
    dim: usize,
    entries: impl Fn(&mut Entry<'_>),
    b: &[f64],
    x: &[f64],
) -> Result<Vec<f64>, SolveError> {
    expect_len("right-hand side", dim, b.len())?;
    expect_len("solution", dim, x.len())?;
    let mut r: Vec<DoubleDouble> = b.iter().map(|&b| b.into()).collect();
    entries(&mut |i, j, a_ij| r[i] = r[i] - DoubleDouble::product(a_ij, x[j]));
    Ok(r.into_iter().map(DoubleDouble::to_f64).collect())
}

fn errors_of(
    norm: f64,
    dim: usize,
    entries: impl Fn(&mut Entry<'_>),
    b: &[f64],
    x: &[f64],
) -> Result<BackwardError, SolveError> {
    let r = residual_of(dim, &entries, b, x)?;
    let mut magnitude: Vec<f64> = b.iter().map(|b| b.abs()).collect();
    entries(&mut |i, j, a_ij| magnitude[i] += (a_ij * x[j]).abs());
    let ratios = r.iter().zip(&magnitude).map(|(r, m)| ratio(r.abs(), *m));
    let componentwise = norm_inf(&ratios.collect::<Vec<_>>());
    let normwise = ratio(norm_inf(&r), norm * norm_inf(x) + norm_inf(b));
    Ok(BackwardError {
        normwise,
        componentwise,
    })
}

fn ratio(numerator: f64, denominator: f64) -> f64 {
    if numerator == 0.0 {
        0.0
    } else {
        numerator / denominator
    }
}

/// ‖x − x*‖∞ / ‖x*‖∞ of two vectors of equal length (the absolute error where x* = 0).
#[must_use]
pub fn forward_error(x: &[f64], exact: &[f64]) -> f64 {
    let difference: Vec<f64> = x.iter().zip(exact).map(|(x, e)| x - e).collect();
    let scale = norm_inf(exact);
    if scale == 0.0 {
        norm_inf(&difference)
    } else {
        norm_inf(&difference) / scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BlockPattern;
    use std::sync::Arc;

    #[test]
    fn hand_computed_errors() {
        let mut a = SymBlockMatrix::zeros(Arc::new(BlockPattern::new(&[2], &[]).unwrap()));
        a.values_mut().copy_from_slice(&[2.0, 1.0, 1.0, 3.0]);
        // A (1, 1) = (3, 4); the solution (1, 1.5) leaves the residual (-0.5, -1.5).
        let e = backward_error(&a, &[3.0, 4.0], &[1.0, 1.5]).unwrap();
        assert!((e.normwise - 1.5 / (4.0 * 1.5 + 4.0)).abs() < 1e-15);
        assert!((e.componentwise - 1.5 / 9.5).abs() < 1e-15);
        let found = backward_error(&a, &[3.0, 4.0], &[1.0, 1.0])
            .unwrap()
            .componentwise;
        assert_eq!(found, 0.0);
        assert_eq!(forward_error(&[1.0, 1.5], &[1.0, 1.0]), 0.5);
        assert!(backward_error(&a, &[3.0], &[1.0, 1.0]).is_err());
    }

    #[test]
    fn a_nan_is_never_a_small_error() {
        assert!(norm_inf(&[1.0, f64::NAN, 2.0]).is_nan());
        assert!(forward_error(&[f64::NAN, 1.0], &[1.0, 1.0]).is_nan());
    }
}
