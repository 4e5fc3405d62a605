//! Slider: b moves along one axis of a without turning, with a motor if wanted.
//!
//! Rows 0–2 are the rotation rows of the lock. With the gap d = p_a − p_b and the directions k ∈ {v_a, w_a} across the
//! axis u_a, rows 3–4 are
//!
//!   φ = k·d,   φ̇ = k·(v_a + ω_a×r_a − v_b − ω_b×r_b) + (ω_a×k)·d
//!
//! so that J_a = \[kᵀ, ((r_a − d)×k)ᵀ], J_b = \[−kᵀ, −(r_b×k)ᵀ]: the force acts on a at b's point, where a guides
//! b: its [lever](crate::Linearized::lever) is r_a − d. The motor's coordinate is s = −u_a·d, how far b's point is ahead of
//! a's along u_a; its row is the same with −u_a for k.
//!
//! 5 rows, or 6.

use super::facts::{Facts, NO_ROWS, Parts, any_moves, difference, driven};
use super::{Motor, RowKind, RowLaw, Rows, Target, gap, lock};
use crate::body::Bodies;
use crate::frame::Frame;

/// A slider along u of side a: 3 rotation rows, 2 rows across, and the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Slider {
    /// The two attachment frames.
    pub frames: [Frame; 2],
    /// Law of the rotation rows, compliance in rad/(N m).
    pub rotation: RowLaw,
    /// Law of the rows across the axis, compliance in m/N.
    pub across: RowLaw,
    /// Drives the distance of b's point ahead of a's along u_a \[m].
    pub motor: Option<Motor>,
}

impl Slider {
    /// A rigid slider without motor.
    #[must_use]
    pub fn new(frames: [Frame; 2]) -> Self {
        Self {
            frames,
            rotation: RowLaw::RIGID,
            across: RowLaw::RIGID,
            motor: None,
        }
    }

    /// Adds a motor.
    #[must_use]
    pub fn driven(mut self, motor: Motor) -> Self {
        self.motor = Some(motor);
        self
    }
}

impl Facts for Slider {
    fn parts(&self) -> Parts {
        [
            (RowKind::Rotation, 3, Some(self.rotation)),
            (RowKind::Across, 2, Some(self.across)),
            self.motor.map_or(NO_ROWS, |motor| motor.part(false)),
        ]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        lock::rotation_rows(&a, &b, rows);
        let d = gap(&a, &b);
        let lever = a.lever - d;
        rows.set_lever(0, lever);
        for k in [a.v(), a.w()] {
            rows.along(k.dot(&d), &k, [&lever, &b.lever]);
        }
        if let Some(motor) = &self.motor {
            let k = -a.u();
            rows.along(motor.violation(k.dot(&d)), &k, [&lever, &b.lever]);
        }
    }

    fn drive_points(&self, bodies: &Bodies, times: [f64; 2], phi_t: &mut [f64]) {
        if any_moves(&self.frames, times) {
            // The row of a speed has no φ that would tell.
            let at = |motor| Motor {
                target: Target::Position(0.0),
                ..motor
            };
            let slider = Self {
                motor: self.motor.map(at),
                ..*self
            };
            difference(&slider, bodies, times, phi_t);
        }
    }

    driven!();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, bent, phi};
    use crate::testing::*;

    impl Sample for Slider {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                rotation: LAW,
                across: LAW,
                motor: Some(Motor {
                    target: Target::Position(0.4),
                    force_limit: 10.0,
                    law: LAW,
                }),
                ..Self::new(frames)
            }
        }
    }

    #[test]
    fn jacobian_at_random_poses() {
        for driven in [false, true] {
            let slider = |frames| {
                let slider = Slider::sample(frames);
                let motor = slider.motor.filter(|_| driven);
                Constraint::Slider(Slider { motor, ..slider })
            };
            let relative = |p: &mut Poses| bent(p.number(), &p.across(), 1.5 * p.number());
            assert_rows("slider", relative, slider);
        }
    }

    /// A trolley 3 m along the beam's x axis, 0.1 m off it.
    fn trolley(target: Target) -> Scene {
        let mut scene = Scene::new("trolley");
        let body = Body::sphere(0.1, 2.0).at(Vector3::new(4.0, 0.1, 0.0));
        let body = scene.add_body("trolley", body);
        let along = crate::axes_along(&Vector3::x()).expect("a direction");
        let world = Frame::world(Vector3::x()).with_axes(along);
        let slider = Slider::new([world, centre(body).with_axes(along)])
            .with(|p| p.motor = Some(Motor::speed(0.0).with(|p| p.target = target)));
        scene.add_constraint("rail", Constraint::Slider(slider), 0);
        scene
    }

    #[test]
    fn the_coordinate_is_the_way_along_the_axis() {
        let phi = phi(&trolley(Target::Position(2.5)));
        assert_eq!(phi[..3], [0.0; 3]);
        assert!((phi[3].hypot(phi[4]) - 0.1).abs() < 1e-15);
        assert!((phi[5] - 0.5).abs() < 1e-15, "{phi:?}");
    }

    #[test]
    fn the_force_of_a_speed_motor_is_along_the_axis() {
        let scene = trolley(Target::Speed(0.5));
        let mut lin = Linearized::at(&scene, 0.0);
        lin.drive(&scene, 0.0, 0.1);
        // A positive multiplier moves b ahead.
        assert_eq!(lin.block(0)[30..33], [1.0, 0.0, 0.0]);
        assert_eq!((lin.phi[5], lin.phi_t[5]), (0.0, -0.5));
        let kinds: Vec<_> = (0..6).map(|r| scene.constraints[0].row(r).0).collect();
        let expected = [RowKind::Rotation; 3].into_iter();
        let expected = expected.chain([RowKind::Across; 2]).chain([RowKind::Speed]);
        assert_eq!(kinds, expected.collect::<Vec<_>>());
    }
}
