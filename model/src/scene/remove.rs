//! Takes bodies and constraints out of a scene.

use super::{Action, Event, Scene, When};
use crate::body::Bodies;
use crate::error::SceneError;
use crate::frame::{Frame, Side};

/// New numbers of what is kept, by the old ones.
struct Kept(Vec<Option<usize>>);

impl Kept {
    /// All of `count` but `removed`.
    fn without(count: usize, removed: &[usize]) -> Self {
        let mut kept = vec![Some(0); count];
        for i in removed {
            kept[*i] = None;
        }
        for (new, number) in kept.iter_mut().flatten().enumerate() {
            *number = new;
        }
        Self(kept)
    }

    fn filter<T>(&self, items: &mut Vec<T>) {
        let mut kept = self.0.iter();
        items.retain(|_| kept.next().is_none_or(Option::is_some));
    }

    fn renumber(&self, numbers: &mut Vec<usize>) {
        numbers.retain_mut(|i| match self.0[*i] {
            Some(new) => {
                *i = new;
                true
            }
            None => false,
        });
    }
}

impl Scene {
    /// Removes bodies and constraints by their numbers. The others keep their order; drives, cables, events and the
    /// load follow them. Controls that drive nothing any more, cables without parts and events that watch or act on what is
    /// gone go, too.
    ///
    /// # Errors
    /// A number that is not there, a body that a constraint holds which stays, or the load. The scene is then as it was.
    pub fn remove(&mut self, bodies: &[usize], constraints: &[usize]) -> Result<(), SceneError> {
        if let Some(i) = bodies.iter().find(|i| **i >= self.bodies.len()) {
            return Err(self.unknown_body("removal", *i));
        }
        if let Some(i) = constraints.iter().find(|i| **i >= self.constraints.len()) {
            return Err(self.unknown_constraint("removal", *i));
        }
        let kept_bodies = Kept::without(self.bodies.len(), bodies);
        let kept = Kept::without(self.constraints.len(), constraints);
        self.check_removal(&kept_bodies, &kept)?;
        retain(&mut self.bodies, &kept_bodies);
        kept_bodies.filter(&mut self.body_names);
        kept.filter(&mut self.constraints);
        kept.filter(&mut self.constraint_names);
        kept.filter(&mut self.groups);
        for constraint in &mut self.constraints {
            for frame in constraint.frames_mut() {
                if let Side::Body(i) = &mut frame.side {
                    *i = kept_bodies.0[*i].unwrap_or(*i);
                }
            }
        }
        for control in &mut self.controls {
            control.drives.retain_mut(|drive| {
                let new = kept.0[drive.constraint];
                drive.constraint = new.unwrap_or(drive.constraint);
                new.is_some()
            });
        }
        let idle = self.controls.iter().zip(0..);
        let idle = idle.filter(|(control, _)| control.drives.is_empty());
        let idle: Vec<usize> = idle.map(|(_, i)| i).collect();
        let kept_controls = Kept::without(self.controls.len(), &idle);
        kept_controls.filter(&mut self.controls);
        self.events
            .retain_mut(|event| follow(event, &kept_bodies, &kept, &kept_controls));
        for cable in &mut self.cables {
            kept_bodies.renumber(&mut cable.bodies);
            kept.renumber(&mut cable.joints);
        }
        self.cables
            .retain(|cable| !cable.bodies.is_empty() || !cable.joints.is_empty());
        self.load = self.load.and_then(|load| kept_bodies.0[load]);
        Ok(())
    }

    fn check_removal(&self, bodies: &Kept, constraints: &Kept) -> Result<(), SceneError> {
        let gone = |i: usize| bodies.0.get(i).is_some_and(Option::is_none);
        if let Some(load) = self.load.filter(|load| gone(*load)) {
            return Err(SceneError::Conflict {
                what: format!("body `{}`", self.body_names[load]),
                reason: "is the load: make another body the load, or none, before it is removed",
            });
        }
        let stays = |i: &usize| constraints.0[*i].is_some();
        for i in (0..self.constraints.len()).filter(stays) {
            if let Some(body) = self.constraints[i].bodies().find(|body| gone(*body)) {
                let (body, joint) = (&self.body_names[body], &self.constraint_names[i]);
                return Err(SceneError::Held {
                    body: body.clone(),
                    joint: joint.clone(),
                });
            }
        }
        Ok(())
    }
}

/// Renumbers an event; whether anything of it is left.
fn follow(event: &mut Event, bodies: &Kept, constraints: &Kept, controls: &Kept) -> bool {
    let renumbered = |i: &mut usize, kept: &Kept| {
        let new = kept.0.get(*i).copied().flatten();
        *i = new.unwrap_or(*i);
        new.is_some()
    };
    let points = |between: &mut [Frame; 2]| {
        between.iter_mut().all(|frame| match &mut frame.side {
            Side::World(_) => true,
            Side::Body(i) => renumbered(i, bodies),
        })
    };
    let watched = match &mut event.when {
        When::Time(_) => true,
        When::Force { constraint, .. } => renumbered(constraint, constraints),
        When::Distance { between, .. } => points(between),
    };
    event.then.retain_mut(|action| match action {
        Action::Release(constraint) => renumbered(constraint, constraints),
        Action::Attach { between, .. } => points(between),
        Action::Set { control, .. } => renumbered(control, controls),
    });
    watched && !event.then.is_empty()
}

fn retain(bodies: &mut Bodies, kept: &Kept) {
    let Bodies {
        mobility,
        position,
        orientation,
        velocity,
        angular_velocity,
        mass,
        inertia,
        force,
        torque,
    } = bodies;
    kept.filter(mobility);
    kept.filter(position);
    kept.filter(orientation);
    kept.filter(velocity);
    kept.filter(angular_velocity);
    kept.filter(mass);
    kept.filter(inertia);
    kept.filter(force);
    kept.filter(torque);
}

#[cfg(test)]
mod tests {
    use crate::GantryParams;

    #[test]
    fn what_stays_keeps_its_order_and_its_sides() {
        let mut scene = GantryParams::default().build().expect("builds");
        let before = scene.clone();
        let named = |scene: &crate::Scene, name: &str| {
            let names = scene.constraint_names.iter();
            names.zip(0..).find(|(n, _)| *n == name).expect("there").1
        };
        let (rope, joint) = (named(&scene, "rope-1"), named(&scene, "joint-2"));
        scene.remove(&[], &[rope, joint]).expect("goes");
        assert_eq!(scene.validate(), Ok(()));
        assert_eq!(scene.controls[1].drives.len(), 1);
        let driven = scene.controls[1].drives[0].constraint;
        assert_eq!(scene.constraint_names[driven], "rope-2");
        assert_eq!(scene.cables[0].bodies, before.cables[0].bodies);
        assert_eq!(
            scene.cables[0].joints.len() + 1,
            before.cables[0].joints.len()
        );
        let all = scene.cables[0].joints.clone();
        let segments = scene.cables[0].bodies.clone();
        scene.remove(&segments, &all).expect("goes");
        assert!(scene.cables.is_empty());
        assert_eq!(scene.body_names, ["crane", "trolley", "hook", "load"]);
        assert_eq!(scene.load, Some(3));
        assert_eq!(scene.validate(), Ok(()));
        let hook = scene.constraints[1].frames()[1].body_index();
        assert_eq!(hook, Some(2));
        let rest = [0, 1];
        scene.remove(&[], &rest).expect("goes");
        assert!(scene.controls.is_empty());
    }

    #[test]
    fn what_is_held_stays() {
        let mut scene = GantryParams::default().build().expect("builds");
        let before = scene.clone();
        for (bodies, words) in [
            ([2], "body `hook` cannot be removed while `rope-1` holds it"),
            ([before.load.expect("a load")], "body `load`: is the load"),
            ([99], "removal names the body `number 99`"),
        ] {
            let fault = scene.remove(&bodies, &[]).expect_err("a fault").to_string();
            assert!(fault.starts_with(words), "{fault}");
            assert_eq!(scene, before);
        }
        let fault = scene.remove(&[], &[99]).expect_err("a fault").to_string();
        assert!(fault.starts_with("removal names `number 99`"), "{fault}");
    }
}
