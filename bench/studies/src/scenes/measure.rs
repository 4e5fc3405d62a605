//! The common states of the networks, and one solver's errors and times there.

use super::{BAR, Config, ITERATIVE_RUN_ROWS, RUN_ROWS, Record, SWING, Task, WARM_UP};
use nalgebra::Vector3;
use std::time::{Duration, Instant};
use taut_ground::choice::Choice;
use taut_ground::reference::{Snapshot, reference_choice};
use taut_ground::trajectory::{Timing, load_position, steps_in};
use taut_integrator::{StepError, StepOptions, StepReport, Stepper};
use taut_model::{Network, NetworkParams, Scene};
use taut_solver::{Status, forward_error};

/// Fewest timed steps of a row.
const REPEATS: usize = 3;

/// A network with what all its rows share.
pub(super) struct Case {
    pub(super) network: Network,
    size: usize,
    mass_ratio: f64,
    /// In equilibrium, swinging.
    start: Scene,
    pub(super) rows: usize,
    /// The common state, and the impulses of the step that led there, which iterations start from.
    state: Snapshot,
    guess: Vec<f64>,
    /// Exact multipliers of the common state.
    exact: Vec<f64>,
    /// The load's place after the run; none for a case that is too large.
    load: Option<Vector3<f64>>,
    /// Largest distance of two bodies along an axis \[m].
    extent: f64,
}

/// The solver with that limit of iterations, where it iterates.
pub(super) fn at_rung(choice: &Choice, rung: usize) -> Choice {
    Choice {
        backend: match rung {
            0 => choice.backend.clone(),
            _ => choice.backend.with_iterations(rung),
        },
        form: choice.form,
    }
}

/// The scene in its static equilibrium, with the velocities of a rigid swing about the x axis, on which its anchors
/// are, and its seeds besides. Where rounding of a thousand short segments hides the equilibrium it starts unstrained.
///
/// # Errors
/// As [`Stepper::new`].
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
        let mut stepper = Stepper::new(start.clone(), options)?;
        for _ in 0..WARM_UP {
            stepper.step()?;
        }
        let guess = stepper.multipliers().to_vec();
        let state = Snapshot::of(&stepper);
        let rows = guess.len();
        let mut load = None;
        if rows <= RUN_ROWS {
            for _ in WARM_UP..steps_in(config.time, config.dt) {
                stepper.step()?;
            }
            load = Some(load_position(stepper.scene()));
        }
        // As the rows do: the past of the run is not part of the state.
        state.put(&mut stepper)?;
        let exact = stepper.reference_multipliers()?;
        let extent = |k: usize| {
            let places = start.bodies.position.iter().map(|x| x[k]);
            places.clone().fold(f64::MIN, f64::max) - places.fold(f64::MAX, f64::min)
        };
        let extent = (0..3).map(extent).fold(0.0, f64::max);
        Ok(Self {
            network: params.network,
            size,
            mass_ratio: params.mass_ratio,
            start,
            rows,
            state,
            guess,
            exact,
            load,
            extent,
        })
    }

    fn stepper(&self, options: StepOptions) -> Result<Stepper, StepError> {
        let mut stepper = Stepper::new(self.start.clone(), options)?;
        self.state.put(&mut stepper)?;
        stepper.set_multipliers(&self.guess)?;
        Ok(stepper)
    }
}

fn options(config: &Config, task: &Task) -> StepOptions {
    StepOptions {
        elimination: task.elimination,
        ..task.choice.plain_options(config.dt)
    }
}

/// The untimed part of a row.
pub(super) fn row(config: &Config, case: &Case, task: &Task) -> Record {
    let choice = &task.choice;
    let options = options(config, task);
    let standard = task.elimination == taut_integrator::Elimination::Auto;
    let backend = match standard {
        true => choice.family(),
        false => format!("{} {}", choice.family(), task.elimination),
    };
    let mut row = Record {
        scene: case.network.name().to_owned(),
        size: case.size,
        mass_ratio: case.mass_ratio,
        bodies: case.start.bodies.len(),
        rows: case.rows,
        backend,
        options: choice.to_string(),
        elimination: task.elimination.to_string(),
        iterations: task.rung,
        iterations_used: 0,
        dt: config.dt,
        refinements: options.refinements,
        status: String::new(),
        said: None,
        step_ns: f64::NAN,
        step_ns_min: f64::NAN,
        solve_ns: f64::NAN,
        solve_ns_min: f64::NAN,
        solve_ns_per_row: f64::NAN,
        forward_error: None,
        forward_error_unrefined: None,
        load_difference: None,
        factor_entries: None,
        within_bar: None,
        error: None,
    };
    let done = algebra(case, options.clone(), &mut row)
        .and_then(|()| motion(config, case, options, &mut row));
    if let Err(e) = done {
        row.error = Some(e.to_string());
    }
    if !choice.backend.is_iterative() {
        let errors = [row.forward_error, row.load_difference];
        let kept = errors.iter().flatten().all(|e| *e <= BAR);
        row.within_bar = Some(kept && row.error.is_none());
    }
    row
}

/// The errors of one solve of the common system, with and without refinement.
fn algebra(case: &Case, options: StepOptions, row: &mut Record) -> Result<(), StepError> {
    let refinements = options.refinements;
    let mut stepper = case.stepper(StepOptions {
        refinements: 0,
        ..options.clone()
    })?;
    let report = stepper.solve()?;
    row.iterations_used = report.iterations;
    row.said = Some(report.solve);
    row.status = match report.solve.status {
        Status::Direct => "direct",
        Status::Converged => "converged",
        Status::IterationLimit => "limit",
        _ => "stalled",
    }
    .to_owned();
    let pattern = stepper.system().0.pattern();
    // A second analysis, for its report alone; the factorisation goes with it.
    let analysed = options.backend.create().and_then(|mut solver| {
        let pattern = pattern.clone();
        solver.analyze(&pattern)
    });
    row.factor_entries = analysed.ok().and_then(|r| r.factor_entries);
    let exact = &case.exact;
    let error = forward_error(stepper.multipliers(), exact);
    row.forward_error_unrefined = Some(error);
    row.forward_error = Some(error);
    if refinements > 0 {
        let mut stepper = case.stepper(options)?;
        stepper.solve()?;
        row.forward_error = Some(forward_error(stepper.multipliers(), exact));
    }
    Ok(())
}

/// The load's place at the end of the run.
fn motion(
    config: &Config,
    case: &Case,
    options: StepOptions,
    row: &mut Record,
) -> Result<(), StepError> {
    let Some(load) = &case.load else {
        return Ok(());
    };
    if row.iterations > 0 && case.rows > ITERATIVE_RUN_ROWS {
        return Ok(());
    }
    let mut stepper = Stepper::new(case.start.clone(), options)?;
    for _ in 0..steps_in(config.time, config.dt) {
        match stepper.step() {
            Ok(_) => {}
            // An iteration that stops early may lose the motion: a result.
            Err(StepError::NonFinite { .. } | StepError::Solve { .. }) if row.iterations > 0 => {
                return Ok(());
            }
            Err(e) => return Err(e),
        }
    }
    let way = load_position(stepper.scene()) - load;
    row.load_difference = Some(way.norm() / case.extent);
    Ok(())
}

/// Times the step from the common state.
pub(super) fn time(config: &Config, case: &Case, task: &Task, row: &mut Record) {
    if row.error.is_some() {
        return;
    }
    match reports(config, case, task) {
        Ok(reports) => {
            let of = |f: fn(&StepReport) -> Duration| Timing::of(reports.iter().map(f));
            let step = of(|r| r.phases.total());
            let solve = of(|r| r.phases.linear());
            (row.step_ns, row.step_ns_min) = (step.median, step.min);
            (row.solve_ns, row.solve_ns_min) = (solve.median, solve.min);
            row.solve_ns_per_row = solve.median / case.rows as f64;
        }
        Err(e) => row.error = Some(e.to_string()),
    }
}

fn reports(config: &Config, case: &Case, task: &Task) -> Result<Vec<StepReport>, StepError> {
    let mut stepper = case.stepper(options(config, task))?;
    let mut reports: Vec<StepReport> = Vec::new();
    let start = Instant::now();
    // The first step warms up.
    let mut warmed_up = false;
    while reports.len() < REPEATS || start.elapsed() < config.timing_budget {
        case.state.put(&mut stepper)?;
        stepper.set_multipliers(&case.guess)?;
        reports.push(stepper.step()?);
        if !warmed_up {
            reports.clear();
        }
        warmed_up = true;
    }
    Ok(reports)
}
