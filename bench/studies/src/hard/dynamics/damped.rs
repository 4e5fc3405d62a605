//! H61: a slack rope with a damper catches a load where it is taut.
//!
//! With k = 1/ε, ω² = k/m and ζ = ωτ/2 the load stretches its rope by x from the speed v on, which it has at x = 0:
//!
//! ```text
//! m ẍ = m g − T,  T = max(0, k x + k τ ẋ) for x > 0, else 0;    x(0) = 0, ẋ(0) = v = √(2 g · slack)
//! ```
//!
//! Stretch and tension go about their values at rest as u = x − g/ω² and u = T/m − g, with
//!
//! ```text
//! ü + 2ζω u̇ + ω² u = 0:    u = e^(−ζωt) (u₀ C + (u̇₀ + ζω u₀) S)
//! C, S = cos w t, sin w t/w for ζ < 1;   1, t for ζ = 1;   cosh w t, sinh w t/w for ζ > 1
//! x − g/ω²: u₀ = −g/ω², u̇₀ = v;    T/m − g: u₀ = 2ζω v − g, u̇₀ = ω² v − 2ζω u₀
//! ```
//!
//! and w² = ω² |1 − ζ²|. The largest is where u̇ = 0, S/C = u̇₀/(ω² u₀ + ζω u̇₀), or at the beginning where u̇₀ < 0: there the
//! tension begins with its largest value, k τ v. A rigid rope has x = 0.
//!
//! A step knows when it is caught to Δt, and so the load's place to a part of v Δt.

use super::worse;
use crate::hard::at;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_ground::pace;
use taut_integrator::{StepError, Stepper};
use taut_model::{Body, Constraint, Frame, MasslessCable, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const MASS: f64 = 100.0;
const SLACKS: [f64; 2] = [14.0, 0.3];
const COMPLIANCES: [f64; 3] = [0.0, 1e-6, 1e-4];
const DAMPINGS: [f64; 5] = [0.0, 0.02, 0.05, 0.5, 5.0];
/// Steps a second: those of the bar, and those that tell what smaller steps make of it.
const FINE: f64 = 960.0;
const FINER: f64 = 3840.0;
/// For so long the load is followed from the catch on \[s].
const TIME: f64 = 0.3;
/// Largest relative error at [`FINE`] steps.
const BAR: f64 = 1e-3;
/// Largest error of the lowest place over v Δt, at any steps.
const ORDER: f64 = 0.25;
/// Why peaks are off.
const SOFT: &str = "softer ropes are caught at first order";
const JUMP: &str = "the tension begins with a jump to k τ v, of which a step has the mean";

fn falling(law: RowLaw, slack: f64) -> Scene {
    let mut scene = Scene::new("fall into a damped rope");
    scene.gravity.z = -GRAVITY;
    let load = scene.add_body("load", Body::sphere(0.2, MASS));
    scene.load = Some(load);
    let frames = vec![
        Frame::world(Vector3::z()),
        Frame::body(load, Vector3::zeros()),
    ];
    let rope = MasslessCable::new(frames, 1.0 + slack, law);
    scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
    scene
}

/// Largest u of the oscillator within [`TIME`].
fn largest([omega, zeta]: [f64; 2], [u, rate]: [f64; 2]) -> f64 {
    let (a, square) = (zeta * omega, omega * omega * (1.0 - zeta * zeta));
    let (w, other) = (square.abs().sqrt(), omega * omega * u + a * rate);
    let turn = match square {
        _ if rate <= 0.0 => 0.0,
        0.0 => rate / other,
        x if x > 0.0 => (w * rate).atan2(other) / w,
        _ => (w * rate / other).atanh() / w,
    };
    // Where it only rises there is no turn, or one in the past.
    let t = if turn >= 0.0 { turn.min(TIME) } else { TIME };
    let decay = (-a * t).exp();
    // e^(−at) times C and S, the larger root without a difference.
    let [c, s] = match square {
        0.0 => [decay, decay * t],
        x if x > 0.0 => [decay * (w * t).cos(), decay * (w * t).sin() / w],
        _ => {
            let slow = (-omega * omega / (a + w) * t).exp();
            let fast = (-(a + w) * t).exp();
            [0.5 * (slow + fast), 0.5 * (slow - fast) / w]
        }
    };
    u * c + (rate + a * u) * s
}

#[derive(Debug, Clone, Copy, Default)]
struct Catch {
    /// Way between taut and where the tension begins \[m].
    early: f64,
    /// Largest stretch \[m], largest tension \[N].
    stretch: f64,
    tension: f64,
}

fn exact(law: RowLaw, slack: f64) -> Catch {
    let square = 1.0 / (law.compliance * MASS);
    if square.is_infinite() {
        return Catch::default();
    }
    let (omega, speed) = (square.sqrt(), (2.0 * GRAVITY * slack).sqrt());
    let mode = [omega, 0.5 * omega * law.damping];
    let pull = square * law.damping * speed - GRAVITY;
    let rate = square * (speed - law.damping * pull);
    let rest = GRAVITY / square;
    Catch {
        early: 0.0,
        stretch: rest + largest(mode, [-rest, speed]),
        tension: MASS * (GRAVITY + largest(mode, [pull, rate])),
    }
}

fn caught(law: RowLaw, slack: f64, rate: f64) -> Result<Catch, StepError> {
    let mut stepper = Stepper::new(falling(law, slack), at(1.0 / rate))?;
    let end = (2.0 * slack / GRAVITY).sqrt() + TIME;
    let (mut found, mut before) = (Catch::default(), -slack);
    while stepper.time() < end {
        pace::step(&mut stepper)?;
        let x = -stepper.scene().bodies.position[0].z - slack;
        let tension = stepper.tension(0).unwrap_or(f64::NAN);
        if found.tension == 0.0 && tension != 0.0 {
            // Taut lies between the ends of this step.
            found.early = worse(before.max(0.0), -x);
        }
        found.stretch = worse(found.stretch, x);
        found.tension = worse(found.tension, tension);
        before = x;
    }
    Ok(found)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let laws = [RowLaw::new(0.0, 0.02), RowLaw::new(1e-6, 0.5)];
    Ok(laws.map(|law| falling(law, 0.05)).to_vec())
}

/// One quantity of a catch for every damping, the worst of which counts.
fn all(case: String, of: &str, bar: f64, errors: [f64; 5]) -> Check {
    let worst = errors.into_iter().fold(0.0, worse);
    let check = Check::off(case, "closed form", worst, "", bar);
    check.by(format!("{of}, largest of τ = {DAMPINGS:?} s"))
}

/// Where it is caught, and how far it goes.
fn places(slack: f64, compliance: f64) -> Result<Vec<Check>, StepError> {
    let speed = (2.0 * GRAVITY * slack).sqrt();
    let (mut taut, mut lowest, mut first) = ([0.0; 5], [0.0; 5], [0.0; 5]);
    for (k, damping) in DAMPINGS.into_iter().enumerate() {
        let law = RowLaw::new(compliance, damping);
        let exact = exact(law, slack);
        for rate in [60.0, 240.0, FINE] {
            let found = caught(law, slack, rate)?;
            let off = (found.stretch - exact.stretch).abs();
            first[k] = worse(first[k], off * rate / speed);
            taut[k] = found.early / slack;
            lowest[k] = off / (slack + exact.stretch);
        }
    }
    let case = match compliance {
        0.0 => format!("{slack} m of slack, rigid"),
        _ => format!("{slack} m of slack, {compliance:e} m/N"),
    };
    Ok(vec![
        all(
            format!("{case}, 1/{FINE} s: catch"),
            "over the slack",
            BAR,
            taut,
        ),
        all(
            format!("{case}, 1/{FINE} s: lowest place"),
            "over the fall",
            BAR,
            lowest,
        ),
        all(
            format!("{case}, 1/60 … 1/{FINE} s: lowest place"),
            "over v Δt",
            ORDER,
            first,
        ),
    ])
}

/// The largest tension.
fn peak(slack: f64, compliance: f64, damping: f64) -> Result<Check, StepError> {
    let law = RowLaw::new(compliance, damping);
    let exact = exact(law, slack).tension;
    let [ours, finer] = [FINE, FINER].map(|rate| caught(law, slack, rate));
    let (ours, finer) = (ours?.tension, finer?.tension);
    let case = format!("{slack} m of slack, {compliance:e} m/N, τ = {damping} s, 1/{FINE} s: peak");
    let check = Check::relative(case, [exact, ours], "N", BAR);
    let better = (finer - exact).abs() < (ours - exact).abs();
    let jumps = damping * damping > compliance * MASS;
    let cause = if jumps { JUMP } else { SOFT };
    let off = finer / exact - 1.0;
    Ok(check.limited(better, format!("{cause}; at 1/{FINER} s {off:.1e}")))
}

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for slack in SLACKS {
        for compliance in COMPLIANCES {
            checks.extend(places(slack, compliance)?);
        }
    }
    for compliance in COMPLIANCES.into_iter().filter(|c| *c > 0.0) {
        for damping in DAMPINGS {
            checks.push(peak(SLACKS[0], compliance, damping)?);
        }
    }
    Ok(checks.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_has_the_known_ends() {
        let (slack, compliance) = (14.0, 1e-6);
        let peak = |damping| exact(RowLaw::new(compliance, damping), slack);
        // The fall into a rope, and the jump to k τ v.
        let weight = MASS * GRAVITY;
        let undamped = weight * (1.0 + (1.0 + 2.0 * slack / (compliance * weight)).sqrt());
        assert!((peak(0.0).tension / undamped - 1.0).abs() < 1e-12);
        let jump = 0.05 / compliance * (2.0 * GRAVITY * slack).sqrt();
        assert!((peak(0.05).tension / jump - 1.0).abs() < 1e-12);
        // ζ = 1 at 0.02 s lies between its neighbours.
        let [below, critical, above] = [0.0199, 0.02, 0.0201].map(|damping| peak(damping).stretch);
        assert!(above < critical && critical < below);
        assert!((0.5 * (below + above) / critical - 1.0).abs() < 1e-4);
    }
}
