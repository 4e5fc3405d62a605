//! Forces of the last step, by constraint, and what the scene's events wait for.

use super::Step;
use std::ops::Deref;
use taut_model::{Event, Loads, MAX_ROWS, When, Wrench};

/// Forces λ of a constraint's rows: a slice of one number a row \[N, N m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowForces {
    rows: [f64; MAX_ROWS],
    count: usize,
}

impl Deref for RowForces {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.rows[..self.count]
    }
}

impl Step {
    /// Forces λ of the rows of a constraint, means over the last step.
    pub(crate) fn row_forces(&self, constraint: usize) -> Option<RowForces> {
        let mut forces = self.last_forces(constraint)?;
        if let Some(reported) = self.output.reported.forces() {
            let range = self.system_data.rows.row_range(constraint);
            forces.rows[..range.len()].copy_from_slice(&reported[range]);
        }
        Some(forces)
    }

    /// Forces λ of the rows of a constraint in the last sub-step.
    pub(crate) fn last_forces(&self, constraint: usize) -> Option<RowForces> {
        if constraint >= self.scene.constraints.len() {
            return None;
        }
        let mu = &self.multipliers.mu[self.system_data.rows.row_range(constraint)];
        let mut rows = [0.0; MAX_ROWS];
        for (force, mu) in rows.iter_mut().zip(mu) {
            *force = mu / self.multipliers.mu_dt;
        }
        let count = mu.len();
        Some(RowForces { rows, count })
    }

    /// Force and torque of a constraint on one of its sides.
    pub(crate) fn force_on(&self, constraint: usize, side: usize) -> Option<Wrench> {
        let rows = self.row_forces(constraint)?;
        let constraint = &self.scene.constraints[constraint];
        constraint.wrench(&self.scene.bodies, self.time, &rows, side)
    }

    /// Tension, bending, twist and drive of a constraint.
    pub(crate) fn loads(&self, constraint: usize) -> Option<Loads> {
        let rows = self.row_forces(constraint)?;
        self.scene.loads(constraint, self.time, &rows)
    }

    /// Tension of a constraint \[N].
    pub(crate) fn tension(&self, constraint: usize) -> Option<f64> {
        self.loads(constraint)?.tension
    }

    /// The forces and distances that events wait for, after a sub-step.
    pub(crate) fn measure_events(&mut self) {
        let mut met = std::mem::take(&mut self.output.reported.met);
        met.resize(self.scene.events.len(), f64::NEG_INFINITY);
        for (met, event) in met.iter_mut().zip(&self.scene.events) {
            *met = met.max(self.measured(event));
        }
        self.output.reported.met = met;
    }

    /// Force \[N] or distance \[m], negative, that an event waits for; −∞ of one that waits for neither.
    pub(crate) fn measured(&self, event: &Event) -> f64 {
        match &event.when {
            When::Force { constraint, .. } => self.strain(*constraint),
            When::Distance { between, .. } => {
                let [a, b] = between.map(|f| f.resolve(&self.scene.bodies, self.time).point());
                -(a - b).norm()
            }
            _ => f64::NEG_INFINITY,
        }
    }

    /// Tension of a constraint, or the size of its force where it has none; of a cable in parts the largest \[N].
    fn strain(&self, constraint: usize) -> f64 {
        let of = |part: usize| {
            let size = || Some(self.force_on(part, 1)?.force.norm());
            self.tension(part).or_else(size).unwrap_or(0.0)
        };
        let parts = self.scene.parts_of(constraint);
        parts.map(of).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Name of a constraint that gave way at its limit of force in the last solve; slack cables do not count.
    pub(crate) fn at_force_limit(&self) -> Option<String> {
        let bounds = &self.system_data.rows.bounds;
        let limit = |mu: f64, bound: f64| bound != 0.0 && mu == bound * self.multipliers.mu_dt;
        let held = bounds.iter().find(|b| {
            let mu = self.multipliers.mu[b.row];
            limit(mu, b.lower) || limit(mu, b.upper) || (b.lower == 0.0 && b.upper == 0.0)
        })?;
        self.scene.constraint_names.get(held.constraint).cloned()
    }
}
