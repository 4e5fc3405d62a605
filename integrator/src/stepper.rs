//! The step, [SL Algorithm 1] with the whole scene as one group: linearise and update here; assemble, factorise, solve and
//! refine in `system`. The default step is the one of [`guarded`]: it redoes a step whose linearisation did not hold.

pub(crate) mod balance;
pub(crate) mod choice;
mod contact_solve;
mod divided;
pub(crate) mod estimate;
mod failed;
pub(crate) mod guarded;
mod potential;
pub(crate) mod resolution;
pub(crate) mod sleep;
mod slipping;
mod start;
mod system;
pub(crate) mod told;
mod winch_cuts;

use crate::activation::Activation;
use crate::active_set::ActiveSet;
use crate::assembly_map::AssemblyMap;
use crate::contact::Contacts;
use crate::contact::rebound::slowest;
use crate::curvature::Curvature;
use crate::effort::Effort;
use crate::elimination::{self, EliminationOrder};
use crate::history::{History, State};
use crate::identity::Identities;
use crate::options::Excess;
use crate::regularization::Known;
use crate::report::{Fired, Tally};
use crate::slip::Slip;
use crate::system_data::SystemData;
use crate::{
    GeometricStiffness, Phase, StepError, StepOptions, StepReport, equilibrium, geometric, motion,
};
use taut_lanes::Aligned;
use taut_model::{Constraint, Scene};
use taut_solver::{
    Backend, Capabilities, DenseOptions, Foreign, LinearSolver, RefineScratch, SolveError,
    SymBlockMatrix,
};

use balance::Account;
use divided::Division;
use estimate::Companion;
use potential::Search;
use resolution::{Resolved, Resolving};
use sleep::Rest;
use told::Told;

/// A scene in motion: its state, its linear system and the solver.
pub struct Stepper {
    pub(crate) scene: Scene,
    pub(crate) ids: Identities,
    pub(crate) fired: Fired,
    pub(crate) options: StepOptions,
    pub(crate) time: f64,
    pub(crate) solver: Box<dyn LinearSolver>,
    pub(crate) elimination: EliminationOrder,
    /// The solver that [`Backend::Auto`] stands for.
    pub(crate) chosen: Option<choice::Chosen>,
    pub(crate) assembly_map: AssemblyMap,
    pub(crate) matrix: SymBlockMatrix,
    /// Right-hand side and solution of the linear system, length `matrix.dim()`.
    pub(crate) rhs: Aligned,
    pub(crate) x: Aligned,
    scratch: RefineScratch,
    /// Multipliers and a residual in the order of the scene's rows.
    pub(crate) in_rows: [Aligned; 2],
    /// Linearisation and system of the present state. ∂φ/∂t in `pieces.rows` is the last step's.
    pub(crate) system_data: SystemData,
    /// Active set of the rows with bounds.
    pub(crate) active_set: ActiveSet,
    pub(crate) activation: Activation,
    pub(crate) curvature: Curvature,
    /// Slip of cables over their sheaves.
    pub(crate) slip: Slip,
    /// Constraints where cables of segments leave their winches.
    pub(crate) fairleads: Vec<usize>,
    /// Constraints of cables with winches, massless and of segments.
    pub(crate) winches: Vec<usize>,
    /// Cables with a rule of resolution.
    pub(crate) resolving: Option<Box<Resolving>>,
    pub(crate) contacts: Contacts,
    /// Right-hand sides and solutions for responses to sheaves and contacts.
    pub(crate) columns: [Vec<f64>; 2],
    pub(crate) history: History,
    /// Impulses μ = Δt λ of the last solve, one a row.
    pub(crate) mu: Aligned,
    /// Length of the step that `mu` belongs to \[s].
    pub(crate) mu_dt: f64,
    /// Forces that the last step tells.
    pub(crate) told: Told,
    /// λ that the geometric stiffness is made of, one a row \[N, N m].
    pub(crate) tension: Aligned,
    /// Set once `tension` has the forces of a solve.
    pub(crate) tension_known: bool,
    /// Set once the first step has begun.
    pub(crate) started: bool,
    /// Bodies added since the last step, whose velocities still belong to the same instant as the
    /// positions.
    pub(crate) fresh: Vec<usize>,
    pub(crate) stage: Stage,
    /// Steps that the guard still takes implicitly.
    pub(crate) holding: usize,
    /// State of a step divided because a rope catches or is thrown slack.
    pub(crate) division: Division,
    pub(crate) account: Account,
    /// States at the beginning of the step and of its sub-step.
    pub(crate) step_start: State,
    pub(crate) substep_start: State,
    /// The guard's search along its Newton steps.
    pub(crate) search: Search,
    /// Observations of rest; `None` in a scene that may not sleep.
    pub(crate) rest: Option<Rest>,
    /// Totals since the last call that returned a report.
    pub(crate) tally: Tally,
    /// Work of the present step and its bound.
    pub(crate) effort: Effort,
    /// State that a stopped step goes back to; `None` without a flag, and in the companion run.
    pub(crate) beginning: Option<Box<crate::Beginning>>,
    /// Companion run that estimates the error.
    pub(crate) companion: Option<Box<Companion>>,
}

/// State that the multipliers and the system's data belong to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stage {
    /// Nothing that may be advanced: the present state is unsolved, was changed or was taken back.
    Unsolved,
    /// The present state, which may be advanced.
    Solved,
    /// The sub-step of `dt` (s) that led to the present state; an `implicit` one has its forces at its end.
    Advanced {
        /// Its length.
        dt: f64,
        /// True if the guard redid it.
        implicit: bool,
    },
}

impl Stage {
    /// Length of the sub-step that led to the present state and that the system's data still hold; 0 for none \[s].
    pub(crate) fn advanced(self) -> f64 {
        match self {
            Self::Advanced { dt, .. } => dt,
            _ => 0.0,
        }
    }

    /// The system of the present state has changed.
    pub(crate) fn unsolve(&mut self) {
        if *self == Self::Solved {
            *self = Self::Unsolved;
        }
    }
}

/// Largest turn of a sheave, or of a motor that holds an angle, in a sub-step \[rad]: of half a one and more the direction is
/// lost.
const FASTEST: f64 = 3.0;

/// Reasons of [`StepError::OffPath`].
const LOST: &str = "has no way over its sheaves any more";
const TOO_FAST: &str = "runs over a sheave that turns by more than half a turn a step: use a smaller time step, or a \
                        larger sheave";
const SPINS: &str = "turns by more than half a turn a step, and its motor cannot tell which way: use a smaller time step, or \
                     more sub-steps";

/// A solver's error before the first step.
pub(crate) fn at_start(source: SolveError) -> StepError {
    StepError::Solve {
        source,
        culprit: None,
        time: 0.0,
    }
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
        mut scene: Scene,
        options: StepOptions,
        given: &mut Option<Box<dyn LinearSolver>>,
    ) -> Result<Self, StepError> {
        scene.validate()?;
        options.validate()?;
        if std::mem::take(&mut scene.start_in_equilibrium) {
            scene = equilibrium::static_equilibrium(scene, &options.backend)?;
        }
        scene.lay_cables(0.0);
        Self::build_valid(scene, options, given)
    }

    /// [`build`](Self::build) for a valid scene and valid options, with cables laid and at
    /// equilibrium.
    pub(crate) fn build_valid(
        scene: Scene,
        options: StepOptions,
        given: &mut Option<Box<dyn LinearSolver>>,
    ) -> Result<Self, StepError> {
        let mut system_data = SystemData::new(&scene);
        elimination::check_size(&scene, &system_data.rows)?;
        let (elimination, chosen) = choice::order_and_solver(&options, &scene, &system_data.rows)?;
        let order = &elimination.constraints;
        let form = options.form;
        let assembly_map =
            AssemblyMap::new(form, &scene, &system_data.rows, order).map_err(at_start)?;
        let backend = chosen.as_ref().map_or(&options.backend, |c| &c.backend);
        elimination::check_fill(form, backend, &elimination, &assembly_map.pattern)
            .map_err(at_start)?;
        let mut solver = match given.take() {
            Some(solver) => solver,
            None => backend.create().map_err(at_start)?,
        };
        if let Err(e) = solver.analyze(&assembly_map.pattern) {
            *given = Some(solver);
            return Err(at_start(e));
        }
        system_data.rows.update(&scene, 0.0);
        let (dim, rows) = (assembly_map.pattern.dim(), system_data.rows.rows());
        let dt = options.dt / options.substeps as f64;
        system_data.rows.drive(&scene, -dt, 0.0);
        let mut history = History::new(rows, scene.bodies.len());
        history.forget(&system_data.rows.phi_t);
        let state = State::new(&scene, rows);
        let slip = Slip::new(&scene, &system_data);
        let contacts = Contacts::new(&scene, &system_data);
        Ok(Self {
            time: 0.0,
            solver,
            matrix: SymBlockMatrix::zeros(assembly_map.pattern.clone()),
            rhs: Aligned::new(dim),
            x: Aligned::new(dim),
            scratch: RefineScratch::new(dim),
            in_rows: [(); 2].map(|()| Aligned::new(rows)),
            history,
            mu: Aligned::new(rows),
            mu_dt: dt,
            told: Told::new(rows),
            tension: Aligned::new(rows),
            tension_known: false,
            started: false,
            fresh: Vec::new(),
            stage: Stage::Unsolved,
            holding: 0,
            division: Division::new(rows, system_data.rows.bounds.len()),
            account: Account::default(),
            step_start: state.clone(),
            substep_start: state,
            search: Search::new(rows, scene.bodies.len()),
            rest: Rest::new(&scene, &options),
            tally: Tally::start(),
            effort: Effort::default(),
            beginning: None,
            companion: None,
            active_set: {
                let mut bounded = ActiveSet::new(&system_data);
                bounded.join(slip.chains());
                bounded
            },
            slip,
            fairleads: scene.fairleads().collect(),
            winches: winch_cuts::winches(&scene),
            resolving: Resolving::new(&scene).map(Box::new),
            contacts,
            columns: Default::default(),
            curvature: Curvature::new(&scene),
            activation: Activation::new(system_data.rows.rows(), system_data.rows.bounds.len()),
            system_data,
            elimination,
            chosen,
            assembly_map,
            ids: Identities::new(&scene),
            fired: Fired::default(),
            scene,
            options,
        })
    }

    /// Length of a sub-step, or of a part of a divided one \[s].
    pub(crate) fn substep(&self) -> f64 {
        let parts = self.options.substeps as f64 * f64::from(self.division.parts);
        self.options.dt / parts * f64::from(self.division.taken)
    }

    /// Advances the scene by one time step, then fires the due events. Does not allocate with the
    /// built-in backends unless contacts appear, events fire or over 200 contacts hang together.
    ///
    /// # Errors
    /// [`StepError::Solve`] (the state is then that at the beginning of the sub-step),
    /// [`StepError::Stopped`] and [`StepError::TooMuchWork`], [`StepError::NonFinite`] and
    /// [`StepError::EnergyGain`].
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        self.check_winches()?;
        self.check_motors()?;
        if let Some(report) = self.sleep_through()? {
            return Ok(report);
        }
        self.accompany();
        let mut report = self.tallied(|stepper| {
            // After the blow of the start, before velocities go half a step back.
            stepper.strike_at_start()?;
            let mut given = stepper.motion_at_start();
            for _ in 0..stepper.options.substeps {
                stepper.effort.check(stepper.time)?;
                // After a divided sub-step the next one starts anew, too.
                stepper.start()?;
                let opening = stepper.opening(given.take());
                match stepper.options.guard {
                    None => stepper.linear_substep()?,
                    Some(guard) => stepper.guarded_substep(guard)?,
                }
                if let Some(opening) = opening {
                    stepper.open_account(opening);
                }
                stepper.measure_events();
            }
            stepper.check_paths()?;
            stepper.close_told();
            stepper.weigh()
        })?;
        report.slipping = self.slip.count();
        report.error = self.estimate(&report);
        let changed = self.lift_and_land()?;
        report.resolved = self.wind()?;
        // A changed scene has no contacts yet for rules to see.
        if !changed && report.resolved == Resolved::default() {
            report.resolved = self.resolve()?;
        }
        report.resolved.segments = self.ruled_segments();
        report.events = self.fire()?;
        self.watch(&report);
        Ok(report)
    }

    /// All cables have a way over their sheaves.
    fn check_paths(&self) -> Result<(), StepError> {
        let rows = &self.system_data.rows;
        for &c in rows.others() {
            let Constraint::MasslessCable(cable) = &self.scene.constraints[c] else {
                continue;
            };
            if rows.phi[rows.row_range(c).start].is_nan() {
                let known = rows.lost.filter(|(lost, _)| *lost == c);
                return Err(self.off_path(c, known.map_or(LOST, |(_, reason)| reason)));
            }
            if cable.turn_of_sheaves(&self.scene.bodies) * self.substep() > FASTEST {
                return Err(self.off_path(c, TOO_FAST));
            }
        }
        Ok(())
    }

    /// Motors that hold an angle know it at the end of the next sub-step.
    fn check_motors(&self) -> Result<(), StepError> {
        for &c in self.system_data.rows.others() {
            if let Constraint::Hinge(hinge) = &self.scene.constraints[c]
                && hinge.turn(&self.scene.bodies) * self.substep() > FASTEST
            {
                return Err(self.off_path(c, SPINS));
            }
        }
        Ok(())
    }

    fn off_path(&self, constraint: usize, reason: &'static str) -> StepError {
        StepError::OffPath {
            cable: self.scene.constraint_names[constraint].clone(),
            reason,
            time: self.time,
        }
    }

    /// A sub-step of the scheme: linearised, solved, updated.
    fn linear_substep(&mut self) -> Result<(), StepError> {
        self.solve_scheme(self.options.stiffness)?;
        self.update()?;
        self.accept_linear()
    }

    /// Solves the scheme's linear system at the present state.
    pub(crate) fn solve_scheme(&mut self, stiffness: GeometricStiffness) -> Result<(), StepError> {
        self.linearize(stiffness)?;
        self.solve_linearized(self.substep())
    }

    /// The report of `work`. What led to a failure may be of any size: the next solve finds its tension anew, and starts
    /// from zero.
    fn tallied(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<(), StepError>,
    ) -> Result<StepReport, StepError> {
        self.tally = Tally::start();
        self.begin_effort();
        self.told.forget();
        self.system_data.rows.lost = None;
        work(self).map_err(|e| self.after_failure(e))?;
        Ok(self.tally.report(self.time, self.refinements()))
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
            stepper.find_tension()?;
            stepper.solve_scheme(stepper.options.stiffness)
        })
    }

    /// M̃, Δt f, Σ and c of the scheme at the present state.
    pub(crate) fn linearize(&mut self, stiffness: GeometricStiffness) -> Result<(), StepError> {
        self.note_stage();
        self.stage = Stage::Unsolved;
        let dt = self.substep();
        if self.contacts.can_be() {
            self.find_contacts(dt, true)?;
        }
        self.slip.grip(&self.scene);
        let (system_data, history) = (&mut self.system_data, &mut self.history);
        system_data.load_velocities(&self.scene.bodies);
        let jv = &mut self.in_rows[0];
        system_data.rows.times_jacobian(&system_data.v, jv);
        if !history.known {
            history.take_rates(jv);
            history.v.copy_from(&system_data.v);
        }
        let gamma = self.options.scheme.weights().history();
        match stiffness {
            GeometricStiffness::Off => system_data.geometric.clear(),
            _ => {
                let excess = Excess::of(&self.options.row_weights(stiffness));
                let tension = &self.tension;
                system_data
                    .geometric
                    .update(&system_data.rows, tension, Some(excess));
            }
        }
        if stiffness != GeometricStiffness::Off {
            self.contacts
                .stiffen(&self.scene, &mut system_data.geometric);
        }
        let (now, before) = (&system_data.v, &history.v);
        geometric::drive(stiffness, gamma, now, before, &mut system_data.drive);
        self.update_inertia(dt, stiffness.alpha())?;
        self.regularize(stiffness, dt);
        self.tally.end(Phase::Linearize);
        Ok(())
    }

    /// Σ and c of the scheme for a step `dt` long; `in_rows` begin with the rates J v, and M̃ is that of the step.
    fn regularize(&mut self, stiffness: GeometricStiffness, dt: f64) {
        let (system_data, history) = (&mut self.system_data, &mut self.history);
        let jv = &self.in_rows[0];
        let weights = self.options.row_weights(stiffness);
        system_data.weigh(&weights);
        // The driven part of r_n is that of the step that led here.
        let rates = (&**jv, &*history.phi_t);
        system_data
            .rows
            .drive(&self.scene, self.time, self.time + dt);
        if !self.winches.is_empty() {
            winch_cuts::leave_room(
                &mut self.active_set,
                &self.scene,
                system_data,
                self.time + dt,
            );
        }
        // The last drives of cables that slip hold their slip.
        let jerk = if self.slip.is_empty() {
            divided::LEAST * slowest(&self.scene, dt)
        } else {
            f64::INFINITY
        };
        self.activation
            .weigh(system_data, &weights, rates, jerk, dt);
        self.slip.forget();
        let stiff = stiffness != GeometricStiffness::Off;
        system_data.soften_transverse_rows(&self.tension, stiff);
        let past = Known::Past {
            phi_t: &history.phi_t,
            before: &history.rate,
            now: &mut history.rate_now,
        };
        system_data.regularize(dt, jv, past);
        self.activation
            .round_kinks(system_data, &history.rate_now, dt);
        self.activation.begin(&system_data.rows);
        self.activation.damp_from_taut(system_data, dt);
        let step = (self.time, dt);
        self.curvature.follow(&self.scene, system_data, jv, step);
        if self.division.parts > 1 {
            self.activation.leave_drift(system_data, dt);
            self.activation
                .return_slowly(system_data, &self.tension, dt);
        }
    }

    pub(crate) fn update_inertia(&mut self, dt: f64, alpha: f64) -> Result<(), StepError> {
        let SystemData {
            inertia,
            geometric,
            drive,
            ..
        } = &mut self.system_data;
        inertia
            .update(&self.scene, dt, geometric.stiffness(), alpha, drive)
            .map_err(|i| self.not_finite(i))
    }

    /// The second half of a sub-step: velocities from the impulses of the last [`solve`](Self::solve), then positions.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`] in [`StepError::Solve`] without a solve of the present state, and
    /// [`StepError::NonFinite`]; the state is then not to be used.
    pub fn advance(&mut self) -> Result<(), StepError> {
        self.tallied(Self::update)?;
        self.accept_linear()?;
        self.told.forget();
        Ok(())
    }

    /// A sub-step of the scheme stands, with the blows at its end.
    fn accept_linear(&mut self) -> Result<(), StepError> {
        let dt = self.stage.advanced();
        self.account(dt, false);
        self.accept();
        self.tally.end(Phase::Update);
        if !self.contacts.is_empty() {
            self.rebound()?;
        }
        self.tell(dt);
        Ok(())
    }

    /// [`advance`](Self::advance) that leaves the windings of twist rows, so that it can be taken back.
    pub(crate) fn update(&mut self) -> Result<(), StepError> {
        if self.stage != Stage::Solved {
            let source = SolveError::OutOfOrder {
                called: "advance",
                needs: "solve",
            };
            return Err(self.culprit(source));
        }
        self.stage = Stage::Unsolved;
        self.started = true;
        let dt = self.substep();
        self.system_data.update_velocity_change(&self.mu);
        self.system_data.predict(dt);
        self.history
            .accept(&self.system_data.v, &self.system_data.rows.phi_t);
        self.time += dt;
        self.move_bodies(dt)?;
        self.slip.move_lengths(&mut self.scene, dt, self.time);
        self.stage = Stage::Advanced {
            dt,
            implicit: false,
        };
        self.system_data.rows.update_state(&self.scene, self.time);
        Ok(())
    }

    /// v⁺ = v + Δv from `system_data`, then positions, over `dt`.
    pub(crate) fn move_bodies(&mut self, dt: f64) -> Result<(), StepError> {
        let SystemData { inertia, v, dv, .. } = &self.system_data;
        let bodies = &mut self.scene.bodies;
        motion::move_bodies(bodies, &inertia.rods, &inertia.others, v, dv, dt)
            .map_err(|i| self.not_finite(i))
    }

    /// Takes back what [`update`](Self::update) did since `saved`.
    pub(crate) fn go_back(&mut self, saved: &State) {
        self.time = saved.restore(&mut self.scene.bodies);
        saved.restore_lengths(&mut self.scene);
        saved.restore_contacts(&mut self.contacts);
        self.mu_dt = saved.restore_multipliers(&mut self.mu, &mut self.tension);
        self.stage = Stage::Unsolved;
        self.system_data.rows.update_state(&self.scene, self.time);
    }
}

#[cfg(test)]
mod tests;
