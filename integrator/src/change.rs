//! Changes of a scene while it runs: attaching, releasing and cutting.
//!
//! Surviving rows keep their multipliers, tension, windings and history: they follow their constraint by its identity, not
//! by its number. New rows start with zero multipliers and a history of constant rates. New bodies start in the state that
//! is given: a staggered scheme, whose velocities are half a step old, takes half a step of their acceleration back, as at
//! the start of a run. The linear system is planned anew, as for a new scene. The energy balance restarts.

use crate::identity::{BodyId, ConstraintId, ControlId, Identities};
use crate::stepper::{Stage, Stepper};
use crate::{SavedRun, StepError};
use nalgebra::Vector3;
use taut_model::{
    Body, BodyVectors, Cable, CableParts, Constraint, Control, Event, Frame, MasslessCable, Scene,
};
use taut_solver::{Backend, DenseOptions, SolveError};

/// A scene that is being changed: [`Stepper::change`].
#[derive(Debug)]
pub struct Edit {
    scene: Scene,
    ids: Identities,
    /// The present \[s].
    time: f64,
    /// Whether anything was changed.
    touched: bool,
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
        Ok(self.ids.body_named(&self.scene, name)?)
    }

    /// The constraint of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first constraints.
    pub fn constraint(&self, name: &str) -> Result<ConstraintId, StepError> {
        Ok(self.ids.constraint_named(&self.scene, name)?)
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
        self.touched = true;
        let number = self.scene.add_body(name, body);
        self.ids.extend(&self.scene);
        self.ids.of_body(number)
    }

    /// Sets velocity \[m/s] and angular velocity \[rad/s] of a body, world frame. Segments of a new cable start at rest:
    /// this sets them moving.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn set_velocity(
        &mut self,
        body: BodyId,
        velocity: Vector3<f64>,
        angular_velocity: Vector3<f64>,
    ) -> Result<(), StepError> {
        let number = self.ids.body(body)?;
        self.touched = true;
        self.scene.bodies.velocity[number] = velocity;
        self.scene.bodies.angular_velocity[number] = angular_velocity;
        Ok(())
    }

    /// Adds a constraint of group `group`; its frames hold bodies by their numbers ([`body_index`](Self::body_index)). A
    /// massless cable has its length at this time.
    pub fn add_constraint(
        &mut self,
        name: impl Into<String>,
        constraint: impl Into<Constraint>,
        group: u32,
    ) -> ConstraintId {
        self.touched = true;
        let mut constraint = constraint.into();
        if let Constraint::MasslessCable(MasslessCable { winch: Some(w), .. }) = &mut constraint {
            w.since = self.time;
        }
        let number = self.scene.add_constraint(name, constraint, group);
        self.ids.extend(&self.scene);
        self.ids.of_constraint(number)
    }

    /// Lays a cable: [`Scene::add_cable`]. Its segments are at rest.
    ///
    /// # Errors
    /// [`StepError::Scene`] as there.
    pub fn add_cable(&mut self, cable: &Cable) -> Result<CableParts, StepError> {
        self.touched = true;
        let parts = self.scene.add_cable_at(cable, self.time)?;
        self.ids.extend(&self.scene);
        Ok(parts)
    }

    /// Removes an unconstrained body other than the load.
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

    /// Removes a cable with its segments, its joints, and what else joins its segments to each other.
    ///
    /// # Errors
    /// [`StepError::Scene`] where there is no such cable, or something else holds on to a segment.
    pub fn remove_cable(&mut self, name: &str) -> Result<(), StepError> {
        let CableParts { bodies, joints, .. } = self.scene.cable(name)?.clone();
        let within = |c: &Constraint| {
            let mut sides = c.frames().iter().map(Frame::body_index);
            sides.all(|body| body.is_some_and(|body| bodies.contains(&body)))
        };
        let all = self.scene.constraints.iter().enumerate();
        let inner = all.filter_map(|(i, c)| within(c).then_some(i));
        let joints: Vec<usize> = joints.into_iter().chain(inner).collect();
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
        self.touched = true;
        let body = body.map(|body| self.ids.body(body));
        self.scene.load = body.transpose()?;
        Ok(())
    }

    /// Adds a control of motors and winches that no other drives; it takes effect with its first [`Stepper::set_control`].
    pub fn add_control(&mut self, control: Control) -> ControlId {
        self.touched = true;
        self.scene.controls.push(control);
        self.ids.extend(&self.scene);
        self.ids.of_control(self.scene.controls.len() - 1)
    }

    /// Adds an event.
    pub fn add_event(&mut self, event: Event) {
        self.touched = true;
        self.scene.events.push(event);
    }

    pub(crate) fn drop_events(&mut self, events: &[Event]) {
        self.touched = true;
        self.scene.events.retain(|event| !events.contains(event));
    }

    pub(crate) fn remove(
        &mut self,
        bodies: &[usize],
        constraints: &[usize],
    ) -> Result<(), StepError> {
        let controls = self.scene.remove(bodies, constraints)?;
        self.touched = true;
        self.ids.remove(bodies, constraints, &controls);
        Ok(())
    }
}

impl Stepper {
    /// The body of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first bodies.
    pub fn body(&self, name: &str) -> Result<BodyId, StepError> {
        Ok(self.ids.body_named(&self.scene, name)?)
    }

    /// The constraint of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first constraints.
    pub fn constraint(&self, name: &str) -> Result<ConstraintId, StepError> {
        Ok(self.ids.constraint_named(&self.scene, name)?)
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

    /// The control of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the controls.
    pub fn control(&self, name: &str) -> Result<ControlId, StepError> {
        Ok(self.ids.control_named(&self.scene, name)?)
    }

    /// Number of the control in the scene as it is now.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn control_index(&self, control: ControlId) -> Result<usize, StepError> {
        self.ids.control(control)
    }

    /// Changes the scene between two steps and returns what `work` returns. Where `work` changes nothing the run continues
    /// bit for bit. Allocates; the steps after it do not.
    ///
    /// # Errors
    /// Those of `work`, [`StepError::Scene`] and [`StepError::Solve`] as [`Stepper::new`] for the changed scene, and
    /// [`SolveError::OutOfOrder`] in [`StepError::Solve`] between [`solve`](Self::solve) and [`advance`](Self::advance).
    /// On error the stepper is unchanged.
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
            time: self.time,
            touched: false,
        };
        let value = work(&mut edit);
        self.ids.skip(&edit.ids);
        let value = value?;
        if edit.touched {
            let moved = Moved::new(self, &edit);
            let mut changed = self.rebuilt(self.run_of(edit.scene).moved(&moved))?;
            changed.begin_past(&moved);
            changed.fresh = moved.fresh(&self.fresh);
            changed.ids = edit.ids;
            *self = changed;
        }
        Ok(value)
    }

    /// A stepper of this run with the solver of this one, which keeps it on error. No other may be made of a solver that
    /// was handed over.
    fn rebuilt(&mut self, run: SavedRun) -> Result<Self, StepError> {
        if !matches!(self.options.backend, Backend::Foreign { .. }) {
            return Self::restore(run);
        }
        let placeholder = Backend::Dense(DenseOptions::default()).create();
        let placeholder = placeholder.map_err(|e| self.culprit(e))?;
        let mut solver = Some(std::mem::replace(&mut self.solver, placeholder));
        let changed = Self::restore_with(run, &mut solver);
        if let Some(solver) = solver {
            self.solver = solver;
            // It may have analysed the other pattern. Each solve factorises first, and tells what fails here.
            let _ = self.solver.analyze(&self.plan.pattern);
        }
        changed
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
        if self.options.energy_tolerance.is_some() {
            self.account.begin(moved.rows.len());
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

    /// Numbers of the bodies that are new, or were so far.
    fn fresh(&self, old: &[usize]) -> Vec<usize> {
        let numbered = self.bodies.iter().enumerate();
        let new = |before: &Option<usize>| before.is_none_or(|before| old.contains(&before));
        numbered
            .filter_map(|(i, before)| new(before).then_some(i))
            .collect()
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
