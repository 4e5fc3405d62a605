//! Update: velocities and positions from the impulses of a solve, and back.

use super::{Stage, Step};
use crate::history::State;
use crate::system_data::SystemData;
use crate::{StepError, motion};
use taut_solver::SolveError;

impl Step {
    /// The second half of a sub-step, which leaves the windings of twist rows, so that it can be taken back.
    pub(crate) fn update(&mut self) -> Result<(), StepError> {
        if self.progress.stage != Stage::Solved {
            let source = SolveError::OutOfOrder {
                called: "advance",
                needs: "solve",
            };
            return Err(self.culprit(source));
        }
        self.progress.stage = Stage::Unsolved;
        self.progress.started = true;
        let dt = self.substep();
        self.system_data
            .update_velocity_change(&self.multipliers.mu);
        self.system_data.predict(dt);
        self.history
            .accept(&self.system_data.v, &self.system_data.rows.phi_t);
        self.time += dt;
        self.move_bodies(dt)?;
        self.slip.move_lengths(&mut self.scene, dt, self.time);
        self.progress.stage = Stage::Advanced {
            dt,
            implicit: false,
        };
        self.system_data.rows.update_state(&self.scene, self.time);
        Ok(())
    }

    /// v⁺ = v + Δv from `system_data`, then positions, over `dt`.
    pub(crate) fn move_bodies(&mut self, dt: f64) -> Result<(), StepError> {
        let SystemData { inertia, v, dv, .. } = &self.system_data;
        let bodies = &mut self.scene.bodies;
        motion::move_bodies(bodies, &inertia.rods, &inertia.others, v, dv, dt)
            .map_err(|i| self.not_finite(i))
    }

    /// Takes back what [`update`](Self::update) did since `saved`.
    pub(crate) fn go_back(&mut self, saved: &State) {
        self.time = saved.restore(&mut self.scene.bodies);
        saved.restore_lengths(&mut self.scene);
        saved.restore_contacts(&mut self.contacts);
        self.multipliers.mu_dt =
            saved.restore_multipliers(&mut self.multipliers.mu, &mut self.multipliers.tension);
        self.progress.stage = Stage::Unsolved;
        self.system_data.rows.update_state(&self.scene, self.time);
    }
}
