//! H36: heavy loads that fall and snap their coarse cables taut.
//!
//! A straight cable is let go from above the horizontal, its load 10³ to 10⁶ times as heavy as a segment: it folds, falls
//! free and is snapped taut, segments turn by a radian and more within a step. Whatever becomes of them, the hoist has no
//! more energy than it began with: E ≤ E₀ + 2MgL/100 in the mean over 0.25 s (at an instant a redone step knows its energy
//! to half a step of gravity's power). The cost of the steps that are redone is bounded. Over the first snaps, which differ
//! little from one fine step to another (which is checked), the load's path is compared with that of fine steps.

use crate::hard::{DT, GRAVITY, at, either, farthest, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use rayon::prelude::*;
use taut_ground::pace;
use taut_ground::random::Random;
use taut_ground::trajectory::{load_position, steps_in};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::HoistParams;
use taut_output::check::{Check, ExperimentError, Outcome};

/// Steps of a mean.
const MEAN: usize = 15;
/// Largest gain over 2MgL, and most linear systems of one step, that pass.
const GAIN: f64 = 0.01;
const SOLVES: usize = 300;
/// Largest distance of the load from where fine steps have it, over L, and the largest that is a limit.
const SWING: [f64; 2] = [0.01, 0.5];
/// Largest distance of two fine runs from each other, over the distance that they judge. Measured: 0.096, 0.030 and 0.010
/// at ratios of 10⁴, 10⁵ and 10⁶; errors of first order give (1/16 − 1/32)/(1 − 1/32) = 0.032. Twice the largest.
const FINE_BAR: f64 = 0.2;
/// How long the load's path is followed \[s], and the fine steps \[s].
const SWING_TIME: f64 = 4.0;
const FINE: [f64; 2] = [DT / 16.0, DT / 32.0];

pub(super) fn hoist(
    segments: usize,
    mass_ratio: f64,
    initial_angle: f64,
    seed: u64,
) -> HoistParams {
    HoistParams {
        segments,
        mass_ratio,
        initial_angle,
        seed,
        ..HoistParams::default()
    }
}

/// Four segments to 32, ratios of 10²·⁵ to 10⁶·⁵, 1.7 to 3.1 rad, 1 to 100 m.
fn any(random: &mut Random, seed: u64) -> HoistParams {
    let (segments, ratio) = (4 + random.below(29), random.log_uniform(3e2, 3e6));
    HoistParams {
        length: random.log_uniform(1.0, 100.0),
        ..hoist(segments, ratio, 2.4 + 0.7 * random.uniform(), seed)
    }
}

/// Figures of a drop.
#[derive(Default)]
struct Drop {
    /// Largest gain over 2MgL, in the mean of [`MEAN`] steps and at an instant.
    gain: f64,
    instant: f64,
    /// Most linear systems of a step, and implicit sub-steps that did not converge.
    most: usize,
    unconverged: usize,
    redone: usize,
    /// Why it ended early.
    lost: Option<StepError>,
}

fn dropped(params: &HoistParams, time: f64) -> Result<Drop, ExperimentError> {
    let scene = params.build()?;
    let mass = scene.load.map_or(f64::NAN, |i| scene.bodies.mass[i]);
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    let start = stepper.energy().total();
    let mut drop = Drop::default();
    let mut last = [0.0; MEAN];
    for _ in 0..steps_in(time, DT) {
        let report = match pace::step(&mut stepper) {
            Ok(report) => report,
            Err(e) => {
                drop.lost = Some(e);
                break;
            }
        };
        let gained = (stepper.energy().total() - start) / (2.0 * mass * GRAVITY * params.length);
        last.rotate_left(1);
        last[MEAN - 1] = gained;
        drop.gain = worse(drop.gain, last.iter().sum::<f64>() / MEAN as f64);
        drop.instant = worse(drop.instant, gained);
        drop.most = drop.most.max(report.solves);
        drop.unconverged += report.unconverged_substeps;
        drop.redone += usize::from(report.redone);
    }
    Ok(drop)
}

/// The checks of several drops of `time` seconds.
fn drops(name: &str, all: &[HoistParams], time: f64) -> Result<[Check; 3], ExperimentError> {
    let found: Vec<Drop> = (all.par_iter())
        .map(|params| dropped(params, time))
        .collect::<Result<_, _>>()?;
    let gain = found.iter().map(|d| d.gain).fold(0.0, worse);
    let instant = found.iter().map(|d| d.instant).fold(0.0, worse);
    let most = found.iter().map(|d| d.most).max().unwrap_or(0);
    let [redone, unconverged] = [|d: &Drop| d.redone, |d: &Drop| d.unconverged]
        .map(|of| found.iter().map(of).sum::<usize>());
    let gained = Check::off(
        format!("{name}: energy gained"),
        "none",
        gain,
        "",
        GAIN,
    )
    .by(format!(
        "largest mean of 0.25 s over 2MgL, {} drops of {time} s",
        all.len()
    ))
    .noting(format!(
        "{instant:.1e} at an instant; {redone} steps redone, {unconverged} sub-steps not converged"
    ));
    let case = format!("{name}: most linear systems of a step");
    let solves = Check::within(
        case,
        format!("{SOLVES} at most"),
        most.to_string(),
        most as f64,
        SOLVES as f64,
    );
    let lost: Vec<String> = found
        .iter()
        .filter_map(|d| Some(d.lost.as_ref()?.to_string()))
        .collect();
    let ended = Check::within(
        format!("{name}: lost"),
        "none",
        format!("{} of {}", lost.len(), all.len()),
        lost.len() as f64,
        0.0,
    );
    Ok([gained, solves, ended.noting(lost.join("; "))])
}

/// The load's place every 1/60 s.
fn path(params: &HoistParams, dt: f64) -> Result<Vec<Vector3<f64>>, ExperimentError> {
    let options = at(dt);
    let mut stepper = Stepper::new(params.build()?, options)?;
    let each = (DT / dt).round() as usize;
    let place = |_| -> Result<_, StepError> {
        for _ in 0..each {
            pace::step(&mut stepper)?;
        }
        Ok(load_position(stepper.scene()))
    };
    let places: Result<_, StepError> = (0..steps_in(SWING_TIME, DT)).map(place).collect();
    Ok(places?)
}

fn swing(params: &HoistParams) -> Result<[Check; 2], ExperimentError> {
    let off = |a: &[Vector3<f64>], b: &[Vector3<f64>]| farthest(a, b) / params.length;
    let fine = [path(params, FINE[0])?, path(params, FINE[1])?];
    let (error, known) = (off(&path(params, DT)?, &fine[1]), off(&fine[0], &fine[1]));
    let ratio = params.mass_ratio;
    let [bar, most] = SWING;
    let case = format!("swing after the snap, ratio {ratio:.0e}");
    let check = Check::off(case, "that of 1/1920 s", error, "L", bar)
        .by(format!("largest in {SWING_TIME} s"))
        .noting(format!("1/960 s is {known:.0e} L away"));
    let cause = "implicit sub-steps are of first order in the time that a snap takes";
    let cause = format!("{}: {cause}", check.note);
    let case = format!("fine steps, ratio {ratio:.0e}");
    let agree = Check::off(case, "1/960 s as 1/1920 s", known / error, "", FINE_BAR)
        .by("largest distance from each other over that of 1/60 s, which they judge");
    Ok([check.limited(error <= most, cause), agree])
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (segments, time): (&[usize], f64) = either(quick, (&[6], 5.0), (&[6, 9, 15, 24], 60.0));
    progress.set_length(3);
    let ratios = [1e3, 1e4, 1e5, 1e6];
    let mut grid = Vec::new();
    for &n in segments {
        for ratio in ratios {
            grid.extend([2.0, 2.3, 2.6, 3.0].map(|angle| hoist(n, ratio, angle, 7)));
        }
    }
    let mut checks = drops("6 to 24 segments", &grid, time)?.to_vec();
    progress.inc(1);
    if !quick {
        let mut random = Random::new(36);
        let all: Vec<_> = (1..=192).map(|seed| any(&mut random, seed)).collect();
        checks.extend(drops("4 to 32 segments, 1 to 100 m", &all, 30.0)?);
    }
    progress.inc(1);
    let swings: Vec<[Check; 2]> = (ratios[1..].par_iter())
        .map(|ratio| swing(&hoist(6, *ratio, 2.3, 7)))
        .collect::<Result<_, _>>()?;
    checks.extend(swings.into_iter().flatten());
    progress.inc(1);
    Ok(checks.into())
}
