//! Checks a scene before it is simulated.

use std::collections::{HashMap, HashSet};

use nalgebra::Matrix3;

use super::{CableParts, Scene};
use crate::body::{Bodies, Mobility};
use crate::constraint::{Constraint, MasslessCable, Sheave, side_name};
use crate::error::{SceneError, check, check_length, refuse};
use crate::frame::{Frame, Side};
use crate::motion::Motion;
use crate::names::{first_names, near_names};

/// Requirement on an angular velocity or a torque of a point mass.
const NEVER_TURNS: &str = "0 for a point mass: give the body a shape or an inertia";

/// Cure of a joint without rows.
pub(crate) const ROWS: &str = "give it at least one of stretch, bend, twist";

/// Largest deviation of AᵀA from the identity that a frame's axes may have.
const AXES_TOLERANCE: f64 = 1e-9;

impl Bodies {
    /// Checks position, orientation and velocities of body number `i`, which errors call `name`: finite, of unit norm, none of
    /// a static body, and no rotation of a point mass. Allocates for an error only.
    ///
    /// # Errors
    /// [`SceneError::BadValue`] with the body and the quantity.
    ///
    /// # Panics
    /// Where there is no body `i`.
    pub fn validate_state(&self, i: usize, name: &str) -> Result<(), SceneError> {
        let of = |quantity: &str| format!("body `{name}`: {quantity}");
        finite(|| of("position"), self.position[i].iter())?;
        let turning = &self.angular_velocity[i];
        for (key, rate) in [
            ("velocity", &self.velocity[i]),
            ("angular_velocity", turning),
        ] {
            finite(|| of(key), rate.iter())?;
            if self.mobility[i] == Mobility::Static && rate.amax() != 0.0 {
                let needs = "0 for a static body: make it driven to move it";
                check(of(key), rate.amax(), false, needs)?;
            }
        }
        if self.is_point(i) && turning.amax() != 0.0 {
            check(of("angular_velocity"), turning.amax(), false, NEVER_TURNS)?;
        }
        let norm = self.orientation[i].as_vector().norm();
        if norm.is_nan() || (norm - 1.0).abs() > 1e-9 {
            let needs = "a unit quaternion (scalar first)";
            check(of("norm of the orientation"), norm, false, needs)?;
        }
        Ok(())
    }
}

impl Scene {
    /// Checks that the scene can be simulated: finite numbers, positive masses, definite inertias, orthonormal axes,
    /// joints with rows between two different sides, links with a length, different names.
    ///
    /// # Errors
    /// The first fault found, with the body or joint that has it.
    pub fn validate(&self) -> Result<(), SceneError> {
        if self.bodies.is_empty() {
            return refuse("the scene has no bodies", "give it at least one [[body]]");
        }
        self.validate_lengths()?;
        unique("body", self.body_names.iter())?;
        unique("joint", self.constraint_names.iter())?;
        finite(|| "gravity".into(), self.gravity.iter())?;
        for i in 0..self.bodies.len() {
            self.validate_body(i)?;
        }
        for i in 0..self.constraints.len() {
            self.validate_constraint(i)?;
        }
        self.validate_capstans()?;
        self.validate_controls()?;
        self.validate_cables()?;
        self.validate_colliders()?;
        self.validate_events()?;
        match self.load {
            Some(i) if i >= self.bodies.len() => Err(self.unknown_body("load", i)),
            _ => Ok(()),
        }
    }

    fn validate_controls(&self) -> Result<(), SceneError> {
        unique("control", self.controls.iter().map(|c| &c.name))?;
        let mut driven_by: HashMap<usize, &str> = HashMap::new();
        for control in &self.controls {
            let what = || format!("control `{}`", control.name);
            if control.name == "time" {
                let reason = "stands for the time in tables of inputs: take another name";
                return refuse(what(), reason);
            }
            if control.drives.iter().all(|drive| drive.gain == 0.0) {
                let reason = "drives nothing: give at least one drive, with a gain that is not 0";
                return refuse(what(), reason);
            }
            for drive in &control.drives {
                check(format!("{}: gain", what()), drive.gain, true, "a number")?;
                let what = || format!("{}: `{}`", what(), self.constraint_name(drive.constraint));
                if driven_by.insert(drive.constraint, &control.name).is_some() {
                    let reason = "is driven already, by this control or another: keep one of them";
                    return refuse(what(), reason);
                }
                let constraint = self.constraints.get(drive.constraint);
                if !constraint.is_some_and(Constraint::follows_speed) {
                    let reason = "drives what has neither a motor that holds a speed nor a winch: name a joint or cable that has";
                    return refuse(what(), reason);
                }
            }
        }
        Ok(())
    }

    fn validate_cables(&self) -> Result<(), SceneError> {
        unique("cable", self.cables.iter().map(|c| &c.name))?;
        let leads = |cable: &CableParts, i: usize| {
            cable.joints.first() == Some(&i) && cable.stock.is_some()
        };
        let alone = |i: &usize| !self.cables.iter().any(|cable| leads(cable, *i));
        if let Some(i) = self.fairleads().find(alone) {
            let reason =
                "is a winch without a cable: contact a cable with a winch by `Scene::add_cable`";
            return refuse(format!("joint `{}`", self.constraint_names[i]), reason);
        }
        let mut segments = HashSet::new();
        for cable in &self.cables {
            let what = format!("cable `{}`", cable.name);
            let (bodies, joints) = (self.bodies.len(), self.constraints.len());
            if let Some(i) = cable.bodies.iter().find(|i| **i >= bodies) {
                return Err(self.unknown_body(&what, *i));
            }
            if let Some(i) = cable.joints.iter().find(|i| **i >= joints) {
                return Err(self.unknown_constraint(&what, *i));
            }
            if let Some(stock) = &cable.stock {
                stock.validate(|| what.clone())?;
                if let Some(i) = cable.bodies.iter().find(|i| !segments.insert(**i)) {
                    let reason = "is a segment twice: list it once, in one cable";
                    return refuse(format!("{what}: body `{}`", self.body_names[*i]), reason);
                }
            }
        }
        Ok(())
    }

    pub(super) fn constraint_name(&self, i: usize) -> &str {
        self.constraint_names.get(i).map_or("?", String::as_str)
    }

    fn validate_lengths(&self) -> Result<(), SceneError> {
        let (n, m) = (self.bodies.len(), self.constraints.len());
        let bodies = self.bodies.lengths().map(|(what, got)| (what, got, n));
        let others = [
            ("body_names", self.body_names.len(), n),
            ("constraint_names", self.constraint_names.len(), m),
            ("groups", self.groups.len(), m),
        ];
        let mut all = bodies.chain(others);
        all.try_for_each(|(what, got, expected)| check_length(what, got, expected))
    }

    pub(crate) fn validate_body(&self, i: usize) -> Result<(), SceneError> {
        let b = &self.bodies;
        let of = |quantity: &str| format!("body `{}`: {quantity}", self.body_names[i]);
        if !(b.mass[i] > 0.0 && b.mass[i].is_finite()) {
            check(of("mass"), b.mass[i], false, "> 0 kg")?;
        }
        if b.mass[i] < f64::MIN_POSITIVE {
            let needs = "≥ 2.3e-308 kg, so that 1/m is finite";
            check(of("mass"), b.mass[i], false, needs)?;
        }
        b.validate_state(i, &self.body_names[i])?;
        finite(|| of("force"), b.force[i].iter())?;
        finite(|| of("torque"), b.torque[i].iter())?;
        finite(|| of("inertia"), b.inertia[i].iter())?;
        let torque = b.torque[i].amax();
        if b.is_point(i) && torque != 0.0 {
            check(of("torque"), torque, false, NEVER_TURNS)?;
        }
        // The inertia of a held body takes no part.
        if b.inertia[i] == Matrix3::zeros() {
            return Ok(());
        }
        match least_pivot(&b.inertia[i]) {
            None => Err(SceneError::Inertia {
                body: self.body_names[i].clone(),
            }),
            Some(least) if least < f64::MIN_POSITIVE => {
                let needs = "≥ 2.3e-308 kg m² about every axis, so that 1/I is finite";
                check(of("inertia"), least, false, needs)
            }
            Some(_) => Ok(()),
        }
    }

    pub(crate) fn validate_constraint(&self, i: usize) -> Result<(), SceneError> {
        self.check_constraint(&self.constraint_names[i], &self.constraints[i])
    }

    /// Checks a constraint called `joint` that is part of the scene, or is to be.
    pub(super) fn check_constraint(&self, joint: &str, c: &Constraint) -> Result<(), SceneError> {
        let of = |quantity: &str| format!("joint `{joint}`: {quantity}");
        if c.rows() == 0 {
            return refuse(format!("joint `{joint}` has no rows"), ROWS);
        }
        for (_, law) in (0..c.rows()).map(|row| c.row(row)) {
            if !(law.compliance >= 0.0 && law.compliance.is_finite()) {
                let needs = "≥ 0 (m/N or rad/(N m)); 0 is rigid";
                check(of("compliance"), law.compliance, false, needs)?;
            }
            if !(law.damping >= 0.0 && law.damping.is_finite()) {
                check(of("damping"), law.damping, false, "≥ 0 s")?;
            }
        }
        c.validate(&|| format!("joint `{joint}`"))?;
        self.check_sides(joint, c)?;
        for (i, frame) in c.frames().iter().enumerate() {
            let letter = u32::try_from(i)
                .ok()
                .and_then(|i| char::from_digit(i + 10, 36));
            let side = letter.map_or_else(|| (i + 1).to_string(), String::from);
            self.validate_frame(joint, &side, frame)?;
        }
        if let Constraint::MasslessCable(cable) = c {
            self.check_sheaves(joint, cable)?;
        }
        self.check_points(joint, c)
    }

    /// Refuses a constraint between sides that do not move against each other, unless it passes a tension on.
    fn check_sides(&self, joint: &str, c: &Constraint) -> Result<(), SceneError> {
        let of = |quantity: &str| format!("joint `{joint}`: {quantity}");
        let sides = c.frames().len();
        let points = "at least 2 attachment points";
        check(of("number of sides"), sides as f64, sides >= 2, points)?;
        let mobility = &self.bodies.mobility;
        // One that is not there is found below.
        let dynamic = |i: usize| mobility.get(i).is_none_or(|m| *m == Mobility::Dynamic);
        // A part between two sheaves of one body passes tensions on.
        let is_part = matches!(c, Constraint::MasslessCable(part) if part.is_part());
        let passes = is_part && c.row(0).1.compliance > 0.0;
        let first = c.frames().first().map(Frame::body_index);
        let one = c.frames().iter().all(|f| Some(f.body_index()) == first);
        let rests = !c.bodies().any(dynamic);
        if is_part && !passes && (rests || one) {
            let reason = "is undetermined in a rigid part between points that no forces move apart, as two sheaves of one body: give \
                          the cable a stiffness `ea`";
            return refuse(of("tension"), reason);
        }
        let joint = joint.to_owned();
        // A body that is not there is found below.
        match first.flatten().and_then(|i| self.body_names.get(i)) {
            _ if passes => Ok(()),
            _ if rests => Err(SceneError::BothWorld { joint }),
            Some(body) if one => Err(SceneError::SameBody {
                joint,
                body: body.clone(),
            }),
            _ => Ok(()),
        }
    }

    fn check_sheaves(&self, joint: &str, cable: &MasslessCable) -> Result<(), SceneError> {
        let of = format!("joint `{joint}`");
        cable.check_path(&self.bodies, 0.0, &of)?;
        let grips = |s: &Option<Sheave>| s.is_some_and(|s| s.friction > 0.0 && !s.contact.is_off());
        let side = cable.sheaves.iter().position(grips);
        side.map_or(Ok(()), |side| {
            let reason = "has friction: a cable has one tension, and is cut there: add it with `Scene::reeve`";
            refuse(side_name(&of, side), reason)
        })
    }

    /// Refuses a constraint that would turn a point mass.
    fn check_points(&self, joint: &str, c: &Constraint) -> Result<(), SceneError> {
        for (side, frame) in c.frames().iter().enumerate() {
            let body = frame.body_index().filter(|body| *body < self.bodies.len());
            let point = body.filter(|body| self.bodies.is_point(*body));
            if let Some(body) = point.filter(|_| !c.only_pulls(side) || frame.point.amax() != 0.0) {
                let reason = "would turn a point mass: give the body a shape or an inertia, or attach a ball joint, link or \
                             massless cable at its centre";
                let body = &self.body_names[body];
                return refuse(format!("joint `{joint}` of body `{body}`"), reason);
            }
        }
        Ok(())
    }

    fn validate_frame(&self, joint: &str, side: &str, frame: &Frame) -> Result<(), SceneError> {
        let of = |quantity: &str| format!("joint `{joint}`: {quantity} of side {side}");
        finite(|| of("attachment point"), frame.point.iter())?;
        match &frame.side {
            Side::Body(i) if *i >= self.bodies.len() => {
                return Err(self.unknown_body(&format!("joint `{joint}`"), *i));
            }
            Side::Body(_) => {}
            Side::World(motion) => validate_motion(of, motion)?,
        }
        let axes = &frame.axes;
        let skew = (axes.transpose() * axes - Matrix3::identity()).amax();
        // amax ignores NaN: ask the entries themselves.
        let error = if axes.iter().all(|e| e.is_finite()) {
            skew.max((axes.determinant() - 1.0).abs())
        } else {
            f64::INFINITY
        };
        if error <= AXES_TOLERANCE {
            return Ok(());
        }
        Err(SceneError::Axes {
            joint: joint.into(),
            side: side.into(),
            error,
        })
    }

    pub(crate) fn unknown_control(&self, name: &str) -> SceneError {
        let names: Vec<_> = self.controls.iter().map(|c| c.name.clone()).collect();
        SceneError::UnknownControl {
            name: name.to_owned(),
            known: near_names(name, &names),
        }
    }

    pub(crate) fn unknown_constraint(&self, what: &str, index: usize) -> SceneError {
        SceneError::UnknownJoint {
            what: what.into(),
            name: format!("number {index}"),
            known: first_names(&self.constraint_names),
        }
    }

    pub(crate) fn unknown_body(&self, what: &str, index: usize) -> SceneError {
        SceneError::UnknownBody {
            what: what.into(),
            name: format!("number {index}"),
            known: first_names(&self.body_names),
        }
    }
}

pub(crate) fn validate_motion(
    of: impl Fn(&str) -> String,
    motion: &Motion,
) -> Result<(), SceneError> {
    let (what, value, needs) = match motion.fault() {
        None => return Ok(()),
        Some((_, span, true)) => {
            let needs = "> 0 s (duration, period, run-up)";
            ("time span of the motion", span, needs)
        }
        Some((_, number, false)) => ("motion", number, "finite"),
    };
    check(of(what), value, false, needs)
}

/// Refuses two equal names.
pub(crate) fn unique<'a>(
    kind: &'static str,
    mut names: impl Iterator<Item = &'a String>,
) -> Result<(), SceneError> {
    let mut seen = HashSet::new();
    let twice = names.find(|name| !seen.insert(name.as_str())).cloned();
    twice.map_or(Ok(()), |name| Err(SceneError::Duplicate { kind, name }))
}

fn finite<'a>(
    what: impl Fn() -> String,
    mut values: impl Iterator<Item = &'a f64>,
) -> Result<(), SceneError> {
    let bad = values.find(|v| !v.is_finite());
    bad.map_or(Ok(()), |value| check(what(), *value, false, "finite"))
}

/// Least pivot of the Cholesky factor \[kg m²]; none of an inertia that is not symmetric to rounding, or not definite.
fn least_pivot(inertia: &Matrix3<f64>) -> Option<f64> {
    if (inertia - inertia.transpose()).amax() > 1e-12 * inertia.amax() {
        return None;
    }
    let roots = inertia.cholesky()?.l_dirty().diagonal();
    Some(roots.map(|root| root * root).min())
}

#[cfg(test)]
mod tests;
