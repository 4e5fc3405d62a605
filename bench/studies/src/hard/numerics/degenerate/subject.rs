//! What a typed error is about, by its fields and not by its words.

use taut_integrator::StepError;
use taut_model::SceneError;

/// The body, joint, option or other thing that an error is about; `None` of one that names nothing.
pub(super) fn of(error: &StepError) -> Option<String> {
    match error {
        StepError::InvalidOption { field, .. } => Some((*field).to_owned()),
        StepError::FormNotAccepted { backend, .. } => Some(backend.clone()),
        StepError::Scene(e) => of_scene(e),
        StepError::Solve { culprit, .. } => culprit.clone(),
        StepError::NotControllable { what, .. } => Some(what.clone()),
        StepError::NonFinite { body, .. } => Some(body.clone()),
        StepError::NoEquilibrium { limited, .. } => limited.clone(),
        _ => None,
    }
}

fn of_scene(error: &SceneError) -> Option<String> {
    match error {
        SceneError::Empty => Some("scene".to_owned()),
        SceneError::BadValue { what, .. } | SceneError::Conflict { what, .. } => Some(what.clone()),
        SceneError::TooLarge { what, .. } | SceneError::Length { what, .. } => {
            Some((*what).to_owned())
        }
        SceneError::UnknownBody { name, .. }
        | SceneError::UnknownJoint { name, .. }
        | SceneError::Duplicate { name, .. } => Some(name.clone()),
        SceneError::BothWorld { joint }
        | SceneError::SameBody { joint, .. }
        | SceneError::NoRows { joint }
        | SceneError::Axes { joint, .. } => Some(joint.clone()),
        SceneError::Inertia { body } => Some(body.clone()),
        _ => None,
    }
}
