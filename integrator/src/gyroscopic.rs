//! Free rotation over one step.
//!
//! Forces change the angular velocity at t_n; from there to t_{n+1} the body turns as if it were free, whatever its speed,
//! and keeps its angular momentum. The angular velocity after it is that of the end. A body without an axis of symmetry
//! takes as many parts h of the step as it needs, each by the midpoint rule on the rotation group,
//!
//! ```text
//! exp(½h ŷ) ℓ⁺ = exp(−½h ŷ) ℓ = I y,    R⁺ = R exp(h ŷ)        ℓ = Rᵀ L, y: momentum and angular velocity, body frame
//! ```
//!
//! which keeps the momentum to rounding and the energy within a band of some thousandths; the explicit torque −ω×Iω gains
//! energy and is lost near ωΔt = 1, and one midpoint over the whole step lets the energy swing by a quarter at two
//! radians a step.
//!
//! A body with an axis of symmetry needs no equation: its axis turns about its angular momentum, and it spins about its
//! axis,
//!
//! ```text
//! R⁺ = exp(Δt p̂) exp(Δt ŝ) R,    p = L/I_across,    s = ω − p ∥ axis,    ω⁺ = exp(Δt p̂) ω
//! ```
//!
//! exactly so where it is free. This matters where it is not: the rotation by Δt ω of a segment that spins turns its
//! axis in another direction than ω × axis, by half of the spin's angle, and a joint at its end would feed the spin into
//! the swing.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use taut_lanes::Lanes;
use taut_lanes::functions::sinc_cos;
use taut_lanes::vector::{self as lanes, Vec3, cross, dot, product, scale, scale_add, turned};

/// Rotation (rad) of a part of the step: the energy's band is a tenth of its square.
const PART: f64 = 0.1;

/// Parts at most, 10³ rad a step.
const PARTS: f64 = 1e4;

/// Newton passes at most: two to four are needed.
const PASSES: usize = 12;

/// Number of the axis of symmetry, and inertia about it over that across it; a point is as symmetric as a ball.
pub(crate) fn symmetry(inertia: &Matrix3<f64>) -> Option<(usize, f64)> {
    let i = inertia;
    let diagonal = i.m12 == 0.0 && i.m13 == 0.0 && i.m23 == 0.0;
    let other = |axis: usize| ((axis + 1) % 3, (axis + 2) % 3);
    let axis = [2, 0, 1].into_iter().find(|&axis| {
        let (a, b) = other(axis);
        i[(a, a)] == i[(b, b)]
    })?;
    let across = i[(other(axis).0, other(axis).0)];
    let ratio = if across == 0.0 {
        1.0
    } else {
        i[(axis, axis)] / across
    };
    diagonal.then_some((axis, ratio))
}

/// Turns a body through a step with the angular velocity `omega` (rad/s, world), which then is that of its end.
pub(crate) fn turn(
    inertia: &Matrix3<f64>,
    orientation: &mut UnitQuaternion<f64>,
    omega: &mut Vector3<f64>,
    dt: f64,
) {
    let Some((axis, ratio)) = symmetry(inertia) else {
        return turn_freely(inertia, orientation, omega, dt);
    };
    let about = About::new(axis, ratio);
    let (q, w) = about.turn(orientation.coords.as_ref(), omega.as_ref(), 0.5 * dt);
    *orientation = UnitQuaternion::new_unchecked(Quaternion::from(q));
    *omega = w.into();
}

/// The symmetry of a body, or of one in each lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct About<V> {
    /// The axis of symmetry in the body frame, a unit vector.
    pub(crate) axis: Vec3<V>,
    /// Inertia along the axis over that across it, less 1.
    pub(crate) excess: V,
}

impl About<f64> {
    /// From the number of the axis, and the inertia about it over that across it.
    fn new(axis: usize, ratio: f64) -> Self {
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        Self {
            axis: unit,
            excess: ratio - 1.0,
        }
    }
}

impl<V: Lanes> About<V> {
    /// p, which turns the axis, and p − ω along the axis, of which `seen` is the direction in the world.
    #[inline(always)]
    fn precession(&self, seen: &Vec3<V>, omega: &Vec3<V>) -> (Vec3<V>, V) {
        let spin = dot(omega, seen) * self.excess;
        (scale_add(seen, spin, omega), spin)
    }

    /// Orientation \[x, y, z, w] and angular velocity after twice `half_dt`.
    #[inline(always)]
    pub(crate) fn turn(
        &self,
        orientation: &lanes::Quaternion<V>,
        omega: &Vec3<V>,
        half_dt: V,
    ) -> (lanes::Quaternion<V>, Vec3<V>) {
        // The axis as `turned` has it, of which the spin takes its first half, too.
        let ([x, y, z, w], axis) = (*orientation, self.axis);
        let imaginary = [x, y, z];
        let inner = scale_add(&axis, w, &cross(&imaginary, &axis));
        let seen = scale_add(&cross(&imaginary, &inner), V::splat(2.0), &axis);
        let (p, spin) = self.precession(&seen, omega);
        // exp(Δt p̂)
        let half = scale(&p, half_dt);
        let (sinc, cosine) = sinc_cos(dot(&half, &half));
        let [i, j, k] = scale(&half, sinc);
        let carried = [i, j, k, cosine];
        // exp(Δt ŝ) R = R exp(Δt Rᵀŝ), where Rᵀs is along the axis.
        let half = -(spin * half_dt);
        let (sinc, cosine) = sinc_cos(half * half);
        let sine = half * sinc;
        let [x, y, z] = scale_add(&inner, sine, &scale(&imaginary, cosine));
        let w = sine.neg_mul_add(dot(&imaginary, &axis), w * cosine);
        let mut q = product(&carried, &[x, y, z, w]);
        let square = q[3].mul_add(q[3], dot(&[q[0], q[1], q[2]], &[q[0], q[1], q[2]]));
        // One Newton step for 1/√square.
        let scale = V::splat(0.5) * (V::splat(3.0) - square);
        for q in &mut q {
            *q = *q * scale;
        }
        (q, turned(&carried, omega))
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
    let (mut before, mut omega) = (*orientation, *omega);
    match symmetry(inertia) {
        None => turn_freely(inertia, &mut before, &mut omega, -dt),
        Some((axis, ratio)) => {
            let about = About::new(axis, ratio);
            let seen = turned(orientation.coords.as_ref(), &about.axis);
            let (p, _) = about.precession(&seen, omega.as_ref());
            before = UnitQuaternion::from_scaled_axis(Vector3::from(p) * -dt) * before;
        }
    }
    before
}

/// The orientation from which [`turn`] leads to `end` with the velocity `omega` at the beginning, to third order in its angle.
pub(crate) fn turned_from(
    inertia: &Matrix3<f64>,
    end: &UnitQuaternion<f64>,
    omega: &Vector3<f64>,
    dt: f64,
) -> UnitQuaternion<f64> {
    let guess = UnitQuaternion::from_scaled_axis(*omega * -dt) * end;
    let (mut found, mut omega) = (guess, *omega);
    turn(inertia, &mut found, &mut omega, dt);
    end * found.inverse() * guess
}

/// Turns a body of any inertia freely over `dt` (s), which may be negative. Where a part has no solution near by, it turns
/// about the axis that it has: that keeps the energy, and momentum no longer.
fn turn_freely(
    inertia: &Matrix3<f64>,
    orientation: &mut UnitQuaternion<f64>,
    omega: &mut Vector3<f64>,
    dt: f64,
) {
    let Some(inverse) = inertia.try_inverse() else {
        return turn_by(orientation, omega, dt);
    };
    let mut rate = orientation.inverse() * *omega;
    let mut momentum = inertia * rate;
    // No angular velocity of this energy is larger.
    let fastest = (rate.dot(&momentum) * inverse.trace()).sqrt();
    let parts = (fastest * dt.abs() / PART).ceil().clamp(1.0, PARTS);
    let h = dt / parts;
    for _ in 0..parts as usize {
        let middle = midpoint(inertia, &rate, &momentum, h);
        let turn = UnitQuaternion::from_scaled_axis(middle.unwrap_or(rate) * h);
        *orientation *= turn;
        if middle.is_some() {
            momentum = turn.inverse() * momentum;
            rate = inverse * momentum;
        }
    }
    orientation.renormalize_fast();
    *omega = *orientation * rate;
}

/// The y of exp(½h ŷ) I y = `momentum` near `guess`, by Newton's method; `None` where it does not converge.
fn midpoint(
    inertia: &Matrix3<f64>,
    guess: &Vector3<f64>,
    momentum: &Vector3<f64>,
    h: f64,
) -> Option<Vector3<f64>> {
    let half = 0.5 * h;
    let (mut next, mut best) = (*guess, (f64::INFINITY, *guess));
    for _ in 0..PASSES {
        let target = UnitQuaternion::from_scaled_axis(next * -half) * momentum;
        let residual = inertia * next - target;
        let size = residual.norm();
        if size < best.0 {
            best = (size, next);
        } else if best.0 <= 1e-12 * momentum.norm() || !size.is_finite() {
            // Rounding, or lost.
            break;
        }
        if size <= 4.0 * f64::EPSILON * momentum.norm() {
            break;
        }
        let derivative = inertia - target.cross_matrix() * left_jacobian(&(next * -half)) * half;
        next -= derivative.try_inverse()? * residual;
    }
    (best.0 <= 1e-12 * momentum.norm()).then_some(best.1)
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

    /// Momentum and energy.
    fn kept(
        inertia: &Matrix3<f64>,
        rotation: &UnitQuaternion<f64>,
        w: &Vector3<f64>,
    ) -> (Vector3<f64>, f64) {
        let y = rotation.inverse() * w;
        (rotation * (inertia * y), 0.5 * y.dot(&(inertia * y)))
    }

    /// A body without symmetry at 0.08 … 17 rad a step, its inertia turned in its frame or not.
    #[test]
    fn a_tumbling_body_keeps_momentum_and_energy() {
        let skew = UnitQuaternion::from_euler_angles(0.4, -0.2, 0.9).to_rotation_matrix();
        let dt = 1.0 / 60.0;
        for principal in [[1.0, 2.0, 3.0], [0.0083, 0.0842, 0.0908]] {
            let straight = Matrix3::from_diagonal(&Vector3::from(principal));
            for inertia in [straight, skew * straight * skew.transpose()] {
                for speed in [5.0, 47.0, 120.0, 200.0, 1000.0] {
                    let mut rotation = UnitQuaternion::identity();
                    let mut w = Vector3::new(0.5, 0.7, 0.3) * speed;
                    let (start, energy) = kept(&inertia, &rotation, &w);
                    for _ in 0..600 {
                        turn(&inertia, &mut rotation, &mut w, dt);
                        let (momentum, now) = kept(&inertia, &rotation, &w);
                        let change = (momentum - start).norm() / start.norm();
                        assert!(change < 1e-9, "{speed}: {change}");
                        let change = (now / energy - 1.0).abs();
                        assert!(change < 2e-3, "{speed}: {change}");
                    }
                }
            }
        }
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
                turn(&inertia, &mut rotation, &mut w, dt);
                let axis = rotation * Vector3::z();
                let turned = UnitQuaternion::from_scaled_axis(across * (dt * f64::from(n)));
                let off = (axis - turned * Vector3::z()).norm();
                assert!(off < 1e-11, "{angle}: {axis}");
                let momentum = rotation * (inertia * (rotation.inverse() * w));
                let off = (momentum - start).norm();
                assert!(off < 1e-11 * start.norm(), "{angle}: {w}");
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

    /// Euler's equations by the classical Runge–Kutta method, and the midpoints: of second order.
    #[test]
    fn a_tumble_follows_eulers_equations() {
        let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
        let inverse = inertia.try_inverse().unwrap();
        let start = Vector3::new(0.01, 5.0, 0.02);
        let rate = |y: &Vector3<f64>| inverse * (inertia * y).cross(y);
        let mut exact = start;
        let h = 1e-3;
        for _ in 0..1000 {
            let a = rate(&exact);
            let b = rate(&(exact + a * (0.5 * h)));
            let c = rate(&(exact + b * (0.5 * h)));
            let d = rate(&(exact + c * h));
            exact += (a + (b + c) * 2.0 + d) * (h / 6.0);
        }
        let error = |steps: u32| {
            let (mut rotation, mut w) = (UnitQuaternion::identity(), start);
            for _ in 0..steps {
                turn(&inertia, &mut rotation, &mut w, 1.0 / f64::from(steps));
            }
            (rotation.inverse() * w - exact).norm()
        };
        let (coarse, fine) = (error(100), error(200));
        let holds = fine < 1e-3 && (coarse / fine / 4.0 - 1.0).abs() < 0.05;
        assert!(holds, "{coarse} {fine}");
    }
}
