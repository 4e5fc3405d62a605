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

    /// Improves x as [`taut_solver::refine`] does, with the residual of the pieces; the iterations made.
    pub(crate) fn refine(
        &mut self,
        solver: &mut dyn LinearSolver,
        (plan, pieces): (&Plan, &mut Pieces),
        a: &SymBlockMatrix,
        x: &mut [f64],
        sweeps: usize,
    ) -> Result<usize, SolveError> {
        let mut iterations = 0;
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
            iterations += solved?.iterations;
        }
        Ok(iterations)
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
