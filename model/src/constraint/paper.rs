//! The paper's angular joint: stretch (3 rows), scalar bend (1 row), twist (1 row).
//!
//! **Bend** θ = atan2(|u_a × u_b|, u_a·u_b) \[SL (21)]. With d = u_a × u_b and n = d/|d|: θ̇ = n·(ω_b − ω_a).
//! n has no direction at θ = 0 and θ = π: the safeguard replaces it by d/(s₀ + |d|), wrong by the factor
//! s₀/(s₀ + |d|). The row resists one transverse direction only: keep this joint for reproducing the paper.
//!
//! **Twist** \[SL (22)]: the angle between p = v_a and q = w_b minus π/2 (`Ordinary`), or between v_a and v_b
//! (`Alternative`), plus 2πm. As an unsigned angle it folds (at a twist of ±π/2 or 0) and can carry no winding number,
//! so the angle carries the sign of (p × q)·(u_a + u_b) here: Ω = ±atan2(|p × q|, p·q) (− π/2) + 2πm, with gradient
//! ±n on ω_b, n = p × q/|p × q|. For an unbent joint n = ±u and Ω is smooth through any number of turns. For a joint
//! bent by θ the angle between p and q is never below a β₀ ≤ θ, and Ω jumps by 2β₀ where the sign changes: a limit of
//! this definition, absent in [`Cosserat`](super::Cosserat). The alternative definition has that place at rest, but
//! with m = 0 its energy ½Ω²/ε does not see the sign.

use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;

use super::facts::{Facts, Parts, of_cable};
use super::{JointLaw, Rows, unwrap_angle};
use crate::body::Bodies;
use crate::error::{SceneError, check};
use crate::frame::{Frame, Resolved};

/// Pair of vectors whose angle is the paper's twist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum TwistDefinition {
    /// v_a against w_b, orthogonal at rest: the angle minus π/2.
    #[default]
    Ordinary,
    /// v_a against v_b, aligned at rest: mixes in bending about w.
    Alternative,
}

/// The paper's angular joint \[SL (20)], up to 5 rows: stretch, bend, twist.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Paper {
    /// The two attachment frames.
    pub frames: [Frame; 2],
    /// Its rows, and their laws.
    pub law: JointLaw,
    /// Pair of vectors whose angle is the twist.
    pub twist_definition: TwistDefinition,
    /// Safeguard s₀ > 0 of the directions d/(s₀ + |d|), without unit.
    pub safeguard: f64,
    /// Reference that unwraps the twist \[rad], within 0.01 rad of the twist of the last accepted
    /// step.
    pub twist_reference: f64,
}

impl Paper {
    /// Default safeguard s₀: the gradient's error s₀/(s₀ + |d|) is 10⁻⁸ at θ = 10⁻⁶, and still |d| of the size of
    /// rounding (10⁻¹⁶), whose direction is noise, is damped to a hundredth.
    pub const SAFEGUARD: f64 = 1e-14;

    /// A joint with the ordinary twist definition whose twist starts within half a turn of zero.
    #[must_use]
    pub fn new(frames: [Frame; 2], law: JointLaw) -> Self {
        Self {
            frames,
            law,
            twist_definition: TwistDefinition::Ordinary,
            safeguard: Self::SAFEGUARD,
            twist_reference: 0.0,
        }
    }

    /// Unwrapped twist \[rad] and its gradient on ω_b.
    pub(super) fn twist(&self, a: &Resolved, b: &Resolved) -> (f64, Vector3<f64>) {
        let p = a.v();
        let (q, rest) = match self.twist_definition {
            TwistDefinition::Ordinary => (b.w(), FRAC_PI_2),
            TwistDefinition::Alternative => (b.v(), 0.0),
        };
        let (angle, n) = angle_between(&p, &q, self.safeguard);
        let sign = if n.dot(&(a.u() + b.u())) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let omega = unwrap_angle(sign * angle - rest, self.twist_reference);
        (omega, n * sign)
    }
}

/// Angle \[rad, 0 to π] from p to q \[SL (21)] and its gradient on the angular velocity of q, d/(s₀ + |d|)
/// \[SL (27), (28)].
pub(super) fn angle_between(
    p: &Vector3<f64>,
    q: &Vector3<f64>,
    safeguard: f64,
) -> (f64, Vector3<f64>) {
    let d = p.cross(q);
    let sine = d.norm();
    (sine.atan2(p.dot(q)), d / (safeguard + sine))
}

impl Facts for Paper {
    fn parts(&self) -> Parts {
        self.law.parts(1)
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        if self.law.stretch.is_some() {
            rows.stretch(&a, &b);
        }
        if self.law.bend.is_some() {
            let (theta, n) = angle_between(&a.u(), &b.u(), self.safeguard);
            rows.angular(theta, &n);
        }
        if self.law.twist.is_some() {
            let (omega, n) = self.twist(&a, &b);
            rows.angular(omega, &n);
        }
    }

    of_cable!();

    fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        let [a, b] = self.frames.map(|frame| frame.resolve(bodies, t));
        self.twist_reference = self.twist(&a, &b).0;
        false
    }

    fn validate(&self, what: &dyn Fn() -> String) -> Result<(), SceneError> {
        let (s, of) = (self.safeguard, format!("{}: safeguard", what()));
        check(of, s, s > 0.0 && s < 1.0, "between 0 and 1")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, bent, phi};
    use crate::linearized::update_windings;
    use crate::testing::*;
    use std::f64::consts::TAU;

    const ALL: JointLaw = JointLaw {
        stretch: Some(LAW),
        bend: Some(LAW),
        twist: Some(LAW),
    };

    impl Sample for Paper {
        fn sample(frames: [Frame; 2]) -> Self {
            Self::new(frames, ALL)
        }
    }

    fn ordinary(frames: [Frame; 2]) -> Constraint {
        Paper::sample(frames).into()
    }

    fn alternative(frames: [Frame; 2]) -> Constraint {
        let twist_definition = TwistDefinition::Alternative;
        Constraint::Paper(Paper::new(frames, ALL).with(|p| p.twist_definition = twist_definition))
    }

    #[test]
    fn jacobian_at_random_poses() {
        let relative = |p: &mut Poses| bent(1.5 + 1.4 * p.number(), &p.across(), 3.0 * p.number());
        assert_rows("paper random", relative, ordinary);
        assert_rows("paper alternative random", relative, alternative);
    }

    #[test]
    fn straight_joint_is_finite_and_has_no_bend_row() {
        let mut poses = Poses::new(5);
        let scene = poses.pair(&bent(0.0, &Vector3::y(), 0.3), ordinary);
        let lin = crate::Linearized::at(&scene, 0.0);
        assert!(lin.phi.iter().all(|v| v.is_finite()));
        assert!((0..lin.slots.len()).all(|s| lin.block(s).iter().all(|j| j.is_finite())));
        // Rounding of the axes leaves |d| ≈ 1e-16: its meaningless direction is damped to a few hundredths.
        let bend_row = &lin.block(1)[6 * 3 + 3..6 * 3 + 6];
        assert!(bend_row.iter().all(|g| g.abs() < 0.1), "{bend_row:?}");
    }

    #[test]
    fn ordinary_and_alternative_twist_agree_on_a_straight_joint() {
        let mut poses = Poses::new(23);
        for omega in [-3.0, -2.0, -1.0, -0.1, 0.2, 1.0, 1.5, 1.7, 3.0] {
            let relative = bent(0.0, &Vector3::y(), omega);
            for joint in [ordinary, alternative] {
                let mut scene = poses.pair(&relative, joint);
                if let Constraint::Paper(p) = &mut scene.constraints[0] {
                    p.twist_reference = omega;
                }
                assert!((phi(&scene)[4] - omega).abs() < 1e-7, "{omega}");
            }
        }
    }

    #[test]
    fn jacobian_after_37_turns() {
        let law = JointLaw { bend: None, ..ALL };
        for joint in [TwistDefinition::Ordinary, TwistDefinition::Alternative] {
            let make = |frames| {
                Constraint::Paper(Paper::new(frames, law).with(|p| p.twist_definition = joint))
            };
            let pair = |turn: f64| Poses::new(17).pair(&bent(0.0, &Vector3::y(), turn), make);
            let mut scene = pair(0.0);
            for k in 0..=37 * 7 {
                scene.bodies = pair(0.5 + TAU / 7.0 * f64::from(k)).bodies;
                update_windings(&mut scene, 0.0);
            }
            assert!((phi(&scene)[3] - 37.0 * TAU - 0.5).abs() < 1e-12);
            let error = crate::check_jacobian(&scene, 0).max;
            println!("paper {joint:?}, 37 turns {error:.1e}");
            assert!(error < 1e-9, "{error:e}");
        }
    }

    #[test]
    fn bend_is_the_angle_of_the_axes() {
        let mut poses = Poses::new(29);
        for theta in [1e-6, 0.1, 1.0, 2.0, 3.1] {
            let scene = poses.pair(&bent(theta, &poses_across(), 0.4), ordinary);
            assert!((phi(&scene)[3] - theta).abs() < 1e-14);
        }
    }

    fn poses_across() -> Vector3<f64> {
        Poses::new(31).across()
    }
}
