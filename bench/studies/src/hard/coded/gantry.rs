//! The gantry crane \[SL §VIII] driven for a minute from a table of inputs, at load/element ratios to 10⁵, with the
//! true inertia of its thin cable elements (the paper multiplies it by 20).
//!
//! The reference is the same drive in finer steps, whose own error is the difference to steps twice as long.

use crate::hard::{DT, at, each_solver, farthest, worse};
use crate::options::pick;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::fmt::Write;
use std::time::Instant;
use taut_integrator::{StepError, Stepper};
use taut_measure::inputs::Inputs;
use taut_measure::pace;
use taut_measure::trajectory::steps_in;
use taut_model::{GantryParams, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

/// The drive: a minute.
pub(super) const DRIVE: &str = include_str!("gantry.csv");
const TIME: f64 = 60.0;
/// Largest error of the positions of hook and load that passes \[m]: half a per cent of the cables' 4 m, half of what
/// engines are compared at.
const BAR: f64 = 0.02;
/// Largest difference of these positions between the reference and one in steps twice as long \[m].
const REFERENCE_BAR: f64 = 2e-3;
/// Most that the slowest step may take, with what else the machine does in between \[s].
const WORST_BAR: f64 = 1.0;
/// Largest relative error of the multipliers that passes.
const SOLVER_BAR: f64 = 1e-8;

#[derive(Default)]
struct Run {
    /// Centres of hook and load after each sixtieth of a second \[m].
    path: [Vec<Vector3<f64>>; 2],
    /// Wall-clock time of each step \[s].
    spent: Vec<f64>,
    /// Steps that the guard took again.
    redone: usize,
    failure: Option<String>,
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (ratios, time): (&[f64], f64) = pick(quick, [(&[1e3, 1e4, 1e5], TIME), (&[1e5], 15.0)]);
    progress.set_length(3 * ratios.len() as u64);
    let mut outcome = Outcome {
        text: "load/element  hook error  load error  reference ±  real-time factor  slowest step  redone\n"
            .to_owned(),
        ..Outcome::default()
    };
    for &ratio in ratios {
        let params = GantryParams {
            mass_ratio: ratio,
            ..GantryParams::default()
        };
        let driven = |finer| -> Result<Run, StepError> {
            let run = drive(params.build().map_err(StepError::Scene)?, time, finer);
            progress.inc(1);
            run
        };
        let finer = if quick { 8 } else { 16 };
        let (ours, coarse, fine) = (driven(1)?, driven(finer / 2)?, driven(finer)?);
        compare(ratio, (time, finer), &ours, [&coarse, &fine], &mut outcome);
    }
    for parts in if quick { vec![2] } else { vec![2, 4, 12] } {
        outcome.checks.extend(agreement(parts)?);
    }
    Ok(outcome)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![GantryParams::default().build()?])
}

/// Drives `scene` for `time` (s), in steps `finer` times shorter than a sixtieth of a second.
fn drive(scene: Scene, time: f64, finer: usize) -> Result<Run, StepError> {
    let options = at(DT / finer as f64);
    let inputs = inputs(&scene)?;
    let mut stepper = Stepper::new(scene, options)?;
    let (hook, load) = (2, stepper.scene().bodies.len() - 1);
    let mut run = Run::default();
    for n in 1..=steps_in(time, DT) * finer {
        let start = Instant::now();
        let step = inputs
            .apply(&mut stepper)
            .and_then(|()| pace::step(&mut stepper));
        run.spent.push(start.elapsed().as_secs_f64());
        match step {
            Ok(report) => run.redone += usize::from(report.redone),
            Err(e) => {
                run.failure = Some(e.to_string());
                break;
            }
        }
        if n % finer == 0 {
            for (path, i) in run.path.iter_mut().zip([hook, load]) {
                path.push(stepper.scene().bodies.position[i]);
            }
        }
    }
    Ok(run)
}

/// The drive for a scene that has the gantry's controls.
fn inputs(scene: &Scene) -> Result<Inputs, StepError> {
    Inputs::parse(DRIVE, scene).map_err(|_| StepError::NotControllable {
        what: scene.name.clone(),
        reason: "does not have the controls of the drive",
    })
}

/// Largest distances of the hooks and of the loads; infinite where one drive ends early.
fn distances(a: &Run, b: &Run) -> [f64; 2] {
    [0, 1].map(|which| match (&a.path[which], &b.path[which]) {
        (a, b) if a.len() == b.len() => farthest(a, b),
        _ => f64::INFINITY,
    })
}

/// The checks of the drives at one ratio, and the row of the table.
fn compare(
    ratio: f64,
    (time, finer): (f64, usize),
    ours: &Run,
    [coarse, fine]: [&Run; 2],
    outcome: &mut Outcome,
) {
    // The first step, which may allocate, is left out.
    let mut later = ours.spent.get(1..).unwrap_or_default().to_vec();
    later.sort_by(f64::total_cmp);
    let slow = later.len().saturating_sub(1 + later.len() / 100);
    let [late, worst] =
        [slow, later.len().saturating_sub(1)].map(|i| later.get(i).copied().unwrap_or(f64::NAN));
    let [hook, load] = distances(ours, fine);
    let known = distances(coarse, fine).into_iter().fold(0.0, worse);
    let (factor, redone) = (time / ours.spent.iter().sum::<f64>(), ours.redone);
    let case = |what: &str| format!("load/element {ratio:.0e}: {what}");
    let position = |what: &str, reference: &str, error: f64, bar: f64| {
        Check::off(case(what), reference, error, "m", bar)
            .by("largest distance over the whole drive, m")
    };
    let frame = |what: &str, time: f64| {
        let ours = format!("{:.3} ms", 1e3 * time);
        Check::within(case(what), "16.7 ms a frame", ours, time, DT).by("seconds, wall clock")
    };
    let stable = format!("stable, {redone} steps redone");
    let finer = format!("steps {finer} times finer");
    outcome.checks.extend([
        Check::stated(
            case("driven to the end"),
            "stable, true inertia",
            ours.failure.as_ref().unwrap_or(&stable),
            ours.failure.is_none(),
        ),
        position("hook", &finer, hook, BAR),
        position("load", &finer, load, BAR),
        position("the reference", "steps twice as long", known, REFERENCE_BAR),
        Check::stated(
            case("real-time factor"),
            "above 1",
            format!("{factor:.0}"),
            factor > 1.0,
        ),
        frame("all but the slowest 1 % of the steps", late),
        // Interruptions by other processes count here; the step is not to blame.
        frame("slowest step", worst).limited(
            worst <= WORST_BAR,
            "the system took the processor away: all but 1 % of the steps are judged above",
        ),
    ]);
    let [hook, load, known, worst] = [hook, load, known, worst].map(|x| 1e3 * x);
    let _ = writeln!(
        outcome.text,
        "{ratio:>12.0e}  {hook:>7.1} mm  {load:>7.1} mm  {known:>8.2} mm  {factor:>16.0}  {worst:>9.3} ms  {redone:>6}"
    );
}

/// Every solver on the system after four seconds of the drive, falls per hoist cable `parts`.
fn agreement(parts: usize) -> Result<Vec<Check>, ExperimentError> {
    let params = GantryParams {
        parts,
        mass_ratio: 1e4,
        ..GantryParams::default()
    };
    let scene = params.build()?;
    let inputs = inputs(&scene)?;
    let options = at(DT);
    let mut leader = Stepper::new(scene.clone(), options)?;
    for _ in 0..steps_in(4.0, DT) {
        inputs.apply(&mut leader)?;
        leader.step()?;
    }
    let state = leader.scene().clone();
    let tension: Vec<f64> = leader.multipliers().iter().map(|mu| mu / DT).collect();
    let case = format!("{parts} falls a cable, multipliers");
    each_solver(&case, |choice| {
        let scene = Scene {
            start_in_equilibrium: false,
            ..state.clone()
        };
        let mut stepper = Stepper::new(scene, choice.plain_options(DT))?;
        stepper.set_state(&state.bodies, leader.time())?;
        stepper.set_tension(&tension)?;
        let exact = stepper.reference_multipliers()?;
        // Cold, so that what comes out is the solver's own.
        stepper.set_multipliers(&vec![0.0; exact.len()])?;
        stepper.set_tension(&tension)?;
        let report = match stepper.solve() {
            Ok(report) => report,
            Err(e) => return Ok(Check::failed("", "32 digits", &e)),
        };
        let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let pairs = stepper.multipliers().iter().zip(&exact);
        let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, worse) / largest;
        Ok(Check::off("", "32 digits", error, "", SOLVER_BAR)
            .by("multipliers, relative to the largest")
            .unless_claimed(&report.solve))
    })
}
