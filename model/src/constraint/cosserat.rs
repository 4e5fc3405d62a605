//! Cable joint with stretch (3 rows), bend (2 rows) and twist (1 row).
//!
//! With the axes u (along the cable), v, w of each side, d = u_a × u_b, s = |d| = sin θ, c = u_a·u_b = cos θ, n = d/s:
//!
//! **Bend** about a ∈ {v_a, w_a}: β = (θ/sin θ) d·a: the components of the rotation vector θ n that takes u_a to u_b
//! on the shortest way. With ω_b alone moving, θ̇ = n·ω and ḋ = u_a × (ω × u_b) = c ω − (u_a·ω) u_b, so that
//!
//!   ∂β/∂ω_b = h (d·a) d + g (c a − (u_b·a) u_a),  g = θ/sin θ,  h = (1 − θ cot θ)/sin²θ
//!
//! β is smooth at θ = 0 (g = 1, h = 1/3: the row is a). At θ = π the axis n has no direction and g → ∞: the fold.
//!
//! **Twist** Ω = atan2(w_a·v_b − v_a·w_b, v_a·v_b + w_a·w_b) + 2πm: the twist part of the swing-twist decomposition of
//! the relative rotation. ∂Ω/∂ω_b = (u_a + u_b)/(1 + c): no contamination by bending. Singular at θ = π only. m makes
//! Ω follow its reference through many turns.
//!
//! φ̇ depends on ω_b − ω_a only, because both angles are unchanged when everything turns.

use nalgebra::Vector3;

use super::{JointLaw, Rows, unwrap_angle};
use crate::frame::{Frame, Resolved};

/// Below this sine the fold θ = π is taken to have the bend axis v_a: everything stays finite there.
pub(super) const FOLD: f64 = 1e-14;

/// Cable joint that resists bending in both transverse directions, up to 6 rows: stretch, bend about v, bend about w,
/// twist.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cosserat {
    /// The two attachment frames.
    pub frames: [Frame; 2],
    /// Which rows there are, and their laws.
    pub law: JointLaw,
    /// Twist \[rad] of the last accepted step, against which the twist is unwrapped.
    pub twist_reference: f64,
}

impl Cosserat {
    /// A joint whose twist starts within half a turn of zero.
    #[must_use]
    pub fn new(frames: [Frame; 2], law: JointLaw) -> Self {
        Self {
            frames,
            law,
            twist_reference: 0.0,
        }
    }

    pub(super) fn evaluate(&self, a: &Resolved, b: &Resolved, rows: &mut Rows<'_>) {
        if self.law.stretch.is_some() {
            rows.stretch(a, b);
        }
        if self.law.bend.is_some() {
            for (beta, g) in bend(a, b) {
                rows.angular(beta, &g);
            }
        }
        if self.law.twist.is_some() {
            let (omega, g) = self.twist(a, b);
            rows.angular(omega, &g);
        }
    }

    /// Unwrapped twist \[rad] and its gradient on ω_b.
    pub(super) fn twist(&self, a: &Resolved, b: &Resolved) -> (f64, Vector3<f64>) {
        twist(a, b, self.twist_reference)
    }
}

/// Twist \[rad] of b against a, unwrapped to `reference`, and its gradient on ω_b.
pub(super) fn twist(a: &Resolved, b: &Resolved, reference: f64) -> (f64, Vector3<f64>) {
    let mean = a.u() + b.u();
    // 1 + c = |u_a + u_b|²/2, which keeps its digits near θ = π.
    let g = mean * (2.0 / mean.norm_squared().max(FOLD * FOLD));
    (unwrap_angle(twist_angle(a, b), reference), g)
}

/// Bend angles \[rad] about v_a and w_a with their gradients on ω_b.
pub(super) fn bend(a: &Resolved, b: &Resolved) -> [(f64, Vector3<f64>); 2] {
    let (ua, ub) = (a.u(), b.u());
    let mut d = ua.cross(&ub);
    let c = ua.dot(&ub);
    if c < 0.0 && d.norm_squared() < FOLD * FOLD {
        d = a.v() * FOLD;
    }
    let s = d.norm();
    let (g, h) = bend_factors(s, c);
    [a.v(), a.w()].map(|axis| {
        let along = d.dot(&axis);
        let row = d * (h * along) + (axis * c - ua * ub.dot(&axis)) * g;
        (g * along, row)
    })
}

/// g = θ/sin θ and h = (1 − θ cot θ)/sin²θ from s = sin θ ≥ 0 and c = cos θ.
pub(super) fn bend_factors(s: f64, c: f64) -> (f64, f64) {
    let q = s * s;
    if c > 0.0 && s < 0.03 {
        // Series in sin²θ: the closed form of h cancels to second order. Next terms: 63 s¹⁰/2816 and 256 s¹⁰/9009.
        let g = 1.0 + q * (1.0 / 6.0 + q * (3.0 / 40.0 + q * (5.0 / 112.0 + q * (35.0 / 1152.0))));
        let h = 1.0 / 3.0
            + q * (2.0 / 15.0 + q * (8.0 / 105.0 + q * (16.0 / 315.0 + q * (128.0 / 3465.0))));
        (g, h)
    } else {
        let g = s.atan2(c) / s;
        (g, (1.0 - g * c) / q)
    }
}

/// Twist \[rad] of b against a, up to multiples of 2π: 2 atan2(q_u, q_0) of the relative quaternion.
fn twist_angle(a: &Resolved, b: &Resolved) -> f64 {
    let r = a.axes.transpose() * b.axes;
    if r[(0, 0)] > -0.5 {
        return (r[(2, 1)] - r[(1, 2)]).atan2(r[(1, 1)] + r[(2, 2)]);
    }
    // Near the fold q_0 and q_u are both small; times the larger swing component they keep their digits.
    let (sine, cosine) = if r[(2, 2)] > r[(1, 1)] {
        (r[(0, 2)] + r[(2, 0)], r[(1, 0)] - r[(0, 1)])
    } else {
        (r[(0, 1)] + r[(1, 0)], r[(0, 2)] - r[(2, 0)])
    };
    2.0 * sine.atan2(cosine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{LAW, Poses, assert_rows, bent, phi};
    use crate::constraint::{Constraint, RowKind, RowLaw};
    use crate::linearized::update_windings;
    use nalgebra::UnitQuaternion;
    use std::f64::consts::{PI, TAU};

    fn joint(frames: [Frame; 2]) -> Constraint {
        let all = JointLaw {
            stretch: Some(LAW),
            bend: Some(LAW),
            twist: Some(LAW),
        };
        Constraint::Cosserat(Cosserat::new(frames, all))
    }

    fn check_at(regime: &str, theta: f64) {
        let relative = |p: &mut Poses| bent(theta, &p.across(), 3.0 * p.number());
        assert_rows(regime, relative, joint);
    }

    #[test]
    fn jacobian_at_random_poses() {
        let relative = |p: &mut Poses| bent(1.5 + 1.4 * p.number(), &p.across(), 3.0 * p.number());
        assert_rows("cosserat random", relative, joint);
    }

    #[test]
    fn jacobian_near_straight() {
        for k in 1..=12 {
            check_at(&format!("cosserat θ = 1e-{k}"), 10_f64.powi(-k));
        }
        check_at("cosserat θ = 0", 0.0);
        // Both sides of the switch to the series.
        check_at("cosserat θ = 0.0299", 0.0299);
        check_at("cosserat θ = 0.0301", 0.0301);
    }

    #[test]
    fn jacobian_near_the_fold() {
        // Closer, the rounding of the axes (1e-16 over the distance to π, over the step) drowns the differences.
        for k in 1..=6 {
            check_at(&format!("cosserat θ = π − 1e-{k}"), PI - 10_f64.powi(-k));
        }
    }

    #[test]
    fn the_fold_itself_is_finite() {
        let mut poses = Poses::new(5);
        for axis in [Vector3::y(), Vector3::z()] {
            let relative = UnitQuaternion::from_scaled_axis(axis * PI);
            let scene = poses.pair(&relative, joint);
            let mut lin = crate::Linearized::new(&scene);
            lin.update(&scene, 0.0);
            assert!(lin.phi.iter().all(|v| v.is_finite()));
            assert!((0..lin.slots.len()).all(|s| lin.block(s).iter().all(|j| j.is_finite())));
            assert!((lin.phi[3].hypot(lin.phi[4]) - PI).abs() < 1e-12);
        }
    }

    #[test]
    fn bend_and_twist_are_the_swing_and_the_twist() {
        let mut poses = Poses::new(11);
        for theta in [0.0, 1e-9, 1e-3, 0.3, 1.5, 2.5, PI - 1e-3] {
            let (n, omega) = (poses.across(), 3.0 * poses.number());
            let scene = poses.pair(&bent(theta, &n, omega), joint);
            let phi = phi(&scene);
            let tolerance = 1e-14 * (1.0 + 1.0 / (PI - theta));
            for (found, exact) in phi[3..].iter().zip([theta * n.y, theta * n.z, omega]) {
                assert!(
                    (found - exact).abs() < tolerance,
                    "{found} {exact} at {theta}"
                );
            }
        }
    }

    #[test]
    fn twist_follows_37_turns_bent_or_not() {
        for theta in [0.0, 0.4, 2.6] {
            let mut poses = Poses::new(13);
            let n = poses.across();
            let pair = |turn: f64| Poses::new(17).pair(&bent(theta, &n, turn), joint);
            let mut scene = pair(0.0);
            for sign in [1.0, -1.0] {
                for k in 1..=37 * 5 {
                    let turn = sign * TAU / 5.0 * f64::from(k);
                    scene.bodies = pair(turn).bodies;
                    update_windings(&mut scene, 0.0);
                    assert!((phi(&scene)[5] - turn).abs() < 1e-12, "turn {turn}");
                }
                let error = crate::check_jacobian(&scene, 0).max;
                println!("cosserat θ = {theta}, 37 turns {error:.1e}");
                assert!(error < 1e-9, "{error:e}");
                for k in (0..37 * 5).rev() {
                    scene.bodies = pair(sign * TAU / 5.0 * f64::from(k)).bodies;
                    update_windings(&mut scene, 0.0);
                }
                assert!(phi(&scene)[5].abs() < 1e-12);
            }
        }
    }

    #[test]
    fn rows_are_optional() {
        let bend = RowLaw::new(2.0, 0.0);
        let law = JointLaw {
            bend: Some(bend),
            ..JointLaw::default()
        };
        let make = |frames| Constraint::Cosserat(Cosserat::new(frames, law));
        let mut poses = Poses::new(19);
        let scene = poses.pair(&bent(0.5, &Vector3::y(), 0.1), make);
        let c = &scene.constraints[0];
        assert_eq!((c.rows(), c.row(1)), (2, (RowKind::Bend, bend)));
        assert!(!c.has_stretch_rows());
        assert!((phi(&scene)[0] - 0.5).abs() < 1e-14);
        assert!(crate::check_jacobian(&scene, 0).max < 1e-9);
    }
}
