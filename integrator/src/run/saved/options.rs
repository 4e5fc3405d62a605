//! Other options for a run that goes on: another solver, scheme, time step.
//!
//! Positions, velocities, multipliers and what touches are carried over. Where the scheme or the length of sub-steps changes and
//! the old scheme keeps velocities half a step behind the positions, they are first brought forward,
//!
//! ```text
//! v_n = v_{n−½} + ½ Δv
//! ```
//!
//! with the change Δv that the old scheme finds for the present state, blows of contacts left out. The new scheme starts from
//! there as from the beginning of a run.

use super::SavedRun;
use crate::run::Stepper;
use crate::{StepError, StepOptions};
use nalgebra::Vector3;
use taut_solver::{Backend, DenseOptions};

impl Stepper {
    /// Goes on from the present state with other options. Another solver changes the motion by its rounding only. The balance of
    /// energy begins anew, and a scene that sleeps wakes. Allocates; the steps after the next do not.
    ///
    /// # Errors
    /// As [`Stepper::new`] for these options, and as [`save`](Self::save). On error the stepper is unchanged.
    pub fn set_options(&mut self, options: StepOptions) -> Result<(), StepError> {
        let mut run = self.save()?;
        let kept = |o: &StepOptions| (o.scheme, o.dt, o.substeps);
        if kept(&options) != kept(&self.step.options) {
            bring_forward(&mut run)?;
            run.started = false;
            run.fresh.clear();
            run.past.known = false;
            run.advanced = 0.0;
            run.implicit = false;
        }
        run.account = Default::default();
        run.watch = None;
        let is_same = options.backend == self.step.options.backend;
        let is_estimated = options.estimate == self.step.options.estimate;
        run.options = options;
        let mut changed = if is_same {
            self.rebuilt(run)?
        } else {
            Self::restore(run)?
        };
        changed.ids = self.ids.clone();
        self.go_on_as(changed);
        self.coarse.take_if(|_| !is_estimated);
        self.outdate_coarse_run();
        Ok(())
    }
}

/// Brings the velocities of a run to the time of its positions.
fn bring_forward(run: &mut SavedRun) -> Result<(), StepError> {
    // The guard's steps leave them there.
    if !run.started || !run.options.scheme.is_staggered() || run.implicit {
        return Ok(());
    }
    let mut now = run.clone();
    now.watch = None;
    if matches!(now.options.backend, Backend::Foreign { .. }) {
        now.options.backend =
            Backend::preferred().unwrap_or(Backend::Dense(DenseOptions::default()));
    }
    let mut now = Stepper::restore(now)?;
    now.step.contacts.begins = true;
    now.step.find_tension()?;
    now.step.solve_scheme(now.step.options.stiffness)?;
    now.step
        .system_data
        .update_velocity_change(&now.step.multipliers.mu);
    let bodies = &mut run.scene.bodies;
    for i in (0..bodies.len()).filter(|i| !run.fresh.contains(i)) {
        let [x, y, z, p, q, r] = now.step.system_data.dv.get(i);
        bodies.velocity[i] += Vector3::new(x, y, z) * 0.5;
        bodies.angular_velocity[i] += Vector3::new(p, q, r) * 0.5;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
