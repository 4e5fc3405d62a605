//! Cables that refine themselves: merges and splits after a step, by their rules ([`taut_model::scene::resolution`]).
//!
//! A change keeps the multipliers, and with them the forces, of the joints around. The elastic energy ½ Σ ε λ² changes with
//! the compliances, the kinetic energy by the blow of a merge, that of gravity where centres move: [`Resolved`] tells them.

use super::Stepper;
use crate::StepError;
use taut_model::Scene;
use taut_model::scene::resolution::{Due, View};

/// What the rules of cables did after a step, and the changes of energy by it \[J].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Resolved {
    /// Segments that split, and pairs that merged.
    pub splits: usize,
    /// See `splits`.
    pub merges: usize,
    /// Change of the kinetic energy.
    pub kinetic: f64,
    /// The blows of the merges, −½ uᵀ K⁻¹ u each: what the kinetic energy is foreseen to change by.
    pub foreseen: f64,
    /// Change of the energy of gravity.
    pub gravity: f64,
    /// Change of the elastic energy, [`Stepper::elastic_energy`].
    pub elastic: f64,
}

/// Cables with rules.
pub(crate) struct Resolving {
    cables: Vec<usize>,
    /// Of each body whether rules leave it as it is, and whether it touches something.
    stays: Vec<bool>,
    touching: Vec<bool>,
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
        Some(Self {
            cables,
            stays: scene.unresolved(),
            touching: vec![false; scene.bodies.len()],
            wanted: Vec::with_capacity(segments),
            due: Vec::with_capacity(2 * segments),
        })
    }
}

impl Stepper {
    /// Segments merge and split as their rules ask for. Allocates where some do.
    pub(crate) fn resolve(&mut self) -> Result<Resolved, StepError> {
        let mut done = Resolved::default();
        let Some(mut resolving) = self.resolving.take() else {
            return Ok(done);
        };
        resolving.touching.fill(false);
        for collider in self.contacts.colliders() {
            if let Some(body) = self.scene.colliders[collider].body {
                resolving.touching[body] = true;
            }
        }
        let mut all: Vec<(usize, Vec<Due>)> = Vec::new();
        let tension = |joint: usize| self.tension(joint).unwrap_or(0.0);
        let view = View {
            time: self.time,
            dt: self.substep(),
            tension: &tension,
            touching: &resolving.touching,
            stays: &resolving.stays,
        };
        for &cable in &resolving.cables {
            let (wanted, due) = (&mut resolving.wanted, &mut resolving.due);
            self.scene.resolution_due(cable, &view, wanted, due);
            if !due.is_empty() {
                all.push((cable, due.clone()));
            }
        }
        self.resolving = Some(resolving);
        if all.is_empty() {
            return Ok(done);
        }
        let elastic = self.elastic_energy();
        let jumps = self.change(|edit| {
            let jumps = all.iter().map(|(cable, due)| edit.resolve(*cable, due));
            jumps.collect::<Result<Vec<_>, _>>()
        })?;
        for jump in jumps {
            done.kinetic += jump.kinetic;
            done.foreseen += jump.foreseen;
            done.gravity += jump.gravity;
        }
        done.elastic = self.elastic_energy() - elastic;
        let due = || all.iter().flat_map(|(_, due)| due);
        done.splits = due().filter(|due| due.splits).count();
        done.merges = due().count() - done.splits;
        Ok(done)
    }
}

#[cfg(test)]
mod tests;
