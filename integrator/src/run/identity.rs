//! Identities of bodies, constraints and controls, which stay while numbers change.
//!
//! A handle holds the stepper's number and a unique one. It keeps naming its body when numbers change, and is refused after
//! the body is removed, and by any other stepper. A restored run issues new handles.

use crate::StepError;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use taut_model::{Scene, SceneError};

/// Handle of a body in a stepper. It keeps naming that body when numbers change, and is refused once the body is removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BodyId {
    stepper: u64,
    id: u64,
}

/// Handle of a constraint in a stepper. It keeps naming that constraint when numbers change, and is refused once the
/// constraint is removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ConstraintId {
    stepper: u64,
    id: u64,
}

/// Handle of a control in a stepper. It keeps naming that control when numbers change, and is refused once the control is
/// gone with the last thing that it drove.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ControlId {
    stepper: u64,
    id: u64,
}

/// Identities of a scene's bodies, constraints and controls: what is added later has a higher one. They ascend, but for
/// segments that have split off.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identities {
    stepper: u64,
    bodies: Vec<u64>,
    constraints: Vec<u64>,
    controls: Vec<u64>,
    next: u64,
}

impl Identities {
    pub(crate) fn new(scene: &Scene) -> Self {
        static STEPPERS: AtomicU64 = AtomicU64::new(0);
        let mut ids = Self {
            stepper: STEPPERS.fetch_add(1, Ordering::Relaxed),
            bodies: Vec::new(),
            constraints: Vec::new(),
            controls: Vec::new(),
            next: 0,
        };
        ids.extend(scene);
        ids
    }

    /// Identity of body number `number`.
    pub(crate) fn of_body(&self, number: usize) -> BodyId {
        BodyId {
            stepper: self.stepper,
            id: self.bodies[number],
        }
    }

    /// Identity of constraint number `number`.
    pub(crate) fn of_constraint(&self, number: usize) -> ConstraintId {
        ConstraintId {
            stepper: self.stepper,
            id: self.constraints[number],
        }
    }

    /// Identity of control number `number`.
    pub(crate) fn of_control(&self, number: usize) -> ControlId {
        ControlId {
            stepper: self.stepper,
            id: self.controls[number],
        }
    }

    /// The body of that name.
    pub(crate) fn body_named(&self, scene: &Scene, name: &str) -> Result<BodyId, SceneError> {
        Ok(self.of_body(scene.body(name)?))
    }

    /// The constraint of that name.
    pub(crate) fn constraint_named(
        &self,
        scene: &Scene,
        name: &str,
    ) -> Result<ConstraintId, SceneError> {
        Ok(self.of_constraint(scene.constraint(name)?))
    }

    /// The control of that name.
    pub(crate) fn control_named(&self, scene: &Scene, name: &str) -> Result<ControlId, SceneError> {
        Ok(self.of_control(scene.control(name)?))
    }

    fn find(&self, ids: &[u64], stepper: u64, id: u64) -> Option<usize> {
        let found = ids.binary_search(&id).ok();
        // Newer identities of segments that split off stand among older ones: the list need not be
        // sorted.
        let found = found.or_else(|| ids.iter().position(|known| *known == id));
        found.filter(|_| stepper == self.stepper)
    }

    /// Identities of a body and of a constraint that have been inserted at these numbers.
    pub(crate) fn insert(&mut self, body: usize, constraint: usize) {
        self.bodies.insert(body, self.next);
        self.constraints.insert(constraint, self.next + 1);
        self.next += 2;
    }

    /// Takes over what `other` has given out, so that nothing is given out twice.
    pub(crate) fn skip(&mut self, other: &Self) {
        self.next = self.next.max(other.next);
    }

    /// Number of a body.
    pub(crate) fn body(&self, id: BodyId) -> Result<usize, StepError> {
        self.find(&self.bodies, id.stepper, id.id)
            .ok_or(StepError::Gone { kind: "body" })
    }

    /// Number of a constraint.
    pub(crate) fn constraint(&self, id: ConstraintId) -> Result<usize, StepError> {
        self.find(&self.constraints, id.stepper, id.id)
            .ok_or(StepError::Gone { kind: "constraint" })
    }

    /// Number of a control.
    pub(crate) fn control(&self, id: ControlId) -> Result<usize, StepError> {
        self.find(&self.controls, id.stepper, id.id)
            .ok_or(StepError::Gone { kind: "control" })
    }

    /// Identities of what a scene has more than is known.
    pub(crate) fn extend(&mut self, scene: &Scene) {
        for (known, count) in [
            (&mut self.bodies, scene.bodies.len()),
            (&mut self.constraints, scene.constraints.len()),
            (&mut self.controls, scene.controls.len()),
        ] {
            while known.len() < count {
                known.push(self.next);
                self.next += 1;
            }
        }
    }

    /// Forgets bodies, constraints and controls by their numbers.
    pub(crate) fn remove(&mut self, bodies: &[usize], constraints: &[usize], controls: &[usize]) {
        for (ids, removed) in [
            (&mut self.bodies, bodies),
            (&mut self.constraints, constraints),
            (&mut self.controls, controls),
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

    /// Numbers that the present bodies and constraints have in `old`; `None` for new ones.
    pub(crate) fn numbers_in(&self, old: &Self) -> [Vec<Option<usize>>; 2] {
        let of = |ids: &[u64], old: &[u64]| -> Vec<Option<usize>> {
            if old.is_sorted() {
                return ids.iter().map(|id| old.binary_search(id).ok()).collect();
            }
            let numbers: HashMap<u64, usize> = old.iter().copied().zip(0..).collect();
            ids.iter().map(|id| numbers.get(id).copied()).collect()
        };
        [
            of(&self.bodies, &old.bodies),
            of(&self.constraints, &old.constraints),
        ]
    }
}
