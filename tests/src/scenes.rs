//! Scenes for tests, and what can be done to a whole scene.

use crate::prelude::*;
use std::f64::consts::FRAC_PI_2;
use taut_measure::poses;

pub use taut_measure::poses::Pose;

/// The world's origin.
pub fn origin() -> Frame {
    Frame::world(Vector3::zeros())
}

pub fn centre(body: usize) -> Frame {
    Frame::body(body, Vector3::zeros())
}

/// A hoist with the given joints in the given pose; the straight one has random angular velocities of 10⁻³ rad/s.
pub fn hoist(joint: JointKind, pose: Pose, segments: usize, mass_ratio: f64) -> Scene {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.joint) = (segments, mass_ratio, joint))
        .with(|p| p.seed = 7);
    poses::hoist(&params, pose).expect("sound parameters")
}

/// A hoist with ball joints of that compliance (m/N), unstrained, turned aside, in motion: that of H51.
pub fn ball_jointed(compliance: f64) -> Scene {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.mass_ratio, p.joint) = (6, 20.0, JointKind::Spherical))
        .with(|p| (p.initial_angle, p.seed) = (0.5, 5));
    let mut scene = params.build().expect("sound parameters");
    for constraint in &mut scene.constraints {
        if let Constraint::Spherical(joint) = constraint {
            joint.stretch = RowLaw::new(compliance, 0.0);
        }
    }
    scene
}

/// A hook of 100 kg on 10 m of cable of `n` segments, and a load of 5 t on two slings from one point of it to points a
/// metre from the load's axis, in the direction `angle` (rad) about the vertical: those of H16.
pub fn slings(n: usize, angle: f64) -> Scene {
    let hoist = HoistParams {
        segments: n,
        load_mass: Some(100.0),
        segment_mass: Some(40.0 / n as f64),
        ..HoistParams::default()
    };
    let mut scene = hoist.build().expect("sound parameters");
    let hook = scene.bodies.len() - 1;
    let point = Vector3::new(0.0, 0.0, -0.2);
    let size = Vector3::new(2.0, 1.0, 1.0);
    let below = scene.bodies.position[hook] + point - Vector3::z() * 1.5;
    let load = scene.add_body("crate", Body::cuboid(size, 5000.0).at(below));
    let outwards = Vector3::new(angle.cos(), angle.sin(), 0.0);
    let length = 2.0_f64.sqrt();
    for (name, side) in [("sling-1", 1.0), ("sling-2", -1.0)] {
        let end = outwards * side + Vector3::z() * 0.5;
        let ends = vec![Frame::body(hook, point), Frame::body(load, end)];
        let cable = MasslessCable::new(ends, length, RowLaw::new(length / 1e7, 0.0));
        scene.add_constraint(name, Constraint::MasslessCable(cable), 2);
    }
    scene.load = Some(load);
    scene
}

/// The joints of cables, which hold all directions or all but the turns.
pub const JOINTS: [&str; 4] = ["spherical", "paper", "cosserat", "lock"];

/// All kinds of joint: [`JOINTS`], then those that turn or slide and their motors, which hold an angle, a place or a
/// speed; then massless cables that push when they are too short, and one that does not.
pub const KINDS: [&str; 12] = [
    "spherical",
    "paper",
    "cosserat",
    "lock",
    "hinge",
    "hinge-position",
    "hinge-speed",
    "slider",
    "slider-position",
    "slider-speed",
    "cable",
    "tension-cable",
];

/// Largest force of a motor of [`joint`] \[N, N m].
const MOTOR_LIMIT: f64 = 5.0;

/// The motor of a kind that says so in its name, with the given compliance where it holds a position.
fn motor(kind: &str, compliance: f64, damping: f64) -> Option<Motor> {
    let target = match kind.split_once('-')?.1 {
        "position" => Target::Position(0.1),
        _ => Target::Speed(0.2),
    };
    Some(Motor {
        target,
        force_limit: MOTOR_LIMIT,
        law: RowLaw::new(compliance, damping),
    })
}

/// A joint of the given kind with stretch, bend and twist of the given compliances and damping time. Motors hold 0.1
/// m or rad, or 0.2 m/s or rad/s, with at most 5 N or N m; a massless cable is 1 mm long.
pub fn joint(
    kind: &str,
    frames: [Frame; 2],
    stretch: f64,
    angular: f64,
    damping: f64,
) -> Constraint {
    let law = JointLaw {
        stretch: Some(RowLaw::new(stretch, damping)),
        bend: Some(RowLaw::new(angular, damping)),
        twist: Some(RowLaw::new(angular, damping)),
    };
    match kind {
        "spherical" => Constraint::Spherical(Spherical {
            frames,
            stretch: RowLaw::new(stretch, damping),
        }),
        "paper" => Constraint::Paper(Paper::new(frames, law)),
        "cosserat" => Constraint::Cosserat(Cosserat::new(frames, law)),
        "lock" => Constraint::Lock(Lock {
            frames,
            linear: RowLaw::new(stretch, damping),
            angular: RowLaw::new(angular, damping),
        }),
        "hinge" | "hinge-position" | "hinge-speed" => Constraint::Hinge(Hinge {
            stretch: RowLaw::new(stretch, damping),
            tilt: RowLaw::new(angular, damping),
            motor: motor(kind, angular, damping),
            ..Hinge::new(frames)
        }),
        "slider" | "slider-position" | "slider-speed" => Constraint::Slider(Slider {
            rotation: RowLaw::new(angular, damping),
            across: RowLaw::new(stretch, damping),
            motor: motor(kind, stretch, damping),
            ..Slider::new(frames)
        }),
        "cable" | "tension-cable" => Constraint::MasslessCable(MasslessCable {
            tension_only: kind == "tension-cable",
            ..MasslessCable::new(frames.into(), 1e-3, RowLaw::new(stretch, damping))
        }),
        other => panic!("no kind of joint is called {other}"),
    }
}

/// Length of a segment \[m].
const SEGMENT: f64 = 0.5;

/// A cable of `segments` rods, the last of them heavier, that nothing holds, without gravity, with random velocities.
/// `stretch` is the compliance of its gaps \[m/N]; that of its angles is 1000 times as much \[rad/(N m)].
pub fn free_cable(kind: &str, segments: usize, stretch: f64, seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut scene = Scene::new("free cable");
    let half = Vector3::new(0.0, 0.0, 0.5 * SEGMENT);
    for i in 0..segments {
        let mass = if i + 1 == segments { 20.0 } else { 1.0 };
        let mut rod = Body::rod(SEGMENT, 0.05, mass).at(-2.0 * half * i as f64);
        rod.velocity = random.vector(1.0);
        rod.angular_velocity = random.vector(1.0);
        scene.add_body(format!("rod-{i}"), rod);
    }
    for i in 1..segments {
        let frames = [Frame::body(i - 1, -half), Frame::body(i, half)];
        let mut constraint = joint(kind, frames, stretch, 1e3 * stretch, 0.0);
        if let Constraint::MasslessCable(cable) = &mut constraint {
            // From centre to centre, as the ends meet in one point, where a cable has no direction.
            cable.length = SEGMENT;
            for frame in &mut cable.frames {
                frame.point *= 0.1;
            }
        }
        scene.add_constraint(format!("joint-{i}"), constraint, 0);
    }
    scene
}

/// A vertical chain of rigid ball joints (ε = 0) at rest, a load of `load` kg under `segments` of 1 kg and 0.5 m. All
/// lengths are sums of powers of two: no gap comes from rounding.
pub fn rigid_chain(segments: usize, load: f64) -> Scene {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.length) = (segments, SEGMENT * segments as f64))
        .with(|p| (p.mass_ratio, p.joint) = (load, JointKind::Spherical));
    let mut scene = params.build().expect("sound parameters");
    for constraint in &mut scene.constraints {
        if let Constraint::Spherical(s) = constraint {
            s.stretch = RowLaw::RIGID;
        }
    }
    scene
}

/// A tree of bodies on a moving anchor, with a loop, joints of all kinds, gaps, bends and velocities: nothing about it
/// is special.
pub fn random_scene(seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut scene = Scene::new("random tree");
    scene.gravity = random.vector(10.0);
    let bodies = 5 + random.below(8);
    let mut parents = vec![None];
    for i in 1..bodies {
        parents.push(Some(random.below(i)));
    }
    let mut ends: Vec<Vector3<f64>> = Vec::new();
    for (i, parent) in parents.iter().enumerate() {
        let start = parent.map_or(Vector3::zeros(), |p: usize| ends[p]);
        let turn = random.rotation(0.5);
        let half = turn * Vector3::new(0.0, 0.0, -0.5 * SEGMENT);
        let mass = random.log_uniform(0.5, 50.0);
        let rod = Body::rod(SEGMENT, 0.05, mass).at(start + half + random.vector(1e-3));
        let mut rod = rod.turned(turn);
        rod.velocity = random.vector(0.3);
        rod.angular_velocity = random.vector(0.3);
        rod.force = random.vector(1.0);
        rod.torque = random.vector(0.1);
        scene.add_body(format!("rod-{i}"), rod);
        ends.push(start + 2.0 * half);
    }
    let half = Vector3::new(0.0, 0.0, 0.5 * SEGMENT);
    for (i, parent) in parents.iter().enumerate() {
        let upper = parent.map_or_else(
            || origin().moving(anchor_motion()),
            |p| Frame::body(p, -half),
        );
        let kind = JOINTS[random.below(4)];
        let stretch = random.log_uniform(1e-8, 1e-4);
        let angular = random.log_uniform(1e-4, 1.0);
        let frames = [upper, Frame::body(i, half)];
        let constraint = joint(kind, frames, stretch, angular, 0.01);
        scene.add_constraint(format!("joint-{i}"), constraint, (i % 3) as u32);
    }
    // The loop: a soft ball joint between the ends of the first and the last body where they happen to be.
    let last = bodies - 1;
    let offset = scene.bodies.orientation[0].inverse() * (ends[last] - scene.bodies.position[0]);
    let frames = [Frame::body(0, offset), Frame::body(last, -half)];
    let closing = joint("spherical", frames, 1e-3, 0.0, 0.01);
    scene.add_constraint("closing", closing, 3);
    scene
}

pub(crate) fn anchor_motion() -> Motion {
    Motion::Smooth {
        displacement: Vector3::new(0.3, -0.1, 0.2),
        start: -0.1,
        duration: 1.0,
    }
}

/// The scene rotated about the origin, then shifted: bodies, velocities, forces, gravity, world sides and their motion.
pub fn moved(scene: &Scene, turn: &UnitQuaternion<f64>, shift: &Vector3<f64>) -> Scene {
    let mut scene = scene.clone();
    scene.gravity = turn * scene.gravity;
    let bodies = &mut scene.bodies;
    for i in 0..bodies.len() {
        bodies.position[i] = turn * bodies.position[i] + shift;
        bodies.orientation[i] = turn * bodies.orientation[i];
        for v in [
            &mut bodies.velocity[i],
            &mut bodies.angular_velocity[i],
            &mut bodies.force[i],
            &mut bodies.torque[i],
        ] {
            *v = turn * *v;
        }
    }
    for frame in scene
        .constraints
        .iter_mut()
        .flat_map(Constraint::frames_mut)
    {
        if let Side::World(motion) = &mut frame.side {
            frame.point = turn * frame.point + shift;
            frame.axes = turn.to_rotation_matrix() * frame.axes;
            match motion {
                Motion::Fixed => {}
                Motion::Smooth { displacement, .. } => *displacement = turn * *displacement,
                other => panic!("{other:?} has directions of its own"),
            }
        }
    }
    scene
}

/// Lists the bodies and constraints of a scene in another order: entry k is the old `bodies[k]`.
pub fn relabelled(scene: &Scene, bodies: &[usize], constraints: &[usize]) -> Scene {
    let mut other = Scene::new(scene.name.clone());
    other.gravity = scene.gravity;
    let mut place = vec![0; bodies.len()];
    for &old in bodies {
        place[old] = other.add_body(scene.body_names[old].clone(), scene.bodies.get(old));
    }
    for &old in constraints {
        let mut constraint = scene.constraints[old].clone();
        for frame in constraint.frames_mut() {
            if let Side::Body(i) = &mut frame.side {
                *i = place[*i];
            }
        }
        other.add_constraint(
            scene.constraint_names[old].clone(),
            constraint,
            scene.groups[old],
        );
    }
    let mut constraint_place = vec![0; constraints.len()];
    for (new, &old) in constraints.iter().enumerate() {
        constraint_place[old] = new;
    }
    for control in &scene.controls {
        let drives = control.drives.iter().map(|drive| Drive {
            constraint: constraint_place[drive.constraint],
            ..*drive
        });
        other.controls.push(Control {
            name: control.name.clone(),
            drives: drives.collect(),
        });
    }
    other.load = scene.load.map(|i| place[i]);
    other
}

/// Weight of the ball of [`copies`] \[N].
pub const BALL: f64 = 3.0 * 9.81;

/// A ball at rest on so many equal ball joints at the same place, of compliance `compliance` (m/N).
pub fn copies(copies: usize, compliance: f64) -> Scene {
    let mut scene = Scene::new("copies");
    scene.gravity = Vector3::new(0.0, 0.0, -9.81);
    let hook = Vector3::new(0.0, 0.0, 0.2);
    let gap = compliance * BALL / copies as f64;
    let body = Body::sphere(0.1, 3.0).at(-hook - Vector3::z() * gap);
    let ball = scene.add_body("ball", body);
    for i in 1..=copies {
        let joint = Constraint::Spherical(Spherical {
            frames: [origin(), Frame::body(ball, hook)],
            stretch: RowLaw::new(compliance, 0.0),
        });
        scene.add_constraint(format!("copy-{i}"), joint, 0);
    }
    scene
}

/// Tension of the cable of [`overstretched`] \[N]: EA times the strain, for any number of segments.
pub const DRAWN: f64 = 2e7 * 0.01;

/// A straight steel cable of five segments and 10 m, without gravity, between points that are 1 % farther apart, its rows
/// damped by `damping` (s); without damping it has no compliance either, and no state that meets its constraints.
pub fn overstretched(damping: Option<f64>) -> Scene {
    let (l, n) = (2.0, 5);
    let radius = Material::STEEL.round_radius(2e7);
    let law = |length: f64| match damping {
        Some(damping) => Stiffness::of_round(2e7, radius, Material::STEEL.poisson, [None; 2])
            .joint_law(length, damping),
        None => JointLaw {
            stretch: Some(RowLaw::RIGID),
            bend: Some(RowLaw::RIGID),
            twist: Some(RowLaw::RIGID),
        },
    };
    let mut scene = Scene::new("overstretched");
    // A quarter turn takes the rod's −z to +x.
    let turn = UnitQuaternion::from_scaled_axis(-Vector3::y() * FRAC_PI_2);
    for i in 0..n {
        let rod = Body::rod(l, radius, 1.0).at(Vector3::x() * (l * (i as f64 + 0.5)));
        scene.add_body(format!("segment-{}", i + 1), rod.turned(turn));
    }
    let half = Vector3::new(0.0, 0.0, 0.5 * l);
    let world = |x: f64| Frame::world(Vector3::x() * x).with_axes(Matrix3::identity());
    for i in 0..=n {
        let before = if i > 0 {
            Frame::body(i - 1, -half)
        } else {
            world(0.0)
        };
        let after = if i < n {
            Frame::body(i, half)
        } else {
            world(1.01 * l * n as f64)
        };
        let frames = [before, after];
        let constraint = match i {
            1..5 => Constraint::Cosserat(Cosserat::new(frames, law(l))),
            _ => Constraint::Spherical(Spherical {
                frames,
                stretch: law(0.5 * l).stretch.unwrap_or_default(),
            }),
        };
        scene.add_constraint(format!("joint-{i}"), constraint, 0);
    }
    scene
}
