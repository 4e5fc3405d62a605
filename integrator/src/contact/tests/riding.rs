//! Heavy bodies at rest on each other, on slopes and on platforms that turn.

use super::{G, add, block, ground, options, rough, tilt};
use crate::Stepper;
use crate::testing::{With, centre, on_earth, origin};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use taut_model::collide::Shape;
use taut_model::{Body, Control, Motor, RowLaw, Scene, Slider, Target, axes_along};

fn disc(length: f64, radius: f64, mass: f64) -> (Body, Shape) {
    let across = mass * (3.0 * radius * radius + length * length) / 12.0;
    let along = 0.5 * mass * radius * radius;
    let inertia = Matrix3::from_diagonal(&Vector3::new(across, across, along));
    (Body::new(mass, inertia), Shape::Cylinder { length, radius })
}

fn lying(length: f64, radius: f64, mass: f64) -> (Body, Shape) {
    let (body, _) = disc(length + radius, radius, mass);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    (body.turned(turn), Shape::Capsule { length, radius })
}

/// A carrier, and what lies on it at x.
fn pile(carrier: (Body, Shape), heights: [f64; 2], load: (Body, Shape), x: f64) -> Scene {
    let mut scene = ground(0.0, rough(0.5));
    let [below, above] = heights;
    let below_at = Vector3::z() * (0.5 * below);
    add(&mut scene, carrier.0.at(below_at), carrier.1, rough(0.5));
    let above_at = Vector3::new(x, 0.0, below + 0.5 * above);
    add(&mut scene, load.0.at(above_at), load.1, rough(0.5));
    scene
}

/// A disc that hardly tilts keeps its points of contact: without them it rocks in every step, friction is at its limit at all points,
/// and each solve takes hundreds of factorisations.
#[test]
fn stacks_come_to_rest_and_their_steps_are_cheap() {
    let size = Vector3::new(0.8, 0.7, 0.4);
    for mass in [1e3, 2e5, 8e5] {
        for x in [0.004, 0.07] {
            let piles = [
                pile(disc(0.3, 0.4, mass), [0.3, 0.4], block(size, mass), x),
                pile(disc(0.3, 0.4, 2e5), [0.3, 0.4], block(size, mass), x),
                pile(block(size, mass), [0.4, 0.4], lying(0.8, 0.2, mass), x),
                pile(disc(0.3, 0.4, mass), [0.3, 0.4], lying(0.8, 0.2, mass), x),
            ];
            for (n, scene) in piles.into_iter().enumerate() {
                let mut stepper = Stepper::new(scene, options(60.0)).expect("a sound scene");
                let (mut fallbacks, mut before) = (0, Vec::new());
                while stepper.time() < 4.0 {
                    let report = stepper.step().expect("a step");
                    if stepper.time() > 2.0 {
                        fallbacks += report.contacts.fallbacks;
                        if before.is_empty() {
                            before = stepper.scene().bodies.position.clone();
                        }
                    }
                }
                let places = &stepper.scene().bodies.position;
                let drifts = places.iter().zip(&before).map(|(a, b)| (a - b).norm());
                let drift = drifts.fold(0.0, f64::max);
                // 0.1 mm in a minute.
                assert!(drift < 3e-6, "{n}: {mass} {x}: {drift} m");
                assert_eq!(fallbacks, 0, "{n}: {mass} {x}");
            }
        }
    }
}

#[test]
fn boxes_and_discs_of_any_mass_rest_on_each_other_off_their_middles() {
    let heavy: [(&str, &[f64]); 5] = [
        ("db", &[1e3, 1e3]),
        ("db", &[1e5, 1e5]),
        ("db", &[1.0, 1e5]),
        ("bdb", &[3e4, 1.0, 3e4]),
        ("bdb", &[1e5, 1.0, 1e5]),
    ];
    for (kinds, masses) in heavy {
        for off in [0.003, 0.1] {
            let mut scene = ground(0.0, rough(0.5));
            let mut top = 0.0;
            for (k, (kind, mass)) in kinds.bytes().zip(masses).enumerate() {
                let (height, (body, shape)) = match kind {
                    b'd' => (0.3, disc(0.3, 0.4, *mass)),
                    _ => (0.4, block(Vector3::new(0.8, 0.7, 0.4), *mass)),
                };
                let x = if k % 2 == 1 { off } else { 0.0 };
                let at = Vector3::new(x, 0.0, top + 0.5 * height);
                add(&mut scene, body.at(at), shape, rough(0.5));
                top += height;
            }
            let (start, places) = (scene.potential_energy(), scene.bodies.position.clone());
            let mut stepper = Stepper::new(scene, options(60.0)).expect("a sound scene");
            while stepper.time() < 1.5 {
                stepper.step().expect("a step");
                let scene = stepper.scene();
                let gain = scene.kinetic_energy() + scene.potential_energy() - start;
                assert!(gain < 1e-6, "{kinds} {masses:?} {off}: {gain} J");
                for (now, place) in scene.bodies.position.iter().zip(&places) {
                    let drift = (now - place).xy().norm();
                    assert!(drift < 1e-4, "{kinds} {masses:?} {off}: {drift} m");
                }
            }
        }
    }
}

/// What rides on a lift that stops between two steps flies on by v²/2g.
#[test]
fn what_rides_on_a_lift_that_stops_flies_on() {
    for (speed, mass, substeps) in [(0.5, 80.0, 1), (1.0, 1e4, 1), (1.0, 80.0, 4), (3.0, 5.0, 1)] {
        let mut scene = on_earth("lift");
        let (body, shape) = block(Vector3::new(2.0, 2.0, 0.2), 500.0);
        let lift = add(&mut scene, body, shape, rough(0.5));
        let (body, shape) = block(Vector3::repeat(0.4), mass);
        let rider = add(&mut scene, body.at(Vector3::z() * 0.3), shape, rough(0.5));
        let along = axes_along(&Vector3::z()).expect("a direction");
        let frames = [origin(), centre(lift)];
        let slider = Slider::new(frames.map(|frame| frame.with_axes(along))).driven(Motor {
            target: Target::Speed(0.0),
            force_limit: 1e7,
            law: RowLaw::RIGID,
        });
        let rail = scene.add_constraint("rail", slider, 0);
        scene.controls.push(Control::of("up", rail, 2.0));
        let options = options(60.0).with(|o| o.substeps = substeps);
        let mut stepper = Stepper::new(scene, options).expect("a sound scene");
        let mut highest = 0.0_f64;
        for n in 0..60 {
            if n % 30 == 0 {
                let value = if n == 0 { 0.5 * speed } else { 0.0 };
                stepper.set_control(0, value).expect("a control");
            }
            stepper.step().expect("a step");
            let bodies = &stepper.scene().bodies;
            highest = highest.max(bodies.position[rider].z - bodies.position[lift].z - 0.3);
        }
        let rise = speed * speed / (2.0 * G);
        // The highest point lies between two steps.
        let most = G * 0.125 / 3600.0 + 1e-3 * rise;
        assert!(
            (highest - rise).abs() < most,
            "{speed} {mass}: {highest} m of {rise} m"
        );
    }
}

#[test]
fn a_ball_that_rolls_and_spins_goes_straight_on() {
    let radius = 0.2;
    let mut scene = ground(0.0, rough(0.5));
    let at = Vector3::z() * radius;
    let ball = Body::sphere(radius, 3.0).at(at);
    let i = add(&mut scene, ball, Shape::Sphere { radius }, rough(0.5));
    scene.bodies.velocity[i].x = 1.0;
    scene.bodies.angular_velocity[i] = Vector3::new(0.0, 5.0, 4.0);
    let mut stepper = Stepper::new(scene, options(60.0)).expect("a sound scene");
    stepper.until(5.0);
    let velocity = stepper.scene().bodies.velocity[i];
    assert!((velocity - Vector3::x()).norm() < 1e-6, "{velocity}");
}

#[test]
fn a_box_of_any_mass_holds_on_a_slope_in_steps_of_any_length() {
    let slope = 0.45_f64.atan();
    for (mass, most) in [(1e5, 1e-5), (1e6, 1e-4), (1e7, 1e-3), (1e8, 1e-2)] {
        let moved = [1, 10, 40].map(|substeps| {
            let mut scene = ground(slope, rough(0.5));
            let (body, shape) = block(Vector3::repeat(1.0), mass);
            let start = tilt(slope) * Vector3::z() * 0.5;
            let body = body.at(start).turned(tilt(slope));
            let i = add(&mut scene, body, shape, rough(0.5));
            let options = options(60.0).with(|o| o.substeps = substeps);
            let mut stepper = Stepper::new(scene, options).expect("a sound scene");
            stepper.until(1.0);
            let way = stepper.scene().bodies.position[i] - start;
            way.dot(&(tilt(slope) * Vector3::x()))
        });
        // It tilts on its compliance, in steps of any length alike.
        let apart = moved[1] - moved[0];
        let further = moved[2] - moved[0];
        assert!(apart.abs().max(further.abs()) < most, "{mass}: {moved:?}");
    }
}
