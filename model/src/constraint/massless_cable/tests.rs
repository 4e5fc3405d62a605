use super::*;
use crate::constraint::testing::{BAR, LAW, Poses, Sample};
use crate::testing::*;

impl Sample for MasslessCable {
    fn sample(frames: [Frame; 2]) -> Self {
        Self::new(frames.into(), 0.7, LAW)
    }
}

/// A cable from the world through bodies and back to a world point that moves, attached off the centres.
fn scene(seed: u64) -> Scene {
    let mut poses = Poses::new(seed);
    let mut scene = Scene::new("reeved");
    let motion = Motion::Smooth {
        displacement: Vector3::new(0.3, -0.2, 0.1),
        start: 0.0,
        duration: 1.0,
    };
    let mut frames = vec![Frame::world(poses.vector())];
    for name in ["a", "b", "c"] {
        let body = Body::sphere(1.0, 1.0).at(poses.vector() * 3.0);
        let index = scene.add_body(name, body.turned(poses.rotation()));
        frames.push(Frame::body(index, poses.vector()));
    }
    // Twice through the first body.
    frames.push(Frame::body(0, poses.vector()));
    frames.push(Frame::world(poses.vector()).moving(motion));
    let cable = MasslessCable::new(frames, 5.0, LAW);
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    scene
}

#[test]
fn jacobian_at_random_poses() {
    let mut worst = 0.0_f64;
    for seed in 1..=20 {
        let error = crate::check_jacobian(&scene(seed), 0).max;
        assert!(error <= BAR, "{error:e}");
        worst = worst.max(error);
    }
    println!("massless cable {worst:.1e}");
}

#[test]
fn violation_is_the_excess_length_and_the_rate_of_a_driven_end() {
    let scene = scene(4);
    let points: Vec<_> = scene.constraints[0]
        .frames()
        .iter()
        .map(|f| f.resolve(&scene.bodies, 0.3).point())
        .collect();
    let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let mut lin = Linearized::at(&scene, 0.3);
    assert!((lin.phi[0] - (total - 5.0)).abs() < 1e-13);
    assert_eq!(scene.constraints[0].row(0), (RowKind::Length, LAW));
    let mut after = lin.clone();
    after.update(&scene, 0.5);
    lin.drive(&scene, 0.3, 0.5);
    assert!((0.2 * lin.phi_t[0] - (after.phi[0] - lin.phi[0])).abs() < 1e-15);
    assert!(lin.phi_t[0].abs() > 0.01);
}

#[test]
fn tension_is_the_same_in_all_spans() {
    // A point on a cable between two others is pulled along the bisector: n₂ − n₁.
    let mut scene = Scene::new("sheave");
    scene.add_body("sheave", Body::particle(1.0).at(-Vector3::z()));
    let at = |x| Frame::world(Vector3::new(x, 0.0, 0.0));
    let frames = vec![at(-1.0), centre(0), at(1.0)];
    let cable = MasslessCable::new(frames, 2.0, RowLaw::RIGID);
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    let lin = Linearized::at(&scene, 0.0);
    let half = 0.5_f64.sqrt();
    assert!((lin.block(0)[2] + 2.0 * half).abs() < 1e-15, "{lin:?}");
    assert!(lin.block(0)[0].abs() < 1e-15);
    assert!((lin.phi[0] - (2.0 / half - 2.0)).abs() < 1e-15);
}

#[test]
fn a_winch_changes_length_and_compliance_within_its_range() {
    let mut cable = MasslessCable {
        winch: Some(Winch {
            speed: -0.5,
            force_limit: 100.0,
            brake_limit: 300.0,
            shortest: 1.0,
            longest: 4.0,
            ..Winch::new()
        }),
        ..MasslessCable::new(Vec::new(), 2.0, RowLaw::new(1e-3, 0.0))
    };
    assert_eq!((cable.length_at(0.0), cable.length_at(1.0)), (2.0, 1.5));
    let found = (cable.length_at(9.0), cable.compliance_at(1.0));
    assert_eq!(found, (1.0, 0.75e-3));
    assert_eq!(cable.bounds(0.0), Some((0, -100.0, 0.0)));
    cable.rebase(1.0);
    assert_eq!((cable.length, cable.law.compliance), (1.5, 0.75e-3));
    let set = |cable: &mut MasslessCable, change: &dyn Fn(&mut Winch)| {
        if let Some(winch) = &mut cable.winch {
            change(winch);
        }
    };
    set(&mut cable, &|w| w.brake = true);
    let found = (cable.length_at(3.0), cable.bounds(3.0).expect("bounds").1);
    assert_eq!(found, (1.5, -300.0));
    // Stretched by 0.9 m it pulls with 1200 N: the brake slips to 300 N.
    let paid = cable.settle(0.9, 300.0, 3.0);
    assert!((cable.length - 1.5 - paid).abs() < 1e-15);
    let excess = 2.4 - cable.length;
    assert!((excess / cable.law.compliance - 300.0).abs() < 1e-10);
    // The brake holds half the excess.
    assert_eq!(cable.settle(0.5 * excess, 300.0, 3.0), 0.0);
    // The drum is empty at 4 m, and holds any tension then.
    assert!(cable.settle(50.0, 300.0, 3.0) > 0.0);
    let found = (cable.length, cable.bounds(3.0).expect("bounds").1);
    assert_eq!(found, (4.0, f64::NEG_INFINITY));
}

#[test]
fn a_winch_rests_until_its_time() {
    let cable = MasslessCable::new(Vec::new(), 10.0, RowLaw::RIGID)
        .with(|p| p.winch = Some(Winch::new().with(|w| (w.speed, w.since) = (-0.5, 5.0))));
    let lengths = [-1.0, 0.0, 5.0, 6.0].map(|t| cable.length_at(t));
    assert_eq!(lengths, [10.0, 10.0, 10.0, 9.5]);
}

#[test]
fn a_winch_that_a_run_begins_with_was_running_unless_at_its_stop() {
    let winch = |speed, shortest| Winch::new().with(|w| (w.speed, w.shortest) = (speed, shortest));
    for (winch, before) in [
        (winch(-0.5, 1.0), 10.5),
        (winch(0.5, 1.0), 9.5),
        (winch(-0.5, 10.0), 10.0),
    ] {
        let cable =
            MasslessCable::new(Vec::new(), 10.0, RowLaw::RIGID).with(|p| p.winch = Some(winch));
        let found = (cable.length_at(-1.0), cable.length_at(0.0));
        assert_eq!(found, (before, 10.0));
    }
}

#[test]
fn a_running_winch_is_a_rate() {
    let mut scene = scene(4);
    if let Constraint::MasslessCable(cable) = &mut scene.constraints[0] {
        cable.winch = Some(Winch::new().with(|w| w.speed = 0.7));
        cable.frames.pop();
    }
    let mut lin = Linearized::at(&scene, 0.0);
    lin.drive(&scene, 0.0, 0.1);
    assert!((lin.phi_t[0] + 0.7).abs() < 1e-14, "{}", lin.phi_t[0]);
    let mut later = lin.clone();
    later.update(&scene, 0.1);
    assert!((later.phi[0] - lin.phi[0] + 0.07).abs() < 1e-14);
    assert!((later.compliance[0] / lin.compliance[0] - 5.07 / 5.0).abs() < 1e-15);
    assert!(crate::check_jacobian(&scene, 0).max < BAR);
}

#[test]
fn spans_of_length_zero_are_finite() {
    let mut scene = scene(9);
    for frame in scene.constraints[0].frames_mut() {
        frame.side = Side::World(Motion::Fixed);
        frame.point = Vector3::zeros();
    }
    scene.constraints[0].frames_mut()[2] = centre(1);
    scene.bodies.position[1] = Vector3::zeros();
    let lin = Linearized::at(&scene, 0.0);
    assert_eq!(*lin.phi, [-5.0]);
    assert!(lin.jacobian.iter().all(|j| j.is_finite()));
}
