//! Preconditioned conjugate gradient (Hestenes and Stiefel 1952; Saad, *Iterative Methods for Sparse Linear
//! Systems*, algorithm 9.1), without a preconditioner, with the diagonal blocks, or with the pattern's groups.
//!
//! On cables it is useless before it converges and then sudden: after about as many iterations as there are distinct
//! eigenvalues, whatever the mass ratio.

use super::{Phases, check_solution};
use crate::backend::check_iteration;
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::matrix::check_finite;
use crate::{AnalyzeReport, BlockPattern, CgOptions, FactorReport, LinearSolver, Preconditioner};
use crate::{SolveError, SolveReport, Status, SymBlockMatrix};
use std::sync::Arc;

/// Claimed convergence is checked against the true residual this often; the recurrence drifts from it.
const RESTARTS: usize = 8;

/// The `cg` backend.
pub(crate) struct ConjugateGradient {
    options: CgOptions,
    phases: Phases,
    preconditioner: Option<BlockLdlt<f64>>,
    /// Residual r, preconditioned residual z, direction p, product −A p, zeros; each of length `dim`.
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    ap: Vec<f64>,
    zeros: Vec<f64>,
}

impl ConjugateGradient {
    pub(crate) fn new(options: CgOptions) -> Result<Self, SolveError> {
        check_iteration(options.iterations, options.tolerance)?;
        let empty = Vec::new;
        Ok(Self {
            options,
            phases: Phases::default(),
            preconditioner: None,
            r: empty(),
            z: empty(),
            p: empty(),
            ap: empty(),
            zeros: empty(),
        })
    }

    /// z = preconditioner⁻¹ r.
    fn precondition(&mut self) {
        self.z.copy_from_slice(&self.r);
        if let Some(m) = &self.preconditioner {
            m.solve(&mut self.z);
        }
    }

    /// The iteration from the residual in `r` until the recurrence claims `target` (a 2-norm of the residual) or
    /// `limit` iterations are made.
    fn iterate(
        &mut self,
        a: &SymBlockMatrix,
        x: &mut [f64],
        target: f64,
        limit: usize,
    ) -> Result<usize, SolveError> {
        self.precondition();
        self.p.copy_from_slice(&self.z);
        let mut rz = dot(&self.r, &self.z);
        let mut norm = dot(&self.r, &self.r).sqrt();
        let mut iterations = 0;
        while norm > target && iterations < limit && rz > 0.0 {
            a.subtract_product(&self.zeros, &self.p, &mut self.ap);
            let curvature = -dot(&self.p, &self.ap);
            if curvature <= 0.0 {
                return Err(SolveError::NotPositiveDefinite {
                    block: self.largest_block(a.pattern()),
                });
            }
            let step = rz / curvature;
            add_scaled(x, step, &self.p);
            add_scaled(&mut self.r, step, &self.ap);
            iterations += 1;
            self.precondition();
            let rz_next = dot(&self.r, &self.z);
            let turn = rz_next / rz;
            rz = rz_next;
            for (p, z) in self.p.iter_mut().zip(&self.z) {
                *p = z + turn * *p;
            }
            norm = dot(&self.r, &self.r).sqrt();
            if !norm.is_finite() {
                break;
            }
        }
        Ok(iterations)
    }

    /// Block with the largest component of the direction: where a negative curvature was met.
    fn largest_block(&self, pattern: &BlockPattern) -> usize {
        let largest =
            (0..self.p.len()).max_by(|&i, &j| self.p[i].abs().total_cmp(&self.p[j].abs()));
        pattern.block_of_row(largest.unwrap_or(0))
    }
}

/// y += s x.
fn add_scaled(y: &mut [f64], s: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += s * x;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl LinearSolver for ConjugateGradient {
    fn name(&self) -> &'static str {
        "cg"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let groups = pattern.groups();
        let kept = match self.options.preconditioner {
            Preconditioner::None => None,
            Preconditioner::BlockJacobi => Some(pattern.restricted(|i, j| i == j)?),
            Preconditioner::Group => Some(pattern.restricted(|i, j| groups[i] == groups[j])?),
        };
        self.preconditioner = kept
            .map(|kept| BlockLdlt::new(pattern, &kept))
            .transpose()?;
        for v in [
            &mut self.r,
            &mut self.z,
            &mut self.p,
            &mut self.ap,
            &mut self.zeros,
        ] {
            *v = vec![0.0; pattern.dim()];
        }
        self.phases.analyzed(pattern);
        Ok(AnalyzeReport {
            factor_entries: self.preconditioner.as_ref().map(BlockLdlt::factor_values),
        })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        if let Some(m) = &mut self.preconditioner {
            m.factorize(a, Pivots::Positive)?;
        }
        self.phases.factorized();
        Ok(FactorReport::default())
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.phases.begin_solve(a, b, x)?;
        let scale = dot(b, b).sqrt();
        if !scale.is_finite() {
            // The squares overflow, and with them every test of convergence.
            let largest = b.iter().position(|&x| x.abs() == crate::norm_inf(b));
            return Err(SolveError::NonFinite {
                what: "norm of the right-hand side",
                block: a.pattern().block_of_row(largest.unwrap_or(0)),
            });
        }
        if scale == 0.0 {
            x.fill(0.0);
            return Ok(SolveReport::ZERO);
        }
        check_finite(a.pattern(), "guess", x)?;
        let target = self.options.tolerance * scale;
        let mut report = SolveReport {
            status: Status::IterationLimit,
            iterations: 0,
            residual: f64::INFINITY,
        };
        let mut previous = f64::INFINITY;
        for _ in 0..RESTARTS {
            a.subtract_product(b, x, &mut self.r);
            let norm = dot(&self.r, &self.r).sqrt();
            report.residual = if norm == 0.0 { 0.0 } else { norm / scale };
            if norm <= target {
                report.status = Status::Converged;
                break;
            }
            if report.iterations == self.options.iterations {
                report.status = Status::IterationLimit;
                break;
            }
            // A restart that did not halve the true residual will not: it is at roundoff.
            if norm > 0.5 * previous {
                report.status = Status::Stalled;
                break;
            }
            previous = norm;
            let made = self.iterate(a, x, target, self.options.iterations - report.iterations)?;
            report.iterations += made;
            report.status = Status::Stalled;
        }
        check_solution(a, x)?;
        Ok(report)
    }
}
