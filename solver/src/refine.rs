//! Iterative refinement around any backend.
//!
//! The residual is a function: with b − A x it brings the backward error down to roundoff; with a residual computed
//! from the pieces that A was formed from it also repairs what forming A lost (for A = J M⁻¹ Jᵀ + Σ about roundoff ×
//! mass ratio), which no solve with A can.

use crate::claim::Judge;
use crate::{LinearSolver, SolveError, SolveReport, Status, SymBlockMatrix, norm_inf};
use taut_lanes::{Aligned, Isa, Kernel, Lanes, Level, dispatch};

/// Buffers of a refinement, made once.
#[derive(Debug, Clone, Default)]
pub struct RefineScratch {
    residual: Aligned,
    correction: Aligned,
}

impl RefineScratch {
    /// Buffers for a system of dimension `dim`. Allocates.
    #[must_use]
    pub fn new(dim: usize) -> Self {
        Self {
            residual: Aligned::new(dim),
            correction: Aligned::new(dim),
        }
    }
}

/// Largest last correction of a direct solver, as a part of ‖x‖∞, at which x is still claimed. Corrections shrink about
/// geometrically, so x may be wrong by this part of the last one.
const CONTRACTION: f64 = 0.1;

/// Largest last correction of a direct solver, as a part of ‖x‖∞, that is evidence of a good factor. Corrections of a
/// residual at roundoff are about roundoff × condition of x, whatever the right-hand side: ten thousand times less than
/// where no digit is right.
const EVIDENCE: f64 = 1e-4;

/// Improves `x` by `sweeps` corrections A d = r(x), x ← x + d, where `residual(x, r)` writes r. Returns the last
/// correction's report with the iterations of all. Of a direct solver its status is [`Status::Stalled`] where a correction
/// of a residual at roundoff is more than a tenth of x (∞-norm): the matrix is singular to rounding, which elimination
/// without pivoting may not see. Where elimination guarantees no residual at roundoff
/// ([`LinearSolver::solve_unjudged`]) and the last one was none, `x` is corrected until it is, and is [`Status::Stalled`]
/// too where it does not get there, or where the rule of conditions ([`LinearSolver::claims`]) forbids a claim. Allocates
/// nothing.
///
/// # Errors
/// The errors of [`LinearSolver::solve`]; `x` then holds the last good iterate.
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
    let [mut size, mut change] = [0.0; 2];
    for _ in 0..sweeps {
        residual(x, &mut scratch.residual);
        if solver.takes_guess() {
            scratch.correction.fill(0.0);
        }
        let mut report = solver.solve_unjudged(a, &scratch.residual, &mut scratch.correction)?;
        report.iterations += last.map_or(0, |r| r.iterations);
        let correct = Correct(x, &scratch.correction);
        [size, change] = dispatch(Level::best(), correct);
        last = Some(report);
    }
    let Some(report) = &mut last else {
        return Ok(None);
    };
    let mut is_apart = change > CONTRACTION * size;
    if report.status == Status::Unjudged {
        let RefineScratch {
            residual: r,
            correction: d,
        } = scratch;
        let (judge, before) = (Judge::of(a, d), norm_inf(r));
        if !judge.admits(before, size) {
            let solve = |r: &[f64], d: &mut [f64]| solver.solve_unjudged(a, r, d).map(|_| ());
            report.status = judge.settle(x, [r, d], before, &mut residual, solve)?;
            is_apart = false;
        } else {
            report.status = Status::Direct;
        }
    }
    if report.status != Status::Direct {
        return Ok(last);
    }
    // A residual that is exactly 0 tells nothing of the factor, unless x = 0.
    let evidence = change <= EVIDENCE * size && (change > 0.0 || size == 0.0);
    report.status = match solver.claims(a, evidence)? {
        Status::Unjudged => correct(solver, a, x, scratch, residual)?,
        Status::Direct if is_apart => Status::Stalled,
        status => status,
    };
    Ok(last)
}

/// One more correction, of which the solver itself says what it may claim.
fn correct(
    solver: &mut dyn LinearSolver,
    a: &SymBlockMatrix,
    x: &mut [f64],
    scratch: &mut RefineScratch,
    mut residual: impl FnMut(&[f64], &mut [f64]),
) -> Result<Status, SolveError> {
    residual(x, &mut scratch.residual);
    let report = solver.solve(a, &scratch.residual, &mut scratch.correction)?;
    if report.status != Status::Direct {
        return Ok(report.status);
    }
    let [size, change] = dispatch(Level::best(), Correct(x, &scratch.correction));
    // A correction claimed of a rounded residual may be one of x by chance. b is the residual of 0.
    let RefineScratch {
        residual: r,
        correction: b,
    } = scratch;
    b.fill(0.0);
    residual(b, r);
    b.copy_from_slice(r);
    residual(x, r);
    let bound = solver.error_bound(a, b, x, r)?;
    Ok(if change > CONTRACTION * size || bound > CONTRACTION {
        Status::Stalled
    } else {
        Status::Direct
    })
}

/// x ← x + d; ‖x‖∞ and ‖d‖∞.
struct Correct<'a>(&'a mut [f64], &'a [f64]);

impl Kernel for Correct<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<I: Isa>(self) -> [f64; 2] {
        let ((x, tail_x), (d, tail_d)) = (self.0.as_chunks_mut::<8>(), self.1.as_chunks::<8>());
        let mut sizes = [I::X8::splat(0.0); 2];
        for (x, d) in x.iter_mut().zip(d) {
            let d = I::X8::load(d);
            let sum = I::X8::load(x) + d;
            sum.store(x);
            // In this order NaN is passed over, as it is by `f64::max`.
            sizes[0] = sum.abs().max(sizes[0]);
            sizes[1] = d.abs().max(sizes[1]);
        }
        let [mut size, mut change] = [sizes[0].max_lane(), sizes[1].max_lane()];
        for (x, d) in tail_x.iter_mut().zip(tail_d) {
            *x += d;
            size = size.max(x.abs());
            change = change.max(d.abs());
        }
        [size, change]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_are_added_and_measured_but_for_nan() {
        for level in Level::available() {
            for n in [0, 1, 7, 8, 9, 21] {
                let d: Vec<f64> = (0..n).map(|i| 1.0 - i as f64).collect();
                for bad in (0..n).map(Some).chain([None]) {
                    let mut d = d.clone();
                    if let Some(bad) = bad {
                        d[bad] = f64::NAN;
                    }
                    let mut x: Vec<f64> = (0..n).map(|i| 3.0 * i as f64 - 9.0).collect();
                    let sum: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + d).collect();
                    let size = |v: &[f64]| v.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                    let found = dispatch(level, Correct(&mut x, &d));
                    assert_eq!(found, [size(&sum), size(&d)], "{level} {n} {bad:?}");
                    let same = |(a, b): (&f64, &f64)| a == b || a.is_nan() && b.is_nan();
                    assert!(x.iter().zip(&sum).all(same));
                }
            }
        }
    }
}
