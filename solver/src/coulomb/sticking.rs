//! Newton on the contacts that may slide or open, with those that stick eliminated.
//!
//! Most contacts of things at rest stick, far from the rims of their cones, and do so in all iterations. With W in blocks of
//! them, S, and of the others, N, u_S = 0 leaves
//!   u_N = (W_NN − W_NS W_SS⁻¹ W_SN) x_N + q_N − W_NS W_SS⁻¹ q_S:
//! a problem like the whole, but small, for one elimination of W_SS. Its solution is that of the whole if S sticks then, too;
//! what does not becomes a part of N, and the elimination is made anew.

use super::newton::{Best, CLOSE, Newton, Steps};
use super::scaled::{Scaled, three};
use super::step::Step;

/// Least contacts for which that pays, and the largest part of them in N.
const LEAST: usize = 16;
const PART: f64 = 0.8;

/// Part of the largest friction from which on a contact may slide.
const NEAR: f64 = 0.98;

/// Most eliminations of W_SS.
const ROUNDS: usize = 4;

/// The contacts, those that stick first, and the problem of the others.
#[derive(Debug, Default)]
pub(super) struct Sticking {
    order: Vec<usize>,
    /// True for each contact of N.
    moves: Vec<bool>,
    /// The problem of N, what its steps work in, its start, and its best impulses.
    rest: Scaled,
    step: Step,
    start: Vec<f64>,
    best: Best,
    /// Impulses of the whole and their velocities, of length 3n.
    x: Vec<f64>,
    u: Vec<f64>,
}

impl Sticking {
    /// Iterates from `start` and offers what it finds to `best`. Returns the factorisations made.
    pub(super) fn run(
        &mut self,
        problem: &Scaled,
        step: &mut Step,
        newton: &mut Newton,
        start: &[f64],
        best: &mut Best,
    ) -> usize {
        if problem.n < LEAST {
            return 0;
        }
        self.x.clear();
        self.x.extend_from_slice(start);
        problem.admit(&mut self.x);
        self.u.resize(start.len(), 0.0);
        self.moves.clear();
        self.moves.resize(problem.n, false);
        let mut pivots = 0;
        for round in 0..=ROUNDS {
            problem.velocities(&self.x, &mut self.u);
            best.offer(&self.x, problem.complementarity(&self.x, &self.u));
            if best.residual <= CLOSE || round == ROUNDS {
                break;
            }
            let Some(leading) = self.divide(problem) else {
                break;
            };
            pivots += 1;
            if !step.lead(problem, &self.order, leading, &mut self.rest) {
                break;
            }
            self.begin_rest(problem, leading);
            let (start, best) = ((&self.start[..], 0.0), &mut self.best);
            pivots += newton.run(&self.rest, &mut self.step, start, Steps::Full, best);
            if !step.follow(&self.order, &self.best.x, &mut self.x) {
                break;
            }
        }
        pivots
    }

    /// Puts the contacts in order, those that stick first, and counts these; `None` where they are too few.
    fn divide(&mut self, problem: &Scaled) -> Option<usize> {
        for (i, moves) in self.moves.iter_mut().enumerate() {
            let (x, u) = (three(&self.x, i), three(&self.u, i));
            let p = [x[0] - u[0], x[1] - u[1], x[2] - u[2]];
            let sticks = p[1].hypot(p[2]) < NEAR * problem.friction[i] * p[0];
            *moves |= !sticks;
        }
        self.order.clear();
        let of = |moves: bool| {
            let contacts = self.moves.iter().enumerate();
            contacts.filter(move |(_, m)| **m == moves).map(|(i, _)| i)
        };
        self.order.extend(of(false));
        let leading = self.order.len();
        self.order.extend(of(true));
        let most = PART * problem.n as f64;
        ((problem.n - leading) as f64 <= most).then_some(leading)
    }

    /// Copies friction, regularisation, roots and impulses of the contacts of N into their problem
    /// and its start.
    fn begin_rest(&mut self, problem: &Scaled, leading: usize) {
        let (rest, others) = (&mut self.rest, &self.order[leading..]);
        rest.n = others.len();
        for (to, from) in [
            (&mut rest.friction, &problem.friction),
            (&mut rest.regularization, &problem.regularization),
            (&mut rest.root, &problem.root),
        ] {
            to.clear();
            to.extend(others.iter().map(|i| from[*i]));
        }
        self.start.clear();
        let x = &self.x;
        self.start.extend(others.iter().flat_map(|i| three(x, *i)));
        self.best.begin(&self.start);
    }
}
