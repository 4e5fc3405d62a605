//! `taut run`: one scene, one solver, everything that a run tells, and runs as files.

use crate::inputs::{InputError, Inputs};
use crate::trajectory::{Failure, Timing, Trajectory, simulate_driven};
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use taut_integrator::{Energy, Phase, SavedRun, Stepper};
use taut_model::{Scene, SceneError, SceneSource};

/// What a run is judged by, which only the parameters of its scene know.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Yardstick {
    /// Unstrained length of the cable and its exact elongation at rest, for hoists \[m].
    pub cable: Option<(f64, f64)>,
    /// Gap of a joint at which the run is given up \[m].
    #[serde(with = "taut_model::unlimited")]
    pub max_gap: f64,
    /// Whether nothing disturbs the scene out of its plane, so that a verdict of stability says little.
    pub planar: bool,
}

/// A scene to be run.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// What the run is judged by.
    pub yardstick: Yardstick,
}

/// Why a scene cannot be prepared.
#[derive(Debug)]
pub enum PrepareError {
    /// The file of that name cannot be read.
    File(crate::output::FileError),
    /// The scene is not sound.
    Scene(SceneError),
    /// The file of that name holds no scene, or none that is sound.
    SceneFile(PathBuf, SceneError),
    /// The table of inputs in the file of that name does not fit the scene.
    Inputs(PathBuf, InputError),
}

impl std::fmt::Display for PrepareError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(e) => e.fmt(f),
            Self::Scene(e) => e.fmt(f),
            Self::SceneFile(path, e) => write!(f, "{}: {e}", path.display()),
            Self::Inputs(path, e) => write!(f, "{}: {e}", path.display()),
        }
    }
}

impl std::error::Error for PrepareError {}

/// Reads a scene by name or from a TOML file, with overrides. What looks like a file is one; anything else is a name,
/// and the error lists the names.
///
/// # Errors
/// [`PrepareError`].
pub fn source(scene: &str, overrides: &[(&str, &str)]) -> Result<SceneSource, PrepareError> {
    let named = taut_model::named::NAMES.contains(&scene);
    let is_file =
        !named && (Path::new(scene).exists() || scene.ends_with(".toml") || scene.contains('/'));
    if is_file {
        let text = crate::output::read_text(Path::new(scene)).map_err(PrepareError::File)?;
        let source = SceneSource::parse(&text, overrides);
        source.map_err(|e| PrepareError::SceneFile(PathBuf::from(scene), e))
    } else {
        SceneSource::load(scene, overrides).map_err(PrepareError::Scene)
    }
}

/// Reads and builds a scene by name or from a TOML file, with overrides.
///
/// # Errors
/// [`PrepareError`].
pub fn prepare(scene: &str, overrides: &[(&str, &str)]) -> Result<Prepared, PrepareError> {
    let source = source(scene, overrides)?;
    let built = source.build().map_err(PrepareError::Scene)?;
    let (cable, max_gap) = match &source {
        SceneSource::Hoist(p) => (
            Some((p.length, p.exact_elongation())),
            crate::reference::most_gap(p).map_err(PrepareError::Scene)?,
        ),
        SceneSource::Particles(p) => (None, p.spacing),
        SceneSource::Gantry(p) => (None, p.cable_length),
        SceneSource::Network(p) => (None, p.length),
        _ => (None, f64::INFINITY),
    };
    let planar = match &source {
        SceneSource::Hoist(p) => p.seed == 0 && p.circle_radius == 0.0,
        SceneSource::Gantry(p) => p.seed == 0,
        SceneSource::Network(p) => p.seed == 0,
        _ => false,
    };
    Ok(Prepared {
        scene: built,
        yardstick: Yardstick {
            cable,
            max_gap,
            planar,
        },
    })
}

/// The inputs of the CSV file `path` for a scene: see [`Inputs`].
///
/// # Errors
/// [`PrepareError::File`], [`PrepareError::Inputs`].
pub fn inputs(path: &Path, scene: &Scene) -> Result<Inputs, PrepareError> {
    let text = crate::output::read_text(path).map_err(PrepareError::File)?;
    Inputs::parse(&text, scene).map_err(|e| PrepareError::Inputs(path.to_owned(), e))
}

/// Positions of the load over time.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct LoadPath {
    /// Times \[s].
    pub time: Vec<f64>,
    /// Positions \[m].
    pub position: Vec<[f64; 3]>,
}

/// Energies at both ends of the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct EnergySpan {
    /// At the beginning.
    pub start: Energy,
    /// At the beginning of the last sub-step.
    pub end: Energy,
}

/// State of all bodies.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FinalState {
    /// Names.
    pub name: Vec<String>,
    /// Centres of mass \[m].
    pub position: Vec<[f64; 3]>,
    /// Unit quaternions, scalar first.
    pub orientation: Vec<[f64; 4]>,
    /// Velocities \[m/s].
    pub velocity: Vec<[f64; 3]>,
    /// Angular velocities \[rad/s].
    pub angular_velocity: Vec<[f64; 3]>,
}

/// What `taut run --json` writes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Backend with its options.
    pub backend: String,
    /// Form of the linear system.
    pub form: String,
    /// Order of the constraints that was taken.
    pub elimination: String,
    /// Entries of the block LDLᵀ in that order.
    pub factor_entries: Option<u64>,
    /// Floating-point operations of that factorisation.
    pub factor_flops: Option<u64>,
    /// Scheme.
    pub scheme: String,
    /// Weight and form of the geometric stiffness.
    pub stiffness: String,
    /// Tolerance of the guard; none is off.
    pub guard: Option<f64>,
    /// Steps that the guard took back.
    pub redone_steps: usize,
    /// Implicit sub-steps that it took.
    pub implicit_substeps: usize,
    /// Largest number of linear systems solved in a step.
    pub most_solves: usize,
    /// Sub-steps of a step.
    pub substeps: usize,
    /// Refinement sweeps a solve.
    pub refinements: usize,
    /// Δt \[s].
    pub dt: f64,
    /// Steps made.
    pub steps: usize,
    /// Whether the run reached its end.
    pub stable: bool,
    /// Whether the motion was exactly planar, which hides instabilities out of the plane.
    pub planar: bool,
    /// Steps whose iteration did not meet its tolerance.
    pub unconverged_steps: usize,
    /// Steps in which it was left undecided which rows are at their bounds.
    pub undecided_steps: usize,
    /// How it ended early.
    pub failure: Option<Failure>,
    /// Load positions, one a step.
    pub load: LoadPath,
    /// Energies.
    pub energy: EnergySpan,
    /// Largest gap of a joint \[m].
    pub max_violation_m: f64,
    /// Largest |gap sum of the cable − its exact elongation at rest|/length over the run; hoists only.
    pub max_elongation_error: Option<f64>,
    /// Whole step \[ns].
    pub step_ns: Timing,
    /// Phases of a step, medians \[ns].
    pub phases_ns: Vec<(String, f64)>,
    /// Mean iterations a step; 0 for direct solvers.
    pub iterations_mean: f64,
    /// State at the end.
    pub final_state: FinalState,
}

/// Runs a stepper for `time` seconds more; the samples are those of each step. A step that fails ends the run and is
/// reported in the summary. With `save_at` (s) the run is kept as it is at the last step's end before or at that time, to
/// half a step, and the run itself goes on.
pub fn run(
    stepper: &mut Stepper,
    yardstick: &Yardstick,
    inputs: &Inputs,
    time: f64,
    save_at: Option<f64>,
    progress: &ProgressBar,
) -> (Summary, Trajectory, Option<SavedRun>) {
    let mut saved = None;
    let half = 0.5 * stepper.options().dt;
    let mut trajectory = simulate_driven(
        stepper,
        time,
        yardstick.max_gap,
        |stepper| {
            if saved.is_none() && save_at.is_some_and(|at| stepper.time() > at - half) {
                saved = Some(stepper.save()?);
            }
            inputs.apply(stepper)
        },
        |_| progress.inc(1),
    );
    if save_at.is_some() && saved.is_none() && trajectory.failure.is_none() {
        match stepper.save() {
            Ok(run) => saved = Some(run),
            Err(e) => {
                trajectory.failure = Some(Failure {
                    time: stepper.time(),
                    reason: e.to_string(),
                });
            }
        }
    }
    let summary = summary(stepper, yardstick, &trajectory);
    (summary, trajectory, saved)
}

fn summary(stepper: &Stepper, yardstick: &Yardstick, trajectory: &Trajectory) -> Summary {
    let options = stepper.options();
    let start = trajectory
        .samples
        .first()
        .map_or_else(Energy::default, |s| s.energy);
    let elongation_error = yardstick.cable.map(|(length, exact)| {
        let sums = trajectory
            .samples
            .iter()
            .map(|s| ((s.gap_sum - exact) / length).abs());
        sums.fold(0.0, f64::max)
    });
    let median = |phase| trajectory.nanoseconds(|p| p.of(phase)).median;
    let iterations: usize = trajectory.samples.iter().map(|s| s.iterations).sum();
    Summary {
        scene: stepper.scene().name.clone(),
        backend: options.backend.to_string(),
        form: options.form.to_string(),
        elimination: stepper.elimination().taken.to_string(),
        factor_entries: stepper.elimination().cost.map(|c| c.entries),
        factor_flops: stepper.elimination().cost.map(|c| c.flops),
        scheme: options.scheme.to_string(),
        stiffness: options.stiffness.to_string(),
        guard: options.guard.map(|g| g.tolerance),
        redone_steps: trajectory.samples.iter().filter(|s| s.redone).count(),
        implicit_substeps: trajectory.samples.iter().map(|s| s.implicit_substeps).sum(),
        most_solves: trajectory
            .samples
            .iter()
            .map(|s| s.solves)
            .max()
            .unwrap_or(0),
        substeps: options.substeps,
        refinements: options.refinements,
        dt: options.dt,
        steps: trajectory.samples.len(),
        stable: trajectory.failure.is_none(),
        planar: yardstick.planar,
        unconverged_steps: trajectory.samples.len().saturating_sub(trajectory.claimed),
        undecided_steps: trajectory.undecided,
        failure: trajectory.failure.clone(),
        load: LoadPath {
            time: trajectory.samples.iter().map(|s| s.time).collect(),
            position: trajectory.samples.iter().map(|s| s.load.into()).collect(),
        },
        energy: EnergySpan {
            start,
            end: trajectory.samples.last().map_or(start, |s| s.energy),
        },
        max_violation_m: trajectory.max_violation(),
        max_elongation_error: elongation_error,
        step_ns: trajectory.nanoseconds(taut_integrator::PhaseTimes::total),
        phases_ns: Phase::ALL
            .map(|p| (format!("{p:?}").to_lowercase(), median(p)))
            .to_vec(),
        iterations_mean: iterations as f64 / trajectory.samples.len().max(1) as f64,
        final_state: final_state(stepper.scene()),
    }
}

fn final_state(scene: &Scene) -> FinalState {
    let bodies = &scene.bodies;
    FinalState {
        name: scene.body_names.clone(),
        position: bodies.position.iter().map(|&v| v.into()).collect(),
        orientation: bodies
            .orientation
            .iter()
            .map(|q| [q.w, q.i, q.j, q.k])
            .collect(),
        velocity: bodies.velocity.iter().map(|&v| v.into()).collect(),
        angular_velocity: bodies.angular_velocity.iter().map(|&v| v.into()).collect(),
    }
}

/// One line a step, for spreadsheets and plots.
#[must_use]
pub fn csv(trajectory: &Trajectory) -> String {
    let mut out = "time_s,load_x_m,load_y_m,load_z_m,kinetic_J,gravity_J,elastic_J,max_gap_m,iterations,step_ns\n"
        .to_owned();
    for s in &trajectory.samples {
        let (x, e) = (s.load, s.energy);
        let ns = s.phases.total().as_nanos();
        let _ = writeln!(
            out,
            "{},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{},{ns}",
            s.time, x.x, x.y, x.z, e.kinetic, e.gravity, e.elastic, s.violation, s.iterations
        );
    }
    out
}

/// The summary for people.
#[must_use]
pub fn text(s: &Summary) -> String {
    let mut out = String::new();
    let ns = crate::table::nanoseconds;
    let verdict = match &s.failure {
        None if s.unconverged_steps > 0 => format!(
            "stable, but {} steps ran out of iterations: raise `iterations=`",
            s.unconverged_steps
        ),
        None if s.undecided_steps > 0 => format!(
            "stable, but {} steps left undecided which cables are slack or which motors at their limits",
            s.undecided_steps
        ),
        None if s.planar => "stable, but exactly planar: `--set seed=1` disturbs it".to_owned(),
        None => "stable".to_owned(),
        Some(f) => format!("unstable at t = {:.3} s: {}", f.time, f.reason),
    };
    let last = s.load.position.last().copied().unwrap_or_default();
    let phases: Vec<_> = s
        .phases_ns
        .iter()
        .map(|(name, t)| format!("{name} {}", ns(*t)))
        .collect();
    let rows = [
        ("scene", s.scene.clone()),
        (
            "solver",
            format!(
                "{} ({} form, {} order, {} refinement{})",
                s.backend,
                s.form,
                s.elimination,
                s.refinements,
                if s.refinements == 1 { "" } else { "s" }
            ),
        ),
        (
            "steps",
            format!(
                "{} of {:.6} s, {}, geometric stiffness {}",
                s.steps, s.dt, s.scheme, s.stiffness
            ),
        ),
        (
            "guard",
            match s.guard {
                None => "off".to_owned(),
                Some(_) => format!(
                    "{} steps redone, {} implicit sub-steps, at most {} solves a step",
                    s.redone_steps, s.implicit_substeps, s.most_solves
                ),
            },
        ),
        ("verdict", verdict),
        (
            "load at the end",
            format!("({:.6}, {:.6}, {:.6}) m", last[0], last[1], last[2]),
        ),
        (
            "energy",
            format!(
                "{:.6e} J → {:.6e} J",
                s.energy.start.total(),
                s.energy.end.total()
            ),
        ),
        ("largest gap", format!("{:.3e} m", s.max_violation_m)),
        (
            "step time",
            format!(
                "median {}, min {}, max {}",
                ns(s.step_ns.median),
                ns(s.step_ns.min),
                ns(s.step_ns.max)
            ),
        ),
        ("phases", phases.join(", ")),
    ];
    for (name, value) in rows {
        let _ = writeln!(out, "{name:>16}  {value}");
    }
    out
}
