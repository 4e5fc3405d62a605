//! H40: a minute of swing at each mass ratio, from loads of one cable element to loads of 10¹⁰, beside the scheme's law.
//!
//! Conditions, sweeps and errors of the solvers over the same ladder are tests (`tests/agreement/chain.rs` and `linear.rs`),
//! and `taut study linear` tells the errors.

use crate::energy::pendulum;
use crate::hard::{counted, either, worse};
use crate::{law, linear};
use indicatif::ProgressBar;
use std::fmt::Write;
use taut_ground::poses::{Pose, hoist};
use taut_ground::trajectory::{Sample, simulate};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

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
    let swings = counted(progress, exponents).map(|k| swing(10_f64.powi(k)));
    let checks = swings.map(|s| s.map(|s| [s.check(), s.energy()]));
    let checks: Vec<[Check; 2]> = checks.collect::<Result<_, StepError>>()?;
    Ok(checks.concat().into())
}

/// A minute of the default step.
#[derive(Debug, Clone, PartialEq)]
struct Swing {
    ratio: f64,
    /// Amplitude after [`EARLY`] and at the end \[m]; none of a run that was lost.
    early_m: Option<f64>,
    late_m: Option<f64>,
    /// Rest of the early motion at other frequencies than the pendulum's \[m].
    rest_m: Option<f64>,
    /// Change of the amplitude in between as the scheme's law has it, relative.
    damped: f64,
    /// Mean energy at the end less that after [`EARLY`], over the largest kinetic energy.
    gain: f64,
    /// Steps that the guard redid.
    redone: usize,
    failure: Option<String>,
}

/// The swing of a ratio.
fn swing(ratio: f64) -> Result<Swing, StepError> {
    let params = HoistParams {
        seed: 1,
        move_x: MOVE,
        move_duration: 2.0,
        ..params(ratio)?
    };
    let options = StepOptions::default();
    let (dt, scheme) = (options.dt, options.scheme);
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let length = params.length + params.exact_elongation();
    let rate = (params.gravity / length).sqrt();
    let kept = law::modulus(scheme, rate * dt);
    let periods = 2.0 * std::f64::consts::TAU / rate;
    let run = simulate(&mut stepper, SWING + periods + dt, params.length, |_| {});
    let x: Vec<f64> = run.samples.iter().map(|s| s.load.x - MOVE).collect();
    let at = |moment| pendulum(&x, dt, moment, rate);
    Ok(Swing {
        ratio,
        early_m: at(EARLY).map(|p| p.amplitude),
        late_m: at(SWING).map(|p| p.amplitude),
        rest_m: at(EARLY).map(|p| p.rest),
        damped: kept.powf((SWING - EARLY) / dt) - 1.0,
        gain: gain(&run.samples, periods),
        redone: run.samples.iter().filter(|s| s.redone).count(),
        failure: run
            .failure
            .map(|f| format!("{} at {:.2} s", f.reason, f.time)),
    })
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

impl Swing {
    /// No energy comes from anywhere.
    fn energy(&self) -> Check {
        let case = format!("swing for {SWING} s, R = {:.0e}: energy", self.ratio);
        Check::off(case, "no gain", self.gain, "", GAIN_BAR)
            .by("mean energy of two periods after 60 s less that after 5 s, over the largest kinetic energy")
    }

    /// Its amplitude keeps to the scheme's law.
    fn check(&self) -> Check {
        let case = format!("swing for {SWING} s, R = {:.0e}", self.ratio);
        let reference = "stays whole";
        match (&self.failure, self.early_m, self.late_m, self.rest_m) {
            (None, Some(early), Some(late), Some(rest)) => {
                let change = late / early - 1.0;
                let waves = rest / early;
                let ours = format!("amplitude {change:+.1e}");
                let reference = format!("{:+.1e}", self.damped);
                let error = (change - self.damped).abs();
                let mut check = Check::within(case, reference, ours, error, SWING_BAR)
                    .by("relative change of the amplitude from 5 s on, less what the scheme's law damps");
                check.note = format!("{} steps redone by the guard", self.redone);
                if check.verdict == Verdict::Fail && error <= waves.min(MOST_WAVES) {
                    check.verdict = Verdict::Limit;
                    let _ = write!(
                        check.note,
                        "; waves of the cable are {waves:.0e} of the load's motion, and its amplitude has them in it; the \
                         energy is judged below"
                    );
                }
                check
            }
            (failure, ..) => {
                let why = failure.clone().unwrap_or_default();
                Check::claim(case, reference, "lost", Verdict::Fail, why)
            }
        }
    }
}
