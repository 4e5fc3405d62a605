//! Identities of bodies and constraints, which stay while numbers change.

use crate::StepError;
use taut_model::Scene;

/// A body of a stepper, whatever its number. It stays valid as long as the body is there, and is never that of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BodyId(u64);

/// A constraint of a stepper, whatever its number. It stays valid as long as the constraint is there, and is never that of
/// another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ConstraintId(u64);

/// Identities of a scene's bodies and constraints, ascending: what is added later has a higher one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identities {
    bodies: Vec<u64>,
    constraints: Vec<u64>,
    next: u64,
}

impl Identities {
    pub(crate) fn new(scene: &Scene) -> Self {
        let (bodies, constraints) = (scene.bodies.len() as u64, scene.constraints.len() as u64);
        Self {
            bodies: (0..bodies).collect(),
            constraints: (0..constraints).collect(),
            next: bodies.max(constraints),
        }
    }

    /// Identity of body number `number`.
    pub(crate) fn of_body(&self, number: usize) -> BodyId {
        BodyId(self.bodies[number])
    }

    /// Identity of constraint number `number`.
    pub(crate) fn of_constraint(&self, number: usize) -> ConstraintId {
        ConstraintId(self.constraints[number])
    }

    /// Number of a body.
    pub(crate) fn body(&self, id: BodyId) -> Result<usize, StepError> {
        let found = self.bodies.binary_search(&id.0);
        found.map_err(|_| StepError::Gone { kind: "body" })
    }

    /// Number of a constraint.
    pub(crate) fn constraint(&self, id: ConstraintId) -> Result<usize, StepError> {
        let found = self.constraints.binary_search(&id.0);
        found.map_err(|_| StepError::Gone { kind: "constraint" })
    }

    /// Identities of what a scene has more than is known.
    pub(crate) fn extend(&mut self, scene: &Scene) {
        for (known, count) in [
            (&mut self.bodies, scene.bodies.len()),
            (&mut self.constraints, scene.constraints.len()),
        ] {
            while known.len() < count {
                known.push(self.next);
                self.next += 1;
            }
        }
    }

    /// Forgets bodies and constraints by their numbers.
    pub(crate) fn remove(&mut self, bodies: &[usize], constraints: &[usize]) {
        for (ids, removed) in [
            (&mut self.bodies, bodies),
            (&mut self.constraints, constraints),
        ] {
            let mut removed = removed.to_vec();
            removed.sort_unstable();
            let mut number = 0..;
            ids.retain(|_| {
                let i: usize = number.next().unwrap_or_default();
                removed.binary_search(&i).is_err()
            });
        }
    }

    /// Old numbers, in `old`, of the bodies and constraints that there are now; none of what is new.
    pub(crate) fn numbers_in(&self, old: &Self) -> [Vec<Option<usize>>; 2] {
        let of = |ids: &[u64], old: &[u64]| -> Vec<Option<usize>> {
            ids.iter().map(|id| old.binary_search(id).ok()).collect()
        };
        [
            of(&self.bodies, &old.bodies),
            of(&self.constraints, &old.constraints),
        ]
    }
}
