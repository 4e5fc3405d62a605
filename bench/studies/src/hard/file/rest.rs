//! How scenes come to rest before a run.

use super::{Rest, Run};
use crate::rest::{passes_from_rest, relax, settle};
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions, static_equilibrium};
use taut_measure::choice::Choice;
use taut_model::Scene;

/// The scene as its run starts.
pub(super) fn at_rest(
    run: &Run,
    mut scene: Scene,
    choice: Option<&Choice>,
) -> Result<Scene, StepError> {
    match (&run.rest, choice) {
        (None | Some(Rest::Settled(false) | Rest::Followed { .. }), _) => Ok(scene),
        (Some(Rest::Raised { steps, pass }), _) => {
            let whole = scene.clone();
            for k in 1..=*steps {
                scene = under_part(scene, &whole, k as f64 / *steps as f64, Some(*pass))?;
            }
            settle(scene)
        }
        (Some(Rest::Crept { creep }), Some(choice)) => crept(scene, choice, *creep),
        (Some(Rest::Solved { .. }), Some(choice)) => static_equilibrium(scene, &choice.backend),
        _ => settle(scene),
    }
}

/// The scene at rest under a part of the `whole` one's loads, by passes of so many seconds if there are any.
pub(super) fn under_part(
    mut scene: Scene,
    whole: &Scene,
    part: f64,
    pass: Option<f64>,
) -> Result<Scene, StepError> {
    let (bodies, whole) = (&mut scene.bodies, &whole.bodies);
    bodies.force = whole.force.iter().map(|force| force * part).collect();
    bodies.torque = whole.torque.iter().map(|torque| torque * part).collect();
    match pass {
        Some(dt) => relax(scene, dt),
        None => settle(scene),
    }
}

/// The scene brought to rest by `choice` alone: implicit steps of `dt` (s) from rest, each a Newton pass that leaves
/// 1/(1 + ω²Δt²) of a mode ω, from the unstrained pose. Ten times the slowest mode's 1/ω is enough; longer ones turn
/// the rounding of the forces into motion.
fn crept(scene: Scene, choice: &Choice, dt: f64) -> Result<Scene, StepError> {
    // Passes, and what they divide the time step by.
    const PASSES: [(usize, f64); 2] = [(10, 1.0), (20, 10.0)];
    let mut scene = scene;
    for (passes, divisor) in PASSES {
        let options = StepOptions {
            scheme: Scheme::LinearlyImplicit,
            stiffness: GeometricStiffness::inertia(1.0),
            ..choice.plain_options(dt / divisor)
        };
        scene = passes_from_rest(scene, options, passes)?;
    }
    Ok(scene)
}
