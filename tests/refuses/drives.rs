use nalgebra::Vector3;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Control, Drive, Frame, GantryParams, Hinge, MasslessCable, Mobility, Motor,
    Network, NetworkParams, RowLaw, Scene, SceneError, Slider, Spherical, Target, Topology, Winch,
};
use taut_tests::compiled;
use taut_tests::machines::random_machine;

const BAD: [f64; 3] = [f64::NAN, f64::NEG_INFINITY, -1.0];

fn words_of(error: &SceneError, words: &str) {
    let text = error.to_string();
    assert!(text.contains(words) && !text.contains('\n'), "{text}");
}

/// The stepper's error for a scene, which takes one line.
fn refusal(scene: &Scene) -> String {
    let error = Stepper::new(scene.clone(), StepOptions::default());
    let text = error.map(|_| ()).expect_err("a fault").to_string();
    assert!(!text.contains('\n'), "{text}");
    text
}

#[test]
fn gantries_out_of_range_name_the_parameter() {
    type Set = fn(&mut GantryParams, f64);
    let parameters: [(&str, Set); 20] = [
        ("cable_length", |p, x| p.cable_length = x),
        ("segment_mass", |p, x| p.segment_mass = x),
        ("mass_ratio", |p, x| p.mass_ratio = x),
        ("hook_mass", |p, x| p.hook_mass = Some(x)),
        ("trolley_mass", |p, x| p.trolley_mass = Some(x)),
        ("gravity", |p, x| p.gravity = x),
        ("drop", |p, x| p.drop = x),
        ("rope_spread", |p, x| p.rope_spread[0] = x),
        ("rope_spread", |p, x| p.rope_spread[1] = x),
        ("rope_ea", |p, x| p.rope_ea = x),
        ("hook_height", |p, x| p.hook_height = x),
        ("load_offset", |p, x| p.load_offset = Some(x)),
        ("ea", |p, x| p.ea = x),
        ("ei", |p, x| p.ei = Some(x)),
        ("gj", |p, x| p.gj = Some(x)),
        ("trolley_force", |p, x| p.trolley_force = Some(x)),
        ("winch_force", |p, x| p.winch_force = Some(x)),
        ("least_drop", |p, x| p.least_drop = x),
        ("seed_rate", |p, x| p.seed_rate = x),
        ("damping", |p, x| p.damping = x),
    ];
    for (name, set) in parameters {
        for value in BAD.into_iter().chain([f64::INFINITY]) {
            let mut params = GantryParams::default();
            set(&mut params, value);
            let error = params.build().map(|_| ());
            let error = error.expect_err(&format!("{name} = {value}"));
            words_of(&error, &format!("{name} is {value}"));
        }
    }
    let many = GantryParams {
        segments: usize::MAX,
        ..GantryParams::default()
    };
    assert!(matches!(many.build(), Err(SceneError::TooLarge { .. })));
}

#[test]
fn networks_out_of_range_name_the_parameter() {
    type Set = fn(&mut NetworkParams, f64);
    let parameters: [(&str, Set); 10] = [
        ("length", |p, x| p.length = x),
        ("segment_mass", |p, x| p.segment_mass = x),
        ("mass_ratio", |p, x| p.mass_ratio = x),
        ("gravity", |p, x| p.gravity = x),
        ("ea", |p, x| p.ea = x),
        ("ei", |p, x| p.ei = Some(x)),
        ("gj", |p, x| p.gj = Some(x)),
        ("spacing", |p, x| p.spacing = x),
        ("seed_rate", |p, x| p.seed_rate = x),
        ("damping", |p, x| p.damping = x),
    ];
    for (network, (name, set)) in Network::ALL
        .into_iter()
        .flat_map(|n| parameters.map(|p| (n, p)))
    {
        for value in BAD.into_iter().chain([f64::INFINITY]) {
            let mut params = NetworkParams::new(network);
            set(&mut params, value);
            let error = params.build().map(|_| ());
            let error = error.expect_err(&format!("{network:?}, {name} = {value}"));
            words_of(&error, &format!("{name} is {value}"));
        }
    }
    for (network, value) in Network::ALL
        .into_iter()
        .flat_map(|n| [(n, 0), (n, usize::MAX)])
    {
        let sizes = NetworkParams {
            segments: value,
            rows: value,
            columns: value,
            cables: value,
            ..NetworkParams::new(network)
        };
        assert!(sizes.build().is_err(), "{network:?}");
    }
}

/// The first constraint of the kind in a machine, changed.
fn changed(change: impl Fn(&mut Constraint) -> bool) -> Scene {
    for seed in 1..100 {
        let mut scene = random_machine(seed);
        if scene.constraints.iter_mut().any(&change) {
            return scene;
        }
    }
    panic!("no machine has that");
}

fn with_winch(change: impl Fn(&mut Winch)) -> Scene {
    changed(|c| match c {
        Constraint::MasslessCable(MasslessCable {
            winch: Some(winch), ..
        }) => {
            change(winch);
            true
        }
        _ => false,
    })
}

fn with_motor(change: impl Fn(&mut Motor)) -> Scene {
    changed(|c| c.motor_mut().map(&change).is_some())
}

#[test]
fn winches_and_motors_out_of_range_are_named_with_their_joint() {
    type Set<T> = fn(&mut T, f64);
    let winches: [(&str, Set<Winch>); 4] = [
        ("winch.force_limit", |w, x| w.force_limit = x),
        ("winch.brake_limit", |w, x| w.brake_limit = x),
        ("winch.shortest", |w, x| w.shortest = x),
        ("winch.longest", |w, x| w.longest = x),
    ];
    for (name, set) in winches {
        for value in BAD {
            let text = refusal(&with_winch(|w| set(w, value)));
            assert!(text.contains(&format!("{name} is {value}")), "{text}");
            assert!(text.contains("`cable-"), "{text}");
        }
    }
    let motors: [(&str, Set<Motor>); 3] = [
        ("force_limit", |m, x| m.force_limit = x),
        ("compliance", |m, x| m.law.compliance = x),
        ("damping", |m, x| m.law.damping = x),
    ];
    for (name, set) in motors {
        for value in BAD {
            let text = refusal(&with_motor(|m| set(m, value)));
            assert!(text.contains(&format!("{name} is {value}")), "{text}");
            assert!(text.contains("`joint-"), "{text}");
        }
    }
    for value in [f64::NAN, f64::INFINITY] {
        let text = refusal(&with_winch(|w| w.speed = value));
        assert!(text.contains("winch.speed is"), "{text}");
        let text = refusal(&with_winch(|w| w.since = value));
        assert!(text.contains("winch.since is"), "{text}");
        for target in [Target::Speed(value), Target::Position(value)] {
            let text = refusal(&with_motor(|m| m.target = target));
            let held = text.contains("motor.speed is") || text.contains("motor.position is");
            assert!(held, "{text}");
        }
    }
}

#[test]
fn controls_that_drive_nothing_are_refused() {
    let with = |drives: Vec<Drive>, names: &[&str]| {
        let mut scene = GantryParams::default().build().expect("builds");
        scene.controls = names
            .iter()
            .map(|name| Control {
                name: (*name).to_owned(),
                drives: drives.clone(),
            })
            .collect();
        refusal(&scene)
    };
    let drive = |constraint, gain| vec![Drive { constraint, gain }];
    assert!(with(drive(0, f64::NAN), &["go"]).contains("control `go`: gain is NaN"));
    assert!(with(drive(0, f64::INFINITY), &["go"]).contains("gain is inf"));
    // A joint of the cable, and none at all.
    for constraint in [4, 999, usize::MAX] {
        let text = with(drive(constraint, 1.0), &["go"]);
        assert!(text.contains("neither a motor"), "{text}");
    }
    assert!(with(drive(0, 1.0), &["go", "go"]).contains("`go`"));
}

/// Values that are too large to go on with end the run with an error that says where.
#[test]
fn a_control_of_any_size_ends_in_a_typed_error_or_not_at_all() {
    for value in [1e3, 1e9, 1e100, 1e200, f64::MAX] {
        for control in [0, 1] {
            for sign in [1.0, -1.0] {
                let params = GantryParams {
                    segments: 2,
                    ..GantryParams::default()
                };
                let scene = params.build().expect("builds");
                let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
                stepper.set_control(control, sign * value).expect("finite");
                for _ in 0..5 {
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
fn static_and_driven_bodies_with_bad_velocities_are_refused() {
    let with = |mobility: Mobility, velocity: f64, spin: f64| {
        let mut scene = random_machine(1);
        let i = scene.bodies.mobility.iter().position(|m| *m == mobility);
        let i = i.expect("one of each");
        scene.bodies.velocity[i].x = velocity;
        scene.bodies.angular_velocity[i].y = spin;
        refusal(&scene)
    };
    let nan = f64::NAN;
    let driven = Mobility::Driven;
    assert!(with(driven, nan, 0.0).contains("`carrier`: velocity is NaN"));
    assert!(with(driven, 0.0, nan).contains("`carrier`: angular_velocity is NaN"));
    assert!(with(driven, f64::INFINITY, 0.0).contains("velocity is inf"));
    assert!(with(Mobility::Static, 1.0, 0.0).contains("make it driven"));
    let mut stepper = Stepper::new(random_machine(1), StepOptions::default()).expect("sound");
    let zero = Vector3::zeros();
    for (v, w) in [(Vector3::x() * nan, zero), (zero, Vector3::y() / 0.0)] {
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
            let bodies = &stepper.scene().bodies;
            assert_eq!(bodies.position[0], Vector3::zeros(), "{choice}");
            assert_eq!(bodies.position[carrier], Vector3::x(), "{choice}");
            if bodies.len() > stone {
                assert_eq!(bodies.position[stone].z, -5.0, "{choice}");
            }
        }
    }
}

#[test]
fn joints_between_bodies_that_nothing_moves_are_refused() {
    let mut scene = Scene::new("frozen");
    scene.add_body("ground", Body::fixed());
    let mut carrier = Body::sphere(0.1, 1.0);
    carrier.mobility = Mobility::Driven;
    scene.add_body("carrier", carrier);
    scene.add_body("stone", Body::sphere(0.1, 1.0));
    let at = |body| Frame::body(body, Vector3::zeros());
    for frames in [[at(0), at(1)], [Frame::world(Vector3::x()), at(1)]] {
        let law = RowLaw::RIGID;
        let cable = MasslessCable::new(frames.to_vec(), 1.0, law);
        for constraint in [
            Constraint::Hinge(Hinge::new(frames)),
            Constraint::Slider(Slider::new(frames)),
            Constraint::MasslessCable(cable),
            Constraint::Spherical(Spherical {
                frames,
                stretch: law,
            }),
        ] {
            let mut scene = scene.clone();
            scene.add_constraint("idle", constraint, 0);
            assert!(refusal(&scene).contains("`idle`"), "{}", refusal(&scene));
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
        let frames = [
            Frame::world(Vector3::zeros()),
            Frame::body(body, Vector3::x() * 0.1),
        ];
        let constraint = if slides {
            Constraint::Slider(Slider {
                motor,
                ..Slider::new(frames)
            })
        } else {
            Constraint::Hinge(Hinge {
                motor,
                ..Hinge::new(frames)
            })
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
        let options = taut_tests::changed(choice.options(1.0 / 60.0), |o| {
            o.backend = choice.backend.with_iterations(2000)
        });
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
    let weightless = GantryParams {
        gravity: 0.0,
        ..GantryParams::default()
    };
    let short = GantryParams {
        segments: 1,
        ..GantryParams::default()
    };
    let both = GantryParams {
        gravity: 0.0,
        ..short.clone()
    };
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
        star.add_body(
            format!("{i}"),
            Body::sphere(0.1, 1.0).at(Vector3::x() * 2.0),
        );
        let frames = [
            Frame::body(0, Vector3::zeros()),
            Frame::body(i, -Vector3::x() * 2.0),
        ];
        let stretch = RowLaw::RIGID;
        let joint = Constraint::Spherical(Spherical { frames, stretch });
        star.add_constraint(format!("{i}"), joint, 0);
    }
    let topology = Topology::of(&star);
    assert!(topology.closing.is_empty());
    assert_eq!(topology.components, 1);
    star.group_by_topology();
    let text = refusal(&star);
    assert!(
        text.contains("`hub`") && text.contains("split it"),
        "{text}"
    );

    // Around a hub that stays where it is nothing is coupled.
    let mut wheel = star;
    wheel.bodies.mobility[0] = Mobility::Static;
    assert_eq!(Topology::of(&wheel).components, MANY);
    wheel.group_by_topology();
    let mut stepper = Stepper::new(wheel, StepOptions::default()).expect("sparse");
    stepper.step().expect("solvable");

    let mut reeved = Scene::new("reeved");
    let mut frames = vec![Frame::world(Vector3::zeros())];
    for i in 1..=MANY {
        let at = Vector3::new(i as f64, (i % 2) as f64, 0.0);
        let body = reeved.add_body(format!("{i}"), Body::sphere(0.1, 1.0).at(at));
        frames.push(Frame::body(body, Vector3::zeros()));
    }
    let cable = MasslessCable::new(frames, 1e5, RowLaw::new(1e-6, 0.0));
    reeved.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    assert_eq!(Topology::of(&reeved).components, 1);
    let mut stepper = Stepper::new(reeved, StepOptions::default()).expect("one row");
    stepper.step().expect("solvable");
}
