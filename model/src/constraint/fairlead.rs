//! Fairlead: where a cable of rigid segments leaves its winch.
//!
//! Side a holds the winch, side b is the cable's first segment, with u of b from the winch into the cable. The segment is
//! cut to the length ℓ₁ that was off the drum at the time [`Winch::since`]; since then the point of b that lies at the winch
//! has moved along the segment, to r_b(t) − (L(t) − L) u_b. With d = p_a − p_b and k ∈ {−u_b, v_b, w_b}, the rows are
//!
//!   φ = k·d,   φ̇ = k·(v_a + ω_a×r_a − v_b − ω_b×r_b) + (ω_b×k)·d + ∂φ/∂t,   ∂φ/∂t = −L̇ for k = −u_b
//!
//! so that J_a = \[kᵀ, (r_a×k)ᵀ], J_b = \[−kᵀ, −((r_b + d)×k)ᵀ]: the force acts on both at a's point. Row 0 is positive
//! and its λ negative where the cable is taut, as in a massless cable, and has the winch's bound λ ≥ −F. A clamped
//! cable has the bend and twist rows of [`Cosserat`](super::Cosserat) besides.
//!
//! Compliances are those of ℓ₁/2 of cable, half the segment. The turns of a cable do not enter the winch: side b keeps its
//! axes where the point moves, so that all torsion stays in what is off the drum.
//!
//! 3 rows; 5 or 6 clamped.

use nalgebra::Vector3;

use super::cosserat::BendTwist;
use super::facts::{Facts, Parts, any_moves, difference, of_cable};
use super::{JointLaw, RowKind, RowLaw, Rows, Winch, gap};
use crate::body::Bodies;
use crate::error::{SceneError, check, refuse};
use crate::frame::Frame;

/// Part of a whole segment that the first one is at least, before it merges with the next; it splits at one segment more.
pub const LEAST: f64 = 0.5;

/// Part of a whole segment at which a first one stops that has not been merged.
const STOP: f64 = 0.125;

/// The place at which a cable of segments leaves its winch: see the crate's `cable`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Fairlead {
    /// Frame of the winch on its support, and frame of the first segment.
    pub frames: [Frame; 2],
    /// The winch. Its limits are those of the whole length; hauling in stops at half a segment at the latest.
    pub winch: Winch,
    /// Length of the cable off the drum at the time [`Winch::since`] \[m], > 0.
    pub length: f64,
    /// Length of the first segment at that time \[m], > 0.
    pub first: f64,
    /// Length of a whole segment \[m], > 0.
    pub segment: f64,
    /// Laws of its rows, those of half of the first segment. Stretch must be there; bend and twist clamp the cable.
    pub law: JointLaw,
    /// Twist \[rad] of the last accepted step.
    pub twist_reference: f64,
}

/// The laws of a joint that stands for `length` (m) of cable.
#[must_use]
pub(crate) fn of_length(per_metre: &JointLaw, length: f64) -> JointLaw {
    let of = |law: Option<RowLaw>| law.map(|law| RowLaw::new(law.compliance * length, law.damping));
    JointLaw {
        stretch: of(per_metre.stretch),
        bend: of(per_metre.bend),
        twist: of(per_metre.twist),
    }
}

impl Fairlead {
    /// Length off the drum at time `t` (s) \[m].
    #[must_use]
    pub fn length_at(&self, t: f64) -> f64 {
        let least = self.length - self.first + STOP * self.segment;
        let shortest = self.winch.shortest.max(LEAST * self.segment).max(least);
        let winch = Winch {
            shortest,
            ..self.winch
        };
        winch.length_at(self.length, t)
    }

    /// Rope paid out by a drum that slipped at time `t` (s), for the violation `phi` (m) of the
    /// first row: until the elastic law gives the force `spring` (N), the holding force less that of a damper, or the drum is
    /// empty \[m].
    #[must_use]
    pub fn paid_out(&self, phi: f64, spring: f64, t: f64) -> f64 {
        let compliance = self.law.stretch.unwrap_or_default().compliance;
        // φ − x = ε (1 + x/ℓ₁) F.
        let stretch = compliance * spring;
        let paid = (phi - stretch) / (1.0 + stretch / self.first);
        let left = self.winch.longest - self.length_at(t);
        paid.min(left).max(0.0)
    }

    /// Direction from the winch into the cable, body frame of the first segment.
    pub(crate) fn along(&self) -> Vector3<f64> {
        self.frames[1].axes.column(0).into_owned()
    }
}

impl Facts for Fairlead {
    fn parts(&self) -> Parts {
        let mut parts = self.law.parts(2);
        parts[0].0 = RowKind::Across;
        parts
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let mut frames = self.frames;
        frames[1].point -= self.along() * (self.length_at(t) - self.length);
        let [a, b] = rows.resolve(&frames, bodies, t);
        let d = gap(&a, &b);
        let lever = b.lever + d;
        rows.set_lever(1, lever);
        for k in [-b.u(), b.v(), b.w()] {
            rows.along(k.dot(&d), &k, [&a.lever, &lever]);
        }
        if self.law.bend.is_some() || self.law.twist.is_some() {
            rows.bend_twist(&a, &b, &self.law, self.twist_reference);
        }
    }

    fn drive_points(&self, bodies: &Bodies, times: [f64; 2], phi_t: &mut [f64]) {
        let [before, after] = times.map(|t| self.length_at(t));
        if any_moves(&self.frames, times) || before != after {
            difference(self, bodies, times, phi_t);
        }
    }

    fn winch(&self) -> Option<&Winch> {
        Some(&self.winch)
    }

    fn winch_mut(&mut self, t: f64) -> Option<(&mut Winch, f64)> {
        self.winch.since = t;
        Some((&mut self.winch, self.length))
    }

    fn stall(&mut self, tension: f64, t: f64) -> bool {
        let stalls = self.winch.stalls(self.length_at(t), tension);
        std::mem::replace(&mut self.winch.stalled, stalls) != stalls
    }

    fn length_at(&self, t: f64) -> Option<f64> {
        Some(self.length_at(t))
    }

    fn bounds(&self, t: f64) -> Option<(usize, f64, f64)> {
        let lower = self.winch.lower_bound(self.length_at(t));
        Some((0, lower, f64::INFINITY))
    }

    of_cable!();

    fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        let [a, b] = self.frames.map(|frame| frame.resolve(bodies, t));
        self.twist_reference = BendTwist::of_frames(&a, &b, self.twist_reference).angles[2];
        false
    }

    fn validate(&self, what: &dyn Fn() -> String) -> Result<(), SceneError> {
        self.winch.validate(false, what)?;
        let of = |quantity: &str| format!("{}: {quantity}", what());
        let (length, first, segment) = (self.length, self.first, self.segment);
        check(of("length"), length, length > 0.0, "> 0")?;
        check(of("first segment"), first, first > 0.0, "> 0")?;
        check(of("whole segment"), segment, segment > 0.0, "> 0")?;
        if self.law.stretch.is_none() {
            let reason = "has a cable without stretch: give it a compliance, 0 where it is rigid";
            return refuse(what(), reason);
        }
        let most = "at most 1000 whole ones";
        check(of("first segment"), first, first <= 1e3 * segment, most)?;
        let needs = "no longer than the cable (m)";
        let within = first <= length * (1.0 + 1e-9);
        check(of("first segment"), first, within, needs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Constraint;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, bent, phi};

    impl Sample for Fairlead {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                frames,
                winch: Winch::new(),
                length: 10.0,
                first: 1.0,
                segment: 1.0,
                law: JointLaw {
                    stretch: Some(LAW),
                    bend: Some(LAW),
                    twist: Some(LAW),
                },
                twist_reference: 0.0,
            }
        }
    }

    fn lead(frames: [Frame; 2], speed: f64, clamped: bool) -> Constraint {
        let mut lead = Fairlead::sample(frames);
        lead.winch.speed = speed;
        if !clamped {
            (lead.law.bend, lead.law.twist) = (None, None);
        }
        lead.into()
    }

    #[test]
    fn jacobian_at_random_poses() {
        for clamped in [false, true] {
            let relative = |p: &mut Poses| bent(p.number(), &p.across(), 1.5 * p.number());
            assert_rows("fairlead", relative, |frames| lead(frames, 0.0, clamped));
        }
    }

    #[test]
    fn what_is_paid_out_is_the_rate_of_the_first_row_alone() {
        let mut poses = Poses::new(5);
        let relative = bent(0.4, &poses.across(), 0.7);
        let scene = poses.pair(&relative, |frames| lead(frames, -0.5, true));
        let at = phi(&scene);
        let mut rate = [0.0; 6];
        scene.constraints[0].drive(&scene.bodies, 0.0, 0.1, &mut rate);
        for (rate, exact) in rate.iter().zip([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]) {
            assert!((rate - exact).abs() < 1e-12, "{rate}");
        }
        assert_eq!(at.len(), 6);
    }

    #[test]
    fn a_drum_that_slips_pays_out_what_the_law_asks_for() {
        let mut poses = Poses::new(5);
        let scene = poses.pair(&Poses::rotation(&mut Poses::new(2)), |f| {
            lead(f, 0.0, false)
        });
        let Constraint::Fairlead(mut lead) = scene.constraints[0].clone() else {
            panic!("a fairlead");
        };
        lead.winch.force_limit = 0.2;
        let phi = 0.9;
        let paid = lead.paid_out(phi, 0.2, 0.0);
        let grown = 1.0 + paid / lead.first;
        let compliance = grown * lead.law.stretch.expect("a law").compliance;
        assert!((phi - paid - compliance * 0.2).abs() < 1e-15);
        assert_eq!(lead.paid_out(0.0, 0.2, 0.0), 0.0);
        lead.winch.longest = lead.length + 0.1;
        assert!((lead.paid_out(phi, 0.2, 0.0) - 0.1).abs() < 1e-14);
    }
}
