//! Steps and parts of scenes for the tests of all modules.

use crate::{StepOptions, Stepper};
use nalgebra::Vector3;
use taut_model::{Constraint, Frame, MasslessCable, Scene, Winch};

impl StepOptions {
    /// These options with a change.
    pub(crate) fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

impl Stepper {
    /// So many steps.
    #[track_caller]
    pub(crate) fn steps(&mut self, count: usize) {
        for n in 0..count {
            if let Err(e) = self.step() {
                panic!("step {n} of {count}: {e}");
            }
        }
    }
}

/// The centre of a body.
pub(crate) fn centre(body: usize) -> Frame {
    Frame::body(body, Vector3::zeros())
}

/// A winch of this speed (m/s) that nothing limits.
pub(crate) fn winch(speed: f64) -> Winch {
    Winch {
        speed,
        ..Winch::new()
    }
}

/// The massless cable of that number.
pub(crate) fn cable(scene: &Scene, number: usize) -> &MasslessCable {
    match &scene.constraints[number] {
        Constraint::MasslessCable(cable) => cable,
        other => panic!("{other:?} is no cable"),
    }
}

/// The world's origin.
pub(crate) fn origin() -> Frame {
    Frame::world(Vector3::zeros())
}
