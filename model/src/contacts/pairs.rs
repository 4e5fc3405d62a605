//! Pairs of colliders that never meet, whatever their poses.

use std::collections::HashSet;

use crate::constraint::Constraint;
use crate::scene::Scene;

/// The pairs of bodies and cables that never meet.
#[derive(Debug, Clone)]
pub(super) struct Pairs {
    /// Pairs of bodies that a constraint holds together, the lower number first. A cable leaves them free up to its length.
    joined: HashSet<[usize; 2]>,
    /// The cable of each body.
    cable: Vec<Option<usize>>,
    /// True if no pair can meet.
    empty: bool,
}

impl Pairs {
    pub(super) fn of(scene: &Scene) -> Self {
        let mut pairs = Self {
            joined: HashSet::new(),
            cable: vec![None; scene.bodies.len()],
            empty: true,
        };
        if scene.colliders.len() < 2 {
            return pairs;
        }
        let holds = |c: &&Constraint| !matches!(c, Constraint::MasslessCable(_));
        for constraint in scene.constraints.iter().filter(holds) {
            for (n, i) in constraint.bodies().enumerate() {
                let others = constraint.bodies().skip(n + 1);
                pairs.joined.extend(others.map(|j| [i.min(j), i.max(j)]));
            }
        }
        for (number, cable) in scene.cables.iter().enumerate() {
            for body in &cable.bodies {
                pairs.cable[*body] = Some(number);
            }
        }
        // Most often the first pair that is tried meets.
        let count = scene.colliders.len();
        let mut all = (0..count).flat_map(|j| (0..j).map(move |i| [i, j]));
        pairs.empty = !all.any(|pair| pairs.meet(scene, pair));
        pairs
    }

    pub(super) fn is_empty(&self) -> bool {
        self.empty
    }

    /// Number of bodies of the scene that this was made of.
    pub(super) fn bodies(&self) -> usize {
        self.cable.len()
    }

    /// Two colliders can meet if they are of different bodies, of which one is dynamic, and their
    /// groups agree. Bodies of one cable, and bodies held together by a constraint other than a
    /// massless cable, never meet.
    pub(super) fn meet(&self, scene: &Scene, pair: [usize; 2]) -> bool {
        let [a, b] = pair.map(|i| &scene.colliders[i]);
        let dynamic = |body: Option<usize>| body.is_some_and(|i| scene.bodies.is_dynamic(i));
        if a.body == b.body || !(dynamic(a.body) || dynamic(b.body)) || !a.meets(b) {
            return false;
        }
        let (Some(i), Some(j)) = (a.body, b.body) else {
            return true;
        };
        let same_cable = self.cable[i].is_some() && self.cable[i] == self.cable[j];
        !same_cable && !self.joined.contains(&[i.min(j), i.max(j)])
    }

    /// The first collider of each dynamic body none of whose colliders can meet any. A cable is as one body: a segment beside
    /// the only thing that its cable meets is not in doubt.
    pub(super) fn alone(&self, scene: &Scene) -> Vec<usize> {
        let owner = |i: usize| {
            let body = scene.colliders[i].body?;
            Some(self.cable[body].map_or(body, |cable| self.bodies() + cable))
        };
        let mut known = vec![false; self.bodies() + scene.cables.len()];
        let count = scene.colliders.len();
        for i in 0..count {
            let Some(own) = owner(i).filter(|own| !known[*own]) else {
                continue;
            };
            if let Some(j) = (0..count).find(|j| self.meet(scene, [i, *j])) {
                known[own] = true;
                owner(j).into_iter().for_each(|other| known[other] = true);
            }
        }
        let dynamic = |i: usize| {
            scene.colliders[i]
                .body
                .filter(|b| scene.bodies.is_dynamic(*b))
        };
        let mut first = |own: usize| !std::mem::replace(&mut known[own], true);
        let all =
            (0..count).filter(|i| dynamic(*i).and_then(|_| owner(*i)).is_some_and(&mut first));
        all.collect()
    }
}
