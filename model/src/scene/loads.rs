//! Loads of a scene's constraints; those of a cable of segments are taken along the cable.

use super::Scene;
use crate::constraint::Loads;

impl Scene {
    /// Loads of constraint number `constraint` with the multipliers `lambda` (one a row, N and N m)
    /// and the bodies where they are at time `t` (s); their tension is [`tension`](Self::tension).
    /// `None` where there is no such constraint. Does not allocate.
    ///
    /// # Panics
    /// When `lambda` is shorter than the rows or a frame names a body that is not there.
    #[must_use]
    pub fn loads(&self, constraint: usize, t: f64, lambda: &[f64]) -> Option<Loads> {
        let segments = self.segments_at(constraint);
        let constraint = self.constraints.get(constraint)?;
        Some(constraint.loads_in(segments, &self.bodies, t, lambda))
    }

    /// Tension of constraint number `constraint` \[N] with the multipliers `lambda` (one a row, N
    /// and N m) and the bodies where they are at time `t` (s): positive where it pulls, negative
    /// where it pushes. `None` where there is no such constraint, or one without tension. Does not
    /// allocate.
    ///
    /// A joint of a cable of segments ([`CableParts::joints`](super::CableParts::joints)) has the
    /// part of its force along the cable as its tension: along the segment that it holds at an end,
    /// along the mean of the two within. Kinds of joints, the order of their sides and the
    /// direction in which the cable was laid do not matter. Other constraints have that of
    /// [`Constraint::tension`](crate::Constraint::tension): a ball joint, which has no axis, the
    /// size of its force.
    ///
    /// # Panics
    /// As [`loads`](Self::loads).
    #[must_use]
    pub fn tension(&self, constraint: usize, t: f64, lambda: &[f64]) -> Option<f64> {
        let segments = self.segments_at(constraint);
        let constraint = self.constraints.get(constraint)?;
        constraint.tension_in(segments, &self.bodies, t, lambda)
    }

    /// Segments of the cable that a constraint is a joint of; none where it is no joint of a cable.
    fn segments_at(&self, constraint: usize) -> &[usize] {
        // Numbers ascend but for cables that were listed otherwise.
        let sorted = |joints: &[usize]| joints.binary_search(&constraint).is_ok();
        let mut cables = self.cables.iter();
        let cable =
            cables.find(|cable| sorted(&cable.joints) || cable.joints.contains(&constraint));
        cable.map_or(&[], |cable| &cable.bodies)
    }
}

#[cfg(test)]
mod tests;
