//! Masses of 10⁻³ kg that slip over a cylinder, on links between a load of 1 kg and another one, μ = 0.3: see the case `wound`.
//!
//! A mass turns the link by δ = π/n and has the pulls T and T' at ½δ to the tangent. While it slips with the acceleration a,
//!
//! ```text
//! T' (cos ½δ − μ sin ½δ) = T (cos ½δ + μ sin ½δ) + m (a + g cos θ + μ g sin θ)
//! ```

use std::f64::consts::PI;

const MU: f64 = 0.3;
const LIGHT: f64 = 1e-3;
const GRAVITY: f64 = 9.81;

/// T of the last leg for that of the first one, \[N], where the masses slip with the acceleration a along the cylinder.
fn carried(count: usize, first: f64, a: f64) -> f64 {
    let turn = PI / count as f64;
    let (s, c) = (0.5 * turn).sin_cos();
    (0..count).fold(first, |pull, k| {
        let (up, along) = ((k as f64 + 0.5) * turn).sin_cos();
        let own = LIGHT * (a + GRAVITY * (along + MU * up));
        (pull * (c + MU * s) + own) / (c - MU * s)
    })
}

/// The second load that the masses just hold \[kg].
pub(super) fn limit(count: usize) -> f64 {
    carried(count, GRAVITY, 0.0) / GRAVITY
}

/// The acceleration of the loads, the second one of so many kg \[m/s²], and the ratio of the tensions of the legs.
pub(super) fn accelerated(count: usize, load: f64) -> [f64; 2] {
    let leg = (0.5 * PI / count as f64).cos();
    let first = |a: f64| GRAVITY + a * leg;
    // Pull of the second load beyond the leg's, linear in a.
    let excess = |a: f64| load * (GRAVITY - a * leg) - carried(count, first(a), a);
    let a = excess(0.0) / (excess(0.0) - excess(1.0));
    [a * leg, carried(count, first(a), a) / first(a)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_just_holds_does_not_move_and_many_masses_hold_as_a_rope_does() {
        for count in [4, 32] {
            assert!(accelerated(count, limit(count))[0].abs() < 1e-12);
        }
        // Their own weights are 1/20 of the first load's.
        assert!((limit(32) / (MU * PI).exp() - 1.0).abs() < 0.1);
    }
}
