//! The gap between the attachment points of a joint, and the Jacobian that all joints with one share.
//!
//! φ = x_a + r_a − x_b − r_b (3 rows, m) \[SL (25)]. With ṙ = ω × r = −\[r]× ω,
//!
//! ```text
//! J_a = [ I  −[r_a]× ]      J_b = [ −I  [r_b]× ]      [SL (26)]
//!       [ 0  −gᵀ     ]            [  0   gᵀ    ]
//! ```
//!
//! where the rows below are those of up to three angles of the relative rotation, g their gradients on ω_b. No
//! singularities. Under tension T (φ along the cable) the gap is ε T.
//!
//! All of it is for one joint, or for one in each lane.

use nalgebra::Vector3;
use taut_lanes::Lanes;
use taut_lanes::vector::{Vec3, add, combine, cross, dot, sub};

/// φ of the gap \[SL (25)] \[m] from the centres of the sides a and b and their lever arms. Centres first: neighbours are
/// near each other, so the difference is the better conditioned.
#[inline(always)]
pub(crate) fn gap<V: Lanes>(centres: [&Vec3<V>; 2], arms: [&Vec3<V>; 2]) -> Vec3<V> {
    add(&sub(centres[0], centres[1]), &sub(arms[0], arms[1]))
}

/// J of one joint, or of one in each lane: 15 numbers stand for 72. Rows that a joint does not have have g = 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointJacobian<V> {
    /// Lever arms of the sides a and b, world \[m].
    pub(crate) arms: [Vec3<V>; 2],
    /// Gradients of up to three angular rows on ω_b, world; those on ω_a are the negatives.
    pub(crate) gradients: [Vec3<V>; 3],
}

impl<V: Lanes> JointJacobian<V> {
    /// J v for the velocities \[v, ω] of the sides a and b.
    #[inline(always)]
    pub(crate) fn rates(&self, a: &[V; 6], b: &[V; 6]) -> [V; 6] {
        let (point_a, omega_a) = point(a, &self.arms[0]);
        let (point_b, omega_b) = point(b, &self.arms[1]);
        let [x, y, z] = sub(&point_a, &point_b);
        let turning = sub(&omega_b, &omega_a);
        let [p, q, s] = &self.gradients;
        let (p, q, s) = (dot(p, &turning), dot(q, &turning), dot(s, &turning));
        [x, y, z, p, q, s]
    }

    /// Jᵀ μ of the sides a and b, linear and angular, for the impulses or forces μ of the rows.
    #[inline(always)]
    pub(crate) fn transposed(&self, mu: &[V; 6]) -> [[V; 6]; 2] {
        let [x, y, z, p, q, s] = *mu;
        let force = [x, y, z];
        let torque = combine(&self.gradients, &[p, q, s]);
        let [ax, ay, az] = sub(&cross(&self.arms[0], &force), &torque);
        let [bx, by, bz] = sub(&torque, &cross(&self.arms[1], &force));
        [[x, y, z, ax, ay, az], [-x, -y, -z, bx, by, bz]]
    }
}

impl JointJacobian<f64> {
    /// J_a (`side` 0) or J_b, row by row.
    pub(crate) fn block(&self, side: usize) -> [[f64; 6]; 6] {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = self.arms[side];
        let angular = |[x, y, z]: Vec3<f64>| [0.0, 0.0, 0.0, -sign * x, -sign * y, -sign * z];
        let [p, q, s] = self.gradients;
        [
            [sign, 0.0, 0.0, 0.0, sign * z, -sign * y],
            [0.0, sign, 0.0, -sign * z, 0.0, sign * x],
            [0.0, 0.0, sign, sign * y, -sign * x, 0.0],
            angular(p),
            angular(q),
            angular(s),
        ]
    }
}

/// Row gᵀ J_a of a point along the direction g, \[g, r × g], with its lever r: of contacts, distances and ropes.
#[must_use]
#[inline(always)]
pub fn row_along(g: &Vector3<f64>, lever: &Vector3<f64>) -> [f64; 6] {
    joined(g, &lever.cross(g))
}

/// The numbers of both, one after the other.
#[inline(always)]
pub(super) fn joined(linear: &Vector3<f64>, angular: &Vector3<f64>) -> [f64; 6] {
    let ([x, y, z], [p, q, s]) = ((*linear).into(), (*angular).into());
    [x, y, z, p, q, s]
}

/// Velocity of the attachment point of one side, and the body's angular velocity.
#[inline(always)]
fn point<V: Lanes>(velocity: &[V; 6], arm: &Vec3<V>) -> (Vec3<V>, Vec3<V>) {
    let [vx, vy, vz, x, y, z] = *velocity;
    let omega = [x, y, z];
    (add(&[vx, vy, vz], &cross(&omega, arm)), omega)
}
