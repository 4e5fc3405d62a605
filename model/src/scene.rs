//! A scene: bodies, constraints, gravity and names. Data only.

mod colliders;
mod event;
mod loads;
pub mod reeving;
mod remove;
pub mod resolution;
pub mod segments;
pub(crate) mod validate;
pub mod winding;

pub use event::{Action, Event, When};
pub use reeving::Capstan;
pub use segments::Stock;

use nalgebra::Vector3;

use crate::body::{Bodies, Body};
use crate::collide::Collider;
use crate::constraint::{Constraint, Target};
use crate::error::{SceneError, refuse};
use crate::frame::Frame;
use crate::names::near_names;

/// A named input of a scene: a speed that an operator sets, and what follows it.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Control {
    /// Its name, as the heading of its column in a table of inputs.
    pub name: String,
    /// Motors and winches that follow it.
    pub drives: Vec<Drive>,
}

impl Control {
    /// A control called `name` of whose value one motor or winch, that of constraint number `constraint`, holds the
    /// `gain`-fold as its speed.
    #[must_use]
    pub fn of(name: impl Into<String>, constraint: usize, gain: f64) -> Self {
        Self {
            name: name.into(),
            drives: vec![Drive { constraint, gain }],
        }
    }
}

/// A motor or winch that follows a [`Control`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Drive {
    /// The constraint that has the motor or the winch.
    pub constraint: usize,
    /// Speed of the motor, or at which the winch pays out, over the value of the control:
    /// without unit where the control is a speed in m/s, rad/m where a motor turns.
    pub gain: f64,
}

/// Bodies and joints of one cable of segments.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CableParts {
    /// Its name.
    pub name: String,
    /// Numbers of its segments' bodies, from its start.
    pub bodies: Vec<usize>,
    /// Numbers of its joints in the order of the scene, those at its ends included.
    pub joints: Vec<usize>,
    /// Material for further segments, if a winch or a rule splits and merges them.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub stock: Option<Stock>,
}

/// Everything that a simulation starts from. The vectors `body_names` and `constraint_names`, `groups` run parallel to
/// `bodies` and `constraints`.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Scene {
    /// Name of the scene.
    pub name: String,
    /// Acceleration of gravity, world \[m/s²].
    pub gravity: Vector3<f64>,
    /// The bodies.
    pub bodies: Bodies,
    /// Names of the bodies, all different.
    pub body_names: Vec<String>,
    /// The constraints.
    pub constraints: Vec<Constraint>,
    /// Names of the constraints, all different.
    pub constraint_names: Vec<String>,
    /// Group of each constraint, for block Gauss–Seidel over groups \[SL §VI-A].
    pub groups: Vec<u32>,
    /// The inputs, which are zero until they are set.
    pub controls: Vec<Control>,
    /// The cables of segments, and what belongs to each.
    #[cfg_attr(feature = "serde", serde(default))]
    pub cables: Vec<CableParts>,
    /// The sheaves that grip a massless cable, between the parts of it: see [`Scene::reeve`].
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    pub capstans: Vec<Capstan>,
    /// The shapes that can touch: see [`collide`](crate::collide).
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    pub colliders: Vec<Collider>,
    /// Events, which fire by themselves while a simulation runs.
    #[cfg_attr(feature = "serde", serde(default))]
    pub events: Vec<Event>,
    /// The body whose position reports follow: the load.
    pub load: Option<usize>,
    /// Starts a simulation from the static equilibrium near this pose instead of from the pose
    /// itself; velocities are those given.
    pub start_in_equilibrium: bool,
}

impl Scene {
    /// An empty scene without gravity; set [`gravity`](Self::gravity).
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Appends a body and returns its index.
    pub fn add_body(&mut self, name: impl Into<String>, body: Body) -> usize {
        self.body_names.push(name.into());
        self.bodies.push(body)
    }

    /// Appends a constraint of group `group` and returns its index.
    pub fn add_constraint(
        &mut self,
        name: impl Into<String>,
        constraint: impl Into<Constraint>,
        group: u32,
    ) -> usize {
        self.constraint_names.push(name.into());
        self.constraints.push(constraint.into());
        self.groups.push(group);
        self.constraints.len() - 1
    }

    /// Number of the body called `name`.
    ///
    /// # Errors
    /// [`SceneError::UnknownBody`] with names that there are.
    pub fn body(&self, name: &str) -> Result<usize, SceneError> {
        let found = self.body_names.iter().position(|known| known == name);
        found.ok_or_else(|| SceneError::UnknownBody {
            what: PROGRAM.to_owned(),
            name: name.to_owned(),
            known: near_names(name, &self.body_names),
        })
    }

    /// Number of the constraint called `name`: a joint, a link, a cable.
    ///
    /// # Errors
    /// [`SceneError::UnknownJoint`] with names that there are.
    pub fn constraint(&self, name: &str) -> Result<usize, SceneError> {
        let found = self.constraint_names.iter().position(|known| known == name);
        found.ok_or_else(|| SceneError::UnknownJoint {
            what: PROGRAM.to_owned(),
            name: name.to_owned(),
            known: near_names(name, &self.constraint_names),
        })
    }

    /// Number of the control called `name`.
    ///
    /// # Errors
    /// [`SceneError::UnknownControl`] with names that there are.
    pub fn control(&self, name: &str) -> Result<usize, SceneError> {
        let found = self.controls.iter().position(|c| c.name == name);
        found.ok_or_else(|| self.unknown_control(name))
    }

    /// Value of control number `control`: speed of the first motor or winch that follows it, over the gain. `None` where
    /// there is no such control, or nothing follows it.
    #[must_use]
    pub fn control_value(&self, control: usize) -> Option<f64> {
        let mut drives = self.controls.get(control)?.drives.iter();
        drives.find_map(|drive| self.drive_value(drive))
    }

    /// Value of a control by one motor or winch: its speed over its gain. `None` if the constraint
    /// is not there or has no speed to set, or if the gain is zero.
    #[must_use]
    pub fn drive_value(&self, drive: &Drive) -> Option<f64> {
        let speed = self.constraints.get(drive.constraint)?.driven_speed()?;
        // Not −0 at rest.
        (drive.gain != 0.0).then(|| speed / drive.gain + 0.0)
    }

    /// The cable of segments called `name`.
    ///
    /// # Errors
    /// [`SceneError::UnknownName`] with the names that there are.
    pub fn cable(&self, name: &str) -> Result<&CableParts, SceneError> {
        let found = self.cables.iter().find(|cable| cable.name == name);
        found.ok_or_else(|| {
            let names: Vec<_> = self.cables.iter().map(|c| c.name.clone()).collect();
            SceneError::UnknownName {
                what: "cable",
                name: name.to_owned(),
                known: near_names(name, &names),
            }
        })
    }

    /// Number of the body of segment `segment`, from 0, of the cable called `name`.
    ///
    /// # Errors
    /// A name that no cable has, a segment that it does not have.
    pub fn segment(&self, name: &str, segment: usize) -> Result<usize, SceneError> {
        if let Some(body) = self.cable(name)?.bodies.get(segment) {
            return Ok(*body);
        }
        let reason = "is not there: its segments are numbered from 0";
        refuse(format!("cable `{name}`: segment {segment}"), reason)
    }

    /// Number of the joint between segments `segment` and `segment + 1`, from 0, of the cable called `name`, whether or not
    /// it was laid with the cable.
    ///
    /// # Errors
    /// A name that no cable has, a segment that has no next one, or two that are not joined.
    pub fn joint_after(&self, name: &str, segment: usize) -> Result<usize, SceneError> {
        // The last one has no next.
        let next = segment.saturating_add(1);
        let pair = [self.segment(name, segment)?, self.segment(name, next)?];
        let joins = |c: &Constraint| {
            let sides = c.frames().iter().map(Frame::body_index);
            c.frames().len() == 2 && sides.flatten().filter(|i| pair.contains(i)).count() == 2
        };
        if let Some(joint) = self.constraints.iter().position(joins) {
            return Ok(joint);
        }
        let [a, b] = pair.map(|i| &self.body_names[i]);
        let reason = "are not joined: name a segment that has a joint to the next";
        refuse(format!("cable `{name}`: `{a}` and `{b}`"), reason)
    }

    /// Sets control number `control` to `value` from time `t` (s) on: its motors hold speeds from then on, and its winches
    /// pay out. Allocates: no.
    ///
    /// # Panics
    /// When `control` is not below the number of controls, or it drives a constraint that is not there.
    pub fn set_control(&mut self, control: usize, value: f64, t: f64) {
        for k in 0..self.controls[control].drives.len() {
            self.set_drive(self.controls[control].drives[k], value, t);
        }
    }

    /// Sets the speed of one motor or winch to `value` times its gain from time `t` (s) on.
    ///
    /// # Panics
    /// When it drives a constraint that is not there.
    pub fn set_drive(&mut self, drive: Drive, value: f64, t: f64) {
        self.cut_at_winch(drive.constraint, t, 0.0);
        let (speed, constraint) = (value * drive.gain, &mut self.constraints[drive.constraint]);
        if let Some((winch, length)) = constraint.winch_mut(t) {
            winch.set_speed(speed, length);
        } else if let Some(motor) = constraint.motor_mut() {
            motor.target = Target::Speed(speed);
        }
    }

    /// Numbers of the bodies that forces move: those that have a mass to speak of.
    pub fn dynamic_bodies(&self) -> impl Iterator<Item = usize> {
        (0..self.bodies.len()).filter(|&i| self.bodies.is_dynamic(i))
    }

    /// Kinetic energy of the dynamic bodies \[J].
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        self.dynamic_bodies()
            .map(|i| self.bodies.kinetic_energy(i))
            .sum()
    }

    /// Potential energy of gravity of the dynamic bodies \[J], −Σ m g·x: zero for a body at the origin.
    #[must_use]
    pub fn potential_energy(&self) -> f64 {
        let (mass, position) = (&self.bodies.mass, &self.bodies.position);
        self.dynamic_bodies()
            .map(|i| -mass[i] * self.gravity.dot(&position[i]))
            .sum()
    }

    /// Linear momentum of the dynamic bodies, world \[kg m/s].
    #[must_use]
    pub fn momentum(&self) -> Vector3<f64> {
        let (mass, velocity) = (&self.bodies.mass, &self.bodies.velocity);
        self.dynamic_bodies().map(|i| velocity[i] * mass[i]).sum()
    }

    /// Angular momentum of the dynamic bodies about the world point `about` (m), world \[kg m²/s].
    #[must_use]
    pub fn angular_momentum(&self, about: &Vector3<f64>) -> Vector3<f64> {
        let bodies = &self.bodies;
        self.dynamic_bodies()
            .map(|i| {
                let orbital = (bodies.position[i] - about).cross(&bodies.velocity[i]);
                orbital * bodies.mass[i] + bodies.inertia_world(i) * bodies.angular_velocity[i]
            })
            .sum()
    }

    /// Mass of the dynamic bodies \[kg].
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.dynamic_bodies().map(|i| self.bodies.mass[i]).sum()
    }
}

/// Who names what is looked up.
const PROGRAM: &str = "the program";

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn two() -> Scene {
        let mut scene = Scene::new("two");
        scene.gravity = Vector3::new(0.0, 0.0, -10.0);
        let mut a = Body::new(2.0, Matrix3::identity()).at(Vector3::new(1.0, 0.0, 3.0));
        a.velocity = Vector3::new(0.0, 2.0, 0.0);
        scene.add_body("a", a);
        let mut b = Body::new(1.0, Matrix3::identity() * 4.0);
        b.angular_velocity = Vector3::new(0.0, 0.0, 3.0);
        scene.add_body("b", b);
        scene
    }

    #[test]
    fn energies_and_momenta() {
        let scene = two();
        assert_eq!(scene.mass(), 3.0);
        assert_eq!(scene.kinetic_energy(), 4.0 + 18.0);
        assert_eq!(scene.potential_energy(), 60.0);
        assert_eq!(scene.momentum(), Vector3::new(0.0, 4.0, 0.0));
        let l = scene.angular_momentum(&Vector3::zeros());
        assert_eq!(l, Vector3::new(-12.0, 0.0, 4.0 + 12.0));
        // Moving the reference point by d changes L by −d × p.
        let d = Vector3::new(0.0, 0.0, 3.0);
        let moved = l - d.cross(&scene.momentum());
        assert_eq!(scene.angular_momentum(&d), moved);
    }

    #[test]
    fn what_has_a_name_is_found_by_it() {
        let gantry = crate::GantryParams::default().build().expect("builds");
        assert_eq!(gantry.body("trolley"), Ok(1));
        let rail = gantry.constraint("top").expect("there");
        assert_eq!(gantry.constraint_names[rail], "top");
        assert_eq!(gantry.control("hoist_speed"), Ok(1));
        let says = |error: SceneError, words: &str| assert_eq!(error.to_string(), words);
        says(
            two().body("c").expect_err("no c"),
            "the program names the body `c`, which is not there: choose one of a, b",
        );
        let no_top = gantry.constraint("Top").expect_err("no Top").to_string();
        let holds = no_top.contains("`Top`") && no_top.contains("top");
        assert!(holds, "{no_top}");
        says(
            gantry.control("slew").expect_err("no slew"),
            "no control is called `slew`: choose one of trolley_speed, hoist_speed",
        );
        says(
            two().control("slew").expect_err("none"),
            "no control is called `slew`: the scene has none",
        );
    }

    #[test]
    fn a_control_has_the_value_that_it_was_set_to() {
        let mut gantry = crate::GantryParams::default().build().expect("builds");
        assert_eq!(gantry.control_value(1), Some(0.0));
        gantry.set_control(1, -0.75, 2.0);
        assert_eq!(gantry.control_value(1), Some(-0.75));
        assert_eq!(gantry.control_value(2), None);
    }
}
