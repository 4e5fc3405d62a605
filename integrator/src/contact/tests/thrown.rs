//! Loads that are thrown back by the ground while what holds them slips: a drum, or a rope over a sheave.

use super::{G, add, bouncing, ground, options};
use crate::Stepper;
use crate::testing::{brake, centre, over, reeled, sheave};
use nalgebra::Vector3;
use std::f64::consts::PI;
use taut_model::collide::Shape;
use taut_model::{Body, Frame, RowLaw, Scene};

const RADIUS: f64 = 0.25;
const HEIGHT: f64 = 4.0;
const SHEAVE: f64 = 0.2;

/// A ball `drop` above the ground, and its frame.
fn ball(mass: f64, drop: f64, restitution: f64) -> (Scene, Frame) {
    let surface = bouncing(restitution, 0.5);
    let mut scene = ground(0.0, surface);
    let shape = Shape::Sphere { radius: RADIUS };
    let body = Body::sphere(RADIUS, mass).at(Vector3::z() * (RADIUS + drop));
    let load = add(&mut scene, body, shape, surface);
    (scene, centre(load))
}

/// The ball hangs from a drum that holds a part of its weight.
fn on_drum(mass: f64, drop: f64, e: f64, part: f64, strain: f64) -> Scene {
    let (mut scene, load) = ball(mass, drop, e);
    let frames = vec![Frame::world(Vector3::z() * HEIGHT), load];
    let length = HEIGHT - RADIUS - drop;
    let law = RowLaw::new(strain * length / (mass * G), 0.0);
    let cable = reeled(brake(part * mass * G), frames, length, law);
    scene.reeve("rope", &cable, 0).expect("a sound rope");
    scene
}

/// The ball pulls its rope over a sheave against a counterweight, which is `part` of it less the friction.
fn over_sheave(mass: f64, drop: f64, e: f64, part: f64, friction: f64) -> Scene {
    let (mut scene, load) = ball(mass, drop, e);
    let counter = mass * part / (friction * PI).exp();
    let low = Vector3::new(-2.0 * SHEAVE, 0.0, 1.0);
    let counter = scene.add_body("counter", Body::particle(counter).at(low));
    let frames = vec![
        centre(counter),
        Frame::world(Vector3::new(-SHEAVE, 0.0, HEIGHT)).along(&Vector3::y()),
        load,
    ];
    let sheave = sheave(friction, SHEAVE);
    let length = 2.0 * HEIGHT - 1.0 - RADIUS - drop + PI * SHEAVE;
    let law = RowLaw::new(1e-4 * length / (mass * G), 0.0);
    let cable = over(sheave, frames, length, law);
    scene.reeve("rope", &cable, 0).expect("a sound rope");
    scene
}

/// The apex after the first blow to 3 %, and what lies between two steps, of a ball that falls with this acceleration; no energy
/// from nowhere.
fn check(what: &str, scene: Scene, rate: f64, acceleration: f64, drop: f64, e: f64) {
    let mut stepper = Stepper::new(scene, options(rate)).expect("a sound scene");
    let speed = (2.0 * acceleration * drop).sqrt();
    let fall = speed / acceleration;
    let mut top = 0.0_f64;
    while stepper.time() < fall + 1.2 * e * speed / G {
        let report = stepper.step().expect("a step");
        let excess = report.balance.map_or(0.0, |b| b.excess);
        assert!(excess < 0.02, "{what}: {excess} from nowhere");
        if stepper.time() > fall + 0.5 * e * speed / G {
            top = top.max(stepper.scene().bodies.position[0].z - RADIUS);
        }
    }
    let exact = e * e * acceleration / G * drop;
    let allowed = 0.03 * exact + 0.125 * G / (rate * rate);
    assert!(
        (top - exact).abs() < allowed,
        "{what}: {top} m for {exact} m"
    );
}

#[test]
fn a_drum_that_slips_brakes_its_load_until_it_is_thrown_back() {
    for (mass, rate) in [(1.0, 60.0), (50.0, 90.0), (1e5, 60.0), (3e3, 240.0)] {
        for (e, part) in [(1.0, 0.5), (1.0, 0.3), (0.6, 0.5), (0.8, 0.7)] {
            for (drop, strain) in [(0.2, 1e-4), (0.31, 1e-5), (0.45, 3e-4)] {
                let scene = on_drum(mass, drop, e, part, strain);
                let what = format!("{mass} kg, {rate}/s, e = {e}, {part}, {drop} m, {strain}");
                check(&what, scene, rate, (1.0 - part) * G, drop, e);
            }
        }
    }
}

#[test]
fn a_rope_that_slips_over_a_sheave_brakes_its_load_until_it_is_thrown_back() {
    for (mass, rate) in [(1.0, 60.0), (80.0, 90.0), (1e5, 60.0), (3e3, 240.0)] {
        for (e, part) in [(1.0, 0.5), (1.0, 0.25), (0.7, 0.5)] {
            for (drop, friction) in [(0.2, 0.1), (0.31, 0.3), (0.45, 0.02)] {
                let scene = over_sheave(mass, drop, e, part, friction);
                let acceleration = (1.0 - part) / (1.0 + part) * G;
                let what = format!("{mass} kg, {rate}/s, e = {e}, {part}, {drop} m, {friction}");
                check(&what, scene, rate, acceleration, drop, e);
            }
        }
    }
}
