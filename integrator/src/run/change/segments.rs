//! Segments that split and merge, at winches and by the rules of their cables, as changes of a scene.
//!
//! The joint of a new segment takes a part of the multipliers of the joints beside it, as a tension that changes linearly
//! between them. The past rate of a gap that is gone goes to the gaps beside it: the sum along the cable is what its load
//! feels, and stays.

use super::Edit;
use crate::run::Stepper;
use crate::run::identity::{BodyId, ConstraintId};
use crate::{Resolved, StepError};
use nalgebra::Vector3;
use taut_model::scene::resolution::Due;
use taut_model::scene::segments::{Merged, Split};
use taut_model::{Constraint, MAX_ROWS};

/// Most segments that a winch pays out in a step.
const MOST: usize = 64;

/// A segment that has split.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parted {
    /// Bodies of its new part and of the one that it was.
    pub(super) bodies: [BodyId; 2],
    /// The joint between them, and those around.
    joint: ConstraintId,
    around: [Option<ConstraintId>; 2],
    /// Parts of the forces of the joints around that are the new joint's.
    shares: [f64; 2],
}

/// A joint that has gone with a segment that another one took in, and the joints around.
#[derive(Debug, Clone, Copy)]
pub(super) struct Closed {
    joint: ConstraintId,
    around: [Option<ConstraintId>; 2],
}

impl Edit {
    /// Splits and merges the first segments of cables at their winches where due, at most [`MOST`]
    /// times a cable.
    pub(crate) fn wind(&mut self) -> Result<Resolved, StepError> {
        let mut done = Resolved::default();
        let leads: Vec<_> = self
            .scene
            .fairleads()
            .map(|i| self.ids.of_constraint(i))
            .collect();
        for lead in leads {
            for _ in 0..MOST {
                let i = self.ids.constraint(lead)?;
                let cable = self.scene.cable_at(i);
                if let Some(split) = self.scene.split_at_winch(i, self.time) {
                    self.part(&split, &mut done);
                } else if let Some(merged) = self.scene.merge_at_winch(i, self.time) {
                    self.close(&merged, &mut done)?;
                } else {
                    break;
                }
                cable
                    .into_iter()
                    .for_each(|cable| self.scene.resolved(cable, self.time));
            }
        }
        Ok(done)
    }

    /// Splits and merges segments of cables, by their numbers, as their rules ask for.
    pub(crate) fn resolve(&mut self, all: &[(usize, Vec<Due>)]) -> Result<Resolved, StepError> {
        let mut done = Resolved::default();
        // Merged segments and their joints are removed together at the end, since each removal
        // costs as much as the scene is large. The cable drops them at once.
        let (mut bodies, mut joints) = (Vec::new(), Vec::new());
        for (cable, due) in all {
            // Net gain of segments by the changes so far, which shifts the numbers of those nearer
            // to the end. Changes that run towards the start shift nothing.
            let (mut more, mut last) = (0, 0);
            for due in due {
                if due.segment < last {
                    more = 0;
                }
                last = due.segment;
                let at = (*cable, due.segment.strict_add_signed(more));
                if due.splits {
                    let half = 0.5 * self.scene.segment_length(at.0, at.1).unwrap_or(0.0);
                    if let Some(split) = self.scene.split_segment(at, half, self.time) {
                        self.part(&split, &mut done);
                        let parts = split.bodies.map(|body| self.ids.of_body(body));
                        self.reshaped.extend(parts);
                        more += 1;
                    }
                } else if let Some(merged) = self.scene.merge_segments(at, self.time) {
                    self.note(&merged, &mut done);
                    let parts = &mut self.scene.cables[*cable];
                    let whole = parts.bodies[at.1];
                    self.reshaped.push(self.ids.of_body(whole));
                    parts.bodies.retain(|body| *body != merged.body);
                    parts.joints.retain(|joint| *joint != merged.joint);
                    more -= 1;
                    bodies.push(self.ids.of_body(merged.body));
                    joints.push(self.ids.of_constraint(merged.joint));
                }
            }
            self.scene.resolved(*cable, self.time);
        }
        let bodies = bodies.into_iter().map(|id| self.ids.body(id));
        let joints = joints.into_iter().map(|id| self.ids.constraint(id));
        let bodies = bodies.collect::<Result<Vec<_>, _>>()?;
        let joints = joints.collect::<Result<Vec<_>, _>>()?;
        if !bodies.is_empty() {
            self.remove(&bodies, &joints)?;
        }
        Ok(done)
    }

    fn part(&mut self, split: &Split, done: &mut Resolved) {
        self.touched = true;
        done.splits += 1;
        done.jump += split.jump;
        self.ids.insert(split.bodies[1], split.joint);
        let of = |joint| self.ids.of_constraint(joint);
        let [first, new] = split.bodies.map(|body| self.ids.of_body(body));
        self.parted.push(Parted {
            bodies: [new, first],
            joint: of(split.joint),
            around: split.around.map(|joint| joint.map(of)),
            shares: [1.0 - split.share, split.share],
        });
    }

    fn close(&mut self, merged: &Merged, done: &mut Resolved) -> Result<(), StepError> {
        self.note(merged, done);
        self.remove(&[merged.body], &[merged.joint])
    }

    fn note(&mut self, merged: &Merged, done: &mut Resolved) {
        self.touched = true;
        done.merges += 1;
        done.jump += merged.jump;
        let of = |joint| self.ids.of_constraint(joint);
        self.closed.push(Closed {
            joint: of(merged.joint),
            around: merged.around.map(|joint| joint.map(of)),
        });
    }
}

impl Stepper {
    /// First segments split and merge. Allocates where there are any.
    pub(crate) fn wind(&mut self) -> Result<Resolved, StepError> {
        let due = |i: &usize| self.step.scene.winding_due(*i).is_some();
        if !self.step.winches.fairleads.iter().any(due) {
            return Ok(Resolved::default());
        }
        let elastic = self.elastic_energy();
        let mut done = self.change(Edit::wind)?;
        done.elastic = self.elastic_energy() - elastic;
        Ok(done)
    }

    /// The forces and the past of joints beside segments that have split and merged, in this stepper, which takes the place
    /// of `before`.
    pub(super) fn carry_over(&mut self, before: &Self, parted: &[Parted], closed: &[Closed]) {
        for segment in parted {
            self.hang_on(segment);
        }
        for Closed { joint, around } in closed {
            // One that is new in the same change has no past.
            if let Ok(joint) = before.ids.constraint(*joint) {
                let rates =
                    &before.step.history.rate[before.step.system_data.rows.row_range(joint)];
                self.remember(rates, *around);
            }
        }
    }

    /// Segments with another centre have a past like the present: which part of them has kept the number is no matter.
    pub(super) fn begin_past_of(&mut self, segments: &[BodyId]) {
        for segment in segments {
            if let Ok(i) = self.ids.body(*segment) {
                let now = self.step.scene.bodies.rates(i);
                self.step.system_data.v.set(i, now);
                self.step.history.v.set(i, now);
            }
        }
    }

    /// The joint between the parts of a segment bears what its neighbours do. Where one of them has gone in the same change the
    /// other one stands for both.
    fn hang_on(&mut self, segment: &Parted) {
        let (rows, ids) = (&self.step.system_data.rows, &self.ids);
        let Ok(joint) = ids.constraint(segment.joint) else {
            return;
        };
        let around = segment
            .around
            .map(|joint| joint.map(|joint| ids.constraint(joint).ok()));
        let shares = match around {
            [Some(None), Some(Some(_))] => [0.0, 1.0],
            [Some(Some(_)), Some(None)] => [1.0, 0.0],
            _ => segment.shares,
        };
        for multipliers in [
            &mut self.step.multipliers.mu,
            &mut self.step.multipliers.tension,
            &mut self.step.output.reported.sum,
        ] {
            let mut sum = [0.0; MAX_ROWS];
            for (c, share) in around.into_iter().zip(shares) {
                let Some(c) = c.flatten() else {
                    continue;
                };
                let (lambda, bodies) = (&multipliers[rows.row_range(c)], &self.step.scene.bodies);
                let wrench =
                    self.step.scene.constraints[c].wrench(bodies, self.step.time, lambda, 0);
                let force = wrench.unwrap_or_default().force;
                let angular = lambda.get(3..).unwrap_or_default();
                let all = force.iter().chain(angular);
                sum.iter_mut()
                    .zip(all)
                    .for_each(|(sum, x)| *sum += share * x);
            }
            let to = &mut multipliers[rows.row_range(joint)];
            to.iter_mut().zip(sum).for_each(|(to, sum)| *to = sum);
        }
    }

    /// The joints beside one that is gone, as far as they are there, have the past of its gap, equal parts of its `rates`: the
    /// cable between them has grown as fast as before.
    fn remember(&mut self, rates: &[f64], neighbours: [Option<ConstraintId>; 2]) {
        let (gap, angular) = rates.split_at(3);
        let gap = Vector3::from_column_slice(gap);
        let there = neighbours.map(|joint| self.ids.constraint(joint?).ok());
        let part = 1.0 / there.iter().flatten().count().max(1) as f64;
        for c in there.into_iter().flatten() {
            let constraint = &self.step.scene.constraints[c];
            let mut own = gap;
            if let Constraint::Fairlead(lead) = constraint {
                let axes = lead.frames[1]
                    .resolve(&self.step.scene.bodies, self.step.time)
                    .axes;
                own = axes.transpose() * gap;
                own.x = -own.x;
            }
            let rows = self.step.system_data.rows.row_range(c);
            let all = own.iter().chain(angular);
            for (rate, more) in self.step.history.rate[rows].iter_mut().zip(all) {
                *rate += part * more;
            }
        }
    }
}
