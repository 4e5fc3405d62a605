//! Other options for a run that goes on: another solver, scheme, time step.
//!
//! Positions, velocities, multipliers and what touches are carried over. Where the scheme or the length of sub-steps
//! changes, velocities are first brought to the time of the positions, v + Δv/2 where the old scheme keeps them half a step
//! behind, and the new scheme starts from there as from the beginning of a run.

use crate::stepper::{Stage, Stepper};
use crate::{StepError, StepOptions};
use nalgebra::Vector3;
use taut_model::Bodies;

impl Stepper {
    /// Goes on from the present state with other options. With a solver of the same answers the motion stays the same bit for
    /// bit; the estimate of the error and the balance of energy begin anew. Allocates; the steps after the next do not.
    ///
    /// # Errors
    /// As [`Stepper::new`] for these options, and as [`save`](Self::save). On error the stepper is unchanged.
    pub fn set_options(&mut self, options: StepOptions) -> Result<(), StepError> {
        let mut run = self.save()?;
        let kept = |o: &StepOptions| (o.scheme, o.angular_scheme, o.dt, o.substeps);
        if kept(&options) != kept(&self.options) {
            self.bring_forward(&mut run.scene.bodies);
            run.started = false;
            run.fresh.clear();
            run.past.known = false;
            run.advanced = 0.0;
            run.implicit = false;
        }
        run.account = Default::default();
        let is_same = options.backend == self.options.backend;
        run.options = options;
        let mut changed = if is_same {
            self.rebuilt(run)?
        } else {
            Self::restore(run)?
        };
        changed.ids = self.ids.clone();
        *self = changed;
        Ok(())
    }

    /// Velocities of the bodies at the time of their positions: a staggered scheme keeps them half a step behind.
    pub(crate) fn bring_forward(&self, bodies: &mut Bodies) {
        let implicit = matches!(self.stage, Stage::Advanced { implicit: true, .. });
        if !self.started || !self.options.scheme.is_staggered() || implicit {
            return;
        }
        let is_behind = |i: &usize| !self.fresh.contains(i);
        for i in (0..bodies.len()).filter(is_behind) {
            let [x, y, z, p, q, r] = self.pieces.dv.get(i);
            bodies.velocity[i] += Vector3::new(x, y, z) * 0.5;
            bodies.angular_velocity[i] += Vector3::new(p, q, r) * 0.5;
        }
    }
}

#[cfg(test)]
mod tests;
