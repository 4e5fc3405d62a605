//! Refusals of validation, and their words.

use super::*;
use crate::constraint::{Cosserat, Distance, JointLaw, RowLaw};
use crate::{HoistParams, JointKind};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Error of validation for a small hoist after a change.
fn after(change: impl FnOnce(&mut Scene)) -> String {
    let params = HoistParams {
        segments: 2,
        joint: JointKind::Paper,
        ..HoistParams::default()
    };
    let mut scene = params.build().expect("builds");
    change(&mut scene);
    let error = scene.validate().expect_err("the change is a fault");
    let text = error.to_string();
    assert!(!text.contains('\n'));
    text
}

fn pair(scene: &Scene, joint: usize) -> [Frame; 2] {
    let frames = scene.constraints[joint].frames();
    frames.try_into().expect("a joint has two sides")
}

#[test]
fn faults_of_massless_cables() {
    let says = |points: &[Option<usize>], length: f64, words: &str| {
        let text = after(|scene| {
            let frame = |i: &Option<usize>| {
                let world = Frame::world(Vector3::zeros());
                i.map_or(world, |i| Frame::body(i, Vector3::x()))
            };
            let frames = points.iter().map(frame).collect();
            let cable = MasslessCable::new(frames, length, RowLaw::RIGID);
            scene.constraints[0] = Constraint::MasslessCable(cable);
        });
        assert!(text.contains(words), "{text}");
    };
    says(&[], 1.0, "number of sides is 0: it has to be at least 2");
    says(&[Some(0)], 1.0, "number of sides is 1");
    says(&[None, None, None], 1.0, "joint `anchor`");
    says(&[Some(1); 3], 1.0, "`segment-2`");
    says(&[None, Some(0), Some(9)], 1.0, "number 9");
    says(&[None, Some(0)], 0.0, "length is 0");
    says(&[None, Some(0)], f64::NAN, "length is NaN");
}

#[test]
fn faults_of_links() {
    let says = |change: fn(&mut Distance), words: &str| {
        let text = after(|scene| {
            let mut link = Distance {
                frames: pair(scene, 0),
                length: 2.0,
                law: crate::RowLaw::RIGID,
                transverse: true,
            };
            scene.constraints[0] = Constraint::Distance(link);
            assert_eq!(scene.validate(), Ok(()));
            change(&mut link);
            scene.constraints[0] = Constraint::Distance(link);
        });
        assert!(text.contains(words), "{text}");
    };
    says(
        |d| d.length = -1.0,
        "joint `anchor`: length is -1: it has to be > 0 m",
    );
    says(|d| d.length = 0.0, "length is 0");
    says(|d| d.length = f64::NAN, "length is NaN");
    says(|d| d.length = f64::INFINITY, "length is inf");
    says(|d| d.law.compliance = f64::NAN, "compliance is NaN");
    says(|d| d.law.damping = -1.0, "damping is -1");
    says(|d| d.frames[1].point.x = f64::NAN, "attachment point");
}

fn stretch(scene: &mut Scene) -> &mut crate::RowLaw {
    match &mut scene.constraints[0] {
        Constraint::Spherical(s) => &mut s.stretch,
        _ => panic!("the anchor is spherical"),
    }
}

#[test]
fn nothing_turns_a_point_mass() {
    let says = |text: String, words: &str| assert!(text.contains(words), "{text}");
    let point = |s: &mut Scene| s.bodies.inertia[2] = Matrix3::zeros();
    says(
        after(|s| s.bodies.inertia[0] = Matrix3::zeros()),
        "joint `anchor` of body `segment-1`: would turn a point mass",
    );
    let hung = |at: Vector3<f64>| {
        move |s: &mut Scene| {
            point(s);
            let frames = pair(s, 2).map(|f| Frame { point: at, ..f });
            let stretch = RowLaw::RIGID;
            s.constraints[2] = Constraint::Spherical(crate::Spherical { frames, stretch });
        }
    };
    says(after(hung(Vector3::x())), "`load`: would turn a point mass");
    let turning = |s: &mut Scene| {
        hung(Vector3::zeros())(s);
        assert_eq!(s.validate(), Ok(()));
        s.bodies.angular_velocity[2].x = 1.0;
    };
    says(after(turning), "angular_velocity is 1: it has to be 0");
    let twisted = |s: &mut Scene| {
        hung(Vector3::zeros())(s);
        s.bodies.torque[2].z = -2.0;
    };
    says(after(twisted), "torque is 2: it has to be 0 for a point");
}

#[test]
fn faults_of_bodies() {
    let nan = f64::NAN;
    let says = |text: String, words: &str| assert!(text.contains(words), "{text}");
    says(after(|s| s.bodies.mass[1] = 0.0), "`segment-2`: mass is 0");
    says(after(|s| s.bodies.mass[1] = nan), "mass is NaN");
    says(after(|s| s.bodies.mass[1] = f64::INFINITY), "mass is inf");
    says(after(|s| s.bodies.position[0].y = nan), "position is NaN");
    says(after(|s| s.bodies.velocity[0].x = nan), "velocity is NaN");
    says(after(|s| s.bodies.torque[2].y = nan), "`load`: torque");
    says(after(|s| s.gravity.x = nan), "gravity is NaN");
    says(after(|s| s.bodies.inertia[0][(0, 0)] = -1.0), "inertia");
    says(after(|s| s.bodies.inertia[0][(0, 1)] = 1e-3), "symmetric");
    let flat = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
    says(after(|s| s.bodies.inertia[0] = flat), "definite");
    // Positive, and without a reciprocal.
    let thin = Matrix3::from_diagonal(&Vector3::new(1.0, 1e-320, 1.0));
    says(after(|s| s.bodies.inertia[0] = thin), "1/I is finite");
    says(after(|s| s.bodies.mass[1] = 1e-320), "1/m is finite");
    let least = Matrix3::from_diagonal_element(f64::MIN_POSITIVE * 2.0);
    let normal = after(|s| {
        s.bodies.inertia[0] = least;
        s.bodies.mass[1] = f64::MIN_POSITIVE;
        assert_eq!(s.validate(), Ok(()));
        s.gravity.x = f64::NAN;
    });
    says(normal, "gravity");
    let long = UnitQuaternion::new_unchecked(Quaternion::new(2.0, 0.0, 0.0, 0.0));
    says(after(|s| s.bodies.orientation[0] = long), "unit quaternion");
    says(after(|s| s.body_names[1] = "load".into()), "called `load`");
    says(
        after(|s| s.load = Some(9)),
        "load names the body `number 9`",
    );
    says(
        after(|s| s.bodies.force.truncate(2)),
        "bodies.force has length 2",
    );
    says(after(|s| s.bodies = crate::Bodies::new()), "no bodies");
}

#[test]
fn faults_of_joints() {
    let says = |text: String, words: &str| assert!(text.contains(words), "{text}");
    says(after(|s| stretch(s).compliance = -1e-9), "compliance is -");
    says(after(|s| stretch(s).damping = f64::NAN), "damping is NaN");
    let world = Frame::world(Vector3::zeros());
    says(
        after(|s| s.constraints[0].frames_mut()[1] = world),
        "the world to the world",
    );
    let body = |i| Frame::body(i, Vector3::zeros());
    says(
        after(|s| s.constraints[0].frames_mut()[1] = body(7)),
        "number 7",
    );
    says(
        after(|s| s.constraints[1].frames_mut().fill(body(1))),
        "to itself",
    );
    says(
        after(|s| s.constraints[1].frames_mut()[0].axes *= 1.1),
        "axes of side a",
    );
    says(
        after(|s| s.constraints[1].frames_mut()[1].axes[(0, 0)] = f64::NAN),
        "axes of side b",
    );
    says(
        after(|s| s.constraints[1].frames_mut()[1].axes.swap_columns(0, 1)),
        "right-handed",
    );
    says(
        after(|s| s.constraints[1].frames_mut()[1].point.x = f64::INFINITY),
        "attachment point of side b",
    );
}

#[test]
fn faults_of_names_rows_and_motions() {
    let says = |text: String, words: &str| assert!(text.contains(words), "{text}");
    says(
        after(|s| s.constraint_names[1] = "load".into()),
        "two joint",
    );
    says(after(|s| s.groups.truncate(2)), "groups has length 2");
    says(
        after(|s| {
            let frames = pair(s, 1);
            s.constraints[1] = Constraint::Cosserat(Cosserat::new(frames, JointLaw::default()));
        }),
        "no rows",
    );
    says(
        after(|s| match &mut s.constraints[1] {
            Constraint::Paper(p) => p.safeguard = 0.0,
            _ => panic!("the joint is the paper's"),
        }),
        "safeguard is 0",
    );
    let motion = Motion::Smooth {
        displacement: Vector3::x(),
        start: 0.0,
        duration: 0.0,
    };
    says(
        after(|s| s.constraints[0].frames_mut()[0].side = Side::World(motion)),
        "time span",
    );
}
