//! Changes of a scene while it runs: attaching, releasing and cutting.
//!
//! Surviving rows keep their multipliers, tension, windings and history: they follow their constraint by its identity, not
//! by its number. New rows start with zero multipliers and a history of constant rates. New bodies start in the state that
//! is given: a staggered scheme, whose velocities are half a step old, takes half a step of their acceleration back, as at
//! the start of a run. The linear system is planned anew, as for a new scene. The energy balance restarts.

mod segments;

use crate::activation::Made;
use crate::contact::Known;
use crate::contact::rebound::slowest;
use crate::run::Stepper;
use crate::run::identity::{BodyId, ConstraintId, ControlId, Identities};
use crate::step::Stage;
use crate::{ContactForce, SavedRun, StepError};
use nalgebra::Vector3;
use segments::{Closed, Parted};
use std::collections::HashMap;
use taut_model::{
    Body, BodyVectors, Cable, CableParts, Collider, Constraint, Control, Event, Frame,
    MasslessCable, Scene,
};
use taut_solver::{Backend, DenseOptions, SolveError};

/// A scene that is being changed: [`Stepper::change`].
#[derive(Debug)]
pub struct Edit {
    scene: Scene,
    ids: Identities,
    /// The present \[s].
    time: f64,
    /// Set by every change: an edit without one leaves the run as it is, bit for bit.
    touched: bool,
    /// New parts of cables, each with the cable that it is cut from, whose multiplier it takes over.
    going_on: Vec<(ConstraintId, ConstraintId)>,
    /// Segments that have split, and joints that have gone with segments that merged.
    parted: Vec<Parted>,
    closed: Vec<Closed>,
    /// Segments that rules have parted or joined, where they are still there.
    reshaped: Vec<BodyId>,
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

    /// The constraint of that number.
    pub(crate) fn constraint_at(&self, number: usize) -> ConstraintId {
        self.ids.of_constraint(number)
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

    /// Sets the mass of a body \[kg], as if it were of another density: its inertia becomes as many times as large.
    ///
    /// # Errors
    /// [`StepError::Gone`]; the change fails by [`StepError::Scene`] where the mass is not finite and positive.
    pub fn set_mass(&mut self, body: BodyId, mass: f64) -> Result<(), StepError> {
        let number = self.ids.body(body)?;
        self.touched = true;
        let bodies = &mut self.scene.bodies;
        bodies.inertia[number] *= mass / bodies.mass[number];
        bodies.mass[number] = mass;
        Ok(())
    }

    /// Gives the world, or a body by its number ([`body_index`](Self::body_index)), a shape: [`Scene::add_collider`].
    pub fn add_collider(&mut self, collider: Collider) {
        self.touched = true;
        self.scene.add_collider(collider);
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

    /// Removes a constraint: a hook that lets go, a joint that breaks, a cable that is cut there. A part of a massless cable
    /// over sheaves with friction takes the others along.
    ///
    /// # Errors
    /// [`StepError::Gone`].
    pub fn remove_constraint(&mut self, constraint: ConstraintId) -> Result<(), StepError> {
        let number = self.ids.constraint(constraint)?;
        let parts: Vec<usize> = self.scene.parts_of(number).collect();
        self.remove(&[], &parts)
    }

    /// Adds a massless cable, cut at the sheaves that grip it: [`Scene::reeve`]. It has its length at this time.
    ///
    /// # Errors
    /// [`StepError::Scene`] as there.
    pub fn reeve(
        &mut self,
        name: &str,
        cable: &MasslessCable,
        group: u32,
    ) -> Result<Vec<ConstraintId>, StepError> {
        let mut cable = cable.clone();
        if let Some(winch) = &mut cable.winch {
            winch.since = self.time;
        }
        let parts = self.scene.reeve_at(name, &cable, group, self.time)?;
        self.touched = true;
        self.ids.extend(&self.scene);
        Ok(parts
            .into_iter()
            .map(|part| self.ids.of_constraint(part))
            .collect())
    }

    /// Joins the parts of cables that have left sheaves with friction, and cuts those that lie on some anew.
    pub(crate) fn lift_and_land(&mut self) -> Result<(), StepError> {
        loop {
            let left = self.scene.left().next();
            let Some(second) = left.and_then(|i| self.scene.lift_off(i, self.time)) else {
                break;
            };
            self.remove(&[], &[second])?;
        }
        let landed: Vec<usize> = self.scene.landed().collect();
        for whole in landed {
            let parts = self.scene.lay_down(whole, self.time)?;
            self.ids.extend(&self.scene);
            let of = |part| self.ids.of_constraint(part);
            let going_on = parts.into_iter().map(|part| (of(part), of(whole)));
            self.going_on.extend(going_on);
            self.touched = true;
        }
        Ok(())
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

    pub(crate) fn drop_events_called(&mut self, name: &str) {
        self.scene.events.retain(|event| event.name != name);
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
        Ok(self.ids.body_named(&self.step.scene, name)?)
    }

    /// The constraint of that name.
    ///
    /// # Errors
    /// [`StepError::Scene`] with the names of the first constraints.
    pub fn constraint(&self, name: &str) -> Result<ConstraintId, StepError> {
        Ok(self.ids.constraint_named(&self.step.scene, name)?)
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
        Ok(self.ids.control_named(&self.step.scene, name)?)
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
    /// The errors of `work`; [`StepError::Scene`] and [`StepError::Solve`] as [`Stepper::new`] for
    /// the changed scene; [`SolveError::OutOfOrder`] in [`StepError::Solve`] between
    /// [`solve`](Self::solve) and [`advance`](Self::advance). On error the stepper is unchanged.
    pub fn change<T>(
        &mut self,
        work: impl FnOnce(&mut Edit) -> Result<T, StepError>,
    ) -> Result<T, StepError> {
        if self.step.progress.stage == Stage::Solved {
            return Err(self.step.culprit(SolveError::OutOfOrder {
                called: "change",
                needs: "advance",
            }));
        }
        let mut edit = Edit {
            scene: self.step.scene.clone(),
            ids: self.ids.clone(),
            time: self.step.time,
            touched: false,
            going_on: Vec::new(),
            parted: Vec::new(),
            closed: Vec::new(),
            reshaped: Vec::new(),
        };
        let value = work(&mut edit);
        self.ids.skip(&edit.ids);
        let value = value?;
        if edit.touched {
            let moved = Moved::new(self, &edit);
            let mut changed = self.rebuilt(self.run_of(edit.scene).moved(&moved))?;
            let contacts = moved.contact_forces(self.contacts());
            changed.step.output.reported.put_contacts(contacts);
            changed.begin_past(&moved);
            changed.step.progress.newly_added = moved.fresh(&self.step.progress.newly_added);
            changed.ids = edit.ids;
            changed.carry_over(self, &edit.parted, &edit.closed);
            changed.begin_past_of(&edit.reshaped);
            // The parts of a segment have their past from the whole.
            if changed.step.progress.started && edit.parted.is_empty() && edit.closed.is_empty() {
                changed.begin_young(&moved);
            }
            self.go_on_as(changed);
            self.outdate_coarse_run();
        }
        Ok(value)
    }

    /// A stepper of this run with the solver of this one, which keeps it on error. No other may be made of a solver that
    /// was handed over.
    pub(crate) fn rebuilt(&mut self, run: SavedRun) -> Result<Self, StepError> {
        if !matches!(self.step.options.backend, Backend::Foreign { .. }) {
            return Self::restore(run);
        }
        let placeholder = Backend::Dense(DenseOptions::default()).create();
        let placeholder = placeholder.map_err(|e| self.step.culprit(e))?;
        let mut solver = Some(std::mem::replace(&mut self.step.system.solver, placeholder));
        let changed = Self::restore_with(run, &mut solver);
        if let Some(solver) = solver {
            self.step.system.solver = solver;
            // It may have analysed the other pattern. Each solve factorises first, and tells what fails here.
            let _ = self
                .step
                .system
                .solver
                .analyze(&self.step.system.assembly_map.pattern);
        }
        changed
    }

    /// The past of new rows and bodies is like the present.
    fn begin_past(&mut self, moved: &Moved) {
        let (system_data, history, scene) = (
            &mut self.step.system_data,
            &mut self.step.history,
            &self.step.scene,
        );
        let mut v = BodyVectors::new(scene.bodies.len());
        v.load(&scene.bodies.velocity, &scene.bodies.angular_velocity);
        let jv = &mut self.step.system.in_rows[0];
        system_data.rows.times_jacobian(&v, jv);
        let mut driven = system_data.rows.phi_t.clone();
        let dt = self.step.options.dt / self.step.options.substeps as f64;
        system_data
            .rows
            .drive(scene, self.step.time - dt, self.step.time);
        std::mem::swap(&mut driven, &mut system_data.rows.phi_t);
        for r in moved.without_past() {
            system_data.rows.phi_t[r] = driven[r];
            history.phi_t[r] = driven[r];
            history.rate[r] = jv[r] + driven[r];
        }
        for i in new_ones(&moved.bodies) {
            system_data.v.set(i, v.get(i));
            history.v.set(i, v.get(i));
        }
        for k in new_ones(&moved.bounded) {
            self.step.active_set.start(k, &self.step.system_data);
        }
        if self.step.options.energy_tolerance.is_some() {
            self.step.output.account.begin(moved.rows.len());
        }
    }

    /// New rows without bounds whose bodies part or approach at once are young.
    fn begin_young(&mut self, moved: &Moved) {
        let (rows, dt) = (&self.step.system_data.rows, self.step.substep());
        let slowest = slowest(&self.step.scene, dt);
        let mut made = self.step.activation.made().to_vec();
        for constraint in 0..rows.constraints() {
            let is_bounded = rows.bounds.iter().any(|b| b.constraint == constraint);
            let new = rows.row_range(constraint).filter(|row| {
                moved.rows[*row].is_none()
                    && !is_bounded
                    && self.step.history.rate[*row].abs() > slowest
            });
            made.extend(new.map(|row| Made {
                constraint,
                row,
                age: 0,
            }));
        }
        self.step.make_young(made);
    }
}

/// Old numbers of what a changed scene has; none of what is new.
pub(crate) struct Moved {
    bodies: Vec<Option<usize>>,
    rows: Vec<Option<usize>>,
    bounded: Vec<Option<usize>>,
    constraints: Vec<Option<usize>>,
    /// Rows that are there with another path: of a cable that has left a sheave or lies on one.
    other_paths: Vec<usize>,
    /// New numbers of the shapes that there were; none of those that have gone.
    shapes: Vec<Option<usize>>,
}

impl Moved {
    fn new(old: &Stepper, edit: &Edit) -> Self {
        let [mut bodies, constraints] = edit.ids.numbers_in(&old.ids);
        for Parted { bodies: pair, .. } in &edit.parted {
            if let [Ok(segment), Ok(first)] = pair.map(|body| edit.ids.body(body)) {
                bodies[segment] = bodies[first];
            }
        }
        let (mut rows, mut bounded) = (Vec::<Option<usize>>::new(), Vec::new());
        let mut other_paths = Vec::new();
        let old_bounds = &old.step.system_data.rows.bounds;
        let mut numbers = Vec::with_capacity(constraints.len());
        for (i, (constraint, before)) in edit.scene.constraints.iter().zip(constraints).enumerate()
        {
            let id = edit.ids.of_constraint(i);
            let mut going_on = edit.going_on.iter().filter(|(new, _)| *new == id);
            let whole = going_on.find_map(|(_, whole)| old.ids.constraint(*whole).ok());
            let before = before.or(whole);
            numbers.push(before);
            let path = |c: usize| old.step.scene.constraints[c].frames().len();
            if whole.is_some() || before.is_some_and(|c| path(c) != constraint.frames().len()) {
                other_paths.push(rows.len());
            }
            let first = before.map(|c| old.step.system_data.rows.row_range(c).start);
            rows.extend((0..constraint.rows()).map(|k| first.map(|first| first + k)));
            if constraint.bounds(old.step.time).is_some() {
                let of = |c: usize| old_bounds.binary_search_by_key(&c, |bound| bound.constraint);
                bounded.push(before.and_then(|c| of(c).ok()));
            }
        }
        Self {
            bodies,
            rows,
            bounded,
            constraints: numbers,
            other_paths,
            shapes: shapes(&old.step.scene, &edit.scene),
        }
    }

    /// Rows whose past is taken to be like the present.
    fn without_past(&self) -> impl Iterator<Item = usize> + '_ {
        new_ones(&self.rows).chain(self.other_paths.iter().copied())
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

    /// The young rows without bounds, by their new numbers.
    pub(crate) fn made(&self, old: &[Made]) -> Vec<Made> {
        let of = |row: &Made| {
            let row_now = self
                .rows
                .iter()
                .position(|before| *before == Some(row.row))?;
            let constraint = self
                .constraints
                .iter()
                .position(|c| *c == Some(row.constraint))?;
            Some(Made {
                constraint,
                row: row_now,
                ..*row
            })
        };
        old.iter().filter_map(of).collect()
    }

    /// The contacts of shapes that are still there.
    pub(crate) fn contacts(&self, old: &[Known]) -> Vec<Known> {
        let of = |contact: &Known| {
            let [a, b] = contact.colliders;
            let now = |shape: usize| self.shapes.get(shape).copied().flatten();
            let (now_a, now_b) = (now(a)?, now(b)?);
            // In another order its impulse would be that on the other shape.
            ((a < b) == (now_a < now_b)).then_some(Known {
                colliders: [now_a, now_b],
                ..*contact
            })
        };
        old.iter().filter_map(of).collect()
    }

    /// The forces of contacts whose shapes and bodies are still there.
    fn contact_forces(&self, old: impl Iterator<Item = ContactForce>) -> Vec<ContactForce> {
        let shape_now = |shape: usize| self.shapes.get(shape).copied().flatten();
        let body_now = |body: Option<usize>| match body {
            None => Some(None),
            Some(_) => self.bodies.iter().position(|b| *b == body).map(Some),
        };
        let of = |contact: ContactForce| {
            let [a, b] = contact.colliders.map(shape_now);
            let [first, second] = contact.bodies.map(body_now);
            let [partner, other] = contact.partners.map(body_now);
            Some(ContactForce {
                colliders: [a?, b?],
                bodies: [first?, second?],
                partners: [partner?, other?],
                ..contact
            })
        };
        old.filter_map(of).collect()
    }

    /// The values of the bodies, in their new order; those of new bodies are zero.
    pub(crate) fn bodies(&self, old: &[[f64; 6]]) -> Vec<[f64; 6]> {
        taken(&self.bodies, old, [0.0; 6])
    }

    /// The values of the rows with bounds, in their new order; new rows get `new`.
    pub(crate) fn bounded<T: Copy>(&self, old: &[T], new: T) -> Vec<T> {
        taken(&self.bounded, old, new)
    }
}

/// Numbers that the shapes of a scene have in a changed one.
fn shapes(old: &Scene, new: &Scene) -> Vec<Option<usize>> {
    let numbered = new.colliders.iter().enumerate();
    let now: HashMap<&str, usize> = numbered.map(|(i, shape)| (&*shape.name, i)).collect();
    let of = |shape: &Collider| now.get(&*shape.name).copied();
    old.colliders.iter().map(of).collect()
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
