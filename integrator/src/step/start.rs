//! The start of a run: velocities that the rows allow, multipliers for the geometric stiffness, and velocities half a step back
//! for the schemes that keep them there.
//!
//! **Velocities that rows do not allow.** A row that is rigid in the step's eyes, with r = J v + ∂φ/∂t ≠ 0 at the start, would
//! end the first step with r⁺ = (q − s)/p r = −1.5 r: a scheme of second order looks back at rates from before the row was there. What
//! moves against rods when a run starts has struck them: it ends in a blow without restitution, before the first step,
//!
//! ```text
//! (J M⁻¹ Jᵀ + Σ) μ = −r,    v ← v + M⁻¹ Jᵀ μ,    Σ = Ω_c² ε/Δt²
//! ```
//!
//! which leaves a mode of the frequency Ω/Δt the part Ω_c²/(Ω² + Ω_c²) of its rate: the blow of a rod, the swing of a spring that
//! the step resolves. Rows with bounds take no part: they close as ropes and stops do ([`crate::activation`]). Nor do cables of
//! segments, in which waves begin so. The first step of the linearly implicit scheme, r⁺ = −φ/Δt, is such a blow.

use super::Step;
use crate::StepError;
use crate::active_set::response_of_row;
use crate::contact::rebound::slowest;
use crate::system_data::SystemData;
use nalgebra::Vector3;
use taut_model::Scene;

/// Ω_c. The first step turns the rate of a spring into −1.5 of it at most, and into less than it was where Ω < 3.2; with 9 or less
/// no spring leaves the first step faster than it came.
const RIGID: f64 = 9.0;

/// Part of the first step whose ∂φ/∂t counts as that of the beginning: over the whole step a support that speeds up is half a
/// step ahead.
const INSTANT: f64 = 1e-3;

impl Step {
    /// Before the first step of a body: the multipliers of the geometric stiffness, and its velocity half a step back for the
    /// schemes that keep it there, v_0 − (Δt/2) a_0.
    pub(super) fn start_bodies(&mut self) -> Result<(), StepError> {
        // Contacts at rest alone: a blow's acceleration does not belong to the motion before it. Between divided steps half kicks
        // are added and taken back alike.
        let is_first = self.guarded.division.parts == 1 && !self.guarded.division.goes_on;
        (self.contacts.begins, self.activation.begins) = (true, is_first);
        let done = self.take_halves_back();
        (self.contacts.begins, self.activation.begins) = (false, false);
        done
    }

    fn take_halves_back(&mut self) -> Result<(), StepError> {
        self.find_tension()?;
        if self.options.scheme.is_staggered() {
            self.keep_substep_start();
            self.solve_scheme(self.options.stiffness)?;
            if self.can_strike() {
                self.take_impulses_out();
                // What a jump of a drive leaves behind touches no more.
                self.contacts.touches.retain(|touch| touch.impulse[0] > 0.0);
                self.leave_blows();
                self.solve_linearized(self.substep())?;
            }
            self.system_data
                .update_velocity_change(&self.multipliers.mu);
            if self.progress.started {
                let fresh = std::mem::take(&mut self.progress.newly_added);
                self.take_half_back(fresh.into_iter(), 1.0);
                // Bodies and rows from before go on as if nothing had been solved.
                let (mu, tension) = (&mut self.multipliers.mu, &mut self.multipliers.tension);
                self.multipliers.mu_dt =
                    self.guarded.substep_start.restore_multipliers(mu, tension);
                if self.uses.contacts {
                    self.guarded
                        .substep_start
                        .restore_contacts(&mut self.contacts);
                }
            } else {
                self.take_half_back(0..self.scene.bodies.len(), 1.0);
                self.guarded.division.from_start = true;
                self.guarded.division.work_of_start = self.account_for_half(1.0);
            }
        }
        self.progress.newly_added.clear();
        self.progress.stage = super::Stage::Unsolved;
        self.progress.started = true;
        Ok(())
    }

    /// True if rows may strike bodies: those with bounds, and motors.
    pub(super) fn can_strike(&self) -> bool {
        !self.active_set.is_empty() || self.system_data.holds_speeds()
    }

    /// Rows of the prepared system leave blows to the step that they fall in, since half a kick is of forces; those at their limits
    /// have a force.
    pub(super) fn leave_blows(&mut self) {
        let (dt, system_data) = (self.substep(), &mut self.system_data);
        let jv = &mut self.system.in_rows[0];
        system_data.rows.times_jacobian(&system_data.v, jv);
        system_data.leave_speeds(|k| self.active_set.holds(k));
        let rates = (&**jv, &*self.history.rate_now, &*self.history.rate);
        let leaves = |k| !self.slip.holds(k) && !self.active_set.holds(k);
        self.activation.leave_rates(system_data, rates, dt, leaves);
    }

    /// Velocities of the bodies v − `sign` Δv/2: half a step back, or ahead where the sign is −1.
    pub(crate) fn take_half_back(&mut self, numbers: impl Iterator<Item = usize>, sign: f64) {
        self.add_velocity_change(numbers, -0.5 * sign);
    }

    /// Velocities of the bodies v + `part` Δv.
    fn add_velocity_change(&mut self, numbers: impl Iterator<Item = usize>, part: f64) {
        let bodies = &mut self.scene.bodies;
        for i in numbers {
            let [x, y, z, p, q, r] = self.system_data.dv.get(i);
            bodies.velocity[i] += Vector3::new(x, y, z) * part;
            bodies.angular_velocity[i] += Vector3::new(p, q, r) * part;
        }
    }

    /// The blow of rigid rows at the velocities of the start, where these rows are faster than the slowest blow of contacts.
    pub(super) fn strike_rigid_rows(&mut self) -> Result<(), StepError> {
        let dt = self.substep();
        let system_data = &mut self.system_data;
        system_data.load_velocities(&self.scene.bodies);
        let jv = &mut self.system.in_rows[0];
        system_data.rows.times_jacobian(&system_data.v, jv);
        system_data
            .rows
            .drive(&self.scene, self.time, self.time + INSTANT * dt);
        for (rate, phi_t) in jv.iter_mut().zip(&system_data.rows.phi_t[..]) {
            *rate += phi_t;
        }
        let least = slowest(&self.scene, dt);
        if !jv.iter().any(|rate| rate.abs() > least) {
            return Ok(());
        }
        system_data.geometric.clear();
        self.update_inertia(dt, 0.0)?;
        let (scene, rate) = (&self.scene, &self.system.in_rows[0]);
        if !prepare_blow(scene, &mut self.system_data, rate, least, dt) {
            return Ok(());
        }
        self.multipliers.mu.fill(0.0);
        self.assemble(dt);
        self.system
            .solver
            .factorize(&self.system.matrix)
            .map_err(|e| self.culprit(e))?;
        // The estimate of the error samples solves of steps.
        let sample = self.output.sample.take();
        let solved = self.solve_assembled();
        self.output.sample = sample;
        solved?;
        self.system_data
            .update_velocity_change(&self.multipliers.mu);
        self.add_velocity_change(0..self.scene.bodies.len(), 1.0);
        // What is known belongs to the velocities of before.
        self.multipliers.mu.fill(0.0);
        (self.multipliers.tension_known, self.history.known) = (false, false);
        self.activation.forget();
        for k in 0..self.system_data.rows.bounds.len() {
            self.active_set.start(k, &self.system_data);
        }
        Ok(())
    }
}

/// Σ and right-hand side of the blow at the rates `rate` of the rows; false where no rigid row is faster than `least`.
fn prepare_blow(
    scene: &Scene,
    system_data: &mut SystemData,
    rate: &[f64],
    least: f64,
    dt: f64,
) -> bool {
    let (mut strikes, mut takes_part) = (false, vec![true; rate.len()]);
    for joint in scene.cables.iter().flat_map(|cable| &cable.joints) {
        takes_part[system_data.rows.row_range(*joint)].fill(false);
    }
    for bound in &system_data.rows.bounds {
        takes_part[bound.row] = false;
    }
    system_data.inertia.impulse.clear();
    for c in 0..system_data.rows.constraints() {
        for r in system_data.rows.row_range(c) {
            let response = response_of_row(system_data, c, r);
            let (sigma, wanted) = if !takes_part[r] || system_data.is_transverse(r) {
                (response.max(f64::MIN_POSITIVE) / f64::EPSILON, 0.0)
            } else if system_data.is_speed(r) {
                (0.0, -rate[r])
            } else {
                let sigma = RIGID * RIGID * system_data.rows.compliance[r] / (dt * dt);
                strikes |= rate[r].abs() * response > least * (response + sigma);
                (sigma, -rate[r])
            };
            system_data.regularization.sigma[r] = sigma;
            system_data.rate[r] = wanted;
        }
    }
    strikes
}

#[cfg(test)]
mod tests;
