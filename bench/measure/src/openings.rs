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
    pub fn strain(&self) -> f64 {
        self.gap_m / self.length_m
    }

    /// The opening, where there was one.
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
        let mut rates_known = false;
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
            let most = self.unexplained.strain().max(0.0) * length;
            let by_spring = || gap - explained(stepper, c, &[0.0; MAX_ROWS]);
            if !wider(gap, most) || !wider(by_spring(), most) {
                continue;
            }
            if !std::mem::replace(&mut rates_known, true) {
                self.find_rates(stepper);
            }
            let rates = &self.rates[range];
            let left = least_gap(stepper, c, rates, gap) - explained(stepper, c, rates);
            if wider(left, most) {
                self.unexplained.put(stepper, c, [left, length]);
            }
        }
    }

    /// φ̇ = J v + ∂φ/∂t of the rows: velocities are those of the middle of the last sub-step.
    fn find_rates(&mut self, stepper: &Stepper) {
        let (bodies, rows) = (&stepper.scene().bodies, stepper.linearized());
        if bodies.len() != self.bodies {
            (self.v, self.bodies) = (BodyVectors::new(bodies.len()), bodies.len());
        }
        self.rates.resize(rows.phi.len(), 0.0);
        self.v.load(&bodies.velocity, &bodies.angular_velocity);
        rows.times_jacobian(&self.v, &mut self.rates);
        let driven = self.rates.iter_mut().zip(&rows.phi_t);
        driven.for_each(|(rate, phi_t)| *rate += phi_t);
    }

    /// Constraints have come or gone, and others have their numbers.
    pub fn forget_lengths(&mut self) {
        self.lengths.clear();
    }
}

/// The gap of constraint `c` now, `gap`, or at the start of the last sub-step, whose force it gave, whichever is less \[m]: a rope
/// that is caught stretches by as much as the load moves in a sub-step before its force tells.
fn least_gap(stepper: &Stepper, c: usize, rates: &[f64], gap: f64) -> f64 {
    let options = stepper.options();
    let substep = options.dt / options.substeps as f64;
    let phi = &stepper.linearized().phi[stepper.linearized().row_range(c)];
    let mut before = [0.0; MAX_ROWS];
    for (before, (phi, rate)) in before.iter_mut().zip(phi.iter().zip(rates)) {
        *before = phi - substep * rate;
    }
    let before = stepper.scene().constraints[c].gap(&before[..phi.len()]);
    before.map_or(gap, |before| before.min(gap))
}

/// The gap that the law of constraint `c` gives its force, with rows of these φ̇: |ε λ + τ φ̇| \[m].
fn explained(stepper: &Stepper, c: usize, rates: &[f64]) -> f64 {
    let rows = stepper.linearized();
    let range = rows.row_range(c);
    let mut law = [0.0; MAX_ROWS];
    let forces = stepper.last_forces(c);
    let forces = forces.as_deref().unwrap_or_default();
    let of_row = forces.iter().zip(range).zip(rates);
    for (law, ((force, row), rate)) in law.iter_mut().zip(of_row) {
        *law = -rows.compliance[row] * force - rows.damping[row] * rate;
    }
    stepper.scene().constraints[c].gap(&law).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use taut_integrator::StepOptions;
    use taut_model::{Body, Frame, Hinge, MasslessCable, RowLaw, Scene};

    /// The gaps of a run of `steps` steps of 1/60 s with so many sub-steps.
    fn seen(scene: Scene, substeps: usize, steps: usize) -> Openings {
        let options = StepOptions {
            substeps,
            ..StepOptions::default()
        };
        let mut stepper = Stepper::new(scene, options).expect("sound");
        let mut openings = Openings::default();
        for _ in 0..steps {
            stepper.step().expect("steps");
            openings.see(&stepper);
        }
        openings
    }

    /// 100 kg at (0, 0, z), held by `constraint` at the origin.
    fn hung(z: f64, constraint: impl FnOnce([Frame; 2]) -> Constraint) -> Scene {
        let mut scene = Scene::new("hung");
        scene.gravity = Vector3::new(1.0, 0.0, -9.81);
        let load = Body::sphere(0.2, 100.0).at(Vector3::z() * z);
        let load = scene.add_body("load", load);
        let frames = [Vector3::zeros(), Vector3::z() * -z];
        let [world, top] = frames;
        let frames = [Frame::world(world), Frame::body(load, top)];
        scene.add_constraint("held", constraint(frames), 0);
        scene
    }

    /// A load that a damped rope catches after a fall of 5 m: the rope gives way by as much as its spring and damper
    /// say, but for the second order of a sub-step.
    #[test]
    fn what_a_damper_carries_is_explained() {
        for tau in [0.0, 0.02, 0.5] {
            for substeps in [1, 8, 64] {
                let scene = hung(-1.0, |[world, _]| {
                    let load = Frame::body(0, Vector3::zeros());
                    let law = RowLaw::new(1e-5, tau);
                    Constraint::MasslessCable(MasslessCable::new(vec![world, load], 6.0, law))
                });
                let seen = seen(scene, substeps, 120);
                let (left, widest) = (&seen.unexplained, &seen.widest);
                assert!(widest.gap_m > 5e-3, "{tau} {substeps}: {widest:?}");
                let bar = 0.05 / (substeps * substeps) as f64;
                assert!(left.gap_m < bar, "{tau} {substeps}: {left:?}");
            }
        }
    }

    /// A joint has no length of its own, and this scene has no other: its gap of rounding is over 1 m.
    #[test]
    fn the_gap_of_a_joint_alone_is_over_a_metre() {
        let scene = hung(-1.0, |frames| Constraint::Hinge(Hinge::new(frames)));
        let seen = seen(scene, 1, 60);
        for opening in [seen.widest, seen.unexplained] {
            // Rounding may leave none at all.
            let is_small = |o: &Opening| o.length_m == 1.0 && o.strain() < 1e-9;
            assert!(opening.found().is_none_or(is_small), "{opening:?}");
        }
    }
}
