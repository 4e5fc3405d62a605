//! Products with S = J M̃⁻¹ Jᵀ + Σ from its pieces, for backends that need no more of it than these and what their
//! preconditioner factorises.
//!
//! Of a joint they read its levers and gradients and the inertia of its bodies, a quarter of what its blocks of S are. M̃
//! is block diagonal, geometric stiffness and ballast included, and rows at their bounds have left J and stand in Σ, so
//! that this is the same S in every case, to rounding.

use crate::pieces::Pieces;
use crate::plan::Plan;
use crate::products::{add_transposed, times_jacobian};
use crate::six::Six;
use taut_model::Scene;
use taut_solver::{Backend, LinearSolver, SolveError, SolveReport, SymBlockMatrix};

/// Room for products, and for refinements with them.
pub(crate) struct MatrixFree {
    /// Multipliers and what comes of them in the order of the scene's rows.
    mu: Vec<f64>,
    rates: Vec<f64>,
    /// Jᵀ μ, then M̃⁻¹ Jᵀ μ.
    bodies: Six,
    residual: Vec<f64>,
    correction: Vec<f64>,
}

impl MatrixFree {
    /// For the backend, if it wants products. Allocates all that is needed.
    pub(crate) fn new(backend: &Backend, pieces: &Pieces) -> Option<Self> {
        let rows = pieces.rows.rows();
        let zeros = || vec![0.0; rows];
        backend.is_matrix_free().then(|| Self {
            mu: zeros(),
            rates: zeros(),
            bodies: pieces.v.clone(),
            residual: zeros(),
            correction: zeros(),
        })
    }

    /// y = S x.
    fn product(&mut self, plan: &Plan, pieces: &Pieces, x: &[f64], y: &mut [f64]) {
        let Pieces {
            rows,
            inertia,
            regularization,
            ..
        } = pieces;
        let Self {
            mu, rates, bodies, ..
        } = self;
        plan.scatter_multipliers(rows, x, 1.0, mu);
        bodies.clear();
        add_transposed(rows, mu, bodies);
        inertia.divide(bodies);
        times_jacobian(rows, bodies, rates);
        let weighted = regularization.sigma.iter().zip(&*mu);
        for (rate, (sigma, mu)) in rates.iter_mut().zip(weighted) {
            *rate += sigma * mu;
        }
        plan.gather(rows, None, rates, 1.0, y);
    }

    /// Solves S x = b.
    pub(crate) fn solve(
        &mut self,
        solver: &mut dyn LinearSolver,
        (plan, pieces): (&Plan, &Pieces),
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let mut product = |x: &[f64], y: &mut [f64]| self.product(plan, pieces, x, y);
        solver.solve_with(&mut product, a, b, x)
    }

    /// Improves x as [`taut_solver::refine`] does, with the residual of the pieces; the report of the last one, with the
    /// iterations of all.
    pub(crate) fn refine(
        &mut self,
        solver: &mut dyn LinearSolver,
        (plan, pieces): (&Plan, &mut Pieces),
        a: &SymBlockMatrix,
        x: &mut [f64],
        sweeps: usize,
    ) -> Result<Option<SolveReport>, SolveError> {
        let mut last: Option<SolveReport> = None;
        for _ in 0..sweeps {
            plan.scatter_multipliers(&pieces.rows, x, 1.0, &mut self.mu);
            pieces.residual(&self.mu, &mut self.rates);
            let mut residual = std::mem::take(&mut self.residual);
            let mut correction = std::mem::take(&mut self.correction);
            plan.gather(&pieces.rows, None, &self.rates, 1.0, &mut residual);
            correction.fill(0.0);
            let solved = self.solve(solver, (plan, pieces), a, &residual, &mut correction);
            if solved.is_ok() {
                for (x, d) in x.iter_mut().zip(&correction) {
                    *x += d;
                }
            }
            (self.residual, self.correction) = (residual, correction);
            let mut report = solved?;
            report.iterations += last.map_or(0, |r| r.iterations);
            last = Some(report);
        }
        Ok(last)
    }
}

/// Which blocks of S the backend reads, by their constraints.
pub(crate) fn kept<'a>(
    backend: &'a Backend,
    scene: &'a Scene,
) -> impl Fn(usize, usize) -> bool + 'a {
    let grouped = |c: usize| (c, scene.groups[c]);
    move |a, b| !backend.is_matrix_free() || backend.factorizes(grouped(a), grouped(b))
}

#[cfg(all(test, feature = "cg"))]
mod tests {
    use crate::{Form, StepOptions, Stepper};
    use taut_model::{HoistParams, Scene};

    fn stepper(scene: &Scene, backend: &str) -> Stepper {
        let options = StepOptions {
            backend: backend.parse().unwrap(),
            refinements: 0,
            guard: None,
            ..StepOptions::default()
        };
        Stepper::new(scene.clone(), options).unwrap()
    }

    fn scenes() -> Vec<Scene> {
        let params = HoistParams {
            segments: 9,
            mass_ratio: 100.0,
            initial_angle: 0.4,
            seed: 3,
            ..HoistParams::default()
        };
        let mut scenes = vec![params.build().unwrap()];
        scenes.extend(
            taut_model::named::NAMES
                .iter()
                .map(|name| taut_model::named(name).unwrap()),
        );
        scenes
    }

    /// With geometric stiffness in M̃, transverse rows, bounded rows at their bounds, several cables: S x by the pieces is
    /// that by the entries, to rounding.
    #[test]
    fn products_are_those_of_the_assembled_matrix() {
        for scene in scenes() {
            let mut stepper = stepper(&scene, "cg:jacobi:matrix-free:tolerance=1e-8");
            if stepper.plan.pattern.dim() > 3000 {
                continue;
            }
            for _ in 0..3 {
                stepper.step().unwrap();
            }
            stepper.solve().unwrap();
            let (a, _) = stepper.assembled(Form::Schur).unwrap();
            let x: Vec<f64> = (0..a.dim()).map(|i| (i as f64 * 0.7).sin()).collect();
            let mut magnitude = vec![0.0; a.dim()];
            let mut exact = vec![0.0; a.dim()];
            a.for_each_lower(|r, c, value| {
                exact[r] += value * x[c];
                magnitude[r] += (value * x[c]).abs();
                if r != c {
                    exact[c] += value * x[r];
                    magnitude[c] += (value * x[r]).abs();
                }
            });
            let Stepper {
                bounded,
                pieces,
                plan,
                matrix_free,
                mu_dt,
                ..
            } = &mut stepper;
            bounded.hold(pieces, *mu_dt);
            let mut y = vec![f64::NAN; a.dim()];
            let free = matrix_free.as_mut().unwrap();
            free.product(plan, pieces, &x, &mut y);
            bounded.release(pieces);
            let largest = magnitude.iter().fold(0.0, |m: f64, x| m.max(*x));
            for (r, (y, exact)) in y.iter().zip(&exact).enumerate() {
                let error = (y - exact).abs();
                assert!(
                    error <= 1e-13 * largest,
                    "{}, row {r}: {error:e} of {largest:e}",
                    scene.name
                );
            }
        }
    }

    /// Of S the preconditioner's blocks are there alone, and the motion is that with all of it.
    #[test]
    fn steps_are_those_with_the_matrix() {
        for scene in scenes().into_iter().take(1) {
            for preconditioner in ["none", "jacobi", "group"] {
                let backend = format!("cg:{preconditioner}:tolerance=1e-13:iterations=3000");
                let mut assembled = stepper(&scene, &backend);
                let mut free = stepper(&scene, &format!("{backend}:matrix-free"));
                let stored = |s: &Stepper| s.system().0.pattern().stored_blocks();
                assert!(stored(&free) < stored(&assembled), "{preconditioner}");
                assert_eq!(stored(&free) == 10, preconditioner != "group");
                for _ in 0..20 {
                    assembled.step().unwrap();
                    free.step().unwrap();
                }
                let places = |s: &Stepper| s.scene().bodies.position.clone();
                for (a, b) in places(&assembled).iter().zip(places(&free)) {
                    assert!((a - b).norm() < 1e-8, "{preconditioner}: {a} {b}");
                }
                let mut exact = stepper(&scene, "dense:extended");
                let refined = StepOptions {
                    refinements: 2,
                    ..free.options().clone()
                };
                let mut refined = Stepper::new(scene.clone(), refined).unwrap();
                exact.step().unwrap();
                refined.step().unwrap();
                let error = taut_solver::forward_error(refined.multipliers(), exact.multipliers());
                assert!(error < 1e-9, "{preconditioner}: {error:e}");
            }
        }
    }

    /// An iteration starts from the last step's multipliers unless it is told not to, and is the shorter for it.
    #[test]
    fn a_warm_start_is_the_default_and_saves_iterations() {
        let scene = scenes().remove(0);
        for backend in [
            "cg:jacobi:tolerance=1e-6",
            "cg:jacobi:matrix-free:tolerance=1e-6",
        ] {
            assert!(StepOptions::default().warm_start);
            let mut warm = stepper(&scene, backend);
            let options = StepOptions {
                warm_start: false,
                ..warm.options().clone()
            };
            let mut cold = Stepper::new(scene.clone(), options).unwrap();
            let mut iterations = [0, 0];
            for _ in 0..30 {
                iterations[0] += warm.step().unwrap().iterations;
                iterations[1] += cold.step().unwrap().iterations;
            }
            println!(
                "{backend}: {} warm, {} cold, 30 steps",
                iterations[0], iterations[1]
            );
            assert!(iterations[0] < iterations[1], "{backend}: {iterations:?}");
        }
    }
}
