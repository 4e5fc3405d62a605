//! Events: one-shot actions while a scene runs. A rope breaks, a load is let go, a hook catches it.

use super::Scene;
use super::validate::unique;
use crate::constraint::{Constraint, Distance, RowLaw, Spherical};
use crate::error::{SceneError, check, refuse};
use crate::frame::Frame;
use crate::names::near_names;

/// A one-shot event. It fires at the end of the first step that meets its condition; of a cable of segments only the joint
/// that is strained the most breaks in a step.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Event {
    /// Its name.
    pub name: String,
    /// Its condition.
    pub when: When,
    /// Actions in their order. Of several events in one step, those listed first go first.
    pub then: Vec<Action>,
}

/// The condition of an [`Event`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum When {
    /// From this time on \[s].
    Time(f64),
    /// The tension of constraint number `constraint` exceeds `above` \[N], or the size of its force
    /// if it has no tension. In a cable over sheaves with friction the part with the largest
    /// tension counts.
    Force {
        /// The constraint.
        constraint: usize,
        /// The limit \[N], > 0.
        above: f64,
    },
    /// Two points are nearer to each other than `below` \[m].
    Distance {
        /// The points.
        between: Box<[Frame; 2]>,
        /// The limit \[m], > 0.
        below: f64,
    },
}

/// Action of an [`Event`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Action {
    /// Removes the constraint of this number: it lets go. A part of a cable over sheaves with friction takes the others along.
    Release(usize),
    /// Removes the constraint of this name, which an event attaches; does nothing where it is not there at that time.
    Detach(String),
    /// Ties two points together by a rigid link of their present distance, or by a ball joint where that is less than a thousandth of
    /// their distances from the centres of their bodies. One that an event tied under this name before, and that is still there,
    /// lets go.
    Attach {
        /// Name of the new constraint.
        name: String,
        /// The points.
        between: Box<[Frame; 2]>,
    },
    /// A control is set.
    Set {
        /// Number of the control.
        control: usize,
        /// Its value, a speed \[m/s or rad/s].
        value: f64,
    },
}

impl Action {
    /// Tie between two points that are `length` (m) apart: a rigid link, or a ball joint where that
    /// is 0.
    #[must_use]
    pub fn tie(frames: [Frame; 2], length: f64) -> Constraint {
        let law = RowLaw::RIGID;
        if length == 0.0 {
            let stretch = law;
            return Constraint::Spherical(Spherical { frames, stretch });
        }
        Constraint::Distance(Distance {
            frames,
            length,
            law,
            transverse: false,
        })
    }

    /// True if the constraint is such a tie, which an event may replace.
    fn is_tie(constraint: &Constraint) -> bool {
        match constraint {
            Constraint::Spherical(joint) => joint.stretch == RowLaw::RIGID,
            Constraint::Distance(link) => link.law == RowLaw::RIGID && !link.transverse,
            _ => false,
        }
    }
}

impl Event {
    /// Names that it ties points under.
    pub fn attached(&self) -> impl Iterator<Item = &String> {
        self.then.iter().filter_map(|action| match action {
            Action::Attach { name, .. } => Some(name),
            _ => None,
        })
    }
}

impl Scene {
    /// Lets constraint number `constraint` break where its tension, or the size of its force if it has none, exceeds `force`
    /// (N): an event called `NAME breaks`.
    ///
    /// # Panics
    /// When there is no such constraint.
    pub fn break_at(&mut self, constraint: usize, force: f64) {
        self.events.push(Event {
            name: format!("{} breaks", self.constraint_names[constraint]),
            when: When::Force {
                constraint,
                above: force,
            },
            then: vec![Action::Release(constraint)],
        });
    }

    /// True if a constraint is called `name`, or a pending event attaches one of that name.
    pub(crate) fn may_be_there(&self, name: &str) -> bool {
        let mut attached = self.events.iter().flat_map(Event::attached);
        self.constraint_names.iter().any(|known| known == name)
            || attached.any(|attached| attached == name)
    }

    /// Drops detachments of constraints that neither exist nor are still to be attached, and events
    /// that are left without an action.
    pub(super) fn forget_detached(&mut self) {
        let mut events = std::mem::take(&mut self.events);
        let attached: Vec<String> = events.iter().flat_map(Event::attached).cloned().collect();
        let is_left = |action: &Action| match action {
            Action::Detach(name) => self.constraint_names.contains(name) || attached.contains(name),
            _ => true,
        };
        events.retain_mut(|event| {
            event.then.retain(is_left);
            !event.then.is_empty()
        });
        self.events = events;
    }

    pub(super) fn validate_events(&self) -> Result<(), SceneError> {
        unique("event", self.events.iter().map(|e| &e.name))?;
        for event in &self.events {
            unique("joint", event.attached())?;
        }
        (0..self.events.len()).try_for_each(|i| self.validate_event(i))
    }

    /// The error of an event that names a constraint which is neither there nor attached.
    fn unknown_to_events(&self, what: &str, name: &str) -> SceneError {
        let attached = self.events.iter().flat_map(Event::attached);
        let names = self.constraint_names.iter().chain(attached);
        let names: Vec<String> = names.cloned().collect();
        SceneError::UnknownJoint {
            what: what.to_owned(),
            name: name.to_owned(),
            known: near_names(name, &names),
        }
    }

    pub(crate) fn validate_event(&self, i: usize) -> Result<(), SceneError> {
        let event = &self.events[i];
        let what = format!("event `{}`", event.name);
        let of = |quantity: &str| format!("{what}: {quantity}");
        let points = |between: &[Frame; 2]| {
            between.iter().try_for_each(|frame| {
                let here = frame.point.amax() + frame.displacement(0.0).amax();
                check(of("point"), here, true, "finite (m)")?;
                match frame.body_index() {
                    Some(body) if body >= self.bodies.len() => Err(self.unknown_body(&what, body)),
                    _ => Ok(()),
                }
            })
        };
        match &event.when {
            When::Time(time) => check(of("time"), *time, *time >= 0.0, "≥ 0 s")?,
            When::Force { constraint, above } => {
                if *constraint >= self.constraints.len() {
                    return Err(self.unknown_constraint(&what, *constraint));
                }
                check(of("force"), *above, *above > 0.0, "> 0 N")?;
            }
            When::Distance { between, below } => {
                points(between)?;
                check(of("distance"), *below, *below > 0.0, "> 0 m")?;
            }
        }
        if event.then.is_empty() {
            let reason = "does nothing: let it release, attach or set something";
            return refuse(what.clone(), reason);
        }
        event.then.iter().try_for_each(|action| match action {
            Action::Release(constraint) if *constraint >= self.constraints.len() => {
                Err(self.unknown_constraint(&what, *constraint))
            }
            Action::Release(_) => Ok(()),
            Action::Detach(name) if self.may_be_there(name) => Ok(()),
            Action::Detach(name) => Err(self.unknown_to_events(&what, name)),
            Action::Attach { name, between } => {
                let known = self.constraint_names.iter().position(|known| known == name);
                if known.is_some_and(|i| !Action::is_tie(&self.constraints[i])) {
                    let (kind, name) = ("joint", name.clone());
                    return Err(SceneError::Duplicate { kind, name });
                }
                self.check_constraint(name, &Action::tie(**between, 1.0))
            }
            Action::Set { control, value } => {
                if *control >= self.controls.len() {
                    return Err(self.unknown_control(&format!("number {control}")));
                }
                check(of("value"), *value, true, "a number")
            }
        })
    }
}
