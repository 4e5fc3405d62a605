//! H63: restitution for bodies of any mass, in steps of any length.
//!
//! A ball that falls by h arrives with √(2 g h), leaves with e of that and rises to e² h. Two balls that meet keep their
//! momentum and part with e times the speed at which they met. Neither knows of masses, of the surfaces' compliance or of
//! Δt.

use super::{GRAVITY, ground, put, rough, run};
use crate::hard::{at, either, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_integrator::StepError;
use taut_model::collide::{Shape, Surface};
use taut_model::{Body, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const RADIUS: f64 = 0.2;
const HEIGHT: f64 = 1.2;
const SPEED: f64 = 2.0;
const RESTITUTIONS: [f64; 4] = [0.0, 0.3, 0.8, 1.0];
const RATES: [f64; 3] = [60.0, 240.0, 960.0];
const MASSES: [f64; 5] = [1.0, 30.0, 3e3, 1e5, 1e6];
const PAIRS: [[f64; 2]; 4] = [[1.0, 1.0], [1e5, 1e5], [1e6, 1e3], [1.0, 1e6]];
/// Largest error of an apex over that of the reference; with e = 0 over the height of the fall.
const APEX: f64 = 1e-2;
/// Largest error of a speed over that of the approach, and of a momentum.
const BAR: f64 = 1e-5;
const EXACT: f64 = 1e-12;

fn ball(scene: &mut Scene, place: Vector3<f64>, mass: f64, restitution: f64) -> usize {
    let surface = Surface {
        restitution,
        ..rough(0.0)
    };
    let (name, shape) = (
        format!("ball-{}", place.x),
        Shape::Sphere { radius: RADIUS },
    );
    put(
        scene,
        &name,
        Body::sphere(RADIUS, mass).at(place),
        shape,
        surface,
    )
}

fn falling(mass: f64, restitution: f64) -> Scene {
    let mut scene = ground("bounce", 0.0, rough(0.0));
    ball(
        &mut scene,
        Vector3::z() * (RADIUS + HEIGHT),
        mass,
        restitution,
    );
    scene
}

fn meeting(masses: [f64; 2], restitution: f64) -> Scene {
    let mut scene = Scene::new("two balls");
    for (mass, x) in masses.into_iter().zip([0.0, 0.9]) {
        ball(&mut scene, Vector3::x() * x, mass, restitution);
    }
    scene.bodies.velocity[0].x = SPEED;
    scene
}

/// Highest place between the first bounce and the second \[m].
fn apex(mass: f64, e: f64, rate: f64) -> Result<f64, StepError> {
    let fall = (2.0 * HEIGHT / GRAVITY).sqrt();
    let steps = (fall * (1.0 + 1.2 * e.max(0.2)) * rate) as usize;
    let mut top = 0.0;
    run(falling(mass, e), at(1.0 / rate), steps, |stepper, _| {
        if stepper.time() > fall + 2.0 / rate {
            top = worse(top, stepper.scene().bodies.position[0].z - RADIUS);
        }
    })?;
    Ok(top)
}

/// Errors of the speed at which two balls part over that at which they meet, and of the momentum.
fn parted(masses: [f64; 2], e: f64, rate: f64) -> Result<[f64; 2], StepError> {
    let steps = (0.4 * rate) as usize;
    let (stepper, _) = run(meeting(masses, e), at(1.0 / rate), steps, |_, _| {})?;
    let scene = stepper.scene();
    let [a, b] = [0, 1].map(|i| scene.bodies.velocity[i].x);
    let momentum = scene.momentum().x / (masses[0] * SPEED);
    Ok([((b - a) / SPEED - e).abs(), (momentum - 1.0).abs()])
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![falling(1e5, 0.8), meeting([1e6, 1e3], 0.3)])
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let rates: &[f64] = either(quick, &[60.0, 960.0], &RATES);
    let mut checks = Vec::new();
    for e in RESTITUTIONS {
        let exact = e * e * HEIGHT;
        let (mut off, mut speed, mut momentum) = (0.0, 0.0, 0.0);
        for &rate in rates {
            for mass in MASSES {
                let error = (apex(mass, e, rate)? - exact).abs();
                off = worse(off, error / if e > 0.0 { exact } else { HEIGHT });
            }
            for masses in PAIRS {
                let found = parted(masses, e, rate)?;
                (speed, momentum) = (worse(speed, found[0]), worse(momentum, found[1]));
            }
        }
        let rates = format!("{rates:?} steps a second");
        let add = |what: &str, reference: &str, error, bar, of: String| {
            let case = format!("e = {e}: {what}");
            Check::off(case, reference, error, "", bar).by(format!("largest of {of}, {rates}"))
        };
        let (balls, pairs) = (format!("{MASSES:?} kg"), format!("{PAIRS:?} kg"));
        checks.push(add("apex of a ball", "e² h", off, APEX, balls));
        checks.push(add("two balls part", "e v", speed, BAR, pairs.clone()));
        checks.push(add("two balls: momentum", "kept", momentum, EXACT, pairs));
    }
    Ok(checks.into())
}
