//! Actions after a step: events of the scene, and cables that leave sheaves with friction or lie
//! down on them.
//!
//! A blow may begin and end within a step. Conditions on forces and distances are therefore
//! measured after each sub-step and each part of a divided one ([`Step::measure_events`](crate::step::Step::measure_events)). The
//! event acts at the end of the step.

use crate::StepError;
use crate::run::Stepper;
use crate::run::change::Edit;
use crate::run::identity::ConstraintId;
use taut_model::{Action, CableParts, Event, Frame, Side, When};

/// Distance of points that an event ties as one, over the shorter of their arms.
const NEAR: f64 = 1e-3;

impl Stepper {
    /// Names of the events of the last step.
    #[must_use]
    pub fn fired(&self) -> &[String] {
        &self.fired.names
    }

    /// The force by which each of the [`fired`](Self::fired) events was due, the largest of the step \[N]; `None` of those that
    /// wait for no force. A constraint that an event removes no longer tells its force.
    #[must_use]
    pub fn fired_forces(&self) -> &[Option<f64>] {
        &self.fired.forces
    }

    /// Fires all due events, each once, and returns their number. If several joints of a cable are
    /// due to break, only the most strained one does, which relieves the others. Allocates if any
    /// event is due.
    ///
    /// # Errors
    /// As [`change`](Self::change); the events then stay pending.
    pub(crate) fn fire(&mut self) -> Result<usize, StepError> {
        self.fired.names.clear();
        self.fired.forces.clear();
        let mut met = std::mem::take(&mut self.step.output.reported.met);
        // A changed scene may have other events.
        if met.len() != self.step.scene.events.len() {
            met.clear();
            met.extend(
                self.step
                    .scene
                    .events
                    .iter()
                    .map(|event| self.step.measured(event)),
            );
        }
        let events = || self.step.scene.events.iter().zip(met.iter().copied());
        let any = events().any(|(event, met)| self.is_due(event, met));
        let due: Vec<(&Event, f64)> = if any {
            events()
                .filter(|(event, met)| self.is_due(event, *met))
                .collect()
        } else {
            Vec::new()
        };
        let first = due.iter().filter(|event| !self.is_spared(**event, &due));
        let (due, met_by): (Vec<Event>, Vec<f64>) =
            first.map(|(event, met)| ((*event).clone(), *met)).unzip();
        met.clear();
        self.step.output.reported.met = met;
        if due.is_empty() {
            return Ok(0);
        }
        let actions = || due.iter().flat_map(|event| &event.then);
        let named = |control: usize| self.step.scene.controls[control].name.clone();
        let settings = actions().filter_map(|action| match action {
            Action::Set { control, value } => Some((named(*control), *value)),
            _ => None,
        });
        let settings: Vec<(String, f64)> = settings.collect();
        let time = self.step.time;
        if actions().all(|action| matches!(action, Action::Set { .. })) {
            // The run goes on with its past and its balance, as where its user sets the control.
            self.step.scene.events.retain(|event| !due.contains(event));
            self.wake();
        } else {
            if actions().any(|action| matches!(action, Action::Release(_) | Action::Detach(_))) {
                self.step.catch_up()?;
            }
            self.change(|edit| {
                edit.drop_events(&due);
                edit.act(&due, time)
            })?;
        }
        for (name, value) in settings {
            // A control goes with the last thing that it drives.
            if let Ok(control) = self.step.scene.control(&name) {
                self.set_control(control, value)?;
            }
        }
        for (event, met) in due.into_iter().zip(met_by) {
            let waits = matches!(event.when, When::Force { .. });
            self.fired.forces.push(waits.then_some(met));
            self.fired.names.push(event.name);
        }
        Ok(self.fired.names.len())
    }

    /// Cables that have left a sheave with friction in this step, or lie on one that they passed
    /// by, get other parts. Returns true, and allocates, if there are any.
    pub(crate) fn lift_and_land(&mut self) -> Result<bool, StepError> {
        let changes =
            || self.step.scene.left().next().is_some() || self.step.scene.landed().next().is_some();
        let changed = changes();
        if changed {
            self.change(Edit::lift_and_land)?;
        }
        Ok(changed)
    }

    /// True if `event` is due. `met` is its largest [measure](crate::step::Step::measured) in the step.
    fn is_due(&self, event: &Event, met: f64) -> bool {
        match &event.when {
            // A time that steps add up to may fall short of it by rounding.
            When::Time(time) => self.step.time >= time - 1e-6 * self.step.options.dt,
            When::Force { above, .. } => met > *above,
            When::Distance { below, .. } => -met < *below,
            _ => false,
        }
    }

    /// True if another due event breaks a joint of the same cable that is strained more, or as much
    /// and stands earlier.
    fn is_spared(&self, event: (&Event, f64), due: &[(&Event, f64)]) -> bool {
        let strained = |(event, met): (&Event, f64)| match &event.when {
            When::Force { constraint, above } => {
                let of = |cable: &CableParts| cable.joints.contains(constraint);
                let cable = self.step.scene.cables.iter().position(of)?;
                Some((cable, met / above, *constraint))
            }
            _ => None,
        };
        let Some((cable, strain, joint)) = strained(event) else {
            return false;
        };
        let worse = |(other, more, first): (usize, f64, usize)| {
            other == cable && (more > strain || (more == strain && first < joint))
        };
        due.iter().filter_map(|event| strained(*event)).any(worse)
    }
}

impl Edit {
    /// Releases and attaches what the events ask for at `time` (s), one after the other. Skips
    /// constraints that do not exist.
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

    /// Ties two points together as they are at `time` (s). Points nearer than [`NEAR`], as where shapes touch, become one: a link
    /// as short as that turns faster than a step resolves.
    fn attach(&mut self, name: &str, between: &[Frame; 2], time: f64) {
        let bodies = &self.scene().bodies;
        let points = between.map(|f| f.resolve(bodies, time).point());
        let mut frames = *between;
        let mut length = (points[0] - points[1]).norm();
        let on_bodies = between.iter().filter(|f| f.body_index().is_some());
        let arms = on_bodies.map(|f| f.point.norm());
        if length < NEAR * arms.fold(f64::INFINITY, f64::min)
            && let Some(k) = frames.iter().position(|f| f.body_index().is_some())
            && let Side::Body(i) = frames[k].side
        {
            let way = points[1 - k] - points[k];
            frames[k].point += bodies.orientation[i].inverse() * way;
            length = 0.0;
        }
        self.add_constraint(name, Action::tie(frames, length), 0);
    }
}

#[cfg(test)]
mod tests;
