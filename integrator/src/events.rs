//! Actions after a step: events of the scene, and cables that leave sheaves with friction or lie
//! down on them.

use crate::StepError;
use crate::change::Edit;
use crate::identity::ConstraintId;
use crate::stepper::Stepper;
use taut_model::{Action, CableParts, Event, Frame, When};

impl Stepper {
    /// Names of the events of the last step.
    #[must_use]
    pub fn fired(&self) -> &[String] {
        &self.fired
    }

    /// Fires all due events, each once; of a cable only the joint breaks that is strained the most, which relieves the others.
    /// Allocates where there are any. Returns their number.
    ///
    /// # Errors
    /// As [`change`](Self::change); the events then stay pending.
    pub(crate) fn fire(&mut self) -> Result<usize, StepError> {
        self.fired.clear();
        if !self.scene.events.iter().any(|event| self.is_due(event)) {
            return Ok(0);
        }
        let events = self.scene.events.iter().filter(|event| self.is_due(event));
        let due: Vec<&Event> = events.collect();
        let first = due.iter().filter(|event| !self.is_spared(event, &due));
        let due: Vec<Event> = first.map(|event| (*event).clone()).collect();
        let actions = || due.iter().flat_map(|event| &event.then);
        let named = |control: usize| self.scene.controls[control].name.clone();
        let settings = actions().filter_map(|action| match action {
            Action::Set { control, value } => Some((named(*control), *value)),
            _ => None,
        });
        let settings: Vec<(String, f64)> = settings.collect();
        let time = self.time;
        self.change(|edit| {
            edit.drop_events(&due);
            edit.act(&due, time)
        })?;
        for (name, value) in settings {
            // A control goes with the last thing that it drives.
            if let Ok(control) = self.scene.control(&name) {
                self.set_control(control, value)?;
            }
        }
        self.fired.extend(due.into_iter().map(|event| event.name));
        Ok(self.fired.len())
    }

    /// Cables that have left a sheave with friction in this step, or lie on one that they passed by, get other parts. Allocates
    /// where there are any.
    pub(crate) fn lift_and_land(&mut self) -> Result<bool, StepError> {
        let changes = || self.scene.left().next().is_some() || self.scene.landed().next().is_some();
        let changed = self.slip.may_change && changes();
        if changed {
            self.change(Edit::lift_and_land)?;
        }
        Ok(changed)
    }

    fn is_due(&self, event: &Event) -> bool {
        match &event.when {
            // A time that steps add up to may fall short of it by rounding.
            When::Time(time) => self.time >= time - 1e-6 * self.options.dt,
            When::Force { constraint, above } => self.strain(*constraint) > *above,
            When::Distance { between, below } => {
                let [a, b] = between.map(|f| f.resolve(&self.scene.bodies, self.time).point());
                (a - b).norm() < *below
            }
            _ => false,
        }
    }
}

impl Stepper {
    /// Tension of a constraint, or the size of its force where it has none; of a cable in parts the largest \[N].
    fn strain(&self, constraint: usize) -> f64 {
        let of = |part: usize| {
            let size = || Some(self.force(part)?.force.norm());
            self.tension(part).or_else(size).unwrap_or(0.0)
        };
        let parts = self.scene.parts_of(constraint);
        parts.map(of).fold(f64::NEG_INFINITY, f64::max)
    }

    /// True if another due event breaks a joint of the same cable that is strained more, or as much
    /// and stands earlier.
    fn is_spared(&self, event: &Event, due: &[&Event]) -> bool {
        let strained = |event: &Event| match &event.when {
            When::Force { constraint, above } => {
                let of = |cable: &CableParts| cable.joints.contains(constraint);
                let cable = self.scene.cables.iter().position(of)?;
                Some((cable, self.strain(*constraint) / above, *constraint))
            }
            _ => None,
        };
        let Some((cable, strain, joint)) = strained(event) else {
            return false;
        };
        let worse = |(other, more, first): (usize, f64, usize)| {
            other == cable && (more > strain || (more == strain && first < joint))
        };
        due.iter().filter_map(|event| strained(event)).any(worse)
    }
}

impl Edit {
    /// Releases and attaches what the events ask for at `time` (s), one after the other. What is not there is passed over.
    fn act(&mut self, due: &[Event], time: f64) -> Result<(), StepError> {
        let actions = || due.iter().flat_map(|event| &event.then);
        // Numbers change as constraints go.
        let released = actions().filter_map(|action| match action {
            Action::Release(constraint) => Some(self.constraint_at(*constraint)),
            _ => None,
        });
        let mut released = released.collect::<Vec<_>>().into_iter();
        // A removal drops detachments of ties that do not exist. This placeholder announces the
        // ties to come, for events that are to detach them later.
        let ties = actions().filter(|action| matches!(action, Action::Attach { .. }));
        self.add_event(Event {
            name: String::new(),
            when: When::Time(f64::INFINITY),
            then: ties.cloned().collect(),
        });
        for action in actions() {
            match action {
                Action::Release(_) => self.let_go(released.next())?,
                Action::Detach(name) => self.let_go(self.constraint(name).ok())?,
                Action::Attach { name, between } => {
                    self.let_go(self.constraint(name).ok())?;
                    self.attach(name, between, time);
                }
                _ => {}
            }
        }
        self.drop_events_called("");
        // Without the placeholder, drops the detachments whose ties will never exist.
        self.remove(&[], &[])
    }

    /// Removes a constraint that is still there.
    fn let_go(&mut self, constraint: Option<ConstraintId>) -> Result<(), StepError> {
        match constraint.filter(|constraint| self.constraint_index(*constraint).is_ok()) {
            Some(constraint) => self.remove_constraint(constraint),
            None => Ok(()),
        }
    }

    /// Ties two points together as they are at `time` (s).
    fn attach(&mut self, name: &str, between: &[Frame; 2], time: f64) {
        let points = between.map(|f| f.resolve(&self.scene().bodies, time).point());
        let length = (points[0] - points[1]).norm();
        self.add_constraint(name, Action::tie(*between, length), 0);
    }
}

#[cfg(test)]
mod tests;
