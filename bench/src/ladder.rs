//! The main job: every solver on the hoist, speed against error, over mass ratios, in the default step.
//!
//! Three measurements make a row. (1) *Algebra and time*: a sequence of consecutive frames of a finely stepped
//! reference motion gives every solver the same states and the same tension for the geometric stiffness, and so the same
//! linear systems; its multipliers are compared with those of the KKT system in extended precision, and the step is
//! timed there. (2) *Physics*: the scene is run at Δt with the solver and compared with the reference motion.
//! (3) *Statics*: the cable hangs at rest in its exact discrete equilibrium, the multipliers start cold, and half a
//! second later its length is compared. Measurements 2 and 3 run in parallel, the timing afterwards alone. Whether the
//! step itself is stable, whatever the solver, is settled once a scene by 30 s with a direct solver.
//!
//! All are without the guard: with a direct solver it has nothing to do on these scenes, and an iteration that is
//! stopped early would set it off and be paid for up to a hundred times a step.

mod claims;

pub use claims::{Claims, claims};

use crate::choice::Choice;
use crate::hard::numerics::claims as hard_claims;
use crate::pace;
use crate::reference::{self, Reference};
use crate::statics;
use crate::trajectory::{Failure, Timing, Trajectory, simulate, steps_in};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::{Deserialize, Deserializer, Serialize};
use std::time::{Duration, Instant};
use taut_integrator::{Phase, StepError, StepOptions, StepReport, Stepper};
use taut_model::HoistParams;
use taut_solver::{Backend, DenseOptions, Status, backward_error, forward_error};

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
    /// Simulated time of each row \[s].
    pub time: f64,
    /// Simulated time that the step itself has to stay stable for \[s].
    pub stability_time: f64,
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
            stability_time: 30.0,
            timing_budget: Duration::from_millis(12),
        }
    }
}

impl Config {
    /// A tenth of the work: for CI and a first look.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            scene: HoistParams {
                move_duration: 1.0,
                ..Self::default().scene
            },
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    #[serde(deserialize_with = "nan_for_null")]
    pub iterations_used: f64,
    /// Δt \[s].
    pub dt: f64,
    /// Refinement sweeps from the pieces in the timed and simulated step.
    pub refinements: usize,
    /// Whole step, median \[ns].
    #[serde(deserialize_with = "nan_for_null")]
    pub step_ns: f64,
    /// Whole step, minimum \[ns].
    #[serde(deserialize_with = "nan_for_null")]
    pub step_ns_min: f64,
    /// Factorisation, solve and refinement, median \[ns].
    #[serde(deserialize_with = "nan_for_null")]
    pub solve_ns: f64,
    /// Refinement alone, median \[ns].
    #[serde(deserialize_with = "nan_for_null")]
    pub refine_ns: f64,
    /// Normwise backward error on the assembled system, without refinement; largest of the frames.
    #[serde(deserialize_with = "nan_for_null")]
    pub backward_error: f64,
    /// Componentwise backward error, likewise.
    #[serde(deserialize_with = "nan_for_null")]
    pub backward_error_componentwise: f64,
    /// Relative error of the multipliers against extended precision, as stepped; largest of the frames.
    #[serde(deserialize_with = "nan_for_null")]
    pub forward_error: f64,
    /// The same without refinement.
    #[serde(deserialize_with = "nan_for_null")]
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
    /// Whether the run of `simulated_s` seconds stayed stable, and the step itself, solved directly, for 30 s.
    pub stable: bool,
    /// Simulated time asked for \[s].
    pub simulated_s: f64,
    /// How an unstable run ended.
    pub failure: Option<Failure>,
    /// Frames whose solver claimed a solution: an iteration by its convergence, a direct solver by its status.
    pub claimed_converged: Option<usize>,
    /// Those of them where the true residual, in extended precision, met the tolerance; of a direct solver as below.
    pub verified_converged: Option<usize>,
    /// Those of them where it did, or where rounding alone leaves that much: a normwise backward error of at most 10⁻¹⁴.
    #[serde(default)]
    pub verified_to_rounding: Option<usize>,
    /// Frames measured.
    pub frames: usize,
    /// Error levels at which this row is the fastest of its scene.
    pub fastest_at: Vec<Fastest>,
    /// Whether no solve of the three measurements used up its iterations, so that more of them would change nothing.
    #[serde(skip)]
    pub settled: bool,
    /// Why there are no numbers, where the solver failed on the common states.
    pub error: Option<String>,
}

/// A number, or NaN for the null that JSON has for what is none.
pub(crate) fn nan_for_null<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// The fastest of a scene within an error level: the multipliers' forward error and the elongation error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fastest {
    /// The level.
    pub level: f64,
    /// Whether it takes the row's refinement to be within it.
    pub refined: bool,
    /// Step, median, without the refinement where that is not needed \[ns].
    pub step_ns: f64,
}

/// A solver that has no rows, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
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
    /// What the rows of each scene share.
    pub scenes: Vec<SceneNote>,
}

/// What the rows of a scene share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneNote {
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Time step of the reference motion, before its extrapolation from this and twice this \[s].
    pub reference_dt: f64,
    /// How the step itself, solved directly, ended before its 30 s.
    pub failure: Option<Failure>,
}

/// A scene of the ladder with what all its rows share.
struct Case {
    params: HoistParams,
    reference: Reference,
    /// Exact multipliers of the states but the first, which iterations only start from.
    exact: Vec<Vec<f64>>,
    /// How the step itself, solved directly, ended early.
    failure: Option<Failure>,
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
    results.scenes = cases.iter().map(Case::note).collect();
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
    for (case, Case { params, exact, .. }) in cases.iter().enumerate() {
        let rows = exact.first().map_or(0, Vec::len);
        for choice in choices {
            if choice.backend.name() == "dense" && rows > DENSE_ROWS && choices.len() > 1 {
                let reason = format!("cubic cost at {rows} rows; ask for it alone with --backends");
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
        let substeps = reference::stable_substeps(&params, config.dt)?;
        // From the middle of the run on, where the cable is in motion.
        let first = (frames / 2).min(frames - FRAMES - 1);
        let kept = first..first + FRAMES + 1;
        let (reference, _) = reference::extrapolated(&params, config.dt, substeps, frames, kept)?;
        let mut stepper = Stepper::new(reference::scene(&params)?, direct(config.dt))?;
        let mut exact = Vec::new();
        for state in &reference.states[1..] {
            state.put(&mut stepper)?;
            exact.push(stepper.reference_multipliers()?);
        }
        let mut stepper = Stepper::new(reference::scene(&params)?, direct(config.dt))?;
        let time = config.stability_time;
        let failure = simulate(&mut stepper, time, segment_length(&params), |_| {}).failure;
        Ok(Self {
            params,
            reference,
            exact,
            failure,
        })
    }

    fn note(&self) -> SceneNote {
        SceneNote {
            segments: self.params.segments,
            mass_ratio: self.params.mass_ratio,
            reference_dt: self.reference.dt,
            failure: self.failure.clone(),
        }
    }
}

fn segment_length(params: &HoistParams) -> f64 {
    params.length / params.segments as f64
}

/// The fastest direct solver that there is: where any direct one would do.
fn direct(dt: f64) -> StepOptions {
    let dense = Backend::Dense(DenseOptions::default());
    let backend = if Backend::Banded.is_compiled() {
        Backend::Banded
    } else {
        dense
    };
    Choice::schur(backend).plain_options(dt)
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
            refinements: choice.plain_options(config.dt).refinements,
            step_ns: f64::NAN,
            step_ns_min: f64::NAN,
            solve_ns: f64::NAN,
            refine_ns: f64::NAN,
            backward_error: f64::NAN,
            backward_error_componentwise: f64::NAN,
            forward_error: f64::NAN,
            forward_error_unrefined: f64::NAN,
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
            settled: false,
            error: None,
        }
    }
}

/// The untimed part of one row.
fn measure_row(config: &Config, case: &Case, choice: &Choice, rung: usize) -> Record {
    let mut row = Record::new(config, case, choice, rung);
    if let Err(e) = measure_algebra(config, case, choice, &mut row) {
        // What was measured before it failed is not the worst of all frames.
        row = Record {
            error: Some(e.to_string()),
            ..Record::new(config, case, choice, rung)
        };
    }
    let mut claimed = row.claimed_converged.unwrap_or(0);
    match run_physics(config, case, choice) {
        Ok(run) => {
            claimed += run.claimed;
            row.stable = run.failure.is_none() && case.failure.is_none();
            row.load_error_m = Some(run.max_load_error(&case.reference.load));
            row.max_violation_m = Some(run.max_violation());
            let rest = config.scene.move_start + config.scene.move_duration;
            let whole = run.failure.is_none();
            row.energy_drift = whole.then(|| run.energy_drift(rest)).flatten();
            row.failure = run.failure;
        }
        Err(e) => row.error = Some(e.to_string()),
    }
    // A cable that is not held at all has no elongation, which is a result and no fault of the row's other figures.
    if let Ok(held) = statics::hold(&case.params, &choice.plain_options(config.dt)) {
        claimed += held.claimed;
        row.elongation_error = Some(held.error);
        row.elongation_error_continuum = Some(held.error_continuum);
    }
    let solves = row.frames + steps_in(config.time, config.dt) + statics::HOLD_STEPS;
    row.settled = row.iterations > 0 && row.error.is_none() && claimed == solves;
    row
}

/// Errors of the multipliers on the common states. Iterations start from zero at the first state, which is not measured,
/// and from their own last multipliers at each later one, as they would in a run.
fn measure_algebra(
    config: &Config,
    case: &Case,
    choice: &Choice,
    row: &mut Record,
) -> Result<(), StepError> {
    let options = choice.plain_options(config.dt);
    let unrefined = StepOptions {
        refinements: 0,
        ..options.clone()
    };
    let tolerance = hard_claims::tolerance(&choice.backend);
    let mut stepper = Stepper::new(reference::scene(&case.params)?, unrefined)?;
    let (mut iterations, mut claimed, mut verified, mut to_rounding) = (0, 0, 0, 0);
    row.backward_error = 0.0;
    row.backward_error_componentwise = 0.0;
    row.forward_error_unrefined = 0.0;
    for (i, state) in case.reference.states.iter().enumerate() {
        state.put(&mut stepper)?;
        let report = stepper.solve()?;
        let Some(exact) = i.checked_sub(1).map(|i| &case.exact[i]) else {
            continue;
        };
        iterations += report.iterations;
        // Of all of S, which a matrix-free solver does not hold.
        let (a, b) = stepper.assembled(choice.form)?;
        let (a, b, (_, _, x)) = (&a, &b[..], stepper.system());
        let solve_error = |source| StepError::Solve {
            source,
            culprit: None,
            time: state.time,
        };
        let errors = backward_error(a, b, x).map_err(solve_error)?;
        keep_worst(&mut row.backward_error, errors.normwise);
        keep_worst(&mut row.backward_error_componentwise, errors.componentwise);
        let error = forward_error(stepper.multipliers(), exact);
        keep_worst(&mut row.forward_error_unrefined, error);
        if matches!(report.solve.status, Status::Converged | Status::Direct) {
            claimed += 1;
            let r = taut_solver::residual(a, b, x).map_err(solve_error)?;
            let scale = if norm(b) > 0.0 { norm(b) } else { 1.0 };
            let size = norm(&r) / scale;
            verified +=
                usize::from(hard_claims::over_letter(size, errors.normwise, tolerance) <= 1.0);
            to_rounding += usize::from(hard_claims::over(size, errors.normwise, tolerance) <= 1.0);
        }
    }
    row.iterations_used = iterations as f64 / row.frames as f64;
    row.claimed_converged = Some(claimed);
    row.verified_converged = Some(verified);
    row.verified_to_rounding = Some(to_rounding);
    row.forward_error = row.forward_error_unrefined;
    if options.refinements > 0 {
        let mut stepper = Stepper::new(reference::scene(&case.params)?, options)?;
        row.forward_error = 0.0;
        for (state, exact) in case.reference.states[1..].iter().zip(&case.exact) {
            state.put(&mut stepper)?;
            stepper.solve()?;
            let error = forward_error(stepper.multipliers(), exact);
            keep_worst(&mut row.forward_error, error);
        }
    }
    Ok(())
}

/// The larger of two errors; a NaN stays.
fn keep_worst(worst: &mut f64, error: f64) {
    if error > *worst || error.is_nan() {
        *worst = error;
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn run_physics(config: &Config, case: &Case, choice: &Choice) -> Result<Trajectory, StepError> {
    let mut stepper = Stepper::new(
        reference::scene(&case.params)?,
        choice.plain_options(config.dt),
    )?;
    let segment = segment_length(&case.params);
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

/// Steps from the common states in turn, warm started as in a run, taken as they come: [step, minimum, solve, refine]
/// in ns.
fn time_row(config: &Config, case: &Case, choice: &Choice) -> Result<[f64; 4], StepError> {
    let mut stepper = Stepper::new(
        reference::scene(&case.params)?,
        choice.plain_options(config.dt),
    )?;
    let cold = vec![0.0; stepper.multipliers().len()];
    let mut reports: Vec<StepReport> = Vec::new();
    let start = Instant::now();
    let mut warmed_up = false;
    while reports.is_empty() || start.elapsed() < config.timing_budget {
        stepper.set_multipliers(&cold)?;
        for (i, state) in case.reference.states.iter().enumerate() {
            state.put(&mut stepper)?;
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
            let candidates = records.iter_mut().filter_map(|r| {
                let same = (r.segments, r.mass_ratio.to_bits()) == (segments, ratio);
                let fastest = r.within(level).filter(|_| same)?;
                Some((r, fastest))
            });
            let fastest = candidates.min_by(|(_, a), (_, b)| a.step_ns.total_cmp(&b.step_ns));
            if let Some((row, fastest)) = fastest {
                row.fastest_at.push(fastest);
            }
        }
    }
}

impl Record {
    /// What a step costs with errors within `level`, without the refinement where it is not needed for that.
    pub(crate) fn within(&self, level: f64) -> Option<Fastest> {
        let held = self.error.is_none() && self.failure.is_none();
        let sound = held && self.elongation_error? <= level;
        if !sound || !self.step_ns.is_finite() {
            return None;
        }
        // An error that is no number is within nothing.
        let refined = self.forward_error_unrefined.is_nan() || self.forward_error_unrefined > level;
        let step_ns = if refined {
            self.step_ns
        } else {
            self.step_ns - self.refine_ns
        };
        (!refined || self.forward_error <= level).then_some(Fastest {
            level,
            refined: refined && self.refinements > 0,
            step_ns,
        })
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
            assert!(r.step_ns > 0.0 && r.solve_ns > 0.0, "{r:?}");
            // One iteration a step is not always enough to stay stable: then the row says so.
            assert!(
                r.stable || (r.iterations == 1 && r.failure.is_some()),
                "{r:?}"
            );
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
                    .filter(|r| r.fastest_at.iter().any(|f| f.level == level))
                    .count(),
                1
            );
        }
    }
}
