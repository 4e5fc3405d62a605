//! Events of explicit scenes.

use serde::{Deserialize, Serialize};

use super::build::{Entry, Names};
use super::keys::described;
use super::places::Fault;
use super::points::{ONLY_CABLES, PointEntry};
use crate::error::SceneError;
use crate::frame::Frame;
use crate::scene::{Action, Event, Scene, When};

described! {
    /// Something that happens once, at the end of the first step in which its condition, one of `at`, `force` and `distance`,
    /// holds.
    #[derive(Default)]
    pub struct EventEntry {
        /// Its name.
        pub name: String,
        /// Condition: from this time on \[s]. It acts at the end of the step that this time falls in.
        pub at: Option<f64>,
        /// Condition: the tension of a joint or massless cable, or the force of one that has none, exceeds `above` \[N]:
        /// `{ joint = "…", above = … }`.
        pub force: Option<ForceEntry>,
        /// Condition: two points are nearer than `below` \[m]: `{ a = { body = "…", point = [x, y, z] }, b = …, below = … }`.
        pub distance: Option<DistanceEntry>,
        /// Constraints that let go, by their names: joints, links and cables of the scene, and what this or another event
        /// attaches. A name that is not there at that time is passed over. Of one event what it releases goes before what it
        /// attaches.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub release: Vec<String>,
        /// Rigid links of the distance at that time, each `{ name = "…", a = { body = "…", point = [x, y, z] }, b = … }`. Several
        /// events may attach one name, each in turn: what it tied before lets go first. Example: `attach = [{ name = "grip", a =
        /// { body = "hook" }, b = { body = "crate" } }]` in one event, `release = ["grip"]` in a later one.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub attach: Vec<AttachEntry>,
        /// Controls that are set, each `{ control = "…", value = … }`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub set: Vec<SetEntry>,
    }
}

/// A force that an event waits for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceEntry {
    /// Name of the joint or massless cable.
    pub joint: String,
    /// The limit \[N].
    pub above: f64,
}

/// A distance that an event waits for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DistanceEntry {
    /// A point.
    pub a: PointEntry,
    /// Another one.
    pub b: PointEntry,
    /// The limit \[m].
    pub below: f64,
}

/// A link that an event makes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttachEntry {
    /// Name of the new constraint.
    pub name: String,
    /// A point.
    pub a: PointEntry,
    /// Another one.
    pub b: PointEntry,
}

/// A control that an event sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetEntry {
    /// Name of the control.
    pub control: String,
    /// Its value, a speed \[m/s or rad/s].
    pub value: f64,
}

impl EventEntry {
    /// The event of a scene that has its constraints and controls.
    pub(super) fn build(
        &self,
        scene: &Scene,
        names: &Names<'_>,
        all: &[Self],
    ) -> Result<Event, Fault> {
        let of = Entry::new("event", &self.name);
        let ties = || all.iter().flat_map(|event| &event.attach);
        let attached = || ties().map(|tie| &tie.name);
        let at = |key: &str| {
            let (key, what) = (key.to_owned(), format!("event `{}`", self.name));
            move |error: SceneError| match error {
                SceneError::UnknownJoint {
                    name, mut known, ..
                } => {
                    if key == "release" {
                        known.extend(attached().cloned());
                        known.dedup();
                    }
                    Fault::new(key, SceneError::UnknownJoint { what, name, known })
                }
                other => Fault::new(key, other),
            }
        };
        let points = |key: &str, ends: [&PointEntry; 2]| -> Result<Box<[Frame; 2]>, Fault> {
            if ends.iter().any(|point| point.sheave.is_some()) {
                return Err(of.conflict(key, ONLY_CABLES));
            }
            let [a, b] = ends;
            let a = a.frame_at(&of, &format!("{key}.a"), names)?;
            Ok(Box::new([a, b.frame_at(&of, &format!("{key}.b"), names)?]))
        };
        let when = match (self.at, &self.force, &self.distance) {
            (Some(time), None, None) => When::Time(time),
            (None, Some(ForceEntry { joint, above }), None) => When::Force {
                constraint: scene.constraint(joint).map_err(at("force.joint"))?,
                above: *above,
            },
            (None, None, Some(DistanceEntry { a, b, below })) => When::Distance {
                between: points("distance", [a, b])?,
                below: *below,
            },
            _ => return Err(of.conflict("at", "give one condition: at, force or distance")),
        };
        let mut then = Vec::new();
        for name in &self.release {
            then.push(if attached().any(|attached| attached == name) {
                Action::Detach(name.clone())
            } else {
                Action::Release(scene.constraint(name).map_err(at("release"))?)
            });
        }
        for (i, entry) in self.attach.iter().enumerate() {
            then.push(Action::Attach {
                name: entry.name.clone(),
                between: points(&format!("attach.{i}"), [&entry.a, &entry.b])?,
            });
        }
        for SetEntry { control, value } in &self.set {
            let control = scene.control(control).map_err(at("set"))?;
            then.push(Action::Set {
                control,
                value: *value,
            });
        }
        Ok(Event {
            name: self.name.clone(),
            when,
            then,
        })
    }

    /// The event as it is written.
    pub(super) fn of(event: &Event, scene: &Scene) -> Self {
        let Event { name, when, then } = event;
        let joint = |constraint: usize| scene.constraint_names[constraint].clone();
        let point = |frame: &Frame| PointEntry::of(frame, scene);
        let mut entry = Self {
            name: name.clone(),
            ..Self::default()
        };
        match when {
            When::Time(time) => entry.at = Some(*time),
            When::Force { constraint, above } => {
                entry.force = Some(ForceEntry {
                    joint: joint(*constraint),
                    above: *above,
                });
            }
            When::Distance { between, below } => {
                let [a, b] = between.each_ref().map(point);
                let below = *below;
                entry.distance = Some(DistanceEntry { a, b, below });
            }
        }
        for action in then {
            match action {
                Action::Release(constraint) => entry.release.push(joint(*constraint)),
                Action::Detach(name) => entry.release.push(name.clone()),
                Action::Attach { name, between } => {
                    let [a, b] = between.each_ref().map(point);
                    let name = name.clone();
                    entry.attach.push(AttachEntry { name, a, b });
                }
                Action::Set { control, value } => entry.set.push(SetEntry {
                    control: scene.controls[*control].name.clone(),
                    value: *value,
                }),
            }
        }
        entry
    }
}
