//! How scenes come to rest before a run.

use super::{Rest, Run};
use crate::paper::specimens::{passes_from_rest, relax, settle};
use taut_ground::choice::Choice;
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions};
use taut_model::Scene;

/// The scene as its run starts.
pub(super) fn at_rest(
    run: &Run,
    mut scene: Scene,
    choice: Option<&Choice>,
) -> Result<Scene, StepError> {
    match (&run.rest, choice) {
        (None | Some(Rest::Settled(false)), _) => Ok(scene),
        (Some(Rest::Raised { steps, pass }), _) => {
            let whole = scene.bodies.force.clone();
            for k in 1..=*steps {
                let part = k as f64 / *steps as f64;
                let forces = scene.bodies.force.iter_mut().zip(&whole);
                forces.for_each(|(force, whole)| *force = whole * part);
                scene = relax(scene, *pass)?;
            }
            settle(scene)
        }
        (Some(Rest::Crept { creep }), Some(choice)) => crept(scene, choice, *creep),
        _ => settle(scene),
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
