//! Solutions to the last digit, and how ill-conditioned a matrix is.
//!
//! The solution comes from a factorisation in doubles by iterative refinement: residuals b − A x of the exact entries,
//! and x itself, in double-double arithmetic. Each sweep takes off a factor of about condition × roundoff, so that x is
//! exact to its last digit for condition numbers up to some 10¹⁵, whichever solver made the factors; where the sweeps do
//! not contract there is no such solution, and none is claimed (Demmel et al., *Error bounds from extra-precise
//! iterative refinement*, 2006).
//!
//! The condition number in the ∞-norm is ‖A‖ times an estimate from below of ‖A⁻¹‖, seldom off by more than a factor
//! of 3 (Higham, *Accuracy and Stability of Numerical Algorithms*, algorithm 15.1), for symmetric matrices.

use super::Matrix;
use super::prepared::{Prepared, Problem};
use taut_solver::{Backend, DoubleDouble, SolveError, norm_inf};

/// The direct backends in the order in which they are asked: the cheapest first, since the sweeps tell whether its factors
/// are good enough.
const SOLVERS: [&str; 5] = ["faer:ldlt", "banded", "umfpack", "faer:lu", "dense"];

/// Rows beyond which the dense solver is not asked.
const DENSE_ROWS: usize = 2000;

/// Relative correction in the ∞-norm at which refinement stops.
const TARGET: f64 = 1e-24;

/// Largest correction that suffices once corrections no longer shrink. Rounding of the residual
/// leaves 10⁻³² times the condition number; an error of this size does not reach the last digit of
/// a double.
const ENOUGH: f64 = 1e-18;

/// Sweeps at most.
const SWEEPS: usize = 40;

/// x of A x = b to the last digit, and the backend whose factors it was made with; `None` where no backend's refinement
/// contracts.
#[must_use]
pub fn solution(problem: &Problem<'_>, b: &[f64]) -> Option<(Vec<f64>, String)> {
    solvers(problem).find_map(|backend| Some((refined(problem, &backend, b)?, backend.to_string())))
}

/// None at all where a symmetric matrix fills beyond reach: what exchanges rows would fill no less.
fn solvers(problem: &Problem<'_>) -> impl Iterator<Item = Backend> {
    let small = problem.matrix.dim() <= DENSE_ROWS;
    let (symmetric, within_reach) = match &problem.ordered {
        None => (false, true),
        Some(ordered) => (true, ordered.is_ok()),
    };
    let backends = SOLVERS.into_iter().filter_map(|name| name.parse().ok());
    backends.filter(move |b: &Backend| {
        within_reach
            && b.is_compiled()
            && (symmetric || b.accepts_unsymmetric())
            && (small || b.name() != "dense")
    })
}

fn factorized<'a>(problem: &'a Problem<'_>, backend: &Backend) -> Result<Prepared<'a>, SolveError> {
    let mut solver = problem.analyze(backend)?;
    solver.factorize()?;
    Ok(solver)
}

fn refined(problem: &Problem<'_>, backend: &Backend, b: &[f64]) -> Option<Vec<f64>> {
    let mut solver = factorized(problem, backend).ok()?;
    let n = b.len();
    let mut x = vec![DoubleDouble::default(); n];
    let (mut r, mut d) = (vec![DoubleDouble::default(); n], vec![0.0; n]);
    let mut before = f64::INFINITY;
    for _ in 0..SWEEPS {
        for (r, &b) in r.iter_mut().zip(b) {
            *r = b.into();
        }
        let matrix = problem.matrix;
        matrix.for_each(|i, j, a| r[i] = r[i] - x[j] * a.into());
        let rounded: Vec<f64> = r.iter().map(|r| r.to_f64()).collect();
        d.fill(0.0);
        solver.solve(&rounded, &mut d).ok()?;
        for (x, &d) in x.iter_mut().zip(&d) {
            *x = *x + d.into();
        }
        let scale = x.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        let change = norm_inf(&d);
        let change = if scale == 0.0 { change } else { change / scale };
        let contracts = change <= 0.3 * before;
        if change <= TARGET || (change <= ENOUGH && !contracts) {
            return Some(x.into_iter().map(DoubleDouble::to_f64).collect());
        }
        // The first correction is the solution itself.
        if !change.is_finite() || (before <= 1.0 && !contracts) {
            return None;
        }
        before = change;
    }
    None
}

/// Estimates of a condition number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// ‖A‖∞ ‖A⁻¹‖∞ of A as it is.
    pub of_matrix: f64,
    /// ∞-norm condition of S⁻¹ A S⁻¹, sᵢ² being the largest entry of row i: without the units of
    /// the rows. Elimination does not see such scaling and meets this number.
    pub scaled: f64,
}

/// The condition of A; `None` where A is not symmetric or no backend factorises it.
#[must_use]
pub fn condition(problem: &Problem<'_>) -> Option<Condition> {
    let Matrix::Symmetric(_) = problem.matrix else {
        return None;
    };
    let mut solver = solvers(problem).find_map(|backend| factorized(problem, &backend).ok())?;
    let n = problem.matrix.dim();
    let mut scale = vec![0.0_f64; n];
    problem
        .matrix
        .for_each(|r, _, a| scale[r] = scale[r].max(a.abs()));
    scale.iter_mut().for_each(|s| *s = s.sqrt());
    Some(Condition {
        of_matrix: estimate(problem.matrix, &mut solver, &vec![1.0; n])?,
        scaled: estimate(problem.matrix, &mut solver, &scale)?,
    })
}

/// The condition number of S⁻¹ A S⁻¹.
fn estimate(a: &Matrix, solver: &mut Prepared<'_>, scale: &[f64]) -> Option<f64> {
    let n = a.dim();
    let mut solve = |b: &[f64]| {
        let times_scale = |v: &[f64]| v.iter().zip(scale).map(|(v, s)| v * s).collect::<Vec<_>>();
        let mut x = vec![0.0; n];
        let solved = solver.solve(&times_scale(b), &mut x);
        solved.ok().map(|_| times_scale(&x))
    };
    let mut sums = vec![0.0; n];
    a.for_each(|r, c, a| sums[r] += (a / (scale[r] * scale[c])).abs());
    let one_norm = |v: &[f64]| v.iter().map(|v| v.abs()).sum::<f64>();
    let mut x = vec![1.0 / n as f64; n];
    let mut estimate = 0.0_f64;
    for sweep in 0..5 {
        let y = solve(&x)?;
        if sweep > 0 && one_norm(&y) <= estimate {
            break;
        }
        estimate = one_norm(&y);
        let signs: Vec<f64> = y.iter().map(|y| 1.0_f64.copysign(*y)).collect();
        let z = solve(&signs)?;
        let best = (0..n).max_by(|&i, &j| z[i].abs().total_cmp(&z[j].abs()))?;
        let inner: f64 = z.iter().zip(&x).map(|(z, x)| z * x).sum();
        if z[best].abs() <= inner {
            break;
        }
        x.fill(0.0);
        x[best] = 1.0;
    }
    // Higham's second vector, for what the gradient does not see.
    let weight = |i: usize| 1.0 + i as f64 / (n.max(2) - 1) as f64;
    let alternating: Vec<f64> = (0..n)
        .map(|i| if i % 2 == 0 { weight(i) } else { -weight(i) })
        .collect();
    let second = 2.0 * one_norm(&solve(&alternating)?) / (3.0 * n as f64);
    Some(norm_inf(&sums) * estimate.max(second))
}
