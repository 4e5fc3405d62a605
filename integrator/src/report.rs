//! What a step did, and how long its phases took.

use std::time::{Duration, Instant};
use taut_solver::SolveReport;

/// The phases of a step, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Phase {
    /// Violations, Jacobians, forces, effective inertia.
    Linearize,
    /// Matrix and right-hand side.
    Assemble,
    /// Factorisation (or whatever the backend prepares for a matrix).
    Factorize,
    /// Solve for the multipliers.
    Solve,
    /// Refinement sweeps.
    Refine,
    /// Velocities, positions, winding numbers.
    Update,
}

impl Phase {
    /// All phases, in order.
    pub const ALL: [Self; 6] = [
        Self::Linearize,
        Self::Assemble,
        Self::Factorize,
        Self::Solve,
        Self::Refine,
        Self::Update,
    ];
}

/// Wall-clock time of each phase of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PhaseTimes([Duration; Phase::ALL.len()]);

impl PhaseTimes {
    /// Time of one phase.
    #[must_use]
    pub fn of(&self, phase: Phase) -> Duration {
        self.0[phase as usize]
    }

    /// Time of all phases.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.0.iter().sum()
    }

    /// Time of the linear solver: factorisation, solve and refinement.
    #[must_use]
    pub fn linear(&self) -> Duration {
        [Phase::Factorize, Phase::Solve, Phase::Refine]
            .into_iter()
            .map(|p| self.of(p))
            .sum()
    }
}

/// Reads the clock once at each change of phase.
pub(crate) struct PhaseClock {
    times: PhaseTimes,
    last: Instant,
}

impl PhaseClock {
    pub(crate) fn start() -> Self {
        Self {
            times: PhaseTimes::default(),
            last: Instant::now(),
        }
    }

    /// `phase` ends now.
    pub(crate) fn end(&mut self, phase: Phase) {
        let now = Instant::now();
        self.times.0[phase as usize] += now - self.last;
        self.last = now;
    }

    pub(crate) fn times(&self) -> PhaseTimes {
        self.times
    }
}

/// What one step did.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StepReport {
    /// Time at the end of the step \[s].
    pub time: f64,
    /// What the solver said of its first solve.
    pub solve: SolveReport,
    /// Iterations of all solves of the step, refinements included; 0 for direct backends.
    pub iterations: usize,
    /// Refinement sweeps made.
    pub refinements: usize,
    /// Time of each phase.
    pub phases: PhaseTimes,
}
