//! `taut ledger`: what each thing that a scene models, and each part of its step, costs and is worth.
//!
//! The scene runs whole, then without each thing, with other schemes, steps and solvers. The **error** of a run is the largest
//! distance of any of its steps from the finest run, which has twice the segments and [`FINEST`] sub-steps a step:
//!
//! ```text
//! e = max |x − x*| + ρ |θ|        ρ² = largest principal inertia of the load/its mass
//! ```
//!
//! of the load's centre x and its rotation θ from that of the finest. What keeps e within the tolerance **may go**, unless the
//! motion did without it: contacts that never touch, a guard that never takes a step back. The lean scene takes what may go and
//! saves time, the largest saving first, as long as all of it together keeps the tolerance: errors add up, and savings do
//! not. It takes no iterative solver, whose iterations are those of this motion, and no longer step, which is that of the
//! frames.
//!
//! **Time.** The processor's clock wanders by more than most things save. Each run is timed in turns with what it is compared
//! with; a saving is the median of the ratios, and counts where it is larger than the half of them that lies closest differs.

pub mod change;
pub mod modes;

use change::Change;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;
use std::time::Instant;
use taut_integrator::{StepOptions, Stepper};
use taut_measure::errors::worse;
use taut_measure::inputs::Inputs;
use taut_measure::lean::Leaner;
use taut_measure::trajectory::{
    ENERGY_TOLERANCE, Limits, Simulation, Timing, load_position, steps_in,
};
use taut_model::{Scene, SceneSource};
use taut_output::check::ExperimentError;

/// Sub-steps of the finest run for each of the whole one's.
pub const FINEST: usize = 8;

/// Least part of the time of a step that has to be saved for a thing to go.
const LEAST_SAVING: f64 = 0.03;

/// Time after which a pair of runs is not repeated for its timing \[s], and most repetitions.
const REPEATED: (f64, usize) = (0.3, 15);

/// How many times as long as the whole scene a run may take, and what it may take in any case \[s].
const PATIENCE: (f64, f64) = (20.0, 1.0);

/// A scene, and how it is stepped.
#[derive(Debug, Clone)]
pub struct Setup {
    pub source: SceneSource,
    pub options: StepOptions,
}

#[derive(Debug, Clone)]
pub struct Question {
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
    /// The change, in words.
    pub what: String,
    /// The option of `taut run`, or the key of the scene, that changes it.
    pub how: String,
    pub rows: usize,
    /// Median time of a step, the least of some repetitions \[ns].
    pub step_ns: f64,
    /// Part of the whole scene's time that it saves, and by how much the ratio of both times varies.
    pub saves: f64,
    /// See `saves`.
    pub spread: f64,
    /// Error \[mm].
    pub error_mm: Option<f64>,
    /// Largest distance from the whole scene, measured as the error \[mm].
    pub apart_mm: Option<f64>,
    /// Root mean square of the difference of the load's tension from the finest, over the larger of its largest and the load's
    /// weight.
    pub tension: Option<f64>,
    /// Change of the energy beyond the work of drives at the end, over the motion's own: < 0 is damping and friction.
    pub energy: Option<f64>,
    /// Steps that were left undecided.
    pub undecided: usize,
    pub keeps: bool,
    /// The run exercised the omitted feature. Otherwise keeping the tolerance proves nothing.
    pub used: bool,
    /// Why it was lost or cannot be run.
    pub failure: Option<String>,
}

#[derive(Debug, Serialize)]
pub struct Ledger {
    /// The finest run, and the one with half its sub-steps, whose error is about that of the finest.
    pub finest: [Line; 2],
    pub whole: Line,
    /// The changes, one by one.
    pub lines: Vec<Line>,
    pub lean: Line,
    /// Changes in the lean scene, in the order of the savings.
    pub left_out: Vec<String>,
    /// The lean scene and its options.
    #[serde(skip)]
    pub setup: Setup,
    /// The whole scene's slowest oscillations, or why there are none.
    pub modes: Result<Vec<modes::Row>, String>,
}

/// Position of the load, and its orientation.
type Pose = (Vector3<f64>, UnitQuaternion<f64>);

/// A run, as far as it is compared.
#[derive(Debug, Clone, Default)]
struct Run {
    rows: usize,
    step_ns: f64,
    /// Time over the simulated one.
    pace: f64,
    /// Steps of the whole scene that one of this run covers.
    stride: usize,
    poses: Vec<Pose>,
    lever: f64,
    weight: f64,
    tension: Vec<f64>,
    /// Shapes touched, cables gripped sheaves, the guard took a step back.
    used: [bool; 3],
    seconds: f64,
    energy: Option<f64>,
    undecided: usize,
    failure: Option<String>,
}

impl Run {
    fn lost(why: &impl ToString) -> Self {
        Self {
            step_ns: f64::NAN,
            pace: f64::NAN,
            stride: 1,
            failure: Some(why.to_string()),
            ..Self::default()
        }
    }

    /// The largest distance of the load from that of another run \[m]; `None` where one of both was lost.
    fn apart(&self, other: &Self) -> Option<f64> {
        let lost = self.failure.is_some() || other.failure.is_some();
        let distance =
            |((x, q), (y, r)): (&Pose, &Pose)| (x - y).norm() + self.lever * q.angle_to(r);
        let pairs = self.poses.iter().zip(self.at_own_steps(&other.poses));
        (!lost).then(|| pairs.map(distance).fold(0.0, worse))
    }

    /// Values of another run, given at each step of the whole scene, at the steps of this one.
    fn at_own_steps<'a, T>(&self, other: &'a [T]) -> impl Iterator<Item = &'a T> {
        other.iter().skip(self.stride - 1).step_by(self.stride)
    }

    /// The difference of tensions from those of another run, root mean square, over the largest of those.
    fn tension_error(&self, other: &Self) -> Option<f64> {
        let count = self.tension.len();
        let largest = other
            .tension
            .iter()
            .fold(other.weight, |m, t| m.max(t.abs()));
        let squares = self.tension.iter().zip(self.at_own_steps(&other.tension));
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

    /// Runs two setups in turns: the second one's run, with the least of its times, the median of the ratios of its times to
    /// the first one's, and their spread.
    fn paired(&self, base: &Setup, other: &Setup) -> (Run, [f64; 2]) {
        let begun = Instant::now();
        let first = self.once(base, f64::INFINITY);
        let [factor, least] = [PATIENCE.0, PATIENCE.1];
        let patience = least + factor * first.seconds;
        let mut run = self.once(other, patience);
        let mut ratios = vec![run.pace / first.pace];
        while run.failure.is_none()
            && ratios.len() < REPEATED.1
            && begun.elapsed().as_secs_f64() < REPEATED.0
        {
            let [first, again] = [base, other].map(|setup| self.once(setup, patience));
            run.step_ns = run.step_ns.min(again.step_ns);
            ratios.push(again.pace / first.pace);
        }
        ratios.sort_by(f64::total_cmp);
        let at = |part: f64| ratios[(part * (ratios.len() - 1) as f64).round() as usize];
        (run, [at(0.5), at(0.75) - at(0.25)])
    }

    /// Runs a setup, for at most so many seconds.
    fn once(&self, setup: &Setup, patience: f64) -> Run {
        self.attempt(setup, patience)
            .unwrap_or_else(|why| Run::lost(&why))
    }

    fn attempt(&self, setup: &Setup, patience: f64) -> Result<Run, String> {
        let scene = setup.source.build().map_err(|e| e.to_string())?;
        let inputs = self.inputs(&scene)?;
        let options = StepOptions {
            energy_tolerance: Some(ENERGY_TOLERANCE),
            ..setup.options.clone()
        };
        let steps = steps_in(self.time, options.dt);
        let mut stepper = Stepper::new(scene, options).map_err(|e| e.to_string())?;
        let scene = stepper.scene();
        let load = scene.load.filter(|load| scene.bodies.is_dynamic(*load));
        let load =
            load.ok_or("it has no load that forces move: name one, as by `load = \"NAME\"`")?;
        let mut run = Run {
            stride: (setup.options.dt / self.whole.options.dt).round() as usize,
            rows: stepper.linearized().rows(),
            lever: lever(scene, load),
            weight: scene.bodies.mass[load] * scene.gravity.norm(),
            used: [false, !scene.capstans.is_empty(), false],
            ..Run::default()
        };
        let mut simulation = Simulation::new(steps, Limits::Scene(scene.gap_limits()));
        let mut times = Vec::with_capacity(steps);
        let begun = Instant::now();
        while simulation.goes_on() {
            if begun.elapsed().as_secs_f64() > patience {
                return Err(
                    "given up: it takes more than 20 times as long as the whole scene".into(),
                );
            }
            inputs.apply(&mut stepper).map_err(|e| e.to_string())?;
            let Some(sample) = simulation.step(&mut stepper) else {
                break;
            };
            let scene = stepper.scene();
            run.poses
                .push((load_position(scene), scene.bodies.orientation[load]));
            run.tension.push(sample.load_tension.unwrap_or(0.0));
            run.used[0] |= sample.contacts.touching > 0;
            run.used[2] |= sample.redone;
            let excess =
                |b: taut_integrator::EnergyBalance| (b.gained - b.work - b.recovery) / b.scale;
            run.energy = sample.balance.filter(|b| b.scale > 0.0).map(excess);
            times.push(sample.phases.total());
        }
        run.undecided = simulation.undecided;
        run.failure = simulation
            .failure
            .map(|f| format!("lost at {:.3} s: {}", f.time, f.reason));
        run.seconds = begun.elapsed().as_secs_f64();
        run.step_ns = Timing::of(times.into_iter().skip(1)).median;
        run.pace = 1e-9 * run.step_ns / setup.options.dt;
        Ok(run)
    }
}

/// ρ: the largest radius of gyration \[m].
fn lever(scene: &Scene, body: usize) -> f64 {
    let principal = scene.bodies.inertia[body].symmetric_eigenvalues();
    (principal.max().max(0.0) / scene.bodies.mass[body]).sqrt()
}

/// References of the lines.
struct Measures<'a> {
    question: &'a Question,
    finest: Run,
    whole: Run,
}

impl Measures<'_> {
    fn line(&self, what: &str, how: &str, run: &Run, [ratio, spread]: [f64; 2]) -> Line {
        let error = run.apart(&self.finest);
        let decided = run.undecided <= self.whole.undecided;
        Line {
            what: what.to_owned(),
            how: how.to_owned(),
            rows: run.rows,
            step_ns: run.step_ns,
            saves: 1.0 - ratio,
            spread,
            error_mm: error.map(|e| 1e3 * e),
            apart_mm: run.apart(&self.whole).map(|e| 1e3 * e),
            tension: run.tension_error(&self.finest),
            energy: run.energy.filter(|_| run.failure.is_none()),
            undecided: run.undecided,
            keeps: error.is_some_and(|e| e <= self.question.tolerance) && decided,
            used: true,
            failure: run.failure.clone(),
        }
    }
}

/// The whole ledger; `progress` moves on with each run.
pub fn ledger(question: &Question, progress: &ProgressBar) -> Result<Ledger, ExperimentError> {
    let whole = &question.whole;
    let changes = change::all(whole);
    progress.set_length(4 + changes.len() as u64);
    let run = |base: &Setup, setup: &Setup| {
        let run = question.paired(base, setup);
        progress.inc(1);
        run
    };
    let own = run(whole, whole);
    let [fine, coarser] = [FINEST, FINEST / 2].map(|substeps| finest(whole, substeps));
    let [fine, coarser] = [run(whole, &fine), run(whole, &coarser)];
    for (name, run) in [("whole", &own.0), ("finest", &fine.0)] {
        if let Some(why) = &run.failure {
            return Err(format!("the {name} scene does not run to its end: {why}").into());
        }
    }
    let measures = Measures {
        question,
        finest: fine.0.clone(),
        whole: own.0.clone(),
    };
    let mut lines: Vec<(Line, &Change)> = Vec::new();
    for change in &changes {
        let changed = change.apply(whole);
        if !matches!(changed, Ok(Some(_))) {
            progress.inc(1);
        }
        let (run, times) = match changed {
            Ok(None) => continue,
            Ok(Some(setup)) => run(whole, &setup),
            Err(e) => (Run::lost(&e), [f64::NAN; 2]),
        };
        let (what, how) = change.described(&whole.source);
        let mut line = measures.line(&what, &how, &run, times);
        line.used = change.used(own.0.used);
        lines.push((line, change));
    }
    let whole_line = measures.line("whole", "", &own.0, [1.0, own.1[1]]);
    let what = |change: &&Change| change.described(&whole.source).0;
    let mut found = Lean {
        setup: whole.clone(),
        run: own.0,
        times: [1.0, 0.0],
        taken: Vec::new(),
    };
    if whole_line.keeps {
        found.take(&measures, &lines, progress);
    }
    progress.inc(1);
    Ok(Ledger {
        finest: [
            measures.line("finest", "", &fine.0, fine.1),
            measures.line("half its sub-steps", "", &coarser.0, coarser.1),
        ],
        whole: whole_line,
        lines: lines.into_iter().map(|(line, _)| line).collect(),
        lean: measures.line("lean", "", &found.run, found.times),
        left_out: found.taken.iter().map(what).collect(),
        setup: found.setup,
        modes: modes::rows(whole),
    })
}

/// The setup that the errors are measured by: of twice the segments, if there can be as many.
fn finest(whole: &Setup, substeps: usize) -> Setup {
    let source = whole.source.with_segments(2.0).ok().flatten();
    Setup {
        source: source.unwrap_or_else(|| whole.source.clone()),
        options: StepOptions {
            substeps: substeps * whole.options.substeps,
            ..whole.options.clone()
        },
    }
}

/// The whole scene with all these changes; `None` where the last changes nothing. Segments come first: a scene that is written
/// body by body for another change has none to halve.
fn together(whole: &Setup, taken: &[&Change], last: &Change) -> Option<Setup> {
    let is_first = |change: &&Change| matches!(change, Change::Segments(_) | Change::Ruled);
    let mut all: Vec<&Change> = taken.iter().copied().chain([last]).collect();
    all.sort_by_key(|change| !is_first(change));
    let apply = |setup: Setup, change: &Change| change.apply(&setup).ok().flatten();
    all.into_iter().try_fold(whole.clone(), apply)
}

/// Lean scene as it grows, change by change.
struct Lean<'a> {
    setup: Setup,
    run: Run,
    times: [f64; 2],
    taken: Vec<&'a Change>,
}

impl<'a> Lean<'a> {
    fn take(
        &mut self,
        measures: &Measures<'_>,
        lines: &[(Line, &'a Change)],
        progress: &ProgressBar,
    ) {
        let question = measures.question;
        let saves = |line: &Line| line.saves >= LEAST_SAVING.max(line.spread);
        let goes = |line: &Line| line.keeps && line.used && saves(line);
        let mut candidates: Vec<_> = lines.iter().filter(|(line, _)| goes(line)).collect();
        candidates.sort_by(|a, b| b.0.saves.total_cmp(&a.0.saves));
        for (_, change) in candidates {
            if change.is_told_only() || self.taken.iter().any(|taken| change.replaces(taken)) {
                continue;
            }
            let Some(setup) = together(&question.whole, &self.taken, change) else {
                continue;
            };
            progress.inc_length(2);
            let (run, times) = question.paired(&self.setup, &setup);
            progress.inc(1);
            let better = measures.line("", "", &run, times);
            if better.keeps && saves(&better) {
                (self.run, self.times) = question.paired(&question.whole, &setup);
                self.setup = setup;
                self.taken.push(*change);
            }
            progress.inc(1);
        }
    }
}

#[cfg(test)]
mod tests;
