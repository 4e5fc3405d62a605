//! Cables that refine themselves: merges and splits after a step, by their rules ([`taut_model::scene::resolution`]).
//!
//! A change keeps the multipliers, and with them the forces, of the joints around. The elastic energy ½ Σ ε λ² changes with
//! the compliances, the kinetic energy by the blow of a merge, that of gravity where centres move: [`Resolved`] tells them.

use crate::StepError;
use crate::run::Stepper;
use taut_model::Scene;
use taut_model::scene::resolution::{Due, View};
use taut_model::scene::segments::Jump;

/// Changes of segments by winches and by the rules of cables after a step, and the energy that they
/// change \[J].
///
/// Each change plans the system anew and forgets the impulses of contacts: until the next step
/// [`Stepper::contacts`] has none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Resolved {
    /// Segments that split, and pairs that merged.
    pub splits: usize,
    /// See `splits`.
    pub merges: usize,
    /// Changes of the kinetic energy and of that of gravity, and what the former is foreseen to be.
    pub jump: Jump,
    /// Change of the elastic energy, [`Stepper::elastic_energy`].
    pub elastic: f64,
    /// Segments of all cables with rules, after it.
    pub segments: usize,
}

/// Cables with rules.
pub(crate) struct Resolving {
    cables: Vec<usize>,
    /// Bodies that the rules leave as they are, and bodies in contact; one flag a body.
    stays: Vec<bool>,
    touching: Vec<bool>,
    joints: Vec<[Option<usize>; 2]>,
    wanted: Vec<f64>,
    due: Vec<Due>,
}

impl Resolving {
    /// `None` where no cable has a rule.
    pub(crate) fn new(scene: &Scene) -> Option<Self> {
        let ruled = |k: &usize| {
            let stock = scene.cables[*k].stock.as_ref();
            stock.is_some_and(|stock| stock.resolution.is_some())
        };
        let cables: Vec<usize> = (0..scene.cables.len()).filter(ruled).collect();
        let segments = cables.iter().map(|k| scene.cables[*k].bodies.len()).max()?;
        let joints = scene.joints_of_segments();
        Some(Self {
            cables,
            stays: scene.unresolved(&joints),
            joints,
            touching: vec![false; scene.bodies.len()],
            wanted: Vec::with_capacity(segments),
            due: Vec::with_capacity(2 * segments),
        })
    }
}

impl std::ops::AddAssign for Resolved {
    fn add_assign(&mut self, other: Self) {
        self.splits += other.splits;
        self.merges += other.merges;
        self.jump += other.jump;
        self.elastic += other.elastic;
        self.segments = other.segments;
    }
}

impl Stepper {
    /// Segments of all cables with rules.
    pub(crate) fn ruled_segments(&self) -> usize {
        let cables = self
            .resolving
            .iter()
            .flat_map(|resolving| &resolving.cables);
        cables
            .map(|cable| self.step.scene.cables[*cable].bodies.len())
            .sum()
    }

    /// Segments merge and split as their rules ask for. Allocates where some do.
    pub(crate) fn resolve(&mut self) -> Result<Resolved, StepError> {
        let Some(mut resolving) = self.resolving.take() else {
            return Ok(Resolved::default());
        };
        resolving.touching.fill(false);
        for collider in self.step.contacts.colliders() {
            if let Some(body) = self.step.scene.colliders[collider].body {
                resolving.touching[body] = true;
            }
        }
        let mut all: Vec<(usize, Vec<Due>)> = Vec::new();
        let view = View {
            time: self.step.time,
            dt: self.step.substep(),
            phi: &self.step.system_data.rows.phi,
            first_rows: &self.step.system_data.rows.row_start,
            impulses: &self.step.multipliers.mu,
            impulse_time: self.step.multipliers.mu_dt,
            touching: &resolving.touching,
            stays: &resolving.stays,
            joints: &resolving.joints,
        };
        for &cable in &resolving.cables {
            let (wanted, due) = (&mut resolving.wanted, &mut resolving.due);
            self.step.scene.resolution_due(cable, &view, wanted, due);
            if !due.is_empty() {
                all.push((cable, due.clone()));
            }
        }
        self.resolving = Some(resolving);
        if all.is_empty() {
            return Ok(Resolved::default());
        }
        let elastic = self.elastic_energy();
        let mut done = self.change(|edit| edit.resolve(&all))?;
        done.elastic = self.elastic_energy() - elastic;
        Ok(done)
    }
}

#[cfg(test)]
mod tests;
