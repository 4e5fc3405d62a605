//! What holds of every kind in the list.

use super::*;
use crate::constraint::testing::{Poses, assert_rows, bent, phi};
use crate::constraint::{Constraint, samples};
use crate::{Linearized, Motion, Scene, Wrench};
use nalgebra::{Matrix3, UnitQuaternion};

/// Two bodies at a random pose, one scene a kind, joined by its sample.
fn scenes() -> impl Iterator<Item = (&'static str, Scene)> {
    Constraint::KINDS.iter().enumerate().map(|(k, name)| {
        let mut poses = Poses::new(31 + k as u64);
        let relative = bent(0.4, &poses.across(), 0.7);
        let mut scene = poses.pair(&relative, |frames| samples(frames).swap_remove(k));
        for i in 0..2 {
            scene.bodies.velocity[i] = poses.vector();
            scene.bodies.angular_velocity[i] = poses.vector();
        }
        (*name, scene)
    })
}

/// Turns body `i` by a rotation vector of the world \[rad].
fn turn(scene: &mut Scene, i: usize, by: Vector3<f64>) {
    let at = &mut scene.bodies.orientation[i];
    *at = UnitQuaternion::from_scaled_axis(by) * *at;
}

#[test]
fn jacobians_are_derivatives() {
    for (k, name) in Constraint::KINDS.iter().enumerate() {
        let relative = |p: &mut Poses| bent(0.4 + 0.2 * p.number(), &p.across(), p.number());
        assert_rows(name, relative, |frames| samples(frames).swap_remove(k));
    }
}

#[test]
fn a_kind_that_begins_with_a_length_says_so_and_lengths_and_gaps_are_told_ahead() {
    for (kind, scene) in scenes() {
        let c = &scene.constraints[0];
        let first = c.row(0).0;
        let lengths = [c.link_length(), c.span_length()].map(|length| length.is_some());
        assert_eq!(lengths, [first == RowKind::Length; 2], "{kind}");
        let rows = match first {
            RowKind::Length => 1,
            RowKind::Stretch => 3,
            _ => 0,
        };
        for dt in [0.0, 0.1] {
            let (ahead, count) = c.gap_ahead(&scene.bodies, 0.0, dt);
            let mut later = scene.clone();
            for i in 0..2 {
                later.bodies.position[i] += scene.bodies.velocity[i] * dt;
                turn(&mut later, i, scene.bodies.angular_velocity[i] * dt);
            }
            assert_eq!(count, rows, "{kind}");
            for (ahead, phi) in ahead.iter().zip(phi(&later)).take(count) {
                assert!((ahead - phi).abs() < 1e-13, "{kind}: {ahead} {phi}");
            }
        }
    }
}

#[test]
fn what_only_pulls_does_not_turn_a_body_at_its_centre() {
    for (kind, mut scene) in scenes() {
        for side in 0..2 {
            let mut held = scene.constraints[0].clone();
            if held.only_pulls(side) {
                held.frames_mut()[side].point = Vector3::zeros();
                scene.constraints[0] = held;
                let lin = Linearized::at(&scene, 0.0);
                let block = lin.block(side);
                let mut turns = block.rows().iter().flat_map(|row| &row[3..]);
                assert!(turns.all(|j| *j == 0.0), "{kind}, side {side}");
            }
        }
    }
}

/// λ of the rows that measure the first gap, or of all where none does.
fn pull(c: &Constraint) -> Vec<f64> {
    let gap = c.parts().map(|(kind, ..)| kind).find(|kind| kind.is_gap());
    let pulls = |r: usize| gap.is_none_or(|gap| c.row(r).0 == gap);
    let lambda = |r| if pulls(r) { -3.0 - r as f64 } else { 0.0 };
    (0..c.rows()).map(lambda).collect()
}

#[test]
fn the_force_of_a_gap_acts_at_the_lever() {
    for (kind, scene) in scenes() {
        let (lin, lambda) = (Linearized::at(&scene, 0.0), pull(&scene.constraints[0]));
        for slot in 0..2 {
            let Wrench { force, torque } = Wrench::of_rows(lin.block(slot).rows(), &lambda);
            let moment = torque - lin.lever(slot).cross(&force);
            assert!(force.norm() > 0.1, "{kind}");
            assert!(moment.norm() < 1e-13 * force.norm(), "{kind}: {moment}");
        }
    }
}

/// −∂(r × F)/∂θ of a link under the tension T, with n along it: (F·r) I − r Fᵀ of the lever that turns, and T/|d| across n of the
/// point that it takes along. With another point of the link as its lever, J is the same and this is not.
#[test]
fn the_lever_of_a_link_is_that_of_the_point_that_turns() {
    let (h, tension) = (1e-5, 7.0);
    for (kind, scene) in scenes() {
        let c = &scene.constraints[0];
        if c.link_length().is_none() {
            continue;
        }
        let mut lambda = vec![0.0; c.rows()];
        lambda[0] = -tension;
        let [a, b] = [0, 1].map(|k: usize| c.frames()[k].resolve(&scene.bodies, 0.0).point());
        let (d, n) = ((a - b).norm(), (a - b).normalize());
        let across = (Matrix3::identity() - n * n.transpose()) * (tension / d);
        let wrench = |scene: &Scene, slot: usize| {
            let lin = Linearized::at(scene, 0.0);
            let wrench = Wrench::of_rows(lin.block(slot).rows(), &lambda);
            (wrench, lin.lever(slot))
        };
        for slot in 0..2 {
            let (Wrench { force, .. }, r) = wrench(&scene, slot);
            let arm = r.cross_matrix();
            let exact = Matrix3::from_diagonal_element(force.dot(&r)) - r * force.transpose()
                + arm * across * arm.transpose();
            for axis in 0..3 {
                let [more, less] = [h, -h].map(|angle| {
                    let (mut turned, mut by) = (scene.clone(), Vector3::zeros());
                    by[axis] = angle;
                    turn(&mut turned, slot, by);
                    wrench(&turned, slot).0.torque
                });
                let error = (less - more) / (2.0 * h) - exact.column(axis);
                assert!(
                    error.norm() < 1e-8 * tension,
                    "{kind}, side {slot}: {error}"
                );
            }
        }
    }
}

#[test]
fn moved_points_of_the_world_drive_all_rows() {
    let (t, next) = (0.3, 0.5);
    for (kind, mut scene) in scenes() {
        let c = &mut scene.constraints[0];
        let motion = Motion::Smooth {
            displacement: Vector3::new(0.4, -0.3, 0.2),
            start: 0.0,
            duration: 1.0,
        };
        let held = c.frames()[0].resolve(&scene.bodies, 0.0);
        c.frames_mut()[0] = Frame::world(held.point())
            .with_axes(held.axes)
            .moving(motion);
        let mut phi = [[0.0; MAX_ROWS]; 3];
        let [before, after, rate] = &mut phi;
        c.violation(&scene.bodies, t, &mut before[..c.rows()]);
        c.violation(&scene.bodies, next, &mut after[..c.rows()]);
        c.drive(&scene.bodies, t, next, &mut rate[..c.rows()]);
        for r in (0..c.rows()).filter(|r| c.row(*r).0 != RowKind::Transverse) {
            let exact = (after[r] - before[r]) / (next - t);
            assert!((rate[r] - exact).abs() < 1e-13, "{kind}, row {r}");
        }
        assert!(rate.iter().any(|rate| rate.abs() > 0.01), "{kind}");
    }
}
