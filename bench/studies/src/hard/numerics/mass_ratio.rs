//! H40: a minute of swing at each mass ratio, from loads of one cable element to loads of 10¹⁰, beside the scheme's law.
//!
//! Conditions, sweeps and errors of the solvers over the same ladder are tests (`tests/agreement/chain.rs` and `linear.rs`),
//! and `taut study linear` tells the errors.

use crate::energy::pendulum;
use crate::hard::{counted, either, worse};
use crate::{law, linear};
use indicatif::ProgressBar;
use taut_ground::poses::{Pose, hoist};
use taut_ground::trajectory::{Sample, simulate};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Elements of the hoists.
const ELEMENTS: usize = 24;

/// Distance of the change of a swing's amplitude in a minute from its law, where the motion is that of a pendulum alone.
const SWING_BAR: f64 = 1e-5;

/// Largest gain of energy of a free swing in a minute, over the largest kinetic energy.
const GAIN_BAR: f64 = 1e-5;

/// Largest error of the amplitude that waves of the cable excuse.
const MOST_WAVES: f64 = 1e-2;

/// Seconds of the swing, and by how much the anchor moves in the first two \[s, m].
const SWING: f64 = 60.0;
const EARLY: f64 = 5.0;
const MOVE: f64 = 0.5;

/// The hoist of a ratio, of a material that bears it.
fn params(ratio: f64) -> Result<HoistParams, SceneError> {
    linear::Config::default().params(ELEMENTS, ratio)
}

/// Bent hoists over the ladder.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let of = |ratio: f64| {
        let mut scene = hoist(&params(ratio)?, Pose::Bent)?;
        scene.name = format!("R = {ratio:.0e}");
        Ok(scene)
    };
    [1.0, 1e3, 1e5, 1e8, 1e10].into_iter().map(of).collect()
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let exponents: Vec<i32> = (0..=10).step_by(either(quick, 5, 1)).collect();
    let checks = counted(progress, exponents).map(|k| swing(10_f64.powi(k)));
    let checks: Vec<[Check; 2]> = checks.collect::<Result<_, StepError>>()?;
    Ok(checks.concat().into())
}

/// The swing of a ratio for a minute: its amplitude keeps to the scheme's law, and no energy comes from anywhere.
fn swing(ratio: f64) -> Result<[Check; 2], StepError> {
    let params = HoistParams {
        seed: 1,
        move_x: MOVE,
        move_duration: 2.0,
        ..params(ratio)?
    };
    let options = StepOptions::default();
    let dt = options.dt;
    let length = params.length + params.exact_elongation();
    let rate = (params.gravity / length).sqrt();
    let damped = law::modulus(options.scheme, rate * dt).powf((SWING - EARLY) / dt) - 1.0;
    let periods = 2.0 * std::f64::consts::TAU / rate;
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let run = simulate(&mut stepper, SWING + periods + dt, params.length, |_| {});
    let x: Vec<f64> = run.samples.iter().map(|s| s.load.x - MOVE).collect();
    let at = |moment| pendulum(&x, dt, moment, rate);
    let case = format!("swing for {SWING} s, R = {ratio:.0e}");
    let gain = gain(&run.samples, periods);
    let energy = Check::off(format!("{case}: energy"), "no gain", gain, "", GAIN_BAR)
        .by("mean energy of two periods after 60 s less that after 5 s, over the largest kinetic energy");
    let (None, Some(early), Some(late)) = (&run.failure, at(EARLY), at(SWING)) else {
        let why = run
            .failure
            .map(|f| format!("{} at {:.2} s", f.reason, f.time));
        let lost = Check::stated(case, "stays whole", "lost", false);
        return Ok([lost.noting(why.unwrap_or_default()), energy]);
    };
    let (change, waves) = (
        late.amplitude / early.amplitude - 1.0,
        early.rest / early.amplitude,
    );
    let ours = format!("amplitude {change:+.1e}");
    let error = (change - damped).abs();
    let redone = run.samples.iter().filter(|s| s.redone).count();
    let note = format!("{redone} steps redone by the guard");
    let cause = format!(
        "{note}; waves of the cable are {waves:.0e} of the load's motion, and its amplitude has them in it; the energy is \
         judged below"
    );
    let check = Check::within(case, format!("{damped:+.1e}"), ours, error, SWING_BAR)
        .by("relative change of the amplitude from 5 s on, less what the scheme's law damps")
        .noting(note)
        .limited(error <= waves.min(MOST_WAVES), cause);
    Ok([check, energy])
}

/// Gain of energy of a free swing: difference of the means over two windows of `time` (s), over the
/// largest kinetic energy. NaN for a run that ended before.
fn gain(samples: &[Sample], time: f64) -> f64 {
    let window = |from: f64| {
        samples
            .iter()
            .filter(move |s| (from..from + time).contains(&s.time))
    };
    let mean = |from: f64| {
        let sum: f64 = window(from).map(|s| s.energy.total()).sum();
        sum / window(from).count() as f64
    };
    let kinetic = window(EARLY).map(|s| s.energy.kinetic).fold(0.0, worse);
    (mean(SWING) - mean(EARLY)) / kinetic
}
