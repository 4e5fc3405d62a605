//! Loads of a constraint, from the multipliers λ of its rows: a force and a torque on each side,
//! and its tension, bending, twist and drive.
//!
//! **Wrench.** The rows work on the sides with the power λ·J v, so that they act on a side with Jᵀ λ = \[F; M_c], a
//! force and a torque about the centre x that its velocities v are of. F at the attachment point x + r alone would have
//! the torque r × F about x. What it leaves is the torque about the attachment point,
//!
//!   M = M_c − r × F.
//!
//! The world is a side like others: its centre is the origin and r its point.

use nalgebra::Vector3;

use super::{Constraint, JointLaw, MAX_ROWS, RowKind, Rows};
use crate::body::Bodies;
use crate::frame::Frame;

/// A force at a point and a torque about it, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// The force \[N].
    pub force: Vector3<f64>,
    /// The torque \[N m].
    pub torque: Vector3<f64>,
}

impl Wrench {
    /// Jᵀ λ of a block of the Jacobian ([`Block::rows`](crate::Block::rows)) and the multipliers `lambda` of its rows
    /// \[N, N m]: at the centre of the body.
    #[inline]
    #[must_use]
    pub fn of_rows(rows: &[[f64; 6]], lambda: &[f64]) -> Self {
        let mut wrench = Self::default();
        for (j, lambda) in rows.iter().zip(lambda) {
            wrench.force += Vector3::new(j[0], j[1], j[2]) * *lambda;
            wrench.torque += Vector3::new(j[3], j[4], j[5]) * *lambda;
        }
        wrench
    }
}

/// Loads of a constraint in the terms of its kind; `None` for a load that the kind does not have.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Loads {
    /// Tension \[N]: see [`Scene::loads`](crate::Scene::loads).
    pub tension: Option<f64>,
    /// Bending moment, ≥ 0 \[N m]: the norm of the bend rows of a cable joint or of the bending of links, of the tilt
    /// rows of a hinge.
    pub bending: Option<f64>,
    /// Twisting moment of a cable joint \[N m]: positive where b is turned further about u than a.
    pub twist: Option<f64>,
    /// Force \[N] or torque \[N m] of the motor of a slider or hinge, positive where it drives b ahead along or about u
    /// of a; tension of a cable \[N], which its winch holds.
    pub drive: Option<f64>,
}

impl Constraint {
    /// Force and torque of the multipliers `lambda` (one a row, N and N m) on side number `side`, an index into
    /// [`Constraint::frames`], at its attachment point, with the bodies where they are at time `t` (s). A side may be held
    /// by the world or by a static body. `None` where there is no such side. Allocates: no.
    ///
    /// # Panics
    /// When a frame names a body that is not there.
    #[must_use]
    pub fn wrench(&self, bodies: &Bodies, t: f64, lambda: &[f64], side: usize) -> Option<Wrench> {
        let lever = self.frames().get(side)?.resolve(bodies, t).lever;
        let (mut phi, mut block) = ([0.0; MAX_ROWS], [[0.0; 6]; MAX_ROWS]);
        let phi = &mut phi[..self.rows()];
        let mut rows = Rows::of_side(side, phi, block.as_flattened_mut());
        self.evaluate(bodies, t, &mut rows);
        let Wrench { force, torque } = Wrench::of_rows(&block[..self.rows()], lambda);
        let torque = torque - lever.cross(&force);
        Some(Wrench { force, torque })
    }

    /// Loads with the multipliers `lambda` (one a row, N and N m) and the bodies where they are at time `t` (s), as of a joint of
    /// the cable with these `segments`.
    pub(crate) fn loads(
        &self,
        segments: &[usize],
        bodies: &Bodies,
        t: f64,
        lambda: &[f64],
    ) -> Loads {
        let mut loads = Loads {
            tension: self.tension(segments, bodies, t, lambda),
            ..Loads::default()
        };
        let mut rest = lambda;
        for (kind, rows, _) in self.parts() {
            let (part, after) = rest.split_at(rows);
            rest = after;
            let first = part.first().copied();
            match kind {
                RowKind::Bend => {
                    loads.bending = Some(part.iter().fold(0.0, |norm: f64, x| norm.hypot(*x)));
                }
                // A joint resists its angle: not −0 where that is zero.
                RowKind::Twist => loads.twist = first.map(|moment| 0.0 - moment),
                RowKind::Position | RowKind::Angle | RowKind::Speed => loads.drive = first,
                RowKind::Stretch | RowKind::Rotation | RowKind::Length => {}
                RowKind::Across | RowKind::Transverse => {}
            }
        }
        if self.winch().is_some() {
            loads.drive = loads.tension;
        }
        loads
    }

    /// The tension among the [loads](Self::loads) \[N].
    fn tension(&self, segments: &[usize], bodies: &Bodies, t: f64, lambda: &[f64]) -> Option<f64> {
        let force = || Vector3::from_column_slice(&lambda[..3]);
        let free = || {
            let (force, along) = (force(), self.along_cable(segments, bodies, t));
            along.map_or_else(|| force.norm(), |along| force.dot(&along))
        };
        let of_law = |law: &JointLaw| {
            law.stretch?;
            let axes = self.frames().iter().map(|f| f.resolve(bodies, t).u());
            let axis = axes.sum::<Vector3<f64>>();
            // Axes that point at each other have no mean.
            let Some(axis) = axis.try_normalize(1e-9).filter(|_| law.bend.is_some()) else {
                return Some(free());
            };
            let along = self.along_cable(segments, bodies, t);
            let backwards = along.is_some_and(|along| along.dot(&axis) < 0.0);
            let tension = force().dot(&axis);
            Some(if backwards { -tension } else { tension })
        };
        let first = self.parts().next().map(|(kind, ..)| kind);
        match (self, self.cable_joint()) {
            (Self::Spherical(_), _) => Some(free()),
            (Self::Fairlead(_), _) => Some(0.0 - lambda[0]),
            (_, Some((law, _))) => of_law(law),
            // Not −0 where it is slack.
            _ => (first == Some(RowKind::Length)).then(|| 0.0 - lambda[0]),
        }
    }

    /// Unit vector from side a to side b along the cable with these segments: the axis of the segment that the joint holds,
    /// or the mean of both; `None` where it holds none. A segment reaches from its centre to the joint, so that the order
    /// of the sides and the axes of their frames do not matter.
    fn along_cable(&self, segments: &[usize], bodies: &Bodies, t: f64) -> Option<Vector3<f64>> {
        if segments.is_empty() {
            return None;
        }
        // Numbers ascend but for cables that were listed otherwise.
        let is_segment =
            |body: &usize| segments.binary_search(body).is_ok() || segments.contains(body);
        let out = |(frame, sign): (&Frame, f64)| {
            frame.body_index().filter(is_segment)?;
            let lever = frame.resolve(bodies, t).lever;
            Some(lever.try_normalize(0.0)? * sign)
        };
        let sides = || self.frames().iter().zip([1.0, -1.0]).filter_map(out);
        let mean = sides().sum::<Vector3<f64>>().try_normalize(1e-9);
        // Segments that are folded onto each other have no mean.
        mean.or_else(|| sides().next())
    }
}

#[cfg(test)]
mod tests {
    use crate::constraint::samples;
    use crate::constraint::testing::{Poses, bent};
    use crate::testing::*;

    const LAMBDA: [f64; 6] = [-3.0, 5.0, 2.0, 7.0, -4.0, 1.5];

    /// One of each kind with two sides.
    fn joints(frames: [Frame; 2]) -> Vec<Constraint> {
        let mut all = samples(frames);
        all.retain(|c| c.frames().len() == 2);
        all
    }

    /// How many these are.
    fn kinds() -> usize {
        joints([Frame::world(Vector3::zeros()); 2]).len()
    }

    /// A scene with a joint of number `kind` at a random pose.
    fn pair(kind: usize) -> Scene {
        let mut poses = Poses::new(3 + kind as u64);
        let relative = bent(0.4, &poses.across(), 0.7);
        poses.pair(&relative, |frames| joints(frames).swap_remove(kind))
    }

    fn wrench(scene: &Scene, side: usize) -> Wrench {
        let c = &scene.constraints[0];
        c.wrench(&scene.bodies, 0.0, &LAMBDA, side).expect("a side")
    }

    #[test]
    fn the_sides_of_a_joint_balance_each_other() {
        for kind in 0..kinds() {
            let mut scene = pair(kind);
            if !matches!(scene.constraints[0], Constraint::Slider(_)) {
                // Open, it has the couple of a force across the gap.
                let points = [0, 1].map(|k: usize| {
                    let frame = scene.constraints[0].frames()[k];
                    frame.resolve(&scene.bodies, 0.0).point()
                });
                scene.bodies.position[1] += points[0] - points[1];
            }
            let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
            for (side, frame) in scene.constraints[0].frames().iter().enumerate() {
                let on = wrench(&scene, side);
                assert!(on.force.norm() > 1.0);
                force += on.force;
                torque += on.torque + frame.resolve(&scene.bodies, 0.0).point().cross(&on.force);
            }
            assert!(force.norm() < 1e-13, "{kind}: {force}");
            assert!(torque.norm() < 1e-12, "{kind}: {torque}");
            let c = &scene.constraints[0];
            assert_eq!(c.wrench(&scene.bodies, 0.0, &LAMBDA, 2), None);
        }
    }

    #[test]
    fn the_world_bears_what_a_static_body_in_its_place_would() {
        for (kind, side) in (0..kinds()).flat_map(|kind| [(kind, 0), (kind, 1)]) {
            let mut scene = pair(kind);
            scene.bodies.mobility[side] = Mobility::Static;
            let on_body = [0, 1].map(|k| wrench(&scene, k));
            let held = scene.constraints[0].frames()[side].resolve(&scene.bodies, 0.0);
            let world = Frame::world(held.point()).with_axes(held.axes);
            scene.constraints[0].frames_mut()[side] = world;
            for (k, expected) in on_body.into_iter().enumerate() {
                let found = wrench(&scene, k);
                assert!((found.force - expected.force).norm() < 1e-12, "{kind} {k}");
                let off = (found.torque - expected.torque).norm();
                assert!(off < 1e-12, "{kind} {k}");
            }
        }
    }

    #[test]
    fn a_ball_joint_has_no_torque_about_its_point_and_its_multipliers_pull_on_a() {
        let scene = pair(0);
        let force = Vector3::from_column_slice(&LAMBDA[..3]);
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let on = wrench(&scene, side);
            assert!((on.force - force * sign).norm() < 1e-15);
            assert!(on.torque.norm() < 1e-14, "{on:?}");
        }
    }

    #[test]
    fn a_cable_pulls_each_of_its_points_along_its_spans() {
        let mut scene = Scene::new("reeved");
        let sheave = Body::sphere(1.0, 1.0).at(Vector3::new(0.3, -0.2, -2.0));
        scene.add_body("sheave", sheave);
        let frames = vec![
            Frame::world(Vector3::new(-1.0, 0.0, 0.5)),
            Frame::body(0, Vector3::new(0.0, 0.4, 0.1)),
            Frame::world(Vector3::new(2.0, 1.0, 0.0)),
        ];
        let points = [0, 1, 2].map(|k: usize| frames[k].resolve(&scene.bodies, 0.0).point());
        let cable =
            MasslessCable::new(frames, 1.0, RowLaw::RIGID).with(|p| p.winch = Some(Winch::new()));
        let cable = Constraint::MasslessCable(cable);
        let tension = 1250.0;
        let [n1, n2] = [0, 1].map(|k| (points[k] - points[k + 1]).normalize());
        let expected = [n1 * -tension, (n1 - n2) * tension, n2 * tension];
        for (side, expected) in expected.into_iter().enumerate() {
            let on = cable.wrench(&scene.bodies, 0.0, &[-tension], side);
            let Wrench { force, torque } = on.expect("a side");
            assert!((force - expected).norm() < 1e-12, "{side}: {force}");
            assert!(torque.norm() < 1e-12, "{side}: {torque}");
        }
        let loads = cable.loads(&[], &scene.bodies, 0.0, &[-tension]);
        assert_eq!((loads.tension, loads.drive), (Some(tension), Some(tension)));
        assert_eq!((loads.bending, loads.twist), (None, None));
    }

    #[test]
    fn loads_are_those_that_the_kind_has() {
        let norm = 7.0_f64.hypot(-4.0);
        for kind in 0..kinds() {
            let scene = pair(kind);
            let c = &scene.constraints[0];
            let (bending, twist, drive) = match c {
                Constraint::Cosserat(_) => (Some(norm), Some(-1.5), None),
                Constraint::Paper(_) => (Some(7.0), Some(4.0), None),
                Constraint::Hinge(_) => (Some(norm), None, Some(1.5)),
                Constraint::Slider(_) => (None, None, Some(1.5)),
                // Row 0 pulls at its winch.
                Constraint::Fairlead(_) => (Some(norm), Some(-1.5), Some(3.0)),
                _ => (None, None, None),
            };
            let expected = Loads {
                tension: c.tension(&[], &scene.bodies, 0.0, &LAMBDA),
                bending,
                twist,
                drive,
            };
            let loads = c.loads(&[], &scene.bodies, 0.0, &LAMBDA);
            assert_eq!(loads, expected, "{c:?}");
        }
    }

    #[test]
    fn a_positive_twist_carries_a_positive_moment() {
        let law = RowLaw::new(0.5, 0.0);
        let law = JointLaw::default().with(|p| p.twist = Some(law));
        let turn = bent(0.0, &Vector3::y(), 0.25);
        let joint = |frames| Constraint::Cosserat(Cosserat::new(frames, law));
        let scene = Poses::new(5).pair(&turn, joint);
        let c = &scene.constraints[0];
        let lambda = [-crate::constraint::testing::phi(&scene)[0] / 0.5];
        let moment = c.loads(&[], &scene.bodies, 0.0, &lambda).twist;
        assert!((moment.expect("a twist row") - 0.5).abs() < 1e-12);
        // The torque on b is back towards a.
        let u = c.frames()[1].resolve(&scene.bodies, 0.0).u();
        let on_b = c.wrench(&scene.bodies, 0.0, &lambda, 1).expect("b");
        assert!((on_b.torque + u * 0.5).norm() < 1e-12);
    }

    /// A joint that bends has its tension along the mean of its axes, and one bent freely the size of its force.
    #[test]
    fn a_bent_joint_pulls_along_its_mean_axis() {
        let mut scene = Scene::new("bent");
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.4);
        scene.add_body("rod", Body::rod(1.0, 0.1, 1.0).turned(turn));
        let frames = [origin(), centre(0)];
        let law = |bend| JointLaw {
            stretch: Some(RowLaw::RIGID),
            bend,
            twist: None,
        };
        let bent = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.2) * -Vector3::z();
        let lambda: [f64; 5] = [-8.0 * bent.x, 0.0, -8.0 * bent.z, 0.0, 0.0];
        let stiff = Constraint::Cosserat(Cosserat::new(frames, law(Some(RowLaw::RIGID))));
        let free = Constraint::Cosserat(Cosserat::new(frames, law(None)));
        let tension = |c: &Constraint| c.tension(&[], &scene.bodies, 0.0, &lambda);
        assert!((tension(&stiff).expect("a cable") + 8.0).abs() < 1e-14);
        assert!((tension(&free).expect("a cable") - 8.0).abs() < 1e-14);
        let none = Constraint::Cosserat(Cosserat::new(frames, JointLaw::default()));
        assert_eq!(tension(&none), None);
    }
}
