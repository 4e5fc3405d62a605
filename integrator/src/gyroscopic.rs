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
//!
//! A body with an axis of symmetry needs no such equation: its axis turns about its angular momentum, and it spins about
//! its axis,
//!
//! ```text
//! R⁺ = exp(Δt p̂) exp(Δt ŝ) R,    p = L/I_across,    s = ω − p ∥ axis,    ω⁺ = exp(Δt p̂) ω
//! ```
//!
//! exactly so where it is free. This matters where it is not: the rotation by Δt ω of a segment that spins turns its
//! axis in another direction than ω × axis, by half of the spin's angle, and a joint at its end would feed the spin into
//! the swing.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Below this rotation a step (rad) the explicit torque, whose error is of second order in it, is used.
const SMALL: f64 = 1e-4;

/// Newton passes at most: two to six are needed up to ωΔt = 1.5.
const PASSES: usize = 12;

/// What turns the axis of a body that is symmetric about an axis of its frame: L/I_across (rad/s, world), for the
/// rotation `orientation` from body to world. `None` for other bodies.
fn precession(
    inertia: &Matrix3<f64>,
    orientation: &UnitQuaternion<f64>,
    omega: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let (axis, ratio) = symmetry(inertia)?;
    let mut unit = Vector3::zeros();
    unit[axis] = 1.0;
    let axis = orientation * unit;
    Some(omega + axis * ((ratio - 1.0) * omega.dot(&axis)))
}

/// Number of the axis of symmetry, and inertia about it over that across it.
pub(crate) fn symmetry(inertia: &Matrix3<f64>) -> Option<(usize, f64)> {
    let i = inertia;
    let diagonal = i.m12 == 0.0 && i.m13 == 0.0 && i.m23 == 0.0;
    let other = |axis: usize| ((axis + 1) % 3, (axis + 2) % 3);
    let axis = [2, 0, 1].into_iter().find(|&axis| {
        let (a, b) = other(axis);
        i[(a, a)] == i[(b, b)]
    })?;
    let across = i[(other(axis).0, other(axis).0)];
    diagonal.then(|| (axis, i[(axis, axis)] / across))
}

/// Turns a body through a step with the angular velocity `omega` (rad/s, world), which then is that of its end.
pub(crate) fn turn(
    inertia: &Matrix3<f64>,
    orientation: &mut UnitQuaternion<f64>,
    omega: &mut Vector3<f64>,
    dt: f64,
) {
    match precession(inertia, orientation, omega) {
        None => turn_by(orientation, omega, dt),
        Some(p) => {
            let carried = UnitQuaternion::from_scaled_axis(p * dt);
            let spun = UnitQuaternion::from_scaled_axis((*omega - p) * dt);
            *orientation = carried * spun * *orientation;
            *omega = carried * *omega;
            orientation.renormalize_fast();
        }
    }
}

/// Turns an orientation by `omega` over `dt`.
pub(crate) fn turn_by(orientation: &mut UnitQuaternion<f64>, omega: &Vector3<f64>, dt: f64) {
    *orientation = UnitQuaternion::from_scaled_axis(*omega * dt) * *orientation;
    orientation.renormalize_fast();
}

/// The orientation before [`turn`], up to a rotation about an axis of symmetry.
pub(crate) fn turned_back(
    inertia: &Matrix3<f64>,
    orientation: &UnitQuaternion<f64>,
    omega: &Vector3<f64>,
    dt: f64,
) -> UnitQuaternion<f64> {
    let p = precession(inertia, orientation, omega).unwrap_or(*omega);
    UnitQuaternion::from_scaled_axis(p * -dt) * orientation
}

/// The impulse Δt·(gyroscopic torque) \[N m s] of a body that turns freely with ω (rad/s, world) through a step; `inertia`
/// in the body frame, `rotation` body to world, `world` the inertia in the world frame. None for a symmetric body, whose
/// angular velocity [`turn`] takes along. Where the equation has no solution near by (rotations of some two radians a
/// step) it is zero too: that keeps the energy, and momentum no longer.
pub(crate) fn impulse(
    inertia: &Matrix3<f64>,
    rotation: &Matrix3<f64>,
    world: &Matrix3<f64>,
    omega: &Vector3<f64>,
    dt: f64,
) -> Vector3<f64> {
    if symmetry(inertia).is_some() {
        return Vector3::zeros();
    }
    let momentum = world * omega;
    let explicit = omega.cross(&momentum) * -dt;
    let turn = omega.norm() * dt;
    if turn < SMALL || explicit.norm() <= f64::EPSILON * turn * momentum.norm() {
        return explicit;
    }
    let y = rotation.transpose() * omega;
    let after = turn_freely(inertia, &y, dt);
    after.map_or_else(Vector3::zeros, |y_next| rotation * (inertia * (y_next - y)))
}

/// y⁺ from y by Newton's method, `None` where it does not converge.
fn turn_freely(inertia: &Matrix3<f64>, y: &Vector3<f64>, dt: f64) -> Option<Vector3<f64>> {
    let half = 0.5 * dt;
    let turned = |by: Vector3<f64>, p: &Vector3<f64>| UnitQuaternion::from_scaled_axis(by) * p;
    let before = turned(y * -half, &(inertia * y));
    let (mut next, mut best) = (*y, (f64::INFINITY, *y));
    for _ in 0..PASSES {
        let target = turned(next * -half, &before);
        let residual = inertia * next - target;
        let size = residual.norm();
        if size < best.0 {
            best = (size, next);
        } else if best.0 <= 1e-12 * before.norm() || !size.is_finite() {
            // Rounding, or lost.
            break;
        }
        if size <= 4.0 * f64::EPSILON * before.norm() {
            break;
        }
        let derivative = inertia - target.cross_matrix() * left_jacobian(&(next * -half)) * half;
        next -= derivative.try_inverse()? * residual;
    }
    (best.0 <= 1e-12 * before.norm()).then_some(best.1)
}

/// Left Jacobian of the exponential map: exp(a + δ) ≈ exp(J δ) exp(a).
fn left_jacobian(a: &Vector3<f64>) -> Matrix3<f64> {
    let square = a.norm_squared();
    let (first, second) = if square < 1e-4 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let angle = square.sqrt();
        (
            (1.0 - angle.cos()) / square,
            (angle - angle.sin()) / (square * angle),
        )
    };
    let cross = a.cross_matrix();
    Matrix3::identity() + cross * first + cross * cross * second
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
        turn(inertia, rotation, w, dt);
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

    /// A slender segment (inertia ratio 8000) at ωΔt of 0.1 … 1, about a skew axis: its axis stays on its cone about
    /// the angular momentum, at the angle of the closed form.
    #[test]
    fn a_fast_spinning_segment_precesses_exactly() {
        let inertia = Matrix3::from_diagonal(&Vector3::new(0.0145, 0.0145, 1.8e-6));
        let dt = 1.0 / 60.0;
        for angle in [0.1, 0.5, 1.0] {
            let mut w = Vector3::new(0.003, 0.001, 1.0) * (angle / dt);
            let mut rotation = UnitQuaternion::identity();
            let start = inertia * w;
            let across = start / 0.0145;
            for n in 1..=600 {
                step(&inertia, &mut rotation, &mut w, dt);
                let axis = rotation * Vector3::z();
                let turned = UnitQuaternion::from_scaled_axis(across * (dt * f64::from(n)));
                assert!(
                    (axis - turned * Vector3::z()).norm() < 1e-11,
                    "{angle}: {axis}"
                );
                let momentum = rotation * (inertia * (rotation.inverse() * w));
                assert!(
                    (momentum - start).norm() < 1e-11 * start.norm(),
                    "{angle}: {w}"
                );
            }
        }
    }

    #[test]
    fn a_turn_can_be_taken_back() {
        for diagonal in [[1.0, 1.0, 0.1], [2.0, 1.0, 2.0], [1.0, 2.0, 3.0]] {
            let inertia = Matrix3::from_diagonal(&Vector3::from(diagonal));
            let start = UnitQuaternion::from_euler_angles(0.3, -0.7, 1.1);
            let (mut rotation, mut w) = (start, Vector3::new(5.0, -20.0, 30.0));
            turn(&inertia, &mut rotation, &mut w, 0.02);
            let back = turned_back(&inertia, &rotation, &w, 0.02);
            let world = |r: &UnitQuaternion<f64>| {
                let r = r.to_rotation_matrix().into_inner();
                r * inertia * r.transpose()
            };
            assert!((world(&back) - world(&start)).norm() < 1e-14);
            assert!((world(&rotation) - world(&start)).norm() > 0.1);
        }
    }

    /// The equation holds to rounding at every speed, however few passes that takes.
    #[test]
    fn the_impulse_solves_its_equation() {
        let inertia = Matrix3::from_diagonal(&Vector3::new(0.76, 0.5, 0.03));
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 0.5));
        let r = rotation.to_rotation_matrix().into_inner();
        let world = r * inertia * r.transpose();
        let dt = 1.0 / 60.0;
        for k in 0..300 {
            let w = Vector3::new(-0.4, 0.5, -0.6) * 10.0_f64.powf(-2.0 + f64::from(k) / 100.0);
            let p = impulse(&inertia, &r, &world, &w, dt);
            let y = rotation.inverse() * w;
            let next = rotation.inverse() * (w + world.try_inverse().unwrap() * p);
            let half = |y: Vector3<f64>, by: f64| {
                UnitQuaternion::from_scaled_axis(y * (by * dt)) * (inertia * y)
            };
            let (before, after) = (half(y, -0.5), half(next, 0.5));
            let error = (after - before).norm() / before.norm();
            // Below a turn of 10⁻⁴ the explicit torque is taken, whose error is the turn's square.
            let turn = w.norm() * dt;
            let bound = if turn < SMALL { turn * turn } else { 1e-14 };
            assert!(error < bound, "turn {turn:e}: {error:e}");
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
