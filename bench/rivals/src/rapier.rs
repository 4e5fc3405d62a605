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
//! `num_solver_iterations` are sub-steps, each with `num_internal_pgs_iterations` sweeps. There are no colliders, so
//! that nothing collides; bodies do not sleep; limits on speeds are off; the feature `parallel` is not built.

use nalgebra::Vector3;
use rapier3d_f64::dynamics::{
    GenericJointBuilder, IntegrationParameters, JointAxesMask, MassProperties,
    MultibodyJointHandle, RigidBodyBuilder, RigidBodyHandle, SoftBodyBuilder, SoftBodyMaterial,
    SoftBodyParticleSettings, SoftBodySolver, SphericalJointBuilder, SpringCoefficients,
};
use taut_ground::engine::motion::{FRAME, Motion};
use taut_ground::engine::{self, Engine, Frame, Setting, doubling};

use rapier3d_f64::math::{Pose, Rotation, Vector};
use rapier3d_f64::pipeline::PhysicsWorld;
use std::f64::consts::TAU;
use taut_integrator::StepError;
use taut_model::{Bodies, Scene};

/// What of Rapier's parameters is searched.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Sub-steps of a frame.
    substeps: usize,
    /// Sweeps of a sub-step.
    sweeps: usize,
    /// Sweeps after it that take the correction's velocity out again.
    relaxing: usize,
}

/// Starts a cable of one kind.
type Begin = fn(&Motion, Effort) -> Result<Frame, StepError>;

/// Most sub-steps that are tried.
const SUBSTEPS: usize = 1024;

/// All five.
#[must_use]
pub fn engines() -> Vec<Engine> {
    // Direct solves need no sweeps.
    let direct = |name, start: Begin| Engine {
        name,
        ladders: vec![ladder(start, 1, 0)],
        all: false,
    };
    let swept = |name, start: Begin, relaxing: &[usize]| {
        let mut ladders = Vec::new();
        for &relaxing in relaxing {
            ladders.extend([1, 4, 16, 64].map(|sweeps| ladder(start, sweeps, relaxing)));
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

fn ladder(start: Begin, sweeps: usize, relaxing: usize) -> Vec<Setting> {
    let setting = |substeps| {
        let effort = Effort {
            substeps,
            sweeps,
            relaxing,
        };
        let mut text = engine::substeps(substeps);
        if sweeps > 1 {
            text += &format!(" × {sweeps}");
        }
        if relaxing > 0 {
            text += ", relaxed";
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
fn world(motion: &Motion, effort: Effort) -> PhysicsWorld {
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
    parameters.soft_bodies.max_extra_substeps = 0;
    parameters.soft_bodies.resweep_strain = f64::MAX;
    PhysicsWorld {
        gravity: Vector::new(0.0, 0.0, -motion.params.gravity),
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
    let mut world = world(motion, effort);
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
        let body = RigidBodyBuilder::dynamic()
            .pose(Pose::from_parts(to_rapier(bodies.position[i]), turned))
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
    let mut world = world(motion, effort);
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

fn multibody(motion: &Motion, effort: Effort, elastic: bool) -> Result<Frame, StepError> {
    let scene = motion.scene()?;
    let hoist = motion.hoist()?;
    let mut world = world(motion, effort);
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
            assert!(
                (elongation - expected).abs() < 0.01 * exact,
                "{name}: {elongation} of {expected}"
            );
        }
    }
}
