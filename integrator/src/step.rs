//! The step, [SL Algorithm 1] with the whole scene as one group: M̃ and J of the scene, one linear solve, and what its impulses
//! make of velocities and positions.
//!
//! ```text
//! linearise     J, φ, M̃ of the present state; Σ and c of the scheme                            linearize
//! assemble      A = J M̃⁻¹ Jᵀ + Σ                    b = c − J (v + M̃⁻¹ Δt f)                   system
//! factorise     A = L D Lᵀ                                                                     the backend
//! solve         μ = A⁻¹ b,   refined by A d = b − A μ                                          system
//! update        v⁺ = v + M̃⁻¹ (Δt f + Jᵀ μ),   x⁺ = x + Δt v⁺,   e⁺ = exp(Δt ω⁺) ⊗ e            here
//! guard         φ(q⁺) beside φ + Δt (J v⁺ + ∂φ/∂t): taken, divided or redone                   guarded
//! ```
//!
//! A scene pays for what it [uses](Uses): what it has not is not called. Runs repeat the step and do what happens between
//! steps; no code here names them.

pub(crate) mod choice;
mod condensed;
pub(crate) mod contact_solve;
mod divided;
pub(crate) mod forces;
pub(crate) mod guarded;
mod linearize;
mod potential;
pub(crate) mod reference;
pub(crate) mod reported;
mod start;
mod system;
mod winch_cuts;
pub(crate) mod work;

use crate::activation::{Activation, Made};
use crate::active_set::ActiveSet;
use crate::assembly_map::AssemblyMap;
use crate::contact::Contacts;
use crate::effort::Effort;
use crate::elimination;
use crate::history::{History, State};
use crate::report::Tally;
use crate::slip::Slip;
use crate::system_data::SystemData;
use crate::{GeometricStiffness, Phase, StepError, StepOptions, equilibrium, motion};
use taut_lanes::Aligned;
use taut_model::{Constraint, Scene};
use taut_solver::{LinearSolver, RefineScratch, SolveError, SymBlockMatrix};

use divided::Division;
use guarded::GuardState;
use potential::Search;
use reference::Sample;
use reported::Reported;
use system::{LinearSystem, Multipliers};
use winch_cuts::Winches;
use work::Account;

/// A scene in its present state, its linear system, the solver, and what a step leaves for the next one.
pub(crate) struct Step {
    pub(crate) scene: Scene,
    pub(crate) uses: Uses,
    pub(crate) options: StepOptions,
    pub(crate) time: f64,
    pub(crate) system: LinearSystem,
    /// Linearisation and system of the present state. ∂φ/∂t in `system_data.rows` is the last step's.
    pub(crate) system_data: SystemData,
    /// Active set of the rows with bounds.
    pub(crate) active_set: ActiveSet,
    pub(crate) activation: Activation,
    /// Slip of cables over their sheaves.
    pub(crate) slip: Slip,
    pub(crate) winches: Winches,
    pub(crate) contacts: Contacts,
    pub(crate) history: History,
    pub(crate) multipliers: Multipliers,
    pub(crate) output: StepOutput,
    pub(crate) progress: Progress,
    pub(crate) guarded: GuardState,
    /// Totals since the last call that returned a report.
    pub(crate) tally: Tally,
    /// Work of the present step and its bound.
    pub(crate) effort: Effort,
}

/// Parts of the step that a scene has work for, found as the step is built.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Uses {
    /// Rows with bounds, or rows that events have made and that are young as those are.
    pub(crate) bounds: bool,
    /// Cables over sheaves with friction; their rows have bounds.
    pub(crate) slip: bool,
    pub(crate) winches: bool,
    /// Shapes that may touch.
    pub(crate) contacts: bool,
}

/// Output of a step besides its report.
pub(crate) struct StepOutput {
    /// Forces reported of the last step.
    pub(crate) reported: Reported,
    pub(crate) account: Account,
    /// Samples of the error of the linear algebra, where it is estimated.
    pub(crate) sample: Option<Box<Sample>>,
}

/// How far the present state is.
pub(crate) struct Progress {
    /// Set once the first step has begun.
    pub(crate) started: bool,
    /// Bodies added since the last step, whose velocities still belong to the same instant as the
    /// positions.
    pub(crate) newly_added: Vec<usize>,
    pub(crate) stage: Stage,
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

/// Part of a step from which on one solve is all of it.
const WHOLE: f64 = 1.0 - 1e-9;

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

impl Step {
    /// A step of the scene with the solver, which is taken where nothing fails, or else with one that the options name. A scene
    /// that asks for its static equilibrium is put there.
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
        Self::new(scene, options, given)
    }

    /// [`build`](Self::build) for a valid scene and valid options, with cables laid and at
    /// equilibrium.
    pub(crate) fn new(
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
        let mut active_set = ActiveSet::new(&system_data);
        active_set.join(slip.chains());
        let bounded = system_data.rows.bounds.len();
        let winches = Winches::new(&scene);
        Ok(Self {
            uses: Uses {
                bounds: bounded > 0,
                slip: !slip.is_empty(),
                winches: !winches.all.is_empty(),
                contacts: contacts.can_be(),
            },
            time: 0.0,
            system: LinearSystem {
                solver,
                elimination,
                chosen,
                matrix: SymBlockMatrix::zeros(assembly_map.pattern.clone()),
                assembly_map,
                rhs: Aligned::new(dim),
                x: Aligned::new(dim),
                scratch: RefineScratch::new(dim),
                in_rows: [(); 2].map(|()| Aligned::new(rows)),
                columns: Default::default(),
            },
            multipliers: Multipliers {
                mu: Aligned::new(rows),
                mu_dt: dt,
                tension: Aligned::new(rows),
                tension_known: false,
            },
            progress: Progress {
                started: false,
                newly_added: Vec::new(),
                stage: Stage::Unsolved,
            },
            guarded: GuardState {
                hold_off: 0,
                division: Division::new(rows, bounded),
                step_start: state.clone(),
                substep_start: state,
                search: Search::new(rows, scene.bodies.len()),
            },
            output: StepOutput {
                reported: Reported::new(rows),
                account: Account::default(),
                sample: None,
            },
            winches,
            activation: Activation::new(rows, bounded),
            tally: Tally::start(),
            effort: Effort::default(),
            history,
            active_set,
            slip,
            contacts,
            system_data,
            scene,
            options,
        })
    }

    /// Length of a sub-step, or of a part of a divided one \[s].
    pub(crate) fn substep(&self) -> f64 {
        let parts = self.options.substeps as f64 * f64::from(self.guarded.division.parts);
        self.options.dt / parts * f64::from(self.guarded.division.taken)
    }

    /// All cables have a way over their sheaves.
    pub(crate) fn check_paths(&self) -> Result<(), StepError> {
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
    pub(crate) fn check_motors(&self) -> Result<(), StepError> {
        for &c in self.system_data.rows.others() {
            if let Constraint::Hinge(hinge) = &self.scene.constraints[c]
                && hinge.turn(&self.scene.bodies) * self.substep() > FASTEST
            {
                return Err(self.off_path(c, SPINS));
            }
        }
        Ok(())
    }

    pub(crate) fn off_path(&self, constraint: usize, reason: &'static str) -> StepError {
        StepError::OffPath {
            cable: self.scene.constraint_names[constraint].clone(),
            reason,
            time: self.time,
        }
    }

    /// A sub-step, or what the guard makes of one.
    pub(crate) fn take_substep(&mut self) -> Result<(), StepError> {
        match self.options.guard {
            None => self.linear_substep(),
            Some(guard) => self.guarded_substep(guard),
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

    /// Before the first step of a run, the blow of what moves against rigid rows.
    pub(crate) fn strike_at_start(&mut self) -> Result<(), StepError> {
        let is_first = !self.progress.started && self.time == 0.0;
        if is_first && self.options.scheme.is_staggered() {
            self.strike_rigid_rows()?;
        }
        Ok(())
    }

    /// The multipliers of the geometric stiffness, and the start of bodies whose velocities have still to go half a step back.
    pub(crate) fn start(&mut self) -> Result<(), StepError> {
        self.guarded.division.from_start = false;
        self.note_stage();
        if self.progress.started && self.progress.newly_added.is_empty() {
            self.find_tension()
        } else {
            self.start_bodies()
        }
    }

    /// A solve without geometric stiffness, where there are no multipliers to make it of.
    pub(crate) fn find_tension(&mut self) -> Result<(), StepError> {
        if self.options.stiffness == GeometricStiffness::Off || self.multipliers.tension_known {
            return Ok(());
        }
        self.solve_scheme(GeometricStiffness::Off)
    }

    /// The second half of a sub-step, which leaves the windings of twist rows, so that it can be taken back.
    pub(crate) fn update(&mut self) -> Result<(), StepError> {
        if self.progress.stage != Stage::Solved {
            let source = SolveError::OutOfOrder {
                called: "advance",
                needs: "solve",
            };
            return Err(self.culprit(source));
        }
        self.progress.stage = Stage::Unsolved;
        self.progress.started = true;
        let dt = self.substep();
        self.system_data
            .update_velocity_change(&self.multipliers.mu);
        self.system_data.predict(dt);
        self.history
            .accept(&self.system_data.v, &self.system_data.rows.phi_t);
        self.time += dt;
        self.move_bodies(dt)?;
        if self.uses.slip {
            self.slip.move_lengths(&mut self.scene, dt, self.time);
        }
        self.progress.stage = Stage::Advanced {
            dt,
            implicit: false,
        };
        self.system_data.rows.update_state(&self.scene, self.time);
        if self.uses.winches {
            self.active_set.run_out(&mut self.system_data.rows);
        }
        Ok(())
    }

    /// v⁺ = v + Δv from `system_data`, then positions, over `dt`.
    pub(crate) fn move_bodies(&mut self, dt: f64) -> Result<(), StepError> {
        let SystemData { inertia, v, dv, .. } = &self.system_data;
        let bodies = &mut self.scene.bodies;
        motion::move_bodies(bodies, &inertia.rods, &inertia.others, v, dv, dt)
            .map_err(|i| self.not_finite(i))
    }

    /// A sub-step of the scheme stands, with the blows at its end.
    pub(crate) fn accept_linear(&mut self) -> Result<(), StepError> {
        let dt = self.progress.stage.advanced();
        if self.options.energy_tolerance.is_some() {
            self.account(dt, false);
        }
        self.accept();
        self.tally.end(Phase::Update);
        if self.uses.contacts && !self.contacts.is_empty() {
            self.rebound()?;
        }
        self.add_substep(dt);
        Ok(())
    }

    /// The present state is not taken back any more: angles are followed through their turns, and drums that slipped
    /// have paid out.
    pub(crate) fn accept(&mut self) {
        let rows = &mut self.system_data.rows;
        let mut changes = rows.follow_windings(&mut self.scene, self.time);
        if self.uses.bounds {
            self.activation.accept(&self.active_set);
            changes |= self.pay_out();
        }
        if changes {
            self.system_data.rows.update_state(&self.scene, self.time);
        }
        if self.uses.winches {
            changes |= self.follow_winches();
        }
        if changes || self.uses.slip && self.slip.slips() {
            self.system_data.rescale(&self.scene);
        }
    }

    /// A sub-step of `dt` is final: its forces count towards the means. The only solve of a step needs no mean.
    pub(crate) fn add_substep(&mut self, dt: f64) {
        if dt < WHOLE * self.options.dt || self.output.reported.opened {
            self.accumulate_forces(dt);
        }
    }

    /// These rows without bounds, which events have made, are young.
    pub(crate) fn make_young(&mut self, made: Vec<Made>) {
        self.uses.bounds |= !made.is_empty();
        self.activation.make(made);
    }

    /// Forgets the output of the last step.
    pub(crate) fn forget_output(&mut self) {
        self.output.reported.forget();
        self.system_data.rows.lost = None;
    }

    /// Clears what failed work has left: of any size, so that the next solve finds its tension anew, and starts from zero.
    pub(crate) fn clear_failure(&mut self) {
        self.progress.stage.unsolve();
        self.multipliers.tension_known = false;
        self.multipliers.mu.fill(0.0);
        self.output.account.close();
        self.output.reported.met.clear();
    }
}
