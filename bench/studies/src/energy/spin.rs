//! A free cable that spins: nothing turns it, so its angular momentum is to stay.
//!
//! Between two heavy balls the cable is taut by the spin. A scheme that treats the tension's lever arms in any way but
//! exactly loses angular momentum at some order in Δt, and this is that order.

use super::{Setting, options};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use taut_ground::pace;
use taut_ground::trajectory::{Failure, steps_in};
use taut_integrator::{StepError, Stepper};
use taut_model::{
    Bodies, Body, Constraint, Cosserat, Frame, RowLaw, Scene, Spherical, Stiffness, hanging_axes,
};

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Spin {
    pub scheme: String,
    /// The geometric stiffness.
    pub stiffness: String,
    /// Δt \[s].
    pub dt: f64,
    /// Largest |L − L₀|/|L₀| about the centre of mass; `None` where the run was lost.
    pub drift: Option<f64>,
    /// log of the drift over the drift of the next larger time step, over that of the time steps.
    pub order: Option<f64>,
    /// How the run was lost.
    pub failure: Option<Failure>,
}

pub(super) const RODS: usize = 12;
/// Length \[m] and mass \[kg] of a rod, and of a ball.
const LENGTH: f64 = 0.5;
const ROD: f64 = 1.0;
const BALL: f64 = 100.0;
/// Spin of the whole about y \[rad/s].
const SPIN: f64 = 1.0;
/// Angular velocities of the rods besides, at most \[rad/s].
const PERTURBATION: f64 = 1e-2;

/// Twelve rods of a steel cable (EA = 2·10⁷ N) between two balls of 100 kg, without gravity, spinning at 1 rad/s about y,
/// its joints open by what the spin's tension opens them; the rods turn by up to 10⁻² rad/s besides.
#[must_use]
pub fn free_cable() -> Scene {
    let stiffness = Stiffness {
        ea: 2e7,
        ei: 159.0,
        gj: 122.0,
    };
    let depth = |i: usize| LENGTH * (i as f64 - 0.5 * (RODS as f64 - 1.0));
    let reach = 0.5 * LENGTH * RODS as f64;
    // Tension at the upper end of rod i: what holds all that is above it on its circle.
    let tension = |i: usize| {
        let rods: f64 = (0..i.min(RODS - i)).map(|k| ROD * depth(k).abs()).sum();
        SPIN * SPIN * (BALL * reach + rods)
    };
    let gap = |i: usize| {
        let length = if i == 0 || i == RODS {
            0.5 * LENGTH
        } else {
            LENGTH
        };
        tension(i) * length / stiffness.ea
    };
    let whole: f64 = (0..=RODS).map(gap).sum();
    let mut scene = Scene::new("free cable");
    let mut z = reach + 0.5 * whole;
    let add = |scene: &mut Scene, name: String, body: Body, z: f64, extra: Vector3<f64>| {
        let position = Vector3::new(0.0, 0.0, z);
        let spin = Vector3::new(0.0, SPIN, 0.0);
        let mut body = body.at(position).turned(UnitQuaternion::identity());
        body.velocity = spin.cross(&position);
        body.angular_velocity = spin + extra;
        scene.add_body(name, body);
    };
    let ball = Body::sphere(0.15, BALL);
    add(&mut scene, "upper".into(), ball, z, Vector3::zeros());
    for i in 0..RODS {
        z -= gap(i) + 0.5 * LENGTH;
        let phase = i as f64;
        let extra = Vector3::new((3.0 * phase).cos(), (5.0 * phase).sin(), phase.cos());
        let rod = Body::rod(LENGTH, 0.0056, ROD);
        add(
            &mut scene,
            format!("rod-{}", i + 1),
            rod,
            z,
            extra * PERTURBATION,
        );
        z -= 0.5 * LENGTH;
    }
    z -= gap(RODS);
    add(&mut scene, "lower".into(), ball, z, Vector3::zeros());
    join(&mut scene, &stiffness);
    scene
}

fn join(scene: &mut Scene, stiffness: &Stiffness) {
    let half = Vector3::new(0.0, 0.0, 0.5 * LENGTH);
    let end = RowLaw::new(0.5 * LENGTH / stiffness.ea, 0.0);
    let at = |body, point| Frame::body(body, point).with_axes(hanging_axes());
    let ball = |frames| {
        Constraint::Spherical(Spherical {
            frames,
            stretch: end,
        })
    };
    scene.add_constraint("upper", ball([at(0, Vector3::zeros()), at(1, half)]), 0);
    let law = stiffness.joint_law(LENGTH, 0.0);
    for i in 1..RODS {
        let joint = Cosserat::new([at(i, -half), at(i + 1, half)], law);
        scene.add_constraint(format!("joint-{i}"), Constraint::Cosserat(joint), 0);
    }
    let lower = ball([at(RODS, -half), at(RODS + 1, Vector3::zeros())]);
    scene.add_constraint("lower", lower, 0);
}

/// Angular momentum about the centre of mass.
fn momentum(scene: &Scene) -> Vector3<f64> {
    let bodies = &scene.bodies;
    let terms = bodies.position.iter().zip(&bodies.mass);
    let centre = terms.map(|(x, m)| x * *m).sum::<Vector3<f64>>() / scene.mass();
    scene.angular_momentum(&centre)
}

/// The velocities of `bodies` become the means of theirs and of those of `after`: half a step later, at the time of the
/// positions.
fn to_middle(bodies: &mut Bodies, after: &Bodies) {
    for i in 0..bodies.len() {
        bodies.velocity[i] = 0.5 * (bodies.velocity[i] + after.velocity[i]);
        bodies.angular_velocity[i] = 0.5 * (bodies.angular_velocity[i] + after.angular_velocity[i]);
    }
}

/// Spins for `time` seconds.
pub(super) fn run(setting: Setting, dt: f64, time: f64) -> Result<Spin, StepError> {
    let mut stepper = Stepper::new(free_cable(), options(setting, dt, false))?;
    let mut spin = Spin {
        scheme: setting.0.to_string(),
        stiffness: setting.1.to_string(),
        dt,
        drift: None,
        order: None,
        failure: None,
    };
    let start = momentum(stepper.scene());
    let mut drift = 0.0_f64;
    for step in 0..steps_in(time, dt) {
        let mut scene = stepper.scene().clone();
        let failed = |reason: String| {
            Some(Failure {
                time: step as f64 * dt,
                reason,
            })
        };
        if let Err(e) = pace::step(&mut stepper) {
            spin.failure = failed(e.to_string());
            return Ok(spin);
        }
        // The stepper puts the first velocities half a step back only within its first step.
        if setting.0.is_staggered() && step > 0 {
            to_middle(&mut scene.bodies, &stepper.scene().bodies);
        }
        drift = drift.max((momentum(&scene) - start).norm() / start.norm());
        if drift.is_nan() || drift > 1.0 {
            spin.failure = failed("more angular momentum than there was".to_owned());
            return Ok(spin);
        }
    }
    spin.drift = Some(drift);
    Ok(spin)
}

/// Fills in the orders from neighbouring rows of one setting.
pub(super) fn orders(spins: &mut [Spin]) {
    for i in 1..spins.len() {
        let (before, after) = (&spins[i - 1], &spins[i]);
        let same = (&before.scheme, &before.stiffness) == (&after.scheme, &after.stiffness);
        let order = before
            .drift
            .zip(after.drift)
            .filter(|_| same)
            .map(|(large, small)| (large / small).ln() / (before.dt / after.dt).ln());
        spins[i].order = order;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_integrator::{GeometricStiffness, Scheme};

    /// The spin opens the joints by what they are open by: without perturbation nothing but the spin moves.
    #[test]
    fn the_free_cable_spins_in_equilibrium() {
        let mut scene = free_cable();
        for i in 0..scene.bodies.len() {
            scene.bodies.angular_velocity[i] = Vector3::new(0.0, SPIN, 0.0);
        }
        let options = options((Scheme::Spook, GeometricStiffness::Off), 1e-3, false);
        let mut stepper = Stepper::new(scene, options).unwrap();
        let distance = |s: &Scene| (s.bodies.position[0] - s.bodies.position[RODS + 1]).norm();
        let start = distance(stepper.scene());
        let whole = start - LENGTH * RODS as f64;
        assert!(whole > 5e-5);
        for _ in 0..1000 {
            stepper.step().unwrap();
            assert!((distance(stepper.scene()) - start).abs() < 0.05 * whole);
        }
    }
}
