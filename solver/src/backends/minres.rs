//! MINRES for symmetric matrices of any signs (Paige and Saunders, *Solution of Sparse Indefinite Systems of Linear
//! Equations*, 1975), preconditioned (Elman, Silvester and Wathen, *Finite Elements and Fast Iterative Solvers*, algorithm
//! 4.1) by P, the diagonal blocks of M and of the Schur complement (`preconditioner`).
//!
//! Lanczos vectors of A in the inner product of P⁻¹, from γ₁ v₁ = r₀ on,
//!
//! ```text
//! γₖ₊₁ vₖ₊₁ = A zₖ − δₖ vₖ − γₖ vₖ₋₁      zₖ = P⁻¹ vₖ      δₖ = zₖᵀ A zₖ      zₖᵀ vₖ = 1
//! ```
//!
//! make A a tridiagonal matrix T of δ and γ. Givens rotations make T triangular column by column, so that short recurrences
//! carry the x of x₀ + span(z₁ … zₖ) whose residual is the least in the norm of P⁻¹. Where conjugate gradient breaks down at
//! a direction without curvature, MINRES does not. The residual itself follows from the rotations, sin² rₖ₋₁ less a
//! multiple of vₖ₊₁, so that the recurrence knows the 2-norm that the tolerance is for; convergence is claimed of the true
//! residual alone (`iteration`).
//!
//! On the KKT matrix of a cable it takes twice the iterations of `cg:jacobi` on S, with a product each: 102 against 50 to an
//! error of 10⁻⁶ or 10⁻¹⁰ in the multipliers of 24 segments at ratios 10⁵ and 10⁶, 366 against 178 to 10⁻¹⁰ on a ring, 110
//! against 52 on a net of 8 × 8 nodes; `cg:group` takes 5, 14 and 6, `gauss-seidel:groups` thousands, 4059 and 4. So it wins on
//! none of these, and is for indefinite systems that have no S. What it stalls at is less than on S, which has lost digits
//! in its forming: errors of 10⁻¹⁵ at ratio 10⁶.
//!
//! For a singular A it finds a solution if one exists. Otherwise it ends at a residual r with A P⁻¹
//! r = 0 and reports that A is singular (the test of Choi, Paige and Saunders, *MINRES-QLP: A
//! Krylov Subspace Method for Indefinite or Singular Symmetric Systems*, 2011; the x of least norm
//! that MINRES-QLP finds then solves nothing).

mod preconditioner;

use super::check_solution;
use super::iteration::{self, Krylov, LEAST_NORM, check_norm, largest_block};
use crate::matrix::check_finite;
use crate::options::check_iteration;
use crate::slices::dot;
use crate::{AnalyzeReport, BlockPattern, FactorReport, LinearSolver, MinresOptions, Phases};
use crate::{SolveError, SolveReport, Status, SymBlockMatrix};
use preconditioner::DiagonalBlocks;
use std::sync::Arc;

/// ‖A z‖ below this part of ‖A‖ ‖z‖ is rounding of the Lanczos vectors: z is a null vector for all that can be told.
const NULL: f64 = 1e-12;

/// Iterations after which a residual that still stands ends the method, at the least: in exact arithmetic it stands no
/// longer than there are rows.
const WINDOW: usize = 64;

/// Part of the residual that stands, counted as no progress.
const STANDING: f64 = 0.99;

/// The `minres` backend.
pub(crate) struct Minres {
    options: MinresOptions,
    phases: Phases,
    plan: Option<DiagonalBlocks>,
    vectors: Vectors,
}

/// All of length `dim`. Of `v` and `w` the last one comes first.
#[derive(Default)]
struct Vectors {
    zero: Vec<f64>,
    /// Residual.
    r: Vec<f64>,
    /// Lanczos vectors γ v.
    v: [Vec<f64>; 2],
    /// P⁻¹ times the last one.
    z: Vec<f64>,
    /// −A z.
    az: Vec<f64>,
    /// Directions.
    w: [Vec<f64>; 2],
}

impl Minres {
    pub(crate) fn new(options: MinresOptions) -> Result<Self, SolveError> {
        check_iteration(options.iterations, options.tolerance)?;
        Ok(Self {
            options,
            phases: Phases::default(),
            plan: None,
            vectors: Vectors::default(),
        })
    }
}

impl LinearSolver for Minres {
    fn name(&self) -> &'static str {
        "minres"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let plan = DiagonalBlocks::new(pattern)?;
        let zeros = || vec![0.0; pattern.dim()];
        self.vectors = Vectors {
            zero: zeros(),
            r: zeros(),
            v: [zeros(), zeros()],
            z: zeros(),
            az: zeros(),
            w: [zeros(), zeros()],
        };
        self.phases.analyzed(pattern);
        let factor_entries = Some(plan.factor_values());
        self.plan = Some(plan);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        if let Some(plan) = &mut self.plan {
            plan.factorize(a);
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
        let Some(plan) = &self.plan else {
            return Err(SolveError::OutOfOrder {
                called: "solve",
                needs: "analyze",
            });
        };
        let Some(scale) = iteration::begin(a.pattern(), b, x)? else {
            return Ok(SolveReport::ZERO);
        };
        check_finite(a.pattern(), "guess", x)?;
        let MinresOptions {
            tolerance,
            iterations,
        } = self.options;
        let v = &mut self.vectors;
        let mut run = Run {
            a,
            b,
            x,
            plan,
            v,
            size: 1.0,
        };
        let report = iteration::run(&mut run, scale, tolerance, iterations)?;
        check_solution(a, run.x)?;
        if report.status == Status::Stalled && scale >= LEAST_NORM {
            run.check_range()?;
        }
        Ok(report)
    }
}

/// The iteration on a system.
struct Run<'a> {
    a: &'a SymBlockMatrix,
    b: &'a [f64],
    x: &'a mut [f64],
    plan: &'a DiagonalBlocks,
    v: &'a mut Vectors,
    /// Norm of T so far, which stands for A scaled by P: its diagonal blocks are about 1.
    size: f64,
}

impl Krylov for Run<'_> {
    fn residual(&mut self) -> Result<f64, SolveError> {
        let r = &mut self.v.r;
        self.a.subtract_product(self.b, self.x, r);
        let norm = dot(r, r).sqrt();
        check_norm(self.a.pattern(), norm, self.x, r)?;
        Ok(norm)
    }

    fn iterate(&mut self, target: f64, limit: usize) -> Result<usize, SolveError> {
        let Vectors { r, v, w, .. } = &mut *self.v;
        v[0].copy_from_slice(r);
        v[1].fill(0.0);
        w.iter_mut().for_each(|w| w.fill(0.0));
        let mut gamma = self.precondition();
        let (mut gamma_before, mut norm) = (1.0, gamma);
        // Cosines and sines of the last two rotations, the last first.
        let (mut c, mut s) = ([1.0; 2], [0.0; 2]);
        let (mut look, mut seen) = (WINDOW.max(self.b.len()), f64::INFINITY);
        for iteration in 1..=limit {
            if !(gamma > 0.0 && gamma.is_finite()) {
                // Where z overflows, so does the solution.
                check_finite(self.a.pattern(), "solution", &self.v.z)?;
                return Ok(iteration - 1);
            }
            let delta = self.product(1.0 / gamma);
            self.next_vector(delta / gamma, gamma / gamma_before);
            gamma_before = gamma;
            let below = s[1] * gamma;
            let beside = s[0] * delta + c[0] * c[1] * gamma;
            let partial = c[0] * delta - s[0] * c[1] * gamma;
            // z is needed for the direction before the next one replaces it.
            self.next_direction(below, beside);
            gamma = self.precondition();
            self.size = self.size.hypot(delta).hypot(gamma);
            let length = partial.hypot(gamma);
            // ‖A r‖ / ‖r‖ of the residual so far: of what A takes to zero nothing is left to find.
            let effect = partial.hypot(c[0] * gamma);
            if !(effect > NULL * self.size && length.is_finite()) {
                return Ok(iteration);
            }
            (c, s) = ([partial / length, c[0]], [gamma / length, s[0]]);
            let square = self.step(length, c[0] * norm, s[0]);
            norm *= -s[0];
            let standing = iteration == look && norm.abs() > STANDING * seen;
            if !(square.is_finite() && square.sqrt() > target) || standing {
                return Ok(iteration);
            }
            if iteration == look {
                (look, seen) = (2 * look, norm.abs());
            }
        }
        Ok(limit)
    }
}

impl Run<'_> {
    /// Fails where A takes P⁻¹ r to zero: b is then beyond its range.
    fn check_range(&mut self) -> Result<(), SolveError> {
        self.residual()?;
        let Vectors { r, v, .. } = &mut *self.v;
        v[0].copy_from_slice(r);
        let gamma = self.precondition();
        let block = largest_block(self.a.pattern(), &self.v.z);
        let delta = self.product(1.0 / gamma);
        self.next_vector(delta / gamma, 0.0);
        let effect = delta.hypot(self.precondition());
        if effect <= NULL * self.size {
            return Err(SolveError::Singular { block });
        }
        Ok(())
    }

    /// z = P⁻¹ v; √(zᵀ v).
    fn precondition(&mut self) -> f64 {
        let Vectors { v, z, .. } = &mut *self.v;
        self.plan.solve(&v[0], z);
        dot(z, &v[0]).max(0.0).sqrt()
    }

    /// z ← s z, and −A z; zᵀ A z.
    fn product(&mut self, s: f64) -> f64 {
        let Vectors { zero, z, az, .. } = &mut *self.v;
        z.iter_mut().for_each(|z| *z *= s);
        self.a.subtract_product(zero, z, az);
        -dot(z, az)
    }

    /// The next Lanczos vector: A z less multiples of the last one and of the one before.
    fn next_vector(&mut self, last: f64, before: f64) {
        let Vectors {
            az, v: [v, next], ..
        } = &mut *self.v;
        for ((next, v), az) in next.iter_mut().zip(&*v).zip(&*az) {
            *next = -az - last * v - before * *next;
        }
        self.v.v.swap(0, 1);
    }

    /// The next direction, not scaled: z less multiples of the one before and of the last one.
    fn next_direction(&mut self, before: f64, last: f64) {
        let Vectors {
            z, w: [w, next], ..
        } = &mut *self.v;
        for ((next, w), z) in next.iter_mut().zip(&*w).zip(&*z) {
            *next = z - before * *next - last * w;
        }
        self.v.w.swap(0, 1);
    }

    /// Divides the direction by `length`, takes `step` along it, and turns the residual by the sine s; rᵀ r.
    fn step(&mut self, length: f64, step: f64, s: f64) -> f64 {
        let Vectors {
            r,
            v: [v, _],
            w: [w, _],
            ..
        } = &mut *self.v;
        for (w, x) in w.iter_mut().zip(&mut *self.x) {
            *w /= length;
            *x += step * *w;
        }
        let (s, step) = (s * s, step / length);
        for (r, v) in r.iter_mut().zip(v) {
            *r = s * *r - step * *v;
        }
        dot(r, r)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;

    fn minres(tolerance: f64) -> Minres {
        Minres::new(MinresOptions {
            tolerance,
            ..MinresOptions::default()
        })
        .expect("sound options")
    }

    fn side(n: usize) -> Vec<f64> {
        (0..n).map(|i| (i as f64).cos()).collect()
    }

    fn solved(
        solver: &mut Minres,
        a: &SymBlockMatrix,
        b: &[f64],
    ) -> Result<(Vec<f64>, SolveReport), SolveError> {
        let mut x = vec![0.0; b.len()];
        solver.analyze(a.pattern())?;
        solver.factorize(a)?;
        let report = solver.solve(a, b, &mut x)?;
        Ok((x, report))
    }

    #[test]
    fn what_is_claimed_has_the_true_residual_of_the_tolerance() {
        for pattern in testing::patterns() {
            for seed in 1..5 {
                for a in [
                    testing::quasi_definite(&pattern, seed),
                    testing::positive_definite(&pattern, seed),
                ] {
                    let b = side(a.dim());
                    let (x, report) = solved(&mut minres(1e-10), &a, &b).expect("solvable");
                    assert_eq!(report.status, Status::Converged, "{report:?} {pattern:?}");
                    let rest = crate::residual(&a, &b, &x).expect("finite");
                    let rest = dot(&rest, &rest).sqrt() / dot(&b, &b).sqrt();
                    // Two roundings of the same sums.
                    assert!(rest <= 1.0001e-10, "{rest:e}");
                }
            }
        }
    }

    /// [M Jᵀ; J 0] with one constraint, whose Schur complement the preconditioner holds: the eigenvalues are 1 and
    /// (1 ± √5)/2 (Murphy, Golub and Wathen, *A Note on Preconditioning for Indefinite Linear Systems*, 2000).
    #[test]
    fn with_the_whole_schur_complement_three_iterations_are_enough() {
        let pattern = Arc::new(BlockPattern::new(&[6, 5, 3], &[(0, 1), (1, 2)]).expect("sound"));
        let mut a = testing::positive_definite(&pattern, 4);
        a.block_mut(pattern.column(1).start).fill(0.0);
        let (_, report) = solved(&mut minres(1e-12), &a, &side(14)).expect("solvable");
        assert_eq!((report.status, report.iterations), (Status::Converged, 3));
    }

    #[test]
    fn a_good_guess_saves_iterations() {
        let pattern = &testing::patterns()[0];
        let a = testing::quasi_definite(pattern, 2);
        let (b, mut solver) = (side(a.dim()), minres(1e-10));
        let (mut x, first) = solved(&mut solver, &a, &b).expect("solvable");
        let again = solver.solve(&a, &b, &mut x).expect("solvable");
        assert_eq!((again.status, again.iterations), (Status::Converged, 0));
        x.iter_mut().for_each(|x| *x *= 1.0 + 1e-7);
        let near = solver.solve(&a, &b, &mut x).expect("solvable");
        assert!(near.status == Status::Converged && near.iterations < first.iterations);
    }

    /// Springs in a ring that nothing holds, beside −1: the null vector is 1 on the ring.
    #[test]
    fn a_singular_system_is_solved_where_it_can_be_and_else_named() {
        let n = 12;
        let mut ends: Vec<_> = (0..n).map(|i| ((i + 1) % n, i)).collect();
        ends.push((n, n - 1));
        let pattern = Arc::new(BlockPattern::new(&vec![1; n + 1], &ends).expect("sound"));
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        a.values_mut().fill(-0.7);
        for j in 0..n {
            a.block_mut(pattern.column(j).start)[0] = 1.4;
        }
        a.block_mut(pattern.column(n).start)[0] = -1.0;
        a.block_mut(pattern.find(n, n - 1).expect("stored"))[0] = 0.0;
        let mut balanced = side(n + 1);
        balanced[0] -= balanced[..n].iter().sum::<f64>();
        let mut unbalanced = balanced.clone();
        unbalanced[5] += 1.0;
        let null = [vec![1.0; n], vec![0.0]].concat();
        let (_, report) = solved(&mut minres(1e-12), &a, &balanced).expect("solvable");
        assert_eq!(report.status, Status::Converged);
        for b in [unbalanced, null] {
            for scale in [1.0, 1e100, 1e-100] {
                let b: Vec<f64> = b.iter().map(|b| b * scale).collect();
                let mut long = minres(1e-12);
                long.options.iterations = 1_000_000;
                let found = solved(&mut long, &a, &b);
                let singular = matches!(found, Err(SolveError::Singular { .. }));
                assert!(singular, "{scale:e}: {found:?}");
            }
        }
    }
}
