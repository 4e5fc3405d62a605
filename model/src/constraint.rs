//! Constraints: violations φ(q, t), Jacobians and the laws of their rows.
//!
//! Every row obeys ε λ = −(φ + τ φ̇) \[SL (7)] with compliance ε ≥ 0 and damping time τ ≥ 0. The Jacobian is that of
//! φ̇ = J v + ∂φ/∂t with v = \[v; ω] of the sides in the world frame. Joints have two sides, a first; [`LinkBend`] has
//! three and [`MasslessCable`] any number.
//!
//! All angular rows of joints depend on the relative rotation of the two sides only: their Jacobian on ω_a is the
//! negative of that on ω_b.
//!
//! A new kind takes a file with its struct and its facts (`constraint/facts.rs`), its lines in this file (the module, its
//! name and the list of kinds), and its keys in the text of scenes (`scene_file/joint.rs`). One that pulls along the line
//! between its points states the facts `link_length` and `gap_ahead`, and on which sides it `only_pulls`; its levers are said at
//! [`Linearized::lever`](crate::Linearized::lever). Its tests give a `Sample`, by which the list's tests hold its Jacobian
//! and facts, and call `assert_rows` in the regimes that it has besides (`constraint/testing.rs`).

mod cosserat;
mod distance;
pub(crate) mod facts;
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
pub(crate) mod testing;

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
pub(crate) use sheave::side_name;
pub use sheave::{Sheave, SheaveContact};
pub use slider::Slider;
pub use spherical::Spherical;

use facts::Facts;
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

impl JointLaw {
    /// The rows of a joint whose first three are the gap, with so many rows of bend.
    fn parts(&self, bend_rows: usize) -> facts::Parts {
        [
            (RowKind::Stretch, 3, self.stretch),
            (RowKind::Bend, bend_rows, self.bend),
            (RowKind::Twist, 1, self.twist),
        ]
    }
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
    /// True if φ measures how far points are apart, which a force at them resists.
    #[must_use]
    pub fn is_gap(self) -> bool {
        matches!(self, Self::Stretch | Self::Length | Self::Across)
    }

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

/// The kinds: for each its documentation; its facts are in its own file ([`facts`]).
macro_rules! kinds {
    ($($(#[doc = $doc:literal])* $kind:ident,)*) => {
        /// A constraint between frames: a closed set of kinds, one file each.
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
        pub enum Constraint {
            $(
                $(#[doc = $doc])*
                $kind($kind),
            )*
        }

        $(
            impl facts::Sides for $kind {
                fn frames(&self) -> &[Frame] {
                    &self.frames
                }
            }

            impl From<$kind> for Constraint {
                fn from(constraint: $kind) -> Self {
                    Self::$kind(constraint)
                }
            }
        )*

        impl Constraint {
            /// Names of the kinds.
            pub const KINDS: &[&str] = &[$(stringify!($kind)),*];
        }

        /// What the front page of the crate names.
        pub(crate) mod kinds {
            pub use super::{$($kind,)*};
        }

        /// One of each kind between two frames.
        #[cfg(test)]
        pub(crate) fn samples(frames: [Frame; 2]) -> Vec<Constraint> {
            vec![$(<$kind as testing::Sample>::sample(frames).into()),*]
        }

        /// Matches over the kinds: `$do` for each, which binds its struct as `$own`.
        macro_rules! each_kind {
            ($constraint:expr, $own:ident => $do:expr) => {
                match $constraint {
                    $(Constraint::$kind($own) => $do,)*
                }
            };
        }
        use each_kind;
    };
}

kinds!(
    /// Ball joint, 3 rows.
    Spherical,
    /// The angular joint of the paper with scalar bend, up to 5 rows.
    Paper,
    /// Cable joint with two bend directions, up to 6 rows.
    Cosserat,
    /// All six relative coordinates, 6 rows.
    Lock,
    /// Link of a particle chain, 1 row, or 3 with the transverse ones.
    Distance,
    /// Rotation about one axis, 5 rows, or 6 with a motor.
    Hinge,
    /// Translation along one axis, 5 rows, or 6 with a motor.
    Slider,
    /// Total length through any number of points, 1 row.
    MasslessCable,
    /// Angle between two links that share a point, 1 or 2 rows.
    LinkBend,
    /// Where a cable of segments leaves its winch, 3 rows, or up to 6 clamped.
    Fairlead,
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
        let parts = each_kind!(self, own => own.parts());
        let present = |(kind, rows, law): (_, _, Option<_>)| Some((kind, rows, law?));
        parts.into_iter().filter_map(present)
    }

    /// The frames of the sides, in order: a and b of a joint.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        each_kind!(self, own => &own.frames)
    }

    /// The frames, to be changed; the bodies that they name are part of the topology.
    pub fn frames_mut(&mut self) -> &mut [Frame] {
        each_kind!(self, own => &mut own.frames)
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

    /// Writes φ at time `t` into `phi` (length [`Constraint::rows`]). Allocates: no.
    ///
    /// # Panics
    /// When `phi` is too short or a frame names a body that is not there.
    pub fn violation(&self, bodies: &Bodies, t: f64, phi: &mut [f64]) {
        self.evaluate(bodies, t, &mut Rows::new(phi, &mut [], &mut []));
    }

    /// Writes φ, the Jacobian blocks and the lever arms.
    pub(crate) fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        each_kind!(self, own => own.evaluate(bodies, t, rows));
    }

    /// The massless cable that it is.
    #[must_use]
    pub fn massless_cable(&self) -> Option<&MasslessCable> {
        match self {
            Self::MasslessCable(cable) => Some(cable),
            _ => None,
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
            self.drive_points(bodies, [t, t_next], phi_t);
        }
        if let (Some(motor), Some(last)) = (self.motor(), phi_t.last_mut()) {
            *last += motor.drive();
        }
    }

    /// Gives the rows of a cable joint other laws.
    pub(crate) fn set_law(&mut self, law: &JointLaw) {
        if let Self::Spherical(joint) = self {
            joint.stretch = law.stretch.unwrap_or(joint.stretch);
        }
        if let Some((own, _)) = self.cable_joint_mut() {
            own.stretch = own.stretch.and(law.stretch);
            own.bend = own.bend.and(law.bend);
            own.twist = own.twist.and(law.twist);
        }
    }

    /// Twist of a cable joint as it was last unwrapped \[rad]; `None` where it measures none.
    pub(crate) fn twist_reference(&self) -> Option<f64> {
        let (law, twist) = self.cable_joint()?;
        law.twist.map(|_| twist)
    }

    /// Sets what the twist of a cable joint is unwrapped against \[rad].
    #[inline]
    pub(crate) fn set_twist_reference(&mut self, twist: f64) {
        if let Some((_, reference)) = self.cable_joint_mut() {
            *reference = twist;
        }
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
