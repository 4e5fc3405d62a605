//! Placed shapes: support points, nearest points, and the features that contacts are made of.
//!
//! A sphere or capsule is the set of points within r of a point or segment, its core; a box or cylinder is its own core with
//! r = 0. The support point of a core in a direction u is the point of it with the largest u·p. What is known of a shape in
//! the direction of a contact is a feature: the corners of a face, or a segment, or a point.

use nalgebra::{Matrix3, Vector3};

use super::manifold::nearest_of;
use super::polygon::Polygon;
use crate::body::Bodies;
use crate::collide::{Collider, Shape};

/// Corners of the polygon that stands for the rim of a cylinder where it lies on something flat.
const LYING: usize = 8;
/// Depth of the lowest point of a rim below those corners, over its radius, from which it is a
/// point of contact: tilts of 1.3e-4 rad and more.
const LOWER: f64 = 1e-5;
/// Corners of the polygon that stands for the end face of a cylinder on which something lies.
const CARRYING: usize = 16;
/// Cosine between an edge and a direction, below which they count as perpendicular.
const ACROSS: f64 = 1e-6;
/// Cosine between a face's normal and a direction, above which it counts as that normal: 1.4e-6 rad.
const ALONG: f64 = 1.0 - 1e-12;

/// Kind of a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Core {
    /// A point or a segment along z, of a sphere or a capsule.
    Segment,
    Box,
    Cylinder,
    /// Everything below z = 0.
    HalfSpace,
}

/// A shape in its place. Lengths in m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solid {
    pub(super) core: Core,
    /// Origin of its frame, from the point of reference of the pair.
    pub(super) centre: Vector3<f64>,
    /// Columns: directions of its frame.
    pub(super) axes: Matrix3<f64>,
    /// Half of the core's extents along them.
    pub(super) half: Vector3<f64>,
    /// Thickness of the shape around its core \[m].
    pub(super) radius: f64,
}

impl Solid {
    /// The collider in the world.
    pub(super) fn of(collider: &Collider, bodies: &Bodies) -> Self {
        let own = collider.orientation.to_rotation_matrix().into_inner();
        let (centre, axes) = match collider.body {
            None => (collider.position, own),
            Some(body) => {
                let turn = bodies.rotation(body);
                (bodies.position[body] + turn * collider.position, turn * own)
            }
        };
        let along = |length: f64| Vector3::new(0.0, 0.0, 0.5 * length);
        let (core, half, radius) = match collider.shape {
            Shape::Sphere { radius } => (Core::Segment, Vector3::zeros(), radius),
            Shape::Capsule { length, radius } => (Core::Segment, along(length), radius),
            Shape::Cuboid { size } => (Core::Box, size * 0.5, 0.0),
            Shape::Cylinder { length, radius } => {
                let half = Vector3::new(radius, radius, 0.5 * length);
                (Core::Cylinder, half, 0.0)
            }
            Shape::HalfSpace => (Core::HalfSpace, Vector3::zeros(), 0.0),
        };
        Self {
            core,
            centre,
            axes,
            half,
            radius,
        }
    }

    pub(super) fn axis(&self, k: usize) -> Vector3<f64> {
        self.axes.column(k).into_owned()
    }

    /// True but for a cylinder with a radius no less than the other's.
    pub(super) fn is_narrower(&self, other: &Self) -> bool {
        self.core != Core::Cylinder || self.half.x < other.half.x
    }

    /// A size of the core, for tolerances \[m].
    pub(super) fn size(&self) -> f64 {
        self.half.norm() + self.radius
    }

    /// Half of the extents of the shape along the world's axes \[m].
    pub(super) fn extents(&self) -> Vector3<f64> {
        let [x, y, z] = [0, 1, 2].map(|k| self.axis(k).abs());
        let core = match self.core {
            Core::Segment => z * self.half.z,
            Core::Box => x * self.half.x + y * self.half.y + z * self.half.z,
            Core::Cylinder => {
                let across = z.map(|c| (1.0 - c * c).max(0.0).sqrt());
                z * self.half.z + across * self.half.x
            }
            Core::HalfSpace => Vector3::repeat(f64::INFINITY),
        };
        core.add_scalar(self.radius)
    }

    /// The core's point that is farthest along `u`: any corner of an edge or face that is across it.
    pub(super) fn support(&self, u: &Vector3<f64>) -> Vector3<f64> {
        let local = self.axes.tr_mul(u);
        let mut point = self.half.zip_map(&local, f64::copysign);
        if self.core == Core::Cylinder {
            let across = local.xy().norm();
            let scale = if across > 1e-15 {
                self.half.x / across
            } else {
                0.0
            };
            (point.x, point.y) = (local.x * scale, local.y * scale);
        }
        self.centre + self.axes * point
    }

    /// The point of a box or cylinder that is nearest to `p`: `p` itself inside.
    pub(super) fn nearest(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let local = self.axes.tr_mul(&(p - self.centre));
        let mut point = local.zip_map(&self.half, |x, half| x.clamp(-half, half));
        if self.core == Core::Cylinder {
            let across = local.xy().norm();
            let scale = if across > self.half.x {
                self.half.x / across
            } else {
                1.0
            };
            (point.x, point.y) = (local.x * scale, local.y * scale);
        }
        // Not by way of the frame where nothing is cut off: what is inside stays bit for bit.
        if point == local {
            return *p;
        }
        p - self.axes * (local - point)
    }

    /// Directions of straight edges, and of the lines on round sides.
    pub(super) fn edges(&self) -> impl Iterator<Item = Vector3<f64>> {
        let first = match self.core {
            Core::Box => 0,
            Core::Segment if self.half.z == 0.0 => 3,
            Core::Segment | Core::Cylinder => 2,
            Core::HalfSpace => 3,
        };
        let axes = self.axes;
        (first..3).map(move |k| axes.column(k).into_owned())
    }

    /// Normals of flat faces, one of each opposite pair.
    pub(super) fn faces(&self) -> impl Iterator<Item = Vector3<f64>> {
        let first = match self.core {
            Core::Box => 0,
            Core::Cylinder => 2,
            Core::Segment | Core::HalfSpace => 3,
        };
        let axes = self.axes;
        (first..3).map(move |k| axes.column(k).into_owned())
    }

    /// The face that faces along `u`: its outward normal and its corners, counter-clockwise about it.
    pub(super) fn face_along(&self, u: &Vector3<f64>) -> Option<(Vector3<f64>, Polygon)> {
        let normals = [0, 1, 2].map(|k| self.axis(k) * self.axis(k).dot(u).signum());
        let is_face = |k: &usize| match self.core {
            Core::Box => true,
            Core::Cylinder => *k == 2,
            Core::Segment | Core::HalfSpace => false,
        };
        let k = (0..3)
            .filter(is_face)
            .find(|k| normals[*k].dot(u) > ALONG)?;
        Some((normals[k], self.face(k, &normals[k], CARRYING)))
    }

    /// The corners of the face with the outward normal `normal`, which is axis `k` or its opposite, counter-clockwise about it.
    fn face(&self, k: usize, normal: &Vector3<f64>, round: usize) -> Polygon {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        // The other way round on the lower side.
        let side = if self.axis(k).dot(normal) > 0.0 {
            1.0
        } else {
            -1.0
        };
        let middle = self.centre + normal * self.half[k];
        let (u, v) = (self.axis(i), self.axis(j) * side);
        let mut corners = Polygon::default();
        if self.core == Core::Cylinder {
            for n in 0..round {
                let (sine, cosine) = (std::f64::consts::TAU * n as f64 / round as f64).sin_cos();
                corners.push(middle + (u * cosine + v * sine) * self.half.x);
            }
        } else {
            for (a, b) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
                corners.push(middle + u * (a * self.half[i]) + v * (b * self.half[j]));
            }
        }
        corners
    }

    /// Part of the core that can lie on a plane facing it from the direction `u`: the face that is
    /// most along `u`, the line of a round side, or the point.
    pub(super) fn lying_along(&self, u: &Vector3<f64>) -> Polygon {
        let local = self.axes.tr_mul(u);
        let lies = self.core == Core::Cylinder && local.z.abs() < std::f64::consts::FRAC_1_SQRT_2;
        if self.core == Core::Segment || lies {
            return self.line_along(u);
        }
        let k = if self.core == Core::Cylinder {
            2
        } else {
            local.iamax()
        };
        let normal = self.axis(k) * local[k].signum();
        let mut face = self.face(k, &normal, LYING);
        if self.core == Core::Cylinder {
            // The lowest point of a tilted rim, which lies between the corners. It goes round as a disc rocks: one that stands
            // would be carried now here, now there, and never rest.
            let lowest = self.support(u);
            let reached = face
                .iter()
                .map(|p| p.dot(u))
                .fold(f64::NEG_INFINITY, f64::max);
            if lowest.dot(u) > reached + LOWER * self.half.x {
                face.push(lowest);
            }
        }
        face
    }

    /// The point of what lies on a plane with the normal `normal`, here the polygon `lying`, that is nearest to the line
    /// through `middle` along that; of a round face on its rim.
    pub(super) fn nearest_lying(
        &self,
        lying: &Polygon,
        middle: &Vector3<f64>,
        normal: &Vector3<f64>,
    ) -> Vector3<f64> {
        let level = |p: &Vector3<f64>| middle + normal * normal.dot(&(p - middle));
        if self.core == Core::Cylinder && lying.len() > 2 {
            let end = -self.axis(2).dot(normal).signum();
            let rim = self.rim(end);
            return rim.nearest(&level(&rim.middle));
        }
        let sides = (0..lying.len()).map(|i| [lying[i], lying[(i + 1) % lying.len()]]);
        let near = sides.map(|side| {
            let p = nearest_of(side, &level(&side[0]));
            (p, (p - level(&p)).norm_squared())
        });
        let nearest = near.min_by(|x, y| x.1.total_cmp(&y.1));
        nearest.map_or(self.centre, |(p, _)| p)
    }

    /// The line along z that is farthest along `u`: of a segment, or on the side of a cylinder. One point of a core without
    /// length.
    fn line_along(&self, u: &Vector3<f64>) -> Polygon {
        let axis = self.axis(2);
        let end = self.support(&(u - axis * axis.dot(u)));
        let middle = end - axis * axis.dot(&(end - self.centre));
        let mut line = Polygon::default();
        line.push(middle + axis * self.half.z);
        if self.half.z > 0.0 {
            line.push(middle - axis * self.half.z);
        }
        line
    }

    /// The ends of the edge that is farthest along `u` and across it; of a segment, its ends; else one point twice.
    pub(super) fn edge_along(&self, u: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let local = self.axes.tr_mul(u);
        let k = match self.core {
            Core::Segment => {
                return [1.0, -1.0].map(|s| self.centre + self.axis(2) * (s * self.half.z));
            }
            Core::Box => local.iamin(),
            Core::Cylinder | Core::HalfSpace => 2,
        };
        if local[k].abs() > ACROSS {
            return [self.support(u); 2];
        }
        if self.core == Core::Cylinder {
            let line = self.line_along(u);
            return [line[0], line[1]];
        }
        let corner = self.support(u);
        let along = self.axis(k);
        let middle = corner - along * along.dot(&(corner - self.centre));
        [middle + along * self.half[k], middle - along * self.half[k]]
    }

    /// The rim of a cylinder at its upper (`end` = 1) or lower end (−1).
    pub(super) fn rim(&self, end: f64) -> Rim {
        let [x, y, z] = [0, 1, 2].map(|k| self.axis(k));
        Rim {
            middle: self.centre + z * (end * self.half.z),
            axes: [x, y],
            radius: self.half.x,
        }
    }
}

/// A circle in space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rim {
    pub(super) middle: Vector3<f64>,
    /// Unit vectors in its plane.
    axes: [Vector3<f64>; 2],
    radius: f64,
}

impl Rim {
    /// Its point at an angle (rad).
    pub(super) fn at(&self, angle: f64) -> Vector3<f64> {
        let [x, y] = self.axes;
        self.middle + (x * angle.cos() + y * angle.sin()) * self.radius
    }

    /// Its points in the plane u·p = `limit`: two, or none.
    pub(super) fn across(
        &self,
        u: &Vector3<f64>,
        limit: f64,
    ) -> impl Iterator<Item = Vector3<f64>> {
        let [x, y] = self.axes.map(|axis| axis.dot(u) * self.radius);
        let part = (limit - u.dot(&self.middle)) / x.hypot(y);
        let (base, side) = (y.atan2(x), part.acos());
        // Not a number where they are apart, and where the plane is that of the rim.
        let angles = [base - side, base + side].into_iter();
        let rim = *self;
        angles.filter(|t| t.is_finite()).map(move |t| rim.at(t))
    }

    /// Its point that is nearest to `p`; any from its middle.
    pub(super) fn nearest(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let [x, y] = self.axes;
        let (u, v) = (x.dot(&(p - self.middle)), y.dot(&(p - self.middle)));
        match u.hypot(v) {
            0.0 => self.middle + x * self.radius,
            across => self.middle + (x * u + y * v) * (self.radius / across),
        }
    }
}
