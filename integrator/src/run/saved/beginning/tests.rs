//! Steps that a flag stops in their middle.

use crate::testing::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const DT: f64 = 1.0 / 60.0;

/// A load of 500 kg on a cable of segments that a winch pays out, above the ground. An event stops
/// the winch, another one ties a second body to the load.
fn hoist() -> Scene {
    let mut scene = on_earth("hoist");
    let load = Body::sphere(0.2, 500.0).at(Vector3::new(0.3, 0.0, -5.0));
    let load = scene.add_body("load", load);
    let other = scene.add_body("other", Body::sphere(0.1, 3.0).at(Vector3::z() * -4.0));
    for (name, body, radius) in [("load", load, 0.2), ("other", other, 0.1)] {
        scene.add_collider(Collider::new(name, Some(body), Shape::Sphere { radius }));
    }
    let mut ground = Collider::new("ground", None, Shape::HalfSpace);
    ground.position.z = -5.35;
    scene.add_collider(ground);
    let ends = [origin(), centre(load)];
    let cable = Cable::round("rope", &Material::STEEL, 0.01, ends.map(CableEnd::Pinned))
        .with(|p| (p.segments, p.winch) = (Segments::Equal(6), Some(winch(0.4))));
    let parts = scene.add_cable(&cable).expect("laid");
    scene
        .controls
        .push(Control::of("hoist", parts.joints[0], 1.0));
    let between = [centre(load), centre(other)];
    for (name, at, then) in [
        ("slow", 0.1, set(0, 0.2)),
        ("tie", 0.2, attach("tie", between)),
    ] {
        scene.events.push(event(name, When::Time(at), vec![then]));
    }
    scene.load = Some(load);
    scene
}

/// A load of `mass` (kg) that falls into a rope, which divides steps.
fn caught(mass: f64) -> Scene {
    let mut scene = on_earth("caught");
    let mut load = Body::sphere(0.2, mass).at(Vector3::z() * -1.9);
    load.velocity = Vector3::new(0.2, 0.0, -1.0);
    let load = scene.add_body("load", load);
    let frames = vec![origin(), centre(load)];
    let rope = MasslessCable::new(frames, 2.0, RowLaw::new(1e-12, 0.05));
    scene.add_constraint("rope", rope, 0);
    scene
}

/// What a report says, without times. NaN is NaN.
fn text_of(report: &StepReport) -> String {
    let report = StepReport {
        phases: Default::default(),
        ..*report
    };
    format!("{report:?}")
}

/// Runs a scene twice for so many steps: undisturbed, and with each step stopped at each of its
/// looks at the flag, or many of them, before it is made. Returns the stops.
fn stopped_everywhere(scene: &Scene, options: &StepOptions, steps: usize) -> usize {
    let place = &scene.name;
    let run = || Stepper::new(scene.clone(), options.clone()).expect("sound");
    let (mut whole, mut stopped) = (run(), run());
    stopped.stop_by(Arc::default());
    let mut stops = 0;
    for n in 0..steps {
        let before = stopped.save().expect("a sound state");
        let mut look = 1;
        let report = loop {
            stopped.step.effort.looks = (0, Some(look));
            match stopped.step() {
                Ok(report) => break report,
                Err(StepError::Stopped { .. }) => stops += 1,
                Err(other) => panic!("{place}, step {n}: {other}"),
            }
            let left = stopped.save().expect("a sound state");
            assert!(left == before, "{place}, step {n}, look {look}");
            look += 1 + look / 4;
        };
        stopped.step.effort.looks = (0, None);
        let mut again = Stepper::restore(before).expect("restored");
        again.step().expect("a step");
        let expected = whole.step().expect("a step");
        let end = whole.save().expect("a sound state");
        let found = stopped.save().expect("a sound state");
        assert!(found == end, "{place}, step {n}");
        let found = again.save().expect("a sound state");
        assert!(found == end, "{place}, step {n}, resumed");
        assert_eq!(text_of(&report), text_of(&expected), "{place}, step {n}");
        assert_eq!(stopped.fired(), whole.fired());
    }
    stops
}

fn all_options() -> Vec<StepOptions> {
    let plain = StepOptions::default().with(|o| (o.dt, o.energy_tolerance) = (DT, Some(1.0)));
    let parted = StepOptions {
        substeps: 3,
        sleep: Some(Sleep::default()),
        estimate: Some(2),
        ..plain.clone()
    };
    let unguarded = StepOptions {
        guard: None,
        substeps: 2,
        scheme: Scheme::Spook,
        ..plain.clone()
    };
    let implicit = StepOptions {
        guard: Some(Guard::default().with(|g| g.tolerance = 1e-9)),
        ..plain.clone()
    };
    vec![plain, parted, unguarded, implicit]
}

#[test]
fn a_step_that_is_stopped_anywhere_leaves_the_state_that_it_began_with() {
    let grounded = |kind: ContactScene| {
        let mut scene = ContactSceneParams::new(kind).build().expect("built");
        scene.bodies.velocity[0].y += 0.3;
        scene
    };
    let gantry =
        GantryParams::default().with(|p| (p.sheaves, p.sheave_friction, p.parts) = (true, 0.1, 4));
    let mut gantry = gantry.build().expect("built");
    for control in 0..gantry.controls.len() {
        gantry.set_control(control, 0.2, 0.0);
    }
    let scenes = [
        (hoist(), 20),
        (caught(300.0), 8),
        (gantry, 6),
        (grounded(ContactScene::Stack), 4),
        (grounded(ContactScene::Floor), 4),
    ];
    for (scene, steps) in scenes {
        for (k, options) in all_options().into_iter().enumerate() {
            let stops = stopped_everywhere(&scene, &options, steps);
            // At least one look in each step, and one in each sub-step.
            let least = steps * options.substeps;
            assert!(stops >= least, "{}, {k}: {stops}", scene.name);
        }
    }
}

/// The winch cuts the first segment in each sub-step, and ropes that catch make parts of steps.
#[test]
fn stops_after_a_cut_and_in_a_divided_step_put_back_bodies_shapes_and_laws() {
    let options = &all_options()[1];
    let mut stepper = Stepper::new(hoist(), options.clone()).expect("sound");
    stepper.stop_by(Arc::default());
    let before = stepper.scene().clone();
    stepper.step.effort.looks = (0, Some(3));
    let error = stepper.step().expect_err("stopped");
    let refused = matches!(error, StepError::Stopped { time } if time > 0.0);
    assert!(refused, "after a sub-step: {error}");
    assert!(*stepper.scene() == before);
    assert_eq!(stepper.time(), 0.0);
    stepper.step.effort.looks = (0, None);
    stepper.step().expect("a step");
    let found = &stepper.scene().bodies.mass;
    assert!(*found != before.bodies.mass, "nothing was cut");

    let mut stepper = Stepper::new(caught(300.0), options.clone()).expect("sound");
    let divided = (0..8).any(|_| stepper.step().expect("a step").divided > 0);
    assert!(divided, "no step was divided");
}

#[test]
fn a_flag_that_a_step_has_seen_stops_it_even_where_it_is_cleared_at_once() {
    let mut stepper = Stepper::new(hoist(), StepOptions::default()).expect("sound");
    let stop = Arc::new(AtomicBool::new(true));
    stepper.stop_by(Arc::clone(&stop));
    stepper.step.effort.begin();
    assert!(stepper.step.effort.is_stopped());
    stop.store(false, Ordering::Relaxed);
    assert!(stepper.step.effort.is_stopped());
    assert!(stepper.step.effort.check(0.5).is_err());
    stepper.step.effort.begin();
    assert!(!stepper.step.effort.is_stopped());
    stepper.step().expect("a step");
}

/// Handles of bodies, the estimate and the flag itself stay through a stop.
#[test]
fn a_stopped_run_keeps_its_handles_and_its_flag() {
    let mut stepper = Stepper::new(hoist(), all_options().remove(1)).expect("sound");
    let load = stepper.body("load").expect("a load");
    let extra = stepper.change(|edit| Ok(edit.add_body("more", Body::sphere(0.1, 1.0))));
    let extra = extra.expect("changed");
    let stop = Arc::new(AtomicBool::new(false));
    stepper.stop_by(Arc::clone(&stop));
    for _ in 0..3 {
        stepper.step().expect("a step");
        stop.store(true, Ordering::Relaxed);
        for _ in 0..2 {
            let error = stepper.step().expect_err("stopped");
            assert!(matches!(error, StepError::Stopped { .. }), "{error}");
        }
        stop.store(false, Ordering::Relaxed);
    }
    let report = stepper.step().expect("a step");
    let estimate = report.error.expect("an estimate");
    assert!(!estimate.lost && estimate.compared == 4, "{estimate:?}");
    assert_eq!(stepper.body("load").expect("a load"), load);
    assert_eq!(stepper.body("more").expect("another"), extra);
}

/// A run that goes on with other options still goes back to where a stopped step began.
#[test]
fn a_stop_after_other_options_goes_back_too() {
    let options = &all_options()[1];
    let mut stepper = Stepper::new(hoist(), options.clone()).expect("sound");
    stepper.stop_by(Arc::default());
    stepper.step().expect("a step");
    let options = options.clone().with(|o| o.dt = 0.5 * options.dt);
    stepper.set_options(options).expect("other options");
    let (before, time) = (stepper.scene().clone(), stepper.time());
    stepper.step.effort.looks = (0, Some(3));
    let error = stepper.step().expect_err("stopped");
    assert!(matches!(error, StepError::Stopped { .. }), "{error}");
    assert!(*stepper.scene() == before);
    assert_eq!(stepper.time(), time);
}
