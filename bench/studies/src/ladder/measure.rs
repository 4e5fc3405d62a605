//! Measurements for a row of the main job: errors on common states, the motion, the hanging cable,
//! the times.

use super::trial::{self, Trial};
use super::{Case, Config, LadderRow, Task, Untimed};
use crate::statics;
use crate::systems::failed;
use crate::systems::turns::{self, Work};
use taut_integrator::{StepError, StepOptions};
use taut_measure::claim::{over, over_letter};
use taut_measure::errors::worse;
use taut_measure::pace;
use taut_measure::trajectory::{Trajectory, simulate_driven, steps_in};
use taut_solver::{backward_error, forward_error};

pub(super) fn task_rows(config: &Config, case: &Case, task: &Task) -> Vec<Untimed> {
    let mut rows: Vec<Untimed> = Vec::new();
    for &rung in &task.rungs {
        let trial = task.trial_at(rung);
        // Where no solve needed all the iterations allowed, more of them change nothing.
        let row = match rows.last().cloned() {
            Some((last, true)) => {
                let options = trial.text();
                let row = LadderRow {
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

impl LadderRow {
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
            dt: config.dt,
            refinements: trial.plain_options(config.dt).refinements,
            simulated_s: config.time,
            frames: case.exact.len(),
            ..Self::default()
        }
    }
}

fn measure_row(config: &Config, case: &Case, trial: &Trial, rung: usize) -> Untimed {
    let mut row = LadderRow::new(config, case, trial, rung);
    if let Err(e) = measure_algebra(config, case, trial, &mut row) {
        // Drops the measurements before the failure: their maximum is not that of all frames.
        row = LadderRow {
            error: Some(e.to_string()),
            ..LadderRow::new(config, case, trial, rung)
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

/// A residual's excess over what a claim says of it.
type Over = fn(f64, f64, Option<f64>) -> f64;

/// What the solves from the common states come to: the largest errors, and counts of all.
#[derive(Default)]
struct Algebra {
    iterations: usize,
    /// Claims of a solution, those that are true by the letter, those that are true to rounding.
    claims: [usize; 3],
    forward: f64,
    normwise: f64,
    componentwise: f64,
}

/// Iterations start from zero at the first state, which is not measured, and from their own last multipliers at each later
/// one, as they would in a run.
fn solves(case: &Case, trial: &Trial, options: StepOptions) -> Result<Algebra, StepError> {
    let tolerance = trial.choice.backend.tolerance();
    let solved = case.in_each(options, |stepper| {
        let report = stepper.solve()?;
        let (a, b, x) = stepper.system();
        let errors = backward_error(a, b, x).map_err(failed)?;
        let mut claims = [0; 3];
        if report.solve.is_claim() {
            let r = taut_solver::residual(a, b, x).map_err(failed)?;
            let scale = if norm(b) > 0.0 { norm(b) } else { 1.0 };
            let is_true = |over: Over| over(norm(&r) / scale, errors.normwise, tolerance) <= 1.0;
            claims = [true, is_true(over_letter), is_true(over)].map(usize::from);
        }
        let multipliers = stepper.multipliers().to_vec();
        Ok((report.iterations, claims, errors, multipliers))
    })?;
    let mut all = Algebra::default();
    for ((iterations, claims, errors, multipliers), exact) in solved.into_iter().zip(&case.exact) {
        all.iterations += iterations;
        all.claims = std::array::from_fn(|k| all.claims[k] + claims[k]);
        all.normwise = worse(all.normwise, errors.normwise);
        all.componentwise = worse(all.componentwise, errors.componentwise);
        all.forward = worse(all.forward, forward_error(&multipliers, exact));
    }
    Ok(all)
}

/// Errors of the multipliers on the common states.
fn measure_algebra(
    config: &Config,
    case: &Case,
    trial: &Trial,
    row: &mut LadderRow,
) -> Result<(), StepError> {
    let options = trial.plain_options(config.dt);
    let unrefined = StepOptions {
        refinements: 0,
        ..options.clone()
    };
    let plain = solves(case, trial, unrefined)?;
    row.backward_error = Some(plain.normwise);
    row.backward_error_componentwise = Some(plain.componentwise);
    row.forward_error_unrefined = Some(plain.forward);
    row.iterations_used = plain.iterations as f64 / row.frames as f64;
    [
        row.claimed_converged,
        row.verified_converged,
        row.verified_to_rounding,
    ] = plain.claims.map(Some);
    row.forward_error = Some(match options.refinements {
        0 => plain.forward,
        _ => solves(case, trial, options)?.forward,
    });
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

/// Steps from the common states in turn, warm started as in a run, taken as they come.
pub(super) fn work<'a>(
    config: &Config,
    case: &'a Case,
    trial: &Trial,
) -> Result<Work<'a>, StepError> {
    let options = trial.plain_options(config.dt);
    let mut stepper = case.at_common_states(options.clone())?;
    let cold = vec![0.0; stepper.multipliers().len()];
    let mut states = (0..case.reference.states.len()).cycle();
    let mut step = move || {
        let state = states.next().unwrap_or_default();
        if state == 0 && case.motion.inputs.names().is_empty() {
            stepper.set_multipliers(&cold)?;
        } else if state == 0 {
            stepper = case.at_common_states(options.clone())?;
        }
        case.put(state, &mut stepper)?;
        let phases = pace::step(&mut stepper)?.phases;
        Ok::<_, StepError>((state, turns::spent(&phases)))
    };
    Ok(Box::new(move |passes| {
        turns::sum(passes, || match step()? {
            // The first state is only started from.
            (0, _) => Ok(step()?.1),
            (_, spent) => Ok(spent),
        })
    }))
}

/// Rows with their times, in the order of the tasks. Those that converged below their limit do the same work as the row
/// before, and have its times.
pub(super) fn timed(
    config: &Config,
    case: &Case,
    tasks: &[Task],
    rows: &[Vec<Untimed>],
) -> Vec<LadderRow> {
    let all = || {
        tasks.iter().zip(rows).flat_map(|(task, rows)| {
            let before = std::iter::once(false).chain(rows.iter().map(|(_, settled)| *settled));
            rows.iter()
                .zip(before)
                .map(move |((row, _), repeats)| (task, row, repeats))
        })
    };
    let works = all().filter(|(.., repeats)| !repeats);
    let works = works.map(|(task, row, _)| work(config, case, &task.trial_at(row.iterations)));
    let mut times = turns::times(works, config.timing_budget).into_iter();
    let mut last = None;
    let timed = all().map(|(_, row, repeats)| {
        if !repeats {
            last = times.next();
        }
        let mut row = row.clone();
        match &last {
            Some(Ok([step, solve, refine])) => {
                (row.step_ns, row.step_ns_min) = (Some(step.median), Some(step.least));
                (row.solve_ns, row.refine_ns) = (Some(solve.median), Some(refine.median));
            }
            Some(Err(e)) => {
                row.error.get_or_insert(e.to_string());
            }
            None => {}
        }
        row
    });
    timed.collect()
}
