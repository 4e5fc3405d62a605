//! State at the beginning of a step that a flag may stop ([`Stepper::stop_by`]).
//!
//! A stopped step is taken back to its beginning by restoring this state as a saved run is restored. The run then goes on,
//! here or from a file, with the bits that it would have had without the stop.

use super::{SavedRun, refill};
use crate::run::Stepper;
use crate::{StepError, StepOptions};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use taut_model::collide::Shape;
use taut_model::{Bodies, Constraint, Scene};

/// Copies of everything that a step changes. Their buffers stay from step to step.
#[derive(Debug)]
pub(crate) struct Beginning {
    /// The run; of its scene the bodies and constraints only, without its options and its observations of rest.
    run: SavedRun,
    /// False while the tension in `run` means nothing.
    tension_known: bool,
    /// Shapes of the scene's colliders.
    shapes: Vec<Shape>,
}

impl Default for Beginning {
    fn default() -> Self {
        Self {
            run: SavedRun::empty(Scene::default(), StepOptions::default()),
            tension_known: false,
            shapes: Vec::new(),
        }
    }
}

impl Beginning {
    /// Takes the present state. Allocates only where there is more of something than before.
    pub(crate) fn keep(&mut self, stepper: &Stepper) {
        self.tension_known = stepper.step.multipliers.tension_known;
        stepper.fill(&mut self.run);
        let scene = &stepper.step.scene;
        copy_bodies(&mut self.run.scene.bodies, &scene.bodies);
        copy_constraints(&mut self.run.scene.constraints, &scene.constraints);
        refill(&mut self.shapes, scene.colliders.iter().map(|c| c.shape));
    }

    /// The run at the beginning of the step in which `stepper` is.
    fn run(&self, stepper: &Stepper) -> SavedRun {
        let mut run = self.run.clone();
        run.options = stepper.step.options.clone();
        run.scene = Scene {
            bodies: run.scene.bodies,
            constraints: run.scene.constraints,
            ..stepper.step.scene.clone()
        };
        for (collider, shape) in run.scene.colliders.iter_mut().zip(&self.shapes) {
            collider.shape = *shape;
        }
        if !self.tension_known {
            run.tension = None;
        }
        // A step observes rest once it is done.
        run.watch = stepper.rest.as_ref().map(|rest| rest.watch.clone());
        run
    }
}

impl Stepper {
    /// Ends steps early while `stop` is true. Another thread or a signal handler may set it: the
    /// step in progress then fails with [`StepError::Stopped`], and the run is where that step
    /// began. The step looks at the flag between sub-steps, Newton passes and dense problems of
    /// contacts. The flag stays through [`change`](Self::change) and
    /// [`set_options`](Self::set_options). Saved runs do not hold it. From now on each step copies
    /// the state that it begins with.
    pub fn stop_by(&mut self, stop: Arc<AtomicBool>) {
        self.step.effort.stop_by(stop);
        self.beginning.get_or_insert_default();
        self.share_stop();
    }

    /// Takes a stopped step back to its beginning; false where none is kept.
    ///
    /// # Errors
    /// [`StepError::Scene`] and [`StepError::Saved`] where the numbers of that state are not finite.
    pub(crate) fn return_to_beginning(&mut self) -> Result<bool, StepError> {
        let Some(beginning) = self.beginning.take() else {
            return Ok(false);
        };
        let run = beginning.run(self);
        self.beginning = Some(beginning);
        let mut begun = self.rebuilt(run)?;
        begun.ids = std::mem::replace(&mut self.ids, begun.ids);
        begun.step.output.sample = self.step.output.sample.take();
        self.go_on_as(begun);
        Ok(true)
    }
}

fn copy_bodies(to: &mut Bodies, from: &Bodies) {
    let Bodies {
        mobility,
        position,
        orientation,
        velocity,
        angular_velocity,
        mass,
        inertia,
        force,
        torque,
    } = from;
    to.mobility.clone_from(mobility);
    to.position.clone_from(position);
    to.orientation.clone_from(orientation);
    to.velocity.clone_from(velocity);
    to.angular_velocity.clone_from(angular_velocity);
    to.mass.clone_from(mass);
    to.inertia.clone_from(inertia);
    to.force.clone_from(force);
    to.torque.clone_from(torque);
}

fn copy_constraints(to: &mut Vec<Constraint>, from: &[Constraint]) {
    if to.len() != from.len() {
        to.clear();
        to.extend_from_slice(from);
        return;
    }
    for (to, from) in to.iter_mut().zip(from) {
        match (to, from) {
            // The only kind with vectors.
            (Constraint::MasslessCable(to), Constraint::MasslessCable(from)) => {
                to.frames.clone_from(&from.frames);
                to.sheaves.clone_from(&from.sheaves);
                to.length = from.length;
                to.law = from.law;
                to.tension_only = from.tension_only;
                to.winch = from.winch;
            }
            (to, from) => *to = from.clone(),
        }
    }
}

#[cfg(test)]
mod tests;
