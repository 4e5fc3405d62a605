use super::*;
use crate::contact::tests::{add_box, ground};
use crate::testing::*;

const WEIGHT: f64 = 9.81;

fn gantry() -> Stepper {
    let params = GantryParams::default().with(|p| p.segments = 4);
    Stepper::new(params.build().unwrap(), dense()).unwrap()
}

fn lock(frames: [Frame; 2]) -> Constraint {
    Constraint::Lock(Lock {
        frames,
        linear: RowLaw::RIGID,
        angular: RowLaw::RIGID,
    })
}

#[test]
fn a_change_that_changes_nothing_leaves_all_bits() {
    let [mut plain, mut changed] = [gantry(), gantry()];
    for stepper in [&mut plain, &mut changed] {
        stepper.set_control(0, 0.4).unwrap();
        stepper.steps(20);
    }
    changed.change(|_| Ok(())).unwrap();
    changed
        .change(|edit| {
            let body = edit.add_body("visitor", Body::sphere(1.0, 1.0));
            edit.remove_body(body)
        })
        .unwrap();
    for _ in 0..20 {
        let (a, b) = (plain.step().unwrap(), changed.step().unwrap());
        assert_eq!((a.solves, a.disagreement), (b.solves, b.disagreement));
        assert_eq!(plain.scene(), changed.scene());
        assert_eq!(plain.multipliers(), changed.multipliers());
    }
}

#[test]
fn what_stays_goes_on_as_it_was() {
    let [mut plain, mut changed] = [gantry(), gantry()];
    for stepper in [&mut plain, &mut changed] {
        stepper.set_control(0, 0.4).unwrap();
        stepper.set_control(1, 0.1).unwrap();
        stepper.steps(30);
    }
    // A body of its own between those that are there, so to speak: rows and bodies move, the motion does not.
    let far = Vector3::new(50.0, 0.0, 0.0);
    let visitor = changed
        .change(|edit| {
            let visitor = edit.add_body("visitor", Body::sphere(1.0, 1.0).at(far));
            let body = edit.body_index(visitor)?;
            let frames = [Frame::world(far), centre(body)];
            edit.add_constraint("pin", lock(frames), 0);
            Ok(visitor)
        })
        .unwrap();
    plain.steps(30);
    changed.steps(30);
    let of = |stepper: &Stepper| stepper.scene().bodies.position.clone();
    let alike = |plain: &Stepper, changed: &Stepper| {
        for (a, b) in of(plain).into_iter().zip(of(changed)) {
            assert!((a - b).norm() < 1e-12, "{a} {b}");
        }
    };
    alike(&plain, &changed);
    let body = changed.body_index(visitor).unwrap();
    assert_eq!(changed.scene().body_names[body], "visitor");
    assert!((of(&changed)[body] - far).norm() < 1e-12);
    changed
        .change(|edit| {
            edit.remove_constraint(edit.constraint("pin")?)?;
            edit.remove_body(visitor)
        })
        .unwrap();
    assert_eq!(changed.scene().bodies.len(), plain.scene().bodies.len());
    let gone = changed.body_index(visitor).unwrap_err();
    assert_eq!(gone, StepError::Gone { kind: "body" });
    plain.steps(30);
    changed.steps(30);
    alike(&plain, &changed);
}

#[test]
fn what_is_removed_is_gone_for_good() {
    let mut stepper = gantry();
    stepper.steps(3);
    let rope = stepper.constraint("rope-1").unwrap();
    let before = stepper.constraint("rope-2").unwrap();
    let again = stepper.scene().constraints[stepper.constraint_index(rope).unwrap()].clone();
    stepper.change(|edit| edit.remove_constraint(rope)).unwrap();
    let added = stepper.change(|edit| Ok(edit.add_constraint("rope-1", again, 0)));
    assert_ne!(added.unwrap(), rope);
    let stale = stepper.change(|edit| edit.remove_constraint(rope));
    assert_eq!(stale, Err(StepError::Gone { kind: "constraint" }));
    assert_eq!(stepper.constraint("rope-2").unwrap(), before);
    assert_eq!(stepper.constraint_index(before), Ok(1));
    stepper.change(|edit| edit.cut("cable", 1)).unwrap();
    let twice = stepper.change(|edit| edit.cut("cable", 1)).unwrap_err();
    let words = "cable `cable`: `segment-2` and `segment-3`: are not joined";
    assert!(twice.to_string().starts_with(words), "{twice}");
}

#[test]
fn a_body_added_at_rest_falls_as_one_that_was_there() {
    let scene = || {
        let mut scene = on_earth("fall");
        scene.add_body("first", Body::sphere(0.1, 1.0));
        scene
    };
    let mut stepper = Stepper::new(scene(), dense()).unwrap();
    let mut alone = Stepper::new(scene(), dense()).unwrap();
    stepper.steps(10);
    let late = stepper.change(|edit| Ok(edit.add_body("late", Body::sphere(0.1, 1.0))));
    let late = stepper.body_index(late.unwrap()).unwrap();
    stepper.steps(30);
    alone.steps(30);
    let [ours, theirs] =
        [(&stepper, late), (&alone, 0)].map(|(s, i)| s.scene().bodies.position[i].z);
    assert!((ours - theirs).abs() < 1e-12, "{ours} {theirs}");
}

#[test]
fn handles_are_of_one_body_and_one_stepper() {
    let mut stepper = gantry();
    let ball = || Body::sphere(1.0, 1.0);
    let short = stepper.change(|edit| {
        let body = edit.add_body("x", ball());
        edit.remove_body(body)?;
        Ok(body)
    });
    let mut leaked = None;
    let failed = stepper.change(|edit| {
        leaked = Some(edit.add_body("z", ball()));
        edit.cut("cable", 99)
    });
    assert!(failed.is_err());
    stepper
        .change(|edit| Ok(edit.add_body("y", ball())))
        .unwrap();
    let gone = Err(StepError::Gone { kind: "body" });
    assert_eq!(stepper.body_index(short.unwrap()), gone);
    assert_eq!(stepper.body_index(leaked.unwrap()), gone);
    let trolley = gantry().body("trolley").unwrap();
    assert_eq!(stepper.body_index(trolley), gone);
    // A constraint added in place of a removed one has a handle of its own.
    let rail = stepper.constraint("rail").unwrap();
    let again = stepper.scene().constraints[stepper.constraint_index(rail).unwrap()].clone();
    let new = stepper.change(|edit| {
        edit.remove_constraint(rail)?;
        Ok(edit.add_constraint("rail", again, 0))
    });
    assert!(stepper.constraint_index(new.unwrap()).is_ok());
    let found = stepper.constraint_index(rail);
    assert_eq!(found, Err(StepError::Gone { kind: "constraint" }));
}

/// The gantry's hoist follows its handle when the trolley's control goes, and no number can drive the wrong winch.
#[test]
fn a_control_keeps_its_handle_while_numbers_shift() {
    let mut stepper = gantry();
    let [trolley, hoist] =
        ["trolley_speed", "hoist_speed"].map(|name| stepper.control(name).unwrap());
    let brake = stepper.constraint("rail").unwrap();
    let unwinding = stepper.change(|edit| {
        edit.remove_constraint(brake)?;
        let origin = Vector3::zeros();
        let trolley = Frame::body(edit.body_index(edit.body("trolley")?)?, origin);
        let frames = [Frame::world(origin), trolley].map(|f| f.along(&Vector3::x()));
        let slider = Slider::new(frames).driven(Motor::speed(0.0));
        let rail = edit.add_constraint("new-rail", slider, 0);
        let rail = edit.constraint_index(rail)?;
        Ok(edit.add_control(Control::of("new_speed", rail, 1.0)))
    });
    let added = unwinding.unwrap();
    let gone = stepper.control_index(trolley);
    assert_eq!(gone, Err(StepError::Gone { kind: "control" }));
    assert_eq!(stepper.control_index(hoist), Ok(0));
    assert_eq!(stepper.control_index(added), Ok(1));
    assert_eq!(stepper.control("new_speed").unwrap(), added);
    stepper.set_control(1, 0.5).unwrap();
    let before = stepper.scene().bodies.position[1].x;
    stepper.steps(12);
    let moved = stepper.scene().bodies.position[1].x - before;
    assert!((moved - 0.1).abs() < 1e-9, "{moved}");
    let twice = stepper.change(|edit| {
        let rail = edit.constraint_index(edit.constraint("new-rail")?)?;
        Ok(edit.add_control(Control::of("second", rail, 1.0)))
    });
    let message = twice.unwrap_err().to_string();
    let holds = message.contains("`second`") && message.contains("`new-rail`");
    assert!(holds, "{message}");
    assert_eq!(stepper.scene().controls.len(), 2);
}

#[test]
fn what_does_not_go_is_refused_by_name_and_changes_nothing() {
    let mut stepper = gantry();
    stepper.steps(3);
    let before = stepper.scene().clone();
    type Work = fn(&mut Edit) -> Result<(), StepError>;
    let cases: &[(Work, &str)] = &[
        (
            |edit| edit.remove_body(edit.body("hook")?),
            "body `hook` cannot be removed while `rope-1` holds it",
        ),
        (
            |edit| edit.remove_body(edit.body("load")?),
            "body `load`: is the load",
        ),
        (
            |edit| {
                edit.add_body("hook", Body::sphere(1.0, 1.0));
                Ok(())
            },
            "two body entries are called `hook`",
        ),
        (
            |edit| edit.cut("cable", usize::MAX),
            "cable `cable`: segment 18446744073709551615: is not there",
        ),
        (
            |edit| edit.cut("rope", 0),
            "cable `rope` is not known: choose one of cable",
        ),
        (
            |edit| edit.remove_constraint(edit.constraint("nail")?),
            "`nail`, which is not there",
        ),
        (
            |edit| {
                edit.add_body("bad", Body::sphere(1.0, f64::NAN));
                Ok(())
            },
            "body `bad`: mass is NaN",
        ),
        (
            |edit| {
                edit.add_constraint("x", lock([origin(), centre(99)]), 0);
                let visitor = edit.add_body("visitor", Body::sphere(1.0, 1.0));
                edit.remove_body(visitor)
            },
            "names the body `number 99`",
        ),
    ];
    for (work, words) in cases {
        let message = stepper.change(work).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
        assert_eq!(stepper.scene(), &before);
    }
    stepper.solve().unwrap();
    let between = stepper.change(|_| Ok(())).unwrap_err().to_string();
    assert!(between.contains("change"), "{between}");
    stepper.advance().unwrap();
    // The whole cable may go: its joints hold hook and load no longer.
    stepper.change(|edit| edit.remove_cable("cable")).unwrap();
    assert!(stepper.scene().cables.is_empty());
}

#[test]
fn a_winch_rope_added_later_hangs_and_holds() {
    let mut scene = on_earth("crane");
    scene.add_body("crane", Body::fixed());
    scene.add_body("load", Body::sphere(0.3, 100.0).at(Vector3::z() * -5.0));
    scene.load = Some(1);
    let options = dense().with(|o| o.energy_tolerance = Some(0.1));
    let mut stepper = Stepper::new(scene, options).unwrap();
    stepper.steps(3);
    let rope = stepper
        .change(|edit| {
            let bottom = edit.scene().bodies.position[1];
            let ends = [CableEnd::Pinned(centre(0)), CableEnd::Pinned(centre(1))];
            let cable = Cable::round("rope", &Material::STEEL, 0.005, ends)
                .with(|p| (p.segments, p.joint) = (Segments::Equal(6), JointKind::Spherical));
            assert!(bottom.z < -5.0);
            edit.add_cable(&cable)
        })
        .unwrap();
    stepper.steps(600);
    let weight = WEIGHT * stepper.scene().mass();
    let top = stepper.tension(rope.joints[0]).unwrap();
    assert!((top / weight - 1.0).abs() < 0.5, "{top} {weight}");
}

#[test]
fn a_load_changes_its_mass() {
    let mut stepper = gantry();
    stepper.steps(5);
    let load = stepper.body("load").unwrap();
    let number = stepper.body_index(load).unwrap();
    let before = stepper.scene().bodies.clone();
    for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = stepper.change(|edit| edit.set_mass(load, mass));
        assert!(matches!(error, Err(StepError::Scene(_))), "{error:?}");
        assert_eq!(stepper.scene().bodies, before);
    }
    let mass = 3.0 * before.mass[number];
    stepper.change(|edit| edit.set_mass(load, mass)).unwrap();
    let bodies = &stepper.scene().bodies;
    assert_eq!(bodies.mass[number], mass);
    assert!((bodies.inertia[number] - before.inertia[number] * 3.0).amax() < 1e-9 * mass);
    assert_eq!(bodies.velocity, before.velocity);
    // It bounces on ropes that had carried less.
    let mut sum = 0.0;
    for _ in 0..600 {
        stepper.steps(1);
        sum += stepper.tension_in("cable", 3).unwrap();
    }
    let mean = sum / 600.0;
    assert!((mean / (mass * WEIGHT) - 1.0).abs() < 0.01, "{mean}");
}

#[test]
fn contacts_of_the_step_are_told_after_a_change() {
    let mut scene = ground(0.0, Surface::default());
    for x in [0.0, 3.0] {
        let at = Vector3::new(x, 0.0, 0.5);
        add_box(&mut scene, at, 10.0, Surface::default());
    }
    let mut stepper = Stepper::new(scene, dense()).unwrap();
    stepper.steps(5);
    let on = |stepper: &Stepper, name: &str| {
        let body = stepper.scene().body(name).unwrap();
        let forces = stepper.contacts().map(|contact| contact.on(body).z);
        forces.sum::<f64>()
    };
    let first = stepper.body("body-0").unwrap();
    stepper.change(|edit| edit.remove_body(first)).unwrap();
    for _ in 0..2 {
        let force = on(&stepper, "body-1");
        assert!((force / (10.0 * WEIGHT) - 1.0).abs() < 1e-6, "{force} N");
        stepper.steps(1);
    }
}
