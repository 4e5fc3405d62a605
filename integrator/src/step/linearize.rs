//! Linearisation: velocities, M̃ with the geometric stiffness, Σ and c of the scheme, at the present state.

use super::{Stage, Step, divided, winch_cuts};
use crate::contact::rebound::slowest;
use crate::options::Excess;
use crate::regularization::Known;
use crate::system_data::SystemData;
use crate::{GeometricStiffness, Phase, StepError, geometric};

impl Step {
    /// M̃, Δt f, Σ and c of the scheme at the present state.
    pub(crate) fn linearize(&mut self, stiffness: GeometricStiffness) -> Result<(), StepError> {
        self.note_stage();
        self.progress.stage = Stage::Unsolved;
        let dt = self.substep();
        if self.uses.contacts {
            self.find_contacts(dt, true)?;
        }
        if self.uses.slip {
            self.slip.update_ratios(&self.scene);
        }
        let (system_data, history) = (&mut self.system_data, &mut self.history);
        system_data.load_velocities(&self.scene.bodies);
        let jv = &mut self.system.in_rows[0];
        system_data.rows.times_jacobian(&system_data.v, jv);
        if !history.known {
            history.take_rates(jv);
            history.v.copy_from(&system_data.v);
        }
        let gamma = self.options.scheme.weights().history();
        match stiffness {
            GeometricStiffness::Off => system_data.geometric.clear(),
            _ => {
                let excess = Excess::of(&self.options.row_weights(stiffness));
                let tension = &self.multipliers.tension;
                system_data
                    .geometric
                    .update(&system_data.rows, tension, Some(excess));
            }
        }
        if self.uses.contacts && stiffness != GeometricStiffness::Off {
            self.contacts
                .stiffen(&self.scene, &mut system_data.geometric);
        }
        let (now, before) = (&system_data.v, &history.v);
        geometric::drive(stiffness, gamma, now, before, &mut system_data.drive);
        self.update_inertia(dt, stiffness.alpha())?;
        self.regularize(stiffness, dt);
        self.tally.end(Phase::Linearize);
        Ok(())
    }

    /// Σ and c of the scheme for a step `dt` long; `in_rows` begin with the rates J v, and M̃ is that of the step.
    fn regularize(&mut self, stiffness: GeometricStiffness, dt: f64) {
        let (system_data, history) = (&mut self.system_data, &mut self.history);
        let jv = &self.system.in_rows[0];
        let weights = self.options.row_weights(stiffness);
        system_data.weigh(&weights);
        // The driven part of r_n is that of the step that led here.
        let rates = (&**jv, &*history.phi_t);
        system_data
            .rows
            .drive(&self.scene, self.time, self.time + dt);
        if self.uses.winches {
            winch_cuts::leave_room(
                &mut self.active_set,
                &self.scene,
                system_data,
                [self.time, self.time + dt],
            );
        }
        if self.uses.bounds {
            // The last drives of cables that slip hold their slip.
            let jerk = match self.uses.slip {
                true => f64::INFINITY,
                false => divided::LEAST * slowest(&self.scene, dt),
            };
            self.activation
                .weigh(system_data, &weights, rates, jerk, &self.active_set, dt);
            self.slip.forget();
        }
        let stiff = stiffness != GeometricStiffness::Off;
        system_data.soften_transverse_rows(&self.multipliers.tension, stiff);
        let past = Known::Past {
            phi_t: &history.phi_t,
            before: &history.rate,
            now: &mut history.rate_now,
        };
        system_data.regularize(dt, jv, past);
        if self.uses.bounds {
            self.activation
                .round_kinks(system_data, &history.rate_now, dt);
            self.activation.begin(&system_data.rows);
            self.activation.damp_from_taut(system_data, dt);
        }
        system_data.follow_curves(&self.scene, jv, (self.time, dt));
        if self.guarded.division.parts > 1 {
            self.activation.leave_drift(system_data, dt);
            self.activation
                .return_slowly(system_data, &self.multipliers.tension, dt);
        }
    }

    pub(crate) fn update_inertia(&mut self, dt: f64, alpha: f64) -> Result<(), StepError> {
        let SystemData {
            inertia,
            geometric,
            drive,
            ..
        } = &mut self.system_data;
        inertia
            .update(&self.scene, dt, geometric.stiffness(), alpha, drive)
            .map_err(|i| self.not_finite(i))
    }
}
