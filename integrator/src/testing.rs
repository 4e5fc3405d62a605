//! Names, steps and parts of scenes for the tests of all modules.

// What most tests name: they import all of this module.
pub(crate) use crate::*;
pub(crate) use nalgebra::{Matrix3, UnitQuaternion, Vector3};
pub(crate) use taut_model::collide::{Collider, Shape, Surface};
pub(crate) use taut_model::*;
pub(crate) use taut_solver::{Backend, DenseOptions};

/// A value with a change.
pub(crate) trait With: Sized {
    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

impl<T> With for T {}

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

    /// Steps up to a time \[s].
    #[track_caller]
    pub(crate) fn until(&mut self, time: f64) {
        while self.time() < time {
            self.steps(1);
        }
    }

    /// Adds a constraint between two steps.
    #[track_caller]
    pub(crate) fn tie(&mut self, name: &str, constraint: Constraint) {
        self.change(|edit| Ok(edit.add_constraint(name, constraint, 0)))
            .expect("a sound constraint");
    }

    /// The run that goes on from what this one saves.
    #[track_caller]
    pub(crate) fn saved(&self) -> Self {
        Self::restore(self.save().expect("a sound state")).expect("a sound run")
    }
}

/// Default options with the dense solver.
pub(crate) fn dense() -> StepOptions {
    StepOptions::default().with(|o| o.backend = Backend::Dense(DenseOptions::default()))
}

/// An empty scene under a gravity of 9.81 m/s².
pub(crate) fn on_earth(name: &str) -> Scene {
    let mut scene = Scene::new(name);
    scene.gravity.z = -9.81;
    scene
}

/// The centre of a body.
pub(crate) fn centre(body: usize) -> Frame {
    Frame::body(body, Vector3::zeros())
}

/// A winch of this speed (m/s) that nothing limits.
pub(crate) fn winch(speed: f64) -> Winch {
    Winch::new().with(|w| w.speed = speed)
}

/// A drum whose brake holds so much \[N].
pub(crate) fn brake(brake_limit: f64) -> Winch {
    Winch::new().with(|w| (w.brake, w.brake_limit) = (true, brake_limit))
}

/// A rod or spring between two frames.
pub(crate) fn link(frames: [Frame; 2], length: f64, law: RowLaw) -> Constraint {
    Constraint::Distance(Distance {
        frames,
        length,
        law,
        transverse: false,
    })
}

/// A sheave with friction.
pub(crate) fn sheave(friction: f64, radius: f64) -> Sheave {
    Sheave::new(radius).with(|p| p.friction = friction)
}

/// A cable over a sheave in the second of three frames.
pub(crate) fn over(sheave: Sheave, frames: Vec<Frame>, length: f64, law: RowLaw) -> MasslessCable {
    MasslessCable::new(frames, length, law).with(|p| p.sheaves = vec![None, Some(sheave), None])
}

/// A cable that comes from a winch, if from any.
pub(crate) fn reeled(
    winch: impl Into<Option<Winch>>,
    frames: Vec<Frame>,
    length: f64,
    law: RowLaw,
) -> MasslessCable {
    MasslessCable::new(frames, length, law).with(|p| p.winch = winch.into())
}

/// An event.
pub(crate) fn event(name: &str, when: When, then: Vec<Action>) -> Event {
    Event {
        name: name.to_owned(),
        when,
        then,
    }
}

/// Sets a control.
pub(crate) fn set(control: usize, value: f64) -> Action {
    Action::Set { control, value }
}

/// Ties two frames to each other.
pub(crate) fn attach(name: &str, between: [Frame; 2]) -> Action {
    Action::Attach {
        name: name.to_owned(),
        between: Box::new(between),
    }
}

/// A constraint carries more than this force \[N].
pub(crate) fn over_force(constraint: usize, above: f64) -> When {
    When::Force { constraint, above }
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
