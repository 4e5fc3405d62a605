//! Energies of a stepper's scene.
//!
//! A spring stores ½ ε λ² where ε λ = −φ; ½ φ²/ε of a stiff row would be that of its drift. The multipliers after a divided step
//! are means of its parts: where the row's gap at the end holds less, that counts.

use crate::active_set::{RowState, response_of_row};
use crate::gyroscopic;
use crate::step::{Stage, Step};
use nalgebra::{UnitQuaternion, Vector3};
use taut_model::RowBounds;
use taut_model::linearized::dot;

/// A body whose velocity changes by more than this in a step with a blow, over the change by its loads, is struck.
const STEADY: f64 = 1.5;

/// Energies at one instant \[J].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Energy {
    /// ½ m v² + ½ ω·Iω \[J].
    pub kinetic: f64,
    /// −m g·x, zero at the origin \[J].
    pub gravity: f64,
    /// ½ ε λ² \[J].
    pub elastic: f64,
}

impl Energy {
    /// Their sum \[J].
    #[must_use]
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravity + self.elastic
    }
}

/// A velocity and an angular velocity.
type Motion = (Vector3<f64>, Vector3<f64>);

fn halves([x, y, z, p, q, r]: [f64; 6]) -> Motion {
    (Vector3::new(x, y, z), Vector3::new(p, q, r))
}

impl Step {
    /// See [`Stepper::energy`](crate::Stepper::energy).
    pub(crate) fn energy(&self) -> Energy {
        let bodies = &self.scene.bodies;
        // The forces of an implicit step are those at its end.
        let dt = match self.progress.stage {
            Stage::Advanced {
                dt,
                implicit: false,
            } => dt,
            _ => 0.0,
        };
        let (known, _) = self.contacts.known();
        let strikes = dt > 0.0 && known.iter().any(|contact| contact.struck);
        // By the means of the velocities, and as before a blow.
        let (mut mean, mut before) = (Energy::default(), Energy::default());
        for i in self.scene.dynamic_bodies() {
            let (inertia, end) = (&bodies.inertia[i], &bodies.orientation[i]);
            let add =
                |to: &mut Energy, position, (v, w): Motion, orientation: UnitQuaternion<f64>| {
                    let y = orientation.inverse() * w;
                    let spin = y.dot(&(inertia * y));
                    to.kinetic += 0.5 * (bodies.mass[i] * v.norm_squared() + spin);
                    to.gravity -= bodies.mass[i] * self.scene.gravity.dot(&position);
                };
            let mut motion = (bodies.velocity[i], bodies.angular_velocity[i]);
            let position = bodies.position[i] - motion.0 * dt;
            let orientation = gyroscopic::turned_back(inertia, end, &motion.1, dt);
            let (v, spin) = halves(self.system_data.v.get(i));
            let (dv, change) = halves(self.system_data.dv.get(i));
            if dt > 0.0 {
                motion = (v + dv * 0.5, spin + change * 0.5);
            }
            add(&mut mean, position, motion, orientation);
            let loads = (self.scene.gravity + bodies.force[i] / bodies.mass[i]) * dt;
            if strikes && (dv - loads).norm() > STEADY * loads.norm() {
                let position = bodies.position[i] - (v + dv) * dt;
                let begun = gyroscopic::turned_from(inertia, end, &(spin + change), dt);
                add(&mut before, position, (v + loads * 0.5, spin), begun);
            } else if strikes {
                add(&mut before, position, motion, orientation);
            }
        }
        // Where joints pass a blow on to light bodies, the mean of their velocities is none that they have.
        let energy = match strikes && before.kinetic < mean.kinetic {
            true => before,
            false => mean,
        };
        Energy {
            elastic: self.elastic_energy(),
            ..energy
        }
    }

    /// See [`Stepper::elastic_energy`](crate::Stepper::elastic_energy).
    pub(crate) fn elastic_energy(&self) -> f64 {
        let rows = &self.system_data.rows;
        let is_mean = matches!(self.progress.stage, Stage::Advanced { implicit: true, .. });
        let stored = |r: usize| {
            let (compliance, lambda) = (
                rows.compliance[r],
                self.multipliers.mu[r] / self.multipliers.mu_dt,
            );
            let by_force = compliance * lambda.powi(2);
            match is_mean {
                true => by_force.min(rows.phi[r].powi(2) / compliance),
                false => by_force,
            }
        };
        // Transverse rows are a filter, not a spring. Rigid ones store nothing: 0 λ² would be NaN where λ² overflows.
        let stores = |r: &usize| rows.compliance[*r] > 0.0 && !self.system_data.is_transverse(*r);
        let is_slack =
            |b: &&RowBounds| is_mean && stores(&b.row) && b.side() * rows.phi[b.row] < 0.0;
        let slack = rows.bounds.iter().filter(is_slack);
        let all: f64 = (0..self.multipliers.mu.len())
            .filter(stores)
            .map(stored)
            .sum();
        0.5 * (all - slack.map(|b| stored(b.row)).sum::<f64>())
    }

    /// Elastic energy of row `row` of a constraint, at most ½ φ²/ε: damping adds to λ, but stores nothing \[J].
    pub(crate) fn stored(&self, constraint: usize, row: usize) -> f64 {
        let rows = &self.system_data.rows;
        let compliance = rows.compliance[row];
        if compliance == 0.0 {
            return 0.0;
        }
        let phi = rows.phi[row];
        let stretch = match self.stretch_at_limit(row) {
            Some(begun) => begun,
            None => self.stretch(constraint, row).abs().min(phi.abs()),
        };
        0.5 * stretch * stretch / compliance
    }

    /// φ of a damped rope whose drum slips, at the time that energies belong to \[m]: its spring does not follow the limit of the force.
    fn stretch_at_limit(&self, row: usize) -> Option<f64> {
        let rows = &self.system_data.rows;
        let slips = |k: usize| {
            let winch = self.scene.constraints[rows.bounds[k].constraint].winch();
            self.active_set.place(k) == RowState::Lower && winch.is_some()
        };
        let bounded = rows.bounds.binary_search_by_key(&row, |bound| bound.row);
        let k = bounded
            .ok()
            .filter(|k| rows.damping[row] > 0.0 && slips(*k))?;
        let phi = match self.progress.stage {
            Stage::Advanced { implicit: true, .. } => rows.phi[row],
            _ => self.activation.begun(k),
        };
        Some(phi.max(0.0))
    }

    /// ε λ + τ r⁺ = −φ of row `row` of a constraint \[m], its force without that of the damper, which a row at a bound does not have.
    /// ½ φ²/ε of a stiff row would be that of its drift, which its damper takes back: the part ε/(ε + Δt² J M̃⁻¹ Jᵀ) of τ r⁺ counts, that
    /// of a row which the step resolves.
    pub(crate) fn stretch(&self, constraint: usize, row: usize) -> f64 {
        let rows = &self.system_data.rows;
        let by_force = rows.compliance[row] * (self.multipliers.mu[row] / self.multipliers.mu_dt);
        let is_at_bound = || {
            let bounded = rows.bounds.binary_search_by_key(&row, |bound| bound.row);
            bounded.is_ok_and(|k| self.active_set.place(k) != RowState::Inside)
        };
        if rows.damping[row] == 0.0 || is_at_bound() {
            return by_force;
        }
        let first = rows.row_range(constraint).start;
        let rate = |s: usize| {
            let body = rows.slots[s].body;
            let rates = match self.progress.stage {
                Stage::Advanced {
                    implicit: false, ..
                } => self.system_data.rates_after_solve(body),
                _ => self.scene.bodies.rates(body),
            };
            dot(&rows.block(s).rows()[row - first], &rates)
        };
        let moved: f64 = rows.slot_range(constraint).map(rate).sum();
        let stiff = self.multipliers.mu_dt
            * self.multipliers.mu_dt
            * response_of_row(&self.system_data, constraint, row);
        let soft = rows.compliance[row] / (rows.compliance[row] + stiff);
        by_force + soft * rows.damping[row] * (moved + rows.phi_t[row])
    }
}
