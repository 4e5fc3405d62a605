//! Facts of a kind of constraint, stated in the kind's own file: what is asked of any. Code that names a kind to treat it apart
//! is counted, file by file, in `tests/structure/kinds.rs`.

use nalgebra::Vector3;

use super::{Constraint, JointLaw, MAX_ROWS, Motor, RowKind, RowLaw, Rows, Winch, each_kind};
use crate::body::Bodies;
use crate::error::SceneError;
use crate::frame::Frame;

/// Rows of a constraint in their order, as (kind, number of rows, law); no law, no row.
pub(crate) type Parts = [(RowKind, usize, Option<RowLaw>); 3];

/// No part.
pub(super) const NO_ROWS: (RowKind, usize, Option<RowLaw>) = (RowKind::Speed, 0, None);

/// The sides of a constraint.
pub(crate) trait Sides {
    /// Their frames, in order.
    fn frames(&self) -> &[Frame];
}

/// The facts that are asked and those that are set, with their defaults: functions of the trait, and of
/// [`Constraint`], which asks its kind.
macro_rules! facts {
    (
        asked {
            $(
                $(#[$attribute:meta])*
                $vis:vis fn $asked:ident(&$own:ident $(, $argument:ident: $type:ty)*) $(-> $found:ty)? $default:block
            )*
        }
        set {
            $(
                $(#[$attribute_set:meta])*
                $vis_set:vis fn $set:ident(&mut $own_set:ident $(, $argument_set:ident: $type_set:ty)*) -> $found_set:ty
                    $default_set:block
            )*
        }
    ) => {
        /// Facts of a kind. A new kind states `parts` and `evaluate`, and of the others what differs from the defaults,
        /// which are those of a joint whose first three rows are the gap of its two points. One that pulls along the line between
        /// its points states `link_length`, `gap_ahead` and `only_pulls` besides.
        #[allow(unused_variables, reason = "defaults are the same whatever they are asked")]
        pub(crate) trait Facts: Sides {
            /// The rows in their order.
            fn parts(&self) -> Parts;

            /// Writes φ, the Jacobian blocks and the lever arms.
            fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>);

            $(
                $(#[$attribute])*
                fn $asked(&$own $(, $argument: $type)*) $(-> $found)? $default
            )*
            $(
                $(#[$attribute_set])*
                fn $set(&mut $own_set $(, $argument_set: $type_set)*) -> $found_set $default_set
            )*
        }

        impl Constraint {
            $(
                $(#[$attribute])*
                $vis fn $asked(&$own $(, $argument: $type)*) $(-> $found)? {
                    each_kind!($own, kind => Facts::$asked(kind $(, $argument)*))
                }
            )*
            $(
                $(#[$attribute_set])*
                $vis_set fn $set(&mut $own_set $(, $argument_set: $type_set)*) -> $found_set {
                    each_kind!($own_set, kind => Facts::$set(kind $(, $argument_set)*))
                }
            )*
        }
    };
}

facts! {
    asked {
        /// True if the first three rows are the gap between the attachment points (a minus b).
        #[must_use]
        pub fn has_stretch_rows(&self) -> bool {
            matches!(self.parts()[0], (RowKind::Stretch, _, Some(_)))
        }

        /// True if a force acts at points, so that the Jacobian changes as the [levers](crate::Linearized::lever) turn: by default
        /// where a row measures a gap.
        pub(crate) fn acts_at_points(&self) -> bool {
            let mut parts = self.parts().into_iter();
            parts.any(|(kind, _, law)| kind.is_gap() && law.is_some())
        }

        /// True if on side number `side` it only pulls at the point, so that at the centre of a point mass it turns nothing.
        pub(crate) fn only_pulls(&self, side: usize) -> bool {
            false
        }

        /// Length at rest of what pulls along the lines between its points, such as a rod or a massless cable \[m]: its first row is
        /// that of the length, with λ < 0 where it is taut. `None` of a joint, whose points meet.
        #[must_use]
        pub fn link_length(&self) -> Option<f64> {
            None
        }

        /// Length of a span of it, what turns as one piece \[m]; the mean where there are several, of what is off the drums.
        #[must_use]
        pub fn span_length(&self) -> Option<f64> {
            self.link_length()
        }

        /// φ of the leading rows at time `t` + `dt` (s) if its bodies go on freely from their velocities at `t` \[m], and how many they
        /// are: one, the length, of what has a [`link_length`](Self::link_length); three, the gap, of a joint that begins with rows of
        /// stretch; none of others. What these rows are off their tangent by is the curve that a time stepper's dampers follow and that
        /// drifts within its steps.
        #[must_use]
        pub fn gap_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> ([f64; 3], usize) {
            if !self.has_stretch_rows() {
                return ([0.0; 3], 0);
            }
            (gap_between(self.frames(), bodies, t, dt).into(), 3)
        }

        /// Writes the part of ∂φ/∂t that comes from moved world sides and winches, as the mean over the time between `times`; asked
        /// where a force acts at points. By default world sides alone move the rows, and all rows have a φ that tells.
        pub(crate) fn drive_points(&self, bodies: &Bodies, times: [f64; 2], phi_t: &mut [f64]) {
            if !self.has_stretch_rows() {
                if any_moves(self.frames(), times) {
                    difference(self, bodies, times, phi_t);
                }
                return;
            }
            let sides = self.frames().iter().zip([1.0, -1.0]);
            let change: Vector3<f64> = sides.map(|(f, sign)| moved(f, times) * sign).sum();
            phi_t[..3].copy_from_slice((change / (times[1] - times[0])).as_slice());
        }

        /// The motor of the joint.
        #[must_use]
        pub fn motor(&self) -> Option<&Motor> {
            None
        }

        /// The winch of a massless cable, or of a cable of segments at its fairlead.
        #[must_use]
        pub fn winch(&self) -> Option<&Winch> {
            None
        }

        /// Length at rest at time `t` (s) of a massless cable, or off the drum of a cable of segments \[m].
        #[must_use]
        pub fn length_at(&self, t: f64) -> Option<f64> {
            None
        }

        /// The row that has bounds, if there is one, and the bounds of its λ at time `t` (s), lower and upper \[N or N m];
        /// infinite stands for none. By default those of a motor in the last row.
        #[must_use]
        pub fn bounds(&self, t: f64) -> Option<(usize, f64, f64)> {
            let limit = self.motor()?.force_limit;
            let present = self.parts().into_iter().filter(|(.., law)| law.is_some());
            let rows: usize = present.map(|(_, rows, _)| rows).sum();
            Some((rows - 1, -limit, limit))
        }

        /// Factor of the rows' compliances at time `t` (s). `excess` is the length of a cable beyond
        /// its length at rest \[m].
        pub(crate) fn compliance_factor(&self, t: f64, excess: f64) -> f64 {
            1.0
        }

        /// Laws of the rows of a joint of a cable of segments, and the twist as it was last unwrapped \[rad].
        pub(crate) fn cable_joint(&self) -> Option<(&JointLaw, f64)> {
            None
        }

        /// Checks the numbers that are the kind's own; `what` names it.
        pub(crate) fn validate(&self, what: &dyn Fn() -> String) -> Result<(), SceneError> {
            self.motor().map_or(Ok(()), |motor| motor.validate(what))
        }
    }
    set {
        /// The motor of the joint, to be set; whether there is one is part of the topology.
        pub fn motor_mut(&mut self) -> Option<&mut Motor> {
            None
        }

        /// The winch, to be set at time `t` (s), and the length off its drum then \[m]; that of a cable of segments has been
        /// [cut](crate::Scene::cut_at_winch) to it.
        pub fn winch_mut(&mut self, t: f64) -> Option<(&mut Winch, f64)> {
            None
        }

        /// Stalls the winch at its empty drum under this tension (N) at time `t` (s), or lets it haul in again; that of a cable of
        /// segments has been [cut](crate::Scene::cut_at_winch) to its length then. Returns true on a change.
        pub fn stall(&mut self, tension: f64, t: f64) -> bool {
            false
        }

        /// [`cable_joint`](Self::cable_joint), to be set.
        #[inline]
        pub(crate) fn cable_joint_mut(&mut self) -> Option<(&mut JointLaw, &mut f64)> {
            None
        }

        /// Moves the unwrapping reference of a twist or hinge angle to its value at time `t` (s), and where a cable touches its
        /// sheaves. Returns true if the rows are evaluated otherwise after that.
        pub(crate) fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
            false
        }
    }
}

/// Facts of a joint with the field `motor`.
macro_rules! driven {
    () => {
        fn motor(&self) -> Option<&Motor> {
            self.motor.as_ref()
        }

        fn motor_mut(&mut self) -> Option<&mut Motor> {
            self.motor.as_mut()
        }
    };
}
pub(super) use driven;

/// Facts of a joint of cable, with the fields `law` and `twist_reference`.
macro_rules! of_cable {
    () => {
        fn cable_joint(&self) -> Option<(&JointLaw, f64)> {
            Some((&self.law, self.twist_reference))
        }

        fn cable_joint_mut(&mut self) -> Option<(&mut JointLaw, &mut f64)> {
            Some((&mut self.law, &mut self.twist_reference))
        }
    };
}
pub(super) use of_cable;

/// Way of a point of the world between two times \[m].
pub(super) fn moved(frame: &Frame, [t, t_next]: [f64; 2]) -> Vector3<f64> {
    frame.displacement(t_next) - frame.displacement(t)
}

/// True if a point of the world moves between two times.
pub(super) fn any_moves(frames: &[Frame], times: [f64; 2]) -> bool {
    (frames.iter()).any(|frame| moved(frame, times) != Vector3::zeros())
}

/// p_a − p_b at time `t` + `dt`, if the bodies go on freely from their velocities at `t` \[m].
pub(super) fn gap_between(frames: &[Frame], bodies: &Bodies, t: f64, dt: f64) -> Vector3<f64> {
    let [a, b] = [0, 1].map(|side| frames[side].resolve_ahead(bodies, t, dt));
    super::gap(&a, &b)
}

/// (φ(t′) − φ(t))/(t′ − t) with the bodies held, for the times t, t′.
pub(super) fn difference(
    kind: &(impl Facts + ?Sized),
    bodies: &Bodies,
    [t, t_next]: [f64; 2],
    rate: &mut [f64],
) {
    let mut before = [0.0; MAX_ROWS];
    let phi = |t, phi: &mut [f64]| kind.evaluate(bodies, t, &mut Rows::new(phi, &mut [], &mut []));
    phi(t, &mut before[..rate.len()]);
    phi(t_next, rate);
    for (rate, before) in rate.iter_mut().zip(before) {
        *rate = (*rate - before) / (t_next - t);
    }
}

#[cfg(test)]
mod tests;
