//! The largest gaps of a run: which joint had one, when, and what of it no force explains.
//!
//! A row of compliance ε and damping τ that carries λ is open by ε |λ| ± τ |φ̇|. What is open beyond that in a step has come
//! without a force: a jump of one step, as where a cable first touches a drum, is in no force, no energy and no balance.

use serde::Serialize;
use taut_integrator::Stepper;
use taut_model::constraint::MAX_ROWS;
use taut_model::{BodyVectors, Constraint};

/// A gap, with the joint, link or cable that has it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Opening {
    /// Name of the joint, link or cable.
    pub joint: String,
    /// When it was so wide \[s].
    pub time: f64,
    /// How wide \[m].
    pub gap_m: f64,
    /// Length of cable that it stands for, or where it has none the longest of the scene, or else 1 m \[m].
    pub length_m: f64,
}

impl Opening {
    /// The gap over the length.
    #[must_use]
    pub fn strain(&self) -> f64 {
        self.gap_m / self.length_m
    }

    /// The opening, where there was one.
    #[must_use]
    pub fn found(&self) -> Option<&Self> {
        (!self.joint.is_empty()).then_some(self)
    }

    fn put(&mut self, stepper: &Stepper, c: usize, [gap_m, length_m]: [f64; 2]) {
        self.joint.clone_from(&stepper.scene().constraint_names[c]);
        (self.time, self.gap_m, self.length_m) = (stepper.time(), gap_m, length_m);
    }
}

/// The widest gap of a run, and the one with the most that no force explains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Openings {
    /// The widest gap.
    pub widest: Opening,
    /// The part of one beyond ε |λ| that is the largest over the length.
    pub unexplained: Opening,
    /// Lengths of the constraints, none where others have come or gone \[m].
    lengths: Vec<f64>,
    /// Room for velocities, of so many bodies, and for φ̇.
    v: BodyVectors,
    bodies: usize,
    rates: Vec<f64>,
}

impl Openings {
    /// Sees the gaps after a step.
    pub fn see(&mut self, stepper: &Stepper) {
        let (scene, rows) = (stepper.scene(), stepper.linearized());
        if self.lengths.len() != scene.constraints.len() {
            let lengths = scene.constraints.iter().map(Constraint::length);
            self.lengths = lengths.collect();
        }
        let longest = self.lengths.iter().copied().fold(0.0, f64::max);
        let longest = if longest > 0.0 { longest } else { 1.0 };
        self.explain(stepper);
        for (c, constraint) in scene.constraints.iter().enumerate() {
            let range = rows.row_range(c);
            let Some(gap) = constraint.gap(&rows.phi[range.clone()]) else {
                continue;
            };
            let length = match self.lengths[c] {
                length if length > 0.0 => length,
                _ => longest,
            };
            // NaN counts as the widest.
            let wider = |gap: f64, than: f64| gap > than || (gap.is_nan() && !than.is_nan());
            if wider(gap, self.widest.gap_m) {
                self.widest.put(stepper, c, [gap, length]);
            }
            let of_law = explained(stepper, c, &self.rates[range]);
            let most = self.unexplained.strain().max(0.0);
            if wider(gap - of_law, most * length) {
                self.unexplained.put(stepper, c, [gap - of_law, length]);
            }
        }
    }

    /// φ̇ of the rows: velocities are those of the middle of the last sub-step.
    fn explain(&mut self, stepper: &Stepper) {
        let (bodies, rows) = (&stepper.scene().bodies, stepper.linearized());
        self.rates.clear();
        self.rates.resize(rows.phi.len(), 0.0);
        if rows.damping.iter().any(|tau| *tau > 0.0) {
            if bodies.len() != self.bodies {
                (self.v, self.bodies) = (BodyVectors::new(bodies.len()), bodies.len());
            }
            self.v.load(&bodies.velocity, &bodies.angular_velocity);
            rows.times_jacobian(&self.v, &mut self.rates);
        }
    }

    /// Constraints have come or gone, and others have their numbers.
    pub fn forget_lengths(&mut self) {
        self.lengths.clear();
    }
}

/// The gap that the law of constraint `c` gives its force, with rows of these φ̇: |ε λ + τ φ̇| \[m].
fn explained(stepper: &Stepper, c: usize, rates: &[f64]) -> f64 {
    let rows = stepper.linearized();
    let range = rows.row_range(c);
    let mut law = [0.0; MAX_ROWS];
    let forces = stepper.row_forces(c);
    let forces = forces.as_deref().unwrap_or_default();
    let of_row = forces.iter().zip(range).zip(rates);
    for (law, ((force, row), rate)) in law.iter_mut().zip(of_row) {
        *law = -rows.compliance[row] * force - rows.damping[row] * rate;
    }
    stepper.scene().constraints[c].gap(&law).unwrap_or(0.0)
}
