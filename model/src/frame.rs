//! Attachment frames: where and along which directions a joint holds a body or the world.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::body::Bodies;
use crate::motion::Motion;

/// Support of a [`Frame`]: the world or a body; there is no third kind.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Side {
    /// The world, with a prescribed motion of the point.
    World(Motion),
    /// The body with this index in [`Bodies`].
    Body(usize),
}

/// An attachment point with three directions, fixed to a body or to the world.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frame {
    /// Support of the frame.
    pub side: Side,
    /// Attachment point \[m]: in the body frame, or in the world for a world side (before its motion).
    pub point: Vector3<f64>,
    /// Columns u (along the cable), v and w = u × v, in the body frame (world frame for a world side). Orthonormal.
    pub axes: Matrix3<f64>,
}

/// Axes of a cable that hangs along −z: u = −z, v = x, w = −y. Exact unit vectors, so that a vertical cable keeps
/// exact zeros in x and y.
#[must_use]
pub fn hanging_axes() -> Matrix3<f64> {
    Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0)
}

/// Right-handed orthonormal axes (columns u, v, w) with u along `direction`, `None` when it has no direction.
#[must_use]
pub fn axes_along(direction: &Vector3<f64>) -> Option<Matrix3<f64>> {
    // Scaled first, so that the square of a tiny or huge direction is a number.
    let u = (direction / direction.amax()).normalize();
    if !u.iter().all(|c| c.is_finite()) {
        return None;
    }
    if u == -Vector3::z() {
        return Some(hanging_axes());
    }
    // The coordinate axis least along u gives a well-conditioned v.
    let mut v = Vector3::zeros();
    v[u.iamin()] = 1.0;
    let v = (v - u * u.dot(&v)).normalize();
    Some(Matrix3::from_columns(&[u, v, u.cross(&v)]))
}

impl Frame {
    /// A frame at `point` (body frame, m) of body `body`, with [`hanging_axes`].
    #[must_use]
    pub fn body(body: usize, point: Vector3<f64>) -> Self {
        Self {
            side: Side::Body(body),
            point,
            axes: hanging_axes(),
        }
    }

    /// A resting frame at `point` (m) of the world, with [`hanging_axes`].
    #[must_use]
    pub fn world(point: Vector3<f64>) -> Self {
        Self {
            side: Side::World(Motion::Fixed),
            point,
            axes: hanging_axes(),
        }
    }

    /// Replaces the axes (columns u, v, w).
    #[must_use]
    pub fn with_axes(mut self, axes: Matrix3<f64>) -> Self {
        self.axes = axes;
        self
    }

    /// Turns u along `direction`, in the body's frame (the world's for a world side). v and w
    /// depend on `direction` alone, so that frames along one direction agree. Without a direction
    /// the frame stays as it is.
    #[must_use]
    pub fn along(self, direction: &Vector3<f64>) -> Self {
        match axes_along(direction) {
            Some(axes) => self.with_axes(axes),
            None => self,
        }
    }

    /// Fixes the point to the world, with a prescribed motion.
    #[must_use]
    pub fn moving(mut self, motion: Motion) -> Self {
        self.side = Side::World(motion);
        self
    }

    /// Index of the body that the frame is fixed to, `None` for the world.
    #[must_use]
    pub fn body_index(&self) -> Option<usize> {
        match self.side {
            Side::World(_) => None,
            Side::Body(i) => Some(i),
        }
    }

    /// Displacement of a world side at time `t` (s), world \[m]; zero for a body.
    #[must_use]
    pub fn displacement(&self, t: f64) -> Vector3<f64> {
        match &self.side {
            Side::World(motion) => motion.displacement(t),
            Side::Body(_) => Vector3::zeros(),
        }
    }

    /// Position, lever arm and axes in the world at time `t` (s).
    ///
    /// # Panics
    /// When the frame names a body that is not there.
    #[must_use]
    pub fn resolve(&self, bodies: &Bodies, t: f64) -> Resolved {
        match &self.side {
            Side::World(motion) => Resolved {
                centre: Vector3::zeros(),
                lever: self.point + motion.displacement(t),
                axes: self.axes,
            },
            Side::Body(i) => {
                let rotation = bodies.rotation(*i);
                Resolved {
                    centre: bodies.position[*i],
                    lever: rotation * self.point,
                    axes: rotation * self.axes,
                }
            }
        }
    }

    /// [`resolve`](Self::resolve) at time `t` + `dt` (s) if its body goes on freely from its velocities at `t`.
    pub(crate) fn resolve_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> Resolved {
        let here = self.resolve(bodies, t + dt);
        let Side::Body(i) = self.side else {
            return here;
        };
        let turn = Rotation3::from_scaled_axis(bodies.mean_spin(i, dt) * dt);
        Resolved {
            centre: here.centre + bodies.velocity[i] * dt,
            lever: turn * here.lever,
            axes: turn * here.axes,
        }
    }
}

/// A [`Frame`] at one instant, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolved {
    /// Centre of mass of the body \[m]; the origin for a world side.
    pub centre: Vector3<f64>,
    /// Lever arm r from `centre` to the attachment point \[m].
    pub lever: Vector3<f64>,
    /// Columns u, v, w.
    pub axes: Matrix3<f64>,
}

impl Resolved {
    /// The attachment point \[m].
    #[must_use]
    pub fn point(&self) -> Vector3<f64> {
        self.centre + self.lever
    }

    pub(crate) fn u(&self) -> Vector3<f64> {
        self.axes.column(0).into_owned()
    }

    pub(crate) fn v(&self) -> Vector3<f64> {
        self.axes.column(1).into_owned()
    }

    pub(crate) fn w(&self) -> Vector3<f64> {
        self.axes.column(2).into_owned()
    }
}

/// The smallest rotation that takes the unit vector `a` to the unit vector `b`: exactly none where they are equal, and
/// without a direction where they are opposite.
pub(crate) fn smallest_rotation(a: &Vector3<f64>, b: &Vector3<f64>) -> UnitQuaternion<f64> {
    let axis = a.cross(b);
    UnitQuaternion::from_quaternion(Quaternion::from_parts(1.0 + a.dot(b), axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    #[test]
    fn axes_are_right_handed_and_orthonormal() {
        for d in [
            -Vector3::z(),
            Vector3::x(),
            Vector3::new(1.0, -2.0, 0.5),
            Vector3::new(1e-200, 0.0, 0.0),
        ] {
            let axes = axes_along(&d).expect("a direction");
            assert!((axes.transpose() * axes - Matrix3::identity()).norm() < 1e-15);
            assert!((axes.determinant() - 1.0).abs() < 1e-15);
        }
        assert!(axes_along(&Vector3::zeros()).is_none());
        assert!(axes_along(&Vector3::new(f64::NAN, 0.0, 1.0)).is_none());
        assert!((hanging_axes().determinant() - 1.0).abs() < 1e-16);
    }

    #[test]
    fn resolve_turns_with_the_body_and_moves_with_the_world() {
        let mut bodies = Bodies::new();
        let quarter = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
        bodies.push(
            Body::sphere(1.0, 1.0)
                .at(Vector3::new(5.0, 0.0, 0.0))
                .turned(quarter),
        );
        let at = Frame::body(0, Vector3::x()).resolve(&bodies, 0.0);
        assert!((at.point() - Vector3::new(5.0, 1.0, 0.0)).norm() < 1e-15);
        assert!((at.v() - Vector3::y()).norm() < 1e-15);
        let crane = origin().moving(Motion::Smooth {
            displacement: Vector3::x(),
            start: 0.0,
            duration: 1.0,
        });
        assert_eq!(crane.resolve(&bodies, 2.0).point(), Vector3::x());
        assert_eq!(crane.body_index(), None);
    }
}
