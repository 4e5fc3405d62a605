//! Free rotation over one step.
//!
//! The angular velocity ω of a step turns the body from t_n to t_{n+1}; its momentum belongs to the middle, where the
//! inertia is turned by half of that. Without torque the momentum before and after t_n is the same,
//!
//! ```text
//! exp(½Δt ŷ⁺) I y⁺ = exp(−½Δt ŷ) I y        y = Rᵀ_n ω: angular velocity in the body frame at t_n
//! ```
//!
//! This is the midpoint rule on the rotation group: it keeps the angular momentum to roundoff and the energy within a
//! band, where the explicit torque −ω×Iω gains energy and is lost near ωΔt = 1.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Below this rotation a step (rad) the explicit torque, whose error is of second order in it, is used.
const SMALL: f64 = 1e-4;

/// Newton passes at most: three to five are needed up to ωΔt = 1.
const PASSES: usize = 30;

/// The impulse Δt·(gyroscopic torque) \[N m s] of a body that turns freely with ω (rad/s, world) through a step; `inertia`
/// in the body frame, `rotation` body to world, `world` the inertia in the world frame.
pub(crate) fn impulse(
    inertia: &Matrix3<f64>,
    rotation: &Matrix3<f64>,
    world: &Matrix3<f64>,
    omega: &Vector3<f64>,
    dt: f64,
) -> Vector3<f64> {
    let momentum = world * omega;
    let explicit = omega.cross(&momentum) * -dt;
    let turn = omega.norm() * dt;
    if turn < SMALL || explicit.norm() <= f64::EPSILON * turn * momentum.norm() {
        return explicit;
    }
    let y = rotation.transpose() * omega;
    let after = turn_freely(inertia, &y, dt);
    after.map_or(explicit, |y_next| rotation * (inertia * (y_next - y)))
}

/// y⁺ from y, `None` where Newton's method does not converge (rotations of a radian a step and more).
fn turn_freely(inertia: &Matrix3<f64>, y: &Vector3<f64>, dt: f64) -> Option<Vector3<f64>> {
    let half = 0.5 * dt;
    let turned = |by: Vector3<f64>, p: &Vector3<f64>| UnitQuaternion::from_scaled_axis(by) * p;
    let before = turned(y * -half, &(inertia * y));
    let mut next = *y;
    let mut last = f64::INFINITY;
    for _ in 0..PASSES {
        let target = turned(next * -half, &before);
        let residual = inertia * next - target;
        let size = residual.norm();
        if size <= 4.0 * f64::EPSILON * before.norm() || size >= last {
            break;
        }
        last = size;
        let derivative = inertia - target.cross_matrix() * half;
        next -= derivative.try_inverse()? * residual;
    }
    (last <= 1e-9 * before.norm()).then_some(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(
        inertia: &Matrix3<f64>,
        rotation: &mut UnitQuaternion<f64>,
        w: &mut Vector3<f64>,
        dt: f64,
    ) {
        let r = rotation.to_rotation_matrix().into_inner();
        let world = r * inertia * r.transpose();
        let p = impulse(inertia, &r, &world, w, dt);
        *w += world.try_inverse().unwrap() * p;
        *rotation = UnitQuaternion::from_scaled_axis(*w * dt) * *rotation;
    }

    /// Momentum in the middle of the step that `w` turns through.
    fn momentum(
        inertia: &Matrix3<f64>,
        rotation: &UnitQuaternion<f64>,
        w: &Vector3<f64>,
        dt: f64,
    ) -> Vector3<f64> {
        let middle = UnitQuaternion::from_scaled_axis(w * (-0.5 * dt)) * rotation;
        middle * (inertia * (middle.inverse() * w))
    }

    #[test]
    fn a_tumbling_top_keeps_momentum_and_energy() {
        let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
        let (mut rotation, mut w) = (UnitQuaternion::identity(), Vector3::new(0.01, 5.0, 0.02));
        let dt = 1.0 / 60.0;
        step(&inertia, &mut rotation, &mut w, dt);
        let start = momentum(&inertia, &rotation, &w, dt);
        let energy = |w: &Vector3<f64>, r: &UnitQuaternion<f64>| {
            let y = r.inverse() * w;
            0.5 * y.dot(&(inertia * y))
        };
        let e0 = energy(&w, &rotation);
        for _ in 0..60_000 {
            step(&inertia, &mut rotation, &mut w, dt);
            assert!((energy(&w, &rotation) / e0 - 1.0).abs() < 2e-2);
        }
        let drift = (momentum(&inertia, &rotation, &w, dt) - start).norm() / start.norm();
        assert!(drift < 1e-10, "{drift}");
    }

    /// A slender segment (inertia ratio 8000) at ωΔt of 0.1 … 1, about a skew axis.
    #[test]
    fn a_fast_spinning_segment_does_not_blow_up() {
        let inertia = Matrix3::from_diagonal(&Vector3::new(0.0145, 0.0145, 1.8e-6));
        let dt = 1.0 / 60.0;
        for turn in [0.1, 0.5, 1.0] {
            let mut w = Vector3::new(0.3, 0.1, 1.0).normalize() * (turn / dt);
            let mut rotation = UnitQuaternion::identity();
            let start = w.norm();
            for _ in 0..6000 {
                step(&inertia, &mut rotation, &mut w, dt);
                assert!(w.norm() < 1.5 * start, "{turn}: {w}");
            }
        }
    }

    #[test]
    fn symmetric_bodies_and_principal_axes_have_no_torque() {
        let ball = Matrix3::identity() * 2.0;
        let w = Vector3::new(3.0, -2.0, 1.0);
        assert!(impulse(&ball, &Matrix3::identity(), &ball, &w, 0.1).norm() < 1e-15);
        let top = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
        let about = Vector3::new(0.0, 4.0, 0.0);
        assert_eq!(
            impulse(&top, &Matrix3::identity(), &top, &about, 0.1),
            Vector3::zeros()
        );
    }
}
