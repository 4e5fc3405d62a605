//! Claimed against verified: what every solver says of its solves, beside a check that shares as little with it as can be.
//!
//! [`audit`] has the reference solver step a scene. At some instants every solver, at its defaults, the iterative ones
//! with other tolerances and limits besides, solves the system of the next step, in a stepper of its own. Verified is
//! the residual r of what came out, in double-double arithmetic. A claim is true where
//!
//! ```text
//! ‖r‖₂ ≤ τ ‖b‖₂   or   η = ‖r‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞) ≤ 10⁻¹⁴
//! ```
//!
//! with the tolerance τ of an iteration; a direct solver has the second alone.
//!
//! **Independent** of the solvers are: the arithmetic; that S is never formed, so that what forming it lost shows; the
//! inverse of the masses; the products, row by row over the entries of M, J and Σ; the norms. **Shared** are these
//! pieces, read from the KKT matrix: that the Jacobian is right is shown elsewhere (`tests/exact/jacobians.rs`).

use crate::prelude::*;
use taut_measure::claim::{ROUNDING, over};
use taut_measure::matrix::Matrix;
use taut_measure::matrix::dump::body_rows;
use taut_measure::reference::{Snapshot, reference_choice};

/// Rows beyond which a scene has no part in an audit, and the dense solver none in that of a scene.
const MOST_ROWS: usize = 3000;
const SMALL_ROWS: usize = 400;

const DT: f64 = 1.0 / 60.0;

/// Truth of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// Claimed, and so.
    TruePositive,
    /// Claimed, and not so.
    FalsePositive,
    /// Not claimed, though it would have been true.
    FalseNegative,
    /// Not claimed, and not so.
    TrueNegative,
    /// A typed error, no answer.
    Refused,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Solve {
    /// Steps before it.
    pub step: usize,
    /// Solver without iterations and tolerance.
    pub backend: String,
    /// Its tolerance or limit where that is not the default.
    pub variant: String,
    /// Report, or the error in words.
    pub reported: Result<SolveReport, String>,
    pub seen: Verified,
    pub finding: Finding,
}

impl Solve {
    /// Judges a report on a solution with these errors.
    pub fn of(
        step: usize,
        (choice, variant): &(Choice, String),
        solved: Result<(SolveReport, Verified), String>,
    ) -> Self {
        let seen = solved.as_ref().map_or(Verified::NONE, |s| s.1);
        let reported = solved.map(|s| s.0);
        let good = over_claim(&seen, &choice.backend) <= 1.0;
        let finding = match reported.as_ref().map(SolveReport::is_claim) {
            Err(_) => Finding::Refused,
            Ok(true) if good => Finding::TruePositive,
            Ok(true) => Finding::FalsePositive,
            Ok(false) if good => Finding::FalseNegative,
            Ok(false) => Finding::TrueNegative,
        };
        Self {
            step,
            backend: choice.family(),
            variant: variant.clone(),
            reported,
            seen,
            finding,
        }
    }

    pub fn is_claim(&self) -> bool {
        matches!(self.finding, Finding::TruePositive | Finding::FalsePositive)
    }

    /// True where a claim is false, or reports a residual that is below the true one by more than rounding.
    pub fn is_wrong(&self) -> bool {
        let reported = self.reported.as_ref().map_or(f64::NAN, |r| r.residual);
        let part = (1.0 - reported / self.seen.residual).max(0.0);
        let hides = self.seen.residual > reported && part * self.seen.backward_error > ROUNDING;
        self.finding == Finding::FalsePositive || (self.is_claim() && hides)
    }
}

/// Solvers at their defaults, and the iterative ones with other tolerances and limits, with these in words.
pub fn variants(all: impl Iterator<Item = Choice>) -> Vec<(Choice, String)> {
    let compiled = all.filter(|c| c.check().is_ok());
    let of_each = compiled.flat_map(|Choice { backend, form }| {
        let mut own = Vec::new();
        if backend.is_iterative() {
            let loose = |t: f64| (backend.with_tolerance(t), format!("tolerance {t:.0e}"));
            let short = |n: usize| (backend.with_iterations(n), format!("{n} iterations"));
            own.extend([loose(1e-4), loose(1e-8), short(1), short(10)]);
        }
        own.push((backend, String::new()));
        own.into_iter()
            .map(move |(backend, name)| (Choice { backend, form }, name))
    });
    of_each.collect()
}

/// Residual of a solution over the limit that a claim of `backend` sets: at most 1 if the claim is true.
pub fn over_claim(seen: &Verified, backend: &Backend) -> f64 {
    over(seen.residual, seen.backward_error, backend.tolerance())
}

/// The solves of a scene after those numbers of steps, ascending, as far as it can be stepped.
///
/// # Errors
/// A scene that no stepper takes.
pub fn audit(scene: &Scene, instants: &[usize]) -> Result<Vec<Solve>, StepError> {
    let mut stepper = Stepper::new(scene.clone(), reference_choice().options(DT))?;
    let rows = stepper.multipliers().len();
    let (mut found, mut step) = (Vec::new(), 0);
    if rows > MOST_ROWS {
        return Ok(found);
    }
    for &instant in instants {
        while step < instant {
            if stepper.step().is_err() {
                return Ok(found);
            }
            step += 1;
        }
        for one in variants(Choice::all().into_iter()) {
            if rows <= SMALL_ROWS || one.0.backend.name() != "dense" {
                let solved = solve(&stepper, &one.0).map_err(|e| e.to_string());
                found.push(Solve::of(step, &one, solved));
            }
        }
    }
    Ok(found)
}

/// One solve of the next step of a motion, and its errors.
fn solve(motion: &Stepper, choice: &Choice) -> Result<(SolveReport, Verified), StepError> {
    let mut stepper = Stepper::new(motion.scene().clone(), choice.plain_options(DT))?;
    Snapshot::of(motion).put(&mut stepper)?;
    stepper.set_multipliers(motion.multipliers())?;
    let report = stepper.solve()?.solve;
    let x = stepper.system().2.to_vec();
    let (a, b) = stepper.assembled(choice.form)?;
    let seen = match choice.form {
        Form::Kkt => whole(&a, &b, &x),
        _ => {
            let (pieces, impulses) = stepper.assembled(Form::Kkt)?;
            verify(&a, &b, (&pieces, &impulses), &x)
        }
    };
    Ok((report, seen))
}

/// Errors of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verified {
    /// ‖r‖₂ / ‖b‖₂; the norm of r where b = 0.
    pub residual: f64,
    /// ‖r‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞).
    pub backward_error: f64,
}

impl Verified {
    fn of(norm: f64, b: &[f64], x: &[f64], r: &[f64]) -> Self {
        let two = |v: &[f64]| {
            let scale = norm_inf(v);
            let square = |x: &f64| (x / scale).powi(2);
            if scale == 0.0 {
                0.0
            } else {
                scale * v.iter().map(square).sum::<f64>().sqrt()
            }
        };
        let over = |size: f64, scale: f64| if size == 0.0 { 0.0 } else { size / scale };
        let length = two(b);
        Self {
            residual: over(two(r), if length == 0.0 { 1.0 } else { length }),
            backward_error: over(norm_inf(r), norm * norm_inf(x) + norm_inf(b)),
        }
    }

    /// Errors of a vector without the dimension of the matrix.
    const NONE: Self = Self {
        residual: f64::NAN,
        backward_error: f64::NAN,
    };
}

/// Errors of `x` as a solution of the KKT system, which holds the pieces as they are.
pub fn whole(a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> Verified {
    residual(a, b, x).map_or(Verified::NONE, |r| Verified::of(a.norm_inf(), b, x, &r))
}

/// Errors of `x` as a solution of A x = b, of any matrix.
pub fn alone(a: &Matrix, b: &[f64], x: &[f64]) -> Verified {
    if [b.len(), x.len()] != [a.dim(); 2] {
        return Verified::NONE;
    }
    let mut r: Vec<DoubleDouble> = b.iter().map(|&b| b.into()).collect();
    let mut sums = vec![0.0; b.len()];
    a.for_each(|i, j, a| {
        r[i] = r[i] - DoubleDouble::product(a, x[j]);
        sums[i] += a.abs();
    });
    let r: Vec<f64> = r.into_iter().map(DoubleDouble::to_f64).collect();
    Verified::of(norm_inf(&sums), b, x, &r)
}

/// Errors of the multipliers `mu` as a solution of S μ = b, scaled by this, with the residual of the KKT system
/// `pieces` of the same step, whose constraints stand in the same order: c − J v − J Δv − Σ μ with
/// Δv = M̃⁻¹ (Δt f + Jᵀ μ).
pub fn verify(
    s: &SymBlockMatrix,
    b: &[f64],
    (kkt, kkt_b): (&SymBlockMatrix, &[f64]),
    mu: &[f64],
) -> Verified {
    let p = kkt.pattern();
    let bodies = body_rows(kkt);
    let mut is_body = vec![false; kkt.dim()];
    for i in (0..p.blocks()).filter(|&i| bodies[i]) {
        is_body[p.rows(i)].fill(true);
    }
    // The unknowns are Δv and −μ, in one vector.
    let mut x = vec![DoubleDouble::default(); kkt.dim()];
    let rows: Vec<usize> = (0..kkt.dim()).filter(|&r| !is_body[r]).collect();
    if rows.len() != mu.len() {
        return Verified::NONE;
    }
    for (&r, &mu) in rows.iter().zip(mu) {
        x[r] = (-mu).into();
    }
    let mut rest: Vec<DoubleDouble> = kkt_b.iter().map(|&b| b.into()).collect();
    let mut subtract = |x: &[DoubleDouble], from_bodies: bool| {
        kkt.for_each_lower(|r, c, a| {
            for (r, c) in [(r, c), (c, r)].into_iter().take(1 + usize::from(r != c)) {
                let counts = is_body[r] == from_bodies && !(is_body[r] && is_body[c]);
                if counts {
                    rest[r] = rest[r] - x[c] * a.into();
                }
            }
        });
        rest.clone()
    };
    let impulses = subtract(&x, true);
    for i in (0..p.blocks()).filter(|&i| bodies[i]) {
        let mass = kkt.block(p.column(i).start);
        divide(mass, &impulses[p.rows(i)], &mut x[p.rows(i)]);
    }
    let rest = subtract(&x, false);
    let r: Vec<f64> = rows.into_iter().map(|r| rest[r].to_f64()).collect();
    Verified::of(s.norm_inf(), b, mu, &r)
}

/// x = M⁻¹ b of a symmetric positive definite block, of which the lower triangle is read.
fn divide(m: &[f64], b: &[DoubleDouble], x: &mut [DoubleDouble]) {
    let n = b.len();
    let entry = |k: usize| m[(k / n).max(k % n) + (k / n).min(k % n) * n].into();
    let mut a: Vec<DoubleDouble> = (0..n * n).map(entry).collect();
    x.copy_from_slice(b);
    for k in 0..n {
        for r in k + 1..n {
            let factor = a[r * n + k] / a[k * n + k];
            for c in k..n {
                a[r * n + c] = a[r * n + c] - factor * a[k * n + c];
            }
            x[r] = x[r] - factor * x[k];
        }
    }
    for r in (0..n).rev() {
        let sum = (r + 1..n).fold(x[r], |sum, c| sum - a[r * n + c] * x[c]);
        x[r] = sum / a[r * n + r];
    }
}
