//! Iterative refinement around any backend.
//!
//! The residual is a function: with b − A x it brings the backward error down to roundoff; with a residual computed
//! from the pieces that A was formed from it also repairs what forming A lost (for A = J M⁻¹ Jᵀ + Σ about roundoff ×
//! mass ratio), which no solve with A can.

use crate::{LinearSolver, SolveError, SolveReport, SymBlockMatrix};

/// Buffers of a refinement, made once.
#[derive(Debug, Clone, Default)]
pub struct RefineScratch {
    residual: Vec<f64>,
    correction: Vec<f64>,
}

impl RefineScratch {
    /// Buffers for a system of dimension `dim`. Allocates.
    #[must_use]
    pub fn new(dim: usize) -> Self {
        Self {
            residual: vec![0.0; dim],
            correction: vec![0.0; dim],
        }
    }
}

/// Improves `x` by `sweeps` corrections A d = r(x), x ← x + d, where `residual(x, r)` writes r. Returns the last
/// correction's report with the iterations of all. Allocates nothing.
///
/// # Errors
/// Those of [`LinearSolver::solve`]; `x` then holds the last good iterate.
pub fn refine(
    solver: &mut dyn LinearSolver,
    a: &SymBlockMatrix,
    x: &mut [f64],
    scratch: &mut RefineScratch,
    sweeps: usize,
    mut residual: impl FnMut(&[f64], &mut [f64]),
) -> Result<Option<SolveReport>, SolveError> {
    crate::error::expect_len("refinement scratch", x.len(), scratch.residual.len())?;
    let mut last: Option<SolveReport> = None;
    for _ in 0..sweeps {
        residual(x, &mut scratch.residual);
        scratch.correction.fill(0.0);
        let mut report = solver.solve(a, &scratch.residual, &mut scratch.correction)?;
        report.iterations += last.map_or(0, |r| r.iterations);
        last = Some(report);
        for (x, d) in x.iter_mut().zip(&scratch.correction) {
            *x += d;
        }
    }
    Ok(last)
}
