//! Report of a step, and the time of its phases.

use crate::{EnergyBalance, ErrorEstimate, Resolved};
use std::time::Duration;
use taut_solver::clock::Moment;
use taut_solver::coulomb::ConeReport;
use taut_solver::{SolveReport, Status};

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

/// Wall-clock time of each phase of one step; with `serde` in seconds. Zero on `wasm32-unknown-unknown`, which has no clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(
        into = "crate::serde_forms::PhaseSeconds",
        from = "crate::serde_forms::PhaseSeconds"
    )
)]
pub struct PhaseTimes([Duration; Phase::ALL.len()]);

impl PhaseTimes {
    /// Time of one phase.
    #[must_use]
    pub fn of(&self, phase: Phase) -> Duration {
        self.0[phase as usize]
    }

    #[cfg(feature = "serde")]
    pub(crate) fn from_times(times: [Duration; Phase::ALL.len()]) -> Self {
        Self(times)
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

/// Contacts of a step: see [`Stepper::contacts`](crate::Stepper::contacts).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactReport {
    /// Contacts that the shapes could have reached within the last sub-step.
    pub near: usize,
    /// Contacts with a force.
    pub touching: usize,
    /// Contacts that slide: their friction is at its limit.
    pub sliding: usize,
    /// Largest penetration at the beginning of a sub-step \[m].
    pub deepest: f64,
    /// Sum of the normal forces \[N].
    pub load: f64,
    /// Factorisations of dense problems, and sweeps over their contacts.
    pub pivots: usize,
    /// Sweeps over contacts.
    pub sweeps: usize,
    /// Dense problems that Newton's method left to its fall-backs.
    pub fallbacks: usize,
    /// Groups that contacts were split into in the last solve, because more than 200 hang together; 0 where all were solved at
    /// once.
    #[cfg_attr(feature = "serde", serde(default))]
    pub groups: usize,
    /// Times that contacts were taken softer for want of a solution.
    pub softened: usize,
    /// Largest violation of the conditions on rates and impulses, in rates over the largest of them, without unit.
    pub complementarity: f64,
    /// The largest of these violations as a gap: over a sub-step, what a contact passes through or is held apart \[m].
    #[cfg_attr(feature = "serde", serde(default))]
    pub residual_gap: f64,
    /// The largest of them as a force: what would undo it in a sub-step, by the mean of the contact's own part of W \[N].
    #[cfg_attr(feature = "serde", serde(default))]
    pub residual_force: f64,
    /// Largest excess of an impulse over its cone, over the largest impulse, without unit.
    pub cone: f64,
}

impl ContactReport {
    pub(crate) fn add(&mut self, solved: &ConeReport, softer: bool) {
        self.softened += usize::from(softer);
        self.pivots += solved.pivots;
        self.sweeps += solved.sweeps;
        self.fallbacks += solved.fallbacks;
    }
}

/// Report of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepReport {
    /// Time at the end of the step \[s].
    pub time: f64,
    /// Report of the linear solver before refinement: that of the first solve that fell short, else
    /// of the last.
    pub solve: SolveReport,
    /// Iterations of all solves of the step, refinements included; 0 for direct backends.
    pub iterations: usize,
    /// Refinement sweeps made after each solve.
    pub refinements: usize,
    /// Linear systems solved: one a sub-step, those of the start and of the guard's Newton passes besides, and one more
    /// each time that rows reach a bound or leave it; two or more besides where cables slip over sheaves.
    pub solves: usize,
    /// Solves whose bounds were left undecided: rows at a bound that should not be, or beyond it and cut off (drives beside
    /// contacts are not); or in which it
    /// was left undecided which cables slip; or whose contacts keep their conditions to more than 10⁻¹⁰, or are held by
    /// their regularisation alone.
    pub undecided: usize,
    /// Sheaves that cables slip over at the end of the step: see [`Stepper::slip_rates`](crate::Stepper::slip_rates).
    #[cfg_attr(feature = "serde", serde(default))]
    pub slipping: usize,
    /// Patterns of sticking and slipping that were tried and left.
    #[cfg_attr(feature = "serde", serde(default))]
    pub slip_passes: usize,
    /// Report of the contacts.
    #[cfg_attr(feature = "serde", serde(default))]
    pub contacts: ContactReport,
    /// Implicit sub-steps that the guard took instead; 0 where the linear steps were accepted.
    pub implicit_substeps: usize,
    /// Implicit sub-steps whose Newton passes did not converge at the smallest length.
    pub unconverged_substeps: usize,
    /// True if the guard took the step back and redid it.
    pub redone: bool,
    /// Sub-steps that the guard divided, because a rope caught, was thrown slack or driven by a jump in them, what hangs on
    /// elastic joints bounced, or bodies turned too far.
    #[cfg_attr(feature = "serde", serde(default))]
    pub divided: usize,
    /// Largest disagreement that the guard found, accepted or not, over the lever arm, without unit; 0 without guard.
    #[cfg_attr(feature = "serde", serde(with = "taut_model::unlimited"))]
    pub disagreement: f64,
    /// The balance of energy, where [`StepOptions::energy_tolerance`](crate::StepOptions::energy_tolerance) asks for it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub balance: Option<EnergyBalance>,
    /// The error of the load's position, where [`StepOptions::estimate`](crate::StepOptions::estimate) asks for it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub error: Option<ErrorEstimate>,
    /// Events at the end of the step, of which [`Stepper::fired`](crate::Stepper::fired) has the names.
    #[cfg_attr(feature = "serde", serde(default))]
    pub events: usize,
    /// Segments that the rules of cables and winches changed at the end of the step.
    #[cfg_attr(feature = "serde", serde(default))]
    pub resolved: Resolved,
    /// True if the scene slept through the step ([`Sleep`](crate::Sleep)): nothing was solved, and
    /// contacts and balance are those of the last step awake.
    #[cfg_attr(feature = "serde", serde(default))]
    pub asleep: bool,
    /// Time of each phase.
    pub phases: PhaseTimes,
}

/// Running totals of a step, and the time at which its last phase ended.
#[derive(Debug)]
pub(crate) struct Tally {
    phases: PhaseTimes,
    last: Moment,
    solve: Option<SolveReport>,
    iterations: usize,
    solves: usize,
    pub(crate) undecided: usize,
    pub(crate) slip_passes: usize,
    pub(crate) contacts: ContactReport,
    pub(crate) implicit_substeps: usize,
    pub(crate) unconverged_substeps: usize,
    pub(crate) redone: bool,
    pub(crate) divided: usize,
    disagreement: f64,
    pub(crate) balance: Option<EnergyBalance>,
}

impl Tally {
    pub(crate) fn start() -> Self {
        Self {
            phases: PhaseTimes::default(),
            last: Moment::now(),
            solve: None,
            iterations: 0,
            solves: 0,
            undecided: 0,
            slip_passes: 0,
            contacts: ContactReport::default(),
            implicit_substeps: 0,
            unconverged_substeps: 0,
            redone: false,
            divided: 0,
            disagreement: 0.0,
            balance: None,
        }
    }

    /// `phase` ends now.
    pub(crate) fn end(&mut self, phase: Phase) {
        let now = Moment::now();
        self.phases.0[phase as usize] += now.since(self.last);
        self.last = now;
    }

    /// One system was solved, and its solution refined.
    pub(crate) fn add(&mut self, mut solve: SolveReport, refined: Option<SolveReport>) {
        self.iterations += solve.iterations + refined.map_or(0, |r| r.iterations);
        self.solves += 1;
        // A direct solution is what its refinement says.
        if let (Status::Direct | Status::Unjudged, Some(refined)) = (solve.status, refined) {
            solve.status = refined.status;
        }
        // A claim of convergence holds for a step only if it holds for each of its solves.
        if self.solve.is_none_or(|last| last.is_claim()) {
            self.solve = Some(solve);
        }
    }

    /// A system was solved besides, whose solution is a part of the next one's: it counts, and what it falls short of
    /// tells.
    pub(crate) fn add_part(&mut self, solve: SolveReport) {
        self.iterations += solve.iterations;
        self.solves += 1;
        if !solve.is_claim() && self.solve.is_none_or(|last| last.is_claim()) {
            self.solve = Some(solve);
        }
    }

    /// Keeps the largest disagreement; NaN is infinite.
    pub(crate) fn see(&mut self, disagreement: f64) {
        let size = if disagreement.is_nan() {
            f64::INFINITY
        } else {
            disagreement
        };
        self.disagreement = self.disagreement.max(size);
    }

    pub(crate) fn report(&self, time: f64, refinements: usize) -> StepReport {
        StepReport {
            time,
            solve: self.solve.unwrap_or(SolveReport::DIRECT),
            iterations: self.iterations,
            refinements,
            solves: self.solves,
            undecided: self.undecided,
            slipping: 0,
            slip_passes: self.slip_passes,
            contacts: self.contacts,
            implicit_substeps: self.implicit_substeps,
            unconverged_substeps: self.unconverged_substeps,
            redone: self.redone,
            divided: self.divided,
            disagreement: self.disagreement,
            balance: self.balance,
            error: None,
            events: 0,
            resolved: Resolved::default(),
            asleep: false,
            phases: self.phases,
        }
    }
}

/// Events of a step.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fired {
    /// Names of those that have acted.
    pub(crate) names: Vec<String>,
    /// The force that each of them waited for, as it was met \[N].
    pub(crate) forces: Vec<Option<f64>>,
}
