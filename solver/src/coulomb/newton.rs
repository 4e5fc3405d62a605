//! Semismooth Newton on Coulomb's law itself.
//!
//! With p = x − u, contact by contact: open where p_N ≤ 0, sticking where |p_T| ≤ μ p_N, else sliding along t = p_T/|p_T|.
//! The law's linearisation is x = 0; u = 0; or u_N = 0, x_t = μ x_N and across the slip s ⟂ t
//!   u_s + γ x_s = 0, γ = |p_T| / (μ p_N) − 1:
//! the slip turns with the impulse, and no right-hand side remains since p_s = 0.
//!
//! [`Steps::Full`] ones are the fastest where they converge. [`Steps::Searched`] ones are shortened until the sum of the
//! squared residuals falls, or else to where it is least: heaps on which full steps cycle are solved in about 25.

use super::scaled::{Scaled, Three, three, violation};
use super::step::Step;

/// How far a step goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Steps {
    /// All the way.
    Full,
    /// As far as a line search says.
    Searched,
}

impl Steps {
    /// Most factorisations, and how many in a row may bring no better iterate.
    fn patience(self) -> (usize, usize) {
        match self {
            Self::Full => (25, 6),
            Self::Searched => (200, 40),
        }
    }
}

/// Factor by which a step is shortened at a time, and how often at most.
const SHORTER: (f64, usize) = (0.7, 10);

/// Residual below which no better one is sought.
pub(super) const CLOSE: f64 = 1e-13;

/// Part of the largest rate by which a contact at the start may seem to open and still counts as closed.
const SLACK: f64 = 1e-9;

/// The iterate and its velocities, and those that the step began at, of length 3n.
#[derive(Debug, Default)]
pub(super) struct Newton {
    x: Vec<f64>,
    u: Vec<f64>,
    begin: [Vec<f64>; 2],
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
        steps: Steps,
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
        let (most, patience) = steps.patience();
        while best.residual > CLOSE && pivots < most && idle < patience {
            self.linearise(problem, step, extra, slack);
            slack = 0.0;
            pivots += 1;
            if steps == Steps::Searched {
                let now = [&self.x, &self.u];
                self.begin
                    .iter_mut()
                    .zip(now)
                    .for_each(|(to, v)| to.clone_from(v));
            }
            if !step.solve(problem, |i| three(&problem.rates, i), &mut self.x) {
                break;
            }
            let mut residual = self.residual(problem, extra);
            if steps == Steps::Searched && self.shorten(problem) {
                residual = self.residual(problem, extra);
            }
            idle = if residual < 0.9 * least { 0 } else { idle + 1 };
            least = least.min(residual);
            best.offer(&self.x, residual);
        }
        pivots
    }

    /// Goes back along the step, to the first part of it that lessens the sum of squared residuals. Where none does, to the
    /// one with the least. Whether it went back.
    fn shorten(&mut self, problem: &Scaled) -> bool {
        let [x, u] = &self.begin;
        let merit = |part: f64| -> f64 {
            let along = |begin: &[f64], end: &[f64], i: usize| -> Three {
                let (begin, end) = (three(begin, i), three(end, i));
                [0, 1, 2].map(|k| begin[k] + part * (end[k] - begin[k]))
            };
            let squares =
                problem.friction.iter().enumerate().map(|(i, &mu)| {
                    violation(along(x, &self.x, i), along(u, &self.u, i), mu).powi(2)
                });
            squares.sum()
        };
        let before = merit(0.0);
        let (mut least, mut best, mut part) = (merit(1.0), 1.0, 1.0);
        for _ in 0..SHORTER.1 {
            if least < before {
                break;
            }
            part *= SHORTER.0;
            let value = merit(part);
            if value < least {
                (least, best) = (value, part);
            }
        }
        for (to, begin) in self.x.iter_mut().zip(x) {
            *to = begin + best * (*to - begin);
        }
        best < 1.0
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
