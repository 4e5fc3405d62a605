//! The work that a step spends on its contacts, and the request to end it.
//!
//! A dense problem of contacts that Newton's method does not solve costs hundreds of
//! factorisations, and a step may have hundreds of such problems. Two things bound the work.
//!
//! The first is a count of work, in multiplications. It depends on the input alone, so a run has
//! the same bits on each machine. Once [`MOST`] is spent on dense problems, or half of [`LIMIT`] in
//! all, the rest of the step finds its contacts' impulses by a few sweeps ([`Effort::method`]),
//! without further passes or shorter sub-steps. The report counts them as undecided. A step that
//! even then comes to [`LIMIT`] ends with [`StepError::TooMuchWork`].
//!
//! The second is a flag, which another thread or a signal handler sets. The step then ends with
//! [`StepError::Stopped`], in the state that it began with. A flag
//! that a step has seen stays seen until the next step begins.

use crate::StepError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use taut_solver::coulomb::{ConeMethod, ConeReport};

/// Work on dense problems after which only sweeps are made, more work for each group of contacts,
/// and the most with these: n³ for a factorisation of n rows, n² for a sweep. Piles that fall spend
/// a tenth of it at most.
const MOST: [f64; 3] = [1e11, 1e10, 5e11];

/// Work at which a step ends: some 10 s, in which a core makes 10¹¹ multiplications a second.
const LIMIT: f64 = 1e12;

/// Work of a sweep over n rows in n², of a column through the joints' factor, or an iteration for
/// it, in entries of their matrix, and of a Newton pass of the guard in these. Sparse rows take
/// longer than the dense ones that are counted as they are.
const SWEEP: f64 = 10.0;
const COLUMN: f64 = 20.0;
const PASS: f64 = 100.0;

/// Sweeps over the contacts of a dense problem once that is spent.
const SWEEPS: usize = 20;

/// Work that a step has spent on contacts, that after which only sweeps are made, the limit, and
/// the flag that stops the step.
#[derive(Debug)]
pub(crate) struct Effort {
    /// Work on dense problems alone.
    spent: f64,
    /// All of it.
    all: f64,
    most: f64,
    limit: f64,
    stop: Option<Arc<AtomicBool>>,
    /// True once the step has seen the flag.
    is_stopped: bool,
    /// Looks at the flag, and the one from which on it is up.
    #[cfg(test)]
    pub(crate) looks: (usize, Option<usize>),
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            spent: 0.0,
            all: 0.0,
            most: MOST[0],
            limit: LIMIT,
            stop: None,
            is_stopped: false,
            #[cfg(test)]
            looks: (0, None),
        }
    }
}

impl Effort {
    /// A step begins.
    pub(crate) fn begin(&mut self) {
        (self.spent, self.all, self.most) = (0.0, 0.0, MOST[0]);
        self.is_stopped = false;
    }

    /// The step has so many groups of contacts.
    pub(crate) fn allow(&mut self, groups: usize) {
        let [least, each, most] = MOST;
        self.most = self.most.max((least + each * groups as f64).min(most));
    }

    /// A dense problem of `rows` rows was solved.
    pub(crate) fn spend(&mut self, rows: usize, report: &ConeReport) {
        let n = rows as f64;
        let (factored, swept) = (n * report.pivots as f64, report.sweeps as f64);
        self.spent += n * n * (factored + swept);
        self.all += n * n * (factored + SWEEP * swept);
    }

    /// So many `columns` went through a factor of the joints' system, whose matrix has so many
    /// `entries`, or were iterated so often with it.
    pub(crate) fn spend_solves(&mut self, columns: usize, iterations: usize, entries: usize) {
        self.all += COLUMN * (columns + iterations) as f64 * entries as f64;
    }

    /// A Newton pass of the guard assembled and factorised such a matrix.
    pub(crate) fn spend_pass(&mut self, entries: usize) {
        self.all += PASS * entries as f64;
    }

    /// True once the step has spent more than its limit.
    pub(crate) fn is_spent(&self) -> bool {
        self.spent > self.most || self.all > 0.5 * self.limit
    }

    /// True once nothing more is to be done: the step is stopped, or at its limit.
    pub(crate) fn ends(&mut self) -> bool {
        self.is_stopped() || self.all > self.limit
    }

    /// The method for the next dense problem of a step that asks for `method`.
    pub(crate) fn method(&self, method: ConeMethod) -> ConeMethod {
        match method {
            ConeMethod::Newton if self.is_spent() => ConeMethod::GaussSeidel {
                sweeps: SWEEPS,
                tolerance: 0.0,
            },
            other => other,
        }
    }

    /// True once the flag that stops the step was seen set.
    pub(crate) fn is_stopped(&mut self) -> bool {
        #[cfg(test)]
        {
            self.looks.0 += 1;
            self.is_stopped |= self.looks.1.is_some_and(|up| self.looks.0 >= up);
        }
        let is_set = |stop: &Arc<AtomicBool>| stop.load(Ordering::Relaxed);
        self.is_stopped = self.is_stopped || self.stop.as_ref().is_some_and(is_set);
        self.is_stopped
    }

    /// The error of a step that is asked to end or has come to its limit, whose sub-step began at
    /// `time` (s).
    pub(crate) fn check(&mut self, time: f64) -> Result<(), StepError> {
        if self.is_stopped() {
            return Err(StepError::Stopped { time });
        }
        if self.all > self.limit {
            return Err(StepError::TooMuchWork { time });
        }
        Ok(())
    }

    /// Ends steps early while `stop` is true.
    pub(crate) fn stop_by(&mut self, stop: Arc<AtomicBool>) {
        self.stop = Some(stop);
    }

    /// Takes the flag of another one, of the run that this one accompanies.
    pub(crate) fn follow(&mut self, other: &Self) {
        self.stop.clone_from(&other.stop);
    }
}

#[cfg(test)]
mod tests;
