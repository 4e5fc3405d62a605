//! `taut ledger`: what each thing that a scene models, and each part of its step, costs and is worth.
//!
//! The scene runs whole, then without each thing, with other schemes, steps and solvers. The **error** of a run is the largest
//! distance of any of its steps from the finest run, which has twice the segments and [`FINEST`] sub-steps a step:
//!
//! ```text
//! e = max |x − x*| + ρ |θ|        ρ² = largest principal inertia of the load/its mass
//! ```
//!
//! of the load's centre x and its rotation θ from that of the finest. What keeps e within the tolerance **may go**. The lean
//! scene takes what may go and saves time, the largest saving first, as long as all of it together keeps the tolerance:
//! errors add up, and savings do not.

pub mod change;
pub mod modes;

use change::Change;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;
use std::time::Instant;
use taut_ground::inputs::Inputs;
use taut_ground::trajectory::{
    ENERGY_TOLERANCE, Limits, Simulation, Timing, load_position, steps_in,
};
use taut_integrator::{StepOptions, Stepper};
use taut_model::{Scene, SceneSource};
use taut_output::check::ExperimentError;

/// Sub-steps of the finest run for each of the whole one's.
pub const FINEST: usize = 8;

/// Least part of the time of a step that has to be saved for a thing to go.
const LEAST_SAVING: f64 = 0.03;

/// Time after which a run is not repeated for its timing \[s], and most repetitions.
const REPEATED: (f64, usize) = (0.15, 20);

/// A scene, and how it is stepped.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The scene.
    pub source: SceneSource,
    /// How it is stepped.
    pub options: StepOptions,
}

/// What a ledger is made for.
#[derive(Debug, Clone)]
pub struct Question {
    /// The whole scene.
    pub whole: Setup,
    /// Table of inputs, CSV.
    pub controls: Option<String>,
    /// Largest error \[m].
    pub tolerance: f64,
    /// Simulated time \[s].
    pub time: f64,
}

/// A line of the ledger. Errors are `None` where the run was lost.
#[derive(Debug, Clone, Serialize)]
pub struct Line {
    /// What is changed, in words.
    pub what: String,
    /// The option of `taut run`, or the key of the scene, that changes it.
    pub how: String,
    /// Rows of the linear system.
    pub rows: usize,
    /// Median time of a step, the least of some repetitions \[ns].
    pub step_ns: f64,
    /// Part of the whole scene's time that it saves.
    pub saves: f64,
    /// Error \[mm].
    pub error_mm: Option<f64>,
    /// Largest distance from the whole scene, measured as the error \[mm].
    pub apart_mm: Option<f64>,
    /// Root mean square of the difference of the load's tension from the finest, over its largest.
    pub tension: Option<f64>,
    /// Energy from nowhere at the end, over the motion's own; what is lost is negative.
    pub energy: Option<f64>,
    /// Steps that were left undecided.
    pub undecided: usize,
    /// Whether it keeps the tolerance.
    pub may_go: bool,
    /// Why it was lost or cannot be run.
    pub failure: Option<String>,
}

/// What a ledger found.
#[derive(Debug, Serialize)]
pub struct Ledger {
    /// The finest run.
    pub finest: Line,
    /// The whole scene.
    pub whole: Line,
    /// The changes, one by one.
    pub lines: Vec<Line>,
    /// The lean scene.
    pub lean: Line,
    /// What it left out, in the order of the savings.
    pub left_out: Vec<String>,
    /// The lean scene and its options.
    #[serde(skip)]
    pub setup: Setup,
    /// The whole scene's slowest oscillations, or why none are told.
    pub modes: Result<Vec<modes::Row>, String>,
}

/// Position of the load, and its orientation.
type Pose = (Vector3<f64>, UnitQuaternion<f64>);

/// A run, as far as it is compared.
#[derive(Debug, Clone, Default)]
struct Run {
    rows: usize,
    step_ns: f64,
    poses: Vec<Pose>,
    lever: f64,
    tension: Vec<f64>,
    energy: Option<f64>,
    undecided: usize,
    failure: Option<String>,
}

impl Run {
    fn lost(why: &impl ToString) -> Self {
        Self {
            step_ns: f64::NAN,
            failure: Some(why.to_string()),
            ..Self::default()
        }
    }

    /// The largest distance of the load from that of another run \[m]; `None` where one of both was lost.
    fn apart(&self, other: &Self) -> Option<f64> {
        let lost = self.failure.is_some() || other.failure.is_some();
        let distance =
            |((x, q), (y, r)): (&Pose, &Pose)| (x - y).norm() + self.lever * q.angle_to(r);
        let pairs = self.poses.iter().zip(&other.poses);
        (!lost).then(|| pairs.map(distance).fold(0.0, f64::max))
    }

    /// The difference of tensions from those of another run, root mean square, over the largest of those.
    fn tension_error(&self, other: &Self) -> Option<f64> {
        let count = self.tension.len().min(other.tension.len());
        let largest = other.tension.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
        let squares = self.tension.iter().zip(&other.tension);
        let sum: f64 = squares.map(|(a, b)| (a - b).powi(2)).sum();
        let known = count > 0 && largest > 0.0 && self.failure.is_none();
        known.then(|| (sum / count as f64).sqrt() / largest)
    }
}

impl Question {
    fn inputs(&self, scene: &Scene) -> Result<Inputs, String> {
        let text = self.controls.as_deref();
        let inputs = text.map(|text| Inputs::parse(text, scene).map_err(|e| e.to_string()));
        inputs.transpose().map(Option::unwrap_or_default)
    }

    /// Runs a setup, and again where that is short.
    fn run(&self, setup: &Setup) -> Run {
        let begun = Instant::now();
        let mut run = self.once(setup);
        for _ in 1..REPEATED.1 {
            if run.failure.is_some() || begun.elapsed().as_secs_f64() > REPEATED.0 {
                break;
            }
            run.step_ns = run.step_ns.min(self.once(setup).step_ns);
        }
        run
    }

    fn once(&self, setup: &Setup) -> Run {
        self.attempt(setup).unwrap_or_else(|why| Run::lost(&why))
    }

    fn attempt(&self, setup: &Setup) -> Result<Run, String> {
        let scene = setup.source.build().map_err(|e| e.to_string())?;
        let inputs = self.inputs(&scene)?;
        let options = StepOptions {
            energy_tolerance: Some(ENERGY_TOLERANCE),
            ..setup.options.clone()
        };
        let steps = steps_in(self.time, options.dt);
        let mut stepper = Stepper::new(scene, options).map_err(|e| e.to_string())?;
        let scene = stepper.scene();
        let load = scene.load.or(scene.bodies.len().checked_sub(1));
        let load = load.ok_or("the scene has no bodies")?;
        let mut run = Run {
            rows: stepper.linearized().rows(),
            lever: lever(scene, load),
            ..Run::default()
        };
        let mut simulation = Simulation::new(steps, Limits::Scene(scene.gap_limits()));
        let mut times = Vec::with_capacity(steps);
        while simulation.goes_on() {
            inputs.apply(&mut stepper).map_err(|e| e.to_string())?;
            let Some(sample) = simulation.step(&mut stepper) else {
                break;
            };
            let scene = stepper.scene();
            run.poses
                .push((load_position(scene), scene.bodies.orientation[load]));
            run.tension.extend(sample.load_tension);
            let excess =
                |b: taut_integrator::EnergyBalance| (b.gained - b.work - b.recovery) / b.scale;
            run.energy = sample.balance.filter(|b| b.scale > 0.0).map(excess);
            times.push(sample.phases.total());
        }
        run.undecided = simulation.undecided;
        run.failure = simulation
            .failure
            .map(|f| format!("lost at {:.3} s: {}", f.time, f.reason));
        run.step_ns = Timing::of(times.into_iter().skip(1)).median;
        Ok(run)
    }
}

/// ρ: the largest radius of gyration \[m].
fn lever(scene: &Scene, body: usize) -> f64 {
    let principal = scene.bodies.inertia[body].symmetric_eigenvalues();
    (principal.max().max(0.0) / scene.bodies.mass[body]).sqrt()
}

/// The whole ledger; `progress` moves on with each run.
///
/// # Errors
/// A whole or finest scene that does not run to its end.
pub fn ledger(question: &Question, progress: &ProgressBar) -> Result<Ledger, ExperimentError> {
    let whole = &question.whole;
    let changes = change::all(whole);
    progress.set_length(2 + changes.len() as u64);
    let run = |setup: &Setup| {
        let run = question.run(setup);
        progress.inc(1);
        run
    };
    let finest = run(&finest(whole)?);
    let own = run(whole);
    for (name, run) in [("whole", &own), ("finest", &finest)] {
        if let Some(why) = &run.failure {
            return Err(format!("the {name} scene does not run to its end: {why}").into());
        }
    }
    let line = |what: &str, how: &str, run: &Run| {
        let error = run.apart(&finest);
        Line {
            what: what.to_owned(),
            how: how.to_owned(),
            rows: run.rows,
            step_ns: run.step_ns,
            saves: 1.0 - run.step_ns / own.step_ns,
            error_mm: error.map(|e| 1e3 * e),
            apart_mm: run.apart(&own).map(|e| 1e3 * e),
            tension: run.tension_error(&finest),
            energy: run.energy.filter(|_| run.failure.is_none()),
            undecided: run.undecided,
            may_go: error.is_some_and(|e| e <= question.tolerance)
                && run.undecided <= own.undecided,
            failure: run.failure.clone(),
        }
    };
    let mut lines: Vec<(Line, &Change)> = Vec::new();
    for change in &changes {
        let (what, how) = (change.what(), change.how(&whole.source));
        match change.apply(whole) {
            Ok(None) => progress.inc(1),
            Ok(Some(setup)) => lines.push((line(&what, &how, &run(&setup)), change)),
            Err(e) => {
                progress.inc(1);
                lines.push((line(&what, &how, &Run::lost(&e)), change));
            }
        }
    }
    let (setup, lean, taken) = leanest(question, &lines, &own, &run, &line);
    let left_out = taken.iter().map(|change| change.what()).collect();
    Ok(Ledger {
        finest: line("finest", "", &finest),
        whole: line("whole", "", &own),
        lines: lines.into_iter().map(|(line, _)| line).collect(),
        lean: line("lean", "", &lean),
        left_out,
        setup,
        modes: modes::rows(whole),
    })
}

/// The setup that the errors are measured by.
fn finest(whole: &Setup) -> Result<Setup, ExperimentError> {
    let source = whole.source.with_segments(2.0)?;
    Ok(Setup {
        source: source.unwrap_or_else(|| whole.source.clone()),
        options: StepOptions {
            substeps: FINEST * whole.options.substeps,
            ..whole.options.clone()
        },
    })
}

/// What goes together, with its run.
fn leanest<'a>(
    question: &Question,
    lines: &[(Line, &'a Change)],
    whole: &Run,
    run: &dyn Fn(&Setup) -> Run,
    line: &dyn Fn(&str, &str, &Run) -> Line,
) -> (Setup, Run, Vec<&'a Change>) {
    let mut found = (question.whole.clone(), whole.clone(), Vec::new());
    let saving = |line: &Line| line.may_go && line.saves >= LEAST_SAVING;
    let mut candidates: Vec<_> = lines.iter().filter(|(line, _)| saving(line)).collect();
    candidates.sort_by(|a, b| b.0.saves.total_cmp(&a.0.saves));
    for (_, change) in candidates {
        let Ok(Some(setup)) = change.apply(&found.0) else {
            continue;
        };
        let lean = run(&setup);
        let keeps = line("", "", &lean).may_go;
        if keeps && lean.step_ns <= (1.0 - LEAST_SAVING) * found.1.step_ns {
            (found.0, found.1) = (setup, lean);
            found.2.push(*change);
        }
    }
    found
}

#[cfg(test)]
mod tests;
