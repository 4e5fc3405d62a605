//! The gantry crane \[SL §VIII] driven for a minute from a table of inputs, at load/element ratios to 10⁵, with the
//! true inertia of its thin cable elements (the paper multiplies it by 20).
//!
//! The reference is the same drive in finer steps, whose own error is the difference to steps twice as long.

use crate::hard::worse;
use crate::hard::{at, either, solvers, together};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::fmt::Write;
use std::time::Instant;
use taut_ground::inputs::Inputs;
use taut_ground::pace;
use taut_ground::trajectory::steps_in;
use taut_integrator::{StepError, Stepper};
use taut_model::{GantryParams, Scene};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

/// The drive: a minute.
pub(super) const DRIVE: &str = include_str!("gantry.csv");
const TIME: f64 = 60.0;
const DT: f64 = 1.0 / 60.0;
/// Largest error of the positions of hook and load that passes \[m]: half a per cent of the cables' 4 m, half of what
/// engines are compared at.
const BAR: f64 = 0.02;
/// Largest difference of these positions between the reference and one in steps twice as long \[m].
const REFERENCE_BAR: f64 = 2e-3;
/// Most that the slowest step may take, with what else the machine does in between \[s].
const WORST_BAR: f64 = 1.0;
/// Largest relative error of the multipliers that passes.
const SOLVER_BAR: f64 = 1e-8;

/// One drive.
#[derive(Debug, Clone, PartialEq, Default)]
struct Run {
    /// Centres of hook and load after each sixtieth of a second \[m].
    path: Vec<[Vector3<f64>; 2]>,
    /// Wall-clock time of each step \[s].
    spent: Vec<f64>,
    /// Steps that the guard took again.
    redone: usize,
    failure: Option<String>,
}

/// Figures of a drive at one ratio.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    ratio: f64,
    stable: bool,
    hook_error_m: f64,
    load_error_m: f64,
    reference_error_m: f64,
    realtime_factor: f64,
    /// The step that 99 of 100 are not slower than; the first, which may allocate, is left out.
    late_step_s: f64,
    worst_step_s: f64,
    median_step_s: f64,
    redone: usize,
}

/// The checks of the driven gantry.
pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (ratios, time): (&[f64], f64) = either(quick, (&[1e5], 15.0), (&[1e3, 1e4, 1e5], TIME));
    progress.set_length(3 * ratios.len() as u64);
    let mut outcome = Outcome::default();
    let mut rows = Vec::new();
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
        let row = compare(ratio, time, &ours, [&coarse, &fine]);
        outcome.checks.extend(checks(&row, &ours, finer));
        rows.push(row);
    }
    outcome.text = table(&rows);
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
            run.path
                .push([hook, load].map(|i| stepper.scene().bodies.position[i]));
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

/// Largest distance of two paths of hook (0) or load (1); infinite where one ends early.
fn distance(a: &Run, b: &Run, which: usize) -> f64 {
    if a.path.len() != b.path.len() {
        return f64::INFINITY;
    }
    let pairs = a.path.iter().zip(&b.path);
    pairs
        .map(|(a, b)| (a[which] - b[which]).norm())
        .fold(0.0, worse)
}

fn compare(ratio: f64, time: f64, ours: &Run, [coarse, fine]: [&Run; 2]) -> Row {
    let mut later = ours.spent.get(1..).unwrap_or_default().to_vec();
    later.sort_by(f64::total_cmp);
    let late = later.len().saturating_sub(1 + later.len() / 100);
    let at = |i: usize| later.get(i).copied().unwrap_or(f64::NAN);
    Row {
        ratio,
        stable: ours.failure.is_none(),
        hook_error_m: distance(ours, fine, 0),
        load_error_m: distance(ours, fine, 1),
        reference_error_m: worse(distance(coarse, fine, 0), distance(coarse, fine, 1)),
        realtime_factor: time / ours.spent.iter().sum::<f64>(),
        late_step_s: at(late),
        worst_step_s: at(later.len().saturating_sub(1)),
        median_step_s: at(later.len() / 2),
        redone: ours.redone,
    }
}

fn checks(row: &Row, ours: &Run, finer: usize) -> Vec<Check> {
    let case = |what: &str| format!("load/element {:.0e}: {what}", row.ratio);
    let stable = Check::stated(
        case("driven to the end"),
        "stable, true inertia",
        ours.failure
            .clone()
            .unwrap_or_else(|| format!("stable, {} steps redone", row.redone)),
        row.stable,
    );
    let position = |what: &str, reference: String, error: f64, bar: f64| {
        Check::off(case(what), reference, error, "m", bar)
            .by("largest distance over the whole drive, m")
    };
    let frame = |what: &str, time: f64| {
        let ours = format!("{:.3} ms", 1e3 * time);
        Check::within(case(what), "16.7 ms a frame", ours, time, DT).by("seconds, wall clock")
    };
    let late = frame("all but the slowest 1 % of the steps", row.late_step_s);
    // Interruptions by other processes count here; the step is not to blame.
    let worst = frame("slowest step", row.worst_step_s).limited(
        row.worst_step_s <= WORST_BAR,
        "the system took the processor away: all but 1 % of the steps are judged above",
    );
    let finer = || format!("steps {finer} times finer");
    let fast = Check::stated(
        case("real-time factor"),
        "above 1",
        format!("{:.0}", row.realtime_factor),
        row.realtime_factor > 1.0,
    );
    vec![
        stable,
        position("hook", finer(), row.hook_error_m, BAR),
        position("load", finer(), row.load_error_m, BAR),
        position(
            "the reference",
            "steps twice as long".to_owned(),
            row.reference_error_m,
            REFERENCE_BAR,
        ),
        fast,
        late,
        worst,
    ]
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "load/element  hook error  load error  reference ±  real-time factor  slowest step  redone\n",
    );
    for r in rows {
        let _ = writeln!(
            text,
            "{:>12.0e}  {:>7.1} mm  {:>7.1} mm  {:>8.2} mm  {:>16.0}  {:>9.3} ms  {:>6}",
            r.ratio,
            1e3 * r.hook_error_m,
            1e3 * r.load_error_m,
            1e3 * r.reference_error_m,
            r.realtime_factor,
            1e3 * r.worst_step_s,
            r.redone
        );
    }
    text
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
    let mut found = Vec::new();
    for choice in solvers() {
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
            Err(e) => {
                let failed = "failed".to_owned();
                let check = Check::claim("", "32 digits", failed, Verdict::Fail, e.to_string());
                found.push((choice.family(), check));
                continue;
            }
        };
        let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let pairs = stepper.multipliers().iter().zip(&exact);
        let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, worse) / largest;
        let check = Check::off("", "32 digits", error, "", SOLVER_BAR)
            .by("multipliers, relative to the largest")
            .unless_claimed(&report.solve);
        found.push((choice.family(), check));
    }
    Ok(together(
        &format!("{parts} falls a cable, multipliers"),
        found,
    ))
}
