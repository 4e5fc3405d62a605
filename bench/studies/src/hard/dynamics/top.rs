//! H32: a free rigid body about its intermediate axis.
//!
//! Euler: with I₁ < I₂ < I₃, twice the energy 2T and the angular momentum L, where L² > 2T I₂ the angular velocity
//! about the second axis is a Jacobian sn of period
//!
//! ```text
//! 4K(k) √(I₁I₂I₃/((I₃ − I₂)(L² − 2TI₁))),    k² = (I₂ − I₁)(2TI₃ − L²)/((I₃ − I₂)(L² − 2TI₁))
//! ```
//!
//! and the body flips twice in it. The gyroscopic torque taken explicitly, y⁺ = y + Δt I⁻¹(I y × y), gains energy in
//! every step and is lost near ωΔt = 1.

use super::frequency::passages;
use crate::hard::at;
use crate::hard::special::complete_k;
use crate::hard::worse;
use indicatif::ProgressBar;
use nalgebra::{Matrix3, Vector3};
use taut_integrator::{StepError, Stepper};
use taut_model::{Body, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Principal moments of inertia \[kg m²].
const INERTIA: [f64; 3] = [1.0, 2.0, 3.0];
/// Angular velocity at the start, body axes, over its part about the second one.
const START: [f64; 3] = [0.02, 1.0, 0.05];
/// Largest relative error of the flip's time at Δt → 0, and difference of its order from 2.
const BAR: f64 = 1e-6;
const ORDER_BAR: f64 = 0.1;
/// Largest relative change of the angular momentum.
const MOMENTUM_BAR: f64 = 1e-10;
/// Largest drift of the energy: its mean over the last tenth beside the first tenth's, relative.
const DRIFT_BAR: f64 = 1e-3;
/// Widest band of the energy over (ωΔt)² that passes.
const BAND_BAR: f64 = 0.1;

fn body_rate(speed: f64) -> Vector3<f64> {
    Vector3::from(START) * speed
}

pub(super) fn scene(speed: f64) -> Scene {
    let mut scene = Scene::new("free body");
    let mut body = Body::new(1.0, Matrix3::from_diagonal(&Vector3::from(INERTIA)));
    body.angular_velocity = body_rate(speed);
    scene.add_body("body", body);
    scene
}

/// Time between two flips of a body that starts with the angular velocity `y` (rad/s, body axes), L² > 2T I₂ \[s].
pub(super) fn flip_time(y: &Vector3<f64>) -> f64 {
    let [i1, i2, i3] = INERTIA;
    let momentum = Vector3::from(INERTIA).component_mul(y);
    let (square, twice) = (momentum.norm_squared(), momentum.dot(y));
    let spread = (i3 - i2) * (square - twice * i1);
    let k = ((i2 - i1) * (twice * i3 - square) / spread).sqrt();
    2.0 * complete_k(k) * (i1 * i2 * i3 / spread).sqrt()
}

/// Records of a tumble.
#[derive(Debug, Clone, PartialEq, Default)]
struct Tumble {
    /// Angular velocity about the second axis at the end of each step \[rad/s].
    second: Vec<f64>,
    /// Energy in each step \[J].
    energy: Vec<f64>,
    /// Largest relative change of the angular momentum.
    momentum: f64,
}

fn tumble(speed: f64, dt: f64, steps: usize) -> Result<Tumble, StepError> {
    let options = at(dt);
    let mut stepper = Stepper::new(scene(speed), options)?;
    let mut found = Tumble::default();
    let mut start = Vector3::zeros();
    let inertia = Vector3::from(INERTIA);
    for n in 0..steps {
        stepper.step()?;
        let bodies = &stepper.scene().bodies;
        let (orientation, omega) = (bodies.orientation[0], bodies.angular_velocity[0]);
        let y = orientation.inverse() * omega;
        let momentum = orientation * inertia.component_mul(&y);
        if n == 0 {
            start = momentum;
        }
        let change = (momentum - start).norm() / start.norm();
        found.momentum = worse(found.momentum, change);
        found.second.push(y.y);
        found.energy.push(0.5 * y.dot(&inertia.component_mul(&y)));
    }
    Ok(found)
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = period(5.0)?;
    let steps = if quick { 6000 } else { 100_000 };
    // Rotations of 0.08 and of 1 rad in a step.
    for speed in [5.0, 60.0] {
        checks.extend(kept(speed, steps)?);
    }
    Ok(checks.into())
}

/// Time between flips: at Δt → 0, and its order.
fn period(speed: f64) -> Result<Vec<Check>, ExperimentError> {
    let exact = flip_time(&body_rate(speed));
    let mut errors = [0.0; 3];
    for (error, finer) in errors.iter_mut().zip([8.0, 16.0, 32.0]) {
        let dt = 1.0 / (60.0 * finer);
        let found = tumble(speed, dt, (2.6 * exact / dt) as usize)?;
        *error = match passages(&found.second, false, f64::INFINITY).as_slice() {
            [first, second, ..] => (second - first) * dt / exact - 1.0,
            _ => f64::NAN,
        };
    }
    let [_, coarse, fine] = errors;
    let extrapolated = fine + (fine - coarse) / 3.0;
    let order = (coarse / fine).abs().log2();
    Ok(vec![
        Check::within(
            "time between flips",
            format!("{exact:.9} s"),
            format!("{:.9} s", exact * (1.0 + extrapolated)),
            extrapolated.abs(),
            BAR,
        )
        .by("relative, extrapolated from 1/960 and 1/1920 s; time: what 1/1920 s adds")
        .time_part((fine - extrapolated).abs()),
        Check::second_order("time between flips: order", order, ORDER_BAR)
            .by("difference of the order from 2, 1/960 to 1/1920 s"),
    ])
}

/// The step with an explicit gyroscopic torque: steps until the energy is a hundred times what it was.
fn explicit_life(speed: f64, dt: f64, steps: usize) -> Option<usize> {
    let inertia = Vector3::from(INERTIA);
    let mut y = body_rate(speed);
    let start = y.dot(&inertia.component_mul(&y));
    (1..=steps).find(|_| {
        let torque = inertia.component_mul(&y).cross(&y);
        y += torque.component_div(&inertia) * dt;
        let energy = y.dot(&inertia.component_mul(&y));
        !energy.is_finite() || energy > 100.0 * start
    })
}

/// Angular momentum and energy over very many steps of 1/60 s.
fn kept(speed: f64, steps: usize) -> Result<Vec<Check>, ExperimentError> {
    let dt = 1.0 / 60.0;
    let found = tumble(speed, dt, steps)?;
    let part = steps / 10;
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
    let (first, last) = (
        mean(&found.energy[..part]),
        mean(&found.energy[steps - part..]),
    );
    let drift = worse(0.0, (last / first - 1.0).abs());
    let largest = found.energy.iter().copied().fold(0.0, worse);
    let least = found.energy.iter().copied().fold(f64::INFINITY, f64::min);
    let explicit = explicit_life(speed, dt, steps).map_or_else(
        || "lasts".to_owned(),
        |n| format!("has a hundred times the energy after {n} steps"),
    );
    let name = |what: &str| format!("ωΔt = {:.3}, {steps} steps: {what}", speed * dt);
    let band = (largest - least) / first;
    Ok(vec![
        Check::off(
            name("angular momentum"),
            "kept",
            found.momentum,
            "",
            MOMENTUM_BAR,
        )
        .by("largest change, relative"),
        Check::off(name("energy"), "no drift", drift, "", DRIFT_BAR)
            .by("mean of the last tenth beside the first tenth's, relative")
            .noting(format!(
                "with the torque taken explicitly the body {explicit}"
            )),
        Check::within(
            name("energy band"),
            format!("≤ {BAND_BAR} (ωΔt)²"),
            format!("{band:.1e}"),
            band / (speed * dt).powi(2),
            BAND_BAR,
        )
        .by("largest less least energy, relative, over (ωΔt)²: a scheme of second order"),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Euler's equations by the classical Runge–Kutta method.
    #[test]
    fn the_flip_time_is_that_of_eulers_equations() {
        let inertia = Vector3::from(INERTIA);
        let rate = |y: &Vector3<f64>| inertia.component_mul(y).cross(y).component_div(&inertia);
        let mut y = body_rate(5.0);
        let h = 1e-3;
        let mut second = vec![y.y];
        for _ in 0..6000 {
            let a = rate(&y);
            let b = rate(&(y + a * (0.5 * h)));
            let c = rate(&(y + b * (0.5 * h)));
            let d = rate(&(y + c * h));
            y += (a + (b + c) * 2.0 + d) * (h / 6.0);
            second.push(y.y);
        }
        let found = passages(&second, false, f64::INFINITY);
        let measured = (found[1] - found[0]) * h;
        assert!(
            (measured / flip_time(&body_rate(5.0)) - 1.0).abs() < 1e-9,
            "{measured}"
        );
    }

    #[test]
    fn the_explicit_torque_is_lost() {
        assert!(explicit_life(60.0, 1.0 / 60.0, 1000).is_some());
    }
}
