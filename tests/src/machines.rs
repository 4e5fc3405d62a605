//! Random scenes of what moves and is moved: hinges and sliders with motors, massless cables with winches, static and
//! driven bodies, rows at their bounds and within.

use crate::prelude::*;
use crate::scenes::{JOINTS, KINDS, anchor_motion, joint};

/// Length of a rod \[m].
const ROD: f64 = 0.5;

/// How many of [`KINDS`] are joints; the others are cables.
const TURNING: usize = KINDS.len() - 2;

/// Numbers of the bodies that are not dynamic.
const HOLDERS: [usize; 2] = [0, 1];

/// A tree of rods on a static and a driven body, with joints and motors of all kinds, and massless cables across it,
/// taut and slack, from the world and from the holders, over sheaves and with winches. The control `drive` has a
/// drive for each motor of a speed and each winch.
pub fn random_machine(seed: u64) -> Scene {
    let mut random = Random::new(500 + seed);
    let mut scene = Scene::new("random machine");
    scene.gravity = random.vector(10.0);
    let mut ends = add_holders(&mut scene, &mut random);
    let rods = 3 + random.below(5);
    for i in 0..rods {
        let parent = random.below(scene.bodies.len());
        let start = ends[parent];
        let turn = random.rotation(0.5);
        let half = turn * Vector3::new(0.0, 0.0, -0.5 * ROD);
        let mut rod = Body::rod(ROD, 0.05, random.log_uniform(0.5, 50.0))
            .at(start + half + random.vector(1e-3))
            .turned(turn);
        rod.velocity = random.vector(0.3);
        rod.angular_velocity = random.vector(0.3);
        rod.force = random.vector(1.0);
        rod.torque = random.vector(0.1);
        let bodies = &scene.bodies;
        let offset = bodies.orientation[parent].inverse() * (start - bodies.position[parent]);
        let body = scene.add_body(format!("rod-{i}"), rod);
        ends.push(start + 2.0 * half);
        // Every third has a joint of a cable, the others turn or slide.
        let kind = match random.below(3) {
            0 => JOINTS[random.below(JOINTS.len())],
            _ => KINDS[JOINTS.len() + random.below(TURNING - JOINTS.len())],
        };
        let upper = Frame::body(parent, offset);
        let lower = Frame::body(body, Vector3::new(0.0, 0.0, 0.5 * ROD));
        let stretch = random.log_uniform(1e-8, 1e-4);
        let angular = random.log_uniform(1e-4, 1.0);
        let mut constraint = joint(kind, [upper, lower], stretch, angular, 0.01);
        if let Some(motor) = constraint.motor_mut() {
            motor.force_limit = random.log_uniform(0.1, 100.0);
        }
        scene.add_constraint(format!("joint-{i}"), constraint, (i % 3) as u32);
    }
    for i in 0..2 + random.below(3) {
        let cable = random_cable(&scene, &mut random);
        scene.add_constraint(format!("cable-{i}"), Constraint::MasslessCable(cable), 3);
    }
    drive_all(&mut scene);
    scene.load = Some(scene.bodies.len() - 1);
    scene
}

/// The static and the driven body, and where their first rods start.
fn add_holders(scene: &mut Scene, random: &mut Random) -> Vec<Vector3<f64>> {
    let crane = Body::fixed().at(random.vector(0.2));
    let mut carrier = Body::sphere(0.2, 3.0).at(Vector3::x() * 1.5 + random.vector(0.2));
    carrier.mobility = Mobility::Driven;
    carrier.velocity = random.vector(0.3);
    carrier.angular_velocity = random.vector(0.3);
    // Without effect on what is driven.
    carrier.force = random.vector(100.0);
    let names = ["crane", "carrier"].into_iter();
    let holders = names.zip([crane, carrier]).map(|(name, body)| {
        let body = body.turned(random.rotation(0.5));
        scene.add_body(name, body);
        body.position + random.vector(0.2)
    });
    holders.collect()
}

/// A cable from the world or a holder over up to two rods to another rod.
fn random_cable(scene: &Scene, random: &mut Random) -> MasslessCable {
    let rod = |random: &mut Random| {
        let rods = scene.bodies.len() - HOLDERS.len();
        Frame::body(HOLDERS.len() + random.below(rods), random.vector(0.2))
    };
    let first = match random.below(3) {
        0 => Frame::world(random.vector(1.0)).moving(anchor_motion()),
        k => Frame::body(HOLDERS[k - 1], random.vector(0.2)),
    };
    let mut frames = vec![first];
    for _ in 0..1 + random.below(3) {
        frames.push(rod(random));
    }
    let points = frames.iter().map(|f| f.resolve(&scene.bodies, 0.0).point());
    let points: Vec<_> = points.collect();
    let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    // Taut, about to be, slack.
    let length = total * [0.9999, 1.0005, 1.05][random.below(3)];
    let tension_only = random.below(3) > 0;
    let force_limit = match random.below(3) {
        0 => f64::INFINITY,
        _ => random.log_uniform(1.0, 300.0),
    };
    let winch = Winch::new()
        .with(|w| (w.speed, w.force_limit) = (random.vector(0.2).x, force_limit))
        .with(|w| (w.brake, w.brake_limit) = (random.below(4) == 0, 2.0 * force_limit))
        .with(|w| w.shortest = 0.01);
    MasslessCable {
        tension_only,
        winch: (random.below(2) == 0).then_some(winch),
        ..MasslessCable::new(
            frames,
            length,
            RowLaw::new(random.log_uniform(1e-7, 1e-4), 0.01),
        )
    }
}

/// One control for all that follows a speed.
fn drive_all(scene: &mut Scene) {
    let follows = |c: &Constraint| match c {
        Constraint::MasslessCable(cable) => cable.winch.is_some(),
        other => other
            .motor()
            .is_some_and(|m| matches!(m.target, taut_model::Target::Speed(_))),
    };
    let constraints = scene.constraints.iter().enumerate();
    let drives = constraints.filter(|(_, c)| follows(c)).map(|(i, _)| Drive {
        constraint: i,
        gain: if i % 2 == 0 { 1.0 } else { -0.5 },
    });
    scene.controls = vec![Control {
        name: "drive".into(),
        drives: drives.collect(),
    }];
}

/// Lifts the limits of motors and winches and lets cables push: no row reaches a bound.
pub fn unbounded(mut scene: Scene) -> Scene {
    for constraint in &mut scene.constraints {
        if let Some(motor) = constraint.motor_mut() {
            motor.force_limit = f64::INFINITY;
        }
        if let Constraint::MasslessCable(cable) = constraint {
            cable.tension_only = false;
            if let Some(winch) = &mut cable.winch {
                (winch.force_limit, winch.brake_limit) = (f64::INFINITY, f64::INFINITY);
            }
        }
    }
    scene
}

/// A chain of one to three boxes held by `cables` massless cables that cannot push, some with a winch of limited force,
/// and on it `motors` fly-wheels and pistons with motors of limited force: as many rows with bounds.
pub fn held_group(seed: u64, cables: usize, motors: usize) -> Scene {
    let mut random = Random::new(900 + seed);
    let mut scene = Scene::new("held group");
    scene.gravity = random.vector(10.0);
    let boxes = 1 + random.below(3);
    for i in 0..boxes {
        let size = Vector3::new(0.3, 0.4, 0.5);
        let mut body = Body::cuboid(size, random.log_uniform(1.0, 20.0))
            .at(Vector3::x() * (0.4 * i as f64))
            .turned(random.rotation(0.1));
        body.velocity = random.vector(0.5);
        body.angular_velocity = random.vector(0.5);
        scene.add_body(format!("box-{i}"), body);
        if i > 0 {
            let at = |body, x| Frame::body(body, Vector3::x() * x);
            let kind = ["lock", "hinge", "spherical"][random.below(3)];
            let rigid = joint(kind, [at(i - 1, 0.2), at(i, -0.2)], 1e-7, 1e-4, 0.02);
            scene.add_constraint(format!("joint-{i}"), rigid, 0);
        }
    }
    for i in 0..cables {
        let body = random.below(boxes);
        let frames = [
            Frame::world(random.vector(1.0).normalize() * 2.0),
            Frame::body(body, random.vector(0.2)),
        ];
        let [a, b] = frames.map(|f| f.resolve(&scene.bodies, 0.0).point());
        let length = (a - b).norm() * (1.0 + random.vector(0.01).x);
        let winch = Winch {
            speed: random.vector(0.3).x,
            force_limit: random.log_uniform(5.0, 200.0),
            ..Winch::new()
        };
        let law = RowLaw::new(random.log_uniform(1e-6, 1e-3), 0.01);
        let cable = MasslessCable::new(frames.into(), length, law)
            .with(|p| p.winch = (random.below(2) == 0).then_some(winch));
        scene.add_constraint(format!("cable-{i}"), Constraint::MasslessCable(cable), 0);
    }
    for i in 0..motors {
        let kinds = [
            "hinge-speed",
            "hinge-position",
            "slider-speed",
            "slider-position",
        ];
        let kind = kinds[random.below(kinds.len())];
        let holder = random.below(boxes);
        let point = random.vector(0.2);
        let position = scene.bodies.point_world(holder, &point);
        let wheel = Body::sphere(0.1, random.log_uniform(0.5, 5.0)).at(position);
        let wheel = wheel.turned(scene.bodies.orientation[holder]);
        let wheel = scene.add_body(format!("wheel-{i}"), wheel);
        let frames = [Frame::body(holder, point), centre(wheel)];
        let mut constraint = joint(kind, frames, 1e-5, 1e-3, 0.02);
        if let Some(motor) = constraint.motor_mut() {
            *motor = Motor {
                force_limit: random.log_uniform(0.01, 20.0),
                ..*motor
            };
        }
        scene.add_constraint(format!("motor-{i}"), constraint, 0);
    }
    scene
}
