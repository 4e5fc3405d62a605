//! Segments of cables that split and merge while a simulation runs.
//!
//! **Split** of a segment ℓ₁ between ℓ₀ and ℓ₂ into p and q, and **merge** of p and q into ℓ₁. Mass, length, momentum and
//! angular momentum stay; a merge loses the energy of a plastic blow. The compliances of the joints around, in lengths of
//! cable, are
//!
//! ```text
//! ½(ℓ₀ + ℓ₁),  ½(ℓ₁ + ℓ₂)    ⇄    ½(ℓ₀ + p),  ½(p + q),  ½(q + ℓ₂)        of the same sum
//! ```
//!
//! with ℓ₀ = 0 or ℓ₂ = 0 at the ends of the cable. Each joint that stays keeps its strain, g/e of its gap g over its length e,
//! so that the segments between move; what is left of the sum of the gaps is that of the new joint. Its strain is then
//! between those of its neighbours, as of a tension that changes linearly, so that a cable at rest under its own weight stays
//! at rest. Twists are shared alike, the segments turning about their own axes, which keeps the sum of the twists to
//! rounding. Bends are not shared: halves that are turned apart have a shorter chord, and the stiff stretch would answer.
//! Two segments that merge bent by β become as long as both: the gaps take up what their chord is shorter by, ℓβ²/6 at most.

mod energy;

pub use energy::Jump;

use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use super::Scene;
use super::event::{Action, Event, When};
use super::resolution::Resolution;
use crate::body::Body;
use crate::collide::Shape;
use crate::constraint::{Constraint, Cosserat, JointLaw, Spherical, of_length};
use crate::error::{SceneError, check, refuse};
use crate::frame::{Frame, Side, smallest_rotation};

/// Largest number in the name of a segment.
const MOST_NAMED: usize = 1_000_000_000;

/// Material of a cable whose segments split and merge: density, radius, laws of a metre.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Stock {
    /// Mass per length \[kg/m], > 0.
    pub density: f64,
    /// Radius \[m], > 0.
    pub radius: f64,
    /// Laws of a joint that stands for one metre of the cable. Stretch must be there; without bend and twist joints are
    /// ball joints.
    pub per_metre: JointLaw,
    /// Number in the name of the last segment.
    pub named: usize,
    /// Rule by which segments merge and split.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub resolution: Option<Resolution>,
}

impl Stock {
    /// Checks that all numbers are in their ranges; `what` is whose stock it is.
    pub(crate) fn validate(&self, what: impl Fn() -> String) -> Result<(), SceneError> {
        for (quantity, value) in [("mass per length", self.density), ("radius", self.radius)] {
            let of = || format!("{}: {quantity}", what());
            check(of(), value, value > 0.0, "> 0")?;
        }
        let rows = &self.per_metre;
        for law in [rows.stretch, rows.bend, rows.twist].into_iter().flatten() {
            for (quantity, value) in [("compliance", law.compliance), ("damping", law.damping)] {
                let of = || format!("{}: {quantity} of a metre", what());
                check(of(), value, value >= 0.0, "≥ 0")?;
            }
        }
        let of = format!("{}: number in the name of the last segment", what());
        let within = self.named <= MOST_NAMED;
        check(of, self.named as f64, within, "at most 10⁹")?;
        if self.per_metre.stretch.is_none() {
            let reason = "has a stock without stretch: give it a compliance, 0 where it is rigid";
            return refuse(what(), reason);
        }
        let mut rule = self.resolution.iter();
        rule.try_for_each(|rule| rule.validate(&what))
    }
}

/// A segment that has split.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Split {
    /// Bodies of its part towards the start of the cable, which has its number, and of the other, which is new.
    pub bodies: [usize; 2],
    /// Number of their joint.
    pub joint: usize,
    /// Numbers of the joints at the outer ends; `None` where one is free.
    pub around: [Option<usize>; 2],
    /// Position of the new joint between the outer ones, 0 … 1.
    pub share: f64,
    /// Change of energy by the split.
    pub jump: Jump,
}

/// A segment merged into another: the body and the joint to be removed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Merged {
    /// Number of its body.
    pub body: usize,
    /// Number of the joint between them.
    pub joint: usize,
    /// Numbers of the joints at the outer ends, which stay; `None` where one is free.
    pub around: [Option<usize>; 2],
    /// Change of energy by the merge.
    pub jump: Jump,
}

/// A segment between its neighbours.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbours {
    cable: usize,
    /// Number of the segment in the cable, and of its body.
    segment: usize,
    pub(super) body: usize,
    /// Joints towards the start of the cable and towards its end.
    pub(super) joints: [Option<usize>; 2],
    /// Lengths of the segments beyond them, zero where there is none \[m].
    pub(super) beyond: [f64; 2],
    /// Length of cable in it, and of its rod \[m].
    pub(super) length: f64,
    pub(super) chord: f64,
    /// Direction towards the end of the cable, and the axes of its frames, body frame.
    along: Vector3<f64>,
    axes: Matrix3<f64>,
}

impl Scene {
    /// Segment number `segment` of cable number `cable`; `None` where there is none, or nothing holds it.
    pub(super) fn neighbours(&self, cable: usize, segment: usize) -> Option<Neighbours> {
        let body = *self.cables.get(cable)?.bodies.get(segment)?;
        let joints = [0, 1].map(|end| self.joint_at(cable, segment, end));
        // Side b of the joint towards the start is the segment, side a of the other.
        let frames = [1, 0].map(|side| {
            let joint = joints[1 - side]?;
            self.constraints[joint].frames().get(side)
        });
        let frame = frames[0].or(frames[1])?;
        let next = [segment.wrapping_sub(1), segment + 1];
        let beyond = [0, 1].map(|end| self.length_beyond(cable, joints[end], next[end], end));
        let chord = 2.0 * frame.point.norm();
        if chord == 0.0 {
            return None;
        }
        Some(Neighbours {
            cable,
            segment,
            body,
            joints,
            beyond,
            length: self.segment_length(cable, segment)?,
            chord,
            along: frame.axes.column(0).into_owned(),
            axes: frame.axes,
        })
    }

    /// The joint at an end, 0 or 1, of a segment of a cable.
    pub(super) fn joint_at(&self, cable: usize, segment: usize, end: usize) -> Option<usize> {
        let parts = &self.cables[cable];
        let body = parts.bodies.get(segment).copied();
        let holds = |joint: &&usize| {
            let frame = self.constraints[**joint].frames().get(1 - end);
            frame.is_some_and(|frame| body.is_some() && frame.body_index() == body)
        };
        // Joints are in their order, with or without one at the start.
        let near = [segment + end, (segment + end).wrapping_sub(1)];
        let near = near.iter().filter_map(|n| parts.joints.get(*n));
        near.chain(&parts.joints).find(holds).copied()
    }

    /// Length of the `next` segment, where the joint holds it.
    fn length_beyond(&self, cable: usize, joint: Option<usize>, next: usize, end: usize) -> f64 {
        let held = joint.and_then(|joint| self.constraints[joint].frames().get(end)?.body_index());
        let body = self.cables[cable].bodies.get(next).copied();
        let length = held.filter(|held| body == Some(*held));
        let length = length.and_then(|_| self.segment_length(cable, next));
        length.unwrap_or(0.0)
    }

    /// Length of cable in segment number `segment` of cable number `cable` \[m]; `None` where it has no stock or no such one.
    #[must_use]
    pub fn segment_length(&self, cable: usize, segment: usize) -> Option<f64> {
        let parts = self.cables.get(cable)?;
        let density = parts.stock.as_ref()?.density;
        Some(self.bodies.mass[*parts.bodies.get(segment)?] / density)
    }

    /// The centre of a body is another point of it, `shift` (m) from the old one, body frame.
    pub(super) fn move_centre(&mut self, body: usize, shift: &Vector3<f64>) {
        let moved = self.bodies.orientation[body] * shift;
        self.bodies.position[body] += moved;
        let turning = self.bodies.angular_velocity[body].cross(&moved);
        self.bodies.velocity[body] += turning;
        self.move_points(body, body, &-shift);
    }

    /// The points of constraints on body `from` lie on body `to`, moved by `shift` (m).
    fn move_points(&mut self, from: usize, to: usize, shift: &Vector3<f64>) {
        for constraint in &mut self.constraints {
            for frame in constraint.frames_mut() {
                if frame.body_index() == Some(from) {
                    frame.side = Side::Body(to);
                    frame.point += shift;
                }
            }
        }
    }

    /// Mass, inertia and capsule of a segment with another `length` (m) of cable in another rod, `chord` (m) long.
    pub(super) fn reshape(&mut self, cable: usize, body: usize, length: f64, chord: f64) {
        let Some(stock) = &self.cables[cable].stock else {
            return;
        };
        let mass = stock.density * length;
        self.bodies.mass[body] = mass;
        self.bodies.inertia[body] = Body::rod(chord, stock.radius, mass).inertia;
        let own = self.colliders.iter_mut().filter(|c| c.body == Some(body));
        for collider in own {
            if let Shape::Capsule { length, .. } = &mut collider.shape {
                *length = chord;
            }
        }
    }

    /// Joints at the ends of a segment, or of several, stand for these lengths (m) from it and for half of what is beyond.
    pub(super) fn stand_for(
        &mut self,
        cable: usize,
        joints: [Option<usize>; 2],
        lengths: [f64; 2],
    ) {
        let Some(stock) = &self.cables[cable].stock else {
            return;
        };
        for (joint, length) in joints.into_iter().zip(lengths) {
            if let Some(joint) = joint {
                self.constraints[joint].set_law(&of_length(&stock.per_metre, 0.5 * length));
            }
        }
    }

    /// p_a − p_b of a joint at time `t` (s), zero of none \[m].
    fn gap_at(&self, joint: Option<usize>, t: f64) -> Vector3<f64> {
        match joint.map(|joint| self.constraints[joint].frames()) {
            Some([a, b]) => a.resolve(&self.bodies, t).point() - b.resolve(&self.bodies, t).point(),
            _ => Vector3::zeros(),
        }
    }

    /// Moves the references of joints to their twists at time `t`: what is shared below are twists.
    fn follow_twists<const N: usize>(&mut self, joints: [Option<usize>; N], t: f64) {
        for joint in joints.into_iter().flatten() {
            self.constraints[joint].update_winding(&self.bodies, t);
        }
    }

    fn twist_at(&self, joint: Option<usize>) -> Option<f64> {
        self.constraints[joint?].twist_reference()
    }

    /// Splits segment number `segment` of cable number `cable` at time `t` (s): `keep` (m) of it towards the start of the
    /// cable stay in its body; the rest is a new body, which comes after it in the order of the scene. `None`, and nothing
    /// changed, where the cable has no stock or no such segment, or the segment is not longer than that.
    pub fn split_segment(
        &mut self,
        (cable, segment): (usize, usize),
        keep: f64,
        t: f64,
    ) -> Option<Split> {
        let at = self.neighbours(cable, segment)?;
        let stock = self.cables[cable].stock.clone()?;
        let rest = at.length - keep;
        if !(keep > 0.0 && rest > 0.0) {
            return None;
        }
        let ([before, after], whole) = (at.beyond, at.length);
        let kept = [
            (before + keep) / (before + whole),
            (rest + after) / (whole + after),
        ];
        self.follow_twists(at.joints, t);
        let gaps = at.joints.map(|joint| self.gap_at(joint, t));
        let was = self.energies(&[at.body]);
        let [body, joint] = self.part(&at, &stock, rest);
        let [moved, unspun] = self.ease([at.body, body], &gaps, &kept);
        if stock.per_metre.twist.is_some() {
            self.share_twists(&at, [body, joint], &kept);
        }
        self.break_alike(&at, joint);
        let [kinetic, gravity] = self.energies(&[at.body, body]);
        let place = at.joints[1].or(at.joints[0].map(|joint| joint + 1))?;
        let number = |number: usize| number + usize::from(number >= place);
        self.insert_last(at.body + 1, place);
        Some(Split {
            bodies: [at.body, at.body + 1],
            joint: place,
            around: at.joints.map(|joint| joint.map(number)),
            share: keep / whole,
            jump: Jump {
                kinetic: kinetic - was[0],
                blow: 0.0,
                moved,
                unspun,
                gravity: gravity - was[1],
            },
        })
    }

    /// Takes the last `rest` (m) of a segment as a new one, unstrained: the numbers of its body and of its joint, the last
    /// ones.
    fn part(&mut self, at: &Neighbours, stock: &Stock, rest: f64) -> [usize; 2] {
        let (u, share) = (at.along, rest / at.length);
        // Rods of cable that was laid in a curve are shorter than it is.
        let chords = [at.chord * (1.0 - share), at.chord * share];
        let name = self.cables[at.cable].name.clone();
        let mut number = stock.named + 1;
        while self.has_names_of(&name, number) {
            number += 1;
        }
        let upper = self.bodies.get(at.body);
        let down = upper.orientation * u * (0.5 * chords[0]);
        let lower = Body {
            position: upper.position + down,
            orientation: upper.orientation,
            velocity: upper.velocity + upper.angular_velocity.cross(&down),
            angular_velocity: upper.angular_velocity,
            force: upper.force * share,
            torque: upper.torque * share,
            ..Body::rod(chords[1], stock.radius, stock.density * rest)
        };
        self.bodies.force[at.body] -= lower.force;
        self.bodies.torque[at.body] -= lower.torque;
        let body = self.add_body(format!("{name}-{number}"), lower);
        self.move_centre(at.body, &(u * (-0.5 * chords[1])));
        let ends = 0.5 * chords[0];
        for frame in self.constraints.iter_mut().flat_map(Constraint::frames_mut) {
            if frame.body_index() == Some(at.body) && frame.point.dot(&u) > ends {
                frame.side = Side::Body(body);
                frame.point -= u * (ends + 0.5 * chords[1]);
            }
        }
        let frames = [(at.body, ends), (body, -0.5 * chords[1])]
            .map(|(body, place)| Frame::body(body, u * place).with_axes(at.axes));
        let joint = joint_of(&of_length(&stock.per_metre, 0.5 * at.length), frames);
        let beside = at.joints[0].or(at.joints[1]);
        let group = beside.map_or(0, |i| self.groups[i]);
        let joint = self.add_constraint(format!("{name}-joint-{number}"), joint, group);
        let own = self.colliders.iter().find(|c| c.body == Some(at.body));
        if let Some(mut capsule) = own.cloned() {
            (capsule.name, capsule.body) = (format!("{name}-{number}"), Some(body));
            self.colliders.push(capsule);
        }
        self.reshape(at.cable, body, rest, chords[1]);
        let keep = at.length - rest;
        self.reshape(at.cable, at.body, keep, chords[0]);
        let [before, after] = at.beyond;
        self.stand_for(at.cable, at.joints, [before + keep, rest + after]);
        let parts = &mut self.cables[at.cable];
        parts.bodies.insert(at.segment + 1, body);
        let next = |joint: &usize| at.joints.iter().flatten().any(|own| own == joint);
        let place = parts.joints.iter().position(next).unwrap_or(0);
        parts
            .joints
            .insert(place + usize::from(at.joints[0].is_some()), joint);
        if let Some(stock) = &mut parts.stock {
            stock.named = number;
        }
        [body, joint]
    }

    /// True if a name of segment `number` of a cable is taken: that of its body, capsule or joint,
    /// or of the joint's event.
    fn has_names_of(&self, cable: &str, number: usize) -> bool {
        let segment = format!("{cable}-{number}");
        let joint = format!("{cable}-joint-{number}");
        let event = |event: &Event| event.name.strip_prefix(&*joint) == Some(" breaks");
        self.body_names.contains(&segment)
            || self.colliders.iter().any(|c| c.name == segment)
            || self.may_be_there(&joint)
            || self.events.iter().any(event)
    }

    /// Turns the parts of a segment, the new `body` with the new `joint` and the other, so that of the twists at their outer
    /// ends the parts `kept` are left.
    fn share_twists(&mut self, at: &Neighbours, [body, joint]: [usize; 2], kept: &[f64; 2]) {
        let twists = at.joints.map(|joint| self.twist_at(joint));
        let [first, second] = twists.map(|twist| twist.unwrap_or(0.0));
        let turns = [-first * (1.0 - kept[0]), second * (1.0 - kept[1])];
        for (body, by) in [at.body, body].into_iter().zip(turns) {
            let turn = UnitQuaternion::from_axis_angle(&Unit::new_unchecked(at.along), by);
            self.bodies.orientation[body] *= turn;
        }
        self.constraints[joint].set_twist_reference(turns[1] - turns[0]);
        for ((joint, twist), by) in at.joints.into_iter().zip(twists).zip([turns[0], -turns[1]]) {
            if let (Some(joint), Some(twist)) = (joint, twist) {
                self.constraints[joint].set_twist_reference(twist + by);
            }
        }
    }

    /// Moves two segments so that of the gaps at their outer ends the parts `kept` are left, and keeps their angular
    /// momentum across their axis; what their kinetic energy changes by \[J], and what is lost of the angular momentum about
    /// the axis \[N m s].
    fn ease(&mut self, pair: [usize; 2], gaps: &[Vector3<f64>; 2], kept: &[f64; 2]) -> [f64; 2] {
        let moves = [gaps[0] * (1.0 - kept[0]), gaps[1] * (kept[1] - 1.0)];
        let bodies = &mut self.bodies;
        let mut lost = Vector3::zeros();
        for (body, by) in pair.into_iter().zip(moves) {
            bodies.position[body] += by;
            lost += by.cross(&bodies.velocity[body]) * bodies.mass[body];
        }
        let (centre, inertia) = self.as_one(&pair);
        let bodies = &mut self.bodies;
        let axis = bodies.position[pair[1]] - bodies.position[pair[0]];
        let axis = axis.try_normalize(0.0).unwrap_or_default();
        let unspun = axis.dot(&lost);
        lost -= axis * unspun;
        let mut angular = Vector3::zeros();
        for body in pair {
            let r = bodies.position[body] - centre;
            angular += r.cross(&bodies.velocity[body]) * bodies.mass[body];
            angular += bodies.inertia_world(body) * bodies.angular_velocity[body];
        }
        let inverse = inertia.try_inverse();
        let turn = inverse.map_or(Vector3::zeros(), |inverse| inverse * -lost);
        for body in pair {
            let r = bodies.position[body] - centre;
            bodies.velocity[body] += turn.cross(&r);
            bodies.angular_velocity[body] += turn;
        }
        [turn.dot(&(angular + inertia * turn * 0.5)), unspun.abs()]
    }

    /// The joint breaks as the one at the other end of the segments does.
    fn break_alike(&mut self, at: &Neighbours, joint: usize) {
        let breaks = |joint: usize| {
            self.events.iter().find_map(|event| match &event.when {
                When::Force { constraint, above } if *constraint == joint => {
                    (event.then == [Action::Release(joint)]).then_some(*above)
                }
                _ => None,
            })
        };
        let inner = (0..2).rev().filter(|end| at.beyond[*end] > 0.0);
        let above = match inner.filter_map(|end| at.joints[end]).next() {
            Some(inner) => breaks(inner),
            // The last segment of a cable: one that breaks anywhere breaks at both ends alike.
            None => match at.joints.map(|joint| joint.and_then(breaks)) {
                [Some(first), Some(second)] if first == second => Some(first),
                _ => None,
            },
        };
        if let Some(above) = above {
            self.break_at(joint, above);
        }
    }

    /// Merges segment number `segment` of cable number `cable` with the next one at time `t` (s): it is then both, and the
    /// next one and their joint are to be removed. `None`, and nothing changed, where the cable has no stock, or no two such
    /// segments that are joined.
    pub fn merge_segments(&mut self, (cable, segment): (usize, usize), t: f64) -> Option<Merged> {
        let pair = [
            self.neighbours(cable, segment)?,
            self.neighbours(cable, segment + 1)?,
        ];
        let joint = pair[0].joints[1].filter(|joint| pair[1].joints[0] == Some(*joint))?;
        if !self.constraints[joint].joins_cable() {
            return None;
        }
        let radius = self.cables[cable].stock.as_ref()?.radius;
        let ([first, next], u) = (pair.map(|p| p.body), pair[0].along);
        let around = [pair[0].joints[0], pair[1].joints[1]];
        self.follow_twists([around[0], Some(joint), around[1]], t);
        let was = self.energies(&[first, next]);
        let blow = -self.blow(joint);
        let (growth, share) = growth(&pair);
        let mut merged = self.merged(&pair, radius, (&growth, share), t);
        let [moved, unspun] = self.straightened(&pair, &merged);
        let twists = self.merged_twists(joint, around, (&growth, share));
        let turned = twists[0] - self.twist_at(around[0]).unwrap_or(0.0);
        merged.orientation *= UnitQuaternion::from_axis_angle(&Unit::new_unchecked(u), turned);
        self.bodies.put(first, merged);
        self.move_points(first, first, &(u * (-0.5 * pair[1].chord)));
        // The joint between them keeps its sides until it is removed.
        let between = self.constraints[joint].clone();
        self.move_points(next, first, &(u * (0.5 * pair[0].chord)));
        self.constraints[joint] = between;
        for (joint, twist) in around.into_iter().zip(twists) {
            if let Some(joint) = joint {
                self.constraints[joint].set_twist_reference(twist);
            }
        }
        let both = pair[0].length + pair[1].length;
        self.reshape(cable, first, both, pair[0].chord + pair[1].chord);
        let ends = [pair[0].beyond[0] + both, both + pair[1].beyond[1]];
        self.stand_for(cable, around, ends);
        let [kinetic, gravity] = self.energies(&[first]);
        Some(Merged {
            body: next,
            joint,
            around,
            jump: Jump {
                kinetic: kinetic - was[0],
                blow,
                moved,
                unspun,
                gravity: gravity - was[1],
            },
        })
    }

    /// Two segments as one, without the turn about its axis.
    fn merged(
        &self,
        pair: &[Neighbours; 2],
        radius: f64,
        (growth, share): (&[f64; 2], f64),
        t: f64,
    ) -> Body {
        let (bodies, around) = (&self.bodies, [pair[0].joints[0], pair[1].joints[1]]);
        let places = pair.map(|p| bodies.position[p.body]);
        let [a, b] = pair.map(|p| bodies.orientation[p.body] * p.along);
        let along = a * pair[0].chord + b * pair[1].chord;
        let along = along.try_normalize(0.0).unwrap_or(b);
        let chord = pair[0].chord + pair[1].chord;
        let gaps = around.map(|joint| self.gap_at(joint, t));
        let start = places[0] - a * (0.5 * pair[0].chord) + gaps[0];
        let end = places[1] + b * (0.5 * pair[1].chord) - gaps[1];
        let gap = gaps[0] * growth[0];
        let left = along * chord - (end - start) - gap - gaps[1] * growth[1];
        // A free end takes up all that is left.
        let share = match around {
            [Some(_), Some(_)] => share,
            [Some(_), None] => 0.0,
            [None, Some(_)] => 1.0,
            [None, None] => 0.5,
        };
        let position = start - gap - left * share + along * (0.5 * chord);
        let mass = pair.map(|p| bodies.mass[p.body]).iter().sum();
        let rod = Body::rod(chord, radius, mass);
        let (mut momentum, mut angular, mut spin) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (body, axis) in pair.map(|p| p.body).into_iter().zip([a, b]) {
            let p = bodies.velocity[body] * bodies.mass[body];
            let omega = bodies.angular_velocity[body];
            momentum += p;
            angular += (bodies.position[body] - position).cross(&p);
            angular += bodies.inertia_world(body) * omega;
            spin += bodies.mass[body] * axis.dot(&omega) / mass;
        }
        angular -= along * along.dot(&angular);
        Body {
            position,
            orientation: smallest_rotation(&a, &along) * bodies.orientation[pair[0].body],
            velocity: momentum / mass,
            angular_velocity: angular / rod.inertia[(0, 0)] + along * spin,
            force: pair.iter().map(|p| bodies.force[p.body]).sum(),
            torque: pair.iter().map(|p| bodies.torque[p.body]).sum(),
            ..rod
        }
    }

    /// Twists at the ends of two segments that have merged at a joint, of the same sum as the three before; one that nothing
    /// holds at its start turns as the second one.
    fn merged_twists(
        &self,
        joint: usize,
        around: [Option<usize>; 2],
        (growth, share): (&[f64; 2], f64),
    ) -> [f64; 2] {
        let between = self.twist_at(Some(joint)).unwrap_or(0.0);
        match around.map(|joint| self.twist_at(joint)) {
            [Some(first), Some(second)] => {
                let sum = first + between + second;
                let kept = [first * growth[0], second * growth[1]];
                let first = kept[0] + (sum - kept[0] - kept[1]) * share;
                [first, sum - first]
            }
            [Some(first), None] => [first, 0.0],
            [None, second] => [between, second.unwrap_or(0.0)],
        }
    }
}

/// By how much the joints around two segments grow that merge, and the first joint's part of both then.
fn growth([first, second]: &[Neighbours; 2]) -> ([f64; 2], f64) {
    let both = first.length + second.length;
    let before = [
        first.beyond[0] + first.length,
        second.length + second.beyond[1],
    ];
    let after = [first.beyond[0] + both, both + second.beyond[1]];
    let growth = [after[0] / before[0], after[1] / before[1]];
    (growth, after[0] / (after[0] + after[1]))
}

impl Constraint {
    /// True for the joints that segments can split and merge at.
    pub(super) fn joins_cable(&self) -> bool {
        match self {
            Self::Spherical(_) => true,
            Self::Cosserat(c) => c.law.stretch.is_some(),
            _ => false,
        }
    }
}

/// A joint of cable with these laws.
fn joint_of(law: &JointLaw, frames: [Frame; 2]) -> Constraint {
    match (law.bend, law.twist) {
        (None, None) => Spherical {
            frames,
            stretch: law.stretch.unwrap_or_default(),
        }
        .into(),
        _ => Cosserat::new(frames, *law).into(),
    }
}

#[cfg(test)]
pub(super) mod tests;
