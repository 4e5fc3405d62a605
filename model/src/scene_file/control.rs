//! Controls of explicit scenes: named inputs, and the motors and winches that follow them.

use serde::{Deserialize, Serialize};

use super::build::Entry;
use super::keys::described;
use super::places::Fault;
use crate::error::SceneError;
use crate::names::near_names;
use crate::scene::{Control, Drive, Scene};

described! {
    /// A named input: a speed that an operator sets.
    #[derive(Default)]
    pub struct ControlEntry {
        /// Its name, the heading of its column in a table of inputs.
        pub name: String,
        /// Motors and winches that follow it, each `{ joint = "…", gain = … }`: a joint whose motor
        /// holds a speed, or a cable with a winch, and its speed over the value of the control (default
        /// 1).
        pub drives: Vec<DriveEntry>,
    }
}

/// A motor or winch that follows a control.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveEntry {
    /// Name of the joint or cable.
    pub joint: String,
    /// Speed of its motor, or at which its winch pays out, over the value of the control: without unit, or
    /// rad/m where a motor turns.
    #[serde(default = "one")]
    pub gain: f64,
}

fn one() -> f64 {
    1.0
}

impl ControlEntry {
    /// The control of a scene that has its constraints.
    pub(super) fn build(&self, scene: &Scene) -> Result<Control, Fault> {
        let of = Entry::new("control", &self.name);
        let drives = self.drives.iter().enumerate();
        let drives = drives.map(|(i, drive)| drive.build(&of, i, scene));
        let (name, drives) = (self.name.clone(), drives.collect::<Result<_, Fault>>()?);
        Ok(Control { name, drives })
    }

    /// The control as it is written.
    pub(super) fn of(control: &Control, scene: &Scene) -> Self {
        let written = |drive: &Drive| DriveEntry {
            joint: scene.constraint_names[drive.constraint].clone(),
            gain: drive.gain,
        };
        Self {
            name: control.name.clone(),
            drives: control.drives.iter().map(written).collect(),
        }
    }
}

impl DriveEntry {
    /// Drive number `i` of the control `of`.
    fn build(&self, of: &Entry<'_>, i: usize, scene: &Scene) -> Result<Drive, Fault> {
        let names = &scene.constraint_names;
        // The name of a cable of segments stands for the winch at its first joint.
        let of_cable = scene.cables.iter().find(|cable| cable.name == self.joint);
        let at_winch = || of_cable.and_then(|cable| cable.joints.first().copied());
        let named = names.iter().position(|name| *name == self.joint);
        let Some(constraint) = named.or_else(at_winch) else {
            let followers = (0..names.len()).filter(|&i| scene.constraints[i].follows_speed());
            let followers: Vec<_> = followers.map(|i| names[i].clone()).collect();
            let error = SceneError::UnknownJoint {
                what: of.what("drives"),
                name: self.joint.clone(),
                known: near_names(&self.joint, &followers),
            };
            return Err(Fault::new(format!("drives.{i}.joint"), error));
        };
        if !scene.constraints[constraint].follows_speed() {
            let reason =
                "has neither a motor with a speed nor a winch: give it one, or name one that has";
            return Err(of.conflict(&format!("drives.{i}.joint"), reason));
        }
        of.check(&format!("drives.{i}.gain"), self.gain, true, "finite")?;
        let gain = self.gain;
        Ok(Drive { constraint, gain })
    }
}
