//! Scenes at rest: brought there, and what their joints read.

use crate::motions::linearized;
use nalgebra::Vector3;
use taut_integrator::{GeometricStiffness, StepError, StepOptions, Stepper, static_equilibrium};
use taut_model::{Constraint, Linearized, RowKind, Scene, update_windings};
use taut_solver::Backend;

/// Values of the rows of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Reading {
    /// Gap along x, positive when open \[m].
    pub(crate) gap: f64,
    /// Largest gap across \[m].
    pub(crate) across: f64,
    /// Bend angle \[rad].
    pub(crate) bend: f64,
    /// Twist with its winding \[rad].
    pub(crate) twist: f64,
}

/// The rows of all cable joints from the clamp to the grip; the bearing is left out.
pub(crate) fn read(scene: &Scene, segments: usize) -> Vec<Reading> {
    let rows = linearized(scene);
    let joint = |j: usize| reading(&scene.constraints[j], &rows.phi[rows.row_range(j)]);
    (0..=segments).map(joint).collect()
}

fn reading(constraint: &Constraint, phi: &[f64]) -> Reading {
    let mut reading = Reading::default();
    let mut next = 0;
    for (kind, count, _) in constraint.parts() {
        let part = &phi[next..next + count];
        next += count;
        match kind {
            RowKind::Stretch => {
                reading.gap = -part[0];
                reading.across = part[1].hypot(part[2]);
            }
            RowKind::Bend => reading.bend = part.iter().map(|b| b * b).sum::<f64>().sqrt(),
            RowKind::Twist => reading.twist = part[0],
            _ => {}
        }
    }
    reading
}

/// Passes of [`relax`] and what they divide its time step by.
const PASSES: [(usize, f64); 3] = [(8, 1.0), (60, 10.0), (3, 100.0)];

/// Implicit steps from rest, each one Newton's pass that leaves 1/(1 + ω²Δt²) of a mode ω: `dt` (s) is ten times the
/// slowest mode's 1/ω. A pass turns the rounding of the joints' torques, u M, into rotations u M Δt²/I of the light
/// segments; shorter steps at the end take these away and leave the slow modes where they are. Longer ones, as
/// those of [`static_equilibrium`], would not come to rest here.
pub(crate) fn relax(mut scene: Scene, dt: f64) -> Result<Scene, StepError> {
    for (passes, divisor) in PASSES {
        let options = StepOptions {
            dt: dt / divisor,
            stiffness: GeometricStiffness::inertia(1.0),
            ..StepOptions::paper()
        };
        scene = passes_from_rest(scene, options, passes)?;
    }
    Ok(scene)
}

/// As many steps of `options`, each from rest.
pub(crate) fn passes_from_rest(
    scene: Scene,
    options: StepOptions,
    passes: usize,
) -> Result<Scene, StepError> {
    let mut stepper = Stepper::new(scene, options)?;
    for _ in 0..passes {
        step_from_rest(&mut stepper)?;
    }
    Ok(stepper.into_scene())
}

pub(crate) fn step_from_rest(stepper: &mut Stepper) -> Result<(), StepError> {
    let mut bodies = stepper.scene().bodies.clone();
    bodies.velocity.fill(Vector3::zeros());
    bodies.angular_velocity.fill(Vector3::zeros());
    stepper.set_state(&bodies, 0.0)?;
    stepper.step().map(|_| ())
}

/// Settlings of a load at most: a pass reduces what is left a thousandfold or more.
const SETTLINGS: usize = 20;

/// The static equilibrium of the scene under its loads with the windings followed, repeated until no row changes by
/// more than its rounding. No joint may turn by half a turn on the way.
pub(crate) fn settle(mut scene: Scene) -> Result<Scene, StepError> {
    let backend = Backend::preferred().unwrap_or(Backend::Banded);
    let mut rows = Linearized::new(&scene);
    let mut last: Vec<f64> = Vec::new();
    for _ in 0..SETTLINGS {
        scene = static_equilibrium(scene, &backend)?;
        update_windings(&mut scene, 0.0);
        rows.update(&scene, 0.0);
        let size = rows.phi.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        let change = rows.phi.iter().zip(&last);
        let change = change.fold(0.0_f64, |m, (p, q)| m.max((p - q).abs()));
        if !last.is_empty() && change <= 1e-14 * size {
            break;
        }
        last = rows.phi.to_vec();
    }
    Ok(scene)
}
