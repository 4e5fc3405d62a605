use crate::contact::tests::{add_box, ground};
use crate::testing::*;

/// 100 kg on two equal links side by side.
fn twins() -> Scene {
    let mut scene = Scene::new("twins");
    scene.gravity = Vector3::z() * -10.0;
    let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -1.0));
    scene.load = Some(load);
    for name in ["left", "right"] {
        let link = link([origin(), centre(load)], 1.0, RowLaw::new(1e-5, 0.0));
        scene.add_constraint(name, link, 0);
    }
    scene.start_in_equilibrium = true;
    scene
}

/// Two frames come nearer to each other than this \[m].
fn near(between: [Frame; 2], below: f64) -> When {
    let between = Box::new(between);
    When::Distance { between, below }
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

#[test]
fn a_rope_breaks_at_its_limit_and_the_next_one_follows() {
    let mut scene = twins();
    scene.break_at(0, 450.0);
    scene.break_at(1, 1200.0);
    let mut stepper = Stepper::new(scene, dense()).unwrap();
    let names: Vec<String> = run(&mut stepper, 30).into_iter().map(|(_, n)| n).collect();
    assert_eq!(names, ["left breaks", "right breaks"]);
    assert!(stepper.scene().constraints.is_empty());
}

/// All joints of a rope are beyond their limit at once, the upper ones the most: one of them breaks.
#[test]
fn a_rope_breaks_in_one_place() {
    let scene = taut_model::HoistParams::default().hanging_equilibrium();
    let mut scene = scene.unwrap();
    for joint in scene.cables[0].joints.clone() {
        scene.break_at(joint, 9000.0);
    }
    let mut stepper = Stepper::new(scene, dense()).unwrap();
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
    let between = [0, 1].map(centre);
    scene.events.push(event(
        "caught",
        near(between, 0.25),
        vec![attach("hook", between)],
    ));
    let mut stepper = Stepper::new(scene, dense()).unwrap();
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
    scene.events.push(event(
        "emergency",
        When::Time(0.5),
        vec![
            set(1, 0.1),
            Action::Release(rail),
            Action::Release(rope),
            Action::Release(rail),
        ],
    ));
    let mut stepper = Stepper::new(scene, dense()).unwrap();
    assert_eq!(run(&mut stepper, 40).len(), 1);
    // The trolley's control has gone with its rail.
    assert_eq!(stepper.scene().controls.len(), 1);
    assert_eq!(stepper.scene().control_value(0), Some(0.1));
}

#[test]
fn events_of_what_is_not_there_are_refused_by_name() {
    let now = || When::Time(0.0);
    let release = |number| vec![Action::Release(number)];
    let tie = |name: &str, ends: [Frame; 2]| vec![attach(name, ends)];
    let aloft = [Vector3::x(), Vector3::y()].map(Frame::world);
    let (sound, gone) = ([aloft[0], centre(0)], [origin(), centre(9)]);
    let twice = [tie("hook", sound), tie("hook", sound)].concat();
    // Words that begin with a space or a colon follow the event's name.
    for (when, then, words) in [
        (now(), vec![], ": does nothing"),
        (When::Time(f64::NAN), release(0), ": time is NaN"),
        (over_force(7, 1.0), release(0), " names `number 7`"),
        (over_force(0, 0.0), release(0), ": force is 0"),
        (over_force(0, -1.0), release(0), ": force is -1"),
        (now(), release(2), " names `number 2`"),
        (now(), tie("left", gone), "called `left`"),
        (now(), tie("hook", gone), "names the body `number 9`"),
        (
            now(),
            tie("hook", [0, 0].map(centre)),
            "joint `hook` ties body `load` to itself",
        ),
        (
            now(),
            tie("hook", [9, 9].map(centre)),
            "names the body `number 9`",
        ),
        (now(), tie("hook", aloft), "`hook`"),
        (now(), twice, "two joint entries are called `hook`"),
        (now(), vec![set(0, 1.0)], "no control is called"),
    ] {
        let words = match words.starts_with([' ', ':']) {
            true => format!("event `bad`{words}"),
            false => words.to_owned(),
        };
        let mut scene = twins();
        scene.events.push(event("bad", when, then));
        let Err(StepError::Scene(fault)) = Stepper::new(scene, dense()) else {
            panic!("{words}");
        };
        assert!(fault.to_string().contains(&words), "{fault}");
    }
    let mut stepper = Stepper::new(twins(), dense()).unwrap();
    let gone = stepper.change(|edit| {
        edit.remove_constraint(edit.constraint("right")?)?;
        edit.add_event(event("late", When::Time(0.0), vec![Action::Release(1)]));
        Ok(())
    });
    let known = matches!(gone, Err(StepError::Scene(SceneError::UnknownJoint { .. })));
    assert!(known, "{gone:?}");
    assert_eq!(stepper.scene().constraints.len(), 2);
}

/// Of the load in [`landing`] \[N].
const WEIGHT: f64 = 2000.0 * 9.81;
/// Ends of its cable that are pinned.
const PINNED: [[bool; 2]; 3] = [[false, true], [true, true], [false, false]];

/// A load of 2 t under 12 m of steel rope, 1 m above the ground, its winch at the jib.
fn landing(pinned: [bool; 2], limit: f64) -> Stepper {
    let mut scene = ground(0.0, Surface::default());
    let load = add_box(&mut scene, Vector3::z() * 1.5, 2000.0, Surface::default());
    scene.load = Some(load);
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
    let cable = Cable::round("rope", &Material::STEEL, 0.01, [end(0), end(1)])
        .with(|p| (p.segments, p.winch) = (Segments::Equal(12), Some(Winch::new())));
    let parts = scene.add_cable(&cable).unwrap();
    let lead = parts.joints[0];
    scene.controls.push(Control::of("lower", lead, 1.0));
    for joint in parts.joints {
        scene.break_at(joint, limit);
    }
    let last = scene.constraint("rope-end").unwrap();
    scene.events.push(event(
        "overload",
        over_force(last, limit),
        vec![set(0, 0.0)],
    ));
    scene.start_in_equilibrium = true;
    Stepper::new(scene, StepOptions::default()).unwrap()
}

/// Straight as it is, the cable stands as a column on the load that it has set down, and pushes.
#[test]
fn a_cable_that_pushes_does_not_break() {
    for pinned in PINNED {
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
    for pinned in PINNED {
        // A hard start.
        let mut stepper = landing(pinned, 1.2 * WEIGHT);
        assert_eq!(run(&mut stepper, 5), []);
        stepper.set_control(0, -0.8).unwrap();
        let log = run(&mut stepper, 30);
        let says = log.iter().any(|(_, name)| name.ends_with(" breaks"));
        assert!(says, "{pinned:?}: {log:?}");
    }
}

/// A hook picks a crate up, sets it down, picks it up again elsewhere, and hands it over.
fn picked() -> Scene {
    let mut scene = Scene::new("picked");
    let at = |x: f64| Vector3::x() * x;
    scene.add_body("hook", Body::sphere(0.1, 2.0));
    scene.add_body("crate", Body::sphere(0.1, 6.0).at(at(1.0)));
    scene.add_body("truck", Body::sphere(0.1, 9.0).at(at(2.0)));
    let tie = |a: usize, b: usize| attach("grip", [a, b].map(centre));
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
        scene.events.push(event(name, When::Time(time), then));
    }
    scene
}

#[test]
fn what_an_event_attached_an_event_releases_and_another_attaches_again() {
    let mut stepper = Stepper::new(picked(), dense()).unwrap();
    let mut seen = Vec::new();
    let mut fired = Vec::new();
    for step in 0..60 {
        stepper.step().unwrap();
        if step == 20 {
            // Between the second release and the second attachment.
            stepper = stepper.saved();
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
    let right = [
        None,
        pair(0, 1),
        None,
        pair(0, 1),
        pair(1, 2),
        pair(0, 2),
        None,
    ];
    assert_eq!(seen, right);
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
        let mut stepper = Stepper::new(scene, dense()).unwrap();
        assert_eq!(run(&mut stepper, 2).len(), 2);
        assert_eq!(stepper.scene().constraints.len(), left, "{first}");
    }
}

#[test]
fn what_can_never_be_there_is_not_released() {
    // The attachment goes with what it ties.
    let mut stepper = Stepper::new(picked(), dense()).unwrap();
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
    let Err(StepError::Scene(fault)) = Stepper::new(scene, dense()) else {
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
            let mut scene = on_earth("snap");
            let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -1.0));
            let ends = vec![origin(), centre(load)];
            let rope = MasslessCable::new(ends, 2.0, RowLaw::new(1e-7, 0.0));
            let rope = scene.add_constraint("rope", rope, 0);
            scene.events.push(event(
                "breaks",
                over_force(rope, above),
                vec![Action::Release(rope)],
            ));
            let options = dense().with(|o| o.substeps = substeps);
            let mut stepper = Stepper::new(scene, options).expect("sound");
            let log = run(&mut stepper, 36);
            let found = !log.is_empty();
            assert_eq!(found, breaks, "{substeps} sub-steps, {above} N: {log:?}");
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
        let between = [Frame::world(Vector3::x() * -0.4), centre(ball)];
        scene.events.push(event(
            "near",
            near(between, 0.1),
            vec![attach("hook", between)],
        ));
        let mut stepper =
            Stepper::new(scene, dense().with(|o| o.substeps = substeps)).expect("sound");
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
    let rope = reeled(winch(-0.5), frames, 5.0, RowLaw::new(1e-6, 0.1));
    let rope = scene.add_constraint("rope", rope, 0);
    scene.controls.push(Control::of("winch", rope, 1.0));
    scene
        .events
        .push(event("stop", When::Time(1.0), vec![set(0, 0.0)]));
    let options = dense().with(|o| o.energy_tolerance = Some(0.01));
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
                scene.events.push(event(
                    name,
                    When::Time(0.5),
                    vec![Action::Release(scene.constraint(name).unwrap())],
                ));
            }
            let options = dense().with(|o| (o.dt, o.substeps, o.scheme) = (dt, substeps, scheme));
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
            let holds = (fallen - 1.25).abs() < 1e-3 + first_order;
            assert!(holds, "{scheme:?} {dt} {substeps}: {fallen}");
        }
    }
}
