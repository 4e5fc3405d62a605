//! The main job: every solver on the hoist, speed against error, over mass ratios.
//!
//! Three measurements make a row. (1) *Algebra and time*: a sequence of consecutive frames of a finely stepped
//! reference motion gives every solver the same states; its multipliers are compared with those of the KKT system in
//! extended precision, and the step is timed there. (2) *Physics*: the scene is run at Δt with the solver and compared
//! with the reference motion; where the step itself is unstable the row says so. (3) *Statics*: the cable hangs at rest
//! in its exact discrete equilibrium, the multipliers start cold, and half a second later its length is compared.
//! Measurements 2 and 3 run in parallel, the timing afterwards alone.

use crate::choice::Choice;
use crate::reference::{self, Reference};
use crate::statics;
use crate::trajectory::{Failure, Timing, Trajectory, simulate, steps_in};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use std::time::{Duration, Instant};
use taut_integrator::{Phase, StepError, StepReport, Stepper};
use taut_model::HoistParams;
use taut_solver::{Status, backward_error, forward_error};

/// Error levels of the multipliers' relative error: good enough for a game, for a trainer, for a reference.
pub const LEVELS: [f64; 3] = [1e-3, 1e-6, 1e-10];

/// Frames of the reference motion that the algebra is measured on.
const FRAMES: usize = 16;

/// What the main job runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The scene; segments and mass ratio are replaced by those below.
    pub scene: HoistParams,
    /// Numbers of segments.
    pub segments: Vec<usize>,
    /// Mass ratios load/segment.
    pub ratios: Vec<f64>,
    /// Solvers; iterative ones run over the ladder of iterations.
    pub choices: Vec<Choice>,
    /// Limits of iterations.
    pub iterations: Vec<usize>,
    /// Δt \[s].
    pub dt: f64,
    /// Simulated time \[s].
    pub time: f64,
    /// Time that the timing of a row aims at; at least one pass over the common states is timed.
    pub timing_budget: Duration,
}

impl Default for Config {
    /// 24 and 100 segments, mass ratios 1 to 10⁵, every solver, 2.5 s of an anchor moved by 0.5 m in 1.5 s.
    fn default() -> Self {
        Self {
            scene: HoistParams {
                seed: 1,
                move_x: 0.5,
                move_duration: 1.5,
                ..HoistParams::default()
            },
            segments: vec![24, 100],
            ratios: vec![1.0, 10.0, 1e2, 1e3, 1e4, 1e5],
            choices: Choice::all(),
            iterations: vec![1, 3, 10, 20, 50, 100, 300, 1000],
            dt: 1.0 / 60.0,
            time: 2.5,
            timing_budget: Duration::from_millis(12),
        }
    }
}

impl Config {
    /// A tenth of the work: for CI and a first look.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            segments: vec![24],
            ratios: vec![1.0, 1e3, 1e5],
            iterations: vec![1, 10, 100],
            time: 1.5,
            timing_budget: Duration::from_millis(4),
            ..Self::default()
        }
    }

    fn params(&self, segments: usize, mass_ratio: f64) -> HoistParams {
        HoistParams {
            segments,
            mass_ratio,
            load_mass: None,
            ..self.scene.clone()
        }
    }
}

/// One row: a solver with its options on one scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Name of the scene.
    pub scene: String,
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Backend and form, without iterations.
    pub backend: String,
    /// All options of the backend, as the command line reads them.
    pub options: String,
    /// Limit of iterations; 0 for direct solvers.
    pub iterations: usize,
    /// Mean number of iterations of a step on the common states.
    pub iterations_used: f64,
    /// Δt \[s].
    pub dt: f64,
    /// Refinement sweeps from the pieces in the timed and simulated step.
    pub refinements: usize,
    /// Whole step, median \[ns].
    pub step_ns: f64,
    /// Whole step, minimum \[ns].
    pub step_ns_min: f64,
    /// Factorisation, solve and refinement, median \[ns].
    pub solve_ns: f64,
    /// Refinement alone, median \[ns].
    pub refine_ns: f64,
    /// Normwise backward error on the assembled system, without refinement; largest of the frames.
    pub backward_error: f64,
    /// Componentwise backward error, likewise.
    pub backward_error_componentwise: f64,
    /// Relative error of the multipliers against extended precision, as stepped; largest of the frames.
    pub forward_error: f64,
    /// The same without refinement.
    pub forward_error_unrefined: f64,
    /// Relative error of the hanging cable's elongation against the exact discrete value after half a second.
    pub elongation_error: Option<f64>,
    /// The same against the massless continuum M g L/(YA).
    pub elongation_error_continuum: Option<f64>,
    /// Largest distance of the load from the reference motion while the run was stable \[m].
    pub load_error_m: Option<f64>,
    /// Change of the total energy after the anchor's motion, over the largest kinetic energy since; for stable runs.
    pub energy_drift: Option<f64>,
    /// Largest gap of a joint \[m].
    pub max_violation_m: Option<f64>,
    /// Whether the run of `simulated_s` seconds stayed stable.
    pub stable: bool,
    /// Simulated time asked for \[s].
    pub simulated_s: f64,
    /// How an unstable run ended.
    pub failure: Option<Failure>,
    /// Frames whose iteration claimed convergence.
    pub claimed_converged: usize,
    /// Frames where the true relative residual met the tolerance.
    pub verified_converged: usize,
    /// Frames measured.
    pub frames: usize,
    /// Error levels at which this row is the fastest of its scene.
    pub fastest_at: Vec<f64>,
    /// Whether no solve of the three measurements used up its iterations, so that more of them would change nothing.
    #[serde(skip)]
    pub settled: bool,
    /// Why there are no numbers, where the solver failed on the common states.
    pub error: Option<String>,
}

/// A solver that has no rows, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Omission {
    /// Backend and form.
    pub backend: String,
    /// Why.
    pub reason: String,
}

/// All rows and what is missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Results {
    /// Rows, scene by scene, solvers in the order asked for, iterations ascending.
    pub records: Vec<Record>,
    /// What was left out.
    pub omissions: Vec<Omission>,
    /// Time step of each reference motion: segments, ratio, Δt \[s].
    pub references: Vec<(usize, f64, f64)>,
}

/// A scene of the ladder with what all its rows share.
struct Case {
    params: HoistParams,
    reference: Reference,
    /// Exact multipliers of the states, and those of the frame before the first as the common warm start.
    exact: Vec<Vec<f64>>,
    guess: Vec<f64>,
}

/// A row's work: case, solver, and for iterative ones the limits of iterations.
struct Task {
    case: usize,
    choice: Choice,
    rungs: Vec<usize>,
}

/// Runs the main job. `progress` advances once for each reference, each solver and each timed row.
///
/// # Errors
/// A scene that cannot be built, or a reference motion that fails; a solver's own failure is a row.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Results, StepError> {
    let mut results = Results::default();
    let compiled = compiled_choices(config, &mut results.omissions);
    let scenes: Vec<HoistParams> = config
        .segments
        .iter()
        .flat_map(|&n| config.ratios.iter().map(move |&r| (n, r)))
        .map(|(n, r)| config.params(n, r))
        .collect();
    progress.set_length((scenes.len() * (1 + compiled.len())) as u64);
    progress.set_message("reference motions");
    let cases: Vec<Case> = scenes
        .into_par_iter()
        .map(|params| Case::new(config, params).inspect(|_| progress.inc(1)))
        .collect::<Result<_, _>>()?;
    let tasks = tasks(config, &cases, &compiled, &mut results.omissions);
    progress.set_message("physics");
    let mut rows: Vec<Vec<Record>> = tasks
        .par_iter()
        .map(|task| {
            let rows = task_rows(config, &cases[task.case], task);
            progress.inc(1);
            rows
        })
        .collect();
    progress.set_length(progress.position() + rows.iter().map(Vec::len).sum::<usize>() as u64);
    progress.set_message("timing");
    for (task, rows) in tasks.iter().zip(&mut rows) {
        time_rows(config, &cases[task.case], task, rows, progress);
    }
    results.references = cases
        .iter()
        .map(|c| (c.params.segments, c.params.mass_ratio, c.reference.dt))
        .collect();
    results.records = rows.into_iter().flatten().collect();
    mark_fastest(&mut results.records);
    Ok(results)
}

fn compiled_choices(config: &Config, omissions: &mut Vec<Omission>) -> Vec<Choice> {
    let mut compiled = Vec::new();
    for choice in &config.choices {
        match choice.check() {
            Ok(()) => compiled.push(choice.clone()),
            Err(e) => omissions.push(Omission {
                backend: choice.family(),
                reason: e.to_string(),
            }),
        }
    }
    compiled
}

/// Rows beyond which the dense solver, whose cost is cubic, would outlast all others together.
const DENSE_ROWS: usize = 200;

fn tasks(
    config: &Config,
    cases: &[Case],
    choices: &[Choice],
    omissions: &mut Vec<Omission>,
) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (case, Case { params, guess, .. }) in cases.iter().enumerate() {
        for choice in choices {
            if choice.backend.name() == "dense" && guess.len() > DENSE_ROWS && choices.len() > 1 {
                let reason = format!(
                    "cubic cost at {} rows; ask for it alone with --backends",
                    guess.len()
                );
                let backend = format!("{}, {} segments", choice.family(), params.segments);
                omissions.push(Omission { backend, reason });
                continue;
            }
            let rungs = if choice.backend.is_iterative() {
                config.iterations.clone()
            } else {
                vec![0]
            };
            tasks.push(Task {
                case,
                choice: choice.clone(),
                rungs,
            });
        }
    }
    omissions.dedup();
    tasks
}

impl Case {
    fn new(config: &Config, params: HoistParams) -> Result<Self, StepError> {
        let frames = steps_in(config.time, config.dt).max(FRAMES + 1);
        let substeps = reference::stable_substeps(&params, config.dt);
        // From the middle of the run on, where the cable is in motion.
        let first = (frames / 2).min(frames - FRAMES - 1);
        let mut reference = reference::compute(
            &params,
            config.dt,
            substeps,
            frames,
            first..first + FRAMES + 1,
        )?;
        // The exact multipliers belong to the step at Δt, whatever solver steps it.
        let choice = Choice::schur(taut_solver::Backend::Dense(
            taut_solver::DenseOptions::default(),
        ));
        let choice = if taut_solver::Backend::Banded.is_compiled() {
            Choice::schur(taut_solver::Backend::Banded)
        } else {
            choice
        };
        let mut stepper = Stepper::new(params.build()?, choice.options(config.dt))?;
        let mut exact = Vec::new();
        for (time, bodies) in &reference.states {
            stepper.set_state(bodies, *time)?;
            exact.push(stepper.reference_multipliers()?);
        }
        reference.states.remove(0);
        let guess = exact.remove(0);
        Ok(Self {
            params,
            reference,
            exact,
            guess,
        })
    }
}

impl Task {
    fn choice_at(&self, rung: usize) -> Choice {
        Choice {
            backend: self.choice.backend.with_iterations(rung),
            form: self.choice.form,
        }
    }
}

/// The untimed part of all rows of a task.
fn task_rows(config: &Config, case: &Case, task: &Task) -> Vec<Record> {
    let mut rows: Vec<Record> = Vec::new();
    for &rung in &task.rungs {
        let choice = task.choice_at(rung);
        // Where no solve needed all the iterations allowed, more of them change nothing.
        let unchanged = rows.last().filter(|last| last.settled).cloned();
        let row = match unchanged {
            Some(last) => Record {
                iterations: rung,
                options: choice.to_string(),
                ..last
            },
            None => measure_row(config, case, &choice, rung),
        };
        rows.push(row);
    }
    rows
}

impl Record {
    /// An empty row, to be filled in.
    fn new(config: &Config, case: &Case, choice: &Choice, rung: usize) -> Self {
        Self {
            scene: "hoist".to_owned(),
            segments: case.params.segments,
            mass_ratio: case.params.mass_ratio,
            backend: choice.family(),
            options: choice.to_string(),
            iterations: rung,
            iterations_used: 0.0,
            dt: config.dt,
            refinements: choice.options(config.dt).refinements,
            step_ns: f64::NAN,
            step_ns_min: f64::NAN,
            solve_ns: f64::NAN,
            refine_ns: f64::NAN,
            backward_error: 0.0,
            backward_error_componentwise: 0.0,
            forward_error: 0.0,
            forward_error_unrefined: 0.0,
            elongation_error: None,
            elongation_error_continuum: None,
            load_error_m: None,
            energy_drift: None,
            max_violation_m: None,
            stable: false,
            simulated_s: config.time,
            failure: None,
            claimed_converged: 0,
            verified_converged: 0,
            frames: case.reference.states.len(),
            fastest_at: Vec::new(),
            settled: false,
            error: None,
        }
    }
}

/// The untimed part of one row.
fn measure_row(config: &Config, case: &Case, choice: &Choice, rung: usize) -> Record {
    let mut row = Record::new(config, case, choice, rung);
    if let Err(e) = measure_algebra(config, case, choice, &mut row) {
        row.error = Some(e.to_string());
    }
    let mut claimed = row.claimed_converged;
    match run_physics(config, case, choice) {
        Ok(run) => {
            claimed += run.claimed;
            row.stable = run.failure.is_none();
            row.load_error_m = Some(run.max_load_error(&case.reference.load));
            row.max_violation_m = Some(run.max_violation());
            let rest = config.scene.move_start + config.scene.move_duration;
            row.energy_drift = row.stable.then(|| run.energy_drift(rest)).flatten();
            row.failure = run.failure;
        }
        Err(e) => row.error = Some(e.to_string()),
    }
    match statics::hold(&case.params, &choice.options(config.dt)) {
        Ok(held) => {
            claimed += held.claimed;
            row.elongation_error = Some(held.error);
            row.elongation_error_continuum = Some(held.error_continuum);
        }
        Err(e) => row.error = Some(e.to_string()),
    }
    let solves = row.frames + steps_in(config.time, config.dt) + statics::HOLD_STEPS;
    row.settled = row.iterations > 0 && row.error.is_none() && claimed == solves;
    row
}

/// Errors of the multipliers on the common states.
fn measure_algebra(
    config: &Config,
    case: &Case,
    choice: &Choice,
    row: &mut Record,
) -> Result<(), StepError> {
    let options = choice.options(config.dt);
    let unrefined = taut_integrator::StepOptions {
        refinements: 0,
        ..options.clone()
    };
    let tolerance = tolerance_of(choice);
    let mut stepper = Stepper::new(case.params.build()?, unrefined)?;
    stepper.set_multipliers(&case.guess)?;
    let mut iterations = 0;
    for ((time, bodies), exact) in case.reference.states.iter().zip(&case.exact) {
        stepper.set_state(bodies, *time)?;
        let report = stepper.solve()?;
        iterations += report.iterations;
        let (a, b, x) = stepper.system();
        let solve_error = |source| StepError::Solve {
            source,
            culprit: None,
            time: *time,
        };
        let errors = backward_error(a, b, x).map_err(solve_error)?;
        row.backward_error = row.backward_error.max(errors.normwise);
        row.backward_error_componentwise =
            row.backward_error_componentwise.max(errors.componentwise);
        row.forward_error_unrefined = row
            .forward_error_unrefined
            .max(forward_error(stepper.multipliers(), exact));
        row.claimed_converged += usize::from(report.solve.status == Status::Converged);
        let r = taut_solver::residual(a, b, x).map_err(solve_error)?;
        row.verified_converged += usize::from(norm(&r) <= tolerance * norm(b) * (1.0 + 1e-6));
    }
    row.iterations_used = iterations as f64 / row.frames as f64;
    row.forward_error = row.forward_error_unrefined;
    if options.refinements > 0 {
        let mut stepper = Stepper::new(case.params.build()?, options)?;
        row.forward_error = 0.0;
        for ((time, bodies), exact) in case.reference.states.iter().zip(&case.exact) {
            stepper.set_state(bodies, *time)?;
            stepper.solve()?;
            row.forward_error = row
                .forward_error
                .max(forward_error(stepper.multipliers(), exact));
        }
    }
    Ok(())
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// What the iteration calls converged; direct solvers claim roundoff, which is judged by the error columns instead.
fn tolerance_of(choice: &Choice) -> f64 {
    match &choice.backend {
        taut_solver::Backend::GaussSeidel(o) => o.tolerance,
        taut_solver::Backend::ConjugateGradient(o) => o.tolerance,
        _ => f64::INFINITY,
    }
}

fn run_physics(config: &Config, case: &Case, choice: &Choice) -> Result<Trajectory, StepError> {
    let mut stepper = Stepper::new(case.params.build()?, choice.options(config.dt))?;
    let segment = case.params.length / case.params.segments as f64;
    Ok(simulate(&mut stepper, config.time, segment, |_| {}))
}

/// Times the rows of a task one after the other.
fn time_rows(
    config: &Config,
    case: &Case,
    task: &Task,
    rows: &mut [Record],
    progress: &ProgressBar,
) {
    let mut settled: Option<[f64; 4]> = None;
    for row in rows {
        progress.inc(1);
        // Rows that converged below their limit do the same work as the row before.
        let times = settled.map_or_else(
            || time_row(config, case, &task.choice_at(row.iterations)),
            Ok,
        );
        match times {
            Ok(times) => {
                [row.step_ns, row.step_ns_min, row.solve_ns, row.refine_ns] = times;
                settled = row.settled.then_some(times);
            }
            Err(e) => {
                row.error.get_or_insert(e.to_string());
            }
        }
    }
}

/// Steps from the common states in turn, warm started as in a run: [step, minimum, solve, refine] in ns.
fn time_row(config: &Config, case: &Case, choice: &Choice) -> Result<[f64; 4], StepError> {
    let mut stepper = Stepper::new(case.params.build()?, choice.options(config.dt))?;
    let mut reports: Vec<StepReport> = Vec::new();
    let start = Instant::now();
    let mut warmed_up = false;
    while reports.is_empty() || start.elapsed() < config.timing_budget {
        stepper.set_multipliers(&case.guess)?;
        for (time, bodies) in &case.reference.states {
            stepper.set_state(bodies, *time)?;
            reports.push(stepper.step()?);
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

/// Marks, for each scene and error level, the fastest row whose error is within the level.
fn mark_fastest(records: &mut [Record]) {
    for level in LEVELS {
        let mut scenes: Vec<(usize, u64)> = Vec::new();
        for r in records.iter() {
            let key = (r.segments, r.mass_ratio.to_bits());
            if !scenes.contains(&key) {
                scenes.push(key);
            }
        }
        for (segments, ratio) in scenes {
            let within = |r: &&mut Record| {
                (r.segments, r.mass_ratio.to_bits()) == (segments, ratio)
                    && r.error.is_none()
                    && r.forward_error <= level
                    && r.step_ns.is_finite()
            };
            let fastest = records
                .iter_mut()
                .filter(within)
                .min_by(|a, b| a.step_ns.total_cmp(&b.step_ns));
            if let Some(row) = fastest {
                row.fastest_at.push(level);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiny() -> Config {
        Config {
            segments: vec![4],
            ratios: vec![10.0],
            choices: Choice::all(),
            iterations: vec![1, 200],
            time: 0.5,
            timing_budget: Duration::ZERO,
            ..Config::quick()
        }
    }

    #[test]
    fn every_solver_has_its_rows_and_direct_ones_are_exact() {
        let results = run(&tiny(), &ProgressBar::hidden()).unwrap();
        let compiled = Choice::all()
            .into_iter()
            .filter(|c| c.check().is_ok())
            .count();
        let families: std::collections::BTreeSet<_> =
            results.records.iter().map(|r| &r.backend).collect();
        assert_eq!(families.len(), compiled);
        assert_eq!(results.omissions.len(), Choice::all().len() - compiled);
        for r in &results.records {
            assert_eq!(r.error, None, "{}", r.options);
            assert!(r.step_ns > 0.0 && r.solve_ns > 0.0 && r.stable, "{r:?}");
            if r.iterations == 0 {
                assert!(
                    r.forward_error < 1e-12 && r.elongation_error.unwrap() < 1e-9,
                    "{r:?}"
                );
            }
        }
        for level in LEVELS {
            assert_eq!(
                results
                    .records
                    .iter()
                    .filter(|r| r.fastest_at.contains(&level))
                    .count(),
                1
            );
        }
    }
}
