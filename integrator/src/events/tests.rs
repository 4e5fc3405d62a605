use crate::{StepError, StepOptions, Stepper};
use nalgebra::Vector3;
use taut_model::{
    Action, Body, Constraint, Distance, Event, Frame, GantryParams, RowLaw, Scene, SceneError, When,
};

fn options() -> StepOptions {
    StepOptions {
        backend: taut_solver::Backend::Dense(taut_solver::DenseOptions::default()),
        ..StepOptions::default()
    }
}

/// 100 kg on two equal links side by side.
fn twins() -> Scene {
    let mut scene = Scene::new("twins");
    scene.gravity = Vector3::z() * -10.0;
    let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -1.0));
    scene.load = Some(load);
    for name in ["left", "right"] {
        let link = Distance {
            frames: [
                Frame::world(Vector3::zeros()),
                Frame::body(load, Vector3::zeros()),
            ],
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
        let report = stepper.step().unwrap();
        assert_eq!(report.events, stepper.fired().len());
        log.extend(
            stepper
                .fired()
                .iter()
                .map(|name| (report.time, name.clone())),
        );
    }
    log
}

/// Of two equal ropes one breaks: the other carries the whole weight W after W/2, and swings up to 3/2 W.
#[test]
fn the_rope_that_is_left_takes_one_and_a_half_weights() {
    let options = StepOptions {
        dt: 1.0 / 960.0,
        ..options()
    };
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
    let between = Box::new([0, 1].map(|body| Frame::body(body, Vector3::zeros())));
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
    let between = Box::new([
        Frame::world(Vector3::zeros()),
        Frame::body(9, Vector3::zeros()),
    ]);
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
        let between = Box::new(ends.map(|i| Frame::body(i, Vector3::zeros())));
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
    let sound = Box::new([Frame::world(Vector3::x()), Frame::body(0, Vector3::zeros())]);
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
