//! The common states of the networks, and one solver's errors there.

use super::{BAR, Config, ITERATIVE_RUN_ROWS, RUN_ROWS, SWING, SceneRow, WARM_UP};
use crate::systems::{Start, State};
use nalgebra::Vector3;
use taut_integrator::{Elimination, StepError, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::matrix::solve::status;
use taut_measure::reference::reference_choice;
use taut_measure::trajectory::{load_position, steps_in};
use taut_model::{Network, NetworkParams, Scene};
use taut_solver::SolveReport;

/// A network with what all its rows share.
pub(super) struct Case {
    pub(super) network: Network,
    shared: SceneRow,
    pub(super) state: State,
    /// The load's place after the run; none for a case that is too large.
    load: Option<Vector3<f64>>,
    /// Largest distance of two bodies along an axis \[m].
    extent: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Task {
    pub(super) choice: Choice,
    pub(super) elimination: Elimination,
    pub(super) rung: usize,
}

impl Task {
    pub(super) fn options(&self, config: &Config) -> StepOptions {
        StepOptions {
            elimination: self.elimination,
            ..self.choice.plain_options(config.dt)
        }
    }
}

/// The scene in its static equilibrium, with the velocities of a rigid swing about the x axis, on which its anchors
/// are, and its seeds besides. Where rounding of a thousand short segments hides the equilibrium it starts unstrained.
pub fn swinging(params: &NetworkParams, dt: f64) -> Result<Scene, StepError> {
    let options = reference_choice().plain_options(dt);
    let mut scene = match Stepper::new(params.build()?, options) {
        Ok(stepper) => stepper.into_scene(),
        Err(StepError::NoEquilibrium { .. }) => Scene {
            start_in_equilibrium: false,
            ..params.build()?
        },
        Err(e) => return Err(e),
    };
    swing(&mut scene);
    Ok(scene)
}

/// Sets all bodies swinging about the x axis as a rigid whole.
fn swing(scene: &mut Scene) {
    let spin = Vector3::x() * SWING;
    let bodies = &mut scene.bodies;
    for i in 0..bodies.len() {
        bodies.velocity[i] += spin.cross(&bodies.position[i]);
        if !bodies.is_point(i) {
            bodies.angular_velocity[i] += spin;
        }
    }
}

impl Case {
    pub(super) fn new(
        config: &Config,
        size: usize,
        params: &NetworkParams,
    ) -> Result<Self, StepError> {
        let start = swinging(params, config.dt)?;
        let options = reference_choice().plain_options(config.dt);
        let state = State::after(WARM_UP, start.clone(), options.clone())?;
        let extent = |k: usize| {
            let places = start.bodies.position.iter().map(|x| x[k]);
            places.clone().fold(f64::MIN, f64::max) - places.fold(f64::MAX, f64::min)
        };
        let shared = SceneRow {
            scene: params.network.name().to_owned(),
            size,
            mass_ratio: params.mass_ratio,
            bodies: start.bodies.len(),
            rows: state.rows(),
            dt: config.dt,
            ..SceneRow::default()
        };
        let is_run = state.rows() <= RUN_ROWS;
        let load = is_run
            .then(|| arrival(config, &start, options))
            .transpose()?;
        Ok(Self {
            network: params.network,
            shared,
            load,
            extent: (0..3).map(extent).fold(0.0, f64::max),
            state,
        })
    }
}

/// The load's place at the end of the run.
fn arrival(
    config: &Config,
    start: &Scene,
    options: StepOptions,
) -> Result<Vector3<f64>, StepError> {
    let mut stepper = Stepper::new(start.clone(), options)?;
    for _ in 0..steps_in(config.time, config.dt) {
        stepper.step()?;
    }
    Ok(load_position(stepper.scene()))
}

/// The untimed part of a row, and what the solver said.
pub(super) fn row(config: &Config, case: &Case, task: &Task) -> (SceneRow, Option<SolveReport>) {
    let choice = &task.choice;
    let mut row = SceneRow {
        backend: match task.elimination {
            Elimination::Auto => choice.family(),
            order => format!("{} {order}", choice.family()),
        },
        options: choice.to_string(),
        elimination: task.elimination.to_string(),
        iterations: task.rung,
        refinements: task.options(config).refinements,
        ..case.shared.clone()
    };
    let said = errors(config, case, task, &mut row);
    row.error = said.as_ref().err().map(ToString::to_string);
    if !choice.backend.is_iterative() {
        let errors = [row.forward_error, row.load_difference];
        let kept = errors.iter().flatten().all(|e| *e <= BAR);
        row.within_bar = Some(kept && row.error.is_none());
    }
    (row, said.ok())
}

/// The errors of one solve of the common system, with and without refinement, and of a run.
fn errors(
    config: &Config,
    case: &Case,
    task: &Task,
    row: &mut SceneRow,
) -> Result<SolveReport, StepError> {
    let options = task.options(config);
    let unrefined = StepOptions {
        refinements: 0,
        ..options.clone()
    };
    let solved = case.state.solve(unrefined.clone(), Start::Warm)?;
    row.iterations_used = solved.iterations;
    row.status = status(solved.report.status).to_owned();
    let stepper = case.state.stepper(unrefined, Start::Warm)?;
    // A second analysis, for its report alone.
    let analysed = options.backend.create().and_then(|mut solver| {
        let pattern = stepper.system().0.pattern().clone();
        solver.analyze(&pattern)
    });
    row.factor_entries = analysed.ok().and_then(|r| r.factor_entries);
    row.forward_error_unrefined = Some(solved.forward);
    row.forward_error = Some(match options.refinements {
        0 => solved.forward,
        _ => case.state.solve(options.clone(), Start::Warm)?.forward,
    });
    let is_run = row.iterations == 0 || row.rows <= ITERATIVE_RUN_ROWS;
    if let Some(load) = case.load.filter(|_| is_run) {
        row.load_difference = match arrival(config, case.state.scene(), options) {
            Ok(place) => Some((place - load).norm() / case.extent),
            // An iteration that stops early may lose the motion: a result.
            Err(StepError::NonFinite { .. } | StepError::Solve { .. }) if row.iterations > 0 => {
                None
            }
            Err(e) => return Err(e),
        };
    }
    Ok(solved.report)
}
