//! H49: ten million steps of a swinging cable: two days of it.
//!
//! A few segments under a heavy load, the anchor moved aside at the beginning, nothing that damps but the step itself: the
//! rows carry the load at φ̄, so that its swing of the phase Ω = ω Δt a step is damped as an elastic mode of that frequency
//! is (`law`), by 1 − |z|² ≈ |γ| Ω⁴ of its energy. At the end of every decade of steps a window of some swings is looked
//! at: the energy's band and its mean, and the cable's length, the sum of all joints' gaps; means are weighed by (1 −
//! cos)³, so that it does not matter at which phase of the swing a window begins: of an oscillation with n periods in the
//! window n⁻⁷ is left. A step that lets constraints drift shows it as a length that grows with the number of steps. A swing
//! lengthens the cable in proportion to its energy E, by the mean of its tension, E/(2 L EA) of the length, and by what a
//! step of finite length leaves of a rotation, about ½ E Δt²/(m L²); how much, a second cable that swings a little less
//! tells. What a change of the length has beyond that of the energy is drift.

use crate::hard::file::frequency;
use crate::hard::worse;
use crate::law;
use indicatif::ProgressBar;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::pace;
use taut_measure::trajectory::{gaps, load_position};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_output::table::{error, of_records};

/// Steps of a window: six swings.
pub const WINDOW: usize = 2400;

/// Segments and mass ratio.
const SEGMENTS: usize = 3;
const RATIO: f64 = 100.0;

/// Gain of energy that is allowed, over the swing's energy.
const GAIN: f64 = 1e-6;

/// Change of the length that is allowed after so many steps, over the length: what rounding leaves if every step rounds
/// it the same way. A step that lets constraints drift by more shows.
fn growth_bar(steps: usize) -> f64 {
    0.5 * f64::EPSILON * steps as f64
}

fn params() -> HoistParams {
    HoistParams {
        segments: SEGMENTS,
        mass_ratio: RATIO,
        move_x: 0.5,
        move_duration: 2.0,
        ..HoistParams::default()
    }
}

pub(super) fn scene() -> Result<Scene, SceneError> {
    params().hanging_equilibrium()
}

/// A window at the end of a decade. Energies are over the largest kinetic energy of the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Steps made at its end.
    pub steps: usize,
    /// Largest minus smallest energy.
    pub band: f64,
    /// Mean energy less that of the first window.
    pub drift: f64,
    /// `drift` by the law of the scheme, for an elastic mode with the swing's frequency.
    pub predicted: f64,
    /// Mean elongation \[m].
    pub elongation_m: f64,
    /// Mean elongation less that of the first window, over the cable's length.
    pub growth: f64,
    /// Part of `growth` that the change of energy does not explain.
    pub drift_of_length: f64,
    /// Largest kinetic energy, over that of the first.
    pub swing: f64,
}

/// A swing of the cable whose anchor has been moved by `move_x` (m) and has stopped.
fn swinging(move_x: f64) -> Result<Stepper, StepError> {
    let params = HoistParams { move_x, ..params() };
    let options = StepOptions::default();
    let dt = options.dt;
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    for _ in 0..=taut_measure::trajectory::steps_in(params.move_duration, dt) {
        pace::step(&mut stepper)?;
    }
    Ok(stepper)
}

/// Statistics of some swings.
struct Swings {
    /// Smallest, largest and mean energy \[J].
    energy: [f64; 3],
    /// Largest kinetic energy \[J].
    kinetic: f64,
    /// Mean elongation \[m].
    elongation: f64,
    /// Phase by which the swing advances in a step \[rad].
    phase: f64,
}

/// The next [`WINDOW`] steps.
fn swings(stepper: &mut Stepper) -> Result<Swings, StepError> {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut sum, mut gap, mut kinetic, mut weights) = (0.0, 0.0, 0.0_f64, 0.0);
    let mut aside = Vec::with_capacity(WINDOW);
    let anchor = stepper.scene().bodies.position[0].x;
    for n in 0..WINDOW {
        pace::step(stepper)?;
        let energy = stepper.energy();
        let total = energy.total();
        (least, most) = (-worse(-least, -total), worse(most, total));
        let phase = (n as f64 + 0.5) / WINDOW as f64;
        let weight = (1.0 - (std::f64::consts::TAU * phase).cos()).powi(3);
        sum += weight * total;
        gap += weight * gaps(stepper).sum::<f64>();
        kinetic = kinetic.max(energy.kinetic);
        weights += weight;
        aside.push(load_position(stepper.scene()).x - anchor);
    }
    let passages = frequency::passages(&aside, true, f64::INFINITY);
    let whole = passages.len().saturating_sub(1);
    let between = passages
        .last()
        .zip(passages.first())
        .map_or(f64::NAN, |(b, a)| b - a);
    Ok(Swings {
        energy: [least, most, sum / weights],
        kinetic,
        elongation: gap / weights,
        phase: std::f64::consts::TAU * whole as f64 / between,
    })
}

/// The windows of a run of `steps` steps.
///
/// # Errors
/// A step that fails.
pub fn run(steps: usize, progress: &ProgressBar) -> Result<Vec<Window>, StepError> {
    let length = params().length;
    let mut stepper = swinging(params().move_x)?;
    let ends = std::iter::successors(Some(WINDOW), |end| Some(end * 10));
    let mut ends: Vec<usize> = ends.take_while(|end| *end < steps).collect();
    ends.push(steps);
    let mut made = 0;
    let mut windows: Vec<Window> = Vec::new();
    let mut first: Option<(Swings, f64)> = None;
    for end in ends {
        while made + WINDOW < end {
            pace::step(&mut stepper)?;
            made += 1;
        }
        let now = swings(&mut stepper)?;
        made += WINDOW;
        let [least, most, mean] = now.energy;
        let (band, kinetic, elongation) = (most - least, now.kinetic, now.elongation);
        if first.is_none() {
            let less = swings(&mut swinging(LESS * params().move_x)?)?;
            let slope = (less.elongation - elongation) / (less.energy[2] - mean);
            first = Some((now, slope));
        }
        let Some((start, slope)) = &first else {
            continue;
        };
        let change = mean - start.energy[2];
        let growth = elongation - start.elongation;
        windows.push(Window {
            steps: made,
            band: band / start.kinetic,
            drift: change / start.kinetic,
            predicted: law::modulus(stepper.options().scheme, start.phase)
                .powf(2.0 * (made - WINDOW) as f64)
                - 1.0,
            elongation_m: elongation,
            growth: growth / length,
            drift_of_length: (growth - slope * change) / length,
            swing: kinetic / start.kinetic,
        });
        progress.inc(1);
    }
    Ok(windows)
}

/// The second cable's swing beside the first one's.
const LESS: f64 = 0.95;

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let steps = if quick { 100_000 } else { 10_000_000 };
    let windows = run(steps, progress)?;
    let t = of_records(
        &windows,
        &[
            ("steps", &|w| w.steps.to_string()),
            ("energy band", &|w| error(Some(w.band))),
            ("drift", &|w| format!("{:+.3e}", w.drift)),
            ("predicted", &|w| format!("{:+.3e}", w.predicted)),
            ("largest kinetic", &|w| format!("{:.6}", w.swing)),
            ("elongation m", &|w| format!("{:.9e}", w.elongation_m)),
            ("growth", &|w| format!("{:+.1e}", w.growth)),
            ("unaccounted", &|w| format!("{:+.1e}", w.drift_of_length)),
        ],
    );
    // The first window is what the others are compared with.
    let largest = |of: fn(&Window) -> f64| {
        let others = windows.iter().skip(1).map(of);
        others.fold(f64::NEG_INFINITY, worse)
    };
    let end = windows.last().map(|w| (w.drift, w.predicted));
    let (last, predicted) = end.unwrap_or((f64::NAN, f64::NAN));
    let wider = largest(|w| w.band) / windows.first().map_or(f64::NAN, |w| w.band) - 1.0;
    let case = |what: &str| format!("{steps} steps: {what}");
    let off = |what, reference, error, bar| Check::off(case(what), reference, error, "", bar);
    let checks = vec![
        off("gain of energy", "no gain", largest(|w| w.drift), GAIN)
            .by("largest mean of a window less that of the first, over the swing's energy")
            .with_note(format!(
                "{:+.1e} a step: what the step damps of the swing",
                last / steps as f64
            )),
        Check::within(
            case("drift of the energy"),
            format!("{predicted:+.3e}"),
            format!("{last:+.3e}"),
            largest(|w| (w.drift / w.predicted - 1.0).abs()),
            LAW_BAR,
        )
        .by(
            "mean of a window less that of the first, over the swing's energy: relative to what the scheme's law makes \
             of the swing's frequency, the largest of all windows; shown: the last",
        ),
        off(
            "drift of the length",
            "no drift",
            largest(|w| w.drift_of_length.abs()),
            growth_bar(steps),
        )
        .by(
            "mean elongation of a window less that of the first and less what the energy accounts for, the largest \
             magnitude, over the cable's length; the bar: each step rounds it once, always the same way",
        ),
        off("energy band", "no wider", wider, BAND)
            .by("largest band of a window over that of the first, less 1"),
    ];
    Ok(Outcome {
        checks,
        text: format!(
            "Windows of {WINDOW} steps at the end of each decade of steps, \
             {SEGMENTS} segments, load of {RATIO} of\nthem, Δt = 1/60 s; energies \
             over the swing's\n{t}\n"
        ),
        ..Outcome::default()
    })
}

/// How near the energy's drift is to the law of small swings, relative: this one is of 0.05 rad, and has harmonics.
const LAW_BAR: f64 = 0.01;

/// By how much the band may widen.
const BAND: f64 = 0.05;
