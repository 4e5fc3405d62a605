//! The Jacobian of every joint that measures angles beside differences in 32 digits ([`joints`](super::joints)), at bends from
//! 10⁻¹² to π − 10⁻⁹.
//!
//! A row that is an angle without sign, as the paper's bend and the angle of two links are, has the gradient n, the
//! direction of the axis, which rounding of the axes turns by 10⁻¹⁶/sin θ: there is no Jacobian to converge to where
//! θ → 0, and the paper's safeguard s₀ adds s₀/(s₀ + sin θ). Rows that have a sign, or two of them, are smooth at θ = 0;
//! at the fold all of them end, but Jacobians are right up to it.

use super::joints::{Kind, Pose, jacobian_error, sensitivity};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use taut_measure::errors::worse;

/// Largest error of a Jacobian, relative to the largest entry of its row.
const BAR: f64 = 1e-6;

/// Twists to ±π, in unlike places.
fn poses() -> [Pose; 6] {
    let mut k = -1.0_f64;
    [0.3, -1.1, PI - 1e-9, 1e-9 - PI, 2.9, 0.0].map(|twist| {
        k += 1.0;
        let axis = Vector3::new((3.0 * k).cos(), (5.0 * k).sin(), 0.3 + k.cos());
        Pose {
            turn: UnitQuaternion::from_scaled_axis(axis * (0.4 + k)),
            across: 1.7 * k - 2.0,
            twist,
        }
    })
}

fn largest(kind: Kind, theta: f64) -> f64 {
    let errors = poses().map(|pose| jacobian_error(kind, theta, &pose));
    errors.into_iter().fold(0.0, worse)
}

#[test]
fn jacobians_are_derivatives_at_singular_angles() {
    let open = [1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 2.0, 3.0];
    let near_the_fold = [1e-3, 1e-6, 1e-9].map(|distance| PI - distance);
    for kind in Kind::ALL {
        for theta in open.into_iter().chain(near_the_fold) {
            if kind.loses_direction() && theta.min(PI - theta) < 1e-6 {
                continue;
            }
            // A rounding of the middle one of three points; a Jacobian goes through some ten on the way.
            let rounding = poses().map(|pose| sensitivity(kind, theta, &pose));
            let rounding = rounding.into_iter().fold(0.0, f64::max);
            let error = largest(kind, theta);
            let what = format!("{kind:?} at {theta:e}: {error:e}, of rounding {rounding:e}");
            assert!(error <= BAR.max(10.0 * rounding), "{what}");
        }
    }
}

/// A wrong Jacobian would be seen: the paper's bend row has one where its safeguard is not small against the angle.
#[test]
fn jacobians_that_are_off_are_seen() {
    let safeguard = largest(Kind::PaperBend, 1e-10);
    assert!(safeguard > 5e-5, "{safeguard:e}");
}
