//! Measurements for a row of the main job: errors on common states, the motion, the hanging cable,
//! the times.

use super::trial::{self, Trial};
use super::{Case, Config, Record, Task, Untimed};
use crate::statics;
use std::time::{Duration, Instant};
use taut_ground::claim::{over, over_letter};
use taut_ground::errors::worse;
use taut_ground::pace;
use taut_ground::trajectory::{Timing, Trajectory, simulate_driven, steps_in};
use taut_integrator::{Phase, StepError, StepOptions, StepReport};
use taut_solver::{backward_error, forward_error};

/// The untimed part of all rows of a task.
pub(super) fn task_rows(config: &Config, case: &Case, task: &Task) -> Vec<Untimed> {
    let mut rows: Vec<Untimed> = Vec::new();
    for &rung in &task.rungs {
        let trial = task.trial_at(rung);
        // Where no solve needed all the iterations allowed, more of them change nothing.
        let row = match rows.last().cloned() {
            Some((last, true)) => {
                let options = trial.text();
                let row = Record {
                    iterations: rung,
                    options,
                    ..last
                };
                (row, true)
            }
            _ => measure_row(config, case, &trial, rung),
        };
        rows.push(row);
    }
    rows
}

impl Record {
    /// An empty row, to be filled in.
    fn new(config: &Config, case: &Case, trial: &Trial, rung: usize) -> Self {
        Self {
            scene: case.name.clone(),
            segments: case.segments(),
            mass_ratio: case.mass_ratio,
            joints: case.motion.scene.constraints.len(),
            backend: trial.family(),
            options: trial.text(),
            iterations: rung,
            iterations_used: 0.0,
            dt: config.dt,
            refinements: trial.plain_options(config.dt).refinements,
            step_ns: f64::NAN,
            step_ns_min: f64::NAN,
            solve_ns: f64::NAN,
            refine_ns: f64::NAN,
            backward_error: f64::NAN,
            backward_error_componentwise: f64::NAN,
            forward_error: f64::NAN,
            forward_error_unrefined: f64::NAN,
            velocity_error: None,
            complementarity: None,
            elongation_error: None,
            elongation_error_continuum: None,
            load_error_m: None,
            energy_drift: None,
            max_violation_m: None,
            stable: false,
            simulated_s: config.time,
            failure: None,
            claimed_converged: None,
            verified_converged: None,
            verified_to_rounding: None,
            frames: case.exact.len(),
            fastest_at: Vec::new(),
            error: None,
        }
    }
}

/// The untimed part of one row.
fn measure_row(config: &Config, case: &Case, trial: &Trial, rung: usize) -> Untimed {
    let mut row = Record::new(config, case, trial, rung);
    if let Err(e) = measure_algebra(config, case, trial, &mut row) {
        // Drops the measurements before the failure: their maximum is not that of all frames.
        row = Record {
            error: Some(e.to_string()),
            ..Record::new(config, case, trial, rung)
        };
    }
    if case.has_contacts() && row.error.is_none() {
        match trial::velocities(case, trial.plain_options(config.dt)) {
            Ok((velocities, violation)) => {
                let least = case.least_speed(config.dt);
                row.velocity_error = Some(trial::distance(&velocities, &case.velocities, least));
                row.complementarity = Some(violation);
            }
            Err(e) => row.error = Some(e.to_string()),
        }
    }
    let mut claimed = row.claimed_converged.unwrap_or(0);
    match run_physics(config, case, trial) {
        Ok(run) => {
            claimed += run.claimed;
            row.stable = run.failure.is_none() && case.failure.is_none();
            row.load_error_m = Some(run.max_load_error(&case.reference.load));
            row.max_violation_m = Some(run.max_violation());
            // A drive that does not end has no energy to keep.
            let hoist = case.hoist.as_ref().filter(|_| run.failure.is_none());
            let rest = hoist.map(|hoist| hoist.move_start + hoist.move_duration);
            row.energy_drift = rest.and_then(|rest| run.energy_drift(rest));
            row.failure = run.failure;
        }
        Err(e) => row.error = Some(e.to_string()),
    }
    let mut solves = row.frames + steps_in(config.time, config.dt);
    if let Some(hoist) = &case.hoist {
        solves += statics::HOLD_STEPS;
        // A cable that is not held at all has no elongation, which is a result and no fault of the row's other figures.
        if let Ok(held) = statics::hold(hoist, &trial.plain_options(config.dt)) {
            claimed += held.claimed;
            row.elongation_error = Some(held.error);
            row.elongation_error_continuum = Some(held.error_continuum);
        }
    }
    let settled = row.iterations > 0 && row.error.is_none() && claimed == solves;
    (row, settled)
}

/// Errors of the multipliers on the common states. Iterations start from zero at the first state, which is not measured,
/// and from their own last multipliers at each later one, as they would in a run.
fn measure_algebra(
    config: &Config,
    case: &Case,
    trial: &Trial,
    row: &mut Record,
) -> Result<(), StepError> {
    let options = trial.plain_options(config.dt);
    let unrefined = StepOptions {
        refinements: 0,
        ..options.clone()
    };
    let tolerance = trial.choice.backend.tolerance();
    let mut stepper = case.at_common_states(unrefined)?;
    let (mut iterations, mut claimed, mut verified, mut to_rounding) = (0, 0, 0, 0);
    row.backward_error = 0.0;
    row.backward_error_componentwise = 0.0;
    row.forward_error_unrefined = 0.0;
    for (i, state) in case.reference.states.iter().enumerate() {
        case.put(i, &mut stepper)?;
        let report = stepper.solve()?;
        let Some(exact) = i.checked_sub(1).map(|i| &case.exact[i]) else {
            continue;
        };
        iterations += report.iterations;
        let (a, b, x) = stepper.system();
        let solve_error = |source| StepError::Solve {
            source,
            culprit: None,
            time: state.time,
        };
        let errors = backward_error(a, b, x).map_err(solve_error)?;
        row.backward_error = worse(row.backward_error, errors.normwise);
        row.backward_error_componentwise =
            worse(row.backward_error_componentwise, errors.componentwise);
        let error = forward_error(stepper.multipliers(), exact);
        row.forward_error_unrefined = worse(row.forward_error_unrefined, error);
        if report.solve.is_claim() {
            claimed += 1;
            let r = taut_solver::residual(a, b, x).map_err(solve_error)?;
            let scale = if norm(b) > 0.0 { norm(b) } else { 1.0 };
            let size = norm(&r) / scale;
            verified += usize::from(over_letter(size, errors.normwise, tolerance) <= 1.0);
            to_rounding += usize::from(over(size, errors.normwise, tolerance) <= 1.0);
        }
    }
    row.iterations_used = iterations as f64 / row.frames as f64;
    row.claimed_converged = Some(claimed);
    row.verified_converged = Some(verified);
    row.verified_to_rounding = Some(to_rounding);
    row.forward_error = row.forward_error_unrefined;
    if options.refinements > 0 {
        let mut stepper = case.at_common_states(options)?;
        row.forward_error = 0.0;
        for i in 0..case.reference.states.len() {
            case.put(i, &mut stepper)?;
            let Some(exact) = i.checked_sub(1).map(|i| &case.exact[i]) else {
                continue;
            };
            stepper.solve()?;
            let error = forward_error(stepper.multipliers(), exact);
            row.forward_error = worse(row.forward_error, error);
        }
    }
    Ok(())
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn run_physics(config: &Config, case: &Case, trial: &Trial) -> Result<Trajectory, StepError> {
    let mut stepper = case.at_start(trial.plain_options(config.dt))?;
    let (inputs, limits) = (&case.motion.inputs, case.limits());
    Ok(simulate_driven(
        &mut stepper,
        inputs,
        config.time,
        limits,
        |_| {},
    ))
}

/// The rows of a task with their times, taken one after the other.
pub(super) fn time_rows(
    config: &Config,
    case: &Case,
    task: &Task,
    rows: &[Untimed],
) -> Vec<Record> {
    let mut known: Option<[f64; 4]> = None;
    let mut timed = Vec::new();
    for (row, is_settled) in rows {
        let mut row = row.clone();
        // Rows that converged below their limit do the same work as the row before.
        let times = known.map_or_else(
            || time_row(config, case, &task.trial_at(row.iterations)),
            Ok,
        );
        match times {
            Ok(times) => {
                [row.step_ns, row.step_ns_min, row.solve_ns, row.refine_ns] = times;
                known = is_settled.then_some(times);
            }
            Err(e) => {
                row.error.get_or_insert(e.to_string());
            }
        }
        timed.push(row);
    }
    timed
}

/// Steps from the common states in turn, warm started as in a run, taken as they come: [step, minimum, solve, refine]
/// in ns.
fn time_row(config: &Config, case: &Case, trial: &Trial) -> Result<[f64; 4], StepError> {
    let options = trial.plain_options(config.dt);
    let mut stepper = case.at_common_states(options.clone())?;
    let cold = vec![0.0; stepper.multipliers().len()];
    let mut reports: Vec<StepReport> = Vec::new();
    let start = Instant::now();
    let mut warmed_up = false;
    while reports.is_empty() || start.elapsed() < config.timing_budget {
        if case.motion.inputs.names().is_empty() {
            stepper.set_multipliers(&cold)?;
        } else {
            stepper = case.at_common_states(options.clone())?;
        }
        for i in 0..case.reference.states.len() {
            case.put(i, &mut stepper)?;
            let report = pace::step(&mut stepper)?;
            if i > 0 {
                reports.push(report);
            }
        }
        // The first pass only warms up, unless it takes so long that it is warm after its first steps.
        if !warmed_up && start.elapsed() < config.timing_budget / 2 {
            reports.clear();
        }
        warmed_up = true;
    }
    let of = |f: fn(&StepReport) -> Duration| Timing::of(reports.iter().map(f));
    let step = of(|r| r.phases.total());
    let solve = of(|r| r.phases.linear());
    let refine = of(|r| r.phases.of(Phase::Refine));
    Ok([step.median, step.min, solve.median, refine.median])
}
