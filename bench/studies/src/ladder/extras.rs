//! Measurements of the main job beside its rows: cost against size, error against mass ratio and
//! condition, error against the time step, the times of single steps, energies, patterns.

use super::{Config, OwnScene, nan_for_null};
use crate::cases::Cases;
use crate::linear;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use taut_ground::choice::Choice;
use taut_ground::errors::worse;
use taut_ground::poses::Pose;
use taut_ground::reference::{self, Motion};
use taut_ground::trajectory::{Timing, simulate, steps_in};
use taut_integrator::{GeometricStiffness, PhaseTimes, Scheme, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Network, NetworkParams, Scene};
use taut_output::check::ExperimentError;
use taut_solver::{BlockPattern, SymBlockMatrix};

/// Measurements beside the rows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Extras {
    /// Step against number of segments.
    pub sizes: Vec<Size>,
    /// Forward errors against mass ratio.
    pub ladder: Vec<Rung>,
    /// Condition of S at these mass ratios, as (ratio, ‖S‖₁ ‖S⁻¹‖₁).
    pub conditions: Vec<[f64; 2]>,
    /// Error of motions against Δt.
    pub steps: Vec<Step>,
    /// Times of the single steps of a run.
    pub trace: Trace,
    /// Total energies of a swing.
    pub energies: Vec<Energies>,
    /// Patterns of S and of its factor.
    pub patterns: Vec<Pattern>,
}

/// Cost of a step on a hoist of some size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Backend and form.
    pub backend: String,
    pub segments: usize,
    /// A whole step, median \[ns].
    pub step_ns: f64,
}

/// The error of a linear solve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// Backend and form.
    pub backend: String,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Refinements from the pieces.
    pub refinements: usize,
    /// Relative error of the multipliers against 32 digits.
    #[serde(deserialize_with = "nan_for_null")]
    pub forward_error: f64,
}

/// A motion with some Δt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    pub scheme: String,
    /// Backend and form where solvers are compared, with the default scheme and no guard; `None` where schemes are, with the
    /// default solver.
    #[serde(default)]
    pub backend: Option<String>,
    /// Δt \[s].
    pub dt: f64,
    /// Cost of a second of motion: median step times steps \[ns].
    pub second_ns: f64,
    /// Largest distance of the load from the reference \[m]; `None` for a run that ended early.
    pub load_error_m: Option<f64>,
}

/// The times of the steps of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Trace {
    /// The scene and the solver.
    pub title: String,
    /// Δt \[s].
    pub dt: f64,
    /// One time a step \[ns].
    pub step_ns: Vec<f64>,
}

impl Trace {
    /// The time that a share of the steps keeps \[ns].
    #[must_use]
    pub fn quantile(&self, share: f64) -> f64 {
        let mut sorted = self.step_ns.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        let at = (share * last as f64).round() as usize;
        sorted.get(at).copied().unwrap_or(f64::NAN)
    }

    /// The median, what 95 and 99 of 100 steps keep, and the longest \[ns].
    #[must_use]
    pub fn quantiles(&self) -> [(&'static str, f64); 4] {
        let shares = [("p50", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1.0)];
        shares.map(|(name, share)| (name, self.quantile(share)))
    }
}

/// The energy of a swing with a scheme.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    pub scheme: String,
    /// (time \[s], change of the total energy over the largest kinetic energy).
    pub points: Vec<[f64; 2]>,
}

/// Where a symmetric matrix and its factor have blocks; lower triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pattern {
    /// The scene and the order.
    pub title: String,
    /// Number of block rows.
    pub blocks: usize,
    /// (row, column) of the matrix's blocks.
    pub matrix: Vec<[usize; 2]>,
    /// (row, column) of the further blocks of the factor.
    pub fill: Vec<[usize; 2]>,
}

/// Mass ratio of the scenes but those of the ladder.
const RATIO: f64 = 1e3;
const DT: f64 = 1.0 / 60.0;

/// A part of them, measured by itself.
#[derive(Debug, Clone, Copy)]
enum Part {
    Sizes,
    MassRatios,
    TimeSteps,
    Trace,
    Energies,
    Patterns,
}

impl Part {
    const ALL: [Self; 6] = [
        Self::Sizes,
        Self::MassRatios,
        Self::TimeSteps,
        Self::Trace,
        Self::Energies,
        Self::Patterns,
    ];

    fn measure(self, choices: &[Choice], quick: bool) -> Result<Extras, ExperimentError> {
        let mut extras = Extras::default();
        match self {
            Self::Sizes => extras.sizes = sizes(choices, quick)?,
            Self::MassRatios => {
                (extras.ladder, extras.conditions) = mass_ratios(choices, quick)?;
            }
            Self::TimeSteps => extras.steps = time_steps(choices, quick)?,
            Self::Trace => extras.trace = trace(quick)?,
            Self::Energies => extras.energies = energies(quick)?,
            Self::Patterns => extras.patterns = patterns()?,
        }
        Ok(extras)
    }
}

impl Extras {
    /// These with those of another part.
    fn with(mut self, part: Self) -> Self {
        self.sizes.extend(part.sizes);
        self.ladder.extend(part.ladder);
        self.conditions.extend(part.conditions);
        self.steps.extend(part.steps);
        self.energies.extend(part.energies);
        self.patterns.extend(part.patterns);
        if self.trace.step_ns.is_empty() {
            self.trace = part.trace;
        }
        self
    }
}

/// Measures all of them, each part a case.
///
/// # Errors
/// Where a scene or a step of the default solver fails; another solver's failure leaves its point out.
pub(super) fn measure(
    choices: &[Choice],
    quick: bool,
    cases: &Cases,
) -> Result<Extras, ExperimentError> {
    let measure = |part: &Part| part.measure(choices, quick);
    let parts = cases.in_turn("plots", &Part::ALL, measure)?.all()?;
    Ok(parts.into_iter().fold(Extras::default(), Extras::with))
}

/// For scenes other than the hoist: their patterns, and the step times of the first.
///
/// # Errors
/// As [`Stepper::new`] and [`Stepper::solve`].
pub(super) fn measure_own(config: &Config, cases: &Cases) -> Result<Extras, ExperimentError> {
    let first: Vec<_> = config.own.iter().take(1).collect();
    let names: Vec<&str> = first.iter().map(|own| own.name.as_str()).collect();
    let measure = |_: &&str| of_own(config, first[0]);
    let parts = cases.in_turn("plots", &names, measure)?.all()?;
    Ok(parts.into_iter().fold(Extras::default(), Extras::with))
}

fn of_own(config: &Config, first: &OwnScene) -> Result<Extras, StepError> {
    let patterns = config
        .own
        .iter()
        .map(|own| pattern(&own.name, own.scene.clone()));
    let patterns = patterns.collect::<Result<_, _>>()?;
    let title = format!("{}, solver {}", first.name, StepOptions::default().backend);
    let mut stepper = Stepper::new(first.scene.clone(), StepOptions::default())?;
    let mut step_ns = Vec::new();
    for _ in 0..steps_in(config.time, DT) {
        first.inputs.apply(&mut stepper)?;
        let start = Instant::now();
        // Where the run is lost the rows say why.
        if stepper.step().is_err() {
            break;
        }
        step_ns.push(start.elapsed().as_nanos() as f64);
    }
    Ok(Extras {
        trace: Trace {
            title,
            dt: DT,
            step_ns,
        },
        patterns,
        ..Extras::default()
    })
}

/// A hoist in equilibrium whose anchor moves aside.
fn hoist(segments: usize, mass_ratio: f64) -> HoistParams {
    HoistParams {
        segments,
        mass_ratio,
        seed: 1,
        move_x: 0.5,
        move_duration: 1.5,
        ..HoistParams::default()
    }
}

fn sizes(choices: &[Choice], quick: bool) -> Result<Vec<Size>, StepError> {
    let numbers: &[usize] = if quick {
        &[12, 50, 200]
    } else {
        &[12, 24, 50, 100, 200, 500, 1000, 2000]
    };
    let budget = Duration::from_millis(if quick { 5 } else { 25 });
    let mut sizes = Vec::new();
    for choice in choices {
        if choice.backend.name() == "dense" || choice.check().is_err() {
            continue;
        }
        for &segments in numbers {
            let scene = reference::scene(&hoist(segments, RATIO))?;
            let Some(step_ns) = median_step(scene, choice, budget) else {
                break;
            };
            sizes.push(Size {
                backend: choice.family(),
                segments,
                step_ns,
            });
            // A solver that is this slow shows its slope by then.
            if step_ns > 2.0 * budget.as_nanos() as f64 {
                break;
            }
        }
    }
    Ok(sizes)
}

/// The median time of a step after the first, which may allocate; `None` where one fails.
fn median_step(scene: Scene, choice: &Choice, budget: Duration) -> Option<f64> {
    let mut stepper = Stepper::new(scene, choice.plain_options(DT)).ok()?;
    stepper.step().ok()?;
    let start = Instant::now();
    let mut times = Vec::new();
    while times.len() < 2 || (times.len() < 300 && start.elapsed() < budget) {
        times.push(stepper.step().ok()?.phases.total());
    }
    Some(Timing::of(times.into_iter()).median)
}

fn mass_ratios(
    choices: &[Choice],
    quick: bool,
) -> Result<(Vec<Rung>, Vec<[f64; 2]>), ExperimentError> {
    let decades = if quick { 2 } else { 1 };
    let ratios: Vec<f64> = (0..=8).step_by(decades).map(|k| 10_f64.powi(k)).collect();
    let config = linear::Config {
        segments: vec![24],
        ratios: ratios.clone(),
        poses: vec![Pose::Bent],
        choices: choices
            .iter()
            .filter(|c| !c.backend.is_iterative() && c.check().is_ok())
            .cloned()
            .collect(),
        refinements: vec![0, 1],
        ..linear::Config::quick()
    };
    let rows = linear::run(&config, &Cases::default())?;
    let rungs = rows.into_iter().filter(|r| r.error.is_none());
    let rungs = rungs.map(|r| Rung {
        backend: r.backend,
        mass_ratio: r.mass_ratio,
        refinements: r.refinements,
        forward_error: r.forward_error,
    });
    let mut conditions = Vec::new();
    for ratio in ratios {
        let params = config.params(24, ratio)?;
        let mut stepper = Stepper::new(params.build()?, StepOptions::default())?;
        stepper.solve()?;
        let (a, ..) = stepper.system();
        if let Some(condition) = condition(a) {
            conditions.push([ratio, condition]);
        }
    }
    Ok((rungs.collect(), conditions))
}

/// ‖A‖₁ ‖A⁻¹‖₁; `None` where A is singular to rounding. Its inverse is made: cubic cost.
fn condition(a: &SymBlockMatrix) -> Option<f64> {
    let p = a.pattern();
    let mut dense = DMatrix::<f64>::zeros(p.dim(), p.dim());
    for j in 0..p.blocks() {
        for k in p.column(j) {
            let (rows, n) = (p.rows(p.row(k)), p.size(p.row(k)));
            for (at, &value) in a.block(k).iter().enumerate() {
                let (row, column) = (rows.start + at % n, p.rows(j).start + at / n);
                dense[(row, column)] = value;
                dense[(column, row)] = value;
            }
        }
    }
    let norm = |m: &DMatrix<f64>| {
        let sums = m.column_iter().map(|c| c.iter().map(|x| x.abs()).sum());
        sums.fold(0.0, f64::max)
    };
    let size = norm(&dense);
    Some(size * norm(&dense.try_inverse()?))
}

/// The schemes that are compared, each with the stiffness that is its default.
fn schemes() -> [Scheme; 3] {
    [Scheme::default(), Scheme::Spook, Scheme::LinearlyImplicit]
}

fn options(scheme: Scheme, dt: f64) -> StepOptions {
    StepOptions {
        scheme,
        dt,
        stiffness: GeometricStiffness::inertia(scheme.default_alpha()),
        ..StepOptions::default()
    }
}

fn time_steps(choices: &[Choice], quick: bool) -> Result<Vec<Step>, StepError> {
    let time = if quick { 1.0 } else { 3.0 };
    let rates: &[usize] = if quick {
        &[60, 240]
    } else {
        &[30, 60, 120, 240, 480, 960]
    };
    let params = hoist(24, RATIO);
    let substeps = reference::stable_substeps(&params, DT)?;
    let frames = steps_in(time, DT);
    let (exact, _) =
        reference::extrapolated(&Motion::of_hoist(&params)?, DT, substeps, frames, 0..0)?;
    let gap = reference::most_gap(&params)?;
    let step =
        |options: StepOptions, backend: Option<String>, rate: usize| -> Result<Step, StepError> {
            let (scheme, dt) = (options.scheme.to_string(), options.dt);
            let mut stepper = Stepper::new(reference::scene(&params)?, options)?;
            let run = simulate(&mut stepper, time, gap, |_| {});
            // Positions at the ends of the longer of both steps.
            let (ours, theirs) = (rate.div_ceil(60), 60_usize.div_ceil(rate));
            let ends = run.samples.iter().skip(ours - 1).step_by(ours);
            let exact = exact.load.iter().skip(theirs - 1).step_by(theirs);
            let error = ends.zip(exact).map(|(s, x)| (s.load - x).norm());
            let median = run.nanoseconds(PhaseTimes::total).median;
            Ok(Step {
                scheme,
                backend,
                dt,
                second_ns: median * rate as f64,
                load_error_m: run.failure.is_none().then(|| error.fold(0.0, worse)),
            })
        };
    let mut steps = Vec::new();
    for scheme in schemes() {
        for &rate in rates {
            steps.push(step(options(scheme, 1.0 / rate as f64), None, rate)?);
        }
    }
    for choice in choices.iter().filter(|c| c.check().is_ok()) {
        for &rate in rates {
            let options = choice.plain_options(1.0 / rate as f64);
            steps.extend(step(options, Some(choice.family()), rate));
        }
    }
    Ok(steps)
}

fn trace(quick: bool) -> Result<Trace, StepError> {
    let options = StepOptions::default();
    let title = format!(
        "hoist of 24 segments, load 10³ segments, solver {}",
        options.backend
    );
    let dt = options.dt;
    let mut stepper = Stepper::new(reference::scene(&hoist(24, RATIO))?, options)?;
    let count = steps_in(if quick { 5.0 } else { 60.0 }, dt);
    let mut step_ns = Vec::with_capacity(count);
    for _ in 0..count {
        let start = Instant::now();
        stepper.step()?;
        step_ns.push(start.elapsed().as_nanos() as f64);
    }
    Ok(Trace { title, dt, step_ns })
}

fn energies(quick: bool) -> Result<Vec<Energies>, StepError> {
    let time = if quick { 5.0 } else { 30.0 };
    let params = HoistParams {
        segments: 24,
        mass_ratio: RATIO,
        initial_angle: 0.3,
        ..HoistParams::default()
    };
    let gap = reference::most_gap(&params)?;
    let mut all = Vec::new();
    for scheme in schemes() {
        let mut stepper = Stepper::new(reference::scene(&params)?, options(scheme, DT))?;
        let run = simulate(&mut stepper, time, gap, |_| {});
        let largest = run
            .samples
            .iter()
            .map(|s| s.energy.kinetic)
            .fold(0.0, f64::max);
        let Some(first) = run.samples.first().map(|s| s.energy.total()) else {
            continue;
        };
        let change = |total: f64| (total - first) / largest;
        let points = run
            .samples
            .iter()
            .map(|s| [s.time, change(s.energy.total())]);
        all.push(Energies {
            scheme: scheme.to_string(),
            points: points.collect(),
        });
    }
    Ok(all)
}

fn patterns() -> Result<Vec<Pattern>, StepError> {
    let network = |network| {
        let params = NetworkParams {
            segments: if network == Network::Net { 6 } else { 24 },
            ..NetworkParams::new(network)
        };
        params.build()
    };
    let scenes = [
        ("hoist of 24 segments", hoist(24, RATIO).build()?),
        ("ring of 24 segments", network(Network::Ring)?),
        ("net of 6 × 6 nodes", network(Network::Net)?),
    ];
    let patterns = scenes.into_iter();
    patterns.map(|(name, scene)| pattern(name, scene)).collect()
}

/// Where S and its factor have blocks at the start of a scene.
fn pattern(name: &str, scene: Scene) -> Result<Pattern, StepError> {
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    stepper.solve()?;
    let order = stepper.elimination().taken;
    let p = stepper.system().0.pattern();
    let blocks = |p: &BlockPattern| -> Vec<[usize; 2]> {
        let columns = 0..p.blocks();
        let of = |j| p.column(j).map(move |k| [p.row(k), j]);
        columns.flat_map(of).collect()
    };
    let matrix = blocks(p);
    let factor = taut_solver::factor_pattern(p).map_err(|source| StepError::Solve {
        source,
        culprit: None,
        time: 0.0,
    })?;
    let mut fill = blocks(&factor);
    fill.retain(|at| !matrix.contains(at));
    Ok(Pattern {
        title: format!("{name}, order {order}"),
        blocks: p.blocks(),
        matrix,
        fill,
    })
}
