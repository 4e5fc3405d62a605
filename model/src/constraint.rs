//! Constraints: violations φ(q, t), Jacobians and the laws of their rows.
//!
//! Every row obeys ε λ = −(φ + τ φ̇) \[SL (7)] with compliance ε ≥ 0 and damping time τ ≥ 0. The Jacobian is that of
//! φ̇ = J v + ∂φ/∂t with v = \[v; ω] of the sides in the world frame. Joints have two sides, a first; [`LinkBend`] has
//! three and [`MasslessCable`] any number.
//!
//! All angular rows of joints depend on the relative rotation of the two sides only: their Jacobian on ω_a is the
//! negative of that on ω_b.

mod cosserat;
mod distance;
mod fairlead;
pub(crate) mod gap;
mod hinge;
mod link_bend;
mod loads;
mod lock;
mod massless_cable;
mod motor;
mod paper;
mod rows;
mod sheave;
mod slider;
mod spherical;
#[cfg(test)]
mod testing;

pub use cosserat::Cosserat;
pub(crate) use cosserat::{BendTwist, bends_little};
pub use distance::Distance;
pub(crate) use fairlead::of_length;
pub use fairlead::{Fairlead, LEAST};
pub use gap::row_along;
pub use hinge::Hinge;
pub use link_bend::{BendDefinition, LinkBend};
pub use loads::{Loads, Wrench};
pub use lock::Lock;
pub(crate) use massless_cable::End;
pub use massless_cable::{MasslessCable, Winch};
pub use motor::{Motor, Target};
pub use paper::{Paper, TwistDefinition};
pub(crate) use rows::Rows;
pub(crate) use sheave::called;
pub use sheave::{Lay, Sheave};
pub use slider::Slider;
pub use spherical::Spherical;

use nalgebra::Vector3;
use std::f64::consts::TAU;

use crate::body::Bodies;
use crate::frame::{Frame, Resolved};

/// Most rows that one constraint can have.
pub const MAX_ROWS: usize = 6;

/// Law of a row: ε λ = −(φ + τ φ̇).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RowLaw {
    /// Compliance ε ≥ 0: \[m/N] for lengths, \[rad/(N m)] for angles. Zero is rigid.
    pub compliance: f64,
    /// Damping time τ ≥ 0 \[s].
    pub damping: f64,
}

impl RowLaw {
    /// A rigid row without damping.
    pub const RIGID: Self = Self {
        compliance: 0.0,
        damping: 0.0,
    };

    /// A row with compliance ε (m/N or rad/(N m)) and damping time τ (s).
    #[must_use]
    pub const fn new(compliance: f64, damping: f64) -> Self {
        Self {
            compliance,
            damping,
        }
    }
}

/// Rows of a cable joint, and their laws. At least one must be there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct JointLaw {
    /// The three stretch rows.
    pub stretch: Option<RowLaw>,
    /// The bend rows: one in [`Paper`], two in [`Cosserat`].
    pub bend: Option<RowLaw>,
    /// The twist row.
    pub twist: Option<RowLaw>,
}

/// Quantity that a row measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RowKind {
    /// A gap between attachment points \[m].
    Stretch,
    /// An angle between the cable axes \[rad].
    Bend,
    /// An angle about the cable axis \[rad].
    Twist,
    /// A component of a rotation vector \[rad].
    Rotation,
    /// A distance between attachment points, less the length of the link \[m].
    Length,
    /// A component of a gap \[m]: across the axis of a slider, or against and across a cable where it leaves its winch.
    Across,
    /// The coordinate of a slider, less the target of its motor \[m].
    Position,
    /// The angle of a hinge, less the target of its motor \[rad].
    Angle,
    /// Nothing: φ = 0. Holds a rate, ∂φ/∂t; see [`Motor`].
    Speed,
    /// Nothing: φ = 0 \[m]. Resists the motion across a link; its compliance is the time stepper's, see [`Distance`].
    Transverse,
}

impl RowKind {
    /// True if the row's φ is an angle \[rad], not a length \[m].
    #[must_use]
    pub fn is_angular(self) -> bool {
        match self {
            Self::Stretch | Self::Length | Self::Across | Self::Position => false,
            Self::Speed | Self::Transverse => false,
            Self::Bend | Self::Twist | Self::Rotation | Self::Angle => true,
        }
    }
}

/// A constraint between frames: a closed set of kinds, one file each.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Constraint {
    /// Ball joint, 3 rows.
    Spherical(Spherical),
    /// The angular joint of the paper with scalar bend, up to 5 rows.
    Paper(Paper),
    /// Cable joint with two bend directions, up to 6 rows.
    Cosserat(Cosserat),
    /// All six relative coordinates, 6 rows.
    Lock(Lock),
    /// Link of a particle chain, 1 row, or 3 with the transverse ones.
    Distance(Distance),
    /// Rotation about one axis, 5 rows, or 6 with a motor.
    Hinge(Hinge),
    /// Translation along one axis, 5 rows, or 6 with a motor.
    Slider(Slider),
    /// Total length through any number of points, 1 row.
    MasslessCable(MasslessCable),
    /// Angle between two links that share a point, 1 or 2 rows.
    LinkBend(LinkBend),
    /// Where a cable of segments leaves its winch, 3 rows, or up to 6 clamped.
    Fairlead(Fairlead),
}

/// Each kind is a constraint.
macro_rules! kinds {
    ($($kind:ident),*) => {$(
        impl From<$kind> for Constraint {
            fn from(constraint: $kind) -> Self {
                Self::$kind(constraint)
            }
        }
    )*};
}

kinds!(
    Spherical,
    Paper,
    Cosserat,
    Lock,
    Distance,
    Hinge,
    Slider,
    MasslessCable,
    LinkBend,
    Fairlead
);

impl Constraint {
    /// Number of rows, at most [`MAX_ROWS`]; fixed as long as the set of row laws is.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.parts().map(|(_, rows, _)| rows).sum()
    }

    /// The rows in their order, as (kind, number of rows, law).
    #[inline]
    pub fn parts(&self) -> impl Iterator<Item = (RowKind, usize, RowLaw)> {
        use RowKind::{Across, Bend, Length, Rotation, Stretch, Transverse, Twist};
        let joint = |law: &JointLaw, bend_rows| {
            [
                (Stretch, 3, law.stretch),
                (Bend, bend_rows, law.bend),
                (Twist, 1, law.twist),
            ]
        };
        let driven = |motor: Option<Motor>, angular| match motor.map(|m| m.part(angular)) {
            Some((kind, law)) => (kind, 1, Some(law)),
            None => (RowKind::Speed, 0, None),
        };
        let parts = match self {
            Self::Spherical(c) => [
                (Stretch, 3, Some(c.stretch)),
                (Bend, 0, None),
                (Twist, 0, None),
            ],
            Self::Paper(c) => joint(&c.law, 1),
            Self::Cosserat(c) => joint(&c.law, 2),
            Self::Lock(c) => [
                (Stretch, 3, Some(c.linear)),
                (Rotation, 3, Some(c.angular)),
                (Twist, 0, None),
            ],
            Self::Distance(c) => [
                (Length, 1, Some(c.law)),
                (Transverse, 2, c.transverse.then_some(RowLaw::RIGID)),
                (Twist, 0, None),
            ],
            Self::Hinge(c) => [
                (Stretch, 3, Some(c.stretch)),
                (Bend, 2, Some(c.tilt)),
                driven(c.motor, true),
            ],
            Self::Slider(c) => [
                (Rotation, 3, Some(c.rotation)),
                (Across, 2, Some(c.across)),
                driven(c.motor, false),
            ],
            Self::MasslessCable(c) => [(Length, 1, Some(c.law)), (Bend, 0, None), (Twist, 0, None)],
            Self::Fairlead(c) => [
                (Across, 3, c.law.stretch),
                (Bend, 2, c.law.bend),
                (Twist, 1, c.law.twist),
            ],
            Self::LinkBend(c) => [
                (Bend, c.definition.rows(), Some(c.law)),
                (Stretch, 0, None),
                (Twist, 0, None),
            ],
        };
        let present = |(kind, rows, law): (_, _, Option<_>)| Some((kind, rows, law?));
        parts.into_iter().filter_map(present)
    }

    /// The frames of the sides, in order: a and b of a joint.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        match self {
            Self::Spherical(c) => &c.frames,
            Self::Paper(c) => &c.frames,
            Self::Cosserat(c) => &c.frames,
            Self::Lock(c) => &c.frames,
            Self::Distance(c) => &c.frames,
            Self::Hinge(c) => &c.frames,
            Self::Slider(c) => &c.frames,
            Self::MasslessCable(c) => &c.frames,
            Self::LinkBend(c) => &c.frames,
            Self::Fairlead(c) => &c.frames,
        }
    }

    /// The frames, to be changed; the bodies that they name are part of the topology.
    pub fn frames_mut(&mut self) -> &mut [Frame] {
        match self {
            Self::Spherical(c) => &mut c.frames,
            Self::Paper(c) => &mut c.frames,
            Self::Cosserat(c) => &mut c.frames,
            Self::Lock(c) => &mut c.frames,
            Self::Distance(c) => &mut c.frames,
            Self::Hinge(c) => &mut c.frames,
            Self::Slider(c) => &mut c.frames,
            Self::MasslessCable(c) => &mut c.frames,
            Self::LinkBend(c) => &mut c.frames,
            Self::Fairlead(c) => &mut c.frames,
        }
    }

    /// Bodies of the sides that are held by bodies, in the order of the sides.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = usize> {
        self.frames().iter().filter_map(Frame::body_index)
    }

    /// Kind and law of row `row`.
    ///
    /// # Panics
    /// When `row` is not below [`Constraint::rows`].
    #[must_use]
    pub fn row(&self, row: usize) -> (RowKind, RowLaw) {
        let mut end = 0;
        let found = self.parts().find(|(_, rows, _)| {
            end += rows;
            row < end
        });
        let (kind, _, law) =
            found.unwrap_or_else(|| panic!("row {row} of a constraint with {end} rows"));
        (kind, law)
    }

    /// True if the first three rows are the gap between the attachment points (a minus b).
    #[must_use]
    pub fn has_stretch_rows(&self) -> bool {
        let first = self.parts().next();
        first.is_some_and(|(kind, ..)| kind == RowKind::Stretch)
    }

    /// True if a force acts at the attachment points: the Jacobian then changes as the levers turn.
    pub(crate) fn acts_at_points(&self) -> bool {
        let of_points = matches!(
            self,
            Self::Distance(_)
                | Self::Slider(_)
                | Self::MasslessCable(_)
                | Self::LinkBend(_)
                | Self::Fairlead(_)
        );
        of_points || self.has_stretch_rows()
    }

    /// The kind's name: `spherical`, `paper`, `cosserat`, `lock`, `distance`, `hinge`, `slider`,
    /// `massless-cable`, `link-bend`, `fairlead`.
    #[must_use]
    pub fn kind_name(&self) -> &'static str {
        match self {
            Self::Spherical(_) => "spherical",
            Self::Paper(_) => "paper",
            Self::Cosserat(_) => "cosserat",
            Self::Lock(_) => "lock",
            Self::Distance(_) => "distance",
            Self::Hinge(_) => "hinge",
            Self::Slider(_) => "slider",
            Self::MasslessCable(_) => "massless-cable",
            Self::LinkBend(_) => "link-bend",
            Self::Fairlead(_) => "fairlead",
        }
    }

    /// Writes φ at time `t` into `phi` (length [`Constraint::rows`]). Allocates: no.
    ///
    /// # Panics
    /// When `phi` is too short or a frame names a body that is not there.
    pub fn violation(&self, bodies: &Bodies, t: f64, phi: &mut [f64]) {
        self.evaluate(bodies, t, &mut Rows::new(phi, &mut [], &mut []));
    }

    /// The rows of its length or gap at time `t` + `dt` (s) if its bodies go on freely from their velocities at `t` \[m]: one of a
    /// rod or massless cable, three of a joint with rows of stretch, none of other kinds.
    #[must_use]
    pub fn gap_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> ([f64; 3], usize) {
        let one = |phi: f64| ([phi, 0.0, 0.0], 1);
        let between = |frames: &[Frame]| {
            let [a, b] = [0, 1].map(|side| frames[side].resolve_ahead(bodies, t, dt));
            gap(&a, &b)
        };
        match self {
            Self::MasslessCable(c) => one(c.path_ahead(bodies, t, dt) - c.length_at(t + dt)),
            Self::Distance(c) => one(between(&c.frames).norm() - c.length),
            joint if joint.has_stretch_rows() => (between(joint.frames()).into(), 3),
            _ => ([0.0; 3], 0),
        }
    }

    /// Writes φ, the Jacobian blocks and the lever arms.
    pub(crate) fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        match self {
            Self::Spherical(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                rows.stretch(&a, &b);
            }
            Self::Paper(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                c.evaluate(&a, &b, rows);
            }
            Self::Cosserat(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                c.evaluate(&a, &b, rows);
            }
            Self::Lock(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                lock::evaluate(&a, &b, rows);
            }
            Self::Distance(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                c.evaluate(&a, &b, rows);
            }
            Self::Hinge(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                c.evaluate(&a, &b, rows);
            }
            Self::Slider(c) => {
                let [a, b] = rows.resolve(&c.frames, bodies, t);
                c.evaluate(&a, &b, rows);
            }
            Self::MasslessCable(c) => c.evaluate(bodies, t, rows),
            Self::LinkBend(c) => c.evaluate(bodies, t, rows),
            Self::Fairlead(c) => c.evaluate(bodies, t, rows),
        }
    }

    /// The motor of the joint.
    #[must_use]
    pub fn motor(&self) -> Option<&Motor> {
        match self {
            Self::Hinge(c) => c.motor.as_ref(),
            Self::Slider(c) => c.motor.as_ref(),
            _ => None,
        }
    }

    /// The motor of the joint, to be set; whether there is one is part of the topology.
    pub fn motor_mut(&mut self) -> Option<&mut Motor> {
        match self {
            Self::Hinge(c) => c.motor.as_mut(),
            Self::Slider(c) => c.motor.as_mut(),
            _ => None,
        }
    }

    /// The row that has bounds, if there is one, and the bounds of its λ at time `t` (s), lower and upper \[N or N m];
    /// infinite stands for none.
    #[must_use]
    pub fn bounds(&self, t: f64) -> Option<(usize, f64, f64)> {
        match self {
            Self::MasslessCable(c) => {
                let (lower, upper) = c.bounds_at(t);
                (c.tension_only || c.winch.is_some()).then_some((0, lower, upper))
            }
            Self::Fairlead(c) => {
                let (lower, upper) = c.bounds_at(t);
                Some((0, lower, upper))
            }
            other => {
                let limit = other.motor()?.force_limit;
                Some((other.rows() - 1, -limit, limit))
            }
        }
    }

    /// Factor of the rows' compliances at time `t` (s). `excess` is the length of a cable beyond
    /// its length at rest \[m].
    pub(crate) fn compliance_factor(&self, t: f64, excess: f64) -> f64 {
        match self {
            Self::MasslessCable(c) if !c.sheaves.is_empty() => {
                let excess = if c.is_part() { excess } else { 0.0 };
                (c.length_at(t) - c.wound() + excess) / c.length
            }
            Self::MasslessCable(c) if c.winch.is_some() => c.length_at(t) / c.length,
            _ => 1.0,
        }
    }

    /// Writes ∂φ/∂t as the mean over \[t, t_next] with the bodies held: moved world sides depend on time, in their points
    /// only, motors and winches.
    pub(crate) fn drive(&self, bodies: &Bodies, t: f64, t_next: f64, phi_t: &mut [f64]) {
        phi_t.fill(0.0);
        if t_next == t {
            return;
        }
        if self.acts_at_points() {
            self.drive_points(bodies, t, t_next, phi_t);
        }
        if let (Some(motor), Some(last)) = (self.motor(), phi_t.last_mut()) {
            *last += motor.drive();
        }
    }

    /// Part of ∂φ/∂t that comes from moved world sides and winches.
    fn drive_points(&self, bodies: &Bodies, t: f64, t_next: f64, phi_t: &mut [f64]) {
        let change = |f: &Frame| f.displacement(t_next) - f.displacement(t);
        let time = t_next - t;
        match self {
            Self::Slider(c) => {
                if c.frames.iter().any(|f| change(f) != Vector3::zeros()) {
                    // The row of a speed has no φ that would tell.
                    let at = |motor| Motor {
                        target: Target::Position(0.0),
                        ..motor
                    };
                    let slider = Slider {
                        motor: c.motor.map(at),
                        ..*c
                    };
                    Self::Slider(slider).difference(bodies, [t, t_next], phi_t);
                }
            }
            Self::MasslessCable(_) | Self::LinkBend(_) => {
                let points = self.frames().iter().any(|f| change(f) != Vector3::zeros());
                if points || self.compliance_factor(t, 0.0) != self.compliance_factor(t_next, 0.0) {
                    self.difference(bodies, [t, t_next], phi_t);
                }
            }
            Self::Fairlead(c) => {
                let points = c.frames.iter().any(|f| change(f) != Vector3::zeros());
                if points || c.length_at(t) != c.length_at(t_next) {
                    self.difference(bodies, [t, t_next], phi_t);
                }
            }
            Self::Distance(c) => {
                let [a, b] = &c.frames;
                let change = change(a) - change(b);
                // A link at rest needs no direction.
                if change != Vector3::zeros() {
                    let d = gap(&a.resolve(bodies, t), &b.resolve(bodies, t));
                    c.drive(&d, &change, time, phi_t);
                }
            }
            Self::Spherical(_)
            | Self::Paper(_)
            | Self::Cosserat(_)
            | Self::Lock(_)
            | Self::Hinge(_) => {
                let sides = self.frames().iter().zip([1.0, -1.0]);
                let change: Vector3<f64> = sides.map(|(f, sign)| change(f) * sign).sum();
                phi_t[..3].copy_from_slice((change / time).as_slice());
            }
        }
    }

    /// (φ(t′) − φ(t))/(t′ − t) with the bodies held, for the times t, t′.
    fn difference(&self, bodies: &Bodies, [t, t_next]: [f64; 2], rate: &mut [f64]) {
        let mut before = [0.0; MAX_ROWS];
        self.violation(bodies, t, &mut before[..rate.len()]);
        self.violation(bodies, t_next, rate);
        for (rate, before) in rate.iter_mut().zip(before) {
            *rate = (*rate - before) / (t_next - t);
        }
    }

    /// Sets what the twist of a cable joint is unwrapped against \[rad].
    #[inline]
    pub(crate) fn set_twist_reference(&mut self, twist: f64) {
        match self {
            Self::Paper(c) => c.twist_reference = twist,
            Self::Cosserat(c) => c.twist_reference = twist,
            Self::Fairlead(c) => c.twist_reference = twist,
            _ => {}
        }
    }

    /// Moves the unwrapping reference of a twist or hinge angle to its value at time `t`, and where a cable touches its
    /// sheaves; whether its rows are evaluated otherwise after that.
    pub(crate) fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        let sides = |frames: &[Frame; 2]| frames.map(|f| f.resolve(bodies, t));
        match self {
            Self::Spherical(_)
            | Self::Lock(_)
            | Self::Distance(_)
            | Self::Slider(_)
            | Self::LinkBend(_) => {}
            Self::MasslessCable(c) => return c.update_winding(bodies, t),
            Self::Hinge(c) => {
                let [a, b] = sides(&c.frames);
                c.angle_reference = c.angle(&a, &b);
            }
            Self::Paper(c) => {
                let [a, b] = sides(&c.frames);
                c.twist_reference = c.twist(&a, &b).0;
            }
            Self::Fairlead(c) => {
                let [a, b] = sides(&c.frames);
                c.twist_reference = c.twist(&a, &b);
            }
            Self::Cosserat(c) => {
                let [a, b] = sides(&c.frames);
                c.twist_reference = c.twist(&a, &b);
            }
        }
        false
    }
}

/// The value of `angle` + 2πk nearest to `reference` (rad): the winding number of \[SL (22)], tracked.
fn unwrap_angle(angle: f64, reference: f64) -> f64 {
    // A reference left by a state that was not finite counts for nothing: the next good state starts anew.
    if !reference.is_finite() {
        return angle;
    }
    angle + TAU * ((reference - angle) / TAU).round()
}

/// p_a − p_b \[m].
fn gap(a: &Resolved, b: &Resolved) -> Vector3<f64> {
    let centres = [a.centre.as_ref(), b.centre.as_ref()];
    gap::gap(centres, [a.lever.as_ref(), b.lever.as_ref()]).into()
}
