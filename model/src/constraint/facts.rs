//! Facts of a kind of constraint, told in the kind's own file: what is asked of any. Code that names a kind to treat it apart
//! is counted, file by file, in `tests/structure/kinds.rs`.

use nalgebra::Vector3;

use super::{JointLaw, MAX_ROWS, Motor, RowKind, RowLaw, Rows, Winch};
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

/// Facts of a kind. A new kind states `parts` and `evaluate`, and of the others what differs from the defaults,
/// which are those of a joint whose first three rows are the gap of its two points. One that pulls along the line between its
/// points states `link_length`, `gap_ahead` and `only_pulls` besides.
pub(crate) trait Facts: Sides {
    /// The rows in their order.
    fn parts(&self) -> Parts;

    /// Writes φ, the Jacobian blocks and the lever arms.
    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>);

    /// True if a force acts at points, so that J changes as the [levers](crate::Linearized::lever) turn: by default where a row
    /// measures a gap.
    fn acts_at_points(&self) -> bool {
        let mut parts = self.parts().into_iter();
        parts.any(|(kind, _, law)| kind.is_gap() && law.is_some())
    }

    /// True if on side number `_side` it only pulls at the point, so that at the centre of a point mass it turns nothing.
    fn only_pulls(&self, _side: usize) -> bool {
        false
    }

    /// See [`Constraint::link_length`](super::Constraint::link_length).
    fn link_length(&self) -> Option<f64> {
        None
    }

    /// See [`Constraint::span_length`](super::Constraint::span_length).
    fn span_length(&self) -> Option<f64> {
        self.link_length()
    }

    /// See [`Constraint::gap_ahead`](super::Constraint::gap_ahead).
    fn gap_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> ([f64; 3], usize) {
        if !begins_with_gap(&self.parts()) {
            return ([0.0; 3], 0);
        }
        (gap_between(self.frames(), bodies, t, dt).into(), 3)
    }

    /// Writes the part of ∂φ/∂t that comes from moved world sides and winches, as the mean over the time between `times`; asked
    /// where a force acts at points. By default world sides alone move the rows, and all rows have a φ that tells.
    fn drive_points(&self, bodies: &Bodies, times: [f64; 2], phi_t: &mut [f64]) {
        if !begins_with_gap(&self.parts()) {
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
    fn motor(&self) -> Option<&Motor> {
        None
    }

    /// The motor of the joint, to be set.
    fn motor_mut(&mut self) -> Option<&mut Motor> {
        None
    }

    /// The winch of the cable.
    fn winch(&self) -> Option<&Winch> {
        None
    }

    /// The winch, to be set at time `t` (s), and the length off its drum then \[m].
    fn winch_mut(&mut self, _t: f64) -> Option<(&mut Winch, f64)> {
        None
    }

    /// Stalls the winch at its empty drum under this tension (N) at time `t` (s), or lets it haul in again. Returns true on a
    /// change.
    fn stall(&mut self, _tension: f64, _t: f64) -> bool {
        false
    }

    /// Length at rest at time `t` (s) of a cable \[m].
    fn length_at(&self, _t: f64) -> Option<f64> {
        None
    }

    /// The row that has bounds, and the bounds of its λ at time `t` (s): those of a motor in the last row.
    fn bounds(&self, _t: f64) -> Option<(usize, f64, f64)> {
        let limit = self.motor()?.force_limit;
        let present = self.parts().into_iter().filter(|(.., law)| law.is_some());
        let rows: usize = present.map(|(_, rows, _)| rows).sum();
        Some((rows - 1, -limit, limit))
    }

    /// Factor of the rows' compliances at time `t` (s); see [`Constraint`](super::Constraint).
    fn compliance_factor(&self, _t: f64, _excess: f64) -> f64 {
        1.0
    }

    /// Laws of the rows of a joint of a cable of segments, and the twist as it was last unwrapped \[rad].
    fn cable_joint(&self) -> Option<(&JointLaw, f64)> {
        None
    }

    /// [`cable_joint`](Self::cable_joint), to be set.
    fn cable_joint_mut(&mut self) -> Option<(&mut JointLaw, &mut f64)> {
        None
    }

    /// Moves the reference of an angle to its value at time `t` (s), and where a cable touches its sheaves. Returns true if
    /// the rows are evaluated otherwise after that.
    fn update_winding(&mut self, _bodies: &Bodies, _t: f64) -> bool {
        false
    }

    /// Checks the numbers that are the kind's own; `what` names it.
    fn validate(&self, what: &dyn Fn() -> String) -> Result<(), SceneError> {
        self.motor().map_or(Ok(()), |motor| motor.validate(what))
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

fn begins_with_gap(parts: &Parts) -> bool {
    matches!(parts[0], (RowKind::Stretch, _, Some(_)))
}

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
