//! Takes bodies and constraints out of a scene.

use super::{Action, Capstan, Event, Scene, When};
use crate::body::last_to;
use crate::error::{SceneError, refuse};
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

    /// The last of `count` at number `at`.
    fn inserted(count: usize, at: usize) -> Self {
        let last = count.saturating_sub(1);
        let moved = |i: usize| match i {
            i if i == last => at,
            i if i >= at => i + 1,
            i => i,
        };
        Self((0..count).map(|i| Some(moved(i))).collect())
    }

    fn filter<T>(&self, items: &mut Vec<T>) {
        let mut kept = self.0.iter();
        items.retain(|_| kept.next().is_none_or(Option::is_some));
    }

    /// Gives a number its new value; whether what it names stays. One of what was never there stays as it is, to be found
    /// by validation.
    fn follow(&self, number: &mut usize) -> bool {
        match self.0.get(*number) {
            Some(Some(new)) => {
                *number = *new;
                true
            }
            Some(None) => false,
            None => true,
        }
    }
}

impl Scene {
    /// Removes bodies and constraints by their numbers. The others keep their order; drives, cables, events, colliders
    /// and the load follow them; the colliders of removed bodies go. Controls whose last drive goes, cables whose last part goes, and events that watch or act on
    /// what goes are removed as well. Returns the numbers that the removed controls had.
    ///
    /// # Errors
    /// A number that is not there, a body that a constraint holds which stays, or the load. The scene is then as it was.
    pub fn remove(
        &mut self,
        bodies: &[usize],
        constraints: &[usize],
    ) -> Result<Vec<usize>, SceneError> {
        if let Some(i) = bodies.iter().find(|i| **i >= self.bodies.len()) {
            return Err(self.unknown_body("removal", *i));
        }
        if let Some(i) = constraints.iter().find(|i| **i >= self.constraints.len()) {
            return Err(self.unknown_constraint("removal", *i));
        }
        let kept_bodies = Kept::without(self.bodies.len(), bodies);
        let kept = Kept::without(self.constraints.len(), constraints);
        self.check_removal(&kept_bodies, &kept)?;
        // Surplus entries stay, for `validate` to name.
        self.bodies
            .retain(|i| kept_bodies.0.get(i).is_none_or(Option::is_some));
        kept_bodies.filter(&mut self.body_names);
        kept.filter(&mut self.constraints);
        kept.filter(&mut self.constraint_names);
        kept.filter(&mut self.groups);
        let idle = self.renumber(&kept_bodies, &kept);
        self.forget_detached();
        Ok(idle)
    }

    /// Gives bodies and constraints their new numbers wherever they are named; returns the numbers that controls without
    /// drives had, which go.
    fn renumber(&mut self, bodies: &Kept, constraints: &Kept) -> Vec<usize> {
        for constraint in &mut self.constraints {
            for frame in constraint.frames_mut() {
                if let Side::Body(i) = &mut frame.side {
                    bodies.follow(i);
                }
            }
        }
        let mut idle = Vec::new();
        for (i, control) in self.controls.iter_mut().enumerate() {
            let before = control.drives.len();
            control
                .drives
                .retain_mut(|d| constraints.follow(&mut d.constraint));
            let left = control.drives.iter().any(|drive| drive.gain != 0.0);
            idle.extend((control.drives.len() < before && !left).then_some(i));
        }
        let kept_controls = Kept::without(self.controls.len(), &idle);
        kept_controls.filter(&mut self.controls);
        self.events
            .retain_mut(|event| follow(event, bodies, constraints, &kept_controls));
        self.cables.retain_mut(|cable| {
            let before = cable.bodies.len() + cable.joints.len();
            cable.bodies.retain_mut(|i| bodies.follow(i));
            cable.joints.retain_mut(|i| constraints.follow(i));
            let left = cable.bodies.len() + cable.joints.len();
            left > 0 || before == 0
        });
        self.capstans.retain_mut(|capstan| {
            let [before, after] = &mut capstan.parts;
            constraints.follow(before) && constraints.follow(after)
        });
        self.colliders
            .retain_mut(|c| c.body.as_mut().is_none_or(|i| bodies.follow(i)));
        if let Some(load) = &mut self.load {
            bodies.follow(load);
        }
        idle
    }

    /// Moves the last body and the last constraint to the numbers `body` and `constraint`; the others keep their order.
    pub(super) fn insert_last(&mut self, body: usize, constraint: usize) {
        let kept_bodies = Kept::inserted(self.bodies.len(), body);
        let kept = Kept::inserted(self.constraints.len(), constraint);
        self.bodies.move_last(body);
        last_to(&mut self.body_names, body);
        last_to(&mut self.constraints, constraint);
        last_to(&mut self.constraint_names, constraint);
        last_to(&mut self.groups, constraint);
        self.renumber(&kept_bodies, &kept);
    }

    fn check_removal(&self, bodies: &Kept, constraints: &Kept) -> Result<(), SceneError> {
        let gone = |i: usize| bodies.0.get(i).is_some_and(Option::is_none);
        if let Some(load) = self.load.filter(|load| gone(*load)) {
            let reason = "is the load: make another body the load, or none, before it is removed";
            return refuse(format!("body `{}`", self.body_names[load]), reason);
        }
        let goes = |i: usize| constraints.0.get(i).is_some_and(Option::is_none);
        let torn = |c: &&Capstan| goes(c.parts[0]) != goes(c.parts[1]);
        if let Some(capstan) = self.capstans.iter().find(torn) {
            let reason = "is a part of a cable over sheaves with friction: its parts, `Scene::parts_of`, go together or not at all";
            let joint = &self.constraint_names[capstan.parts[1]];
            return refuse(format!("joint `{joint}`"), reason);
        }
        let stays = |i: &usize| constraints.0[*i].is_some();
        for i in (0..self.constraints.len()).filter(stays) {
            if let Some(body) = self.constraints[i].bodies().find(|body| gone(*body)) {
                let (body, joint) = (&self.body_names[body], &self.constraint_names[i]);
                let what = format!("body `{body}` cannot be removed while `{joint}` holds it");
                return refuse(what, "remove that as well");
            }
        }
        Ok(())
    }
}

/// Renumbers an event; whether anything of it is left.
fn follow(event: &mut Event, bodies: &Kept, constraints: &Kept, controls: &Kept) -> bool {
    let points = |between: &mut [Frame; 2]| {
        between.iter_mut().all(|frame| match &mut frame.side {
            Side::World(_) => true,
            Side::Body(i) => bodies.follow(i),
        })
    };
    let watched = match &mut event.when {
        When::Time(_) => true,
        When::Force { constraint, .. } => constraints.follow(constraint),
        When::Distance { between, .. } => points(between),
    };
    event.then.retain_mut(|action| match action {
        Action::Release(constraint) => constraints.follow(constraint),
        Action::Detach(_) => true,
        Action::Attach { between, .. } => points(between),
        Action::Set { control, .. } => controls.follow(control),
    });
    watched && !event.then.is_empty()
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
        let found = scene.cables[0].joints.len() + 1;
        assert_eq!(found, before.cables[0].joints.len());
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
    fn shapes_stay_with_their_bodies() {
        use crate::collide::{Collider, Shape};
        use crate::{Body, Scene};
        let mut scene = Scene::new("three");
        let ball = Shape::Sphere { radius: 1.0 };
        for name in ["a", "b", "c"] {
            let body = scene.add_body(name, Body::sphere(1.0, 1.0));
            scene.add_collider(Collider::new(name, Some(body), ball));
        }
        scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
        scene.remove(&[1], &[]).expect("goes");
        assert_eq!(scene.validate(), Ok(()));
        let of = scene.colliders.iter().map(|c| (c.name.as_str(), c.body));
        let of: Vec<_> = of.collect();
        assert_eq!(of, [("a", Some(0)), ("c", Some(1)), ("ground", None)]);
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
