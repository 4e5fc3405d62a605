//! The physics engine Rapier (crate `rapier3d-f64`) on the same cable, as a user would build it there.
//!
//! | engine | cable | stretch |
//! |---|---|---|
//! | soft rope | a soft body of point masses and edges, swept Gauss–Seidel | softness of the edges |
//! | soft rope FEM | the same, one implicit solve over the body a sub-step | likewise |
//! | impulse joints | rigid rods and ball joints, swept Gauss–Seidel | softness of the joints |
//! | multibody | rods in reduced coordinates, ball joints | none: the rods are as long as they are |
//! | multibody springs | the same, each joint free along the cable | a spring there |
//!
//! A softness is a frequency: ω² = k Σ 1/m over the two masses, along the cable. It has no damping of its own. Rapier's
//! `num_solver_iterations` are sub-steps, each with `num_internal_pgs_iterations` sweeps. On the hoist there are no
//! colliders, so that nothing collides; bodies do not sleep; limits on speeds are off; the feature `parallel` is not
//! built.
//!
//! On the ground are Rapier's half-space, cuboids and capsules, with the masses, friction and joints of the scene; its
//! contacts are springs of 30 and 60 Hz as it delivers them, or as hard as its joints, then with Coulomb's cone at every
//! point instead of one for four of them.

use nalgebra::Vector3;
use rapier3d_f64::dynamics::{
    CoefficientCombineRule, FrictionModel, GenericJointBuilder, IntegrationParameters,
    JointAxesMask, MassProperties, MultibodyJointHandle, RigidBodyBuilder, RigidBodyHandle,
    SoftBodyBuilder, SoftBodyMaterial, SoftBodyParticleSettings, SoftBodySolver,
    SphericalJointBuilder, SpringCoefficients,
};
use rapier3d_f64::geometry::{
    ColliderBuilder, Group, InteractionGroups, InteractionTestMode, SharedShape,
};
use taut_measure::engine::contact_scenes::{Known, Places};
use taut_measure::engine::motion::{FRAME, Motion};
use taut_measure::engine::{self, Engine, Frame, Setting, doubling};

use rapier3d_f64::math::{Pose, Rotation, Vector};
use rapier3d_f64::pipeline::PhysicsWorld;
use std::f64::consts::TAU;
use taut_integrator::StepError;
use taut_model::{Bodies, Collider, Constraint, Mobility, Scene, Shape};

/// Solver parameters of Rapier that the search varies.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Sub-steps of a frame.
    substeps: usize,
    /// Sweeps per sub-step.
    sweeps: usize,
    /// Relaxing sweeps after a sub-step; they remove the velocity that the correction added.
    relaxing: usize,
    /// Makes contacts as stiff as joints.
    hard: bool,
}

/// Starts a cable of one kind, or a scene.
type Begin<M = Motion, P = Vector3<f64>> = fn(&M, Effort) -> Result<Frame<P>, StepError>;

/// Most sub-steps that are tried.
const SUBSTEPS: usize = 1024;

/// All five.
pub fn engines() -> Vec<Engine> {
    // Direct solves need no sweeps.
    let direct = |name, start: Begin| Engine {
        name,
        ladders: vec![ladder(start, 1, 0, false)],
        all: false,
    };
    let swept = |name, start: Begin, relaxing: &[usize]| {
        let mut ladders = Vec::new();
        for &relaxing in relaxing {
            ladders.extend([1, 4, 16, 64].map(|sweeps| ladder(start, sweeps, relaxing, false)));
        }
        Engine {
            name,
            ladders,
            all: false,
        }
    };
    vec![
        swept(
            "rapier soft rope",
            |m, e| soft_rope(m, e, SoftBodySolver::Constraints),
            &[0],
        ),
        direct("rapier soft rope FEM", |m, e| {
            soft_rope(m, e, SoftBodySolver::Fem)
        }),
        swept("rapier impulse joints", impulse_joints, &[0, 1]),
        direct("rapier multibody", |m, e| multibody(m, e, false)),
        direct("rapier multibody springs", |m, e| multibody(m, e, true)),
    ]
}

/// On the ground: rigid bodies, with impulse joints where there is a cable.
pub fn on_ground() -> Engine<Known, Places> {
    let mut ladders = Vec::new();
    for hard in [false, true] {
        for relaxing in [1, 0] {
            ladders
                .extend([1, 4, 16, 64].map(|sweeps| ladder(on_the_ground, sweeps, relaxing, hard)));
        }
    }
    Engine {
        name: "rapier",
        ladders,
        all: false,
    }
}

fn ladder<M: 'static, P: 'static>(
    start: Begin<M, P>,
    sweeps: usize,
    relaxing: usize,
    hard: bool,
) -> Vec<Setting<M, P>> {
    let setting = |substeps| {
        let effort = Effort {
            substeps,
            sweeps,
            relaxing,
            hard,
        };
        let mut text = engine::substeps(substeps);
        if sweeps > 1 {
            text += &format!(" × {sweeps}");
        }
        if relaxing > 0 {
            text += ", relaxed";
        }
        if hard {
            text += ", hard";
        }
        Setting {
            text,
            substeps,
            start: Box::new(move |motion| start(motion, effort)),
        }
    };
    doubling(1, SUBSTEPS).map(setting).collect()
}

/// An empty world.
fn world(gravity: f64, effort: Effort) -> PhysicsWorld {
    let mut parameters = IntegrationParameters {
        dt: FRAME,
        num_solver_iterations: effort.substeps,
        num_internal_pgs_iterations: effort.sweeps,
        num_internal_stabilization_iterations: effort.relaxing,
        warmstart_joints: true,
        max_ccd_substeps: 0,
        normalized_max_corrective_velocity: f64::MAX,
        normalized_max_linear_velocity: f64::MAX,
        ..IntegrationParameters::default()
    };
    if effort.hard {
        parameters.contact_softness = SpringCoefficients::joint_defaults();
        parameters.static_contact_softness = SpringCoefficients::joint_defaults();
        parameters.friction_model = FrictionModel::Coulomb;
    }
    parameters.soft_bodies.max_extra_substeps = 0;
    parameters.soft_bodies.resweep_strain = f64::MAX;
    PhysicsWorld {
        gravity: Vector::new(0.0, 0.0, -gravity),
        integration_parameters: parameters,
        ..PhysicsWorld::new()
    }
}

fn to_rapier(v: Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

fn from_rapier(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

/// The softness of a spring of stiffness `k` (N/m) between bodies of these reciprocal masses (1/kg).
fn softness(k: f64, inverse_masses: f64) -> SpringCoefficients<f64> {
    SpringCoefficients::new((k * inverse_masses).sqrt() / TAU, 0.0)
}

fn soft_rope(motion: &Motion, effort: Effort, solver: SoftBodySolver) -> Result<Frame, StepError> {
    let points = motion.points()?;
    let last = points.mass.len() - 1;
    let inverse = |i: usize| if i == 0 { 0.0 } else { 1.0 / points.mass[i] };
    let edges = 0..last;
    let softnesses = edges.clone().map(|i| {
        let sum = inverse(i) + inverse(i + 1);
        (i as u32, softness(points.stiffness, sum))
    });
    let unstretched = points.unstretched.iter().map(|x| to_rapier(*x));
    let rope = SoftBodyBuilder {
        masses: points.mass.clone(),
        pinned: vec![0],
        edges: edges.map(|i| [i as u32, i as u32 + 1]).collect(),
        edge_softness: softnesses.collect(),
        material: SoftBodyMaterial::default(),
        solver,
        collider_template: None,
        particle_settings: SoftBodyParticleSettings {
            additional_pgs_iterations: 0,
            can_sleep: false,
            ..SoftBodyParticleSettings::default()
        },
        ..SoftBodyBuilder::new(unstretched.collect())
    };
    let mut world = world(motion.params.gravity, effort);
    let rope = world.insert_soft_body(rope);
    for (i, x) in points.position.iter().enumerate() {
        world.soft_bodies[rope].set_particle_position(i, to_rapier(*x));
    }
    Ok(Box::new(move || {
        world.step();
        Ok(from_rapier(world.soft_bodies[rope].particle_position(last)))
    }))
}

/// A frame of a world whose load is a rigid body.
fn frames(mut world: PhysicsWorld, load: RigidBodyHandle) -> Frame {
    Box::new(move || {
        world.step();
        Ok(from_rapier(world.bodies[load].translation()))
    })
}

/// The anchor, then the rods and the load where the scene has them.
fn insert_bodies(world: &mut PhysicsWorld, scene: &Scene) -> Vec<RigidBodyHandle> {
    let mut handles = vec![world.insert_body(RigidBodyBuilder::fixed())];
    let bodies: &Bodies = &scene.bodies;
    for i in 0..bodies.len() {
        let e = bodies.orientation[i];
        let turned = Rotation::from_xyzw(e.i, e.j, e.k, e.w);
        let inertia = to_rapier(bodies.inertia[i].diagonal());
        let mass = MassProperties::new(Vector::ZERO, bodies.mass[i], inertia);
        let body = match bodies.mobility[i] {
            Mobility::Dynamic => RigidBodyBuilder::dynamic(),
            Mobility::Driven => RigidBodyBuilder::kinematic_velocity_based(),
            _ => RigidBodyBuilder::fixed(),
        };
        let body = body
            .pose(Pose::from_parts(to_rapier(bodies.position[i]), turned))
            .linvel(to_rapier(bodies.velocity[i]))
            .additional_mass_properties(mass)
            .can_sleep(false);
        handles.push(world.insert_body(body));
    }
    handles
}

/// The joints from the anchor on: their places in the bodies above and below along z, and their stiffness \[m, N/m].
fn joints(motion: &Motion) -> Result<Vec<([f64; 2], f64)>, StepError> {
    let hoist = motion.hoist()?;
    let (n, half) = (hoist.segments, 0.5 * hoist.segment_length);
    let k = hoist.stiffness.ea / hoist.segment_length;
    // The end joints stand for half a segment of cable each.
    Ok((0..=n)
        .map(|i| match i {
            0 => ([0.0, half], 2.0 * k),
            i if i == n => ([-half, 0.0], 2.0 * k),
            _ => ([-half, half], k),
        })
        .collect())
}

fn impulse_joints(motion: &Motion, effort: Effort) -> Result<Frame, StepError> {
    let scene = motion.scene()?;
    let mut world = world(motion.params.gravity, effort);
    let bodies = insert_bodies(&mut world, &scene);
    for (i, ([above, below], k)) in joints(motion)?.into_iter().enumerate() {
        let inverse = if i == 0 {
            0.0
        } else {
            1.0 / scene.bodies.mass[i - 1]
        };
        let inverse = inverse + 1.0 / scene.bodies.mass[i];
        let joint = SphericalJointBuilder::new()
            .local_anchor1(Vector::new(0.0, 0.0, above))
            .local_anchor2(Vector::new(0.0, 0.0, below))
            .softness(softness(k, inverse));
        world.insert_impulse_joint(bodies[i], bodies[i + 1], joint);
    }
    let load = bodies[bodies.len() - 1];
    Ok(frames(world, load))
}

fn on_the_ground(known: &Known, effort: Effort) -> Result<Frame<Places>, StepError> {
    let scene = &known.scene;
    let mut world = world(scene.gravity.norm(), effort);
    let bodies = insert_bodies(&mut world, scene);
    let segments: Vec<usize> = scene.cables.iter().flat_map(|c| c.bodies.clone()).collect();
    for collider in &scene.colliders {
        let is_segment = collider.body.is_some_and(|i| segments.contains(&i));
        let body = collider.body.map_or(bodies[0], |i| bodies[i + 1]);
        if let Some(built) = shape(collider, is_segment) {
            world.insert_collider(built, Some(body));
        }
    }
    let inverse = |body: Option<usize>| match body {
        Some(i) if scene.bodies.mobility[i] == Mobility::Dynamic => 1.0 / scene.bodies.mass[i],
        _ => 0.0,
    };
    for constraint in &scene.constraints {
        let Constraint::Spherical(joint) = constraint else {
            continue;
        };
        let ends = joint.frames.map(|frame| frame.body_index());
        let law = joint.stretch;
        let spring = softness(1.0 / law.compliance, ends.into_iter().map(inverse).sum());
        // A spring k with the damping kτ: ζ = ½ω τ.
        let ratio = 0.5 * spring.angular_frequency() * law.damping;
        let [first, second] = ends.map(|body| body.map_or(bodies[0], |i| bodies[i + 1]));
        let [one, other] = joint.frames.map(|frame| to_rapier(frame.point));
        let joint = SphericalJointBuilder::new()
            .local_anchor1(one)
            .local_anchor2(other)
            .contacts_enabled(false)
            .softness(SpringCoefficients::new(spring.natural_frequency, ratio));
        world.insert_impulse_joint(first, second, joint);
    }
    Ok(Box::new(move || {
        world.step();
        let places = bodies[1..]
            .iter()
            .map(|body| from_rapier(world.bodies[*body].translation()));
        Ok(places.collect())
    }))
}

/// A shape with its surface; nothing of those that Rapier has otherwise. Segments meet the ground alone.
fn shape(collider: &Collider, is_segment: bool) -> Option<ColliderBuilder> {
    let shape = match collider.shape {
        Shape::HalfSpace => ColliderBuilder::new(SharedShape::halfspace(Vector::Z)),
        Shape::Cuboid { size } => ColliderBuilder::cuboid(0.5 * size.x, 0.5 * size.y, 0.5 * size.z),
        Shape::Capsule { length, radius } => ColliderBuilder::capsule_z(0.5 * length, radius),
        _ => return None,
    };
    let [ground, others, cable] = [Group::GROUP_1, Group::GROUP_2, Group::GROUP_3];
    let (own, meets) = match (collider.body, is_segment) {
        (None, _) => (ground, Group::ALL),
        (_, true) => (cable, ground),
        (_, false) => (others, ground | others),
    };
    let e = collider.orientation;
    let turned = Rotation::from_xyzw(e.i, e.j, e.k, e.w);
    let surface = collider.surface;
    Some(
        shape
            .position(Pose::from_parts(to_rapier(collider.position), turned))
            .density(0.0)
            .friction(surface.friction)
            .friction_combine_rule(CoefficientCombineRule::GeometricMean)
            .restitution(surface.restitution)
            .restitution_combine_rule(CoefficientCombineRule::Max)
            .collision_groups(InteractionGroups::new(own, meets, InteractionTestMode::And)),
    )
}

fn multibody(motion: &Motion, effort: Effort, elastic: bool) -> Result<Frame, StepError> {
    let scene = motion.scene()?;
    let hoist = motion.hoist()?;
    let mut world = world(motion.params.gravity, effort);
    let bodies = insert_bodies(&mut world, &scene);
    let locked = if elastic {
        JointAxesMask::LIN_X | JointAxesMask::LIN_Y
    } else {
        JointAxesMask::LIN_AXES
    };
    let gaps: Vec<f64> = hoist.gaps(motion.gravity_along()).collect();
    let mut last = None;
    for (i, ([above, below], k)) in joints(motion)?.into_iter().enumerate() {
        // Coordinates start from zero: the first joint's frame holds the angle.
        let e = motion.turn();
        let turned = if i == 0 {
            Rotation::from_xyzw(e.i, e.j, e.k, e.w)
        } else {
            Rotation::IDENTITY
        };
        let joint = GenericJointBuilder::new(locked)
            .local_frame1(Pose::from_parts(Vector::new(0.0, 0.0, above), turned))
            .local_anchor2(Vector::new(0.0, 0.0, below));
        let handle = world.insert_multibody_joint(bodies[i], bodies[i + 1], joint);
        if let (true, Some((body, link))) = (elastic, find(&mut world, handle)) {
            // Axis 2 is z.
            if let Some(link) = body.link_mut(link) {
                link.joint.set_spring(2, k, 0.0);
                let mut displacement = vec![0.0; link.joint.ndofs()];
                displacement[0] = -gaps[i];
                link.joint.apply_displacement(&displacement);
            }
        }
        last = handle.or(last);
    }
    let PhysicsWorld {
        multibody_joints,
        bodies: rigid,
        ..
    } = &mut world;
    if let Some((body, _)) = last.and_then(|handle| multibody_joints.get_mut(handle)) {
        // Damping that Rapier gives to joints by itself.
        body.damping_mut().fill(0.0);
        body.forward_kinematics(rigid, true);
        body.update_rigid_bodies(rigid, true);
    }
    let load = bodies[bodies.len() - 1];
    Ok(frames(world, load))
}

fn find(
    world: &mut PhysicsWorld,
    handle: Option<MultibodyJointHandle>,
) -> Option<(&mut rapier3d_f64::dynamics::Multibody, usize)> {
    world.multibody_joints.get_mut(handle?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::HoistParams;

    /// With sub-steps enough each of the elastic cables rests as long as the analytic elongation says, the rigid one as
    /// long as without a load: the softnesses are those of the cable.
    #[test]
    fn cables_rest_at_the_analytic_elongation() {
        let params = HoistParams {
            segments: 3,
            mass_ratio: 1e4,
            ..HoistParams::default()
        };
        let motion = Motion { params, angle: 0.0 };
        let exact = motion.params.exact_elongation();
        let effort = Effort {
            substeps: 64,
            sweeps: 64,
            relaxing: 0,
            hard: false,
        };
        let starts: [(&str, Begin, f64); 5] = [
            (
                "soft",
                |m, e| soft_rope(m, e, SoftBodySolver::Constraints),
                exact,
            ),
            ("fem", |m, e| soft_rope(m, e, SoftBodySolver::Fem), exact),
            ("impulse", impulse_joints, exact),
            ("rigid", |m, e| multibody(m, e, false), 0.0),
            ("springs", |m, e| multibody(m, e, true), exact),
        ];
        for (name, start, expected) in starts {
            let mut frame = start(&motion, effort).expect("sound");
            let mut load = Vector3::zeros();
            for _ in 0..30 {
                load = frame().expect("a frame");
            }
            let elongation = -load.z - motion.params.length;
            println!("{name}: {elongation} of {expected}");
            let off = (elongation - expected).abs();
            assert!(off < 0.01 * exact, "{name}: {elongation} of {expected}");
        }
    }
}
