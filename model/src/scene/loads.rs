//! Loads of a scene's constraints; those of a cable of segments are taken along the cable.

use super::Scene;
use crate::constraint::Loads;

impl Scene {
    /// Loads of constraint number `constraint` with the multipliers `lambda` (one a row, N and N m)
    /// and the bodies where they are at time `t` (s). `None` where there is no such constraint. Does not allocate.
    ///
    /// A tension is positive where it pulls, and negative where it pushes. A joint of a cable of segments
    /// ([`CableParts::joints`](super::CableParts::joints)) has the part of its force along the cable: along the segment that it
    /// holds at an end, along the mean of the two within. Kinds of joints, the order of their sides and the direction in which
    /// the cable was laid do not matter. Of others λ is the force on side a, pulled towards b:
    ///
    /// | kind | tension |
    /// |---|---|
    /// | link, massless cable, all whose first row is a length | −λ of that row; that of all spans of a cable |
    /// | fairlead | −λ of its row along the cable |
    /// | cable joint with bend rows | λ of the stretch rows along the mean of the axes u of both sides |
    /// | ball joint, cable joint without bend rows | their size ‖λ‖: a free axis is no direction |
    /// | others: lock, hinge, slider, bending of links, cable joint without stretch rows | none |
    ///
    /// # Panics
    /// When `lambda` is shorter than the rows or a frame names a body that is not there.
    #[must_use]
    pub fn loads(&self, constraint: usize, t: f64, lambda: &[f64]) -> Option<Loads> {
        let segments = self.segments_at(constraint);
        let constraint = self.constraints.get(constraint)?;
        Some(constraint.loads(segments, &self.bodies, t, lambda))
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
