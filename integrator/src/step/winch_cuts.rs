//! Cables of segments at their winches: what a step does with the first segment.
//!
//! A step sees the speed of a winch as ∂φ/∂t of the row along its cable ([`taut_model::Fairlead`]). When it stands, the first
//! segment is cut to the length that is off the drum, and after it splits or merges where that is due
//! ([`taut_model::scene::winding`]). A drum that slips pays out as that of a massless cable does. What a winch feeds takes its
//! energy along, so that the energy balance begins anew with each cut.

use super::Step;
use crate::StepError;
use crate::active_set::ActiveSet;
use crate::system_data::SystemData;
use taut_model::{Constraint, Scene};

/// Largest part of a whole segment that a winch feeds in a step: the first one is at least twice as long.
const FASTEST: f64 = 0.25;

/// Cables with winches, by their constraints.
pub(crate) struct Winches {
    /// Constraints where cables of segments leave their winches.
    pub(crate) fairleads: Vec<usize>,
    /// Constraints of cables with winches, massless and of segments.
    pub(super) all: Vec<usize>,
}

impl Winches {
    pub(super) fn new(scene: &Scene) -> Self {
        let has_winch = |i: &usize| scene.constraints[*i].winch().is_some();
        Self {
            fairleads: scene.fairleads().collect(),
            all: (0..scene.constraints.len()).filter(has_winch).collect(),
        }
    }
}

impl Step {
    /// Drums that slipped have paid out; true if one did.
    pub(super) fn pay_out(&mut self) -> bool {
        let (mut slipped, rows) = (false, &self.system_data.rows);
        let dt = self.progress.stage.advanced();
        for k in self.active_set.at_lower() {
            let bound = rows.bounds[k];
            let constraint = &mut self.scene.constraints[bound.constraint];
            if let Constraint::MasslessCable(cable) = constraint {
                let spring = self.activation.spring_of_limit(rows, k, dt);
                let paid = cable.settle(rows.phi[bound.row], spring, self.time);
                // Its work is that of the rope at rest: what strains it is the rope's.
                let force = self.multipliers.mu[bound.row] / dt;
                self.output
                    .account
                    .give(bound.row, paid, force, self.progress.stage);
                // The step took the cable to be as long as the winch alone would have it.
                self.history.phi_t[bound.row] -= paid / dt;
                slipped |= paid > 0.0;
            }
        }
        for bound in self.active_set.emptied().map(|k| rows.bounds[k]) {
            let constraint = &mut self.scene.constraints[bound.constraint];
            if let Constraint::MasslessCable(cable) = constraint {
                slipped |= cable.run_out(self.time);
            }
        }
        slipped
    }

    /// Winches have wound in and out until now; true if one stalls or comes free.
    pub(super) fn follow_winches(&mut self) -> bool {
        // A drum that stalls has fed its cable until now.
        self.cut_at_winches(true);
        let mut stalled = false;
        for n in 0..self.winches.all.len() {
            stalled |= self.stall(self.winches.all[n]);
        }
        if stalled {
            self.system_data.rows.update_state(&self.scene, self.time);
        }
        stalled
    }

    /// No winch feeds more in a step than its first segment can lose.
    pub(crate) fn check_winches(&self) -> Result<(), StepError> {
        for &i in &self.winches.fairleads {
            let Constraint::Fairlead(lead) = &self.scene.constraints[i] else {
                continue;
            };
            let fed = lead.winch.speed.abs() * self.options.dt;
            if !lead.winch.brake && fed > FASTEST * lead.segment {
                return Err(StepError::NotControllable {
                    what: format!("the winch at `{}`", self.scene.constraint_names[i]),
                    reason: "feeds more than a quarter of a segment in a step: make it slower, the time step smaller, or \
                             the segments longer",
                });
            }
        }
        Ok(())
    }

    /// First segments are as long as the present state has them, with what slipping drums have paid out if `pays`.
    pub(super) fn cut_at_winches(&mut self, pays: bool) {
        let mut cut = false;
        for n in 0..self.winches.fairleads.len() {
            let i = self.winches.fairleads[n];
            let paid = if pays { self.paid_out(i) } else { 0.0 };
            if self.scene.cut_at_winch(i, self.time, paid)
                && let Some(body) = self.scene.constraints[i].frames()[1].body_index()
            {
                self.system_data.inertia.renew(&self.scene.bodies, body);
                if let Some(cable) = self.scene.cable_at(i) {
                    let joints = &self.scene.cables[cable].joints;
                    let first = &joints[..joints.len().min(2)];
                    self.system_data.renew(&self.scene, first);
                }
                cut = true;
            }
        }
        if cut {
            self.system_data.rows.update(&self.scene, self.time);
            self.output.account.close();
        }
    }

    /// Stalls winch `i` at its empty drum, or lets it haul in again, by the tension of the last step. Returns true on a change.
    pub(super) fn stall(&mut self, i: usize) -> bool {
        let row = self.system_data.rows.row_range(i).start;
        let (tension, time) = (
            -self.multipliers.mu[row] / self.multipliers.mu_dt,
            self.time,
        );
        self.scene.constraints[i].stall(tension, time)
    }

    /// Rope that the slipping drum of fairlead `i` has paid out in the last sub-step \[m]; takes it
    /// out of the drive ∂φ/∂t.
    fn paid_out(&mut self, i: usize) -> f64 {
        let rows = &self.system_data.rows;
        let mut slipping = self.active_set.at_lower();
        let Some(k) = slipping.find(|k| rows.bounds[*k].constraint == i) else {
            return 0.0;
        };
        let Constraint::Fairlead(lead) = &self.scene.constraints[i] else {
            return 0.0;
        };
        let (row, dt) = (rows.bounds[k].row, self.progress.stage.advanced());
        let spring = self.activation.spring_of_limit(rows, k, dt);
        let paid = lead.paid_out(rows.phi[row], spring, self.time);
        self.history.phi_t[row] -= paid / dt;
        paid
    }
}

/// Takes the rope left on the drums of massless cables at the end of a step from `begin` to `end` (s). A drum that another solve of
/// the present state has emptied has its bound back.
pub(super) fn leave_room(
    bounded: &mut ActiveSet,
    scene: &Scene,
    system_data: &mut SystemData,
    [begin, end]: [f64; 2],
) {
    bounded.forget_room();
    for (k, bound) in system_data.rows.bounds.iter_mut().enumerate() {
        let Constraint::MasslessCable(cable) = &scene.constraints[bound.constraint] else {
            continue;
        };
        if let Some(winch) = cable.winch.filter(|w| w.longest < f64::INFINITY) {
            bounded.leave_room(k, (winch.longest - cable.length_at(end)).max(0.0));
            if bound.lower == f64::NEG_INFINITY {
                let bounds = scene.constraints[bound.constraint].bounds(begin);
                bound.lower = bounds.map_or(bound.lower, |(_, lower, _)| lower);
            }
        }
    }
}

#[cfg(test)]
mod tests;
