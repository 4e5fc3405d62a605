//! Block Gauss–Seidel, over single blocks or over the pattern's groups with an exact solve inside each,
//! [SL Algorithm 1, lines 6 to 15].
//!
//! For the parts α in turn: x_α ← x_α + A_αα⁻¹ (b − A x)_α. It converges for every positive definite A, at a rate
//! that the mass ratio sets: 1 − ρ ≈ 1/(N R) for a chain of N masses under a load of R masses.

use super::{Phases, check_solution};
use crate::backend::check_iteration;
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::kernels::{
    by_size, by_sizes, subtract_product, subtract_symmetric, subtract_transposed,
};
use crate::matrix::check_finite;
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, GaussSeidelOptions, LinearSolver, Partition,
};
use crate::{SolveError, SolveReport, Start, Status, SymBlockMatrix};
use std::sync::Arc;

/// The `gauss-seidel` backend.
pub(crate) struct GaussSeidel {
    options: GaussSeidelOptions,
    phases: Phases,
    plan: Option<Plan>,
}

/// What the analysis of a pattern leaves.
struct Plan {
    /// Factor of the couplings inside the parts.
    inner: BlockLdlt<f64>,
    /// Block rows of all parts, part after part, ascending inside each.
    members: Vec<usize>,
    /// First member of each part, and their number at the end.
    part_start: Vec<usize>,
    /// All blocks of each block row: first entry of row i, length `blocks + 1`.
    row_start: Vec<usize>,
    /// Stored block, block column, and whether it is used transposed.
    entries: Vec<(usize, usize, bool)>,
    /// Residual, length `dim`; zero outside the part at work.
    residual: Vec<f64>,
}

impl GaussSeidel {
    pub(crate) fn new(options: GaussSeidelOptions) -> Result<Self, SolveError> {
        check_iteration(options.iterations, options.tolerance)?;
        Ok(Self {
            options,
            phases: Phases::default(),
            plan: None,
        })
    }
}

impl Plan {
    fn new(pattern: &BlockPattern, partition: Partition) -> Result<Self, SolveError> {
        let part_of = |i: usize| match partition {
            Partition::Joints => i,
            Partition::Groups => pattern.groups()[i] as usize,
        };
        let blocks = pattern.blocks();
        let inside = pattern.restricted(|i, j| part_of(i) == part_of(j))?;
        let mut members: Vec<usize> = (0..blocks).collect();
        members.sort_by_key(|&i| (part_of(i), i));
        let mut part_start: Vec<usize> = (0..blocks)
            .filter(|&m| m == 0 || part_of(members[m]) != part_of(members[m - 1]))
            .collect();
        part_start.push(blocks);

        let mut rows: Vec<Vec<(usize, usize, bool)>> = vec![Vec::new(); blocks];
        for j in 0..blocks {
            for k in pattern.column(j) {
                let i = pattern.row(k);
                rows[i].push((k, j, false));
                if i != j {
                    rows[j].push((k, i, true));
                }
            }
        }
        let mut row_start = vec![0];
        row_start.extend(rows.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        }));
        Ok(Self {
            inner: BlockLdlt::new(pattern, &inside)?,
            members,
            part_start,
            row_start,
            entries: rows.concat(),
            residual: vec![0.0; pattern.dim()],
        })
    }

    /// One pass over all parts; the sum of squares of the residuals met.
    fn sweep(&mut self, a: &SymBlockMatrix, b: &[f64], x: &mut [f64]) -> f64 {
        let p = a.pattern();
        let mut sum = 0.0;
        for part in self.part_start.windows(2) {
            let members = &self.members[part[0]..part[1]];
            for &i in members {
                let entries = &self.entries[self.row_start[i]..self.row_start[i + 1]];
                let r = &mut self.residual[p.rows(i)];
                r.copy_from_slice(&b[p.rows(i)]);
                for &(k, j, transposed) in entries {
                    let (block, x, m, n) = (a.block(k), &x[p.rows(j)], p.size(i), p.size(j));
                    match (i == j, transposed) {
                        (true, _) => by_size!(n, |n| subtract_symmetric(n, block, x, r)),
                        (false, true) => {
                            by_sizes!(n, m, |m, n| subtract_transposed(m, n, block, x, r))
                        }
                        (false, false) => {
                            by_sizes!(m, n, |m, n| subtract_product(m, n, block, x, r))
                        }
                    }
                }
                sum += r.iter().map(|r| r * r).sum::<f64>();
            }
            self.inner
                .solve_blocks(members.iter().copied(), &mut self.residual);
            for &i in members {
                for (x, d) in x[p.rows(i)].iter_mut().zip(&self.residual[p.rows(i)]) {
                    *x += d;
                }
            }
        }
        sum
    }
}

impl LinearSolver for GaussSeidel {
    fn name(&self) -> &'static str {
        "gauss-seidel"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let plan = Plan::new(pattern, self.options.partition)?;
        let factor_entries = Some(plan.inner.factor_values());
        self.plan = Some(plan);
        self.phases.analyzed(pattern);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        if let Some(plan) = &mut self.plan {
            plan.inner.factorize(a, Pivots::Positive)?;
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
        let Some(plan) = &mut self.plan else {
            return Err(SolveError::OutOfOrder {
                called: "solve",
                needs: "analyze",
            });
        };
        if self.options.start == Start::Trial {
            x.copy_from_slice(b);
            plan.inner.solve(x);
        }
        check_finite(a.pattern(), "guess", x)?;
        let norm = b.iter().map(|b| b * b).sum::<f64>().sqrt();
        let mut report = SolveReport {
            status: Status::IterationLimit,
            iterations: 0,
            residual: f64::INFINITY,
        };
        while report.iterations < self.options.iterations {
            let met = plan.sweep(a, b, x).sqrt();
            report.iterations += 1;
            report.residual = if met == 0.0 { 0.0 } else { met / norm };
            if report.residual <= self.options.tolerance {
                report.status = Status::Converged;
                break;
            }
            if !report.residual.is_finite() {
                break;
            }
        }
        check_solution(a, x)?;
        Ok(report)
    }
}
