//! H64: cargo on a platform that turns.
//!
//! Cargo at the radius r on a platform that turns with Ω needs Ω² r ≤ μ g of friction and stays where it stands. A step
//! that gives it the velocity of its place at the beginning moves it along the tangent, and so outwards by (Ω Δt)² r/2, or
//! Ω² r Δt/2 a second: 100 mm in a minute at 0.1 rad/s and 20 m.

use super::{DT, GRAVITY, put, put_box, rough, run};
use crate::hard::{at, either, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_integrator::StepError;
use taut_model::collide::Shape;
use taut_model::{Body, Mobility, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Ω \[rad/s], r \[m], mass of the cargo \[kg], part of the friction that it needs.
const RIDES: [[f64; 4]; 5] = [
    [0.1, 20.0, 12.0, 0.04],
    [0.1, 20.0, 1e5, 0.04],
    [0.5, 4.0, 700.0, 0.2],
    [1.86, 0.8, 12.0, 0.97],
    [0.35, 20.0, 1e4, 0.97],
];
/// Largest drift in a minute \[m].
const BAR: f64 = 1e-4;

fn platform([spin, radius, mass, part]: [f64; 4]) -> Scene {
    let surface = rough(spin * spin * radius / (part * GRAVITY));
    let mut scene = Scene::new("platform");
    scene.gravity.z = -GRAVITY;
    let shape = Shape::Cylinder {
        length: 0.2,
        radius: radius + 2.0,
    };
    let mut body = Body::sphere(1.0, 1.0);
    body.mobility = Mobility::Driven;
    body.angular_velocity.z = spin;
    put(&mut scene, "platform", body, shape, surface);
    let at = Vector3::new(radius, 0.0, 0.2);
    let shape = [Vector3::new(0.4, 0.4, 0.2), at];
    let turn = UnitQuaternion::identity();
    let cargo = put_box(&mut scene, shape, turn, mass, surface);
    scene.bodies.velocity[cargo].y = spin * radius;
    scene.bodies.angular_velocity[cargo].z = spin;
    scene
}

/// Farthest from its place on the platform \[m].
fn drift(ride: [f64; 4], time: f64) -> Result<f64, StepError> {
    let scene = platform(ride);
    let start = scene.bodies.position[1];
    let mut farthest = 0.0;
    let steps = (time / DT).round() as usize;
    run(scene, at(DT), steps, |stepper, _| {
        let bodies = &stepper.scene().bodies;
        let place = bodies.orientation[0].inverse() * bodies.position[1];
        farthest = worse(farthest, (place - start).xy().norm());
    })?;
    Ok(farthest)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![platform(RIDES[3])])
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let time = either(quick, 6.0, 60.0);
    let rides = RIDES.map(|ride| {
        let [spin, radius, mass, part] = ride;
        let case = format!("{spin} rad/s, {radius} m, {mass:e} kg, {part} of the friction: drift");
        let tangent = 0.5e3 * spin * spin * radius * DT * 60.0;
        let off = drift(ride, time)? * 60.0 / time;
        let check = Check::off(case, "stays", off, "m", BAR).by(format!("a minute, from {time} s"));
        Ok(check.noting(format!("along the tangent {tangent:.0} mm")))
    });
    let checks: Result<Vec<Check>, ExperimentError> = rides.into_iter().collect();
    Ok(checks?.into())
}
