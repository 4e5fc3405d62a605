//! H54: smaller time steps and more iterations make it better, every time.
//!
//! **Time step.** A cable whose anchor moves aside, at Δt = 1/15 s … 1/3840 s, against a motion that is converged in Δt
//! ([`taut_measure::reference::converged`]): the largest distance of the load at any of the frames that all of them have.
//!
//! **Iterations.** One solve from zero, with 1 … 1024 iterations: the error's energy norm √(eᵀ S e), over that of the
//! solution, in which both Gauss–Seidel and conjugate gradient cannot get worse in exact arithmetic. In other norms
//! they can, and what a simulation of a second makes of unfinished solves is another matter, which stands in the
//! second table: the largest distance of the load from that of the direct solve in this second.
//!
//! Where nothing promises that every step of a ladder is better, what an unfinished solve or an explicit part of the step
//! leaves being carried into the next steps, a relapse is a limit, as long as the top of the ladder is better than its
//! bottom, by half. What is farther away than the cable is long is lost.

use crate::hard::{DT, farthest, grid, together, worse};
use crate::options::pick;
use crate::scenes::reference_choice;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use rayon::prelude::*;
use taut_integrator::{Form, Scheme, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::poses::{self, Pose};
use taut_measure::reference::{Converged, converged, scene};
use taut_measure::trajectory::{load_position, steps_in};
use taut_model::{HoistParams, Scene};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::table::error;
use taut_solver::{Backend, SymBlockMatrix, reference_solution};

/// The frames that all time steps have \[s], and how many.
const FRAME: f64 = 1.0 / 15.0;
const FRAMES: usize = 30;

/// Halvings of the coarsest time step: down to 1/3840 s.
const HALVINGS: u32 = 8;

/// Error in the energy norm that rounding leaves.
const FLOOR: f64 = 1e-10;

/// A step may be worse than the one before by rounding.
const MONOTONE: f64 = 1.0 + 1e-9;

/// Largest last error of a ladder over its first one.
const IMPROVED: f64 = 0.5;

fn params() -> HoistParams {
    HoistParams {
        segments: 6,
        mass_ratio: 50.0,
        seed: 1,
        move_x: 0.5,
        move_duration: 2.0,
        ..HoistParams::default()
    }
}

/// The cable of the time steps and that of the iterations.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut moved = scene(&params())?;
    "anchor moves".clone_into(&mut moved.name);
    let mut bent = poses::hoist(&params(), Pose::Bent)?;
    "bent".clone_into(&mut bent.name);
    Ok(vec![moved, bent])
}

/// Errors over Δt (s) or iterations of one thing that is compared; none of a run that was lost.
type Ladder = (String, Vec<(f64, Option<f64>)>);

/// The steps that are compared.
fn settings() -> Vec<(&'static str, StepOptions)> {
    let plain = StepOptions {
        guard: None,
        ..StepOptions::default()
    };
    let spook = StepOptions {
        scheme: Scheme::Spook,
        ..StepOptions::default()
    };
    let mut settings = vec![
        ("default", StepOptions::default()),
        ("default, no guard", plain.clone()),
        ("spook", spook),
        ("paper", StepOptions::paper()),
    ];
    for name in ["gauss-seidel:groups", "cg:jacobi"] {
        let backend = name.parse::<Backend>().ok().filter(Backend::is_compiled);
        if let Some(backend) = backend {
            let options = StepOptions {
                backend: backend.with_iterations(20),
                refinements: 0,
                ..plain.clone()
            };
            settings.push((name, options));
        }
    }
    settings
}

/// Largest distance of the load from the converged motion, over the frames \[m].
fn distance(options: &StepOptions, substeps: usize, exact: &Converged) -> Option<f64> {
    let options = StepOptions {
        dt: FRAME / substeps as f64,
        ..options.clone()
    };
    let mut stepper = Stepper::new(scene(&params()).ok()?, options).ok()?;
    let mut worst = 0.0;
    for load in &exact.load {
        for _ in 0..substeps {
            stepper.step().ok()?;
        }
        let way = (load_position(stepper.scene()) - Vector3::from(*load)).norm();
        if way.is_nan() || way > params().length {
            return None;
        }
        worst = worse(worst, way);
    }
    Some(worst)
}

/// The worst ratio of an error to the one before, of those above the floor, and where; what did not end counts as lost.
fn worst_step(rungs: &[(f64, Option<f64>)], bar: Bar) -> (f64, String) {
    let size = |r: (f64, Option<f64>)| r.1.unwrap_or(bar.lost);
    let mut worst = (0.0, String::new());
    for w in rungs.windows(2) {
        let [before, after] = [size(w[0]), size(w[1])];
        let ratio = after / before;
        let lost = before.is_nan() || after.is_nan();
        if lost || (after > bar.floor && ratio > worst.0) {
            let at = format!("from {} to {}", shown(w[0].0), shown(w[1].0));
            worst = (ratio, at);
        }
    }
    worst
}

fn shown(at: f64) -> String {
    if at < 1.0 {
        format!("1/{:.0}", 1.0 / at)
    } else {
        format!("{at:.0}")
    }
}

/// Bar of a ladder.
#[derive(Clone, Copy)]
struct Bar {
    /// Errors below are the reference's own, or rounding.
    floor: f64,
    /// Size beyond which an error counts as lost.
    lost: f64,
    /// Every step must be better, and no run may be lost.
    promised: bool,
}

/// Better at every step; a ladder with runs that are lost, or with a relapse where nothing forbids it, is at its limit
/// where it leads up.
fn monotone(case: String, rungs: &[(f64, Option<f64>)], bar: Bar) -> Check {
    let (ratio, at) = worst_step(rungs, bar);
    let lost = rungs.iter().filter(|r| r.1.is_none_or(|e| e > bar.lost));
    let lost = lost.count();
    let ours = match at.as_str() {
        "" => "exact from the first".to_owned(),
        at => format!("× {ratio:.2} {at}"),
    };
    let check = Check::within(case, "every step better", ours, ratio, MONOTONE)
        .by("largest ratio of an error to the one before it on the ladder, above the reference's own or rounding");
    // Up it has to go in any case: the top better than the bottom.
    let size = |r: Option<&(f64, Option<f64>)>| r.and_then(|r| r.1).unwrap_or(bar.lost);
    let (first, last) = (size(rungs.first()), size(rungs.last()));
    let climbs = last <= bar.floor || (last <= bar.lost && last < IMPROVED * first);
    let all_lost = format!("{lost} of {} runs are lost", rungs.len());
    let (verdict, note) = if !climbs {
        let note = format!("from {first:.1e} it comes to {last:.1e}: no better");
        (Verdict::Fail, note)
    } else if check.verdict == Verdict::Pass && lost == 0 {
        return check;
    } else if bar.promised || ratio.is_nan() {
        let note = if lost > 0 { all_lost } else { String::new() };
        (Verdict::Fail, note)
    } else {
        let lost = if lost > 0 {
            all_lost + "; "
        } else {
            String::new()
        };
        let note = format!(
            "{lost}what a solve leaves undone, or a step takes explicitly, the next one has to deal with: from \
             {first:.1e} at the bottom to {last:.1e} at the top"
        );
        (Verdict::Limit, note)
    };
    Check {
        verdict,
        ..check.with_note(note)
    }
}

fn time_ladders(quick: bool, exact: &Converged) -> Vec<Ladder> {
    let substeps: Vec<usize> = (0..=pick(quick, [HALVINGS, 4]))
        .map(|k| 2_usize.pow(k))
        .collect();
    let of_setting = |(name, options): (&str, StepOptions)| {
        let rungs = substeps.par_iter().with_max_len(1);
        let rungs = rungs.map(|&n| (FRAME / n as f64, distance(&options, n, exact)));
        (name.to_owned(), rungs.collect())
    };
    settings().into_par_iter().map(of_setting).collect()
}

/// eᵀ S e.
fn energy(s: &SymBlockMatrix, e: &[f64]) -> f64 {
    let mut sum = 0.0;
    s.for_each_lower(|r, c, a| sum += if r == c { 1.0 } else { 2.0 } * a * e[r] * e[c]);
    sum
}

fn iterative() -> Vec<Choice> {
    let all = Choice::all().into_iter();
    all.filter(|c| c.backend.is_iterative() && c.check().is_ok())
        .collect()
}

/// Error in the energy norm after that many iterations from zero, over the solution's.
fn unfinished(choice: &Choice, limit: usize) -> Result<f64, ExperimentError> {
    let options = StepOptions {
        backend: choice.backend.with_iterations(limit).with_tolerance(1e-15),
        warm_start: false,
        ..choice.plain_options(DT)
    };
    let mut stepper = Stepper::new(poses::hoist(&params(), Pose::Bent)?, options)?;
    stepper.solve()?;
    let x = stepper.system().2.to_vec();
    let (s, b) = stepper.assembled(Form::Schur)?;
    let exact = reference_solution(&s, &b)?;
    let e: Vec<f64> = x.iter().zip(&exact).map(|(x, e)| x - e).collect();
    Ok((energy(&s, &e) / energy(&s, &exact)).sqrt())
}

/// The load after each step of a second.
fn second(options: StepOptions) -> Result<Vec<Vector3<f64>>, ExperimentError> {
    let mut stepper = Stepper::new(scene(&params())?, options)?;
    let mut way = Vec::new();
    for _ in 0..steps_in(1.0, DT) {
        stepper.step()?;
        way.push(load_position(stepper.scene()));
    }
    Ok(way)
}

/// The ladders of iterations: of one solve, and of the load in a second.
fn iteration_ladders(quick: bool) -> Result<[Vec<Ladder>; 2], ExperimentError> {
    let direct = second(reference_choice().plain_options(DT))?;
    let limits = || (0..=pick(quick, [10, 7])).map(|k| 2_usize.pow(k));
    let load = |choice: &Choice, limit: usize| {
        let backend = choice.backend.with_iterations(limit);
        let options = StepOptions {
            backend,
            ..choice.plain_options(DT)
        };
        let way = second(options).ok().map(|way| farthest(&way, &direct));
        way.filter(|w| w.is_finite())
    };
    let (mut solves, mut loads) = (Vec::new(), Vec::new());
    for choice in iterative() {
        // On the KKT matrix it is the residual that falls, not this error.
        if choice.form == Form::Schur {
            let rungs = limits().map(|n| (n as f64, unfinished(&choice, n).ok()));
            solves.push((choice.family(), rungs.collect()));
        }
        let rungs = limits().map(|n| (n as f64, load(&choice, n)));
        loads.push((choice.family(), rungs.collect()));
    }
    Ok([solves, loads])
}

fn rung_table(title: &str, ladders: &[Ladder]) -> String {
    let first = ladders.first().into_iter().flat_map(|l| &l.1);
    let heads: Vec<String> = first.map(|r| shown(r.0)).collect();
    let rows = ladders.iter().map(|(what, rungs)| {
        let cells = rungs.iter().map(|r| error(r.1)).collect();
        (what.clone(), cells)
    });
    grid(title, &heads, rows) + "\n"
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    progress.set_length(3);
    let frames = if quick { FRAMES / 3 } else { FRAMES };
    let exact = converged(&params(), FRAME, frames)?;
    progress.inc(1);
    let times = time_ladders(quick, &exact);
    progress.inc(1);
    let [solves, loads] = iteration_ladders(quick)?;
    let bar = |floor, lost, promised| Bar {
        floor,
        lost,
        promised,
    };
    let length = params().length;
    // The other settings are explicit in the tension or end their solves early: they promise nothing at large steps.
    let of_time = |(what, rungs): &Ladder| {
        let bar = bar(exact.uncertainty, length, what == "default");
        monotone(format!("time step: {what}"), rungs, bar)
    };
    let mut checks: Vec<Check> = times.iter().map(of_time).collect();
    for (case, ladders, bar) in [
        (
            "iterations: one solve",
            &solves,
            bar(FLOOR, f64::INFINITY, true),
        ),
        ("iterations: load in 1 s", &loads, bar(1e-9, length, false)),
    ] {
        let judged = |(what, rungs): &Ladder| (what.clone(), monotone(String::new(), rungs, bar));
        checks.extend(together(case, ladders.iter().map(judged).collect()));
    }
    let text = format!(
        "Load against the converged motion, largest distance over {frames} frames of 1/15 s, ± {:.0e} [m]\n{}\
         {}{}",
        exact.uncertainty,
        rung_table("Δt", &times),
        rung_table("error of S μ = b", &solves),
        rung_table("load in 1 s [m]", &loads),
    );
    Ok(Outcome {
        checks,
        text,
        ..Outcome::default()
    })
}
