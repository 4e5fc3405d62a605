//! The residual of a solve in double-double arithmetic, from the pieces that its system was formed from.
//!
//! **Independent** of what is verified are: the arithmetic; that S is never formed, so that what forming it lost shows;
//! the inverse of the masses, by an elimination of its own; the products, row by row over the entries of the pieces,
//! without the blocks, lanes and orders of the solvers; the norms, and so the test itself.
//!
//! **Shared** are the pieces, the masses M, the Jacobian J, the compliances Σ and the right-hand side c: they are read
//! from the KKT matrix as the stepper assembles it, in the order of its constraints. A wrong Jacobian would be verified as
//! well as a right one: that it is right is shown elsewhere (H43 against differences, energies and equilibria against
//! their formulas). Of the backward error of S, ‖S‖ and ‖b‖ come from the S and b that were formed, which are good
//! enough for a scale. Of a matrix by itself its entries are shared, and no more.

use taut_ground::matrix::Matrix;
use taut_ground::matrix::dump::body_rows;
use taut_solver::{DoubleDouble, SymBlockMatrix, norm_inf, residual};

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
pub(super) fn whole(a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> Verified {
    residual(a, b, x).map_or(Verified::NONE, |r| Verified::of(a.norm_inf(), b, x, &r))
}

/// Errors of `x` as a solution of A x = b, of any matrix.
#[must_use]
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
/// `pieces` of the same step, whose constraints stand in the same order: that of its rows where Δv = M̃⁻¹ (Δt f + Jᵀ
/// μ).
pub(super) fn verify(
    s: &SymBlockMatrix,
    b: &[f64],
    pieces: (&SymBlockMatrix, &[f64]),
    mu: &[f64],
) -> Verified {
    rows_residual(pieces, mu).map_or(Verified::NONE, |r| Verified::of(s.norm_inf(), b, mu, &r))
}

/// c − J v − J Δv − Σ μ; `None` where there are not as many multipliers as rows.
fn rows_residual((kkt, b): (&SymBlockMatrix, &[f64]), mu: &[f64]) -> Option<Vec<f64>> {
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
        return None;
    }
    for (&r, &mu) in rows.iter().zip(mu) {
        x[r] = (-mu).into();
    }
    let mut rest: Vec<DoubleDouble> = b.iter().map(|&b| b.into()).collect();
    kkt.for_each_lower(|r, c, a| {
        for (r, c) in [(r, c), (c, r)] {
            if is_body[r] && !is_body[c] {
                rest[r] = rest[r] - x[c] * a.into();
            }
        }
    });
    for i in (0..p.blocks()).filter(|&i| bodies[i]) {
        let mass = kkt.block(p.column(i).start);
        divide(mass, &rest[p.rows(i)], &mut x[p.rows(i)]);
    }
    kkt.for_each_lower(|r, c, a| {
        if !is_body[r] {
            rest[r] = rest[r] - x[c] * a.into();
        }
        if r != c && !is_body[c] {
            rest[c] = rest[c] - x[r] * a.into();
        }
    });
    Some(rows.into_iter().map(|r| rest[r].to_f64()).collect())
}

/// x = M⁻¹ b of a symmetric positive definite block, of which the lower triangle is read.
fn divide(m: &[f64], b: &[DoubleDouble], x: &mut [DoubleDouble]) {
    let n = b.len();
    let mut a = vec![DoubleDouble::default(); n * n];
    for r in 0..n {
        for c in 0..n {
            a[r * n + c] = m[r.max(c) + r.min(c) * n].into();
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use taut_ground::choice::Choice;
    use taut_ground::poses::{Pose, hoist};
    use taut_integrator::{Form, Stepper};
    use taut_model::HoistParams;
    use taut_solver::reference_solution;

    /// The exact multipliers have no residual but their own rounding; others have one of the size of their error.
    #[test]
    fn exact_multipliers_have_no_residual() {
        let params = HoistParams {
            segments: 6,
            mass_ratio: 10.0,
            ..HoistParams::default()
        };
        let scene = hoist(&params, Pose::Bent).expect("a scene");
        let options = Choice::schur(taut_solver::Backend::Dense(
            taut_solver::DenseOptions::default(),
        ));
        let mut stepper = Stepper::new(scene, options.plain_options(1.0 / 60.0)).expect("sound");
        stepper.solve().expect("solvable");
        let (s, b) = stepper.assembled(Form::Schur).expect("assembled");
        let (kkt, kkt_b) = stepper.assembled(Form::Kkt).expect("assembled");
        let x = reference_solution(&kkt, &kkt_b).expect("regular");
        assert!(whole(&kkt, &kkt_b, &x).backward_error < 2e-16);
        let bodies = body_rows(&kkt);
        let p = kkt.pattern();
        let rows = (0..p.blocks()).filter(|&i| !bodies[i]);
        let mut mu: Vec<f64> = rows.flat_map(|i| p.rows(i)).map(|r| -x[r]).collect();
        let exact = verify(&s, &b, (&kkt, &kkt_b), &mu);
        assert!(exact.backward_error < 2e-16, "{exact:?}");
        // S (1 + δ) μ − b = δ b.
        mu.iter_mut().for_each(|mu| *mu *= 1.0 + 1e-6);
        let wrong = verify(&s, &b, (&kkt, &kkt_b), &mu);
        assert!((wrong.residual / 1e-6 - 1.0).abs() < 1e-2, "{wrong:?}");
        assert!(verify(&s, &b, (&kkt, &kkt_b), &mu[1..]).residual.is_nan());
    }
}
