//! Changes of a scene before it is run, and while it is.

use super::drive::{body, numbered};
use super::text::Names;
use super::{CaseError, Run};
use nalgebra::Vector3;
use taut_integrator::Stepper;
use taut_measure::random::Random;
use taut_model::{Action, Constraint, Distance, Frame, RowLaw, Scene, Side};
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

/// Finds what the changes of a run name in its scene at the beginning.
pub(super) fn know_changes(run: &Run, scene: &Scene) -> Result<(), CaseError> {
    for change in &run.change {
        if let Some(name) = &change.remove {
            let later = scene.events.iter().flat_map(|event| &event.then);
            let later = later.filter_map(|action| match action {
                Action::Attach { name, .. } => Some(name),
                _ => None,
            });
            numbered(
                "joint or cable",
                name,
                scene.constraint_names.iter().chain(later),
            )?;
        }
        if let Some((cable, _)) = &change.cut {
            let cables = scene.cables.iter().map(|cable| &cable.name);
            numbered("cable", cable, cables)?;
        }
        for name in change.tie.iter().flatten() {
            body(scene, name)?;
        }
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

/// The scene with its bodies and its constraints in the order that its run asks for.
pub(super) fn shuffled(run: &Run, names: &Names, scene: Scene) -> Result<Scene, CaseError> {
    let seed = run.shuffle.as_ref().map(|seed| names.number(seed));
    let seed = seed.transpose()?.unwrap_or(0.0) as u64;
    if seed == 0 {
        return Ok(scene);
    }
    let mut random = Random::new(seed);
    let bodies = random.permutation(scene.bodies.len());
    let constraints = random.permutation(scene.constraints.len());
    let mut place = vec![0; bodies.len()];
    let mut new = Scene {
        gravity: scene.gravity,
        ..Scene::new(scene.name.clone())
    };
    for (now, &before) in bodies.iter().enumerate() {
        place[before] = now;
        new.add_body(scene.body_names[before].clone(), scene.bodies.get(before));
    }
    for &c in &constraints {
        let mut constraint = scene.constraints[c].clone();
        for frame in constraint.frames_mut() {
            if let Side::Body(i) = &mut frame.side {
                *i = place[*i];
            }
        }
        let name = scene.constraint_names[c].clone();
        new.add_constraint(name, constraint, scene.groups[c]);
    }
    new.load = scene.load.map(|i| place[i]);
    Ok(new)
}
