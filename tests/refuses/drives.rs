use taut_tests::machines::random_machine;
use taut_tests::prelude::*;

/// The stepper's error for a scene, which takes one line.
fn refusal(scene: &Scene) -> String {
    let error = Stepper::new(scene.clone(), StepOptions::default());
    let text = error.map(|_| ()).expect_err("a fault").to_string();
    assert!(!text.contains('\n'), "{text}");
    text
}

/// Values that are too large to go on with end the run with an error that says where.
#[test]
fn a_control_of_any_size_ends_in_a_typed_error_or_not_at_all() {
    for value in [1e3, 1e9, 1e100, 1e200, f64::MAX] {
        for control in [0, 1] {
            for sign in [1.0, -1.0] {
                let params = GantryParams::default().with(|p| p.segments = 2);
                let scene = params.build().expect("builds");
                let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
                stepper.set_control(control, sign * value).expect("finite");
                for _ in 0..2 {
                    match stepper.step() {
                        Ok(_) => finite(stepper.scene(), &format!("{value:e}")),
                        Err(StepError::NonFinite { .. } | StepError::Solve { .. }) => break,
                        Err(other) => panic!("{value:e}: {other}"),
                    }
                }
            }
        }
    }
}

fn finite(scene: &Scene, place: &str) {
    let bodies = &scene.bodies;
    let sums = bodies.position.iter().chain(&bodies.velocity);
    assert!(sums.map(Vector3::sum).all(f64::is_finite), "{place}");
}

#[test]
fn velocities_are_set_of_driven_bodies_and_finite() {
    let mut stepper = Stepper::new(random_machine(1), StepOptions::default()).expect("sound");
    let zero = Vector3::zeros();
    for (v, w) in [(Vector3::x() * f64::NAN, zero), (zero, Vector3::y() / 0.0)] {
        let error = stepper.set_velocity(1, v, w).expect_err("a fault");
        assert!(error.to_string().contains("not finite"), "{error}");
    }
    for (body, words) in [
        (0, "not driven"),
        (2, "not driven"),
        (99, "99, of 8, is not there"),
    ] {
        let error = stepper.set_velocity(body, zero, zero).expect_err("a fault");
        assert!(error.to_string().contains(words), "{error}");
    }
}

/// A body that hangs on nothing beside static and driven ones falls; without any dynamic body nothing moves but what is
/// driven. Neither has rows.
#[test]
fn scenes_without_anything_to_solve_run() {
    for choice in compiled() {
        let mut scene = Scene::new("loose");
        scene.gravity = Vector3::z() * -10.0;
        scene.add_body("ground", Body::fixed());
        let mut carrier = Body::sphere(0.1, 1.0);
        carrier.mobility = Mobility::Driven;
        carrier.velocity = Vector3::x();
        let carrier = scene.add_body("carrier", carrier);
        let holders = scene.clone();
        let stone = scene.add_body("stone", Body::sphere(0.1, 1.0));
        for scene in [holders, scene] {
            let mut stepper = Stepper::new(scene, choice.options(0.125)).expect("sound");
            for _ in 0..8 {
                stepper.step().unwrap_or_else(|e| panic!("{choice}: {e}"));
            }
            assert_eq!(stepper.reference_multipliers(), Ok(vec![]), "{choice}");
            let bodies = &stepper.scene().bodies;
            assert_eq!(bodies.position[0], Vector3::zeros(), "{choice}");
            assert_eq!(bodies.position[carrier], Vector3::x(), "{choice}");
            if bodies.len() > stone {
                assert_eq!(bodies.position[stone].z, -5.0, "{choice}");
            }
        }
    }
}

/// Without force the motor is not there: the motion is that of the joint without one.
#[test]
fn a_motor_without_force_lets_its_joint_run_free() {
    let scene = |motor: Option<Motor>, slides: bool| {
        let mut scene = Scene::new("free runner");
        scene.gravity = Vector3::new(3.0, 0.0, -10.0);
        let body = scene.add_body("body", Body::sphere(0.1, 2.0));
        let frames = [origin(), Frame::body(body, Vector3::x() * 0.1)];
        let constraint = if slides {
            Constraint::Slider(Slider::new(frames).with(|p| p.motor = motor))
        } else {
            Constraint::Hinge(Hinge::new(frames).with(|p| p.motor = motor))
        };
        scene.add_constraint("joint", constraint, 0);
        scene
    };
    let weak = |target| Motor {
        target,
        force_limit: 0.0,
        law: RowLaw::new(1e-6, 0.0),
    };
    for choice in compiled() {
        for slides in [true, false] {
            for target in [Target::Speed(2.0), Target::Position(1.0)] {
                let [free, weak] = [None, Some(weak(target))].map(|motor| {
                    let scene = scene(motor, slides);
                    let mut stepper =
                        Stepper::new(scene, choice.options(1.0 / 60.0)).expect("sound");
                    for _ in 0..30 {
                        let report = stepper.step().unwrap_or_else(|e| panic!("{choice}: {e}"));
                        assert_eq!(report.undecided, 0, "{choice}");
                    }
                    assert!(stepper.multipliers().get(5).is_none_or(|mu| *mu == 0.0));
                    stepper.scene().bodies.clone()
                });
                let apart = (free.position[0] - weak.position[0]).norm();
                assert!(apart < 1e-9, "{choice}, {target:?}: {apart:e}");
            }
        }
    }
}

/// A hook that is heavier than its winches hold runs down to the end of the rope; then it hangs on that.
#[test]
fn a_winch_that_is_too_weak_slips_to_its_end() {
    let params = GantryParams {
        segments: 2,
        // 1252 kg on four falls weigh 3071 N a fall.
        winch_force: Some(2000.0),
        equilibrium: false,
        ..GantryParams::default()
    };
    let mut scene = params.build().expect("builds");
    let mut longest = 0.0;
    for constraint in &mut scene.constraints {
        if let Constraint::MasslessCable(cable) = constraint {
            longest = cable.length + 4.0;
            if let Some(winch) = &mut cable.winch {
                winch.longest = longest;
            }
        }
    }
    for choice in compiled() {
        let options = choice.options(1.0 / 60.0);
        let options = options.with(|o| o.backend = choice.backend.with_iterations(2000));
        let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
        for n in 0..300 {
            stepper
                .step()
                .unwrap_or_else(|e| panic!("{choice}, step {n}: {e}"));
            finite(stepper.scene(), &format!("{choice}, step {n}"));
        }
        for constraint in &stepper.scene().constraints {
            if let Constraint::MasslessCable(cable) = constraint {
                assert_eq!(cable.length, longest, "{choice}");
            }
        }
        let hook = stepper.scene().bodies.position[2].z;
        let lowest = -(params.drop + 2.0 + 0.5 * params.hook_height);
        assert!((hook - lowest).abs() < 0.2, "{choice}: {hook} of {lowest}");
    }
}

/// No weight, and as few segments as there can be: nothing to hold is no fault, and what is driven moves.
#[test]
fn the_least_gantries_run() {
    let weightless = GantryParams::default().with(|p| p.gravity = 0.0);
    let short = GantryParams::default().with(|p| p.segments = 1);
    let both = short.clone().with(|p| p.gravity = 0.0);
    for params in [weightless, short, both] {
        let place = format!("g = {}, {} segments", params.gravity, params.segments);
        let scene = params.build().expect("builds");
        let made = Stepper::new(scene, StepOptions::default());
        let mut stepper = made.unwrap_or_else(|e| panic!("{place}: {e}"));
        for n in 0..120 {
            let speed = if n < 60 { 0.5 } else { 0.0 };
            stepper.set_control(0, speed).expect("a control");
            stepper.set_control(1, -speed).expect("a control");
            let report = stepper.step().unwrap_or_else(|e| panic!("{place}: {e}"));
            assert_eq!(report.undecided, 0, "{place}");
            finite(stepper.scene(), &place);
        }
        let way = stepper.scene().bodies.position[1].x;
        assert!((way - 0.5).abs() < 1e-9, "{place}: {way}");
    }
}

/// 10⁵ bodies in a line, around a hub and through one cable: topology, and the steppers of what is sparse. A hub
/// couples all constraints with each other: S is full, more than can be stored, unless the hub is one that nothing
/// moves.
#[test]
fn many_bodies_are_put_in_order_or_refused() {
    const MANY: usize = 100_000;
    let mut star = Scene::new("star");
    star.add_body("hub", Body::sphere(1.0, 1.0));
    for i in 1..=MANY {
        let line = format!("{i}");
        star.add_body(line, Body::sphere(0.1, 1.0).at(Vector3::x() * 2.0));
        let frames = [centre(0), Frame::body(i, -Vector3::x() * 2.0)];
        let stretch = RowLaw::RIGID;
        let joint = Constraint::Spherical(Spherical { frames, stretch });
        star.add_constraint(format!("{i}"), joint, 0);
    }
    let topology = Topology::of(&star);
    assert!(topology.closing.is_empty());
    assert_eq!(topology.components, 1);
    star.group_by_topology();
    let text = refusal(&star);
    let holds = text.contains("`hub`") && text.contains("split it");
    assert!(holds, "{text}");

    // Around a hub that stays where it is nothing is coupled.
    let mut wheel = star;
    wheel.bodies.mobility[0] = Mobility::Static;
    assert_eq!(Topology::of(&wheel).components, MANY);
    wheel.group_by_topology();
    let mut stepper = Stepper::new(wheel, StepOptions::default()).expect("sparse");
    stepper.step().expect("solvable");

    let mut reeved = Scene::new("reeved");
    let mut frames = vec![origin()];
    for i in 1..=MANY {
        let at = Vector3::new(i as f64, (i % 2) as f64, 0.0);
        let body = reeved.add_body(format!("{i}"), Body::sphere(0.1, 1.0).at(at));
        frames.push(centre(body));
    }
    let cable = MasslessCable::new(frames, 1e5, RowLaw::new(1e-6, 0.0));
    reeved.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    assert_eq!(Topology::of(&reeved).components, 1);
    let mut stepper = Stepper::new(reeved, StepOptions::default()).expect("one row");
    stepper.step().expect("solvable");
}
