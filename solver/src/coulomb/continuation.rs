//! Continuation in the regularisation where Newton's method stalls: it starts large and is reduced.
//!
//! The scaled operator plus δ I has a condition of about 1/δ, so contacts that repeat each other no longer decide which of
//! them is active. At each δ the convex problem for the slips of the last solution gives a start from which Newton solves
//! Coulomb's law; where it does not, the slips are updated. Where that fails too, δ falls by a smaller factor.

use super::convex::Convex;
use super::newton::{Best, Newton, Steps};
use super::scaled::Scaled;
use super::step::Step;

/// The first δ, in units of the scaled diagonal.
const FIRST: f64 = 1.0;

/// The factor by which δ falls, at most, and at least before it is given up.
const FACTORS: (f64, f64) = (0.01, 0.8);

/// Part of the least regularisation below which δ is none, and where it is none in any case.
const NEGLIGIBLE: (f64, f64) = (0.01, 1e-16);

/// Most updates of the slips at one δ, and how many of them are full ones; the others go half the way.
const UPDATES: (usize, usize) = (15, 4);

/// Factorisations after which it is given up.
const MOST: usize = 1500;

/// Residual at which Newton has solved a problem of the way.
const SOLVED: f64 = 1e-10;

/// The iterates of the continuation.
#[derive(Debug, Default)]
pub(super) struct Continuation {
    convex: Convex,
    /// Best iterate at the δ of the moment.
    local: Best,
    /// The last solution and its slips.
    solution: Vec<f64>,
    slips: Vec<f64>,
}

impl Continuation {
    /// Runs down to δ = 0, with about `most` factorisations, and offers the solution there to `best`. Returns those made.
    pub(super) fn run(
        &mut self,
        problem: &Scaled,
        step: &mut Step,
        (newton, steps): (&mut Newton, Steps),
        most: usize,
        best: &mut Best,
    ) -> usize {
        self.convex.begin(problem);
        self.keep();
        let sigmas = problem.regularization.iter();
        let negligible = NEGLIGIBLE.0 * sigmas.fold(FIRST, |m: f64, s| m.min(*s));
        let (mut extra, mut base, mut factor, mut pivots) = (FIRST, FIRST, FACTORS.0, 0);
        let mut first = true;
        let most = most.min(MOST);
        loop {
            let left = most.saturating_sub(pivots);
            pivots += self.solve(problem, step, (newton, steps), (extra, first), left);
            if self.local.residual <= SOLVED {
                if extra == 0.0 {
                    best.offer(&self.local.x, self.local.residual);
                    return pivots;
                }
                (base, first) = (extra, false);
                self.keep();
                factor = (factor * factor).max(FACTORS.0);
            } else {
                factor = factor.sqrt();
                if first || factor > FACTORS.1 || pivots > most {
                    return pivots;
                }
                self.convex.z.copy_from_slice(&self.solution);
                self.convex.slips.copy_from_slice(&self.slips);
            }
            extra = base * factor;
            if extra < negligible.max(NEGLIGIBLE.1) {
                extra = 0.0;
            }
        }
    }

    /// Keeps the iterate as the last solution.
    fn keep(&mut self) {
        self.solution.clear();
        self.solution.extend_from_slice(&self.convex.z);
        self.slips.clear();
        self.slips.extend_from_slice(&self.convex.slips);
    }

    /// Coulomb's law with `extra` regularisation, from the convex iterate, into it, with about `most` factorisations.
    /// Returns those made.
    fn solve(
        &mut self,
        problem: &Scaled,
        step: &mut Step,
        (newton, steps): (&mut Newton, Steps),
        (extra, first): (f64, bool),
        most: usize,
    ) -> usize {
        let (convex, local) = (&mut self.convex, &mut self.local);
        local.begin(&convex.z);
        let mut pivots = 0;
        for update in 0..UPDATES.0 {
            // The last solution may be a start as it is.
            if update > 0 || first {
                pivots += convex.minimise(problem, step, extra);
            }
            pivots += newton.run(problem, step, (&convex.z, extra), steps, local);
            if local.residual <= SOLVED {
                convex.z.copy_from_slice(&local.x);
                convex.update_slips(problem, extra, 1.0);
                break;
            }
            if pivots > most {
                break;
            }
            convex.update_slips(problem, extra, if update < UPDATES.1 { 1.0 } else { 0.5 });
        }
        pivots
    }
}
