//! Refusals of validation, and their words.

use super::*;
use crate::testing::*;

/// Error of validation for a small hoist after a change.
fn after(change: impl FnOnce(&mut Scene)) -> String {
    let params = HoistParams::default().with(|p| (p.segments, p.joint) = (2, JointKind::Paper));
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
    says(after(|s| s.bodies.mass[1] = f64::INFINITY), "mass is inf");
    says(after(|s| s.bodies.velocity[0].x = nan), "velocity is NaN");
    says(after(|s| s.bodies.torque[2].y = nan), "`load`: torque");
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
    let body = |i| centre(i);
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
}
