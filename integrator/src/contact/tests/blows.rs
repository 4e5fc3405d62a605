//! The law of impact for bodies of any mass in steps of any length.

use super::{G, add, block, bouncing, capsule, cylinder, ground, options, rough};
use crate::testing::{With, centre, link, on_earth};
use crate::{Guard, Stepper};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use taut_model::collide::{Collider, Shape, Surface};
use taut_model::{Body, Frame, RowLaw, Scene, Spherical};

const MASSES: [f64; 4] = [1.0, 3e3, 1e5, 1e6];
const RATES: [f64; 3] = [60.0, 240.0, 3840.0];
const RADIUS: f64 = 0.2;

fn ball(scene: &mut Scene, at: Vector3<f64>, mass: f64, surface: Surface) -> usize {
    let shape = Shape::Sphere { radius: RADIUS };
    add(scene, Body::sphere(RADIUS, mass).at(at), shape, surface)
}

#[test]
fn a_ball_of_any_mass_comes_up_as_high_as_its_restitution_says() {
    let height = 0.9;
    for e in [0.0, 0.3, 0.8, 1.0] {
        for (mass, rate) in MASSES.into_iter().flat_map(|m| RATES.map(|r| (m, r))) {
            let mut scene = ground(0.0, bouncing(e, 0.0));
            let at = Vector3::z() * (RADIUS + height);
            let i = ball(&mut scene, at, mass, bouncing(e, 0.0));
            let mut stepper = Stepper::new(scene, options(rate)).expect("a sound scene");
            let fall = (2.0 * height / G).sqrt();
            let mut top = 0.0_f64;
            while stepper.time() < fall * (1.0 + 1.2 * e.max(0.2)) {
                stepper.step().expect("a step");
                if stepper.time() > fall + 2.0 / rate {
                    top = top.max(stepper.scene().bodies.position[i].z - RADIUS);
                }
            }
            let exact = e * e * height;
            assert!(
                (top - exact).abs() <= 0.01 * exact + 1e-6,
                "{e} {mass} {rate}: {top}, not {exact}"
            );
        }
    }
}

#[test]
fn pairs_of_any_masses_part_with_their_restitution() {
    for e in [0.0, 0.5, 1.0] {
        for masses in [[1.0, 1.0], [1e5, 1e5], [1e6, 1e3], [1.0, 1e6]] {
            for rate in RATES {
                let mut scene = Scene::new("pair");
                for (k, mass) in masses.into_iter().enumerate() {
                    let at = Vector3::x() * 0.9 * k as f64;
                    ball(&mut scene, at, mass, bouncing(e, 0.0));
                }
                scene.bodies.velocity[0].x = 2.0;
                let mut stepper = Stepper::new(scene, options(rate)).expect("a sound scene");
                stepper.until(0.4);
                let bodies = &stepper.scene().bodies;
                let parting = bodies.velocity[1].x - bodies.velocity[0].x;
                assert!(
                    (parting - 2.0 * e).abs() < 1e-5,
                    "{e} {masses:?} {rate}: {parting}"
                );
            }
        }
    }
}

/// A rod that is made in the step of a bounce stops the motion along it before the ground throws the ball back: no more
/// energy is left than that of the motion across the rod.
#[test]
fn a_rod_made_in_the_step_of_a_bounce_throws_nothing_up() {
    for e in [0.3, 0.8, 1.0] {
        for (mass, rate) in [(1.0, 60.0), (1e4, 240.0)] {
            for lean in [0.3_f64, 0.7, 1.2] {
                let mut scene = ground(0.0, bouncing(e, 0.0));
                scene.gravity.z = 0.0;
                let speed = Vector3::new(1.0, 0.0, -3.0);
                // One step is left for the rod after the first.
                let above = RADIUS - 1.5 * speed.z / rate;
                let i = ball(&mut scene, Vector3::z() * above, mass, bouncing(e, 0.0));
                scene.bodies.velocity[i] = speed;
                let mut stepper = Stepper::new(scene, options(rate)).expect("a sound scene");
                stepper.step().expect("a step");
                let along = Vector3::new(-lean.sin(), 0.0, lean.cos());
                let at = stepper.scene().bodies.position[i];
                let rod = link(
                    [Frame::world(at + 2.0 * along), centre(i)],
                    2.0,
                    RowLaw::RIGID,
                );
                stepper.tie("rod", rod);
                let across = speed - along * along.dot(&speed);
                for n in 0..4 {
                    stepper.step().expect("a step");
                    let left = stepper.scene().bodies.velocity[i].norm();
                    let most = 1.01 * across.norm();
                    assert!(
                        left <= most,
                        "{e} {mass} {lean}, step {n}: {left} of {most}"
                    );
                }
            }
        }
    }
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
    let (mut scene, ends) = before_wall(mass, 0.0);
    let rod = link(ends, 2.0, RowLaw::RIGID);
    scene.add_constraint("rod", rod, 0);
    scene
}

/// A ball pinned in its place against a wall with this friction.
fn pinned(mass: f64, friction: f64) -> Scene {
    let (mut scene, [top, ball]) = before_wall(mass, friction);
    let body = ball.body_index().expect("a body");
    let arm = top.resolve(&scene.bodies, 0.0).point() - scene.bodies.position[body];
    let pin = Spherical {
        frames: [top, Frame::body(body, arm)],
        stretch: RowLaw::RIGID,
    };
    scene.add_constraint("pin", pin, 0);
    scene
}

/// The ball and its wall, with the ends of what holds the ball.
fn before_wall(mass: f64, friction: f64) -> (Scene, [Frame; 2]) {
    let (length, angle) = (2.0, 0.5_f64);
    let surface = bouncing(1.0, friction);
    let mut scene = on_earth("pendulum");
    scene.add_collider(Collider {
        surface,
        orientation: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2),
        ..Collider::new("wall", None, Shape::HalfSpace)
    });
    let hangs = Vector3::new(angle.sin(), 0.0, -angle.cos()) * length;
    let i = ball(&mut scene, Vector3::x() * RADIUS + hangs, mass, surface);
    let ends = [Frame::world(Vector3::x() * RADIUS), centre(i)];
    (scene, ends)
}

/// Largest height after each hit, over that of the start.
fn heights(mut stepper: Stepper, hits: usize) -> Vec<f64> {
    let height = |stepper: &Stepper| stepper.scene().bodies.position[0].z + 2.0;
    let start = height(&stepper);
    let (mut tops, mut before) = (Vec::new(), 0.0);
    while stepper.time() < 20.0 {
        stepper.step().expect("a step");
        let speed = stepper.scene().bodies.velocity[0].x;
        if before < -0.1 && speed > 0.1 {
            if tops.len() == hits {
                break;
            }
            tops.push(0.0);
        }
        before = speed;
        let now = height(&stepper) / start;
        if let Some(top) = tops.last_mut() {
            *top = now.max(*top);
        }
    }
    tops
}

#[test]
fn a_pendulum_against_a_wall_keeps_its_energy() {
    for mass in [100.0, 1e5] {
        for rate in [60.0, 240.0, 960.0] {
            let stepper = Stepper::new(pendulum(mass), options(rate)).expect("a sound scene");
            let tops = heights(stepper, 6);
            assert_eq!(tops.len(), 6, "{mass} {rate}: {tops:?}");
            assert!((tops[5] - 1.0).abs() < 2e-3, "{mass} {rate}: {tops:?}");
        }
    }
}

/// The friction of a blow turns the ball, whose joint has a lever ten times as long as the ball is large.
#[test]
fn a_pinned_ball_stays_in_its_joint_through_blows_with_friction() {
    for (friction, rate, least) in [
        (0.0, 60.0, 0.99),
        (0.5, 60.0, 0.9),
        (0.5, 240.0, 0.97),
        (0.5, 960.0, 0.995),
    ] {
        let start = || Stepper::new(pinned(100.0, friction), options(rate)).expect("a sound scene");
        let (mut stepper, mut open) = (start(), 0.0_f64);
        while stepper.time() < 8.0 {
            stepper.step().expect("a step");
            let gaps = stepper.linearized().phi.iter().map(|gap| gap.abs());
            open = gaps.fold(open, f64::max);
        }
        assert!(open < 2.0 / (rate * rate), "{friction} {rate}: {open} m");
        let tops = heights(start(), 6);
        let kept = (least..1.01).contains(&tops[5]);
        assert!(kept, "{friction} {rate}: {tops:?}");
    }
}

/// A disc that slides on the ground under a rod that is nearer to the vertical than the angle of friction: no impulses of its
/// contacts part it from the ground.
#[test]
fn what_wedges_does_not_rebound() {
    let surface = bouncing(0.3, 0.5);
    let (length, radius) = (0.3, 0.4);
    for (turn, top) in [
        (0.316, [-0.38357, -0.265867, 1.244789]),
        (2.716, [-0.019478, -0.154492, 1.408181]),
        (2.814, [-0.215429, 0.010258, 1.177748]),
    ] {
        let mut scene = ground(0.0, surface);
        let body = Body {
            orientation: UnitQuaternion::from_scaled_axis(Vector3::new(-0.365, -0.454, turn)),
            angular_velocity: Vector3::new(1.06, 2.67, -0.313),
            ..Body::rod(length, radius, 100.0).at(Vector3::z() * 0.676)
        };
        let i = add(
            &mut scene,
            body,
            Shape::Cylinder { length, radius },
            surface,
        );
        let mut stepper = Stepper::new(scene, options(60.0)).expect("a sound scene");
        stepper.steps(30);
        let top = Vector3::from(top);
        let rod = link(
            [Frame::world(top), centre(i)],
            (top - stepper.scene().bodies.position[i]).norm(),
            RowLaw::RIGID,
        );
        stepper.tie("rod", rod);
        let energy = |stepper: &Stepper| {
            stepper.scene().kinetic_energy() + stepper.scene().potential_energy()
        };
        let start = energy(&stepper);
        for n in 0..40 {
            stepper.step().expect("a step");
            let now = energy(&stepper);
            assert!(now < start + 1.0, "{turn}, step {n}: {now} J of {start} J");
        }
    }
}

#[test]
fn implicit_steps_of_the_guard_know_restitution() {
    let all = Guard {
        tolerance: 1e-9,
        ..Guard::default()
    };
    let options = options(960.0).with(|o| o.guard = Some(all));
    let stepper = Stepper::new(pendulum(1e5), options).expect("a sound scene");
    let tops = heights(stepper, 6);
    assert_eq!(tops.len(), 6, "{tops:?}");
    // The method damps every motion in the first order of its step.
    assert!(tops[5] > 0.93 && tops[5] < 1.0, "{tops:?}");
}

#[test]
fn a_box_that_tumbles_gains_no_energy() {
    let size = Vector3::new(0.7, 0.4, 0.2);
    for (e, friction) in [(0.9, 0.0), (0.9, 0.4), (1.0, 0.0), (1.0, 0.4)] {
        for k in 0..6_u8 {
            let surface = bouncing(e, friction);
            let mut scene = ground(0.0, surface);
            let body = Body::cuboid(size, 10.0).at(Vector3::z() * 1.5);
            let i = add(&mut scene, body, Shape::Cuboid { size }, surface);
            let k = f64::from(k);
            let spin = [(3.0 * k).sin(), (1.7 * k + 0.3).cos(), (2.3 * k).sin()];
            scene.bodies.angular_velocity[i] = Vector3::from(spin) * 4.0;
            let start = scene.kinetic_energy() + scene.potential_energy();
            let mut stepper = Stepper::new(scene, options(240.0)).expect("a sound scene");
            while stepper.time() < 6.0 {
                stepper.step().expect("a step");
                let now = stepper.energy();
                let all = now.kinetic + now.gravity;
                assert!(
                    all < start * (1.0 + 1e-3),
                    "{e} {friction} {k}: {all} {start}"
                );
            }
        }
    }
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
