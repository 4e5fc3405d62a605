//! `taut run`: one scene, one solver, everything that a run tells, and runs as files.

mod load_error;
mod text;

pub use text::{CSV_HEADING, csv_line, text};

use indicatif::ProgressBar;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use taut_integrator::{
    ContactReport, Energy, EnergyBalance, ErrorEstimate, Phase, Resolved, SavedRun, StepError,
    StepOptions, Stepper,
};
use taut_measure::columns::{Columns, Series};
use taut_measure::errors::worse;
use taut_measure::inputs::Inputs;
use taut_measure::openings::Opening;
use taut_measure::trajectory::{Durations, Failure, Limits, Sample, Simulation, Timing};
use taut_model::{Scene, SceneSource};

/// Expectations that only the parameters of a scene tell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceValues {
    /// Unstrained length of the cable and its exact elongation at rest, for hoists \[m].
    pub cable: Option<(f64, f64)>,
    /// Nothing disturbs the scene out of its plane, so stability says little.
    pub planar: bool,
}

/// A scene to be run.
#[derive(Debug, Clone)]
pub struct Prepared {
    pub scene: Scene,
    pub yardstick: ReferenceValues,
}

/// A scene with the expectations that its source tells.
pub fn prepare((source, scene): (SceneSource, Scene)) -> Prepared {
    let cable = match &source {
        SceneSource::Hoist(p) => Some((p.length, p.exact_elongation())),
        _ => None,
    };
    let planar = match &source {
        SceneSource::Hoist(p) => p.seed == 0 && p.circle_radius == 0.0,
        SceneSource::Gantry(p) => p.seed == 0,
        SceneSource::Network(p) => p.seed == 0,
        _ => false,
    };
    Prepared {
        scene,
        yardstick: ReferenceValues { cable, planar },
    }
}

/// Positions of the load over time.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct LoadPath {
    /// Times \[s].
    pub time: Vec<f64>,
    /// Positions \[m].
    pub position: Vec<[f64; 3]>,
}

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

/// Content of `taut run --json`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Summary {
    pub scene: String,
    /// Massless cables over sheaves, and the lengths of their paths at the start \[m]. Not serialised.
    #[serde(skip)]
    pub paths: Vec<(String, f64)>,
    /// Backend with its options.
    pub backend: String,
    /// The solver that was chosen, where that is `auto`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<ChosenSolver>,
    /// Form of the linear system.
    pub form: String,
    /// Order of the constraints that was taken.
    pub elimination: String,
    /// Entries of the block LDLᵀ in that order.
    pub factor_entries: Option<u64>,
    /// Floating-point operations of that factorisation.
    pub factor_flops: Option<u64>,
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
    /// Steps of these that the scene slept through; `None` if it never did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps_asleep: Option<usize>,
    /// The run reached its end.
    pub stable: bool,
    /// Interruption before the end, such as a signal.
    pub stopped: Option<&'static str>,
    /// The motion was exactly planar, which hides instabilities out of the plane.
    pub planar: bool,
    /// Steps whose iteration did not meet its tolerance.
    pub unconverged_steps: usize,
    /// Steps in which it was left undecided which rows are at their bounds or which contacts carry what.
    pub undecided_steps: usize,
    /// `None` if nothing touched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contacts: Option<ContactSummary>,
    /// How it ended early.
    pub failure: Option<Failure>,
    /// Load positions, one a step, where they were wanted.
    pub load: LoadPath,
    /// The columns that were wanted, one value a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<Series>,
    /// Time and position of the load at the end \[s, m].
    #[serde(skip)]
    pub load_at_end: Option<(f64, [f64; 3])>,
    pub energy: EnergySpan,
    /// The balance of energy at the end, where the options ask for it.
    pub balance: Option<EnergyBalance>,
    /// Largest energy from nowhere over the run, over the motion's own ([`EnergyBalance::excess`](EnergyBalance)).
    pub max_energy_excess: Option<f64>,
    /// The error of the load's position, where the options ask for it \[m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorEstimate>,
    /// The diagonal of the box that the load moved in \[m].
    #[serde(skip)]
    pub extent: f64,
    /// The diagonal of the box around what the scene holds at the end \[m].
    #[serde(skip)]
    pub size: f64,
    /// Changes by winches and by the rules of cables; `None` without rules and changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolved: Option<Resolved>,
    /// Tension above the load at the end \[N]: the largest of what holds on to it.
    pub load_tension: Option<f64>,
    /// The largest over the run \[N].
    pub max_load_tension: Option<f64>,
    /// Likely mistakes in the scene and what became of it, which stop nothing.
    pub notes: Vec<String>,
    /// The scene's events: time \[s] and name.
    pub events: Vec<(f64, String)>,
    /// The force by which each of them was due \[N]; none of those that wait for no force.
    pub event_forces: Vec<Option<f64>>,
    /// Largest gap of a joint, link or cable over the run \[m].
    pub max_violation_m: f64,
    /// The one that has it, and when.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_gap: Option<Opening>,
    /// Largest part of a gap that no force explains, gap − ε |λ|; `None` up to a thousandth of the
    /// length that its joint stands for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unexplained_gap: Option<Opening>,
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

/// The solver that `auto` stands for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChosenSolver {
    /// Backend with its options.
    pub backend: String,
    /// Why it was chosen.
    pub reason: String,
}

/// Requests to a run while it goes on.
pub struct Requests<'a> {
    /// Time at which it is saved as it is, at the end of the last step before or at it, to half a step \[s].
    pub save_at: Option<f64>,
    /// Takes what is saved, when it is.
    pub save: &'a mut dyn FnMut(SavedRun),
    /// Keeps the path of the load in the summary.
    pub path: bool,
    /// The columns that the summary holds.
    pub columns: Option<&'a Columns>,
    /// Sees each step.
    pub sample: &'a mut dyn FnMut(&Stepper, &Sample),
    /// Why the run is to end where it is, if it is.
    pub stop: &'a dyn Fn() -> Option<&'static str>,
}

/// The summary as it grows step by step, and what only its end needs.
#[derive(Debug, Default)]
struct Tally {
    summary: Summary,
    /// The energy at the beginning, unless the run goes on from a saved one.
    begun: Option<Energy>,
    /// Corners of the box that the load moved in \[m].
    corners: Option<[Vector3<f64>; 2]>,
    /// Durations of the whole step and of each of [`Phase::ALL`], without the first step, which may
    /// allocate.
    times: [Durations; 1 + Phase::ALL.len()],
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ContactSummary {
    /// Contacts that carry a force at the end.
    pub touching: usize,
    /// Contacts of these with friction at its limit.
    pub sliding: usize,
    /// Most that carry a force in a step.
    pub most: usize,
    /// Deepest penetration \[m].
    pub deepest_m: f64,
    /// Largest violation of their conditions, over the largest rate.
    pub complementarity: f64,
    /// The largest of these violations as a gap \[m].
    pub residual_gap_m: f64,
    /// The largest of them as a force \[N].
    pub residual_force_n: f64,
    /// Most factorisations of dense problems in a step.
    pub most_pivots: usize,
    /// Dense problems that Newton's method left to its fall-backs.
    pub fallbacks: usize,
    /// Most groups that contacts were split into in a step; 0 where all were solved at once.
    pub most_groups: usize,
}

impl ContactSummary {
    fn add(&mut self, step: &ContactReport) {
        (self.touching, self.sliding) = (step.touching, step.sliding);
        self.most = self.most.max(step.touching);
        self.deepest_m = self.deepest_m.max(step.deepest);
        self.complementarity = worse(self.complementarity, step.complementarity);
        self.residual_gap_m = worse(self.residual_gap_m, step.residual_gap);
        self.residual_force_n = worse(self.residual_force_n, step.residual_force);
        self.most_pivots = self.most_pivots.max(step.pivots);
        self.fallbacks += step.fallbacks;
        self.most_groups = self.most_groups.max(step.groups);
    }
}

impl Tally {
    fn new(stepper: &Stepper, yardstick: &ReferenceValues, columns: Option<&Columns>) -> Self {
        let scene = stepper.scene();
        let mut new = Self {
            summary: Summary {
                scene: scene.name.clone(),
                paths: scene.paths(),
                planar: yardstick.planar,
                columns: columns.map(Series::new),
                notes: scene.notes(),
                max_elongation_error: yardstick.cable.map(|_| 0.0),
                ..Summary::default()
            },
            begun: (stepper.time() == 0.0).then(|| stepper.energy()),
            ..Self::default()
        };
        new.summary.energy.start = new.energy_before(Energy::default());
        new
    }

    /// The energy of the first step with the motion that the run begins with: a step's own is the mean over it, half of a blow
    /// included.
    fn energy_before(&self, mut first: Energy) -> Energy {
        if let Some(begun) = self.begun {
            (first.kinetic, first.gravity) = (begun.kinetic, begun.gravity);
        }
        first
    }

    fn add(&mut self, s: &Sample, yardstick: &ReferenceValues) {
        let sum = &mut self.summary;
        sum.steps += 1;
        if s.asleep {
            *sum.steps_asleep.get_or_insert_default() += 1;
        }
        sum.redone_steps += usize::from(s.redone);
        sum.implicit_substeps += s.implicit_substeps;
        sum.most_solves = sum.most_solves.max(s.solves);
        sum.iterations_mean += s.iterations as f64;
        if s.contacts.near > 0 || sum.contacts.is_some() {
            sum.contacts.get_or_insert_default().add(&s.contacts);
        }
        *sum.resolved.get_or_insert_default() += s.resolved;
        sum.max_violation_m = sum.max_violation_m.max(s.violation);
        let largest = |most: Option<f64>, new| most.into_iter().chain(new).reduce(worse);
        sum.max_energy_excess = largest(sum.max_energy_excess, s.balance.map(|b| b.excess));
        sum.max_load_tension = largest(sum.max_load_tension, s.load_tension);
        if let (Some((length, exact)), Some(most)) =
            (yardstick.cable, &mut sum.max_elongation_error)
        {
            *most = most.max(((s.gap_sum - exact) / length).abs());
        }
        (sum.balance, sum.error, sum.load_tension) = (s.balance, s.error, s.load_tension);
        (sum.load_at_end, sum.energy.end) = (Some((s.time, s.load.into())), s.energy);
        let [low, high] = self.corners.unwrap_or([s.load; 2]);
        self.corners = Some([low.inf(&s.load), high.sup(&s.load)]);
        if self.summary.steps == 1 {
            self.summary.energy.start = self.energy_before(s.energy);
        } else {
            let parts = Phase::ALL.map(|phase| s.phases.of(phase));
            let all = std::iter::once(s.phases.total()).chain(parts);
            self.times.iter_mut().zip(all).for_each(|(t, d)| t.add(d));
        }
    }
}

/// Most sub-steps that [`substeps_within`] tries.
const MOST_SUBSTEPS: usize = 256;

/// The options with as many sub-steps, doubled from those given, as keep the estimate of the load's error within `tolerance`
/// (m) over so many steps: each number is tried from the start on.
pub fn substeps_within(
    tolerance: f64,
    (scene, options): (&Scene, &StepOptions),
    inputs: &Inputs,
    steps: usize,
    progress: &ProgressBar,
) -> Result<StepOptions, String> {
    let mut options = options.clone();
    loop {
        let mut stepper =
            Stepper::new(scene.clone(), options.clone()).map_err(|e| e.to_string())?;
        let mut beyond = None;
        progress.set_position(0);
        for _ in 0..steps {
            let applied = inputs.apply(&mut stepper);
            let report = applied.and_then(|()| stepper.step());
            let Some(error) = report.map_err(|e| e.to_string())?.error else {
                return Ok(options);
            };
            if error.total() > tolerance || error.lost {
                beyond = Some(error);
                break;
            }
            progress.inc(1);
        }
        let Some(error) = beyond else {
            return Ok(options);
        };
        let fixed = error.algebra + error.segments;
        if fixed > tolerance {
            return Err(format!(
                "sub-steps do not help: of the load's error {:.1e} mm are of the polygon that the segments make and {:.1e} mm \
                 of the linear algebra: {}",
                1e3 * error.segments,
                1e3 * error.algebra,
                if error.segments >= error.algebra {
                    "use more segments"
                } else {
                    "use a direct solver, or more refinements"
                }
            ));
        }
        if 2 * options.substeps > MOST_SUBSTEPS {
            return Err(format!(
                "{} sub-steps leave an error of {:.1e} mm after {:.2} s: allow more, or simulate less",
                options.substeps,
                1e3 * error.total(),
                stepper.time()
            ));
        }
        options.substeps *= 2;
    }
}

/// Runs a stepper for so many steps. A step that fails ends the run and is reported in the summary.
pub fn run(
    stepper: &mut Stepper,
    yardstick: &ReferenceValues,
    inputs: &Inputs,
    steps: usize,
    requests: &mut Requests<'_>,
    progress: &ProgressBar,
) -> Summary {
    let half = 0.5 * stepper.options().dt;
    let limits = Limits::Scene(stepper.scene().gap_limits());
    let mut simulation = Simulation::new(steps, limits);
    let mut tally = Tally::new(stepper, yardstick, requests.columns);
    let mut stopped = None;
    let mut due = requests.save_at;
    while simulation.goes_on() {
        if due.is_some_and(|at| stepper.time() > at - half) {
            due = None;
            save(stepper, &mut simulation, requests);
        }
        if let Err(e) = inputs.apply(stepper) {
            simulation.fail(stepper.time(), e);
        }
        let Some(sample) = simulation.step(stepper) else {
            stopped = (requests.stop)().filter(|_| simulation.goes_on());
            break;
        };
        tally.add(&sample, yardstick);
        let sum = &mut tally.summary;
        let fired = stepper.fired().iter();
        sum.events
            .extend(fired.map(|name| (sample.time, name.clone())));
        sum.event_forces.extend(stepper.fired_forces());
        if requests.path {
            sum.load.time.push(sample.time);
            sum.load.position.push(sample.load.into());
        }
        if let (Some(series), Some(columns)) = (&mut sum.columns, requests.columns) {
            series.add(columns.values(stepper, &sample));
        }
        (requests.sample)(stepper, &sample);
        progress.inc(1);
        stopped = (requests.stop)().filter(|_| simulation.goes_on());
        if stopped.is_some() {
            break;
        }
    }
    if due.is_some() && simulation.failure.is_none() {
        save(stepper, &mut simulation, requests);
    }
    summary(stepper, simulation, tally, stopped)
}

fn save(stepper: &Stepper, simulation: &mut Simulation, requests: &mut Requests<'_>) {
    match stepper.save() {
        Ok(run) => (requests.save)(run),
        Err(e) => simulation.fail(stepper.time(), e),
    }
}

/// Part of the length that a joint stands for beyond which the report says what of its gap no force explains.
const UNEXPLAINED: f64 = 1e-3;

fn summary(
    stepper: &Stepper,
    simulation: Simulation,
    tally: Tally,
    stopped: Option<&'static str>,
) -> Summary {
    let (options, scene) = (stepper.options(), stepper.scene());
    let (sum, elimination) = (tally.summary, stepper.elimination());
    // The gaps of a lost run do not measure a strain.
    let strain = scene.strain_note(&simulation.gaps);
    let strain = strain.filter(|_| simulation.failure.is_none());
    // The step that gains too much has no sample.
    let gained = match &simulation.error {
        Some(StepError::EnergyGain { excess, scale, .. }) => Some(excess / scale),
        _ => None,
    };
    let [whole, phases @ ..] = &tally.times;
    let phases = Phase::ALL.iter().zip(phases);
    Summary {
        backend: options.backend.to_string(),
        chosen: stepper.chosen().map(|chosen| ChosenSolver {
            backend: chosen.backend.to_string(),
            reason: chosen.to_string(),
        }),
        form: options.form.to_string(),
        elimination: elimination.taken.to_string(),
        factor_entries: elimination.cost.map(|c| c.entries),
        factor_flops: elimination.cost.map(|c| c.flops),
        scheme: options.scheme.to_string(),
        stiffness: options.stiffness.to_string(),
        guard: options.guard.map(|g| g.tolerance),
        substeps: options.substeps,
        refinements: options.refinements,
        dt: options.dt,
        stable: simulation.failure.is_none() && stopped.is_none(),
        stopped,
        unconverged_steps: sum.steps.saturating_sub(simulation.claimed),
        undecided_steps: simulation.undecided,
        failure: simulation.failure,
        max_energy_excess: sum
            .max_energy_excess
            .into_iter()
            .chain(gained)
            .reduce(worse),
        resolved: sum
            .resolved
            .filter(|r| r.segments + r.splits + r.merges > 0),
        extent: tally.corners.map_or(0.0, |[a, b]| (b - a).norm()),
        size: load_error::size(scene, stepper.time()),
        notes: sum.notes.into_iter().chain(strain).collect(),
        largest_gap: simulation.openings.widest.found().cloned(),
        unexplained_gap: Some(simulation.openings.unexplained)
            .filter(|o| o.found().is_some() && o.strain() > UNEXPLAINED),
        step_ns: whole.timing(),
        phases_ns: phases
            .map(|(p, t)| (format!("{p:?}").to_lowercase(), t.timing().median))
            .collect(),
        iterations_mean: sum.iterations_mean / sum.steps.max(1) as f64,
        final_state: final_state(scene),
        ..sum
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
