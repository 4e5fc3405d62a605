//! H27: a slack rope that snaps taut.
//!
//! ```text
//! W falls h into a rope          T = W (1 + √(1 + 2hEA/(WL)))
//! sudden speed v of an end       ΔT = v √(EA μ)                     until the wave comes back
//! pick-up at hoist speed v       F = M g (1 + (v/g) √(k/M))          of a load that stands
//! ```
//!
//! A load that stands hangs in a second, rigid rope, which goes slack where the first one lifts it.

use super::line::{Hold, Line};
use super::worse;
use crate::hard::{at, solvers, together};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_ground::pace;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Frame, MasslessCable, Mobility, RowLaw, Scene, Stiffness, Winch,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const SMALL: f64 = 1.0 / 6000.0;
const LARGE: f64 = 1.0 / 60.0;
/// Largest relative error at small steps that passes.
const BAR: f64 = 1e-2;
/// Largest overshoot of the peak at 1/60 s over the formula's, relative, and rise of the load above its start \[m].
const BOUND: f64 = 0.1;

/// The fall: weight \[N], height \[m], rope's length \[m] and EA \[N].
const WEIGHT: f64 = 1000.0;
const HEIGHT: f64 = 1.0;
const LENGTH: f64 = 10.0;
const EA: f64 = 1e5;

/// Peak tension of the fall \[N].
pub(super) fn fall_tension() -> f64 {
    WEIGHT * (1.0 + (1.0 + 2.0 * HEIGHT * EA / (WEIGHT * LENGTH)).sqrt())
}

fn falling() -> Scene {
    let mut scene = Scene::new("fall into a rope");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let place = Vector3::new(0.0, 0.0, HEIGHT - LENGTH);
    let load = scene.add_body("load", Body::particle(WEIGHT / GRAVITY).at(place));
    scene.load = Some(load);
    let frames = vec![
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    let rope = MasslessCable::new(frames, LENGTH, RowLaw::new(LENGTH / EA, 0.0));
    scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
    scene
}

/// The pick-up: mass \[kg], speed \[m/s], EA of the hoist's rope \[N], its slack \[m].
const LOAD: f64 = 1000.0;
const HOIST: f64 = 0.1;
const HOIST_EA: f64 = 1e7;
const SLACK: f64 = 0.01;

/// Peak force of the pick-up of a mass (kg) at a hoist speed (m/s) by a rope of the stiffness k (N/m) \[N].
pub(in crate::hard) fn pick_up_force(mass: f64, speed: f64, stiffness: f64) -> f64 {
    mass * GRAVITY * (1.0 + speed / GRAVITY * (stiffness / mass).sqrt())
}

fn standing() -> Scene {
    let mut scene = Scene::new("pick-up");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let load = scene.add_body("load", Body::particle(LOAD));
    scene.load = Some(load);
    let mut rope = |name: &str, above: f64, cable: fn(MasslessCable) -> MasslessCable, ea: f64| {
        let frames = vec![
            Frame::world(Vector3::z() * above),
            Frame::body(load, Vector3::zeros()),
        ];
        let slack = if ea.is_finite() { SLACK } else { 0.0 };
        let law = RowLaw::new(above / ea, 0.0);
        let made = cable(MasslessCable::new(frames, above + slack, law));
        scene.add_constraint(name, Constraint::MasslessCable(made), 0);
    };
    let wound = |cable| MasslessCable {
        winch: Some(Winch::new()),
        ..cable
    };
    rope("hoist", LENGTH, wound, HOIST_EA);
    rope("floor", 0.5 * LENGTH, |cable| cable, f64::INFINITY);
    scene.controls.push(super::hauling("hoist"));
    scene
}

/// The bar whose end is drawn: that of the waves, driven below.
const SEGMENTS: usize = 50;
const END_SPEED: f64 = 1.0;
const BAR_EA: f64 = 6e7;
const BAR_DENSITY: f64 = 2.5;

fn drawn() -> Scene {
    let l = LENGTH / SEGMENTS as f64;
    let mut end = Body::particle(1.0);
    end.mobility = Mobility::Driven;
    end.velocity.z = -END_SPEED;
    let line = Line {
        segments: SEGMENTS,
        length: LENGTH,
        rod: Body::rod(l, 0.01, BAR_DENSITY * l),
        stiffness: Stiffness {
            ea: BAR_EA,
            ei: 100.0,
            gj: 100.0,
        },
        bends: true,
        tension: 0.0,
        ends: [Hold::Clamped, Hold::Load],
        load: Some(end),
    };
    line.scene("drawn bar")
}

/// The scenes at their beginnings: falling, standing, drawn.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut hoisting = standing();
    hoisting.set_control(0, HOIST, 0.0);
    Ok(vec![falling(), hoisting, drawn()])
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    let hoisted = pick_up_force(LOAD, HOIST, HOIST_EA / LENGTH);
    let cases = [
        ("fall into a rope", falling(), fall_tension(), 1.0),
        ("pick-up", standing(), hoisted, 0.4),
    ];
    for (name, scene, exact, time) in cases {
        let (mut small, mut large) = (Vec::new(), Vec::new());
        for choice in solvers() {
            let fine = if quick { 4.0 * SMALL } else { SMALL };
            let found = peak(scene.clone(), choice.options(fine), time)?;
            small.push((
                choice.family(),
                Check::relative("", [exact, found.tension], "N", BAR).by("relative, peak"),
            ));
            let coarse = peak(scene.clone(), choice.options(LARGE), 6.0);
            large.push((choice.family(), bounded(exact, coarse)));
        }
        checks.extend(together(&format!("{name}, small steps"), small));
        checks.extend(together(&format!("{name}, 1/60 s for 6 s"), large));
    }
    checks.push(sudden_speed()?);
    Ok(checks.into())
}

/// Largest values of a motion.
struct Peak {
    /// Tension of the first rope \[N].
    tension: f64,
    /// Rise of the load above its start and what the hoist has hauled in \[m].
    rise: f64,
}

fn peak(scene: Scene, options: StepOptions, time: f64) -> Result<Peak, StepError> {
    let dt = options.dt;
    let start = scene.bodies.position[0].z;
    let mut stepper = Stepper::new(scene, options)?;
    if !stepper.scene().controls.is_empty() {
        stepper.set_control(0, HOIST)?;
    }
    let hoisted = if stepper.scene().controls.is_empty() {
        0.0
    } else {
        HOIST
    };
    let mut found = Peak {
        tension: 0.0,
        rise: f64::NEG_INFINITY,
    };
    for n in 1..=(time / dt) as usize {
        pace::step(&mut stepper)?;
        found.tension = worse(found.tension, -stepper.multipliers()[0] / dt);
        let z = stepper.scene().bodies.position[0].z;
        found.rise = worse(found.rise, z - start - hoisted * n as f64 * dt);
    }
    Ok(found)
}

/// At 60 steps a second: no more than the formula's peak, and the load not thrown above where it came from.
fn bounded(exact: f64, found: Result<Peak, StepError>) -> Check {
    let reference = format!("peak {exact:.3} N at most, not thrown higher");
    let by = "overshoot of the peak, relative, or metres above the start";
    match found {
        Ok(Peak { tension, rise }) => {
            let error = worse((tension / exact - 1.0).max(0.0), rise.max(0.0));
            // A NaN of either is one.
            let error = if (tension + rise).is_nan() {
                f64::NAN
            } else {
                error
            };
            let ours = format!("{tension:.3} N, {rise:+.4} m");
            Check::within("", reference, ours, error, BOUND).by(by)
        }
        Err(e) => Check::within("", reference, "lost", f64::NAN, BOUND).noting(e.to_string()),
    }
}

/// The mean tension at the drawn end while the wave is away.
fn sudden_speed() -> Result<Check, ExperimentError> {
    let speed = (BAR_EA / BAR_DENSITY).sqrt();
    let exact = END_SPEED * (BAR_EA * BAR_DENSITY).sqrt();
    let dt = 0.05 * LENGTH / SEGMENTS as f64 / speed;
    let options = at(dt);
    let mut stepper = Stepper::new(drawn(), options)?;
    let (mut sum, mut count) = (0.0, 0.0);
    let transit = LENGTH / speed;
    let row = 6 * SEGMENTS + 2;
    while stepper.time() < 1.8 * transit {
        pace::step(&mut stepper)?;
        if stepper.time() > 0.2 * transit {
            sum += (stepper.multipliers()[row] / dt).abs();
            count += 1.0;
        }
    }
    let found: f64 = sum / count;
    Ok(Check::relative(
        format!("end drawn at {END_SPEED} m/s: tension before the wave is back"),
        [exact, found],
        "N",
        BAR,
    )
    .by("relative to v √(EA μ), mean from 0.2 to 1.8 transits"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tension_of_a_fall_as_printed() {
        assert!((fall_tension() - 5582.576).abs() < 5e-4);
        // A load that is laid on, and one hoisted at no speed.
        assert!(pick_up_force(LOAD, HOIST, HOIST_EA / LENGTH) > LOAD * GRAVITY);
    }
}
