//! Segments that split from the first one at a winch and merge with it, as changes of a scene.
//!
//! The joint of a new segment takes a part of the multipliers of the joints beside it, as a tension that changes linearly
//! between them. The past rate of a gap that is gone goes to the gaps beside it: the sum along the cable is what its load
//! feels, and stays.

use super::Edit;
use crate::StepError;
use crate::identity::{BodyId, ConstraintId};
use crate::stepper::Stepper;
use nalgebra::Vector3;
use taut_model::scene::winding::Split;
use taut_model::{Constraint, MAX_ROWS};

/// Most segments that a winch pays out in a step.
const MOST: usize = 64;

/// A segment that a first one has left behind at a winch.
#[derive(Debug, Clone, Copy)]
pub(super) struct PaidOut {
    /// Bodies of the segment and of the first one.
    pub(super) bodies: [BodyId; 2],
    /// Their joint, that at the winch, and that at the segment's other end.
    joint: ConstraintId,
    neighbours: [Option<ConstraintId>; 2],
    /// Parts of the neighbours' forces that are the joint's.
    shares: [f64; 2],
}

impl Edit {
    /// Splits and merges the first segments of cables at their winches where that is due.
    pub(crate) fn wind(&mut self) -> Result<(), StepError> {
        let leads: Vec<_> = self
            .scene
            .fairleads()
            .map(|i| self.ids.of_constraint(i))
            .collect();
        for lead in leads {
            // What is due beyond that waits for the next step.
            for _ in 0..MOST {
                let i = self.ids.constraint(lead)?;
                if let Some(split) = self.scene.split_at_winch(i, self.time) {
                    self.pay_out(i, &split);
                } else if let Some(merged) = self.scene.merge_at_winch(i, self.time) {
                    if let Some(next) = merged.next {
                        let of = |joint| self.ids.of_constraint(joint);
                        self.hauled_in.push([of(merged.joint), lead, of(next)]);
                    }
                    self.remove(&[merged.body], &[merged.joint])?;
                } else {
                    break;
                }
                self.touched = true;
            }
        }
        Ok(())
    }

    fn pay_out(&mut self, lead: usize, split: &Split) {
        self.ids.insert(split.body, split.joint);
        let of = |joint| self.ids.of_constraint(joint);
        self.paid_out.push(PaidOut {
            bodies: [split.body, split.body - 1].map(|body| self.ids.of_body(body)),
            joint: of(split.joint),
            neighbours: [Some(of(lead)), split.next.map(of)],
            shares: [1.0 - split.share, split.share],
        });
    }
}

impl Stepper {
    /// First segments split and merge. Allocates where there are any.
    pub(crate) fn wind(&mut self) -> Result<(), StepError> {
        let due = |i: &usize| self.scene.winding_due(*i).is_some();
        if self.fairleads.iter().any(due) {
            self.change(Edit::wind)?;
        }
        Ok(())
    }

    /// The forces and the past of joints beside segments that have been paid out and hauled in, in this stepper, which takes
    /// the place of `before`.
    pub(super) fn wound(
        &mut self,
        before: &Self,
        paid_out: &[PaidOut],
        hauled_in: &[[ConstraintId; 3]],
    ) -> Result<(), StepError> {
        for segment in paid_out {
            self.hang_on(segment)?;
        }
        for [joint, neighbours @ ..] in hauled_in {
            // One that has been paid out in the same change has no past.
            if let Ok(joint) = before.ids.constraint(*joint) {
                let rates = &before.history.rate[before.pieces.rows.row_range(joint)];
                self.remember(rates, *neighbours)?;
            }
        }
        Ok(())
    }

    /// The joint of a segment that has been paid out bears what its neighbours do.
    fn hang_on(&mut self, segment: &PaidOut) -> Result<(), StepError> {
        let Self { scene, pieces, .. } = self;
        let rows = &pieces.rows;
        let to = rows.row_range(self.ids.constraint(segment.joint)?);
        let of = |neighbour: Option<ConstraintId>| neighbour.map(|c| self.ids.constraint(c));
        for multipliers in [&mut self.mu, &mut self.tension] {
            let mut sum = [0.0; MAX_ROWS];
            for (neighbour, share) in segment.neighbours.into_iter().zip(segment.shares) {
                let Some(c) = of(neighbour).transpose()? else {
                    continue;
                };
                let lambda = &multipliers[rows.row_range(c)];
                let wrench = scene.constraints[c].wrench(&scene.bodies, self.time, lambda, 0);
                let force = wrench.unwrap_or_default().force;
                let angular = lambda.get(3..).unwrap_or_default();
                let all = force.iter().chain(angular);
                sum.iter_mut()
                    .zip(all)
                    .for_each(|(sum, x)| *sum += share * x);
            }
            let to = &mut multipliers[to.clone()];
            to.iter_mut().zip(sum).for_each(|(to, sum)| *to = sum);
        }
        Ok(())
    }

    /// The joints beside one that is gone have the past of its gap, half of its `rates` each: the cable between them has
    /// grown as fast as before.
    fn remember(&mut self, rates: &[f64], neighbours: [ConstraintId; 2]) -> Result<(), StepError> {
        let (gap, angular) = rates.split_at(3);
        let gap = Vector3::from_column_slice(gap);
        for joint in neighbours {
            let c = self.ids.constraint(joint)?;
            let constraint = &self.scene.constraints[c];
            let mut own = gap;
            if let Constraint::Fairlead(lead) = constraint {
                let axes = lead.frames[1].resolve(&self.scene.bodies, self.time).axes;
                own = axes.transpose() * gap;
                own.x = -own.x;
            }
            let rows = self.pieces.rows.row_range(c);
            let all = own.iter().chain(angular);
            for (rate, more) in self.history.rate[rows].iter_mut().zip(all) {
                *rate += 0.5 * more;
            }
        }
        Ok(())
    }
}
