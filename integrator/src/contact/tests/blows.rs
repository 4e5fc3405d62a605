//! Blows beside rods that are made, in implicit steps, and of what tumbles.

use super::{add, block, bouncing, capsule, cylinder, ground, options, rough};
use crate::testing::{With, centre, link, on_earth};
use crate::{Guard, Stepper};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use taut_model::collide::{Collider, Shape, Surface};
use taut_model::{Body, Frame, RowLaw, Scene};

const RADIUS: f64 = 0.2;

fn ball(scene: &mut Scene, at: Vector3<f64>, mass: f64, surface: Surface) -> usize {
    let shape = Shape::Sphere { radius: RADIUS };
    add(scene, Body::sphere(RADIUS, mass).at(at), shape, surface)
}

/// A ball that sinks into the ground under its weight, faster than gravity's speed in a step, is hung on a rod that stands across
/// its way: the ground, whose force was forgotten in a changed scene, threw it out at 0.5 m/s, and the rod made 4 m/s of that.
#[test]
fn what_presses_on_the_ground_goes_on_as_a_rod_is_made() {
    for (rate, mass) in [(240.0, 1e6), (960.0, 1e6), (3840.0, 1e5)] {
        let mut scene = ground(0.0, rough(0.5));
        let i = ball(&mut scene, Vector3::z() * RADIUS, mass, rough(0.5));
        scene.bodies.velocity[i] = Vector3::new(0.5, 0.0, -0.03);
        let mut stepper = Stepper::new(scene, options(rate)).expect("a sound scene");
        while stepper.scene().bodies.velocity[i].z < -0.02 || stepper.time() < 5.0 / rate {
            stepper.step().expect("a step");
        }
        let before = stepper.scene().bodies.velocity[i].norm();
        let at = stepper.scene().bodies.position[i];
        let rod = link(
            [Frame::world(at + Vector3::new(0.1, 0.0, 1.0)), centre(i)],
            1.01_f64.sqrt(),
            RowLaw::RIGID,
        );
        stepper.tie("rod", rod);
        for _ in 0..4 {
            stepper.step().expect("a step");
            let now = stepper.scene().bodies.velocity[i].norm();
            assert!(
                now < 1.05 * before,
                "{rate}, {mass} kg: {now} after {before} m/s"
            );
        }
    }
}

/// A ball on a rod of 2 m that falls against a wall below its end, from 0.5 rad.
fn pendulum(mass: f64) -> Scene {
    let (length, angle) = (2.0, 0.5_f64);
    let surface = bouncing(1.0, 0.0);
    let mut scene = on_earth("pendulum");
    scene.add_collider(Collider {
        surface,
        orientation: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2),
        ..Collider::new("wall", None, Shape::HalfSpace)
    });
    let hangs = Vector3::new(angle.sin(), 0.0, -angle.cos()) * length;
    let i = ball(&mut scene, Vector3::x() * RADIUS + hangs, mass, surface);
    let ends = [Frame::world(Vector3::x() * RADIUS), centre(i)];
    scene.add_constraint("rod", link(ends, length, RowLaw::RIGID), 0);
    scene
}

/// The height after the sixth hit, over that of the start.
#[test]
fn implicit_steps_of_the_guard_know_restitution() {
    let all = Guard {
        tolerance: 1e-9,
        ..Guard::default()
    };
    let options = options(960.0).with(|o| o.guard = Some(all));
    let mut stepper = Stepper::new(pendulum(1e5), options).expect("a sound scene");
    let height = |stepper: &Stepper| stepper.scene().bodies.position[0].z + 2.0;
    let start = height(&stepper);
    let (mut hits, mut before, mut top) = (0, 0.0, 0.0_f64);
    while hits < 7 && stepper.time() < 20.0 {
        stepper.step().expect("a step");
        let speed = stepper.scene().bodies.velocity[0].x;
        hits += usize::from(before < -0.1 && speed > 0.1);
        before = speed;
        if hits == 6 {
            top = top.max(height(&stepper) / start);
        }
    }
    // The method damps every motion in the first order of its step.
    assert!(top > 0.93 && top < 1.0, "{hits} hits: {top}");
}

fn tumbling() -> [(Body, Shape); 5] {
    [
        block(Vector3::new(0.6, 0.3, 0.25), 7.0),
        block(Vector3::new(0.5, 0.5, 0.08), 7.0),
        cylinder(0.12, 0.3, 7.0),
        cylinder(0.7, 0.08, 7.0),
        capsule(0.6, [0.5, 0.12], 7.0),
    ]
}

/// Energy at the end of a step in free flight: velocities stand half a step before it.
fn in_flight(scene: &Scene, dt: f64) -> f64 {
    let mut now = scene.clone();
    now.bodies.velocity[0] += scene.gravity * (0.5 * dt);
    now.kinetic_energy() + now.potential_energy()
}

/// From flight to flight, over however many steps with contacts. The free rotation of a body without an axis of symmetry keeps
/// its energy within a band of some thousandths of that of its spin; blows add nothing.
#[test]
fn no_tumbling_body_gains_energy_in_a_bounce() {
    for (n, (body, shape)) in tumbling().into_iter().enumerate() {
        for (e, friction) in [(0.5, 1.0), (0.9, 0.4), (1.0, 0.0), (1.0, 0.7)] {
            for (rate, k) in [60.0, 240.0]
                .into_iter()
                .flat_map(|r| (0..8_u8).map(move |k| (r, k)))
            {
                let surface = bouncing(e, friction);
                let mut scene = ground(0.0, surface);
                let i = add(&mut scene, body.at(Vector3::z() * 1.3), shape, surface);
                let k = f64::from(k);
                let turn = UnitQuaternion::from_euler_angles(0.9 * k, 1.4 * k, 0.1);
                scene.bodies.orientation[i] = turn;
                let spin = Vector3::new((2.0 * k).sin(), (1.3 * k).cos(), (2.9 * k).sin());
                scene.bodies.angular_velocity[i] = spin * 6.0;
                let dt = 1.0 / rate;
                let (mut last, fall) = (in_flight(&scene, 0.0), scene.gravity * dt);
                let mut stepper = Stepper::new(scene, options(rate)).expect("a sound scene");
                stepper.step().expect("a step");
                while stepper.time() < 2.5 {
                    let before = stepper.scene().bodies.velocity[i];
                    stepper.step().expect("a step");
                    let scene = stepper.scene();
                    if (scene.bodies.velocity[i] - before - fall).norm() > 1e-9 {
                        continue;
                    }
                    let now = in_flight(scene, dt);
                    let most = last * (1.0 + 1e-3) + 1e-3;
                    assert!(
                        now < most,
                        "{n} {e} {friction} {rate} {k}: {last} J, then {now} J"
                    );
                    last = now;
                }
            }
        }
    }
}

/// Whatever tumbles, rolls or slides: the power of each contact's friction with the slip that it tells is not positive, and a
/// contact at its limit has friction against the slip.
#[test]
fn friction_is_against_the_slip_that_contacts_tell() {
    for (n, (body, shape)) in tumbling().into_iter().enumerate() {
        let (friction, spin) = (0.3, Vector3::new(3.0, -2.0, 5.0));
        let mut scene = ground(0.0, rough(friction));
        let i = add(
            &mut scene,
            body.at(Vector3::z() * 0.5),
            shape,
            rough(friction),
        );
        scene.bodies.angular_velocity[i] = spin;
        scene.bodies.velocity[i] = Vector3::new(1.5, 0.4, 0.0);
        let mut stepper = Stepper::new(scene, options(60.0)).expect("a sound scene");
        let mut slides = 0;
        while stepper.time() < 2.0 {
            let report = stepper.step().expect("a step");
            let (rate, force) = (
                report.contacts.residual_gap * 60.0,
                report.contacts.residual_force,
            );
            for contact in stepper.contacts() {
                let normal = contact.force.dot(&contact.normal);
                let across = contact.force - contact.normal * normal;
                let (size, slip) = (across.norm(), contact.slip.norm());
                let power = across.dot(&contact.slip);
                let allowed = size * (rate + 1e-13) + slip * (force + 1e-13 * normal.abs());
                assert!(power <= allowed, "{n}: {power} W, allowed {allowed} W");
                if size > 1.0 && slip > 1e-3 {
                    slides += 1;
                    assert!(power < -size * slip * (1.0 - 1e-6), "{n}: {power} W");
                }
            }
        }
        assert!(slides > 5, "{n}: {slides}");
    }
}
