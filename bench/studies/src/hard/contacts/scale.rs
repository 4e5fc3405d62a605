//! A chain that falls on a scale, which reads three times the weight that lies on it.
//!
//! A chain of the mass λ per length hangs with its lower end on the scale and is let go. After a fall x its weight λ g
//! x lies there, and λ ẋ of mass a second arrives with ẋ = √(2 g x) and stops:
//!
//! ```text
//! F = λ g x + λ ẋ² = 3 λ g x
//! ```
//!
//! Here it is point masses on links that pull and do not push, since what lies does not hold what falls. Each mass
//! stops in one step, so that the reading is a row of blows; its mean is the impulse over ∫ λ g x dt = λ g² t³/6.

use super::{GRAVITY, borne, ground, put, rough, run};
use crate::hard::{at, either};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_model::collide::Shape;
use taut_model::{Body, Constraint, Frame, MasslessCable, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const LENGTH: f64 = 3.0;
const MASS: f64 = 3.0;
const RADIUS: f64 = 1e-3;

fn chain(masses: usize) -> Scene {
    let mut scene = ground("chain on a scale", 0.0, rough(0.5));
    let link = LENGTH / masses as f64;
    for i in 0..masses {
        // Each mass stands for the link about it.
        let height = RADIUS + (i as f64 + 0.5) * link;
        let body = Body::particle(MASS / masses as f64).at(Vector3::z() * height);
        let shape = Shape::Sphere { radius: RADIUS };
        put(
            &mut scene,
            &format!("mass-{}", i + 1),
            body,
            shape,
            rough(0.5),
        );
        // Masses that lie on the scale do not collide with each other.
        let last = scene.colliders.len() - 1;
        (scene.colliders[last].groups, scene.colliders[last].meets) = (2, 1);
    }
    for i in 1..masses {
        let frames = [i - 1, i].map(|body| Frame::body(body, Vector3::zeros()));
        let cable = MasslessCable::new(frames.to_vec(), link, RowLaw::RIGID);
        scene.add_constraint(format!("link-{i}"), Constraint::MasslessCable(cable), 0);
    }
    scene
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let masses = either(quick, 30, 100);
    let whole = (2.0 * LENGTH / GRAVITY).sqrt();
    let dt = 1e-3;
    let steps = (1.2 * whole / dt) as usize;
    let [from, to] = [0.3, 0.95].map(|part| part * whole);
    let (mut impulse, mut times, mut rest) = (0.0, [f64::NAN; 2], 0.0);
    let (_, said) = run(chain(masses), at(dt), steps, |stepper, _| {
        let force = borne(stepper).z;
        // The step's force belongs to its time.
        let time = stepper.time();
        if time > from && time <= to {
            impulse += force * dt;
            times = [times[0].min(time - dt), time];
        }
        rest = force;
    })?;
    let weight = MASS / LENGTH * GRAVITY * GRAVITY / 6.0;
    let fallen = weight * (times[1].powi(3) - times[0].powi(3));
    let case = format!("{masses} masses: mean reading over the fallen weight");
    let check = Check::relative(case, [3.0, impulse / fallen], "", 0.05);
    let lying = Check::relative("reading after the fall", [MASS * GRAVITY, rest], "N", 1e-8);
    let note = format!("{} undecided, {} redone steps", said.undecided, said.redone);
    Ok(vec![check.noting(note), lying].into())
}
