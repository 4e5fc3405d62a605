//! The explicit text of a scene that is already built.
//!
//! Every number is written as it is, and what a text leaves out is left out only where the default has the same bits.
//! The text is built again and compared, so that nothing can be forgotten here.

use std::collections::HashMap;

use nalgebra::Matrix3;

use super::build::WORLD;
use super::collide::ColliderEntry;
use super::control::ControlEntry;
use super::entries::{BodyEntry, SceneText, written};
use super::event::EventEntry;
use super::joint::JointEntry;
use super::points::{BendEntry, MasslessCableEntry, PointEntry, SheaveEntry};
use crate::body::{Body, Mobility};
use crate::constraint::{Constraint, MasslessCable, Sheave};
use crate::error::{SceneError, refuse};
use crate::frame::{Frame, Side, hanging_axes};
use crate::motion::Motion;
use crate::scene::{CableParts, Capstan, Scene};

impl SceneText {
    /// The text of `scene`, which builds to an equal scene, bit for bit.
    ///
    /// # Errors
    /// The fault of a scene that is not valid; [`SceneError::Conflict`] names what a text cannot hold.
    pub fn from_scene(scene: &Scene) -> Result<Self, SceneError> {
        scene.validate()?;
        let (body_names, constraint_names) = (&scene.body_names, &scene.constraint_names);
        let cannot = |what: String, cure| refuse(format!("a text cannot hold {what}"), cure);
        let as_cable = "leave it out, or write the cable as `[[cable]]`";
        if let Some(i) = scene.fairleads().next() {
            let what = format!(
                "the winch of a cable of segments, `{}`",
                constraint_names[i]
            );
            return cannot(what, as_cable);
        }
        let ruled =
            |cable: &&CableParts| cable.stock.as_ref().is_some_and(|s| s.resolution.is_some());
        if let Some(CableParts { name, .. }) = scene.cables.iter().find(ruled) {
            let what = format!("the rule of resolution of the cable `{name}`");
            return cannot(what, as_cable);
        }
        let [segments, joined] = memberships(scene);
        if body_names.iter().any(|name| name == WORLD) {
            let what = format!("a body called `{WORLD}`, which stands for the fixed world");
            return cannot(what, "rename it");
        }
        let mut text = Self {
            name: scene.name.clone(),
            gravity: scene.gravity.into(),
            equilibrium: scene.start_in_equilibrium,
            load: scene.load.map(|i| body_names[i].clone()),
            ..Self::default()
        };
        for (i, name) in body_names.iter().enumerate() {
            let mut entry = body(name, &scene.bodies.get(i));
            entry.cable = segments[i].map(str::to_owned);
            text.body.push(entry);
        }
        for (i, name) in constraint_names.iter().enumerate() {
            text.push(scene, name, &scene.constraints[i], scene.groups[i]);
        }
        for Capstan { parts, friction } in &scene.capstans {
            let [before, after] = parts.map(|i| &constraint_names[i]);
            let part = text.massless_cable.iter_mut().find(|c| c.name == *after);
            if let Some(part) = part {
                part.after = Some(before.clone());
                let first = part.through.first_mut();
                if let Some(sheave) = first.and_then(|point| point.sheave.as_mut()) {
                    sheave.friction = *friction;
                }
            }
        }
        let joint_of: HashMap<_, _> = constraint_names.iter().zip(joined).collect();
        for entry in &mut text.joint {
            entry.cable = joint_of[&entry.name].map(str::to_owned);
        }
        let joints = text.joint.iter().map(|entry| &entry.name);
        let cables = text.massless_cable.iter().map(|entry| &entry.name);
        let bends = text.bend.iter().map(|entry| &entry.name);
        if !joints.chain(cables).chain(bends).eq(constraint_names) {
            text.order.clone_from(constraint_names);
        }
        let collider = |collider| ColliderEntry::of(collider, scene);
        text.collider = scene.colliders.iter().map(collider).collect();
        let control = |control| ControlEntry::of(control, scene);
        text.control = scene.controls.iter().map(control).collect();
        let event = |event| EventEntry::of(event, scene);
        text.event = scene.events.iter().map(event).collect();
        match difference(&text.build()?, scene) {
            None => Ok(text),
            Some(what) => cannot(what, "leave it out, or build the scene by program"),
        }
    }

    /// Appends a constraint to the list that it belongs to.
    fn push(&mut self, scene: &Scene, name: &str, constraint: &Constraint, group: u32) {
        match constraint {
            Constraint::MasslessCable(cable) => {
                let entry = MasslessCableEntry::of(scene, name, cable, group);
                self.massless_cable.push(entry);
            }
            Constraint::LinkBend(bend) => self.bend.push(BendEntry {
                name: name.to_owned(),
                through: points(scene, &bend.frames),
                definition: bend.definition,
                bend: bend.law.compliance,
                damping: bend.law.damping,
                group: Some(group),
            }),
            joint => self.joint.extend(JointEntry::of(scene, name, joint, group)),
        }
    }
}

fn body(name: &str, body: &Body) -> BodyEntry {
    let diagonal = body.inertia.diagonal();
    let principal = same_bits(&Matrix3::from_diagonal(&diagonal), &body.inertia);
    let (held, fixed) = (body.mobility != Mobility::Dynamic, Body::fixed());
    let left_out = held && same_bits(&body.inertia, &fixed.inertia);
    let mass_left_out = held && body.mass.to_bits() == fixed.mass.to_bits();
    BodyEntry {
        name: name.to_owned(),
        mobility: body.mobility,
        mass: (!mass_left_out).then_some(body.mass),
        inertia: (principal && !left_out).then(|| diagonal.into()),
        inertia_matrix: (!principal).then(|| body.inertia.transpose().into()),
        position: body.position.into(),
        orientation: written(&body.orientation),
        velocity: body.velocity.into(),
        angular_velocity: body.angular_velocity.into(),
        force: body.force.into(),
        torque: body.torque.into(),
        ..BodyEntry::default()
    }
}

pub(super) fn same_bits(a: &Matrix3<f64>, b: &Matrix3<f64>) -> bool {
    a.map(f64::to_bits) == b.map(f64::to_bits)
}

/// The name of what holds a frame, and its motion.
pub(super) fn side(scene: &Scene, frame: &Frame) -> (String, Option<Motion>) {
    match &frame.side {
        Side::World(motion) => {
            let motion = Some(*motion).filter(|motion| *motion != Motion::Fixed);
            (WORLD.to_owned(), motion)
        }
        Side::Body(i) => (scene.body_names[*i].clone(), None),
    }
}

fn points(scene: &Scene, frames: &[Frame]) -> Vec<PointEntry> {
    let points = frames.iter().map(|frame| PointEntry::of(frame, scene));
    points.collect()
}

impl MasslessCableEntry {
    /// The cable as it is written.
    fn of(scene: &Scene, name: &str, cable: &MasslessCable, group: u32) -> Self {
        let first = scene.constraint(name).ok();
        Self {
            name: name.to_owned(),
            through: over(points(scene, &cable.frames), &cable.sheaves),
            length: Some(cable.length),
            strained: first
                .and_then(|first| scene.check_short(first).err())
                .map(|_| true),
            stretch: Some(cable.law.compliance),
            damping: cable.law.damping,
            tension_only: (!cable.tension_only).then_some(false),
            winch: cable.winch,
            group: Some(group),
            ..Self::default()
        }
    }
}

/// The points with the sheaves that have their hubs there.
fn over(mut points: Vec<PointEntry>, sheaves: &[Option<Sheave>]) -> Vec<PointEntry> {
    for (point, sheave) in points.iter_mut().zip(sheaves) {
        point.sheave = sheave.as_ref().map(SheaveEntry::of);
        // In place of the axis, which no sheave goes without.
        let axes = sheave.map(|_| hanging_axes().into());
        point.axes = point.axes.or(axes);
    }
    points
}

impl PointEntry {
    /// The point as it is written.
    pub(super) fn of(frame: &Frame, scene: &Scene) -> Self {
        let (body, motion) = side(scene, frame);
        let hanging = same_bits(&frame.axes, &hanging_axes());
        Self {
            body,
            point: frame.point.into(),
            axes: (!hanging).then(|| frame.axes.into()),
            motion,
            sheave: None,
        }
    }
}

/// Names of the cables that bodies and constraints belong to.
fn memberships(scene: &Scene) -> [Vec<Option<&str>>; 2] {
    let mut bodies = vec![None; scene.bodies.len()];
    let mut joints = vec![None; scene.constraints.len()];
    for cable in &scene.cables {
        let name = Some(&*cable.name);
        cable.bodies.iter().for_each(|i| bodies[*i] = name);
        cable.joints.iter().for_each(|i| joints[*i] = name);
    }
    [bodies, joints]
}

/// The first thing in which two scenes of the same size differ.
fn difference(built: &Scene, scene: &Scene) -> Option<String> {
    if built == scene {
        return None;
    }
    /// Number of the first own entry that differs from the one built.
    fn first<T: PartialEq>(built: &[T], own: &[T]) -> Option<usize> {
        let mut both = own.iter().zip(built);
        both.position(|(own, built)| own != built)
    }
    let [of_built, own] = [built, scene].map(|scene| {
        let all = (0..scene.bodies.len()).map(|i| scene.bodies.get(i));
        all.collect::<Vec<Body>>()
    });
    let cable = scene.cables.iter().find(|c| !built.cables.contains(c));
    let body = first(&of_built, &own).map(|i| &scene.body_names[i]);
    let control = first(&built.controls, &scene.controls).map(|i| &scene.controls[i].name);
    let event = first(&built.events, &scene.events).map(|i| &scene.events[i].name);
    let collider = first(&built.colliders, &scene.colliders).map(|i| &scene.colliders[i].name);
    let joint = first(&built.constraints, &scene.constraints).map(|i| &scene.constraint_names[i]);
    let all = [
        ("body", body),
        ("control", control),
        ("event", event),
        ("collider", collider),
        ("cable", cable.map(|cable| &cable.name)),
        ("constraint", joint),
    ];
    let found = all.iter().find_map(|(kind, name)| Some((kind, (*name)?)));
    Some(found.map_or_else(
        || "something of the scene as a whole".to_owned(),
        |(kind, name)| format!("something of the {kind} `{name}`"),
    ))
}
