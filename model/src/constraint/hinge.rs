//! Hinge: turns about one axis, with a motor if wanted.
//!
//! The gap rows are those of the ball joint; the tilt rows are the two bend rows of the Cosserat joint with the hinge's
//! axis in place of the cable's, so that they are smooth and cost an energy of ½ θ²/ε for a tilt θ in any direction; the
//! motor's coordinate is its twist angle, which goes on through any number of turns (derivations: `cosserat`).
//!
//! 5 rows, or 6. The axis is u of both frames. Singular where the axes point in opposite directions.

use super::cosserat::{BendTwist, columns};
use super::facts::{Facts, NO_ROWS, Parts, driven};
use super::{Motor, RowKind, RowLaw, Rows, Target};
use crate::body::Bodies;
use crate::frame::Frame;

/// A hinge about u of both frames: 3 gap rows, 2 tilt rows, and the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hinge {
    /// The two attachment frames.
    pub frames: [Frame; 2],
    /// Law of the gap rows, compliance in m/N.
    pub stretch: RowLaw,
    /// Law of the tilt rows, compliance in rad/(N m).
    pub tilt: RowLaw,
    /// Drives the angle of b against a about u \[rad].
    pub motor: Option<Motor>,
    /// Angle with its winding at the last step \[rad]: the value that the motor's angle unwraps to.
    pub angle_reference: f64,
}

impl Hinge {
    /// A rigid hinge without motor.
    #[must_use]
    pub fn new(frames: [Frame; 2]) -> Self {
        Self {
            frames,
            stretch: RowLaw::RIGID,
            tilt: RowLaw::RIGID,
            motor: None,
            angle_reference: 0.0,
        }
    }

    /// Adds a motor.
    #[must_use]
    pub fn driven(mut self, motor: Motor) -> Self {
        self.motor = Some(motor);
        self
    }

    /// Rate at which the angle turns that the motor holds \[rad/s]; 0 where it holds none.
    #[must_use]
    pub fn turn(&self, bodies: &Bodies) -> f64 {
        let holds = |motor: &Motor| matches!(motor.target, Target::Position(_));
        if !self.motor.as_ref().is_some_and(holds) {
            return 0.0;
        }
        let rate = |frame: &Frame| {
            let of = frame.body_index().map(|i| bodies.angular_velocity[i]);
            of.unwrap_or_default()
        };
        (rate(&self.frames[1]) - rate(&self.frames[0])).norm()
    }
}

impl Facts for Hinge {
    fn parts(&self) -> Parts {
        [
            (RowKind::Stretch, 3, Some(self.stretch)),
            (RowKind::Bend, 2, Some(self.tilt)),
            self.motor.map_or(NO_ROWS, |motor| motor.part(true)),
        ]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        rows.stretch(&a, &b);
        let angles = BendTwist::of_frames(&a, &b, self.angle_reference);
        let [about_v, about_w, turn] = angles.gradients(&columns(&a.axes));
        let [tilt_v, tilt_w, angle] = angles.angles;
        rows.angular(tilt_v, &about_v.into());
        rows.angular(tilt_w, &about_w.into());
        if let Some(motor) = &self.motor {
            rows.angular(motor.violation(angle), &turn.into());
        }
    }

    driven!();

    fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        let [a, b] = self.frames.map(|frame| frame.resolve(bodies, t));
        self.angle_reference = BendTwist::of_frames(&a, &b, self.angle_reference).angles[2];
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Constraint;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, bent};

    use crate::{Linearized, RowLaw};

    impl Sample for Hinge {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                stretch: LAW,
                tilt: LAW,
                motor: Some(holds(Target::Position(0.4))),
                ..Self::new(frames)
            }
        }
    }

    fn hinge(motor: Option<Motor>) -> impl Fn([Frame; 2]) -> Constraint {
        move |frames| {
            Constraint::Hinge(Hinge {
                motor,
                ..Hinge::sample(frames)
            })
        }
    }

    fn holds(target: Target) -> Motor {
        Motor {
            target,
            force_limit: 5.0,
            law: LAW,
        }
    }

    #[test]
    fn jacobian_at_random_poses() {
        let relative = |p: &mut Poses| bent(0.3 * p.number(), &p.across(), 3.0 * p.number());
        assert_rows("hinge", relative, hinge(None));
        let motor = holds(Target::Position(0.4));
        assert_rows("hinge with motor", relative, hinge(Some(motor)));
    }

    #[test]
    fn a_speed_motor_has_a_rate_and_no_violation() {
        let mut poses = Poses::new(4);
        let relative = bent(0.1, &nalgebra::Vector3::y(), 1.0);
        let scene = poses.pair(&relative, hinge(Some(holds(Target::Speed(1.5)))));
        let mut lin = Linearized::at(&scene, 0.0);
        lin.drive(&scene, 0.0, 0.1);
        assert_eq!((lin.phi[5], lin.phi_t[5]), (0.0, -1.5));
        assert!(lin.phi_t[..5].iter().all(|rate| *rate == 0.0));
        let row = scene.constraints[0].row(5);
        assert_eq!(row, (RowKind::Speed, RowLaw::RIGID));
        assert_eq!(lin.bounds[0].row, 5);
        assert_eq!((lin.bounds[0].lower, lin.bounds[0].upper), (-5.0, 5.0));
    }
}
