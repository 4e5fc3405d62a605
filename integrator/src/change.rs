//! Changes of a scene while it runs: loads that are hooked on and let go, ropes that are cut.
//!
//! What stays keeps its multipliers, its tension, its windings and its past, row by row: rows follow their constraint by
//! its identity, not by its number. What is new has no past: its multipliers are zero, and its rates before the change are
//! those after it. The linear system is planned anew, as for a new scene, and the balance of energy begins anew.

use crate::StepError;
use crate::identity::{BodyId, ConstraintId, Identities};
use crate::stepper::{Stage, Stepper};
use taut_model::{Body, BodyVectors, Cable, CableParts, Constraint, Event, Scene};
use taut_solver::SolveError;

/// A scene that is being changed: [`Stepper::change`].
#[derive(Debug)]
pub struct Edit {
    scene: Scene,
    ids: Identities,
}

impl Edit {
    /// The scene as it is so far.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The body of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first bodies.
    pub fn body(&self, name: &str) -> Result<BodyId, StepError> {
        Ok(self.ids.of_body(self.scene.body(name)?))
    }

    /// The constraint of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first constraints.
    pub fn constraint(&self, name: &str) -> Result<ConstraintId, StepError> {
        let number = self.scene.constraint(name)?;
        Ok(self.ids.of_constraint(number))
    }

    /// Number of the body in [`scene`](Self::scene).
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn body_index(&self, body: BodyId) -> Result<usize, StepError> {
        self.ids.body(body)
    }

    /// Number of the constraint in [`scene`](Self::scene).
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn constraint_index(&self, constraint: ConstraintId) -> Result<usize, StepError> {
        self.ids.constraint(constraint)
    }

    /// Adds a body in its state at this time.
    pub fn add_body(&mut self, name: impl Into<String>, body: Body) -> BodyId {
        let number = self.scene.add_body(name, body);
        self.ids.extend(&self.scene);
        self.ids.of_body(number)
    }

    /// Adds a constraint of group `group`; its frames hold bodies by their numbers ([`body_index`](Self::body_index)).
    pub fn add_constraint(
        &mut self,
        name: impl Into<String>,
        constraint: impl Into<Constraint>,
        group: u32,
    ) -> ConstraintId {
        let number = self.scene.add_constraint(name, constraint, group);
        self.ids.extend(&self.scene);
        self.ids.of_constraint(number)
    }

    /// Lays a cable: [`Scene::add_cable`]. Its segments are at rest.
    ///
    /// # Errors
    /// [`StepError::Scene`] as there.
    pub fn add_cable(&mut self, cable: &Cable) -> Result<CableParts, StepError> {
        let parts = self.scene.add_cable(cable)?;
        self.ids.extend(&self.scene);
        Ok(parts)
    }

    /// Removes a body that nothing holds and that is not the load.
    ///
    /// # Errors
    /// [`StepError::Gone`]; [`StepError::Scene`] as [`Scene::remove`].
    pub fn remove_body(&mut self, body: BodyId) -> Result<(), StepError> {
        let number = self.ids.body(body)?;
        self.remove(&[number], &[])
    }

    /// Removes a constraint: a hook that lets go, a joint that breaks, a cable that is cut there.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn remove_constraint(&mut self, constraint: ConstraintId) -> Result<(), StepError> {
        let number = self.ids.constraint(constraint)?;
        self.remove(&[], &[number])
    }

    /// Removes a cable with its segments and joints.
    ///
    /// # Errors
    /// [`StepError::Scene`] where there is no such cable, or something else holds on to a segment.
    pub fn remove_cable(&mut self, name: &str) -> Result<(), StepError> {
        let CableParts { bodies, joints, .. } = self.scene.cable(name)?.clone();
        self.remove(&bodies, &joints)
    }

    /// Cuts a cable between its segments number `segment` and `segment + 1`, from 0.
    ///
    /// # Errors
    /// [`StepError::Scene`] where there is no such cable, or no joint between those segments.
    pub fn cut(&mut self, cable: &str, segment: usize) -> Result<(), StepError> {
        let joint = self.scene.joint_after(cable, segment)?;
        self.remove(&[], &[joint])
    }

    /// Makes a body the load, which reports follow.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn set_load_body(&mut self, body: Option<BodyId>) -> Result<(), StepError> {
        let body = body.map(|body| self.ids.body(body));
        self.scene.load = body.transpose()?;
        Ok(())
    }

    /// Adds an event.
    pub fn add_event(&mut self, event: Event) {
        self.scene.events.push(event);
    }

    pub(crate) fn drop_events(&mut self, events: &[Event]) {
        self.scene.events.retain(|event| !events.contains(event));
    }

    pub(crate) fn remove(
        &mut self,
        bodies: &[usize],
        constraints: &[usize],
    ) -> Result<(), StepError> {
        self.scene.remove(bodies, constraints)?;
        self.ids.remove(bodies, constraints);
        Ok(())
    }
}

impl Stepper {
    /// The body of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first bodies.
    pub fn body(&self, name: &str) -> Result<BodyId, StepError> {
        Ok(self.ids.of_body(self.scene.body(name)?))
    }

    /// The constraint of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first constraints.
    pub fn constraint(&self, name: &str) -> Result<ConstraintId, StepError> {
        let number = self.scene.constraint(name)?;
        Ok(self.ids.of_constraint(number))
    }

    /// Number of the body in the scene as it is now.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn body_index(&self, body: BodyId) -> Result<usize, StepError> {
        self.ids.body(body)
    }

    /// Number of the constraint in the scene as it is now.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn constraint_index(&self, constraint: ConstraintId) -> Result<usize, StepError> {
        self.ids.constraint(constraint)
    }

    /// Changes the scene between two steps and returns what `work` returns. A change that changes nothing leaves all bits
    /// as they were. Allocates; the steps after it do not.
    ///
    /// # Errors
    /// Those of `work`, [`StepError::Scene`] and [`StepError::Solve`] as [`Stepper::new`] for the changed scene, and
    /// [`SolveError::OutOfOrder`] in [`StepError::Solve`] between [`solve`](Self::solve) and [`advance`](Self::advance).
    /// Where it fails nothing has changed.
    pub fn change<T>(
        &mut self,
        work: impl FnOnce(&mut Edit) -> Result<T, StepError>,
    ) -> Result<T, StepError> {
        if self.stage == Stage::Solved {
            return Err(self.culprit(SolveError::OutOfOrder {
                called: "change",
                needs: "advance",
            }));
        }
        let mut edit = Edit {
            scene: self.scene.clone(),
            ids: self.ids.clone(),
        };
        let value = work(&mut edit)?;
        if edit.scene != self.scene {
            let moved = Moved::new(self, &edit);
            let mut changed = Self::restore(self.run_of(edit.scene).moved(&moved))?;
            changed.begin_past(&moved);
            changed.ids = edit.ids;
            *self = changed;
        }
        Ok(value)
    }

    /// The past of new rows and bodies is like the present.
    fn begin_past(&mut self, moved: &Moved) {
        let (pieces, history, scene) = (&mut self.pieces, &mut self.history, &self.scene);
        let mut v = BodyVectors::new(scene.bodies.len());
        v.load(&scene.bodies.velocity, &scene.bodies.angular_velocity);
        let jv = &mut self.in_rows[0];
        pieces.rows.times_jacobian(&v, jv);
        let mut driven = pieces.rows.phi_t.clone();
        let dt = self.options.dt / self.options.substeps as f64;
        pieces.rows.drive(scene, self.time - dt, self.time);
        std::mem::swap(&mut driven, &mut pieces.rows.phi_t);
        for r in new_ones(&moved.rows) {
            pieces.rows.phi_t[r] = driven[r];
            history.phi_t[r] = driven[r];
            history.rate[r] = jv[r] + driven[r];
        }
        for i in new_ones(&moved.bodies) {
            pieces.v.set(i, v.get(i));
            history.v.set(i, v.get(i));
        }
        for k in new_ones(&moved.bounded) {
            self.bounded.start(k, &self.pieces);
        }
    }
}

/// Old numbers of what a changed scene has; none of what is new.
pub(crate) struct Moved {
    bodies: Vec<Option<usize>>,
    rows: Vec<Option<usize>>,
    bounded: Vec<Option<usize>>,
}

impl Moved {
    fn new(old: &Stepper, edit: &Edit) -> Self {
        let [bodies, constraints] = edit.ids.numbers_in(&old.ids);
        let (mut rows, mut bounded) = (Vec::new(), Vec::new());
        let old_bounds = &old.pieces.rows.bounds;
        for (constraint, before) in edit.scene.constraints.iter().zip(constraints) {
            let first = before.map(|c| old.pieces.rows.row_range(c).start);
            rows.extend((0..constraint.rows()).map(|k| first.map(|first| first + k)));
            if constraint.bounds(old.time).is_some() {
                let of = |c: usize| old_bounds.binary_search_by_key(&c, |bound| bound.constraint);
                bounded.push(before.and_then(|c| of(c).ok()));
            }
        }
        Self {
            bodies,
            rows,
            bounded,
        }
    }

    /// The numbers of the rows, in their new order; those of new rows are zero.
    pub(crate) fn rows(&self, old: &[f64]) -> Vec<f64> {
        taken(&self.rows, old, 0.0)
    }

    /// The same of the bodies.
    pub(crate) fn bodies(&self, old: &[[f64; 6]]) -> Vec<[f64; 6]> {
        taken(&self.bodies, old, [0.0; 6])
    }

    /// The same of the rows with bounds.
    pub(crate) fn bounded<T: Copy>(&self, old: &[T], new: T) -> Vec<T> {
        taken(&self.bounded, old, new)
    }
}

fn taken<T: Copy>(numbers: &[Option<usize>], old: &[T], new: T) -> Vec<T> {
    numbers.iter().map(|i| i.map_or(new, |i| old[i])).collect()
}

fn new_ones(numbers: &[Option<usize>]) -> impl Iterator<Item = usize> + '_ {
    let numbered = numbers.iter().enumerate();
    numbered.filter_map(|(i, old)| old.is_none().then_some(i))
}

#[cfg(test)]
mod tests;
