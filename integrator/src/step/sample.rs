//! Samples of the error of the linear algebra: of a step the residual of the solution is solved for by the same factor,
//! S d = r. The impulses d move the load in that step by Δt |M̃⁻¹ Jᵀ d|.

use super::Step;
use crate::geometric::wrench;
use nalgebra::Vector3;
use taut_model::{BodyVectors, Scene};

/// What a sample needs, and the largest error so far.
pub(crate) struct Sample {
    /// Set while the next linear solve is to be sampled.
    pub(crate) is_due: bool,
    /// By how much the error of a solve moved the load, at most \[m].
    pub(crate) moved: f64,
    /// Δv of the step, and the correction of its multipliers, one a row.
    dv: BodyVectors,
    correction: Vec<f64>,
}

impl Sample {
    /// Samples of steps of the scene, after some whose largest error is `moved` (m).
    pub(crate) fn new(step: &Step, moved: f64) -> Self {
        Self {
            is_due: false,
            moved,
            dv: BodyVectors::new(step.scene.bodies.len()),
            correction: vec![0.0; step.multipliers.mu.len()],
        }
    }

    /// Takes the sample of a linear solve that was just made.
    pub(super) fn take(&mut self, of: &mut Step) {
        self.is_due = false;
        let Some(load) = load_of(&of.scene).filter(|load| of.scene.bodies.is_dynamic(*load)) else {
            return;
        };
        self.dv.copy_from(&of.system_data.dv);
        let solved = of.correction(&mut self.correction);
        of.system_data.dv.copy_from(&self.dv);
        if solved.is_err() {
            return;
        }
        let rows = &of.system_data.rows;
        let held = rows
            .slots
            .iter()
            .enumerate()
            .filter(|(_, slot)| slot.body == load);
        let impulse: Vector3<f64> = held.map(|(s, _)| wrench(rows, s, &self.correction).0).sum();
        let moved = impulse.norm() / of.scene.bodies.mass[load] * of.multipliers.mu_dt;
        self.moved = self.moved.max(moved);
    }
}

/// The load, or the last body of a scene without one.
pub(crate) fn load_of(scene: &Scene) -> Option<usize> {
    scene.load.or_else(|| scene.bodies.len().checked_sub(1))
}
