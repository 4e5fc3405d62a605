//! Common parts of the iterative backends: the start of a solve, the restarts and the stopping test
//! of Krylov methods.
//!
//! The residual of a recurrence drifts from b − A x. Nothing is claimed of it: an iteration whose recurrence meets the
//! tolerance starts again from the true residual, until that one meets it, no longer halves, or the iterations run out.

use crate::matrix::check_finite;
use crate::slices::dot;
use crate::{BlockPattern, SolveError, SolveReport, Status};

/// Most restarts of a Krylov method.
const RESTARTS: usize = 8;

/// ‖b‖₂ below which squares of residuals near roundoff underflow, so that no iteration can tell whether it converged.
pub(super) const LEAST_NORM: f64 = 1e-130;

/// ‖b‖₂; `None` where b is zero, and x then too.
///
/// # Errors
/// [`SolveError::NonFinite`] where the squares of b overflow, and with them every test of convergence.
pub(super) fn begin(
    pattern: &BlockPattern,
    b: &[f64],
    x: &mut [f64],
) -> Result<Option<f64>, SolveError> {
    let scale = dot(b, b).sqrt();
    if !scale.is_finite() {
        return Err(SolveError::NonFinite {
            what: "norm of the right-hand side",
            block: largest_block(pattern, b),
        });
    }
    if b.iter().all(|b| *b == 0.0) {
        x.fill(0.0);
        return Ok(None);
    }
    Ok(Some(scale))
}

/// A Krylov method at work on a system.
pub(super) trait Krylov {
    /// Computes r = b − A x from the product A x; its 2-norm.
    ///
    /// # Errors
    /// [`SolveError::NonFinite`].
    fn residual(&mut self) -> Result<f64, SolveError>;

    /// Iterates from that residual until the recurrence's own has at most the 2-norm `target`, no direction is left, or
    /// `limit` iterations are made; returns their number.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] where the method needs a definite matrix.
    fn iterate(&mut self, target: f64, limit: usize) -> Result<usize, SolveError>;
}

/// Iterates until ‖b − A x‖₂ ≤ `tolerance` · `scale`, with `scale` = ‖b‖₂, or `limit` iterations are made.
///
/// # Errors
/// The errors of the method.
pub(super) fn run(
    method: &mut impl Krylov,
    scale: f64,
    tolerance: f64,
    limit: usize,
) -> Result<SolveReport, SolveError> {
    let target = tolerance * scale;
    let mut report = SolveReport {
        status: Status::Stalled,
        iterations: 0,
        residual: f64::INFINITY,
    };
    let mut previous = f64::INFINITY;
    for _ in 0..RESTARTS {
        let norm = method.residual()?;
        report.residual = if norm == 0.0 { 0.0 } else { norm / scale };
        if scale < LEAST_NORM {
            break;
        }
        if norm <= target {
            report.status = Status::Converged;
            break;
        }
        if report.iterations == limit {
            report.status = Status::IterationLimit;
            break;
        }
        // A restart that did not halve the true residual will not: it is at roundoff.
        if norm > 0.5 * previous {
            break;
        }
        previous = norm;
        // Below roundoff of what it begins with the recurrence says nothing of the residual, and runs into underflow.
        let target = target.max(f64::EPSILON * norm);
        report.iterations += method.iterate(target, limit - report.iterations)?;
    }
    Ok(report)
}

/// The norm of the residual `r` at `x`, both in the order of the pattern, is not finite.
pub(super) fn check_norm(
    pattern: &BlockPattern,
    norm: f64,
    x: &[f64],
    r: &[f64],
) -> Result<(), SolveError> {
    if norm.is_finite() {
        return Ok(());
    }
    check_finite(pattern, "solution", x)?;
    Err(SolveError::NonFinite {
        what: "norm of the residual",
        block: largest_block(pattern, r),
    })
}

/// Block row of the largest component of `v`.
pub(super) fn largest_block(pattern: &BlockPattern, v: &[f64]) -> usize {
    let largest = (0..v.len()).max_by(|&i, &j| v[i].abs().total_cmp(&v[j].abs()));
    pattern.block_of_row(largest.unwrap_or(0))
}
