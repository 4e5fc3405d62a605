//! Solutions to the last digit, and how ill-conditioned a matrix is.
//!
//! The solution comes from a factorisation in doubles by iterative refinement: residuals b − A x of the exact entries,
//! and x itself, in double-double arithmetic. Each sweep takes off a factor of about condition × roundoff, so that x is
//! exact to its last digit for condition numbers up to some 10¹⁵, whichever solver made the factors; where the sweeps do
//! not contract there is no such solution, and none is claimed (Demmel et al., *Error bounds from extra-precise
//! iterative refinement*, 2006).
//!
//! The condition number in the ∞-norm is ‖A‖ times an estimate from below of ‖A⁻¹‖, seldom off by more than a factor
//! of 3 ([`inverse_norm`]).

use super::Matrix;
use super::prepared::{Prepared, Problem};
use taut_solver::{Backend, DoubleDouble, SolveError, inverse_norm, norm_inf};

/// The direct backends in the order in which they are asked: the cheapest first, since the sweeps tell whether its factors
/// are good enough.
const SOLVERS: [&str; 5] = ["faer:ldlt", "banded", "umfpack", "faer:lu", "dense"];

/// Rows beyond which the dense solver is not asked.
const DENSE_ROWS: usize = 2000;

/// Sweeps of the symmetric scaling: each takes the root of how far a row's largest entry is from 1.
const BALANCES: usize = 16;

/// Relative correction in the ∞-norm at which refinement stops.
const TARGET: f64 = 1e-24;

/// Largest correction that suffices once corrections no longer shrink. Rounding of the residual
/// leaves 10⁻³² times the condition number; an error of this size is at most half of the last digit of a double.
const ENOUGH: f64 = 0.25 * f64::EPSILON;

/// Sweeps at most.
const SWEEPS: usize = 40;

/// x of A x = b to the last digit, and the backend whose factors it was made with; `None` where no backend's refinement
/// contracts.
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
    /// Condition number with rows and columns scaled, so that units do not count: elimination meets this number. Of a
    /// symmetric matrix S⁻¹ A S⁻¹ in the ∞-norm with largest entries of about 1 in all rows; of others
    /// ‖R A C‖₁ ‖(R A C)⁻¹‖₁ with largest entries of 1 to 2 in all rows and columns.
    pub scaled: f64,
}

/// Regularity of a matrix, judged by the results of the backends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regularity {
    /// One that exchanges rows solves it, or another where none of those refuses it.
    Regular(Condition),
    /// One that exchanges rows finds it singular to rounding, and none of those solves it.
    Singular,
    /// None is within reach.
    Unknown,
}

/// Returns true for backends that exchange rows as far as is needed: their refusals count more than claims of those that
/// eliminate in a given order.
pub fn exchanges_rows(backend: &Backend) -> bool {
    backend.accepts_unsymmetric()
}

/// The condition of A, by the first backend whose solutions are claimed, and whether that may be believed.
pub fn regularity(problem: &Problem<'_>) -> Regularity {
    let transposed = match problem.matrix {
        Matrix::Symmetric(_) => None,
        Matrix::General(a) => Some(Matrix::General(a.transposed())),
    };
    let transposed = transposed.as_ref().map(Problem::new);
    // Claims of those that exchange no rows wait for one that does.
    let (mut first, mut refused) = (None, false);
    for backend in solvers(problem) {
        match measured(problem, transposed.as_ref(), &backend) {
            Ok(Some(condition)) if exchanges_rows(&backend) => {
                return Regularity::Regular(first.unwrap_or(condition));
            }
            Ok(Some(condition)) => first = first.or(Some(condition)),
            Err(SolveError::Singular { .. }) => refused |= exchanges_rows(&backend),
            _ => {}
        }
    }
    match first {
        _ if refused => Regularity::Singular,
        Some(condition) => Regularity::Regular(condition),
        None => Regularity::Unknown,
    }
}

/// The condition of A; `None` where no backend solves it.
pub fn condition(problem: &Problem<'_>) -> Option<Condition> {
    match regularity(problem) {
        Regularity::Regular(condition) => Some(condition),
        _ => None,
    }
}

/// `None` where a solution is not claimed.
fn measured(
    problem: &Problem<'_>,
    transposed: Option<&Problem<'_>>,
    backend: &Backend,
) -> Result<Option<Condition>, SolveError> {
    let n = problem.matrix.dim();
    let mut solver = problem.analyze(backend)?;
    let report = solver.factorize()?;
    let mut other = match transposed {
        None => None,
        Some(problem) => Some(factorized(problem, backend)?),
    };
    let mut solvers = [Some(&mut solver), other.as_mut()];
    let of_matrix = estimate(problem.matrix, &mut solvers, &vec![1.0; n])?;
    let scaled = match (report.reciprocal_condition, transposed) {
        (Some(reciprocal), Some(_)) => Some(1.0 / reciprocal),
        _ => {
            let scale = symmetric_scale(problem.matrix);
            estimate(problem.matrix, &mut solvers, &scale)?
        }
    };
    let both = of_matrix.zip(scaled);
    Ok(both.map(|(of_matrix, scaled)| Condition { of_matrix, scaled }))
}

/// S with largest entries of about 1 in all rows of S⁻¹ A S⁻¹ (Ruiz, *A scaling algorithm to equilibrate both rows and columns
/// norms in matrices*, 2001).
fn symmetric_scale(a: &Matrix) -> Vec<f64> {
    let mut scale = vec![1.0_f64; a.dim()];
    for _ in 0..BALANCES {
        let mut largest = vec![0.0_f64; scale.len()];
        a.for_each(|r, c, a| largest[r] = largest[r].max(a.abs() / scale[r] / scale[c]));
        for (s, largest) in scale.iter_mut().zip(largest) {
            if largest > 0.0 && largest.is_finite() {
                *s *= largest.sqrt();
            }
        }
    }
    scale
}

/// The condition number of S⁻¹ A S⁻¹ by solvers of A and, where that is another, of Aᵀ.
fn estimate(
    a: &Matrix,
    [solver, other]: &mut [Option<&mut Prepared<'_>>; 2],
    scale: &[f64],
) -> Result<Option<f64>, SolveError> {
    let n = a.dim();
    let (mut b, mut claimed) = (vec![0.0; n], true);
    // ‖A⁻¹‖∞ is ‖A⁻ᵀ‖₁.
    let inverse = inverse_norm(n, |x, transposed| {
        let by = match (&mut *other, transposed) {
            (Some(other), false) => Some(&mut **other),
            _ => solver.as_deref_mut(),
        };
        for ((b, x), s) in b.iter_mut().zip(&mut *x).zip(scale) {
            *b = *x * s;
            *x = 0.0;
        }
        if let Some(by) = by {
            claimed &= by.solve(&b, x)?.is_claim();
        }
        x.iter_mut().zip(scale).for_each(|(x, s)| *x *= s);
        Ok(())
    })?;
    let mut sums = vec![0.0; n];
    a.for_each(|r, c, a| sums[r] += (a / (scale[r] * scale[c])).abs());
    Ok(claimed.then_some(norm_inf(&sums) * inverse))
}
