//! Cables of segments at their winches: the first segment is cut to its length, splits and merges.
//!
//! **Cut.** What a winch pays out or hauls in between t and t′ moves the point of the first segment that lies at the
//! winch ([`Fairlead`]); then the segment is cut there: its mass ρ ℓ₁, its inertia and its centre follow the length ℓ₁, and
//! it goes on moving as the rigid body that it was, v ← v + ω × s for a centre that is moved by s. What leaves takes its
//! momentum along into the drum, which turns as fast. The joints at the segment's ends have the compliances of ℓ₁/2 and
//! (ℓ₁ + ℓ₂)/2 of cable.
//!
//! **Split** at ℓ₁ > (1 + [`LEAST`]) ℓ into ℓ₁ − ℓ and a whole segment ℓ, and **merge** with the next one at
//! ℓ₁ < `LEAST` ℓ. Mass, length, momentum and angular momentum stay; a merge loses ½ μ Δv² of the reduced inertia, as a
//! plastic blow does. The compliances of the joints at the winch, in lengths of cable, are
//!
//! ```text
//! ½ℓ₁,  ½(ℓ₁ + ℓ₂)    ⇄    ½(ℓ₁ − ℓ),  ½ℓ₁,  ½(ℓ + ℓ₂)        of the same sum, ℓ₁ + ½ℓ₂
//! ```
//!
//! Each joint that stays keeps its strain, g/e of its gap g over its length e, so that the segments between move; what is left
//! of the sum of the gaps is that of the new joint. Its strain is then the mean of its neighbours' for a tension that
//! changes linearly, so that a cable at rest under its own weight stays at rest. Twists are shared alike, the
//! segments turning about their own axes, which keeps the sum of the twists to rounding. Bends are not shared. Two segments
//! that merge bent by β become as long as both: the gaps take up what their chord is shorter by, ℓβ²/6 at most.
//!
//! About the axis of a merged segment the spins are kept instead of the angular momentum about the bent pair's chord, which
//! a thin rod would have to take up by spinning (ℓ/r)² times faster.

use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use super::Scene;
use super::event::{Action, When};
use crate::body::Body;
use crate::constraint::{Constraint, Cosserat, Fairlead, LEAST, Spherical, of_length};
use crate::frame::{Frame, Side, smallest_rotation};

/// A segment that a first one has left behind.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Split {
    /// Number of its body.
    pub body: usize,
    /// Number of its joint to the first segment.
    pub joint: usize,
    /// Number of the joint at its other end, which has been the first segment's; `None` where that is free.
    pub next: Option<usize>,
    /// Part of the difference between the joint at the winch and the next one that its joint is away from that at the winch.
    pub share: f64,
}

/// A second segment that a first one has taken in: what is to be removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Merged {
    /// Number of its body.
    pub body: usize,
    /// Number of its joint to the first segment.
    pub joint: usize,
    /// Number of the joint at its other end, now the first segment's, which stays; `None` where that is free.
    pub next: Option<usize>,
}

/// What is at a winch.
#[derive(Debug, Clone, Copy)]
struct AtWinch {
    cable: usize,
    /// The first segment, and the joint at its other end.
    body: usize,
    joint: Option<usize>,
    /// The second segment, and the joint at its other end.
    next: Option<usize>,
    after: Option<usize>,
}

impl Scene {
    /// Numbers of the constraints at which cables of segments leave their winches.
    pub fn fairleads(&self) -> impl Iterator<Item = usize> + '_ {
        let all = self.constraints.iter().enumerate();
        all.filter_map(|(i, c)| matches!(c, Constraint::Fairlead(_)).then_some(i))
    }

    /// Cuts the first segment of the cable that leaves its winch at constraint `i` to the length that it has at time `t` (s),
    /// `paid` (m) more than its speed has fed. Whether it has another length now. Allocates: no.
    ///
    /// # Panics
    /// When there is no such constraint.
    pub fn cut_at_winch(&mut self, i: usize, t: f64, paid: f64) -> bool {
        let Constraint::Fairlead(lead) = &mut self.constraints[i] else {
            return false;
        };
        let length = lead.length_at(t) + paid;
        let by = length - lead.length;
        lead.winch.since = t;
        let (Some(body), true) = (lead.frames[1].body_index(), by != 0.0) else {
            return false;
        };
        lead.first += by;
        lead.length = length;
        let shift = lead.along() * (-0.5 * by);
        // All points stay where they are in the material but that at the winch.
        lead.frames[1].point += 2.0 * shift;
        let mass = lead.density * lead.first;
        self.move_centre(body, &shift);
        self.renew(i, mass);
        true
    }

    /// Whether the first segment of the cable that leaves its winch at constraint `i` is to be split (`Some(true)`) or merged.
    #[must_use]
    pub fn winding_due(&self, i: usize) -> Option<bool> {
        let lead = self.lead(i)?;
        if lead.first > (1.0 + LEAST) * lead.segment {
            return Some(true);
        }
        let merges = lead.first < LEAST * lead.segment && self.at_winch(i)?.next.is_some();
        merges.then_some(false)
    }

    fn lead(&self, i: usize) -> Option<&Fairlead> {
        match self.constraints.get(i) {
            Some(Constraint::Fairlead(lead)) => Some(lead),
            _ => None,
        }
    }

    fn at_winch(&self, i: usize) -> Option<AtWinch> {
        let body = self.lead(i)?.frames[1].body_index()?;
        let leads = |cable: &super::CableParts| cable.joints.contains(&i);
        let cable = self.cables.iter().position(leads)?;
        let parts = &self.cables[cable];
        let after = |k: usize, body: usize| {
            let begins = |joint: &&usize| {
                let first = self.constraints[**joint].frames().first();
                **joint != i && first.and_then(Frame::body_index) == Some(body)
            };
            // It is the next in the list, unless a scene has another order.
            let next = parts.joints.get(k).filter(begins);
            next.or_else(|| parts.joints.iter().find(begins)).copied()
        };
        let beyond = |joint: usize, k: usize| {
            let body = self.constraints[joint].frames().get(1)?.body_index()?;
            let next = parts.bodies.get(k) == Some(&body) || parts.bodies.contains(&body);
            next.then_some(body)
        };
        let joint = after(1, body);
        let next = joint.and_then(|joint| beyond(joint, 1));
        Some(AtWinch {
            cable,
            body,
            joint,
            next,
            after: next.and_then(|next| after(2, next)),
        })
    }

    /// The centre of a body is another point of it, `shift` (m) from the old one, body frame.
    fn move_centre(&mut self, body: usize, shift: &Vector3<f64>) {
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

    /// Mass (kg), inertia and joints of the first segment, whose ends are where its joints are.
    fn renew(&mut self, i: usize, mass: f64) {
        let (Some(at), Some(lead)) = (self.at_winch(i), self.lead(i)) else {
            return;
        };
        let (chord, radius) = (2.0 * lead.frames[1].point.norm(), lead.radius);
        let own = of_length(
            &lead.per_metre,
            0.5 * (lead.first + self.length_of(i, at.next)),
        );
        self.bodies.mass[at.body] = mass;
        self.bodies.inertia[at.body] = Body::rod(chord, radius, mass).inertia;
        if let Some(joint) = at.joint {
            self.constraints[joint].set_law(&own);
        }
    }

    /// Length of cable in a segment, none of none \[m].
    fn length_of(&self, i: usize, body: Option<usize>) -> f64 {
        match (body, self.lead(i)) {
            (Some(body), Some(lead)) => self.bodies.mass[body] / lead.density,
            _ => 0.0,
        }
    }

    /// p_a − p_b of a joint at time `t` (s), zero of none \[m].
    fn gap_at(&self, joint: Option<usize>, t: f64) -> Vector3<f64> {
        match joint.map(|joint| self.constraints[joint].frames()) {
            Some([a, b]) => a.resolve(&self.bodies, t).point() - b.resolve(&self.bodies, t).point(),
            _ => Vector3::zeros(),
        }
    }

    fn twist_at(&self, joint: Option<usize>) -> Option<f64> {
        self.constraints[joint?].twist_reference()
    }

    /// Splits the first segment of the cable that leaves its winch at constraint `i`, where it is due, at time `t` (s). The
    /// whole segment that it leaves behind, and its joint, come after it in the order of the scene.
    pub fn split_at_winch(&mut self, i: usize, t: f64) -> Option<Split> {
        let due = self.winding_due(i) == Some(true);
        let at = self.at_winch(i).filter(|_| due)?;
        let lead = self.lead(i)?.clone();
        let next = self.length_of(i, at.next);
        let (whole, rest) = (lead.segment, lead.first - lead.segment);
        let kept = [rest / lead.first, (whole + next) / (lead.first + next)];
        let gaps = [self.gap_at(Some(i), t), self.gap_at(at.joint, t)];
        let [body, joint] = self.part(i, &at, &lead);
        self.ease([at.body, body], &gaps, &kept);
        if let Some(first) = lead.law().twist.map(|_| lead.twist_reference) {
            let second = self.twist_at(at.joint);
            let turns = [
                -first * (1.0 - kept[0]),
                second.unwrap_or(0.0) * (1.0 - kept[1]),
            ];
            for (body, by) in [(at.body, turns[0]), (body, turns[1])] {
                let turn = UnitQuaternion::from_axis_angle(&Unit::new_unchecked(lead.along()), by);
                self.bodies.orientation[body] *= turn;
            }
            self.constraints[i].set_twist_reference(first + turns[0]);
            self.constraints[joint].set_twist_reference(turns[1] - turns[0]);
            if let (Some(second), Some(next)) = (second, at.joint) {
                self.constraints[next].set_twist_reference(second - turns[1]);
            }
        }
        self.break_alike(&at, joint);
        let after = |number: usize, at: usize| number + usize::from(number >= at);
        let split = Split {
            body: at.body + 1,
            joint: i + 1,
            next: at.joint.map(|joint| after(joint, i + 1)),
            share: rest / lead.first,
        };
        self.insert_last(split.body, split.joint);
        Some(split)
    }

    /// The first segment leaves a whole one behind, unstrained: the numbers of its body and of its joint, the last ones.
    fn part(&mut self, i: usize, at: &AtWinch, lead: &Fairlead) -> [usize; 2] {
        let (u, whole) = (lead.along(), lead.segment);
        let chord = 2.0 * lead.frames[1].point.norm();
        let (rest, name) = (lead.first - whole, self.cables[at.cable].name.clone());
        let mut number = lead.named + 1;
        while self.body_names.contains(&format!("{name}-{number}")) {
            number += 1;
        }
        let mut lower = self.bodies.get(at.body);
        let down = lower.orientation * u * (0.5 * (chord - whole));
        lower = Body {
            position: lower.position + down,
            orientation: lower.orientation,
            velocity: lower.velocity + lower.angular_velocity.cross(&down),
            angular_velocity: lower.angular_velocity,
            ..Body::rod(whole, lead.radius, lead.density * whole)
        };
        let body = self.add_body(format!("{name}-{number}"), lower);
        self.move_centre(at.body, &(u * (-0.5 * whole)));
        let ends = 0.5 * (chord - whole);
        for frame in self.constraints.iter_mut().flat_map(Constraint::frames_mut) {
            if frame.body_index() == Some(at.body) && frame.point.dot(&u) > ends {
                frame.side = Side::Body(body);
                frame.point -= u * (ends + 0.5 * whole);
            }
        }
        let axes = lead.frames[1].axes;
        let frames = [(at.body, ends), (body, -0.5 * whole)]
            .map(|(body, place)| Frame::body(body, u * place).with_axes(axes));
        let law = of_length(&lead.per_metre, 0.5 * lead.first);
        let joint: Constraint = match (law.bend, law.twist) {
            (None, None) => Spherical {
                frames,
                stretch: law.stretch.unwrap_or_default(),
            }
            .into(),
            _ => Cosserat::new(frames, law).into(),
        };
        let joint = self.add_constraint(format!("{name}-joint-{number}"), joint, self.groups[i]);
        if let Constraint::Fairlead(lead) = &mut self.constraints[i] {
            (lead.first, lead.named) = (rest, number);
        }
        let parts = &mut self.cables[at.cable];
        parts.bodies.insert(1, body);
        parts.joints.insert(1, joint);
        let mass = lead.density * rest;
        self.renew(i, mass);
        if let Some(next) = at.joint {
            let length = 0.5 * (whole + self.length_of(i, at.next));
            self.constraints[next].set_law(&of_length(&lead.per_metre, length));
        }
        [body, joint]
    }

    /// Moves two segments so that of the gaps at their outer ends the parts `kept` are left, and keeps their angular
    /// momentum across their axis.
    fn ease(&mut self, pair: [usize; 2], gaps: &[Vector3<f64>; 2], kept: &[f64; 2]) {
        let moves = [gaps[0] * (1.0 - kept[0]), gaps[1] * (kept[1] - 1.0)];
        let bodies = &mut self.bodies;
        let mut lost = Vector3::zeros();
        for (body, by) in pair.into_iter().zip(moves) {
            bodies.position[body] += by;
            lost += by.cross(&bodies.velocity[body]) * bodies.mass[body];
        }
        let mass = bodies.mass[pair[0]] + bodies.mass[pair[1]];
        let centre = pair.map(|b| bodies.position[b] * (bodies.mass[b] / mass));
        let centre = centre[0] + centre[1];
        let mut inertia = Matrix3::zeros();
        for body in pair {
            let r = bodies.position[body] - centre;
            let point = Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose();
            inertia += bodies.inertia_world(body) + point * bodies.mass[body];
        }
        let axis = (bodies.position[pair[1]] - bodies.position[pair[0]]).normalize();
        lost -= axis * axis.dot(&lost);
        let turn = inertia
            .try_inverse()
            .map_or(Vector3::zeros(), |inverse| inverse * -lost);
        for body in pair {
            let r = bodies.position[body] - centre;
            bodies.velocity[body] += turn.cross(&r);
            bodies.angular_velocity[body] += turn;
        }
    }

    /// The joint breaks as the one at the other end of the segments does.
    fn break_alike(&mut self, at: &AtWinch, joint: usize) {
        let Some(next) = at.joint.filter(|_| at.next.is_some()) else {
            return;
        };
        let breaks = self.events.iter().find_map(|event| match &event.when {
            When::Force { constraint, above } if *constraint == next => {
                (event.then == [Action::Release(next)]).then_some(*above)
            }
            _ => None,
        });
        if let Some(above) = breaks {
            self.break_at(joint, above);
        }
    }

    /// Merges the first two segments of the cable that leaves its winch at constraint `i`, where that is due, at time `t` (s):
    /// the first one is then both, and the second one and their joint are to be removed.
    pub fn merge_at_winch(&mut self, i: usize, t: f64) -> Option<Merged> {
        let due = self.winding_due(i) == Some(false);
        let at = self.at_winch(i).filter(|_| due)?;
        let lead = self.lead(i)?.clone();
        let (joint, next, u) = (at.joint?, at.next?, lead.along());
        let near = self.constraints[joint].frames().get(1)?.point;
        let chords = [lead.frames[1].point, near].map(|p| 2.0 * p.norm());
        let last = at
            .after
            .and_then(|after| self.constraints[after].frames().get(1)?.body_index());
        let segment = last.filter(|last| self.cables[at.cable].bodies.contains(last));
        let lengths = [
            lead.first,
            self.length_of(i, Some(next)),
            self.length_of(i, segment),
        ];
        let mut merged = self.merged((i, t), (&at, next), &lead, (&chords, &lengths));
        let [first, second] = self.shared_twists(i, &at, &lengths);
        let turned = first - self.twist_at(Some(i)).unwrap_or(0.0);
        merged.orientation *= UnitQuaternion::from_axis_angle(&Unit::new_unchecked(u), turned);
        self.bodies.put(at.body, merged);
        self.move_points(at.body, at.body, &(u * (-0.5 * chords[1])));
        // The joint between them keeps its sides until it is removed.
        let between = self.constraints[joint].clone();
        self.move_points(next, at.body, &(u * (0.5 * chords[0])));
        self.constraints[joint] = between;
        if let Constraint::Fairlead(lead) = &mut self.constraints[i] {
            lead.first = lengths[0] + lengths[1];
            lead.twist_reference = first;
        }
        if let Some(after) = at.after {
            self.constraints[after].set_twist_reference(second);
            let own = of_length(&lead.per_metre, 0.5 * lengths.iter().sum::<f64>());
            self.constraints[after].set_law(&own);
        }
        Some(Merged {
            body: next,
            joint,
            next: at.after,
        })
    }

    /// The first segment and the `next` one as one, without the turn about its axis.
    fn merged(
        &self,
        (i, t): (usize, f64),
        (at, next): (&AtWinch, usize),
        lead: &Fairlead,
        (chords, lengths): (&[f64; 2], &[f64; 3]),
    ) -> Body {
        let (bodies, pair) = (&self.bodies, [at.body, next]);
        let [a, b] = pair.map(|body| bodies.orientation[body] * lead.along());
        let along = (a * chords[0] + b * chords[1])
            .try_normalize(0.0)
            .unwrap_or(b);
        let chord = chords[0] + chords[1];
        let gaps = [self.gap_at(Some(i), t), self.gap_at(at.after, t)];
        let start = bodies.position[pair[0]] - a * (0.5 * chords[0]) + gaps[0];
        let end = bodies.position[pair[1]] + b * (0.5 * chords[1]) - gaps[1];
        let (grown, share) = growth(lengths);
        let gap = gaps[0] * grown[0];
        let left = along * chord - (end - start) - gap - gaps[1] * grown[1];
        let gap = if at.after.is_some() {
            gap + left * share
        } else {
            gap
        };
        let position = start - gap + along * (0.5 * chord);
        let mass = bodies.mass[pair[0]] + bodies.mass[pair[1]];
        let rod = Body::rod(chord, lead.radius, mass);
        let (mut momentum, mut angular, mut spin) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (body, axis) in pair.into_iter().zip([a, b]) {
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
            orientation: smallest_rotation(&a, &along) * bodies.orientation[pair[0]],
            velocity: momentum / mass,
            angular_velocity: angular / rod.inertia[(0, 0)] + along * spin,
            force: pair.iter().map(|body| bodies.force[*body]).sum(),
            torque: pair.iter().map(|body| bodies.torque[*body]).sum(),
            ..rod
        }
    }

    /// Twists at the winch and at the other end of the first segment when it has merged with the next, of the same sum; one
    /// that nothing holds at the winch turns as the next.
    fn shared_twists(&self, i: usize, at: &AtWinch, lengths: &[f64; 3]) -> [f64; 2] {
        let between = self.twist_at(at.joint).unwrap_or(0.0);
        match (self.twist_at(Some(i)), self.twist_at(at.after)) {
            (Some(first), Some(second)) => {
                let (grown, share) = growth(lengths);
                let sum = first + between + second;
                let kept = [first * grown[0], second * grown[1]];
                let first = kept[0] + (sum - kept[0] - kept[1]) * share;
                [first, sum - first]
            }
            (Some(first), None) => [first, 0.0],
            (None, second) => [between, second.unwrap_or(0.0)],
        }
    }
}

/// By how much the joints at the ends of a first segment grow that merges with the next one, for the lengths of the two and
/// the one after them; and the first joint's part of both then.
fn growth([first, second, third]: &[f64; 3]) -> ([f64; 2], f64) {
    let before = [*first, second + third];
    let after = [first + second, first + second + third];
    let grown = [after[0] / before[0], after[1] / before[1]];
    (grown, after[0] / (after[0] + after[1]))
}

#[cfg(test)]
mod tests;
