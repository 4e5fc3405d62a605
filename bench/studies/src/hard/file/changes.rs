//! Changes of a scene while it is run.

use super::Run;
use nalgebra::Vector3;
use taut_integrator::Stepper;
use taut_model::{Constraint, Distance, Frame, RowLaw, Scene};
use taut_output::check::ExperimentError;

/// Name of what ties two bodies.
const TIE: &str = "tie";

/// Changes the scene before a step; what ties bodies is let go first.
pub(super) fn change(run: &Run, stepper: &mut Stepper, step: usize) -> Result<(), ExperimentError> {
    let due = run.change.iter();
    for change in due.filter(|change| change.step == 0 || change.step == step) {
        let scene = stepper.scene();
        let is_tied = scene.constraint_names.iter().any(|name| name == TIE);
        let tie = change.tie.as_ref().map(|[a, b]| tie(scene, a, b));
        let tie = tie.transpose()?;
        stepper.change(|edit| {
            let gone = change.remove.as_deref();
            for name in gone.into_iter().chain(is_tied.then_some(TIE)) {
                edit.remove_constraint(edit.constraint(name)?)?;
            }
            if let Some((cable, joint)) = &change.cut {
                edit.cut(cable, *joint)?;
            }
            if let Some(tie) = tie {
                edit.add_constraint(TIE, tie, 0);
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// A rigid link of two bodies as far apart as they are.
fn tie(scene: &Scene, a: &str, b: &str) -> Result<Constraint, ExperimentError> {
    let bodies = [scene.body(a)?, scene.body(b)?];
    let [one, other] = bodies.map(|body| scene.bodies.position[body]);
    Ok(Constraint::Distance(Distance {
        frames: bodies.map(|body| Frame::body(body, Vector3::zeros())),
        length: (other - one).norm(),
        law: RowLaw::RIGID,
        transverse: false,
    }))
}
