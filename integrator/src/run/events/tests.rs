use crate::testing::{centre, origin, winch};
use crate::{Scheme, StepError, StepOptions, Stepper};
use nalgebra::Vector3;
use taut_model::{
    Action, Body, Constraint, Distance, Event, Frame, GantryParams, RowLaw, Scene, SceneError, When,
};
use taut_model::{
    Cable, CableEnd, Collider, Control, MasslessCable, Material, Segments, Shape, Winch,
};

fn options() -> StepOptions {
    StepOptions::default()
        .with(|o| o.backend = taut_solver::Backend::Dense(taut_solver::DenseOptions::default()))
}

/// 100 kg on two equal links side by side.
fn twins() -> Scene {
    let mut scene = Scene::new("twins");
    scene.gravity = Vector3::z() * -10.0;
    let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -1.0));
    scene.load = Some(load);
    for name in ["left", "right"] {
        let link = Distance {
            frames: [origin(), centre(load)],
            length: 1.0,
            law: RowLaw::new(1e-5, 0.0),
            transverse: false,
        };
        scene.add_constraint(name, Constraint::Distance(link), 0);
    }
    scene.start_in_equilibrium = true;
    scene
}

fn run(stepper: &mut Stepper, steps: usize) -> Vec<(f64, String)> {
    let mut log = Vec::new();
    for _ in 0..steps {
        let limits: Vec<Event> = stepper.scene().events.clone();
        let report = stepper.step().unwrap();
        assert_eq!(report.events, stepper.fired().len());
        assert_eq!(report.events, stepper.fired_forces().len());
        for (name, force) in stepper.fired().iter().zip(stepper.fired_forces()) {
            let event = limits.iter().find(|event| event.name == *name).unwrap();
            match event.when {
                When::Force { above, .. } => assert!(force.unwrap() > above, "{name}: {force:?}"),
                _ => assert_eq!(*force, None),
            }
        }
        log.extend(
            stepper
                .fired()
                .iter()
                .map(|name| (report.time, name.clone())),
        );
    }
    log
}

/// After one of two equal ropes breaks, the other, which carried W/2, swings between W/2 and 3/2 W
/// about the whole weight W.
#[test]
fn the_rope_that_is_left_takes_one_and_a_half_weights() {
    let options = options().with(|o| o.dt = 1.0 / 960.0);
    let mut scene = twins();
    scene.events.push(Event {
        name: "cut".into(),
        when: When::Time(0.1),
        then: vec![Action::Release(0)],
    });
    let mut stepper = Stepper::new(scene, options).unwrap();
    let log = run(&mut stepper, 96);
    assert_eq!(log.len(), 1);
    assert!((log[0].0 - 0.1).abs() < 1e-9, "{log:?}");
    let mut peak = 0.0_f64;
    for _ in 0..240 {
        stepper.step().unwrap();
        peak = peak.max(stepper.tension(0).unwrap());
    }
    assert!((peak / 1500.0 - 1.0).abs() < 1e-3, "{peak}");
    assert!(stepper.scene().events.is_empty());
}

#[test]
fn a_rope_breaks_at_its_limit_and_the_next_one_follows() {
    let mut scene = twins();
    scene.break_at(0, 450.0);
    scene.break_at(1, 1200.0);
    let mut stepper = Stepper::new(scene, options()).unwrap();
    let names: Vec<String> = run(&mut stepper, 30).into_iter().map(|(_, n)| n).collect();
    assert_eq!(names, ["left breaks", "right breaks"]);
    assert!(stepper.scene().constraints.is_empty());
}

/// All joints of a rope are beyond their limit at once, the upper ones the most: one of them breaks.
#[test]
fn a_rope_breaks_in_one_place() {
    let mut scene = taut_model::HoistParams::default()
        .hanging_equilibrium()
        .unwrap();
    for joint in scene.cables[0].joints.clone() {
        scene.break_at(joint, 9000.0);
    }
    let mut stepper = Stepper::new(scene, options()).unwrap();
    let log = run(&mut stepper, 30);
    assert_eq!(log.len(), 1, "{log:?}");
    assert_eq!(log[0].1, "anchor breaks");
}

#[test]
fn a_hook_catches_what_comes_near_and_keeps_the_momentum() {
    let mut scene = Scene::new("catch");
    let mut runner = Body::sphere(0.1, 2.0);
    runner.velocity = Vector3::x() * 1.5;
    scene.add_body("runner", runner);
    scene.add_body("block", Body::sphere(0.1, 6.0).at(Vector3::x()));
    let between = Box::new([0, 1].map(centre));
    scene.events.push(Event {
        name: "caught".into(),
        when: When::Distance {
            between: between.clone(),
            below: 0.25,
        },
        then: vec![Action::Attach {
            name: "hook".into(),
            between,
        }],
    });
    let mut stepper = Stepper::new(scene, options()).unwrap();
    let log = run(&mut stepper, 120);
    assert_eq!(log.len(), 1);
    assert!((log[0].0 - 0.5).abs() < 0.03, "{log:?}");
    let velocity = stepper.scene().bodies.velocity[1].x;
    assert!((velocity - 0.375).abs() < 1e-12, "{velocity}");
}

#[test]
fn controls_are_set_by_name_whatever_goes() {
    let mut scene = GantryParams::default().build().unwrap();
    let rail = scene.constraint("rail").unwrap();
    let rope = scene.constraint("rope-1").unwrap();
    scene.events.push(Event {
        name: "emergency".into(),
        when: When::Time(0.5),
        then: vec![
            Action::Set {
                control: 1,
                value: 0.1,
            },
            Action::Release(rail),
            Action::Release(rope),
            Action::Release(rail),
        ],
    });
    let mut stepper = Stepper::new(scene, options()).unwrap();
    assert_eq!(run(&mut stepper, 40).len(), 1);
    // The trolley's control has gone with its rail.
    assert_eq!(stepper.scene().controls.len(), 1);
    assert_eq!(stepper.scene().control_value(0), Some(0.1));
}

#[test]
fn events_of_what_is_not_there_are_refused_by_name() {
    let says = |when: When, then: Vec<Action>, words: &str| {
        let mut scene = twins();
        let name = "bad".to_owned();
        scene.events.push(Event { name, when, then });
        let Err(StepError::Scene(fault)) = Stepper::new(scene, options()) else {
            panic!("{words}");
        };
        assert!(fault.to_string().contains(words), "{fault}");
    };
    let now = || When::Time(0.0);
    let force = |constraint, above| When::Force { constraint, above };
    says(now(), vec![], "event `bad`: does nothing");
    says(
        When::Time(f64::NAN),
        vec![Action::Release(0)],
        "event `bad`: time is NaN",
    );
    says(
        force(7, 1.0),
        vec![Action::Release(0)],
        "event `bad` names `number 7`",
    );
    says(
        force(0, 0.0),
        vec![Action::Release(0)],
        "event `bad`: force is 0",
    );
    says(
        force(0, -1.0),
        vec![Action::Release(0)],
        "event `bad`: force is -1",
    );
    says(
        now(),
        vec![Action::Release(2)],
        "event `bad` names `number 2`",
    );
    let between = Box::new([origin(), centre(9)]);
    let name = "left".to_owned();
    let taken = Action::Attach {
        name: name.clone(),
        between: between.clone(),
    };
    says(now(), vec![taken], "called `left`");
    let name = "hook".to_owned();
    says(
        now(),
        vec![Action::Attach { name, between }],
        "names the body `number 9`",
    );
    for (ends, words) in [
        ([0, 0], "joint `hook` ties body `load` to itself"),
        ([9, 9], "names the body `number 9`"),
    ] {
        let between = Box::new(ends.map(centre));
        let name = "hook".to_owned();
        says(now(), vec![Action::Attach { name, between }], words);
    }
    let between = Box::new([Vector3::x(), Vector3::y()].map(Frame::world));
    let tie = |between: &[Frame; 2]| Action::Attach {
        name: "hook".to_owned(),
        between: Box::new(*between),
    };
    says(now(), vec![tie(&between)], "`hook`");
    // Two that would have one name.
    let sound = Box::new([Frame::world(Vector3::x()), centre(0)]);
    says(
        now(),
        vec![tie(&sound), tie(&sound)],
        "two joint entries are called `hook`",
    );
    let (control, value) = (0, 1.0);
    says(
        now(),
        vec![Action::Set { control, value }],
        "no control is called",
    );
    let mut stepper = Stepper::new(twins(), options()).unwrap();
    let gone = stepper.change(|edit| {
        edit.remove_constraint(edit.constraint("right")?)?;
        edit.add_event(Event {
            name: "late".into(),
            when: now(),
            then: vec![Action::Release(1)],
        });
        Ok(())
    });
    let known = matches!(gone, Err(StepError::Scene(SceneError::UnknownJoint { .. })));
    assert!(known, "{gone:?}");
    assert_eq!(stepper.scene().constraints.len(), 2);
}

/// A load of 2 t under 12 m of steel rope, 1 m above the ground, its winch at the jib.
fn landing(pinned: [bool; 2], limit: f64) -> Stepper {
    let mut scene = Scene::new("landing");
    scene.gravity = Vector3::z() * -9.81;
    let size = Vector3::new(1.0, 1.0, 1.0);
    let load = Body::cuboid(size, 2000.0).at(Vector3::z() * 1.5);
    let load = scene.add_body("load", load);
    scene.load = Some(load);
    scene.add_collider(Collider::new("load", Some(load), Shape::Cuboid { size }));
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    let frames = [
        Frame::world(Vector3::z() * 14.0),
        Frame::body(load, Vector3::z() * 0.5),
    ];
    let end = |k: usize| {
        if pinned[k] {
            CableEnd::Pinned(frames[k])
        } else {
            CableEnd::Clamped(frames[k])
        }
    };
    let cable = Cable {
        segments: Segments::Equal(12),
        winch: Some(Winch::new()),
        ..Cable::round("rope", &Material::STEEL, 0.01, [end(0), end(1)])
    };
    let parts = scene.add_cable(&cable).unwrap();
    let lead = parts.joints[0];
    scene.controls.push(Control::of("lower", lead, 1.0));
    for joint in parts.joints {
        scene.break_at(joint, limit);
    }
    let last = scene.constraint("rope-end").unwrap();
    scene.events.push(Event {
        name: "overload".into(),
        when: When::Force {
            constraint: last,
            above: limit,
        },
        then: vec![Action::Set {
            control: 0,
            value: 0.0,
        }],
    });
    scene.start_in_equilibrium = true;
    Stepper::new(scene, StepOptions::default()).unwrap()
}

/// Straight as it is, the cable stands as a column on the load that it has set down, and pushes.
#[test]
fn a_cable_that_pushes_does_not_break() {
    const WEIGHT: f64 = 2000.0 * 9.81;
    for pinned in [[false, true], [true, true], [false, false]] {
        let mut stepper = landing(pinned, 3.0 * WEIGHT);
        let last = stepper.scene().constraint("rope-end").unwrap();
        stepper.set_control(0, 0.5).unwrap();
        let mut least = f64::INFINITY;
        for _ in 0..150 {
            stepper.step().unwrap();
            assert_eq!(stepper.fired(), [""; 0], "{pinned:?}");
            let [end, segment] = [
                stepper.tension(last).unwrap(),
                stepper
                    .tension_in("rope", stepper.scene().cables[0].bodies.len() - 1)
                    .unwrap(),
            ];
            if end.abs() > WEIGHT && least > -WEIGHT {
                assert!((end / segment - 1.0).abs() < 0.05, "{end} {segment}");
            }
            least = least.min(end);
        }
        assert!(least < -3.0 * WEIGHT, "{pinned:?}: {least}");
    }
}

#[test]
fn a_cable_that_pulls_breaks_at_its_limit() {
    const WEIGHT: f64 = 2000.0 * 9.81;
    for pinned in [[false, true], [true, true], [false, false]] {
        // A hard start.
        let mut stepper = landing(pinned, 1.2 * WEIGHT);
        assert_eq!(run(&mut stepper, 5), []);
        stepper.set_control(0, -0.8).unwrap();
        let log = run(&mut stepper, 30);
        assert!(
            log.iter().any(|(_, name)| name.ends_with(" breaks")),
            "{pinned:?}: {log:?}"
        );
    }
}

/// A hook picks a crate up, sets it down, picks it up again elsewhere, and hands it over.
fn picked() -> Scene {
    let mut scene = Scene::new("picked");
    let at = |x: f64| Vector3::x() * x;
    scene.add_body("hook", Body::sphere(0.1, 2.0));
    scene.add_body("crate", Body::sphere(0.1, 6.0).at(at(1.0)));
    scene.add_body("truck", Body::sphere(0.1, 9.0).at(at(2.0)));
    let tie = |a: usize, b: usize| Action::Attach {
        name: "grip".into(),
        between: Box::new([a, b].map(centre)),
    };
    let release = || Action::Detach("grip".into());
    for (name, time, then) in [
        ("early", 0.05, vec![release()]),
        ("up", 0.1, vec![tie(0, 1)]),
        ("down", 0.2, vec![release()]),
        ("nothing", 0.3, vec![release()]),
        ("again", 0.4, vec![tie(0, 1)]),
        ("over", 0.5, vec![tie(1, 2)]),
        ("moved", 0.6, vec![release(), tie(0, 2)]),
        ("last", 0.7, vec![release()]),
    ] {
        scene.events.push(Event {
            name: name.into(),
            when: When::Time(time),
            then,
        });
    }
    scene
}

#[test]
fn what_an_event_attached_an_event_releases_and_another_attaches_again() {
    let mut stepper = Stepper::new(picked(), options()).unwrap();
    let mut seen = Vec::new();
    let mut fired = Vec::new();
    for step in 0..60 {
        stepper.step().unwrap();
        if step == 20 {
            // Between the second release and the second attachment.
            stepper = Stepper::restore(stepper.save().unwrap()).unwrap();
        }
        fired.extend(stepper.fired().to_vec());
        let scene = stepper.scene();
        let held = scene.constraints.first().map(|c| {
            c.frames()
                .iter()
                .filter_map(Frame::body_index)
                .collect::<Vec<_>>()
        });
        assert!(scene.constraints.len() < 2);
        if seen.last() != Some(&held) {
            seen.push(held);
        }
    }
    let expected = [
        "early", "up", "down", "nothing", "again", "over", "moved", "last",
    ];
    assert_eq!(fired, expected);
    let pair = |a, b| Some(vec![a, b]);
    assert_eq!(
        seen,
        [
            None,
            pair(0, 1),
            None,
            pair(0, 1),
            pair(1, 2),
            pair(0, 2),
            None
        ]
    );
    assert!(stepper.scene().events.is_empty());
}

/// In one step events act in their order: the crate that is picked up is set down.
#[test]
fn events_of_one_step_act_in_their_order() {
    for (first, left) in [("up", 0), ("down", 1)] {
        let mut scene = picked();
        scene
            .events
            .retain(|event| ["up", "down"].contains(&&*event.name));
        for event in &mut scene.events {
            event.when = When::Time(0.0);
        }
        scene.events.sort_by_key(|event| event.name != first);
        let mut stepper = Stepper::new(scene, options()).unwrap();
        assert_eq!(run(&mut stepper, 2).len(), 2);
        assert_eq!(stepper.scene().constraints.len(), left, "{first}");
    }
}

#[test]
fn what_can_never_be_there_is_not_released() {
    // The attachment goes with what it ties.
    let mut stepper = Stepper::new(picked(), options()).unwrap();
    stepper
        .change(|edit| {
            let hook = edit.body("hook")?;
            edit.remove_body(hook)
        })
        .unwrap();
    let left = stepper.scene().events.iter().map(|e| e.name.clone());
    let left: Vec<_> = left.collect();
    assert_eq!(left, ["early", "down", "nothing", "over", "moved", "last"]);
    // `moved` releases for good, so that `last` goes without having fired.
    assert_eq!(run(&mut stepper, 60).len(), 5);
    assert!(stepper.scene().events.is_empty());
    let mut scene = picked();
    scene.events[2].then = vec![Action::Detach("grap".into())];
    let Err(StepError::Scene(fault)) = Stepper::new(scene, options()) else {
        panic!("a fault");
    };
    let words = "event `down` names `grap`, which is not there: choose one of grip";
    assert!(fault.to_string().starts_with(words), "{fault}");
}

/// 100 kg fall 1 m into 2 m of rope with k = 10⁷ N/m: the blow lasts 10 ms and pulls with m g + √((m g)² + k m v²) = 141 kN.
#[test]
fn a_rope_breaks_by_a_blow_within_a_step() {
    for (above, breaks) in [(5e4, true), (1.5e5, false)] {
        // A single step is divided where the rope catches.
        for substeps in [1, 16, 64] {
            let mut scene = Scene::new("snap");
            scene.gravity = Vector3::z() * -9.81;
            let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -1.0));
            let ends = vec![origin(), centre(load)];
            let rope = MasslessCable::new(ends, 2.0, RowLaw::new(1e-7, 0.0));
            let rope = scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
            scene.events.push(Event {
                name: "breaks".to_owned(),
                when: When::Force {
                    constraint: rope,
                    above,
                },
                then: vec![Action::Release(rope)],
            });
            let options = options().with(|o| o.substeps = substeps);
            let mut stepper = Stepper::new(scene, options).expect("sound");
            let log = run(&mut stepper, 36);
            assert_eq!(
                !log.is_empty(),
                breaks,
                "{substeps} sub-steps, {above} N: {log:?}"
            );
            if let Some((time, _)) = log.first() {
                // Taut at √(2/g) = 0.4515 s.
                assert!((0.45..0.475).contains(time), "{log:?}");
            }
        }
    }
}

/// A ball crosses a distance of 0.1 m within a step.
#[test]
fn what_comes_near_within_a_step_is_seen_by_its_substeps() {
    for (substeps, seen) in [(1, false), (16, true)] {
        let mut scene = Scene::new("flight");
        let ball = scene.add_body("ball", Body::particle(1.0).at(Vector3::x() * -0.9));
        scene.bodies.velocity[ball].x = 60.0;
        let between = Box::new([Frame::world(Vector3::x() * -0.4), centre(ball)]);
        let hook = Action::Attach {
            name: "hook".to_owned(),
            between: between.clone(),
        };
        scene.events.push(Event {
            name: "near".to_owned(),
            when: When::Distance {
                between,
                below: 0.1,
            },
            then: vec![hook],
        });
        let mut stepper =
            Stepper::new(scene, options().with(|o| o.substeps = substeps)).expect("sound");
        let log = run(&mut stepper, 2);
        assert_eq!(!log.is_empty(), seen, "{substeps} sub-steps: {log:?}");
    }
}

/// A winch that an event stops: the run goes on with the work that its drive has done.
#[test]
fn an_event_that_sets_a_control_leaves_the_balance_of_energy() {
    let mut scene = Scene::new("lift");
    scene.gravity = Vector3::z() * -10.0;
    let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -5.0));
    let frames = vec![origin(), centre(load)];
    let rope = MasslessCable::new(frames, 5.0, RowLaw::new(1e-6, 0.1));
    let rope = MasslessCable {
        winch: Some(winch(-0.5)),
        ..rope
    };
    let rope = scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
    scene.controls.push(Control::of("winch", rope, 1.0));
    scene.events.push(Event {
        name: "stop".into(),
        when: When::Time(1.0),
        then: vec![Action::Set {
            control: 0,
            value: 0.0,
        }],
    });
    let options = options().with(|o| o.energy_tolerance = Some(0.01));
    let mut stepper = Stepper::new(scene, options).unwrap();
    run(&mut stepper, 90);
    assert!(stepper.scene().events.is_empty());
    let balance = stepper.step().unwrap().balance.unwrap();
    let lifted = 100.0 * 10.0 * 0.5;
    assert!((balance.work / lifted - 1.0).abs() < 0.05, "{balance:?}");
}

/// A load at rest that is let go falls ½ g t² from then on, at any step: it does not leave with the velocity of half a step before.
#[test]
fn what_is_let_go_falls_from_then_on() {
    for scheme in Scheme::KINDS {
        for (dt, substeps) in [(1.0 / 60.0, 1), (1.0 / 60.0, 4), (1.0 / 240.0, 1)] {
            let mut scene = twins();
            for name in ["left", "right"] {
                scene.events.push(Event {
                    name: name.into(),
                    when: When::Time(0.5),
                    then: vec![Action::Release(scene.constraint(name).unwrap())],
                });
            }
            let options = StepOptions {
                dt,
                substeps,
                scheme,
                ..options()
            };
            let mut stepper = Stepper::new(scene, options).unwrap();
            let start = stepper.scene().bodies.position[0].z;
            let steps = (1.0 / dt).round() as usize;
            run(&mut stepper, steps);
            let fallen = start - stepper.scene().bodies.position[0].z;
            let first_order = if scheme.is_staggered() {
                0.0
            } else {
                10.0 * dt
            };
            assert!(
                (fallen - 1.25).abs() < 1e-3 + first_order,
                "{scheme:?} {dt} {substeps}: {fallen}"
            );
        }
    }
}
