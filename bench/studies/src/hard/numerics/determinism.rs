//! H53: the same bits over runs and threads, and every solver close to the reference.
//!
//! A run depends on its scene and options alone: not on the run before it, on another stepper beside it, or on how many
//! threads the program has. A step is one thread's work, of every solver, so that threads can only matter by what
//! steppers would share. What it leaves is compared bit by bit. Solvers differ by rounding, which a motion that is
//! not chaotic keeps small: after a second all loads are within 10⁻¹⁰ of the cable's length of the reference's.

use crate::hard::{solvers, together};
use crate::scenes::reference_choice;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use rayon::prelude::*;
use taut_ground::choice::Choice;
use taut_ground::trajectory::load_position;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Network, NetworkParams, Scene};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

/// Distance of a load from the reference's after a second, over the cable's length.
pub const BAR: f64 = 1e-10;

/// Iterations of a solve in the runs whose bits are compared.
const SHORT: usize = 200;

const DT: f64 = 1.0 / 60.0;

/// Everything that a run leaves, as bits.
#[must_use]
pub fn bits(stepper: &Stepper) -> Vec<u64> {
    let bodies = &stepper.scene().bodies;
    let vectors = bodies.position.iter().chain(&bodies.velocity);
    let vectors = vectors.chain(&bodies.angular_velocity).flatten();
    let turns = bodies.orientation.iter().flat_map(|q| q.coords.iter());
    let all = vectors.chain(turns).chain(stepper.multipliers());
    all.map(|x| x.to_bits()).collect()
}

/// A swinging cable, and a net.
///
/// # Errors
/// Parameters out of range.
pub fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let params = HoistParams {
        segments: 10,
        mass_ratio: 50.0,
        move_x: 0.5,
        seed: 3,
        ..HoistParams::default()
    };
    let net = NetworkParams {
        rows: 4,
        columns: 5,
        seed: 2,
        ..NetworkParams::new(Network::Net)
    };
    let mut hoist = params.hanging_equilibrium()?;
    "cable".clone_into(&mut hoist.name);
    Ok(vec![hoist, net.build()?])
}

/// The bits of a run of `steps` steps, and where its load is.
fn run(
    scene: &Scene,
    options: &StepOptions,
    steps: usize,
) -> Result<(Vec<u64>, Vector3<f64>), StepError> {
    let mut stepper = Stepper::new(scene.clone(), options.clone())?;
    for _ in 0..steps {
        stepper.step()?;
    }
    Ok((bits(&stepper), load_position(stepper.scene())))
}

/// In how many of the ways to run it a scene leaves other bits than in the first, and how many there are.
///
/// # Errors
/// A step that fails.
pub fn differing(
    scene: &Scene,
    options: &StepOptions,
    steps: usize,
) -> Result<(usize, usize), StepError> {
    let again = || run(scene, options, steps).map(|r| r.0);
    let first = again()?;
    let mut others = vec![again()?];
    // Two at once.
    let (a, b) = rayon::join(again, again);
    others.extend([a?, b?]);
    for threads in [1, 2] {
        // Where no pool can be made the present one serves.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let run_all = || {
            (0..2)
                .into_par_iter()
                .map(|_| again())
                .collect::<Result<Vec<_>, _>>()
        };
        others.extend(pool.map_or_else(|_| run_all(), |pool| pool.install(run_all))?);
    }
    let differ = others.iter().filter(|bits| **bits != first).count();
    Ok((differ, others.len()))
}

/// The checks of H53.
///
/// # Errors
/// A scene that cannot be built, the reference's step that fails.
pub fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let steps = if quick { 10 } else { 60 };
    let mut checks = Vec::new();
    let choices = solvers();
    let scenes = scenes()?;
    progress.set_length((scenes.len() * choices.len()) as u64);
    for scene in &scenes {
        let start = Stepper::new(scene.clone(), reference_choice().options(DT))?.into_scene();
        let (_, reference) = run(&start, &reference_choice().options(DT), steps)?;
        let extent = start
            .bodies
            .position
            .iter()
            .map(Vector3::norm)
            .fold(0.0, f64::max);
        let (mut same, mut near) = (Vec::new(), Vec::new());
        for choice in &choices {
            // Unfinished solves are as much the same as finished ones.
            let short = Choice {
                backend: choice.backend.with_iterations(SHORT),
                form: choice.form,
            };
            let case = differing(&start, &short.options(DT), steps);
            same.push((choice.family(), bits_check(&case)));
            let options = patient(choice).options(DT);
            let place = run(&start, &options, steps).map(|r| (r.1 - reference).norm() / extent);
            near.push((choice.family(), near_check(place)));
            progress.inc(1);
        }
        checks.extend(together(&format!("{}: bits", scene.name), same));
        checks.extend(together(&format!("{}: load", scene.name), near));
    }
    Ok(Outcome {
        checks,
        ..Outcome::default()
    })
}

/// With a tolerance that is below what is asked for.
fn patient(choice: &Choice) -> Choice {
    Choice {
        backend: choice.backend.with_tolerance(1e-14),
        form: choice.form,
    }
}

fn bits_check(found: &Result<(usize, usize), StepError>) -> Check {
    match found {
        Ok((differ, runs)) => Check::within(
            "",
            "the same bits".to_owned(),
            format!("{differ} of {runs} runs differ"),
            *differ as f64,
            0.0,
        )
        .by("runs that leave other bits: again, two at once, in pools of 1 and 2 threads"),
        Err(e) => Check::claim(
            "",
            "the same bits",
            "failed".into(),
            Verdict::Fail,
            e.to_string(),
        ),
    }
}

fn near_check(found: Result<f64, StepError>) -> Check {
    match found {
        Ok(error) => Check::within(
            "",
            reference_choice().to_string(),
            format!("{error:.1e}"),
            error,
            BAR,
        )
        .by("distance of the loads at the end over the extent of the scene"),
        Err(e) => Check::claim(
            "",
            "within 1e-10",
            "failed".into(),
            Verdict::Fail,
            e.to_string(),
        ),
    }
}
