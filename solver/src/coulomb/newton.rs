//! Semismooth Newton on Coulomb's law itself.
//!
//! With p = x − u, contact by contact: open where p_N ≤ 0, sticking where |p_T| ≤ μ p_N, else sliding along t = p_T/|p_T|.
//! The law's linearisation is x = 0; u = 0; or u_N = 0, x_t = μ x_N and across the slip s ⟂ t
//!   u_s + γ x_s = 0, γ = |p_T| / (μ p_N) − 1:
//! the slip turns with the impulse, and no right-hand side remains since p_s = 0.
//!
//! Steps are full ones, and where they cycle that is left to the continuation.

use super::scaled::{Scaled, three};
use super::step::Step;

/// Most factorisations.
const MOST: usize = 25;

/// Factorisations in a row that bring no better iterate, after which it cycles.
const PATIENCE: usize = 6;

/// Residual below which no better one is sought.
const CLOSE: f64 = 1e-13;

/// Part of the largest rate by which a contact at the start may seem to open and still counts as closed.
const SLACK: f64 = 1e-9;

/// The iterate and its velocities, of length 3n.
#[derive(Debug, Default)]
pub(super) struct Newton {
    x: Vec<f64>,
    u: Vec<f64>,
}

/// The best iterate yet.
#[derive(Debug, Default)]
pub(super) struct Best {
    pub(super) x: Vec<f64>,
    pub(super) residual: f64,
}

impl Best {
    /// Begins with `x`, of which nothing is known.
    pub(super) fn begin(&mut self, x: &[f64]) {
        self.x.clear();
        self.x.extend_from_slice(x);
        self.residual = f64::INFINITY;
    }

    /// Takes an iterate that is better.
    pub(super) fn offer(&mut self, x: &[f64], residual: f64) {
        if residual < self.residual {
            self.residual = residual;
            self.x.copy_from_slice(x);
        }
    }
}

impl Newton {
    /// Iterates from `start` on the problem with `extra` more of scaled regularisation, and offers all iterates to `best`.
    /// Returns the factorisations made.
    pub(super) fn run(
        &mut self,
        problem: &Scaled,
        step: &mut Step,
        (start, extra): (&[f64], f64),
        best: &mut Best,
    ) -> usize {
        self.x.clear();
        self.x.extend_from_slice(start);
        self.u.resize(start.len(), 0.0);
        problem.admit(&mut self.x);
        let residual = self.residual(problem, extra);
        best.offer(&self.x, residual);
        // Contacts at rest count as closed until something is known of them.
        let fastest = problem.rates.iter().fold(0.0, |m: f64, q| m.max(q.abs()));
        let mut slack = SLACK * fastest;
        let (mut pivots, mut idle, mut least) = (0, 0, f64::INFINITY);
        while best.residual > CLOSE && pivots < MOST && idle < PATIENCE {
            self.linearise(problem, step, extra, slack);
            slack = 0.0;
            pivots += 1;
            if !step.solve(problem, |i| three(&problem.rates, i), &mut self.x) {
                break;
            }
            let residual = self.residual(problem, extra);
            idle = if residual < 0.9 * least { 0 } else { idle + 1 };
            least = least.min(residual);
            best.offer(&self.x, residual);
        }
        pivots
    }

    /// The velocities at x, and the residual.
    fn residual(&mut self, problem: &Scaled, extra: f64) -> f64 {
        problem.velocities(&self.x, &mut self.u);
        for (u, x) in self.u.iter_mut().zip(&self.x) {
            *u += extra * x;
        }
        problem.complementarity(&self.x, &self.u)
    }

    /// The unknowns of the step at x.
    fn linearise(&self, problem: &Scaled, step: &mut Step, extra: f64, slack: f64) {
        step.clear();
        for i in 0..problem.n {
            let (x, u, mu) = (three(&self.x, i), three(&self.u, i), problem.friction[i]);
            let p = [x[0] - u[0], x[1] - u[1], x[2] - u[2]];
            if p[0] <= -slack {
                continue;
            }
            let length = p[1].hypot(p[2]);
            if length <= mu * p[0].max(slack) && mu > 0.0 {
                step.stick(i, extra);
                continue;
            }
            let t = direction(p, length);
            // Without friction nothing acts across: the compliance is infinite, or 0/0.
            let across = length / (mu * p[0].max(0.0)) - 1.0;
            let ray = [1.0, mu * t.0, mu * t.1];
            step.slide(i, (ray, extra), [1.0, 0.0, 0.0], t, across + extra);
        }
    }
}

/// The direction of a tangential part of that length.
pub(super) fn direction(v: [f64; 3], length: f64) -> (f64, f64) {
    if length > 0.0 {
        (v[1] / length, v[2] / length)
    } else {
        (1.0, 0.0)
    }
}
