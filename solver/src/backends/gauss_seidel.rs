//! Block Gauss–Seidel, over single blocks or over the pattern's groups with an exact solve inside each,
//! [SL Algorithm 1, lines 6 to 15].
//!
//! For the parts α in turn: x_α ← x_α + A_αα⁻¹ (b − A x)_α. It converges for every positive definite A, at a rate
//! that the mass ratio sets: 1 − ρ ≈ 1/(N R) for a chain of N masses under a load of R masses.
//!
//! A sweep meets each residual before it takes it away, and changes those that it has met already: what it has met says
//! when to look, and the residual of x itself whether that has converged.
//!
//! Where no tolerance ends it, it ends where the least residual of some sweeps is no less than that of the sweeps before,
//! and within what rounding leaves.
//!
//! For a singular A it finds a solution if one exists; otherwise it reports that A is singular
//! ([`null_vector`]).

mod null_vector;
mod sweep;

use super::check_solution;
use super::iteration::{self, LEAST_NORM};
use crate::Phases;
use crate::groups::Groups;
use crate::matrix::check_finite;
use crate::options::check_iteration;
use crate::slices::Slices;
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, GaussSeidelOptions, LinearSolver, Partition,
};
use crate::{SolveError, SolveReport, Start, Status, SymBlockMatrix};
use std::sync::Arc;
use sweep::{Inverses, Rows};

/// The `gauss-seidel` backend.
pub(crate) struct GaussSeidel {
    options: GaussSeidelOptions,
    phases: Phases,
    plan: Option<Plan>,
}

/// Data structures for the analysed pattern.
struct Plan {
    rows: Rows,
    /// Factors of the parts.
    parts: Groups,
    /// Where the parts are single blocks, and small: the way to their inverses, these, and whether they are those of the
    /// last matrix.
    diagonal: Option<Slices>,
    inverses: Vec<f64>,
    inverted: bool,
    /// Residual and correction, length `dim`.
    residual: Vec<f64>,
    correction: Vec<f64>,
    /// x before the last sweep that is allowed, then by what that changed it, length `dim`.
    change: Vec<f64>,
    zeros: Vec<f64>,
}

/// Part of itself by which the residual of a sweep has fallen, below which the matrix may be singular: rounding of x, which
/// a null vector has been added to at every sweep, leaves less.
const STILL: f64 = 1e-9;

/// Sweeps in a row that leave no less than the least residual yet, after which rounding keeps it there.
const MOST_RISES: usize = 4;

/// Sweeps after which it is first asked whether the least residual still falls, then after twice as many each time.
const WINDOW: usize = 64;

/// Rounding error of ‖b − A x‖₂, at most about u n (max |aᵢⱼ| ‖x‖₁ + ‖b‖∞).
fn roundoff(a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> f64 {
    let largest = crate::norm_inf(a.values());
    let sum: f64 = x.iter().map(|x| x.abs()).sum();
    f64::EPSILON * x.len() as f64 * (largest * sum + crate::norm_inf(b))
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
        let (parts, diagonal) = match partition {
            Partition::Joints => (
                Groups::new(pattern, |i| i)?,
                Slices::new(pattern, |i, j| i == j),
            ),
            Partition::Groups => (
                Groups::new(pattern, |i| pattern.groups()[i] as usize)?,
                None,
            ),
        };
        let inverses = diagonal.as_ref().map_or(0, Slices::inverses_len);
        Ok(Self {
            rows: Rows::new(pattern),
            parts,
            diagonal,
            inverses: vec![0.0; inverses],
            inverted: false,
            residual: vec![0.0; pattern.dim()],
            correction: vec![0.0; pattern.dim()],
            change: vec![0.0; pattern.dim()],
            zeros: vec![0.0; pattern.dim()],
        })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        self.rows.gather(a);
        self.inverted = false;
        if let Some(diagonal) = &mut self.diagonal {
            diagonal.fill(a);
            self.inverted = diagonal.invert_diagonal();
            if self.inverted {
                diagonal.inverses(&mut self.inverses);
                return Ok(());
            }
        }
        self.parts.factorize(a)
    }

    /// The inverses of single blocks, where there are such.
    fn inverses(&self) -> Option<Inverses<'_>> {
        let diagonal = self.diagonal.as_ref().filter(|_| self.inverted)?;
        Some(Inverses {
            size: diagonal.size(),
            values: &self.inverses,
        })
    }

    /// x of the parts by themselves, couplings between them left out.
    fn start(&mut self, b: &[f64], x: &mut [f64]) {
        match self.inverses() {
            Some(inverses) => self.rows.solve_blocks(&inverses, b, x),
            None => self.parts.solve(b, x),
        }
    }

    /// Sum of squares of b − A x.
    fn residual(&mut self, b: &[f64], x: &[f64]) -> f64 {
        let parts = 0..self.parts.len();
        parts
            .map(|part| {
                let members = self.parts.members(part);
                self.rows.residual(members, b, x, &mut self.residual)
            })
            .sum()
    }

    /// One pass over all parts; the sum of squares of the residuals met.
    fn sweep(&mut self, b: &[f64], x: &mut [f64]) -> f64 {
        if let Some(inverses) = self.inverses() {
            return self.rows.sweep(&inverses, b, x);
        }
        let mut sum = 0.0;
        for part in 0..self.parts.len() {
            let members = self.parts.members(part);
            sum += self.rows.residual(members, b, x, &mut self.residual);
            self.parts
                .solve_group(part, &self.residual, &mut self.correction);
            for rows in self.parts.members(part).iter().map(|&i| self.rows.of(i)) {
                for (x, d) in x[rows.clone()].iter_mut().zip(&self.correction[rows]) {
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
        let factor_entries = Some(plan.parts.factor_values());
        self.plan = Some(plan);
        self.phases.analyzed(pattern);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        if let Some(plan) = &mut self.plan {
            plan.factorize(a)?;
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
        let Some(norm) = iteration::begin(a.pattern(), b, x)? else {
            return Ok(SolveReport::ZERO);
        };
        if self.options.start == Start::Trial {
            plan.start(b, x);
            check_solution(a, x)?;
        }
        check_finite(a.pattern(), "guess", x)?;
        if norm < LEAST_NORM {
            plan.sweep(b, x);
            check_solution(a, x)?;
            return Ok(SolveReport {
                status: Status::Stalled,
                iterations: 1,
                residual: f64::INFINITY,
            });
        }
        let mut report = SolveReport {
            status: Status::IterationLimit,
            iterations: 0,
            residual: f64::INFINITY,
        };
        let mut fallen = 1.0;
        let (mut least, mut risen) = (f64::INFINITY, 0);
        let mut windows = [f64::INFINITY; 2];
        while report.iterations < self.options.iterations {
            if report.iterations + 1 == self.options.iterations {
                plan.change.copy_from_slice(x);
            }
            let met = plan.sweep(b, x).sqrt();
            report.iterations += 1;
            let before = report.residual;
            report.residual = if met == 0.0 { 0.0 } else { met / norm };
            fallen = 1.0 - report.residual / before;
            if report.residual <= self.options.tolerance {
                let left = plan.residual(b, x).sqrt() / norm;
                // Each sweep reduces the energy norm of the error. This residual norm may rise for
                // some sweeps.
                risen = if left < least { 0 } else { risen + 1 };
                least = least.min(left);
                report.status = if left <= self.options.tolerance {
                    Status::Converged
                } else if risen == MOST_RISES {
                    Status::Stalled
                } else {
                    Status::IterationLimit
                };
                if report.status != Status::IterationLimit {
                    report.residual = left;
                    break;
                }
            }
            if !report.residual.is_finite() {
                break;
            }
            windows[1] = windows[1].min(report.residual);
            if report.iterations >= WINDOW && report.iterations.is_power_of_two() {
                let left = plan.residual(b, x).sqrt();
                if windows[1] >= windows[0] && left <= roundoff(a, b, x) {
                    report.status = Status::Stalled;
                    report.residual = left / norm;
                    break;
                }
                windows = [windows[1], f64::INFINITY];
            }
        }
        check_solution(a, x)?;
        if report.status == Status::IterationLimit
            && fallen < STILL
            && let Some(block) = plan.null_vector(a, x, self.options.iterations)
        {
            return Err(SolveError::Singular { block });
        }
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of springs that nothing holds, or that `held` holds at one place: with 0 singular, its null vector 1.
    fn ring(held: f64) -> SymBlockMatrix {
        let n = 12;
        let couplings: Vec<_> = (0..n).map(|i| ((i + 1) % n, i)).collect();
        let pattern = BlockPattern::new(&vec![1; n], &couplings).expect("a pattern");
        let halves = (0..n as u32).map(|i| i / 6).collect();
        let pattern = Arc::new(pattern.with_groups(halves).expect("groups"));
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        a.values_mut().fill(-0.7);
        for j in 0..n {
            a.block_mut(pattern.column(j).start)[0] = 1.4 + if j == 3 { held } else { 0.0 };
        }
        a
    }

    fn solve(
        a: &SymBlockMatrix,
        partition: Partition,
        iterations: usize,
        b: &[f64],
    ) -> Result<SolveReport, SolveError> {
        let mut solver = GaussSeidel::new(GaussSeidelOptions {
            partition,
            iterations,
            ..GaussSeidelOptions::default()
        })?;
        solver.analyze(a.pattern())?;
        solver.factorize(a)?;
        solver.solve(a, b, &mut vec![0.0; b.len()])
    }

    /// Without a solution an iteration that had the time to see it says so; with one it converges; a solution that is
    /// far away, or too little time, leave it at its limit.
    #[test]
    fn a_system_without_a_solution_is_told_from_slow_convergence() {
        let mut balanced: Vec<f64> = (0..12).map(|i| f64::from(i * i % 7)).collect();
        balanced[0] -= balanced.iter().sum::<f64>();
        let mut unbalanced = balanced.clone();
        unbalanced[5] += 1.0;
        for partition in [Partition::Joints, Partition::Groups] {
            let solved = |held, iterations, b: &[f64]| solve(&ring(held), partition, iterations, b);
            let status = |held, iterations, b: &[f64]| {
                let report = solved(held, iterations, b).expect("no error");
                report.status
            };
            for scale in [1.0, 1e100, 1e-100] {
                let b: Vec<f64> = unbalanced.iter().map(|b| b * scale).collect();
                let found = solved(0.0, 1000, &b);
                let refused = matches!(found, Err(SolveError::Singular { .. }));
                assert!(refused, "{partition:?} {scale:e}: {found:?}");
            }
            assert_eq!(status(0.0, 1000, &balanced), Status::Converged);
            assert_eq!(status(0.0, 3, &unbalanced), Status::IterationLimit);
            for held in [1e-6, 1e-12] {
                assert_eq!(status(held, 1000, &unbalanced), Status::IterationLimit);
            }
        }
    }
}
