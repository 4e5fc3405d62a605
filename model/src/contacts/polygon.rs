//! Polygons in space and what is left of them within the outline of a face.

use std::ops::Deref;

use nalgebra::Vector3;

/// Corners that there is room for: a face of 16 cuts at most that many more off one of 9.
const ROOM: usize = 32;

/// Difference of heights, over the extent, up to which corners are as low.
const LEVEL: f64 = 1e-3;

/// Relative difference of squared distances up to which corners are as far.
const ALIKE: f64 = 1e-3;

/// The corners of a flat convex polygon in their order, or the ends of a segment, or a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon {
    corners: [Vector3<f64>; ROOM],
    count: usize,
}

impl Default for Polygon {
    fn default() -> Self {
        Self {
            corners: [Vector3::zeros(); ROOM],
            count: 0,
        }
    }
}

impl Deref for Polygon {
    type Target = [Vector3<f64>];

    fn deref(&self) -> &Self::Target {
        &self.corners[..self.count]
    }
}

impl Polygon {
    /// Appends a corner; beyond the room that there is, none.
    pub(super) fn push(&mut self, corner: Vector3<f64>) {
        if self.count < ROOM {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    /// The part above the outline of `face`, whose corners go counter-clockwise about `normal`; what is outside by less than
    /// `tolerance` (m) stays.
    pub(super) fn within(&self, face: &Self, normal: &Vector3<f64>, tolerance: f64) -> Self {
        let mut left = *self;
        for (i, corner) in face.iter().enumerate() {
            let next = face[(i + 1) % face.len()];
            let Some(outward) = (next - corner).cross(normal).try_normalize(0.0) else {
                continue;
            };
            left = left.below(&outward, outward.dot(corner) + tolerance);
        }
        left
    }

    /// The part with u·p ≤ `limit`.
    fn below(&self, u: &Vector3<f64>, limit: f64) -> Self {
        let mut left = Self::default();
        for (i, p) in self.iter().enumerate() {
            let q = &self[(i + 1) % self.count];
            let (a, b) = (u.dot(p) - limit, u.dot(q) - limit);
            if a <= 0.0 {
                left.push(*p);
            }
            // A segment has one side, not two.
            let crosses = (a <= 0.0) != (b <= 0.0) && !(self.count == 2 && i == 1);
            if crosses {
                left.push(p + (q - p) * (a / (a - b)));
            }
        }
        left
    }

    /// At most `most` of the corners: the lowest along `up`, and then always the one that is farthest from those that there
    /// are. The first one counts of those that are as low up to [`LEVEL`] or as far up to [`ALIKE`]: what rests on the corners
    /// keeps them while it rocks by less.
    pub(super) fn spread(&self, up: &Vector3<f64>, most: usize) -> Self {
        if self.count <= most {
            return *self;
        }
        let extent = self
            .iter()
            .map(|p| (p - self[0]).norm())
            .fold(0.0, f64::max);
        let lowest = self.iter().map(|p| p.dot(up)).fold(f64::INFINITY, f64::min);
        let low = |p: &&Vector3<f64>| p.dot(up) <= lowest + LEVEL * extent;
        let mut kept = Self::default();
        kept.push(self.iter().find(low).copied().unwrap_or_default());
        while kept.count < most {
            let apart = |p: &Vector3<f64>| {
                let distances = kept.iter().map(|k| (p - k).norm_squared());
                distances.fold(f64::INFINITY, f64::min)
            };
            let farthest = self.iter().map(apart).fold(0.0, f64::max);
            let far = |p: &&Vector3<f64>| apart(p) >= (1.0 - ALIKE) * farthest;
            let next = self.iter().find(far).copied().unwrap_or_default();
            kept.push(next);
        }
        kept
    }
}
