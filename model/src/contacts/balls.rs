//! The balls that two capsules share.
//!
//! Capsules of one radius that a joint holds together end to end, such as the segments of a cable, end in the same ball. What
//! the ball touches, both touch, at one point and with one normal: as two contacts these would have the same rows but for the
//! joint between them. They are one contact, with half of the force on each body, so a cable of n segments that lies on a
//! floor has n + 1 contacts instead of 2 n. One on a single body would shift the tension at the joint by half a segment's
//! friction. Where a joint has opened, as under a blow, each end has its own contacts: the mean of both would hold neither.

use nalgebra::Vector3;

use super::Contact;
use super::solid::Solid;
use crate::collide::{Collider, Shape};
use crate::frame::Side;
use crate::scene::Scene;

/// Distance of points in the same place, over the size of the shapes.
const SAME: f64 = 1e-9;

/// Distance of the ends, over the ball's radius, from which on each has its own contacts.
const OPEN: f64 = 0.02;

/// A ball of two capsules, or a collider by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Ball(usize),
    Collider(usize),
}

/// The balls of a scene, and their contacts of the moment.
#[derive(Debug, Clone, Default)]
pub(super) struct Balls {
    /// The ball at the upper and the lower end of each collider; empty where there are none.
    of: Vec<[Option<usize>; 2]>,
    /// Radius of each ball \[m].
    radii: Vec<f64>,
    /// Parts of each contact in order, the number of the contact, and true if its sides are in the
    /// reverse order.
    found: Vec<([Part; 2], usize, bool)>,
    repeated: Vec<bool>,
}

impl Balls {
    pub(super) fn of(scene: &Scene) -> Self {
        let mut capsules: Vec<_> = (0..scene.colliders.len())
            .filter(|i| matches!(scene.colliders[*i].shape, Shape::Capsule { .. }))
            .filter_map(|i| Some((scene.colliders[i].body?, i)))
            .collect();
        capsules.sort_unstable();
        let (mut of, mut radii) = (vec![[None; 2]; scene.colliders.len()], Vec::new());
        for constraint in scene.constraints.iter().filter(|c| c.has_stretch_rows()) {
            let [Side::Body(a), Side::Body(b)] = [0, 1].map(|k| constraint.frames()[k].side) else {
                continue;
            };
            let held = |body: usize, frame: usize| {
                let point = constraint.frames()[frame].point;
                let first = capsules.partition_point(|c| c.0 < body);
                let own = capsules[first..].iter().take_while(move |c| c.0 == body);
                own.filter_map(move |(_, i)| Some((*i, end(&scene.colliders[*i], &point)?)))
            };
            for (i, upper) in held(a, 0) {
                for (j, other) in held(b, 1) {
                    let [x, y] = [i, j].map(|i| scene.colliders[i].shape.dimensions()[0]);
                    if (x - y).abs() <= SAME * x {
                        let ball = of[i][upper].or(of[j][other]).unwrap_or(radii.len());
                        if ball == radii.len() {
                            radii.push(0.5 * x);
                        }
                        (of[i][upper], of[j][other]) = (Some(ball), Some(ball));
                    }
                }
            }
        }
        if radii.is_empty() {
            of.clear();
        }
        Self {
            of,
            radii,
            ..Self::default()
        }
    }

    /// Forgets the contacts.
    pub(super) fn begin(&mut self) {
        self.found.clear();
    }

    /// Contact number `contact` of a pair is at these points of the cores, given with the solids.
    pub(super) fn add(
        &mut self,
        contact: usize,
        pair: [usize; 2],
        cores: [(&Solid, Vector3<f64>); 2],
    ) {
        let Some(of) = self.of.get(pair[1]).map(|last| [self.of[pair[0]], *last]) else {
            return;
        };
        let part = |k: usize| {
            let (solid, point) = cores[k];
            let z = solid.axis(2).dot(&(point - solid.centre));
            let is_end = solid.half.z - z.abs() <= SAME * solid.size();
            let ball = of[k][usize::from(z < 0.0)].filter(|_| is_end);
            ball.map_or(Part::Collider(pair[k]), Part::Ball)
        };
        let mut parts = [part(0), part(1)];
        if parts.iter().any(|part| matches!(part, Part::Ball(_))) {
            let turned = parts[1] < parts[0];
            parts.sort_unstable();
            self.found.push((parts, contact, turned));
        }
    }

    /// Unites the contacts that the same parts have in the first of them, with the mean of their gaps.
    pub(super) fn unite(&mut self, contacts: &mut Vec<Contact>) {
        if self.found.is_empty() {
            return;
        }
        self.found.sort_unstable();
        self.repeated.clear();
        self.repeated.resize(contacts.len(), false);
        for same in self.found.chunk_by(|a, b| a.0 == b.0) {
            let (parts, first, turned) = same[0];
            let radius = parts.iter().filter_map(|part| match part {
                Part::Ball(ball) => Some(self.radii[*ball]),
                Part::Collider(_) => None,
            });
            let open = OPEN * radius.fold(f64::INFINITY, f64::min);
            let (mut gap, mut count) = (contacts[first].gap, 1.0);
            for (_, i, other) in &same[1..] {
                let Contact {
                    mut bodies,
                    mut points,
                    gap: own,
                    ..
                } = contacts[*i];
                if *other != turned {
                    bodies.reverse();
                    points.reverse();
                }
                let kept = &mut contacts[first];
                if (0..2).any(|side| (points[side] - kept.points[side]).norm() > open) {
                    continue;
                }
                self.repeated[*i] = true;
                (gap, count) = (gap + own, count + 1.0);
                for (side, body) in bodies.into_iter().enumerate() {
                    if body != kept.bodies[side] {
                        kept.partners[side] = kept.partners[side].or(body);
                    }
                }
            }
            contacts[first].gap = gap / count;
        }
        let mut repeated = self.repeated.iter();
        contacts.retain(|_| repeated.next() != Some(&true));
    }
}

/// The end of a capsule, 0 for the upper one, that lies at a point of its body.
fn end(collider: &Collider, point: &Vector3<f64>) -> Option<usize> {
    let Shape::Capsule { length, .. } = collider.shape else {
        return None;
    };
    let at = collider.orientation.inverse() * (point - collider.position);
    let size = collider.shape.reach();
    (0..2).find(|end| {
        let z = if *end == 0 { 0.5 } else { -0.5 } * length;
        (at - Vector3::z() * z).norm() <= SAME * size
    })
}
