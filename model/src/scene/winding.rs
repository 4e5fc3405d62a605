//! Cables of segments at their winches: the first segment is cut to its length, splits and merges.
//!
//! **Cut.** What a winch pays out or hauls in between t and t′ moves the point of the first segment that lies at the
//! winch ([`Fairlead`]); then the segment is cut there: its mass ρ ℓ₁, its inertia and its centre follow the length ℓ₁, and
//! it goes on moving as the rigid body that it was, v ← v + ω × s for a centre that is moved by s. What leaves takes its
//! momentum along into the drum, which turns as fast. The joints at the segment's ends have the compliances of ℓ₁/2 and
//! (ℓ₁ + ℓ₂)/2 of cable.
//!
//! **Split** at ℓ₁ > (1 + [`LEAST`]) ℓ into ℓ₁ − ℓ and a whole segment ℓ, and **merge** with the next one at
//! ℓ₁ < `LEAST` ℓ: [`segments`](super::segments). A next one that is longer than (1 + `LEAST`) ℓ, as rules make them, is split
//! first, ℓ from its start.

use super::Scene;
use super::segments::{Merged, Split};
use crate::constraint::{Constraint, Fairlead, LEAST};

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
        let cable = self.cable_at(i);
        let Constraint::Fairlead(lead) = &mut self.constraints[i] else {
            return false;
        };
        let length = lead.length_at(t) + paid;
        let by = length - lead.length;
        lead.winch.since = lead.winch.since.max(t);
        let (Some(body), Some(cable), true) = (lead.frames[1].body_index(), cable, by != 0.0)
        else {
            return false;
        };
        lead.first += by;
        lead.length = length;
        let first = lead.first;
        let shift = lead.along() * (-0.5 * by);
        // All points stay where they are in the material but that at the winch.
        lead.frames[1].point += 2.0 * shift;
        self.move_centre(body, &shift);
        if let Some(at) = self.neighbours(cable, 0) {
            let [before, after] = at.beyond;
            self.reshape(cable, body, first, at.chord);
            self.stand_for(cable, at.joints, [before + first, first + after]);
        }
        true
    }

    /// `Some(true)` if the first segment of the cable that leaves its winch at constraint `i` has
    /// to split, `Some(false)` if it has to merge with the next, else `None`.
    #[must_use]
    pub fn winding_due(&self, i: usize) -> Option<bool> {
        let lead = self.lead(i)?;
        if lead.first > (1.0 + LEAST) * lead.segment {
            return Some(true);
        }
        let next = |cable| {
            self.neighbours(cable, 0)
                .is_some_and(|at| at.beyond[1] > 0.0)
        };
        let merges = lead.first < LEAST * lead.segment && self.cable_at(i).is_some_and(next);
        merges.then_some(false)
    }

    fn lead(&self, i: usize) -> Option<&Fairlead> {
        match self.constraints.get(i) {
            Some(Constraint::Fairlead(lead)) => Some(lead),
            _ => None,
        }
    }

    /// Number of the cable whose first joint is constraint `i`.
    #[must_use]
    pub fn cable_at(&self, i: usize) -> Option<usize> {
        let begins = |cable: &super::CableParts| cable.joints.first() == Some(&i);
        self.cables.iter().position(begins)
    }

    /// Splits the first segment of the cable that leaves its winch at constraint `i`, where it is due, at time `t` (s), or the
    /// next one where that is too long to merge with. The new segment, and its joint, come after it in the order of the scene.
    pub fn split_at_winch(&mut self, i: usize, t: f64) -> Option<Split> {
        let (due, cable) = (self.winding_due(i)?, self.cable_at(i)?);
        let (lead, next) = (self.lead(i)?, self.neighbours(cable, 0)?.beyond[1]);
        if !due {
            let (whole, long) = (lead.segment, next > (1.0 + LEAST) * lead.segment);
            return long.then(|| self.split_segment((cable, 1), whole, t))?;
        }
        let rest = lead.first - lead.segment;
        let split = self.split_segment((cable, 0), rest, t)?;
        self.set_first(i, rest);
        Some(split)
    }

    /// Merges the first two segments of the cable that leaves its winch at constraint `i`, where that is due, at time `t` (s):
    /// the first one is then both, and the second one and their joint are to be removed.
    pub fn merge_at_winch(&mut self, i: usize, t: f64) -> Option<Merged> {
        let (due, cable) = (self.winding_due(i) == Some(false), self.cable_at(i)?);
        let lead = self.lead(i).filter(|_| due)?;
        let first = lead.first + self.neighbours(cable, 0)?.beyond[1];
        let merged = self.merge_segments((cable, 0), t)?;
        self.set_first(i, first);
        Some(merged)
    }

    fn set_first(&mut self, i: usize, length: f64) {
        if let Constraint::Fairlead(lead) = &mut self.constraints[i] {
            lead.first = length;
        }
    }
}

#[cfg(test)]
mod tests;
