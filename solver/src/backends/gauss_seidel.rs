//! Block Gauss–Seidel, over single blocks or over the pattern's groups with an exact solve inside each,
//! [SL Algorithm 1, lines 6 to 15].
//!
//! For the parts α in turn: x_α ← x_α + A_αα⁻¹ (b − A x)_α. It converges for every positive definite A, at a rate
//! that the mass ratio sets: 1 − ρ ≈ 1/(N R) for a chain of N masses under a load of R masses.

use super::{Phases, check_solution};
use crate::backend::check_iteration;
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::kernels::{OneByOne, by_sizes, subtract_product};
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
    /// All blocks of each block row, the lower and the upper triangle: first entry of row i, length `blocks + 1`.
    row_start: Vec<usize>,
    entries: Vec<Entry>,
    /// Their values, row after row: a sweep reads them once, in order, and needs no transposed product.
    values: Vec<f64>,
    /// Residual, length `dim`; zero outside the part at work.
    residual: Vec<f64>,
}

/// A block of a block row.
#[derive(Clone, Copy)]
struct Entry {
    /// Block column.
    column: usize,
    /// Stored block that it is, or is the transpose of.
    stored: usize,
    /// First value in [`Plan::values`]; column-major.
    at: usize,
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

        let mut rows: Vec<Vec<(usize, usize)>> = vec![Vec::new(); blocks];
        for j in 0..blocks {
            for k in pattern.column(j) {
                let i = pattern.row(k);
                rows[i].push((j, k));
                if i != j {
                    rows[j].push((i, k));
                }
            }
        }
        let (mut row_start, mut entries, mut at) = (vec![0], Vec::new(), 0);
        for (i, row) in rows.iter().enumerate() {
            for &(column, stored) in row {
                entries.push(Entry { column, stored, at });
                at += pattern.size(i) * pattern.size(column);
            }
            row_start.push(entries.len());
        }
        Ok(Self {
            inner: BlockLdlt::new(pattern, &inside)?,
            members,
            part_start,
            row_start,
            entries,
            values: vec![0.0; at],
            residual: vec![0.0; pattern.dim()],
        })
    }

    /// Copies the matrix by rows.
    fn gather(&mut self, a: &SymBlockMatrix) {
        let p = a.pattern();
        for i in 0..p.blocks() {
            let m = p.size(i);
            for entry in &self.entries[self.row_start[i]..self.row_start[i + 1]] {
                let (n, block) = (p.size(entry.column), a.block(entry.stored));
                let to = &mut self.values[entry.at..entry.at + m * n];
                if entry.column < i {
                    to.copy_from_slice(block);
                    continue;
                }
                for (c, column) in to.chunks_exact_mut(m.max(1)).enumerate() {
                    for (r, to) in column.iter_mut().enumerate() {
                        // The transpose; of the diagonal block the lower triangle.
                        let (row, column) = if entry.column == i {
                            (r.max(c), r.min(c))
                        } else {
                            (c, r)
                        };
                        *to = block[row + n * column];
                    }
                }
            }
        }
    }

    /// One pass over all parts; the sum of squares of the residuals met.
    fn sweep(&mut self, p: &BlockPattern, b: &[f64], x: &mut [f64]) -> f64 {
        let mut sum = 0.0;
        for part in self.part_start.windows(2) {
            let members = &self.members[part[0]..part[1]];
            for &i in members {
                let entries = &self.entries[self.row_start[i]..self.row_start[i + 1]];
                let r = &mut self.residual[p.rows(i)];
                r.copy_from_slice(&b[p.rows(i)]);
                for entry in entries {
                    let (m, n) = (p.size(i), p.size(entry.column));
                    let x = &x[p.rows(entry.column)];
                    let block = &self.values[entry.at..entry.at + m * n];
                    by_sizes!(m, n, |m, n| subtract_product::<OneByOne, _, _, _>(
                        m, n, block, x, r
                    ));
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
            plan.gather(a);
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
        let norm = b.iter().map(|b| b * b).sum::<f64>().sqrt();
        if norm == 0.0 {
            x.fill(0.0);
            return Ok(SolveReport::ZERO);
        }
        if self.options.start == Start::Trial {
            x.copy_from_slice(b);
            plan.inner.solve(x);
            check_solution(a, x)?;
        }
        check_finite(a.pattern(), "guess", x)?;
        let mut report = SolveReport {
            status: Status::IterationLimit,
            iterations: 0,
            residual: f64::INFINITY,
        };
        while report.iterations < self.options.iterations {
            let met = plan.sweep(a.pattern(), b, x).sqrt();
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
