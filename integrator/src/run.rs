//! Runs: steps of a scene, one after the other, and what happens between them.
//!
//! [`Stepper::step`] names all of it in its order. What a scene or its options do not ask for is not called: rest to watch,
//! events, winches, rules of resolution, coarse run and balance of energy.

mod access;
pub(crate) mod balance;
mod change;
pub(crate) mod course;
pub(crate) mod estimate;
mod events;
pub(crate) mod identity;
mod observe;
pub(crate) mod resolution;
pub(crate) mod saved;
pub(crate) mod sleep;

use crate::report::{Fired, Tally};
use crate::step::Step;
use crate::{StepError, StepOptions, StepReport, equilibrium};
use taut_model::Scene;
use taut_solver::{Backend, Capabilities, DenseOptions, Foreign, LinearSolver};

pub use change::Edit;
pub(crate) use saved::beginning::Beginning;

use course::Course;
use estimate::CoarseRun;
use identity::Identities;
use resolution::{Resolved, Resolving};
use sleep::Rest;

/// A scene in motion: its state, its linear system and the solver.
pub struct Stepper {
    pub(crate) step: Step,
    ids: Identities,
    fired: Fired,
    course: Course,
    /// Cables with a rule of resolution.
    resolving: Option<Box<Resolving>>,
    /// Observations of rest; `None` in a scene that may not sleep.
    rest: Option<Rest>,
    /// State that a stopped step goes back to; `None` without a flag, and in the coarse run.
    beginning: Option<Box<Beginning>>,
    /// Coarse run that estimates the error.
    coarse: Option<Box<CoarseRun>>,
}

impl Stepper {
    /// A stepper for a scene, at time 0. Allocates all memory of the steps except that of libraries. A
    /// scene that asks for its static equilibrium is put there.
    ///
    /// # Errors
    /// An invalid scene or option, a backend that is not compiled in or does not take the form, no equilibrium.
    pub fn new(scene: Scene, options: StepOptions) -> Result<Self, StepError> {
        Self::build(scene, options, &mut None)
    }

    /// A stepper with a solver that is at hand as a value, of any crate, instead of the one that `options.backend` names,
    /// which it then stands for. What the solver can do is believed: the form is refused that it does not take, its
    /// iterations start from the last multipliers. It goes on through [`change`](Self::change). Equilibria are found with
    /// the first direct backend compiled in. A saved run is restored where a solver of that name is
    /// [registered](taut_solver::register); that of a solver called like a backend of this crate is refused.
    ///
    /// A solver of unknown quality can be handed over as [`Checked`](taut_solver::Checked).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_solver(
        mut scene: Scene,
        mut options: StepOptions,
        solver: Box<dyn LinearSolver>,
        capabilities: Capabilities,
    ) -> Result<Self, StepError> {
        options.backend = Backend::Foreign {
            solver: Foreign::of(&*solver, capabilities),
            options: String::new(),
        };
        scene.validate()?;
        options.validate()?;
        if std::mem::take(&mut scene.start_in_equilibrium) {
            let mut all = Backend::all().into_iter();
            let direct = all.find(|b| b.is_compiled() && !b.is_iterative());
            // The dense solver is always there.
            let direct = direct.unwrap_or(Backend::Dense(DenseOptions::default()));
            scene = equilibrium::static_equilibrium(scene, &direct)?;
        }
        Self::build(scene, options, &mut Some(solver))
    }

    /// A stepper with the solver, which is taken where nothing fails, or else one that the options name.
    pub(crate) fn build(
        scene: Scene,
        options: StepOptions,
        given: &mut Option<Box<dyn LinearSolver>>,
    ) -> Result<Self, StepError> {
        Ok(Self::of(Step::build(scene, options, given)?))
    }

    /// A run from its first step on.
    fn of(step: Step) -> Self {
        let (scene, options) = (&step.scene, &step.options);
        Self {
            ids: Identities::new(scene),
            fired: Fired::default(),
            course: Course::default(),
            resolving: Resolving::new(scene).map(Box::new),
            rest: Rest::new(scene, options),
            beginning: None,
            coarse: None,
            step,
        }
    }

    /// Goes on as a run in another state, with what is no part of a state: the flag that stops it, the state that a stopped step
    /// goes back to, the coarse run, of one its coarseness, and the events of the last step.
    fn go_on_as(&mut self, mut other: Self) {
        other.step.effort = std::mem::take(&mut self.step.effort);
        other.step.guarded.division.coarseness = self.step.guarded.division.coarseness;
        other.beginning = self.beginning.take();
        other.coarse = self.coarse.take();
        other.fired = std::mem::take(&mut self.fired);
        *self = other;
    }

    /// Advances the scene by one time step, then fires the due events. Does not allocate with the
    /// built-in backends unless contacts appear, events fire or over 200 contacts hang together.
    ///
    /// # Errors
    /// [`StepError::Solve`] (the state is then that at the beginning of the sub-step),
    /// [`StepError::Stopped`] and [`StepError::TooMuchWork`], [`StepError::NonFinite`] and
    /// [`StepError::EnergyGain`].
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        if self.step.uses.winches {
            self.step.check_winches()?;
        }
        self.step.check_motors()?;
        if let Some(last) = self.rest.as_ref().and_then(|rest| rest.watch.asleep)
            && let Some(report) = self.sleep_through(last)?
        {
            return Ok(report);
        }
        let estimate = self.step.options.estimate;
        if let Some(every) = estimate {
            self.accompany(every);
        }
        let mut report = self.tallied(Self::take_substeps)?;
        if self.step.uses.slip {
            report.slipping = self.step.slip.count();
        }
        if let Some(every) = estimate {
            report.error = self.estimate(&report, every);
        }
        self.course.clear();
        self.change_by_rules(&mut report)?;
        if self.has_events() {
            report.events = self.fire()?;
        }
        if let Some(rest) = &mut self.rest {
            rest.watch(&self.step, &report);
        }
        Ok(report)
    }

    /// Cables leave sheaves and lie down on them, winches split and merge segments, then rules of resolution.
    fn change_by_rules(&mut self, report: &mut StepReport) -> Result<(), StepError> {
        let changed = self.step.slip.may_change && self.lift_and_land()?;
        if self.step.uses.winches {
            report.resolved = self.wind()?;
        }
        if self.resolving.is_some() {
            // A changed scene has no contacts yet for rules to see.
            if !changed && report.resolved == Resolved::default() {
                report.resolved = self.resolve()?;
            }
            report.resolved.segments = self.ruled_segments();
        }
        Ok(())
    }

    /// True if events are to come, or are reported of the last step.
    fn has_events(&self) -> bool {
        !(self.step.scene.events.is_empty() && self.fired.names.is_empty())
    }

    /// The sub-steps of a step, and its balance of energy.
    fn take_substeps(&mut self) -> Result<(), StepError> {
        let balances = self.step.options.energy_tolerance.is_some();
        // After the blow of the start, before velocities go half a step back.
        self.step.strike_at_start()?;
        let mut given = balances.then(|| self.motion_at_start()).flatten();
        for k in 0..self.step.options.substeps {
            self.step.effort.check(self.step.time)?;
            if k > 0 {
                self.follow_course(k)?;
            }
            // After a divided sub-step the next one starts anew, too.
            self.step.start()?;
            let opening = balances.then(|| self.opening(given.take())).flatten();
            self.step.take_substep()?;
            if let Some(opening) = opening {
                self.open_account(opening);
            }
            if !self.step.scene.events.is_empty() {
                self.step.measure_events();
            }
        }
        self.step.check_paths()?;
        if self.step.output.reported.opened {
            self.step.close_output();
        }
        if let Some(tolerance) = self.step.options.energy_tolerance {
            self.weigh(tolerance)?;
        }
        Ok(())
    }

    /// The report of `work`.
    fn tallied(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<(), StepError>,
    ) -> Result<StepReport, StepError> {
        self.step.tally = Tally::start();
        self.step.effort.begin();
        if let Some(mut beginning) = self.beginning.take() {
            beginning.keep(self);
            self.beginning = Some(beginning);
        }
        self.step.forget_output();
        work(self).map_err(|e| self.after_failure(e))?;
        let step = &self.step;
        Ok(step.tally.report(step.time, step.refinements()))
    }

    /// Clears what failed work has left; a step that was stopped goes back to its beginning. Returns the error to
    /// tell.
    fn after_failure(&mut self, mut e: StepError) -> StepError {
        self.course.clear();
        if matches!(e, StepError::Stopped { .. } | StepError::TooMuchWork { .. }) {
            match self.return_to_beginning() {
                Ok(true) => return e,
                Ok(false) => {}
                Err(other) => e = other,
            }
        } else if let Some((c, reason)) = self.step.system_data.rows.lost {
            e = self.step.off_path(c, reason);
        }
        self.step.clear_failure();
        e
    }

    /// First part of the first [`step`](Self::step) of a run and after bodies were added: velocities of a staggered scheme go
    /// half a step back, and the geometric stiffness gets its multipliers. At the start of a run, velocities that rigid rows do
    /// not allow end in a blow first; no force holds its impulse. Does nothing in a moving scene.
    ///
    /// # Errors
    /// [`StepError::Solve`].
    pub fn begin(&mut self) -> Result<(), StepError> {
        if self.step.progress.started && self.step.progress.newly_added.is_empty() {
            return Ok(());
        }
        let begin = |stepper: &mut Self| {
            stepper.step.strike_at_start()?;
            stepper.step.start()
        };
        self.tallied(begin).map(|_| ())
    }

    /// The first half of a sub-step: solves for the impulses of the present state, which stays as it is. With
    /// [`advance`](Self::advance) after it this is an unguarded [`step`](Self::step) without its sub-steps, and without what
    /// follows a step: segments that split and merge, events. It is the first one too after [`begin`](Self::begin).
    ///
    /// # Errors
    /// [`StepError::Solve`].
    pub fn solve(&mut self) -> Result<StepReport, StepError> {
        self.wake();
        self.tallied(|stepper| {
            let step = &mut stepper.step;
            step.find_tension()?;
            step.solve_scheme(step.options.stiffness)
        })
    }

    /// The second half of a sub-step: velocities from the impulses of the last [`solve`](Self::solve), then positions.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`](taut_solver::SolveError::OutOfOrder) in [`StepError::Solve`] without a solve of the present
    /// state, and [`StepError::NonFinite`]; the state is then not to be used.
    pub fn advance(&mut self) -> Result<(), StepError> {
        self.tallied(|stepper| stepper.step.update())?;
        self.step.accept_linear()?;
        self.step.output.reported.forget();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
